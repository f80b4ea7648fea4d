"""Reads a picture back the slow way: every path of an SVG as points, arcs by the formulas of the
SVG specification (implementation notes, "Conversion from endpoint to center parameterization")."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from xml.etree.ElementTree import Element

from defusedxml.ElementTree import fromstring

SVG = "{http://www.w3.org/2000/svg}"
_COMMAND = re.compile(r"([MLAZ])([^MLAZ]*)")

Point = tuple[float, float]


@dataclass(frozen=True)
class Arc:
    """An arc of a path, by its centre; a positive sweep turns from +X towards +Y."""

    begin: Point
    end: Point
    centre: Point
    radius: float
    sweep: float


@dataclass(frozen=True)
class Line:
    """A straight piece of a path."""

    begin: Point
    end: Point


def parse(svg: str) -> Element:
    """The root element; an exception when the text is no well-formed XML."""
    root: Element = fromstring(svg)
    return root


def group(root: Element, name: str) -> Element | None:
    """The group with this id."""
    return next((g for g in root.iter(f"{SVG}g") if g.get("id") == name), None)


def paths(element: Element) -> list[list[Arc | Line]]:
    """The pieces of each path below an element."""
    return [pieces(path.attrib["d"]) for path in element.iter(f"{SVG}path")]


def pieces(data: str) -> list[Arc | Line]:
    """Path data with absolute M, L, A and Z as arcs and lines."""
    found: list[Arc | Line] = []
    at = first = (0.0, 0.0)
    assert _COMMAND.sub("", data) == "", data
    for command, text in _COMMAND.findall(data):
        numbers = [float(part) for part in text.split()]
        if command == "M":
            at = first = (numbers[0], numbers[1])
        elif command == "L":
            found.append(Line(at, (numbers[0], numbers[1])))
            at = (numbers[0], numbers[1])
        elif command == "A":
            assert numbers[0] == numbers[1], "an ellipse"
            to = (numbers[5], numbers[6])
            found.append(_arc(at, to, numbers[0], bool(numbers[3]), bool(numbers[4])))
            at = to
        else:
            if at != first:
                found.append(Line(at, first))
            at = first
    return found


def _arc(begin: Point, end: Point, radius: float, large: bool, growing: bool) -> Arc:
    """F.6.5 with rx = ry and no rotation; F.6.6 for radii that are too small."""
    x, y = (begin[0] - end[0]) / 2.0, (begin[1] - end[1]) / 2.0
    radius = max(radius, math.hypot(x, y))
    square = x * x + y * y
    share = math.sqrt(max(radius * radius - square, 0.0) / square)
    share = -share if large == growing else share
    cx, cy = share * y, -share * x
    centre = (cx + (begin[0] + end[0]) / 2.0, cy + (begin[1] + end[1]) / 2.0)
    from_ = math.atan2(begin[1] - centre[1], begin[0] - centre[0])
    to = math.atan2(end[1] - centre[1], end[0] - centre[0])
    sweep = (to - from_) % (2.0 * math.pi) if growing else -((from_ - to) % (2.0 * math.pi))
    return Arc(begin, end, centre, radius, sweep)


def box(points: list[Point]) -> tuple[float, float, float, float]:
    """left, top, right, bottom."""
    return (
        min(x for x, _ in points),
        min(y for _, y in points),
        max(x for x, _ in points),
        max(y for _, y in points),
    )


def label_boxes(root: Element) -> dict[tuple[str, int], tuple[float, float, float, float]]:
    """The box of each label's strokes, by (text, how many of that text came before)."""
    found: dict[tuple[str, int], tuple[float, float, float, float]] = {}
    for g in root.iter(f"{SVG}g"):
        text = g.get("aria-label")
        strokes = [piece for path in paths(g) for piece in path] if text is not None else []
        if text is None or not strokes:
            continue
        points = [point for piece in strokes for point in (piece.begin, piece.end)]
        found[text, sum(key[0] == text for key in found)] = box(points)
    return found
