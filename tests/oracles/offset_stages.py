"""Literal oracles of the kernels of offsets: every pair looked at, every loop walked in Python."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.distance import points_to_segments
from camtool.geometry.measure import Frames, point_at
from camtool.geometry.offset import Slices
from camtool.geometry.polylines import Segments

U_TURN_RAD = 1e-3
ALONG = (0.5, 0.03, 0.2, 0.35, 0.65, 0.8, 0.97)


def groups(points: Floats, eps: float) -> list[set[int]]:
    """The points within eps of each other, and chains of them, by their least member."""
    label = list(range(len(points)))
    for i in range(len(points)):
        for j in range(i):
            if math.dist(points[i], points[j]) <= eps:
                old, new = max(label[i], label[j]), min(label[i], label[j])
                label = [new if each == old else each for each in label]
    return [{i for i, each in enumerate(label) if each == root} for root in sorted(set(label))]


def valid(slices: Slices, elements: Segments, source: Segments, least: float) -> Bools:
    """Mask of the slices without a measured point nearer to the source than `least`."""
    found = np.ones(len(slices), dtype=np.bool_)
    for part in ALONG:
        t = slices.t0 + part * (slices.t1 - slices.t0)
        points = point_at(elements, slices.element, t)
        found &= points_to_segments(points, source).min(axis=1) >= least
    return found


def without_doubles(slices: Slices, elements: Segments, eps: float) -> Slices:
    """No slice twice, and none of two that run the same way to and fro."""
    middle = point_at(elements, slices.element, 0.5 * (slices.t0 + slices.t1))
    keep = np.ones(len(slices), dtype=np.bool_)
    for row in range(len(slices)):
        for other in range(row + 1, len(slices)):
            one = (int(slices.from_node[row]), int(slices.to_node[row]))
            two = (int(slices.from_node[other]), int(slices.to_node[other]))
            near = math.dist(middle[row], middle[other]) <= eps
            if sorted(one) == sorted(two) and near and keep[row] and keep[other]:
                keep[other] = False
                keep[row] = one[0] == two[0]
    return slices[keep]


def without_dead_ends(slices: Slices) -> Slices:
    """The slices that others lead to and lead on from, found by taking off the rest in rounds."""
    while True:
        keep = np.isin(slices.from_node, slices.to_node) & np.isin(
            slices.to_node, slices.from_node
        )
        if keep.all():
            return slices
        slices = slices[keep]


def trace_loops(slices: Slices, elements: Segments) -> list[Ints]:
    """Loops as camtool.kernels.offsets.traced gives them."""
    frames = Frames.of(elements)[slices.element]
    leaving, arriving = frames.tangent_at(slices.t0), frames.tangent_at(slices.t1)
    outgoing: dict[int, list[int]] = defaultdict(list)
    for row, node in enumerate(slices.from_node.tolist()):
        outgoing[node].append(row)
    unused = np.ones(len(slices), dtype=np.bool_)
    loops: list[Ints] = []
    for first in range(len(slices)):
        path: list[int] = [first] if unused[first] else []
        unused[first] = False
        seen = {int(slices.from_node[first]): 0}
        while path:
            node = int(slices.to_node[path[-1]])
            if node in seen:
                begin = seen[node]
                loops.append(np.array(path[begin:], dtype=np.int64))
                for row in path[begin:]:
                    del seen[int(slices.from_node[row])]
                del path[begin:]
                if begin == 0:
                    break
                continue
            ways = [row for row in outgoing[node] if unused[row]]
            if not ways:
                del seen[int(slices.from_node[path.pop()])]
                continue
            chosen = ways[_leftmost(arriving[path[-1]], leaving[ways])]
            seen[node] = len(path)
            path.append(chosen)
            unused[chosen] = False
    return loops


def _leftmost(arriving: Floats, leaving: Floats) -> int:
    across = arriving[0] * leaving[:, 1] - arriving[1] * leaving[:, 0]
    turn = np.arctan2(across, leaving @ arriving)
    turn = np.where(turn <= U_TURN_RAD - np.pi, np.pi, turn)
    return int(turn.argmax())


def vertices_of(rows: Ints, slices: Slices, elements: Segments) -> Floats:
    """(n, 3) vertices of a closed loop; slices of one element become one again."""
    chosen = slices[rows]
    before = np.roll(np.arange(len(rows)), 1)
    goes_on = (chosen.element == chosen.element[before]) & (chosen.t0 >= chosen.t1[before])
    first = np.flatnonzero(~goes_on)
    last = np.roll(first, -1) - 1
    sweep = elements.sweep[chosen.element[first]] * (chosen.t1[last] - chosen.t0[first])
    return np.column_stack([chosen.nodes[chosen.from_node[first]], np.tan(0.25 * sweep)])


def without_slivers(vertices: Floats, eps: float) -> Floats | None:
    """A closed path whose segments up to eps have shrunk to their middles; None when nothing
    is left."""
    while True:
        step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
        short = np.hypot(step[:, 0], step[:, 1]) <= eps
        if not short.any():
            return vertices
        if len(vertices) <= 2:
            return None
        row = int(short.argmax())
        after = (row + 1) % len(vertices)
        moved = vertices.copy()
        moved[after, :2] = 0.5 * (vertices[row, :2] + vertices[after, :2])
        vertices = np.delete(moved, row, axis=0)
