"""Writing grbl and linuxcnc: a Toolpath to modal blocks of words.

    rows ──checked──▶ units, arcs repaired ──▶ rows to send ──modal──▶ blocks and comments

Coordinates, feeds and motion words are written when they change; an arc always has X Y I J. The
first move in XY has both coordinates, and so has the first after homing and after a tool change:
the real tool may then stand anywhere. After a change it goes to its height again before it moves
in XY. Comment lines and `%` are lines, but no blocks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from typing import Any, Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Codes, Floats, Ints
from camtool.bounds import refuse_too_long
from camtool.errors import CamtoolError, PostError
from camtool.findings import Finding
from camtool.machine.model import Machine, PathController
from camtool.records import replace
from camtool.simulation.controller import ControllerModel
from camtool.simulation.path import PathModel
from camtool.toolpath.moves import Kind, PathMode, Toolpath, mounted_before, rows_of
from camtool.toolpath.program import Program
from camtool.toolpath.words import WordColumn, texts_of

from .arcs import ArcCounts, RowArcs, arcs_of
from .checks import check, feed_units
from .comments import comments, header
from .cycles import CYCLE, THREAD, Cycle, CycleHole, cycle_blocks, holes_of, rows_kept, threads_of
from .dialect import UNITS, GcodeDialect, Unit, feed_decimals
from .findings import ARC_MENDED, MOVE_COLLAPSED, VALUE_ROUNDED
from .format import NumberStyle, check_length, format_column, format_number, values_of, word_of

VALUE: Final = NumberStyle(3, strip=True)
"""Spindle speeds and dwells are written to a thousandth."""

ARC_LENGTHS: Final = (
    "arc_difference_mm",
    "arc_most_difference_mm",
    "arc_least_radius_mm",
    "arc_most_radius_mm",
    "arc_chord_slack_mm",
)
"""The lengths of a dialect's rule for arcs."""

ROUNDING_PART: Final = 1e-9
"""A value written within this part of itself was not rounded."""

SPINDLE: Final = {Kind.SPINDLE_CW: "M3", Kind.SPINDLE_CCW: "M4"}

SPINDLE_OFF: Final = "M5"
COOLANT_OFF: Final = "M9"

COOLS: Final = (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD)

SWITCHES: Final = {
    Kind.SPINDLE_OFF: SPINDLE_OFF,
    Kind.COOLANT_MIST: "M7",
    Kind.COOLANT_FLOOD: "M8",
    Kind.COOLANT_OFF: COOLANT_OFF,
}

EventWords = Callable[["Event"], Sequence[str]]


class ProgramStyle(Struct, frozen=True, eq=False):
    """A dialect's own part of a program.

    `header`: its first blocks, which say the unit; `event`: the blocks of an event; `message`:
    what a comment for the operator begins with; `mounted`: what the operator is told at a tool
    change, by the toolpath and its row, None where the machine changes tools; `frame`: the line
    around the program that is no block (%), or ""; `path_mode`: the block that asks for a path
    mode, `own_mode`: that of rows that ask for none; `cycles`: holes are written as cycles;
    `change_first`: nothing moves before the first tool is mounted, whose length counts from then.
    `model`: that of its controller, for the times in comments. `axes` and `offsets`: the letters
    of X, Y and Z, "" for one that is not written, and of I and J."""

    dialect: GcodeDialect
    header: tuple[str, ...]
    event: EventWords
    message: str = ""
    mounted: Callable[[Toolpath, int], Sequence[str]] | None = None
    frame: str = ""
    path_mode: Callable[[PathMode], str] | None = None
    own_mode: PathMode | None = None
    cycles: bool = False
    change_first: bool = False
    model: ControllerModel[Any, Any] | None = None
    axes: tuple[str, str, str] = ("X", "Y", "Z")
    offsets: tuple[str, str] = ("I", "J")


