"""The Job: what is to be cut and how, as far as the user says it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from camtool.errors import OptionError
from camtool.patterns import matches

SIDES = ("on", "outside", "inside", "auto")
"""Where the tool runs: on the line, around it, within it, or as the nesting says."""

ORIGINS = ("drawing", "lower-left", "centre")
"""Where part zero lies: at the drawing's own zero, or at a place of the chosen paths."""


@dataclass(frozen=True)
class Job:
    """How a drawing is cut; None means: as the machine's own file says.

    `tool_diameter_mm` 0 is a point that cuts no width. `layers` are patterns such as "ENG*",
    empty for all layers. Raises OptionError for what no job can be.
    """

    tool_diameter_mm: float = 0.0
    side: str = "auto"
    feed_mm_min: float | None = None
    plunge_feed_mm_min: float | None = None
    safe_z_mm: float | None = None
    depth_mm: float | None = None
    spindle_rpm: float | None = None
    origin: str = "drawing"
    layers: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.tool_diameter_mm) and self.tool_diameter_mm >= 0.0):
            raise OptionError(
                f"tool diameter {self.tool_diameter_mm:g} mm is not 0 or more",
                mend="give the diameter of the tool, or 0 for a scribing point",
            )
        _above_zero("feed", self.feed_mm_min, "mm/min")
        _above_zero("plunge feed", self.plunge_feed_mm_min, "mm/min")
        _above_zero("safe Z", self.safe_z_mm, "mm")
        _above_zero("depth", self.depth_mm, "mm")
        _above_zero("spindle speed", self.spindle_rpm, "rev/min")
        _one_of("side", self.side, SIDES)
        _one_of("origin", self.origin, ORIGINS)

    @property
    def radius_mm(self) -> float:
        """Radius of the tool."""
        return 0.5 * self.tool_diameter_mm

    def takes(self, layer: str) -> bool:
        """Whether the paths of this layer are cut."""
        return not self.layers or matches(self.layers, layer)


def _above_zero(name: str, value: float | None, unit: str) -> None:
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise OptionError(
            f"{name} {value:g} {unit} is not above 0",
            mend=f"give a {name} above 0, or leave it to the machine",
        )


def _one_of(name: str, value: str, known: Sequence[str]) -> None:
    if value not in known:
        raise OptionError(f"unknown {name} {value!r}", mend=f"use one of {', '.join(known)}")
