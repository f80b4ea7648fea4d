"""The `[dialect]` table of a grbl machine."""

from __future__ import annotations

from typing import Final, Literal

from camtool.machine.loader import convert
from camtool.machine.model import Machine
from camtool.machine.ranges import Seconds

from ..gcode.dialect import GcodeDialect, feed_decimals

MOST_TOOL: Final = 255
"""Tools beyond it are grbl's error 38 (`MAX_TOOL_NUMBER`, gcode.c)."""


class Dialect(GcodeDialect, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """`tool_change`: grbl knows no M6, so a change is refused ("refuse"), or the program says the
    tool and stops until the operator goes on ("pause": `T2 M0`). `most_dwell_s`: grbl counts
    longer dwells wrong."""

    tool_change: Literal["refuse", "pause"] = "refuse"
    most_dwell_s: Seconds


def dialect_of(machine: Machine) -> Dialect:
    """The machine's `[dialect]` table; MachineError naming the key that does not fit."""
    feed_decimals(machine)
    return convert(machine.dialect, Dialect, machine.target.name, "dialect")
