"""Curves to tangent-continuous chains of arcs and lines, as few as the tolerance allows.

Nodes are laid on the curve, dense where it bends (`nodes`, `kernels/bezier.py`); between them the
longest biarcs, arcs and lines within the tolerance are chained so that their number is small
(`kernels/spans.py`). Chains break their tangent only where the curve does.

Errors are distances from dense points of the true curve to the arcs. The other direction needs no
measuring: both have the same ends, and while the distance is below the arcs' radii the foot points
of the curve on the chain move continuously from its first point to its last, so they cover it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.curves import (
    BezierCurve,
    Curve,
    EllipseCurve,
    FunctionCurve,
    Pieced,
    Pieces,
    SplineCurve,
)
from camtool.geometry.nodes import Nodes, curve_nodes
from camtool.geometry.polylines import BULGE_EPS, POSITION_EPS_MM, Floats
from camtool.kernels.fit_limits import (
    ACCEPTED_SHARE,
    ATTEMPTS,
    MAX_NODES,
    MEASURE_STEPS,
    MIN_STEPS,
    REFINING,
    SEARCH_SHARE,
    SPAN_TURN_RAD,
)

__all__ = [
    "BezierCurve",
    "Curve",
    "EllipseCurve",
    "Fit",
    "FunctionCurve",
    "SplineCurve",
    "arc_vertices",
    "fit_curve",
    "fit_curves",
    "split_bulges",
]


Judged = tuple[float, float, float]
"""Of a chain its largest and its rms deviation from the curve, and the length of that, mm."""

MAX_SIZE_MM = 1e100
"""The products of larger numbers would not be finite."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A chain of arcs and lines: `vertices` (n, 3) x, y, bulge mm; the last is the end (bulge 0).

    `max_mm`, `rms_mm`: distances from the true curve, weighted by its length; `length_mm` of the
    curve. A closed curve ends where it began: leave out the last vertex to close the path. A
    curve that is a point gives one vertex.
    """

    vertices: Floats
    max_mm: float
    rms_mm: float
    length_mm: float = 0.0

    @property
    def off_mm(self) -> Floats:
        """(n, 2) mm: the largest and the rms distance, at every vertex those of the whole
        chain."""
        return np.tile([self.max_mm, self.rms_mm], (len(self.vertices), 1))


def fit_curve(curve: Curve, tolerance_mm: float) -> Fit:
    """Arcs and lines within `tolerance_mm` of the curve, G1 wherever the curve is.

    Raises GeometryError when the curve is not finite, or for a tolerance below
    `POSITION_EPS_MM` (positions nearer than that are one).
    """
    if not (math.isfinite(tolerance_mm) and tolerance_mm >= POSITION_EPS_MM):
        raise GeometryError(
            f"a fitting tolerance of {tolerance_mm} mm is not above {POSITION_EPS_MM} mm"
        )
    if isinstance(curve, Pieced):
        return _fit_pieces(curve.pieces(), tolerance_mm)
    return _fit_any(curve, tolerance_mm)


def fit_curves(curves: Iterable[Curve], tolerance_mm: float) -> list[Fit]:
    """`fit_curve` of each."""
    return [fit_curve(curve, tolerance_mm) for curve in curves]


def arc_vertices(centre: Floats, radius: float, start_rad: float, sweep_rad: float) -> Floats:
    """An arc as vertices (n, 3), the last one its end (bulge 0); CCW when the sweep is positive.

    More than a half circle is cut into equal parts; a full circle ends exactly where it begins.
    """
    parts = max(1, math.ceil(abs(sweep_rad) / SPAN_TURN_RAD))
    angle = start_rad + sweep_rad * np.arange(parts + 1) / parts
    bulge = np.full(parts + 1, np.clip(math.tan(sweep_rad / parts / 4.0), -1.0, 1.0))
    bulge[-1] = 0.0
    x, y = float(centre[0]), float(centre[1])
    vertices = np.column_stack([x + radius * np.cos(angle), y + radius * np.sin(angle), bulge])
    if abs(sweep_rad) == 2.0 * math.pi:
        vertices[-1, :2] = vertices[0, :2]
    return vertices


def split_bulges(vertices: Floats, closed: bool) -> Floats:
    """The same path with every arc of more than a half circle (|bulge| > 1) cut into two halves.

    Vertices (n, 3), of an open path the last one without a segment; mm or any other unit.
    """
    large = np.abs(vertices[:, 2]) > 1.0 + BULGE_EPS
    if not closed:
        large[-1:] = False
    rows = np.flatnonzero(large)
    if not len(rows):
        return vertices
    bulge = vertices[rows, 2]
    end = vertices[(rows + 1) % len(vertices), :2]
    chord = end - vertices[rows, :2]
    # The middle of an arc lies off its chord by bulge · chord / 2, on the right of it when CCW.
    right = np.column_stack([chord[:, 1], -chord[:, 0]])
    middle = 0.5 * (vertices[rows, :2] + end + bulge[:, None] * right)
    # A whole turn less rounding would give halves just above 1.
    half = np.clip(np.tan(0.5 * np.arctan(bulge)), -1.0, 1.0)
    split = vertices.copy()
    split[rows, 2] = half
    return np.insert(split, rows + 1, np.column_stack([middle, half]), axis=0)


def _fit_pieces(pieces: Pieces, tolerance_mm: float) -> Fit:
    """Rational pieces, about their origin."""
    from camtool.kernels.bezier import curve_rows, points_at

    if not np.abs(pieces.control).max() <= MAX_SIZE_MM:
        raise GeometryError("a point or a tangent of a curve is not finite")
    control = np.ascontiguousarray(pieces.control)

    def nodes(fineness_mm: float, steps: int) -> Nodes:
        rows, corner = curve_rows(control, steps, fineness_mm)
        point, arrive, leave = (np.ascontiguousarray(rows[:, k : k + 2]) for k in (1, 3, 5))
        return Nodes(rows[:, 0], point, arrive, leave, corner)

    vertices, judged, _ = _fitted(nodes, lambda t: points_at(control, t), tolerance_mm)
    vertices[:, :2] += pieces.origin
    return _checked(vertices, judged, pieces.ends)


def _fit_any(curve: Curve, tolerance_mm: float) -> Fit:
    """A curve given by functions."""
    vertices, judged, nodes = _fitted(
        lambda fineness_mm, steps: curve_nodes(curve, fineness_mm, steps),
        curve.point,
        tolerance_mm,
    )
    if len(nodes) == 1:
        return Fit(vertices, *judged)
    return _checked(vertices, judged, nodes.point[[0, -1]])


def _fitted(
    nodes_of: Callable[[float, int], Nodes], point_of: Callable[[Floats], Floats], tolerance: float
) -> tuple[Floats, Judged, Nodes]:
    """The chain (n, 3) within `tolerance`, its deviations, and the nodes it was chosen from.

    A fit whose error turns out too large is done again over finer nodes, since errors peak
    between them; if that is not enough, with less of the tolerance as well.
    """
    from camtool.kernels.fit_bezier import fit_nodes

    target, steps, fineness = SEARCH_SHARE * tolerance, MIN_STEPS, tolerance
    for attempt in range(ATTEMPTS):
        nodes = nodes_of(fineness, steps)
        if len(nodes) == 1:
            return np.append(nodes.point[0], 0.0)[None, :], (0.0, 0.0, 0.0), nodes
        share = np.arange(MEASURE_STEPS) / MEASURE_STEPS
        t = (nodes.t[:-1, None] + share * np.diff(nodes.t)[:, None]).ravel()
        samples = point_of(np.append(t, nodes.t[-1]))
        columns = (nodes.point, nodes.arrive, nodes.leave, nodes.corner)
        vertices, judged = fit_nodes(columns, samples, target, tolerance)
        if not judged[0] > ACCEPTED_SHARE * tolerance or len(nodes) >= MAX_NODES:
            break
        steps, fineness = 2 * steps, REFINING * fineness
        if attempt > 0:
            target *= SEARCH_SHARE * tolerance / judged[0]
    return vertices, judged, nodes


def _checked(vertices: Floats, judged: Judged, ends: Floats) -> Fit:
    if not (np.isfinite(vertices).all() and math.isfinite(judged[0] + judged[2])):
        raise GeometryError("a point or a tangent of a curve is not finite")
    vertices[-1, :2], vertices[0, :2] = ends[1], ends[0]
    return Fit(vertices, *judged)
