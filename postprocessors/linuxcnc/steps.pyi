from camtool.arrays import Bools, Floats, Ints
from camtool.kernels.motion import Ways

MAX_CHAIN_POINTS: int

def merge_lines(
    points: Floats, breaks: Bools, tolerance: Floats, chain: Ints, projected: Floats
) -> None: ...

REACH: int
REACH_ON: int
BEFORE: int
BEHIND: int
RAMP: int
TURN: int
ANGLE: int
SINE: int
CENTRE: int
FIRST: int
LAST: int
CORNER_COLUMNS: int

class Blends:
    def __init__(
        self,
        ways: Ways,
        corners: Floats,
        moves: tuple[Floats, Floats, Ints],
        rows: tuple[Ints, Floats, Floats],
    ) -> None: ...
    def put(self, row: Ints, share: Floats, points: Floats) -> None: ...
