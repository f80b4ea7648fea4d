"""The controller on the PIC18F8720: lines by DDA, arcs by direct search, one step at a time.

What it does with a row of the toolpath, in the order of this file:

1. Millimetres become steps, each coordinate by itself: round(mm / coded step), halves away from
   zero. Lines and arcs start where the controller stands.
2. XY first, then Z (2.5 axes). Lines, rapids and homing are DDA lines; arcs go by
   `controller.arcs` about the rounded centre until the position equals the rounded end.
3. Every output takes one period 1/f, f = feed / (60 · coded step), rapids run at
   `limits.rapid_step_rate_hz` (equation 3.1, L853-878). The link reports each step, and holds
   faster feeds at `limits.max_step_rate_hz` (L3196-3199). `time_base` "event": a pass without a
   pulse costs nothing (annex A.3 loops back at once); "iteration": each pass takes one period.
4. At each change of an axis's direction the compensation steps are issued, a period each.

What the controller takes for the end of an arc is not documented (`controller.arc_end`,
`steps`); it goes on from where the arc stopped. By "equal" an arc that passes
its end without standing on it goes round again on the real machine, mostly for ever. Here its
samples stop at the nearest approach to the end in the expected sweep, `ended` is False, and the
next row goes on from the programmed end, without a reversal on the way there. An arc that starts
at its centre has no samples and the same fate."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, TypeAlias

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import MachineError, ProgramError
from camtool.findings import Finding
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.controller import ControllerModel
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Effects, Options, one_row
from camtool.simulation.rows import block_of, refuse
from camtool.simulation.timing import SampleClock, TimedChunk
from camtool.toolpath.moves import Kind, Toolpath, read_only

from . import steps as loops
from .dialect import PicMmhController, PicMmhDialect
from .findings import ARC_END_UNSURE
from .legs import METHODS, CommandedPath, FusedLegs, Periods, positions
from .steps import (
    approach_scan,
    approach_start,
    dda_arc_fill,
    dda_arc_start,
    dda_line_fill,
    direct_search_fill,
    direct_search_start,
    expected_quadrants,
    rounded_radius,
    stairs_fill,
    stairs_start,
)

_Machine = Machine[PicMmhController, PicMmhDialect]


class PicMmhModel(ControllerModel[PicMmhController, PicMmhDialect]):
    """The PIC18F8720: lines by DDA, arcs by direct search, DDA or stairs."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """Return the motion in chunks."""
        return PicMmhRun(toolpath, machine, options).run()

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """Return the toolpath with its start, ends and arc centres at the nearest steps."""
        coded_mm = [axis.coded_step_mm for axis in machine.axes]
        start = _on_grid(toolpath.start[None, :], coded_mm)[0]
        end = read_only(toolpath.by_parts(lambda part: _on_grid(part.end, coded_mm)))
        arcs, centre = np.flatnonzero(toolpath.is_arc), toolpath.centre
        if len(arcs):
            centre = centre.copy()
            centre[arcs] = _on_grid(centre[arcs], coded_mm[:2])
        return replace(toolpath, start=start, end=end, centre=read_only(centre))

    def timed(
        self, toolpath: Toolpath, machine: _Machine, options: Options
    ) -> Iterator[TimedChunk]:
        """Return the motion in chunks, with the times of its outputs."""
        return super().timed(toolpath, machine, options_by_pass(machine, options))

    def clock(self, toolpath: Toolpath, machine: _Machine) -> SampleClock:
        """Return the clock of the samples: outputs one period apart, with the steps that
        compensate backlash, by region too."""
        added = None
        if machine.controller.compensates_by_region:
            added = np.zeros((len(toolpath), 3), dtype=np.int64)
            # NaN until an axis turns away for the first time: nothing is added until then.
            for axis, added_mm in enumerate(np.nan_to_num(compensations(toolpath, machine)).T):
                added[:, axis] = to_steps(added_mm, list(machine.axes)[axis].coded_step_mm)
        return SampleClock(self.quantised(toolpath, machine), machine, added=added)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return the name of the interpolator of arcs: dsm, dda or stairs."""
        return options.interpolator or machine.controller.arcs

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, as sentences for the report."""
        base = machine.controller.time_base
        return (
            f"each {base} of the interpolator takes one period of the feed (controller.time_base)",
            f"rapids run at {machine.limits.rapid_step_rate_hz:g} steps/s "
            "(limits.rapid_step_rate_hz)",
            "each step of a compensation takes a period of its own",
        )

    def findings(
        self, toolpath: Toolpath, machine: _Machine, options: Options
    ) -> tuple[Finding, ...]:
        """Return a finding on arcs that do not end at the same place by every reading of the
        thesis."""
        if self.interpolation(toolpath, machine, options) != "dsm" or not toolpath.is_arc.any():
            return ()

        return arc_end_findings(
            toolpath, machine, PicMmhRun(toolpath, machine, options).arcs_as_said()
        )

    def fused_run(
        self, toolpath: Toolpath, machine: _Machine, options: Options
    ) -> FusedLegs | None:
        """Return the same motion as `run`, judged while it is computed, without chunks; None where
        the mechanics need chunks. Raises as `run` does, for the whole program at once."""
        return PicMmhRun(toolpath, machine, options).fused_run()


def options_by_pass(machine: _Machine, options: Options) -> Options:
    """Return the options of a run with times. Where passes without output take a period too, the
    model must run pass by pass: only that shows when they occur."""
    by_pass = machine.controller.time_base == "iteration"
    return replace(options, chunk_steps=1) if by_pass else options


def _on_grid(points: Floats, coded_mm: list[float]) -> Floats:
    """Return points (J, A) mm, each coordinate at the nearest step."""
    columns = [to_steps(points[:, axis], step) * step for axis, step in enumerate(coded_mm)]
    return np.column_stack(columns)


# One run of a toolpath on the PIC18F8720, row by row.

MAX_STEPS = 1 << 30
"""Positions beyond this many steps (150 m at 140 nm) are refused: squares must fit 64 bits."""


ROWS_AT_ONCE = 1 << 14


class _Leg(Struct, frozen=True):
    """A part of a row that one interpolator makes: `samples` positions of `fill`; the position of
    the axes `columns` is origin + sign · filled; an output every `period_s`."""

    fill: Filler
    samples: int
    columns: tuple[int, ...]
    origin: tuple[int, ...]
    sign: tuple[int, ...]
    period_s: float
    ended: bool = True


def _without_stop(fill: Filler) -> Filler:
    """Return a filler that does not stop at the end of the arc, which may be passed on an earlier
    turn."""

    def is_on(buffer: Ints) -> tuple[int, int, bool]:
        filled, passes, _ = fill(buffer)
        return filled, passes, False

    return is_on


class PicMmhRun:
    """Run of a toolpath; ProgramError for rows that the controller cannot follow."""

    def __init__(self, toolpath: Toolpath, machine: _Machine, options: Options) -> None:
        self._toolpath, self._options = toolpath, options
        self._controller = machine.controller
        if machine.limits.rapid_step_rate_hz is None:
            raise MachineError(
                "key is missing: this controller times its rapids by it",
                where="table [limits], key rapid_step_rate_hz",
                mend="use --set limits.rapid_step_rate_hz=HZ",
            )
        self._rapid_period_s = 1.0 / machine.limits.rapid_step_rate_hz
        most_hz = machine.limits.max_step_rate_hz
        self._least_period_s = 0.0 if most_hz is None else 1.0 / most_hz
        self._coded_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        if self._coded_mm[0] != self._coded_mm[1]:
            raise MachineError(
                f"the coded steps of X and Y differ"
                f" ({self._coded_mm[0]} and {self._coded_mm[1]} mm)",
                where="table [axes], key coded_step_mm",
                mend="the controller interpolates with one step size; "
                "write the difference in real_step_mm",
            )
        self._ends = self._steps(toolpath.end, range(3))
        self._centres = self._arc_centres()
        home_mm = np.array([self._controller.machine_zero_mm], dtype=np.float64)
        self._home: Ints = self._steps(home_mm, range(3), named=False)[0]
        self._position: Ints = self._steps(toolpath.start[None, :], range(3), named=False)[0]
        self._said = self._ends.copy()
        self._stops = self._stop_samples()
        self._mechanics = Mechanics(machine, self._position * self._coded_mm, options.effects)
        self._compensations: Floats | None = None
        if options.effects.compensation and machine.controller.compensates_by_region:
            self._compensations = compensations(toolpath, machine)
        self._buffer = np.empty((options.chunk_steps, 2), dtype=np.int64)

    def run(self) -> Iterator[Chunk]:
        """Yield the chunks of all rows up to the end of the program."""
        for row, number in enumerate(self._toolpath.kind.tolist()):
            kind = Kind(number)
            if self._compensations is not None:
                for axis, added_mm in enumerate(self._compensations[row].tolist()):
                    if math.isnan(added_mm):
                        continue
                    coded_mm = float(self._coded_mm[axis])
                    self._mechanics.compensate(axis, int(to_steps(added_mm, coded_mm)))
            rest_chunk, has_moved = self._rest_chunk(row, kind, self._position), False
            for chunk in self._motion_chunks(row, kind):
                has_moved = True
                yield chunk
            if not has_moved:
                yield rest_chunk
            if kind == Kind.END:
                return

    def fused_run(self) -> FusedLegs | None:
        """Return the legs of all rows up to the end of the program; None where the mechanics need
        chunks."""
        if not self._mechanics.plain or self._compensations is not None:
            return None
        toolpath = self._toolpath
        rows = toolpath.executed_rows
        places = positions(toolpath, self._position, self._ends, self._home)
        for row in np.flatnonzero(self._suspect(places)[:rows]).tolist():
            self._check(row, places[row])
        return FusedLegs(
            CommandedPath(toolpath, places, self._centres, self._stops),
            rows,
            Periods(self._rapid_period_s, self._least_period_s, self._coded_mm[[0, 2]]),
            (
                self._options.interpolator or self._controller.arcs,
                self._controller.initial_error == "rounded-radius",
                self._controller.time_base == "event",
                float(self._coded_mm[0]),
            ),
            self._mechanics,
        )

    def _stop_samples(self) -> Ints:
        """Return (N,) the samples of each arc up to its stop, by `controller.arc_end`; −1 for
        other rows, and for all rows where it is "equal". The ends of arcs are changed to their
        stops: the controller counts steps and continues from where it is."""
        toolpath, controller = self._toolpath, self._controller
        if controller.arc_end == "equal" or not toolpath.is_arc.any():
            return np.broadcast_to(np.int64(-1), len(toolpath))
        stops = np.full(len(toolpath), -1, dtype=np.int64)
        homes = toolpath.kind == Kind.HOME_XY
        moves = (toolpath.is_motion | homes).astype(np.int64)
        moves[toolpath.kind == Kind.ARC_CCW] = 2
        moves[toolpath.kind == Kind.ARC_CW] = 3
        ends = np.where(homes[:, None], self._home[:2], self._ends[:, :2])
        options = (
            METHODS[self._options.interpolator or controller.arcs],
            controller.initial_error == "rounded-radius",
            loops.READINGS[controller.arc_end],
        )
        loops.run_on(moves, self._position[:2].copy(), ends, self._centres, options, stops)
        self._ends[:, :2] = np.where(toolpath.is_motion[:, None], ends, self._ends[:, :2])
        return stops

    def arcs_as_said(self) -> Ints:
        """Return (L, 14) the legs of the arcs up to the end of the program, each beginning as if
        the arcs before had stopped on their programmed ends."""
        toolpath = self._toolpath
        places = positions(toolpath, self._position, self._said, self._home)
        unknown = np.full(len(toolpath), -1, dtype=np.int64)
        course = CommandedPath(toolpath, places, self._centres, unknown)
        parts = []
        for low in range(0, toolpath.executed_rows, ROWS_AT_ONCE):
            legs = course.legs(low, min(low + ROWS_AT_ONCE, toolpath.executed_rows))
            parts.append(legs[legs[:, loops.KIND] == loops.ARC])
        return np.concatenate(parts)

    def _suspect(self, places: Ints) -> Bools:
        """Return a mask (N,), true for the rows that `_check` has to look at."""
        kind, feed = self._toolpath.kind, self._toolpath.feed
        with np.errstate(invalid="ignore"):
            no_feed = self._toolpath.is_feed & ~((feed > 0.0) & np.isfinite(feed))
        is_moved = (kind == Kind.SET_ZERO) & places[:-1].any(axis=1)
        return np.asarray(no_feed | is_moved | (kind == Kind.DWELL))

    def _check(self, row: int, position: Ints) -> None:
        """Raise ProgramError for a row that cannot be followed from `position` (3,) steps."""
        kind = Kind(int(self._toolpath.kind[row]))
        if kind <= Kind.ARC_CCW:
            self._period(row, kind, 0)
        self._rest_chunk(row, kind, position)

    def _motion_chunks(self, row: int, kind: Kind) -> Iterator[Chunk]:
        """Yield the chunks of a row's motion; afterwards the controller stands at the row's end,
        wherever the motion led."""
        if kind in (Kind.HOME_XY, Kind.HOME_Z):
            target = self._position.copy()
            axes = [0, 1] if kind == Kind.HOME_XY else [2]
            target[axes] = self._home[axes]
        elif kind <= Kind.ARC_CCW:
            target = self._ends[row]
        else:
            return
        if kind in (Kind.ARC_CW, Kind.ARC_CCW):
            yield from self._emit(row, self._arc(row, kind, target))
            self._position = np.array([target[0], target[1], self._position[2]])
            self._mechanics.place(self._position * self._coded_mm)
        else:
            yield from self._emit(row, self._line((0, 1), target, self._period(row, kind, 0)))
        if target[2] != self._position[2]:
            yield from self._emit(row, self._line((2,), target, self._period(row, kind, 2)))

    def _period(self, row: int, kind: Kind, axis: int) -> float:
        """Return the seconds between two outputs of a row on an axis."""
        if kind not in (Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW):
            return self._rapid_period_s
        feed = float(self._toolpath.feed[row])
        if not (math.isfinite(feed) and feed > 0.0):
            raise ProgramError(
                "a cutting move without a feed above 0",
                where=block_of(self._toolpath, row),
                mend="write F in its block",
            )
        return max(60.0 * float(self._coded_mm[axis]) / feed, self._least_period_s)

    def _line(self, axes: tuple[int, ...], target: Ints, period_s: float) -> _Leg:
        """Return a DDA line of one or two axes from the current position to `target`."""
        travel = [int(target[axis] - self._position[axis]) for axis in axes]
        a, b = abs(travel[0]), abs(travel[1]) if len(travel) > 1 else 0
        return _Leg(
            fill=line_filler(a, b),
            samples=a + b,
            columns=axes,
            origin=tuple(int(self._position[axis]) for axis in axes),
            sign=tuple(-1 if part < 0 else 1 for part in travel),
            period_s=period_s,
        )

    def _arc(self, row: int, kind: Kind, target: Ints) -> _Leg:
        """Return the arc of a row about its rounded centre, up to where the controller stops."""
        centre_x, centre_y = self._centres[row].tolist()
        x, y = int(self._position[0]) - centre_x, int(self._position[1]) - centre_y
        arc = StepArc(
            x, y, kind == Kind.ARC_CW, int(target[0]) - centre_x, int(target[1]) - centre_y
        )
        period_s = self._period(row, kind, 0)
        origin, sign = (centre_x, centre_y), (1, 1)
        if x == 0 and y == 0:
            return _Leg(line_filler(0, 0), 0, (0, 1), origin, sign, period_s, ended=False)
        method = self._options.interpolator or self._controller.arcs
        rounded = self._controller.initial_error == "rounded-radius"
        fill = arc_filler(arc, method, rounded=rounded)
        if self._stops[row] >= 0:
            samples = int(self._stops[row])
            return _Leg(_without_stop(fill), samples, (0, 1), origin, sign, period_s)
        samples, is_met = arc_reach(arc, arc_filler(arc, method, rounded=rounded))
        return _Leg(fill, samples, (0, 1), origin, sign, period_s, ended=is_met)

    def _emit(self, row: int, leg: _Leg) -> Iterator[Chunk]:
        """Yield the samples of a leg in chunks; one empty chunk for a leg without samples that
        never ends."""
        remaining, is_done = leg.samples, leg.samples == 0
        if is_done and not leg.ended:
            yield one_row(row, NO_SAMPLES, NO_SAMPLES, is_met=False)
        while not is_done:
            filled, passes, is_done = leg.fill(self._buffer[:remaining])
            remaining -= filled
            is_done = is_done or remaining == 0
            steps = np.empty((filled, 3), dtype=np.int64)
            steps[:] = self._position
            for index, column in enumerate(leg.columns):
                steps[:, column] = (
                    leg.origin[index] + leg.sign[index] * self._buffer[:filled, index]
                )
            yield self._chunk(row, leg, steps, passes, leg.ended or not is_done)

    def _chunk(self, row: int, leg: _Leg, steps: Ints, passes: int, is_ended: bool) -> Chunk:
        travelled = np.abs(np.diff(steps, axis=0, prepend=self._position[None, :])).sum(axis=0)
        self._position = steps[-1]
        commanded = steps * self._coded_mm
        slide, reversals = self._mechanics.follow(commanded, np.array([0, len(steps)]))
        by_event = self._controller.time_base == "event"
        periods = len(steps) if by_event else passes
        added = int(reversals[0] @ self._mechanics.compensation_steps)
        return one_row(
            row,
            commanded,
            slide,
            duration_s=(periods + added) * leg.period_s,
            compensation_s=added * leg.period_s,
            iterations=passes,
            steps=travelled,
            reversals=reversals[0],
            is_met=is_ended,
        )

    def _rest_chunk(self, row: int, kind: Kind, position: Ints) -> Chunk:
        """Return the chunk of a row without motion; ProgramError for an event that cannot be
        followed."""
        seconds = 0.0
        if kind == Kind.DWELL:
            seconds = float(self._toolpath.value[row])
            if not (math.isfinite(seconds) and seconds >= 0.0):
                place = block_of(self._toolpath, row)
                raise ProgramError("a dwell without its seconds", where=place)
        elif kind == Kind.SET_ZERO and position.any():
            raise ProgramError(
                "part zero is set away from part zero",
                where=block_of(self._toolpath, row),
                mend="set it once, before any move",
            )
        return one_row(row, NO_SAMPLES, NO_SAMPLES, duration_s=seconds)

    def _arc_centres(self) -> Ints:
        """Return the arc centres (N, 2) in steps; 0 where the row is no arc."""
        toolpath = self._toolpath
        if not toolpath.is_arc.any():
            return np.broadcast_to(np.int64(0), (len(toolpath), 2))
        is_bad = toolpath.is_arc & ~np.isfinite(toolpath.centre).all(axis=1)
        refuse(toolpath, is_bad, "an arc without a centre")
        return self._steps(np.where(toolpath.is_arc[:, None], toolpath.centre, 0.0), range(2))

    def _steps(self, points: Floats, axes: range, *, named: bool = True) -> Ints:
        """Return points in mm as steps (N, len(axes)); ProgramError beyond `MAX_STEPS`."""
        coded_mm = self._coded_mm[list(axes)]
        is_far = (np.abs(points) > MAX_STEPS * coded_mm).any(axis=1)
        if is_far.any():
            raise ProgramError(
                "a position is beyond all that the controller can count",
                where=block_of(self._toolpath, int(is_far.argmax())) if named else None,
            )
        columns = [to_steps(points[:, axis], float(coded_mm[axis])) for axis in axes]
        return np.column_stack(columns)


# Compensation by region: what is set before each row.

UM_PER_MM = 1000.0


def compensations(toolpath: Toolpath, machine: Machine[Any, PicMmhDialect]) -> Floats:
    """Return the compensation (N, 2) mm of X and Y that is set before each row.

    An axis that turns away from `start_direction` is given the play of the region in which it
    turns, as the motor makes it, in whole micrometres. When it turns back, the same value is taken
    back, wherever that is: so the motor stands where the controller counts, and errors do not add
    up. A row has one value: where an axis turns back in it and away again, the second turn gets
    that of the first. The value is NaN until the first turn away: the controller still has the
    last value of the program before. MachineError without regions."""
    controller, cells = machine.controller, machine.play_map.used
    if not any(cells):
        raise MachineError(
            "there are no regions to compensate",
            where='key controller.compensation = "by-region"',
            mend="set play_map.use = true, and give [play_map.x] and [play_map.y]",
        )
    coded_mm = np.array([axis.coded_step_mm for axis in machine.axes])
    zero = controller.machine_zero_mm
    away = -1 if controller.start_direction == "+" else 1
    axes = zip(machine.axes, cells, strict=True)
    state = [(-away, math.nan if table else axis.compensation_mm) for axis, table in axes]
    plain_controller = replace(controller, compensation="everywhere")
    plain_machine = replace(machine, controller=plain_controller)
    model, silent = PicMmhModel(), Options(effects=Effects(False, False, False, False, False))
    ends = model.quantised(toolpath, machine).end
    position = model.quantised(toolpath, machine).start
    result = np.zeros((len(toolpath), 2))
    has_turned, last_row = [False, False], -1
    for chunk in model.run(toolpath, plain_machine, silent):
        row = int(chunk.ledger.row[0])
        if row != last_row:
            has_turned, last_row = [False, False], row
        for axis in (0, 1):
            direction, added_mm = state[axis]
            places = np.concatenate([position[None, :], chunk.commanded])
            ways = np.sign(np.rint(np.diff(places[:, axis]) / coded_mm[axis])).astype(np.int64)
            moving = np.flatnonzero(ways)
            before = np.concatenate([[direction], ways[moving][:-1]])
            for index in moving[ways[moving] != before].tolist():
                table, direction = cells[axis], int(ways[index])
                if direction == away and table is not None and not has_turned[axis]:
                    x, y = (places[index + 1, :2] - zero[:2]).tolist()
                    record = list(machine.axes)[axis]
                    of_motor_mm = table.play_at(x, y) * record.coded_step_mm / record.real_step_mm
                    added_mm = round(of_motor_mm * UM_PER_MM) / UM_PER_MM
                has_turned[axis] = True
            state[axis] = direction, added_mm
            result[row, axis] = added_mm
        if len(chunk.commanded):
            position = chunk.commanded[-1]
        if not chunk.ledger.ended.all():
            position = ends[row]
    result[last_row + 1 :] = [added_mm for _, added_mm in state[:2]]
    return result


# The interpolators as one kind of thing: a filler that writes the next positions to a buffer.
#
# Positions are steps: relative to the arc's centre for arcs, magnitudes from the start for lines.

Filler: TypeAlias = Callable[[Ints], tuple[int, int, bool]]
"""Function that fills a buffer (n, 2); it returns the rows filled, the passes run, and whether the
last row is the end."""

SEARCH_ROWS = 1 << 14
"""Positions that the search for the end looks at in one go (256 KiB, stays in the cache)."""


class StepArc(Struct, frozen=True):
    """An arc in steps: start (x, y) and end relative to its centre."""

    x: int
    y: int
    clockwise: bool
    end_x: int
    end_y: int


def line_filler(a: int, b: int) -> Filler:
    """Return the filler of a DDA line of a ≥ 0 and b ≥ 0 steps."""
    registers, counters = np.zeros(2), np.zeros(2, dtype=np.int64)

    def fill(buffer: Ints) -> tuple[int, int, bool]:
        filled, passes, is_done = dda_line_fill(a, b, registers, counters, buffer)
        return filled, passes, is_done

    return fill


def arc_filler(arc: StepArc, method: str, *, rounded: bool) -> Filler:
    """Return the filler of an arc whose start is not its centre; `rounded`: the error at the start
    is that against the circle of the rounded radius (DSM and stairs), else 0."""
    state: Ints
    if method == "dda":
        state = dda_arc_start(arc.x, arc.y, arc.clockwise)

        def fill(buffer: Ints) -> tuple[int, int, bool]:
            filled, passes, is_met = dda_arc_fill(state, arc.end_x, arc.end_y, buffer)
            return filled, passes, is_met

        return fill
    start, run = {
        "dsm": (direct_search_start, direct_search_fill),
        "stairs": (stairs_start, stairs_fill),
    }[method]
    error = arc.x**2 + arc.y**2 - rounded_radius(arc.x, arc.y) ** 2 if rounded else 0
    state = start(arc.x, arc.y, arc.clockwise, error)

    def fill_each(buffer: Ints) -> tuple[int, int, bool]:
        filled, is_met = run(state, arc.end_x, arc.end_y, buffer)
        return filled, filled, is_met

    return fill_each


def arc_reach(arc: StepArc, fill: Filler) -> tuple[int, bool]:
    """Return the number of positions until the stop test of an arc is met, and True.

    When it is not met in the expected sweep and a quadrant more, return the number until the
    nearest approach to the end there, and False: the controller then goes round at least once
    more, if it ever stops. `fill` must be fresh. Time and memory are bounded."""
    expected = expected_quadrants(arc.x, arc.y, arc.clockwise, arc.end_x, arc.end_y)
    low, high = expected - 1, expected + 1
    end = np.array([arc.end_x, arc.end_y], dtype=np.int64)
    tracker: Ints = approach_start(arc.x, arc.y, arc.end_x, arc.end_y, low)
    turn = 8 * (max(abs(arc.x), abs(arc.y)) + 1)
    buffer = np.empty((min(SEARCH_ROWS, turn), 2), dtype=np.int64)
    while True:
        filled, _, is_met = fill(buffer)
        approach_scan(buffer[:filled], end, tracker, low, high)
        entered, passed_at, nearest_position = int(tracker[2]), int(tracker[3]), int(tracker[4])
        if entered > high:
            return nearest_position, False
        if is_met:
            return passed_at, True


# What each reading of the controller's stop test does to the arcs of a program.
#
# The readings are those of `steps`, each with both values of D that the
# controller may start with. An arc that stands on its end by the strictest of them, whatever D
# was, stops there by all; of the others the machine's owner must know what may become of them.


def arc_end_findings(toolpath: Toolpath, machine: _Machine, arcs: Ints) -> tuple[Finding, ...]:
    """Return one ARC_END_UNSURE for the arcs that do not stop on their end under every reading of
    the thesis; none if all do. `arcs` (L, 14): legs, each from the end of the row before it."""
    arcs = arcs[(arcs[:, [loops.A, loops.B]] != 0).any(axis=1)]
    is_met = [_stops(arcs, rounded, loops.EQUAL)[:, loops.MET] != 0 for rounded in (False, True)]
    unsure = ~(is_met[0] & is_met[1])
    if not unsure.any():
        return ()
    distances = {
        name: max(
            float(_end_distances(arcs[unsure], rounded, number).max()) for rounded in (False, True)
        )
        for name, number in loops.READINGS.items()
        if number != loops.EQUAL
    }
    row = int(arcs[unsure][0, loops.ROW])
    reading = machine.controller.arc_end
    return (
        ARC_END_UNSURE(
            where=block_of(toolpath, row),
            measured=int(unsure.sum()),
            limit=0.0,
            arcs=len(arcs),
            missed=int((~is_met[0]).sum()),
            missed_rounded=int((~is_met[1]).sum()),
            final_quadrant=distances["final-quadrant"],
            nearest=distances["nearest"],
            taken=reading,
        ),
    )


def _stops(arcs: Ints, rounded: bool, reading: int) -> Ints:
    """Return the stops (L, 4) of arcs by direct search, as `arc_stops` of `steps` gives them."""
    stops = np.empty((len(arcs), loops.STOP_COLUMNS), dtype=np.int64)
    loops.arc_stops(np.ascontiguousarray(arcs), (loops.DSM, rounded, reading), stops)
    return stops


def _end_distances(arcs: Ints, rounded: bool, reading: int) -> Floats:
    """Return (L,) the distance from the stop of each arc to its programmed end, steps."""
    stops = _stops(arcs, rounded, reading)[:, [loops.STOP_X, loops.STOP_Y]]
    return np.asarray(np.hypot(*(stops - arcs[:, [loops.END_X, loops.END_Y]]).T))
