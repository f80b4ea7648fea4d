"""The Plot: lines, marks, arrows and texts, as the layers of a picture draw them.

Lines are written in mm (their group flips and scales), marks in units of the page."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from msgspec import Struct

from camtool.pictures import text
from camtool.pictures.chains import Chain, path_data
from camtool.pictures.colours import BODY, FEED, PLOT
from camtool.pictures.content import Place
from camtool.pictures.engaged import EngagementTrace, engagement_layer
from camtool.pictures.svg import Look, PathData, element, number
from camtool.pictures.text import TextStyle
from camtool.pictures.trace import ErrorTrace, trace_layer
from camtool.pictures.view import View

MAX_BODIES = 500
"""A drawing with more closed paths than this has no light fill."""

INK_SHARE = 0.12
"""Lines become thinner once they would cover more than this share of the plot."""

THINNEST = 0.5

ARROW_LENGTH, ARROW_WIDTH = 18.0, 6.5
ARROW_EVERY = 900.0
ARROWS_APART = 60.0
"""Arrows nearer than this to another one are left out: passes at several depths lie over each
other."""

MIN_LENGTH_WITH_ARROW = 90.0
MAX_WITH_ARROW, MAX_ON_ONE = 150, 4
MARKS_OF_FULL_SIZE = 120
MIN_MARK = 0.3
TIE_DECIMALS = 4

CAP = 12.0
"""Height of the letters of labels on the page."""

HALO = 5.0
"""Width of the rim, in the colour of the ground, around the letters."""

AWAY = 9.0
CLEAR = 3.0
MAX_LABELS = 400

DIRECTIONS = ((1.0, -1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))


class Plot(Struct, frozen=True):
    """The plot area of a picture: its functions return the SVG that layers draw there."""

    view: View

    # Lines, in mm.

    def pen(self, base: float, chains: Iterable[Chain]) -> float:
        """Return the line width in units of the page: `base`, or less where lines are crowded."""
        view = self.view
        length = sum(self._length_shown(chain) for chain in chains) * view.scale
        if length == 0.0:
            return base
        room = INK_SHARE * view.box.width * view.box.height / length
        return max(min(base, room), THINNEST)

    def _length_shown(self, chain: Chain) -> float:
        """Return about how many mm of a chain are in view.

        Each move whose box touches the window counts with its length, but with no more than the
        window's diagonal."""
        low, high = np.array([self.view.x_range, self.view.y_range]).T
        lengths = chain.lengths()
        is_near = np.empty(len(lengths), dtype=np.bool_)
        for first, part in chain.parts():
            begin, end = part.points[:-1], part.points[1:]
            overlaps = (np.minimum(begin, end) <= high) & (np.maximum(begin, end) >= low)
            is_near[first : first + len(overlaps)] = overlaps.all(axis=1)
        np.minimum(lengths, math.hypot(*(high - low)), out=lengths)
        return float(lengths[is_near].sum())

    def round_pen(self, width: float) -> Look:
        """Return the look of a pen with round ends, of this width on the page."""
        return {
            "fill": "none",
            "stroke-width": self.view.mm(width),
            "stroke-linecap": "round",
            "stroke-linejoin": "round",
        }

    def path(self, chains: Sequence[Chain]) -> str:
        """Return the SVG of lines and arcs as one path."""
        return element("path", {"d": path_data(chains)})

    def lines(self, name: str, chains: Sequence[Chain], look: Look) -> str:
        """Return the SVG of lines and arcs of one look as a group; "" without any."""
        return element("g", {"id": name, **look}, self.path(chains)) if chains else ""

    def body(self, chains: Sequence[Chain]) -> str:
        """Return the SVG of a light fill of the closed chains (even-odd, so that holes stay
        open)."""
        closed = [chain for chain in chains if chain.closed]
        if not closed or len(closed) > MAX_BODIES:
            return ""
        fill: Look = {"d": path_data(closed), "fill": BODY, "fill-rule": "evenodd"}
        return element("g", {"id": "body"}, element("path", fill))

    def frame(self, name: str, size_mm: tuple[float, float], colour: str) -> str:
        """Return the SVG of a rectangle of this size whose lower left corner is part zero."""
        sides: Look = {"x": 0.0, "y": 0.0, "width": size_mm[0], "height": size_mm[1]}
        line: Look = {"fill": "none", "stroke": colour, "stroke-width": self.view.mm(2.0)}
        return element("g", {"id": name}, element("rect", {**sides, **line}))

    def trace(self, trace: ErrorTrace, width: float) -> str:
        """Return the SVG of the predicted path of the slides, coloured by its error."""
        return trace_layer(trace, self.view, width)

    def engagement(self, trace: EngagementTrace, width: float) -> str:
        """Return the SVG of the moves of the slides, coloured by engagement."""
        return engagement_layer(trace, self.view, width)

    # Marks, in units of the page.

    def dots(self, name: str, places: Iterable[Place], look: Look) -> str:
        """Return the SVG of round marks at places in mm, made smaller where there are very
        many."""
        shown = [self.view.page(*place) for place in places if self.view.shows(*place)]
        if not shown:
            return ""
        shrink = max(math.sqrt(min(MARKS_OF_FULL_SIZE / len(shown), 1.0)), MIN_MARK)
        line = {key: value for key, value in look.items() if key != "r"}
        if "stroke-width" in line:
            line["stroke-width"] = round(float(line["stroke-width"]) * shrink, 3)
        size = number(float(look["r"]) * shrink)
        marks = [
            element("circle", {"cx": number(x), "cy": number(y), "r": size}) for x, y in shown
        ]
        return element("g", {"id": name, **line}, *marks)

    def arrows(self, chains: Sequence[Chain]) -> str:
        """Return the SVG of arrows in the direction of travel: none on a short chain, at most four
        on any."""
        view = self.view
        lengths = [float(chain.lengths().sum()) * view.scale for chain in chains]
        long = [index for index, length in enumerate(lengths) if length >= MIN_LENGTH_WITH_ARROW]
        data, arrows = PathData(), list[Place]()
        for index in long[:: 1 + len(long) // MAX_WITH_ARROW]:
            count = min(1 + int(lengths[index] / ARROW_EVERY), MAX_ON_ONE)
            for place in range(count):
                point, heading = _along(chains[index], place / count, (place + 1) / count)
                page_place = view.page(*point)
                if view.shows(*point) and all(
                    math.dist(page_place, one) >= ARROWS_APART for one in arrows
                ):
                    _arrow(data, page_place, -heading)
                    arrows.append(page_place)
        if not data:
            return ""
        return element("g", {"id": "arrows"}, element("path", {"d": str(data), "fill": FEED}))

    def texts(self, name: str, texts: Sequence[str], places: Sequence[Place], colour: str) -> str:
        """Return the SVG of short texts beside their places; a text that would cover another is
        left out."""
        labels = labels_beside(texts, places, self.view)
        return _group(name, [_written(label, colour) for label in labels])

    def ranks(self, name: str, places: Sequence[Place], look: Look) -> str:
        """Return the SVG of a ring at each place with its number, in the colour of the ring."""
        ranks = [str(rank) for rank in range(1, len(places) + 1)]
        labels = labels_beside(ranks, places, self.view)
        rings = []
        for label in labels:
            circle: Look = {"cx": number(label.place[0]), "cy": number(label.place[1])}
            rings.append(element("circle", {**circle, **look}))
        return _group(name, [*rings, *(_written(label, str(look["stroke"])) for label in labels)])


def _along(chain: Chain, low: float, high: float) -> tuple[tuple[float, float], float]:
    """Return a point for an arrow, and the direction of travel there, between two shares of a
    chain's length.

    It is the middle of the longest move, or part of a move, between these, and so away from
    corners."""
    ends = np.cumsum(chain.lengths())
    begins = np.concatenate([[0.0], ends[:-1]])
    first = np.maximum(begins, low * ends[-1])
    last = np.minimum(ends, high * ends[-1])
    # Rounded, so that of two halves of a circle the first is taken everywhere.
    index = int(np.argmax(np.round((last - first) / ends[-1], TIE_DECIMALS)))
    middle = 0.5 * (first[index] + last[index])
    return chain.at(index, float((middle - begins[index]) / (ends[index] - begins[index])))


def _arrow(data: PathData, place: tuple[float, float], heading: float) -> None:
    """Add a slim arrowhead to the path data, with its middle at `place`; `heading` is an angle on
    the page (Y down)."""
    cos, sin = math.cos(heading), math.sin(heading)
    half = ARROW_LENGTH / 2.0
    corners = ((half, 0.0), (-half, ARROW_WIDTH), (-half / 2.0, 0.0), (-half, -ARROW_WIDTH))
    for index, (along, across) in enumerate(corners):
        x, y = place[0] + along * cos - across * sin, place[1] + along * sin + across * cos
        (data.line if index else data.move)(x, y)
    data.close()


class Label(Struct, frozen=True):
    """A short text beside the place that it belongs to, both on the page; `box` is left, top,
    right, bottom."""

    text: str
    place: tuple[float, float]
    box: tuple[float, float, float, float]


def labels_beside(texts: Sequence[str], places: Sequence[Place], view: View) -> list[Label]:
    """Return labels for texts beside their places in mm; one that finds no free room is left
    out."""
    labels: list[Label] = []
    for words, place in list(zip(texts, places, strict=True))[:MAX_LABELS]:
        if not view.shows(*place):
            continue
        page_place = view.page(*place)
        for direction in DIRECTIONS:
            box = _label_box(words, page_place, direction)
            if _inside(box, view) and not any(_touch(box, label.box) for label in labels):
                labels.append(Label(words, page_place, box))
                break
    return labels


def _label_box(
    words: str, place: tuple[float, float], direction: tuple[float, float]
) -> tuple[float, float, float, float]:
    """Return the box of a text beside a place: right or left of it, and below or above it, by the
    signs of `direction`."""
    wide = text.width(words, CAP)
    left_x = place[0] + AWAY if direction[0] > 0.0 else place[0] - AWAY - wide
    top = place[1] + 0.5 * AWAY if direction[1] > 0.0 else place[1] - 0.5 * AWAY - CAP
    return left_x, top, left_x + wide, top + CAP


def _inside(box: tuple[float, float, float, float], view: View) -> bool:
    plot = view.box
    return (
        box[0] > plot.left and box[1] > plot.top and box[2] < plot.right and box[3] < plot.bottom
    )


def _touch(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    is_apart = a[2] + CLEAR <= b[0] or b[2] + CLEAR <= a[0]
    return not (is_apart or a[3] + CLEAR <= b[1] or b[3] + CLEAR <= a[1])


def _group(name: str, parts: list[str]) -> str:
    return element("g", {"id": name}, *parts) if parts else ""


def _written(label: Label, colour: str) -> str:
    style, place = TextStyle(CAP, colour), (label.box[0], label.box[3])
    halo: Look = {**text.stroke_of(style), "stroke": PLOT, "stroke-width": HALO}
    below = element("path", {"d": text.strokes(label.text, place, style), **halo})
    return below + "\n" + text.label(label.text, place, style)
