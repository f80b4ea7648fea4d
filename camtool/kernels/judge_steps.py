"""Whole rows of the PIC18F8720's program, run and judged in one go, block by block.

A leg is what one interpolator makes: a line of X and Y, an arc, or a line of Z. Its positions go
to a small buffer, the slides follow (`camtool.kernels.play_blocks`), and the block is judged
(`camtool.kernels.judge`) before the next one is made: nothing is kept of the steps themselves.

An arc runs until it stands on its end. One that passes it must stop at its nearest approach, so
near the end, on the turn that is expected, the arc is first run ahead to see what becomes of it
(`camtool.simulation.interpolators.arc_reach` does that with whole arcs, always). A path of direct
search or stairs is never farther than one step from the circle through its start; so the end,
when it is within `NEAR_RADIUS` of that circle, is passed within `NEAR_STEPS`, and no nearest
approach lies outside. Other arcs are run ahead from their start.

Exact: integers, as in the kernels that fill the buffer. Compiled, since rows may have three steps.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from camtool.kernels.approach import approach_scan, expected_quadrants
from camtool.kernels.dda import dda_arc_fill, dda_arc_start, dda_line_fill
from camtool.kernels.direct_search import direct_search_fill, direct_search_start
from camtool.kernels.heading import rounded_radius
from camtool.kernels.inner import inner
from camtool.kernels.judge import BLOCK, Bench, Sums, Task, judge_block, new_bench
from camtool.kernels.play_blocks import TURNING, play_block, way_of
from camtool.kernels.stairs import stairs_fill, stairs_start

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

ROW, KIND, FROM_X, FROM_Y, A, B, ORIGIN_X, ORIGIN_Y, SIGN_X, SIGN_Y, END_X, END_Y, CW = range(13)
"""Columns of a leg, in steps: the row; what it is; where X and Y stand before; how far a line
goes (of Z: in A, its sign in CW), or where an arc starts about its centre; the start of a
line or the centre of an arc, and the signs that its positions are taken with; the end of an arc
about its centre; whether it is clockwise."""

LEG_COLUMNS = 13
"""How many columns."""

LINE, ARC, DEPTH = range(3)
"""Kinds of legs."""

DSM, STAIRS, DDA = range(3)
"""Methods of arcs."""

SAMPLES, PASSES, STEPS, REVERSALS, ENDED = 0, 1, 2, 5, 8
"""Columns of the counts of a leg: samples, passes, steps X Y Z, reversals X Y Z, ended."""

COUNT_COLUMNS = 9
"""How many columns."""

NEAR_RADIUS = 4.0
"""Steps that the end of an arc may be off the circle through its start."""

NEAR_STEPS = 8
"""Within so many steps, in X and in Y, of its end an arc is run ahead."""

LEAST_RADIUS = 16
"""Smaller arcs are run ahead from their start."""

RUN_AHEAD = 1 << 12
"""Positions that are looked at in one go when an arc is run ahead."""


@inner
def _room(count: int) -> Ints:
    """(count, 2) whose columns are whole."""
    return np.empty((2, count), np.int64).T


@inner
def _start(leg: Ints, method: int, rounded: bool) -> Ints:
    """The state (8,) at the start of an arc."""
    x, y, clockwise = leg[A], leg[B], leg[CW] != 0
    state = np.zeros(8, np.int64)
    error = x * x + y * y - rounded_radius(x, y) ** 2 if rounded else 0
    if method == DSM:
        state[:5] = direct_search_start(x, y, clockwise, error)
    elif method == STAIRS:
        state[:5] = stairs_start(x, y, clockwise, error)
    else:
        state[:] = dda_arc_start(x, y, clockwise)
    return state


@inner
def _fill(leg: Ints, method: int, state: Ints, out: Ints) -> tuple[int, int, bool]:
    """Rows filled, passes run, whether the last one is the end."""
    if method == DDA:
        filled, passes, met = dda_arc_fill(state, leg[END_X], leg[END_Y], out)
        return filled, passes, met
    if method == DSM:
        filled, met = direct_search_fill(state, leg[END_X], leg[END_Y], out)
    else:
        filled, met = stairs_fill(state, leg[END_X], leg[END_Y], out)
    return filled, filled, met


@inner
def _run_ahead(
    leg: Ints, method: int, state: Ints, entered: int, window: tuple[int, int]
) -> tuple[int, bool]:
    """How many positions there are from `state` to the end, and True; or to the nearest approach
    to it in the quadrants `window`, and False. `entered` quadrants lie behind."""
    low, high = window
    end = np.array([leg[END_X], leg[END_Y]])
    square = (state[0] - end[0]) ** 2 + (state[1] - end[1]) ** 2
    tracker = np.array([state[0], state[1], entered, 0, 0, square if entered >= low else -1])
    ahead = state.copy()
    buffer = _room(min(RUN_AHEAD, 8 * (max(abs(leg[A]), abs(leg[B])) + 1)))
    while True:
        filled, _, met = _fill(leg, method, ahead, buffer)
        approach_scan(buffer[:filled], end, tracker, low, high)
        if tracker[2] > high:
            return tracker[4], False
        if met:
            return tracker[3], True


@inner
def _is_near(low: int, high: int, end: int) -> bool:
    """Whether low … high, in either order, comes within `NEAR_STEPS` of the end."""
    return min(low, high) <= end + NEAR_STEPS and max(low, high) >= end - NEAR_STEPS


@inner
def _passed(leg: Ints, x: int, y: int, path: Ints) -> tuple[int, bool]:
    """How many quadrants the positions `path` (n, 2) enter that follow (x, y), and whether they
    may be near the end. A coordinate that runs one way becomes 0 once at most."""
    way_x, way_y = way_of(x, path[:, 0]), way_of(y, path[:, 1])
    if way_x != TURNING and way_y != TURNING:
        to_x, to_y = path[-1, 0], path[-1, 1]
        entered = int(x != 0 and x * to_x <= 0) + int(y != 0 and y * to_y <= 0)
        return entered, _is_near(x, to_x, leg[END_X]) and _is_near(y, to_y, leg[END_Y])
    entered, near = 0, False
    for k in range(len(path)):
        if (path[k, 0] == 0 and x != 0) or (path[k, 1] == 0 and y != 0):
            entered += 1
        x, y = path[k, 0], path[k, 1]
        near = near or (_is_near(x, x, leg[END_X]) and _is_near(y, y, leg[END_Y]))
    return entered, near


@inner
def _take(
    leg: Ints,
    path: Ints,
    at: Ints,
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
    bench: Bench,
) -> None:
    """Let the slides follow `path` (n, 2) from `at` (2,) steps on, count, and judge."""
    axes, states = mechanics
    count = len(path)
    for axis in range(2):
        steps = path[:, axis]
        origin, sign = leg[ORIGIN_X + axis], leg[SIGN_X + axis]
        commanded = (bench.x if axis == 0 else bench.y)[:count]
        slide = (bench.slide_x if axis == 0 else bench.slide_y)[:count]
        for k in range(len(steps)):
            steps[k] = origin + sign * steps[k]
            commanded[k] = steps[k] * step_mm
        way = way_of(at[axis], steps)
        counts[REVERSALS + axis] += play_block(way, commanded, axes[axis], states[axis], slide)
        way_on = abs(steps[-1] - at[axis])
        if way == TURNING:
            way_on = abs(steps[0] - at[axis])
            for k in range(1, len(steps)):
                way_on += abs(steps[k] - steps[k - 1])
        counts[STEPS + axis] += way_on
        at[axis] = steps[-1]
    counts[SAMPLES] += count
    judge_block(leg[ROW], count, task, sums, bench)


@inner
def _judge_line(
    leg: Ints,
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
    bench: Bench,
) -> None:
    registers, counters = np.zeros(2), np.zeros(2, np.int64)
    at = leg[FROM_X : FROM_Y + 1].copy()
    deep = leg[KIND] == DEPTH
    buffer, done = _room(BLOCK), False
    while not done:
        filled, passes, done = dda_line_fill(leg[A], leg[B], registers, counters, buffer)
        counts[PASSES] += passes
        if deep:
            buffer[:filled, 0], buffer[:filled, 1] = leg[FROM_X], leg[FROM_Y]
        if filled > 0:
            path = buffer if filled == BLOCK else _first(buffer, filled)
            _take(leg, path, at, step_mm, mechanics, counts, task, sums, bench)
    counts[ENDED] = 1
    if deep:
        state = mechanics[1][2]
        counts[STEPS + 2] = leg[A]
        if state[1] != leg[CW]:
            state[1] = leg[CW]
            counts[REVERSALS + 2] = 1


@inner
def _first(buffer: Ints, count: int) -> Ints:
    """The first rows of a buffer, in one whose columns are whole."""
    path = _room(count)
    path[:, 0] = buffer[:count, 0]
    path[:, 1] = buffer[:count, 1]
    return path


@inner
def _judge_arc(
    leg: Ints,
    how: tuple[int, bool],
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
    bench: Bench,
) -> None:
    method, rounded = how
    x, y = leg[A], leg[B]
    if x == 0 and y == 0:
        return
    expected = expected_quadrants(x, y, leg[CW] != 0, leg[END_X], leg[END_Y])
    low, high = expected - 1, expected + 1
    apart = abs(math.hypot(x, y) - math.hypot(leg[END_X], leg[END_Y]))
    careful = method == DDA or apart > NEAR_RADIUS or max(abs(x), abs(y)) < LEAST_RADIUS
    state = _start(leg, method, rounded)
    at = leg[FROM_X : FROM_Y + 1].copy()
    entered, left, met = 0, -1, False
    whole = _room(BLOCK)
    while left != 0 and not (left < 0 and met):
        if careful and left < 0:
            left, met = _run_ahead(leg, method, state, entered, (low, high))
            counts[ENDED] = int(met)
            continue
        buffer = whole if left < 0 or left >= BLOCK else _room(left)
        before = state.copy()
        filled, passes, met = _fill(leg, method, state, buffer)
        path = buffer if filled == len(buffer) else _first(buffer, filled)
        if left < 0:
            more, near = _passed(leg, before[0], before[1], path)
            if entered + more > high or (near and entered + more >= low and not met):
                state[:], careful, met = before, True, False
                continue
            entered += more
            counts[ENDED] = int(met)
        else:
            left -= filled
        counts[PASSES] += passes
        _take(leg, path, at, step_mm, mechanics, counts, task, sums, bench)
    # The controller takes itself to stand on the end that it was given.
    mechanics[1][0, 0] = (leg[ORIGIN_X] + leg[END_X]) * step_mm
    mechanics[1][1, 0] = (leg[ORIGIN_Y] + leg[END_Y]) * step_mm


@njit(cache=True)
def judge_legs(
    legs: Ints,
    how: tuple[int, bool],
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
) -> None:
    """Run and judge legs (L, 13) in order; `counts` (L, 9) is filled.

    `how`: the method of arcs, and whether their error starts as that against the rounded radius;
    `mechanics`: axes (3, 5) and states (3, 6) of `camtool.kernels.play`, which go on.
    """
    bench = new_bench()
    for k in range(len(legs)):
        leg = legs[k]
        if leg[KIND] == ARC:
            _judge_arc(leg, how, step_mm, mechanics, counts[k], task, sums, bench)
        else:
            _judge_line(leg, step_mm, mechanics, counts[k], task, sums, bench)
