"""Running the command line as a user does: arguments in, exit code and output out."""

import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from tests.commands import Done, run_here

ROOT = Path(__file__).parents[2]


Run = Callable[..., Done]


@pytest.fixture
def camtool(tmp_path: Path) -> Run:
    """`camtool("post", "a.dxf", ...)` in an empty folder, through `main()` in this process."""
    return partial(run_here, folder=tmp_path)


@pytest.fixture
def camtool_process(tmp_path: Path) -> Run:
    """The same as a process of its own: slower, and the whole truth."""

    def run(*arguments: str | Path, stdin: bytes = b"") -> Done:
        command = [sys.executable, "-m", "camtool", *map(str, arguments)]
        done = subprocess.run(command, cwd=tmp_path, input=stdin, capture_output=True, check=False)
        return Done(done.returncode, done.stdout, done.stderr)

    return run


@pytest.fixture(scope="session")
def samples() -> Path:
    """The folder of samples."""
    return ROOT / "samples"
