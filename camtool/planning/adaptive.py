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
from collections.abc import Callable, Iterable, Iterator, Sequence
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
    length,
    path_extents,
    sample,
    signed_areas,
)
from camtool.geometry.nesting import inside
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse,
    reverse_lines,
)
from camtool.kernels.engagement import Cleared
from camtool.kernels.offsets import insides, meetings_of, pairs_of
from camtool.planning.clearing import outside_parts, parts_of, pole
from camtool.planning.items import CutRun, Setting
from camtool.planning.job import Operation
from camtool.planning.naming import key_of
from camtool.planning.paths import MeasuredPath
from camtool.planning.pursuing import END_SHARE, TIGHT_TURN_SHARE, TURN_SHARE, Pursued, discs_about
from camtool.planning.ramps import feeds_along, helix
from camtool.planning.strategies import STRATEGIES
from camtool.planning.strokes import (
    NARROW_RATIO,
    PLANNED_SHARE,
    SAGITTA_SHARE,
    THICK_SHARE,
    Leg,
    Pose,
    ends_of,
    front_step,
    left_of,
    moves_along,
    moves_of,
    next_in_corner,
    step_for,
    tangent_link,
)
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

MIN_CORNER_RAD = math.radians(10.0)
"""Walls that meet at a smaller angle are taken as parallel."""

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

PURSUED_ROOM_SHARE = TIGHT_TURN_SHARE
"""Regions with less room than this part of the tool's radius are not pursued: the tightest turn
of a pursuit has no room there."""

CHAMBER_SHARE = 0.101
"""Chambers are cleared one by one where a disc of this part of the tool's radius does not fit
through the necks between them: fronts would clear all chambers but the first with discs of the
necks (19 m of cuts for 400 mm² behind a neck 3 % wider than the tool)."""

NARROW_SHARE = 1.0
"""In regions with less room than this part of the tool's radius ..."""

NARROW_TURN_SHARES = (TURN_SHARE, 0.15)
"""... these tightest turns, over the tool's radius, are tried, and the quicker plan is kept: of 22
random ones the tight turn was quicker in 12, by up to 0.28, and slower by up to 0.56 elsewhere."""

LINK_COST_SHARE = 0.3
HOP_SHARE = 4.0
"""Plans are compared by the length of their cuts, this part of that of their links, and so many
tool radii for each time that the tool comes up."""

MAX_LEFT_SHARE = 0.55
"""A pursuit that leaves a greater part of the region to fronts is given up: fronts alone clear
all of it with wider steps."""

NEAR_SHARE = 3.0
"""Fronts clear what is left within so many radii of the tool, ..."""

