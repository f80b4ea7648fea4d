"""`camtool verify`: simulate and judge any program of a machine."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
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
from camtool.cli.output import STDOUT, check_writable, write_all
from camtool.cli.pictureflags import OVERLAY, RESULT, PictureFlags, picture_options
from camtool.cli.report import (
    Subject,
    flags_given,
    picture_beside,
    pictures_asked,
    report_files,
    report_option,
)
from camtool.cli.sections import SectionedCommand
from camtool.cli.talk import say, say_findings, say_first_run
from camtool.cli.types import is_viewer
from camtool.cli.types import picture as picture_name
from camtool.errors import ProgramError

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing
    from camtool.machine.controllers import Interpolator
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline import Judging, Way
    from camtool.planning.job import Job
    from camtool.preview.scene import Scene


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
    picture: PictureFlags,
    gates: GateFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Simulate PROGRAM (- is stdin) as the machine would run it, and judge the result.

    With --against, the path is compared with what DRAWING would give, planned with the same flags
    (--tool-diameter, --side ...). Exit code 1 when a finding is an error.
    """
    if compare is not None and page is not None:
        raise click.UsageError("--report is of one way to run a program; drop --compare")
    picture.check(pictures_asked(page, preview), RESULT if compare is None else OVERLAY)
    beside = picture_beside(page, preview)
    inputs = [program, *([against] if against else [])]
    check_writable([preview, report, page, beside], inputs)

    from camtool.pipeline import Judging

    judging = Judging(
        interpolator=cast("Interpolator | None", interpolator),
        effects=left_out(without) if without else None,
        gates=gates.gates(),
        compensated=compensated,
        worst=worst,
    )
    target = machine.load()
    say_first_run(quiet=quiet)
    data = read_bytes(program)
    wanted = job.job(drawing)
    read = drawing.read(against, target.machine, wanted) if against else None
    goal = Goal(shown(program), read, wanted)
    if compare is not None:
        if judging.gates is not None:
            raise click.UsageError("limits hold for one way to run a program; drop --compare")
        if preview is not None and is_viewer(preview):
            raise click.UsageError("--compare draws .svg and .png alone")
        ways = ways_to_compare(compare, machine, judging)
        with job.blamed():
            return _compared(data, ways, goal, Wishes(preview, picture, report, quiet))
    with job.blamed():
        wishes = Wishes(preview, picture, report, quiet, verbose, page)
        return _judged(data, target, judging, goal, wishes)


@dataclass(frozen=True)
class Goal:
    """The program's name in messages, and what it is held against."""

    name: str
    drawing: Drawing | None
    job: Job


@dataclass(frozen=True)
class Wishes:
    """What the user wants to have."""

    preview: str | None
    looks: PictureFlags
    report: str | None
    quiet: bool
    verbose: bool = False
    page: str | None = None


def _judged(
    data: bytes, target: LoadedTarget, judging: Judging, goal: Goal, wishes: Wishes
) -> int:
    """The verdict on one program; the exit code."""
    from camtool.findings import Severity, worst
    from camtool.pipeline import listing_of, picture, verify_program

    decoded, verification = verify_program(
        data, target, source=goal.name, drawing=goal.drawing, job=goal.job, judging=judging
    )
    files: dict[str, bytes] = {}

    def scenes() -> list[Scene]:
        scene = picture(
            title=Path(goal.name).name,
            drawing=goal.drawing,
            job=goal.job,
            toolpath=decoded,
            verification=verification,
            machine=target.machine,
            listing=listing_of(data, target, decoded),
        )
        return [scene]

    pictured = wishes.looks.painter(scenes, quiet=wishes.quiet)
    if wishes.preview is not None:
        files[wishes.preview] = pictured(wishes.preview)
    if wishes.report is not None:
        files[wishes.report] = verification.report.to_json().encode()
    if wishes.page is not None:
        subject = Subject(
            title=Path(goal.name).name,
            target=target,
            report=verification.report,
            findings=verification.findings,
            program=data,
            flags=flags_given(),
        )
        files.update(report_files(wishes.page, subject, pictured, preview=wishes.preview))
    write_all(files)
    if STDOUT not in (wishes.report, wishes.page) and not wishes.quiet:
        click.echo(verification.report.to_text(findings=False))
        if judging.worst:
            click.echo(verification.report.worst_text())
    say_findings(verification.findings, quiet=wishes.quiet, verbose=wishes.verbose)
    failed = worst(verification.findings) >= Severity.ERROR
    if failed:
        say(f"camtool: error: {goal.name}: the errors above would spoil the part", quiet=False)
    return 1 if failed else 0


def _compared(data: bytes, ways: list[Way], goal: Goal, wishes: Wishes) -> int:
    """The table of all ways, and their picture; the exit code."""
    from camtool.pipeline import compare_picture, compare_program
    from camtool.verify.contrast import row_of, table, to_json

    variants = compare_program(data, ways, source=goal.name, drawing=goal.drawing, job=goal.job)
    rows = [row_of(variant.name, variant.verification.report) for variant in variants]
    files: dict[str, bytes] = {}
    if wishes.preview is not None:
        from camtool.preview.overlay import render_overlay

        overlay = compare_picture(data, ways, variants, title=Path(goal.name).name)
        files[wishes.preview] = render_overlay(overlay, wishes.preview, wishes.looks.options())
    if wishes.report is not None:
        files[wishes.report] = to_json(rows).encode()
    write_all(files)
    if wishes.report != STDOUT and not wishes.quiet:
        click.echo(table(rows))
    return 0


def shown(name: str) -> str:
    """The name of a file in messages."""
    return "<stdin>" if name == STDOUT else name


def read_bytes(name: str) -> bytes:
    """The bytes of a file, or of stdin for `-`; ProgramError when it cannot be read."""
    if name == STDOUT:
        return sys.stdin.buffer.read()
    try:
        return Path(name).read_bytes()
    except OSError as error:
        raise ProgramError(
            f"cannot be read ({error.strerror})", file=name, mend="check the path"
        ) from error
