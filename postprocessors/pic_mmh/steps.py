"""The loops of the PIC18F8720's interpolators: lines and arcs step by step, where arcs stop, and
whole programs that are judged as they run.

Positions are whole steps. Compiled, because one part takes tens of millions of them; C types stand
in the .pxd beside this file. What each part does is said above it.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.kernels.judging import BLOCK, Judge, Sums, Task, judge_block, room_for
from camtool.kernels.play import STILL, TURNING, play_block, way_of

# Which way an arc goes at a point, and the whole number next to its radius.
#
# Shared by the arc kernels. Exact, because only signs of integers are looked at, and the root of
# an integer is never so near to a half that a float64 could round it to the wrong side (the root
# of k² + k is 1/(8k) away from k + 1/2). Compiled, because compiled loops call it.


def heading(x: int, y: int, clockwise: bool) -> tuple[int, int]:
    """Direction (±1, ±1) of the motion at (x, y) ≠ (0, 0) on an arc about (0, 0).

    Clockwise the velocity is along (y, −x). On an axis one of the two vanishes: there the
    coordinate that is not 0 shrinks, so its direction is against its sign, and the quadrant is
    the one that the motion enters.
    """
    turn = 1 if clockwise else -1
    along_x, along_y = turn * y, -turn * x
    sx = -1 if along_x < 0 or (along_x == 0 and x > 0) else 1
    sy = -1 if along_y < 0 or (along_y == 0 and y > 0) else 1
    return sx, sy


def rounded_radius(x: int, y: int) -> int:
    """√(x² + y²) to the nearest step."""
    return int(math.sqrt(float(x * x + y * y)) + 0.5)


# Where a path about a centre comes nearest to a point, on the turn that it is expected on.
#
# A tracker walks along the samples of an arc (any method: DSM, DDA, stairs) and counts the
# quadrants that it enters: one more whenever a coordinate becomes 0. Only samples whose count lies
# in low … high are candidates, so that the pass of the right turn is taken. Exact: integers only.
# Compiled, because it runs beside the arc kernels, sample by sample.


STRIDE = 64
"""So many samples are passed over at once where nothing can happen."""


def expected_quadrants(x: int, y: int, clockwise: bool, end_x: int, end_y: int) -> int:
    """How many quadrants (0 … 4) the motion enters from (x, y) to the ray of the end.

    4 when the end is in the quadrant of the start but behind it, or on its ray: a whole turn.
    """
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
    """The tracker (6,): x, y, quadrants entered, samples seen, nearest sample, its squared
    distance (−1 while there is none); sample 0 is the start itself."""
    square = (x - end_x) ** 2 + (y - end_y) ** 2
    return np.array([x, y, 0, 0, 0, square if low <= 0 else -1], dtype=np.int64)


def approach_scan(points: Ints, end: Ints, tracker: Ints, low: int, high: int) -> None:
    """Take the samples `points` (n, 2), which follow those seen before, into account.

    `end` (2,). The first of equally near samples counts.
    """
    path_x, path_y = np.ascontiguousarray(points[:, 0]), np.ascontiguousarray(points[:, 1])
    scan(path_x, path_y, len(points), end[0], end[1], tracker, low, high)


def scan(
    path_x: Ints,
    path_y: Ints,
    count: int,
    end_x: int,
    end_y: int,
    tracker: Ints,
    low: int,
    high: int,
) -> None:
    """As `approach_scan`, for `count` samples.

    No coordinate changes by more than one from sample to sample: of `STRIDE` of them none is 0, or
    nearer than the nearest, when the one before is far enough away.
    """
    x, y, entered = tracker[0], tracker[1], tracker[2]
    seen, nearest, least, k = tracker[3], tracker[4], tracker[5], 0
    while k < count:
        if abs(x) > STRIDE and abs(y) > STRIDE and k + STRIDE <= count:
            apart = max(abs(x - end_x), abs(y - end_y)) - STRIDE
            wanted = low <= entered <= high
            if not wanted or (least >= 0 and apart > 0 and apart * apart >= least):
                k += STRIDE
                x, y = path_x[k - 1], path_y[k - 1]
                continue
        if (path_x[k] == 0 and x != 0) or (path_y[k] == 0 and y != 0):
            entered += 1
        x, y = path_x[k], path_y[k]
        k += 1
        if low <= entered <= high:
            square = (x - end_x) * (x - end_x) + (y - end_y) * (y - end_y)
            if least < 0 or square < least:
                nearest, least = seen + k, square
    tracker[0], tracker[1], tracker[2] = x, y, entered
    tracker[3], tracker[4], tracker[5] = seen + count, nearest, least


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


MOST_SQUARE = 1 << 48
"""Squares of the radius in steps from which on the closed form is not used."""

LEAST_RUN = 8
"""Fewer positions than these are iterated."""

NOWHERE = 1 << 40
"""Both coordinates of an end that no path meets."""


def _advance(
    x: int, y: int, error: int, sx: int, sy: int, delta_x: int, delta_y: int
) -> tuple[int, int, int, int, int, int, int]:
    """One iteration: the new x, y, D, sx, sy, ΔX, ΔY."""
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
    """The state (5,) at the start (x, y) ≠ (0, 0) of an arc."""
    sx, sy = heading(x, y, clockwise)
    return np.array([x, y, error, sx, sy], dtype=np.int64)


def _run_length(m: int, n: int, way: int, error: int, room: int) -> int:
    """How many positions, up to `room`, the closed form gives from M, N on while M runs `way`."""
    invariant = m * m + n * n - error
    if error < -abs(n) or error >= abs(n) or invariant >= MOST_SQUARE or 2 * m * m > invariant:
        return 0
    if m * way < 0:
        return min(room, abs(m))
    diagonal = int(math.sqrt(0.5 * invariant))
    return min(room, diagonal - 1 - abs(m))


def _run(
    m: int, n: int, way: int, error: int, out_m: Ints, out_n: Ints, low: int, high: int
) -> None:
    """The positions that follow M, N while M runs `way`, by the closed form, into the rows
    low … high − 1."""
    invariant = float(m * m + n * n - error)
    first = m + way * (1 - low)
    for k in range(low, high):
        out_m[k] = first + way * k
    for k in range(low, high):
        here = float(out_m[k])
        # What is cut off here is cut off as by floor: the sum is not negative.
        size = int(math.sqrt(invariant - here * here) + 0.5)
        out_n[k] = size if n > 0 else -size


def direct_search_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]:
    """Run on from `state` into `out` (n, 2) until the end is met or `out` is full.

    Returns the number of rows filled and whether the last of them is the end; `state` then
    stands where the rows end, so that the next call goes on.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, met = direct_search_run(state, end_x, end_y, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, met


def direct_search_run(
    state: Ints, end_x: int, end_y: int, out_x: Ints, out_y: Ints
) -> tuple[int, bool]:
    """As `direct_search_fill`, into one array for each axis."""
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    room, filled, met = len(out_x), 0, False
    while filled < room and not met:
        by_x = abs(x) < abs(y)
        m, n, way = (x, y, sx) if by_x else (y, x, sy)
        run = _run_length(m, n, way, error, room - filled)
        if run >= LEAST_RUN:
            # M passes the end once.
            at = ((end_x if by_x else end_y) - m) * way - 1
            upto = filled + run
            if by_x:
                _run(m, n, way, error, out_x, out_y, filled, upto)
                met = 0 <= at < run and out_y[filled + at] == end_y
            else:
                _run(m, n, way, error, out_y, out_x, filled, upto)
                met = 0 <= at < run and out_x[filled + at] == end_x
            filled = filled + at + 1 if met else upto
            x, y = out_x[filled - 1], out_y[filled - 1]
            error += x * x + y * y - m * m - n * n
            if by_x and x == 0:
                sy = -sy
            elif y == 0 and not by_x:
                sx = -sx
            continue
        delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
        for _ in range(min(LEAST_RUN, room - filled)):
            x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
            out_x[filled], out_y[filled] = x, y
            filled += 1
            met = x == end_x and y == end_y
            if met:
                break
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    return filled, met


def skip(state: Ints, count: int) -> None:
    """Run on by so many iterations: as `direct_search_fill`, but no position on the way is made
    where the closed form gives the last one."""
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    while count > 0:
        by_x = abs(x) < abs(y)
        m, n, way = (x, y, sx) if by_x else (y, x, sy)
        run = _run_length(m, n, way, error, count)
        if run >= LEAST_RUN:
            invariant = m * m + n * n - error
            m += way * run
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
        run = min(LEAST_RUN, count)
        for _ in range(run):
            x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
        count -= run
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy


def first_at(state: Ints, end_x: int, end_y: int, limit: int) -> int:
    """The first iteration, 1 … limit, from `state` on at which the position equals the end, or −1;
    `state` runs on to there.

    This is the controller's stop test, done after each iteration: an end at the start is met
    after a whole turn. No coordinate changes by more than one an iteration, so the end is not
    nearer than the larger of its two distances.
    """
    done = 0
    while done < limit:
        apart = int(max(abs(state[0] - end_x), abs(state[1] - end_y)))
        run = min(max(apart, 1), limit - done)
        skip(state, run)
        done += run
        if state[0] == end_x and state[1] == end_y:
            return done
    return -1


def nearest_to(state: Ints, end_x: int, end_y: int, low: int, high: int) -> tuple[int, int]:
    """The iteration in low … high (both included) nearest to the end, the first one on ties, and
    its squared distance in steps²; (−1, −1) when the range is empty. `state` runs on to `high`.

    As in `first_at`; what is to be no farther than d has come nearer by apart − d. Long strides
    show first how near it comes at least.
    """
    if high < low:
        return -1, -1
    skip(state, low)
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    done, best, least = low, -1, -1
    while True:
        off_x, off_y = abs(state[0] - end_x), abs(state[1] - end_y)
        square = off_x * off_x + off_y * off_y
        if least < 0 or square < least:
            least = square
        if done == high:
            break
        run = min(max(off_x, off_y, 1), high - done)
        skip(state, run)
        done += run
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    done = low
    while True:
        off_x, off_y = abs(state[0] - end_x), abs(state[1] - end_y)
        square = off_x * off_x + off_y * off_y
        if square < least or (best < 0 and square == least):
            best, least = done, square
        if done == high:
            return best, least
        run = max(off_x, off_y) - int(math.sqrt(float(least)))
        run = min(max(run, 1), high - done)
        skip(state, run)
        done += run


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
    """The state (5,) at the start (x, y) ≠ (0, 0) of an arc: x, y, D, sx, sy."""
    sx, sy = heading(x, y, clockwise)
    return np.array([x, y, error, sx, sy], dtype=np.int64)


def stairs_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]:
    """Run on from `state` into `out` (n, 2) until the end is met or `out` is full.

    Returns the number of rows filled and whether the last of them is the end; `state` then
    stands where the rows end, so that the next call goes on.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, met = _stairs(state, end_x, end_y, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, met


def _stairs(state: Ints, end_x: int, end_y: int, out_x: Ints, out_y: Ints) -> tuple[int, bool]:
    """As `stairs_fill`, into one array for each axis."""
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

    `registers` (2,) and `counters` (2,) begin at 0 and are changed in place. Returns rows filled,
    passes run, and whether the line is finished.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, passes, met = _dda_line(a, b, registers, counters, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, passes, met


def _dda_line(
    a: int, b: int, registers: Floats, counters: Ints, out_x: Ints, out_y: Ints
) -> tuple[int, int, bool]:
    """As `dda_line_fill`, into one array for each axis."""
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
    """The state (8,) at the start (x, y) ≠ (0, 0): x, y, sx, sy, R, Qg, Qs, whether x grows."""
    sx, sy = heading(x, y, clockwise)
    radius = rounded_radius(x, y)
    return np.array([x, y, sx, sy, radius, 0, 0, 1 if x * sx >= 0 else 0], dtype=np.int64)


def _arc_pass(
    grow: int, shrink: int, radius: int, in_grow: int, in_shrink: int
) -> tuple[int, int, int, int]:
    """One pass: g, s, Qg, Qs after it."""
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

    Stops when the end is met or `out` is full. Returns rows filled, passes run, and whether the
    last row is the end.
    """
    path = np.empty((2, len(out)), dtype=np.int64)
    filled, passes, met = _dda_arc(state, end_x, end_y, path[0], path[1])
    out[:filled] = path[:, :filled].T
    return filled, passes, met


