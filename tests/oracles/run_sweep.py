"""What a tool covers that runs along the vertices of a plan, seen from above: discs, united by
shapely; arcs taken to pieces from their bulges."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.planning.items import CutRun


def dense(run: CutRun, per_move: int = 48) -> Floats:
    """(N, 3) places on the run, arcs taken to pieces by their bulges."""
    found = []
    for (x, y, z, bulge), (u, v, w, _) in zip(run.vertices, run.vertices[1:], strict=False):
        part = np.linspace(0.0, 1.0, per_move)
        start, end = np.array([x, y]), np.array([u, v])
        if bulge == 0.0:
            points = start + part[:, None] * (end - start)
        else:
            # The centre lies h beside the chord, h = c (1 − b²) / 4 b.
            chord = end - start
            left = np.array([-chord[1], chord[0]])
            centre = 0.5 * (start + end) + left * (1.0 - bulge**2) / (4.0 * bulge)
            arm, turn = start - centre, 4.0 * math.atan(bulge) * part
            points = centre + np.column_stack(
                [
                    arm[0] * np.cos(turn) - arm[1] * np.sin(turn),
                    arm[0] * np.sin(turn) + arm[1] * np.cos(turn),
                ]
            )
        found.append(np.column_stack([points, z + part * (w - z)]))
    return np.concatenate(found)


def swept(runs: Iterable[CutRun], radius: float, below: float = math.inf) -> shapely.Geometry:
    """Return the area that the tool covers on runs of at least this depth, seen from above."""
    found = []
    for run in runs:
        places = dense(run)
        deep = places[:, 2] <= -below if below < math.inf else np.ones(len(places), dtype=bool)
        for piece in np.split(places, np.flatnonzero(np.diff(deep)) + 1):
            if below < math.inf and piece[0, 2] > -below:
                continue
            line = piece[:, :2] if len(piece) > 1 else np.repeat(piece[:, :2], 2, axis=0)
            found.append(shapely.LineString(line).buffer(radius, quad_segs=32))
    return shapely.union_all(found)
