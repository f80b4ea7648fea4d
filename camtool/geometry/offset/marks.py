"""Some points of a source: no farther than they are is the source."""

from __future__ import annotations

import numpy as np

from camtool.geometry.measure import path_lengths, sample
from camtool.geometry.polylines import Floats, Polylines

MARKS = 1024
"""About how many points of a source stand for it where only an upper bound is asked for."""

POINTS_AT_A_TIME = 256
"""How many points are measured at a time: it bounds the memory."""


def marks_of(lines: Polylines) -> Floats:
    """(M, 2) points all along the paths, M up to twice MARKS."""
    step = float(path_lengths(lines).sum()) / MARKS
    points = np.concatenate([sample(p, step) for p in lines])
    return points[:: max(1, len(points) // MARKS)]


def at_most(points: Floats, marks: Floats) -> Floats:
    """(P,) distance of each point (P, 2) from the nearest mark: no less than from the source."""
    found = np.empty(len(points))
    for begin in range(0, len(points), POINTS_AT_A_TIME):
        apart = points[begin : begin + POINTS_AT_A_TIME, None, :] - marks
        square = np.einsum("pmi,pmi->pm", apart, apart)
        found[begin : begin + POINTS_AT_A_TIME] = np.sqrt(square.min(axis=1))
    return found
