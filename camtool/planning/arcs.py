"""Arcs that were split (a polyline holds half circles at most) put together again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Ints, Polyline, Segments

LARGEST_PART_SWEEP_RAD = 2.0 * np.pi - 1e-3
"""Arcs are not put together beyond this, except a whole circle: an end near the start could be
taken for the other side of it."""


@dataclass(frozen=True)
class Cut:
    """One line or arc to cut: where it ends, (x, y) mm; for arcs the centre and direction."""

    end: tuple[float, float]
    centre: tuple[float, float] | None = None
    ccw: bool = False


def joints(p: Polyline) -> Bools:
    """(n,) for a closed path, the vertices where one move ends and another begins.

    For a circle every vertex is as good, and all are true.
    """
    segments = Segments.of(p)
    before = np.roll(np.arange(len(segments)), 1)
    split = ~_same_arc(segments[before], segments)
    return split if split.any() else np.ones(len(segments), dtype=np.bool_)


def cuts(p: Polyline) -> Iterator[Cut]:
    """The lines and arcs of a path in order, arcs of one circle that follow each other as one.

    A circle becomes a single arc that ends where it starts.
    """
    segments = Segments.of(p)
    rows = np.arange(len(segments))
    goes_on = _same_arc(segments[rows[:-1]], segments[rows[1:]])
    around = bool(_same_arc(segments[rows[-1:]], segments[rows[:1]])[0])
    if p.closed and goes_on.all() and around:
        yield _cut(segments, rows)
        return
    begin = 0
    swept = float(segments.sweep[0])
    for row in range(1, len(segments) + 1):
        if row < len(segments):
            swept += float(segments.sweep[row])
            if goes_on[row - 1] and abs(swept) <= LARGEST_PART_SWEEP_RAD:
                continue
            swept = float(segments.sweep[row])
        yield _cut(segments, rows[begin:row])
        begin = row


def _cut(segments: Segments, rows: Ints) -> Cut:
    """One move over these rows; the longest arc among them knows the centre best."""
    x, y = segments.end[rows[-1]].tolist()
    best = rows[np.abs(segments.sweep[rows]).argmax()]
    if segments.bulge[best] == 0.0:
        return Cut((x, y))
    centre_x, centre_y = segments.centre[best].tolist()
    return Cut((x, y), (centre_x, centre_y), bool(segments.bulge[best] > 0.0))


def _same_arc(one: Segments, other: Segments) -> Bools:
    """(K,) true where two rows are arcs of one circle in the same direction."""
    alike = one.is_arc & other.is_arc & (np.sign(one.bulge) == np.sign(other.bulge))
    apart = np.where(alike[:, None], one.centre - other.centre, np.inf)
    # A line has an infinite radius, and the difference of two would be no number.
    radius, other_radius = (np.where(alike, each.radius, 0.0) for each in (one, other))
    near = np.hypot(apart[:, 0], apart[:, 1]) <= POSITION_EPS_MM
    return np.asarray(near & (np.abs(radius - other_radius) <= POSITION_EPS_MM))
