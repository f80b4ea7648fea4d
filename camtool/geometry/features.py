"""The smallest features of a drawing: radius, segment, contour, and the wall between contours.

The least distance between two closed contours that do not cross is met at a vertex of one of
them, or within an arc. A tree of boxes finds the first (kernels/closest.py); then pairs with an
arc whose boxes are as near as that, and pairs whose boxes touch, are measured exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.boxes import touching_boxes
from camtool.geometry.distance import paired_distances
from camtool.geometry.measure import path_extents, point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Polylines, Segments

MOST_WALL_PAIRS = 200_000
"""No more pairs of segments than this are measured for the narrowest wall."""

_PAIRS_AT_A_TIME = 1 << 14


@dataclass(frozen=True)
class Feature:
    """A size in mm, its place (x, y) mm, and the path, or the two paths, that it belongs to."""

    size_mm: float
    at_mm: tuple[float, float]
    paths: tuple[int, ...]


def smallest_radius(segments: Segments) -> Feature | None:
    """The arc of the least radius and its middle; None without arcs."""
    if not segments.is_arc.any():
        return None
    return _of_row(segments, int(np.argmin(segments.radius)), segments.radius)


def shortest_segment(segments: Segments) -> Feature | None:
    """The shortest line or arc and its middle; None without any."""
    if not len(segments):
        return None
    lengths = segment_lengths(segments)
    return _of_row(segments, int(np.argmin(lengths)), lengths)


def _of_row(segments: Segments, row: int, sizes: Floats) -> Feature:
    x, y = point_at(segments, np.array([row]), np.array([0.5]))[0].tolist()
    return Feature(float(sizes[row]), (x, y), (int(segments.path[row]),))


def smallest_contour(lines: Polylines) -> Feature | None:
    """The closed path whose box has the shortest shorter side, and the middle of that box."""
    closed = np.flatnonzero(lines.closed)
    if not len(closed):
        return None
    boxes = path_extents(lines)[closed]
    sides = (boxes[:, :, 1] - boxes[:, :, 0]).min(axis=1)
    row = int(np.argmin(sides))
    x, y = boxes[row].mean(axis=1).tolist()
    return Feature(float(sides[row]), (x, y), (int(closed[row]),))


def narrowest_wall(lines: Polylines) -> Feature | None:
    """The least distance between two closed paths, 0 where they cross; None with fewer than two.

    Where more than MOST_WALL_PAIRS segments lie as near, it is an upper bound.
    """
    segments = _closed_segments(lines)
    if segments is None:
        return None
    from camtool.kernels.closest import closest

    boxes = segment_boxes(segments)
    # The tree wants paths numbered in the order in which they stand here.
    number = np.cumsum(np.diff(segments.path, prepend=segments.path[:1]) != 0)
    best, row, other = closest(
        np.ascontiguousarray(segments.start), np.ascontiguousarray(segments.end),
        segments.bulge, boxes, number,
    )  # fmt: skip
    x, y = segments.start[row].tolist()
    pair = sorted((int(segments.path[row]), int(segments.path[other])))
    found = Feature(float(best), (x, y), tuple(pair))
    near = touching_boxes(
        _grown(boxes, POSITION_EPS_MM), np.zeros_like(number), number, np.ones(len(number), bool),
        most=MOST_WALL_PAIRS,
    )  # fmt: skip
    arcs = touching_boxes(
        _grown(boxes, 0.5 * best), np.zeros_like(number), number, segments.is_arc,
        most=MOST_WALL_PAIRS,
    )  # fmt: skip
    for one, two in (near, arcs):
        found = _nearer(segments, one, two, found)
    return found


def _closed_segments(lines: Polylines) -> Segments | None:
    """The segments of closed paths, near paths near each other in the list; None below two."""
    closed = np.flatnonzero(lines.closed)
    if len(closed) < 2:
        return None
    middle = path_extents(lines)[closed].mean(axis=2)
    span = np.maximum(np.ptp(middle, axis=0), POSITION_EPS_MM)
    cells = ((middle - middle.min(axis=0)) / span * ((1 << _MORTON_BITS) - 1)).astype(np.int64)
    order = closed[np.argsort(_spread(cells[:, 0]) | _spread(cells[:, 1]) << 1, kind="stable")]
    segments = Segments.of(lines.select(order))
    return Segments(**{**vars(segments), "path": order[segments.path]})


_MORTON_BITS = 16


def _spread(numbers: Ints) -> Ints:
    """The bits of each number with a gap before each (Morton order keeps near cells near)."""
    spread = np.zeros_like(numbers)
    for bit in range(_MORTON_BITS):
        spread |= (numbers >> bit & 1) << 2 * bit
    return spread


def _grown(boxes: Floats, margin: float) -> Floats:
    return boxes + margin * np.array([-1.0, -1.0, 1.0, 1.0])


def _nearer(segments: Segments, one: Ints, other: Ints, found: Feature) -> Feature:
    """The least distance of these pairs, if it is below the one found before."""
    for begin in range(0, len(one), _PAIRS_AT_A_TIME):
        a, b = one[begin : begin + _PAIRS_AT_A_TIME], other[begin : begin + _PAIRS_AT_A_TIME]
        distance, points = paired_distances(segments[a], segments[b])
        row = int(np.argmin(distance))
        if distance[row] < found.size_mm:
            x, y = points[row].tolist()
            pair = sorted((int(segments.path[a[row]]), int(segments.path[b[row]])))
            found = Feature(float(distance[row]), (x, y), tuple(pair))
    return found
