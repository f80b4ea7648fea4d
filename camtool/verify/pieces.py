"""Boxes over the pieces of long moves: a diagonal across the part has a box as large as the part.

Moves of length L on an area A lie about A / L apart. What is much longer than that is cut into
pieces for the search alone, so that a box holds few other moves; distances are those of whole
moves.
"""

from __future__ import annotations

import numpy as np

from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Segments

GAPS_PER_PIECE = 4.0
"""A piece is as long as so many gaps between moves, if `MORE_PIECES` allow it."""

MORE_PIECES = 100_000
"""Cutting adds no more pieces than this: bounds memory."""


def gap_mm(segments: Segments, boxes: Floats) -> float:
    """How far apart the moves lie on average, mm; `boxes` (K, 4) are theirs."""
    if len(boxes) == 0:
        return 0.0
    area = float((boxes[:, 2:].max(axis=0) - boxes[:, :2].min(axis=0)).prod())
    length = float(segment_lengths(segments).sum())
    return max(area / max(length, POSITION_EPS_MM), POSITION_EPS_MM)


def boxes_of_pieces(segments: Segments, gap: float) -> tuple[Floats, Ints]:
    """(P, 4) boxes of the pieces of K moves that lie about `gap` mm apart, and (P,) whose each
    is. A piece of an arc of sweep s has bulge tan(s / 4n), n pieces to the arc."""
    lengths = segment_lengths(segments)
    longest = max(GAPS_PER_PIECE * gap, float(lengths.sum()) / MORE_PIECES, POSITION_EPS_MM)
    parts = np.maximum(np.ceil(lengths / longest), 1.0).astype(np.int64)
    move = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(move)) - np.repeat(np.cumsum(parts) - parts, parts)
    start = point_at(segments, move, within / parts[move])
    end = point_at(segments, move, (within + 1) / parts[move])
    bulge = np.tan(np.arctan(segments.bulge[move]) / parts[move])
    return segment_boxes(Segments.between(start, end, bulge)), move
