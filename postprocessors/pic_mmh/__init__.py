"""The micro machine tool on a PIC18F8720: `G02X02969.00Y03400.00I03012.00...;`.

docs/dialects/pic-mmh.md explains the format, its contradictions and what was chosen;
docs/controllers/pic-mmh.md what the controller does with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final, get_args

from camtool.target.contract import Target, lazy_call, lazy_name

from .dialect import Interpolator, PicMmhController, PicMmhDialect, PicMmhLink, PicMmhMachine

if TYPE_CHECKING:
    from camtool.machine.model import Axis
    from camtool.toolpath.program import Listing


MEANINGS: Final[Mapping[str, str]] = {"G90": "positions are absolute"}


class PicMmh(Target):
    """Writer and reader share no code but the options of `[dialect]`."""

    name = "pic-mmh"
    meanings = MEANINGS
    controllers = (PicMmhController,)
    dialect = PicMmhDialect
    link = PicMmhLink
    interpolators = get_args(Interpolator)

    write = lazy_call("camtool_postprocessors.pic_mmh.write:write_program")
    read = lazy_call("camtool_postprocessors.pic_mmh.read:read_program")
    model = lazy_call("camtool_postprocessors.pic_mmh.controller:PicMmhModel")
    signals = lazy_call("camtool_postprocessors.pic_mmh.signals:PicMmhSignals")
    wire = lazy_call("camtool_postprocessors.pic_mmh.wire:PicMmhWire")
    twin_kind = lazy_name("camtool_postprocessors.pic_mmh.twin:PicMmhTwin")

    def unit_mm(self, machine: PicMmhMachine, axis: Axis) -> float:
        """Return the coarser of the last decimal of a coordinate and a step."""
        from .numbers import UNITS_PER_MM

        steps = (each.coded_step_mm for each in machine.axes)
        return max(1.0 / UNITS_PER_MM[machine.dialect.form], *steps)

    def listing(self, data: bytes, machine: PicMmhMachine) -> Listing:
        """Return the blocks of a program, each with its semicolon."""
        from camtool.toolpath.program import Listing

        from .read import BLANKS

        *blocks, _ = data.decode("ascii").split(";")
        lines, line = [], 1
        for block in blocks:
            lines.append(line + block[: len(block) - len(block.lstrip(BLANKS))].count("\n"))
            line += block.count("\n")
        return Listing(tuple(block.strip(BLANKS) + ";" for block in blocks), lines=tuple(lines))


POST = PicMmh()
