"""Tools and moves that the tests of the stock share."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.stock.cutters import CutterProfile
from camtool.stock.moves import StockMoves

FLAT, BALL, BULL, V_BIT, POINTED = range(5)

CUTTERS = (
    CutterProfile(1.5, 1.5),
    CutterProfile(1.5, 0.0, corner_mm=1.5),
    CutterProfile(2.0, 1.2, corner_mm=0.8),
    CutterProfile(2.0, 0.1, rise=1.7),
    CutterProfile(1.0, 0.0, rise=0.6),
)


def moves_of(
    start: npt.ArrayLike, end: npt.ArrayLike, tool: npt.ArrayLike, *cutters: CutterProfile
) -> StockMoves:
    """Moves of one tool, or of a tool for each; with one cutter all are of it."""
    begin, finish = np.array(start, dtype=np.float64), np.array(end, dtype=np.float64)
    count = len(begin)
    which = np.zeros(count, dtype=np.int64) if cutters else np.broadcast_to(tool, count).copy()
    return StockMoves(
        begin, finish, np.arange(count), np.zeros(count, dtype=np.bool_), which, cutters or CUTTERS
    )
