"""The layers of the plot: lines in mm (their group flips and scales), marks in page units."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from camtool.geometry.drawing import Drawing
from camtool.pictures import text
from camtool.pictures.colours import (
    BODY,
    DRAWING,
    FEED,
    FEED_PALE,
    GAP,
    INK,
    LAYERS,
    PAPER,
    PLOT,
    PLUNGE,
    RAPID,
    REVERSAL,
    SWEPT,
    TRAVEL,
)
from camtool.pictures.strokes import Chain, path_data
from camtool.pictures.svg import Look, PathData, element, number, title
from camtool.pictures.text import Style
from camtool.pictures.view import View, round_step

MOST_BODIES = 500
"""The light fill shows what is closed; drawings of more paths go without."""

INK_SHARE = 0.12
"""Lines become thinner once they would cover more than this share of the plot."""

THINNEST = 0.5

ARROW_LENGTH, ARROW_WIDTH = 18.0, 6.5
ARROW_EVERY = 900.0
ARROWS_APART = 60.0
"""An arrow nearer than this to another is left out: passes at several depths lie over each
other."""

SHORTEST_WITH_ARROW = 90.0
MOST_WITH_ARROW, MOST_ON_ONE = 150, 4
MARKS_OF_FULL_SIZE = 120
SMALLEST_MARK = 0.3
TIE_DECIMALS = 4


@dataclass(frozen=True)
class Group:
    """Paths of one layer of the drawing, in one colour."""

    name: str
    colour: str
    chains: tuple[Chain, ...]


def groups_of(drawing: Drawing, chains: Sequence[Chain], *, alone: bool) -> tuple[Group, ...]:
    """The layers in order of first use: light below a toolpath, in strong colours when alone."""
    names = tuple(dict.fromkeys(drawing.layers))
    members: dict[str, list[Chain]] = {name: [] for name in names}
    for name, chain in zip(drawing.layers, chains, strict=True):
        members[name].append(chain)
    return tuple(
        Group(name, LAYERS[index % len(LAYERS)] if alone else DRAWING, tuple(members[name]))
        for index, name in enumerate(names)
    )


def pen(view: View, base: float, chains: Iterable[Chain]) -> float:
    """Line width on the page: `base`, or thinner where lines are crowded."""
    length = sum(_length_shown(chain, view) for chain in chains) * view.scale
    if length == 0.0:
        return base
    room = INK_SHARE * view.box.width * view.box.height / length
    return max(min(base, room), THINNEST)


def _length_shown(chain: Chain, view: View) -> float:
    """mm of a chain in view, about: moves whose ends have the window between them count whole,
    none for more than its diagonal."""
    low, high = np.array([view.x_range, view.y_range]).T
    begin, end = chain.points[:-1], chain.points[1:]
    near = (np.minimum(begin, end) <= high) & (np.maximum(begin, end) >= low)
    lengths = np.minimum(chain.lengths(), math.hypot(*(high - low)))
    return float(lengths[near.all(axis=1)].sum())


def travel(size_mm: tuple[float, float], view: View) -> str:
    """The table's travel as a light frame."""
    frame: Look = {"x": 0.0, "y": 0.0, "width": size_mm[0], "height": size_mm[1]}
    line: Look = {"fill": "none", "stroke": TRAVEL, "stroke-width": view.mm(2.0)}
    return element("g", {"id": "travel"}, element("rect", {**frame, **line}))


def body(chains: Sequence[Chain]) -> str:
    """A light fill of what is closed (even-odd, so that holes stay open)."""
    closed = [chain for chain in chains if chain.closed]
    if not closed or len(closed) > MOST_BODIES:
        return ""
    fill: Look = {"d": path_data(closed), "fill": BODY, "fill-rule": "evenodd"}
    return element("g", {"id": "body"}, element("path", fill))


def swept(chains: Sequence[Chain], tool_mm: float) -> str:
    """What the tool covers, at its true width."""
    round_pen: Look = {"stroke-linecap": "round", "stroke-linejoin": "round"}
    line: Look = {"fill": "none", "stroke": SWEPT, "stroke-width": tool_mm, **round_pen}
    return element("g", {"id": "swept", **line}, element("path", {"d": path_data(chains)}))


def reversal_look() -> Look:
    """Places where an axis turns: small violet discs."""
    return {"r": 3.4, "fill": REVERSAL, "stroke": PAPER, "stroke-width": 1.0}


def drawing(groups: Sequence[Group], view: View, width: float) -> str:
    """The lines of the drawing, a group for each layer."""
    layers = [
        element(
            "g",
            {"stroke": group.colour},
            title(group.name),
            element("path", {"d": path_data(group.chains)}),
        )
        for group in groups
    ]
    return element("g", {"id": "drawing", **_line(view, width)}, *layers)


