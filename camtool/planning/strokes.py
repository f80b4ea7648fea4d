"""Strokes and links of adaptive pockets: their geometry, and the steps that a limit allows."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.geometry.measure import Frames, point_at
from camtool.geometry.polylines import POSITION_EPS_MM, Segments

NARROW_RATIO = 0.93
"""Each opening disc in a corner is at least this part of the one before it."""

MAX_RATIO = 0.985
"""No disc is nearer in size to the one before it: sharper corners exceed the limit."""

RATIO_SHARE = 0.5
"""Discs shrink by this part of what a corner of straight walls allows: walls may be curved, and in
corners smaller than a hundred steps of the slides these go beside the path."""

PLANNED_SHARE = 0.98
"""Steps follow from this part of the limit, since strokes are smoothed."""

ARC_PLACES = 33
STEP_HALVINGS = 30
"""Places of an arc at which its engagement is computed, and halvings of the step."""

SAGITTA_SHARE = 1e-3
"""Chords of arcs, on which engagement is judged, are within this part of the tool's radius."""

THICK_SHARE = 4e-3
THICK_OF_STEP = 0.2
"""Chips thinner than the first part of the tool's radius are no engagement, nor those thinner than
the second part of the step beside a straight wall, whichever is less."""


def thick_share(limit_rad: float) -> float:
    """Return the thickness, as a share of the tool's radius, up to which chips do not count where
    the engagement has this limit; 0: none."""
    step = 1.0 - math.cos(limit_rad)
    return min(THICK_SHARE, THICK_OF_STEP * step) if limit_rad else THICK_SHARE


def step_for(engagement_rad: float, opening_mm: float, radius_mm: float) -> float:
    """Return the step mm at which a tool of this radius is engaged by the angle beside a cleared
    disc of centres: the root of  (ρ + s)² + 2 r cos φ (ρ + s) = (ρ + r)² − r²."""
    k = radius_mm * math.cos(engagement_rad)
    return math.sqrt(k * k + opening_mm * (opening_mm + 2.0 * radius_mm)) - k - opening_mm


def front_step(engagement_rad: float, opening_mm: float, radius_mm: float) -> float:
    """Return the step mm of fronts that begin at a wall in an arc of the opening's radius.

    That arc is the one of the front before, pushed on by the step s. At the angle α from where it
    is pushed to, it leaves the cleared disc at the angle δ,  sin δ = s sin α / D,  where D is its
    distance from the middle of that: the tool turns towards the stock by δ, which adds to φ.
    """
    angle = np.linspace(0.0, 0.5 * math.pi, ARC_PLACES)
    low, high = 0.0, step_for(engagement_rad, opening_mm, radius_mm)
    reach = opening_mm + radius_mm
    for _ in range(STEP_HALVINGS):
        step = 0.5 * (low + high)
        far = np.hypot(step + opening_mm * np.cos(angle), opening_mm * np.sin(angle))
        cosine = (reach**2 - far**2 - radius_mm**2) / (2.0 * radius_mm * far)
        engaged = np.arccos(np.clip(cosine, -1.0, 1.0))
        askew = np.arcsin(np.minimum(step * np.sin(angle) / far, 1.0))
        fits = float((engaged + np.minimum(askew, engaged)).max()) <= engagement_rad
        low, high = (step, high) if fits else (low, step)
    return low


def corner_ratio(
    engagement_rad: float, opening_mm: float, radius_mm: float, corner_rad: float
) -> float:
    """Return the smallest opening disc, over the one before it, whose arc between two straight
    walls engages the tool by no more than the angle after that of the larger disc.

    Both arcs touch both walls. At the angle α from the bisector the smaller one is D away from the
    middle of the larger disc, and leaves it at the angle δ,  sin δ = g sin α / D,  where g is the
    distance of the middles; this adds to the engagement, as in `front_step`.
    """
    half = 0.5 * corner_rad
    angle = np.linspace(0.0, 0.5 * math.pi - half, ARC_PLACES)
    low, high = 0.0, 1.0
    for _ in range(STEP_HALVINGS):
        ratio = 0.5 * (low + high)
        gap, small = (1.0 - ratio) * opening_mm / math.sin(half), ratio * opening_mm
        far = np.hypot(gap + small * np.cos(angle), small * np.sin(angle))
        cosine = ((opening_mm + radius_mm) ** 2 - far**2 - radius_mm**2) / (2.0 * radius_mm * far)
        engaged = np.arccos(np.clip(cosine, -1.0, 1.0))
        askew = np.arcsin(np.minimum(gap * np.sin(angle) / far, 1.0))
        fits = float((engaged + np.minimum(askew, engaged)).max()) <= engagement_rad
        low, high = (low, ratio) if fits else (ratio, high)
    return high


def next_in_corner(opening_mm: float, tool_mm: float, limit: float, corner_rad: float) -> float:
    """Return the radius of the next smaller disc in a corner of straight walls."""
    ratio = corner_ratio(PLANNED_SHARE * limit, opening_mm, tool_mm, corner_rad)
    return min(max(NARROW_RATIO, 1.0 - RATIO_SHARE * (1.0 - ratio)), MAX_RATIO) * opening_mm


def _segments_of(vertices: Floats) -> Segments:
    """Return the segments of an open path (n, 3) that planning made: it is not checked again."""
    return Segments.between(vertices[:-1, :2], vertices[1:, :2], vertices[:-1, 2])


