"""A tree of boxes over moves that lie about the plane in any order, as spirals and hatches do.

The rows of a spiral that follow each other surround all that lies inside, so the upper nodes of a
tree in their order (`camtool.kernels.offsets`) all hold every point. Here the leaves take the
moves along Hilbert's curve through their middles, which stays in a square until it is filled: what
is near in the list is near in the plane. A node also knows the first and the last row below it.

Nodes are in heap order as there: the root is 1, node i has the children 2i and 2i + 1, each leaf
holds `LEAF` moves of the order. Made by numpy, in a few turns for each level."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from camtool.arrays import columns_of
from camtool.kernels.near import hilbert_places

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Indices = npt.NDArray[np.int32]

LEAF = 8
"""So many moves have one leaf; fewer make more nodes, which take most of the room."""

FIRST, LAST = 4, 5
"""Columns of a node after its box: the first row below it, and one past the last."""

AT_ONCE = 4096 * LEAF
"""So many boxes are brought into the tree at a time."""

LEVELS = 16
"""Squares are halved so often: the middles are told apart to a 65,536th of the whole."""


def move_tree(
    count: int, boxes: Callable[[Ints | Indices], Floats], group: Ints | Indices | None = None
) -> tuple[Floats, Indices]:
    """Return (2L, 6) nodes over so many rows K, whose `boxes` (J, 4) are asked for some rows
    (J,) at a time, and the order (K,) of the rows in their L leaves. Rows of one `group` (K,),
    ascending, stay together: a search among these looks at no others."""

    def middles(rows: Ints) -> Floats:
        box = boxes(rows)
        return np.asarray(0.5 * (box[:, :2] + box[:, 2:]))

    order = hilbert_order_of(count, middles)
    if group is not None:
        order = order[np.argsort(group[order], kind="stable")]
    leaves = 1
    while leaves * LEAF < count:
        leaves *= 2
    # Largest numbers are the least of those with the other sign.
    tree = np.full((2 * leaves, 6), np.inf)
    for low in range(0, count, AT_ONCE):
        rows = order[low : low + AT_ONCE]
        box = boxes(rows)
        lows = np.column_stack([box[:, :2], -box[:, 2:], rows, -1.0 - rows])
        first = leaves + low // LEAF
        begins = np.arange(0, len(rows), LEAF)
        tree[first : first + len(begins)] = np.minimum.reduceat(lows, begins)
    while leaves > 1:
        level = tree[leaves : 2 * leaves]
        np.minimum(level[::2], level[1::2], out=tree[leaves // 2 : leaves])
        leaves //= 2
    tree *= (1.0, 1.0, -1.0, -1.0, 1.0, -1.0)
    return tree, order


def hilbert_order(starts: Floats, ends: Floats) -> Ints:
    """Return (K,) rows as Hilbert's curve through their extents comes to the middles between
    `starts` (K, 2) and `ends` (K, 2)."""
    order = hilbert_order_of(len(starts), lambda rows: 0.5 * (starts[rows] + ends[rows]))
    return order.astype(np.int64)


def hilbert_order_of(count: int, middles: Callable[[Ints], Floats]) -> Indices:
    """Return the same of so many rows, whose `middles` (J, 2) are asked for some rows (J,) at a
    time."""
    if count == 0:
        return np.empty(0, dtype=np.int32)
    lots = [(first, min(first + AT_ONCE, count)) for first in range(0, count, AT_ONCE)]
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for lot in lots:
        columns = columns_of(middles(np.arange(*lot)))
        low, high = np.minimum(low, columns.min(axis=1)), np.maximum(high, columns.max(axis=1))
    size = max(float((high - low).max()), np.finfo(np.float64).tiny)
    place = np.empty(count, dtype=np.uint32)
    for lot in lots:
        place[slice(*lot)] = hilbert_places((middles(np.arange(*lot)) - low) / size, LEVELS)
    return np.argsort(place, kind="stable").astype(np.int32)
