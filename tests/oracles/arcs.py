"""Arcs the plain way: by centre, radius and angles, one at a time."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from camtool.arrays import Floats

FLAT = 1e-13
"""Below this bulge an arc is taken as its chord."""


def centre_of(a: Floats, b: Floats, bulge: float) -> tuple[Floats, float]:
    """Centre and radius of the arc from a to b."""
    half = 2.0 * math.atan(bulge)
    chord = b - a
    length = float(np.hypot(*chord))
    radius = 0.5 * length / abs(math.sin(half))
    left = np.array([-chord[1], chord[0]]) / length
    return 0.5 * (a + b) + left * (0.5 * length / math.tan(half)), radius


def arc_distances(points: Floats, a: Floats, b: Floats, bulge: float) -> Floats:
    """(n,) distances from points (n, 2) to the arc from a to b."""
    to_ends = np.minimum(np.hypot(*(points - a).T), np.hypot(*(points - b).T))
    chord = b - a
    if abs(bulge) < FLAT:
        share = (points - a) @ chord / np.dot(chord, chord)
        foot = a + share[:, None] * chord
        to_line = np.hypot(*(points - foot).T)
        return np.where((share > 0.0) & (share < 1.0), to_line, to_ends)
    centre, radius = centre_of(a, b, bulge)
    start = math.atan2(*(a - centre)[::-1])
    angle = np.arctan2(*(points - centre).T[::-1])
    turn = (angle - start) * math.copysign(1.0, bulge) % (2.0 * math.pi)
    to_circle = np.abs(np.hypot(*(points - centre).T) - radius)
    return np.where(turn <= 4.0 * math.atan(abs(bulge)), to_circle, to_ends)


def chain_distances(points: Floats, vertices: Floats) -> Floats:
    """(n,) distance of each point to the nearest segment of an open path."""
    nearest = np.full(len(points), np.inf)
    for here, there in pairwise(vertices):
        nearest = np.minimum(nearest, arc_distances(points, here[:2], there[:2], float(here[2])))
    return nearest


def chain_points(vertices: Floats, each: int) -> Floats:
    """Points along an open path, `each` in every segment, ends included."""
    rows = [vertices[:1, :2]]
    for here, there in pairwise(vertices):
        share = np.arange(1, each + 1)[:, None] / each
        if abs(here[2]) < FLAT:
            rows.append(here[:2] + share * (there[:2] - here[:2]))
            continue
        centre, radius = centre_of(here[:2], there[:2], float(here[2]))
        start = math.atan2(*(here[:2] - centre)[::-1])
        angle = start + share * 4.0 * math.atan(here[2])
        rows.append(centre + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
    return np.concatenate(rows)


def kinks(vertices: Floats) -> Floats:
    """(n − 2,) angles rad between the segments at the inner vertices of an open path."""
    chords = np.diff(vertices[:, :2], axis=0)
    heading = np.arctan2(chords[:, 1], chords[:, 0])
    half = 2.0 * np.arctan(vertices[:-1, 2])
    turn = (heading[1:] - half[1:]) - (heading[:-1] + half[:-1])
    return np.abs((turn + np.pi) % (2.0 * np.pi) - np.pi)
