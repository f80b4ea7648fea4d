"""The keys of `[dialect]` and `[controller]` of a pic-mmh machine."""

from __future__ import annotations

from typing import Literal

import msgspec

from camtool.machine.model import Link, Machine, SlideStart
from camtool.machine.ranges import Count


class PicMmhDialect(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Choice between the thesis's two forms of a coordinate, and the longest block.

    `form` "example": `X02969.00`, sign only when negative (L1731); "annex": `X+02969` (L3284).
    `buffer_chars`: characters that the controller's buffer takes, `;` included; None: as many as
    the form's blocks have. The thesis's vector holds 35 (L1740-1742), its sample block has 43."""

    form: Literal["example", "annex"] = "example"
    buffer_chars: Count | None = None


Interpolator = Literal["dsm", "dda", "stairs"]
ArcEnd = Literal["equal", "final-quadrant", "nearest"]


class PicMmhController(SlideStart, frozen=True, tag_field="model", tag="pic-mmh"):
    """The PIC18F8720's firmware; each option is a point on which its thesis leaves a choice.

    `arc_end`: how an arc knows its end, see `steps`. `compensation`: the sender sets it once
    ("everywhere"), or between blocks, to the play of the region in which the axis turns away from
    `start_direction` ("by-region"; the thesis's own proposal, L3243-3249)."""

    arcs: Interpolator = "dsm"
    arc_end: ArcEnd = "final-quadrant"
    initial_error: Literal["zero", "rounded-radius"] = "zero"
    time_base: Literal["event", "iteration"] = "event"
    compensation: Literal["everywhere", "by-region"] = "everywhere"

    @property
    def compensates_by_region(self) -> bool:
        """True if the sender changes the compensation between blocks."""
        return self.compensation == "by-region"


class PicMmhLink(Link, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Options for what the thesis leaves open. `echo`: each block comes back, at its end or
    character by character ("echo"), or not at all ("none"). `step_byte`: a byte for each output of
    steps, in "bits", or one for each axis in it, as "letters", or "none". `compensation`: whether
    the steps of a compensation are "reported" too, or "silent"."""

    echo: Literal["echo", "none"] = "echo"
    step_byte: Literal["bits", "letters", "none"] = "bits"
    compensation: Literal["silent", "reported"] = "silent"


PicMmhMachine = Machine[SlideStart, PicMmhDialect]
