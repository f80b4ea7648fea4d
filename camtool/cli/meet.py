"""`camtool meet`: what would make the dimensions of a part hold, as a job file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from camtool.cli.files import STDOUT, check_ours, check_places, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, say_findings, show_text
from camtool.cli.options import (
    DRAWING,
    DrawingFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    job_options,
    machine_options,
    talk_options,
)
from camtool.plain import one_line, to_json

if TYPE_CHECKING:
    from camtool.inspection.meet import Meeting


@click.command(cls=SectionedCommand, short_help="What would make its dimensions hold.")
@click.argument("source", metavar="DRAWING")
@click.option(
    "--tolerances",
    metavar="FILE",
    required=True,
    help="Dimensions with limits: a tolerances.toml, or 'drawing' for the drawing's own alone.",
)
@click.option("-o", "--output", metavar="FILE", help="The job; - is stdout.  [DRAWING.meet.toml]")
@click.option("--json", "report", metavar="FILE", help="The report; - is stdout.")
@click.option(
    "--most",
    "max_trials",
    type=click.IntRange(min=1),
    metavar="COUNT",
    help="So many programs are tried at most.  [100]",
)
@machine_options
@job_options
@drawing_options
@talk_options
def meet(
    source: str,
    tolerances: str,
    output: str | None,
    report: str | None,
    max_trials: int | None,
    machine: MachineFlags,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Find the cheapest change of the job after which all dimensions of DRAWING hold.

    Allowances, direction, start, feed, compensation, approach, order and the controller's way to
    draw are tried, each by a program that is posted, simulated and inspected. The best job is
    written, with what it changes. Where none holds, exit code 1, and why: the dimension that
    decides, and how good the machine would have to be."""
    from camtool.inspection.meet import DEFAULT_TRIALS, MeetingCase, is_proposal, to_data, to_text
    from camtool.inspection.meet import meet as met
    from camtool.inspection.tolerances import dimensions_of
    from camtool.inspection.verdicts import NOT_INSPECTED, Tolerances

    named = output is not None
    if output is None:
        output = STDOUT if source == STDOUT else f"{Path(source).stem}.meet.toml"
    file = None if tolerances == DRAWING else Path(tolerances)
    check_places([source, tolerances, *machine.files(), *job.files()], [output, report])
    target = machine.load()
    place = Path(output) if output != STDOUT else Path("job.toml")
    job_used, tables, job_of = job.as_file(drawing, place)
    with job.name_job_file():
        read = drawing.read(source, target.machine, job_used)
        dimensions, findings = dimensions_of(read, file)
        limits = Tolerances(dimensions, findings)
        say_findings((*read.findings, *findings), quiet=quiet, verbose=verbose)
        result = met(
            MeetingCase(read, target, tables, job_of, limits),
            max_trials or DEFAULT_TRIALS,
            progress(),
        )
    files = {output: result.text.encode()} if result.changed else {}
    if files and not named:
        check_ours(output, is_proposal)
    if report is not None:
        files[report] = to_json(to_data(result)).encode()
    write_all(files)
    left_out = [each for each in result.run.findings if each.code in NOT_INSPECTED]
    say_findings(left_out, quiet=quiet, verbose=verbose)
    if not quiet:
        for line in to_text(result).splitlines():
            show_text(one_line(line), err=True)
    _say_end(result, source, output, quiet=quiet)
    return 0 if result.holds else 1


def _say_end(result: Meeting, source: str, output: str, *, quiet: bool) -> None:
    """Report the name of the written file, and whether all dimensions hold with its job."""
    place = "stdout" if output == STDOUT else output
    if result.holds and not result.changed:
        say("every dimension holds as it is: no job was written", quiet=quiet)
    elif result.holds:
        say(f"written: {place}, a job with which every dimension holds", quiet=quiet)
    else:
        count = len(result.after.short) + result.after.missing
        suffix = f"; {place} is better, and not enough" if result.changed else ""
        say(
            f"camtool: error: {source}: no job was found with which every dimension holds:"
            f" {count} would not{suffix}"
        )
