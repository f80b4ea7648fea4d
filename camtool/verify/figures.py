"""Figures of a stream of errors, in memory that does not grow with the stream.

`Figure` takes errors in mm, batch by batch, and gives the maximum (exact, with its place), the
root of the mean square (exact, every sample counts alike) and the 95th percentile. The percentile
comes from a histogram: the middle of the bin that holds the sample of that rank.

The bins are those of a float's own bits: the exponent and the first `MANTISSA_BITS` bits of the
mantissa, taken as one integer, grow with the number and make bins whose width is between 1/256
and 1/128 of their value. So the percentile is within 0.4 % of a sample's true value.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.geometry.polylines import Floats, Ints

MANTISSA_BITS = 7
"""Bits of the mantissa that tell bins apart: bins are at most 2⁻⁷, 0.8 %, wide."""

SMALLEST_MM = 2.0**-30
"""Errors below this (a thousandth of a nanometre) are counted as 0 by the percentile."""

LARGEST_MM = 2.0**20
"""Errors above this (a kilometre) share the last bin of the percentile."""

PERCENTILE = 0.95
"""Which percentile of the errors the report calls p95."""

_SHIFT = 52 - MANTISSA_BITS


def _bits(values: Floats) -> Ints:
    """The leading bits of each float64 ≥ 0, as integers in the order of the values."""
    return np.right_shift(np.ascontiguousarray(values).view(np.int64), _SHIFT)


_FIRST = int(_bits(np.array([SMALLEST_MM]))[0])
_BINS = int(_bits(np.array([LARGEST_MM]))[0]) - _FIRST + 2


class Figure:
    """Maximum, rms and 95th percentile of errors ≥ 0, mm; all NaN while nothing was added."""

    def __init__(self) -> None:
        self.count = 0
        self.at_mm: tuple[float, float] = (math.nan, math.nan)
        """Where the maximum was found first."""
        self.row = -1
        """Toolpath row of the maximum."""
        self._max = -math.inf
        self._squares = 0.0
        self._histogram = np.zeros(_BINS, dtype=np.int64)

    def add(self, errors: Floats, points: Floats, rows: Ints) -> None:
        """Errors (J,) mm measured at points (J, 2) mm of these rows (J,)."""
        if len(errors) == 0:
            return
        self.count += len(errors)
        self._squares += float((errors * errors).sum())  # np.dot would start threads
        worst = int(np.argmax(errors))
        if float(errors[worst]) > self._max:
            self._max = float(errors[worst])
            self.at_mm = (float(points[worst, 0]), float(points[worst, 1]))
            self.row = int(rows[worst])
        # Bin 0 is for 0; the last one for what is too large.
        bins = np.clip(_bits(errors) - (_FIRST - 1), 0, _BINS - 1)
        self._histogram += np.bincount(bins, minlength=_BINS)

    @property
    def max(self) -> float:
        """Largest error, mm, exact."""
        return self._max if self.count else math.nan

    @property
    def rms(self) -> float:
        """Root of the mean square, mm."""
        return math.sqrt(self._squares / self.count) if self.count else math.nan

    @property
    def p95(self) -> float:
        """The error that 95 % of the samples do not exceed, mm, within 0.4 %."""
        if not self.count:
            return math.nan
        rank = math.ceil(PERCENTILE * self.count)
        chosen = int(np.searchsorted(np.cumsum(self._histogram), rank))
        if chosen == 0:
            return 0.0
        edges = np.array([chosen, chosen + 1], dtype=np.int64) + (_FIRST - 1)
        middle = float(np.left_shift(edges, _SHIFT).view(np.float64).mean())
        return min(middle, self._max)


class LargestError:
    """The maximum alone, mm; NaN while nothing was added."""

    def __init__(self) -> None:
        self.max = math.nan

    def add(self, errors: Floats) -> None:
        """Errors (J,) mm."""
        if len(errors):
            worst = float(errors.max())
            self.max = worst if math.isnan(self.max) else max(self.max, worst)
