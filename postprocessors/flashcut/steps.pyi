from typing import NamedTuple

from camtool.arrays import Floats, Ints

HOME_X: int
HOME_Y: int
HOME_Z: int
XY: int
Z: int

class Moves(NamedTuple):
    what: Ints
    target: Floats
    half_period: Ints
    row: Ints

class Rules(NamedTuple):
    origin: Floats
    step_mm: Floats
    added: float
    from_reached: bool
    late_longer: bool

class Counters(NamedTuple):
    steps: Ints
    programmed: Floats
    under_way: Ints

class Issued(NamedTuple):
    commanded: Floats
    row: Ints
    move: Ints
    since_ms: Ints
    duration_ms: Ints
    steps: Ints

def timers_fill(
    moves: Moves, first: int, rules: Rules, counters: Counters, issued: Issued
) -> tuple[int, int]: ...
