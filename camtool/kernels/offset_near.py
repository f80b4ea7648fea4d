"""How near points of raw elements are to the source: elements trimmed, slices judged.

What makes it exact: a tree of boxes leaves out only what is too far away, by its true distance.
The twins, with every distance to every segment, are in tests/oracles/offset_stages.py.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.box_tree import DEPTH, LEAF, apart_square
from camtool.kernels.compiled import inner, kernel
from camtool.kernels.offset_curves import LENGTH, Floats, distance_to, point_on
from camtool.kernels.offset_kites import deepest

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

TRIM_ROUNDS = 40
"""How often the end of an element is moved on, at most."""

TRIM_STEP_SHARE = 0.02
"""An end that moves on by less than this share of its element is left where it is."""

Near = tuple[Floats, Floats, Floats, Floats]
"""The curves of a source and the tree over them; the kites of its mitres and their tree."""

GATHERED = 32
"""Room for the curves that can be too near to an element; where there are more, all are asked."""

PLACES = (0.5, 0.03, 0.97, 0.2, 0.8, 0.35, 0.65)
"""Where on a slice its distance is measured; the middle first, as it settles most of them."""


@inner
def least_below(
    curves: Floats, tree: Floats, point: tuple[float, float], best: float, enough: float
) -> float:
    """Distance of a point from the nearest curve, or `best` when none is nearer than that.

    Any distance below `enough` will do.
    """
    x, y = point
    leaves = len(tree) // 2
    stack = np.empty(DEPTH, np.int64)
    apart = np.empty(DEPTH)
    height, stack[0], apart[0] = 1, 1, apart_square(tree, 1, x, y)
    while height > 0:
        height -= 1
        node = stack[height]
        if apart[height] >= best * best:
            continue
        if node < leaves:
            near, far = 2 * node, 2 * node + 1
            to_near, to_far = apart_square(tree, near, x, y), apart_square(tree, far, x, y)
            if to_far < to_near:
                near, far, to_near, to_far = far, near, to_far, to_near
            stack[height], apart[height] = far, to_far
            stack[height + 1], apart[height + 1] = near, to_near
            height += 2
            continue
        low = (node - leaves) * LEAF
        for row in range(low, min(low + LEAF, len(curves))):
            best = min(best, distance_to(curves, row, x, y))
        if best < enough:
            return best
    return best


@kernel
def nearest_distances(points: Floats, curves: Floats, tree: Floats) -> Floats:
    """(P,) distance of each point (P, 2) from the nearest curve."""
    found = np.empty(len(points))
    for i in range(len(points)):
        found[i] = least_below(curves, tree, (points[i, 0], points[i, 1]), math.inf, 0.0)
    return found


@kernel
def curves_within(points: Floats, reach: Floats, curves: Floats, tree: Floats) -> Ints:
    """(J, 2) pairs of a point (P, 2) and a curve that is no farther from it than `reach` (P,), in
    the order of the points."""
    found = np.empty((len(points) + LEAF, 2), np.int64)
    stack = np.empty(DEPTH, np.int64)
    leaves, count = len(tree) // 2, 0
    for i in range(len(points)):
        x, y, limit = points[i, 0], points[i, 1], reach[i]
        height, stack[0] = 1, 1
        while height > 0:
            height -= 1
            node = stack[height]
            if apart_square(tree, node, x, y) > limit * limit:
                continue
            if node < leaves:
                stack[height], stack[height + 1] = 2 * node + 1, 2 * node
                height += 2
                continue
            if count + LEAF > len(found):
                more = np.empty((2 * len(found), 2), np.int64)
                more[:count] = found[:count]
                found = more
            low = (node - leaves) * LEAF
            for row in range(low, min(low + LEAF, len(curves))):
                if distance_to(curves, row, x, y) <= limit:
                    found[count, 0], found[count, 1] = i, row
                    count += 1
    return found[:count]


@inner
def gathered(
    curves: Floats, tree: Floats, point: tuple[float, float], reach: float, rows: Ints
) -> int:
    """How many curves are nearer to a point than `reach`; they are written into `rows`.

    −1 when there are more than it has room for.
    """
    x, y = point
    leaves, count = len(tree) // 2, 0
    stack = np.empty(DEPTH, np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        if apart_square(tree, node, x, y) >= reach * reach:
            continue
        if node < leaves:
            stack[height], stack[height + 1] = 2 * node + 1, 2 * node
            height += 2
            continue
        low = (node - leaves) * LEAF
        for row in range(low, min(low + LEAF, len(curves))):
            if distance_to(curves, row, x, y) < reach:
                if count == len(rows):
                    return -1
                rows[count] = row
                count += 1
    return count


@inner
def _too_near(
    near: Near,
    some: tuple[Ints, int],
    point: tuple[float, float],
    limits: tuple[float, float],
    enough: float,
) -> float:
    """By how much more than `spare` a point is too near to the source, or too deep in a kite.

    0 when it is not; any number above `enough` will do. `some` are the rows of the curves that
    can be nearer than the distance, and how many: −1 for all. `limits`: the distance and `spare`.
    """
    curves, tree, kites, kite_tree = near
    rows, count = some
    distance, spare = limits
    least = distance - spare
    if count < 0:
        short = least - least_below(curves, tree, point, least, least - enough)
    else:
        short = 0.0
        for k in range(count):
            short = max(short, least - distance_to(curves, rows[k], point[0], point[1]))
    if short > enough or len(kites) == 0:
        return short
    return deepest(kites, kite_tree, point, short + spare, enough + spare) - spare


@kernel
def trimmed_ends(elements: Floats, near: Near, limits: tuple[float, float]) -> Floats:
    """(K, 2) fractions between which each element may be far enough from the source.

    The distance from the source, and the depth in a kite, change by no more than the way along an
    element: where it falls short by s, all is too near for the length s from there. `limits` are
    the distance, and by how much the ends that stay may be too near. Low is not below high where
    nothing is left.
    """
    ends = np.empty((len(elements), 2))
    rows = np.empty(GATHERED, np.int64)
    for i in range(len(elements)):
        low, high, length = 0.0, 1.0, elements[i, LENGTH]
        reach = limits[0] + 0.5 * length
        some = (rows, gathered(near[0], near[1], point_on(elements, i, 0.5), reach, rows))
        for way in range(2):
            for _ in range(TRIM_ROUNDS):
                point = point_on(elements, i, low if way == 0 else high)
                step = _too_near(near, some, point, limits, (high - low) * length) / length
                if step <= TRIM_STEP_SHARE * (high - low):
                    break
                if way == 0:
                    low += step
                else:
                    high -= step
                if low >= high:
                    break
            if low >= high:
                break
        ends[i, 0], ends[i, 1] = low, high
    return ends


@kernel
def far_enough(
    elements: Floats, element: Ints, span: Floats, near: Near, limits: tuple[float, float]
) -> Bools:
    """(S,) true for the slices of which no measured point is too near to the source.

    Slice i runs on row element[i] from the fraction span[i, 0] to span[i, 1]. `limits` are the
    distance, and by how much a point may be too near.
    """
    valid = np.ones(len(element), np.bool_)
    rows = np.empty(GATHERED, np.int64)
    last, whole = -1, -1
    for i in range(len(element)):
        row, t0, part = element[i], span[i, 0], span[i, 1] - span[i, 0]
        length = elements[row, LENGTH]
        if row != last:
            # No other curve is too near to any point of the element.
            middle, reach = point_on(elements, row, 0.5), limits[0] + 0.5 * length
            last, whole = row, gathered(near[0], near[1], middle, reach, rows)
        count = whole
        for k in range(len(PLACES)):
            point = point_on(elements, row, t0 + PLACES[k] * part)
            if _too_near(near, (rows, count), point, limits, 0.0) > 0.0:
                valid[i] = False
                break
            if k == 0 and whole < 0:
                reach = limits[0] + 0.5 * part * length
                count = gathered(near[0], near[1], point, reach, rows)
    return valid
