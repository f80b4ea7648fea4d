"""Reading LinuxCNC's plain programs: its words, its groups, its rule for arcs.

Parameters (#1), expressions ([…]), O words and everything else that computes cannot be read: run
the program through LinuxCNC for that.
"""

from __future__ import annotations

import re
from typing import Final

from camtool.errors import ProgramError
from camtool.toolpath.moves import Toolpath

from ..gcode.blocks import Lexing, blocks_of
from ..gcode.read import ModalReader, Rules
from .dialect import Dialect, LinuxcncMachine

GROUPS: Final = {
    **dict.fromkeys((0, 10, 20, 30, 800, 810, 820, 830), "motion"),
    80: "lathe diameter",
    **dict.fromkeys((40, 530), "one block"),
    170: "plane",
    **dict.fromkeys((200, 210), "units"),
    **dict.fromkeys((900, 910), "distance"),
    **dict.fromkeys((901, 911), "arc distance"),
    940: "feed mode",
    400: "cutter radius",
    **dict.fromkeys((430, 490), "tool length"),
    **dict.fromkeys(range(540, 600, 10), "work frame"),
    **dict.fromkeys((610, 611, 640), "path"),
    970: "spindle mode",
    **dict.fromkeys((980, 990), "return mode"),
}

_FRAME: Final = "moves part zero by what only the controller knows"
_COMPENSATES: Final = "compensates for a tool, which is not simulated"
_CYCLE: Final = "is a cycle; write its moves"
REFUSED: Final = {
    **dict.fromkeys(("G10", "G52", "G92", "G92.1", "G92.2", "G92.3"), _FRAME),
    **dict.fromkeys(("G59.1", "G59.2", "G59.3"), _FRAME),
    **dict.fromkeys(("G28", "G30"), "goes to a place that only the controller remembers"),
    **dict.fromkeys(("G28.1", "G30.1"), "remembers a place, which is not simulated"),
    **dict.fromkeys(("G17.1", "G18", "G18.1", "G19", "G19.1"), "is another plane than XY"),
    **dict.fromkeys(("G33", "G33.1", "G95", "G96"), "follows the spindle, not simulated"),
    **dict.fromkeys(("G38.2", "G38.3", "G38.4", "G38.5"), "probes, which cannot be simulated"),
    **dict.fromkeys(("G41", "G41.1", "G42", "G42.1", "G43.1", "G43.2"), _COMPENSATES),
    **dict.fromkeys(("G73", "G76", "G84", "G85", "G86", "G89"), _CYCLE),
    **dict.fromkeys(("G5", "G5.1", "G5.2", "G5.3"), "is a spline; write it as arcs"),
    "G7": "counts X as a diameter, as lathes do",
    "G93": "says feeds as inverse time, which is not read",
}


PECKED_MM: Final = 0.254
"""Between two pecks of G83 the drill comes back to this above where it was (0.010 inch)."""

LINE_END: Final = re.compile(rb"\r\n|\n|\r")

FRAME: Final = re.compile(rb"\s*%[ \t\v\f]*(?=[\r\n]|\Z)")
"""All up to a lone % on the first line that is not blank."""

FRAME_END: Final = re.compile(rb"[\r\n][ \t\v\f]*%[ \t\v\f]*(?=[\r\n]|\Z)")
"""A line of a lone %, and the end of the line before it."""

SAYS_SOMETHING: Final = re.compile(rb"\s*[^\s%(;]")
"""A line that is not blank, a % or a comment."""


def read_program(data: bytes, machine: LinuxcncMachine) -> Toolpath:
    """The moves of a program; ProgramError with block, line and column."""
    dialect = machine.dialect
    lexing = Lexing(
        letters="GMXYZIJKFSTPRLDHQABCUVW",
        lower_case=True,
        blanks="anywhere",
        parentheses=True,
        semicolon=True,
        block_numbers=True,
        line_chars=dialect.line_chars,
        comment_lines=True,
        foreign_comments=True,
    )
    reader = ModalReader(machine, rules_of(dialect))
    body, framed = _unframed(data)
    at, line = len(body), 0
    for block in blocks_of(body, lexing, reader.take):
        for text in block.comments:
            if text.lstrip()[:4].upper() == "MSG,":
                reader.message(text.lstrip()[4:].strip())
        if block.words:
            reader.block(block)
        if reader.ended:
            at, line = block.behind, block.line
            break
    if reader.empty and not framed:
        raise ProgramError("the program is empty", mend="a program has blocks such as G0 X1")
    if not (reader.ended or framed):
        raise ProgramError(
            "the file ends without an end of the program, which LinuxCNC reports as an error",
            where=f"line {max(_lines_of(data), 1)}",
            mend="end with M2, or put a line of % before and behind the program",
        )
    if not reader.ended:
        line = _lines_of(body)
    behind = LINE_END.split(data[at:])
    reader.unread([k for k, text in enumerate(behind, line + 1) if SAYS_SOMETHING.match(text)])
    return reader.finish()


def _lines_of(data: bytes) -> int:
    """How many lines these are."""
    ended = sum(1 for _ in LINE_END.finditer(data))
    return ended + (not data.endswith((b"\r", b"\n")) and len(data) > 0)


def _unframed(data: bytes) -> tuple[bytes, bool]:
    """The file up to the end that a % makes, and whether one does.

    Where the first line that is not blank is a lone % (it becomes blank), the next such line ends
    the program; elsewhere % is no word.
    """
    first = FRAME.match(data)
    if first is None:
        return data, False
    found = FRAME_END.search(data, first.end())
    end = found.start() + 1 if found else len(data)
    begin = max(data.rfind(b"\n", 0, first.end()), data.rfind(b"\r", 0, first.end())) + 1
    return data[:begin] + b" " * (first.end() - begin) + data[first.end() : end], found is not None


def rules_of(dialect: Dialect) -> Rules:
    """What LinuxCNC takes."""

    def arc_fault(r1: float, r2: float) -> str:
        """Its three regions of a radius difference, and the least radius."""
        if min(r1, r2) < dialect.arc_least_radius_mm:
            return f"an arc of radius {min(r1, r2):.5f} mm is none for LinuxCNC"
        gap = abs(r1 - r2)
        part = gap / max(r1, r2)
        wide = gap > dialect.arc_difference_mm and part > dialect.arc_difference_part
        if gap > dialect.arc_most_difference_mm or wide:
            return f"the radius is {r1:.4f} mm at the start and {r2:.4f} mm at the end of the arc"
        return ""

    return Rules(
        groups=GROUPS,
        refused=REFUSED,
        first_motion=None,
        arc_fault=arc_fault,
        full_turn_rad=dialect.arc_full_turn_rad,
        chord_slack_mm=dialect.arc_chord_slack_mm,
        sure_gap_mm=min(dialect.arc_difference_mm, dialect.arc_most_difference_mm),
        sure_radius_mm=dialect.arc_least_radius_mm,
        circle_without_end=True,
        path_modes=True,
        turns=True,
        feed_first=True,
        forgets_feed=True,
        pecked_mm=PECKED_MM,
        tools="change",
    )
