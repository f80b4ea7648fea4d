"""The Job: what is to be cut and how, as far as the user gives it.

A job places the drawing (`Placement`), may describe the stock (`Stock`), and lists operations in
the order in which they are cut. An operation chooses paths by layer and colour, and gives the
tool, the side, the depth, and how the tool goes in and out. What is None is left to the machine.
`job_of` makes the job of a single operation from flat settings, as flags give them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any

from camtool.errors import OptionError
from camtool.geometry.turn import UNTURNED, Box, Turn
from camtool.patterns import guess, matches
from camtool.planning.kinds import OperationKind, function_of, installed_kinds, kind_named
from camtool.records import FrozenRecord, replace

SIDES = ("on", "outside", "inside", "auto")
"""Sides on which the tool of a profile or a chamfer runs: on the line, around it, within it, or as
the nesting says."""

DIRECTIONS = ("drawn", "climb", "conventional")
"""The direction of the cut: as drawn, or with the tool's teeth going with or against the feed."""

PATTERNS = ("contour", "zigzag")
"""Patterns in which a pocket is cleared: parallel to its contours from inside out, or in straight
lines."""

JOINS = ("round", "mitre", "sharp")
"""Path of the tool centre at an outer corner: an arc, a corner up to the mitre limit
(else cut off), or a corner however long."""

CORNERS = ("none", "dogbone", "overcut")
"""Reliefs at inner corners that a round tool cannot fill: nothing; a relief towards the
corner; or along one of its sides."""

ENTRIES = ("plunge", "ramp", "helix")
"""Ways down of the tool: straight, sloping along the contour, or in a helix (pockets; bores
always)."""

LEADS = ("none", "line", "arc")
"""Ways of the tool to a contour and away from it."""

STARTS = ("nearest", "longest-line", "corner")
"""Places at which a closed contour may begin, if not at a place given by hand."""

MIN_TIP_ANGLE_RAD = math.radians(0.1)
"""No tool has a sharper cone; a narrower one is a needle a kilometre long."""

FINISH = " finish"
"""Suffix of the names of finishing stages."""

PIN_SLACK_MM = 0.001
"""Largest distance between a pin and the turned-over place of the other at which they count as
meeting."""

ZEROS = {
    "stock-lower-left": (0.0, 0.0),
    "stock-lower-right": (1.0, 0.0),
    "stock-upper-left": (0.0, 1.0),
    "stock-upper-right": (1.0, 1.0),
    "stock-centre": (0.5, 0.5),
}
"""Places of the stock that may be the zero of a set-up, as shares of its width and height."""

ORIGINS = ("drawing", "lower-left", "centre")
"""Places of part zero: at the drawing's own zero, or at a place of the paths that are cut."""

SELECTED = (
    "closed",
    "open",
    "outer",
    "inner",
    "circle",
    "not circle",
    "point",
    "text",
    "not text",
)
"""Words by which an operation selects: closed or open paths; closed ones within no other or an
even number of others, or within an odd number; full circles, or all but these; single points; what
was written as text, or all but that."""

_APART = (
    ("open", ("closed", "outer", "inner", "circle", "point")),
    ("outer", ("inner",)),
    ("circle", ("not circle",)),
    ("point", ("closed", "open", "outer", "inner", "circle", "not circle", "text")),
    ("text", ("not text",)),
)
"""Words of `select` that exclude each other: (word, words that cannot be true with it)."""

STAGES = ("", "rough", "finish")
"""Stages of an operation with a finishing pass: all of it (it has none), all but the last
pass, or that."""

SLOT_LEAD_SHARE = 0.05
"""Radius of the arcs on which the tool comes to the wall of a trochoidal slot and leaves it, over
its diameter."""

MAX_FINISH_SHARE = 0.25
"""A finishing pass takes no more than this part of its tool's diameter."""

COOLANTS = ("off", "mist", "flood", "both")

GOALS = ("rapids", "reversals")
"""Goals of the order: short rapids, or few reversals while cutting."""

FRAMES = ("*border*", "*frame*", "*title*")
"""Layers, by patterns of their names, of what belongs to the sheet of paper."""

THROUGH_MM = 1.0
"""Default limit of cuts below the stock, into the spoilboard."""

THROUGH_SHARE = 0.5
"""Cuts below the stock go no deeper than this part of its thickness either: thin stock has a thin
board under it."""

THROUGH_SLACK = 1e-9
"""A breakthrough may exceed that limit by this part of it, by rounding."""

TOOL_KINDS = ("flat", "ball", "bull", "v", "drill")
"""Shapes of tools: an end mill (or a point of no width), one with a ball nose, one whose edge is
rounded by a corner radius, a V bit, a drill."""

MILLS = ("flat", "ball", "bull")
"""Kinds of tools that are as wide as their shank, except at a nose."""

MAX_BY_UNIT = {"mm": 1e5, "mm/min": 1e7, "rev/min": 1e7, "s": 1e6, "rad": 1e6, "": 1e6}
"""Upper bounds of numbers by their unit, as in `camtool.machine.ranges`: 100 m, 167 m/s, eleven
days; and a million for numbers without a unit."""

ALLOWED_TIMES = 10.0
"""Factor by which sizes, and distances from part zero, may be larger if the job allows "long"."""

MIN_POSITIVE = 1e-6
"""Numbers above 0 must be at least this, in any unit (a nanometre)."""

MAX_WIDTH_MM = 1000.0
"""No tool is wider than a metre, and no allowance is larger."""

MAX_POSITION_MM = 1e9
"""Positions in a drawing are no farther from its zero than this (a thousand kilometres, as in
maps)."""

MAX_MOVES = 1_000_000
"""Passes, pecks and laps that would make more moves than this are taken for a mistake: a program
of some 25 MB."""


def above_zero(name: str, value: float | None, unit: str) -> None:
    """Raise OptionError for a number that is given (not None) but not above 0, or implausibly
    small or large."""
    if value is None:
        return
    if not (math.isfinite(value) and value > 0.0):
        raise OptionError(
            f"{_quantity(name, value, unit)} is not above 0",
            mend=f"give a {name} above 0, or leave it out",
        )
    if value < MIN_POSITIVE:
        raise OptionError(
            f"{_quantity(name, value, unit)} is less than {MIN_POSITIVE:g}",
            mend=f"give a larger {name}",
        )
    _at_most(name, value, unit, None)


def all_above_zero(name: str, values: Sequence[float], unit: str = "") -> None:
    """Raise OptionError if any of the numbers is not above 0 or is implausible."""
    for value in values:
        above_zero(name, value, unit)


