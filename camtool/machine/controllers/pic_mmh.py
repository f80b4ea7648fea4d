"""The controller on the PIC18F8720."""

from __future__ import annotations

from typing import Literal

from camtool.machine.controllers.base import SlideStart

Interpolator = Literal["dsm", "dda", "stairs"]
ArcEnd = Literal["equal", "final-quadrant", "nearest"]


class PicMmhController(SlideStart, frozen=True, tag_field="model", tag="pic-mmh"):
    """The PIC18F8720's firmware; each option is a point on which its thesis leaves a choice.

    `arc_end`: how an arc knows its end, see `camtool.kernels.arc_stops`.
    """

    arcs: Interpolator = "dsm"
    arc_end: ArcEnd = "final-quadrant"
    initial_error: Literal["zero", "rounded-radius"] = "zero"
    time_base: Literal["event", "iteration"] = "event"
