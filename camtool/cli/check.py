"""`camtool check`: what an importer sees in a drawing."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.options import talk_options
from camtool.cli.output import check_writable, write_all
from camtool.cli.sections import SectionedCommand
from camtool.cli.talk import say_findings, say_first_run
from camtool.cli.types import picture as picture_name

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing


@click.command(cls=SectionedCommand, short_help="What is in a drawing.")
@click.argument("source", metavar="DRAWING")
@click.option("--json", "report", metavar="FILE", help="The same as JSON; - is stdout.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the drawing, .svg or .png.",
)
@drawing_options
@talk_options
def check(
    source: str,
    report: str | None,
    preview: str | None,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Say what an importer sees in DRAWING (- is stdin).

    Units and why, size, layers, entities used and not used, gaps, and the smallest features.
    """
    check_writable([report, preview], [source])
    say_first_run(quiet=quiet)
    read = drawing.read(source)
    facts = _facts(read)
    files: dict[str, bytes] = {}
    if report is not None:
        files[report] = (json.dumps(facts, indent=2, ensure_ascii=False) + "\n").encode()
    if preview is not None:
        from camtool.pipeline import picture
        from camtool.preview.render import render

        files[preview] = render(picture(title=Path(read.file).name, drawing=read), preview)
    write_all(files)
    if report != "-" and not quiet:
        from camtool.cli.check_table import table

        click.echo(table(facts, verbose=verbose))
    say_findings(read.findings, quiet=quiet, verbose=verbose)
    return 0


def _facts(drawing: Drawing) -> dict[str, Any]:
    """Everything worth knowing, in the order in which it is shown; lengths in mm."""
    from camtool.geometry.facts import drawing_extents, drawing_facts

    (left, right), (bottom, top) = drawing_extents(drawing).tolist()
    return {
        "file": drawing.file,
        "units": {
            "name": drawing.units.name,
            "mm_per_unit": drawing.units.mm_per_unit,
            "why": drawing.units.why,
        },
        "size_mm": [right - left, top - bottom],
        "extents_mm": {"x": [left, right], "y": [bottom, top]},
        **drawing_facts(drawing),
        "fit_um": {"max": drawing.fit.max_mm * 1000.0, "rms": drawing.fit.rms_mm * 1000.0},
        "entities_used": drawing.used,
        "entities_not_used": [
            {"kind": item.kind, "count": item.count, "reason": item.reason}
            for item in drawing.skipped
        ],
        "findings": [
            {
                "code": finding.code.name,
                "severity": finding.severity.name.lower(),
                "message": finding.message,
                "where": finding.where,
            }
            for finding in drawing.findings
        ],
    }
