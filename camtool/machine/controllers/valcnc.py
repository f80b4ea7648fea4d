"""The PIC18F4550 of ValCNC."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from camtool.machine.controllers.base import SlideStart
from camtool.machine.ranges import Rate


class ValcncController(SlideStart, frozen=True, tag_field="model", tag="valcnc"):
    """The PIC18F4550 of ValCNC; most options are points on which its thesis is silent.

    `step_rate_hz`: pulses of the axis with more steps, one delay of 166.667 µs each (L1336).
    `rounding` of lengths to steps, and `counting`: whether a coordinate is turned into steps and
    then compared with the one before, or the difference of the two coordinates is ("un valor
    flotante ... convertido en una cantidad de pasos", L1226). Arcs: how long a piece of them is
    drawn as one line ("se divide el ángulo α en pequeños tramos", by "la longitud de su arco",
    L1330), or how many lines every arc has, where `arc_segments` says it; `arc_end`: whether the
    last one ends where the sum of the angles leads (L1330) or at the end that was programmed.
    """

    step_rate_hz: Rate = 6000.0
    rounding: Literal["nearest", "truncated"] = "nearest"
    counting: Literal["coordinates", "differences"] = "coordinates"
    arc_segment_mm: Annotated[float, Meta(ge=0.001, le=1000.0)] = 0.2
    arc_segments: Annotated[int, Meta(ge=1, le=100_000)] | None = None
    arc_end: Literal["computed", "programmed"] = "computed"
