"""The moves near points: the nearest of many at a point's height, and all within a limit.

Points and moves are divided together. The box of some points is taken; moves that come no nearer
to it than the limit are left out; the points are divided at the middle of the longest side of the
box, and so on until few points or few moves are left, which are compared one by one. A diagonal
across the part is a candidate only of points beside it, however large its box is, and moves far
below the points are none at all. Nothing is stored but the candidates of the boxes around the
present one, at most two numbers for each move: where the list has not shrunk to its half, points
keep the list of the box before.

What is found does not depend on the division: the distances of all moves within the limit are
exact, to true lines and arcs (`camtool.verification.nearest`). Compiled.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.types cimport Int

from typing import NamedTuple

import numpy as np

from camtool.arrays import Floats, Indices, Ints

cpdef enum:
    # Columns of an arc: its centre, radius, normals into its wedge from its two edges, size of its
    # sweep, rad, and box.
    CX = 0, CY, RADIUS, UX, UY, VX, VY, SWEEP, LOW_X, LOW_Y, HIGH_X, HIGH_Y
    # Numbers of an arc.
    COLUMNS = 12
    # So many points are not divided any more: they are compared with all their candidates.
    FEW_POINTS = 4
    # Points with so few candidates are not divided any more.
    FEW_MOVES = 8


# Boxes are wider by this, so that rounding loses no move.
cdef double SLACK_MM = 1e-9

# Of moves nearer than the nearest one and this, the last is taken: a later cut decides what
# remains.
cdef double EQUAL_MM = 1e-6

cpdef enum:
    # Parts of the points that can wait: the smaller part comes first, so there are no more than
    # the logarithm of all of them.
    DEPTH = 80


class Moves(NamedTuple):
    """K moves: start and end (K, 2), (K, 2) mm, and the heights of both (K, 2) mm; which of the
    arcs each is (K,), −1 for a line; and the arcs (A, 12). What is the same in all rows may be one
    row, seen as many (`np.broadcast_to`)."""

    start: Floats
    end: Floats
    heights: Floats
    arc: Indices
    arcs: Floats


cdef class Near:
    """Input and buffers of a search: K moves, P `points` (P, 3) mm with their heights, the limit in
    XY and the window of heights (on a slope, more by the slope), and stacks. For each point: the
    number of moves within both (`count` (P,)), the distance of the nearest of these (`distance`
    (P,) mm) and its row (`move` (P,))."""

    cdef const double[:, :] start, end, heights
    cdef const int[:] arc
    cdef double[:, ::1] arcs, points
    cdef double limit, window
    cdef double[::1] distance, distances, box
    cdef Int[::1] move, count, order, waiting
    cdef int[::1] candidates

    def __init__(
        self,
        moves: Moves,
        points: Floats,
        limits_mm: tuple[float, float],
        nearest_so_far: tuple[Floats, Ints, Ints],
    ) -> None:
        self.start, self.end, self.heights, self.arc, self.arcs = moves
        self.points = points
        self.limit, self.window = limits_mm
        self.distance, self.move, self.count = nearest_so_far
        self.order = np.arange(len(points))
        self.candidates = np.empty(2 * len(moves.arc) + 2, dtype=np.int32)
        self.distances = np.empty(FEW_MOVES)
        self.waiting = np.empty(4 * DEPTH, dtype=np.int64)
        self.box = np.empty(6)


def nearest(
    moves: Moves, points: Floats, runs: Ints, limits_mm: tuple[float, float]
) -> tuple[Floats, Ints]:
    """Return (P,) mm the distance of each point from the nearest move within the limits, inf for
    none; and (P,) the row of that move, −1 for none; arguments as in `Near`. `runs` (R, 4): begin
    and end of some points, begin and end of the moves with which they are compared."""
    count = np.zeros(len(points), dtype=np.int64)
    result = np.full(len(points), np.inf), np.full(len(points), -1, dtype=np.int64), count
    search = Near(moves, points, limits_mm, result)
    nothing, nowhere = np.empty(0, dtype=np.int64), np.empty(0)
    for run in runs:
        low, high, first, last = run.tolist()
        divide(low, high, first, last, search, nothing, nowhere)
    return result[:2]


def pairs(
    moves: Moves, points: Floats, limits_mm: tuple[float, float]
) -> tuple[Ints, Ints, Floats]:
    """Return all pairs (point, move) within the limits, in order, as two arrays, and their
    distances, mm; arguments as in `Near`."""
    count = np.zeros(len(points), dtype=np.int64)
    place = np.empty(len(points), dtype=np.int64)
    search = Near(moves, points, limits_mm, (np.empty(len(points)), place, count))
    divide(0, len(points), 0, len(moves.arc), search, np.empty(0, dtype=np.int64), np.empty(0))
    move, distance = np.empty(int(count.sum()), dtype=np.int64), np.empty(int(count.sum()))
    place[:] = np.cumsum(count) - count
    divide(0, len(points) if len(move) else 0, 0, len(moves.arc), search, move, distance)
    return np.repeat(np.arange(len(points)), count), move, distance


cpdef divide(
    Int low, Int high, Int first, Int last, Near search, Int[::1] moves, double[::1] distance
):
    """Compare the points low:high with the moves first:last, and store the nearest move of each.
    If `moves` and `distance` have room, write all moves within the limits there instead, those of
    a point from index `near.move` on."""
    cdef Int k, height, axis, end, split, part
    cdef double middle
    cdef bint larger
    cdef int[::1] candidates
    cdef Int[::1] waiting
    candidates, waiting = search.candidates, search.waiting
    if low >= high or first >= last:
        return
    for k in range(first, last):
        candidates[k - first] = k
    waiting[0], waiting[1], waiting[2], waiting[3] = low, high, 0, last - first
    height = 1
    while height > 0:
        height -= 1
        low, high = waiting[4 * height], waiting[4 * height + 1]
        first, last = waiting[4 * height + 2], waiting[4 * height + 3]
        axis, middle = _set_box(low, high, search)
        end = _keep_near(first, last, search)
        if end == last:
            continue
        if axis < 0 or high - low <= FEW_POINTS or end - last <= FEW_MOVES:
            if len(moves) > 0:
                _list(low, high, last, end, search, moves, distance)
            else:
                if end - last > len(search.distances):
                    search.distances = np.empty(2 * (end - last))
                _compare(low, high, last, end, search)
            continue
        if 2 * (end - last) <= last - first:
            first, last = last, end
        split = _divided(low, high, axis, middle, search)
        for part in range(2):
            # The larger part waits below the smaller one.
            larger = (split - low > high - split) == (part == 0)
            waiting[4 * height] = low if larger else split
            waiting[4 * height + 1] = split if larger else high
            waiting[4 * height + 2], waiting[4 * height + 3] = first, last
            height += 1


cdef (Int, double) _set_box(Int low, Int high, Near search) noexcept:
    """Set the box of the points low:high; return its longest side (−1: it is a point) and the
    middle of that side."""
    cdef Int side, axis, n
    cdef double longest, middle, smallest, largest, value
    cdef double[:, ::1] points
    cdef Int[::1] order
    cdef double[::1] box
    points, order, box = search.points, search.order, search.box
    side, longest, middle = -1, 0.0, 0.0
    for axis in range(3):
        smallest = largest = points[order[low], axis]
        for n in range(low + 1, high):
            value = points[order[n], axis]
            smallest = value if value < smallest else smallest
            largest = value if value > largest else largest
        box[axis], box[axis + 3] = smallest, largest
        if largest - smallest > longest:
            side, longest = axis, largest - smallest
            middle = smallest + 0.5 * longest
            middle = smallest if middle >= largest else middle
    return side, middle


cdef Int _keep_near(Int first, Int last, Near search) noexcept:
    """Copy those of the candidates first:last that come within the limits of the box to behind
    `last`; return the end of the copies."""
    cdef Int n, k, arc, end
    cdef double room, window, low_x, low_y, high_x, high_y, x, y, wide, tall, z, to_z, around, ax
    cdef double ay, bx, by, dx, dy, side, near_x, near_y, radius
    cdef int[::1] candidates
    cdef const double[:, :] start, ends, heights
    cdef double[:, ::1] arcs
    cdef double[::1] box
    candidates, box, arcs, heights = search.candidates, search.box, search.arcs, search.heights
    start, ends = search.start, search.end
    room, window, end = search.limit + SLACK_MM, search.window + SLACK_MM, last
    low_x, low_y, high_x, high_y = box[0] - room, box[1] - room, box[3] + room, box[4] + room
    x, y = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
    wide, tall = high_x - x, high_y - y
    for n in range(first, last):
        k = candidates[n]
        arc = search.arc[k]
        ax, ay, bx, by = start[k, 0], start[k, 1], ends[k, 0], ends[k, 1]
        if arc < 0:
            if min(ax, bx) > high_x or max(ax, bx) < low_x:
                continue
            if min(ay, by) > high_y or max(ay, by) < low_y:
                continue
        else:
            if arcs[arc, LOW_X] > high_x or arcs[arc, HIGH_X] < low_x:
                continue
            if arcs[arc, LOW_Y] > high_y or arcs[arc, HIGH_Y] < low_y:
                continue
        z, to_z = heights[k, 0], heights[k, 1]
        around = window * (1.0 + _slope(search, k))
        if min(z, to_z) > box[5] + around or max(z, to_z) < box[2] - around:
            continue
        if arc < 0:
            dx, dy = bx - ax, by - ay
            side = dx * (y - ay) - dy * (x - ax)
            if abs(side) > (wide * abs(dy) + tall * abs(dx)) * (1.0 + SLACK_MM):
                continue
        else:
            dx, dy = abs(x - arcs[arc, CX]), abs(y - arcs[arc, CY])
            near_x, near_y = max(dx - wide, 0.0), max(dy - tall, 0.0)
            radius = arcs[arc, RADIUS] + SLACK_MM
            if near_x * near_x + near_y * near_y > radius * radius:
                continue
            radius = max(arcs[arc, RADIUS] - SLACK_MM, 0.0)
            if (dx + wide) * (dx + wide) + (dy + tall) * (dy + tall) < radius * radius:
                continue
        candidates[end] = k
        end += 1
    return end


cdef inline double _slope(Near search, Int k) noexcept:
    """Return the change of height of a move divided by its length."""
    cdef double rise, length, dx, dy
    cdef Int arc
    rise, arc = abs(search.heights[k, 1] - search.heights[k, 0]), search.arc[k]
    if rise == 0.0:
        return 0.0
    if arc >= 0:
        length = search.arcs[arc, RADIUS] * search.arcs[arc, SWEEP]
    else:
        dx, dy = search.end[k, 0] - search.start[k, 0], search.end[k, 1] - search.start[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
    return float(rise / (length if length > 0.0 else 1.0))


cdef Int _divided(Int low, Int high, Int axis, double middle, Near search) noexcept:
    """Reorder the points low:high so that those not above the middle come first; return the index
    of the first of the others."""
    cdef Int split, n, point
    cdef double[:, ::1] points
    cdef Int[::1] order
    points, order = search.points, search.order
    split = low
    for n in range(low, high):
        point = order[n]
        if points[point, axis] <= middle:
            order[n], order[split] = order[split], point
            split += 1
    return split


cdef inline double _distance(Near search, Int k, double x, double y, double z) noexcept:
    """Return the distance of a point from a move; inf beyond the limits."""
    cdef Int arc
    cdef double from_z, rise, window, ax, ay, bx, by, share, dx, dy, px, py, square, distance, sine
    cdef double to_a, to_b
    cdef double[:, ::1] arcs
    arc, from_z = search.arc[k], search.heights[k, 0]
    rise, window = search.heights[k, 1] - from_z, search.window * (1.0 + _slope(search, k))
    if rise == 0.0 and abs(from_z - z) > window:
        return math.INFINITY
    ax, ay, bx, by = search.start[k, 0], search.start[k, 1], search.end[k, 0], search.end[k, 1]
    share = 0.0
    if arc < 0:
        dx, dy = bx - ax, by - ay
        px, py = x - ax, y - ay
        square = dx * dx + dy * dy
        share = (px * dx + py * dy) * (1.0 / (square if square > 0.0 else 1.0))
        share = min(max(share, 0.0), 1.0)
        px, py = px - share * dx, py - share * dy
        distance = math.sqrt(px * px + py * py)
    else:
        arcs = search.arcs
        px, py = x - arcs[arc, CX], y - arcs[arc, CY]
        sine = arcs[arc, UX] * py - arcs[arc, UY] * px
        if sine < 0.0 or px * arcs[arc, VY] - py * arcs[arc, VX] < 0.0:
            to_a, to_b = (x - ax) ** 2 + (y - ay) ** 2, (x - bx) ** 2 + (y - by) ** 2
            distance = math.sqrt(min(to_a, to_b))
        else:
            distance = abs(math.sqrt(px * px + py * py) - arcs[arc, RADIUS])
        if rise != 0.0 and distance <= search.limit:
            share = _share_of_arc(arcs, arc, ax, ay, px, py, sine)
    if distance > search.limit:
        return math.INFINITY
    if rise != 0.0 and abs(from_z + share * rise - z) > window:
        return math.INFINITY
    return distance


cdef double _share_of_arc(
    double[:, ::1] arcs, Int arc, double ax, double ay, double px, double py, double sine
) noexcept:
    """Return the parameter, 0 to 1, of the point of an arc nearest to (px, py); both (px, py) and
    the start (ax, ay) are about its centre."""
    cdef double angle, sweep
    ax, ay = ax - arcs[arc, CX], ay - arcs[arc, CY]
    angle, sweep = math.atan2(sine, ax * px + ay * py), arcs[arc, SWEEP]
    angle = angle + 2.0 * math.M_PI if angle < 0.0 else angle
    return 0.0 if angle > math.M_PI + 0.5 * sweep else min(angle / sweep, 1.0)


cdef void _compare(Int low, Int high, Int first, Int last, Near search) noexcept:
    """Store for each of the points low:high the nearest of the candidates first:last."""
    cdef Int i, point, n, count
    cdef double best, distance, x, y, z
    cdef double[:, ::1] points
    cdef Int[::1] order
    cdef int[::1] candidates
    cdef double[::1] distances
    points, order, candidates, distances = (
        search.points, search.order, search.candidates, search.distances
    )
    for i in range(low, high):
        point, best, count = order[i], math.INFINITY, 0
        x, y, z = points[point, 0], points[point, 1], points[point, 2]
        for n in range(first, last):
            distance = _distance(search, candidates[n], x, y, z)
            distances[n - first] = distance
            best = distance if distance < best else best
            count += 1 if distance < math.INFINITY else 0
        if count == 0:
            continue
        n = last - 1
        while distances[n - first] > best + EQUAL_MM:
            n -= 1
        search.distance[point], search.move[point] = best, candidates[n]
        search.count[point] = count


cdef void _list(
    Int low, Int high, Int first, Int last, Near search, Int[::1] moves, double[::1] distance
) noexcept:
    """Write, for each of the points low:high, all of the candidates first:last that are within the
    limits, and their distances."""
    cdef Int i, point, n, index
    cdef double gap, x, y, z
    cdef double[:, ::1] points
    cdef Int[::1] order
    cdef int[::1] candidates
    points, order, candidates = search.points, search.order, search.candidates
    for i in range(low, high):
        point = order[i]
        index = search.move[point]
        x, y, z = points[point, 0], points[point, 1], points[point, 2]
        for n in range(first, last):
            gap = _distance(search, candidates[n], x, y, z)
            if gap < math.INFINITY:
                moves[index], distance[index] = candidates[n], gap
                index += 1


def hilbert_places(const double[:, :] points, Int levels) -> Indices:
    """Return (K,) uint32 the position of points (K, 2) along Hilbert's curve in the unit square,
    whose sides are halved `levels` times.

    The quarters of a square come in the order (0, 0), (0, 1), (1, 1), (1, 0). In the first and the
    last the curve is that of the whole with X and Y exchanged, in the last it is mirrored besides.
    """
    cdef Int k, level, x, y, right, above, place
    cdef double size = 2.0**levels
    places = np.empty(len(points), dtype=np.uint32)
    cdef unsigned int[::1] out = places
    for k in range(points.shape[0]):
        x = <Int>math.fmin(points[k, 0] * size, size - 1.0)
        y = <Int>math.fmin(points[k, 1] * size, size - 1.0)
        place = 0
        for level in range(levels - 1, -1, -1):
            right, above = (x >> level) & 1, (y >> level) & 1
            place = 4 * place + ((3 * right) ^ above)
            if right and not above:
                x, y = ~x, ~y
            if not above:
                x, y = y, x
        out[k] = <unsigned int>place
    return places
