"""The dialect of the micro machine tool on a PIC18F8720: `G02X02969.00Y03400.00I03012.00...;`.

docs/dialects/pic-mmh.md explains the format, its contradictions and what was chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class PicMmhPost:
    """Writes and reads pic-mmh programs; the two share no code but the options of `[dialect]`."""

    name = "pic-mmh"

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit."""
        from .dialect import dialect_of

        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError naming the move that cannot be said or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with block and column."""
        from .read import read_program

        return read_program(data, machine)

    def unit_mm(self, machine: Machine) -> float:
        """The coarser of the last decimal of a coordinate and a step."""
        from .dialect import dialect_of
        from .numbers import UNITS_PER_MM

        steps = (axis.coded_step_mm for axis in machine.axes)
        return max(1.0 / UNITS_PER_MM[dialect_of(machine).form], *steps)

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """What stands before each semicolon, with it."""
        from camtool.toolpath.program import Listing

        from .read import BLANKS

        *blocks, _ = data.decode("ascii").split(";")
        return Listing(tuple(block.strip(BLANKS) + ";" for block in blocks))


POST = PicMmhPost()
