"""`camtool verify`: simulate and judge any program of a machine, or compare variants of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import click
from msgspec import Struct

from camtool.cli.checks import CheckOutputs, check_outputs
from camtool.cli.files import STDOUT, display_name, read_bytes, write_all
from camtool.cli.life_signs import progress
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
    InspectionFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    gate_options,
    inspection_options,
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
from camtool.cli.plot_options import PlotFlags, plot_options
from camtool.cli.report import ReportOutputs, report_option
from camtool.jobs.keys import PLACE
from camtool.pictures.options import points_for
from camtool.plain import to_json
from camtool.records import replace

if TYPE_CHECKING:
    from camtool.comparison import ProgramVariant
    from camtool.geometry.drawing import Drawing
    from camtool.pictures.scene import Scene
    from camtool.pipeline import Judging
    from camtool.planning.job import Job
    from camtool.run import Run
    from camtool.target.registry import LoadedTarget


@click.command(cls=SectionedCommand, short_help="Simulate and judge a program.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option("--against", metavar="DRAWING", help="The drawing that it should make.")
@click.option(
    "--align",
    is_flag=True,
    help="Find where the drawing lies under a program that others made; for --against.",
)
@click.option(
    "--interpolator",
    metavar="[dsm|dda|stairs]",
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
    help="How many of the moves with the largest errors to list.",
)
@click.option(
    "--compare",
    metavar="WHAT",
    help="Judge several variants: interpolators, mechanics, backlash=0,0.1,0.2 or any "
    "KEY=VALUE,VALUE of the machine.",
)
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the predicted result (with --compare: of all variants), .svg or .png; "
    ".html to pan, zoom and play.",
)
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@report_option
@check_outputs
@click.option(
    "--beside",
    "second_program",
    metavar="PROGRAM",
    help="Another program beside it in the picture: one scale, one map of errors.",
)
@plot_options
@picture_options
@gate_options
@inspection_options
@job_options
@drawing_options
@talk_options
def verify(
    program: str,
    machine: MachineFlags,
    against: str | None,
    align: bool,
    interpolator: str | None,
    without: tuple[str, ...],
    worst: int | None,
    compare: str | None,
    preview: str | None,
    report: str | None,
    page: str | None,
    checks: CheckOutputs,
    second_program: str | None,
    plots: PlotFlags,
    picture: PictureFlags,
    gates: GateFlags,
    inspection: InspectionFlags,
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

    Of a program that others made, without flags that say how it cuts, it is found which contours
    it cuts, on which side and with what tool (or --tool-diameter), and with --align where the
    drawing lies; then how far it is from them, and what is not cut."""
    outputs = ReportOutputs(preview, report, page, checks, plots)
    wishes = VerifyOutputs(outputs, picture, second_program, quiet, verbose)
    wishes.check(comparing=compare is not None, gated=gates.given)
    finding = _finds_contours(job, against, align=align, comparing=compare is not None)
    leaves_none = "--compare" if compare is not None else None
    inspection.check(without=leaves_none)
    if inspection.tolerances is not None and against is None:
        raise click.UsageError("--tolerances needs the drawing: give --against")
    read_files = [*machine.files(), *job.files(), *inspection.files()]
    wishes.outputs.check([program, against, second_program, *read_files])

    from camtool.comparison import effects_without
    from camtool.pipeline import Judging

    judging = Judging(
        interpolator=interpolator,
        effects=effects_without(without) if without else None,
        gates=gates.gates(),
        worst=worst,
        trace_points=None if compare else points_for(wishes.outputs.pictures),
        found=align,
        align=align,
    )
    target = machine.load()
    with checks.reporting_refusal(program), job.name_job_file():
        job_used = job.job(drawing)
        read = drawing.read(against, target.machine, job_used) if against else None
        case = VerifySettings(target, judging, read, job_used, finding)
        if compare is not None:
            return _compare(program, _variants(compare, machine, judging), case, wishes)
        return _judge(program, case, inspection, wishes)


def _finds_contours(job: JobFlags, against: str | None, *, align: bool, comparing: bool) -> bool:
    """Return True if no flag says how the program cuts, so that contours, side and tool must be
    found from the program. A usage error if that contradicts `--align`."""
    is_described = job.beyond({*PLACE, "tool_diameter"})
    if align and against is None:
        raise click.UsageError("--align needs --against DRAWING")
    if align and comparing:
        raise click.UsageError("--align is for a single variant; drop --compare")
    if align and is_described:
        raise click.UsageError(
            f"--align finds how the program cuts; drop {', '.join(is_described)}, or --align"
        )
    if align and "origin" in job.given:
        raise click.UsageError("--align finds the place; drop --origin, or --align")
    return against is not None and not is_described


