"""`camtool explain`: programs in words."""

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Run

PROGRAM = "G21 G90\n\nG0 X1 Y2\nG1 Z-1 F120\nG1 X5\nM2\n"


@pytest.fixture
def program(tmp_path: Path) -> str:
    (tmp_path / "a.nc").write_text(PROGRAM)
    return "a.nc"


def test_each_block_is_a_line(camtool: Run, program: str) -> None:
    done = camtool("explain", program, "-t", "grbl")
    assert (done.returncode, done.stderr) == (0, b"")
    assert done.stdout.decode().splitlines() == [
        "1  G21 G90      numbers are millimetres; positions are absolute",
        "3  G0 X1 Y2     rapid to X 1 Y 2 mm",
        "4  G1 Z-1 F120  line down to Z -1 mm, feed 120 mm/min (2 mm/s)",
        "5  G1 X5        line to X 5 mm",
        "6  M2           end of the program",
    ]
    assert camtool("explain", "-", "-t", "grbl", stdin=PROGRAM.encode()).stdout == done.stdout


def test_lines_from_and_to(camtool: Run, program: str) -> None:
    done = camtool("explain", program, "-t", "grbl", "--from", "2", "--to", "4")
    assert [line[0] for line in done.stdout.decode().splitlines()] == ["3", "4"]
    assert camtool("explain", program, "-t", "grbl", "--from", "99").stdout == b""
    for flags in (("--from", "4", "--to", "3"), ("--from", "0"), ("--to", "x")):
        done = camtool("explain", program, "-t", "grbl", *flags)
        assert (done.returncode, done.stdout) == (2, b""), flags


def test_json_has_the_moves(camtool: Run, program: str) -> None:
    done = camtool("explain", program, "-t", "grbl", "--from", "4", "--to", "4", "--json", "-")
    assert json.loads(done.stdout) == [
        {
            "block": 3,
            "line": 4,
            "text": "G1 Z-1 F120",
            "words": ["line down to Z -1 mm, feed 120 mm/min (2 mm/s)"],
            "visits": 1,
            "moves": [
                {
                    "kind": "line",
                    "to_mm": [1.0, 2.0, -1.0],
                    "centre_mm": None,
                    "radius_mm": None,
                    "sweep_deg": None,
                    "feed_mm_min": 120.0,
                    "value": None,
                }
            ],
        }
    ]


def test_bad_programs_are_one_line(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "bad.nc").write_bytes(b"\0\xff rubbish")
    (tmp_path / "empty.nc").write_bytes(b"")
    for name in ("bad.nc", "empty.nc", "none.nc", "."):
        done = camtool("explain", name, "-t", "grbl")
        assert (done.returncode, done.stdout) == (2, b""), name
        assert len(done.stderr.splitlines()) == 1
    (tmp_path / "a.nc").write_text(PROGRAM)
    assert camtool("explain", "a.nc", "-t", "grbl", "--json", "a.nc").returncode == 2
    assert (tmp_path / "a.nc").read_text() == PROGRAM


def test_texts_of_a_program_send_nothing_to_the_terminal(camtool: Run, tmp_path: Path) -> None:
    (tmp_path / "a.ngc").write_text("(MSG,\\x1b hello)\nG0 X1 (\x7f)\nM2\n")
    done = camtool("explain", "a.ngc", "-t", "linuxcnc")
    assert not {b for b in done.stdout + done.stderr if (b < 32 and b != 10) or b == 127}
