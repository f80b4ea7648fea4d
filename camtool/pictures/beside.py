"""Scenes beside each other, such as before and after: one window, one scale, one map of errors.

High or square panels stand side by side, wide ones one below the other; more than two fill a grid.
Each panel has a title and notes of its own; legend, scale bar and colour bar belong to all. Polar
plots share their magnification. A panel is drawn at (0, 0) and then moved to its place, so that
equal scenes make equal panels."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from pathlib import PurePath

from msgspec import Struct

from camtool.errors import OptionError
from camtool.pictures import polar
from camtool.pictures.colours import DRAWING, LAYER_COLOURS
from camtool.pictures.content import Content, Group, content_of
from camtool.pictures.draw import panel, rendered
from camtool.pictures.layers import LegendEntry, legend_of
from camtool.pictures.options import AS_USUAL, SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import (
    HEAD_GAP,
    LEGEND_DROP,
    MapScale,
    PageLayout,
    colour_bar,
    colour_bar_width,
    fitted,
    foot_of,
    legend_below,
    legend_rows,
    scale_bar,
    scale_of,
    sheet,
    table_of,
    ticks_of,
    title_and_notes,
)
from camtool.pictures.polar import ROOM, dial_of, plot
from camtool.pictures.scene import Scene
from camtool.pictures.svg import element, number
from camtool.pictures.view import (
    CROP_SHAPES,
    MARGIN,
    TALLEST,
    WIDEST,
    PageBox,
    View,
    page_width,
    union,
)
from camtool.records import replace

WIDE = 0.5
"""A window is wide if its height is less than this share of its width."""

NUMBERS_FOOT = 32.0
"""Height below a plot for its numbers."""


def render_beside(scenes: Sequence[Scene], name: str, options: PictureOptions = AS_USUAL) -> bytes:
    """Return the SVG or PNG bytes of the scenes, by the extension of `name`.

    OutputError for other extensions, OptionError for .html and for options that ask for what a
    scene does not have."""
    if PurePath(name).suffix.lower() == ".html":
        raise OptionError(
            "an .html page shows one scene", file=name, mend="side by side, use .svg or .png"
        )
    return rendered(lambda sized: draw_beside(scenes, sized), name, options)


def draw_beside(scenes: Sequence[Scene], options: PictureOptions = AS_USUAL) -> str:
    """Return the scenes beside each other as SVG text; equal input gives equal bytes. ValueError
    when there are none."""
    if not scenes:
        raise ValueError("no scene to draw")
    if options.view != "plan":
        raise OptionError(
            f"the view {options.view} shows one stock, not {len(scenes)}",
            mend="make a picture of each, or drop --view",
        )
    if options.polar is not None:
        return _polars(scenes, options.polar, options)
    contents = _unified([content_of(scene, options) for scene in scenes])
    grid, views = _views(contents, options)
    view, ticks = views[0], ticks_of(views[0])
    panels = [
        panel(content, PageLayout(head, own_view, ticks, [], 0.0, 0.0, 0.0))
        for content, head, own_view in zip(contents, grid.heads, views, strict=True)
    ]
    plots = grid.around([own_view.box for own_view in views])
    table, bar_y = table_of(_entries(contents, view), view, plots)
    legend_y = plots.bottom + LEGEND_DROP
    scale = _scale(contents)
    return sheet(
        _title(scenes),
        (grid.page, foot_of(table, legend_y)),
        options,
        *grid.place_panels(panels),
        "" if scale is None else colour_bar(scale, plots),
        legend_rows(table, plots.left, legend_y),
        scale_bar(view, plots.right, bar_y),
    )


def _views(contents: Sequence[Content], options: PictureOptions) -> tuple[PanelGrid, list[View]]:
    """Return the grid of panels and the view of each; they differ in the height of their heads.

    The fit runs twice, since the width of the colour bar follows from the height of the plots."""
    window, scale = contents[0].window, _scale(contents)
    across, height = (window[:, 1] - window[:, 0]).tolist()
    columns = columns_of(len(contents), wide=height < WIDE * across)
    page = page_units(columns, options)
    shapes = (WIDEST, columns * TALLEST) if options.crop_mm is None else CROP_SHAPES
    heads = [(content.scene.title, content.notes) for content in contents]
    bar = 0.0
    for _ in range(2):
        grid = grid_of(heads, columns, page, bar)
        views = [
            fitted(window, top + HEAD_GAP, grid.width, shapes)[0] for top in grid.head_bottoms
        ]
        grid = grid.with_bodies(HEAD_GAP + views[0].box.height + NUMBERS_FOOT)
        if scale is not None:
            bar = colour_bar_width(scale, grid.around([view.box for view in views]).height)
    return grid, views


def _scale(contents: Sequence[Content]) -> MapScale | None:
    """Return the largest scale of colours among the contents; None where none is coloured by a
    map."""
    scales = [scale for scale in map(scale_of, contents) if scale is not None]
    return max(scales, key=lambda scale: scale.top, default=None)


def _top_um(contents: Sequence[Content]) -> float | None:
    """Return the largest end of the colour map of errors, µm; None where no path is predicted."""
    return max((one.trace.top_um for one in contents if one.trace is not None), default=None)


def _unified(contents: Sequence[Content]) -> list[Content]:
    """Return the contents with the same window, the same map of errors, and one colour for each
    layer name."""
    top_um = _top_um(contents)
    window = union([one.window for one in contents if not one.is_empty])
    names = dict.fromkeys(group.name for one in contents for group in one.groups)
    strong = {name: LAYER_COLOURS[index % len(LAYER_COLOURS)] for index, name in enumerate(names)}

    def coloured(group: Group) -> Group:
        pale = group.colour == DRAWING
        return group if pale else replace(group, colour=strong[group.name])

    alike = []
    for one in contents:
        trace = one.trace
        if trace is not None and top_um is not None:
            trace = replace(trace, top_um=top_um)
        groups = tuple(coloured(group) for group in one.groups)
        shown = one.window if window is None else window
        alike.append(replace(one, window=shown, trace=trace, groups=groups))
    return alike


def _entries(contents: Sequence[Content], view: View) -> list[LegendEntry]:
    """Return one legend for all contents, each entry once, with the layers of all drawings."""
    groups = {(group.name, group.colour): group for one in contents for group in one.groups}
    every = tuple(groups.values())
    entries = [entry for one in contents for entry in legend_of(replace(one, groups=every), view)]
    return list(dict.fromkeys(entries))


def _title(scenes: Sequence[Scene]) -> str:
    return ", ".join(scene.title for scene in scenes if scene.title)


def _polars(scenes: Sequence[Scene], number: int, options: PictureOptions) -> str:
    """Return the SVG text of the polar plots of circle `number` of each scene, all with the same
    magnification."""
    plots = [polar.circle_pair(scene, number) for scene in scenes]
    columns = columns_of(len(plots), wide=False)
    page = page_units(columns, options)
    width = panel_width(columns, page)
    errors = [[circle.errors_um for circle in circles] for circles in plots]
    dial = dial_of([each for circles in errors for each in circles], width)
    heads = [
        (scene.title, polar.notes(circles, dial))
        for scene, circles in zip(scenes, plots, strict=True)
    ]
    grid = grid_of(heads, columns, page).with_bodies(2.0 * (dial.outer + ROOM))
    panels = [
        [head, *plot(shown, dial.centred_below(top, width))]
        for shown, head, top in zip(errors, grid.heads, grid.head_bottoms, strict=True)
    ]
    entries = list(dict.fromkeys(entry for circles in plots for entry in polar.entries(circles)))
    below, foot = legend_below(entries, grid.rows[-1], page)
    return sheet(_title(scenes), (page, foot), options, *grid.place_panels(panels), below)


# Panels in rows and columns of a page: where each lies, and the ids of its parts.

GROWN = 1.25
"""Factor of the page's width if panels stand side by side: each panel is smaller, and so are its
letters."""

TITLE_LINES = 2

_NAME = re.compile(r'( id="|url\(#)')

Head = tuple[str, Sequence[str]]
"""Title and notes of a panel."""


class PanelGrid(Struct, frozen=True):
    """A grid of panels of `width`, margins included, in `columns` on a page of width `page`.

    `heads` are the SVG of titles and notes, `head_bottoms` the heights in each panel at which the
    heads of its row end, `rows` the page heights at which the rows begin."""

    columns: int
    page: float
    width: float
    heads: tuple[str, ...]
    head_bottoms: tuple[float, ...]
    rows: tuple[float, ...] = ()

    def with_bodies(self, height: float) -> PanelGrid:
        """Return the grid with the heights of its rows, given the height of a panel below its
        head."""
        rows = [0.0]
        for top in self.head_bottoms[:: self.columns]:
            rows.append(rows[-1] + top + height)
        return replace(self, rows=tuple(rows))

    def corner(self, index: int) -> tuple[float, float]:
        """Return the upper left corner of a panel on the page; neighbours share their margin."""
        across = (index % self.columns) * (self.width - MARGIN)
        return across, self.rows[index // self.columns]

    def moved(self, index: int, box: PageBox) -> PageBox:
        """Return a box given in a panel's own coordinates in those of the page."""
        x, y = self.corner(index)
        return PageBox(box.left + x, box.top + y, box.right + x, box.bottom + y)

    def around(self, boxes: Sequence[PageBox]) -> PageBox:
        """Return the box on the page around the given boxes, one of each panel."""
        boxes_moved = [self.moved(index, box) for index, box in enumerate(boxes)]
        return PageBox(
            min(box.left for box in boxes_moved),
            min(box.top for box in boxes_moved),
            max(box.right for box in boxes_moved),
            max(box.bottom for box in boxes_moved),
        )

    def place_panels(self, panels: Sequence[Sequence[str]]) -> list[str]:
        """Return a group for each panel, moved to its place; the ids inside begin with the panel's
        id, to be unique."""
        groups = []
        for index, parts in enumerate(panels):
            name = f"panel-{index + 1}"
            x, y = self.corner(index)
            shift = f"translate({number(x)} {number(y)})"
            inner = [_NAME.sub(rf"\g<1>{name}-", part) for part in parts]
            groups.append(element("g", {"id": name, "transform": shift}, *inner))
        return groups


