"""Curves the plain way: dense samples that follow every tip, and the fewest arcs for them."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from camtool.arrays import Floats
from tests.oracles import arcs

SPLITS = 40
"""How often a piece of a sampled curve is halved, at most."""


def dense_parameters(curve: Any, count: int, longest: float) -> Floats:
    """Equal steps between breaks, halved where neighbours lie apart by more than `longest`, or
    where the tangent turns by more than 0.1 rad over more than a nanometre."""
    breaks = np.asarray(curve.breaks)
    t = np.unique(np.concatenate([np.linspace(a, b, count) for a, b in pairwise(breaks)]))
    for _ in range(SPLITS):
        points, slope = curve.point(t), curve.tangent(t)
        gap = np.hypot(*np.diff(points, axis=0).T)
        a, b = slope[:-1], slope[1:]
        turn = np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)))
        split = (gap > longest) | ((turn > 0.1) & (gap > 1e-6))
        if not split.any() or len(t) > 100_000:
            break
        t = np.sort(np.concatenate([t, 0.5 * (t[:-1] + t[1:])[split]]))
    return t


def sharp_points(curve: Any, t: Floats, within: float) -> Floats:
    """(k, 2) points of the curve at parameters t between which it turns by more than 0.05 rad over
    less than `within` mm: corners, cusps and tips that no cutter could tell from them."""
    points, slope = curve.point(t), curve.tangent(t)
    gap = np.hypot(*np.diff(points, axis=0).T)
    a, b = slope[:-1], slope[1:]
    turn = np.abs(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)))
    return np.asarray(points[:-1][(turn > 0.05) & (gap < within)])


def plain_biarc(a: Floats, out: Floats, b: Floats, into: Floats) -> Floats | None:
    """Rows (3, 3) of the biarc with equal handles from a to b, or None where there is none."""
    v, s = b - a, out + into
    square, along, rest = float(v @ v), float(v @ s), 2.0 - 2.0 * float(out @ into)
    if square == 0.0:
        return None
    # rest · d² + 2 along · d − square = 0, the smaller positive root.
    if abs(rest) < 1e-14:
        handle = 0.5 * square / along if along > 0.0 else math.inf
    else:
        root = math.sqrt(along * along + rest * square)
        handle = (root - along) / rest if along < 0.0 else square / (along + root)
    if not 0.0 < handle < math.inf:
        return None
    joint = 0.5 * (a + handle * out + b - handle * into)
    halves = [_angle(out, joint - a), _angle(b - joint, into)]
    if max(abs(half) for half in halves) > 0.5 * math.pi:
        return None
    return np.array(
        [[*a, math.tan(0.5 * halves[0])], [*joint, math.tan(0.5 * halves[1])], [*b, 0]]
    )


def plain_single(a: Floats, out: Floats, b: Floats, into: Floats, slack: float) -> Floats | None:
    """Rows (2, 3) of the arc or line from a to b whose ends leave the tangents by at most `slack`
    rad, or None."""
    first, second = _angle(out, b - a), _angle(b - a, into)
    if abs(first - second) > 2.0 * slack or abs(first + second) > math.pi:
        return None
    return np.array([[*a, math.tan(0.25 * (first + second))], [*b, 0.0]])


def _angle(a: Floats, b: Floats) -> float:
    return math.atan2(float(a[0] * b[1] - a[1] * b[0]), float(a @ b))


def fewest_arcs(
    points: Floats, arrive: Floats, leave: Floats, corners: Floats, tolerance: float, slack: float
) -> int:
    """The least number of arcs and lines over nodes of a curve: single ones and biarcs between any
    two nodes, every node between them within the tolerance. Dynamic programming, no shortcuts but
    one: after `MISSES` nodes in a row that cannot be reached, none beyond is tried."""
    best = [0] + [10**9] * (len(points) - 1)
    for low in range(len(points) - 1):
        missed = 0
        for high in range(low + 1, len(points)):
            cost = _cost(points, arrive, leave, (low, high), (tolerance, slack))
            missed = missed + 1 if cost > 2 else 0
            best[high] = min(best[high], best[low] + min(cost, 2 if high == low + 1 else cost))
            if missed > MISSES or corners[high]:
                break
    return best[-1]


MISSES = 12
"""Nodes in a row that a span may fail to reach before the search gives up."""


def _cost(
    points: Floats,
    arrive: Floats,
    leave: Floats,
    span: tuple[int, int],
    limits: tuple[float, float],
) -> int:
    low, high = span
    between = points[low + 1 : high]
    ends = (points[low], leave[low], points[high], arrive[high])
    for cost, rows in ((1, plain_single(*ends, limits[1])), (2, plain_biarc(*ends))):
        if rows is None:
            continue
        if len(between) == 0 or arcs.chain_distances(between, rows).max() <= limits[0]:
            return cost
    return 10**6


def fewest_chords(points: Floats, tolerance: float) -> int:
    """Count the chords between the points (n, 2) within the tolerance, the longest each time,
    found by doubling and bisection over the points."""
    count, low, last = 0, 0, len(points) - 1
    while low < last:
        best, step = low + 1, 2
        while low + step <= last and _chord_holds(points, low, low + step, tolerance):
            best, step = low + step, 2 * step
        beyond = min(low + step, last + 1)
        while beyond - best > 1:
            middle = (best + beyond) // 2
            if _chord_holds(points, low, middle, tolerance):
                best = middle
            else:
                beyond = middle
        count, low = count + 1, best
    return count


def _chord_holds(points: Floats, low: int, high: int, tolerance: float) -> bool:
    rows = arcs.arc_distances(points[low + 1 : high], points[low], points[high], 0.0)
    return bool(rows.max(initial=0.0) <= tolerance)
