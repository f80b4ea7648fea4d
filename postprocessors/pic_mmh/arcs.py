"""Where an arc block may end, so that the controller really stops there.

How the controller knows the end of an arc is not described (L1859-1862), nor with which error D it
starts; by the strictest reading it stops only when it stands exactly on the end step. Start, end
and centre are rounded each on its own: with such numbers nearly half of all arcs never stand
there. So the writer follows the controller's own paths (camtool.kernels), one for each start of D,
from the step where the controller will stand, and lets the block end on a step that all of them
pass: there every reading stops (`steps`). A line
closes the gap to the wanted end.

Two such paths lie about circles whose radii differ by half a step at most. Each is the best of
the lattice beside its circle, so they part only for runs, longest where they run along an axis:
there the run of one distance from the axis is some √R steps, no longer than a line may be.

How many iterations n an arc of length L (in steps) takes: each iteration moves one step along X,
along Y or along both, so n ≥ L/√2; and direct search follows the axis that moves faster, which
makes one step of it per iteration, so n = ∫ max(|cos|, |sin|) ds ≤ L. The wanted end, if the path
meets it, is met about there; the factors of `WINDOW` leave room for the rounded radius.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from camtool.arrays import Bools, Floats, Ints

from .numbers import Grid
from .steps import (
    direct_search_hits,
    direct_search_nearest,
    direct_search_path,
)

WINDOW: Final = (0.6, 1.1)
WINDOW_SLACK: Final = 4
"""The end is searched from WINDOW[0]·L − slack to WINDOW[1]·L + slack iterations."""

APART: Final = 16
"""Another start of D may take this many iterations more or less to a step: the paths may be one
step apart at each of eight diagonals, and at the start."""

LEAST_RADIUS_STEPS: Final = 4.0
"""An arc of a smaller radius is written as lines: its path has too few steps to be an arc."""

LINE_SAGITTA: Final = 1.0
"""A line that replaces a piece of arc may deviate from it by this many resolutions (the coarser of
step and unit); it bounds how far before its end an arc may be left for its closing line."""


@dataclass(frozen=True)
class Arc:
    """An arc in the controller's steps, relative to its centre.

    `start` is where the controller stands, `end` the wanted end, `sweep_rad` > 0 the wanted
    sweep; `centre` (absolute) only serves to find the steps that can be written.
    """

    start: tuple[int, int]
    end: tuple[int, int]
    centre: tuple[int, int]
    clockwise: bool
    sweep_rad: float

    @property
    def errors(self) -> tuple[int, ...]:
        """The values of D that the controller may start with: 0, or against the rounded radius."""
        x, y = self.start
        rounded = x * x + y * y - round(self.radius) ** 2
        return (0, rounded) if rounded else (0,)

    @property
    def radius(self) -> float:
        """Steps."""
        return math.hypot(*self.start)


@dataclass(frozen=True)
class Landing:
    """The step (relative to the centre) at which the arc block ends, and its iteration."""

    at: tuple[int, int]
    iteration: int


def hits(arc: Arc, at: tuple[int, int], low: int, high: int) -> int:
    """The iteration in low … high at which the controller, D = 0 at the start, would stop if the
    block's end were `at`; −1 when it would not, or not there with any other start of D."""
    found = -1
    for error in arc.errors:
        met = int(direct_search_hits(*arc.start, arc.clockwise, *at, high, error))
        if met < low:
            return -1
        if found < 0:
            found, low, high = met, max(1, met - APART), met + APART
    return found


def land(arc: Arc, grid: Grid) -> Landing | None:
    """Where to end the arc: at its end if the paths meet it, otherwise at a step before it.

    In this order: the end itself; the last step from which the closing line goes on without
    turning an axis round (each such reversal costs the machine a whole compensation) and does not
    leave the arc by more than `LINE_SAGITTA`; the step nearest to the end within that reach; the
    last step that can be written at all. None when lines do as well: the whole arc lies within
    that reach, or no step of its paths can be written.
    """
    length = arc.radius * arc.sweep_rad
    low = max(1, math.floor(WINDOW[0] * length) - WINDOW_SLACK)
    high = math.ceil(WINDOW[1] * length) + WINDOW_SLACK
    met = hits(arc, arc.end, low, high)
    if met >= 0:
        return Landing(arc.end, met)
    state = (*arc.start, arc.clockwise)
    near = int(direct_search_nearest(*state, *arc.end, low, high)[0])
    first = max(0, near - _reach(arc, grid))
    path, common = _common(arc, first, near - first)
    common &= _representable(arc, grid, path)
    onward = common & _onward(arc, path)
    for row in np.flatnonzero(onward)[::-1].tolist():
        if landing := _landing(arc, path, row, first):
            return landing
    if first == 0:
        return None
    rest = np.flatnonzero(common & ~onward)[::-1]
    square = ((path[rest] - np.array(arc.end)) ** 2).sum(axis=1)
    for row in rest[np.argsort(square, kind="stable")].tolist():
        if landing := _landing(arc, path, row, first):
            return landing
    path, common = _common(arc, 0, first)
    for row in np.flatnonzero(common & _representable(arc, grid, path))[::-1].tolist():
        if landing := _landing(arc, path, row, 0):
            return landing
    return None


