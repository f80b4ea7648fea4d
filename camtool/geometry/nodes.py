"""Nodes on a curve, dense where it bends: the places where a fitted arc may begin or end.

A curve is first cut into equal steps of its parameter, then every step is halved until the biarc
over it differs from the curve by far less than the tolerance and it turns little. What still
turns when it is as short as one position (`POSITION_EPS_MM`) is a corner or a cusp.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.curves import Curve
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints
from camtool.kernels.fit_limits import (
    ASIDE_FROM,
    ASIDE_TO,
    CORNER_ANGLE_RAD,
    MAX_NODES,
    MIN_STEPS,
    STEP_ERROR_SHARE,
    STEP_TURN_RAD,
    VANISHING_TANGENT,
)

_ASIDE = tuple(10.0**k for k in range(ASIDE_FROM, ASIDE_TO))
"""How far aside (share of the way to the next break) to look for the direction of a tangent."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """n nodes: parameter `t` (n,), `point` (n, 2) mm, unit tangents `arrive` and `leave` (n, 2);
    `corner` (n,) is true at both ends and wherever these two differ."""

    t: Floats
    point: Floats
    arrive: Floats
    leave: Floats
    corner: Bools

    def __len__(self) -> int:
        return len(self.t)


def curve_nodes(curve: Curve, tolerance_mm: float, steps: int = MIN_STEPS) -> Nodes:
    """Nodes of the curve, begun with at least `steps` steps; one node when the curve is a point.

    Raises GeometryError when the breaks do not rise or the curve is not finite.
    """
    breaks = np.asarray(curve.breaks, dtype=np.float64)
    if len(breaks) < 2 or not np.isfinite(breaks).all() or not (np.diff(breaks) > 0.0).all():
        raise GeometryError("the parameters of a curve do not rise")
    each = max(4, math.ceil(steps / (len(breaks) - 1)))
    inner = np.linspace(breaks[:-1], breaks[1:], each, endpoint=False, axis=1).ravel()
    t = np.append(inner, breaks[-1])
    directions = _Directions(curve, t, breaks)
    nodes = _NodeColumns(t, _finite(curve.point(t)), *directions.both(t))
    is_break = np.arange(len(t)) % each == 0
    for side, column in ((-1.0, nodes.arrive), (1.0, nodes.leave)):
        # A derivative at a corner is the one of either side.
        beside, at = directions.aside(breaks, side), column[is_break]
        differs = turns(beside, at) > CORNER_ANGLE_RAD
        column[is_break] = np.where(differs[:, None], beside, at)
    _refine(nodes, curve, directions, tolerance_mm)
    return _merged(nodes)


@dataclass(eq=False)
class _NodeColumns:
    """Nodes while they grow."""

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
        self.least = VANISHING_TANGENT * float(lengths.max())

    def both(self, t: Floats) -> tuple[Floats, Floats]:
        """Directions (n, 2) just before and just after each t."""
        tangent = _finite(self.curve.tangent(t))
        length = np.hypot(tangent[:, 0], tangent[:, 1])
        plain = length > self.least
        unit = tangent / np.where(plain, length, 1.0)[:, None]
        before, after = unit.copy(), unit.copy()
        if not plain.all():
            before[~plain] = self.aside(t[~plain], -1.0)
            after[~plain] = self.aside(t[~plain], 1.0)
        return before, after

    def aside(self, t: Floats, side: float) -> Floats:
        """Directions (n, 2) a little before (−1) or after (+1) each t, inside the curve."""
        place = np.searchsorted(self.breaks, t, side="left" if side < 0.0 else "right")
        place = np.clip(place, 1, len(self.breaks) - 1)
        room = (self.breaks[place] - self.breaks[place - 1]) * side
        begin, end = self.breaks[0], self.breaks[-1]
        room = np.where((t + room < begin) | (t + room > end), -room, room)
        found = np.zeros((len(t), 2))
        missing = np.ones(len(t), dtype=np.bool_)
        for share in _ASIDE:
            tangent = self.curve.tangent(np.clip(t + share * room, begin, end))
            length = np.hypot(tangent[:, 0], tangent[:, 1])
            good = missing & (length > self.least)
            found[good] = tangent[good] / length[good][:, None]
            missing &= ~good
            if not missing.any():
                break
        found[missing] = (1.0, 0.0)  # the curve stands still here: such nodes are merged
        return found


def _refine(
    nodes: _NodeColumns, curve: Curve, directions: _Directions, tolerance_mm: float
) -> None:
    """Halve steps until each is good, or as short as one position, or too many."""
    fresh = np.ones(len(nodes.t) - 1, dtype=np.bool_)
    while fresh.any() and len(nodes.t) < MAX_NODES:
        rows = np.flatnonzero(fresh)
        low, high = nodes.t[rows], nodes.t[rows + 1]
        middle = 0.5 * (low + high)
        halves = (middle > low) & (middle < high)
        rows, low, middle = rows[halves], low[halves], middle[halves]
        # Points off the middle as well: over an inflexion the error in the middle is zero.
        high = nodes.t[rows + 1]
        probes = np.concatenate([middle, 0.5 * (low + middle), 0.5 * (middle + high)])
        points = _finite(curve.point(probes)).reshape(3, -1, 2)
        point = points[0]
        bad = _too_coarse(nodes, rows, points, tolerance_mm)
        rows, middle, point = rows[bad], middle[bad], point[bad]
        before, after = directions.both(middle)
        nodes.t = np.insert(nodes.t, rows + 1, middle)
        nodes.point = np.insert(nodes.point, rows + 1, point, axis=0)
        nodes.arrive = np.insert(nodes.arrive, rows + 1, before, axis=0)
        nodes.leave = np.insert(nodes.leave, rows + 1, after, axis=0)
        fresh = np.zeros(len(nodes.t) - 1, dtype=np.bool_)
        halved = rows + np.arange(len(rows))
        fresh[halved] = fresh[halved + 1] = True


def _too_coarse(nodes: _NodeColumns, rows: Ints, probes: Floats, tolerance_mm: float) -> Bools:
    """Whether each step, of which some points (j, steps, 2) are given, must be halved."""
    from camtool.kernels.biarc import step_errors

    error = step_errors(nodes.point, nodes.leave, nodes.arrive, rows, probes)
    away = probes[0] - nodes.point[rows], probes[0] - nodes.point[rows + 1]
    size = np.maximum(np.hypot(*away[0].T), np.hypot(*away[1].T))
    bends = error > STEP_ERROR_SHARE * tolerance_mm
    bends |= turns(nodes.leave[rows], nodes.arrive[rows + 1]) > STEP_TURN_RAD
    return np.asarray(bends & (size > POSITION_EPS_MM))


def _merged(nodes: _NodeColumns) -> Nodes:
    """Nodes at one position become one node, which is a corner when the tangents differ."""
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
    """Angles (n,) rad, 0..π, between directions (n, 2)."""
    cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    return np.asarray(np.abs(np.arctan2(cross, a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])))


def _finite(values: Floats) -> Floats:
    if not np.isfinite(values).all():
        raise GeometryError("a point or a tangent of a curve is not finite")
    return values
