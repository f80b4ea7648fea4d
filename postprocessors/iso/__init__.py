"""Any controller by data: a dialect of ISO 6983 that a machine file describes;
docs/dialects/iso.md explains its keys, docs/controllers/path.md the model without a planner.

`machines/` has the files of controllers that camtool knows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.target.contract import Target, lazy_call

from .dialect import IsoDialect, IsoMachine
from .findings import CODES
from .planners import controller_records, planner_of

if TYPE_CHECKING:
    from camtool.machine.model import Axis, Grade


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

    write = lazy_call("camtool_postprocessors.iso.write:write_program")
    read = lazy_call("camtool_postprocessors.iso.read:read_program")
    model = lazy_call("camtool_postprocessors.iso.planners:PlannedModel")
    dialect_from = lazy_call("camtool_postprocessors.iso.sample:sampled_dialect")
    listing = lazy_call("camtool_postprocessors.iso.read:listing_of")
    made_elsewhere = lazy_call("camtool_postprocessors.gcode.comments:lacks_heading")

    def check(self, machine: IsoMachine) -> None:
        """Raise MachineError where the dialect contradicts itself."""
        from .check import check_machine

        check_machine(machine)

    def grade_of(self, machine: IsoMachine) -> Grade:
        """Return what is known of the machine's planner: the grade of its model."""
        planner = planner_of(machine)
        return machine.target.grade or ("path only" if planner is None else planner.grade)

    def stray_mm(self, machine: IsoMachine) -> float:
        """Return the greatest distance between arcs and the lines that replace them, mm."""
        arcs = machine.dialect.arcs
        replaced = arcs.form == "chords" or not arcs.helices
        return machine.defaults.fit_tolerance_mm if replaced else 0.0

    def unit_mm(self, machine: IsoMachine, axis: Axis) -> float:
        """Return the last decimal of a coordinate."""
        return machine.dialect.last_decimal_mm


POST = Iso()
