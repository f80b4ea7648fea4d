"""Motions whose samples are numbered from 0 and computed window by window.

`row_chunks` makes the chunks of such a motion. `PathSamples` are the samples of a toolpath along
its own lines and arcs. A line is one piece; an arc is divided where an axis reverses (right of,
above, left of and below its centre), so that X and Y are monotone in every piece. Each piece is
sampled evenly, its end included. Whatever the spacing, the ends of all moves and the reversals of
all axes are samples, so extents and reversals are exact."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable, Iterator
from functools import cached_property
from typing import Protocol

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.kernels import motion as at
from camtool.kernels.lattice import HALF_STEP_GUARD
from camtool.kernels.motion import Ways, count_steps
from camtool.machine.model import ControllerT, DialectT, Machine
from camtool.simulation.controller import ControllerModel
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import NO_SAMPLES, Chunk, Options, still_ledger
from camtool.simulation.timing import TimedChunk
from camtool.toolpath.moves import PolarArcs, Toolpath

MAX_SAMPLES = 1_000_000
"""Samples are a coded step apart, or farther where a program would have more samples than this."""

ROWS_AT_ONCE = 1 << 14

MIN_WAIT_S = 1e-3
"""A row that begins within this time after the last sample follows it without a stop: rows that a
controller joins to one move share its time by their lengths."""

SPACING_EPS = 1e-6
"""Samples may be farther apart by this part of their spacing, because of rounding."""

TURN_EPS_RAD = 1e-9
"""A reversal nearer than this to an end of its arc is that end."""

TURNS_OF_ARC = 4
"""An arc has at most this many reversals between its ends."""


class SampleSource(Protocol):
    """All samples of some rows. `first` (R+1,): row r owns samples first[r]:first[r+1]."""

    @property
    def first(self) -> Ints: ...

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return row (K,) and commanded position (K, 3) mm of the samples low:high."""

    def steps(self, bounds: Ints) -> Ints:
        """Return (R, 3) the steps of the axes within the samples bounds[r]:bounds[r+1], which must
        lie in the window of the last call."""

    def moments_s(self, low: int, high: int, rows_s: Floats) -> Floats:
        """Return (K,) s from the start of its row to each of the samples low:high; `rows_s` (R,):
        the time that each row takes."""


class SampledRows(Struct, frozen=True, eq=False):
    """The rows low:high of a program, with the time of each, `seconds` (high − low,). `samples`
    are those of the rows from `base` on, which may be more rows; `iterates`: each sample is one
    pass of the interpolator."""

    low: int
    high: int
    base: int
    samples: SampleSource
    seconds: Floats
    iterates: bool = False


def row_seconds(blocks: Iterable[SampledRows], rows: int) -> Floats:
    """Return (rows,) s that each row takes, 0 for rows after the end of the program."""
    seconds = np.zeros(rows)
    for block in blocks:
        seconds[block.low : block.high] = block.seconds
    return seconds


