import numpy as np
from numpy.typing import NDArray

from camtool.arrays import Floats, Indices, Ints

def cut_heights(
    heights: NDArray[np.float32],
    owner: Indices,
    origin: tuple[float, float, float],
    starts: Floats,
    ends: Floats,
    tool: Ints,
    cutters: Floats,
    first: int,
) -> None: ...
def project(
    heights: NDArray[np.float32],
    grid: tuple[float, float, float],
    camera: tuple[float, float, float, float, float, float, float],
    wall: float,
    cell: Indices,
    level: NDArray[np.float32],
) -> None: ...
