"""The Job: what is to be cut and how, as far as the user says it.

A job places the drawing (`Placement`), may say what the stock is (`Stock`), and lists operations
in the order in which they are cut. An operation takes the paths of its layers and colours, and
says how: the tool, where it runs, how deep, how it goes in and out. What is None is left to the
machine. `job_of` makes the job of a single operation from flat settings, as flags give them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import Any

from camtool.errors import OptionError
from camtool.patterns import matches
from camtool.planning.contradictions import (
    refuse_entry,
    refuse_operation,
    refuse_placement,
    refuse_tool,
)
from camtool.planning.ranges import (
    FARTHEST_MM,
    MOST_WIDE_MM,
    above_zero,
    all_above_zero,
    at_least_zero,
    finite,
    one_of,
)

KINDS = ("profile", "pocket", "engrave", "drill", "vcarve")
"""Kinds of operation."""

SIDES = ("on", "outside", "inside", "auto")
"""Where the tool of a profile runs: on the line, around it, within it, or as the nesting says."""

DIRECTIONS = ("drawn", "climb", "conventional")
"""Which way round: as drawn, or with the tool's teeth going with or against the feed."""

PATTERNS = ("contour", "zigzag")
"""How a pocket is cleared: parallel to its contours from inside out, or in straight lines."""

JOINS = ("round", "mitre", "sharp")
"""What the tool's middle does about an outer corner: an arc, a corner up to the mitre limit
(else cut off), or a corner however long."""

CORNERS = ("none", "dogbone", "overcut")
"""What is done at inner corners that a round tool cannot fill: nothing; a relief towards the
corner; or along one of its sides."""

ENTRIES = ("plunge", "ramp", "helix")
"""How the tool goes down: straight, sloping along the contour, or in a helix (pockets)."""

LEADS = ("none", "line", "arc")
"""How the tool comes to a contour and leaves it."""

STARTS = ("nearest", "longest-line", "corner")
"""Where a closed contour may begin, if not at a place given by hand."""

ORIGINS = ("drawing", "lower-left", "centre")
"""Where part zero lies: at the drawing's own zero, or at a place of the paths that are cut."""

GOALS = ("rapids", "reversals")
"""What the order is chosen for: short rapids, or few reversals while cutting."""

FRAMES = ("*border*", "*frame*", "*title*")
"""Layers, by patterns of their names, of what belongs to the sheet of paper."""

THROUGH_MM = 1.0
"""How far cuts may go below a stock, into the spoilboard, where nobody says how far."""

THROUGH_SHARE = 0.5
"""And no farther than this part of its thickness: thin stock has a thin board under it."""

TOOL_KINDS = ("flat", "v", "drill")
"""Shapes of tools: an end mill (or a point of no width), a V bit, a drill."""


@dataclass(frozen=True)
class Tool:
    """A tool; diameter 0 is a point that cuts no width. A V bit and a drill have a
    `tip_angle_rad`, the full angle of the cone, and a V bit may have a flat tip."""

    diameter_mm: float = 0.0
    kind: str = "flat"
    tip_angle_rad: float | None = None
    tip_diameter_mm: float = 0.0
    number: int | None = None
    name: str = ""

    def __post_init__(self) -> None:
        at_least_zero("tool diameter", self.diameter_mm, "mm", MOST_WIDE_MM)
        at_least_zero("tip diameter", self.tip_diameter_mm, "mm", MOST_WIDE_MM)
        one_of("kind of tool", self.kind, TOOL_KINDS)
        refuse_tool(self)

    @property
    def radius_mm(self) -> float:
        """Half the diameter."""
        return 0.5 * self.diameter_mm


@dataclass(frozen=True)
class Entry:
    """How the tool goes down; a ramp or helix slopes by `angle_rad`, a helix has `radius_mm`
    (None: as large as fits, half the tool's at most)."""

    kind: str = "plunge"
    angle_rad: float = 0.05235987755982988  # 3 degrees
    radius_mm: float | None = None

    def __post_init__(self) -> None:
        one_of("entry", self.kind, ENTRIES)
        above_zero("ramp angle", self.angle_rad, "rad")
        above_zero("helix radius", self.radius_mm, "mm")
        refuse_entry(self)


@dataclass(frozen=True)
class Lead:
    """How a contour is reached or left: a line along its tangent of `length_mm`, or a quarter
    arc of that radius."""

    kind: str = "none"
    length_mm: float = 1.0

    def __post_init__(self) -> None:
        one_of("lead", self.kind, LEADS)
        above_zero("lead length", self.length_mm, "mm")


