"""The mechanics of three axes, one position after the other, by the words of docs/mechanics.md.

`PulsedAxis` is a nut on a screw in whole numbers; `LiteralMechanics` a machine in mm, with the
same roundings as the kernels, written with loops and conditions only.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from camtool.machine.model import Axis, Machine, PlayCells
from camtool.simulation.motion import Effects

WORD = 1 << 64


def split_mix_64(state: int, count: int) -> list[int]:
    """The first outputs of the generator SplitMix64 from a state."""
    found = []
    for _ in range(count):
        state = (state + 0x9E3779B97F4A7C15) % WORD
        z = state
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) % WORD
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) % WORD
        found.append(z ^ (z >> 31))
    return found


def deviates(seed: int, stream: int, count: int) -> list[float]:
    """The first numbers of a stream: sums of twelve 16-bit numbers, less their mean, in 2¹⁶."""
    key = split_mix_64((seed + stream * 0x9E3779B97F4A7C15) % WORD, 1)[0]
    words = split_mix_64(key, 3 * count)
    found = []
    for n in range(count):
        bits = b"".join(word.to_bytes(8, "little") for word in words[3 * n : 3 * n + 3])
        parts = [int.from_bytes(bits[at : at + 2], "little") for at in range(0, 24, 2)]
        found.append(sum(parts) / 65536 - 12 * 32767.5 / 65536)
    return found


@dataclass
class PulsedAxis:
    """An axis in whole numbers: the nut has a flank `low` and one `high` away from the motor."""

    low: int
    high: int
    compensation: int
    direction: int
    motor: int = 0
    slide: int = 0
    reversals: int = 0

    def go(self, sense: int) -> int:
        """Make one step of the program, or none (0), and return the slide."""
        if sense != 0:
            self.pulse(sense)
        return self.slide

    def pulse(self, sense: int) -> None:
        """Make one step of the program, after the compensation if the axis reverses."""
        pulses = 1
        if sense != self.direction:
            self.direction = sense
            self.reversals += 1
            pulses += self.compensation
        for _ in range(pulses):
            self.motor += sense
            if self.slide < self.motor + self.low:
                self.slide += 1
            if self.slide > self.motor + self.high:
                self.slide -= 1


def cell_play(cells: PlayCells, x: float, y: float) -> float:
    """The play of the cell that (x, y) of the table lies in, or of the nearest one."""
    column = row = 0
    while column < len(cells.play_mm[0]) - 1 and x >= cells.x_mm[column + 1]:
        column += 1
    while row < len(cells.play_mm) - 1 and y >= cells.y_mm[row + 1]:
        row += 1
    return cells.play_mm[row][column]


class LiteralAxis:
    """One axis in mm."""

    def __init__(
        self, axis: Axis, cells: PlayCells | None, start: float, machine: Machine, effects: Effects
    ) -> None:
        control = machine.controller
        self.play = axis.backlash_mm if effects.play else 0.0
        self.cells = cells if machine.play_map.use and effects.play else None
        self.centred = control.start_play == "centred"
        self.first = self.direction = 1 if control.start_direction == "+" else -1
        self.coded = axis.coded_step_mm
        self.scale = axis.real_step_mm / axis.coded_step_mm if effects.scale else 1.0
        steps = math.floor(axis.compensation_mm / axis.coded_step_mm + 0.5)
        self.compensation = steps * axis.coded_step_mm if effects.compensation else 0.0
        self.sigma = axis.repeatability_mm if effects.repeatability else 0.0
        self.furthest, self.added, self.shift, self.reversals = start, 0.0, 0.0, 0
        self.slide = start * self.scale

    def flanks(self, x: float, y: float) -> tuple[float, float]:
        """Return the distances of slide and motor at which the flanks touch, to − and to +."""
        play = self.play if self.cells is None else cell_play(self.cells, x, y)
        if self.centred:
            return -play / 2, play / 2
        return (0.0, play) if self.first == 1 else (-play, 0.0)

    def go(self, to: float, x: float, y: float, draws: Sequence[float]) -> bool:
        """To a commanded position; whether the axis has reversed."""
        back = self.furthest - to if self.direction == 1 else to - self.furthest
        turned = back >= self.coded / 2
        if turned:
            self.direction = -self.direction
            self.added = self.added + self.direction * self.compensation
            self.shift = self.sigma * draws[self.reversals]
            self.reversals += 1
        if turned or back <= 0.0:
            self.furthest = to
        motor = (to + self.added) * self.scale + self.shift
        low, high = self.flanks(x, y)
        if self.slide < motor + low:
            self.slide = motor + low
        if self.slide > motor + high:
            self.slide = motor + high
        return turned


class LiteralMechanics:
    """Three axes in mm; `draws` numbers of each axis's random stream are at hand."""

    def __init__(
        self, machine: Machine, start: Sequence[float], effects: Effects, draws: int = 1000
    ) -> None:
        cells = (machine.play_map.x, machine.play_map.y, None)
        self.axes = [
            LiteralAxis(axis, own, at, machine, effects)
            for axis, own, at in zip(machine.axes, cells, start, strict=True)
        ]
        self.draws = [deviates(machine.mechanics.seed, index, draws) for index in range(3)]
        self.zero = machine.controller.machine_zero_mm
        self.lean = math.tan(machine.mechanics.squareness_rad) if effects.squareness else 0.0

    def go(self, point: Sequence[float]) -> tuple[tuple[float, ...], tuple[bool, ...]]:
        """The slides at a commanded position, and which axes have reversed."""
        x, y = point[0] - self.zero[0], point[1] - self.zero[1]
        turned = tuple(
            axis.go(to, x, y, draws)
            for axis, to, draws in zip(self.axes, point, self.draws, strict=True)
        )
        sx, sy, sz = (axis.slide for axis in self.axes)
        return (sx + sy * self.lean, sy, sz), turned
