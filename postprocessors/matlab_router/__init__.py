"""The dialect of the wood engraver that is driven from Matlab: arrays of points, lengths, speeds.

docs/dialects/matlab-router.md explains the format, its contradictions and what was chosen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.machine.model import Machine
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program


class MatlabRouterPost:
    """Writes and reads the arrays as a .m file or as the serial stream; the two ways share no
    code but the options of `[dialect]`."""

    name = "matlab-router"

    def check(self, machine: Machine) -> None:
        """Raise MachineError when the machine's `[dialect]` table does not fit."""
        from .dialect import dialect_of

        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: Machine) -> Program:
        """The program; PostError naming the move that cannot be said or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: Machine) -> Toolpath:
        """The moves as the machine executes them; ProgramError with line and column."""
        from .read import read_program

        return read_program(data, machine)

    def listing(self, data: bytes, machine: Machine) -> Listing:
        """The columns of the arrays that each block is."""
        from .jobs import listing

        return listing(data, machine)


POST = MatlabRouterPost()
