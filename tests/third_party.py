"""Packages of third parties: installed from their files into a folder, and used from there."""

import subprocess
import sys
from pathlib import Path

from tests.waiting import HANG_S


def install(source: Path, place: Path) -> None:
    """Let pip install a package from its files into a folder, offline."""
    offline = ("--no-deps", "--no-build-isolation", "--no-index", "--quiet")
    command = [sys.executable, "-m", "pip", "install", *offline, "--target", place, source]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=HANG_S)
    assert done.returncode == 0, done.stderr


def camtool(place: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run `camtool ARGUMENTS` in a folder, with the packages of `place`."""
    code = "import sys; from camtool.cli.main import main; sys.argv[0] = 'camtool'; main()"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=folder,
        env={"PYTHONPATH": str(place), "PATH": "/usr/bin:/bin", "HOME": str(folder)},
        capture_output=True,
        text=True,
        check=False,
        timeout=HANG_S,
    )
