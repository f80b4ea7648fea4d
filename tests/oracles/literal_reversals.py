"""The oracle of `reversals_of` of pictures: piece by piece, each axis with its last sign.

Between the multiples of 90° an arc has one direction in X and one in Y; each such piece, and each
line, has a sign per axis. An axis reverses where its sign differs from its last sign that was not
0, rapids included; a reversal counts where the piece after it is a feed.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.toolpath.moves import Toolpath

Piece = tuple[tuple[float, float], tuple[int, int]]

LEAST_PIECE_RAD = 1e-9
"""Of an arc that begins or ends at a multiple of 90°, a shorter piece is not counted."""


def reversals_of(toolpath: Toolpath) -> Floats:
    """(R, 2) mm: the places of reversals, in order; both axes may reverse at one."""
    last = [0, 0]
    places = []
    is_feed = toolpath.is_feed.tolist()
    for row in np.flatnonzero(toolpath.is_motion).tolist():
        for place, signs in _pieces(toolpath, row):
            turned = False
            for axis, sign in enumerate(signs):
                turned |= sign * last[axis] < 0
                last[axis] = sign or last[axis]
            if turned and is_feed[row]:
                places.append(place)
    return np.array(places).reshape(-1, 2)


def _pieces(toolpath: Toolpath, row: int) -> Iterator[Piece]:
    """Yield the start of each monotone piece of a move, and the signs of X and Y on it."""
    x0, y0 = toolpath.starts[row, :2].tolist()
    x1, y1 = toolpath.end[row, :2].tolist()
    sweep = float(toolpath.sweeps()[row]) if toolpath.is_arc[row] else 0.0
    if sweep == 0.0:
        yield (x0, y0), (_sign(x1 - x0), _sign(y1 - y0))
        return
    cx, cy = toolpath.centre[row].tolist()
    radius, begin = math.hypot(x0 - cx, y0 - cy), math.atan2(y0 - cy, x0 - cx)
    way = math.copysign(1.0, sweep)
    angles = [begin, *_quarters(begin, begin + sweep), begin + sweep]
    for low, high in pairwise(angles):
        middle = 0.5 * (low + high)
        signs = (_sign(-way * math.sin(middle)), _sign(way * math.cos(middle)))
        yield (cx + radius * math.cos(low), cy + radius * math.sin(low)), signs


def _quarters(begin: float, end: float) -> list[float]:
    """The multiples of 90° strictly between two angles, in the order of travel."""
    low, high = sorted((begin, end))
    quarter = 0.5 * math.pi
    first = math.ceil((low + LEAST_PIECE_RAD) / quarter)
    last = math.floor((high - LEAST_PIECE_RAD) / quarter)
    found = [k * quarter for k in range(first, last + 1)]
    return found if end > begin else found[::-1]


def _sign(length: float) -> int:
    return (length > POSITION_EPS_MM) - (length < -POSITION_EPS_MM)
