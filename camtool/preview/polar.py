"""The polar plot of a circle: its radial error, magnified, about the programmed circle; both ways
round in one plot where the path goes both, as a ball-bar does.

A ring stands for each round number of µm; the thick one is the programmed circle. The band lies
between the least and the largest radius of each half degree, the line is their mean.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from camtool.errors import OptionError
from camtool.preview import legend, text
from camtool.preview.colours import (
    BACK,
    BACK_PALE,
    FEED,
    FEED_PALE,
    FRAME,
    GRID,
    INK,
    PLOT,
    QUIET,
)
from camtool.preview.legend import Entry, line_swatch
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


PENS = ((FEED, FEED_PALE), (BACK, BACK_PALE))
"""Line and band of the first circle of a plot and of the second."""


@dataclass(frozen=True)
class Dial:
    """Middle of the plot, its radius, that of the programmed circle, units per µm, µm from ring
    to ring."""

    middle: tuple[float, float]
    outer: float
    base: float
    per_um: float
    step_um: float

    def at(self, angle: float, error_um: float) -> tuple[float, float]:
        """Page place of a radial error."""
        radius = self.base + error_um * self.per_um
        x, y = self.middle
        return x + radius * math.cos(angle), y - radius * math.sin(angle)


@dataclass(frozen=True, eq=False)
class Shown:
    """A circle of the plot: its number, and its errors (B, 3) µm."""

    which: int
    one: Round
    errors: Floats

    @property
    def way(self) -> str:
        return "counterclockwise" if self.one.ccw else "clockwise"


def shown(scene: Scene, which: int) -> tuple[Shown, ...]:
    """The `which`-th circle of the scene, from 1, and the same one gone round the other way where
    there is that; OptionError when there is no such circle."""
    if not 1 <= which <= len(scene.rounds):
        many = len(scene.rounds)
        raise OptionError(
            f"there is no circle {which}" + (f" in {scene.title}" if scene.title else ""),
            where="--polar",
            mend=f"take 1 to {many}" if many else "the path goes round no full circle",
        )
    partner = scene.rounds[which - 1].partner
    numbers = [which] if partner is None else [which, partner]
    rounds = [(number, scene.rounds[number - 1]) for number in numbers]
    return tuple(Shown(number, one, one.errors() * UM_PER_MM) for number, one in rounds)


def draw_polar(scene: Scene, which: int, options: Options) -> str:
    """SVG text of the `which`-th circle of the scene, from 1; OptionError when there is none."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    circles = shown(scene, which)
    dial = dial_of([circles], width)
    head, down = legend.head(scene.title, notes(circles, dial), width)
    dial = placed(dial, down, width)
    table = legend.rows(entries(circles), width, width)
    foot = dial.middle[1] + dial.outer + ROOM
    height = foot + MARGIN + (legend.ROW_STEP if table else 0.0)
    return sheet(
        scene.title,
        (width, round(height)),
        options,
        head,
        *plot(circles, dial),
        legend.legend(table, MARGIN, foot + 0.5 * legend.ROW_STEP),
    )


def dial_of(plots: Sequence[Sequence[Shown]], width: float) -> Dial:
    """The dial of plots so wide, its middle at (0, 0): scaled so that the largest error of all,
    out or in, just fits."""
    outer = 0.5 * width - MARGIN - ROOM
    errors = np.concatenate([circle.errors.ravel() for circles in plots for circle in circles])
    seen = errors[np.isfinite(errors)]
    out = max(float(seen.max(initial=0.0)), 0.0)
    into = max(-float(seen.min(initial=0.0)), 0.0)
    largest = max(out, into, LEAST_UM)
    step = round_step(largest / FEWEST_RINGS / 2.0)
    reach = step * math.ceil(largest / step)
    share = (1.0 - BASE_SHARE) if out >= into else 0.5
    base = (1.0 - share) * outer
    return Dial((0.0, 0.0), outer, base, min(share * outer, 0.9 * base) / reach, step)


def placed(dial: Dial, top: float, width: float) -> Dial:
    """The dial below `top`, in the middle of the width."""
    return replace(dial, middle=(0.5 * width, top + ROOM + dial.outer))


def plot(circles: Sequence[Shown], dial: Dial) -> list[str]:
    """Rings, the ends of the axes, and the error of each circle; bands lie below all lines."""
    bands, lines = [], []
    for circle, (line, pale) in zip(circles, PENS, strict=False):
        band, mean = _band(circle.errors, dial, line, pale)
        bands.append(band)
        lines.append(mean)
    error = element("g", {"id": "radial-error"}, *bands, *lines) if any(lines) else ""
    return [_rings(dial), _quadrants(dial), error, _labels(dial)]


