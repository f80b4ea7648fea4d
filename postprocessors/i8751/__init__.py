"""The 2½-D machine on an Intel 8751: packets of bytes such as `01 03 00 64`.

docs/dialects/i8751.md explains the format, its contradictions and what was chosen;
docs/controllers/i8751.md what the controller does with it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target

from .dialect import Dialect, I8751Controller, I8751Machine, check

if TYPE_CHECKING:
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program

    from .controller import I8751Model


class I8751(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "i8751"
    controllers = (I8751Controller,)
    dialect = Dialect

    def check(self, machine: I8751Machine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        check(machine)

    def write(self, toolpath: Toolpath, machine: I8751Machine) -> Program:
        """The program; PostError naming the move that cannot be written or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: I8751Machine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with record and byte."""
        from .read import read_program

        return read_program(data, machine)

    def model(self) -> I8751Model:
        """The model of its controller."""
        from .controller import I8751Model

        return I8751Model()

    def stray_mm(self, machine: I8751Machine) -> float:
        """How far ends of records may lie from their lines, and lines from their arcs."""
        return machine.dialect.tolerance_mm + machine.dialect.arc_tolerance_mm

    def line_bytes(self, data: bytes, machine: I8751Machine) -> int:
        """The bytes of the packets, whatever the form of the file."""
        from .wire import packet_count

        return packet_count(data, machine)

    def listing(self, data: bytes, machine: I8751Machine) -> Listing:
        """The bytes of each record."""
        from .wire import listing

        return listing(data, machine)


POST = I8751()
