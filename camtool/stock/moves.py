"""The motions of the tools through the stock: straight moves of tips, in the order of cutting.

They are those of the simulated slides, with all of the mechanics, thinned
(`camtool.stock.slides`), or those of a toolpath, whose arcs become chords. The true path lies
nowhere farther than `beside_mm` from them, so every figure of the stock is known to within what
this distance does to it."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.records import replace
from camtool.stock.cutters import CutterProfile
from camtool.toolpath.moves import Kind, Toolpath

SAGITTA_MM = 1e-3
"""Greatest distance between an arc and the chords that stand for it."""

ROUNDED_DECIMALS = 9
"""Ends of chords are rounded to this many decimals of a mm: processors differ in the last digit of
a sine."""


class StockMoves(Struct, frozen=True, eq=False):
    """M straight moves of tips, in the order of cutting, mm in the work frame (Z is 0 at the top
    of the stock, and upwards).

    `start`, `end` (M, 3); `row` (M,): the row of the decoded toolpath of each, ascending; `rapid`
    (M,): True for moves that should not touch the stock; `tool` (M,): the index of its cutter in
    `cutters`. The slides are nowhere farther than `beside_mm` from these moves."""

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
        """Return the chosen moves, with the whole table of cutters."""
        return StockMoves(
            self.start[chosen],
            self.end[chosen],
            self.row[chosen],
            self.rapid[chosen],
            self.tool[chosen],
            self.cutters,
            self.beside_mm,
        )

    def below(self, z_mm: float) -> StockMoves:
        """Return the parts of the moves below a height; each move must reach below it."""
        start, end = self.start.copy(), self.end.copy()
        for one, other in ((start, self.end), (end, self.start)):
            above = one[:, 2] > z_mm
            share = (one[above, 2] - z_mm) / (one[above, 2] - other[above, 2])
            one[above] += share[:, None] * (other[above] - one[above])
        return replace(self, start=start, end=end)

    @property
    def table(self) -> Floats:
        """The cutters (T, 4) as the compiled loops read them."""
        return np.array([each.columns for each in self.cutters], dtype=np.float64).reshape(-1, 4)


def stock_moves_of_toolpath(
    toolpath: Toolpath, tool: Ints, cutters: tuple[CutterProfile, ...]
) -> StockMoves:
    """Return the moves of a toolpath, arcs as chords within SAGITTA_MM; `tool` (N,): the index of
    the cutter of each row."""
    count = np.zeros(len(toolpath), dtype=np.int64)
    count[toolpath.is_motion] = 1
    count[toolpath.executed_rows :] = 0
    arcs = np.flatnonzero(toolpath.is_arc & (count > 0))
    sweep, radius = np.zeros(len(toolpath)), np.zeros(len(toolpath))
    sweep[arcs] = toolpath.sweeps_of(arcs)
    spoke = toolpath.starts_of(arcs)[:, :2] - toolpath.centre[arcs]
    radius[arcs] = np.hypot(spoke[:, 0], spoke[:, 1])
    max_angle = 2.0 * np.arccos(1.0 - np.minimum(SAGITTA_MM / np.maximum(radius[arcs], 1e-9), 1.0))
    count[arcs] = np.maximum(np.ceil(np.abs(sweep[arcs]) / max_angle), 1.0)
    row = np.repeat(np.arange(len(toolpath)), count)
    step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count) + 1
    end = toolpath.end[row]
    # Ends of chords within an arc; the last one keeps the end that the program gives.
    inner = step < count[row]
    rows = row[inner]
    part = step[inner] / count[rows]
    starts = toolpath.starts_of(rows)
    spoke = starts[:, :2] - toolpath.centre[rows]
    cosine, sine = np.cos(sweep[rows] * part), np.sin(sweep[rows] * part)
    x = toolpath.centre[rows, 0] + spoke[:, 0] * cosine - spoke[:, 1] * sine
    y = toolpath.centre[rows, 1] + spoke[:, 0] * sine + spoke[:, 1] * cosine
    z = starts[:, 2] + part * (toolpath.end[rows, 2] - starts[:, 2])
    end[inner] = np.round(np.column_stack([x, y, z]), ROUNDED_DECIMALS)
    start = np.empty_like(end)
    first = step == 1
    start[first] = toolpath.starts_of(row[first])
    start[~first] = end[:-1][~first[1:]]
    rapid = np.asarray(toolpath.kind[row] == Kind.RAPID)
    beside_mm = SAGITTA_MM if len(arcs) else 0.0
    return StockMoves(start, end, row, rapid, tool[row], cutters, beside_mm)