STOCK_SHARE = 1.1
"""... and it counts as not cleared within so many."""


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
    return next_in_corner(opening_mm, tool_mm, limit, corner)


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
    reached = union_of([clear])
    before = union_of([reached, holes]) if len(holes) else reached
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
            after = union_of([wider, clear])
            if signed_areas(after).sum() - signed_areas(reached).sum() < growth:
                grows = False
                break
            number += 1
            for path in outside_parts(wider, before):
                for piece, is_smooth in _cut_at_corners(path, tool_mm):
                    fit_mm = FIT_SHARE * min(tool_mm, FIT_OPENINGS * opening)
                    yield FrontStroke(_smooth(piece, is_smooth, fit_mm), number, opening)
            reached = after
            before = union_of([reached, holes]) if len(holes) else reached
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

    def add(self, paths: Iterable[Floats]) -> None:
        """Take it that the tool has cut along open paths (n, 3)."""
        for path in paths:
            self.cleared.add(self.moves(path))

    def moves(self, vertices: Floats, sagitta_share: float = SAGITTA_SHARE) -> Floats:
        """Return (K, 9) the moves of an open path, as `camtool.kernels.engagement` wants them."""
        return moves_of(vertices, self.tool_mm, sagitta_share * self.tool_mm)

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
        """Return for each stroke the number of strokes it waits for, and the newer ones that wait
        for it: in each cell near it the last front before its own. That one waits for the front
        before it in the cell, and so on: all older strokes near enough to matter are cut first."""
        if not self.strokes:
            return [], []
        cell = 2.0 * self.tool_mm
        places = [sample(Polyline(each.vertices), self.tool_mm) for each in self.strokes]
        stroke = np.repeat(np.arange(len(places)), [len(each) for each in places])
        front = np.array([each.front for each in self.strokes], dtype=np.int64)
        column, row = np.floor(np.concatenate(places) / cell).astype(np.int64).T
        wide = int(np.ptp(column)) + 3
        key = (row - row.min()) * wide + column - column.min() + wide + 1
        own = np.unique(np.column_stack([key, front[stroke], stroke]), axis=0)
        every = int(front.max()) + 1
        age = own[:, 0] * every + own[:, 1]
        shifts = [dy * wide + dx for dy in (-1, 0, 1) for dx in (-1, 0, 1)]
        pairs = [np.empty((0, 2), dtype=np.int64)]
        for shift in shifts:
            near = np.searchsorted(age, age + shift * every)
            has_older = near > 0
            has_older[has_older] &= own[near[has_older] - 1, 0] == own[has_older, 0] + shift
            newer, last = np.flatnonzero(has_older), near[has_older]
            first = np.searchsorted(age, age[last - 1])
            count = last - first
            part = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
            older = own[np.repeat(first, count) + part, 2]
            pairs.append(np.column_stack([older, np.repeat(own[newer, 2], count)]))
        waits, followers = [0] * len(self.strokes), [list[int]() for _ in self.strokes]
        for one, other in np.unique(np.concatenate(pairs), axis=0).tolist():
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
            ahead, aside = (
                radius * left_of(begin.angle - 0.5 * math.pi),
                radius * left_of(begin.angle),
            )
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
    been = list(rings_of(clear, tool_mm))
    clearing.add(been)
    min_mm = MIN_HELIX_MM + MIN_ROOM_SHARE * tool_mm
    centre, widest_mm = _widest(region)
    room = widest_mm
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
        ring = np.array(_ring(centre, begin_mm))
        clearing.add([ring])
        opening = FIRST_SHARE * room
        clear = Polylines.of([_circle(centre, room)])
    plans, is_complete = list[list[list[Leg]]](), False
    if widest_mm >= PURSUED_ROOM_SHARE * tool_mm:
        if helix:
            been.append(ring)
        begin = first if helix else None
        plans, is_complete = _plans_by_pursuit(region, been, begin, widest_mm, tool_mm, limit)
    if not is_complete:
        full_region, widest = region, max(opening, room)
        if len(air):
            full_region = union_of([region, clear, holes])
            clear, holes = union_of([clear]), union_of([holes])
        strokes = fronts(full_region, clear, (opening, widest), tool_mm, limit, holes)
        clearing.take(list(strokes))
        plans.append(list(clearing.legs(first)) if helix or clearing.cuts(first) else [])
    return AdaptiveStays(centre, helix, min(plans, key=lambda stays: _cost(stays, tool_mm)))


def _plans_by_pursuit(
    region: Polylines,
    been: Sequence[Floats],
    first: Floats | None,
    room: float,
    tool_mm: float,
    limit: float,
) -> tuple[list[list[list[Leg]]], bool]:
    """Return the stays of pursuits in a region that leave nothing, and True; where there is none
    those of the one that leaves least, completed by fronts if they have a place to begin, and
    False. `been`: paths that have cut, the last of them the ring of the way down if it is widened
    by a spiral, `first`: narrow regions are pursued from the ring, once with wide turns and once
    with tight ones."""
    is_narrow = room < NARROW_SHARE * tool_mm
    if is_narrow and first is not None:
        first = been[-1]
    tried = list[tuple[Pursued, Floats]]()
    for turn_share in NARROW_TURN_SHARES if is_narrow else (TURN_SHARE,):
        pursuit = Pursued(region, been, first, tool_mm, limit, turn_share)
        pursuit.run()
        tried.append((pursuit, pursuit.stock_left()))
    complete = [pursuit.stays for pursuit, points in tried if len(points) == 0]
    if complete:
        return complete, True
    completed = _completed(*min(tried, key=lambda each: len(each[1])))
    return [] if completed is None else [completed], False


def _cost(stays: Sequence[Sequence[Leg]], tool_mm: float) -> float:
    """Return about how long stays take, as mm of cuts."""
    cost = HOP_SHARE * tool_mm * len(stays)
    for leg in (leg for stay in stays for leg in stay):
        share = 1.0 if leg.cuts else LINK_COST_SHARE
        cost += share * MeasuredPath.of(Polyline(leg.vertices)).total_mm
    return cost


