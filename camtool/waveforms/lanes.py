"""A picture of quantities over time: lanes one below the other, with one axis of time.

Each curve is the band between the least and the largest value of its columns (`columns`), so that
a picture is never larger than its width, and every peak is in it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.pictures import text
from camtool.pictures.colours import FRAME, GRID, INK, PLOT, QUIET
from camtool.pictures.options import SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import TICK, TICK_CAP, sheet, title_and_notes
from camtool.pictures.svg import Look, PathData, element, number, title
from camtool.pictures.text import TextStyle
from camtool.pictures.view import MARGIN, decimals_of, multiples, page_width, round_step

NUMBERS = 96.0

TIME_SPACING, VALUE_SPACING = 90.0, 26.0
"""Least distances of the numbers of the two axes."""

LANE_GAP, NAME_ROOM = 44.0, 26.0
"""Room between two lanes, and from the foot of the head to the first one."""

STRIP, STRIP_GAP = 10.0, 12.0
"""Height of a strip of the ribbon, and the gap between two."""

PAD = 0.06
"""Share of a lane's height that stays free above and below its curves."""

UNITS = (3600.0, "h", 7200.0), (60.0, "min", 600.0), (1.0, "s", 1.0), (1e-3, "ms", 1e-3)
"""(Unit in s, its name, least span in s for which it is used)."""


class Trend(Struct, frozen=True, eq=False):
    """A quantity: its name, least and largest values (C,) by column, infinite for none; drawn
    dashed and above the others if it `is_wanted`."""

    name: str
    colour: str
    low: Floats
    high: Floats
    is_wanted: bool = False


class Lane(Struct, frozen=True, eq=False):
    """Curves over one axis of values; `mark`: column and value of the peak that is ringed."""

    name: str
    curves: tuple[Trend, ...]
    height: float
    from_zero: bool = False
    mark: tuple[int, float] | None = None


class Strip(Struct, frozen=True, eq=False):
    """A strip of the ribbon below the lanes: what the machine does in the columns `on` (C,)."""

    name: str
    colour: str
    on: Bools


class TimePlot(Struct, frozen=True, eq=False):
    """The content of a picture over time."""

    title: str
    notes: tuple[str, ...]
    from_s: float
    to_s: float
    lanes: tuple[Lane, ...]
    ribbon: tuple[Strip, ...] = ()


def columns_for(options: PictureOptions) -> int:
    """Return the number of columns of a picture with these options: its pixels across."""
    size_px = options.size_px or SVG_WIDTH_PX
    width = page_width(size_px)
    return max(round((width - 2.0 * MARGIN - NUMBERS) * size_px / width), 1)


