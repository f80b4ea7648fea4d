"""Distances of points from cutting moves: from the nearest of many, or from all that are near.

Distances are exact: to true lines and arcs, never to chords.

    line a→b:  |p − a − t·d|,  d = b − a,  t = clamp((p − a)·d / d², 0, 1)
    arc:       | |p − c| − r |  inside the wedge that the arc spans at its centre c, otherwise the
               distance to its nearer end. The wedge is ≤ 180°, so the signs of two cross products
               decide.

`camtool.kernels.near` finds the moves within a limit of each point. Where no limit is given, it
grows until a move is found: what is nearest within a limit is nearest of all."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Indices, Ints
from camtool.geometry.boxes import LIMIT_GROWTH, moves_of
from camtool.kernels import near as at
from camtool.kernels.near import nearest, pairs
from camtool.verification.cuts import CutMoves

if TYPE_CHECKING:
    from camtool.kernels.near import Moves

ANY_CONTOUR = -1
"""The contour of points that are compared with the moves of every contour."""


class NearestMoves(Struct, frozen=True, eq=False):
    """The nearest move to each of J points: `distance` (J,), mm, inf if none was found, and
    `segment` (J,), −1 then."""

    distance: Floats
    segment: Ints


class MoveIndex:
    """Cutting moves, indexed for searches by place, contour and height; the tables are made by the
    first search."""

    def __init__(self, cuts: CutMoves) -> None:
        self.cuts = cuts

    def contour_of(self, segment: Ints) -> Indices:
        """Return (J,) the contour of each of these segments (J,)."""
        return self.cuts.contour[self.cuts.row[segment]]

    @cached_property
    def _offsets(self) -> Ints:
        """(C + 1,) where the segments of each contour begin, and where those of the last end."""
        every = np.arange(self.cuts.contour_count + 1, dtype=np.int32)
        return np.searchsorted(self.cuts.contour[self.cuts.row], every)

    @cached_property
    def _moves(self) -> Moves:
        return moves_of(self.cuts.segments, self.cuts.ends_z)

    def nearest(
        self, points: Floats, height: Floats, choice: Ints | None, limits_mm: tuple[float, float]
    ) -> NearestMoves:
        """Return the nearest move to each of points (J, 2) at heights (J,), mm: within the first
        limit in XY, and within the second in height at its nearest place (more on slopes, where a
        shift in XY changes the height). Of equally near moves the last is returned. `choice` (J,):
        the only contour to search, equal for consecutive points of one contour; None: all."""
        if len(points) == 0:  # the tables need not be made
            return NearestMoves(np.empty(0), np.empty(0, dtype=np.int64))
        places = np.column_stack([points, height])
        return NearestMoves(
            *nearest(self._moves, places, self._runs(choice, len(points)), limits_mm)
        )

    def nearest_of_all(self, points: Floats, height: Floats, from_mm: float) -> NearestMoves:
        """Return the nearest move to each point at any distance and height; the search begins
        within `from_mm`."""
        nearest_moves = NearestMoves(
            np.full(len(points), np.inf), np.full(len(points), -1, dtype=np.int64)
        )
        remaining, limit = np.arange(len(points)), from_mm
        while len(remaining) and len(self.cuts.segments):
            found_now = self.nearest(points[remaining], height[remaining], None, (limit, math.inf))
            nearest_moves.distance[remaining], nearest_moves.segment[remaining] = (
                found_now.distance,
                found_now.segment,
            )
            remaining, limit = remaining[np.isinf(found_now.distance)], limit * LIMIT_GROWTH
        return nearest_moves

    def pairs_within(
        self, points: Floats, height: Floats, limits_mm: tuple[float, float]
    ) -> tuple[Ints, Ints, Floats]:
        """Return all pairs (point, move) within the limits of `nearest`, in order, as two index
        arrays, and their distances in XY, mm."""
        return pairs(self._moves, np.column_stack([points, height]), limits_mm)

    def shares(self, points: Floats, indices: Ints) -> Floats:
        """Return (J,) the position along segment indices[j], from 0 to 1, of its point nearest to
        point j."""
        moves = self._moves
        start = moves.start[indices]
        x, y = (points - start).T
        dx, dy = (moves.end[indices] - start).T
        square = dx * dx + dy * dy
        along = (x * dx + y * dy) / np.where(square > 0.0, square, 1.0)
        arc = np.flatnonzero(moves.arc[indices] >= 0)
        table = moves.arcs[moves.arc[indices[arc]]]
        centre = table[:, [at.CX, at.CY]]
        px, py = (points[arc] - centre).T
        ax, ay = (start[arc] - centre).T
        # u points into the wedge, at a right angle to the radius at the start.
        sine = table[:, at.UX] * py - table[:, at.UY] * px
        angle = np.mod(np.arctan2(sine, ax * px + ay * py), 2.0 * np.pi)
        sweep = table[:, at.SWEEP]
        along[arc] = np.where(angle > np.pi + 0.5 * sweep, 0.0, angle / sweep)
        return np.asarray(np.clip(along, 0.0, 1.0))

    def _runs(self, choice: Ints | None, count: int) -> Ints:
        """Group consecutive points that are compared with the same contour.

        Returns (R, 4), a row for each group: its first point and the end of its points, the first
        move and the end of the moves of that contour. Without `choice`, all `count` points are one
        group, which is compared with all moves."""
        if choice is None:
            return np.array([[0, count, 0, len(self.cuts.segments)]])
        offsets = run_offsets(choice, max(count, 1))
        contour = choice[offsets[:-1]]
        every = contour == ANY_CONTOUR
        low = np.where(every, 0, self._offsets[contour])
        high = np.where(every, len(self.cuts.segments), self._offsets[contour + 1])
        return np.column_stack([offsets[:-1], offsets[1:], low, high])


# Runs of neighbouring items in long columns, without Python loops.
#
# Runs are given by offsets: run g is items[offsets[g]:offsets[g+1]], never empty.


def run_offsets(labels: Ints | Indices, longest: int) -> Ints:
    """Return the offsets (G + 1,) of runs of equal labels (J,); runs longer than `longest` are
    divided."""
    if len(labels) == 0:
        return np.zeros(1, dtype=np.int64)
    change = np.concatenate([[0], np.flatnonzero(np.diff(labels)) + 1])
    run_begin = np.repeat(change, np.diff(np.append(change, len(labels))))
    begin = np.flatnonzero((np.arange(len(labels)) - run_begin) % longest == 0)
    return np.append(begin, len(labels))


def run_peaks(values: Floats, offsets: Ints) -> Ints:
    """Return (G,) the index of the largest value in each run, of equal values the first."""
    run = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
    largest = np.maximum.reduceat(values, offsets[:-1])
    hits = np.flatnonzero(values == largest[run])
    return hits[np.flatnonzero(np.diff(run[hits], prepend=-1))]


def ranges(first: Ints, count: Ints) -> Ints:
    """Return the concatenated index ranges first[k], first[k] + 1, … with count[k] indices
    each."""
    skipped = np.cumsum(count) - count
    return np.repeat(first - skipped, count) + np.arange(int(count.sum()))
