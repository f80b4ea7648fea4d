"""The order in which items are cut: a tour through them, made shorter step by step.

Compiled, because thousands of steps are tried. Comments above each part say what it does.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

from typing import NamedTuple

import numpy as np

from camtool.arrays import Floats, Ints

# A tour through items, as an array of positions, and the two steps that change it.
#
#     position   0      1 … M    M + 1
#     item       from   items    to
#
# A part of the tour is reversed (2-opt), and each item in it is cut from its other end when it has
# one; or two neighbouring parts change places (Or-opt when one of them is short), each reversed or
# not. The second step is made of reversals too, and a reversal undoes itself.
#
# What makes it exact: a step's gain counts the gaps that it opens and closes, and where items that
# cannot be turned lie in a reversed part, the gaps between them too. Whether a step would bring an
# item before one that must precede it is read from the positions, and such a step is never taken.
# `tests/oracles/tours.py` is the twin.


class Tour(NamedTuple):
    """Input of the search: `ends` (S + 2, 4), entry and exit of each row, then those of from and
    to; `turned` (S + 2,), the row with both exchanged, or itself when there is none; item i owns the
    rows from first[i] to first[i + 1]; `near`, `after`, `earlier`: of each item its neighbours,
    what comes after it and what before it, with the firsts of each; `free` the row of `to` when
    the tool may stay anywhere, else −1; `one_way` whether some row cannot be turned.

    What changes: `item` (M + 2,) by position, `place` (M + 2,), the position by item, `row`
    (M + 2,), the chosen row by item.
    """

    ends: Floats
    turned: Ints
    first: Ints
    near: Ints
    near_first: Ints
    after: Ints
    after_first: Ints
    earlier: Ints
    earlier_first: Ints
    free: int
    one_way: bool
    item: Ints
    place: Ints
    row: Ints


cdef class Route:
    """A tour as the loops read it."""

    cdef double[:, ::1] ends
    cdef Int[::1] turned, first, near, near_first, after, after_first, earlier, earlier_first
    cdef Int free
    cdef bint one_way
    cdef Int[::1] item, place, row

    def __init__(self, tour: Tour) -> None:
        self.ends, self.turned, self.first = tour.ends, tour.turned, tour.first
        self.near, self.near_first = tour.near, tour.near_first
        self.after, self.after_first = tour.after, tour.after_first
        self.earlier, self.earlier_first = tour.earlier, tour.earlier_first
        self.free, self.one_way = tour.free, tour.one_way
        self.item, self.place, self.row = tour.item, tour.place, tour.row


cdef class Step:
    """A change of the tour that shortens it by `gain`.

    second_high < 0: the positions low … high are reversed. Otherwise they change places with those
    behind them up to `second_high`; `flip` says which of the two is reversed as well (1: the first,
    2: the second, 0: none). `new_row` ≥ 0: the row that item `who` takes then.
    """

    cdef double gain
    cdef Int low, high, second_high, flip, who, new_row

    def __init__(self) -> None:
        self.gain = 0.0
        self.low, self.high, self.second_high = 0, -1, -1
        self.flip, self.who, self.new_row = 0, -1, -1

    cdef void set(
        self, double gain, Int low, Int high, Int second_high, Int flip, Int who, Int new_row
    ) noexcept:
        """Set all values of the step."""
        self.gain, self.low, self.high, self.second_high = gain, low, high, second_high
        self.flip, self.who, self.new_row = flip, who, new_row


cdef inline double gap(Route tour, Int from_row, Int to_row) noexcept:
    """Return the distance, mm, from the exit of a row to the entry of another one."""
    if to_row == tour.free:
        return 0.0
    x = tour.ends[to_row, 0] - tour.ends[from_row, 2]
    y = tour.ends[to_row, 1] - tour.ends[from_row, 3]
    return math.sqrt(x * x + y * y)


cdef inline Int row_at(Route tour, Int position) noexcept:
    """Return the chosen row of the item at a position."""
    return int(tour.row[tour.item[position]])


cpdef void reverse(Route tour, Int low, Int high) noexcept:
    """Reverse the positions low … high, and turn what lies there."""
    cdef Int first_item, last_item
    while low <= high:
        first_item, last_item = tour.item[low], tour.item[high]
        tour.item[low], tour.item[high] = last_item, first_item
        tour.place[first_item], tour.place[last_item] = high, low
        tour.row[first_item] = tour.turned[tour.row[first_item]]
        if first_item != last_item:
            tour.row[last_item] = tour.turned[tour.row[last_item]]
        low += 1
        high -= 1


cpdef double turning(Route tour, Int low, Int high) noexcept:
    """Return the extra length (mm) inside low … high if it is reversed; inf if it must not be."""
    cdef Int position, item, k, earlier_row, later_row
    cdef double longer
    if len(tour.after) > 0:
        for position in range(low, high):
            item = tour.item[position]
            for k in range(tour.after_first[item], tour.after_first[item + 1]):
                if tour.place[tour.after[k]] <= high:
                    return math.INFINITY
    longer = 0.0
    if tour.one_way:
        for position in range(low, high):
            earlier_row, later_row = row_at(tour, position), row_at(tour, position + 1)
            longer += (
                gap(tour, tour.turned[later_row], tour.turned[earlier_row])
                - gap(tour, earlier_row, later_row)
            )
    return longer


cpdef bint may_swap(Route tour, Int low, Int high, Int second_high) noexcept:
    """Return True if nothing in low … high must come before anything in high + 1 … second_high."""
    cdef Int position, item, k
    if len(tour.after) == 0:
        return True
    if high - low < second_high - high:
        for position in range(low, high + 1):
            item = tour.item[position]
            for k in range(tour.after_first[item], tour.after_first[item + 1]):
                if high < tour.place[tour.after[k]] <= second_high:
                    return False
        return True
    for position in range(high + 1, second_high + 1):
        item = tour.item[position]
        for k in range(tour.earlier_first[item], tour.earlier_first[item + 1]):
            if low <= tour.place[tour.earlier[k]] <= high:
                return False
    return True


cpdef double gain_of_reversal(Route tour, Int low, Int high) noexcept:
    """Return the length (mm) saved at both sides of a reversed part."""
    cdef Int left, right, first_row, last_row
    left, right = row_at(tour, low - 1), row_at(tour, high + 1)
    first_row, last_row = row_at(tour, low), row_at(tour, high)
    return (
        gap(tour, left, first_row)
        + gap(tour, last_row, right)
        - gap(tour, left, tour.turned[last_row])
        - gap(tour, tour.turned[first_row], right)
    )


cpdef double gain_of_swap(Route tour, Int low, Int high, Int second_high, Int flip) noexcept:
    """Return the length (mm) saved at the sides of two parts that change places."""
    cdef Int left, right, first_start, first_end, second_start, second_end
    cdef double old_gaps
    left, right = row_at(tour, low - 1), row_at(tour, second_high + 1)
    first_start, first_end = row_at(tour, low), row_at(tour, high)
    second_start, second_end = row_at(tour, high + 1), row_at(tour, second_high)
    old_gaps = (
        gap(tour, left, first_start) + gap(tour, first_end, second_start)
        + gap(tour, second_end, right)
    )
    if flip == 1:
        first_start, first_end = tour.turned[first_end], tour.turned[first_start]
    elif flip == 2:
        second_start, second_end = tour.turned[second_end], tour.turned[second_start]
    return (
        old_gaps - gap(tour, left, second_start) - gap(tour, second_end, first_start)
        - gap(tour, first_end, right)
    )


cdef Int take(Route tour, Step step, Int[:, ::1] log, Int logged) noexcept:
    """Change the tour by a step, log how to undo it, and return the new length of the log."""
    cdef Int low, high, second_high, middle
    low, high, second_high = step.low, step.high, step.second_high
    if second_high >= 0:
        middle = low + second_high - high
        logged = _reversed(tour, low, second_high, log, logged)
        if step.flip != 2:
            logged = _reversed(tour, low, middle - 1, log, logged)
        if step.flip != 1:
            logged = _reversed(tour, middle, second_high, log, logged)
    elif high >= low:
        logged = _reversed(tour, low, high, log, logged)
    if step.new_row >= 0:
        log[logged, 0], log[logged, 1] = -1 - step.who, tour.row[step.who]
        logged += 1
        tour.row[step.who] = step.new_row
    return logged


cdef Int _reversed(Route tour, Int low, Int high, Int[:, ::1] log, Int logged) noexcept:
    reverse(tour, low, high)
    log[logged, 0], log[logged, 1] = low, high
    return logged + 1


cdef void undo(Route tour, Int[:, ::1] log, Int logged) noexcept:
    """Undo the logged steps, the last first."""
    cdef Int k
    for k in range(logged - 1, -1, -1):
        if log[k, 0] < 0:
            tour.row[-1 - log[k, 0]] = log[k, 1]
        else:
            reverse(tour, log[k, 0], log[k, 1])


# A tree of points in the plane whose points can be switched off, asked for the nearest ones.
#
#     Node k holds rows[begin[k] : begin[k] + size[k]] and its halves are the nodes 2k + 1, 2k + 2.
#
# What makes it exact: a node is left out only when its box lies farther away than what has been
# found. Equal distances go to the lower row. Nothing depends on how the points are spread.


cpdef enum:
    # A node of so many points is not halved any more: work alone.
    LEAF = 6
    # Nodes that wait while the tree is walked: more than levels of any tree that fits in memory.
    DEEPEST = 64
    # No quarter of the plane: all of it.
    ANYWHERE = -1


class Tree(NamedTuple):
    """`points` (N, 2); `rows` (N,) sorted by node; per node `begin`, `size`, `box` (low x, low y,
    high x, high y) and `live`, the points that are switched on; `leaf` (N,), each point's node."""

    points: Floats
    rows: Ints
    begin: Ints
    size: Ints
    box: Floats
    live: Ints
    leaf: Ints


