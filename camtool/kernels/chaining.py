"""Pairs of near ends, which of them are joined, and the chains that the joints make.

The two ends of path i are 2i (its start) and 2i + 1 (its end), so `end ^ 1` is the other end of
the same path. What makes it exact: nothing is rounded here but the cells of a grid, and cells are
only asked for neighbours; distances are compared as they are. `tests/oracles/chaining.py` is the
twin.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]


@kernel
def near_pairs(cells: Ints, points: Floats, reach: float, most: int) -> tuple[Ints, Ints]:
    """Rows (J,), (J,) of all points (E, 2) within `reach` of each other, each pair once.

    `cells` (E, 3): group, column and row of the grid cell of each point, `reach` wide, sorted.
    No point gets more than `most` pairs with points after it: that bounds time and memory.
    """
    total = _pairs(cells, points, reach, most, np.empty(0, np.int64), np.empty(0, np.int64))
    one, other = np.empty(total, np.int64), np.empty(total, np.int64)
    _pairs(cells, points, reach, most, one, other)
    return one, other


@inner
def _pairs(cells: Ints, points: Floats, reach: float, most: int, one: Ints, other: Ints) -> int:
    """Counts the pairs, and writes them when there is room for them.

    Beside a point lie its own cell and the one above, which follow it in the sorted list, and
    three cells of the next column, whose beginning only moves forward.
    """
    count, low, number = 0, 0, len(points)
    for i in range(number):
        group, column, row = cells[i, 0], cells[i, 1], cells[i, 2]
        found = 0
        while low < number and _before(cells, low, group, column + 1, row - 1):
            low += 1
        for after in range(2):
            j = i + 1 if after == 0 else max(low, i + 1)
            while (
                j < number
                and found < most
                and cells[j, 0] == group
                and cells[j, 1] == column + after
                and cells[j, 2] <= row + 1
            ):
                if math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]) <= reach:
                    if len(one) > 0:
                        one[count], other[count] = i, j
                    count += 1
                    found += 1
                j += 1
    return count


@inner
def _before(cells: Ints, i: int, group: int, column: int, row: int) -> bool:
    if cells[i, 0] != group:
        return bool(cells[i, 0] < group)
    if cells[i, 1] != column:
        return bool(cells[i, 1] < column)
    return bool(cells[i, 2] < row)


@inner
def top(above: Ints, item: int) -> int:
    """The root of an item's set (union-find with path halving)."""
    while above[item] != item:
        above[item] = above[above[item]]
        item = above[item]
    return item


@kernel
def clusters(count: int, one: Ints, other: Ints) -> Ints:
    """(count,) the least end of all ends that pairs connect with each end."""
    above = np.arange(count)
    for k in range(len(one)):
        a, b = top(above, one[k]), top(above, other[k])
        if a < b:
            above[b] = a
        elif b < a:
            above[a] = b
    for i in range(count):
        above[i] = top(above, i)
    return above


