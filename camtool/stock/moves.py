"""The motions of the tools through the stock: straight moves of tips, in the order of cutting.

They are those of the simulated slides, with all of the mechanics, thinned: of the samples of a
controller only those are kept that a straight move between kept ones would miss by more than
`beside_mm`. Every sample lies within that distance of the moves, so every figure of the stock is
known to within what this distance does to it.
"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.stock.cutters import CutterProfile


class StockMoves(Struct, frozen=True, eq=False):
    """M straight moves of tips, in the order of cutting, mm in the work frame (Z is 0 at the top
    of the stock, and upwards).

    `start`, `end` (M, 3); `row` (M,): the row of the decoded toolpath of each, ascending; `rapid`
    (M,): True for moves that should not touch the stock; `tool` (M,): the index of its cutter in
    `cutters`. The slides are nowhere farther than `beside_mm` from these moves.
    """

    start: Floats
    end: Floats
    row: Ints
    rapid: Bools
    tool: Ints
    cutters: tuple[CutterProfile, ...]
    beside_mm: float = 0.0

    def __len__(self) -> int:
        return len(self.start)

    def select(self, chosen: Ints | Bools | slice) -> StockMoves:
        """Return some of the moves, with all cutters."""
        return StockMoves(
            self.start[chosen],
            self.end[chosen],
            self.row[chosen],
            self.rapid[chosen],
            self.tool[chosen],
            self.cutters,
            self.beside_mm,
        )

    @property
    def table(self) -> Floats:
        """The cutters (T, 4) as the compiled loops read them."""
        return np.array([each.columns for each in self.cutters], dtype=np.float64).reshape(-1, 4)
