"""Machines moved by hand: orders one after another on one line, jogs that last as long as a key is
held, and how far the slides come after it is let go."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from camtool.errors import MachineError
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import consignment
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.wire import Hand, Manner, Tell, WireState
from tests.sending.talking import Talking
from tests.sending.test_any_order import SETTINGS
from tests.strategies import examples

READY = WireState.READY


class AtHand:
    """A hand, the twin of its machine, and what it tells."""

    def __init__(
        self,
        name: str,
        choices: tuple[str, ...] = (),
        faults: Faults | None = None,
        target: LoadedTarget | None = None,
    ):
        self.target = target or load_target(name, settings=SETTINGS.get(name, ()))
        self.twin: Any = self.target.twin(list(choices))
        wire: Any = self.target.target.wire()
        self.hand: Hand = wire.hand(self.target.machine, Manner())
        self.told: list[str] = []
        actions = self.hand.actions

        def listened() -> Any:
            out = actions()
            self.told += [each.text for each in out if isinstance(each, Tell)]
            return out

        self.hand.actions = listened  # type: ignore[method-assign]
        line = WiredTwin(self.twin) if faults is None else WiredTwin(self.twin, faults, faults)
        self.both = Talking(self.hand, line)

    @property
    def now(self) -> float:
        return self.both.now

    def after(self, seconds: float) -> None:
        self.both.until(self.now + seconds)

    def until_ready(self, most_s: float = 60.0) -> None:
        end = self.now + most_s
        while self.hand.state is not READY and not self.hand.is_over and self.now < end:
            self.after(0.05)
        assert self.hand.state is READY, (self.hand.state, self.hand.why, self.told)

    def place(self) -> Any:
        return self.twin.slides.commanded_mm.copy()


def test_orders_follow_each_other_without_a_reset() -> None:
    """grbl: a command of its own would reset the controller before each."""
    at = AtHand("grbl")
    at.until_ready()
    resets = at.twin.commands.count(b"\x18")
    for x in (1.0, 2.0, -0.5):
        at.hand.order("jog", {"x": x, "feed": 300.0}, at.now)
        at.until_ready()
    assert at.place() == pytest.approx([2.5, 0.0, 0.0], abs=0.01)
    at.hand.order("zero", {"x": 0.0, "y": 5.0}, at.now)
    at.until_ready()
    at.after(10.0)  # its work zero comes with every tenth report
    assert at.hand.place_mm == pytest.approx((0.0, 5.0, 0.0), abs=0.01)
    assert at.twin.commands.count(b"\x18") == resets


def test_what_grbl_refuses_is_told_and_changes_nothing() -> None:
    at = AtHand("grbl")
    at.until_ready()
    at.hand.order("home", {}, at.now)  # homing is off in the twin's settings
    at.until_ready()
    assert any("homing is not enabled" in each for each in at.told)
    at.hand.order("jog", {"y": 1.0, "feed": 300.0}, at.now)
    at.until_ready()
    assert at.place()[1] == pytest.approx(1.0, abs=0.01)


def test_a_typed_line_is_answered() -> None:
    at = AtHand("grbl")
    at.until_ready()
    at.hand.say("$$", at.now)
    at.until_ready()
    assert any(each.startswith("$110=") and "highest rate" in each for each in at.told)
    at.hand.say("G1 X3 F200", at.now)
    at.until_ready()
    assert at.place()[0] == pytest.approx(3.0, abs=0.01)
    at.hand.say("G7", at.now)
    at.until_ready()
    assert any("error:20" in each for each in at.told)


def test_a_locked_grbl_takes_unlocking_alone() -> None:
    at = AtHand("grbl", ("homing=on",))
    at.until_ready()
    assert "locked" in at.hand.why
    with pytest.raises(MachineError, match="locked"):
        at.hand.order("jog", {"x": 1.0, "feed": 300.0}, at.now)
    at.hand.order("unlock", {}, at.now)
    at.until_ready()
    at.after(1.0)
    at.hand.order("jog", {"x": -1.0, "feed": 300.0}, at.now)
    at.until_ready()
    assert at.place()[0] == pytest.approx(-1.0, abs=0.01)


@examples(10)
@given(held_s=st.floats(0.01, 4.0), feed=st.floats(20.0, 500.0), sense=st.sampled_from([1, -1]))
def test_a_held_jog_ends_when_it_is_let_go(held_s: float, feed: float, sense: int) -> None:
    """Within the distance of braking, and what is fixed already (50 ms)."""
    at = AtHand("grbl")
    at.until_ready()
    at.hand.hold({"x": float(sense), "feed": feed}, at.now)
    at.after(held_s)
    let_go = at.place()
    at.hand.release(at.now)
    at.until_ready()
    speed, slows = feed / 60.0, at.target.machine.axes.x.acceleration_mm_s2
    assert slows is not None
    after = sense * (at.place()[0] - let_go[0])
    assert -1e-6 <= after <= speed * speed / (2.0 * slows) + 0.15 * speed + 0.02
    # It does move: at least as far as it comes when it speeds up all the time.
    assert (
        sense * at.place()[0]
        >= min(0.5 * slows * (held_s - 0.3) ** 2, speed * held_s) * (held_s > 0.5) * 0.3
    )


def test_a_held_jog_reaches_its_speed() -> None:
    at = AtHand("grbl")
    at.until_ready()
    at.hand.hold({"x": 1.0, "y": -1.0, "feed": 480.0}, at.now)
    at.after(3.0)
    before = at.place()
    at.after(2.0)
    way = at.place() - before
    assert np.hypot(way[0], way[1]) == pytest.approx(2.0 * 8.0, rel=0.05)
    at.hand.release(at.now)
    at.until_ready()


@examples(10)
@given(held_s=st.floats(0.1, 3.0))
def test_a_machine_whose_sender_is_gone_stands_soon(held_s: float) -> None:
    """kill -9 while a key is held: grbl has no more than the pieces that it was sent."""
    at = AtHand("grbl")
    at.until_ready()
    at.hand.hold({"x": 1.0, "feed": 480.0}, at.now)
    at.after(held_s)
    gone = at.place()
    at.twin.advance(at.now + 60.0)
    slows = at.target.machine.axes.x.acceleration_mm_s2
    assert slows is not None
    assert at.place()[0] - gone[0] <= 3.0 * 8.0 * 8.0 / (2.0 * slows) + 8.0 * 0.5


def test_the_joystick_of_the_pic_ends_at_the_next_step() -> None:
    at = AtHand("pic-mmh")
    at.until_ready()
    at.hand.hold({"y": -1.0, "feed": 60.0}, at.now)
    at.after(12.0)  # it makes up for the play first, and reports nothing of that
    before = at.place()
    assert before[1] < 0.0
    at.hand.release(at.now)
    at.until_ready()
    step = at.target.machine.axes.y.coded_step_mm
    assert abs(at.place()[1] - before[1]) <= 1.01 * step
    with pytest.raises(MachineError, match="one axis"):
        at.hand.hold({"x": 1.0, "y": 1.0, "feed": 60.0}, at.now)


@pytest.mark.parametrize("name", ["pic-mmh", "i8751", "linuxcnc"])
def test_steps_by_hand(name: str) -> None:
    at = AtHand(name)
    at.until_ready()
    for x in (0.2, -0.1):
        at.hand.order("jog", {"x": x, "feed": 60.0}, at.now)
        at.until_ready()
    step = at.target.machine.axes.x.coded_step_mm
    assert at.place()[0] == pytest.approx(0.1, abs=2.0 * step)


@pytest.mark.parametrize("name", ["grbl", "pic-mmh"])
def test_a_stop_ends_what_is_held(name: str) -> None:
    at = AtHand(name)
    at.until_ready()
    at.hand.hold({"x": 1.0, "feed": 200.0}, at.now)
    at.after(1.0)
    at.hand.stop(at.now)
    at.after(20.0)
    assert at.hand.state is WireState.STOPPED
    assert not at.twin.is_moving


def test_valcnc_jogs_from_the_place_that_the_user_has_said() -> None:
    at = AtHand("valcnc", ("answer=ok",))
    at.until_ready()
    with pytest.raises(MachineError, match="does not say where it stands"):
        at.hand.order("jog", {"x": 1.0}, at.now)
    with pytest.raises(MachineError, match="zero all axes at once"):
        at.hand.order("zero", {"x": 0.0}, at.now)
    at.hand.order("zero", dict.fromkeys("xyz", 0.0), at.now)
    for x in (2.0, -0.5):
        at.hand.order("jog", {"x": x, "z": 0.25}, at.now)
        at.until_ready()
    at.hand.say("G00 X0.5 Y0.125 Z0.0624", at.now)
    at.until_ready()
    at.hand.order("jog", {"y": 1.0}, at.now)
    at.until_ready()
    step = max(axis.coded_step_mm for axis in at.target.machine.axes)
    assert at.hand.place_mm == pytest.approx(tuple(at.place()), abs=0.51 * step)
    assert at.place() == pytest.approx([4.0, 2.0, 0.5], abs=step)


def test_a_place_that_has_become_unsure_is_forgotten() -> None:
    """An answer was lost: nobody knows whether the block was drawn."""
    at = AtHand("valcnc", ("answer=ok",))
    at.until_ready()
    at.hand.order("zero", dict.fromkeys("xyz", 0.0), at.now)
    at.both.line.back.faults = Faults(drop=1.0)
    at.hand.order("jog", {"x": 1.0}, at.now)
    at.until_ready()
    assert any("does not answer" in each for each in at.told)
    with pytest.raises(MachineError, match="does not say where it stands"):
        at.hand.order("jog", {"x": 1.0}, at.now)


def test_i8751_homes_when_the_user_says_that_it_was_reset() -> None:
    target = load_target("i8751", settings=(*SETTINGS["i8751"], "link.homing=start"))
    at = AtHand("i8751", ("homing=start", "origin_mm=-0.5"), target=target)
    at.until_ready()
    at.hand.order("home", {}, at.now)
    at.after(1.0)
    assert at.hand.state is WireState.WAITING
    assert "reset" in at.hand.why
    at.hand.resume(at.now)
    at.until_ready()
    assert at.place() == pytest.approx([-0.5] * 3, abs=0.0125)


@pytest.mark.parametrize(
    ("held_s", "feed", "senses"), [(2.0, 300.0, "x"), (0.5, 60.0, "xy"), (4.0, 900.0, "xy")]
)
def test_a_held_jog_of_linuxcnc_ends_when_it_is_let_go(
    held_s: float, feed: float, senses: str
) -> None:
    at = AtHand("linuxcnc")
    at.until_ready()
    at.hand.hold({**dict.fromkeys(senses, -1.0), "feed": feed}, at.now)
    at.after(held_s)
    let_go = at.place()
    assert np.hypot(*let_go[:2]) == pytest.approx(feed / 60.0 * held_s, abs=feed / 60.0 * 0.2)
    at.hand.release(at.now)
    at.until_ready()
    assert np.abs(at.place() - let_go).max() <= feed / 60.0 * 0.1 + 0.02
    at.hand.hold({"y": 1.0, "feed": feed}, at.now)
    at.after(1.0)
    gone = at.place()
    at.twin.advance(at.now + 60.0)  # camtool was killed
    assert 0.0 < at.place()[1] - gone[1] <= feed / 60.0 * 0.4


def test_a_program_waits_for_the_play_that_a_jog_has_left() -> None:
    """The PIC makes up for it in silence, 9 s of X and 8 s of Y, before the first step."""
    text = b"G54;G90;G00X00003.00Y00002.00;G00X00000.00Y00000.00;M30;"
    at = AtHand("pic-mmh")
    at.until_ready()
    for sense in (1.0, -1.0):
        at.hand.order("jog", {"x": 0.014 * sense, "y": 0.014 * sense, "feed": 1.0}, at.now)
        at.until_ready()
    one = consignment(text, at.target, source="part.pic")
    wire: Any = at.target.target.wire()
    conversation = wire.conversation(one.packets, at.target.machine, Manner())
    both = Talking(conversation, WiredTwin(at.twin))
    both.now = at.now
    both.until(at.now + 120.0)
    assert conversation.state is WireState.FINISHED, conversation.why
