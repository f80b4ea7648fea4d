"""Arcs over nodes on a curve in one call: spans, chain, measure."""

from __future__ import annotations

from camtool.kernels.arc_chain import chain, deviations, joined, summary
from camtool.kernels.biarc import Bools, Floats
from camtool.kernels.compiled import kernel
from camtool.kernels.fit_limits import (
    POSITION_EPS_MM,
)
from camtool.kernels.spans import longest_spans

Judged = tuple[float, float, float]
Columns = tuple[Floats, Floats, Floats, Bools]


@kernel
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
