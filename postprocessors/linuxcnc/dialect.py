"""The `[dialect]` table of a LinuxCNC machine."""

from __future__ import annotations

from typing import Literal

from camtool.machine.loader import convert
from camtool.machine.model import Machine
from camtool.machine.ranges import Tolerance

from ..gcode.dialect import GcodeDialect, feed_decimals


class Dialect(GcodeDialect, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """`path`: corners are rounded within `blend_tolerance_mm` ("blend": G64 P), met without a stop
    where that is possible ("exact-path": G61), or met with a stop ("exact-stop": G61.1).
    `percent`: a line of % before and after the program."""

    path: Literal["blend", "exact-path", "exact-stop"] = "blend"
    blend_tolerance_mm: Tolerance = 0.01
    percent: bool = False


def dialect_of(machine: Machine) -> Dialect:
    """The machine's `[dialect]` table; MachineError naming the key that does not fit."""
    feed_decimals(machine)
    return convert(machine.dialect, Dialect, machine.target.name, "dialect")
