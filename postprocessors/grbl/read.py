"""Reading grbl 1.1's programs: lines as they come in over the serial port (protocol.c), then its
parser.

    parser   what a line does, with grbl's own errors

Where hundreds of lines in a row are plain moves, they are read by columns, past the parser."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NoReturn

import numpy as np

from camtool import bounds
from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.blocks import PlainBlocks, PlainRuns, ProgramLines, check_ascii, has_words
from ..gcode.faults import LineFault
from ..gcode.findings import (
    SPINDLE_SPEED_NOT_SAID,
    WORDS_PASSED_OVER_COOLANT,
    WORDS_PASSED_OVER_PAUSE,
)
from ..gcode.plain_moves import ArcRule, FastFeeds, PlainMoves, PlainState
from .dialect import GrblController, GrblDialect, GrblMachine
from .findings import (
    FEED_TOO_SLOW,
    NOT_SIMULATED_CHORDS,
    NOT_SIMULATED_JOG,
    NOT_SIMULATED_REALTIME,
    NOT_SIMULATED_SLASH,
    PLACE_UNKNOWN_FRAME,
    PLACE_UNKNOWN_HOME,
)
from .parser import GrblParser, ParserNotes

SLOW_GUARD: Final = 1e-6
"""Part of a feed: one below the slowest by less counts as the slowest."""

ROWS_AT_ONCE: Final = 1 << 14

COMMENT: Final = re.compile(r"\([^)]*\)?|;.*")


def read_program(data: bytes, machine: GrblMachine) -> Toolpath:
    """Return the moves of a program; ProgramError with block, line, column and grbl's error
    number."""
    bounds.check_count(max(data.count(b"\n"), data.count(b"\r")), "line")
    check_ascii(data)  # bytes above 7F are commands to grbl, wherever they stand
    path = _Reader(data, machine).read()
    return replace(path, findings=(*path.findings, *_too_slow(path, machine)))


class _Reader:
    """Reader of one program."""

    def __init__(self, data: bytes, machine: GrblMachine) -> None:
        dialect: GrblDialect = machine.dialect
        self.path = ToolpathBuilder()
        self.notes = ParserNotes()
        self.parser = GrblParser(machine, self.path, self.notes)
        self._lines = ProgramLines(data)
        self._fast = FastFeeds(machine.max_feed_mm_min)
        self._rule = ArcRule(
            gap_mm=min(dialect.arc_difference_mm, dialect.arc_most_difference_mm),
            radius_mm=dialect.arc_least_radius_mm,
            full_turn_rad=dialect.arc_full_turn_rad,
            ends_in_plane=True,
        )
        self._runs = PlainRuns(self._lines, dialect.line_chars, free_order=True)
        self._most = dialect.line_chars
        self._blocks = 0
        self._slashes: list[int] = []
        self._realtime: list[int] = []

    def read(self) -> Toolpath:
        """Read the program and return its moves, which hold the findings on it."""
        number, parser = 0, self.parser
        while number < self._lines.count:
            if parser.reads_columns and not parser.ended:
                count, number = self._runs.run(number, self._blocks, self._decode_plain)
                self._blocks += count
                if count:
                    continue
            self._line(self._lines.text(number), number)
            number += 1
        if not self._blocks:
            raise ProgramError("the program is empty", mend="a program has blocks such as G0 X1")
        return self.path.finish(self._findings())

    def _line(self, raw: str, number: int) -> None:
        """Execute a line as it comes in: remove blanks and comments, convert to capitals, and
        count the blocks."""
        comments = "".join(COMMENT.findall(raw)) if "(" in raw or ";" in raw else ""
        text = COMMENT.sub("", raw) if comments else raw
        if any(sign in comments for sign in "!?~"):
            self._realtime.append(number + 1)
        if "/" in text:
            self._slashes.append(number + 1)
        text = text.translate(_DROPPED).upper()
        if not text:
            return
        if len(text) > self._most:
            limit = self._most
            message = f"the line has more than {self._most} characters (error:11)"
            self._fail(LineFault(message, limit, "shorten it"), raw, number)
        self.parser.index = self.path.block = self._blocks
        is_block = has_words(raw)
        if is_block and self.parser.ended:
            self._fail(
                LineFault("a block after the end of the program", None, "remove it"), raw, number
            )
        try:
            self.parser.line(text)
        except LineFault as fault:
            self._fail(fault, raw, number)
        self._blocks += is_block

    def _fail(self, fault: LineFault, raw: str, number: int) -> NoReturn:
        columns = _columns(raw)
        place = fault.at
        if not isinstance(place, int):  # the first word behind a block number
            numbered = re.match(r"N[0-9.]*", "".join(raw[k] for k in columns).upper())
            place = numbered.end() if numbered else 0
        column = columns[place] + 1 if place < len(columns) else len(raw) + 1
        where = f"block {self._blocks + 1}, line {number + 1}, column {column}"
        raise ProgramError(fault.message, where=where, mend=fault.mend) from None

    def _decode_plain(self, blocks: PlainBlocks) -> int:
        """Add the rows of plain blocks, up to the first that grbl may not execute as a plain move,
        and return the number of these blocks."""
        parser, path = self.parser, self.path
        motion = -1 if parser.modes.motion == 80 else 10 * parser.modes.motion
        mm = 25.4 if parser.modes.inches else 1.0
        x, y, z = parser.position
        moves = PlainMoves(blocks, PlainState(motion, parser.feed, mm, (x, y, z)), self._rule)
        if moves.count:
            has_moved = moves.add_to(path, self._fast)
            parser.moves.moved = parser.moves.moved or has_moved
            last, feed = moves.last
            parser.continue_from(None if last is None else last // 10, feed, path.position)
        return moves.count

    def _findings(self) -> Iterator[Finding]:
        notes = self.notes
        for index, feed in notes.feeds:
            self._fast.note(index, np.array([feed]))
        yield from self._fast.findings()
        if notes.speedless:
            yield SPINDLE_SPEED_NOT_SAID(where=f"block {notes.speedless[0] + 1}")
        for sentence, blocks in (
            (WORDS_PASSED_OVER_COOLANT, notes.coolant),
            (WORDS_PASSED_OVER_PAUSE, notes.pauses),
            (NOT_SIMULATED_JOG, notes.jogs),
        ):
            if blocks:
                yield sentence(where=f"block {blocks[0] + 1}", count=len(blocks))
        for sentence, lines in (
            (NOT_SIMULATED_SLASH, self._slashes),
            (NOT_SIMULATED_REALTIME, self._realtime),
        ):
            if lines:
                yield sentence(where=f"line {lines[0]}", count=len(lines))
        for name, index in notes.frames.items():
            yield PLACE_UNKNOWN_FRAME(where=f"block {index + 1}", frame=name)
        for name, index in notes.homes.items():
            yield PLACE_UNKNOWN_HOME(where=f"block {index + 1}", home=name)
        if self.parser.moves.chords:
            yield NOT_SIMULATED_CHORDS(measured=self.parser.moves.chords)


_DROPPED: Final = str.maketrans("", "", " \t/")


def _columns(raw: str) -> list[int]:
    """Return the columns, from 0, of those characters of a line that grbl keeps."""
    blanked = COMMENT.sub(lambda match: " " * len(match[0]), raw)
    return [k for k, sign in enumerate(blanked) if sign not in " \t/"]


def _too_slow(path: Toolpath, machine: GrblMachine) -> Iterator[Finding]:
    """Yield FEED_TOO_SLOW for cuts slower than the longest tick of the timer allows.

    A line of d mm whose leading axis makes n steps cannot be slower than d/n mm times the lowest
    step rate; an arc cannot be slower than where it runs along an axis."""
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
        min_feed = 60.0 * least_hz * along
        cut, feed = (
            (path.kind[rows] >= Kind.LINE) & (path.kind[rows] <= Kind.ARC_CCW),
            path.feed[rows],
        )
        with np.errstate(invalid="ignore"):
            slow = np.flatnonzero(cut & (feed < min_feed * (1.0 - SLOW_GUARD)))
        count += len(slow)
        if len(slow):
            part = feed[slow] / min_feed[slow]
            if part.min() < least_part:
                least_part, worst_row = float(part.min()), int(slow[part.argmin()])
                worst, limit = low + worst_row, min_feed[worst_row]
    if count:
        yield FEED_TOO_SLOW(
            where=f"block {int(path.block[worst]) + 1}",
            measured=path.feed[worst],
            limit=limit,
            count=count,
            least_hz=least_hz,
        )
