"""Spans of biarcs, arcs and lines as one chain of segments, and its distance from the curve.

Vertices are rows x, y, bulge; the last row is the end of the chain.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.kernels.biarc import Floats, Ints, distance_to_arc
from camtool.kernels.compiled import inner
from camtool.kernels.fit_limits import (
    FLAT_SHARE,
    MAX_LINES,
    MAX_RADIUS_MM,
    SAME_ARC_MM,
    SPAN_TURN_RAD,
    STRAIGHT_SAGITTA_MM,
)


@inner
def lines_for(ax: float, ay: float, bx: float, by: float, bulge: float, off: float) -> int:
    """How many lines stand for an arc that is too flat to be written; 0 when it stays an arc.

    sagitta = |bulge| · chord / 2, radius = chord (1 + b²) / (4 |b|) and each of n lines leaves the
    arc by sagitta / n².
    """
    chord = math.hypot(bx - ax, by - ay)
    sagitta = 0.5 * abs(bulge) * chord
    if sagitta <= STRAIGHT_SAGITTA_MM:
        return 1
    if chord * (1.0 + bulge * bulge) <= 4.0 * abs(bulge) * MAX_RADIUS_MM:
        return 0
    return int(min(math.ceil(math.sqrt(sagitta / off)), MAX_LINES))


@inner
def chain(point: Floats, ends: Ints, pairs: Floats, tolerance: float) -> tuple[Floats, Ints]:
    """Rows (n + 1, 3) of all spans and the number of the first row of each (s + 1,).

    Arcs that leave their chord by `STRAIGHT_SAGITTA_MM` or less, and flat ones, are lines.
    """
    spans = len(pairs)
    arcs = np.empty((2 * spans + 1, 3))
    owner = np.empty(2 * spans + 1, dtype=np.int64)
    count = 0
    for s in range(spans):
        k = ends[s]
        arcs[count, 0], arcs[count, 1], arcs[count, 2] = point[k, 0], point[k, 1], pairs[s, 2]
        owner[count] = s
        count += 1
        if not math.isnan(pairs[s, 0]):
            arcs[count, 0], arcs[count, 1], arcs[count, 2] = pairs[s, 0], pairs[s, 1], pairs[s, 3]
            owner[count] = s
            count += 1
    k = ends[spans]
    arcs[count, 0], arcs[count, 1], arcs[count, 2] = point[k, 0], point[k, 1], 0.0
    total = 0
    parts = np.empty(count, dtype=np.int64)
    for i in range(count):
        ax, ay, bulge = arcs[i, 0], arcs[i, 1], arcs[i, 2]
        bx, by = arcs[i + 1, 0], arcs[i + 1, 1]
        parts[i] = lines_for(ax, ay, bx, by, bulge, FLAT_SHARE * tolerance)
        total += max(parts[i], 1)
    rows = np.empty((total + 1, 3))
    first = np.zeros(spans + 1, dtype=np.int64)
    made = 0
    for i in range(count):
        ax, ay, bulge = arcs[i, 0], arcs[i, 1], arcs[i, 2]
        if i == 0 or owner[i] != owner[i - 1]:
            first[owner[i]] = made
        ux, uy = arcs[i + 1, 0] - ax, arcs[i + 1, 1] - ay
        for j in range(max(parts[i], 1)):
            # On a flat arc the point at the share h of the chord lies beside it by 2b·h(1 − h)·u.
            h = j / max(parts[i], 1)
            off = 2.0 * bulge * h * (1.0 - h)
            rows[made, 0], rows[made, 1] = ax + h * ux + off * uy, ay + h * uy - off * ux
            rows[made, 2] = bulge if parts[i] == 0 else 0.0
            made += 1
    rows[made, 0], rows[made, 1], rows[made, 2] = point[k, 0], point[k, 1], 0.0
    first[spans] = made
    return rows, first


@inner
def common_bulge(one: Floats, two: Floats, end: Floats) -> float:
    """The bulge of the one arc or line that both segments lie on, or NaN."""
    if one[2] * two[2] < 0.0 or (one[2] == 0.0) != (two[2] == 0.0):
        return np.nan
    sweep = 4.0 * (math.atan(one[2]) + math.atan(two[2]))
    if abs(sweep) > SPAN_TURN_RAD or (one[0] == end[0] and one[1] == end[1]):
        return np.nan
    bulge = min(max(math.tan(0.25 * sweep), -1.0), 1.0)
    for place in range(3):
        a, b = (one, two) if place == 0 else (two, end)
        # Halfway along a segment: sagitta = bulge · chord / 2; the joint itself comes third.
        half = 0.0 if place == 2 else 1.0
        x = a[0] + half * 0.5 * (b[0] - a[0] + a[2] * (b[1] - a[1]))
        y = a[1] + half * 0.5 * (b[1] - a[1] - a[2] * (b[0] - a[0]))
        if distance_to_arc(x, y, one[0], one[1], end[0], end[1], bulge) > SAME_ARC_MM:
            return np.nan
    return bulge


@inner
def joined(rows: Floats, size: float) -> tuple[Floats, Ints]:
    """Neighbours on one circle or line become one; also where each old segment is now.

    A segment no longer than `size` is none: its end takes the place of its begin.
    """
    out = np.empty((len(rows), 3))
    places = np.zeros(len(rows) - 1, dtype=np.int64)
    out[0, 0], out[0, 1], out[0, 2] = rows[0, 0], rows[0, 1], 0.0
    count = 1
    for i in range(len(rows) - 1):
        begin, end = out[count - 1], rows[i + 1]
        if math.hypot(end[0] - begin[0], end[1] - begin[1]) <= size:
            places[i] = max(count - 2, 0)
            continue
        begin[2] = rows[i, 2]
        if count > 1 and math.hypot(end[0] - out[count - 2, 0], end[1] - out[count - 2, 1]) > size:
            bulge = common_bulge(out[count - 2], begin, end)
            if not math.isnan(bulge):
                count -= 1
                out[count - 1, 2] = bulge
        places[i] = count - 1
        out[count, 0], out[count, 1], out[count, 2] = end[0], end[1], 0.0
        count += 1
    end = rows[len(rows) - 1]
    out[count - 1, 0], out[count - 1, 1], out[count - 1, 2] = end[0], end[1], 0.0
    return out[:count], places


@inner
def deviations(
    samples: Floats, owned: tuple[Ints, Ints], vertices: Floats, places: Ints
) -> Floats:
    """Distances (n,) of samples (n, 2) of the curve from the segments of their own span.

    There are equally many samples in each step between nodes, and the last one at the end. `owned`
    are two columns (spans + 1,): span s owns the nodes ends[s]..ends[s + 1] and the old segments
    first[s]..first[s + 1], which are now at `places`.
    """
    ends, first = owned
    each = (len(samples) - 1) // ends[-1]
    out = np.empty(len(samples))
    for s in range(len(ends) - 1):
        low, high = places[first[s]], places[first[s + 1] - 1]
        last = ends[s + 1] * each + (1 if s == len(ends) - 2 else 0)
        for i in range(ends[s] * each, last):
            nearest = np.inf
            for row in range(low, high + 1):
                a, b = vertices[row], vertices[row + 1]
                off = distance_to_arc(samples[i, 0], samples[i, 1], a[0], a[1], b[0], b[1], a[2])
                nearest = min(nearest, off)
            out[i] = nearest
    return out


@inner
def summary(samples: Floats, off: Floats) -> tuple[float, float, float]:
    """Largest deviation and rms, weighted by length, and length of the curve, mm.

    Between samples i and i + 1 the deviation peaks at or below the meeting of the lines through
    the two samples before and the two behind: it is concave on each side of a peak, and where the
    nearest arc changes it has an edge there.
    """
    squares, length = 0.0, 0.0
    largest = off[len(off) - 1]
    for i in range(len(off) - 1):
        step = math.hypot(samples[i + 1, 0] - samples[i, 0], samples[i + 1, 1] - samples[i, 1])
        squares += step * 0.5 * (off[i] * off[i] + off[i + 1] * off[i + 1])
        length += step
        largest = max(largest, off[i])
        if 0 < i < len(off) - 2:
            rise, fall = off[i] - off[i - 1], off[i + 1] - off[i + 2]
            if rise > 0.0 and fall > 0.0:
                share = min(max((off[i + 1] + fall - off[i]) / (rise + fall), 0.0), 1.0)
                largest = max(largest, min(off[i] + rise * share, off[i + 1] + fall))
    return largest, math.sqrt(squares / length) if length > 0.0 else 0.0, length
