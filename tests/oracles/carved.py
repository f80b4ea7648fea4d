"""What a cone cuts at the surface, slowly: discs along a run, joined by shapely.

Between two near points of a run the disc's middle and radius change evenly, and what it sweeps is
the convex hull of the discs at both ends.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.geometry.polylines import Polylines
from camtool.planning.items import CutRun
from tests.oracles.offset import chords


def dense(run: CutRun, step_mm: float) -> Floats:
    """(J, 3) x, y, z along a run, arcs and helices as they are, no farther apart than the step."""
    rows = [run.vertices[0, :3].tolist()]
    for (ax, ay, az, bulge), (bx, by, bz, _) in zip(
        run.vertices[:-1].tolist(), run.vertices[1:].tolist(), strict=True
    ):
        chord = math.hypot(bx - ax, by - ay)
        count = max(1, math.ceil(math.hypot(chord, bz - az) * (1.0 + abs(bulge)) / step_mm))
        for part in np.arange(1, count + 1) / count:
            x, y = _on_arc((ax, ay), (bx, by), bulge, float(part))
            rows.append([x, y, az + part * (bz - az)])
    return np.array(rows)


def _on_arc(
    a: tuple[float, float], b: tuple[float, float], bulge: float, part: float
) -> tuple[float, float]:
    if bulge == 0.0:
        return a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])
    sweep = 4.0 * math.atan(bulge)
    k = (1.0 - bulge**2) / (4.0 * bulge)
    cx = 0.5 * (a[0] + b[0]) - k * (b[1] - a[1])
    cy = 0.5 * (a[1] + b[1]) + k * (b[0] - a[0])
    sine, cosine = math.sin(part * sweep), math.cos(part * sweep)
    x, y = a[0] - cx, a[1] - cy
    return cx + cosine * x - sine * y, cy + sine * x + cosine * y


def swept(runs: Iterable[CutRun], slope: float, tip_mm: float, step_mm: float) -> shapely.Geometry:
    """Return the area that a cone (tangent of half its angle, radius of its tip) cuts at z = 0."""
    parts = []
    for run in runs:
        points = dense(run, step_mm)
        radius = np.where(points[:, 2] <= 0.0, tip_mm - points[:, 2] * slope, 0.0)
        discs = shapely.buffer(
            shapely.points(points[:, :2]), np.maximum(radius, 1e-9), quad_segs=32
        )
        if len(discs) == 1:
            parts.append(discs[0])
            continue
        pairs = np.column_stack([discs[:-1], discs[1:]])
        parts.extend(shapely.convex_hull(shapely.geometrycollections(pair)) for pair in pairs)
    return shapely.union_all(parts)


def area_of(lines: Polylines, chord_mm: float) -> shapely.Geometry:
    """The even-odd filling of closed paths, arcs as fine chords."""
    filled = shapely.Polygon()
    for path in lines:
        filled = filled.symmetric_difference(shapely.Polygon(chords(path, chord_mm)))
    return filled
