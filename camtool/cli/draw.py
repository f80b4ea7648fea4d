"""`camtool draw`: a page on which a figure is drawn, for a program of its points."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import click

from camtool.cli.files import write_all
from camtool.cli.messages import say
from camtool.cli.options import SectionedCommand, talk_options
from camtool.errors import OptionError
from camtool.pictures.drawing import drawing_page
from camtool.units import parse_length

MAX_SHEET_MM = 10_000.0

MIN_GRID_MM = 0.001


def _length(text: str, name: str, low: float, high: float) -> float:
    """Parse a length; OptionError where it is not between the limits."""
    length = parse_length(text)
    if not low <= length <= high:
        raise OptionError(
            f"{text} is not between {low:g} and {high:g} mm", where=name, mend="give another one"
        )
    return length


@click.command(cls=SectionedCommand, short_help="A page to draw a figure on.")
@click.option(
    "-o", "--output", metavar="PAGE", default="draw.html", show_default=True, help="An .html file."
)
@click.option("--width", default="100", show_default=True, help="Of the sheet, mm or with a unit.")
@click.option("--height", default="100", show_default=True, help="Of the sheet.")
@click.option("--grid", default="5", show_default=True, help="Distance of the grid's lines.")
@click.option("--open", "opens", is_flag=True, help="Open the page in a browser.")
@talk_options
def draw(
    output: str, width: str, height: str, grid: str, opens: bool, quiet: bool, verbose: bool
) -> int:
    """Write a page for a browser on which a figure is drawn: left click sets a point, right click
    ends the line, a pen draws freely, and keys do the same. It saves a list of points, which
    camtool post takes like any drawing. The lower left corner of the sheet is X0 Y0."""
    page = drawing_page(
        _length(width, "--width", MIN_GRID_MM, MAX_SHEET_MM),
        _length(height, "--height", MIN_GRID_MM, MAX_SHEET_MM),
        _length(grid, "--grid", MIN_GRID_MM, MAX_SHEET_MM),
    )
    write_all({output: page})
    say(f"camtool: {output}: open it in a browser, and save the figure", quiet=quiet)
    if opens:
        webbrowser.open(Path(output).resolve().as_uri())
    return 0
