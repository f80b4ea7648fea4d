"""A binary tree of boxes over rows in their order: what is far away is left out at once.

Nodes are in heap order, the root is 1; node i has the children 2i and 2i + 1, and each leaf holds
`LEAF` rows that follow each other. Along a path neighbours in the list are neighbours in the
plane, so no row needs to be moved; over paths that surround each other stands a tree of
`camtool.kernels.move_tree`. What makes it exact: comparisons of the given numbers.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

LEAF = 4
"""Rows in a leaf."""

DEPTH = 128
"""Room for a stack of nodes: far more than twice the levels of any tree."""


@kernel
def tree_of(boxes: Floats) -> Floats:
    """(2L, 4) boxes of the nodes over `boxes` (K, 4); the L leaves are the last."""
    leaves = 1
    while leaves * LEAF < len(boxes):
        leaves *= 2
    tree = np.empty((2 * leaves, 4))
    for node in range(2 * leaves):
        for k in range(2):
            tree[node, k], tree[node, k + 2] = np.inf, -np.inf
    for row in range(len(boxes)):
        _widen(tree, leaves + row // LEAF, boxes, row)
    for node in range(leaves - 1, 0, -1):
        _widen(tree, node, tree, 2 * node)
        _widen(tree, node, tree, 2 * node + 1)
    return tree


@inner
def _widen(tree: Floats, node: int, boxes: Floats, row: int) -> None:
    for k in range(2):
        tree[node, k] = min(tree[node, k], boxes[row, k])
        tree[node, k + 2] = max(tree[node, k + 2], boxes[row, k + 2])


@inner
def rows_under(tree: Floats, node: int, count: int) -> tuple[int, int]:
    """The rows low … high − 1 of `count` in all that a node holds."""
    leaves = len(tree) // 2
    span = LEAF
    while node < leaves:
        node *= 2
        span *= 2
    low = min((node - leaves) * LEAF, count)
    return low, min(low + span, count)


@inner
def apart_square(tree: Floats, node: int, x: float, y: float) -> float:
    """Square of the distance of a point from the box of a node."""
    dx = max(tree[node, 0] - x, 0.0, x - tree[node, 2])
    dy = max(tree[node, 1] - y, 0.0, y - tree[node, 3])
    return float(dx * dx + dy * dy)


@inner
def wait_for_children(
    tree: Floats, node: int, point: tuple[float, float], stack: Ints, height: int
) -> int:
    """Put the children of a node on a stack of `height` nodes, the one nearer to a point on top;
    returns the new height."""
    x, y = point
    left, right = 2 * node, 2 * node + 1
    if apart_square(tree, left, x, y) < apart_square(tree, right, x, y):
        left, right = right, left
    stack[height], stack[height + 1] = left, right
    return height + 2


@inner
def touch(one: Floats, i: int, other: Floats, j: int) -> bool:
    """Whether box i of one list and box j of another have a point in common."""
    return bool(
        one[i, 0] <= other[j, 2]
        and other[j, 0] <= one[i, 2]
        and one[i, 1] <= other[j, 3]
        and other[j, 1] <= one[i, 3]
    )
