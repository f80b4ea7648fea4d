"""Writing pic-mmh: a Toolpath to the blocks that this controller decodes.

    rows ──checked──▶ units and steps ──landings──▶ points ──those that move──▶ blocks

Everything that can be refused by its numbers alone is refused before the first block is made
(`numbers.py`). A row begins at the step where the row before it ended, whatever blocks that took;
so every arc is planned from there by itself (`land` in `steps.pyx`), and ends where the next row
begins. A point is where one block may bring the tool: a block is sent only when it moves the
controller's own step position."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final, NoReturn

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.bounds import refuse_too_long
from camtool.errors import PostError
from camtool.findings import Finding
from camtool.toolpath.lower import LoweredToolpath, arcs_to_lines, helices_to_steps, slope_step_mm
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.program import Program
from camtool.toolpath.words import WordColumn, line_lengths, texts_of

from .dialect import PicMmhMachine
from .findings import (
    ARC_MENDED,
    ARC_MENDED_FLAT,
    BLOCK_TOO_LONG,
    BLOCK_TOO_LONG_PERHAPS,
    MOVE_COLLAPSED,
    MOVE_SPLIT,
    VALUE_ROUNDED,
)
from .numbers import UnitGrid, check_motion, event_words, far_arcs, numbers_of
from .steps import CLOCKWISE, ITERATION, land

BUFFER_CHARS: Final = 35
"""Characters of the thesis's buffer (L1740-1742), which cannot have taken its own sample block."""

LINE_SAGITTA: Final = 1.0
"""A line that replaces a piece of arc may deviate from it by this many resolutions (the coarser of
step and unit); it bounds how far before its end an arc may be left for its closing line."""

_TURN: Final = 2.0 * math.pi


def write_program(toolpath: Toolpath, machine: PicMmhMachine) -> Program:
    """Return the program of a toolpath; PostError names the move that cannot be written or
    done."""
    writer = _Writer(toolpath, machine)
    data, rows = writer.blocks()
    return Program.of_text(data, machine, rows, writer.findings(data))


def _refuse_chords(place: str) -> NoReturn:
    """Raise PostError for an arc one of whose chords ends where no coordinate can be written."""
    raise PostError(
        "an arc that has to be written as lines leaves the five digits of a coordinate",
        where=place,
        mend="keep every coordinate within ±99.999 mm",
    )


