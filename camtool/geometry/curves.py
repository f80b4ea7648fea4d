"""Smooth curves, as something that gives points and tangents for many parameters at once.

`fit` asks no more of a curve than the protocol `Curve`; the classes here are the ones that
drawings hold. Those that are rational Bézier curves, piece by piece, are `Pieced`: they are
fitted by compiled kernels, many times faster."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import Protocol

import numpy as np
from msgspec import Struct
from msgspec.structs import force_setattr

from camtool.arrays import Floats, distinct
from camtool.errors import GeometryError

MAX_PIECE_RAD = 0.5 * math.pi
"""A piece of an ellipse covers at most this: beyond, its weights spread its points unevenly."""

JUMP_SHARE = 1e-9
"""A spline whose pieces lie apart by more than this share of its size has a gap and is refused."""


class Curve(Protocol):
    """A plane curve over a parameter, mm.

    `tangent` is the derivative: it need not be unit and may vanish. `breaks` (k,) rises from the
    first parameter to the last; in between stand all places where the curve may have a corner,
    and knots (between two breaks the curve is smooth, save for cusps)."""

    @property
    def breaks(self) -> Floats:
        """Parameters (k,), k ≥ 2, of the ends and of possible corners."""
        ...

    def point(self, t: Floats) -> Floats:
        """Return positions (n, 2) mm at parameters (n,)."""
        ...

    def tangent(self, t: Floats) -> Floats:
        """Return derivatives (n, 2) at parameters (n,)."""
        ...


class Pieces(Struct, frozen=True, eq=False):
    """Rational Bézier pieces end to end: `control` (m, p + 1, 3) of x·w, y·w, w about the
    `origin` (2,) mm, and the exact `ends` (2, 2) mm of the whole curve."""

    control: Floats
    origin: Floats
    ends: Floats


class FunctionCurve(Struct, frozen=True, eq=False):
    """A curve given by two functions (n,) -> (n, 2) and its breaks (k,)."""

    at: Callable[[Floats], Floats]
    derivative: Callable[[Floats], Floats]
    breaks: Floats

    def point(self, t: Floats) -> Floats:
        """Return positions (n, 2) mm at parameters (n,)."""
        return self.at(t)

    def tangent(self, t: Floats) -> Floats:
        """Return derivatives (n, 2) at parameters (n,)."""
        return self.derivative(t)


class BezierCurve(Struct, frozen=True, eq=False):
    """A Bézier of `control` (4, 2) or (3, 2) mm over 0..1. GeometryError for other shapes."""

    control: Floats

    def __post_init__(self) -> None:
        control = np.array(self.control, dtype=np.float64)
        if control.shape not in ((3, 2), (4, 2)):
            raise GeometryError(f"a Bézier has shape {control.shape}, wanted (3, 2) or (4, 2)")
        force_setattr(self, "control", control)

    @property
    def breaks(self) -> Floats:
        """Parameters (2,): 0 and 1."""
        return np.array([0.0, 1.0])

    def point(self, t: Floats) -> Floats:
        """Return positions (n, 2) mm at parameters (n,)."""
        return _bernstein(self.control, t)

    def tangent(self, t: Floats) -> Floats:
        """Return derivatives (n, 2) at parameters (n,)."""
        return (len(self.control) - 1.0) * _bernstein(np.diff(self.control, axis=0), t)

    def pieces(self) -> Pieces:
        """Return the curve as its single piece."""
        rows = np.ones((1, len(self.control), 3))
        rows[0, :, :2] = self.control - self.control[0]
        return Pieces(rows, self.control[0], self.control[[0, -1]])


class EllipseCurve(Struct, frozen=True, eq=False):
    """centre + cos(t)·major + sin(t)·minor, t from `start` to `end` rad (end below start: CW).

    `major` and `minor` (2,) mm may be any two conjugate half axes: they need not be square to
    each other, so an affine map of an ellipse maps its three vectors."""

    centre: Floats
    major: Floats
    minor: Floats
    start: float = 0.0
    end: float = 2.0 * np.pi

    @property
    def breaks(self) -> Floats:
        """Parameters (2,): 0 and the size of the sweep."""
        return np.array([0.0, abs(self.end - self.start)])

    def point(self, t: Floats) -> Floats:
        """Return positions (n, 2) mm at parameters (n,)."""
        angle = self._angle(t)[:, None]
        return np.asarray(
            np.asarray(self.centre)
            + np.cos(angle) * np.asarray(self.major)
            + np.sin(angle) * np.asarray(self.minor)
        )

    def tangent(self, t: Floats) -> Floats:
        """Return derivatives (n, 2) at parameters (n,)."""
        angle = self._angle(t)[:, None]
        along = np.cos(angle) * np.asarray(self.minor) - np.sin(angle) * np.asarray(self.major)
        return np.asarray(np.copysign(1.0, self.end - self.start) * along)

    def pieces(self) -> Pieces:
        """Return the arc as pieces of at most a quarter: over a half angle h a rational parabola
        of weights 1, cos h, 1.

        Its middle control point is the intersection of the end tangents, (cos m, sin m) / cos h.
        """
        count = max(1, math.ceil(abs(self.end - self.start) / MAX_PIECE_RAD))
        angle = self.start + (self.end - self.start) * np.arange(2 * count + 1) / (2.0 * count)
        along = np.cos(angle)[:, None] * np.asarray(self.major)
        rows = np.ones((2 * count + 1, 3))
        rows[:, :2] = along + np.sin(angle)[:, None] * np.asarray(self.minor)
        rows[1::2, 2] = math.cos(0.5 * (self.end - self.start) / count)
        control = np.stack([rows[0:-1:2], rows[1::2], rows[2::2]], axis=1)
        origin = np.array(self.centre, dtype=np.float64)
        return Pieces(control, origin, origin + rows[[0, -1], :2])

    def _angle(self, t: Floats) -> Floats:
        return np.asarray(self.start + np.copysign(1.0, self.end - self.start) * t)


class SplineCurve(Struct, frozen=True, eq=False):
    """A B-spline, rational when weights differ: `knots` (n + degree + 1,), `control` (n, 2) mm,
    `weights` (n,) all positive. GeometryError when these do not belong together."""

    degree: int
    knots: Floats
    control: Floats
    weights: Floats | None = None

    def __post_init__(self) -> None:
        knots = np.array(self.knots, dtype=np.float64)
        control = np.array(self.control, dtype=np.float64)
        count = len(control)
        weights = np.ones(count) if self.weights is None else np.array(self.weights, dtype=float)
        if self.degree < 1 or count <= self.degree:
            raise GeometryError(f"{count} control points are too few for degree {self.degree}")
        if len(knots) != count + self.degree + 1 or len(weights) != count:
            raise GeometryError(
                f"{len(knots)} knots and {len(weights)} weights for {count} control points"
            )
        if (np.diff(knots) < 0.0).any() or knots[self.degree] >= knots[count]:
            raise GeometryError("the knots do not rise")
        if not (weights > 0.0).all():
            raise GeometryError("a weight is not positive")
        for name, column in (("knots", knots), ("control", control), ("weights", weights)):
            force_setattr(self, name, column)
        inner = knots[1:-1]
        repeated = inner[self.degree :] == inner[: len(inner) - self.degree]
        if repeated.any() and self._jumps():
            raise GeometryError("a knot is repeated so often that the curve has a gap")

    def _jumps(self) -> bool:
        pieces = self.pieces().control
        points = pieces[:, :, :2] / pieces[:, :, 2:]
        gaps = np.abs(points[1:, 0] - points[:-1, -1]).max(initial=0.0)
        return bool(gaps > JUMP_SHARE * np.ptp(self.control, axis=0).max())

    @property
    def breaks(self) -> Floats:
        """Distinct knots (k,) of the domain."""
        return distinct(self.knots[self.degree : len(self.control) + 1])

    def point(self, t: Floats) -> Floats:
        """Return positions (n, 2) mm at parameters (n,)."""
        value = self._homogeneous(t, 0)
        return np.asarray(value[:, :2] / value[:, 2:])

    def tangent(self, t: Floats) -> Floats:
        """Return derivatives (n, 2) at parameters (n,): (A'w − A w')/w² of the homogeneous curve
        (A, w)."""
        value, slope = self._homogeneous(t, 0), self._homogeneous(t, 1)
        weight = value[:, 2:]
        return np.asarray((slope[:, :2] * weight - value[:, :2] * slope[:, 2:]) / weight**2)

    def pieces(self) -> Pieces:
        """Return each span a..b between knots as a Bézier piece: its control points are the
        blossom at (a … a, b … b).

        De Boor's triangle with an argument of its own at each level computes the blossom."""
        degree, knots, origin = self.degree, self.knots, self.control[0]
        weights = np.asarray(self.weights)[:, None]
        points = np.concatenate([(self.control - origin) * weights, weights], axis=1)
        inner = knots[degree : len(points) + 1]
        cell = degree + np.flatnonzero(np.diff(inner) > 0.0)
        ends = knots[cell], knots[cell + 1]
        control = np.empty((len(cell), degree + 1, 3))
        for column in range(degree + 1):
            rows = [points[cell - degree + j] for j in range(degree + 1)]
            for level in range(1, degree + 1):
                t = ends[1 if level <= column else 0]
                for j in range(degree, level - 1, -1):
                    low_knot, right = knots[cell - degree + j], knots[cell + 1 + j - level]
                    share = ((t - low_knot) / (right - low_knot))[:, None]
                    rows[j] = (1.0 - share) * rows[j - 1] + share * rows[j]
            control[:, column] = rows[degree]
        tips = control[[0, -1], [0, -1]]
        return Pieces(control, origin, origin + tips[:, :2] / tips[:, 2:])

    def _homogeneous(self, t: Floats, order: int) -> Floats:
        """Return (n, 3) x·w, y·w, w at t (n,), or their derivatives for `order` 1, by de Boor's
        algorithm for all t at once.

        The derivative of a spline is a spline of degree p−1 over the inner knots, with control
        points p (c[i+1] − c[i]) / (u[i+p+1] − u[i+1])."""
        degree, knots, weights = self.degree, self.knots, np.asarray(self.weights)
        points = np.column_stack([self.control * weights[:, None], weights])
        for _ in range(order):
            width = knots[degree + 1 : len(points) + degree] - knots[1 : len(points)]
            factor = np.divide(degree, width, out=np.zeros_like(width), where=width > 0.0)
            points = np.diff(points, axis=0) * factor[:, None]
            knots, degree = knots[1:-1], degree - 1
        cell = np.searchsorted(knots, t, side="right") - 1
        cell = np.clip(cell, degree, len(points) - 1)
        # An end with repeated inner knots: step back to the last cell that has a width.
        last = int(np.searchsorted(knots, knots[len(points)], side="left")) - 1
        cell = np.minimum(cell, max(last, degree))
        rows = [points[cell - degree + j] for j in range(degree + 1)]
        for level in range(1, degree + 1):
            for j in range(degree, level - 1, -1):
                low_knot = knots[cell - degree + j]
                right = knots[cell + 1 + j - level]
                share = ((t - low_knot) / (right - low_knot))[:, None]
                rows[j] = (1.0 - share) * rows[j - 1] + share * rows[j]
        return np.asarray(rows[degree])


Pieced = BezierCurve | EllipseCurve | SplineCurve


def _bernstein(control: Floats, t: Floats) -> Floats:
    """Evaluate a Bézier curve at t (n,) by de Casteljau's algorithm for all t at once."""
    rows = [np.broadcast_to(point, (len(t), 2)) for point in control]
    share = t[:, None]
    while len(rows) > 1:
        rows = [(1.0 - share) * a + share * b for a, b in pairwise(rows)]
    return np.asarray(rows[0])
