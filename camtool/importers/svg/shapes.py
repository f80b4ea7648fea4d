"""The basic shapes of SVG as subpaths, in user units.

Source: Scalable Vector Graphics 1.1, chapter 9 (basic shapes); 4.2 for lengths.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from camtool.errors import DrawingError
from camtool.importers.options import ReadOptions
from camtool.importers.svg.affine import NUMBER, in_bounds, parse_numbers
from camtool.importers.svg.path import parse_path
from camtool.importers.svg.segments import Arc, Lines, Segment, Subpath, arc_between
from camtool.importers.svg.style import FONT_PX
from camtool.importers.svg.tree import Node
from camtool.units import MM_PER_UNIT

SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")

_LENGTH = re.compile(rf"({NUMBER.pattern})\s*([A-Za-z]*|%)", re.ASCII)
_POINTS = re.compile(rf"[ \t\r\n\f,]*+(?>(?:{NUMBER.pattern}[ \t\r\n\f,]*+)*)", re.ASCII)
_CSS_UNITS = ("px", "pt", "pc", "mm", "cm", "in", "q")
FONT_UNITS = {"em": 1.0, "ex": 0.5}
"""Units of the font size."""


@dataclass(frozen=True)
class Lengths:
    """Turns lengths into user units: `viewport` (width, height) is what % are of, where known;
    a user unit is a px; em and ex are of `font_px`, ex half of it."""

    options: ReadOptions
    viewport: tuple[float, float] | None
    font_px: float = FONT_PX

    def along(self, node: Node, name: str, axis: str, default: float = 0.0) -> float:
        """The attribute `name` in user units; `axis` x, y or d (diagonal) says what % are of."""
        text = node.get(name)
        if not text or text == "auto":
            return default
        return self.length(text, axis, name)

    def length(self, text: str, axis: str, name: str = "length") -> float:
        """A length in user units; DrawingError naming it."""
        # Most lengths are bare numbers.
        if NUMBER.fullmatch(text):
            return in_bounds(float(text), name)
        value, unit = split_length(text, name)
        if not unit or unit == "px":
            return value
        if unit == "%":
            return in_bounds(value / 100.0 * self._whole(axis, name), name)
        if unit in FONT_UNITS:
            return in_bounds(value * FONT_UNITS[unit] * self.font_px, name)
        return in_bounds(value * MM_PER_UNIT[unit] / self.options.mm_per("px"), name)

    def size(self, node: Node, name: str, axis: str, default: float = 0.0) -> float:
        """Like `along`, for what cannot be negative."""
        value = self.along(node, name, axis, default)
        if value < 0.0:
            raise DrawingError(f"{name} is negative")
        return value

    def _whole(self, axis: str, name: str) -> float:
        if self.viewport is None:
            raise DrawingError(
                f"{name} is in %, but the page has no size", mend="give the svg a viewBox"
            )
        width, height = self.viewport
        # The standard's length for what is neither along x nor along y.
        diagonal = math.hypot(width, height) / math.sqrt(2.0)
        return {"x": width, "y": height}.get(axis, diagonal)


def split_length(text: str, name: str) -> tuple[float, str]:
    """Number and unit ("" when bare, else lower case or %); DrawingError for what is neither."""
    match = _LENGTH.fullmatch(text)
    if match is None:
        raise DrawingError(f"{name} {text[:24]!r} is no length")
    unit = match[2].lower()
    if unit and unit != "%" and unit not in _CSS_UNITS and unit not in FONT_UNITS:
        known = ", ".join((*_CSS_UNITS, *FONT_UNITS))
        raise DrawingError(f"{name} {text[:24]!r} has the unit {unit!r}", mend=f"use {known}")
    return in_bounds(float(match[1]), name), unit


def subpaths(node: Node, lengths: Lengths) -> tuple[list[Subpath], str]:
    """What the shape draws, in user units, none when it draws nothing; and the fault in its data
    up to which it is drawn (""). DrawingError when it cannot be drawn at all."""
    match node.tag:
        case "path":
            data = node.get("d")
            return ([], "") if data in ("", "none") else parse_path(data)
        case "polyline" | "polygon":
            return _corners(node)
        case "rect":
            return _rect(node, lengths), ""
        case "circle":
            radius = lengths.size(node, "r", "d")
            return _ellipse(node, lengths, radius, radius), ""
        case "ellipse":
            rx, ry = _radii(node, lengths)
            return _ellipse(node, lengths, rx, ry), ""
        case "line":
            return _line(node, lengths), ""
    raise ValueError(f"{node.tag} is no shape")


def _line(node: Node, lengths: Lengths) -> list[Subpath]:
    x1, y1 = lengths.along(node, "x1", "x"), lengths.along(node, "y1", "y")
    x2, y2 = lengths.along(node, "x2", "x"), lengths.along(node, "y2", "y")
    return [Subpath(np.array([x1, y1]), (Lines(np.array([[x2, y2]])),), False)]


def _corners(node: Node) -> tuple[list[Subpath], str]:
    text = node.get("points")
    match = _POINTS.match(text)
    end = match.end() if match else 0
    numbers = parse_numbers(text[:end], "points")
    fault = ""
    if end < len(text):
        fault = f"points hold {text[end : end + 12]!r}, which does not belong there"
    elif len(numbers) % 2:
        fault = f"points hold {len(numbers)} numbers: one coordinate is missing"
    points = np.array(numbers[: len(numbers) // 2 * 2]).reshape(-1, 2)
    if len(points) < 2:
        return [], fault
    return [Subpath(points[0], (Lines(points[1:]),), node.tag == "polygon")], fault


def _radii(node: Node, lengths: Lengths) -> tuple[float, float]:
    """rx and ry; the one that is left out is as the other."""
    rx = lengths.size(node, "rx", "x", math.nan)
    ry = lengths.size(node, "ry", "y", math.nan)
    if math.isnan(rx):
        rx = 0.0 if math.isnan(ry) else ry
    return rx, rx if math.isnan(ry) else ry


def _ellipse(node: Node, lengths: Lengths, rx: float, ry: float) -> list[Subpath]:
    if rx == 0.0 or ry == 0.0:
        return []
    centre = np.array([lengths.along(node, "cx", "x"), lengths.along(node, "cy", "y")])
    u, v = np.array([rx, 0.0]), np.array([0.0, ry])
    start = centre + u
    return [Subpath(start, (Arc(centre, u, v, 0.0, 2.0 * math.pi, start),), True)]


def _rect(node: Node, lengths: Lengths) -> list[Subpath]:
    """Along the sides and round the corners, in the standard's direction."""
    x, y = lengths.along(node, "x", "x"), lengths.along(node, "y", "y")
    width, height = lengths.size(node, "width", "x"), lengths.size(node, "height", "y")
    if width == 0.0 or height == 0.0:
        return []
    rx, ry = _radii(node, lengths)
    rx, ry = min(rx, width / 2.0), min(ry, height / 2.0)
    right, bottom = x + width, y + height
    if rx == 0.0 or ry == 0.0:
        corners = np.array([[x, y], [right, y], [right, bottom], [x, bottom]])
        return [Subpath(corners[0], (Lines(corners[1:]),), True)]
    # Each corner: where it is entered and left.
    rounds = (
        (complex(right - rx, y), complex(right, y + ry)),
        (complex(right, bottom - ry), complex(right - rx, bottom)),
        (complex(x + rx, bottom), complex(x, bottom - ry)),
        (complex(x, y + ry), complex(x + rx, y)),
    )
    here = rounds[-1][1]
    start = np.array([here.real, here.imag])
    segments: list[Segment] = []
    for enter, leave in rounds:
        if enter != here:
            segments.append(Lines(np.array([[enter.real, enter.imag]])))
        segments.append(arc_between(enter, leave, complex(rx, ry), 0.0, 1))
        here = leave
    return [Subpath(start, tuple(segments), True)]
