"""The pieces of a carved region: where the tip of a V bit runs, at the radius that it cuts.

A disc of radius ρ in the region is what a cone cuts at the surface when its tip is as deep as ρ
asks. `grooves` are stretches of the medial axis with low ≤ ρ ≤ high; where discs are larger than
`high`, the `walls` run beside the boundary at that distance. Together they are where the middle
of the largest disc allowed runs when it rolls along the boundary.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import signed_area
from camtool.geometry.medial import HALVINGS, Boundary, Trace, concatenated, discs_at, off_chord
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Polyline

LEVEL_EPS_MM = 1e-9
"""A radius nearer than this to a limit is the limit: rounding, along walls that are parallel."""

FIT_SHARE = 0.75
"""Share of the tolerance for lines and arcs through samples of the axis; what lies between the
samples takes less than the rest."""

FEWEST_FOR_ARC = 5
"""An arc is laid through three of at least so many samples."""

LEAST_SWEEP_RAD = 1e-4
"""What turns less is no arc: its centre would lie too far off to be counted with."""

MOST_SWEEP_RAD = 2.0
"""An arc of the axis that turns farther is divided."""


@dataclass(frozen=True)
class Band:
    """Radii mm from `low` to `high`, what the pass before has left and what this one may cut; and
    the tolerance, mm."""

    low_mm: float
    high_mm: float
    tolerance_mm: float


def with_level(boundary: Boundary, trace: Trace, level_mm: float) -> Trace:
    """The trace with a row of exactly this radius wherever the radius passes it."""
    near = np.abs(trace.rho - level_mm) <= LEVEL_EPS_MM
    trace = _with_radius(trace, np.where(near, level_mm, trace.rho))
    above = np.sign(trace.rho - level_mm)
    same = trace.element[1:] == trace.element[:-1]
    at = np.flatnonzero(same & (above[1:] * above[:-1] < 0.0))
    guess = np.column_stack([trace.partner[at], trace.partner[at + 1]])
    low, high = trace.t[at].copy(), trace.t[at + 1].copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        rho = discs_at(boundary, trace.element[at], middle, guess).rho
        is_low = np.sign(rho - level_mm) == above[at]
        low, high = np.where(is_low, middle, low), np.where(is_low, high, middle)
    found = discs_at(boundary, trace.element[at], low, guess)
    both = concatenated([trace, _with_radius(found, np.full(len(at), level_mm))])
    return both.rows(np.lexsort((both.t, both.element)))


def _with_radius(trace: Trace, rho: Floats) -> Trace:
    return Trace(trace.element, trace.t, trace.x, trace.y, rho, trace.partner, trace.u)


def grooves(trace: Trace, band: Band) -> list[Floats]:
    """Pieces (n, 4) of x, y, rho, bulge: the axis within the band, each stretch once; an arc
    whose radius changes changes it evenly along its sweep.

    `trace` has rows at both limits of the band.
    """
    rho = trace.rho
    least, most = np.minimum(rho[1:], rho[:-1]), np.maximum(rho[1:], rho[:-1])
    same = (trace.element[1:] == trace.element[:-1]) & (trace.partner[1:] == trace.partner[:-1])
    # Every stretch is seen from both its sides: from the first one it is taken.
    own = trace.element[1:] < trace.partner[1:]
    wanted = same & own & (least >= band.low_mm) & (most <= band.high_mm) & (most > band.low_mm)
    tolerance = FIT_SHARE * band.tolerance_mm
    return [_fitted(trace.discs[i : j + 1], tolerance) for i, j in _stretches(trace, wanted)]


def walls(boundary: Boundary, trace: Trace, high_mm: float) -> list[Floats]:
    """Pieces (2, 4) of x, y, rho, bulge beside the boundary where discs are larger than high."""
    rho = trace.rho
    least, most = np.minimum(rho[1:], rho[:-1]), np.maximum(rho[1:], rho[:-1])
    same = trace.element[1:] == trace.element[:-1]
    wanted = same & (least >= high_mm) & (most > high_mm)
    return [
        _wall(boundary, int(trace.element[i]), (float(trace.t[i]), float(trace.t[j])), high_mm)
        for i, j in _stretches(trace, wanted, partners=False)
    ]


def floor_area(pieces: list[Floats]) -> float:
    """Area within the walls, mm²: they run round it with the floor on their left."""
    total = 0.0
    for piece in pieces:
        (ax, ay, _, bulge), (bx, by, _, _) = piece.tolist()
        total += 0.5 * (ax * by - ay * bx)
        if bulge != 0.0 and math.hypot(bx - ax, by - ay) > POSITION_EPS_MM:
            lens = Polyline(np.array([[ax, ay, bulge], [bx, by, 0.0]]), closed=True)
            total += signed_area(lens)
    return total


def _stretches(trace: Trace, wanted: Bools, partners: bool = True) -> list[tuple[int, int]]:
    """First and last rows of the runs of wanted gaps, within an element (and one partner)."""
    joined = wanted[1:] & wanted[:-1] & (trace.element[2:] == trace.element[:-2])
    if partners:
        joined &= trace.partner[2:] == trace.partner[:-2]
    first = np.flatnonzero(wanted & ~np.append(False, joined))
    last = np.flatnonzero(wanted & ~np.append(joined, False))
    return list(zip(first.tolist(), (last + 1).tolist(), strict=True))


def _wall(
    boundary: Boundary, element: int, part: tuple[float, float], distance_mm: float
) -> Floats:
    """What runs beside a part of an element: a line, or an arc of the same sweep."""
    from camtool.kernels.discs import SWEEP, frame

    rows = []
    for t in part:
        x, y, nx, ny = frame(boundary.table, element, t)
        rows.append([x + distance_mm * nx, y + distance_mm * ny, distance_mm, 0.0])
    rows[0][3] = float(np.tan(0.25 * (part[1] - part[0]) * boundary.table[element, SWEEP]))
    return np.array(rows)


def _fitted(discs: Floats, tolerance_mm: float) -> Floats:
    """Lines and arcs through some of the discs (n, 3), all others within the tolerance."""
    pieces, waiting = [], [(0, len(discs) - 1)]
    while waiting:
        i, j = waiting.pop()
        bulge = _bulge(discs[i : j + 1], tolerance_mm)
        if bulge is None:
            middle = (i + j) // 2
            waiting += [(middle, j), (i, middle)]
        else:
            pieces.append([*discs[i], bulge])
    return np.array([*pieces, [*discs[-1], 0.0]])


def _bulge(discs: Floats, tolerance_mm: float) -> float | None:
    """The bulge of the line (0) or arc that stands for these discs; None if neither does."""
    inner = discs[1:-1]
    begin, end = discs[:1], discs[-1:]
    if len(inner) == 0 or off_chord(inner, begin, end).max() <= tolerance_mm:
        return 0.0
    if len(discs) < FEWEST_FOR_ARC:
        return None
    # The arc through begin, a point P and end turns by 2·(π − angle at P); bulge = tan(turn / 4).
    middle = discs[len(discs) // 2, :2]
    to_begin, to_end = begin[0, :2] - middle, end[0, :2] - middle
    across = to_begin[0] * to_end[1] - to_begin[1] * to_end[0]
    sweep = 2.0 * (np.pi - abs(np.arctan2(across, to_begin @ to_end)))
    if not LEAST_SWEEP_RAD <= sweep <= MOST_SWEEP_RAD:
        return None
    bulge = float(np.copysign(np.tan(0.25 * sweep), -across))
    return bulge if _off_arc(inner, begin[0], end[0], bulge) <= tolerance_mm else None


def _off_arc(inner: Floats, begin: Floats, end: Floats, bulge: float) -> float:
    """How far discs lie from an arc along which the radius changes evenly with the sweep."""
    chord = end[:2] - begin[:2]
    turned = np.array([-chord[1], chord[0]])
    centre = 0.5 * (begin[:2] + end[:2]) + (1.0 - bulge**2) / (4.0 * bulge) * turned
    arm, first = inner[:, :2] - centre, begin[:2] - centre
    angle = np.arctan2(first[0] * arm[:, 1] - first[1] * arm[:, 0], arm @ first)
    part = np.clip(angle / (4.0 * np.arctan(bulge)), 0.0, 1.0)
    radius = begin[2] + part * (end[2] - begin[2])
    aside = np.abs(np.hypot(arm[:, 0], arm[:, 1]) - np.hypot(*first))
    return float((aside + np.abs(inner[:, 2] - radius)).max())
