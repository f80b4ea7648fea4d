"""Search for near ends, points and boxes among many, and chains of ends.

Compiled, because each of many is compared with those beside it. Comments above each part say what
it does.
"""

from __future__ import annotations

from libc cimport math
from libc.stdint cimport int32_t, uint8_t
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Bools, Floats, Indices, Ints

# Pairs of near ends, which of them are joined, and the chains that the joints make.
#
# The two ends of path i are 2i (its start) and 2i + 1 (its end), so `end ^ 1` is the other end of
# the same path. What makes it exact: nothing is rounded here but the cells of a grid, and cells
# are only asked for neighbours; distances are compared as they are. `tests/oracles/chaining.py` is
# the twin.


cpdef near_pairs(Int[:, ::1] cells, double[:, ::1] points, double reach, Int max_pairs):
    """Return two arrays (J,) of rows: all pairs of points (E, 2) within `reach` of each other,
    each pair once.

    `cells` (E, 3): group, column and row of the grid cell of each point, `reach` wide, sorted. No
    point gets more than `max_pairs` pairs with points after it: that bounds time and memory.
    """
    cdef Int total
    cdef Int[::1] first, second, none
    none = np.empty(0, np.int64)
    total = _pairs(cells, points, reach, max_pairs, none, none)
    first, second = np.empty(total, np.int64), np.empty(total, np.int64)
    _pairs(cells, points, reach, max_pairs, first, second)
    return np.asarray(first), np.asarray(second)


cdef Int _pairs(
    Int[:, ::1] cells, double[:, ::1] points, double reach, Int max_pairs, Int[::1] first,
    Int[::1] second
) noexcept:
    """Count the pairs, and write them if `first` and `second` have room for them.

    Candidates for a point are in its own cell and the one above, which follow it in the sorted
    list, and in three cells of the next column, whose first candidate `low` only moves forward.
    """
    cdef Int i, count, low, number, hits, offset, group, column, row, j
    count, low, number = 0, 0, len(points)
    for i in range(number):
        group, column, row = cells[i, 0], cells[i, 1], cells[i, 2]
        hits = 0
        while low < number and _is_before(cells, low, group, column + 1, row - 1):
            low += 1
        for offset in range(2):
            j = i + 1 if offset == 0 else max(low, i + 1)
            while (
                j < number
                and hits < max_pairs
                and cells[j, 0] == group
                and cells[j, 1] == column + offset
                and cells[j, 2] <= row + 1
            ):
                if math.hypot(points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]) <= reach:
                    if len(first) > 0:
                        first[count], second[count] = i, j
                    count += 1
                    hits += 1
                j += 1
    return count


cdef inline bint _is_before(Int[:, ::1] cells, Int i, Int group, Int column, Int row) noexcept:
    if cells[i, 0] != group:
        return bool(cells[i, 0] < group)
    if cells[i, 1] != column:
        return bool(cells[i, 1] < column)
    return bool(cells[i, 2] < row)


cdef Int top(Int[::1] above, Int item) noexcept:
    """Return the root of an item's set (union-find with path halving)."""
    while above[item] != item:
        above[item] = above[above[item]]
        item = above[item]
    return item


cpdef clusters(Int count, Int[::1] first, Int[::1] second):
    """Return (count,) for each end the lowest end that is connected with it by the pairs."""
    cdef Int k, i, a, b
    cdef Int[::1] above
    above = np.arange(count, dtype=np.int64)
    for k in range(len(first)):
        a, b = top(above, first[k]), top(above, second[k])
        if a < b:
            above[b] = a
        elif b < a:
            above[a] = b
    for i in range(count):
        above[i] = top(above, i)
    return np.asarray(above)


