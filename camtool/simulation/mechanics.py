"""Three axes between the controller's steps and the slides: compensation, play, real step."""

from __future__ import annotations

import numpy as np

from camtool.kernels.lattice import to_steps
from camtool.kernels.play import play_fill, play_limits, play_start
from camtool.machine.model import Machine
from camtool.simulation.motion import Floats, Ints


class Mechanics:
    """The slides of a machine, engaged as its controller record says, at rest at `start` (3,)
    steps. Scale errors act about part zero. `ideal`: no play, no compensation, real = coded step.
    """

    def __init__(self, machine: Machine, start: Ints, *, ideal: bool) -> None:
        direction = 1 if machine.controller.start_direction == "+" else -1
        self._axes = np.zeros((3, 4))
        self._states = np.zeros((3, 6))
        self.compensation = np.zeros(3, dtype=np.int64)
        """(3,) steps that the controller adds at each reversal."""
        for index, axis in enumerate(machine.axes):
            step_mm = axis.coded_step_mm
            low = high = 0.0
            if not ideal:
                step_mm = axis.real_step_mm
                low, high = play_limits(axis.backlash_mm, machine.controller.start_play, direction)
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
