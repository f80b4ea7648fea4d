"""A whole program on the PIC18F8720 and its slides, literally: one row, one pass, one step.

Written from the rules of the machine alone; for small programs whose arcs meet their ends.
Shares the literal interpolators of `tests.oracles.controllers`, nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from fractions import Fraction

from camtool.machine.model import Axis, Machine
from camtool.toolpath.moves import Kind, Move, Toolpath
from tests.oracles import controllers

Passes = Iterator[tuple[tuple[int, int], bool]]


@dataclass
class LiteralAxis:
    """One axis: what the controller counts, what the motor did, where the slide is."""

    axis: Axis
    start_play: str
    direction: int
    at: int
    reversals: int = 0
    pulses: int = 0
    extra: int = 0
    motor: int = field(init=False)
    slide: float = field(init=False)

    def __post_init__(self) -> None:
        self.motor = self.at
        self.slide = self.at * self.axis.real_step_mm
        play = self.axis.backlash_mm
        if self.start_play == "centred":
            self.low, self.high = -play / 2, play / 2
        elif self.direction == 1:
            self.low, self.high = 0.0, play
        else:
            self.low, self.high = -play, 0.0

    def pulse(self, sense: int) -> None:
        """Make one step of the program in this sense, with the compensation before it."""
        if sense != self.direction:
            self.direction = sense
            self.reversals += 1
            wanted = self.axis.compensation_mm / self.axis.coded_step_mm
            for _ in range(math.floor(wanted + 0.5)):
                self._motor_step(sense)
                self.extra += 1
        self._motor_step(sense)
        self.at += sense
        self.pulses += 1

    def _motor_step(self, sense: int) -> None:
        self.motor += sense
        motor = self.motor * self.axis.real_step_mm
        self.slide = min(max(self.slide, motor + self.low), motor + self.high)


@dataclass
class LiteralRow:
    """The motion of a row: samples (x, y, z) in steps and mm, seconds, passes, sums per axis."""

    commanded: list[tuple[int, ...]] = field(default_factory=list)
    slide: list[tuple[float, ...]] = field(default_factory=list)
    seconds: float = 0.0
    passes: int = 0
    steps: tuple[int, ...] = (0, 0, 0)
    reversals: tuple[int, ...] = (0, 0, 0)


def decimal_steps(mm: float, step_mm: float) -> int:
    """To the nearest step, halves away from zero, of the decimal number that was written."""
    exact = Fraction(repr(mm)) / Fraction(repr(step_mm))
    steps = math.floor(abs(exact) + Fraction(1, 2))
    return steps if exact >= 0 else -steps


class LiteralRun:
    """The rows of a toolpath, one after the other."""

    def __init__(self, toolpath: Toolpath, machine: Machine) -> None:
        self.toolpath, self.machine = toolpath, machine
        control = machine.controller
        direction = 1 if control.start_direction == "+" else -1
        self.axes = [
            LiteralAxis(axis, control.start_play, direction, decimal_steps(mm, axis.coded_step_mm))
            for axis, mm in zip(machine.axes, toolpath.start.tolist(), strict=True)
        ]

    def rows(self) -> list[LiteralRow]:
        """All rows."""
        return [self.row(move) for move in self.toolpath]

    def row(self, move: Move) -> LiteralRow:
        """Run one row."""
        result = LiteralRow()
        before = [(a.pulses, a.reversals) for a in self.axes]
        if move.kind == Kind.DWELL:
            result.seconds = move.value or 0.0
        if move.kind <= Kind.ARC_CCW:
            end = [
                decimal_steps(mm, axis.axis.coded_step_mm)
                for mm, axis in zip(move.end, self.axes, strict=True)
            ]
            if move.kind <= Kind.LINE:
                self.line(move, end[:2], [0, 1], result)
            else:
                self.arc(move, end, result)
            self.line(move, end[2:], [2], result)
        after = [(a.pulses, a.reversals) for a in self.axes]
        result.steps = tuple(b[0] - a[0] for a, b in zip(before, after, strict=True))
        result.reversals = tuple(b[1] - a[1] for a, b in zip(before, after, strict=True))
        return result

    def line(self, move: Move, end: list[int], axes: list[int], result: LiteralRow) -> None:
        """A DDA line of these axes."""
        way = [to - self.axes[axis].at for to, axis in zip(end, axes, strict=True)]
        size = [abs(w) for w in way] + [0]
        sign = [1 if w > 0 else -1 for w in way]
        origin = [self.axes[axis].at for axis in axes]
        for point, pulse in controllers.dda_line(size[0], size[1]):
            place = [o + s * p for o, s, p in zip(origin, sign, point, strict=False)]
            self.output(move, axes, place, pulse, result)

    def arc(self, move: Move, end: list[int], result: LiteralRow) -> None:
        """An arc by the controller's method, until its end is met."""
        assert move.centre is not None
        step = self.axes[0].axis.coded_step_mm
        cx, cy = (decimal_steps(mm, step) for mm in move.centre)
        x, y = self.axes[0].at - cx, self.axes[1].at - cy
        square = x * x + y * y
        if self.machine.controller.initial_error == "rounded-radius":
            square = round(math.sqrt(square)) ** 2
        clockwise = move.kind == Kind.ARC_CW
        for (px, py), pulse in self.passes(x, y, clockwise, square):
            self.output(move, [0, 1], [cx + px, cy + py], pulse, result)
            if pulse and [cx + px, cy + py] == end[:2]:
                return

    def passes(self, x: int, y: int, clockwise: bool, square: int) -> Passes:
        """Passes of the controller's arc method."""
        method = self.machine.controller.arcs
        if method == "dda":
            return controllers.dda_arc(x, y, clockwise)
        if method == "stairs":
            return ((p, True) for p in controllers.stairs(x, y, clockwise, square))
        error = x * x + y * y - square
        return ((p, True) for p in controllers.direct_search(x, y, clockwise, error))

    def output(
        self, move: Move, axes: list[int], place: list[int], pulse: bool, result: LiteralRow
    ) -> None:
        """Add the pulses, time and sample of one pass."""
        result.passes += 1
        coded = self.axes[axes[0]].axis.coded_step_mm
        if move.feed is None:
            period = 1.0 / self.machine.limits.rapid_step_rate_hz
        else:
            period = 1.0 / (move.feed / 60.0 / coded)
        extra = sum(axis.extra for axis in self.axes)
        for index, wanted in zip(axes, place, strict=True):
            axis = self.axes[index]
            if wanted != axis.at:
                axis.pulse(1 if wanted > axis.at else -1)
        periods = sum(axis.extra for axis in self.axes) - extra
        if pulse or self.machine.controller.time_base == "iteration":
            periods += 1
        result.seconds += periods * period
        if pulse:
            result.commanded.append(tuple(axis.at for axis in self.axes))
            result.slide.append(tuple(axis.slide for axis in self.axes))