cpdef Int join(
    Int[::1] first_ends, Int[::1] second_ends, Int[::1] mates, Int[::1] above, Int[::1] segments,
    Int[::1] arcs
) noexcept:
    """Join pairs of free ends, in their order, by setting `mates`; return how many were joined.

    `above` (paths), `segments` and `arcs` (of each set of joined paths) are updated. A pair that
    would close a ring around nothing is refused: two lines are one line and its double.
    """
    cdef Int joined, k, a, b, s, t
    joined = 0
    for k in range(len(first_ends)):
        a, b = first_ends[k], second_ends[k]
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


cdef inline bint encloses(Int segments, Int arcs) noexcept:
    """Return False for a ring of so few segments that nothing lies inside it."""
    return segments > 2 or (segments == 2 and arcs > 0)


cpdef walk(Int[::1] mates, uint8_t[::1] is_chosen):
    """Return the chains of the chosen paths; each begins at its first path, entered at its first
    end.

    Three arrays: the ends by which the paths are entered, in the order of travel; where each chain
    begins among them (C + 1,); and a mask of the chains that are rings (C,).
    """
    cdef Int count, index, size, chains, end, start
    cdef Int[::1] entries, begins
    cdef uint8_t[::1] rings, is_visited
    count = len(is_chosen)
    entries, begins = np.empty(count, np.int64), np.empty(count + 1, np.int64)
    rings, is_visited = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    size, chains = 0, 0
    for index in range(count):
        if is_visited[index] or not is_chosen[index]:
            continue
        begins[chains] = size
        end = first_end(mates, 2 * index)
        rings[chains] = end == 2 * index and mates[end] >= 0
        start = end
        while end >= 0:
            entries[size] = end
            is_visited[end // 2] = True
            size += 1
            end = mates[end ^ 1]
            if end == start:
                break
        chains += 1
    begins[chains] = size
    are_rings = np.asarray(rings[:chains]).view(np.bool_)
    return np.asarray(entries[:size]), np.asarray(begins[: chains + 1]), are_rings


cdef Int first_end(Int[::1] mates, Int end) noexcept:
    """Return the free end at which the chain begins that enters a path by `end`; `end` itself for
    a ring."""
    cdef Int start
    start = end
    while mates[end] >= 0:
        end = mates[end] ^ 1
        if end == start:
            break
    return end


cpdef Int split_loops(
    Int[::1] starts, Int[::1] mates, Int[::1] node, double[:, ::1] points, double reach,
    Int[:, ::1] weights
):
    """Split each ring that passes a node twice into two rings there; return how many were split
    off.

    Each ring is walked from the end given in `starts`. `node` (ends,) is −1 where only two ends
    meet; `weights` (paths, 2) are segments and arcs. The paths walked since the same node was
    passed before are a loop: it is closed there, and the rest continues without it, as long as the
    ends that then meet lie within `reach`.
    """
    cdef Int loops, index, start, last, height, end, label, m, k, previous, begin, close, segments
    cdef Int arcs, less, fewer
    cdef Int[:, ::1] until
    cdef Int[::1] position, stack
    cdef bint is_done, is_near
    position = np.full(len(mates), -1, np.int64)
    stack = np.empty(len(mates) // 2 + 1, np.int64)
    until = np.zeros((len(stack) + 1, 2), np.int64)
    loops = 0
    for index in range(len(starts)):
        start = starts[index]
        segments, arcs = _ring_weight(start, mates, weights)
        last = mates[start]
        height, end, is_done = 0, start, False
        while not is_done:
            label = node[end]
            if label >= 0 and position[label] >= 0:
                k = position[label]
                less, fewer = until[height, 0] - until[k, 0], until[height, 1] - until[k, 1]
                begin, close = stack[k], stack[height - 1] ^ 1
                previous = last if k == 0 else stack[k - 1] ^ 1
                is_near = (
                    _distance(points, begin, close) <= reach
                    and _distance(points, previous, end) <= reach
                )
                if is_near and encloses(less, fewer) and encloses(segments - less, arcs - fewer):
                    mates[begin], mates[close] = close, begin
                    mates[previous], mates[end] = end, previous
                    segments, arcs = segments - less, arcs - fewer
                    loops += 1
                    _forget(stack, k, height, node, position)
                    height = k
            stack[height] = end
            for m in range(2):
                until[height + 1, m] = until[height, m] + weights[end // 2, m]
            if label >= 0:
                position[label] = height
            height += 1
            is_done = end ^ 1 == last
            end = mates[end ^ 1]
        _forget(stack, 0, height, node, position)
    return loops


cdef (Int, Int) _ring_weight(Int start, Int[::1] mates, Int[:, ::1] weights) noexcept:
    """Return the numbers of segments and arcs of a whole ring."""
    cdef Int end, segments, arcs
    segments, arcs = weights[start // 2, 0], weights[start // 2, 1]
    end = mates[start ^ 1]
    while end != start:
        segments += weights[end // 2, 0]
        arcs += weights[end // 2, 1]
        end = mates[end ^ 1]
    return segments, arcs


cdef void _forget(Int[::1] entries, Int low, Int high, Int[::1] node, Int[::1] position) noexcept:
    """Remove the entries low … high − 1 from `position`, which has the place of each node on the
    stack."""
    cdef Int m, label
    for m in range(low, high):
        label = node[entries[m]]
        if label >= 0 and position[label] == m:
            position[label] = -1


cdef inline double _distance(double[:, ::1] points, Int first, Int second) noexcept:
    return math.hypot(points[first, 0] - points[second, 0], points[first, 1] - points[second, 1])


# The nearest other point of each point, on a grid whose cells are looked at ring by ring.
#
# What makes it exact: after ring k of cells around a point's own, every point nearer than k cells
# has been seen. `tests/oracles/chaining.py` is the twin.


cpdef nearest_others(
    Int[:, ::1] cells, double[:, ::1] points, double size, double min_distance, double reach
):
    """Return for each point (P, 2) the row of the nearest other point beyond `min_distance`, and
    its distance.

    `cells` (P, 2): column and row of the grid cell of each point, `size` wide, sorted. A point
    with none within `reach` gets −1. Equal distances go to the first row.
    """
    cdef Int count, i, ring, column, row, stop, j
    cdef Int[::1] nearest
    cdef bint at_side
    cdef double[::1] distance
    count = len(points)
    nearest = np.full(count, -1, np.int64)
    distance = np.full(count, math.INFINITY)
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
                        gap = math.hypot(
                            points[i, 0] - points[j, 0], points[i, 1] - points[j, 1]
                        )
                        if min_distance < gap <= reach and (
                            gap < distance[i] or (gap == distance[i] and j < nearest[i])
                        ):
                            nearest[i], distance[i] = j, gap
                        j += 1
                    row = stop + 1 if at_side else row + 2 * ring
            ring += 1
    return np.asarray(nearest), np.asarray(distance)


cdef Int _first(Int[:, ::1] cells, Int column, Int row) noexcept:
    """Return the first of the sorted cells that is not before (column, row)."""
    cdef Int low, high, middle
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


cpdef touching(
    double[:, ::1] boxes, Int[::1] equal_keys, Int[::1] unequal_keys, uint8_t[::1] is_queried,
    Int max_pairs
):
    """Return two arrays (J,) of rows: all pairs of boxes (K, 4), xmin, ymin, xmax, ymax, that
    touch, each pair once.

    `boxes` are sorted by their first column. A pair has equal `equal_keys` and different
    `unequal_keys`, and at least one of the two `is_queried`. At most `max_pairs` pairs.
    """
    cdef Int count
    cdef Int[::1] room, first, second
    room = np.empty(0, np.int64)
    count = _touching(boxes, equal_keys, unequal_keys, is_queried, max_pairs, room, room)
    first, second = np.empty(count, np.int64), np.empty(count, np.int64)
    _touching(boxes, equal_keys, unequal_keys, is_queried, max_pairs, first, second)
    return np.asarray(first), np.asarray(second)


cdef Int _touching(
    double[:, ::1] boxes, Int[::1] equal_keys, Int[::1] unequal_keys, uint8_t[::1] is_queried,
    Int max_pairs,
    Int[::1] first, Int[::1] second
) noexcept:
    """Count the pairs, and write them if `first` and `second` have room for them."""
    cdef Int count, i, j
    count = 0
    for i in range(len(boxes)):
        j = i + 1
        while j < len(boxes) and boxes[j, 0] <= boxes[i, 2]:
            if (
                boxes[j, 1] <= boxes[i, 3]
                and boxes[i, 1] <= boxes[j, 3]
                and equal_keys[i] == equal_keys[j]
                and unequal_keys[i] != unequal_keys[j]
                and (is_queried[i] or is_queried[j])
            ):
                if count >= max_pairs:
                    return count
                if len(first) > 0:
                    first[count], second[count] = i, j
                count += 1
            j += 1
    return count


# Where paths come back to: of each point of a path, the latest one before it that is as near.
#
# The points of a square cell as wide as the reach are a chain, the latest first, and so are those
# of all cells with the same slot in the table of chains: distances are compared as they are, so
# such points only cost time. Around a point its own cell is asked first. What lies before the best
# point so far is not asked for, so a thousand passes over one point are not compared pair by pair.

# Cells farther than this from the origin count as one.
cdef double _FAR = 1e15
FAR = _FAR

# The part of a cell's number that decides its slot.
cdef Int LOW_BITS = 0xFFFFFFFF


cpdef latest_near(double[:, ::1] places, Int[::1] begins, double reach):
    """Return (P,) for each point (P, 2) the latest point before it on its path that lies within
    `reach` of it, −1 for none. Path k has the points begins[k]:begins[k + 1], `begins` (M +
    1,)."""
    cdef Int slots
    cdef int32_t[::1] heads, previous, latest
    slots = 16
    while slots < len(places):
        slots *= 2
    heads = np.full(slots, -1, dtype=np.int32)
    previous = np.empty(len(places), dtype=np.int32)
    latest = np.full(len(places), -1, dtype=np.int32)
    _latest_near(places, begins, reach, heads, previous, latest)
    return np.asarray(latest)


cdef void _latest_near(
    double[:, ::1] places, Int[::1] begins, double reach, int32_t[::1] heads,
    int32_t[::1] previous,
    int32_t[::1] latest
) noexcept:
    """Fill in `latest`. `heads` holds the latest point of each hash slot, `previous` the point
    before each point in its slot."""
    cdef Int path, first, i, j, column, row, best, across, above, own
    cdef double x, y
    for path in range(len(begins) - 1):
        first = begins[path]
        for i in range(first, begins[path + 1]):
            x, y = places[i, 0], places[i, 1]
            column, row = _cell(x, reach), _cell(y, reach)
            best = first - 1
            for across in range(3):
                for above in range(3):
                    j = heads[_slot(column + (across + 1) % 3, row + (above + 1) % 3, len(heads))]
                    while j > best:
                        if math.hypot(places[j, 0] - x, places[j, 1] - y) <= reach:
                            best = j
                        else:
                            j = previous[j]
            if best >= first:
                latest[i] = best
            own = _slot(column + 1, row + 1, len(heads))
            previous[i], heads[own] = heads[own], i


cdef inline Int _cell(double place, double size) noexcept:
    """Return the number of the grid cell, `size` wide, in which a coordinate lies."""
    return int(math.floor(min(max(place / size, -_FAR), _FAR)))


cdef inline Int _slot(Int column, Int row, Int slots) noexcept:
    """Return the hash slot of a cell; `slots`, the number of slots, is a power of two."""
    return ((column & LOW_BITS) * 73_856_093 ^ (row & LOW_BITS) * 19_349_663) & (slots - 1)
