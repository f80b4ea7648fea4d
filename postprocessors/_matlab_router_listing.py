"""A program for people: each block as the columns of the arrays that make it, 1-based as there.

The .m file has no lines that are blocks. A block is a column of three arrays, so it is shown as
those columns, in the words of the language: `xy(:,13) = [400; 265]; lxy(:,12) = [249; 179];
velxy(:,12) = [480; 345];`. A job's own block, its way to the first point, is that point. The
serial stream says no names; its numbers are shown with the names of the arrays that they fill.
"""

from __future__ import annotations

from collections.abc import Iterator

from camtool.machine.model import Machine
from camtool.toolpath.program import Listing

from ._matlab_router_job import ReadJob
from ._matlab_router_options import dialect_of
from ._matlab_router_stream import HEADER, read_stream
from ._matlab_router_text import read_text


def listing(data: bytes, machine: Machine) -> Listing:
    """The blocks of a program that its reader takes."""
    dialect = dialect_of(machine)
    if dialect.format == "stream":
        jobs = [_streamed(words) for words in _words_of(data, read_stream(data, dialect))]
    else:
        jobs = [_arrays(job) for job in read_text(data, dialect)]
    if len(jobs) == 1:
        return Listing(tuple(jobs[0]))
    named = ([f"job {number}: {block}" for block in job] for number, job in enumerate(jobs, 1))
    return Listing(tuple(block for job in named for block in job))


def _arrays(job: ReadJob) -> list[str]:
    """The first point, then a column of `xy`, `lxy` and `velxy` for each line."""
    x, y = job.first.tolist()
    at = (job.first[:, None] + job.steps.cumsum(axis=1)).T.tolist()
    lengths, speeds = job.length.T.tolist(), job.speed.T.tolist()
    return [
        f"xy(:,1) = [{x}; {y}]; first_pointx = {x}; first_pointy = {y};",
        *(
            f"xy(:,{column + 1}) = [{end[0]}; {end[1]}]; "
            f"lxy(:,{column}) = [{length[0]}; {length[1]}]; "
            f"velxy(:,{column}) = [{speed[0]}; {speed[1]}];"
            for column, (end, length, speed) in enumerate(zip(at, lengths, speeds, strict=True), 1)
        ),
    ]


def _words_of(data: bytes, jobs: Iterator[ReadJob]) -> Iterator[list[str]]:
    """The numbers of each job as they are sent; a character that cannot be shown as its code."""
    escaped = data.decode("latin-1").encode("unicode_escape").decode("ascii")
    words = escaped.split(r"\r")
    begin = 0
    for job in jobs:
        end = begin + len(HEADER) + 2 * job.length.size
        yield words[begin:end]
        begin = end


def _streamed(words: list[str]) -> list[str]:
    """The header, then the four numbers of each line."""
    count = int(words[0])
    body = words[len(HEADER) :]
    head = (f"{name} {word}" for name, word in zip(HEADER, words, strict=False))
    rows = [body[row * count : (row + 1) * count] for row in range(4)]
    return [
        "  ".join(head),
        *(
            f"lxy {column}: {lx} {ly}  velxy {column}: {vx} {vy}"
            for column, (lx, ly, vx, vy) in enumerate(zip(*rows, strict=True), 1)
        ),
    ]
