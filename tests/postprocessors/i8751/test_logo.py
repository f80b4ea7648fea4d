"""Every step that the controller makes for a drawing lies near what was wanted."""

import math

import numpy as np

from camtool.importers.read import read_drawing
from camtool.planning.job import job_of
from camtool.planning.plan import plan
from camtool.toolpath.moves import Move
from tests.oracles.corte_recto import walk
from tests.postprocessors.i8751.machines import ROOT, STEP_MM, loaded
from tests.targets import verify

LOGO = ROOT / "samples" / "logo.dxf"


def test_every_step_stays_near_what_was_wanted() -> None:
    """Within the tolerance of lines, that of arcs, and half a step in X and in Y."""
    target = loaded()
    wanted = plan(read_drawing(LOGO), job_of(), target.machine)
    program = target.target.write(wanted, target.machine)
    read = target.target.read(program.data, target.machine)
    moves = list(wanted)
    limit = 0.05 + 0.01 + math.sqrt(0.5) * STEP_MM
    worst = 0.0
    for start, row in zip(read.starts, read, strict=True):
        owner = int(program.row_of_block[row.block])
        if owner < 0 or not wanted.is_feed[owner] or row.kind > 3:
            continue
        x, y = np.rint(start[:2] / STEP_MM)
        dx, dy = (round(row.end[axis] / STEP_MM) - int(at) for axis, at in enumerate((x, y)))
        for px, py in walk(dx, dy):
            at = ((x + px) * STEP_MM, (y + py) * STEP_MM)
            worst = max(worst, distance(moves[owner], at))
    assert STEP_MM < worst <= limit
    # The verifier sees what was walked, and the fit of the drawing besides.
    report = verify(read, target.machine, wanted=wanted).report
    assert 0.9 * worst < report.error_um.total.max / 1000.0 <= worst + 1e-9


def distance(move: Move, at: tuple[float, float]) -> float:
    """mm from a place to a line, or to the circle of an arc."""
    if move.centre is not None:
        return abs(math.dist(at, move.centre) - math.dist(move.end[:2], move.centre))
    (ax, ay), (bx, by) = move.start[:2], move.end[:2]
    length = math.hypot(bx - ax, by - ay)
    if length == 0.0:
        return math.dist(at, (ax, ay))
    along = ((at[0] - ax) * (bx - ax) + (at[1] - ay) * (by - ay)) / length**2
    along = min(1.0, max(0.0, along))
    return math.dist(at, (ax + along * (bx - ax), ay + along * (by - ay)))
