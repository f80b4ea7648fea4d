"""Lines and arcs by digital differential analysers (DDA).

Line of |a|, |b| steps (thesis L827-883, annex A.3). Each pass adds a to register Qx; when the
register is strictly above L = √(a² + b²) and the counter of X is not yet full, L is taken off it
and X gives a pulse; then the same for Y. The line ends when both counters are full. (The limit is
the hypotenuse, not the greater projection: passes are in proportion to length.)

Arc (L889-915, annex A.4). In each quadrant one coordinate grows and one shrinks; g and s are
their magnitudes, R the overflow limit. Each pass, the growing axis first:

    Qg += s;  if Qg > R and g < R:  Qg −= R, pulse, g += 1
    Qs += g;  if Qs > R and s > 0:  Qs −= R, pulse, s −= 1      (with the g of this very pass)

The thesis works on full quadrants only: registers 0, counter of the growing axis 0 … R, of the
other 0 … R, both end together at g = R, s = 0. Ours for arcs that begin or end inside one:
R = round(√(x² + y²)); the registers Q start at 0; the growing counter starts at |g|, the
shrinking one at R − |s|, which is to say that the coordinates themselves are the counters; the
quadrant ends when s = 0. On full quadrants that is the same (the tests try all R < 600). About
one start in twenty arrives there with g = R − 1, where the counters of the thesis would wait for
ever, since s = 0 adds nothing to Qg any more; we go on into the next quadrant, whose registers
begin at 0 as always. The stop test runs after each pass that gave a pulse: the first pass never
does, and would end a full circle before it began.

Exact, because the registers of the arc are integers; those of the line are float64, added,
compared and subtracted in the controller's order, without contraction, so that every rounding is
the same as in the literal loop. Compiled, because that order admits no closed form.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel
from camtool.kernels.heading import heading, rounded_radius

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@kernel
def dda_line_fill(
    a: int, b: int, registers: Floats, counters: Ints, out: Ints
) -> tuple[int, int, bool]:
    """Run a line of a ≥ 0, b ≥ 0 steps on into `out` (n, 2), one row per pass with a pulse.

    `registers` (2,) and `counters` (2,) begin at 0 and are changed in place. Returns rows filled,
    passes run, and whether the line is finished.
    """
    limit = math.sqrt(a * a + b * b)
    in_x, in_y, x, y = registers[0], registers[1], counters[0], counters[1]
    filled, passes = 0, 0
    while filled < len(out) and (x < a or y < b):
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
            out[filled, 0] = x
            out[filled, 1] = y
            filled += 1
    registers[0], registers[1], counters[0], counters[1] = in_x, in_y, x, y
    return filled, passes, x >= a and y >= b


@kernel
def dda_arc_start(x: int, y: int, clockwise: bool) -> Ints:
    """The state (8,) at the start (x, y) ≠ (0, 0): x, y, sx, sy, R, Qg, Qs, whether x grows."""
    sx, sy = heading(x, y, clockwise)
    radius = rounded_radius(x, y)
    return np.array([x, y, sx, sy, radius, 0, 0, 1 if x * sx >= 0 else 0], dtype=np.int64)


@inner
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


@kernel
def dda_arc_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, int, bool]:
    """Run on from `state` into `out` (n, 2), one row per pass with a pulse.

    Stops when the end is met or `out` is full. Returns rows filled, passes run, and whether the
    last row is the end.
    """
    x, y, sx, sy = state[0], state[1], state[2], state[3]
    radius, in_grow, in_shrink, x_grows = state[4], state[5], state[6], state[7] == 1
    filled, passes, met = 0, 0, False
    while filled < len(out) and not met:
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
        out[filled, 0] = x
        out[filled, 1] = y
        filled += 1
        met = x == end_x and y == end_y
    state[0], state[1], state[2], state[3] = x, y, sx, sy
    state[5], state[6], state[7] = in_grow, in_shrink, 1 if x_grows else 0
    return filled, passes, met