def _dda_arc(
    state: Ints, end_x: int, end_y: int, out_x: Ints, out_y: Ints
) -> tuple[int, int, bool]:
    """As `dda_arc_fill`, into one array for each axis."""
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


(ROW, KIND, FROM_X, FROM_Y, A, B, ORIGIN_X, ORIGIN_Y, SIGN_X, SIGN_Y, END_X, END_Y, CW, STOP) = (
    range(14)
)
"""Columns of a leg, in steps: the row; what it is; where X and Y stand before; how far a line
goes (of Z: in A, its sign in CW), or where an arc starts about its centre; the start of a
line or the centre of an arc, and the signs that its positions are taken with; the end of an arc
about its centre; whether it is clockwise; after how many samples an arc stops, −1: where it stands
on its end."""

LEG_COLUMNS = 14
"""How many columns."""

LINE, ARC, DEPTH = range(3)
"""Kinds of legs."""

DSM, STAIRS, DDA = range(3)
"""Methods of arcs."""

STATE = 8
"""Numbers of a state: as many as the method with the longest one has."""


def start_leg(leg: Ints, method: int, rounded: bool, state: Ints) -> None:
    """Set the state (8,) to the start of a leg; that of a line is where its counters are."""
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


def fill_leg(
    leg: Ints, method: int, state: Ints, registers: Floats, out_x: Ints, out_y: Ints
) -> tuple[int, int, bool]:
    """Positions filled, passes run, whether the last one is the end."""
    if leg[KIND] != ARC:
        return _dda_line(leg[A], leg[B], registers, state, out_x, out_y)
    if method == DDA:
        return _dda_arc(state, leg[END_X], leg[END_Y], out_x, out_y)
    if method == DSM:
        filled, met = direct_search_run(state, leg[END_X], leg[END_Y], out_x, out_y)
    else:
        filled, met = _stairs(state, leg[END_X], leg[END_Y], out_x, out_y)
    return filled, filled, met


