"""Runs of chords that lie on one circle, along a chain of points.

A run grows from its first point by doubling and then bisection, so n points cost O(n log n); every
test of a run is a least-squares circle about the run's own middle (Kåsa's, which is linear:
minimise Σ (x² + y² − 2ax − 2by − c)²). `tests/oracles/recognise.py` explodes arcs and judges what
comes back.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.kernels.biarc import Floats, distance_to_arc
from camtool.kernels.compiled import inner, kernel

MIN_POINTS = 5
"""Points that an arc needs: four chords. Three always lie on a circle, four often do."""

MAX_TURN_RAD = math.radians(22.5) * (1.0 + 1e-3)
"""One chord of an arc turns by no more: polygons of fewer than sixteen sides stay polygons."""

MAX_LENGTH_RATIO = 1.5
"""The longest chord of an arc over its shortest one; the first and the last may be shorter."""

MIN_SWEEP_RAD = 0.02
"""Runs that turn by less in all stay chords."""

ROUGHNESS = 0.5
"""Points may lie off the circle by so many times the mean fourth difference of these distances.
Of noise it is 7 times the mean (√70 σ); of n points that are off smoothly, as another curve is,
about (3π/n)⁴ times the most."""

ROUGH_POINTS = 12
"""Fewer points than these do not tell noise from another curve: they must lie on the circle within
the noise that is known."""

MIN_SAGITTA_NOISES = 8.0
"""The sagitta of a run is at least so many times the noise, or the run is straight."""

FAIL, STRAIGHT, ARC = 0, 1, 2
Judgement = tuple[int, float, float, float, float]


@inner
def lengths_agree(points: Floats, low: int, high: int) -> bool:
    """Whether the chords low..high − 1 are alike; the first and the last may be shorter."""
    least, most = np.inf, 0.0
    for k in range(low, high):
        length = math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
        most = max(most, length)
        if low < k < high - 1:
            least = min(least, length)
    return most <= MAX_LENGTH_RATIO * least


@inner
def is_straight(points: Floats, low: int, high: int, noise: float) -> bool:
    """Whether the points lie within `noise` of the chord from the first to the last."""
    ux, uy = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    length = math.hypot(ux, uy)
    for k in range(low + 1, high):
        wx, wy = points[k, 0] - points[low, 0], points[k, 1] - points[low, 1]
        if abs(ux * wy - uy * wx) > noise * length:
            return False
    return length > 0.0


@inner
def circle_of(points: Floats, low: int, high: int) -> tuple[float, float, float]:
    """Centre and radius of the least-squares circle; an infinite radius for points on a line."""
    count = high - low + 1
    mx, my = 0.0, 0.0
    for k in range(low, high + 1):
        mx, my = mx + points[k, 0] / count, my + points[k, 1] / count
    uu, uv, vv, ru, rv = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(low, high + 1):
        u, v = points[k, 0] - mx, points[k, 1] - my
        square = u * u + v * v
        uu, uv, vv = uu + u * u, uv + u * v, vv + v * v
        ru, rv = ru + 0.5 * square * u, rv + 0.5 * square * v
    below = uu * vv - uv * uv
    if not below > 0.0:
        return mx, my, np.inf
    a, b = (ru * vv - rv * uv) / below, (rv * uu - ru * uv) / below
    return mx + a, my + b, math.sqrt(a * a + b * b + (uu + vv) / count)


@inner
def judge(points: Floats, low: int, high: int, noise: float, tolerance: float) -> Judgement:
    """FAIL, STRAIGHT or ARC for the points low..high; of an arc centre, radius, signed sweep."""
    if not lengths_agree(points, low, high):
        return FAIL, 0.0, 0.0, 0.0, 0.0
    if is_straight(points, low, high, noise):
        return STRAIGHT, 0.0, 0.0, 0.0, 0.0
    cx, cy, radius = circle_of(points, low, high)
    sweep, rough, largest = 0.0, 0.0, 0.0
    off = np.empty(high - low + 1)
    for k in range(low, high + 1):
        x, y = points[k, 0] - cx, points[k, 1] - cy
        off[k - low] = math.hypot(x, y) - radius
        largest = max(largest, abs(off[k - low]))
        if k < high:
            nx, ny = points[k + 1, 0] - cx, points[k + 1, 1] - cy
            turn = math.atan2(x * ny - y * nx, x * nx + y * ny)
            if abs(turn) > MAX_TURN_RAD or turn * sweep < 0.0:
                return FAIL, 0.0, 0.0, 0.0, 0.0
            sweep += turn
    if high - low + 1 >= ROUGH_POINTS:
        # Not at the ends: a point that no longer belongs to the arc would speak for itself.
        for k in range(3, high - low - 2):
            fourth = off[k - 2] - 4.0 * off[k - 1] + 6.0 * off[k] - 4.0 * off[k + 1] + off[k + 2]
            rough += abs(fourth) / (high - low - 5)
    if abs(sweep) > 2.0 * math.pi + MAX_TURN_RAD:
        return FAIL, 0.0, 0.0, 0.0, 0.0
    if not largest <= min(tolerance, max(noise, ROUGHNESS * rough)):
        return FAIL, 0.0, 0.0, 0.0, 0.0
    sagitta = radius * (1.0 - math.cos(0.5 * min(abs(sweep), math.pi)))
    if abs(sweep) < MIN_SWEEP_RAD or sagitta < MIN_SAGITTA_NOISES * max(noise, largest):
        return STRAIGHT, 0.0, 0.0, 0.0, 0.0
    return ARC, cx, cy, radius, sweep


@inner
def longest_run(points: Floats, low: int, noise: float, tolerance: float) -> tuple[int, Judgement]:
    """The last point of the longest run from `low`, and what it is; `low` for none."""
    best, beyond, size = low, len(points), MIN_POINTS - 1
    judgement = (FAIL, 0.0, 0.0, 0.0, 0.0)
    while best < len(points) - 1 and low + size < len(points):
        found = judge(points, low, low + size, noise, tolerance)
        if found[0] != FAIL:
            best, judgement = low + size, found
        elif size >= 2 * ROUGH_POINTS - 1:
            beyond = low + size
            break
        # A few points may fail by noise that more of them show to be noise.
        rest = len(points) - 1 - low
        doubled = 2 * size if size >= ROUGH_POINTS - 1 else max(2 * size, ROUGH_POINTS - 1)
        size = min(doubled, rest) if size < rest else size + 1
    while best > low and beyond - best > 1:
        high = (best + beyond) // 2
        found = judge(points, low, high, noise, tolerance)
        if found[0] == FAIL:
            beyond = high
        else:
            best, judgement = high, found
    return best, judgement


@kernel
def find_runs(points: Floats, noise: float, tolerance: float) -> Floats:
    """(r, 6) runs of chords on one circle: first and last point, centre, radius, signed sweep.

    A run that is straight so far is passed; the arc behind it begins within its last chords, and
    is extended backwards as far as it goes.
    """
    out = np.empty((len(points) // (MIN_POINTS - 1) + 1, 6))
    count, low, done = 0, 0, 0
    while low + MIN_POINTS <= len(points):
        high, found = longest_run(points, low, noise, tolerance)
        if found[0] != ARC:
            low = max(low + 1, high - MIN_POINTS + 1)
            continue
        while low > done:
            longer = judge(points, low - 1, high, noise, tolerance)
            if longer[0] != ARC:
                break
            low, found = low - 1, longer
        out[count, 0], out[count, 1] = low, high
        out[count, 2], out[count, 3], out[count, 4] = found[1], found[2], found[3]
        out[count, 5] = found[4]
        count += 1
        low = done = high
    return out[:count]


@kernel
def furthest_off(points: Floats, arcs: Floats) -> float:
    """The largest distance of points (n, 2) from a chain of arcs (m, 3)."""
    largest = 0.0
    for i in range(len(points)):
        nearest = np.inf
        for row in range(len(arcs) - 1):
            a, b = arcs[row], arcs[row + 1]
            off = distance_to_arc(points[i, 0], points[i, 1], a[0], a[1], b[0], b[1], a[2])
            nearest = min(nearest, off)
        largest = max(largest, nearest)
    return largest
