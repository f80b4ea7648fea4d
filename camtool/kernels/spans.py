"""The search for the longest arcs and biarcs along nodes on a curve.

The error of a biarc grows with the third power of its length, which tells how far to reach next;
bisection settles the rest. One arc or line in place of two is taken where the curve is one.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.kernels.biarc import (
    Bools,
    Floats,
    Ints,
    arc_error,
    biarc,
    half_angle,
    span_error,
    span_holds,
)
from camtool.kernels.compiled import inner
from camtool.kernels.fit_limits import CANDIDATES, MAX_RADIUS_MM, SINGLE_TURN_RAD, SPAN_TURN_RAD


@inner
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


@inner
def single_bulge(
    point: Floats, leave: Floats, arrive: Floats, low: int, high: int, target: float
) -> float:
    """The bulge of the one arc or line that stands for the nodes low..high; NaN for none.

    With α from the first tangent to the chord and β from the chord to the last one, an arc of
    sweep α + β leaves both tangents by |α − β| / 2.
    """
    ux, uy = point[high, 0] - point[low, 0], point[high, 1] - point[low, 1]
    # |sin α − sin β| ≤ |α − β|: most nodes are told here, without a root.
    askew = (leave[low, 0] + arrive[high, 0]) * uy - (leave[low, 1] + arrive[high, 1]) * ux
    if askew * askew > 4.0 * SINGLE_TURN_RAD * SINGLE_TURN_RAD * (ux * ux + uy * uy):
        return np.nan
    first = half_angle(leave[low, 0], leave[low, 1], ux, uy)
    second = half_angle(ux, uy, arrive[high, 0], arrive[high, 1])
    first, second = 2.0 * math.atan(first), 2.0 * math.atan(second)
    if not abs(first - second) <= 2.0 * SINGLE_TURN_RAD:
        return np.nan
    half = 0.5 * (first + second)
    if math.sqrt(ux * ux + uy * uy) > 2.0 * MAX_RADIUS_MM * abs(math.sin(half)):
        # Radius = chord / (2 sin(sweep/2)): too flat for an arc, so a line or nothing.
        level = max(abs(first), abs(second)) <= SINGLE_TURN_RAD
        return 0.0 if level and arc_error(point, low, high, 0.0) <= target else np.nan
    bulge = min(max(math.tan(0.5 * half), -1.0), 1.0)
    return bulge if arc_error(point, low, high, bulge) <= target else np.nan


@inner
def longest_single(
    nodes: tuple[Floats, Floats, Floats],
    low: int,
    within: tuple[int, int],
    guess: int,
    target: float,
) -> tuple[int, float]:
    """End node and bulge of the longest single arc or line from `low` that ends after within[0]
    and not after within[1]; NaN when there is none.

    Tangents may suit far off and not before (about an axis of symmetry), so all nodes are tried,
    from the far end of a window of 2 · `guess` nodes that grows as long as its end is reached.
    """
    point, leave, arrive = nodes
    beyond, best, bulge = within[0], within[0], np.nan
    while best == beyond and beyond < within[1]:
        beyond, least = min(max(low + 2 * guess, 2 * beyond - low), within[1]), beyond
        for high in range(beyond, least, -1):
            found = single_bulge(point, leave, arrive, low, high, target)
            if not math.isnan(found):
                best, bulge = high, found
                break
        if beyond == least:
            break
    return best, bulge


@inner
def furthest_nodes(leave: Floats, arrive: Floats, corner: Bools) -> Ints:
    """(n,) the last node that a span from each node may reach: the next corner, or where the curve
    has turned by `SPAN_TURN_RAD`, to either side."""
    count = len(leave)
    turned = np.zeros(count)
    for i in range(1, count):
        cross = leave[i - 1, 0] * arrive[i, 1] - leave[i - 1, 1] * arrive[i, 0]
        dot = leave[i - 1, 0] * arrive[i, 0] + leave[i - 1, 1] * arrive[i, 1]
        turned[i] = turned[i - 1] + abs(math.atan2(cross, dot))
    out = np.zeros(count, dtype=np.int64)
    last = 0
    for i in range(count - 1):
        last = max(last, i + 1)
        while not corner[last] and turned[last + 1] - turned[i] <= SPAN_TURN_RAD:
            last += 1
        out[i] = last
    return out


@inner
def furthest_state(
    nodes: tuple[Floats, Floats, Floats],
    limit: Ints,
    states: Ints,
    now: int,
    guess: int,
    target: float,
) -> tuple[int, int, float]:
    """The furthest node at the price that begins at row `now` of `states` (node −1: none), the row
    whence it is reached, and the bulge of the single arc or line that does it (NaN: a biarc)."""
    point, leave, arrive = nodes
    best, whence, bulge = states[now - CANDIDATES], now - CANDIDATES, np.nan
    for row in range(max(now - 2 * CANDIDATES, 0), now):
        low = states[row]
        if low < 0 or limit[low] <= best:
            continue
        if row >= now - CANDIDATES:
            high, found = longest_single(nodes, low, (best, limit[low]), guess, target)
            if high > best:
                best, whence, bulge = high, row, found
            continue
        first = row == now - 2 * CANDIDATES
        if first or span_holds(point, leave, arrive, low, best + 1, target):
            begin = low + guess if first else best + 2
            high = longest_span(point, leave, arrive, low, limit[low], begin, target)
            if high > best:
                best, whence, bulge = high, row, np.nan
    return best, whence, bulge


@inner
def longest_spans(
    point: Floats, leave: Floats, arrive: Floats, corner: Bools, target: float
) -> tuple[Ints, Floats]:
    """Nodes (s + 1,) between the spans of a chain of few arcs; joint and bulges (s, 4) of each.

    `point`, `leave`, `arrive` (n, 2), `corner` (n,). A span of one arc or line has its bulge in
    the third column and NaN elsewhere. No span runs past a corner or turns by more than
    `SPAN_TURN_RAD`.

    Price by price (1, 2, 3 … arcs) the furthest node is found that one arc leads to from a node of
    the price before, or a biarc from two prices before. A few nodes short of it are kept as well:
    a span that takes a sharp tip in its middle may have to begin there.
    """
    count = len(point)
    limit = furthest_nodes(leave, arrive, corner)
    states = np.zeros(CANDIDATES * (2 * count + 2), dtype=np.int64)
    whence = np.zeros(len(states), dtype=np.int64)
    bulges = np.zeros(len(states))
    for row in range(1, len(states)):
        states[row] = -1
    now, guess = 0, count
    while states[now] < count - 1:
        now += CANDIDATES
        best, row, bulge = furthest_state(
            (point, leave, arrive), limit, states, now, guess, target
        )
        before, low, guess = states[now - CANDIDATES], states[row], best - states[row]
        for m in range(CANDIDATES):
            place = best - m * (best - before) // CANDIDATES
            if m > 0:
                if place <= before or place == states[now + m - 1]:
                    continue
                if not math.isnan(bulge):
                    bulge = single_bulge(point, leave, arrive, low, place, target)
                    if math.isnan(bulge):
                        break
                elif not span_holds(point, leave, arrive, low, place, target):
                    continue
            states[now + m], whence[now + m], bulges[now + m] = place, row, bulge
    spans, row = 0, now
    while row > 0:
        spans += states[row] > states[whence[row]]
        row = whence[row]
    ends = np.zeros(spans + 1, dtype=np.int64)
    pairs = np.empty((spans, 4))
    row = now
    while row > 0:
        low, high, bulge = states[whence[row]], states[row], bulges[row]
        row = whence[row]
        if low == high:
            continue
        pair = (np.nan, np.nan, bulge, np.nan)
        if math.isnan(bulge):
            pair = biarc(point[low], leave[low], point[high], arrive[high])
        spans -= 1
        pairs[spans, 0], pairs[spans, 1], pairs[spans, 3] = pair[0], pair[1], pair[3]
        pairs[spans, 2] = 0.0 if math.isnan(pair[2]) else pair[2]
        ends[spans + 1] = high
    return ends, pairs
