"""Search for ends of arc blocks at which the controller really stops.

How the controller knows the end of an arc is not described (L1859-1862), nor with which error D it
starts; by the strictest reading it stops only when it stands exactly on the end step. Start, end
and centre are rounded each on its own: with such numbers nearly half of all arcs never stand
there. So the writer follows the controller's own paths (`steps`), one for each start of D,
from the step where the controller will stand, and lets the block end on a step that all of them
pass: there every reading stops. A line closes the gap to the wanted end.

Two such paths lie about circles whose radii differ by half a step at most. Each is the best of
the lattice beside its circle, so they part only for runs, longest where they run along an axis:
there the run of one distance from the axis is some √R steps, no longer than a line may be.

How many iterations n an arc of length L (in steps) takes: each iteration moves one step along X,
along Y or along both, so n ≥ L/√2; and direct search follows the axis that moves faster, which
makes one step of it per iteration, so n = ∫ max(|cos|, |sin|) ds ≤ L. The wanted end, if the path
meets it, is met about there; the factors `EARLIEST` and `LATEST` leave room for the rounded
radius.

Every number is exact: whole steps, and radii below 2²⁴. Compiled, because each of thousands of
arcs looks at hundreds of steps; C types stand in the .pxd beside this file.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.arrays import Floats, Ints

from .steps import (
    NOWHERE,
    direct_search_run,
    first_at,
    heading,
    nearest_to,
    rounded_radius,
    skip,
)

EARLIEST, LATEST = 0.6, 1.1
WINDOW_SLACK = 4
"""The end is searched from EARLIEST·L − slack to LATEST·L + slack iterations."""

MAX_LEAD_ITERATIONS = 16
"""Largest difference in iterations, up to a step, between paths with different starts of D: they
may be one step apart at each of eight diagonals, and at the start."""

MIN_RADIUS_STEPS = 4.0
"""An arc of a smaller radius is written as lines: its path has too few steps to be an arc."""

(START_X, START_Y, END_X, END_Y, CENTRE_X, CENTRE_Y, CLOCKWISE) = range(7)
"""Columns of an arc, in steps: where the controller stands and the wanted end, about its centre;
the centre, which only serves to find the steps that can be written."""

LANDING_X, LANDING_Y, ITERATION = range(3)
"""Columns of a landing: the step about the centre at which the arc block ends, and its iteration,
−1 where there is none."""


class LandingSearch:
    """Parameters and scratch buffers of the search for landings: the form's units per step and its
    largest number of units; a state (5,), and buffers for the positions of a path with D = 0 at
    the start and for the mask of those that reverse no axis."""

    def __init__(self, units_per_step: float, most_units: int, room: int) -> None:
        self.units_per_step, self.most_units = units_per_step, most_units
        self.state = np.zeros(5, np.int64)
        self.path_x, self.path_y = np.empty(room, np.int64), np.empty(room, np.int64)
        self.onward = np.empty(room, np.int64)


def land(
    arcs: Ints, sweeps: Floats, units_per_step: float, most_units: int, sagitta: float
) -> Ints:
    """(N, 3) landings of arcs (N, 7) with wanted sweeps (N,) > 0 rad: where to end each.

    At its end if all paths meet it; otherwise in this order: the last step from which the closing
    line goes on without turning an axis round (each such reversal costs the machine a whole
    compensation) and does not leave the arc by more than `sagitta` steps; the step nearest to the
    end within that reach; the last step that can be written at all. None when lines do as well:
    the whole arc lies within that reach, or no step of its paths can be written.
    """
    room = 1
    for k in range(len(arcs)):
        room = max(room, _reach(_radius(arcs[k, START_X], arcs[k, START_Y]), sagitta))
    search = LandingSearch(units_per_step, most_units, room)
    out = np.zeros((len(arcs), 3), dtype=np.int64)
    for k in range(len(arcs)):
        out[k, ITERATION] = -1
        if _radius(arcs[k, START_X], arcs[k, START_Y]) >= MIN_RADIUS_STEPS:
            _land(arcs[k], sweeps[k], sagitta, search, out[k])
    return np.asarray(out)


def _radius(x: int, y: int) -> float:
    """Steps; the root of a whole number, and so nearest to the truth."""
    return math.sqrt(float(x * x + y * y))


def _reach(radius: float, sagitta: float) -> int:
    """Iterations before the end within which one line may replace the rest of the arc.

    A chord c leaves its arc by the sagitta s ≈ c²/(8R), so c = √(8 R s); a path piece of n
    iterations is at most √2·n long.
    """
    return max(1, int(math.sqrt(4.0 * radius * sagitta)))


def _begin(arc: Ints, error: int, state: Ints) -> None:
    """Set the state to the start of the arc, with this D."""
    x, y = arc[START_X], arc[START_Y]
    sx, sy = heading(x, y, arc[CLOCKWISE] != 0)
    state[0], state[1], state[2], state[3], state[4] = x, y, error, sx, sy


def _hits(arc: Ints, x: int, y: int, low: int, high: int, state: Ints) -> int:
    """The iteration in low … high at which the controller, D = 0 at the start, would stop if the
    block's end were (x, y); −1 when it would not, or not about there with the other start of D,
    which is that against the rounded radius."""
    _begin(arc, 0, state)
    met = first_at(state, x, y, high)
    if met < low:
        return -1
    radius = rounded_radius(arc[START_X], arc[START_Y])
    error = arc[START_X] * arc[START_X] + arc[START_Y] * arc[START_Y] - radius * radius
    if error != 0:
        _begin(arc, error, state)
        other = first_at(state, x, y, met + MAX_LEAD_ITERATIONS)
        if other < max(1, met - MAX_LEAD_ITERATIONS):
            return -1
    return met


def _represents(steps: int, search: LandingSearch) -> bool:
    """True if a whole number of units means this step."""
    size = abs(steps)
    units = int(size * search.units_per_step + 0.5)
    return units <= search.most_units and int(units / search.units_per_step + 0.5) == size


def _lands(arc: Ints, row: int, first: int, search: LandingSearch) -> bool:
    """True if position `row` of the path, which began behind iteration `first`, can be written and
    the controller stops there and not earlier, whatever D was."""
    x, y = search.path_x[row], search.path_y[row]
    if not _represents(x + arc[CENTRE_X], search) or not _represents(y + arc[CENTRE_Y], search):
        return False
    iteration = first + row + 1
    return _hits(arc, x, y, iteration, iteration, search.state) == iteration


def _follow(arc: Ints, first: int, count: int, search: LandingSearch) -> None:
    """The positions after the iterations first + 1 … first + count, D = 0 at the start."""
    _begin(arc, 0, search.state)
    skip(search.state, first)
    path_x, path_y = search.path_x[:count], search.path_y[:count]
    direct_search_run(search.state, NOWHERE, NOWHERE, path_x, path_y)


def _mark_onward(arc: Ints, count: int, search: LandingSearch) -> None:
    """From which of the positions the line to the arc's end turns no axis round.

    The direction of an axis is that of its last step on the path. Before its first one it is that
    of the motion, which at (x, y) is along (y, −x) clockwise; 0 (exactly there) allows both.
    """
    path_x, path_y = search.path_x, search.path_y
    turn = 1 if arc[CLOCKWISE] != 0 else -1
    along_x, along_y = turn * path_y[0], -turn * path_x[0]
    for k in range(count):
        if k > 0 and path_x[k] != path_x[k - 1]:
            along_x = path_x[k] - path_x[k - 1]
        if k > 0 and path_y[k] != path_y[k - 1]:
            along_y = path_y[k] - path_y[k - 1]
        on_x, on_y = (arc[END_X] - path_x[k]) * along_x, (arc[END_Y] - path_y[k]) * along_y
        search.onward[k] = 1 if on_x >= 0 and on_y >= 0 else 0


def _store_landing(row: int, first: int, search: LandingSearch, out: Ints) -> None:
    """Store the landing at this position."""
    out[LANDING_X], out[LANDING_Y] = search.path_x[row], search.path_y[row]
    out[ITERATION] = first + row + 1


def _land(arc: Ints, sweep_rad: float, sagitta: float, search: LandingSearch, out: Ints) -> None:
    """Fill `out` (3,) for one arc (7,), as `land` says; left alone when there is no landing."""
    radius = _radius(arc[START_X], arc[START_Y])
    end_x, end_y = arc[END_X], arc[END_Y]
    latest = math.ceil(LATEST * (radius * sweep_rad))
    low = max(1, int(EARLIEST * (radius * sweep_rad)) - WINDOW_SLACK)
    high = int(latest) + WINDOW_SLACK
    met = _hits(arc, end_x, end_y, low, high, search.state)
    if met >= 0:
        out[LANDING_X], out[LANDING_Y], out[ITERATION] = end_x, end_y, met
        return
    _begin(arc, 0, search.state)
    near, _ = nearest_to(search.state, end_x, end_y, low, high)
    first = max(0, near - _reach(radius, sagitta))
    count = near - first
    _follow(arc, first, count, search)
    _mark_onward(arc, count, search)
    for row in range(count - 1, -1, -1):
        if search.onward[row] == 1 and _lands(arc, row, first, search):
            _store_landing(row, first, search, out)
            return
    if first == 0:
        return
    least = -1
    for row in range(count - 1, -1, -1):
        off_x, off_y = search.path_x[row] - end_x, search.path_y[row] - end_y
        square = off_x * off_x + off_y * off_y
        nearer = search.onward[row] == 0 and (least < 0 or square < least)
        if nearer and _lands(arc, row, first, search):
            least = square
            _store_landing(row, first, search, out)
    if least >= 0:
        return
    upto, room = first, len(search.path_x)
    while upto > 0:
        first = max(0, upto - room)
        count = upto - first
        _follow(arc, first, count, search)
        for row in range(count - 1, -1, -1):
            if _lands(arc, row, first, search):
                _store_landing(row, first, search, out)
                return
        upto = first
