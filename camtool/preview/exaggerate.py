"""The path of the slides with its deviation from what was wanted, many times as large.

With p a point of the slides and q the point of the wanted path that is nearest to it, there is
drawn  q + N (p − q).  A factor of 1 changes nothing; where two points of the wanted path are as
near, the picture jumps, as the nearest point does.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import Segments

Floats = npt.NDArray[np.float64]


def exaggerated(points: Floats, wanted: Segments, times: float) -> Floats:
    """(T, 2) mm of points (T, 2) mm, `times` as far from the nearest point of `wanted`."""
    if not len(points) or not len(wanted):
        return points
    foot = nearest_points(points, wanted)
    return np.asarray(foot + times * (points - foot))


def nearest_points(points: Floats, wanted: Segments) -> Floats:
    """(T, 2) mm: of the lines and arcs of `wanted`, the point nearest to each of the points."""
    from camtool.kernels.closest import nearest_rows

    boxes = segment_boxes(wanted)
    row = nearest_rows(points, wanted.start, wanted.end, wanted.bulge, boxes)
    begin, end, sweep = wanted.start[row], wanted.end[row], wanted.sweep[row]
    chord = end - begin
    square = (chord**2).sum(axis=1)
    share = ((points - begin) * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    foot = begin + np.clip(share, 0.0, 1.0)[:, None] * chord
    is_arc = sweep != 0.0
    foot[is_arc] = _on_arcs(points[is_arc], wanted, row[is_arc])
    return np.asarray(foot)


def _on_arcs(points: Floats, wanted: Segments, row: npt.NDArray[np.int64]) -> Floats:
    """Along the spoke through each point where that meets the arc, else its nearer end."""
    spoke = points - wanted.centre[row]
    length = np.hypot(spoke[:, 0], spoke[:, 1])
    along = spoke / np.where(length > 0.0, length, 1.0)[:, None]
    foot = wanted.centre[row] + wanted.radius[row, None] * along
    sweep = wanted.sweep[row]
    angle = np.arctan2(spoke[:, 1], spoke[:, 0]) - wanted.start_angle[row]
    turned = np.mod(np.sign(sweep) * angle, 2.0 * np.pi)
    begin, end = wanted.start[row], wanted.end[row]
    first = np.hypot(*(points - begin).T) <= np.hypot(*(points - end).T)
    ends = np.where(first[:, None], begin, end)
    within = (turned <= np.abs(sweep)) & (length > 0.0)
    return np.where(within[:, None], foot, ends)
