"""The motion of controllers whose moves are sequences of straight legs of whole steps.

    legs of a program, block by block ─legs_fill─▶ commanded ─Mechanics─▶ slides, in chunks

A sample is the position after one pass of the controller's loop, which moves at least one axis.
Memory grows with the legs that are given at a time, not with their steps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.kernels.motion import legs_fill
from camtool.machine.model import Machine
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Ledger, Options, still_ledger
from camtool.simulation.rows import refuse
from camtool.simulation.step_lines import LineRows, LineRun
from camtool.toolpath.moves import Kind, Toolpath


class Legs(Struct, frozen=True, eq=False):
    """L straight legs, each of which starts where the one before ends: `row` (L,) of the toolpath,
    ascending; `steps` (L, 3) of the axes with sign, not all 0; `seconds` (L,)."""

    row: Ints
    steps: Ints
    seconds: Floats


class LegProgram(Struct, frozen=True, eq=False):
    """Data of all R rows up to the end of the program: `start` (3,), steps; `waits` (R,), s, of
    rows without motion; `compensation_s`, the time of each step added at a reversal."""

    start: Ints
    waits: Floats
    compensation_s: float


_NO_STEPS = np.zeros((0, 3), dtype=np.int64)


class LegRun:
    """The motion of legs on a machine."""

    def __init__(self, program: LegProgram, machine: Machine, options: Options) -> None:
        self._standing, self._position = program, program.start
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._mechanics = Mechanics(machine, program.start * self._step_mm, options.effects)
        self._chunk_steps = options.chunk_steps
        self._row = -1  # the last row in a ledger

    def run(self, blocks: Iterable[Legs]) -> Iterator[Chunk]:
        """Yield the motion in chunks; every row is in the ledger of at least one chunk."""
        for legs in blocks:
            yield from self._block(legs)
        rows = np.arange(self._row + 1, len(self._standing.waits))
        if len(rows):
            ledger = self._still(rows)
            yield Chunk(np.empty(0, dtype=np.int64), NO_SAMPLES, NO_SAMPLES, ledger)

    def fused_run(self, blocks: Iterator[Legs]) -> LineRun | None:
        """Return all legs as lines that are judged in closed form, without chunks; None where
        backlash differs from place to place or scatters."""
        if not self._mechanics.even:
            return None
        standing = self._standing
        return LineRun(
            self._lines(blocks),
            len(standing.waits),
            self._step_mm,
            self._mechanics,
            rounds=False,
            compensation_s=standing.compensation_s,
        )

    def _lines(self, blocks: Iterator[Legs]) -> Iterator[LineRows]:
        """Yield the legs as lines in groups of whole rows; the last row of a block may continue in
        the next one."""
        low, pending = 0, Legs(_NO_STEPS[:, 0], _NO_STEPS, np.zeros(0))
        for legs in blocks:
            row = np.concatenate([pending.row, legs.row])
            steps = np.concatenate([pending.steps, legs.steps])
            seconds = np.concatenate([pending.seconds, legs.seconds])
            high = int(row[-1]) if len(row) else low
            count = int(np.searchsorted(row, high))
            yield self._line_rows(low, high, Legs(row[:count], steps[:count], seconds[:count]))
            low, pending = high, Legs(row[count:], steps[count:], seconds[count:])
        yield self._line_rows(low, len(self._standing.waits), pending)

    def _line_rows(self, low: int, high: int, legs: Legs) -> LineRows:
        start = self._position + np.cumsum(legs.steps, axis=0) - legs.steps
        self._position = self._position + legs.steps.sum(axis=0)
        seconds = self._standing.waits[low:high].copy()
        moving = legs.row - low
        seconds[moving] = 0.0
        np.add.at(seconds, moving, legs.seconds)
        return LineRows(low, high, seconds, legs.row, start, np.ascontiguousarray(legs.steps))

    def _still(self, rows: Ints) -> Ledger:
        """Return a ledger for rows without motion: only their waits."""
        ledger = still_ledger(rows)
        ledger.duration_s[:] = self._standing.waits[rows]
        return ledger

    def _block(self, legs: Legs) -> Iterator[Chunk]:
        first = np.concatenate([[0], np.cumsum(np.abs(legs.steps).max(axis=1, initial=0))])
        begin = self._position + np.cumsum(legs.steps, axis=0) - legs.steps
        for low in range(0, int(first[-1]), self._chunk_steps):
            high = min(low + self._chunk_steps, int(first[-1]))
            share, commanded = _Share(first, low, high), np.empty((high - low, 3))
            begins, steps = begin[share.legs], legs.steps[share.legs]
            legs_fill(share.done, begins, steps, self._step_mm, commanded)
            yield self._chunk(legs, share, commanded)
        self._position = self._position + legs.steps.sum(axis=0)

    def _chunk(self, legs: Legs, share: _Share, commanded: Floats) -> Chunk:
        """Return the chunk of a window: its samples, and the ledger of its rows."""
        leg_row = legs.row[share.legs]
        turn = np.flatnonzero(np.diff(leg_row, prepend=-1))
        moving = leg_row[turn]
        offsets = np.append(np.cumsum(share.passes)[turn] - share.passes[turn], len(commanded))
        slide, reversals = self._mechanics.follow(commanded, offsets)
        rows = np.arange(self._row + (0 if moving[0] == self._row else 1), moving[-1] + 1)
        self._row = int(moving[-1])
        ledger = self._still(rows)
        positions = moving - rows[0]
        added = reversals @ self._mechanics.compensation_steps * self._standing.compensation_s
        ledger.compensation_s[positions] = added
        ledger.duration_s[positions] = np.add.reduceat(share.part(legs.seconds), turn) + added
        ledger.iterations[positions] = np.diff(offsets)
        ledger.steps[positions] = np.add.reduceat(share.steps(legs.steps), turn, axis=0)
        ledger.reversals[positions] = reversals
        return Chunk(np.repeat(moving, np.diff(offsets)), commanded, slide, ledger)


class _Share:
    """The part of each leg within the window low:high of all passes."""

    def __init__(self, first: Ints, low: int, high: int) -> None:
        begin = int(np.searchsorted(first, low, side="right")) - 1
        end = int(np.searchsorted(first, high, side="left"))
        self.legs = slice(begin, end)
        edges = first[begin : end + 1]
        self._whole = np.diff(edges)
        self._from = np.maximum(low - edges[:-1], 0)
        self._to = np.minimum(high - edges[:-1], self._whole)
        self.done = int(self._from[0])
        """Passes of the first leg before the window."""
        self.passes: Ints = self._to - self._from
        """(J,) passes of each leg within the window."""

    def part(self, seconds: Floats) -> Floats:
        """Return the seconds (J,) of each leg that fall within the window, given those of all legs
        (L,)."""
        return np.asarray(seconds[self.legs] * (self.passes / self._whole))

    def steps(self, steps: Ints) -> Ints:
        """Return the steps (J, 3) of each leg within the window, given those of all legs
        (L, 3)."""
        size, leg_sizes = np.abs(steps[self.legs]), self._whole[:, None]
        return np.asarray(
            self._to[:, None] * size // leg_sizes - self._from[:, None] * size // leg_sizes
        )


# Checks of the rows of a toolpath for controllers that count whole steps.

MAX_STEPS = 1 << 30
"""Positions beyond this many steps (43 km at 40 µm) are refused: a step of one axis times a step
of another must fit 64 bits."""


def coded_steps_mm(machine: Machine) -> Floats:
    """Return (3,) mm: the coded step of each axis, which the controller assumes."""
    return np.array([axis.coded_step_mm for axis in machine.axes])


def check_rows(toolpath: Toolpath, machine: Machine) -> None:
    """Raise ProgramError, with the block, for rows that a controller without homing cannot
    follow."""
    kind, step_mm = toolpath.kind, coded_steps_mm(machine)
    with np.errstate(invalid="ignore"):
        endless = (kind == Kind.DWELL) & ~((toolpath.value >= 0.0) & np.isfinite(toolpath.value))
    for is_bad, message, mend in (
        (
            toolpath.by_parts(
                lambda part: np.asarray((np.abs(part.end) > MAX_STEPS * step_mm).any(axis=1))
            ),
            "a position is beyond all that the controller can count",
            "",
        ),
        (
            np.isin(kind, (Kind.HOME_XY, Kind.HOME_Z)),
            "this controller cannot return to machine zero",
            "move there",
        ),
        (endless, "a dwell without its seconds", ""),
        (
            (kind == Kind.SET_ZERO) & toolpath.end.any(axis=1),
            "part zero is set away from part zero",
            "set it once, before any move",
        ),
        (
            toolpath.by_parts(
                lambda part: ~part.is_motion & (part.end != part.starts).any(axis=1)
            ),
            "an event that moves the tool",
            "",
        ),
    ):
        refuse(toolpath, np.asarray(is_bad)[: toolpath.executed_rows], message, mend)


def waits_s(toolpath: Toolpath, rows: int) -> Floats:
    """Return (rows,) s: the dwell of each row. Without dwells it is a single 0 broadcast to all
    rows."""
    dwells = toolpath.kind[:rows] == Kind.DWELL
    if not dwells.any():
        return np.broadcast_to(0.0, rows)
    return np.where(dwells, toolpath.value[:rows], 0.0)
