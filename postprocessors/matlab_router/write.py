"""Writing a matlab-router program: strokes become jobs, jobs become a .m file or serial bytes.

    toolpath ──cuts_of──▶ lines (mm) ──jobs_of──▶ jobs (0.1 mm, counts) ──▶ text or bytes

Nothing of a drawing's own text is ever written: a program holds numbers and camtool's words only.
Blocks, for the map to the toolpath: each job has one for the move to its first point, then one for
each line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import pairwise
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.bounds import refuse_too_long
from camtool.errors import PostError
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.program import Program

from .dialect import UNIT_MM, MatlabRouterMachine, ResolvedDialect, dialect_of
from .lines import Jobs, jobs_of
from .strokes import cuts_of

STREAM_EXTENSION: Final = ".stream"

CHARACTER_LIMIT: Final = 255
"""A number sent as one character must be one byte."""

CARRIAGE_RETURN: Final = 13
"""Ends each number; a number sent as this very character would be taken for an end."""


def write_program(toolpath: Toolpath, machine: MatlabRouterMachine) -> Program:
    """Return the program; PostError for the first thing that this machine cannot do."""
    dialect = dialect_of(machine)
    cuts, findings = cuts_of(toolpath, machine, dialect)
    jobs, changes = jobs_of(cuts, toolpath, machine, dialect)
    if len(jobs.lines.row) == 0:
        raise PostError(
            "nothing is left to cut"
            + (f" on a grid of {dialect.grid_units * UNIT_MM:g} mm" if len(cuts.row) else ""),
            mend="scale the drawing up" if len(cuts.row) else "cut below the stock's top, Z < 0",
        )
    refuse_too_long(len(jobs.lines.row) + len(jobs.offsets) - 1, "block")
    stream = dialect.format == "stream"
    heads = np.array(jobs.offsets[:-1])
    return Program(
        data=program_of(_numbers_of(jobs), len(heads), dialect),
        extension=STREAM_EXTENSION if stream else machine.target.extension,
        target=machine.target.name,
        row_of_block=np.insert(jobs.lines.row, heads, -1).astype(np.int32),
        findings=(*findings, *changes.findings(dialect)),
    )


Pair = tuple[list[int], list[int]]
"""Numbers of X and of Y."""


class JobNumbers(Struct, frozen=True):
    """The numbers of a job as they are written, x and y in pairs."""

    count: int
    first: tuple[int, int]
    xy: Pair
    lxy: Pair
    velxy: Pair


def _numbers_of(jobs: Jobs) -> Iterator[JobNumbers]:
    """Yield the numbers of each job as plain lists."""
    lines = jobs.lines
    for low, high in pairwise(jobs.offsets):
        start, end = lines.start[low:high], lines.end[low:high]
        xy = np.concatenate([start[:1], end]).T.tolist()
        length, speed = np.abs(end - start).T.tolist(), jobs.speed[low:high].T.tolist()
        first = xy[0][0], xy[1][0]
        yield JobNumbers(high - low, first, tuple(xy), tuple(length), tuple(speed))


def program_of(jobs: Iterable[JobNumbers], count: int, dialect: ResolvedDialect) -> bytes:
    """Return the bytes of `count` jobs in the dialect's form: a .m file or a serial stream."""
    if dialect.format == "stream":
        return stream_of(jobs, dialect)
    return _matlab(jobs, count, dialect)


def _matlab(jobs: Iterable[JobNumbers], count: int, dialect: ResolvedDialect) -> bytes:
    """Return one section of MATLAB code for each job. A section overwrites the arrays of the one
    before; `jobs{}` keeps all `count` of them."""
    lines = [
        f"% camtool: matlab-router, profile {dialect.profile}, {_count(count, 'job')}",
        "% xy, lxy and first point in 0.1 mm from home; velxy in counts of the encoder in 5 ms",
        f"% serial line: {dialect.baud} baud, {dialect.data_bits} bits, no parity, 1 stop bit",
    ]
    if count > 1:
        lines.append("% run one section, send it, reset the master, then run the next one")
    for number, job in enumerate(jobs, 1):
        lines += [
            f"%% job {number} of {count}: {_count(job.count, 'line')}",
            *_matrix("xy", job.xy),
            *_matrix("lxy", job.lxy),
            *_matrix("velxy", job.velxy),
            f"size_of_array = {job.count};",
            f"first_pointx = {job.first[0]};",
            f"first_pointy = {job.first[1]};",
        ]
        if count > 1:
            names = "xy, lxy, velxy, size_of_array, first_pointx, first_pointy"
            lines.append(f"jobs{{{number}}} = {{{names}}};")
    return ("\n".join(lines) + "\n").encode("ascii")


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _matrix(name: str, rows: Pair) -> list[str]:
    """Return the lines of a MATLAB matrix of two rows, its numbers aligned in columns."""
    first, second = (("%5d " * len(row) % tuple(row)).rstrip() for row in rows)
    return [f"{name} = [", first, second, "];"]


def stream_of(jobs: Iterable[JobNumbers], dialect: ResolvedDialect) -> bytes:
    """Return the bytes on the line, each number in digits and a carriage return: number of lines,
    first x and y, all lx, ly, velx, vely (L4294-4360)."""
    parts = []
    for number, job in enumerate(jobs, 1):
        body = job.lxy[0] + job.lxy[1] + job.velxy[0] + job.velxy[1]
        parts += [b"%d\r%d\r" % (job.count, job.first[0]), _first_y(job.first[1], number, dialect)]
        parts.append(b"%d\r" * len(body) % tuple(body))
    return b"".join(parts)


def _first_y(y: int, number: int, dialect: ResolvedDialect) -> bytes:
    """Return the bytes of the first point's y: in digits, or as the one character of that code
    (L4306)."""
    if dialect.first_y == "number":
        return b"%d\r" % y
    if y > CHARACTER_LIMIT or y == CARRIAGE_RETURN:
        raise PostError(
            f"job {number} begins at Y {y * UNIT_MM:.1f} mm, and {y} cannot be sent as one"
            " character as the listing does",
            mend="use --set dialect.first_y=number",
        )
    return bytes([y, CARRIAGE_RETURN])
