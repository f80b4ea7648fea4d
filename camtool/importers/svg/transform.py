"""Numbers of SVG attributes, affine maps and transform lists.

    ( x' )   ( a c ) ( x )   ( e )
    ( y' ) = ( b d ) ( y ) + ( f )

Source: Scalable Vector Graphics 1.1, 7.7 and 7.8 (viewBox and preserveAspectRatio)."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import DrawingError

MAX_NUMBER = 1e12
"""Larger numbers are refused: their products could overflow."""

NUMBER = re.compile(r"(?>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)", re.ASCII)

BETWEEN = " \t\r\n\f,"
_ALIGN = re.compile(r"(?:defer\s+)?(none|x(Min|Mid|Max)Y(Min|Mid|Max))(?:\s+(meet|slice))?")
_SHARE = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}


class Affine(Struct, frozen=True):
    """An affine map of the plane; `outer @ inner` applies `inner` first."""

    a: float = 1.0
    b: float = 0.0
    c: float = 0.0
    d: float = 1.0
    e: float = 0.0
    f: float = 0.0

    def __matmul__(self, inner: Affine) -> Affine:
        return Affine(
            self.a * inner.a + self.c * inner.b,
            self.b * inner.a + self.d * inner.b,
            self.a * inner.c + self.c * inner.d,
            self.b * inner.c + self.d * inner.d,
            self.a * inner.e + self.c * inner.f + self.e,
            self.b * inner.e + self.d * inner.f + self.f,
        )

    @property
    def determinant(self) -> float:
        """The factor by which areas grow; negative if the map mirrors."""
        return self.a * self.d - self.b * self.c

    def points(self, points: Floats) -> Floats:
        """Return the images of positions (n, 2)."""
        x, y = points[:, 0], points[:, 1]
        mapped = np.empty((len(points), 2))
        mapped[:, 0] = self.a * x + self.c * y + self.e
        mapped[:, 1] = self.b * x + self.d * y + self.f
        return mapped

    def vectors(self, vectors: Floats) -> Floats:
        """Return the images of directions (n, 2), to which the shift does not apply."""
        return np.asarray(vectors @ np.array([[self.a, self.b], [self.c, self.d]]))

    @property
    def inverse(self) -> Affine:
        """The inverse map; the determinant must not be 0."""
        size = self.determinant
        a, b, c, d = self.d / size, -self.b / size, -self.c / size, self.a / size
        return Affine(a, b, c, d, -(a * self.e + c * self.f), -(b * self.e + d * self.f))

    def checked(self) -> Affine:
        """Return this map unchanged; DrawingError when a number in it is too large."""
        if not all(abs(v) <= MAX_NUMBER for v in (self.a, self.b, self.c, self.d, self.e, self.f)):
            raise DrawingError("its transforms multiply to numbers that are too large")
        return self


def translation(x: float, y: float) -> Affine:
    """Return the map that shifts by (x, y)."""
    return Affine(e=x, f=y)


def scaling(x: float, y: float) -> Affine:
    """Return the map that scales by x and y about the origin."""
    return Affine(a=x, d=y)


def in_bounds(value: float, name: str) -> float:
    """Return the value unchanged; DrawingError, which names it, when it is too large."""
    if not abs(value) <= MAX_NUMBER:
        raise DrawingError(f"{name} {value:g} is too large")
    return value


def parse_numbers(text: str, name: str) -> list[float]:
    """Parse numbers separated by blanks or commas; DrawingError quoting what is no number."""
    remainder = NUMBER.sub(" ", text).strip(BETWEEN)
    remainder = remainder.replace(",", " ").strip()
    if remainder:
        raise DrawingError(f"{name} holds {shortened(remainder)}, which is no number")
    values = [float(number) for number in NUMBER.findall(text)]
    furthest = max(values, key=abs, default=0.0)
    in_bounds(furthest, name)
    return values


class SvgBox(Struct, frozen=True):
    """A rectangle: its corner with the least x and y, and its size."""

    x: float
    y: float
    width: float
    height: float


def parse_view_box(text: str) -> SvgBox | None:
    """Parse the attribute viewBox; None when it is missing. DrawingError when it is no rectangle
    with an area."""
    if not text:
        return None
    numbers = parse_numbers(text, "viewBox")
    if len(numbers) != 4:
        raise DrawingError(f"viewBox holds {len(numbers)} numbers, wanted 4")
    box = SvgBox(*numbers)
    if box.width <= 0.0 or box.height <= 0.0:
        raise DrawingError(f"viewBox is {box.width:g} x {box.height:g}: it shows nothing")
    return box


def view_box_map(box: SvgBox, onto: SvgBox, align: str) -> Affine:
    """Return the map from the viewBox `box` to the viewport `onto`, according to the attribute
    preserveAspectRatio, `align`.

    meet: scale = min(sx, sy), all is visible; slice: the greater one, all is covered. What is left
    over, viewport − scale · box, is shared out by Min (0), Mid (½), Max (1)."""
    match = _ALIGN.fullmatch(align or "xMidYMid")
    if match is None:
        raise DrawingError(f"preserveAspectRatio {shortened(align)} is not known")
    sx, sy = onto.width / box.width, onto.height / box.height
    x, y = onto.x, onto.y
    if match[1] != "none":
        sx = sy = max(sx, sy) if match[4] == "slice" else min(sx, sy)
        x += _SHARE[match[2]] * (onto.width - sx * box.width)
        y += _SHARE[match[3]] * (onto.height - sy * box.height)
    return Affine(sx, 0.0, 0.0, sy, x - sx * box.x, y - sy * box.y).checked()


def shortened(text: str) -> str:
    """Return the beginning of a text, in quotes, for messages."""
    return repr(text if len(text) <= 24 else text[:21] + "...")


# Transform lists: of the attribute `transform`, and the plain ones of the CSS property.
#
# Source: Scalable Vector Graphics 1.1, 7.6 (the transform attribute); CSS Transforms 1, chapters 7
# (transform-origin) and 13 (functions).

_FUNCTION = re.compile(r"[\s,]*+([A-Za-z]+)\s*\(([^()]*)\)\s*")
_MEASURE = re.compile(rf"({NUMBER.pattern})([A-Za-z%]*)", re.ASCII)
_DEGREES = {"": 1.0, "deg": 1.0, "rad": 180.0 / math.pi, "grad": 0.9, "turn": 360.0}
_LENGTHWISE = ("translate", "translatex", "translatey")
_ANGLED = ("rotate", "skew", "skewx", "skewy")
_KEYWORDS = {"left": 0.0, "top": 0.0, "center": 0.5, "right": 1.0, "bottom": 1.0}
_VERTICAL = ("top", "bottom")
_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))

Length = Callable[[str, str], float]
"""Function that converts a length text to user units; the axis ("x" or "y") says what percentages
are of. DrawingError."""


def parse_transform(text: str) -> Affine:
    """Return the map of a transform list: matrix, translate, scale, rotate, skewX, skewY;
    DrawingError for other text."""
    product = Affine()
    for name, inside in _functions(text):
        numbers = parse_numbers(inside, f"transform {name}")
        product = (product @ _single(name, numbers)).checked()
    return product


def parse_css_transform(text: str, length: Length) -> Affine:
    """Return the map of a CSS transform list in the plane, with units; DrawingError for other
    text."""
    product = Affine()
    for name, inside in _functions(text):
        words = [word for word in re.split(r"[\s,]+", inside) if word]
        product = (product @ _css_single(name.lower(), words, length)).checked()
    return product


def parse_origin(text: str, length: Length) -> tuple[float, float]:
    """Return the point (x, y) that transform-origin names, in user units; DrawingError for other
    text.

    Of a single value the other one is "center"."""
    words = text.lower().split()[:2]
    if len(words) == 1:
        words = ["center", words[0]] if words[0] in _VERTICAL else [words[0], "center"]
    elif words[0] in _VERTICAL or words[1] in ("left", "right"):
        words.reverse()
    places = [
        length(f"{100.0 * _KEYWORDS[word]}%" if word in _KEYWORDS else word, axis)
        for word, axis in zip(words, "xy", strict=True)
    ]
    return places[0], places[1]


def about_point(origin: tuple[float, float], inner: Affine) -> Affine:
    """Return the map `inner` applied about the point `origin` instead of (0, 0)."""
    x, y = origin
    return (translation(x, y) @ inner @ translation(-x, -y)).checked()


def _functions(text: str) -> list[tuple[str, str]]:
    """Return the name of each function in a transform list, and the text between its
    parentheses."""
    parts: list[tuple[str, str]] = []
    offset = 0
    while text[offset:].strip(BETWEEN):
        match = _FUNCTION.match(text, offset)
        if match is None:
            raise DrawingError(f"transform {shortened(text[offset:])} is no transform")
        offset = match.end()
        parts.append((match[1], match[2]))
        if len(parts) > _MAX_FUNCTIONS:
            raise DrawingError("transform has too many parts")
    return parts


_MAX_FUNCTIONS = 1000


def _single(name: str, n: Sequence[float]) -> Affine:
    """Return the map of one function of a transform list, given its numbers."""
    match name, len(n):
        case "matrix", 6:
            return Affine(*n)
        case "translate", 1 | 2:
            return translation(n[0], n[1] if len(n) == 2 else 0.0)
        case "scale", 1 | 2:
            return scaling(n[0], n[-1])
        case "rotate", 1:
            return _rotation(n[0])
        case "rotate", 3:
            return about_point((n[1], n[2]), _rotation(n[0]))
        case "skewX", 1:
            return Affine(c=math.tan(math.radians(n[0])))
        case "skewY", 1:
            return Affine(b=math.tan(math.radians(n[0])))
    raise DrawingError(f"transform {name} with {len(n)} numbers is no transform")


def _css_single(name: str, words: list[str], length: Length) -> Affine:
    """Return the map of one function of a CSS transform list, given its words; `name` is in lower
    case."""
    if name in _LENGTHWISE:
        second = name == "translatey"
        numbers = [length(word, "xy"[(place + second) % 2]) for place, word in enumerate(words)]
    elif name in _ANGLED:
        numbers = [_with_unit(word, _DEGREES) for word in words]
    else:
        numbers = [_with_unit(word, {"": 1.0, "%": 0.01}) for word in words]
    match name, len(numbers):
        case "translatex" | "translatey", 1:
            x, y = (0.0, numbers[0]) if name == "translatey" else (numbers[0], 0.0)
            return translation(x, y)
        case "scalex", 1:
            return scaling(numbers[0], 1.0)
        case "scaley", 1:
            return scaling(1.0, numbers[0])
        case "skew", 1 | 2:
            x, y = (math.tan(math.radians(angle)) for angle in (*numbers, 0.0)[:2])
            return Affine(b=y, c=x)
        case "rotate", 3:
            raise DrawingError("transform rotate with 3 numbers is no transform of CSS")
        case "skewx" | "skewy", 1:
            return _single(name[:-1] + name[-1].upper(), numbers)
    return _single(name, numbers)


def _with_unit(word: str, units: dict[str, float]) -> float:
    """Return a number times the value of its unit; DrawingError for a unit that is not in
    `units`."""
    match = _MEASURE.fullmatch(word)
    unit = match[2].lower() if match else None
    if match is None or unit not in units:
        raise DrawingError(f"transform has {shortened(word)}, which is no number that it can use")
    return in_bounds(float(match[1]) * units[str(unit)], "transform")


def _rotation(degrees: float) -> Affine:
    """Return the rotation by an angle; quarter turns are exact, so that a turned square stays
    one."""
    quarter, remainder = divmod(degrees, 90.0)
    if remainder == 0.0:
        cosine, sine = _QUARTERS[int(quarter) % 4]
    else:
        cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return Affine(cosine, sine, -sine, cosine)
