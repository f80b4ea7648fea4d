"""Distances of points from cutting moves: from a given one, or from the nearest of many.

Distances are exact: to true lines and arcs, never to chords.

    line a→b:  |p − a − t·d|,  d = b − a,  t = clamp((p − a)·d / d², 0, 1)
    arc:       | |p − c| − r |  inside the wedge that the arc spans at its centre c, otherwise the
               distance to its nearer end. The wedge is ≤ 180°, so the signs of two cross products
               decide.

The nearest of many moves is searched for groups of neighbouring points. Boxes of the moves, of
long moves piece by piece (`HeightLayers`), give the moves within a margin of the group's box. When
the largest distance found is within the margin, no move outside can be nearer; otherwise the
margin grows to that distance. So the result is exact whatever the first margin was: a good guess
only saves time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.geometry.boxes import BoxIndex
from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.verification.cuts import CutMoves

PAIRS_AT_ONCE = 1 << 17
"""At most this many pairs of point and move are computed together: bounds memory, fits the
cache."""

GROUPS_AT_ONCE = 1 << 13
"""The near moves of this many groups are searched together: bounds memory."""

MARGIN_GROWTH = 4.0
"""The margin of a search grows by this factor while no move is found."""

MARGIN_SLACK = 1.001
"""A margin is this much larger than the distance it must reach, so that rounding cannot matter."""

ANY_CONTOUR = -1
"""The contour of a group of points that is compared with the moves of every contour."""


class SegmentTable:
    """Columns of the segments from which distances are computed."""

    def __init__(self, segments: Segments) -> None:
        start, end = segments.start, segments.end
        chord = end - start
        square = (chord**2).sum(axis=1)
        turn = np.where(segments.bulge < 0.0, -1.0, 1.0)[:, None]
        self.is_arc = segments.is_arc
        self._ax, self._ay = np.ascontiguousarray(start.T)
        self._bx, self._by = np.ascontiguousarray(end.T)
        self._dx, self._dy = np.ascontiguousarray(chord.T)
        self._over = 1.0 / np.where(square > 0.0, square, 1.0)
        self._cx, self._cy = np.ascontiguousarray(segments.centre.T)
        self._radius = segments.radius
        self._sweep = np.abs(segments.sweep)
        # Normals that point into the wedge from its two edges.
        self._ux, self._uy = np.ascontiguousarray((turn * (start - segments.centre)).T)
        self._vx, self._vy = np.ascontiguousarray((turn * (end - segments.centre)).T)

    def distances(self, points: Floats, which: Ints) -> Floats:
        """(J,) mm from point j of (J, 2) to segment which[j]."""
        arc = self.is_arc[which]
        if arc.all():
            return self._to_arcs(points[:, 0], points[:, 1], which)
        if not arc.any():
            return self._to_lines(points[:, 0], points[:, 1], which)
        found = np.empty(len(points))
        for rows, distances in ((arc, self._to_arcs), (~arc, self._to_lines)):
            found[rows] = distances(points[rows, 0], points[rows, 1], which[rows])
        return found

    def shares(self, points: Floats, which: Ints) -> Floats:
        """(J,) where on segment which[j] its point nearest to point j lies, from 0 to 1."""
        x, y = points[:, 0] - self._ax[which], points[:, 1] - self._ay[which]
        along = (x * self._dx[which] + y * self._dy[which]) * self._over[which]
        arc = np.flatnonzero(self.is_arc[which])
        row = which[arc]
        px, py = points[arc, 0] - self._cx[row], points[arc, 1] - self._cy[row]
        # u points into the wedge, at a right angle to the radius at the start.
        sine = self._ux[row] * py - self._uy[row] * px
        cosine = (self._ax[row] - self._cx[row]) * px + (self._ay[row] - self._cy[row]) * py
        angle = np.mod(np.arctan2(sine, cosine), 2.0 * np.pi)
        sweep = self._sweep[row]
        behind = angle > np.pi + 0.5 * sweep
        along[arc] = np.where(behind, 0.0, angle / sweep)
        return np.asarray(np.clip(along, 0.0, 1.0))

    def _to_lines(self, x: Floats, y: Floats, which: Ints) -> Floats:
        dx, dy = self._dx[which], self._dy[which]
        x, y = x - self._ax[which], y - self._ay[which]
        t = np.clip((x * dx + y * dy) * self._over[which], 0.0, 1.0)
        return np.asarray(np.sqrt((x - t * dx) ** 2 + (y - t * dy) ** 2))

    def _to_arcs(self, x: Floats, y: Floats, which: Ints) -> Floats:
        px, py = x - self._cx[which], y - self._cy[which]
        found = np.abs(np.sqrt(px * px + py * py) - self._radius[which])
        outside = (self._ux[which] * py < self._uy[which] * px) | (
            px * self._vy[which] < py * self._vx[which]
        )
        far = np.flatnonzero(outside)
        if len(far):
            row = which[far]
            to_start = (x[far] - self._ax[row]) ** 2 + (y[far] - self._ay[row]) ** 2
            to_end = (x[far] - self._bx[row]) ** 2 + (y[far] - self._by[row]) ** 2
            found[far] = np.sqrt(np.minimum(to_start, to_end))
        return np.asarray(found)


@dataclass(frozen=True, eq=False)
class Groups:
    """Groups of neighbouring points: group g is points[offsets[g]:offsets[g+1]], never empty.

    `margin` (G,) mm is a first guess of the distance; `contour` (G,) the only contour to compare
    with, or ANY_CONTOUR; `z` (G, 2) mm the range that the heights of a move must overlap. With a
    `height` (J,) mm of each point, the move must be within `window_mm` of that height at its point
    nearest to it (more on slopes, where a shift in XY changes the height). Moves farther away than
    `most_mm` are not found.
    """

    offsets: Ints
    margin: Floats
    contour: Ints
    z: Floats
    height: Floats | None = None
    window_mm: float = math.inf
    most_mm: float = math.inf


@dataclass(frozen=True, eq=False)
class Found:
    """(J,) distance mm, inf where no move is found, and (J,) segment, −1 there."""

    distance: Floats
    segment: Ints


class MoveIndex:
    """Cutting moves, indexed by place, contour and height."""

    def __init__(self, cuts: CutMoves) -> None:
        self.cuts = cuts
        self.contour = cuts.contour[cuts.segments.path]
        self.table = SegmentTable(cuts.segments)
        self.boxes = segment_boxes(cuts.segments)
        low, high = cuts.z.T
        length = segment_lengths(cuts.segments)
        self.gap_mm = gap_mm(cuts.segments, self.boxes, levels_of(cuts.z))
        self._slope = (high - low) / np.where(length > 0.0, length, 1.0)

    @cached_property
    def _layers(self) -> HeightLayers:
        return HeightLayers(self.cuts.segments, self.cuts.z, self._slope, self.gap_mm)

    def nearest(self, points: Floats, groups: Groups) -> Found:
        """The move nearest to each point (J, 2), and its exact distance."""
        count = len(groups.margin)
        found = Found(np.full(len(points), np.inf), np.full(len(points), -1, dtype=np.int64))
        if count == 0 or len(self.boxes) == 0:
            return found
        boxes = group_boxes(points, groups.offsets)
        everything = min(self._reach(boxes), groups.most_mm)
        margin = np.minimum(np.maximum(groups.margin * MARGIN_SLACK, POSITION_EPS_MM), everything)
        todo = np.arange(count)
        while len(todo):
            worst = np.concatenate(
                [
                    self._least(
                        points, groups, part, self._candidates(boxes, margin, part, groups), found
                    )
                    for part in np.split(todo, range(GROUPS_AT_ONCE, len(todo), GROUPS_AT_ONCE))
                ]
            )
            done = (worst <= margin[todo]) | (margin[todo] >= everything)
            grown = np.where(
                np.isfinite(worst), worst * MARGIN_SLACK, margin[todo] * MARGIN_GROWTH
            )
            margin[todo] = np.minimum(grown, everything)
            todo = todo[~done]
        far = found.distance > groups.most_mm
        found.distance[far], found.segment[far] = np.inf, -1
        return found

    def within(
        self, points: Floats, height: Floats, limits_mm: tuple[float, float]
    ) -> tuple[Ints, Ints, Floats]:
        """All pairs (point, move) within the first limit in XY and the second in height, in order,
        and their distances in XY, mm; of points (J, 2) at heights (J,) mm."""
        limit_mm, depth_mm = limits_mm
        none = np.empty(0, dtype=np.int64)
        parts: list[tuple[Ints, Ints, Floats]] = [(none, none, np.empty(0))]
        for begin in range(0, len(points) if len(self.boxes) else 0, PAIRS_AT_ONCE):
            some = points[begin : begin + PAIRS_AT_ONCE]
            there = np.repeat(height[begin : begin + PAIRS_AT_ONCE, None], 2, axis=1)
            wide = np.concatenate([some - limit_mm, some + limit_mm], axis=1)
            point, move = self._layers.pairs(wide, there, depth_mm)
            distance = self.table.distances(some[point], move)
            near = np.flatnonzero(distance <= limit_mm)
            point, move, distance = point[near], move[near], distance[near]
            z = height[begin + point]
            fits = ~self._off_height(some[point], z, move, depth_mm)
            parts.append((begin + point[fits], move[fits], distance[fits]))
        every, moves, distances = zip(*parts, strict=True)
        return np.concatenate(every), np.concatenate(moves), np.concatenate(distances)

    def _reach(self, boxes: Floats) -> float:
        """A margin, mm, within which every group finds every move."""
        both = np.concatenate([self.boxes, boxes])
        span = both[:, 2:].max(axis=0) - both[:, :2].min(axis=0)
        return float(np.hypot(span[0], span[1])) * MARGIN_SLACK + POSITION_EPS_MM

    def _candidates(
        self, boxes: Floats, margin: Floats, todo: Ints, groups: Groups
    ) -> tuple[Ints, Ints]:
        """Pairs (index into `todo`, move) of moves with a piece whose box is within the margin, in
        order."""
        wide = boxes[todo] + margin[todo, None] * np.array([-1.0, -1.0, 1.0, 1.0])
        group, move = self._layers.pairs(wide, groups.z[todo])
        wanted, z = groups.contour[todo][group], groups.z[todo][group]
        here = self.cuts.z[move]
        fits = (wanted == ANY_CONTOUR) | (wanted == self.contour[move])
        fits &= (z[:, 0] <= here[:, 1]) & (here[:, 0] <= z[:, 1])
        return group[fits], move[fits]

    def _off_height(self, points: Floats, height: Floats, move: Ints, window_mm: float) -> Any:
        """(J,) true where a move, at its place nearest to the point, is at another height."""
        begin, end = self.cuts.ends_z[move].T
        sloping = np.flatnonzero(begin != end)
        z = begin.copy()
        share = self.table.shares(points[sloping], move[sloping])
        z[sloping] += share * (end - begin)[sloping]
        return np.abs(z - height) > window_mm * (1.0 + self._slope[move])

    def _least(
        self, points: Floats, groups: Groups, todo: Ints, pairs: tuple[Ints, Ints], found: Found
    ) -> Floats:
        """Fill `found` for the groups `todo`; return the largest distance in each, mm."""
        offsets = groups.offsets
        group, move = pairs
        choices = np.bincount(group, minlength=len(todo))
        begin, sizes = offsets[todo], np.diff(offsets)[todo]
        worst = np.full(len(todo), np.inf)
        with_choice = np.flatnonzero(choices)
        first = np.cumsum(choices) - choices
        work = np.cumsum(sizes[with_choice] * choices[with_choice])
        cuts = np.searchsorted(work, np.arange(PAIRS_AT_ONCE, work[-1:].sum(), PAIRS_AT_ONCE))
        for part in np.split(with_choice, np.unique(cuts)):
            if len(part) == 0:
                continue
            samples = ranges(begin[part], sizes[part])
            many = np.repeat(choices[part], sizes[part])
            pair_move = move[ranges(np.repeat(first[part], sizes[part]), many)]
            pair_point = np.repeat(samples, many)
            distance = self.table.distances(points[pair_point], pair_move)
            if groups.height is not None:
                height = groups.height[pair_point]
                off = self._off_height(points[pair_point], height, pair_move, groups.window_mm)
                distance[off] = np.inf
            starts = np.cumsum(many) - many
            least = np.minimum.reduceat(distance, starts)
            # Of several equally near moves the last: a later cut decides what remains.
            hits = np.flatnonzero(distance <= np.repeat(least, many) + POSITION_EPS_MM)
            sample_of_pair = np.repeat(np.arange(len(samples)), many)[hits]
            chosen = hits[np.flatnonzero(np.diff(sample_of_pair, append=len(samples)))]
            found.distance[samples] = least
            found.segment[samples] = np.where(np.isinf(least), -1, pair_move[chosen])
            group_starts = np.cumsum(sizes[part]) - sizes[part]
            worst[part] = np.maximum.reduceat(least, group_starts)
        return worst


# The moves near a place: boxes of the pieces of long moves, in layers of similar heights.
#
# A diagonal across the part has a box as large as the part. Moves of total length L on an area A
# lie about A / L apart. For the search alone, moves much longer than that are divided into pieces,
# so that a box holds few other moves; distances are those of whole moves. Passes below each other
# lie at the same places: a search uses only the layers at its own height.

GAPS_PER_PIECE = 4.0
"""A piece is as long as this many gaps between moves, if `MORE_PIECES` allows it."""

MORE_PIECES = 400_000
"""Moves are divided into no more additional pieces than this: bounds memory, some 100 MB."""

PIECES_OF_LAYER = 512
"""A layer takes in moves of further heights until it has this many pieces."""


def levels_of(z: Floats) -> Ints:
    """(K,) a number for the lowest and highest point of each move, from `z` (K, 2): equal for
    equal heights, ascending from the lowest."""
    return np.unique(z, axis=0, return_inverse=True)[1].reshape(-1)


def gap_mm(segments: Segments, boxes: Floats, level: Ints | None = None) -> float:
    """The mean distance between moves of the same `level` (K,), mm; `boxes` (K, 4) are theirs.

    A point of a move lies among the total length l of its own level, on average Σ l² / Σ l.
    """
    if len(boxes) == 0:
        return 0.0
    area = float((boxes[:, 2:].max(axis=0) - boxes[:, :2].min(axis=0)).prod())
    length = np.bincount(
        np.zeros(len(boxes), np.int64) if level is None else level,
        weights=segment_lengths(segments),
    )
    around = float((length**2).sum()) / max(float(length.sum()), POSITION_EPS_MM)
    return max(area / max(around, POSITION_EPS_MM), POSITION_EPS_MM)


def boxes_of_pieces(segments: Segments, gap: float) -> tuple[Floats, Ints]:
    """(P, 4) boxes of the pieces of K moves that lie about `gap` mm apart, and (P,) the move of
    each piece. One of n pieces of an arc of sweep s has bulge tan(s / 4n)."""
    lengths = segment_lengths(segments)
    longest = max(GAPS_PER_PIECE * gap, float(lengths.sum()) / MORE_PIECES, POSITION_EPS_MM)
    parts = np.maximum(np.ceil(lengths / longest), 1.0).astype(np.int64)
    move = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(move)) - np.repeat(np.cumsum(parts) - parts, parts)
    start = point_at(segments, move, within / parts[move])
    end = point_at(segments, move, (within + 1) / parts[move])
    bulge = np.tan(np.arctan(segments.bulge[move]) / parts[move])
    return segment_boxes(Segments.between(start, end, bulge)), move


@dataclass(frozen=True, eq=False)
class _HeightLayer:
    """Pieces of moves between two heights, mm, no steeper than `slope`: an index of their boxes,
    and the move (P,) of each piece."""

    low: float
    high: float
    slope: float
    index: BoxIndex
    move: Ints


class HeightLayers:
    """The pieces of K moves that lie about `gap` mm apart, in layers. `z` (K, 2) are the lowest
    and highest points of the moves, `slope` (K,) their slopes."""

    def __init__(self, segments: Segments, z: Floats, slope: Floats, gap: float) -> None:
        self._count = len(z)
        pieces, move = boxes_of_pieces(segments, gap)
        level = levels_of(z)[move]
        # A layer begins at a new level only, so that moves in one plane are in one index.
        done = np.cumsum(np.bincount(level)) - np.bincount(level)
        layer = done[level] // PIECES_OF_LAYER
        order = np.argsort(layer, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(layer[order])) + 1) if len(order) else []
        self.layers = [
            _HeightLayer(
                float(z[move[part], 0].min()),
                float(z[move[part], 1].max()),
                float(slope[move[part]].max()),
                BoxIndex(pieces[part]),
                move[part],
            )
            for part in parts
        ]

    def pairs(self, boxes: Floats, z: Floats, window_mm: float = 0.0) -> tuple[Ints, Ints]:
        """Pairs (box, move), in order, of boxes (B, 4) that touch the box of a piece of the move;
        only of layers within the window (and more, on slopes) of the heights z (B, 2) low, high
        of the box, in which there may be moves of other heights."""
        found = [np.empty(0, dtype=np.int64)]
        for layer in self.layers:
            window = window_mm * (1.0 + layer.slope)
            rows = np.flatnonzero(
                (z[:, 0] - window <= layer.high) & (layer.low <= z[:, 1] + window)
            )
            for row, piece in layer.index.pairs(boxes[rows]):
                found.append(rows[row] * self._count + layer.move[piece])
        pairs = np.sort(np.concatenate(found))
        return np.divmod(pairs[np.diff(pairs, prepend=-1) > 0], self._count)


# Runs of neighbouring items in long columns, without Python loops.
#
# Runs are given by offsets: run g is items[offsets[g]:offsets[g+1]], never empty.


def run_offsets(labels: Ints, longest: int) -> Ints:
    """Offsets (G+1,) of the runs of equal labels (J,), cut to at most `longest` items."""
    if len(labels) == 0:
        return np.zeros(1, dtype=np.int64)
    change = np.concatenate([[0], np.flatnonzero(np.diff(labels)) + 1])
    begun = np.repeat(change, np.diff(np.append(change, len(labels))))
    begin = np.flatnonzero((np.arange(len(labels)) - begun) % longest == 0)
    return np.append(begin, len(labels))


def run_peaks(values: Floats, offsets: Ints) -> Ints:
    """(G,) index of the first largest value in each run."""
    run = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    largest = np.maximum.reduceat(values, offsets[:-1])
    hits = np.flatnonzero(values == largest[run])
    return hits[np.flatnonzero(np.diff(run[hits], prepend=-1))]


def group_boxes(points: Floats, offsets: Ints) -> Floats:
    """(G, 4) xmin, ymin, xmax, ymax of each group of points (J, 2)."""
    low = np.minimum.reduceat(points, offsets[:-1], axis=0)
    high = np.maximum.reduceat(points, offsets[:-1], axis=0)
    return np.concatenate([low, high], axis=1)


def ranges(first: Ints, count: Ints) -> Ints:
    """first[0], first[0]+1, … (count[0] of them), first[1], …"""
    skipped = np.cumsum(count) - count
    return np.repeat(first - skipped, count) + np.arange(int(count.sum()))
