"""The parts of the recipes, cut from a block by their programs: they are what was drawn.

The program's moves are read by a reader that shares nothing with camtool (`tests.oracles.stock`),
the tool sweeps along them, and what is left is compared with the part as it was drawn, whose
numbers stand here again.
"""

import math
import re
from pathlib import Path

import numpy as np
import pytest
import shapely

from tests.cli.conftest import Run
from tests.oracles.rs274 import RS274, run_rs274
from tests.oracles.stock import Move, moves_of

TOLERANCE_MM = 0.02
QUARTER = 24
"""Chords of a quarter of the tool: of 3.175 mm they are 0.9 µm off."""

POINT_MM, SAG_MM = 0.05, 5e-4
"""From one point of a move to the next, and how far chords through some of them may be from the
others."""


def rounded(left: float, low: float, right: float, high: float, radius: float) -> shapely.Polygon:
    """A rectangle with round corners."""
    inner = shapely.box(left + radius, low + radius, right - radius, high - radius)
    return inner.buffer(radius, quad_segs=QUARTER)


def disc(x: float, y: float, radius: float) -> shapely.Polygon:
    return shapely.Point(x, y).buffer(radius, quad_segs=QUARTER)


def mount() -> shapely.Polygon:
    """The mounting plate: outline, window, slot and four holes."""
    part = rounded(0.0, 0.0, 80.0, 50.0, 5.0) - rounded(14.0, 15.0, 38.0, 35.0, 2.0)
    part -= shapely.LineString([(50.0, 25.0), (66.0, 25.0)]).buffer(3.0, quad_segs=QUARTER)
    for x, y in ((7, 7), (73, 7), (73, 43), (7, 43)):
        part -= disc(x, y, 2.5)
    return part


def board() -> shapely.Polygon:
    """The circuit board: outline, sixteen holes of 0.8 mm and four of 3.2 mm."""
    part = rounded(0.0, 0.0, 40.0, 30.0, 2.0)
    for k in range(8):
        part -= disc(11.11 + 2.54 * k, 10.0, 0.4) | disc(11.11 + 2.54 * k, 17.62, 0.4)
    for x, y in ((4, 4), (36, 4), (36, 26), (4, 26)):
        part -= disc(x, y, 1.6)
    return part


def cut_below(moves: list[Move], z: float, radius: float) -> shapely.Geometry:
    """Return the area that a tool of this radius clears at this height, seen from above."""
    swept = []
    for move in moves:
        if move.rapid:
            continue
        points = move.points(POINT_MM)
        # A sloping move is cut at the height: only what is below it counts.
        for run in np.split(points, np.flatnonzero(np.diff(points[:, 2] <= z)) + 1):
            if run[0, 2] <= z:
                line = (
                    shapely.LineString(run[:, :2]) if len(run) > 1 else shapely.Point(run[0, :2])
                )
                swept.append(line)
    lines = shapely.simplify(swept, SAG_MM)
    return shapely.union_all(shapely.buffer(lines, radius, quad_segs=QUARTER))


def check_that_linuxcnc_runs(program: Path) -> None:
    """LinuxCNC's own interpreter takes the program."""
    table = "".join(f"T{number} P{number} D1\n" for number in (1, 2, 3, 4, 6))
    tools = program.with_name("tool.tbl")
    tools.write_text(table, encoding="ascii")
    ran = run_rs274("-t", str(tools), "-g", str(program))
    assert ran.returncode == 0, ran.stderr
    assert ran.stdout.count("STRAIGHT_FEED") + ran.stdout.count("ARC_FEED") > 100


def by_tool(program: str, tool: int) -> dict[int, list[Move]]:
    """The moves at a feed of each tool; `tool` is mounted where the program asks for none."""
    lines, tools = moves_of(program), dict[int, list[Move]]()
    asked = {}
    for number, text in enumerate(program.splitlines(), 1):
        if text.startswith("T") or " T" in text:
            asked[number] = int(text[text.index("T") + 1 :].split()[0])
    for move in lines:
        for number in [each for each in asked if each < move.line]:
            tool = asked.pop(number)
        if not move.rapid:
            tools.setdefault(tool, []).append(move)
    return tools


