"""Paths followed at heights, and runs as cuts: the plain way, move by move."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from camtool.arrays import Bools, Floats
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Segments
from camtool.planning.paths import MAX_PART_SWEEP_RAD, SLOPE_EPS, reverse_vertices
from camtool.planning.ramps import ZProfile


def piece(path: Polyline, begin: float, end: float) -> Floats:
    """(k, 3) x, y, bulge of a path from one length to another, backwards when `end` is lower."""
    if end < begin:
        return reverse_vertices(piece(path, end, begin))
    segments = Segments.of(path)
    reach = np.concatenate([[0.0], np.cumsum(segment_lengths(segments))])
    total, count = float(reach[-1]), len(segments)
    laps = (math.floor(begin / total), math.floor(end / total)) if path.closed else (0, 0)
    rows = np.arange(laps[0] * count, (laps[1] + 1) * count)
    lap, row = np.divmod(rows, count)
    start = lap * total + reach[row]
    length = reach[row + 1] - reach[row]
    keep = (start + length > begin + POSITION_EPS_MM) & (start < end - POSITION_EPS_MM)
    if not keep.any():  # shorter than POSITION_EPS_MM: a piece of the one there
        keep = np.arange(len(rows)) == np.searchsorted(start, begin, side="right") - 1
    start, length, row = start[keep], length[keep], row[keep]
    low = np.where(begin - start > POSITION_EPS_MM, (begin - start) / length, 0.0)
    high = np.where(start + length - end > POSITION_EPS_MM, (end - start) / length, 1.0)
    part, whole = high - low, segments.bulge[row]
    bulge = np.where(part == 1.0, whole, np.tan(part * np.arctan(whole)))
    vertices = np.column_stack([point_at(segments, row, low), bulge])
    last = point_at(segments, row[-1:], high[-1:])
    return np.concatenate([vertices, np.column_stack([last, [0.0]])])


def lifted(path: Polyline, points: ZProfile) -> Floats:
    """(n, 4) x, y, z, bulge of a path with this profile."""
    segments = Segments.of(path)
    reach = np.concatenate([[0.0], np.cumsum(segment_lengths(segments))])
    length, z = points[0]
    if path.closed:
        length = length % float(reach[-1])
    row = int(np.clip(np.searchsorted(reach, length, side="right") - 1, 0, len(segments) - 1))
    share = np.clip((length - reach[row]) / (reach[row + 1] - reach[row]), 0.0, 1.0)
    place = point_at(segments, np.array([row]), np.array([share]))[0]
    rows = [np.array([[*place, z, 0.0]])]
    for (begin, z_begin), (end, z_end) in pairwise(points):
        if abs(end - begin) <= POSITION_EPS_MM:
            if abs(z_end - z_begin) > POSITION_EPS_MM:
                rows.append(np.array([[*rows[-1][-1, :2], z_end, 0.0]]))
            continue
        part = piece(path, begin, end)
        moves = Segments.between(part[:-1, :2], part[1:, :2], part[:-1, 2])
        done = np.cumsum(segment_lengths(moves))
        rows[-1][-1, 3] = part[0, 2]
        heights = z_begin + (z_end - z_begin) * done / done[-1]
        rows.append(np.column_stack([part[1:, :2], heights, part[1:, 2]]))
    return np.concatenate(rows)


@dataclass(frozen=True)
class Cut:
    """One line or arc to cut: where it ends, (x, y, z) mm; for arcs the centre (x, y) and the
    direction; its feed in mm/min, NaN for a rapid."""

    end: tuple[float, float, float]
    centre: tuple[float, float] | None
    ccw: bool
    feed: float


def cuts(vertices: Floats, feed_mm_min: Floats) -> Iterator[Cut]:
    """The lines and arcs of a run (n, 4), with the feeds (n−1,) of its moves, in order, arcs of
    one circle that follow each other as one."""
    segments = Segments.between(vertices[:-1, :2], vertices[1:, :2], vertices[:-1, 3])
    goes_on = _goes_on(segments, vertices, feed_mm_min)
    begin, swept = 0, 0.0
    for row, sweep in enumerate(segments.sweep.tolist()):
        if row > begin and goes_on[row - 1] and _within(segments, begin, row, swept + sweep):
            swept += sweep
            continue
        if row > begin:
            yield _cut(segments, slice(begin, row), vertices[row], feed_mm_min[begin])
        begin, swept = row, sweep
    if len(segments):
        yield _cut(segments, slice(begin, None), vertices[-1], feed_mm_min[begin])


def _within(segments: Segments, begin: int, last: int, swept: float) -> bool:
    if abs(swept) <= MAX_PART_SWEEP_RAD:
        return True
    apart = segments.end[last] - segments.start[begin]
    return bool(np.hypot(*apart) <= POSITION_EPS_MM and abs(swept) <= 2.0 * np.pi + SLOPE_EPS)


def _goes_on(segments: Segments, vertices: Floats, feed: Floats) -> Bools:
    length = np.where(segments.is_arc, segments.radius, 0.0) * np.abs(segments.sweep)
    slope = np.diff(vertices[:, 2]) / np.where(segments.is_arc, length, 1.0)
    same = _same_arc(segments[:-1], segments[1:]) & (np.abs(np.diff(slope)) <= SLOPE_EPS)
    return np.asarray(same & (feed[:-1] == feed[1:]))


def _cut(segments: Segments, rows: slice, end: Floats, feed: float) -> Cut:
    best = int(np.abs(segments.sweep[rows]).argmax()) + rows.start
    x, y, z = end[:3].tolist()
    if segments.bulge[best] == 0.0:
        return Cut((x, y, z), None, False, float(feed))
    if np.hypot(x - segments.start[rows.start, 0], y - segments.start[rows.start, 1]) <= (
        POSITION_EPS_MM
    ):
        x, y = segments.start[rows.start].tolist()
    centre_x, centre_y = segments.centre[best].tolist()
    return Cut((x, y, z), (centre_x, centre_y), bool(segments.bulge[best] > 0.0), float(feed))


def _same_arc(one: Segments, other: Segments) -> Bools:
    alike = one.is_arc & other.is_arc & (np.sign(one.bulge) == np.sign(other.bulge))
    apart = np.where(alike[:, None], one.centre - other.centre, np.inf)
    radius, other_radius = (np.where(alike, each.radius, 0.0) for each in (one, other))
    near = np.hypot(apart[:, 0], apart[:, 1]) <= POSITION_EPS_MM
    return np.asarray(near & (np.abs(radius - other_radius) <= POSITION_EPS_MM))
