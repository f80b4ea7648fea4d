"""A path divided into runs in which no axis turns round, each in the direction that errs less.

    parts, turns ──▶ places where it may be divided ──▶ the cheapest division ──▶ pieces

On the PIC machine a contour cut in one go showed errors that vanished when it was cut as two
halves, both from one point («maquinado en espejo», L2816-2841, L3200-3202): each half drives each
axis in one direction only, so that the play stays taken up. Here every contour becomes such runs.

Each turn of an axis must be divided somewhere on its stretch; one place may serve both axes (the
corner of a square). Only the ends of stretches need to be tried. Of all divisions the one with
the smallest greatest error is taken; then with the fewest runs; then that which drives the axes
in one direction throughout, as far as it can, so that the error is the same all over the part;
then with the smallest error over its length: two passes of dynamic programming along the path.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from camtool.geometry.distance import point_to_segment
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import Floats, Ints
from camtool.planning.reversing.residual import Residual
from camtool.planning.reversing.turns import Parts, Turns

ALIKE_MM = 1e-4
"""Predicted errors that differ by less are alike: a tenth of a micrometre, below a step."""

SAMPLES = 9
"""So many points of each part are moved by the error, to see how far from the path they come: on
a quarter of a circle the greatest distance is then found within 0.5 %."""


@dataclass(frozen=True)
class Piece:
    """From place `first` to place `last` of the parts (beyond their number on a closed path), cut
    from its end to its start when `backward`; its greatest predicted error, mm; how far off it is
    for the axes driven in their worse direction, mm; its parts' errors times lengths, mm²."""

    first: int
    last: int
    backward: bool
    error_mm: float
    spread_mm: float
    weight_mm2: float


@dataclass(frozen=True, eq=False)
class Division:
    """What a division is chosen by: the parts of a path, the turns of both axes along them, the
    residual errors of both axes; `either_way`: pieces may be cut backward."""

    parts: Parts
    turns: tuple[Turns, Turns]
    residual: tuple[Residual, Residual]
    errors: Floats
    lengths: Floats
    either_way: bool

    @classmethod
    def of(
        cls,
        parts: Parts,
        turns: tuple[Turns, Turns],
        residual: tuple[Residual, Residual],
        *,
        either_way: bool,
    ) -> Division:
        """With the predicted errors of all parts."""
        lengths = segment_lengths(parts.segments)
        return cls(parts, turns, residual, part_errors(parts, residual), lengths, either_way)

    def pieces(self) -> list[Piece]:
        """The runs of the path in its order; together they are the path."""
        if not self.parts.path.closed:
            return _cheapest(self, 0)[1]
        turns = [(t.first, t.last) for t in self.turns if len(t)]
        if not turns:
            return _cheapest(self, 0)[1]
        first, last = (np.concatenate(column) for column in zip(*turns, strict=True))
        shortest = int((last - first).argmin())
        begins = _places(self, int(first[shortest]), int(last[shortest]))
        return min((_cheapest(self, begin) for begin in begins), key=lambda each: each[0])[1]

    def ways(self, first: int, last: int) -> list[Piece]:
        """The piece between two places between which no axis turns round, in each way in which
        it may be cut."""
        ways = (1, -1) if self.either_way else (1,)
        return [self._piece(first, last, way) for way in ways]

    def _piece(self, first: int, last: int, way: int) -> Piece:
        index = np.arange(first, last) % len(self.parts)
        columns, spread_mm = [], 0.0
        for turns, residual in zip(self.turns, self.residual, strict=True):
            # An axis that stands still came in its better direction.
            sense = way * int(np.sign(turns.sense[index].sum())) or residual.better
            columns.append(int(sense > 0))
            if sense != residual.better:
                spread_mm += abs(residual.plus_mm - residual.minus_mm)
        errors = self.errors[index, columns[0], columns[1]]
        weight = float(errors @ self.lengths[index])
        return Piece(first, last, way < 0, float(errors.max()), spread_mm, weight)


