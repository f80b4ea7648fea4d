"""Straight legs of whole steps by a counter: one pulse of the axis with most steps per pass.

A leg of d = (dx, dy, dz) steps has M = max |d| passes. In each of them every axis adds |d| to its
count; a count that reaches M gives a step and loses M. So after pass k an axis has made
⌊k·|d| / M⌋ steps: the axis of M one in every pass, all of them |d| in the end. (ValCNC's CUENTA,
its Tabla 8; a leg along an axis or a diagonal is the same with any controller.)

Exact, because counts are int64 and k·|d| stays below 2⁶³ for legs below 2³¹ steps; any window can
be filled by itself. Compiled, because positions by division are five times slower.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import kernel

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]


@kernel
def legs_fill(done: int, begin: Ints, way: Ints, step_mm: Floats, out: Floats) -> None:
    """Positions after the passes of legs, `out` (n, 3) mm, those of the first from `done` on.

    Each leg starts at `begin` (L, 3) steps and goes by `way` (L, 3) steps, not all of them 0;
    `step_mm` (3,). `out` may end within a leg, not behind the last one.
    """
    leg, filled = 0, 0
    while filled < len(out):
        passes = max(abs(way[leg, 0]), abs(way[leg, 1]), abs(way[leg, 2]))
        run = min(passes - done, len(out) - filled)
        for axis in range(3):
            size, sense = abs(way[leg, axis]), 1 if way[leg, axis] > 0 else -1
            position = begin[leg, axis] + sense * (done * size // passes)
            count, step = done * size % passes, step_mm[axis]
            for k in range(filled, filled + run):
                count += size
                if count >= passes:
                    count -= passes
                    position += sense
                out[k, axis] = position * step
        filled += run
        leg += 1
        done = 0
