"""The stream of motion: chunks gathered into batches, and what is counted over all of them.

A simulator gives many small chunks (a row may have three steps) or few large ones. Python's cost
per batch is the same for both, so small ones are joined until `BATCH_STEPS` are together. The
sums over steps, reversals and time, and the arcs that never end, are taken on the way.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.simulation.motion import Chunk
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verify.cuts import Bools

BATCH_STEPS = 1 << 15
"""Steps that are judged together: more saves no time, and memory is some 200 bytes each."""


@dataclass(frozen=True, eq=False)
class Batch:
    """Steps of one or more rows, in order: row (J,), commanded and slide (J, 2) mm in XY."""

    row: Ints
    commanded: Floats
    slide: Floats


@dataclass
class Tally:
    """Sums over the whole program; reversals and times also apart for cutting and the rest."""

    steps: Ints = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    iterations: int = 0
    reversals: Ints = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    cutting_reversals: Ints = field(default_factory=lambda: np.zeros(3, dtype=np.int64))
    cutting_s: float = 0.0
    air_s: float = 0.0
    dwell_s: float = 0.0
    gave_up: dict[int, tuple[float, float]] = field(default_factory=dict)
    """Rows whose stop test was never met, and where in XY (mm) the simulation left them."""

    @property
    def time_s(self) -> float:
        """Cutting, air moves and dwells together."""
        return self.cutting_s + self.air_s + self.dwell_s

    def add(self, chunk: Chunk, cutting: Bools, dwell: Bools) -> None:
        """Count one chunk; `cutting` and `dwell` (N,) tell rows that cut and rows that wait."""
        ledger = chunk.ledger
        cuts, waits = cutting[ledger.row], dwell[ledger.row]
        self.steps += ledger.steps.sum(axis=0)
        self.iterations += int(ledger.iterations.sum())
        self.reversals += ledger.reversals.sum(axis=0)
        self.cutting_reversals += ledger.reversals[cuts].sum(axis=0)
        self.cutting_s += float(ledger.duration_s[cuts].sum())
        self.dwell_s += float(ledger.duration_s[waits].sum())
        self.air_s += float(ledger.duration_s[~cuts & ~waits].sum())
        for row in ledger.row[~ledger.ended].tolist():
            here = chunk.commanded[chunk.row == row, :2]
            x, y = here[-1] if len(here) else (np.nan, np.nan)
            self.gave_up[row] = (float(x), float(y))


def batches(
    chunks: Iterable[Chunk], decoded: Toolpath, is_cut: Bools, tally: Tally
) -> Iterator[Batch]:
    """Chunks joined into batches of about `BATCH_STEPS`; `tally` is filled on the way."""
    dwell = decoded.kind == Kind.DWELL
    waiting: list[Chunk] = []
    steps = 0
    for chunk in chunks:
        tally.add(chunk, is_cut, dwell)
        if len(chunk.row):
            waiting.append(chunk)
            steps += len(chunk.row)
        if steps >= BATCH_STEPS:
            yield _joined(waiting)
            waiting, steps = [], 0
    if waiting:
        yield _joined(waiting)


def _joined(chunks: list[Chunk]) -> Batch:
    return Batch(
        row=np.concatenate([chunk.row for chunk in chunks]),
        commanded=np.concatenate([chunk.commanded[:, :2] for chunk in chunks]),
        slide=np.concatenate([chunk.slide[:, :2] for chunk in chunks]),
    )
