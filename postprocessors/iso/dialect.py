"""The keys of `[dialect]` of a machine whose language its file describes: all that writer and
reader share.

A *template* is a text with fields in braces, such as `S{rpm} M3`: the writer fills the fields in,
the reader finds their values. docs/dialects/iso.md has each key with an example."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta, Struct

from camtool.machine.model import Machine, SlideStart
from camtool.machine.ranges import Place, Radius, Slack, Tolerance

from ..gcode.dialect import GcodeDialect, Unit

Template = Annotated[str, Meta(min_length=1, max_length=120)]
Templates = Annotated[tuple[Template, ...], Meta(max_length=100)]
Decimals = Annotated[int, Meta(ge=1, le=6)]
Letters = Annotated[str, Meta(pattern="^[A-Z]*$", max_length=26)]
Code = Annotated[str, Meta(pattern=r"^[GM](0|[1-9][0-9]{0,2})(\.[1-9])?$")]

LENGTH_LETTERS: Final = "XYZIJKRQ"
"""Letters whose numbers are lengths."""

FEED_LETTER: Final = "F"


class WordFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """How words and their numbers look.

    `decimals` of lengths in mm, `inch_decimals` of those in inches; `trailing_zeros` 1.500 for
    1.5; `leading_zero` 0.5 for .5; `plus_sign` +1.5; `point` of numbers without decimals:
    "always", "needed" (never where no decimals follow), or "never" at all. `whole_letters`: the
    letters whose numbers without a point count units of the last decimal. `code_digits`: G1 or
    G01. `blanks` between words; `motion`, `coordinates` and `feed`: whether these words are
    written when they "change", or in "all" blocks."""

    decimals: Decimals = 3
    inch_decimals: Decimals = 4
    trailing_zeros: bool = True
    leading_zero: bool = True
    plus_sign: bool = False
    point: Literal["always", "needed", "never"] = "needed"
    whole_letters: Letters = ""
    code_digits: Annotated[int, Meta(ge=1, le=2)] = 1
    blanks: bool = True
    motion: Literal["change", "all"] = "change"
    coordinates: Literal["change", "all"] = "change"
    feed: Literal["change", "all"] = "change"


class LineFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """How lines end, how long they may be, and their numbers N: `first`, by `step`, with at least
    `digits` digits, up to `highest`, behind which they begin again."""

    end: Literal["lf", "crlf", "cr"] = "lf"
    max_chars: Annotated[int, Meta(ge=16, le=1_000_000)] = 256
    numbers: bool = False
    first: Annotated[int, Meta(ge=0, le=99_999)] = 10
    step: Annotated[int, Meta(ge=1, le=1000)] = 10
    digits: Annotated[int, Meta(ge=1, le=8)] = 1
    highest: Annotated[int, Meta(ge=1, le=99_999_999)] = 99_999


CommentStyle = Literal["parentheses", "semicolon"]


class CommentFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """What comments a program has, and how they look.

    `style` of those that are written; `reads`: other styles that the controller takes as well;
    `show` as for the other dialects of G-code; `max_chars` of a text; `upper_case` makes capitals
    of small letters; `characters` beyond letters, digits and blanks that may stand in one."""

    style: Literal["parentheses", "semicolon", "none"] = "parentheses"
    reads: tuple[CommentStyle, ...] = ()
    show: Literal["contours", "operations", "header", "none"] = "contours"
    max_chars: Annotated[int, Meta(ge=8, le=60)] = 60
    upper_case: bool = False
    characters: Annotated[str, Meta(max_length=20)] = "._+:/=-"

    @property
    def styles_read(self) -> tuple[str, ...]:
        """All styles that the reader takes."""
        return (self.style, *self.reads)


class ProgramFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """What stands around the moves.

    `units` of all lengths; `frame`: the line at both ends that is no block, or ""; `number` of the
    program, for the field {number}; `head`: blocks behind the comments of the beginning, in which
    {units} is G21 or G20 and {feeds} G94, G95 or G93; `foot`: blocks at the end, of which the last
    one is `end`, or "" where a program ends with its last line; `retract`: up to the highest Z
    before that if the tool is left in the material. `never`: codes that must not appear;
    `passed_over`: codes that the reader takes and that move nothing."""

    units: Literal["mm", "in"] = "mm"
    frame: Annotated[str, Meta(pattern="^%?$")] = ""
    number: Annotated[int, Meta(ge=0, le=99_999_999)] = 1
    head: Templates = ("G17 {units} G90 {feeds}",)
    foot: Templates = ()
    end: Literal["M2", "M30", ""] = "M30"
    retract: bool = True
    never: tuple[Code, ...] = ()
    passed_over: tuple[Code, ...] = ()


class FeedFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """What F means: a feed per minute (G94), per revolution (G95), or the inverse of a move's time
    in minutes (G93), and the `decimals` of the last two. `rapids`: whether G0 goes as fast as the
    machine can ("own"), or at F as G1 does ("programmed"), and gets that of rapids written."""

    mode: Literal["per-minute", "per-revolution", "inverse-time"] = "per-minute"
    decimals: Annotated[int, Meta(ge=1, le=6)] = 4
    rapids: Literal["own", "programmed"] = "own"


class ArcFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """How arcs are said, and which the controller takes.

    `form`: "offsets" (I and J from the start to the centre), "centre" (I and J are the centre),
    "radius" (R), or "chords": no arcs at all. `full_circles` as one arc ("whole") or as two;
    `helices`: arcs may change Z; `max_sweep_deg`: longer arcs are written as equal parts (left
    out: 360, and 120 where `form` is "radius"); `min_radius_mm` and `max_radius_mm`: others are
    written as lines; `difference_mm`: the radii at start and end may differ by so much."""

    form: Literal["offsets", "centre", "radius", "chords"] = "offsets"
    full_circles: Literal["whole", "halves"] = "whole"
    helices: bool = True
    max_sweep_deg: Annotated[float, Meta(ge=1.0, le=360.0)] | None = None
    min_radius_mm: Slack = 0.001
    max_radius_mm: Radius = 10_000.0
    difference_mm: Tolerance = 0.01

    @property
    def sweep_deg(self) -> float:
        """The longest arc, degrees."""
        if self.max_sweep_deg is not None:
            return self.max_sweep_deg
        return MAX_RADIUS_SWEEP_DEG if self.form == "radius" else 360.0


MAX_RADIUS_SWEEP_DEG: Final = 120.0
"""Arcs that are said by R turn by no more: beyond it, the rounding of R moves the middle of the
arc by more than it is."""


class EventFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """Blocks of events; () where a program cannot say it.

    Fields: `spindle_cw` and `spindle_ccw` have {rpm}, {percent} of `spindle.max_rpm`, or {pwm},
    which is 255 there; `rpm_decimals` of {rpm}; `dwell` {s} or {ms}; `tool_change` {tool};
    `message` {text}, "" for a plain comment. `first_tool`: whether the tool of the first cut is
    changed to by the program, or mounted before it ("by-hand"); `mount_messages`: the operator is
    told what to mount at each change."""

    rpm_decimals: Annotated[int, Meta(ge=0, le=3)] = 3
    spindle_cw: Templates = ("S{rpm} M3",)
    spindle_ccw: Templates = ("S{rpm} M4",)
    spindle_off: Templates = ("M5",)
    mist: Templates = ("M7",)
    flood: Templates = ("M8",)
    coolant_off: Templates = ("M9",)
    dwell: Templates = ("G4 P{s}",)
    tool_change: Templates = ("T{tool} M6",)
    max_tool: Annotated[int, Meta(ge=0, le=99_999_999)] = 99
    first_tool: Literal["program", "by-hand"] = "program"
    mount_messages: bool = False
    message: Annotated[str, Meta(max_length=120)] = ""
    home_xy: Templates = ()
    home_z: Templates = ()


class CycleFormat(Struct, frozen=True, forbid_unknown_fields=True):
    """Cycles of holes. With `use`, holes are written as cycles where there is a template, else as
    moves. Fields: {x} {y} {z} {r} {f}, of `dwell` {s} or {ms} too, of `peck` and `chip` {q}.
    `again`: the next hole of the same cycle; `end` behind the last. `pecks_as`: which cycle pecks.
    The last two lengths are those of the controller: how far above the last bite G83 goes back as
    a rapid, and how far G73 draws back."""

    use: bool = False
    drill: Annotated[str, Meta(max_length=120)] = ""
    dwell: Annotated[str, Meta(max_length=120)] = ""
    peck: Annotated[str, Meta(max_length=120)] = ""
    chip: Annotated[str, Meta(max_length=120)] = ""
    bore: Annotated[str, Meta(max_length=120)] = ""
    tap: Annotated[str, Meta(max_length=120)] = ""
    again: Annotated[str, Meta(max_length=120)] = "X{x} Y{y}"
    end: Annotated[str, Meta(max_length=120)] = "G80"
    pecks_as: Literal["peck", "chip"] = "peck"
    clearance_mm: Slack = 0.25
    chip_mm: Slack = 0.25


Frame = Literal["G54", "G55", "G56", "G57", "G58", "G59"]

Spot = tuple[Place, Place, Place]


class IsoDialect(Struct, frozen=True, forbid_unknown_fields=True):
    """The language of a controller, table by table. `work_offsets_mm`: where the frames have their
    zero on the machine, for programs that use several."""

    words: WordFormat = WordFormat()
    lines: LineFormat = LineFormat()
    comments: CommentFormat = CommentFormat()
    program: ProgramFormat = ProgramFormat()
    feeds: FeedFormat = FeedFormat()
    arcs: ArcFormat = ArcFormat()
    events: EventFormat = EventFormat()
    cycles: CycleFormat = CycleFormat()
    work_offsets_mm: dict[Frame, Spot] = msgspec.field(default_factory=dict)

    @property
    def unit(self) -> Unit:
        """Unit of lengths, with the number of decimals that it has more than mm."""
        if self.program.units == "mm":
            return Unit("mm", 1.0, "G21", 0)
        return Unit("inch", 25.4, "G20", self.words.inch_decimals - self.words.decimals)

    @property
    def last_decimal_mm(self) -> float:
        """The value of the last decimal of a length, mm."""
        return float(self.unit.mm * 10.0 ** -(self.words.decimals + self.unit.more_decimals))

    @property
    def gcode(self) -> GcodeDialect:
        """Options for the shared writer of G-code; lengths in mm."""
        words, arcs = self.words, self.arcs
        return GcodeDialect(
            units=self.program.units,
            decimals=words.decimals,
            strip_zeros=not words.trailing_zeros,
            line_chars=max(self.lines.max_chars, 64),
            block_numbers=self.lines.numbers,
            comments=self.comments.show,
            full_circles=arcs.full_circles,
            retract=self.program.retract,
            arc_difference_mm=arcs.difference_mm,
            arc_difference_part=1e-9,
            arc_most_difference_mm=arcs.difference_mm,
            arc_least_radius_mm=arcs.min_radius_mm,
            arc_most_radius_mm=arcs.max_radius_mm,
            arc_full_turn_rad=FULL_TURN_RAD,
        )


FULL_TURN_RAD: Final = 1e-9
"""An arc that turns by less is a full circle: one whose ends are the same."""

EVENT_FIELDS: Final = {
    "spindle_cw": ("rpm", "percent", "pwm"),
    "spindle_ccw": ("rpm", "percent", "pwm"),
    "dwell": ("s", "ms"),
    "tool_change": ("tool",),
    "message": ("text",),
}
"""The fields that the blocks of an event may have; others have none."""

CYCLE_FIELDS: Final = {
    "drill": ("x", "y", "z", "r", "f"),
    "dwell": ("x", "y", "z", "r", "f", "s", "ms"),
    "peck": ("x", "y", "z", "r", "f", "q"),
    "chip": ("x", "y", "z", "r", "f", "q"),
    "bore": ("x", "y", "z", "r", "f"),
    "tap": ("x", "y", "z", "r", "f"),
    "again": ("x", "y"),
    "end": (),
}
"""The fields of the templates of cycles."""

PROGRAM_FIELDS: Final = ("units", "feeds", "number")
"""The fields of head and foot."""

SPEED_SCALES: Final = {"rpm": None, "percent": 100.0, "pwm": 255.0}
"""What a speed field says at `spindle.max_rpm`; None: the speed itself."""

IsoMachine = Machine[SlideStart, IsoDialect]
