"""What a drawing holds, counted: for `camtool check` and for reports."""

from __future__ import annotations

from typing import Any

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.drawing import Drawing
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
    """Counts of paths (by layer), lines and arcs; whole length and smallest radius in mm."""
    paths = drawing.paths
    segments = Segments.of(paths)
    closed = paths.closed
    layers: dict[str, dict[str, int]] = {}
    for name, is_closed in zip(drawing.layers, closed.tolist(), strict=True):
        row = layers.setdefault(name, {"closed": 0, "open": 0})
        row["closed" if is_closed else "open"] += 1
    arcs = segments.is_arc
    return {
        "closed": int(np.count_nonzero(closed)),
        "open": int(np.count_nonzero(~closed)),
        "length_mm": float(path_lengths(paths).sum()),
        "lines": int(np.count_nonzero(~arcs)),
        "arcs": int(np.count_nonzero(arcs)),
        "smallest_radius_mm": float(segments.radius[arcs].min()) if arcs.any() else None,
        "layers": dict(sorted(layers.items())),
    }