class _Writer:
    """Writer of one toolpath, lowered to N rows; it counts the changes on the way to blocks."""

    def __init__(self, toolpath: Toolpath, machine: PicMmhMachine) -> None:
        dialect = machine.dialect
        self._machine = machine
        self._dialect = dialect
        self._wanted = toolpath
        self._changes = WriterChanges()
        check_motion(toolpath, machine)
        # Refuse by the numbers of the given rows, before they are lowered.
        numbers = numbers_of(toolpath, machine, dialect)
        self._feed_finding, grid = numbers.feed_finding, numbers.grids[0]
        del numbers  # free it: it is as large as the toolpath
        lowered_path = self._lower(grid)
        self._toolpath, self._row = lowered_path.toolpath, lowered_path.row
        self._numbers = numbers_of(lowered_path.toolpath, machine, dialect)
        self._split = np.bincount(lowered_path.row, minlength=len(toolpath)) > 1
        kind = lowered_path.toolpath.kind
        # A program read back begins with the SET_ZERO of its own header.
        self._first = 1 if len(kind) and kind[0] == Kind.SET_ZERO else 0
        self._ended = len(kind) > 0 and kind[-1] == Kind.END
        steps = self._numbers.end_steps
        self._before = np.concatenate([np.zeros((1, 3), dtype=np.int64), steps])[: len(steps)]
        self._before[: self._first + 1] = 0

    def _lower(self, grid: UnitGrid) -> LoweredToolpath:
        """Lower arcs whose centre cannot be written to lines, and slopes to steps; both are
        counted."""
        toolpath, changes = self._wanted, self._changes
        is_far = far_arcs(toolpath, self._machine, self._dialect)
        changes.far = int(is_far.sum())
        changes.far_place = toolpath.place(int(is_far.argmax())) if changes.far else ""
        straight = arcs_to_lines(toolpath, is_far, LINE_SAGITTA * grid.resolution_mm)
        changes.split_step_mm = slope_step_mm(self._machine)
        stepped = helices_to_steps(straight.toolpath, changes.split_step_mm)
        steps = np.bincount(stepped.row, minlength=len(straight.toolpath)) > 1
        slopes = distinct(straight.row[steps & straight.toolpath.is_feed])
        changes.split = len(slopes)
        changes.split_place = toolpath.place(int(slopes[0])) if changes.split else ""
        lowered_path = stepped.after(straight)
        is_outside = ~grid.fits(lowered_path.toolpath.end[:, :2]).all(axis=1)
        if is_outside.any():
            _refuse_chords(toolpath.place(int(lowered_path.row[is_outside.argmax()])))
        return lowered_path

    @property
    def _grid(self) -> UnitGrid:
        """Grid of X and Y, which are alike where there are arcs or lines that replace arcs."""
        return self._numbers.grids[0]

    def blocks(self) -> tuple[bytes, Ints]:
        """Return the bytes of all blocks, and for each the row of the wanted toolpath, −1 for
        blocks that the dialect adds."""
        points = self._points()
        events = self._events(points)
        is_sent = points.is_sent
        refuse_too_long(int(np.count_nonzero(is_sent)) + len(events) + 3, "block")  # G54 G90 M30
        texts = texts_of(self._words(points), end=";\n")
        rows = self._row[points.row[is_sent]]
        starts = [(0, "G54;", self._row[0] if self._first else -1), (0, "G90;", -1)]
        sent_before = np.concatenate([[0], np.cumsum(is_sent)])
        between_blocks = [
            (int(np.searchsorted(points.row, row)), block, int(self._row[row]))
            for row, block in events
        ]
        ending = (len(points.row), "M30;", int(self._row[-1]) if self._ended else -1)
        other_blocks = [*starts, *between_blocks, ending]
        data = texts.with_lines((index, block) for index, block, _ in other_blocks)
        places = [int(sent_before[index]) for index, _, _ in other_blocks]
        return data, np.insert(rows, places, [row for _, _, row in other_blocks])

    def findings(self, data: bytes) -> Iterator[Finding]:
        """Yield one finding for each kind of change that the writer made."""
        if self._feed_finding:
            yield self._feed_finding
        yield from self._changes.findings(self._grid.step_mm * 1000.0)
        yield from too_long(data, self._dialect.buffer_chars)

    def _place(self, row: int) -> str:
        """Return the text that names, in messages, the given toolpath's row from which a row of
        the lowered one came."""
        return self._wanted.place(int(self._row[row]))

    def _words(self, points: Points) -> list[WordColumn]:
        """Return the words of all points, empty where nothing is sent."""
        row, is_sent = points.row, points.is_sent
        flat = is_sent & ~points.is_deep
        arc = flat & points.is_arc
        annex = self._dialect.form == "annex"
        decimals = 0 if annex else 2

        def coordinate(letter: str, units: Ints, written: Bools) -> WordColumn:
            return WordColumn(letter, units, written, decimals=decimals, digits=5, plus=annex)

        kind = self._toolpath.kind[row]
        code = np.where(arc, kind, np.where(kind == Kind.RAPID, 0, 1))
        centre = self._numbers.centre_units[row]
        feed = self._numbers.feed_units[row]
        return [
            WordColumn("G", code, is_sent, digits=2),
            coordinate("X", points.units[:, 0], flat),
            coordinate("Y", points.units[:, 1], flat),
            coordinate("Z", self._numbers.end_units[row, 2], is_sent & points.is_deep),
            coordinate("I", centre[:, 0], arc),
            coordinate("J", centre[:, 1], arc),
            WordColumn("F", feed, is_sent & (feed > 0), digits=2),
        ]

    # Where blocks may bring the tool.

    def _points(self) -> Points:
        """Return all points, and which of them are sent. Numbers of one step may differ by less
        than a step, and so may the number that an arc starts from, which can make its landing
        invalid: repeat until no more landings become invalid."""
        arcs = self._arcs()
        is_refused = np.zeros(len(arcs.row), dtype=np.bool_)
        while True:
            points = self._points_of(arcs, is_refused)
            newly_refused = self._refused_landings(arcs, points)
            if (newly_refused == is_refused).all():
                break
            is_refused = newly_refused
        self._check_ends(arcs, points)
        self._count(arcs, points)
        return points

    def _arcs(self) -> StepArcs:
        """Return the arcs as this controller executes them from where it stands, and their
        landings."""
        numbers, path = self._numbers, self._toolpath
        is_deep = numbers.end_steps[:, 2] != self._before[:, 2]
        rows = np.flatnonzero(path.is_arc & ~is_deep)
        centre = numbers.centre_steps[rows]
        start = self._before[rows, :2] - centre
        end = numbers.end_steps[rows, :2] - centre
        sweep = path.sweeps()[rows]
        # As an arc it would become a full circle.
        is_empty = (start == end).all(axis=1) & (np.abs(sweep) <= math.pi)
        clockwise = path.kind[rows] == Kind.ARC_CW
        table = np.column_stack([start, end, centre, clockwise])[~is_empty].astype(np.int64)
        grid = self._grid
        landing = land(
            table,
            np.abs(sweep[~is_empty]),
            grid.units_per_mm * grid.step_mm,
            grid.most_units,
            LINE_SAGITTA * grid.resolution_mm / grid.step_mm,
        )
        return StepArcs(rows[~is_empty], table, sweep[~is_empty], landing, rows[is_empty])

    def _points_of(self, arcs: StepArcs, is_refused: Bools) -> Points:
        """Return all points if the landings `is_refused` (J,) are not used."""
        numbers, path, grid = self._numbers, self._toolpath, self._grid
        landed = arcs.landed & ~is_refused
        chords = self._chords(arcs, landed)
        count = np.ones(len(path), dtype=np.int64)
        count[arcs.nothing] = 0
        count[arcs.row] = landed + chords.count
        row = np.repeat(np.arange(len(path)), count)
        first = np.cumsum(count) - count
        units = numbers.end_units[row, :2]
        inner = first[arcs.row[chords.arc]] + landed[chords.arc] + chords.part
        fits = grid.fits(chords.end).all(axis=1)
        units[inner[fits]] = grid.units(chords.end[fits])
        at_arc = first[arcs.row[landed]]
        is_arc = np.zeros(len(row), dtype=np.bool_)
        is_arc[at_arc] = True
        units[at_arc] = np.where(
            arcs.at_end[landed, None],
            numbers.end_units[arcs.row[landed], :2],
            grid.nearest_units(arcs.stop[landed]),
        )
        steps = grid.steps(units)
        motion = path.is_motion[row]
        home = path.kind[row] == Kind.HOME_XY
        steps[home], units[home] = self._home((0, 1))
        steps[row < self._first] = 0
        is_deep = motion & (numbers.end_steps[row, 2] != self._before[row, 2])
        earlier = np.concatenate([np.zeros((1, 2), dtype=np.int64), steps])[: len(steps)]
        flat = motion & ~is_deep
        is_sent = is_deep | is_arc | (flat & (steps != earlier).any(axis=1))
        outside = (row < self._first) | (path.kind[row] == Kind.END)
        # The very numbers of the start, so that it reads as a full circle.
        returns = np.zeros(len(row), dtype=np.bool_)
        returns[at_arc] = arcs.at_start[landed]
        new = home | (is_sent & ~is_deep & ~returns)
        latest = np.maximum.accumulate(np.where(new & ~outside, np.arange(1, len(row) + 1), 0))
        known_units = np.concatenate([np.zeros((1, 2), dtype=np.int64), units])
        units = known_units[latest]
        misfit = arcs.row[chords.arc[~fits]]
        return Points(
            row=row,
            units=units,
            before=np.concatenate([known_units[:1], units])[first[arcs.row]],
            is_sent=is_sent & ~outside,
            is_deep=is_deep,
            is_arc=is_arc,
            misfit=int(misfit[0]) if len(misfit) else len(path),
        )

    def _refused_landings(self, arcs: StepArcs, points: Points) -> Bools:
        """Return a mask (J,), true for landings with which a reader would take the block for
        another arc: short arcs can turn into almost full circles by the rounding of their
        numbers."""
        numbers, grid = self._numbers, self._grid
        units = np.where(
            arcs.at_end[:, None], numbers.end_units[arcs.row, :2], grid.nearest_units(arcs.stop)
        )
        units = np.where(arcs.at_start[:, None], points.before, units)
        centre = numbers.centre_units[arcs.row]
        read = turned_rad(points.before - centre, units - centre, arcs.clockwise)
        return np.asarray(arcs.landed & (full_turns(read, arcs.expected_rad) != 0.0))

    def _chords(self, arcs: StepArcs, landed: Bools) -> Chords:
        """Return chords along the rest of each arc from its landing on, or along the whole arc
        where it has none."""
        path, grid = self._toolpath, self._grid
        centre = path.centre[arcs.row]
        places = np.where(landed[:, None], arcs.stop * grid.step_mm, path.starts[arcs.row, :2])
        turn = turned_rad(path.starts[arcs.row, :2] - centre, places - centre, arcs.clockwise)
        turn += _TURN * full_turns(turn, arcs.expected_rad)
        remaining = np.maximum(np.abs(arcs.sweep_rad) - turn, 0.0)
        sweep = np.where(landed, np.where(arcs.clockwise, -remaining, remaining), arcs.sweep_rad)
        ends = chord_ends(places, centre, sweep, LINE_SAGITTA * grid.resolution_mm)
        return ends.without(landed & arcs.at_end)

    def _check_ends(self, arcs: StepArcs, points: Points) -> None:
        """Raise PostError, as an internal fault, where the written numbers of an arc do not mean
        its landing to the controller."""
        rows = np.flatnonzero(points.is_arc & points.is_sent)
        arc_rows = np.searchsorted(arcs.row, points.row[rows])
        is_wrong = (self._grid.steps(points.units[rows]) != arcs.stop[arc_rows]).any(axis=1)
        if is_wrong.any() and points.row[rows[is_wrong.argmax()]] < points.misfit:
            raise PostError(
                "internal fault: the arc as written would not end where it was planned to",
                where=self._place(int(points.row[rows[is_wrong.argmax()]])),
            )

    def _count(self, arcs: StepArcs, points: Points) -> None:
        """Count arcs that became lines, moves of less than a step that were dropped, and arcs with
        a remainder."""
        changes, path = self._changes, self._toolpath
        landed = np.zeros(len(arcs.row), dtype=np.bool_)
        landed[np.searchsorted(arcs.row, points.row[points.is_arc])] = True
        changes.arcs_as_lines = int((~landed).sum())
        is_still = path.is_motion[points.row] & ~points.is_sent & ~path.is_arc[points.row]
        # Parts of slopes and of far arcs may be small.
        is_still &= ~self._split[self._row[points.row]]
        changes.dropped = int(is_still.sum()) + len(arcs.nothing)
        mended = np.flatnonzero(landed & ~arcs.at_end)
        changes.mended = len(mended)
        if len(mended):
            gap = (arcs.end - arcs.stop)[mended].astype(np.float64)
            gaps_um = np.hypot(gap[:, 0], gap[:, 1]) * self._grid.step_mm * 1000.0
            changes.remainder_um = float(gaps_um.max())
            changes.remainder_place = self._place(int(arcs.row[mended[gaps_um.argmax()]]))

    # Events, of which there are few.

    def _events(self, points: Points) -> list[tuple[int, str]]:
        """Return the blocks of all events, each with its row; PostError for the first row that
        cannot be sent. Messages have no word in the dialect and are not sent."""
        blocks = []
        last = len(self._toolpath) - (1 if self._ended else 0)
        for row in np.flatnonzero(~self._toolpath.is_motion).tolist():
            if row > points.misfit:
                break
            if self._first <= row < last:
                blocks += [(row, block) for block in self._event(row)]
        if points.misfit < len(self._toolpath):
            _refuse_chords(self._place(points.misfit))
        return blocks

    def _event(self, row: int) -> list[str]:
        """Return the blocks of one event."""
        kind, before = Kind(int(self._toolpath.kind[row])), self._before[row].copy()
        blocks: list[str] = []
        if kind == Kind.END:
            raise PostError("moves follow the end of the program", where=self._place(row))
        if kind == Kind.HOME_XY:
            blocks, before[:2] = ["G28X0Y0;"], self._home((0, 1))[0]
        elif kind == Kind.HOME_Z:
            blocks, before[2:] = ["G28Z0;"], self._home((2,))[0]
        elif kind == Kind.SET_ZERO:
            if before.any():
                raise PostError(
                    "part zero can only be set at part zero",
                    where=self._place(row),
                    mend="set it first, before any move",
                )
            blocks = ["G54;"]
        elif kind != Kind.MESSAGE:
            blocks, rounded = event_words(self._wanted, int(self._row[row]))
            if rounded:
                self._changes.rounded += 1
                self._changes.rounded_place = self._changes.rounded_place or self._place(row)
        if (self._numbers.end_steps[row] != before).any():
            raise PostError(
                f"a {kind.name} cannot end at another place than where the controller stands then",
                where=self._place(row),
                mend="give the row the position of the tool (machine zero after homing)",
            )
        return blocks

    def _home(self, axes: tuple[int, ...]) -> tuple[Ints, Ints]:
        """Return the steps and the units of machine zero in these axes."""
        zero = self._machine.controller.machine_zero_mm
        grids = [self._numbers.grids[axis] for axis in axes]
        units = [
            grid.units(np.array([zero[axis]])) for axis, grid in zip(axes, grids, strict=True)
        ]
        steps = [grid.steps(one) for grid, one in zip(grids, units, strict=True)]
        return np.concatenate(steps), np.concatenate(units)


