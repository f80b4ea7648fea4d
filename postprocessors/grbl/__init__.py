"""The dialect of grbl 1.1; docs/dialects/grbl.md explains the format, its options and limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class GrblPost:
    """Writes and reads grbl programs; the two share no code but the options of `[dialect]`."""

    name = "grbl"
    starts_spindle = True
    any_machine = True

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit."""
        from .dialect import dialect_of

        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError naming the move that cannot be said or done."""
        from .write import write_grbl

        return write_grbl(toolpath, machine)

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with block, line and column."""
        from .read import read_grbl

        return read_grbl(data, machine)

    def unit_mm(self, machine: Machine) -> float:
        """The last decimal of a coordinate."""
        from .dialect import dialect_of

        return 10.0 ** -dialect_of(machine).decimals

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """The lines that are blocks."""
        from ..gcode.blocks import listing

        return listing(data)


POST = GrblPost()
