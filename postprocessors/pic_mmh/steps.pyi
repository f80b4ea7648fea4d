from camtool.arrays import Floats, Ints
from camtool.kernels.judging import Sums, Task

A: int
ARC: int
B: int
CLOCKWISE: int
COUNT_COLUMNS: int
CW: int
DDA: int
DEPTH: int
DSM: int
ENDED: int
END_X: int
END_Y: int
EQUAL: int
FROM_X: int
FROM_Y: int
ITERATION: int
KIND: int
LEG_COLUMNS: int
LINE: int
MET: int
ORIGIN_X: int
ORIGIN_Y: int
PASSES: int
REVERSALS: int
ROW: int
SAMPLES: int
SIGN_X: int
SIGN_Y: int
READINGS: dict[str, int]
STAIRS: int
STEPS: int
STOP: int
STOP_COLUMNS: int
STOP_X: int
STOP_Y: int

def rounded_radius(x: int, y: int) -> int: ...
def expected_quadrants(x: int, y: int, clockwise: bool, end_x: int, end_y: int) -> int: ...
def approach_start(x: int, y: int, end_x: int, end_y: int, low: int) -> Ints: ...
def approach_scan(points: Ints, end: Ints, tracker: Ints, low: int, high: int) -> None: ...
def direct_search_start(x: int, y: int, clockwise: bool, error: int = ...) -> Ints: ...
def direct_search_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]: ...
def stairs_start(x: int, y: int, clockwise: bool, error: int = ...) -> Ints: ...
def stairs_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, bool]: ...
def dda_line_fill(
    a: int, b: int, registers: Floats, counters: Ints, out: Ints
) -> tuple[int, int, bool]: ...
def dda_arc_start(x: int, y: int, clockwise: bool) -> Ints: ...
def dda_arc_fill(state: Ints, end_x: int, end_y: int, out: Ints) -> tuple[int, int, bool]: ...
def arc_stops(legs: Ints, how: tuple[int, bool, int], out: Ints) -> None: ...
def run_on(
    moves: Ints, start: Ints, ends: Ints, centres: Ints, how: tuple[int, bool, int], samples: Ints
) -> None: ...
def judge_legs(
    legs: Ints,
    how: tuple[int, bool],
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
) -> None: ...
def land(
    arcs: Ints, sweeps: Floats, units_per_step: float, most_units: int, sagitta: float
) -> Ints: ...
