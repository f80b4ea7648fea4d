"""The points about a circle in bins of their angle, without an angle per point.

A point p about the centre lies in bin b when it is to the left of the bin's first direction and
to the right of the next one's: two cross products. Points that follow each other mostly stay in
one bin, so the arc tangent is taken only when one leaves it. Of each bin are kept: how many
points, their sum, the nearest and the farthest with their places.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import bare
from camtool.kernels.wide import larger, smaller, wide

Floats = npt.NDArray[np.float64]

ANGLE_BINS = 720
"""Angle bins of a circle: half a degree each."""

BIN_COLUMNS = 9
"""Of a bin: count; sum x, y; least |p|², its x, y; largest |p|², its x, y."""


def bin_directions() -> Floats:
    """(721, 2) the directions between which the bins lie."""
    angle = np.arange(ANGLE_BINS + 1) % ANGLE_BINS * (2.0 * np.pi / ANGLE_BINS)
    return np.column_stack([np.cos(angle), np.sin(angle)])


def empty_bins(count: int) -> Floats:
    """(count, 720, 9) bins of circles that nothing went round."""
    bins = np.zeros((count, ANGLE_BINS, BIN_COLUMNS))
    bins[:, :, 3], bins[:, :, 6] = np.inf, -np.inf
    return bins


@bare
def _bin_of(x: float, y: float, directions: Floats) -> int:
    """The bin of a point: by its angle, and on the edge of two bins by the cross products."""
    turn = math.atan2(y, x) / (2.0 * math.pi)
    turn = turn + 1.0 if turn < 0.0 else turn
    which = min(int(turn * ANGLE_BINS), ANGLE_BINS - 1)
    if directions[which, 0] * y - directions[which, 1] * x < 0.0:
        return (which - 1) % ANGLE_BINS
    if x * directions[which + 1, 1] - y * directions[which + 1, 0] <= 0.0:
        return (which + 1) % ANGLE_BINS
    return which


@wide
def _stay(x: Floats, y: Floats, centre: Floats, one: Floats, next_: Floats) -> int:
    """How many of the points from the first on lie between the two directions: at least one."""
    cx, cy = centre[0], centre[1]
    from_x, from_y, to_x, to_y = one[0], one[1], next_[0], next_[1]
    count = len(x)
    stay = count
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        inside = (from_x * py - from_y * px >= 0.0) & (px * to_y - py * to_x > 0.0)
        stay = min(stay, count if inside else k)
    return max(stay, 1)


@wide
def fill_bins(x: Floats, y: Floats, centre: Floats, directions: Floats, bins: Floats) -> None:
    """Put the points x, y (n,) about `centre` (2,) into `bins` (720, 9)."""
    done = 0
    while done < len(x):
        which = _bin_of(x[done] - centre[0], y[done] - centre[1], directions)
        one, next_ = directions[which], directions[which + 1]
        stay = _stay(x[done:], y[done:], centre, one, next_)
        _add(x[done : done + stay], y[done : done + stay], centre, bins[which])
        done += stay


@wide
def _add(x: Floats, y: Floats, centre: Floats, one: Floats) -> None:
    """Put points into one bin."""
    cx, cy = centre[0], centre[1]
    least, largest, sum_x, sum_y = np.inf, -np.inf, 0.0, 0.0
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        square = px * px + py * py
        least = smaller(least, square)
        largest = larger(largest, square)
        sum_x += px
        sum_y += py
    one[0] += len(x)
    one[1] += sum_x
    one[2] += sum_y
    if least < one[3]:
        _place(x, y, centre, least, one[3:6])
    if largest > one[6]:
        _place(x, y, centre, largest, one[6:9])


@wide
def _place(x: Floats, y: Floats, centre: Floats, square: float, out: Floats) -> None:
    """The first point with this square of its distance."""
    cx, cy = centre[0], centre[1]
    count = len(x)
    place = count
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        place = min(place, k if px * px + py * py == square else count)
    out[0], out[1], out[2] = square, x[place] - cx, y[place] - cy
