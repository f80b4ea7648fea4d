"""Curves and points as arcs: Bézier pieces cut into nodes, biarcs and arcs over them, arcs found
in chains of chords, and the segments nearest to points.

Compiled, because each of many is measured against many. Comments above each part say what it does.
"""

from __future__ import annotations

from libc cimport math
from libc.stdint cimport uint8_t
from camtool.kernels.offsets cimport DEPTH, apart_square, rows_under, tree_of, wait_for_children
from camtool.kernels.types cimport Int

import numpy as np

from camtool.arrays import Bools, Floats, Ints

# Every number that decides how curves become arcs.


# Two positions nearer than this are one, as in `camtool.geometry.polylines`.
cdef double POSITION_EPS_MM = 1e-6

# A biarc covers no more turning than a half circle (and rounding).
cdef double _SPAN_TURN_RAD = math.M_PI * (1.0 + 1e-9)
SPAN_TURN_RAD = _SPAN_TURN_RAD

# One arc or line takes the place of a biarc when both its ends leave the curve's own tangents by
# no more; two of them make a joint of less than 1e-3 rad.
cdef double _SINGLE_TURN_RAD = 4e-4
SINGLE_TURN_RAD = _SINGLE_TURN_RAD

# An arc that leaves its chord by no more is a line.
cdef double STRAIGHT_SAGITTA_MM = 1e-7

# An arc of a larger radius is written as lines: a centre a kilometre away has no digits left.
cdef double _MAX_RADIUS_MM = 1e6
MAX_RADIUS_MM = _MAX_RADIUS_MM

# Those lines leave the arc by no more than this share of the tolerance.
cdef double FLAT_SHARE = 0.02

cpdef enum:
    # No arc is cut into more lines.
    MAX_LINES = 100_000

# Neighbours that leave a common arc or line by no more become one.
cdef double SAME_ARC_MM = 1e-8

cpdef enum:
    # Nodes kept for each number of arcs: the furthest, and others evenly short of it.
    CANDIDATES = 2

cpdef enum:
    # Points per step between nodes at which the final error is measured.
    MEASURE_STEPS = 8

# Tangents before and after a node that differ by more make it a corner.
cdef double _CORNER_ANGLE_RAD = 1e-6
CORNER_ANGLE_RAD = _CORNER_ANGLE_RAD

# No step between two nodes turns by more, save at a corner.
cdef double _STEP_TURN_RAD = 0.5
STEP_TURN_RAD = _STEP_TURN_RAD

# A step's biarc is off by no more than this share of the tolerance: some 16 steps an arc pair.
cdef double _STEP_ERROR_SHARE = 1.0 / 4096.0
STEP_ERROR_SHARE = _STEP_ERROR_SHARE

# Shorter than this share of the longest tangent, a tangent has no direction: look beside it.
cdef double _VANISHING_TANGENT = 1e-9
VANISHING_TANGENT = _VANISHING_TANGENT

cpdef enum:
    # Power of ten: how far aside (share of the way to the next break) to look for a direction.
    ASIDE_FROM = -9
    # The power of ten at which that look aside gives up.
    ASIDE_TO = -2
    # Steps that every curve is cut into at first.
    MIN_STEPS = 32
    # No more refining above this many nodes.
    MAX_NODES = 200_000


# Where a piece moves at less than this share of its largest speed, its slowest point is looked
# for: tips and cusps.
cdef double SLOW_SHARE = 0.5

cpdef enum:
    # Rounds of that search: they shrink a bracket by 3e-13.
    GOLDEN_ROUNDS = 60

# Points, tangents and nodes of rational Bézier pieces.
#
# A curve is `pieces` (m, p + 1, 3) of control points x·w, y·w, w, joined end to end, and its
# parameter runs from 0 to m: the whole part says which piece, the rest where in it.
# `camtool.geometry.fit` says the same for any curve, and the tests hold the two together;
# `tests/oracles/curves.py` measures both.


# A search for a least value by golden sections keeps this share of its bracket.
cdef double GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


cpdef (double, double, double, double) evaluate(
    double[:, :, ::1] pieces, Int k, double u
) noexcept:
    """Return position and derivative by u of piece k at u in 0..1: x, y, x', y'.

    Bernstein sums by a Horner scheme for both the piece A and its hodograph A' = p Σ ΔA Bᵖ⁻¹; of
    the quotient (x, y) = A/w the derivative is (A'w − A w')/w².
    """
    cdef Int degree, i
    degree = pieces.shape[1] - 1
    v = 1.0 - u
    x, y, w = pieces[k, 0, 0], pieces[k, 0, 1], pieces[k, 0, 2]
    dx, dy, dw = pieces[k, 1, 0] - x, pieces[k, 1, 1] - y, pieces[k, 1, 2] - w
    x, y, w = x * v, y * v, w * v
    above, slope, last = 1.0, 1.0, u
    for i in range(1, degree):
        above *= float(degree - i + 1) / float(i) * u
        slope *= float(degree - i) / float(i) * u
        last *= u
        ax, ay, aw = pieces[k, i, 0], pieces[k, i, 1], pieces[k, i, 2]
        dx = dx * v + slope * (pieces[k, i + 1, 0] - ax)
        dy = dy * v + slope * (pieces[k, i + 1, 1] - ay)
        dw = dw * v + slope * (pieces[k, i + 1, 2] - aw)
        x, y, w = (x + above * ax) * v, (y + above * ay) * v, (w + above * aw) * v
    x += last * pieces[k, degree, 0]
    y += last * pieces[k, degree, 1]
    w += last * pieces[k, degree, 2]
    share = float(degree) / (w * w)
    return x / w, y / w, share * (dx * w - x * dw), share * (dy * w - y * dw)


cpdef samples_between(double[:, :, ::1] pieces, double[:] t):
    """Return ((n − 1) · `MEASURE_STEPS` + 1, 2) positions: `MEASURE_STEPS` from each of the
    parameters t (n,) in 0..m on towards the next one, and the one at the last."""
    cdef Int i, j, row, k
    cdef double parameter
    cdef double[:, ::1] samples
    samples = np.empty(((len(t) - 1) * MEASURE_STEPS + 1, 2))
    for i in range(len(samples)):
        row, j = i // MEASURE_STEPS, i % MEASURE_STEPS
        parameter = t[row]
        if j > 0:
            parameter += float(j) / float(MEASURE_STEPS) * (t[row + 1] - t[row])
        k = min(int(parameter), len(pieces) - 1)
        x, y, _, _ = evaluate(pieces, k, parameter - float(k))
        samples[i, 0], samples[i, 1] = x, y
    return np.asarray(samples)


cpdef double speed(double[:, :, ::1] pieces, Int k, double u) noexcept:
    """Return the length of the derivative by u at u, mm."""
    _, _, dx, dy = evaluate(pieces, k, u)
    return math.sqrt(dx * dx + dy * dy)


