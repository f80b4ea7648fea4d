"""A stop at any moment, in whatever state the machine is: what stops it goes out at once, nothing
moves any more when "stopped" is said, and the slides come no farther than docs/sending.md says."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.records import replace
from camtool.sending.drive import Driver, Request
from camtool.sending.faults import Faults, WiredTwin
from camtool.sending.prepare import forecast_of
from camtool.target.registry import LoadedTarget, load_target
from camtool.target.twin import Twin
from camtool.target.wire import Conversation, Manner, Tell, WireState, Write
from tests.feeding import ROOT, logo
from tests.oracles.grbl_firmware import (
    BYTE_S,
    STEPS_PER_MM,
    FirmwareLine,
    Switch,
    built,
    factory,
    source,
)
from tests.postprocessors.grbl.test_wire import Small
from tests.sending.talking import Talking
from tests.sending.test_any_order import PROGRAMS, SETTINGS
from tests.sending.test_ends import hosted
from tests.waiting import HANG_S

FILE = "/programs/part.ngc"
"""What LinuxCNC opens."""

LONG_S = 10_000.0
"""Beyond the end of all that any machine here was told."""


@dataclass(frozen=True)
class Work:
    """The work of a machine that is stopped. `action`: a command by hand with `values`, or
    "send" a `program`; `before`: what another sender has told the machine; `paced`: bytes take
    their time. `first`: what must go out first, by the state that the twin is in ("" stands for
    the others); `way_mm`: how far each slide may still move, by the same, None: to the end of the
    blocks that the machine has; `seconds`: the stop comes within these."""

    target: str
    action: str
    values: dict[str, float] = field(default_factory=dict)
    program: bytes = b""
    settings: tuple[str, ...] = ()
    choices: tuple[str, ...] = ()
    at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    home: bool = False
    before: bytes = b""
    paced: bool = False
    checked: bool = True
    first: dict[str, list[bytes]] = field(default_factory=lambda: {"": []})
    way_mm: dict[str, float | None] = field(default_factory=lambda: {"": None})
    seconds: float = 20.0

    def loaded(self) -> LoadedTarget:
        return load_target(self.target, settings=self.settings)

    def conversation(self) -> Conversation:
        """Make a conversation that has not begun; its sender has allowed the first packet."""
        loaded = self.loaded()
        wire: Any = loaded.target.wire()
        manner = Manner(home=self.home, file=FILE if wire.opens_file else "", checked=self.checked)
        if self.action == "send":
            decoded = loaded.target.read(self.program, loaded.machine)
            packets = wire.packets(self.program, loaded.machine, forecast_of(decoded, loaded))
            packets = [replace(packets[0], ask=""), *packets[1:]]
            talk = wire.conversation(packets, loaded.machine, manner)
        else:
            values = {"feed": 300.0, **self.values}
            talk = wire.command(self.action, loaded.machine, values, manner)
        assert isinstance(talk, Conversation)
        return talk

    def begun(self, line: Any = None) -> tuple[Talking, Twin]:
        """The conversation, and the machine that it is held with: its twin, or what is at the end
        of a line."""
        loaded = self.loaded()
        twin: Any = loaded.twin(list(self.choices))
        twin.slides.set_position(np.array(self.at))
        if self.before:
            twin.connect = twin.advance  # its board is not reset when the port is opened
            twin.receive(self.before, 0.0)
        talk = self.conversation()
        twin.read_file = lambda name: self.program
        return Talking(talk, line or WiredTwin(twin, paced=self.paced)), twin


GRBL_STOP_MM = 500.0**2 / 3600.0 / (2.0 * 10.0) + 500.0 / 60.0 * 0.05
"""From 500 mm/min to rest at 10 mm/s², along the path, behind the pieces of 10 ms, five at most,
that are fixed already."""

GRBL: dict[str, Any] = {
    "first": {"Home": [b"\x18"], "Start": [b"\x18"], "": [b"!", b"?"]},
    "way_mm": {"Home": 0.0, "": GRBL_STOP_MM + 0.004},
}
JOGS: dict[str, Any] = {**GRBL, "first": {"Start": [b"\x18"], "": [b"\x85!", b"?"]}}

PIC: dict[str, Any] = {"first": {"": [b"A;"]}, "way_mm": {"": 0.0}}
LINUXCNC: dict[str, Any] = {
    "first": {"": [b"set enable EMCTOO\r\n", b"set abort\r\n"]},
    "way_mm": {"": 0.0},  # its twin needs none to slow down
}

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
    "pic-mmh cuts": Work("pic-mmh", "send", program=PROGRAMS["pic-mmh"], seconds=30.0, **PIC),
    "pic-mmh jogs": Work("pic-mmh", "jog", {"x": 0.9, "y": -0.5}, seconds=8.0, **PIC),
    "pic-mmh homes": Work("pic-mmh", "home", seconds=60.0, **PIC),
    "linuxcnc cuts, dwells and waits": Work(
        "linuxcnc",
        "send",
        program=b"G21 G90 G61\nF400\nG0 X10\nG4 P3\nG1 X2 Y9\nG2 X6 Y13 I4 J0\nM0\nG1 X0\nM2\n",
        **LINUXCNC,
    ),
    "linuxcnc jogs": Work(
        "linuxcnc", "jog", {"x": 20.0, "z": -5.0, "feed": 120.0}, seconds=12.0, **LINUXCNC
    ),
    "linuxcnc homes": Work(
        "linuxcnc", "home", choices=("power=on",), at=(40.0, 5.0, 9.0), seconds=4.0, **LINUXCNC
    ),
    "i8751 cuts": Work(
        "i8751", "send", program=PROGRAMS["i8751"], settings=SETTINGS["i8751"], seconds=60.0
    ),
    "i8751 jogs": Work(
        "i8751", "jog", {"x": 12.0, "y": -3.0}, settings=SETTINGS["i8751"], seconds=12.0
    ),
    "valcnc cuts": Work("valcnc", "send", program=PROGRAMS["valcnc"], seconds=60.0),
    "matlab-router cuts": Work(
        "matlab-router",
        "send",
        program=logo("matlab-router", "dialect.format=stream"),
        settings=("dialect.format=stream", "link.echo=echo", "link.reset=none", "link.margin_s=0"),
        choices=("echo=characters", "reset=itself"),
        seconds=300.0,
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
    work: Work, moment_s: float, fault: Callable[[WiredTwin], None] = lambda line: None
) -> tuple[Conversation, Twin]:
    """Stop it then, and see it stop."""
    both, twin = work.begun()
    talk, line = both.talk, both.line
    both.until(moment_s)
    if talk.is_over:
        return talk, twin
    line.read(moment_s)
    now, place, blocks = moment_s, twin.slides.commanded_mm.copy(), len(twin.decoded)
    fault(line)
    first, most_mm = of_state(work.first, twin), of_state(work.way_mm, twin)
    talk.stop(now)
    actions = talk.actions()
    out = [action.data for action in actions if isinstance(action, Write)]
    if not talk.is_over:
        assert out == first, moment_s
    if not talk.is_over and not first:
        assert any("to its end" in action.text for action in actions if isinstance(action, Tell))
    for data in out:
        line.write(data, now)
    both.now = now
    both.until(now + LONG_S)
    assert talk.is_over
    if talk.state is WireState.STOPPED:
        assert not twin.is_moving, talk.why
        says = talk.why.startswith("stopped") or talk.why.endswith("says nothing")
        assert says, talk.why
    count = len(twin.slides.trace)
    line.read(both.now + LONG_S)
    assert len(twin.slides.trace) == count, "it moves again"
    if most_mm is None:
        assert len(twin.decoded) == blocks
    else:
        assert way_since(twin, now, place) <= most_mm + 1e-9
    return talk, twin


STOPPING = (b"!", b"\x85!", b"?", b"\x18", b"A;", b"set enable ", b"set abort", b"get ")
"""How all begins that may be written when a stop was asked for."""


def stopped_with_lines_to_go(work: Work, which: int) -> tuple[Conversation, Twin, list[bytes]]:
    """Stop it when it has this many times had something to write; what was written after that."""
    both, twin = work.begun()
    after, times, write = list[bytes](), [0], both.line.write

    def written_now(data: bytes, now: float) -> None:
        if times[0] >= which:
            after.append(data)
        write(data, now)

    def wish(talk: Conversation, now: float) -> None:
        times[0] += talk.has_actions
        if times[0] == which:
            times[0] = which + 1
            talk.stop(now)

    both.line.write = written_now  # type: ignore[method-assign]
    both.until(work.seconds, wish)
    if not both.talk.is_over and times[0] < which:
        times[0] = which + 1
        both.talk.stop(both.now)
    both.until(LONG_S)
    return both.talk, twin, after


@pytest.mark.parametrize("name", sorted(WORKS))
def test_what_was_not_written_yet_is_never_written(name: str) -> None:
    """A stop comes when an answer has just been heard, and the next lines are to go out."""
    for which in (1, 2, 3, 5, 9, 17):
        talk, twin, after = stopped_with_lines_to_go(WORKS[name], which)
        assert talk.state in (WireState.STOPPED, WireState.FINISHED)
        assert all(data.startswith(STOPPING) for data in after)
        assert not twin.is_moving


def moments(work: Work, count: int, seed: str) -> Sequence[float]:
    chance = Random(seed)
    return [0.0, *(chance.uniform(0.0, work.seconds) for _ in range(count - 1))]


def check(name: str, count: int) -> None:
    work = WORKS[name]
    for moment in moments(work, count, name):
        talk, _ = stopped_at(work, moment)
        assert talk.state in (WireState.STOPPED, WireState.FINISHED), (moment, talk.why)


@pytest.mark.parametrize("name", sorted(WORKS))
def test_a_stop_at_any_moment(name: str) -> None:
    check(name, 6)


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(WORKS))
def test_a_thousand_stops(name: str) -> None:
    check(name, 1000)


def all_answers_lost(line: WiredTwin) -> None:
    line.back.faults = Faults(drop=1.0)


@pytest.mark.parametrize("moment", [0.1, 3.0, 9.0])
@pytest.mark.parametrize("name", ["grbl jogs", "grbl homes", "grbl cuts, dwells and waits"])
def test_a_stop_whose_answer_is_lost_is_one_and_is_not_said_to_be(
    name: str, moment: float
) -> None:
    talk, twin = stopped_at(WORKS[name], moment, all_answers_lost)
    assert talk.state is WireState.FAILED
    assert "did not confirm the stop: switch it off" in talk.why
    assert not twin.is_moving


@pytest.mark.parametrize("name", ["grbl jogs", "grbl homes", "pic-mmh homes", "linuxcnc jogs"])
def test_a_stop_whose_answer_is_late_is_one(name: str) -> None:
    """As grbl's is that was reset while it homed; it has been silent for long before."""

    def late(line: WiredTwin) -> None:
        line.back.faults = Faults(late=1.0, late_s=0.4)

    talk, twin = stopped_at(WORKS[name], 7.0, late)
    assert talk.state is WireState.STOPPED, talk.why
    assert not twin.is_moving


