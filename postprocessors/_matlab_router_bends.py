"""Lines that whole speeds would bend, in pieces that stay straight.

Speeds are whole counts, so the slower axis is a little too fast or too slow, and one axis arrives
first: the line bends. For distances D ≥ d and speeds V, v of the faster and the slower axis

    r = (v/V) / (d/D),   bend = d · (1 − min(r, 1/r))

Lines that bend by more than a tolerance are halved until they do not, or until the slower axis
has a single chunk left; if its speed still is 0, the line becomes three: along the faster axis,
across with v = 1 (d · V long), along again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.toolpath.moves import Floats, Ints

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Limits:
    """How far a line may bend, the grid of its ends, and the least distance; all in units."""

    tolerance: float
    grid: int
    least: int


def bends(larger: Floats, smaller: Ints, counts: Ints, tolerance: float) -> Bools:
    """(n,) which lines stop (v = 0) or bend by more than the tolerance (units)."""
    slanted = smaller > 0
    wanted = counts * smaller / larger
    whole = np.floor(wanted + 0.5)
    ratio = np.where(slanted, whole / np.where(slanted, wanted, 1.0), 1.0)
    with np.errstate(divide="ignore"):
        bend = smaller * (1.0 - np.minimum(ratio, 1.0 / ratio))
    return np.asarray(slanted & ((whole == 0.0) | (bend > tolerance)))


def split_line(start: list[int], end: list[int], counts: int, limits: Limits) -> list[list[int]]:
    """The ends of the pieces of one line from `start` to `end` (x, y), its own end last."""
    way = (end[0] - start[0], end[1] - start[1])
    major = 0 if abs(way[0]) >= abs(way[1]) else 1
    at = list(start)
    ends = []
    for along, across in _pieces(abs(way[major]), abs(way[1 - major]), counts, limits):
        at[major] += along if way[major] > 0 else -along
        at[1 - major] += across if way[1 - major] > 0 else -across
        ends.append(list(at))
    return ends


def _bend(longer: int, shorter: int, counts: int) -> float:
    """How far one line bends (units); inf when its slower axis would stop."""
    wanted = counts * shorter / longer
    whole = math.floor(wanted + 0.5)
    if shorter == 0:
        return 0.0
    if whole == 0:
        return math.inf
    return shorter * (1.0 - min(whole / wanted, wanted / whole))


def _pieces(longer: int, shorter: int, counts: int, limits: Limits) -> list[tuple[int, int]]:
    """A line of these distances as pieces (along, across) that do not bend too much."""
    bend = _bend(longer, shorter, counts)
    if bend <= limits.tolerance:
        return [(longer, shorter)]
    grid = limits.grid
    if shorter >= 2 * limits.least:
        along, across = longer // 2 // grid * grid, shorter // 2 // grid * grid
        return [
            *_pieces(along, across, counts, limits),
            *_pieces(longer - along, shorter - across, counts, limits),
        ]
    if bend < math.inf:
        return [(longer, shorter)]
    rest = longer - shorter * counts
    before = rest // 2 // grid * grid
    before = before if before >= limits.least else 0
    parts = [(before, 0), (shorter * counts, shorter), (rest - before, 0)]
    return [part for part in parts if part != (0, 0)]
