"""The wood engraver that is driven from Matlab: arrays of points, lengths and speeds, as a .m file
or as the serial stream.

docs/dialects/matlab-router.md explains the format, its contradictions and what was chosen;
docs/controllers/matlab-router.md what the controller does with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from camtool.target.contract import Target, lazy_call, lazy_name
from camtool.target.signals import NoSignals

from .dialect import (
    MatlabRouterController,
    MatlabRouterDialect,
    MatlabRouterLink,
    MatlabRouterMachine,
    dialect_of,
)

if TYPE_CHECKING:
    from collections.abc import Iterator
    from types import ModuleType

    from camtool.machine.model import Machine
    from camtool.machine.servo import ServoTicks, SpeedLoop
    from camtool.toolpath.moves import Toolpath

    from .controller import MatlabRouterModel


def _controller() -> ModuleType:
    """Import the model of the controller."""
    from . import controller

    return controller


class MatlabRouter(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "matlab-router"
    controllers = (MatlabRouterController,)
    dialect = MatlabRouterDialect
    link = MatlabRouterLink

    write = lazy_call("camtool_postprocessors.matlab_router.write:write_program")
    read = lazy_call("camtool_postprocessors.matlab_router.read:read_program")
    wire = lazy_call("camtool_postprocessors.matlab_router.wire:MatlabRouterWire")
    listing = lazy_call("camtool_postprocessors.matlab_router.jobs:listing")
    twin_kind = lazy_name("camtool_postprocessors.matlab_router.twin:MatlabRouterTwin")

    def check(self, machine: MatlabRouterMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        dialect_of(machine)

    def model(self) -> MatlabRouterModel:
        """Return the model of its controller."""
        model: MatlabRouterModel = _controller().MatlabRouterModel()
        return model

    def speed_loop(self, machine: Machine[Any, Any]) -> SpeedLoop | None:
        """Return the loops of the slaves; None for a machine with the exact path."""
        is_router = isinstance(machine.controller, MatlabRouterController)
        return _controller().speed_loop(machine.controller) if is_router else None

    def servo_ticks(self, toolpath: Toolpath, machine: Machine[Any, Any]) -> Iterator[ServoTicks]:
        """Yield the passes of the slaves' interrupts."""
        ticks: Iterator[ServoTicks] = _controller().servo_ticks(toolpath, machine)
        return ticks

    def loop_keys(self, loop: SpeedLoop) -> dict[str, Any]:
        """Return the `[controller]` table that describes these motors and gains."""
        keys: dict[str, Any] = _controller().loop_keys(loop)
        return keys

    def signals(self) -> NoSignals:
        """Return `NoSignals`: speed loops have no step lines to show (docs/signals.md)."""
        return NoSignals(
            "its slaves turn DC motors by speed loops, with a voltage each 5 ms and no steps",
            "camtool preview --simulate FILE.html plays the places of its encoders",
        )

    def rest(
        self, data: bytes, machine: MatlabRouterMachine, first: int
    ) -> tuple[bytes, int] | None:
        """Return the program from line `first` on, and how many of its blocks bring the machine
        there. No entry is needed: each job goes home, to its first point and down by itself."""
        from .wire import rest_of

        return rest_of(data, machine, first)


POST = MatlabRouter()
