"""Where a path about a centre comes nearest to a point, on the turn that it is expected on.

A tracker walks along the samples of an arc (any method: DSM, DDA, stairs) and counts the
quadrants that it enters: one more whenever a coordinate becomes 0. Only samples whose count lies
in low … high are candidates, so that the pass of the right turn is taken. Exact: integers only.
Compiled, because it runs beside the arc kernels, sample by sample.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import kernel
from camtool.kernels.heading import heading

Ints = npt.NDArray[np.int64]


@kernel
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


@kernel
def approach_start(x: int, y: int, end_x: int, end_y: int, low: int) -> Ints:
    """The tracker (6,): x, y, quadrants entered, samples seen, nearest sample, its squared
    distance (−1 while there is none); sample 0 is the start itself."""
    square = (x - end_x) ** 2 + (y - end_y) ** 2
    return np.array([x, y, 0, 0, 0, square if low <= 0 else -1], dtype=np.int64)


@kernel
def approach_scan(points: Ints, end: Ints, tracker: Ints, low: int, high: int) -> None:
    """Take the samples `points` (n, 2), which follow those seen before, into account.

    `end` (2,). The first of equally near samples counts.
    """
    x, y, entered = tracker[0], tracker[1], tracker[2]
    for k in range(len(points)):
        if (points[k, 0] == 0 and x != 0) or (points[k, 1] == 0 and y != 0):
            entered += 1
        x, y = points[k, 0], points[k, 1]
        tracker[3] += 1
        if low <= entered <= high:
            square = (x - end[0]) ** 2 + (y - end[1]) ** 2
            if tracker[5] < 0 or square < tracker[5]:
                tracker[4], tracker[5] = tracker[3], square
    tracker[0], tracker[1], tracker[2] = x, y, entered
