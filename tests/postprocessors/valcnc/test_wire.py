"""valcnc's wire: nothing answers, so that each block has its simulated time to itself."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from camtool_postprocessors.valcnc.wire import ValcncWire
from hypothesis import assume, given
from hypothesis import strategies as st

from camtool.errors import MachineError
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import Consignment, consignment
from camtool.target.registry import load_target
from camtool.target.wire import Conversation, Manner, Place, WireState, Write
from tests.feeding import logo, made, same_motion
from tests.sending.talking import Talking
from tests.sending.talking import talked as talked_with
from tests.strategies import examples

LOADED = load_target("valcnc")
ANSWERS = load_target("valcnc", settings=["link.answer=ok"])


@cache
def consigned(*, answers: bool = False) -> Consignment:
    return consignment(logo("valcnc"), ANSWERS if answers else LOADED, source="logo.ngc")


def talked(stop_behind: int = 10**9) -> tuple[Conversation, list[tuple[float, bytes]]]:
    """Return the sent bytes with their times."""
    one = consigned()
    talk = one.wire.conversation(one.packets, LOADED.machine, Manner())
    out, now = list[tuple[float, bytes]](), 0.0
    talk.begin(now)
    while not talk.is_over or talk.has_actions:
        out += [(now, action.data) for action in talk.actions() if isinstance(action, Write)]
        if len(out) > stop_behind:
            talk.stop(now)
        if not talk.is_over:
            now = talk.next_s
            talk.tick(now)
    return talk, out


def test_each_block_goes_out_once_when_the_one_before_is_over() -> None:
    talk, out = talked()
    one = consigned()
    assert talk.state is WireState.FINISHED
    assert out[0] == (0.0, b"C\n")
    decoded = LOADED.target.read(b"".join(data for _, data in out[1:]), LOADED.machine)
    whole = LOADED.target.read(logo("valcnc"), LOADED.machine)
    assert (decoded.end == whole.end).all()
    for (at, data), (later, _), packet in zip(out, out[1:], one.packets, strict=False):
        assert later - at > packet.seconds + len(data) / 960.0


def test_a_stop_waits_for_the_block_that_is_cut() -> None:
    talk, out = talked(stop_behind=20)
    assert talk.state is WireState.STOPPED
    assert talk.done == talk.sent == len(out) == 21


def test_a_block_that_is_too_long_is_refused() -> None:
    long = b"G01 X1.0" + b"0" * 128 + b"\n"
    with pytest.raises(MachineError, match="takes 127"):
        ValcncWire().packets(long, LOADED.machine, None)  # type: ignore[arg-type]


def conversation(*, answers: bool = False) -> Conversation:
    one, machine = consigned(answers=answers), (ANSWERS if answers else LOADED).machine
    return one.wire.conversation(one.packets, machine, Manner())


@pytest.mark.parametrize("answers", [False, True])
@pytest.mark.parametrize("fault", ["", "late=20ms:0.5"])
def test_a_machine_that_hears_nothing_while_it_draws_hears_every_block(
    fault: str, answers: bool
) -> None:
    twin, loaded = made("valcnc", ["answer=ok"] if answers else [])
    talk, faults = conversation(answers=answers), Faults.of(fault)
    talked_with(talk, WiredTwin(twin, faults, faults, paced=True), latest_s=1000.0)
    assert talk.state is WireState.FINISHED, talk.why
    assert b"".join(twin.decoded) == logo("valcnc").replace(b" ", b"")
    same_motion(twin, logo("valcnc"), loaded)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("fault", ["drop=0.002", "double=0.002", "garble=0.002", "unplug=20s"])
def test_answers_that_fail_end_it_where_it_stands(fault: str, seed: int) -> None:
    twin, _ = made("valcnc", ["answer=ok"])
    talk = conversation(answers=True)
    line = WiredTwin(twin, faults_back=Faults.of(fault), seed=seed, paced=True)
    talked_with(talk, line, latest_s=1000.0)
    whole = logo("valcnc").replace(b" ", b"").splitlines(keepends=True)
    assert twin.decoded == whole[: len(twin.decoded)]
    assert talk.block < len(twin.decoded) <= talk.block + 2
    assert talk.state in (WireState.FINISHED, WireState.FAILED)
    assert (talk.state is WireState.FINISHED) == (
        len(twin.decoded) == talk.block + 1 == len(whole)
    )


@pytest.mark.parametrize("seed", range(3))
def test_a_block_that_is_lost_on_the_way_is_missed_where_it_answers(seed: int) -> None:
    twin, _ = made("valcnc", ["answer=ok", "wrong=block"])
    talk = conversation(answers=True)
    talked_with(talk, WiredTwin(twin, Faults(drop=0.005), seed=seed, paced=True), latest_s=1000.0)
    assert talk.state is WireState.FAILED
    assert len(twin.decoded) <= talk.block + 2


def test_a_pulled_plug_ends_it_where_it_stands() -> None:
    twin, _ = made("valcnc")
    talk, pulled = conversation(), Faults(unplug_s=20.0)
    talked_with(talk, WiredTwin(twin, pulled, pulled, paced=True), latest_s=1000.0)
    assert talk.state is WireState.FAILED
    assert "plug" in talk.why
    assert talk.block + 1 <= len(twin.decoded) <= talk.block + 2


def test_a_pause_is_between_blocks_and_goes_on_behind_them() -> None:
    twin, loaded = made("valcnc")
    talk = conversation()

    def wish(talk: Conversation, now: float) -> None:
        if talk.state is WireState.SENDING and talk.sent % 40 == 0:
            talk.pause(now)
        elif talk.state is WireState.PAUSED:
            assert not twin.is_moving
            talk.resume(now)

    talked_with(talk, WiredTwin(twin, paced=True), wish, latest_s=1000.0)
    assert talk.state is WireState.FINISHED, talk.why
    same_motion(twin, logo("valcnc"), loaded)


def test_what_it_says_unasked_is_an_error_only_where_answers_are_awaited() -> None:
    for answers, state in ((False, WireState.SENDING), (True, WireState.FAILED)):
        talk = conversation(answers=answers)
        talk.begin(0.0)
        talk.receive(b"hello\n", 0.0)
        talk.tick(1.0)
        assert talk.state is WireState.SENDING
        talk.receive(b"hello\n", 1.0)
        assert talk.state is state, talk.why


def test_what_a_person_types() -> None:
    terminal = LOADED.target.wire().terminal(LOADED.machine)  # type: ignore[union-attr]
    assert (terminal.hello, terminal.encode("G01 X1")) == (b"C\n", b"G01 X1\n")


# By hand: blocks are absolute, so that the place must be known.


def jogged(at_mm: Place | None, **values: float) -> tuple[Conversation, Any]:
    twin: Any = LOADED.twin([])
    if at_mm is not None and any(at_mm):
        x, y, z = at_mm
        jogged_to = ValcncWire().command(
            "jog", LOADED.machine, {"x": x, "y": y, "z": z}, Manner(at_mm=(0.0, 0.0, 0.0))
        )
        talked_with(jogged_to, WiredTwin(twin), latest_s=1000.0)
    talk = ValcncWire().command("jog", LOADED.machine, values, Manner(at_mm=at_mm))
    both = Talking(talk, WiredTwin(twin), now=twin.now)
    both.until(twin.now + 1000.0)
    return talk, twin


@given(st.tuples(*[st.floats(-20.0, 20.0)] * 3), st.tuples(*[st.floats(-9.0, 9.0)] * 3))
@examples(25)
def test_a_jog_moves_by_so_much_from_where_it_stands(at: Place, by: Place) -> None:
    x, y, z = by
    assume(max(map(abs, by)) > 0.01)
    talk, twin = jogged(at, x=x, y=y, z=z)
    assert talk.state is WireState.FINISHED, talk.why
    step = max(axis.coded_step_mm for axis in LOADED.machine.axes)
    wanted = np.array(at) + by
    np.testing.assert_allclose(twin.slides.commanded_mm, wanted, atol=1.1 * step)
    np.testing.assert_allclose(talk.place_mm, wanted, atol=step)


def test_the_tool_is_up_while_a_jog_crosses() -> None:
    for z in (3.0, -3.0):
        _, twin = jogged((0.0, 0.0, 5.0), x=4.0, y=2.0, z=z)
        places = twin.slides.trace.commanded
        crosses = (np.diff(places[:, :2], axis=0) != 0.0).any(axis=1)
        later = places[1:][crosses & (np.arange(1, len(places)) > np.argmax(places[:, 2] >= 5.0))]
        assert (later[:, 2] >= max(5.0, 5.0 + z) - 0.01).all()


def test_without_a_place_a_jog_is_refused_and_says_what_to_do() -> None:
    with pytest.raises(MachineError, match="does not say where it stands") as refused:
        jogged(None, x=1.0)
    assert "--at" in str(refused.value)
    with pytest.raises(MachineError, match="less than"):
        jogged((0.0, 0.0, 0.0), x=1e-7)
    with pytest.raises(MachineError, match="switch the controller off"):
        ValcncWire().command("zero", LOADED.machine, {}, Manner())
