"""Figures of a stream of errors, in memory that does not grow with the stream.

`Figure` takes errors in mm, batch by batch, and gives the maximum (exact, with its place), the
root of the mean square (exact, every sample counts alike) and the 95th percentile. The percentile
comes from a histogram: the middle of the bin that holds the sample of that rank.

Bins (`camtool.kernels.error_bins`) are between 1/256 and 1/128 of their value wide. So the
percentile is within 0.4 % of a sample's true value.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.kernels.error_bins import BEFORE_FIRST, BINS, SHIFT, leading_bits

PERCENTILE = 0.95
"""Which percentile of the errors the report calls p95."""


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
        self._histogram = np.zeros(BINS, dtype=np.int64)

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
        bins = np.clip(leading_bits(errors) - BEFORE_FIRST, 0, BINS - 1)
        self._histogram += np.bincount(bins, minlength=BINS)

    @classmethod
    def of_rows(
        cls, largest: Floats, squares: Floats, counts: Ints, histogram: Ints | None
    ) -> Figure:
        """The figure of what was judged row by row: the largest error (N,) mm of each row or NaN,
        sums of squares (N,) mm², counts (N,); `histogram` (L · BINS,) of all, L numbers for each
        bin."""
        made = cls()
        made.count = int(counts.sum())
        if made.count:
            made.row = int(np.nanargmax(largest))
            made._max = float(largest[made.row])
            made._squares = float(squares.sum())
        if histogram is not None:
            made._histogram = histogram.reshape(BINS, -1).sum(axis=1)
        return made

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
        edges = np.array([chosen, chosen + 1], dtype=np.int64) + BEFORE_FIRST
        middle = float(np.left_shift(edges, SHIFT).view(np.float64).mean())
        return min(middle, self._max)
