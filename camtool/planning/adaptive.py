"""Clear a pocket so that the tool's engagement never exceeds a limit.

    tool centre region ─what is air, or a disc at its pole, widened by a spiral─▶ cleared centres
      ─grown by a step, kept in the region, opened by a disc─▶ fronts, one beyond the other
      ─cut at concave corners, in an order in which each finds those before it cut─▶ strokes
      ─joined within what is cleared by arcs and lines, all tangent─▶ paths

The *cleared centres* V are the places of the tool's centre so far. The next front is the boundary
of V grown by a step s, as far as it lies in the tool centre region, opened by a disc of radius ρ
(all discs of that radius that fit in). So V is always a union of discs ρ, and has no outer corner
sharper than ρ: at walls fronts end in arcs that are tangent to the wall.

What is air at the beginning may lie beyond the tool centre region: there are discs, and no tool.

With a disc ρ of centres cleared, all within ρ + r of its centre is air. A tool of radius r whose
centre is s beyond that disc has material only within the angle φ of the direction away from it,

    cos φ = ((ρ + r)² − (ρ + s)² − r²) / (2 r (ρ + s)),

so a front s beyond V engages at most φ, and s follows from the limit (`front_step`). First ρ is as
large as the region allows, for wide steps; when nothing grows any more, ρ shrinks by RATIO (in
corners by what they allow), and fronts go on into narrower places and corners, down to the radius
that leaves no more than the tolerance in a square corner.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import islice, pairwise, product

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.errors import OptionError
from camtool.geometry.boxes import IndexedCurves
from camtool.geometry.curves import FunctionCurve
from camtool.geometry.distance import points_to_segments
from camtool.geometry.fit import fit_curve, fit_path
from camtool.geometry.measure import (
    Frames,
    length,
    path_extents,
    point_at,
    sample,
    signed_areas,
)
from camtool.geometry.nesting import inside
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments, reverse
from camtool.kernels.engagement import Cleared
from camtool.kernels.offsets import insides, meetings_of, pairs_of
from camtool.planning.clearing import outside_parts, parts_of, pole
from camtool.planning.items import CutRun, Setting
from camtool.planning.job import Operation
from camtool.planning.naming import key_of
from camtool.planning.paths import MeasuredPath
from camtool.planning.ramps import feeds_along, helix
from camtool.planning.strategies import STRATEGIES
from camtool.planning.thin_chips import feed_levels, thin_chip_feeds
from camtool.progress import tell_share

NO_AIR = Polylines.of([])

HELIX_SHARE = 0.5
"""Default of the radius of the helix, over the tool's radius."""

MIN_HELIX_MM = 1e-3
MIN_ROOM_SHARE = 0.02
"""No helix is made in regions with less room than this, and this part of the tool's radius."""

CORNER_SHARE = 0.02
"""The smallest opening disc, over the tool's radius: it leaves 0.41 of that in a square corner."""

RATIO = 0.75
"""Each opening disc is at least this part of the one before it, ..."""

NARROW_RATIO = 0.93
"""... and this part of it where they are smaller than the tool."""

MIN_CORNER_RAD = math.radians(10.0)
"""Walls that meet at a smaller angle are taken as parallel."""

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

FIRST_SHARE = 0.9
"""The first opening disc is this part of the largest that fits."""

UNION_MM = 2.0 * POSITION_EPS_MM
"""Regions that are nearer to each other than twice this are one."""

AIR_SLACK_SHARE = 1e-3
"""Air counts as wider by this part of the tool's radius: along walls that two operations have in
common no stroke is left."""

MAX_FRONTS = 20_000

MIN_GROWTH_SHARE = 1e-4
"""A front that adds less than this part of the opening disc, or the tool's, is none."""

SPIRAL_SLOPES = 1.5
"""The limit is lower in a spiral by so many times its slope: half circles slope unevenly."""

SPECK_SHARE = 5e-3
"""Pieces of fronts shorter than this part of the tool's radius are left out."""

FIT_SHARE = 2e-4
FIT_OPENINGS = 10.0
"""Strokes are smoothed within this part of the tool's radius, and of so many opening radii where
that is less; they keep so far from walls."""

SMOOTH_VERTICES, SMOOTH_FITS, SMOOTH_TURN_RAD = 8, 10.0, 1e-4
"""Strokes of no more vertices than the first, none of them nearer to the next than so many times
that, stay as they are if no joint turns by more than the angle."""

CORNER_TURN_RAD = 0.02
"""Fronts are cut where they turn towards the stock by more."""

SAGITTA_SHARE = 1e-3
"""Chords of arcs, on which engagement is judged, are within this part of the tool's radius."""

AIR_SHARE = 0.5
"""A link may touch the stock with this part of the limit: at both ends it runs beside it."""

