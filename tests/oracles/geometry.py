"""Slow obvious oracles of camtool.geometry: paths as very many points.

Points of an arc come from its centre and angles, by trigonometry alone.
"""

from __future__ import annotations

import math

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.geometry.polylines import Polyline


def dense_points(path: Polyline, per_segment: int) -> Floats:
    """(J, 2) points at equal angles or distances on each segment, both its ends among them."""
    points: list[tuple[float, float]] = []
    vertices = path.vertices.tolist()
    count = len(vertices) if path.closed else len(vertices) - 1
    for i in range(count):
        x0, y0, bulge = vertices[i]
        x1, y1, _ = vertices[(i + 1) % len(vertices)]
        points.append((x0, y0))
        for j in range(1, per_segment):
            points.append(_on_segment((x0, y0), (x1, y1), bulge, j / per_segment))
        points.append((x1, y1))
    return np.array(points)


def _on_segment(
    start: tuple[float, float], end: tuple[float, float], bulge: float, t: float
) -> tuple[float, float]:
    (x0, y0), (x1, y1) = start, end
    if bulge == 0.0:
        return x0 + t * (x1 - x0), y0 + t * (y1 - y0)
    # Height of the centre over the chord, to the left of travel.
    sweep = 4.0 * math.atan(bulge)
    chord = math.hypot(x1 - x0, y1 - y0)
    height = 0.5 * chord / math.tan(0.5 * sweep)
    cx = 0.5 * (x0 + x1) - height * (y1 - y0) / chord
    cy = 0.5 * (y0 + y1) + height * (x1 - x0) / chord
    angle = math.atan2(y0 - cy, x0 - cx) + t * sweep
    radius = math.hypot(x0 - cx, y0 - cy)
    return cx + radius * math.cos(angle), cy + radius * math.sin(angle)


def polygon(path: Polyline, per_segment: int) -> shapely.Polygon:
    """A closed path as a polygon of very short chords."""
    return shapely.Polygon(dense_points(path, per_segment))


def chord_length(path: Polyline, per_segment: int) -> float:
    """Sum of very short chords."""
    points = dense_points(path, per_segment)
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


def line_string(path: Polyline, per_segment: int) -> shapely.LineString:
    """A path as very short chords."""
    return shapely.LineString(dense_points(path, per_segment))


def sagitta(path: Polyline, per_segment: int) -> float:
    """Upper bound of the distance between the true path and its short chords.

    n chords of an arc lie within radius · sweep² / (8n²); over a given chord c that is largest
    for half a circle: c/2 · π² / (8n²).
    """
    points = path.vertices[:, :2]
    chord = np.hypot(*(np.roll(points, -1, axis=0) - points).T).max()
    return float(chord * math.pi**2 / (16.0 * per_segment**2))
