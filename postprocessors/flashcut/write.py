"""Writing flashcut: a Toolpath to blocks that repeat every word but the feed.

    rows ──checked──▶ XY and Z apart ──units, arcs repaired──▶ blocks, F where it changes

The syntax has F in G01 of XY alone (L989-992). So a feed that changes before a Z move or an arc
is written as a G01 to where the tool is: X and Y "aún así es necesario", L985."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.bounds import refuse_too_long
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.kernels.lattice import to_steps
from camtool.toolpath.lower import MAX_PARTS, LoweredToolpath
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program
from camtool.toolpath.refusals import refuse
from camtool.toolpath.words import WordColumn, texts_of

from ..gcode.checks import feed_units
from ..gcode.dialect import feed_decimals
from ..gcode.plain import (
    ArcRules,
    PlainRows,
    arc_findings,
    check_plain,
    left_out,
    plain_rows,
    split_z,
)
from .dialect import MAX_MM, STOP_TEXT, FlashcutController, FlashcutDialect, FlashcutMachine
from .findings import EVENT_LEFT_OUT_DWELL, EVENT_LEFT_OUT_STOP, VALUE_ROUNDED
from .timers import half_periods_ms

EVENT: Final = {
    Kind.SPINDLE_CW: "M03",
    Kind.SPINDLE_CCW: "M04",
    Kind.SPINDLE_OFF: "M05",
    Kind.TOOL_CHANGE: "M00",
}


def write_program(toolpath: Toolpath, machine: FlashcutMachine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    dialect = machine.dialect
    check_plain(toolpath, machine)
    feeds, rounded_feeds = feed_units(toolpath, machine)
    lowered_path, split = split_z(toolpath, machine)
    if dialect.slants == "split":
        lowered_path = _split_slants(lowered_path.toolpath, machine).after(lowered_path)
    rules = ArcRules(dialect.decimals, dialect.full_circles, MAX_MM)
    rows = plain_rows(lowered_path.toolpath, rules)
    of_row = lowered_path.row[rows.row]
    _check_reach(toolpath, rows, of_row, dialect)
    blocks = _Blocks(rows, feeds[of_row], dialect)
    has_end = len(toolpath) > 0 and toolpath.kind[-1] == Kind.END
    first = toolpath.place(int(lowered_path.row[rows.first])) if rows.first >= 0 else ""
    findings = [
        *rounded_feeds,
        *split,
        *arc_findings(rows, first),
        *_event_findings(toolpath, dialect),
    ]
    words = _event_words(toolpath)
    other_blocks = [
        (index, words[row], row)
        for index, row in zip(
            blocks.events.tolist(), of_row[rows.kind > Kind.ARC_CCW].tolist(), strict=True
        )
        if row in words
    ]
    other_blocks.append(
        (len(blocks.row), dialect.program_end, len(toolpath) - 1 if has_end else -1)
    )
    refuse_too_long(len(blocks.row) + len(other_blocks), "line")
    texts = texts_of(blocks.words(dialect, feed_decimals(machine)), blanks=True)
    places, ends, their_rows = zip(*other_blocks, strict=True)
    return Program.of_text(
        texts.with_lines(zip(places, ends, strict=True)),
        machine,
        np.insert(of_row[blocks.row], places, their_rows),
        findings,
    )


def _split_slants(toolpath: Toolpath, machine: FlashcutMachine) -> LoweredToolpath:
    """Return the toolpath with long slanted lines in pieces that the machine's timers make
    exactly; PostError when there would be too many. XY and Z must be separate already.

    The timers make the shorter axis too long where it has more steps than the half period P has
    milliseconds (docs/controllers/flashcut.md). A line of n and m ≤ n steps becomes K = ⌈m / (P −
    1)⌉ pieces; piece k ends at the whole steps next to k·n/K and k·m/K from its start, so that the
    controller, which rounds the travel of each piece by itself, has nothing to round."""
    controller = machine.controller
    if not isinstance(controller, FlashcutController):
        return LoweredToolpath(toolpath, np.arange(len(toolpath)))
    q_mm = np.array([machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm])
    begin = toolpath.starts
    travel = toolpath.end[:, :2] - begin[:, :2]
    steps = np.column_stack([to_steps(travel[:, axis], float(q_mm[axis])) for axis in (0, 1)])
    feed = np.where(toolpath.is_feed, toolpath.feed, np.inf)
    moves_one_axis = (steps == 0).any(axis=1)
    half_period = half_periods_ms(feed, float(q_mm.max()), moves_one_axis, controller)
    exact = np.maximum(half_period - 1.0, 1.0)
    slanted = toolpath.kind == Kind.LINE
    pieces = np.where(slanted, np.ceil(np.abs(steps).min(axis=1) / exact), 1.0)
    count = np.maximum(pieces, 1.0)
    if count.sum() > MAX_PARTS:
        raise PostError(
            f"the program would have more than {MAX_PARTS} blocks",
            where=toolpath.place(int(count.argmax())),
            mend="use --set dialect.slants=whole",
        )
    return _cut(toolpath, count.astype(np.int64), steps, q_mm)


def _cut(toolpath: Toolpath, count: Ints, steps: Ints, q_mm: Floats) -> LoweredToolpath:
    """Return the toolpath with each row divided into `count` (N,) pieces; `steps` (N, 2): those of
    the whole row."""
    row = np.repeat(np.arange(len(count)), count)
    part = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    inner = np.flatnonzero(part + 1 < count[row])
    origins = row[inner]
    share = ((part[inner] + 1) / count[origins])[:, None]
    end = toolpath.end[row]
    end[inner, :2] = toolpath.starts[origins, :2] + np.rint(share * steps[origins]) * q_mm
    return LoweredToolpath(toolpath.picked(row, end=end), row)


def _check_reach(
    toolpath: Toolpath, rows: PlainRows, of_row: Ints, dialect: FlashcutDialect
) -> None:
    is_far = (np.abs(rows.end) > MAX_MM * 10**dialect.decimals).any(axis=1)
    refuse(
        toolpath,
        is_far,
        f"a coordinate has more than four digits before the point (±{MAX_MM:g} mm)",
        "check the units",
        rows=of_row,
    )


def _event_words(toolpath: Toolpath) -> dict[int, str]:
    """Return the block of each event that has one, by row."""
    words = {}
    for row in np.flatnonzero(~toolpath.is_motion).tolist():
        kind = Kind(int(toolpath.kind[row]))
        if kind in EVENT:
            words[row] = EVENT[kind]
        elif kind == Kind.MESSAGE and toolpath.texts[int(toolpath.value[row])] == STOP_TEXT:
            words[row] = "M00"
    return words


def _event_findings(toolpath: Toolpath, dialect: FlashcutDialect) -> Iterator[Finding]:
    """Yield findings on events that the dialect cannot write, wholly or in part."""
    yield from left_out(toolpath, [Kind.DWELL], EVENT_LEFT_OUT_DWELL)
    kinds = toolpath.kind
    spindles = np.isin(kinds, [int(Kind.SPINDLE_CW), int(Kind.SPINDLE_CCW)])
    speeds = int((spindles & ~np.isnan(toolpath.value)).sum())
    tools = int((kinds == Kind.TOOL_CHANGE).sum())
    if speeds or tools:
        yield VALUE_ROUNDED(speeds=speeds, tools=tools)
    if not dialect.spindle_stops:
        yield from left_out(toolpath, [Kind.SPINDLE_OFF], EVENT_LEFT_OUT_STOP)


class _Blocks:
    """The P blocks of all moves: `row` (P,) of the table, and masks of the words that each has.
    `events` (E,): the index of the block before which each event of the table stands."""

    def __init__(self, table: PlainRows, feeds: Ints, dialect: FlashcutDialect) -> None:
        """Find the blocks of all moves. `feeds` (M,): the feed of each row of the table in units
        of F."""
        self._table, self._feeds = table, feeds
        begin, end, moves = table.starts, table.end, table.moves
        rapid, arc = table.kind == Kind.RAPID, table.is_arc
        in_xy = (end[:, :2] != begin[:, :2]).any(axis=1)
        moves_both = (end[:, :2] != begin[:, :2]).all(axis=1)
        # The part along X of a rapid of both axes, before that along Y.
        corner = moves & rapid & moves_both & (end[:, 2] >= 0) & (dialect.rapids == "one-axis")
        cuts = np.flatnonzero(moves & ~rapid)
        changes = np.zeros(len(moves), dtype=np.bool_)
        changes[cuts] = np.diff(feeds[cuts], prepend=0) != 0
        # A block in front that sets the feed where its own cannot.
        has_feed_block = changes & ~(in_xy & ~arc) & (dialect.feed_words == "syntax")
        count = moves * (1 + corner.astype(np.int64) + has_feed_block)
        self.row = np.repeat(np.arange(len(moves)), count)
        self.events = (np.cumsum(count) - count)[table.kind > Kind.ARC_CCW]
        last = np.append(self.row[1:] != self.row[:-1], True)[: len(self.row)]
        self._corner = corner[self.row] & ~last
        self._ahead = has_feed_block[self.row] & ~last
        self._arc = arc[self.row] & last
        self._flat = self._corner | self._ahead | (in_xy | arc)[self.row]
        self._feed = self._ahead | ((changes & ~has_feed_block)[self.row] & last)

    def words(self, dialect: FlashcutDialect, decimals: int) -> list[WordColumn]:
        """Return the words of the blocks, one column for each letter; `decimals` of a feed."""
        table, row = self._table, self.row
        decimals_kept = None if dialect.trailing_zeros else 1
        before, end = table.starts[row], table.end[row]
        x = np.where(self._ahead, before[:, 0], end[:, 0])
        y = np.where(self._ahead | self._corner, before[:, 1], end[:, 1])
        z = end[:, 2] * (1 if dialect.z_up == "+" else -1)
        i, j = table.offset[row].T
        columns = [("X", x, self._flat), ("Y", y, self._flat), ("Z", z, ~self._flat)]
        columns += [("I", i, self._arc), ("J", j, self._arc)]
        kind = np.where(self._ahead, int(Kind.LINE), table.kind[row])
        shown = max(1, decimals)
        feed = self._feeds[row] * 10 ** (shown - decimals)
        return [
            WordColumn("G", kind, np.ones(len(row), dtype=np.bool_), digits=2),
            *(
                WordColumn(name, units, is_written, dialect.decimals, decimals_kept)
                for name, units, is_written in columns
            ),
            WordColumn("F", feed, self._feed, shown),
        ]
