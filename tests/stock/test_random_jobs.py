"""Programs of random jobs of all operations: the exact stock against needles of wood."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from camtool.stock.cut import CutStock
from camtool.stock.cutters import CutterProfile
from camtool.stock.heights import stock_tree
from camtool.stock.slides import ToolsOfRows, slide_moves
from camtool.target.registry import LoadedTarget, load_target
from tests.oracles.stock import SAG_MM, Cutter, Stock, moves_of
from tests.planning.test_stock import job_of, program_of

JOBS, SLOW_JOBS = 24, 1000
CELL_MM = 0.5
ROUNDING_MM = 1e-4


@cache
def linuxcnc() -> LoadedTarget:
    return load_target("linuxcnc")


def profile_of(cutter: Cutter) -> CutterProfile:
    if not cutter.slope:
        return CutterProfile(cutter.radius, cutter.radius)
    return CutterProfile(cutter.radius, cutter.tip, rise=1.0 / cutter.slope)


def differences(seed: int) -> list[str]:
    """Needles that stand outside of the bounds of the exact stock, as words."""
    asked, target = job_of(seed), linuxcnc()
    program, _ = program_of(asked)
    if not program:
        return []
    assert "G64 P0.01" in program
    program = program.replace("G64 P0.01", "G61")  # corners are not blended
    moves = moves_of(program)
    ends = np.array([end for move in moves for end in (move.a, move.b)])[:, :2]
    margin = asked.cutter.radius + 1.0
    low, high = ends.min(axis=0) - margin, ends.max(axis=0) + margin
    wood = Stock(tuple(low.tolist()), tuple(high.tolist()), CELL_MM)
    for move in moves:
        wood.cut(move, asked.cutter)
    decoded = target.target.read_in(program.encode(), target.machine, None)
    tools = ToolsOfRows((profile_of(asked.cutter),), np.zeros(len(decoded), dtype=np.int64))
    cut = slide_moves(decoded, target, tools)
    stock = CutStock(cut, stock_tree(cut), (0.0, 0.0, 1.0, 1.0))
    least, most = stock.bounds(wood.points).T
    z = wood.height.ravel()
    beside = SAG_MM + ROUNDING_MM
    # Chords of the needles' sloping arcs lie beside these, too: at a wall that is the whole depth.
    grown, _ = stock.tree.heights(wood.points, None, cut.beside_mm + beside)
    shrunk, _ = stock.tree.heights(wood.points, None, -cut.beside_mm - beside)
    least = np.minimum(least, grown) - beside
    most = np.maximum(most, shrunk) + beside
    wrong = np.flatnonzero((z < least) | (z > most))
    return [
        f"{wood.points[k].tolist()}: {z[k]:.4f} not within {least[k]:.4f} and {most[k]:.4f}"
        for k in wrong.tolist()
    ]


@pytest.mark.parametrize("seed", range(JOBS))
def test_the_exact_stock_is_that_of_the_needles(seed: int) -> None:
    assert differences(seed) == []


@pytest.mark.slow
@pytest.mark.parametrize("first", range(JOBS, JOBS + SLOW_JOBS, 50))
def test_many_exact_stocks_are_those_of_the_needles(first: int) -> None:
    for seed in range(first, first + 50):
        assert differences(seed) == [], seed


def test_a_move_that_is_left_out_is_seen() -> None:
    """The comparison can fail: without its last cut the stock is another one."""
    target = linuxcnc()
    program = "G21 G90\nG0 Z1\nG1 Z-1 F100\nX20\nY10\nG0 Z1\nM2\n"
    wood = Stock((-3.0, -3.0), (23.0, 13.0), CELL_MM)
    for move in moves_of(program):
        wood.cut(move, Cutter(1.5))
    decoded = target.target.read_in(program.replace("Y10\n", "").encode(), target.machine, None)
    tools = ToolsOfRows((CutterProfile(1.5, 1.5),), np.zeros(len(decoded), dtype=np.int64))
    cut = slide_moves(decoded, target, tools)
    heights, _ = stock_tree(cut).heights(wood.points)
    assert np.abs(heights - wood.height.ravel()).max() == 1.0
