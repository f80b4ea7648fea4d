"""Full circles of a toolpath, their figures by ISO 230-4, and their reversals.

On a programmed circle (centre c, radius R) the radius of the slides' path is recorded over the
angle in bins of half a degree (`camtool.kernels.judging`): for each bin the points with the
least and the largest radius and the mean point. Memory does not grow with the steps.

    F max, F min = largest, least |p − c| − R           (radial error, programmed centre)
    G            = largest − least |p − c'|              (circular error)
    D            = mean of |p − c| − R over the bins     (mean radial error)

c' is the centre of the least-squares circle through the mean points of the bins; all bins have the
same weight, as all angles have for a ball-bar. The extremes of a bin are found about c and used
about c'. With the centres e apart this is wrong by no more than e · 2π/720, 0.9 % of e."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.toolpath.moves import Kind, Toolpath
from camtool.verification.cuts import CutMoves

FIT_ROUNDS = 30
"""At most this many rounds for the least-squares centre, which converges in about four."""

FIT_END_MM = 1e-9
"""The least-squares centre is found when it moves by less than this."""

MIN_BINS = 3
"""Least number of bins: a circle has three unknowns."""


class FullCircle(Struct, frozen=True):
    """A full circle of a toolpath: centre (x, y) mm, radius mm, direction, first and last row."""

    centre_mm: tuple[float, float]
    radius_mm: float
    ccw: bool
    z_mm: float
    first_row: int
    last_row: int


class CircleFigures(Struct, frozen=True):
    """Figures of a circle, mm: NaN with fewer than three bins; G also where the slides do not go
    round the programmed centre, as with a backlash near the radius."""

    circular_mm: float
    radial_max_mm: float
    radial_min_mm: float
    radial_mean_mm: float


NO_FIGURES = CircleFigures(math.nan, math.nan, math.nan, math.nan)


def full_circles(cuts: CutMoves, gap_mm: float) -> list[FullCircle]:
    """Return the full circles of the cuts: runs of consecutive level arcs about one centre, in one
    direction, that make a full turn. Of circles below each other (passes, or a helix and its last
    turn) only the deepest is returned.

    `gap_mm`: by how much centres and radii may differ, and how much of the circumference may be
    missing (a writer may close an arc by a line)."""
    toolpath = cuts.toolpath
    arcs = np.flatnonzero(toolpath.is_arc & cuts.is_cut)
    arcs = arcs[toolpath.starts_of(arcs)[:, 2] == toolpath.end[arcs, 2]]
    if len(arcs) == 0:
        return []
    spoke = toolpath.starts_of(arcs)[:, :2] - toolpath.centre[arcs]
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
    length = np.abs(np.add.reduceat(toolpath.sweeps_of(arcs), first)) * radius[first]
    full_turns = np.flatnonzero(length >= 2.0 * np.pi * radius[first] - gap_mm)
    return _deepest(
        [
            _circle(toolpath, arcs[first[run] : last[run] + 1], float(radius[first[run]]))
            for run in full_turns
        ],
        gap_mm,
    )


def _deepest(circles: list[FullCircle], gap_mm: float) -> list[FullCircle]:
    """Return the deepest of the circles that lie below each other, in their order; several if they
    are equally deep."""
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


def _circle(toolpath: Toolpath, run: Ints, radius: float) -> FullCircle:
    row = int(run[0])
    return FullCircle(
        centre_mm=(float(toolpath.centre[row, 0]), float(toolpath.centre[row, 1])),
        radius_mm=radius,
        ccw=bool(toolpath.kind[row] == Kind.ARC_CCW),
        z_mm=float(toolpath.end[row, 2]),
        first_row=row,
        last_row=int(run[-1]),
    )


def circle_figures(bins: Floats, radius_mm: float) -> CircleFigures:
    """Return G, F max, F min and D, computed from the bins (720, 9) of
    `camtool.kernels.judging`."""
    filled = bins[bins[:, 0] > 0.0]
    if len(filled) < MIN_BINS:
        return NO_FIGURES
    smallest, largest = np.sqrt(filled[:, 3]), np.sqrt(filled[:, 6])
    # The points of a bin that is only partly covered span a shorter arc.
    mean = np.clip(mean_radii(bins)[bins[:, 0] > 0.0], smallest, largest)
    return CircleFigures(
        circular_mm=circular_error(filled),
        radial_max_mm=float(largest.max()) - radius_mm,
        radial_min_mm=float(smallest.min()) - radius_mm,
        radial_mean_mm=float(mean.mean()) - radius_mm,
    )


def mean_points(filled: Floats) -> Floats:
    """Return the mean points (J, 2) of bins (J, 9) that are not empty, relative to the programmed
    centre."""
    return np.asarray(filled[:, 1:3] / filled[:, :1])


def mean_radii(bins: Floats) -> Floats:
    """Return the mean radius (B,) in each of the bins (B, 9) of a whole turn, NaN for empty ones.
    The mean point of an arc of angle w lies at sin(w/2)/(w/2) of the radius, which is corrected
    for."""
    half = np.pi / len(bins)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = bins[:, 1:3] / bins[:, :1]
        return np.asarray(np.hypot(mean[:, 0], mean[:, 1]) * (half / math.sin(half)))


def circular_error(filled: Floats) -> float:
    """Return the circular error G from J ≥ 1 bins (J, 9) that are not empty; NaN if they do not
    surround the centre."""
    mean = mean_points(filled)
    if not _surrounds(mean):
        return math.nan
    centre = least_squares_centre(mean)
    inner, outer = filled[:, 4:6] - centre, filled[:, 7:9] - centre
    return float(np.hypot(*outer.T).max() - np.hypot(*inner.T).min())


def _surrounds(points: Floats) -> bool:
    """Return True if points (J, 2) surround the origin: every angle between neighbours is below
    π."""
    angle = np.sort(np.arctan2(points[:, 1], points[:, 0]))
    return bool(np.diff(angle, append=angle[0] + 2.0 * np.pi).max() < np.pi)


def least_squares_centre(points: Floats) -> Floats:
    """Return the centre (2,) of the circle with the least sum of squared radial distances to
    points (J, 2).

    Gauss-Newton from the origin: with d = |p − c| and u = (p − c)/d, the residual d − R changes by
    −u·δc − δR, so each round solves the 3 × 3 normal equations of [u, 1] (δc, R) = d. The origin
    must lie inside the points."""
    centre = np.zeros(2)
    for _ in range(FIT_ROUNDS):
        spoke = points - centre
        distance = np.hypot(spoke[:, 0], spoke[:, 1])
        if not distance.all():
            break
        terms = np.column_stack([spoke / distance[:, None], np.ones(len(points))])
        # Sums, not products of matrices, whose last digits may differ from run to run.
        normal = (terms[:, :, None] * terms[:, None, :]).sum(axis=0)
        right = (terms * distance[:, None]).sum(axis=0)
        move = np.linalg.lstsq(normal, right, rcond=None)[0][:2]
        centre = centre + move
        if np.hypot(move[0], move[1]) < FIT_END_MM:
            break
    return centre


# What a ball-bar shows of a circle: reversals, and both directions together.
#
# X reverses at 0° and 180°, Y at 90° and 270°. The error of an axis at its reversal lies along the
# radius there. From the mean radii of the bins of half a degree (`camtool.kernels.judging`):
#
# - the step at a reversal is the radius after it (in the direction of travel) less that before it,
#   each from a straight line through the bins of its side;
# - the spike is what exceeds both sides, outwards (+) or inwards;
# - the reversal value B of an axis is estimated from the whole circle: a slide that is off by ±B/2
#   depending on the direction of its axis changes the radius at the angle t by ∓B/2 |cos t| (X) or
#   |sin t| (Y), so the radii are fitted by least squares with
#
#       r = c + e_x cos t + e_y sin t + (B_x/2) d_x |cos t| + (B_y/2) d_y |sin t|,
#
#   d = −1 where the axis moves towards its outermost position, +1 after it.

QUADRANTS_DEG = (0, 90, 180, 270)
"""The angles at which X, Y, X and Y reverse."""

NEAR_BINS, FAR_BINS = 3, 15
"""A step is measured between 1.5° and 7.5° on either side, a spike within 1.5°."""

SAME_SHARE = 1e-3
"""Circles whose centres and radii differ by less than this share of the radius are the same
circle, cut twice."""


class ReversalFigures(Struct, frozen=True):
    """The reversals of a circle, mm: `step` and `spike` at 0°, 90°, 180° and 270°; the reversal
    `value` B of X and Y. NaN with too few bins."""

    step: tuple[float, float, float, float]
    spike: tuple[float, float, float, float]
    value: tuple[float, float]


class BidirectionalFigures(Struct, frozen=True):
    """A circle that is cut in both directions, mm: bi-directional circular error G(b) and mean
    bi-directional radial error D."""

    circle: FullCircle
    circular_mm: float
    radial_mean_mm: float


def reversal_figures(bins: Floats, ccw: bool) -> ReversalFigures:
    """Return the reversal figures of one circle, computed from its bins (B, 9) about the
    programmed centre."""
    radius = mean_radii(bins)
    with np.errstate(invalid="ignore"):
        smallest, largest = np.sqrt(bins[:, 3]), np.sqrt(bins[:, 6])
    steps, spikes = _steps(radius, smallest, largest, 1 if ccw else -1)
    return ReversalFigures(
        (steps[0], steps[1], steps[2], steps[3]),
        (spikes[0], spikes[1], spikes[2], spikes[3]),
        _values(radius, ccw),
    )


def _steps(
    radius: Floats, smallest: Floats, largest: Floats, turn: int
) -> tuple[list[float], list[float]]:
    """Return the step and the spike of the radius at each angle of `QUADRANTS_DEG` (the lower edge
    of a bin); `turn`: +1 if the angle grows along the circle, else −1."""
    count = len(radius)
    edge_bins = (np.array(QUADRANTS_DEG) * count // 360)[:, None]
    reach = np.arange(NEAR_BINS, FAR_BINS)
    # The line through the bins of a side by least squares, at the edge, which is a sum of them.
    centred = reach + 0.5 - (reach + 0.5).mean()
    weights = 1.0 / len(centred) - (reach + 0.5).mean() * centred / (centred * centred).sum()
    high, low = (
        (radius[(edge_bins + rows) % count] * weights).sum(axis=1) for rows in (reach, -1 - reach)
    )
    near_bins = (edge_bins + np.arange(-NEAR_BINS, NEAR_BINS)) % count
    is_filled = np.isfinite(largest[near_bins])
    outward = np.where(is_filled, largest[near_bins], -np.inf).max(axis=1) - np.maximum(high, low)
    inward = np.minimum(high, low) - np.where(is_filled, smallest[near_bins], np.inf).min(axis=1)
    spike = np.where(outward >= inward, np.maximum(outward, 0.0), -np.maximum(inward, 0.0))
    is_finite = np.isfinite(high) & np.isfinite(low)
    step = np.where(is_finite, turn * (high - low), np.nan)
    return step.tolist(), np.where(is_finite, spike, np.nan).tolist()


def _values(radius: Floats, ccw: bool) -> tuple[float, float]:
    """Return the reversal values B of X and Y by least squares; NaN if less than half of the bins
    are filled."""
    is_filled = np.isfinite(radius)
    if is_filled.sum() < len(radius) // 2:
        return math.nan, math.nan
    table = _terms(len(radius), 1.0 if ccw else -1.0)
    solution = np.linalg.lstsq(table[is_filled], radius[is_filled], rcond=None)[0]
    return float(solution[3]), float(solution[4])


@cache
def _terms(count: int, turn: float) -> Floats:
    """Return (B, 5): the change of the radius in each of `count` bins for one unit of c, e_x, e_y,
    B_x and B_y."""
    angle = (np.arange(count) + 0.5) * (2.0 * np.pi / count)
    cos, sin = np.cos(angle), np.sin(angle)
    # With growing angles, sin > 0 after 0°, and cos < 0 after 90°.
    x = turn * np.sign(sin) * cos
    y = -turn * np.sign(cos) * sin
    terms = np.column_stack([np.ones(count), cos, sin, 0.5 * x, 0.5 * y])
    terms.flags.writeable = False
    return terms


class CirclePairs:
    """Pairs of circles cut clockwise and counterclockwise about one centre. Only the bins of the
    first are kept, and only until the second is done."""

    def __init__(self, circles: Sequence[FullCircle]) -> None:
        """Pair each counterclockwise circle with the first clockwise one that has no
        partner yet."""
        self._circles = circles
        self._partner: dict[int, int] = {}
        self._waiting: dict[int, Floats] = {}
        if not circles:
            return
        table = np.array([(*one.centre_mm, one.radius_mm) for one in circles])
        is_free = np.array([not one.ccw for one in circles])
        for first, one in enumerate(circles):
            if one.ccw and is_free.any():
                differences = np.abs(table - table[first]).max(axis=1)
                for second in np.flatnonzero(
                    is_free & (differences <= SAME_SHARE * one.radius_mm)
                )[:1]:
                    is_free[second] = False
                    self._partner[first], self._partner[int(second)] = int(second), first

    def partner(self, circle: int) -> int | None:
        """Return the other circle of the pair; None for a circle without a partner."""
        return self._partner.get(circle)

    def add(self, circle: int, bins: Floats) -> list[BidirectionalFigures]:
        """Add the bins of a circle; return the figures of its pair in a list if the partner was
        added before, else []."""
        partner = self._partner.get(circle)
        if partner is None:
            return []
        if partner not in self._waiting:
            self._waiting[circle] = bins.copy()
            return []
        return [
            bidirectional_figures(
                self._circles[circle], np.concatenate([self._waiting.pop(partner), bins])
            )
        ]


def bidirectional_figures(circle: FullCircle, bins: Floats) -> BidirectionalFigures:
    """Return the figures of a circle cut in both directions, from the bins (2 B, 9) of both; NaN
    without points."""
    filled = bins[bins[:, 0] > 0.0]
    if len(filled) == 0:
        return BidirectionalFigures(circle, math.nan, math.nan)
    mean_radius = np.hypot(*mean_points(filled).T).mean()
    return BidirectionalFigures(
        circle, circular_error(filled), float(mean_radius) - circle.radius_mm
    )
