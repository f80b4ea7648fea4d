"""Clear the bulk of a pocket by long strokes that pursue the edge of the stock.

    tool centre region, spiral ─pursuit, with tighter turns for narrower places─▶ strokes
      ─arcs between the walls of inner corners, from large to small─▶ more strokes
      ─along walls, where a skin is left─▶ more strokes
      ─each held with its way against the limit, by the kernel of the proof─▶ strokes that keep it
      ─joined within what is cleared by arcs and lines, all tangent─▶ stays
      ─what is stock all the same─▶ points, about which fronts go on (`camtool.planning.adaptive`)

The kernel `camtool.kernels.pursuit` makes the strokes. One that exceeds the limit is planned again
with a lower share of it, and left out where that does not help.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import Frames, path_extents, point_at, sample, signed_areas
from camtool.geometry.nesting import inside
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polylines, Segments
from camtool.kernels.engagement import Cleared
from camtool.kernels.pursuit import COLUMNS, Pursuit
from camtool.planning.paths import MeasuredPath, MeasuredPaths
from camtool.planning.strokes import (
    MAX_RATIO,
    THICK_SHARE,
    Leg,
    corner_ratio,
    ends_of,
    left_of,
    moves_along,
    thick_share,
)
from camtool.progress import tell_share

MARGIN_SHARE = 0.5
"""The pursuit measures its distance from walls grown by this part of the tool's radius."""

CELL_SHARE = 1.0 / 12.0
"""Distance of grid points over the tool's radius."""

TURN_SHARE = 0.5
TIGHT_TURN_SHARE = 0.1
"""Radii of the tightest turn over the tool's radius, at first and then: places that are too narrow
for one of them are left to the other."""

SHARES = ((0.96, 0.92), (0.85, 0.75), (0.6, 0.5))
"""Parts of the limit that strokes are planned with, and beside walls, where the engagement rises
with their turn: the first for which the stroke keeps the limit."""

MAX_SHARE = 0.98
"""A stroke ends before its engagement would be a greater part of the limit, ..."""

CUT_OFF_PIECES = 4
"""... and so many pieces are cut off it."""

MIN_PIECES = 6
"""Strokes of fewer pieces are left out: they peck at blunt stock."""

FIT_SHARE = 1e-4
"""Arcs are fitted to the pieces within this part of the tool's radius, ..."""

SLACK_SHARE = 2.4e-4
"""... and leave the region by no more than this; it is that much farther from the walls."""

SKIN_SHARE = 6e-3
SKIN_OF_STEP = 0.3
"""No stroke begins for stock thinner than this part of the radius, or of that step."""

LINK_SHARE = 0.5
"""A link may touch the stock with this part of the limit, ..."""

LINK_THICK_SHARE = 1e-2
"""... and chips thinner than this part of the radius do not count there."""

CORNER_RATIO = 0.9
"""Radii of discs that are tried for the first in a corner, one over the other."""

CORNER_SHARE = 0.9
"""A disc in a corner is smaller than the one before by so much of what straight walls allow, less
a hair, since slides go beside the path; ..."""

CORNER_SHARES = (1.0, 0.5, 0.25)
"""... or by these parts of that, where walls are curved."""

ROUND_WAY_SHARE = 0.12
BACK_SHARE = 0.16
"""About discs smaller than the first of these, over the tool's radius, arcs in corners begin and
end as much as the second farther back along the walls: on shorter ways round, what the tool cut
just before would not count as wider by the thickness of chips that do not count
(`camtool.kernels.engagement`)."""

WALL_SHARE = 1e-4
"""The tool comes down at places between two that are so far apart, over its radius."""

LEAD_SHARES = (1.0, 0.5, 0.25)
"""Radii of the half circles that are tried from there, over the widest."""

SKIM_SHARES = (0.4, 1.2)
"""A stroke along a wall begins and ends so far from the skin that it cuts, over the radius: first
beside thin skins, then beside all others."""

SKIMMED_SHARE = 0.85
"""Walls are looked at for skins where at least this part is cleared: fewer is given up."""

END_SHARE = 0.0206
"""The last arc in a corner over the tool's radius."""

