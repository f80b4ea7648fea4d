"""`camtool batch` with processes of its own: signals, a terminal, several workers."""

import os
import pty
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

from camtool.batch.digests import file_digest
from camtool.batch.manifest import NAME, Manifest
from tests.cli.conftest import Run

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
        assert running.stderr is not None
        said = ""
        while "made:" not in said:
            line = running.stderr.readline()
            assert line, said
            said += line
        if number == signal.SIGINT:  # a terminal sends it to all processes of its foreground
            os.killpg(running.pid, number)
        else:
            running.send_signal(number)
        said += running.communicate(timeout=60)[1]
    assert running.returncode == 128 + number, said
    assert "interrupted; what is written is whole" in said
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
    heavy = {"numpy", "numba", "ezdxf", "shapely", "rich", "multiprocessing", "distributed"}
    code = (
        "import sys\nfrom camtool.cli.main import main\n"
        f"try:\n    main()\nfinally:\n    print(sorted({heavy} & sys.modules.keys()))"
    )
    command = [sys.executable, "-c", code, *COMMAND[3:]]
    done = subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    assert "12 up to date" in done.stderr
    assert done.stdout == "[]\n"


def test_a_terminal_gets_a_bar(tmp_path: Path, many: Path) -> None:
    (many / "junk.dxf").write_text("junk\n")
    ours, theirs = pty.openpty()
    environment = {**os.environ, "COLUMNS": "120", "TERM": "xterm"}
    command = [*COMMAND, "--no-verify"]
    said = b""
    with running_in(tmp_path, args=command, stderr=theirs, env=environment) as running:
        os.close(theirs)
        with suppress(OSError):  # the terminal's other end is closed
            while chunk := os.read(ours, 65536):
                said += chunk
        os.close(ours)
        assert running.wait() == 1
    text = said.decode()
    assert "13/13" in text
    assert "1 failed" in text
    assert "/s" in text
    assert "13 drawings: 12 made, 1 failed" in text
    assert "made: drawings" not in text
