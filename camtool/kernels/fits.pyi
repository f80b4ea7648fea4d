from camtool.arrays import Bools, Floats, Ints

ASIDE_FROM: int
ASIDE_TO: int
MAX_NODES: int
MEASURE_STEPS: int
MIN_POINTS: int
MIN_STEPS: int
CORNER_ANGLE_RAD: float
SPAN_TURN_RAD: float
STEP_ERROR_SHARE: float
STEP_TURN_RAD: float
VANISHING_TANGENT: float

def samples_between(pieces: Floats, t: Floats) -> Floats: ...
def curve_rows(pieces: Floats, steps: int, tolerance: float) -> tuple[Floats, Bools]: ...
def step_errors(
    point: Floats, leave: Floats, arrive: Floats, rows: Ints, probes: Floats
) -> Floats: ...
def fit_nodes(
    nodes: tuple[Floats, Floats, Floats, Bools], samples: Floats, target: float, tolerance: float
) -> tuple[Floats, tuple[float, float, float]]: ...
def find_runs(points: Floats, noise: float, tolerance: float) -> Floats: ...
def furthest_off(points: Floats, arcs: Floats) -> float: ...
def closest(
    start: Floats, end: Floats, bulge: Floats, boxes: Floats, path: Ints
) -> tuple[float, int, int]: ...
def nearest_rows(
    points: Floats, start: Floats, end: Floats, bulge: Floats, boxes: Floats
) -> Ints: ...
