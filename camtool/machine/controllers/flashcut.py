"""The PC of the parallel-port machine."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class FlashcutController(SlideStart, frozen=True, tag_field="model", tag="flashcut"):
    """The PC of the parallel-port machine, and the options of its model."""
