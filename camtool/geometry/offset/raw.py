"""Stage 1: every segment shifted to the left, and an arc about every outer corner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.frames import Frames, dot, turned
from camtool.geometry.offset.options import CUSP_EPS_RAD, OffsetOptions
from camtool.geometry.polylines import Bools, Floats, Ints, Polyline, Segments


@dataclass(frozen=True, eq=False)
class RawOffset:
    """`elements`: shifted segments and joins, in the order of travel. `source` (K,): the source
    segment of each, or the one before its corner; `join` (K,): true for arcs about a corner."""

    elements: Segments
    source: Ints
    join: Bools


def raw_offset(p: Polyline, distance_mm: float, options: OffsetOptions) -> RawOffset:
    """All that lies at `distance_mm` > 0 to the left of a closed path, and much that is nearer.

    An arc that bends left with a radius up to the distance has nothing there: every point beyond
    its centre is nearer to another of its points. Inner corners need no join: the elements
    beside them cross, there or elsewhere.
    """
    segments = Segments.of(p)
    frames = Frames.of(segments)
    end_tangent = frames.tangent_at(np.ones(len(segments)))
    start = segments.start + distance_mm * frames.normal
    end = segments.end + distance_mm * turned(end_tangent)
    left_over = 1.0 - distance_mm * frames.curvature
    keep = (left_over > 0.0) & _longer(start, end, options.node_eps_mm)

    following = np.roll(np.arange(len(segments)), -1)
    tangent = frames.tangent[following]
    turn = np.arctan2(dot(turned(end_tangent), tangent), dot(end_tangent, tangent))
    turn = np.where(turn >= np.pi - CUSP_EPS_RAD, -np.pi, turn)
    join_end = segments.end + distance_mm * turned(tangent)
    outer = (turn < 0.0) & _longer(end, join_end, options.node_eps_mm)

    rows = np.arange(len(segments))
    source = np.concatenate([rows[keep], rows[outer]])
    join = np.concatenate([np.zeros(keep.sum(), np.bool_), np.ones(outer.sum(), np.bool_)])
    order = np.lexsort([join, source])
    elements = Segments.between(
        np.concatenate([start[keep], end[outer]])[order],
        np.concatenate([end[keep], join_end[outer]])[order],
        np.concatenate([segments.bulge[keep], np.tan(0.25 * turn[outer])])[order],
    )
    return RawOffset(elements, source[order], join[order])


def _longer(start: Floats, end: Floats, eps: float) -> Bools:
    return np.asarray(np.hypot(*(end - start).T) > eps)