LINK_SHARES = (0.9, 0.45, 0.2)
"""Radii of links that are tried, over that of the discs that fit on the left of a stroke, or the
tool's where that is less."""

AIR_THICK_SHARE = 0.02
"""Chips thinner than this part of the tool's radius do not count there."""

WALL_SHARE = 1e-4
"""Links leave the region of tool centres by no more than this part of the tool's radius."""

TRIED_STROKES = 4
"""So many strokes are tried before the tool comes up."""

THICK_SHARE = 4e-3
"""Chips thinner than this part of the tool's radius are no engagement."""


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


def _next_opening(cleared: Polylines, opening_mm: float, tool_mm: float, limit: float) -> float:
    """Return the radius of the next smaller discs: the sharpest corner into which the present ones
    reach says how much smaller they may be."""
    sweep = 4.0 * np.arctan(cleared.vertices[:, 2])
    fronts_of_discs = sweep[np.isclose(Segments.of(cleared).radius, opening_mm, rtol=1e-3)]
    corner = math.pi - fronts_of_discs.max(initial=0.0)
    if opening_mm > tool_mm:
        return RATIO * opening_mm
    if corner < MIN_CORNER_RAD:
        return NARROW_RATIO * opening_mm
    ratio = corner_ratio(PLANNED_SHARE * limit, opening_mm, tool_mm, corner)
    return min(max(NARROW_RATIO, 1.0 - RATIO_SHARE * (1.0 - ratio)), MAX_RATIO) * opening_mm


class FrontStroke(Struct, frozen=True, eq=False):
    """A piece of a front: `vertices` (n, 3) x, y, bulge of an open path, cut as it runs, with what
    is cleared on its left; the number of its front; `opening_mm`, the radius of the discs that fit
    on its left."""

    vertices: Floats
    front: int
    opening_mm: float


def spiral(
    centre: Floats, first_mm: float, last_mm: float, tool_mm: float, limit: float
) -> Floats:
    """Return (n, 3) half circles CCW, once round a circle of centres about a place, and on to a
    wider one and once round that; the turns are as far apart as the limit of engagement (rad)
    allows."""
    radii = [first_mm, first_mm, first_mm]
    while radii[-1] < last_mm - POSITION_EPS_MM:
        # The spiral runs outwards by an angle, which adds to the engagement.
        inner = radii[-2]
        slope = step_for(limit, inner, tool_mm) / (2.0 * math.pi * inner)
        step = 0.5 * step_for(PLANNED_SHARE * limit - SPIRAL_SLOPES * slope, inner, tool_mm)
        radii.append(min(radii[-1] + step, last_mm))
    radii += [last_mm, last_mm]
    # Half circle i runs between radii i − 1 and i, on opposite sides of the centre.
    sides = np.where(np.arange(len(radii)) % 2, -1.0, 1.0)
    x = centre[0] + sides * np.array(radii)
    return np.column_stack([x, np.full(len(radii), centre[1]), np.append(np.ones(len(x) - 1), 0)])


def fronts(
    region: Polylines,
    clear: Polylines,
    openings_mm: tuple[float, float],
    tool_mm: float,
    limit: float,
    holes: Polylines = NO_AIR,
) -> Iterator[FrontStroke]:
    """Yield the strokes that clear a region of tool centres, after the part that is `clear`; with
    discs that begin with the first of two radii, grow up to the second as what is cleared gets
    wider, and shrink then. `holes` are clear too, and nothing begins there."""
    opening, widest = openings_mm
    reached = _union([clear])
    before = _union([reached, holes]) if len(holes) else reached
    number, grows = 0, True
    first_mm2, last_mm2 = (float(signed_areas(each).sum()) for each in (before, region))
    while opening > CORNER_SHARE * tool_mm and number < MAX_FRONTS:
        step = front_step(PLANNED_SHARE * limit, opening, tool_mm)
        growth = MIN_GROWTH_SHARE * math.pi * min(opening, tool_mm) ** 2
        inner = offset_shape(reached, opening + UNION_MM)
        next_mm = opening / RATIO
        grows = grows and next_mm <= widest
        while number < MAX_FRONTS:
            grown = offset_shape(inner, -(opening + step))
            inner = _common(grown, region, opening)
            wider = offset_shape(inner, -opening)
            after = _union([wider, clear])
            if signed_areas(after).sum() - signed_areas(reached).sum() < growth:
                grows = False
                break
            number += 1
            for path in outside_parts(wider, before):
                for piece, is_smooth in _cut_at_corners(path, tool_mm):
                    fit_mm = FIT_SHARE * min(tool_mm, FIT_OPENINGS * opening)
                    yield FrontStroke(_smooth(piece, is_smooth, fit_mm), number, opening)
            reached = after
            before = _union([reached, holes]) if len(holes) else reached
            cleared_mm2 = float(signed_areas(before).sum()) - first_mm2
            tell_share("fronts", cleared_mm2 / max(last_mm2 - first_mm2, cleared_mm2))
            if grows and len(offset_shape(reached, next_mm + UNION_MM)):
                break
        if not grows:
            next_mm = _next_opening(wider, opening, tool_mm, limit)
        opening = next_mm


