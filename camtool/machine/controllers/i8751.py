"""The Intel 8751."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class I8751Controller(SlideStart, frozen=True, tag_field="model", tag="i8751"):
    """The Intel 8751, and the options of its model."""
