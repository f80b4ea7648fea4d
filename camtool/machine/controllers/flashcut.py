"""The PC of the parallel-port machine."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from camtool.machine.controllers.base import SlideStart


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
    (L1583-1587). `rounding` of each displacement to steps (L1208). `goes_on_from`: a displacement
    (L1101) is counted from where the program was ("programmed") or from where the steps have led
    ("reached"). `chords_per_turn`: arcs become "una serie de puntos" (L1089), number not said.
    """

    half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] = 3
    single_axis_half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] | None = None
    compensation_half_period_ms: Annotated[int, Meta(ge=1, le=60_000)] | None = None
    clock: Literal["whole-ms", "late-longer"] = "whole-ms"
    half_periods_per_step: Annotated[int, Meta(ge=1, le=2)] = 2
    rounding: Literal["nearest", "truncate"] = "nearest"
    goes_on_from: Literal["programmed", "reached"] = "programmed"
    chords_per_turn: Annotated[int, Meta(ge=4, le=10_000)] = 72
