"""The micro machine tool on a PC's parallel port: `G01 X1.0 Y1.0 F3.0`.

docs/dialects/flashcut.md explains the format, its contradictions and what was chosen;
docs/controllers/flashcut.md what the controller does with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target, lazy_call

from ..gcode.meanings import MEANINGS
from .dialect import FlashcutController, FlashcutDialect, FlashcutMachine, check

if TYPE_CHECKING:
    from camtool.machine.model import Axis
    from camtool.target.wire import NoWire


class Flashcut(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "flashcut"
    meanings = MEANINGS
    no_twin = (
        "its PC drives the coils itself, by the parallel port and its own clock, so there is no "
        "wire to listen to"
    )
    controllers = (FlashcutController,)
    dialect = FlashcutDialect

    write = lazy_call("camtool_postprocessors.flashcut.write:write_program")
    read = lazy_call("camtool_postprocessors.flashcut.read:read_program")
    model = lazy_call("camtool_postprocessors.flashcut.controller:FlashcutModel")
    signals = lazy_call("camtool_postprocessors.flashcut.signals:FlashcutSignals")
    listing = lazy_call("camtool_postprocessors.gcode.blocks:listing")

    def check(self, machine: FlashcutMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        check(machine)

    def unit_mm(self, machine: FlashcutMachine, axis: Axis) -> float:
        """Return the last decimal of a coordinate."""
        return float(10.0**-machine.dialect.decimals)

    def wire(self) -> NoWire:
        """Return `NoWire`: its port is no serial line, and the PC is its clock (L1044-1050)."""
        from camtool.target.wire import NoWire

        return NoWire(
            "its parallel port carries no protocol: the PC itself switches the coils, each "
            "millisecond, and an ordinary system keeps no such time",
            "let the machine's own program on its own PC drive it",
        )


POST = Flashcut()