class StepArcs(Struct, frozen=True, eq=False):
    """J arcs that have a length, in steps: their rows; the columns of `arcs` (J, 7) of the kernel;
    signed sweeps, rad; landings (J, 3). `nothing`: the rows of arcs whose end is their start."""

    row: Ints
    table: Ints
    sweep_rad: Floats
    landing: Ints
    nothing: Ints

    @property
    def clockwise(self) -> Bools:
        """Mask (J,) of the arcs that turn clockwise."""
        return np.asarray(self.table[:, CLOCKWISE] != 0)

    @property
    def end(self) -> Ints:
        """Programmed ends (J, 2) in steps."""
        return self.table[:, 2:4] + self.table[:, 4:6]

    @property
    def stop(self) -> Ints:
        """Landings (J, 2) in steps."""
        return self.landing[:, :2] + self.table[:, 4:6]

    @property
    def landed(self) -> Bools:
        """Mask (J,) of the arcs with a landing."""
        return np.asarray(self.landing[:, ITERATION] >= 0)

    @property
    def at_end(self) -> Bools:
        """Mask (J,) of the arcs whose landing is the wanted end."""
        return np.asarray((self.landing[:, :2] == self.table[:, 2:4]).all(axis=1))

    @property
    def at_start(self) -> Bools:
        """Mask (J,) of the arcs whose landing is their start."""
        return np.asarray((self.landing[:, :2] == self.table[:, :2]).all(axis=1))

    @property
    def expected_rad(self) -> Floats:
        """Estimated angle (J,) that an arc has turned at its landing: n ≈ (2√2/π)·R·turn on the
        average of all directions, and never off by more than a quarter of the turn."""
        radius = np.hypot(self.table[:, 0].astype(np.float64), self.table[:, 1])
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = self.landing[:, ITERATION] * math.pi / (2.0 * math.sqrt(2.0) * radius)
        return np.where(self.landed, turn, 0.0)


