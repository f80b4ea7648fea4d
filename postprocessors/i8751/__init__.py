"""The 2½-D machine on an Intel 8751: packets of bytes such as `01 03 00 64`.

docs/dialects/i8751.md explains the format, its contradictions and what was chosen;
docs/controllers/i8751.md what the controller does with it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target, TwinKind

from .dialect import I8751Controller, I8751Dialect, I8751Link, I8751Machine, check

if TYPE_CHECKING:
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program

    from .controller import I8751Model
    from .signals import I8751Signals
    from .wire import I8751Wire


class I8751(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "i8751"
    controllers = (I8751Controller,)
    dialect = I8751Dialect
    link = I8751Link

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
        """Return the sum of both tolerances, mm: of the ends of records from their lines, and of
        lines from their arcs."""
        return machine.dialect.tolerance_mm + machine.dialect.arc_tolerance_mm

    def signals(self) -> I8751Signals:
        """The signals of its motors; docs/signals.md."""
        from .signals import I8751Signals

        return I8751Signals()

    def wire(self) -> I8751Wire:
        """A byte and its reply, a packet and its F."""
        from .wire import I8751Wire

        return I8751Wire()

    def twin_kind(self) -> TwinKind:
        """The virtual controller; docs/wires/i8751.md."""
        from .twin import I8751Twin, I8751TwinSettings

        return TwinKind(I8751TwinSettings, I8751Twin)

    def line_bytes(self, data: bytes, machine: I8751Machine) -> int:
        """The bytes of the packets, whatever the form of the file."""
        from .stream import stream_of

        return len(stream_of(data, machine))

    def listing(self, data: bytes, machine: I8751Machine) -> Listing:
        """The bytes of each record."""
        from .stream import listing

        return listing(data, machine)


POST = I8751()
