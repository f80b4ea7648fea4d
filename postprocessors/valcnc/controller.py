"""The controller of ValCNC on the PIC18F4550: lines by its counter, arcs as lines.

What it does with a row of the toolpath:

1. A coordinate becomes steps: the nearest ones, or those that are whole (`controller.rounding`);
   by itself, or as the difference to the one before (`controller.counting`), whose rests then
   add up (L1226, L1334: neither is said).
2. A line steps the axis with more steps at a constant rate, and the other one whenever the sum of
   its steps reaches those (CUENTA, L1234, Tabla 8). Z has no part in that; where a row moves Z
   along with X or Y (dialect.z_order "together"), it is counted in the same way.
3. An arc is drawn as lines to points on the circle through its start (L1266-1330), see
   `steps`. It ends where its angle leads, and the next row begins there.
4. Every pass takes one delay of 166.667 µs (L1336): there are no ramps, feeds or faster rapids.

It issues nothing at reversals; compensation in a machine file would be steps at the same rate."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints, distinct_rows
from camtool.errors import ProgramError
from camtool.kernels.lattice import HALF_STEP_GUARD, to_steps
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.controller import ControllerModel
from camtool.simulation.legs import (
    MAX_STEPS,
    LegProgram,
    LegRun,
    Legs,
    check_rows,
    coded_steps_mm,
    waits_s,
)
from camtool.simulation.motion import Chunk, Options
from camtool.simulation.path import round_to_steps
from camtool.simulation.rows import block_of
from camtool.simulation.step_lines import LineRun
from camtool.toolpath.moves import Kind, Toolpath, read_only

from .dialect import ValcncController, ValcncDialect
from .steps import arc_angles

_Machine = Machine[ValcncController, ValcncDialect]

PIECES_AT_ONCE = 1 << 14

PIECE_EPS = 1e-9
"""A part of a piece by which an arc may be longer than whole pieces, by rounding alone."""


class ValcncModel(ControllerModel[ValcncController, ValcncDialect]):
    """The PIC18F4550 of ValCNC: lines by a counter, arcs as lines."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """Return the motion in chunks."""
        pieces = _Pieces(toolpath, machine)
        return _leg_run(pieces, toolpath, machine, options).run(pieces.legs())

    def fused_run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> LineRun | None:
        """Return the motion as lines of whole steps, judged in closed form; None where the
        mechanics differ from place to place."""
        pieces = _Pieces(toolpath, machine)
        return _leg_run(pieces, toolpath, machine, options).fused_run(pieces.legs())

    def run_on(
        self, drawn: DrawingProgress, toolpath: Toolpath, machine: _Machine, options: Options
    ) -> tuple[list[Chunk], DrawingProgress]:
        """Return the motion of rows that continue after `drawn`, and the state behind them."""
        pieces = _Pieces(toolpath, machine, drawn)
        chunks = list(_leg_run(pieces, toolpath, machine, options).run(pieces.legs()))
        return chunks, pieces.drawn

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """Return the toolpath with ends on whole steps, and with the centres of arcs equally far
        from both ends.

        ProgramError for what the controller cannot follow."""
        pieces = _Pieces(toolpath, machine)
        if machine.controller.rounding == "nearest":
            return round_to_steps(toolpath, machine)
        step_mm = coded_steps_mm(machine)
        start = pieces.in_steps(toolpath.start) * step_mm
        end = toolpath.by_parts(lambda part: pieces.in_steps(part.end) * step_mm)
        rounded = replace(toolpath, start=start, end=read_only(end))
        # Rounding may have made the ends of an arc below a step equal, and it a full circle.
        arcs = np.flatnonzero(toolpath.is_arc)
        closed = (rounded.end[arcs] == rounded.starts_of(arcs))[:, :2].all(axis=1)
        vanished = arcs[closed & (np.abs(toolpath.sweeps_of(arcs)) < np.pi)]
        if len(vanished):
            kind, centre = rounded.kind.copy(), rounded.centre.copy()
            kind[vanished], centre[vanished] = Kind.LINE, np.nan
            rounded = replace(rounded, kind=kind, centre=centre)
        return round_to_steps(rounded, machine)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "counter": lines by the counter, arcs as lines."""
        return "counter"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times and the path, as sentences for the report."""
        controller = machine.controller
        midways = _Pieces(toolpath, machine).between_steps()
        midway = "midway between two steps" if controller.rounding == "nearest" else "on a step"
        open_ends = (
            f"{midways} coordinates lie {midway}: its compiler's binary fractions decide whether "
            "such an end is one step less (not said, L1226)"
        )
        pieces = f"pieces of {controller.arc_segment_mm:g} mm (controller.arc_segment_mm)"
        if controller.arc_segments is not None:
            pieces = f"{controller.arc_segments} pieces each (controller.arc_segments)"
        return (
            f"the axis with more steps makes {controller.step_rate_hz:g} a second from rest to "
            "rest (controller.step_rate_hz): no ramps, no steps lost",
            f"arcs are drawn in {pieces}",
            "the controller's own arithmetic takes no time",
            *((open_ends,) if midways else ()),
        )


class DrawingProgress(Struct, frozen=True, eq=False):
    """State behind the lines drawn so far: the last point (3,) mm, which after an arc lies beside
    the programmed end by the error of the controller's angle, and the positions of the motors
    there, (3,) steps."""

    point: Floats
    steps: Ints


def _leg_run(pieces: _Pieces, toolpath: Toolpath, machine: _Machine, options: Options) -> LegRun:
    period_s = 1.0 / machine.controller.step_rate_hz
    waits = waits_s(toolpath, toolpath.executed_rows)
    leg_program = LegProgram(pieces.drawn.steps, waits, period_s)
    return LegRun(leg_program, machine, options)


class _Pieces:
    """The lines of a toolpath: one for each straight row, several for each arc; the first begins
    at its start, or where other rows before it have `drawn` to."""

    def __init__(
        self, toolpath: Toolpath, machine: _Machine, drawn: DrawingProgress | None = None
    ) -> None:
        check_rows(toolpath, machine)
        self._controller = machine.controller
        self._step_mm = coded_steps_mm(machine)
        count = toolpath.executed_rows
        self._end = toolpath.end[:count]
        self.drawn = drawn or DrawingProgress(toolpath.start, self.in_steps(toolpath.start))
        """State at the end of the legs computed so far."""
        self._arc_rows = np.flatnonzero(toolpath.is_arc[:count])
        self._arcs = self._angles(toolpath, count)
        parts = np.zeros(count + 1, dtype=np.int64)
        parts[1:] = toolpath.is_motion[:count]
        parts[1 + self._arc_rows] = self._parts(self._arcs)
        self._first = np.cumsum(parts, out=parts)

    def in_steps(self, points: Floats) -> Ints:
        """Return (..., 3) coordinates, or differences of coordinates, in whole steps by the
        controller's rounding; `points` in mm."""
        if self._controller.rounding == "nearest":
            columns = [to_steps(points[..., axis], self._step_mm[axis]) for axis in range(3)]
            return np.stack(columns, axis=-1)
        return np.asarray(np.trunc(points / self._step_mm + self._guard(points)).astype(np.int64))

    def between_steps(self) -> int:
        """Return how many coordinates of programmed ends lie within `HALF_STEP_GUARD` of a step
        from where the rounding to whole steps jumps."""
        turns_at = 0.5 if self._controller.rounding == "nearest" else 0.0
        points = distinct_rows(self._end) / self._step_mm
        offsets = points - turns_at
        is_near = np.abs(offsets - np.rint(offsets)) <= HALF_STEP_GUARD
        return int((is_near & (points != 0.0)).sum())

    def legs(self) -> Iterator[Legs]:
        """Yield the lines in whole steps, some thousands at a time."""
        period_s = 1.0 / self._controller.step_rate_hz
        before, places_before = self.drawn.point[None, :], self.drawn.steps[None, :]
        for low in range(0, int(self._first[-1]), PIECES_AT_ONCE):
            row, points = self._points(low, min(low + PIECES_AT_ONCE, int(self._first[-1])))
            if self._controller.counting == "coordinates":
                places = np.concatenate([places_before, self.in_steps(points)])
                travel = np.diff(places, axis=0)
            else:
                travel = self.in_steps(np.diff(np.concatenate([before, points]), axis=0))
            before, places_before = points[-1:], places_before + travel.sum(axis=0)
            self.drawn = DrawingProgress(before[0], places_before[0])
            passes = np.abs(travel).max(axis=1)
            moves = np.flatnonzero(passes)
            yield Legs(row[moves], travel[moves], passes[moves] * period_s)

    def _points(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return the toolpath row (J,) and the end (J, 3) mm of the pieces low:high."""
        index = np.arange(low, high)
        row = np.searchsorted(self._first, index, side="right") - 1
        part, parts = index - self._first[row] + 1, self._first[row + 1] - self._first[row]
        points = self._end[row]
        arc = np.searchsorted(self._arc_rows, row)
        curved = np.append(self._arc_rows, -1)[arc] == row
        if self._controller.arc_end == "programmed":
            curved &= part < parts
        x, y, radius, theta, alpha = self._arcs[arc[curved]].T
        angle = theta + alpha * (part[curved] / parts[curved])
        points[curved, 0] = x + radius * np.cos(angle)
        points[curved, 1] = y + radius * np.sin(angle)
        return row, points

    def _angles(self, toolpath: Toolpath, count: int) -> Floats:
        """Return (J, 5) the values of `arc_angles` for each arc among the first `count` rows.

        Raises ProgramError for an arc about its own start, or with a chord longer than its
        diameter."""
        if not len(self._arc_rows):
            return np.zeros((0, 5))
        angles = np.zeros((count, 5))
        kind = toolpath.kind[:count]
        turn = (kind == Kind.ARC_CCW).astype(np.int64) - (kind == Kind.ARC_CW)
        ends = np.concatenate([toolpath.start[None, :], self._end])
        self._check_arcs(toolpath)
        offset = np.where(turn[:, None] != 0, toolpath.centre[:count] - ends[:-1, :2], 0.0)
        computed = self._controller.arc_end == "computed"
        begin = self.drawn.point[:2].copy()
        bad_row = int(arc_angles(turn, begin, ends[:, :2].copy(), offset, computed, angles))
        if bad_row >= 0:
            raise ProgramError(
                "an arc about its own start, or with a chord longer than its diameter",
                where=block_of(toolpath, bad_row),
                mend="give I and J from the start to the centre",
            )
        return angles[self._arc_rows]

    def _check_arcs(self, toolpath: Toolpath) -> None:
        """Raise ProgramError for arcs whose steps the controller cannot count."""
        rows = self._arc_rows
        centre, starts = toolpath.centre[rows], toolpath.starts_of(rows)
        reach = np.abs(centre) + np.abs(centre - starts[:, :2]).max(axis=1)[:, None]
        with np.errstate(invalid="ignore"):
            countable = (reach <= MAX_STEPS * self._step_mm[:2]).all(axis=1)
        rises = toolpath.end[rows, 2] != starts[:, 2]
        unequal = np.full(len(rows), self._step_mm[0] != self._step_mm[1])
        for is_bad, message in (
            (~countable, "an arc without a centre, or farther than the controller can count"),
            (rises, "Z moves along with an arc"),
            (unequal, "on axes of unequal steps an arc is an ellipse"),
        ):
            if is_bad.any():
                raise ProgramError(message, where=block_of(toolpath, int(rows[is_bad.argmax()])))

    def _parts(self, arcs: Floats) -> Ints:
        """Return (J,) the number of lines that each arc of `arcs` (J, 5) becomes."""
        if self._controller.arc_segments is not None:
            return np.full(len(arcs), self._controller.arc_segments)
        length = arcs[:, 2] * np.abs(arcs[:, 4]) / self._controller.arc_segment_mm
        return np.maximum(np.ceil(length - PIECE_EPS), 1.0).astype(np.int64)

    @staticmethod
    def _guard(points: Floats) -> Floats:
        return np.copysign(HALF_STEP_GUARD, points)
