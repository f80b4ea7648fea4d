"""The PC of the parallel-port machine: independent millisecond timers, one for each axis.

What it does with a row of the toolpath, in the order of this file:

1. A row becomes displacements: one of X and Y, one of Z, an arc as many chords as
   `controller.chords_per_turn` says. Each is counted from where the program was, or, with
   `controller.goes_on_from` "reached", from where the steps issued so far have led.
2. A displacement becomes steps of each axis by `controller.rounding`.
3. The timers run until the longer axis has made its steps; the shorter one makes as many as its
   own timer gives, at least what it should and often more (`steps`). With
   "programmed" the steps that are too many are never corrected in the rest of the program.
4. The half period comes from the feed and is at least `controller.half_period_ms`, where one
   axis moves alone `controller.single_axis_half_period_ms`; a step takes
   `controller.half_periods_per_step` of them, and each is a millisecond late.
5. At each change of an axis's direction the compensation steps are issued, a step's time each
   (`controller.compensation_half_period_ms`).

Every move ends: the longer axis arrives."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
from camtool.kernels.lattice import HALF_STEP_GUARD, to_steps
from camtool.machine.model import Machine
from camtool.simulation.controller import ControllerModel
from camtool.simulation.legs import waits_s
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Ledger, Options
from camtool.simulation.rows import check_positions, check_rows, refuse, with_event_positions
from camtool.simulation.timing import TimedChunk, reversals_of
from camtool.toolpath.moves import Kind, Toolpath

from .dialect import FlashcutController, FlashcutDialect
from .steps import HOME_X, HOME_Y, HOME_Z, XY, Counters, Issued, Moves, Rules, Z, timers_fill
from .timers import feeds_of, half_periods_ms, shortest_ms

_Machine = Machine[FlashcutController, FlashcutDialect]

MOVES_AT_ONCE = 1 << 14


class FlashcutModel(ControllerModel[FlashcutController, FlashcutDialect]):
    """The PC of the parallel-port machine: a timer for each axis."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """Return the motion in chunks."""
        return FlashcutRun(toolpath, machine, options).run()

    def timed(
        self, toolpath: Toolpath, machine: _Machine, options: Options
    ) -> Iterator[TimedChunk]:
        """Return the motion in chunks, with the times of its samples by the millisecond timers."""
        run = FlashcutRun(toolpath, machine, options)
        return run.timed(MoveClock(run, machine))

    def quantised(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        """Return the toolpath as programmed, with homing at machine zero: the controller keeps
        lengths and rounds displacements, so that steps are part of its interpolation."""
        return place_events(toolpath, machine)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "timers": each axis follows a timer of its own."""
        return "timers"

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind times and figures, as sentences for the report."""
        controller = machine.controller
        shortest = shortest_ms(np.array([False, True]), controller)
        step_mm = max(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
        both_axes, one = feeds_of(shortest, step_mm, controller).tolist()
        return (
            f"a step takes {controller.half_periods_per_step} half periods of at least "
            f"{shortest[0]:g} ms (controller.half_period_ms), or {shortest[1]:g} ms where one "
            "axis moves alone (controller.single_axis_half_period_ms), each a millisecond late: "
            f"no move is faster than {both_axes:.3g} or {one:.3g} mm/min, whatever its F",
            "the longer axis of a move keeps the feed; speeds change at once",
            f"an arc becomes {controller.chords_per_turn} chords a turn "
            "(controller.chords_per_turn)",
            f"displacements are counted from where the program {_FROM[controller.goes_on_from]} "
            "(controller.goes_on_from)",
            f"each step of a compensation has {_compensation(controller)} "
            "(controller.compensation_half_period_ms)",
        )


def _compensation(controller: FlashcutController) -> str:
    half_period = controller.compensation_half_period_ms
    return (
        "its move's half period" if half_period is None else f"a half period of {half_period} ms"
    )


_FROM = {"programmed": "was, so that steps too many stay", "reached": "has got to"}


class FlashcutRun:
    """Run of a toolpath; ProgramError for rows that the controller cannot follow."""

    def __init__(self, toolpath: Toolpath, machine: _Machine, options: Options) -> None:
        controller = machine.controller
        path = place_events(toolpath.first(toolpath.executed_rows), machine)
        check_rows(path, len(path))
        self._rows = len(path)
        self.waits_s = waits_s(path, len(path))
        """Seconds (R,) of rows without motion."""
        self._table = MoveTable.of(path, machine)
        self.start_mm = path.start
        self._mechanics = Mechanics(machine, path.start, options.effects)
        self._parts = controller.half_periods_per_step
        self._compensation_ms = controller.compensation_half_period_ms
        is_nearest = controller.rounding == "nearest"
        self._rules = Rules(
            origin=path.start,
            step_mm=np.array([axis.coded_step_mm for axis in machine.axes]),
            added=HALF_STEP_GUARD + (0.5 if is_nearest else 0.0),
            from_reached=controller.goes_on_from == "reached",
            late_longer=controller.clock == "late-longer",
        )
        self._counters = Counters(np.zeros(3, np.int64), path.start.copy(), np.zeros(10, np.int64))
        self._samples, self._reached_s = options.chunk_steps, 0.0

    def run(self) -> Iterator[Chunk]:
        """Return the chunks of all rows up to the end of the program."""
        return map(self._chunk, self.batches())

    def timed(self, clock: MoveClock) -> Iterator[TimedChunk]:
        """Yield the chunks with the times of their samples; each sample ends its period."""
        for batch in self.batches():
            times = clock.take(batch)
            move_s = times.begin_ms[times.number] / MS_PER_S
            since_s = self._parts * batch.issued.since_ms[: batch.filled] / MS_PER_S
            at_s = move_s + since_s
            before_s = np.concatenate([[self._reached_s], at_s])[:-1]
            self._reached_s = float(at_s[-1]) if batch.filled else self._reached_s
            yield TimedChunk(self._chunk(batch), at_s, np.maximum(before_s, move_s), at_s)

    def batches(self) -> Iterator[TimerBatch]:
        """Yield the samples of all rows up to the end of the program, in batches."""
        low = 0
        while low < self._rows:
            move_counts = np.cumsum(self._table.moves_of(low, low + MOVES_AT_ONCE))
            high = low + max(int(np.searchsorted(move_counts, MOVES_AT_ONCE, side="right")), 1)
            yield from self._window(low, high)
            low = high

    def _window(self, low: int, high: int) -> Iterator[TimerBatch]:
        """Yield the samples of the rows low:high, in batches."""
        moves = self._table.moves(low, high)
        move = done_rows = 0  # rows from `low` on whose ledger is complete
        while done_rows < high - low:
            row_of, move_of, since_ms = np.empty((3, self._samples), np.int64)
            issued = Issued(
                np.empty((self._samples, 3)),
                row_of,
                move_of,
                since_ms,
                np.zeros(high - low, np.int64),
                np.zeros((high - low, 3), np.int64),
            )
            move, filled = timers_fill(moves, move, self._rules, self._counters, issued)
            under_way = int(moves.row[move]) if move < len(moves.row) else high - low
            rows = np.arange(done_rows, min(under_way + 1, high - low))
            counters = self._counters.under_way.copy()
            yield TimerBatch(low, rows, moves, issued, filled, move, counters)
            done_rows = under_way

    def _chunk(self, batch: TimerBatch) -> Chunk:
        """Return the samples of a batch as a chunk, with the ledger of its rows."""
        low, rows, issued, filled = batch.low, batch.rows, batch.issued, batch.filled
        row, commanded = issued.row[:filled] + low, issued.commanded[:filled]
        reversals = np.zeros((len(rows), 3), dtype=np.int64)
        samples = np.zeros(len(rows), dtype=np.int64)
        slide = NO_SAMPLES
        if filled:
            offsets = np.concatenate([[0], np.flatnonzero(np.diff(row)) + 1, [filled]])
            moving_rows = row[offsets[:-1]] - low - rows[0]
            slide, reversals[moving_rows] = self._mechanics.follow(commanded, offsets)
            samples[moving_rows] = np.diff(offsets)
        compensation_s = self._seconds(reversals, low + rows)
        moving_s = self._parts * issued.duration_ms[rows] / 1000.0
        ledger = Ledger(
            row=low + rows,
            duration_s=moving_s + compensation_s + self.waits_s[low + rows],
            compensation_s=compensation_s,
            iterations=samples,
            steps=issued.steps[rows],
            reversals=reversals,
            ended=np.ones(len(rows), dtype=np.bool_),
        )
        return Chunk(row, commanded, slide, ledger)

    def _seconds(self, reversals: Ints, rows: Ints) -> Floats:
        """Return (R,) seconds of the compensation steps after the reversals (R, 3) of these
        rows."""
        steps = reversals * self._mechanics.compensation_steps
        half_xy, half_z = self._table.half_period_xy[rows], self._table.half_period_z[rows]
        if self._compensation_ms is not None:
            half_xy = half_z = np.full(len(rows), self._compensation_ms)
        milliseconds = (steps[:, 0] + steps[:, 1]) * (half_xy + 1) + steps[:, 2] * (half_z + 1)
        return np.asarray(self._parts * milliseconds / 1000.0)


class TimerBatch(Struct, frozen=True, eq=False):
    """Samples of a batch: the first `filled` rows of the buffers `issued`, made by `moves`. `rows`
    (R,), from `low` on: the rows that have samples here, or do not move. `move` and `under_way`
    (of `Counters`): the move to continue with, and the timers' state, after the last sample."""

    low: int
    rows: Ints
    moves: Moves
    issued: Issued
    filled: int
    move: int
    under_way: Ints


