"""The dialect of the 2½-D machine on an Intel 8751: packets of bytes such as `01 03 00 64`.

docs/dialects/i8751.md explains the format, its contradictions and what was chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class I8751Post:
    """Writes and reads i8751 programs; the two share no code but the options of `[dialect]`."""

    name = "i8751"

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit."""
        from .dialect import dialect_of

        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError naming the move that cannot be said or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with record and byte."""
        from .read import read_program

        return read_program(data, machine)

    def stray_mm(self, machine: Machine) -> float:
        """How far ends of records may lie from their lines, and lines from their arcs."""
        from .dialect import dialect_of

        dialect = dialect_of(machine)
        return dialect.tolerance_mm + dialect.arc_tolerance_mm

    def line_bytes(self, data: bytes, machine: Machine) -> int:
        """The bytes of the packets, whatever the form of the file."""
        from .wire import packet_count

        return packet_count(data, machine)

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """The bytes of each record."""
        from .wire import listing

        return listing(data, machine)


POST = I8751Post()
