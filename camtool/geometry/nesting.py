"""Nesting of closed paths, exact with arcs; and regions: outer paths with their holes.

A point is inside a closed path when it is inside the polygon of its chords, or when it lies
between a chord and its arc, but not both (XOR, arc by arc). A point exactly on a chord is taken
as slightly above and to the right of it, in both tests alike, so that no point counts twice."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.errors import GeometryError
from camtool.geometry.boxes import BoxIndex, IndexedCurves
from camtool.geometry.measure import path_extents, point_at, signed_areas
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments, reverse_lines
from camtool.kernels.offsets import HELD, ON_LINE, holds, insides

HOLDERS_AT_A_TIME = 256
"""Number of closed paths whose boxes are compared with all others in one batch: it bounds the
memory."""


class Levels(Struct, frozen=True, eq=False):
    """Positions of M paths in the nesting: `parent` (M,), the smallest holder of each, −1 if none;
    and `depth` (M,), the number of its holders."""

    parent: Ints
    depth: Ints


class Nesting(Struct, frozen=True, eq=False, dict=True):
    """The nesting of M paths, the `lines`, found when it is first asked for and then kept.

    A closed path j holds path i when the vertices of i and the middles of its segments lie inside
    j, or nearer to its line than `POSITION_EPS_MM` (but not all of them: a path does not hold its
    double, and doubles count as one). Paths that cross a closed path are not in it. `part_of`: the
    nesting that has these paths in the rows `rows`, ascending, so that nothing is found twice."""

    lines: Polylines
    part_of: Nesting | None = None
    rows: Ints | None = None

    @cached_property
    def levels(self) -> Levels:
        """The levels if every closed path counts as a holder."""
        return self.levels_by(self.lines.closed)

    def levels_by(self, holders: Bools) -> Levels:
        """Return the levels if only the closed paths of the mask `holders` (M,) count as
        holders."""
        count = len(self.lines)
        pairs = self._pairs
        counts = holders[pairs.holder]
        is_double = np.zeros(count, dtype=np.bool_)
        doubles = counts & pairs.is_double
        for j, i in np.column_stack([pairs.holder[doubles], pairs.inner[doubles]]).tolist():
            is_double[i] |= not is_double[j]
        counts &= ~pairs.is_double & ~is_double[pairs.holder]
        holder, inner = pairs.holder[counts], pairs.inner[counts]
        parent = np.full(count, -1, dtype=np.int64)
        parent[inner] = holder  # the last holder of a path is its smallest one
        return Levels(parent, np.bincount(inner, minlength=count))

    def among(self, rows: Ints) -> Nesting:
        """Return the nesting of the paths in these rows alone, ascending."""
        return Nesting(self.lines.select(rows), self, rows)

    @cached_property
    def _pairs(self) -> _Pairs:
        if self.part_of is None or self.rows is None:
            return _Pairs.of(self.lines)
        return self.part_of._pairs.among(self.rows, len(self.part_of.lines))


class _Pairs(Struct, frozen=True, eq=False):
    """Closed paths, the `holder` (P,), with the paths `inner` (P,) that each holds, or that lie on
    its line as a whole: `is_double` (P,). From the largest holder to the smallest."""

    holder: Indices
    inner: Indices
    is_double: Bools

    @classmethod
    def of(cls, lines: Polylines) -> _Pairs:
        """Return the pairs of these paths: every closed path is compared with the paths within its
        box that are no larger."""
        no_rows = np.empty(0, dtype=np.int32)
        holder, inner, is_double = [no_rows], [no_rows], [np.empty(0, dtype=np.bool_)]
        areas = np.abs(signed_areas(lines))
        closed = np.flatnonzero(lines.closed)
        closed = closed[np.argsort(-areas[closed], kind="stable")]
        rank = np.full(len(lines), len(closed))
        rank[closed] = np.arange(len(closed))
        places: _Places | None = None
        for j, candidates in _within_boxes(path_extents(lines), closed) if len(closed) else ():
            smaller = candidates[rank[candidates] > rank[j]]
            if len(smaller) == 0:
                continue
            # Made only when needed: most drawings of very many paths have none within another.
            places = places or _Places.of(lines)
            for contained, on_line in zip(
                places.contained_paths(smaller, j), (False, True), strict=True
            ):
                holder.append(np.full(len(contained), j, dtype=np.int32))
                inner.append(contained.astype(np.int32))
                is_double.append(np.full(len(contained), on_line))
        return cls(np.concatenate(holder), np.concatenate(inner), np.concatenate(is_double))

    def among(self, rows: Ints, count: int) -> _Pairs:
        """Return the pairs whose two paths are both among these rows of `count` paths,
        renumbered."""
        row_of = np.full(count, -1, dtype=np.int32)
        row_of[rows] = np.arange(len(rows), dtype=np.int32)
        holder, inner = row_of[self.holder], row_of[self.inner]
        keep = (holder >= 0) & (inner >= 0)
        return _Pairs(holder[keep], inner[keep], self.is_double[keep])


def inside(points: Floats, ring: Segments) -> Bools:
    """Return the mask (P,) of the points (P, 2) inside a closed path; a point on its line may
    count as either."""
    curves = IndexedCurves.of(ring)
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

    def contained_paths(self, inner: Ints, j: int) -> tuple[Ints, Ints]:
        """Return those of the paths `inner` whose points all lie inside path j, and those whose
        points all lie on its line."""
        ring = self.segments[self.first_segment[j] : self.first_segment[j + 1]]
        curves = IndexedCurves.of(ring)
        arrays = (curves.rows, ring.bulge, curves.tree)
        relations = holds(self.points, self.first_point, arrays, inner, POSITION_EPS_MM)
        return inner[relations == HELD], inner[relations == ON_LINE]


def _within_boxes(boxes: Floats, holders: Ints) -> Iterator[tuple[int, Ints]]:
    """Yield each path of `holders` with the paths whose boxes (M, 2, 2) lie within its own."""
    low, high = boxes[:, :, 0], boxes[:, :, 1]
    centres = 0.5 * (low + high)
    index = BoxIndex(np.hstack([centres, centres]))
    wide = np.hstack([low - 2.0 * POSITION_EPS_MM, high + 2.0 * POSITION_EPS_MM])
    for begin in range(0, len(holders), HOLDERS_AT_A_TIME):
        batch = holders[begin : begin + HOLDERS_AT_A_TIME]
        one, other = index.touching(wide[batch])
        holder = batch[one]
        inside = (low[other] >= low[holder] - POSITION_EPS_MM).all(axis=1)
        inside &= (high[other] <= high[holder] + POSITION_EPS_MM).all(axis=1)
        one, other = one[inside], other[inside]
        ends = np.searchsorted(one, np.arange(len(batch) + 1)).tolist()
        for k, j in enumerate(batch.tolist()):
            yield j, other[ends[k] : ends[k + 1]]


# Regions: outer paths CCW, their holes CW.


def oriented(nest: Nesting) -> Polylines:
    """Return the closed paths, in their order, turned so that the region is on their left.

    Paths held by none, by two, and so on run CCW, the others CW. GeometryError for an open path.
    """
    lines = nest.lines
    if not lines.closed.all():
        place = f"path {np.argmin(lines.closed)}"
        raise GeometryError("an open path has no inside", where=place, mend="close it")
    is_ccw = signed_areas(lines) > 0.0
    return reverse_lines(lines, is_ccw != (nest.levels.depth % 2 == 0))


def regions(nest: Nesting) -> list[tuple[int, Polylines]]:
    """Return each region: the row of its outer path, and that path (CCW) with the holes (CW)
    directly in it.

    An island in a hole is the outer path of a region of its own. GeometryError for an open path.
    """
    oriented_paths, levels = oriented(nest), nest.levels
    is_hole = levels.depth % 2 == 1
    return [
        (row, oriented_paths.select([row, *np.flatnonzero((levels.parent == row) & is_hole)]))
        for row in np.flatnonzero(~is_hole).tolist()
    ]
