"""What the kernel of the Matlab router's slaves is told and keeps: arrays, and their columns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Ints = npt.NDArray[np.int64]
Floats = npt.NDArray[np.float64]

GAIN, TAU, FRICTION, KID, KPD, CHUNK, PHASE, HOME_SPEED = range(8)
"""Columns of `Program.axes`."""

PLACE, SPEED, BEGIN, DONE, DRIVE, SPEED_BEFORE = range(6)
"""Columns of `State.motors`: counts, counts in a tick, moments in ticks, percent, for the text."""

COUNT, UP, WRAPS, STAGE, LEFT, SHOWN, SEEN, SUM, REF, NEXT_REF, TARGET = range(11)
"""Columns of `State.slaves`."""

STILL, WAITING, CRUISING, SLOWING, HOMING, FOLLOWING = range(6)
"""What a slave does, in its column STAGE; FOLLOWING is the text's way of running a line."""

FIRST_ROW, SECOND_ROW, MOST_TICKS, PART_AXIS, PART_COUNT = 6, 7, 8, 9, 10
"""Columns of `Program.lines` behind the amounts and the speeds of three axes."""

HOME_AMOUNT = -1
"""The amount of an axis that goes home."""

TURN = 1024
"""Counts that an encoder shows; the program takes 1023 for each."""

TABLE_COUNTS = 1000
"""The last counts of a line, which run by the table."""

NEVER = 1 << 40
"""More counts than any motion has."""


class Program(NamedTuple):
    """What the slaves are told, and what they are.

    lines (L, 11): amount of each axis (chunks; counts when `text`; `HOME_AMOUNT`; 0), its speed
    with sign, the row of its samples, the row of those from where an axis (its number) has passed
    a count on, the ticks after which it is given up, that axis and that count. pauses (L,) ticks
    behind each, at least 1; axes (3, 8); table (1001,); lag: ticks by which Y begins after X;
    text: the chapters' way instead of the listing's.
    """

    lines: Ints
    pauses: Floats
    axes: Floats
    table: Ints
    lag: float
    text: bool


class State(NamedTuple):
    """Where everything stands between two calls: motors (3, 6), slaves (3, 11); clock (3,): tick,
    line, row of the line before; begin (2,) of the line and of its second row, in ticks."""

    motors: Floats
    slaves: Ints
    clock: Ints
    begin: Floats


class Account(NamedTuple):
    """What rows did so far: ticks (N,) that they took, loops (N,) of the slaves, ended (N,)."""

    ticks: Floats
    loops: Ints
    ended: npt.NDArray[np.bool_]
