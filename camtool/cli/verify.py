"""What `verify` gives: the verdict on one program, or the table of several ways to run it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from camtool.cli.files import STDOUT, check_places, read_bytes, shown, write_all
from camtool.cli.first_run import say_first_run
from camtool.cli.messages import (
    REPORT_NAMES,
    report_marks,
    say,
    say_findings,
    show_compared,
    show_facts,
    show_text,
)
from camtool.cli.options import (
    DrawingFlags,
    GateFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    gate_options,
    job_options,
    machine_options,
    talk_options,
)
from camtool.cli.picture_options import (
    OVERLAY,
    RESULT,
    PictureFlags,
    check_beside,
    is_viewer,
    picture_name,
    picture_options,
)
from camtool.cli.report import (
    Subject,
    flags_given,
    picture_beside,
    pictures_asked,
    refuse_foreign_picture,
    report_files,
    report_option,
)

if TYPE_CHECKING:
    from camtool.comparison import Way
    from camtool.geometry.drawing import Drawing
    from camtool.machine.controllers import Interpolator
    from camtool.machine.registry import LoadedTarget
    from camtool.pictures.scene import Scene
    from camtool.pipeline import Judging
    from camtool.planning.job import Job
    from camtool.run import Run


@dataclass(frozen=True)
class Wishes:
    """What the user wants to have; `beside` is another program for the picture."""

    preview: str | None
    looks: PictureFlags
    report: str | None
    page: str | None
    beside: str | None
    quiet: bool
    verbose: bool


@dataclass(frozen=True, eq=False)
class Case:
    """How programs are judged: on which machine, by what, against which drawing."""

    target: LoadedTarget
    judging: Judging
    drawing: Drawing | None
    job: Job

    def judge(self, file: str) -> Run:
        """The program in a file, run and judged."""
        from camtool.pipeline import verify_program

        return verify_program(
            read_bytes(file),
            self.target,
            source=shown(file),
            drawing=self.drawing,
            job=self.job,
            judging=self.judging,
        )


def _subject(run: Run) -> Subject:
    """What the page of a program is about."""
    return Subject(
        title=Path(run.source).name,
        target=run.target,
        report=run.report,
        findings=run.findings,
        program=None if run.program is None else run.program.data,
        flags=flags_given(),
    )


def judged(file: str, case: Case, wishes: Wishes) -> int:
    """The verdict on one program, in words and files; the exit code."""
    one = case.judge(file)
    report, findings = one.report, one.findings
    assert report is not None

    def scenes() -> list[Scene]:
        return [one.scene(), *([case.judge(wishes.beside).scene()] if wishes.beside else [])]

    painted = wishes.looks.painter(scenes, quiet=wishes.quiet)
    files: dict[str, bytes] = {}
    if wishes.preview is not None:
        files[wishes.preview] = painted(wishes.preview)
    if wishes.report is not None:
        files[wishes.report] = report.to_json().encode()
    if wishes.page is not None:
        files.update(report_files(wishes.page, _subject(one), painted, preview=wishes.preview))
    write_all(files)
    if STDOUT not in (wishes.report, wishes.page) and not wishes.quiet:
        show_facts(report.to_text(findings=False), REPORT_NAMES, report_marks(findings))
        if case.judging.worst:
            show_text(report.worst_text())
    say_findings(findings, quiet=wishes.quiet, verbose=wishes.verbose)
    if not one.failed:
        return 0
    say(f"camtool: error: {one.source}: the errors above would spoil the part", quiet=False)
    return 1


def compared(file: str, ways: list[Way], case: Case, wishes: Wishes) -> int:
    """The table of all ways to run a program, and their picture; the exit code."""
    from camtool.comparison import compare_program
    from camtool.verification.contrast import to_json

    found = compare_program(
        read_bytes(file), ways, source=shown(file), drawing=case.drawing, job=case.job
    )
    files: dict[str, bytes] = {}
    if wishes.preview is not None:
        from camtool.pictures.overlay import render_overlay

        files[wishes.preview] = render_overlay(
            found.scene(), wishes.preview, wishes.looks.options()
        )
    if wishes.report is not None:
        files[wishes.report] = to_json(found.rows).encode()
    write_all(files)
    if wishes.report != STDOUT and not wishes.quiet:
        show_compared(str(found), found.rows)
    return 0


# `camtool verify`: simulate and judge any program of a machine.


INTERPOLATORS = ("dsm", "dda", "stairs")


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

    from camtool.comparison import left_out
    from camtool.pictures.scene import points_for
    from camtool.pipeline import Judging

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
            return compared(program, _ways(compare, machine, judging), case, wishes)
        return judged(program, case, wishes)


def _ways(spec: str, machine: MachineFlags, judging: Judging) -> list[Way]:
    """What `--compare SPEC` stands for; OptionError when it is nothing."""
    from camtool.comparison import ways_of

    def load(more: Sequence[str]) -> LoadedTarget:
        return replace(machine, settings=(*machine.settings, *more)).load()

    return ways_of(spec, load, judging)


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