def lanes_svg(plot: TimePlot, options: PictureOptions) -> str:
    """Return a plot as SVG text; equal input gives equal bytes."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    head, head_end = title_and_notes(plot.title, plot.notes, width)
    sides = MARGIN + NUMBERS, width - MARGIN
    unit_s, unit = time_unit(plot.to_s - plot.from_s, plot.to_s)
    parts: list[str] = []
    top = head_end + NAME_ROOM + 8.0
    for lane in plot.lanes:
        parts += _lane(lane, plot, sides, top, unit_s)
        top += lane.height + LANE_GAP
    top -= LANE_GAP - 14.0
    for strip in plot.ribbon:
        parts += _strip(strip, sides, top)
        top += STRIP + STRIP_GAP
    parts.append(_times(plot, sides, top, (unit_s, unit)))
    legend, foot = _legend(plot, top + 52.0, width)
    return sheet(plot.title, (width, round(foot)), options, head, *parts, legend)


def time_unit(span_s: float, most_s: float) -> tuple[float, str]:
    """Return (seconds in the unit, its name) for a time axis that is `span_s` long and ends at
    `most_s`."""
    chosen = next(((size, name) for size, name, from_s in UNITS if span_s >= from_s), (1e-3, "ms"))
    # A short stretch late in a program: numbers of seven digits are no help.
    return (1.0, "s") if chosen[1] == "ms" and most_s >= 100.0 else chosen


def _lane(
    lane: Lane, plot: TimePlot, sides: tuple[float, float], top: float, unit_s: float
) -> Iterator[str]:
    """Yield the SVG of a lane: its background, its curves and its axis of values."""
    (x_low, x_high), bottom = sides, top + lane.height
    low, high = _range(lane)
    scale = lane.height / (high - low)
    frame: Look = {"x": x_low, "y": top, "width": x_high - x_low, "height": lane.height}
    yield element("rect", {**frame, "fill": PLOT})
    step = round_step((high - low) * VALUE_SPACING / lane.height)
    grid, labels = PathData(), []
    for value in multiples(low, high, step):
        y = bottom - (value - low) * scale
        grid.move(x_low - TICK, y)
        grid.line(x_high, y)
        words = number(value, decimals_of(step))
        place = (x_low - TICK - 6.0, y + TICK_CAP / 2.0)
        labels.append(text.label(words, place, TextStyle(TICK_CAP, QUIET, "end")))
    for x in _time_ticks(plot, sides, unit_s)[0]:
        grid.move(x, top)
        grid.line(x, bottom)
    yield element("path", {"d": str(grid), "fill": "none", "stroke": GRID, "stroke-width": 1.4})
    if low < 0.0 < high:
        y = bottom + low * scale
        axis: Look = {"d": f"M{number(x_low)} {number(y)}H{number(x_high)}", "stroke": FRAME}
        yield element("path", {**axis, "fill": "none", "stroke-width": 1.4})
    for curve in sorted(lane.curves, key=lambda each: each.is_wanted):
        yield _curve(curve, sides, (low, bottom, scale))
    if lane.mark is not None:
        column, value = lane.mark
        across = x_low + (column + 0.5) * (x_high - x_low) / len(lane.curves[0].low)
        ring: Look = {"cx": across, "cy": bottom - (value - low) * scale, "r": 6.0}
        yield element("circle", {**ring, "fill": "none", "stroke": INK, "stroke-width": 1.8})
    yield element("rect", {**frame, "fill": "none", "stroke": FRAME, "stroke-width": 1.4})
    yield from labels
    yield text.label(lane.name, (x_low, top - 9.0), TextStyle(TICK_CAP, INK))


def _range(lane: Lane) -> tuple[float, float]:
    """Return the values at the bottom and at the top of a lane."""
    values = [part[np.isfinite(part)] for curve in lane.curves for part in (curve.low, curve.high)]
    drawn = np.concatenate(values)
    low, high = (float(drawn.min()), float(drawn.max())) if len(drawn) else (0.0, 1.0)
    if lane.from_zero:
        low, high = min(low, 0.0), max(high, 0.0)
    # Rounding of positions is no motion.
    pad = max(PAD * (high - low), 1e-6 * max(abs(low), abs(high)), 1e-9)
    pad = pad if high > low else max(0.5 * abs(high), 0.5)
    return (low if lane.from_zero and low == 0.0 else low - pad), high + pad


def _curve(curve: Trend, sides: tuple[float, float], heights: tuple[float, float, float]) -> str:
    """Return the SVG of a curve: the band between its least and largest value, column by column,
    as one line."""
    (x_low, x_high), (foot, bottom, scale) = sides, heights
    step, path = (x_high - x_low) / len(curve.low), PathData()
    drawn = np.flatnonzero(np.isfinite(curve.low))
    low = (bottom - (curve.low - foot) * scale).tolist()
    high = (bottom - (curve.high - foot) * scale).tolist()
    for run in np.split(drawn, np.flatnonzero(np.diff(drawn) > 1) + 1):
        for k, column in enumerate(run.tolist()):
            x, ends = x_low + (column + 0.5) * step, (low[column], high[column])
            if k == 0:
                path.move(x - 0.5 * step, ends[0])
                y = ends[0]
            elif ends == (y, y) and k + 1 < len(run):
                continue  # flat: the line goes on
            else:
                path.line(x - 0.5 * step, y)
            # Through both ends, the nearer one first.
            near, far = sorted(ends, key=lambda end: abs(end - y))
            if near != y:
                path.line(x, near)
            if far != near:
                path.line(x, far)
            y = far
        if len(run):
            path.line(x_low + (int(run[-1]) + 1.0) * step, y)
    pen: Look = {"d": str(path), "fill": "none", "stroke": curve.colour}
    pen["stroke-width"] = 1.5 if curve.is_wanted else 1.8
    pen["stroke-linejoin"] = "round"
    if curve.is_wanted:
        pen["stroke-dasharray"] = "7 4"
    return element("path", pen, title(curve.name))


def _strip(strip: Strip, sides: tuple[float, float], top: float) -> Iterator[str]:
    """Yield the SVG of a strip of the ribbon, with its name at the left."""
    x_low, x_high = sides
    step, path = (x_high - x_low) / len(strip.on), PathData()
    edges = np.flatnonzero(np.diff(np.concatenate([[False], strip.on, [False]]).astype(np.int8)))
    for low, high in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        path.move(x_low + low * step, top + STRIP / 2.0)
        path.line(x_low + high * step, top + STRIP / 2.0)
    if path:
        pen: Look = {"d": str(path), "fill": "none", "stroke": strip.colour}
        yield element("path", {**pen, "stroke-width": STRIP}, title(strip.name))
    place = (x_low - TICK - 6.0, top + STRIP / 2.0 + TICK_CAP / 2.0)
    yield text.label(strip.name, place, TextStyle(TICK_CAP, QUIET, "end"))


def _time_ticks(
    plot: TimePlot, sides: tuple[float, float], unit_s: float
) -> tuple[list[float], list[str]]:
    """Return the X positions of round times, and the numbers to write there."""
    (x_low, x_high), low, high = sides, plot.from_s / unit_s, plot.to_s / unit_s
    step = round_step((high - low) * TIME_SPACING / (x_high - x_low))
    values = multiples(low, high, step)
    places = [x_low + (value - low) / (high - low) * (x_high - x_low) for value in values]
    return places, [number(value, decimals_of(step)) for value in values]


def _times(plot: TimePlot, sides: tuple[float, float], top: float, unit: tuple[float, str]) -> str:
    """Return the SVG of the numbers of the time axis, counted from the start of the program."""
    x_high = sides[1]
    parts = [
        text.label(words, (x, top + 22.0), TextStyle(TICK_CAP, QUIET, "middle"))
        for x, words in zip(*_time_ticks(plot, sides, unit[0]), strict=True)
    ]
    name = text.label(f"time ({unit[1]})", (x_high, top + 46.0), TextStyle(TICK_CAP, QUIET, "end"))
    return element("g", {"id": "time"}, *parts, name)


def _legend(plot: TimePlot, top: float, width: float) -> tuple[str, float]:
    """Return the SVG of the legend below the axis, for lanes with several curves, and the Y at
    which the page ends."""
    shared = [lane for lane in plot.lanes if len(lane.curves) > 1]
    curves = {curve.name: curve for lane in shared for curve in lane.curves}
    if not curves:
        return "", top + 6.0
    across, parts = MARGIN + NUMBERS, []
    for curve in curves.values():
        line: Look = {"d": f"M{number(across)} {number(top)}h34", "stroke": curve.colour}
        if curve.is_wanted:
            line["stroke-dasharray"] = "7 4"
        parts.append(element("path", {**line, "fill": "none", "stroke-width": 2.4}))
        place = (across + 42.0, top + TICK_CAP / 2.0)
        parts.append(text.label(curve.name, place, TextStyle(TICK_CAP, QUIET)))
        across += 42.0 + text.width(curve.name, TICK_CAP) + 30.0
    return element("g", {"id": "legend"}, *parts), top + 34.0
