"""The coils of the parallel-port machine, as bytes of its two ports with their milliseconds.

Tabla 3.7 (L1044-1050) says which bits are whose, figure 3.13 (L1113-1123) the four states of a
motor. The half period P is "la mitad del período de la señal enviada a una de las terminales"
(L1127). In these states a terminal is high for two and low for two, so a half period has two
states, and a step of two half periods (Tabla 4.1) all four. At P = 3 that gives the 4 ms of X and
6 ms of Y that the oscilloscope shows (L1188); a state for each step would give 16 and 24.

    step k of an axis: its states, evenly in the time since its step before, at whole milliseconds

The states of a step that the end of the move cuts off are not begun. Steps of a compensation come
before the move, X, Y, Z. The spindle makes a step with each of the longer axis (L1097, L1137).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Ints
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.simulation.pulses import OUTPUTS, Pulses, in_order, reversals_of
from camtool.target.signals import Board, Coils, SignalModel
from camtool.toolpath.moves import Kind, Toolpath

from .controller import FlashcutRun, TimerBatch
from .dialect import FlashcutController, FlashcutDialect

_Machine = Machine[FlashcutController, FlashcutDialect]

LINES = "C", "B", "D", "A"
"""Terminals from the lowest bit on: the columns A D B C of figure 3.13 are read as a number."""

FORWARD = 0b1001, 0b1100, 0b0110, 0b0011

PLACES = ("X", "0x378", 0), ("Y", "0x378", 4), ("Z", "0xBC00", 4), ("spindle", "0xBC00", 0)
"""Motor, port and lowest bit (Tabla 3.7)."""

SPINDLE = 3

MS_PER_S = 1000.0


class FlashcutSignals(SignalModel):
    """The bytes of the ports 0x378 and 0xBC00."""

    def board(self, machine: _Machine) -> Board:
        """Return the lines of the four motors."""
        states = states_per_step(machine.controller)
        return Board(
            tuple(
                Coils(name, port, shift, LINES, FORWARD, states, at_start="off")
                for name, port, shift in PLACES
            ),
            1e-3,
            "ms",
            (
                f"a step is {states} states of the coils (controller.coil_states_per_step): "
                "measure a short move before you trust it",
                "A D B C are taken for bits 3 to 0, and the printed order for +: not stated",
            ),
        )

    def pulses(self, toolpath: Toolpath, machine: _Machine) -> Iterator[Pulses]:
        """Yield the states of all coils."""
        run = FlashcutRun(toolpath, machine, OUTPUTS)
        states = _CoilRun(toolpath, run, machine)
        for batch in run.batches():
            yield states.pulses(batch)


def states_per_step(controller: FlashcutController) -> int:
    """Return the states of the coils that a step takes."""
    return controller.coil_states_per_step or 2 * controller.half_periods_per_step


class _Steps(Struct, frozen=True, eq=False):
    """S steps of a motor: their first and last ms (S,), directions (S,) ±1 or 0, rows (S,), and
    the mask (S,) of those of a compensation."""

    motor: int
    from_ms: Ints
    to_ms: Ints
    sense: Ints
    row: Ints
    is_added: Bools


class _CoilRun:
    """State of a run: where and which way the motors go, and the time so far, ms."""

    def __init__(self, toolpath: Toolpath, run: FlashcutRun, machine: _Machine) -> None:
        controller = machine.controller
        self._parts, self._states = (
            controller.half_periods_per_step,
            states_per_step(controller),
        )
        self._compensation_ms = controller.compensation_half_period_ms
        axes = list(machine.axes)
        self._step_mm = np.array([axis.coded_step_mm for axis in axes])
        self._added = np.array(
            [to_steps(axis.compensation_mm, axis.coded_step_mm) for axis in axes]
        )
        self._origin = toolpath.start
        self._position = np.zeros(3, dtype=np.int64)
        self._sense = np.full(3, 1 if controller.start_direction == "+" else -1)
        self._waits_ms = np.rint(run.waits_s * MS_PER_S).astype(np.int64)
        self._spindle = _spindle_senses(toolpath, spins_always=not machine.dialect.spindle_stops)
        self._clock_ms = 0
        """The end of all moves that are complete."""
        self._row = -1
        """The last row whose wait is in the clock."""
        self._begin_ms = 0
        """The start of the move that is under way, of which `_done` is known."""
        self._done: tuple[int, Ints] | None = None
        """Of the move under way: its time so far, and the last step (3,) of each axis, ms."""
        self._pending = Pulses.none(len(PLACES))

    def pulses(self, batch: TimerBatch) -> Pulses:
        """Return the states of the next batch that are surely before those of the one after it."""
        issued, filled = batch.issued, batch.filled
        row, move = issued.row[:filled] + batch.low, issued.move[:filled]
        since = issued.since_ms[:filled]
        places = np.rint((issued.commanded[:filled] - self._origin) / self._step_mm)
        moves = np.diff(places.astype(np.int64), axis=0, prepend=self._position[None, :])
        under_way = bool(filled and batch.under_way[0] > 0 and move[-1] == batch.move)
        steps: list[_Steps] = []
        safe_ms = self._clock_ms
        if filled:
            self._position = places[-1].astype(np.int64)
            begins, half, lasts = self._begin_moves(batch, row, moves, under_way, steps)
            number = np.searchsorted(begins[0], move)
            begin_ms = begins[1][number]
            last_of_axis = self._axis_steps(moves, move, since, begin_ms, row, steps)
            self._spindle_steps(move, since, begin_ms, row, half[number], steps)
            if under_way:
                self._begin_ms = int(begins[1][-1])
                self._done = int(since[-1]), last_of_axis
                slow = last_of_axis[batch.under_way[2:4][batch.under_way[2:4] >= 0]]
                safe_ms = self._begin_ms + self._parts * int(slow.min())
            else:
                self._clock_ms, self._done = lasts, None
        if not under_way:
            self._wait(int(batch.low + batch.rows[-1]))
            safe_ms = self._clock_ms
        return self._released([self._states_of(each) for each in steps], safe_ms)

    def _wait(self, row: int) -> None:
        """Let the waits of the rows up to this one pass."""
        self._clock_ms += int(self._waits_ms[self._row + 1 : row + 1].sum())
        self._row = max(self._row, row)

    def _begin_moves(
        self, batch: TimerBatch, row: Ints, moves: Ints, under_way: bool, steps: list[_Steps]
    ) -> tuple[tuple[Ints, Ints], Ints, int]:
        """Return the moves with samples and their starts, ms, their half periods with their
        lateness, ms, and the end of the last one; `steps` gets their compensations, which come
        before."""
        numbers = batch.issued.move[: batch.filled]
        first = np.flatnonzero(np.diff(numbers, prepend=-1))
        ends = np.append(first[1:], batch.filled) - 1
        ways = np.zeros((len(first), 3), dtype=np.int64)
        for axis in range(3):
            ways[:, axis] = np.sign(np.add.reduceat(moves[:, axis], first))
        if under_way:
            for column, sense in zip(batch.under_way[2:4], batch.under_way[4:6], strict=True):
                if column >= 0:
                    ways[-1, column] = sense
        turns, self._sense = reversals_of(ways, self._sense)
        half = batch.moves.half_period[numbers[first]]
        each = (half if self._compensation_ms is None else self._compensation_ms) + np.zeros_like(
            half
        )
        each_ms = self._parts * (each + 1)
        added = turns * self._added
        durations = self._parts * batch.issued.since_ms[ends]
        begin_ms = np.empty(len(first), dtype=np.int64)
        for k, start in enumerate(first.tolist()):
            if k == 0 and self._done is not None:
                begin_ms[k] = self._begin_ms
            else:
                self._wait(int(row[start]))
                begin_ms[k] = self._clock_ms + added[k].sum() * each_ms[k]
                if added[k].any():
                    steps += self._compensation(
                        added[k], ways[k], int(row[start]), int(each_ms[k])
                    )
            self._clock_ms = int(begin_ms[k] + durations[k])
        return (numbers[first], begin_ms), half + 1, self._clock_ms

    def _compensation(self, counts: Ints, ways: Ints, row: int, each_ms: int) -> list[_Steps]:
        """The steps of a compensation from the present time on, with those of the spindle."""
        total = int(counts.sum())
        starts = self._clock_ms + each_ms * np.arange(total)
        axis = np.repeat(np.arange(3), counts)
        rows, is_added = np.full(total, row), np.ones(total, dtype=np.bool_)
        steps = [_Steps(SPINDLE, starts, starts + each_ms, self._spindle[rows], rows, is_added)]
        for k in range(3):
            own = axis == k
            sense = np.full(int(counts[k]), ways[k])
            steps.append(
                _Steps(k, starts[own], starts[own] + each_ms, sense, rows[own], is_added[own])
            )
        return steps

    def _axis_steps(
        self, moves: Ints, move: Ints, since: Ints, begin_ms: Ints, row: Ints, steps: list[_Steps]
    ) -> Ints:
        """Append the steps of the three axes; return the last one of each, ms within the last
        move."""
        lasts = np.zeros(3, dtype=np.int64)
        carried = self._done is not None
        for axis in range(3):
            index = np.flatnonzero(moves[:, axis])
            before = np.zeros(len(index), dtype=np.int64)
            before[1:] = np.where(move[index[1:]] == move[index[:-1]], since[index[:-1]], 0)
            earlier = self._done[1][axis] if self._done is not None else 0
            if len(index) and carried and move[index[0]] == move[0]:
                before[0] = earlier
            steps.append(
                _Steps(
                    axis,
                    begin_ms[index] + self._parts * before,
                    begin_ms[index] + self._parts * since[index],
                    moves[index, axis],
                    row[index],
                    np.zeros(len(index), dtype=np.bool_),
                )
            )
            if len(index) and move[index[-1]] == move[-1]:
                lasts[axis] = since[index[-1]]
            elif carried and move[-1] == move[0]:
                lasts[axis] = earlier
        return lasts

    def _spindle_steps(
        self, move: Ints, since: Ints, begin_ms: Ints, row: Ints, half: Ints, steps: list[_Steps]
    ) -> None:
        """Append the steps of the spindle, one with each of the longer axis."""
        firings = since // half
        before = np.zeros_like(firings)
        before[1:] = np.where(move[1:] == move[:-1], firings[:-1], 0)
        if self._done is not None:
            before[0] = self._done[0] // half[0]
        fires = firings > before
        to_ms = begin_ms[fires] + self._parts * firings[fires] * half[fires]
        from_ms = to_ms - self._parts * half[fires]
        sense = self._spindle[row[fires]]
        added = np.zeros(len(to_ms), dtype=np.bool_)
        steps.append(_Steps(SPINDLE, from_ms, to_ms, sense, row[fires], added))

    def _states_of(self, steps: _Steps) -> Pulses:
        """The states of these steps."""
        turning = np.flatnonzero(steps.sense)
        number = np.tile(np.arange(1, self._states + 1), len(turning))
        index = np.repeat(turning, self._states)
        from_ms = steps.from_ms[index]
        at_ms = from_ms + (steps.to_ms[index] - from_ms) * number // self._states
        moves = np.zeros((len(index), len(PLACES)), dtype=np.int64)
        moves[:, steps.motor] = steps.sense[index]
        return Pulses(at_ms / MS_PER_S, moves, steps.row[index], steps.is_added[index], 0.0)

    def _released(self, parts: list[Pulses], safe_ms: int) -> Pulses:
        """Return the states up to this time, and keep the others."""
        pulses = in_order([self._pending, *parts], safe_ms / MS_PER_S)
        count = int(np.searchsorted(pulses.at_s, pulses.until_s, side="right"))
        self._pending = pulses.part(count, len(pulses.at_s))
        return pulses.part(0, count)


def _spindle_senses(toolpath: Toolpath, *, spins_always: bool) -> Ints:
    """(N,) the direction of the spindle in each row, 0 where it stands."""
    kind = toolpath.kind
    senses = np.zeros(len(kind) + 1, dtype=np.int64)
    senses[0] = int(spins_always)
    senses[1:][kind == Kind.SPINDLE_CW] = 1
    senses[1:][kind == Kind.SPINDLE_CCW] = -1
    says = (kind == Kind.SPINDLE_CW) | (kind == Kind.SPINDLE_CCW)
    if not spins_always:
        says |= kind == Kind.SPINDLE_OFF
    latest = np.concatenate([[0], np.where(says, np.arange(1, len(kind) + 1), 0)])
    return np.asarray(senses[np.maximum.accumulate(latest)][1:])
