"""The controller on the Intel 8751: records by the dog-leg, and the ramps of its pulses.

What it does with a row of the toolpath:

1. Ends go to the nearest coded step of each axis; the controller itself knows only the steps from
   where it stands (L5246-5254), so nothing is rounded twice.
2. X and Y step together as often as the one with fewer steps, then the other one goes on alone
   (L4683-4705); Z moves after them (L4204-4222). Each of the three is a leg.
3. Each leg takes its pulses' time with their ramps: `camtool_postprocessors.i8751.pulses`,
   where the options of `[dialect]` say which reading of the thesis is meant.

It issues nothing at reversals; compensation in a machine file would be steps at the start rate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.simulation.controller import ControllerModel
from camtool.simulation.legs import LegProgram, LegRun, Legs, check_rows, coded_steps_mm, waits_s
from camtool.simulation.motion import Chunk, Options
from camtool.simulation.rows import refuse, with_ends
from camtool.simulation.step_lines import LineRun
from camtool.simulation.timing import SampleClock
from camtool.toolpath.moves import Toolpath

from .dialect import I8751Controller, I8751Dialect
from .pulses import PulseTimes

_Machine = Machine[I8751Controller, I8751Dialect]

ROWS_AT_ONCE = 1 << 14


class I8751Model(ControllerModel[I8751Controller, I8751Dialect]):
    """The Intel 8751: a dog-leg of X and Y, then Z."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """Return the motion in chunks."""
        legs, blocks = _leg_run(toolpath, machine, options)
        return legs.run(blocks)

    def fused_run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> LineRun | None:
        """Return the motion as legs of whole steps, judged in closed form; None where the
        mechanics differ from place to place."""
        legs, blocks = _leg_run(toolpath, machine, options)
        return legs.fused_run(blocks)

    def clock(self, toolpath: Toolpath, machine: _Machine) -> SampleClock:
        """Return the clock of the samples: pulse by pulse, with ramps."""
        path, times = self.quantised(toolpath, machine), PulseTimes(machine.dialect)
        travel = np.rint(
            np.diff(path.end, axis=0, prepend=path.start[None, :]) / coded_steps_mm(machine)
        ).astype(np.int64)

        def waits(row: Ints, number: Ints) -> tuple[Floats, Floats]:
            return times.around(np.abs(travel[row]), number)

        return SampleClock(path, machine, waits)

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """Return the toolpath with its start and ends at the nearest steps; ProgramError for arcs
        and homing."""
        _check(toolpath, machine)
        step_mm = coded_steps_mm(machine)
        start = _in_steps(toolpath.start[None, :], machine)[0] * step_mm
        end = toolpath.by_parts(lambda part: _in_steps(part.end, machine) * step_mm)
        return with_ends(toolpath, start, end)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "dog-leg": each record is a diagonal and then the rest along one axis."""
        return "dog-leg"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, as sentences for the report."""
        firmware = machine.dialect
        periods = PulseTimes(firmware).periods_s
        elbow = "each leg of a dog-leg has" if firmware.elbow == "ramps" else "a dog-leg has"
        delay = "its listing's cycles" if firmware.delay == "counted" else "the thesis's equation"
        return (
            f"pulses start at {1.0 / periods[0]:.2f} Hz and run at {1.0 / periods[-1]:.1f} Hz "
            f"(dialect.cruise, dialect.start_reload), by {delay} (dialect.delay)",
            f"{elbow} a ramp of its own, from 90 pulses on (dialect.elbow)",
            "the steps of the controller's own arithmetic take no time",
        )


def _leg_run(
    toolpath: Toolpath, machine: _Machine, options: Options
) -> tuple[LegRun, Iterator[Legs]]:
    """Return the run that judges a program's legs, and an iterator over the legs."""
    _check(toolpath, machine)
    count = toolpath.executed_rows
    times = PulseTimes(machine.dialect)
    start_steps = _in_steps(toolpath.start[None, :], machine)[0]
    leg_program = LegProgram(start_steps, waits_s(toolpath, count), float(times.periods_s[0]))
    return LegRun(leg_program, machine, options), _blocks(toolpath.first(count), machine, times)


def _check(toolpath: Toolpath, machine: _Machine) -> None:
    check_rows(toolpath, machine)
    arcs = toolpath.is_arc[: toolpath.executed_rows]
    refuse(toolpath, arcs, "this controller has no arcs", "write them as lines")


def _in_steps(points: Floats, machine: _Machine) -> Ints:
    """Return points (N, 3) mm as whole steps."""
    columns = [
        to_steps(points[:, column], axis.coded_step_mm) for column, axis in enumerate(machine.axes)
    ]
    return np.column_stack(columns)


def _blocks(toolpath: Toolpath, machine: _Machine, times: PulseTimes) -> Iterator[Legs]:
    """Yield the legs of all rows, in their order: X and Y together, then one of them alone, then
    Z."""
    for low in range(0, len(toolpath), ROWS_AT_ONCE):
        part = toolpath.part(low, min(low + ROWS_AT_ONCE, len(toolpath)))
        points = np.concatenate([part.start[None, :], part.end])
        steps = np.diff(_in_steps(points, machine), axis=0)
        xy = steps[:, :2]
        size, sense = np.abs(xy), np.sign(xy)
        diagonal = size.min(axis=1, keepdims=True)
        leg_steps = np.zeros((len(steps), 3, 3), dtype=np.int64)
        leg_steps[:, 0, :2] = sense * diagonal
        leg_steps[:, 1, :2] = sense * (size - diagonal)
        leg_steps[:, 2, 2] = steps[:, 2]
        seconds = np.column_stack([times.legs_s(xy), times.alone_s(steps[:, 2])])
        row, leg = np.nonzero(leg_steps.any(axis=2))
        yield Legs(low + row, leg_steps[row, leg], seconds[row, leg])
