"""Path data and basic shapes of SVG to subpaths.

A subpath is a start and segments in user units, Y down as in the file:

    Lines        corners after the start, (n, 2)
    Bezier       control points after the start: (2, 2) or (3, 2)
    Arc          centre + u·cos t + v·sin t, t from `begin` over the signed `sweep`, to `end`

Source: Scalable Vector Graphics 1.1, appendix F.6 (elliptical arcs)."""

from __future__ import annotations

import math
import re
from itertools import accumulate

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.importers.options import ReadOptions
from camtool.importers.svg.style import FONT_PX
from camtool.importers.svg.transform import MAX_NUMBER, NUMBER, in_bounds
from camtool.importers.svg.tree import Node
from camtool.units import MM_PER_UNIT


class SvgLines(Struct, frozen=True, eq=False):
    """Straight segments through `points` (n, 2), in user units."""

    points: Floats


class Bezier(Struct, frozen=True, eq=False):
    """A quadratic (2, 2) or cubic (3, 2) Bézier: `control` without its first point."""

    control: Floats


class Arc(Struct, frozen=True, eq=False):
    """An arc of an ellipse, its half axes `u`, `v` (2,), angles in rad, `end` (2,) exact."""

    centre: Floats
    u: Floats
    v: Floats
    begin: float
    sweep: float
    end: Floats


Segment = SvgLines | Bezier | Arc


class Subpath(Struct, frozen=True, eq=False):
    """A subpath: its start (2,) and the segments that follow; if `closed`, a straight line leads
    back, unless it ends at its start."""

    start: Floats
    segments: tuple[Segment, ...]
    closed: bool


def arc_between(start: complex, end: complex, radii: complex, turn: float, flags: int) -> Arc:
    """Return the elliptical arc of path data from `start` to `end`, which differ.

    `radii` = rx + i·ry; `turn`: the angle of the ellipse's x axis, rad; `flags`: 1 the sweep flag,
    plus 2 the large-arc flag. Radii that are too short are enlarged until the ends can be reached.
    DrawingError when the radii are so unlike the chord that the arithmetic fails.

    In the frame where the ellipse is the unit circle, with the chord's half h = (p1 − p0)/2, |h| =
    sin(half the small sweep), the centre lies at the chord's middle ± i·h/|h|·√(1 − |h|²)."""
    rx, ry = abs(radii.real), abs(radii.imag)
    axis = complex(math.cos(turn), math.sin(turn))

    def to_unit(z: complex) -> complex:
        w = z * axis.conjugate()
        return complex(w.real / rx, w.imag / ry)

    middle, half = to_unit((start + end) / 2.0), to_unit((end - start) / 2.0)
    size = math.hypot(half.real, half.imag)
    if not 1.0 / MAX_NUMBER**2 < size < MAX_NUMBER:
        raise DrawingError(f"an arc of radii {rx:g} and {ry:g} has no shape there")
    grow = max(size, 1.0)
    rise = math.sqrt((1.0 - size) * (1.0 + size)) if size < 1.0 else 0.0
    positive, large = bool(flags & 1), bool(flags & 2)
    side = 1.0 if positive != large else -1.0
    offset = side * rise * half * 1j / size
    smaller_angle = 2.0 * math.atan2(min(size, 1.0), rise)
    sweep = (2.0 * math.pi - smaller_angle) if large else smaller_angle
    from_centre = -half / grow - offset
    centre = (middle + offset) if size < 1.0 else middle
    centre_point = complex(centre.real * rx, centre.imag * ry) * axis
    u, v = rx * grow * axis, 1j * ry * grow * axis
    return Arc(
        centre=_pair(centre_point),
        u=_pair(u),
        v=_pair(v),
        begin=math.atan2(from_centre.imag, from_centre.real),
        sweep=sweep if positive else -sweep,
        end=_pair(end),
    )


def _pair(z: complex) -> Floats:
    return np.array([z.real, z.imag])


# Path data.
#
# The words of path data are checked here to the letter: what stands before the first wrong sign is
# drawn, as the standard wants it, and the fault is reported.
#
# Source: Scalable Vector Graphics 1.1, chapter 8 (paths; 8.3.6 and 8.3.7 for smooth curves, 8.3.9
# for their grammar) and appendix F.2 (drawing up to an error).

MAX_PATH_CHARACTERS = 50_000_000
"""Longest path data, or list of points, of one element; longer ones would take more than some 3 GB
for their numbers."""

_COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])")
_GAP = r"[ \t\r\n\f,]*+"
_NUM = NUMBER.pattern
_NUMBERS = re.compile(rf"{_GAP}(?>(?:{_NUM}{_GAP})*)", re.ASCII)
_ARC = re.compile(
    rf"({_NUM}){_GAP}({_NUM}){_GAP}({_NUM}){_GAP}([01]){_GAP}([01]){_GAP}({_NUM}){_GAP}({_NUM}){_GAP}",
    re.ASCII,
)
_START = re.compile(_GAP)
_COUNTS = {"M": 2, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7, "Z": 0}


def parse_path(data: str) -> tuple[list[Subpath], str]:
    """Return the subpaths of path data that draw something, up to the first fault, and that fault,
    or "".

    DrawingError for data that cannot be drawn at all: too many or too large, or arcs without a
    shape."""
    if len(data) > MAX_PATH_CHARACTERS:
        raise DrawingError(f"path data have more than {MAX_PATH_CHARACTERS} characters")
    pen = _Pen()
    fault = _drawn(data, pen)
    pen.lift(closed=False)
    return pen.subpaths, fault


def _drawn(data: str, pen: _Pen) -> str:
    """Draw path data with the pen, command by command, up to the first fault; return that fault,
    or ""."""
    lead, *words = _COMMAND.split(data)
    if lead.strip() or (words and words[0] not in "Mm"):
        begin = lead.strip() or words[0]
        return f"path data begin with {begin[:12]!r}, wanted M or m"
    offset = len(lead)
    for letter, text in zip(words[::2], words[1::2], strict=True):
        kind = letter.upper()
        name = f"path data at sign {offset + 1}: {letter!r}"
        if kind == "A":
            fault = _arcs(pen, letter.islower(), text)
        else:
            match = _NUMBERS.match(text)
            end = match.end() if match else 0
            numbers = NUMBER.findall(text, 0, end)
            count = _COUNTS[kind]
            used_count = len(numbers) // count * count if count else 0
            fault = "" if end == len(text) else _odd(text[end:])
            if not fault and (used_count != len(numbers) or (count and not numbers)):
                fault = f"has {len(numbers)} numbers, wanted {count or 'none'}"
            pen.command(letter, numbers[:used_count])
        if fault:
            return f"{name} {fault}"
        offset += 1 + len(text)
    return ""


def _arcs(pen: _Pen, relative: bool, text: str) -> str:
    """Draw the arcs of an "A" command with the pen; return its fault, or "".

    Flags need no separator after them ("a1 1 0 011 2")."""
    start = _START.match(text)
    offset = start.end() if start else 0
    drawn = 0
    while match := _ARC.match(text, offset):
        rx, ry, turn, large, positive, x, y = (float(number) for number in match.groups())
        pen.arc(complex(rx, ry), turn, int(positive + 2.0 * large), complex(x, y), relative)
        offset = match.end()
        drawn += 1
    if offset < len(text):
        return _odd(text[offset:])
    return "" if drawn else "has no numbers, wanted 7"


def _odd(text: str) -> str:
    return f"holds {text.strip()[:12]!r}, which does not belong there"