def _completed(pursuit: Pursued, points: Floats) -> list[list[Leg]] | None:
    """Return the stays of a pursuit, and behind them those that clear by fronts what it left about
    points (P, 2); None where that is most of the region, or fronts have no place to begin."""
    region, tool_mm, limit = pursuit.region, pursuit.tool_mm, pursuit.limit
    places = list(_places_left(region, points, tool_mm))
    left_mm2 = sum(float(signed_areas(part).sum()) for part, _ in places)
    if left_mm2 > MAX_LEFT_SHARE * float(signed_areas(region).sum()):
        return None
    strokes = list[FrontStroke]()
    for part, clear in places:
        room = max((_widest(each)[1] for each in parts_of(clear)), default=0.0)
        opening = FIRST_SHARE * min(room, tool_mm)
        begin = offset_shape(offset_shape(clear, opening), -opening)
        if not len(begin):
            return None
        strokes += fronts(part, begin, (opening, opening), tool_mm, limit, clear)
    clearing = _Clearing(region, tool_mm, limit)
    legs = [leg for stay in pursuit.stays for leg in stay]
    clearing.add([*pursuit.been, *(leg.vertices for leg in legs[:-1])])
    clearing.take(strokes)
    if not legs:
        return list(clearing.legs(None))
    first, *others = clearing.legs(legs[-1].vertices)
    return [*pursuit.stays[:-1], [*pursuit.stays[-1][:-1], *first], *others]


def _places_left(
    region: Polylines, points: Floats, tool_mm: float
) -> Iterator[tuple[Polylines, Polylines]]:
    """Yield the connected parts of a tool centre region from which points of stock (P, 2) are cut,
    and where in each the tool has been for sure."""
    discs, fine_mm = discs_about(points, 0.5 * tool_mm), END_SHARE * tool_mm
    reached = offset_shape(offset_shape(region, fine_mm), -fine_mm)
    near, stock = (
        union_of([Polylines.of([_circle(row[:2], row[2] + wide * tool_mm)]) for row in discs])
        for wide in (NEAR_SHARE, STOCK_SHARE)
    )
    frame = offset_shape(near, -tool_mm)
    outer = frame.select(np.flatnonzero(signed_areas(frame) > 0.0))
    others = Polylines.joined([outer, *(Polylines.of([reverse(path)]) for path in stock)])
    for part in parts_of(_common(region, near, UNION_MM)):
        yield part, _common(_common(reached, part, UNION_MM), others, UNION_MM)


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
    clearing.add(leg.vertices for leg in legs[:-1])
    room = _widest(region)[1]
    opening = FIRST_SHARE * opening_mm
    clearing.take(list(fronts(region, clear, (opening, max(opening, room)), tool_mm, limit)))
    return list(clearing.legs(legs[-1].vertices))


def stays_of_chambers(
    region: Polylines, helix_mm: float, tool_mm: float, limit: float
) -> list[AdaptiveStays]:
    """Return the stays that clear a connected tool centre region: its chambers one by one, where
    necks part them in which no disc of the tightest turn of a pursuit fits, each with a way down
    of its own; and the necks by fronts from both ends, behind the last chamber."""
    turn_mm = CHAMBER_SHARE * tool_mm
    opened = offset_shape(offset_shape(region, turn_mm), -turn_mm)
    chambers = parts_of(opened)
    if len(chambers) < 2:
        return [adaptive_legs(region, helix_mm, tool_mm, limit)]
    each = [adaptive_legs(chamber, helix_mm, tool_mm, limit) for chamber in chambers]
    legs = [leg for chamber in each for stay in chamber.stays for leg in stay]
    rest = rest_stays(region, opened, turn_mm, legs, tool_mm, limit)
    last = each[-1]
    last_stays = [*last.stays[:-1], [*last.stays[-1][:-1], *rest[0]], *rest[1:]]
    return [*each[:-1], AdaptiveStays(last.centre, last.helix_mm, last_stays)]


def rings_of(clear: Polylines, tool_mm: float) -> Iterator[Floats]:
    """Yield open paths (n, 3) on which a tool clears all places of a region."""
    while len(clear):
        for ring in clear:
            yield np.concatenate([ring.vertices, ring.vertices[:1] * [1.0, 1.0, 0.0]])
        clear = offset_shape(clear, tool_mm)