def at_least_zero(name: str, value: float, unit: str, max_value: float | None = None) -> None:
    """Raise OptionError for a number below 0 or implausibly large."""
    if not (math.isfinite(value) and value >= 0.0):
        raise OptionError(
            f"{_quantity(name, value, unit)} is not 0 or more", mend=f"give a {name} of 0 or more"
        )
    _at_most(name, value, unit, max_value)


def finite(name: str, value: float, unit: str, max_value: float | None = None) -> None:
    """Raise OptionError for a value that is not finite or implausibly large."""
    if not math.isfinite(value):
        raise OptionError(f"{_quantity(name, value, unit)} is no number", mend=f"give a {name}")
    _at_most(name, abs(value), unit, max_value)


MAX_LONG_MOVES = 3_000_000
"""The same limit if the job allows "long": no program may have more moves
(`camtool.bounds.MAX_MOVES`)."""

ALLOWED = ("long", "off-stock")
"""Words by which a job allows what is refused by default: "long", programs of more than MAX_MOVES
moves and drawings larger than any machine; "off-stock", parts, copies and cuts that lie beside the
stock."""


def refuse_endless(
    moves: float, where: str, request: str, mend: str, *, is_long: bool = False
) -> None:
    """Raise OptionError if a `request` such as "10000 passes" would result in more than MAX_MOVES
    moves, by estimate (MAX_LONG_MOVES if `is_long`)."""
    max_moves = MAX_LONG_MOVES if is_long else MAX_MOVES
    if moves > max_moves:
        meant = f", or --allow long if it is meant (up to {MAX_LONG_MOVES:,})"
        raise OptionError(
            f"{request} would make {moves:.3g} moves, more than {max_moves:,}",
            where=where,
            mend=mend if moves > MAX_LONG_MOVES else mend + meant,
        )


def _at_most(name: str, value: float, unit: str, max_value: float | None) -> None:
    limit = MAX_BY_UNIT[unit] if max_value is None else max_value
    if value > limit:
        raise OptionError(
            f"{_quantity(name, value, unit)} is more than {limit:g}", mend=f"give a smaller {name}"
        )


def _quantity(name: str, value: float, unit: str) -> str:
    return f"{name} {value:g} {unit}".rstrip()


def one_of(name: str, value: str, words: Sequence[str]) -> None:
    """Raise OptionError for a value that is not one of the words."""
    if value not in words:
        raise OptionError(f"unknown {name} {value!r}", mend=f"use one of {', '.join(words)}")


def refuse_range(key: str, limits: tuple[float, float] | None, named: str = "") -> None:
    """Raise OptionError for limits (least, most) that are negative or out of order; `named`: text
    that names the owner of the key."""
    if limits is not None and not 0.0 <= limits[0] <= limits[1]:
        raise OptionError(
            f"{limits[0]:g} to {limits[1]:g} is no range",
            where=f"{named}key {key}",
            mend="give the lesser one first, both 0 or more",
        )


def _refuse_fit(fit_mm: tuple[float, float]) -> None:
    _refuse_beyond("fit", fit_mm, 0.0, ALLOWED_TIMES * MAX_BY_UNIT["mm"])
    if not any(fit_mm):
        raise OptionError(
            f"fit {fit_mm[0]:g} by {fit_mm[1]:g} mm gives neither a width nor a height",
            where="key fit",
            mend="give a width and a height above 0, or one of them and 0 for any",
        )


def _refuse_beyond(key: str, lengths: tuple[float, float], min_mm: float, max_mm: float) -> None:
    """Raise OptionError for a length outside these limits."""
    for length in lengths:
        if not min_mm <= length <= max_mm:
            raise OptionError(
                f"{length:g} mm is not between {min_mm:g} and {max_mm:g}",
                where=f"key {key}",
                mend=f"give a length from {min_mm:g} to {max_mm:g} mm",
            )


