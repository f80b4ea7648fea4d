"""Reading a matlab-router program, .m or stream, into the moves that the machine makes of it.

Each job: home with Z, then X and Y; to the first point along X, then along Y; the plunge; the
lines, one after the other, with a full stop at each vertex (L4718-4929). Going home is written as
rapids to the place of home, so that other machines can follow."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Final

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Floats, Ints
from camtool.bounds import check_count
from camtool.errors import ProgramError
from camtool.findings import Finding, Sentence
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from .dialect import (
    CHUNK_UNITS,
    FIXED_Y_UNITS,
    UNIT_MM,
    UNITS_PER_MM,
    MatlabRouterMachine,
    ResolvedDialect,
    cut_z_mm,
    dialect_of,
)
from .findings import (
    EXECUTED_OTHERWISE_BENT,
    EXECUTED_OTHERWISE_ODD,
    EXECUTED_OTHERWISE_START,
    FEED_ABOVE_LIMIT,
    MOVE_COLLAPSED_READ,
    OUT_OF_TRAVEL,
)
from .jobs import ReadJob, read_stream, read_text

MAX_SPEED_ERROR_COUNTS: Final = 8.0
"""Largest difference between the speed of an axis and the speed for its distance, counts in 5 ms
(the GUI's own differ by half a count, and by some when distances are shortened)."""

FEED_GUARD: Final = 1e-6
"""A speed that is above its limit by less than this (in counts) is at the limit."""

TRAVEL_GUARD: Final = 1e-6
"""A position that is beyond the travel by less than this (in units) is at its end."""

_STREAM: Final = re.compile(rb"-?\d+\r(?!\n)")


def read_program(data: bytes, machine: MatlabRouterMachine) -> Toolpath:
    """Return the moves of a program; ProgramError with the place for data that are no program."""
    return path_of(read_jobs(data, machine), machine)


def read_jobs(data: bytes, machine: MatlabRouterMachine) -> Iterator[ReadJob]:
    """Yield the jobs of a program, checked; ProgramError with the place for data that are no
    program."""
    dialect = dialect_of(machine)
    streamed = _STREAM.match(data) is not None
    if streamed != (dialect.format == "stream"):
        if streamed:
            raise ProgramError("this is a serial stream", mend="use --set dialect.format=stream")
        if data and re.match(rb"\s*(?:%|[a-z])", data):
            raise ProgramError("this is no serial stream", mend="use --set dialect.format=m")
    read = read_stream if dialect.format == "stream" else read_text
    yield from read(data, dialect)


def path_of(jobs: Iterable[ReadJob], machine: MatlabRouterMachine) -> Toolpath:
    """Return the moves of checked jobs."""
    moves = _Moves(machine, dialect_of(machine))
    for job in jobs:
        moves.add(job)
    return moves.finish()


class _Moves:
    """Takes jobs and builds the rows of a toolpath."""

    def __init__(self, machine: MatlabRouterMachine, dialect: ResolvedDialect) -> None:
        self._machine = machine
        self._dialect = dialect
        self._home = np.array(machine.controller.machine_zero_mm, dtype=np.float64)
        self._path = ToolpathBuilder()
        self._blocks = 0
        self._findings = JobFindings(machine, dialect)

    def add(self, job: ReadJob) -> None:
        """Add the rows of one job to the toolpath: home, first point, plunge, lines."""
        lines = job.length.shape[1]
        check_count(self._blocks + lines + 1, "block")
        result = execute(job, self._dialect)
        self._findings.add(job, result)
        path = self._path
        path.block = self._blocks
        self._go_home()
        x, y = (self._home[:2] + result.points[0] / UNITS_PER_MM).tolist()
        self._rapid(x=x)
        self._rapid(y=y)
        depth = cut_z_mm(self._machine, self._dialect)
        path.line(z=depth, feed=self._dialect.plunge_mm_min)
        if self._dialect.spindle_rpm is not None:
            path.event(Kind.SPINDLE_CW, self._dialect.spindle_rpm)
        self._lines(job, result, depth)
        self._blocks += lines + 1
        path.block = self._blocks - 1
        if self._dialect.spindle_rpm is not None:
            path.event(Kind.SPINDLE_OFF)
        if self._dialect.end == "raise":
            self._go_home()

    def finish(self) -> Toolpath:
        """Return the toolpath of all jobs."""
        self._path.block = max(0, self._blocks - 1)
        return self._path.event(Kind.END).finish(self._findings.findings())

    def _lines(self, job: ReadJob, result: Executed, z: float) -> None:
        """Add one row for each line at height `z`.

        Two rows, up to a kink and after it, where the axes do not arrive together and the path is
        thereby off the straight line by more than the tolerance."""
        run = DrivenLines(result.points, np.abs(job.speed.T), self._dialect.bend_tolerance_mm)
        self._findings.bent.add(
            run.bent, run.most_bend * UNIT_MM, f"job {job.number}, line {run.first_bent + 1}"
        )
        count = len(run.end)
        if count:
            xy = self._home[:2] + run.end / UNITS_PER_MM
            self._path.moves(
                kind=np.full(count, int(Kind.LINE)),
                end=np.column_stack([xy, np.full(count, z)]),
                centre=np.full((count, 2), np.nan),
                feed=run.speed * self._machine.feed.unit_mm_min,
                block=self._blocks + 1 + run.line,
            )

    def _go_home(self) -> None:
        """Add the rapids home: Z first, then X and Y (state 0, L4718-4793)."""
        x, y, z = self._home.tolist()
        self._rapid(z=z)
        self._rapid(x=x)
        self._rapid(y=y)

    def _rapid(self, **target: float) -> None:
        """Add a rapid to a place along one axis, unless the tool is there already."""
        before = dict(zip("xyz", self._path.position, strict=True))
        if before | target != before:
            self._path.rapid(**target)


class Executed(Struct, frozen=True, eq=False):
    """Points of an executed job in units: `points` (n+1, 2), where the slaves bring the tool, and
    `listed` (n+1, 2), where the listed master would."""

    points: Ints
    listed: Ints


def execute(job: ReadJob, dialect: ResolvedDialect) -> Executed:
    """Compute where the slaves bring the tool, and where the listed master would."""
    listed = _along(job.first, job.steps)
    first = job.first.copy()
    if dialect.master_y == "fixed":
        first[1] = FIXED_Y_UNITS
    steps = job.steps
    if dialect.odd == "truncated":
        first = first // CHUNK_UNITS * CHUNK_UNITS
        steps = np.sign(steps) * (np.abs(steps) // CHUNK_UNITS * CHUNK_UNITS)
    return Executed(_along(first, steps), listed)


def _along(first: Ints, steps: Ints) -> Ints:
    return np.asarray(
        first + np.concatenate([np.zeros((1, 2), dtype=np.int64), steps.T.cumsum(0)])
    )


class DrivenLines:
    """Lines of points (n+1, 2) units at speeds (n, 2) counts in 5 ms, as the axes run them.

    Both start together, each stops by itself (L4855-4929). With distances d and speeds v they
    take t = d/v; the earlier one, at t₁, leaves the other alone until t₂:

        the line bends at t₁ · v, by (1 − t₁/t₂) of the distance of the later axis.

    A line becomes two rows when it bends by more than the tolerance, or when a speed is off by
    more than `MAX_SPEED_ERROR_COUNTS` from that of its distance: from the rows and the speed along
    them the speeds of the axes can be found again. `end` (m, 2) units, `speed` (m,) counts in 5 ms
    of both axes together, `line` (m,) its index; `bent` counts the lines beyond the tolerance."""

    def __init__(self, points: Ints, speed: Ints, tolerance_mm: float) -> None:
        travel = np.diff(points, axis=0).astype(np.float64)
        distance = np.abs(travel)
        moving = distance > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            took = np.where(moving, distance / speed, 0.0)
            last = took.max(axis=1)
            moves_both = moving.all(axis=1)
            share = np.where(moves_both, took.min(axis=1) / last, 1.0)
        along = np.hypot(*np.where(moving, speed, 0).T.astype(np.float64))
        lag = np.where(moves_both, _lag(distance, took, share), 0.0)
        bent = lag > tolerance_mm * UNITS_PER_MM
        self.bent = int(bent.sum())
        self.most_bend = float(lag.max(initial=0.0))
        self.first_bent = int(np.argmax(bent)) if self.bent else 0
        keep = moving.any(axis=1)
        parted = bent | (
            moves_both & (_speed_errors(distance, speed, along) > MAX_SPEED_ERROR_COUNTS)
        )
        times = np.where(keep, np.where(parted, 2, 1), 0)
        self.line = np.repeat(np.arange(len(travel)), times)
        self.end = points[1:][self.line].astype(np.float64)
        self.speed = along[self.line]
        if parted.any():
            self._bend(points, travel, speed, took, parted, times)

    def _bend(
        self, points: Ints, travel: Floats, speed: Ints, took: Floats, bent: Bools, times: Ints
    ) -> None:
        """Fill in the two rows of each bent line: both axes move up to the bend, then the later
        one moves alone."""
        rows = np.flatnonzero(bent)
        first = (np.cumsum(times) - times)[rows]
        soon = took[rows].min(axis=1)[:, None]
        part = np.minimum(soon * speed[rows], np.abs(travel[rows]))
        self.end[first] = points[:-1][rows] + np.sign(travel[rows]) * part
        self.speed[first] = np.hypot(*speed[rows].T)
        later = took[rows].argmax(axis=1)
        self.speed[first + 1] = speed[rows, later]


def _lag(distance: Floats, took: Floats, share: Floats) -> Floats:
    """Return (n,) units by which a line bends: the rest that the later axis travels alone,
    measured across the line."""
    later = took.argmax(axis=1)
    remaining = distance[np.arange(len(distance)), later] * (1.0 - share)
    other = distance[np.arange(len(distance)), 1 - later]
    length = np.hypot(*distance.T)
    return np.asarray(remaining * other / np.where(length > 0.0, length, 1.0))


def _speed_errors(distance: Floats, speed: Ints, along: Floats) -> Floats:
    """Return (n,) the greatest difference between an axis' speed and that on a straight line,
    counts."""
    length = np.hypot(*distance.T)
    straight = distance * (along / np.where(length > 0.0, length, 1.0))[:, None]
    return np.asarray(np.abs(speed - straight).max(axis=1))


class Worst(Struct):
    """Count of excesses over a limit, the largest, and the place of the first."""

    count: int = 0
    most: float = 0.0
    first: str = ""

    def add(self, count: int, max_value: float, place: str) -> None:
        """Count `count` more excesses, the first of them at `place`; keep the largest value."""
        if count:
            self.first = self.first or place
            self.count += count
            self.most = max(self.most, max_value)

    def finding(self, sentence: Sentence, start: float = 0.0) -> list[Finding]:
        """Return the finding; none if nothing exceeded the limit."""
        if not self.count:
            return []
        return [sentence(where=self.first, measured=self.most, count=self.count, start=start)]


class JobFindings(Struct):
    """Counts, over all jobs, of what the machine executes differently or cannot execute."""

    machine: MatlabRouterMachine
    dialect: ResolvedDialect
    odd: Worst = field(default_factory=Worst)
    empty: Worst = field(default_factory=Worst)
    fast: Worst = field(default_factory=Worst)
    outside: Worst = field(default_factory=Worst)
    fixed_y: Worst = field(default_factory=Worst)
    bent: Worst = field(default_factory=Worst)

    def add(self, job: ReadJob, result: Executed) -> None:
        """Count in one job what the machine executes differently, and what it cannot execute."""
        place = f"job {job.number}"
        odd = int((job.length % 2).sum() + (job.first % 2).sum())
        if self.dialect.odd == "truncated" and odd:
            drift = result.points - result.listed
            if self.dialect.master_y == "fixed":
                drift[:, 1] -= drift[0, 1]
            self.odd.add(odd, float(np.abs(drift).max()) * UNIT_MM, place)
        if self.dialect.master_y == "fixed" and int(job.first[1]) != FIXED_Y_UNITS:
            offset = abs(int(job.first[1]) - FIXED_Y_UNITS) * UNIT_MM
            self.fixed_y.add(1, offset, place)
        empty = (np.diff(result.points, axis=0) == 0).all(axis=1)
        line = int(np.argmax(empty)) + 1
        self.empty.add(int(empty.sum()), 0.0, f"{place}, line {line}")
        self._fast(job, place)
        self._outside(result, place)

    def _fast(self, job: ReadJob, place: str) -> None:
        limit = self.machine.max_feed_mm_min / self.machine.feed.unit_mm_min
        speed = np.where(job.length > 0, np.abs(job.speed), 0)
        fast = speed > limit + FEED_GUARD
        line = int(np.argmax(fast.any(axis=0))) + 1
        max_feed = float(speed.max()) * self.machine.feed.unit_mm_min
        self.fast.add(int(fast.sum()), max_feed, f"{place}, line {line}")

    def _outside(self, result: Executed, place: str) -> None:
        axes = self.machine.axes
        for axis, travel in enumerate((axes.x.travel_mm, axes.y.travel_mm)):
            places = result.points[:, axis]
            is_bad = places < 0
            if travel is not None:
                is_bad = is_bad | (places > travel * UNITS_PER_MM + TRAVEL_GUARD)
            max_mm = float(np.abs(places).max()) * UNIT_MM
            line = max(1, int(np.argmax(is_bad)))
            self.outside.add(int(is_bad.sum()), max_mm, f"{place}, line {line}")

    def findings(self) -> list[Finding]:
        """Return one finding for each kind of deviation."""
        return [
            *self.outside.finding(OUT_OF_TRAVEL),
            *self.fast.finding(FEED_ABOVE_LIMIT),
            *self.odd.finding(EXECUTED_OTHERWISE_ODD),
            *self.fixed_y.finding(EXECUTED_OTHERWISE_START, start=FIXED_Y_UNITS * UNIT_MM),
            *self.bent.finding(EXECUTED_OTHERWISE_BENT),
            *self.empty.finding(MOVE_COLLAPSED_READ),
        ]