ROUND_SHARE = 0.03
"""Arcs of the region up to this part of the radius are rounded corners."""

ROUND_SLACK = 1.0001
"""The last arc there has so many times the radius of the walls' own."""

MIN_CORNER_RAD = 0.02
"""A turn between walls that is smaller is no corner."""

DEEP_SHARE = 0.011
"""Stock thinner than twice this part of the tool's radius may stay, as the scallop of corners."""

HALF_TURN_RAD = 2.5
"""The longest sweep of one arc of the walls in the kernel."""

NEWTON_STEPS = 30


def pieces_of(lines: Polylines) -> Floats:
    """Return (n, COLUMNS) the lines and arcs of closed paths, arcs of less than half a circle."""
    segments = Segments.of(lines)
    sweep = np.where(segments.is_arc, np.abs(segments.sweep), 0.0)
    count = np.maximum(np.ceil(sweep / HALF_TURN_RAD), 1.0).astype(np.int64)
    row = np.repeat(np.arange(len(segments)), count)
    part = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    pieces = np.zeros((len(row), COLUMNS))
    pieces[:, :2] = point_at(segments, row, part / count[row])
    pieces[:, 2:4] = point_at(segments, row, (part + 1) / count[row])
    arcs = np.flatnonzero(segments.is_arc[row])
    pieces[arcs, 4:6] = segments.centre[row[arcs]]
    pieces[arcs, 6] = np.copysign(segments.radius[row[arcs]], segments.sweep[row[arcs]])
    return pieces


class Approach(Struct, frozen=True, eq=False):
    """The way of the tool to where a stroke begins: a path (n, 3), or no vertices where there is
    none to go; `comes_down`: it begins with another stay, otherwise where the tool is."""

    path: Floats
    comes_down: bool


NO_PATH = np.empty((0, 3))


def joined(path: Floats, other: Floats) -> Floats:
    """Return (n, 3) the vertices of an open path, or none, and one that begins where it ends."""
    return np.concatenate([path[:-1], other]) if len(path) else other


