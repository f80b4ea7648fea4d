"""A tree of points in the plane whose points can be switched off, asked for the nearest ones.

    Node k holds rows[begin[k] : begin[k] + size[k]] and its halves are the nodes 2k + 1, 2k + 2.

What makes it exact: a node is left out only when its box lies farther away than what has been
found. Equal distances go to the lower row. Nothing depends on how the points are spread.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

LEAF = 6
"""A node of so many points is not halved any more: work alone."""

DEEPEST = 64
"""Nodes that wait while the tree is walked: more than levels of any tree that fits in memory."""

ANYWHERE = -1
"""No quarter of the plane: all of it."""


class Tree(NamedTuple):
    """`points` (N, 2); `rows` (N,) sorted by node; per node `begin`, `size`, `box` (low x, low y,
    high x, high y) and `live`, the points that are switched on; `leaf` (N,), each point's node."""

    points: Floats
    rows: Ints
    begin: Ints
    size: Ints
    box: Floats
    live: Ints
    leaf: Ints


def tree_of(points: Floats) -> Tree:
    """The tree of these points, N ≥ 1, all switched on; the nodes of a level all at once."""
    count, levels = len(points), 0
    while count >> levels > LEAF:
        levels += 1
    nodes = (2 << levels) - 1
    begin, size = np.zeros(nodes, np.int64), np.zeros(nodes, np.int64)
    box, rows = np.empty((nodes, 4)), np.arange(count)
    size[0] = count
    for level in range(levels + 1):
        here = np.arange((1 << level) - 1, (2 << level) - 1)
        node = np.repeat(here, size[here])
        box[here, :2] = np.minimum.reduceat(points[rows], begin[here])
        box[here, 2:] = np.maximum.reduceat(points[rows], begin[here])
        if level < levels:
            span = box[node, 2:] - box[node, :2]
            along = np.where(span[:, 0] >= span[:, 1], points[rows, 0], points[rows, 1])
            rows = rows[np.lexsort((along, node))]
            half = size[here] // 2
            begin[2 * here + 1], size[2 * here + 1] = begin[here], half
            begin[2 * here + 2], size[2 * here + 2] = begin[here] + half, size[here] - half
    leaf = np.empty(count, np.int64)
    leaf[rows] = node
    return Tree(np.ascontiguousarray(points), rows, begin, size, box, size.copy(), leaf)


@inner
def switch(tree: Tree, row: int, change: int) -> None:
    """Switch a point off (−1) or on (+1); it must be the other way before."""
    node = tree.leaf[row]
    while True:
        tree.live[node] += change
        if node == 0:
            return
        node = (node - 1) // 2


@inner
def _apart(tree: Tree, node: int, x: float, y: float) -> float:
    """Squared distance from a point to a node's box."""
    dx = max(tree.box[node, 0] - x, x - tree.box[node, 2], 0.0)
    dy = max(tree.box[node, 1] - y, y - tree.box[node, 3], 0.0)
    return float(dx * dx + dy * dy)


@inner
def _halves_wait(
    tree: Tree, node: int, point: tuple[float, float], waiting: Ints, top: int
) -> int:
    """Let the halves of a node wait, the nearer one on top; how many wait then."""
    x, y = point
    left_first = _apart(tree, 2 * node + 1, x, y) <= _apart(tree, 2 * node + 2, x, y)
    waiting[top] = 2 * node + (2 if left_first else 1)
    waiting[top + 1] = 2 * node + (1 if left_first else 2)
    return top + 2


@inner
def nearest_row(tree: Tree, on: Ints, x: float, y: float) -> int:
    """The nearest point that is switched on, `on` (N,) 1 or 0; −1 when none is."""
    waiting, top, leaves = np.empty(DEEPEST, np.int64), 1, len(tree.size) // 2
    waiting[0] = 0
    found, best = -1, np.inf
    while top > 0:
        top -= 1
        node = waiting[top]
        if tree.live[node] == 0 or _apart(tree, node, x, y) > best:
            continue
        if node < leaves:
            top = _halves_wait(tree, node, (x, y), waiting, top)
            continue
        for k in range(tree.begin[node], tree.begin[node] + tree.size[node]):
            row = tree.rows[k]
            if on[row]:
                dx, dy = tree.points[row, 0] - x, tree.points[row, 1] - y
                apart = dx * dx + dy * dy
                if apart < best or (apart == best and row < found):
                    found, best = row, apart
    return found


@inner
def nearest_owners(tree: Tree, owner: Ints, row: int, most: int, quarter: int) -> Ints:
    """The owners nearest to a point, but its own: up to `most`, each once, nearest first.

    `quarter` 0 … 3: only those above and to the right of the point, and so on CCW.
    """
    x, y = tree.points[row, 0], tree.points[row, 1]
    waiting, top, leaves = np.empty(DEEPEST, np.int64), 1, len(tree.size) // 2
    waiting[0] = 0
    found, apart = np.full(most, -1), np.full(most, np.inf)
    while top > 0:
        top -= 1
        node = waiting[top]
        box = tree.box[node]
        if _apart(tree, node, x, y) > apart[most - 1] or not (
            _looks_to(quarter, box[2] - x, box[3] - y)
            or _looks_to(quarter, box[0] - x, box[3] - y)
            or _looks_to(quarter, box[0] - x, box[1] - y)
            or _looks_to(quarter, box[2] - x, box[1] - y)
        ):
            continue
        if node < leaves:
            top = _halves_wait(tree, node, (x, y), waiting, top)
            continue
        for k in range(tree.begin[node], tree.begin[node] + tree.size[node]):
            other = tree.rows[k]
            dx, dy = tree.points[other, 0] - x, tree.points[other, 1] - y
            if owner[other] != owner[row] and _looks_to(quarter, dx, dy):
                _enter(found, apart, owner[other], dx * dx + dy * dy)
    return found[found >= 0]


@inner
def _looks_to(quarter: int, dx: float, dy: float) -> bool:
    """Whether a direction lies in a quarter of the plane; each has one of its two edges."""
    if quarter == 0:
        return dx > 0.0 and dy >= 0.0
    if quarter == 1:
        return dx <= 0.0 and dy > 0.0
    if quarter == 2:
        return dx < 0.0 and dy <= 0.0
    if quarter == 3:
        return dx >= 0.0 and dy < 0.0
    return True


@inner
def _enter(found: Ints, apart: Floats, owner: int, distance: float) -> None:
    """Put an owner into the sorted list, or move it up when it is there already."""
    at = len(found) - 1
    if (distance, owner) >= (apart[at], found[at] if found[at] >= 0 else owner + 1):
        return
    for k in range(len(found)):
        if found[k] == owner:
            if apart[k] <= distance:
                return
            at = k
            break
    while at > 0 and (distance, owner) < (
        apart[at - 1],
        found[at - 1] if found[at - 1] >= 0 else owner + 1,
    ):
        found[at], apart[at] = found[at - 1], apart[at - 1]
        at -= 1
    found[at], apart[at] = owner, distance
