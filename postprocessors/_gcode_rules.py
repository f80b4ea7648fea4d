"""What a reader of G-code is told of its dialect, and the M words that all of them know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

RAPID: Final = 0
"""G0, tenfold like all codes here."""

LINE: Final = 10
"""G1; G2 and G3 are above it."""

ARC_CCW: Final = 30
"""G3."""

NO_MOTION: Final = 800
"""G80: the motion mode in which coordinates have no meaning."""

DWELL: Final = 40
"""G4."""

MACHINE_FRAME: Final = 530
"""G53: the coordinates of this block are the machine's own."""

INCHES: Final = 200
"""G20."""

ABSOLUTE: Final = 900
"""G90."""

ABSOLUTE_CENTRES: Final = 901
"""G90.1."""

FIRST_FRAME: Final = 540
"""G54, in force when a program begins."""

TOOL_LENGTH: Final = 430
"""G43: coordinates are those of the tool's tip, as they are here anyway."""

BLEND: Final = 640
"""G64."""

M_CODES: Final = {
    0: "stop",
    10: "stop",
    20: "stop",
    300: "stop",
    30: "spindle",
    40: "spindle",
    50: "spindle",
    60: "tool",
    70: "coolant",
    80: "coolant",
    90: "coolant",
}
"""M words, tenfold, and their groups."""


@dataclass(frozen=True)
class Rules:
    """One dialect. Codes are tenfold: G91.1 is 911.

    `groups`: the G codes it takes and the group of each; two of a group in a block are an error.
    `refused`: codes ("G55", "M6") that the controller knows but that have no place in a program
    here, and why. `first_motion`: the motion mode before any word says one (None: none).
    `arc_fault`: why radii r1 and r2 (mm, at start and end) are no arc, "" if they are.
    `tools`: "change" (M6), "pause" (M0 beside a T word), or "none"; T words go up to `most_tool`.
    """

    groups: Mapping[int, str]
    refused: Mapping[str, str]
    first_motion: int | None
    arc_fault: Callable[[float, float], str]
    full_turn_rad: float
    chord_slack_mm: float
    tools: str = "none"
    most_tool: int = 99_999