class Pursued:
    """The clearing of one region by pursuit: its stays so far.

    `been`: open paths (n, 3) that have cut, the way down or rings in what is air; `first`: the
    path on which the first stay begins behind the way down, or None: it begins in air, as all
    others do. `turn_share`: the tightest turn at first.
    """

    def __init__(
        self,
        region: Polylines,
        been: Sequence[Floats],
        first: Floats | None,
        tool_mm: float,
        limit: float,
        turn_share: float,
    ):
        self.turn_shares = (turn_share, TIGHT_TURN_SHARE)
        self.region, self.tool_mm, self.limit = region, tool_mm, limit
        self.been = [*been, *([] if first is None else [first])]
        step = 1.0 - math.cos(limit)
        self.thick_mm = thick_share(limit) * tool_mm
        boxes = path_extents(region)
        extents = np.stack([boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)])
        margin_mm = MARGIN_SHARE * tool_mm
        self.pursuit = Pursuit(
            pieces_of(offset_shape(region, -margin_mm)),
            margin_mm,
            extents,
            tool_mm,
            limit,
            0.5 * self.thick_mm,
            min(SKIN_SHARE, SKIN_OF_STEP * step) * tool_mm,
            CELL_SHARE * tool_mm,
        )
        self.stays = [] if first is None else [[Leg(first)]]
        for path in self.been:
            self.pursuit.add(path)
        self.pursuit.leave_out(~inside(self.pursuit.ends(), Segments.of(region)))
        self.pose = self.pursuit.pose(self.pursuit.size - 1)
        nowhere = np.array([-np.inf, -np.inf, np.inf, np.inf])
        self.cleared = Cleared(extents, tool_mm, nowhere)
        for path in self.been:
            self.cleared.add(moves_along(path, tool_mm)[0])

    def run(self) -> None:
        """Make all strokes, with tighter and tighter turns."""
        corners = corners_of(self.region, ROUND_SHARE * self.tool_mm)
        self.reach_mm2 = float(signed_areas(offset_shape(self.region, -self.tool_mm)).sum())
        for share in self.turn_shares:
            self.pursue(share * self.tool_mm)
            self.cut_corners(corners)
        for share in SKIM_SHARES:
            self.skim_walls(share * self.tool_mm)
        tell_share("strokes", None)

    def stays_within(self, path: Floats) -> bool:
        """Return True if a path leaves the region by no more than a hair."""
        return self.pursuit.stays_within(path, SLACK_SHARE * self.tool_mm)

    def keeps(self, approach: Approach, stroke: Floats) -> bool:
        """Return True if a stroke and the way to it keep to the region and the limit: then they
        count as cut. What the tool cut just before does not count as wider by the thickness of
        chips that do not count: so the way must be known."""
        path = joined(approach.path, stroke)
        moves = moves_along(path, self.tool_mm)[0]
        if not self.stays_within(path) or not self.is_free(moves, 1.0):
            return False
        self.cleared.add(moves)
        return True

    def is_free(self, moves: Floats, share: float) -> bool:
        """Return True if the tool is engaged by no more than a share of the limit in moves."""
        return self.cleared.try_moves(moves, self.thick_mm, share * self.limit)[1] == len(moves)

    def pursue(self, turn_mm: float) -> None:
        """Cut strokes along the edge of the stock until none is left that turns by a radius."""
        pursuit = self.pursuit
        pursuit.begin_level(turn_mm)
        while (pieces := pursuit.begin(self.pose[0], self.pose[1])) is not None:
            best, piece = pieces
            # Found before the stroke is cut: the way must not lead through what that clears.
            link = self.link_to(pursuit.pose(piece), max(turn_mm, TURN_SHARE * self.tool_mm))
            if not self.cut_stroke(piece, Approach(NO_PATH, True) if link is None else link):
                pursuit.give_up(best)

    def cut_stroke(self, piece: int, approach: Approach) -> bool:
        """Cut a stroke that begins at a piece behind the way to that; False where none keeps the
        limit."""
        pursuit, size, fit_mm = self.pursuit, self.pursuit.size, FIT_SHARE * self.tool_mm
        for share, wall_share in SHARES:
            first, last, blocked = pursuit.pursue(piece, share, wall_share, MAX_SHARE)
            if blocked:
                last = max(last - CUT_OFF_PIECES, size)
                pursuit.undo(last)
            if last - first >= MIN_PIECES:
                stroke, whole_approach = pursuit.fitted(first, last, fit_mm), approach
                if first > size:
                    run_up = pursuit.fitted(size, first, fit_mm)
                    whole_approach = Approach(joined(approach.path, run_up), approach.comes_down)
                if self.keeps(whole_approach, stroke):
                    pursuit.keep(size)
                    self.take(whole_approach, stroke)
                    return True
            pursuit.undo(size)
            if last - first < MIN_PIECES and not blocked:
                break
        return False

    def take(self, approach: Approach, stroke: Floats) -> None:
        """Add a stroke behind the way to it to the stays."""
        if approach.comes_down:
            self.stays.append([])
        if len(approach.path):
            self.stays[-1].append(Leg(approach.path, cuts=False))
        self.stays[-1].append(Leg(stroke))
        end = ends_of(stroke)[1]
        self.pose = (end.x, end.y, end.angle)
        tell_share("strokes", min(self.pursuit.cleared_mm2 / self.reach_mm2, 1.0))

    def link_to(self, pose: tuple[float, float, float], turn_mm: float) -> Approach | None:
        """Return a free way from where the tool is to a pose; None where there is none, or it is
        not down yet."""
        if not self.stays:
            return None
        thick_mm = min(LINK_THICK_SHARE * self.tool_mm, self.thick_mm)
        link = self.pursuit.link(self.pose, pose, turn_mm, LINK_SHARE, thick_mm)
        if link is None:
            return None
        if len(link) < 2:
            return Approach(NO_PATH, False)
        # Between the places that were looked at it may still meet blunt stock.
        is_clear = self.stays_within(link) and self.is_free(
            moves_along(link, self.tool_mm)[0], 1.0
        )
        return Approach(link, False) if is_clear else None

    def cut_corners(self, corners: Sequence[Corner]) -> None:
        """Cut all corners, the one nearest to the tool first."""
        waiting = list(corners)
        while waiting:
            x, y, _ = self.pose
            nearest = min(waiting, key=lambda corner: math.dist(corner.vertex, (x, y)))
            waiting.remove(nearest)
            self.cut_corner(nearest)

    def cut_corner(self, corner: Corner) -> None:
        """Cut a corner by smaller and smaller arcs, as far as each keeps the limit."""
        before = corner.done or self.widest_disc(corner)
        while before is not None:
            corner.done = before
            corner.first = corner.first or before
            before = self.cut_deeper(corner, before)

    def widest_disc(self, corner: Corner) -> Disc | None:
        """Return the widest disc, up to the tool's, that lies between both walls and no others."""
        radius = self.tool_mm
        while radius > END_SHARE * self.tool_mm:
            disc = corner.disc(radius)
            if disc is not None:
                room = self.pursuit.room(*disc.centre)
                if room > radius - SLACK_SHARE * self.tool_mm:
                    return disc
            radius *= CORNER_RATIO
        return None

    def cut_deeper(self, corner: Corner, before: Disc) -> Disc | None:
        """Cut the widest step from a disc to a smaller one that keeps the limit; return the disc
        reached, or None where there is none, or no way to it."""
        end_mm = max(END_SHARE * self.tool_mm, ROUND_SLACK * corner.round_mm)
        if before.radius <= end_mm:
            return None
        far = self.where_strokes_begin(corner, before)
        ratio = corner_ratio(self.limit, before.radius, self.tool_mm, before.angle)
        widest_mm = CORNER_SHARE * (1.0 - ratio) * before.radius - THICK_SHARE * self.tool_mm
        for share in CORNER_SHARES:
            step = max(share * widest_mm, (1.0 - MAX_RATIO) * before.radius)
            after = corner.disc(max(before.radius - step, end_mm))
            if after is None:
                return None
            stroke = corner.stroke(far, after)
            if self.is_free(moves_along(stroke, self.tool_mm)[0], 0.0):
                return after
            approach = self.approach_to(stroke, 0.5 * far.radius)
            if approach is None:
                return None
            if self.cut_path(approach, stroke):
                return after
        return None

    def where_strokes_begin(self, corner: Corner, before: Disc) -> Disc:
        """Return a disc of a corner where strokes begin and end that go on from another one: that,
        or a wider one where the way round would be too short."""
        if before.radius >= ROUND_WAY_SHARE * self.tool_mm or corner.first is None:
            return before
        wider_mm = BACK_SHARE * self.tool_mm * math.tan(0.5 * before.angle)
        return corner.disc(min(before.radius + wider_mm, corner.first.radius)) or before

    def skim_walls(self, far_mm: float) -> None:
        """Cut along walls what is left as a skin beside them, if not much is left elsewhere, and
        so far before and behind it."""
        if self.pursuit.cleared_mm2 < SKIMMED_SHARE * self.reach_mm2:
            return
        points = self.stock_left()
        walls = list(MeasuredPaths(self.region)) if len(points) else []
        if not walls:
            return
        away = [points_to_segments(points, wall.segments).min(axis=1) for wall in walls]
        of_wall = np.argmin(away, axis=0)
        for number, wall in enumerate(walls):
            own = points[of_wall == number]
            lengths = np.sort([wall.nearest_to((x, y)) for x, y in own.tolist()])
            for low, high in stretches(lengths, wall, far_mm):
                stroke = wall.piece(low, high)
                approach = self.approach_to(stroke, TURN_SHARE * self.tool_mm)
                if approach is not None:
                    self.cut_path(approach, stroke)

    def cut_path(self, approach: Approach, stroke: Floats) -> bool:
        """Cut a stroke that no pursuit made behind the way into it; False where it does not keep
        the limit."""
        if not self.keeps(approach, stroke):
            return False
        self.take(approach, stroke)
        self.pursuit.add(stroke)
        return True

    def approach_to(self, stroke: Floats, widest_mm: float) -> Approach | None:
        """Return a free way to where a stroke begins: a link from where the tool is, or half a
        circle from the left, of a radius or less, for a tool that comes down at its beginning."""
        start = ends_of(stroke)[0]
        link = self.link_to((start.x, start.y, start.angle), widest_mm)
        if link is not None:
            return link
        place, aside = stroke[0, :2], left_of(start.angle)
        for share in LEAD_SHARES:
            begin = place + 2.0 * share * widest_mm * aside
            lead = np.array([[*begin, 1.0], [*place, 0.0]])
            moves = moves_along(lead, self.tool_mm)[0]
            if self.is_air(begin) and self.stays_within(lead) and self.is_free(moves, LINK_SHARE):
                return Approach(lead, True)
        return None

    def is_air(self, place: Floats) -> bool:
        """Return True if the tool meets nothing at a place (2,)."""
        hair = np.array([WALL_SHARE * self.tool_mm, 0.0])
        ends = np.array([[*(place - hair), 0.0], [*(place + hair), 0.0]])
        return all(
            self.is_free(moves_along(each, self.tool_mm)[0], 0.0) for each in (ends, ends[::-1])
        )

    def stock_left(self) -> Floats:
        """Return (n, 2) points of stock that must be cut, and is left."""
        fine, deep = END_SHARE * self.tool_mm, DEEP_SHARE * self.tool_mm
        reach = offset_shape(offset_shape(self.region, fine), -(fine + self.tool_mm - deep))
        if len(reach) == 0:
            return np.empty((0, 2))
        edge = np.concatenate([sample(path, deep) for path in reach])
        rim = self.pursuit.stock_beside(deep)
        rim = rim[inside(rim, Segments.of(reach))]
        return np.concatenate([edge[self.pursuit.stock_at(edge, 0.0)], rim])


