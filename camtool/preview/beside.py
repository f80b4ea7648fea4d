"""Scenes beside each other: before and after, in one window, at one scale, by one map of errors.

What is high or square stands side by side, what is wide one below the other; more than two fill a
grid. Each panel has its own title and notes; the legend, the scale bar and the colour bar are
those of all. Polar plots share their magnification. A panel is drawn in units of its own and then
moved to its place, so that equal scenes make equal panels.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import PurePath

from camtool.errors import OptionError
from camtool.preview import axes, legend, polar
from camtool.preview.colours import DRAWING, LAYERS
from camtool.preview.content import Content, content_of
from camtool.preview.dial import ROOM, dial_of, plot
from camtool.preview.draw import panel
from camtool.preview.entries import entries_of
from camtool.preview.grid import Grid, columns_of, grid_of, page_units, panel_width
from camtool.preview.legend import Entry
from camtool.preview.marks import Group
from camtool.preview.options import AS_USUAL, Options
from camtool.preview.page import (
    HEAD_GAP,
    LEGEND_DROP,
    Page,
    fitted,
    foot_of,
    sheet,
    table_of,
)
from camtool.preview.render import rendered
from camtool.preview.scene import Scene
from camtool.preview.view import CROP_SHAPES, TALLEST, WIDEST, View, union

WIDE = 0.5
"""A window lower than this share of its width is wide."""

NUMBERS_FOOT = 32.0
"""Room below a plot for its numbers."""


def render_beside(scenes: Sequence[Scene], name: str, options: Options = AS_USUAL) -> bytes:
    """SVG or PNG bytes of the scenes for a file of this name; OutputError for other extensions,
    OptionError for .html and where the options ask for what a scene does not have."""
    if PurePath(name).suffix.lower() == ".html":
        raise OptionError(
            "a page shows one alone", file=name, mend="pictures side by side are .svg or .png"
        )
    return rendered(lambda sized: draw_beside(scenes, sized), name, options)


def draw_beside(scenes: Sequence[Scene], options: Options = AS_USUAL) -> str:
    """The scenes as SVG text; equal input gives equal bytes. ValueError when there are none."""
    if not scenes:
        raise ValueError("no scene to draw")
    if options.polar is not None:
        return _polars(scenes, options.polar, options)
    contents = _alike([content_of(scene, options) for scene in scenes])
    grid, views = _views(contents, options)
    view, ticks = views[0], axes.ticks_of(views[0])
    panels = [
        panel(content, Page(head, own, ticks, [], 0.0, 0.0, 0.0))
        for content, head, own in zip(contents, grid.heads, views, strict=True)
    ]
    plots = grid.around([own.box for own in views])
    table, bar_y = table_of(_entries(contents, view), view, plots)
    legend_y = plots.bottom + LEGEND_DROP
    top_um = _top_um(contents)
    return sheet(
        _title(scenes),
        (grid.page, foot_of(table, legend_y)),
        options,
        *grid.placed(panels),
        "" if top_um is None else legend.colour_bar(top_um, plots),
        legend.legend(table, plots.left, legend_y),
        axes.scale_bar(view, plots.right, bar_y),
    )


def _views(contents: Sequence[Content], options: Options) -> tuple[Grid, list[View]]:
    """Where each panel lies, and the view in it: all the same but for the length of its head.
    Fitted twice, since the room of the colour bar follows from the height of the plots."""
    window, top_um = contents[0].window, _top_um(contents)
    across, down = (window[:, 1] - window[:, 0]).tolist()
    columns = columns_of(len(contents), wide=down < WIDE * across)
    page = page_units(columns, options)
    shapes = (WIDEST, columns * TALLEST) if options.crop_mm is None else CROP_SHAPES
    heads = [(content.scene.title, content.notes) for content in contents]
    bar = 0.0
    for _ in range(2):
        grid = grid_of(heads, columns, page, bar)
        views = [fitted(window, top + HEAD_GAP, grid.width, shapes)[0] for top in grid.downs]
        grid = grid.with_bodies(HEAD_GAP + views[0].box.height + NUMBERS_FOOT)
        if top_um is not None:
            bar = legend.bar_width(top_um, grid.around([view.box for view in views]).height)
    return grid, views


def _top_um(contents: Sequence[Content]) -> float | None:
    """The end of the map of all."""
    return max((one.trace.top_um for one in contents if one.trace is not None), default=None)


def _alike(contents: Sequence[Content]) -> list[Content]:
    """The same with one window, one map of errors, and one colour for each layer by name."""
    top_um = _top_um(contents)
    window = union([one.window for one in contents if not one.is_empty])
    names = dict.fromkeys(group.name for one in contents for group in one.groups)
    strong = {name: LAYERS[index % len(LAYERS)] for index, name in enumerate(names)}

    def coloured(group: Group) -> Group:
        pale = group.colour == DRAWING
        return group if pale else replace(group, colour=strong[group.name])

    found = []
    for one in contents:
        trace = one.trace
        if trace is not None and top_um is not None:
            trace = replace(trace, top_um=top_um)
        groups = tuple(coloured(group) for group in one.groups)
        shown = one.window if window is None else window
        found.append(replace(one, window=shown, trace=trace, groups=groups))
    return found


def _entries(contents: Sequence[Content], view: View) -> list[Entry]:
    """The legend of all, each entry once; layers of drawings are named alike in all."""
    groups = {(group.name, group.colour): group for one in contents for group in one.groups}
    every = tuple(groups.values())
    found = [entry for one in contents for entry in entries_of(replace(one, groups=every), view)]
    return list(dict.fromkeys(found))


def _title(scenes: Sequence[Scene]) -> str:
    return ", ".join(scene.title for scene in scenes if scene.title)


def _polars(scenes: Sequence[Scene], which: int, options: Options) -> str:
    """The same circle of each scene, all magnified alike."""
    plots = [polar.shown(scene, which) for scene in scenes]
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
        [head, *plot(shown, dial.placed(down, width))]
        for shown, head, down in zip(errors, grid.heads, grid.downs, strict=True)
    ]
    entries = list(dict.fromkeys(entry for circles in plots for entry in polar.entries(circles)))
    below, foot = polar.legend_below(entries, grid.rows[-1], page)
    return sheet(_title(scenes), (page, foot), options, *grid.placed(panels), below)
