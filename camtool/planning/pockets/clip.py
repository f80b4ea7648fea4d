"""Paths cut by a region, exact with arcs: what of them is within it, or outside."""

from __future__ import annotations

import numpy as np

from camtool.geometry.intersect import crossings
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Bools,
    Floats,
    Ints,
    Polyline,
    Polylines,
    Segments,
)
from camtool.planning.contours.along import Along


def outside_parts(lines: Polylines, region: Polylines) -> list[Polyline]:
    """What of the paths lies outside of a region (even-odd): open stretches, or whole paths."""
    border = Segments.of(region)
    found: list[Polyline] = []
    for path in lines:
        along = Along.of(path)
        marks = _marks(along, border)
        outside = ~inside(along.at(0.5 * (marks[1:] + marks[:-1])), border)
        found += _runs(along, marks, outside)
    return found


def _marks(along: Along, border: Segments) -> Floats:
    """The lengths along a path, ascending, where it meets the border, and both its ends."""
    met = crossings(along.segments, border)
    lengths = segment_lengths(along.segments)
    at = along.reach[met.row_a] + met.ta * lengths[met.row_a]
    every = np.unique(np.concatenate([[0.0, along.total_mm], at]))
    apart = np.concatenate([[True], np.diff(every) > POSITION_EPS_MM])
    marks: Floats = every[apart]
    marks[-1] = along.total_mm
    return marks


def _runs(along: Along, marks: Floats, wanted: Bools) -> list[Polyline]:
    """The stretches between marks that are wanted, neighbours as one."""
    if wanted.all():
        return [along.path]
    begin, end = marks[:-1], marks[1:]
    if along.path.closed:
        turn = int(np.argmin(wanted))
        wanted = np.roll(wanted, -turn)
        begin = np.roll(
            np.where(np.arange(len(begin)) < turn, begin + along.total_mm, begin), -turn
        )
        end = np.roll(np.where(np.arange(len(end)) < turn, end + along.total_mm, end), -turn)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], wanted.astype(np.int64), [0]])))
    return [
        Polyline(along.piece(float(begin[first]), float(end[last - 1])))
        for first, last in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True)
    ]


def scanned(line: Segments, region: Segments) -> tuple[Ints, Floats, Floats]:
    """What of K straight lines is in a region: rows (J,), and from and to which part of each.

    Ascending by row and by part; pieces up to POSITION_EPS_MM are left out.
    """
    met = crossings(line, region)
    rows = np.concatenate([np.arange(len(line)), np.arange(len(line)), met.row_a])
    part = np.concatenate([np.zeros(len(line)), np.ones(len(line)), met.ta])
    order = np.lexsort([part, rows])
    rows, part = rows[order], part[order]
    same = rows[1:] == rows[:-1]
    row, low, high = rows[:-1][same], part[:-1][same], part[1:][same]
    keep = (high - low) * segment_lengths(line)[row] > POSITION_EPS_MM
    row, low, high = row[keep], low[keep], high[keep]
    within = inside(point_at(line, row, 0.5 * (low + high)), region)
    return row[within], low[within], high[within]
