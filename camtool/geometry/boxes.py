"""Which boxes are near each other: the first, broad look before any exact one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.geometry.polylines import Floats, Ints

PAIRS_AT_A_TIME = 1 << 16
"""How many pairs of boxes are handled at a time: it bounds the memory."""


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
