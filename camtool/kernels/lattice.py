"""Lengths as whole steps.

Programs say lengths in decimals, so half steps occur exactly (0.07 µm at 0.14 µm a step) but
arrive as binary fractions a hair above or below: a quotient within `HALF_STEP_GUARD` below a half
is taken as the half. Plain numpy: nothing here depends on what came before."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

HALF_STEP_GUARD = 1e-6
"""Steps. Far above the rounding of a quotient of float64 (3e-10 at 10⁶ steps), far below the
finest difference of quotients that a dialect can say (1/14 step)."""


def to_steps(length_mm: npt.ArrayLike, step_mm: float) -> npt.NDArray[np.int64]:
    """Return lengths (mm) to the nearest whole steps, halves away from zero; same shape.

    >>> to_steps([0.00007, -0.00007, 0.000069, 3 * 0.00014], 0.00014).tolist()
    [1, -1, 0, 3]
    """
    quotient = np.asarray(length_mm, dtype=np.float64) / step_mm
    magnitude = np.floor(np.abs(quotient) + (0.5 + HALF_STEP_GUARD))
    return np.asarray(np.copysign(magnitude, quotient).astype(np.int64))