cdef (double, double) aside(
    double[:, :, ::1] pieces, Int k, double u, double side, double min_length
) noexcept:
    """Return the unit tangent a little before (side −1) or after (+1) u, where the piece is faster
    than `min_length`."""
    cdef Int exponent
    if u <= 0.0 or u >= 1.0:
        side = 1.0 if u <= 0.0 else -1.0  # at the ends of a piece look inside
    for exponent in range(ASIDE_FROM, ASIDE_TO):
        near_u = min(max(u + side * math.pow(10.0, float(exponent)), 0.0), 1.0)
        _, _, dx, dy = evaluate(pieces, k, near_u)
        length = math.sqrt(dx * dx + dy * dy)
        if length > min_length:
            return dx / length, dy / length
    return 1.0, 0.0  # the curve stands still here: such nodes are merged


cdef double slowest(double[:, :, ::1] pieces, Int k, double low, double high) noexcept:
    """Return the u between low and high at which the piece is slowest, by golden section."""
    cdef Int _
    lower, upper = high - GOLDEN * (high - low), low + GOLDEN * (high - low)
    lower_speed, upper_speed = speed(pieces, k, lower), speed(pieces, k, upper)
    for _ in range(GOLDEN_ROUNDS):
        if lower_speed < upper_speed:
            high, upper, upper_speed = upper, lower, lower_speed
            lower = high - GOLDEN * (high - low)
            lower_speed = speed(pieces, k, lower)
        else:
            low, lower, lower_speed = lower, upper, upper_speed
            upper = low + GOLDEN * (high - low)
            upper_speed = speed(pieces, k, upper)
    return 0.5 * (low + high)


cdef first_steps(double[:, :, ::1] pieces, Int k, Int each):
    """Return the u (≥ each + 1,) at which piece k is cut at first, tips and cusps among them; and
    the piece's highest speed."""
    cdef Int i, count, previous, following, side
    cdef double grid_u, u, tip, fastest
    cdef double[::1] speeds, steps
    speeds = np.empty(each + 1)
    fastest = 0.0
    for i in range(each + 1):
        speeds[i] = speed(pieces, k, float(i) / float(each))
        fastest = max(fastest, speeds[i])
    steps = np.empty(2 * each + 2)
    count = 0
    for i in range(each + 1):
        grid_u = float(i) / float(each)
        tip = grid_u
        previous, following = max(i - 1, 0), min(i + 1, each)
        if (
            speeds[i] <= min(speeds[previous], speeds[following])
            and speeds[i] < SLOW_SHARE * fastest
        ):
            tip = slowest(pieces, k, float(previous) / float(each), float(following) / float(each))
        for side in range(2):
            u = min(tip, grid_u) if side == 0 else max(tip, grid_u)
            if count == 0 or steps[count - 1] < u <= 1.0:
                steps[count] = u
                count += 1
    steps[0] = 0.0
    return np.asarray(steps[:count]), fastest


cdef bint too_coarse(
    double[:, :, ::1] pieces, Int k, double[:, ::1] rows_before, Int i,
    double[:, ::1] rows_behind, Int j,
    double tolerance
) noexcept:
    """Return True if the step between two rows (u, x, y, arriving tangent, leaving tangent) must
    be halved: row i of `rows_before` and row j of `rows_behind`."""
    cdef Int turn
    cdef bint bends
    cdef double reach, distance
    low, high = rows_before[i, 0], rows_behind[j, 0]
    middle = 0.5 * (low + high)
    if not low < middle < high:
        return False
    ax, ay, bx, by = rows_before[i, 1], rows_before[i, 2], rows_behind[j, 1], rows_behind[j, 2]
    leave_x, leave_y, arrive_x, arrive_y = (
        rows_before[i, 5], rows_before[i, 6], rows_behind[j, 3], rows_behind[j, 4]
    )
    pair = biarc(ax, ay, leave_x, leave_y, bx, by, arrive_x, arrive_y)
    bends = leave_x * arrive_x + leave_y * arrive_y < math.cos(_STEP_TURN_RAD)
    reach = 0.0
    for turn in range(3):
        # Halfway first, then a quarter and three quarters.
        share = 0.5 if turn == 0 else 0.25 if turn == 1 else 0.75
        x, y, _, _ = evaluate(pieces, k, low + share * (high - low))
        reach = max(reach, abs(x - ax), abs(y - ay), abs(x - bx), abs(y - by))
        if not bends:
            distance = distance_to_biarc(x, y, ax, ay, bx, by, pair)
            bends = distance > _STEP_ERROR_SHARE * tolerance
        if bends and reach > POSITION_EPS_MM:
            return True
    return False


cdef piece_rows(double[:, :, ::1] pieces, Int k, Int each, double tolerance, Int max_rows):
    """Return the nodes (n, 7) of piece k: u, x, y, tangents before and after; begun with `each`
    steps.

    Steps are halved from left to right; the stack holds the right ends of those still to do.
    """
    cdef Int count, i, depth, column, last, top
    cdef bint fine
    cdef double fastest, min_length
    cdef double[:, ::1] stack, kept_rows
    cdef double[::1] grid
    grid, fastest = first_steps(pieces, k, each)
    min_length = _VANISHING_TANGENT * fastest
    stack = np.empty((64, 7))
    kept_rows = np.empty((512, 7))
    fill_row(pieces, k, 0.0, min_length, kept_rows, 0)
    count = 1
    for i in range(1, len(grid)):
        fill_row(pieces, k, grid[i], min_length, stack, 0)
        depth = 1
        while depth > 0:
            last, top = count - 1, depth - 1
            fine = depth < len(stack) and count < max_rows
            if fine and too_coarse(pieces, k, kept_rows, last, stack, top, tolerance):
                middle = 0.5 * (kept_rows[last, 0] + stack[top, 0])
                fill_row(pieces, k, middle, min_length, stack, depth)
                depth += 1
                continue
            if count == len(kept_rows):
                kept_rows = np.concatenate([kept_rows, kept_rows])
            for column in range(7):
                kept_rows[count, column] = stack[top, column]
            count += 1
            depth -= 1
    return np.asarray(kept_rows[:count])


cdef void fill_row(
    double[:, :, ::1] pieces, Int k, double u, double min_length, double[:, ::1] rows, Int i
) noexcept:
    """Write u, x, y, tangent before and tangent after into row i of `rows` (n, 7)."""
    cdef double dx, dy
    x, y, dx, dy = evaluate(pieces, k, u)
    length = math.sqrt(dx * dx + dy * dy)
    rows[i, 0], rows[i, 1], rows[i, 2] = u, x, y
    if length > min_length:
        rows[i, 3], rows[i, 4] = dx / length, dy / length
        rows[i, 5], rows[i, 6] = rows[i, 3], rows[i, 4]
    else:
        dx, dy = aside(pieces, k, u, -1.0, min_length)
        rows[i, 3], rows[i, 4] = dx, dy
        dx, dy = aside(pieces, k, u, 1.0, min_length)
        rows[i, 5], rows[i, 6] = dx, dy