def _variants(spec: str, machine: MachineFlags, judging: Judging) -> list[ProgramVariant]:
    """Return the variants that `--compare SPEC` names; OptionError if it names none."""
    from camtool.comparison import variants_of

    def load(extra: Sequence[str]) -> LoadedTarget:
        return replace(machine, settings=(*machine.settings, *extra)).load()

    return variants_of(spec, load, judging)


class VerifyOutputs(Struct, frozen=True):
    """The requested outputs, and options of pictures; `second_program` is another program for the
    picture."""

    outputs: ReportOutputs
    looks: PictureFlags
    second_program: str | None
    quiet: bool
    verbose: bool

    def check(self, *, comparing: bool, gated: bool) -> None:
        """Raise a usage error for flags that contradict each other."""
        outputs = self.outputs
        outputs.plots.check(self.looks.given, pictures=bool(outputs.pictures))
        if not comparing:
            self.looks.check([*outputs.pictures, *outputs.plots.names], RESULT)
            if self.second_program is not None:
                check_beside("--beside", outputs.pictures)
            return
        outputs.plots.refuse("is of a single variant; drop --compare")
        if outputs.page is not None:
            raise click.UsageError("--report is for a single variant; drop --compare")
        if outputs.checks.names:
            raise click.UsageError(
                "--sarif, --junit and --annotations are for a single variant; drop --compare"
            )
        if gated:
            raise click.UsageError("limits are for a single variant; drop --compare")
        if self.second_program is not None:
            raise click.UsageError("--beside is for a single variant; drop --compare")
        if outputs.preview is not None and is_viewer(outputs.preview):
            raise click.UsageError("--compare draws only .svg and .png")
        self.looks.check(outputs.pictures, OVERLAY)


class VerifySettings(Struct, frozen=True, eq=False):
    """The settings of judging programs: the machine, the criteria, the drawing. `finding`: the
    contours that a program cuts are found from the program itself, for programs by others."""

    target: LoadedTarget
    judging: Judging
    drawing: Drawing | None
    job: Job
    finding: bool = False

    def judge(self, file: str) -> Run:
        """Run and judge the program in a file."""
        from camtool.pipeline import verify_program

        data, judging = read_bytes(file), self.judging
        if self.finding and self.target.target.made_elsewhere(data):
            judging = replace(judging, found=True)
        return verify_program(
            data,
            self.target,
            source=display_name(file),
            drawing=self.drawing,
            job=self.job,
            judging=judging,
            progress=progress(),
        )


def _judge(
    file: str, case: VerifySettings, inspection: InspectionFlags, wishes: VerifyOutputs
) -> int:
    """Show the verdict on one program and write its files; return the exit code."""
    run, outputs = inspection.inspect_run(case.judge(file)), wishes.outputs

    def scenes() -> list[Scene]:
        return [
            run.scene(),
            *([case.judge(wishes.second_program).scene()] if wishes.second_program else []),
        ]

    files = outputs.files(run, wishes.looks.painter(scenes, quiet=wishes.quiet))
    write_all({**files, **outputs.check_files([(run, run.source)])})
    to_stdout = STDOUT in (outputs.report, outputs.page, *outputs.checks.names)
    if run.report is not None and not to_stdout and not wishes.quiet:
        show_facts(run.report.to_text(findings=False), REPORT_NAMES, report_marks(run.findings))
        if case.judging.worst:
            show_text(run.report.worst_text())
    say_findings(run.findings, quiet=wishes.quiet, verbose=wishes.verbose)
    if not run.failed:
        return 0
    say(f"camtool: error: {run.source}: the errors above would spoil the part")
    return 1


def _compare(
    file: str, variants: list[ProgramVariant], case: VerifySettings, wishes: VerifyOutputs
) -> int:
    """Show the table of all variants and write their picture; return the exit code."""
    from camtool.comparison import compare_program

    comparison = compare_program(
        read_bytes(file),
        variants,
        source=display_name(file),
        drawing=case.drawing,
        job=case.job,
        progress=progress(),
    )
    files: dict[str, bytes] = {}
    if wishes.outputs.preview is not None:
        from camtool.pictures.overlay import render_overlay

        files[wishes.outputs.preview] = render_overlay(
            comparison.scene(), wishes.outputs.preview, wishes.looks.options()
        )
    if wishes.outputs.report is not None:
        files[wishes.outputs.report] = to_json(list(comparison.rows)).encode()
    write_all(files)
    if wishes.outputs.report != STDOUT and not wishes.quiet:
        show_compared(str(comparison), comparison.rows)
    return 0
