from camtool.arrays import Bools, Floats

ASKEW: int
ASKEW_END: int
AX: int
AY: int
BX: int
BY: int
COLUMNS: int
HIGH: int
LOW: int
RADIUS: int

class Cleared:
    def __init__(
        self, extents: Floats, reach_mm: float, box: Floats, *, from_right: bool = False
    ) -> None: ...
    def add(self, moves: Floats) -> None: ...
    def judge(
        self,
        moves: Floats,
        cuts: Bools,
        thick_mm: float,
        enough_rad: float,
        fine_rad: float,
        *,
        adds: bool = True,
        coarse_rad: float = ...,
        known_rad: float = ...,
    ) -> Floats: ...
    def try_moves(
        self, moves: Floats, thick_mm: float, limit_rad: float, *, coarse_rad: float = ...
    ) -> tuple[float, int, float]: ...
