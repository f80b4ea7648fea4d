"""The polar plot of a circle: its radial error, magnified, about the programmed circle.

Where the path follows the circle in both directions, as in a ball-bar test, one plot shows both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.pictures import text
from camtool.pictures.colours import BACK, BACK_SPREAD, FEED, FRAME, GRID, INK, PLOT, QUIET, SPREAD
from camtool.pictures.layers import LegendEntry, line_swatch
from camtool.pictures.options import SVG_WIDTH_PX, PictureOptions
from camtool.pictures.page import legend_below, sheet, title_and_notes
from camtool.pictures.scene import Round, Scene
from camtool.pictures.svg import Look, PathData, element, number
from camtool.pictures.text import TextStyle
from camtool.pictures.view import MARGIN, PageBox, decimals_of, page_width, round_step
from camtool.records import replace
from camtool.units import UM_PER_MM


class CircleErrors(Struct, frozen=True, eq=False):
    """A circle of the plot: its number `which`, and its errors (B, 3) µm."""

    which: int
    one: Round
    errors_um: Floats

    @property
    def direction(self) -> str:
        return "counterclockwise" if self.one.ccw else "clockwise"


def circle_pair(scene: Scene, circle_number: int) -> tuple[CircleErrors, ...]:
    """Return the circle with this number, from 1, and the same circle cut in the other direction,
    if there is one; counterclockwise first.

    OptionError if there is no such circle."""
    if not 1 <= circle_number <= len(scene.rounds):
        count = len(scene.rounds)
        raise OptionError(
            f"there is no circle {circle_number}" + (f" in {scene.title}" if scene.title else ""),
            where="--polar",
            mend=f"take 1 to {count}" if count else "the path goes round no full circle",
        )
    partner = scene.rounds[circle_number - 1].partner
    numbers = [circle_number] if partner is None else [circle_number, partner]
    rounds = [(number, scene.rounds[number - 1]) for number in numbers]
    rounds.sort(key=lambda pair: not pair[1].ccw)
    return tuple(CircleErrors(number, one, one.errors() * UM_PER_MM) for number, one in rounds)


def draw_polar(scene: Scene, number: int, options: PictureOptions) -> str:
    """Return SVG text of the polar plot of the circle with this number, from 1; OptionError when
    there is none."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    circles = circle_pair(scene, number)
    errors = [circle.errors_um for circle in circles]
    dial = dial_of(errors, width)
    head, top = title_and_notes(scene.title, notes(circles, dial), width)
    dial = dial.centred_below(top, width)
    foot = dial.middle[1] + dial.outer + ROOM
    below, foot = legend_below(entries(circles), foot, width)
    return sheet(scene.title, (width, foot), options, head, *plot(errors, dial), below)


def entries(circles: Sequence[CircleErrors]) -> list[LegendEntry]:
    """Return the entries of the legend: the direction of each circle, if there are two."""
    if len(circles) < 2:
        return []
    return [
        LegendEntry(line_swatch(line, 2.4), f"{circle.direction} (circle {circle.which})")
        for circle, (line, _) in zip(circles, PENS, strict=False)
    ]


def notes(circles: Sequence[CircleErrors], dial: Dial) -> tuple[str, ...]:
    """Return the notes: centre and radius of the circle, its figures, and the magnification of its
    errors."""
    first = circles[0].one
    x, y = first.centre_mm
    magnified = dial.per_um * UM_PER_MM * first.radius_mm / dial.base
    times = number(float(f"{magnified:.3g}"), 3)
    scale = f"radial error × {times}; from ring to ring {dial.step_um:g} µm"
    place = f"radius {first.radius_mm:.4g} mm about ({x:.4g}, {y:.4g}) mm"
    if len(circles) == 1:
        title = f"circle {circles[0].which}: {place}, {circles[0].direction}"
        figures = f"{_iso(first)} (µm)", f"reversal values {_reversal(first)} (µm)"
        return (title, *figures, scale)
    each = [
        f"{circle.direction}: {_iso(circle.one)}, {_reversal(circle.one)} (µm)"
        for circle in circles
    ]
    both_text = f"both ways together: G(b) {_um(first.both_circular_mm).lstrip('+')} (µm)"
    names = " and ".join(str(circle.which) for circle in circles)
    return (f"circles {names}: {place}, both ways round", *each, both_text, scale)


