from camtool.arrays import Floats, Ints

def play_limits(play_mm: float, convention: str, direction: int) -> tuple[float, float]: ...
def play_start(position: float, scale: float, direction: int) -> Floats: ...
def play_fill(
    positions: Floats, offsets: Ints, axes: Floats, states: Floats, out: Floats, turns: Ints
) -> None: ...
def play_varied_fill(
    positions: Floats,
    offsets: Ints,
    axes: Floats,
    states: Floats,
    plays: Floats,
    shares: Floats,
    scatter: Floats,
    seed: int,
    out: Floats,
    turns: Ints,
) -> None: ...