@dataclass(frozen=True)
class Tabs:
    """Bridges that hold a part: so many (`count`) or one each `spacing_mm`; `width_mm` of
    material at the top of a tab, `height_mm` above the bottom of the cut; `ramped` or straight
    sides."""

    count: int | None = None
    spacing_mm: float | None = None
    width_mm: float = 2.0
    height_mm: float = 0.5
    ramped: bool = False

    def __post_init__(self) -> None:
        above_zero("number of tabs", self.count, "")
        above_zero("tab spacing", self.spacing_mm, "mm")
        above_zero("tab width", self.width_mm, "mm")
        above_zero("tab height", self.height_mm, "mm")
        if (self.count is None) == (self.spacing_mm is None):
            raise OptionError("tabs need a count or a spacing", mend="give one of the two")


@dataclass(frozen=True)
class Operation:
    """One way to cut some of the paths.

    `layers`, `colours`: patterns of the paths that it takes, empty for all. `allowance_mm` is
    left on the wall of a profile or pocket. `depth_mm` is cut below the stock top in passes of
    `step_down_mm` at most (None: one pass), the last of `last_pass_mm` (None: like the others).
    `step_over` is the distance of neighbouring ways of a pocket over the tool's diameter.
    `overlap_mm`: how far a closed contour is cut beyond its start. `start`: one of STARTS, or a
    place (x, y) mm. `peck_mm`: how deep a drill goes at a time; `dwell_s` at the bottom.
    `max_hole_mm`: circles up to this diameter are drilled (None: as wide as the drill, or any
    for a drill of no width). Raises OptionError for what no operation can be.
    """

    kind: str = "profile"
    name: str = ""
    layers: tuple[str, ...] = ()
    colours: tuple[str, ...] = ()
    tool: Tool = field(default_factory=Tool)
    side: str = "auto"
    direction: str = "drawn"
    allowance_mm: float = 0.0
    feed_mm_min: float | None = None
    plunge_feed_mm_min: float | None = None
    spindle_rpm: float | None = None
    depth_mm: float | None = None
    step_down_mm: float | None = None
    last_pass_mm: float | None = None
    pattern: str = "contour"
    step_over: float = 0.4
    angle_rad: float = 0.0
    joins: str = "round"
    mitre_limit: float = 2.0
    corners: str = "none"
    entry: Entry = field(default_factory=Entry)
    lead_in: Lead = field(default_factory=Lead)
    lead_out: Lead = field(default_factory=Lead)
    overlap_mm: float = 0.0
    tabs: Tabs | None = None
    start: str | tuple[float, float] = "nearest"
    peck_mm: float | None = None
    dwell_s: float = 0.0
    max_hole_mm: float | None = None

    def __post_init__(self) -> None:
        one_of("kind of operation", self.kind, KINDS)
        one_of("side", self.side, SIDES)
        one_of("direction", self.direction, DIRECTIONS)
        one_of("pattern", self.pattern, PATTERNS)
        one_of("joins", self.joins, JOINS)
        one_of("corners", self.corners, CORNERS)
        if isinstance(self.start, str):
            one_of("start", self.start, STARTS)
        else:
            for place in self.start:
                finite("start", place, "mm", FARTHEST_MM)
        for name, value, unit in (
            ("feed", self.feed_mm_min, "mm/min"),
            ("plunge feed", self.plunge_feed_mm_min, "mm/min"),
            ("spindle speed", self.spindle_rpm, "rev/min"),
            ("depth", self.depth_mm, "mm"),
            ("step down", self.step_down_mm, "mm"),
            ("last pass", self.last_pass_mm, "mm"),
            ("mitre limit", self.mitre_limit, ""),
            ("peck", self.peck_mm, "mm"),
            ("largest hole", self.max_hole_mm, "mm"),
        ):
            above_zero(name, value, unit)
        at_least_zero("allowance", self.allowance_mm, "mm", MOST_WIDE_MM)
        at_least_zero("overlap", self.overlap_mm, "mm")
        at_least_zero("dwell", self.dwell_s, "s")
        finite("angle", self.angle_rad, "rad")
        if not 0.0 < self.step_over <= 1.0:
            raise OptionError(
                f"step-over {self.step_over:g} is not above 0 and at most 1",
                mend="give the part of the tool's diameter that each way takes, such as 0.4",
            )
        refuse_operation(self)

    def takes(self, layer: str, colour: str = "") -> bool:
        """Whether the paths of this layer and colour are cut."""
        return (not self.layers or matches(self.layers, layer)) and (
            not self.colours or matches(self.colours, colour)
        )


