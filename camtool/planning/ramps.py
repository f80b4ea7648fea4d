"""The height of the tool over the length along a path: passes, plunges and ramps.

A *profile* is a list of points (length, z) in the order of travel: between two points the tool
follows the path, forwards or backwards, and z changes in proportion to the length; two points of
the same length are a move straight up or down.

Round a closed path a ramp slopes until it reaches the level, the tool goes on at it, and begins
to slope to the next level where it has been once round: no lap takes more than one step down, and
the last one is flat all round. `B` is where the bottom is reached, `S` the start of the path: the
ramp begins so far before the start that B falls on it, and the last lap begins and ends there.

    z  0 ╲
         │ ╲____________
      z1 │              ╲
         │               ╲_B____________________
      z2 │                 S                    S

Where a lead goes out of the contour, it is cut at every level: at the place where the last lap
ends the tool goes out and back, once it is down at the level.

On an open path the tool goes down to and fro near the end where it is, back to that end, and then
along the level to the other end, which takes away what the ramp left."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import Segments
from camtool.kernels.passes import lifted as lift
from camtool.planning.items import Feeds
from camtool.planning.paths import MeasuredPaths

ZProfile = list[tuple[float, float]]

MIN_HELIX_SHARE = 0.1
"""The smallest useful radius of a helix, over the tool's radius."""

MAX_LAPS = 200.0


def laps(total_mm: float, levels_mm: Sequence[float], overlap_mm: float) -> ZProfile:
    """Return the profile for a closed path: once round at each level, straight down to the next
    one at the start."""
    points: ZProfile = []
    for turn, z in enumerate(levels_mm):
        points += [(turn * total_mm, z), ((turn + 1) * total_mm, z)]
    points.append((len(levels_mm) * total_mm + overlap_mm, levels_mm[-1]))
    return points


def separate_laps(
    total_mm: float, levels_mm: Sequence[float], overlap_mm: float
) -> list[ZProfile]:
    """Return one profile for each level, once round a closed path."""
    return [[(0.0, z), (total_mm + overlap_mm, z)] for z in levels_mm]


def spiral(
    total_mm: float, levels_mm: Sequence[float], overlap_mm: float, angle_rad: float
) -> ZProfile:
    """Return the profile for a closed path that slopes from the stock top to each level in turn,
    with one flat lap at the last."""
    points: ZProfile = [(0.0, 0.0)]
    begin = above = 0.0
    for z in levels_mm:
        ramp = (above - z) / math.tan(angle_rad)
        points += [(begin, above), (begin + ramp, z)]
        begin, above = begin + max(ramp, total_mm), z
    bottom = points[-1][0]
    points.append((bottom + total_mm + overlap_mm, above))
    before = bottom % total_mm
    return [(length - before, z) for length, z in points]


def spiral_with_stops(
    total_mm: float, levels_mm: Sequence[float], overlap_mm: float, angle_rad: float
) -> tuple[ZProfile, list[float]]:
    """Return the profile of a spiral, and for each level except the last a length at which the
    tool has reached it; all these lie at the place where the last lap ends.

    All ramps are as long as that of the largest step, so that all end at one place."""
    above = (0.0, *levels_mm[:-1])
    ramp = max(a - z for a, z in zip(above, levels_mm, strict=True)) / math.tan(angle_rad)
    laps_each = math.ceil((ramp + overlap_mm) / total_mm)
    points: ZProfile = []
    stops = []
    for turn, z in enumerate(levels_mm):
        bottom = turn * laps_each * total_mm
        stops.append(bottom + overlap_mm)
        points += [(bottom - ramp, above[turn]), (bottom, z), (stops[-1], z)]
    points[-1] = (bottom + total_mm + overlap_mm, levels_mm[-1])
    return points, stops[:-1]


def to_and_fro(
    total_mm: float, levels_mm: Sequence[float], above_mm: float, angle_rad: float | None
) -> ZProfile:
    """Return the profile for an open path: along it at each level, from the end where the level
    before ended.

    Down from `above_mm` and between the levels straight (`angle_rad` None), or sloping by the
    angle."""
    points: ZProfile = []
    for turn, z in enumerate(levels_mm):
        pass_points: ZProfile = [(0.0, z), (total_mm, z)]
        if angle_rad is not None:
            pass_points = [*_zigzag(total_mm, above_mm, z, angle_rad), (total_mm, z)]
        points += (
            [(total_mm - s, height) for s, height in pass_points] if turn % 2 else pass_points
        )
        above_mm = z
    return points


def _zigzag(total_mm: float, above_mm: float, z_mm: float, angle_rad: float) -> ZProfile:
    """Return the profile of a descent at the start of an open path, to and fro as often as
    needed."""
    ramp = (above_mm - z_mm) / math.tan(angle_rad)
    legs = 2 * math.ceil(ramp / (2.0 * total_mm))
    drop = (above_mm - z_mm) / legs
    return [(leg % 2 * ramp / legs, above_mm - leg * drop) for leg in range(legs)] + [(0.0, z_mm)]


def lift_paths(
    paths: MeasuredPaths, index: Sequence[int], profiles: Sequence[ZProfile]
) -> list[Floats]:
    """Return the vertices (n, 4) x, y, z, bulge of each run: path index[r] (R,) with the heights
    of profiles[r] (R,)."""
    first = np.concatenate([[0], np.cumsum([len(points) for points in profiles])])
    points = np.array([point for points in profiles for point in points]).reshape(-1, 2)
    length, z = np.ascontiguousarray(points.T)
    vertices, runs = lift(paths.tracks, np.array(index, dtype=np.int64), first, length, z)
    ends = runs.tolist()
    return [vertices[begin:end] for begin, end in pairwise(ends)]


def helix(centre: Floats, radius: float, towards: Floats, length: float) -> Floats:
    """Return CCW arcs (k, 3) about a centre with this total length in the plane; the last ends at
    the point of the circle nearest to `towards`."""
    arm = towards - centre
    end = math.atan2(arm[1], arm[0])
    sweep = length / radius
    count = max(1, math.ceil(sweep / math.pi))
    angles = end - sweep + sweep / count * np.arange(count + 1)
    bulge = np.full(count + 1, math.tan(0.25 * sweep / count))
    bulge[-1] = 0.0
    points = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.column_stack([points, bulge])


def feeds_along(vertices: Floats, feeds: Feeds) -> Floats:
    """Return the feeds (n − 1,), mm/min, of the moves between vertices (n, 4).

    Vertical moves have the plunge feed; all others the feed of the cut, reduced where necessary so
    that its vertical part does not exceed the plunge feed."""
    across = _lengths(vertices[:, [0, 1, 3]])
    rise = np.abs(np.diff(vertices[:, 2]))
    sloping = rise > 0.0
    limit = feeds.plunge_mm_min * np.hypot(across, rise) / np.where(sloping, rise, 1.0)
    feed = np.where(sloping, np.minimum(feeds.cut_mm_min, limit), feeds.cut_mm_min)
    return np.where(across > 0.0, feed, feeds.plunge_mm_min)


def _lengths(vertices: Floats) -> Floats:
    """Return the lengths (k − 1,) in the plane of the lines and arcs between vertices (k, 3)."""
    return segment_lengths(Segments.between(vertices[:-1, :2], vertices[1:, :2], vertices[:-1, 2]))
