from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.arrays import Floats, Indices, Ints

COLUMNS: int
CX: int
CY: int
HIGH_X: int
HIGH_Y: int
LOW_X: int
LOW_Y: int
RADIUS: int
SWEEP: int
UX: int
UY: int
VX: int
VY: int

class Moves(NamedTuple):
    start: Floats
    end: Floats
    heights: Floats
    arc: Indices
    arcs: Floats

def nearest(
    moves: Moves, points: Floats, runs: Ints, limits_mm: tuple[float, float]
) -> tuple[Floats, Ints]: ...
def pairs(
    moves: Moves, points: Floats, limits_mm: tuple[float, float]
) -> tuple[Ints, Ints, Floats]: ...
def hilbert_places(points: Floats, levels: int) -> npt.NDArray[np.uint32]: ...
