"""The keys of `[dialect]` and `[controller]` of a flashcut machine, and what its words share."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from camtool.machine.model import Machine, SlideStart
from camtool.machine.ranges import Tolerance

from ..gcode.dialect import check_unit, feed_decimals

MAX_MM: Final = 9999.999
"""Coordinates beyond this have more than the 4.3 digits of a block (L436, L440-451)."""

STOP_TEXT: Final = "programmed stop"
"""The message that stands for M00 in a toolpath: the machine waits for the operator."""


class FlashcutDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Points on which the thesis leaves a choice; docs/dialects/flashcut.md says why.

    `decimals` of a coordinate; `trailing_zeros` says 1.000 for 1.0; `feed_words`: F only where
    the thesis's syntax has it ("syntax": G01 in XY) or on every feed move ("everywhere");
    `full_circles` as two "halves" or as one block ("whole"); `program_end`; `rapids` above the
    stock go "straight" to their end, or along X and then along Y ("one-axis"), which the timers
    do exactly; `slants`: lines of X and Y in one block ("whole"), or in as many as these timers
    do exactly ("split"); `z_up`: the sign of Z away from the work; `spindle_stops`: M05 stops it;
    `arc_spread_mm`: the radii at an arc's start and end may differ by this much."""

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


class FlashcutController(SlideStart, frozen=True, tag_field="model", tag="flashcut"):
    """The PC of the parallel-port machine, whose millisecond timers move each axis on its own.

    Each option is a point on which its thesis (Lnnn) leaves a choice; docs/controllers/flashcut.md
    says why these defaults.

    `half_period_ms`: the "periodo medio" of the configuration window (L1404), the shortest that
    any move has (L1127); rapids have it, and a feed can only lengthen it.
    `single_axis_half_period_ms`: the shortest of a move of one axis alone, which may be shorter
    "sin afectar el resultado" (L1202); as for the others where left out.
    `compensation_half_period_ms` of the steps at a reversal: as the move's own where left out
    (they are issued by the same routine, L1147, L1388). `clock`: how a timer
    sees its half period go by: "whole-ms": every axis fires at the first whole millisecond above
    it; "late-longer": the longer axis a millisecond late at each step, the shorter one exactly;
    both give Tabla 3.8 (L1210-1214). `half_periods_per_step`: 2 fits the times of Tabla 4.1
    (L1583-1587). `coil_states_per_step` of the signals (`signals`); 2 for each half period where
    left out. `rounding` of each displacement to steps (L1208). `goes_on_from`: a displacement
    (L1101) is counted from where the program was ("programmed") or from where the steps have led
    ("reached"). `chords_per_turn`: arcs become "una serie de puntos" (L1089), number not said."""

    half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] = 3
    single_axis_half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] | None = None
    compensation_half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] | None = None
    clock: Literal["whole-ms", "late-longer"] = "whole-ms"
    half_periods_per_step: Annotated[int, Meta(ge=1, le=2)] = 2
    coil_states_per_step: Annotated[int, Meta(ge=1, le=8)] | None = None
    rounding: Literal["nearest", "truncate"] = "nearest"
    goes_on_from: Literal["programmed", "reached"] = "programmed"
    chords_per_turn: Annotated[int, Meta(ge=4, le=10_000)] = 72


FlashcutMachine = Machine[SlideStart, FlashcutDialect]


def check(machine: FlashcutMachine) -> None:
    """Raise MachineError where the dialect's numbers do not go with those of the machine."""
    feed_decimals(machine)
    dialect = machine.dialect
    check_unit(machine, 10.0**-dialect.decimals, dialect.arc_spread_mm)