@kernel
def join(one: Ints, other: Ints, mates: Ints, above: Ints, segments: Ints, arcs: Ints) -> int:
    """Joins pairs of free ends in their order into `mates`; how many.

    `above` (paths), `segments` and `arcs` (of each set of joined paths) are updated. A ring
    around nothing is refused: two lines are one line and its double.
    """
    joined = 0
    for k in range(len(one)):
        a, b = one[k], other[k]
        if mates[a] >= 0 or mates[b] >= 0:
            continue
        s, t = top(above, a // 2), top(above, b // 2)
        if s == t:
            if not encloses(segments[s], arcs[s]):
                continue
        else:
            above[t] = s
            segments[s] += segments[t]
            arcs[s] += arcs[t]
        mates[a], mates[b] = b, a
        joined += 1
    return joined


@inner
def encloses(segments: int, arcs: int) -> bool:
    """False for a ring of so few segments that nothing lies inside."""
    return segments > 2 or (segments == 2 and arcs > 0)


@kernel
def walk(mates: Ints, wanted: Bools) -> tuple[Ints, Ints, Bools]:
    """The chains of the wanted paths, each begun at its first path, which is not turned.

    Returns the ends by which the paths are entered, in the order of travel, where each chain
    begins in them (C + 1,), and which chains are rings (C,).
    """
    count = len(wanted)
    entries, begins = np.empty(count, np.int64), np.empty(count + 1, np.int64)
    rings, seen = np.zeros(count, np.bool_), ~wanted
    size, chains = 0, 0
    for index in range(count):
        if seen[index]:
            continue
        begins[chains] = size
        end = first_end(mates, 2 * index)
        rings[chains] = end == 2 * index and mates[end] >= 0
        start = end
        while end >= 0:
            entries[size] = end
            seen[end // 2] = True
            size += 1
            end = mates[end ^ 1]
            if end == start:
                break
        chains += 1
    begins[chains] = size
    return entries[:size], begins[: chains + 1], rings[:chains]


@inner
def first_end(mates: Ints, end: int) -> int:
    """The free end at which the chain that enters a path by `end` begins, `end` for a ring."""
    start = end
    while mates[end] >= 0:
        end = mates[end] ^ 1
        if end == start:
            break
    return end


@kernel
def split_loops(
    starts: Ints, mates: Ints, node: Ints, points: Floats, reach: float, weights: Ints
) -> int:
    """Rings that pass a node twice become two rings there; returns how many were split off.

    Each ring is walked from the end given in `starts`. `node` (ends,) is −1 where only two ends
    meet; `weights` (paths, 2) are segments and arcs. What has been walked since a node was passed
    before is a loop: it is closed there, and the rest goes on without it, as long as the ends
    that then meet lie within `reach`.
    """
    where = np.full(len(mates), -1, np.int64)
    stack = np.empty(len(mates) // 2 + 1, np.int64)
    until = np.zeros((len(stack) + 1, 2), np.int64)
    made = 0
    for start in starts:
        rest = _ring_weight(start, mates, weights)
        last = mates[start]
        height, end, done = 0, start, False
        while not done:
            label = node[end]
            if label >= 0 and where[label] >= 0:
                k = where[label]
                loop = until[height] - until[k]
                begin, close = stack[k], stack[height - 1] ^ 1
                before = last if k == 0 else stack[k - 1] ^ 1
                near = (
                    _apart(points, begin, close) <= reach and _apart(points, before, end) <= reach
                )
                if (
                    near
                    and encloses(loop[0], loop[1])
                    and encloses(rest[0] - loop[0], rest[1] - loop[1])
                ):
                    mates[begin], mates[close] = close, begin
                    mates[before], mates[end] = end, before
                    rest = rest - loop
                    made += 1
                    _forget(stack[k:height], node, where, k)
                    height = k
            stack[height] = end
            until[height + 1] = until[height] + weights[end // 2]
            if label >= 0:
                where[label] = height
            height += 1
            done = end ^ 1 == last
            end = mates[end ^ 1]
        _forget(stack[:height], node, where, 0)
    return made


@inner
def _ring_weight(start: int, mates: Ints, weights: Ints) -> Ints:
    """Segments and arcs of a whole ring."""
    total: Ints = weights[start // 2].copy()
    end = mates[start ^ 1]
    while end != start:
        total += weights[end // 2]
        end = mates[end ^ 1]
    return total


@inner
def _forget(entries: Ints, node: Ints, where: Ints, begin: int) -> None:
    """Takes these entries, the first of which stands at `begin`, out of `where` they stand."""
    for m in range(len(entries)):
        label = node[entries[m]]
        if label >= 0 and where[label] == begin + m:
            where[label] = -1


@inner
def _apart(points: Floats, one: int, other: int) -> float:
    return math.hypot(points[one, 0] - points[other, 0], points[one, 1] - points[other, 1])
