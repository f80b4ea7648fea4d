"""The points at which a blank is probed: a grid over the area that a program cuts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from camtool.arrays import Bools, Floats
from camtool.errors import OptionError, PostError
from camtool.geometry.distance import nearest
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import Segments
from camtool.toolpath.moves import Toolpath, toolpath_extents
from camtool.toolpath.surface import MIN_NODES, Surface, filled

MAX_POINTS = 10_000
"""A grid of more points is refused: at 5 s each they take 14 hours."""


def grid_over(toolpath: Toolpath, step_mm: float) -> tuple[Floats, Floats]:
    """Return the nodes (NX,), (NY,) mm of a grid over all cuts, at most `step_mm` apart. PostError
    for a program without cuts, OptionError for a step that makes no grid."""
    if not step_mm > 0.0:
        raise OptionError(f"a step of {step_mm:g} mm makes no grid", where="--step")
    path = toolpath.first(toolpath.executed_rows)
    if not path.is_feed.any():
        raise PostError("the program cuts nothing", mend="give a program with moves at a feed")
    low, high = toolpath_extents(path, rows=path.is_feed)[:2].T
    nodes = []
    for axis in (0, 1):
        width = float(high[axis] - low[axis])
        count = max(math.ceil(width / step_mm - 1e-9) + 1, MIN_NODES)
        # A program that cuts along one line has a grid of the step's width.
        half = 0.5 * (max(width, step_mm) if width < 1e-6 else width)
        middle = 0.5 * float(high[axis] + low[axis])
        nodes.append(np.linspace(middle - half, middle + half, count))
    if len(nodes[0]) * len(nodes[1]) > MAX_POINTS:
        raise OptionError(
            f"the grid has {len(nodes[0])} × {len(nodes[1])} points, and {MAX_POINTS} are allowed",
            where="--step",
            mend="give a larger step",
        )
    return nodes[0], nodes[1]


def without_holes(x: Floats, y: Floats, holes: Sequence[Segments], margin_mm: float) -> Bools:
    """Mask (NY, NX) of the nodes that are probed: those neither in a closed contour nor within
    `margin_mm` of one. OptionError if none remains."""
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    probed = np.ones(len(points), dtype=np.bool_)
    for ring in holes:
        probed &= ~inside(points, ring) & (nearest(points, ring).distance > margin_mm)
    if not probed.any():
        raise OptionError("no point of the grid lies beside the holes", mend="give a smaller step")
    return probed.reshape(len(y), len(x))


def in_rows(x: Floats, y: Floats, probed: Bools) -> list[tuple[float, float]]:
    """Return the probed nodes row by row, every other row backwards."""
    points: list[tuple[float, float]] = []
    for row, place in enumerate(y.tolist()):
        columns = np.flatnonzero(probed[row])[:: -1 if row % 2 else 1]
        points += [(value, place) for value in x[columns].tolist()]
    return points


def surface_from(x: Floats, y: Floats, probed: Bools, heights: Sequence[float]) -> Surface:
    """Return the surface of heights in the order of `in_rows`."""
    z = np.full(probed.shape, np.nan)
    values = iter(heights)
    for row in range(len(y)):
        for column in np.flatnonzero(probed[row])[:: -1 if row % 2 else 1].tolist():
            z[row, column] = next(values)
    return filled(x, y, z)
