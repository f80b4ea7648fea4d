"""`camtool send` as a process, to a small grbl behind a pseudo-terminal; journals; the rest of a
program."""

from __future__ import annotations

import io
import json
import os
import pty
import select
import signal
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from serial import SerialException

from camtool.cli.life_signs import LifeSigns
from camtool.errors import InputError, OptionError
from camtool.progress import Progress
from camtool.sending.journal import Journal, digest, read_journal
from camtool.sending.prepare import consignment, rest_of
from camtool.target.registry import load_target
from camtool.target.wire import port_fault
from tests.postprocessors.grbl.test_wire import PROGRAM, Small
from tests.sending.test_any_order import PROGRAMS, SETTINGS
from tests.waiting import heard_from

TARGET = load_target("grbl")
BLOCKS = 63


@contextmanager
def behind_a_terminal(small: Small) -> Iterator[str]:
    """The name of a port at which a controller answers."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    over = threading.Event()

    def serve() -> None:
        while not over.is_set():
            now = time.monotonic()
            ready, _, _ = select.select([master], [], [], 0.001)
            said = small.write(os.read(master, 4096), now) if ready else []
            for line in (*said, *small.run(now)):
                os.write(master, line + b"\r\n")

    server = threading.Thread(target=serve)
    server.start()
    try:
        yield os.ttyname(slave)
    finally:
        over.set()
        server.join()
        os.close(master)
        os.close(slave)


def command(*arguments: str) -> list[str]:
    return [sys.executable, "-m", "camtool", "send", *arguments]


@pytest.fixture
def program(tmp_path: Path) -> Path:
    file = tmp_path / "part.nc"
    file.write_bytes(PROGRAM)
    return file


def test_a_program_goes_out_once_and_the_journal_says_so(program: Path) -> None:
    small = Small(line_s=0.001)
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--json")
        done = subprocess.run(line, capture_output=True, check=False)
    assert done.returncode == 0, done.stderr
    assert len(small.lines) == BLOCKS
    assert json.loads(done.stdout.splitlines()[-1])["state"] == "finished"
    place = read_journal(Path(f"{program}.journal"))
    assert place.finished
    assert place.block == BLOCKS


def test_nothing_goes_out_before_it_is_confirmed(program: Path) -> None:
    small = Small()
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port)
        done = subprocess.run(line, capture_output=True, stdin=subprocess.DEVNULL, check=False)
    assert done.returncode == 2
    assert b"--yes" in done.stderr
    assert small.lines == []
    assert small.reset == 0


@pytest.mark.parametrize("seed", range(3))
def test_after_a_kill_it_goes_on_behind_what_is_done(program: Path, seed: int) -> None:
    count = int(np.random.default_rng(seed).integers(25, 55))
    small = Small(line_s=0.01)
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--json")
        running = subprocess.Popen(line, stdout=subprocess.PIPE, text=True)
        heard_from(running, rf'"packet": {count},')
        running.send_signal(signal.SIGKILL)
        running.wait()
        assert running.stdout is not None
        running.stdout.close()
        while small.buffer:
            time.sleep(0.01)
        first = list(small.lines)
        block = read_journal(Path(f"{program}.journal")).block
        assert block <= len(first)
        done = subprocess.run([*line, "--resume"], capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
    second = b"\n".join(small.lines[len(first) :]) + b"\n"
    assert read_journal(Path(f"{program}.journal")).finished
    whole = TARGET.target.read(PROGRAM, TARGET.machine)
    rest = TARGET.target.read(second, TARGET.machine)
    low = int(np.flatnonzero(whole.block >= block)[0])
    wanted = whole.end[low:][whole.is_motion[low:]]
    assert np.allclose(rest.end[rest.is_motion][-len(wanted) :], wanted)


def test_an_interrupt_stops_the_machine(program: Path) -> None:
    small = Small(line_s=0.02)
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--json")
        with subprocess.Popen(
            line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as running:
            heard_from(running, r'"packet": [1-3]\d,')
            running.send_signal(signal.SIGINT)
            _, said = running.communicate()
        assert running.returncode == 1
        assert "--resume" in said
        assert small.buffer == b""
        assert len(small.lines) < BLOCKS
        assert small.reset == 2


def test_one_sender_a_port(program: Path) -> None:
    small = Small(line_s=0.4)
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--json")
        with subprocess.Popen(line, stdout=subprocess.PIPE, text=True) as running:
            heard_from(running, '"packet": 2,')
            second = subprocess.run(line, capture_output=True, check=False)
            running.send_signal(signal.SIGINT)
            running.communicate()
    assert second.returncode == 2
    assert b"another camtool sends there (process" in second.stderr


def test_the_rest_begins_above_the_place_and_makes_the_same_moves() -> None:
    whole = TARGET.target.read(PROGRAM, TARGET.machine)
    made = rest_of(whole, TARGET, 30)
    rest = TARGET.target.read(made.data, TARGET.machine)
    moves = rest.part(0, int(np.flatnonzero(rest.block >= made.entry)[0]))
    place = whole.starts_of(np.array([int(np.flatnonzero(whole.block >= 30)[0])]))[0]
    assert (moves.end[moves.is_motion, 2] >= place[2]).all()
    assert np.allclose(moves.end[-1], place)
    with pytest.raises(OptionError, match="no block 900"):
        rest_of(whole, TARGET, 899)
    with pytest.raises(OptionError, match="nothing moves behind its last block"):
        rest_of(whole, TARGET, BLOCKS)  # all is done but its end


def test_the_rest_of_arcs_and_dwells_says_which_block_is_done_when() -> None:
    program = (
        b"G21 G90\nM3 S900\nG4 P2\nG0 Z5\nG0 X0 Y0\nG1 Z-1 F60\nG1 X0 F80\nG2 X2 Y2 I2 F80\n"
        b"G2 X2.001 Y2.001 I0.0005 J0.0005 F80\nM5\nM3 S500\nG1 X3\nG0 Z5\nM5\nM30\n"
    )
    whole = TARGET.target.read(program, TARGET.machine)
    for first in range(1, 13):
        made = rest_of(whole, TARGET, first)
        rest = TARGET.target.read(made.data, TARGET.machine)
        assert (np.diff(made.done) >= 0).all()
        assert (made.done[: made.entry] == -1).all()
        assert made.done[-1] == 12  # of its moves
        assert (b"G4 P2" in made.data) == (first < 10)
        for block, done in enumerate(made.done.tolist()):
            if done >= 0:  # all that it says is done has been reached
                ends = whole.end[whole.is_motion & (whole.block <= done)]
                there = rest.end[rest.is_motion & (rest.block <= block)]
                assert np.allclose(ends[-1], there[-1])
    with pytest.raises(OptionError, match="nothing moves"):
        rest_of(whole, TARGET, 13)


def test_a_program_for_another_machine_file_is_refused() -> None:
    other = b"(settings 12345678)\n" + PROGRAM
    with pytest.raises(InputError, match="another machine file"):
        consignment(other, TARGET, source="part.nc")


def test_a_journal_holds_to_its_last_whole_line(tmp_path: Path) -> None:
    file = tmp_path / "a.journal"
    head = {"sha256": "a", "machine": "b", "target": "c", "first": 0}
    journal = Journal(file, head)
    journal.note(sent=9, acknowledged=7, done=5, block=4)
    file.write_bytes(file.read_bytes() + b'{"s": 3, "blo')
    assert read_journal(file).block == 5
    more = Journal(file, head | {"first": 5}, appends=True)
    assert read_journal(file).block == 5
    more.note(sent=2, acknowledged=1, done=1, block=8)
    assert read_journal(file).block == 9
    (tmp_path / "b").write_bytes(b"G0\n")
    with pytest.raises(InputError, match="no journal"):
        read_journal(tmp_path / "b")


def test_a_machine_without_a_line_is_refused_and_why(tmp_path: Path) -> None:
    (tmp_path / "a.nc").write_bytes(b"G01 X1.0 F3.0\n")
    line = command(str(tmp_path / "a.nc"), "-t", "flashcut", "--port", "/dev/null", "--yes")
    done = subprocess.run(line, capture_output=True, check=False)
    assert done.returncode == 2
    assert b"parallel port" in done.stderr


def test_by_hand_goes_the_way_of_programs() -> None:
    small = Small(line_s=0.001)
    with behind_a_terminal(small) as port:
        for words in (["jog", "X-1.5", "Y2mm", "F200"], ["zero"], ["home"]):
            line = [sys.executable, "-m", "camtool", *words, "-t", "grbl", "--port", port]
            done = subprocess.run(line, capture_output=True, check=False)
            assert done.returncode == 0, done.stderr
        small.locked = True
        for words in (["jog", "X1"], ["unlock"], ["jog", "X1"], ["zero", "Z0"]):
            line = [sys.executable, "-m", "camtool", *words, "-t", "grbl", "--port", port]
            done = subprocess.run(line, capture_output=True, check=False)
            assert (done.returncode == 0) is (not small.locked), done.stderr
        small.locked = True
        done = subprocess.run([*line, "--unlock"], capture_output=True, check=False)
        assert done.returncode == 0, done.stderr
    zeroed = b"G21G10L20P1"
    assert small.lines == [
        b"$J=G91G21X-1.500Y2.000F200.0",
        zeroed + b"X0.000Y0.000Z0.000",
        b"$H",
        b"$X",
        b"$J=G91G21X1.000F200.0",
        zeroed + b"Z0.000",
        b"$X",
        zeroed + b"Z0.000",
    ]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["home", "-t", "valcnc"], b"no command to home"),
        (["unlock", "-t", "linuxcnc"], b"no command to unlock"),
        (["jog", "X1", "--unlock", "-t", "pic-mmh", "--baud", "9600"], b"no command to unlock"),
    ],
)
def test_no_command_where_the_controller_has_none(words: list[str], said: bytes) -> None:
    line = [sys.executable, "-m", "camtool", *words, "--port", "/dev/null"]
    done = subprocess.run(line, capture_output=True, check=False)
    assert done.returncode == 2
    assert said in done.stderr


# A program that goes on: the place of the tool.


def left_at(program: Path, place: tuple[float, float, float], *, still: bool = True) -> Path:
    """The journal of a program that was left at a place, with blocks 1 to 20 done and 30 sent."""
    head = {"sha256": digest(PROGRAM), "machine": TARGET.machine.digest, "target": "grbl"}
    journal = Journal(Path(f"{program}.journal"), head)
    journal.note(place, sent=30, acknowledged=25, done=20, block=19, last=29)
    if still:
        counts = {"sent": 30, "acknowledged": 25, "done": 20, "block": 19, "last": 29}
        journal.close("stopped", "", is_still=True, place=place, **counts)
    return journal.file


class Restarting(Small):
    """A board that its port has reset: it says its banner when it is asked for the first time, and
    does not remember its place; what it was told of its place it believes."""

    banner = True

    def write(self, data: bytes, now: float) -> list[bytes]:
        said = [b"Grbl 1.1h ['$' for help]"] if self.banner and data else []
        self.banner = False
        return said + super().write(data, now)


@pytest.mark.parametrize(
    ("board", "place", "still", "more", "said"),
    [
        # The board was reset: its zero is not that of the program.
        (
            Restarting,
            (1.5, -2.0, -1.0),
            True,
            [],
            "has begun anew, and takes its place for X0.000",
        ),
        (Restarting, (0.0, 0.0, 0.0), True, [], ""),
        (Restarting, (0.0, 0.0, 0.0), False, [], "was not stopped"),
        (Restarting, (1.5, -2.0, -1.0), True, ["--tool-at", "journal"], ""),
        (Restarting, (1.5, -2.0, -1.0), False, ["--tool-at", "journal"], "bring the tool to part"),
        (Restarting, (1.5, -2.0, -1.0), False, ["--tool-at", "zero"], ""),
        (Restarting, (1.5, -2.0, -1.0), False, ["--tool-at", "known"], ""),
        (Restarting, (1.5, -2.0, -1.0), True, ["--home"], ""),
        # It was not, and stands elsewhere than the journal says, or there.
        (Small, (1.5, -2.0, -1.0), True, [], "takes its place for X0.000 Y0.000 Z0.000, but the"),
        (Small, (1.5, -2.0, -1.0), True, ["--tool-at", "known"], ""),
        (Small, (0.0, 0.0, 0.0), True, [], ""),
    ],
)
def test_a_program_goes_on_only_from_a_place_that_is_known(
    program: Path,
    board: type[Small],
    place: tuple[float, float, float],
    still: bool,
    more: list[str],
    said: str,
) -> None:
    file = left_at(program, place, still=still)
    before, small = read_journal(file), board(line_s=0.001)
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--resume", *more)
        done = subprocess.run(line, capture_output=True, text=True, check=False)
    if said:
        assert done.returncode in (1, 2)
        assert said in done.stderr
        assert small.lines == []
        assert read_journal(file) == before  # what was left can still be gone on with
        return
    assert done.returncode == 0, done.stderr
    assert read_journal(file).finished
    words = {"journal": b"G21G92X1.5000Y-2.0000Z-1.0000", "zero": b"G21G92X0.0000Y0.0000Z0.0000"}
    told = [each for each in small.lines if b"G92" in each]
    assert told == [words[each] for each in more[-1:] if each in words]
    assert small.lines[0] in (*told, b"$H") or not (told or "--home" in more)


def test_one_that_was_killed_may_have_done_what_it_had(program: Path) -> None:
    """It goes on with what is in its buffer, and stands at the end of a block that was sent."""
    whole = TARGET.target.read(PROGRAM, TARGET.machine)
    for block, good in ((29, True), (24, True), (45, False), (10, False)):
        left_at(program, (0.3, 0.3, 0.3), still=False)
        small = Small(line_s=0.001)
        small.place = tuple(whole.end[whole.block == block][-1].tolist())
        small.place = (small.place[0] + 7.0, small.place[1], small.place[2] - 2.0)
        small.zero = (7.0, 0.0, -2.0)
        with behind_a_terminal(small) as port:
            line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--resume")
            done = subprocess.run(line, capture_output=True, text=True, check=False)
        assert (done.returncode == 0) is good, (block, done.stderr)
        assert bool(small.lines) is good


def test_a_beginning_that_is_refused_leaves_the_journal_of_an_unfinished_program(
    program: Path,
) -> None:
    file = left_at(program, (1.0, 2.0, 3.0))
    before, small = read_journal(file), Small(locked=True)
    with behind_a_terminal(small) as port:
        for more in ([], ["--from", "5", "--tool-at", "known"]):
            line = command(str(program), "-t", "grbl", "--port", port, "--yes", *more)
            done = subprocess.run(line, capture_output=True, text=True, check=False)
            assert done.returncode == 1
            assert "it is locked" in done.stderr
            assert read_journal(file) == before
        small.locked = False
        done = subprocess.run(line[:-4], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "20 blocks are done" in done.stderr  # what would be lost is said before
    assert read_journal(file).finished
    assert len(file.read_bytes().split(b'"journal"')) == 2  # nothing is left of the earlier one


def test_a_program_from_a_block_looks_at_its_journal_too(program: Path) -> None:
    left_at(program, (1.5, -2.0, -1.0))
    small = Restarting()
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--from", "5")
        done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "has begun anew" in done.stderr
    assert small.lines == []


def test_where_the_tool_is_means_nothing_for_a_program_that_begins(program: Path) -> None:
    for more in ([], ["--from", "3"]):
        line = command(str(program), "-t", "grbl", "--tool-at", "zero", *more)
        done = subprocess.run(line, capture_output=True, text=True, check=False)
        assert done.returncode == 2, done.stderr


def test_the_journal_says_where_it_stopped(program: Path) -> None:
    """In the work frame in which the program began, though a frame was set since."""
    small = Small(line_s=0.02)
    small.place, small.zero = (10.0, 20.0, 30.0), (7.0, 8.0, 9.0)
    with behind_a_terminal(small) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--json")
        with subprocess.Popen(
            line, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        ) as running:
            heard_from(running, '"packet": 10,')
            running.send_signal(signal.SIGINT)
            running.communicate()
    place = read_journal(Path(f"{program}.journal"))
    assert place.tool_mm == (3.0, 12.0, 21.0)
    assert place.is_still
    assert place.block <= 11 <= place.last + 1


# What nobody could answer, and what is said of ports.


@pytest.mark.parametrize(
    ("program", "more", "said"),
    [
        (b"G0X1\nM0\nG0X2\n(swap)\nN7 G4P1 M00\nM1\n", [], b"block 2 (M0), block 4 (N7G4P1M00):"),
        (b"M0\n" * 9, [], b"block 5 (M0) and 4 more"),
        (b"G0X1\nG0X2\n", ["--single"], b"--single waits behind every block"),
    ],
)
def test_what_waits_for_somebody_is_refused_where_nobody_is(
    tmp_path: Path, program: bytes, more: list[str], said: bytes
) -> None:
    file, small = tmp_path / "part.nc", Small()
    file.write_bytes(program)
    with behind_a_terminal(small) as port:
        line = command(str(file), "-t", "grbl", "--port", port, "--yes", *more)
        done = subprocess.run(line, capture_output=True, stdin=subprocess.DEVNULL, check=False)
    assert done.returncode == 2
    assert said in done.stderr
    assert small.lines == []
    assert small.reset == 0
    assert not Path(f"{file}.journal").exists()


def test_what_is_done_is_said_though_going_on_fails(program: Path) -> None:
    left_at(program, (0.0, 0.0, 0.0))
    with behind_a_terminal(Small(locked=True)) as port:
        line = command(str(program), "-t", "grbl", "--port", port, "--yes", "--resume")
        done = subprocess.run(line, capture_output=True, check=False)
    assert done.returncode == 1
    assert b"block 20 is the last that is done" in done.stderr


@pytest.mark.parametrize(
    ("error", "why", "mend"),
    [
        (
            SerialException(2, "could not open port /dev/x: [Errno 2] No such file: '/dev/x'"),
            "No such file or directory",
            "plug the machine in",
        ),
        (SerialException("could not open port /dev/x: [Errno 13] denied"), "denied", "group"),
        (
            SerialException("Could not exclusively lock port /dev/x: [Errno 11] Resource"),
            "unavailable",
            "close other programs",
        ),
        (
            SerialException("device reports readiness to read but returned no data (device ..."),
            "it was unplugged, or another program reads from it",
            "plug it in again",
        ),
        (SerialException("write failed: [Errno 5] Input/output error"), "Input/output error", ""),
        (ConnectionRefusedError(111, "Connection refused"), "Connection refused", "listen there"),
        (OSError("strange"), "strange", ""),
    ],
)
def test_a_port_that_fails_is_told_in_words_for_its_user(
    error: Exception, why: str, mend: str
) -> None:
    said, advice = port_fault(error)
    assert why in said
    assert mend in advice
    assert "Errno" not in said


def test_a_port_that_is_not_there_is_no_reason_to_close_programs(program: Path) -> None:
    line = command(str(program), "-t", "grbl", "--port", "/dev/ttyNONE9", "--yes")
    done = subprocess.run(line, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "the port cannot be opened (No such file or directory); plug" in done.stderr
    assert "close other programs" not in done.stderr


def test_nothing_is_written_over_a_question(program: Path) -> None:
    """The sign of life stands still while the user is asked."""
    stream = io.StringIO()
    signs = LifeSigns(stream, Progress())
    signs._begun = time.monotonic() - 10.0
    with signs.hidden():
        signs.show()
        assert stream.getvalue() == ""
    signs.show()
    assert "s\r" in stream.getvalue()


@pytest.mark.parametrize(
    ("target", "said"),
    [
        ("valcnc", "goes on from part zero; bring the tool there, and give --tool-at zero"),
        ("i8751", "goes on from there; give --tool-at journal if it has stayed there"),
    ],
)
def test_a_machine_that_says_no_place_is_not_gone_on_with_unasked(
    tmp_path: Path, target: str, said: str
) -> None:
    settings = [each for each in SETTINGS[target] if "link." not in each]
    loaded, file = load_target(target, settings=settings), tmp_path / "part"
    file.write_bytes(PROGRAMS[target])
    head = {"sha256": digest(PROGRAMS[target]), "machine": loaded.machine.digest, "target": target}
    counts = {"sent": 2, "acknowledged": 2, "done": 2, "block": 4, "last": 4}
    journal = Journal(Path(f"{file}.journal"), head)
    journal.note((1.0, 2.0, 3.0), **counts)
    journal.close("stopped", "", is_still=True, place=(1.0, 2.0, 3.0), **counts)
    words = [word for setting in settings for word in ("--set", setting)]
    line = command(str(file), "-t", target, *words, "--port", "/dev/null", "--yes", "--resume")
    done = subprocess.run(
        line, capture_output=True, text=True, check=False, stdin=subprocess.DEVNULL
    )
    assert done.returncode == 2
    assert "left at X1.000 Y2.000 Z3.000 by the simulation" in done.stderr
    assert said in done.stderr