def turn_round(leg: Ints, path_x: Ints, path_y: Ints, count: int) -> None:
    """Give the positions of a line their signs; a line of Z leaves X and Y where they are."""
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


EQUAL, FINAL_QUADRANT, NEAREST = range(3)
"""Readings."""

READINGS = {"equal": EQUAL, "final-quadrant": FINAL_QUADRANT, "nearest": NEAREST}
"""Their names, as in `controller.arc_end`."""

STOP_SAMPLES, STOP_X, STOP_Y, MET = range(4)
"""Columns of a stop: samples up to it, where it is about the centre, and whether it is the end."""

STOP_COLUMNS = 4
"""How many columns."""

LOOKED_AT = 1 << 12
"""Positions that are looked at in one go."""


def _passes(
    path_x: Ints, path_y: Ints, count: int, leg: Ints, tracker: Ints, expected: int
) -> int:
    """At which of so many positions an arc stops in its final quadrant, or −1; `tracker` as in
    `approach_start`."""
    x, y, entered = tracker[0], tracker[1], tracker[2]
    end_x, end_y = leg[END_X], leg[END_Y]
    to_x, to_y = heading(end_x, end_y, leg[CW] != 0)
    found, k = -1, 0
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
            found = k
            break
        k += 1
    tracker[0], tracker[1], tracker[2] = x, y, entered
    return found


