"""Paths by the length along them, pieces cut out of them exactly, and arcs put together again.

Pieces of lines and arcs keep to them (`camtool.kernels.passes`). Lengths may run below 0 and
beyond the whole of a closed path: that is further round. Arcs that were split, since a polyline
holds half circles at most, become one arc again (`joints`, `cuts`)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.distance import nearest
from camtool.geometry.measure import Frames, dot, point_at, segment_lengths, turn_left
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.kernels.passes import Tracks, piece, reaches

QUARTER = math.tan(math.pi / 8.0)

MAX_PART_SWEEP_RAD = 2.0 * np.pi - 1e-3
"""Arcs are not put together beyond this, except a whole circle: an end near the start could be
taken for the other side of it."""

SLOPE_EPS = 1e-9
"""Parts of a helix whose slopes (mm per mm) differ by no more than this are joined."""


class MeasuredPaths:
    """Paths in columns with the lengths along them: `lines`, their `segments`, and the `tracks` of
    camtool.kernels.passes, which know the `reach`, mm, to the start of each segment and to the end
    of each path. Iterating gives a `MeasuredPath` for each."""

    def __init__(self, lines: Polylines) -> None:
        self.lines, self.segments = lines, Segments.of(lines)
        self.first = np.concatenate([[0], np.cumsum(np.diff(lines.offsets) - ~lines.closed)])
        self.reach = reaches(segment_lengths(self.segments), self.first)
        self.tracks = Tracks(
            np.ascontiguousarray(self.segments.start),
            np.ascontiguousarray(self.segments.end),
            np.ascontiguousarray(self.segments.bulge),
            self.first,
            lines.closed.astype(np.int64),
            self.reach,
        )
        self.total_mm = self.reach[self.first[1:] + np.arange(len(lines))]
        """(M,) the length of each path."""

    def __len__(self) -> int:
        return len(self.lines)

    def __iter__(self) -> Iterator[MeasuredPath]:
        return (MeasuredPath(self, index) for index in range(len(self)))


class MeasuredPath:
    """A path with the lengths along it: path `index` of `paths`."""

    def __init__(self, paths: MeasuredPaths, index: int) -> None:
        self.paths, self.index = paths, index

    @classmethod
    def of(cls, path: Polyline) -> MeasuredPath:
        """Measure a single path."""
        return cls(MeasuredPaths(Polylines.of([path])), 0)

    @cached_property
    def path(self) -> Polyline:
        """The path itself."""
        return self.paths.lines[self.index]

    @cached_property
    def segments(self) -> Segments:
        """The n lines and arcs of the path."""
        first = self.paths.first
        return self.paths.segments[first[self.index] : first[self.index + 1]]

    @cached_property
    def reach(self) -> Floats:
        """Lengths (n+1,) mm from the start of the path to the start of each segment, and to its
        end."""
        first, index = self.paths.first, self.index
        return self.paths.reach[first[index] + index : first[index + 1] + index + 1]

    @cached_property
    def turns(self) -> Floats:
        """Angles (n,) rad by which the path turns at the start of each segment, left positive; 0
        at the start of an open one."""
        frames = Frames.of(self.segments)
        before = np.roll(frames.tangent_at(np.ones(len(self.segments))), 1, axis=0)
        cross = dot(turn_left(before), frames.tangent)
        turns = np.arctan2(cross, dot(before, frames.tangent))
        if not self.closed:
            turns[0] = 0.0
        return turns

    @property
    def closed(self) -> bool:
        """True if the path is closed."""
        return bool(self.paths.lines.closed[self.index])

    @property
    def total_mm(self) -> float:
        """The length of the path."""
        return float(self.paths.total_mm[self.index])

    def at(self, lengths: Floats) -> Floats:
        """Return the places (J, 2) at these lengths (J,) mm."""
        row, part = self._locate(lengths, 0.0)
        return point_at(self.segments, row, part)

    def directions(self, lengths: Floats) -> Floats:
        """Return the unit tangents (J, 2) at these lengths (J,), mm; at a vertex, the tangent of
        the segment after it."""
        row, part = self._locate(lengths, POSITION_EPS_MM)
        return Frames.of(self.segments[row]).tangent_at(part)

    def arrivals(self, lengths: Floats) -> Floats:
        """Return the unit tangents (J, 2) at these lengths (J,), mm; at a vertex, the tangent of
        the segment before it."""
        row, part = self._locate(lengths, -POSITION_EPS_MM)
        return Frames.of(self.segments[row]).tangent_at(part)

    def nearest_to(self, point: tuple[float, float]) -> float:
        """Return the length along the path to its point nearest to (x, y), mm.

        Measured from the start of an arc of the curvature k, with the point at x along the tangent
        and y along the left normal, the foot of the point is atan2(k x, 1 − k y) / k along."""
        place = np.array([point])
        nearest_place = nearest(place, self.segments)
        row = int(nearest_place.segment[0])
        frame = Frames.of(self.segments[nearest_place.segment])
        q = place - frame.start
        x, y = float(dot(q, frame.tangent)[0]), float(dot(q, frame.normal)[0])
        k, size = float(frame.curvature[0]), float(frame.length[0])
        foot = x if k == 0.0 else math.atan2(k * x, 1.0 - k * y) / k
        begin = float(self.reach[row])
        tries = begin + np.array([min(max(foot, 0.0), size), 0.0, size])
        gaps = self.at(tries) - place
        return float(tries[np.hypot(gaps[:, 0], gaps[:, 1]).argmin()])

    def piece(self, begin: float, end: float) -> Floats:
        """Return the vertices (k, 3) x, y, bulge of the path from one length to another, backwards
        if `end` is less than `begin`.

        Vertices nearer than POSITION_EPS_MM to an end are merged with it. The last bulge is 0."""
        vertices = piece(self.paths.tracks, self.index, begin, end)
        return np.ascontiguousarray(vertices[:, [0, 1, 3]])

    def _locate(self, lengths: Floats, ahead_mm: float) -> tuple[Ints, Floats]:
        """Return, for each length (J,), the segment at `ahead_mm` beyond it, and the share of that
        segment at the length itself.

        Lengths beyond the ends of an open path count as its ends."""
        inside = lengths
        if self.closed:
            inside = np.mod(lengths + ahead_mm, self.total_mm) - ahead_mm
        row = np.searchsorted(self.reach, inside + ahead_mm, side="right") - 1
        row = np.clip(row, 0, len(self.segments) - 1)
        part = (inside - self.reach[row]) / (self.reach[row + 1] - self.reach[row])
        return row, np.clip(part, 0.0, 1.0)


def reverse_vertices(vertices: Floats) -> Floats:
    """Return the vertices (k, n) of an open path in the opposite direction; the bulge is the last
    column."""
    vertices_back = vertices[::-1].copy()
    vertices_back[:-1, -1] = 0.0 - vertices[-2::-1, -1]
    vertices_back[-1:, -1] = 0.0
    return vertices_back


def join_paths(paths: Sequence[Floats]) -> Floats:
    """Join open paths (k, n), each of which begins where the one before it ends."""
    return np.concatenate([*(path[:-1] for path in paths[:-1]), paths[-1]])


def midpoints(segments: Segments) -> Floats:
    """Return the midpoints (K, 2) of lines and arcs."""
    return point_at(segments, np.arange(len(segments)), np.full(len(segments), 0.5))


def true_ranges(values: Bools) -> tuple[Ints, Ints]:
    """Return the ranges of consecutive True values: their first indices (J,), and the indices (J,)
    after their last ones."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], values.astype(np.int64), [0]])))
    return edges[::2], edges[1::2]


