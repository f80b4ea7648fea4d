"""The dialect of the micro machine tool on a PC's parallel port: `G01 X1.0 Y1.0 F3.0`.

docs/dialects/flashcut.md explains the format, its contradictions and what was chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class FlashcutPost:
    """Writes and reads flashcut programs; the two share no code but the options of `[dialect]`."""

    name = "flashcut"

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
        """The last decimal of a coordinate."""
        from .dialect import dialect_of

        return 10.0 ** -dialect_of(machine).decimals

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """The lines that are blocks."""
        from ..gcode.blocks import listing

        return listing(data)


POST = FlashcutPost()
