"""The fit of arcs to rational Bézier pieces in one call: nodes, spans, chain, measure, again."""

from __future__ import annotations

import numba
import numpy as np

from camtool.kernels.arc_chain import chain, deviations, joined, summary
from camtool.kernels.bezier import curve_rows, points_at
from camtool.kernels.biarc import Bools, Floats
from camtool.kernels.fit_limits import (
    ACCEPTED_SHARE,
    ATTEMPTS,
    MAX_NODES,
    MEASURE_STEPS,
    MIN_STEPS,
    POSITION_EPS_MM,
    REFINING,
    SEARCH_SHARE,
)
from camtool.kernels.spans import longest_spans

Judged = tuple[float, float, float]
Columns = tuple[Floats, Floats, Floats, Bools]


@numba.njit(cache=True, error_model="numpy")
def sample_parameters(rows: Floats) -> Floats:
    """Parameters that cut every step between nodes (n, 7), t first, into `MEASURE_STEPS`."""
    steps = len(rows) - 1
    out = np.empty(MEASURE_STEPS * steps + 1)
    for i in range(steps):
        low, high = rows[i, 0], rows[i + 1, 0]
        for j in range(MEASURE_STEPS):
            out[i * MEASURE_STEPS + j] = low + (high - low) * j / MEASURE_STEPS
    out[MEASURE_STEPS * steps] = rows[steps, 0]
    return out


@numba.njit(cache=True, error_model="numpy")
def two_columns(rows: Floats, at: int) -> Floats:
    """(n, 2) columns `at` and the next."""
    out = np.empty((len(rows), 2))
    for i in range(len(rows)):
        out[i, 0], out[i, 1] = rows[i, at], rows[i, at + 1]
    return out


@numba.njit(cache=True, error_model="numpy")
def fit_nodes(
    nodes: Columns, samples: Floats, target: float, tolerance: float
) -> tuple[Floats, Judged]:
    """The chain (n, 3) over `nodes` (points, arriving and leaving tangents (n, 2), corners (n,))
    and its largest and rms deviation from the samples, and their length, mm."""
    point, arrive, leave, corner = nodes
    ends, pairs = longest_spans(point, leave, arrive, corner, target)
    rows, first = chain(point, ends, pairs, tolerance)
    vertices, places = joined(rows, POSITION_EPS_MM)
    if len(vertices) == 1:
        return vertices, (0.0, 0.0, 0.0)
    off = deviations(samples, (ends, first), vertices, places)
    return vertices, summary(samples, off)


@numba.njit(cache=True, error_model="numpy")
def fit_pieces(pieces: Floats, tolerance: float) -> tuple[Floats, Judged]:
    """The chain (n, 3) within `tolerance` of rational pieces (m, p + 1, 3), and its deviations.

    A fit whose error turns out too large is done again over finer nodes, since errors peak
    between them; if that is not enough, with less of the tolerance as well.
    """
    target, steps, fineness = SEARCH_SHARE * tolerance, MIN_STEPS, tolerance
    vertices, judged = np.zeros((1, 3)), (0.0, 0.0, 0.0)
    for attempt in range(ATTEMPTS):
        rows, corner = curve_rows(pieces, steps, fineness)
        if len(rows) == 1:
            vertices[0, 0], vertices[0, 1] = rows[0, 1], rows[0, 2]
            return vertices, (0.0, 0.0, 0.0)
        nodes = two_columns(rows, 1), two_columns(rows, 3), two_columns(rows, 5), corner
        samples = points_at(pieces, sample_parameters(rows))
        vertices, judged = fit_nodes(nodes, samples, target, tolerance)
        if not judged[0] > ACCEPTED_SHARE * tolerance or len(rows) >= MAX_NODES:
            break
        steps, fineness = 2 * steps, REFINING * fineness
        if attempt > 0:
            target *= SEARCH_SHARE * tolerance / judged[0]
    return vertices, judged