def test_a_hold_that_grbl_did_not_hear_is_said_again() -> None:
    work = WORKS["grbl jogs"]
    both, twin = work.begun()
    both.until(2.0)
    both.line.there.faults = Faults(drop=1.0)
    both.talk.stop(both.now)
    both.act()
    both.line.there.faults = Faults()
    both.until(60.0)
    assert both.talk.state is WireState.STOPPED
    assert twin.slides.commanded_mm[0] < 20.0


def test_one_that_slows_down_for_long_is_not_reset_meanwhile() -> None:
    slow = ("axes.x.acceleration_mm_s2=0.5", "axes.x.max_rate_mm_min=600")
    work = Work("grbl", "jog", {"x": 600.0, "feed": 600.0}, settings=slow)
    both, twin = work.begun()
    both.until(25.0)
    both.talk.stop(both.now)
    both.until(LONG_S)
    assert both.talk.why == "stopped: it has begun anew, and stands"
    assert not twin.is_moving
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
    assert not twin.is_moving
    assert both.talk.state is WireState.STOPPED
    assert "its position is lost" in both.talk.why


END_STATES = {
    "grbl": Work("grbl", "jog", {"x": 20.0, "feed": 300.0}),
    "linuxcnc": Work("linuxcnc", "jog", {"x": 20.0, "feed": 300.0}),
    "i8751": Work("i8751", "jog", {"x": 20.0}, settings=SETTINGS["i8751"]),
    **{
        f"pic-mmh, {step} {echo}": Work(
            "pic-mmh",
            "jog",
            {"x": 0.7, "y": 0.2},
            settings=(f"link.step_byte={step}", f"link.echo={echo}"),
            choices=(f"step_byte={step}", f"echo={'none' if echo == 'none' else 'string'}"),
        )
        for step in ("bits", "letters", "none")
        for echo in ("echo", "none")
    },
}


