"""Exact heights of the stock after a program, and proved bounds of how far they are from others.

No grid: the height over a point is the least of z + profile(distance) over all moves. The greatest
value of a difference of heights over a region is bracketed by branch and bound. Squares whose
upper bound does not exceed the greatest value found so far by more than the tolerance are done;
the others are divided in four. What is printed as proved is the greatest upper bound of all
squares that are done."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.kernels.move_tree import hilbert_order
from camtool.kernels.stock import QUARTERS, StockTree
from camtool.stock.moves import StockMoves

TOP_MM = 0.0

TOLERANCE_MM = 1e-3
"""Default width of a bracket."""

FIRST_SQUARES = 1024
"""Approximate number of squares into which a region is divided at first."""

SQUARES_AT_ONCE = 4096

MAX_SQUARES = 4_000_000
"""A search ends after this many squares: its bracket is then wider, and says so."""

VOLUME_SHARE = 0.01
"""Default width of the bounds of a volume, as a share of it."""

MIN_VOLUME_MM3 = 1e-6
"""Least width of the bounds of a volume."""

LEFT_SHARE = 0.3
"""Expected gap of the bounds of four quarters, over the gap of their square."""

MAX_VOLUME_SQUARES = 100_000
"""Largest number of squares into which a volume is divided: its bounds are wider if they do not
suffice."""

MIN_HALF_MM = 1e-9
"""Squares with a smaller half side are not divided further, because of rounding."""


def stock_tree(moves: StockMoves) -> StockTree:
    """Return an index of the moves for searches of heights; moves of tools without width are left
    out."""
    number = np.flatnonzero(moves.table[moves.tool, 0] > 0.0)
    selected = moves.select(number)
    columns = move_columns(selected)
    order = hilbert_order(selected.start[:, :2], selected.end[:, :2]) if len(number) else number
    return StockTree(
        np.ascontiguousarray(columns[order]),
        np.ascontiguousarray(moves.tool[number][order].astype(np.int64)),
        np.ascontiguousarray(number[order].astype(np.int64)),
        moves.table,
        TOP_MM,
    )


def move_columns(moves: StockMoves) -> Floats:
    """Return the moves (M, 7) as the compiled loops read them: start (x, y, z), direction and
    length in the plane, slope. Vertical moves are replaced by their lower end."""
    start, steps = moves.start, moves.end - moves.start
    length = np.hypot(steps[:, 0], steps[:, 1])
    flat = length > 0.0
    safe = np.where(flat, length, 1.0)
    return np.column_stack(
        [
            start[:, :2],
            np.where(flat, start[:, 2], np.minimum(start[:, 2], moves.end[:, 2])),
            np.where(flat[:, None], steps[:, :2] / safe[:, None], 0.0),
            length,
            np.where(flat, steps[:, 2] / safe, 0.0),
        ]
    )


class Bracket(Struct, frozen=True):
    """The greatest value of a function over a region: at least `low`, which it reaches at `at_mm`,
    and at most `high`. `squares`: the number of squares that were examined."""

    low: float
    high: float
    at_mm: tuple[float, float]
    squares: int = 0

    @property
    def value(self) -> float:
        """Middle of the bracket."""
        return 0.5 * (self.low + self.high)

    @property
    def margin(self) -> float:
        """Half the width of the bracket: the value is proved to so much."""
        return 0.5 * (self.high - self.low)


def greatest_value(
    value: Callable[[Floats], Floats],
    upper: Callable[[Floats], Floats],
    box: tuple[float, float, float, float],
    tolerance: float = TOLERANCE_MM,
    floor: float = -np.inf,
    max_squares: int = MAX_SQUARES,
    enough_value: float = np.inf,
) -> Bracket:
    """Bracket the greatest value of a function over a box (low x, low y, high x, high y) by branch
    and bound.

    `value` gives it at points (J, 2); `upper` gives upper bounds over squares, whose middle and
    half a side are the rows of (K, 3), −inf for squares that are of no interest. Values below
    `floor` are not of interest: where all are, the bracket is (−inf, floor). A value above
    `enough_value` ends the search, and the bracket is then wider."""
    squares = _first_squares(box)
    best, place, proved, examined = (
        -np.inf,
        (0.5 * (box[0] + box[2]), 0.5 * (box[1] + box[3])),
        floor,
        0,
    )
    pile = [(squares, np.full(len(squares), np.inf))]
    while pile:
        squares, bounds = pile.pop()
        hopeful = bounds > max(best, floor) + tolerance
        proved = max(proved, float(bounds[~hopeful].max(initial=-np.inf)))
        squares = squares[hopeful]
        if len(squares) > SQUARES_AT_ONCE:
            bounds = bounds[hopeful]
            pile.append((squares[:-SQUARES_AT_ONCE], bounds[:-SQUARES_AT_ONCE]))
            squares = squares[-SQUARES_AT_ONCE:]
        if not len(squares):
            continue
        examined += len(squares)
        values = value(squares[:, :2])
        row = int(np.argmax(values))
        if values[row] > best:
            best, place = float(values[row]), (float(squares[row, 0]), float(squares[row, 1]))
        bounds = np.maximum(upper(squares), values)
        ends = (squares[:, 2] <= MIN_HALF_MM) | (examined >= max_squares) | (best > enough_value)
        open_ = (bounds > max(best, floor) + tolerance) & ~ends
        proved = max(proved, float(bounds[~open_].max(initial=-np.inf)))
        if open_.any():
            quarters = divided(squares[open_])
            bounds = np.repeat(bounds[open_], 4)
            if math.isinf(enough_value):
                # The most promising squares come first, since they raise the best value soon.
                order = np.argsort(bounds, kind="stable")
                quarters, bounds = quarters[order], bounds[order]
            pile.append((quarters, bounds))
    if best <= floor:
        best = -np.inf
    return Bracket(best, max(proved, best), place, examined)


Bounds = Callable[[Floats], tuple[Floats, Floats]]
"""The function from squares (K, 3) to lower and upper bounds (K,), (K,) of a function over
them."""


def integral(
    quarter_means: Bounds | None,
    extremes: Bounds,
    box: tuple[float, float, float, float],
    share: float = VOLUME_SHARE,
    slack: float = MIN_VOLUME_MM3,
) -> Bracket:
    """Bracket the integral of a function over a box, to a `share` of it or to `slack`, whichever
    is larger.

    `quarter_means` returns bounds of the function's means over the quarters of squares; `extremes`
    bounds of its values, for squares that lie partly outside the box. The squares with the largest
    gap between the bounds are divided again and again. The place of the bracket is that of the
    square with the largest part."""
    squares, low, high = _quarters(_first_squares(box), quarter_means, extremes, box)
    while True:
        total = float(low.sum()), float(high.sum())
        wanted_gap = max(share * total[1], slack)
        gaps = high - low
        if total[1] - total[0] <= wanted_gap or len(squares) >= MAX_VOLUME_SQUARES:
            break
        order = np.argsort(gaps)
        # The squares with the smallest gaps stay: as many as make half of what may stay, or more
        # where the others then suffice.
        total_gap = total[1] - total[0]
        may_stay = max(0.5 * wanted_gap, (wanted_gap - LEFT_SHARE * total_gap) / (1 - LEFT_SHARE))
        is_small = np.cumsum(gaps[order]) <= may_stay
        room = max(1, (MAX_VOLUME_SQUARES - len(squares)) // 3)
        # In their order, so that each is near the one before.
        rows = np.sort(order[~is_small][-room:])
        parts = _quarters(squares[rows], quarter_means, extremes, box)
        squares, low, high = (
            np.concatenate([np.delete(values, rows, axis=0), part])
            for values, part in zip((squares, low, high), parts, strict=True)
        )
    x, y = squares[int(np.argmax(high)), :2].tolist()
    return Bracket(total[0], total[1], (x, y), len(squares))


def _quarters(
    squares: Floats,
    quarter_means: Bounds | None,
    extremes: Bounds,
    box: tuple[float, float, float, float],
) -> tuple[Floats, Floats, Floats]:
    """Return the quarters (4 K, 3) of squares, and lower and upper bounds of the integral over the
    part of each that is in the box."""
    quarters = divided(squares)
    low = np.maximum(quarters[:, :2] - quarters[:, 2:], box[:2])
    high = np.minimum(quarters[:, :2] + quarters[:, 2:], box[2:])
    sides = np.maximum(high - low, 0.0)
    size = sides[:, 0] * sides[:, 1]
    is_full = size >= 4.0 * quarters[:, 2] ** 2 * (1.0 - 1e-9)
    is_full &= quarter_means is not None
    is_whole = is_full.reshape(-1, 4).all(axis=1)
    is_whole_quarter, part = np.repeat(is_whole, 4), np.repeat(~is_whole, 4) & (size > 0.0)
    bounds = np.zeros((2, len(quarters)))
    if quarter_means is not None:
        bounds[:, is_whole_quarter] = quarter_means(squares[is_whole])
    bounds[:, part] = extremes(quarters[part])
    return quarters, size * bounds[0], size * bounds[1]


def _first_squares(box: tuple[float, float, float, float]) -> Floats:
    """Return squares (K, 3) of middle and half side that cover a box."""
    wide, high = box[2] - box[0], box[3] - box[1]
    side = max(np.sqrt(wide * high / FIRST_SQUARES), max(wide, high) / FIRST_SQUARES, 1e-6)
    columns, rows = max(1, int(np.ceil(wide / side))), max(1, int(np.ceil(high / side)))
    x = box[0] + (np.arange(columns) + 0.5) * side
    y = box[1] + (np.arange(rows) + 0.5) * side
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    return np.column_stack([grid, np.full(len(grid), 0.5 * side)])


def divided(squares: Floats) -> Floats:
    """Return the four quarters of each square, (4 K, 3) for (K, 3) of middle and half side."""
    half = 0.5 * squares[:, 2]
    middles = squares[:, None, :2] + QUARTERS * half[:, None, None]
    return np.column_stack([middles.reshape(-1, 2), np.repeat(half, 4)])
