"""Which points a closed path of lines and arcs holds, by a ray to the right over a tree of boxes.

A point is inside when it is inside the polygon of the chords, or between a chord and its arc, but
not both. Only segments whose boxes the ray meets can say anything about either. A point exactly on
a chord is taken as a hair up and to the right of it. What makes it exact: products of the given
numbers, and their signs. `tests/oracles/inside.py` is the twin, over all segments.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.kernels.box_tree import DEPTH, LEAF
from camtool.kernels.compiled import inner, kernel
from camtool.kernels.offset_curves import AX, AY, BX, BY, Floats
from camtool.kernels.offset_near import least_below

Ints = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

OUT, HELD, ON_LINE = range(3)
"""What is said of a path: some of it is outside; inside; all of it is on the line itself."""


@kernel
def insides(points: Floats, curves: Floats, bulge: Floats, tree: Floats) -> Bools:
    """(P,) true for the points (P, 2) within a closed path; on the line either may come out.

    `curves` (K, 11) and `tree` as in offset_curves and box_tree, `bulge` (K,).
    """
    found = np.empty(len(points), np.bool_)
    for i in range(len(points)):
        found[i] = is_inside(curves, bulge, tree, (points[i, 0], points[i, 1]))
    return found


@inner
def is_inside(curves: Floats, bulge: Floats, tree: Floats, point: tuple[float, float]) -> bool:
    """Whether a closed path holds a point."""
    x, y = point
    leaves, odd = len(tree) // 2, False
    stack = np.empty(DEPTH, np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        if tree[node, 2] < x or tree[node, 1] > y or tree[node, 3] < y:
            continue
        if node < leaves:
            stack[height], stack[height + 1] = 2 * node + 1, 2 * node
            height += 2
            continue
        low = (node - leaves) * LEAF
        for row in range(low, min(low + LEAF, len(curves))):
            odd ^= _counts(curves, row, bulge[row], x, y)
    return bool(odd)


@inner
def _counts(curves: Floats, i: int, bulge: float, x: float, y: float) -> bool:
    """Whether a ray to the right crosses a chord, or else the point lies beside it in its arc."""
    ax, ay, bx, by = curves[i, AX], curves[i, AY], curves[i, BX], curves[i, BY]
    dx, dy = bx - ax, by - ay
    side = dx * (y - ay) - dy * (x - ax)
    crosses = (ay > y) != (by > y) and (side > 0.0 if by > ay else side < 0.0)
    if bulge == 0.0:
        return bool(crosses)
    # A positive bulge lies to the right of its chord. Within the circle its power is negative.
    power = 4.0 * bulge * ((x - ax) * (x - bx) + (y - ay) * (y - by))
    power -= 2.0 * (1.0 - bulge * bulge) * side
    in_circle = power < 0.0 if bulge > 0.0 else power > 0.0
    hair = dx if dy == 0.0 else -dy
    on_left = (hair if side == 0.0 else side) > 0.0
    return bool(crosses != (in_circle and on_left == (bulge < 0.0)))


@kernel
def holds(
    points: Floats,
    begins: Ints,
    ring: tuple[Floats, Floats, Floats],
    paths: Ints,
    eps: float,
) -> Ints:
    """(N,) OUT, HELD or ON_LINE for each of `paths` (N,): path k has the points begins[k] … of
    `points` (P, 2).

    `ring` holds curves, bulge and tree of a closed path; what is within `eps` of its line is
    neither outside nor inside.
    """
    curves, bulge, tree = ring
    said = np.empty(len(paths), np.int64)
    for n in range(len(paths)):
        said[n] = ON_LINE
        for k in range(begins[paths[n]], begins[paths[n] + 1]):
            point = (points[k, 0], points[k, 1])
            if least_below(curves, tree, point, 2.0 * eps, eps) <= eps:
                continue
            if not is_inside(curves, bulge, tree, point):
                said[n] = OUT
                break
            said[n] = HELD
    return said
