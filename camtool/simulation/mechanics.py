"""Three axes between the controller and the slides: compensation, play, real step."""

from __future__ import annotations

import numpy as np

from camtool.kernels.lattice import to_steps
from camtool.kernels.play import play_fill, play_limits, play_start
from camtool.machine.model import Machine
from camtool.simulation.motion import Floats, Ints
from camtool.simulation.options import Effects

REVERSAL_STEPS = 0.5
"""An axis has reversed when it came back by this much of a coded step."""


class Mechanics:
    """The slides of a machine, engaged as its controller record says, at rest at `start_mm` (3,).

    Scale errors act about part zero; compensation is whole steps; `effects` says what there is.
    """

    def __init__(self, machine: Machine, start_mm: Floats, effects: Effects) -> None:
        direction = 1 if machine.controller.start_direction == "+" else -1
        self.compensation_steps = np.zeros(3, dtype=np.int64)
        """(3,) steps that the controller adds at each reversal."""
        self.axes = np.zeros((3, 5))
        """(3, 5) of `play_fill`, in mm."""
        self.states = np.zeros((3, 4))
        """(3, 4) of `play_fill`, in mm."""
        for index, axis in enumerate(machine.axes):
            coded_mm = axis.coded_step_mm
            scale = axis.real_step_mm / coded_mm if effects.scale else 1.0
            play_mm = axis.backlash_mm if effects.play else 0.0
            low, high = play_limits(play_mm, machine.controller.start_play, direction)
            if effects.compensation:
                self.compensation_steps[index] = to_steps(axis.compensation_mm, coded_mm)
            added_mm = float(self.compensation_steps[index]) * coded_mm
            self.axes[index] = scale, low, high, added_mm, REVERSAL_STEPS * coded_mm
            self.states[index] = play_start(float(start_mm[index]), scale, direction)

    def follow(self, commanded_mm: Floats, offsets: Ints) -> tuple[Floats, Ints]:
        """Slides (K, 3) mm for the controller's positions (K, 3) mm, which follow those given
        before, and the reversals (R, 3) in each run offsets[r]:offsets[r+1] of them."""
        slide = np.empty(commanded_mm.shape)
        reversals = np.zeros((len(offsets) - 1, 3), dtype=np.int64)
        play_fill(commanded_mm, offsets, self.axes, self.states, slide, reversals)
        return slide, reversals

    def place(self, position_mm: Floats) -> None:
        """The controller stands at `position_mm` (3,) without having reversed: what follows an
        arc that was left at its nearest approach."""
        self.states[:, 0] = position_mm