def _stop(
    leg: Ints,
    method: int,
    rounded: bool,
    reading: int,
    path_x: Ints,
    path_y: Ints,
    registers: Floats,
    state: Ints,
    tracker: Ints,
    out: Ints,
) -> None:
    """Fill `out` (4,) for one arc that does not start at its centre. There is room for positions,
    registers (2,) and state (8,) of an interpolator, and a tracker (6,) of `approach_start`."""
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
    part_x, part_y, seen = path_x[:size], path_y[:size], 0
    while True:
        filled, _, met = fill_leg(leg, method, state, registers, part_x, part_y)
        at = -1
        if reading == FINAL_QUADRANT:
            at = _passes(part_x, part_y, filled, leg, tracker, expected)
        else:
            best = tracker[4]
            scan(part_x, part_y, filled, end_x, end_y, tracker, low, high)
            if tracker[4] != best:
                nearest = tracker[4] - seen - 1
                out[STOP_SAMPLES] = tracker[4]
                out[STOP_X], out[STOP_Y] = part_x[nearest], part_y[nearest]
            if tracker[2] > high:
                return
            if met and (reading == EQUAL or tracker[2] >= low):
                at = filled - 1
        if at >= 0:
            out[STOP_SAMPLES], out[STOP_X], out[STOP_Y] = seen + at + 1, part_x[at], part_y[at]
            out[MET] = 1 if part_x[at] == end_x and part_y[at] == end_y else 0
            return
        seen += filled


