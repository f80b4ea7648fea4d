"""Motion: what the slides do, in chunks, so that memory does not grow with the program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from camtool.arrays import Bools, Floats, Ints


@dataclass(frozen=True, eq=False)
class Ledger:
    """What each of R rows of the toolpath did in one chunk; what several chunks say of a row
    adds up.

    row (R,) ascending. duration_s (R,) of everything, and compensation_s (R,) of it for what the
    controller issues at reversals; iterations (R,): passes of the interpolator, idle ones too;
    steps (R, 3) of the program per axis, compensation left out; reversals (R, 3): changes of
    direction per axis, each of which is one compensation. ended (R,): False when the stop test
    of an arc was never met; its samples then stop at the nearest approach to the programmed end.
    """

    row: Ints
    duration_s: Floats
    compensation_s: Floats
    iterations: Ints
    steps: Ints
    reversals: Ints
    ended: Bools


def still_ledger(rows: Ints) -> Ledger:
    """The ledger of rows (R,) that did nothing; its columns may be written to."""
    count = len(rows)
    return Ledger(
        row=rows,
        duration_s=np.zeros(count),
        compensation_s=np.zeros(count),
        iterations=np.zeros(count, dtype=np.int64),
        steps=np.zeros((count, 3), dtype=np.int64),
        reversals=np.zeros((count, 3), dtype=np.int64),
        ended=np.ones(count, dtype=np.bool_),
    )


@dataclass(frozen=True, eq=False)
class Chunk:
    """K samples in order, of one row of the toolpath or of several.

    row (K,) ascending. commanded (K, 3) mm: where the controller believes that it stands, work
    frame, after each output (the start of a row is no sample of it). slide (K, 3) mm: where the
    slides are at the same moment, with compensation, play, real step and the rest of the
    mechanics. Compensation steps take time but are no samples of their own.

    Every row up to the end of the program is in the ledger of at least one chunk, in order; rows
    that do not move have no samples.
    """

    row: Ints
    commanded: Floats
    slide: Floats
    ledger: Ledger


def one_row(
    row: int,
    commanded: Floats,
    slide: Floats,
    *,
    duration_s: float = 0.0,
    compensation_s: float = 0.0,
    iterations: int = 0,
    steps: npt.ArrayLike = (0, 0, 0),
    reversals: npt.ArrayLike = (0, 0, 0),
    ended: bool = True,
) -> Chunk:
    """A chunk of a single row: samples (K, 3), `steps` and `reversals` (3,)."""
    ledger = Ledger(
        row=np.array([row], dtype=np.int64),
        duration_s=np.array([duration_s], dtype=np.float64),
        compensation_s=np.array([compensation_s], dtype=np.float64),
        iterations=np.array([iterations], dtype=np.int64),
        steps=np.array([steps], dtype=np.int64),
        reversals=np.array([reversals], dtype=np.int64),
        ended=np.array([ended], dtype=np.bool_),
    )
    return Chunk(np.full(len(commanded), row, dtype=np.int64), commanded, slide, ledger)


NO_SAMPLES: Floats = np.empty((0, 3))
"""The samples of a row that does not move."""


# How to simulate: which interpolator, which effects of the mechanics, how much at a time.


@dataclass(frozen=True)
class Effects:
    """The parts of the mechanics, each of which can be left out to see its share.

    play of the axes (by region too); compensation that the controller issues against it; scale
    (real against coded step); squareness of X and Y; repeatability (random, by a seed).
    """

    play: bool = True
    compensation: bool = True
    scale: bool = True
    squareness: bool = True
    repeatability: bool = True


ALL = Effects()
IDEAL = Effects(False, False, False, False, False)
"""Slides that are where they are commanded."""

CHUNK_STEPS = 1 << 16
"""Samples of a chunk by default: a few MB."""


@dataclass(frozen=True)
class Options:
    """`interpolator` takes the place of the controller's own for arcs; no chunk has more than
    `chunk_steps` samples."""

    interpolator: str | None = None
    effects: Effects = ALL
    chunk_steps: int = CHUNK_STEPS
