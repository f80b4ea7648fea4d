"""The predicted path of the slides, coloured by its error.

Consecutive points in the same step of the colour map become one line, and all lines of one step
become one path of the SVG, so that 20,000 points stay well below a megabyte. Larger errors are
drawn later: the largest lie on top."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.measure import segment_boxes
from camtool.geometry.polylines import Segments
from camtool.pictures.colours import BINS, bin_colours
from camtool.pictures.scene import Scene
from camtool.pictures.svg import Look, PathData, element
from camtool.pictures.view import View
from camtool.units import UM_PER_MM

MIN_TOP_UM = 1e-3
"""The colour map ends here if all errors are smaller."""

FINEST_SHARE = 1e-5
"""Coordinates of the path are rounded to this share of the window: 1/25 of a pixel of 4000."""

MERGED_SHARE = 1.25e-4
"""Points nearer than this share of the window, half a pixel of 4000, may be left out."""


class ErrorTrace(Struct, frozen=True, eq=False):
    """The predicted path as it is drawn.

    points (T, 2) mm, error_um (T,) absolute error, cutting (T,) True if the tool cuts between the
    previous point and this one, top_um the upper end of the colour map, times the factor by which
    the distances of the points from the wanted path are enlarged."""

    points: Floats
    error_um: Floats
    cutting: Bools
    top_um: float
    times: float = 1.0


def trace_of(scene: Scene, times: float = 1.0) -> ErrorTrace | None:
    """Return the predicted path of a scene; None when there is none or it never cuts.

    Where the wanted path is known, its errors are drawn `times` as large."""
    points, error, cutting = scene.trace_points, scene.trace_error_mm, scene.trace_cutting
    if points is None or error is None or cutting is None or not cutting.any():
        return None
    error_um = np.where(cutting, np.abs(error) * UM_PER_MM, 0.0)
    top_um = max(float(error_um.max()), MIN_TOP_UM)
    if times == 1.0 or scene.wanted is None:
        return ErrorTrace(points, error_um, cutting, top_um)
    # The point before a cut is where the cut begins.
    drawn = cutting | np.append(cutting[1:], False)
    shifted = points.copy()
    shifted[drawn] = exaggerated(points[drawn], scene.wanted, times)
    return ErrorTrace(shifted, error_um, cutting, top_um, times)


def bins_of(trace: ErrorTrace) -> Ints:
    """Return the step of the colour map for each piece of the path (T−1,), by the larger error of
    its ends; −1 where the tool does not cut."""
    worse = np.maximum(trace.error_um[:-1], trace.error_um[1:])
    step = np.minimum((worse / trace.top_um * BINS).astype(np.int64), BINS - 1)
    return np.where(trace.cutting[1:], step, -1)


def lines_by_step(trace: ErrorTrace, window_mm: float) -> list[list[Floats]]:
    """Return for each step of the colour map the lines in its colour: arrays (n, 2) of points, n ≥
    2."""
    keep = _kept_rows(trace, MERGED_SHARE * window_mm)
    drawn_part = ErrorTrace(
        trace.points[keep],
        np.maximum.reduceat(trace.error_um, keep),
        trace.cutting[keep],
        trace.top_um,
    )
    bins = bins_of(drawn_part)
    lines: list[list[Floats]] = [[] for _ in range(BINS)]
    edges = np.flatnonzero(np.diff(bins)) + 1
    for begin, end in zip(
        np.concatenate([[0], edges]), np.concatenate([edges, [len(bins)]]), strict=True
    ):
        if end > begin and bins[begin] >= 0:
            lines[int(bins[begin])].append(drawn_part.points[begin : end + 1])
    return lines


def _kept_rows(trace: ErrorTrace, apart_mm: float) -> Ints:
    """Return the rows of the points to draw: those at least `apart_mm` from the one drawn before,
    and all ends of cuts."""
    cutting = trace.cutting
    ends = np.ones(len(cutting), dtype=np.bool_)
    ends[1:-1] = (cutting[1:-1] != cutting[:-2]) | (cutting[1:-1] != cutting[2:])
    kept_rows, (last_x, last_y) = [], (math.inf, math.inf)
    for index, ((x, y), is_end) in enumerate(
        zip(trace.points.tolist(), ends.tolist(), strict=True)
    ):
        if is_end or math.hypot(x - last_x, y - last_y) >= apart_mm:
            kept_rows.append(index)
            last_x, last_y = x, y
    return np.array(kept_rows, dtype=np.int64)


def decimals_in(window_mm: float) -> int:
    """Return the number of decimals that coordinates need in a window of this width."""
    return max(0, math.ceil(-math.log10(FINEST_SHARE * window_mm)))


def round_pen(view: View, pen: float) -> Look:
    """Return the look of a pen of this width with round ends and joints."""
    return {
        "fill": "none",
        "stroke-width": view.mm(pen),
        "stroke-linecap": "round",
        "stroke-linejoin": "round",
    }


def trace_layer(trace: ErrorTrace, view: View, pen: float) -> str:
    """Return the SVG of the coloured path, in mm."""
    (low, high), colours = view.x_range, bin_colours()
    decimals = decimals_in(high - low)
    paths = []
    for colour, runs in zip(colours, lines_by_step(trace, high - low), strict=True):
        data = PathData(decimals)
        for run in runs:
            points = run.tolist()
            data.move(*points[0])
            for point in points[1:]:
                data.line(*point)
        if data:
            paths.append(element("path", {"d": str(data), "stroke": colour}))
    return element("g", {"id": "slide-path", **round_pen(view, pen)}, *paths)


# The predicted path with its deviation from the wanted one exaggerated N times.
#
# For a point p of the slides, and the point q of the wanted path that is nearest to it, q + N (p −
# q) is drawn.
#
# A factor of 1 changes nothing; where the nearest point jumps, the drawn path jumps too.


def exaggerated(points: Floats, wanted_path: Segments, times: float) -> Floats:
    """Return points (T, 2) mm moved away from the nearest point of `wanted_path` to `times` their
    distance."""
    if not len(points) or not len(wanted_path):
        return points
    foot = nearest_points(points, wanted_path)
    return np.asarray(foot + times * (points - foot))


def nearest_points(points: Floats, wanted_path: Segments) -> Floats:
    """Return for each of the points the nearest point (T, 2) mm on the lines and arcs of
    `wanted_path`."""
    from camtool.kernels.fits import nearest_rows

    boxes = segment_boxes(wanted_path)
    bulge = np.array(wanted_path.bulge)  # may be one number broadcast to all rows
    row = nearest_rows(points, wanted_path.start, wanted_path.end, bulge, boxes)
    begin, end, sweep = wanted_path.start[row], wanted_path.end[row], wanted_path.sweep[row]
    chord = end - begin
    square = (chord**2).sum(axis=1)
    share = ((points - begin) * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0)
    foot = begin + np.clip(share, 0.0, 1.0)[:, None] * chord
    is_arc = sweep != 0.0
    foot[is_arc] = _project_on_arcs(points[is_arc], wanted_path, row[is_arc])
    return np.asarray(foot)


def _project_on_arcs(points: Floats, wanted_path: Segments, row: Ints) -> Floats:
    """Return the nearest point on an arc, row by row: along the ray from its centre, or else the
    nearer end of the arc."""
    spoke = points - wanted_path.centre[row]
    length = np.hypot(spoke[:, 0], spoke[:, 1])
    along = spoke / np.where(length > 0.0, length, 1.0)[:, None]
    foot = wanted_path.centre[row] + wanted_path.radius[row, None] * along
    sweep = wanted_path.sweep[row]
    angle = np.arctan2(spoke[:, 1], spoke[:, 0]) - wanted_path.start_angle[row]
    turn = np.mod(np.sign(sweep) * angle, 2.0 * np.pi)
    begin, end = wanted_path.start[row], wanted_path.end[row]
    first = np.hypot(*(points - begin).T) <= np.hypot(*(points - end).T)
    ends = np.where(first[:, None], begin, end)
    is_within = (turn <= np.abs(sweep)) & (length > 0.0)
    return np.where(is_within[:, None], foot, ends)
