"""The dialect of LinuxCNC; docs/dialects/linuxcnc.md explains format, options and limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class LinuxCncPost:
    """Writes and reads linuxcnc programs; the two share no code but the options of `[dialect]`."""

    name = "linuxcnc"
    starts_spindle = True
    any_machine = True

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit."""
        from .dialect import dialect_of

        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError naming the move that cannot be said or done."""
        from .write import write_linuxcnc

        return write_linuxcnc(toolpath, machine)

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with block, line and column."""
        from .read import read_linuxcnc

        return read_linuxcnc(data, machine)

    def unit_mm(self, machine: Machine) -> float:
        """The last decimal of a coordinate."""
        from .dialect import dialect_of

        return 10.0 ** -dialect_of(machine).decimals

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """The lines that are blocks."""
        from ..gcode.blocks import listing

        return listing(data)


POST = LinuxCncPost()
