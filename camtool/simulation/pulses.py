"""Pulses: when a controller moves each of its motors, in chunks.

`row_pulses` makes them from the chunks of a controller's model, whose samples are the outputs of
its loop, at the times that its clock (`camtool.simulation.timing`) gives them. Steps that the
controller adds at a reversal come before the sample that reverses, those of X first, as its own
loop issues them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import ProgramError
from camtool.simulation.motion import Chunk, Effects, Options
from camtool.simulation.rows import block_of
from camtool.simulation.timing import SampleClock
from camtool.toolpath.moves import Toolpath

OUTPUTS = Options(
    effects=Effects(play=False, scale=False, squareness=False, repeatability=False),
    chunk_steps=1 << 13,
)
"""The options of a run of which the pulses are wanted: with the steps that the controller adds,
without mechanics. A sample may mean some dozen changes of lines."""


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
        """Return an empty record for this number of motors."""
        return cls(
            np.zeros(0),
            np.zeros((0, motors), dtype=np.int64),
            np.zeros(0, dtype=np.int64),
            np.zeros(0, dtype=np.bool_),
            0.0,
        )


def row_pulses(chunks: Iterable[Chunk], clock: SampleClock, path: Toolpath) -> Iterator[Pulses]:
    """Yield the pulses of a run of `path` with the options `OUTPUTS`, chunk by chunk.
    ProgramError for an arc that never ends."""
    for chunk in chunks:
        ledger = chunk.ledger
        if not ledger.ended.all():
            raise ProgramError(
                "the controller never finds the end of this arc, so its signals have none",
                where=block_of(path, int(ledger.row[ledger.ended.argmin()])),
                mend="post it again, or choose another arc_end of the table [controller]",
            )
        times = clock.times(chunk)
        none_added = np.zeros(len(chunk.row), np.bool_)
        pulses = Pulses(times.at_s, times.moves, chunk.row, none_added, times.until_s)
        if times.added.any():
            added = _added_pulses(pulses, times.added, np.sign(times.moves), times.added_step_s)
            pulses = in_order([pulses, *added], times.until_s)
        yield pulses


def _added_pulses(pulses: Pulses, counts: Ints, signs: Ints, each_s: Floats) -> list[Pulses]:
    """Return the compensation pulses `counts` (K, 3) that come immediately before each pulse,
    those of X first, then Y, then Z."""
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
    """Return the pulses of all parts, sorted by time; those of equal time keep the order of
    `parts`."""
    at_s = np.concatenate([part.at_s for part in parts])
    order = np.argsort(at_s, kind="stable")
    return Pulses(
        at_s[order],
        np.concatenate([part.moves for part in parts])[order],
        np.concatenate([part.row for part in parts])[order],
        np.concatenate([part.is_added for part in parts])[order],
        until_s,
    )
