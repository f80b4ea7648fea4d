"""`camtool diff`: what two programs, machines, jobs or drawings cut differently."""

from __future__ import annotations

import html
import json
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from camtool.cli.files import STDOUT, check_places, display_name, read_bytes, write_all
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, say_findings, show_text
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
from camtool.pictures.options import PictureOptions
from camtool.records import replace
from camtool.units import UM_PER_MM

if TYPE_CHECKING:
    from camtool.pictures.scene import Scene
    from camtool.planning.job import Job
    from camtool.run import Run
    from camtool.stock.cut import CutStock, StockDifference
    from camtool.stock.heights import Bracket
    from camtool.target.registry import LoadedTarget

DEFAULT_LIMIT_MM = 0.01
"""Stocks that differ by no more count as equal."""


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
    than --max-difference, or cannot be proved to be less.
    """
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

    from camtool.stock.cut import difference_of

    other = MachineFlags.of(other_target, other_machine, ()) if is_other else machine
    sides = [
        _Side(first, machine, job, drawing),
        _Side(
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
    if report is not None:
        facts = _facts(difference, stocks, limit_mm, differs=differs)
        files[report] = (json.dumps(facts, indent=2) + "\n").encode()
    if preview is not None:
        pair = (stocks[0], stocks[1])
        if is_viewer(preview):
            files[preview] = _page(pair, names, _text(difference, names)).encode()
        else:
            files[preview] = _picture(pair, difference, names, preview)
    write_all(files)
    if not quiet and STDOUT not in files:
        show_text(_text(difference, names))
    if differs:
        proved = max(difference.deeper.low, difference.shallower.low) > limit_mm
        verb = "differ by" if proved else "may differ by"
        say(f"camtool: the two {verb} more than {limit_mm:g} mm", quiet=quiet)
    return int(differs)


class _Side:
    """A side of the comparison: a file, its machine and its job."""

    def __init__(
        self, file: str, machine: MachineFlags, job: JobFlags, drawing: DrawingFlags
    ) -> None:
        self.file, self.machine, self.job, self.drawing = file, machine, job, drawing

    @property
    def name(self) -> str:
        """The name of the file, with that of the job and the machine."""
        names = [display_name(self.file), self.job.file, self.machine.name()]
        return ", ".join(name for name in names if name)

    def stock(self, *, quiet: bool, verbose: bool) -> CutStock | None:
        """Return the stock after the program of this side; None where the job has errors, which
        are said."""
        from camtool.stock.cut import cut_stock

        target, job = self.machine.load(), self.job.job(self.drawing)
        with self.job.name_job_file():
            run = self._run(target, job)
            say_findings(run.findings, quiet=quiet, verbose=verbose)
            if run.failed or run.decoded is None:
                say(f"camtool: error: {self.name}: its errors above come first", quiet=False)
                return None
            return cut_stock(run.decoded, target, job)

    def _run(self, target: LoadedTarget, job: Job) -> Run:
        """Return the program of this side, read or made."""
        from camtool.pipeline import post_drawing, read_program

        if self.drawing.is_program(self.file, target):
            return read_program(read_bytes(self.file), target, source=display_name(self.file))
        read = self.drawing.read(self.file, target.machine, job)
        return post_drawing(read, job, target, check=False, progress=progress())


def _facts(
    difference: StockDifference, stocks: Sequence[CutStock], limit_mm: float, *, differs: bool
) -> dict[str, Any]:
    """Return the figures as JSON."""

    def bracket(one: Bracket) -> dict[str, Any]:
        return {
            "between_mm": [round(one.low, 6), round(one.high, 6)],
            "at_mm": [round(value, 4) for value in one.at_mm],
        }

    return {
        "differs": differs,
        "limit_mm": limit_mm,
        "deeper": bracket(difference.deeper),
        "shallower": bracket(difference.shallower),
        "more_mm3": [round(difference.more_mm3.low, 6), round(difference.more_mm3.high, 6)],
        "less_mm3": [round(difference.less_mm3.low, 6), round(difference.less_mm3.high, 6)],
        "beside_um": [round(UM_PER_MM * stock.moves.beside_mm, 3) for stock in stocks],
    }


def _text(difference: StockDifference, names: Sequence[str]) -> str:
    """Return the figures for people."""
    lines = [f"A  {names[0]}", f"B  {names[1]}"]
    for words, one, volume in (
        ("B cuts more", difference.deeper, difference.more_mm3),
        ("B cuts less", difference.shallower, difference.less_mm3),
    ):
        if one.low <= 0.0:
            lines.append(f"{words}: nowhere by more than {one.high:.4f} mm")
            continue
        x, y = one.at_mm
        distance = f"{one.value:.4f} mm (proved to ±{one.margin:.4f})"
        volume_text = f"{volume.low:.4g} to {volume.high:.4g} mm³"
        lines.append(f"{words}: by {distance} near X {x:.3f} Y {y:.3f}, {volume_text}")
    return "\n".join(lines)


def _scene(cut: CutStock, other: CutStock, title: str, reference: str = "wanted") -> Scene:
    """Return the scene of a stock, beside another one."""
    from camtool.pictures.scene import Scene, StockPair
    from camtool.stock.cut import box_around

    box = box_around(cut.box_mm, other.box_mm)
    lowest = [float(each.moves.end[:, 2].min(initial=0.0)) for each in (cut, other)]
    is_known = cut.bottom_mm is not None
    thickness = -cut.bottom_mm if cut.bottom_mm is not None else -1.25 * min(*lowest, -1e-3)
    pair = StockPair(cut.moves, other.moves, box, thickness, is_known, reference)
    return Scene(title, cut=lambda: pair)


def _picture(
    stocks: tuple[CutStock, CutStock], difference: StockDifference, names: Sequence[str], file: str
) -> bytes:
    """Return the picture of the greater of the two differences."""
    from camtool.pictures.draw import render

    cuts_more = difference.deeper.high >= difference.shallower.high
    scene = _scene(stocks[1], stocks[0], f"{names[1]} against {names[0]}", "A")
    return render(scene, file, PictureOptions(view="gouge" if cuts_more else "leftover"))


def _page(stocks: tuple[CutStock, CutStock], names: Sequence[str], text: str) -> str:
    """Return a page with both stocks and both differences; texts of names are escaped."""
    from camtool.pictures.draw import draw

    first, second = stocks
    shown = [
        (_scene(first, second, f"A: {names[0]}"), "iso"),
        (_scene(second, first, f"B: {names[1]}"), "iso"),
        (_scene(second, first, "B cuts deeper", "A"), "gouge"),
        (_scene(second, first, "B cuts less", "A"), "leftover"),
    ]
    figures = "\n".join(
        f"<figure>{draw(scene, PictureOptions(view=view))}</figure>" for scene, view in shown
    )
    title = html.escape(f"{names[0]} and {names[1]}")
    return (
        '<!doctype html>\n<html lang="en"><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{title}</title>\n<style>{_STYLE}</style>\n<h1>{title}</h1>\n"
        f"<pre>{html.escape(text)}</pre>\n<main>\n{figures}\n</main>\n</html>\n"
    )


_STYLE = (
    "body{font:16px system-ui,sans-serif;margin:1rem;background:#fff;color:#16202b}"
    "main{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(30rem,100%),1fr));gap:1rem}"
    "figure{margin:0}svg{width:100%;height:auto}pre{white-space:pre-wrap}"
    "h1{font-size:1.2rem;overflow-wrap:anywhere}"
)