cpdef tree_of(double[:, :] points):
    """Return the tree of these points, N ≥ 1, finite, all switched on. A node is halved across the
    longer side of its box."""
    cdef Int count, levels, leaves, nodes, node, low, middle, high, k
    cdef Int[::1] begin, size, rows, leaf
    cdef double[:, ::1] box
    cdef double wide, tall
    count, levels = len(points), 0
    while count >> levels > LEAF:
        levels += 1
    leaves = 1 << levels
    nodes = 2 * leaves - 1
    begin, size = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64)
    box, rows = np.empty((nodes, 4)), np.arange(count)
    leaf = np.empty(count, np.int64)
    points = np.ascontiguousarray(points)
    size[0] = count
    for node in range(nodes):
        low, high = begin[node], begin[node] + size[node]
        _bound(points, rows, low, high, box, node)
        if node < leaves - 1:
            wide, tall = box[node, 2] - box[node, 0], box[node, 3] - box[node, 1]
            middle = low + (high - low) // 2
            _halve(points, rows, low, middle, high - 1, 0 if wide >= tall else 1)
            begin[2 * node + 1], size[2 * node + 1] = low, middle - low
            begin[2 * node + 2], size[2 * node + 2] = middle, high - middle
        else:
            for k in range(low, high):
                leaf[rows[k]] = node
    order = np.asarray(rows)
    begins, sizes, boxes = np.asarray(begin), np.asarray(size), np.asarray(box)
    return Tree(np.asarray(points), order, begins, sizes, boxes, sizes.copy(), np.asarray(leaf))


