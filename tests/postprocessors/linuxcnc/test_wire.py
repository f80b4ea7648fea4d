"""LinuxCNC's wire and its virtual controller, which share no code: they meet over lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from camtool.errors import MachineError
from camtool.sending.faults import WiredTwin
from camtool.sending.prepare import forecast_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.wire import Conversation, Manner, ResumePoint, WireState
from tests.feeding import logo, same_motion
from tests.sending.talking import talked

FILE = "/programs/part.ngc"
PROGRAM = (
    b"G21 G90 G61\nF600\n(a part)\nG0 Z5\nG0 X1 Y1\nM3 S1000\nG4 P0.5\nG1 Z-1 F100\nG1 X10 F600\n"
    b"G2 X12 Y3 I2 J0\nG1 X2\nG1 Y1\nG0 Z5\nM5\nM2\n"
)


def met(
    program: bytes,
    *,
    choices: list[str] | None = None,
    there: bool = True,
    wish: Callable[[Conversation, float], None] = lambda talk, now: None,
    **manner: Any,
) -> tuple[Any, Conversation, LoadedTarget]:
    """A program on its way to a twin: both, and the target."""
    loaded = load_target("linuxcnc")
    twin: Any = loaded.twin(choices or [])

    def read(name: str) -> bytes:
        if name != FILE or not there:
            raise FileNotFoundError
        return program

    twin.read_file = read
    wire: Any = loaded.target.wire()
    decoded = loaded.target.read(program, loaded.machine)
    packets = wire.packets(program, loaded.machine, forecast_of(decoded, loaded))
    talk = wire.conversation(packets, loaded.machine, Manner(file=FILE, **manner))
    talked(talk, WiredTwin(twin), wish, latest_s=2000.0)
    return twin, talk, loaded


@pytest.mark.parametrize("program", [PROGRAM, logo("linuxcnc")], ids=["part", "logo"])
def test_a_program_is_opened_run_and_watched_to_its_end(program: bytes) -> None:
    counts = []

    def wish(talk: Conversation, now: float) -> None:
        counts.append((talk.done, talk.acknowledged))

    twin, talk, loaded = met(program, wish=wish)
    assert talk.state is WireState.FINISHED, talk.why
    same_motion(twin, program, loaded)
    assert talk.done == len(talk.packets) == len(twin.decoded)
    done = np.array(counts)
    assert (np.diff(done, axis=0) >= 0).all()
    assert len(np.unique(done[:, 0])) > 4  # it is counted on the way
    assert talk.place_mm == pytest.approx(twin.slides.commanded_mm, abs=1e-6)


def test_what_is_done_has_been_done() -> None:
    loaded = load_target("linuxcnc")
    decoded = loaded.target.read(PROGRAM, loaded.machine)
    ends = forecast_of(decoded, loaded).end_mm

    def wish(talk: Any, now: float) -> None:
        block = talk.block
        if block >= 0 and not np.isnan(ends[block]).any() and talk.state is WireState.SENDING:
            trace = reached[0].slides.trace.commanded
            assert (np.abs(trace - ends[block]).max(axis=1) < 1e-6).any() or not ends[block].any()

    reached: list[Any] = []
    twin = loaded.twin([])
    twin.read_file = lambda name: PROGRAM  # type: ignore[attr-defined]
    reached.append(twin)
    wire: Any = loaded.target.wire()
    packets = wire.packets(PROGRAM, loaded.machine, forecast_of(decoded, loaded))
    talk = wire.conversation(packets, loaded.machine, Manner(file=FILE))
    talked(talk, WiredTwin(twin), wish, latest_s=100.0)
    assert talk.state is WireState.FINISHED, talk.why


def test_a_pause_stands_and_goes_on() -> None:
    seen: list[WireState] = []
    stood: list[int] = []

    def wish(talk: Any, now: float) -> None:
        seen.append(talk.state)
        if talk.acknowledged >= 8 and WireState.PAUSED not in seen:
            talk.pause(now)
        elif talk.state is WireState.PAUSED:
            stood.append(1)
            talk.resume(now)

    twin, talk, loaded = met(PROGRAM, wish=wish)
    assert talk.state is WireState.FINISHED, talk.why
    assert stood
    same_motion(twin, PROGRAM, loaded)


def test_single_lines_wait_each() -> None:
    places = []

    def wish(talk: Any, now: float) -> None:
        if talk.state is WireState.PAUSED:
            places.append(talk.place_mm)
            talk.resume(now)

    twin, talk, loaded = met(PROGRAM, wish=wish, single=True)
    assert talk.state is WireState.FINISHED, talk.why
    assert len(set(places)) >= 7
    same_motion(twin, PROGRAM, loaded)


def test_m0_waits_for_the_user() -> None:
    waits = []

    def wish(talk: Any, now: float) -> None:
        if talk.state is WireState.WAITING:
            waits.append(now)
            talk.resume(now)

    program = PROGRAM.replace(b"G1 X2\n", b"M0\nG1 X2\n")
    twin, talk, loaded = met(program, wish=wish)
    assert talk.state is WireState.FINISHED, talk.why
    assert len(waits) == 1
    same_motion(twin, program, loaded)


CHANGE = (
    b"G21 G90 G61\nT1 M6\nG43 H1\nG0 Z5\nM3 S1000\nG1 X4 F600\n(wide part)\nG1 X5\nM5\n"
    b"(T2: end mill 3 mm, sticks out 18 mm) (M6 here)\nT2 m06 (by hand)\nG43 H2 ; its length\n"
    b"M3 S900\nG1 X9\nM5\nT3M6\nG1 X2\nT4 M6\nM0\nG1 X0\nM2\n"
)


def test_it_stops_behind_each_tool_change_between_cuts() -> None:
    """On the line that puts the length in force, or else on that of M6; never twice."""
    loaded = load_target("linuxcnc")
    wire: Any = loaded.target.wire()
    decoded = loaded.target.read(CHANGE, loaded.machine)
    sent = wire.with_stops(CHANGE, loaded.machine, decoded)
    assert sent == CHANGE.replace(b"G43 H2", b"M0 G43 H2").replace(b"T3M6", b"T3M0 M6")
    again = loaded.target.read(sent, loaded.machine)
    assert np.array_equal(again.end[again.is_motion], decoded.end[decoded.is_motion])
    own = load_target("linuxcnc", settings=("link.stops_at_tools=false",))
    assert wire.with_stops(CHANGE, own.machine, decoded) == CHANGE
    stops: list[tuple[str, int]] = []

    def wish(talk: Any, now: float) -> None:
        if talk.state is WireState.WAITING:
            stops.append((talk.why, talk.packets[talk.stop_index].block))
            talk.resume(now)

    twin, talk, _ = met(sent, wish=wish)
    assert talk.state is WireState.FINISHED, talk.why
    note = "T2: end mill 3 mm, sticks out 18 mm; M6 here; by hand; its length"
    waits = "the program waits"
    assert stops == [(f"{waits}: {note}", 9), (waits, 13), (waits, 16)]
    same_motion(twin, CHANGE, loaded)


def test_overrides_while_it_is_held_and_one_that_is_refused_end_no_program() -> None:
    """linuxcncrsh takes no override of the spindle above 100 %."""
    seen: list[WireState] = []
    told: list[dict[str, int]] = []

    def wish(talk: Any, now: float) -> None:
        seen.append(talk.state)
        if talk.acknowledged >= 8 and WireState.PAUSED not in seen:
            talk.pause(now)
        elif talk.state is WireState.PAUSED and not told:
            told.append(dict(talk.overrides))
            talk.override("feed", 90, now)
            talk.override("spindle", 110, now)
        elif talk.state is WireState.PAUSED and talk.overrides["spindle"] == 100:
            told.append(dict(talk.overrides))
            talk.resume(now)

    twin, talk, loaded = met(PROGRAM, wish=wish)
    assert talk.state is WireState.FINISHED, talk.why
    assert told == [{}, {"feed": 90, "spindle": 100}]
    assert b"feed_override 90" in twin.commands
    same_motion(twin, PROGRAM, loaded)


@pytest.mark.parametrize("at_s", [1.0, 2.5, 4.0])
def test_a_stop_aborts_and_nothing_moves_behind_it(at_s: float) -> None:
    def wish(talk: Conversation, now: float) -> None:
        if now >= at_s:
            talk.stop(now)

    twin, talk, _ = met(PROGRAM, wish=wish)
    assert talk.state is WireState.STOPPED, talk.why
    count = len(twin.slides.trace)
    twin.advance(1000.0)
    assert len(twin.slides.trace) == count
    assert not twin.is_moving


@pytest.mark.parametrize(
    ("choices", "manner", "there", "words"),
    [
        (["power=estop"], {}, True, "emergency stop"),
        (["power=on"], {}, True, "not homed"),
        ([], {}, False, "cannot open"),
    ],
)
def test_what_it_is_not_ready_for(
    choices: list[str], manner: dict[str, bool], there: bool, words: str
) -> None:
    twin, talk, _ = met(PROGRAM, choices=choices, there=there, **manner)
    assert talk.state is WireState.FAILED
    assert words in talk.why
    assert len(twin.slides.trace) == 0


def test_it_is_homed_where_that_is_asked_for() -> None:
    _, talk, _ = met(PROGRAM, choices=["power=on"], home=True)
    assert talk.state is WireState.FINISHED, talk.why


def test_an_abort_at_the_machine_is_no_end() -> None:
    aborted = []

    def wish(talk: Any, now: float) -> None:
        if now > 3.0 and not aborted:
            aborted.append(now)
            twins[0]._abort()

    loaded = load_target("linuxcnc")
    twins: list[Any] = [loaded.twin([])]
    twins[0].read_file = lambda name: PROGRAM
    wire: Any = loaded.target.wire()
    decoded = loaded.target.read(PROGRAM, loaded.machine)
    packets = wire.packets(PROGRAM, loaded.machine, forecast_of(decoded, loaded))
    talk = wire.conversation(packets, loaded.machine, Manner(file=FILE))
    talked(talk, WiredTwin(twins[0]), wish, latest_s=100.0)
    assert talk.state is WireState.FAILED
    assert "before the end" in talk.why


def test_the_words_of_the_line_and_names_of_files() -> None:
    loaded = load_target("linuxcnc", settings=["link.folder=/home/cnc/nc"])
    wire: Any = loaded.target.wire()
    decoded = loaded.target.read(PROGRAM, loaded.machine)
    packets = wire.packets(PROGRAM, loaded.machine, forecast_of(decoded, loaded))
    talk = wire.conversation(packets, loaded.machine, Manner(file=r"C:\parts\a.ngc"))
    assert talk.manner.file == "/home/cnc/nc/a.ngc"
    with pytest.raises(MachineError, match="no blanks"):
        wire.conversation(packets, loaded.machine, Manner(file="/my parts/a b.ngc"))
    wrong = load_target("linuxcnc", settings=["link.password=other"])
    twin = wrong.twin([])
    talk = wire.conversation(packets, loaded.machine, Manner(file=FILE))
    talked(talk, WiredTwin(twin), latest_s=100.0)
    assert "password" in talk.why


@pytest.mark.parametrize(
    ("action", "values"),
    [
        ("home", {}),
        ("jog", {"x": 1.5, "y": -2.0, "feed": 300.0}),
        ("zero", {"x": 0.0, "y": 0.0, "z": 12.5}),
    ],
)
def test_by_hand(action: str, values: dict[str, float]) -> None:
    loaded = load_target("linuxcnc")
    twin: Any = loaded.twin(["power=on"] if action == "home" else [])
    wire: Any = loaded.target.wire()
    talk = wire.command(action, loaded.machine, values, Manner())
    talked(talk, WiredTwin(twin), latest_s=200.0)
    assert talk.state is WireState.FINISHED, talk.why
    if action == "jog":
        assert twin.slides.commanded_mm == pytest.approx([1.5, -2.0, 0.0])
    if action == "zero":
        assert twin._get("rel_act_pos") == _text(0.0, 0.0, 12.5)


def _text(*mm: float) -> str:
    return " ".join(f"{value:.6f}" for value in [*mm, 0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("place", "still", "ends", "tool_at", "said"),
    [
        ((0.0, 0.0, 0.0), True, [], "", ""),
        ((1.0, 0.0, 0.0), True, [(0.0, 0.0, 0.0)], "", "takes its place for X0.000 Y0.000 Z0.000"),
        ((1.0, 0.0, 0.0), False, [(0.0, 0.0, 0.0)], "", ""),
        (
            (1.0, 0.0, 0.0),
            False,
            [(0.0, 5.0, 0.0)],
            "",
            "was not stopped, and last seen at X1.000",
        ),
        ((1.0, 0.0, 0.0), False, [], "known", ""),
    ],
)
def test_it_goes_on_only_where_the_program_was_left(
    place: Any, still: bool, ends: list[Any], tool_at: Any, said: str
) -> None:
    standing = ResumePoint(place, still, np.array(ends).reshape(-1, 3), tool_at)
    twin, talk, _ = met(PROGRAM, standing=standing)
    assert (talk.state is WireState.FINISHED) is not bool(said), talk.why
    assert said in talk.why
    assert bool(twin.decoded) is not bool(said)


def test_it_cannot_be_told_where_it_stands() -> None:
    standing = ResumePoint((1.0, 0.0, 0.0), True, np.zeros((0, 3)), "journal")
    with pytest.raises(MachineError, match="keeps its own place"):
        met(PROGRAM, standing=standing)
