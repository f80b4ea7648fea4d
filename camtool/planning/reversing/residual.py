"""What play and its compensation leave over: how far off the slides stand, by direction.

An axis that has been driven in one direction for longer than its play stands at a fixed distance
from where the controller believes it to be. With the play operator of `camtool.kernels.play`,
low ≤ slide − motor ≤ high, and c added at each reversal from the direction engaged at first:

    in the first direction:   motor = position,       in the other one:   motor = position ∓ c,
    driven towards +:         slide = motor + low,    towards −:          slide = motor + high.

The difference of the two is |play − c|. Compensation as exact as the play would leave none; the
PIC machine's leaves 11.5 µm in X and 9.5 µm in Y (docs/decisions/0005-play.md).
"""

from __future__ import annotations

from dataclasses import dataclass

from camtool.machine.controllers import Controller
from camtool.machine.model import Axis, Machine


@dataclass(frozen=True)
class Residual:
    """One axis: the error of its slide in mm when driven towards − and towards +; `matters`:
    there is play or compensation; `better`: the direction ±1 of the smaller error (where both are
    alike, the one in which the axis is engaged at first)."""

    minus_mm: float
    plus_mm: float
    matters: bool
    better: int

    def error_mm(self, sense: int) -> float:
        """The error when driven towards `sense` ±1."""
        return self.plus_mm if sense > 0 else self.minus_mm


def residuals(machine: Machine) -> tuple[Residual, Residual]:
    """X and Y of a machine."""
    x, y, _ = machine.axes
    return residual(x, machine.controller), residual(y, machine.controller)


def residual(axis: Axis, controller: Controller) -> Residual:
    """One axis of a machine with this controller."""
    from camtool.kernels.play import play_limits

    first = 1 if controller.start_direction == "+" else -1
    low, high = play_limits(axis.backlash_mm, controller.start_play, first)
    errors = {1: low, -1: high}
    errors[-first] -= first * axis.compensation_mm
    better = first if abs(errors[first]) <= abs(errors[-first]) else -first
    matters = axis.backlash_mm > 0.0 or axis.compensation_mm > 0.0
    return Residual(errors[-1], errors[1], matters, better)
