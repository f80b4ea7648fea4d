"""Where the tool comes from, so that no axis has play left in front of it when a cut begins.

The tool goes down where it last moved to in XY. If each axis came there in the direction in which
the cut first drives it, and over more than its play, its slide is engaged from the first step of
the cut on, and the controller has nothing to compensate. An axis that the cut does not drive
comes in the direction that leaves the smaller error: always the same one, so that holes and lines
along the other axis keep their distances. All of this happens above the stock.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Polyline
from camtool.machine.model import Axis, Machine
from camtool.planning.items import Run
from camtool.planning.reversing.residual import Residual, loosest, residuals
from camtool.planning.reversing.turns import parts_of, turns_of

APPROACH_MARGIN_MM = 0.05
"""An approach is longer by this much than what compensation leaves of the play: the play is not
the same all over a table (that of the PIC machine by 14 µm in X and 28 µm in Y, L2370-2373)."""

REVERSAL_STEPS = 0.5
"""An axis has turned round when it came back by this much of a coded step, as the simulation of
controllers that follow paths has it."""

Point = tuple[float, float]


def approach_from(run: Run, machine: Machine) -> Point | None:
    """Where the tool goes first (x, y) mm, at safe z, on its way to the first point of a run.

    None where neither axis has play or compensation. The place lies beside the run, nearer than
    the play and `APPROACH_MARGIN_MM` on each axis. Nothing keeps it within the travel: a nearer
    one would not do, and the toolpath that holds it is checked as a whole.
    """
    return Approaches(machine)(run)


class Approaches:
    """`approach_from` for runs that are cut one after the other, with nothing between them but
    the way up, across and down (a tool change needs a fresh one): an axis that still stands
    engaged from the run before goes straight to the start. Play is the largest of all regions."""

    def __init__(self, machine: Machine) -> None:
        self._drives = [
            _Drive(axis, residual)
            for axis, residual in zip(loosest(machine), residuals(machine), strict=True)
        ]

    def __call__(self, run: Run) -> Point | None:
        """Where the tool goes first; None: straight to the first point of the run."""
        path = flat(run.vertices)
        places = run.vertices[:1, :2] if path is None else parts_of(path).places
        x, y = (
            drive.before(places[:, index].tolist()) for index, drive in enumerate(self._drives)
        )
        return None if (x, y) == (places[0, 0], places[0, 1]) else (x, y)


class _Drive:
    """One axis on its way: where it is, in which direction ±1 it moved last, and since where."""

    def __init__(self, axis: Axis, residual: Residual) -> None:
        self._residual = residual
        self._least_mm, self._need_mm = least_turn_mm(axis), approach_mm(axis)
        self._at = self._since = math.nan
        self._sense = 0

    def before(self, values: list[float]) -> float:
        """Where the axis comes from to a run that takes it to these values, mm: their first one
        when it comes from anywhere. It has cut the run then."""
        start, sense = values[0], self._first_sense(values)
        since = self._since if sense == self._sense else self._at
        engaged = (start - self._at) * sense >= 0.0 and (start - since) * sense >= self._need_mm
        come = start
        if self._residual.matters and not engaged:
            come = start - sense * self._need_mm
        for value in (come, *values):
            self._go(value)
        return come

    def _first_sense(self, values: list[float]) -> int:
        """The direction in which a run first drives the axis; the better one when it does not."""
        if len(values) == 1:
            return self._residual.better
        sense = turns_of(np.array(values), False, self._least_mm).sense
        moving = np.flatnonzero(sense)
        return int(sense[moving[0]]) if len(moving) else self._residual.better

    def _go(self, value: float) -> None:
        way = value - self._at
        if not way * self._sense >= 0.0:
            self._since, self._sense = self._at, 1 if way > 0.0 else -1
        self._at = value


def approach_mm(axis: Axis) -> float:
    """How far an axis must be driven in one direction until its slide follows for certain: what
    the controller's compensation leaves of the play, and the margin."""
    return max(axis.backlash_mm - axis.compensation_mm, 0.0) + APPROACH_MARGIN_MM


def least_turn_mm(axis: Axis) -> float:
    """How far back an axis must go to turn round."""
    return REVERSAL_STEPS * axis.coded_step_mm


def flat(vertices: Floats) -> Polyline | None:
    """A run (n, 4) of x, y, z, bulge seen from above, without the moves that lead nowhere there;
    None when it stays at one place."""
    kept: list[Floats] = []
    for vertex in vertices[:, [0, 1, 3]]:
        if kept and np.hypot(*(vertex[:2] - kept[-1][:2])) <= POSITION_EPS_MM:
            kept.pop()  # the later one knows the bulge of the move that leads away
        kept.append(vertex)
    return Polyline(np.array(kept)) if len(kept) > 1 else None
