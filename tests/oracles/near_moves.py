"""Errors against moves by plain loops: angles for arcs, all moves for the nearest."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.kernels import judging as at


@dataclass(frozen=True)
class Line:
    """From a to b."""

    a: tuple[float, float]
    b: tuple[float, float]

    def error(self, x: float, y: float) -> float:
        """Distance, positive to the left."""
        (ax, ay), (bx, by) = self.a, self.b
        dx, dy = bx - ax, by - ay
        share = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
        share = min(max(share, 0.0), 1.0)
        apart = math.hypot(x - ax - share * dx, y - ay - share * dy)
        return math.copysign(apart, dx * (y - ay) - dy * (x - ax))

    def row(self) -> list[float]:
        """Its numbers."""
        (ax, ay), (bx, by) = self.a, self.b
        dx, dy = bx - ax, by - ay
        return [ax, ay, bx, by, dx, dy, 1 / (dx * dx + dy * dy), 0, 0, 0, 1, 0, 0, 0, 0, 0]

    def box(self) -> list[float]:
        """xmin, ymin, xmax, ymax."""
        (ax, ay), (bx, by) = self.a, self.b
        return [min(ax, bx), min(ay, by), max(ax, bx), max(ay, by)]


@dataclass(frozen=True)
class Arc:
    """About a centre, from an angle on by a sweep > 0 ccw, < 0 cw."""

    centre: tuple[float, float]
    radius: float
    begin: float
    sweep: float

    def place(self, share: float) -> tuple[float, float]:
        """The point at a share of the way."""
        turn = self.begin + share * self.sweep
        (cx, cy), r = self.centre, self.radius
        return cx + r * math.cos(turn), cy + r * math.sin(turn)

    def error(self, x: float, y: float) -> float:
        """Distance, positive to the left."""
        cx, cy = self.centre
        sense = math.copysign(1.0, self.sweep)
        inward = sense * (self.radius - math.hypot(x - cx, y - cy))
        ahead = sense * (math.atan2(y - cy, x - cx) - self.begin) % (2.0 * math.pi)
        if ahead <= abs(self.sweep):
            return inward
        ends = [math.dist((x, y), self.place(share)) for share in (0.0, 1.0)]
        return math.copysign(min(ends), inward)

    def row(self) -> list[float]:
        """Its numbers."""
        (cx, cy), sense = self.centre, math.copysign(1.0, self.sweep)
        (ax, ay), (bx, by) = self.place(0.0), self.place(1.0)
        spokes = [sense * v for v in (ax - cx, ay - cy, bx - cx, by - cy)]
        full = abs(self.sweep) >= 2.0 * math.pi
        above = at.FULL if full else float(abs(self.sweep) > math.pi)
        way = [bx - ax, by - ay, 1.0]
        return [ax, ay, bx, by, *way, cx, cy, self.radius, sense, *spokes, above]

    def box(self) -> list[float]:
        """A box around the whole circle: larger than it need be."""
        (cx, cy), r = self.centre, self.radius
        return [cx - r, cy - r, cx + r, cy + r]


Move = Line | Arc


def random_move(rng: np.random.Generator) -> Move:
    """A line or an arc, among them half and whole turns."""
    if rng.integers(2):
        a = tuple(rng.uniform(-1.0, 1.0, 2).tolist())
        b = tuple((np.array(a) + rng.normal(0.0, 0.3, 2)).tolist())
        return Line(a, b)
    sweep = float(rng.choice([math.pi, 2.0 * math.pi, rng.uniform(0.01, 6.2)]))
    centre = tuple(rng.uniform(-1.0, 1.0, 2).tolist())
    begin = float(rng.uniform(-math.pi, math.pi))
    return Arc(centre, float(rng.uniform(0.02, 0.6)), begin, sweep * float(rng.choice([-1, 1])))


def nearest(moves: list[Move], x: float, y: float) -> float:
    """The error of least size."""
    return min((move.error(x, y) for move in moves), key=abs, default=math.inf)
