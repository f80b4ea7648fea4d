"""Three axes between the controller and the slides: compensation, play, real step.

`Mechanics` follows a controller that gives steps, `PathMechanics` one that gives positions.
"""

from __future__ import annotations

import numpy as np

from camtool.kernels.lattice import to_steps
from camtool.kernels.play import play_fill, play_limits, play_path_fill, play_start
from camtool.machine.model import Machine
from camtool.simulation.motion import Floats, Ints
from camtool.simulation.options import Effects


class Mechanics:
    """The slides of a machine, engaged as its controller record says, at rest at `start` (3,)
    steps. Scale errors act about part zero; `effects` says what there is."""

    def __init__(self, machine: Machine, start: Ints, effects: Effects) -> None:
        direction = 1 if machine.controller.start_direction == "+" else -1
        self._axes = np.zeros((3, 4))
        self._states = np.zeros((3, 6))
        self.compensation = np.zeros(3, dtype=np.int64)
        """(3,) steps that the controller adds at each reversal."""
        for index, axis in enumerate(machine.axes):
            step_mm = axis.real_step_mm if effects.scale else axis.coded_step_mm
            play_mm = axis.backlash_mm if effects.play else 0.0
            low, high = play_limits(play_mm, machine.controller.start_play, direction)
            if effects.compensation:
                self.compensation[index] = to_steps(axis.compensation_mm, axis.coded_step_mm)
            self._axes[index] = step_mm, low, high, self.compensation[index]
            self._states[index] = play_start(int(start[index]), step_mm, direction)

    def follow(self, steps: Ints) -> tuple[Floats, Ints, Ints]:
        """Slides (K, 3) mm for the controller's positions (K, 3) steps, which follow those given
        before; with the reversals (3,) and the steps travelled (3,) on the way."""
        before = self._states[:, 4:6].copy()
        slide = np.empty(steps.shape)
        for index in range(3):
            play_fill(steps[:, index], self._axes[index], self._states[index], slide[:, index])
        counted = (self._states[:, 4:6] - before).astype(np.int64)
        return slide, counted[:, 0], counted[:, 1]

    def place(self, position: Ints) -> None:
        """The controller stands at `position` (3,) steps without having reversed: what follows
        an arc that was left at its nearest approach."""
        self._states[:, 0] = position


REVERSAL_STEPS = 0.5
"""An axis has reversed when it came back by this much of a coded step."""


class PathMechanics:
    """The slides behind a motor that follows positions in mm, engaged as the controller record
    says, at rest at `start` (3,) mm. Scale errors act about part zero; compensation is whole
    steps; `effects` says what there is."""

    def __init__(self, machine: Machine, start: Floats, effects: Effects) -> None:
        direction = 1 if machine.controller.start_direction == "+" else -1
        self._axes = np.zeros((3, 5))
        self._states = np.zeros((3, 5))
        for index, axis in enumerate(machine.axes):
            scale = axis.real_step_mm / axis.coded_step_mm if effects.scale else 1.0
            play_mm = axis.backlash_mm if effects.play else 0.0
            low, high = play_limits(play_mm, machine.controller.start_play, direction)
            steps = to_steps(axis.compensation_mm, axis.coded_step_mm)
            compensation_mm = float(steps) * axis.coded_step_mm if effects.compensation else 0.0
            least = REVERSAL_STEPS * axis.coded_step_mm
            self._axes[index] = scale, low, high, compensation_mm, least
            self._states[index] = start[index], direction, 0.0, start[index] * scale, 0.0

    def follow(self, positions: Floats, offsets: Ints) -> tuple[Floats, Ints]:
        """Slides (K, 3) mm for positions (K, 3) mm, which follow those given before, and the
        reversals (R, 3) in each run offsets[r]:offsets[r+1] of them."""
        slide = np.empty(positions.shape)
        reversals = np.zeros((len(offsets) - 1, 3), dtype=np.int64)
        for index in range(3):
            play_path_fill(
                positions[:, index],
                offsets,
                self._axes[index],
                self._states[index],
                slide[:, index],
                reversals[:, index],
            )
        return slide, reversals
