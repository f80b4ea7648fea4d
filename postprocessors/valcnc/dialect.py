"""The keys of `[dialect]` and `[controller]` of a valcnc machine, and its scale."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import msgspec
from msgspec import Meta

from camtool.arrays import Floats
from camtool.machine.model import Link, Machine, SlideStart
from camtool.machine.ranges import Count, Rate, Scale, Step, Tolerance

from ..gcode.dialect import check_unit

if TYPE_CHECKING:
    pass


Answer = Annotated[str, Meta(max_length=40, pattern=r"^([!-~]([ -~]*[!-~])?)?$")]
Margin = Annotated[float, Meta(ge=0.0, le=60.0)]


class ValcncDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Points on which the thesis leaves a choice; docs/dialects/valcnc.md says why.

    `coord_scale`: units of the program per mm on an axis whose step is `nominal_step_mm`;
    `coord_scale_checked` ends the warning about it; `decimals` of a coordinate; `block_chars` that
    a block may have; `max_sweep_deg`: longer arcs are written as equal parts; `full_circles` as
    the reader takes an arc that ends where it starts; `missing_words`: what a block without X, Y
    or Z means there; `z_order` when one moves Z along with X or Y; `arc_spread_mm`: the radii at
    an arc's start and end may differ by this much."""

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


class ValcncController(SlideStart, frozen=True, tag_field="model", tag="valcnc"):
    """The PIC18F4550 of ValCNC; most options are points on which its thesis is silent.

    `step_rate_hz`: pulses of the axis with more steps, one delay of 166.667 µs each (L1336).
    `rounding` of lengths to steps, and `counting`: whether a coordinate is turned into steps and
    then compared with the one before, or the difference of the two coordinates is ("un valor
    flotante ... convertido en una cantidad de pasos", L1226). Arcs: how long a piece of them is
    drawn as one line ("se divide el ángulo α en pequeños tramos", by "la longitud de su arco",
    L1330), or how many lines every arc has, where `arc_segments` says it; `arc_end`: whether the
    last one ends where the sum of the angles leads (L1330) or at the end that was programmed."""

    step_rate_hz: Rate = 6000.0
    rounding: Literal["nearest", "truncated"] = "nearest"
    counting: Literal["coordinates", "differences"] = "coordinates"
    arc_segment_mm: Annotated[float, Meta(ge=0.001, le=1000.0)] = 0.2
    arc_segments: Annotated[int, Meta(ge=1, le=100_000)] | None = None
    arc_end: Literal["computed", "programmed"] = "computed"


class ValcncLink(Link, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open. `answer`: the line that the controller sends when a
    block is done, such as "ok"; empty: nothing. `margin_s`: how long a block waits beyond the
    simulated time of the one before, where nothing is answered."""

    answer: Answer = ""
    margin_s: Margin = 0.1


ValcncMachine = Machine[SlideStart, ValcncDialect]


def check(machine: ValcncMachine) -> None:
    """Raise MachineError where the dialect's numbers do not go with those of the machine."""
    dialect = machine.dialect
    mm_per_unit = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    mm_per_unit /= dialect.coord_scale * dialect.nominal_step_mm
    check_unit(machine, 10.0**-dialect.decimals * mm_per_unit, dialect.arc_spread_mm)


def scales_of(machine: Machine, dialect: ValcncDialect) -> Floats:
    """Return (3,) units of the program per mm on X, Y and Z.

    The controller makes 1 / (coord_scale · nominal_step_mm) steps of a unit, whatever the axis;
    where a step is coded_step_mm, a millimetre is coord_scale · nominal_step_mm / coded_step_mm.
    """
    import numpy as np

    steps = np.array([axis.coded_step_mm for axis in machine.axes])
    return np.asarray(dialect.coord_scale * dialect.nominal_step_mm / steps)
