"""`camtool batch` with processes of its own: signals, a terminal, several workers."""

import os
import pty
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

import pytest

from camtool.batches.manifest import NAME, Manifest, file_digest
from tests.cli.conftest import Run
from tests.waiting import HANG_S, all_written, heard_from

COMMAND = (sys.executable, "-m", "camtool", "batch", "drawings", "-t", "pic-mmh", "-o", "build")


@pytest.fixture
def many(tmp_path: Path, samples: Path) -> Path:
    """Twelve drawings."""
    folder = tmp_path / "drawings"
    folder.mkdir()
    for number in range(12):
        shutil.copy(samples / "pieces" / "pic-mmh-square.dxf", folder / f"{number:02}.dxf")
    return folder


def assert_whole(out: Path) -> int:
    """Nothing is there but whole outputs and a manifest of them; how many."""
    manifest = Manifest(out)
    programs = [path for path in out.iterdir() if path.name != NAME]
    assert {path.resolve() for path in programs} == manifest.outputs()
    assert len({file_digest(path) for path in programs}) == 1
    return len(programs)


@contextmanager
def running_in(folder: Path, **settings: Any) -> Iterator[subprocess.Popen[str]]:
    """A process that does not outlive the test."""
    with subprocess.Popen(cwd=folder, text=True, **settings) as process:
        try:
            yield process
        finally:
            process.kill()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_run_leaves_whole_files_and_goes_on(
    tmp_path: Path, many: Path, camtool_process: Run, number: signal.Signals
) -> None:
    command, pipe = [*COMMAND, "--jobs", "1"], subprocess.PIPE
    with running_in(tmp_path, args=command, stderr=pipe, start_new_session=True) as running:
        said = heard_from(running, "made:")
        if number == signal.SIGINT:  # a terminal sends it to all processes of its foreground
            os.killpg(running.pid, number)
        else:
            running.send_signal(number)
        said += running.communicate(timeout=HANG_S)[1]
    assert running.returncode == 128 + number, said
    assert "interrupted; written files are complete" in said
    assert "Traceback" not in said
    assert 1 <= assert_whole(tmp_path / "build") < 12
    done = camtool_process(*COMMAND[3:], "--jobs", "2")
    assert done.returncode == 0
    assert b"up to date" in done.stderr
    assert assert_whole(tmp_path / "build") == 12
    if number == signal.SIGTERM:
        assert_little_is_loaded(tmp_path)


def assert_little_is_loaded(folder: Path) -> None:
    """A batch that has nothing to do needs neither numbers nor drawings nor processes."""
    heavy = {"numpy", "ezdxf", "shapely", "rich", "multiprocessing", "distributed"}
    code = (
        "import sys\nfrom camtool.cli.main import main\n"
        f"try:\n    main()\nfinally:\n    print(sorted({heavy} & sys.modules.keys()))"
    )
    command = [sys.executable, "-c", code, *COMMAND[3:]]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    assert "12 up to date" in done.stderr
    assert done.stdout == "[]\n"


def on_a_terminal(folder: Path, code: int) -> str:
    """Return the output of the command on a terminal of 120 columns."""
    ours, theirs = pty.openpty()
    environment = {**os.environ, "COLUMNS": "120", "TERM": "xterm"}
    environment.pop("NO_COLOR", None)
    command = [*COMMAND, "--no-verify"]
    with running_in(folder, args=command, stderr=theirs, env=environment) as running:
        os.close(theirs)
        said = all_written(ours)
        assert running.wait() == code
    return said.decode()


def test_a_terminal_gets_a_bar_and_a_table(tmp_path: Path, many: Path) -> None:
    junk = many / "[red]junk with a name so long that its failure does not fit into a line.dxf"
    junk.write_text("junk\n")
    text = on_a_terminal(tmp_path, 1)
    assert "13/13" in text
    assert "1 failed" in text
    assert "/s" in text
    assert "13 drawings: 12 made, 1 failed" in text
    assert "made: drawings" not in text
    (short,) = (line for line in text.splitlines() if "failed: drawings/[red]junk" in line)
    assert "…" in short
    (row,) = (line for line in text.splitlines() if "│" in line and "[red]junk" in line)
    assert "\x1b[31m" in row, "in red"
    assert "drawings/" not in row, "what all have in common is told once"
    junk.unlink()
    text = on_a_terminal(tmp_path, 0)
    assert "12 drawings: 12 up to date" in text
    assert "━" not in text, "there was nothing to wait for"


def outputs_in(out: Path) -> dict[str, bytes]:
    """Programs and pictures by name, and whatever else is there but the manifest."""
    if not out.is_dir():
        return {}
    return {path.name: path.read_bytes() for path in out.iterdir() if path.name != NAME}


def interrupted(folder: Path, number: signal.Signals, moment: Random, *, all_of_it: bool) -> str:
    """A run that gets a signal after some drawings, and a little later; what it said."""
    command, pipe = [*COMMAND, "--jobs", "2", "--preview", "svg"], subprocess.PIPE
    with running_in(folder, args=command, stderr=pipe, start_new_session=True) as running:
        assert running.stderr is not None
        said = ""
        for _ in range(moment.randrange(12)):
            said += running.stderr.readline()
        time.sleep(moment.uniform(0.0, 0.1 if said else 2.0))
        if all_of_it:
            os.killpg(running.pid, number)
        else:
            running.send_signal(number)
        said += running.communicate(timeout=HANG_S)[1]
        ways = {0, -number, 128 + number}  # it may have been ready, or not yet have begun
        assert running.returncode in ways or "KeyboardInterrupt" in said, said
        return said


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_interrupted_again_and_again_it_comes_to_the_same_end(
    tmp_path: Path, many: Path, camtool_process: Run, number: signal.Signals
) -> None:
    for more in range(12, 60):
        shutil.copy(many / "00.dxf", many / f"{more}.dxf")
    undisturbed = camtool_process(*COMMAND[3:-1], "whole", "--preview", "svg")
    assert undisturbed.returncode == 0
    whole = outputs_in(tmp_path / "whole")
    assert len(whole) == 120
    random = Random(number)
    counts = []
    for turn in range(10):
        said = interrupted(tmp_path, number, random, all_of_it=bool(turn % 2))
        assert "fault in camtool" not in said
        there = outputs_in(tmp_path / "build")
        if number == signal.SIGKILL:  # it cannot take away what it was just writing, nor its lock
            there = {name: data for name, data in there.items() if not name.startswith(".")}
        assert there.items() <= whole.items(), (turn, said)
        known = {path.name for path in Manifest(tmp_path / "build").outputs()}
        assert known <= there.keys()
        if number != signal.SIGKILL:
            assert known == there.keys(), (turn, said)
        counts.append(len(there))
        if turn == 4:
            shutil.rmtree(tmp_path / "build", ignore_errors=True)
    print(number.name, counts)
    assert any(0 < count < 120 for count in counts), counts
    done = camtool_process(*COMMAND[3:], "--preview", "svg")
    assert done.returncode == 0, done.stderr
    there = outputs_in(tmp_path / "build")
    assert {name: data for name, data in there.items() if not name.startswith(".")} == whole
