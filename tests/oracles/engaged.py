"""The engagement of a tool, direction by direction: no formula of circles, no grid."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.planning.items import CutRun
from camtool.planning.strokes import chords

DIRECTIONS = 360
EVERY = 23
"""The oracle looks at every chord of this number."""


def greatest_engagement(
    runs: Sequence[CutRun], radius: float, thick: float, air: shapely.Geometry | None = None
) -> float:
    """Return the greatest engagement angle, rad, behind each entry: the front of the tool's circle
    is looked at in many directions, and a point of it is air where it is nearer than the radius to
    any place where the tool was before. With `air`, which is none of the stock, there is no entry:
    all of the way counts."""
    each = [chords_of(run) for run in runs]
    ends = np.concatenate(each)
    level = ends[:, 4:].max(axis=1) < ends[:, 4:].min() + 1e-6
    moves = ends[level][:, :4]
    length = np.hypot(*(moves[:, 2:] - moves[:, :2]).T)
    way = np.cumsum(length)
    of_run = np.repeat(np.arange(len(runs)), [len(own) for own in each])[level]
    has_helix = np.array([run.vertices[0, 2] >= 0.0 for run in runs])
    begins = way[np.searchsorted(of_run, of_run)] + 2.0 * math.pi * radius
    is_judged = (length > 1e-9) & ((way > begins) | ~has_helix[of_run] | (air is not None))
    wide_air = None if air is None else air.buffer(thick)
    angles = (np.arange(DIRECTIONS) + 0.5) / DIRECTIONS * math.pi - 0.5 * math.pi
    greatest = 0.0
    for number in np.flatnonzero(is_judged)[::EVERY].tolist():
        start, end = moves[number, :2], moves[number, 2:]
        heading = math.atan2(*(end - start)[::-1])
        place = 0.5 * (start + end)
        circle = place + radius * np.column_stack(
            [np.cos(angles + heading), np.sin(angles + heading)]
        )
        near = distance(place[None, :], moves[:number])[:, 0] < 2.0 * radius
        older = way[number] - way[:number] > 100.0 * thick
        points, engaged = shapely.points(circle), np.ones(DIRECTIONS, dtype=bool)
        for rows, slack in ((near & older, thick), (near & ~older, 0.0)):
            if rows.any():
                lines = shapely.linestrings(moves[:number][rows].reshape(-1, 2, 2))
                places = shapely.multilinestrings(lines)
                shapely.prepare(places)
                engaged &= ~shapely.dwithin(places, points, radius + slack)
        if wide_air is not None:
            engaged &= ~shapely.contains_xy(wide_air, *circle.T)
        greatest = max(greatest, float(engaged.mean()) * math.pi)
    return greatest


def chords_of(run: CutRun) -> Floats:
    """(K, 6) x, y to x, y, and the heights of both ends, of short chords of a run."""
    flat = run.vertices[:, [0, 1, 3]]
    parts = []
    for index in range(len(flat) - 1):
        if np.hypot(*(flat[index + 1, :2] - flat[index, :2])) < 1e-9:
            continue
        piece = chords(np.array([flat[index], [*flat[index + 1, :2], 0.0]]), 1e-3)
        z = run.vertices[index : index + 2, 2]
        parts.append(np.column_stack([piece, np.full((len(piece), 2), z)]))
    return np.concatenate(parts)


def distance(points: Floats, moves: Floats) -> Floats:
    """(M, P) distances of points (P, 2) from straight moves (M, 4)."""
    start, along = moves[:, None, :2], (moves[:, 2:] - moves[:, :2])[:, None, :]
    square = np.maximum((along**2).sum(axis=2), 1e-30)
    part = np.clip(((points[None] - start) * along).sum(axis=2) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*np.moveaxis(points[None] - start - part[..., None] * along, 2, 0)))
