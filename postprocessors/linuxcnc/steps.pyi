from camtool.arrays import Bools, Floats, Ints

MAX_CHAIN_POINTS: int

def merge_lines(
    points: Floats, breaks: Bools, tolerance: Floats, chain: Ints, moved: Floats
) -> None: ...
