"""Points that are one: taken out of paths, whatever made them coincide (a drawing that repeats
them, a scale that brings them together).

Tolerance: POSITION_EPS_MM, below which two points are one. A point stays where it is, so no path
moves by more than that.
"""

from __future__ import annotations

import math

import numpy as np

from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints


def without_repeats(vertices: Floats, counts: Ints, closed: Bools) -> tuple[Bools, Ints]:
    """The vertices (N,) to keep, and how many points each path repeats (M,).

    `vertices` (N, 3) of x, y, bulge, mm, path after path, `counts` (M,) of each. A vertex is kept
    when it lies off the one kept before it; its bulge becomes, in place, that of the last vertex
    on it, for a bulge belongs to what leaves. A closed path's repeated first point at its end
    goes uncounted: it says "closed" once more.
    """
    first = np.cumsum(counts) - counts
    filled = counts > 0
    begins = np.zeros(len(vertices), dtype=np.bool_)
    begins[first[filled]] = True
    step = np.hypot(*np.diff(vertices[:, :2], axis=0, prepend=np.nan).T)
    keep = begins | ~(step <= POSITION_EPS_MM)
    owner = np.repeat(np.arange(len(counts)), counts)
    for path in np.unique(owner[~keep]).tolist():
        rows = slice(int(first[path]), int(first[path] + counts[path]))
        keep[rows] = _kept(vertices[rows])
    repeated = np.bincount(owner[~keep], minlength=len(counts)).astype(np.int64)
    _drop_closing(vertices, keep, owner, first, closed & filled)
    return keep, repeated


def encloses(vertices: Floats, owner: Ints, left: Ints) -> Bools:
    """(M,) false for paths of two vertices (of `left` (M,)) without a bulge: there and back along
    one line encloses nothing; it is that line, once. `owner` (N,) names each vertex's path."""
    bent = np.bincount(owner, weights=vertices[:, 2] != 0.0, minlength=len(left))
    return np.asarray((left != 2) | (bent != 0.0))


def _kept(path: Floats) -> Bools:
    """The vertices of one path to keep, which take the bulges of those left out after them."""
    keep = np.zeros(len(path), dtype=np.bool_)
    last = -1
    for row, (x, y, bulge) in enumerate(path.tolist()):
        if last >= 0 and math.hypot(x - path[last, 0], y - path[last, 1]) <= POSITION_EPS_MM:
            path[last, 2] = bulge
        else:
            keep[row] = True
            last = row
    return keep


def _drop_closing(vertices: Floats, keep: Bools, owner: Ints, first: Ints, closed: Bools) -> None:
    """Takes vertices at the end of closed paths out of `keep` that lie on their first one."""
    waiting = closed.copy()
    while waiting.any():
        rows = np.flatnonzero(keep)
        is_last = np.append(owner[rows][1:] != owner[rows][:-1], True) & waiting[owner[rows]]
        last = rows[is_last]
        begin = first[owner[last]]
        apart = np.hypot(*(vertices[last, :2] - vertices[begin, :2]).T)
        same = (apart <= POSITION_EPS_MM) & (last != begin)
        keep[last[same]] = False
        waiting[:] = False
        waiting[owner[last[same]]] = True
