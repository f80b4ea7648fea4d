"""Subpaths in user units to vertices in mm: lines and circles exact, other curves fitted.

An ellipse under an affine map is an ellipse. With its half axes u, v as complex numbers,

    u·cos t + v·sin t = p·e^{it} + q·e^{−it},   p = (u − iv)/2,   q = (u + iv)/2,

its longest and shortest half axes are |p| + |q| and ||p| − |q||; it is a circle when p or q is 0:
run through with t when q is, against it when p is.
"""

from __future__ import annotations

import cmath

import numpy as np

from camtool.errors import DrawingError, GeometryError
from camtool.geometry.fit import (
    BezierCurve,
    Curve,
    EllipseCurve,
    arc_vertices,
    fit_curve,
)
from camtool.geometry.polylines import POSITION_EPS_MM, Floats
from camtool.importers.piece import MAX_COORDINATE_MM
from camtool.importers.svg.affine import Affine
from camtool.importers.svg.segments import Arc, Bezier, Lines, Segment, Subpath

ROUND_EPS_MM = POSITION_EPS_MM
"""An ellipse whose half axes differ by less is a circle."""


MAX_CURVE_MM = 1e6
"""A curve that reaches further is left out: its fit to micrometres would take millions of arcs."""


Fitted = tuple[Floats, Floats | None]
"""Vertices (n, 3), and `off_mm` (n, 2) of a `Piece` made of them."""


class CurveFitter:
    """Maps subpaths into mm; fits curves within one tolerance."""

    def __init__(self, tolerance_mm: float) -> None:
        self.tolerance_mm = tolerance_mm

    def vertices(self, subpath: Subpath, to_mm: Affine) -> Fitted:
        """(n, 3) x, y, bulge in mm, the last one the end, and how far the curves lie from them;
        DrawingError when out of bounds."""
        first = subpath.segments[0]
        if len(subpath.segments) == 1 and isinstance(first, Lines):
            points = np.concatenate([subpath.start[None, :], first.points])
            return _in_reach(_straight(to_mm, points)), None
        rows, off = [_straight(to_mm, subpath.start[None, :])], [np.zeros((1, 2))]
        for segment in subpath.segments:
            piece, apart = self._segment(rows[-1][-1, :2], segment, to_mm)
            # The segment's first vertex is the last one so far; what leaves it goes there.
            rows[-1][-1, 2] = piece[0, 2]
            rows.append(piece[1:])
            if apart is None:
                off.append(np.zeros((len(piece) - 1, 2)))
            else:
                off[-1][-1] = apart[0]
                off.append(apart[1:].copy())
        return _in_reach(np.concatenate(rows)), np.concatenate(off)

    def _segment(self, here: Floats, segment: Segment, to_mm: Affine) -> Fitted:
        """(n, 3) from `here` (2,) mm to the segment's end, both exact."""
        if isinstance(segment, Lines):
            points = _straight(to_mm, segment.points)
            return np.concatenate([[[here[0], here[1], 0.0]], points]), None
        if isinstance(segment, Bezier):
            control = np.concatenate([here[None, :], to_mm.points(segment.control)])
            return self._fitted(BezierCurve(control), control)
        ends = np.array([here, to_mm.points(segment.end[None, :])[0]])
        centre = to_mm.points(segment.centre[None, :])[0]
        u, v = to_mm.vectors(np.array([segment.u, segment.v]))
        circle = _circle(centre, u, v, segment)
        if circle is not None:
            return _with_ends(circle, ends), None
        curve = EllipseCurve(centre, u, v, segment.begin, segment.begin + segment.sweep)
        bounds = np.array([centre, np.abs(u) + np.abs(v)])
        vertices, off = self._fitted(curve, bounds)
        return _with_ends(vertices, ends), off

    def _fitted(self, curve: Curve, bounds: Floats) -> Fitted:
        """Arcs for a curve whose size and place `bounds` (n, 2) tell."""
        _in_reach(bounds, MAX_CURVE_MM)
        try:
            fit = fit_curve(curve, self.tolerance_mm)
        except GeometryError as error:
            raise DrawingError(f"a curve cannot be fitted: {error.message}") from error
        if len(fit.vertices) > 1:
            return fit.vertices, fit.off_mm
        return np.repeat(fit.vertices, 2, axis=0), None


def _straight(to_mm: Affine, points: Floats) -> Floats:
    """(n, 3) of points (n, 2) mapped, without bulges."""
    vertices = np.zeros((len(points), 3))
    vertices[:, :2] = to_mm.points(points)
    return vertices


def _in_reach(vertices: Floats, limit_mm: float = MAX_COORDINATE_MM) -> Floats:
    """The same numbers; DrawingError when one is no place in a drawing."""
    furthest = float(np.abs(vertices).max())
    if not furthest <= limit_mm:
        raise DrawingError(
            f"it reaches {furthest:.6g} mm away, where micrometres are lost",
            mend="name the unit with --units",
        )
    return vertices


def _circle(centre: Floats, u: Floats, v: Floats, arc: Arc) -> Floats | None:
    """The arc's vertices when its mapped ellipse is a circle, else None."""
    u_axis, v_axis = complex(*u), complex(*v)
    p, q = (u_axis - 1j * v_axis) / 2.0, (u_axis + 1j * v_axis) / 2.0
    if 2.0 * min(abs(p), abs(q)) > ROUND_EPS_MM:
        return None
    if abs(q) <= abs(p):
        return arc_vertices(centre, abs(p), cmath.phase(p) + arc.begin, arc.sweep)
    return arc_vertices(centre, abs(q), cmath.phase(q) - arc.begin, -arc.sweep)


def _with_ends(vertices: Floats, ends: Floats) -> Floats:
    """The same with its first and last point set to `ends` (2, 2), which rounding moved."""
    exact = vertices.copy()
    exact[[0, -1], :2] = ends
    return exact
