"""`camtool console` on virtual machines behind pseudo-terminals, and what its words mean."""

from __future__ import annotations

import os
import pty
import signal
import subprocess
import sys
import time
from typing import Any

import pytest

from camtool.target.registry import load_target
from camtool.target.terminal import Terminal
from tests.commands import run_camtool
from tests.postprocessors.grbl.test_wire import Small
from tests.sending.test_ends import hosted
from tests.sending.test_send import behind_a_terminal
from tests.waiting import HANG_S, heard_from


def typed(name: str, text: str, *more: str) -> str:
    """Return the output of a console for lines from a pipe."""
    twin: Any = load_target(name).twin([])
    with hosted(twin, 20.0) as port:
        command = [sys.executable, "-m", "camtool", "console", name, port, "--baud", "9600", *more]
        done = subprocess.run(
            command, input=text, capture_output=True, text=True, check=False, timeout=HANG_S
        )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_grbls_answers_are_explained() -> None:
    said = typed("grbl", "$$\n$X1\nG1 X1 F600\nG4 P1\n?\nG1\n")
    assert "Grbl 1.1h" in said
    assert "$100=250.000    X: steps per mm" in said
    assert "$12=0.002    arc tolerance, mm" in said
    assert "error:3    no such $ command" in said
    report = next(line for line in said.splitlines() if line.startswith("<Idle"))
    assert "it stands, and nothing waits; machine position 1.000,0.000,0.000" in report


def test_the_steps_of_pic_mmh_are_counted() -> None:
    said = typed("pic-mmh", "PX+0100\nBX204;\nPX+0003;\n")
    assert said.splitlines() == ["PX+0100;", "100 × X+", "BX204;", "PX+0003;", "3 × X+"]


@pytest.mark.parametrize("speed", [20.0, 2000.0])
def test_motion_without_an_end_is_ended_by_the_next_line_of_a_pipe(speed: float) -> None:
    """However many steps are reported meanwhile."""
    twin: Any = load_target("pic-mmh").twin([])
    with hosted(twin, speed) as port:
        done = run_camtool("console", "pic-mmh", port, "--baud", "9600", typed="JX+;\nA;\n")
        assert not twin.is_moving
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines()[-1] == "A;"
    assert any("X+" in line for line in done.stdout.splitlines())


def test_linuxcnc_is_greeted_first() -> None:
    said = typed("linuxcnc", "get program_status\nset mode auto\nset nonsense\n")
    assert "HELLO ACK" in said
    assert "PROGRAM_STATUS IDLE" in said
    assert "SET MODE ACK" in said
    assert "SET NONSENSE NAK    refused" in said


def test_at_a_terminal_ctrl_c_stops_the_machine_and_then_ends() -> None:
    twin: Any = load_target("grbl").twin([])
    master, slave = pty.openpty()
    with hosted(twin, 1.0) as port:
        command = [sys.executable, "-m", "camtool", "console", "grbl", port]
        with subprocess.Popen(command, stdin=slave, stdout=subprocess.PIPE, text=True) as running:
            heard_from(running, "Grbl 1.1h")
            os.write(master, b"G1 X100 F600\n")
            heard_from(running, "ok")
            running.send_signal(signal.SIGINT)
            deadline = time.monotonic() + HANG_S
            while twin.state != "Hold:0" and time.monotonic() < deadline:
                time.sleep(0.05)
            assert twin.state == "Hold:0"
            assert running.poll() is None
            running.send_signal(signal.SIGINT)
            assert running.wait(HANG_S) == 0
    os.close(master)
    os.close(slave)


