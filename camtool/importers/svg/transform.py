"""Transform lists: of the attribute `transform`, and the plain ones of the CSS property.

Source: Scalable Vector Graphics 1.1, 7.6 (the transform attribute); CSS Transforms 1, chapters 7
(transform-origin) and 13 (functions).
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence

from camtool.errors import DrawingError
from camtool.importers.svg.affine import (
    BETWEEN,
    NUMBER,
    Affine,
    in_bounds,
    parse_numbers,
    scaling,
    short,
    translation,
)

_FUNCTION = re.compile(r"[\s,]*+([A-Za-z]+)\s*\(([^()]*)\)\s*")
_MEASURE = re.compile(rf"({NUMBER.pattern})([A-Za-z%]*)", re.ASCII)
_DEGREES = {"": 1.0, "deg": 1.0, "rad": 180.0 / math.pi, "grad": 0.9, "turn": 360.0}
_LENGTHWISE = ("translate", "translatex", "translatey")
_ANGLED = ("rotate", "skew", "skewx", "skewy")
_KEYWORDS = {"left": 0.0, "top": 0.0, "center": 0.5, "right": 1.0, "bottom": 1.0}
_VERTICAL = ("top", "bottom")
_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))

Length = Callable[[str, str], float]
"""A length text and the axis ("x" or "y") that % are along, to user units; DrawingError."""


def parse_transform(text: str) -> Affine:
    """A transform list: matrix, translate, scale, rotate, skewX, skewY; DrawingError."""
    whole = Affine()
    for name, inside in _functions(text):
        numbers = parse_numbers(inside, f"transform {name}")
        whole = (whole @ _single(name, numbers)).checked()
    return whole


def parse_css_transform(text: str, length: Length) -> Affine:
    """A CSS transform list in the plane, with units; DrawingError for what is none."""
    whole = Affine()
    for name, inside in _functions(text):
        words = [word for word in re.split(r"[\s,]+", inside) if word]
        whole = (whole @ _css_single(name.lower(), words, length)).checked()
    return whole


def parse_origin(text: str, length: Length) -> tuple[float, float]:
    """transform-origin in user units; DrawingError. What is not said is 0 for an SVG element."""
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


def about(origin: tuple[float, float], inner: Affine) -> Affine:
    """The map done about a point instead of (0, 0)."""
    x, y = origin
    return (translation(x, y) @ inner @ translation(-x, -y)).checked()


def _functions(text: str) -> list[tuple[str, str]]:
    """Name and inside of each function of a list."""
    found: list[tuple[str, str]] = []
    at = 0
    while text[at:].strip(BETWEEN):
        match = _FUNCTION.match(text, at)
        if match is None:
            raise DrawingError(f"transform {short(text[at:])} is no transform")
        at = match.end()
        found.append((match[1], match[2]))
        if len(found) > _MOST_FUNCTIONS:
            raise DrawingError("transform has too many parts")
    return found


_MOST_FUNCTIONS = 1000


def _single(name: str, n: Sequence[float]) -> Affine:
    """One function of a transform list."""
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
            return about((n[1], n[2]), _rotation(n[0]))
        case "skewX", 1:
            return Affine(c=math.tan(math.radians(n[0])))
        case "skewY", 1:
            return Affine(b=math.tan(math.radians(n[0])))
    raise DrawingError(f"transform {name} with {len(n)} numbers is no transform")


def _css_single(name: str, words: list[str], length: Length) -> Affine:
    """One function of the CSS property; its names are the same in any case."""
    if name in _LENGTHWISE:
        second = name == "translatey"
        numbers = [length(word, "xy"[(place + second) % 2]) for place, word in enumerate(words)]
    elif name in _ANGLED:
        numbers = [_measured(word, _DEGREES) for word in words]
    else:
        numbers = [_measured(word, {"": 1.0, "%": 0.01}) for word in words]
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


def _measured(word: str, units: dict[str, float]) -> float:
    """A number times its unit."""
    match = _MEASURE.fullmatch(word)
    unit = match[2].lower() if match else None
    if match is None or unit not in units:
        raise DrawingError(f"transform has {short(word)}, which is no number that it can use")
    return in_bounds(float(match[1]) * units[str(unit)], "transform")


def _rotation(degrees: float) -> Affine:
    """Quarter turns are exact, so that a turned square stays one."""
    quarter, rest = divmod(degrees, 90.0)
    if rest == 0.0:
        cosine, sine = _QUARTERS[int(quarter) % 4]
    else:
        cosine, sine = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return Affine(cosine, sine, -sine, cosine)
