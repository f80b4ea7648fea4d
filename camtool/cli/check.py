"""`camtool check`: what an importer sees in a drawing."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.drawing import DrawingFlags, drawing_options
from camtool.cli.options import talk_options
from camtool.cli.output import check_writable, write_all
from camtool.cli.talk import one_line, say_findings, say_first_run
from camtool.cli.types import picture as picture_name

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing


@click.command(short_help="What is in a drawing.")
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

        files[preview] = render(picture(title=source, drawing=read), preview)
    write_all(files)
    if report != "-" and not quiet:
        click.echo(_table(facts))
    say_findings(read.findings, quiet=quiet, verbose=verbose)
    return 0


def _facts(drawing: Drawing) -> dict[str, Any]:
    """Everything worth knowing, in the order in which it is shown; lengths in mm."""
    from camtool.geometry.facts import drawing_facts
    from camtool.geometry.measure import extents

    (left, right), (bottom, top) = extents(drawing.paths).tolist()
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
        "gaps": [
            {"at_mm": list(gap.at_mm), "size_mm": gap.size_mm, "layer": gap.layer}
            for gap in drawing.gaps
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


def _table(facts: dict[str, Any]) -> str:
    """The facts as lines for people."""
    units, size, extents = facts["units"], facts["size_mm"], facts["extents_mm"]
    used = ", ".join(f"{count} {kind}" for kind, count in facts["entities_used"].items())
    lines = [
        f"file      {facts['file']}",
        f"units     {units['name']} ({units['why']})",
        f"size      {size[0]:.4g} × {size[1]:.4g} mm",
        f"extents   x {extents['x'][0]:.4f} … {extents['x'][1]:.4f}   "
        f"y {extents['y'][0]:.4f} … {extents['y'][1]:.4f} mm",
        f"contours  {facts['closed']} closed, {facts['open']} open, "
        f"{facts['length_mm']:.4g} mm long, {facts['lines']} lines, {facts['arcs']} arcs",
    ]
    for name, layer in facts["layers"].items():
        lines.append(f"layer     {name}: {layer['closed']} closed, {layer['open']} open")
    lines.append(f"entities  {used or 'none'}")
    for item in facts["entities_not_used"]:
        lines.append(f"not used  {item['count']} {item['kind']}: {item['reason']}")
    if facts["smallest_radius_mm"] is not None:
        lines.append(f"smallest  radius {facts['smallest_radius_mm']:.4g} mm")
    if facts["fit_um"]["max"] > 0.0:
        lines.append(f"fitted    curves within {facts['fit_um']['max']:.3g} µm")
    for gap in facts["gaps"]:
        x, y = gap["at_mm"]
        lines.append(f"gap       {gap['size_mm']:.4g} mm at {x:.4f}, {y:.4f} on {gap['layer']}")
    return "\n".join(one_line(line) for line in lines)
