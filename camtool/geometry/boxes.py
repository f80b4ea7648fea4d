"""Which boxes are near each other: the first, broad look before any exact one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.polylines import Segments

PAIRS_AT_A_TIME = 1 << 16
"""How many pairs of boxes are handled at a time: it bounds the memory."""

MOST_LOOKS = 4_000_000_000
"""A sweep that would have to look at more pairs of boxes than this is shortened."""


def touching_boxes(
    boxes: Floats, same: Ints, differ: Ints, asked: Bools, *, most: int
) -> tuple[Ints, Ints]:
    """Rows (J,), (J,), the lesser first, of boxes (K, 4) that touch; each pair once.

    Both have the same number in `same` (K,), different ones in `differ` (K,), and one of them is
    `asked` for (K,). No more than `most` pairs, and none of boxes that come late in a sweep that
    would look at more than MOST_LOOKS: both bound time and memory, far beyond any real drawing.
    """
    from camtool.kernels.box_sweep import touching

    along_x, along_y = boxes, boxes[:, [1, 0, 3, 2]]
    work, turned, order = min(
        ((_looks(way), number, np.argsort(way[:, 0], kind="stable"))
         for number, way in enumerate((along_x, along_y))),
        key=lambda item: item[:2],
    )  # fmt: skip
    if work > MOST_LOOKS:
        order = order[: int(len(order) * MOST_LOOKS / work)]
    way = (along_y if turned else along_x)[order]
    one, other = touching(way, same[order], differ[order], asked[order], most)
    one, other = order[one], order[other]
    return np.minimum(one, other), np.maximum(one, other)


def _looks(boxes: Floats) -> int:
    """How many pairs of boxes a sweep along their first column looks at."""
    begins = np.sort(boxes[:, 0])
    return int(np.searchsorted(begins, boxes[:, 2], side="right").sum()) - int(
        np.arange(len(boxes), dtype=np.int64).sum()
    )


def box_pairs(boxes_a: Floats, boxes_b: Floats, *, reach_mm: float) -> Iterator[tuple[Ints, Ints]]:
    """Rows (J,), (J,) of all boxes xmin, ymin, xmax, ymax no farther apart than `reach_mm`.

    Boxes of `b` are sorted by xmin; the running maximum of their xmax is sorted too, so what may
    reach a box of `a` is one stretch of them. Pairs come in batches that bound the memory.
    """
    order = np.argsort(boxes_b[:, 0], kind="stable")
    sorted_b = boxes_b[order]
    first = np.searchsorted(np.maximum.accumulate(sorted_b[:, 2]), boxes_a[:, 0] - reach_mm)
    last = np.searchsorted(sorted_b[:, 0], boxes_a[:, 2] + reach_mm, side="right")
    counts = np.maximum(last - first, 0)
    ends = np.cumsum(counts)
    begin = 0
    while begin < len(boxes_a):
        done = ends[begin - 1] if begin else 0
        stop = int(np.searchsorted(ends, done + PAIRS_AT_A_TIME, side="right"))
        stop = max(stop, begin + 1)
        count = counts[begin:stop]
        row_a = np.repeat(np.arange(begin, stop), count)
        within = np.arange(len(row_a)) - np.repeat(np.cumsum(count) - count, count)
        row_b = np.repeat(first[begin:stop], count) + within
        low = np.maximum(boxes_a[row_a, :2], sorted_b[row_b, :2])
        high = np.minimum(boxes_a[row_a, 2:], sorted_b[row_b, 2:])
        near = (low <= high + reach_mm).all(axis=1)
        yield row_a[near], order[row_b[near]]
        begin = stop


# Segments in the form the kernels of offsets take, with a tree of boxes over them.


@dataclass(frozen=True, eq=False)
class Curves:
    """`rows` (K, 11) of camtool.kernels.offset_curves, their `boxes` (K, 4) and the `tree` of
    camtool.kernels.box_tree over these."""

    rows: Floats
    boxes: Floats
    tree: Floats

    @classmethod
    def of(cls, segments: Segments, *, margin_mm: float = 0.0) -> Curves:
        """The segments, with boxes that are wider by a margin all round."""
        from camtool.kernels.box_tree import tree_of
        from camtool.kernels.offset_curves import curve_boxes

        rows = curve_rows_of(segments)
        boxes = curve_boxes(rows, margin_mm)
        return cls(rows, boxes, tree_of(boxes))


def curve_rows_of(segments: Segments) -> Floats:
    """(K, 11) rows of camtool.kernels.offset_curves."""
    from camtool.kernels.offset_curves import curve_rows

    columns = (segments.start, segments.end, segments.bulge)
    return curve_rows(*(np.ascontiguousarray(column) for column in columns))
