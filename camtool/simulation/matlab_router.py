"""The slaves of the Matlab router: speed loops with integers behind lines of whole chunks.

What the machine does with the rows of a toolpath:

1. The master runs them one at a time: a row's distance per axis, in tenths of a millimetre, and
   its speed per axis, in counts of the encoder in 5 ms, go to the slaves, which start together
   (Y a little after X) and stop each by itself. Rows of one program line are one such order.
2. Distances are differences: where an axis comes to stand beside its place, it goes on from there.
   Only homing brings it back to its zero.
3. Each slave runs as `camtool.kernels.slaves` says. A line ends when all have had their counts;
   the motors still coast then, and are sampled on until the next line begins.

A sample is the place of all motors at a tick of 5 ms. `docs/controllers/matlab-router.md` has the
sources, and what is inferred.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from camtool.errors import ProgramError
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import MatlabRouterController
from camtool.machine.model import Machine, controller_of
from camtool.simulation.matlab_router_lines import Lines, block_of, lines_of
from camtool.simulation.matlab_router_program import (
    SIGNS,
    TICK_S,
    account_of,
    program_of,
    state_of,
)
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Ints, Ledger
from camtool.simulation.options import Options
from camtool.simulation.path import placed
from camtool.toolpath.moves import Toolpath

FARTHEST_UNITS = 32767
"""Distances from home are an int16 of tenths of a millimetre (L4625-4635)."""

UNIT_MM = 0.1
"""What the program counts in (L3202-3204)."""


def run(toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
    """The motion; see `camtool.simulation.models.ControllerModel`."""
    return _Run(toolpath, machine, options).run()


def held(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The same with all ends on whole counts from home, homing at home. ProgramError for arcs,
    which no slave has, and for what lies farther from home than the program can say."""
    if toolpath.is_arc.any():
        raise ProgramError(
            "this machine has no arcs",
            where=block_of(toolpath, int(toolpath.is_arc.argmax())),
            mend="post the drawing for it: arcs become lines then",
        )
    home = np.array(machine.controller.machine_zero_mm)
    far = (np.abs(toolpath.end - home) > FARTHEST_UNITS * UNIT_MM).any(axis=1)
    if far.any():
        raise ProgramError(
            "a position is beyond all that the controller can count",
            where=block_of(toolpath, int(far.argmax())),
        )
    end = placed(toolpath, home).end
    coded = [axis.coded_step_mm for axis in machine.axes]
    columns = [to_steps((end - home)[:, index], step) * step for index, step in enumerate(coded)]
    return replace(toolpath, end=home + np.column_stack(columns))


def spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """What an axis goes in a tick at the highest feed of the machine or of the program."""
    feeds = toolpath.feed[np.isfinite(toolpath.feed)]
    fastest = min(float(feeds.max(initial=0.0)), machine.max_feed_mm_min)
    rapid = machine.rapid_mm_min if np.isfinite(machine.rapid_mm_min) else 0.0
    step = min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    return max(step, max(fastest, rapid) / 60.0 * TICK_S)


def interpolation(toolpath: Toolpath, machine: Machine, options: Options) -> str:
    """Each axis by itself, by its speed loop."""
    return "servo"


def assumptions(toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
    """What times and figures take for granted."""
    router = controller_of(machine, MatlabRouterController)
    law = "slave X's program" if router.slaves == "listing" else "the program that the text tells"
    rub = "no" if not any(router.friction_percent) else "dry"
    return (
        f"each slave runs {law} on all axes (controller.slaves)",
        f"the motors are of first order, with {rub} friction (controller.plant_gain,"
        " time_constant_s, friction_percent)",
        f"the speeds of the last 1000 counts are a root up to {router.table_counts} counts"
        " (controller.table_counts): the thesis does not list them",
        f"{1e3 * router.turnaround_s:g} ms between lines, {1e3 * router.pause_s:g} ms behind"
        " homing and plunges (controller.turnaround_s, pause_s)",
        "homing is even and ends at rest on machine zero",
    )


class _Run:
    """One run of a toolpath; ProgramError for rows that the controller cannot follow."""

    def __init__(self, toolpath: Toolpath, machine: Machine, options: Options) -> None:
        path = held(toolpath, machine)
        self._rows = path.running
        self._lines: Lines = lines_of(path, self._rows, machine)
        self._program = program_of(self._lines.orders, self._lines.pauses_s, machine)
        self._state = state_of(path.start, machine)
        self._account = account_of(self._rows)
        self._mechanics = Mechanics(machine, path.start, options.effects)
        self._home = np.array(machine.controller.machine_zero_mm)
        coded = np.array([axis.coded_step_mm for axis in machine.axes])
        self._count_mm = SIGNS * coded
        self._count: Ints = self._state.slaves[:, 0].copy()
        self._samples = options.chunk_steps

    def run(self) -> Iterator[Chunk]:
        """The chunks of all rows up to the end of the program."""
        from camtool.kernels.slave_record import SECOND_ROW
        from camtool.kernels.slaves import slaves_fill

        complete, finished = 0, False
        while not finished:
            out = np.empty((self._samples, 3), dtype=np.int64)
            row = np.empty(self._samples, dtype=np.int64)
            filled, finished = slaves_fill(self._program, self._state, self._account, out, row)
            row = row[:filled]
            closed = int(self._state.clock[1])
            going = int(self._lines.orders[closed - 1, SECOND_ROW]) + 1 if closed else 0
            going = self._rows if finished else going
            last = max(going, int(row[-1]) + 1) if filled else going
            if filled or last > complete:
                yield self._chunk((complete, going, last), row, out[:filled])
            complete = going

    def _chunk(self, span: tuple[int, int, int], row: Ints, count: Ints) -> Chunk:
        """The samples of a chunk; `span`: rows up to the first are accounted for already, those up
        to the second are complete, those up to the third have samples."""
        first, complete, last = span
        first = min(first, int(row[0])) if len(row) else first
        rows = np.arange(first, last)
        offsets = np.searchsorted(row, np.arange(first, last + 1))
        commanded = self._home + count * self._count_mm
        slide, reversals = NO_SAMPLES, np.zeros((len(rows), 3), dtype=np.int64)
        if len(row):
            slide, reversals = self._mechanics.follow(commanded, offsets)
        whole = (rows >= span[0]) & (rows < complete)
        seconds = np.where(
            whole, self._account.ticks[rows] * TICK_S + self._lines.extra_s[rows], 0
        )
        ledger = Ledger(
            row=rows,
            duration_s=seconds,
            compensation_s=np.zeros(len(rows)),
            iterations=np.diff(offsets),
            steps=self._travelled(count, offsets),
            reversals=reversals,
            ended=~whole | self._account.ended[rows],
        )
        return Chunk(row, commanded, slide, ledger)

    def _travelled(self, count: Ints, offsets: Ints) -> Ints:
        """(R, 3) counts from tick to tick of each run, on from where the last chunk ended."""
        along = np.concatenate([self._count[None, :], count])
        self._count = along[-1]
        way = np.abs(np.diff(along, axis=0)).cumsum(axis=0)
        total = np.concatenate([np.zeros((1, 3), dtype=np.int64), way])
        return np.asarray(np.diff(total[offsets], axis=0))
