"""The slaves of the Matlab router."""

from __future__ import annotations

from camtool.machine.controllers.base import SlideStart


class MatlabRouterController(SlideStart, frozen=True, tag_field="model", tag="matlab-router"):
    """The slaves of the Matlab router, and the options of its model."""
