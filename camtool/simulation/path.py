"""The exact-path controller: it follows the programmed lines and arcs exactly.

It is used where the arithmetic of a controller is not modelled. It has no interpolator, no
acceleration and no look-ahead. For each row of the toolpath:

1. Ends are rounded to the nearest coded step of each axis (`controller.grid` "steps") or not
   rounded ("none"). Where rounding leaves the ends of an arc at different radii, its centre moves
   to the nearest point at the same distance from both. Where the program itself has the ends at
   different radii (by more than `SPREAD_STEPS`), the centre stays, and the radius changes in
   proportion to the angle, as Z does.
2. The commanded position moves along the line or arc and is sampled as in
   `camtool.simulation.samples`. Samples are not rounded: steps are counted, not taken.
3. A feed move takes length / feed, a rapid length / `Machine.rapid_mm_min`. No straight move is
   faster than the highest rate of each axis, and no helix than that of Z. Compensation takes no
   time.
4. Backlash, compensation and scale act on the commanded position as with any other controller. An
   axis has reversed when it has moved back by half a coded step, the least that a motor can do.

Between two samples an error changes by no more than the length of the path between them, so the
largest error exceeds that at the nearer sample by at most half the spacing. Extents, reversals and
the steps of each axis do not depend on the spacing."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine, PathController
from camtool.records import replace
from camtool.simulation.motion import Options
from camtool.simulation.rows import check_positions, check_rows, with_ends, with_event_positions
from camtool.simulation.samples import (
    ROWS_AT_ONCE,
    CountedSamples,
    SampledModel,
    SampledRows,
    move_lengths,
    sample_spacing_mm,
)
from camtool.toolpath.moves import Kind, Toolpath, read_only

SPREAD_STEPS = 2.0
"""Radii of the ends of an arc that differ by at most this many steps differ because of
rounding."""

MIN_CHORD_STEPS = 2.0
"""An arc whose ends are nearer than this keeps its centre: its chord has no certain direction."""


_Machine = Machine[PathController, Any]


class PathModel(SampledModel[PathController, Any]):
    """The exact-path controller."""

    samples_per_speed = 1

    def sampled(self, path: Toolpath, machine: _Machine) -> Iterator[SampledRows]:
        """Yield the rows up to the end of the program; ProgramError for those that cannot be
        followed."""
        spacing_mm = sample_spacing_mm(path, machine)
        check_rows(path, path.executed_rows)
        return _blocks(path.first(path.executed_rows), machine, spacing_mm)

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """Return the moves with their ends on the controller's grid, if it has one."""
        if machine.controller.grid == "none":
            return super().quantised(toolpath, machine)
        return round_to_steps(toolpath, machine)

    def spacing_mm(self, toolpath: Toolpath, machine: _Machine) -> float:
        """Return the distance of samples, mm: a coded step, or more if the program would have more
        than `MAX_SAMPLES` samples."""
        return sample_spacing_mm(toolpath, machine)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "path": lines and arcs are followed exactly, without interpolation."""
        return "path"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, one sentence each."""
        return (
            "the controller follows every line and arc exactly",
            "speeds change at once: there is no acceleration, and compensation takes no time",
        )


def _blocks(path: Toolpath, machine: Machine, spacing_mm: float) -> Iterator[SampledRows]:
    for low in range(0, len(path), ROWS_AT_ONCE):
        high = min(low + ROWS_AT_ONCE, len(path))
        part = path.part(low, high)
        samples = CountedSamples(part, machine, spacing_mm)
        yield SampledRows(low, high, low, samples, _durations(part, machine))


def _durations(path: Toolpath, machine: Machine) -> Floats:
    """Return (N,) s of each row. Feeds may be NaN only after the end of the program: `check_rows`
    refuses others."""
    homing = np.isin(path.kind, (Kind.HOME_XY, Kind.HOME_Z))
    speed = np.where(path.is_feed, path.feed, machine.rapid_mm_min)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        seconds = np.where(path.is_motion | homing, 60.0 * move_lengths(path) / speed, 0.0)
    travel = np.abs(path.end - path.starts) if len(path) else np.zeros((0, 3))
    for index, axis in enumerate(machine.axes):
        if axis.max_rate_mm_min is not None:
            min_seconds = 60.0 * travel[:, index] / axis.max_rate_mm_min
            turns = path.is_arc & (index < 2)  # Z moves evenly along a helix
            seconds = np.where(turns, seconds, np.maximum(seconds, min_seconds))
    return np.where(path.kind == Kind.DWELL, path.value, seconds)


