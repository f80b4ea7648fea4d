"""What the models of timed planners share: chords in place of arcs, samples, and trapezoids.

A timed planner says how fast each of its moves may be, and how it meets the next one. The slides
follow its moves, rounded to the nearest steps; acceleration changes times, not places."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.kernels.lattice import to_steps
from camtool.machine.model import Machine
from camtool.simulation.controller import ControllerModel
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Chunk, Options
from camtool.simulation.rows import check_rows
from camtool.simulation.samples import (
    ROWS_AT_ONCE,
    CountedSamples,
    SampledRows,
    row_chunks,
    row_seconds,
    sample_spacing_mm,
)
from camtool.simulation.speed_plan import SpeedPlan
from camtool.toolpath.moves import Kind, Toolpath, read_only

_Machine = Machine[Any, Any]

MIN_MOVE_MM = 1e-9
"""Shorter moves are none (`Move.__init__` of Klipper's toolhead.py)."""


class PlannedMoves(Struct, frozen=True, eq=False):
    """The moves of a planner, M rows of a toolpath: `row` (M,) of the program that each is a part
    of; the speeds `entry`, `peak` and `exit` (M,) mm/s, `acceleration` (M,) mm/s² and `length`
    (M,) mm, which is 0 where nothing moves. `extra_s` (M,): time that a move takes in addition to
    its ramps; None if there is none."""

    path: Toolpath
    row: Ints
    length: Floats
    acceleration: Floats
    entry: Floats
    peak: Floats
    exit: Floats
    extra_s: Floats | None = None

    def ramps_s(self) -> Floats:
        """Return (3, M) seconds that each move accelerates, cruises and brakes."""
        moves = self.length > 0.0
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            first = (self.peak - self.entry) / self.acceleration
            last = (self.peak - self.exit) / self.acceleration
            ramps_mm = 0.5 * (first * (self.peak + self.entry) + last * (self.peak + self.exit))
            steady = np.maximum(self.length - ramps_mm, 0.0) / self.peak
        return np.where(moves, [first, steady, last], 0.0)

    def seconds(self) -> Floats:
        """Return (M,) seconds that each move takes."""
        seconds = np.asarray(self.ramps_s().sum(axis=0))
        return seconds if self.extra_s is None else seconds + self.extra_s


class TimedModel(ControllerModel[Any, Any]):
    """Model of a planner that gives times."""

    @abstractmethod
    def planned(self, path: Toolpath, machine: _Machine) -> PlannedMoves:
        """Return the moves of a program up to its end, in order, with their speeds."""

    def run(self, toolpath: Toolpath, machine: _Machine, options: Options) -> Iterator[Chunk]:
        """Yield the motion in chunks; ProgramError, which names the block, for rows that cannot be
        followed."""
        path = self._to_end(toolpath, machine)
        mechanics = Mechanics(machine, path.start, options.effects)
        return row_chunks(self._sampled(path, machine), mechanics, options.chunk_steps)

    def seconds(self, toolpath: Toolpath, machine: _Machine) -> Floats:
        """Return (N,) seconds that each row takes."""
        blocks = self._sampled(self._to_end(toolpath, machine), machine)
        return row_seconds(blocks, len(toolpath))

    def spacing_mm(self, toolpath: Toolpath, machine: _Machine) -> float:
        """Return the distance between samples, mm: a coded step, or more where the program would
        have too many samples."""
        return sample_spacing_mm(toolpath, machine)

    def interpolation(self, toolpath: Toolpath, machine: _Machine, options: Options) -> str:
        """Return "chords": lines in place of arcs."""
        return "chords"

    def _to_end(self, toolpath: Toolpath, machine: _Machine) -> Toolpath:
        path = self.quantised(toolpath, machine)
        check_rows(path, path.executed_rows)
        return path.first(path.executed_rows)

    def _sampled(self, path: Toolpath, machine: _Machine) -> Iterator[SampledRows]:
        moves = self.planned(path, machine)
        seconds = np.where(path.kind == Kind.DWELL, path.value, 0.0)
        np.add.at(seconds, moves.row, moves.seconds())
        spacing_mm = sample_spacing_mm(path, machine)
        for low in range(0, len(path), ROWS_AT_ONCE):
            high = min(low + ROWS_AT_ONCE, len(path))
            first, last = np.searchsorted(moves.row, [low, high]).tolist()
            samples = MoveSamples(
                moves.path.part(first, last),
                moves.row[first:last] - low,
                high - low,
                machine,
                spacing_mm,
            )
            yield SampledRows(low, high, low, samples, seconds[low:high])


class MoveSamples(CountedSamples):
    """The samples of moves, each a part of one of `rows` rows, at the nearest steps."""

    def __init__(
        self, path: Toolpath, row: Ints, rows: int, machine: _Machine, spacing_mm: float
    ) -> None:
        super().__init__(path, machine, spacing_mm)
        self._row = row
        self.first = self.first[np.searchsorted(row, np.arange(rows + 1))]

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Return the row and the position of each of the samples low:high."""
        move, points = super().window(low, high)
        for axis, step in enumerate(self._step_mm):
            points[:, axis] = to_steps(points[:, axis], step) * step
        return self._row[move], points


def with_chords(path: Toolpath, counts: Ints, inner: Floats) -> tuple[Toolpath, Ints]:
    """Return the toolpath with lines in place of its arcs, and the given row (M,) of each of its
    moves.

    `counts` (N,): the number of moves that each row becomes, at least 1; `inner` (M − N, 3) mm:
    the ends of all but the last move of each row, in order."""
    row = np.repeat(np.arange(len(path)), counts)
    end = path.end[row]
    is_inner = np.ones(len(row), dtype=np.bool_)
    is_inner[np.cumsum(counts) - 1] = False
    end[is_inner] = inner
    kind = np.where(path.is_arc, Kind.LINE, path.kind).astype(path.kind.dtype)[row]
    centre = np.broadcast_to(read_only(np.full((1, 2), np.nan)), (len(row), 2))
    lines = path.picked(row, kind=kind, end=read_only(end), centre=centre)
    return lines, row


def profile(plan: SpeedPlan, squares: Floats) -> Floats:
    """Return (3, K) mm/s: the speeds at the start, at the peak and at the end of each move of a
    plan. `squares` (K + 1,): the squares of the speeds at the ends of moves, from one of the
    plan's methods."""
    first, last = np.sqrt(squares[:-1]), np.sqrt(squares[1:])
    reach = plan.acceleration_mm_s2 * plan.length_mm + 0.5 * (first**2 + last**2)
    return np.stack([first, np.minimum(plan.speed_mm_s, np.sqrt(reach)), last])


def directions(path: Toolpath) -> tuple[Floats, Floats]:
    """Return the lengths (M,) mm of straight moves, 0 for events and moves below `MIN_MOVE_MM`;
    and their unit vectors (M, 3), 0 where the length is 0."""
    travel = np.diff(path.end, axis=0, prepend=path.start[None, :])
    length = np.sqrt((travel**2).sum(axis=1))
    moves = length >= MIN_MOVE_MM
    unit = np.where(moves[:, None], travel, 0.0) / np.where(moves, length, 1.0)[:, None]
    return np.where(moves, length, 0.0), unit


def sections(moving: Ints, stops: Bools) -> Iterator[Ints]:
    """Yield the indices `moving` (K,) in sections between stops; `stops` (M,): a mask of the rows
    at which the machine stands still."""
    passed = np.concatenate([[0], np.cumsum(stops)])[moving]
    for part in np.split(moving, np.flatnonzero(np.diff(passed)) + 1):
        if len(part):
            yield part
