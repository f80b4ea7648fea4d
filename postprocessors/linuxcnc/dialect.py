"""The keys of `[dialect]` and `[controller]` of a LinuxCNC machine."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from camtool.machine.model import Machine, SlideStart
from camtool.machine.ranges import Tolerance

from ..gcode.dialect import GcodeDialect


class Dialect(GcodeDialect, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """`path`: corners are rounded within `blend_tolerance_mm` ("blend": G64 P), met without a stop
    where that is possible ("exact-path": G61), or met with a stop ("exact-stop": G61.1).
    `percent`: a line of % before and after the program. `tool_change`: by "m6", or a second tool
    is refused ("refuse"); `tool_lengths`: each change takes the length of its tool from the tool
    table (G43 H). `canned_cycles`: holes are drilled by G81, G82 and G83."""

    path: Literal["blend", "exact-path", "exact-stop"] = "blend"
    blend_tolerance_mm: Tolerance = 0.01
    percent: bool = False
    tool_change: Literal["m6", "refuse"] = "m6"
    tool_lengths: bool = False
    canned_cycles: bool = False


class LinuxcncController(SlideStart, frozen=True, tag_field="model", tag="linuxcnc"):
    """LinuxCNC 2.9 with its trapezoid planner, and the options of its model.

    How corners are met the program says; where it does not, `[dialect]`, keys `path` and
    `blend_tolerance_mm`. `servo_period_s`: SERVO_PERIOD of the ini file. `lookahead_moves`:
    ARC_BLEND_OPTIMIZATION_DEPTH, `kink_ratio`: ARC_BLEND_KINK_RATIO, the part of the highest
    acceleration that a bend may take up within one period and pass for straight (defaults of
    initraj.cc).
    """

    servo_period_s: Annotated[float, Meta(ge=1e-6, le=1.0)] = 0.001
    lookahead_moves: Annotated[int, Meta(ge=2, le=10_000)] = 50
    kink_ratio: Annotated[float, Meta(ge=0.001, le=0.7071)] = 0.1


LinuxcncMachine = Machine[SlideStart, Dialect]
"""Any machine with this dialect."""
