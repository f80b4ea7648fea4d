"""Play taken up at reversals, and what a controller compensates wrongly.

Driven in the direction d = ±1 and engaged, a slide stands at an offset from where the controller
believes it to be (`camtool.planning.reversing.residual`):

    slide = position + e(d)        so a wanted x asks for the position x − e(d).

When an axis reverses, that position jumps by e(−d) − e(d) =: J in the new direction d:

- J > 0, less is compensated than the play: the axis goes on by J alone, a line on which the slide
  does not move, and then along the path. Nothing is left over.
- J < 0, the controller compensates by r = −J too much: its first step back throws the slide r
  ahead. So the axis first overshoots by `OVERSHOOT` · r, then makes one step back, which leaves
  the slide (1 − `OVERSHOOT`) · r ahead, and holds until the path has come as far. With one half
  the largest error is r/2, at the reversal only; without any of this it is r all the way back.
  An axis that still waits from the reversal before stands out already, and overshoots by the rest.
  In the cut nothing does better: the step throws the slide from one end of a length r to the
  other, wherever it is made, and one of the two ends is r/2 or more off the place of the reversal.

Where the play changes with the region of the table, e does too: a step towards d is taken alone,
one against it is waited for. Rapids and other moves in the air take up the play on their way. An
axis that does not move keeps what it has.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.kernels.lattice import to_steps
from camtool.machine.model import Axis, Machine
from camtool.planning.compensating.regions import Regions
from camtool.planning.compensating.stretch import Point, Stretch, stretches
from camtool.planning.reversing.residual import Residual
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Bent, Kind, Move, Toolpath

OVERSHOOT = 0.5
"""The share of what the controller compensates too much that an axis overshoots at a reversal."""

STILL_STEPS = 0.5
"""An axis that goes less than this much of a coded step does not move."""

KICK_STEPS = 1.0
"""The step back that makes the controller compensate, in coded steps."""

AHEAD_MM = 1e-9
"""Positions nearer than this are one."""


@dataclass
class _Drive:
    """An axis on its way: where the controller stands, and in which direction ±1 it went last;
    `residual` is that of the region that the tool is in."""

    axis: Axis
    residual: Residual
    at: float
    sense: int
    step_mm: float

    def asked(self, value: float, sense: int) -> float:
        """The position that puts the slide on `value` when driven towards `sense`."""
        return value - self.residual.error_mm(sense)

    def sense_of(self, begin: float, end: float) -> int:
        """The direction of a move; the last one where it does not move."""
        way = end - begin
        if abs(way) < STILL_STEPS * self.axis.coded_step_mm:
            return self.sense
        return 1 if way > 0.0 else -1

    def free(self, begin: float, end: float) -> None:
        """A move in the air to `end`: whatever direction takes the axis to where it is asked."""
        for sense in (self.sense_of(begin, end), -self.sense_of(begin, end)):
            to = self.asked(end, sense)
            if (to - self.at) * sense > 0.0 or (sense == self.sense and to == self.at):
                self.at, self.sense = to, sense
                return


def taken_up(toolpath: Toolpath, machine: Machine) -> Bent:
    """The positions that a controller must be given for slides on `toolpath` (in motor mm); the
    same toolpath where there is neither play nor compensation."""
    regions = Regions(machine)
    if not regions.matter:
        return Bent(toolpath, np.arange(len(toolpath)))
    return _TakenUp(toolpath, machine, regions).bent()


class _TakenUp:
    def __init__(self, toolpath: Toolpath, machine: Machine, regions: Regions) -> None:
        self._toolpath, self._regions = toolpath, regions
        self._home = machine.controller.machine_zero_mm
        first = 1 if machine.controller.start_direction == "+" else -1
        start = toolpath.start.tolist()
        self._drives = [
            _Drive(axis, residual, value, first, KICK_STEPS * _step_mm(axis))
            for axis, residual, value in zip(
                machine.axes, regions.residuals(start), start, strict=True
            )
        ]
        self._b = ToolpathBuilder(self._place())

    def bent(self) -> Bent:
        rows: list[int] = []
        sweeps = self._toolpath.sweeps()
        for move in self._toolpath:
            self._b.source = move.source
            if move.kind == Kind.RAPID:
                self._enter(move.end)
                for drive, begin, end in zip(self._drives, move.start, move.end, strict=True):
                    drive.free(begin, end)
                self._b.rapid(*self._place())
            elif move.kind in (Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW):
                for stretch in stretches(move, float(sweeps[move.index])):
                    for part in self._regions.parts(stretch):
                        self._enter(part.at(0.5))
                        self._cut(part, move)
            else:
                self._event(move)
            rows += [move.index] * (len(self._b) - len(rows))
        return Bent(self._b.finish(self._toolpath.findings), np.array(rows, dtype=np.int64))

    def _enter(self, point: Point) -> None:
        """From here on the play is that of the region around a point."""
        for drive, found in zip(self._drives, self._regions.residuals(point), strict=True):
            drive.residual = found

    def _place(self) -> Point:
        x, y, z = (drive.at for drive in self._drives)
        return x, y, z

    def _line(self, move: Move) -> None:
        """To where the drives now stand, if that is elsewhere."""
        if math.dist(self._b.position, self._place()) > AHEAD_MM:
            self._b.line(*self._place(), feed=_feed(move))

    def _cut(self, stretch: Stretch, move: Move) -> None:
        """A stretch at a feed: take up, overshoot, hold, and follow."""
        self._overshoot(stretch, move)
        for drive, begin, end in zip(self._drives, stretch.begin, stretch.end, strict=True):
            drive.sense = drive.sense_of(begin, end)
            ask = drive.asked(begin, drive.sense)
            if (ask - drive.at) * drive.sense > AHEAD_MM:
                drive.at = ask
        self._line(move)
        shares = [self._joins(index, stretch) for index in range(3)]
        low = 0.0
        for high in sorted({share for share in shares if 0.0 < share < 1.0} | {1.0}):
            self._follow(stretch.part(low, high), [share <= low for share in shares], move)
            low = high

    def _overshoot(self, stretch: Stretch, move: Move) -> None:
        """Before a reversal that the controller compensates too much: out, and one step back."""
        back = []
        for drive, begin, end in zip(self._drives, stretch.begin, stretch.end, strict=True):
            sense = drive.sense_of(begin, end)
            excess = (drive.at - drive.asked(begin, sense)) * sense
            if sense != drive.sense and excess > AHEAD_MM:
                thrown = (drive.asked(begin, drive.sense) - drive.asked(begin, sense)) * sense
                drive.at -= max(excess - (1.0 - OVERSHOOT) * thrown, 0.0) * sense
                back.append((drive, sense))
        if back:
            self._line(move)
            for drive, sense in back:
                drive.at += drive.step_mm * sense
                drive.sense = sense
            self._line(move)

    def _joins(self, index: int, stretch: Stretch) -> float:
        """The share of the stretch from which on an axis follows it: 0 unless it stands ahead."""
        drive = self._drives[index]
        begin, end = stretch.begin[index], stretch.end[index]
        ahead = (drive.at - drive.asked(begin, drive.sense)) * drive.sense
        if ahead <= AHEAD_MM:
            return 0.0
        if ahead >= abs(end - begin):
            return 1.0
        return stretch.where(index, drive.at + drive.residual.error_mm(drive.sense))

    def _follow(self, part: Stretch, follows: list[bool], move: Move) -> None:
        """One part of a stretch, on which each axis either follows or holds."""
        offsets = []
        for drive, begin, end, moves in zip(
            self._drives, part.begin, part.end, follows, strict=True
        ):
            offsets.append(drive.asked(0.0, drive.sense))
            if moves and begin != end:
                drive.at = drive.asked(end, drive.sense)
        if part.centre is None or not (follows[0] and follows[1]):
            self._line(move)
            return
        centre = (part.centre[0] + offsets[0], part.centre[1] + offsets[1])
        ccw = move.kind == Kind.ARC_CCW
        self._b.arc(*self._place(), centre=centre, ccw=ccw, feed=_feed(move))

    def _event(self, move: Move) -> None:
        homes = {Kind.HOME_XY: (0, 1), Kind.HOME_Z: (2,)}.get(move.kind, ())
        if move.kind == Kind.MESSAGE and move.value is not None:
            self._b.message(self._toolpath.texts[int(move.value)])
        else:
            self._b.event(move.kind, move.value)
        for index in homes:
            drive = self._drives[index]
            if drive.at != self._home[index]:
                drive.sense = 1 if self._home[index] > drive.at else -1
            drive.at = self._home[index]
        self._b.moved_to(*self._place())


def _step_mm(axis: Axis) -> float:
    """The least whole number of steps that a program can say."""
    steps = to_steps(axis.resolution_mm or 0.0, axis.coded_step_mm)
    return max(1.0, float(steps)) * axis.coded_step_mm


def _feed(move: Move) -> float:
    return math.nan if move.feed is None else move.feed
