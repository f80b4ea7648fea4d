"""What a drawing holds, counted: for `camtool check` and for reports."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.drawing import Drawing, Gap
from camtool.geometry.measure import extents, path_lengths
from camtool.geometry.polylines import Floats, Segments


def drawing_extents(drawing: Drawing) -> Floats:
    """(2, 2) [[xmin, xmax], [ymin, ymax]] of paths and marks, mm; GeometryError without any."""
    boxes = [extents(drawing.paths)] if len(drawing.paths) else []
    if drawing.marks:
        points = np.array([mark.at_mm for mark in drawing.marks])
        boxes.append(np.column_stack([points.min(axis=0), points.max(axis=0)]))
    if not boxes:
        raise GeometryError("nothing is drawn: nothing has no extents")
    both = np.stack(boxes)
    return np.column_stack([both[:, :, 0].min(axis=0), both[:, :, 1].max(axis=0)])


def drawing_facts(drawing: Drawing) -> dict[str, Any]:
    """All that can be counted, ready for JSON; lengths in mm, places as [x, y].

    `closed`, `open`, `marks`, `lines`, `arcs`: how many. `length_mm`: of all paths. `layers`: by
    name closed, open and marks; `colours` and `line_types`: paths by name ("" is none).
    `smallest_radius_mm` and `smallest`: see `_smallest`. `open_ends`: place, path and layer of
    each; `gaps` stay open, `closed_gaps` were bridged: place, size, layer. `duplicates` and
    `overlaps`: count and length of what was left out; `tiny_merged`, `arcs_recognised`: counts;
    `branches`: place, ends, layer; `crossings`: place, path, layer.
    """
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
    """`radius`, `segment`, `contour` (shorter side of its box) and `distance` (between two closed
    contours): each size_mm, at_mm and paths, or None."""
    from camtool.geometry.features import (
        narrowest_wall,
        shortest_segment,
        smallest_contour,
        smallest_radius,
    )

    found = {
        "radius": smallest_radius(segments),
        "segment": shortest_segment(segments),
        "contour": smallest_contour(drawing.paths),
        "distance": narrowest_wall(drawing.paths),
    }
    return {
        name: None
        if item is None
        else {
            "size_mm": item.size_mm,
            "at_mm": list(item.at_mm),
            "paths": list(item.paths),
        }
        for name, item in found.items()
    }


def _layers(drawing: Drawing) -> dict[str, dict[str, int]]:
    """For each layer its closed and open paths and its marks."""
    rows: dict[str, Counter[str]] = {}
    for name, is_closed in zip(drawing.layers, drawing.paths.closed.tolist(), strict=True):
        rows.setdefault(name, Counter())["closed" if is_closed else "open"] += 1
    for mark in drawing.marks:
        rows.setdefault(mark.layer, Counter())["marks"] += 1
    kinds = ("closed", "open", "marks")
    return {name: {kind: row[kind] for kind in kinds} for name, row in sorted(rows.items())}


def _times(names: Iterable[str]) -> dict[str, int]:
    """How many of each, sorted by name."""
    return dict(sorted(Counter(names).items()))


def _open_ends(drawing: Drawing) -> list[dict[str, Any]]:
    """Both ends of each open path."""
    paths = np.flatnonzero(~drawing.paths.closed)
    offsets, vertices = drawing.paths.offsets, drawing.paths.vertices
    rows = np.column_stack([offsets[paths], offsets[paths + 1] - 1]).ravel()
    return [
        {"at_mm": at, "path": path, "layer": drawing.layers[path]}
        for at, path in zip(vertices[rows, :2].tolist(), np.repeat(paths, 2).tolist(), strict=True)
    ]


def _gaps(gaps: Iterable[Gap]) -> list[dict[str, Any]]:
    return [{"at_mm": list(g.at_mm), "size_mm": g.size_mm, "layer": g.layer} for g in gaps]


def _healing(drawing: Drawing) -> dict[str, Any]:
    """What was mended, and where the drawing leaves a choice or crosses itself."""
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
