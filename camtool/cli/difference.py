"""The work of `camtool diff`: both sides, their difference in figures, and its pictures."""

from __future__ import annotations

import html
from collections.abc import Sequence
from typing import Any

from camtool.cli.files import display_name, read_bytes
from camtool.cli.life_signs import progress
from camtool.cli.messages import say, say_findings
from camtool.cli.options import DrawingFlags, JobFlags, MachineFlags
from camtool.pictures.draw import draw, render
from camtool.pictures.options import PictureOptions
from camtool.pictures.scene import Scene, StockPair
from camtool.pipeline import post_drawing, read_program
from camtool.planning.job import Job
from camtool.run import Run
from camtool.stock.cut import CutStock, StockDifference, box_around, cut_stock
from camtool.stock.heights import Bracket
from camtool.target.registry import LoadedTarget
from camtool.units import UM_PER_MM


class ComparedSide:
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
        """Return the stock after the program of this side; None if the job has errors, which are
        shown."""
        target, job = self.machine.load(), self.job.job(self.drawing)
        with self.job.name_job_file():
            run = self._run(target, job)
            say_findings(run.findings, quiet=quiet, verbose=verbose)
            if run.failed or run.decoded is None:
                say(f"camtool: error: {self.name}: its errors above come first")
                return None
            return cut_stock(run.decoded, target, job)

    def _run(self, target: LoadedTarget, job: Job) -> Run:
        """Return the program of this side: read from its file, or posted from its drawing."""
        if self.drawing.is_program(self.file, target):
            return read_program(read_bytes(self.file), target, source=display_name(self.file))
        read = self.drawing.read(self.file, target.machine, job)
        return post_drawing(read, job, target, check=False, progress=progress())


def difference_facts(
    difference: StockDifference, stocks: Sequence[CutStock], limit_mm: float, *, differs: bool
) -> dict[str, Any]:
    """Return the figures of the comparison as data for JSON."""

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


def difference_text(difference: StockDifference, names: Sequence[str]) -> str:
    """Return the figures of the comparison as readable text."""
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
    """Return the picture scene of a stock, compared with the stock `other`; `reference` names
    that."""
    box = box_around(cut.box_mm, other.box_mm)
    lowest = [float(each.moves.end[:, 2].min(initial=0.0)) for each in (cut, other)]
    is_known = cut.bottom_mm is not None
    thickness = -cut.bottom_mm if cut.bottom_mm is not None else -1.25 * min(*lowest, -1e-3)
    pair = StockPair(cut.moves, other.moves, box, thickness, is_known, reference)
    return Scene(title, cut=lambda: pair)


def difference_picture(
    stocks: tuple[CutStock, CutStock], difference: StockDifference, names: Sequence[str], file: str
) -> bytes:
    """Return the picture (bytes, for a file of this name) of the greater of the two
    differences."""
    cuts_more = difference.deeper.high >= difference.shallower.high
    scene = _scene(stocks[1], stocks[0], f"{names[1]} against {names[0]}", "A")
    return render(scene, file, PictureOptions(view="gouge" if cuts_more else "leftover"))


def difference_page(stocks: tuple[CutStock, CutStock], names: Sequence[str], text: str) -> str:
    """Return an HTML page with both stocks and both differences; names are escaped."""
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
