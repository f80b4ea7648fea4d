"""Arcs by stairs (the incremental method): one axis per iteration.

With D = x² + y² − R² as in `camtool.kernels.direct_search`: while D ≤ 0 the coordinate that grows
in this quadrant takes a step outward, else the one that shrinks takes a step inward; when the
latter reaches 0 the next quadrant begins. (Thesis equations 3.4-3.13, L918-1006; tie rule of its
annex A.5.) `error` is D at the start, 0 for the circle through the start.

With D = 0 at the start the path stays nearer than one step to that circle: a step outward leaves
0 < D ≤ 2g − 1 with g < r the coordinate that grew, so e (2R + e) < 2 (R + e) − 1, which fails at
e = 1; a step inward leaves D ≥ −2s with s ≤ r, so e (2R − e) ≤ 2 (R − e), which fails there too.

Exact, because every number is an integer in int64. Compiled, because each iteration depends on
the one before.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import kernel
from camtool.kernels.heading import heading

Ints = npt.NDArray[np.int64]


@kernel
def stairs_start(x: int, y: int, clockwise: bool, error: int = 0) -> Ints:
    """The state (5,) at the start (x, y) ≠ (0, 0) of an arc: x, y, D, sx, sy."""
    sx, sy = heading(x, y, clockwise)
    return np.array([x, y, error, sx, sy], dtype=np.int64)


@kernel
def stairs_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]:
    """Run on from `state` into `out` (n, 2) until the end is met or `out` is full.

    Returns the number of rows filled and whether the last of them is the end; `state` then
    stands where the rows end, so that the next call goes on.
    """
    x, y, error, sx, sy = state[0], state[1], state[2], state[3], state[4]
    filled, met = 0, False
    while filled < len(out) and not met:
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
        out[filled, 0] = x
        out[filled, 1] = y
        filled += 1
        met = x == end_x and y == end_y
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy
    return filled, met
