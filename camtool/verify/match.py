"""Which wanted contour and which wanted circle each decoded row belongs to.

Contours may overlap or share ends, so the nearest move of a point says little. A decoded contour
belongs to the wanted contour that is nearest to most of its samples and covers all of them within
the tolerance; when that one does not cover it, to the next by that count (`MOST_TRIES` are tried).
A contour that no single wanted one covers (a foreign program may run several in one go, or too
much) is taken row by row: a row belongs where all of its inner samples are nearest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.verify.circles import Circle
from camtool.verify.compare import ANY_CONTOUR, Found, Groups, Target
from camtool.verify.cuts import CutMoves, Samples
from camtool.verify.runs import ranges, run_offsets

MOST_TRIES = 4
"""So many wanted contours are tried for a decoded one."""

SAMPLES_PER_GROUP = 64
"""Neighbouring samples that share one search for near moves."""


@dataclass(frozen=True, eq=False)
class Match:
    """What each of the N decoded rows belongs to, in the moves that it is compared with.

    `contour` (N,) −1 for rows that do not cut; `only` (N,) that contour when the slides may be
    compared with it alone, else ANY_CONTOUR; `circle` (N,) index of the full circle that the row
    follows, −1; `apart_mm` (N,) largest distance of the row's samples.
    """

    contour: Ints
    only: Ints
    circle: Ints
    apart_mm: Floats


@dataclass(frozen=True, eq=False)
class Goal:
    """The wanted moves, their full circles, and how far a decoded contour may be from its own."""

    target: Target
    circles: list[Circle]
    limit_mm: float


def own_match(cuts: CutMoves, circles: list[Circle]) -> Match:
    """Each row belongs to itself: for programs with nothing to compare them with."""
    count = len(cuts.contour)
    return Match(cuts.contour, cuts.contour, _circle_of_row(circles, count), np.zeros(count))


def match_contours(cuts: CutMoves, samples: Samples, found: Found, goal: Goal) -> Ints:
    """(S,) the wanted contour that the sample's decoded contour belongs to, ANY_CONTOUR where
    there is none. `found` is then the nearest move of that contour: changed in place."""
    wanted = goal.target
    mine = cuts.contour[cuts.segments.path[samples.segment]]
    belongs = np.full(len(mine), ANY_CONTOUR, dtype=np.int64)
    if len(mine) == 0 or len(wanted.contour) == 0:
        return belongs
    begin = run_offsets(mine, len(mine))
    for candidate in _candidates(mine, wanted.contour[found.segment]):
        open_ = np.flatnonzero((belongs[begin[:-1]] == ANY_CONTOUR) & (candidate >= 0))
        if len(open_) == 0:
            break
        which = ranges(begin[open_], np.diff(begin)[open_])
        choice = np.repeat(candidate[open_], np.diff(begin)[open_])
        near = _nearest_of(samples.points[which], samples.segment[which], choice, wanted)
        starts = np.cumsum(np.diff(begin)[open_]) - np.diff(begin)[open_]
        fits = np.maximum.reduceat(near.distance, starts) <= goal.limit_mm
        fitting = np.repeat(fits, np.diff(begin)[open_])
        taken = which[fitting]
        belongs[taken] = choice[fitting]
        found.distance[taken] = near.distance[fitting]
        found.segment[taken] = near.segment[fitting]
    return belongs


def _candidates(mine: Ints, nearest: Ints) -> list[Ints]:
    """For each try (C,): the wanted contour with the most samples, the next …; −1 when no more.

    `mine` (S,) is the decoded contour of each sample (ascending), `nearest` (S,) the wanted one.
    """
    pairs, votes = np.unique(np.column_stack([mine, nearest]), axis=0, return_counts=True)
    order = np.lexsort((pairs[:, 1], -votes, pairs[:, 0]))
    contour, choice = pairs[order].T
    offsets = run_offsets(contour, len(contour))
    rank = np.arange(len(contour)) - np.repeat(offsets[:-1], np.diff(offsets))
    tries = []
    for number in range(min(MOST_TRIES, int(rank.max()) + 1)):
        column = np.full(len(offsets) - 1, -1, dtype=np.int64)
        here = rank == number
        column[np.repeat(np.arange(len(column)), np.diff(offsets))[here]] = choice[here]
        tries.append(column)
    return tries


def _nearest_of(points: Floats, segment: Ints, choice: Ints, wanted: Target) -> Found:
    """The nearest move of the chosen contours (S,) for points (S, 2) on these segments (S,)."""
    offsets = run_offsets(segment, SAMPLES_PER_GROUP)
    count = len(offsets) - 1
    any_z = np.tile([-np.inf, np.inf], (count, 1))
    return wanted.nearest(points, Groups(offsets, np.zeros(count), choice[offsets[:-1]], any_z))


def match_rows(cuts: CutMoves, samples: Samples, belongs: Ints, found: Found, goal: Goal) -> Match:
    """What each row of `cuts` belongs to, its samples taken together; `belongs` (S,) and `found`
    as `match_contours` leaves them."""
    wanted, count = goal.target, len(cuts.contour)
    rows = cuts.segments.path[samples.segment]
    match = Match(
        contour=np.full(count, -1, dtype=np.int64),
        only=np.full(count, ANY_CONTOUR, dtype=np.int64),
        circle=np.full(count, -1, dtype=np.int64),
        apart_mm=np.zeros(count),
    )
    if len(rows) == 0 or len(wanted.contour) == 0:
        return match
    offsets = run_offsets(rows, len(rows))
    begin, row = offsets[:-1], rows[offsets[:-1]]
    middle = begin + np.diff(offsets) // 2
    nearest = wanted.contour[found.segment]
    circle = _circle_of_row(goal.circles, len(wanted.cuts.contour))[
        wanted.cuts.segments.path[found.segment]
    ]
    known = belongs[begin] != ANY_CONTOUR
    match.contour[row] = np.where(known, belongs[begin], nearest[middle])
    match.only[row] = np.where(known, belongs[begin], _unanimous(nearest, offsets))
    match.circle[row] = _unanimous(circle, offsets)
    match.apart_mm[row] = np.maximum.reduceat(found.distance, begin)
    return match


def _unanimous(values: Ints, offsets: Ints) -> Ints:
    """(R,) the value of all samples between the ends of each run (at its ends a row touches its
    neighbours), −1 where they differ."""
    inner = np.column_stack([offsets[:-1] + 1, offsets[1:] - 1]).ravel()
    low = np.minimum.reduceat(values, inner)[::2]
    high = np.maximum.reduceat(values, inner)[::2]
    return np.where(low == high, low, -1)


def _circle_of_row(circles: list[Circle], count: int) -> Ints:
    of_row = np.full(count, -1, dtype=np.int64)
    for index, circle in enumerate(circles):
        of_row[circle.first_row : circle.last_row + 1] = index
    return of_row
