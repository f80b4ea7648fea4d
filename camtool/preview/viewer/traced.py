"""The predicted path for the page: its points, their colours, and how far they are off.

With p a point of the slides and q the nearest point of the wanted path, the page holds p and p − q
and draws p + (N − 1)(p − q) for a deviation N times as large (see `camtool.preview.exaggerate`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Segments
from camtool.preview.colours import BINS
from camtool.preview.exaggerate import nearest_points
from camtool.preview.scene import Scene
from camtool.preview.trace import Trace, bins_of
from camtool.preview.viewer.columns import BYTE, FLOAT, INT, SHORT, Columns
from camtool.preview.viewer.run import Floats, Ints, Run
from camtool.preview.viewer.thinned import thinned
from camtool.units import UM_PER_MM

MOST_COUNTS = 32_000
"""Deviations are whole counts, this many for the largest of them."""


@dataclass(frozen=True, eq=False)
class Traced:
    """The columns of the predicted path, the length of a count of their deviations (0: nobody
    knows the wanted path), and the deviations (W, 2) mm of the worst places."""

    columns: Columns
    count_mm: float
    worst_off: Floats


def traced_of(scene: Scene, run: Run | None, top_um: float) -> Traced:
    """The path of a scene, in colours that end at `top_um`. ValueError when the rows of the run's
    trace are not those of its points."""
    worst = np.array([] if run is None else [one.at_mm for one in run.worst]).reshape(-1, 2)
    points, error, cutting = scene.trace_points, scene.trace_error_mm, scene.trace_cutting
    if points is None or error is None or cutting is None or run is None or not len(run.trace_row):
        none = np.empty(0)
        nothing = _columns(none.reshape(0, 2), none.astype(np.int64), none, none)
        return Traced(nothing, 0.0, np.zeros_like(worst))
    if len(run.trace_row) != len(points):
        raise ValueError("the trace's rows are not those of its points")
    error_um = np.where(cutting, np.abs(error) * UM_PER_MM, 0.0)
    steps = bins_of(Trace(points, error_um, cutting, top_um))
    bins = np.concatenate([[BINS], np.where(steps < 0, BINS, steps)])
    kept = thinned(points, bins, float(error_um.max(initial=0.0)) / UM_PER_MM)
    # The point before a cut is where the cut begins.
    drawn = (cutting | np.append(cutting[1:], False))[kept]
    points, bins, row = points[kept], bins[kept], run.trace_row[kept]
    off = _off(points, drawn, scene.wanted)
    largest = float(np.abs(off).max(initial=0.0))
    count_mm = largest / MOST_COUNTS if scene.wanted is not None and largest > 0.0 else 0.0
    counts = np.rint(off / count_mm) if count_mm else np.zeros_like(off)
    ever = np.ones(len(worst), dtype=np.bool_)
    return Traced(_columns(points, bins, row, counts), count_mm, _off(worst, ever, scene.wanted))


def _off(points: Floats, chosen: np.ndarray, wanted: Segments | None) -> Floats:
    """(T, 2) mm from the nearest point of the wanted path to each that is chosen, else 0."""
    off = np.zeros_like(points)
    if wanted is not None and len(wanted) and chosen.any():
        off[chosen] = points[chosen] - nearest_points(points[chosen], wanted)
    return off


def _columns(points: Floats, bins: Ints, row: Ints | Floats, counts: Floats) -> Columns:
    return {
        "trace_point": points.astype(FLOAT),
        "trace_bin": bins.astype(BYTE),
        "trace_row": row.astype(INT),
        "trace_off": counts.astype(SHORT),
    }