def _stop_by_closed_form(leg: Ints, rounded: bool, reading: int, state: Ints, out: Ints) -> None:
    """As `_stop`, for direct search: no coordinate changes by more than one an iteration, so what
    can happen no sooner than in n iterations is looked for behind the next n."""
    end_x, end_y = leg[END_X], leg[END_Y]
    expected = expected_quadrants(leg[A], leg[B], leg[CW] != 0, end_x, end_y)
    start_leg(leg, DSM, rounded, state)
    if reading == FINAL_QUADRANT:
        done = _enter(state, expected)
        to_x, to_y = heading(end_x, end_y, leg[CW] != 0)
        entered = 0
        while True:
            x, y = state[0], state[1]
            short = int(max(to_x * (end_x - x), to_y * (end_y - y)))
            if done > 0 and (entered == 1 or short <= 0):
                break
            run = max(1, min(short, abs(x), abs(y)))
            skip(state, run)
            done += run
            if (state[0] == 0 and x != 0) or (state[1] == 0 and y != 0):
                entered = 1
        out[STOP_SAMPLES], out[STOP_X], out[STOP_Y] = done, state[0], state[1]
        out[MET] = 1 if state[0] == end_x and state[1] == end_y else 0
        return
    low, high = max(0, expected - 1), expected + 1
    first = _enter(state, low)
    last = first + _enter(state, high + 1 - low) - 1
    start_leg(leg, DSM, rounded, state)
    done = max(0, first - 1) if reading == NEAREST else 0
    skip(state, done)
    at = first_at(state, end_x, end_y, last - done)
    if at > 0:
        out[STOP_SAMPLES], out[STOP_X], out[STOP_Y], out[MET] = done + at, end_x, end_y, 1
        return
    start_leg(leg, DSM, rounded, state)
    at, _ = nearest_to(state, end_x, end_y, first, last)
    start_leg(leg, DSM, rounded, state)
    skip(state, at)
    out[STOP_SAMPLES], out[STOP_X], out[STOP_Y], out[MET] = at, state[0], state[1], 0


def _enter(state: Ints, count: int) -> int:
    """Run on until so many quadrants are entered, by direct search; the iterations to there."""
    done = 0
    while count > 0:
        x, y = state[0], state[1]
        run = int(max(1, min(abs(x), abs(y))))
        skip(state, run)
        done += run
        if (state[0] == 0 and x != 0) or (state[1] == 0 and y != 0):
            count -= 1
    return done


def arc_stops(legs: Ints, how: tuple[int, bool, int], out: Ints) -> None:
    """Fill `out` (L, 4) for each arc of legs (L, 14) by itself; 0 in other rows.

    `how`: the method of arcs, whether their error starts as that against the rounded radius, and
    the reading. An arc that misses its end by `EQUAL` has the stop of `NEAREST`, and MET = 0.
    """
    method, rounded, reading = how
    path_x, path_y = np.empty(LOOKED_AT, np.int64), np.empty(LOOKED_AT, np.int64)
    registers, state, tracker = np.zeros(2), np.zeros(STATE, np.int64), np.zeros(6, np.int64)
    for number in range(len(legs)):
        leg, stop = legs[number], out[number]
        stop[0] = stop[1] = stop[2] = stop[3] = 0
        if leg[KIND] == ARC and (leg[A] != 0 or leg[B] != 0):
            _stop(leg, method, rounded, reading, path_x, path_y, registers, state, tracker, stop)


def run_on(
    moves: Ints, start: Ints, ends: Ints, centres: Ints, how: tuple[int, bool, int], samples: Ints
) -> None:
    """The rows of a program, each from where the one before has really stopped.

    `moves` (N,): 0 where X and Y stay, 1 for a line, 2 and 3 for an arc counter-clockwise and
    clockwise; `start` (2,), `ends` (N, 2), `centres` (N, 2) steps. Ends of arcs become their
    stops, and rows that were to stay where they were stay there; `samples` (N,) becomes that of
    each arc, −1 where a row is none.
    """
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


