"""The least distance from a vertex of any path to a segment of another path.

A binary tree of boxes stands over the segments in their order; a path is one stretch of them, so
a vertex leaves out the nodes that lie within its own path, and those farther than the best
distance so far. What makes it exact: only boxes are left out, by their true distance.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from camtool.kernels.biarc import distance_to_arc

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

LEAF = 4
"""Segments in a leaf of the tree of boxes."""


@njit(cache=True)
def closest(
    start: Floats, end: Floats, bulge: Floats, boxes: Floats, path: Ints
) -> tuple[float, int, int]:
    """The distance, the row whose start is nearest to another path, and the row it is near to.

    `start`, `end` (K, 2), `bulge` (K,), `boxes` (K, 4) and the ascending `path` (K,) of the
    segments. Rows are −1 when there is one path only.
    """
    tree, leaves = _tree(boxes)
    count = len(bulge)
    best, best_row, best_other = np.inf, -1, -1
    first, last = 0, -1
    for row in range(count):
        if row > last:
            first, last = row, row
            while last + 1 < count and path[last + 1] == path[row]:
                last += 1
        apart, other = _from_point(
            start[row, 0], start[row, 1], (start, end, bulge), (tree, leaves), (first, last, best)
        )
        if other >= 0:
            best, best_row, best_other = apart, row, other
    return best, best_row, best_other


@njit(cache=True)
def _from_point(
    x: float,
    y: float,
    segments: tuple[Floats, Floats, Floats],
    nodes: tuple[Floats, int],
    limits: tuple[int, int, float],
) -> tuple[float, int]:
    """The distance to the nearest segment outside first … last that is nearer than the best one
    so far, and its row; −1 when there is none."""
    start, end, bulge = segments
    tree, leaves = nodes
    first, last, best = limits
    found = -1
    stack = np.empty(128, np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        low, high = _range(node, leaves, len(bulge))
        own = low >= first and high <= last + 1
        if low >= high or own or _box_distance(tree, node, x, y) >= best:
            continue
        if node < leaves:
            left, right = 2 * node, 2 * node + 1
            if _box_distance(tree, left, x, y) < _box_distance(tree, right, x, y):
                left, right = right, left
            stack[height], stack[height + 1] = left, right
            height += 2
            continue
        for row in range(low, high):
            if first <= row <= last:
                continue
            ax, ay, bx, by = start[row, 0], start[row, 1], end[row, 0], end[row, 1]
            apart = distance_to_arc(x, y, ax, ay, bx, by, bulge[row])
            if apart < best:
                best, found = apart, row
    return best, found


@njit(cache=True)
def _tree(boxes: Floats) -> tuple[Floats, int]:
    """Boxes of the nodes (heap order, the root is 1), and the number of the first leaf."""
    leaves = 1
    while leaves * LEAF < len(boxes):
        leaves *= 2
    tree = np.empty((2 * leaves, 4))
    tree[:, :2], tree[:, 2:] = np.inf, -np.inf
    for row in range(len(boxes)):
        _widen(tree, leaves + row // LEAF, boxes[row])
    for node in range(leaves - 1, 0, -1):
        _widen(tree, node, tree[2 * node])
        _widen(tree, node, tree[2 * node + 1])
    return tree, leaves


@njit(cache=True)
def _widen(tree: Floats, node: int, box: Floats) -> None:
    for k in range(2):
        tree[node, k] = min(tree[node, k], box[k])
        tree[node, k + 2] = max(tree[node, k + 2], box[k + 2])


@njit(cache=True)
def _range(node: int, leaves: int, count: int) -> tuple[int, int]:
    """The rows low … high − 1 under a node."""
    span = LEAF
    while node < leaves:
        node *= 2
        span *= 2
    low = (node - leaves) * LEAF
    return low, min(low + span, count)


@njit(cache=True)
def _box_distance(tree: Floats, node: int, x: float, y: float) -> float:
    dx = max(tree[node, 0] - x, 0.0, x - tree[node, 2])
    dy = max(tree[node, 1] - y, 0.0, y - tree[node, 3])
    return math.hypot(dx, dy)
