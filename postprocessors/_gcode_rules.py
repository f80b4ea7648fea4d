"""What a reader of G-code is told of its dialect, and the M words that all of them know."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Final


class G(IntEnum):
    """G words that a reader acts on, tenfold: G91.1 is 911. Arcs are above LINE."""

    RAPID = 0
    LINE = 10
    ARC_CCW = 30
    DWELL = 40
    INCHES = 200
    TOOL_LENGTH = 430
    MACHINE_FRAME = 530
    FIRST_FRAME = 540
    EXACT_PATH = 610
    BLEND = 640
    NO_MOTION = 800
    ABSOLUTE = 900
    ABSOLUTE_CENTRES = 901


class M(IntEnum):
    """M words that a reader acts on, tenfold."""

    PAUSE = 0
    END = 20
    SPINDLE_CW = 30
    SPINDLE_CCW = 40
    SPINDLE_OFF = 50
    CHANGE = 60
    END_AND_REWIND = 300


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
    `circle_without_end`: an arc that says only its centre is a full circle. `path_modes`: the
    group "path" tells how corners are met. `turns`: P tells how many turns an arc begins.
    `forgets_feed`: G94 does, and G1 to G3 want a feed even where nothing moves.
    `ends_in_plane`: an arc must say X or Y. `feed_first`: a feed beside a change of units is in
    the units before. `m_codes`: the M codes it takes and the group of each.
    `tools`: "change" (M6), "pause" (M0 beside a T word), or "none"; T words go up to `most_tool`.
    """

    groups: Mapping[int, str]
    refused: Mapping[str, str]
    first_motion: int | None
    arc_fault: Callable[[float, float], str]
    full_turn_rad: float
    chord_slack_mm: float
    circle_without_end: bool = False
    path_modes: bool = False
    turns: bool = False
    ends_in_plane: bool = False
    feed_first: bool = False
    forgets_feed: bool = False
    m_codes: Mapping[int, str] = field(default_factory=lambda: M_CODES)
    tools: str = "none"
    most_tool: int = 99_999