def write_modal(toolpath: Toolpath, machine: Machine, style: ProgramStyle) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    check(toolpath, machine)
    unit = UNITS[style.dialect.units]
    feeds, rounded_feeds = feed_units(toolpath, machine, unit)
    seconds = _seconds(toolpath, machine, style)
    toolpath, dialect = in_units(toolpath, style.dialect, unit)
    arcs = arcs_of(toolpath, dialect)
    events = events_of(toolpath, style.event)
    decimals = feed_decimals(machine) + unit.more_decimals
    cycles = list[Cycle]()
    if style.cycles:
        holes, number = (
            holes_of(toolpath),
            NumberStyle(dialect.decimals, strip=dialect.strip_zeros),
        )
        threads = threads_of(toolpath, unit.mm, number)
        feed_words = [f"F{word}" for word in _feed_texts(feeds, holes, decimals)]
        blocks = {**events.blocks, **cycle_blocks(holes, feed_words, number)}
        blocks |= {thread.cut: (thread.block,) for thread in threads}
        events, cycles = replace(events, blocks=blocks), [*holes, *threads]
    unmoved = first_change(toolpath, events) if style.change_first else 0
    rows_sent = sent_rows(
        toolpath, arcs, feeds, events.changes, cycles, unmoved, raises=bool(style.axes[2])
    )
    arc_counts = arcs.counts
    del arcs, feeds
    frame = [style.frame] if style.frame else []
    first_mode, changes = _path_modes(toolpath, rows_sent, style)
    has_end = len(toolpath) > 0 and toolpath.kind[-1] == Kind.END
    order = BlockOrder(rows_sent.is_motion)
    order.add(0, [*style.header, *first_mode, *dialect.start_blocks])
    for index, row in rows_sent.event_rows(events):
        order.add(index, events.blocks[row], row)
    for index, block in changes.items():
        order.add(index, [block])
    footer = _footer(toolpath, events, dialect)
    order.add(len(rows_sent.row), footer[:-1])
    order.add(len(rows_sent.row), footer[-1:], len(toolpath) - 1 if has_end else -1)
    of_row = order.rows(rows_sent.row)
    tell = style.mounted
    mounted = {} if tell is None else {row: tell(toolpath, row) for row in events.changes}
    remarks = comments(toolpath, of_row, dialect, style.message, mounted, seconds)
    head = [*frame, *header(toolpath, machine, dialect, style.axes)]
    refuse_too_long(len(head) + len(of_row) + len(remarks[0]) + len(frame), "line")
    data = b"".join(
        [
            *(f"{line}\n".encode("ascii") for line in head),
            order.text(
                motion_words(rows_sent, dialect, decimals, style, _pitches(toolpath)),
                *remarks,
                numbers=LineNumbers() if dialect.block_numbers else None,
            ),
            *(f"{line}\n".encode("ascii") for line in frame),
        ]
    )
    check_length(data, dialect.line_chars, "line", "use fewer decimals, or no block numbers")
    return Program.of_text(
        data,
        machine,
        of_row,
        (
            *rounded_feeds,
            *arc_findings(toolpath, arc_counts, rows_sent.dropped),
            *rounding_findings(toolpath, events.rounded),
        ),
    )


def first_change(toolpath: Toolpath, events: Events) -> int:
    """Return the row of the first tool change if only rapids straight up come before it, else 0.
    Behind the change the tool is sent to its height anyway."""
    row = events.changes[0] if events.changes else 0
    motion = toolpath.is_motion[:row]
    is_upward = (toolpath.kind[:row] == Kind.RAPID) & (toolpath.end[:row, 2] >= toolpath.start[2])
    is_upward &= (toolpath.end[:row, :2] == toolpath.start[:2]).all(axis=1)
    return row if bool((is_upward | ~motion).all()) else 0


def _seconds(toolpath: Toolpath, machine: Machine, style: ProgramStyle) -> Floats | None:
    """Return (N,) seconds that the controller takes for each row; None where no comment shows
    times, no model is known, or the model cannot follow the toolpath (verification reports
    that)."""
    exact = isinstance(machine.controller, PathController)
    model: ControllerModel[Any, Any] | None = PathModel() if exact else style.model
    if model is None or style.dialect.comments in ("none", "header"):
        return None
    with suppress(CamtoolError):
        return model.seconds(toolpath, machine)
    return None


def _feed_texts(feeds: Ints, holes: Sequence[CycleHole], decimals: int) -> list[str]:
    """Return the number of the F word of each hole."""
    cut = feeds[[hole.cut for hole in holes]]
    return format_column(values_of(cut, decimals), NumberStyle(decimals, strip=True))


