"""Reading a matlab-router program, .m or stream, into the moves that the machine makes of it.

Each job: home with Z, then X and Y; to the first point along X, then along Y; the plunge; the
lines, one after the other, with a full stop at each vertex (L4718-4929). Going home is written as
rapids to the place of home, so that other machines can follow.
"""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from camtool.errors import ProgramError
from camtool.machine.model import Machine
from camtool.toolpath.moves import Floats, Ints, Kind, Toolpath

from ._matlab_router_job import Executed, ReadJob, execute
from ._matlab_router_options import (
    UNIT_MM,
    UNITS_PER_MM,
    Dialect,
    cut_z_mm,
    dialect_of,
)
from ._matlab_router_run import Run
from ._matlab_router_seen import Seen
from ._matlab_router_stream import read_stream
from ._matlab_router_text import read_text

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
        self._seen = Seen(machine, dialect)

    def add(self, job: ReadJob) -> None:
        """The rows of one job."""
        done = execute(job, self._dialect)
        self._seen.add(job, done)
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
            findings=tuple(self._seen.findings()),
        )

    def _lines(self, job: ReadJob, done: Executed, z: float) -> None:
        """One row a line; two where its speeds bend it by more than the tolerance."""
        run = Run(done.points, np.abs(job.speed.T), self._dialect.bend_tolerance_mm)
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