def test_a_machine_without_a_line_has_no_console() -> None:
    command = [sys.executable, "-m", "camtool", "console", "flashcut", "/dev/null"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "parallel port" in done.stderr


def test_any_byte_can_be_typed_and_shown() -> None:
    terminal = Terminal()
    assert terminal.encode(r"\x13a\x0D") == b"\x13a\x0d\n"
    assert terminal.decode(b"a\x07b\r\nc") == [r"a\x07b"]
    assert terminal.flush() == ["c"]
    assert terminal.flush() == []


@pytest.mark.parametrize(
    ("line", "data", "due"),
    [("?", b"?", 0), ("!", b"!", 0), (" ~ ", b"~", 0), ("^x", b"\x18", 1), ("$$", b"$$\n", 1)],
)
def test_real_time_bytes_of_grbl_have_no_end(line: str, data: bytes, due: int) -> None:
    loaded = load_target("grbl")
    wire: Any = loaded.target.wire()
    terminal = wire.terminal(loaded.machine)
    assert (terminal.encode(line), terminal.due) == (data, due)


class Starting(Small):
    """A board that its boot loader keeps from hearing anything until it was asked three times, and
    that may answer no more after some lines."""

    def __init__(self, answers: int = 1000) -> None:
        super().__init__(line_s=0.001)
        self.asked, self.answers = 0, answers

    def write(self, data: bytes, now: float) -> list[bytes]:
        for k, octet in enumerate(data):
            if self.asked == 3:
                return super().write(data[k:], now)
            self.asked += octet == ord("?")
            if self.asked == 3:
                return [b"Grbl 1.1h ['$' for help]", *super().write(data[k + 1 :], now)]
        return []

    def run(self, now: float) -> list[bytes]:
        said = super().run(now)
        self.answers -= bool(said)
        return said if self.answers >= 0 else []


def piped(small: Small, text: str, *more: str) -> subprocess.CompletedProcess[str]:
    with behind_a_terminal(small) as port:
        return run_camtool("console", "grbl", port, *more, typed=text)


def test_lines_from_a_pipe_wait_for_the_boot_loader() -> None:
    small = Starting()
    done = piped(small, "$$\n$21=1\n")
    assert done.returncode == 0, done.stderr
    assert "$100=250.000    X: steps per mm" in done.stdout
    assert "<" not in done.stdout  # a listing is a file to keep, and holds what was asked for
    assert small.lines == [b"$21=1"]
    assert done.stdout.splitlines()[-1] == "ok"


def test_an_answer_that_never_comes_is_an_error() -> None:
    small = Starting(answers=1)
    done = piped(small, "$1=255\n$21=1\n$22=1\n", "--wait", "3")
    assert done.returncode == 1
    assert "error: no answer to '$21=1': none came within 3 s" in done.stderr
    assert small.lines == [b"$1=255", b"$21=1"]


def test_one_that_never_starts_is_an_error() -> None:
    small = Starting()
    small.asked = -1000
    done = piped(small, "$21=1\n", "--wait", "1")
    assert done.returncode == 1
    assert "the controller does not answer" in done.stderr
    assert "--baud" in done.stderr
    assert small.lines == []


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (b"Grbl 1.1h ['$' for help]", "the controller has begun anew"),
        (b"ALARM:1", "ALARM:1, a limit switch was hit"),
    ],
)
def test_a_reset_or_an_alarm_instead_of_an_answer_is_an_error(said: bytes, why: str) -> None:
    class Failing(Starting):
        def run(self, now: float) -> list[bytes]:
            return [said] if super().run(now) else []

    done = piped(Failing(), "G1X100F600\nG1X0\n")
    assert done.returncode == 1
    assert f"no answer to 'G1X100F600': {why}" in done.stderr


def test_what_follows_a_reset_waits_for_its_banner() -> None:
    loaded = load_target("grbl")
    wire: Any = loaded.target.wire()
    terminal = wire.terminal(loaded.machine)
    assert not terminal.ready
    terminal.decode(b"\r\nGrbl 1.1h ['$' for help]\r\n")
    assert terminal.ready
    terminal.encode("^X")
    assert terminal.due
    terminal.decode(b"\r\nGrbl 1.1h ['$' for help]\r\n")
    assert not terminal.due
    assert not terminal.failed
