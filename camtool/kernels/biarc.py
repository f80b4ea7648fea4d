"""Biarcs, distances to arcs, and how far arcs and biarcs stray from nodes on a curve.

What makes it exact: no centre is ever formed, so an arc may be as flat as it likes; for a bulge of
0 each formula becomes the one of the straight line. `tests/oracles/arcs.py` is the twin.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]
Pair = tuple[float, float, float, float]


@inner
def distance_to_arc(
    px: float, py: float, ax: float, ay: float, bx: float, by: float, bulge: float
) -> float:
    """Distance from p to the arc from a to b, |bulge| ≤ 1, to its nearer end beside the arc.

    With w = p − a, u = b − a, n = u turned by +90°, the power of p over the circle and the vector
    from the centre, both times the bulge, need no centre:
        b·power = b(w·w − w·u) − (1 − b²)/2 w·n,   q = b(w − u/2) − (1 − b²)/4 n,
        distance to the circle = |b·power| / (|q| + |u|(1 + b²)/4).
    p lies beside the arc when it is behind the normal at one of its ends, whose tangents are
    (1 − b²) u ∓ 2b n.
    """
    wx, wy, vx, vy = px - ax, py - ay, px - bx, py - by
    ux, uy = bx - ax, by - ay
    rest = 1.0 - bulge * bulge
    forward = wx * (rest * ux + 2.0 * bulge * uy) + wy * (rest * uy - 2.0 * bulge * ux)
    behind = vx * (rest * ux - 2.0 * bulge * uy) + vy * (rest * uy + 2.0 * bulge * ux)
    square = ux * ux + uy * uy
    if square == 0.0 or forward < 0.0 or behind > 0.0:
        return math.sqrt(min(wx * wx + wy * wy, vx * vx + vy * vy))
    power = bulge * (wx * vx + wy * vy) - 0.5 * rest * (wy * ux - wx * uy)
    qx = bulge * (wx - 0.5 * ux) + 0.25 * rest * uy
    qy = bulge * (wy - 0.5 * uy) - 0.25 * rest * ux
    below = math.sqrt(qx * qx + qy * qy) + 0.25 * math.sqrt(square) * (1.0 + bulge * bulge)
    return abs(power) / below


@inner
def half_angle(ax: float, ay: float, bx: float, by: float) -> float:
    """tan(α/2) = sin α / (1 + cos α) for the angle α from a to b; NaN when |α| > 90°.

    An arc of sweep s leaves the direction of its chord by s/2, so its bulge tan(s/4) is tan(α/2)
    with α between tangent and chord.
    """
    cosine = ax * bx + ay * by
    below = math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)) + cosine
    if below <= 0.0:
        return np.nan
    bulge = (ax * by - ay * bx) / below
    if abs(bulge) > 1.0 + 1e-12:
        return np.nan
    return min(max(bulge, -1.0), 1.0)


@inner
def biarc(start: Floats, leave: Floats, end: Floats, arrive: Floats) -> Pair:
    """Joint x, y and both bulges of the biarc with equal handles; all NaN where there is none.

    Handles of length d reach Q0 = start + d·leave and Q1 = end − d·arrive; the arcs meet in the
    middle of Q0Q1 when |Q1 − Q0| = 2d. With v = end − start, s = leave + arrive, c = leave·arrive:
        d²(2 − 2c) + 2d v·s − v·v = 0   ⇒   d = v·v / (v·s + √((v·s)² + 2(1 − c) v·v)).
    None where no d > 0 does it, or where an arc would be more than a half circle.
    """
    vx, vy = end[0] - start[0], end[1] - start[1]
    square = vx * vx + vy * vy
    along = vx * (leave[0] + arrive[0]) + vy * (leave[1] + arrive[1])
    cosine = leave[0] * arrive[0] + leave[1] * arrive[1]
    below = along + math.sqrt(along * along + 2.0 * max(1.0 - cosine, 0.0) * square)
    if square == 0.0 or below <= 0.0:
        return np.nan, np.nan, np.nan, np.nan
    handle = square / below
    jx = 0.5 * (start[0] + end[0] + handle * (leave[0] - arrive[0]))
    jy = 0.5 * (start[1] + end[1] + handle * (leave[1] - arrive[1]))
    first = half_angle(leave[0], leave[1], jx - start[0], jy - start[1])
    second = half_angle(end[0] - jx, end[1] - jy, arrive[0], arrive[1])
    if math.isnan(first) or math.isnan(second):
        return np.nan, np.nan, np.nan, np.nan
    return jx, jy, first, second


@inner
def distance_to_biarc(px: float, py: float, start: Floats, end: Floats, pair: Pair) -> float:
    """Distance from p to the nearer of both arcs; infinite when there is no biarc."""
    jx, jy, first, second = pair
    if math.isnan(jx):
        return np.inf
    one = distance_to_arc(px, py, start[0], start[1], jx, jy, first)
    two = distance_to_arc(px, py, jx, jy, end[0], end[1], second)
    return min(one, two)


@kernel
def step_errors(
    point: Floats, leave: Floats, arrive: Floats, rows: Ints, probes: Floats
) -> Floats:
    """For each step from node rows[i] (k,) to the next: the largest distance of its probes
    (j, k, 2) from the biarc over the step, infinite when there is none."""
    out = np.empty(len(rows))
    for i in range(len(rows)):
        a, b = rows[i], rows[i] + 1
        pair = biarc(point[a], leave[a], point[b], arrive[b])
        out[i] = 0.0
        for j in range(len(probes)):
            off = distance_to_biarc(probes[j, i, 0], probes[j, i, 1], point[a], point[b], pair)
            out[i] = max(out[i], off)
    return out


@inner
def span_error(point: Floats, leave: Floats, arrive: Floats, low: int, high: int) -> float:
    """The largest distance of the nodes between from the biarc over nodes low..high."""
    start, end = point[low], point[high]
    pair = biarc(start, leave[low], end, arrive[high])
    largest = np.inf if math.isnan(pair[0]) else 0.0
    for i in range(low + 1, high):
        largest = max(largest, distance_to_biarc(point[i, 0], point[i, 1], start, end, pair))
    return largest


@inner
def span_holds(
    point: Floats, leave: Floats, arrive: Floats, low: int, high: int, target: float
) -> bool:
    """Whether `span_error` is within the target; it stops at the first node that is not."""
    start, end = point[low], point[high]
    pair = biarc(start, leave[low], end, arrive[high])
    if math.isnan(pair[0]):
        return False
    for i in range(high - 1, low, -1):
        if distance_to_biarc(point[i, 0], point[i, 1], start, end, pair) > target:
            return False
    return True


@inner
def arc_error(point: Floats, low: int, high: int, bulge: float) -> float:
    """The largest distance of the nodes between from the arc or line over nodes low..high."""
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    largest = 0.0
    for i in range(low + 1, high):
        off = distance_to_arc(point[i, 0], point[i, 1], ax, ay, bx, by, bulge)
        largest = max(largest, off)
    return largest