@pytest.mark.parametrize("name", sorted(END_STATES))
def test_done_is_said_of_a_jog_only_when_it_stands(name: str) -> None:
    """And back again, which pic-mmh begins with steps that it does not report."""
    work = END_STATES[name]
    both, twin = work.begun()
    both.until(LONG_S)
    wire: Any = work.loaded().target.wire()
    back = {key: value if key == "feed" else -value for key, value in work.values.items()}
    talks = [both.talk, wire.command("jog", work.loaded().machine, back, Manner())]
    for talk, x in zip(talks, (work.values["x"], 0.0), strict=True):
        if talk is not both.talk:
            line = WiredTwin(twin)
            line.read(both.now)
            talk.begin(both.now)
            both.talk, both.line = talk, line
            both.until(2.0 * LONG_S)
        assert talk.state is WireState.FINISHED, talk.why
        assert not twin.is_moving
        assert twin.slides.commanded_mm[0] == pytest.approx(x, abs=0.02)


@pytest.mark.parametrize("echo", ["echo", "none"])
@pytest.mark.parametrize("step", ["bits", "none"])
def test_done_is_said_of_homing_only_when_it_stands(step: str, echo: str) -> None:
    work = Work(
        "pic-mmh",
        "home",
        settings=(f"link.step_byte={step}", f"link.echo={echo}"),
        choices=(f"step_byte={step}", f"echo={'none' if echo == 'none' else 'string'}"),
    )
    both, twin = work.begun()
    both.until(LONG_S)
    if step == "bits":
        assert both.talk.state is WireState.FINISHED, both.talk.why
        assert not twin.is_moving
    else:
        assert both.talk.why == "nothing says when it stands, since link.step_byte is none"