def feeds(chains: Sequence[Chain], view: View, width: float, *, pale: bool) -> str:
    """Moves at a feed, solid; pale and thin below a predicted path."""
    colour = FEED_PALE if pale else FEED
    line = {**_line(view, width), "stroke": colour}
    return element("g", {"id": "feeds", **line}, element("path", {"d": path_data(chains)}))


def ramps(chains: Sequence[Chain], view: View, width: float) -> str:
    """Moves that sink or climb while they travel, in the colour of plunges."""
    line = {**_line(view, width), "stroke": PLUNGE}
    return element("g", {"id": "ramps", **line}, element("path", {"d": path_data(chains)}))


def rapids(chains: Sequence[Chain], view: View) -> str:
    """Rapids, thin and dashed."""
    dashes = f"{view.mm(7.0):.9g} {view.mm(5.0):.9g}"
    line: Look = {"fill": "none", "stroke": RAPID, "stroke-width": view.mm(1.4)}
    return element(
        "g",
        {"id": "rapids", **line, "stroke-dasharray": dashes},
        element("path", {"d": path_data(chains)}),
    )


def _line(view: View, width: float) -> Look:
    return {
        "fill": "none",
        "stroke-width": view.mm(width),
        "stroke-linecap": "round",
        "stroke-linejoin": "round",
    }


def dots(name: str, points: Iterable[tuple[float, float]], view: View, look: Look) -> str:
    """Round marks at places in mm: each is drawn, smaller where there are very many."""
    shown = [view.page(*point) for point in points if view.shows(*point)]
    if not shown:
        return ""
    shrink = max(math.sqrt(min(MARKS_OF_FULL_SIZE / len(shown), 1.0)), SMALLEST_MARK)
    line = {key: value for key, value in look.items() if key != "r"}
    if "stroke-width" in line:
        line["stroke-width"] = round(float(line["stroke-width"]) * shrink, 3)
    radius = number(float(look["r"]) * shrink)
    marks = [element("circle", {"cx": number(x), "cy": number(y), "r": radius}) for x, y in shown]
    return element("g", {"id": name, **line}, *marks)


def plunge_look() -> Look:
    """Plunges: orange discs with a white rim."""
    return {"r": 5.0, "fill": PLUNGE, "stroke": PAPER, "stroke-width": 1.6}


def start_look() -> Look:
    """Starts of contours: blue rings."""
    return {"r": 5.0, "fill": PAPER, "stroke": FEED, "stroke-width": 2.2}


def gap_look() -> Look:
    """Open ends: red rings."""
    return {"r": 8.0, "fill": "none", "stroke": GAP, "stroke-width": 2.4}


def point_look() -> Look:
    """Single points, such as centres of holes: small dark discs."""
    return {"r": 4.0, "fill": INK, "stroke": PAPER, "stroke-width": 1.2}


def doubt_look() -> Look:
    """Crossings and branches, where a contour is not clear: filled red discs."""
    return {"r": 5.0, "fill": GAP, "stroke": PAPER, "stroke-width": 1.2}


