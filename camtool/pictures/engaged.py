"""The moves of the slides, coloured by the engagement of their tool.

The map of colours runs from 0° to 180°, in every picture. Entries, which limits do not count, and
moves that cut nothing have colours of their own."""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.pictures.colours import AIR, BINS, CUT_ENTRY, ENGAGED_STYLES, UNKNOWN
from camtool.pictures.scene import Scene
from camtool.pictures.svg import Look, PathData, element
from camtool.pictures.trace import MERGED_SHARE, decimals_in, round_pen
from camtool.pictures.view import View
from camtool.stock.engagement import COARSE_RAD

TOP_DEG = 180.0
"""The end of the map: half of the tool's circle."""


class EngagementTrace(Struct, frozen=True, eq=False):
    """Moves of the slides at a feed: `begin` and `end` (M, 2) mm, and the step (M,) of the colour
    map of each."""

    begin: Floats
    end: Floats
    step: Ints

    @property
    def is_empty(self) -> bool:
        """True if none of the moves is judged."""
        return bool((self.step < CUT_ENTRY).all())


def steps_of(bound_rad: Floats) -> Ints:
    """Return the step of the colour map (M,) for each engagement (M,) rad.

    It is AIR for NaN and for engagements below the uncertainty of the bounds: a chip that counts
    is engaged by more."""
    angle = np.nan_to_num(bound_rad)
    steps = np.clip(np.degrees(angle) / TOP_DEG * BINS, 0.0, BINS - 1).astype(np.int64)
    return np.where(angle > COARSE_RAD, steps, AIR)


def engagement_trace(scene: Scene) -> EngagementTrace | None:
    """Return the moves of a scene at a feed, with their steps of the colour map; None where it has
    none, or the tool is not known."""
    judged = scene.engagement
    if judged is None:
        return None
    moves, step = judged.moves, steps_of(judged.bound_rad)
    step = np.where(judged.is_entry & (step >= 0), CUT_ENTRY, step)
    step = np.where(judged.is_known, step, UNKNOWN)
    is_drawn = ~moves.rapid & (moves.start[:, :2] != moves.end[:, :2]).any(axis=1)
    return EngagementTrace(
        moves.start[is_drawn, :2], moves.end[is_drawn, :2], step[is_drawn].astype(np.int64)
    )


def engagement_layer(trace: EngagementTrace, view: View, pen: float) -> str:
    """Return the SVG of the coloured moves, in mm."""
    low, high = view.x_range
    decimals, apart_mm = decimals_in(high - low), MERGED_SHARE * (high - low)
    paths = []
    for step, (colour, share) in ENGAGED_STYLES.items():
        data = PathData(decimals)
        rows = np.flatnonzero(trace.step == step)
        for line in _lines(trace.begin[rows], trace.end[rows], apart_mm):
            data.move(*line[0])
            for point in line[1:]:
                data.line(*point)
        if data:
            width: Look = {} if share == 1.0 else {"stroke-width": view.mm(share * pen)}
            paths.append(element("path", {"d": str(data), "stroke": colour, **width}))
    return element("g", {"id": "engagement", **round_pen(view, pen)}, *paths)


def _lines(begin: Floats, end: Floats, apart_mm: float) -> list[list[list[float]]]:
    """Return successive moves as lines of points; points nearer than `apart_mm` to the one before
    are left out, except ends of lines."""
    lines: list[list[list[float]]] = []
    last: list[float] | None = None
    for one, other in zip(begin.tolist(), end.tolist(), strict=True):
        if one != last:
            if last is not None and lines[-1][-1] != last:
                lines[-1].append(last)
            lines.append([one])
        x, y = lines[-1][-1]
        if abs(other[0] - x) + abs(other[1] - y) >= apart_mm:
            lines[-1].append(other)
        last = other
    if last is not None and lines[-1][-1] != last:
        lines[-1].append(last)
    return lines