# As processes: signals, keys, terminals and pipes.

SLOWLY = ("axes.x.acceleration_mm_s2=0.02",)
"""Of a machine that slows down for minutes."""

PROGRAM = b"G21G90\nG1X150F30\nG1X0\n"


@dataclass
class Running:
    """camtool at work on a machine: the process, what the machine was sent, and the machine."""

    process: subprocess.Popen[bytes]
    sent: bytearray
    twin: Any
    keyboard: int | None = None

    def wait_for(self, ready: Callable[[], bool]) -> None:
        """As long as the process lives."""
        while not ready():
            assert self.process.poll() is None, self.process.communicate()
            time.sleep(0.01)

    def signalled(self, name: str) -> None:
        self.process.send_signal(getattr(signal, name))

    def ended(self) -> str:
        """Wait for the end and return the text on stderr."""
        _, said = self.process.communicate(timeout=HANG_S)
        return (said or b"").decode()


@contextmanager
def at_work(
    words: Sequence[str],
    work: Work,
    *,
    begun: Callable[[Any], bool] = lambda twin: len(twin.slides.trace) > 5,
    terminal: bool = False,
    started: Callable[[Any], None] = lambda process: None,
    **pipes: Any,
) -> Iterator[Running]:
    """camtool, when its machine has begun to move. `terminal`: keys come from one, which is also
    that of the process's session."""
    twin: Any = work.loaded().twin(list(work.choices))
    twin.slides.set_position(np.array(work.at))
    sent, receive = bytearray(), twin.receive

    def heard(data: bytes, now: float) -> bytes:
        sent.extend(data)
        answer: bytes = receive(data, now)
        return answer

    twin.receive = heard
    flags = [each for setting in work.settings for each in ("--set", setting)]
    master = slave = None
    if terminal:
        master, slave = pty.openpty()
        pipes = {"stdin": slave, **pipes}

    def prepare() -> None:
        signal.signal(signal.SIGHUP, signal.SIG_DFL)  # ignored where the tests run under nohup
        if terminal:
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

    pipes = {"preexec_fn": prepare, **pipes}
    pipes = {"stdin": subprocess.DEVNULL, "stderr": subprocess.PIPE, **pipes}
    with hosted(twin, 1.0) as port:
        of = [work.target, port] if words[0] == "console" else ["-t", work.target, "--port", port]
        command = [sys.executable, "-m", "camtool", *words, *of]
        with subprocess.Popen([*command, "--baud", "9600", *flags], **pipes) as process:
            if slave is not None:
                os.close(slave)
            running = Running(process, sent, twin, master)
            started(process)
            try:
                running.wait_for(lambda: begun(twin))
                yield running
            finally:
                process.kill()
        if running.keyboard is not None:
            os.close(running.keyboard)


JOG = Work("grbl", "jog")
HOME = Work("grbl", "home", choices=("homing=on",), at=(-150.0, -150.0, -150.0))


SLOW = pytest.mark.slow


@pytest.mark.parametrize(
    "name",
    [
        "SIGTERM",
        "SIGTSTP",
        *(pytest.param(each, marks=SLOW) for each in ("SIGINT", "SIGHUP", "SIGQUIT")),
    ],
)
def test_every_signal_that_would_end_a_jog_stops_it(name: str) -> None:
    with at_work(["jog", "X150", "F30"], JOG) as it:
        it.signalled(name)
        said = it.ended()
        assert "error: jog: stopped: it has begun anew, and stands" in said
        assert it.process.returncode == 1
        assert b"\x85!" in it.sent
        assert it.sent.endswith(b"\x18")
        assert not it.twin.is_moving
        assert it.twin.slides.commanded_mm[0] < 149.0


@pytest.mark.parametrize("name", ["SIGINT", pytest.param("SIGHUP", marks=SLOW)])
def test_a_signal_resets_a_machine_that_homes(name: str) -> None:
    with at_work(["home"], HOME) as it:
        it.signalled(name)
        assert "stopped" in it.ended()
        assert b"$H\n\x18" in it.sent
        assert not it.twin.is_moving
        assert it.twin.slides.commanded_mm[2] < -1.0


