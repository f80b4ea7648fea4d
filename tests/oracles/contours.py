"""Shapes that offsets are tried on: named ones by hand, and random ones from a generator."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.geometry.intersect import self_crossings
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Segments
from tests.oracles.offset import chords, pieces

QUARTER = math.tan(math.pi / 8.0)
"""Bulge of a quarter circle."""


def closed(*rows: tuple[float, float] | tuple[float, float, float]) -> Polyline:
    """A closed path of (x, y) or (x, y, bulge)."""
    return Polyline(np.array([(*row, 0.0)[:3] for row in rows]), closed=True)


def opened(*rows: tuple[float, float] | tuple[float, float, float]) -> Polyline:
    """An open path of (x, y) or (x, y, bulge)."""
    return Polyline(np.array([(*row, 0.0)[:3] for row in rows]))


CIRCLE = closed((-10, 0, 1), (10, 0, 1))
SLOT = closed((0, 0), (20, 0, 1), (20, 10), (0, 10, 1))
SQUARE = closed((0, 0), (10, 0), (10, 10), (0, 10))
OBLONG = closed((0, 0), (20, 0), (20, 10), (0, 10))
FILLETED = closed(
    (2, 0), (18, 0, QUARTER), (20, 2), (20, 8, QUARTER), (18, 10), (2, 10, QUARTER),
    (0, 8), (0, 2, QUARTER),
)  # fmt: skip
ELL = closed((0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10))
DUMBBELL = closed(
    (0, 0), (10, 0), (10, 4), (20, 4), (20, 0), (30, 0), (30, 10), (20, 10), (20, 6),
    (10, 6), (10, 10), (0, 10),
)  # fmt: skip
C_SHAPE = closed((0, 0), (12, 0), (12, 5), (4, 5), (4, 7), (12, 7), (12, 12), (0, 12))
KEYHOLE = closed((-1, 0), (-1, -8), (1, -8), (1, 0, QUARTER), (0, 6, 0.9))
LENS = closed((0, 0, 0.4), (10, 0, 0.4))
CRESCENT = closed((0, 0, 1), (10, 0, -0.8))
SPIKE = closed((0, 0), (10, 0), (10, 5), (15, 5), (10, 5.0001), (10, 10), (0, 10))
NOTCH = closed((0, 0), (3, 0, -1), (4, 0), (10, 0), (10, 10), (0, 10))


def star(points: int, inner: float, outer: float) -> Polyline:
    """A star of straight sides."""
    angle = np.arange(2 * points) * np.pi / points
    radius = np.where(np.arange(2 * points) % 2, inner, outer)
    return Polyline(_polar(radius, angle, np.zeros(2 * points)), closed=True)


def gear(teeth: int, root: float, tip: float) -> Polyline:
    """Straight flanks, tips and roots as arcs about (0, 0)."""
    pitch = 2.0 * math.pi / teeth
    angle = pitch * (np.repeat(np.arange(teeth), 4) + np.tile([0.0, 0.2, 0.5, 0.7], teeth))
    radius = np.tile([root, tip, tip, root], teeth)
    bulge = np.tile([0.0, math.tan(0.3 * pitch / 4), 0.0, math.tan(0.3 * pitch / 4)], teeth)
    return Polyline(_polar(radius, angle, bulge), closed=True)


def comb(teeth: int) -> Polyline:
    """A bar with teeth 1 mm wide, 1 mm apart and 6 mm long: every gap closes at one distance."""
    rows: list[tuple[float, float]] = [(0, 0), (2 * teeth - 1, 0)]
    for i in reversed(range(teeth)):
        rows += [(2 * i + 1, 8), (2 * i, 8)]
        if i:
            rows += [(2 * i, 2), (2 * i - 1, 2)]
    return closed(*rows)


def spiral(turns: int) -> Polyline:
    """A band 2 mm wide wound up with gaps of 2 mm, of half circles."""
    outer = [(x, 0.0, 1.0) for x in _half_turns(turns, 6.0)]
    inner = [(x, 0.0, -1.0) for x in reversed(_half_turns(turns, 4.0))]
    return closed(*outer[:-1], (*outer[-1][:2], 0.0), *inner[:-1], (*inner[-1][:2], 0.0))


def _half_turns(turns: int, first: float) -> list[float]:
    return [(first + 2.0 * i) * (-1.0) ** i for i in range(2 * turns)]


def _polar(radius: Floats, angle: Floats, bulge: Floats) -> Floats:
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), bulge])


def is_simple(p: Polyline) -> bool:
    """True when a closed path does not cross itself, told by fine chords and by the true arcs.

    Chords miss arcs that cross close beside a corner that turns nearly straight back.
    """
    points = chords(p, 0.05)
    if len(points) < 3 or not shapely.LinearRing(points).is_simple:
        return False
    if len(self_crossings(Segments.of(p))):
        return False
    return all(
        math.dist(a, b) > 10.0 * POSITION_EPS_MM and (arc is None or abs(arc.sweep) > 1e-9)
        for a, b, arc in pieces(p)
    )


def random_star(rng: np.random.Generator) -> tuple[Polyline, float] | None:
    """A star-shaped contour with arcs, and its size; None when it is not simple."""
    count = int(rng.integers(2, 24))
    size = 10.0 ** rng.uniform(-1.0, 2.0)
    angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, count))
    radius = size * rng.uniform(0.25, 1.0, count)
    bulge = rng.uniform(-1.0, 1.0, count) * rng.choice([0.0, 0.05, 0.3, 1.0])
    bulge[rng.random(count) < rng.choice([0.0, 0.5])] = 0.0
    return _usable(_polar(radius, angle, bulge), size)


def random_cells(rng: np.random.Generator) -> tuple[Polyline, float] | None:
    """Squares of 1 mm joined, some sides as arcs, with many coincidences; None if crossing."""
    shape = rng.integers(2, 6, 2)
    chosen = np.argwhere(rng.random(shape) < 0.65).tolist() or [[0, 0]]
    united = shapely.union_all([shapely.box(i, j, i + 1, j + 1) for i, j in chosen])
    part = max(shapely.get_parts(united), key=lambda each: each.area).simplify(0.0)
    ring = shapely.segmentize(part.exterior, rng.choice([1.0, 100.0]))
    points = shapely.get_coordinates(ring)[:-1]
    points = points if ring.is_ccw else points[::-1]
    bulge = rng.choice([0, 0, 0, 1, -1, QUARTER, -QUARTER], len(points)) * (rng.random() < 0.7)
    return _usable(np.column_stack([points, bulge]), 2.0)


def random_gear(rng: np.random.Generator) -> tuple[Polyline, float] | None:
    """A gear with arcs for some flanks; None when it is not simple."""
    size = 10.0 ** rng.uniform(-1.0, 2.0)
    vertices = gear(int(rng.integers(3, 40)), rng.uniform(0.5, 0.95), 1.0).vertices.copy()
    vertices[::2, 2] = rng.choice([0.0, 0.1, -0.1])
    vertices[:, :2] *= size
    return _usable(vertices, size)


RANDOM: dict[str, Callable[[np.random.Generator], tuple[Polyline, float] | None]] = {
    "star": random_star,
    "cells": random_cells,
    "gear": random_gear,
}


def _usable(vertices: Floats, size: float) -> tuple[Polyline, float] | None:
    try:
        p = Polyline(vertices, closed=True)
    except ValueError:
        return None
    return (p, size) if is_simple(p) else None
