"""Ways for the tool between two places of a region, at depth, that never leave the region.

A straight line leaves a region through one of its paths and comes back through the same one:
each path has the region on its left and one connected piece of what is not the region on its
right. So the way goes straight, and where the line is outside it follows that path, the shorter
way round.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camtool.geometry.distance import nearest, points_to_segments
from camtool.geometry.intersect import crossings
from camtool.geometry.measure import point_at
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints, Polylines, Segments
from camtool.planning.contours.along import Along

ON_LINE_MM = 5e-6
"""A place this near to the boundary of a region is still in it."""


@dataclass(frozen=True, eq=False)
class Rails:
    """A connected region on the left of its closed paths, made ready for ways in it."""

    region: Polylines

    @cached_property
    def segments(self) -> Segments:
        """All lines and arcs of the boundary."""
        return Segments.of(self.region)

    @cached_property
    def paths(self) -> list[Along]:
        """The paths of the boundary, measured."""
        return [Along.of(path) for path in self.region]

    def holds(self, points: Floats) -> Bools:
        """(P,) true for points (P, 2) in the region or on its boundary."""
        within = inside(points, self.segments)
        beside = np.flatnonzero(~within)
        if len(beside):
            within[beside] = nearest(points[beside], self.segments).distance <= ON_LINE_MM
        return within

    def place(self, point: Floats) -> tuple[int, float]:
        """The path nearest to a point (2,), and the length along it to its nearest place."""
        row = int(points_to_segments(point[None, :], self.segments)[0].argmin())
        path = int(self.segments.path[row])
        first = int(np.searchsorted(self.segments.path, path))
        return path, self.paths[path].reach[row - first] + _length_to(point, self.segments, row)


def closest(along: Along, point: Floats) -> tuple[float, float]:
    """Distance of a point (2,) from a path, and the length along it to the nearest place."""
    apart = points_to_segments(point[None, :], along.segments)[0]
    row = int(apart.argmin())
    return float(apart[row]), float(along.reach[row]) + _length_to(point, along.segments, row)


def _length_to(point: Floats, segments: Segments, row: int) -> float:
    """How far along a segment its place nearest to a point (2,) is."""
    one = segments[np.array([row])]
    if one.is_arc[0]:
        # Measured from the middle of the arc, no angle is near to half a turn.
        arm = point - one.centre[0]
        middle = one.start_angle[0] + 0.5 * one.sweep[0]
        turn = np.arctan2(arm[1], arm[0]) - middle
        turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
        part = 0.5 + turn / one.sweep[0]
        length = one.radius[0] * abs(one.sweep[0])
    else:
        chord = one.end[0] - one.start[0]
        part = float((point - one.start[0]) @ chord / (chord @ chord))
        length = float(np.hypot(*chord))
    return float(np.clip(part, 0.0, 1.0) * length)


def route(start: Floats, end: Floats, rails: Rails) -> Floats | None:
    """(k, 3) x, y, bulge from one place (2,) of a connected region to another, staying in it.

    None when rounding hides where the straight line goes out or in, or the two places are not in
    one connected region.
    """
    if np.hypot(*(end - start)) <= POSITION_EPS_MM:
        return np.array([[*start, 0.0]])
    rows = [np.array([[*start, 0.0]])]
    for out, back in _outside(start, end, rails):
        path, begin = rails.place(start + out * (end - start))
        other, stop = rails.place(start + back * (end - start))
        if path != other:
            return None
        rows.append(_along(rails.paths[path], begin, stop))
    rows.append(np.array([[*end, 0.0]]))
    return tidy(np.concatenate(rows))


def _outside(start: Floats, end: Floats, rails: Rails) -> list[tuple[float, float]]:
    """The parts (from, to) of the straight line that are outside of the region, in order."""
    room = points_to_segments(start[None, :], rails.segments).min()
    if np.hypot(*(end - start)) <= room + ON_LINE_MM:
        return []
    line = Segments.between(start[None, :], end[None, :], np.zeros(1))
    found = crossings(line, rails.segments, position_eps_mm=ON_LINE_MM)
    marks = np.unique(np.concatenate([[0.0, 1.0], found.ta]))
    middles = 0.5 * (marks[1:] + marks[:-1])
    points = point_at(line, np.zeros(len(middles), dtype=np.int64), middles)
    outside = np.concatenate([[False], ~rails.holds(points), [False]]).astype(np.int64)
    edges = marks[np.flatnonzero(np.diff(outside))]
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def _along(along: Along, begin: float, end: float) -> Floats:
    """The piece of a closed path between two lengths, the shorter way round."""
    forth = (end - begin) % along.total_mm
    back = along.total_mm - forth
    return along.piece(begin, begin + forth) if forth <= back else along.piece(begin, begin - back)


def tidy(vertices: Floats) -> Floats:
    """Vertices (k, 3) of an open path without steps up to POSITION_EPS_MM; both ends stay."""
    step = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    keep: Ints = np.flatnonzero(np.concatenate([step > POSITION_EPS_MM, [True]]))
    kept = vertices[keep].copy()
    kept[0, :2] = vertices[0, :2]
    return kept
