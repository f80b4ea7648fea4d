"""Chunks of a motion whose samples are numbered from 0, any window of them at a time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, still_ledger


class Samples(Protocol):
    """All samples of a program. `first` (R+1,): row r owns samples first[r]:first[r+1]."""

    @property
    def first(self) -> Ints: ...

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Row (K,) and commanded position (K, 3) mm of the samples low:high."""

    def steps(self, bounds: Ints) -> Ints:
        """(R, 3) steps of each axis within samples bounds[r]:bounds[r+1]."""


@dataclass(frozen=True, eq=False)
class RowTotals:
    """What each row takes in all: seconds (R,); `iterates`: each sample is a pass of the
    interpolator."""

    seconds: Floats
    iterates: bool = False


def row_chunks(
    samples: Samples, totals: RowTotals, mechanics: Mechanics, chunk_steps: int
) -> Iterator[Chunk]:
    """The chunks of all rows, none with more than `chunk_steps` samples; the time of a row that
    lies in several is shared out by samples."""
    first = samples.first
    rows, total = len(first) - 1, int(first[-1])
    done = 0  # rows whose ledger is complete
    for low in range(0, total, chunk_steps):
        high = min(low + chunk_steps, total)
        row, commanded = samples.window(low, high)
        last = int(row[-1])
        whole = rows if high == total else last + int(high == first[last + 1])
        listed = np.arange(done, max(whole, last + 1))
        offsets = np.concatenate([[0], np.flatnonzero(np.diff(row)) + 1, [len(row)]])
        ledger = still_ledger(listed)
        moved = row[offsets[:-1]] - listed[0]
        slide, ledger.reversals[moved] = mechanics.follow(commanded, offsets)
        ledger.steps[moved] = samples.steps(low + offsets)
        here = np.zeros(len(listed), dtype=np.int64)
        here[moved] = np.diff(offsets)
        own = (first[1:] - first[:-1])[listed]
        ledger.duration_s[:] = totals.seconds[listed] * np.where(
            own > 0, here / np.maximum(own, 1), 1.0
        )
        if totals.iterates:
            ledger.iterations[:] = here
        yield Chunk(row, commanded, slide, ledger)
        done = whole
    if total == 0 and rows:
        ledger = still_ledger(np.arange(rows))
        ledger.duration_s[:] = totals.seconds
        yield Chunk(np.empty(0, np.int64), NO_SAMPLES, NO_SAMPLES, ledger)
