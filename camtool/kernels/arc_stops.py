"""Where an arc of the PIC18F8720 stops, by each reading of its test (L1859-1862).

The thesis says that after each iteration the controller looks whether the end is reached and
whether the quadrant changes, and that it knows the final quadrant. It does not say how:

    EQUAL            both coordinates equal the end's, wherever that is: a path that misses the end
                     goes round again, mostly for ever
    FINAL_QUADRANT   in the quadrant of the end (so many changes after the start as the sweep has)
                     both coordinates have reached the end's or are past it, in the directions of
                     that quadrant; or the path leaves that quadrant
    NEAREST          at the step nearest to the end, on the turn that is expected

A path that stands on the end on its expected turn stops there by all three: in one quadrant both
coordinates run one way, so no step before it has reached both.

Exact: integers. Compiled, because it looks at every step of an arc.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.kernels.approach import approach_scan, expected_quadrants
from camtool.kernels.compiled import bare, inner, kernel
from camtool.kernels.heading import heading
from camtool.kernels.leg_steps import (
    ARC,
    CW,
    END_X,
    END_Y,
    KIND,
    LEG_COLUMNS,
    STATE,
    A,
    B,
    fill_leg,
    start_leg,
)

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

EQUAL, FINAL_QUADRANT, NEAREST = range(3)
"""Readings."""

READINGS = {"equal": EQUAL, "final-quadrant": FINAL_QUADRANT, "nearest": NEAREST}
"""Their names, as in `controller.arc_end`."""

SAMPLES, STOP_X, STOP_Y, MET = range(4)
"""Columns of a stop: samples up to it, where it is about the centre, and whether it is the end."""

STOP_COLUMNS = 4
"""How many columns."""

LOOKED_AT = 1 << 12
"""Positions that are looked at in one go."""


class Room(NamedTuple):
    """Arrays to work in: positions (2 · `LOOKED_AT`,), registers (2,) and state (8,) of an
    interpolator, tracker (6,) of `camtool.kernels.approach`."""

    path: Ints
    registers: Floats
    state: Ints
    tracker: Ints


@bare
def _passes(path: Ints, leg: Ints, tracker: Ints, expected: int) -> int:
    """At which of the positions (n, 2) an arc stops in its final quadrant, or −1; `tracker` as in
    `camtool.kernels.approach`."""
    x, y, entered = tracker[0], tracker[1], tracker[2]
    end_x, end_y = leg[END_X], leg[END_Y]
    to_x, to_y = heading(end_x, end_y, leg[CW] != 0)
    found = -1
    for k in range(len(path)):
        if (path[k, 0] == 0 and x != 0) or (path[k, 1] == 0 and y != 0):
            entered += 1
        x, y = path[k, 0], path[k, 1]
        reached = to_x * (x - end_x) >= 0 and to_y * (y - end_y) >= 0
        if entered > expected or (entered == expected and reached):
            found = k
            break
    tracker[0], tracker[1], tracker[2] = x, y, entered
    return found


@inner
def _stop(leg: Ints, how: tuple[int, bool, int], room: Room, out: Ints) -> None:
    """Fill `out` (4,) for one arc that does not start at its centre."""
    method, rounded, reading = how
    state, tracker, registers = room.state, room.tracker, room.registers
    end = leg[END_X : END_Y + 1]
    start_leg(leg, method, rounded, state)
    registers[0] = registers[1] = 0.0
    expected = expected_quadrants(leg[A], leg[B], leg[CW] != 0, leg[END_X], leg[END_Y])
    low, high = expected - 1, expected + 1
    tracker[0], tracker[1], tracker[2] = leg[A], leg[B], 0
    tracker[3], tracker[4] = 0, 0
    tracker[5] = -1 if low > 0 else (leg[A] - end[0]) ** 2 + (leg[B] - end[1]) ** 2
    out[SAMPLES], out[STOP_X], out[STOP_Y], out[MET] = 0, leg[A], leg[B], 0
    size = min(LOOKED_AT, 8 * (max(abs(leg[A]), abs(leg[B])) + 1))
    buffer, seen = room.path[: 2 * size].reshape(2, size).T, 0
    while True:
        filled, _, met = fill_leg(leg, method, state, registers, buffer)
        at = -1
        if reading == FINAL_QUADRANT:
            at = _passes(buffer[:filled], leg, tracker, expected)
        else:
            best = tracker[4]
            approach_scan(buffer[:filled], end, tracker, low, high)
            if tracker[4] != best:
                out[SAMPLES] = tracker[4]
                out[STOP_X], out[STOP_Y] = (
                    buffer[tracker[4] - seen - 1, 0],
                    buffer[tracker[4] - seen - 1, 1],
                )
            if tracker[2] > high:
                return
            if met and (reading == EQUAL or tracker[2] >= low):
                at = filled - 1
        if at >= 0:
            out[SAMPLES], out[STOP_X], out[STOP_Y] = seen + at + 1, buffer[at, 0], buffer[at, 1]
            out[MET] = int(buffer[at, 0] == end[0] and buffer[at, 1] == end[1])
            return
        seen += filled


@kernel
def arc_stops(legs: Ints, how: tuple[int, bool, int], out: Ints) -> None:
    """Fill `out` (L, 4) for each arc of legs (L, 14) by itself; 0 in other rows.

    `how`: the method of arcs (`camtool.kernels.leg_steps`), whether their error starts as that
    against the rounded radius, and the reading. An arc that misses its end by `EQUAL` has the stop
    of `NEAREST`, and MET = 0.
    """
    room = Room(
        np.empty(2 * LOOKED_AT, np.int64),
        np.zeros(2),
        np.zeros(STATE, np.int64),
        np.zeros(6, np.int64),
    )
    for number in range(len(legs)):
        leg = legs[number]
        out[number, 0] = out[number, 1] = out[number, 2] = out[number, 3] = 0
        if leg[KIND] == ARC and (leg[A] != 0 or leg[B] != 0):
            _stop(leg, how, room, out[number])


@kernel
def run_on(
    moves: Ints, start: Ints, ends: Ints, centres: Ints, how: tuple[int, bool, int], samples: Ints
) -> None:
    """The rows of a program, each from where the one before has really stopped.

    `moves` (N,): 0 where X and Y stay, 1 for a line, 2 and 3 for an arc counter-clockwise and
    clockwise; `start` (2,), `ends` (N, 2), `centres` (N, 2) steps. Ends of arcs become their
    stops, and rows that were to stay where they were stay there; `samples` (N,) becomes that of
    each arc, −1 where a row is none.
    """
    room = Room(
        np.empty(2 * LOOKED_AT, np.int64),
        np.zeros(2),
        np.zeros(STATE, np.int64),
        np.zeros(6, np.int64),
    )
    leg, out = np.zeros(LEG_COLUMNS, np.int64), np.zeros(STOP_COLUMNS, np.int64)
    leg[KIND] = ARC
    x, y = start[0], start[1]
    said_x, said_y = x, y
    for row in range(len(moves)):
        samples[row] = -1
        if moves[row] == 0:
            continue
        end_x, end_y = ends[row, 0], ends[row, 1]
        if moves[row] == 1:
            if end_x == said_x and end_y == said_y:
                ends[row, 0], ends[row, 1] = x, y
        else:
            leg[A], leg[B] = x - centres[row, 0], y - centres[row, 1]
            leg[END_X], leg[END_Y] = end_x - centres[row, 0], end_y - centres[row, 1]
            leg[CW] = int(moves[row] == 3)
            if leg[A] != 0 or leg[B] != 0:
                _stop(leg, how, room, out)
                samples[row] = out[SAMPLES]
                ends[row, 0] = out[STOP_X] + centres[row, 0]
                ends[row, 1] = out[STOP_Y] + centres[row, 1]
        said_x, said_y = end_x, end_y
        x, y = ends[row, 0], ends[row, 1]
