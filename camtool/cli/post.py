"""`camtool post`: the main job, drawing to verified program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.ahead import compiled_beside
from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.finish import Asked, finish
from camtool.cli.jobflags import JobFlags, job_options
from camtool.cli.judging import GateFlags, gate_options
from camtool.cli.options import (
    MachineFlags,
    machine_options,
    talk_options,
)
from camtool.cli.report import flags_given, report_option
from camtool.cli.sections import SectionedCommand
from camtool.cli.types import picture as picture_name

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Posted
    from camtool.planning.job import Job


@click.command(cls=SectionedCommand, short_help="Drawing to verified program.")
@click.argument("source", metavar="DRAWING")
@machine_options
@click.option("-o", "--output", metavar="FILE", help="The program; - is stdout.  [DRAWING.ext]")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result, .svg or .png.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@report_option
@click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")
@click.option(
    "--compensate",
    is_flag=True,
    help="Bend the path against the machine's play, scale and squareness.",
)
@gate_options
@job_options
@drawing_options
@talk_options
def post(
    source: str,
    machine: MachineFlags,
    output: str | None,
    preview: str | None,
    report: str | None,
    page: str | None,
    no_verify: bool,
    compensate: bool,
    gates: GateFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Turn DRAWING (- is stdin) into the program of a machine, verified before it is written.

    The program is read back from its bytes, run through a model of the machine's own controller
    and mechanics, and compared with the drawing. Exit code 1 (and no file) when something is
    wrong.
    """
    if no_verify and gates.given:
        raise click.UsageError("--no-verify leaves nothing to hold against limits")
    target = machine.load()
    asked = Asked(source, output, report, preview, page, flags_given())
    asked.check(target.machine.target.extension, verified=not no_verify)

    from camtool.pipeline import post_drawing

    with compiled_beside(target.machine.target.name, quiet=quiet):
        wanted = job.job(drawing)
        read = drawing.read(source, target.machine, wanted)
        with job.blamed():
            posted = post_drawing(
                read,
                wanted,
                target,
                check=not no_verify,
                compensate=compensate,
                gates=gates.gates(),
            )
    return finish(
        posted,
        asked,
        quiet=quiet,
        verbose=verbose,
        picture=lambda name: _picture(name, read, wanted, posted, target),
        target=target,
    )


def _picture(name: str, drawing: Drawing, job: Job, posted: Posted, target: LoadedTarget) -> bytes:
    from camtool.pipeline import picture
    from camtool.preview.render import render

    scene = picture(
        title=Path(drawing.file).name,
        drawing=drawing,
        job=job,
        toolpath=posted.decoded or posted.wanted,
        verification=posted.verification,
        machine=target.machine,
    )
    return render(scene, name)
