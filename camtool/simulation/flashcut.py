"""The PC of the parallel-port machine: independent millisecond timers, one for each axis.

What it does with a row of the toolpath, in the order of this file and `flashcut_moves`:

1. A row becomes displacements: one of X and Y, one of Z, an arc as many chords as
   `controller.chords_per_turn` says. Each is counted from where the program was, or, with
   `controller.goes_on_from` "reached", from where the steps issued so far have led.
2. A displacement becomes steps of each axis by `controller.rounding`.
3. The timers run until the longer axis has made its steps; the shorter one makes as many as its
   own timer gives, at least what it should and often more (`camtool.kernels.timers`). With
   "programmed" nobody ever sees what is too much, and it stays for the rest of the program.
4. The half period comes from the feed and is at least `controller.half_period_ms`, where one
   axis moves alone `controller.single_axis_half_period_ms`; a step takes
   `controller.half_periods_per_step` of them, and each is a millisecond late.
5. At each change of an axis's direction the compensation steps are issued, a step's time each
   (`controller.compensation_half_period_ms`).

Every move ends: the longer axis arrives.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.kernels.lattice import HALF_STEP_GUARD
from camtool.kernels.timers import Counters, Issued, Rules, timers_fill
from camtool.machine.controllers import FlashcutController
from camtool.machine.controllers.flashcut_timers import feeds_of, shortest_ms
from camtool.machine.model import Machine, controller_of
from camtool.simulation.flashcut_moves import (
    MoveTable,
    followed,
)
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Floats, Ints, Ledger
from camtool.simulation.options import Options
from camtool.simulation.path import check_rows
from camtool.toolpath.moves import Kind, Toolpath

MOVES_AT_ONCE = 1 << 14
"""Chords and other moves that are worked on together: some 100 bytes each."""


def run(toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
    """The motion; see `camtool.simulation.models.ControllerModel`."""
    return FlashcutRun(toolpath, machine, options).run()


def held(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The moves as the program says them, homing at machine zero: the controller keeps lengths
    and rounds displacements, so that steps are part of its interpolation."""
    return followed(toolpath, machine)


def spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """A step: every step is a sample."""
    return min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)


def interpolation(toolpath: Toolpath, machine: Machine, options: Options) -> str:
    """Both axes by timers of their own."""
    return "timers"


