"""Which moves are near a place: boxes over the pieces of long moves, in layers of like heights.

A diagonal across the part has a box as large as the part. Moves of length L on an area A lie about
A / L apart. What is much longer than that is cut into pieces for the search alone, so that a box
holds few other moves; distances are those of whole moves. Passes one below the other lie over the
same places: a search asks the layers at its own height alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Segments

GAPS_PER_PIECE = 4.0
"""A piece is as long as so many gaps between moves, if `MORE_PIECES` allow it."""

MORE_PIECES = 400_000
"""Cutting adds no more pieces than this: bounds memory, some 100 MB."""

PIECES_OF_LAYER = 512
"""A layer takes moves of further heights until it has so many pieces."""


def levels_of(z: Floats) -> Ints:
    """(K,) the number of the heights that each move of heights (K, 2) low, high runs between, from
    the lowest on."""
    return np.unique(z, axis=0, return_inverse=True)[1].reshape(-1)


def gap_mm(segments: Segments, boxes: Floats, level: Ints | None = None) -> float:
    """How far apart the moves of one `level` (K,) lie on average, mm; `boxes` (K, 4) are theirs.

    A place of a move lies among the length l of its own level, Σ l² / Σ l on average.
    """
    if len(boxes) == 0:
        return 0.0
    area = float((boxes[:, 2:].max(axis=0) - boxes[:, :2].min(axis=0)).prod())
    length = np.bincount(
        np.zeros(len(boxes), np.int64) if level is None else level,
        weights=segment_lengths(segments),
    )
    around = float((length**2).sum()) / max(float(length.sum()), POSITION_EPS_MM)
    return max(area / max(around, POSITION_EPS_MM), POSITION_EPS_MM)


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


@dataclass(frozen=True, eq=False)
class _Layer:
    """Pieces of moves between two heights, mm, no steeper than `slope`: a tree of their boxes, and
    whose they are (P,)."""

    low: float
    high: float
    slope: float
    tree: Any
    whose: Ints


class Layers:
    """The pieces of K moves that lie about `gap` mm apart, of heights z (K, 2) low, high and of
    slopes (K,), layer by layer."""

    def __init__(self, segments: Segments, z: Floats, slope: Floats, gap: float) -> None:
        import shapely

        self._count = len(z)
        pieces, whose = boxes_of_pieces(segments, gap)
        level = levels_of(z)[whose]
        # Layers change between levels only: what lies in one plane is one tree.
        done = np.cumsum(np.bincount(level)) - np.bincount(level)
        layer = done[level] // PIECES_OF_LAYER
        order = np.argsort(layer, kind="stable")
        parts = np.split(order, np.flatnonzero(np.diff(layer[order])) + 1) if len(order) else []
        self._layers = [
            _Layer(
                float(z[whose[part], 0].min()),
                float(z[whose[part], 1].max()),
                float(slope[whose[part]].max()),
                shapely.STRtree(shapely.box(*pieces[part].T)),
                whose[part],
            )
            for part in parts
        ]

    def pairs(self, boxes: Floats, z: Floats, window_mm: float = 0.0) -> tuple[Ints, Ints]:
        """Pairs (box, move), in order, of boxes (B, 4) that touch that of a piece of the move, in
        layers within the window (and more, on slopes) of the heights z (B, 2) low, high of the
        box. Moves of other heights may be among them."""
        import shapely

        shapes = shapely.box(*boxes.T)
        found = [np.empty(0, dtype=np.int64)]
        for layer in self._layers:
            window = window_mm * (1.0 + layer.slope)
            rows = np.flatnonzero(
                (z[:, 0] - window <= layer.high) & (layer.low <= z[:, 1] + window)
            )
            if len(rows):
                row, piece = layer.tree.query(shapes[rows])
                found.append(rows[row] * self._count + layer.whose[piece])
        pairs = np.sort(np.concatenate(found))
        return np.divmod(pairs[np.diff(pairs, prepend=-1) > 0], self._count)
