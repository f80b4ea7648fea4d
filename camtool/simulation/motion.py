"""Motion: what the slides do, in chunks, so that memory does not grow with the program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Chunk:
    """K samples of one row of the toolpath, one per output of the controller, in order.

    commanded (K, 3) mm: where the controller believes that it stands, steps × coded step, work
    frame, after each output (the start of the row is no sample of it). slide (K, 3) mm: where the
    slides are at the same moment, with compensation, play and real step. duration_s and
    iterations (passes of the interpolator, idle ones too) of these samples; steps (3,) of the
    program per axis, compensation left out; reversals (3,): changes of direction per axis, each
    of which is one compensation. Compensation steps take time but are no samples of their own.

    Every row of the toolpath gives at least one chunk, rows that do not move one with K = 0; the
    last one of a row says `last`. `ended` is False on it when the arc's stop test was never met:
    the samples then stop at the nearest approach to the programmed end.
    """

    row: int
    commanded: Floats
    slide: Floats
    duration_s: float
    iterations: int
    steps: Ints
    reversals: Ints
    last: bool
    ended: bool
