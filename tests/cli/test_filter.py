"""`camtool filter`: what LinuxCNC runs when it opens a drawing."""

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.conftest import Run
from tests.oracles.rs274 import interpreted, needs_rs274

RING = (
    '<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="40mm" viewBox="0 0 40 40">'
    '<circle cx="20" cy="20" r="10"/></svg>'
)
PROGRESS = re.compile(r"^FILTER_PROGRESS=(\d*)$", re.MULTILINE)
"""The pattern with which LinuxCNC's screens look for it."""


@pytest.fixture
def ring(tmp_path: Path) -> Path:
    file = tmp_path / "the ring's.svg"
    file.write_text(RING)
    return file


def opened(line: str, file: Path) -> subprocess.CompletedProcess[bytes]:
    """LinuxCNC's way: the INI file's line through a shell, the file's name in quotes behind it."""
    name = str(file).replace("'", "'\\''")
    return subprocess.run(
        ["sh", "-c", f"{line} '{name}'"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        env={**os.environ, "AXIS_PROGRESS_BAR": "1"},
        check=False,
    )


def test_linuxcnc_opens_a_drawing(ring: Path) -> None:
    camtool = f"{shlex.quote(sys.executable)} -m camtool"
    done = opened(f"{camtool} filter --depth 0.5mm", ring)
    assert done.returncode == 0, done.stderr
    assert done.stdout.rstrip().endswith(b"M2")
    shares = [int(share) for share in PROGRESS.findall(done.stderr.decode())]
    assert shares == sorted(shares)
    assert shares[-1] == 100
    assert len(shares) >= 3


@pytest.mark.parametrize("name", ["logo.dxf", "letter.svg"])
def test_progress_stands_on_lines_of_its_own(camtool: Run, samples: Path, name: str) -> None:
    done = camtool("filter", samples / name)
    assert done.returncode == 0, done.stderr
    lines = [line for line in done.stderr.decode().splitlines() if "FILTER_PROGRESS" in line]
    assert lines
    assert all(PROGRESS.fullmatch(line) for line in lines)
    assert b"FILTER_PROGRESS" not in done.stdout


@needs_rs274[0]
@needs_rs274[1]
@pytest.mark.parametrize("name", ["logo.dxf", "plate.dxf"])
def test_linuxcnc_reads_what_comes_out(
    camtool: Run, samples: Path, tmp_path: Path, name: str
) -> None:
    program = camtool("filter", samples / name).stdout
    calls = [call for call, _, _ in interpreted(program, tmp_path)]
    assert calls.count("STRAIGHT_FEED") + calls.count("ARC_FEED") > 20
    assert "PROGRAM_END" in calls


def test_it_is_what_post_writes(camtool: Run, ring: Path, tmp_path: Path) -> None:
    flags = ("--tool-diameter", "1", "--side", "outside")
    camtool("post", ring, "-t", "linuxcnc", "-o", "a.ngc", *flags)
    assert camtool("filter", ring, *flags).stdout == (tmp_path / "a.ngc").read_bytes()


def test_a_job_beside_the_drawing_is_its_job(camtool: Run, ring: Path, tmp_path: Path) -> None:
    plain = camtool("filter", ring).stdout
    (tmp_path / "other.toml").write_text('depth = "0.75mm"\n')
    other = camtool("filter", ring, "--job", "other.toml").stdout
    assert b"Z-0.75" in other
    ring.with_suffix(".toml").write_text('depth = "0.25mm"\n')
    own = camtool("filter", ring, "--job", "other.toml").stdout
    assert b"Z-0.25" in own
    assert len({plain, other, own}) == 3
    assert b"Z-0.125" in camtool("filter", ring, "--depth", "0.125mm").stdout


def test_another_machine_of_the_same_screen(camtool: Run, ring: Path, tmp_path: Path) -> None:
    (tmp_path / "mill.toml").write_text('extends = "linuxcnc"\n[feed]\ndefault_mm_min = 77.0\n')
    done = camtool("filter", ring, "--machine", "mill.toml")
    assert b"F77" in done.stdout


@pytest.mark.parametrize(
    ("content", "code", "words"),
    [
        ("this is no drawing", 2, b"error"),
        (RING.replace("40mm", "1km").replace("40", "1e6"), 2, b"error"),
    ],
)
def test_errors_are_words_on_stderr_and_nothing_is_opened(
    camtool: Run, tmp_path: Path, content: str, code: int, words: bytes
) -> None:
    (tmp_path / "bad.svg").write_text(content)
    done = camtool("filter", "bad.svg")
    assert done.returncode == code
    assert done.stdout == b""
    assert words in done.stderr


def test_a_spoilt_part_is_not_opened(camtool: Run, ring: Path) -> None:
    done = camtool("filter", ring, "--max-time", "1s")
    assert done.returncode == 1
    assert done.stdout == b""
    assert b"ABOVE_GATE" in done.stderr
    assert b"FILTER_PROGRESS=100" not in done.stderr
