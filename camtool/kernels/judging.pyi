from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.arrays import Floats, Indices, Ints

BEFORE_FIRST: int
STRIDE: int
CIRCLE: int
BINS: int
COLUMNS: int
COMMANDED_X: int
COMMANDED_Y: int
CX: int
CY: int
END_X: int
END_Y: int
FULL: int
HIGH_X: int
HIGH_Y: int
INNER_MAX: int
INNER_SQUARES: int
KNOWN: int
LAG_MAX: int
LAG_SQUARES: int
LOW_X: int
LOW_Y: int
RADIUS: int
ROW_COLUMNS: int
SAMPLES: int
SHIFT: int
TOTAL_MAX: int
TOTAL_SQUARES: int
TOTAL_SUM: int
TOTAL_X: int
TOTAL_Y: int
TURN: int
UX: int
UY: int
VX: int
VY: int
WIDE: int
WRITTEN: int

def leading_bits(values: npt.NDArray[np.float64]) -> npt.NDArray[np.int64]: ...

class Shapes(NamedTuple):
    start: Floats
    end: Floats
    arc: Indices
    arcs: Floats

class Moves(NamedTuple):
    shapes: Shapes
    heights: Floats
    nodes: Floats
    order: Indices

def bin_directions() -> Floats: ...
def empty_bins(count: int) -> Floats: ...
def new_pen(stride: int, room: int) -> Floats: ...
def unwritten(pen: Floats) -> Floats: ...

class Task(NamedTuple):
    low: int
    own: Shapes
    moves: Moves
    rows: Ints
    window: Floats
    off: Floats
    centre: Floats
    directions: Floats

class Sums(NamedTuple):
    rows: Floats
    histograms: Ints
    bins: Floats
    trace: Floats
    pen: Floats
    pieces: list[Floats]

def judge_samples(row: Ints, commanded: Floats, slide: Floats, task: Task, sums: Sums) -> int: ...
