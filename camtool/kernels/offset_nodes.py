"""Raw elements cut at their meetings: nodes, slices between them, and slices that lead nowhere.

What makes it exact: nothing is computed here but distances of points to be merged; the rest is
counting. The twins are in tests/oracles/offset_stages.py.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel
from camtool.kernels.offset_curves import Floats, point_on

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

MOST_MERGED = 64
"""A point looks for no more than this many points to merge with: where more than that come
together, as where a circle of chords collapses, they chain up all the same."""


@kernel
def merged(points: Floats, skew: Floats, order: Ints, eps: float) -> tuple[Ints, Ints]:
    """The node (P,) of each point (P, 2), and the first point (N,) of each node.

    Points within `eps` of each other share a node, and so do chains of them. `order` sorts the
    points by `skew` (P,), which differs between two points by no more than their distance.
    """
    group = np.empty(len(points), np.int64)
    for i in range(len(points)):
        group[i] = i
    for i in range(len(order)):
        one, hits = order[i], 0
        for j in range(i + 1, len(order)):
            other = order[j]
            if skew[other] - skew[one] > eps or hits == MOST_MERGED:
                break
            apart_x, apart_y = points[one, 0] - points[other, 0], points[one, 1] - points[other, 1]
            if apart_x * apart_x + apart_y * apart_y <= eps * eps:
                hits += 1
                low, high = _root(group, one), _root(group, other)
                group[max(low, high)] = min(low, high)
    first, node = np.empty(len(points), np.int64), np.empty(len(points), np.int64)
    count = 0
    for i in range(len(points)):
        root = _root(group, i)
        if root == i:
            first[count], node[i] = i, count
            count += 1
        else:
            # Every root is less than its members, and has its number already.
            node[i] = node[root]
    return node, first[:count]


@inner
def _root(group: Ints, i: int) -> int:
    """The least member of the group of i."""
    while group[i] != i:
        group[i] = group[group[i]]
        i = group[i]
    return i


@inner
def grouped(keys: Ints, count: int) -> tuple[Ints, Ints]:
    """Rows (R,) by their key below `count`, in their order, and where each key begins."""
    begins = np.zeros(count + 1, np.int64)
    for key in keys:
        begins[key + 1] += 1
    for key in range(count):
        begins[key + 1] += begins[key]
    rows = np.empty(len(keys), np.int64)
    # Each begin moves on to its end, which is where the next one begins.
    for row in range(len(keys)):
        rows[begins[keys[row]]] = row
        begins[keys[row]] += 1
    for key in range(count, 0, -1):
        begins[key] = begins[key - 1]
    begins[0] = 0
    return rows, begins


@kernel
def in_order(keys: Ints, t: Floats, count: int) -> Ints:
    """Rows (R,) by their key below `count`, then by t (R,), then as they come (a shell sort)."""
    rows, begins = grouped(keys, count)
    for key in range(count):
        some = rows[begins[key] : begins[key + 1]]
        gap = len(some) // 2
        while gap > 0:
            for i in range(gap, len(some)):
                row, j = some[i], i
                while j >= gap and _after(t, some[j - gap], row):
                    some[j] = some[j - gap]
                    j -= gap
                some[j] = row
            gap //= 2
    return rows


@inner
def _after(t: Floats, one: int, other: int) -> bool:
    return bool(t[one] > t[other] or (t[one] == t[other] and one > other))


@kernel
def doubles_left(
    elements: Floats, element: Ints, middle_t: Floats, ends: tuple[Ints, Ints, int], eps: float
) -> Bools:
    """(S,) false for repeated slices, and for both of a pair that runs the same way to and fro.

    `ends` holds the nodes (S,) that each slice runs from and to, and how many nodes there are.
    Slices between the same nodes are the same when their middles are within `eps`.
    """
    from_node, to_node, count = ends
    keep = np.ones(len(element), np.bool_)
    near = np.empty(len(element), np.int64)
    for row in range(len(element)):
        near[row] = min(from_node[row], to_node[row])
    rows, begins = grouped(near, count)
    for node in range(count):
        for k in range(begins[node], begins[node + 1]):
            row = rows[k]
            far = max(from_node[row], to_node[row])
            for other in rows[k + 1 : begins[node + 1]]:
                if not keep[row]:
                    break
                if not keep[other] or max(from_node[other], to_node[other]) != far:
                    continue
                ax, ay = point_on(elements, element[row], middle_t[row])
                bx, by = point_on(elements, element[other], middle_t[other])
                if math.hypot(ax - bx, ay - by) <= eps:
                    keep[other] = False
                    keep[row] = from_node[row] == from_node[other]
    return keep


@kernel
def leading_on(from_node: Ints, to_node: Ints, count: int) -> Bools:
    """(S,) true for the slices that others lead to and lead on from, when all else is gone."""
    keep = np.ones(len(from_node), np.bool_)
    leaving, first_leaving = grouped(from_node, count)
    arriving, first_arriving = grouped(to_node, count)
    leave, arrive = np.empty(count, np.int64), np.empty(count, np.int64)
    for node in range(count):
        leave[node] = first_leaving[node + 1] - first_leaving[node]
        arrive[node] = first_arriving[node + 1] - first_arriving[node]
    stack = np.empty(2 * len(from_node) + count, np.int64)
    height = 0
    for node in range(count):
        if (leave[node] == 0) != (arrive[node] == 0):
            stack[height] = node
            height += 1
    while height > 0:
        height -= 1
        node = stack[height]
        if leave[node] == 0:
            rows = arriving[first_arriving[node] : first_arriving[node + 1]]
        else:
            rows = leaving[first_leaving[node] : first_leaving[node + 1]]
        for row in rows:
            if keep[row]:
                keep[row] = False
                leave[from_node[row]] -= 1
                arrive[to_node[row]] -= 1
                for end in (from_node[row], to_node[row]):
                    if (leave[end] == 0) != (arrive[end] == 0):
                        stack[height] = end
                        height += 1
    return keep
