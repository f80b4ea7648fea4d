"""The coils of the parallel-port machine, as bytes of its two ports with their milliseconds.

Tabla 3.7 (L1044-1050) says which bits are whose, figure 3.13 (L1113-1123) the four states of a
motor. The half period P is "la mitad del período de la señal enviada a una de las terminales"
(L1127). In these states a terminal is high for two and low for two, so a half period has two
states, and a step of two half periods (Tabla 4.1) all four. At P = 3 that gives the 4 ms of X and
6 ms of Y that the oscilloscope shows (L1188); a state for each step would give 16 and 24.

    step k of an axis: its states, evenly in the time since its step before, at whole milliseconds

The states of a step that the end of the move cuts off are not begun. Steps of a compensation come
before the move, X, Y, Z. The spindle makes a step with each of the longer axis (L1097, L1137)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Ints
from camtool.machine.model import Machine
from camtool.simulation.pulses import OUTPUTS, Pulses, in_order
from camtool.target.signals import Board, Coils, SignalModel
from camtool.toolpath.moves import Kind, Toolpath

from .controller import MS_PER_S, FlashcutRun, MoveClock, MoveTimes, TimerBatch
from .dialect import FlashcutController, FlashcutDialect

_Machine = Machine[FlashcutController, FlashcutDialect]

LINES = "C", "B", "D", "A"
"""Terminals from the lowest bit on: the columns A D B C of figure 3.13 are read as a number."""

FORWARD = 0b1001, 0b1100, 0b0110, 0b0011

PLACES = ("X", "0x378", 0), ("Y", "0x378", 4), ("Z", "0xBC00", 4), ("spindle", "0xBC00", 0)
"""Motor, port and lowest bit (Tabla 3.7)."""

SPINDLE = 3


class FlashcutSignals(SignalModel):
    """The bytes of the ports 0x378 and 0xBC00."""

    def board(self, machine: _Machine) -> Board:
        """Return the coil lines of the four motors."""
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
        """Yield the states of all coils, in order of time."""
        run = FlashcutRun(toolpath, machine, OUTPUTS)
        states = _CoilRun(toolpath, run, machine)
        for batch in run.batches():
            yield states.pulses(batch)


def states_per_step(controller: FlashcutController) -> int:
    """Return the number of coil states in a step."""
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
    """State of a run: the moves with their times, and coil states that may come after some of the
    next batch."""

    def __init__(self, toolpath: Toolpath, run: FlashcutRun, machine: _Machine) -> None:
        controller = machine.controller
        self._parts, self._states = (controller.half_periods_per_step, states_per_step(controller))
        self._clock = MoveClock(run, machine)
        self._spindle = _spindle_senses(toolpath, spins_always=not machine.dialect.spindle_stops)
        self._done: tuple[int, Ints] | None = None
        """Of the move under way: its time so far, and the last step (3,) of each axis, ms."""
        self._pending = Pulses.none(len(PLACES))

    def pulses(self, batch: TimerBatch) -> Pulses:
        """Return the coil states of a batch that surely come before all states of the next
        batch."""
        filled = batch.filled
        move, since = batch.issued.move[:filled], batch.issued.since_ms[:filled]
        times = self._clock.take(batch)
        steps: list[_Steps] = []
        safe_ms = self._clock.now_ms
        if filled:
            for k in np.flatnonzero(times.added.any(axis=1)).tolist():
                steps += self._compensation(times, k)
            begin_ms = times.begin_ms[times.number]
            last_of_axis = self._axis_steps(times.steps, move, since, begin_ms, times.row, steps)
            half = times.half_period_ms[times.number]
            self._spindle_steps(move, since, begin_ms, times.row, half, steps)
            if times.is_under_way:
                self._done = int(since[-1]), last_of_axis
                slow = last_of_axis[batch.under_way[2:4][batch.under_way[2:4] >= 0]]
                safe_ms = int(times.begin_ms[-1]) + self._parts * int(slow.min())
            else:
                self._done = None
        return self._released([self._states_of(each) for each in steps], safe_ms)

    def _compensation(self, times: MoveTimes, k: int) -> list[_Steps]:
        """Return the compensation steps before move `k`, with those of the spindle."""
        counts, ways = times.added[k], times.ways[k]
        row, each_ms = int(times.first_row[k]), int(times.added_step_ms[k])
        total = int(counts.sum())
        starts = int(times.begin_ms[k]) + each_ms * np.arange(-total, 0)
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
        """Append the steps of the three axes to `steps`; return the time of the last step of each
        axis, ms since the start of the last move."""
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
        """Append the steps of the spindle: one with each step of the longer axis."""
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
        """Return the coil states of these steps."""
        turning = np.flatnonzero(steps.sense)
        number = np.tile(np.arange(1, self._states + 1), len(turning))
        index = np.repeat(turning, self._states)
        from_ms = steps.from_ms[index]
        at_ms = from_ms + (steps.to_ms[index] - from_ms) * number // self._states
        moves = np.zeros((len(index), len(PLACES)), dtype=np.int64)
        moves[:, steps.motor] = steps.sense[index]
        return Pulses(at_ms / MS_PER_S, moves, steps.row[index], steps.is_added[index], 0.0)

    def _released(self, parts: list[Pulses], safe_ms: int) -> Pulses:
        """Return the states up to `safe_ms`, and keep later ones for the next call."""
        pulses = in_order([self._pending, *parts], safe_ms / MS_PER_S)
        count = int(np.searchsorted(pulses.at_s, pulses.until_s, side="right"))
        self._pending = pulses.part(count, len(pulses.at_s))
        return pulses.part(0, count)


def _spindle_senses(toolpath: Toolpath, *, spins_always: bool) -> Ints:
    """Return (N,) the direction of the spindle in each row, 0 where it stands."""
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