class _Pen(Struct):
    """The pen that draws path data: its place, the open subpath, and the finished subpaths.

    The open subpath is its segments, and after them the corners of straight lines that are not yet
    among them."""

    place: complex = 0j
    start: complex = 0j
    corners: list[complex] = field(default_factory=list)
    segments: list[Segment] = field(default_factory=list)
    subpaths: list[Subpath] = field(default_factory=list)

    def command(self, letter: str, words: list[str]) -> None:
        """Draw any command but A, given complete sets of numbers; "M" without numbers draws
        nothing."""
        kind, relative = letter.upper(), letter.islower()
        if kind == "Z":
            self.lift(closed=True)
        elif words and kind in "CSQT":
            self._curve(letter, words)
        elif words:
            numbers = _floats(words)
            if kind == "M":
                self.lift(closed=False)
                self.start = self.place = _bounded(
                    complex(numbers[0], numbers[1]) + (self.place if relative else 0j)
                )
                numbers = numbers[2:]
            if numbers:
                self._straight(kind, relative, numbers)

    def arc(
        self, radii: complex, turn: float, flags: int, end_point: complex, relative: bool
    ) -> None:
        """Add an arc; without a radius it is a line, and nothing if it ends at its start."""
        end = _bounded(end_point + self.place if relative else end_point)
        if not max(abs(radii.real), abs(radii.imag), abs(turn)) <= MAX_NUMBER:
            raise DrawingError("path data have an arc that is too large")
        if radii.real == 0.0 or radii.imag == 0.0 or end == self.place:
            self._to([end])
            return
        angle = math.radians(math.fmod(turn, 360.0))
        self._flush()
        self.segments.append(arc_between(self.place, end, radii, angle, flags))
        self.place = end

    def lift(self, *, closed: bool) -> None:
        """End the open subpath, if there is one; if `closed`, the pen returns to its start."""
        self._flush()
        if self.segments:
            self.subpaths.append(
                Subpath(np.array([self.start.real, self.start.imag]), tuple(self.segments), closed)
            )
            self.segments = []
        if closed:
            self.place = self.start
        else:
            self.start = self.place

    def _straight(self, kind: str, relative: bool, n: list[float]) -> None:
        """Draw the lines of L, H or V, or of the coordinate pairs after the first one of M."""
        if kind == "H":
            other_axis = self.place.imag if not relative else 0.0
            ends = [complex(x, other_axis) for x in n]
        elif kind == "V":
            other_axis = self.place.real if not relative else 0.0
            ends = [complex(other_axis, y) for y in n]
        else:
            ends = list(map(complex, n[::2], n[1::2]))
        if relative:
            ends = list(accumulate(ends, initial=self.place))[1:]
        self._to(ends)

    def _to(self, ends: list[complex]) -> None:
        self.corners += ends
        self.place = _bounded(ends[-1])

    def _curve(self, letter: str, words: list[str]) -> None:
        """Draw the curves of C, S, Q or T.

        The first control point of a smooth curve (S, T) is the last control point of the curve
        before it, reflected in the point between them; without a curve of the same degree before
        it, it is that point itself."""
        kind, relative = letter.upper(), letter.islower()
        numbers = _floats(words)
        points = list(map(complex, numbers[::2], numbers[1::2]))
        each = _COUNTS[kind] // 2
        degree = 3 if kind in "CS" else 2
        self._flush()
        last = self.segments[-1] if self.segments else None
        before = self.place
        if isinstance(last, Bezier) and len(last.control) == degree:
            before = complex(*last.control[-2])
        controls: list[complex] = []
        for index in range(0, len(points), each):
            control = points[index : index + each]
            if relative:
                control = [self.place + point for point in control]
            if kind in "ST":
                control.insert(0, self.place + self.place - before)
            controls += control
            before, self.place = control[-2:]
        self.segments += map(Bezier, _pairs(controls).reshape(-1, degree, 2))
        self.place = _bounded(self.place)

    def _flush(self) -> None:
        if self.corners:
            self.segments.append(SvgLines(_pairs(self.corners)))
            self.corners = []


def _floats(words: list[str]) -> list[float]:
    numbers = list(map(float, words))
    if not (max(numbers) <= MAX_NUMBER and min(numbers) >= -MAX_NUMBER):
        raise DrawingError(f"path data have {max(numbers, key=abs):g}, which is too large")
    return numbers


def _bounded(place: complex) -> complex:
    """Return the place unchanged; DrawingError if it is too far away, as sums of relative steps
    may be."""
    if not (abs(place.real) <= MAX_NUMBER and abs(place.imag) <= MAX_NUMBER):
        raise DrawingError("path data lead to a place that is too far away")
    return place


def _pairs(points: list[complex]) -> Floats:
    return np.array(points, dtype=np.complex128).view(np.float64).reshape(-1, 2)


# The basic shapes, in user units.
#
# Source: Scalable Vector Graphics 1.1, chapter 9 (basic shapes); 4.2 for lengths.

SHAPES = ("path", "rect", "circle", "ellipse", "line", "polyline", "polygon")

_LENGTH = re.compile(rf"({NUMBER.pattern})\s*([A-Za-z]*|%)", re.ASCII)
_POINTS = re.compile(rf"[ \t\r\n\f,]*+(?>(?:{NUMBER.pattern}[ \t\r\n\f,]*+)*)", re.ASCII)
_CSS_UNITS = ("px", "pt", "pc", "mm", "cm", "in", "q")
FONT_UNITS = {"em": 1.0, "ex": 0.5}