@dataclass(frozen=True, repr=False, eq=False)
class Tool(FrozenRecord):
    """A tool; one of diameter 0 is a point that cuts no width. A V bit and a drill have a
    `tip_angle_rad`, the full angle of the cone, and a V bit may have a flat tip; a bull nose has a
    `corner_radius_mm`.

    Unknown values are None: the number of `flutes`, their length (`cutting_length_mm`), and
    whether it cuts at its centre, and so can plunge. Above its flutes it is a cylinder, the shank,
    up to the holder: a cylinder too, from `stickout_mm` above the tip on and `holder_length_mm`
    long (None: endless). Limits of the feed per tooth, mm, and of the cutting speed, m/min, are
    (least, greatest). `materials`: those for which it has presets."""

    diameter_mm: float = 0.0
    kind: str = "flat"
    tip_angle_rad: float | None = None
    tip_diameter_mm: float = 0.0
    corner_radius_mm: float = 0.0
    number: int | None = None
    name: str = ""
    flutes: int | None = None
    cutting_length_mm: float | None = None
    shank_diameter_mm: float | None = None
    stickout_mm: float | None = None
    holder_diameter_mm: float | None = None
    holder_length_mm: float | None = None
    centre_cutting: bool | None = None
    chip_load_mm: tuple[float, float] | None = None
    surface_speed_m_min: tuple[float, float] | None = None
    materials: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        at_least_zero("tool diameter", self.diameter_mm, "mm", MAX_WIDTH_MM)
        at_least_zero("tip diameter", self.tip_diameter_mm, "mm", MAX_WIDTH_MM)
        at_least_zero("corner radius", self.corner_radius_mm, "mm", MAX_WIDTH_MM)
        above_zero("number of flutes", self.flutes, "")
        above_zero("cutting length", self.cutting_length_mm, "mm")
        above_zero("shank diameter", self.shank_diameter_mm, "mm")
        above_zero("stickout", self.stickout_mm, "mm")
        above_zero("holder diameter", self.holder_diameter_mm, "mm")
        above_zero("holder length", self.holder_length_mm, "mm")
        one_of("kind of tool", self.kind, TOOL_KINDS)
        refuse_range("chip_load", self.chip_load_mm)
        refuse_range("surface_speed", self.surface_speed_m_min)
        angle = self.tip_angle_rad
        if angle is not None and not MIN_TIP_ANGLE_RAD <= angle < math.pi:
            raise OptionError(
                f"tip angle {math.degrees(angle):g}° is not between"
                f" {math.degrees(MIN_TIP_ANGLE_RAD):g} and 180°",
                mend="give the full angle of the cone, such as 60deg",
            )
        if 0.0 < self.diameter_mm <= self.tip_diameter_mm:
            raise OptionError(
                f"the tip of {self.tip_diameter_mm:g} mm is not smaller than the tool",
                where="key tip_diameter",
                mend="give a smaller tip, or a wider tool",
            )
        if 0.0 < self.diameter_mm < 2.0 * self.corner_radius_mm:
            raise OptionError(
                f"a corner radius of {self.corner_radius_mm:g} mm is more than half the tool",
                where="key corner_radius",
                mend=f"give {0.5 * self.diameter_mm:g} mm or less, or a wider tool",
            )

    @property
    def bodies(self) -> tuple[tuple[str, float, float, float], ...]:
        """The cylinders above the flutes that are known: "shank" or "holder", radius, and the
        heights above the tip where it begins and ends, mm."""
        bodies = []
        ends = math.inf if self.stickout_mm is None else self.stickout_mm
        begins, shank = self.cutting_length_mm, self.shank_diameter_mm
        if begins is not None and shank is not None and begins < ends:
            bodies.append(("shank", 0.5 * shank, begins, ends))
        if self.stickout_mm is not None and self.holder_diameter_mm is not None:
            top = ends + (self.holder_length_mm or math.inf)
            bodies.append(("holder", 0.5 * self.holder_diameter_mm, ends, top))
        return tuple(bodies)

    @property
    def radius_mm(self) -> float:
        """Half the diameter."""
        return 0.5 * self.diameter_mm

    @property
    def nose_mm(self) -> float:
        """Height above its tip at which a mill is as wide as its diameter, mm: the radius of its
        nose."""
        return {"ball": self.radius_mm, "bull": self.corner_radius_mm}.get(self.kind, 0.0)

    def radius_at(self, above_tip_mm: float) -> float:
        """Return the radius at a height above the tip, mm, which is half the width of the cut at
        the surface when the tip is that deep. A drill counts with its full radius; a tool of which
        only the cone is known widens without limit."""
        if self.kind == "v" and self.tip_angle_rad is not None:
            wide = 0.5 * self.tip_diameter_mm + above_tip_mm * math.tan(0.5 * self.tip_angle_rad)
            return min(wide, self.radius_mm or math.inf)
        # A nose of radius r about a point r above the tip: x² + (r − z)² = r².
        nose = self.nose_mm
        below = max(nose - above_tip_mm, 0.0)
        return self.radius_mm - nose + math.sqrt(nose * nose - below * below)

    def feed_per_tooth_mm(self, feed_mm_min: float, rpm: float | None) -> float | None:
        """Return the feed for each cutting edge per turn, mm; None if the number of flutes or the
        speed is not known."""
        return feed_mm_min / (rpm * self.flutes) if rpm and self.flutes else None

    def edge_speed_m_min(self, rpm: float | None) -> float | None:
        """Return the cutting speed at the widest place of the tool, m/min; None without a speed,
        and for a tool without width."""
        return math.pi * self.diameter_mm * rpm / 1000.0 if rpm and self.diameter_mm else None

    @property
    def point_mm(self) -> float:
        """Height above its tip at which a mill or a drill is as wide as its diameter, mm."""
        if self.kind != "drill" or self.tip_angle_rad is None:
            return self.nose_mm
        return self.radius_mm / math.tan(0.5 * self.tip_angle_rad)


@dataclass(frozen=True, repr=False, eq=False)
class Entry(FrozenRecord):
    """The way of the tool down into the stock; a ramp or helix slopes by `angle_rad`, a helix has
    `radius_mm` (None: as large as fits, up to half the tool's radius)."""

    kind: str = "plunge"
    angle_rad: float = 0.05235987755982988  # 3 degrees
    radius_mm: float | None = None

    def __post_init__(self) -> None:
        one_of("entry", self.kind, ENTRIES)
        above_zero("ramp angle", self.angle_rad, "rad")
        above_zero("helix radius", self.radius_mm, "mm")
        if not self.angle_rad < 0.5 * math.pi:
            raise OptionError(
                f"ramp angle {math.degrees(self.angle_rad):g}° is not below 90°",
                mend="give a smaller angle, or plunge",
            )


@dataclass(frozen=True, repr=False, eq=False)
class Lead(FrozenRecord):
    """The way of the tool to a contour or away from it: a line of `length_mm` along its tangent,
    or a quarter arc of that radius."""

    kind: str = "none"
    length_mm: float = 1.0

    def __post_init__(self) -> None:
        one_of("lead", self.kind, LEADS)
        above_zero("lead length", self.length_mm, "mm")


@dataclass(frozen=True, repr=False, eq=False)
class Tabs(FrozenRecord):
    """Bridges that hold a part: `count` of them, or one every `spacing_mm`, or next to the places
    `at_mm` (x, y) of the work frame; `width_mm` of material at the top of a tab, `height_mm` above
    the bottom of the cut; sides `ramped` or straight."""

    count: int | None = None
    spacing_mm: float | None = None
    width_mm: float = 2.0
    height_mm: float = 0.5
    ramped: bool = False
    at_mm: tuple[tuple[float, float], ...] | None = None

    def __post_init__(self) -> None:
        above_zero("number of tabs", self.count, "")
        above_zero("tab spacing", self.spacing_mm, "mm")
        above_zero("tab width", self.width_mm, "mm")
        above_zero("tab height", self.height_mm, "mm")
        for place in self.at_mm or ():
            for coordinate in place:
                finite("place of a tab", coordinate, "mm", MAX_POSITION_MM)
        if self.at_mm == ():
            raise OptionError("an empty list gives no tab", mend="leave tabs out")
        given_counts = [
            each for each in (self.count, self.spacing_mm, self.at_mm) if each is not None
        ]
        if len(given_counts) != 1:
            raise OptionError(
                "tabs need a count or a spacing, or places", mend="give one of the three"
            )


