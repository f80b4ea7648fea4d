"""The Intel 8751."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class I8751Controller(SlideStart, frozen=True, tag_field="model", tag="i8751"):
    """The Intel 8751.

    How its firmware counts and times pulses decides what its bytes mean too, so those options are
    said once, in `[dialect]`: `camtool.machine.controllers.i8751_pulses`.
    """
