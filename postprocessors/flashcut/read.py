"""Reading flashcut, one block a line, by the four templates of the thesis (L980-1016).

The real program hands each line to the routine of its code; what it does with a line that fits no
template is not known, so here such a line is an error with block, line and column."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import ProgramError
from camtool.findings import Finding, Severity
from camtool.kernels import words
from camtool.kernels.lattice import to_steps
from camtool.machine.model import exceeds
from camtool.records import replace
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.blocks import (
    SURE_PART,
    Lexing,
    PlainBlocks,
    WordBlock,
    blocks_of,
    fill_forward,
    form_of,
)
from .dialect import MAX_MM, STOP_TEXT, FlashcutController, FlashcutDialect, FlashcutMachine
from .findings import EXECUTED_OTHERWISE, FEED_ABOVE_LIMIT, FEED_HELD, FEED_HELD_ALONE
from .timers import feeds_of, half_periods_ms, shortest_ms, steps_too_many

LEXING: Final = Lexing(letters="GMXYZIJF")

LIMITED_GUARD: Final = 0.01
"""Part of a feed: a feed above the highest by more counts as limited; half periods are whole
milliseconds, so less is rounding."""

WARNED_PART: Final = 0.5
"""Part of the programmed feed: a cut that gets less gives a warning instead of a remark."""

MAX_MS: Final = 1e9
"""Half periods longer than this make no shorter axis go too far."""

TEMPLATES: Final = {
    "G00": ("XY", "Z"),
    "G01": ("XY", "XYF", "Z"),
    "G02": ("XYIJ",),
    "G03": ("XYIJ",),
    "M00": ("",),
    "M02": ("",),
    "M03": ("",),
    "M04": ("",),
    "M05": ("",),
    "M30": ("",),
}
MOTIONS: Final = frozenset({"G00", "G01", "G02", "G03"})
MORE_FEEDS: Final = {"G01": ("ZF",), "G02": ("XYIJF",), "G03": ("XYIJF",)}
"""Further templates where feeds may stand everywhere."""

SPINDLE: Final = {"M03": Kind.SPINDLE_CW, "M04": Kind.SPINDLE_CCW, "M05": Kind.SPINDLE_OFF}
NOT_INCHES: Final = frozenset({"G20", "G21", "G30", "G31"})
"""Arcs in the list that the thesis cites (L393-432), which it does not implement."""


def read_program(data: bytes, machine: FlashcutMachine) -> Toolpath:
    """Return the moves of a program; ProgramError with block, line and column for data that are no
    program."""
    reader = _Reader(machine)
    for block in blocks_of(data, LEXING, reader.take):
        reader.block(block)
    if not reader.blocks:
        raise ProgramError("the program is empty", mend="a program has blocks such as M30")
    path = reader.path.finish(reader.findings())
    return replace(path, findings=(*path.findings, *_timer_findings(path, machine)))


class _Excess(Struct):
    """Count of blocks with a feed above the limit, the highest feed, and the first of them."""

    count: int = 0
    most: float = 0.0
    where: str = ""

    def add(self, index: int, feed: float) -> None:
        """Count the block `index` (from 0) with this feed; keep the highest feed and the first
        block."""
        self.where = self.where or f"block {index + 1}"
        self.count += 1
        self.most = max(self.most, feed)


class _Reader:
    """Reads blocks and adds rows to the path; keeps the feed in force and whether the program has
    ended."""

    def __init__(self, machine: FlashcutMachine) -> None:
        self.path = ToolpathBuilder()
        self.blocks = 0
        self._dialect: FlashcutDialect = machine.dialect
        self._max_feed = machine.max_feed_mm_min
        self._sign = 1.0 if self._dialect.z_up == "+" else -1.0
        self._templates = {code: set(forms) for code, forms in TEMPLATES.items()}
        if self._dialect.feed_words == "everywhere":
            for code, forms in MORE_FEEDS.items():
                self._templates[code] |= set(forms)
        self._plain_keys = np.array(
            [
                4 * form_of(f"G{form}") + int(code[1:])
                for code, forms in self._templates.items()
                if code in MOTIONS
                for form in forms
            ]
        )
        self._feed = math.nan
        self._ended = ""
        self._fast = _Excess()

    def block(self, block: WordBlock) -> None:
        """Check one block and add its moves and events to the path."""
        self.blocks += 1
        if self._ended:
            block.fail(f"a block after {self._ended}, the end of the program", mend="remove it")
        code = block.words[0][0] + block.words[0][1]
        form = "".join([letter for letter, _ in block.words[1:]])
        if form not in self._templates.get(code, ()):
            self._refuse(block, code, form)
        text = block.text.strip(" ")
        if text.count(" ") != len(block.words) - 1 or "  " in text or "\t" in text:
            _refuse_spacing(block)
        self.path.block = block.index
        if code in MOTIONS:
            self._motion(block, code, form, [float(number) for _, number in block.words[1:]])
        elif code in SPINDLE:
            self.path.event(SPINDLE[code])
        elif code == "M00":
            self.path.message(STOP_TEXT)
        else:
            self.path.event(Kind.END)
            self._ended = code

    def take(self, blocks: PlainBlocks) -> int:
        """Decode the first plain blocks at once, as columns, and return how many were decoded. It
        stops at the first block for which `block` might return something else."""
        if self._ended:
            return 0
        moves = DecodedMoves(
            blocks, self._plain_keys, (*self.path.position, self._feed), self._dialect
        )
        count = moves.count
        if count == 0:
            return 0
        self.blocks += count
        has_feed = blocks.has(words.F_WORD)[:count]
        for index in np.flatnonzero(
            has_feed & exceeds(moves.feed[:count], self._max_feed)
        ).tolist():
            self._fast.add(blocks.first + index, float(moves.feed[index]))
        self._feed = float(moves.feed[count - 1])
        rows = np.flatnonzero(moves.moving[:count])
        if len(rows):
            self.path.moves(
                kind=moves.kind[rows],
                end=moves.end[rows],
                centre=np.where(moves.is_arc[rows, None], moves.centre[rows], np.nan),
                feed=np.where(moves.kind[rows] == Kind.RAPID, np.nan, moves.feed[rows]),
                block=blocks.first + rows,
            )
        return count

    def findings(self) -> Iterator[Finding]:
        """Yield a finding if feeds exceed the machine's limit."""
        if self._fast.count:
            yield FEED_ABOVE_LIMIT(
                where=self._fast.where,
                measured=self._fast.most,
                limit=self._max_feed,
                count=self._fast.count,
            )

    def _motion(self, block: WordBlock, code: str, form: str, numbers: list[float]) -> None:
        """Add the move of G00 to G03: X Y Z from part zero, I J from where the arc begins (L1000,
        L1016)."""
        if not max(map(abs, numbers)) <= MAX_MM:
            word = next(
                word for word, number in enumerate(numbers, 1) if not abs(number) <= MAX_MM
            )
            block.fail(f"a number beyond ±{MAX_MM:g}", word=word, mend="check the units")
        if form[-1] == "F":
            self._set_feed(block, numbers.pop(), len(form))
        if code != "G00" and math.isnan(self._feed):
            block.fail(f"{code} before any F", mend="write F in a G01 of X and Y first")
        if code in ("G02", "G03"):
            self._arc(block, code, numbers)
            return
        x, y, z = (
            (None, None, self._sign * numbers[0] + 0.0)
            if form[0] == "Z"
            else (numbers[0], numbers[1], None)
        )
        if code == "G00":
            self.path.rapid(x, y, z)
        elif form != "XYF" or (x, y) != self.path.position[:2]:
            # A G01 with F to where the tool is sets the feed, no more.
            self.path.line(x, y, z, feed=self._feed)

    def _set_feed(self, block: WordBlock, feed: float, word: int) -> None:
        if feed <= 0.0:
            block.fail("a feed must be above 0", word=word, mend="write F3.0")
        if exceeds(feed, self._max_feed):
            self._fast.add(block.index, feed)
        self._feed = feed

    def _arc(self, block: WordBlock, code: str, numbers: list[float]) -> None:
        x, y, i, j = numbers
        at_x, at_y, _ = self.path.position
        centre = at_x + i, at_y + j
        radius, other = math.hypot(i, j), math.hypot(x - centre[0], y - centre[1])
        if radius == 0.0:
            block.fail("an arc about its own start", word=3, mend="give I and J from the start")
        spread, max_spread = abs(radius - other), self._dialect.arc_spread_mm
        if spread > max_spread:
            block.fail(
                f"the arc's start is {radius:.6g} mm from its centre, its end {other:.6g} mm",
                word=3,
                mend=f"they may differ by {max_spread:g} mm",
            )
        if (x, y) == (at_x, at_y) and self._dialect.full_circles == "halves":
            block.fail(
                "an arc that ends where it starts: whether it is a circle or nothing is not known",
                word=1,
                mend="write two half circles, or use --set dialect.full_circles=whole",
            )
        self.path.arc(x, y, centre=centre, ccw=code == "G03", feed=self._feed)

    def _refuse(self, block: WordBlock, code: str, form: str) -> None:
        """Raise ProgramError for a block that fits no template: at its first word that has no
        place, or for the word that it lacks."""
        forms = self._templates.get(code)
        if code in NOT_INCHES:
            block.fail(
                f"{code} is an arc in this controller's list, neither a unit nor a return, and "
                "the controller does not run it",
                mend="remove it; lengths are mm",
            )
        if forms is None:
            codes = " ".join(TEMPLATES)
            block.fail(f"{code} is not known", mend=f"use one of {codes}, with two digits")
        expected = " or ".join(" ".join([code, *one]) for one in sorted(forms))
        for index, letter in enumerate(form):
            if not any(one.startswith(form[: index + 1]) for one in forms):
                block.fail(
                    f"{letter} has no place here", word=index + 1, mend=f"write only {expected}"
                )
        block.fail(f"{code} lacks a word", word=len(form), mend=f"write {expected}")


