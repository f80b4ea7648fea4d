"""How fast a planner that sees only so many blocks ahead enters each of them.

A planner may enter block j no faster than its limit (squared: limit_j), and never so fast that it
could not stop at the end of the last block that it knows of. With e the square of a speed, a the
acceleration and d the length of a block:

    backward over the known blocks, from rest:   e ← min(limit_j, e + 2 a_j d_j)
    forward, from what was reached before:       entry_i² = min(e_i, entry_{i−1}² + 2 a d)

When block i is entered the block before it is still in the buffer, which holds `window` blocks:
it knows blocks i to i + window − 2. Exact, because the windows are those of a buffer that is
always full; what the planner does again at each new block ends at the same numbers.

Compiled, because every speed depends on the one before.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import kernel

Floats = npt.NDArray[np.float64]


@kernel
def entry_speeds(gain: Floats, limit: Floats, window: int, entry: Floats) -> None:
    """Squares of the speeds at the starts of N blocks, `entry` (N,).

    `gain` (N,): what the square of a speed can change by within a block, 2 a d; `limit` (N,): its
    highest value at the start of the block, 0 where the machine stands before it.
    """
    reached = 0.0
    for i in range(len(gain)):
        planned = 0.0
        for j in range(min(i + window - 1, len(gain)) - 1, i - 1, -1):
            planned = min(limit[j], planned + gain[j])
        reached = min(planned, reached)
        entry[i] = reached
        reached += gain[i]