MS_PER_S = 1000.0


class MoveTimes(Struct, frozen=True, eq=False):
    """The K samples of a batch: `steps` (K, 3) since the sample before, `row` (K,), and `number`
    (K,), the index of the move that each belongs to.

    For each of M moves: its start `begin_ms` (M,), the half period of its longer axis
    `half_period_ms` (M,), its directions `ways` (M, 3), its row `first_row` (M,), and the
    compensation steps `added` (M, 3) right before it, each of which takes `added_step_ms` (M,).
    `is_under_way`: the last move continues in the next batch."""

    steps: Ints
    row: Ints
    number: Ints
    begin_ms: Ints
    half_period_ms: Ints
    ways: Ints
    first_row: Ints
    added: Ints
    added_step_ms: Ints
    is_under_way: bool


class MoveClock:
    """Clock of the moves of a run: where and which way the motors go, and the time so far, ms."""

    def __init__(self, run: FlashcutRun, machine: _Machine) -> None:
        controller, axes = machine.controller, list(machine.axes)
        self._parts = controller.half_periods_per_step
        self._compensation_ms = controller.compensation_half_period_ms
        self._step_mm = np.array([axis.coded_step_mm for axis in axes])
        self._added = np.array(
            [to_steps(axis.compensation_mm, axis.coded_step_mm) for axis in axes]
        )
        self._origin = run.start_mm
        self._position = np.zeros(3, dtype=np.int64)
        self._sense = np.full(3, 1 if controller.start_direction == "+" else -1)
        self._waits_ms = np.rint(run.waits_s * MS_PER_S).astype(np.int64)
        self.now_ms = 0
        """The end of what is done."""
        self._row = -1
        """The last row whose wait is in the time."""
        self._begin_ms: int | None = None
        """The start of the move that is under way."""

    def take(self, batch: TimerBatch) -> MoveTimes:
        """Return the times of the next batch."""
        issued, filled = batch.issued, batch.filled
        row, move = issued.row[:filled] + batch.low, issued.move[:filled]
        places = np.rint((issued.commanded[:filled] - self._origin) / self._step_mm)
        steps = np.diff(places.astype(np.int64), axis=0, prepend=self._position[None, :])
        first = np.flatnonzero(np.diff(move, prepend=-1))
        under_way = bool(filled and batch.under_way[0] > 0 and move[-1] == batch.move)
        ways = np.zeros((len(first), 3), dtype=np.int64)
        half = batch.moves.half_period[move[first]]
        each = (half if self._compensation_ms is None else self._compensation_ms) + np.zeros_like(
            half
        )
        added_step_ms = self._parts * (each + 1)
        begin_ms, added = np.zeros(len(first), dtype=np.int64), np.zeros_like(ways)
        if filled:
            self._position = places[-1].astype(np.int64)
            for axis in range(3):
                ways[:, axis] = np.sign(np.add.reduceat(steps[:, axis], first))
            if under_way:
                for column, sense in zip(batch.under_way[2:4], batch.under_way[4:6], strict=True):
                    if column >= 0:
                        ways[-1, column] = sense
            turns, self._sense = reversals_of(ways, self._sense)
            added = turns * self._added
            lasts_ms = self._parts * issued.since_ms[np.append(first[1:], filled) - 1]
            for k, start in enumerate(first.tolist()):
                if k == 0 and self._begin_ms is not None:
                    begin_ms[k], added[k] = self._begin_ms, 0
                else:
                    self._wait(int(row[start]))
                    begin_ms[k] = self.now_ms + added[k].sum() * added_step_ms[k]
                self.now_ms = int(begin_ms[k] + lasts_ms[k])
            self._begin_ms = int(begin_ms[-1]) if under_way else None
        if not under_way:
            self._wait(int(batch.low + batch.rows[-1]))
        number = np.searchsorted(move[first], move)
        return MoveTimes(
            steps,
            row,
            number,
            begin_ms,
            half + 1,
            ways,
            row[first],
            added,
            added_step_ms,
            under_way,
        )

    def _wait(self, row: int) -> None:
        """Add the dwells of the rows up to `row` to the time."""
        self.now_ms += int(self._waits_ms[self._row + 1 : row + 1].sum())
        self._row = max(self._row, row)


