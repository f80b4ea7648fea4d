"""The step and direction lines of grbl, tick by tick of its stepper's timer.

Blocks become segments of about 10 ms with one tick each (`steps.Segments`); within them the
counters of Bresenham say in which tick an axis steps. The interrupt of a tick computes the steps
that the one after it puts on the pins, the directions first (stepper.c). All pins are of port D
(cpu_map.h of an Uno)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.machine.model import Machine
from camtool.simulation.pulses import Pulses, in_order
from camtool.target.signals import Board, SignalModel, StepDirection
from camtool.toolpath.moves import Toolpath

from .controller import Blocks, GrblModel, PlannedBlocks, dwells_of, idle_delay_s, plan_to_end
from .dialect import GrblController, GrblDialect
from .steps import Segments

_Machine = Machine[GrblController, GrblDialect]

CLOCK_HZ = 16e6

STEP_PULSE_S = 10e-6
"""$0 (defaults.h)."""

TICK_S = 1e-7
"""Times are given to 0.1 µs, more than a cycle: a viewer that stores each tick takes no finer."""

SEGMENTS_AT_ONCE = 256

MIN_PER_S = 60.0


class GrblSignals(SignalModel):
    """Steps and directions of three axes on port D."""

    def board(self, machine: _Machine) -> Board:
        """Return the signal lines of the three drivers."""
        return Board(
            tuple(
                StepDirection(name, ("PORTD", 2 + k), ("PORTD", 5 + k), STEP_PULSE_S)
                for k, name in enumerate("XYZ")
            ),
            TICK_S,
            "us",
            (
                "steps last 10 µs ($0), no line is inverted ($2, $3)",
                "the sender keeps grbl's buffer full; overrides stand at 100 %",
            ),
        )

    def pulses(self, toolpath: Toolpath, machine: _Machine) -> Iterator[Pulses]:
        """Yield the step pulses of all ticks."""
        path = GrblModel().quantised(toolpath, machine)
        clock = _Clock(path, machine)
        for planned in plan_to_end(path, machine):
            yield from clock.window(planned)


class _Stretch(Struct, frozen=True, eq=False):
    """S segments in order: `block` (S,) of a window, `ends` (S,) in eighths of a step from the
    start of the first block, `tick` (S,) in eighths of a step, `cycles` (S,) of a tick, `begin`
    (S,), the cycle at which each begins. `from_eighths`: where in its block the first one
    begins."""

    block: Ints
    ends: Ints
    tick: Ints
    cycles: Ints
    begin: Ints
    from_eighths: int


class _Clock:
    """The time so far, in cycles of the processor."""

    def __init__(self, path: Toolpath, machine: _Machine) -> None:
        self._path, self._controller = path, machine.controller
        self._idle = round(idle_delay_s(machine.controller) * CLOCK_HZ)
        self._cycles = 0

    def window(self, planned: PlannedBlocks) -> Iterator[Pulses]:
        """Yield the pulses of a window of blocks."""
        blocks, row = planned.blocks, planned.blocks.row - planned.low
        dwells_s = dwells_of(self._path, planned.low, planned.high, self._controller)
        dwelt = np.cumsum(np.rint(dwells_s * CLOCK_HZ).astype(np.int64))
        dwelt_at = dwelt[row]
        waits = np.diff(dwelt_at, prepend=0)
        waits[1:] += self._idle * planned.rests[:-1]
        segments, before, from_eighths = _segments(planned), -1, 0
        columns = np.empty((4, SEGMENTS_AT_ONCE), dtype=np.int64)
        while len(blocks) and (count := segments.fill(*columns)):
            block, eighths, tick, cycles = columns[:, :count]
            duration = eighths // tick * cycles
            duration_before = np.concatenate([[0], np.cumsum(duration)])
            is_new = np.diff(block, prepend=before) > 0
            waited = np.cumsum(np.where(is_new, waits[block], 0))
            begin = self._cycles + duration_before[:-1] + waited
            if is_new[0]:
                from_eighths = 0
            stretch = _Stretch(block, np.cumsum(eighths), tick, cycles, begin, from_eighths)
            self._cycles += int(duration_before[-1] + waited[-1])
            yield _steps_of(blocks, stretch, self._cycles)
            before = int(block[-1])
            own = block == before
            from_eighths = int(eighths[own].sum()) + (0 if is_new[own].any() else from_eighths)
        rest = int(dwelt[-1]) if len(dwelt) else 0
        if len(blocks):
            rest += self._idle * int(planned.rests[-1]) - int(dwelt_at[-1])
        self._cycles += rest
        yield in_order([Pulses.none(3)], self._cycles / CLOCK_HZ)


def _segments(planned: PlannedBlocks) -> Segments:
    """Return the stepper segments of a window of blocks."""
    count, plan = len(planned.blocks), planned.plan
    squares = (planned.squares * MIN_PER_S**2).astype(np.float32)

    def singles(values: Floats) -> np.ndarray[tuple[int], np.dtype[np.float32]]:
        return values[:count].astype(np.float32)

    return Segments(
        singles(plan.length_mm),
        singles(plan.acceleration_mm_s2 * MIN_PER_S**2),
        squares[:count],
        squares[1 : count + 1],
        singles(plan.speed_mm_s * MIN_PER_S),
        planned.blocks.events.astype(np.int32),
    )


def _steps_of(blocks: Blocks, stretch: _Stretch, end: int) -> Pulses:
    """Return the steps of a stretch. In a block of N step events, step j of an axis with n steps
    comes in the eighth ⌊4 N (2 j − 1) / n⌋ + 1 of an event: where the counter, which begins at
    half, first exceeds the whole."""
    first = np.flatnonzero(np.diff(stretch.block, prepend=-1))
    block = stretch.block[first]
    ends = stretch.ends[np.append(first[1:], len(stretch.block)) - 1]
    # Eighths in the coordinate of the stretch at which each block begins.
    bases = np.concatenate([[-stretch.from_eighths], ends[:-1]])
    low = np.maximum(-bases, 0)
    starts = np.concatenate([[0], stretch.ends[:-1]])
    events, parts = blocks.events[block].astype(np.int64), [Pulses.none(3)]
    for axis in range(3):
        steps = blocks.way[block, axis].astype(np.int64)
        size = np.abs(steps)
        steps_before = (4 * events + size * low - 1) // (8 * events)
        count = (4 * events + size * (ends - bases) - 1) // (8 * events) - steps_before
        index = np.repeat(np.arange(len(block)), count)
        number = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
        step = number + steps_before[index] + 1
        eighth = bases[index] + 4 * events[index] * (2 * step - 1) // size[index] + 1
        segment = np.searchsorted(stretch.ends, eighth)
        ticks = -(-(eighth - starts[segment]) // stretch.tick[segment])
        at = stretch.begin[segment] + ticks * stretch.cycles[segment]
        moves = np.zeros((len(index), 3), dtype=np.int64)
        moves[:, axis] = np.sign(steps[index])
        row = blocks.row[block[index]].astype(np.int64)
        parts.append(Pulses(at / CLOCK_HZ, moves, row, np.zeros(len(index), np.bool_), 0.0))
    return in_order(parts, end / CLOCK_HZ)
