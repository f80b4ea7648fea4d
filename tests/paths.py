"""What only tests do with a path: move, mirror, scale and offset it alone."""

from __future__ import annotations

import numpy as np

from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, reverse


def moved(p: Polyline, dx: float, dy: float) -> Polyline:
    """The path moved by (dx, dy) mm."""
    return Polyline(p.vertices + np.array([dx, dy, 0.0]), p.closed)


def mirrored(p: Polyline) -> Polyline:
    """The path mirrored about the Y axis: x and every bulge change their sign."""
    x, y, bulge = p.vertices.T
    return Polyline(np.column_stack([0.0 - x, y, 0.0 - bulge]), p.closed)


def scaled(p: Polyline, factor: float) -> Polyline:
    """The path scaled about (0, 0) by a factor above 0."""
    return Polyline(p.vertices * np.array([factor, factor, 1.0]), p.closed)


def there_and_back(p: Polyline) -> Polyline:
    """An open path and its way back as one closed path: its left is both sides of the path."""
    return Polyline(np.concatenate([p.vertices[:-1], reverse(p).vertices[:-1]]), closed=True)


def offset(
    p: Polyline, distance_mm: float, *, joins: str = "round", mitre_limit: float = 2.0
) -> list[Polyline]:
    """`offset_shape` of one closed path alone."""
    found = offset_shape(Polylines.of([p]), distance_mm, joins=joins, mitre_limit=mitre_limit)
    return list(found)
