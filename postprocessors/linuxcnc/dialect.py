"""The keys of `[dialect]` and `[controller]` of a LinuxCNC machine."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from camtool.machine.model import Link, Machine, SlideStart
from camtool.machine.ranges import Place, Tolerance

from ..gcode.dialect import GcodeDialect

Frame = Literal["G54", "G55", "G56", "G57", "G58", "G59", "G59.1", "G59.2", "G59.3"]


Home = Literal["G28", "G30"]

WorkOffset = Annotated[tuple[Place, ...], Meta(min_length=3, max_length=4)]


ToolNumber = Annotated[str, Meta(pattern=r"^[0-9]{1,5}$")]


class ToolTableEntry(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A line of the tool table, in mm: its offsets (`length_mm` along Z), its diameter (None: not
    known), and the orientation of a lathe tool."""

    length_mm: Place = 0.0
    x_mm: Place = 0.0
    y_mm: Place = 0.0
    diameter_mm: Annotated[float, Meta(ge=-1000.0, le=1000.0)] | None = None
    orientation: Annotated[int, Meta(ge=0, le=9)] = 0

    @property
    def offset_mm(self) -> tuple[float, float, float]:
        """Offset of the tool tip from the point that carries the tool, mm."""
        return self.x_mm, self.y_mm, self.length_mm


class LinuxcncDialect(GcodeDialect, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """`path`: corners are rounded within `blend_tolerance_mm` ("blend": G64 P), met without a stop
    where that is possible ("exact-path": G61), or met with a stop ("exact-stop": G61.1).
    `percent`: a line of % before and after the program. `tool_change`: by "m6", or a second tool
    is refused ("refuse"); `tool_lengths`: each change takes the length of its tool from the tool
    table (G43 H), else no length is in force (G49). `canned_cycles`: holes are drilled by G81, G82
    and G83.

    What programs that are read may ask of the machine: `tools`, its tool table by number (empty:
    any tool, of which nothing is known); `work_offsets_mm`: where G54 to G59.3 have their zero on
    the machine, X, Y, Z and the rotation in degrees, if any; `homes_mm`: where G28 and G30 go;
    `linear_units` of parameters such as #5221: LINEAR_UNITS of its INI file; `block_delete`: lines
    that begin with / are left out. `most_lines`: so many lines a program may execute that are read
    one by one."""

    path: Literal["blend", "exact-path", "exact-stop"] = "blend"
    blend_tolerance_mm: Tolerance = 0.01
    percent: bool = False
    tool_change: Literal["m6", "refuse"] = "m6"
    tool_lengths: bool = True
    canned_cycles: bool = False
    tools: dict[ToolNumber, ToolTableEntry] = msgspec.field(default_factory=dict)
    work_offsets_mm: dict[Frame, WorkOffset] = msgspec.field(default_factory=dict)
    homes_mm: dict[Home, tuple[Place, Place, Place]] = msgspec.field(default_factory=dict)
    linear_units: Literal["mm", "in"] = "mm"
    block_delete: bool = False
    most_lines: Annotated[int, Meta(ge=1, le=100_000_000)] = 300_000


class LinuxcncController(SlideStart, frozen=True, tag_field="model", tag="linuxcnc"):
    """LinuxCNC 2.9 with its trapezoid planner, and the options of its model.

    How corners are met the program says; where it does not, `[dialect]`, keys `path` and
    `blend_tolerance_mm`. `servo_period_s`: SERVO_PERIOD of the ini file. `lookahead_moves`:
    ARC_BLEND_OPTIMIZATION_DEPTH, `kink_ratio`: ARC_BLEND_KINK_RATIO, the part of the highest
    acceleration that a bend may take up within one period and pass for straight (defaults of
    initraj.cc)."""

    servo_period_s: Annotated[float, Meta(ge=1e-6, le=1.0)] = 0.001
    lookahead_moves: Annotated[int, Meta(ge=2, le=10_000)] = 50
    kink_ratio: Annotated[float, Meta(ge=0.001, le=0.7071)] = 0.1


Word = Annotated[str, Meta(pattern=r"^[!-~]+$")]


class LinuxcncLink(Link, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """linuxcncrsh: the passwords of its line (`--connectpw`) and of its commands (`--enablepw`),
    and the `folder` in which the computer of LinuxCNC finds the programs that are sent, where that
    is not the path that they have here. `stops_at_tools`: programs that are sent stop behind each
    tool change between cuts, until the user has touched off and lets them go on; false for a
    machine that changes and measures its tools itself."""

    password: Word = "EMC"
    enable_password: Word = "EMCTOO"
    folder: Word | None = None
    stops_at_tools: bool = True


LinuxcncMachine = Machine[SlideStart, LinuxcncDialect]
