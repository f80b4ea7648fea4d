"""Where everything lies on the page (head, plot, numbers, colour bar, legend, scale bar), and the
page itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from camtool.arrays import Floats
from camtool.pictures import axes, legend
from camtool.pictures.axes import Ticks, ticks_of
from camtool.pictures.colours import PAPER, darkened
from camtool.pictures.content import Content
from camtool.pictures.layers import Entry, legend_of
from camtool.pictures.options import SMALLEST_PX, SVG_WIDTH_PX, Options
from camtool.pictures.svg import Look, PathData, element, number, title
from camtool.pictures.view import CROP_SHAPES, MARGIN, PAGE, TALLEST, WIDEST, Box, View, fit

HEAD_GAP = 50.0
"""Room between the head and the plot, for the names above it."""

LEGEND_DROP = 70.0
"""From the plot's foot to the middle of the legend's first row."""

FOOT = 32.0
BAR_ROOM = 36.0
GUESSED_LEFT = 52.0
FITS = 3


@dataclass(frozen=True, eq=False)
class Page:
    """`head` is ready; the legend's first row is centred on `legend_y`, the
    scale bar on `bar_y`; `width` and `height` of the whole."""

    head: str
    view: View
    ticks: Ticks
    rows: list[list[Entry]]
    legend_y: float
    bar_y: float
    height: float
    width: float = PAGE


def page_of(content: Content, width: float = PAGE) -> Page:
    """The page of a picture alone."""
    head, down = legend.head(content.scene.title, content.notes, width)
    top = down + HEAD_GAP
    shapes = (WIDEST, TALLEST) if content.crop_mm is None else CROP_SHAPES

    def bar(view: View) -> float:
        trace = content.trace
        return 0.0 if trace is None else legend.bar_width(trace.top_um, view.box.height)

    view, ticks = fitted(content.window, top, width, shapes, bar)
    table, bar_y = table_of(legend_of(content, view), view, view.box)
    legend_y = view.box.bottom + LEGEND_DROP
    return Page(head, view, ticks, table, legend_y, bar_y, foot_of(table, legend_y), width)


def table_of(entries: Sequence[Entry], view: View, plots: Box) -> tuple[list[list[Entry]], float]:
    """The rows of the legend below the plots, and the middle of the view's scale bar in them."""
    bar = axes.scale_bar_width(view) + BAR_ROOM
    table, row = legend.table_of(entries, bar, plots.width)
    return table, plots.bottom + LEGEND_DROP + row * legend.ROW_STEP


def fitted(
    window: Floats,
    top: float,
    width: float,
    shapes: tuple[float, float],
    beside: Callable[[View], float] = lambda view: 0.0,
) -> tuple[View, Ticks]:
    """The view of a window on a page so wide and its ticks; `beside` tells how much room a view
    needs right of it. Fitted thrice: the room for numbers follows from the scale."""
    left, right = MARGIN + GUESSED_LEFT, width - MARGIN
    for _ in range(FITS):
        view = fit(window, left, top, right, shapes)
        ticks = ticks_of(view)
        left = MARGIN + ticks.left_width + axes.TICK + axes.LABEL_GAP
        right = width - MARGIN - beside(view)
    return view, ticks


def foot_of(rows: list[list[Entry]], legend_y: float) -> float:
    """Height of a page whose legend of these rows begins at `legend_y`."""
    return round(legend_y + max(len(rows) - 1, 0) * legend.ROW_STEP + FOOT)


def mat(box: Box, width: float, height: float) -> str:
    """Paper round the plot of a page, which hides what leaves it. A clip would do the same, but
    takes the renderer as long again as all lines together."""
    path = PathData()
    paper = Box(0.0, 0.0, width, height + math.ceil(width / SMALLEST_PX))
    for each in (paper, box):
        path.move(each.left, each.top)
        path.line(each.right, each.top)
        path.line(each.right, each.bottom)
        path.line(each.left, each.bottom)
        path.close()
    look: Look = {"d": str(path), "fill": PAPER, "fill-rule": "evenodd"}
    return element("path", look)


def sheet(name: str, sizes: tuple[float, float], options: Options, *parts: str) -> str:
    """The whole SVG text of a picture: its parts on paper of `sizes`, width and height in units
    of its own, as large and as dark as the options say."""
    width, height = sizes
    size_px = options.size_px or SVG_WIDTH_PX
    root: Look = {
        "xmlns": "http://www.w3.org/2000/svg",
        "width": str(size_px),
        "height": number(size_px * height / width),
        "viewBox": f"0 0 {number(width)} {number(height)}",
    }
    # Where the height is no whole number of pixels, the last row is paper all the same.
    below = math.ceil(width / size_px)
    paper = element("rect", {"width": width, "height": height + below, "fill": PAPER})
    picture = element("svg", root, title(name or "camtool picture"), paper, *parts)
    return (darkened(picture) if options.dark else picture) + "\n"
