"""Polylines reversed, moved, turned, mirrored, scaled, and begun elsewhere: always new ones."""

from __future__ import annotations

import math

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.polylines import Polyline, Polylines


def reverse(p: Polyline) -> Polyline:
    """The same path travelled the other way; a closed one still begins at its first vertex."""
    count = len(p.vertices)
    order = np.arange(count)[::-1]
    if p.closed:
        order = np.roll(order, 1)
    vertices = p.vertices[order]
    # The segment that left vertex i now leaves vertex i + 1 and bends the other way.
    vertices[:, 2] = 0.0 - p.vertices[(order - 1) % count, 2]
    return Polyline(vertices, p.closed)


def lines_reversed(lines: Polylines) -> Polylines:
    """Every path travelled the other way, as `reverse` does."""
    counts = np.diff(lines.offsets)
    low, count = np.repeat(lines.offsets[:-1], counts), np.repeat(counts, counts)
    place = np.arange(len(low)) - low
    order = np.where(np.repeat(lines.closed, counts), count - place, count - 1 - place) % count
    vertices = lines.vertices[low + order]
    vertices[:, 2] = 0.0 - lines.vertices[low + (order - 1) % count, 2]
    return Polylines._trusted(vertices, lines.offsets, lines.closed)


def moved(p: Polyline, dx: float, dy: float) -> Polyline:
    """The path moved by (dx, dy) mm."""
    return Polyline(p.vertices + np.array([dx, dy, 0.0]), p.closed)


def rotated(p: Polyline, angle_rad: float) -> Polyline:
    """The path turned about (0, 0), CCW positive."""
    cosine, sine = math.cos(angle_rad), math.sin(angle_rad)
    x, y, bulge = p.vertices.T
    turned = np.column_stack([cosine * x - sine * y, sine * x + cosine * y, bulge])
    return Polyline(turned, p.closed)


def mirrored(p: Polyline) -> Polyline:
    """The path mirrored about the Y axis: x and every bulge change their sign."""
    x, y, bulge = p.vertices.T
    return Polyline(np.column_stack([0.0 - x, y, 0.0 - bulge]), p.closed)


def scaled(p: Polyline, factor: float) -> Polyline:
    """The path scaled about (0, 0) by a factor above 0; GeometryError for any other factor."""
    if not (math.isfinite(factor) and factor > 0.0):
        raise GeometryError(f"a scale of {factor} is not above 0", mend="mirror with mirrored()")
    return Polyline(p.vertices * np.array([factor, factor, 1.0]), p.closed)


def rolled(p: Polyline, start_index: int) -> Polyline:
    """A closed path begun at another of its vertices; GeometryError for an open one."""
    if not p.closed:
        raise GeometryError("an open path can only begin at an end")
    return Polyline(np.roll(p.vertices, -start_index, axis=0), True)
