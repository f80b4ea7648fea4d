"""Quantities over time reduced to the columns of a picture: the least and largest value in each.

Memory is that of the columns, however long the program is, and no peak is lost: a value that holds
for any part of a column counts in it."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.simulation.timing import TimedChunk

LONG_COLUMNS = 2
"""Values that hold for more columns than this are entered one by one."""

STANDING_S = 1e-7
"""The machine stands between two samples that are farther apart than this."""


class Peak(Struct, frozen=True):
    """An extreme value, the time from which it holds, and its row of the toolpath."""

    value: float
    at_s: float
    row: int


class TimeColumns:
    """`count` columns of the time from `from_s` to `to_s`, for L quantities: `low` and `high`
    (L, count), infinite where nothing is known; `least` and `largest` are the extremes of all."""

    def __init__(self, from_s: float, to_s: float, count: int, quantities: int) -> None:
        self.from_s, self.to_s, self.count = from_s, to_s, count
        self.low = np.full((quantities, count), np.inf)
        self.high = np.full((quantities, count), -np.inf)
        self.least = [Peak(math.inf, math.nan, -1)] * quantities
        self.largest = [Peak(-math.inf, math.nan, -1)] * quantities
        self._scale = count / (to_s - from_s)

    def add(self, begin_s: Floats, end_s: Floats, values: Floats, row: Ints) -> None:
        """Add `values` (K, L) that hold from `begin_s` (K,) until `end_s` (K,), in rows (K,) of
        the toolpath; NaN is unknown."""
        inside = (end_s >= self.from_s) & (begin_s <= self.to_s) & ~np.isnan(values[:, 0])
        index = np.flatnonzero(inside)
        if not len(index):
            return
        begin_s, end_s, values, row = begin_s[index], end_s[index], values[index], row[index]
        first = np.floor((begin_s - self.from_s) * self._scale).clip(0, self.count - 1)
        last = np.ceil((end_s - self.from_s) * self._scale - 1.0).clip(0, self.count - 1)
        first_column = first.astype(np.int64)
        last_column = np.maximum(last.astype(np.int64), first_column)
        long_values = np.flatnonzero(last_column - first_column >= LONG_COLUMNS).tolist()
        for k, (low, high) in enumerate(zip(self.low, self.high, strict=True)):
            own = values[:, k]
            for column in (first_column, last_column):
                np.minimum.at(low, column, own)
                np.maximum.at(high, column, own)
            for j in long_values:
                inner = slice(int(first_column[j]) + 1, int(last_column[j]))
                np.minimum(low[inner], own[j], out=low[inner])
                np.maximum(high[inner], own[j], out=high[inner])
            lowest, largest = int(own.argmin()), int(own.argmax())
            if own[lowest] < self.least[k].value:
                self.least[k] = _peak(lowest, own, begin_s, row)
            if own[largest] > self.largest[k].value:
                self.largest[k] = _peak(largest, own, begin_s, row)


def _peak(k: int, values: Floats, begin_s: Floats, row: Ints) -> Peak:
    return Peak(float(values[k]), float(begin_s[k]), int(row[k]))


class Held:
    """Converts samples to values that hold until the next sample, and adds them to columns."""

    def __init__(self, columns: TimeColumns) -> None:
        self._columns = columns
        self._last: tuple[float, Floats, int] | None = None

    def add(self, at_s: Floats, values: Floats, row: Ints) -> None:
        """Add `values` (K, L) that are reached at `at_s` (K,), in rows (K,) of the toolpath."""
        if not len(at_s):
            return
        if self._last is not None:
            before_s, value, last_row = self._last
            at_s = np.concatenate([[before_s], at_s])
            values = np.concatenate([value[None, :], values])
            row = np.concatenate([[last_row], row])
        self._columns.add(at_s[:-1], at_s[1:], values[:-1], row[:-1])
        self._last = float(at_s[-1]), values[-1], int(row[-1])

    def finish(self, until_s: float) -> None:
        """Hold the last value until the end of the program."""
        if self._last is not None:
            at_s, values, row = self._last
            end_s = np.array([max(until_s, at_s)])
            self._columns.add(np.array([at_s]), end_s, values[None, :], np.array([row]))


class Speeds:
    """Converts samples to speeds (mm/s) along the path and of X, Y and Z, and adds them to
    columns.

    Each speed is averaged over `samples` samples of a row, or over at least `period_s` of motion
    (0: none); where the machine stands between two samples, it is 0."""

    def __init__(
        self, columns: TimeColumns, start_mm: Floats, samples: int, period_s: float = 0.0
    ) -> None:
        self._columns, self._samples, self._period_s = columns, samples, period_s
        self._row = np.zeros(0, dtype=np.int64)
        self._begin_s, self._end_s = np.zeros(0), np.zeros(0)
        self._points, self._start = np.zeros((0, 3)), start_mm
        self._moved_until_s = 0.0

    def add(self, timed: TimedChunk) -> None:
        """Add the samples of a chunk."""
        self._row = np.concatenate([self._row, timed.chunk.row])
        self._begin_s = np.concatenate([self._begin_s, timed.begin_s])
        self._end_s = np.concatenate([self._end_s, timed.end_s])
        self._points = np.concatenate([self._points, timed.chunk.commanded])
        starts = self._starts()
        if len(starts) > 1:
            self._measure(starts)

    def finish(self, until_s: float) -> None:
        """Add the speeds of the remaining samples, and 0 until the end of the program."""
        if len(self._row):
            self._measure(np.append(self._starts(), len(self._row)))
        self._stand(np.array([self._moved_until_s]), np.array([until_s]), np.array([-1]))

    def _starts(self) -> Ints:
        """Return the indices of the first samples of all measurements; the last measurement may be
        incomplete."""
        count = len(self._row)
        is_first = np.ones(count, dtype=np.bool_)
        is_first[1:] = self._begin_s[1:] > self._end_s[:-1] + STANDING_S
        if self._period_s:
            period = np.floor(self._end_s / self._period_s)
            is_first[1:] |= np.diff(period) != 0
        else:
            is_first[1:] |= np.diff(self._row) != 0
            index = np.arange(count)
            number = index - np.maximum.accumulate(np.where(is_first, index, 0))
            is_first |= number % self._samples == 0
        # What takes no time belongs to what comes before.
        is_first[1:] &= (self._end_s > self._begin_s)[1:]
        return np.flatnonzero(is_first)

    def _measure(self, starts: Ints) -> None:
        """Add the speeds of the samples before the last of these starts; the samples after it are
        kept for the next chunk."""
        first, last = starts[:-1], starts[1:] - 1
        before = np.concatenate([self._start[None, :], self._points])[first]
        begin_s, end_s = self._begin_s[first], self._end_s[last]
        change_mm = self._points[last] - before
        is_timed = end_s > begin_s
        duration_s = np.where(is_timed, end_s - begin_s, 1.0)
        velocity = change_mm / duration_s[:, None]
        speeds = np.column_stack([np.linalg.norm(velocity, axis=1), velocity])
        row = self._row[last]
        timed = np.flatnonzero(is_timed)
        self._columns.add(begin_s[timed], end_s[timed], speeds[timed], row[timed])
        reached_s = np.concatenate([[self._moved_until_s], end_s])[:-1]
        standing = np.flatnonzero(begin_s > reached_s + STANDING_S)
        self._stand(reached_s[standing], begin_s[standing], row[standing])
        keep = int(starts[-1])
        self._moved_until_s, self._start = float(end_s[-1]), self._points[last[-1]]
        self._row, self._points = self._row[keep:], self._points[keep:]
        self._begin_s, self._end_s = self._begin_s[keep:], self._end_s[keep:]

    def _stand(self, begin_s: Floats, end_s: Floats, row: Ints) -> None:
        stands = np.flatnonzero(end_s > begin_s + STANDING_S)
        none = np.zeros((len(stands), len(self._columns.low)))
        self._columns.add(begin_s[stands], end_s[stands], none, row[stands])
