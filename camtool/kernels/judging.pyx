"""Judging the samples of a motion: errors, extents, circles and a thinned trace in one pass.

Samples come in blocks of at most `BLOCK`, each of one row of the program, and stay in the
processor's cache: a few loops run over a block before the next one comes. Per sample of a row
that cuts:

    interpolation = commanded position to the row's own move
    mechanics     = |slide − commanded|
    total         = slide to the nearest wanted move that the row may be compared with, and how
                    far what was drawn may lie from that

Memory is that of the rows, the moves and the circles; it does not grow with the samples.
Distances are exact; sums are taken in no certain order. Compiled, because a program takes millions
of steps.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.offsets cimport DEPTH, apart_square, wait_for_children
from camtool.kernels.types cimport Int
from camtool.kernels.wide cimport wide

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.arrays import Floats, Indices, Ints
from camtool.kernels import move_tree

# Of a node of `camtool.kernels.move_tree`: moves of a leaf, and the columns of its rows.
cdef Int LEAF = move_tree.LEAF
cdef Int FIRST_BELOW = move_tree.FIRST
cdef Int LAST_BELOW = move_tree.LAST

# Bins for the sizes of errors: those of a float's own bits. Plain numpy: no kernel.
#
# The exponent and the first `MANTISSA_BITS` bits of the mantissa, taken as one integer, grow with
# the number and make bins whose width is between 1/256 and 1/128 of their value.


def leading_bits(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """Return the leading bits of each float64 ≥ 0, as integers in the order of the values."""
    return np.right_shift(np.ascontiguousarray(values).view(np.int64), SHIFT)


# Sums, largest and smallest of finite numbers, one loop over a block for all that it is asked for.
#
# `LANES` partial results of each take turns, so that the processor handles several numbers at once
# and none waits for the one before; what is left at the end comes one by one. Which number goes to
# which is fixed: all processors round alike. Such a loop writes to no array besides: then its
# partial results stay in registers.


cpdef enum:
    # How many partial results take turns; a power of two.
    LANES = 32


cdef inline void fill_lanes(double* lanes, double value) noexcept nogil:
    """Set all lanes to one value."""
    cdef Int lane
    for lane in range(LANES):
        lanes[lane] = value


cdef inline double sum_of_lanes(double* lanes) noexcept nogil:
    """Return the sum of all partial sums, added in pairs; the lanes are overwritten."""
    cdef Int width, lane
    width = LANES // 2
    while width > 0:
        for lane in range(width):
            lanes[lane] += lanes[lane + width]
        width //= 2
    return lanes[0]


cdef inline double largest_of_lanes(double* lanes) noexcept nogil:
    """Return the largest of all lanes, compared in pairs; the lanes are overwritten."""
    cdef Int width, lane
    width = LANES // 2
    while width > 0:
        for lane in range(width):
            lanes[lane] = larger(lanes[lane], lanes[lane + width])
        width //= 2
    return lanes[0]


cdef inline double smallest_of_lanes(double* lanes) noexcept nogil:
    """Return the smallest of all lanes, compared in pairs; the lanes are overwritten."""
    cdef Int width, lane
    width = LANES // 2
    while width > 0:
        for lane in range(width):
            lanes[lane] = smaller(lanes[lane], lanes[lane + width])
        width //= 2
    return lanes[0]


cpdef double largest(double[::1] values, Int low, Int high) noexcept nogil:
    """Return the largest of values[low:high], which is not empty."""
    cdef double result
    _find_largest(values, low, high, &result)
    return result


cdef wide _find_largest(double[::1] values, Int low, Int high, double* result) noexcept nogil:
    cdef Int j, k, lane
    cdef double value
    cdef double[LANES] lanes
    value, k = values[low], low
    if high - low >= LANES:
        fill_lanes(lanes, -math.INFINITY)
        while k + LANES <= high:
            for lane in range(LANES):
                lanes[lane] = larger(values[k + lane], lanes[lane])
            k += LANES
        value = largest_of_lanes(lanes)
    for j in range(k, high):
        value = larger(values[j], value)
    result[0] = value


# How far points are from a move, with the side that they lie on: a line or an arc, many at once.
#
# The error of a point is its distance to the move, exact to the true line or arc, and positive to
# the left of the move's direction:
#
#     line a→b:  |p − a − t·d|,  d = b − a,  t = clamp((p − a)·d / d², 0, 1),  sign of d × (p − a)
#     arc:       ±(R − |p − c|) inside the wedge that the arc spans at its centre c, otherwise the
#                distance to its nearer end with that sign
#
# The wedge is told by the cross products with the spokes of the two ends: both, up to half a turn,
# and either, above it. What is exact: no angle is ever taken, and no chord. Compiled, and written
# as loops without branches over blocks of points, which the processor runs several at a time.


# Up to this part of its radius from a circle the series of a root stands for it.
cdef double NEAR = 2.0**-9


class Shapes(NamedTuple):
    """K moves: start and end (K, 2), (K, 2) mm; which of the arcs each is (K,), −1 for a line; and
    the arcs (A, 9)."""

    start: Floats
    end: Floats
    arc: Indices
    arcs: Floats


cdef class Curves:
    """The arrays of `Shapes`."""

    def __init__(self, shapes: Shapes) -> None:
        self.start, self.end, self.arc, self.arcs = shapes


cdef wide _to_line(
    const double[:, :] start, const double[:, :] end, Int row, double[::1] x, double[::1] y,
    double[::1] errors
) noexcept nogil:
    cdef Int k
    cdef double square, over
    ax, ay = start[row, 0], start[row, 1]
    dx, dy = end[row, 0] - ax, end[row, 1] - ay
    square = dx * dx + dy * dy
    over = 1.0 / square if square > 0.0 else 1.0
    for k in range(len(x)):
        px, py = x[k] - ax, y[k] - ay
        t = (px * dx + py * dy) * over
        t = smaller(larger(t, 0.0), 1.0)
        off_x, off_y = px - t * dx, py - t * dy
        distance = math.sqrt(off_x * off_x + off_y * off_y)
        errors[k] = math.copysign(distance, dx * py - dy * px)


cdef wide _count_outside(
    double[:, ::1] arcs, Int row, double[::1] x, double[::1] y, Int* result
) noexcept nogil:
    """Count the points outside of the wedge of an arc, the sector between the radii to its
    ends."""
    cdef Int k, outside
    cdef bint above_half
    cx, cy, ux, uy = arcs[row, CX], arcs[row, CY], arcs[row, UX], arcs[row, UY]
    vx, vy, above_half = arcs[row, VX], arcs[row, VY], arcs[row, WIDE] != 0.0
    outside = 0
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        depth = _depth(ux * py - uy * px, px * vy - py * vx, above_half)
        outside += 1 if depth < 0.0 else 0
    result[0] = outside


cdef inline bint _all_in_wedge(
    double[:, ::1] arcs, Int row, double[::1] x, double[::1] y
) noexcept nogil:
    cdef Int outside
    _count_outside(arcs, row, x, y, &outside)
    return outside == 0


cdef inline double _depth(double from_start, double from_end, bint above_half) noexcept nogil:
    """Return a number that is 0 or more in an arc's wedge, from how far a point lies on the inner
    side of its two edges."""
    if above_half:
        return larger(from_start, from_end)
    return smaller(from_start, from_end)


cdef inline double _off(double above, double half, double part) noexcept nogil:
    """Return the distance of a point outside a circle with |p|² − R² = `above`, if that is small.

    With `half` = 1 / 2R, h = above / 2R, `part` = 1 / 2R² and q = h / R = above / 2R² that is √(R²
    + 2Rh) − R = h (1 − q/2 + q²/2 − 5q³/8 + 7q⁴/8 − 21q⁵/16 + …); within |q| ≤ 2⁻⁹ the omitted
    terms are below 2⁻⁵³ R. Square roots take longer. With −`half` the sign is the other one, to
    the last bit.
    """
    q = above * part
    return above * half * (1.0 + q * (-0.5 + q * (0.5 + q * (-0.625 + q * 0.875))))


cdef inline double _outside(
    double px, double py, double radius, double half, double part
) noexcept nogil:
    """Return the distance of a point outside the circle, negative inside; (px, py) is relative to
    the centre, `half` and `part` are those of `_off`. The point alone decides between series and
    root, so equal points have equal last bits."""
    cdef bint is_near
    above = px * px + py * py - radius * radius
    distance = math.sqrt(px * px + py * py) - radius
    is_near = abs(above) <= 2.0 * NEAR * (radius * radius)
    return _off(above, half, part) if is_near else distance


cdef wide _to_circle(
    double[:, ::1] arcs, Int row, double[::1] x, double[::1] y, double[::1] errors
) noexcept nogil:
    cdef Int k, far
    cx, cy, radius, turn = arcs[row, CX], arcs[row, CY], arcs[row, RADIUS], arcs[row, TURN]
    square, half, part = radius * radius, 0.5 / radius, 0.5 / (radius * radius)
    near, inward, far = 2.0 * NEAR * square, -turn * half, 0
    if abs((x[0] - cx) ** 2 + (y[0] - cy) ** 2 - square) <= near:
        for k in range(len(x)):
            px, py = x[k] - cx, y[k] - cy
            above = px * px + py * py - square
            far += 1 if abs(above) > near else 0
            errors[k] = _off(above, inward, part)
        if far == 0:
            return
    for k in range(len(x)):
        errors[k] = -turn * _outside(x[k] - cx, y[k] - cy, radius, half, part)


cdef wide _to_arc(
    const double[:, :] start, const double[:, :] end, Int row, double[:, ::1] arcs, Int at,
    double[::1] x, double[::1] y, double[::1] errors
) noexcept nogil:
    cdef Int k
    cdef bint above_half, inside
    ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
    cx, cy, radius, turn = arcs[at, CX], arcs[at, CY], arcs[at, RADIUS], arcs[at, TURN]
    ux, uy, vx, vy = arcs[at, UX], arcs[at, UY], arcs[at, VX], arcs[at, VY]
    above_half, half, part = arcs[at, WIDE] != 0.0, 0.5 / radius, 0.5 / (radius * radius)
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        inward = -turn * _outside(px, py, radius, half, part)
        to_a = (x[k] - ax) * (x[k] - ax) + (y[k] - ay) * (y[k] - ay)
        to_b = (x[k] - bx) * (x[k] - bx) + (y[k] - by) * (y[k] - by)
        at_end = math.copysign(math.sqrt(smaller(to_a, to_b)), inward)
        inside = _depth(ux * py - uy * px, px * vy - py * vx, above_half) >= 0.0
        errors[k] = inward if inside else at_end


cpdef void set_errors(
    Curves curves, Int row, double[::1] x, double[::1] y, double[::1] errors
) noexcept nogil:
    """Set `errors` (n ≥ 1,) to the signed distances of the points x, y (n,) from one move."""
    cdef Int at
    at = curves.arc[row]
    if at < 0:
        _to_line(curves.start, curves.end, row, x, y, errors)
    elif curves.arcs[at, WIDE] == FULL or _all_in_wedge(curves.arcs, at, x, y):
        _to_circle(curves.arcs, at, x, y, errors)
    else:
        _to_arc(curves.start, curves.end, row, curves.arcs, at, x, y, errors)


cdef inline double smaller(double one, double other) noexcept nogil:
    """Return the smaller of two numbers, neither of which is NaN."""
    return one if one < other else other


cdef inline double larger(double one, double other) noexcept nogil:
    """Return the larger of two numbers, neither of which is NaN."""
    return one if one > other else other


cdef inline Int first_of(double[::1] values, Int low, Int high, double value) noexcept nogil:
    """Return the first index of `value` in values[low:high], which must contain it."""
    cdef Int index
    _find_first(values, low, high, value, &index)
    return index


cdef wide _find_first(
    double[::1] values, Int low, Int high, double value, Int* result
) noexcept nogil:
    cdef Int j, k, same
    k, same = low, 0
    while k + RUN <= high and same == 0:
        for j in range(k, k + RUN):
            same += 1 if values[j] == value else 0
        k += RUN if same == 0 else 0
    while values[k] != value:
        k += 1
    result[0] = k


# The nearest of many moves for points that follow each other, as the samples of a row do.
#
# All points are compared with one move first, their own, from which the row was written. Those on
# it are done: none is nearer. With D the largest error of some others in a row, no other move
# counts that is nowhere within D of these points: those that come so near to the box about the
# points, which lies along their way, are listed from a tree of the moves' boxes, and all these
# points are compared with them.
#
# A long list for many points is not looked at: the move nearest to the middle one lowers the
# errors, and each half of the points gets a list of its own. For one point, the move nearest to it
# is what is asked for. So what is found is exact, however far the own move is.
#
# On which side a point lies beside the corner of two moves, to which it is equally near, that move
# tells which it is more square to, from whose line, or tangent at the corner, it is farther: at
# a corner of more than a right angle the other one has the point on its wrong side.


cpdef enum:
    # A list of so many moves is looked at for any number of points.
    FEW = 8
    # A longer list is looked at where that takes at most so many distances.
    ENOUGH = 1024


# Moves whose distances differ by no more than this are equally near; points no farther than this
# from their own move lie on it.
cdef double TIE_MM = 1e-9

cpdef enum:
    # So many points in a row on their own move divide those before them from those behind them.
    ON_OWN = 16

# Limits are taken this part wider, plus `SLACK_MM`: rounding must not lose a move.
cdef double SLACK = 1e-12

# See `SLACK`.
cdef double SLACK_MM = 1e-12


class Moves(NamedTuple):
    """K moves, their heights (K, 2), and the nodes (2L, 6) and order (K,) of `move_tree`."""

    shapes: Shapes
    heights: Floats
    nodes: Floats
    order: Indices


def room_for(count: int, dtype: type[np.generic] = np.float64) -> npt.NDArray[Any]:
    """Return (count,) uninitialised numbers of 8 bytes, aligned to a cache line of the processor:
    no block of 64 bytes that is read or written at once lies in two lines."""
    buffer = np.empty(count + 8, dtype=dtype)
    begin = -buffer.ctypes.data % 64 // 8
    return buffer[begin : begin + count]


cdef class Search:
    """The nearest of moves: their arrays, room for what is looked at, and how many nodes and moves
    were looked at."""

    def __init__(self, moves: Moves) -> None:
        shapes, self.heights, self.nodes, self.order = moves
        self.curves = Curves(shapes)
        self.candidates, self.box = np.empty(ENOUGH, dtype=np.int64), np.empty(8)
        self.stack = np.empty(DEPTH, dtype=np.int64)
        self.parts = np.empty(DEPTH, dtype=np.int64)
        self.x, self.y, self.error = np.empty(1), np.empty(1), np.empty(1)
        self.other, self.by = room_for(BLOCK), room_for(BLOCK, np.int64)
        self.looked = 0


cdef inline bint is_searched(
    Int k, Int first, Int last, double z_low, double z_high, const double[:, :] heights
) noexcept nogil:
    """Return True if move k is one of first:last and its heights overlap z_low … z_high."""
    if k < first or k >= last:
        return False
    return bool(heights[k, 0] <= z_high and heights[k, 1] >= z_low)


cdef Int _nearest(
    double x, double y, double within, Int first, Int last, double z_low, double z_high,
    Search search
) noexcept nogil:
    """Return the move nearest to a point among those of first:last whose heights overlap z_low …
    z_high; −1 if none is nearer than `within` mm."""
    cdef Int leaves, height, node, low, place, k, nearest
    cdef double best
    cdef int[::1] order
    cdef Int[::1] stack
    cdef double[:, ::1] nodes
    cdef const double[:, :] heights
    cdef double[::1] spot_x, spot_y, spot_error
    heights, nodes, order = search.heights, search.nodes, search.order
    spot_x, spot_y, spot_error, stack = search.x, search.y, search.error, search.stack
    spot_x[0], spot_y[0] = x, y
    leaves = len(nodes) // 2
    best, nearest = within, -1
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        search.looked += 1
        if nodes[node, FIRST_BELOW] >= last or nodes[node, LAST_BELOW] <= first:
            continue
        if apart_square(nodes, node, x, y) > _looser(best) * _looser(best):
            continue
        if node < leaves:
            height = wait_for_children(nodes, node, x, y, stack, height)
            continue
        low = (node - leaves) * LEAF
        for place in range(low, min(low + LEAF, len(order))):
            k = order[place]
            if is_searched(k, first, last, z_low, z_high, heights):
                search.looked += 1
                set_errors(search.curves, k, spot_x, spot_y, spot_error)
                if abs(spot_error[0]) < best:
                    best, nearest = abs(spot_error[0]), k
    return nearest


cdef inline double _looser(double limit) noexcept nogil:
    return limit * (1.0 + SLACK) + SLACK_MM


cdef wide _set_box(
    double[::1] x, double[::1] y, double[::1] errors, double[::1] box
) noexcept nogil:
    """Set the box that contains all places within the largest of the `errors` of the points x, y
    (n ≥ 1,). Its centre is in the middle between the first and the last point."""
    cdef Int count, k, j, lane
    cdef double middle_x, middle_y, way_x, way_y, px, py, long, wide, far
    cdef double[LANES] longs, wides, fars
    count = len(x)
    middle_x, middle_y = 0.5 * (x[0] + x[count - 1]), 0.5 * (y[0] + y[count - 1])
    way_x, way_y = x[count - 1] - x[0], y[count - 1] - y[0]
    length = math.sqrt(way_x * way_x + way_y * way_y)
    way_x = way_x / length if length > 0.0 else 1.0
    way_y = way_y / length if length > 0.0 else 0.0
    long, wide, far, k = 0.0, 0.0, 0.0, 0
    if count >= LANES:
        fill_lanes(longs, 0.0)
        fill_lanes(wides, 0.0)
        fill_lanes(fars, 0.0)
        while k + LANES <= count:
            for lane in range(LANES):
                px, py = x[k + lane] - middle_x, y[k + lane] - middle_y
                longs[lane] = larger(longs[lane], abs(px * way_x + py * way_y))
                wides[lane] = larger(wides[lane], abs(py * way_x - px * way_y))
                fars[lane] = larger(fars[lane], abs(errors[k + lane]))
            k += LANES
        long, wide = largest_of_lanes(longs), largest_of_lanes(wides)
        far = largest_of_lanes(fars)
    for j in range(k, count):
        px, py = x[j] - middle_x, y[j] - middle_y
        long = larger(long, abs(px * way_x + py * way_y))
        wide = larger(wide, abs(py * way_x - px * way_y))
        far = larger(far, abs(errors[j]))
    far = _looser(far) + TIE_MM + SLACK * (abs(middle_x) + abs(middle_y) + long)
    long, wide = long + far, wide + far
    box[MIDDLE_X], box[MIDDLE_Y], box[WAY_X], box[WAY_Y] = middle_x, middle_y, way_x, way_y
    box[HALF_LONG], box[HALF_WIDE] = long, wide
    box[HALF_X] = abs(way_x) * long + abs(way_y) * wide
    box[HALF_Y] = abs(way_y) * long + abs(way_x) * wide


cdef inline bint node_near(double[:, ::1] nodes, Int node, double[::1] box) noexcept nogil:
    """Return True if the box of a node may have a point in common with `box`."""
    cdef double low_x, low_y, high_x, high_y, aside, reach
    low_x, low_y = nodes[node, 0] - box[MIDDLE_X], nodes[node, 1] - box[MIDDLE_Y]
    high_x, high_y = nodes[node, 2] - box[MIDDLE_X], nodes[node, 3] - box[MIDDLE_Y]
    if low_x > box[HALF_X] or high_x < -box[HALF_X]:
        return False
    if low_y > box[HALF_Y] or high_y < -box[HALF_Y]:
        return False
    aside = (low_y + high_y) * box[WAY_X] - (low_x + high_x) * box[WAY_Y]
    reach = (high_y - low_y) * abs(box[WAY_X]) + (high_x - low_x) * abs(box[WAY_Y])
    return bool(abs(aside) <= (reach + 2.0 * box[HALF_WIDE]) * (1.0 + SLACK))


cdef inline bint move_near(Curves curves, Int k, double[::1] box) noexcept nogil:
    """Return True if a move may have a point in `box`; an arc counts as its full circle."""
    cdef Int at
    cdef double ax, ay, way_x, way_y, long, wide, px, py, along, aside, near_long, near_wide
    cdef double far_long, far_wide, square, to_x, to_y, further, across, side, reach
    way_x, way_y, long, wide = box[WAY_X], box[WAY_Y], box[HALF_LONG], box[HALF_WIDE]
    at = curves.arc[k]
    if at >= 0:
        px, py = curves.arcs[at, CX] - box[MIDDLE_X], curves.arcs[at, CY] - box[MIDDLE_Y]
        along, aside = abs(px * way_x + py * way_y), abs(py * way_x - px * way_y)
        near_long, near_wide = larger(along - long, 0.0), larger(aside - wide, 0.0)
        far_long, far_wide = along + long, aside + wide
        square = curves.arcs[at, RADIUS] * curves.arcs[at, RADIUS]
        if near_long * near_long + near_wide * near_wide > square * (1.0 + SLACK):
            return False
        return bool(far_long * far_long + far_wide * far_wide >= square * (1.0 - SLACK))
    ax, ay = curves.start[k, 0], curves.start[k, 1]
    px, py = ax - box[MIDDLE_X], ay - box[MIDDLE_Y]
    to_x, to_y = curves.end[k, 0] - ax, curves.end[k, 1] - ay
    aside, across = py * way_x - px * way_y, to_y * way_x - to_x * way_y
    if smaller(aside, aside + across) > wide or larger(aside, aside + across) < -wide:
        return False
    along, further = px * way_x + py * way_y, to_x * way_x + to_y * way_y
    if smaller(along, along + further) > long or larger(along, along + further) < -long:
        return False
    side = abs(along * across - aside * further)
    reach = long * abs(across) + wide * abs(further)
    return bool(side <= reach + SLACK * (abs(along * across) + abs(aside * further)))


cdef bint _is_there(Curves curves, Int[::1] moves, Int count, Int move) noexcept nogil:
    """Return True if the move is one of the first `count` in the list; all turns of the same
    circle are equal."""
    cdef Int n
    n = 0
    while n < count and not are_same(curves, moves[n], move):
        n += 1
    return n < count


cdef inline bint are_same(Curves curves, Int one, Int other) noexcept nogil:
    cdef Int at, other_arc, k, axis
    for axis in range(2):
        if curves.start[one, axis] != curves.start[other, axis]:
            return False
        if curves.end[one, axis] != curves.end[other, axis]:
            return False
    at, other_arc, k = int(curves.arc[one]), int(curves.arc[other]), 0
    if at < 0 or other_arc < 0:
        return at == other_arc
    while k < COLUMNS and curves.arcs[at, k] == curves.arcs[other_arc, k]:
        k += 1
    return k == COLUMNS


cdef double squareness(Curves curves, Int k, double x, double y) noexcept nogil:
    """Return the distance (mm) of a point from a move's infinite line; from an arc, or beyond its
    ends from the tangent there."""
    cdef Int at
    cdef double ax, ay, bx, by, cx, cy, px, py, long, across, wide, end_x, end_y, to_a, to_b
    cdef double from_start, from_end
    at = curves.arc[k]
    ax, ay = curves.start[k, 0], curves.start[k, 1]
    bx, by = curves.end[k, 0], curves.end[k, 1]
    if at < 0:
        long = math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
        across = abs((bx - ax) * (y - ay) - (by - ay) * (x - ax))
        return float(across / long) if long > 0.0 else 0.0
    cx, cy, radius = curves.arcs[at, CX], curves.arcs[at, CY], curves.arcs[at, RADIUS]
    px, py = x - cx, y - cy
    from_start = curves.arcs[at, UX] * py - curves.arcs[at, UY] * px
    from_end = px * curves.arcs[at, VY] - py * curves.arcs[at, VX]
    wide = curves.arcs[at, WIDE]
    if wide == FULL or _depth(from_start, from_end, wide != 0.0) >= 0.0:
        return float(abs(math.sqrt(px * px + py * py) - radius))
    to_a = (x - ax) * (x - ax) + (y - ay) * (y - ay)
    to_b = (x - bx) * (x - bx) + (y - by) * (y - by)
    end_x, end_y = (ax - cx, ay - cy) if to_a < to_b else (bx - cx, by - cy)
    return float(abs((px * end_x + py * end_y) / radius - radius))


cdef void _lowered(
    double[::1] x, double[::1] y, Int move, Search search, double[::1] errors, Int[::1] by
) noexcept nogil:
    """Lower the errors of the points x, y (n,) against the moves `by` (n,) to those against one
    more move where it is nearer. Of equally near moves the one counts to which the point is more
    square."""
    cdef Int k
    cdef double less, square
    cdef double[::1] other
    other = search.other
    set_errors(search.curves, move, x, y, other[: len(x)])
    for k in range(len(x)):
        less = abs(errors[k]) - abs(other[k])
        if less < -TIE_MM:
            continue
        if less <= TIE_MM:
            square = squareness(search.curves, by[k], x[k], y[k]) + TIE_MM
            if squareness(search.curves, move, x[k], y[k]) <= square:
                continue
        errors[k], by[k] = other[k], move


cdef Int _list_near(
    double[::1] x, double[::1] y, double[::1] errors, Int own, Int first, Int last, double z_low,
    double z_high, Search search
) noexcept nogil:
    """List the moves that may be nearer to some of the points x, y (n,) than `own`, from which
    they have these errors; `own` comes first. Return their number, 0 where they are too many."""
    cdef Int leaves, height, node, low, place, k, count, limit, some
    cdef int[::1] order
    cdef Int[::1] stack, candidates
    cdef double[:, ::1] nodes
    cdef const double[:, :] heights
    cdef double[::1] box
    heights, nodes, order = search.heights, search.nodes, search.order
    stack, candidates, box = search.stack, search.candidates, search.box
    _set_box(x, y, errors, box)
    some = len(x)
    limit = max(FEW, ENOUGH // some)
    leaves = len(nodes) // 2
    candidates[0], count = own, 1
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        search.looked += 1
        if nodes[node, FIRST_BELOW] >= last or nodes[node, LAST_BELOW] <= first:
            continue
        if not node_near(nodes, node, box):
            continue
        if node < leaves:
            stack[height], stack[height + 1] = 2 * node + 1, 2 * node
            height += 2
            continue
        low = (node - leaves) * LEAF
        for place in range(low, min(low + LEAF, len(order))):
            k = order[place]
            if not is_searched(k, first, last, z_low, z_high, heights):
                continue
            search.looked += 1
            # To look for it among more than there are points takes longer than to compare it.
            if move_near(search.curves, k, box) and not _is_there(search.curves, candidates, min(count, some), k):
                if count == limit:
                    return 0
                candidates[count] = k
                count += 1
    return count


cpdef bint nearest_errors(
    double[::1] x, double[::1] y, Int own, Int first, Int last, double z_low, double z_high,
    Search search, double[::1] out
) noexcept nogil:
    """Set `out` to the error of each of the points x, y (1 ≤ n ≤ `BLOCK`,) against the nearest of
    the moves first:last whose heights overlap z_low … z_high, or of all of these where none
    overlaps. The sign is that of `set_errors`; of equally near moves the one counts to which the
    point is most square, or `own`. Return False, and set inf, where there is no move. `own` is the
    move that the points are expected to follow, or −1."""
    cdef Int begin, end, height, low, high, middle, k, n, near
    cdef bint is_listed
    cdef double far
    cdef Int[::1] parts, by, candidates, owners
    cdef double[::1] here_x, here_y, errors
    parts, middle = search.parts, len(x) // 2
    if not is_searched(own, first, last, z_low, z_high, search.heights):
        far = math.INFINITY
        own = _nearest(x[middle], y[middle], far, first, last, z_low, z_high, search)
        if own < 0:
            z_low, z_high = -far, far
            own = _nearest(x[middle], y[middle], far, first, last, z_low, z_high, search)
        if own < 0:
            for k in range(len(x)):
                out[k] = far
            return False
    set_errors(search.curves, own, x, y, out)
    by, candidates = search.by, search.candidates
    begin = _first_off(out, 0)
    while begin < len(x):
        end, is_listed = _end_of_off(out, begin), False
        height, parts[0], parts[1] = 2, begin, end
        while height > 0:
            height -= 2
            low, high = parts[height], parts[height + 1]
            here_x, here_y, errors, owners = x[low:high], y[low:high], out[low:high], by[low:high]
            near = _list_near(here_x, here_y, errors, own, first, last, z_low, z_high, search)
            if near == 1:
                continue
            if not is_listed:
                for k in range(begin, end):
                    by[k] = own
                is_listed = True
            for n in range(1, near):
                _lowered(here_x, here_y, candidates[n], search, errors, owners)
            if near > 0:
                continue
            middle = (low + high) // 2
            within = abs(out[middle])
            k = _nearest(x[middle], y[middle], within, first, last, z_low, z_high, search)
            if k >= 0:
                _lowered(here_x, here_y, k, search, errors, owners)
            if high - low > 1:
                parts[height], parts[height + 1] = middle, high
                parts[height + 2], parts[height + 3] = low, middle
                height += 4
        begin = _first_off(out, end)
    return True


cdef Int _first_off(double[::1] errors, Int low) noexcept nogil:
    """Return the first point from `low` on that does not lie on its own move; the number of points
    if all do."""
    cdef Int k
    k = low
    while k < len(errors) and abs(errors[k]) <= TIE_MM:
        k += 1
    return k


cdef Int _end_of_off(double[::1] errors, Int low) noexcept nogil:
    """Return the first index after `low`, a point off its own move, at which `ON_OWN` consecutive
    points on that move begin; the number of points if there is none."""
    cdef Int end, k
    end = low + 1
    while end + ON_OWN <= len(errors):
        k = end + ON_OWN - 1
        while k >= end and abs(errors[k]) <= TIE_MM:
            k -= 1
        if k < end:
            return end
        end = k + 1
    return len(errors)


# The points about a circle in bins of their angle, without an angle per point.
#
# A point p about the centre lies in bin b when it is to the left of the bin's first direction and
# to the right of the next one's: two cross products. Points that follow each other mostly stay in
# one bin, so the arc tangent is taken only when one leaves it. Of each bin are kept: how many
# points, their sum, the nearest and the farthest with their places.


cpdef enum:
    # Angle bins of a circle: half a degree each.
    ANGLE_BINS = 720
    # So many points are looked at together to find the first that differs.
    RUN = 64
    # Of a bin: count; sum x, y; least |p|², its x, y; largest |p|², its x, y.
    BIN_COLUMNS = 9


def bin_directions() -> Floats:
    """Return (721, 2) the directions that separate the bins."""
    angle = np.arange(ANGLE_BINS + 1) % ANGLE_BINS * (2.0 * np.pi / ANGLE_BINS)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def empty_bins(count: int) -> Floats:
    """Return (count, 720, 9) the empty bins of circles."""
    bins = np.zeros((count, ANGLE_BINS, BIN_COLUMNS))
    bins[:, :, 3], bins[:, :, 6] = np.inf, -np.inf
    return bins


cdef Int _bin_of(double x, double y, double[:, ::1] directions) noexcept nogil:
    """Return the bin of a point: by its angle, and on the edge of two bins by the cross
    products."""
    cdef Int which
    turn = math.atan2(y, x) / (2.0 * math.M_PI)
    turn = turn + 1.0 if turn < 0.0 else turn
    which = int(turn * ANGLE_BINS)
    which = min(which, ANGLE_BINS - 1)
    if directions[which, 0] * y - directions[which, 1] * x < 0.0:
        return (which + ANGLE_BINS - 1) % ANGLE_BINS
    if x * directions[which + 1, 1] - y * directions[which + 1, 0] <= 0.0:
        return (which + 1) % ANGLE_BINS
    return which


cdef wide _count_in_bin(
    double[::1] x, double[::1] y, Int low, double cx, double cy, double[:, ::1] directions,
    Int which, Int* result
) noexcept nogil:
    """Count the consecutive points x, y (n,) from `low` on that lie in the bin `which`; the first
    one does."""
    cdef Int j, k, outside
    cdef bint out
    from_x, from_y = directions[which, 0], directions[which, 1]
    to_x, to_y = directions[which + 1, 0], directions[which + 1, 1]
    k, outside = low, 0
    # Some at once, as long as all of them do.
    while k + RUN <= len(x) and outside == 0:
        for j in range(k, k + RUN):
            px, py = x[j] - cx, y[j] - cy
            out = (from_x * py - from_y * px < 0.0) | (px * to_y - py * to_x <= 0.0)
            outside += 1 if out else 0
        k += RUN if outside == 0 else 0
    while k < len(x):
        px, py = x[k] - cx, y[k] - cy
        if from_x * py - from_y * px < 0.0 or px * to_y - py * to_x <= 0.0:
            break
        k += 1
    result[0] = max(k - low, 1)


cpdef void fill_bins(
    double[::1] x, double[::1] y, double cx, double cy, double[:, ::1] directions,
    double[:, ::1] bins
) noexcept nogil:
    """Put the points x, y (n,) about the centre (cx, cy) into `bins` (720, 9)."""
    cdef Int first, which, stay
    first = 0
    while first < len(x):
        which = _bin_of(x[first] - cx, y[first] - cy, directions)
        _count_in_bin(x, y, first, cx, cy, directions, which, &stay)
        _add(x, y, first, first + stay, cx, cy, bins, which)
        first += stay


cdef wide _add(
    double[::1] x, double[::1] y, Int low, Int high, double cx, double cy, double[:, ::1] bins,
    Int which
) noexcept nogil:
    """Put the points low … high − 1 into one bin."""
    cdef Int j, k, lane
    cdef double px, py, square, sum_x, sum_y, smallest, largest_square
    cdef double[LANES] sums_x, sums_y, leasts, mosts
    sum_x, sum_y, smallest, largest_square, k = 0.0, 0.0, math.INFINITY, 0.0, low
    if high - low >= LANES:
        fill_lanes(sums_x, 0.0)
        fill_lanes(sums_y, 0.0)
        fill_lanes(leasts, math.INFINITY)
        fill_lanes(mosts, 0.0)
        while k + LANES <= high:
            for lane in range(LANES):
                px, py = x[k + lane] - cx, y[k + lane] - cy
                square = px * px + py * py
                sums_x[lane] += px
                sums_y[lane] += py
                leasts[lane] = smaller(square, leasts[lane])
                mosts[lane] = larger(square, mosts[lane])
            k += LANES
        sum_x, sum_y = sum_of_lanes(sums_x), sum_of_lanes(sums_y)
        smallest, largest_square = smallest_of_lanes(leasts), largest_of_lanes(mosts)
    for j in range(k, high):
        px, py = x[j] - cx, y[j] - cy
        square = px * px + py * py
        sum_x += px
        sum_y += py
        smallest, largest_square = smaller(square, smallest), larger(square, largest_square)
    bins[which, 0] += high - low
    bins[which, 1] += sum_x
    bins[which, 2] += sum_y
    if smallest < bins[which, 3]:
        _place(x, y, low, cx, cy, smallest, bins, which, 3)
    if largest_square > bins[which, 6]:
        _place(x, y, low, cx, cy, largest_square, bins, which, 6)


cdef void _place(
    double[::1] x, double[::1] y, Int low, double cx, double cy, double square,
    double[:, ::1] bins, Int which, Int column
) noexcept nogil:
    """Store in a bin the first point from `low` on whose squared distance from the centre is
    `square`."""
    cdef Int k
    k = low
    while (x[k] - cx) * (x[k] - cx) + (y[k] - cy) * (y[k] - cy) != square:
        k += 1
    bins[which, column] = square
    bins[which, column + 1], bins[which, column + 2] = x[k] - cx, y[k] - cy


# The path of the slides, thinned as it comes: of so many samples of a row that with the largest
# error, and each row's last.
#
# The pen holds what is not yet written: the largest of the present run, and the last sample.


def new_pen(stride: int, room: int) -> Floats:
    """Return a pen that holds nothing yet."""
    pen = np.zeros(PEN)
    pen[STRIDE], pen[ROOM], pen[ROW], pen[PEAK] = stride, room, -1.0, -1.0
    return pen


def unwritten(pen: Floats) -> Floats:
    """Return (0 to 2, 4) points that the pen still holds: x, y, error, row."""
    peak, last = pen[[PEAK_X, PEAK_Y, PEAK, ROW]], pen[[LAST_X, LAST_Y, LAST_ERROR, ROW]]
    samples = [peak] if pen[IN_RUN] > 0.0 else []
    if pen[ROW] >= 0.0 and not (pen[LAST_IS_WRITTEN] > 0.0):
        samples.append(last)
    return np.array(samples).reshape(-1, 4)


cdef void _write(double[::1] pen, double x, double y, double error, double[:, ::1] trace) noexcept nogil:
    cdef Int at
    at = int(pen[WRITTEN])
    trace[at, 0], trace[at, 1], trace[at, 2], trace[at, 3] = x, y, error, pen[ROW]
    pen[WRITTEN] += 1.0


cdef void end_run(double[::1] pen, double[:, ::1] trace) noexcept nogil:
    if pen[IN_RUN] > 0.0 and pen[WRITTEN] < pen[ROOM]:
        _write(pen, pen[PEAK_X], pen[PEAK_Y], pen[PEAK], trace)
    elif pen[IN_RUN] > 0.0:
        pen[LAST_IS_WRITTEN] = 0.0
    pen[IN_RUN], pen[PEAK] = 0.0, -1.0


cdef void end_row(double[::1] pen, double[:, ::1] trace) noexcept nogil:
    """Write the points that the pen still holds."""
    end_run(pen, trace)
    if pen[ROW] >= 0.0 and pen[LAST_IS_WRITTEN] == 0.0:
        _write(pen, pen[LAST_X], pen[LAST_Y], pen[LAST_ERROR], trace)
        pen[LAST_IS_WRITTEN] = 1.0


cpdef void trace_block(
    Int row, double[::1] x, double[::1] y, double[::1] error, double max_error, double[::1] pen,
    double[:, ::1] trace
) noexcept nogil:
    """Add points x, y (n,) of one row to the trace. `error` (n,): their errors, the largest of
    which is `max_error`; 0 if there are none. A full trace takes only the ends of rows; a pen
    whose runs have no samples writes nothing."""
    cdef Int count, low, high, at, to_stride
    cdef double peak
    count = len(x)
    if pen[STRIDE] <= 0.0:
        return
    if pen[ROW] != row:
        end_row(pen, trace)
        pen[ROW] = row
    low = 0
    while low < count:
        to_stride = int(pen[STRIDE] - pen[IN_RUN])
        high = min(count, low + to_stride)
        at, peak = low, 0.0
        if max_error > pen[PEAK] and max_error > 0.0:
            peak = largest(error, low, high)
            at = first_of(error, low, high, peak)
        if peak > pen[PEAK]:
            pen[PEAK], pen[PEAK_X], pen[PEAK_Y] = peak, x[at], y[at]
            pen[LAST_IS_WRITTEN] = 1.0 if at == high - 1 else 0.0
        else:
            pen[LAST_IS_WRITTEN] = 0.0
        pen[IN_RUN] += high - low
        pen[LAST_X], pen[LAST_Y] = x[high - 1], y[high - 1]
        pen[LAST_ERROR] = error[high - 1] if max_error > 0.0 else 0.0
        if pen[IN_RUN] >= pen[STRIDE]:
            end_run(pen, trace)
        low = high


# No slide is farther from zero (a thousand kilometres): squares of such positions and their sums
# stay finite, which all loops here and below take for granted. What judges steps on the way keeps
# to it by its own limits: five digits of micrometres, and the ranges of a machine file.
cdef double FARTHEST_MM = 1e9


class Task(NamedTuple):
    """Input for judging the N rows from `low` on.

    own: the J moves of the rows that cut, and the K moves that are wanted; rows
    (N, 6): which of `own` a row is, −1 where nothing is cut, first and last of the moves that it
    is compared with, the circle that it goes round or −1, the bins of that, and the one of the
    moves that it is expected to follow or −1; window (N, 2)
    between which heights moves are compared; off (N,) mm: how far what was drawn lies at most from
    the moves that a row is compared with; centre (C, 2) mm of circles; directions (721, 2) of
    `circle_bins`.
    """

    low: int
    own: Shapes
    moves: Moves
    rows: Ints
    window: Floats
    off: Floats
    centre: Floats
    directions: Floats


class Sums(NamedTuple):
    """Results: rows (N, 19), those of the task; histograms (2, 4 BINS) of interpolation and
    total, every fourth sample in the same place of its four; bins (S, 720, 9); trace (T, 4) x, y,
    error, row, and its pen; pieces of lines whose errors the histograms lack
    (`camtool.kernels.lines`)."""

    rows: Floats
    histograms: Ints
    bins: Floats
    trace: Floats
    pen: Floats
    pieces: list[Floats]


cdef class Judge:
    """Arrays of a task and its sums, and scratch buffers for a block of `BLOCK` samples: commanded
    positions and slides, mm, their errors, sizes of errors and bins of sizes."""

    def __init__(self, task: Task, sums: Sums) -> None:
        self.low, self.own, self.rows = task.low, Curves(task.own), task.rows
        self.window, self.off = task.window, task.off
        self.centre, self.directions = task.centre, task.directions
        self.figures, self.histograms, self.bins = sums.rows, sums.histograms, sums.bins
        self.trace, self.pen = sums.trace, sums.pen
        self.search = Search(task.moves)
        self.x, self.y = room_for(BLOCK), room_for(BLOCK)
        self.slide_x, self.slide_y = room_for(BLOCK), room_for(BLOCK)
        size = room_for(BLOCK)
        self.errors, self.size, self.bits = room_for(BLOCK), size, size.view(np.int64)
        self.places = np.empty(BLOCK, dtype=np.int32)


cdef wide _spread(
    double[:, ::1] figures, Int row, double[::1] x, double[::1] y, double[::1] slide_x,
    double[::1] slide_y, double* largest_square, double* sum_of_squares
) noexcept nogil:
    """Widen the extents of the slides; compute the largest square of mechanics and their sum."""
    cdef Int j, k, lane
    cdef double low_x, low_y, high_x, high_y, far, sum_, here_x, here_y, off_x, off_y, square
    cdef double[LANES] lows_x, lows_y, highs_x, highs_y, mosts, sums
    low_x, low_y = figures[row, LOW_X], figures[row, LOW_Y]
    high_x, high_y = figures[row, HIGH_X], figures[row, HIGH_Y]
    far, sum_, k = 0.0, 0.0, 0
    if len(x) >= LANES:
        fill_lanes(lows_x, math.INFINITY)
        fill_lanes(lows_y, math.INFINITY)
        fill_lanes(highs_x, -math.INFINITY)
        fill_lanes(highs_y, -math.INFINITY)
        fill_lanes(mosts, 0.0)
        fill_lanes(sums, 0.0)
        while k + LANES <= len(x):
            for lane in range(LANES):
                here_x, here_y = slide_x[k + lane], slide_y[k + lane]
                off_x, off_y = here_x - x[k + lane], here_y - y[k + lane]
                square = off_x * off_x + off_y * off_y
                lows_x[lane] = smaller(here_x, lows_x[lane])
                lows_y[lane] = smaller(here_y, lows_y[lane])
                highs_x[lane] = larger(here_x, highs_x[lane])
                highs_y[lane] = larger(here_y, highs_y[lane])
                mosts[lane] = larger(square, mosts[lane])
                sums[lane] += square
            k += LANES
        sum_ = sum_of_lanes(sums)
        low_x = smaller(smallest_of_lanes(lows_x), low_x)
        low_y = smaller(smallest_of_lanes(lows_y), low_y)
        high_x = larger(largest_of_lanes(highs_x), high_x)
        high_y = larger(largest_of_lanes(highs_y), high_y)
        far = largest_of_lanes(mosts)
    for j in range(k, len(x)):
        off_x, off_y = slide_x[j] - x[j], slide_y[j] - y[j]
        square = off_x * off_x + off_y * off_y
        low_x, low_y = smaller(slide_x[j], low_x), smaller(slide_y[j], low_y)
        high_x, high_y = larger(slide_x[j], high_x), larger(slide_y[j], high_y)
        far = larger(square, far)
        sum_ += square
    figures[row, LOW_X], figures[row, LOW_Y] = low_x, low_y
    figures[row, HIGH_X], figures[row, HIGH_Y] = high_x, high_y
    largest_square[0], sum_of_squares[0] = far, sum_


cdef struct ErrorSums:
    # Of a block: the largest size, the sum of the squares of sizes, and of the signed errors.
    double largest, squares, signed_errors


cdef wide _sizes(
    double[::1] errors, double off, double[::1] size, Int[::1] bits, int[::1] places,
    ErrorSums* result
) noexcept nogil:
    """Compute the sizes of errors, each increased by `off`, and their places in a histogram, in
    four alternating parts so that no sample waits for the one before. `bits` are the bits of
    `size`."""
    cdef Int j, k, lane, leading
    cdef double largest_size, squares, signed
    cdef double[LANES] mosts, sums, signs
    for j in range(len(errors)):
        size[j] = abs(errors[j]) + off
    largest_size, squares, signed, k = 0.0, 0.0, 0.0, 0
    if len(errors) >= LANES:
        fill_lanes(mosts, 0.0)
        fill_lanes(sums, 0.0)
        fill_lanes(signs, 0.0)
        while k + LANES <= len(errors):
            for lane in range(LANES):
                mosts[lane] = larger(size[k + lane], mosts[lane])
                sums[lane] += size[k + lane] * size[k + lane]
                signs[lane] += errors[k + lane]
                places[k + lane] = _place_of(bits[k + lane], lane & 3)
            k += LANES
        squares, signed = sum_of_lanes(sums), sum_of_lanes(signs)
        largest_size = largest_of_lanes(mosts)
    for j in range(k, len(errors)):
        largest_size = larger(size[j], largest_size)
        squares += size[j] * size[j]
        signed += errors[j]
        places[j] = _place_of(bits[j], j & 3)
    result.largest, result.squares, result.signed_errors = largest_size, squares, signed


cdef inline int _place_of(Int bits, Int turn) noexcept nogil:
    """Return the place of a size ≥ 0 in a histogram, from its bits."""
    return 4 * min(max((bits >> SHIFT) - BEFORE_FIRST, 0), BINS - 1) + turn


cdef void _count(int[::1] places, Int count, Int[:, ::1] histograms, Int which) noexcept nogil:
    cdef Int k
    for k in range(count):
        histograms[which, places[k]] += 1


cdef void judge_block(Int row, Int count, Judge judge) noexcept nogil:
    """Judge the first `count` samples in the judge's buffers, all of one row."""
    cdef Int last, own, of_program, k, circle, first, end, other
    cdef Int[:, ::1] rows
    cdef Int[::1] bits
    cdef int[::1] places
    cdef double shown, lag, lags
    cdef ErrorSums sums
    cdef double[:, ::1] figures, window, bins
    cdef double[::1] x, y, slide_x, slide_y, errors, size, pen
    if count == 0:
        return
    x, y, slide_x, slide_y = (
        judge.x[:count],
        judge.y[:count],
        judge.slide_x[:count],
        judge.slide_y[:count],
    )
    errors, size, bits, places = judge.errors[:count], judge.size[:count], judge.bits, judge.places
    figures, rows, window, pen = judge.figures, judge.rows, judge.window, judge.pen
    of_program, row = row, row - judge.low
    _spread(figures, row, x, y, slide_x, slide_y, &lag, &lags)
    last = count - 1
    figures[row, SAMPLES] += count
    figures[row, END_X], figures[row, END_Y] = slide_x[last], slide_y[last]
    figures[row, COMMANDED_X], figures[row, COMMANDED_Y] = x[last], y[last]
    own, circle, shown = rows[row, OWN], rows[row, CIRCLE], 0.0
    if own >= 0:
        figures[row, LAG_MAX] = max(figures[row, LAG_MAX], math.sqrt(lag))
        figures[row, LAG_SQUARES] += lags
        set_errors(judge.own, own, x, y, errors)
        _sizes(errors, 0.0, size, bits, places, &sums)
        figures[row, INNER_MAX] = max(figures[row, INNER_MAX], sums.largest)
        figures[row, INNER_SQUARES] += sums.squares
        _count(places, count, judge.histograms, 0)
        first, end = rows[row, FIRST], rows[row, LAST]
        z_low, z_high = window[row, 0], window[row, 1]
        other = rows[row, BESIDE]
        if nearest_errors(slide_x, slide_y, other, first, end, z_low, z_high, judge.search, errors):
            _sizes(errors, judge.off[row], size, bits, places, &sums)
            shown = sums.largest
            figures[row, TOTAL_SQUARES] += sums.squares
            figures[row, TOTAL_SUM] += sums.signed_errors
            if shown > figures[row, TOTAL_MAX] or figures[row, KNOWN] == 0.0:
                k = first_of(size, 0, count, shown)
                figures[row, TOTAL_MAX] = shown
                figures[row, TOTAL_X], figures[row, TOTAL_Y] = slide_x[k], slide_y[k]
            figures[row, KNOWN] += count
            _count(places, count, judge.histograms, 1)
        if circle >= 0:
            cx, cy = judge.centre[circle, 0], judge.centre[circle, 1]
            bins = judge.bins[rows[row, SLOT]]
            fill_bins(slide_x, slide_y, cx, cy, judge.directions, bins)
    trace_block(of_program, slide_x, slide_y, size, shown, pen, judge.trace)


cpdef judge_samples(Int[::1] row, double[:, ::1] commanded, double[:, ::1] slide, task, sums):
    """Judge K samples in order: row (K,), commanded and slide (K, 3) mm, whose Z is not looked at;
    any number of rows. Return the first sample that is not within `FARTHEST_MM` (none is judged
    from its block on), or −1."""
    cdef Int begin, count, k, axis
    cdef Judge judge
    cdef bint near
    cdef double[::1] slide_x, slide_y, x, y
    judge = Judge(task, sums)
    x, y, slide_x, slide_y = judge.x, judge.y, judge.slide_x, judge.slide_y
    begin = 0
    while begin < len(row):
        count = 0
        while count < BLOCK and begin + count < len(row) and row[begin + count] == row[begin]:
            k = begin + count
            for axis in range(2):  # NaN fails too
                near = abs(commanded[k, axis]) <= FARTHEST_MM
                if not (near and abs(slide[k, axis]) <= FARTHEST_MM):
                    return k
            x[count], y[count] = commanded[k, 0], commanded[k, 1]
            slide_x[count], slide_y[count] = slide[k, 0], slide[k, 1]
            count += 1
        judge_block(row[begin], count, judge)
        begin += count
    return -1