@pytest.mark.parametrize(
    "name", ["SIGHUP", *(pytest.param(each, marks=SLOW) for each in ("SIGINT", "SIGTERM"))]
)
def test_a_signal_stops_a_program(name: str, tmp_path: Path) -> None:
    program = tmp_path / "long.nc"
    program.write_bytes(PROGRAM)
    with at_work(["send", str(program), "--yes"], Work("grbl", "send")) as it:
        it.signalled(name)
        assert "stopped: it has begun anew, and stands; no block is done" in it.ended()
        assert b"!" in it.sent
        assert it.sent.endswith(b"\x18")
        assert not it.twin.is_moving


def test_q_stops_a_jog() -> None:
    with at_work(["jog", "X150", "F30"], JOG, terminal=True) as it:
        assert it.keyboard is not None
        os.write(it.keyboard, b"q")
        assert "stopped" in it.ended()
        assert b"\x85!" in it.sent


@pytest.mark.parametrize("words", [["jog", "X150", "F30"], ["send", "long.nc", "--yes"]])
def test_a_terminal_that_is_closed_stops_the_machine(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("long.nc").write_bytes(PROGRAM)
    with at_work(words, JOG, terminal=True) as it:
        assert it.keyboard is not None
        os.close(it.keyboard)
        it.keyboard = None
        assert "stopped" in it.ended()
        assert it.sent.endswith(b"\x18")
        assert not it.twin.is_moving


@pytest.mark.parametrize("stream", ["stdout", "stderr"])
@pytest.mark.parametrize(
    "words", [["jog", "X150", "F30"], ["send", "long.nc", "--yes", "--json"]], ids=["jog", "send"]
)
def test_a_reader_that_goes_away_stops_the_machine(
    stream: str, words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("long.nc").write_bytes(PROGRAM)
    with at_work(words, JOG, **{stream: subprocess.PIPE}) as it:
        pipe = getattr(it.process, stream)
        pipe.close()
        setattr(it.process, stream, None)
        it.ended()
        assert it.process.returncode not in (0, -signal.SIGKILL)
        assert it.sent.endswith(b"\x18")
        assert not it.twin.is_moving


def test_a_reader_that_reads_nothing_keeps_no_machine_waiting(tmp_path: Path) -> None:
    program = tmp_path / "long.nc"
    program.write_bytes(b"G21G90\n" + b"G1X1F900\nG1X0\n" * 200 + PROGRAM)
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with suppress(BlockingIOError):
        while True:
            os.write(writer, b"x" * 512)
    os.set_blocking(writer, True)
    words = ["send", str(program), "--yes", "--json"]
    with at_work(words, Work("grbl", "send"), stdout=writer) as it:
        os.close(writer)
        it.signalled("SIGINT")
        assert "stopped: it has begun anew, and stands" in it.ended()
        assert not it.twin.is_moving
    os.close(reader)


def test_a_second_interrupt_waits_no_longer_and_still_stops_it() -> None:
    work = Work("grbl", "jog", settings=SLOWLY)
    with at_work(["jog", "X150", "F30"], work) as it:
        it.signalled("SIGINT")
        it.wait_for(lambda: b"\x85!" in it.sent)
        time.sleep(0.6)  # sooner, it would be taken for the same
        it.signalled("SIGINT")
        said = it.ended()
        assert "camtool was ended before the machine said that it stands" in said
        while not it.sent.endswith(b"\x18"):  # on its way when the process ended
            time.sleep(0.01)
        assert not it.twin.is_moving


def test_a_sighup_that_nohup_ignores_stops_nothing() -> None:
    def nohup() -> None:
        signal.signal(signal.SIGHUP, signal.SIG_IGN)

    with at_work(["jog", "X150", "F30"], JOG, preexec_fn=nohup) as it:
        it.signalled("SIGHUP")
        count = len(it.sent)
        it.wait_for(lambda: len(it.sent) > count + 3)  # it is still asked how it stands
        assert b"!" not in it.sent
        it.signalled("SIGTERM")
        assert "stopped" in it.ended()


# The driver, whatever fails around it.


LINES = b"G21G90\nG1F500\n" + b"".join(b"X%d\n" % x for x in range(1, 150))
SMALL = Work("grbl", "send", program=LINES, checked=False)


class Recorded:
    """A line to a grbl of few words, that fails where it is told to."""

    def __init__(self, read: Callable[[], bytes | None] = lambda: None) -> None:
        self.small, self.waiting, self.wrote, self.opens = Small(), list[bytes](), b"", 0
        self._reads = read

    def read(self, wait_s: float) -> bytes:
        said = self._reads()
        self.waiting += self.small.run(time.monotonic())
        come, self.waiting = self.waiting, []
        return b"".join(each + b"\r\n" for each in come) if said is None else said

    def write(self, data: bytes) -> None:
        self.wrote += data
        self.waiting += self.small.write(data, time.monotonic())

    def reopen(self, wait_s: float) -> None:
        self.opens += 1
        raise OSError("it is not there")

    def close(self) -> None:
        self.wrote += b"(closed)"


@pytest.mark.parametrize(
    "error", [BrokenPipeError(), RuntimeError("a fault"), KeyboardInterrupt()], ids=repr
)
@pytest.mark.parametrize("where", ["watch", "tell", "read"])
def test_whatever_fails_around_a_conversation_stops_the_machine(
    error: BaseException, where: str
) -> None:
    talk = SMALL.conversation()
    failed: list[int] = []

    def fail(what: Any = None) -> None:
        if talk.acknowledged > 3 and not failed:
            failed.append(1)
            raise error

    line = Recorded(fail if where == "read" else lambda: None)
    driver = Driver(line)
    if where == "tell":
        driver.tell = lambda text: fail()
        driver.wish = lambda: Request.STOP if talk.acknowledged > 3 else None
    elif where == "watch":
        driver.watch = fail
    if isinstance(error, OSError) and where != "read":
        driver.carry(talk)
        assert driver.trouble is not None
    elif isinstance(error, OSError):  # of the port: nobody can be told anything
        assert driver.carry(talk) is WireState.FAILED
        assert "the port is gone" in talk.why
        assert "it goes on with the lines that it has" in talk.why
        return
    else:
        with pytest.raises(type(error)):
            driver.carry(talk)
    assert failed
    assert talk.state is WireState.STOPPED
    assert b"!" in line.wrote
    assert line.wrote.endswith(b"\x18")
    assert line.small.buffer == b""


def test_a_second_stop_closes_the_port_when_all_is_written() -> None:
    """Of a machine that does not say that it stands."""
    line, talk = Recorded(), SMALL.conversation()
    wishes, write = [Request.STOP, Request.CLOSE], line.small.write
    line.small.write = lambda data, now: write(data, now) if len(wishes) == 2 else []  # type: ignore[method-assign]
    driver = Driver(line, wish=lambda: wishes.pop(0) if talk.acknowledged > 3 and wishes else None)
    assert driver.carry(talk) is WireState.FAILED
    assert talk.why.startswith("camtool was ended before the machine said that it stands")
    assert line.wrote.endswith(b"!?\x18(closed)")


def test_a_port_that_does_not_come_back_holds_up_no_stop() -> None:
    settings = ("dialect.format=stream", "link.echo=none", "link.reset=opening")
    work = replace(WORKS["matlab-router cuts"], settings=settings)
    talk, line = work.conversation(), Recorded()
    line.small.write = lambda data, now: []  # type: ignore[method-assign]
    driver = Driver(line, wish=lambda: Request.STOP if line.opens > 1 else None, speed=1e6)
    assert driver.carry(talk) is WireState.STOPPED
    assert line.opens == 2
    assert talk.done == 1


# At a console.


def at_console(name: str, text: str, speed: float = 1.0, *more: str) -> tuple[Any, str, int]:
    """The machine behind a console that was given this by a pipe; what was said, and the code."""
    twin: Any = load_target(name).twin([])
    with hosted(twin, speed) as port:
        command = [sys.executable, "-m", "camtool", "console", name, port, "--baud", "9600", *more]
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    return twin, done.stdout + done.stderr, done.returncode


def test_a_stop_in_a_pipe_waits_for_nothing() -> None:
    twin, said, code = at_console("pic-mmh", "JX+;\nA;\nPX+0003;\n")
    assert code == 0, said
    assert not twin.is_moving
    assert twin.commands == [b"JX+;", b"A;", b"PX+0003;"]
    twin, said, code = at_console("grbl", "G4P900\n!\n^X\n$G\n")
    assert code == 0, said
    assert "[GC:G0" in said


def test_what_would_go_on_for_ever_is_stopped_at_the_end_of_a_pipe() -> None:
    twin, said, code = at_console("pic-mmh", "JX+;\n")
    assert code == 1
    assert "it would go on without an end: it is told to stop" in said
    assert "it says that it stands" in said
    assert not twin.is_moving


def test_steps_that_are_not_reported_are_no_rest() -> None:
    twin, said, code = at_console("pic-mmh", "PX+0100\nPX-0100\nPX+0003\n", 20.0)
    assert code == 0, said
    assert twin.slides.commanded_mm[0] == pytest.approx(3 * 0.00014, rel=0.1)
    assert "100 × X-" in said


@pytest.mark.parametrize(
    ("name", "text", "first", "how"),
    [
        ("grbl", b"G1X150F30\n", b"\x85!", "SIGTERM"),
        ("grbl", b"$J=G91X150F30\n", b"\x85!", "closed"),
        ("pic-mmh", b"PX+9999;\n", b"A;", "SIGINT"),
        ("pic-mmh", b"JX+;\n", b"A;", "SIGHUP"),
    ],
)
def test_what_ends_a_console_stops_the_machine(
    name: str, text: bytes, first: bytes, how: str
) -> None:
    work = Work(name, "console")
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    feeds: list[Any] = []

    def begun(twin: Any) -> bool:
        if feeds and len(feeds) < 2:
            feeds.append(feeds[0].stdin.write(text))
            feeds[0].stdin.flush()
        return len(twin.slides.trace) > 5

    with at_work(["console"], work, begun=begun, started=feeds.append, **pipes) as it:
        if how == "closed":
            it.process.stdout.close()  # type: ignore[union-attr]
            it.process.stdout = None
        else:
            it.signalled(how)
        said = it.ended()
        assert "the machine is told to stop" in said
        assert "it says that it stands" in said
        assert it.process.returncode == 1
        assert first in it.sent
        assert not it.twin.is_moving
        if name == "grbl":
            assert it.sent.endswith(b"\x18")


def test_a_console_resets_a_machine_that_homes() -> None:
    loaded = load_target("grbl")
    wire: Any = loaded.target.wire()
    terminal = wire.terminal(loaded.machine)
    terminal.decode(b"\r\nGrbl 1.1h ['$' for help]\r\n")
    terminal.encode("$G")
    terminal.encode("$H")
    assert terminal.halt() == b"\x18"
    terminal.decode(b"ALARM:6\r\n\r\nGrbl 1.1h ['$' for help]\r\n")
    assert terminal.stands
    terminal.encode("$H")
    terminal.decode(b"ok\r\n")
    terminal.encode("G1X9")
    assert terminal.halt() == b"\x85!"
    terminal.decode(b"<Hold:1|MPos:1.000,0.000,0.000|FS:9,0>\r\n")
    assert not terminal.stands
    terminal.decode(b"<Hold:0|MPos:1.000,0.000,0.000|FS:0,0>\r\n")
    assert terminal.stands


def test_a_console_of_linuxcnc_asks_until_the_place_is_the_same() -> None:
    loaded = load_target("linuxcnc")
    wire: Any = loaded.target.wire()
    terminal = wire.terminal(loaded.machine)
    assert terminal.halt() == b"set abort\r\n"
    for x, status, stands in ((1, "RUNNING", False), (2, "IDLE", False), (3, "IDLE", False)):
        terminal.decode(b"PROGRAM_STATUS %s\r\nREL_ACT_POS %d 0 0\r\n" % (status.encode(), x))
        assert terminal.stands == stands
    terminal.decode(b"PROGRAM_STATUS IDLE\r\nREL_ACT_POS 3 0 0\r\n")
    assert terminal.stands


def test_a_machine_that_nothing_stops_is_said_to_be_one() -> None:
    work = Work("valcnc", "console")
    feeds: list[Any] = []
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}

    def begun(twin: Any) -> bool:
        if feeds and len(feeds) < 2:
            feeds.append(feeds[0].stdin.write(b"G01X1Y0Z0\n"))
            feeds[0].stdin.flush()
        return len(twin.slides.trace) > 5

    with at_work(["console"], work, begun=begun, started=feeds.append, **pipes) as it:
        it.signalled("SIGTERM")
        assert "nothing stops it over its line: its switch does" in it.ended()
        assert it.process.returncode == 1


# grbl's own firmware, which is told what the conversation writes, byte for byte.


AHEAD_MM = 500.0 / 60.0 * 0.06
"""What the firmware has in its step buffer is done first: five pieces of 10 ms, and the one that
runs."""
AT_TEN_MM = tuple(Switch(pin, axis, most=10 * STEPS_PER_MM) for axis, pin in enumerate("XYZ"))
FIRMWARE = {
    "grbl jogs": 11.0,
    "grbl homes": 10.0,
    "grbl cuts, dwells and waits": 25.0,
    "grbl homes before a program": 18.0,
}
"""Works that the firmware does, and how long they take it."""


@pytest.fixture(scope="module")
def firmware(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., FirmwareLine]:
    if source() is None or shutil.which("gcc") is None:
        pytest.skip("GRBL_SOURCE names no sources of grbl, or there is no gcc")
    folder = tmp_path_factory.mktemp("grbl")
    program = built(folder)
    images = [factory(program, folder).rename(folder / "plain")]
    images.append(Path(shutil.copyfile(images[0], folder / "homes")))
    # Its homing may take no longer than a second or two at each switch.
    (folder / "script").write_text(f"w {b'$22=1'.hex()}0a\n", encoding="ascii")
    names = [images[1], folder / "script", folder / "answers", folder / "steps"]
    subprocess.run([program, *names], check=True)

    def line(work: Work) -> FirmwareLine:
        homes = work.home or work.action == "home"
        return FirmwareLine(program, images[homes], folder, AT_TEN_MM if homes else ())

    return line


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(FIRMWARE))
def test_a_stop_of_the_firmware_at_any_moment(
    name: str, firmware: Callable[..., FirmwareLine]
) -> None:
    work = WORKS[name]
    for moment in moments(work, 9, f"{name} of the firmware")[1:]:
        moment *= FIRMWARE[name] / work.seconds
        line = firmware(work)
        both, _ = work.begun(line)
        talk = both.talk
        both.until(moment)
        assert not talk.is_over, (moment, talk.why)
        homes = line.has_written(b"$H\n") and not line.has_read(b"ok")
        before = both.now = max(moment, both.now)
        talk.stop(before)
        both.until(LONG_S)
        assert talk.state is WireState.STOPPED, (moment, talk.why)
        most = 0.1 if homes else GRBL_STOP_MM + AHEAD_MM
        assert line.way_mm(before + 10 * BYTE_S) <= most, moment
        assert line.stood_s() <= both.now
        if homes:  # between two moves of its homing it makes some steps of the next one
            assert talk.why.startswith("stopped: ALARM:"), moment


