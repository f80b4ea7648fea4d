"""How near points of raw elements are to the source: elements trimmed, slices judged.

What makes it exact: a tree of boxes leaves out only what is too far away, by its true distance.
The twins, with every distance to every segment, are in tests/oracles/offset_stages.py.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
from numba import njit

from camtool.kernels.box_tree import DEPTH, LEAF, apart_square
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

PLACES = (0.5, 0.03, 0.97, 0.2, 0.8, 0.35, 0.65)
"""Where on a slice its distance is measured; the middle first, as it settles most of them."""


@njit(cache=True)
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


@njit(cache=True)
def nearest_distances(points: Floats, curves: Floats, tree: Floats) -> Floats:
    """(P,) distance of each point (P, 2) from the nearest curve."""
    found = np.empty(len(points))
    for i in range(len(points)):
        found[i] = least_below(curves, tree, (points[i, 0], points[i, 1]), math.inf, 0.0)
    return found


@njit(cache=True)
def trimmed_ends(elements: Floats, near: Near, distance: float, spare: float) -> Floats:
    """(K, 2) fractions between which each element may be far enough from the source.

    The distance from the source, and the depth in a kite, change by no more than the way along an
    element: where it falls short by s, all is too near for the length s from there. Ends stay that
    are too near by no more than `spare`. Low is not below high where nothing is left.
    """
    ends = np.empty((len(elements), 2))
    for i in range(len(elements)):
        low, high = 0.0, 1.0
        for way in range(2):
            for _ in range(TRIM_ROUNDS):
                point = point_on(elements, i, low if way == 0 else high)
                short = _too_near(near, point, distance, spare, (high - low) * elements[i, LENGTH])
                step = short / elements[i, LENGTH]
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


@njit(cache=True)
def _too_near(
    near: Near, point: tuple[float, float], distance: float, spare: float, enough: float
) -> float:
    """By how much more than `spare` a point is too near to the source, or too deep in a kite.

    0 when it is not; any number above `enough` will do.
    """
    curves, tree, kites, kite_tree = near
    least = distance - spare
    short = least - least_below(curves, tree, point, least, least - enough)
    if short > enough:
        return short
    return deepest(kites, kite_tree, point, short + spare, enough + spare) - spare


@njit(cache=True)
def far_enough(
    elements: Floats, element: Ints, span: Floats, near: Near, limits: tuple[float, float]
) -> Bools:
    """(S,) true for the slices of which no measured point is too near to the source.

    Slice i runs on row element[i] from the fraction span[i, 0] to span[i, 1]. `limits` are the
    distance, and by how much a point may be too near.
    """
    distance, spare = limits
    valid = np.ones(len(element), np.bool_)
    for i in range(len(element)):
        for place in PLACES:
            t = span[i, 0] + place * (span[i, 1] - span[i, 0])
            point = point_on(elements, element[i], t)
            if _too_near(near, point, distance, spare, 0.0) > 0.0:
                valid[i] = False
                break
    return valid
