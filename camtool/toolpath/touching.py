"""Places where the top of the stock is not cut yet, to touch off a tool that was mounted.

X0 Y0, where zero was set     if nothing has been cut there so far, and else
a place between the cuts      the nearest to it, on a grid over all that is cut"""

from __future__ import annotations

import numpy as np

from camtool.arrays import Floats
from camtool.toolpath.moves import Toolpath, feeds_below_top, toolpath_extents

CLEARANCE_MM = 2.0
"""The top must be uncut this far around the place: as much as the tip of a tool or a plate
needs."""

GRID = 9
"""Number of places that are tried along each side."""


def untouched_place(toolpath: Toolpath, row: int, mm: float = 1.0) -> tuple[float, float] | None:
    """Return a place (x, y) at which no row before this one has cut, None if none is found. `mm`:
    the unit of the toolpath's lengths."""
    cuts = feeds_below_top(toolpath)
    if not cuts[row:].any():
        return None
    (low_x, right), (low, high) = toolpath_extents(toolpath, rows=cuts)[:2].tolist()
    grid = np.stack(np.meshgrid(np.linspace(low_x, right, GRID), np.linspace(low, high, GRID)), -1)
    places = grid.reshape(-1, 2)
    places = np.vstack([[0.0, 0.0], places[np.argsort(np.hypot(*places.T), kind="stable")]])
    rows = np.flatnonzero(cuts[:row])
    reach = _radii_mm(toolpath)[rows] / mm + CLEARANCE_MM / mm
    begin, end, centre = toolpath.starts[rows, :2], toolpath.end[rows, :2], toolpath.centre[rows]
    is_arc = toolpath.is_arc[rows]
    radius = np.hypot(*(begin - centre).T)
    for place in places:
        along = end - begin
        length = np.maximum((along * along).sum(axis=1), np.finfo(float).tiny)
        part = np.clip(((place - begin) * along).sum(axis=1) / length, 0.0, 1.0)
        distances = np.hypot(*(begin + part[:, None] * along - place).T)
        # An arc blocks the places of its whole circle.
        round_away = np.abs(np.hypot(*(place - centre).T) - radius)
        if (np.where(is_arc, round_away, distances) >= reach).all():
            return float(place[0]), float(place[1])
    return None


def _radii_mm(toolpath: Toolpath) -> Floats:
    """Return the radius (N,) mm of the tool of each row."""
    radii = np.zeros(len(toolpath))
    if toolpath.operations is not None:
        for note, begin in zip(
            toolpath.operations.notes, toolpath.operations.begin.tolist(), strict=True
        ):
            radii[begin:] = 0.5 * note.tool.diameter_mm
    return radii
