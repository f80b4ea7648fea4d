"""Counts and sizes of the contents of a drawing, for `camtool check` and for reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.errors import GeometryError
from camtool.geometry.boxes import touching_boxes
from camtool.geometry.distance import paired_distances
from camtool.geometry.drawing import Drawing, Gap
from camtool.geometry.measure import (
    extents,
    path_extents,
    path_lengths,
    point_at,
    segment_boxes,
    segment_lengths,
)
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments
from camtool.kernels.fits import closest
from camtool.records import replace


def drawing_extents(drawing: Drawing) -> Floats:
    """Return (2, 2) [[xmin, xmax], [ymin, ymax]] of paths and marks, mm; GeometryError without
    any."""
    boxes = [extents(drawing.paths)] if len(drawing.paths) else []
    if drawing.marks:
        points = np.array([mark.at_mm for mark in drawing.marks])
        boxes.append(np.column_stack([points.min(axis=0), points.max(axis=0)]))
    if not boxes:
        raise GeometryError("nothing is drawn, so there are no extents")
    stacked = np.stack(boxes)
    return np.column_stack([stacked[:, :, 0].min(axis=0), stacked[:, :, 1].max(axis=0)])


def facts_of(drawing: Drawing) -> dict[str, Any]:
    """Return the object that `camtool check --json` prints for a drawing, keys in its order;
    lengths in mm."""
    (left_x, right), (bottom, top) = drawing_extents(drawing).tolist()
    return {
        "file": drawing.file,
        "units": {
            "name": drawing.units.name,
            "mm_per_unit": drawing.units.mm_per_unit,
            "why": drawing.units.why,
        },
        "size_mm": [right - left_x, top - bottom],
        "extents_mm": {"x": [left_x, right], "y": [bottom, top]},
        **drawing_facts(drawing),
        "fit_um": {"max": drawing.fit.max_mm * 1000.0, "rms": drawing.fit.rms_mm * 1000.0},
        "entities_used": drawing.used,
        "entities_not_used": [
            {"kind": item.kind, "count": item.count, "reason": item.reason}
            for item in drawing.skipped
        ],
        "findings": [
            {
                "code": finding.code.name,
                "severity": finding.severity.name.lower(),
                "message": finding.message,
                "where": finding.where,
            }
            for finding in drawing.findings
        ],
    }


def drawing_facts(drawing: Drawing) -> dict[str, Any]:
    """Return the counts and sizes of a drawing, ready for JSON; lengths in mm, places as [x, y].

    `closed`, `open`, `marks`, `lines`, `arcs`: how many. `length_mm`: of all paths. `layers`: by
    name closed, open and marks; `colours` and `line_types`: paths by name ("" is none).
    `smallest_radius_mm` and `smallest`: see `_smallest`. `open_ends`: place, path and layer of
    each; `gaps` stay open, `closed_gaps` were bridged: place, size, layer. `duplicates` and
    `overlaps`: count and length of what was left out; `tiny_merged`, `arcs_recognised`: counts;
    `branches`: place, ends, layer; `crossings`: place, path, layer."""
    segments = Segments.of(drawing.paths)
    arcs, closed = segments.is_arc, drawing.paths.closed
    return {
        "closed": int(np.count_nonzero(closed)),
        "open": int(np.count_nonzero(~closed)),
        "marks": len(drawing.marks),
        "length_mm": float(path_lengths(drawing.paths).sum()),
        "lines": int(np.count_nonzero(~arcs)),
        "arcs": int(np.count_nonzero(arcs)),
        "smallest_radius_mm": float(segments.radius[arcs].min()) if arcs.any() else None,
        "smallest": _smallest(drawing, segments),
        "layers": _layers(drawing),
        "colours": _times(drawing.colours),
        "line_types": _times(drawing.line_types),
        "open_ends": _open_ends(drawing),
        "gaps": _gaps(drawing.gaps),
        "closed_gaps": _gaps(drawing.closed_gaps),
        **_healing(drawing),
    }


def _smallest(drawing: Drawing, segments: Segments) -> dict[str, Any]:
    """Return the smallest features of a drawing: each as size_mm, at_mm and paths, or None.

    `radius`, `segment`, `contour` (shorter side of its box) and `distance` (between two closed
    contours)."""
    features = {
        "radius": smallest_radius(segments),
        "segment": shortest_segment(segments),
        "contour": smallest_contour(drawing.paths),
        "distance": narrowest_wall(drawing.paths),
    }
    return {
        name: None
        if item is None
        else {"size_mm": item.size_mm, "at_mm": list(item.at_mm), "paths": list(item.paths)}
        for name, item in features.items()
    }


def _layers(drawing: Drawing) -> dict[str, dict[str, int]]:
    """Return, for each layer by name, the numbers of its closed and open paths and of its
    marks."""
    rows: dict[str, Counter[str]] = {}
    for name, is_closed in zip(drawing.layers, drawing.paths.closed.tolist(), strict=True):
        rows.setdefault(name, Counter())["closed" if is_closed else "open"] += 1
    for mark in drawing.marks:
        rows.setdefault(mark.layer, Counter())["marks"] += 1
    kinds = ("closed", "open", "marks")
    return {name: {kind: row[kind] for kind in kinds} for name, row in sorted(rows.items())}


def _times(names: Iterable[str]) -> dict[str, int]:
    """Return how often each name occurs, sorted by name."""
    return dict(sorted(Counter(names).items()))


def _open_ends(drawing: Drawing) -> list[dict[str, Any]]:
    """Return both ends of each open path: place, path and layer."""
    paths = np.flatnonzero(~drawing.paths.closed)
    offsets, vertices = drawing.paths.offsets, drawing.paths.vertices
    rows = np.column_stack([offsets[paths], offsets[paths + 1] - 1]).ravel()
    return [
        {"at_mm": place, "path": path, "layer": drawing.layers[path]}
        for place, path in zip(
            vertices[rows, :2].tolist(), np.repeat(paths, 2).tolist(), strict=True
        )
    ]


def _gaps(gaps: Iterable[Gap]) -> list[dict[str, Any]]:
    return [{"at_mm": list(g.at_mm), "size_mm": g.size_mm, "layer": g.layer} for g in gaps]


def _healing(drawing: Drawing) -> dict[str, Any]:
    """Return counts of the repairs, and the places where the drawing branches or crosses
    itself."""
    healed = drawing.healing
    return {
        "duplicates": {"count": healed.duplicates, "length_mm": healed.duplicates_mm},
        "overlaps": {"count": healed.overlaps, "length_mm": healed.overlaps_mm},
        "tiny_merged": healed.tiny_merged,
        "arcs_recognised": healed.arcs_recognised,
        "branches": [
            {"at_mm": list(branch.at_mm), "ends": branch.ends, "layer": branch.layer}
            for branch in healed.branches
        ],
        "crossings": [
            {"at_mm": list(item.at_mm), "path": item.path, "layer": item.layer}
            for item in healed.crossings
        ],
    }


# The smallest features of a drawing: radius, segment, contour, and the wall between contours.
#
# The least distance between two closed contours that do not cross is met at a vertex of one of
# them, or within an arc. A tree of boxes finds the first (kernels/fits.pyx); then pairs with an
# arc whose boxes are as near as that, and pairs whose boxes touch, are measured exactly.

MAX_WALL_PAIRS = 200_000

_PAIRS_AT_A_TIME = 1 << 14


class Feature(Struct, frozen=True):
    """A size in mm, its place (x, y) mm, and the path, or the two paths, that it belongs to."""

    size_mm: float
    at_mm: tuple[float, float]
    paths: tuple[int, ...]


def smallest_radius(segments: Segments) -> Feature | None:
    """Return the smallest radius of all arcs, placed in the middle of its arc; None without
    arcs."""
    if not segments.is_arc.any():
        return None
    return _of_row(segments, int(np.argmin(segments.radius)), segments.radius)


def shortest_segment(segments: Segments) -> Feature | None:
    """Return the shortest length of all lines and arcs, placed in the middle of its segment; None
    without any."""
    if not len(segments):
        return None
    lengths = segment_lengths(segments)
    return _of_row(segments, int(np.argmin(lengths)), lengths)


def _of_row(segments: Segments, row: int, sizes: Floats) -> Feature:
    x, y = point_at(segments, np.array([row]), np.array([0.5]))[0].tolist()
    return Feature(float(sizes[row]), (x, y), (int(segments.path[row]),))


def smallest_contour(lines: Polylines) -> Feature | None:
    """Return the shortest side of the boxes of closed paths, placed in the middle of its box; None
    without any."""
    closed = np.flatnonzero(lines.closed)
    if not len(closed):
        return None
    boxes = path_extents(lines)[closed]
    sides = (boxes[:, :, 1] - boxes[:, :, 0]).min(axis=1)
    row = int(np.argmin(sides))
    x, y = boxes[row].mean(axis=1).tolist()
    return Feature(float(sides[row]), (x, y), (int(closed[row]),))


def narrowest_wall(lines: Polylines) -> Feature | None:
    """Return the least distance between two closed paths, 0 where they cross; None with fewer than
    two.

    It is an upper bound only if more than MAX_WALL_PAIRS pairs of segments are candidates for it.
    """
    segments = _closed_segments(lines)
    if segments is None:
        return None

    boxes = segment_boxes(segments)
    # The compiled tree needs paths numbered in the order in which they occur here.
    number = np.cumsum(np.diff(segments.path, prepend=segments.path[:1]) != 0)
    best, row, other = closest(
        np.ascontiguousarray(segments.start), np.ascontiguousarray(segments.end),
        segments.bulge, boxes, number,
    )  # fmt: skip
    x, y = segments.start[row].tolist()
    pair = sorted((int(segments.path[row]), int(segments.path[other])))
    nearest = Feature(float(best), (x, y), tuple(pair))
    neighbour_pairs = touching_boxes(
        _grown(boxes, POSITION_EPS_MM), np.zeros_like(number), number, np.ones(len(number), bool),
        max_pairs=MAX_WALL_PAIRS,
    )  # fmt: skip
    arcs = touching_boxes(
        _grown(boxes, 0.5 * best), np.zeros_like(number), number, segments.is_arc,
        max_pairs=MAX_WALL_PAIRS,
    )  # fmt: skip
    for one, second in (neighbour_pairs, arcs):
        nearest = _nearer(segments, one, second, nearest)
    return nearest


def _closed_segments(lines: Polylines) -> Segments | None:
    """Return the segments of closed paths, ordered so that near paths are near each other in the
    list; None for fewer than two paths."""
    closed = np.flatnonzero(lines.closed)
    if len(closed) < 2:
        return None
    middle = path_extents(lines)[closed].mean(axis=2)
    span = np.maximum(np.ptp(middle, axis=0), POSITION_EPS_MM)
    cells = ((middle - middle.min(axis=0)) / span * ((1 << _MORTON_BITS) - 1)).astype(np.int64)
    order = closed[np.argsort(_spread(cells[:, 0]) | _spread(cells[:, 1]) << 1, kind="stable")]
    segments = Segments.of(lines.select(order))
    return replace(segments, path=order[segments.path])


_MORTON_BITS = 16


def _spread(numbers: Ints) -> Ints:
    """Return the bits of each number spread to every second place, for Morton order, which keeps
    near cells near each other."""
    spread = np.zeros_like(numbers)
    for bit_index in range(_MORTON_BITS):
        spread |= (numbers >> bit_index & 1) << 2 * bit_index
    return spread


def _grown(boxes: Floats, margin: float) -> Floats:
    return boxes + margin * np.array([-1.0, -1.0, 1.0, 1.0])


def _nearer(segments: Segments, one: Ints, other: Ints, nearest: Feature) -> Feature:
    """Return the least distance of these pairs of segments if it is below that of `nearest`, else
    `nearest`."""
    for begin in range(0, len(one), _PAIRS_AT_A_TIME):
        a, b = one[begin : begin + _PAIRS_AT_A_TIME], other[begin : begin + _PAIRS_AT_A_TIME]
        distance, points = paired_distances(segments[a], segments[b])
        row = int(np.argmin(distance))
        if distance[row] < nearest.size_mm:
            x, y = points[row].tolist()
            pair = sorted((int(segments.path[a[row]]), int(segments.path[b[row]])))
            nearest = Feature(float(distance[row]), (x, y), tuple(pair))
    return nearest
