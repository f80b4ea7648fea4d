"""Biarcs, distances to arcs, and the search for the longest biarcs along nodes on a curve.

What makes it exact: no centre is ever formed, so an arc may be as flat as it likes; for a bulge of
0 each formula becomes the one of the straight line. `tests/oracles/arcs.py` is the twin.
"""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@numba.njit(cache=True)
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
    length = math.hypot(ux, uy)
    if length == 0.0 or forward < 0.0 or behind > 0.0:
        return min(math.hypot(wx, wy), math.hypot(vx, vy))
    power = bulge * (wx * vx + wy * vy) - 0.5 * rest * (wy * ux - wx * uy)
    qx = bulge * (wx - 0.5 * ux) + 0.25 * rest * uy
    qy = bulge * (wy - 0.5 * uy) - 0.25 * rest * ux
    return abs(power) / (math.hypot(qx, qy) + 0.25 * length * (1.0 + bulge * bulge))


@numba.njit(cache=True)
def half_angle(ax: float, ay: float, bx: float, by: float) -> float:
    """tan(α/2) = sin α / (1 + cos α) for the angle α from a to b; NaN when |α| > 90°.

    An arc of sweep s leaves the direction of its chord by s/2, so its bulge tan(s/4) is tan(α/2)
    with α between tangent and chord.
    """
    cosine = ax * bx + ay * by
    below = math.hypot(ax, ay) * math.hypot(bx, by) + cosine
    if below <= 0.0:
        return np.nan
    bulge = (ax * by - ay * bx) / below
    if abs(bulge) > 1.0 + 1e-12:
        return np.nan
    return min(max(bulge, -1.0), 1.0)


@numba.njit(cache=True)
def biarc(
    start: Floats, leave: Floats, end: Floats, arrive: Floats
) -> tuple[float, float, float, float]:
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


@numba.njit(cache=True)
def distance_to_biarc(
    p: Floats, start: Floats, end: Floats, pair: tuple[float, float, float, float]
) -> float:
    """Distance from p to the nearer of both arcs; infinite when there is no biarc."""
    jx, jy, first, second = pair
    if math.isnan(jx):
        return np.inf
    one = distance_to_arc(p[0], p[1], start[0], start[1], jx, jy, first)
    two = distance_to_arc(p[0], p[1], jx, jy, end[0], end[1], second)
    return min(one, two)


@numba.njit(cache=True)
def arc_distances(points: Floats, start: Floats, end: Floats, bulge: Floats) -> Floats:
    """Distances (n,) from each point (n, 2) to its own arc: start, end (n, 2), bulge (n,)."""
    out = np.empty(len(points))
    for i in range(len(points)):
        out[i] = distance_to_arc(
            points[i, 0], points[i, 1], start[i, 0], start[i, 1], end[i, 0], end[i, 1], bulge[i]
        )
    return out


@numba.njit(cache=True)
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
            out[i] = max(out[i], distance_to_biarc(probes[j, i], point[a], point[b], pair))
    return out


@numba.njit(cache=True)
def span_error(point: Floats, leave: Floats, arrive: Floats, low: int, high: int) -> float:
    """The largest distance of the nodes between from the biarc over nodes low..high."""
    pair = biarc(point[low], leave[low], point[high], arrive[high])
    largest = np.inf if math.isnan(pair[0]) else 0.0
    for i in range(low + 1, high):
        largest = max(largest, distance_to_biarc(point[i], point[low], point[high], pair))
    return largest


@numba.njit(cache=True)
def longest_span(
    point: Floats,
    leave: Floats,
    arrive: Floats,
    low: int,
    furthest: int,
    guess: int,
    target: float,
) -> int:
    """The end node of the longest biarc from node `low` whose error is within `target`.

    error ∝ length³   ⇒   the length that fits is about length · (target / error)^(1/3).
    That rule leads for a few tries, bisection then; at least one step is taken.
    """
    best, beyond, high, tries = low + 1, furthest + 1, guess, 0
    while beyond - best > 1:
        high = min(max(high, best + 1), beyond - 1)
        error = span_error(point, leave, arrive, low, high)
        ratio = 4.0 if error == 0.0 else min(4.0, (target / error) ** (1.0 / 3.0))
        reach = low + int(0.98 * ratio * (high - low))
        if error <= target:
            best = high
        else:
            beyond = high
        tries += 1
        high = reach if tries <= 4 and ratio > 0.0 else (best + beyond) // 2
    return best


@numba.njit(cache=True)
def longest_spans(
    point: Floats,
    leave: Floats,
    arrive: Floats,
    corner: Bools,
    turned: Floats,
    target: float,
    most_turn: float,
) -> tuple[Ints, Floats]:
    """Nodes (s + 1,) between the longest biarcs, and joint and bulges (s, 4) of each (NaN: none).

    `point`, `leave`, `arrive` (n, 2), `corner` (n,) and the turning summed up, `turned` (n,) rad.
    No biarc runs past a corner or turns by more than `most_turn`.
    """
    count = len(point)
    ends = np.zeros(count, dtype=np.int64)
    pairs = np.empty((count, 4))
    spans, low, reach, corner_at = 0, 0, count, 0
    while low < count - 1:
        if corner_at <= low:
            corner_at = low + 1
            while not corner[corner_at]:
                corner_at += 1
        furthest = np.searchsorted(turned, turned[low] + most_turn, side="right") - 1
        furthest = min(corner_at, max(furthest, low + 1))
        high = longest_span(point, leave, arrive, low, furthest, low + reach, target)
        pairs[spans] = biarc(point[low], leave[low], point[high], arrive[high])
        spans += 1
        ends[spans] = high
        reach, low = high - low, high
    return ends[: spans + 1], pairs[:spans]
