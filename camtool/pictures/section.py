"""Sections of the stock: heights along a line, with the heights that are wanted there.

Heights are drawn larger than places where the stock is thin; the factor is a round number and
stands above the picture."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.pictures import text
from camtool.pictures.colours import FEED, FRAME, GRID, INK, PLOT, STOCK
from camtool.pictures.layers import LegendEntry, line_swatch
from camtool.pictures.options import AS_USUAL, SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import (
    HEAD_GAP,
    LABEL_GAP,
    LEGEND_DROP,
    NAME_LIFT,
    NUMBERS,
    TICK,
    TICK_CAP,
    foot_of,
    legend_rows,
    mat,
    scale_bar,
    sheet,
    table_of,
    title_and_notes,
)
from camtool.pictures.svg import Look, PathData, element, number
from camtool.pictures.text import TextStyle
from camtool.pictures.view import MARGIN, View, decimals_of, fit, multiples, page_width, round_step

SHAPES = (0.3, 0.6)
"""Least and greatest height of the plot, as a share of its width."""

MAX_FACTOR = 1000.0
"""Heights are magnified at most this much."""

LEFT_ROOM = 84.0
"""Room for the numbers of the heights."""

GAP_UNITS = 70.0
"""Least distance of two numbers, units of the page."""

WANTED_DASHES = "9 6"


class StockSection(Struct, frozen=True, eq=False):
    """The stock along a line where an axis, "x" or "y", has the value `at_mm`: `profile` (P, 2),
    places along the other axis, ascending, and heights, mm. `bottom_mm`: height of the bottom of
    the stock, None if not known. `wanted` (Q, 3): places, and the least and the greatest height
    that is wanted there, mm; infinite where there is no limit."""

    axis: str
    at_mm: float
    profile: Floats
    bottom_mm: float | None = None
    wanted: Floats | None = None

    @property
    def along(self) -> str:
        """Name of the axis along which the section runs."""
        return "Y" if self.axis == "x" else "X"

    @property
    def foot_mm(self) -> float:
        """The lowest height that is drawn, mm: the bottom or the deepest cut, whichever is lower;
        below the cuts where the bottom is not known."""
        lowest = min(float(self.profile[:, 1].min()), 0.0)
        if self.bottom_mm is not None:
            return min(self.bottom_mm, lowest)
        return 1.25 * lowest or -1.0


def section_svg(title: str, section: StockSection, options: PictureOptions = AS_USUAL) -> str:
    """Return the SVG text of a section; equal input gives equal bytes. ValueError for a profile
    without two different places."""
    low, high = float(section.profile[0, 0]), float(section.profile[-1, 0])
    if not high > low:
        raise ValueError("a section needs two places")
    foot = section.foot_mm
    factor = height_factor(high - low, -foot)
    width = page_width(options.size_px or SVG_WIDTH_PX)
    notes = [f"section at {section.axis.upper()} {number(section.at_mm, 3)} mm"]
    deepest = -float(section.profile[:, 1].min())
    notes[0] += f"; cut {number(deepest, 4)} mm deep" if deepest > 0.0 else "; not cut"
    if factor != 1.0:
        notes.append(f"heights are drawn {factor:g} times as large")
    head, top = title_and_notes(title, notes, width)
    pad = 0.03 * (high - low)
    ground_mm = 0.12 * -foot * factor
    window = np.array([[low - pad, high + pad], [foot * factor - ground_mm, ground_mm]])
    view = fit(window, MARGIN + LEFT_ROOM, top + HEAD_GAP, width - MARGIN, SHAPES)
    entries = [LegendEntry(line_swatch(INK, 2.2), "stock")]
    if section.wanted is not None:
        entries.append(LegendEntry(line_swatch(FEED, 2.0, WANTED_DASHES), "wanted heights"))
    table, bar_y = table_of(entries, view, view.box)
    legend_y = view.box.bottom + LEGEND_DROP
    sizes = (width, foot_of(table, legend_y))
    grid, frame = _axes(section, view, factor)
    return sheet(
        title,
        sizes,
        options,
        grid,
        *_lines(section, view, factor),
        mat(view.box, *sizes),
        head,
        frame,
        legend_rows(table, view.box.left, legend_y),
        scale_bar(view, view.box.right, bar_y),
    )


def height_factor(length_mm: float, height_mm: float) -> float:
    """Return the round factor by which heights are drawn larger, so that the picture is no flatter
    than a plot may be."""
    factor = SHAPES[0] * length_mm / (1.3 * height_mm)
    return 1.0 if factor <= 1.0 else min(round_step(factor), MAX_FACTOR)


def _lines(section: StockSection, view: View, factor: float) -> list[str]:
    """Return the SVG of the material, its surface, and the wanted heights."""
    profile = section.profile.tolist()
    surface, body = PathData(), PathData()
    bottom = section.foot_mm if section.bottom_mm is None else section.bottom_mm
    for index, (place, z) in enumerate(profile):
        for data, level in ((surface, z), (body, max(z, bottom))):
            (data.line if index else data.move)(*view.page(place, level * factor))
    for place in (profile[-1][0], profile[0][0]):
        body.line(*view.page(place, bottom * factor))
    body.close()
    pen: Look = {"fill": "none", "stroke": INK, "stroke-width": 2.2, "stroke-linejoin": "round"}
    fill: Look = {"fill": STOCK, "fill-opacity": "0.45"}
    parts = [
        element("path", {"id": "material", "d": str(body), **fill}),
        element("path", {"id": "surface", "d": str(surface), **pen}),
    ]
    wanted_line = _wanted_heights(section, view, factor)
    if wanted_line:
        dashed: Look = {**pen, "stroke": FEED, "stroke-width": 2.0}
        dashed["stroke-dasharray"] = WANTED_DASHES
        parts.append(element("path", {"id": "wanted", "d": wanted_line, **dashed}))
    return parts


def _wanted_heights(section: StockSection, view: View, factor: float) -> str:
    """Return the path data of the least and greatest wanted heights, interrupted where there is no
    limit."""
    data = PathData()
    if section.wanted is None:
        return ""
    for column in (1, 2):
        drawn = False
        for row in section.wanted.tolist():
            if not math.isfinite(row[column]):
                drawn = False
                continue
            (data.line if drawn else data.move)(*view.page(row[0], row[column] * factor))
            drawn = True
    return str(data)


def _axes(section: StockSection, view: View, factor: float) -> tuple[str, str]:
    """Return the SVG of the ground with its grid, and of the frame with ticks and numbers."""
    box, grid, marks, labels = view.box, PathData(), PathData(), []
    step = round_step(GAP_UNITS / view.scale)
    base = box.bottom + TICK + LABEL_GAP + TICK_CAP
    room = text.width(f"{section.along} (mm)", TICK_CAP) + 2.0 * TICK_CAP
    for place in multiples(*view.x_range, step):
        x = view.page(place, 0.0)[0]
        _line(grid, (x, box.top), (x, box.bottom))
        _line(marks, (x, box.bottom), (x, box.bottom + TICK))
        if x <= box.right - room:
            name = number(place, decimals_of(step))
            labels.append(
                text.label(name, (x, base), TextStyle(TICK_CAP, NUMBERS.colour, "middle"))
            )
    level = round_step(0.6 * GAP_UNITS / view.scale / factor)
    for z in multiples(view.y_range[0] / factor, view.y_range[1] / factor, level):
        y = view.page(0.0, z * factor)[1]
        _line(grid, (box.left, y), (box.right, y))
        _line(marks, (box.left - TICK, y), (box.left, y))
        label_place = (box.left - TICK - LABEL_GAP, y + TICK_CAP / 2.0)
        name = number(z, decimals_of(level))
        labels.append(text.label(name, label_place, TextStyle(TICK_CAP, NUMBERS.colour, "end")))
    end = TextStyle(TICK_CAP, NUMBERS.colour, "end")
    labels.append(text.label(f"{section.along} (mm)", (box.right, base), end))
    labels.append(text.label("Z (mm)", (box.left, box.top - NAME_LIFT), NUMBERS))
    sides: Look = {"x": box.left, "y": box.top, "width": box.width, "height": box.height}
    thin: Look = {"fill": "none", "stroke": GRID, "stroke-width": 1.2}
    pen: Look = {"fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    ground = element("rect", {**sides, "fill": PLOT})
    return (
        element("g", {"id": "grid"}, ground, element("path", {"d": str(grid), **thin})),
        element(
            "g",
            {"id": "axes"},
            element("rect", {**sides, **pen}),
            element("path", {"d": str(marks), **pen}),
            *labels,
        ),
    )


def _line(data: PathData, begin: tuple[float, float], end: tuple[float, float]) -> None:
    data.move(*begin)
    data.line(*end)
