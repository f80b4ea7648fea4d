"""The interpolators as one kind of thing: a filler that writes the next positions to a buffer.

Positions are steps: relative to the arc's centre for arcs, magnitudes from the start for lines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from camtool.kernels.approach import approach_scan, approach_start, expected_quadrants
from camtool.kernels.dda import dda_arc_fill, dda_arc_start, dda_line_fill
from camtool.kernels.direct_search import direct_search_fill, direct_search_start
from camtool.kernels.heading import rounded_radius
from camtool.kernels.stairs import stairs_fill, stairs_start
from camtool.machine.controllers import Interpolator
from camtool.simulation.motion import Ints

Filler: TypeAlias = Callable[[Ints], tuple[int, int, bool]]
"""(n, 2) buffer → rows filled, passes run, and whether the end is met with the last row."""

SEARCH_ROWS = 1 << 14
"""Positions that the search for the end looks at in one go (256 KiB, stays in the cache)."""


@dataclass(frozen=True)
class Arc:
    """An arc in steps: start (x, y) and end relative to its centre."""

    x: int
    y: int
    clockwise: bool
    end_x: int
    end_y: int


def line_filler(a: int, b: int) -> Filler:
    """A DDA line of a ≥ 0 and b ≥ 0 steps."""
    registers, counters = np.zeros(2), np.zeros(2, dtype=np.int64)

    def fill(buffer: Ints) -> tuple[int, int, bool]:
        filled, passes, done = dda_line_fill(a, b, registers, counters, buffer)
        return filled, passes, done

    return fill


def arc_filler(arc: Arc, method: Interpolator, *, rounded: bool) -> Filler:
    """An arc whose start is not its centre; `rounded`: the error at the start is that against
    the circle of the rounded radius (DSM and stairs), else 0."""
    state: Ints
    if method == "dda":
        state = dda_arc_start(arc.x, arc.y, arc.clockwise)

        def fill(buffer: Ints) -> tuple[int, int, bool]:
            filled, passes, met = dda_arc_fill(state, arc.end_x, arc.end_y, buffer)
            return filled, passes, met

        return fill
    start, run = {
        "dsm": (direct_search_start, direct_search_fill),
        "stairs": (stairs_start, stairs_fill),
    }[method]
    error = arc.x**2 + arc.y**2 - rounded_radius(arc.x, arc.y) ** 2 if rounded else 0
    state = start(arc.x, arc.y, arc.clockwise, error)

    def fill_each(buffer: Ints) -> tuple[int, int, bool]:
        filled, met = run(state, arc.end_x, arc.end_y, buffer)
        return filled, filled, met

    return fill_each


def arc_reach(arc: Arc, fill: Filler) -> tuple[int, bool]:
    """How many positions a fresh filler gives until the stop test is met, and True.

    When it is not met in the expected sweep and a quadrant more: how many until the nearest
    approach to the end there, and False. The controller then goes round at least once more, if it
    ever stops. Bounded in time and memory.
    """
    expected = expected_quadrants(arc.x, arc.y, arc.clockwise, arc.end_x, arc.end_y)
    low, high = expected - 1, expected + 1
    end = np.array([arc.end_x, arc.end_y], dtype=np.int64)
    tracker: Ints = approach_start(arc.x, arc.y, arc.end_x, arc.end_y, low)
    turn = 8 * (max(abs(arc.x), abs(arc.y)) + 1)
    buffer = np.empty((min(SEARCH_ROWS, turn), 2), dtype=np.int64)
    while True:
        filled, _, met = fill(buffer)
        approach_scan(buffer[:filled], end, tracker, low, high)
        entered, seen, nearest = int(tracker[2]), int(tracker[3]), int(tracker[4])
        if entered > high:
            return nearest, False
        if met:
            return seen, True
