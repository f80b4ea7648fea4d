"""Heights of the stock by ternary search along each move: the twin of `camtool.kernels.stock`.

Along a straight move the height over a point is convex, inf where the tool does not reach it, so
thirds of the part within reach close in on its least value.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.arrays import Floats
from camtool.stock.moves import StockMoves

THIRDS = 200


def profile(cutter: tuple[float, float, float, float], apart: float) -> float:
    """Height of a tool's surface over its tip, so far from its axis."""
    radius, flat, corner, rise = cutter
    if apart > radius:
        return math.inf
    if apart <= flat:
        return 0.0
    if corner:
        return corner - math.sqrt(max(corner**2 - (apart - flat) ** 2, 0.0))
    return (apart - flat) * rise


def height(moves: StockMoves, row: int, x: float, y: float) -> float:
    """Least height to which one move cuts a point."""
    cutter = moves.cutters[int(moves.tool[row])].columns
    a, b = moves.start[row], moves.end[row]
    length = math.hypot(b[0] - a[0], b[1] - a[1])
    if length == 0.0:
        return min(a[2], b[2]) + profile(cutter, math.hypot(x - a[0], y - a[1]))
    along = ((x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])) / length**2
    aside = abs((x - a[0]) * (b[1] - a[1]) - (y - a[1]) * (b[0] - a[0])) / length
    if aside > cutter[0]:
        return math.inf
    reach = math.sqrt(cutter[0] ** 2 - aside**2) / length
    low, high = max(0.0, along - reach), min(1.0, along + reach)
    if low > high:
        return math.inf

    def at(share: float) -> float:
        apart = min(math.hypot(aside, (share - along) * length), cutter[0])
        return float(a[2] + share * (b[2] - a[2]) + profile(cutter, apart))

    for _ in range(THIRDS):
        one, other = low + (high - low) / 3.0, high - (high - low) / 3.0
        if at(one) < at(other):
            high = other
        else:
            low = one
    return min(at(low), at(high))


def heights(moves: StockMoves, points: Floats, top: float = 0.0) -> Floats:
    """(J,) heights of the stock over points (J, 2)."""
    rows = [
        min([top, *(height(moves, row, x, y) for row in range(len(moves)))])
        for x, y in points.tolist()
    ]
    return np.array(rows)
