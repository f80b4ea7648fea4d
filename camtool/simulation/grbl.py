"""grbl 1.1: arcs as chords, lines of whole steps, speeds planned some blocks ahead.

What it does with a program, in the order of the files:

1. Numbers become 32-bit floats, arcs the ends of chords (`grbl_chords`).
2. Targets become steps and blocks (`grbl_blocks`); each block is a Bresenham line in X, Y and Z
   at once (`camtool.kernels.step_lines`). Its smoothing (AMASS) shifts steps of the slower axes
   within an event; at the end of each event the axes stand where they do without it.
3. Speeds: limits of the axes, corners by junction deviation, the ring of blocks
   (`camtool.kernels.lookahead`), trapezoids (`speed_plan`). They change times, not positions.

Positions are absolute: a row starts at the step where the one before ended, and no rounding adds
up. grbl compensates no play.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from camtool.errors import MachineError
from camtool.kernels.step_lines import step_lines_fill, steps_taken
from camtool.machine.controllers import GrblController
from camtool.machine.model import Machine, controller_of
from camtool.simulation.grbl_blocks import Blocks, blocks_of, speeds_of, stops
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Chunk, Floats, Ints
from camtool.simulation.options import Options
from camtool.simulation.path import check_positions, check_rows, placed
from camtool.simulation.row_chunks import RowTotals, row_chunks
from camtool.toolpath.moves import Kind, Toolpath

ALWAYS_ON = 255
"""The $1 that leaves the motors on, and holds nothing at a stop."""

DWELL_STEP_S = 0.05
"""Dwells are counted in whole steps of this, rounded up (DWELL_TIME_STEP, `delay_sec`)."""


def run(toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
    """The motion; see `camtool.simulation.models.ControllerModel`."""
    controller = _controller(machine)
    path = held(toolpath, machine)
    rows = path.running
    check_rows(path, rows)
    path = path.first(rows)
    blocks = blocks_of(path, machine, controller)
    samples = GrblSamples(blocks, rows, machine)
    plan = speeds_of(blocks, path, machine)
    seconds = np.zeros(rows)
    np.add.at(seconds, blocks.row, plan.seconds(controller.buffer_blocks - 1))
    if controller.idle_delay_ms != ALWAYS_ON:
        held_s = controller.idle_delay_ms / 1000.0
        np.add.at(seconds, blocks.row[stops(blocks, path)], held_s)
    dwell = path.kind == Kind.DWELL
    seconds[dwell] = [_dwell_s(value) for value in path.value[dwell].tolist()]
    mechanics = Mechanics(machine, samples.start_mm(path.start), options.effects)
    return row_chunks(samples, RowTotals(seconds, iterates=True), mechanics, options.chunk_steps)


def held(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The moves as read, homing at machine zero: grbl rounds to steps when it makes blocks, and
    its numbers are 32-bit floats, nearer than a hundredth of a step."""
    check_positions(toolpath, machine)
    return placed(toolpath, np.array(machine.controller.machine_zero_mm, dtype=np.float64))


def spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """A step: every step event is a sample."""
    return min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)


def interpolation(toolpath: Toolpath, machine: Machine, options: Options) -> str:
    """Chords, and Bresenham lines."""
    return "chords"


def assumptions(toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
    """What the times take for granted."""
    controller = _controller(machine)
    return (
        f"arcs are chords within {controller.arc_tolerance_mm:g} mm ($12), lines whole steps",
        f"corners by a junction deviation of {controller.junction_deviation_mm:g} mm ($11), "
        f"speeds planned {controller.buffer_blocks - 1} blocks ahead",
        "the sender keeps grbl's buffer full; overrides stand at 100 %",
    )


class GrblSamples:
    """All step events of a program, numbered from 0; none are held."""

    def __init__(self, blocks: Blocks, rows: int, machine: Machine) -> None:
        self._blocks = blocks
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._offsets = np.concatenate([[0], np.cumsum(blocks.events)])
        self._travelled = np.zeros((len(blocks.row) + 1, 3), dtype=np.int64)
        self._travelled[1:] = np.cumsum(np.abs(blocks.way), axis=0)
        self.first = self._offsets[np.searchsorted(blocks.row, np.arange(rows + 1))]

    def start_mm(self, start: Floats) -> Floats:
        """Where the machine stands before the first block."""
        if len(self._blocks.row) == 0:
            return start
        return np.asarray(self._blocks.start[0] * self._step_mm)

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Row and position of the events low:high."""
        blocks = self._blocks
        begin = int(np.searchsorted(self._offsets, low, side="right")) - 1
        end = int(np.searchsorted(self._offsets, high, side="left"))
        commanded = np.empty((high - low, 3))
        first = (begin, low - int(self._offsets[begin]))
        step_lines_fill((blocks.start, blocks.way), first, self._step_mm, commanded)
        bounds = np.clip(self._offsets[begin : end + 1], low, high)
        return np.repeat(blocks.row[begin:end], np.diff(bounds)), commanded

    def steps(self, bounds: Ints) -> Ints:
        """Steps of each axis between events."""
        block = np.searchsorted(self._offsets, bounds, side="right") - 1
        count = self._travelled[block]
        inside = np.flatnonzero(bounds > self._offsets[block])
        event = bounds[inside] - self._offsets[block[inside]]
        count[inside] += np.abs(steps_taken(self._blocks.way[block[inside]], event))
        return np.asarray(np.diff(count, axis=0))


def _controller(machine: Machine) -> GrblController:
    """The machine's controller; MachineError for a compensation that grbl does not do."""
    for name, axis in zip("xyz", machine.axes, strict=True):
        if axis.compensation_mm > 0.0:
            raise MachineError(
                "grbl compensates no play",
                where=f"table [axes.{name}], key compensation_mm",
                mend="leave it out",
            )
    return controller_of(machine, GrblController)


def _dwell_s(seconds: float) -> float:
    """What `delay_sec` makes of a dwell; its count is a 32-bit float."""
    per_second = np.float32(1.0 / DWELL_STEP_S)
    return math.ceil(per_second * np.float32(seconds)) * DWELL_STEP_S
