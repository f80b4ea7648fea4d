"""Clear a band along a line in circles, so that the tool's engagement never exceeds a limit.

A disc of tool centres of radius ρ is moved along a line, step by step. Where the disc before it is
cleared, the tool cuts on the part of the circle that is outside of that disc, half of it and a
little more, and returns through the disc on a shorter way. The engagement follows from the step as
that of the fronts of `camtool.planning.adaptive` (`front_step`), wherever the line leads: it is a
matter of two discs.

    line ─cut at its corners, stepped─▶ middles ─helix, spiral, part circles and links─▶ legs
    band without what these have cleared ─fronts─▶ legs of corners, and of what is wider

Between two circles a cusp stays beside each edge of the band (`cusp_mm`), as high as s² / (8 ρ) on
a straight line for the step s. The fronts count on no more than is cleared within the cusps."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from camtool.arrays import Floats
from camtool.errors import GeometryError
from camtool.geometry.nesting import inside
from camtool.geometry.offset import swept_outline
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.planning.adaptive import (
    CORNER_TURN_RAD,
    AdaptiveStays,
    adaptive_legs,
    rest_stays,
    spiral,
)
from camtool.planning.paths import MeasuredPath
from camtool.planning.strokes import (
    PLANNED_SHARE,
    Leg,
    arc_rows,
    ends_of,
    front_step,
    tangent_link,
)

MAX_STEP_SHARE = 0.7
"""Circles are no farther apart than this part of their radius."""

LINK_SHARE = 0.5
"""Radius of the arcs at both ends of a way back, over that of the circles."""

MIN_BACK_RAD = 0.25 * math.pi
"""Angle, seen from the circle's centre, below which a way back stays on the circle."""

SWEPT_SHARES = (0.0, 1e-6, 1e-5, 1e-4, 1e-3)
"""Shares by which a band is taken narrower, in turn, if rounding hides its outline."""


def trochoid_step(radius_mm: float, tool_mm: float, limit: float) -> float:
    """Return the distance between the centres of successive circles, mm, that keeps the limit of
    engagement."""
    step = front_step(PLANNED_SHARE * limit, radius_mm, tool_mm)
    return min(step, MAX_STEP_SHARE * radius_mm)


def cusp_mm(radius_mm: float, tool_mm: float, limit: float) -> float:
    """Return an upper bound of how far cusps reach into the band of the circles, mm: twice their
    height along a straight line, since lines may be curved."""
    return trochoid_step(radius_mm, tool_mm, limit) ** 2 / (4.0 * radius_mm)


def band_of(lines: Polylines, half_mm: float) -> Polylines:
    """Return the region within a distance of lines; GeometryError if it cannot be determined."""
    for share in SWEPT_SHARES:
        outline = swept_outline(lines, (1.0 - share) * half_mm)
        if outline is not None:
            return outline
    raise GeometryError(f"the outline of a band of {2.0 * half_mm:.4g} mm is not clear")


def middles(line: Polyline, radius_mm: float, step_mm: float) -> Floats:
    """Return (N, 2) the centres of circles along a line: at its corners, and at steps between
    these; the steps are shorter where the line turns on arcs smaller than the circles, since cusps
    are higher there."""
    along = MeasuredPath.of(line)
    corners = along.reach[np.flatnonzero(np.abs(along.turns) > CORNER_TURN_RAD)]
    marks = np.unique(np.concatenate([[0.0, along.total_mm], corners]))
    radii = np.where(along.segments.is_arc, along.segments.radius, np.inf)
    weights = np.maximum(np.sqrt(0.5 * (1.0 + radius_mm / radii)), 1.0)
    steps = np.concatenate([[0.0], np.cumsum(np.diff(along.reach) * weights)]) / step_mm
    lengths = [np.zeros(1)]
    for low, high in pairwise(np.interp(marks, along.reach, steps).tolist()):
        count = max(1, math.ceil(high - low - 1e-9))
        ends = low + (high - low) * np.arange(1, count + 1) / count
        lengths.append(np.interp(ends, steps, along.reach))
    places = along.at(np.concatenate(lengths))
    return places[:-1] if line.closed else places


