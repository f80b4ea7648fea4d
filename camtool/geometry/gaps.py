"""Open ends that may have been meant to meet: near each other, against the size of their paths.

A drawing may well have open strokes near each other, so nearness alone says little: a gap counts
when it is small against the paths that it parts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from camtool.geometry.drawing import Gap
from camtool.geometry.pairs import Ends, wrapped
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints

NEAR_GAPS = 100.0
"""An end that stays open is reported when another end is nearer than this many times the gap."""

OWN_GAP_SHARE = 0.1
"""The two ends of one path are a gap when they are nearer than this share of its length."""

GAP_SHARE = 0.05
"""Ends of two paths are a gap when they are nearer than this share of the shorter one."""

SHARPEST_TURN_RAD = 2.6
"""Two paths that would turn by more than this where they nearly meet lie side by side, as the
lines of a hatch do: their ends are no gap."""

SPACING_SHARE = 0.1
"""Ends of two paths are a gap when they are nearer than this share of the distance that ends
strewn at random over the drawing would have: among very many strokes some ends are near."""

FINEST_CELLS = 16.0
"""The grid in which near ends are looked for has no cell below this share of the reach."""


def open_gaps(ends: Ends, lengths: Floats, layers: Sequence[str], gap_mm: float) -> list[Gap]:
    """For each open path, the nearest other open end of its group if it looks like a gap.

    `ends` are those of M paths with `lengths` (M,) mm and `layers`. Each pair of ends comes once;
    ends that lie on each other are no gap.
    """
    found: dict[tuple[int, int], Gap] = {}
    is_open = np.flatnonzero(np.repeat(ends.is_open, 2))
    for group in np.unique(ends.group[is_open // 2]):
        rows = is_open[ends.group[is_open // 2] == group]
        one, other, size = _nearest_ends(
            ends.points[rows], NEAR_GAPS * max(gap_mm, POSITION_EPS_MM)
        )
        one, other = rows[one], rows[other]
        at_random = SPACING_SHARE * _spacing(ends.points[rows])
        near = _is_gap(ends, lengths, one, other, size) & (
            (one // 2 == other // 2) | (size <= at_random)
        )
        for a, b, apart in zip(
            one[near].tolist(), other[near].tolist(), size[near].tolist(), strict=True
        ):
            x, y = (0.5 * (ends.points[a] + ends.points[b])).tolist()
            found.setdefault((min(a, b), max(a, b)), Gap((x, y), apart, layers[a // 2]))
    return [found[key] for key in sorted(found)]


def _is_gap(ends: Ends, lengths: Floats, one: Ints, other: Ints, size: Floats) -> Bools:
    """Which pairs of near ends look as if they were meant to meet."""
    own = one // 2 == other // 2
    shorter = np.minimum(lengths[one // 2], lengths[other // 2])
    small = size <= np.where(own, OWN_GAP_SHARE, GAP_SHARE) * shorter
    turn = np.abs(wrapped(ends.leaving[one] - ends.leaving[other] - np.pi))
    return np.asarray(small & (own | (turn <= SHARPEST_TURN_RAD)))


def _spacing(points: Floats) -> float:
    """The mean distance of the nearest one of points strewn over the box of these, mm.

    It is half the square root of the area that each has, and half the length on a line.
    """
    width, height = (float(side) for side in np.ptp(points, axis=0))
    count = len(points)
    return max(0.5 * math.sqrt(width * height / count), 0.5 * max(width, height) / count)


def _nearest_ends(points: Floats, reach: float) -> tuple[Ints, Ints, Floats]:
    """Rows (J,), the row of the nearest other point (J,) and how far it is (J,), within reach."""
    from camtool.kernels.neighbours import nearest_others

    spread = points.max(axis=0) - points.min(axis=0)
    spacing = float(np.sqrt(spread[0] * spread[1] / len(points)))
    size = min(max(spacing, reach / FINEST_CELLS), reach)
    cells = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    nearest, distance = nearest_others(cells[order], points[order], size, POSITION_EPS_MM, reach)
    there = nearest >= 0
    return order[there], order[nearest[there]], distance[there]
