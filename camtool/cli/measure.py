"""`camtool measure`: depths of the stock after a program, at points and along sections."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_places, display_name, read_bytes, write_all
from camtool.cli.messages import say, say_findings, show_text
from camtool.cli.options import (
    DrawingFlags,
    JobFlags,
    MachineFlags,
    SectionedCommand,
    drawing_options,
    job_options,
    machine_options,
    talk_options,
)
from camtool.cli.picture_options import is_viewer, picture_name
from camtool.pictures.options import AS_USUAL
from camtool.units import UM_PER_MM, parse_length

if TYPE_CHECKING:
    from camtool.arrays import Floats
    from camtool.stock.cut import CutStock


def _points(_: click.Context, option: click.Parameter, values: tuple[str, ...]) -> Any:
    """Parse the values of `--at` to points (x, y), mm."""
    points = []
    for value in values:
        x, comma, y = value.partition(",")
        if not comma:
            raise click.BadParameter(f"{value!r} is no point; give X,Y, such as 12.5,3mm")
        points.append((parse_length(x, name="X"), parse_length(y, name="Y")))
    return points


def _sections(_: click.Context, option: click.Parameter, values: tuple[str, ...]) -> Any:
    """Parse the values of `--section` to (axis, coordinate in mm)."""
    sections = []
    for value in values:
        axis, equals, place = value.partition("=")
        if not equals or axis.strip().lower() not in ("x", "y"):
            raise click.BadParameter(f"{value!r} is no section; give x=20mm or y=5")
        sections.append((axis.strip().lower(), parse_length(place, name="section")))
    return sections


@click.command(cls=SectionedCommand, short_help="Depths of the stock after a program.")
@click.argument("program", metavar="PROGRAM")
@machine_options
@click.option(
    "--at",
    "points",
    multiple=True,
    metavar="X,Y",
    callback=_points,
    help="The depth at this point; may be given several times.",
)
@click.option(
    "--section",
    "sections",
    multiple=True,
    metavar="x=POSITION",
    callback=_sections,
    help="The profile of the stock along a line, x=20mm or y=5; may be given several times.",
)
@click.option("--volume", is_flag=True, help="The volume that is cut, and the greatest depth.")
@click.option("--json", "report", metavar="FILE", help="All of it as JSON; - is stdout.")
@click.option(
    "--preview",
    metavar="FILE",
    callback=picture_name,
    help="Picture of the section, .svg or .png.",
)
@click.option("--csv", "table", metavar="FILE", help="The sections as a table; - is stdout.")
@job_options
@drawing_options
@talk_options
def measure(
    program: str,
    machine: MachineFlags,
    points: list[tuple[float, float]],
    sections: list[tuple[str, float]],
    volume: bool,
    report: str | None,
    preview: str | None,
    table: str | None,
    job: JobFlags,
    drawing: DrawingFlags,
    quiet: bool,
    verbose: bool,
) -> int:
    """Say how deep the stock is cut after PROGRAM (- is stdin) has run, at points and along lines.

    Heights are exact for the simulated path of the machine's slides: no grid. Z is 0 at the top of
    the stock. The tools are those of the job (--job) or of the flags (--tool-diameter ...)."""
    if not (points or sections or volume):
        raise click.UsageError("nothing to measure: give --at, --section or --volume")
    if table is not None and not sections:
        raise click.UsageError("--csv is a table of sections: give --section")
    if table == STDOUT and report == STDOUT:
        raise click.UsageError("only one of --csv and --json can be stdout")
    if preview is not None and (len(sections) != 1 or is_viewer(preview)):
        raise click.UsageError("--preview shows one --section, as .svg or .png")
    check_places([program, *machine.files(), *job.files()], [report, preview, table])

    from camtool.pipeline import read_program
    from camtool.stock.cut import cut_stock

    target = machine.load()
    job_used = job.job(drawing)
    with job.name_job_file():
        run = read_program(read_bytes(program), target, source=display_name(program))
        assert run.decoded is not None
        stock = cut_stock(run.decoded, target, job_used)
    say_findings(run.findings, quiet=quiet, verbose=verbose)
    profiles = [(axis, value, stock.section(axis, value)) for axis, value in sections]
    files: dict[str, bytes] = {}
    if report is not None:
        facts = _facts(stock, points, profiles, with_volume=volume)
        files[report] = (json.dumps(facts, indent=2) + "\n").encode()
    if table is not None:
        files[table] = _table(profiles).encode()
    if preview is not None:
        files[preview] = _picture(display_name(program), profiles[0], stock, preview)
    write_all(files)
    if not quiet and STDOUT not in files:
        show_text(_text(stock, points, profiles, with_volume=volume))
    say(
        f"the slides are within {stock.moves.beside_mm * UM_PER_MM:.3g} µm of the moves that are"
        " measured",
        quiet=quiet or not verbose,
    )
    return int(run.failed)


Profiles = list[tuple[str, float, "Floats"]]


def _facts(
    stock: CutStock, points: list[tuple[float, float]], profiles: Profiles, *, with_volume: bool
) -> dict[str, Any]:
    """Return all figures as data for JSON."""
    import numpy as np

    facts: dict[str, Any] = {"beside_um": round(stock.moves.beside_mm * UM_PER_MM, 3)}
    if points:
        places = np.array(points)
        rows = zip(
            points,
            stock.heights(places).tolist(),
            stock.bounds(places).tolist(),
            stock.rows_at(places).tolist(),
            strict=True,
        )
        facts["points"] = [
            {
                "at_mm": place,
                "z_mm": round(z, 6),
                "between_mm": [round(bound, 6) for bound in bounds],
                "move": row if row >= 0 else None,
            }
            for place, z, bounds, row in rows
        ]
    if profiles:
        facts["sections"] = [
            {"axis": axis, "at_mm": places, "profile_mm": np.round(rows, 6).tolist()}
            for axis, places, rows in profiles
        ]
    if with_volume:
        removed, lowest = stock.removed_mm3(), stock.lowest
        facts["removed_mm3"] = [round(removed.low, 6), round(removed.high, 6)]
        facts["deepest"] = {
            "depth_mm": [round(lowest.low, 6), round(lowest.high, 6)],
            "at_mm": lowest.at_mm,
        }
    return facts


def _picture(title: str, profile: tuple[str, float, Floats], stock: CutStock, file: str) -> bytes:
    """Return the picture of a section through the stock (bytes, for a file of this name)."""
    from camtool.pictures.draw import rendered
    from camtool.pictures.section import StockSection, section_svg

    section = StockSection(*profile, stock.bottom_mm)
    return rendered(lambda sized: section_svg(title, section, sized), file, AS_USUAL)


def _table(profiles: Profiles) -> str:
    """Return the sections as CSV with the columns axis, its coordinate, position along the
    section, and height, mm."""
    lines = ["axis,at_mm,along_mm,z_mm"]
    for axis, value, rows in profiles:
        lines += [f"{axis},{value:g},{place:.6f},{z:.6f}" for place, z in rows.tolist()]
    return "\n".join(lines) + "\n"


def _text(
    stock: CutStock, points: list[tuple[float, float]], profiles: Profiles, *, with_volume: bool
) -> str:
    """Return the figures as readable text."""
    import numpy as np

    lines = []
    if points:
        places = np.array(points)
        for (x, y), z, (low, high) in zip(
            points, stock.heights(places).tolist(), stock.bounds(places).tolist(), strict=True
        ):
            lines.append(f"X {x:g} Y {y:g}: Z {z:.4f} mm, between {low:.4f} and {high:.4f}")
    for axis, place, rows in profiles:
        other = "Y" if axis == "x" else "X"
        low = rows[int(np.argmin(rows[:, 1]))]
        lines.append(
            f"section {axis.upper()} {place:g}: {len(rows)} points, deepest Z {low[1]:.4f} mm at"
            f" {other} {low[0]:.3f}"
        )
    if with_volume:
        removed, lowest = stock.removed_mm3(), stock.lowest
        x, y = lowest.at_mm
        lines.append(f"cut away: between {removed.low:.4g} and {removed.high:.4g} mm³")
        deepest = f"deepest: {lowest.low:.4f} mm at X {x:.3f} Y {y:.3f}"
        lines.append(deepest if lowest.high > 0.0 else "nothing is cut")
    return "\n".join(lines)
