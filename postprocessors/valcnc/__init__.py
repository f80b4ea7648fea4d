"""The dialect of the home-made CNC on a PIC18F4550: `G01 X1.2500 Y0.0000 Z-0.1250`.

docs/dialects/valcnc.md explains the format, its contradictions and what was chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class ValcncPost:
    """Writes and reads valcnc programs; the two share no code but the options of `[dialect]`."""

    name = "valcnc"

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit."""
        from .dialect import dialect_of

        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError naming the move that cannot be said or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as the controller takes them; ProgramError with block, line and column."""
        from .read import read_program

        return read_program(data, machine)

    def unit_mm(self, machine: Machine) -> float:
        """The last decimal of a coordinate, on the axis where it is the most."""
        from .dialect import dialect_of, scales_of

        dialect = dialect_of(machine)
        return float(10.0**-dialect.decimals / scales_of(machine, dialect).min())

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """The lines that are blocks."""
        from ..gcode.blocks import listing

        return listing(data)


POST = ValcncPost()
