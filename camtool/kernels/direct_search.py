"""Arcs by direct search (DSM), the step-by-step method of the PIC18F8720 controller.

Positions are steps relative to the arc centre. With the error D = x² + y² − R² of the present
position, a step of sx = ±1 in X and sy = ±1 in Y changes it by

    ΔX = (x + sx)² − x² = 2·x·sx + 1,      ΔY = 2·y·sy + 1,

and each iteration takes the one of X alone (|D + ΔX|), Y alone (|D + ΔY|) and both
(|D + ΔX + ΔY|) that leaves the least |D|. On ties a single axis beats the diagonal and X beats Y.
When the coordinate that shrinks reaches 0, the next quadrant begins: that coordinate goes on and
now grows, the other one turns round. A start on an axis belongs to the quadrant that the motion
enters. (Thesis equations 3.4-3.14, L1009-1042, L2348-2350.)

The ties never decide, so that the method has every symmetry of the square: a single axis and the
diagonal differ by the odd Δ of the other axis, and no two integers of equal size do; and where
|D + ΔX| = |D + ΔY|, both are |x| + |y|, but the diagonal then gives ||x| − |y| ± 1|: less.

With D = 0 at the start the path stays nearer than half a step to the circle through the start.
Let m be the larger of |x|, |y|. Where the two candidates on either side of the circle differ in D
by 2m − 1 or 2m + 1, an odd number, the better one has |D| ≤ m − 1 outside or |D| ≤ m ≤ r inside
(m after the step); where none straddle, |D| falls. Then e = |r − R| = |D| / (r + R) obeys
e (2R − e) ≤ R − e inside and e (2R + e) ≤ R + e − 1 outside; both fail at e = 1/2.

Exact, because every number is an integer: D and both Δ are carried along in int64, as the
firmware carries them, and no square or root is ever taken; 2·|x| + 1 and |D| stay far below 2⁶³
for every radius that a program can say. Compiled, because each iteration depends on the one
before and one part takes tens of millions of them.

Most of a long arc needs no iterations. C = x² + y² − D never changes. While M, the coordinate of
smaller size, runs and 2·M² ≤ C, so that the circle of C is no steeper than one to one, put
A = C − M²; the other one, N, is best in size in its own line of the lattice when it is

    n = round(√A),      that is   n² − n < A ≤ n² + n,      −n ≤ D = n² − A < n.

From one M to the next √A changes by at most 1, and so does n: the best N is always among the two
that an iteration may give N while M steps. It beats a step of N alone, with which |D| ≥ n towards
the centre and ≥ n + 1 away from it, where the best of the next line has |D| no greater than its
own n; ties, see above, do not decide. So a start with −|N| ≤ D < |N| gives N = ± round(√(C − M²))
for each M that follows, up to the diagonal or the axis: many at once, and no number waits for
the one before. A root is told from n + ½ as long as n is below 2²⁴ (1/(8 n) is how far they are
apart at least, and a root and a sum of float64 round less than 2⁻²⁸ away); larger ones iterate.

`error` is the D that the controller starts with: 0, or x² + y² − round(R)² (the thesis leaves
the choice open). Iteration 0 is the start itself, iteration k the position after k passes.

A state is an int64 array (x, y, D, sx, sy), changed in place by `direct_search_fill`.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import bare, inner, kernel
from camtool.kernels.heading import heading

Ints = npt.NDArray[np.int64]

MOST_SQUARE = 1 << 48
"""Squares of the radius in steps from which on the closed form is not used."""

LEAST_RUN = 8
"""Fewer positions than these are iterated."""


@inner
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


@kernel
def direct_search_start(x: int, y: int, clockwise: bool, error: int = 0) -> Ints:
    """The state (5,) at the start (x, y) ≠ (0, 0) of an arc."""
    sx, sy = heading(x, y, clockwise)
    return np.array([x, y, error, sx, sy], dtype=np.int64)


@bare
def _run_length(m: int, n: int, way: int, error: int, room: int) -> int:
    """How many positions, up to `room`, the closed form gives from M, N on while M runs `way`."""
    invariant = m * m + n * n - error
    if error < -abs(n) or error >= abs(n) or invariant >= MOST_SQUARE or 2 * m * m > invariant:
        return 0
    if m * way < 0:
        return min(room, abs(m))
    return min(room, int(math.sqrt(0.5 * invariant)) - 1 - abs(m))


@bare
def _run(m: int, n: int, way: int, error: int, out_m: Ints, out_n: Ints) -> None:
    """The positions that follow M, N while M runs `way`, by the closed form."""
    invariant = float(m * m + n * n - error)
    sign = 1.0 if n > 0 else -1.0
    for k in range(len(out_m)):
        out_m[k] = m + way * (k + 1)
    for k in range(len(out_m)):
        here = float(out_m[k])
        out_n[k] = int(sign * math.floor(math.sqrt(invariant - here * here) + 0.5))


@bare
def _meets(m: int, n: int, way: int, end_m: int, end_n: int, out_n: Ints) -> int:
    """How many of the positions of a run there are up to the end, or −1: M passes it once."""
    at = (end_m - m) * way - 1
    if 0 <= at < len(out_n) and out_n[at] == end_n:
        return at + 1
    return -1


@kernel
def direct_search_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]:
    """Run on from `state` into `out` (n, 2) until the end is met or `out` is full.

    Returns the number of rows filled and whether the last of them is the end; `state` then
    stands where the rows end, so that the next call goes on.
    """
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    filled, met = 0, False
    while filled < len(out) and not met:
        by_x = abs(x) < abs(y)
        m, n, way = (x, y, sx) if by_x else (y, x, sy)
        run = _run_length(m, n, way, error, len(out) - filled)
        if run >= LEAST_RUN:
            m_out = out[filled : filled + run, 0 if by_x else 1]
            n_out = out[filled : filled + run, 1 if by_x else 0]
            _run(m, n, way, error, m_out, n_out)
            end_m, end_n = (end_x, end_y) if by_x else (end_y, end_x)
            upto = _meets(m, n, way, end_m, end_n, n_out)
            met = upto > 0
            run = upto if met else run
            error += m_out[run - 1] ** 2 + n_out[run - 1] ** 2 - m * m - n * n
            filled += run
            x, y = out[filled - 1, 0], out[filled - 1, 1]
            if by_x and x == 0:
                sy = -sy
            elif y == 0 and not by_x:
                sx = -sx
            continue
        delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
        for _ in range(min(LEAST_RUN, len(out) - filled)):
            x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
            out[filled, 0] = x
            out[filled, 1] = y
            filled += 1
            met = x == end_x and y == end_y
            if met:
                break
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    return filled, met


@kernel
def direct_search_path(
    x: int, y: int, clockwise: bool, first: int, count: int, error: int = 0
) -> Ints:
    """(count, 2) positions after the iterations first + 1 … first + count from (x, y) ≠ (0, 0)."""
    sx, sy = heading(x, y, clockwise)
    delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
    out = np.empty((count, 2), dtype=np.int64)
    for iteration in range(first + count):
        x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
        if iteration >= first:
            out[iteration - first, 0] = x
            out[iteration - first, 1] = y
    return out


@kernel
def direct_search_nearest(
    x: int,
    y: int,
    clockwise: bool,
    end_x: int,
    end_y: int,
    low: int,
    high: int,
    error: int = 0,
) -> tuple[int, int]:
    """The iteration in low … high (both included) nearest to the end, the first one on ties, and
    its squared distance in steps²; (−1, −1) when the range is empty."""
    sx, sy = heading(x, y, clockwise)
    delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
    best, least = -1, -1
    for iteration in range(high + 1):
        if iteration > 0:
            x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
        if iteration >= low:
            square = (x - end_x) ** 2 + (y - end_y) ** 2
            if best < 0 or square < least:
                best, least = iteration, square
    return best, least


@kernel
def direct_search_hits(
    x: int, y: int, clockwise: bool, end_x: int, end_y: int, limit: int, error: int = 0
) -> int:
    """The first iteration, 1 … limit, at which the position equals the end, or −1.

    This is the controller's stop test, done after each iteration: an end at the start is met
    after a whole turn.
    """
    sx, sy = heading(x, y, clockwise)
    delta_x, delta_y = 2 * x * sx + 1, 2 * y * sy + 1
    for iteration in range(1, limit + 1):
        x, y, error, sx, sy, delta_x, delta_y = _advance(x, y, error, sx, sy, delta_x, delta_y)
        if x == end_x and y == end_y:
            return iteration
    return -1
