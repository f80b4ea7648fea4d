"""A stretch of a line or arc on which no axis turns back."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from camtool.toolpath.moves import Kind, Move

Point = tuple[float, float, float]

TURN_EPS_RAD = 1e-9
"""A turning point nearer than this to an end of its arc is that end."""


@dataclass(frozen=True)
class Stretch:
    """From `begin` to `end` mm, straight, or about `centre` (x, y) with `sweep_rad`, CCW positive
    and at most a quarter turn; Z in proportion to the way."""

    begin: Point
    end: Point
    centre: tuple[float, float] | None = None
    sweep_rad: float = 0.0

    def at(self, share: float) -> Point:
        """The point at this share (0 … 1) of the way; exact at the ends."""
        if share <= 0.0:
            return self.begin
        if share >= 1.0:
            return self.end
        line = [a + share * (b - a) for a, b in zip(self.begin, self.end, strict=True)]
        if self.centre is None:
            return line[0], line[1], line[2]
        (cx, cy), (x, y, _) = self.centre, self.begin
        radius, back = math.hypot(x - cx, y - cy), math.hypot(self.end[0] - cx, self.end[1] - cy)
        radius += share * (back - radius)
        angle = math.atan2(y - cy, x - cx) + share * self.sweep_rad
        return cx + radius * math.cos(angle), cy + radius * math.sin(angle), line[2]

    def where(self, axis: int, value: float) -> float:
        """The share of the way at which an axis that moves has this value; 0 or 1 beyond it.

        On an arc the angle θ with c + r cos θ (sin θ for Y) = value; of its two solutions the one
        within the sweep.
        """
        first, last = self.begin[axis], self.end[axis]
        share = min(max((value - first) / (last - first), 0.0), 1.0)
        if self.centre is None or axis == 2 or share in (0.0, 1.0):
            return share
        low, high = 0.0, 1.0  # the axis runs one way along the stretch: bisection cannot fail
        rising = last > first
        while high - low > np.finfo(np.float64).eps:
            share = 0.5 * (low + high)
            if share in (low, high):
                break
            if (self.at(share)[axis] < value) == rising:
                low = share
            else:
                high = share
        return high

    def part(self, low: float, high: float) -> Stretch:
        """The part between two shares of the way."""
        return Stretch(self.at(low), self.at(high), self.centre, (high - low) * self.sweep_rad)


def stretches(move: Move, sweep_rad: float) -> Iterator[Stretch]:
    """A line as one stretch; an arc of this signed sweep cut where X or Y turns."""
    if move.kind not in (Kind.ARC_CW, Kind.ARC_CCW) or move.centre is None:
        yield Stretch(move.start, move.end)
        return
    whole = Stretch(move.start, move.end, move.centre, sweep_rad)
    cx, cy = move.centre
    sign = math.copysign(1.0, sweep_rad)
    # Seen along the way the turning points are the next multiples of a quarter turn.
    quarter = 0.5 * math.pi
    ahead = sign * math.atan2(move.start[1] - cy, move.start[0] - cx)
    turn = (math.floor(ahead / quarter) + 1.0) * quarter - ahead
    shares = [0.0]
    while turn < abs(sweep_rad) - TURN_EPS_RAD:
        if turn > TURN_EPS_RAD:
            shares.append(turn / abs(sweep_rad))
        turn += quarter
    shares.append(1.0)
    for low, high in pairwise(shares):
        yield whole.part(low, high)
