"""The shape that a round tool makes against the one that it should make, seen from above.

What is cut away is what a disc of the tool's diameter covers on its way: the paths, grown by the
radius. Overcut is what is cut away beside the wanted, undercut what stays of it; each has an area
and a depth, how far its farthest point lies from the other shape.

Arcs are chords here, and so are the discs' edges: both shapes with the same tolerance, so that
depths are wrong by two of it at most; what is not deeper than that is nothing. All depths of a
job are seen as one. The predicted path is the thinned one of the trace, which must have points
enough for its arcs (`points_wanted`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from camtool.geometry.measure import point_at
from camtool.geometry.polylines import Floats
from camtool.verify.cuts import CutMoves, moved_lengths
from camtool.verify.trace import Trace

SHAPE_TOLERANCE_MM = 5e-4
"""How far chords may be from their arcs, at most ..."""

TOLERANCE_SHARE = 2e-3
"""... and at most this share of the tool's radius."""

FEWEST_QUARTER = 8
"""A quarter of the tool's edge is so many chords at least."""


MOST_MOVES = 10_000
"""Programs of more cutting moves get no shape: to sweep them takes longer than all the rest ..."""

MOST_POINTS = 200_000
"""... and none whose path needs more points than this to be true."""


@dataclass(frozen=True)
class Shape:
    """The machined shape against the wanted one, mm and mm²; `tolerance_mm` of its chords."""

    diameter_mm: float
    overcut_mm2: float
    overcut_mm: float
    undercut_mm2: float
    undercut_mm: float
    tolerance_mm: float


def _tolerance_mm(diameter_mm: float) -> float:
    return min(SHAPE_TOLERANCE_MM, TOLERANCE_SHARE * 0.5 * diameter_mm)


def points_wanted(decoded: CutMoves, diameter_mm: float) -> int | None:
    """How many points a trace of these moves must have for the shape of a tool; None when that is
    too much work, or no tool.

    Chords of s mm leave an arc of radius r by s²/(8 r), so s ≤ √(8 r tolerance) of the smallest
    arc will do; a trace has a point every 2 way / points mm, twice as far apart at most, and one
    at the end of each move.
    """
    arcs = decoded.segments.is_arc
    if not diameter_mm or len(decoded.rows) > MOST_MOVES:
        return None
    points = 2 * len(decoded.toolpath)
    if arcs.any():
        least = float(decoded.segments.radius[arcs].min())
        chord = math.sqrt(8.0 * least * _tolerance_mm(diameter_mm))
        way = float(moved_lengths(decoded.toolpath).sum())
        points += math.ceil(4.0 * way / chord)
    return points if points <= MOST_POINTS else None


def machined_shape(trace: Trace, wanted: CutMoves, diameter_mm: float) -> Shape | None:
    """What a tool of this diameter makes along the trace against what it makes along `wanted`;
    None when one of them cuts nothing."""
    import shapely

    radius = 0.5 * diameter_mm
    tolerance = _tolerance_mm(diameter_mm)
    made_of, wanted_of = _runs(trace, tolerance), _chords(wanted, tolerance)
    if made_of is None or wanted_of is None:
        return None
    quarter = 0.25 * math.pi / math.acos(max(1.0 - tolerance / radius, 0.0))
    corners = max(FEWEST_QUARTER, math.ceil(quarter))
    made = shapely.buffer(made_of, radius, quad_segs=corners)
    asked = shapely.buffer(wanted_of, radius, quad_segs=corners)
    over = _beyond(made, asked, tolerance)
    under = _beyond(asked, made, tolerance)
    return Shape(diameter_mm, *over, *under, tolerance)


def _beyond(one: Any, other: Any, tolerance: float) -> tuple[float, float]:
    """Area (mm²) of `one` outside of `other`, and how far it reaches (mm); 0 within chords."""
    import shapely

    rest = shapely.difference(one, other)
    points = shapely.points(shapely.get_coordinates(rest))
    if len(points) == 0:
        return 0.0, 0.0
    edges = shapely.get_coordinates(shapely.boundary(other))
    tree = shapely.STRtree(_pieces(other)) if len(edges) else None
    if tree is None:
        return float(rest.area), math.inf
    shapely.prepare(other)  # which newer shapely does by itself
    outside = ~shapely.intersects_xy(other, *shapely.get_coordinates(rest).T)
    _, distance = tree.query_nearest(points[outside], return_distance=True, all_matches=False)
    depth = float(distance.max(initial=0.0))
    return (0.0, 0.0) if depth <= 2.0 * tolerance else (float(rest.area), depth)


def _pieces(region: Any) -> Any:
    """The edges of a region's boundary, one by one."""
    import shapely

    rings = shapely.get_rings(shapely.get_parts(region))
    found = []
    for ring in rings:
        points = shapely.get_coordinates(ring)
        found.append(shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1)))
    return np.concatenate(found)


def _runs(trace: Trace, tolerance: float) -> Any:
    """The cutting stretches of a trace as lines, straightened within the tolerance."""
    import shapely

    which = np.flatnonzero(trace.cutting)
    if len(which) == 0:
        return None
    lines = []
    for run in np.split(which, np.flatnonzero(np.diff(which) > 1) + 1):
        begin = max(int(run[0]) - 1, 0)  # the slides come from there
        points = trace.points[begin : int(run[-1]) + 1]
        if len(points) > 1:
            lines.append(shapely.linestrings(points))
    return shapely.simplify(shapely.multilinestrings(lines), 0.5 * tolerance) if lines else None


def _chords(cuts: CutMoves, tolerance: float) -> Any:
    """The wanted lines and arcs as lines of chords."""
    import shapely

    segments = cuts.segments
    if len(segments.path) == 0:
        return None
    radius = np.where(segments.is_arc, segments.radius, 1.0)
    most = 2.0 * np.arccos(np.clip(1.0 - tolerance / np.maximum(radius, tolerance), -1.0, 1.0))
    parts = np.where(segments.is_arc, np.ceil(np.abs(segments.sweep) / most), 1.0)
    parts = np.maximum(parts, 1.0).astype(np.int64)
    segment = np.repeat(np.arange(len(parts)), parts + 1)
    share = (np.arange(len(segment)) - np.repeat(np.cumsum(parts + 1) - parts - 1, parts + 1)) / (
        parts[segment]
    )
    points: Floats = point_at(segments, segment, share)
    return shapely.multilinestrings(shapely.linestrings(points, indices=segment))
