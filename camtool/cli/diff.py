"""`camtool diff`: what two programs, machines, jobs or drawings cut differently."""

from __future__ import annotations

import json

import click

from camtool.cli.files import STDOUT, check_places, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, show_text
from camtool.cli.options import (
    DrawingFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    job_options,
    length,
    machine_options,
    talk_options,
)
from camtool.cli.picture_options import is_viewer, picture_name
from camtool.records import replace

DEFAULT_LIMIT_MM = 0.01
"""Default of --max-difference: stocks that differ by no more count as equal."""


@click.command(cls=SectionedCommand, short_help="What two programs or jobs cut differently.")
@click.argument("first", metavar="A")
@click.argument("second", metavar="[B]", required=False)
@machine_options
@click.option("--other-target", metavar="NAME", help="The machine of B, if it is another one.")
@click.option("--other-machine", metavar="NAME", help="Your own machine for B.")
@click.option("--other-job", metavar="FILE", help="The job file of B, if it is another one.")
@click.option(
    "--max-difference",
    "limit",
    metavar="LENGTH",
    callback=length,
    help="Exit code 1 when A and B are farther apart, in plane or depth; default 0.01mm.",
)
@click.option("--json", "report", metavar="FILE", help="The figures as JSON; - is stdout.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of where B cuts more, or less if that is more, .svg or .png; .html has both "
    "stocks and both differences.",
)
@job_options
@drawing_options
@talk_options
def diff(
    first: str,
    second: str | None,
    machine: MachineFlags,
    other_target: str | None,
    other_machine: str | None,
    other_job: str | None,
    limit: float | None,
    report: str | None,
    preview: str | None,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Compare the stock after A with the stock after B: where, how far and how much more is cut.

    A and B are programs of the machine, or drawings, which are posted with the job. Without B, A
    is compared with itself under another machine or job. The distance is proved: no point of the
    one surface is farther from the other, in the plane or along Z. Exit code 1 when it is more
    than --max-difference, or cannot be proved to be less."""
    is_other = other_target is not None or other_machine is not None
    if second is None and other_job is None and not is_other:
        raise click.UsageError(
            "nothing to compare with: give B, --other-job, --other-target or --other-machine"
        )
    sources = [first, second, other_job, *machine.files(), *job.files()]
    check_places(sources, [report, preview])
    limit_mm = DEFAULT_LIMIT_MM if limit is None else limit
    if not limit_mm > 0.0:
        raise click.UsageError("--max-difference must be above 0")

    from camtool.cli.difference import (
        ComparedSide,
        difference_facts,
        difference_page,
        difference_picture,
        difference_text,
    )
    from camtool.stock.cut import difference_of

    other = MachineFlags.of(other_target, other_machine, ()) if is_other else machine
    sides = [
        ComparedSide(first, machine, job, drawing),
        ComparedSide(
            first if second is None else second,
            other,
            job if other_job is None else replace(job, file=other_job),
            drawing,
        ),
    ]
    stocks = []
    for side in sides:
        stock = side.stock(quiet=quiet, verbose=verbose)
        if stock is None:
            return 1
        stocks.append(stock)
    progress().begin("comparing")
    difference = difference_of(stocks[0], stocks[1], limit_mm)
    differs = difference.distance_mm > limit_mm * (1.0 + 1e-9)
    names = [side.name for side in sides]
    files: dict[str, bytes] = {}
    text = difference_text(difference, names)
    if report is not None:
        facts = difference_facts(difference, stocks, limit_mm, differs=differs)
        files[report] = (json.dumps(facts, indent=2) + "\n").encode()
    if preview is not None:
        pair = (stocks[0], stocks[1])
        if is_viewer(preview):
            files[preview] = difference_page(pair, names, text).encode()
        else:
            files[preview] = difference_picture(pair, difference, names, preview)
    write_all(files)
    if not quiet and STDOUT not in files:
        show_text(text)
    if differs:
        proved = max(difference.deeper.low, difference.shallower.low) > limit_mm
        verb = "differ by" if proved else "may differ by"
        say(f"camtool: the two {verb} more than {limit_mm:g} mm", quiet=quiet)
    return int(differs)
