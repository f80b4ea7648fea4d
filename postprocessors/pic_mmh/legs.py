"""A whole program of the PIC controller as legs, in columns, for the compiled run that judges.

The controller goes on from the end that each row gave it, whatever became of the row; so where
every leg begins is known before any is run."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Ledger
from camtool.toolpath.moves import Kind, Toolpath, are_arcs

from . import steps as loops

if TYPE_CHECKING:
    from camtool.kernels.judging import Sums, Task


METHODS: Final = {"dsm": loops.DSM, "stairs": loops.STAIRS, "dda": loops.DDA}
"""The numbers that the kernels know the methods of arcs by."""


def positions(toolpath: Toolpath, start: Ints, ends: Ints, home: Ints) -> Ints:
    """Return (N + 1, 3) steps: where the controller stands before each row, and after the last
    one."""
    kind, count = toolpath.kind, len(toolpath)
    places = np.empty((count + 1, 3), dtype=np.int64)
    for axis, homing in enumerate((Kind.HOME_XY, Kind.HOME_XY, Kind.HOME_Z)):
        goes, homes = toolpath.is_motion, kind == homing
        given_places = np.concatenate(
            [start[axis : axis + 1], np.where(homes, home[axis], ends[:, axis])]
        )
        latest = np.where(goes | homes, np.arange(1, count + 1), 0)
        latest = np.concatenate([[0], np.maximum.accumulate(latest)])
        places[:, axis] = given_places[latest]
    return places


class CommandedPath(Struct, frozen=True, eq=False):
    """Path that the controller is to follow: `places` (N + 1, 3) of `positions`, `centres` (N, 2)
    steps of the arcs among the rows of the toolpath, `stops` (N,) samples of arcs or −1."""

    toolpath: Toolpath
    places: Ints
    centres: Ints
    stops: Ints

    def legs(self, low: int, high: int) -> Ints:
        """Return the legs (L, 14) of the rows low:high, in the columns of `steps`."""
        places, centres = self.places[low : high + 1], self.centres[low:high]
        kind = self.toolpath.kind[low:high]
        begin, travel = places[:-1], np.diff(places, axis=0)
        flat = np.zeros((len(kind), loops.LEG_COLUMNS), dtype=np.int64)
        flat[:, loops.ROW] = np.arange(low, low + len(kind))
        flat[:, [loops.FROM_X, loops.FROM_Y]] = begin[:, :2]
        deep_legs = flat.copy()
        arc = are_arcs(kind)
        flat[:, loops.KIND] = np.where(arc, loops.ARC, loops.LINE)
        centres_or_begins = np.where(arc[:, None], centres, begin[:, :2])
        flat[:, [loops.ORIGIN_X, loops.ORIGIN_Y]] = centres_or_begins
        sign = np.where((travel[:, :2] < 0) & ~arc[:, None], -1, 1)
        flat[:, [loops.SIGN_X, loops.SIGN_Y]] = sign
        spoke = begin[:, :2] - centres
        flat[:, [loops.A, loops.B]] = np.where(arc[:, None], spoke, np.abs(travel[:, :2]))
        flat[:, [loops.END_X, loops.END_Y]] = places[1:, :2] - centres_or_begins
        flat[:, loops.CW] = kind == Kind.ARC_CW
        flat[:, loops.STOP] = self.stops[low:high]
        deep_legs[:, loops.KIND] = loops.DEPTH
        deep_legs[:, [loops.FROM_X, loops.FROM_Y]] = places[1:, :2]  # XY first, then Z
        deep_legs[:, [loops.ORIGIN_X, loops.ORIGIN_Y]] = places[1:, :2]
        deep_legs[:, loops.A] = np.abs(travel[:, 2])
        deep_legs[:, loops.CW] = np.sign(travel[:, 2])
        legs = np.stack([flat, deep_legs], axis=1).reshape(-1, loops.LEG_COLUMNS)
        moves = np.column_stack([arc | travel[:, :2].any(axis=1), travel[:, 2] != 0]).reshape(-1)
        return np.ascontiguousarray(legs[moves])


class Periods(Struct, frozen=True, eq=False):
    """Seconds between two outputs: `rapid_s` in rapids, at least `least_s` in all other rows;
    `step_mm` (2,) in XY and in Z."""

    rapid_s: float
    least_s: float
    step_mm: Floats

    def of(self, toolpath: Toolpath, low: int, high: int) -> Floats:
        """Return (high − low, 2) seconds between outputs, in XY and in Z, in each of the rows
        low:high."""
        with np.errstate(divide="ignore", invalid="ignore"):
            feed_s = 60.0 * self.step_mm[None, :] / toolpath.feed[low:high, None]
            feed_s = np.maximum(feed_s, self.least_s)
        kind = toolpath.kind[low:high]
        feeds = (kind >= Kind.LINE) & (kind <= Kind.ARC_CCW)
        return np.where(feeds[:, None], feed_s, self.rapid_s)


class FusedLegs:
    """Runs the rows of a program in order, some at a time, and judges them as they are made."""

    def __init__(
        self,
        course: CommandedPath,
        rows: int,
        periods: Periods,
        options: tuple[str, bool, bool, float],
        mechanics: Mechanics,
    ) -> None:
        """Prepare the first `rows` rows of the course. `options`: the method of arcs, whether
        their error starts as that of the rounded radius, whether only outputs take time, mm of a
        step. `mechanics` must be plain."""
        self._course, self._rows, self._periods = course, rows, periods
        self._how, self._mechanics = options, mechanics

    @property
    def rows(self) -> int:
        """Number of rows to run."""
        return self._rows

    def judge(self, low: int, high: int, task: Task, sums: Sums) -> Ledger:
        """Run the rows low:high, which follow those run before, and judge them; return their
        ledger."""
        method, rounded, by_event, step_mm = self._how
        legs = self._course.legs(low, high)
        counts = np.zeros((len(legs), loops.COUNT_COLUMNS), dtype=np.int64)
        number = METHODS[method]
        mechanics = self._mechanics.axes, self._mechanics.states
        loops.judge_legs(legs, (number, rounded), step_mm, mechanics, counts, task, sums)
        row = legs[:, loops.ROW] - low
        is_deep = (legs[:, loops.KIND] == loops.DEPTH).astype(np.int64)
        reversals = counts[:, loops.REVERSALS : loops.REVERSALS + 3]
        added = reversals @ self._mechanics.compensation_steps
        outputs = counts[:, loops.SAMPLES if by_event else loops.PASSES]
        count, toolpath = high - low, self._course.toolpath
        period_s = self._periods.of(toolpath, low, high)[row, is_deep]
        waits = toolpath.kind[low:high] == Kind.DWELL
        unended = np.bincount(row[counts[:, loops.ENDED] == 0], minlength=count)
        steps = counts[:, loops.STEPS : loops.STEPS + 3]
        return Ledger(
            row=np.arange(low, high),
            duration_s=np.where(waits, toolpath.value[low:high], 0.0)
            + np.bincount(row, (outputs + added) * period_s, minlength=count),
            compensation_s=np.asarray(np.bincount(row, added * period_s, minlength=count) * 1.0),
            iterations=_sums_by_row(row, counts[:, loops.PASSES : loops.PASSES + 1], count)[:, 0],
            steps=_sums_by_row(row, steps, count),
            reversals=_sums_by_row(row, reversals, count),
            ended=unended == 0,
        )


def _sums_by_row(row: Ints, numbers: Ints, count: int) -> Ints:
    """Return (count, C) for each row the sums of the columns of `numbers` (L, C), which belong to
    the rows `row` (L,)."""
    sums = np.zeros((count, numbers.shape[1]), dtype=np.int64)
    np.add.at(sums, row, numbers)
    return sums
