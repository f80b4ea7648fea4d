"""Several predicted paths of one program over each other in one window.

The wanted path lies below, pale and wide; each variant is a thin line in a colour of its own. The
window is small (some tens of steps), so every step shows."""

from __future__ import annotations

import math
from collections.abc import Sequence

from msgspec import Struct

from camtool.arrays import Floats
from camtool.pictures.chains import moves_of
from camtool.pictures.colours import FEED_PALE, LAYER_COLOURS
from camtool.pictures.content import cropped
from camtool.pictures.draw import rendered
from camtool.pictures.layers import LegendEntry, line_swatch
from camtool.pictures.options import AS_USUAL, SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import (
    HEAD_GAP,
    LEGEND_DROP,
    axes_around,
    fitted,
    foot_of,
    ground,
    legend_rows,
    mat,
    scale_bar,
    sheet,
    table_of,
    title_and_notes,
)
from camtool.pictures.plot import Plot
from camtool.pictures.svg import Look, PathData, element
from camtool.pictures.trace import FINEST_SHARE
from camtool.pictures.view import CROP_SHAPES, TALLEST, WIDEST, View, page_width
from camtool.toolpath.moves import Toolpath

WANTED_PEN, RUN_PEN = 8.0, 2.0


class Overlay(Struct, frozen=True, eq=False):
    """The content of an overlay: `window` (2, 2) mm [[xmin, xmax], [ymin, ymax]]; `wanted`, the
    path without any error; `runs` (name, lines of points (n, 2) mm) of the variants, in the order
    of the legend."""

    title: str
    window: Floats
    wanted: Toolpath
    runs: Sequence[tuple[str, Sequence[Floats]]]
    notes: tuple[str, ...] = ()


def render_overlay(overlay: Overlay, name: str, options: PictureOptions = AS_USUAL) -> bytes:
    """Return SVG or PNG bytes of the overlay, by the extension of `name`; OutputError for other
    extensions."""
    return rendered(lambda sized: draw_overlay(overlay, sized), name, options)


def draw_overlay(overlay: Overlay, options: PictureOptions = AS_USUAL) -> str:
    """Return the overlay as SVG text; equal input gives equal bytes."""
    size_px = options.size_px or SVG_WIDTH_PX
    page = page_width(size_px)
    head, top = title_and_notes(overlay.title, overlay.notes, page)
    window = overlay.window if options.crop_mm is None else cropped(*options.crop_mm)
    shapes = (WIDEST, TALLEST) if options.crop_mm is None else CROP_SHAPES
    view, ticks = fitted(window, top + HEAD_GAP, page, shapes)
    table, bar_y = table_of(_entries(overlay), view, view.box)
    legend_y = view.box.bottom + LEGEND_DROP
    sizes = (page, foot_of(table, legend_y))
    return sheet(
        overlay.title,
        sizes,
        options,
        ground(view, ticks),
        element("g", {"id": "plot"}, _paths(overlay, view)),
        mat(view.box, *sizes),
        head,
        axes_around(view, ticks),
        legend_rows(table, view.box.left, legend_y),
        scale_bar(view, view.box.right, bar_y),
    )


def _colour(index: int) -> str:
    return LAYER_COLOURS[index % len(LAYER_COLOURS)]


def _entries(overlay: Overlay) -> list[LegendEntry]:
    wanted_entry = LegendEntry(line_swatch(FEED_PALE, WANTED_PEN), "wanted")
    return [wanted_entry] + [
        LegendEntry(line_swatch(_colour(index), RUN_PEN), name)
        for index, (name, _) in enumerate(overlay.runs)
    ]


def _paths(overlay: Overlay, view: View) -> str:
    """Return the SVG of all paths, in mm."""
    moves = moves_of(overlay.wanted)
    chains = (*moves.feeds, *moves.ramps)
    plot = Plot(view)
    pen = {**plot.round_pen(WANTED_PEN), "stroke": FEED_PALE}
    layers = [plot.lines("feeds", chains, pen)] if chains else []
    low, high = view.x_range
    decimals = max(0, math.ceil(-math.log10(FINEST_SHARE * (high - low))))
    for index, (_, runs) in enumerate(overlay.runs):
        data = PathData(decimals)
        for run in runs:
            data.move(*run[0].tolist())
            for point in run[1:].tolist():
                data.line(*point)
        if data:
            look: Look = {"stroke": _colour(index), "stroke-linejoin": "round"}
            look |= {"fill": "none", "stroke-width": view.mm(RUN_PEN)}
            layers.append(element("path", {"id": f"run-{index + 1}", "d": str(data), **look}))
    return element("g", {"id": "mm", "transform": view.matrix()}, *layers)