@pytest.mark.parametrize(("name", "target"), [("mount.dxf", "grbl"), ("mount.svg", "linuxcnc")])
def test_the_mounting_plate_is_what_was_drawn(
    camtool: Run, tmp_path: Path, samples: Path, target: str, name: str
) -> None:
    job = str(samples / "mount.toml")
    done = camtool("post", str(samples / name), "--job", job, "-t", target, "-o", "mount.nc")
    assert done.returncode == 0, done.stderr
    # Of the window, and only of that, a piece comes loose.
    warnings = re.findall(r"camtool: warning (\w+)", done.stderr.decode())
    assert warnings == ["LOOSE_PIECE"]
    moves = moves_of((tmp_path / "mount.nc").read_text(encoding="ascii"))
    part, radius = mount(), 0.5 * 3.175
    touched = cut_below(moves, -1e-9, radius)
    through = cut_below(moves, -3.0, radius)
    assert touched.intersection(part.buffer(-TOLERANCE_MM)).is_empty
    # All around the part a band is free, at its top wholly, at its bottom but for four tabs.
    band = part.buffer(1.0, quad_segs=QUARTER) - part.buffer(TOLERANCE_MM, quad_segs=QUARTER)
    assert band.difference(touched).is_empty
    left = band.difference(through)
    pieces = [piece for piece in shapely.get_parts(left) if piece.area > 1e-6]
    assert len(pieces) == 4
    for piece in pieces:  # 6 mm of material, and the rounding of the tool at both of its ends
        assert 6.0 < piece.area / (1.0 - TOLERANCE_MM) < 6.0 + 2.0 * radius
    # Slugs are free, the part hangs at its tabs.
    block = shapely.box(-5.0, -5.0, 85.0, 55.0)
    sheet = max(shapely.get_parts(block - through), key=lambda piece: piece.area)
    assert sheet.contains(part.buffer(-TOLERANCE_MM))
    if target == "linuxcnc" and RS274 is not None:
        check_that_linuxcnc_runs(tmp_path / "mount.nc")


@pytest.mark.parametrize("target", ["grbl", "linuxcnc"])
def test_the_circuit_board_is_what_was_drawn(
    camtool: Run, tmp_path: Path, samples: Path, target: str
) -> None:
    job = str(samples / "board.toml")
    drawing = str(samples / "board.dxf")
    done = camtool("post", drawing, "--job", job, "-t", target, "-o", "board.nc")
    assert done.returncode == 0, done.stderr
    tools = by_tool((tmp_path / "board.nc").read_text(encoding="ascii"), 6)
    assert sorted(tools) == [2, 6]
    part = board()
    # A drill is as wide as it is only above its cone, which goes through.
    cone = 0.4 / math.tan(math.radians(65.0))
    drilled = cut_below(tools[6], -1.6 - cone, 0.4)
    milled, through = cut_below(tools[2], -1e-9, 0.5), cut_below(tools[2], -1.6, 0.5)
    assert (drilled | milled).intersection(part.buffer(-TOLERANCE_MM)).is_empty
    band = part.buffer(0.39, quad_segs=QUARTER) - part.buffer(TOLERANCE_MM, quad_segs=QUARTER)
    assert band.difference(drilled | milled).is_empty
    left = [piece for piece in shapely.get_parts(band - drilled - through) if piece.area > 1e-6]
    assert len(left) == 4


@pytest.mark.skipif(RS274 is None, reason="LinuxCNC's rs274 is not installed")
@pytest.mark.parametrize("name", ["sign", "board", "plate"])
def test_linuxcnc_runs_them(camtool: Run, tmp_path: Path, samples: Path, name: str) -> None:
    drawing = next(samples / f"{name}{end}" for end in (".dxf", ".svg")
                   if (samples / f"{name}{end}").exists())  # fmt: skip
    job = str(samples / f"{name}.toml")
    done = camtool("post", str(drawing), "--job", job, "-t", "linuxcnc", "-o", "a.ngc")
    assert done.returncode == 0, done.stderr
    check_that_linuxcnc_runs(tmp_path / "a.ngc")
