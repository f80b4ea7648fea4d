"""Both stages in their order."""

from __future__ import annotations

from camtool.machine.model import Machine
from camtool.planning.compensating.linear import motor_path
from camtool.planning.compensating.take_up import taken_up
from camtool.toolpath.moves import Bent, Toolpath


def compensated(toolpath: Toolpath, machine: Machine) -> Bent:
    """`toolpath` bent against the scale, squareness and play of the machine, so that its slides
    come out where `toolpath` says. Sources of the rows are kept; blocks are not.

    What remains: at a reversal that the controller compensates by too much, half of the excess
    (see `take_up`), and the random part of the mechanics.
    """
    motors = motor_path(toolpath, machine)
    bent = taken_up(motors.toolpath, machine)
    return Bent(bent.toolpath, motors.row[bent.row])
