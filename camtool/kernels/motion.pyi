import numpy as np
import numpy.typing as npt

from camtool.arrays import Floats, Ints

CENTRE_X: int
CENTRE_Y: int
RADIUS: int
GROWTH: int
ANGLE: int
SWEEP: int
Z: int
RISE: int
ARM_COLUMNS: int

class Ways:
    def __init__(
        self, start: Floats, end: Floats, arm: npt.NDArray[np.int32], arms: Floats
    ) -> None: ...
    def fill(self, row: Ints, share: Floats, points: Floats) -> None: ...

def legs_fill(
    first_pass: int, begin: Ints, travel: Ints, step_mm: Floats, out: Floats
) -> None: ...
def count_steps(points: Floats, step_mm: Floats, guard: float, counts: Ints) -> None: ...
def entry_speeds(
    gain: Floats, limit: Floats, window: int, reached: float, entry: Floats
) -> None: ...