def flat_path(vertices: Floats) -> Polyline | None:
    """Return a run (n, 4) x, y, z, bulge seen from above, without moves that are vertical; None if
    it stays at one place."""
    vertices_kept: list[Floats] = []
    for vertex in vertices[:, [0, 1, 3]]:
        if vertices_kept and np.hypot(*(vertex[:2] - vertices_kept[-1][:2])) <= POSITION_EPS_MM:
            vertices_kept.pop()  # the later one has the bulge of the move that leads away
        vertices_kept.append(vertex)
    return Polyline(np.array(vertices_kept)) if len(vertices_kept) > 1 else None


class Cuts(Struct, frozen=True, eq=False):
    """C lines and arcs to cut, in order: the `run` (C,) of each; where it ends, `end` (C, 3) mm;
    of arcs the `centre` (C, 2) mm, NaN for lines, and the direction `ccw` (C,); the `feed` (C,)
    in mm/min, NaN for a rapid."""

    run: Ints
    end: Floats
    centre: Floats
    ccw: Bools
    feed: Floats


def joints(lines: Polylines) -> Bools:
    """Return the mask (N,) of the vertices of closed paths where one move ends and another begins
    (not those within an arc).

    On a circle every vertex is as good as another, and all are True; so are all vertices of open
    paths."""
    is_joint = np.ones(len(lines.vertices), dtype=np.bool_)
    rows = np.flatnonzero(np.repeat(lines.closed, np.diff(lines.offsets)))
    segments = Segments.of(lines)
    segments = segments[lines.closed[segments.path]]
    first = np.searchsorted(segments.path, segments.path)
    last = np.searchsorted(segments.path, segments.path, side="right") - 1
    row_numbers = np.arange(len(segments))
    split = ~_same_arc(segments[np.where(row_numbers == first, last, row_numbers - 1)], segments)
    parts = np.bincount(segments.path[split], minlength=len(lines))
    is_joint[rows] = split | (parts[segments.path] == 0)
    return is_joint


