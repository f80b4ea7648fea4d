"""The wood engraver that is driven from Matlab: arrays of points, lengths and speeds, as a .m file
or as the serial stream.

docs/dialects/matlab-router.md explains the format, its contradictions and what was chosen;
docs/controllers/matlab-router.md what the controller does with it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target

from .dialect import Dialect, MatlabRouterController, MatlabRouterMachine, dialect_of

if TYPE_CHECKING:
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program

    from .controller import MatlabRouterModel


class MatlabRouter(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "matlab-router"
    controllers = (MatlabRouterController,)
    dialect = Dialect

    def check(self, machine: MatlabRouterMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        dialect_of(machine)

    def write(self, toolpath: Toolpath, machine: MatlabRouterMachine) -> Program:
        """The program; PostError naming the move that cannot be written or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: MatlabRouterMachine) -> Toolpath:
        """The moves as the machine executes them; ProgramError with line and column."""
        from .read import read_program

        return read_program(data, machine)

    def model(self) -> MatlabRouterModel:
        """The model of its controller."""
        from .controller import MatlabRouterModel

        return MatlabRouterModel()

    def listing(self, data: bytes, machine: MatlabRouterMachine) -> Listing:
        """The columns of the arrays that each block is."""
        from .jobs import listing

        return listing(data, machine)


POST = MatlabRouter()
