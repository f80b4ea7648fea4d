"""`camtool preview`: picture of a drawing, a toolpath or a program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.jobflags import JobFlags, job_options
from camtool.cli.options import (
    MachineFlags,
    machine_options,
    talk_options,
)
from camtool.cli.output import check_writable, write_all
from camtool.cli.pictureflags import (
    DRAWING,
    RESULT,
    Canvas,
    PictureFlags,
    check_beside,
    picture_options,
)
from camtool.cli.programs import read_bytes
from camtool.cli.sections import SectionedCommand
from camtool.cli.talk import say, say_findings, say_first_run
from camtool.cli.types import is_viewer
from camtool.cli.types import picture as picture_name
from camtool.errors import CamtoolError

if TYPE_CHECKING:
    from camtool.preview.draw import Scene


@click.command(cls=SectionedCommand, short_help="Picture of a drawing, toolpath or program.")
@click.argument("source", metavar="FILE")
@click.option(
    "-o",
    "--output",
    metavar="PICTURE",
    callback=picture_name,
    required=True,
    help="A .svg or .png file; .html to pan, zoom and play.",
)
@machine_options
@click.option("--simulate", is_flag=True, help="Show the predicted path and its error too.")
@click.option(
    "--beside",
    metavar="FILE",
    help="Another file of the same flags, beside the first: one scale, one map of errors.",
)
@picture_options
@job_options
@drawing_options
@talk_options
def preview(
    source: str,
    output: str,
    machine: MachineFlags,
    simulate: bool,
    beside: str | None,
    picture: PictureFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Draw FILE: a drawing; with --target its toolpath; or a program of that target.

    A file with the target's own extension (such as .pic) is taken for a program.
    """
    if simulate and machine.name() is None:
        raise click.UsageError("--simulate needs --target")
    picture.check([output], _canvas(machine, simulate=simulate))
    sources = [source] if beside is None else [source, beside]
    if beside is not None:
        check_beside("--beside", [output])
    check_writable([output], sources)
    # What is to be played needs its times, which only the machine's model knows.
    simulate = simulate or (is_viewer(output) and machine.name() is not None)

    say_first_run(quiet=quiet)
    scenes = [_scene(name, machine, simulate, job, drawing) for name in sources]
    write_all({output: picture.painter(lambda: scenes, quiet=quiet)(output)})
    for scene in scenes:
        findings = scene.drawing.findings if scene.drawing is not None else ()
        say_findings(findings, quiet=quiet, verbose=verbose)
    say(f"written: {output}", quiet=quiet)
    return 0


def _canvas(machine: MachineFlags, *, simulate: bool) -> Canvas:
    """What the picture can show."""
    if machine.name() is None:
        return DRAWING
    return RESULT if simulate else Canvas("add --simulate")


def _scene(
    source: str, machine: MachineFlags, simulate: bool, job: JobFlags, drawing: DrawingFlags
) -> Scene:
    """What to draw: a drawing, a program, or the toolpath planned from a drawing."""
    from camtool.pipeline import (
        listing_of,
        picture,
        post_drawing,
        posted_scene,
        verify_program,
    )
    from camtool.planning.plan import plan

    title = Path(source).name
    if machine.name() is None:
        _refuse_program(source)
        read = drawing.read(source)
        return picture(title=Path(read.file).name, drawing=read)
    target = machine.load()
    if Path(source).suffix.lower() == target.machine.target.extension:
        data = read_bytes(source)
        decoded, verification = verify_program(data, target, source=source)
        judged = verification if simulate else None
        return picture(
            title=title,
            toolpath=decoded,
            verification=judged,
            machine=target.machine,
            listing=listing_of(data, target, decoded),
        )
    wanted = job.job(drawing)
    read = drawing.read(source, target.machine, wanted)
    if not simulate:
        with job.blamed():
            toolpath = plan(read, wanted, target.machine)
        return picture(
            title=title,
            drawing=read,
            job=wanted,
            toolpath=toolpath,
            machine=target.machine,
        )
    with job.blamed():
        posted = post_drawing(read, wanted, target)
    return posted_scene(posted, target, title=title, drawing=read, job=wanted)


def _refuse_program(source: str) -> None:
    """CamtoolError when the file's extension says that it is a program and no target is given."""
    from camtool.machine.registry import list_target, target_names

    for name in target_names():
        try:
            extension = list_target(name).target.extension
        except CamtoolError:  # a broken plug-in harms nothing else
            continue
        if Path(source).suffix.lower() == extension:
            raise CamtoolError(
                "is a program", file=source, mend=f"say whose, such as --target {name}"
            )
