"""`camtool send --at-stop`: a program that stops for an operator where none is at the terminal."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from camtool.sending.journal import read_journal
from camtool.target.registry import load_target
from tests.sending.test_ends import hosted
from tests.waiting import HANG_S

PROGRAM = b"G21 G90\n(turn the part `touch stolen` over)\nM0\nG1 X1 F300\nM0\nG1 X0\n"


def sent(
    folder: Path, port: str, *more: str, program: bytes = PROGRAM
) -> subprocess.CompletedProcess[str]:
    (folder / "part.nc").write_bytes(program)
    words = ["send", "part.nc", "-t", "grbl", "--port", port, "--yes", "--speed", "10", *more]
    return subprocess.run(
        [sys.executable, "-m", "camtool", *words],
        cwd=folder,
        capture_output=True,
        text=True,
        stdin=subprocess.DEVNULL,
        timeout=HANG_S,
        check=False,
    )


def test_a_command_is_run_at_each_stop(tmp_path: Path) -> None:
    twin = load_target("grbl").twin([])
    command = 'echo "$CAMTOOL_WHY" >> stops'
    with hosted(twin, 10.0) as port:
        done = sent(tmp_path, port, "--at-stop", command)
    assert done.returncode == 0, done.stderr
    first, second = (tmp_path / "stops").read_text().splitlines()
    assert "turn the part `touch stolen` over" in first
    assert "turn" not in second
    assert not (tmp_path / "stolen").exists()
    assert read_journal(tmp_path / "part.nc.journal").finished


@pytest.mark.parametrize(
    ("answer", "why"), [("fail", "--at-stop is fail"), ("exit 3", "exit code 3")]
)
def test_the_machine_is_stopped_where_the_answer_is_no(
    tmp_path: Path, answer: str, why: str
) -> None:
    twin = load_target("grbl").twin([])
    with hosted(twin, 10.0) as port:
        done = sent(tmp_path, port, "--at-stop", answer)
    assert done.returncode == 1
    assert why in done.stderr
    assert "stopped" in done.stderr
    assert not twin.is_moving
    assert twin.slides.commanded_mm[0] == 0.0


def test_without_an_answer_nothing_is_sent(tmp_path: Path) -> None:
    twin = load_target("grbl").twin([])
    with hosted(twin, 10.0) as port:
        done = sent(tmp_path, port)
    assert done.returncode == 2
    assert "--at-stop" in done.stderr
    assert not twin.decoded
