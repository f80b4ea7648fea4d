"""Stage 1: every segment shifted to the left, and an arc about every outer corner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.frames import Frames, dot, turned
from camtool.geometry.offset.curves import next_rows
from camtool.geometry.offset.options import CUSP_EPS_RAD, OffsetOptions
from camtool.geometry.polylines import Bools, Floats, Ints, Polylines, Segments


@dataclass(frozen=True, eq=False)
class RawOffset:
    """`elements`: shifted segments and joins, in the order of travel. `source` (K,): the source
    segment of each, or the one before its corner; `join` (K,): true for arcs about a corner."""

    elements: Segments
    source: Ints
    join: Bools


def raw_offset(lines: Polylines, distance_mm: float, options: OffsetOptions) -> RawOffset:
    """All that lies at `distance_mm` > 0 to the left of closed paths, and much that is nearer.

    An arc that bends left with a radius up to the distance has nothing there: every point beyond
    its centre is nearer to another of its points. Inner corners need no join: the elements
    beside them cross, there or elsewhere.
    """
    segments = Segments.of(lines)
    frames = Frames.of(segments)
    end_tangent = frames.tangent_at(np.ones(len(segments)))
    start = segments.start + distance_mm * frames.normal
    end = segments.end + distance_mm * turned(end_tangent)
    left_over = 1.0 - distance_mm * frames.curvature
    keep = (left_over > 0.0) & _longer(start, end, options.node_eps_mm)

    rows = np.arange(len(segments))
    shifted = Segments.between(start[keep], end[keep], segments.bulge[keep])
    corner, joins = _joins(frames, frames.tangent[next_rows(lines)], distance_mm, options)
    source = np.concatenate([rows[keep], corner])
    join = np.repeat([False, True], [len(shifted), len(joins)])
    order = np.lexsort([join, source])
    elements = Segments.between(
        np.concatenate([shifted.start, joins.start])[order],
        np.concatenate([shifted.end, joins.end])[order],
        np.concatenate([shifted.bulge, joins.bulge])[order],
    )
    return RawOffset(elements, source[order], join[order])


def _joins(
    frames: Frames, tangent: Floats, distance_mm: float, options: OffsetOptions
) -> tuple[Ints, Segments]:
    """Arcs about the outer corners, and the segment before each; two where one is above π.

    Where a path turns straight back, rounding alone says whether it turns left or right. It is
    then taken to turn right: an arc too much is invalid, or leads nowhere, and goes later.
    """
    end_tangent = frames.tangent_at(np.ones(len(tangent)))
    turn = np.arctan2(dot(turned(end_tangent), tangent), dot(end_tangent, tangent))
    turn = np.where(turn >= np.pi - CUSP_EPS_RAD, turn - 2.0 * np.pi, turn)
    parts = np.where(turn < -np.pi, 2, np.where(turn < 0.0, 1, 0))
    corner = np.repeat(np.arange(len(turn)), parts)
    second = np.concatenate([[False], corner[1:] == corner[:-1]])
    sweep = turn[corner] / parts[corner]
    begin = np.where(second, sweep, 0.0)
    normal = turned(end_tangent[corner])
    start = frames.end[corner] + distance_mm * _rotated(normal, begin)
    last = parts[corner] == second + 1
    middle = frames.end[corner] + distance_mm * _rotated(normal, sweep)
    after = frames.end[corner] + distance_mm * turned(tangent[corner])
    end = np.where(last[:, None], after, middle)
    long = _longer(start, end, options.node_eps_mm)
    arcs = Segments.between(start[long], end[long], np.tan(0.25 * sweep[long]))
    return corner[long], arcs


def _rotated(vectors: Floats, angle: Floats) -> Floats:
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(cosine * vectors + sine * turned(vectors))


def _longer(start: Floats, end: Floats, eps: float) -> Bools:
    return np.asarray(np.hypot(*(end - start).T) > eps)
