"""Reading LinuxCNC's programs as its interpreter does.

    texts        the program's lines, and the files of the subs that it calls
    flow         the order of lines: O words
    lines        a line's words; expressions, parameters: the numbers in them
    interpreter  what a block does: state, frames, moves; cycles, compensation, splines
    canon        moves in the frame of the part

Where hundreds of lines in a row are plain moves, they are read by columns, without any of these.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np

from camtool import bounds
from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.blocks import PlainBlocks, PlainRuns
from ..gcode.faults import LineFault
from ..gcode.findings import (
    NEVER_READ,
    SPINDLE_SPEED_NOT_SAID,
    WORDS_PASSED_OVER_COOLANT,
    WORDS_PASSED_OVER_PAUSE,
)
from ..gcode.plain_moves import ArcRule, FastFeeds, PlainMoves, PlainState
from .dialect import LinuxcncDialect, LinuxcncMachine
from .findings import (
    NO_END_OF_FILE,
    NOT_SIMULATED_AGAIN,
    NOT_SIMULATED_AXES,
    NOT_SIMULATED_CHORDS,
    NOT_SIMULATED_DELETED,
    NOT_SIMULATED_INPUT,
    NOT_SIMULATED_SPINDLE,
    NOT_SIMULATED_TAP,
    PLACE_UNKNOWN_FRAME,
    PLACE_UNKNOWN_HOME,
    TOOL_LENGTH_NOT_USED,
    TOOL_LENGTH_WRONG,
    VALUE_UNKNOWN_PARAMETER,
    WORDS_PASSED_OVER_OUTPUT,
)
from .flow import EndOfFile, Flow
from .interpreter import Interpreter
from .lines import LinuxcncBlock, ParsedLine
from .state import InterpreterNotes, Mounted
from .texts import Folder, ProgramText

LENGTHS_EQUAL_MM: Final = 1e-6

BRANCHES: Final = re.compile(rb"(?im)^[ \t]*/?[ \t]*(?:n[\d. \t]*)?(?:o|m[ \t]*9[ \t]*[89])")
"""A line that may send the reading elsewhere."""


def read_program(data: bytes, machine: LinuxcncMachine, folder: Path | None = None) -> Toolpath:
    """Return the moves of a program, whose subs lie in `folder`; ProgramError with block, line,
    column, and the call that led there."""
    count = data.count(b"\n")
    bounds.check_count(count, "line")
    reader = _Reader(data, machine, folder)
    try:
        return reader.read()
    finally:
        # The parts of a reader know each other, and last until garbage is collected.
        reader.text.close()


class _Reader:
    """Reader of one program."""

    def __init__(self, data: bytes, machine: LinuxcncMachine, folder: Path | None) -> None:
        dialect: LinuxcncDialect = machine.dialect
        self.path = ToolpathBuilder()
        self.notes = InterpreterNotes()
        self._fast = fast = FastFeeds(machine.max_feed_mm_min)
        self.notes.feeds = lambda block, feed: fast.note(block, np.array([feed]))
        self.machine = Interpreter(machine, self.path, self.notes)
        self.text = ProgramText(data, "", dialect.line_chars)
        self.flow = Flow(
            self.text,
            self.machine.given,
            Folder(folder, dialect.line_chars),
            dialect.most_lines,
            dialect.block_delete,
            restore=self._restore,
        )
        self.machine.calls = self.flow.calls
        self.machine.read_sub = self._read_sub
        self.flow.keep = self._branches = BRANCHES.search(self.text.data) is not None
        self._rule = ArcRule(
            gap_mm=min(dialect.arc_difference_mm, dialect.arc_most_difference_mm),
            radius_mm=dialect.arc_least_radius_mm,
            full_turn_rad=dialect.arc_full_turn_rad,
        )
        self._runs = PlainRuns(self.text, dialect.line_chars, free_order=True)
        self._blocks = 0
        """Blocks so far, of a program whose lines are read once and in order."""
        self._empty, self._cut_off = True, False

    def read(self) -> Toolpath:
        """Return the moves of the program, with the findings on it."""
        flow = self.flow
        try:
            self._begin()
            while not self.machine.ended:
                if self._read_plain():
                    continue
                line = flow.step()
                if line is None:
                    break
                self._execute(line)
        except EndOfFile:
            if self._empty:
                raise _empty_path() from None
            self._cut_off = True
        except LineFault as fault:
            flow.fail(fault)
        if self._empty and not flow.percent:
            raise _empty_path()
        if not self.machine.ended:
            self.machine.end_of_file()
        return self.path.finish(self._findings())

    def _begin(self) -> None:
        """Skip the first line if it is a lone %; a second % then ends the program."""
        for number in range(self.text.count):
            text = self.text.raw(number).strip()
            if text:
                self.flow.percent = text == "%"
                self.flow.at = number + 1 if self.flow.percent else 0
                return

    def _execute(self, line: ParsedLine) -> None:
        machine, flow = self.machine, self.flow
        if self._branches:
            index = self.text.blocks_before(flow.block_line)
        else:
            index = self._blocks
            self._blocks += line.is_block
        self._empty = self._empty and not line.is_block
        machine.block_index = self.path.block = index
        if flow.level:
            file_name = flow.here.text.name
            self.path.source = f"{file_name}: {flow.caller}" if file_name else flow.caller
        elif self.path.source:
            self.path.source = ""
        machine.execute(line.block(machine.given))
        flow.lines_read += machine.effort
        machine.effort = 0

    def _read_sub(self, number: int) -> Iterator[LinuxcncBlock]:
        """Yield the blocks of a sub, with their parameters set."""
        for line in self.flow.lines_of_sub(number):
            block = line.block(self.machine.given)
            self.machine.set_parameters(block)
            yield block

    def _restore(self, saved: object) -> None:
        from .modes import ActiveModes, restore

        assert isinstance(saved, ActiveModes)
        restore(self.machine, saved, self.machine.execute)

    # By columns

    def _read_plain(self) -> bool:
        """Read the plain lines from here on by columns; return True if there were any."""
        flow = self.flow
        if flow.seeks or flow.text is not self.text or not self.machine.reads_columns:
            return False
        first = self._blocks
        if self._branches:
            first = self.text.blocks_before(min(flow.at, self.text.count))
        count, flow.at = self._runs.run(flow.at, first, self._decode_plain)
        self._blocks += count
        self._empty = self._empty and not count
        return count > 0

    def _decode_plain(self, blocks: PlainBlocks) -> int:
        """Add the rows of plain blocks, up to the first that LinuxCNC may not execute as a plain
        move, and return the number of these blocks."""
        machine, path = self.machine, self.path
        motion = -1 if machine.motion in (None, 800) else int(machine.motion or 0)
        mm = machine.canon.mm
        position = machine.canon.snap(machine.canon.to_part(*machine.position))
        state = PlainState(motion, machine.feed_mm, mm, position)
        moves = PlainMoves(blocks, state, self._rule)
        if moves.count:
            path.source = self.flow.caller if self.flow.level else ""
            has_moved = moves.add_to(path, self._fast)
            machine.continue_from(*moves.last, path.position, moves=has_moved)
        return moves.count

    # What is said of the program

    def _unread_lines(self) -> list[int]:
        """Return the lines (from 1) behind the program's end, which the controller never reads;
        with branches, the end that was reached need not be the last."""
        if self._branches:
            return []
        lines_after = range(self.flow.at, self.text.count)
        return [number + 1 for number in lines_after if _has_text(self._raw_line(number))]

    def _raw_line(self, number: int) -> str:
        try:
            return self.text.raw(number)
        except LineFault:
            return "longer than a line may be"

    def _findings(self) -> Iterator[Finding]:
        notes, flow = self.notes, self.flow

        def block(index: int) -> str:
            return f"block {index + 1}"

        yield from self._fast.findings()
        if self._cut_off:
            last = max(self.text.count - 1, 0)
            place = f"block {self.text.blocks_before(last) + 1}, line {last + 1}"
            yield NO_END_OF_FILE(where=place)
        if notes.speedless:
            yield SPINDLE_SPEED_NOT_SAID(where=block(notes.speedless[0]))
        unread = self._unread_lines()
        if unread:
            yield NEVER_READ(where=f"line {unread[0]}", measured=len(unread))
        for sentence, blocks in (
            (WORDS_PASSED_OVER_COOLANT, notes.coolant),
            (WORDS_PASSED_OVER_PAUSE, notes.pauses),
            (WORDS_PASSED_OVER_OUTPUT, notes.outputs),
            (NOT_SIMULATED_INPUT, notes.inputs),
            (NOT_SIMULATED_SPINDLE, notes.tapping),
            (NOT_SIMULATED_TAP, notes.swapped),
        ):
            if blocks:
                yield sentence(where=block(blocks[0]), count=len(blocks))
        if notes.begins_again:
            yield NOT_SIMULATED_AGAIN()
        if notes.axes:
            first = min(notes.axes.values())
            yield NOT_SIMULATED_AXES(where=block(first), axes=", ".join(sorted(notes.axes)))
        for name, index in notes.frames.items():
            yield PLACE_UNKNOWN_FRAME(where=block(index), frame=name)
        yield from _lengths(notes.mounted, self.path.finish())
        for name, index in notes.homes.items():
            yield PLACE_UNKNOWN_HOME(where=block(index), home=name)
        if self.machine.canon.chords:
            yield NOT_SIMULATED_CHORDS(measured=self.machine.canon.chords)
        if flow.deleted:
            treatment = "left out" if flow.block_delete else "read"
            line = next(iter(flow.deleted))
            yield NOT_SIMULATED_DELETED(
                where=f"line {line}", count=len(flow.deleted), how=treatment
            )
        unset = self.machine.given.unset
        if unset:
            index, line = next(iter(unset.items()))
            yield VALUE_UNKNOWN_PARAMETER(
                where=f"line {line}", count=len(unset), first=float(index)
            )


def _lengths(mounted: list[Mounted], path: Toolpath) -> Iterator[Finding]:
    """Yield findings on tools that cut while the length of another tool, or none, is in force."""
    feeds = np.flatnonzero((path.kind >= Kind.LINE) & (path.kind <= Kind.ARC_CCW))
    begins = np.searchsorted(feeds, [each.row for each in mounted])
    cut = np.diff(np.append(begins, len(feeds))) > 0
    cutting = [
        each for each, cuts in zip(mounted, cut.tolist(), strict=True) if cuts and each.tool
    ]
    if len({each.tool for each in cutting}) < 2:
        return
    # An error that is equal for all tools was compensated when the zero was set.
    errors = [each.own_mm - each.length_mm for each in cutting if each.own_mm is not None]
    spread = max(errors) - min(errors) if errors else 0.0
    if spread > LENGTHS_EQUAL_MM:
        index = next(
            k for k, each in enumerate(errors) if abs(each - errors[0]) > LENGTHS_EQUAL_MM
        )
        first = [each for each in cutting if each.own_mm is not None][index]
        yield TOOL_LENGTH_WRONG(where=f"block {first.block + 1}", tool=first.tool, measured=spread)
    unmeasured = [each for each in cutting if each.own_mm is None and not each.measured]
    if unmeasured:
        tools = ", ".join(str(tool) for tool in sorted({each.tool for each in unmeasured}))
        yield TOOL_LENGTH_NOT_USED(where=f"block {unmeasured[0].block + 1}", tools=tools)


def _has_text(text: str) -> bool:
    """Return True if a line has more than blanks, a % and comments."""
    return text.strip()[:1] not in ("", "%", "(", ";")


def _empty_path() -> ProgramError:
    return ProgramError("the program is empty", mend="a program has blocks such as G0 X1")
