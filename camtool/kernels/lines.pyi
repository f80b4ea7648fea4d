from typing import NamedTuple

from camtool.arrays import Floats, Ints
from camtool.kernels.judging import Sums, Task

MIN_EVENTS: int
MIN_STRIDE: int
PIECE_COLUMNS: int
WHICH: int
COUNT: int

class StepLines(NamedTuple):
    row: Ints
    start: Ints
    travel: Ints
    rounds: bool
    step_mm: Floats
    axes: Floats
    lean: float

class Followed(NamedTuple):
    slides: Floats
    added: Floats
    steps: Ints
    reversals: Ints
    events: Ints

def follow_lines(lines: StepLines, states: Floats, low: int, followed: Followed) -> None: ...
def judge_lines(lines: StepLines, followed: Followed, task: Task, sums: Sums) -> Floats: ...
def count_below(pieces: Floats, size: float) -> int: ...