def _iso(one: Round) -> str:
    largest, smallest, mean = one.radial_mm
    circular = _um(one.circular_mm).lstrip("+")
    return f"G {circular}, F max {_um(largest)}, F min {_um(smallest)}, mean {_um(mean)}"


def _reversal(one: Round) -> str:
    return f"B: X {_um(one.reversal_mm[0])}, Y {_um(one.reversal_mm[1])}"


def _um(length_mm: float) -> str:
    return f"{length_mm * UM_PER_MM:+.2f}" if math.isfinite(length_mm) else "unknown"


# The dial of a polar plot: rings, the ends of the axes, and the errors of one circle or of two.
#
# Each round number of µm has a ring; the thick one is the programmed circle. The band lies between
# the least and the largest radius of each half degree, the line is their mean.

CAP, LABEL_CAP = 14.5, 12.3
HALO = 2.5
ROOM = 62.0
"""Between the outermost ring and the edges of the page, for the names of the axes."""

BASE_SHARE = 0.62
"""Radius of the programmed circle as a share of the outermost one, at most."""

MIN_RINGS = 3

MIN_RANGE_UM = 1e-3
"""Errors smaller than this are not magnified further."""

LABELS_DEG = (22.5, 67.5, 112.5, 157.5, 202.5, 247.5, 292.5, 337.5)
"""Directions in which the rings may be numbered: the one where the numbers hide the fewest errors
is used."""

MIN_LABELS = 2

FIRST_LABEL = 40.0
"""Rings with a smaller radius have no number, as it would cover the middle."""

AXES = ("X+", "Y+", "X−", "Y−")

PENS = ((FEED, SPREAD), (BACK, BACK_SPREAD))
"""Line and band of the first circle of a plot and of the second."""


class Dial(Struct, frozen=True):
    """The geometry of a polar plot: its middle, its radius, the radius of the programmed circle,
    units of the page per µm, and µm from ring to ring."""

    middle: tuple[float, float]
    outer: float
    base: float
    per_um: float
    step_um: float

    def at(self, angle: float, error_um: float) -> tuple[float, float]:
        """Return the place on the page of a radial error at an angle."""
        radius = self.base + error_um * self.per_um
        x, y = self.middle
        return x + radius * math.cos(angle), y - radius * math.sin(angle)

    def centred_below(self, top: float, width: float) -> Dial:
        """Return the dial moved below `top`, to the middle of the width."""
        return replace(self, middle=(0.5 * width, top + ROOM + self.outer))


def dial_of(errors_um: Sequence[Floats], width: float) -> Dial:
    """Return the dial for errors (B, 3) µm of circles, on a plot of this width, with its middle at
    (0, 0).

    It is scaled so that the largest error of all, outward or inward, just fits."""
    outer = 0.5 * width - MARGIN - ROOM
    errors = np.concatenate([each.ravel() for each in errors_um])
    finite = errors[np.isfinite(errors)]
    outward = max(float(finite.max(initial=0.0)), 0.0)
    inward = max(-float(finite.min(initial=0.0)), 0.0)
    largest = max(outward, inward, MIN_RANGE_UM)
    step = round_step(largest / MIN_RINGS / 2.0)
    reach = step * math.ceil(largest / step)
    share = (1.0 - BASE_SHARE) if outward >= inward else 0.5
    base = (1.0 - share) * outer
    return Dial((0.0, 0.0), outer, base, min(share * outer, 0.9 * base) / reach, step)


def plot(errors_um: Sequence[Floats], dial: Dial) -> list[str]:
    """Return the SVG of the rings, the ends of the axes, and the errors (B, 3) µm of each circle;
    bands lie below lines."""
    bands, lines = [], []
    for errors, (line, pale) in zip(errors_um, PENS, strict=False):
        band, mean = _band(errors, dial, line, pale)
        bands.append(band)
        lines.append(mean)
    error = element("g", {"id": "radial-error"}, *bands, *lines) if any(lines) else ""
    return [_rings(dial), _quadrants(dial), error, _labels(errors_um, dial)]


