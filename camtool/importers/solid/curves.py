"""Edges of OpenCASCADE in a level plane to lines and arcs in x and y.

line, circle                     exact
ellipse, B-spline, Bézier        fitted; their numbers are taken over
all others                       fitted by asking OpenCASCADE for points and tangents
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from camtool.geometry.curves import Curve, EllipseCurve, FunctionCurve, SplineCurve
from camtool.geometry.fit import arc_vertices, fit_curve
from camtool.geometry.polylines import POSITION_EPS_MM, Floats

LEVEL_RAD = 1e-6
"""A face or a circle whose axis leaves the vertical by no more is level: 1 nm over 1 mm."""

FULL_TURN_RAD = 1e-9
"""An arc within this of a full turn is a full circle."""


JOINT_MM = 1e-4
"""Edges of one wire whose ends lie nearer than this meet; OpenCASCADE holds them to 1e-7 mm,
files of other programs to 1e-5 and more."""


@dataclass(frozen=True, eq=False)
class Path:
    """Vertices (n, 3) x, y, bulge and `off` (n, 2) of a `Piece`, in the model's unit."""

    vertices: Floats
    closed: bool
    off: Floats


def edge_path(edge: Any, tolerance: float) -> Path:
    """The edge in its own direction, from its first point to its last, both in `vertices`."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopAbs import TopAbs_REVERSED

    curve = BRepAdaptor_Curve(edge)
    start, end = curve.FirstParameter(), curve.LastParameter()
    exact = _exact(curve, start, end)
    if exact is None:
        fit = fit_curve(_free(curve, start, end), tolerance)
        exact, off = fit.vertices, fit.off_mm
    else:
        off = np.zeros((len(exact), 2))
    if edge.Orientation() == TopAbs_REVERSED:
        exact = reversed_vertices(exact)  # and all of one edge is equally far off
    return Path(exact, False, off)


def reversed_vertices(vertices: Floats) -> Floats:
    """The open path from its end to its beginning; bulges change their sign and their owner."""
    back = vertices[::-1].copy()
    back[:-1, 2] = -vertices[-2::-1, 2]
    back[-1, 2] = 0.0
    return back


def joined(edges: list[Path]) -> Path:
    """Edges one after the other as one closed path; each ends where the next one begins."""
    vertices = np.concatenate([path.vertices[:-1] for path in edges])
    off = [path.off[:-1].copy() for path in edges]
    for row, step in zip(off, _steps(edges).tolist(), strict=True):
        row[-1] += step if step > POSITION_EPS_MM else 0.0
    return Path(vertices, True, np.concatenate(off))


def follow(edges: list[Path]) -> bool:
    """Whether each edge begins where the one before ends, the last one closing the ring."""
    return bool((_steps(edges) <= JOINT_MM).all())


def _steps(edges: list[Path]) -> Floats:
    """(E,) how far from the end of each edge the next one begins."""
    ends = np.array([path.vertices[-1, :2] for path in edges])
    starts = np.array([path.vertices[0, :2] for path in edges])
    return np.asarray(np.hypot(*(np.roll(starts, -1, axis=0) - ends).T))


def _exact(curve: Any, start: float, end: float) -> Floats | None:
    """A line or a level circle; None for every other curve."""
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

    kind = curve.GetType()
    if kind == GeomAbs_Line:
        return np.array([[*_xy(curve.Value(at)), 0.0] for at in (start, end)])
    if kind != GeomAbs_Circle:
        return None
    circle = curve.Circle()
    up = circle.Axis().Direction().Z()
    if math.hypot(circle.Axis().Direction().X(), circle.Axis().Direction().Y()) > LEVEL_RAD:
        return None
    centre, first = np.array(_xy(circle.Location())), np.array(_xy(curve.Value(start)))
    sweep = math.copysign(end - start, up)
    if abs(abs(sweep) - 2.0 * math.pi) <= FULL_TURN_RAD:
        sweep = math.copysign(2.0 * math.pi, up)
    angle = math.atan2(first[1] - centre[1], first[0] - centre[0])
    return arc_vertices(centre, circle.Radius(), angle, sweep)


def _free(curve: Any, start: float, end: float) -> Curve:
    """The curve as `fit_curve` takes it, seen from above."""
    from OCP.GeomAbs import (
        GeomAbs_BezierCurve,
        GeomAbs_BSplineCurve,
        GeomAbs_Circle,
        GeomAbs_Ellipse,
    )

    kind = curve.GetType()
    if kind in (GeomAbs_Ellipse, GeomAbs_Circle):
        conic = curve.Ellipse() if kind == GeomAbs_Ellipse else curve.Circle()
        radii = (
            (conic.MajorRadius(), conic.MinorRadius())
            if kind == GeomAbs_Ellipse
            else (conic.Radius(), conic.Radius())
        )
        axes = conic.XAxis().Direction(), conic.YAxis().Direction()
        major, minor = (
            radius * np.array(_xy(axis)) for radius, axis in zip(radii, axes, strict=True)
        )
        return EllipseCurve(np.array(_xy(conic.Location())), major, minor, start, end)
    if kind == GeomAbs_BSplineCurve:
        return _spline(curve.BSpline(), start, end)
    if kind == GeomAbs_BezierCurve:
        from OCP.GeomConvert import GeomConvert

        return _spline(GeomConvert.CurveToBSplineCurve_s(curve.Bezier()), start, end)
    return _asked(curve, start, end)


def _spline(spline: Any, start: float, end: float) -> Curve:
    """The part of a B-spline between two parameters, with its own knots and weights."""
    if spline.IsPeriodic():
        spline.SetNotPeriodic()
    if (spline.FirstParameter(), spline.LastParameter()) != (start, end):
        spline.Segment(start, end)
    count = spline.NbPoles()
    numbers = range(1, count + 1)
    knots = [
        spline.Knot(index)
        for index in range(1, spline.NbKnots() + 1)
        for _ in range(spline.Multiplicity(index))
    ]
    control = np.array([_xy(spline.Pole(index)) for index in numbers])
    weights = np.array([spline.Weight(index) for index in numbers])
    return SplineCurve(spline.Degree(), np.array(knots), control, weights)


def _asked(curve: Any, start: float, end: float) -> Curve:
    """Any curve, point by point; it may have corners where its intervals meet."""
    from OCP.GeomAbs import GeomAbs_C1
    from OCP.gp import gp_Pnt, gp_Vec

    count = curve.NbIntervals(GeomAbs_C1)
    bounds = _reals(count + 1)
    curve.Intervals(bounds, GeomAbs_C1)
    breaks = np.array([bounds.Value(index) for index in range(1, count + 2)])

    def at(order: int) -> Callable[[Floats], Floats]:
        def values(t: Floats) -> Floats:
            point, slope = gp_Pnt(), gp_Vec()
            rows: list[tuple[float, float]] = []
            for parameter in t.tolist():
                curve.D1(parameter, point, slope)
                rows.append(_xy(slope if order else point))
            return np.array(rows, dtype=np.float64).reshape(-1, 2)

        return values

    return FunctionCurve(at(0), at(1), breaks)


def _reals(count: int) -> Any:
    """An array of OpenCASCADE, under the name that its binding gives it since version 8."""
    try:
        from OCP.collections import Array1_double as Reals
    except ImportError:
        from OCP.TColStd import TColStd_Array1OfReal as Reals
    return Reals(1, count)


def _xy(place: Any) -> tuple[float, float]:
    return place.X(), place.Y()
