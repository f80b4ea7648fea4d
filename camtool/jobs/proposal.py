"""The tools and the stock of a job that `camtool job new` proposes."""

from __future__ import annotations

import math

from msgspec import Struct

from camtool.planning.holes import HOLE_SIZE_MM
from camtool.planning.job import Stock, Tool
from camtool.planning.pins import PIN_MM, ROOM_SHARE

BREAKTHROUGH_MM = 0.3
"""Proposed depth of through cuts below the stock."""


MAX_PIN_MM = 6.5
"""Largest diameter of pins for which a drill of the library is proposed."""

PIN_DEPTH_SHARE = 1.5
"""Depth of the holes for pins in the board below the stock, over their diameter."""


class Proposal(Struct, frozen=True):
    """The sizes of the cut as far as known, mm (0: unknown): diameter of the tool and thickness of
    the stock. `tool`: its name in a library; `materials`: those it has presets for, which set the
    depth of passes; `material`: the one that is cut, if given. `library`: all tools that the job
    may name for it. `flip`: the axis "x" or "y" about which the part is turned over, "" for a part
    that is cut from one face."""

    tool_mm: float = 0.0
    thickness_mm: float = 0.0
    tool: str = ""
    materials: tuple[str, ...] = ()
    material: str = ""
    library: tuple[Tool, ...] = ()
    flip: str = ""

    @property
    def pin_drill(self) -> Tool | None:
        """The drill for the holes of alignment pins; None where the library has none, and the tool
        of the job drills them."""
        return next((tool for tool in self.tools("drill") if tool.diameter_mm <= MAX_PIN_MM), None)

    @property
    def pin_mm(self) -> float:
        """Diameter of the alignment pins."""
        return self.pin_drill.diameter_mm if self.pin_drill else self.tool_mm or PIN_MM

    @property
    def pin_depth_mm(self) -> float:
        """Depth of the holes of pins below the stock, without the point of their drill."""
        return math.ceil(PIN_DEPTH_SHARE * self.pin_mm)

    @property
    def margin_mm(self) -> float:
        """Waste of the stock all round a part that is turned over: room for the pins, and for the
        tool that cuts the part out."""
        return math.ceil(self.tool_mm + ROOM_SHARE * self.pin_mm)

    def tools(self, kind: str) -> list[Tool]:
        """Return the tools of this kind in the library, the widest first. Where the material is
        known, only tools with a preset for it are returned: a tool without one would cut with its
        spindle off."""
        materials = {self.material} if self.material else set(self.materials)
        tools = [
            tool
            for tool in self.library
            if tool.kind == kind and (not materials or materials & set(tool.materials))
        ]
        return sorted(tools, key=lambda tool: -tool.diameter_mm)

    def has_drill(self, width_mm: float) -> bool:
        """Return True if the library has a drill of this diameter."""
        drills = self.tools("drill")
        return any(abs(width_mm - tool.diameter_mm) <= HOLE_SIZE_MM for tool in drills)

    def fits_hole(self, width_mm: float) -> bool:
        """Return True if a drill of the library, or the job's mill, can make a hole of this
        diameter."""
        return width_mm >= self.tool_mm - HOLE_SIZE_MM or self.has_drill(width_mm)

    @property
    def finer_mills(self) -> list[Tool]:
        """The end mills of the library that are narrower than the tool, the widest first."""
        return [tool for tool in self.tools("flat") if 0.0 < tool.diameter_mm < self.tool_mm]

    @property
    def breakthrough_mm(self) -> float:
        """A little into what the stock lies on; 0 without a thickness."""
        if not self.thickness_mm:
            return 0.0
        return min(BREAKTHROUGH_MM, Stock(self.thickness_mm).through_mm)
