"""What play and its compensation leave over: how far off the slides stand, by direction.

An axis that has been driven in one direction for longer than its play stands at a fixed distance
from where the controller believes it to be. With the play operator of `camtool.kernels.play`,
low ≤ slide − motor ≤ high, and c added at each reversal from the direction engaged at first:

    in the first direction:   motor = position,       in the other one:   motor = position ∓ c,
    driven towards +:         slide = motor + low,    towards −:          slide = motor + high.

The difference of the two is |play − c|. Compensation as exact as the play would leave none; the
PIC machine's leaves 11.5 µm in X and 9.5 µm in Y (docs/decisions/0005-play.md).

Where the play changes with the region of the table, an axis is taken with the one that leaves most
over: where a contour is divided then hangs on its shape alone, not on where it lies, and what is
told to be left over is left nowhere else.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain

import msgspec

from camtool.machine.controllers import Controller
from camtool.machine.model import Axis, Machine, PlayCells


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


def plays_mm(axis: Axis, cells: PlayCells | None) -> tuple[float, ...]:
    """The play of an axis in every region of the table, mm."""
    return (axis.backlash_mm,) if cells is None else tuple(chain.from_iterable(cells.play_mm))


def loosest(machine: Machine) -> tuple[Axis, Axis]:
    """X and Y with the largest play of all regions."""
    x, y, _ = (
        msgspec.structs.replace(axis, backlash_mm=max(plays_mm(axis, cells)))
        for axis, cells in zip(machine.axes, machine.play_map.used, strict=True)
    )
    return x, y


def residuals(machine: Machine) -> tuple[Residual, Residual]:
    """X and Y of a machine, each in the region where compensation leaves most over."""
    x, y, _ = (
        max(
            (
                residual(msgspec.structs.replace(axis, backlash_mm=play), machine.controller)
                for play in plays_mm(axis, cells)
            ),
            key=lambda one: abs(one.plus_mm - one.minus_mm),
        )
        for axis, cells in zip(machine.axes, machine.play_map.used, strict=True)
    )
    return x, y


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
