"""Kept slices followed to loops, and loops written down as clean vertices.

The twins are in tests/oracles/offset_stages.py.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel
from camtool.kernels.offset_curves import SWEEP, TX, TY, Floats
from camtool.kernels.offset_nodes import grouped

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

U_TURN_EPS_RAD = 1e-3
"""A turn at a node this near to a full right turn is taken as a full left one."""


@kernel
def traced(
    elements: Floats, element: Ints, span: Floats, ends: tuple[Ints, Ints, int]
) -> tuple[Ints, Ints]:
    """Rows (R,) of the slices of all loops, loop by loop, and where each begins (L + 1,).

    Slice i runs on row element[i] from the fraction span[i, 0] to span[i, 1]; `ends` holds the
    nodes (S,) that each slice runs from and to, and how many nodes there are. No loop passes a
    node twice. Where several slices leave a node, the leftmost one is taken.
    """
    from_node, to_node, count = ends
    leaving, first = grouped(from_node, count)
    unused = np.ones(len(element), np.bool_)
    seen = np.empty(count, np.int64)
    for node in range(count):
        seen[node] = -1
    path, length = np.empty(len(element), np.int64), 0
    rows, begins = np.empty(len(element), np.int64), np.zeros(len(element) + 1, np.int64)
    loops = 0
    for start in range(len(element)):
        if not unused[start]:
            continue
        unused[start] = False
        path[0], length = start, 1
        seen[from_node[start]] = 0
        while length > 0:
            last = path[length - 1]
            node = to_node[last]
            if seen[node] >= 0:
                low = seen[node]
                begins[loops + 1] = begins[loops] + length - low
                for k in range(low, length):
                    rows[begins[loops] + k - low] = path[k]
                    # This node too: what is left of the path may leave it once more.
                    seen[from_node[path[k]]] = -1
                loops += 1
                length = low
                continue
            ways = leaving[first[node] : first[node + 1]]
            chosen = _leftmost(elements, element, span, (last, unused), ways)
            if chosen < 0:
                seen[from_node[last]] = -1
                length -= 1
                continue
            seen[node] = length
            path[length] = chosen
            length += 1
            unused[chosen] = False
    return rows[: begins[loops]], begins[: loops + 1]


@inner
def _leftmost(
    elements: Floats, element: Ints, span: Floats, came: tuple[int, Bools], ways: Ints
) -> int:
    """The unused one of the slices `ways` that turns left the most; turning right back is left
    back. −1 when there is none."""
    last, unused = came
    best, most, others = -1, -math.inf, 0
    for way in ways:
        if unused[way]:
            best = way if others == 0 else best
            others += 1
    if others < 2:
        return best
    ax, ay = _tangent(elements, element[last], span[last, 1])
    for way in ways:
        if unused[way]:
            bx, by = _tangent(elements, element[way], span[way, 0])
            turn = math.atan2(ax * by - ay * bx, ax * bx + ay * by)
            if turn <= U_TURN_EPS_RAD - math.pi:
                turn = math.pi
            if turn > most:
                best, most = way, turn
    return best


@inner
def _tangent(elements: Floats, i: int, t: float) -> tuple[float, float]:
    turn = t * elements[i, SWEEP]
    cosine, sine = math.cos(turn), math.sin(turn)
    tx, ty = elements[i, TX], elements[i, TY]
    return cosine * tx - sine * ty, cosine * ty + sine * tx


@kernel
def written(
    slices: tuple[Ints, Floats, Ints, Ints],
    nodes: Floats,
    sweeps: Floats,
    runs: tuple[Ints, Ints, Bools],
    eps: float,
) -> tuple[Floats, Ints]:
    """Vertices (V, 3) of runs of slices that follow each other, and where each begins (L + 1,).

    `slices` are the element, span and both nodes (S,) of each slice, `sweeps` those of the
    elements. `runs` are the rows of all runs, where each begins, and whether it is closed. Slices
    of one element become one again; segments up to `eps` go. A run of which nothing is left has
    no vertices.
    """
    element, span, from_node, to_node = slices
    rows, begins, closed = runs
    vertices = np.empty((len(rows) + len(closed), 3))
    offsets = np.zeros(len(closed) + 1, np.int64)
    for run in range(len(closed)):
        ways = rows[begins[run] : begins[run + 1]]
        first = _first(element, span, ways) if closed[run] else 0
        low = count = offsets[run]
        for k in range(len(ways)):
            row, last = ways[(first + k) % len(ways)], ways[(first + k - 1) % len(ways)]
            if k == 0 or not _goes_on(element, span, last, row):
                vertices[count, 0] = nodes[from_node[row], 0]
                vertices[count, 1] = nodes[from_node[row], 1]
                begin = span[row, 0]
                count += 1
            sweep = sweeps[element[row]] * (span[row, 1] - begin)
            vertices[count - 1, 2] = math.tan(0.25 * sweep)
        if not closed[run]:
            vertices[count, 0] = nodes[to_node[ways[-1]], 0]
            vertices[count, 1] = nodes[to_node[ways[-1]], 1]
            vertices[count, 2] = 0.0
            count += 1
        offsets[run + 1] = low + _cleaned(vertices[low:count], closed[run], eps)
    return vertices[: offsets[-1]], offsets


@inner
def _goes_on(element: Ints, span: Floats, last: int, row: int) -> bool:
    """Whether a slice goes on along the element of the one before it."""
    return bool(element[last] == element[row] and span[row, 0] >= span[last, 1])


@inner
def _first(element: Ints, span: Floats, ways: Ints) -> int:
    """Where a closed run may begin: not within an element."""
    for k in range(len(ways)):
        if not _goes_on(element, span, ways[k - 1], ways[k]):
            return k
    return 0


@inner
def _cleaned(vertices: Floats, closed: bool, eps: float) -> int:
    """How many vertices are left, the first ones, when segments up to `eps` have gone.

    Each shrinks to its middle; the ends of an open path stay. 0 when nothing is left.
    """
    count = left = len(vertices)
    after, before = np.empty(count, np.int64), np.empty(count, np.int64)
    stack, height = np.empty(3 * count, np.int64), count
    for row in range(count):
        after[row], before[row], stack[row] = row + 1, row - 1, count - 1 - row
    after[-1], before[0] = (0, count - 1) if closed else (-1, -1)
    there = np.ones(count, np.bool_)
    while height > 0:
        height -= 1
        row = stack[height]
        following, earlier = after[row], before[row]
        if not there[row] or following < 0 or _length(vertices, row, following) > eps:
            continue
        if left <= 2:
            return 0
        # The first and the last vertex of an open path have none before and none after them.
        if after[following] >= 0:
            part = 0.5 if earlier >= 0 else 0.0
            for k in range(2):
                vertices[following, k] += (1.0 - part) * (
                    vertices[row, k] - vertices[following, k]
                )
        there[row] = False
        left -= 1
        before[following] = earlier
        stack[height] = following
        height += 1
        if earlier >= 0:
            after[earlier] = following
            stack[height] = earlier
            height += 1
    place = 0
    for row in range(count):
        if there[row]:
            for k in range(3):
                vertices[place, k] = vertices[row, k]
            place += 1
    return left


@inner
def _length(vertices: Floats, one: int, other: int) -> float:
    return math.hypot(vertices[one, 0] - vertices[other, 0], vertices[one, 1] - vertices[other, 1])
