"""Whole rows of the PIC18F8720's program, run and judged in one go, block by block.

The positions of a leg (`camtool.kernels.leg_steps`) go to a small buffer, the slides follow
(`camtool.kernels.play_blocks`), and the block is judged (`camtool.kernels.judge`) before the next
one is made: nothing is kept of the steps themselves.

An arc runs for as many samples as are known (`camtool.kernels.arc_stops`), or until it stands on
its end. One that passes it must stop at its nearest approach, so near the end, on the turn that is
expected, the arc is first run ahead to see what becomes of it
(`arc_reach` of `camtool_postprocessors.pic_mmh.controller` does that with whole arcs, always). A
path of direct search or stairs is never farther than one step from the circle through its start;
so the end, when it is within `NEAR_RADIUS` of that circle, is passed within `NEAR_STEPS`, and no
nearest approach lies outside. Other arcs are run ahead from their start.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.kernels.approach import approach_scan, expected_quadrants
from camtool.kernels.compiled import bare, kernel
from camtool.kernels.judge import BENCH_ROWS, BLOCK, SLIDE_X, Sums, Task, X, judge_block
from camtool.kernels.leg_steps import (
    ARC,
    CW,
    DDA,
    DEPTH,
    DSM,
    END_X,
    END_Y,
    FROM_X,
    FROM_Y,
    KIND,
    LINE,
    ORIGIN_X,
    ORIGIN_Y,
    ROW,
    SIGN_X,
    SIGN_Y,
    STATE,
    STOP,
    A,
    B,
    fill_leg,
    start_leg,
    turn_round,
)
from camtool.kernels.play_blocks import STILL, TURNING, play_block, way_of

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

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


class Room(NamedTuple):
    """Arrays to work in: bench of the judge; path (2 · `RUN_AHEAD`,) steps; the state (8,) of an
    interpolator and a copy of it; tracker (6,) and registers (2,) of what runs."""

    bench: Floats
    path: Ints
    state: Ints
    other: Ints
    tracker: Ints
    registers: Floats


@bare
def _copy(from_: Ints, to: Ints) -> None:
    for k in range(len(to)):
        to[k] = from_[k]


@bare
def _run_ahead(
    leg: Ints, method: int, entered: int, window: tuple[int, int], room: Room
) -> tuple[int, bool]:
    """How many positions there are from the present state to the end, and True; or to the
    nearest approach to it in the quadrants `window`, and False. `entered` quadrants lie behind."""
    low, high = window
    tracker, end, state = room.tracker, leg[END_X : END_Y + 1], room.other
    _copy(room.state, state)
    square = (state[0] - end[0]) ** 2 + (state[1] - end[1]) ** 2
    tracker[0], tracker[1], tracker[2] = state[0], state[1], entered
    tracker[3], tracker[4], tracker[5] = 0, 0, square if entered >= low else -1
    size = min(RUN_AHEAD, 8 * (max(abs(leg[A]), abs(leg[B])) + 1))
    buffer, registers = room.path[: 2 * size].reshape(2, size).T, room.registers
    while True:
        filled, _, met = fill_leg(leg, method, state, registers, buffer)
        approach_scan(buffer[:filled], end, tracker, low, high)
        if tracker[2] > high:
            return tracker[4], False
        if met:
            return tracker[3], True


@bare
def _ways(
    leg: Ints, method: int, states: tuple[Ints, Ints], at: tuple[int, int], path: Ints
) -> tuple[int, int]:
    """Which way X and Y run on the positions (n, 2) after `at`; `states` before and after them.

    A line runs one way. So does a path of direct search between its quadrants, and what makes
    signs come back is a whole turn: more than a block, when the circle is larger than that.
    """
    before, after = states
    at_x, at_y = at
    known, sign_x, sign_y = leg[KIND] == LINE, leg[SIGN_X], leg[SIGN_Y]
    if method == DSM and leg[KIND] == ARC and max(abs(at_x), abs(at_y)) > BLOCK:
        known = before[3] == after[3] and before[4] == after[4]
        sign_x, sign_y = after[3], after[4]
    if not known or len(path) == 0:
        return way_of(at_x, path[:, 0]), way_of(at_y, path[:, 1])
    last = len(path) - 1
    way_x = STILL if path[last, 0] == at_x else sign_x
    return way_x, STILL if path[last, 1] == at_y else sign_y


@bare
def _is_near(low: int, high: int, end: int) -> bool:
    """Whether low … high, in either order, comes within `NEAR_STEPS` of the end."""
    return min(low, high) <= end + NEAR_STEPS and max(low, high) >= end - NEAR_STEPS


@bare
def _passed(
    leg: Ints, x: int, y: int, path: tuple[Ints, Ints], ways: tuple[int, int]
) -> tuple[int, bool]:
    """How many quadrants the positions (n,) enter that follow (x, y), and whether they may be
    near the end. A coordinate that runs one way becomes 0 once at most."""
    path_x, path_y = path
    if ways[0] != TURNING and ways[1] != TURNING:
        to_x, to_y = path_x[-1], path_y[-1]
        entered = int(x != 0 and x * to_x <= 0) + int(y != 0 and y * to_y <= 0)
        return entered, _is_near(x, to_x, leg[END_X]) and _is_near(y, to_y, leg[END_Y])
    entered, near = 0, False
    for k in range(len(path_x)):
        if (path_x[k] == 0 and x != 0) or (path_y[k] == 0 and y != 0):
            entered += 1
        x, y = path_x[k], path_y[k]
        near = near or (_is_near(x, x, leg[END_X]) and _is_near(y, y, leg[END_Y]))
    return entered, near


@bare
def _follow(
    leg: Ints,
    axis: int,
    way: int,
    steps: Ints,
    at: int,
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    bench: Floats,
) -> None:
    """Let the slide of X or Y follow `steps` (n,) about the origin of the leg, which run `way`
    from `at` on, and count."""
    commanded, slide = bench[X + axis, : len(steps)], bench[SLIDE_X + axis, : len(steps)]
    origin = leg[ORIGIN_X + axis]
    for k in range(len(steps)):
        commanded[k] = (origin + steps[k]) * step_mm
    axes, states = mechanics
    counts[REVERSALS + axis] += play_block(way, commanded, axes[axis], states[axis], slide)
    way_on = abs(steps[-1] - at)
    if way == TURNING:
        way_on = abs(steps[0] - at)
        for k in range(1, len(steps)):
            way_on += abs(steps[k] - steps[k - 1])
    counts[STEPS + axis] += way_on


@bare
def _deepen(leg: Ints, state: Floats, counts: Ints) -> None:
    """Count a leg of Z, whose `state` (6,) need not say where the slide is."""
    counts[STEPS + 2] = leg[A]
    if state[1] != leg[CW]:
        state[1] = leg[CW]
        counts[REVERSALS + 2] = 1


@kernel
def judge_legs(
    legs: Ints,
    how: tuple[int, bool],
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    counts: Ints,
    task: Task,
    sums: Sums,
) -> None:
    """Run and judge legs (L, 14) in order; `counts` (L, 9) is filled.

    `how`: the method of arcs, and whether their error starts as that against the rounded radius;
    `mechanics`: axes (3, 5) and states (3, 6) of `camtool.kernels.play`, which go on.
    """
    method, rounded = how
    room = Room(
        np.empty((BENCH_ROWS, BLOCK)),
        np.empty(2 * RUN_AHEAD, np.int64),
        np.zeros(STATE, np.int64),
        np.zeros(STATE, np.int64),
        np.zeros(6, np.int64),
        np.zeros(2),
    )
    for number in range(len(legs)):
        leg, count = legs[number], counts[number]
        if leg[KIND] != ARC or leg[A] != 0 or leg[B] != 0:
            start_leg(leg, method, rounded, room.state)
            _judge_leg(leg, method, step_mm, mechanics, count, task, sums, room)


@bare
def _judge_leg(
    leg: Ints,
    method: int,
    step_mm: float,
    mechanics: tuple[Floats, Floats],
    count: Ints,
    task: Task,
    sums: Sums,
    room: Room,
) -> None:
    """Run and judge a leg from the state in `room` on."""
    arc, x, y = leg[KIND] == ARC, leg[A], leg[B]
    room.registers[0] = room.registers[1] = 0.0
    at_x, at_y = leg[FROM_X] - leg[ORIGIN_X], leg[FROM_Y] - leg[ORIGIN_Y]
    careful, low, high = False, 0, 0
    if arc:
        expected = expected_quadrants(x, y, leg[CW] != 0, leg[END_X], leg[END_Y])
        low, high = expected - 1, expected + 1
        apart = abs(math.hypot(x, y) - math.hypot(leg[END_X], leg[END_Y]))
        careful = method == DDA or apart > NEAR_RADIUS or max(abs(x), abs(y)) < LEAST_RADIUS
    entered, left, met = 0, -1, False
    if arc and leg[STOP] >= 0:
        left, count[ENDED] = leg[STOP], 1
    while left != 0 and not (left < 0 and met):
        if careful and left < 0:
            left, met = _run_ahead(leg, method, entered, (low, high), room)
            count[ENDED] = int(met)
            continue
        _copy(room.state, room.other)
        size = BLOCK if left < 0 or left >= BLOCK else left
        buffer = room.path[: 2 * size].reshape(2, size).T
        filled, passes, met = fill_leg(leg, method, room.state, room.registers, buffer)
        path_x, path_y = buffer[:, 0][:filled], buffer[:, 1][:filled]
        if not arc:
            turn_round(leg, path_x, path_y)
        way_x, way_y = _ways(leg, method, (room.other, room.state), (at_x, at_y), buffer[:filled])
        if left >= 0:
            left -= filled
        elif arc:
            more, near = _passed(leg, at_x, at_y, (path_x, path_y), (way_x, way_y))
            if entered + more > high or (near and entered + more >= low and not met):
                _copy(room.other, room.state)
                careful, met = True, False
                continue
            entered += more
        count[PASSES] += passes
        count[SAMPLES] += filled
        if left < 0:
            count[ENDED] = int(met)
        if filled == 0:
            continue
        _follow(leg, 0, way_x, path_x, at_x, step_mm, mechanics, count, room.bench)
        _follow(leg, 1, way_y, path_y, at_y, step_mm, mechanics, count, room.bench)
        at_x, at_y = path_x[-1], path_y[-1]
        judge_block(leg[ROW], filled, task, sums, room.bench)
    if leg[KIND] == DEPTH:
        _deepen(leg, mechanics[1][2], count)
    elif arc:  # the controller takes itself to stand on the end that it was given
        mechanics[1][0, 0] = (leg[ORIGIN_X] + leg[END_X]) * step_mm
        mechanics[1][1, 0] = (leg[ORIGIN_Y] + leg[END_Y]) * step_mm
