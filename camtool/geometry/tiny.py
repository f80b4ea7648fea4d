"""Segments too short to matter merged into their neighbours.

Along a path, vertices that lie within the limit of the first of them (measured along the path)
are one *cluster* and become one vertex of it. Every point of the old path is then within the
limit of the new one, and the other way round: a segment between two clusters has moved at its
ends by no more. Arcs between clusters must not move, so a cluster takes the vertex at which an
arc arrives or leaves; where arcs do both at different ones, all stays as it was.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Polyline, Polylines, Segments


@dataclass(frozen=True, eq=False)
class Merged:
    """The paths after merging, and how many segments went."""

    lines: Polylines
    count: int


def without_tiny(lines: Polylines, limit_mm: float) -> Merged:
    """The paths with no vertex moved by more than `limit_mm`, less the segments below it.

    A path of which too little would be left stays as it is.
    """
    segments = Segments.of(lines)
    lengths = segment_lengths(segments)
    short = np.bincount(segments.path[lengths <= limit_mm], minlength=len(lines)) > 0
    if not short.any():
        return Merged(lines, 0)
    first = np.searchsorted(segments.path, np.arange(len(lines) + 1))
    paths, gone = list(lines), 0
    for index in np.flatnonzero(short).tolist():
        path = paths[index]
        keep, moved = _merged(path, lengths[first[index] : first[index + 1]], limit_mm)
        made = _made(path, keep, moved)
        if made is not None:
            gone += len(path) - len(made)
            paths[index] = made
    return Merged(Polylines.of(paths), gone)


def _merged(path: Polyline, lengths: Floats, limit: float) -> tuple[list[int], list[int]]:
    """For each vertex of the new path the old one whose place it takes, and whose bulge."""
    bulges = path.vertices[:, 2].tolist()
    steps = lengths.tolist()
    count = len(bulges)
    place: list[int] = []
    bend: list[int] = []
    i = 0
    while i < count:
        j, run = i, 0.0
        while j + 1 < count and run + steps[j] <= limit:
            run += steps[j]
            j += 1
        arrives = bulges[i - 1] != 0.0 and (i > 0 or path.closed)
        leaves = bulges[j] != 0.0
        is_last = not path.closed and j == count - 1
        if j > i and (
            (arrives and (leaves or is_last)) or (i == 0 and leaves and not path.closed)
        ):
            # An end of an open path stays where it is, as an arc does.
            place.extend(range(i, j + 1))
            bend.extend(range(i, j + 1))
        else:
            place.append(j if leaves or is_last else i)
            bend.append(j)
        i = j + 1
    return place, bend


def _made(path: Polyline, place: list[int], bend: list[int]) -> Polyline | None:
    """The path of these vertices; None when it is no path, or nothing has changed."""
    if len(place) == len(path.vertices) or len(place) < 2:
        return None
    vertices = path.vertices[place].copy()
    vertices[:, 2] = path.vertices[bend, 2]
    if path.closed and len(vertices) < 3 and not vertices[:, 2].any():
        return None
    step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
    shortest = min(math.hypot(x, y) for x, y in (step if path.closed else step[:-1]).tolist())
    return Polyline(vertices, path.closed) if shortest > POSITION_EPS_MM else None
