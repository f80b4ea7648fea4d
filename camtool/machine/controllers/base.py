"""What every controller record says beside its own options."""

from __future__ import annotations

from typing import Literal

import msgspec

from camtool.machine.ranges import Place


class SlideStart(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How the slides stand when a program begins, and where machine zero is.

    `machine_zero_mm` is its place in the work frame: homing goes there.
    """

    start_play: Literal["preloaded", "centred"] = "preloaded"
    start_direction: Literal["+", "-"] = "+"
    machine_zero_mm: tuple[Place, Place, Place] = (0.0, 0.0, 0.0)