# The tables of docs/sending.md.

STATES = {
    "grbl jogs": (Work("grbl", "jog", {"x": 80.0, "feed": 500.0}), 4.0),
    "grbl homes": (WORKS["grbl homes"], 2.0),
    "grbl cuts": (Work("grbl", "send", program=LINES), 6.0),
    "grbl moves fast": (Work("grbl", "send", program=b"G21G90\nG0X150\n"), 6.0),
    "grbl dwells": (Work("grbl", "send", program=b"G21G90\nG1X1F500\nG4P20\nG1X5\n"), 6.0),
    "grbl waits at M0": (Work("grbl", "send", program=b"G21G90\nG1X1F500\nM0\nG1X5\n"), 6.0),
    "grbl moves on from before": (Work("grbl", "jog", {"x": 1.0}, before=b"G1X80F500\n"), 4.0),
    "pic-mmh jogs, homes or cuts": (WORKS["pic-mmh cuts"], 9.0),
    "linuxcnc jogs, homes or cuts": (WORKS["linuxcnc cuts, dwells and waits"], 1.0),
    "i8751 takes a packet": (replace(WORKS["i8751 cuts"], paced=True), 0.05),
    "matlab-router takes a job": (WORKS["matlab-router cuts"], 0.005),
}
"""What the tables name by machine and state, and when it is stopped."""


