"""The controller that follows every path exactly."""

from __future__ import annotations

from typing import Literal

from camtool.machine.controllers.base import SlideStart


class PathController(SlideStart, frozen=True, tag_field="model", tag="path"):
    """Any controller, as if it followed the programmed lines and arcs exactly.

    It stands in for controllers whose own arithmetic is not modelled. `grid` "steps": ends and
    arc centres lie on the axes' coded steps; "none": they are taken as programmed.
    """

    grid: Literal["steps", "none"] = "steps"
