"""Fewer points of the predicted path, where nobody could see the difference.

Of points in a row every second one goes, if it lies near the chord of its neighbours and has their
colour; then every second one of what is left, and so on. A point that stays is where it was, and
one that goes leaves the path by at most the tolerance each time.
"""

from __future__ import annotations

import numpy as np

from camtool.preview.viewer.run import Floats, Ints

MOST_POINTS = 200_000
"""A page has no more points of the predicted path than this."""

FINEST_MM = 1e-4
"""Points this near to the chord of their neighbours may go ..."""

FINEST_SHARE = 0.01
"""... or this share of the largest error, where that is less ..."""

COARSER = 4.0
"""... or so many times as far again, while there are too many points."""


def thinned(points: Floats, bins: Ints, largest_mm: float, most: int = MOST_POINTS) -> Ints:
    """Which points (T, 2) mm with their colours (T,) are kept: ascending rows, the ends of all
    pieces of a colour among them while that leaves few enough."""
    kept = np.arange(len(points))
    near_mm = min(FINEST_MM, FINEST_SHARE * largest_mm)
    while True:
        fewer = _halved(points, bins, kept, near_mm)
        if len(fewer) < len(kept):
            kept = fewer
        elif len(kept) <= most:
            return kept
        elif near_mm > np.ptp(points, axis=0).max():
            return kept[:: -(-len(kept) // most)]
        else:
            near_mm *= COARSER


def _halved(points: Floats, bins: Ints, kept: Ints, near_mm: float) -> Ints:
    """Without those of the 2nd, 4th, … points that may go; the first and the last one stay."""
    middle = np.arange(1, len(kept) - 1, 2)
    before, at, after = kept[middle - 1], kept[middle], kept[middle + 1]
    # The colour of a piece is that of the point that it leads to.
    same = bins[at] == bins[after]
    goes = same & (_from_chord(points[before], points[at], points[after]) <= near_mm)
    stays = np.ones(len(kept), dtype=np.bool_)
    stays[middle[goes]] = False
    return kept[stays]


def _from_chord(begin: Floats, point: Floats, end: Floats) -> Floats:
    chord, out = end - begin, point - begin
    square = (chord**2).sum(axis=1)
    share = (out * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    away = out - np.clip(share, 0.0, 1.0)[:, None] * chord
    return np.asarray(np.hypot(away[:, 0], away[:, 1]))
