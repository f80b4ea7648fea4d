"""Any controller by data: a dialect of ISO 6983 that a machine file describes;
docs/dialects/iso.md explains its keys, docs/controllers/path.md the model without a planner.

`machines/` has the files of controllers that camtool knows.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target

from .dialect import IsoDialect, IsoMachine
from .findings import CODES
from .planners import controller_records, planner_of

if TYPE_CHECKING:
    from camtool.machine.model import Axis, Grade
    from camtool.target.contract import SampledDialect
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing, Program

    from .planners import PlannedModel


class Iso(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "iso"
    controllers = controller_records()
    dialect = IsoDialect
    starts_spindle = True
    switches_coolant = True
    any_machine = True
    codes = CODES
    no_twin = "only its language is described"

    def check(self, machine: IsoMachine) -> None:
        """Raise MachineError where the dialect contradicts itself."""
        from .check import check_machine

        check_machine(machine)

    def write(self, toolpath: Toolpath, machine: IsoMachine) -> Program:
        """The program; PostError naming the move that cannot be written or done."""
        from .write import write_program

        return write_program(toolpath, machine)

    def read(self, data: bytes, machine: IsoMachine) -> Toolpath:
        """The moves as the controller decodes them; ProgramError with block, line and column."""
        from .read import read_program

        return read_program(data, machine)

    def grade_of(self, machine: IsoMachine) -> Grade:
        """Return what the machine's planner knows."""
        planner = planner_of(machine)
        return machine.target.grade or ("path only" if planner is None else planner.grade)

    def model(self) -> PlannedModel:
        """The model of the machine's planner."""
        from .planners import PlannedModel

        return PlannedModel()

    def stray_mm(self, machine: IsoMachine) -> float:
        """The distance that lines may have from the arcs that they replace."""
        arcs = machine.dialect.arcs
        replaced = arcs.form == "chords" or not arcs.helices
        return machine.defaults.fit_tolerance_mm if replaced else 0.0

    def unit_mm(self, machine: IsoMachine, axis: Axis) -> float:
        """The last decimal of a coordinate."""
        return machine.dialect.last_decimal_mm

    def dialect_from(self, data: bytes) -> SampledDialect:
        """Return what a sample program shows of its dialect."""
        from .sample import sampled_dialect

        return sampled_dialect(data)

    def made_elsewhere(self, data: bytes) -> bool:
        """True if the program does not begin with camtool's own heading."""
        from ..gcode.comments import has_heading

        return not has_heading(data)

    def listing(self, data: bytes, machine: IsoMachine) -> Listing:
        """The lines that are blocks."""
        from .read import listing_of

        return listing_of(data, machine)


POST = Iso()
