"""The emblems that two theses cut, redrawn: their own shapes are in figures that are lost.

Given by the theses are the sizes, the widths of two details, a radius and the number of reversals
that the controller had to compensate (docs/validation.md names the lines). All else is our
drawing: a puma's head seen from in front, and a toothed wheel behind a plate. All lengths are mm.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Sequence

from shapes import Circle, Point, Polyline, Shape

Vertex = tuple[float, float, float]

PUMA = (4.86, 4.96)
"""Size of the puma as it is drawn here, before it is scaled."""
OUTER: Sequence[Point] = [
    (0.0, 0.0), (0.62, 0.22), (1.1, 0.8), (1.6, 1.7), (2.0, 2.6), (2.37, 3.5), (2.37, 4.6),
    (2.43, 4.76),
]  # fmt: skip
"""The right side from the chin to the ear, whose outer edge is the last line but one."""
INNER: Sequence[Point] = [(2.37, 4.6), (2.37, 3.9)]
"""Two places on the ear's outer edge; its inner edge is as far to the left as the ear is wide."""
FOREHEAD: Sequence[Point] = [(0.75, 4.3), (0.0, 4.42)]
RIGHT_EYE: Sequence[Point] = [(0.42, 2.62), (1.32, 3.06), (1.42, 3.3), (0.62, 3.1)]
MOUTH: Sequence[Point] = [(-0.62, 1.2), (0.0, 1.5), (0.62, 1.2)]


def mirrored(points: Sequence[Point]) -> list[Point]:
    """The points on the other side of the Y axis."""
    return [(-x, y) for x, y in points]


def ring(points: Sequence[Point], *, closed: bool = True) -> Polyline:
    """A polyline of straight lines."""
    return Polyline([(x, y, 0.0) for x, y in points], closed)


def puma(
    width: float, height: float, ear: float, *, halves: bool = False
) -> dict[str, list[Shape]]:
    """The puma's head by layer, its chin at the origin, its ears so wide along X: its outline
    counter-clockwise from the chin as one contour, or as two halves from chin to forehead."""
    along_x, along_y = width / PUMA[0], height / PUMA[1]

    def scaled(points: Sequence[Point]) -> list[Point]:
        return [(x * along_x, y * along_y) for x, y in points]

    tip = (0.49 * width - 0.5 * ear, height)
    inner = [(x - ear, y) for x, y in scaled(INNER)]
    right = [*scaled(OUTER), tip, *inner, *scaled(FOREHEAD)]
    left = mirrored(right)
    if halves:
        sides = {"RIGHT": ring(right, closed=False), "LEFT": ring(left, closed=False)}
    else:
        sides = {"OUTLINE": ring([*right, *left[-2:0:-1]])}
    return {
        **{layer: [side] for layer, side in sides.items()},
        "MOUTH": [ring(scaled(MOUTH), closed=False)],
        "EYES": [ring(scaled(each)) for each in (RIGHT_EYE, mirrored(RIGHT_EYE))],
    }


EMBLEM = (5.0, 4.997)
"""Size of the emblem as it is drawn here; smaller ones have the same teeth."""
BORE_SHARE = 0.03
"""Radius of the pinion's bore: 150 µm of the 5 mm that the larger emblem is wide."""
WHEEL_TEETH, PINION_TEETH = 6, 6
"""Of the visible half of the wheel, and of the pinion: with these the axes turn 45 times."""
TIP_SHARE, FOOT_SHARE = 0.34, 0.56
"""The parts of the pitch that the tip and the foot of a tooth occupy."""


def teeth(at: complex, tip: float, root: float, pitch: float, count: int) -> list[Vertex]:
    """Teeth with straight flanks, clockwise; the middle of the first one lies on the left."""
    head, foot = TIP_SHARE * pitch, FOOT_SHARE * pitch
    vertices = []
    for tooth in range(count):
        middle = math.pi - tooth * pitch
        for radius, angle, turn in (
            (tip, middle + 0.5 * head, head),
            (tip, middle - 0.5 * head, 0.0),
            (root, middle - 0.5 * foot, pitch - foot),
            (root, middle - pitch + 0.5 * foot, 0.0),
        ):
            point = at + cmath.rect(radius, angle)
            vertices.append((point.real, point.imag, -math.tan(0.25 * turn)))
    return vertices


def half_wheel(at: complex, tip: float, root: float) -> Polyline:
    """The upper half of a wheel, clockwise from the middle of a tip on the left to that of one on
    the right."""
    pitch = math.pi / WHEEL_TEETH
    half = -math.tan(0.125 * TIP_SHARE * pitch)
    vertices = teeth(at, tip, root, pitch, WHEEL_TEETH + 1)[: 4 * WHEEL_TEETH + 1]
    vertices[0] = (at.real - tip, at.imag, half)
    x, y, _ = vertices[-1]
    return Polyline([*vertices[:-1], (x, y, half), (at.real + tip, at.imag, 0.0)], closed=False)


def emblem(width: float, height: float) -> dict[str, list[Shape]]:
    """A wheel behind a plate, whose upper right corner is where the wheel ends, and a pinion with
    a bore on the plate, by layer; the lower left corner of the plate at the origin."""
    tip = 0.5 * width
    top = height - tip
    at = complex(0.5 * width, 0.52 * top)
    plate = [(0.0, 0.0), (width, 0.0), (width, top), (0.0, top)]
    pinion = teeth(at, 0.36 * top, 0.26 * top, 2.0 * math.pi / PINION_TEETH, PINION_TEETH)
    return {
        "PLATE": [ring(plate)],
        "WHEEL": [half_wheel(complex(0.5 * width, top), tip, 0.84 * tip)],
        "PINION": [Polyline(pinion), Circle((at.real, at.imag), BORE_SHARE * width)],
    }
