"""`camtool check`: what an importer sees in a drawing."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.options import talk_options
from camtool.cli.output import STDOUT, check_places, write_all
from camtool.cli.pictureflags import DRAWING, PictureFlags, picture_options
from camtool.cli.sections import SectionedCommand
from camtool.cli.talk import say_error, say_findings, say_first_run
from camtool.cli.terminal import DRAWING_MARKS, show_facts
from camtool.cli.types import picture as picture_name
from camtool.errors import CamtoolError
from camtool.plain import to_json

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing


@click.command(cls=SectionedCommand, short_help="What is in a drawing.")
@click.argument("sources", metavar="DRAWING...", nargs=-1, required=True)
@click.option("--json", "report", metavar="FILE", help="The same as JSON; - is stdout.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the drawing, .svg, .png or .html.",
)
@picture_options
@drawing_options
@talk_options
def check(
    sources: tuple[str, ...],
    report: str | None,
    preview: str | None,
    picture: PictureFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Say what an importer sees in each DRAWING (- is stdin).

    Units and why, size, layers, entities used and not used, gaps, and the smallest features. Of
    several drawings all are looked at, whatever is wrong with one of them.
    """
    picture.check([preview], DRAWING)
    asked = Asked(report, preview, picture, quiet, verbose)
    if len(sources) == 1:
        return _checked(sources[0], drawing, asked)
    if report is not None or preview is not None:
        raise click.UsageError("--json and --preview are of one drawing")
    say_first_run(quiet=quiet)
    return max(_tried(source, drawing, asked) for source in sources)


@dataclass(frozen=True)
class Asked:
    """What the user wants to have of a drawing."""

    report: str | None
    preview: str | None
    looks: PictureFlags
    quiet: bool
    verbose: bool


def _tried(source: str, drawing: DrawingFlags, asked: Asked) -> int:
    """One of several drawings; the exit code of an error is a result like another."""
    try:
        return _checked(source, drawing, asked)
    except CamtoolError as error:
        say_error(error)
        return error.exit_code


def _checked(source: str, drawing: DrawingFlags, asked: Asked) -> int:
    """The facts of one drawing, and whether any of them is an error."""
    from camtool.findings import Severity, worst

    check_places([source], [asked.report, asked.preview])
    say_first_run(quiet=asked.quiet)
    read = drawing.read(source)
    facts = _facts(read)
    files: dict[str, bytes] = {}
    if asked.report is not None:
        files[asked.report] = to_json(facts).encode()
    if asked.preview is not None:
        from camtool.pipeline import picture

        title = Path(read.file).name
        painted = asked.looks.painter(
            lambda: [picture(title=title, drawing=read)], quiet=asked.quiet
        )
        files[asked.preview] = painted(asked.preview)
    write_all(files)
    if asked.report != STDOUT and not asked.quiet:
        from camtool.cli.check_table import NAME_WIDTH, table

        show_facts(table(facts, verbose=asked.verbose), NAME_WIDTH, DRAWING_MARKS)
    say_findings(read.findings, quiet=asked.quiet, verbose=asked.verbose)
    return 1 if worst(read.findings) >= Severity.ERROR else 0


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
