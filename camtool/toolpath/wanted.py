"""What a planned toolpath is wanted for: what was drawn, by which operations it is cut, and what
it must leave standing."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.polylines import Polylines

UNKNOWN_EDGE = -1
"""The edge of rows of which only the path of the tool's centre is known."""

NO_EDGE = -2
"""The edge of rows that make no edge of the part whose size could be said: chamfers, holes."""


class Drawn(Struct, frozen=True, eq=False):
    """What was drawn, as far as the N rows of a planned toolpath stand for it.

    `off_mm` (N, 2): the largest and the rms distance, mm, between the lines that a row was planned
    along and what was drawn; 0 for rows that stand for nothing drawn. `edge` (N,): the edge of the
    part that a row cuts, UNKNOWN_EDGE or NO_EDGE. Of E edges, [[x low, x high], [y low, y high]]
    mm in the work frame: `nominal` (E, 2, 2) as drawn, and `planned` (E, 2, 2) as the tool leaves
    them when it runs exactly as planned. Edges of one `line` (E,) make it together. `followed`
    (E,): the tool's centre runs on the line, and the edges of the cut lie beside it; `cleared`
    (E,): the edge bounds all that the tool removes on its way, not one closed pass beside it.
    `datum_off_mm`: the part of `off_mm` that comes of placing the drawing by a box, the same for
    all rows.
    """

    off_mm: Floats
    edge: Ints
    nominal: Floats
    planned: Floats
    line: Ints
    followed: Bools
    cleared: Bools
    datum_off_mm: float = 0.0

    def picked(self, row: Ints) -> Drawn:
        """Rows (M,) of this one, in that order and as often as they are named."""
        return replace(self, off_mm=self.off_mm[row], edge=self.edge[row])


TOOL_SHAPES = {
    "flat": "end mill",
    "ball": "ball nose",
    "bull": "bull nose",
    "v": "V bit",
    "drill": "drill",
}
"""What people call the shapes of tools that jobs know; any other is called as it is."""


class ToolNote(Struct, frozen=True):
    """A tool as a program names it: its shape as in jobs ("flat", "v", "drill", ...), its diameter
    (0: no width) and the full angle of its tip, None where it has none."""

    number: int | None = None
    name: str = ""
    kind: str = "flat"
    diameter_mm: float = 0.0
    tip_angle_rad: float | None = None


class OperationNote(Struct, frozen=True):
    """What a program says of an operation. `spindle_rpm`: None without a speed; `passes`: None for
    kinds of operation without passes; `peck_mm`: how deep a drill goes at a time."""

    kind: str
    name: str
    tool: ToolNote
    feed_mm_min: float
    plunge_mm_min: float
    depth_mm: float
    spindle_rpm: float | None = None
    passes: int | None = None
    peck_mm: float | None = None


class Operations(Struct, frozen=True, eq=False):
    """The K operations that a planned toolpath is cut by, in order: the `notes` on them, and the
    row `begin` (K,) from which on each has its turn; rows before the first are its own too."""

    notes: tuple[OperationNote, ...]
    begin: Ints

    def of_part(self, low: int, high: int) -> Operations:
        """For the rows low:high alone."""
        return replace(self, begin=self.begin.clip(low, high) - low)

    def picked(self, row: Ints) -> Operations:
        """For rows (M,) of the toolpath, which ascend; ValueError where they do not."""
        if (np.diff(row) < 0).any():
            raise ValueError("rows out of order belong to no order of operations")
        return replace(self, begin=np.searchsorted(row, self.begin))


class Kept(Struct, frozen=True, eq=False):
    """Runs of one tool and the region that they must leave.

    `runs`: vertices (n, 4) each of x, y, z, bulge, mm. `lines`: M closed paths, outer ones before
    those within them; what a path holds stays where `stays` (M,) is true and is free where it is
    not; `beyond`: whether what no path holds stays. `into_mm`: how far they shall cut into it.
    """

    runs: tuple[Floats, ...]
    lines: Polylines
    stays: Bools
    beyond: bool
    into_mm: float = 0.0
