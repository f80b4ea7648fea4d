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

    def add(self, chunk: Chunk, *, cutting: bool, dwell: bool) -> None:
        """Count one chunk of a row that cuts, waits, or neither."""
        self.steps += chunk.steps
        self.iterations += chunk.iterations
        self.reversals += chunk.reversals
        if cutting:
            self.cutting_reversals += chunk.reversals
            self.cutting_s += chunk.duration_s
        elif dwell:
            self.dwell_s += chunk.duration_s
        else:
            self.air_s += chunk.duration_s
        if not chunk.ended:
            x, y = chunk.commanded[-1, :2] if len(chunk.commanded) else (np.nan, np.nan)
            self.gave_up[chunk.row] = (float(x), float(y))


def batches(
    chunks: Iterable[Chunk], decoded: Toolpath, is_cut: Bools, tally: Tally
) -> Iterator[Batch]:
    """Chunks joined into batches of about `BATCH_STEPS`; `tally` is filled on the way."""
    cutting = is_cut.tolist()
    dwell = (decoded.kind == Kind.DWELL).tolist()
    waiting: list[Chunk] = []
    steps = 0
    for chunk in chunks:
        tally.add(chunk, cutting=cutting[chunk.row], dwell=dwell[chunk.row])
        if len(chunk.commanded):
            waiting.append(chunk)
            steps += len(chunk.commanded)
        if steps >= BATCH_STEPS:
            yield _joined(waiting)
            waiting, steps = [], 0
    if waiting:
        yield _joined(waiting)


def _joined(chunks: list[Chunk]) -> Batch:
    rows = np.array([chunk.row for chunk in chunks], dtype=np.int64)
    counts = np.array([len(chunk.commanded) for chunk in chunks])
    return Batch(
        row=np.repeat(rows, counts),
        commanded=np.concatenate([chunk.commanded[:, :2] for chunk in chunks]),
        slide=np.concatenate([chunk.slide[:, :2] for chunk in chunks]),
    )
