"""Reliefs: at a sharp inner corner a round tool goes a bit further, so that nothing is left of it.

A tool of radius r that runs at the distance d from two walls (d = r, and the allowance) stands at
V when it turns, and leaves what lies between its edge and the corner C of the part:

    dog-bone   from V towards C and back, to where C is at the distance d from the tool centre;
    overcut    from V along the longer wall and back, to where that is so.

    ════════════╗C           |V C| = d / sin(α/2) for straight walls that meet at the angle α:
         V ·  ╱ ║            the dog-bone is d (1/sin(α/2) − 1) long, the overcut d / tan(α/2).
         ───· V'║

A corner that is rounded in the drawing, by however small an arc, is not sharp."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.geometry.distance import paired_distances, points_to_segments
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.planning.paths import MeasuredPath

MIN_RELIEF_MM = 1e-3
"""A corner that the tool's edge misses by no more than this gets no relief."""

RELIEF_MATCH_MM = 1e-5
"""The tool stands at a corner when its distances from both walls differ by no more than this."""

RELIEF_TURN_RAD = 1e-2
"""Where the tool's path turns by no more than this, there is no corner."""

RELIEF_SLACK_MM = 1e-4
"""A relief may come nearer to other wanted lines than it should by this much."""


class RelievedPath(Struct, frozen=True, eq=False):
    """The path with its reliefs; `left` (K, 2) mm: the corners without a relief, because the tool
    would have cut into other wanted lines."""

    path: Polyline
    left: Floats


def add_reliefs(
    path: Polyline, original: Polyline, near_mm: float, kind: str, keep_out: Polylines
) -> RelievedPath:
    """Return a path of the tool centre with reliefs at the sharp inner corners of the contour
    `original`.

    `kind` is "dogbone" or "overcut". Reliefs keep at least `near_mm` from the lines of `keep_out`,
    and from the walls of the original beyond the corner: the tool's radius, reduced by what is cut
    beyond the lines."""
    if near_mm == 0.0:
        return RelievedPath(path, np.empty((0, 2)))
    along, walls = MeasuredPath.of(path), MeasuredPath.of(original)
    other_walls = Segments.of(Polylines.of([original, *keep_out]))
    reliefs: dict[int, list[Floats]] = {}
    uncleared: list[Floats] = []
    for corner, vertex in _missed_corners(along, walls, near_mm).items():
        move = _relief_move(along, vertex, walls, corner, kind)
        if _is_clear(move, walls.segments.start[corner], other_walls, near_mm):
            reliefs.setdefault(vertex, []).append(move[1])
        else:
            uncleared.append(walls.segments.start[corner])
    rows: list[Floats] = []
    for vertex, row in enumerate(path.vertices):
        for tip in reliefs.get(vertex, []):
            rows += [np.array([*row[:2], 0.0]), np.array([*tip, 0.0])]
        rows.append(row)
    return RelievedPath(Polyline(np.array(rows), path.closed), np.array(uncleared).reshape(-1, 2))


def _missed_corners(along: MeasuredPath, walls: MeasuredPath, near_mm: float) -> dict[int, int]:
    """Return the corners (vertices of the walls) that the tool does not reach, each with the
    vertex of the tool's path from which it is missed: the nearest vertex equally far from both
    walls of the corner."""
    nearest_vertex: dict[int, tuple[float, int]] = {}
    for vertex in np.flatnonzero(np.abs(along.turns) > RELIEF_TURN_RAD).tolist():
        v = along.path.vertices[vertex, :2]
        distance = points_to_segments(v[None], walls.segments)[0]
        distance_min = float(distance.min())
        if distance_min < near_mm - RELIEF_MATCH_MM:
            continue
        is_near = distance <= distance_min + RELIEF_MATCH_MM
        reach = np.hypot(*(walls.segments.start - v).T)
        is_missed = is_near & np.roll(is_near, 1) & (reach > distance_min + MIN_RELIEF_MM)
        for corner in np.flatnonzero(is_missed).tolist():
            candidate = (float(reach[corner]), vertex)
            nearest_vertex[corner] = min(nearest_vertex.get(corner, candidate), candidate)
    return {corner: vertex for corner, (_, vertex) in nearest_vertex.items()}


def _relief_move(
    along: MeasuredPath, vertex: int, walls: MeasuredPath, corner: int, kind: str
) -> Floats:
    """Return the move (2, 2) from V to the place where the tool's edge touches the corner."""
    v, c = along.path.vertices[vertex, :2], walls.segments.start[corner]
    distance_min = float(points_to_segments(v[None], walls.segments).min())
    arm = c - v
    if kind == "overcut":
        heading = _along_longer(along, vertex, walls, corner)
        foot = float(arm @ heading)
        offset = math.sqrt(max(float(arm @ arm) - foot * foot, 0.0))
        if offset <= distance_min + RELIEF_MATCH_MM:
            # A straight wall stays at this distance; one that bends may come nearer.
            bent = offset < distance_min - RELIEF_MATCH_MM
            setback = math.sqrt(distance_min * distance_min - offset * offset) if bent else 0.0
            return np.array([v, v + (foot - setback) * heading])
    # Beside a bent wall the path along it may not come near enough to the corner.
    return np.array([v, c - arm * (distance_min / math.hypot(*arm))])


def _along_longer(along: MeasuredPath, vertex: int, walls: MeasuredPath, corner: int) -> Floats:
    """Return the direction (2,) beyond V along the longer wall.

    Of two equally long walls it is the one nearer to the X axis, so that symmetric parts stay
    symmetric."""
    length_here = along.reach[vertex : vertex + 1]
    before = along.at(length_here - 0.5 * np.diff(along.reach)[vertex - 1])
    pair = np.array([corner - 1, corner]) % len(walls.segments)
    wall_distances = points_to_segments(before, walls.segments[pair])[0]
    reach_before, reach_after = np.diff(walls.reach)[
        pair[:: 1 if wall_distances[0] <= wall_distances[1] else -1]
    ]
    heading, heading_back = along.arrivals(length_here)[0], -along.directions(length_here)[0]
    if abs(reach_before - reach_after) <= POSITION_EPS_MM:
        return np.asarray(heading if abs(heading[0]) >= abs(heading_back[0]) else heading_back)
    return np.asarray(heading if reach_before > reach_after else heading_back)


def _is_clear(move: Floats, corner: Floats, other_walls: Segments, near_mm: float) -> bool:
    """Return True if a tool that makes this move cuts into no wanted line except those at the
    corner."""
    low, high = move.min(axis=0) - near_mm, move.max(axis=0) + near_mm
    boxes = segment_boxes(other_walls)
    rows = np.flatnonzero(((boxes[:, :2] < high) & (boxes[:, 2:] > low)).all(axis=1))
    at_corner = points_to_segments(corner[None], other_walls[rows])[0] <= RELIEF_MATCH_MM
    rows = rows[~at_corner]
    line = Segments.between(move[:1], move[1:], np.zeros(1))
    distance, _ = paired_distances(line[np.zeros_like(rows)], other_walls[rows])
    return bool((distance >= near_mm - RELIEF_SLACK_MM).all())
