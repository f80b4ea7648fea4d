"""The home-made CNC on a PIC18F4550: `G01 X1.2500 Y0.0000 Z-0.1250`.

docs/dialects/valcnc.md explains the format, its contradictions and what was chosen;
docs/controllers/valcnc.md what the controller does with it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target, lazy_call, lazy_name

from ..gcode.meanings import MEANINGS
from .dialect import ValcncController, ValcncDialect, ValcncLink, ValcncMachine, check, scales_of

if TYPE_CHECKING:
    from camtool.machine.model import Axis


class Valcnc(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "valcnc"
    meanings = MEANINGS
    controllers = (ValcncController,)
    dialect = ValcncDialect
    link = ValcncLink

    write = lazy_call("camtool_postprocessors.valcnc.write:write_program")
    read = lazy_call("camtool_postprocessors.valcnc.read:read_program")
    model = lazy_call("camtool_postprocessors.valcnc.controller:ValcncModel")
    signals = lazy_call("camtool_postprocessors.valcnc.signals:ValcncSignals")
    wire = lazy_call("camtool_postprocessors.valcnc.wire:ValcncWire")
    listing = lazy_call("camtool_postprocessors.gcode.blocks:listing")
    twin_kind = lazy_name("camtool_postprocessors.valcnc.twin:ValcncTwin")

    def check(self, machine: ValcncMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        check(machine)

    def unit_mm(self, machine: ValcncMachine, axis: Axis) -> float:
        """Return the last decimal of a coordinate in mm, on the axis where it is coarsest."""
        dialect = machine.dialect
        return float(10.0**-dialect.decimals / scales_of(machine, dialect).min())


POST = Valcnc()
