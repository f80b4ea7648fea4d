"""The search for the longest arcs and biarcs along nodes on a curve.

The error of a biarc grows with the third power of its length, which tells how far to reach next;
bisection settles the rest. One arc or line in place of two is taken where the curve is one.
"""

from __future__ import annotations

import math

import numba
import numpy as np

from camtool.kernels.biarc import Bools, Floats, Ints, arc_error, biarc, half_angle, span_error
from camtool.kernels.fit_limits import MAX_RADIUS_MM, SINGLE_TURN_RAD, SPAN_TURN_RAD


@numba.njit(cache=True, error_model="numpy")
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


@numba.njit(cache=True, error_model="numpy")
def single_bulge(
    point: Floats, leave: Floats, arrive: Floats, low: int, high: int, target: float
) -> float:
    """The bulge of the one arc or line that stands for the nodes low..high; NaN for none.

    With α from the first tangent to the chord and β from the chord to the last one, an arc of
    sweep α + β leaves both tangents by |α − β| / 2.
    """
    ux, uy = point[high, 0] - point[low, 0], point[high, 1] - point[low, 1]
    first = 2.0 * math.atan(half_angle(leave[low, 0], leave[low, 1], ux, uy))
    second = 2.0 * math.atan(half_angle(ux, uy, arrive[high, 0], arrive[high, 1]))
    if not abs(first - second) <= 2.0 * SINGLE_TURN_RAD:
        return np.nan
    half = 0.5 * (first + second)
    if math.sqrt(ux * ux + uy * uy) > 2.0 * MAX_RADIUS_MM * abs(math.sin(half)):
        # Radius = chord / (2 sin(sweep/2)): too flat for an arc, so a line or nothing.
        level = max(abs(first), abs(second)) <= SINGLE_TURN_RAD
        return 0.0 if level and arc_error(point, low, high, 0.0) <= target else np.nan
    bulge = min(max(math.tan(0.5 * half), -1.0), 1.0)
    return bulge if arc_error(point, low, high, bulge) <= target else np.nan


@numba.njit(cache=True, error_model="numpy")
def longest_single(
    point: Floats,
    leave: Floats,
    arrive: Floats,
    low: int,
    furthest: int,
    biarc_end: int,
    target: float,
) -> tuple[int, float]:
    """End node and bulge of a long single arc or line from `low`; NaN when it does not reach half
    as far as the biarc to `biarc_end`: two arcs are no dearer then."""
    best = low + (biarc_end - low + 1) // 2
    bulge = single_bulge(point, leave, arrive, low, best, target)
    if math.isnan(bulge):
        return low, np.nan
    beyond, high = furthest + 1, biarc_end
    while beyond - best > 1:
        high = min(max(high, best + 1), beyond - 1)
        found = single_bulge(point, leave, arrive, low, high, target)
        if math.isnan(found):
            beyond = high
        else:
            best, bulge = high, found
        high = (best + beyond) // 2
    return best, bulge


@numba.njit(cache=True, error_model="numpy")
def turned_angles(leave: Floats, arrive: Floats) -> Floats:
    """(n,) rad: how far the curve has turned at each of n nodes, to either side."""
    out = np.zeros(len(leave))
    for i in range(1, len(leave)):
        cross = leave[i - 1, 0] * arrive[i, 1] - leave[i - 1, 1] * arrive[i, 0]
        dot = leave[i - 1, 0] * arrive[i, 0] + leave[i - 1, 1] * arrive[i, 1]
        out[i] = out[i - 1] + abs(math.atan2(cross, dot))
    return out


@numba.njit(cache=True, error_model="numpy")
def longest_spans(
    point: Floats, leave: Floats, arrive: Floats, corner: Bools, target: float
) -> tuple[Ints, Floats]:
    """Nodes (s + 1,) between the longest spans, and joint and bulges (s, 4) of each.

    `point`, `leave`, `arrive` (n, 2), `corner` (n,). A span of one arc or line has its bulge in
    the third column and NaN elsewhere. No span runs past a corner or turns by more than
    `SPAN_TURN_RAD`.
    """
    count = len(point)
    turned = turned_angles(leave, arrive)
    ends = np.zeros(count, dtype=np.int64)
    pairs = np.empty((count, 4))
    spans, low, reach, corner_at, furthest = 0, 0, count, 0, 0
    while low < count - 1:
        if corner_at <= low:
            corner_at = low + 1
            while not corner[corner_at]:
                corner_at += 1
        furthest = max(furthest, low + 1)
        while furthest < corner_at and turned[furthest + 1] - turned[low] <= SPAN_TURN_RAD:
            furthest += 1
        high = longest_span(point, leave, arrive, low, furthest, low + reach, target)
        best, bulge = longest_single(point, leave, arrive, low, furthest, high, target)
        pair = (np.nan, np.nan, bulge, np.nan)
        if math.isnan(bulge):
            pair = biarc(point[low], leave[low], point[high], arrive[high])
        else:
            high = best
        pairs[spans, 0], pairs[spans, 1], pairs[spans, 3] = pair[0], pair[1], pair[3]
        pairs[spans, 2] = 0.0 if math.isnan(pair[2]) else pair[2]
        spans += 1
        ends[spans] = high
        reach, low = high - low, high
    return ends[: spans + 1], pairs[:spans]