class SampledModel(ControllerModel[ControllerT, DialectT]):
    """A controller whose motion is given by samples of its rows."""

    @abstractmethod
    def sampled(
        self, path: Toolpath, machine: Machine[ControllerT, DialectT]
    ) -> Iterator[SampledRows]:
        """Yield the rows of a quantised path up to the end of the program; ProgramError, with the
        block, for rows that cannot be followed."""

    def mechanics(
        self, path: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> Mechanics:
        """Return the mechanics with the slides at the start of the path."""
        return Mechanics(machine, path.start, options.effects)

    def run(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> Iterator[Chunk]:
        """Yield the motion in chunks."""
        path = self.quantised(toolpath, machine)
        mechanics = self.mechanics(path, machine, options)
        return row_chunks(self.sampled(path, machine), mechanics, options.chunk_steps)

    def timed(
        self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT], options: Options
    ) -> Iterator[TimedChunk]:
        """Yield the motion with the times of its samples."""
        path = self.quantised(toolpath, machine)
        mechanics = self.mechanics(path, machine, options)
        return timed_row_chunks(self.sampled(path, machine), mechanics, options.chunk_steps)

    def seconds(self, toolpath: Toolpath, machine: Machine[ControllerT, DialectT]) -> Floats:
        """Return (N,) s that each row takes."""
        blocks = self.sampled(self.quantised(toolpath, machine), machine)
        return row_seconds(blocks, len(toolpath))


def row_chunks(
    blocks: Iterable[SampledRows], mechanics: Mechanics, chunk_steps: int
) -> Iterator[Chunk]:
    """Yield the chunks of all rows, each with at most `chunk_steps` samples; the blocks must
    follow one another. The time of a row in several chunks is divided in proportion to its
    samples."""
    for block in blocks:
        yield from _chunks(block, mechanics, chunk_steps)


def timed_row_chunks(
    blocks: Iterable[SampledRows], mechanics: Mechanics, chunk_steps: int
) -> Iterator[TimedChunk]:
    """Yield the chunks of `row_chunks` with the times of their samples."""
    clock_s, reached_s, last_row = 0.0, 0.0, -1
    for block in blocks:
        rows_s = np.concatenate([np.zeros(block.low - block.base), block.seconds])
        starts_s = clock_s + np.cumsum(rows_s) - rows_s
        number = int(block.samples.first[block.low - block.base])
        for chunk in _chunks(block, mechanics, chunk_steps):
            start_s = starts_s[chunk.row - block.base]
            high = number + len(chunk.row)
            at_s = start_s
            if len(chunk.row):
                at_s = start_s + block.samples.moments_s(number, high, rows_s)
                at_s = np.maximum.accumulate(np.maximum(at_s, reached_s))
            begin_s = np.concatenate([[reached_s], at_s])[:-1]
            waited = np.flatnonzero(np.diff(chunk.row, prepend=last_row))
            waited = waited[(start_s - begin_s)[waited] > MIN_WAIT_S]
            begin_s[waited] = np.minimum(start_s[waited], at_s[waited])
            last_row = int(chunk.row[-1]) if len(chunk.row) else last_row
            yield TimedChunk(chunk, at_s, begin_s, at_s)
            number, reached_s = high, float(at_s[-1]) if len(at_s) else reached_s
        clock_s += float(block.seconds.sum())


def _chunks(block: SampledRows, mechanics: Mechanics, chunk_steps: int) -> Iterator[Chunk]:
    first = block.samples.first[block.low - block.base : block.high - block.base + 1]
    rows, end = len(first) - 1, int(first[-1])
    done_rows = 0  # rows whose ledger is complete
    for low in range(int(first[0]), end, chunk_steps):
        high = min(low + chunk_steps, end)
        row, commanded = block.samples.window(low, high)
        row += block.base - block.low
        last = int(row[-1])
        complete = rows if high == end else last + int(high == first[last + 1])
        listed = np.arange(done_rows, max(complete, last + 1))
        offsets = np.concatenate([[0], np.flatnonzero(np.diff(row)) + 1, [len(row)]])
        ledger = still_ledger(block.low + listed)
        moving_rows = row[offsets[:-1]] - done_rows
        slide, ledger.reversals[moving_rows] = mechanics.follow(commanded, offsets)
        ledger.steps[moving_rows] = block.samples.steps(low + offsets)
        counts = np.zeros(len(listed), dtype=np.int64)
        counts[moving_rows] = np.diff(offsets)
        own_samples = (first[1:] - first[:-1])[listed]
        ledger.duration_s[:] = block.seconds[listed] * np.where(
            own_samples > 0, counts / np.maximum(own_samples, 1), 1.0
        )
        if block.iterates:
            ledger.iterations[:] = counts
        yield Chunk(block.low + row, commanded, slide, ledger)
        done_rows = complete
    if done_rows < rows:
        ledger = still_ledger(np.arange(block.low, block.high))
        ledger.duration_s[:] = block.seconds
        yield Chunk(np.empty(0, np.int64), NO_SAMPLES, NO_SAMPLES, ledger)


def sample_spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """Return the distance of samples, mm: the finer coded step of X and Y, or more so that there
    are at most `MAX_SAMPLES`."""
    return spacing_along(move_lengths(toolpath), machine)


def spacing_along(length_mm: Floats, machine: Machine) -> float:
    """Return the distance of samples for rows of these lengths (N,), mm: the finer coded step of X
    and Y, or more so that there are at most `MAX_SAMPLES`."""
    step = min(machine.axes.x.coded_step_mm, machine.axes.y.coded_step_mm)
    return max(step, float(length_mm.sum()) / MAX_SAMPLES)


def move_lengths(toolpath: Toolpath) -> Floats:
    """Return (N,) mm: length of each row in space, 0 for events."""
    return toolpath.by_parts(_lengths)


def _lengths(part: Toolpath) -> Floats:
    travel = np.diff(part.end, axis=0, prepend=part.start[None, :])
    length = np.linalg.norm(travel, axis=1)
    arms = PolarArcs(part, part.is_arc)
    rise = arms.end[:, 2] - arms.begin[:, 2]
    radius = 0.5 * (arms.radius + arms.end_radius)
    length[arms.row] = np.hypot(radius * arms.sweep, rise)
    return np.asarray(length)


class _Pieces(Struct, frozen=True, eq=False, dict=True):
    """Pieces of rows: from `begin` (P,) to `end` (P,), as shares of the length of `row` (P,)."""

    row: Ints
    begin: Floats
    end: Floats

    @cached_property
    def divide(self) -> Bools:
        """(P,) true for pieces that are not all of their row."""
        return np.asarray((self.begin != 0.0) | (self.end != 1.0))


class PathSamples:
    """The samples of all rows of a toolpath, numbered from 0 in order; none are stored."""

    def __init__(self, toolpath: Toolpath, spacing_mm: float) -> None:
        """Divide all rows into pieces, sampled no farther apart than `spacing_mm` along the
        path."""
        arms = PolarArcs(toolpath, toolpath.is_arc)
        self._ways = ways_of(toolpath, arms)
        length = move_lengths(toolpath)
        self._pieces = _pieces_of_rows(length, arms)
        pieces = self._pieces
        of_piece = length[pieces.row] * (pieces.end - pieces.begin)
        self._parts = np.maximum(np.ceil(of_piece / spacing_mm - SPACING_EPS), 1.0).astype(
            np.int64
        )
        self._offsets = np.concatenate([[0], np.cumsum(self._parts)])
        self.first = self._offsets[np.searchsorted(pieces.row, np.arange(len(toolpath) + 1))]
        """(N+1,) row r owns samples first[r]:first[r+1]; its start is not one of them."""

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return row (K,) and position (K, 3) mm of the samples low:high."""
        row, share = self.places(low, high)
        return row, self.points(row, share)

    def places(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return for each of the samples low:high its row (K,) and its position as a share (K,) of
        the row's length, in (0, 1]."""
        first = int(np.searchsorted(self._offsets, low, side="right")) - 1
        pieces = slice(first, int(np.searchsorted(self._offsets, high)))
        sample_counts = np.diff(np.clip(self._offsets[pieces.start : pieces.stop + 1], low, high))
        parts = np.repeat(self._parts[pieces], sample_counts)
        part = np.arange(low + 1, high + 1) - np.repeat(self._offsets[pieces], sample_counts)
        share = part / parts
        of_arc = np.flatnonzero(np.repeat(self._pieces.divide[pieces], sample_counts))
        if len(of_arc):
            piece = np.repeat(np.arange(pieces.start, pieces.stop), sample_counts)[of_arc]
            begin, end = self._pieces.begin[piece], self._pieces.end[piece]
            last = part[of_arc] == parts[of_arc]
            share[of_arc] = np.where(last, end, begin + (end - begin) * share[of_arc])
        return np.repeat(self._pieces.row[pieces], sample_counts), share

    def moments_s(self, low: int, high: int, rows_s: Floats) -> Floats:
        """Return (K,) s from the start of its row to each of the samples low:high, at constant
        speed along the row."""
        row, share = self.places(low, high)
        return np.asarray(share * rows_s[row])

    def points(self, row: Ints, share: Floats) -> Floats:
        """Return (K, 3) mm: the points at shares (K,) of the lengths of rows (K,)."""
        points = np.empty((len(row), 3))
        self._ways.fill(row, share, points)
        return points


def ways_of(toolpath: Toolpath, arms: PolarArcs) -> Ways:
    """Return all rows of a toolpath, with its arcs, in the form that the compiled loops read
    (Ways)."""
    table = np.empty((len(arms.row), at.ARM_COLUMNS))
    table[:, [at.CENTRE_X, at.CENTRE_Y]] = arms.centre
    table[:, at.RADIUS], table[:, at.GROWTH] = arms.radius, arms.end_radius - arms.radius
    table[:, at.ANGLE], table[:, at.SWEEP] = arms.angle, arms.sweep
    table[:, at.Z], table[:, at.RISE] = arms.begin[:, 2], arms.end[:, 2] - arms.begin[:, 2]
    arm = np.full(len(toolpath), -1, dtype=np.int32)
    arm[arms.row] = np.arange(len(arms.row))
    return Ways(toolpath.start, np.ascontiguousarray(toolpath.end), arm, table)


class CountedSamples(PathSamples):
    """The samples of PathSamples, with the steps of each axis between them: the changes of its
    nearest whole step."""

    def __init__(self, toolpath: Toolpath, machine: Machine, spacing_mm: float) -> None:
        super().__init__(toolpath, spacing_mm)
        self._step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
        self._start = toolpath.start[None, :]
        self._counts = np.zeros((1, 3), dtype=np.int64)
        self._low = 0

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return row and position of the samples low:high."""
        row, points = super().window(max(low - 1, 0), high)
        every = np.concatenate([self._start, points]) if low == 0 else points
        self._low, self._counts = low, np.empty(every.shape, dtype=np.int64)
        count_steps(every, self._step_mm, HALF_STEP_GUARD, self._counts)
        return (row, points) if low == 0 else (row[1:], points[1:])

    def steps(self, bounds: Ints) -> Ints:
        """Return (R, 3) steps of the axes within samples bounds[r]:bounds[r+1] of the last
        window."""
        return np.diff(self._counts[bounds - self._low], axis=0)


def _pieces_of_rows(length: Floats, arms: PolarArcs) -> _Pieces:
    """Return all pieces in order: one for each straight row with motion, one or more for each
    arc."""
    straight = length > 0.0
    straight[arms.row] = False
    rows = np.flatnonzero(straight)
    lines = _Pieces(rows, np.zeros(len(rows)), np.ones(len(rows)))
    arcs = _arc_pieces(arms)
    row = np.concatenate([lines.row, arcs.row])
    order = np.argsort(row, kind="stable")
    return _Pieces(
        row[order],
        np.concatenate([lines.begin, arcs.begin])[order],
        np.concatenate([lines.end, arcs.end])[order],
    )


def _arc_pieces(arms: PolarArcs) -> _Pieces:
    """Return the arcs divided where an axis reverses.

    These places lie at angles k·π/2. In the direction of the arc (σ = ±1) from its start at σ·a,
    the next ones are k = ⌊σa/(π/2)⌋ + 1, + 2, ..."""
    quarter = 0.5 * np.pi
    progress = np.sign(arms.sweep) * arms.angle
    next_turn = np.floor(progress / quarter)[:, None] + np.arange(1, TURNS_OF_ARC + 1)
    turn = next_turn * quarter - progress[:, None]
    sweep = np.abs(arms.sweep)[:, None]
    inside = (turn > TURN_EPS_RAD) & (turn < sweep - TURN_EPS_RAD)
    ends = np.ones((len(sweep), 1), dtype=np.bool_)
    has_place = np.concatenate([ends, inside, ends], axis=1)
    bounds = np.concatenate([0.0 * sweep, turn / sweep, sweep / sweep], axis=1)
    owners, _ = np.nonzero(has_place)
    bound = bounds[has_place]
    inner = np.flatnonzero(np.diff(owners) == 0)
    return _Pieces(arms.row[owners[inner]], bound[inner], bound[inner + 1])