@dataclass(frozen=True, repr=False, eq=False)
class Operation(FrozenRecord):
    """A cut: the paths that it takes, its tool, depths, feeds and strategy.

    `layers`, `colours`: patterns of the paths that it takes, empty for all. `allowance_mm` is
    left on the wall of a profile, pocket or bore; below 0 so much is cut beyond the line, less
    than the tool's radius (a Job, whose operations have their tools, refuses more). `depth_mm` is
    cut below the stock top in passes of `step_down_mm` at most (None: one pass), the last of
    `last_pass_mm` (None: like the others). `breakthrough_mm` stands for it: so far below the stock
    (a Job, which knows that, makes it the depth). `finish_mm` is left on the wall for one more
    pass at the full depth, with a feed, a speed and a tool of its own where these are given (a Job
    makes two operations of it, the stages). `rest` names the operation that has left something,
    `rest_of`, whose paths it takes (a Job finds it).
    `step_over` is the distance of neighbouring passes of a pocket over the tool's diameter.
    `overlap_mm`: how far a closed contour is cut beyond its start. `start`: one of STARTS, or a
    place (x, y) mm. `peck_mm`: how deep a drill goes at a time; `dwell_s` at the bottom.
    `chamfer_mm`: how wide a chamfer is, seen from above (a Job makes the depth of it), and
    `tip_offset_mm`: how far below it the tip of its bit runs.
    `max_hole_mm`: circles up to this diameter are drilled (None: as wide as the drill, or any
    for a drill of no width). `material`: that of the tool's preset, "" where none was taken;
    `preset`: the keys of the operation that it gave. `own`: names and values of the fields that
    its kind alone has, in the order of names.
    Raises OptionError for what no operation can be."""

    kind: str = "profile"
    name: str = ""
    layers: tuple[str, ...] = ()
    colours: tuple[str, ...] = ()
    select: tuple[str, ...] = ()
    size_mm: tuple[float, float] | None = None
    area_mm2: tuple[float, float] | None = None
    entities: tuple[str, ...] = ()
    tool: Tool = field(default_factory=Tool)
    side: str = "auto"
    direction: str = "drawn"
    allowance_mm: float = 0.0
    finish_mm: float | None = None
    finish_feed_mm_min: float | None = None
    finish_spindle_rpm: float | None = None
    finish_tool: Tool | None = None
    stage: str = ""
    may_be_long: bool = False
    rest: str = ""
    rest_of: Operation | None = None
    feed_mm_min: float | None = None
    plunge_feed_mm_min: float | None = None
    spindle_rpm: float | None = None
    coolant: str = "off"
    depth_mm: float | None = None
    breakthrough_mm: float | None = None
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
    chamfer_mm: float | None = None
    tip_offset_mm: float = 0.1
    material: str = ""
    preset: tuple[str, ...] = ()
    own: tuple[tuple[str, Any], ...] = ()

    def __post_init__(self) -> None:
        kind_named(self.kind)
        for each in self.select:
            one_of("word to select by", each, SELECTED)
        one_of("side", self.side, SIDES)
        one_of("direction", self.direction, DIRECTIONS)
        one_of("pattern", self.pattern, PATTERNS)
        one_of("joins", self.joins, JOINS)
        one_of("corners", self.corners, CORNERS)
        one_of("coolant", self.coolant, COOLANTS)
        one_of("stage", self.stage, STAGES)
        if isinstance(self.start, str):
            one_of("start", self.start, STARTS)
        else:
            for place in self.start:
                finite("start", place, "mm", MAX_POSITION_MM)
        for name, value, unit in (
            ("feed", self.feed_mm_min, "mm/min"),
            ("plunge feed", self.plunge_feed_mm_min, "mm/min"),
            ("depth", self.depth_mm, "mm"),
            ("breakthrough", self.breakthrough_mm, "mm"),
            ("finish", self.finish_mm, "mm"),
            ("finish feed", self.finish_feed_mm_min, "mm/min"),
            ("step down", self.step_down_mm, "mm"),
            ("last pass", self.last_pass_mm, "mm"),
            ("mitre limit", self.mitre_limit, ""),
            ("peck", self.peck_mm, "mm"),
            ("largest hole", self.max_hole_mm, "mm"),
            ("chamfer", self.chamfer_mm, "mm"),
            ("tip offset", self.tip_offset_mm, "mm"),
        ):
            above_zero(name, value, unit)
        for speed in (self.spindle_rpm, self.finish_spindle_rpm):
            if speed:
                above_zero("spindle speed", speed, "rev/min")
        finite("allowance", self.allowance_mm, "mm", MAX_WIDTH_MM)
        at_least_zero("overlap", self.overlap_mm, "mm")
        at_least_zero("dwell", self.dwell_s, "s")
        finite("angle", self.angle_rad, "rad")
        if not 0.0 < self.step_over <= 1.0:
            raise OptionError(
                f"step-over {self.step_over:g} is not above 0 and at most 1",
                mend="give the step-over as a part of the tool's diameter, such as 0.4",
            )
        self._refuse_contradictions()

    def _refuse_contradictions(self) -> None:
        """Raise OptionError for settings that are valid one by one but contradict each other."""
        named = f"operation {self.name!r}, " if self.name else ""
        for word, other_words in _APART:
            clashing = [
                other for other in other_words if word in self.select and other in self.select
            ]
            if clashing:
                raise OptionError(
                    f"nothing is {word} and {clashing[0]}",
                    where=f"{named}key select",
                    mend="leave one of them out, or make two operations",
                )
        refuse_range("select_size", self.size_mm, named)
        refuse_range("select_area", self.area_mm2, named)
        if self.depth_mm is not None and self.breakthrough_mm is not None:
            raise OptionError(
                "a depth is given too",
                where=f"{named}key breakthrough",
                mend="give one of the two: depth below the stock top, or breakthrough below the"
                " stock",
            )
        depth, last = self.depth_mm, self.last_pass_mm
        if depth is not None and last is not None and last > depth:
            raise OptionError(
                f"the last pass of {last:g} mm is deeper than the whole cut of {depth:g} mm",
                where=f"{named}key last_pass",
                mend="give a smaller last pass, or a larger depth",
            )
        self._refuse_finish(named)
        if self.entry.kind == "helix" and not (self.contract.clears or self.makes_slots):
            slots = "make it trochoidal, or " if "slot_width" in self.contract.own else ""
            raise OptionError(
                f"only pockets can be entered by a helix, not the kind {self.kind}",
                where=f"{named}key entry",
                mend=f'{slots}use "ramp" or "plunge"',
            )
        if self.contract.descent == "helix" and self.entry.radius_mm is not None:
            raise OptionError(
                "a bore goes down in a helix as wide as the hole lets it",
                where=f"{named}key entry",
                mend='give its angle alone, entry = "helix:3deg"',
            )

    def _refuse_finish(self, named: str) -> None:
        """Raise OptionError for a finishing pass without a wall, or with a tool that does not suit
        it."""
        if self.finish_mm is None:
            return
        if self.contract.runs_beside and self.side == "on":
            raise OptionError(
                "a tool on the line leaves nothing on a wall",
                where=f"{named}key finish",
                mend='leave finish out, or give side = "auto"',
            )
        rough, last = self.tool, self.finish_tool or self.tool
        if last.diameter_mm > rough.diameter_mm > 0.0:
            raise OptionError(
                f"a tool of {last.diameter_mm:g} mm does not fit where one of"
                f" {rough.diameter_mm:g} mm cleared",
                where=f"{named}key finish_tool",
                mend="give one that is no wider",
            )
        if rough.diameter_mm > 0.0 and self.finish_mm > MAX_FINISH_SHARE * last.diameter_mm:
            raise OptionError(
                f"{self.finish_mm:g} mm is more than a quarter of the tool of"
                f" {last.diameter_mm:g} mm, which takes it at the full depth",
                where=f"{named}key finish",
                mend=f"give {MAX_FINISH_SHARE * last.diameter_mm:.4g} mm or less",
            )

    def after(self, others: Sequence[Operation]) -> Operation:
        """Return the operation linked to the one that it clears the rest of (`rest`), which is
        found by its name among `others`, earlier ones first; unchanged if it names none.

        It takes over the paths and the depth of that one. OptionError for an operation that leaves
        no rest."""
        if not self.rest:
            return self
        if self.rest_of is not None:
            return self
        place = f"operation {self.name or self.kind!r}, key rest"
        candidates = [each for each in others if each.name == self.rest]
        if not candidates:
            names = ", ".join(each.name for each in others if each.name and each.name != self.name)
            raise OptionError(
                f"there is no operation {self.rest!r}",
                where=place,
                mend=f"name one of: {names}" if names else "name another operation",
            )
        other = candidates[0]
        own_selection, other_selection = _selection_of(self), _selection_of(other)
        if any(own_selection.values()) and own_selection != other_selection:
            raise OptionError(
                f"it takes the paths of {self.rest!r}, and gives layers, colours or a selection"
                " of its own too",
                where=place,
                mend="leave these out",
            )
        self._refuse_rest(other, place)
        depth = other.depth_mm
        if other.contract.rest == "corners" and self.depth_mm:
            depth = self.depth_mm
        return replace(self, rest_of=other, depth_mm=depth, **other_selection)

    def _refuse_rest(self, other: Operation, where: str) -> None:
        """Raise OptionError if `other` leaves nothing that this operation can clear."""

        def refuse(message: str, mend: str) -> OptionError:
            return OptionError(message, where=where, mend=mend)

        if not other.contract.rest or other.rest:
            raise refuse(
                f"{other.name!r} is no pocket and no vcarve of its own",
                "name a pocket that a wider tool clears, or a vcarve whose floor is flat",
            )
        if self.finish_mm is not None:
            raise refuse("a rest has no finishing pass", "give finish to the other operation")
        if other.contract.rest == "floor":
            if self.tool.kind not in MILLS:
                raise refuse(
                    f"a flat floor is for an end mill, not for a tool of kind {self.tool.kind!r}",
                    "give it a flat tool",
                )
            return
        if not 0.0 < self.tool.diameter_mm < other.tool.diameter_mm:
            raise refuse(
                f"a tool of {self.tool.diameter_mm:g} mm reaches no more than that of"
                f" {other.tool.diameter_mm:g} mm",
                "give a smaller tool",
            )
        if (self.depth_mm or 0.0) > (other.depth_mm or math.inf):
            raise refuse(
                f"it is {self.depth_mm:g} mm deep, and {other.name!r} {other.depth_mm:g} mm: below"
                " that all is left",
                "leave depth out",
            )
        if self.allowance_mm < other.allowance_mm:
            raise refuse(
                f"{other.name!r} leaves {other.allowance_mm:g} mm on all walls",
                "give the same allowance, or more",
            )

    def stages(self) -> tuple[Operation, ...]:
        """Return the operation alone, or if it has a finishing pass two stages: roughing, which
        leaves `finish_mm` on the wall, and the pass along the wall, which enters and leaves on
        quarter arcs as large as that thickness, from where the roughing tool ran. A trochoidal
        slot always has a finishing stage, for its cusps. OptionError for a feed or a tool of a
        finishing pass that does not exist, and for a tool that cannot cut as far beyond the line
        as asked."""
        self._refuse_beyond()
        left_mm = self.finish_mm
        if left_mm is None and self.makes_slots and self.side != "on" and not self.stage:
            left_mm = 0.0  # cusps
        if left_mm is None:
            for key, value in (
                ("finish_feed", self.finish_feed_mm_min),
                ("finish_spindle", self.finish_spindle_rpm),
                ("finish_tool", self.finish_tool),
            ):
                if value is not None:
                    raise OptionError(
                        "has no effect without finish",
                        where=f"operation {self.name or self.kind!r}, key {key}",
                        mend=f'give what is left for it, finish = "0.2mm", or leave {key} out',
                    )
            return (self,)
        without_finish = replace(
            self,
            finish_mm=None,
            finish_feed_mm_min=None,
            finish_spindle_rpm=None,
            finish_tool=None,
        )
        feed, speed = self.finish_feed_mm_min, self.finish_spindle_rpm
        # An overcut before the finishing pass would go into the wall; a dog-bone does not.
        corners = "dogbone" if self.corners == "overcut" else self.corners
        tool = self.finish_tool or self.tool
        finish = replace(
            without_finish,
            stage="finish",
            name=f"{self.name or self.kind}{FINISH}",
            tool=tool,
            feed_mm_min=self.feed_mm_min if feed is None else feed,
            spindle_rpm=self.spindle_rpm if speed is None else speed,
            entry=Entry(),
            start="longest-line" if self.start == "nearest" else self.start,
            tabs=None,
        )
        if self.makes_slots:
            lead = Lead("arc", SLOT_LEAD_SHARE * tool.diameter_mm)
            direction = "climb" if self.direction == "drawn" else self.direction
            lead_in, lead_out = (
                lead if each.kind == "none" else each for each in (self.lead_in, self.lead_out)
            )
            finish = replace(finish, direction=direction, lead_in=lead_in, lead_out=lead_out)
        else:
            lead = Lead("arc", left_mm)
            finish = replace(finish, lead_in=lead, lead_out=lead)
        allowance_mm = self.allowance_mm + left_mm
        rough = replace(without_finish, stage="rough", allowance_mm=allowance_mm, corners=corners)
        return rough, finish

    def _refuse_beyond(self) -> None:
        """Raise OptionError for a cut so far beyond the line that the tool's centre would have to
        cross it."""
        if self.allowance_mm >= 0.0:
            return
        place = f"operation {self.name or self.kind!r}, key allowance"
        if self.contract.runs_beside and self.side == "on":
            raise OptionError(
                "a tool on the line cuts beyond it on both sides",
                where=place,
                mend='leave allowance out, or give side = "auto"',
            )
        last = self.finish_tool or self.tool
        if min(self.wall_radius_mm, last.radius_mm) + self.allowance_mm < MIN_POSITIVE:
            wide = f"a tool of {last.diameter_mm:g} mm" if last.diameter_mm else "a point"
            mend = f"more than {-last.radius_mm:g} mm" if last.diameter_mm else "0 or more"
            raise OptionError(
                f"{wide} cannot cut {-self.allowance_mm:g} mm beyond the line: its centre would"
                " not stay beside it",
                where=place,
                mend=f"give {mend}, or a wider tool",
            )

    def through(self, stock: Stock | None) -> Operation:
        """Return the operation with its breakthrough converted to a depth for this stock;
        unchanged without one. The depth lets a pointed drill or a round nose go through with its
        whole diameter. OptionError if the stock is not known, or the board under it is too thin.
        """
        extra = self.breakthrough_mm
        if extra is None:
            return self
        place = f"operation {self.name!r}, key breakthrough" if self.name else "key breakthrough"
        if stock is None:
            raise OptionError(
                "the thickness of the stock is not known",
                where=place,
                mend='write [stock] with its thickness, such as thickness = "3mm", or give depth',
            )
        point = self.tool.point_mm
        if extra + point > stock.through_mm * (1.0 + THROUGH_SLACK):
            tip = f" and the tool's point of {point:.4g} mm are" if point else " is"
            raise OptionError(
                f"{extra:g} mm{tip} deeper than the {stock.through_mm:g} mm that may be cut below"
                " the stock",
                where=place,
                mend="give less, or say how much the board below takes: spoilboard ="
                f' "{extra + point:.4g}mm" in [stock]',
            )
        return replace(self, depth_mm=stock.thickness_mm + extra + point, breakthrough_mm=None)

    def settled(self, stock: Stock | None) -> Operation:
        """Return the operation as its kind completes it, with its breakthrough converted to a
        depth.

        OptionError for an operation that is impossible in this stock (None: not known)."""
        settle = self.contract.settle
        settled: Operation = function_of(settle)(self, stock) if settle else self
        return settled.through(stock)

    @property
    def contract(self) -> OperationKind:
        """The record of its kind: what is done."""
        return kind_named(self.kind)

    def own_value(self, name: str) -> Any:
        """Return the value of a key that only its kind has, or the default of that key."""
        key = self.contract.own[name]
        return dict(self.own).get(key.field, key.default)

    @property
    def engagement_rad(self) -> float | None:
        """The angle by which its tool promises to be engaged at most, rad; None: it does not."""
        if "strategy" not in self.contract.own or self.own_value("strategy") == "passes":
            return None
        limit: float = self.own_value("engagement")
        return limit

    @property
    def makes_slots(self) -> bool:
        """True if it clears a band beside or along its lines, wider than its tool."""
        return self.engagement_rad is not None and not self.contract.clears

    @property
    def spare_mm(self) -> float:
        """Width by which its slots are wider than its tool, mm; 0 where it makes none."""
        if not self.makes_slots:
            return 0.0
        slot_mm: float = self.own_value("slot_width").mm(self.tool.diameter_mm)
        return slot_mm - self.tool.diameter_mm

    @property
    def wall_radius_mm(self) -> float:
        """The tool's radius where it passes the line beside which it runs, mm: half its diameter,
        and for a chamfer how wide its bit is where the bevel ends."""
        if self.contract.breaks_edges:
            return self.tool.radius_at(self.tip_offset_mm)
        return self.tool.radius_mm

    @property
    def away_mm(self) -> float:
        """Distance of the tool's centre from the drawn line beside which it runs, mm."""
        return self.wall_radius_mm + self.allowance_mm

    @property
    def beyond_mm(self) -> float:
        """Distance that it cuts beyond the drawn line, mm: by an allowance below 0."""
        return max(-self.allowance_mm, 0.0)

    @property
    def selects(self) -> bool:
        """True if it takes less than all that is on its layers and in its colours."""
        return bool(self.select or self.entities or self.size_mm or self.area_mm2)

    def takes(self, layer: str, colour: str) -> bool:
        """Return True if paths of this layer and colour may be cut; other criteria, such as
        `select`, are not checked."""
        return (
            self.contract.takes_drawn
            and (not self.layers or matches(self.layers, layer))
            and (not self.colours or matches(self.colours, colour))
        )


