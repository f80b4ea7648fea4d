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
from tests.sending.test_ends import hosted
from tests.waiting import heard_from


def typed(name: str, text: str, *more: str) -> str:
    """What a console shows to lines from a pipe."""
    twin: Any = load_target(name).twin([])
    with hosted(twin, 20.0) as port:
        command = [sys.executable, "-m", "camtool", "console", name, port, "--baud", "9600", *more]
        done = subprocess.run(
            command, input=text, capture_output=True, text=True, check=False, timeout=60
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
            deadline = time.monotonic() + 20.0
            while twin.state != "Hold:0" and time.monotonic() < deadline:
                time.sleep(0.05)
            assert twin.state == "Hold:0"
            assert running.poll() is None
            running.send_signal(signal.SIGINT)
            assert running.wait(20.0) == 0
    os.close(master)
    os.close(slave)


def test_a_machine_without_a_line_has_no_console() -> None:
    command = [sys.executable, "-m", "camtool", "console", "flashcut", "/dev/null"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "parallel port" in done.stderr


def test_any_byte_can_be_typed_and_shown() -> None:
    terminal = Terminal()
    assert terminal.typed(r"\x13a\x0D") == b"\x13a\x0d\n"
    assert terminal.heard(b"a\x07b\r\nc") == [r"a\x07b"]
    assert terminal.left() == ["c"]
    assert terminal.left() == []


@pytest.mark.parametrize(
    ("line", "data", "due"),
    [("?", b"?", 0), ("!", b"!", 0), (" ~ ", b"~", 0), ("^x", b"\x18", 0), ("$$", b"$$\n", 1)],
)
def test_real_time_bytes_of_grbl_have_no_end(line: str, data: bytes, due: int) -> None:
    loaded = load_target("grbl")
    wire: Any = loaded.target.wire()
    terminal = wire.terminal(loaded.machine)
    assert (terminal.typed(line), terminal.due) == (data, due)