def trochoid_legs(
    line: Polyline, radius_mm: float, helix_mm: float, tool_mm: float, limit: float
) -> tuple[Floats, list[Leg]]:
    """Return the place (2,) where a helix goes down, and the legs of the circles along a line from
    there."""
    places = middles(line, radius_mm, trochoid_step(radius_mm, tool_mm, limit))
    legs = [Leg(spiral(places[0], helix_mm, radius_mm, tool_mm, limit))]
    for before, place in pairwise(places):
        ahead = place - before
        heading, step = math.atan2(ahead[1], ahead[0]), math.hypot(*ahead)
        half = math.acos(-0.5 * step / radius_mm)
        begin = place + radius_mm * np.array([math.cos(heading - half), math.sin(heading - half)])
        end = place + radius_mm * np.array([math.cos(heading + half), math.sin(heading + half)])
        if len(legs) == 1:  # as far round as circles end
            legs += _round(legs[0], before, end - ahead)
        cut = np.array([*arc_rows(begin, place, 2.0 * half, 1), [*end, 0.0]])
        legs += [*_back(legs[-1], before, cut, radius_mm), Leg(cut)]
    return places[0], legs


def _round(leg: Leg, centre: Floats, end: Floats) -> list[Leg]:
    """Return the CCW arc about a centre from the end of a leg to the point `end` of the circle, in
    a list; [] if the leg ends there already."""
    begin = leg.vertices[-1, :2]
    sweep = _angle(end - centre) - _angle(begin - centre)
    rows = arc_rows(begin, centre, sweep % math.tau, 1)
    return [Leg(np.array([*rows, [*end, 0.0]]), cuts=False)] if rows else []


def _back(leg: Leg, centre: Floats, cut: Floats, radius_mm: float) -> list[Leg]:
    """Return the way within the cleared disc from the end of a leg to the next cut: a tangent
    link, or an arc of the circle if the way is too short for that."""
    start, end = ends_of(leg.vertices)[1], ends_of(cut)[0]
    sweep = _angle(cut[0, :2] - centre) - _angle(leg.vertices[-1, :2] - centre)
    if sweep % math.tau >= MIN_BACK_RAD:
        link = tangent_link(start, end, LINK_SHARE * radius_mm, (1, 1))
        if link is not None:
            return [Leg(link, cuts=False)]
    return _round(leg, centre, cut[0, :2])


def _angle(arm: Floats) -> float:
    return math.atan2(arm[1], arm[0])


def trochoid_stays(
    region: Polylines,
    lines: Polylines,
    radius_mm: float,
    helix_mm: float,
    tool_mm: float,
    limit: float,
) -> list[AdaptiveStays]:
    """Return the stays that clear a connected tool centre region: circles along those of the lines
    that lie in it, and fronts for what they leave. [] if the region has no room."""
    starts = lines.vertices[lines.offsets[:-1], :2]
    rows: list[int] = []
    if len(lines):
        rows = np.flatnonzero(inside(starts, Segments.of(region))).tolist()
    if not rows:
        return [adaptive_legs(region, helix_mm, tool_mm, limit)]
    own_lines = lines.select(rows)
    helix_mm = min(helix_mm, radius_mm)
    chains = [trochoid_legs(line, radius_mm, helix_mm, tool_mm, limit) for line in own_lines]
    legs = [leg for _, each in chains for leg in each]
    opening = radius_mm - cusp_mm(radius_mm, tool_mm, limit)
    rest = rest_stays(region, band_of(own_lines, opening), opening, legs, tool_mm, limit)
    centre, last = chains[-1]
    stays = [AdaptiveStays(middle, helix_mm, [each]) for middle, each in chains[:-1]]
    return [*stays, AdaptiveStays(centre, helix_mm, [[*last[:-1], *rest[0]], *rest[1:]])]