def _selection_of(operation: Operation) -> dict[str, Any]:
    """Return the fields by which an operation selects paths."""
    keys = ("layers", "colours", "select", "size_mm", "area_mm2", "entities")
    return {key: getattr(operation, key) for key in keys}


def rested(operations: Sequence[Operation]) -> list[Operation]:
    """Return the operations, those that clear a rest linked to the operation that leaves it. The
    rest of a pocket must come after it; a carved floor may be cleared before or after its walls.
    """
    settled = []
    for row, each in enumerate(operations):
        later = [other for other in operations[row + 1 :] if other.contract.rest == "floor"]
        settled.append(each.after([*operations[:row], *later]))
    return settled


@dataclass(frozen=True, repr=False, eq=False)
class Placement(FrozenRecord):
    """The way of the drawing into the work frame, in this order: mirrored ("x" turns the sign of
    x, "y" of y), rotated, scaled by `scale` or to fit into `fit_mm` (width, height; 0: any),
    repeated `copies` (columns, rows) times at `pitch_mm`; then `origin` becomes part zero: one
    of ORIGINS, or the place (x, y) mm of the drawing so changed. Last comes the `turn` of a
    set-up."""

    origin: str | tuple[float, float] = "drawing"
    mirror: str | None = None
    rotate_rad: float = 0.0
    scale: float = 1.0
    fit_mm: tuple[float, float] | None = None
    copies: tuple[int, int] = (1, 1)
    pitch_mm: tuple[float, float] = (0.0, 0.0)
    turn: Turn = UNTURNED

    def __post_init__(self) -> None:
        if isinstance(self.origin, str):
            one_of("origin", self.origin, ORIGINS)
        if self.mirror is not None:
            one_of("mirror", self.mirror, ("x", "y"))
        finite("rotation", self.rotate_rad, "rad")
        above_zero("scale", self.scale, "")
        all_above_zero("copies", self.copies)
        self._refuse_contradictions()

    def _refuse_contradictions(self) -> None:
        """Raise OptionError for settings that are valid one by one but contradict each other, and
        for impossible lengths."""
        if self.fit_mm is not None:
            _refuse_fit(self.fit_mm)
            if self.scale != 1.0:
                raise OptionError(
                    f"scale {self.scale:g} and fit contradict each other",
                    where="key scale",
                    mend="give one of the two",
                )
        farthest = ALLOWED_TIMES * MAX_BY_UNIT["mm"]
        _refuse_beyond("pitch", self.pitch_mm, -farthest, farthest)
        if not isinstance(self.origin, str):
            _refuse_beyond("origin", self.origin, -MAX_POSITION_MM, MAX_POSITION_MM)
        for subject, count, pitch in zip(
            ("columns", "rows"), self.copies, self.pitch_mm, strict=True
        ):
            if count > 1 and pitch == 0.0:
                raise OptionError(
                    f"{count} {subject} of copies lie on one another",
                    where="key copies",
                    mend="give the pitch from one copy to the next",
                )
        if self.copies == (1, 1) and any(self.pitch_mm):
            raise OptionError(
                "a pitch is given without copies",
                where="key pitch",
                mend="give copies too, such as 3x2, or leave the pitch out",
            )


