"""The connected parts of a region whose paths are oriented already, and their middles."""

from __future__ import annotations

import numpy as np

from camtool.geometry.measure import point_at, sample, signed_areas
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Polylines, Segments

POLE_SHARE = 0.01
"""How near to the true middle of a region its middle is looked for, over its extent."""


def parts_of(lines: Polylines) -> list[Polylines]:
    """Each outer path (CCW) with the holes (CW) in it: the smallest outer one around each."""
    if len(lines) == 0:
        return []
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


def pole(region: Polylines) -> Floats:
    """(2,) a place of a connected region about as far from its boundary as any."""
    import shapely

    outer = int(signed_areas(region).argmax())
    low, high = (
        region[outer].vertices[:, :2].min(axis=0),
        region[outer].vertices[:, :2].max(axis=0),
    )
    fine = max(POLE_SHARE * float(np.hypot(*(high - low))), POSITION_EPS_MM)
    rings = [sample(path, fine) for path in region]
    holes = [ring for row, ring in enumerate(rings) if row != outer and len(ring) > 2]
    circle = shapely.maximum_inscribed_circle(shapely.Polygon(rings[outer], holes), fine)
    return np.asarray(shapely.get_coordinates(circle)[0], dtype=np.float64)
