"""Any controller on grbl 1.1; docs/dialects/grbl.md explains the format, its options and limits,
docs/controllers/grbl.md the model of the controller."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from camtool.target.contract import Target, lazy_call, lazy_name

from ..gcode.dialect import check_blocks, feed_decimals, last_decimal_mm
from ..gcode.meanings import MEANINGS
from .dialect import GrblController, GrblDialect, GrblMachine
from .findings import CODES

if TYPE_CHECKING:
    from camtool.machine.model import Axis


class Grbl(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "grbl"
    meanings = MEANINGS
    controllers = (GrblController,)
    dialect = GrblDialect
    starts_spindle = True
    switches_coolant = True
    any_machine = True
    settings_listing = "what it answers to $$"
    codes = CODES

    write = lazy_call("camtool_postprocessors.grbl.write:write_program")
    read = lazy_call("camtool_postprocessors.grbl.read:read_program")
    model = lazy_call("camtool_postprocessors.grbl.controller:GrblModel")
    settings_from = lazy_call("camtool_postprocessors.grbl.settings:settings_of")
    compare_settings = lazy_call("camtool_postprocessors.grbl.settings:differences")
    signals = lazy_call("camtool_postprocessors.grbl.signals:GrblSignals")
    wire = lazy_call("camtool_postprocessors.grbl.wire:GrblWire")
    made_elsewhere = lazy_call("camtool_postprocessors.gcode.comments:lacks_heading")
    listing = lazy_call("camtool_postprocessors.gcode.blocks:listing")
    twin_kind = lazy_name("camtool_postprocessors.grbl.twin:GrblTwin")

    def check(self, machine: GrblMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        feed_decimals(machine)
        if machine.dialect.start_blocks or machine.dialect.end_blocks:
            check_blocks(machine, partial(self.read, machine=machine))

    def unit_mm(self, machine: GrblMachine, axis: Axis) -> float:
        """Return the last decimal of a coordinate."""
        return last_decimal_mm(machine.dialect)


POST = Grbl()