cdef void _bound(
    double[:, :] points, Int[::1] rows, Int low, Int high, double[:, ::1] box, Int node
) noexcept:
    """Set the box of a node to that of the rows low … high − 1."""
    cdef Int k
    cdef double x, y
    box[node, 0] = box[node, 1] = math.INFINITY
    box[node, 2] = box[node, 3] = -math.INFINITY
    for k in range(low, high):
        x, y = points[rows[k], 0], points[rows[k], 1]
        box[node, 0], box[node, 1] = min(box[node, 0], x), min(box[node, 1], y)
        box[node, 2], box[node, 3] = max(box[node, 2], x), max(box[node, 3], y)


cdef void _halve(
    double[:, :] points, Int[::1] rows, Int low, Int middle, Int high, Int axis
) noexcept:
    """Reorder the rows low … high so that none before `middle` lies farther along the axis than
    one from there on (Hoare's FIND, 1961)."""
    cdef double pivot
    cdef Int left, right, row
    while low < high:
        pivot = points[rows[(low + high) // 2], axis]
        left, right = low, high
        while left <= right:
            while points[rows[left], axis] < pivot:
                left += 1
            while points[rows[right], axis] > pivot:
                right -= 1
            if left <= right:
                row = rows[left]
                rows[left], rows[right] = rows[right], row
                left, right = left + 1, right - 1
        if right < middle:
            low = left
        if left > middle:
            high = right


cdef class Branches:
    """A tree as the loops read it, and a stack for the nodes that wait."""

    cdef double[:, ::1] points, box
    cdef Int[::1] rows, begin, size, live, leaf, waiting

    def __init__(self, tree: Tree) -> None:
        self.points, self.rows, self.begin, self.size = (
            tree.points,
            tree.rows,
            tree.begin,
            tree.size,
        )
        self.box, self.live, self.leaf = tree.box, tree.live, tree.leaf
        self.waiting = np.empty(DEEPEST, np.int64)


cpdef void switch(Branches tree, Int row, Int change) noexcept:
    """Switch a point off (−1) or on (+1); it must be in the other state before."""
    cdef Int node
    node = tree.leaf[row]
    while True:
        tree.live[node] += change
        if node == 0:
            return
        node = (node - 1) // 2


cdef inline double _box_distance_square(Branches tree, Int node, double x, double y) noexcept:
    """Return the squared distance from a point to a node's box."""
    dx = max(tree.box[node, 0] - x, x - tree.box[node, 2], 0.0)
    dy = max(tree.box[node, 1] - y, y - tree.box[node, 3], 0.0)
    return float(dx * dx + dy * dy)


cdef Int _halves_wait(
    Branches tree, Int node, double x, double y, Int[::1] waiting, Int top
) noexcept:
    """Put the halves of a node on the stack `waiting`, the nearer one on top; return its new
    height."""
    cdef bint left_first
    distance = _box_distance_square(tree, 2 * node + 1, x, y)
    left_first = distance <= _box_distance_square(tree, 2 * node + 2, x, y)
    waiting[top] = 2 * node + (2 if left_first else 1)
    waiting[top + 1] = 2 * node + (1 if left_first else 2)
    return top + 2


cpdef Int nearest_row(Branches tree, Int[::1] is_open, double x, double y) noexcept:
    """Return the nearest point that is switched on (`is_open` (N,): 1, else 0); −1 when none
    is."""
    cdef Int top, leaves, node, k, row, nearest
    cdef Int[::1] waiting
    cdef double best, square, dx, dy
    waiting, top, leaves = tree.waiting, 1, len(tree.size) // 2
    waiting[0] = 0
    nearest, best = -1, math.INFINITY
    while top > 0:
        top -= 1
        node = waiting[top]
        if tree.live[node] == 0 or _box_distance_square(tree, node, x, y) > best:
            continue
        if node < leaves:
            top = _halves_wait(tree, node, x, y, waiting, top)
            continue
        for k in range(tree.begin[node], tree.begin[node] + tree.size[node]):
            row = tree.rows[k]
            if is_open[row]:
                dx, dy = tree.points[row, 0] - x, tree.points[row, 1] - y
                square = dx * dx + dy * dy
                if square < best or (square == best and row < nearest):
                    nearest, best = row, square
    return nearest


cpdef Int nearest_owners(
    Branches tree, Int[::1] owner, Int row, Int max_count, Int quarter, Int[::1] nearest,
    double[::1] squares
) noexcept:
    """Write the owners nearest to a point, except its own, into `nearest`, each once, nearest
    first, and their squared distances into `squares`; return their number, at most `max_count`.

    `quarter` 0 … 3: only those above and to the right of the point, and so on CCW.
    """
    cdef Int top, leaves, node, k, point, count
    cdef Int[::1] waiting
    cdef double x, y, left, right, below, above, dx, dy
    x, y = tree.points[row, 0], tree.points[row, 1]
    waiting, top, leaves = tree.waiting, 1, len(tree.size) // 2
    waiting[0] = 0
    for k in range(max_count):
        nearest[k], squares[k] = -1, math.INFINITY
    while top > 0:
        top -= 1
        node = waiting[top]
        left, right = tree.box[node, 0] - x, tree.box[node, 2] - x
        below, above = tree.box[node, 1] - y, tree.box[node, 3] - y
        if _box_distance_square(tree, node, x, y) > squares[max_count - 1] or not (
            _looks_to(quarter, right, above)
            or _looks_to(quarter, left, above)
            or _looks_to(quarter, left, below)
            or _looks_to(quarter, right, below)
        ):
            continue
        if node < leaves:
            top = _halves_wait(tree, node, x, y, waiting, top)
            continue
        for k in range(tree.begin[node], tree.begin[node] + tree.size[node]):
            point = tree.rows[k]
            dx, dy = tree.points[point, 0] - x, tree.points[point, 1] - y
            if owner[point] != owner[row] and _looks_to(quarter, dx, dy):
                _enter(nearest, squares, max_count, owner[point], dx * dx + dy * dy)
    count = 0
    while count < max_count and nearest[count] >= 0:
        count += 1
    return count


cdef inline bint _looks_to(Int quarter, double dx, double dy) noexcept:
    """Return True if a direction lies in a quarter of the plane; one of its two edges belongs to
    each."""
    if quarter == 0:
        return dx > 0.0 and dy >= 0.0
    if quarter == 1:
        return dx <= 0.0 and dy > 0.0
    if quarter == 2:
        return dx < 0.0 and dy <= 0.0
    if quarter == 3:
        return dx >= 0.0 and dy < 0.0
    return True


cdef void _enter(
    Int[::1] nearest, double[::1] squares, Int max_count, Int owner, double distance
) noexcept:
    """Put an owner into the sorted list of `max_count`, or move it up when it is in the list
    already."""
    cdef Int index, k
    index = max_count - 1
    if not _is_before(distance, owner, nearest, squares, index):
        return
    for k in range(max_count):
        if nearest[k] == owner:
            if squares[k] <= distance:
                return
            index = k
            break
    while index > 0 and _is_before(distance, owner, nearest, squares, index - 1):
        nearest[index], squares[index] = nearest[index - 1], squares[index - 1]
        index -= 1
    nearest[index], squares[index] = owner, distance


cdef inline bint _is_before(
    double distance, Int owner, Int[::1] nearest, double[::1] squares, Int index
) noexcept:
    """Return True if an owner comes before the one at an index: nearer, or as near and with the
    smaller number."""
    if distance != squares[index]:
        return bool(distance < squares[index])
    return bool(nearest[index] < 0 or owner < nearest[index])


# The first tour, by nearest neighbours, and which items are near to which.
#
# An item may be taken when everything before it has been taken; its rows lie in the tree all the
# time, and are switched on then.


cpdef enum:
    # Neighbours of an item of one place: work against length.
    NEAR = 7
    # Neighbours of each place of an item of many, at least.
    NEAR_EACH = 3
    # Neighbours in each quarter of the plane round an item's first place: without them the items
    # of a cluster, such as the strokes of a letter, would know of no other cluster.
    NEAR_QUARTER = 1


cpdef nearest_first(
    tree, double[:, ::1] ends, Int[::1] first, Int[::1] after_first, Int[::1] after,
    Int[::1] waits, double[::1] start
):
    """Return the rows (M,) in greedy order: from `start` (2,) always on to the nearest row that
    may be taken.

    `tree` is that of the entries, and is used up. `ends` (S, 4): entry x, y and exit x, y; item i
    owns the rows from first[i] to first[i + 1]; after[after_first[i] : after_first[i + 1]] may
    come after item i only, and `waits` (M,) counts for each item those that must come before it.
    Shorter than M when items wait for each other.
    """
    cdef Branches branches
    cdef Int i, rank, count, row, next_row, item, k, later
    cdef Int[::1] rows, owner, is_open, waiting
    cdef double x, y
    count, x, y = len(first) - 1, start[0], start[1]
    branches = Branches(tree)
    rows, owner = np.empty(count, np.int64), np.empty(first[count], np.int64)
    is_open, waiting = np.ones(first[count], np.int64), np.array(waits)
    for i in range(count):
        for row in range(first[i], first[i + 1]):
            owner[row] = i
            if waiting[i] > 0:
                is_open[row] = 0
                switch(branches, row, -1)
    for rank in range(count):
        next_row = nearest_row(branches, is_open, x, y)
        if next_row < 0:
            return np.asarray(rows[:rank])
        rows[rank] = next_row
        item = owner[next_row]
        x, y = ends[next_row, 2], ends[next_row, 3]
        for row in range(first[item], first[item + 1]):
            is_open[row] = 0
            switch(branches, row, -1)
        for k in range(after_first[item], after_first[item + 1]):
            later = after[k]
            waiting[later] -= 1
            if waiting[later] == 0:
                for row in range(first[later], first[later + 1]):
                    is_open[row] = 1
                    switch(branches, row, 1)
    return np.asarray(rows)


cpdef neighbours(tree, Int[::1] owner, Int count):
    """Return the neighbours of all items and where each item's begin: those of item i are
    near[near_first[i] : near_first[i + 1]], by a tree of N places.

    `owner` (N,) ascends. Each place contributes its nearest items, the first place also those in
    each quarter; an item that several contribute comes once.
    """
    cdef Branches branches
    cdef Int total, i, places, max_nearest, place, k, quarter, wanted_count, hits, m, item
    cdef Int most_of_item
    cdef Int[::1] place_first, near_first, neighbour, last_seen, nearest
    cdef double[::1] squares
    place_first = np.zeros(count + 1, np.int64)
    for place in range(len(owner)):
        place_first[owner[place] + 1] += 1
    for item in range(count):
        place_first[item + 1] += place_first[item]
    near_first = np.zeros(count + 1, np.int64)
    most_of_item = NEAR + NEAR_EACH + 4 * NEAR_QUARTER
    neighbour = np.empty(len(owner) * NEAR_EACH + count * most_of_item, np.int64)
    last_seen, total, branches = np.full(count, -1, dtype=np.int64), 0, Branches(tree)
    nearest, squares = np.empty(NEAR + NEAR_EACH, np.int64), np.empty(NEAR + NEAR_EACH)
    for i in range(count):
        places = place_first[i + 1] - place_first[i]
        max_nearest = max(NEAR_EACH, (NEAR + places - 1) // max(places, 1))
        # Each place, then the quarters about the first one.
        for k in range(places + (4 if places > 0 else 0)):
            place = place_first[i] + (k if k < places else 0)
            quarter = ANYWHERE if k < places else k - places
            wanted_count = max_nearest if k < places else NEAR_QUARTER
            hits = nearest_owners(branches, owner, place, wanted_count, quarter, nearest, squares)
            for m in range(hits):
                if last_seen[nearest[m]] != i:
                    last_seen[nearest[m]] = i
                    neighbour[total] = nearest[m]
                    total += 1
        near_first[i + 1] = total
    return np.array(neighbour[:total]), np.asarray(near_first)


# The best rows for a given order, exactly: the shortest way through layers.
#
#     cost(s) = min over the rows r of the item before of  cost(r) + |exit r → entry s|.
#
# Rows r whose cost alone is not below what has been found are not tried: gaps are not negative. Of
# equal ways that of the cheaper row counts, and of equal rows the lower one.


cpdef best_rows(
    double[:, ::1] ends, Int[::1] first, Int[::1] order, double[::1] start, double[::1] goal
):
    """Return the best rows (M,) for items (M,) in this order, from `start` (2,) to `goal` (2,),
    NaN for no goal.

    `ends` (S, 4): entry x, y and exit x, y; item i owns the rows from first[i] to first[i + 1].
    """
    cdef Int count, rows_in_all, row, rank, low, high, r, best_row, last
    cdef Int[::1] came_from, rows
    cdef double best, x, y, length, home
    cdef double[::1] cost
    count, rows_in_all = len(order), first[len(first) - 1]
    came_from, cost = np.full(rows_in_all, -1, dtype=np.int64), np.empty(rows_in_all)
    for row in range(first[order[0]], first[order[0] + 1]):
        cost[row] = math.hypot(ends[row, 0] - start[0], ends[row, 1] - start[1])
    for rank in range(1, count):
        low, high = first[order[rank - 1]], first[order[rank - 1] + 1]
        for row in range(first[order[rank]], first[order[rank] + 1]):
            best = math.INFINITY
            for r in range(low, high):
                if cost[r] >= best:
                    continue
                x, y = ends[row, 0] - ends[r, 2], ends[row, 1] - ends[r, 3]
                length = cost[r] + math.sqrt(x * x + y * y)
                if length < best or (length == best and cost[r] < cost[came_from[row]]):
                    best = length
                    came_from[row] = r
            cost[row] = best
    best_row, best = -1, math.INFINITY
    last = order[count - 1]
    for row in range(first[last], first[last + 1]):
        home = math.hypot(ends[row, 2] - goal[0], ends[row, 3] - goal[1])
        length = cost[row] + (0.0 if math.isnan(goal[0]) else home)
        if length < best:
            best_row, best = row, length
    rows = np.empty(count, np.int64)
    for rank in range(count - 1, -1, -1):
        rows[rank] = best_row
        best_row = came_from[best_row]
    return np.asarray(rows)


# Steps that make a tour shorter, until none does; then kicks, kept where they lead to more.
#
# From each item that waits in the queue the best step is taken that brings it beside one of its
# neighbours, or gives it another row; what the step touches waits again. A kick lets two short
# parts of the tour change places somewhere, and everything is undone when the tour is not shorter
# after the steps that follow. The places of the kicks are pseudo-random and the same in each run.


# A step that gains less is not taken: it could be rounding alone.
cdef double MIN_GAIN_MM = 1e-9

cpdef enum:
    # So many items are moved together elsewhere.
    MAX_MOVED = 3
    # A moved item of more rows tries only so many of them, evenly spread; which is best is decided
    # exactly later.
    ROWS_TRIED = 12
    # The parts that a kick exchanges have at most this many items.
    KICK_REACH = 50
    # So many changes after a kick can be undone; no more are made.
    LOG = 8192


cdef (double, Int) shorten(
    Route tour, Int[::1] queue, Int[::1] waits, Int count, Int[:, ::1] log, Int logged, Step step
) noexcept:
    """Take steps until no item waits; return the length saved, mm, and the length of the log.

    `queue` (M,) holds the `count` items that wait, `waits` (M,) 1 for each of them. With `logged`
    < 0 nothing need be undone. `step` is a scratch object.
    """
    cdef Int head, size, item
    cdef double gained
    head, gained, size = 0, 0.0, len(queue)
    while count > 0:
        item = queue[head]
        head, count = (head + 1) % size, count - 1
        waits[item] = 0
        while logged < len(log) - 4:
            best_step(tour, item, step)
            if step.gain <= MIN_GAIN_MM:
                break
            if logged >= 0:
                logged = take(tour, step, log, logged)
            else:
                take(tour, step, log, 0)
            gained += step.gain
            count = _touched_wait(tour, step, queue, waits, head, count)
    return gained, logged


cdef Int _wait(
    Route tour, Int[::1] queue, Int[::1] waits, Int head, Int count, Int position
) noexcept:
    """Put the item at a position into the queue, unless it is there; return the number of waiting
    items."""
    cdef Int item
    if position < 1 or position > len(queue):
        return count
    item = tour.item[position]
    if waits[item]:
        return count
    queue[(head + count) % len(queue)] = item
    waits[item] = 1
    return count + 1


cdef Int _touched_wait(
    Route tour, Step step, Int[::1] queue, Int[::1] waits, Int head, Int count
) noexcept:
    """Put the items beside the gaps that a step has changed into the queue; return the number of
    waiting items."""
    cdef Int last, middle, position, k
    last = step.high if step.second_high < 0 else step.second_high
    middle = step.low if step.second_high < 0 else step.low + step.second_high - step.high
    position = step.low if step.who < 0 else tour.place[step.who]
    for k in range(2):
        count = _wait(tour, queue, waits, head, count, step.low - 1 + k)
    for k in range(2):
        count = _wait(tour, queue, waits, head, count, middle - 1 + k)
    for k in range(2):
        count = _wait(tour, queue, waits, head, count, last + k)
    for k in range(2):
        count = _wait(tour, queue, waits, head, count, position + k)
    return count


cdef void best_step(Route tour, Int item, Step best) noexcept:
    """Set `best` to the step that saves most among those that concern this item; if there is none,
    its gain is the least that counts."""
    cdef Int turned, k, position, last, row, left, right, neighbour, spot, neighbour_row
    cdef bint is_single
    cdef double reach, lifted
    position, last = tour.place[item], len(tour.item) - 2
    row, left, right = tour.row[item], row_at(tour, position - 1), row_at(tour, position + 1)
    gap_before, gap_after = gap(tour, left, row), gap(tour, row, right)
    turned = tour.turned[row]
    best.set(MIN_GAIN_MM, 0, -1, -1, 0, -1, -1)
    _other_row(tour, item, best)
    _reversal(tour, 1, position, best)
    _reversal(tour, position, last, best)
    lifted = gap_before + gap_after - gap(tour, left, right)
    # A place gains nowhere more than by being lifted out, and little beside a far neighbour.
    is_single = tour.first[item + 1] - tour.first[item] == 1 and not tour.one_way
    reach = max(gap_before, gap_after) if is_single else math.INFINITY
    for k in range(tour.near_first[item], tour.near_first[item + 1]):
        neighbour = tour.near[k]
        spot, neighbour_row = tour.place[neighbour], tour.row[neighbour]
        if gap(tour, neighbour_row, row) < gap_before:
            _part(tour, position, 1, spot, False, best)
        if gap(tour, turned, neighbour_row) < gap_before:
            _part(tour, position, 1, spot - 1, True, best)
            _reversal(tour, min(position, spot), max(position, spot) - 1, best)
        if gap(tour, row, neighbour_row) < gap_after:
            _part(tour, position, -1, spot - 1, False, best)
        if gap(tour, neighbour_row, turned) < gap_after:
            _part(tour, position, -1, spot, True, best)
            _reversal(tour, min(position, spot) + 1, max(position, spot), best)
        if gap(tour, row, neighbour_row) < reach and (lifted > best.gain or not is_single):
            _single(tour, item, spot - 1, lifted, best)
            _single(tour, item, spot, lifted, best)


cdef void _other_row(Route tour, Int item, Step best) noexcept:
    """Set `best` to the choice of another row of an item at its position, where that saves
    more."""
    cdef Int candidate, position, row, left, right
    position, row = tour.place[item], tour.row[item]
    left, right = row_at(tour, position - 1), row_at(tour, position + 1)
    old_gaps = gap(tour, left, row) + gap(tour, row, right)
    for candidate in range(tour.first[item], tour.first[item + 1]):
        gain = old_gaps - gap(tour, left, candidate) - gap(tour, candidate, right)
        if gain > best.gain:
            best.set(gain, position, position - 1, -1, 0, item, candidate)


cdef void _reversal(Route tour, Int low, Int high, Step best) noexcept:
    cdef double gain
    if low > high:
        return
    gain = gain_of_reversal(tour, low, high)
    if gain > best.gain:
        gain -= turning(tour, low, high)
        if gain > best.gain:
            best.set(gain, low, high, -1, 0, -1, -1)


cdef void _part(Route tour, Int position, Int direction, Int spot, bint turn, Step best) noexcept:
    """Try to move parts of two and more items that begin (`direction` 1) or end (−1) at a position
    to between the positions `spot` and `spot` + 1; keep the best step."""
    cdef Int length, low, high
    for length in range(2, MAX_MOVED + 1):
        low = position if direction > 0 else position - length + 1
        high = low + length - 1
        if low < 1 or high > len(tour.item) - 2 or low - 1 <= spot <= high:
            break
        if spot > high:
            _swap(tour, low, high, spot, 1 if turn else 0, best)
        else:
            _swap(tour, spot + 1, low - 1, high, 2 if turn else 0, best)


cdef void _swap(Route tour, Int low, Int high, Int second_high, Int flip, Step best) noexcept:
    cdef double gain
    gain = gain_of_swap(tour, low, high, second_high, flip)
    if gain > best.gain and may_swap(tour, low, high, second_high):
        if flip == 1:
            gain -= turning(tour, low, high)
        elif flip == 2:
            gain -= turning(tour, high + 1, second_high)
        if gain > best.gain:
            best.set(gain, low, high, second_high, flip, -1, -1)


cdef void _single(Route tour, Int item, Int spot, double lifted, Step best) noexcept:
    """Try to move an item to between the positions `spot` and `spot` + 1, with its best row there;
    keep the best step."""
    cdef Int position, k, left, right, row, first, count, candidate, low, high, end
    cdef double gain, candidate_gain, opened_gap
    position = tour.place[item]
    if position - 1 <= spot <= position:
        return
    left, right = row_at(tour, spot), row_at(tour, spot + 1)
    opened_gap = lifted + gap(tour, left, right)
    row, gain = -1, best.gain
    first, count = tour.first[item], tour.first[item + 1] - tour.first[item]
    for k in range(min(count, ROWS_TRIED)):
        candidate = first + (k if count <= ROWS_TRIED else k * count // ROWS_TRIED)
        candidate_gain = opened_gap - gap(tour, left, candidate) - gap(tour, candidate, right)
        if candidate_gain > gain:
            row, gain = candidate, candidate_gain
    if row < 0:
        return
    low, high, end = (
        (position, position, spot) if spot > position else (spot + 1, position - 1, position)
    )
    if may_swap(tour, low, high, end):
        best.set(gain, low, high, end, 0, item, row)


def settled(tour: Tour) -> float:
    """Shorten the tour until no step gains any more, and return the length (mm) saved."""
    return float(kicked(tour, 0, 1))


cpdef double kicked(tour, Int kicks, Int seed):
    """Shorten the tour until no step saves anything, then by `kicks` random changes each followed
    by more steps; return the length saved, mm."""
    cdef Int items, waiting, may_undo, kick, logged, low, high, second_high
    cdef Int[:, ::1] log
    cdef Int[::1] queue, waits
    cdef Route route
    cdef Step step, room
    cdef double gained, gain
    route, step, room = Route(tour), Step(), Step()
    items = len(tour.item) - 2
    queue, waits = np.array(tour.item[1 : items + 1]), np.ones(items, np.int64)
    log = np.empty((LOG, 2), np.int64)
    waiting, may_undo = items, -1
    gained, kick = 0.0, -1
    while kick < kicks:
        gain, logged = shorten(route, queue, waits, waiting, log, may_undo, room)
        if kick < 0 or gain + step.gain > MIN_GAIN_MM:
            gained += gain + step.gain
        else:
            undo(route, log, logged)
        waiting = 0
        while waiting == 0 and kick < kicks:
            kick += 1
            if items < 2 or kick == kicks:
                return gained
            seed = seed * 48271 % 2147483647
            low = 1 + seed % (items - 1)
            seed = seed * 48271 % 2147483647
            high = min(low + seed % KICK_REACH, items - 1)
            seed = seed * 48271 % 2147483647
            second_high = min(high + 1 + seed % KICK_REACH, items)
            if not may_swap(route, low, high, second_high):
                continue
            gain = gain_of_swap(route, low, high, second_high, 0)
            step.set(gain, low, high, second_high, 0, -1, -1)
            may_undo = take(route, step, log, 0)
            waiting = _touched_wait(route, step, queue, waits, 0, waiting)
    return gained
