from camtool.arrays import Ints, Octets

BEFORE: int
COLUMNS: int

def records_in_a_row(
    data: Octets, place: tuple[int, int], rules: tuple[int, int, int, int, bool], records: Ints
) -> tuple[int, int, int]: ...