def in_units(
    toolpath: Toolpath, dialect: GcodeDialect, unit: Unit
) -> tuple[Toolpath, GcodeDialect]:
    """Return the toolpath with its places, and the dialect with its lengths and decimals,
    converted to a unit."""
    if unit.mm == 1.0:
        return toolpath, dialect
    places = {name: getattr(toolpath, name) / unit.mm for name in ("end", "centre", "start")}
    lengths = {name: getattr(dialect, name) / unit.mm for name in ARC_LENGTHS}
    decimals = dialect.decimals + unit.more_decimals
    return (replace(toolpath, **places), replace(dialect, decimals=decimals, **lengths))


def _path_modes(
    toolpath: Toolpath, rows_sent: Sent, style: ProgramStyle
) -> tuple[tuple[str, ...], dict[int, str]]:
    """Return the block that sets the first path mode, and the blocks that change it, by the index
    of the sent row that each stands before; nothing for dialects without path modes."""
    if style.path_mode is None or style.own_mode is None:
        return (), {}
    written = [style.path_mode(mode) for mode in (*toolpath.modes, style.own_mode)]
    moving = np.flatnonzero(rows_sent.is_motion)
    modes = toolpath.mode[rows_sent.row[moving]]
    if len(modes) == 0:
        return (written[-1],), {}
    turns = np.flatnonzero(np.diff(modes)) + 1
    return (written[modes[0]],), {int(moving[k]): written[modes[k]] for k in turns.tolist()}


class BlockOrder:
    """The order of a program's blocks: those of motions, which are written by columns, and all
    others between them."""

    def __init__(self, is_motion: Bools) -> None:
        """Begin with M rows that are sent. `is_motion` (M,): those that are motions, written by
        columns; the others have no text of their own."""
        self._before = np.concatenate([[0], np.cumsum(is_motion)])
        self._is_motion = is_motion
        self._others: list[tuple[int, str, int]] = []

    def add(self, index: int, blocks: Sequence[str], row: int = -1) -> None:
        """Add blocks in front of the sent row `index`; `row` is their row of the toolpath."""
        self._others += [(index, block, row) for block in blocks]

    def _sorted(self) -> tuple[list[tuple[int, str, int]], Ints]:
        """Return the added blocks in order, and how many motions stand in front of each."""
        other_blocks = sorted(self._others, key=lambda other: other[0])
        return other_blocks, self._before[[index for index, _, _ in other_blocks]]

    def rows(self, row: Ints) -> Ints:
        """Return (B,) the toolpath row of each block; `row` (M,): the toolpath row of each sent
        row."""
        other_blocks, before = self._sorted()
        return np.insert(row[self._is_motion], before, [one for _, _, one in other_blocks])

    def text(
        self,
        columns: Sequence[WordColumn],
        commented: Ints,
        comment_at: Callable[[int], str],
        *,
        numbers: LineNumbers | None = None,
        blanks: bool = True,
    ) -> bytes:
        """Return the bytes of all blocks; motions are written by `columns` of M rows. C comment
        lines stand between them, the k-th before block commented[k] (from 0, ascending); an empty
        text is left out."""
        other_blocks, before = self._sorted()
        indices = np.array([indices for indices, _, _ in other_blocks], dtype=np.int64)
        number = before + np.arange(len(other_blocks))
        labels = [""] * len(number)
        if numbers is not None:
            every = np.arange(len(self._is_motion))
            index = self._before[1:] - 1 + np.searchsorted(indices, every, side="right")
            columns = [numbers.column(index, self._is_motion), *columns]
            labels = [numbers.label(k, blanks=blanks) for k in number.tolist()]
        # In front of a row: other blocks, each after its comments; then comments of the motion.
        other, moves = np.searchsorted(number, commented), ~np.isin(commented, number)
        motion = (commented - other)[moves]
        place, rank = np.empty(len(commented), dtype=np.int64), 2 * other
        place[moves] = np.searchsorted(self._before, motion, side="right") - 1
        place[~moves] = indices[other[~moves]]
        rank[moves] = 2 * len(other_blocks)
        rows = np.append(indices, place)
        order = np.lexsort((np.append(2 * np.arange(len(other_blocks)) + 1, rank), rows))

        def lines() -> Iterator[tuple[int, str]]:
            for k, row in zip(order.tolist(), rows[order].tolist(), strict=True):
                if k < len(other_blocks):
                    yield row, f"{labels[k]}{other_blocks[k][1]}"
                elif remark := comment_at(k - len(other_blocks)):
                    yield row, remark

        return texts_of(columns, blanks=blanks).with_lines(lines())