def _circle(centre: Floats, radius_mm: float) -> Polyline:
    x, y = centre.tolist()
    return Polyline(np.array([[x + radius_mm, y, 1.0], [x - radius_mm, y, 1.0]]), True)


def _within(loops: Polylines, region: Polylines) -> Polylines:
    """Return the loops that lie in a region (even-odd)."""
    if len(loops) == 0:
        return loops
    starts = loops.vertices[loops.offsets[:-1], :2]
    return loops.select(np.flatnonzero(inside(starts, Segments.of(region))))


def _cut_at_corners(path: Polyline, tool_mm: float) -> list[tuple[Floats, bool]]:
    """Return (n, 3) the pieces of a path between its corners, in its order, and for each True if
    the path has no joints that turn a little; a closed one without corners as one piece that ends
    where it begins."""
    along = MeasuredPath.of(path)
    turns = np.abs(along.turns)
    corners = np.flatnonzero(turns > CORNER_TURN_RAD)
    is_smooth = bool(np.delete(turns, corners).max(initial=0.0) < SMOOTH_TURN_RAD)
    marks = along.reach[corners].tolist()
    if not path.closed:
        marks = [0.0, *marks, along.total_mm]
    elif not marks:
        return [(along.piece(0.0, along.total_mm), is_smooth)]
    else:
        marks = [*marks, marks[0] + along.total_mm]
    return [
        (along.piece(low, high), is_smooth)
        for low, high in pairwise(marks)
        if high - low > SPECK_SHARE * tool_mm
    ]


def _smooth(piece: Floats, is_smooth: bool, fit_mm: float) -> Floats:
    """Return (n, 3) an open path without corners; where it is not smooth, or has many arcs and
    lines or short ones, as few of them as it needs."""
    shortest_mm = float(np.hypot(*np.diff(piece[:, :2], axis=0).T).min())
    if is_smooth and len(piece) <= SMOOTH_VERTICES and shortest_mm > SMOOTH_FITS * fit_mm:
        return piece
    if is_smooth:
        return fit_path(Polyline(piece), fit_mm).vertices
    along = MeasuredPath.of(Polyline(piece))
    curve = FunctionCurve(along.at, along.directions, np.array([0.0, along.total_mm]))
    return fit_curve(curve, fit_mm).vertices


def chord_rows(vertices: Floats, sagitta_mm: float) -> tuple[Segments, Ints, Ints]:
    """Return the segments of an open path (n, 3), of how many chords each of them consists within
    a distance (n − 1,), and the segment of each chord (K,)."""
    path = Segments.of(Polyline(vertices))
    radius = np.where(path.is_arc, path.radius, np.inf)
    angle = 2.0 * np.arccos(1.0 - np.minimum(sagitta_mm / np.maximum(radius, 1e-9), 1.0))
    sweep = np.where(path.is_arc, np.abs(path.sweep), 0.0)
    count = np.maximum(np.ceil(sweep / np.maximum(angle, 1e-9)), 1.0).astype(np.int64)
    return path, count, np.repeat(np.arange(len(path)), count)


def chords(vertices: Floats, sagitta_mm: float) -> Floats:
    """Return (K, 4) x, y to x, y of an open path (n, 3), arcs as chords within a distance."""
    path, count, row = chord_rows(vertices, sagitta_mm)
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
    frames = Frames.of(Segments.of(Polyline(vertices)))
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
    c0 = np.array([start.x, start.y]) + radius * one * _left(start.angle)
    c1 = np.array([end.x, end.y]) + radius * other * _left(end.angle)
    gap = c1 - c0
    distance = math.hypot(*gap)
    if one == other:
        heading = math.atan2(gap[1], gap[0]) if distance > POSITION_EPS_MM else start.angle
    else:
        if distance < 2.0 * radius:
            return None
        heading = math.atan2(gap[1], gap[0]) + one * math.asin(2.0 * radius / distance)
    leave = c0 - radius * one * _left(heading)
    arrive = c1 - radius * other * _left(heading)
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


def _left(angle: float) -> Floats:
    return np.array([-math.sin(angle), math.cos(angle)])


class Leg(Struct, frozen=True, eq=False):
    """An open path (n, 3) of the tool's centre; `cuts` is False for links through air."""

    vertices: Floats
    cuts: bool = True