def _common(arc: Arc, first: int, count: int) -> tuple[Ints, Bools]:
    """The path (count, 2) after the iterations first + 1 … first + count, D = 0 at the start, and
    which of its steps the paths of all other starts of D pass as well."""
    state = (*arc.start, arc.clockwise)
    path = direct_search_path(*state, first, count, 0)
    common = np.ones(count, dtype=np.bool_)
    for error in arc.errors[1:]:
        low = max(0, first - APART)
        other = direct_search_path(*state, low, first - low + count + APART, error)
        common &= np.isin(_numbered(path), _numbered(other))
    return path, common


def _numbered(points: Ints) -> Ints:
    """A number for each of the points (K, 2), whose coordinates stay below 2³¹."""
    return np.asarray((points[:, 0] << 32) + points[:, 1])


def _reach(arc: Arc, grid: Grid) -> int:
    """Iterations before the end within which one line may replace the rest of the arc.

    A chord c leaves its arc by the sagitta s ≈ c²/(8R), so c = √(8 R s); a path piece of n
    iterations is at most √2·n long.
    """
    sagitta = LINE_SAGITTA * grid.resolution_mm / grid.step_mm
    return max(1, math.floor(math.sqrt(4.0 * arc.radius * sagitta)))


def _representable(arc: Arc, grid: Grid, path: Ints) -> Bools:
    """Which steps of the path the form can represent in both axes."""
    return np.asarray(grid.represents(path + np.array(arc.centre)).all(axis=1))


def _onward(arc: Arc, path: Ints) -> Bools:
    """From which steps of the path the line to the arc's end turns no axis round.

    The direction of an axis is that of its last step on the path. Before its first one it is that
    of the motion, which at (x, y) is along (y, −x) clockwise; 0 (exactly there) allows both.
    """
    turn = 1 if arc.clockwise else -1
    moved = np.empty_like(path)
    moved[0] = turn * np.sign(path[0, 1]), -turn * np.sign(path[0, 0])
    moved[1:] = np.diff(path, axis=0)
    rows = np.arange(len(path))[:, None]
    last = np.maximum.accumulate(np.where(moved != 0, rows, 0), axis=0)
    direction = np.take_along_axis(moved, last, axis=0)
    return np.asarray(((np.array(arc.end) - path) * direction >= 0).all(axis=1))


def _landing(arc: Arc, path: Ints, row: int, first: int) -> Landing | None:
    """The landing at this row, unless the controller comes there earlier and would stop then."""
    at = (int(path[row, 0]), int(path[row, 1]))
    iteration = first + row + 1
    return Landing(at, iteration) if hits(arc, at, iteration, iteration) == iteration else None


def turned_rad(start: Floats, at: Floats, centre: Floats, clockwise: bool) -> float:
    """The sweep from `start` to `at` ((2,) each) about `centre`, in (0, 2π]; a full turn when
    the two are one."""
    out, now = start - centre, at - centre
    cross = out[0] * now[1] - out[1] * now[0]
    angle = math.atan2(-cross if clockwise else cross, float(out @ now)) % (2.0 * math.pi)
    return angle or 2.0 * math.pi


def expected_turn_rad(landing: Landing, radius_steps: float) -> float:
    """About how far the arc has turned at its landing: n ≈ (2√2/π)·R·turn on the average of all
    directions, and never off by more than a quarter of the turn."""
    return landing.iteration * math.pi / (2.0 * math.sqrt(2.0) * radius_steps)


def unwrapped_rad(turn: float, expected: float) -> float:
    """The turn with that full number of turns added that brings it nearest to the expected."""
    full = 2.0 * math.pi
    return turn + full * round((expected - turn) / full)


def chord_ends(start: Floats, centre: Floats, sweep_rad: float, sagitta_mm: float) -> Floats:
    """(k, 2) mm: the ends of the fewest equal chords within `sagitta_mm` of an arc.

    `start`, `centre` (2,) mm; signed sweep. A chord over the angle a strays by R (1 − cos(a/2));
    no chord turns by more than a right angle.
    """
    out = start - centre
    radius = float(np.hypot(*out))
    ratio = min(1.0, sagitta_mm / radius) if radius > 0.0 else 1.0
    widest = min(math.pi / 2.0, 2.0 * math.acos(1.0 - ratio))
    count = max(1, math.ceil(abs(sweep_rad) / widest))
    angle = math.atan2(out[1], out[0]) + sweep_rad * np.arange(1, count + 1) / count
    return np.asarray(centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
