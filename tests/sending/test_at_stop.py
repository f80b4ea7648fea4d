"""`camtool send --at-stop`: a program that stops for an operator where none is at the terminal."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from camtool.sending.journal import read_journal
from camtool.target.registry import load_target
from tests.commands import run_camtool
from tests.sending.test_ends import hosted
from tests.waiting import HANG_S

PROGRAM = b"G21 G90\n(turn the part `touch stolen` over)\nM0\nG1 X1 F300\nM0\nG1 X0\n"

LINUXCNC = b"G21 G90\nT1 M6\nG43 H1\nG0 Z1\nG1 X1 F300\nT2 M6\nG43 H2\nG1 X0\nM2\n"
PIC_MMH = b"G54;G90;M06T01;G01X00003.00Y00000.00F08;M06T02;G01X00000.00Y00000.00F08;M30;"


def sent(
    folder: Path, port: str, *more: str, program: bytes = PROGRAM, target: str = "grbl"
) -> subprocess.CompletedProcess[str]:
    (folder / "part.nc").write_bytes(program)
    words = ["send", "part.nc", "-t", target, "--port", port, "--yes", "--speed", "10", *more]
    return run_camtool(*words, cwd=folder)


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
    ("target", "block", "program"),
    [("linuxcnc", "block 7 (M0 G43 H2)", LINUXCNC), ("pic-mmh", "block 5 (M06T02;)", PIC_MMH)],
)
def test_a_tool_change_between_cuts_is_a_stop(
    tmp_path: Path, target: str, block: str, program: bytes
) -> None:
    twin = load_target(target).twin([])
    with hosted(twin, 10.0) as port:
        refused = sent(tmp_path, port, program=program, target=target)
        assert refused.returncode == 2
        assert f"in {block}:" in " ".join(refused.stderr.split())
        command = 'echo "$CAMTOOL_WHY" >> stops'
        done = sent(tmp_path, port, "--at-stop", command, program=program, target=target)
    assert done.returncode == 0, done.stderr
    assert len((tmp_path / "stops").read_text().splitlines()) == 1
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


def wait_until(is_true: Callable[[], bool]) -> None:
    end = time.monotonic() + HANG_S
    while not is_true():
        assert time.monotonic() < end
        time.sleep(0.02)


def runs(process: int) -> bool:
    """True if it runs, and is no mere entry of the table of processes."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state not in ("Z", "X")


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="no /proc here")
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_camtool_leaves_no_command_behind_and_the_program_goes_on(
    tmp_path: Path, how: signal.Signals
) -> None:
    """And nothing of the program is cut twice or left out."""
    program = b"G21 G90\nG1 X1 F300\nM0\nG1 X3\nG1 Y2\n"
    (tmp_path / "part.nc").write_bytes(program)
    twin = load_target("grbl").twin(["opening=nothing"])
    words = [sys.executable, "-m", "camtool", "send", "part.nc", "-t", "grbl", "--yes"]
    with hosted(twin, 10.0) as port:
        words += ["--port", port, "--speed", "10"]
        command = "echo $$ > shell; sleep 300 & echo $! > other; wait"
        with subprocess.Popen(
            [*words, "--at-stop", command],
            cwd=tmp_path,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as sending:
            wait_until(lambda: (tmp_path / "other").exists() and (tmp_path / "other").read_text())
            begun = [int((tmp_path / name).read_text()) for name in ("shell", "other")]
            assert all(map(runs, begun))
            sending.send_signal(how)
        wait_until(lambda: not any(map(runs, begun)))
        place = read_journal(tmp_path / "part.nc.journal")
        assert not place.finished
        assert place.block <= 2  # the stop itself is not done
        assert not twin.is_moving
        assert twin.slides.commanded_mm[0] == pytest.approx(1.0)
        done = subprocess.run(
            [*words, "--resume", "--at-stop", "true"],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            stdin=subprocess.DEVNULL,
            timeout=HANG_S,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    assert read_journal(tmp_path / "part.nc.journal").finished
    assert twin.slides.commanded_mm == pytest.approx([3.0, 2.0, 0.0])
    places = twin.slides.trace.commanded
    assert places[places[:, 0] < 2.999, 1].max() == 0.0
    assert len(np.unique(np.round(places[:, 0] / 0.004))) >= 750  # each step to X3
