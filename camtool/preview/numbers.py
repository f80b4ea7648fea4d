"""Numbers at places of the plot: the order of contours, the ranks of the worst places.

Each stands beside its place, in the first of a few directions where it covers no other number; one
that finds no room is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from camtool.preview import text
from camtool.preview.colours import GAP, INK, PLOT
from camtool.preview.svg import Look, element, number
from camtool.preview.text import Style
from camtool.preview.view import View, round_step

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