def rows(title: str) -> dict[str, list[str]]:
    """Those of the table whose third column is so called."""
    text = (ROOT / "docs" / "sending.md").read_text(encoding="utf-8")
    table = re.search(rf"\| machine \| it \| {title}.*\n\|---.*\n((?:\|.*\n)+)", text)
    assert table
    cells = [[cell.strip() for cell in row.split("|")[1:-1]] for row in table[1].splitlines()]
    return {f"{machine} {state}": more for machine, state, *more in cells}


def measured(work: Work, moment_s: float, line: Any = None, *, stop: bool) -> str:
    """Measure distance and duration of the motion after a stop, or after camtool is killed."""
    both, twin = work.begun(line)
    both.until(moment_s)
    both.line.read(moment_s)
    place = twin.slides.commanded_mm.copy()
    both.now = moment_s
    if stop:
        both.talk.stop(moment_s)
        both.until(LONG_S)
        assert both.talk.state is WireState.STOPPED, both.talk.why
    both.line.read(both.now + LONG_S)
    if line is None:
        way, times = way_since(twin, moment_s, place), twin.slides.trace.time_s
    else:
        way, times = line.way_mm(moment_s), line.played.at_s
    last = max(float(times[-1]) - moment_s, 0.0) if len(times) else 0.0
    return f"{way:.1f} mm, {last:.1f} s"


@pytest.mark.parametrize("name", sorted(STATES))
def test_the_tables_say_how_far_the_twins_go(name: str) -> None:
    work, moment = STATES[name]
    said = rows("goes out at once")[name]
    assert said[2].startswith(measured(work, moment, stop=True))
    killed = rows("goes on").get(name)
    if killed is not None and "mm" in killed[1]:
        assert killed[1].startswith(measured(work, moment, stop=False))


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(STATES))
def test_the_tables_say_how_far_the_firmware_goes(
    name: str, firmware: Callable[..., FirmwareLine]
) -> None:
    work, moment = STATES[name]
    said = rows("goes out at once")[name][3]
    if said:
        assert said == measured(work, moment, firmware(work), stop=True)
    killed = rows("goes on").get(name)
    if killed is not None and "mm" in killed[2]:
        assert killed[2] == measured(work, moment, firmware(work), stop=False)