def assumptions(toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
    """What times and figures take for granted."""
    controller = controller_of(machine, FlashcutController)
    shortest = shortest_ms(np.array([False, True]), controller)
    step_mm = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    both, one = feeds_of(shortest, step_mm, controller).tolist()
    return (
        f"a step takes {controller.half_periods_per_step} half periods of at least "
        f"{shortest[0]:g} ms (controller.half_period_ms), or {shortest[1]:g} ms where one axis "
        "moves alone (controller.single_axis_half_period_ms), each a millisecond late: no move "
        f"is faster than {both:.3g} or {one:.3g} mm/min, whatever its F",
        "the longer axis of a move keeps the feed; speeds change at once",
        f"an arc becomes {controller.chords_per_turn} chords a turn (controller.chords_per_turn)",
        f"displacements are counted from where the program {_FROM[controller.goes_on_from]} "
        "(controller.goes_on_from)",
        f"each step of a compensation has {_compensation(controller)} "
        "(controller.compensation_half_period_ms)",
    )


def _compensation(controller: FlashcutController) -> str:
    half_period = controller.compensation_half_period_ms
    return (
        "its move's half period" if half_period is None else f"a half period of {half_period} ms"
    )


_FROM = {"programmed": "was, so that steps too many stay", "reached": "has got to"}


class FlashcutRun:
    """One run of a toolpath; ProgramError for rows that the controller cannot follow."""

    def __init__(self, toolpath: Toolpath, machine: Machine, options: Options) -> None:
        controller = controller_of(machine, FlashcutController)
        path = followed(toolpath.first(toolpath.running), machine)
        check_rows(path, len(path))
        self._rows = len(path)
        self._still_s = np.where(path.kind == Kind.DWELL, path.value, 0.0)
        self._table = MoveTable.of(path, machine)
        self._mechanics = Mechanics(machine, path.start, options.effects)
        self._parts = controller.half_periods_per_step
        self._compensation_ms = controller.compensation_half_period_ms
        nearest = controller.rounding == "nearest"
        self._rules = Rules(
            origin=path.start,
            step_mm=np.array([axis.coded_step_mm for axis in machine.axes]),
            added=HALF_STEP_GUARD + (0.5 if nearest else 0.0),
            from_reached=controller.goes_on_from == "reached",
            late_longer=controller.clock == "late-longer",
        )
        self._counters = Counters(np.zeros(3, np.int64), path.start.copy(), np.zeros(8, np.int64))
        self._samples = options.chunk_steps

    def run(self) -> Iterator[Chunk]:
        """The chunks of all rows up to the end of the program."""
        made = np.concatenate([[0], np.cumsum(self._table.moves_of_row)])
        low = 0
        while low < self._rows:
            full = int(np.searchsorted(made, made[low] + MOVES_AT_ONCE, side="right")) - 1
            high = min(max(full, low + 1), self._rows)
            yield from self._window(low, high)
            low = high

    def _window(self, low: int, high: int) -> Iterator[Chunk]:
        """The chunks of the rows low:high."""
        moves = self._table.moves(low, high)
        move = done = 0  # rows from `low` on whose ledger is complete
        while done < high - low:
            issued = Issued(
                np.empty((self._samples, 3)),
                np.empty(self._samples, np.int64),
                np.zeros(high - low, np.int64),
                np.zeros((high - low, 3), np.int64),
            )
            move, filled = timers_fill(moves, move, self._rules, self._counters, issued)
            under_way = int(moves.row[move]) if move < len(moves.row) else high - low
            rows = np.arange(done, min(under_way + 1, high - low))
            yield self._chunk(low, rows, issued, filled)
            done = under_way

    def _chunk(self, low: int, rows: Ints, issued: Issued, filled: int) -> Chunk:
        """The first samples of `issued`, and what the rows low + rows did in them."""
        row, commanded = issued.row[:filled] + low, issued.commanded[:filled]
        reversals = np.zeros((len(rows), 3), dtype=np.int64)
        samples = np.zeros(len(rows), dtype=np.int64)
        slide = NO_SAMPLES
        if filled:
            offsets = np.concatenate([[0], np.flatnonzero(np.diff(row)) + 1, [filled]])
            moved = row[offsets[:-1]] - low - rows[0]
            slide, reversals[moved] = self._mechanics.follow(commanded, offsets)
            samples[moved] = np.diff(offsets)
        compensation_s = self._seconds(reversals, low + rows)
        moving_s = self._parts * issued.duration_ms[rows] / 1000.0
        ledger = Ledger(
            row=low + rows,
            duration_s=moving_s + compensation_s + self._still_s[low + rows],
            compensation_s=compensation_s,
            iterations=samples,
            steps=issued.steps[rows],
            reversals=reversals,
            ended=np.ones(len(rows), dtype=np.bool_),
        )
        return Chunk(row, commanded, slide, ledger)

    def _seconds(self, reversals: Ints, rows: Ints) -> Floats:
        """(R,) s of the compensation steps that the reversals (R, 3) of these rows cost."""
        steps = reversals * self._mechanics.compensation_steps
        half_xy, half_z = self._table.half_period_xy[rows], self._table.half_period_z[rows]
        if self._compensation_ms is not None:
            half_xy = half_z = np.full(len(rows), self._compensation_ms)
        milliseconds = (steps[:, 0] + steps[:, 1]) * (half_xy + 1) + steps[:, 2] * (half_z + 1)
        return np.asarray(self._parts * milliseconds / 1000.0)
