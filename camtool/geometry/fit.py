"""Curves to tangent-continuous chains of arcs and lines, as few as the tolerance allows.

Nodes are laid on the curve, dense where it bends (`curve_nodes`, kernels/fits.pyx); between them
the longest biarcs, arcs and lines within the tolerance are chained so that their number is small
(`kernels/fits.pyx`). Chains break their tangent only where the curve does.

Errors are distances from dense points of the true curve to the arcs. The other direction needs no
measuring: both have the same ends, and while the distance is below the arcs' radii the foot points
of the curve on the chain move continuously from its first point to its last, so they cover it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import GeometryError
from camtool.geometry.curves import Curve, Pieced, Pieces
from camtool.geometry.measure import Frames, point_at
from camtool.geometry.polylines import BULGE_EPS, POSITION_EPS_MM, Polyline, Segments
from camtool.kernels.fits import (
    ASIDE_FROM,
    ASIDE_TO,
    CORNER_ANGLE_RAD,
    MAX_NODES,
    MEASURE_STEPS,
    MIN_STEPS,
    SPAN_TURN_RAD,
    STEP_ERROR_SHARE,
    STEP_TURN_RAD,
    VANISHING_TANGENT,
    curve_rows,
    fit_nodes,
    samples_between,
    step_errors,
)

Judged = tuple[float, float, float]
"""Largest and rms deviation of a chain from the curve, and the length of the curve, mm."""

MAX_SIZE_MM = 1e100
"""Products of larger numbers would overflow."""

SEARCH_SHARE = 0.97
"""The share of the tolerance that the search may use up: errors peak between nodes."""

ACCEPTED_SHARE = 0.995
"""A fit is accepted when its measured error is within this share of the tolerance: between the
points at which it is measured the error may be a little more."""

ATTEMPTS = 8
"""Repetitions of a fit whose measured error is too large, each time finer."""

REFINING = 1.0 / 8.0
"""The share of its error that a step between nodes may keep at each further attempt."""


class Fit(Struct, frozen=True, eq=False):
    """A chain of arcs and lines: `vertices` (n, 3) x, y, bulge mm; the last is the end (bulge 0).

    `max_mm`, `rms_mm`: distances from the true curve, weighted by its length; `length_mm` of the
    curve. A closed curve ends where it began: leave out the last vertex to close the path. A
    curve that is a point gives one vertex."""

    vertices: Floats
    max_mm: float
    rms_mm: float
    length_mm: float = 0.0

    @property
    def off_mm(self) -> Floats:
        """Errors (n, 2) mm, largest and rms; every vertex has those of the whole chain."""
        return np.full((len(self.vertices), 2), (self.max_mm, self.rms_mm))


def fit_curve(curve: Curve, tolerance_mm: float) -> Fit:
    """Return arcs and lines within `tolerance_mm` of the curve, tangent-continuous wherever the
    curve is.

    Raises GeometryError when the curve is not finite, or for a tolerance below `POSITION_EPS_MM`
    (positions nearer than that are one)."""
    if not (math.isfinite(tolerance_mm) and tolerance_mm >= POSITION_EPS_MM):
        raise GeometryError(
            f"a fitting tolerance of {tolerance_mm} mm is not above {POSITION_EPS_MM} mm"
        )
    if isinstance(curve, Pieced):
        return _fit_pieces(curve.pieces(), tolerance_mm)
    return _fit_any(curve, tolerance_mm)


def fit_path(path: Polyline, tolerance_mm: float) -> Fit:
    """Return arcs and lines, fewer where that can be, within `tolerance_mm` of an open path whose
    segments have tangents in common where they join."""
    segments = Segments.of(path)
    frames = Frames.of(segments)
    turning = np.ceil(np.abs(segments.sweep) / STEP_TURN_RAD)

    def nodes(_: float, steps: int) -> Nodes:
        counts = np.maximum(turning, math.ceil(steps / len(segments))).astype(np.int64)
        row = np.repeat(np.arange(len(segments)), counts)
        share = (np.arange(len(row)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[row]
        tangents = frames[row].tangent_at(share)
        last = frames[np.array([len(segments) - 1])].tangent_at(np.ones(1))
        tangents = np.concatenate([tangents, last])
        points = np.concatenate([point_at(segments, row, share), path.end[None, :]])
        is_end = np.zeros(len(points), dtype=np.bool_)
        is_end[[0, -1]] = True
        return Nodes(np.append(row + share, len(segments)), points, tangents, tangents, is_end)

    def samples(t: Floats) -> Floats:
        every = _steps_between(t)
        row = np.minimum(every.astype(np.int64), len(segments) - 1)
        return point_at(segments, row, every - row)

    vertices, deviations, _ = _fitted(nodes, samples, tolerance_mm)
    return _checked_fit(vertices, deviations, np.stack([path.start, path.end]))


def arc_vertices(centre: Floats, radius: float, start_rad: float, sweep_rad: float) -> Floats:
    """Return an arc as vertices (n, 3), the last one its end (bulge 0); CCW when the sweep is
    positive.

    An arc of more than a half circle is cut into equal parts; a full circle ends exactly where it
    begins."""
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
    """Return the path with every arc of more than a half circle (|bulge| > 1) cut into two halves.

    Vertices (n, 3), of an open path the last one without a segment; mm or any other unit."""
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
    """Return the fit of a curve made of rational Bézier pieces, computed about their origin."""
    if not np.abs(pieces.control).max() <= MAX_SIZE_MM:
        raise GeometryError("a point or a tangent of a curve is not finite")
    control = np.ascontiguousarray(pieces.control)

    def nodes(fineness_mm: float, steps: int) -> Nodes:
        rows, corner = curve_rows(control, steps, fineness_mm)
        point, arrive, leave = (np.ascontiguousarray(rows[:, k : k + 2]) for k in (1, 3, 5))
        return Nodes(rows[:, 0], point, arrive, leave, corner)

    vertices, deviations, _ = _fitted(nodes, lambda t: samples_between(control, t), tolerance_mm)
    vertices[:, :2] += pieces.origin
    return _checked_fit(vertices, deviations, pieces.ends)


def _fit_any(curve: Curve, tolerance_mm: float) -> Fit:
    """Return the fit of any other curve, which gives points and tangents."""
    vertices, deviations, nodes = _fitted(
        lambda fineness_mm, steps: curve_nodes(curve, fineness_mm, steps),
        lambda t: curve.point(_steps_between(t)),
        tolerance_mm,
    )
    if len(nodes) == 1:
        return Fit(vertices, *deviations)
    return _checked_fit(vertices, deviations, nodes.point[[0, -1]])


def _steps_between(t: Floats) -> Floats:
    """Return `MEASURE_STEPS` parameters from each of these (n,) on towards the next one, and the
    last one."""
    share = np.arange(MEASURE_STEPS) / MEASURE_STEPS
    return np.append((t[:-1, None] + share * np.diff(t)[:, None]).ravel(), t[-1])


def _fitted(
    nodes_of: Callable[[float, int], Nodes], samples: Callable[[Floats], Floats], tolerance: float
) -> tuple[Floats, Judged, Nodes]:
    """Return the chain (n, 3) within `tolerance`, its deviations, and the nodes that it was chosen
    from.

    `nodes_of` gives nodes of a fineness, mm, and a least number; `samples` gives `MEASURE_STEPS`
    points of the curve for each step between parameters (n,), and the last one.

    A fit whose error turns out too large is repeated with finer nodes, since errors peak between
    them; if that is not enough, with less of the tolerance as well."""
    target, steps, fineness = SEARCH_SHARE * tolerance, MIN_STEPS, tolerance
    for attempt in range(ATTEMPTS):
        nodes = nodes_of(fineness, steps)
        if len(nodes) == 1:
            return np.append(nodes.point[0], 0.0)[None, :], (0.0, 0.0, 0.0), nodes
        columns = (nodes.point, nodes.arrive, nodes.leave, nodes.corner)
        vertices, deviations = fit_nodes(columns, samples(nodes.t), target, tolerance)
        if not deviations[0] > ACCEPTED_SHARE * tolerance or len(nodes) >= MAX_NODES:
            break
        steps, fineness = 2 * steps, REFINING * fineness
        if attempt > 0:
            target *= SEARCH_SHARE * tolerance / deviations[0]
    return vertices, deviations, nodes


def _checked_fit(vertices: Floats, deviations: Judged, ends: Floats) -> Fit:
    if not (np.isfinite(vertices).all() and math.isfinite(deviations[0] + deviations[2])):
        raise GeometryError("a point or a tangent of a curve is not finite")
    vertices[-1, :2], vertices[0, :2] = ends[1], ends[0]
    return Fit(vertices, *deviations)


# Nodes on a curve, dense where it bends: the places where a fitted arc may begin or end.
#
# A curve is first cut into equal steps of its parameter, then every step is halved until the biarc
# over it differs from the curve by far less than the tolerance and it turns little. What still
# turns when it is as short as one position (`POSITION_EPS_MM`) is a corner or a cusp.

_ASIDE = tuple(10.0**k for k in range(ASIDE_FROM, ASIDE_TO))
"""Where a derivative vanishes, the tangent is taken beside that place, at these shares of the
distance to the next break."""


class Nodes(Struct, frozen=True, eq=False):
    """n nodes: parameter `t` (n,), `point` (n, 2) mm, unit tangents `arrive` and `leave` (n, 2);
    `corner` (n,) is true at both ends and wherever these two differ."""

    t: Floats
    point: Floats
    arrive: Floats
    leave: Floats
    corner: Bools

    def __len__(self) -> int:
        return len(self.t)


def curve_nodes(curve: Curve, tolerance_mm: float, steps: int) -> Nodes:
    """Return points of the curve with their tangents: at least `steps`, and as many more as it
    takes to know the curve between them within the tolerance.

    A curve that is a point gives one node. Raises GeometryError when the curve's parameters do not
    rise or its points are not finite."""
    breaks = np.asarray(curve.breaks, dtype=np.float64)
    if len(breaks) < 2 or not np.isfinite(breaks).all() or not (np.diff(breaks) > 0.0).all():
        raise GeometryError("the parameters of a curve do not rise")
    each = max(4, math.ceil(steps / (len(breaks) - 1)))
    inner = np.linspace(breaks[:-1], breaks[1:], each, endpoint=False, axis=1).ravel()
    t = np.append(inner, breaks[-1])
    directions = _Directions(curve, t, breaks)
    nodes = _NodeColumns(t, _finite(curve.point(t)), *directions.both_sides(t))
    is_break = np.arange(len(t)) % each == 0
    for side, column in ((-1.0, nodes.arrive), (1.0, nodes.leave)):
        # At a corner the derivative may be that of either side, so that both are taken from beside
        # it.
        one_sided, derivative = directions.one_sided(breaks, side), column[is_break]
        differs = turns(one_sided, derivative) > CORNER_ANGLE_RAD
        column[is_break] = np.where(differs[:, None], one_sided, derivative)
    _refine(nodes, curve, directions, tolerance_mm)
    return _merge_nodes(nodes)


class _NodeColumns(Struct, eq=False):
    """The columns of nodes, as in `Nodes`, while nodes are still inserted."""

    t: Floats
    point: Floats
    arrive: Floats
    leave: Floats


class _Directions:
    """Unit tangents of a curve, also where its derivative vanishes."""

    def __init__(self, curve: Curve, t: Floats, breaks: Floats) -> None:
        self.curve = curve
        self.breaks = breaks
        lengths = np.hypot(*_finite(curve.tangent(t)).T)
        self.min_length = VANISHING_TANGENT * float(lengths.max())

    def both_sides(self, t: Floats) -> tuple[Floats, Floats]:
        """Return unit tangents (n, 2), (n, 2) just before and just after each t (n,)."""
        tangent = _finite(self.curve.tangent(t))
        length = np.hypot(tangent[:, 0], tangent[:, 1])
        is_regular = length > self.min_length
        unit = tangent / np.where(is_regular, length, 1.0)[:, None]
        before, after = unit.copy(), unit.copy()
        if not is_regular.all():
            before[~is_regular] = self.one_sided(t[~is_regular], -1.0)
            after[~is_regular] = self.one_sided(t[~is_regular], 1.0)
        return before, after

    def one_sided(self, t: Floats, side: float) -> Floats:
        """Return unit tangents (n, 2) a little before (`side` −1) or after (+1) each t, inside the
        curve."""
        place = np.searchsorted(self.breaks, t, side="left" if side < 0.0 else "right")
        place = np.clip(place, 1, len(self.breaks) - 1)
        room = (self.breaks[place] - self.breaks[place - 1]) * side
        begin, end = self.breaks[0], self.breaks[-1]
        room = np.where((t + room < begin) | (t + room > end), -room, room)
        tangents = np.zeros((len(t), 2))
        missing = np.ones(len(t), dtype=np.bool_)
        for share in _ASIDE:
            tangent = self.curve.tangent(np.clip(t + share * room, begin, end))
            length = np.hypot(tangent[:, 0], tangent[:, 1])
            is_resolved = missing & (length > self.min_length)
            tangents[is_resolved] = tangent[is_resolved] / length[is_resolved][:, None]
            missing &= ~is_resolved
            if not missing.any():
                break
        tangents[missing] = (1.0, 0.0)  # the curve stands still here: such nodes are merged
        return tangents


def _refine(
    nodes: _NodeColumns, curve: Curve, directions: _Directions, tolerance_mm: float
) -> None:
    """Halve steps, by inserting nodes in place, until each step is fine enough, or as short as one
    position, or there are too many."""
    is_new = np.ones(len(nodes.t) - 1, dtype=np.bool_)
    while is_new.any() and len(nodes.t) < MAX_NODES:
        rows = np.flatnonzero(is_new)
        low, high = nodes.t[rows], nodes.t[rows + 1]
        middle = 0.5 * (low + high)
        halves = (middle > low) & (middle < high)
        rows, low, middle = rows[halves], low[halves], middle[halves]
        # Points off the middle as well: over an inflexion the error in the middle is zero.
        high = nodes.t[rows + 1]
        probes = np.concatenate([middle, 0.5 * (low + middle), 0.5 * (middle + high)])
        points = _finite(curve.point(probes)).reshape(3, -1, 2)
        point = points[0]
        is_coarse = _too_coarse(nodes, rows, points, tolerance_mm)
        rows, middle, point = rows[is_coarse], middle[is_coarse], point[is_coarse]
        before, after = directions.both_sides(middle)
        nodes.t = np.insert(nodes.t, rows + 1, middle)
        nodes.point = np.insert(nodes.point, rows + 1, point, axis=0)
        nodes.arrive = np.insert(nodes.arrive, rows + 1, before, axis=0)
        nodes.leave = np.insert(nodes.leave, rows + 1, after, axis=0)
        is_new = np.zeros(len(nodes.t) - 1, dtype=np.bool_)
        halved = rows + np.arange(len(rows))
        is_new[halved] = is_new[halved + 1] = True


def _too_coarse(nodes: _NodeColumns, rows: Ints, probes: Floats, tolerance_mm: float) -> Bools:
    """Return the mask of the steps, `rows`, that must be halved: the curve between their ends is
    not known well enough.

    `probes` (3, steps, 2) are points of the curve within each step, the middle first."""
    error = step_errors(nodes.point, nodes.leave, nodes.arrive, rows, probes)
    arms = probes[0] - nodes.point[rows], probes[0] - nodes.point[rows + 1]
    size = np.maximum(np.hypot(*arms[0].T), np.hypot(*arms[1].T))
    bends = error > STEP_ERROR_SHARE * tolerance_mm
    bends |= turns(nodes.leave[rows], nodes.arrive[rows + 1]) > STEP_TURN_RAD
    return np.asarray(bends & (size > POSITION_EPS_MM))


def _merge_nodes(nodes: _NodeColumns) -> Nodes:
    """Return the nodes with those at one position merged into one, which is a corner if the
    tangents differ."""
    gaps = np.hypot(*np.diff(nodes.point, axis=0).T)
    first = list(range(len(nodes.t)))
    if (gaps <= POSITION_EPS_MM).any():
        first = [0]
        for row in range(1, len(nodes.t)):
            if math.dist(nodes.point[row], nodes.point[first[-1]]) > POSITION_EPS_MM:
                first.append(row)
    last = [*(row - 1 for row in first[1:]), len(nodes.t) - 1]
    point, arrive, leave = nodes.point[first], nodes.arrive[first], nodes.leave[last]
    point[-1] = nodes.point[-1]
    corner = turns(arrive, leave) > CORNER_ANGLE_RAD
    corner[0] = corner[-1] = True
    return Nodes(nodes.t[first], point, arrive, leave, corner)


def turns(a: Floats, b: Floats) -> Floats:
    """Return the angles (n,) between directions a (n, 2) and b (n, 2), 0 to π rad."""
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])))


def _finite(values: Floats) -> Floats:
    if not np.isfinite(values).all():
        raise GeometryError("a point or a tangent of a curve is not finite")
    return values