@dataclass(frozen=True)
class Placement:
    """How the drawing comes into the work frame, in this order: mirrored ("x" turns the sign of
    x, "y" of y), rotated, scaled by `scale` or to fit into `fit_mm` (width, height; 0: any),
    repeated `copies` (columns, rows) times at `pitch_mm`; then `origin` becomes part zero: one
    of ORIGINS, or the place (x, y) mm of the drawing so changed."""

    origin: str | tuple[float, float] = "drawing"
    mirror: str | None = None
    rotate_rad: float = 0.0
    scale: float = 1.0
    fit_mm: tuple[float, float] | None = None
    copies: tuple[int, int] = (1, 1)
    pitch_mm: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if isinstance(self.origin, str):
            one_of("origin", self.origin, ORIGINS)
        if self.mirror is not None:
            one_of("mirror", self.mirror, ("x", "y"))
        finite("rotation", self.rotate_rad, "rad")
        above_zero("scale", self.scale, "")
        all_above_zero("copies", self.copies)
        refuse_placement(self)


@dataclass(frozen=True)
class Stock:
    """A block whose top is Z0: its thickness, and its lower-left corner and size in the work
    frame, mm (both None: as large as the job needs). Cuts may go `spoilboard_mm` below it, into
    what it lies on (None: up to THROUGH_MM, and no more than THROUGH_SHARE of its thickness)."""

    thickness_mm: float
    corner_mm: tuple[float, float] | None = None
    size_mm: tuple[float, float] | None = None
    spoilboard_mm: float | None = None

    def __post_init__(self) -> None:
        above_zero("stock thickness", self.thickness_mm, "mm")
        if self.size_mm is not None:
            all_above_zero("stock size", self.size_mm, "mm")
        if (self.corner_mm is None) != (self.size_mm is None):
            raise OptionError(
                "a stock has a corner and a size, or neither",
                where="[stock]",
                mend="give both corner and size, or thickness alone",
            )
        if self.spoilboard_mm is not None:
            at_least_zero("spoilboard", self.spoilboard_mm, "mm")

    @property
    def box_mm(self) -> tuple[float, float, float, float] | None:
        """Its left, lower, right and upper edge; None where nobody said them."""
        if self.corner_mm is None or self.size_mm is None:
            return None
        (x, y), (width, height) = self.corner_mm, self.size_mm
        return x, y, x + width, y + height

    @property
    def through_mm(self) -> float:
        """How far below the stock cuts may go, mm."""
        if self.spoilboard_mm is not None:
            return self.spoilboard_mm
        return min(THROUGH_MM, THROUGH_SHARE * self.thickness_mm)


@dataclass(frozen=True)
class Job:
    """How a drawing is cut. `approach`: every cut starts after a move that takes up the play of
    both axes. `minimise`: one of GOALS. `frames`: patterns of the layers whose contours, where
    nobody cuts them, are no edges of parts. Raises OptionError for what no job can be."""

    operations: tuple[Operation, ...] = (Operation(),)
    placement: Placement = Placement()
    stock: Stock | None = None
    safe_z_mm: float | None = None
    minimise: str = "rapids"
    approach: bool = False
    frames: tuple[str, ...] = FRAMES

    def __post_init__(self) -> None:
        above_zero("safe Z", self.safe_z_mm, "mm")
        one_of("goal", self.minimise, GOALS)
        if not self.operations:
            raise OptionError("a job without operations", mend="give it at least one")

    @property
    def layers(self) -> tuple[str, ...]:
        """The patterns of the layers of all operations; empty when one of them takes all."""
        if not all(operation.layers for operation in self.operations):
            return ()
        every = (pattern for operation in self.operations for pattern in operation.layers)
        return tuple(dict.fromkeys(every))

    def takes(self, layer: str, colour: str = "") -> bool:
        """Whether any operation cuts the paths of this layer and colour."""
        return any(operation.takes(layer, colour) for operation in self.operations)


def job_of(**settings: Any) -> Job:
    """The job of one operation: fields of Operation, Job and Placement by name, those of its
    Tool with `tool_` before them (`tool_diameter_mm=0.2`). TypeError for a name none of them has.
    """
    tool = {
        key.removeprefix("tool_"): settings.pop(key)
        for key in list(settings)
        if key.startswith("tool_")
    }
    if tool:
        settings["tool"] = Tool(**tool)
    whole = {key: settings.pop(key) for key in _names(Job) & settings.keys()}
    place = {key: settings.pop(key) for key in _names(Placement) & settings.keys()}
    if place:
        whole["placement"] = Placement(**place)
    return Job(operations=(Operation(**settings),), **whole)


def _names(record: type) -> set[str]:
    return {each.name for each in fields(record)}
