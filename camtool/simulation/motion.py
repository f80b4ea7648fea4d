"""Motion: positions of the slides, in chunks, so that memory does not grow with the program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.records import FrozenRecord


class Ledger(Struct, frozen=True, eq=False):
    """Time, steps and reversals of R rows of the toolpath in one chunk. A row may be in the
    ledgers of several chunks: their values add up.

    `row` (R,) ascending. `duration_s` (R,) in all, and `compensation_s` (R,) the part of it for
    steps that the controller adds at reversals. `iterations` (R,): passes of the interpolator,
    also idle ones. `steps` (R, 3) of the axes, without compensation. `reversals` (R, 3) of the
    axes, each of which is one compensation. `ended` (R,): False when the stop test of an arc is
    never met; its samples then stop at the nearest approach to the programmed end."""

    row: Ints
    duration_s: Floats
    compensation_s: Floats
    iterations: Ints
    steps: Ints
    reversals: Ints
    ended: Bools

    def add(self, other: Ledger) -> None:
        """Add the ledger of a chunk to this ledger of all rows, in place; each row may occur at
        most once in the chunk."""
        rows = other.row
        self.duration_s[rows] += other.duration_s
        self.compensation_s[rows] += other.compensation_s
        self.iterations[rows] += other.iterations
        self.steps[rows] += other.steps
        self.reversals[rows] += other.reversals
        self.ended[rows] &= other.ended


def still_ledger(rows: Ints) -> Ledger:
    """Return a ledger of zeros for rows (R,) without motion; its columns may be written to."""
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


class Chunk(Struct, frozen=True, eq=False):
    """K samples in order, of one row of the toolpath or of several.

    `row` (K,) ascending. `commanded` (K, 3) mm: the position that the controller assumes after
    each output, in the work frame (the start of a row is not a sample of it). `slide` (K, 3) mm:
    the positions of the slides at the same moment, with all of the mechanics. Compensation steps
    take time but have no samples.

    Every row up to the end of the program is in the ledger of at least one chunk, in order; rows
    without motion have no samples."""

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
    is_met: bool = True,
) -> Chunk:
    """Return a chunk of a single row: samples (K, 3), `steps` and `reversals` (3,)."""
    ledger = Ledger(
        row=np.array([row], dtype=np.int64),
        duration_s=np.array([duration_s], dtype=np.float64),
        compensation_s=np.array([compensation_s], dtype=np.float64),
        iterations=np.array([iterations], dtype=np.int64),
        steps=np.array([steps], dtype=np.int64),
        reversals=np.array([reversals], dtype=np.int64),
        ended=np.array([is_met], dtype=np.bool_),
    )
    return Chunk(np.full(len(commanded), row, dtype=np.int64), commanded, slide, ledger)


NO_SAMPLES: Floats = np.empty((0, 3))
"""The samples of a row without motion."""


# Options of a simulation: the interpolator, the effects of the mechanics, the size of chunks.


@dataclass(frozen=True, repr=False, eq=False)
class Effects(FrozenRecord):
    """The effects of the mechanics, each of which can be left out to see its share of the error.

    `play`: backlash of the axes, also by region; `compensation` that the controller adds against
    it; `scale`: real against coded step; `squareness` of X and Y; `repeatability`: random, by a
    seed."""

    play: bool = True
    compensation: bool = True
    scale: bool = True
    squareness: bool = True
    repeatability: bool = True


ALL = Effects()
IDEAL = Effects(False, False, False, False, False)
"""Slides at the commanded positions."""

CHUNK_STEPS = 1 << 16


@dataclass(frozen=True, repr=False, eq=False)
class Options(FrozenRecord):
    """Options of a simulation. `interpolator` replaces the controller's own for arcs; only the
    `effects` act; a chunk has at most `chunk_steps` samples. Without `rapids`, samples of moves
    that cut nothing may be left out between the places where an axis reverses, since judging does
    not need them."""

    interpolator: str | None = None
    effects: Effects = ALL
    chunk_steps: int = CHUNK_STEPS
    rapids: bool = True
