"""The connected parts of a region whose paths are oriented already."""

from __future__ import annotations

import numpy as np

from camtool.geometry.measure import point_at, signed_areas
from camtool.geometry.nest import inside
from camtool.geometry.polylines import Polylines, Segments


def parts_of(lines: Polylines) -> list[Polylines]:
    """Each outer path (CCW) with the holes (CW) in it: the smallest outer one around each."""
    areas = signed_areas(lines)
    outer, holes = np.flatnonzero(areas > 0.0), np.flatnonzero(areas <= 0.0)
    if len(outer) == 1:
        return [lines]
    order = outer[np.argsort(areas[outer], kind="stable")]
    owner = np.full(len(lines), -1, dtype=np.int64)
    for hole in holes.tolist():
        ring = Segments.of(lines[hole])
        rows = np.arange(len(ring))
        middles = point_at(ring, rows, np.full(len(rows), 0.5))
        for row in order.tolist():
            # Most of them, as a hole may touch its outer path.
            if 2 * np.count_nonzero(inside(middles, Segments.of(lines[row]))) > len(middles):
                owner[hole] = row
                break
    return [lines.select([row, *np.flatnonzero(owner == row).tolist()]) for row in outer.tolist()]