def _ring_errors(dial: Dial) -> list[float]:
    """Return the radial error, µm, that each ring of the plot stands for."""
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
    """Return the SVG of a line to each end of an axis, where that axis reverses, with its name."""
    data, labels = PathData(), []
    (x, y), outer, style = dial.middle, dial.outer, TextStyle(CAP, INK, "middle")
    for index, name in enumerate(AXES):
        cos, sin = round(math.cos(index * math.pi / 2)), round(math.sin(index * math.pi / 2))
        data.move(x, y)
        data.line(x + outer * cos, y - outer * sin)
        radius = outer + 0.5 * ROOM
        labels.append(text.label(name, (x + radius * cos, y - radius * sin + 0.5 * CAP), style))
    line: Look = {"d": str(data), "fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    return element("g", {"id": "quadrants"}, element("path", line), *labels)


def _band(errors: Floats, dial: Dial, colour: str, pale: str) -> tuple[str, str]:
    """Return the SVG of a band from the least to the largest error, and of a line of the mean;
    both are interrupted where the slides never were."""
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


def _runs(has_error: np.ndarray) -> list[list[int]]:
    """Return the indices of consecutive bins that have an error, once around the circle; a full
    circle repeats its first bin at the end."""
    count = len(has_error)
    if has_error.all():
        return [list(range(count + 1))]
    if not has_error.any():
        return []
    first = int(np.flatnonzero(~has_error)[0])
    rolled = np.roll(has_error, -first)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], rolled, [False]]).astype(np.int8)))
    return [
        list(range(first + low, first + high))
        for low, high in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]


def _labels(errors_um: Sequence[Floats], dial: Dial) -> str:
    """Return the SVG of the numbers of the rings, µm, along the direction in which they hide the
    fewest errors.

    Numbers that would hide an error are left out if at least `MIN_LABELS` others remain."""
    places = np.array([_places(errors, dial) for errors in errors_um]).reshape(-1, 2)
    clear, numbers = [], []
    for degrees in LABELS_DEG:
        numbers.append(_numbers(dial, math.radians(degrees)))
        clear.append([one for one in numbers[-1] if not _hides(one[2], places)])
    best = max(range(len(clear)), key=lambda index: len(clear[index]))
    shown = clear[best] if len(clear[best]) >= MIN_LABELS else numbers[best]
    style, parts = TextStyle(LABEL_CAP, QUIET), []
    for name, place, _ in shown:
        halo: Look = {**text.stroke_of(style), "stroke": PLOT, "stroke-width": 2.0 * HALO}
        parts.append(element("path", {"d": text.strokes(name, place, style), **halo}))
        parts.append(text.label(name, place, style))
    return element("g", {"id": "ring-labels"}, *parts)


def _places(errors_um: Floats, dial: Dial) -> Floats:
    """Return the places (3 B, 2) on the page of the least, mean and largest errors; NaN where the
    slides never were."""
    angle = (np.arange(len(errors_um)) + 0.5) * (2.0 * np.pi / len(errors_um))
    radius = dial.base + errors_um * dial.per_um
    x = dial.middle[0] + radius * np.cos(angle)[:, None]
    y = dial.middle[1] - radius * np.sin(angle)[:, None]
    return np.column_stack([x.ravel(), y.ravel()])


def _numbers(dial: Dial, angle: float) -> list[tuple[str, tuple[float, float], PageBox]]:
    """Return the text of each number, the start of its baseline and its box, for the rings that
    have a number along this angle."""
    every = max(1, math.ceil(2.2 * CAP / (dial.step_um * dial.per_um)))
    shown = [e for e in _ring_errors(dial) if round(e / dial.step_um) % every == 0]
    numbers = []
    for error in shown:
        if dial.base + error * dial.per_um < FIRST_LABEL:
            continue
        x, y = dial.at(angle, error)
        name = number(error, decimals_of(dial.step_um))
        half, base = 0.5 * text.width(name, LABEL_CAP), y + 0.5 * LABEL_CAP
        name += " µm" if error == shown[-1] else ""
        left, right = x - half, x - half + text.width(name, LABEL_CAP)
        box = PageBox(left - HALO, base - LABEL_CAP - HALO, right + HALO, base + HALO)
        numbers.append((name, (left, base), box))
    return numbers


def _hides(box: PageBox, places: Floats) -> bool:
    x, y = places.T
    inside = (x > box.left) & (x < box.right) & (y > box.top) & (y < box.bottom)
    return bool(inside.any())
