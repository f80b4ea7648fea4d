"""Writing a matlab-router program: strokes become jobs, jobs become a .m file or serial bytes.

    toolpath ──strokes_of──▶ strokes (mm) ──JobMaker──▶ jobs (0.1 mm, counts) ──▶ text or bytes

Nothing of a drawing's own text is ever written: a program holds numbers and camtool's words only.
Blocks, for the map to the toolpath: each job has one for its way to the first point, then one for
each line.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from camtool.errors import PostError
from camtool.machine.model import Machine
from camtool.toolpath.moves import Ints, Toolpath
from camtool.toolpath.program import Program

from ._matlab_router_lines import Job, JobMaker
from ._matlab_router_options import UNIT_MM, Dialect, dialect_of
from ._matlab_router_strokes import strokes_of

STREAM_EXTENSION: Final = ".stream"

CHARACTER_LIMIT: Final = 255
"""A number sent as one character must be one byte."""

CARRIAGE_RETURN: Final = 13
"""Ends each number; a number sent as this very character would be taken for an end."""


def write_program(toolpath: Toolpath, machine: Machine) -> Program:
    """The program; PostError for the first thing that this machine cannot do."""
    dialect = dialect_of(machine)
    strokes, findings = strokes_of(toolpath, machine, dialect)
    maker = JobMaker(toolpath, machine, dialect)
    jobs = [job for stroke in strokes for job in maker.jobs(stroke)]
    if not jobs:
        raise PostError(
            "nothing is left to cut"
            + (f" on a grid of {dialect.grid_units * UNIT_MM:g} mm" if strokes else ""),
            mend="scale the drawing up" if strokes else "cut below the top of the stock, Z < 0",
        )
    findings += maker.notes.findings(dialect)
    stream = dialect.format == "stream"
    return Program(
        data=_stream(jobs, dialect) if stream else _matlab(jobs, dialect),
        extension=STREAM_EXTENSION if stream else machine.target.extension,
        target=machine.target.name,
        row_of_block=np.concatenate([np.append(np.int64(-1), job.row) for job in jobs]),
        findings=tuple(findings),
    )


def _matlab(jobs: list[Job], dialect: Dialect) -> bytes:
    """One section a job: the last job's arrays remain when all are run; `jobs` then holds all."""
    lines = [
        f"% camtool: matlab-router, profile {dialect.profile}, {_count(len(jobs), 'job')}",
        "% xy, lxy and first point in 0.1 mm from home; velxy in counts of the encoder in 5 ms",
        f"% serial line: {dialect.baud} baud, {dialect.data_bits} bits, no parity, 1 stop bit",
    ]
    if len(jobs) > 1:
        lines.append("% run one section, send it, reset the master, then run the next one")
    for number, job in enumerate(jobs, 1):
        count = len(job.row)
        x, y = job.xy[0].tolist()
        lines += [
            f"%% job {number} of {len(jobs)}: {_count(count, 'line')}",
            *_matrix("xy", job.xy),
            *_matrix("lxy", np.abs(np.diff(job.xy, axis=0))),
            *_matrix("velxy", job.speed),
            f"size_of_array = {count};",
            f"first_pointx = {x};",
            f"first_pointy = {y};",
        ]
        if len(jobs) > 1:
            names = "xy, lxy, velxy, size_of_array, first_pointx, first_pointy"
            lines.append(f"jobs{{{number}}} = {{{names}}};")
    return ("\n".join(lines) + "\n").encode("ascii")


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _matrix(name: str, values: Ints) -> list[str]:
    """(n, 2) as two rows of n numbers."""
    first, second = (" ".join([f"{value:5d}" for value in row]) for row in values.T.tolist())
    return [f"{name} = [", first, second, "];"]


def _stream(jobs: list[Job], dialect: Dialect) -> bytes:
    """Each number in digits and a carriage return: lines, first x and y, all lx, ly, velx, vely
    (L4294-4360)."""
    parts = []
    for number, job in enumerate(jobs, 1):
        x, y = job.xy[0].tolist()
        lengths = np.abs(np.diff(job.xy, axis=0))
        parts += [b"%d\r%d\r" % (len(job.row), x), _first_y(y, number, dialect)]
        body = np.concatenate([lengths.T.ravel(), job.speed.T.ravel()]).tolist()
        parts.append(("\r".join(map(str, body)) + "\r").encode("ascii"))
    return b"".join(parts)


def _first_y(y: int, number: int, dialect: Dialect) -> bytes:
    """y of the first point: in digits, or as the one character of that number (L4306)."""
    if dialect.first_y == "number":
        return b"%d\r" % y
    if y > CHARACTER_LIMIT or y == CARRIAGE_RETURN:
        raise PostError(
            f"job {number} begins at Y {y * UNIT_MM:.1f} mm, and {y} cannot be sent as one"
            " character as the listing does",
            mend="use --set dialect.first_y=number",
        )
    return bytes([y, CARRIAGE_RETURN])
