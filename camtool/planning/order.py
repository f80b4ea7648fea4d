"""In which order contours are cut, and where each begins.

Nearest neighbour: from where the tool is, the nearest start of any contour that may be cut now.
A contour may be cut when everything that it holds has been cut (so that a part comes loose last).
Open paths may begin at either end, closed ones at any vertex, except within a run of arcs that is
to become one move.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.nest import nesting
from camtool.geometry.polylines import Bools, Floats, Ints, Polyline, Polylines
from camtool.geometry.transform import reverse, rolled
from camtool.planning.arcs import joints


@dataclass(frozen=True, eq=False)
class Order:
    """In order of cutting, for M paths: `path` (M,), its index; `start` (M,), the vertex where it
    begins; for an open path the last vertex says that it is travelled from its end."""

    path: Ints
    start: Ints


def order(lines: Polylines, from_point: tuple[float, float] = (0.0, 0.0)) -> Order:
    """The order of cutting for a tool that stands at `from_point` (mm)."""
    parent = nesting(lines).parent
    held = np.bincount(parent[parent >= 0], minlength=len(lines))
    points, owner, vertex = _starts(lines)
    first = np.searchsorted(owner, np.arange(len(lines) + 1))
    # Starts that may not be taken now lie infinitely far away.
    x, y = np.where((held[owner] == 0)[:, None], points, np.inf).T.copy()
    path = np.empty(len(lines), dtype=np.int64)
    start = np.empty(len(lines), dtype=np.int64)
    at = np.array(from_point)
    for rank in range(len(lines)):
        row = int(((x - at[0]) ** 2 + (y - at[1]) ** 2).argmin())
        chosen, holder = int(owner[row]), int(parent[owner[row]])
        path[rank], start[rank] = chosen, vertex[row]
        x[first[chosen] : first[chosen + 1]] = np.inf
        at = _end(lines, chosen, points[row])
        if holder >= 0:
            held[holder] -= 1
            if held[holder] == 0:
                rows = slice(first[holder], first[holder + 1])
                x[rows], y[rows] = points[rows].T
    return Order(path, start)


def ordered(lines: Polylines, way: Order) -> list[Polyline]:
    """The paths in this order, each from its start."""
    return [
        _from_start(lines[path], start)
        for path, start in zip(way.path.tolist(), way.start.tolist(), strict=True)
    ]


def _from_start(path: Polyline, start: int) -> Polyline:
    if path.closed:
        return rolled(path, start)
    return reverse(path) if start else path


def _starts(lines: Polylines) -> tuple[Floats, Ints, Ints]:
    """Points (S, 2) where a path may begin, the path (S,) and the vertex (S,) of each."""
    may = _may_begin(lines)
    owner = np.repeat(np.arange(len(lines)), np.diff(lines.offsets))
    rows = np.flatnonzero(may)
    return lines.vertices[rows, :2], owner[rows], rows - lines.offsets[owner[rows]]


def _may_begin(lines: Polylines) -> Bools:
    may = np.zeros(len(lines.vertices), dtype=np.bool_)
    for index in range(len(lines)):
        low, high = int(lines.offsets[index]), int(lines.offsets[index + 1])
        if lines.closed[index]:
            may[low:high] = joints(lines[index])
        else:
            may[low] = may[high - 1] = True
    return may


def _end(lines: Polylines, path: int, start: Floats) -> Floats:
    """Where the tool is when it has followed the path from this start."""
    if lines.closed[path]:
        return start
    low, high = (
        lines.vertices[lines.offsets[path], :2],
        lines.vertices[lines.offsets[path + 1] - 1, :2],
    )
    return high if (start == low).all() else low
