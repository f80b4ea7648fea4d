"""The PIC18F4550 of ValCNC."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class ValcncController(SlideStart, frozen=True, tag_field="model", tag="valcnc"):
    """The PIC18F4550 of ValCNC, and the options of its model."""