def stretches(lengths: Floats, wall: MeasuredPath, far_mm: float) -> Iterator[tuple[float, float]]:
    """Yield the stretches of a wall about lengths along it in their order, mm, which begin and end
    so far from the nearest of them, or at a corner of the wall."""
    total = wall.total_mm
    corners = wall.reach[:-1][np.abs(wall.turns) > MIN_CORNER_RAD]
    corners = np.concatenate([[-math.inf], corners - total, corners, corners + total, [math.inf]])
    after = np.searchsorted(corners, lengths, side="right")
    is_gap = (np.diff(lengths) > 2.0 * far_mm) | (np.diff(after) > 0)
    for own in np.split(np.arange(len(lengths)), np.flatnonzero(is_gap) + 1):
        if len(own):
            low = max(lengths[own[0]] - far_mm, corners[after[own[0]] - 1])
            high = min(lengths[own[-1]] + far_mm, corners[after[own[0]]])
            if high - low < total:
                yield float(low), float(high)


def discs_about(points: Floats, wide_mm: float) -> Floats:
    """Return (n, 3) centres and radii of discs, no wider than twice a width, that hold points."""
    _, group = np.unique(np.floor(points / wide_mm), axis=0, return_inverse=True)
    discs = []
    for number in range(group.max(initial=-1) + 1):
        own = points[group.ravel() == number]
        centre = 0.5 * (own.min(axis=0) + own.max(axis=0))
        discs.append([*centre, np.hypot(*(own - centre).T).max()])
    return np.array(discs).reshape(-1, 3)