def _places_in_air(air: Polylines, tool_mm: float) -> Polylines:
    """Return the places at which the tool is in air, as a region."""
    if len(air) == 0:
        return air
    slack_mm = AIR_SLACK_SHARE * tool_mm
    return offset_shape(union_of([air], slack_mm), tool_mm)


def union_of(regions: list[Polylines], wider_mm: float = UNION_MM) -> Polylines:
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


def wide_parts(
    region: Polylines, tool_mm: float, zones: Polylines = NO_AIR, corner_mm: float = 0.0
) -> list[Polylines]:
    """Return the connected parts of a tool centre region, without some zones (CCW), that discs
    reach which have room for a helix, or of the radius `corner_mm` if that is larger: necks that
    are narrower part it, and stay."""
    smallest_mm = _least_opening(tool_mm)
    wider_mm = max(corner_mm - smallest_mm, 0.0)
    free = region
    if len(zones):
        zones = union_of([zones])
        free = Polylines.joined([region, reverse_lines(zones)])
    shrunk = offset_shape(free, neck_mm(tool_mm) + wider_mm)
    if len(zones):
        starts = shrunk.vertices[shrunk.offsets[:-1], :2]
        is_free = inside(starts, Segments.of(region)) & ~inside(starts, Segments.of(zones))
        shrunk = shrunk.select(np.flatnonzero(is_free))
    return parts_of(offset_shape(shrunk, -(smallest_mm + wider_mm)))


def wide_parts_within(region: Polylines, tool_mm: float, zone: Polylines) -> list[Polylines]:
    """Return the connected parts of a tool centre region within a zone (CCW) that discs reach
    which have room for a helix."""
    shrunk = _common(region, zone, neck_mm(tool_mm))
    return parts_of(offset_shape(shrunk, -_least_opening(tool_mm)))


def _least_opening(tool_mm: float) -> float:
    """Return the radius of the smallest discs that have room for a helix, mm."""
    return 1.01 * (MIN_HELIX_MM + MIN_ROOM_SHARE * tool_mm)


def neck_mm(tool_mm: float) -> float:
    """Return how far from the boundary of a tool centre region there must be places for a neck of
    it to be cleared."""
    return _least_opening(tool_mm) + (FIT_SHARE + WALL_SHARE) * tool_mm


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
    runs, clearings, air = list[CutRun](), list[AdaptiveStays](), NO_AIR
    legs = list[list[tuple[Floats, Floats]]]()
    for heights in pairwise((0.0, *setting.levels_mm)):
        above, air = air, air_at(heights[1])
        if not clearings or not np.array_equal(above.vertices, air.vertices):
            centres, clear = (mirrored(each) if backward else each for each in (region, air))
            helix_mm = entry_mm(operation)
            if len(clear):
                clearings = [adaptive_legs(centres, helix_mm, tool_mm, limit, clear)]
            else:
                clearings = stays_of_chambers(centres, helix_mm, tool_mm, limit)
            legs = [_with_feeds(each, setting) for each in clearings]
        for each, own_legs in zip(clearings, legs, strict=True):
            runs += _runs_at(each, own_legs, heights, setting, name)
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


def runs_of(
    clearings: Sequence[AdaptiveStays], setting: Setting, name: str, heights_mm: Sequence[float]
) -> list[CutRun]:
    """Return the runs that make all stays at all levels, in order: at each of these heights but
    the first, to which it is cleared already. Where the operation is cut conventionally they are
    mirrored about X = 0, as the regions were for which they were made."""
    legs = [_with_feeds(each, setting) for each in clearings]
    return [
        run
        for heights in pairwise(heights_mm)
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
        rows = [moves_along(leg.vertices, tool_mm) for leg in legs]
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


def _split(leg: Leg, rows: tuple[Floats, Ints], first: Ints) -> Floats:
    """Return the vertices of a leg that is split before these chords of it."""
    moves, row = rows
    share = np.diff(np.append(first, len(row))) / np.bincount(row)[row[first]]
    bulge = np.tan(share * np.arctan(leg.vertices[row[first], 2]))
    pieces = np.column_stack([moves[first, :2], bulge])
    return np.concatenate([pieces, leg.vertices[-1:]])
