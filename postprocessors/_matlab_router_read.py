"""Reading a matlab-router program, .m or stream, into the moves that the machine makes of it.

Each job: home with Z, then X and Y; to the first point along X, then along Y; the plunge; the
lines, one after the other, with a full stop at each vertex (L4718-4929). Going home is written as
rapids to the place of home, so that other machines can follow.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import numpy.typing as npt

from camtool.errors import ProgramError
from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.toolpath.moves import Floats, Ints, Kind, Toolpath

from ._matlab_router_job import Executed, ReadJob, execute
from ._matlab_router_options import (
    FIXED_Y_UNITS,
    UNIT_MM,
    UNITS_PER_MM,
    Dialect,
    cut_z_mm,
    dialect_of,
)
from ._matlab_router_stream import read_stream
from ._matlab_router_text import read_text

Bools = npt.NDArray[np.bool_]

FEED_GUARD: Final = 1e-6
"""A speed that is above its limit by less than this (in counts) is at the limit."""

TRAVEL_GUARD: Final = 1e-6
"""A position that is beyond the travel by less than this (in units) is at its end."""

_STREAM: Final = re.compile(rb"-?\d+\r(?!\n)")


def read_program(data: bytes, machine: Machine) -> Toolpath:
    """The moves of a program; ProgramError naming the place when it is none."""
    dialect = dialect_of(machine)
    streamed = _STREAM.match(data) is not None
    if streamed != (dialect.format == "stream"):
        if streamed:
            raise ProgramError("this is a serial stream", mend="use --set dialect.format=stream")
        if data and _looks_like_text(data):
            raise ProgramError("this is no serial stream", mend="use --set dialect.format=m")
    read = read_stream if dialect.format == "stream" else read_text
    moves = _Moves(machine, dialect)
    for job in read(data, dialect):
        moves.add(job)
    return moves.finish()


def _looks_like_text(data: bytes) -> bool:
    return re.match(rb"\s*(?:%|[a-z])", data) is not None


@dataclass
class _Worst:
    """How many are beyond a limit, by how much at most, and where the first is."""

    count: int = 0
    most: float = 0.0
    first: str = ""

    def add(self, count: int, most: float, place: str) -> None:
        if count:
            self.first = self.first or place
            self.count += count
            self.most = max(self.most, most)


@dataclass
class _Seen:
    """What was noticed in all jobs."""

    odd: _Worst = field(default_factory=_Worst)
    empty: _Worst = field(default_factory=_Worst)
    fast: _Worst = field(default_factory=_Worst)
    outside: _Worst = field(default_factory=_Worst)
    fixed_y: _Worst = field(default_factory=_Worst)
    bent: _Worst = field(default_factory=_Worst)


class _Moves:
    """Jobs in, the columns of a toolpath out."""

    def __init__(self, machine: Machine, dialect: Dialect) -> None:
        self._machine = machine
        self._dialect = dialect
        self._home = np.array(machine.controller.machine_zero_mm, dtype=np.float64)
        self._position = np.zeros(3)
        self._kind: list[Ints] = []
        self._end: list[Floats] = []
        self._feed: list[Floats] = []
        self._value: list[Floats] = []
        self._block: list[Ints] = []
        self._blocks = 0
        self._seen = _Seen()

    def add(self, job: ReadJob) -> None:
        """The rows of one job."""
        done = execute(job, self._dialect)
        self._notice(job, done)
        self._go_home(self._blocks)
        x, y = self._home[:2] + done.points[0] / UNITS_PER_MM
        up, down = self._home[2], cut_z_mm(self._machine, self._dialect)
        self._rapid((x, self._home[1], up), self._blocks)
        self._rapid((x, y, up), self._blocks)
        self._row(Kind.LINE, (x, y, down), self._blocks, feed=self._dialect.plunge_mm_min)
        if self._dialect.spindle_rpm is not None:
            self._row(Kind.SPINDLE_CW, (x, y, down), self._blocks, value=self._dialect.spindle_rpm)
        self._lines(job, done, down)
        self._blocks += job.length.shape[1] + 1
        last = self._blocks - 1
        if self._dialect.spindle_rpm is not None:
            self._row(Kind.SPINDLE_OFF, tuple(self._position), last)
        if self._dialect.end == "raise":
            self._go_home(last)

    def finish(self) -> Toolpath:
        """The toolpath of all jobs."""
        self._row(Kind.END, tuple(self._position), max(0, self._blocks - 1))
        kind = np.concatenate(self._kind)
        return Toolpath(
            kind=kind,
            end=np.concatenate(self._end),
            centre=np.full((len(kind), 2), np.nan),
            feed=np.concatenate(self._feed),
            value=np.concatenate(self._value),
            source=np.full(len(kind), -1),
            block=np.concatenate(self._block),
            start=np.zeros(3),
            findings=tuple(self._findings()),
        )

    def _lines(self, job: ReadJob, done: Executed, z: float) -> None:
        """One row a line; two where its speeds bend it by more than the tolerance."""
        run = _Run(done.points, np.abs(job.speed.T), self._dialect.bend_tolerance_mm)
        self._seen.bent.add(
            run.bent, run.most_bend * UNIT_MM, f"job {job.number}, line {run.first_bent + 1}"
        )
        if len(run.end) == 0:
            return
        xy = self._home[:2] + run.end / UNITS_PER_MM
        count = len(run.end)
        self._kind.append(np.full(count, Kind.LINE, dtype=np.int64))
        self._end.append(np.column_stack([xy, np.full(count, z)]))
        self._feed.append(run.speed * self._machine.feed.unit_mm_min)
        self._value.append(np.full(count, np.nan))
        self._block.append(self._blocks + 1 + run.line)
        self._position = self._end[-1][-1]

    def _go_home(self, block: int) -> None:
        """Z first, then X and Y (state 0, L4718-4793)."""
        x, y, _ = self._position
        self._rapid((x, y, self._home[2]), block)
        self._rapid((self._home[0], y, self._home[2]), block)
        self._rapid((self._home[0], self._home[1], self._home[2]), block)

    def _rapid(self, to: tuple[float, ...], block: int) -> None:
        if tuple(self._position) != to:
            self._row(Kind.RAPID, to, block)

    def _row(
        self,
        kind: Kind,
        to: tuple[float, ...],
        block: int,
        *,
        feed: float = np.nan,
        value: float = np.nan,
    ) -> None:
        self._position = np.array(to, dtype=np.float64)
        self._kind.append(np.array([kind], dtype=np.int64))
        self._end.append(self._position[None, :])
        self._feed.append(np.array([feed]))
        self._value.append(np.array([value]))
        self._block.append(np.array([block], dtype=np.int64))

    def _notice(self, job: ReadJob, done: Executed) -> None:
        seen, place = self._seen, f"job {job.number}"
        odd = int((job.length % 2).sum() + (job.first % 2).sum())
        if self._dialect.odd == "truncated" and odd:
            drift = np.abs(done.points - done.asked)
            if self._dialect.master_y == "fixed":
                drift[:, 1] = 0
            seen.odd.add(odd, float(drift.max()) * UNIT_MM, place)
        empty = (np.diff(done.points, axis=0) == 0).all(axis=1)
        line = int(np.argmax(empty)) + 1
        seen.empty.add(int(empty.sum()), 0.0, f"{place}, line {line}")
        limit = self._machine.max_feed_mm_min / self._machine.feed.unit_mm_min
        speed = np.where(job.length > 0, np.abs(job.speed), 0)
        fast = speed > limit + FEED_GUARD
        line = int(np.argmax(fast.any(axis=0))) + 1
        most = float(speed.max()) * self._machine.feed.unit_mm_min
        seen.fast.add(int(fast.sum()), most, f"{place}, line {line}")
        self._outside(done, place)
        if self._dialect.master_y == "fixed" and int(job.first[1]) != FIXED_Y_UNITS:
            seen.fixed_y.add(1, 0.0, place)

    def _outside(self, done: Executed, place: str) -> None:
        axes = self._machine.axes
        for axis, travel in enumerate((axes.x.travel_mm, axes.y.travel_mm)):
            at = done.points[:, axis]
            bad = at < 0
            if travel is not None:
                bad = bad | (at > travel * UNITS_PER_MM + TRAVEL_GUARD)
            most = float(np.abs(at).max()) * UNIT_MM
            line = max(1, int(np.argmax(bad)))
            self._seen.outside.add(int(bad.sum()), most, f"{place}, line {line}")

    def _findings(self) -> list[Finding]:
        """One finding for each kind that was seen."""
        seen, listed = self._seen, []
        table = (
            (
                seen.outside,
                Code.OUT_OF_TRAVEL,
                Severity.ERROR,
                "points lie outside of the machine's area, up to {most:.1f} mm from home",
            ),
            (
                seen.fast,
                Code.FEED_ABOVE_LIMIT,
                Severity.ERROR,
                "axes run faster than they can, up to {most:.4g} mm/min",
            ),
            (
                seen.odd,
                Code.VALUE_ROUNDED,
                Severity.WARNING,
                "distances are odd and lose 0.1 mm each, because the slaves run chunks of 0.2 mm:"
                " places are off by {most:.1f} mm at most",
            ),
            (
                seen.fixed_y,
                Code.VALUE_ROUNDED,
                Severity.WARNING,
                f"jobs begin at Y {FIXED_Y_UNITS * UNIT_MM:g} mm, whatever the program says,"
                " because the listed master sends nothing else",
            ),
            (
                seen.bent,
                Code.VALUE_ROUNDED,
                Severity.WARNING,
                "lines are bent by their speeds, by {most:.2f} mm at most: one axis arrives first",
            ),
            (seen.empty, Code.MOVE_COLLAPSED, Severity.INFO, "lines have no length"),
        )
        for worst, code, severity, message in table:
            if worst.count:
                text = f"{worst.count} {message.format(most=worst.most)}"
                listed.append(Finding(code, severity, text, worst.first, worst.most, unit="mm"))
        return listed


class _Run:
    """Lines of points (n+1, 2) units at speeds (n, 2) counts in 5 ms, as the axes run them.

    Both start together, each stops by itself (L4855-4929). With distances d and speeds v they
    take t = d/v; the earlier one, at t₁, leaves the other alone until t₂:

        the line bends at t₁ · v, by (1 − t₁/t₂) of the distance of the later axis.

    `end` (m, 2) units, `speed` (m,) counts in 5 ms along each way, `line` (m,) its index.
    """

    def __init__(self, points: Ints, speed: Ints, tolerance_mm: float) -> None:
        way = np.diff(points, axis=0).astype(np.float64)
        distance = np.abs(way)
        moving = distance > 0
        with np.errstate(divide="ignore", invalid="ignore"):
            took = np.where(moving, distance / speed, 0.0)
            last = took.max(axis=1)
            both = moving.all(axis=1)
            share = np.where(both, took.min(axis=1) / last, 1.0)
            along = np.hypot(*way.T) / last
        lag = np.where(both, _lag(distance, took, share), 0.0)
        bent = lag > tolerance_mm * UNITS_PER_MM
        self.bent = int(bent.sum())
        self.most_bend = float(lag.max(initial=0.0))
        self.first_bent = int(np.argmax(bent)) if self.bent else 0
        keep = moving.any(axis=1)
        times = np.where(keep, np.where(bent, 2, 1), 0)
        self.line = np.repeat(np.arange(len(way)), times)
        self.end = points[1:][self.line].astype(np.float64)
        self.speed = along[self.line]
        if self.bent:
            self._bend(points, way, speed, took, bent, times)

    def _bend(
        self,
        points: Ints,
        way: Floats,
        speed: Ints,
        took: Floats,
        bent: Bools,
        times: Ints,
    ) -> None:
        """Rows of bent lines: to the bend with both axes, then with the later one alone."""
        rows = np.flatnonzero(bent)
        first = (np.cumsum(times) - times)[rows]
        soon = took[rows].min(axis=1)[:, None]
        part = np.minimum(soon * speed[rows], np.abs(way[rows]))
        self.end[first] = points[:-1][rows] + np.sign(way[rows]) * part
        self.speed[first] = np.hypot(*speed[rows].T)
        later = took[rows].argmax(axis=1)
        self.speed[first + 1] = speed[rows, later]


def _lag(distance: Floats, took: Floats, share: Floats) -> Floats:
    """(n,) units by which a line bends: what is left of the later axis, seen across the line."""
    later = took.argmax(axis=1)
    left = distance[np.arange(len(distance)), later] * (1.0 - share)
    other = distance[np.arange(len(distance)), 1 - later]
    return np.asarray(left * other / np.hypot(*distance.T))
