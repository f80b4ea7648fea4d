"""The profile of a tool: the height of its surface above its tip, by the distance from its axis.

    flat of radius `flat_mm`, then a round corner of radius `corner_mm` or a cone that rises by
    `rise` for each millimetre, up to the radius of the tool; above it the tool is a cylinder.

          d ≤ flat                 0
          round corner c           c − √(c² − (d − flat)²)
          cone                     (d − flat) · rise
          d > radius               no cut

Every profile is convex and does not fall with the distance. The compiled loops of
`camtool.kernels.stock` rely on both: along a straight move the height over a point is then a
convex function of the place on the move."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.planning.job import Tool
from camtool.toolpath.wanted import ToolNote

MAX_CONE_RADIUS_MM = 1e3
"""Radius given to a V bit of which only the cone is known."""


class CutterProfile(Struct, frozen=True):
    """The profile of a tool, mm; `rise` is the cotangent of half the angle of its cone, 0 without
    a cone. A tool with a radius of 0 cuts nothing."""

    radius_mm: float
    flat_mm: float
    corner_mm: float = 0.0
    rise: float = 0.0

    @property
    def columns(self) -> tuple[float, float, float, float]:
        """Radius, flat, corner and rise: a row of the table that the compiled loops read."""
        return self.radius_mm, self.flat_mm, self.corner_mm, self.rise

    def heights(self, distance: Floats) -> Floats:
        """Return the heights, mm, of the tool's surface above its tip at these distances from its
        axis; inf beyond the radius."""
        beyond_flat = np.maximum(distance - self.flat_mm, 0.0)
        if self.corner_mm:
            below = np.minimum(beyond_flat, self.corner_mm)
            z = self.corner_mm - np.sqrt(np.maximum(self.corner_mm**2 - below**2, 0.0))
        else:
            z = beyond_flat * self.rise
        return np.where(distance <= self.radius_mm, z, np.inf)


def cutter_profile(tool: Tool | ToolNote) -> CutterProfile:
    """Return the profile of a tool. A V bit or drill whose angle is not known counts as flat, and
    so cuts more than it really does."""
    angle, radius = tool.tip_angle_rad, 0.5 * tool.diameter_mm
    if tool.kind in ("v", "drill") and angle is not None:
        flat = 0.5 * tool.tip_diameter_mm if tool.kind == "v" else 0.0
        rise = 1.0 / math.tan(0.5 * angle)
        return CutterProfile(radius or MAX_CONE_RADIUS_MM, flat, rise=rise)
    nose = {"ball": radius, "bull": tool.corner_radius_mm}.get(tool.kind, 0.0)
    return CutterProfile(radius, radius - nose, corner_mm=nose)
