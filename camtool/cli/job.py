"""`camtool job`: begin a job file from a drawing, or see what one says."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.jobflags import JobFlags
from camtool.cli.options import MachineFlags, machine_options, talk_options
from camtool.cli.sections import SectionedCommand

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.planning.job import Job, Operation


@click.group(short_help="Job files: begin one, or see what one says.")
def job() -> None:
    """Job files say how a drawing is cut: the tools, and one operation after the other.

    \b
    camtool job new   part.dxf -o part.toml         a file to fill in, from the layers
    camtool job check part.toml --against part.dxf  what it says, and what it takes
    camtool post part.dxf -t grbl --job part.toml   the program
    """


@job.command(cls=SectionedCommand, short_help="Begin a job file.")
@click.argument("source", metavar="DRAWING")
@click.option("-o", "--output", metavar="FILE", help="The file; - is stdout.  [job.toml]")
@machine_options
@drawing_options
@talk_options
def new(
    source: str,
    output: str | None,
    machine: MachineFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> None:
    """Write a job file for DRAWING (- is stdin): one operation for each of its layers.

    It works as it is; every other key stands there as a comment.
    """
    from camtool.cli.output import STDOUT, check_new, check_places, write_all
    from camtool.cli.talk import say, say_findings, say_first_run
    from camtool.jobs.template import job_template

    output = output or "job.toml"
    check_places([source, *machine.files()], [output])
    check_new(output)
    say_first_run(quiet=quiet)
    target = machine.load().machine if machine.name() is not None else None
    read = drawing.read(source, target)
    write_all({output: job_template(read, target).encode()})
    say_findings(read.findings, quiet=quiet, verbose=verbose)
    where = "stdout" if output == STDOUT else output
    say(f"written: {where}; look at the kinds, the tool and the depth", quiet=quiet)


@job.command(cls=SectionedCommand, short_help="What a job file says.")
@click.argument("file", metavar="FILE")
@click.option("--against", metavar="DRAWING", help="Say what of this drawing is taken.")
@drawing_options
@talk_options
def check(
    file: str, against: str | None, drawing: DrawingFlags, quiet: bool, verbose: bool
) -> None:
    """Check the job FILE, and say what each operation does; with --against, to which paths."""
    from camtool.cli.talk import one_line

    said = JobFlags(file, (), {}).job(drawing)
    read = drawing.read(against, job=said) if against is not None else None
    if not quiet:
        for line in _summary(said, read):
            click.echo(one_line(line))


def _summary(job: Job, drawing: Drawing | None) -> Iterator[str]:
    """The operations of a job, and what of a drawing they take."""
    placed = None
    if drawing is not None:
        from camtool.geometry.facts import drawing_extents
        from camtool.planning.place import place

        placed = place(drawing, job)
        (left, right), (low, high) = drawing_extents(placed).tolist()
        x, y = (" … ".join(map(_place, pair)) for pair in ((left, right), (low, high)))
        yield f"drawing    x {x}   y {y} mm"
    for number, operation in enumerate(job.operations, start=1):
        yield f"operation  {number} {operation.name}".rstrip() + f": {_does(operation)}"
        if placed is not None:
            yield f"           {_takes(operation, placed)}"
    if job.stock is not None:
        width, height = job.stock.size_mm
        yield f"stock      {width:g} by {height:g} by {job.stock.thickness_mm:g} mm"


def _place(mm: float) -> str:
    return f"{round(mm, 4) + 0.0:.4f}"  # never −0


def _does(operation: Operation) -> str:
    tool = operation.tool
    called = f" ({tool.name})" if tool.name else ""
    depth = "" if operation.depth_mm is None else f", {operation.depth_mm:g} mm deep"
    step = "" if operation.step_down_mm is None else f" by {operation.step_down_mm:g} mm"
    return f"{operation.kind}, tool {tool.diameter_mm:g} mm{called}{depth}{step}"


def _takes(operation: Operation, drawing: Drawing) -> str:
    names = zip(drawing.layers, drawing.colours, strict=True)
    rows = [row for row, each in enumerate(names) if operation.takes(*each)]
    closed = int(drawing.paths.closed[rows].sum())
    marks = sum(operation.takes(mark.layer, mark.colour) for mark in drawing.marks)
    return f"{closed} closed paths, {len(rows) - closed} open, {marks} points"
