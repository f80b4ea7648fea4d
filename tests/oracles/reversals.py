"""Turns of an axis, and divisions of a path, counted the slow and obvious way."""

from __future__ import annotations

from itertools import combinations, pairwise

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.polylines import Polyline

CHORDS = 2048
"""So many points stand for each arc."""


def dense(path: Polyline) -> Floats:
    """(n, 2) points along a path, each arc by many, a closed one back to its start."""
    vertices = path.vertices
    if path.closed:
        vertices = np.concatenate([vertices, vertices[:1]])
    points = [vertices[:1, :2]]
    for (x, y, bulge), (end_x, end_y, _) in pairwise(vertices.tolist()):
        start, end = complex(x, y), complex(end_x, end_y)
        if bulge == 0.0:
            points.append(np.array([[end_x, end_y]]))
            continue
        sweep = 4.0 * np.arctan(bulge)
        centre = start + (end - start) / (1.0 - np.exp(1j * sweep))
        way = centre + (start - centre) * np.exp(1j * sweep * np.arange(1, CHORDS + 1) / CHORDS)
        way[-1] = end
        points.append(np.column_stack([way.real, way.imag]))
    return np.concatenate(points)


def turns(values: Floats, least_mm: float) -> int:
    """Count the reversals by `least_mm` or more along one axis, point by point."""
    found = 0
    direction = 0
    lowest = highest = values[0]  # since the last turn
    for value in values:
        lowest, highest = min(lowest, value), max(highest, value)
        if direction != -1 and highest - value >= least_mm:
            found += direction == 1
            direction, lowest, highest = -1, value, value
        elif direction != 1 and value - lowest >= least_mm:
            found += direction == -1
            direction, lowest, highest = 1, value, value
    return found


def fewest_runs(path: Polyline) -> int:
    """Into how few runs without any reversal a closed path of lines can be divided at its
    vertices: all choices of vertices are tried, fewest first."""
    points = path.vertices[:, :2]
    count = len(points)
    if _one_way(np.concatenate([points, points[:1]])):
        return 1
    for pieces in range(2, count + 1):
        for chosen in combinations(range(count), pieces):
            ends = [*chosen, chosen[0] + count]
            if all(_one_way(points[np.arange(a, b + 1) % count]) for a, b in pairwise(ends)):
                return pieces
    raise AssertionError("lines never turn back")


def _one_way(points: Floats) -> bool:
    step = np.diff(points, axis=0)
    return not ((step > 0.0).any(axis=0) & (step < 0.0).any(axis=0)).any()
