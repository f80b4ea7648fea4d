"""Search for pairs of boxes near each other, before anything is computed exactly.

`BoxIndex` finds which of its boxes touch others; `box_pairs` and `near_points` use it.
`touching_boxes` gives the pairs within one set, up to a bound. `IndexedCurves` are segments in the
form of the compiled loops, with the tree of boxes that those loops search themselves."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, columns_of, distinct
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import Segments
from camtool.kernels import near
from camtool.kernels.chaining import touching
from camtool.kernels.move_tree import hilbert_order
from camtool.kernels.near import Moves
from camtool.kernels.offsets import curve_boxes, curve_rows, tree_of

PAIRS_AT_A_TIME = 1 << 16

FAN = 16
"""Number of boxes in a block of an index."""

BLOCKS_AT_A_TIME = PAIRS_AT_A_TIME // FAN

IN_ORDER = 2048
"""An index of no more boxes than this keeps their order: sorting takes longer than it saves."""

MIN_LIMIT_MM, LIMIT_GROWTH = 1e-6, 4.0
"""A search for the nearest move begins within a small limit, at least the first, and multiplies it
by the second while none is found."""

NOWHERE = (np.inf, np.inf, -np.inf, -np.inf)
"""A box that touches none."""

MAX_COMPARISONS = 4_000_000_000
"""A sweep that would have to examine more pairs of boxes than this is shortened."""


class BoxIndex:
    """A search tree over boxes (K, 4), xmin, ymin, xmax, ymax, that finds those which touch other
    boxes.

    `FAN` boxes that lie near each other are a block, `FAN` blocks one of the next level, up to a
    single one; each level is four arrays, without pointers. A search goes down level by level, for
    many boxes at once, into the blocks that they touch. Few boxes stay in the given order, in
    which those of a path are neighbours; many are sorted along Hilbert's curve, since paths that
    surround each other are not neighbours. The order affects the time alone, not the result."""

    def __init__(self, boxes: Floats) -> None:
        self._count = len(boxes)
        self._order = np.arange(len(boxes))
        if len(boxes) > IN_ORDER:
            self._order = hilbert_order(boxes[:, :2], boxes[:, 2:])
        level, self._levels = boxes[self._order], list[tuple[Floats, ...]]()
        while not self._levels or len(level) > 1:
            padded = np.full((max(-(-len(level) // FAN), 1) * FAN, 4), NOWHERE)
            padded[: len(level)] = level
            blocks = padded.reshape(-1, FAN, 4)
            self._levels.insert(0, tuple(np.ascontiguousarray(blocks.transpose(2, 0, 1))))
            low, high = blocks[:, :, :2].min(axis=1), blocks[:, :, 2:].max(axis=1)
            level = np.concatenate([low, high], axis=1)

    def touching(self, boxes: Floats) -> tuple[Ints, Ints]:
        """Return the rows (J,), (J,) of all pairs of a box (B, 4) and one of the index that have a
        point in common, sorted."""
        hits = [one * self._count + other for one, other in self.pairs(boxes)]
        pairs = np.sort(np.concatenate([np.empty(0, dtype=np.int64), *hits]))
        one, other = np.divmod(pairs, max(self._count, 1))
        return one, other

    def pairs(self, boxes: Floats) -> Iterator[tuple[Ints, Ints]]:
        """Yield the rows of pairs of a box and one of the index that have a point in common, in
        batches that bound the memory.

        Rows of `boxes` never descend, those of the index come in any order."""
        columns = np.ascontiguousarray(boxes.T)
        waiting = [(0, np.arange(len(boxes)), np.zeros(len(boxes), dtype=np.int64))]
        while waiting:
            depth, row, block = waiting.pop()
            if depth == len(self._levels):
                yield row, self._order[block]
            elif len(row) > BLOCKS_AT_A_TIME:
                for begin in reversed(range(0, len(row), BLOCKS_AT_A_TIME)):
                    batch = slice(begin, begin + BLOCKS_AT_A_TIME)
                    waiting.append((depth, row[batch], block[batch]))
            else:
                low_x, low_y, high_x, high_y = self._levels[depth]
                touch = low_x[block] <= columns[2][row, None]
                touch &= high_x[block] >= columns[0][row, None]
                touch &= low_y[block] <= columns[3][row, None]
                touch &= high_y[block] >= columns[1][row, None]
                one, inner = np.divmod(np.flatnonzero(touch), FAN)
                waiting.append((depth + 1, row[one], block[one] * FAN + inner))


def box_pairs(boxes_a: Floats, boxes_b: Floats, *, reach_mm: float) -> Iterator[tuple[Ints, Ints]]:
    """Yield the rows (J,), (J,) of all pairs of boxes, xmin, ymin, xmax, ymax, no farther apart
    than `reach_mm`.

    They come in batches that bound the memory, sorted by the rows of `boxes_a`, and for each of
    these by the left edges in `boxes_b`."""
    one, other = BoxIndex(boxes_b).touching(_grown_boxes(boxes_a, reach_mm))
    low = np.maximum(boxes_a[one, :2], boxes_b[other, :2])
    high = np.minimum(boxes_a[one, 2:], boxes_b[other, 2:])
    is_near = columns_of(low <= high + reach_mm).all(axis=0)
    one, other = one[is_near], other[is_near]
    order = np.lexsort((boxes_b[other, 0], one))
    for begin in range(0, len(order), PAIRS_AT_A_TIME):
        batch = order[begin : begin + PAIRS_AT_A_TIME]
        yield one[batch], other[batch]


def near_points(points: Floats, places: Floats, reach_mm: float | Floats) -> tuple[Ints, Ints]:
    """Return the rows (J,), (J,), sorted, of all pairs of a point (P, 2) and a place (K, 2) no
    farther apart than `reach_mm`, a number or one for each point (P,)."""
    search_boxes = _grown_boxes(np.hstack([points, points]), reach_mm)
    one, other = BoxIndex(np.hstack([places, places])).touching(search_boxes)
    difference = points[one] - places[other]
    is_near = np.sqrt((difference**2).sum(axis=1)) <= np.broadcast_to(reach_mm, len(points))[one]
    return one[is_near], other[is_near]


def _grown_boxes(boxes: Floats, reach_mm: float | Floats) -> Floats:
    """Return the boxes grown by the reach on all sides, and by one more unit in the last place, so
    that rounding excludes nothing."""
    reach = np.reshape(reach_mm, (-1, 1))
    low, high = boxes[:, :2] - reach, boxes[:, 2:] + reach
    return np.concatenate([np.nextafter(low, -np.inf), np.nextafter(high, np.inf)], axis=1)


def touching_boxes(
    boxes: Floats, same: Ints, differ: Ints, is_searched: Bools, *, max_pairs: int
) -> tuple[Ints, Ints]:
    """Return the rows (J,), (J,), the lesser first, of pairs of boxes (K, 4) that touch; each pair
    once.

    A pair counts if both have the same number in `same` (K,), different ones in `differ` (K,), and
    `is_searched` (K,) is true for at least one. Two bounds on time and memory, far beyond any real
    drawing, cut the result short: `max_pairs` pairs, and MAX_COMPARISONS comparisons in the sweep.
    """
    along_x, along_y = boxes, boxes[:, [1, 0, 3, 2]]
    work, swapped, order = min(
        ((_count_comparisons(spans), number, np.argsort(spans[:, 0], kind="stable"))
         for number, spans in enumerate((along_x, along_y))),
        key=lambda item: item[:2],
    )  # fmt: skip
    if work > MAX_COMPARISONS:
        order = order[: int(len(order) * MAX_COMPARISONS / work)]
    spans = (along_y if swapped else along_x)[order]
    one, other = touching(spans, same[order], differ[order], is_searched[order], max_pairs)
    one, other = order[one], order[other]
    return np.minimum(one, other), np.maximum(one, other)


def _count_comparisons(boxes: Floats) -> int:
    """Count the pairs of boxes that a sweep along their first column compares."""
    begins = np.sort(boxes[:, 0])
    return int(np.searchsorted(begins, boxes[:, 2], side="right").sum()) - int(
        np.arange(len(boxes), dtype=np.int64).sum()
    )


class IndexedCurves(Struct, frozen=True, eq=False):
    """`rows` (K, 11) of camtool.kernels.offsets, their `boxes` (K, 4) and the `tree` of
    camtool.kernels.offsets over these."""

    rows: Floats
    boxes: Floats
    tree: Floats

    @classmethod
    def of(cls, segments: Segments, *, margin_mm: float = 0.0) -> IndexedCurves:
        """Return the segments as rows, with boxes grown by a margin on all sides, and the tree
        over these."""
        rows = curve_rows_of(segments)
        boxes = curve_boxes(rows, margin_mm)
        return cls(rows, boxes, tree_of(boxes))


def curve_rows_of(segments: Segments) -> Floats:
    """Return the segments as rows (K, 11) of camtool.kernels.offsets."""
    columns = (segments.start, segments.end, segments.bulge)
    return curve_rows(*(np.ascontiguousarray(column) for column in columns))


def moves_of(segments: Segments, heights: Floats | None = None) -> Moves:
    """Return the segments in the form that `camtool.kernels.near` takes.

    `heights` (K, 2) mm are those of their starts and ends, 0 if not given."""
    rows = np.flatnonzero(segments.bulge)
    arc = np.broadcast_to(np.int32(-1), len(segments))
    if len(rows):
        arc = np.full(len(segments), -1, dtype=np.int32)
        arc[rows] = np.arange(len(rows))
    bent = segments[rows]
    turn = np.where(bent.bulge < 0.0, -1.0, 1.0)[:, None]
    arcs = np.empty((len(rows), near.COLUMNS))
    arcs[:, [near.CX, near.CY]], arcs[:, near.RADIUS] = bent.centre, bent.radius
    # Normals that point into the wedge from its two edges.
    arcs[:, [near.UX, near.UY]] = turn * (bent.start - bent.centre)
    arcs[:, [near.VX, near.VY]] = turn * (bent.end - bent.centre)
    arcs[:, near.SWEEP] = np.abs(bent.sweep)
    arcs[:, [near.LOW_X, near.LOW_Y, near.HIGH_X, near.HIGH_Y]] = segment_boxes(bent)
    if heights is None:
        heights = np.broadcast_to(0.0, (len(segments), 2))
    return Moves(segments.start, segments.end, heights, arc, arcs)


def distances_from(points: Floats, moves: Moves) -> Floats:
    """Return the distance (P,) mm, seen from above, of each point (P, 2) from the nearest move;
    inf without any move."""
    places = np.column_stack([points, np.zeros(len(points))])
    distance = np.full(len(points), np.inf)
    if not len(moves.start):
        return distance
    # The search compares a point with all moves within its limit: so it begins with a small one.
    span = sum(np.ptp(columns_of(ends), axis=1).max() for ends in (moves.start, moves.end))
    limit_mm = max(span / len(moves.start), MIN_LIMIT_MM)
    while len(rows := np.flatnonzero(np.isinf(distance))):
        every = np.array([[0, len(rows), 0, len(moves.start)]])
        distance[rows], _ = near.nearest(moves, places[rows], every, (limit_mm, np.inf))
        limit_mm *= LIMIT_GROWTH
    return distance


def nearest_pairs(
    points: Floats, moves: Moves, times: float, slack_mm: float
) -> tuple[Floats, Ints, Ints]:
    """Return the distance (P,) mm of each point (P, 2) from the nearest move, and the rows (J,),
    (J,) of pairs of a point and a move nearly as near.

    A move is in a pair if its distance is at most `times` the nearest one plus `slack_mm`."""
    distance = distances_from(points, moves)
    reach = times * distance + slack_mm
    places = np.column_stack([points, np.zeros(len(points))])
    pairs = [np.empty((2, 0), dtype=np.int64)]
    # One search has one reach, so that points with similar ones are searched for together.
    octave = np.frexp(reach)[1]
    for each in distinct(octave):
        rows = np.flatnonzero(octave == each)
        point, move, gap = near.pairs(moves, places[rows], (float(reach[rows].max()), np.inf))
        is_near = gap <= reach[rows[point]]
        pairs.append(np.stack([rows[point[is_near]], move[is_near]]))
    point, move = np.concatenate(pairs, axis=1)
    return distance, point, move