def entries(circles: Sequence[Shown]) -> list[Entry]:
    """Which way is which, where there are two."""
    if len(circles) < 2:
        return []
    return [
        Entry(line_swatch(line, 2.4), f"{circle.way} (circle {circle.which})")
        for circle, (line, _) in zip(circles, PENS, strict=False)
    ]


def notes(circles: Sequence[Shown], dial: Dial) -> tuple[str, ...]:
    """The circle, its figures, and how much its errors are magnified."""
    first = circles[0].one
    x, y = first.centre_mm
    magnified = dial.per_um * UM_PER_MM * first.radius_mm / dial.base
    scale = f"radial error × {magnified:.3g}; from ring to ring {dial.step_um:g} µm"
    place = f"radius {first.radius_mm:.4g} mm about ({x:.4g}, {y:.4g}) mm"
    if len(circles) == 1:
        about = f"circle {circles[0].which}: {place}, {circles[0].way}"
        return (about, *_figures(first), scale)
    told = [f"{circle.way}: " + "; ".join(_figures(circle.one)) for circle in circles]
    both = f"both ways together: G(b) {_um(first.both_circular_mm).lstrip('+')} (µm)"
    return (f"circle {circles[0].which}: {place}, both ways round", *told, both, scale)


def _figures(one: Round) -> tuple[str, str]:
    largest, least, mean = one.radial_mm
    circular = _um(one.circular_mm).lstrip("+")
    return (
        f"G {circular}, F max {_um(largest)}, F min {_um(least)}, mean {_um(mean)} (µm)",
        f"reversal values B: X {_um(one.reversal_mm[0])}, Y {_um(one.reversal_mm[1])} (µm)",
    )


def _um(length_mm: float) -> str:
    return f"{length_mm * UM_PER_MM:+.2f}" if math.isfinite(length_mm) else "unknown"


def _ring_errors(dial: Dial) -> list[float]:
    """µm of each ring on the plot."""
    low = math.ceil(-0.95 * dial.base / dial.per_um / dial.step_um)
    high = math.floor((dial.outer - dial.base + 1e-6) / dial.per_um / dial.step_um)
    return [k * dial.step_um for k in range(low, high + 1)]


def _rings(dial: Dial) -> str:
    x, y = (number(place) for place in dial.middle)
    line: Look = {"fill": "none", "stroke": GRID, "stroke-width": 1.2}
    parts = [element("circle", {"cx": x, "cy": y, "r": number(dial.outer), "fill": PLOT})]
    for error in _ring_errors(dial):
        radius = number(dial.base + error * dial.per_um)
        base: Look = {"stroke": QUIET, "stroke-width": 2.0} if error == 0.0 else {}
        parts.append(element("circle", {"cx": x, "cy": y, "r": radius, **line, **base}))
    return element("g", {"id": "rings"}, *parts)


def _quadrants(dial: Dial) -> str:
    """A line where each axis turns, with the name of its end."""
    data, labels = PathData(), []
    (x, y), outer, style = dial.middle, dial.outer, Style(CAP, INK, "middle")
    for index, name in enumerate(AXES):
        cos, sin = round(math.cos(index * math.pi / 2)), round(math.sin(index * math.pi / 2))
        data.move(x, y)
        data.line(x + outer * cos, y - outer * sin)
        away = outer + 0.5 * ROOM
        labels.append(text.label(name, (x + away * cos, y - away * sin + 0.5 * CAP), style))
    line: Look = {"d": str(data), "fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    return element("g", {"id": "quadrants"}, element("path", line), *labels)


def _band(errors: Floats, dial: Dial, colour: str, pale: str) -> tuple[str, str]:
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
        return "", ""
    edge: Look = {"stroke": pale, "stroke-width": 1.6, "stroke-linejoin": "round"}
    pen: Look = {"fill": "none", "stroke": colour, "stroke-width": 2.4, "stroke-linejoin": "round"}
    return (
        element("path", {"d": str(band), "fill": pale, **edge}),
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


def _labels(dial: Dial) -> str:
    """µm at the rings, as many as have room."""
    angle = math.radians(RING_LABELS_DEG)
    every = max(1, math.ceil(2.2 * CAP / (dial.step_um * dial.per_um)))
    parts = []
    shown = [e for e in _ring_errors(dial) if round(e / dial.step_um) % every == 0]
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
