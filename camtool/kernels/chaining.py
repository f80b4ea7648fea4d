"""Which of many ends, points and boxes are near each other, and the chains that ends make.

Compiled, because each of many is compared with those beside it; C types stand in the .pxd beside
this file. What each part does is said above it.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.arrays import Bools, Floats, Indices, Ints

# Pairs of near ends, which of them are joined, and the chains that the joints make.
#
# The two ends of path i are 2i (its start) and 2i + 1 (its end), so `end ^ 1` is the other end of
# the same path. What makes it exact: nothing is rounded here but the cells of a grid, and cells
# are only asked for neighbours; distances are compared as they are. `tests/oracles/chaining.py` is
# the twin.


def near_pairs(cells: Ints, points: Floats, reach: float, most: int) -> tuple[Ints, Ints]:
    """Rows (J,), (J,) of all points (E, 2) within `reach` of each other, each pair once.

    `cells` (E, 3): group, column and row of the grid cell of each point, `reach` wide, sorted.
    No point gets more than `most` pairs with points after it: that bounds time and memory.
    """
    none = np.empty(0, np.int64)
    total = _pairs(cells, points, reach, most, none, none)
    one, other = np.empty(total, np.int64), np.empty(total, np.int64)
    _pairs(cells, points, reach, most, one, other)
    return np.asarray(one), np.asarray(other)


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


def _before(cells: Ints, i: int, group: int, column: int, row: int) -> bool:
    if cells[i, 0] != group:
        return bool(cells[i, 0] < group)
    if cells[i, 1] != column:
        return bool(cells[i, 1] < column)
    return bool(cells[i, 2] < row)


def top(above: Ints, item: int) -> int:
    """The root of an item's set (union-find with path halving)."""
    while above[item] != item:
        above[item] = above[above[item]]
        item = above[item]
    return item


def clusters(count: int, one: Ints, other: Ints) -> Ints:
    """(count,) the least end of all ends that pairs connect with each end."""
    above = np.arange(count, dtype=np.int64)
    for k in range(len(one)):
        a, b = top(above, one[k]), top(above, other[k])
        if a < b:
            above[b] = a
        elif b < a:
            above[a] = b
    for i in range(count):
        above[i] = top(above, i)
    return np.asarray(above)


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


def encloses(segments: int, arcs: int) -> bool:
    """False for a ring of so few segments that nothing lies inside."""
    return segments > 2 or (segments == 2 and arcs > 0)


def walk(mates: Ints, wanted: Bools) -> tuple[Ints, Ints, Bools]:
    """The chains of the wanted paths, each begun at its first path, which is not turned.

    Returns the ends by which the paths are entered, in the order of travel, where each chain
    begins in them (C + 1,), and which chains are rings (C,).
    """
    count = len(wanted)
    entries, begins = np.empty(count, np.int64), np.empty(count + 1, np.int64)
    rings, seen = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    size, chains = 0, 0
    for index in range(count):
        if seen[index] or not wanted[index]:
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
    found = np.asarray(rings[:chains]).view(np.bool_)
    return np.asarray(entries[:size]), np.asarray(begins[: chains + 1]), found


