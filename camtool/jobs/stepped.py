"""Stepped holes: two circles about one centre, which are a counterbore or a countersink.

    ──┐     ┌──        ──╲     ╱──
      └┐   ┌┘             ╲   ╱
       │   │               │ │

Seen from above both are the same. The name of a layer decides, and else the sizes: heads of
countersunk screws are about twice as wide as their holes (ISO 15065 and ISO 273: 1.8 to 2.1 times
for M1.6 to M10), and a countersink needs a V bit of 90 or 82 degrees that is wide enough. In doubt
it is a countersink, which takes less away: it can be bored out afterwards."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct, field

from camtool.jobs.proposal import Proposal
from camtool.planning.holes import HOLE_SIZE_MM, SAME_HOLE_MM, circle_of
from camtool.planning.job import Operation, Tool

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing

MAX_STEP_SHARE = 3.0
"""Largest ratio of the diameters of a counterbore and its hole."""

SINK_SHARES = (1.75, 2.15)
"""Smallest and largest ratio of the diameters of a countersink and its hole."""

SINK_ANGLES_DEG = (90.0, 82.0)
"""Angles of countersunk screws: metric, and inch."""

SINK_ANGLE_SLACK_DEG = 1.0
"""Largest difference between the angle of a V bit and one of these."""

PLAIN = ("", "drill", "profile")
"""Habits of layers that do not exclude a stepped hole."""


class Sink(Struct, frozen=True):
    """A countersink: the row of the hole in it, the width of its slope seen from above (mm), the V
    bit that cuts it, and whether the layer's name calls it a countersink."""

    hole: int
    width_mm: float
    bit: Tool
    is_named: bool


class SteppedHoles(Struct, frozen=True):
    """The stepped holes of a drawing by the row of their wider circle: `bored` are counterbores,
    with the row of the hole in each; `sunk` are countersinks."""

    bored: Mapping[int, int] = field(default_factory=dict)
    sunk: Mapping[int, Sink] = field(default_factory=dict)

    @property
    def holes(self) -> frozenset[int]:
        """The rows of the holes."""
        return frozenset((*self.bored.values(), *(sink.hole for sink in self.sunk.values())))

    @property
    def rows(self) -> frozenset[int]:
        """The rows of both circles."""
        return frozenset((*self.bored, *self.sunk)) | self.holes


def stepped_holes(drawing: Drawing, proposal: Proposal, habits: Mapping[int, str]) -> SteppedHoles:
    """Return the counterbores and countersinks of a drawing that the tools of the proposal can
    cut. `habits`: by row of a path, the kind of operation that the name of its layer asks for."""
    tool, thickness = proposal.tool_mm, proposal.thickness_mm
    bored: dict[int, int] = {}
    sunk: dict[int, Sink] = {}
    if not tool:
        return SteppedHoles()
    depth = drawing.nesting.levels.depth
    for wide, inner_row, (outer, inner) in _circles_about_one_centre(drawing):
        is_named = "countersink" in (habits[wide], habits[inner_row])
        is_within_part = habits[wide] in PLAIN and depth[wide] % 2 == 1
        if not proposal.fits_hole(inner) or not (is_named or is_within_part):
            continue
        share = outer / inner
        if is_named or (thickness and SINK_SHARES[0] <= share <= SINK_SHARES[1]):
            bit_tool = sinking_bit(proposal, 0.5 * (outer - inner), is_named=is_named)
            if bit_tool is not None:
                sunk[wide] = Sink(inner_row, 0.5 * (outer - inner), bit_tool, is_named)
                continue
        if thickness and tool + HOLE_SIZE_MM < outer <= MAX_STEP_SHARE * inner:
            bored[wide] = inner_row
    return SteppedHoles(bored, sunk)


def sinking_bit(proposal: Proposal, width_mm: float, *, is_named: bool) -> Tool | None:
    """Return the V bit of the library that cuts a slope of this width (seen from above) without
    going through the stock, or None. Bits that do not have the angle of a screw head are used only
    if the layer is named a countersink (`is_named`)."""
    fits = []
    for bit_tool in proposal.tools("v"):
        angle = bit_tool.tip_angle_rad
        if angle is None:
            continue
        difference = min(abs(math.degrees(angle) - each) for each in SINK_ANGLES_DEG)
        offset = Operation(tool=bit_tool).tip_offset_mm
        room = (
            not bit_tool.diameter_mm or bit_tool.radius_at(offset) + width_mm <= bit_tool.radius_mm
        )
        depth = width_mm / math.tan(0.5 * angle) + offset
        is_screw = difference <= SINK_ANGLE_SLACK_DEG
        thickness = proposal.thickness_mm or math.inf
        if room and depth < thickness and (is_screw or is_named):
            fits.append((difference, bit_tool))
    return min(fits, key=lambda each: each[0])[1] if fits else None


def _circles_about_one_centre(drawing: Drawing) -> list[tuple[int, int, tuple[float, float]]]:
    """Return (row of the wider circle, row of the inner one, their diameters in mm) for each
    circle that contains nothing but one concentric circle."""
    parent = drawing.nesting.levels.parent
    counts = np.bincount(parent[parent >= 0], minlength=len(parent))
    pairs = []
    for inner_row in np.flatnonzero(parent >= 0).tolist():
        wide = int(parent[inner_row])
        if counts[wide] != 1 or counts[inner_row] or max(wide, inner_row) >= len(drawing.paths):
            continue
        one, other = (circle_of(drawing.paths[row]) for row in (wide, inner_row))
        if one and other and math.dist(one[0], other[0]) <= SAME_HOLE_MM:
            pairs.append((wide, inner_row, (one[1], other[1])))
    return pairs
