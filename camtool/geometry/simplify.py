"""Polylines with fewer segments: chords on one circle become an arc, specks are merged.

Drawings are often exploded into chords. A run of chords becomes an arc when

- it has at least `MIN_POINTS` points, each chord turns by at most `MAX_TURN_RAD` and all turn to
  the same side (so polygons of up to fifteen sides stay what they are);
- the chords are alike in length, save that the first and the last may be shorter (so an arc ends
  where a straight line begins, even when their joint is tangent);
- the points lie on the circle within the tolerance, and what they are off looks like noise: no
  more than the last decimal of the file, or rough along the run. Chords of a spline or an ellipse
  are off smoothly and stay chords.

The arc begins and ends exactly at points of the path. Every point that it replaces is measured
against it afterwards: none is off by more than the tolerance, or the chords stay."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.kernels.fits import MIN_POINTS, find_runs, furthest_off

NOISE_MM = 1e-7
"""Points of drawings without rounding lie on their circle within this."""

DECIMALS = range(1, 7)

GRID_SHARE = 1e-3
"""A number has so many decimals if it differs from the rounded one by at most this share of the
last decimal."""

ROUNDING = 0.75
"""Rounding moves a point by at most this share of the last decimal (½·√2, with a margin)."""


HALF_SLACK = 1e-3
"""An arc of more than a half circle by at most this share is first tried as a half circle."""


def recognise_arcs(path: Polyline, tolerance_mm: float) -> tuple[Polyline, int]:
    """Replace runs of chords on one circle by arcs; return the path, and the number of arcs found.

    Each point that an arc replaces lies within `tolerance_mm` of it; existing arcs and all other
    lines stay. An arc of more than a half circle counts once, though it is written as two; so
    does a whole circle."""
    if len(path.vertices) < MIN_POINTS:
        return path, 0
    noise = min(rounding_noise(path.vertices[:, :2]), tolerance_mm)
    vertices = path.vertices
    if path.closed:
        vertices = np.concatenate([vertices, vertices[:1]])
    rows, arcs = _replace_chords(vertices, noise, tolerance_mm)
    if path.closed and arcs and not _is_full_circle(rows):
        # Begin anew where an arc ends, so that no arc is cut by where the path began.
        first = arcs[0][1] % len(path.vertices)
        vertices = np.roll(path.vertices, -first, axis=0)
        rows, arcs = _replace_chords(np.concatenate([vertices, vertices[:1]]), noise, tolerance_mm)
    if not arcs:
        return path, 0
    return Polyline(rows[:-1] if path.closed else rows, path.closed), len(arcs)


def rounding_noise(points: Floats) -> float:
    """Estimate by how much rounding to decimals has moved the points, mm.

    It follows from the fewest decimals with which all of them can be written; `NOISE_MM` if none
    of `DECIMALS` suffice."""
    for decimals in DECIMALS:
        units = points * 10.0**decimals
        if np.abs(units - np.round(units)).max() <= GRID_SHARE:
            return max(NOISE_MM, ROUNDING * 10.0**-decimals)
    return NOISE_MM


def _replace_chords(
    vertices: Floats, noise: float, tolerance_mm: float
) -> tuple[Floats, list[tuple[int, int]]]:
    """Return the open path with runs of chords replaced by arcs, and for each arc the first and
    last vertex of its run before that."""
    keep = np.ones(len(vertices), dtype=np.bool_)
    arcs: list[tuple[int, int]] = []
    inserted: list[tuple[int, Floats]] = []
    rows = vertices.copy()
    for begin, end in _line_runs(vertices):
        if end - begin + 1 < MIN_POINTS:
            continue
        points = np.ascontiguousarray(vertices[begin : end + 1, :2])
        for run in find_runs(points, noise, tolerance_mm):
            low, high = begin + int(run[0]), begin + int(run[1])
            inner = points[int(run[0]) : int(run[1]) + 1]
            for arc in _arcs(vertices[low, :2], vertices[high, :2], run[2:]):
                if furthest_off(inner, arc) <= tolerance_mm:
                    break
            else:
                continue
            keep[low + 1 : high] = False
            rows[low] = arc[0]
            rows[high, :2] = arc[-1, :2]
            if len(arc) == 3:
                inserted.append((low + 1, arc[1]))
            arcs.append((low, high))
    if not arcs:
        return vertices, arcs
    place = np.cumsum(keep) - 1  # where a kept row is afterwards
    kept_rows = rows[keep]
    if inserted:
        places = [int(place[row - 1]) + 1 for row, _ in inserted]
        kept_rows = np.insert(kept_rows, places, np.array([row for _, row in inserted]), axis=0)
    return kept_rows, arcs


def _line_runs(vertices: Floats) -> list[tuple[int, int]]:
    """Return the first and last vertex of each longest run of successive lines."""
    straight: Bools = np.concatenate([[False], vertices[:-1, 2] == 0.0, [False]])
    edges = np.flatnonzero(np.diff(straight.astype(np.int8)))
    return [(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _arcs(start: Floats, end: Floats, circle: Floats) -> Iterator[Floats]:
    """Yield candidates for the arc about `circle` (centre, radius, sweep) from start to end, as
    vertices.

    Up to a half circle it has two rows, above it three, with a point in the middle; near a half
    circle both are tried."""
    centre, radius, sweep = circle[:2], float(circle[2]), float(circle[3])
    turn = math.copysign(1.0, sweep)
    if np.array_equal(start, end):
        side = (start - centre) / np.hypot(*(start - centre))
        far_point, across = centre + radius * side, centre - radius * side
        yield np.array([[*far_point, turn], [*across, turn], [*far_point, 0.0]])
        return
    if abs(sweep) <= math.pi * (1.0 + HALF_SLACK):
        bulge = math.tan(0.25 * sweep)
        yield np.array([[*start, bulge if abs(bulge) < 1.0 else turn], [*end, 0.0]])
    if abs(sweep) > math.pi:
        angle = math.atan2(start[1] - centre[1], start[0] - centre[0]) + 0.5 * sweep
        middle = centre + radius * np.array([math.cos(angle), math.sin(angle)])
        bulge = math.tan(0.125 * sweep)
        yield np.array([[*start, bulge], [*middle, bulge], [*end, 0.0]])


def _is_full_circle(rows: Floats) -> bool:
    """Return True if a closed path became one circle of two halves."""
    return len(rows) == 3 and bool((np.abs(rows[:2, 2]) == 1.0).all())


# Segments too short to matter merged into their neighbours.
#
# Along a path, vertices that lie within the limit of the first of them (measured along the path)
# are one *cluster* and become one vertex of it. Every point of the old path is then within the
# limit of the new one, and the other way round: a segment between two clusters has moved at its
# ends by no more. Arcs between clusters must not move, so a cluster takes the vertex at which an
# arc arrives or leaves; where arcs do both at different ones, all stays as it was.


class MergedPaths(Struct, frozen=True, eq=False):
    """The paths after merging, and the number of segments that were merged into others."""

    lines: Polylines
    count: int


def without_tiny(lines: Polylines, limit_mm: float) -> MergedPaths:
    """Return the paths with segments below `limit_mm` merged into their neighbours; no vertex
    moves by more than that.

    A path of which too little would remain stays as it is."""
    has_short = np.zeros(len(lines), dtype=np.bool_)
    for segments in Segments.batches(lines):
        has_short[segments.path[segment_lengths(segments) <= limit_mm]] = True
    if not has_short.any():
        return MergedPaths(lines, 0)
    paths, removed = list(lines), 0
    for index in np.flatnonzero(has_short).tolist():
        path = paths[index]
        keep, positions = _merge_vertices(path, segment_lengths(Segments.of(path)), limit_mm)
        shortened = _path_of(path, keep, positions)
        if shortened is not None:
            removed += len(path) - len(shortened)
            paths[index] = shortened
    return MergedPaths(Polylines.of(paths), removed)


def _merge_vertices(path: Polyline, lengths: Floats, limit: float) -> tuple[Ints, Ints]:
    """Return, for each vertex of the new path, the old vertex whose place it takes, and the one
    whose bulge it takes."""
    bulges = path.vertices[:, 2]
    count = len(bulges)
    place, bend = np.arange(count), np.arange(count)
    keep = np.ones(count, dtype=np.bool_)
    after = 0
    for i in np.flatnonzero(lengths[: count - 1] <= limit).tolist():
        if i < after:
            continue
        j, run = i, 0.0
        while j + 1 < count and run + float(lengths[j]) <= limit:
            run += float(lengths[j])
            j += 1
        arrives = bulges[i - 1] != 0.0 and (i > 0 or path.closed)
        leaves = bulges[j] != 0.0
        is_last = not path.closed and j == count - 1
        # The ends of open paths stay where they are, and so do the ends of arcs.
        stays = arrives and (leaves or is_last)
        if not (stays or (i == 0 and leaves and not path.closed)):
            keep[i + 1 : j + 1] = False
            place[i], bend[i] = j if leaves or is_last else i, j
        after = j + 1
    return place[keep], bend[keep]


def _path_of(path: Polyline, place: Ints, bend: Ints) -> Polyline | None:
    """Return the path with these places and bulges; None when it is no path, or nothing has
    changed."""
    if len(place) == len(path.vertices) or len(place) < 2:
        return None
    vertices = path.vertices[place]
    vertices[:, 2] = path.vertices[bend, 2]
    if path.closed and len(vertices) < 3 and not vertices[:, 2].any():
        return None
    vertices.flags.writeable = False  # read-only, so that it is not copied
    step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
    shortest = np.hypot(*(step if path.closed else step[:-1]).T).min()
    return Polyline(vertices, path.closed) if shortest > POSITION_EPS_MM else None
