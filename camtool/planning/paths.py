"""Paths by the length along them, pieces cut out of them exactly, and arcs put together again.

A piece of a line or an arc keeps to it: with the bulge b of the whole, the part f of it has

    bulge = tan(f · atan b),

because the bulge is tan(sweep/4) and the part f of the length has the part f of the sweep.
Lengths may run below 0 and beyond the whole of a closed path: that is further round. Arcs that
were split, since a polyline holds half circles at most, become one arc again (`joints`, `cuts`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.distance import nearest
from camtool.geometry.measure import Frames, dot, point_at, segment_lengths, turned
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Segments

QUARTER = math.tan(math.pi / 8.0)
"""The bulge of a quarter of a circle."""

LARGEST_PART_SWEEP_RAD = 2.0 * np.pi - 1e-3
"""Arcs are not put together beyond this, except a whole circle: an end near the start could be
taken for the other side of it."""

SLOPE_EPS = 1e-9
"""Parts of a helix whose slopes (mm per mm) differ by no more than this are joined."""


@dataclass(frozen=True, eq=False)
class MeasuredPath:
    """A path with the length `reach` (n+1,) mm from its start to the start of each segment, and
    to its end: `total_mm`."""

    path: Polyline
    segments: Segments
    reach: Floats

    @classmethod
    def of(cls, path: Polyline) -> MeasuredPath:
        """The path, measured."""
        segments = Segments.of(path)
        reach = np.concatenate([[0.0], np.cumsum(segment_lengths(segments))])
        return cls(path, segments, reach)

    @cached_property
    def turns(self) -> Floats:
        """(n,) rad by which the path turns at the start of each segment, left positive; 0 at the
        start of an open one."""
        frames = Frames.of(self.segments)
        before = np.roll(frames.tangent_at(np.ones(len(self.segments))), 1, axis=0)
        cross = dot(turned(before), frames.tangent)
        turns = np.arctan2(cross, dot(before, frames.tangent))
        if not self.path.closed:
            turns[0] = 0.0
        return turns

    @property
    def total_mm(self) -> float:
        """The length of the path."""
        return float(self.reach[-1])

    def at(self, lengths: Floats) -> Floats:
        """(J, 2) the places at these lengths (J,) mm."""
        row, part = self._where(lengths, 0.0)
        return point_at(self.segments, row, part)

    def directions(self, lengths: Floats) -> Floats:
        """(J, 2) the unit tangents at these lengths (J,) mm; at a vertex, of what follows it."""
        row, part = self._where(lengths, POSITION_EPS_MM)
        return Frames.of(self.segments[row]).tangent_at(part)

    def arrivals(self, lengths: Floats) -> Floats:
        """(J, 2) the unit tangents at these lengths (J,) mm; at a vertex, of what leads to it."""
        row, part = self._where(lengths, -POSITION_EPS_MM)
        return Frames.of(self.segments[row]).tangent_at(part)

    def nearest_to(self, point: tuple[float, float]) -> float:
        """The length at which the path is nearest to a point (x, y) mm.

        Measured from the start of an arc of the curvature k, with the point at x along the tangent
        and y along the left normal, the foot of the point is  atan2(k x, 1 − k y) / k  along.
        """
        where = np.array([point])
        found = nearest(where, self.segments)
        row = int(found.segment[0])
        frame = Frames.of(self.segments[found.segment])
        q = where - frame.start
        x, y = float(dot(q, frame.tangent)[0]), float(dot(q, frame.normal)[0])
        k, size = float(frame.curvature[0]), float(frame.length[0])
        foot = x if k == 0.0 else math.atan2(k * x, 1.0 - k * y) / k
        begin = float(self.reach[row])
        tries = begin + np.array([min(max(foot, 0.0), size), 0.0, size])
        apart = self.at(tries) - where
        return float(tries[np.hypot(apart[:, 0], apart[:, 1]).argmin()])

    def piece(self, begin: float, end: float) -> Floats:
        """(k, 3) x, y, bulge from one length to another, backwards when `end` is the lower one.

        Vertices nearer than POSITION_EPS_MM to an end are that end. The last bulge is 0.
        """
        if end < begin:
            return backwards(self.piece(end, begin))
        rows, low, high = self._spans(begin, end)
        whole = self.segments.bulge[rows]
        part = high - low
        bulge = np.where(part == 1.0, whole, np.tan(part * np.arctan(whole)))
        vertices = np.column_stack([point_at(self.segments, rows, low), bulge])
        last = point_at(self.segments, rows[-1:], high[-1:])
        return np.concatenate([vertices, np.column_stack([last, [0.0]])])

    def _spans(self, begin: float, end: float) -> tuple[Ints, Floats, Floats]:
        """The segments between two lengths in order, and the part of each where it begins and
        ends."""
        total, count = self.total_mm, len(self.segments)
        laps = (math.floor(begin / total), math.floor(end / total)) if self.path.closed else (0, 0)
        rows = np.arange(laps[0] * count, (laps[1] + 1) * count)
        lap, row = np.divmod(rows, count)
        start = lap * total + self.reach[row]
        length = self.reach[row + 1] - self.reach[row]
        keep = (start + length > begin + POSITION_EPS_MM) & (start < end - POSITION_EPS_MM)
        if not keep.any():  # shorter than POSITION_EPS_MM: a piece of the one there
            keep = np.arange(len(rows)) == np.searchsorted(start, begin, side="right") - 1
        start, length, row = start[keep], length[keep], row[keep]
        low = np.where(begin - start > POSITION_EPS_MM, (begin - start) / length, 0.0)
        high = np.where(start + length - end > POSITION_EPS_MM, (end - start) / length, 1.0)
        return row, low, high

    def _where(self, lengths: Floats, ahead_mm: float) -> tuple[Ints, Floats]:
        """The segment that is so far ahead of each length, and the part of it at the length.

        Ends of open paths reach no further.
        """
        inside = lengths
        if self.path.closed:
            inside = np.mod(lengths + ahead_mm, self.total_mm) - ahead_mm
        row = np.searchsorted(self.reach, inside + ahead_mm, side="right") - 1
        row = np.clip(row, 0, len(self.segments) - 1)
        part = (inside - self.reach[row]) / (self.reach[row + 1] - self.reach[row])
        return row, np.clip(part, 0.0, 1.0)


def backwards(vertices: Floats) -> Floats:
    """Vertices (k, n) of an open path, the bulge in the last column, travelled in the other
    direction."""
    back = vertices[::-1].copy()
    back[:-1, -1] = 0.0 - vertices[-2::-1, -1]
    back[-1:, -1] = 0.0
    return back


def joined(paths: Sequence[Floats]) -> Floats:
    """Open paths (k, n), each of which begins where the one before it ends, as one."""
    return np.concatenate([*(path[:-1] for path in paths[:-1]), paths[-1]])


def midpoints(segments: Segments) -> Floats:
    """(K, 2) the midpoints of lines and arcs."""
    return point_at(segments, np.arange(len(segments)), np.full(len(segments), 0.5))


def runs_of_true(values: Bools) -> tuple[Ints, Ints]:
    """(J,), (J,): from which and up to which index values are true, the last one not included."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], values.astype(np.int64), [0]])))
    return edges[::2], edges[1::2]


def flat(vertices: Floats) -> Polyline | None:
    """A run (n, 4) of x, y, z, bulge seen from above, without the moves that lead nowhere there;
    None when it stays at one place."""
    kept: list[Floats] = []
    for vertex in vertices[:, [0, 1, 3]]:
        if kept and np.hypot(*(vertex[:2] - kept[-1][:2])) <= POSITION_EPS_MM:
            kept.pop()  # the later one knows the bulge of the move that leads away
        kept.append(vertex)
    return Polyline(np.array(kept)) if len(kept) > 1 else None


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
