"""Reading grbl 1.1 as it takes programs: its words, its groups, its rule for arcs (gcode.c).

Commands of grbl itself (`$H`, `$J=…`) and its realtime characters are the sender's, no program's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Final

import numpy as np

from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.blocks import Lexing, blocks_of
from ..gcode.read import M_CODES, ModalReader, Rules
from .dialect import MOST_TOOL, GrblController, GrblMachine
from .findings import FEED_TOO_SLOW

SLOW_GUARD: Final = 1e-6
"""Part of a feed: one below the slowest by less counts as the slowest."""

ROWS_AT_ONCE: Final = 1 << 14
"""So many moves are compared with the slowest feed at a time."""

MIST: Final = 70
"""M7, tenfold: grbl's error 20 in its default configuration (ENABLE_M7 of config.h is off)."""

GROUPS: Final = {
    **dict.fromkeys((0, 10, 20, 30, 800), "motion"),
    **dict.fromkeys((40, 530), "one block"),
    170: "plane",
    **dict.fromkeys((200, 210), "units"),
    **dict.fromkeys((900, 910), "distance"),
    911: "arc distance",
    940: "feed mode",
    400: "cutter radius",
    490: "tool length",
    **dict.fromkeys(range(540, 600, 10), "work frame"),
    610: "path",
}

_FRAME: Final = "moves part zero by what only the controller knows"
_PLANE: Final = "is another plane; arcs lie in XY here"
REFUSED: Final = {
    **dict.fromkeys(("G10", "G92", "G92.1"), _FRAME),
    **dict.fromkeys(("G28", "G30"), "goes to a place that only the controller remembers"),
    **dict.fromkeys(("G28.1", "G30.1"), "remembers a place, which is not simulated"),
    **dict.fromkeys(("G18", "G19"), _PLANE),
    **dict.fromkeys(("G38.2", "G38.3", "G38.4", "G38.5"), "probes, which cannot be simulated"),
    "G43": "is unknown to grbl, its error 20",
    "G43.1": "shifts Z by a tool length",
    "G93": "says feeds as inverse time, which is not read",
    "M6": "is unknown to grbl, its error 20",
    "M7": "is unknown to grbl as it ships, its error 20",
}


def read_program(data: bytes, machine: GrblMachine) -> Toolpath:
    """The moves of a program; ProgramError with block, line and column."""
    dialect = machine.dialect
    lexing = Lexing(
        letters="GMXYZIJKFSTPRL",
        lower_case=True,
        blanks="anywhere",
        parentheses=True,
        semicolon=True,
        block_numbers=True,
        line_chars=dialect.line_chars,
        counts_blanks=False,
    )
    reader = ModalReader(machine, rules_of(machine))
    for block in blocks_of(data, lexing, reader.take):
        reader.block(block)
    if reader.empty:
        raise ProgramError("the program is empty", mend="a program has blocks such as G0 X1")
    path = reader.finish()
    return replace(path, findings=(*path.findings, *_too_slow(path, machine)))


def _too_slow(path: Toolpath, machine: GrblMachine) -> Iterator[Finding]:
    """FEED_TOO_SLOW: cuts slower than the longest tick of the timer allows.

    A line of d mm whose leading axis makes n steps is never slower than d/n mm times the least
    rate of steps; an arc not slower than where it runs along an axis.
    """
    if not isinstance(machine.controller, GrblController):
        return
    least_hz = machine.controller.least_step_hz
    step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
    begin, count, worst, least_part, limit = path.start, 0, -1, np.inf, 0.0
    for low in range(0, len(path), ROWS_AT_ONCE):
        rows = slice(low, low + ROWS_AT_ONCE)
        travel = np.abs(np.diff(path.end[rows], axis=0, prepend=begin[None, :]))
        begin = path.end[rows][-1]
        steps = (travel / step_mm).max(axis=1, initial=0.0)
        along = np.linalg.norm(travel, axis=1) / np.maximum(steps, 1.0)
        along = np.where(path.kind[rows] >= Kind.ARC_CW, step_mm[:2].min(), along)
        least = 60.0 * least_hz * along
        cut, feed = (
            (path.kind[rows] >= Kind.LINE) & (path.kind[rows] <= Kind.ARC_CCW),
            path.feed[rows],
        )
        with np.errstate(invalid="ignore"):
            slow = np.flatnonzero(cut & (feed < least * (1.0 - SLOW_GUARD)))
        count += len(slow)
        if len(slow):
            part = feed[slow] / least[slow]
            if part.min() < least_part:
                least_part, at = float(part.min()), int(slow[part.argmin()])
                worst, limit = low + at, least[at]
    if count:
        yield FEED_TOO_SLOW(
            where=f"block {int(path.block[worst]) + 1}",
            measured=path.feed[worst],
            limit=limit,
            count=count,
            least_hz=least_hz,
        )


def rules_of(machine: GrblMachine) -> Rules:
    """What grbl takes; M7 where the machine file says that it was built with it."""
    dialect, mist = machine.dialect, machine.coolant.mist

    def arc_fault(r1: float, r2: float) -> str:
        """grbl's error 33; r1 is the radius that counts."""
        gap = abs(r1 - r2)
        wide = gap > dialect.arc_difference_mm and gap > dialect.arc_difference_part * r1
        if r1 <= dialect.arc_least_radius_mm or gap > dialect.arc_most_difference_mm or wide:
            return f"grbl's error 33: radius {r1:.4f} mm at the start, {r2:.4f} mm at the end"
        return ""

    return Rules(
        groups=GROUPS,
        refused={word: why for word, why in REFUSED.items() if not (mist and word == "M7")},
        first_motion=0,
        arc_fault=arc_fault,
        full_turn_rad=dialect.arc_full_turn_rad,
        chord_slack_mm=dialect.arc_chord_slack_mm,
        sure_gap_mm=min(dialect.arc_difference_mm, dialect.arc_most_difference_mm),
        sure_radius_mm=dialect.arc_least_radius_mm,
        ends_in_plane=True,
        m_codes={code: group for code, group in M_CODES.items() if mist or code != MIST},
        tools="none" if dialect.tool_change == "refuse" else "pause",
        most_tool=MOST_TOOL,
    )