class Disc(Struct, frozen=True, eq=False):
    """A disc between two walls: its radius, mm, its centre (2,), where it touches them (2, 2), and
    the angle between their tangents there, rad."""

    radius: float
    centre: Floats
    feet: Floats
    angle: float


class Corner:
    """An inner corner between two walls, segments of a region, rounded by a radius."""

    def __init__(self, walls: Segments, vertex: Floats, round_mm: float = 0.0):
        self.walls, self.vertex, self.round_mm = walls, vertex, round_mm
        self.done: Disc | None = None
        self.first: Disc | None = None

    def beside(self, row: int, place: Floats) -> tuple[float, Floats]:
        """Return how far a place is on the left of a wall, and the normal (2,) to the left."""
        walls = self.walls
        if not walls.is_arc[row]:
            along = walls.end[row] - walls.start[row]
            normal = np.array([-along[1], along[0]]) / np.hypot(*along)
            return float((place - walls.start[row]) @ normal), normal
        arm = place - walls.centre[row]
        far, side = float(np.hypot(*arm)), float(np.sign(walls.sweep[row]))
        return side * (float(walls.radius[row]) - far), -side * arm / far

    def disc(self, radius_mm: float) -> Disc | None:
        """Return the disc of a radius that touches both walls; None where there is none."""
        place = self.vertex
        for _ in range(NEWTON_STEPS):
            (d0, n0), (d1, n1) = (self.beside(row, place) for row in (0, 1))
            cross = n0[0] * n1[1] - n0[1] * n1[0]
            if abs(cross) < 1e-3:
                return None
            a, b = radius_mm - d0, radius_mm - d1
            move = np.array([a * n1[1] - b * n0[1], b * n0[0] - a * n1[0]]) / cross
            place = place + move
            if np.hypot(*move) < 1e-9 * radius_mm:
                break
        else:
            return None
        normals = np.array([self.beside(row, place)[1] for row in (0, 1)])
        feet = place - radius_mm * normals
        turn = math.atan2(
            normals[0, 0] * normals[1, 1] - normals[0, 1] * normals[1, 0], normals[0] @ normals[1]
        )
        touches = all(self.holds(row, feet[row]) for row in (0, 1))
        return Disc(radius_mm, place, feet, math.pi - turn) if touches and turn > 0.0 else None

    def holds(self, row: int, foot: Floats) -> bool:
        """Return True if a foot on the line or circle of a wall is on the wall."""
        walls = self.walls
        if not walls.is_arc[row]:
            along = walls.end[row] - walls.start[row]
            return 0.0 <= float((foot - walls.start[row]) @ along) <= float(along @ along)
        arm, sweep = foot - walls.centre[row], float(walls.sweep[row])
        turned = math.atan2(arm[1], arm[0]) - float(walls.start_angle[row])
        return (math.copysign(1.0, sweep) * turned) % math.tau <= abs(sweep)

    def stroke(self, before: Disc, after: Disc) -> Floats:
        """Return the path (4, 3) about a disc, from and to where the one before touches."""
        rows = [
            [*before.feet[0], self.bulge(0, before.feet[0], after.feet[0])],
            [*after.feet[0], math.tan(0.25 * (math.pi - after.angle))],
            [*after.feet[1], self.bulge(1, after.feet[1], before.feet[1])],
            [*before.feet[1], 0.0],
        ]
        return np.array(rows)

    def bulge(self, row: int, start: Floats, end: Floats) -> float:
        """Return the bulge of a wall between two places on it."""
        if not self.walls.is_arc[row]:
            return 0.0
        one, other = start - self.walls.centre[row], end - self.walls.centre[row]
        turn = math.atan2(one[0] * other[1] - one[1] * other[0], one @ other)
        return math.tan(0.25 * turn)