def cuts(vertices: Floats, feed_mm_min: Floats, first: Ints) -> Cuts:
    """Return the lines and arcs of R runs; consecutive arcs of one circle are joined.

    Run i has the rows first[i] to first[i + 1] (R + 1,) of `vertices` (N, 4), x, y, z, bulge, and
    of `feed_mm_min` (N,), that of the move which leaves the vertex. A circle becomes a single arc
    that ends where it starts, a helix one arc for each turn."""
    leaves = np.ones(len(vertices), dtype=np.bool_)
    leaves[first[1:] - 1] = False
    rows = np.flatnonzero(leaves)
    run = np.repeat(np.arange(len(first) - 1), np.diff(first) - 1)
    segments = Segments.between(vertices[rows, :2], vertices[rows + 1, :2], vertices[rows, 3], run)
    z, end_z, feed = vertices[rows, 2], vertices[rows + 1, 2], feed_mm_min[rows]
    heads = np.flatnonzero(_begins_move(segments, _continues(segments, end_z - z, feed)))
    if len(heads) == 0:
        return Cuts(run, np.empty((0, 3)), np.empty((0, 2)), np.empty(0, dtype=np.bool_), feed)
    # Of the joined arcs the longest has the most exact centre.
    size = np.abs(segments.sweep)
    counts = np.diff(np.append(heads, len(rows)))
    longest = np.flatnonzero(size == np.repeat(np.maximum.reduceat(size, heads), counts))
    best = longest[np.searchsorted(longest, heads)]
    last = heads + counts - 1
    bulge, end = segments.bulge[best], np.column_stack([segments.end[last], end_z[last]])
    arcs, centre = np.flatnonzero(bulge), np.full((len(heads), 2), np.nan)
    centre[arcs] = segments[best[arcs]].centre
    begin = segments.start[heads[arcs]]
    gaps = np.hypot(*(end[arcs, :2] - begin).T)
    round_ = gaps <= POSITION_EPS_MM
    end[arcs[round_], :2] = begin[round_]
    return Cuts(run=run[heads], end=end, centre=centre, ccw=bulge > 0.0, feed=feed[heads])


def _begins_move(segments: Segments, goes_on: Bools) -> Bools:
    """Return the mask (n,) of the segments with which a move begins; `goes_on` (n − 1,): the next
    segment may continue the move. An arc is divided where it would sweep more than a move may,
    unless it is a whole circle."""
    begins = np.ones(len(segments), dtype=np.bool_)
    begin, swept, last = 0, 0.0, -1
    for row in (np.flatnonzero(goes_on) + 1).tolist():
        if row - 1 != last:
            begin, swept = row - 1, float(segments.sweep[row - 1])
        last, sweep = row, float(segments.sweep[row])
        if _is_single_arc(segments, begin, row, swept + sweep):
            begins[row] = False
            swept += sweep
        else:
            begin, swept = row, sweep
    return begins


def _is_single_arc(segments: Segments, begin: int, last: int, swept: float) -> bool:
    """Return True if the rows from `begin` to `last` together sweep no more than one arc may, or a
    whole circle."""
    if abs(swept) <= MAX_PART_SWEEP_RAD:
        return True
    gap = segments.end[last] - segments.start[begin]
    return bool(np.hypot(*gap) <= POSITION_EPS_MM and abs(swept) <= 2.0 * np.pi + SLOPE_EPS)


def _continues(segments: Segments, rise: Floats, feed: Floats) -> Bools:
    """Return the mask (n − 1,) of segments that the next one continues: same run, circle, slope
    and feed."""
    continues = _same_arc(segments[:-1], segments[1:]) & (feed[:-1] == feed[1:])
    continues &= np.diff(segments.path) == 0
    pairs = np.flatnonzero(continues)
    continues[pairs] = np.abs(
        _slopes(segments, rise, pairs + 1) - _slopes(segments, rise, pairs)
    ) <= (SLOPE_EPS)
    return np.asarray(continues)


def _slopes(segments: Segments, rise: Floats, rows: Ints) -> Floats:
    """Return the slopes (J,) of these rows, which must be arcs, mm per mm."""
    arcs = segments[rows]
    return np.asarray(rise[rows] / (arcs.radius * np.abs(arcs.sweep)))


def _same_arc(one: Segments, other: Segments) -> Bools:
    """Return the mask (K,) of rows in which both segments are arcs of the same circle and
    direction."""
    is_same = one.is_arc & (np.sign(one.bulge) == np.sign(other.bulge))
    rows = np.flatnonzero(is_same)
    one, other = one[rows], other[rows]
    gaps = one.centre - other.centre
    is_near = np.hypot(gaps[:, 0], gaps[:, 1]) <= POSITION_EPS_MM
    is_same[rows] = is_near & (np.abs(one.radius - other.radius) <= POSITION_EPS_MM)
    return np.asarray(is_same)
