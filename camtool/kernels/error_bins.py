"""Bins for the sizes of errors: those of a float's own bits. Plain numpy: no kernel.

The exponent and the first `MANTISSA_BITS` bits of the mantissa, taken as one integer, grow with
the number and make bins whose width is between 1/256 and 1/128 of their value.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

MANTISSA_BITS = 7
"""Bits of the mantissa that tell bins apart: bins are at most 2⁻⁷, 0.8 %, wide."""

SMALLEST_MM = 2.0**-30
"""Errors below this (a thousandth of a nanometre) are counted as 0 by the percentile."""

LARGEST_MM = 2.0**20
"""Errors above this (a kilometre) share the last bin of the percentile."""

SHIFT = 52 - MANTISSA_BITS
"""How far a float's bits are shifted to leave those that tell bins apart."""


def leading_bits(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]:
    """The leading bits of each float64 ≥ 0, as integers in the order of the values."""
    return np.right_shift(np.ascontiguousarray(values).view(np.int64), SHIFT)


BEFORE_FIRST = int(leading_bits(np.array([SMALLEST_MM]))[0]) - 1
"""What the leading bits of an error are above its bin: bin 0 is for 0 and for what is less."""

BINS = int(leading_bits(np.array([LARGEST_MM]))[0]) - BEFORE_FIRST + 1
"""How many bins; the last one is also for what is too large."""
