"""The plot of inspected dimensions: each within its limits, which all are drawn equally wide.

Each dimension with limits has a row: the zone between the limits, a thick line from the least to
the largest predicted size, a thin one that adds their expanded uncertainty (2 u), and a dot at the
best fit, in the colour of the verdict. Whatever lies beyond a limit by more than the width of the
zone ends at the edge."""

from __future__ import annotations

from collections.abc import Sequence

from camtool.pictures import text
from camtool.pictures.colours import FRAME, INK, QUIET, SWEPT, VERDICTS
from camtool.pictures.layers import LegendEntry, line_swatch
from camtool.pictures.options import SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import legend_below, sheet, title_and_notes
from camtool.pictures.scene import Scene
from camtool.pictures.svg import Look, PathData, element, title
from camtool.pictures.text import TextStyle
from camtool.pictures.view import MARGIN, page_width
from camtool.units import UM_PER_MM
from camtool.verification.report import COVERAGE, InspectedReport

MAX_ROWS = 60
"""At most this many dimensions are plotted, those out of limits first, then the undecided ones;
the report's table has all."""

ROW, CAP = 27.0, 12.0
NAMES, SIZES = 0.24, 0.33
"""The parts of the width for names and for sizes in numbers."""

ZONE = 1.0 / 3.0
"""The share of the axis that is within limits: half of the rest lies to either side."""

_ORDER = {"out": 0, "undecided": 1, "in": 2}


def has_limits(scene: Scene) -> bool:
    """Return True if at least one inspected dimension has an upper limit."""
    return any(each.upper_mm is not None for each in scene.inspected)


def draw_limits(scene: Scene, options: PictureOptions) -> str:
    """Return SVG text of the plot of all inspected dimensions that have limits."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    every = [each for each in scene.inspected if each.upper_mm is not None]
    shown = every
    if len(every) > MAX_ROWS:
        shown = sorted(every, key=lambda each: _ORDER[each.verdict])[:MAX_ROWS]
    extra = len(every) - len(shown)
    notes = ["limits, all drawn equally wide, and what is predicted"]
    notes += [f"{extra} more dimensions are in the table"] if extra else []
    head, top = title_and_notes(scene.title, notes, width)
    rows = [_row(each, top + (k + 1) * ROW, width) for k, each in enumerate(shown)]
    bottom = top + (len(shown) + 1) * ROW
    below, foot = legend_below(_entries(shown), bottom, width)
    return sheet(scene.title, (width, foot), options, head, *rows, below)


def _row(item: InspectedReport, y: float, width: float) -> str:
    room = width - 2.0 * MARGIN
    left, right = MARGIN + NAMES * room, MARGIN + (1.0 - SIZES) * room
    axis = right - left
    assert item.upper_mm is not None
    lower = 0.0 if item.lower_mm is None else item.lower_mm
    zone = max(item.upper_mm - lower, 1e-9)

    def x_of(size_mm: float) -> float:
        share = ZONE * (1.0 + (size_mm - lower) / zone)
        return left + axis * min(max(share, 0.0), 1.0)

    colour = VERDICTS[item.verdict]
    spread = (item.expanded_um or 0.0) / UM_PER_MM
    limits: Look = {"x": x_of(lower), "y": y - 0.36 * ROW, "height": 0.72 * ROW, "fill": SWEPT}
    ends: Look = {"fill": "none", "stroke": FRAME, "stroke-width": 1.0}
    thin: Look = {"fill": "none", "stroke": colour, "stroke-width": 1.6}
    thick: Look = {**thin, "stroke-width": 5.0, "stroke-linecap": "round"}
    middle = x_of(0.5 * (lower + item.upper_mm))
    base = y + 0.5 * CAP
    style = TextStyle(cap=CAP, colour=INK)
    name = text.shortened(item.name, CAP, NAMES * room - 12.0)
    size = f"{item.fit_mm:.4f}" + (f" ± {spread:.4f}" if spread else "")
    words = text.shortened(f"{size} {item.verdict}", CAP, SIZES * room - 12.0)
    reach = x_of(item.low_mm - spread), x_of(item.high_mm + spread)
    return element(
        "g",
        {"class": "dimension"},
        title(f"{item.name}: {item.verdict}"),
        element("rect", {**limits, "width": x_of(item.upper_mm) - x_of(lower)}),
        element("path", {"d": _line(middle, y - 0.36 * ROW, middle, y + 0.36 * ROW), **ends}),
        element("path", {"d": _bar(*reach, y), **thin}),
        element("path", {"d": _line(x_of(item.low_mm), y, x_of(item.high_mm), y), **thick}),
        element("circle", {"cx": x_of(item.fit_mm), "cy": y, "r": 4.0, "fill": colour}),
        text.label(name, (MARGIN, base), style, full_text=item.name),
        text.label(words, (right + 12.0, base), TextStyle(cap=CAP, colour=QUIET)),
    )


def _line(x0: float, y0: float, x1: float, y1: float) -> str:
    data = PathData()
    data.move(x0, y0)
    data.line(x1, y1)
    return str(data)


def _bar(x0: float, x1: float, y: float) -> str:
    """Return the SVG of a horizontal line with a short mark across each end."""
    data = PathData()
    for x in (x0, x1):
        data.move(x, y - 0.2 * ROW)
        data.line(x, y + 0.2 * ROW)
    data.move(x0, y)
    data.line(x1, y)
    return str(data)


def _entries(shown: Sequence[InspectedReport]) -> list[LegendEntry]:
    verdicts = {each.verdict for each in shown}
    entries = [
        LegendEntry(line_swatch(colour, 5.0), verdict)
        for verdict, colour in VERDICTS.items()
        if verdict in verdicts
    ]
    entries.append(LegendEntry(line_swatch(QUIET, 1.6), f"uncertainty, expanded by {COVERAGE:g}"))
    entries.append(LegendEntry(line_swatch(SWEPT, 12.0), "limits"))
    return entries