def chord_rows(vertices: Floats, sagitta_mm: float) -> tuple[Segments, Ints, Ints]:
    """Return the segments of an open path (n, 3), of how many chords each of them consists within
    a distance (n − 1,), and the segment of each chord (K,)."""
    path = _segments_of(vertices)
    radius = np.where(path.is_arc, path.radius, np.inf)
    angle = 2.0 * np.arccos(1.0 - np.minimum(sagitta_mm / np.maximum(radius, 1e-9), 1.0))
    sweep = np.where(path.is_arc, np.abs(path.sweep), 0.0)
    count = np.maximum(np.ceil(sweep / np.maximum(angle, 1e-9)), 1.0).astype(np.int64)
    return path, count, np.repeat(np.arange(len(path)), count)


def chords(vertices: Floats, sagitta_mm: float) -> Floats:
    """Return (K, 4) x, y to x, y of an open path (n, 3), arcs as chords within a distance."""
    return _chords_of(*chord_rows(vertices, sagitta_mm))


def _chords_of(path: Segments, count: Ints, row: Ints) -> Floats:
    """Return (K, 4) x, y to x, y of chords: of how many each segment consists (n − 1,), and the
    segment of each (K,)."""
    step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    begin = point_at(path, row, step / count[row])
    end = np.concatenate([begin[1:], path.end[-1:]])
    return np.column_stack([begin, end])


class Pose(Struct, frozen=True, eq=False):
    """A place of the tool's centre (x, y) and its direction, rad."""

    x: float
    y: float
    angle: float


def ends_of(vertices: Floats) -> tuple[Pose, Pose]:
    """Return the poses at the beginning and the end of an open path (n, 3)."""
    frames = Frames.of(_segments_of(vertices))
    first, last = (
        frames.tangent_at(np.zeros(len(vertices) - 1))[0],
        frames.tangent_at(np.ones(len(vertices) - 1))[-1],
    )
    return (
        Pose(vertices[0, 0], vertices[0, 1], math.atan2(first[1], first[0])),
        Pose(vertices[-1, 0], vertices[-1, 1], math.atan2(last[1], last[0])),
    )


def tangent_link(start: Pose, end: Pose, radius: float, turns: tuple[int, int]) -> Floats | None:
    """Return (k, 3) an arc, a line and an arc, all tangent, from pose to pose; `turns`: 1 for a
    left turn and −1 for a right one, at either end. None where circles that turn differently
    overlap."""
    one, other = turns
    c0 = np.array([start.x, start.y]) + radius * one * left_of(start.angle)
    c1 = np.array([end.x, end.y]) + radius * other * left_of(end.angle)
    gap = c1 - c0
    distance = math.hypot(*gap)
    if one == other:
        heading = math.atan2(gap[1], gap[0]) if distance > POSITION_EPS_MM else start.angle
    else:
        if distance < 2.0 * radius:
            return None
        heading = math.atan2(gap[1], gap[0]) + one * math.asin(2.0 * radius / distance)
    leave = c0 - radius * one * left_of(heading)
    arrive = c1 - radius * other * left_of(heading)
    rows = [
        *arc_rows(
            np.array([start.x, start.y]), c0, (one * (heading - start.angle)) % math.tau, one
        ),
        np.array([*leave, 0.0]),
        *arc_rows(arrive, c1, (other * (end.angle - heading)) % math.tau, other),
        np.array([end.x, end.y, 0.0]),
    ]
    vertices = np.array(rows)
    keep = np.append(np.hypot(*np.diff(vertices[:, :2], axis=0).T) > POSITION_EPS_MM, True)
    vertices = vertices[keep]
    vertices[0, :2] = start.x, start.y
    return vertices if len(vertices) > 1 else None


def arc_rows(begin: Floats, centre: Floats, sweep: float, turn: int) -> list[Floats]:
    """Return the vertices (x, y, bulge) of an arc without its end, in parts of half a circle at
    most."""
    if sweep > math.tau - 1e-6 or sweep < 1e-9:
        return []
    parts = max(1, math.ceil(sweep / math.pi))
    arm = begin - centre
    rows = []
    for part in range(parts):
        angle = turn * sweep * part / parts
        c, s = math.cos(angle), math.sin(angle)
        place = centre + np.array([c * arm[0] - s * arm[1], s * arm[0] + c * arm[1]])
        rows.append(np.array([*place, turn * math.tan(0.25 * sweep / parts)]))
    return rows


def left_of(angle: float) -> Floats:
    """Return the unit vector (2,) to the left of a direction, rad."""
    return np.array([-math.sin(angle), math.cos(angle)])


class Leg(Struct, frozen=True, eq=False):
    """An open path (n, 3) of the tool's centre; `cuts` is False for links through air."""

    vertices: Floats
    cuts: bool = True


def moves_of(vertices: Floats, tool_mm: float, sagitta_mm: float) -> Floats:
    """Return (K, 9) the moves of an open path, as `camtool.kernels.engagement` wants them."""
    ends = chords(vertices, sagitta_mm)
    radius, flat = np.full((len(ends), 1), tool_mm), np.zeros((len(ends), 4))
    return np.concatenate([ends, radius, flat], axis=1)


def moves_along(vertices: Floats, tool_mm: float) -> tuple[Floats, Ints]:
    """Return the chords of an open path as moves (K, 9), each with the angles to the path's
    direction at its ends, and the line or arc (K,) that each is a part of."""
    path, count, row = chord_rows(vertices, SAGITTA_SHARE * tool_mm)
    half = 0.5 * (np.where(path.is_arc, path.sweep, 0.0) / count)[row]
    flat = np.column_stack([np.full(len(row), tool_mm), np.zeros((len(row), 2)), -half, half])
    return np.concatenate([_chords_of(path, count, row), flat], axis=1), row
