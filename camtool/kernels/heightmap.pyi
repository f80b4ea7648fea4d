import numpy as np
from numpy.typing import NDArray

from camtool.arrays import Floats, Ints

def cut_heights(
    heights: NDArray[np.float32],
    owner: NDArray[np.int32],
    origin: tuple[float, float, float],
    starts: Floats,
    ends: Floats,
    tool: Ints,
    cutters: Floats,
    first: int,
) -> None: ...