def first_end(mates: Ints, end: int) -> int:
    """The free end at which the chain that enters a path by `end` begins, `end` for a ring."""
    start = end
    while mates[end] >= 0:
        end = mates[end] ^ 1
        if end == start:
            break
    return end


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
    for index in range(len(starts)):
        start = starts[index]
        segments, arcs = _ring_weight(start, mates, weights)
        last = mates[start]
        height, end, done = 0, start, False
        while not done:
            label = node[end]
            if label >= 0 and where[label] >= 0:
                k = where[label]
                less, fewer = until[height, 0] - until[k, 0], until[height, 1] - until[k, 1]
                begin, close = stack[k], stack[height - 1] ^ 1
                before = last if k == 0 else stack[k - 1] ^ 1
                near = (
                    _apart(points, begin, close) <= reach and _apart(points, before, end) <= reach
                )
                if near and encloses(less, fewer) and encloses(segments - less, arcs - fewer):
                    mates[begin], mates[close] = close, begin
                    mates[before], mates[end] = end, before
                    segments, arcs = segments - less, arcs - fewer
                    made += 1
                    _forget(stack, k, height, node, where)
                    height = k
            stack[height] = end
            for m in range(2):
                until[height + 1, m] = until[height, m] + weights[end // 2, m]
            if label >= 0:
                where[label] = height
            height += 1
            done = end ^ 1 == last
            end = mates[end ^ 1]
        _forget(stack, 0, height, node, where)
    return made


def _ring_weight(start: int, mates: Ints, weights: Ints) -> tuple[int, int]:
    """Segments and arcs of a whole ring."""
    segments, arcs = weights[start // 2, 0], weights[start // 2, 1]
    end = mates[start ^ 1]
    while end != start:
        segments += weights[end // 2, 0]
        arcs += weights[end // 2, 1]
        end = mates[end ^ 1]
    return segments, arcs


def _forget(entries: Ints, low: int, high: int, node: Ints, where: Ints) -> None:
    """Takes the entries low … high − 1 out of `where` they stand."""
    for m in range(low, high):
        label = node[entries[m]]
        if label >= 0 and where[label] == m:
            where[label] = -1


def _apart(points: Floats, one: int, other: int) -> float:
    return math.hypot(points[one, 0] - points[other, 0], points[one, 1] - points[other, 1])


# The nearest other point of each point, on a grid whose cells are looked at ring by ring.
#
# What makes it exact: after ring k of cells around a point's own, every point nearer than k cells
# has been seen. `tests/oracles/chaining.py` is the twin.


def nearest_others(
    cells: Ints, points: Floats, size: float, least: float, reach: float
) -> tuple[Ints, Floats]:
    """For each point (P, 2) the row of the nearest one farther than `least`, and its distance.

    `cells` (P, 2): column and row of the grid cell of each point, `size` wide, sorted. A point
    with none within `reach` gets −1. Equal distances go to the first row.
    """
    count = len(points)
    nearest = np.full(count, -1, np.int64)
    distance = np.full(count, math.inf)
    for i in range(count):
        ring = 0
        while (ring - 1) * size <= min(distance[i], reach):
            for column in range(cells[i, 0] - ring, cells[i, 0] + ring + 1):
                at_side = abs(column - cells[i, 0]) == ring
                row = cells[i, 1] - ring
                while row <= cells[i, 1] + ring:
                    stop = cells[i, 1] + ring if at_side else row
                    j = _first(cells, column, row)
                    while j < count and cells[j, 0] == column and cells[j, 1] <= stop:
                        apart = math.hypot(
                            points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
                        )
                        if least < apart <= reach and (
                            apart < distance[i] or (apart == distance[i] and j < nearest[i])
                        ):
                            nearest[i], distance[i] = j, apart
                        j += 1
                    row = stop + 1 if at_side else row + 2 * ring
            ring += 1
    return np.asarray(nearest), np.asarray(distance)


def _first(cells: Ints, column: int, row: int) -> int:
    """The first sorted cell that is not before (column, row)."""
    low, high = 0, len(cells)
    while low < high:
        middle = (low + high) // 2
        if cells[middle, 0] < column or (cells[middle, 0] == column and cells[middle, 1] < row):
            low = middle + 1
        else:
            high = middle
    return low


# Pairs of boxes that touch, found by a sweep along one axis.
#
# Boxes are sorted by where they begin on that axis, so those that may touch a box follow it until
# one begins beyond its end. What makes it exact: comparisons of the given numbers, nothing else.
# `camtool.geometry.boxes` chooses the axis on which fewer boxes are looked at.


def touching(
    boxes: Floats, same: Ints, differ: Ints, asked: Bools, most: int
) -> tuple[Ints, Ints]:
    """Rows (J,), (J,) of boxes (K, 4) low, low, high, high that touch, each pair once.

    `boxes` are sorted by their first column. Both of a pair have the same number in `same`,
    different ones in `differ`, and at least one of them is `asked` for. No more than `most` pairs.
    """
    room = np.empty(0, np.int64)
    count = _touching(boxes, same, differ, asked, most, room, room)
    one, other = np.empty(count, np.int64), np.empty(count, np.int64)
    _touching(boxes, same, differ, asked, most, one, other)
    return np.asarray(one), np.asarray(other)


def _touching(
    boxes: Floats, same: Ints, differ: Ints, asked: Bools, most: int, one: Ints, other: Ints
) -> int:
    """Counts the pairs, and writes them when there is room for them."""
    count = 0
    for i in range(len(boxes)):
        j = i + 1
        while j < len(boxes) and boxes[j, 0] <= boxes[i, 2]:
            if (
                boxes[j, 1] <= boxes[i, 3]
                and boxes[i, 1] <= boxes[j, 3]
                and same[i] == same[j]
                and differ[i] != differ[j]
                and (asked[i] or asked[j])
            ):
                if count >= most:
                    return count
                if len(one) > 0:
                    one[count], other[count] = i, j
                count += 1
            j += 1
    return count


# Where paths come back to: of each point of a path, the latest one before it that is as near.
#
# The points of a square cell as wide as the reach are a chain, the latest first, and so are those
# of all cells with the same slot in the table of chains: distances are compared as they are, so
# such points only cost time. Around a point its own cell is asked first. What lies before the best
# point so far is not asked for, so a thousand passes over one point are not compared pair by pair.

FAR = 1e15
"""Cells farther than this from the origin count as one."""

LOW_BITS = 0xFFFFFFFF
"""The part of a cell's number that decides its slot."""


def latest_near(places: Floats, begins: Ints, reach: float) -> Indices:
    """(P,) the latest point before each of the points (P, 2) on its path within `reach`, −1 for
    none. Path k has the points begins[k]:begins[k + 1], `begins` (M + 1,)."""
    slots = 16
    while slots < len(places):
        slots *= 2
    heads = np.full(slots, -1, dtype=np.int32)
    before = np.empty(len(places), dtype=np.int32)
    latest = np.full(len(places), -1, dtype=np.int32)
    _latest_near(places, begins, reach, heads, before, latest)
    return np.asarray(latest)


def _latest_near(
    places: Floats, begins: Ints, reach: float, heads: Indices, before: Indices, latest: Indices
) -> None:
    """Fills in `latest`; `heads` are the latest points of the chains, `before` the one before
    each point."""
    for path in range(len(begins) - 1):
        first = begins[path]
        for i in range(first, begins[path + 1]):
            x, y = places[i, 0], places[i, 1]
            column, row = _cell(x, reach), _cell(y, reach)
            best = first - 1
            for beside in range(3):
                for above in range(3):
                    j = heads[_slot(column + (beside + 1) % 3, row + (above + 1) % 3, len(heads))]
                    while j > best:
                        if math.hypot(places[j, 0] - x, places[j, 1] - y) <= reach:
                            best = j
                        else:
                            j = before[j]
            if best >= first:
                latest[i] = best
            own = _slot(column + 1, row + 1, len(heads))
            before[i], heads[own] = heads[own], i


def _cell(place: float, size: float) -> int:
    """The number of the cell of that size in which a coordinate lies."""
    return int(math.floor(min(max(place / size, -FAR), FAR)))


def _slot(column: int, row: int, slots: int) -> int:
    """The slot of a cell, of a power of two of them."""
    return ((column & LOW_BITS) * 73_856_093 ^ (row & LOW_BITS) * 19_349_663) & (slots - 1)
