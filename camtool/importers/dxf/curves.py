"""SPLINE, HELIX and text of DXF drawings to paths in mm.

A spline is read as the file writes it: knots and weights that do not belong to its control points
make it unusable, as a guess would be another curve.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.fit import BezierCurve, SplineCurve
from camtool.geometry.polylines import POSITION_EPS_MM, Floats
from camtool.importers.dxf.frames import Frame, Shape, Unusable, fitted, numbers, straight

MAX_DEGREE = 25
"""Splines of a higher degree are refused (CAD programs go to 10); the effort grows with it."""

_LINE_POINTS = 2  # a Bézier of two control points is a line


def spline(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """SPLINE, and HELIX when it does not rise."""
    control = numbers([tuple(point) for point in entity.control_points]).reshape(-1, 3)
    if len(control):
        knots, weights = numbers([*entity.knots]), numbers([*entity.weights])
        degree = int(entity.dxf.degree)
    else:
        ends = [
            tuple(numbers(entity.dxf.get(name)))
            for name in ("start_tangent", "end_tangent")
            if entity.dxf.hasattr(name)
        ]
        fit = numbers([tuple(point) for point in entity.fit_points]).reshape(-1, 3)
        degree, knots, control = through(fit, ends, bool(entity.closed))
        weights = np.empty(0)
    return [spline_of(degree, knots, frame.flat(control), weights, tolerance_mm)]


def through(
    fit_points: Floats, tangents: list[tuple[float, ...]], closed: bool
) -> tuple[int, Floats, Floats]:
    """Degree, knots and control points (n, 3) of the spline that CAD programs draw through points.

    `tangents` are those of both ends, or none. Unusable when there are too few points.
    """
    from ezdxf.math import fit_points_to_cad_cv

    steps = np.hypot(*np.diff(fit_points[:, :2], axis=0).T)
    points = fit_points[np.concatenate([[True], steps > 0.0])] if len(fit_points) else fit_points
    if closed and len(points) > _LINE_POINTS and (points[0] != points[-1]).any():
        points = np.vstack([points, points[:1]])
    if len(points) < _LINE_POINTS:
        raise Unusable("has no curve: too few points")
    ends = tangents if len(tangents) == 2 and all(any(end) for end in tangents) else None
    try:
        tool = fit_points_to_cad_cv([tuple(row) for row in points.tolist()], ends)
    except (ValueError, ArithmeticError, IndexError) as error:
        raise Unusable("has no curve through its points") from error
    control = numbers([tuple(point) for point in tool.control_points]).reshape(-1, 3)
    return int(tool.degree), numbers([*tool.knots()]), control


def spline_of(
    degree: int, knots: Floats, control: Floats, weights: Floats, tolerance_mm: float
) -> Shape:
    """The spline of control points (n, 2) mm; no `weights` are equal ones. Unusable when these
    do not belong together."""
    if degree > MAX_DEGREE:
        raise Unusable(f"has degree {degree}, at most {MAX_DEGREE} is read")
    if not len(control):
        raise Unusable("has no curve: no control points")
    try:
        curve = SplineCurve(degree, knots, control, weights if len(weights) else None)
    except GeometryError as error:
        raise Unusable(f"has no curve: {error.message}") from error
    shape = Shape.of(fitted(curve, control, tolerance_mm))
    ends = shape.vertices[[0, -1], :2]
    closed = len(shape.vertices) > 2 and math.dist(*ends) <= POSITION_EPS_MM
    return shape.ring() if closed else shape


def outline(parts: list[Floats], closed: bool, frame: Frame, tolerance_mm: float) -> Shape:
    """Béziers of 2 (a line), 3 or 4 control points (k, 3) in world coordinates, end to end."""
    vertices: list[Floats] = []
    off: list[Floats] = []
    flat = frame.flat(np.concatenate([numbers(list(part)) for part in parts]))
    counts = np.cumsum([len(part) for part in parts])
    for control in np.split(flat, counts[:-1]):
        if len(control) == _LINE_POINTS:
            vertices.append(straight(control[:1]))
            off.append(np.zeros((1, 2)))
            continue
        fit = fitted(BezierCurve(control), control, tolerance_mm)
        count = max(len(fit.vertices) - 1, 1)
        vertices.append(fit.vertices[:count])
        off.append(fit.off_mm[:count])
    vertices.append(straight(flat[-1:]))
    off.append(np.zeros((1, 2)))
    return Shape(np.concatenate(vertices), closed, np.concatenate(off))
