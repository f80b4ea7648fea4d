"""The shapes of the sample drawings, which are written both as DXF and as SVG.

All lengths are mm, Y up; numbers are rounded to a picometre, which hides the last digits of sines.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

Point = tuple[float, float]


@dataclass(frozen=True)
class Line:
    """A line from `start` to `end`."""

    start: Point
    end: Point


@dataclass(frozen=True)
class Circle:
    """A full circle."""

    centre: Point
    radius: float


@dataclass(frozen=True)
class Arc:
    """An arc, counter-clockwise from `start` to `end`, degrees."""

    centre: Point
    radius: float
    start: float
    end: float


@dataclass(frozen=True)
class Ellipse:
    """A full ellipse: half axes, and the rotation of the longer one in degrees."""

    centre: Point
    longer: float
    shorter: float
    turn: float = 0.0


@dataclass(frozen=True)
class Polyline:
    """A polyline of vertices x, y, bulge."""

    vertices: Sequence[tuple[float, float, float]]
    closed: bool = True


@dataclass(frozen=True)
class Spline:
    """A chain of n cubic Béziers: 3n + 1 control points."""

    control: Sequence[Point]


@dataclass(frozen=True)
class Insert:
    """A block at a place, scaled, then rotated by degrees."""

    block: str
    at: Point
    turn: float = 0.0
    scale: tuple[float, float] = (1.0, 1.0)


Shape = Line | Circle | Arc | Ellipse | Polyline | Spline | Insert


@dataclass(frozen=True)
class Layer:
    """Shapes of one layer; `colour` as index (DXF) and as text (SVG)."""

    name: str
    index: int
    colour: str
    shapes: Sequence[Shape]


@dataclass(frozen=True)
class Sheet:
    """A drawing of `size` mm, its lower left corner at the origin."""

    title: str
    size: Point
    layers: Sequence[Layer]
    blocks: Mapping[str, Sequence[Shape]]


def number(value: float) -> str:
    """The number with nine decimals, without trailing zeros, and never "-0"."""
    text = f"{value:.9f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text
