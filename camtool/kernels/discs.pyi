from camtool.arrays import Floats, Ints

AX: int
AY: int
BLOCK: int
CONVEX: int
REFLEX: int
SMOOTH: int
SWEEP: int
SMOOTH_RAD: float

Place = tuple[float, float, float, float, float, float]

def largest_discs(
    boundary: tuple[Floats, Ints, Floats],
    row: Ints,
    t: Floats,
    guess: Ints,
    result: Floats,
    partner: Ints,
) -> None: ...
def frame(table: Floats, own: int, t: float) -> tuple[float, float, float, float]: ...
