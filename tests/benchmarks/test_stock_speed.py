"""Proved figures of the stock, beside a grid of 50 µm and booleans of solids.

Run it by `pytest -m benchmark -s tests/benchmarks/test_stock_speed.py`. Each pair runs in turns in
one process; times are of the processor, the least of the rounds.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.stock.cut import CutStock
from camtool.stock.cutters import CutterProfile
from camtool.stock.heightmap import height_map
from camtool.stock.heights import greatest_value, stock_tree
from camtool.stock.moves import StockMoves
from tests.stock.cuts import moves_of
from tests.stock.test_volumes import cut_volume

pytestmark = pytest.mark.benchmark
ROUNDS = 3
CELL_MM = 0.05


def least_s(run: Callable[[], object]) -> float:
    """Processor time of a call, the least of the rounds."""
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def test_a_planted_gouge_among_20_000_moves() -> None:
    count = 20_000
    x, y = np.tile(np.arange(200) * 0.5, 100), np.repeat(np.arange(100) * 0.9, 200)
    start = np.column_stack([x, y, np.full(count, -1.0)])
    end = start + np.array([0.5, 0.0, 0.0])
    start[10_101, 2] -= 0.003
    end[10_101] = start[10_101] + np.array([0.2, 0.0, 0.0])
    moves = moves_of(start, end, 0, CutterProfile(0.5, 0.0, 0.5))
    box = (0.0, 0.0, 100.0, 90.0)

    def proved() -> float:
        tree = stock_tree(moves)
        found = greatest_value(
            lambda at: -1.0 - tree.heights(at)[0],
            lambda squares: -1.0 - tree.min_heights(squares),
            box,
            1e-6,
            floor=0.0,
        )
        assert found.high - found.low <= 1e-6
        return found.high

    def grid() -> float:
        return float(-1.0 - height_map(moves, box, CELL_MM).heights.min())

    assert proved() == pytest.approx(0.003, abs=2e-6)
    ours, theirs = least_s(proved), least_s(grid)
    print(f"\ngouge to 1 nm: {ours:.3f} s; grid of 50 µm {theirs:.3f} s, finds {grid():.6f} mm")
    assert ours < 1.0


def surface(at: Floats) -> Floats:
    return np.asarray(-1.0 - 0.3 * np.sin(at[:, 0] / 3.0) * np.cos(at[:, 1] / 4.0))


def raster() -> StockMoves:
    """Passes of a ball nose over a wavy surface, its tip on it."""
    parts = []
    for y in (np.arange(146) * 0.2).tolist():
        x = np.linspace(0.0, 30.0, 147)
        at = np.column_stack([x, np.full(147, y)])
        points = np.column_stack([at, surface(at)])
        parts.append((points[:-1], points[1:]))
    begin, end = (np.concatenate(side) for side in zip(*parts, strict=True))
    return moves_of(begin, end, 0, CutterProfile(3.0, 0.0, 3.0))


def test_the_greatest_leftover_of_a_raster() -> None:
    moves = raster()
    box = (2.0, 2.0, 27.0, 27.0)
    bend = 0.3 * (1.0 / 9.0 + 1.0 / 16.0)  # no second derivative of the surface is more

    def proved() -> float:
        tree = stock_tree(moves)

        def upper(squares: Floats) -> Floats:
            x, y, half = squares.T
            slope = np.column_stack(
                [
                    -0.1 * np.cos(x / 3.0) * np.cos(y / 4.0),
                    0.075 * np.sin(x / 3.0) * np.sin(y / 4.0),
                ]
            )
            return tree.max_heights(squares, slope) - surface(squares[:, :2]) + bend * half**2

        found = greatest_value(lambda at: tree.heights(at)[0] - surface(at), upper, box, 1e-3)
        assert found.high - found.low <= 1e-3
        return found.high

    def grid() -> float:
        made = height_map(moves, box, CELL_MM)
        ny, nx = made.heights.shape
        x = box[0] + (np.arange(nx) + 0.5) * CELL_MM
        y = box[1] + (np.arange(ny) + 0.5) * CELL_MM
        places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        return float((made.heights.reshape(-1) - surface(places)).max())

    ours, theirs = least_s(proved), least_s(grid)
    print(
        f"\nleftover of {len(moves)} moves to 1 µm: {ours:.3f} s, at most {proved():.5f} mm; "
        f"grid of 50 µm {theirs:.3f} s, finds {grid():.5f} mm"
    )
    assert grid() <= proved() + 1e-6
    assert ours < 3.0


def test_volumes_beside_booleans() -> None:
    """A winding of short moves; the booleans take a tenth of them, as they cost the same each."""
    count, some = 4_000, 400
    rng = np.random.default_rng(5)
    turn = np.cumsum(rng.normal(0.0, 0.15, count))
    step = 0.25 * np.column_stack([np.cos(turn), np.sin(turn), np.zeros(count)])
    path = np.cumsum(np.concatenate([[[20.0, 20.0, -2.0]], step]), axis=0)
    path[:, :2] = np.abs((path[:, :2] + 40.0) % 80.0 - 40.0)  # reflected at the edges
    moves = moves_of(path[:-1], path[1:], 0, CutterProfile(1.5, 0.0, 1.5))
    stock = CutStock(moves, stock_tree(moves), (0.0, 0.0, 40.0, 40.0), -6.0)
    ours = 1e3 * least_s(lambda: stock.removed_mm3(0.01)) / count
    theirs = 1e3 * least_s(lambda: cut_volume(moves.select(slice(some)), 1.0)) / some
    ratio = theirs / ours
    print(f"\nvolume, a move: {ours:.4f} ms; booleans {theirs:.1f} ms: {ratio:.0f} times")
    assert ours < theirs