class DecodedMoves:
    """N plain blocks decoded by columns: kind (N,), position of the tool after each (N, 3) mm,
    centre (N, 2) mm, feed in force (N,) mm/min, and masks of arcs and of blocks that move. Only
    the first `count` blocks may be used: for them `_Reader.block` would give exactly the same."""

    def __init__(
        self,
        blocks: PlainBlocks,
        keys: Ints,
        state: tuple[float, float, float, float],
        dialect: FlashcutDialect,
    ) -> None:
        *position, feed = state
        numbers, facts = blocks.numbers, blocks.facts
        sign = 1.0 if dialect.z_up == "+" else -1.0
        has_feed = blocks.has(words.F_WORD)
        has_code = blocks.has(words.G_WORD)
        self.kind = np.where(has_code, numbers[:, words.G_WORD], 0.0).astype(np.int64)
        self.is_arc = self.kind >= Kind.ARC_CW
        self.feed = fill_forward(has_feed, numbers[:, words.F_WORD], feed)
        x, y = numbers[:, words.X_WORD], numbers[:, words.Y_WORD]
        z = sign * numbers[:, words.Z_WORD] + 0.0
        self.end = np.column_stack(
            [
                fill_forward(blocks.has(words.X_WORD + axis), values, position[axis])
                for axis, values in enumerate((x, y, z))
            ]
        )
        start = np.concatenate([[position], self.end[:-1]])
        offset = numbers[:, words.I_WORD : words.J_WORD + 1]
        self.centre = start[:, :2] + np.where(self.is_arc[:, None], offset, 0.0)
        same_xy = (self.end[:, :2] == start[:, :2]).all(axis=1)
        # A G01 with F to where the tool is sets the feed, no more.
        self.moving = ~((facts[:, words.FORM] == form_of("GXYF")) & same_xy)
        is_sure = np.isin(4 * facts[:, words.FORM] + self.kind, keys)
        is_sure &= (facts[:, words.TWO_DIGITS] == 1) & (facts[:, words.ONE_BLANK] == 1)
        for column in range(words.X_WORD, words.F_WORD + 1):
            is_sure &= ~blocks.has(column) | (np.abs(numbers[:, column]) <= MAX_MM)
        is_sure &= ~has_feed | (self.feed > 0.0)
        is_sure &= (self.kind == Kind.RAPID) | ~np.isnan(self.feed)
        radius = np.hypot(*(start[:, :2] - self.centre).T)
        other = np.hypot(*(self.end[:, :2] - self.centre).T)
        fine = (radius > 0.0) & (np.abs(radius - other) <= SURE_PART * dialect.arc_spread_mm)
        if dialect.full_circles == "halves":
            fine &= ~same_xy
        is_sure &= ~self.is_arc | fine
        self.count = len(is_sure) if is_sure.all() else int(is_sure.argmin())


