"""Records beside a planned toolpath: the drawn edges that its rows cut, its operations, and the
regions that it must not cut."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.polylines import Polylines
from camtool.records import replace

UNKNOWN_EDGE = -1
"""Value of `edge` for rows whose edge of the part is unknown."""

NO_EDGE = -2
"""Value of `edge` for rows that make no edge with a size: chamfers and holes."""


class DrawnEdges(Struct, frozen=True, eq=False):
    """The drawn edges that the N rows of a planned toolpath cut.

    `off_mm` (N, 2): the largest and the rms distance, mm, between the lines that a row was planned
    along and the drawing; 0 for rows that cut nothing drawn. `edge` (N,): the edge of the part
    that a row cuts, UNKNOWN_EDGE or NO_EDGE. Boxes of the E edges, [[x low, x high], [y low,
    y high]] mm in the work frame: `nominal` (E, 2, 2) as drawn, and `planned` (E, 2, 2) as the
    tool leaves them when it runs exactly as planned. Edges with the same `line` (E,) form that
    line together. `followed` (E,): the tool's centre runs on the line, and the edges of the cut
    lie beside it; `cleared` (E,): the edge bounds all that the tool removes, not one closed pass
    beside it. `datum_off_mm`: the part of `off_mm` that comes from placing the drawing by a box,
    the same for all rows. `stock_mm`: the left, lower, right and upper edge of the stock, None
    where they are not known; of a pocket that is open there, the part keeps no wall beyond."""

    off_mm: Floats
    edge: Ints
    nominal: Floats
    planned: Floats
    line: Ints
    followed: Bools
    cleared: Bools
    datum_off_mm: float = 0.0
    stock_mm: tuple[float, float, float, float] | None = None

    def picked(self, row: Ints) -> DrawnEdges:
        """Return the record for rows (M,) selected in the given order, with repetitions."""
        return replace(self, off_mm=self.off_mm[row], edge=self.edge[row])


TOOL_SHAPES = {
    "flat": "end mill",
    "ball": "ball nose",
    "bull": "bull nose",
    "v": "V bit",
    "drill": "drill",
    "insert": "turning insert with a nose of",
    "threading": "threading insert",
    "blade": "parting blade",
}
"""Readable names of the shapes of tools, also for lathes; an unlisted shape is its own name."""


class ToolNote(Struct, frozen=True):
    """A tool as described in a program: its shape as in jobs ("flat", "v", "drill", ...), its
    diameter (0: no width), the full angle of its tip, None without a tip, and the diameter of a
    flat at the tip and the radius of its corner, mm."""

    number: int | None = None
    name: str = ""
    kind: str = "flat"
    diameter_mm: float = 0.0
    tip_angle_rad: float | None = None
    tip_diameter_mm: float = 0.0
    corner_radius_mm: float = 0.0


class OperationNote(Struct, frozen=True):
    """An operation as described in a program. `spindle_rpm`: None without a speed; `passes`: None
    for kinds of operation without passes; `drills`: True if the tool goes straight down at single
    places; `peck_mm`: depth of one peck; `pitch_mm`: its feeds follow the spindle, by this
    for each turn."""

    kind: str
    name: str
    tool: ToolNote
    feed_mm_min: float
    plunge_mm_min: float
    depth_mm: float
    spindle_rpm: float | None = None
    passes: int | None = None
    drills: bool = False
    peck_mm: float | None = None
    pitch_mm: float | None = None


class Operations(Struct, frozen=True, eq=False):
    """The K operations of a planned toolpath, in order: their `notes` and the first row `begin`
    (K,) of each; rows before the first operation belong to it too."""

    notes: tuple[OperationNote, ...]
    begin: Ints

    def of_part(self, low: int, high: int) -> Operations:
        """Return the operations of the part low:high of the rows, counted from `low`."""
        return replace(self, begin=self.begin.clip(low, high) - low)

    def picked(self, row: Ints) -> Operations:
        """Return the operations of a toolpath of the selected rows (M,), which must ascend;
        ValueError if they do not."""
        if (np.diff(row) < 0).any():
            raise ValueError("rows out of order belong to no order of operations")
        return replace(self, begin=np.searchsorted(row, self.begin))


class ProtectedRegion(Struct, frozen=True, eq=False):
    """Runs of one tool and the region that they must not cut.

    `runs`: vertices (n, 4) each of x, y, z, bulge, mm. `lines`: M closed paths, outer ones before
    those within them; the inside of a path is protected where `stays` (M,) is true, else free.
    `beyond`: True if the area outside all paths is protected. `into_mm`: depth by which the runs
    shall cut into the region."""

    runs: tuple[Floats, ...]
    lines: Polylines
    stays: Bools
    beyond: bool
    into_mm: float = 0.0
