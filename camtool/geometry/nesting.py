"""Which closed path holds which path, exact with arcs; and regions: outer paths with their holes.

A point is inside a closed path when it is inside the polygon of its chords, or when it lies
between a chord and its arc, but not both (XOR, arc by arc). A point exactly on a chord is taken
as a hair up and to the right of it, the same way in both questions, so that no point counts twice.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import GeometryError
from camtool.geometry.boxes import BoxIndex, Curves
from camtool.geometry.measure import path_extents, point_at, signed_areas
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments, reverse

HOLDERS_AT_A_TIME = 256
"""For how many paths those within their boxes are found together: it bounds the memory."""


class Nesting(Struct, frozen=True, eq=False):
    """For M paths: `parent` (M,), the smallest closed path that holds each one, −1 if none; and
    `depth` (M,), how many closed paths hold it."""

    parent: Ints
    depth: Ints


def nesting(lines: Polylines, holds: Bools | None = None) -> Nesting:
    """Which closed path holds which path; of closed paths only those that `holds` (M,) marks
    count as holders (None: all).

    Path i is in path j when its vertices and the middles of its segments lie inside j, or nearer
    to its line than `POSITION_EPS_MM` (but not all of them: a path does not hold its double, and
    doubles count as one). Paths that cross a closed path are not in it.
    """
    count = len(lines)
    parent, depth = np.full(count, -1, dtype=np.int64), np.zeros(count, dtype=np.int64)
    if not lines.closed.any():
        return Nesting(parent, depth)
    areas = np.abs(signed_areas(lines))
    boxes = path_extents(lines)
    is_double = np.zeros(count, dtype=np.bool_)
    # From large to small: the last path found to hold another one is the smallest of them.
    closed = np.flatnonzero(lines.closed)
    closed = closed[np.argsort(-areas[closed], kind="stable")]
    rank = np.full(count, len(closed))
    rank[closed] = np.arange(len(closed))
    places: _Places | None = None
    for j, within in _within(boxes, closed if holds is None else closed[holds[closed]]):
        inner = within[rank[within] > rank[j]]
        if len(inner) == 0 or is_double[j]:
            continue
        # Most drawings of very many paths hold none within another.
        places = places or _Places.of(lines)
        held, on_line = places.held(inner, j)
        is_double[on_line] = True
        parent[held] = j
        depth[held] += 1
    return Nesting(parent, depth)


def inside(points: Floats, ring: Segments) -> Bools:
    """(P,) true for the points (P, 2) within a closed path; on the line either may come out."""
    from camtool.kernels.offsets import insides

    curves = Curves.of(ring)
    return insides(
        np.ascontiguousarray(points, dtype=np.float64), curves.rows, ring.bulge, curves.tree
    )


class _Places(Struct, frozen=True, eq=False):
    """The segments of M paths, those of path i from first_segment[i] (M + 1,) on, and `points`
    (P, 2) mm, the vertices and the middles of all segments, those of path i from first_point[i]
    (M + 1,) on."""

    segments: Segments
    first_segment: Ints
    points: Floats
    first_point: Ints

    @classmethod
    def of(cls, lines: Polylines) -> _Places:
        segments, every = Segments.of(lines), np.arange(len(lines) + 1)
        rows = np.arange(len(segments))
        middles = point_at(segments, rows, np.full(len(rows), 0.5))
        of_vertices = np.repeat(np.arange(len(lines)), np.diff(lines.offsets))
        owner = np.concatenate([of_vertices, segments.path])
        order = np.argsort(owner, kind="stable")
        return cls(
            segments,
            np.searchsorted(segments.path, every),
            np.concatenate([lines.vertices[:, :2], middles])[order],
            np.searchsorted(owner[order], every),
        )

    def held(self, inner: Ints, j: int) -> tuple[Ints, Ints]:
        """Which paths of `inner` have all their points within path j, and which have all on its
        line."""
        from camtool.kernels.offsets import HELD, ON_LINE, holds

        ring = self.segments[self.first_segment[j] : self.first_segment[j + 1]]
        curves = Curves.of(ring)
        arrays = (curves.rows, ring.bulge, curves.tree)
        said = holds(self.points, self.first_point, arrays, inner, POSITION_EPS_MM)
        return inner[said == HELD], inner[said == ON_LINE]


def _within(boxes: Floats, holders: Ints) -> Iterator[tuple[int, Ints]]:
    """Each of these paths in turn, and the paths whose boxes (M, 2, 2) do not reach out of its
    own: their centres lie in it."""
    low, high = boxes[:, :, 0], boxes[:, :, 1]
    centres = 0.5 * (low + high)
    index = BoxIndex(np.hstack([centres, centres]))
    wide = np.hstack([low - 2.0 * POSITION_EPS_MM, high + 2.0 * POSITION_EPS_MM])
    for begin in range(0, len(holders), HOLDERS_AT_A_TIME):
        some = holders[begin : begin + HOLDERS_AT_A_TIME]
        one, other = index.touching(wide[some])
        holder = some[one]
        inside = (low[other] >= low[holder] - POSITION_EPS_MM).all(axis=1)
        inside &= (high[other] <= high[holder] + POSITION_EPS_MM).all(axis=1)
        one, other = one[inside], other[inside]
        ends = np.searchsorted(one, np.arange(len(some) + 1)).tolist()
        for k, j in enumerate(some.tolist()):
            yield j, other[ends[k] : ends[k + 1]]


# Regions: outer paths CCW, their holes CW.


def oriented(lines: Polylines) -> Polylines:
    """The closed paths, in their order, so turned that what an odd number of them hold is left.

    Paths held by none, by two, and so on run CCW, the others CW. Open paths: GeometryError.
    """
    return _oriented(lines, _nesting(lines))


def regions(lines: Polylines) -> list[Polylines]:
    """Each outer path (CCW) with the holes (CW) that are directly in it; in the order of paths.

    An island in a hole is the outer path of a region of its own. Open paths: GeometryError.
    """
    nest = _nesting(lines)
    turned = _oriented(lines, nest)
    outer = np.flatnonzero(nest.depth % 2 == 0)
    return [
        turned.select([row, *np.flatnonzero((nest.parent == row) & (nest.depth % 2 == 1))])
        for row in outer.tolist()
    ]


def _nesting(lines: Polylines) -> Nesting:
    if not lines.closed.all():
        where = f"path {np.argmin(lines.closed)}"
        raise GeometryError("an open path has no inside", where=where, mend="close it")
    return nesting(lines)


def _oriented(lines: Polylines, nest: Nesting) -> Polylines:
    ccw = signed_areas(lines) > 0.0
    wanted = nest.depth % 2 == 0
    paths = zip(lines, (ccw == wanted).tolist(), strict=True)
    return Polylines.of([p if right else reverse(p) for p, right in paths])
