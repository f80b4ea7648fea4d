"""The loops of the PIC18F8720's interpolators: lines and arcs step by step, where arcs stop, and
whole programs that are judged as they run.

Positions are whole steps. Compiled, because one part takes tens of millions of them. Comments
above each part say what it does.
"""

from __future__ import annotations

from libc cimport math
from camtool.kernels.judging cimport BLOCK, Judge, judge_block
from camtool.kernels.play cimport STILL, TURNING, play_block, way_of
from camtool.kernels.types cimport Int
from camtool.kernels.wide cimport wide

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.kernels.judging import Sums, Task, room_for

# Which way an arc goes at a point, and the whole number next to its radius.
#
# Shared by the arc kernels. Exact, because only signs of integers are looked at, and the root of
# an integer is never so near to a half that a float64 could round it to the wrong side (the root
# of k² + k is 1/(8k) away from k + 1/2). Compiled, because compiled loops call it.


cpdef inline (Int, Int) heading(Int x, Int y, bint clockwise) noexcept:
    """Return the direction (±1, ±1) of the motion at (x, y) ≠ (0, 0) on an arc about (0, 0).

    Clockwise the velocity is along (y, −x). On an axis one of the two vanishes: there the
    coordinate that is not 0 shrinks, so its direction is against its sign, and the quadrant is the
    one that the motion enters.
    """
    cdef Int turn, sx, sy, along_x, along_y
    turn = 1 if clockwise else -1
    along_x, along_y = turn * y, -turn * x
    sx = -1 if along_x < 0 or (along_x == 0 and x > 0) else 1
    sy = -1 if along_y < 0 or (along_y == 0 and y > 0) else 1
    return sx, sy


cpdef Int rounded_radius(Int x, Int y) noexcept:
    """Return √(x² + y²) rounded to the nearest step."""
    return int(math.sqrt(float(x * x + y * y)) + 0.5)


# Where a path about a centre comes nearest to a point, on the turn that it is expected on.
#
# A tracker walks along the samples of an arc (any method: DSM, DDA, stairs) and counts the
# quadrants that it enters: one more whenever a coordinate becomes 0. Only samples whose count lies
# in low … high are candidates, so that the pass of the right turn is taken. Exact: integers only.
# Compiled, because it runs beside the arc kernels, sample by sample.


cpdef enum:
    # So many samples are passed over at once where nothing can happen.
    STRIDE = 64


cpdef Int expected_quadrants(Int x, Int y, bint clockwise, Int end_x, Int end_y) noexcept:
    """Return the number of quadrants (0 … 4) that the motion enters from (x, y) to the end's ray.

    4 when the end is in the quadrant of the start but behind it, or on its ray: a whole turn.
    """
    cdef Int turn, entered, sx, sy, ex, ey
    if end_x == 0 and end_y == 0:
        return 0
    turn = -1 if clockwise else 1
    sx, sy = heading(x, y, clockwise)
    ex, ey = heading(end_x, end_y, clockwise)
    entered = 0
    while (sx != ex or sy != ey) and entered < 4:
        # A quarter turn of the velocity, in the sense of the motion.
        sx, sy = -turn * sy, turn * sx
        entered += 1
    if entered == 0 and turn * (x * end_y - y * end_x) <= 0:
        return 4
    return entered


def approach_start(x: int, y: int, end_x: int, end_y: int, low: int) -> Ints:
    """Return a new tracker (6,): x, y, quadrants entered, samples seen, nearest sample, its
    squared distance (−1 while there is none); sample 0 is the start itself."""
    square = (x - end_x) ** 2 + (y - end_y) ** 2
    return np.array([x, y, 0, 0, 0, square if low <= 0 else -1], dtype=np.int64)


def approach_scan(points: Ints, end: Ints, tracker: Ints, low: int, high: int) -> None:
    """Update the tracker by the samples `points` (n, 2), which follow those seen before.

    `end` (2,). The first of equally near samples counts.
    """
    path_x, path_y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    scan(path_x, path_y, len(points), end[0], end[1], tracker, low, high)


cdef void scan(
    Int[::1] path_x, Int[::1] path_y, Int count, Int end_x, Int end_y, Int[::1] tracker, Int low,
    Int high
) noexcept:
    """Update the tracker as `approach_scan` does, by `count` samples.

    No coordinate changes by more than one from sample to sample: of `STRIDE` of them none is 0, or
    nearer than the nearest, when the one before is far enough away.
    """
    cdef Int x, y, entered, sample_count, min_square, k, square, nearest, gap
    cdef bint in_window
    x, y, entered = tracker[0], tracker[1], tracker[2]
    sample_count, nearest, min_square, k = tracker[3], tracker[4], tracker[5], 0
    while k < count:
        if abs(x) > STRIDE and abs(y) > STRIDE and k + STRIDE <= count:
            gap = max(abs(x - end_x), abs(y - end_y)) - STRIDE
            in_window = low <= entered <= high
            if not in_window or (min_square >= 0 and gap > 0 and gap * gap >= min_square):
                k += STRIDE
                x, y = path_x[k - 1], path_y[k - 1]
                continue
        if (path_x[k] == 0 and x != 0) or (path_y[k] == 0 and y != 0):
            entered += 1
        x, y = path_x[k], path_y[k]
        k += 1
        if low <= entered <= high:
            square = (x - end_x) * (x - end_x) + (y - end_y) * (y - end_y)
            if min_square < 0 or square < min_square:
                nearest, min_square = sample_count + k, square
    tracker[0], tracker[1], tracker[2] = x, y, entered
    tracker[3], tracker[4], tracker[5] = sample_count + count, nearest, min_square


# Arcs by direct search (DSM), the step-by-step method of the PIC18F8720 controller.
#
# Positions are steps relative to the arc centre. With the error D = x² + y² − R² of the present
# position, a step of sx = ±1 in X and sy = ±1 in Y changes it by
#
#     ΔX = (x + sx)² − x² = 2·x·sx + 1,      ΔY = 2·y·sy + 1,
#
# and each iteration takes the one of X alone (|D + ΔX|), Y alone (|D + ΔY|) and both (|D + ΔX +
# ΔY|) that leaves the least |D|. On ties a single axis beats the diagonal and X beats Y. When the
# coordinate that shrinks reaches 0, the next quadrant begins: that coordinate goes on and now
# grows, the other one turns round. A start on an axis belongs to the quadrant that the motion
# enters. (Thesis equations 3.4-3.14, L1009-1042, L2348-2350.)
#
# The ties never decide, so that the method has every symmetry of the square: a single axis and the
# diagonal differ by the odd Δ of the other axis, and no two integers of equal size do; and where
# |D + ΔX| = |D + ΔY|, both are |x| + |y|, but the diagonal then gives ||x| − |y| ± 1|: less.
#
# With D = 0 at the start the path stays nearer than half a step to the circle through the start.
# Let m be the larger of |x|, |y|. Where the two candidates on either side of the circle differ in
# D by 2m − 1 or 2m + 1, an odd number, the better one has |D| ≤ m − 1 outside or |D| ≤ m ≤ r
# inside (m after the step); where none straddle, |D| falls. Then e = |r − R| = |D| / (r + R) obeys
# e (2R − e) ≤ R − e inside and e (2R + e) ≤ R + e − 1 outside; both fail at e = 1/2.
#
# Exact, because every number is an integer: D and both Δ are carried along in int64, as the
# firmware carries them, and no square or root is ever taken; 2·|x| + 1 and |D| stay far below 2⁶³
# for every radius that a program can say. Compiled, because each iteration depends on the one
# before and one part takes tens of millions of them.
#
# Most of a long arc needs no iterations. C = x² + y² − D never changes. While M, the coordinate of
# smaller size, runs and 2·M² ≤ C, so that the circle of C is no steeper than one to one, put
# A = C − M²; the other one, N, is best in size in its own line of the lattice when it is
#
#     n = round(√A),      that is   n² − n < A ≤ n² + n,      −n ≤ D = n² − A < n.
#
# From one M to the next √A changes by at most 1, and so does n: the best N is always among the two
# that an iteration may give N while M steps. It beats a step of N alone, with which |D| ≥ n
# towards the centre and ≥ n + 1 away from it, where the best of the next line has |D| no greater
# than its own n; ties, see above, do not decide. So a start with −|N| ≤ D < |N| gives N = ±
# round(√(C − M²)) for each M that follows, up to the diagonal or the axis: many at once, and no
# number waits for the one before. A root is told from n + ½ as long as n is below 2²⁴ (1/(8 n) is
# how far they are apart at least, and a root and a sum of float64 round less than 2⁻²⁸ away);
# larger ones iterate.
#
# `error` is the D that the controller starts with: 0, or x² + y² − round(R)² (the thesis leaves
# the choice open). Iteration 0 is the start itself, iteration k the position after k passes.
#
# A state is an int64 array (x, y, D, sx, sy), changed in place by `direct_search_fill`.


