"""Any controller, as if it followed the programmed lines and arcs exactly.

It stands in where a controller's own arithmetic is not modelled: it has no interpolator, no
acceleration, no look-ahead. What it does with a row of the toolpath:

1. Ends go to the nearest coded step of each axis (`controller.grid` "steps") or stay as they are
   ("none"). Where that leaves the ends of an arc at two radii, its centre goes to the nearest
   point as far from both. Ends that the program itself has put at two radii (by more than
   `SPREAD_STEPS`) stay: radius and Z then change in proportion to the angle.
2. The commanded position runs along the line or arc; see `camtool.simulation.samples` for
   where it is sampled. Between samples nothing is rounded: steps are counted, not taken.
3. A move takes way / feed, a rapid way / `Machine.rapid_mm_min`, and no straight move is faster
   than the highest rate of each axis, no helix than that of Z. Compensation takes no time.
4. Play, compensation and scale act on the commanded position as on that of any other controller.
   An axis has reversed when it came back by half a coded step: less is not seen by a motor.

Positions at and between samples: an error that changes with the way changes by no more than the
way, so the largest error between two samples exceeds that at the nearer one by half the spacing
at most; extents, reversals and the steps of each axis do not depend on the spacing.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from camtool.arrays import Bools, Floats
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine, PathController
from camtool.simulation.controller import ControllerModel
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Chunk, Options
from camtool.simulation.rows import check_positions, check_rows, placed
from camtool.simulation.samples import (
    CountedSamples,
    RowTotals,
    move_lengths,
    row_chunks,
    sample_spacing_mm,
)
from camtool.toolpath.moves import Kind, Toolpath

SPREAD_STEPS = 2.0
"""The radii at the two ends of an arc that differ by this many steps or fewer differ by
rounding."""

LEAST_CHORD_STEPS = 2.0
"""An arc with its ends nearer than this keeps its centre: they give no direction."""


_Machine = Machine[PathController, Any]


class PathModel(ControllerModel[PathController, Any]):
    """Any controller, as if it followed the programmed path exactly."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """The motion; ProgramError for rows that no controller can follow."""
        path = self.quantised(toolpath, machine)
        spacing_mm = sample_spacing_mm(path, machine)
        check_rows(path, path.running)
        path = path.first(path.running)
        samples = CountedSamples(path, machine, spacing_mm)
        mechanics = Mechanics(machine, path.start, options.effects)
        return row_chunks(
            samples, RowTotals(_durations(path, machine)), mechanics, options.chunk_steps
        )

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """The moves with their ends on the controller's grid, if it has one."""
        if machine.controller.grid == "none":
            return super().quantised(toolpath, machine)
        return on_steps(toolpath, machine)

    def spacing_mm(self, toolpath: Toolpath, machine: _Machine) -> float:
        """A coded step, or what a million samples of the whole program allow."""
        return sample_spacing_mm(toolpath, machine)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Nothing is interpolated."""
        return "path"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """What the times leave out."""
        return (
            "the controller follows every line and arc exactly",
            "speeds change at once: there is no acceleration, and compensation takes no time",
        )


def _durations(path: Toolpath, machine: Machine) -> Floats:
    """(N,) s of each row; NaN feeds, which `check_rows` refuses, only behind the end."""
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    speed = np.where(path.is_feed, path.feed, machine.rapid_mm_min)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        seconds = np.where(path.is_motion | homing, 60.0 * move_lengths(path) / speed, 0.0)
    way = np.abs(path.end - path.starts) if len(path) else np.zeros((0, 3))
    for index, axis in enumerate(machine.axes):
        if axis.max_rate_mm_min is not None:
            least = 60.0 * way[:, index] / axis.max_rate_mm_min
            turns = path.is_arc & (index < 2)  # but a helix rises evenly
            seconds = np.where(turns, seconds, np.maximum(seconds, least))
    return np.where(path.kind == Kind.DWELL, path.value, seconds)


def on_steps(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The moves with their ends at the nearest coded steps, homing at machine zero.

    Raises ProgramError for arcs without a centre and for positions beyond all steps. An arc
    shorter than a step, whose rounded ends would turn it into a full circle, becomes a line; one
    that lacks less than a step of its full circle becomes that.
    """
    check_positions(toolpath, machine)
    home = np.array(machine.controller.machine_zero_mm, dtype=np.float64)
    exact = placed(toolpath, home)
    home = _on_grid(home, machine)
    start, end = _on_grid(exact.start, machine), _on_grid(exact.end, machine)
    sweeps = exact.sweeps()
    made = _centred(replace(exact, start=start, end=end), np.abs(sweeps), machine)
    while True:
        inside_out = made.is_arc & (np.abs(made.sweeps() - sweeps) > np.pi)
        if not inside_out.any():
            return made
        made = placed(_turned_back(made, inside_out, np.abs(sweeps) < np.pi), home)


def _centred(made: Toolpath, sweep: Floats, machine: Machine) -> Toolpath:
    """Arcs whose centres are as far from their rounded ends as from their rounded starts.

    With the chord's direction u and its middle m, the nearest such point to the centre c is
    c − ((c − m)·u) u. It is as far from c as the ends' radii differ, times radius / chord: an arc
    of little sweep still runs between its ends, but one that lacks little of a full circle would
    be thrown to a side. So for more than half a turn the chord must not be below the radius.
    """
    step = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    begin, end, centre = made.starts[:, :2], made.end[:, :2], made.centre
    chord, out, back = end - begin, begin - centre, end - centre
    length, radius = np.hypot(chord[:, 0], chord[:, 1]), np.hypot(out[:, 0], out[:, 1])
    spread = np.abs(radius - np.hypot(back[:, 0], back[:, 1]))
    apt = made.is_arc & (length >= LEAST_CHORD_STEPS * step) & (spread <= SPREAD_STEPS * step)
    apt &= (sweep <= np.pi) | (length >= radius)
    u = chord[apt] / length[apt, None]
    off = ((centre[apt] - 0.5 * (begin + end)[apt]) * u).sum(axis=1)
    new = centre.copy()
    new[apt] -= off[:, None] * u
    return replace(made, centre=new)


def _turned_back(made: Toolpath, inside_out: Bools, short: Bools) -> Toolpath:
    """Arcs that rounding has turned inside out: the short ones as lines, the long ones closed."""
    lines, full = inside_out & short, inside_out & ~short
    end = made.end.copy()
    end[full, :2] = made.starts[full, :2]
    kind = np.where(lines, np.int64(Kind.LINE), made.kind)
    centre = np.where(lines[:, None], np.nan, made.centre)
    return replace(made, kind=kind, centre=centre, end=end)


def _on_grid(points: Floats, machine: Machine) -> Floats:
    """Points (..., 3) mm, each coordinate at its nearest coded step."""
    columns = [
        to_steps(points[..., index], axis.coded_step_mm) * axis.coded_step_mm
        for index, axis in enumerate(machine.axes)
    ]
    return np.stack(columns, axis=-1)
