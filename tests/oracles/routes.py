"""Links between places of a region, one line at a time."""

from __future__ import annotations

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.distance import points_to_segments
from camtool.geometry.intersect import crossings
from camtool.geometry.measure import point_at
from camtool.geometry.polylines import Segments
from camtool.planning.clearing import ON_LINE_MM, ConnectedRegion
from camtool.planning.paths import true_ranges


def outside(start: Floats, end: Floats, region: ConnectedRegion) -> list[tuple[float, float]]:
    """The parts (from, to) of the straight line that are outside of the region, in order."""
    room = points_to_segments(start[None, :], region.segments).min()
    if np.hypot(*(end - start)) <= room + ON_LINE_MM:
        return []
    line = Segments.between(start[None, :], end[None, :], np.zeros(1))
    found = crossings(line, region.segments, position_eps_mm=ON_LINE_MM)
    marks = np.unique(np.concatenate([[0.0, 1.0], found.ta]))
    parts = 0.5 * (marks[1:] + marks[:-1])
    points = point_at(line, np.zeros(len(parts), dtype=np.int64), parts)
    first, last = true_ranges(~region.holds(points))
    return list(zip(marks[first].tolist(), marks[last].tolist(), strict=True))