def columns_of(count: int, *, wide: bool) -> int:
    """Return the number of panels side by side: 1 if they are `wide`, else about the square root
    of their number."""
    return 1 if wide else math.ceil(math.sqrt(count))


def page_units(columns: int, options: PictureOptions) -> float:
    """Return the width, in units of the page, of a page with so many columns."""
    page = page_width(options.size_px or SVG_WIDTH_PX)
    return page if columns == 1 else round(GROWN * page)


def panel_width(columns: int, room: float) -> float:
    """Return the width of each of `columns` panels, margins included, that share the width
    `room`."""
    return float(math.floor((room + (columns - 1) * MARGIN) / columns))


def grid_of(heads: Sequence[Head], columns: int, page: float, bar: float = 0.0) -> PanelGrid:
    """Return the grid for panels with these titles and notes; a strip of width `bar` at the right
    stays free for the colour bar."""
    width = panel_width(columns, page - bar)
    drawn = [title_and_notes(title, notes, width, lines=TITLE_LINES) for title, notes in heads]
    head_bottoms = [bottom for _, bottom in drawn]
    lowest = [max(head_bottoms[k - k % columns :][:columns]) for k in range(len(head_bottoms))]
    return PanelGrid(columns, page, width, tuple(head for head, _ in drawn), tuple(lowest))
