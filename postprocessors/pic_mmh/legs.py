"""A whole program of the PIC controller as legs, in columns, for the compiled run that judges.

The controller goes on from the end that each row gave it, whatever became of the row; so where
every leg begins is known before any is run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Ledger
from camtool.toolpath.moves import Kind, Toolpath

from . import steps as loops

if TYPE_CHECKING:
    from camtool.kernels.judging import Sums, Task


METHODS: Final = {"dsm": loops.DSM, "stairs": loops.STAIRS, "dda": loops.DDA}
"""The numbers that the kernels know the methods of arcs by."""


def positions(toolpath: Toolpath, start: Ints, ends: Ints, home: Ints) -> Ints:
    """(N + 1, 3) steps where the controller stands before each row and after the last one."""
    kind, count = toolpath.kind, len(toolpath)
    places = np.empty((count + 1, 3), dtype=np.int64)
    for axis, homing in enumerate((Kind.HOME_XY, Kind.HOME_XY, Kind.HOME_Z)):
        goes, homes = toolpath.is_motion, kind == homing
        given = np.concatenate(
            [start[axis : axis + 1], np.where(homes, home[axis], ends[:, axis])]
        )
        latest = np.where(goes | homes, np.arange(1, count + 1), 0)
        latest = np.concatenate([[0], np.maximum.accumulate(latest)])
        places[:, axis] = given[latest]
    return places


def legs_of(toolpath: Toolpath, places: Ints, centres: Ints, stops: Ints) -> Ints:
    """(L, 14) legs of `steps` of all rows; `places` (N + 1, 3) of
    `positions`, `centres` (N, 2) steps, `stops` (N,) samples of arcs or −1."""
    count = len(toolpath)
    begin, way = places[:-1], np.diff(places, axis=0)
    flat = np.zeros((count, loops.LEG_COLUMNS), dtype=np.int64)
    flat[:, loops.ROW] = np.arange(count)
    flat[:, [loops.FROM_X, loops.FROM_Y]] = begin[:, :2]
    deep = flat.copy()
    arc = toolpath.is_arc
    flat[:, loops.KIND] = np.where(arc, loops.ARC, loops.LINE)
    about = np.where(arc[:, None], centres, begin[:, :2])
    flat[:, [loops.ORIGIN_X, loops.ORIGIN_Y]] = about
    sign = np.where((way[:, :2] < 0) & ~arc[:, None], -1, 1)
    flat[:, [loops.SIGN_X, loops.SIGN_Y]] = sign
    spoke = begin[:, :2] - centres
    flat[:, [loops.A, loops.B]] = np.where(arc[:, None], spoke, np.abs(way[:, :2]))
    flat[:, [loops.END_X, loops.END_Y]] = places[1:, :2] - about
    flat[:, loops.CW] = toolpath.kind == Kind.ARC_CW
    flat[:, loops.STOP] = stops
    deep[:, loops.KIND] = loops.DEPTH
    deep[:, [loops.FROM_X, loops.FROM_Y]] = places[1:, :2]  # XY first, then Z
    deep[:, [loops.ORIGIN_X, loops.ORIGIN_Y]] = places[1:, :2]
    deep[:, loops.A] = np.abs(way[:, 2])
    deep[:, loops.CW] = np.sign(way[:, 2])
    both = np.stack([flat, deep], axis=1).reshape(-1, loops.LEG_COLUMNS)
    moves = np.column_stack([arc | way[:, :2].any(axis=1), way[:, 2] != 0]).reshape(-1)
    return np.ascontiguousarray(both[moves])


class FusedLegs:
    """Runs the rows of a program in order, some at a time, and judges them as they are made."""

    def __init__(
        self,
        legs: Ints,
        periods_s: Floats,
        still_s: Floats,
        how: tuple[str, bool, bool, float],
        mechanics: Mechanics,
    ) -> None:
        """`legs` (L, 14); periods_s (N, 2) of an output in XY and in Z of each row; still_s (N,)
        what rows take that do not move. `how`: the method of arcs, whether their error starts as
        that of the rounded radius, whether only outputs take time, mm of a step. `mechanics` is
        plain."""
        self._legs, self._periods_s, self._still_s = legs, periods_s, still_s
        self._how, self._mechanics = how, mechanics

    @property
    def rows(self) -> int:
        """How many rows there are to run."""
        return len(self._still_s)

    def judge(self, low: int, high: int, task: Task, sums: Sums) -> Ledger:
        """Run the rows low:high, which follow those run before, and judge them."""

        method, rounded, by_event, step_mm = self._how
        first, last = np.searchsorted(self._legs[:, loops.ROW], [low, high])
        legs = self._legs[first:last]
        counts = np.zeros((len(legs), loops.COUNT_COLUMNS), dtype=np.int64)
        number = METHODS[method]
        mechanics = self._mechanics.axes, self._mechanics.states
        loops.judge_legs(legs, (number, rounded), step_mm, mechanics, counts, task, sums)
        row = legs[:, loops.ROW] - low
        deep = (legs[:, loops.KIND] == loops.DEPTH).astype(np.int64)
        reversals = counts[:, loops.REVERSALS : loops.REVERSALS + 3]
        added = reversals @ self._mechanics.compensation_steps
        outputs = counts[:, loops.SAMPLES if by_event else loops.PASSES]
        period_s = self._periods_s[low + row, deep]
        count = high - low
        missed = np.bincount(row[counts[:, loops.ENDED] == 0], minlength=count)
        steps = counts[:, loops.STEPS : loops.STEPS + 3]
        return Ledger(
            row=np.arange(low, high),
            duration_s=self._still_s[low:high]
            + np.bincount(row, (outputs + added) * period_s, minlength=count),
            compensation_s=np.asarray(np.bincount(row, added * period_s, minlength=count) * 1.0),
            iterations=_summed(row, counts[:, loops.PASSES : loops.PASSES + 1], count)[:, 0],
            steps=_summed(row, steps, count),
            reversals=_summed(row, reversals, count),
            ended=missed == 0,
        )


def _summed(row: Ints, numbers: Ints, count: int) -> Ints:
    """(count, C) sums of the columns of numbers (L, C) by row (L,)."""
    sums = np.zeros((count, numbers.shape[1]), dtype=np.int64)
    np.add.at(sums, row, numbers)
    return sums