@dataclass(frozen=True, repr=False, eq=False)
class Stock(FrozenRecord):
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
                "the stock has only one of corner and size",
                where="[stock]",
                mend="give both corner and size, or thickness alone",
            )
        if self.spoilboard_mm is not None:
            at_least_zero("spoilboard", self.spoilboard_mm, "mm")

    @property
    def box_mm(self) -> Box | None:
        """Its left, lower, right and upper edge; None where the job does not give them."""
        if self.corner_mm is None or self.size_mm is None:
            return None
        (x, y), (width, height) = self.corner_mm, self.size_mm
        return x, y, x + width, y + height

    def turned(self, turn: Turn) -> Stock:
        """Return the stock as it lies in a set-up, turned over as this says."""
        box = self.box_mm
        return self if box is None else replace(self, corner_mm=turn.box(box)[:2])

    @property
    def through_mm(self) -> float:
        """Greatest depth of cuts below the stock, mm."""
        if self.spoilboard_mm is not None:
            return self.spoilboard_mm
        return min(THROUGH_MM, THROUGH_SHARE * self.thickness_mm)


@dataclass(frozen=True, repr=False, eq=False)
class KeepOutBox(FrozenRecord):
    """A box of the work frame that no part of a tool may enter, as a clamp: from and to along each
    axis, mm; `name` as the job calls it."""

    name: str
    x_mm: tuple[float, float]
    y_mm: tuple[float, float]
    z_mm: tuple[float, float] = (-math.inf, math.inf)

    def __post_init__(self) -> None:
        for key, (low, high) in (("x", self.x_mm), ("y", self.y_mm), ("z", self.z_mm)):
            if not low < high:
                raise OptionError(
                    f"{low:g} to {high:g} mm is no range",
                    where=f"key {key}",
                    mend="give the lesser one first",
                )

    def moved(self, by_mm: tuple[float, float]) -> KeepOutBox:
        """Return the box moved in X and Y."""
        (x, y), (left_x, right), (low, high) = by_mm, self.x_mm, self.y_mm
        return replace(self, x_mm=(left_x + x, right + x), y_mm=(low + y, high + y))