class Points(Struct, frozen=True, eq=False):
    """P points in order: their rows; X and Y in units after the point (P, 2); masks of points for
    which a block is sent, of blocks of Z, and of blocks of arcs. `before` (J, 2): the units from
    which each arc starts; `misfit`: the first row with a point that cannot be written, or the
    number of rows if there is none."""

    row: Ints
    units: Ints
    before: Ints
    is_sent: Bools
    is_deep: Bools
    is_arc: Bools
    misfit: int


class Chords(Struct, frozen=True, eq=False):
    """Lines for J arcs: their number `count` (J,) for each, and all ends except the last of each
    arc, which is the arc's own: `end` (K, 2) mm, the arc, and the number of the chord in it, from
    0."""

    count: Ints
    end: Floats
    arc: Ints
    part: Ints

    def without(self, arcs: Bools) -> Chords:
        """Return the chords of all arcs except `arcs` (J,)."""
        is_kept = ~arcs[self.arc]
        return Chords(
            np.where(arcs, 0, self.count), self.end[is_kept], self.arc[is_kept], self.part[is_kept]
        )


def turned_rad(start_arm: Floats | Ints, end_arm: Floats | Ints, clockwise: Bools) -> Floats:
    """Return (J,) the sweep from the vectors `start_arm` to the vectors `end_arm`, (J, 2) each and
    from the centre, in (0, 2π]; a full turn where both are equal."""
    cross = start_arm[:, 0] * end_arm[:, 1] - start_arm[:, 1] * end_arm[:, 0]
    dot = start_arm[:, 0] * end_arm[:, 0] + start_arm[:, 1] * end_arm[:, 1]
    angle = np.mod(np.arctan2(np.where(clockwise, -cross, cross), dot), _TURN)
    return np.where(angle == 0.0, _TURN, angle)