# Rows of a toolpath as the displacements that the parallel-port machine's program makes of them.
#
# line, rapid     one of X and Y, and one of Z where Z changes (G01 never has both, L980-992)
# arc             chords of one angle each, from its start to its programmed end
# homing          Y, then X, each alone until its sensor; Z alone

MAX_LONG = (1 << 31) - 1
"""The largest of the controller's whole numbers (timeGetTime is a Long, L1334-1340): half periods
of more milliseconds are refused, and positions and radii of more than a quarter as many steps, so
that no displacement between two of them has more."""

CHORD_GUARD = 1e-9
"""Part of a chord: an arc that exceeds whole chords by less gets no further one."""


def place_events(toolpath: Toolpath, machine: _Machine) -> Toolpath:
    """Return the toolpath with homing at machine zero, and with events where the moves before them
    ended.

    ProgramError for arcs without a centre and for positions beyond the steps that can be counted.
    """
    check_positions(toolpath, machine)
    max_mm = 0.25 * MAX_LONG * np.array([axis.coded_step_mm for axis in machine.axes])
    is_far = toolpath.by_parts(lambda part: np.asarray((np.abs(part.end) > max_mm).any(axis=1)))
    is_far |= (np.abs(toolpath.start) > max_mm).any()
    arcs = np.flatnonzero(toolpath.is_arc)
    spoke = toolpath.centre[arcs] - toolpath.starts_of(arcs)[:, :2]
    is_far[arcs] |= (np.abs(spoke) > max_mm[:2]).any(axis=1)
    refuse(toolpath, is_far, "a position is beyond all that the controller can count")
    return with_event_positions(
        toolpath, np.array(machine.controller.machine_zero_mm, dtype=np.float64)
    )


