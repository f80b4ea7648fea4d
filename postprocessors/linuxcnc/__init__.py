"""LinuxCNC; docs/dialects/linuxcnc.md explains the format, its options and limits,
docs/controllers/linuxcnc.md the model of the controller."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from camtool.target.contract import Target, lazy_call, lazy_name
from camtool.target.signals import NoSignals

from ..gcode.dialect import check_blocks, feed_decimals, last_decimal_mm
from ..gcode.meanings import MEANINGS
from .dialect import LinuxcncController, LinuxcncDialect, LinuxcncLink, LinuxcncMachine
from .findings import CODES

if TYPE_CHECKING:
    from pathlib import Path

    from camtool.machine.model import Axis
    from camtool.toolpath.moves import Toolpath


class Linuxcnc(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "linuxcnc"
    meanings = MEANINGS
    controllers = (LinuxcncController,)
    dialect = LinuxcncDialect
    link = LinuxcncLink
    ways = {"dialect.path": ("exact-path", "exact-stop", "blend")}  # noqa: RUF012
    starts_spindle = True
    switches_coolant = True
    any_machine = True
    grade = "timed"
    settings_listing = "its INI file"
    filter_default = True
    codes = CODES

    write = lazy_call("camtool_postprocessors.linuxcnc.write:write_program")
    model = lazy_call("camtool_postprocessors.linuxcnc.controller:LinuxcncModel")
    wire = lazy_call("camtool_postprocessors.linuxcnc.wire:LinuxcncWire")
    settings_from = lazy_call("camtool_postprocessors.linuxcnc.ini:settings_of")
    made_elsewhere = lazy_call("camtool_postprocessors.gcode.comments:lacks_heading")
    listing = lazy_call("camtool_postprocessors.gcode.blocks:listing")
    twin_kind = lazy_name("camtool_postprocessors.linuxcnc.twin:LinuxcncTwin")

    def check(self, machine: LinuxcncMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        feed_decimals(machine)
        if machine.dialect.start_blocks or machine.dialect.end_blocks:
            check_blocks(machine, partial(self.read, machine=machine))

    def read(self, data: bytes, machine: LinuxcncMachine) -> Toolpath:
        """Return the moves as the controller decodes them; ProgramError with block, line and
        column."""
        return self.read_in(data, machine, None)

    def read_in(self, data: bytes, machine: LinuxcncMachine, folder: Path | None) -> Toolpath:
        """Decode a program as `read` does, with subroutines from files in `folder`."""
        from .read import read_program

        return read_program(data, machine, folder)

    def signals(self) -> NoSignals:
        """Return `NoSignals`, which says why there are none (docs/signals.md)."""
        return NoSignals(
            "its program has no steps: the step generator or the servos of the machine's HAL "
            "follow the trajectory",
            "halscope shows its pins; camtool preview --simulate FILE.html plays the trajectory",
        )

    def unit_mm(self, machine: LinuxcncMachine, axis: Axis) -> float:
        """Return the last decimal of a coordinate."""
        return last_decimal_mm(machine.dialect)


POST = Linuxcnc()
