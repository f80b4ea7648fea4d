"""Splines (G5, G5.1, G5.2 and G5.3): the arcs that LinuxCNC makes of them.

A spline is a NURBS with a clamped uniform knot vector; G5 and G5.1 are one of order 4 and 3 with
as many control points. LinuxCNC divides it into four pieces for each control point, by its
parameter, and puts two arcs with its tangents on each (NURBS_FEED and biarc, emccanon.cc)."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats

from ..gcode.faults import LineFault

PIECES: Final = 4
"""Pieces for each control point."""

NEAR: Final = 1e-5
"""The tangent is the chord between two points so far on both sides, in the parameter (DU)."""

STRAIGHT: Final = 1e-6
"""A piece whose turn is flatter is a line (`arc` of emccanon.cc)."""

MAX_CONTROL_POINTS: Final = 1000
"""Of one spline; each point is computed from all of them."""

Flat = tuple[float, float]


class SplinePiece(Struct, frozen=True):
    """A piece of the path: its end, and the centre and the direction of an arc (None: a line)."""

    end: Flat
    centre: Flat | None = None
    ccw: bool = False


def pieces_of(points: Sequence[tuple[float, float, float]], order: int) -> Iterator[SplinePiece]:
    """Yield the lines and arcs of a spline with control points (x, y, weight)."""
    if len(points) > MAX_CONTROL_POINTS:
        raise LineFault(f"a spline of more than {MAX_CONTROL_POINTS} control points")
    count = PIECES * len(points)
    knot_span = len(points) - 1 - order + 2
    parameters = knot_span * np.arange(count + 1) / count
    table = np.array(points, dtype=np.float64)
    places = _places(table, order, parameters)
    low, high = np.maximum(parameters - NEAR, 0.0), np.minimum(parameters + NEAR, knot_span)
    directions = _places(table, order, high) - _places(table, order, low)
    directions /= np.maximum(np.hypot(directions[:, 0], directions[:, 1]), 1e-300)[:, None]
    for k in range(count):
        yield from _two_arcs(
            (float(places[k, 0]), float(places[k, 1])),
            (float(directions[k, 0]), float(directions[k, 1])),
            (float(places[k + 1, 0]), float(places[k + 1, 1])),
            (float(directions[k + 1, 0]), float(directions[k + 1, 1])),
        )


def _places(points: Floats, order: int, parameters: Floats) -> Floats:
    """Return (N, 2) the points of the spline at these parameters (N,), by the Cox–de Boor
    recursion."""
    last = len(points) - 1
    knots = np.clip(np.arange(last + order + 1) - order + 1, 0, last - order + 2).astype(float)
    basis = np.zeros((len(parameters), last + order))
    # A parameter belongs to the last span that it begins, the end of the curve to the last of all.
    span = np.clip(np.searchsorted(knots, parameters, side="right") - 1, order - 1, last)
    basis[np.arange(len(parameters)), span] = 1.0
    for degree in range(1, order):
        for i in range(last + order - degree):
            low_weight, right = knots[i + degree] - knots[i], knots[i + degree + 1] - knots[i + 1]
            grown = np.zeros(len(parameters))
            if low_weight > 0.0:
                grown += (parameters - knots[i]) / low_weight * basis[:, i]
            if right > 0.0:
                grown += (knots[i + degree + 1] - parameters) / right * basis[:, i + 1]
            basis[:, i] = grown
    weighted = basis[:, : last + 1] * points[:, 2]
    return np.asarray(weighted @ points[:, :2] / weighted.sum(axis=1)[:, None])


def _two_arcs(
    start: Flat, start_direction: Flat, end: Flat, arriving: Flat
) -> Iterator[SplinePiece]:
    """Yield two tangent arcs from `start` to `end` that leave and arrive along these directions
    (unit vectors), and have a common tangent where they meet.

    The legs of both tangent polygons are of one length b, where the polygon's middle leg is 2b: |v
    + b (s + e)| = 2b for v from the end to the start, a quadratic equation for b."""
    vx, vy = start[0] - end[0], start[1] - end[1]
    c = vx * vx + vy * vy
    b = 2.0 * (vx * (start_direction[0] + arriving[0]) + vy * (start_direction[1] + arriving[1]))
    a = 2.0 * (start_direction[0] * arriving[0] + start_direction[1] * arriving[1] - 1.0)
    root = math.sqrt(max(b * b - 4.0 * a * c, 0.0))
    if b < 0.0:  # a is not above 0: one root is not below 0, and this is the steady way to it
        leg = 2.0 * c / (root - b)
    elif a < 0.0:
        leg = (-b - root) / 2.0 / a
    else:
        raise LineFault("a spline that turns back on itself")
    p1 = start[0] + leg * start_direction[0], start[1] + leg * start_direction[1]
    p3 = end[0] - leg * arriving[0], end[1] - leg * arriving[1]
    middle = (p1[0] + p3[0]) / 2.0, (p1[1] + p3[1]) / 2.0
    mx, my = p3[0] - middle[0], p3[1] - middle[1]
    length = math.hypot(mx, my) or 1.0
    yield _arc(start, middle, start_direction)
    yield _arc(middle, end, (mx / length, my / length))


def _arc(start: Flat, end: Flat, direction: Flat) -> SplinePiece:
    """Return the arc from `start` to `end` that leaves along a direction."""
    x, y = end[0] - start[0], end[1] - start[1]
    across = 2.0 * (y * direction[0] - x * direction[1])
    if abs(across) <= STRAIGHT:
        return SplinePiece(end)
    radius = -(x * x + y * y) / across
    return SplinePiece(
        end, (start[0] + direction[1] * radius, start[1] - direction[0] * radius), radius < 0.0
    )
