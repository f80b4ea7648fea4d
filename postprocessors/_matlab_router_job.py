"""The reader's jobs: what the master would hold after receiving one, checked as a whole, and the
moves that the machine then makes.

A number that would make a slave run away or never end is an error here, with its place, because
no path could be told: the loop of the slaves runs `distance / 2 − 1` times in an unsigned int16
(L5589-5729), so a distance of 1 (or a first point below 2) runs 65535 times, and a speed of 0
never gets there.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from camtool.errors import ProgramError
from camtool.toolpath.moves import Ints

from ._matlab_router_options import (
    CHUNK_UNITS,
    FIXED_Y_UNITS,
    MOST_NUMBER,
    UNIT_MM,
    Dialect,
)

Bools = npt.NDArray[np.bool_]

Where = Callable[[str, int, int], str]
"""The place of a number in the file, by the name of its array, its row and its column."""


@dataclass(frozen=True, eq=False)
class ReadJob:
    """`first` (2,) and `length` (2, n) units, `speed` (2, n) counts in 5 ms with the signs of the
    directions; `number` from 1; `where` names places."""

    number: int
    first: Ints
    length: Ints
    speed: Ints
    where: Where

    @property
    def steps(self) -> Ints:
        """(2, n) units, signed: the ways that the program asks for."""
        return np.asarray(np.where(self.speed < 0, -self.length, self.length))


@dataclass(frozen=True, eq=False)
class Executed:
    """`points` (n+1, 2) units where the machine comes to stand, and where it was `asked` to."""

    points: Ints
    asked: Ints


def fail(where: str, message: str, mend: str = "") -> NoReturn:
    """ProgramError at a place."""
    raise ProgramError(message, where=where, mend=mend)


def check_count(count: int, where: Where, dialect: Dialect) -> None:
    """The master's arrays hold so many lines, and it does not look (L4625-4635)."""
    if not 1 <= count <= dialect.max_lines:
        fail(
            where("size_of_array", 0, 0),
            f"{count} lines: a job has 1 to {dialect.max_lines}",
            "post the drawing again: it is split into jobs then",
        )


def check_job(job: ReadJob, dialect: Dialect) -> None:
    """ProgramError for the first number with which the machine would run away or stop."""
    for name, table in (("lxy", job.length), ("velxy", job.speed)):
        _refuse(job, name, np.abs(table) > MOST_NUMBER, "is beyond an int16")
    _refuse(job, "lxy", job.length < 0, "is negative: the sign stands in velxy")
    runaway = "makes the slave run away"
    if dialect.odd == "truncated":
        _refuse(job, "lxy", job.length == 1, runaway)
    dead = (job.length > 0) & (job.speed == 0)
    _refuse(job, "velxy", dead, "never ends: there is a distance to go")
    for axis, name in enumerate(("first_pointx", "first_pointy")):
        first = int(job.first[axis])
        if axis == 1 and dialect.master_y == "fixed":
            continue
        if not CHUNK_UNITS <= first <= MOST_NUMBER:
            reason = runaway if 0 <= first < CHUNK_UNITS else "is out of reach"
            fail(
                job.where(name, 0, 0),
                f"a first point at {first} {reason}",
                f"begin {CHUNK_UNITS * UNIT_MM:g} mm from home at the least",
            )


def _refuse(job: ReadJob, name: str, bad: Bools, what: str) -> None:
    if bad.any():
        column, row = (int(index) for index in np.argwhere(bad.T)[0])
        table = job.length if name == "lxy" else job.speed
        fail(job.where(name, row, column), f"{int(table[row, column])} in {name} {what}")


def execute(job: ReadJob, dialect: Dialect) -> Executed:
    """Where the slaves and the listed master really bring the tool."""
    asked = _along(job.first, job.steps)
    first = job.first.copy()
    if dialect.master_y == "fixed":
        first[1] = FIXED_Y_UNITS
    steps = job.steps
    if dialect.odd == "truncated":
        first = first // CHUNK_UNITS * CHUNK_UNITS
        steps = np.sign(steps) * (np.abs(steps) // CHUNK_UNITS * CHUNK_UNITS)
    return Executed(_along(first, steps), asked)


def _along(first: Ints, steps: Ints) -> Ints:
    return np.asarray(
        first + np.concatenate([np.zeros((1, 2), dtype=np.int64), steps.T.cumsum(0)])
    )
