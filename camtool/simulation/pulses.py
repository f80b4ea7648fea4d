"""Pulses: when a controller moves each of its motors, in chunks.

`row_pulses` makes them from the chunks of a controller's model, whose samples are the outputs of
its loop: each sample begins the time that the loop then waits. Steps that the controller adds at
a reversal come before the sample that reverses, those of X first, as its own loop issues them.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import ProgramError
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.simulation.motion import Chunk, Effects, Ledger, Options
from camtool.simulation.rows import block_of
from camtool.toolpath.moves import Toolpath

OUTPUTS = Options(
    effects=Effects(play=False, scale=False, squareness=False, repeatability=False),
    chunk_steps=1 << 13,
)
"""The options of a run whose pulses are wanted: steps that the controller adds, no mechanics; a
sample may be some dozen changes of lines."""


class Pulses(Struct, frozen=True, eq=False):
    """K pulses in order of time: `at_s` (K,) from the start of the program, `moves` (K, M) how far
    each then moves the M motors (X, Y, Z, further ones), in steps or in states of their coils;
    `row` (K,) of the toolpath; `is_added` (K,) true for those that compensate backlash.

    `until_s`: all pulses that follow come then or later; of the last ones, the end of the program.
    """

    at_s: Floats
    moves: Ints
    row: Ints
    is_added: Bools
    until_s: float

    def part(self, low: int, high: int) -> Pulses:
        """Return the pulses low:high."""
        rows = slice(low, high)
        return Pulses(
            self.at_s[rows], self.moves[rows], self.row[rows], self.is_added[rows], self.until_s
        )

    @classmethod
    def none(cls, motors: int) -> Pulses:
        """Return no pulses of so many motors."""
        return cls(
            np.zeros(0),
            np.zeros((0, motors), dtype=np.int64),
            np.zeros(0, dtype=np.int64),
            np.zeros(0, dtype=np.bool_),
            0.0,
        )


Waits = Callable[[Ints, Ints], tuple[Floats, Floats]]
"""Rows (K,) and numbers (K,) of samples within their rows → s (K,) before each sample, and s (K,)
from it to the end of its pass."""


def row_pulses(
    chunks: Iterable[Chunk],
    path: Toolpath,
    machine: Machine,
    waits: Waits | None = None,
    added: Ints | None = None,
) -> Iterator[Pulses]:
    """Yield the pulses of a run with the options `OUTPUTS`, chunk by chunk. `path` is the
    toolpath as the controller rounds it. Without `waits` the samples of a row within a chunk share
    its time equally. `added` (N, 3): the steps that the controller adds at a reversal in each row;
    None: those of the machine. ProgramError for an arc that never ends."""
    if added is None:
        of_axes = [to_steps(axis.compensation_mm, axis.coded_step_mm) for axis in machine.axes]
        added = np.broadcast_to(np.array(of_axes), (len(path), 3))
    run = _RowRun(path, machine, waits, added)
    for chunk in chunks:
        yield run.pulses(chunk)


class _RowRun:
    """State of a run: where the motors are, in which direction they moved last, and the time."""

    def __init__(self, path: Toolpath, machine: Machine, waits: Waits | None, added: Ints) -> None:
        self._path, self._waits, self._added = path, waits, added
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._position = np.rint(path.start / self._step_mm).astype(np.int64)
        self._sense = np.full(3, 1 if machine.controller.start_direction == "+" else -1)
        self._row, self._done = -1, 0
        """The last row with samples, and how many it has had."""
        self._clock_s = 0.0

    def pulses(self, chunk: Chunk) -> Pulses:
        """Return the pulses of the next chunk."""
        ledger, row = chunk.ledger, chunk.row
        if not ledger.ended.all():
            raise ProgramError(
                "the controller never finds the end of this arc, so its signals have none",
                where=block_of(self._path, int(ledger.row[ledger.ended.argmin()])),
                mend="post it again, or choose another arc_end of the table [controller]",
            )
        steps = np.rint(chunk.commanded / self._step_mm).astype(np.int64)
        moves = np.diff(steps, axis=0, prepend=self._position[None, :])
        turns, self._sense = reversals_of(moves, self._sense)
        if len(steps):
            self._position = steps[-1]
        position = row - ledger.row[0] if len(row) else row
        begin_s, before_s, added_s, end_s = self._times(ledger, row, position)
        counts = turns * self._added[row]
        each_s = added_s[position]
        first_s = begin_s + before_s
        if counts.any():
            waited = np.cumsum(counts.sum(axis=1) * each_s)
            first_s, end_s = first_s + waited, end_s + float(waited[-1])
            parts = [Pulses(first_s, moves, row, np.zeros(len(row), np.bool_), end_s)]
            parts += _added_pulses(parts[0], counts, np.sign(moves), each_s)
            pulses = in_order(parts, end_s)
        else:
            pulses = Pulses(first_s, moves, row, np.zeros(len(row), np.bool_), end_s)
        self._clock_s = end_s
        return pulses

    def _times(
        self, ledger: Ledger, row: Ints, position: Ints
    ) -> tuple[Floats, Floats, Floats, float]:
        """Begin (K,) of the passes of all samples without added steps, s from there to the sample
        (K,), s (R,) that an added step takes, and the end of the chunk without them."""
        net_s = ledger.duration_s - ledger.compensation_s
        added = (ledger.reversals * self._added[ledger.row]).sum(axis=1)
        each_s = ledger.compensation_s / np.maximum(added, 1)
        samples = np.bincount(position, minlength=len(ledger.row))
        begin_s = self._clock_s + np.cumsum(net_s) - net_s
        number = np.arange(len(row)) - (np.cumsum(samples) - samples)[position]
        if self._waits is None:
            period_s = (net_s / np.maximum(samples, 1))[position]
            starts_s, before_s = begin_s[position] + number * period_s, np.zeros(len(row))
            return starts_s, before_s, each_s, self._clock_s + float(net_s.sum())
        done = np.where(row == self._row, self._done, 0)
        before_s, after_s = self._waits(row, number + done)
        own_s = before_s + after_s
        total_s = np.bincount(position, own_s, minlength=len(ledger.row))
        standing_s = np.where(samples > 0, total_s, net_s)
        begin_s = self._clock_s + np.cumsum(standing_s) - standing_s
        within_s = np.cumsum(own_s) - own_s
        within_s -= np.repeat(within_s[np.flatnonzero(number == 0)], samples[samples > 0])
        if len(row):
            last = int(row[-1])
            self._done = int((number + done)[-1]) + 1
            self._row = last
        return (
            begin_s[position] + within_s,
            before_s,
            each_s,
            self._clock_s + float(standing_s.sum()),
        )


def reversals_of(moves: Ints, sense: Ints) -> tuple[Bools, Ints]:
    """Return the mask (K, M) of the moves (K, M) of motors that go the other way than those before
    them, and the directions (M,) ±1 of the last ones; `sense` (M,): the directions before."""
    turns = np.zeros(moves.shape, dtype=np.bool_)
    last = sense.copy()
    for motor in range(moves.shape[1]):
        moving = np.flatnonzero(moves[:, motor])
        signs = np.sign(moves[moving, motor])
        turns[moving, motor] = np.diff(signs, prepend=sense[motor]) != 0
        if len(signs):
            last[motor] = signs[-1]
    return turns, last


def _added_pulses(pulses: Pulses, counts: Ints, signs: Ints, each_s: Floats) -> list[Pulses]:
    """The `counts` (K, 3) steps that come right before each pulse, of X, then Y, then Z."""
    parts = []
    remaining = counts.sum(axis=1)
    for motor in range(counts.shape[1]):
        index = np.repeat(np.arange(len(counts)), counts[:, motor])
        number = np.arange(len(index)) - np.repeat(
            np.cumsum(counts[:, motor]) - counts[:, motor], counts[:, motor]
        )
        moves = np.zeros((len(index), counts.shape[1]), dtype=np.int64)
        moves[:, motor] = signs[index, motor]
        at_s = pulses.at_s[index] - (remaining[index] - number) * each_s[index]
        parts.append(
            Pulses(at_s, moves, pulses.row[index], np.ones(len(index), np.bool_), pulses.until_s)
        )
        remaining = remaining - counts[:, motor]
    return parts


def in_order(parts: list[Pulses], until_s: float) -> Pulses:
    """Concatenate pulses and sort them by time; those of equal time keep the order of `parts`."""
    at_s = np.concatenate([part.at_s for part in parts])
    order = np.argsort(at_s, kind="stable")
    return Pulses(
        at_s[order],
        np.concatenate([part.moves for part in parts])[order],
        np.concatenate([part.row for part in parts])[order],
        np.concatenate([part.is_added for part in parts])[order],
        until_s,
    )
