"""`camtool post`: the main job, drawing to verified program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.options import (
    JobFlags,
    MachineFlags,
    job_options,
    machine_options,
    talk_options,
)
from camtool.cli.output import STDOUT, check_writable, write_all
from camtool.cli.talk import say, say_findings, say_first_run
from camtool.cli.types import picture as picture_name

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Posted
    from camtool.planning.job import Job


@click.command(short_help="Drawing to verified program.")
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
@click.option("--no-verify", is_flag=True, help="Write without simulating the machine.")
@job_options
@drawing_options
@talk_options
def post(
    source: str,
    machine: MachineFlags,
    output: str | None,
    preview: str | None,
    report: str | None,
    no_verify: bool,
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
    if no_verify and report is not None:
        raise click.UsageError(
            "--json is the report of the verification that --no-verify leaves out"
        )
    target = machine.load()
    expected = output or _name_for(source, target.machine.target.extension)
    check_writable([expected, preview, report], [source])

    from camtool.pipeline import post_drawing

    say_first_run(quiet=quiet)
    wanted = job.job(drawing)
    read = drawing.read(source, target.machine, wanted)
    posted = post_drawing(read, wanted, target, check=not no_verify)
    say_findings(posted.findings, quiet=quiet, verbose=verbose)
    if posted.failed or posted.program is None:
        say(f"camtool: error: {source}: nothing was written; mend the errors above", quiet=False)
        return 1
    # A dialect of several forms (binary, listing) says only now which extension it takes.
    output = output or _name_for(source, posted.program.extension)
    check_writable([output, preview, report], [source])
    files = {output: posted.program.data}
    if preview is not None:
        files[preview] = _picture(preview, read, wanted, posted, target)
    if report is not None and posted.verification is not None:
        files[report] = posted.verification.report.to_json().encode()
    write_all(files)
    if posted.verification is not None:
        say(posted.verification.report.to_text(findings=False), quiet=quiet)
    where = "stdout" if output == STDOUT else output
    say(f"written: {where} ({len(posted.program.data)} bytes)", quiet=quiet)
    return 0


def _name_for(source: str, extension: str) -> str:
    """The program's name when none is given: the drawing's, here; stdin goes to stdout."""
    return STDOUT if source == STDOUT else Path(source).stem + extension


def _picture(name: str, drawing: Drawing, job: Job, posted: Posted, target: LoadedTarget) -> bytes:
    from camtool.pipeline import picture
    from camtool.preview.render import render

    scene = picture(
        title=Path(drawing.file).name,
        drawing=drawing,
        job=job,
        toolpath=posted.decoded,
        verification=posted.verification,
        machine=target.machine,
    )
    return render(scene, name)
