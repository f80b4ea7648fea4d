"""The polar plot of a circle: its radial error, magnified, about the programmed circle.

A ring stands for each round number of µm; the thick one is the programmed circle. The band lies
between the least and the largest radius of each half degree, the line is their mean.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.errors import OptionError
from camtool.preview import legend, text
from camtool.preview.colours import FEED, FEED_PALE, FRAME, GRID, INK, PLOT, QUIET
from camtool.preview.options import SVG_WIDTH_PX, Options
from camtool.preview.page import sheet
from camtool.preview.rounds import Floats, Round
from camtool.preview.scene import Scene
from camtool.preview.svg import Look, PathData, element, number
from camtool.preview.text import Style
from camtool.preview.view import MARGIN, decimals_of, page_width, round_step
from camtool.units import UM_PER_MM

CAP = 14.5
ROOM = 62.0
"""Between the outermost ring and the edges of the page, for the names of the axes."""

BASE_SHARE = 0.62
"""The programmed circle lies at this share of the outermost radius, or farther in."""

FEWEST_RINGS = 3
"""At least so many rings fit between the programmed circle and the largest error."""

LEAST_UM = 1e-3
"""Errors smaller than this are not magnified further."""

RING_LABELS_DEG = 22.5
AXES = ("X+", "Y+", "X−", "Y−")


@dataclass(frozen=True)
class Dial:
    """Middle of the plot, radius of the programmed circle, units per µm, µm from ring to ring."""

    middle: tuple[float, float]
    base: float
    per_um: float
    step_um: float

    def at(self, angle: float, error_um: float) -> tuple[float, float]:
        """Page place of a radial error."""
        radius = self.base + error_um * self.per_um
        x, y = self.middle
        return x + radius * math.cos(angle), y - radius * math.sin(angle)


def draw_polar(scene: Scene, which: int, options: Options) -> str:
    """SVG text of the `which`-th circle of the scene, from 1; OptionError when there is none."""
    if not 1 <= which <= len(scene.rounds):
        many = len(scene.rounds)
        raise OptionError(
            f"there is no circle {which}",
            where="--polar",
            mend=f"take 1 to {many}" if many else "the path goes round no full circle",
        )
    one = scene.rounds[which - 1]
    errors = one.errors() * UM_PER_MM
    page = page_width(options.size_px or SVG_WIDTH_PX)
    dial = _dial(errors, page)
    head, down = legend.head(scene.title, _notes(one, which, dial), page)
    outer = 0.5 * page - MARGIN - ROOM
    dial = Dial((0.5 * page, down + ROOM + outer), dial.base, dial.per_um, dial.step_um)
    height = round(down + 2.0 * (ROOM + outer) + MARGIN)
    return sheet(
        scene.title,
        (page, height),
        options,
        head,
        _rings(dial, outer),
        _quadrants(dial, outer),
        _band(errors, dial),
        _labels(dial, outer),
    )


def _dial(errors: Floats, page: float) -> Dial:
    """Scaled so that the largest error, out or in, just fits."""
    outer = 0.5 * page - MARGIN - ROOM
    seen = errors[np.isfinite(errors)]
    out = max(float(seen.max(initial=0.0)), 0.0)
    into = max(-float(seen.min(initial=0.0)), 0.0)
    largest = max(out, into, LEAST_UM)
    step = round_step(largest / FEWEST_RINGS / 2.0)
    reach = step * math.ceil(largest / step)
    share = (1.0 - BASE_SHARE) if out >= into else 0.5
    base = (1.0 - share) * outer
    return Dial((0.0, 0.0), base, min(share * outer, 0.9 * base) / reach, step)


def _notes(one: Round, which: int, dial: Dial) -> tuple[str, ...]:
    x, y = one.centre_mm
    way = "counterclockwise" if one.ccw else "clockwise"
    largest, least, mean = one.radial_mm
    magnified = dial.per_um * UM_PER_MM * one.radius_mm / dial.base
    circular = _um(one.circular_mm).lstrip("+")
    return (
        f"circle {which}: radius {one.radius_mm:.4g} mm about ({x:.4g}, {y:.4g}) mm, {way}",
        f"G {circular}, F max {_um(largest)}, F min {_um(least)}, mean {_um(mean)} (µm)",
        f"reversal values B: X {_um(one.reversal_mm[0])}, Y {_um(one.reversal_mm[1])} (µm)",
        f"radial error × {magnified:.3g}; from ring to ring {dial.step_um:g} µm",
    )


def _um(length_mm: float) -> str:
    return f"{length_mm * UM_PER_MM:+.2f}" if math.isfinite(length_mm) else "unknown"


def _ring_errors(dial: Dial, outer: float) -> list[float]:
    """µm of each ring on the plot."""
    low = math.ceil(-0.95 * dial.base / dial.per_um / dial.step_um)
    high = math.floor((outer - dial.base + 1e-6) / dial.per_um / dial.step_um)
    return [k * dial.step_um for k in range(low, high + 1)]


def _rings(dial: Dial, outer: float) -> str:
    x, y = (number(place) for place in dial.middle)
    line: Look = {"fill": "none", "stroke": GRID, "stroke-width": 1.2}
    parts = [element("circle", {"cx": x, "cy": y, "r": number(outer), "fill": PLOT})]
    for error in _ring_errors(dial, outer):
        radius = number(dial.base + error * dial.per_um)
        base: Look = {"stroke": QUIET, "stroke-width": 2.0} if error == 0.0 else {}
        parts.append(element("circle", {"cx": x, "cy": y, "r": radius, **line, **base}))
    return element("g", {"id": "rings"}, *parts)


def _quadrants(dial: Dial, outer: float) -> str:
    """A line where each axis turns, with the name of its end."""
    data, labels = PathData(), []
    (x, y), style = dial.middle, Style(CAP, INK, "middle")
    for index, name in enumerate(AXES):
        cos, sin = round(math.cos(index * math.pi / 2)), round(math.sin(index * math.pi / 2))
        data.move(x, y)
        data.line(x + outer * cos, y - outer * sin)
        away = outer + 0.5 * ROOM
        labels.append(text.label(name, (x + away * cos, y - away * sin + 0.5 * CAP), style))
    line: Look = {"d": str(data), "fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    return element("g", {"id": "quadrants"}, element("path", line), *labels)


def _band(errors: Floats, dial: Dial) -> str:
    """Least to largest as a filled band, the mean as a line; open where nothing was seen."""
    step = 2.0 * math.pi / len(errors)
    band, line = PathData(), PathData()
    for run in _runs(np.isfinite(errors[:, 1])):
        angles = [(k + 0.5) * step for k in run]
        rows = [errors[k % len(errors)] for k in run]
        outside = [dial.at(a, float(row[2])) for a, row in zip(angles, rows, strict=True)]
        inside = [dial.at(a, float(row[0])) for a, row in zip(angles, rows, strict=True)]
        _stroke(band, outside + inside[::-1])
        band.close()
        _stroke(line, [dial.at(a, float(row[1])) for a, row in zip(angles, rows, strict=True)])
    if not line:
        return ""
    edge: Look = {"stroke": FEED_PALE, "stroke-width": 1.6, "stroke-linejoin": "round"}
    pen: Look = {"fill": "none", "stroke": FEED, "stroke-width": 2.4, "stroke-linejoin": "round"}
    return element(
        "g",
        {"id": "radial-error"},
        element("path", {"d": str(band), "fill": FEED_PALE, **edge}),
        element("path", {"d": str(line), **pen}),
    )


def _stroke(data: PathData, points: list[tuple[float, float]]) -> None:
    for index, point in enumerate(points):
        (data.line if index else data.move)(*point)


def _runs(seen: np.ndarray) -> list[list[int]]:
    """Runs of bins in a row, once round; a whole circle ends where it begins."""
    count = len(seen)
    if seen.all():
        return [list(range(count + 1))]
    if not seen.any():
        return []
    first = int(np.flatnonzero(~seen)[0])
    turned = np.roll(seen, -first)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], turned, [False]]).astype(np.int8)))
    return [
        list(range(first + low, first + high))
        for low, high in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]


def _labels(dial: Dial, outer: float) -> str:
    """µm at the rings, as many as have room."""
    angle = math.radians(RING_LABELS_DEG)
    every = max(1, math.ceil(2.2 * CAP / (dial.step_um * dial.per_um)))
    parts = []
    shown = [e for e in _ring_errors(dial, outer) if round(e / dial.step_um) % every == 0]
    last = max(shown)
    for error in shown:
        x, y = dial.at(angle, error)
        name = number(error, decimals_of(dial.step_um)) + (" µm" if error == last else "")
        style = Style(0.85 * CAP, QUIET, "middle")
        at = (x, y + 0.4 * CAP)
        halo: Look = {**text.stroke_of(style), "stroke": PLOT, "stroke-width": 5.0}
        parts.append(element("path", {"d": text.strokes(name, at, style), **halo}))
        parts.append(text.label(name, at, style))
    return element("g", {"id": "ring-labels"}, *parts)
