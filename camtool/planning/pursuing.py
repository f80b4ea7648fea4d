"""Clear the bulk of a pocket by long strokes that pursue the edge of the stock.

    tool centre region, spiral ─pursuit, with tighter turns for narrower places─▶ strokes
      ─arcs between the walls of inner corners, from large to small─▶ more strokes
      ─each held against the limit by the kernel that proves it─▶ strokes that keep it
      ─joined within what is cleared by arcs and lines, all tangent─▶ stays
      ─what is stock all the same─▶ points, about which fronts go on (`camtool.planning.adaptive`)

The kernel `camtool.kernels.pursuit` makes the strokes. One that exceeds the limit is planned again
with a lower share of it, and left out where that does not help.
"""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.geometry.measure import Frames, path_extents, point_at, sample, signed_areas
from camtool.geometry.nesting import inside
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polylines, Segments
from camtool.kernels.engagement import Cleared
from camtool.kernels.pursuit import COLUMNS, Pursuit
from camtool.planning.strokes import (
    THICK_SHARE,
    Leg,
    ends_of,
    moves_along,
    next_in_corner,
)
from camtool.progress import tell_share

MARGIN_SHARE = 0.5
"""The pursuit measures its distance from walls grown by this part of the tool's radius."""

CELL_SHARE = 1.0 / 12.0
"""Distance of grid points over the tool's radius."""

TURN_SHARES = (0.5, 0.25, 0.1)
"""Radii of the tightest turn over the tool's radius, one after the other: places that are too
narrow for one of them are left to the next."""

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

THICK_OF_STEP = 0.2
"""Chips thinner than this part of the step beside a straight wall do not count at small limits."""

SKIN_SHARE = 6e-3
SKIN_OF_STEP = 0.3
"""No stroke begins for stock thinner than this part of the radius, or of that step."""

LINK_SHARE = 0.5
"""A link may touch the stock with this part of the limit, ..."""

LINK_THICK_SHARE = 1e-2
"""... and chips thinner than this part of the radius do not count there."""

END_SHARE = 0.0206
"""The last arc in a corner over the tool's radius."""

ROUND_SHARE = 0.03
"""Arcs of the region up to this part of the radius are rounded corners."""

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


