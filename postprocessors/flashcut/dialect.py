"""The `[dialect]` table of a flashcut machine, and the words: all that writer and reader share."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from camtool.machine.loader import convert
from camtool.machine.model import Machine
from camtool.machine.ranges import Tolerance

from ..gcode.dialect import check_unit, feed_decimals

MOST_MM: Final = 9999.999
"""Coordinates beyond this have more than the 4.3 digits of a block (L436, L440-451)."""

STOP_TEXT: Final = "programmed stop"
"""The message that stands for M00 in a toolpath: the machine waits for the operator."""


class Dialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Points on which the thesis leaves a choice; docs/dialects/flashcut.md says why.

    `decimals` of a coordinate; `trailing_zeros` says 1.000 for 1.0; `feed_words`: F only where
    the thesis's syntax has it ("syntax": G01 in XY) or on every feed move ("everywhere");
    `full_circles` as two "halves" or as one block ("whole"); `program_end`; `rapids` above the
    stock go "straight" to their end, or along X and then along Y ("one-axis"), which the timers
    do exactly; `slants`: lines of X and Y in one block ("whole"), or in as many as these timers
    do exactly ("split"); `z_up`: the sign of Z away from the work; `spindle_stops`: M05 stops it;
    `arc_spread_mm`: the radii at an arc's start and end may differ by this much.
    """

    decimals: Annotated[int, Meta(ge=1, le=4)] = 3
    trailing_zeros: bool = False
    feed_words: Literal["syntax", "everywhere"] = "syntax"
    full_circles: Literal["halves", "whole"] = "halves"
    program_end: Literal["M30", "M02"] = "M30"
    rapids: Literal["straight", "one-axis"] = "straight"
    slants: Literal["whole", "split"] = "whole"
    z_up: Literal["+", "-"] = "+"
    spindle_stops: bool = True
    arc_spread_mm: Tolerance = 0.005


def dialect_of(machine: Machine) -> Dialect:
    """The machine's `[dialect]` table; MachineError naming the key that does not fit."""
    feed_decimals(machine)
    dialect = convert(machine.dialect, Dialect, machine.target.name, "dialect")
    check_unit(machine, 10.0**-dialect.decimals, dialect.arc_spread_mm)
    return dialect