# Squares of the radius in steps from which on the closed form is not used.
cdef Int MAX_SQUARE = 1LL << 48

cpdef enum:
    # Fewer positions than these are iterated.
    MIN_RUN = 8

# Both coordinates of an end that no path meets.
cdef Int _NOWHERE = 1LL << 40
NOWHERE = _NOWHERE


cdef inline (Int, Int, Int, Int, Int, Int, Int) _advance(
    Int x, Int y, Int error, Int sx, Int sy, Int delta_x, Int delta_y
) noexcept:
    """Compute one iteration: the new x, y, D, sx, sy, ΔX, ΔY."""
    cdef Int only_x, only_y, both
    cdef bint move_x, move_y
    only_x = abs(error + delta_x)
    only_y = abs(error + delta_y)
    both = abs(error + delta_x + delta_y)
    if only_x > only_y:
        move_x, move_y = only_y > both, True
    else:
        move_x, move_y = True, only_x > both
    if move_x:
        x += sx
        error += delta_x
        delta_x += 2
    if move_y:
        y += sy
        error += delta_y
        delta_y += 2
    if move_y and y == 0:
        sx = -sx
        delta_x, delta_y = 2 * x * sx + 1, 1
    elif move_x and x == 0:
        sy = -sy
        delta_x, delta_y = 1, 2 * y * sy + 1
    return x, y, error, sx, sy, delta_x, delta_y


def direct_search_start(x: int, y: int, clockwise: bool, error: int = 0) -> Ints:
    """Return the state (5,) at the start (x, y) ≠ (0, 0) of an arc."""
    sx, sy = heading(x, y, clockwise)
    return np.array([x, y, error, sx, sy], dtype=np.int64)


cdef Int _run_length(Int m, Int n, Int sense, Int error, Int room) noexcept:
    """Return the number of positions, up to `room`, for which the closed form holds from M, N on
    while M runs in the direction `sense`."""
    cdef Int invariant, diagonal
    invariant = m * m + n * n - error
    if error < -abs(n) or error >= abs(n) or invariant >= MAX_SQUARE or 2 * m * m > invariant:
        return 0
    if m * sense < 0:
        return min(room, abs(m))
    diagonal = int(math.sqrt(0.5 * invariant))
    return min(room, diagonal - 1 - abs(m))


cdef wide _run(
    Int m, Int n, Int sense, Int error, Int[::1] out_m, Int[::1] out_n, Int low, Int high
) noexcept:
    """Write the positions that follow M, N while M runs in the direction `sense`, by the closed
    form, into the rows low … high − 1."""
    cdef Int first, k, size
    cdef double position, invariant
    invariant = float(m * m + n * n - error)
    first = m + sense * (1 - low)
    for k in range(low, high):
        out_m[k] = first + sense * k
    for k in range(low, high):
        position = float(out_m[k])
        # What is cut off here is cut off as by floor: the sum is not negative.
        size = int(math.sqrt(invariant - position * position) + 0.5)
        out_n[k] = size if n > 0 else -size


