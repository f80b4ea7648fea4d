"""What a ball-bar would show of a circle: reversals, and both ways round together.

At 0° and 180° X turns, at 90° and 270° Y does. What an axis does wrong at its reversal lies along
the radius there. Of the mean radii of the bins of half a degree (`camtool.kernels.circle_bins`):

- the step at such a place is the radius behind it (in the direction of travel) less that before
  it, each taken there from a straight line through the bins of its side;
- the spike is what sticks out beyond both sides, outwards (+) or inwards;
- the reversal value B of an axis is estimated from the whole circle: a slide that stands off by
  ±B/2 depending on the direction of its axis changes the radius at the angle t by
  ∓B/2 |cos t| (X) or |sin t| (Y), so the radii are fitted by least squares with

      r = c + e_x cos t + e_y sin t + (B_x/2) d_x |cos t| + (B_y/2) d_y |sin t|,

  d = −1 where the axis goes towards the place where it stands farthest out, +1 behind it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Floats
from camtool.verify.circles import Circle, circular_error, mean_points

QUADRANTS_DEG = (0, 90, 180, 270)
"""Where an axis turns: X, Y, X, Y."""

NEAR_BINS, FAR_BINS = 3, 15
"""A step is seen between 1.5° and 7.5° to either side, a spike within 1.5°."""

SAME_SHARE = 1e-3
"""Circles whose centres and radii differ by less than this share of the radius are one circle
cut twice."""


@dataclass(frozen=True)
class Reversing:
    """mm: `step` and `spike` at 0°, 90°, 180°, 270°; `value` B of X and Y. NaN where the slides
    left too few bins."""

    step: tuple[float, float, float, float]
    spike: tuple[float, float, float, float]
    value: tuple[float, float]


@dataclass(frozen=True)
class BothWays:
    """A circle that was cut both ways round, mm: bi-directional circular error G(b) and mean
    bi-directional radial error D."""

    circle: Circle
    circular_mm: float
    radial_mean_mm: float


def reversing(bins: Floats, ccw: bool) -> Reversing:
    """The reversals of one circle from its bins (B, 9) about the programmed centre."""
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = bins[:, 1:3] / bins[:, :1]
        least, largest = np.sqrt(bins[:, 3]), np.sqrt(bins[:, 6])
    # The mean of points along an arc of angle w lies at sin(w/2)/(w/2) of the radius.
    half = np.pi / len(bins)
    radius = np.hypot(mean[:, 0], mean[:, 1]) * (half / math.sin(half))
    steps, spikes = [], []
    for degrees in QUADRANTS_DEG:
        at = degrees * len(bins) // 360
        step, spike = _at(radius, least, largest, at, 1 if ccw else -1)
        steps.append(step)
        spikes.append(spike)
    return Reversing(
        (steps[0], steps[1], steps[2], steps[3]),
        (spikes[0], spikes[1], spikes[2], spikes[3]),
        _values(radius, ccw),
    )


def _at(radius: Floats, least: Floats, largest: Floats, at: int, way: int) -> tuple[float, float]:
    """Step and spike at the edge below bin `at`; `way` +1 for growing angles."""
    count = len(radius)
    away = np.arange(NEAR_BINS, FAR_BINS) + 0.5
    behind = radius[(at + np.arange(NEAR_BINS, FAR_BINS)) % count]
    below = radius[(at - 1 - np.arange(NEAR_BINS, FAR_BINS)) % count]
    if not (np.isfinite(behind).all() and np.isfinite(below).all()):
        return math.nan, math.nan
    high, low = (float(np.polyfit(away, side, 1)[1]) for side in (behind, below))
    near = np.arange(at - NEAR_BINS, at + NEAR_BINS) % count
    seen = np.isfinite(largest[near])
    out = float(largest[near][seen].max(initial=-math.inf)) - max(high, low)
    into = min(high, low) - float(least[near][seen].min(initial=math.inf))
    return way * (high - low), max(out, 0.0) if out >= into else -max(into, 0.0)


def _values(radius: Floats, ccw: bool) -> tuple[float, float]:
    """B of X and of Y by least squares; NaN when less than half of the circle is there."""
    angle = (np.arange(len(radius)) + 0.5) * (2.0 * np.pi / len(radius))
    seen = np.isfinite(radius)
    if seen.sum() < len(radius) // 2:
        return math.nan, math.nan
    cos, sin = np.cos(angle[seen]), np.sin(angle[seen])
    turn = 1.0 if ccw else -1.0
    # Growing angles leave 0° with sin > 0, and 90° with cos < 0.
    x = turn * np.sign(sin) * cos
    y = -turn * np.sign(cos) * sin
    table = np.column_stack([np.ones(len(cos)), cos, sin, 0.5 * x, 0.5 * y])
    found = np.linalg.lstsq(table, radius[seen], rcond=None)[0]
    return float(found[3]), float(found[4])


class Pairs:
    """The circles that are cut clockwise and counterclockwise about one centre. Only their bins
    are kept, and only until the second of them is done."""

    def __init__(self, circles: Sequence[Circle]) -> None:
        """Each takes the first free partner: as many pairs as there are of the rarer way."""
        self._circles = circles
        self._partner: dict[int, int] = {}
        self._waiting: dict[int, Floats] = {}
        if not circles:
            return
        table = np.array([(*one.centre_mm, one.radius_mm) for one in circles])
        free = np.array([not one.ccw for one in circles])
        for first, one in enumerate(circles):
            if one.ccw and free.any():
                apart = np.abs(table - table[first]).max(axis=1)
                for second in np.flatnonzero(free & (apart <= SAME_SHARE * one.radius_mm))[:1]:
                    free[second] = False
                    self._partner[first], self._partner[int(second)] = int(second), first

    def partner(self, circle: int) -> int | None:
        """The other circle of its pair; None where it has none."""
        return self._partner.get(circle)

    def add(self, circle: int, bins: Floats) -> list[BothWays]:
        """Take the bins of a circle; what it and its partner make when that is done already."""
        partner = self._partner.get(circle)
        if partner is None:
            return []
        if partner not in self._waiting:
            self._waiting[circle] = bins.copy()
            return []
        return [
            both_ways(self._circles[circle], np.concatenate([self._waiting.pop(partner), bins]))
        ]


def both_ways(circle: Circle, bins: Floats) -> BothWays:
    """The figures of a circle from the bins (2 B, 9) of both ways round; NaN without points."""
    seen = bins[bins[:, 0] > 0.0]
    if len(seen) == 0:
        return BothWays(circle, math.nan, math.nan)
    about = np.hypot(*mean_points(seen).T).mean()
    return BothWays(circle, circular_error(seen), float(about) - circle.radius_mm)