def part_errors(parts: Parts, residual: tuple[Residual, Residual]) -> Floats:
    """(A, 2, 2) mm: how far each part comes from the path when X is driven towards −, + and Y
    towards −, +: the points of the part, moved by the residual errors, to the part and to the
    ones before and after it. (The path may pass nearer elsewhere, where it is as fine as the
    errors.)"""
    count, segments = len(parts), parts.segments
    rows = np.repeat(np.arange(count), SAMPLES)
    points = point_at(segments, rows, np.tile(np.linspace(0.0, 1.0, SAMPLES), count))
    near = [rows, rows - 1, rows + 1]
    near = [row % count if parts.path.closed else row.clip(0, count - 1) for row in near]
    errors = np.zeros((count, 2, 2))
    for i, x in enumerate((residual[0].minus_mm, residual[0].plus_mm)):
        for j, y in enumerate((residual[1].minus_mm, residual[1].plus_mm)):
            if x or y:
                moved = points + np.array([x, y])
                apart = np.min([point_to_segment(moved, segments[row]) for row in near], axis=0)
                errors[:, i, j] = apart.reshape(count, SAMPLES).max(axis=1)
    return errors


def drawn_error_mm(division: Division) -> float:
    """The greatest predicted error when the path is cut as it is drawn, in one go."""
    columns = []
    for axis, turns in enumerate(division.turns):
        sense, better = turns.sense, division.residual[axis].better
        # An axis that stands still stays where it was driven to last.
        last = np.maximum.accumulate(np.where(sense != 0, np.arange(len(sense)), -1))
        held = np.where(last >= 0, sense[last], better)
        columns.append((held > 0).astype(np.int64))
    rows = np.arange(len(division.parts))
    return float(division.errors[rows, columns[0], columns[1]].max())


Cost = tuple[int, float, float]
"""Pieces, their spread, and their errors over their lengths, summed up."""


def _cheapest(division: Division, begin: int) -> tuple[tuple[int, Cost], list[Piece]]:
    """The best division of the way from place `begin` once around, or to the end, with its
    greatest error in ALIKE_MM and its cost."""
    places = _places(division, begin, begin + len(division.parts))
    pieces = list(_possible(division, places))
    greatest = [0.0] + [np.inf] * (len(places) - 1)
    for i, j, piece in pieces:
        greatest[j] = min(greatest[j], max(greatest[i], piece.error_mm))
    best: list[Cost] = [(0, 0.0, 0.0)] + [(len(places), 0.0, 0.0)] * (len(places) - 1)
    came: list[tuple[int, Piece] | None] = [None] * len(places)
    for i, j, piece in pieces:
        count, spread, weight = best[i]
        cost = count + 1, spread + piece.spread_mm, weight + piece.weight_mm2
        if piece.error_mm <= greatest[-1] + ALIKE_MM and cost < best[j]:
            best[j], came[j] = cost, (i, piece)
    return (round(greatest[-1] / ALIKE_MM), best[-1]), _traced(came)


def _traced(came: Sequence[tuple[int, Piece] | None]) -> list[Piece]:
    found: list[Piece] = []
    step = came[-1]
    while step is not None:
        found.append(step[1])
        step = came[step[0]]
    return found[::-1]


def _possible(division: Division, places: list[int]) -> Iterator[tuple[int, int, Piece]]:
    """Pieces from place i to place j of `places` in all ways, in the order of i: each ends before,
    or on, the first turn that lies ahead as a whole."""
    reach = _reaches(division, np.array(places, dtype=np.int64))
    for i, first in enumerate(places):
        for j in range(i + 1, len(places)):
            if places[j] > reach[i]:
                break
            for piece in division.ways(first, places[j]):
                yield i, j, piece


def _reaches(division: Division, places: Ints) -> Floats:
    """(P,) the farthest place that no turn forbids to a piece from each of the places."""
    count = len(division.parts)
    laps = np.arange(3 if division.parts.path.closed else 1) * count
    first = np.concatenate([(t.first + laps[:, None]).ravel() for t in division.turns])
    last = np.concatenate([(t.last + laps[:, None]).ravel() for t in division.turns])
    order = np.argsort(first, kind="stable")
    # Of all turns that begin after a place, the one that ends first.
    soonest = np.minimum.accumulate(np.append(last[order], np.inf)[::-1])[::-1]
    return np.asarray(soonest[np.searchsorted(first[order], places, side="right")])


def _places(division: Division, begin: int, end: int) -> list[int]:
    """Where a path may be divided between two places, these too: the ends of all stretches, and
    where an axis of an open path begins or ends to move."""
    count, found = len(division.parts), {begin, end}
    for turns in division.turns:
        found.update(turns.first.tolist(), turns.last.tolist(), turns.moves or ())
    if division.parts.path.closed:
        found |= {place + count for place in found} | {place + 2 * count for place in found}
    return sorted(place for place in found if begin <= place <= end)