def full_turns(turn_rad: Floats, expected_rad: Floats) -> Floats:
    """Return the number of full turns that brings each sweep nearest to the expected one."""
    return np.asarray(np.rint((expected_rad - turn_rad) / _TURN))


def chord_ends(start: Floats, centre: Floats, sweep_rad: Floats, sagitta_mm: float) -> Chords:
    """Return the fewest equal chords within `sagitta_mm` of each arc.

    `start`, `centre` (J, 2) mm; signed sweeps (J,). A chord over the angle a deviates by R (1 −
    cos(a/2)); no chord turns by more than a right angle."""
    arms = start - centre
    radius = np.hypot(arms[:, 0], arms[:, 1])
    with np.errstate(divide="ignore"):
        ratio = np.minimum(1.0, sagitta_mm / radius)
    widest = np.minimum(math.pi / 2.0, 2.0 * np.arccos(1.0 - ratio))
    count = np.maximum(np.ceil(np.abs(sweep_rad) / widest), 1.0).astype(np.int64)
    arc = np.repeat(np.arange(len(count)), count - 1)
    part = np.arange(len(arc)) - np.repeat(np.cumsum(count - 1) - (count - 1), count - 1)
    angle = np.arctan2(arms[:, 1], arms[:, 0])[arc] + sweep_rad[arc] * (part + 1) / count[arc]
    spoke = radius[arc, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    return Chords(count, centre[arc] + spoke, arc, part)


class WriterChanges(Struct):
    """Counts of the writer's changes; places name the first of each kind."""

    dropped: int = 0
    arcs_as_lines: int = 0
    split: int = 0
    split_place: str = ""
    split_step_mm: float = 0.0
    far: int = 0
    """Arcs whose centre the dialect cannot represent."""
    far_place: str = ""
    mended: int = 0
    remainder_um: float = 0.0
    remainder_place: str = ""
    rounded: int = 0
    rounded_place: str = ""

    def findings(self, step_um: float) -> Iterator[Finding]:
        """Yield one finding for each count that is not 0."""
        if self.split:
            yield MOVE_SPLIT(where=self.split_place, measured=self.split_step_mm, count=self.split)
        if collapsed := self.dropped + self.arcs_as_lines:
            yield MOVE_COLLAPSED(measured=collapsed, dropped=self.dropped, arcs=self.arcs_as_lines)
        if self.far:
            yield ARC_MENDED_FLAT(where=self.far_place, measured=self.far)
        if self.mended:
            yield ARC_MENDED(
                where=self.remainder_place,
                measured=self.remainder_um,
                count=self.mended,
                steps=self.remainder_um / step_um,
            )
        if self.rounded:
            yield VALUE_ROUNDED(where=self.rounded_place, count=self.rounded)


def too_long(data: bytes, buffer_chars: int | None) -> Iterator[Finding]:
    """Yield BLOCK_TOO_LONG if blocks exceed the controller's buffer: a remark for the buffer of
    the thesis, which contradicts itself, and a warning for one that the user has given."""
    lengths = line_lengths(data)
    limit = BUFFER_CHARS if buffer_chars is None else buffer_chars
    if count := int((lengths > limit).sum()):
        yield (BLOCK_TOO_LONG_PERHAPS if buffer_chars is None else BLOCK_TOO_LONG)(
            where=f"block {int(lengths.argmax()) + 1}",
            measured=int(lengths.max()),
            limit=limit,
            count=count,
        )
