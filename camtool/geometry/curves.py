"""Smooth curves, as something that gives points and tangents for many parameters at once.

`fit` asks no more of a curve than the protocol `Curve`; the classes here are the ones that
drawings hold.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Protocol

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.polylines import Floats


class Curve(Protocol):
    """A plane curve over a parameter, mm.

    `tangent` is the derivative: it need not be unit and may vanish. `breaks` (k,) rises from the
    first parameter to the last; in between stand all places where the curve may have a corner,
    and knots (between two breaks the curve is smooth, save for cusps).
    """

    @property
    def breaks(self) -> Floats:
        """(k,) parameters, k ≥ 2."""
        ...

    def point(self, t: Floats) -> Floats:
        """Positions (n, 2) mm at parameters (n,)."""
        ...

    def tangent(self, t: Floats) -> Floats:
        """Derivatives (n, 2) at parameters (n,)."""
        ...


@dataclass(frozen=True, eq=False)
class FunctionCurve:
    """A curve given by two functions (n,) -> (n, 2) and its breaks (k,)."""

    at: Callable[[Floats], Floats]
    derivative: Callable[[Floats], Floats]
    breaks: Floats

    def point(self, t: Floats) -> Floats:
        """Positions (n, 2) mm."""
        return self.at(t)

    def tangent(self, t: Floats) -> Floats:
        """Derivatives (n, 2)."""
        return self.derivative(t)


@dataclass(frozen=True, eq=False)
class BezierCurve:
    """A Bézier of `control` (4, 2) or (3, 2) mm over 0..1. GeometryError for other shapes."""

    control: Floats

    def __post_init__(self) -> None:
        control = np.array(self.control, dtype=np.float64)
        if control.shape not in ((3, 2), (4, 2)):
            raise GeometryError(f"a Bézier has shape {control.shape}, wanted (3, 2) or (4, 2)")
        object.__setattr__(self, "control", control)

    @property
    def breaks(self) -> Floats:
        """(2,): 0 and 1."""
        return np.array([0.0, 1.0])

    def point(self, t: Floats) -> Floats:
        """Positions (n, 2) mm."""
        return _bernstein(self.control, t)

    def tangent(self, t: Floats) -> Floats:
        """Derivatives (n, 2)."""
        return (len(self.control) - 1.0) * _bernstein(np.diff(self.control, axis=0), t)


@dataclass(frozen=True, eq=False)
class EllipseCurve:
    """centre + cos(t)·major + sin(t)·minor, t from `start` to `end` rad (end below start: CW).

    `major` and `minor` (2,) mm may be any two conjugate half axes: they need not be square to
    each other, so an affine map of an ellipse maps its three vectors.
    """

    centre: Floats
    major: Floats
    minor: Floats
    start: float = 0.0
    end: float = 2.0 * np.pi

    @property
    def breaks(self) -> Floats:
        """(2,): 0 and the size of the sweep."""
        return np.array([0.0, abs(self.end - self.start)])

    def point(self, t: Floats) -> Floats:
        """Positions (n, 2) mm."""
        angle = self._angle(t)[:, None]
        return np.asarray(
            np.asarray(self.centre)
            + np.cos(angle) * np.asarray(self.major)
            + np.sin(angle) * np.asarray(self.minor)
        )

    def tangent(self, t: Floats) -> Floats:
        """Derivatives (n, 2)."""
        angle = self._angle(t)[:, None]
        along = np.cos(angle) * np.asarray(self.minor) - np.sin(angle) * np.asarray(self.major)
        return np.asarray(np.copysign(1.0, self.end - self.start) * along)

    def _angle(self, t: Floats) -> Floats:
        return np.asarray(self.start + np.copysign(1.0, self.end - self.start) * t)


@dataclass(frozen=True, eq=False)
class SplineCurve:
    """A B-spline, rational when weights differ: `knots` (n + degree + 1,), `control` (n, 2) mm,
    `weights` (n,) all positive. GeometryError when these do not belong together.
    """

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
            object.__setattr__(self, name, column)

    @property
    def breaks(self) -> Floats:
        """(k,) the distinct knots of the domain."""
        return np.unique(self.knots[self.degree : len(self.control) + 1])

    def point(self, t: Floats) -> Floats:
        """Positions (n, 2) mm."""
        value = self._homogeneous(t, 0)
        return np.asarray(value[:, :2] / value[:, 2:])

    def tangent(self, t: Floats) -> Floats:
        """Derivatives (n, 2): (A'w − A w')/w² of the homogeneous curve (A, w)."""
        value, slope = self._homogeneous(t, 0), self._homogeneous(t, 1)
        weight = value[:, 2:]
        return np.asarray((slope[:, :2] * weight - value[:, :2] * slope[:, 2:]) / weight**2)

    def _homogeneous(self, t: Floats, order: int) -> Floats:
        """de Boor's triangle for all t at once: (n, 3) of x·w, y·w, w or their derivatives.

        The derivative of a spline is a spline of degree p−1 over the inner knots, with control
        points p (c[i+1] − c[i]) / (u[i+p+1] − u[i+1]).
        """
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
                left = knots[cell - degree + j]
                right = knots[cell + 1 + j - level]
                share = ((t - left) / (right - left))[:, None]
                rows[j] = (1.0 - share) * rows[j - 1] + share * rows[j]
        return np.asarray(rows[degree])


def _bernstein(control: Floats, t: Floats) -> Floats:
    """de Casteljau for all t at once."""
    rows = [np.broadcast_to(point, (len(t), 2)) for point in control]
    share = t[:, None]
    while len(rows) > 1:
        rows = [(1.0 - share) * a + share * b for a, b in pairwise(rows)]
    return np.asarray(rows[0])