SAMPLES, PASSES, STEPS, REVERSALS, ENDED = 0, 1, 2, 5, 8
"""Columns of the counts of a leg: samples, passes, steps X Y Z, reversals X Y Z, ended."""

COUNT_COLUMNS = 9
"""How many columns."""

NEAR_RADIUS = 4.0
"""Steps that the end of an arc may be off the circle through its start."""

NEAR_STEPS = 8
"""Within so many steps, in X and in Y, of its end an arc is run ahead."""

LEAST_RADIUS = 16
"""Smaller arcs are run ahead from their start."""

RUN_AHEAD = 1 << 12
"""Positions that are looked at in one go when an arc is run ahead."""


class Room:
    """Arrays to work in: path (`RUN_AHEAD`,) of X and Y in steps; the state (8,) of an
    interpolator and a copy of it; tracker (6,) and registers (2,) of what runs."""

    def __init__(self) -> None:
        self.path_x = room_for(RUN_AHEAD, np.int64)
        self.path_y = room_for(RUN_AHEAD, np.int64)
        self.state, self.other = np.zeros(STATE, np.int64), np.zeros(STATE, np.int64)
        self.tracker, self.registers = np.zeros(6, np.int64), np.zeros(2)


def _copy(from_: Ints, to: Ints) -> None:
    for k in range(len(to)):
        to[k] = from_[k]


def _run_ahead(
    leg: Ints, method: int, entered: int, low: int, high: int, room: Room
) -> tuple[int, bool]:
    """How many positions there are from the present state to the end, and True; or to the
    nearest approach to it in the quadrants low … high, and False. `entered` quadrants lie behind.
    """
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


def _ways(
    leg: Ints,
    method: int,
    before: Ints,
    after: Ints,
    at_x: int,
    at_y: int,
    path_x: Ints,
    path_y: Ints,
) -> tuple[int, int]:
    """Which way X and Y run on the positions (n,) that follow at_x, at_y; the states `before` and
    `after` them.

    A line runs one way. So does a path of direct search between its quadrants, and what makes
    signs come back is a whole turn: more than a block, when the circle is larger than that.
    """
    known, sign_x, sign_y = leg[KIND] == LINE, leg[SIGN_X], leg[SIGN_Y]
    if method == DSM and leg[KIND] == ARC and max(abs(at_x), abs(at_y)) > BLOCK:
        known = before[3] == after[3] and before[4] == after[4]
        sign_x, sign_y = after[3], after[4]
    if not known:
        return way_of(at_x, path_x), way_of(at_y, path_y)
    last = len(path_x) - 1
    return (
        STILL if path_x[last] == at_x else sign_x,
        STILL if path_y[last] == at_y else sign_y,
    )


def _is_near(low: int, high: int, end: int) -> bool:
    """Whether low … high, in either order, comes within `NEAR_STEPS` of the end."""
    return min(low, high) <= end + NEAR_STEPS and max(low, high) >= end - NEAR_STEPS


def _passed(
    leg: Ints, x: int, y: int, path_x: Ints, path_y: Ints, way_x: int, way_y: int
) -> tuple[int, bool]:
    """How many quadrants the positions (n,) enter that follow (x, y), and whether they may be
    near the end. A coordinate that runs one way becomes 0 once at most."""
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


def _follow(
    leg: Ints,
    axis: int,
    way: int,
    steps: Ints,
    at: int,
    step_mm: float,
    play: Floats,
    state: Floats,
    counts: Ints,
    commanded: Floats,
    slide: Floats,
) -> None:
    """Let the slide of X or Y follow `steps` (n,) about the origin of the leg, which run `way`
    from `at` on, and count."""
    count = len(steps)
    origin = leg[ORIGIN_X + axis]
    for k in range(count):
        commanded[k] = (origin + steps[k]) * step_mm
    counts[REVERSALS + axis] += play_block(way, commanded[:count], play, state, slide[:count])
    way_on = abs(steps[count - 1] - at)
    if way == TURNING:
        way_on = abs(steps[0] - at)
        for k in range(1, count):
            way_on += abs(steps[k] - steps[k - 1])
    counts[STEPS + axis] += way_on