def direct_search_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]:
    """Run on from `state` into `out` (n, 2) until the end is met or `out` is full.

    Return the number of rows filled and whether the last of them is the end; `state` is then that
    of the last row, so that the next call continues.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, met = direct_search_run(state, end_x, end_y, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, met


cdef (Int, bint) direct_search_run(
    Int[::1] state, Int end_x, Int end_y, Int[::1] out_x, Int[::1] out_y
) noexcept:
    """Run on as `direct_search_fill` does, into one array for each axis."""
    cdef Int x, y, error, sx, sy, room, filled, run, _, m, n, sense, run_end, delta_x, delta_y, at
    cdef bint met, by_x
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    room, filled, met = len(out_x), 0, False
    while filled < room and not met:
        by_x = abs(x) < abs(y)
        m, n, sense = (x, y, sx) if by_x else (y, x, sy)
        run = _run_length(m, n, sense, error, room - filled)
        if run >= MIN_RUN:
            # M passes the end once.
            at = ((end_x if by_x else end_y) - m) * sense - 1
            run_end = filled + run
            if by_x:
                _run(m, n, sense, error, out_x, out_y, filled, run_end)
                met = 0 <= at < run and out_y[filled + at] == end_y
            else:
                _run(m, n, sense, error, out_y, out_x, filled, run_end)
                met = 0 <= at < run and out_x[filled + at] == end_x
            filled = filled + at + 1 if met else run_end
            x, y = out_x[filled - 1], out_y[filled - 1]
            error += x * x + y * y - m * m - n * n
            if by_x and x == 0:
                sy = -sy
            elif y == 0 and not by_x:
                sx = -sx
            continue
        delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
        for _ in range(min(MIN_RUN, room - filled)):
            x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
            out_x[filled], out_y[filled] = x, y
            filled += 1
            met = x == end_x and y == end_y
            if met:
                break
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    return filled, met


cpdef void skip(Int[::1] state, Int count) noexcept:
    """Advance by `count` iterations as `direct_search_fill` does, but without computing positions
    on the way where the closed form gives the last one."""
    cdef Int x, y, error, sx, sy, m, n, sense, run, size, _, invariant, delta_x, delta_y
    cdef bint by_x
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    while count > 0:
        by_x = abs(x) < abs(y)
        m, n, sense = (x, y, sx) if by_x else (y, x, sy)
        run = _run_length(m, n, sense, error, count)
        if run >= MIN_RUN:
            invariant = m * m + n * n - error
            m += sense * run
            size = int(math.sqrt(float(invariant - m * m)) + 0.5)
            n = size if n > 0 else -size
            error = m * m + n * n - invariant
            x, y = (m, n) if by_x else (n, m)
            if by_x and x == 0:
                sy = -sy
            elif y == 0 and not by_x:
                sx = -sx
            count -= run
            continue
        delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
        run = min(MIN_RUN, count)
        for _ in range(run):
            x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
        count -= run
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy


cpdef Int first_at(Int[::1] state, Int end_x, Int end_y, Int limit) noexcept:
    """Return the first iteration, 1 … limit, from `state` on at which the position equals the end,
    or −1; `state` is advanced to there.

    This is the controller's stop test, done after each iteration: an end at the start is met after
    a whole turn. No coordinate changes by more than one per iteration, so the end cannot be met in
    fewer iterations than the larger of its two distances.
    """
    cdef Int iterations, distance, run
    iterations = 0
    while iterations < limit:
        distance = int(max(abs(state[0] - end_x), abs(state[1] - end_y)))
        run = min(max(distance, 1), limit - iterations)
        skip(state, run)
        iterations += run
        if state[0] == end_x and state[1] == end_y:
            return iterations
    return -1


cpdef (Int, Int) nearest_to(Int[::1] state, Int end_x, Int end_y, Int low, Int high) noexcept:
    """Return the iteration in low … high (both included) nearest to the end, the first one on
    ties, and its squared distance in steps²; (−1, −1) when the range is empty. `state` is advanced
    to `high`.

    As in `first_at`, a position that is to be no farther than d cannot come before `apart` − d
    iterations. Long strides first bound how near it comes.
    """
    cdef Int iterations, best, min_square, off_x, off_y, square, run, x, y, error, sx, sy
    if high < low:
        return -1, -1
    skip(state, low)
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    iterations, best, min_square = low, -1, -1
    while True:
        off_x, off_y = abs(state[0] - end_x), abs(state[1] - end_y)
        square = off_x * off_x + off_y * off_y
        if min_square < 0 or square < min_square:
            min_square = square
        if iterations == high:
            break
        run = min(max(off_x, off_y, 1), high - iterations)
        skip(state, run)
        iterations += run
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    iterations = low
    while True:
        off_x, off_y = abs(state[0] - end_x), abs(state[1] - end_y)
        square = off_x * off_x + off_y * off_y
        if square < min_square or (best < 0 and square == min_square):
            best, min_square = iterations, square
        if iterations == high:
            return best, min_square
        run = max(off_x, off_y) - int(math.sqrt(float(min_square)))
        run = min(max(run, 1), high - iterations)
        skip(state, run)
        iterations += run


# Arcs by stairs (the incremental method): one axis per iteration.
#
# With D = x² + y² − R² as in direct search: while D ≤ 0 the coordinate that
# grows in this quadrant takes a step outward, else the one that shrinks takes a step inward; when
# the latter reaches 0 the next quadrant begins. (Thesis equations 3.4-3.13, L918-1006; tie rule of
# its annex A.5.) `error` is D at the start, 0 for the circle through the start.
#
# With D = 0 at the start the path stays nearer than one step to that circle: a step outward leaves
# 0 < D ≤ 2g − 1 with g < r the coordinate that grew, so e (2R + e) < 2 (R + e) − 1, which fails at
# e = 1; a step inward leaves D ≥ −2s with s ≤ r, so e (2R − e) ≤ 2 (R − e), which fails there too.
#
# Exact, because every number is an integer in int64. Compiled, because each iteration depends on
# the one before.


def stairs_start(x: int, y: int, clockwise: bool, error: int = 0) -> Ints:
    """Return the state (5,) at the start (x, y) ≠ (0, 0) of an arc: x, y, D, sx, sy."""
    sx, sy = heading(x, y, clockwise)
    return np.array([x, y, error, sx, sy], dtype=np.int64)


def stairs_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]:
    """Run on from `state` into `out` (n, 2) until the end is met or `out` is full.

    Return the number of rows filled and whether the last of them is the end; `state` is then that
    of the last row, so that the next call continues.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, met = _stairs(state, end_x, end_y, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, met


cdef (Int, bint) _stairs(
    Int[::1] state, Int end_x, Int end_y, Int[::1] out_x, Int[::1] out_y
) noexcept:
    """Run on as `stairs_fill` does, into one array for each axis."""
    cdef Int x, y, error, sx, sy, filled
    cdef bint met, x_grows
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    filled, met = 0, False
    while filled < len(out_x) and not met:
        x_grows = x * sx >= 0
        if x_grows == (error <= 0):
            error += 2 * x * sx + 1
            x += sx
            if x == 0:
                sy = -sy
        else:
            error += 2 * y * sy + 1
            y += sy
            if y == 0:
                sx = -sx
        out_x[filled] = x
        out_y[filled] = y
        filled += 1
        met = x == end_x and y == end_y
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    return filled, met


# Lines and arcs by digital differential analysers (DDA).
#
# Line of |a|, |b| steps (thesis L827-883, annex A.3). Each pass adds a to register Qx; when the
# register is strictly above L = √(a² + b²) and the counter of X is not yet full, L is taken off it
# and X gives a pulse; then the same for Y. The line ends when both counters are full. (The limit
# is the hypotenuse, not the greater projection: passes are in proportion to length.)
#
# Arc (L889-915, annex A.4). In each quadrant one coordinate grows and one shrinks; g and s are
# their magnitudes, R the overflow limit. Each pass, the growing axis first:
#
#     Qg += s;  if Qg > R and g < R:  Qg −= R, pulse, g += 1
#     Qs += g;  if Qs > R and s > 0:  Qs −= R, pulse, s −= 1      (with the g of this very pass)
#
# The thesis works on full quadrants only: registers 0, counter of the growing axis 0 … R, of the
# other 0 … R, both end together at g = R, s = 0. Ours for arcs that begin or end inside one:
# R = round(√(x² + y²)); the registers Q start at 0; the growing counter starts at |g|, the
# shrinking one at R − |s|, which is to say that the coordinates themselves are the counters; the
# quadrant ends when s = 0. On full quadrants that is the same (the tests try all R < 600). About
# one start in twenty arrives there with g = R − 1, where the counters of the thesis would wait for
# ever, since s = 0 adds nothing to Qg any more; we go on into the next quadrant, whose registers
# begin at 0 as always. The stop test runs after each pass that gave a pulse: the first pass never
# does, and would end a full circle before it began.
#
# Exact, because the registers of the arc are integers; those of the line are float64, added,
# compared and subtracted in the controller's order, without contraction, so that every rounding is
# the same as in the literal loop. Compiled, because that order admits no closed form.


def dda_line_fill(
    a: int, b: int, registers: Floats, counters: Ints, out: Ints
) -> tuple[int, int, bool]:
    """Run a line of a ≥ 0, b ≥ 0 steps on into `out` (n, 2), one row per pass with a pulse.

    `registers` (2,) and `counters` (2,) begin at 0 and are changed in place. Return the number of
    rows filled, the passes run, and whether the line is finished.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, passes, met = _dda_line(a, b, registers, counters, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, passes, met


cdef (Int, Int, bint) _dda_line(
    Int a, Int b, double[::1] registers, Int[::1] counters, Int[::1] out_x, Int[::1] out_y
) noexcept:
    """Run on as `dda_line_fill` does, into one array for each axis."""
    cdef Int x, y, filled, passes
    cdef bint pulse
    cdef double limit
    limit = math.sqrt(float(a * a + b * b))
    in_x, in_y, x, y = registers[0], registers[1], counters[0], counters[1]
    filled, passes = 0, 0
    while filled < len(out_x) and (x < a or y < b):
        passes += 1
        pulse = False
        in_x += a
        if x < a and in_x > limit:
            in_x -= limit
            x += 1
            pulse = True
        in_y += b
        if y < b and in_y > limit:
            in_y -= limit
            y += 1
            pulse = True
        if pulse:
            out_x[filled] = x
            out_y[filled] = y
            filled += 1
    registers[0], registers[1], counters[0], counters[1] = in_x, in_y, x, y
    return filled, passes, x >= a and y >= b


def dda_arc_start(x: int, y: int, clockwise: bool) -> Ints:
    """Return the state (8,) at the start (x, y) ≠ (0, 0): x, y, sx, sy, R, Qg, Qs, whether x
    grows."""
    sx, sy = heading(x, y, clockwise)
    radius = rounded_radius(x, y)
    return np.array([x, y, sx, sy, radius, 0, 0, 1 if x * sx >= 0 else 0], dtype=np.int64)


cdef inline (Int, Int, Int, Int) _arc_pass(
    Int grow, Int shrink, Int radius, Int in_grow, Int in_shrink
) noexcept:
    """Compute one pass: g, s, Qg, Qs after it."""
    in_grow += shrink
    if in_grow > radius and grow < radius:
        in_grow -= radius
        grow += 1
    in_shrink += grow
    if in_shrink > radius and shrink > 0:
        in_shrink -= radius
        shrink -= 1
    return grow, shrink, in_grow, in_shrink


def dda_arc_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, int, bool]:
    """Run on from `state` into `out` (n, 2), one row per pass with a pulse.

    Stop when the end is met or `out` is full. Return the number of rows filled, the passes run,
    and whether the last row is the end.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, passes, met = _dda_arc(state, end_x, end_y, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, passes, met


cdef (Int, Int, bint) _dda_arc(
    Int[::1] state, Int end_x, Int end_y, Int[::1] out_x, Int[::1] out_y
) noexcept:
    """Run on as `dda_arc_fill` does, into one array for each axis."""
    cdef Int x, y, sx, sy, radius, in_grow, in_shrink, filled, passes, grow, shrink, new_grow
    cdef Int new_shrink
    cdef bint x_grows, met
    x, y, sx, sy = state[0], state[1], state[2], state[3]
    radius, in_grow, in_shrink, x_grows = state[4], state[5], state[6], state[7] == 1
    filled, passes, met = 0, 0, False
    while filled < len(out_x) and not met:
        passes += 1
        grow, shrink = (abs(x), abs(y)) if x_grows else (abs(y), abs(x))
        new_grow, new_shrink, in_grow, in_shrink = _arc_pass(
            grow, shrink, radius, in_grow, in_shrink
        )
        if new_grow == grow and new_shrink == shrink:
            continue
        if x_grows:
            x, y = sx * new_grow, -sy * new_shrink
        else:
            x, y = -sx * new_shrink, sy * new_grow
        if new_shrink == 0:
            sx, sy = (-sx, sy) if x_grows else (sx, -sy)
            x_grows = not x_grows
            in_grow, in_shrink = 0, 0
        out_x[filled] = x
        out_y[filled] = y
        filled += 1
        met = x == end_x and y == end_y
    state[0], state[1], state[2], state[3] = x, y, sx, sy
    state[5], state[6], state[7] = in_grow, in_shrink, 1 if x_grows else 0
    return filled, passes, met


# Legs of the PIC18F8720's program: what they are, and the interpolator that makes their steps.
#
# A leg is what one interpolator makes: a line of X and Y, an arc, or a line of Z. Its positions
# come in blocks, from a state of a few whole numbers that goes on. Exact: integers, as in the
# kernels of the methods.


cpdef enum:
    # Columns of a leg, in steps: the row; what it is; where X and Y stand before; how far a line
    # goes (of Z: in A, its sign in CW), or where an arc starts about its centre; the start of a
    # line or the centre of an arc, and the signs that its positions are taken with; the end of an
    # arc about its centre; whether it is clockwise; after how many samples an arc stops, −1: where
    # it stands on its end.
    ROW = 0, KIND, FROM_X, FROM_Y, A, B, ORIGIN_X, ORIGIN_Y, SIGN_X, SIGN_Y, END_X, END_Y, CW, STOP
    # How many columns.
    LEG_COLUMNS = 14
    # Kinds of legs.
    LINE = 0, ARC, DEPTH
    # Methods of arcs.
    DSM = 0, STAIRS, DDA
    # Numbers of a state: as many as the method with the longest one has.
    STATE = 8


cdef void start_leg(Int[::1] leg, Int method, bint rounded, Int[::1] state) noexcept:
    """Set the state (8,) to the start of a leg; the state of a line holds its counters."""
    cdef Int k, radius, x, y, sx, sy
    cdef bint clockwise
    for k in range(len(state)):
        state[k] = 0
    if leg[KIND] != ARC:
        return
    x, y, clockwise = leg[A], leg[B], leg[CW] != 0
    sx, sy = heading(x, y, clockwise)
    radius = rounded_radius(x, y)
    state[0], state[1] = x, y
    if method == DDA:
        state[2], state[3], state[4] = sx, sy, radius
        state[7] = 1 if x * sx >= 0 else 0
    else:
        state[2] = x * x + y * y - radius * radius if rounded else 0
        state[3], state[4] = sx, sy


cdef (Int, Int, bint) fill_leg(
    Int[::1] leg, Int method, Int[::1] state, double[::1] registers, Int[::1] out_x, Int[::1] out_y
) noexcept:
    """Run a leg on into `out_x`, `out_y`; return the positions filled, the passes run, and whether
    the last position is the end."""
    cdef Int filled
    cdef bint met
    if leg[KIND] != ARC:
        return _dda_line(leg[A], leg[B], registers, state, out_x, out_y)
    if method == DDA:
        return _dda_arc(state, leg[END_X], leg[END_Y], out_x, out_y)
    if method == DSM:
        filled, met = direct_search_run(state, leg[END_X], leg[END_Y], out_x, out_y)
    else:
        filled, met = _stairs(state, leg[END_X], leg[END_Y], out_x, out_y)
    return filled, filled, met


cdef void turn_round(Int[::1] leg, Int[::1] path_x, Int[::1] path_y, Int count) noexcept:
    """Give the positions of a line their signs; a line along Z leaves X and Y unchanged."""
    cdef Int k, sign_x, sign_y
    sign_x, sign_y = leg[SIGN_X], leg[SIGN_Y]
    if leg[KIND] == DEPTH:
        sign_x = sign_y = 0
    for k in range(count):
        path_x[k] *= sign_x
        path_y[k] *= sign_y


# Where an arc of the PIC18F8720 stops, by each reading of its test (L1859-1862).
#
# The thesis says that after each iteration the controller looks whether the end is reached and
# whether the quadrant changes, and that it knows the final quadrant. It does not say how:
#
#     EQUAL            both coordinates equal the end's, wherever that is: a path that misses the
#                      end goes round again, mostly for ever
#     FINAL_QUADRANT   in the quadrant of the end (so many changes after the start as the sweep
#                      has) both coordinates have reached the end's or are past it, in the
#                      directions of that quadrant; or the path leaves that quadrant
#     NEAREST          at the step nearest to the end, on the turn that is expected
#
# A path that stands on the end on its expected turn stops there by all three: in one quadrant both
# coordinates run one way, so no step before it has reached both.
#
# Exact: integers. Compiled, because it looks at every step of an arc that has no closed form.


cpdef enum:
    # Readings.
    EQUAL = 0, FINAL_QUADRANT, NEAREST

READINGS = {"equal": EQUAL, "final-quadrant": FINAL_QUADRANT, "nearest": NEAREST}
"""Their names, as in `controller.arc_end`."""

cpdef enum:
    # Columns of a stop: samples up to it, where it is about the centre, and whether it is the end.
    STOP_SAMPLES = 0, STOP_X, STOP_Y, MET
    # How many columns.
    STOP_COLUMNS = 4
    # Positions that are looked at in one go.
    LOOKED_AT = 1 << 12


cdef Int _passes(
    Int[::1] path_x, Int[::1] path_y, Int count, Int[::1] leg, Int[::1] tracker, Int expected
) noexcept:
    """Return the index of the position, of `count`, at which an arc stops in its final quadrant,
    −1 for none; `tracker` as in `approach_start`."""
    cdef Int x, y, entered, end_x, end_y, to_x, to_y, index, k
    cdef bint reached, short
    x, y, entered = tracker[0], tracker[1], tracker[2]
    end_x, end_y = leg[END_X], leg[END_Y]
    to_x, to_y = heading(end_x, end_y, leg[CW] != 0)
    index, k = -1, 0
    while k < count:
        if abs(x) > STRIDE and abs(y) > STRIDE and k + STRIDE <= count:
            # Not before one of the coordinates has come as far as the end (see `scan`).
            short = to_x * (end_x - x) > STRIDE or to_y * (end_y - y) > STRIDE
            if entered < expected or (entered == expected and short):
                k += STRIDE
                x, y = path_x[k - 1], path_y[k - 1]
                continue
        if (path_x[k] == 0 and x != 0) or (path_y[k] == 0 and y != 0):
            entered += 1
        x, y = path_x[k], path_y[k]
        reached = to_x * (x - end_x) >= 0 and to_y * (y - end_y) >= 0
        if entered > expected or (entered == expected and reached):
            index = k
            break
        k += 1
    tracker[0], tracker[1], tracker[2] = x, y, entered
    return index


cdef void _stop(
    Int[::1] leg, Int method, bint rounded, Int reading, Int[::1] path_x, Int[::1] path_y,
    double[::1] registers, Int[::1] state, Int[::1] tracker, Int[::1] out
) noexcept:
    """Fill `out` (4,) with the stop of one arc that does not start at its centre. Scratch buffers:
    positions, registers (2,) and state (8,) of an interpolator, and a tracker (6,) of
    `approach_start`."""
    cdef Int expected, size, end_x, end_y, low, high, begin, at, filled, _, best, off_x, off_y
    cdef Int nearest
    cdef Int[::1] part_x, part_y
    cdef bint met
    if method == DSM:
        _stop_by_closed_form(leg, rounded, reading, state, out)
        return
    end_x, end_y = leg[END_X], leg[END_Y]
    start_leg(leg, method, rounded, state)
    registers[0] = registers[1] = 0.0
    expected = expected_quadrants(leg[A], leg[B], leg[CW] != 0, end_x, end_y)
    low, high = expected - 1, expected + 1
    off_x, off_y = leg[A] - end_x, leg[B] - end_y
    tracker[0], tracker[1], tracker[2] = leg[A], leg[B], 0
    tracker[3], tracker[4] = 0, 0
    tracker[5] = -1 if low > 0 else off_x * off_x + off_y * off_y
    out[STOP_SAMPLES], out[STOP_X], out[STOP_Y], out[MET] = 0, leg[A], leg[B], 0
    size = min(LOOKED_AT, 8 * (max(abs(leg[A]), abs(leg[B])) + 1))
    part_x, part_y, begin = path_x[:size], path_y[:size], 0
    while True:
        filled, _, met = fill_leg(leg, method, state, registers, part_x, part_y)
        at = -1
        if reading == FINAL_QUADRANT:
            at = _passes(part_x, part_y, filled, leg, tracker, expected)
        else:
            best = tracker[4]
            scan(part_x, part_y, filled, end_x, end_y, tracker, low, high)
            if tracker[4] != best:
                nearest = tracker[4] - begin - 1
                out[STOP_SAMPLES] = tracker[4]
                out[STOP_X], out[STOP_Y] = part_x[nearest], part_y[nearest]
            if tracker[2] > high:
                return
            if met and (reading == EQUAL or tracker[2] >= low):
                at = filled - 1
        if at >= 0:
            out[STOP_SAMPLES], out[STOP_X], out[STOP_Y] = begin + at + 1, part_x[at], part_y[at]
            out[MET] = 1 if part_x[at] == end_x and part_y[at] == end_y else 0
            return
        begin += filled


cdef void _stop_by_closed_form(
    Int[::1] leg, bint rounded, Int reading, Int[::1] state, Int[::1] out
) noexcept:
    """Fill `out` as `_stop` does, for direct search: no coordinate changes by more than one per
    iteration, so an event that is at least n iterations away is searched only from then on."""
    cdef Int expected, end_x, end_y, low, high, first, last, begin, at, to_x, to_y, entered, x, y
    cdef Int short, run, _
    end_x, end_y = leg[END_X], leg[END_Y]
    expected = expected_quadrants(leg[A], leg[B], leg[CW] != 0, end_x, end_y)
    start_leg(leg, DSM, rounded, state)
    if reading == FINAL_QUADRANT:
        begin = _enter(state, expected)
        to_x, to_y = heading(end_x, end_y, leg[CW] != 0)
        entered = 0
        while True:
            x, y = state[0], state[1]
            short = int(max(to_x * (end_x - x), to_y * (end_y - y)))
            if begin > 0 and (entered == 1 or short <= 0):
                break
            run = max(1, min(short, abs(x), abs(y)))
            skip(state, run)
            begin += run
            if (state[0] == 0 and x != 0) or (state[1] == 0 and y != 0):
                entered = 1
        out[STOP_SAMPLES], out[STOP_X], out[STOP_Y] = begin, state[0], state[1]
        out[MET] = 1 if state[0] == end_x and state[1] == end_y else 0
        return
    low, high = max(0, expected - 1), expected + 1
    first = _enter(state, low)
    last = first + _enter(state, high + 1 - low) - 1
    start_leg(leg, DSM, rounded, state)
    begin = max(0, first - 1) if reading == NEAREST else 0
    skip(state, begin)
    at = first_at(state, end_x, end_y, last - begin)
    if at > 0:
        out[STOP_SAMPLES], out[STOP_X], out[STOP_Y], out[MET] = begin + at, end_x, end_y, 1
        return
    start_leg(leg, DSM, rounded, state)
    at, _ = nearest_to(state, end_x, end_y, first, last)
    start_leg(leg, DSM, rounded, state)
    skip(state, at)
    out[STOP_SAMPLES], out[STOP_X], out[STOP_Y], out[MET] = at, state[0], state[1], 0


cdef Int _enter(Int[::1] state, Int count) noexcept:
    """Run on by direct search until `count` more quadrants are entered; return the number of
    iterations."""
    cdef Int iterations, x, y, run
    iterations = 0
    while count > 0:
        x, y = state[0], state[1]
        run = int(max(1, min(abs(x), abs(y))))
        skip(state, run)
        iterations += run
        if (state[0] == 0 and x != 0) or (state[1] == 0 and y != 0):
            count -= 1
    return iterations


cpdef void arc_stops(Int[:, ::1] legs, (Int, bint, Int) how, Int[:, ::1] out):
    """Fill `out` (L, 4) with the stop of each arc of legs (L, 14) by itself; 0 in other rows.

    `how`: the method of arcs, whether their error starts as that against the rounded radius, and
    the reading. An arc that misses its end by `EQUAL` has the stop of `NEAREST`, and MET = 0.
    """
    cdef Int number, method, reading
    cdef Int[::1] path_x, path_y, tracker, leg, state, stop
    cdef bint rounded
    cdef double[::1] registers
    method, rounded, reading = how
    path_x, path_y = np.empty(LOOKED_AT, np.int64), np.empty(LOOKED_AT, np.int64)
    registers, state, tracker = np.zeros(2), np.zeros(STATE, np.int64), np.zeros(6, np.int64)
    for number in range(len(legs)):
        leg, stop = legs[number], out[number]
        stop[0] = stop[1] = stop[2] = stop[3] = 0
        if leg[KIND] == ARC and (leg[A] != 0 or leg[B] != 0):
            _stop(leg, method, rounded, reading, path_x, path_y, registers, state, tracker, stop)


cpdef void run_on(
    Int[::1] moves, Int[::1] start, Int[:, ::1] ends, Int[:, ::1] centres, (Int, bint, Int) how,
    Int[::1] samples
):
    """Follow the rows of a program, each from where the one before really stopped, and change
    `ends` and `samples` accordingly.

    `moves` (N,): 0 where X and Y stay, 1 for a line, 2 and 3 for an arc counter-clockwise and
    clockwise; `start` (2,), `ends` (N, 2), `centres` (N, 2) steps. The end of an arc becomes its
    stop, and a line to the programmed position before it stays at that stop; `samples` (N,)
    becomes the samples of each arc, −1 for other rows.
    """
    cdef Int row, method, reading, x, y, said_x, said_y, end_x, end_y
    cdef Int[::1] path_x, path_y, tracker, leg, out, state
    cdef bint rounded
    cdef double[::1] registers
    method, rounded, reading = how
    path_x, path_y = np.empty(LOOKED_AT, np.int64), np.empty(LOOKED_AT, np.int64)
    registers, state, tracker = np.zeros(2), np.zeros(STATE, np.int64), np.zeros(6, np.int64)
    leg, out = np.zeros(LEG_COLUMNS, np.int64), np.zeros(STOP_COLUMNS, np.int64)
    leg[KIND] = ARC
    x, y = start[0], start[1]
    said_x, said_y = x, y
    for row in range(len(moves)):
        samples[row] = -1
        if moves[row] == 0:
            continue
        end_x, end_y = ends[row, 0], ends[row, 1]
        if moves[row] == 1:
            if end_x == said_x and end_y == said_y:
                ends[row, 0], ends[row, 1] = x, y
        else:
            leg[A], leg[B] = x - centres[row, 0], y - centres[row, 1]
            leg[END_X], leg[END_Y] = end_x - centres[row, 0], end_y - centres[row, 1]
            leg[CW] = 1 if moves[row] == 3 else 0
            if leg[A] != 0 or leg[B] != 0:
                _stop(
                    leg, method, rounded, reading, path_x, path_y, registers, state, tracker, out
                )
                samples[row] = out[STOP_SAMPLES]
                ends[row, 0] = out[STOP_X] + centres[row, 0]
                ends[row, 1] = out[STOP_Y] + centres[row, 1]
        said_x, said_y = end_x, end_y
        x, y = ends[row, 0], ends[row, 1]


# Whole rows of the PIC18F8720's program, run and judged in one go, block by block.
#
# The positions of a leg go to a small buffer, the slides follow
# (`camtool.kernels.play`), and the block is judged (`camtool.kernels.judging`) before the
# next one is made: nothing is kept of the steps themselves.
#
# An arc runs for as many samples as are known (`arc_stops`), or until it stands on
# its end. One that passes it must stop at its nearest approach, so near the end, on the turn that
# is expected, the arc is first run ahead to see what becomes of it (`arc_reach` of
# `camtool_postprocessors.pic_mmh.controller` does that with whole arcs, always). A path of direct
# search or stairs is never farther than one step from the circle through its start; so the end,
# when it is within `NEAR_RADIUS` of that circle, is passed within `NEAR_STEPS`, and no nearest
# approach lies outside. Other arcs are run ahead from their start.


cpdef enum:
    # Columns of the counts of a leg: samples, passes, steps X Y Z, reversals X Y Z, ended.
    SAMPLES = 0, PASSES = 1, STEPS = 2, REVERSALS = 5, ENDED = 8
    # How many columns.
    COUNT_COLUMNS = 9


# Steps that the end of an arc may be off the circle through its start.
cdef double NEAR_RADIUS = 4.0

cpdef enum:
    # Within so many steps, in X and in Y, of its end an arc is run ahead.
    NEAR_STEPS = 8
    # Smaller arcs are run ahead from their start.
    MIN_RADIUS = 16
    # Positions that are looked at in one go when an arc is run ahead.
    RUN_AHEAD = 1 << 12


cdef class Room:
    """Arrays to work in: path (`RUN_AHEAD`,) of X and Y in steps; the state (8,) of an
    interpolator and a copy of it; tracker (6,) and registers (2,) of what runs."""

    cdef Int[::1] path_x, path_y, state, other, tracker
    cdef double[::1] registers

    def __init__(self) -> None:
        self.path_x = room_for(RUN_AHEAD, np.int64)
        self.path_y = room_for(RUN_AHEAD, np.int64)
        self.state, self.other = np.zeros(STATE, np.int64), np.zeros(STATE, np.int64)
        self.tracker, self.registers = np.zeros(6, np.int64), np.zeros(2)


cdef void _copy(Int[::1] from_, Int[::1] to) noexcept:
    cdef Int k
    for k in range(len(to)):
        to[k] = from_[k]


cdef (Int, bint) _run_ahead(
    Int[::1] leg, Int method, Int entered, Int low, Int high, Room room
) noexcept:
    """Return the number of positions from the present state to the end, and True; or to its
    nearest approach in the quadrants low … high, and False. `entered` quadrants have been entered
    before."""
    cdef Int size, end_x, end_y, filled, _, off_x, off_y
    cdef Int[::1] tracker, state, path_x, path_y
    cdef bint met
    cdef double[::1] registers
    tracker, state, registers = room.tracker, room.other, room.registers
    end_x, end_y = leg[END_X], leg[END_Y]
    _copy(room.state, state)
    off_x, off_y = state[0] - end_x, state[1] - end_y
    tracker[0], tracker[1], tracker[2] = state[0], state[1], entered
    tracker[3], tracker[4] = 0, 0
    tracker[5] = off_x * off_x + off_y * off_y if entered >= low else -1
    size = min(RUN_AHEAD, 8 * (max(abs(leg[A]), abs(leg[B])) + 1))
    path_x, path_y = room.path_x[:size], room.path_y[:size]
    while True:
        filled, _, met = fill_leg(leg, method, state, registers, path_x, path_y)
        scan(path_x, path_y, filled, end_x, end_y, tracker, low, high)
        if tracker[2] > high:
            return tracker[4], False
        if met:
            return tracker[3], True


cdef (Int, Int) _ways(
    Int[::1] leg, Int method, Int[::1] before, Int[::1] after, Int at_x, Int at_y, Int[::1] path_x,
    Int[::1] path_y
) noexcept:
    """Return the directions of X and Y on the positions (n,) that follow at_x, at_y. `before` and
    `after`: the states before and after these.

    A line runs in one direction. So does a path of direct search between its quadrants; only a
    whole turn brings the same signs back, and that is more than a block when the circle is larger
    than one.
    """
    cdef Int last, sign_x, sign_y
    cdef bint is_exact
    is_exact, sign_x, sign_y = leg[KIND] == LINE, leg[SIGN_X], leg[SIGN_Y]
    if method == DSM and leg[KIND] == ARC and max(abs(at_x), abs(at_y)) > BLOCK:
        is_exact = before[3] == after[3] and before[4] == after[4]
        sign_x, sign_y = after[3], after[4]
    if not is_exact:
        return way_of(at_x, path_x), way_of(at_y, path_y)
    last = len(path_x) - 1
    return (
        STILL if path_x[last] == at_x else sign_x,
        STILL if path_y[last] == at_y else sign_y,
    )


cdef inline bint _is_near(Int low, Int high, Int end) noexcept:
    """Return True if low … high, in either order, comes within `NEAR_STEPS` of the end."""
    return min(low, high) <= end + NEAR_STEPS and max(low, high) >= end - NEAR_STEPS


cdef (Int, bint) _passed(
    Int[::1] leg, Int x, Int y, Int[::1] path_x, Int[::1] path_y, Int way_x, Int way_y
) noexcept:
    """Return the number of quadrants that the positions (n,) after (x, y) enter, and True if they
    may be near the end. A coordinate that runs in one direction becomes 0 at most once."""
    cdef Int k, entered, last, to_x, to_y
    cdef bint near
    entered, near = 0, False
    if way_x != TURNING and way_y != TURNING:
        last = len(path_x) - 1
        to_x, to_y = path_x[last], path_y[last]
        entered += 1 if x != 0 and x * to_x <= 0 else 0
        entered += 1 if y != 0 and y * to_y <= 0 else 0
        return entered, _is_near(x, to_x, leg[END_X]) and _is_near(y, to_y, leg[END_Y])
    for k in range(len(path_x)):
        if (path_x[k] == 0 and x != 0) or (path_y[k] == 0 and y != 0):
            entered += 1
        x, y = path_x[k], path_y[k]
        near = near or (_is_near(x, x, leg[END_X]) and _is_near(y, y, leg[END_Y]))
    return entered, near


cdef wide _move_slide(
    Int[::1] leg, Int axis, Int trend, Int[::1] steps, Int at, double step_mm, double[::1] play,
    double[::1] state, Int[::1] counts, double[::1] commanded, double[::1] slide
) noexcept:
    """Move the slide of X or Y by `steps` (n,) about the origin of the leg, in the direction
    `trend` from `at` on, and count steps and reversals."""
    cdef Int origin, k, way_on, count
    count = len(steps)
    origin = leg[ORIGIN_X + axis]
    for k in range(count):
        commanded[k] = (origin + steps[k]) * step_mm
    counts[REVERSALS + axis] += play_block(trend, commanded[:count], play, state, slide[:count])
    way_on = abs(steps[count - 1] - at)
    if trend == TURNING:
        way_on = abs(steps[0] - at)
        for k in range(1, count):
            way_on += abs(steps[k] - steps[k - 1])
    counts[STEPS + axis] += way_on


cdef void _deepen(Int[::1] leg, double[::1] state, Int[::1] counts) noexcept:
    """Count a leg of Z; its `state` (6,) need not hold the position of the slide."""
    counts[STEPS + 2] = leg[A]
    if state[1] != leg[CW]:
        state[1] = leg[CW]
        counts[REVERSALS + 2] = 1


cpdef void judge_legs(
    Int[:, ::1] legs, (Int, bint) how, double step_mm, mechanics, Int[:, ::1] counts, task, sums
):
    """Run and judge legs (L, 14) in order; fill `counts` (L, 9).

    `how`: the method of arcs, and whether their error starts as that against the rounded radius;
    `mechanics`: axes (3, 5) and states (3, 6) of `camtool.kernels.play`; the states continue.
    """
    cdef Int number, method
    cdef Int[::1] leg, count
    cdef Judge judge
    cdef Room room
    cdef bint rounded
    cdef double[:, ::1] axes, states
    method, rounded = how
    axes, states = mechanics
    judge, room = Judge(task, sums), Room()
    for number in range(len(legs)):
        leg, count = legs[number], counts[number]
        if leg[KIND] != ARC or leg[A] != 0 or leg[B] != 0:
            start_leg(leg, method, rounded, room.state)
            _judge_leg(leg, method, step_mm, axes, states, count, judge, room)


cdef void _judge_leg(
    Int[::1] leg, Int method, double step_mm, double[:, ::1] axes, double[:, ::1] states,
    Int[::1] count, Judge judge, Room room
) noexcept:
    """Run and judge a leg, beginning with the state in `room`."""
    cdef Int x, y, end_x, end_y, at_x, at_y, low, high, expected, entered, remaining, size, filled
    cdef Int passes, way_x, way_y, more
    cdef Int[::1] path_x, path_y, state, other
    cdef bint arc, careful, met, near
    cdef double[::1] registers
    arc, x, y = leg[KIND] == ARC, leg[A], leg[B]
    end_x, end_y = leg[END_X], leg[END_Y]
    state, other, registers = room.state, room.other, room.registers
    registers[0] = registers[1] = 0.0
    at_x, at_y = leg[FROM_X] - leg[ORIGIN_X], leg[FROM_Y] - leg[ORIGIN_Y]
    careful, low, high = False, 0, 0
    if arc:
        expected = expected_quadrants(x, y, leg[CW] != 0, end_x, end_y)
        low, high = expected - 1, expected + 1
        change = abs(math.hypot(float(x), float(y)) - math.hypot(float(end_x), float(end_y)))
        careful = method == DDA or change > NEAR_RADIUS or max(abs(x), abs(y)) < MIN_RADIUS
    entered, remaining, met = 0, -1, False
    if arc and leg[STOP] >= 0:
        remaining, count[ENDED] = leg[STOP], 1
    while remaining != 0 and not (remaining < 0 and met):
        if careful and remaining < 0:
            remaining, met = _run_ahead(leg, method, entered, low, high, room)
            count[ENDED] = 1 if met else 0
            continue
        _copy(state, other)
        size = BLOCK if remaining < 0 or remaining >= BLOCK else remaining
        path_x, path_y = room.path_x[:size], room.path_y[:size]
        filled, passes, met = fill_leg(leg, method, state, registers, path_x, path_y)
        if filled > 0:
            path_x, path_y = path_x[:filled], path_y[:filled]
            if not arc:
                turn_round(leg, path_x, path_y, filled)
            way_x, way_y = _ways(leg, method, other, state, at_x, at_y, path_x, path_y)
        if remaining >= 0:
            remaining -= filled
        elif arc:
            more, near = _passed(leg, at_x, at_y, path_x, path_y, way_x, way_y)
            if entered + more > high or (near and entered + more >= low and not met):
                _copy(other, state)
                careful, met = True, False
                continue
            entered += more
        count[PASSES] += passes
        count[SAMPLES] += filled
        if remaining < 0:
            count[ENDED] = 1 if met else 0
        if filled == 0:
            continue
        _move_slide(
            leg, 0, way_x, path_x, at_x, step_mm, axes[0], states[0], count, judge.x, judge.slide_x
        )
        _move_slide(
            leg, 1, way_y, path_y, at_y, step_mm, axes[1], states[1], count, judge.y, judge.slide_y
        )
        at_x, at_y = path_x[filled - 1], path_y[filled - 1]
        judge_block(leg[ROW], filled, judge)
    if leg[KIND] == DEPTH:
        _deepen(leg, states[2], count)
    elif arc:  # the controller takes itself to stand on the end that it was given
        states[0, 0] = (leg[ORIGIN_X] + end_x) * step_mm
        states[1, 0] = (leg[ORIGIN_Y] + end_y) * step_mm


# Search for ends of arc blocks at which the controller really stops.
#
# How the controller knows the end of an arc is not described (L1859-1862), nor with which error D it
# starts; by the strictest reading it stops only when it stands exactly on the end step. Start, end
# and centre are rounded each on its own: with such numbers nearly half of all arcs never stand
# there. So the writer follows the controller's own paths (above), one for each start of D,
# from the step where the controller will stand, and lets the block end on a step that all of them
# pass: there every reading stops. A line closes the gap to the wanted end.
#
# Two such paths lie about circles whose radii differ by half a step at most. Each is the best of
# the lattice beside its circle, so they part only for runs, longest where they run along an axis:
# there the run of one distance from the axis is some √R steps, no longer than a line may be.
#
# How many iterations n an arc of length L (in steps) takes: each iteration moves one step along X,
# along Y or along both, so n ≥ L/√2; and direct search follows the axis that moves faster, which
# makes one step of it per iteration, so n = ∫ max(|cos|, |sin|) ds ≤ L. The wanted end, if the path
# meets it, is met about there; the factors `EARLIEST` and `LATEST` leave room for the rounded
# radius.
#
# Every number is exact: whole steps, and radii below 2²⁴. Compiled, because
# each of thousands of arcs looks at hundreds of steps.


cdef double EARLIEST = 0.6
cdef double LATEST = 1.1

cpdef enum:
    # The end is searched from EARLIEST·L − slack to LATEST·L + slack iterations.
    WINDOW_SLACK = 4
    # Largest difference in iterations, up to a step, between paths with different starts of D:
    # they may be one step apart at each of eight diagonals, and at the start.
    MAX_LEAD_ITERATIONS = 16


# An arc of a smaller radius is written as lines: its path has too few steps to be an arc.
cdef double MIN_RADIUS_STEPS = 4.0

cpdef enum:
    # Columns of an arc, in steps: where the controller stands and the wanted end, about its
    # centre; the centre, which only serves to find the steps that can be written.
    START_X = 0, START_Y, WANTED_X, WANTED_Y, CENTRE_X, CENTRE_Y, CLOCKWISE
    # Columns of a landing: the step about the centre at which the arc block ends, and its
    # iteration, −1 where there is none.
    LANDING_X = 0, LANDING_Y, ITERATION


cdef class LandingSearch:
    """Parameters and scratch buffers of the search for landings: the form's units per step and its
    largest number of units; a state (5,), and buffers for the positions of a path with D = 0 at
    the start and for the mask of those that reverse no axis."""

    cdef double units_per_step
    cdef Int most_units
    cdef Int[::1] state, path_x, path_y, onward

    def __init__(self, units_per_step: float, most_units: int, room: int) -> None:
        self.units_per_step, self.most_units = units_per_step, most_units
        self.state = np.zeros(5, np.int64)
        self.path_x, self.path_y = np.empty(room, np.int64), np.empty(room, np.int64)
        self.onward = np.empty(room, np.int64)


cpdef land(
    Int[:, ::1] arcs, double[::1] sweeps, double units_per_step, Int most_units, double sagitta
):
    """Return the landings (N, 3) of arcs (N, 7) with wanted sweeps (N,) > 0 rad: where the block
    of each arc is to end.

    An arc lands at its end if all paths meet it; otherwise, in this order: at the last step from
    which the closing line continues without a reversal of an axis (each reversal costs the machine
    a whole compensation) and does not leave the arc by more than `sagitta` steps; at the step
    nearest to the end within that reach; at the last step that can be written at all. There is
    none when lines do as well: the whole arc lies within that reach, or no step of its paths can
    be written.
    """
    cdef Int k, room
    cdef LandingSearch search
    cdef Int[:, ::1] out
    room = 1
    for k in range(len(arcs)):
        room = max(room, _reach(_radius(arcs[k, START_X], arcs[k, START_Y]), sagitta))
    search = LandingSearch(units_per_step, most_units, room)
    out = np.zeros((len(arcs), 3), dtype=np.int64)
    for k in range(len(arcs)):
        out[k, ITERATION] = -1
        if _radius(arcs[k, START_X], arcs[k, START_Y]) >= MIN_RADIUS_STEPS:
            _land(arcs[k], sweeps[k], sagitta, search, out[k])
    return np.asarray(out)


cdef inline double _radius(Int x, Int y) noexcept:
    """Return √(x² + y²), steps, with a single rounding since the root is of an integer."""
    return math.sqrt(float(x * x + y * y))


cdef Int _reach(double radius, double sagitta) noexcept:
    """Return the number of iterations before the end within which one line may replace the rest of
    the arc.

    A chord c leaves its arc by the sagitta s ≈ c²/(8R), so c = √(8 R s); a path piece of n
    iterations is at most √2·n long.
    """
    return max(1, int(math.sqrt(4.0 * radius * sagitta)))


cdef void _begin(Int[::1] arc, Int error, Int[::1] state) noexcept:
    """Set the state to the start of the arc, with D = `error`."""
    cdef Int x, y, sx, sy
    x, y = arc[START_X], arc[START_Y]
    sx, sy = heading(x, y, arc[CLOCKWISE] != 0)
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy


cdef Int _hits(Int[::1] arc, Int x, Int y, Int low, Int high, Int[::1] state) noexcept:
    """Return the iteration in low … high at which the controller, with D = 0 at the start, would
    stop if the block's end were (x, y). −1 when it would not, or would not stop about there with
    the other start of D, which is that against the rounded radius."""
    cdef Int met, other, radius, error
    _begin(arc, 0, state)
    met = first_at(state, x, y, high)
    if met < low:
        return -1
    radius = rounded_radius(arc[START_X], arc[START_Y])
    error = arc[START_X] * arc[START_X] + arc[START_Y] * arc[START_Y] - radius * radius
    if error != 0:
        _begin(arc, error, state)
        other = first_at(state, x, y, met + MAX_LEAD_ITERATIONS)
        if other < max(1, met - MAX_LEAD_ITERATIONS):
            return -1
    return met


cdef bint _represents(Int steps, LandingSearch search) noexcept:
    """Return True if there is a whole number of units that means this step."""
    cdef Int size, units
    size = abs(steps)
    units = int(size * search.units_per_step + 0.5)
    return units <= search.most_units and int(units / search.units_per_step + 0.5) == size


cdef bint _lands(Int[::1] arc, Int row, Int first, LandingSearch search) noexcept:
    """Return True if position `row` of the path, which began after iteration `first`, can be
    written and the controller stops there and not earlier, whichever start of D it has."""
    cdef Int x, y, iteration
    x, y = search.path_x[row], search.path_y[row]
    if not _represents(x + arc[CENTRE_X], search) or not _represents(y + arc[CENTRE_Y], search):
        return False
    iteration = first + row + 1
    return _hits(arc, x, y, iteration, iteration, search.state) == iteration


cdef void _fill_path(Int[::1] arc, Int first, Int count, LandingSearch search) noexcept:
    """Compute the positions after the iterations first + 1 … first + count, with D = 0 at the
    start."""
    cdef Int[::1] path_x, path_y
    _begin(arc, 0, search.state)
    skip(search.state, first)
    path_x, path_y = search.path_x[:count], search.path_y[:count]
    direct_search_run(search.state, _NOWHERE, _NOWHERE, path_x, path_y)


cdef void _mark_onward(Int[::1] arc, Int count, LandingSearch search) noexcept:
    """Mark the positions from which the line to the arc's end reverses no axis.

    The direction of an axis is that of its last step on the path. Before its first step it is that
    of the motion, which at (x, y) is along (y, −x) clockwise; 0 (exactly there) allows both.
    """
    cdef Int k, turn, along_x, along_y, on_x, on_y
    cdef Int[::1] path_x, path_y
    path_x, path_y = search.path_x, search.path_y
    turn = 1 if arc[CLOCKWISE] != 0 else -1
    along_x, along_y = turn * path_y[0], -turn * path_x[0]
    for k in range(count):
        if k > 0 and path_x[k] != path_x[k - 1]:
            along_x = path_x[k] - path_x[k - 1]
        if k > 0 and path_y[k] != path_y[k - 1]:
            along_y = path_y[k] - path_y[k - 1]
        on_x, on_y = (arc[WANTED_X] - path_x[k]) * along_x, (arc[WANTED_Y] - path_y[k]) * along_y
        search.onward[k] = 1 if on_x >= 0 and on_y >= 0 else 0


cdef void _store_landing(Int row, Int first, LandingSearch search, Int[::1] out) noexcept:
    """Store the position `row` as the landing."""
    out[LANDING_X], out[LANDING_Y] = search.path_x[row], search.path_y[row]
    out[ITERATION] = first + row + 1


cdef void _land(
    Int[::1] arc, double sweep_rad, double sagitta, LandingSearch search, Int[::1] out
) noexcept:
    """Fill `out` (3,) with the landing of one arc (7,), as `land` describes; leave it unchanged
    when there is none."""
    cdef double radius, latest
    cdef Int end_x, end_y, low, high, met, near, _, first, count, row, min_square, off_x, off_y, square
    cdef Int window_end, room
    cdef bint nearer
    radius = _radius(arc[START_X], arc[START_Y])
    end_x, end_y = arc[WANTED_X], arc[WANTED_Y]
    latest = math.ceil(LATEST * (radius * sweep_rad))
    low = max(1, int(EARLIEST * (radius * sweep_rad)) - WINDOW_SLACK)
    high = int(latest) + WINDOW_SLACK
    met = _hits(arc, end_x, end_y, low, high, search.state)
    if met >= 0:
        out[LANDING_X], out[LANDING_Y], out[ITERATION] = end_x, end_y, met
        return
    _begin(arc, 0, search.state)
    near, _ = nearest_to(search.state, end_x, end_y, low, high)
    first = max(0, near - _reach(radius, sagitta))
    count = near - first
    _fill_path(arc, first, count, search)
    _mark_onward(arc, count, search)
    for row in range(count - 1, -1, -1):
        if search.onward[row] == 1 and _lands(arc, row, first, search):
            _store_landing(row, first, search, out)
            return
    if first == 0:
        return
    min_square = -1
    for row in range(count - 1, -1, -1):
        off_x, off_y = search.path_x[row] - end_x, search.path_y[row] - end_y
        square = off_x * off_x + off_y * off_y
        nearer = search.onward[row] == 0 and (min_square < 0 or square < min_square)
        if nearer and _lands(arc, row, first, search):
            min_square = square
            _store_landing(row, first, search, out)
    if min_square >= 0:
        return
    window_end, room = first, len(search.path_x)
    while window_end > 0:
        first = max(0, window_end - room)
        count = window_end - first
        _fill_path(arc, first, count, search)
        for row in range(count - 1, -1, -1):
            if _lands(arc, row, first, search):
                _store_landing(row, first, search, out)
                return
        window_end = first
