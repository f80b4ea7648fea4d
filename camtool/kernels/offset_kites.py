"""How deep points are in what mitres cover.

About a corner c with the normals n1 and n2 of both its sides, a mitre at the distance d covers

    { c + q :  n1·q ≤ d,  n2·q ≤ d,  m·q ≤ far,  q ahead of side 1 and behind side 2 },

with the middle m of both normals: a kite, or what is left of one that is cut off. It is convex, so
a point is as deep in it as it is from the nearest of these five lines. The depth changes by no
more than the way. What makes it exact: a tree of boxes leaves out only kites that a point is not
in.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.kernels.box_tree import DEPTH, LEAF, apart_square
from camtool.kernels.compiled import inner, kernel
from camtool.kernels.offset_curves import Floats

CX, CY, N1X, N1Y, N2X, N2Y, MX, MY, DEEP, FAR = range(10)
"""The columns of a kite."""


@kernel
def kite_boxes(kites: Floats) -> Floats:
    """(J, 4) boxes xmin, ymin, xmax, ymax that hold the kites (J, 10)."""
    boxes = np.empty((len(kites), 4))
    for i in range(len(kites)):
        cx, cy, deep = kites[i, CX], kites[i, CY], kites[i, DEEP]
        # From the corner to the tip, or to both ends of the cut: no farther than this.
        cosine = kites[i, N1X] * kites[i, MX] + kites[i, N1Y] * kites[i, MY]
        if kites[i, FAR] == math.inf:
            wide = deep / cosine
        else:
            sine = math.sqrt(max(1.0 - cosine * cosine, 0.0))
            wide = math.hypot(deep, (kites[i, FAR] - deep * cosine) / sine)
        boxes[i, 0], boxes[i, 1] = cx - wide, cy - wide
        boxes[i, 2], boxes[i, 3] = cx + wide, cy + wide
    return boxes


@inner
def depth_in(kites: Floats, i: int, x: float, y: float) -> float:
    """How deep a point is in kite i; below 0 outside it."""
    qx, qy = x - kites[i, CX], y - kites[i, CY]
    n1x, n1y, n2x, n2y = kites[i, N1X], kites[i, N1Y], kites[i, N2X], kites[i, N2Y]
    out = min(kites[i, DEEP] - n1x * qx - n1y * qy, kites[i, DEEP] - n2x * qx - n2y * qy)
    out = min(out, kites[i, FAR] - kites[i, MX] * qx - kites[i, MY] * qy)
    return float(min(out, n1y * qx - n1x * qy, n2x * qy - n2y * qx))


@inner
def deepest(
    kites: Floats, tree: Floats, point: tuple[float, float], best: float, enough: float
) -> float:
    """How deep a point is in any kite, or `best` when it is not deeper than that.

    Any depth above `enough` will do.
    """
    x, y = point
    if len(kites) == 0:
        return best
    leaves = len(tree) // 2
    stack = np.empty(DEPTH, np.int64)
    height, stack[0] = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        if apart_square(tree, node, x, y) > 0.0:
            continue
        if node < leaves:
            stack[height], stack[height + 1] = 2 * node + 1, 2 * node
            height += 2
            continue
        low = (node - leaves) * LEAF
        for row in range(low, min(low + LEAF, len(kites))):
            best = max(best, depth_in(kites, row, x, y))
        if best > enough:
            return best
    return best
