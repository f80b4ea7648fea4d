"""The mechanics: how the slides of three axes follow the positions that the controller commands.

The effects act in this order: compensation, real step, backlash (by region) and scatter (see
`camtool.kernels.play`), squareness. docs/mechanics.md explains them.

Squareness. When the slide of Y moves by y, it also moves towards X by y · tan q, where q is the
amount by which the angle between +X and +Y is less than 90° (for q > 0, Y leans towards +X):

    x = x_slide + y_slide · tan q,      y = y_slide.

The real step of Y is thus measured square to X, as on a part. For q > 0 a commanded square of side
a has a longer diagonal towards (+, +): the squares of its diagonals differ by 4 a² tan q."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.kernels.lattice import to_steps
from camtool.kernels.play import play_fill, play_limits, play_start, play_varied_fill
from camtool.machine.model import Axis, Machine, PlayCells
from camtool.simulation.motion import Effects

REVERSAL_STEPS = 0.5
"""An axis has reversed when it has moved back by this part of a coded step."""


class _Varied(Struct, frozen=True):
    """Additional arguments of `play_varied_fill`: the backlash (3,), mm, of the axes, and the
    cells that replace it by region; the position of machine zero (3,), mm; the shares of the
    backlash on either side; the scatter (3,), mm, and its seed."""

    backlash: Floats
    cells: tuple[PlayCells | None, ...]
    zero: Floats
    shares: Floats
    scatter: Floats
    seed: int

    def at(self, commanded_mm: Floats) -> Floats:
        """Return the backlash (K, 3) mm at each position (K, 3) mm."""
        backlash = np.tile(self.backlash, (len(commanded_mm), 1))
        x, y = commanded_mm[:, 0] - self.zero[0], commanded_mm[:, 1] - self.zero[1]
        for axis, cells in enumerate(self.cells):
            if cells is not None:
                column = np.searchsorted(cells.x_mm[1:-1], x, side="right")
                row = np.searchsorted(cells.y_mm[1:-1], y, side="right")
                backlash[:, axis] = np.array(cells.play_mm)[row, column]
        return backlash


class Mechanics:
    """The slides of a machine, at rest at `start_mm` (3,) and engaged as its controller record
    says.

    Scale and squareness act about part zero; compensation is in whole steps; only the `effects`
    act."""

    def __init__(self, machine: Machine, start_mm: Floats, effects: Effects) -> None:
        direction = 1 if machine.controller.start_direction == "+" else -1
        convention = machine.controller.start_play
        self.compensation_steps = np.zeros(3, dtype=np.int64)
        """(3,) steps that the controller adds at each reversal."""
        self._coded_mm = [axis.coded_step_mm for axis in machine.axes]
        self.axes = np.zeros((3, 5))
        """(3, 5) of `play_fill`, in mm."""
        self.states = np.zeros((3, 6))
        """(3, 6) of `play_fill`, in mm."""
        for index, axis in enumerate(machine.axes):
            coded_mm = axis.coded_step_mm
            scale = axis.real_step_mm / coded_mm if effects.scale else 1.0
            low, high = play_limits(_backlash_mm(axis, effects), convention, direction)
            if effects.compensation:
                self.compensation_steps[index] = to_steps(axis.compensation_mm, coded_mm)
            added_mm = float(self.compensation_steps[index]) * coded_mm
            self.axes[index] = scale, low, high, added_mm, REVERSAL_STEPS * coded_mm
            self.states[index] = play_start(float(start_mm[index]), scale, direction)
        self.lean = math.tan(machine.mechanics.squareness_rad) if effects.squareness else 0.0
        """Tangent of the squareness: how far Y leans towards X."""
        shares = np.array(play_limits(1.0, convention, direction))
        self._varied = _varied(machine, effects, shares)

    @property
    def even(self) -> bool:
        """True if `axes`, `states` and `lean` hold all of the mechanics: backlash is the same
        everywhere, and nothing scatters."""
        return self._varied is None

    @property
    def plain(self) -> bool:
        """True if `axes` and `states` alone hold all of it: X and Y are square, too."""
        return self.even and self.lean == 0.0

    def follow(self, commanded_mm: Floats, offsets: Ints) -> tuple[Floats, Ints]:
        """Return the positions of the slides (K, 3), mm, for commanded positions (K, 3), mm, which
        continue those of the last call; and the reversals (R, 3) of the axes in each run
        offsets[r]:offsets[r+1] of these positions."""
        slide = np.empty(commanded_mm.shape)
        reversals = np.zeros((len(offsets) - 1, 3), dtype=np.int64)
        arguments = commanded_mm, offsets, self.axes, self.states
        if self._varied is None:
            play_fill(*arguments, slide, reversals)
        else:
            v = self._varied
            backlash = v.at(commanded_mm)
            play_varied_fill(*arguments, backlash, v.shares, v.scatter, v.seed, slide, reversals)
        if self.lean:
            slide[:, 0] += slide[:, 1] * self.lean
        return slide, reversals

    def compensate(self, axis: int, steps: int) -> None:
        """Set the steps that the controller adds at each reversal of an axis from now on."""
        self.compensation_steps[axis] = steps
        self.axes[axis, 3] = steps * self._coded_mm[axis]

    def place(self, position_mm: Floats) -> None:
        """Set the position of the controller to `position_mm` (3,) without counting a reversal, as
        after an arc that was left at its nearest approach to the end."""
        self.states[:, 0] = position_mm


def _backlash_mm(axis: Axis, effects: Effects) -> float:
    return axis.backlash_mm if effects.play else 0.0


def _varied(machine: Machine, effects: Effects, shares: Floats) -> _Varied | None:
    """Return the additional arguments of `play_varied_fill` (backlash by region, scatter); None
    where `play_fill` is enough."""
    axes = list(machine.axes)
    cells = machine.play_map.used if effects.play else (None, None, None)
    scatter = [axis.repeatability_mm if effects.repeatability else 0.0 for axis in axes]
    if not any(cells) and not any(scatter):
        return None
    return _Varied(
        backlash=np.array([_backlash_mm(axis, effects) for axis in axes]),
        cells=cells,
        zero=np.array(machine.controller.machine_zero_mm, dtype=np.float64),
        shares=shares,
        scatter=np.array(scatter),
        seed=machine.mechanics.seed,
    )