def corners_of(region: Polylines, round_mm: float) -> list[Corner]:
    """Return the inner corners of a region, sharp ones and those rounded by a radius or less."""
    walls = Segments.of(region)
    every = np.arange(len(walls))
    following = np.where(np.append(walls.path[1:] != walls.path[:-1], True), -1, every + 1)
    first = np.flatnonzero(np.append(True, walls.path[1:] != walls.path[:-1]))
    following[following < 0] = first
    before = np.argsort(following)
    frames = Frames.of(walls)
    end = frames.tangent_at(np.ones(len(walls)))
    start = frames.tangent_at(np.zeros(len(walls)))[following]
    turn = np.arctan2(end[:, 0] * start[:, 1] - end[:, 1] * start[:, 0], (end * start).sum(axis=1))
    is_round = walls.is_arc & (walls.sweep > MIN_CORNER_RAD) & (walls.radius <= round_mm)
    is_sharp = (turn > MIN_CORNER_RAD) & ~is_round & ~is_round[following]
    middle = point_at(walls, every, np.full(len(walls), 0.5))
    return [
        *(Corner(walls[np.array([k, following[k]])], walls.end[k]) for k in every[is_sharp]),
        *(
            Corner(walls[np.array([before[k], following[k]])], middle[k], walls.radius[k])
            for k in every[is_round]
        ),
    ]
