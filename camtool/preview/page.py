"""Where everything lies on the page: head, plot, numbers, colour bar, legend, scale bar."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.preview import axes, legend
from camtool.preview.axes import Ticks, ticks_of
from camtool.preview.content import Content
from camtool.preview.entries import entries_of
from camtool.preview.legend import Entry
from camtool.preview.view import (
    CROP_SHAPES,
    MARGIN,
    PAGE,
    TALLEST,
    WIDEST,
    View,
    fit,
)

HEAD_GAP = 50.0
"""Room between the head and the plot, for the names above it."""

LEGEND_DROP = 70.0
"""From the plot's foot to the middle of the legend's first row."""

FOOT = 32.0
BAR_ROOM = 36.0
GUESSED_LEFT = 52.0


@dataclass(frozen=True, eq=False)
class Page:
    """`head` is ready; the legend's first row is centred on `legend_y`; `width` and
    `height` of the whole."""

    head: str
    view: View
    ticks: Ticks
    rows: list[list[Entry]]
    legend_y: float
    height: float
    width: float = PAGE


def page_of(content: Content, width: float = PAGE) -> Page:
    """Fit the plot twice: the room that its numbers need follows from its scale."""
    head, down = legend.head(content.scene.title, content.notes, width)
    top = down + HEAD_GAP
    left, right = MARGIN + GUESSED_LEFT, width - MARGIN
    shapes = (WIDEST, TALLEST) if content.crop_mm is None else CROP_SHAPES
    for _ in range(2):
        view = fit(content.window, left, top, right, shapes)
        ticks = ticks_of(view)
        left = MARGIN + ticks.left_width + axes.TICK + axes.LABEL_GAP
        right = width - MARGIN
        if content.trace is not None:
            right -= legend.bar_width(content.trace.top_um, view.box.height)
    view = fit(content.window, left, top, right, shapes)
    ticks = ticks_of(view)
    room = view.box.width - axes.scale_bar_width(view) - BAR_ROOM
    table = legend.rows(entries_of(content, view), room, view.box.width)
    legend_y = view.box.bottom + LEGEND_DROP
    height = legend_y + max(len(table) - 1, 0) * legend.ROW_STEP + FOOT
    return Page(head, view, ticks, table, legend_y, round(height), width)
