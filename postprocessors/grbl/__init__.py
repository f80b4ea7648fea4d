"""Any controller on grbl 1.1; docs/dialects/grbl.md explains the format, its options and limits,
docs/controllers/grbl.md the model of the controller."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from camtool.target.contract import ControllerSetting, Target, TwinKind

from ..gcode.dialect import check_blocks, feed_decimals, last_decimal_mm
from ..gcode.meanings import MEANINGS
from .dialect import GrblController, GrblDialect, GrblMachine
from .findings import CODES

if TYPE_CHECKING:
    from camtool.machine.model import Axis
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program

    from .controller import GrblModel
    from .signals import GrblSignals
    from .wire import GrblWire


class Grbl(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "grbl"
    meanings = MEANINGS
    controllers = (GrblController,)
    dialect = GrblDialect
    starts_spindle = True
    switches_coolant = True
    any_machine = True
    settings_listing = "what it answers to $$"
    codes = CODES

    def check(self, machine: GrblMachine) -> None:
        """Raise MachineError where values of the dialect do not go with the machine."""
        feed_decimals(machine)
        if machine.dialect.start_blocks or machine.dialect.end_blocks:
            check_blocks(machine, partial(self.read, machine=machine))

    def write(self, toolpath: Toolpath, machine: GrblMachine) -> Program:
        """The program; PostError naming the move that cannot be written or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: GrblMachine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with block, line and column."""
        from .read import read_program

        return read_program(data, machine)

    def model(self) -> GrblModel:
        """The model of its controller."""
        from .controller import GrblModel

        return GrblModel()

    def unit_mm(self, machine: GrblMachine, axis: Axis) -> float:
        """The last decimal of a coordinate."""
        return last_decimal_mm(machine.dialect)

    def settings_from(self, text: str) -> list[ControllerSetting] | None:
        """The values that grbl's answer to `$$` says; None for another text."""
        from .settings import settings_of

        return settings_of(text)

    def compare_settings(self, text: str, machine: GrblMachine) -> tuple[list[str], list[str]]:
        """Compare its answer to `$$` with the machine file."""
        from .settings import differences

        return differences(text, machine)

    def signals(self) -> GrblSignals:
        """The signals of its motors; docs/signals.md."""
        from .signals import GrblSignals

        return GrblSignals()

    def wire(self) -> GrblWire:
        """Lines, as many as its buffer takes."""
        from .wire import GrblWire

        return GrblWire()

    def made_elsewhere(self, data: bytes) -> bool:
        """True if the program does not begin with camtool's own heading."""
        from ..gcode.comments import has_heading

        return not has_heading(data)

    def listing(self, data: bytes, machine: GrblMachine) -> Listing:
        """The lines that are blocks."""
        from ..gcode.blocks import listing

        return listing(data)

    def twin_kind(self) -> TwinKind:
        """The virtual controller; docs/wires/grbl.md."""
        from .twin import GrblTwin, GrblTwinSettings

        return TwinKind(GrblTwinSettings, GrblTwin)


POST = Grbl()