class LineNumbers(Struct, frozen=True):
    """Numbers of blocks: N`first`, by `step`, with at least `digits` digits, up to `highest`
    (None: without limit), after which they start again."""

    first: int = 1
    step: int = 1
    digits: int = 1
    highest: int | None = None

    def of(self, index: Ints) -> Ints:
        """Return the block numbers (K,) of the blocks `index` (K,), counted from 0."""
        if self.highest is not None:
            index = index % ((self.highest - self.first) // self.step + 1)
        return self.first + self.step * index

    def column(self, index: Ints, written: Bools) -> WordColumn:
        """Return the N words of the blocks `index`."""
        return WordColumn("N", self.of(index), written, digits=self.digits)

    def label(self, index: int, *, blanks: bool) -> str:
        """Return the N word of one block, with a blank behind it if there are `blanks` between
        words."""
        number = int(self.of(np.array([index]))[0])
        return f"N{number:0{self.digits}}{' ' if blanks else ''}"


def _footer(toolpath: Toolpath, events: Events, dialect: GcodeDialect) -> list[str]:
    """Return the last blocks of a program: retract out of the material (from below Z 0) to the
    highest Z, spindle off, end; each only where the program has not done it."""
    heights = np.append(toolpath.end[:, 2], toolpath.start[2])
    last = float(toolpath.end[-1, 2]) if len(toolpath) else 0.0
    retract = dialect.retract and last < 0.0
    style = NumberStyle(dialect.decimals, strip=dialect.strip_zeros)
    return [
        *([f"G0 Z{format_number(float(heights.max()), style)}"] if retract else []),
        *([SPINDLE_OFF] if events.spindle_on else []),
        *dialect.end_blocks,
        dialect.program_end,
    ]


def arc_findings(toolpath: Toolpath, counts: ArcCounts, dropped: int) -> Iterator[Finding]:
    if mended := counts.recentred + counts.split + counts.lines:
        yield ARC_MENDED(
            where=toolpath.place(counts.first),
            measured=mended,
            recentred=counts.recentred,
            split=counts.split,
            lines=counts.lines,
        )
    if collapsed := dropped + counts.flat:
        yield MOVE_COLLAPSED(measured=collapsed, dropped=dropped, flat=counts.flat)


def rounding_findings(toolpath: Toolpath, rows: tuple[int, ...]) -> Iterator[Finding]:
    if rows:
        yield VALUE_ROUNDED(where=toolpath.place(rows[0]), count=len(rows))


# The rows that are sent, and the modal text of each, by whole columns.


class Sent(Struct, frozen=True, eq=False):
    """The rows to send, events among them: kind (M,), end (M, 3) and offset (M, 2) in units, feed
    (M,) in units of the F word, row (M,) of the toolpath. `written` (M, 3): the coordinates that
    are written; `forget` (M,): true after homing or a tool change since the last motion, so that
    everything is written again; `dropped`: the number of moves that were too small."""

    kind: Codes
    end: Ints
    offset: Ints
    feed: Ints
    row: Ints
    written: Bools
    forget: Bools
    dropped: int

    @property
    def is_motion(self) -> Bools:
        """Mask (M,) of the motions."""
        return np.asarray(self.kind <= Kind.ARC_CCW)

    def event_rows(self, events: Events) -> Iterator[tuple[int, int]]:
        """Yield the position of each event that has a block, and its row of the toolpath."""
        for index in np.flatnonzero(~self.is_motion).tolist():
            row = int(self.row[index])
            if row in events.blocks:
                yield index, row


def sent_rows(
    toolpath: Toolpath,
    arcs: RowArcs,
    feeds: Ints,
    changes: Sequence[int] = (),
    cycles: Sequence[Cycle] = (),
    unmoved: int = 0,
    *,
    raises: bool = True,
) -> Sent:
    """Return the rows that are sent: with pieces in place of repaired arcs, without moves that
    move nothing, and without motions among the first `unmoved` rows. `changes`: the rows of tool
    changes that have a block; each of `cycles` is one block. `raises`: after a tool change the
    tool is sent to its height once more."""
    origins, kind, end, offset = np.arange(len(toolpath)), arcs.kind, arcs.end, arcs.offset
    if arcs.pieces:
        piece_counts = np.ones(len(toolpath), dtype=np.int64)
        for row, pieces in arcs.pieces.items():
            piece_counts[row] = len(pieces)
        origins = np.repeat(origins, piece_counts)
        kind, end, offset = kind[origins], end[origins], offset[origins]
        first = np.cumsum(piece_counts) - piece_counts
        for row, pieces in arcs.pieces.items():
            sunk = int(arcs.end[row - 1, 2]) if row else 0
            rise = int(arcs.end[row, 2]) - sunk
            for index, piece in enumerate(pieces, int(first[row])):
                height = sunk + round(rise * piece.share)
                kind[index], end[index], offset[index] = (
                    piece.kind,
                    (*piece.end, height),
                    piece.offset,
                )
    if cycles:
        rows = np.flatnonzero(np.isin(origins, rows_kept(len(toolpath), cycles)))
        origins, kind, end, offset = origins[rows], kind[rows], end[rows], offset[rows]
        begins = np.searchsorted(origins, [cycle.cut for cycle in cycles])
        kind[begins], end[begins] = CYCLE, arcs.end[[cycle.last for cycle in cycles]]
    raised = np.zeros(len(origins), dtype=np.bool_)
    is_changed = (kind == Kind.TOOL_CHANGE) & np.isin(origins, changes)
    if raises and (raised_rows := _raised_again(kind, end, is_changed)):
        before = np.array(raised_rows) - 1
        origins, kind = (
            np.insert(origins, raised_rows, origins[before]),
            np.insert(kind, raised_rows, kind[before]),
        )
        end = np.insert(end, raised_rows, end[before], axis=0)
        offset = np.insert(offset, raised_rows, 0, axis=0)
        raised, is_changed = (
            np.insert(raised, raised_rows, True),
            np.insert(is_changed, raised_rows, False),
        )
        kind[raised] = Kind.RAPID
    motion = kind <= Kind.ARC_CCW
    is_arc = motion & (kind >= Kind.ARC_CW)
    is_late = motion & (origins < unmoved)
    written = _differ(end, np.zeros(3))
    written[~motion | is_late] = False
    written[raised, 2] = True
    elsewhere = is_changed | (kind == CYCLE)
    home_xy, home_z = elsewhere | (kind == Kind.HOME_XY), elsewhere | (kind == Kind.HOME_Z)
    flat = written[:, :2].any(axis=1) | is_arc
    # A rapid to the present X and Y is kept if X and Y have never been written before.
    is_still = (kind == Kind.RAPID) & ~written.any(axis=1)
    is_still &= _not_yet_written(flat, home_xy) & ~_not_yet_written(written[:, 2], home_z)
    is_still &= _not_yet_written(flat | is_still, home_xy)
    fixed = is_arc | is_still | (flat & _not_yet_written(flat | is_still, home_xy))
    written[fixed, :2] = True
    is_kept = ~motion | (written.any(axis=1) & ~is_late)
    dropped = origins[~is_kept & ~is_late]
    has_moved = (toolpath.end[dropped] != toolpath.starts_of(dropped)).any(axis=1)
    rows = np.flatnonzero(is_kept)
    origins = origins[rows]
    return Sent(
        kind[rows],
        end[rows],
        rows_of(offset, rows),
        feeds[origins],
        origins,
        written[rows],
        _first_after((home_xy | home_z)[rows], motion[rows]),
        int(has_moved.sum()) + arcs.counts.dropped,
    )


def _raised_again(kind: Codes, end: Ints, is_changed: Bools) -> list[int]:
    """Return the rows before which the tool must be sent to its height once more: those after a
    tool change between moves, unless the next move is a rapid in Z anyway."""
    motions = np.flatnonzero(kind <= Kind.ARC_CCW)
    raised = []
    for index in np.flatnonzero(is_changed).tolist():
        k = int(np.searchsorted(motions, index))
        if 0 < k < len(motions):
            goes = end[motions[k]] != end[index]
            if kind[motions[k]] != Kind.RAPID or goes[:2].any() or not goes[2]:
                raised.append(index + 1)
    return raised


def _differ(ends: Ints | Floats, start: Floats) -> Bools:
    """Return a mask (M, 3), true where a coordinate of `ends` (M, 3) differs from that of the row
    before; the first row is compared with `start`."""
    differ = np.empty(ends.shape, dtype=np.bool_)
    differ[:1], differ[1:] = ends[:1] != start, ends[1:] != ends[:-1]
    return differ


def _not_yet_written(written: Bools, home: Bools) -> Bools:
    """Return a mask (M,), true for rows before which nothing was `written` since the start, or
    since the last homing."""
    is_first = np.ones(len(written), dtype=np.bool_)
    for begin, end in pairwise([0, *np.flatnonzero(home).tolist(), len(written)]):
        if written[begin:end].any():
            is_first[begin + int(written[begin:end].argmax()) + 1 : end] = False
    return is_first


def _first_after(home: Bools, motion: Bools) -> Bools:
    """Return a mask (M,), true for the first motion after homing; after several homings in a row,
    for the first motion after the last."""
    is_first = np.zeros(len(home), dtype=np.bool_)
    homes = np.flatnonzero(home)
    if len(homes):
        moving = np.flatnonzero(motion)
        next_moves = np.searchsorted(moving, homes)
        is_first[moving[next_moves[next_moves < len(moving)]]] = True
    return is_first


G33: Final = 33
"""The motion that follows the spindle."""


def _pitches(toolpath: Toolpath) -> Floats:
    """Return (N,) the feed per turn of the spindle in rows that follow the spindle, 0 in all
    others."""
    pitch = np.zeros(len(toolpath))
    operations = toolpath.operations
    if operations is not None:
        begins = operations.begin.tolist()
        for note, low, high in zip(
            operations.notes, begins, [*begins[1:], len(toolpath)], strict=True
        ):
            pitch[low:high] = note.pitch_mm or 0.0
    pitch[toolpath.kind != Kind.LINE] = 0.0
    return pitch


def motion_words(
    rows_sent: Sent,
    dialect: GcodeDialect,
    feed_decimals: int,
    style: ProgramStyle | None = None,
    pitch: Floats | None = None,
) -> list[WordColumn]:
    """Return the words of all motions among the rows, one column for each letter, with the letters
    of `style` where one is given; `pitch` (N,): the feed per turn of toolpath rows that follow the
    spindle."""
    motion = rows_sent.is_motion
    rows = np.flatnonzero(motion)
    number = NumberStyle(dialect.decimals, strip=dialect.strip_zeros)
    turns = np.zeros(len(motion), dtype=bool)
    codes, axes, offsets = rows_sent.kind, ("X", "Y", "Z"), ("I", "J")
    if style is not None:
        axes, offsets = style.axes, style.offsets
    follows = np.zeros(len(motion), dtype=np.bool_)
    units = np.zeros(len(motion), dtype=np.int64)
    if pitch is not None and pitch.any():
        mm = UNITS[dialect.units].mm
        units = np.rint(pitch[rows_sent.row] / mm * 10**THREAD.decimals).astype(np.int64)
        follows = motion & (units > 0)
        codes = np.where(follows, G33, codes)
    turns[rows] = np.diff(codes[rows], prepend=-1) != 0
    is_arc = motion & (rows_sent.kind >= Kind.ARC_CW)
    fed = (motion & (rows_sent.kind >= Kind.LINE) & ~follows) | (rows_sent.kind == CYCLE)
    feed = motion & changes_of(rows_sent.feed, fed)
    return [
        WordColumn("G", codes, turns | (rows_sent.forget & motion)),
        *(
            word_of(axis, rows_sent.end[:, index], rows_sent.written[:, index], number)
            for index, axis in enumerate(axes)
            if axis
        ),
        *(
            word_of(axis, rows_sent.offset[:, index], is_arc, number)
            for index, axis in enumerate(offsets)
        ),
        *([word_of("K", units, follows, THREAD)] if follows.any() else []),
        word_of("F", rows_sent.feed, feed, NumberStyle(feed_decimals, strip=True)),
    ]


def changes_of(values: Ints, counts: Bools) -> Bools:
    """Return a mask (M,), true where a row that counts has another value than the last counting
    row before it."""
    rows = np.flatnonzero(counts)
    is_changed = np.zeros(len(values), dtype=bool)
    is_changed[rows] = np.diff(values[rows], prepend=-1) != 0
    return is_changed


# Events, as the blocks that grbl and linuxcnc both know.


class Event(Struct, frozen=True):
    """A row that is not a motion; `where` names it in errors. `mounted_before`: true for a tool
    change before the first move at a feed. `spindle_on`, `cools`: what the program has switched on
    so far."""

    kind: Kind
    value: float
    where: str
    mounted_before: bool = False
    spindle_on: bool = False
    cools: bool = False

    def refuse(self, message: str, mend: str = "") -> PostError:
        """Return the error for an event that cannot be sent."""
        return PostError(message, where=self.where, mend=mend)


class Events(Struct, frozen=True):
    """Blocks of events. `blocks`: those of each row that has some; `rounded`: rows whose value was
    rounded; `spindle_on`: at the end of the program; `changes`: the rows of tool changes that have
    blocks."""

    blocks: Mapping[int, Sequence[str]]
    rounded: tuple[int, ...]
    spindle_on: bool
    changes: tuple[int, ...]


def events_of(toolpath: Toolpath, words: EventWords) -> Events:
    """Return the blocks of all events except END and messages."""
    blocks: dict[int, Sequence[str]] = {}
    rounded: list[int] = []
    spindle_on = cools = False
    mounted = mounted_before(toolpath)
    for row in (~toolpath.is_motion).nonzero()[0].tolist():
        event = Event(
            Kind(int(toolpath.kind[row])),
            float(toolpath.value[row]),
            toolpath.place(row),
            bool(mounted[row]),
            spindle_on,
            cools,
        )
        if event.kind == Kind.END:
            if row != len(toolpath) - 1:
                raise event.refuse("moves follow the end of the program")
        elif event.kind == Kind.SET_ZERO:
            if toolpath.end[row].any():
                raise event.refuse(
                    "part zero can only be set at part zero", "set it first, before any move"
                )
        elif event.kind != Kind.MESSAGE:
            if block := words(event):
                blocks[row] = block
            spindle_on = event.kind in SPINDLE or (
                spindle_on and event.kind != Kind.SPINDLE_OFF and SPINDLE_OFF not in block
            )
            cools = event.kind in COOLS or (
                cools and event.kind != Kind.COOLANT_OFF and COOLANT_OFF not in block
            )
            if _is_rounded(event):
                rounded.append(row)
    changes = tuple(row for row in blocks if toolpath.kind[row] == Kind.TOOL_CHANGE)
    return Events(blocks, tuple(rounded), spindle_on, changes)


def common_words(event: Event) -> tuple[str, ...]:
    """Return the block of a dwell, spindle, coolant or homing event; PostError for values that no
    block can express.

    Homing is a rapid in machine coordinates, `G53 G0`: G28 would go where the operator's memory of
    it points."""
    if event.kind in SWITCHES:
        return (SWITCHES[event.kind],)
    if event.kind == Kind.HOME_XY:
        return ("G53 G0 X0 Y0",)
    if event.kind == Kind.HOME_Z:
        return ("G53 G0 Z0",)
    if event.kind not in (*SPINDLE, Kind.DWELL):
        raise event.refuse(f"a {event.kind.name} has no block in this dialect")
    if event.kind in SPINDLE and math.isnan(event.value):
        return (SPINDLE[event.kind],)  # its speed is not known
    if not (math.isfinite(event.value) and event.value >= 0.0):
        raise event.refuse(f"a {event.kind.name} without a value of 0 or more")
    written = format_number(event.value, VALUE)
    if event.kind == Kind.DWELL:
        return (f"G4 P{written}",)
    return (f"{SPINDLE[event.kind]} S{written}",)


def tool_number(event: Event) -> int:
    """Return the tool number of a change; PostError when it is not an integer of at least 0."""
    if not (event.value >= 0.0 and event.value == math.floor(event.value)):
        raise event.refuse(f"{event.value:g} is no tool number", "tools are 0, 1, 2 …")
    return int(event.value)


def _is_rounded(event: Event) -> bool:
    if math.isnan(event.value):
        return False
    written = float(values_of(round(event.value * 10.0**VALUE.decimals), VALUE.decimals))  # type: ignore[arg-type]
    return abs(written - event.value) > ROUNDING_PART * abs(event.value)
