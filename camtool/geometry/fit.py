"""Curves to tangent-continuous chains of arcs and lines, as few as the tolerance allows.

From each node on the curve (`nodes`) the longest biarc that stays within the tolerance is taken:
its error grows with the third power of its length, which tells how far to reach next, and
bisection settles the rest. Chains break their tangent only where the curve does.

Errors are distances from dense points of the true curve to the arcs. The other direction needs no
measuring: both have the same ends, and while the distance is below the arcs' radii the foot points
of the curve on the chain move continuously from its first point to its last, so they cover it.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.curves import (
    BezierCurve,
    Curve,
    EllipseCurve,
    FunctionCurve,
    SplineCurve,
)
from camtool.geometry.drawing import FitError
from camtool.geometry.nodes import MIN_STEPS, Nodes, curve_nodes, turns
from camtool.geometry.polylines import BULGE_EPS, POSITION_EPS_MM, Floats, Ints

__all__ = [
    "BezierCurve",
    "Curve",
    "EllipseCurve",
    "Fit",
    "FunctionCurve",
    "SplineCurve",
    "arc_vertices",
    "fit_curve",
    "overall",
    "split_bulges",
]

_Vertex = tuple[float, float, float]

STRAIGHT_SAGITTA_MM = 1e-7
"""An arc that leaves its chord by no more is a line."""

SAME_ARC_MM = 1e-8
"""Neighbours that leave a common arc or line by no more become one."""

SPAN_TURN_RAD = math.pi * (1.0 + 1e-9)
"""A biarc covers no more turning than a half circle (and rounding)."""

SEARCH_SHARE = 0.97
"""The share of the tolerance that the search may use up: errors peak between nodes."""

MEASURE_STEPS = 32
"""Points per step between nodes at which the final error is measured."""

ATTEMPTS = 4
"""How often a fit whose measured error is too large is done again, each time finer."""


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


@dataclass(frozen=True, eq=False)
class _Spans:
    """Biarcs between the nodes `ends` (s + 1,); `pairs` (s, 4) joint x, y and both bulges."""

    ends: Ints
    pairs: Floats


def fit_curve(curve: Curve, tolerance_mm: float) -> Fit:
    """Arcs and lines within `tolerance_mm` of the curve, G1 wherever the curve is.

    Raises GeometryError when the curve is not finite, or for a tolerance below
    `POSITION_EPS_MM` (positions nearer than that are one).
    """
    if not (math.isfinite(tolerance_mm) and tolerance_mm >= POSITION_EPS_MM):
        raise GeometryError(
            f"a fitting tolerance of {tolerance_mm} mm is not above {POSITION_EPS_MM} mm"
        )
    target, steps = SEARCH_SHARE * tolerance_mm, MIN_STEPS
    for _ in range(ATTEMPTS):
        nodes = curve_nodes(curve, tolerance_mm, steps)
        if len(nodes) == 1:
            return Fit(np.append(nodes.point[0], 0.0)[None, :], 0.0, 0.0)
        spans = _spans(nodes, target)
        vertices, places = _joined(_chain(nodes, spans))
        if len(vertices) == 1:
            return Fit(vertices, 0.0, 0.0)
        fit = _measured(curve, nodes, spans, vertices, places)
        if fit.max_mm <= tolerance_mm:
            break
        target, steps = target * SEARCH_SHARE * tolerance_mm / fit.max_mm, 2 * steps
    return fit


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


def overall(fits: Iterable[Fit]) -> FitError:
    """The error of many fits together: the largest, and the rms weighted by length."""
    items = list(fits)
    length = sum(fit.length_mm for fit in items)
    if length == 0.0:
        return FitError()
    square = sum(fit.rms_mm**2 * fit.length_mm for fit in items) / length
    return FitError(max(fit.max_mm for fit in items), math.sqrt(square))


def _spans(nodes: Nodes, target_mm: float) -> _Spans:
    """The longest spans one after the other, none across a corner."""
    from camtool.kernels.biarc import longest_spans

    steps = turns(nodes.leave[:-1], nodes.arrive[1:])
    turned = np.concatenate([[0.0], np.cumsum(steps)])
    ends, pairs = longest_spans(
        nodes.point, nodes.leave, nodes.arrive, nodes.corner, turned, target_mm, SPAN_TURN_RAD
    )
    return _Spans(ends, pairs)


def _chain(nodes: Nodes, spans: _Spans) -> Floats:
    """Two segments for each span, vertices (2·spans + 1, 3); lines where there is no biarc."""
    ends = nodes.point[spans.ends]
    pairs = np.where(np.isnan(spans.pairs), 0.0, spans.pairs)
    missing = np.isnan(spans.pairs[:, 0])
    pairs[missing, :2] = 0.5 * (ends[:-1] + ends[1:])[missing]
    rows = np.zeros((2 * len(pairs) + 1, 3))
    rows[::2, :2] = ends
    rows[:-1:2, 2] = pairs[:, 2]
    rows[1::2, :2] = pairs[:, :2]
    rows[1::2, 2] = pairs[:, 3]
    lengths = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    flat = np.abs(rows[:-1, 2]) * 0.5 * lengths <= STRAIGHT_SAGITTA_MM
    rows[:-1, 2][flat] = 0.0
    return rows


def _joined(rows: Floats) -> tuple[Floats, Ints]:
    """Neighbours on one circle or line become one; also where each old segment is now."""
    vertices: list[_Vertex] = [_row(rows[0])]
    places = np.zeros(len(rows) - 1, dtype=np.int64)
    for index in range(len(rows) - 1):
        begin, end = vertices[-1], _row(rows[index + 1])
        bulge = float(rows[index, 2])
        if math.dist(begin[:2], end[:2]) <= POSITION_EPS_MM:
            # Too short for a segment: its end takes the place of its begin.
            places[index] = max(len(vertices) - 2, 0)
            continue
        vertices[-1] = (begin[0], begin[1], bulge)
        if len(vertices) > 1:
            common = _common(vertices[-2], vertices[-1], end)
            if common is not None:
                vertices.pop()
                vertices[-1] = (*vertices[-1][:2], common)
        places[index] = len(vertices) - 1
        vertices.append((end[0], end[1], 0.0))
    vertices[-1] = (*_row(rows[-1])[:2], 0.0)
    return np.array(vertices), places


def _common(one: _Vertex, two: _Vertex, end: _Vertex) -> float | None:
    """The bulge of the one arc or line that both segments lie on, or None."""
    from camtool.kernels.biarc import distance_to_arc

    first, second = one[2], two[2]
    if first * second < 0.0 or (first == 0.0) != (second == 0.0):
        return None
    sweep = 4.0 * (math.atan(first) + math.atan(second))
    if abs(sweep) > SPAN_TURN_RAD or math.dist(one[:2], end[:2]) <= POSITION_EPS_MM:
        return None
    bulge = min(max(math.tan(sweep / 4.0), -1.0), 1.0)
    for probe in (_middle(one, two), two[:2], _middle(two, end)):
        if distance_to_arc(*probe, *one[:2], *end[:2], bulge) > SAME_ARC_MM:
            return None
    return bulge


def _middle(a: _Vertex, b: _Vertex) -> tuple[float, float]:
    """The point halfway along the segment that leaves `a` for `b`: sagitta = bulge · chord / 2."""
    dx, dy = b[0] - a[0], b[1] - a[1]
    return 0.5 * (a[0] + b[0] + a[2] * dy), 0.5 * (a[1] + b[1] - a[2] * dx)


def _row(row: Floats) -> _Vertex:
    return float(row[0]), float(row[1]), float(row[2])


def _measured(curve: Curve, nodes: Nodes, spans: _Spans, vertices: Floats, places: Ints) -> Fit:
    """The error at many points between the nodes, each against the arcs of its own span."""
    from camtool.kernels.biarc import arc_distances

    share = np.arange(MEASURE_STEPS) / MEASURE_STEPS
    t = (nodes.t[:-1, None] + share * np.diff(nodes.t)[:, None]).ravel()
    points = curve.point(np.append(t, nodes.t[-1]))
    owner = np.repeat(np.arange(len(spans.pairs)), np.diff(spans.ends) * MEASURE_STEPS)
    error = np.full(len(t), np.inf)
    for place in (places[2 * owner], places[2 * owner + 1]):
        begin, end = vertices[place], vertices[place + 1]
        found = arc_distances(points[:-1], begin[:, :2], end[:, :2], begin[:, 2])
        error = np.minimum(error, found)
    weight = np.hypot(*np.diff(points, axis=0).T)
    length = float(weight.sum())
    mean = float((weight * error**2).sum()) / length if length > 0.0 else 0.0
    return Fit(vertices, float(error.max()), math.sqrt(mean), length)