class Lengths(Struct, frozen=True):
    """Converts lengths to user units.

    A user unit is a px; percentages are of the `viewport` (width, height), if it is known; em is
    `font_px`, ex half of it."""

    options: ReadOptions
    viewport: tuple[float, float] | None
    font_px: float = FONT_PX

    def along(self, node: Node, name: str, axis: str, default: float = 0.0) -> float:
        """Return the length in the attribute `name`, in user units; a percentage is of the
        viewport's width, height or diagonal for the axis x, y or d."""
        text = node.get(name)
        if not text or text == "auto":
            return default
        return self.length(text, axis, name)

    def length(self, text: str, axis: str, name: str = "length") -> float:
        """Return a length in user units; DrawingError, which names it, for any other text."""
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
        """Return the length in an attribute as `along` does; DrawingError if it is negative."""
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
        # The standard's reference length for lengths along neither axis.
        diagonal = math.hypot(width, height) / math.sqrt(2.0)
        return {"x": width, "y": height}.get(axis, diagonal)


def split_length(text: str, name: str) -> tuple[float, str]:
    """Return the number and the unit of a length, "" if it has none, else lower case or "%";
    DrawingError for any other text."""
    match = _LENGTH.fullmatch(text)
    if match is None:
        raise DrawingError(f"{name} {text[:24]!r} is no length")
    unit = match[2].lower()
    if unit and unit != "%" and unit not in _CSS_UNITS and unit not in FONT_UNITS:
        units = ", ".join((*_CSS_UNITS, *FONT_UNITS))
        raise DrawingError(f"{name} {text[:24]!r} has the unit {unit!r}", mend=f"use {units}")
    return in_bounds(float(match[1]), name), unit


def subpaths(node: Node, lengths: Lengths) -> tuple[list[Subpath], str]:
    """Return the subpaths of a shape in user units, [] if it draws nothing, and the fault in its
    data that ends them, or "".

    DrawingError if it cannot be drawn at all."""
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
    return [Subpath(np.array([x1, y1]), (SvgLines(np.array([[x2, y2]])),), False)]


def _corners(node: Node) -> tuple[list[Subpath], str]:
    text = node.get("points")
    if len(text) > MAX_PATH_CHARACTERS:
        raise DrawingError(f"points have more than {MAX_PATH_CHARACTERS} characters")
    match = _POINTS.match(text)
    end = match.end() if match else 0
    numbers = np.array(list(map(float, NUMBER.findall(text, 0, end))))
    if len(numbers):
        in_bounds(float(numbers[np.abs(numbers).argmax()]), "points")
    fault = ""
    if end < len(text):
        fault = f"points hold {text[end : end + 12]!r}, which does not belong there"
    elif len(numbers) % 2:
        fault = f"points hold {len(numbers)} numbers: one coordinate is missing"
    points = numbers[: len(numbers) // 2 * 2].reshape(-1, 2)
    if len(points) < 2:
        return [], fault
    return [Subpath(points[0], (SvgLines(points[1:]),), node.tag == "polygon")], fault


def _radii(node: Node, lengths: Lengths) -> tuple[float, float]:
    """Return rx and ry of an ellipse or of rounded corners; where one is missing it equals the
    other."""
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
    """Return the closed path of a rectangle with its rounded corners, in the direction that the
    standard prescribes."""
    x, y = lengths.along(node, "x", "x"), lengths.along(node, "y", "y")
    width, height = lengths.size(node, "width", "x"), lengths.size(node, "height", "y")
    if width == 0.0 or height == 0.0:
        return []
    rx, ry = _radii(node, lengths)
    rx, ry = min(rx, width / 2.0), min(ry, height / 2.0)
    right, bottom = x + width, y + height
    if rx == 0.0 or ry == 0.0:
        corners = np.array([[x, y], [right, y], [right, bottom], [x, bottom]])
        return [Subpath(corners[0], (SvgLines(corners[1:]),), True)]
    # Each corner: where it is entered and left.
    rounds = (
        (complex(right - rx, y), complex(right, y + ry)),
        (complex(right, bottom - ry), complex(right - rx, bottom)),
        (complex(x + rx, bottom), complex(x, bottom - ry)),
        (complex(x, y + ry), complex(x + rx, y)),
    )
    corner = rounds[-1][1]
    start = np.array([corner.real, corner.imag])
    segments: list[Segment] = []
    for enter, leave in rounds:
        if enter != corner:
            segments.append(SvgLines(np.array([[enter.real, enter.imag]])))
        segments.append(arc_between(enter, leave, complex(rx, ry), 0.0, 1))
        corner = leave
    return [Subpath(start, tuple(segments), True)]
