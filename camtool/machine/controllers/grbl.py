"""A controller on grbl 1.1."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class GrblController(SlideStart, frozen=True, tag_field="model", tag="grbl"):
    """A controller on grbl 1.1, and the options of its model."""