class _Clearing:
    """The strokes of one region in an order, and the legs that join them."""

    def __init__(self, region: Polylines, tool_mm: float, limit: float):
        self.tool_mm, self.limit = tool_mm, limit
        self.strokes: list[FrontStroke] = []
        self.poses: list[tuple[Pose, Pose]] = []
        boxes = path_extents(region)
        extents = np.stack([boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)])
        self.cleared = Cleared(extents, tool_mm, np.array([-np.inf, -np.inf, np.inf, np.inf]))
        self.border = Segments.of(offset_shape(region, -WALL_SHARE * tool_mm))
        self.border_curves = IndexedCurves.of(self.border, margin_mm=POSITION_EPS_MM)

    def take(self, strokes: list[FrontStroke]) -> None:
        """Take the strokes that are to be put in order."""
        self.strokes, self.poses = strokes, [ends_of(each.vertices) for each in strokes]

    def cuts(self, first: Floats | None) -> bool:
        """Return True if a path or a stroke takes more from what is not air at first than a
        hair."""
        thick = AIR_THICK_SHARE * self.tool_mm
        for path in (
            *([] if first is None else [first]),
            *(each.vertices for each in self.strokes),
        ):
            moves = self.moves(path)
            every = np.ones(len(moves), dtype=np.bool_)
            if self.cleared.judge(moves, every, thick, 0.0, math.inf, adds=False).any():
                return True
        return False

    def add_air(self, clear: Polylines) -> None:
        """Take it that the tool has been at all places of a region: once round its rings."""
        while len(clear):
            for ring in clear:
                closed = np.concatenate([ring.vertices, ring.vertices[:1] * [1.0, 1.0, 0.0]])
                self.cleared.add(self.moves(closed))
            clear = offset_shape(clear, self.tool_mm)

    def moves(self, vertices: Floats, sagitta_share: float = SAGITTA_SHARE) -> Floats:
        """Return (K, 9) the moves of an open path, as `camtool.kernels.engagement` wants them."""
        ends = chords(vertices, sagitta_share * self.tool_mm)
        radius, flat = np.full((len(ends), 1), self.tool_mm), np.zeros((len(ends), 4))
        return np.concatenate([ends, radius, flat], axis=1)

    def is_clear(self, vertices: Floats, share: float = AIR_SHARE) -> bool:
        """Return True if the tool is engaged by this share of the limit at most along a path,
        and stays in the region."""
        if not self.is_in_region(vertices):
            return False
        limit, thick = share * self.limit, AIR_THICK_SHARE * self.tool_mm
        moves = self.moves(vertices, AIR_THICK_SHARE)
        middle = np.argsort(np.abs(np.arange(len(moves)) - 0.5 * len(moves)))
        for rows in np.array_split(moves[middle], max(1, len(moves) // 8)):
            every = np.ones(len(rows), dtype=np.bool_)
            angles = self.cleared.judge(rows, every, thick, limit, math.inf, adds=False)
            if angles.max() > limit:
                return False
        return True

    def is_in_region(self, vertices: Floats) -> bool:
        """Return True if an open path (n, 3) lies in the region: it begins there, and none of its
        lines and arcs meets the border."""
        path, border = IndexedCurves.of(Segments.of(Polyline(vertices))), self.border_curves
        pairs = pairs_of(path.boxes, path.tree, border.boxes, border.tree, False)
        if len(meetings_of(path.rows, border.rows, pairs, POSITION_EPS_MM)[0]):
            return False
        start = np.ascontiguousarray(vertices[:1, :2])
        return bool(insides(start, border.rows, self.border.bulge, border.tree)[0])

    def legs(self, first: Floats | None) -> Iterator[list[Leg]]:
        """Yield the legs of each stay of the tool in the stock: the first begins with a path, or
        (None) as all others where the tool goes down through air."""
        legs, tool = list[Leg](), None
        if first is not None:
            self.cleared.add(self.moves(first))
            legs, tool = [Leg(first)], ends_of(first)[1]
        waits, followers = self.older_ones()
        starts = np.array([[begin.x, begin.y] for begin, _ in self.poses])
        ready = {number for number, older in enumerate(waits) if older == 0}
        count = 0
        while ready:
            numbers = np.array(sorted(ready))
            if tool is not None:
                away = np.hypot(starts[numbers, 0] - tool.x, starts[numbers, 1] - tool.y)
                numbers = numbers[np.argsort(away, kind="stable")]
            number, link = self.next_one(tool, numbers.tolist())
            stroke = self.strokes[number]
            if link is None:
                if legs:
                    yield legs
                gap = stroke.vertices[-1, :2] - stroke.vertices[0, :2]
                is_closed = math.hypot(*gap) <= POSITION_EPS_MM
                legs = self.lead(self.poses[number][0], stroke.opening_mm, is_closed)
            elif len(link):
                legs.append(Leg(link, cuts=False))
            legs.append(Leg(stroke.vertices))
            self.cleared.add(self.moves(stroke.vertices))
            tool = self.poses[number][1]
            ready.remove(number)
            count += 1
            tell_share("links", count / len(self.strokes))
            for follower in followers[number]:
                waits[follower] -= 1
                if waits[follower] == 0:
                    ready.add(follower)
        tell_share("links", None)
        if legs:
            yield legs

    def next_one(self, tool: Pose | None, numbers: list[int]) -> tuple[int, Floats | None]:
        """Return the first of some strokes to which a link leads, and the link; the first of
        all, and None, where none of the first few has one, or the tool is not down yet."""
        if tool is None:
            return numbers[0], None
        for number in numbers[:TRIED_STROKES]:
            link = self.link(tool, self.poses[number][0], self.strokes[number].opening_mm)
            if link is not None:
                return number, link
        return numbers[0], None

    def older_ones(self) -> tuple[list[int], list[list[int]]]:
        """Return for each stroke the number of strokes of older fronts near enough to matter,
        and the newer strokes for which it matters itself."""
        if not self.strokes:
            return [], []
        cell = 2.0 * self.tool_mm
        places = [sample(Polyline(each.vertices), self.tool_mm) for each in self.strokes]
        stroke = np.repeat(np.arange(len(places)), [len(each) for each in places])
        front = np.array([each.front for each in self.strokes], dtype=np.int64)
        column, row = np.floor(np.concatenate(places) / cell).astype(np.int64).T
        wide = int(np.ptp(column)) + 3
        key = (row - row.min()) * wide + column - column.min() + wide + 1
        own = np.unique(np.column_stack([key, stroke]), axis=0)
        shifts = [dy * wide + dx for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
        near = np.unique(np.concatenate([own + np.array([shift, 0]) for shift in shifts]), axis=0)
        first, last = (
            np.searchsorted(own[:, 0], near[:, 0], side=side) for side in ("left", "right")
        )
        pairs = set[tuple[int, int]]()
        for newer, low, high in zip(
            near[:, 1].tolist(), first.tolist(), last.tolist(), strict=True
        ):
            others = own[low:high, 1]
            pairs |= {(one, newer) for one in others[front[others] < front[newer]].tolist()}
        waits, followers = [0] * len(self.strokes), [list[int]() for _ in self.strokes]
        for one, other in sorted(pairs):
            waits[other] += 1
            followers[one].append(other)
        return waits, followers

    def link(self, start: Pose, end: Pose, opening_mm: float) -> Floats | None:
        """Return (k, 3) a way from pose to pose through what is cleared, tangent at both; no
        vertices where they are the same; None if none was found."""
        turned = abs(math.remainder(end.angle - start.angle, math.tau))
        if math.hypot(end.x - start.x, end.y - start.y) <= POSITION_EPS_MM and turned < 1e-3:
            return np.empty((0, 3))
        widest = min(opening_mm, self.tool_mm)
        for share in LINK_SHARES:
            links = [
                link
                for turns in ((1, 1), (1, -1), (-1, 1))
                if (link := tangent_link(start, end, share * widest, turns)) is not None
            ]
            for link in sorted(links, key=lambda link: length(Polyline(link))):
                if self.is_clear(link):
                    return link
        return None

    def lead(self, begin: Pose, opening_mm: float, is_closed: bool) -> list[Leg]:
        """Return the leg that leads from air to where a stroke begins: a quarter circle from the
        left, or a line from behind or from the left; none where none of these is clear. A closed
        stroke does not begin in air, and gets one that is not."""
        place = np.array([begin.x, begin.y])
        shares = (AIR_SHARE, math.inf) if is_closed else (AIR_SHARE,)
        for engaged, share in product(shares, LINK_SHARES):
            radius = share * min(opening_mm, self.tool_mm)
            ahead, aside = radius * _left(begin.angle - 0.5 * math.pi), radius * _left(begin.angle)
            for start, bulge in (
                (place + aside - ahead, math.tan(math.pi / 8.0)),
                *((place + away, 0.0) for away in (-ahead, aside - ahead, aside, aside + ahead)),
            ):
                path = np.array([[*start, bulge], [*place, 0.0]])
                if self.is_air(start) and self.is_clear(path, engaged):
                    return [Leg(path, cuts=False)]
        return []

    def is_air(self, place: Floats) -> bool:
        """Return True if the tool meets nothing at a place (2,)."""
        near = place + WALL_SHARE * self.tool_mm * np.array([[1.0, 0.0], [-1.0, 0.0]])
        moves = [self.moves(np.array([[*place, 0.0], [*end, 0.0]])) for end in near]
        thick = THICK_SHARE * self.tool_mm
        every = np.ones(2, dtype=np.bool_)
        angles = self.cleared.judge(np.concatenate(moves), every, thick, 0.0, math.inf, adds=False)
        return not angles.any()


class AdaptiveStays(Struct, frozen=True, eq=False):
    """The stays of the tool in the stock that clear a region of tool centres, each as legs. The
    first begins with a helix about a place (2,) of a radius, mm; where there is none
    (`helix_mm` 0), as all others do, at a place that is air."""

    centre: Floats
    helix_mm: float
    stays: list[list[Leg]]


def adaptive_legs(
    region: Polylines, helix_mm: float, tool_mm: float, limit: float, air: Polylines = NO_AIR
) -> AdaptiveStays:
    """Return the stays that clear a connected tool centre region; none where it has no room, or
    nothing is left to clear.

    `air`: closed paths, with what is air already on their left, in the region and beyond it; they
    may overlap. If the tool has room in that it goes down there, otherwise in a helix where the
    region is widest, of this radius or as there is room.
    """
    clear = _places_in_air(air, tool_mm)
    clearing = _Clearing(region, tool_mm, limit)
    clearing.add_air(clear)
    min_mm = MIN_HELIX_MM + MIN_ROOM_SHARE * tool_mm
    centre, room = _widest(region)
    if room < min_mm:
        return AdaptiveStays(centre, 0.0, [])
    parts = parts_of(clear)
    has_place = [len(_common(part, region, min_mm)) > 0 for part in parts]
    places = [part for part, has in zip(parts, has_place, strict=True) if has]
    # Holes in the middle would be left in rings: one is widened by a spiral, or none is needed.
    is_beside = [
        has and len(outside_parts(part, region)) > 0
        for part, has in zip(parts, has_place, strict=True)
    ]
    open_parts = [part for part, reaches in zip(parts, is_beside, strict=True) if reaches]
    holes, first, helix = clear, None, 0.0
    if open_parts:
        opening = FIRST_SHARE * max(_widest(part)[1] for part in open_parts)
        inner = [part for part, reaches in zip(parts, is_beside, strict=True) if not reaches]
        holes = Polylines.joined(inner)
        clear = Polylines.joined(open_parts)
    else:
        begin_mm = helix = min(helix_mm, room)
        if places:
            centre, begin_mm = max(map(_widest, places), key=lambda place: place[1])
            room, helix = (
                float(points_to_segments(centre[None, :], Segments.of(region)).min()),
                0.0,
            )
            begin_mm *= FIRST_SHARE
        first = spiral(centre, begin_mm, room, tool_mm, limit)
        clearing.cleared.add(clearing.moves(np.array(_ring(centre, begin_mm))))
        opening = FIRST_SHARE * room
        clear = Polylines.of([_circle(centre, room)])
    full_region, widest = region, max(opening, room)
    if len(air):
        full_region = _union([region, clear, holes])
        clear, holes = _union([clear]), _union([holes])
    strokes = fronts(full_region, clear, (opening, widest), tool_mm, limit, holes)
    clearing.take(list(strokes))
    stays = list(clearing.legs(first)) if helix or clearing.cuts(first) else []
    return AdaptiveStays(centre, helix, stays)


def rest_stays(
    region: Polylines,
    clear: Polylines,
    opening_mm: float,
    legs: Sequence[Leg],
    tool_mm: float,
    limit: float,
) -> list[list[Leg]]:
    """Return the stays that clear the rest of a connected tool centre region, of which a part is
    `clear`, a union of discs of the opening's radius, after these legs; the first begins with the
    last of them."""
    clearing = _Clearing(region, tool_mm, limit)
    for leg in legs[:-1]:
        clearing.cleared.add(clearing.moves(leg.vertices))
    room = _widest(region)[1]
    opening = FIRST_SHARE * opening_mm
    clearing.take(list(fronts(region, clear, (opening, max(opening, room)), tool_mm, limit)))
    return list(clearing.legs(legs[-1].vertices))


def _places_in_air(air: Polylines, tool_mm: float) -> Polylines:
    """Return the places at which the tool is in air, as a region."""
    if len(air) == 0:
        return air
    slack_mm = AIR_SLACK_SHARE * tool_mm
    return offset_shape(_union([air], slack_mm), tool_mm)


def _union(regions: list[Polylines], wider_mm: float = UNION_MM) -> Polylines:
    """Return what is in any of some regions, grown by a distance."""
    loops = offset_shape(Polylines.joined(regions), -wider_mm)
    starts = loops.vertices[loops.offsets[:-1], :2]
    is_hole = signed_areas(loops) < 0.0
    around = np.zeros(len(loops), dtype=np.int64)
    for row, path in enumerate(loops if len(loops) > 1 else ()):
        holds = inside(starts, Segments.of(path))
        holds[row] = False
        around += np.where(holds, -1 if is_hole[row] else 1, 0)
    # Loops that do not cross are all given: those within another region are no boundary.
    return loops.select(np.flatnonzero(around == is_hole))


def _common(one: Polylines, other: Polylines, room_mm: float) -> Polylines:
    """Return the common part of two regions, shrunk by a distance."""
    both = offset_shape(Polylines.joined([one, other]), room_mm) if len(one) else one
    return _within(_within(both, one), other)


def _widest(region: Polylines) -> tuple[Floats, float]:
    """Return the place (2,) of a connected region that has the most room, and how much, mm."""
    centre = pole(region)
    return centre, float(points_to_segments(centre[None, :], Segments.of(region)).min())


def _ring(centre: Floats, radius_mm: float) -> list[list[float]]:
    x, y = centre.tolist()
    return [[x + radius_mm, y, 1.0], [x - radius_mm, y, 1.0], [x + radius_mm, y, 0.0]]


def wide_parts(region: Polylines, tool_mm: float) -> list[Polylines]:
    """Return the connected parts of a tool centre region that discs reach which have room for a
    helix: necks that are narrower part it, and stay."""
    opening = 1.01 * (MIN_HELIX_MM + MIN_ROOM_SHARE * tool_mm)
    shrunk_mm = neck_mm(tool_mm)
    return parts_of(offset_shape(offset_shape(region, shrunk_mm), -opening))


def neck_mm(tool_mm: float) -> float:
    """Return how far from the boundary of a tool centre region there must be places for a neck of
    it to be cleared."""
    opening = 1.01 * (MIN_HELIX_MM + MIN_ROOM_SHARE * tool_mm)
    return opening + (FIT_SHARE + WALL_SHARE) * tool_mm


def adaptive_runs(
    region: Polylines, setting: Setting, name: str, air_at: Callable[[float], Polylines]
) -> list[CutRun]:
    """Return the runs that clear one connected tool centre region at all levels, in order, but for
    what is air at a level; none where nothing is left, or it is too narrow for a helix."""
    refuse_feeds_and_lift(setting)
    operation = setting.operation
    tool_mm = operation.tool.radius_mm
    backward = operation.direction == "conventional"
    limit: float = operation.own_value("engagement")
    runs, clearing, air = list[CutRun](), None, NO_AIR
    legs = list[tuple[Floats, Floats]]()
    for heights in pairwise((0.0, *setting.levels_mm)):
        above, air = air, air_at(heights[1])
        if clearing is None or not np.array_equal(above.vertices, air.vertices):
            regions = [mirrored(each) if backward else each for each in (region, air)]
            clearing = adaptive_legs(regions[0], entry_mm(operation), tool_mm, limit, regions[1])
            legs = _with_feeds(clearing, setting)
        runs += _runs_at(clearing, legs, heights, setting, name)
    return runs


def refuse_strategy(operation: Operation, own_strategy: str) -> None:
    """Refuse a strategy that limits the engagement, other than the one of this kind."""
    strategy = operation.own_value("strategy")
    if strategy not in (STRATEGIES[0], own_strategy):
        raise OptionError(
            f"a {operation.kind} has no strategy {strategy!r}",
            where=key_of(operation, "strategy"),
            mend=f'give strategy = "{own_strategy}"',
        )


def refuse_feeds_and_lift(setting: Setting) -> None:
    """Refuse a greatest feed below the feed, and a lift out of the first pass."""
    operation, feed = setting.operation, setting.feeds.cut_mm_min
    max_feed = operation.own_value("max_feed")
    if max_feed is not None and max_feed < feed:
        raise OptionError(
            f"a greatest feed of {max_feed:g} mm/min is below the feed of {feed:g} mm/min",
            where=key_of(operation, "max_feed"),
            mend="give a higher one, or leave it out",
        )
    lift_mm, first_mm = operation.own_value("lift"), -setting.levels_mm[0]
    if lift_mm > first_mm:
        raise OptionError(
            f"a lift of {lift_mm:g} mm takes links out of a pass {first_mm:g} mm deep",
            where=key_of(operation, "lift"),
            mend="give a smaller one",
        )


def entry_mm(operation: Operation) -> float:
    """Return the radius of the helix in which an operation goes down where there is room, mm."""
    tool_mm = operation.tool.radius_mm
    return min(operation.entry.radius_mm or HELIX_SHARE * tool_mm, tool_mm)


def runs_of(clearings: Sequence[AdaptiveStays], setting: Setting, name: str) -> list[CutRun]:
    """Return the runs that make all stays at all levels, in order; where the operation is cut
    conventionally they are mirrored about X = 0, as the regions were for which they were made."""
    legs = [_with_feeds(each, setting) for each in clearings]
    return [
        run
        for heights in pairwise((0.0, *setting.levels_mm))
        for each, own_legs in zip(clearings, legs, strict=True)
        for run in _runs_at(each, own_legs, heights, setting, name)
    ]


def _runs_at(
    clearing: AdaptiveStays,
    legs: Sequence[tuple[Floats, Floats]],
    heights: tuple[float, float],
    setting: Setting,
    name: str,
) -> Iterator[CutRun]:
    """Yield the runs that make all stays, whose legs have these vertices and feeds, at the second
    of two heights, for a tool that goes down in a helix from the first."""
    next_legs = iter(legs)
    for number, stay in enumerate(clearing.stays):
        parts = []
        for leg, (flat, feeds) in zip(stay, islice(next_legs, len(stay)), strict=True):
            vertices = np.insert(flat, 2, heights[1], axis=1)
            if not leg.cuts:
                vertices[:, 2] += _lifts(flat, setting.operation.own_value("lift"))
            parts.append((vertices, feeds))
        if number == 0 and clearing.helix_mm:
            parts.insert(0, _down(clearing, heights, setting))
        vertices = np.concatenate([*(part[:-1] for part, _ in parts), parts[-1][0][-1:]])
        if setting.operation.direction == "conventional":
            vertices = vertices * [-1.0, 1.0, 1.0, -1.0]
        feeds = np.concatenate([feed for _, feed in parts])
        yield CutRun(vertices, feeds, setting.feeds.plunge_mm_min, name)


def _lifts(link: Floats, lift_mm: float) -> Floats:
    """Return (n,) by how much each vertex of a link (n, 3) is lifted: it rises and falls by 45°
    at most, so that short pieces, which a dialect may leave out, rise by less than a unit."""
    reach = MeasuredPath.of(Polyline(link)).reach
    lifts: Floats = np.minimum(np.minimum(reach, reach[-1] - reach), lift_mm)
    return lifts


def _down(
    clearing: AdaptiveStays, heights: tuple[float, float], setting: Setting
) -> tuple[Floats, Floats]:
    """Return the vertices (n, 4) of the helix from one height to another, and its feeds."""
    above, level = heights
    drop = (above - level) / math.tan(setting.operation.entry.angle_rad)
    begin = clearing.centre + np.array([1.0, 0.0])
    down = helix(clearing.centre, clearing.helix_mm, begin, drop)
    sloping = MeasuredPath.of(Polyline(down)).reach
    vertices = np.insert(down, 2, above + (level - above) * sloping / sloping[-1], axis=1)
    return vertices, feeds_along(vertices, setting.feeds)


def mirrored(region: Polylines) -> Polylines:
    """Return a region mirrored about X = 0, on the left of its paths again."""
    paths = [Polyline(path.vertices * [-1.0, 1.0, -1.0], path.closed) for path in region]
    return Polylines.of([reverse(path) for path in paths])


def _with_feeds(clearing: AdaptiveStays, setting: Setting) -> list[tuple[Floats, Floats]]:
    """Return the vertices (n, 3) of all legs, in the order of cutting, and the feeds (n − 1,) of
    their moves; arcs and lines are split where the feed changes (`max_feed`)."""
    operation, feed = setting.operation, setting.feeds.cut_mm_min
    legs = [leg for stay in clearing.stays for leg in stay]
    cuts = [(leg.vertices, np.full(len(leg.vertices) - 1, feed)) for leg in legs]
    max_feed = operation.own_value("max_feed")
    if max_feed is not None and legs:
        tool_mm, limit = operation.tool.radius_mm, operation.own_value("engagement")
        rows = [_chords_of(leg, tool_mm) for leg in legs]
        levels = feed_levels(feed, max_feed)
        cuts = [
            (_split(leg, row, each.first), each.feed_mm_min)
            for leg, row, each in zip(
                legs, rows, thin_chip_feeds(rows, tool_mm, limit, levels), strict=True
            )
        ]
    link_feed = operation.own_value("link_feed") or feed
    return [
        each if leg.cuts else (leg.vertices, np.full(len(leg.vertices) - 1, link_feed))
        for leg, each in zip(legs, cuts, strict=True)
    ]


def _chords_of(leg: Leg, tool_mm: float) -> tuple[Floats, Ints]:
    """Return the chords of a leg as moves (K, 9), each with the angles to the path's direction at
    its ends, and the line or arc (K,) that each is a part of."""
    path, count, row = chord_rows(leg.vertices, SAGITTA_SHARE * tool_mm)
    half = 0.5 * (np.where(path.is_arc, path.sweep, 0.0) / count)[row]
    flat = np.column_stack([np.full(len(row), tool_mm), np.zeros((len(row), 2)), -half, half])
    ends = chords(leg.vertices, SAGITTA_SHARE * tool_mm)
    return np.concatenate([ends, flat], axis=1), row


def _split(leg: Leg, rows: tuple[Floats, Ints], first: Ints) -> Floats:
    """Return the vertices of a leg that is split before these chords of it."""
    moves, row = rows
    share = np.diff(np.append(first, len(row))) / np.bincount(row)[row[first]]
    bulge = np.tan(share * np.arctan(leg.vertices[row[first], 2]))
    pieces = np.column_stack([moves[first, :2], bulge])
    return np.concatenate([pieces, leg.vertices[-1:]])
