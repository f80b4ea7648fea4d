"""LinuxCNC."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class LinuxcncController(SlideStart, frozen=True, tag_field="model", tag="linuxcnc"):
    """LinuxCNC, and the options of its model."""
