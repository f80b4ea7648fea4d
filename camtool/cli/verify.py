"""`camtool verify`: simulate and judge any program of a machine."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.jobflags import JobFlags, job_options
from camtool.cli.judging import GateFlags, gate_options, left_out, ways_to_compare
from camtool.cli.options import (
    INTERPOLATORS,
    MachineFlags,
    machine_options,
    talk_options,
)
from camtool.cli.output import check_places
from camtool.cli.pictureflags import (
    OVERLAY,
    RESULT,
    PictureFlags,
    check_beside,
    picture_options,
)
from camtool.cli.report import (
    picture_beside,
    pictures_asked,
    refuse_foreign_picture,
    report_option,
)
from camtool.cli.sections import SectionedCommand
from camtool.cli.talk import say_first_run
from camtool.cli.types import is_viewer
from camtool.cli.types import picture as picture_name
from camtool.cli.verdict import Case, Wishes, compared, judged

if TYPE_CHECKING:
    from camtool.machine.controllers import Interpolator


@click.command(cls=SectionedCommand, short_help="Simulate and judge a program.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option("--against", metavar="DRAWING", help="The drawing that it should make.")
@click.option(
    "--interpolator",
    type=click.Choice(INTERPOLATORS),
    help="How the controller draws arcs, to compare; default: as the machine does.",
)
@click.option(
    "--without",
    multiple=True,
    metavar="EFFECT",
    help="Leave out a part of the mechanics: play, compensation, scale, squareness, "
    "repeatability.",
)
@click.option(
    "--worst",
    type=click.IntRange(min=0),
    metavar="COUNT",
    help="List so many moves with the largest errors.",
)
@click.option(
    "--compensated",
    is_flag=True,
    help="It was posted with --compensate; for --against.",
)
@click.option(
    "--compare",
    metavar="WHAT",
    help="Judge it several ways: interpolators, mechanics, backlash=0,0.1,0.2 or any "
    "KEY=VALUE,VALUE of the machine.",
)
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result (with --compare: of all ways), .svg or .png; "
    ".html to pan, zoom and play.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@report_option
@click.option(
    "--beside",
    metavar="PROGRAM",
    help="Another program beside it in the picture: one scale, one map of errors.",
)
@picture_options
@gate_options
@job_options
@drawing_options
@talk_options
def verify(
    program: str,
    machine: MachineFlags,
    against: str | None,
    interpolator: str | None,
    without: tuple[str, ...],
    worst: int | None,
    compensated: bool,
    compare: str | None,
    preview: str | None,
    report: str | None,
    page: str | None,
    beside: str | None,
    picture: PictureFlags,
    gates: GateFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate PROGRAM (- is stdin) as the machine would run it, and judge the result.

    With --against, the path is compared with what DRAWING would give, planned with the same flags
    (--tool-diameter, --side ...), and the program with the one that camtool would write: where
    and which way round it cuts, at the resolution of the dialect; feeds, spindle, tool and dwells
    as far as the flags name them; clearance of rapids; its end. Exit code 1 when a finding is an
    error.
    """
    wishes = Wishes(preview, picture, report, page, beside, quiet, verbose)
    _check(wishes, comparing=compare is not None, gated=gates.given)
    check_places(
        [program, against, beside, *machine.files(), *job.files()],
        [preview, report, page, picture_beside(page, preview)],
    )
    refuse_foreign_picture(page, preview)

    from camtool.pipeline import Judging, points_for

    judging = Judging(
        interpolator=cast("Interpolator | None", interpolator),
        effects=left_out(without) if without else None,
        gates=gates.gates(),
        compensated=compensated,
        worst=worst,
        trace_points=points_for(preview),
    )
    target = machine.load()
    say_first_run(quiet=quiet, judging=True)
    wanted = job.job(drawing)
    read = drawing.read(against, target.machine, wanted) if against else None
    case = Case(target, judging, read, wanted)
    with job.blamed():
        if compare is not None:
            return compared(program, ways_to_compare(compare, machine, judging), case, wishes)
        return judged(program, case, wishes)


def _check(wishes: Wishes, *, comparing: bool, gated: bool) -> None:
    """A usage error for flags that contradict each other."""
    pictures = pictures_asked(wishes.page, wishes.preview)
    if not comparing:
        wishes.looks.check(pictures, RESULT)
        if wishes.beside is not None:
            check_beside("--beside", pictures)
        return
    if wishes.page is not None:
        raise click.UsageError("--report is of one way to run a program; drop --compare")
    if gated:
        raise click.UsageError("limits hold for one way to run a program; drop --compare")
    if wishes.beside is not None:
        raise click.UsageError("--beside is for one way to run a program; drop --compare")
    if wishes.preview is not None and is_viewer(wishes.preview):
        raise click.UsageError("--compare draws .svg and .png alone")
    wishes.looks.check(pictures, OVERLAY)