cpdef curve_rows(double[:, :, ::1] pieces, Int steps, double tolerance):
    """Return the nodes (n, 7) of all pieces, with t in 0..m in place of u, and a mask of the
    corners.

    Nodes no farther apart than `POSITION_EPS_MM` become one: it has the arriving tangent of the
    first and the leaving tangent of the last of them.
    """
    cdef Int each, count, k, i, column, last
    cdef double gap, x, y
    cdef double[:, ::1] all_rows, rows, grown
    cdef uint8_t[::1] corner
    each = max(4, (steps + len(pieces) - 1) // len(pieces))
    all_rows = np.empty((256, 7))
    count = 0
    for k in range(len(pieces)):
        rows = piece_rows(pieces, k, each, tolerance, max(MAX_NODES - count, 2))
        if count + len(rows) > len(all_rows):
            grown = np.empty((2 * (count + len(rows)), 7))
            grown[:count] = all_rows[:count]
            all_rows = grown
        for i in range(len(rows)):
            last = max(count - 1, 0)
            gap = math.hypot(rows[i, 1] - all_rows[last, 1], rows[i, 2] - all_rows[last, 2])
            if count == 0 or gap > POSITION_EPS_MM:
                all_rows[count, 0] = rows[i, 0] + float(k)
                for column in range(1, 7):
                    all_rows[count, column] = rows[i, column]
                count += 1
            else:
                all_rows[last, 5], all_rows[last, 6] = rows[i, 5], rows[i, 6]
    x, y, _, _ = evaluate(pieces, len(pieces) - 1, 1.0)
    all_rows[count - 1, 1], all_rows[count - 1, 2] = x, y
    if count > 1:
        all_rows[count - 1, 0] = float(len(pieces))
    corner = np.zeros(count, dtype=np.bool_)
    for i in range(count):
        cross = all_rows[i, 3] * all_rows[i, 6] - all_rows[i, 4] * all_rows[i, 5]
        dot = all_rows[i, 3] * all_rows[i, 5] + all_rows[i, 4] * all_rows[i, 6]
        corner[i] = abs(math.atan2(cross, dot)) > _CORNER_ANGLE_RAD
    corner[0] = corner[count - 1] = True
    return np.asarray(all_rows[:count]), np.asarray(corner).view(np.bool_)


# Biarcs, distances to arcs, and how far arcs and biarcs stray from nodes on a curve.
#
# What makes it exact: no centre is ever formed, so an arc may be as flat as it likes; for a bulge
# of 0 each formula becomes the one of the straight line. `tests/oracles/arcs.py` is the twin.


cpdef inline double distance_to_arc(
    double px, double py, double ax, double ay, double bx, double by, double bulge
) noexcept:
    """Return the distance from p to the arc from a to b, |bulge| ≤ 1; to its nearer end if p lies
    beside the arc.

    With w = p − a, u = b − a, n = u turned by +90°, the power of p over the circle and the vector
    from the centre, both times the bulge, need no centre:

        b·power = b(w·w − w·u) − (1 − b²)/2 w·n,   q = b(w − u/2) − (1 − b²)/4 n,
        distance to the circle = |b·power| / (|q| + |u|(1 + b²)/4).

    p lies beside the arc when it is behind the normal at one of its ends, whose tangents are (1 −
    b²) u ∓ 2b n.
    """
    wx, wy, vx, vy = px - ax, py - ay, px - bx, py - by
    ux, uy = bx - ax, by - ay
    rest = 1.0 - bulge * bulge
    forward = wx * (rest * ux + 2.0 * bulge * uy) + wy * (rest * uy - 2.0 * bulge * ux)
    past_end = vx * (rest * ux - 2.0 * bulge * uy) + vy * (rest * uy + 2.0 * bulge * ux)
    square = ux * ux + uy * uy
    if square == 0.0 or forward < 0.0 or past_end > 0.0:
        return math.sqrt(min(wx * wx + wy * wy, vx * vx + vy * vy))
    power = bulge * (wx * vx + wy * vy) - 0.5 * rest * (wy * ux - wx * uy)
    qx = bulge * (wx - 0.5 * ux) + 0.25 * rest * uy
    qy = bulge * (wy - 0.5 * uy) - 0.25 * rest * ux
    below = math.sqrt(qx * qx + qy * qy) + 0.25 * math.sqrt(square) * (1.0 + bulge * bulge)
    return abs(power) / below


cdef inline double half_angle(double ax, double ay, double bx, double by) noexcept:
    """Return tan(α/2) = sin α / (1 + cos α) for the angle α from a to b; NaN when |α| > 90°.

    An arc of sweep s leaves the direction of its chord by s/2, so its bulge tan(s/4) is tan(α/2)
    with α between tangent and chord.
    """
    cosine = ax * bx + ay * by
    below = math.sqrt((ax * ax + ay * ay) * (bx * bx + by * by)) + cosine
    if below <= 0.0:
        return math.NAN
    bulge = (ax * by - ay * bx) / below
    if abs(bulge) > 1.0 + 1e-12:
        return math.NAN
    return min(max(bulge, -1.0), 1.0)


cpdef (double, double, double, double) biarc(
    double start_x, double start_y, double leave_x, double leave_y, double end_x, double end_y,
    double arrive_x, double arrive_y
) noexcept:
    """Return the joint x, y and both bulges of the biarc with equal handles; all NaN where there
    is none.

    Handles of length d reach Q0 = start + d·leave and Q1 = end − d·arrive; the arcs meet in the
    middle of Q0Q1 when |Q1 − Q0| = 2d. With v = end − start, s = leave + arrive, c = leave·arrive:

        d²(2 − 2c) + 2d v·s − v·v = 0   ⇒   d = v·v / (v·s + √((v·s)² + 2(1 − c) v·v)).

    There is none where no d > 0 solves this, or where an arc would be more than a half circle.
    """
    vx, vy = end_x - start_x, end_y - start_y
    square = vx * vx + vy * vy
    along = vx * (leave_x + arrive_x) + vy * (leave_y + arrive_y)
    cosine = leave_x * arrive_x + leave_y * arrive_y
    below = along + math.sqrt(along * along + 2.0 * max(1.0 - cosine, 0.0) * square)
    if square == 0.0 or below <= 0.0:
        return math.NAN, math.NAN, math.NAN, math.NAN
    handle = square / below
    jx = 0.5 * (start_x + end_x + handle * (leave_x - arrive_x))
    jy = 0.5 * (start_y + end_y + handle * (leave_y - arrive_y))
    first = half_angle(leave_x, leave_y, jx - start_x, jy - start_y)
    second = half_angle(end_x - jx, end_y - jy, arrive_x, arrive_y)
    if math.isnan(first) or math.isnan(second):
        return math.NAN, math.NAN, math.NAN, math.NAN
    return jx, jy, first, second


cdef inline double distance_to_biarc(
    double px, double py, double start_x, double start_y, double end_x, double end_y,
    (double, double, double, double) pair
) noexcept:
    """Return the distance from p to the nearer of both arcs; infinite when there is no biarc."""
    jx, jy, first, second = pair
    if math.isnan(jx):
        return math.INFINITY
    first_distance = distance_to_arc(px, py, start_x, start_y, jx, jy, first)
    second_distance = distance_to_arc(px, py, jx, jy, end_x, end_y, second)
    return min(first_distance, second_distance)


cdef inline (double, double, double, double) biarc_between(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high
) noexcept:
    """Return the `biarc` over the nodes low..high."""
    return biarc(
        point[low, 0],
        point[low, 1],
        leave[low, 0],
        leave[low, 1],
        point[high, 0],
        point[high, 1],
        arrive[high, 0],
        arrive[high, 1],
    )


cpdef step_errors(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int[::1] rows,
    double[:, :, ::1] probes
):
    """Return (k,) for each step from node rows[i] to the next the largest distance of its probes
    (j, k, 2) from the biarc over the step; inf where there is no biarc."""
    cdef Int i, j, a, b
    cdef double[::1] errors
    errors = np.empty(len(rows))
    for i in range(len(rows)):
        a, b = rows[i], rows[i] + 1
        pair = biarc_between(point, leave, arrive, a, b)
        ax, ay, bx, by = point[a, 0], point[a, 1], point[b, 0], point[b, 1]
        errors[i] = 0.0
        for j in range(len(probes)):
            distance = distance_to_biarc(probes[j, i, 0], probes[j, i, 1], ax, ay, bx, by, pair)
            errors[i] = max(errors[i], distance)
    return np.asarray(errors)


cpdef double span_error(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high
) noexcept:
    """Return the largest distance of the nodes between low and high from the biarc over
    low..high."""
    cdef Int i
    cdef double distance
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    pair = biarc_between(point, leave, arrive, low, high)
    largest = math.INFINITY if math.isnan(pair[0]) else 0.0
    for i in range(low + 1, high):
        distance = distance_to_biarc(point[i, 0], point[i, 1], ax, ay, bx, by, pair)
        largest = max(largest, distance)
    return largest


cdef bint span_holds(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high,
    double target
) noexcept:
    """Return True if `span_error` is within the target; stops at the first node that is not."""
    cdef Int i
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    pair = biarc_between(point, leave, arrive, low, high)
    if math.isnan(pair[0]):
        return False
    for i in range(high - 1, low, -1):
        if distance_to_biarc(point[i, 0], point[i, 1], ax, ay, bx, by, pair) > target:
            return False
    return True


cdef double arc_error(double[:, ::1] point, Int low, Int high, double bulge) noexcept:
    """Return the largest distance of the nodes between low and high from the arc or line over
    low..high."""
    cdef Int i
    ax, ay, bx, by = point[low, 0], point[low, 1], point[high, 0], point[high, 1]
    largest = 0.0
    for i in range(low + 1, high):
        distance = distance_to_arc(point[i, 0], point[i, 1], ax, ay, bx, by, bulge)
        largest = max(largest, distance)
    return largest


# The search for the longest arcs and biarcs along nodes on a curve.
#
# The error of a biarc grows with the third power of its length, which tells how far to reach next;
# bisection settles the rest. One arc or line in place of two is taken where the curve is one.


cpdef Int longest_span(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int furthest,
    Int guess, double target
) noexcept:
    """Return the end node of the longest biarc from node `low` whose error is within `target`.

    error ∝ length³   ⇒   the length that fits is about length · (target / error)^(1/3).
    That rule leads for a few tries, bisection then; at least one step is taken.
    """
    cdef Int best, too_far, high, tries, reach, ahead
    best, too_far, high, tries = low + 1, furthest + 1, guess, 0
    while too_far - best > 1:
        high = min(max(high, best + 1), too_far - 1)
        error = span_error(point, leave, arrive, low, high)
        ratio = 4.0 if error == 0.0 else min(4.0, (target / error) ** (1.0 / 3.0))
        ahead = int(0.98 * ratio * float(high - low))
        reach = low + ahead
        if error <= target:
            best = high
        else:
            too_far = high
        tries += 1
        high = reach if tries <= 4 and ratio > 0.0 else (best + too_far) // 2
    return best


cdef double single_bulge(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int high,
    double target
) noexcept:
    """Return the bulge of the single arc or line that replaces the nodes low..high; NaN for none.

    With α from the first tangent to the chord and β from the chord to the last one, an arc of
    sweep α + β leaves both tangents by |α − β| / 2.
    """
    cdef bint level
    ux, uy = point[high, 0] - point[low, 0], point[high, 1] - point[low, 1]
    # |sin α − sin β| ≤ |α − β|: most nodes are told here, without a root.
    askew = (leave[low, 0] + arrive[high, 0]) * uy - (leave[low, 1] + arrive[high, 1]) * ux
    if askew * askew > 4.0 * _SINGLE_TURN_RAD * _SINGLE_TURN_RAD * (ux * ux + uy * uy):
        return math.NAN
    first = half_angle(leave[low, 0], leave[low, 1], ux, uy)
    second = half_angle(ux, uy, arrive[high, 0], arrive[high, 1])
    first, second = 2.0 * math.atan(first), 2.0 * math.atan(second)
    if not abs(first - second) <= 2.0 * _SINGLE_TURN_RAD:
        return math.NAN
    half = 0.5 * (first + second)
    if math.sqrt(ux * ux + uy * uy) > 2.0 * _MAX_RADIUS_MM * abs(math.sin(half)):
        # Radius = chord / (2 sin(sweep/2)): too flat for an arc, so a line or nothing.
        level = max(abs(first), abs(second)) <= _SINGLE_TURN_RAD
        return 0.0 if level and arc_error(point, low, high, 0.0) <= target else math.NAN
    bulge = min(max(math.tan(0.5 * half), -1.0), 1.0)
    return bulge if arc_error(point, low, high, bulge) <= target else math.NAN


cdef (Int, double) longest_single(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int low, Int shortest,
    Int farthest, Int guess, double target
) noexcept:
    """Return the end node and the bulge of the longest single arc or line from `low` that ends
    after `shortest` and not after `farthest`; NaN when there is none.

    The tangents may fit at a far node but not at a nearer one (about an axis of symmetry), so all
    nodes are tried, from the far end of a window of 2 · `guess` nodes that grows as long as its
    end is reached.
    """
    cdef Int too_far, best, high
    too_far, best, bulge = shortest, shortest, math.NAN
    while best == too_far and too_far < farthest:
        shortest = too_far
        too_far = min(max(low + 2 * guess, 2 * too_far - low), farthest)
        for high in range(too_far, shortest, -1):
            candidate = single_bulge(point, leave, arrive, low, high, target)
            if not math.isnan(candidate):
                best, bulge = high, candidate
                break
        if too_far == shortest:
            break
    return best, bulge


cdef furthest_nodes(double[:, ::1] leave, double[:, ::1] arrive, uint8_t[::1] corner):
    """Return (n,) the last node that a span from each node may reach: the next corner, or where
    the curve has turned by `SPAN_TURN_RAD`, left and right turns added."""
    cdef Int count, i, last
    cdef Int[::1] furthest
    cdef double[::1] turned
    count = len(leave)
    turned = np.zeros(count)
    for i in range(1, count):
        cross = leave[i - 1, 0] * arrive[i, 1] - leave[i - 1, 1] * arrive[i, 0]
        dot = leave[i - 1, 0] * arrive[i, 0] + leave[i - 1, 1] * arrive[i, 1]
        turned[i] = turned[i - 1] + abs(math.atan2(cross, dot))
    furthest = np.zeros(count, dtype=np.int64)
    last = 0
    for i in range(count - 1):
        last = max(last, i + 1)
        while not corner[last] and turned[last + 1] - turned[i] <= _SPAN_TURN_RAD:
            last += 1
        furthest[i] = last
    return np.asarray(furthest)


cdef (Int, Int, double) furthest_state(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, Int[::1] limit,
    Int[::1] states, Int state, Int guess, double target
) noexcept:
    """Return the furthest node at the price whose candidates begin at row `state` of `states`
    (node −1: none), the row from which it is reached, and the bulge of the single arc or line that
    reaches it (NaN: a biarc)."""
    cdef Int row, best, whence, low, begin, high
    cdef bint first
    best, whence, bulge = states[state - CANDIDATES], state - CANDIDATES, math.NAN
    for row in range(max(state - 2 * CANDIDATES, 0), state):
        low = states[row]
        if low < 0 or limit[low] <= best:
            continue
        if row >= state - CANDIDATES:
            high, candidate = longest_single(
                point, leave, arrive, low, best, limit[low], guess, target
            )
            if high > best:
                best, whence, bulge = high, row, candidate
            continue
        first = row == state - 2 * CANDIDATES
        if first or span_holds(point, leave, arrive, low, best + 1, target):
            begin = low + guess if first else best + 2
            high = longest_span(point, leave, arrive, low, limit[low], begin, target)
            if high > best:
                best, whence, bulge = high, row, math.NAN
    return best, whence, bulge


cdef longest_spans(
    double[:, ::1] point, double[:, ::1] leave, double[:, ::1] arrive, uint8_t[::1] corner,
    double target
):
    """Return the nodes (s + 1,) between the spans of a chain of few arcs, and (s, 4) the joint and
    bulges of each span.

    `point`, `leave`, `arrive` (n, 2), `corner` (n,). A span of one arc or line has its bulge in
    the third column and NaN elsewhere. No span runs past a corner or turns by more than
    `SPAN_TURN_RAD`.

    Price by price (1, 2, 3 … arcs) the furthest node is found that one arc reaches from a node of
    the price before, or a biarc from two prices before. A few nodes short of it are kept as well:
    a span with a sharp tip in its middle may have to begin there.
    """
    cdef Int count, row, state, guess, m, spans, best, previous, low, place, high
    cdef Int[::1] limit, states, whence, ends
    cdef double first, jx, jy, second, bulge
    cdef double[:, ::1] pairs
    cdef double[::1] bulges
    count = len(point)
    limit = furthest_nodes(leave, arrive, corner)
    states = np.zeros(CANDIDATES * (2 * count + 2), dtype=np.int64)
    whence = np.zeros(len(states), dtype=np.int64)
    bulges = np.zeros(len(states))
    for row in range(1, len(states)):
        states[row] = -1
    state, guess = 0, count
    while states[state] < count - 1:
        state += CANDIDATES
        best, row, bulge = furthest_state(
            point, leave, arrive, limit, states, state, guess, target
        )
        previous, low, guess = states[state - CANDIDATES], states[row], best - states[row]
        for m in range(CANDIDATES):
            place = best - m * (best - previous) // CANDIDATES
            if m > 0:
                if place <= previous or place == states[state + m - 1]:
                    continue
                if not math.isnan(bulge):
                    bulge = single_bulge(point, leave, arrive, low, place, target)
                    if math.isnan(bulge):
                        break
                elif not span_holds(point, leave, arrive, low, place, target):
                    continue
            states[state + m], whence[state + m], bulges[state + m] = place, row, bulge
    spans, row = 0, state
    while row > 0:
        spans += 1 if states[row] > states[whence[row]] else 0
        row = whence[row]
    ends = np.zeros(spans + 1, dtype=np.int64)
    pairs = np.empty((spans, 4))
    row = state
    while row > 0:
        low, high, bulge = states[whence[row]], states[row], bulges[row]
        row = whence[row]
        if low == high:
            continue
        jx, jy, first, second = math.NAN, math.NAN, bulge, math.NAN
        if math.isnan(bulge):
            jx, jy, first, second = biarc_between(point, leave, arrive, low, high)
        spans -= 1
        pairs[spans, 0], pairs[spans, 1], pairs[spans, 3] = jx, jy, second
        pairs[spans, 2] = 0.0 if math.isnan(first) else first
        ends[spans + 1] = high
    return np.asarray(ends), np.asarray(pairs)


# Spans of biarcs, arcs and lines as one chain of segments, and its distance from the curve.
#
# Vertices are rows x, y, bulge; the last row is the end of the chain.


cdef Int lines_for(
    double ax, double ay, double bx, double by, double bulge, double max_error
) noexcept:
    """Return the number of lines that replace an arc too flat to be written; 0 if it stays an arc.

    sagitta = |bulge| · chord / 2, radius = chord (1 + b²) / (4 |b|) and each of n lines leaves the
    arc by sagitta / n².
    """
    chord = math.hypot(bx - ax, by - ay)
    sagitta = 0.5 * abs(bulge) * chord
    if sagitta <= STRAIGHT_SAGITTA_MM:
        return 1
    if chord * (1.0 + bulge * bulge) <= 4.0 * abs(bulge) * _MAX_RADIUS_MM:
        return 0
    return int(min(math.ceil(math.sqrt(sagitta / max_error)), float(MAX_LINES)))


cdef chain(double[:, ::1] point, Int[::1] ends, double[:, ::1] pairs, double tolerance):
    """Return the rows (n + 1, 3) of all spans, and (s + 1,) the number of the first row of each.

    Arcs whose sagitta is `STRAIGHT_SAGITTA_MM` or less, and flat ones, become lines.
    """
    cdef Int spans, count, s, k, total, i, row_count, j
    cdef Int[::1] owner, parts, first
    cdef double[:, ::1] arcs, rows
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
    row_count = 0
    for i in range(count):
        ax, ay, bulge = arcs[i, 0], arcs[i, 1], arcs[i, 2]
        if i == 0 or owner[i] != owner[i - 1]:
            first[owner[i]] = row_count
        ux, uy = arcs[i + 1, 0] - ax, arcs[i + 1, 1] - ay
        for j in range(max(parts[i], 1)):
            # On a flat arc the point at the share h of the chord lies beside it by 2b·h(1 − h)·u.
            h = float(j) / float(max(parts[i], 1))
            offset = 2.0 * bulge * h * (1.0 - h)
            rows[row_count, 0], rows[row_count, 1] = (
                ax + h * ux + offset * uy, ay + h * uy - offset * ux
            )
            rows[row_count, 2] = bulge if parts[i] == 0 else 0.0
            row_count += 1
    rows[row_count, 0], rows[row_count, 1], rows[row_count, 2] = point[k, 0], point[k, 1], 0.0
    first[spans] = row_count
    return np.asarray(rows), np.asarray(first)


cdef double common_bulge(double[:, ::1] rows, Int first, double end_x, double end_y) noexcept:
    """Return the bulge of the single arc or line on which two consecutive segments lie, which
    begin at row `first` and the row after it and end at (end_x, end_y); NaN if there is none."""
    cdef Int second
    cdef double bulge, sweep
    second = first + 1
    ax, ay, a = rows[first, 0], rows[first, 1], rows[first, 2]
    bx, by, b = rows[second, 0], rows[second, 1], rows[second, 2]
    if a * b < 0.0 or (a == 0.0) != (b == 0.0):
        return math.NAN
    sweep = 4.0 * (math.atan(a) + math.atan(b))
    if abs(sweep) > _SPAN_TURN_RAD or (ax == end_x and ay == end_y):
        return math.NAN
    bulge = min(max(math.tan(0.25 * sweep), -1.0), 1.0)
    # Halfway along each segment, where its sagitta is bulge · chord / 2, and at the joint.
    x, y = ax + 0.5 * (bx - ax + a * (by - ay)), ay + 0.5 * (by - ay - a * (bx - ax))
    if distance_to_arc(x, y, ax, ay, end_x, end_y, bulge) > SAME_ARC_MM:
        return math.NAN
    x, y = bx + 0.5 * (end_x - bx + b * (end_y - by)), by + 0.5 * (end_y - by - b * (end_x - bx))
    if distance_to_arc(x, y, ax, ay, end_x, end_y, bulge) > SAME_ARC_MM:
        return math.NAN
    if distance_to_arc(bx, by, ax, ay, end_x, end_y, bulge) > SAME_ARC_MM:
        return math.NAN
    return bulge


cdef joined(double[:, ::1] rows, double size):
    """Return the rows with consecutive segments on one circle or line joined, and for each old
    segment where it is now.

    A segment no longer than `size` is dropped: its end takes the place of its start.
    """
    cdef Int count, i, last
    cdef Int[::1] places
    cdef double end_x, end_y, bulge
    cdef double[:, ::1] merged
    merged = np.empty((len(rows), 3))
    places = np.zeros(len(rows) - 1, dtype=np.int64)
    merged[0, 0], merged[0, 1], merged[0, 2] = rows[0, 0], rows[0, 1], 0.0
    count = 1
    for i in range(len(rows) - 1):
        end_x, end_y = rows[i + 1, 0], rows[i + 1, 1]
        if math.hypot(end_x - merged[count - 1, 0], end_y - merged[count - 1, 1]) <= size:
            places[i] = max(count - 2, 0)
            continue
        merged[count - 1, 2] = rows[i, 2]
        if (
            count > 1
            and math.hypot(end_x - merged[count - 2, 0], end_y - merged[count - 2, 1]) > size
        ):
            bulge = common_bulge(merged, count - 2, end_x, end_y)
            if not math.isnan(bulge):
                count -= 1
                merged[count - 1, 2] = bulge
        places[i] = count - 1
        merged[count, 0], merged[count, 1], merged[count, 2] = end_x, end_y, 0.0
        count += 1
    last = len(rows) - 1
    merged[count - 1, 0], merged[count - 1, 1], merged[count - 1, 2] = (
        rows[last, 0], rows[last, 1], 0.0
    )
    return np.asarray(merged[:count]), np.asarray(places)


cdef deviations(
    double[:, ::1] samples, Int[::1] ends, Int[::1] first, double[:, ::1] vertices, Int[::1] places
):
    """Return distances (n,) of samples (n, 2) of the curve from the segments of their own span.

    Each step between nodes has equally many samples, and the last sample is at the end. Span s
    owns the nodes ends[s]..ends[s + 1] and the old segments first[s]..first[s + 1] (both columns
    (spans + 1,)), which are now at `places`.
    """
    cdef Int each, s, last, i, low, high, row
    cdef double bulge, nearest, x, y, ax, ay, bx, by
    cdef double[::1] distances
    each = (len(samples) - 1) // ends[len(ends) - 1]
    distances = np.empty(len(samples))
    for s in range(len(ends) - 1):
        low, high = places[first[s]], places[first[s + 1] - 1]
        last = ends[s + 1] * each + (1 if s == len(ends) - 2 else 0)
        for i in range(ends[s] * each, last):
            nearest = math.INFINITY
            x, y = samples[i, 0], samples[i, 1]
            for row in range(low, high + 1):
                ax, ay, bulge = vertices[row, 0], vertices[row, 1], vertices[row, 2]
                bx, by = vertices[row + 1, 0], vertices[row + 1, 1]
                nearest = min(nearest, distance_to_arc(x, y, ax, ay, bx, by, bulge))
            distances[i] = nearest
    return np.asarray(distances)


cdef (double, double, double) summary(double[:, ::1] samples, double[::1] errors) noexcept:
    """Return the largest deviation, its rms weighted by length, and the length of the curve, mm.

    Between samples i and i + 1 the deviation peaks at or below the intersection of the lines
    through the two samples before and the two behind: it is concave on each side of a peak, and
    where the nearest arc changes it has an edge there.
    """
    cdef Int i
    squares, length = 0.0, 0.0
    largest = errors[len(errors) - 1]
    for i in range(len(errors) - 1):
        step = math.hypot(samples[i + 1, 0] - samples[i, 0], samples[i + 1, 1] - samples[i, 1])
        squares += step * 0.5 * (errors[i] * errors[i] + errors[i + 1] * errors[i + 1])
        length += step
        largest = max(largest, errors[i])
        if 0 < i < len(errors) - 2:
            rise, fall = errors[i] - errors[i - 1], errors[i + 1] - errors[i + 2]
            if rise > 0.0 and fall > 0.0:
                share = min(max((errors[i + 1] + fall - errors[i]) / (rise + fall), 0.0), 1.0)
                largest = max(largest, min(errors[i] + rise * share, errors[i + 1] + fall))
    return largest, math.sqrt(squares / length) if length > 0.0 else 0.0, length


# Arcs over nodes on a curve in one call: spans, chain, measure.


cpdef fit_nodes(nodes, double[:, ::1] samples, double target, double tolerance):
    """Return the chain (n, 3) over `nodes` (points, arriving and leaving tangents (n, 2),
    corners (n,)) and its largest and rms deviation from the samples, and their length, mm."""
    cdef Int[::1] ends, first, places
    cdef double[:, ::1] point, arrive, leave, pairs, rows, vertices
    cdef double[::1] errors
    cdef uint8_t[::1] corner
    point, arrive, leave, corner = nodes
    ends, pairs = longest_spans(point, leave, arrive, corner, target)
    rows, first = chain(point, ends, pairs, tolerance)
    vertices, places = joined(rows, POSITION_EPS_MM)
    if len(vertices) == 1:
        return np.asarray(vertices), (0.0, 0.0, 0.0)
    errors = deviations(samples, ends, first, vertices, places)
    return np.asarray(vertices), summary(samples, errors)


# Runs of chords that lie on one circle, along a chain of points.
#
# A run grows from its first point by doubling and then bisection, so n points cost O(n log n);
# every test of a run is a least-squares circle about the run's own middle (Kåsa's, which is
# linear: minimise Σ (x² + y² − 2ax − 2by − c)²). `tests/oracles/recognise.py` explodes arcs and
# judges what comes back.


cpdef enum:
    # Points that an arc needs: four chords. Three always lie on a circle, four often do.
    MIN_POINTS = 5

# One chord of an arc turns by no more: polygons of fewer than sixteen sides stay polygons.
cdef double _MAX_TURN_RAD = 22.5 * (math.M_PI / 180.0) * (1.0 + 1e-3)
MAX_TURN_RAD = _MAX_TURN_RAD

# The longest chord of an arc over its shortest one; the first and the last may be shorter.
cdef double MAX_LENGTH_RATIO = 1.5

# Runs that turn by less in all stay chords.
cdef double MIN_SWEEP_RAD = 0.02

# Points may lie off the circle by so many times the mean fourth difference of these distances. Of
# noise it is 7 times the mean (√70 σ); of n points that are off smoothly, as another curve is,
# about (3π/n)⁴ times the most.
cdef double ROUGHNESS = 0.5

cpdef enum:
    # Fewer points than these do not tell noise from another curve: they must lie on the circle
    # within the noise that is known.
    ROUGH_POINTS = 12

# The sagitta of a run is at least so many times the noise, or the run is straight.
cdef double MIN_SAGITTA_NOISES = 8.0

cpdef enum:
    FAIL = 0, STRAIGHT, ARC


cdef bint lengths_agree(double[:, ::1] points, Int low, Int high) noexcept:
    """Return True if the chords low..high − 1 have similar lengths; the first and last may be
    shorter."""
    cdef Int k
    shortest, longest = math.INFINITY, 0.0
    for k in range(low, high):
        length = math.hypot(points[k + 1, 0] - points[k, 0], points[k + 1, 1] - points[k, 1])
        longest = max(longest, length)
        if low < k < high - 1:
            shortest = min(shortest, length)
    return longest <= MAX_LENGTH_RATIO * shortest


cdef bint is_straight(double[:, ::1] points, Int low, Int high, double noise) noexcept:
    """Return True if the points lie within `noise` of the chord from the first to the last."""
    cdef Int k
    ux, uy = points[high, 0] - points[low, 0], points[high, 1] - points[low, 1]
    length = math.hypot(ux, uy)
    for k in range(low + 1, high):
        wx, wy = points[k, 0] - points[low, 0], points[k, 1] - points[low, 1]
        if abs(ux * wy - uy * wx) > noise * length:
            return False
    return length > 0.0


cpdef (double, double, double) circle_of(double[:, ::1] points, Int low, Int high) noexcept:
    """Return the centre and radius of the least-squares circle; an infinite radius for points
    on a line."""
    cdef Int count, k
    count = high - low + 1
    mx, my = 0.0, 0.0
    for k in range(low, high + 1):
        mx, my = mx + points[k, 0] / float(count), my + points[k, 1] / float(count)
    uu, uv, vv, ru, rv = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(low, high + 1):
        u, v = points[k, 0] - mx, points[k, 1] - my
        square = u * u + v * v
        uu, uv, vv = uu + u * u, uv + u * v, vv + v * v
        ru, rv = ru + 0.5 * square * u, rv + 0.5 * square * v
    below = uu * vv - uv * uv
    if not below > 0.0:
        return mx, my, math.INFINITY
    a, b = (ru * vv - rv * uv) / below, (rv * uu - ru * uv) / below
    return mx + a, my + b, math.sqrt(a * a + b * b + (uu + vv) / float(count))


cdef (Int, double, double, double, double) judge(
    double[:, ::1] points, Int low, Int high, double noise, double tolerance, double[::1] errors
) noexcept:
    """Return FAIL, STRAIGHT or ARC for the points low..high, and of an arc the centre, radius and
    signed sweep. `errors` (n,) is a scratch buffer, one number for each point."""
    cdef Int k
    cdef double rough, fourth, sweep, largest
    if not lengths_agree(points, low, high):
        return FAIL, 0.0, 0.0, 0.0, 0.0
    if is_straight(points, low, high, noise):
        return STRAIGHT, 0.0, 0.0, 0.0, 0.0
    cx, cy, radius = circle_of(points, low, high)
    sweep, rough, largest = 0.0, 0.0, 0.0
    for k in range(low, high + 1):
        x, y = points[k, 0] - cx, points[k, 1] - cy
        errors[k - low] = math.hypot(x, y) - radius
        largest = max(largest, abs(errors[k - low]))
        if k < high:
            nx, ny = points[k + 1, 0] - cx, points[k + 1, 1] - cy
            turn = math.atan2(x * ny - y * nx, x * nx + y * ny)
            if abs(turn) > _MAX_TURN_RAD or turn * sweep < 0.0:
                return FAIL, 0.0, 0.0, 0.0, 0.0
            sweep += turn
    if high - low + 1 >= ROUGH_POINTS:
        # Not at the ends: a point that no longer belongs to the arc would speak for itself.
        for k in range(3, high - low - 2):
            fourth = (
                errors[k - 2] - 4.0 * errors[k - 1] + 6.0 * errors[k] - 4.0 * errors[k + 1]
                + errors[k + 2]
            )
            rough += abs(fourth) / float(high - low - 5)
    if abs(sweep) > 2.0 * math.M_PI + _MAX_TURN_RAD:
        return FAIL, 0.0, 0.0, 0.0, 0.0
    if not largest <= min(tolerance, max(noise, ROUGHNESS * rough)):
        return FAIL, 0.0, 0.0, 0.0, 0.0
    sagitta = radius * (1.0 - math.cos(0.5 * min(abs(sweep), math.M_PI)))
    if abs(sweep) < MIN_SWEEP_RAD or sagitta < MIN_SAGITTA_NOISES * max(noise, largest):
        return STRAIGHT, 0.0, 0.0, 0.0, 0.0
    return ARC, cx, cy, radius, sweep


cdef (Int, Int, double, double, double, double) longest_run(
    double[:, ::1] points, Int low, double noise, double tolerance, double[::1] errors
) noexcept:
    """Return the last point of the longest run from `low`, and its verdict as `judge` returns it;
    `low` if there is no run."""
    cdef Int best, too_far, size, rest, doubled, high, is_
    cdef double cx, cy, radius, sweep
    best, too_far, size = low, len(points), MIN_POINTS - 1
    is_, cx, cy, radius, sweep = FAIL, 0.0, 0.0, 0.0, 0.0
    while best < len(points) - 1 and low + size < len(points):
        verdict = judge(points, low, low + size, noise, tolerance, errors)
        if verdict[0] != FAIL:
            best = low + size
            is_, cx, cy, radius, sweep = verdict
        elif size >= 2 * ROUGH_POINTS - 1:
            too_far = low + size
            break
        # A few points may fail by noise that more of them show to be noise.
        rest = len(points) - 1 - low
        doubled = 2 * size if size >= ROUGH_POINTS - 1 else max(2 * size, ROUGH_POINTS - 1)
        size = min(doubled, rest) if size < rest else size + 1
    while best > low and too_far - best > 1:
        high = (best + too_far) // 2
        verdict = judge(points, low, high, noise, tolerance, errors)
        if verdict[0] == FAIL:
            too_far = high
        else:
            best = high
            is_, cx, cy, radius, sweep = verdict
    return best, is_, cx, cy, radius, sweep


cpdef find_runs(double[:, ::1] points, double noise, double tolerance):
    """Return (r, 6) runs of chords on one circle: first and last point, centre, radius, signed
    sweep.

    A run that is still straight is skipped; the arc behind it begins within its last chords, and
    is extended backwards as far as it goes.
    """
    cdef Int count, low, run_end, high, is_
    cdef double cx, cy, radius, sweep
    cdef double[:, ::1] runs
    cdef double[::1] errors
    runs, errors = np.empty((len(points) // (MIN_POINTS - 1) + 1, 6)), np.empty(len(points))
    count, low, run_end = 0, 0, 0
    while low + MIN_POINTS <= len(points):
        high, is_, cx, cy, radius, sweep = longest_run(points, low, noise, tolerance, errors)
        if is_ != ARC:
            low = max(low + 1, high - MIN_POINTS + 1)
            continue
        while low > run_end:
            longer = judge(points, low - 1, high, noise, tolerance, errors)
            if longer[0] != ARC:
                break
            low -= 1
            is_, cx, cy, radius, sweep = longer
        runs[count, 0], runs[count, 1] = low, high
        runs[count, 2], runs[count, 3], runs[count, 4], runs[count, 5] = cx, cy, radius, sweep
        count += 1
        low = run_end = high
    return np.asarray(runs[:count])


cpdef double furthest_off(double[:, ::1] points, double[:, ::1] arcs) noexcept:
    """Return the largest distance of points (n, 2) from a chain of arcs (m, 3)."""
    cdef Int i, row
    cdef double bulge, nearest, largest, distance
    largest = 0.0
    for i in range(len(points)):
        nearest = math.INFINITY
        for row in range(len(arcs) - 1):
            ax, ay, bulge = arcs[row, 0], arcs[row, 1], arcs[row, 2]
            bx, by = arcs[row + 1, 0], arcs[row + 1, 1]
            distance = distance_to_arc(points[i, 0], points[i, 1], ax, ay, bx, by, bulge)
            nearest = min(nearest, distance)
        largest = max(largest, nearest)
    return largest


# The nearest segment to each of many points; the least distance from a vertex of any path to a
# segment of another path.
#
# A binary tree of boxes stands over the segments in their order; a path is one stretch of them, so
# a vertex leaves out the nodes that lie within its own path, and those farther than the best
# distance so far. What makes it exact: only boxes are left out, by their true distance.


cpdef (double, Int, Int) closest(
    const double[:, :] start, const double[:, :] end, double[::1] bulge, double[:, ::1] boxes,
    Int[::1] path
):
    """Return the smallest distance from a segment's start to another path, the row of that
    segment, and the row that it is near to.

    `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4) and the ascending `path` (K,) of the
    segments. Rows are −1 when there is only one path.
    """
    cdef Int count, row, best_row, best_other, first, last, candidate
    cdef Int[::1] stack
    cdef double[:, ::1] tree
    tree = tree_of(boxes)
    count = len(bulge)
    stack = np.empty(DEPTH, np.int64)
    best, best_row, best_other = math.INFINITY, -1, -1
    first, last = 0, -1
    for row in range(count):
        if row > last:
            first, last = row, row
            while last + 1 < count and path[last + 1] == path[row]:
                last += 1
        distance, candidate = _from_point(
            start[row, 0], start[row, 1], start, end, bulge, tree, first, last, best, stack
        )
        if candidate >= 0:
            best, best_row, best_other = distance, row, candidate
    return best, best_row, best_other


cpdef nearest_rows(
    double[:, ::1] points, const double[:, :] start, const double[:, :] end, double[::1] bulge,
    double[:, ::1] boxes
):
    """Return (P,) the rows of the segments nearest to points (P, 2); fast when consecutive points
    are near each other. `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4), K ≥ 1; of two equally
    near segments the one of the point before is kept."""
    cdef Int candidate, row, index
    cdef Int[::1] nearest, stack
    cdef double _, x, y, ax, ay, bx, by
    cdef double[:, ::1] tree
    tree = tree_of(boxes)
    nearest, stack = np.zeros(len(points), np.int64), np.empty(DEPTH, np.int64)
    row = 0
    for index in range(len(points)):
        x, y = points[index, 0], points[index, 1]
        ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
        distance = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
        _, candidate = _from_point(x, y, start, end, bulge, tree, 0, -1, distance, stack)
        row = candidate if candidate >= 0 else row
        nearest[index] = row
    return np.asarray(nearest)


cdef (double, Int) _from_point(
    double x, double y, const double[:, :] start, const double[:, :] end, double[::1] bulge,
    double[:, ::1] tree, Int first, Int last, double best, Int[::1] stack
) noexcept:
    """Return the distance to the nearest segment outside of the rows first … last that is nearer
    than `best`, and its row; −1 when there is none. `stack` (`DEPTH`,) is a scratch buffer."""
    cdef Int leaves, best_row, height, node, row, low, high
    cdef bint own
    leaves = len(tree) // 2
    best_row = -1
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        low, high = rows_under(tree, node, len(bulge))
        own = low >= first and high <= last + 1
        if low >= high or own or apart_square(tree, node, x, y) >= best * best:
            continue
        if node < leaves:
            height = wait_for_children(tree, node, x, y, stack, height)
            continue
        for row in range(low, high):
            if first <= row <= last:
                continue
            ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
            distance = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
            if distance < best:
                best, best_row = distance, row
    return best, best_row
