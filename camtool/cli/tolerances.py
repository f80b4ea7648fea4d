"""`camtool tolerances`: begin a file of dimensions and their limits, or see what one says."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_new, check_places, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, say_findings, show_text
from camtool.cli.options import (
    DrawingFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    machine_options,
    talk_options,
)
from camtool.findings import Finding, Severity
from camtool.importers.findings import DrawingCode
from camtool.inspection.dimensions import ZONES
from camtool.inspection.limits import deviation_words
from camtool.inspection.proposal import propose_file
from camtool.inspection.tolerances import dimensions_of, read_tolerances, unbound_findings
from camtool.plain import one_line, to_json
from camtool.project import project_of
from camtool.verification.report import finding_reports

if TYPE_CHECKING:
    from camtool.inspection.dimensions import Dimension

FILE = "tolerances.toml"


@click.group(short_help="Dimensions and their limits: begin a file, or see what one says.")
def tolerances() -> None:
    """Files of tolerances say which sizes of a drawing are inspected, and within which limits.

    \b
    camtool tolerances new  part.dxf                  a file to fill in, from the drawing
    camtool tolerances show tolerances.toml           what it says
    camtool tolerances show tolerances.toml --against part.dxf
                                                      the same with sizes and limits as numbers"""


@tolerances.command(cls=SectionedCommand, short_help="Begin a file of tolerances.")
@click.argument("source", metavar="DRAWING")
@click.option("-o", "--output", metavar="FILE", help=f"The file; - is stdout.  [{FILE}]")
@click.option(
    "--job", "job_file", metavar="FILE", help="Also the depths that this job cuts, on --target."
)
@machine_options
@drawing_options
@talk_options
def new(
    source: str,
    output: str | None,
    job_file: str | None,
    machine: MachineFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> None:
    """Write the dimensions of DRAWING (- is stdin): those that it says itself with their limits,
    then its circles, slots and the overall sizes of its outlines, to which you give limits. With
    --job the depths of its pockets, grooves and blind holes, and what is left under its floors."""
    output = output or FILE
    flags = JobFlags(job_file, project=project_of(Path.cwd()))
    check_places([source, *flags.files(), *machine.files()], [output])
    check_new(output)
    floors: list[Dimension] = []
    if job_file is None:
        read = drawing.read(source)
    else:
        from camtool.inspection.depths import proposed_floors

        target, job = machine.load().machine, flags.job(drawing)
        read = drawing.read(source, target, job)
        progress().begin("planning")
        floors = list(proposed_floors(read, job, target))
    progress().begin("finding what can be measured")
    text, findings, faults = propose_file(read, floors)
    write_all({output: text.encode()})
    say_findings((*_relevant_findings(read.findings), *findings), quiet=quiet, verbose=verbose)
    for fault in faults:
        say(f"camtool: warning: {fault}", quiet=quiet)
    place = "stdout" if output == STDOUT else output
    count = sum(line == "[[dimension]]" for line in text.splitlines())
    count_text = f"{count} dimension{'s' if count != 1 else ''}"
    say(f"written: {place}, {count_text}; put in the limits that matter", quiet=quiet)
    if any(each.severity == Severity.ERROR for each in findings):
        raise click.exceptions.Exit(1)


@tolerances.command(cls=SectionedCommand, short_help="What a file of tolerances says.")
@click.argument("file", metavar="FILE")
@click.option(
    "--against", metavar="DRAWING", help="Say the sizes and limits in this drawing, and its own."
)
@click.option("--json", "report", metavar="FILE", help="The same as JSON; - is stdout.")
@drawing_options
@talk_options
def show(
    file: str,
    against: str | None,
    report: str | None,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> None:
    """Check the tolerances FILE, and say nominal size and limits of each of its dimensions, with
    --against also those that the drawing says itself."""
    import msgspec

    check_places([file, against], [report])
    _, dimensions = read_tolerances(Path(file))
    findings: tuple[Finding, ...] = ()
    if against is not None:
        read = drawing.read(against)
        dimensions, remarks = dimensions_of(read, Path(file))
        findings = (
            *_relevant_findings(read.findings),
            *remarks,
            *unbound_findings(read, dimensions),
        )
    if report is not None:
        rows = [_facts(each) for each in dimensions]
        reports = msgspec.to_builtins(finding_reports(findings))
        write_all({report: to_json({"dimensions": rows, "findings": reports}).encode()})
    if not quiet and report != STDOUT:
        for line in _lines(dimensions):
            show_text(one_line(line).rstrip())
    say_findings(findings, quiet=quiet, verbose=verbose)
    if any(each.severity == Severity.ERROR for each in findings):
        raise click.exceptions.Exit(1)


def _relevant_findings(findings: Sequence[Finding]) -> Iterator[Finding]:
    """Yield the findings of reading the drawing, except those about ignored dimension lines: this
    command reads the dimensions."""
    for each in findings:
        if each.code != DrawingCode.ENTITY_SKIPPED or " DIMENSION left out" not in each.message:
            yield each


def _facts(each: Dimension) -> dict[str, Any]:
    """Return a dimension as data for JSON."""
    limits = each.limits
    return {
        "name": each.name,
        "kind": each.kind,
        "places_mm": each.places_mm,
        "direction_rad": each.direction_rad,
        "nominal_mm": each.nominal_mm,
        "lower_mm": None if limits is None else limits.lower_mm,
        "upper_mm": None if limits is None else limits.upper_mm,
        "limits": limits.said if limits is not None else each.words or each.general or None,
        "source": each.source,
    }


def _lines(dimensions: Sequence[Dimension]) -> Iterator[str]:
    """Yield one line for each dimension: name, kind, nominal size, deviations, smallest and
    largest size."""
    rows = [_cells(each) for each in dimensions]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True))


def _cells(each: Dimension) -> tuple[str, ...]:
    nominal = "as drawn" if each.nominal_mm is None else f"{round(each.nominal_mm, 6):.6g} mm"
    limits, sizes = each.words or each.general or "no limits", ""
    zone = limits if each.limits is None else each.limits.said
    if each.limits is not None and each.kind not in ZONES:
        lower, upper = each.limits.lower_mm, each.limits.upper_mm
        limits = deviation_words(lower, upper)
        if each.nominal_mm is not None:
            sizes = f"{each.nominal_mm + lower:.7g} … {each.nominal_mm + upper:.7g} mm"
    elif each.limits is not None:
        nominal, limits = "", f"{each.limits.upper_mm:g} mm"
    tolerance = zone if zone != limits else ""
    return each.name, each.kind, nominal, limits, sizes, tolerance, each.source
