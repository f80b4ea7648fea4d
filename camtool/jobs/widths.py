"""Widths of what is drawn: the contours beside or within which a tool has no room, and slots.

Tools run in waste: around outer contours, and within inner ones. Contours that bound the same
waste must be at least as far from each other as the tool is wide, or it cuts into one of them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from camtool.arrays import Bools, Ints, distinct
from camtool.errors import GeometryError
from camtool.geometry.boxes import BoxIndex
from camtool.geometry.distance import paired_distances
from camtool.geometry.drawing import Drawing, is_text
from camtool.geometry.measure import path_extents, segment_boxes, signed_areas
from camtool.geometry.offset import offset_each
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polylines,
    Segments,
    reverse_lines,
    segment_rows,
)

SLOT_MM = 0.01
"""A slot is as wide as a tool if a tool with a radius smaller by this passes through it, and one
with a radius larger by this does not. The walls of such slots may be cut this far beyond the line.
"""

LETTER_SHARE = 10.0
"""A crowded contour up to this many tool diameters large makes everything within it crowded too,
as a letter does its counters."""

SEGMENTS_AT_A_TIME = 1 << 10
"""Number of segments whose neighbours are searched at a time; later batches leave out pairs
already found."""

NEAR_SHARE = 1e-6
"""Contours that are nearer than the tool's width by only this share of it are not crowded:
rounding."""


def has_room(lines: Polylines, radius_mm: float) -> Bools:
    """Return the mask (N,) of closed paths with room inside for the centre of a tool of this
    radius, that is, whose inward offset is not empty. For paths that enclose no clear region, the
    mask of those whose bounding box is wider than the tool is returned."""
    ccw = reverse_lines(lines, signed_areas(lines) < 0.0)
    has_space: Bools = (
        np.ptp(path_extents(lines), axis=2).min(axis=1, initial=np.inf) > 2.0 * radius_mm
    )
    if not has_space.any():
        return has_space
    rows = np.flatnonzero(has_space)
    try:
        owners = offset_each(ccw.select(rows), radius_mm)[1]
    except GeometryError:
        return has_space
    has_space[:] = False
    has_space[rows[distinct(owners)]] = True
    return has_space


def is_slot(lines: Polylines, width_mm: float) -> Bools:
    """Return the mask (N,) of closed paths that are slots for a tool of this width: their widest
    place is as wide as the tool, within SLOT_MM of the radius."""
    radius = 0.5 * width_mm
    if not radius > SLOT_MM:
        return np.zeros(len(lines), dtype=np.bool_)
    return np.asarray(has_room(lines, radius - SLOT_MM) & ~has_room(lines, radius + SLOT_MM))


@lru_cache(maxsize=8)
def crowded(drawing: Drawing, width_mm: float) -> frozenset[int]:
    """Return the rows of closed paths, except letters, that a tool of this width cannot run beside
    or within without cutting into a neighbour, and of those that cross others. A small crowded
    path also brings in everything within it (LETTER_SHARE)."""
    lettered = np.array([is_text(source) for source in drawing.sources], dtype=np.bool_)
    rows = np.flatnonzero(drawing.paths.closed & ~lettered)
    lines = drawing.paths.select(rows)
    if not len(rows) or not width_mm > 2.0 * SLOT_MM:
        return frozenset()
    levels = drawing.nesting.among(rows).levels
    is_outer = levels.depth % 2 == 0
    waste = np.where(is_outer, levels.parent, np.arange(len(rows)))
    is_crowded = np.zeros(len(lines), dtype=np.bool_)
    is_crowded[~is_outer] = ~has_room(
        lines.select(np.flatnonzero(~is_outer)), 0.5 * width_mm - SLOT_MM
    )
    _add_near(lines, waste, width_mm, is_crowded)
    sizes = np.ptp(path_extents(lines), axis=2).max(axis=1)
    is_small = sizes <= LETTER_SHARE * width_mm
    # outer paths before those within them
    for row in np.argsort(levels.depth, kind="stable").tolist():
        parent = int(levels.parent[row])
        is_crowded[row] |= bool(parent >= 0 and is_crowded[parent] and is_small[parent])
    return frozenset(rows[is_crowded].tolist())


def _add_near(lines: Polylines, waste: Ints, width_mm: float, is_crowded: Bools) -> None:
    """Set `is_crowded` (N,) in place for closed paths that bound the same `waste` and are nearer
    to each other than this width, and for paths that cross."""
    segments = Segments.leaving(lines, segment_rows(lines))
    path, boxes = segments.path, segment_boxes(segments)
    index, grown = BoxIndex(boxes), boxes + np.array([-1.0, -1.0, 1.0, 1.0]) * width_mm
    min_distance = width_mm * (1.0 - NEAR_SHARE)
    for first in range(0, len(boxes), SEGMENTS_AT_A_TIME):
        for one, other in index.pairs(grown[first : first + SEGMENTS_AT_A_TIME]):
            one = one + first
            a, b = path[one], path[other]
            # Contours that bound different waste may be near each other, but must not touch or
            # cross.
            reach = np.where(waste[a] == waste[b], min_distance, POSITION_EPS_MM)
            low = np.maximum(boxes[one, :2], boxes[other, :2])
            high = np.minimum(boxes[one, 2:], boxes[other, 2:])
            is_open = (a < b) & ~(is_crowded[a] & is_crowded[b])
            rows = np.flatnonzero(is_open & ((low - high).max(axis=1) < reach))
            near = paired_distances(segments[one[rows]], segments[other[rows]])[0] < reach[rows]
            is_crowded[a[rows[near]]] = is_crowded[b[rows[near]]] = True