@dataclass(frozen=True, repr=False, eq=False)
class JobSetup(FrozenRecord):
    """A clamping of the part: its name, and the names of the operations that are done in it.

    `flip`: the part lies turned over, about a line along "x" or "y" that is `line_mm` from zero
    (None: through the middle of the stock), so that its other face is up, and the top of the stock
    is Z0 again. X0 Y0 stays where it is, or is the `zero` of the set-up: one of ZEROS of the stock
    as it lies then, or a place (x, y) mm of the frame without it. `pins_mm`: places (x, y) of
    alignment pins in the frame of the first face, which meet again when the part is turned.
    `flip_error_mm`: how far the faces may lie beside each other, None if that is not known."""

    name: str
    operations: tuple[str, ...]
    flip: str | None = None
    line_mm: float | None = None
    pins_mm: tuple[tuple[float, float], ...] = ()
    flip_error_mm: float | None = None
    zero: str | tuple[float, float] | None = None

    def __post_init__(self) -> None:
        if isinstance(self.zero, str):
            one_of("zero", self.zero, tuple(ZEROS))
        if self.flip is not None:
            one_of("flip", self.flip, ("x", "y"))
            at_least_zero("flip error", self.flip_error_mm or 0.0, "mm")
            return
        for key, value in (
            ("line", self.line_mm),
            ("flip_error", self.flip_error_mm),
            ("pins", self.pins_mm or None),
        ):
            if value is not None:
                raise OptionError(
                    f"{key} has no effect without flip",
                    where=f"key {key}",
                    mend='give flip = "y" for a part that is turned over left to right',
                )


def _refuse_pins(setup: JobSetup, turn: Turn, where: str) -> None:
    """Raise OptionError for pins that do not meet again when the part is turned over."""
    for x, y in setup.pins_mm:
        place = turn.point((x, y))
        if not any(math.dist(place, pin) <= PIN_SLACK_MM for pin in setup.pins_mm):
            across = turn.signs.index(-1.0)
            raise OptionError(
                f"the pin at X{x:g} Y{y:g} meets no other one, nor itself, when the part is"
                f" turned over: there is none at X{place[0]:g} Y{place[1]:g}",
                where=f"{where}, key pins",
                mend=f"put pins on the line {'XY'[across]}{0.5 * turn.shift_mm[across]:g}, or the"
                " same distance on both sides of it",
            )


