"""Where a closed contour may begin, by rule or by hand."""

from __future__ import annotations

import math

import numpy as np

from camtool.geometry.polylines import POSITION_EPS_MM, Ints, Polyline
from camtool.planning.contours.along import Along

START_SNAP_MM = 1e-3
"""A start nearer than this to a vertex is that vertex: no move shorter than it is made."""

START_CORNER_RAD = 0.1
"""A path that turns by more than this at a vertex has a corner there."""


def with_starts(
    path: Polyline, rule: str | tuple[float, float], tool_radius_mm: float = 0.0
) -> tuple[Polyline, Ints]:
    """The path, perhaps with one more vertex, and the vertices at which it may begin.

    `rule` is one of STARTS, or a place (x, y) mm: then the nearest one of the path. None are
    given (any will do) for "nearest", for open paths, and when nothing is as the rule says.

    - "longest-line": the middle of the longest line; without lines, of the longest arc.
    - "corner": where the path turns, and where it begins to round a corner of the part, in an arc
      as large as a tool of `tool_radius_mm`.
    """
    any_vertex = np.empty(0, dtype=np.int64)
    if not path.closed or rule == "nearest":
        return path, any_vertex
    along = Along.of(path)
    if rule == "corner":
        # Where it turns back at once is the tip of a relief.
        bend = np.abs(along.turns)
        turns = (bend > START_CORNER_RAD) & (bend < math.pi - START_CORNER_RAD)
        around = np.abs(along.segments.radius - tool_radius_mm) <= POSITION_EPS_MM
        return path, np.flatnonzero(turns | around)
    length = _middle(along) if isinstance(rule, str) else along.nearest_to(rule)
    begun, start = _with_vertex(along, length)
    return begun, np.array([start], dtype=np.int64)


def _middle(along: Along) -> float:
    """The length along the path of the middle of its longest line, or else arc."""
    size = np.diff(along.reach)
    lines = np.where(along.segments.is_arc, 0.0, size)
    row = int((lines if lines.any() else size).argmax())
    return float(0.5 * (along.reach[row] + along.reach[row + 1]))


def _with_vertex(along: Along, length: float) -> tuple[Polyline, int]:
    """The path with a vertex at this length, and its index."""
    off = np.abs(along.reach - length)
    vertex = int(off.argmin())
    if off[vertex] <= START_SNAP_MM:
        return along.path, vertex % len(along.path)
    row = int(np.searchsorted(along.reach, length)) - 1
    begin, end = along.reach[row : row + 2]
    first = along.piece(begin, length)
    second = along.piece(length, end)
    parts = [along.path.vertices[:row], first[:1], second[:1], along.path.vertices[row + 1 :]]
    return Polyline(np.concatenate(parts), True), row + 1
