"""The nearest segment to each of many points; the least distance from a vertex of any path to a
segment of another path.

A binary tree of boxes stands over the segments in their order; a path is one stretch of them, so
a vertex leaves out the nodes that lie within its own path, and those farther than the best
distance so far. What makes it exact: only boxes are left out, by their true distance.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.biarc import distance_to_arc
from camtool.kernels.box_tree import (
    DEPTH,
    apart_square,
    rows_under,
    tree_of,
    wait_for_children,
)
from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]


@kernel
def closest(
    start: Floats, end: Floats, bulge: Floats, boxes: Floats, path: Ints
) -> tuple[float, int, int]:
    """The distance, the row whose start is nearest to another path, and the row it is near to.

    `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4) and the ascending `path` (K,) of the
    segments. Rows are −1 when there is one path only.
    """
    tree = tree_of(boxes)
    count = len(bulge)
    best, best_row, best_other = np.inf, -1, -1
    first, last = 0, -1
    for row in range(count):
        if row > last:
            first, last = row, row
            while last + 1 < count and path[last + 1] == path[row]:
                last += 1
        apart, other = _from_point(
            start[row, 0], start[row, 1], (start, end, bulge), tree, (first, last, best)
        )
        if other >= 0:
            best, best_row, best_other = apart, row, other
    return best, best_row, best_other


@kernel
def nearest_rows(points: Floats, start: Floats, end: Floats, bulge: Floats, boxes: Floats) -> Ints:
    """(P,) rows of the segments nearest to points (P, 2); quick when neighbours in the list are
    near. `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4), K ≥ 1; where two are as near, the
    last one keeps its place."""
    tree = tree_of(boxes)
    found = np.zeros(len(points), np.int64)
    row = 0
    for index in range(len(points)):
        x, y = points[index, 0], points[index, 1]
        ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
        apart = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
        _, other = _from_point(x, y, (start, end, bulge), tree, (0, -1, apart))
        row = other if other >= 0 else row
        found[index] = row
    return found


@inner
def _from_point(
    x: float,
    y: float,
    segments: tuple[Floats, Floats, Floats],
    tree: Floats,
    limits: tuple[int, int, float],
) -> tuple[float, int]:
    """The distance to the nearest segment outside first … last that is nearer than the best one
    so far, and its row; −1 when there is none."""
    start, end, bulge = segments
    leaves = len(tree) // 2
    first, last, best = limits
    found = -1
    stack = np.empty(DEPTH, np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        low, high = rows_under(tree, node, len(bulge))
        own = low >= first and high <= last + 1
        if low >= high or own or apart_square(tree, node, x, y) >= best * best:
            continue
        if node < leaves:
            height = wait_for_children(tree, node, (x, y), stack, height)
            continue
        for row in range(low, high):
            if first <= row <= last:
                continue
            ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
            apart = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
            if apart < best:
                best, found = apart, row
    return best, found
