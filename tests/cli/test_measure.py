"""`camtool measure` and `camtool diff`: the stock after programs, held against needles of wood."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import Run
from tests.oracles.stock import Cutter, Stock, moves_of

PROGRAM = """G21 G90 G17 G94
G0 Z5
G0 X0 Y0
G1 Z-1 F100
X20
G2 X20 Y-10 I0 J-5
G1 X0 Z-2.5
Y0
G0 Z5
M2
"""


@pytest.fixture
def cut(tmp_path: Path) -> Path:
    file = tmp_path / "cut.ngc"
    file.write_text(PROGRAM)
    return file


EXACT = ("-t", "linuxcnc", "--set", "dialect.path=exact-path", "--tool-diameter", "3mm")


def needles(program: str, radius: float, points: np.ndarray) -> tuple[np.ndarray, Stock]:
    stock = Stock((-4.0, -14.0), (30.0, 4.0), 0.05)
    for move in moves_of(program):
        stock.cut(move, Cutter(radius))
    return stock.at(points), stock


def test_depths_are_those_of_the_needles(camtool: Run, cut: Path) -> None:
    points = [(0.0, 0.0), (10.0, 0.5), (25.0, -5.0), (10.0, -10.0), (10.0, -5.0), (12.0, -20.0)]
    asked = [part for x, y in points for part in ("--at", f"{x},{y}mm")]
    done = camtool("measure", cut, *EXACT, *asked, "--json", "-")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    heights, _ = needles(PROGRAM, 1.5, np.array(points))
    for row, z in zip(facts["points"], heights.tolist(), strict=True):
        low, high = row["between_mm"]
        assert low <= row["z_mm"] <= high
        # Needles stand up to 0.03 mm beside the point, where the slope is 1 in 13.
        assert row["z_mm"] == pytest.approx(z, abs=5e-3)
    assert facts["points"][4]["move"] is None


def test_a_section_and_a_volume_are_those_of_the_needles(camtool: Run, cut: Path) -> None:
    how = ("--section", "x=10", "--csv", "-")
    done = camtool("measure", cut, *EXACT, *how)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.decode().splitlines()
    assert lines[0] == "axis,at_mm,along_mm,z_mm"
    rows = np.array([[float(word) for word in line.split(",")[2:]] for line in lines[1:]])
    _, stock = needles(PROGRAM, 1.5, np.zeros((1, 2)))
    column = int(np.argmin(np.abs(stock.x - 10.0)))
    seen = stock.height[:, column]
    told = np.interp(stock.y, rows[:, 0], rows[:, 1])
    # The section ends at the outer walls; needles beside the inner ones may fall on either side.
    far = (np.abs(stock.y[:, None] - [-8.5, -1.5]).min(axis=1) > 0.06) & (
        np.abs(stock.y + 5.0) < 6.44
    )
    assert far.sum() > 200
    assert told[far] == pytest.approx(seen[far], abs=5e-3)

    done = camtool("measure", cut, *EXACT, "--section", "x=10", "--preview", "cut.svg", "-q")
    assert (cut.parent / "cut.svg").read_text().startswith("<svg")

    done = camtool("measure", cut, *EXACT, "--volume", "--json", "-")
    low, high = json.loads(done.stdout)["removed_mm3"]
    volume = float(-stock.height.sum() * stock.cell**2)
    assert low - 0.003 * volume <= volume <= high + 0.003 * volume


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ((), "nothing to measure"),
        (("--at", "5"), "no point"),
        (("--at", "5,abc"), "abc"),
        (("--section", "z=5"), "no section"),
        (("--section", "x=5", "--section", "x=6", "--preview", "x.svg"), "one --section"),
        (("--section", "x=5", "--preview", "x.html"), "one --section"),
        (("--at", "5,5", "--csv", "x.csv"), "--csv is a table of sections"),
    ],
)
def test_what_cannot_be_measured_is_refused(
    camtool: Run, cut: Path, asked: tuple[str, ...], words: str
) -> None:
    done = camtool("measure", cut, *EXACT, *asked)
    assert done.returncode == 2
    assert words in done.stderr.decode()


def test_what_is_wrong_with_a_program_is_said(camtool: Run, cut: Path) -> None:
    cut.write_text(PROGRAM.replace("X20\n", "X20 M77\n"))
    done = camtool("measure", cut, *EXACT, "--at", "1,1")
    assert done.returncode != 0
    assert b"M77" in done.stderr or b"77" in done.stderr


def test_a_program_above_the_stock_cuts_nothing(camtool: Run, cut: Path) -> None:
    cut.write_text("G21 G90 G17 G94\nG0 X0 Y0 Z1\nG1 X20 F100\nM2\n")
    done = camtool("measure", cut, *EXACT, "--volume", "--at", "5,0")
    assert done.returncode == 0, done.stderr
    assert b"nothing is cut" in done.stdout
    assert b"X 5 Y 0: Z 0.0000 mm" in done.stdout


def test_a_program_without_a_known_tool_is_refused(camtool: Run, cut: Path) -> None:
    done = camtool("measure", cut, "-t", "linuxcnc", "--at", "1,1")
    assert done.returncode == 2
    assert "--tool-diameter" in done.stderr.decode()


@pytest.mark.parametrize(
    ("old", "new", "differs", "far_mm"),
    [
        ("F100", "F90", False, None),
        ("Z-1 F100", "Z-1.05 F100", True, 0.05),
        ("G1 X0 Z-2.5\n", "G1 X0.03 Z-2.5\n", True, 0.03),
        ("G2 X20 Y-10 I0 J-5", "G3 X20 Y-10 I0 J-5", True, 1.0),
    ],
)
def test_what_two_programs_cut_differently(
    camtool: Run,
    cut: Path,
    tmp_path: Path,
    old: str,
    new: str,
    differs: bool,
    far_mm: float | None,
) -> None:
    other = tmp_path / "other.ngc"
    other.write_text(PROGRAM.replace(old, new))
    assert other.read_text() != PROGRAM
    done = camtool("diff", cut, other, *EXACT, "--json", "-")
    facts = json.loads(done.stdout)
    assert (done.returncode, facts["differs"]) == (int(differs), differs), done.stderr
    if far_mm is None:
        return
    bounds = [facts[side]["between_mm"] for side in ("deeper", "shallower")]
    assert max(high for _, high in bounds) <= far_mm + 0.005
    assert max(low for low, _ in bounds) > 0.3 * far_mm
    # The volumes are those of two blocks of needles.
    texts = PROGRAM, PROGRAM.replace(old, new)
    mine, theirs = (needles(text, 1.5, np.zeros((1, 2)))[1] for text in texts)
    cell = mine.cell**2
    for side, apart in (
        ("more_mm3", mine.height - theirs.height),
        ("less_mm3", theirs.height - mine.height),
    ):
        low, high = facts[side]
        assert low - 0.3 <= float(apart.clip(min=0.0).sum() * cell) <= high + 0.3


def test_jobs_and_machines_are_compared(camtool: Run, samples: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.toml"
    other.write_text((samples / "mount.toml").read_text())
    job = ("--job", samples / "mount.toml")
    same = camtool("diff", samples / "mount.dxf", *job, "--other-job", other, "-t", "grbl")
    assert same.returncode == 0, same.stderr
    assert b"nowhere by more than" in same.stdout
    alone = camtool("diff", samples / "mount.dxf", *job, "-t", "grbl")
    assert alone.returncode == 2
    assert b"nothing to compare with" in alone.stderr


def test_a_page_shows_both_stocks_and_both_differences(
    camtool: Run, cut: Path, tmp_path: Path
) -> None:
    other = tmp_path / "<b>other.ngc"
    other.write_text(PROGRAM.replace("Z-1 F100", "Z-1.4 F100"))
    done = camtool("diff", cut, other, *EXACT, "--preview", "page.html", "-q")
    assert done.returncode == 1, done.stderr
    page = (tmp_path / "page.html").read_text()
    assert page.count("<svg") == 4
    assert "<b>" not in page  # names of files are no markup
    assert "&lt;b&gt;other.ngc" in page
    assert "up to 0.4 mm lower than A" in page
    assert "nowhere more than 0.002 mm higher than A" in page
    done = camtool("diff", cut, other, *EXACT, "--preview", "picture.svg", "-q")
    assert "up to 0.4 mm lower than A" in (tmp_path / "picture.svg").read_text()