def round_to_steps(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """Return the moves with their ends at the nearest coded steps, and homing at machine zero.

    Raises ProgramError for arcs without a centre and for positions that cannot be counted. An arc
    shorter than a step, which rounding would turn into a full circle, becomes a line; one that is
    less than a step short of a full circle becomes a full circle."""
    check_positions(toolpath, machine)
    home = np.array(machine.controller.machine_zero_mm, dtype=np.float64)
    exact = with_event_positions(toolpath, home)
    home = _on_grid(home, machine)
    start = _on_grid(exact.start, machine)
    end = exact.by_parts(lambda part: _on_grid(part.end, machine))
    arcs = np.flatnonzero(exact.is_arc)
    sweeps = exact.sweeps_of(arcs)
    rounded = _centre_arcs(with_ends(exact, start, end), arcs, np.abs(sweeps), machine)
    while True:
        bent = rounded.is_arc[arcs]
        arcs, sweeps = arcs[bent], sweeps[bent]
        inside_out = np.abs(rounded.sweeps_of(arcs) - sweeps) > np.pi
        if not inside_out.any():
            return rounded
        is_small = np.abs(sweeps[inside_out]) < np.pi
        rounded = with_event_positions(
            _restore_turned_arcs(rounded, arcs[inside_out], is_small), home
        )


def _centre_arcs(path: Toolpath, arcs: Ints, sweep: Floats, machine: Machine) -> Toolpath:
    """Return the path with the centres of the rows `arcs` (J,), which turn by `sweep` (J,) rad,
    moved to the same distance from their rounded starts and ends.

    With the direction u and the midpoint m of the chord, the nearest such point to the centre c is
    c − ((c − m)·u) u. Its distance from c is the difference of the radii times radius / chord. An
    arc of small sweep still runs between its ends, but one that is nearly a full circle would move
    far to one side: for more than half a turn the chord must therefore be at least the radius."""
    step = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    begin, end, centre = (path.starts_of(arcs)[:, :2], path.end[arcs, :2], path.centre[arcs])
    chord, start_arm, end_arm = end - begin, begin - centre, end - centre
    length, radius = np.hypot(chord[:, 0], chord[:, 1]), np.hypot(start_arm[:, 0], start_arm[:, 1])
    spread = np.abs(radius - np.hypot(end_arm[:, 0], end_arm[:, 1]))
    apt = (length >= MIN_CHORD_STEPS * step) & (spread <= SPREAD_STEPS * step)
    apt &= (sweep <= np.pi) | (length >= radius)
    if not apt.any():
        return path
    u = chord[apt] / length[apt, None]
    offsets = ((centre[apt] - 0.5 * (begin + end)[apt]) * u).sum(axis=1)
    new = path.centre.copy()
    new[arcs[apt]] -= offsets[:, None] * u
    return replace(path, centre=read_only(new))


def _restore_turned_arcs(rounded: Toolpath, inside_out: Ints, is_small: Bools) -> Toolpath:
    """Return the path with the arcs that rounding has turned inside out replaced: `is_small` ones
    (J,) by lines, the others by full circles."""
    lines, circles = inside_out[is_small], inside_out[~is_small]
    end, kind, centre = rounded.end.copy(), rounded.kind.copy(), rounded.centre.copy()
    end[circles, :2] = rounded.starts_of(circles)[:, :2]
    kind[lines], centre[lines] = Kind.LINE, np.nan
    return replace(rounded, kind=kind, centre=centre, end=end)


def _on_grid(points: Floats, machine: Machine) -> Floats:
    """Return points (..., 3) mm with each coordinate at its nearest coded step."""
    columns = [
        to_steps(points[..., index], axis.coded_step_mm) * axis.coded_step_mm
        for index, axis in enumerate(machine.axes)
    ]
    return np.stack(columns, axis=-1)
