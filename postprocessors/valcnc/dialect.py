"""The `[dialect]` table of a valcnc machine and its scale: all that writer and reader share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import msgspec
from msgspec import Meta

from camtool.arrays import Floats
from camtool.machine.loader import convert
from camtool.machine.model import Machine
from camtool.machine.ranges import Count, Scale, Step, Tolerance

from ..gcode.dialect import check_unit

if TYPE_CHECKING:
    pass


class Dialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Points on which the thesis leaves a choice; docs/dialects/valcnc.md says why.

    `coord_scale`: units of the program per mm on an axis whose step is `nominal_step_mm`;
    `coord_scale_checked` ends the warning about it; `decimals` of a coordinate; `block_chars` that
    a block may have; `max_sweep_deg`: longer arcs are written as equal parts; `full_circles` as
    the reader takes an arc that ends where it starts; `missing_words`: what a block without X, Y
    or Z means there; `z_order` when one moves Z along with X or Y; `arc_spread_mm`: the radii at
    an arc's start and end may differ by this much.
    """

    coord_scale: Scale
    nominal_step_mm: Step
    coord_scale_checked: bool = False
    decimals: Annotated[int, Meta(ge=1, le=6)] = 4
    block_chars: Count = 127
    max_sweep_deg: Annotated[float, Meta(ge=1.0, le=90.0)] = 90.0
    full_circles: Literal["refused", "whole"] = "refused"
    missing_words: Literal["refused", "keep", "zero"] = "refused"
    z_order: Literal["refused", "before", "after", "together"] = "refused"
    arc_spread_mm: Tolerance = 0.04


def dialect_of(machine: Machine) -> Dialect:
    """The machine's `[dialect]` table; MachineError naming the key that does not fit."""
    dialect = convert(machine.dialect, Dialect, machine.target.name, "dialect")
    mm_per_unit = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    mm_per_unit /= dialect.coord_scale * dialect.nominal_step_mm
    check_unit(machine, 10.0**-dialect.decimals * mm_per_unit, dialect.arc_spread_mm)
    return dialect


def scales_of(machine: Machine, dialect: Dialect) -> Floats:
    """(3,) units of the program per mm on X, Y and Z.

    The controller makes 1 / (coord_scale · nominal_step_mm) steps of a unit, whatever the axis;
    where a step is coded_step_mm, a millimetre is coord_scale · nominal_step_mm / coded_step_mm.
    """
    import numpy as np

    steps = np.array([axis.coded_step_mm for axis in machine.axes])
    return np.asarray(dialect.coord_scale * dialect.nominal_step_mm / steps)