def half_periods(
    toolpath: Toolpath,
    machine: _Machine,
    step_mm: float,
    moves_one_axis: Callable[[Toolpath], Bools],
) -> Indices:
    """Return (N,) the half period, ms, of the longer axis of each row, for steps of `step_mm`;
    rapids have the shortest. `moves_one_axis` gives a mask of the rows of one axis.

    ProgramError for feeds whose half period the controller cannot count."""

    def count_periods(part: Toolpath) -> Indices:
        feed = np.where(part.is_feed, part.feed, np.inf)
        periods_ms = half_periods_ms(feed, step_mm, moves_one_axis(part), machine.controller)
        return np.minimum(periods_ms, MAX_LONG).astype(np.int32)

    periods = toolpath.by_parts(count_periods)
    slow = periods == MAX_LONG
    if slow.any():
        feed = float(toolpath.feed[slow.argmax()])
        message = f"a feed of {feed:g} mm/min is too slow for the timers to count"
        refuse(toolpath, slow, message, "write a higher F")
    return periods


def _moves_one_axis(toolpath: Toolpath, x_mm: float, y_mm: float) -> Bools:
    """Return a mask (N,), true for rows that move only X or only Y, by whole steps of `x_mm` and
    `y_mm`; arcs are not among them."""
    travel = np.abs(toolpath.end - toolpath.starts)
    has_one_axis = np.minimum(to_steps(travel[:, 0], x_mm), to_steps(travel[:, 1], y_mm)) == 0
    return np.asarray(~toolpath.is_arc & (has_one_axis | (toolpath.kind >= Kind.HOME_XY)))