def _deepen(leg: Ints, state: Floats, counts: Ints) -> None:
    """Count a leg of Z, whose `state` (6,) need not say where the slide is."""
    counts[STEPS + 2] = leg[A]
    if state[1] != leg[CW]:
        state[1] = leg[CW]
        counts[REVERSALS + 2] = 1


def judge_legs(
    legs: Ints,
    how: tuple[int, bool],
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
) -> None:
    """Run and judge legs (L, 14) in order; `counts` (L, 9) is filled.

    `how`: the method of arcs, and whether their error starts as that against the rounded radius;
    `mechanics`: axes (3, 5) and states (3, 6) of `camtool.kernels.play`, which go on.
    """
    method, rounded = how
    axes, states = mechanics
    judge, room = Judge(task, sums), Room()
    for number in range(len(legs)):
        leg, count = legs[number], counts[number]
        if leg[KIND] != ARC or leg[A] != 0 or leg[B] != 0:
            start_leg(leg, method, rounded, room.state)
            _judge_leg(leg, method, step_mm, axes, states, count, judge, room)


def _judge_leg(
    leg: Ints,
    method: int,
    step_mm: float,
    axes: Floats,
    states: Floats,
    count: Ints,
    judge: Judge,
    room: Room,
) -> None:
    """Run and judge a leg from the state in `room` on."""
    arc, x, y = leg[KIND] == ARC, leg[A], leg[B]
    end_x, end_y = leg[END_X], leg[END_Y]
    state, other, registers = room.state, room.other, room.registers
    registers[0] = registers[1] = 0.0
    at_x, at_y = leg[FROM_X] - leg[ORIGIN_X], leg[FROM_Y] - leg[ORIGIN_Y]
    careful, low, high = False, 0, 0
    if arc:
        expected = expected_quadrants(x, y, leg[CW] != 0, end_x, end_y)
        low, high = expected - 1, expected + 1
        apart = abs(math.hypot(float(x), float(y)) - math.hypot(float(end_x), float(end_y)))
        careful = method == DDA or apart > NEAR_RADIUS or max(abs(x), abs(y)) < LEAST_RADIUS
    entered, left, met = 0, -1, False
    if arc and leg[STOP] >= 0:
        left, count[ENDED] = leg[STOP], 1
    while left != 0 and not (left < 0 and met):
        if careful and left < 0:
            left, met = _run_ahead(leg, method, entered, low, high, room)
            count[ENDED] = 1 if met else 0
            continue
        _copy(state, other)
        size = BLOCK if left < 0 or left >= BLOCK else left
        path_x, path_y = room.path_x[:size], room.path_y[:size]
        filled, passes, met = fill_leg(leg, method, state, registers, path_x, path_y)
        if filled > 0:
            path_x, path_y = path_x[:filled], path_y[:filled]
            if not arc:
                turn_round(leg, path_x, path_y, filled)
            way_x, way_y = _ways(leg, method, other, state, at_x, at_y, path_x, path_y)
        if left >= 0:
            left -= filled
        elif arc:
            more, near = _passed(leg, at_x, at_y, path_x, path_y, way_x, way_y)
            if entered + more > high or (near and entered + more >= low and not met):
                _copy(other, state)
                careful, met = True, False
                continue
            entered += more
        count[PASSES] += passes
        count[SAMPLES] += filled
        if left < 0:
            count[ENDED] = 1 if met else 0
        if filled == 0:
            continue
        _follow(
            leg, 0, way_x, path_x, at_x, step_mm, axes[0], states[0], count, judge.x, judge.slide_x
        )
        _follow(
            leg, 1, way_y, path_y, at_y, step_mm, axes[1], states[1], count, judge.y, judge.slide_y
        )
        at_x, at_y = path_x[filled - 1], path_y[filled - 1]
        judge_block(leg[ROW], filled, judge)
    if leg[KIND] == DEPTH:
        _deepen(leg, states[2], count)
    elif arc:  # the controller takes itself to stand on the end that it was given
        states[0, 0] = (leg[ORIGIN_X] + end_x) * step_mm
        states[1, 0] = (leg[ORIGIN_Y] + end_y) * step_mm