def _refuse_spacing(block: WordBlock) -> None:
    block.fail("words are not parted by exactly one space", mend="write G00 X1.0 Y1.0")


# How the machine's timers execute a program's lines and feeds: computed for some rows at a time,
# since the columns for all rows would need more memory than the program.

ROWS_AT_ONCE: Final = 1 << 14


class _Worst(Struct):
    """Count of rows with a fault, the worst of them, and its size."""

    count: int = 0
    row: int = -1
    most: float = 0.0

    def add(self, rows: Ints, sizes: Floats) -> None:
        """Count further rows (K,) whose faults have these sizes (K,); keep the worst row."""
        self.count += len(rows)
        if len(rows) and sizes.max() > self.most:
            self.row, self.most = int(rows[sizes.argmax()]), float(sizes.max())


def _timer_findings(path: Toolpath, machine: FlashcutMachine) -> Iterator[Finding]:
    """Yield findings on feeds that the millisecond timers cannot reach, and on moves of both axes
    that give the shorter axis too many steps."""
    controller = machine.controller
    if not isinstance(controller, FlashcutController):
        return
    too_fast, long, rapids = _Worst(), _Worst(), False
    for low in range(0, len(path), ROWS_AT_ONCE):
        rows = _Rows(path, slice(low, low + ROWS_AT_ONCE), machine)
        fastest, _ = rows.fastest_feeds(controller)
        with np.errstate(invalid="ignore"):
            fast_rows = np.flatnonzero(rows.feed > fastest * (1.0 + LIMITED_GUARD))
        too_fast.add(low + fast_rows, rows.feed[fast_rows] / fastest[fast_rows])
        extra = rows.steps_too_many(controller)
        fast_rows = np.flatnonzero(extra > 0)
        long.add(low + fast_rows, extra[fast_rows].astype(np.float64))
        rapids = rapids or bool((rows.kind[fast_rows] == Kind.RAPID).any())
    if too_fast.count:
        yield _slow_feed_finding(path, machine, controller, too_fast)
    if long.count:
        rows = _Rows(path, slice(long.row, long.row + 1), machine)
        shorter = int(rows.steps[0, :2].argmin())
        yield EXECUTED_OTHERWISE(
            where=f"block {int(path.block[long.row]) + 1}",
            measured=long.most * 1000.0 * rows.step_mm[shorter],
            limit=0.0,
            count=long.count,
            steps=int(long.most),
            stays=controller.goes_on_from == "programmed",
            rapids=rapids,
        )


