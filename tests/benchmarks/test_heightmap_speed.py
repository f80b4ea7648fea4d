"""Height maps of the stock, beside a plain C loop over the box of each move.

Run it by `pytest -m benchmark -s tests/benchmarks/test_heightmap_speed.py`. Both run in turns in
one process; the ratio is the answer, whatever else the machine is doing. The loop takes the place
nearest to a cell for the deepest: for moves that slope it does less than it should.
"""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from camtool.arrays import Floats
from camtool.stock.cutters import CutterProfile
from camtool.stock.heightmap import HeightMap, height_map
from camtool.stock.moves import StockMoves
from tests.stock.cuts import moves_of

pytestmark = pytest.mark.benchmark
CELLS, SIZE_MM, MOVES, ROUNDS = 2000, 100.0, 2000, 3
CUTTERS = {
    "flat": CutterProfile(3.0, 3.0),
    "ball": CutterProfile(3.0, 0.0, corner_mm=3.0),
    "bull": CutterProfile(3.0, 2.0, corner_mm=1.0),
    "V": CutterProfile(3.0, 0.0, rise=1.7320508),
}
AIM_US, AIM_RATIO = 25.0, 0.7


def winding(cutter: CutterProfile, slope: float) -> StockMoves:
    """Moves of 1 mm that wind through the stock, 2 mm deep."""
    rng = np.random.default_rng(1)
    turn = np.cumsum(rng.normal(0.0, 0.15, MOVES))
    step = np.column_stack([np.cos(turn), np.sin(turn)])
    way = np.cumsum(np.concatenate([[[50.0, 50.0]], step]), axis=0) % (2.0 * SIZE_MM)
    way = np.minimum(way, 2.0 * SIZE_MM - way)  # reflected at the edges
    z = -2.0 + slope * np.sin(np.arange(MOVES + 1))
    points = np.column_stack([way, z])
    return moves_of(points[:-1], points[1:], 0, cutter)


def plain_loop(folder: Path) -> Callable[[StockMoves], Floats]:
    compiler = shutil.which("gcc")
    if compiler is None:
        pytest.skip("no gcc")
    source, library = Path(__file__).with_name("heights.c"), folder / "heights.so"
    flags = ["-O3", "-march=native", "-shared", "-fPIC"]
    subprocess.run([compiler, *flags, str(source), "-o", str(library), "-lm"], check=True)
    loop = ctypes.CDLL(str(library)).cut
    whole, pointer = ctypes.c_int64, ctypes.c_void_p
    loop.argtypes = [
        pointer, whole, whole, ctypes.c_double, pointer, pointer, whole, pointer
    ]  # fmt: skip

    def cut(moves: StockMoves) -> Floats:
        heights = np.zeros((CELLS, CELLS), dtype=np.float32)
        start, end, table = moves.start.copy(), moves.end.copy(), moves.table[:1].copy()
        loop(
            heights.ctypes.data, CELLS, CELLS, SIZE_MM / CELLS, start.ctypes.data, end.ctypes.data,
            len(moves), table.ctypes.data,
        )  # fmt: skip
        return heights.astype(np.float64)

    return cut


@pytest.mark.parametrize("slope", [0.0, 0.3], ids=["level", "sloping"])
@pytest.mark.parametrize("name", CUTTERS)
def test_a_move_takes_less_than_in_a_plain_loop(name: str, slope: float, tmp_path: Path) -> None:
    moves, plain = winding(CUTTERS[name], slope), plain_loop(tmp_path)

    def ours(moves: StockMoves) -> HeightMap:
        return height_map(moves, (0.0, 0.0, SIZE_MM, SIZE_MM), SIZE_MM / CELLS)

    least = {"plain": float("inf"), "ours": float("inf")}
    for _ in range(ROUNDS):
        begun = time.process_time()
        heights = plain(moves)
        turned = time.process_time()
        found = ours(moves).heights
        least["plain"] = min(least["plain"], turned - begun)
        least["ours"] = min(least["ours"], time.process_time() - turned)
    lower = found - heights
    assert lower.max() < 1e-5
    assert slope or (np.abs(lower) > 1e-5).mean() < 1e-4  # the rims
    us, ratio = 1e6 * least["ours"] / MOVES, least["ours"] / least["plain"]
    print(f"{name}, slope {slope:g}: {us:.1f} µs a move, {ratio:.2f} times the plain loop")
    assert ratio < AIM_RATIO
    assert us < AIM_US or slope