class Pursued:
    """The clearing of one region by pursuit: its stays so far.

    `ring` and `first`: closed and open paths (n, 3) that have cut, the way down and what widens
    it; the first stay begins with the second of them.
    """

    def __init__(
        self, region: Polylines, ring: Floats, first: Floats, tool_mm: float, limit: float
    ):
        self.region, self.ring, self.tool_mm, self.limit = region, ring, tool_mm, limit
        step = 1.0 - math.cos(limit)
        self.thick_mm = min(THICK_SHARE, THICK_OF_STEP * step) * tool_mm
        boxes = path_extents(region)
        self.extents = np.stack([boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)])
        margin_mm = MARGIN_SHARE * tool_mm
        self.pursuit = Pursuit(
            pieces_of(offset_shape(region, -margin_mm)),
            margin_mm,
            self.extents,
            tool_mm,
            limit,
            0.5 * self.thick_mm,
            min(SKIN_SHARE, SKIN_OF_STEP * step) * tool_mm,
            CELL_SHARE * tool_mm,
        )
        self.pursuit.add(ring)
        self.pursuit.add(first)
        self.stays = [[Leg(first)]]
        self.pose = self.pursuit.pose(self.pursuit.size - 1)
        nowhere = np.array([-np.inf, -np.inf, np.inf, np.inf])
        self.cleared = Cleared(self.extents, tool_mm, nowhere)
        for path in (ring, first):
            self.cleared.add(moves_along(path, tool_mm)[0])

    def run(self) -> None:
        """Make all strokes, with tighter and tighter turns."""
        corners = corners_of(self.region, ROUND_SHARE * self.tool_mm)
        self.reach_mm2 = float(signed_areas(offset_shape(self.region, -self.tool_mm)).sum())
        for share in TURN_SHARES:
            self.pursue(share * self.tool_mm)
            self.cut_corners(corners, share * self.tool_mm)
        tell_share("strokes", None)

    def keeps(self, stroke: Floats) -> bool:
        """Return True if a stroke keeps to the region and the limit: then it counts as cut."""
        if not self.pursuit.stays_within(stroke, SLACK_SHARE * self.tool_mm):
            return False
        moves = moves_along(stroke, self.tool_mm)[0]
        if self.cleared.try_moves(moves, self.thick_mm, self.limit)[1] < len(moves):
            return False
        self.cleared.add(moves)
        return True

    def pursue(self, turn_mm: float) -> None:
        """Cut strokes along the edge of the stock until none is left that turns by a radius."""
        pursuit = self.pursuit
        pursuit.begin_level(turn_mm)
        while (pieces := pursuit.begin(self.pose[0], self.pose[1])) is not None:
            best, piece = pieces
            size, fit_mm = pursuit.size, FIT_SHARE * self.tool_mm
            # Found before the stroke is cut: the way must not lead through what that clears.
            link = self.link_to(pursuit.pose(piece), max(turn_mm, TURN_SHARES[0] * self.tool_mm))
            stroke, first = self.stroke_from(piece)
            if stroke is None:
                pursuit.give_up(best)
                continue
            if first > size:
                run_up = pursuit.fitted(size, first, fit_mm)
                if link is not None and len(link) > 1:
                    run_up, link = np.concatenate([link[:-1], run_up]), np.empty((0, 3))
                self.take(run_up, link, cuts=False)
                link = np.empty((0, 3))
            self.take(stroke, link)

    def stroke_from(self, piece: int) -> tuple[Floats | None, int]:
        """Return the stroke that begins at a piece, and from which piece on it cuts; None where
        none keeps the limit."""
        pursuit, size = self.pursuit, self.pursuit.size
        for share, wall_share in SHARES:
            first, last, blocked = pursuit.pursue(piece, share, wall_share, MAX_SHARE)
            if blocked:
                last = max(last - CUT_OFF_PIECES, size)
                pursuit.undo(last)
            if last - first >= MIN_PIECES:
                stroke = pursuit.fitted(first, last, FIT_SHARE * self.tool_mm)
                if self.keeps(stroke):
                    pursuit.keep(size)
                    return stroke, first
            pursuit.undo(size)
            if last - first < MIN_PIECES and not blocked:
                break
        return None, size

    def take(self, path: Floats, link: Floats | None, *, cuts: bool = True) -> None:
        """Add a path behind a link, or (None) in another stay."""
        if link is None:
            self.stays.append([])
        elif len(link) > 1:
            self.stays[-1].append(Leg(link, cuts=False))
        self.stays[-1].append(Leg(path, cuts))
        end = ends_of(path)[1]
        self.pose = (end.x, end.y, end.angle)
        tell_share("strokes", min(self.pursuit.cleared_mm2 / self.reach_mm2, 1.0))

    def link_to(self, pose: tuple[float, float, float], turn_mm: float) -> Floats | None:
        """Return a free way from where the tool is to a pose."""
        thick_mm = min(LINK_THICK_SHARE * self.tool_mm, self.thick_mm)
        link = self.pursuit.link(self.pose, pose, turn_mm, LINK_SHARE, thick_mm)
        if link is None or len(link) < 2:
            return link
        # Between the places that were looked at it may still meet blunt stock.
        moves = moves_along(link, self.tool_mm)[0]
        meets = self.cleared.try_moves(moves, self.thick_mm, self.limit)[1] < len(moves)
        return None if meets else link

    def cut_corners(self, corners: list[Corner], turn_mm: float) -> None:
        """Cut corners by smaller and smaller arcs, after one of a radius between their walls."""
        end_mm = END_SHARE * self.tool_mm
        for corner in corners:
            before, radius = None if corner.is_cut else corner.disc(turn_mm), turn_mm
            while before is not None and radius > end_mm:
                if self.pursuit.room(*before.centre) < radius - SLACK_SHARE * self.tool_mm:
                    break
                radius = next_in_corner(radius, self.tool_mm, self.limit, before.angle)
                radius = max(radius, end_mm)
                after = corner.disc(radius)
                if after is None:
                    break
                stroke = corner.stroke(before, after)
                # The disc before may be there and not be cleared: then no way leads to its wall.
                start = ends_of(stroke)[0]
                link = self.link_to((start.x, start.y, start.angle), radius)
                if link is None or not self.keeps(stroke):
                    break
                corner.is_cut = True
                self.take(stroke, link)
                self.pursuit.add(stroke)
                before = after

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
    """A disc between two walls: its centre (2,), where it touches them (2, 2), and the angle
    between their tangents there, rad."""

    centre: Floats
    feet: Floats
    angle: float


class Corner:
    """An inner corner between two walls, segments of a region."""

    def __init__(self, walls: Segments, vertex: Floats):
        self.walls, self.vertex = walls, vertex
        self.is_cut = False

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
        return Disc(place, feet, math.pi - turn) if touches and turn > 0.0 else None

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
        *(Corner(walls[np.array([before[k], following[k]])], middle[k]) for k in every[is_round]),
    ]
