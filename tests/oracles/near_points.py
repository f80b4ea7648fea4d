"""The moves near points by plain loops: each point with each move."""

from __future__ import annotations

import math

import numpy as np

from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import Segments
from camtool.verification.cuts import CutMoves

EQUAL_MM = 1e-6


def share_and_distance(point: np.ndarray, segments: Segments, k: int) -> tuple[float, float]:
    """Return the share of a segment (0 to 1) nearest to a point, and the distance."""
    start, end = segments.start[k], segments.end[k]
    if not segments.is_arc[k]:
        way = end - start
        share = float((point - start) @ way) / (float(way @ way) or 1.0)
        share = min(max(share, 0.0), 1.0)
        return share, math.dist(point, start + share * way)
    centre, radius, sweep = segments.centre[k], float(segments.radius[k]), float(segments.sweep[k])
    begin, here = (math.atan2(*(place - centre)[::-1]) for place in (start, point))
    ahead = math.copysign(1.0, sweep) * (here - begin) % (2.0 * math.pi)
    if ahead <= abs(sweep):
        return ahead / abs(sweep), abs(math.dist(point, centre) - radius)
    ends = (0.0, math.dist(point, start)), (1.0, math.dist(point, end))
    return min(ends, key=lambda one: one[1])


def near_moves(
    cuts: CutMoves, point: np.ndarray, height: float, limits_mm: tuple[float, float]
) -> list[tuple[int, float]]:
    """(segment, distance) of all moves within the limits in XY and in height, in order."""
    limit_mm, window_mm = limits_mm
    found = []
    lengths, ends_z = segment_lengths(cuts.segments), cuts.ends_z
    for k in range(len(cuts.segments)):
        share, distance = share_and_distance(point, cuts.segments, k)
        low, high = ends_z[k]
        slope = abs(high - low) / lengths[k] if lengths[k] > 0.0 else 0.0
        off = abs(low + share * (high - low) - height)
        if distance <= limit_mm and off <= window_mm * (1.0 + slope):
            found.append((k, distance))
    return found


def nearest(found: list[tuple[int, float]]) -> tuple[float, int]:
    """Distance and segment of the nearest move, of equals the last; (inf, −1) for none."""
    least = min((distance for _, distance in found), default=math.inf)
    return least, max((k for k, away in found if away <= least + EQUAL_MM), default=-1)
