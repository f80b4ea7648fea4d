from camtool.arrays import Bools, Ints

TIME: int
CELL: int
LOW: int
HIGH: int
LEFT: int
RIGHT: int
CUT: int

def partings(time: Ints, standing: int, min_cells: float) -> Ints: ...
def piece_at(standing: Bools, row: int, column: int) -> Bools: ...
