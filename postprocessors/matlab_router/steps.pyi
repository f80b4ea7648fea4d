from typing import NamedTuple

from camtool.arrays import Bools, Floats, Indices, Ints

COUNT: int
DRIVE: int
FIRST_ROW: int
FOLLOWING: int
HOME_AMOUNT: int
HOME_SPEED: int
HOMING: int
PART_COUNT: int
PLACE: int
REF: int
SECOND_ROW: int
SHOWN: int
STAGE: int
TABLE_COUNTS: int
TARGET: int
TURN: int

class Program(NamedTuple):
    lines: Indices
    pauses: Floats
    axes: Floats
    table: Ints
    lag: float
    text: bool
    thin: Bools

class State(NamedTuple):
    motors: Floats
    slaves: Ints
    clock: Ints
    begin: Floats

class Account(NamedTuple):
    ticks: Floats
    steps: Ints
    has_ended: Bools
    samples: Ints

def slaves_fill(
    program: Program, state: State, account: Account, out: Ints, row: Ints
) -> tuple[int, bool]: ...
