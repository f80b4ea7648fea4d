"""The height of the tool over the length along a path: passes, plunges and ramps.

A *profile* is a list of knots (length, z) in the order of travel: between two knots the tool
follows the path, forwards or backwards, and z changes in proportion to the length; two knots of
the same length are a move straight up or down.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from camtool.geometry.measure import segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Segments
from camtool.planning.along import Along
from camtool.planning.items import Feeds

Knots = list[tuple[float, float]]


def laps(along: Along, levels_mm: Sequence[float], overlap_mm: float) -> Knots:
    """Round a closed path at each level, straight down from one to the next at the start."""
    knots: Knots = []
    for turn, z in enumerate(levels_mm):
        knots += [(turn * along.total_mm, z), ((turn + 1) * along.total_mm, z)]
    knots.append((len(levels_mm) * along.total_mm + overlap_mm, levels_mm[-1]))
    return knots


def to_and_fro(along: Along, levels_mm: Sequence[float]) -> Knots:
    """From end to end of an open path at each level, straight down at the ends."""
    knots: Knots = []
    for turn, z in enumerate(levels_mm):
        ends = (0.0, along.total_mm) if turn % 2 == 0 else (along.total_mm, 0.0)
        knots += [(ends[0], z), (ends[1], z)]
    return knots


def lifted(along: Along, knots: Knots) -> Floats:
    """(n, 4) x, y, z, bulge of the path with this profile."""
    length, z = knots[0]
    rows = [np.array([[*along.at(np.array([length]))[0], z, 0.0]])]
    for (begin, z_begin), (end, z_end) in pairwise(knots):
        if abs(end - begin) <= POSITION_EPS_MM:
            if abs(z_end - z_begin) > POSITION_EPS_MM:
                rows.append(np.array([[*rows[-1][-1, :2], z_end, 0.0]]))
            continue
        piece = along.piece(begin, end)
        done = np.cumsum(_lengths(piece))
        rows[-1][-1, 3] = piece[0, 2]
        heights = z_begin + (z_end - z_begin) * done / done[-1]
        rows.append(np.column_stack([piece[1:, :2], heights, piece[1:, 2]]))
    return np.concatenate(rows)


def feeds_along(vertices: Floats, feeds: Feeds) -> Floats:
    """(n−1,) mm/min for the moves between vertices (n, 4).

    Straight up and down at the plunge feed; all others at the feed of the cut, but no faster than
    that the vertical part of the feed is the plunge feed.
    """
    across = _lengths(vertices[:, [0, 1, 3]])
    rise = np.abs(np.diff(vertices[:, 2]))
    with np.errstate(divide="ignore", over="ignore"):
        limit = feeds.plunge_mm_min * np.hypot(across, rise) / rise
    return np.where(rise > 0.0, np.minimum(feeds.cut_mm_min, limit), feeds.cut_mm_min)


def _lengths(vertices: Floats) -> Floats:
    """(k−1,) lengths of the lines and arcs between vertices (k, 3), seen from above."""
    return segment_lengths(Segments.between(vertices[:-1, :2], vertices[1:, :2], vertices[:-1, 2]))