def arrows(chains: Sequence[Chain], view: View) -> str:
    """Few arrows, in the direction of travel: none on short chains, four at most on one."""
    lengths = [float(chain.lengths().sum()) * view.scale for chain in chains]
    long = [index for index, length in enumerate(lengths) if length >= SHORTEST_WITH_ARROW]
    data, taken = PathData(), list[tuple[float, float]]()
    for index in long[:: 1 + len(long) // MOST_WITH_ARROW]:
        wanted = min(1 + int(lengths[index] / ARROW_EVERY), MOST_ON_ONE)
        for place in range(wanted):
            point, heading = _along(chains[index], place / wanted, (place + 1) / wanted)
            at = view.page(*point)
            if view.shows(*point) and all(math.dist(at, one) >= ARROWS_APART for one in taken):
                _arrow(data, at, -heading)
                taken.append(at)
    if not data:
        return ""
    return element("g", {"id": "arrows"}, element("path", {"d": str(data), "fill": FEED}))


def _along(chain: Chain, low: float, high: float) -> tuple[tuple[float, float], float]:
    """Point and heading in the middle of the longest piece of a move between two shares of the
    chain's length: on a straight or a smooth arc, away from corners."""
    ends = np.cumsum(chain.lengths())
    begins = np.concatenate([[0.0], ends[:-1]])
    first = np.maximum(begins, low * ends[-1])
    last = np.minimum(ends, high * ends[-1])
    # Rounded, so that of two halves of a circle the first is taken everywhere.
    index = int(np.argmax(np.round((last - first) / ends[-1], TIE_DECIMALS)))
    middle = 0.5 * (first[index] + last[index])
    return chain.at(index, float((middle - begins[index]) / (ends[index] - begins[index])))


def _arrow(data: PathData, at: tuple[float, float], heading: float) -> None:
    """A slim arrowhead with its middle at `at`; heading in page directions (Y down)."""
    cos, sin = math.cos(heading), math.sin(heading)
    half = ARROW_LENGTH / 2.0
    corners = ((half, 0.0), (-half, ARROW_WIDTH), (-half / 2.0, 0.0), (-half, -ARROW_WIDTH))
    for index, (along, across) in enumerate(corners):
        x, y = at[0] + along * cos - across * sin, at[1] + along * sin + across * cos
        (data.line if index else data.move)(x, y)
    data.close()


def origin(at: tuple[float, float], size: float = 13.0) -> str:
    """Part zero: a cross with a ring."""
    data = PathData()
    for dx, dy in ((size, 0.0), (0.0, size)):
        data.move(at[0] - dx, at[1] - dy)
        data.line(at[0] + dx, at[1] + dy)
    line: Look = {"fill": "none", "stroke": INK, "stroke-width": 1.8}
    ring: Look = {"cx": number(at[0]), "cy": number(at[1]), "r": 0.5 * size}
    return element(
        "g",
        {"id": "part-zero", **line},
        element("circle", ring),
        element("path", {"d": str(data)}),
    )


# Numbers at places of the plot: the order of contours, the ranks of the worst places.
#
# Each stands beside its place, in the first of a few directions where it covers no other number;
# one that finds no room is left out.

CAP = 12.0
"""Height of the digits on the page."""

HALO = 5.0
"""Width of the ground's colour round the digits."""

AWAY = 9.0
CLEAR = 3.0
MOST = 400
"""No more numbers are tried."""

MOST_ALL = 100
"""Of more contours than this only every 2nd, 5th, 10th … has its number."""

DIRECTIONS = ((1.0, -1.0), (-1.0, -1.0), (1.0, 1.0), (-1.0, 1.0))
RING = 8.0


@dataclass(frozen=True)
class Number:
    """A number beside the place that it belongs to, both on the page; `box` is left, top, right,
    bottom."""

    name: str
    at: tuple[float, float]
    box: tuple[float, float, float, float]


def every(count: int) -> int:
    """How far apart the numbers of so many contours are."""
    return 1 if count <= MOST_ALL else round(round_step(count / MOST_ALL))


def placed(places: Sequence[tuple[float, float]], view: View, step: int = 1) -> list[Number]:
    """Numbers from 1 at places in mm, or the first and each that `step` divides, none over
    another."""
    found: list[Number] = []
    boxes: list[tuple[float, float, float, float]] = []
    indices = [k for k in range(len(places)) if k == 0 or (k + 1) % step == 0]
    for index in indices[:MOST]:
        place = places[index]
        if not view.shows(*place):
            continue
        name, at = str(index + 1), view.page(*place)
        for direction in DIRECTIONS:
            box = _beside(name, at, direction)
            if _inside(box, view) and not any(_touch(box, other) for other in boxes):
                found.append(Number(name, at, box))
                boxes.append(box)
                break
    return found


def _beside(
    name: str, at: tuple[float, float], direction: tuple[float, float]
) -> tuple[float, float, float, float]:
    wide = text.width(name, CAP)
    left = at[0] + AWAY if direction[0] > 0.0 else at[0] - AWAY - wide
    top = at[1] + 0.5 * AWAY if direction[1] > 0.0 else at[1] - 0.5 * AWAY - CAP
    return left, top, left + wide, top + CAP


def _inside(box: tuple[float, float, float, float], view: View) -> bool:
    plot = view.box
    return (
        box[0] > plot.left and box[1] > plot.top and box[2] < plot.right and box[3] < plot.bottom
    )


def _touch(a: tuple[float, float, float, float], b: tuple[float, float, float, float]) -> bool:
    beside = a[2] + CLEAR <= b[0] or b[2] + CLEAR <= a[0]
    return not (beside or a[3] + CLEAR <= b[1] or b[3] + CLEAR <= a[1])


def order(numbers: Sequence[Number]) -> str:
    """The order of contours."""
    return _group("order", [_written(one, INK) for one in numbers])


def worst(numbers: Sequence[Number]) -> str:
    """The ranks of the worst places, each with a ring at its place."""
    ring: Look = {"fill": "none", "stroke": GAP, "stroke-width": 2.0}
    parts = [
        element("circle", {"cx": number(one.at[0]), "cy": number(one.at[1]), "r": RING, **ring})
        for one in numbers
    ]
    return _group("worst", [*parts, *(_written(one, GAP) for one in numbers)])


def worst_look() -> Look:
    """The ring, for the legend."""
    return {"r": RING, "fill": "none", "stroke": GAP, "stroke-width": 2.0}


def _group(name: str, parts: list[str]) -> str:
    return element("g", {"id": name}, *parts) if parts else ""


def _written(one: Number, colour: str) -> str:
    style, at = Style(CAP, colour), (one.box[0], one.box[3])
    halo: Look = {**text.stroke_of(style), "stroke": PLOT, "stroke-width": HALO}
    below = element("path", {"d": text.strokes(one.name, at, style), **halo})
    return below + "\n" + text.label(one.name, at, style)
