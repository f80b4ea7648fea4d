"""Numbers of SVG attributes and affine maps.

    ( x' )   ( a c ) ( x )   ( e )
    ( y' ) = ( b d ) ( y ) + ( f )

Source: Scalable Vector Graphics 1.1, 7.7 and 7.8 (viewBox and preserveAspectRatio).
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats

MAX_NUMBER = 1e12
"""Numbers beyond this belong to no drawing; their products could overflow."""

NUMBER = re.compile(r"(?>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)", re.ASCII)

BETWEEN = " \t\r\n\f,"
_ALIGN = re.compile(r"(?:defer\s+)?(none|x(Min|Mid|Max)Y(Min|Mid|Max))(?:\s+(meet|slice))?")
_SHARE = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}


@dataclass(frozen=True)
class Affine:
    """A map of the plane; `outer @ inner` does `inner` first."""

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
        """How areas grow; negative when the map mirrors."""
        return self.a * self.d - self.b * self.c

    def points(self, points: Floats) -> Floats:
        """(n, 2) positions mapped."""
        x, y = points[:, 0], points[:, 1]
        mapped = np.empty((len(points), 2))
        mapped[:, 0] = self.a * x + self.c * y + self.e
        mapped[:, 1] = self.b * x + self.d * y + self.f
        return mapped

    def vectors(self, vectors: Floats) -> Floats:
        """(n, 2) directions mapped: without the shift."""
        return np.asarray(vectors @ np.array([[self.a, self.b], [self.c, self.d]]))

    @property
    def inverse(self) -> Affine:
        """The map back; the determinant must not be 0."""
        size = self.determinant
        a, b, c, d = self.d / size, -self.b / size, -self.c / size, self.a / size
        return Affine(a, b, c, d, -(a * self.e + c * self.f), -(b * self.e + d * self.f))

    def checked(self) -> Affine:
        """This map; DrawingError when its numbers have run out of all bounds."""
        if not all(abs(v) <= MAX_NUMBER for v in (self.a, self.b, self.c, self.d, self.e, self.f)):
            raise DrawingError("its transforms multiply beyond all bounds")
        return self


def translation(x: float, y: float) -> Affine:
    """The shift by (x, y)."""
    return Affine(e=x, f=y)


def scaling(x: float, y: float) -> Affine:
    """The scale about the origin."""
    return Affine(a=x, d=y)


def in_bounds(value: float, name: str) -> float:
    """The number itself; DrawingError when it belongs to no drawing."""
    if not abs(value) <= MAX_NUMBER:
        raise DrawingError(f"{name} {value:g} is out of all bounds")
    return value


def parse_numbers(text: str, name: str) -> list[float]:
    """Numbers parted by blanks or commas; DrawingError naming what is none."""
    rest = NUMBER.sub(" ", text).strip(BETWEEN)
    rest = rest.replace(",", " ").strip()
    if rest:
        raise DrawingError(f"{name} holds {short(rest)}, which is no number")
    values = [float(number) for number in NUMBER.findall(text)]
    furthest = max(values, key=abs, default=0.0)
    in_bounds(furthest, name)
    return values


@dataclass(frozen=True)
class Box:
    """A rectangle: its corner of least x and y, and its size."""

    x: float
    y: float
    width: float
    height: float


def parse_view_box(text: str) -> Box | None:
    """viewBox, None when it is not there; DrawingError when it is no box."""
    if not text:
        return None
    numbers = parse_numbers(text, "viewBox")
    if len(numbers) != 4:
        raise DrawingError(f"viewBox holds {len(numbers)} numbers, wanted 4")
    box = Box(*numbers)
    if box.width <= 0.0 or box.height <= 0.0:
        raise DrawingError(f"viewBox is {box.width:g} x {box.height:g}: it shows nothing")
    return box


def view_box_map(box: Box, onto: Box, align: str) -> Affine:
    """The map of viewBox `box` onto the viewport `onto` by preserveAspectRatio `align`.

    meet: scale = min(sx, sy), all is seen; slice: the greater one, all is covered. What is left
    over, viewport − scale · box, is shared out by Min (0), Mid (½), Max (1).
    """
    match = _ALIGN.fullmatch(align or "xMidYMid")
    if match is None:
        raise DrawingError(f"preserveAspectRatio {short(align)} is not known")
    sx, sy = onto.width / box.width, onto.height / box.height
    x, y = onto.x, onto.y
    if match[1] != "none":
        sx = sy = max(sx, sy) if match[4] == "slice" else min(sx, sy)
        x += _SHARE[match[2]] * (onto.width - sx * box.width)
        y += _SHARE[match[3]] * (onto.height - sy * box.height)
    return Affine(sx, 0.0, 0.0, sy, x - sx * box.x, y - sy * box.y).checked()


def short(text: str) -> str:
    """A quoted beginning of a text, for messages."""
    return repr(text if len(text) <= 24 else text[:21] + "...")