@dataclass(frozen=True, repr=False, eq=False)
class Job(FrozenRecord):
    """A job: all that is to be cut of a drawing.

    `approach`: every cut starts after a move that takes up the backlash of both axes. `minimise`:
    one of GOALS. `compensate`: what is written is bent beforehand against the mechanics of its
    machine. `frames`: patterns of the layers whose contours, where they are not cut, are no edges
    of parts. `keep_out`: boxes that no tool may enter. `text`: how the drawing's text is read, ""
    where the job does not say it. `allow`: words of ALLOWED. `setups`: the clampings of a part
    that is cut from several sides, each of which is a job of its own (`setup`), with the whole job
    and what that says of it in `setup_of`. Operations with a breakthrough get their depth, those
    with a finishing pass become two. Raises OptionError for what no job can be."""

    operations: tuple[Operation, ...] = field(default_factory=lambda: (Operation(),))
    placement: Placement = Placement()
    stock: Stock | None = None
    safe_z_mm: float | None = None
    minimise: str = "rapids"
    approach: bool = False
    compensate: bool = False
    frames: tuple[str, ...] = FRAMES
    keep_out: tuple[KeepOutBox, ...] = ()
    text: str = ""
    setups: tuple[JobSetup, ...] = ()
    setup_of: tuple[Job, JobSetup] | None = None
    allow: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        above_zero("safe Z", self.safe_z_mm, "mm")
        one_of("goal", self.minimise, GOALS)
        for each in self.allow:
            one_of("word to allow", each, ALLOWED)
        if not self.operations:
            raise OptionError("the job has no operations", mend="give it at least one")
        settled = [each.settled(self.stock) for each in self.operations]
        stages = [stage for each in rested(settled) for stage in each.stages()]
        if "long" in self.allow:
            stages = [replace(each, may_be_long=True) for each in stages]
        object.__setattr__(self, "operations", tuple(stages))
        self._refuse_setups()

    def _refuse_setups(self) -> None:
        """Raise OptionError for set-ups with equal names or unknown operations, and for operations
        that are in no set-up."""
        names = [each.name for each in self.setups]
        operation_names = [each.name for each in self.operations if each.stage != "finish"]
        for row, setup in enumerate(self.setups):
            place = f"table [[setups]] {row + 1} {setup.name!r}"
            if not setup.name or setup.name in names[:row]:
                raise OptionError(
                    "set-ups have names of their own", where=place, mend="give each a name"
                )
            for name in setup.operations:
                if name not in operation_names:
                    raise OptionError(
                        f"there is no operation {name!r}",
                        where=f"{place}, key operations",
                        mend=guess(name, operation_names)
                        or f"known: {', '.join(operation_names)}",
                    )
            if not setup.operations:
                raise OptionError(
                    "has no operations", where=place, mend=f"known: {', '.join(operation_names)}"
                )
            self._turn(setup, place)
        taken_names = {name for setup in self.setups for name in setup.operations}
        for name in operation_names:
            if self.setups and name not in taken_names:
                raise OptionError(
                    f"operation {name!r} is in no set-up",
                    where="table [[setups]]",
                    mend="name it under operations of one of them",
                )

    def setup(self, name: str) -> Job:
        """Return the job of one set-up: its operations, with drawing and stock turned over as it
        says. OptionError for an unknown name."""
        chosen_setup = next((each for each in self.setups if each.name == name), None)
        if chosen_setup is None:
            names = [each.name for each in self.setups]
            raise OptionError(
                f"there is no set-up {name!r}",
                where="--setup",
                mend=guess(name, names)
                or (f"known: {', '.join(names)}" if names else "the job has no [[setups]]"),
            )
        operations = tuple(
            each
            for each in self.operations
            if each.name.removesuffix(FINISH if each.stage == "finish" else "")
            in chosen_setup.operations
        )
        turn, zero = self._turn(chosen_setup, f"set-up {name!r}")
        return replace(
            self,
            operations=operations,
            placement=replace(self.placement, turn=turn),
            stock=None if self.stock is None else self.stock.turned(turn),
            keep_out=tuple(box.moved((-zero[0], -zero[1])) for box in self.keep_out),
            setups=(),
            setup_of=(self, chosen_setup),
        )

    def flip_line_mm(self, setup: JobSetup) -> float | None:
        """Return the position of the line about which a set-up is turned over, mm; None if it is
        not turned over, or the position is not known."""
        box = None if self.stock is None else self.stock.box_mm
        across = 0 if setup.flip == "y" else 1
        if setup.line_mm is not None or setup.flip is None or box is None:
            return setup.line_mm
        return 0.5 * (box[across] + box[across + 2])

    def _turn(self, setup: JobSetup, where: str) -> tuple[Turn, tuple[float, float]]:
        """Return the map into the frame of a set-up, and its zero (x, y), mm, in the frame turned
        over but not shifted. OptionError if line or zero are not known, and for pins that do not
        meet."""
        turn, line = Turn(), self.flip_line_mm(setup)
        if setup.flip is not None:
            if line is None:
                raise OptionError(
                    "the line about which the part is turned over is not known",
                    where=where,
                    mend="give line, its distance from zero, or [stock] with corner and size: then"
                    " it goes through the middle of the stock",
                )
            turn = Turn.about(setup.flip, line)
            _refuse_pins(setup, turn, where)
        zero = setup.zero or (0.0, 0.0)
        if isinstance(zero, str):
            box = None if self.stock is None else self.stock.box_mm
            if box is None:
                raise OptionError(
                    f"where the {zero} is is not known",
                    where=f"{where}, key zero",
                    mend="write [stock] with its corner and size, or give zero = [x, y]",
                )
            (left_x, low, right, high), (x, y) = turn.box(box), ZEROS[zero]
            zero = left_x + x * (right - left_x), low + y * (high - low)
        return turn.then(Turn(shift_mm=(-zero[0], -zero[1]))), zero

    @property
    def whole(self) -> Job:
        """The job with all set-ups of the part, of which it may be one."""
        return self if self.setup_of is None else self.setup_of[0]

    @property
    def layers(self) -> tuple[str, ...]:
        """The patterns of the layers of all operations; empty when one of them takes all."""
        taking = [each for each in self.operations if each.contract.takes_drawn]
        if not all(operation.layers for operation in taking):
            return ()
        every = (pattern for operation in taking for pattern in operation.layers)
        return tuple(dict.fromkeys(every))

    def takes(self, layer: str, colour: str) -> bool:
        """Return True if any operation cuts the paths of this layer and colour."""
        return any(operation.takes(layer, colour) for operation in self.operations)


def job_of(**settings: Any) -> Job:
    """Return a job of one operation, from fields of Operation, Job and Placement by name, and
    those of its Tool with the prefix `tool_` (`tool_diameter_mm=0.2`). TypeError for a name that
    none of them has."""
    tool = {
        key.removeprefix("tool_"): settings.pop(key)
        for key in list(settings)
        if key.startswith("tool_")
    }
    if tool:
        settings["tool"] = Tool(**tool)
    job_fields = {key: settings.pop(key) for key in _names(Job) & settings.keys()}
    place = {key: settings.pop(key) for key in _names(Placement) & settings.keys()}
    if place:
        job_fields["placement"] = Placement(**place)
    return Job(operations=(operation_of(**{"kind": Operation.kind, **settings}),), **job_fields)


def operation_of(**settings: Any) -> Operation:
    """Return an operation with these fields; those that only its kind has (without a kind: any
    kind) go into `own`. TypeError for an unknown name."""
    named = [kind_named(settings["kind"])] if "kind" in settings else installed_kinds().values()
    own_names = {key.field for kind in named for key in kind.own.values()} - _names(Operation)
    own_fields = tuple(sorted((name, settings.pop(name)) for name in own_names & settings.keys()))
    return Operation(**settings, own=own_fields) if own_fields else Operation(**settings)


def _names(record: type) -> set[str]:
    return {each.name for each in fields(record)}