def _rises(toolpath: Toolpath) -> Bools:
    """Return a mask (N,), true for rows that move Z."""
    lifted = toolpath.end[:, 2] != toolpath.starts[:, 2]
    return np.asarray((toolpath.kind == Kind.HOME_Z) | (toolpath.is_motion & lifted))


def _chords(toolpath: Toolpath, per_turn: int) -> Indices:
    """Return (N,) the number of moves in X and Y that each row makes."""
    flat = (toolpath.end[:, :2] != toolpath.starts[:, :2]).any(axis=1)
    along = toolpath.is_motion & (flat | ~_rises(toolpath))
    chords = np.ceil(np.abs(toolpath.sweeps()) * (per_turn / (2.0 * np.pi)) - CHORD_GUARD)
    homes = 2.0 * (toolpath.kind == Kind.HOME_XY)
    parts = np.where(toolpath.is_arc, np.maximum(chords, 1.0), along + homes)
    return parts.astype(np.int32)


class MoveTable(Struct, frozen=True, eq=False):
    """Table of the moves of a placed toolpath: how many each row makes, and the moves of any
    window of rows."""

    toolpath: Toolpath
    chords: Indices
    rises: Bools
    half_period_xy: Indices
    half_period_z: Indices

    @classmethod
    def of(cls, toolpath: Toolpath, machine: _Machine) -> MoveTable:
        """Return the table of a toolpath that `place_events` gave."""
        per_turn = machine.controller.chords_per_turn
        x, y, z = (axis.coded_step_mm for axis in machine.axes)
        return cls(
            toolpath,
            toolpath.by_parts(lambda part: _chords(part, per_turn)),
            toolpath.by_parts(_rises),
            half_periods(toolpath, machine, max(x, y), lambda part: _moves_one_axis(part, x, y)),
            half_periods(toolpath, machine, z, lambda part: np.ones(len(part), dtype=np.bool_)),
        )

    def moves_of(self, low: int, high: int) -> Ints:
        """Return (R,) the number of moves of each of the rows low:high."""
        return self.chords[low:high].astype(np.int64) + self.rises[low:high]

    def moves(self, low: int, high: int) -> Moves:
        """Return the moves of the rows low:high; `Moves.row` counts from `low`."""
        count = self.moves_of(low, high)
        row = low + np.repeat(np.arange(high - low), count)
        part = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        path, chords = self.toolpath, self.chords[row]
        homes = path.kind[row] >= Kind.HOME_XY
        upward = part == chords
        drives = np.where(upward, np.where(homes, HOME_Z, Z), XY)
        drives[homes & ~upward] = np.where(part[homes & ~upward] == 0, HOME_Y, HOME_X)
        target = path.end[row].copy()
        inner = np.flatnonzero(path.is_arc[row] & (part < chords - 1))
        target[inner, :2] = self._on_arc(row[inner], (part[inner] + 1) / chords[inner])
        half_period = np.where(upward, self.half_period_z[row], self.half_period_xy[row])
        return Moves(drives, target, half_period.astype(np.int64), row - low)

    def _on_arc(self, row: Ints, share: Floats) -> Floats:
        """Return (J, 2) points, mm, at these fractions of the arcs' sweeps, at the radius of the
        start: r = hypot(I, J), from the angle of the start on (L1378)."""
        centre = self.toolpath.centre[row]
        spoke = self.toolpath.starts_of(row)[:, :2] - centre
        radius = np.hypot(spoke[:, 0], spoke[:, 1])
        angle = np.arctan2(spoke[:, 1], spoke[:, 0]) + share * self.toolpath.sweeps_of(row)
        directions = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(centre + radius[:, None] * directions)
