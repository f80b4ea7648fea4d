import numpy as np
import numpy.typing as npt

from camtool.arrays import Floats, Ints

EIGHTHS: int

def steps_taken(travel: Ints, events: Ints) -> Ints: ...
def step_lines_fill(
    blocks: tuple[Ints, Ints], first: tuple[int, int], step_mm: Floats, out: Floats
) -> None: ...

class Segments:
    def __init__(
        self,
        length: npt.NDArray[np.float32],
        acceleration: npt.NDArray[np.float32],
        entry: npt.NDArray[np.float32],
        exit: npt.NDArray[np.float32],
        nominal: npt.NDArray[np.float32],
        events: npt.NDArray[np.int32],
    ) -> None: ...
    def fill(self, block: Ints, eighths: Ints, tick: Ints, cycles: Ints) -> int: ...
