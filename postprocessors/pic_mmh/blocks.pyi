from camtool.arrays import Ints, Octets

CENTRE_X: int
CENTRE_Y: int
CODE: int
COLUMNS: int
DEEP: int
FEED: int
LENGTH: int
X: int
Y: int
Z: int

def moves_in_a_row(data: Octets, at: int, annex: bool, blocks: Ints) -> tuple[int, int]: ...