def _slow_feed_finding(
    path: Toolpath, machine: FlashcutMachine, controller: FlashcutController, too_fast: _Worst
) -> Finding:
    """Return FEED_HELD for cuts programmed faster than the shortest half period of the timers
    allows."""
    row = _Rows(path, slice(too_fast.row, too_fast.row + 1), machine)
    fastest, moves_one_axis = row.fastest_feeds(controller)
    gets, programmed = float(fastest[0]), row.feed[0]
    return (FEED_HELD_ALONE if moves_one_axis[0] else FEED_HELD)(
        severity=Severity.WARNING if gets < WARNED_PART * programmed else Severity.INFO,
        where=f"block {int(path.block[too_fast.row]) + 1}",
        measured=gets,
        limit=programmed,
        count=too_fast.count,
    )


class _Rows:
    """Columns of consecutive rows of a toolpath: `kind` (K,), `feed` (K,) mm/min, NaN where they
    do not cut, `steps` (K, 3) of the axes without their signs."""

    def __init__(self, path: Toolpath, rows: slice, machine: FlashcutMachine) -> None:
        self.kind = path.kind[rows]
        self.feed = path.feed[rows]
        self.step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        start = path.start if rows.start == 0 else path.end[rows.start - 1]
        travel = np.abs(np.diff(path.end[rows], axis=0, prepend=start[None, :]))
        self.steps = np.column_stack(
            [to_steps(travel[:, axis], float(self.step_mm[axis])) for axis in range(3)]
        )

    def fastest_feeds(self, controller: FlashcutController) -> tuple[Floats, Bools]:
        """Return (K,) the highest feed of each row, mm/min, at the shortest half period that the
        controller can make; and a mask (K,) of rows that move one axis alone."""
        moves = self.steps != 0
        moves_one_axis = (moves.sum(axis=1) == 1) & (self.kind < Kind.ARC_CW)
        step_mm = np.where(moves[:, 2] & moves_one_axis, self.step_mm[2], self.step_mm[:2].max())
        return feeds_of(
            shortest_ms(moves_one_axis, controller), step_mm, controller
        ), moves_one_axis

    def steps_too_many(self, controller: FlashcutController) -> Ints:
        """Return (K,) the surplus steps that lines and rapids make on the shorter of X and Y."""
        steps = self.steps[:, :2]
        feed = np.where(self.kind == Kind.LINE, self.feed, np.inf)
        moves_one_axis = (steps == 0).any(axis=1)
        half_period = half_periods_ms(
            feed, float(self.step_mm[:2].max()), moves_one_axis, controller
        )
        whole_ms = np.minimum(half_period, MAX_MS).astype(np.int64)
        extra = steps_too_many(steps.max(axis=1), steps.min(axis=1), whole_ms, controller)
        return np.where(self.kind < Kind.ARC_CW, extra, 0)
