"""Full circles of a toolpath, and the figures of ISO 230-4 for what became of them.

About a programmed circle (centre c, radius R) the slides are seen as radii over the angle, kept
in bins of half a degree (`camtool.kernels.circle_bins`): of each bin the points with the least and
the largest radius and the mean point. Memory is that of the bins, however many steps there are.

    F max, F min = largest, least |p − c| − R           (radial error, programmed centre)
    G            = largest − least |p − c'|              (circular error)
    D            = mean of |p − c| − R over the bins     (mean radial error)

c' is the centre of the circle that fits the bins' mean points best by least squares of the radial
distances; each bin counts alike, as the angle does for a ball-bar. With the centres e apart, the
extreme of a bin is found about c and taken about c': that is wrong by no more than
e · 2π/720, 0.9 % of e.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verify.cuts import CutMoves

FIT_ROUNDS = 30
"""The least-squares centre converges in about four rounds; more than this many are not tried."""

FIT_END_MM = 1e-9
"""The least-squares centre is found when it moves by less than this."""

FEWEST_BINS = 3
"""A circle has three unknowns."""


@dataclass(frozen=True)
class Circle:
    """A full circle of a toolpath: centre (x, y) mm, radius mm, direction, first and last row."""

    centre_mm: tuple[float, float]
    radius_mm: float
    ccw: bool
    z_mm: float
    first_row: int
    last_row: int


@dataclass(frozen=True)
class CircleFigures:
    """What became of a circle, mm; NaN where the slides left fewer than three angles, G also where
    they did not go round the programmed centre: as with play that comes near to the radius."""

    circular_mm: float
    radial_max_mm: float
    radial_min_mm: float
    radial_mean_mm: float


UNSEEN = CircleFigures(math.nan, math.nan, math.nan, math.nan)
"""Figures of a circle that nothing followed."""


def full_circles(cuts: CutMoves, gap_mm: float) -> list[Circle]:
    """Runs of consecutive level arcs that cut about one centre, one way round, and make a full
    turn; of those that lie below each other (passes, or a helix and its last turn) the deepest.

    `gap_mm` is how far centres and radii may differ, and how much of the way round may lack (a
    post may leave a rest that a line mends).
    """
    toolpath = cuts.toolpath
    level = toolpath.starts[:, 2] == toolpath.end[:, 2]
    arcs = np.flatnonzero(toolpath.is_arc & cuts.is_cut & level)
    if len(arcs) == 0:
        return []
    spoke = toolpath.starts[arcs, :2] - toolpath.centre[arcs]
    radius = np.hypot(spoke[:, 0], spoke[:, 1])
    breaks = (
        (np.diff(arcs) != 1)
        | (np.diff(cuts.contour[arcs]) != 0)
        | (np.diff(toolpath.kind[arcs]) != 0)
        | (np.abs(np.diff(toolpath.centre[arcs], axis=0)).max(axis=1) > gap_mm)
        | (np.abs(np.diff(radius)) > gap_mm)
    )
    first = np.concatenate([[0], np.flatnonzero(breaks) + 1])
    last = np.concatenate([first[1:], [len(arcs)]]) - 1
    way = np.abs(np.add.reduceat(toolpath.sweeps()[arcs], first)) * radius[first]
    full = np.flatnonzero(way >= 2.0 * np.pi * radius[first] - gap_mm)
    return _deepest(
        [
            _circle(toolpath, arcs[first[run] : last[run] + 1], float(radius[first[run]]))
            for run in full
        ],
        gap_mm,
    )


def _deepest(circles: list[Circle], gap_mm: float) -> list[Circle]:
    """Of circles one below the other the deepest, of equals all, in their order."""
    lowest: dict[tuple[object, ...], float] = {}
    keys = []
    for circle in circles:
        numbers = (*circle.centre_mm, circle.radius_mm)
        key = (circle.ccw, *(round(number / gap_mm) for number in numbers))
        lowest[key] = min(lowest.get(key, math.inf), circle.z_mm)
        keys.append(key)
    return [
        circle for circle, key in zip(circles, keys, strict=True) if circle.z_mm == lowest[key]
    ]


def _circle(toolpath: Toolpath, run: Ints, radius: float) -> Circle:
    row = int(run[0])
    return Circle(
        centre_mm=(float(toolpath.centre[row, 0]), float(toolpath.centre[row, 1])),
        radius_mm=radius,
        ccw=bool(toolpath.kind[row] == Kind.ARC_CCW),
        z_mm=float(toolpath.end[row, 2]),
        first_row=row,
        last_row=int(run[-1]),
    )


def circle_figures(bins: Floats, radius_mm: float) -> CircleFigures:
    """G, F max, F min and D of the bins (720, 9) of `camtool.kernels.circle_bins`."""
    seen = bins[bins[:, 0] > 0.0]
    if len(seen) < FEWEST_BINS:
        return UNSEEN
    mean = mean_points(seen)
    return CircleFigures(
        circular_mm=circular_error(seen),
        radial_max_mm=math.sqrt(seen[:, 6].max()) - radius_mm,
        radial_min_mm=math.sqrt(seen[:, 3].min()) - radius_mm,
        radial_mean_mm=float(np.hypot(mean[:, 0], mean[:, 1]).mean()) - radius_mm,
    )


def mean_points(seen: Floats) -> Floats:
    """(J, 2) about the programmed centre, of bins (J, 9) that are not empty."""
    return np.asarray(seen[:, 1:3] / seen[:, :1])


def circular_error(seen: Floats) -> float:
    """G of bins (J, 9) that are not empty, J ≥ 1; NaN where they do not go round the centre."""
    mean = mean_points(seen)
    if not _surrounds(mean):
        return math.nan
    centre = least_squares_centre(mean)
    inner, outer = seen[:, 4:6] - centre, seen[:, 7:9] - centre
    return float(np.hypot(*outer.T).max() - np.hypot(*inner.T).min())


def _surrounds(points: Floats) -> bool:
    """Whether points (J, 2) lie on all sides of the origin: none of the angles between them, as
    seen from there, is half a turn."""
    angle = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    return bool(np.diff(angle, append=angle[0] + 2.0 * np.pi).max() < np.pi)


def least_squares_centre(points: Floats) -> Floats:
    """Centre (2,) of the circle with the least sum of squared radial distances to points (J, 2).

    Gauss-Newton from the origin: with d = |p − c| and u = (p − c)/d, the residual d − R changes by
    −u·δc − δR, so each round solves the 3 × 3 normal equations of [u, 1] (δc, R) = d.
    The origin must lie inside the points.
    """
    centre = np.zeros(2)
    for _ in range(FIT_ROUNDS):
        spoke = points - centre
        distance = np.hypot(spoke[:, 0], spoke[:, 1])
        if not distance.all():
            break
        u, v = (spoke / distance[:, None]).T
        normal = np.array(
            [
                [(u * u).sum(), (u * v).sum(), u.sum()],
                [(u * v).sum(), (v * v).sum(), v.sum()],
                [u.sum(), v.sum(), float(len(u))],
            ]
        )
        right = np.array([(u * distance).sum(), (v * distance).sum(), distance.sum()])
        move = np.linalg.lstsq(normal, right, rcond=None)[0][:2]
        centre = centre + move
        if np.hypot(move[0], move[1]) < FIT_END_MM:
            break
    return centre
