"""Times of samples: when the controller reaches each sample of its motion.

A controller's loop either outputs a step and then waits (`SampleClock`), or its samples lie on a
planned profile and are reached at the end of their time (`camtool.simulation.samples`)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.simulation.motion import Chunk, Ledger
from camtool.toolpath.moves import Toolpath


class TimedChunk(Struct, frozen=True, eq=False):
    """The samples (K,) of a chunk with times from the start of the program, s. A sample is reached
    at `at_s` and stands for the motion from `begin_s` to `end_s`; `at_s` equals one of these two.
    """

    chunk: Chunk
    at_s: Floats
    begin_s: Floats
    end_s: Floats


Waits = Callable[[Ints, Ints], tuple[Floats, Floats]]
"""The function from rows (K,) and numbers (K,) of samples within their rows to the times (K,), s,
before each sample and from it to the end of its pass."""


class SampleTimes(Struct, frozen=True, eq=False):
    """Times of the K samples of a chunk: `at_s` (K,) of the outputs, from the start of the
    program, and `wait_s` (K,) from each to the end of its pass; `moves` (K, 3) steps of the axes;
    `added` (K, 3) steps that the controller adds right before a sample, each of which takes
    `added_step_s` (K,); `until_s`, the end of the chunk."""

    at_s: Floats
    wait_s: Floats
    moves: Ints
    added: Ints
    added_step_s: Floats
    until_s: float


class SampleClock:
    """Clock of a controller that outputs a step and then waits: where the motors are, in which
    direction they moved last, and the time."""

    def __init__(
        self,
        path: Toolpath,
        machine: Machine,
        waits: Waits | None = None,
        added: Ints | None = None,
    ) -> None:
        """Start the clock at the beginning of `path`, the toolpath as the controller rounds it.
        Without `waits` the samples of a row within a chunk share its time equally. `added` (N, 3):
        the steps that the controller adds at a reversal in each row; None: those of the machine.
        """
        if added is None:
            of_axes = [to_steps(axis.compensation_mm, axis.coded_step_mm) for axis in machine.axes]
            added = np.broadcast_to(np.array(of_axes), (len(path), 3))
        self._waits, self._added = waits, added
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._position = np.rint(path.start / self._step_mm).astype(np.int64)
        self._sense = np.full(3, 1 if machine.controller.start_direction == "+" else -1)
        self._row, self._done = -1, 0
        """The last row with samples, and how many it has had."""
        self._clock_s = 0.0

    def timed(self, chunk: Chunk) -> TimedChunk:
        """Return the next chunk with its times."""
        times = self.times(chunk)
        return TimedChunk(chunk, times.at_s, times.at_s, times.at_s + times.wait_s)

    def times(self, chunk: Chunk) -> SampleTimes:
        """Return the times of the next chunk."""
        ledger, row = chunk.ledger, chunk.row
        steps = np.rint(chunk.commanded / self._step_mm).astype(np.int64)
        moves = np.diff(steps, axis=0, prepend=self._position[None, :])
        turns, self._sense = reversals_of(moves, self._sense)
        if len(steps):
            self._position = steps[-1]
        position = row - ledger.row[0] if len(row) else row
        begin_s, before_s, wait_s, added_s, end_s = self._passes(ledger, row, position)
        counts = turns * self._added[row]
        each_s = added_s[position]
        at_s = begin_s + before_s
        if counts.any():
            waited = np.cumsum(counts.sum(axis=1) * each_s)
            at_s, end_s = at_s + waited, end_s + float(waited[-1])
        self._clock_s = end_s
        return SampleTimes(at_s, wait_s, moves, counts, each_s, end_s)

    def _passes(
        self, ledger: Ledger, row: Ints, position: Ints
    ) -> tuple[Floats, Floats, Floats, Floats, float]:
        """Return the times (s) of the interpolator's passes: their begins (K,) without added
        steps, from there to the sample (K,), from the sample to the end of its pass (K,), the time
        of one added step in each row (R,), and the end of the chunk without added steps."""
        net_s = ledger.duration_s - ledger.compensation_s
        added = (ledger.reversals * self._added[ledger.row]).sum(axis=1)
        each_s = ledger.compensation_s / np.maximum(added, 1)
        samples = np.bincount(position, minlength=len(ledger.row))
        begin_s = self._clock_s + np.cumsum(net_s) - net_s
        number = np.arange(len(row)) - (np.cumsum(samples) - samples)[position]
        if self._waits is None:
            period_s = (net_s / np.maximum(samples, 1))[position]
            starts_s, before_s = begin_s[position] + number * period_s, np.zeros(len(row))
            return starts_s, before_s, period_s, each_s, self._clock_s + float(net_s.sum())
        passes_before = np.where(row == self._row, self._done, 0)
        before_s, after_s = self._waits(row, number + passes_before)
        own_s = before_s + after_s
        total_s = np.bincount(position, own_s, minlength=len(ledger.row))
        standing_s = np.where(samples > 0, total_s, net_s)
        begin_s = self._clock_s + np.cumsum(standing_s) - standing_s
        within_s = np.cumsum(own_s) - own_s
        within_s -= np.repeat(within_s[np.flatnonzero(number == 0)], samples[samples > 0])
        if len(row):
            last = int(row[-1])
            self._done = int((number + passes_before)[-1]) + 1
            self._row = last
        return (
            begin_s[position] + within_s,
            before_s,
            after_s,
            each_s,
            self._clock_s + float(standing_s.sum()),
        )


def reversals_of(moves: Ints, sense: Ints) -> tuple[Bools, Ints]:
    """Return the mask (K, M) of the moves of M motors that reverse against the move before, and
    the last directions (M,) ±1; `sense` (M,): the directions before the first move."""
    turns = np.zeros(moves.shape, dtype=np.bool_)
    last = sense.copy()
    for motor in range(moves.shape[1]):
        moving = np.flatnonzero(moves[:, motor])
        signs = np.sign(moves[moving, motor])
        turns[moving, motor] = np.diff(signs, prepend=sense[motor]) != 0
        if len(signs):
            last[motor] = signs[-1]
    return turns, last
