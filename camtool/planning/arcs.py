"""Arcs that were split (a polyline holds half circles at most) put together again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Polyline, Segments

LARGEST_PART_SWEEP_RAD = 2.0 * np.pi - 1e-3
"""Arcs are not put together beyond this, except a whole circle: an end near the start could be
taken for the other side of it."""

SLOPE_EPS = 1e-9
"""Parts of a helix whose slopes (mm per mm) differ by no more than this go on in each other."""


@dataclass(frozen=True)
class Cut:
    """One line or arc to cut: where it ends, (x, y, z) mm; for arcs the centre (x, y) and the
    direction; its feed in mm/min, NaN for a rapid."""

    end: tuple[float, float, float]
    centre: tuple[float, float] | None
    ccw: bool
    feed: float


def joints(p: Polyline) -> Bools:
    """(n,) for a closed path, the vertices where one move ends and another begins.

    For a circle every vertex is as good, and all are true.
    """
    segments = Segments.of(p)
    before = np.roll(np.arange(len(segments)), 1)
    split = ~_same_arc(segments[before], segments)
    return split if split.any() else np.ones(len(segments), dtype=np.bool_)


def cuts(vertices: Floats, feed_mm_min: Floats) -> Iterator[Cut]:
    """The lines and arcs of a run in order, arcs of one circle that follow each other as one.

    `vertices` (n, 4) of x, y, z, bulge and `feed_mm_min` (n−1,) as in a Run. A circle becomes a
    single arc that ends where it starts, a helix one arc for each turn.
    """
    segments = Segments.between(vertices[:-1, :2], vertices[1:, :2], vertices[:-1, 3])
    goes_on = _goes_on(segments, vertices, feed_mm_min)
    begin, swept = 0, 0.0
    for row, sweep in enumerate(segments.sweep.tolist()):
        if row > begin and goes_on[row - 1] and _within(segments, begin, row, swept + sweep):
            swept += sweep
            continue
        if row > begin:
            yield _cut(segments, slice(begin, row), vertices[row], feed_mm_min[begin])
        begin, swept = row, sweep
    if len(segments):
        yield _cut(segments, slice(begin, None), vertices[-1], feed_mm_min[begin])


def _within(segments: Segments, begin: int, last: int, swept: float) -> bool:
    """Whether the rows from `begin` to `last` sweep no more than an arc may, or a whole circle."""
    if abs(swept) <= LARGEST_PART_SWEEP_RAD:
        return True
    apart = segments.end[last] - segments.start[begin]
    return bool(np.hypot(*apart) <= POSITION_EPS_MM and abs(swept) <= 2.0 * np.pi + SLOPE_EPS)


def _goes_on(segments: Segments, vertices: Floats, feed: Floats) -> Bools:
    """(n−2,) true where a segment goes on in the next: one circle, one slope, one feed."""
    length = np.where(segments.is_arc, segments.radius, 0.0) * np.abs(segments.sweep)
    slope = np.diff(vertices[:, 2]) / np.where(segments.is_arc, length, 1.0)
    same = _same_arc(segments[:-1], segments[1:]) & (np.abs(np.diff(slope)) <= SLOPE_EPS)
    return np.asarray(same & (feed[:-1] == feed[1:]))


def _cut(segments: Segments, rows: slice, end: Floats, feed: float) -> Cut:
    """One move over these rows; the longest arc among them knows the centre best."""
    best = int(np.abs(segments.sweep[rows]).argmax()) + rows.start
    x, y, z = end[:3].tolist()
    if segments.bulge[best] == 0.0:
        return Cut((x, y, z), None, False, float(feed))
    if np.hypot(x - segments.start[rows.start, 0], y - segments.start[rows.start, 1]) <= (
        POSITION_EPS_MM
    ):
        x, y = segments.start[rows.start].tolist()
    centre_x, centre_y = segments.centre[best].tolist()
    return Cut((x, y, z), (centre_x, centre_y), bool(segments.bulge[best] > 0.0), float(feed))


def _same_arc(one: Segments, other: Segments) -> Bools:
    """(K,) true where two rows are arcs of one circle in the same direction."""
    alike = one.is_arc & other.is_arc & (np.sign(one.bulge) == np.sign(other.bulge))
    apart = np.where(alike[:, None], one.centre - other.centre, np.inf)
    # A line has an infinite radius, and the difference of two would be no number.
    radius, other_radius = (np.where(alike, each.radius, 0.0) for each in (one, other))
    near = np.hypot(apart[:, 0], apart[:, 1]) <= POSITION_EPS_MM
    return np.asarray(near & (np.abs(radius - other_radius) <= POSITION_EPS_MM))
