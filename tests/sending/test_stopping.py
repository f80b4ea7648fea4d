"""A stop at any moment, in whatever state the machine is: what stops it goes out at once, nothing
moves any more when "stopped" is said, and the slides come no farther than docs/sending.md says."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from random import Random
from typing import Any

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.sending.faults import Faults, Wired
from camtool.sending.prepare import forecast_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.twin import Twin
from camtool.target.wire import Conversation, Manner, State, Write
from tests.sending.talking import Talking

LONG_S = 10_000.0
"""Beyond the end of all that any machine here was told."""


@dataclass(frozen=True)
class Work:
    """What a machine is doing while it is stopped. `action`: a command by hand with `values`, or
    "send" a `program`. `first`: what must go out first, by the state that the twin is in (""
    stands for the others); `way_mm`: how far each slide may still move, by the same; `seconds`:
    the stop comes within these."""

    target: str
    action: str
    values: dict[str, float] = field(default_factory=dict)
    program: bytes = b""
    settings: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    home: bool = False
    first: dict[str, bytes] = field(default_factory=dict)
    way_mm: dict[str, float] = field(default_factory=dict)
    seconds: float = 20.0

    def loaded(self) -> LoadedTarget:
        return load_target(self.target, settings=self.settings)

    def begun(self) -> tuple[Talking, Twin]:
        """The conversation, and the machine that it is held with."""
        loaded = self.loaded()
        twin: Any = loaded.twin(list(self.choices))
        twin.slides.place(np.array(self.at))
        wire: Any = loaded.target.wire()
        manner = Manner(home=self.home)
        if self.action == "send":
            decoded = loaded.target.read(self.program, loaded.machine)
            packets = wire.packets(self.program, loaded.machine, forecast_of(decoded, loaded))
            talk = wire.conversation(packets, loaded.machine, manner)
        else:
            talk = wire.command(self.action, loaded.machine, self.values, manner)
        return Talking(talk, Wired(twin)), twin


GRBL_STOP_MM = 500.0**2 / 3600.0 / (2.0 * 10.0)
"""From 500 mm/min to rest at 10 mm/s², along the path."""

GRBL: dict[str, Any] = {
    "first": {"Home": b"\x18", "": b"!"},
    "way_mm": {"Home": 0.0, "": GRBL_STOP_MM + 0.004},
}
JOGS: dict[str, Any] = {**GRBL, "first": {"": b"\x85!"}}

WORKS = {
    "grbl jogs": Work("grbl", "jog", {"x": 80.0, "y": -30.0, "feed": 450.0}, **JOGS),
    "grbl homes": Work(
        "grbl", "home", choices=("homing=on",), at=(-60.0, -90.0, -40.0), seconds=18.0, **GRBL
    ),
    "grbl is zeroed": Work("grbl", "zero", {"x": 0.0, "z": 12.5}, seconds=1.0, **GRBL),
    "grbl cuts, dwells and waits": Work(
        "grbl",
        "send",
        program=b"G21G90\nM3S900\nG0X10Y4\nG1X2Y9F400\nG4P2.5\nG2X6Y13I4J0F300\nG1X30F500\nM0\nG0X0\n",
        seconds=25.0,
        **GRBL,
    ),
    "grbl homes before a program": Work(
        "grbl",
        "send",
        program=b"G21G90\nG1X-20Y-30F450\nG1X-60\n",
        choices=("homing=on",),
        at=(-30.0, -20.0, -15.0),
        home=True,
        seconds=14.0,
        **GRBL,
    ),
}


def of_state(table: dict[str, Any], twin: Any) -> Any:
    return table.get(getattr(twin, "state", ""), table[""])


def written(talk: Conversation) -> list[bytes]:
    return [action.data for action in talk.actions() if isinstance(action, Write)]


def way_since(twin: Twin, at_s: float, place: Floats) -> float:
    """The longest way of a slide from a place on, mm."""
    trace = twin.slides.trace
    after = trace.commanded[trace.time_s > at_s]
    steps = np.abs(np.diff(after, axis=0, prepend=place[None, :]))
    return float(steps.sum(axis=0).max())


def stopped_at(
    work: Work, moment_s: float, fault: Callable[[Wired], None] = lambda line: None
) -> tuple[Conversation, Twin]:
    """Stop it then, and see it stop."""
    both, twin = work.begun()
    talk, line = both.talk, both.line
    both.until(moment_s)
    if talk.ended:
        return talk, twin
    line.read(moment_s)
    now, place = moment_s, twin.slides.commanded_mm.copy()
    fault(line)
    first, most_mm = of_state(work.first, twin), of_state(work.way_mm, twin)
    talk.stop(now)
    out = written(talk)
    if not talk.ended:
        assert out[0] == first, (moment_s, out)
    for data in out:
        line.write(data, now)
    both.now = now
    both.until(now + LONG_S)
    assert talk.ended
    if talk.state is State.STOPPED:
        assert not twin.moves, talk.why
        assert talk.why.startswith("stopped"), talk.why
    count = len(twin.slides.trace)
    line.read(both.now + LONG_S)
    assert len(twin.slides.trace) == count, "it moves again"
    assert way_since(twin, now, place) <= most_mm + 1e-9
    return talk, twin


def moments(work: Work, count: int, seed: str) -> Sequence[float]:
    chance = Random(seed)
    return [0.0, *(chance.uniform(0.0, work.seconds) for _ in range(count - 1))]


def check(name: str, count: int) -> None:
    work = WORKS[name]
    for moment in moments(work, count, name):
        talk, _ = stopped_at(work, moment)
        assert talk.state in (State.STOPPED, State.FINISHED), (moment, talk.why)


@pytest.mark.parametrize("name", sorted(WORKS))
def test_a_stop_at_any_moment(name: str) -> None:
    check(name, 12)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(WORKS))
def test_a_thousand_stops(name: str) -> None:
    check(name, 1000)


def all_answers_lost(line: Wired) -> None:
    line.back.faults = Faults(drop=1.0)


@pytest.mark.parametrize("moment", [0.1, 3.0, 9.0])
@pytest.mark.parametrize("name", ["grbl jogs", "grbl homes", "grbl cuts, dwells and waits"])
def test_a_stop_whose_answer_is_lost_is_one_and_is_not_said_to_be(
    name: str, moment: float
) -> None:
    talk, twin = stopped_at(WORKS[name], moment, all_answers_lost)
    assert talk.state is State.FAILED
    assert "did not confirm the stop: switch it off" in talk.why
    assert not twin.moves


def test_a_hold_that_grbl_did_not_hear_is_said_again() -> None:
    work = WORKS["grbl jogs"]
    both, twin = work.begun()
    both.until(2.0)
    both.line.there.faults = Faults(drop=1.0)
    both.talk.stop(both.now)
    both.act()
    both.line.there.faults = Faults()
    both.until(60.0)
    assert both.talk.state is State.STOPPED
    assert twin.slides.commanded_mm[0] < 20.0


def test_one_that_slows_down_for_long_is_not_reset_meanwhile() -> None:
    slow = ("axes.x.acceleration_mm_s2=0.5", "axes.x.max_rate_mm_min=600")
    work = Work("grbl", "jog", {"x": 600.0, "feed": 600.0}, settings=slow)
    both, twin = work.begun()
    both.until(25.0)
    both.talk.stop(both.now)
    both.until(LONG_S)
    assert both.talk.why == "stopped: it has begun anew, and stands"
    assert not twin.moves
    assert way_since(twin, 25.0, np.array([0.0, 0.0, 0.0])) > 90.0  # 10 mm/s at 0.5 mm/s²


def test_a_second_stop_resets_grbl_at_once() -> None:
    both, twin = WORKS["grbl jogs"].begun()
    both.until(3.0)
    both.talk.stop(both.now)
    assert written(both.talk)[0] == b"\x85!"
    both.talk.hurry(both.now)
    assert written(both.talk) == [b"\x18"]
    both.line.write(b"\x18", both.now)
    both.until(LONG_S)
    assert not twin.moves
    assert both.talk.state is State.STOPPED
    assert "its position is lost" in both.talk.why


def test_done_is_said_of_a_jog_only_when_it_stands() -> None:
    both, twin = Work("grbl", "jog", {"x": 20.0, "feed": 300.0}).begun()
    both.until(LONG_S)
    assert both.talk.state is State.FINISHED
    assert twin.slides.commanded_mm[0] == pytest.approx(20.0)
    assert both.now > 4.0 - 1e-9
