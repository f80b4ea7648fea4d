"""ValCNC's controller, pass by pass, in plain Python.

From Tabla 8 and the text around it (L1230-1257) and the equations of its arcs (L1266-1330).
Nothing here is shared with `camtool`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

Place = tuple[int, int, int]
Point = tuple[float, float, float]

BINARY_DUST = 1e-6
"""Parts of a step: decimals arrive as binary fractions a hair off."""


def counter(at: Place, way: Place) -> Iterator[tuple[Place, list[int]]]:
    """The place after each pass of a line, and CUENTA of each axis."""
    most = max(abs(part) for part in way)
    here, cuenta = list(at), [0, 0, 0]
    for _ in range(most):
        for axis in range(3):
            step = 1 if way[axis] > 0 else -1
            if abs(way[axis]) == most:
                here[axis] += step
                continue
            cuenta[axis] += abs(way[axis])
            if cuenta[axis] >= most:
                cuenta[axis] -= most
                here[axis] += step
        yield (here[0], here[1], here[2]), cuenta.copy()


def table_8() -> list[tuple[int, int, int]]:
    """Recorrido X, recorrido Y, cuenta of each iteration, as printed (L1243-1250)."""
    return [(1, 0, 3), (2, 0, 6), (3, 1, 2), (4, 1, 5), (5, 2, 1), (6, 2, 4), (7, 3, 0)]


@dataclass
class Valcnc:
    """A controller at rest at part zero; lengths in mm."""

    step_mm: tuple[float, float, float]
    truncated: bool = False
    differences: bool = False
    segment_mm: float = 0.2
    segments: int | None = None
    forced_end: bool = False

    def __post_init__(self) -> None:
        self.at: Place = (0, 0, 0)
        self.coordinate: Point = (0.0, 0.0, 0.0)

    def steps(self, mm: float, axis: int) -> int:
        """Whole steps of a length."""
        exact = abs(mm) / self.step_mm[axis] + BINARY_DUST
        whole = math.floor(exact if self.truncated else exact + 0.5)
        return whole if mm > 0 else -whole

    def line(self, to: Point) -> list[Place]:
        """Dibujar línea: places after each pass."""
        if self.differences:
            way = [
                self.steps(b - a, k)
                for k, (a, b) in enumerate(zip(self.coordinate, to, strict=True))
            ]
        else:
            way = [self.steps(b, k) - self.at[k] for k, b in enumerate(to)]
        self.coordinate = to
        places = [place for place, _ in counter(self.at, (way[0], way[1], way[2]))]
        if places:
            self.at = places[-1]
        return places

    def arc(
        self, end: tuple[float, float], i: float, j: float, *, ccw: bool, full: bool = False
    ) -> list[Place]:
        """Dibujar arco: lines to the points that the angle is divided into; `full`: the program
        ends it where it begins it."""
        x, y, z = self.coordinate
        centre = (x + i, y + j)
        radius = math.sqrt(i * i + j * j)
        chord = math.sqrt((end[0] - x) ** 2 + (end[1] - y) ** 2)
        alpha = 2.0 * math.asin(min(1.0, chord / (2.0 * radius)))
        # Consideración 2: reflex angles. Turned so that the start's arm points along +X, the end
        # of an arc of less than half a turn lies on the side that the arc turns to.
        theta = math.atan2(-j, -i)
        arm = complex(end[0] - centre[0], end[1] - centre[1]) * complex(
            math.cos(-theta), math.sin(-theta)
        )
        if full:
            alpha = 2.0 * math.pi
        elif (arm.imag < 0.0) == ccw and arm.imag != 0.0:
            alpha = 2.0 * math.pi - alpha
        parts = self.segments or max(1, math.ceil(radius * alpha / self.segment_mm - 1e-9))
        places: list[Place] = []
        for part in range(1, parts + 1):
            turned = theta + alpha * part / parts if ccw else theta - alpha * part / parts
            to = (centre[0] + radius * math.cos(turned), centre[1] + radius * math.sin(turned), z)
            if part == parts and self.forced_end:
                to = (end[0], end[1], z)
            places += self.line(to)
        return places
