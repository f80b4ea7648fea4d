"""Stages 5 and 6: kept slices joined to loops, and loops made clean paths."""

from __future__ import annotations

from collections import defaultdict

import numpy as np

from camtool.geometry.frames import Frames
from camtool.geometry.measure import length, point_at, signed_area
from camtool.geometry.offset.options import U_TURN_EPS_RAD, OffsetOptions
from camtool.geometry.offset.slices import Slices
from camtool.geometry.polylines import Bools, Floats, Ints, Polyline, Segments


def without_doubles(slices: Slices, elements: Segments, options: OffsetOptions) -> Slices:
    """The slices without repetitions, and without pairs that run the same way to and fro.

    Such a pair encloses nothing: it is where the offset falls apart, or collapses to a line.
    """
    if len(slices) == 0:
        return slices
    middle = point_at(elements, slices.element, 0.5 * (slices.t0 + slices.t1))
    low = np.minimum(slices.from_node, slices.to_node)
    high = np.maximum(slices.from_node, slices.to_node)
    forth = slices.from_node == low
    alike: dict[tuple[int, int], list[int]] = defaultdict(list)
    for row, key in enumerate(zip(low.tolist(), high.tolist(), strict=True)):
        alike[key].append(row)
    keep = np.ones(len(slices), dtype=np.bool_)
    eps = 2.0 * options.node_eps_mm
    for rows in alike.values():
        for place, row in enumerate(rows):
            for other in rows[place + 1 :]:
                near = np.hypot(*(middle[row] - middle[other])) <= eps
                if near and keep[row] and keep[other]:
                    keep[other] = False
                    keep[row] = bool(forth[row] == forth[other])
    return slices[keep]


def without_dead_ends(slices: Slices) -> Slices:
    """The slices that others lead to and lead on from."""
    while True:
        count = len(slices.nodes)
        leads_to = np.bincount(slices.to_node, minlength=count) > 0
        leads_on = np.bincount(slices.from_node, minlength=count) > 0
        keep = leads_to[slices.from_node] & leads_on[slices.to_node]
        if keep.all():
            return slices
        slices = slices[keep]


def trace_loops(slices: Slices, elements: Segments) -> list[Ints]:
    """Rows of the slices of each loop, in order; no loop passes a node twice.

    At a node where several slices leave, the leftmost one is taken: the region that is far
    enough from the source is on the left, and so it falls into parts that only touch.
    """
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
                # This node too: what is left of the path ends here and may leave it once more.
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
    """Index of the direction (W, 2) that turns left the most; turning right back is left back."""
    across = arriving[0] * leaving[:, 1] - arriving[1] * leaving[:, 0]
    turn = np.arctan2(across, leaving @ arriving)
    turn = np.where(turn <= U_TURN_EPS_RAD - np.pi, np.pi, turn)
    return int(turn.argmax())


def path_of(rows: Ints, slices: Slices, elements: Segments, *, closed: bool) -> Floats:
    """(n, 3) vertices of slices that follow each other; slices of one element become one again."""
    chosen = slices[rows]
    before = np.roll(np.arange(len(rows)), 1)
    goes_on = (chosen.element == chosen.element[before]) & (chosen.t0 >= chosen.t1[before])
    if not closed:
        goes_on[0] = False
    first = np.flatnonzero(~goes_on)
    last = np.roll(first, -1) - 1
    if not closed:
        last[-1] = len(rows) - 1
    sweep = elements.sweep[chosen.element[first]] * (chosen.t1[last] - chosen.t0[first])
    vertices = np.column_stack([chosen.nodes[chosen.from_node[first]], np.tan(0.25 * sweep)])
    if closed:
        return vertices
    end = chosen.nodes[chosen.to_node[last[-1]]]
    return np.concatenate([vertices, [[end[0], end[1], 0.0]]])


def clean_path(vertices: Floats, closed: bool, options: OffsetOptions) -> Polyline | None:
    """The path without segments up to `sliver_eps_mm`; None when nothing of substance is left.

    A closed path counts as nothing when its mean width, area over half the length, is no more
    than that either.
    """
    eps = options.sliver_eps_mm
    while True:
        short = _short(vertices, closed, eps)
        if not short.any():
            break
        if len(vertices) <= 2:
            return None
        vertices = _without(int(np.argmax(short)), vertices, closed)
    path = Polyline(vertices, closed)
    if closed and abs(signed_area(path)) <= 0.5 * eps * length(path):
        return None
    return path


def _short(vertices: Floats, closed: bool, eps: float) -> Bools:
    """(n,) true for the segments up to `eps` long."""
    step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
    short = np.asarray(np.hypot(step[:, 0], step[:, 1]) <= eps)
    if not closed:
        short[-1] = False
    return short


def _without(row: int, vertices: Floats, closed: bool) -> Floats:
    """The vertices with segment `row` shrunk to its middle; the ends of an open path stay."""
    after = (row + 1) % len(vertices)
    place = 0.5 * (vertices[row, :2] + vertices[after, :2])
    if not closed and row == 0:
        place = vertices[0, :2]
    if not closed and after == len(vertices) - 1:
        place = vertices[after, :2]
    merged = vertices.copy()
    merged[after, :2] = place
    return np.delete(merged, row, axis=0)
