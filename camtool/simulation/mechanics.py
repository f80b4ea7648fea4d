"""Three axes between the controller and the slides: what the machine makes of the commands.

In the order in which it happens: compensation, real step, play (by region), scatter (see
`camtool.kernels.play`), squareness. docs/mechanics.md says what each of them is.

Squareness. The slide of Y runs towards Y, and towards X by tan q of its way, where q is by how
much the angle between +X and +Y is less than a right one (Y leans towards +X when q > 0):

    x = x_slide + y_slide · tan q,      y = y_slide.

Y's real step is thus measured square to X, as a part is. A square of side a that is commanded
has a longer diagonal towards (+, +) when q > 0: their squares differ by 4 a² tan q.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.kernels.lattice import to_steps
from camtool.kernels.play import play_fill, play_limits, play_start, play_varied_fill
from camtool.machine.model import Axis, Machine, PlayCells
from camtool.simulation.motion import Effects

REVERSAL_STEPS = 0.5
"""An axis has reversed when it has come back by this much of a coded step."""


@dataclass(frozen=True)
class _Varied:
    """What `play_varied_fill` takes besides: each axis's play in mm (3,) and the cells that take
    its place; where machine zero is; which shares of the play lie to either side; scatter."""

    plays: Floats
    cells: tuple[PlayCells | None, ...]
    zero: Floats
    shares: Floats
    scatter: Floats
    seed: int

    def at(self, commanded_mm: Floats) -> Floats:
        """The play (K, 3) mm at each position (K, 3) mm."""
        plays = np.tile(self.plays, (len(commanded_mm), 1))
        x, y = commanded_mm[:, 0] - self.zero[0], commanded_mm[:, 1] - self.zero[1]
        for axis, cells in enumerate(self.cells):
            if cells is not None:
                column = np.searchsorted(cells.x_mm[1:-1], x, side="right")
                row = np.searchsorted(cells.y_mm[1:-1], y, side="right")
                plays[:, axis] = np.array(cells.play_mm)[row, column]
        return plays


class Mechanics:
    """The slides of a machine, engaged as its controller record says, at rest at `start_mm` (3,).

    Scale and squareness act about part zero; compensation is whole steps; `effects` says what
    there is.
    """

    def __init__(self, machine: Machine, start_mm: Floats, effects: Effects) -> None:
        direction = 1 if machine.controller.start_direction == "+" else -1
        convention = machine.controller.start_play
        self.compensation_steps = np.zeros(3, dtype=np.int64)
        """(3,) steps that the controller adds at each reversal."""
        self.axes = np.zeros((3, 5))
        """(3, 5) of `play_fill`, in mm."""
        self.states = np.zeros((3, 6))
        """(3, 6) of `play_fill`, in mm."""
        for index, axis in enumerate(machine.axes):
            coded_mm = axis.coded_step_mm
            scale = axis.real_step_mm / coded_mm if effects.scale else 1.0
            low, high = play_limits(_play_mm(axis, effects), convention, direction)
            if effects.compensation:
                self.compensation_steps[index] = to_steps(axis.compensation_mm, coded_mm)
            added_mm = float(self.compensation_steps[index]) * coded_mm
            self.axes[index] = scale, low, high, added_mm, REVERSAL_STEPS * coded_mm
            self.states[index] = play_start(float(start_mm[index]), scale, direction)
        self._lean = math.tan(machine.mechanics.squareness_rad) if effects.squareness else 0.0
        shares = np.array(play_limits(1.0, convention, direction))
        self._varied = _varied(machine, effects, shares)

    @property
    def plain(self) -> bool:
        """Whether `axes` and `states` say everything: play is the same everywhere, nothing
        scatters, X and Y are square."""
        return self._varied is None and self._lean == 0.0

    def follow(self, commanded_mm: Floats, offsets: Ints) -> tuple[Floats, Ints]:
        """Slides (K, 3) mm for the controller's positions (K, 3) mm, which follow those given
        before, and the reversals (R, 3) in each run offsets[r]:offsets[r+1] of them."""
        slide = np.empty(commanded_mm.shape)
        reversals = np.zeros((len(offsets) - 1, 3), dtype=np.int64)
        given = commanded_mm, offsets, self.axes, self.states
        if self._varied is None:
            play_fill(*given, slide, reversals)
        else:
            v = self._varied
            plays = v.at(commanded_mm)
            play_varied_fill(*given, plays, v.shares, v.scatter, v.seed, slide, reversals)
        if self._lean:
            slide[:, 0] += slide[:, 1] * self._lean
        return slide, reversals

    def place(self, position_mm: Floats) -> None:
        """The controller stands at `position_mm` (3,) without having reversed: what follows an
        arc that was left at its nearest approach."""
        self.states[:, 0] = position_mm


def _play_mm(axis: Axis, effects: Effects) -> float:
    return axis.backlash_mm if effects.play else 0.0


def _varied(machine: Machine, effects: Effects, shares: Floats) -> _Varied | None:
    """None where `play_fill` does."""
    axes = list(machine.axes)
    cells = machine.play_map.used if effects.play else (None, None, None)
    scatter = [axis.repeatability_mm if effects.repeatability else 0.0 for axis in axes]
    if not any(cells) and not any(scatter):
        return None
    return _Varied(
        plays=np.array([_play_mm(axis, effects) for axis in axes]),
        cells=cells,
        zero=np.array(machine.controller.machine_zero_mm, dtype=np.float64),
        shares=shares,
        scatter=np.array(scatter),
        seed=machine.mechanics.seed,
    )
