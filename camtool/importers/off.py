"""How far the paths of a drawing lie from what was drawn: fitting and mending together, measured.

Readers say how far their curves lie from the arcs of each piece. What became of the pieces is
measured, not followed through the stages that clean and mend, so that nothing can be left out:

    pieces × paths ──same segments──▶ as the reader says
                   └─other ones─────▶ distances both ways, and what the reader says on top

Distances are to true lines and arcs, from points along each segment (`PLACES`). Between lines the
ends have the largest one, between the chords of an arc and the arc their middles.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from camtool.geometry.measure import point_at
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Bools,
    Floats,
    Ints,
    Polylines,
    Segments,
    segment_rows,
)
from camtool.importers.clean import segment_numbers
from camtool.importers.piece import Piece

PLACES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Where on a segment its distance is measured."""


def off_drawn(pieces: Sequence[Piece], lines: Polylines) -> Floats:
    """(N, 2) mm: the largest and the rms distance between what was drawn as `pieces` and the
    segment that leaves each vertex of the paths made of them."""
    found = np.zeros((len(lines.vertices), 2))
    begin, end, said = _drawn(pieces)
    if not len(begin) or not len(lines):
        return found
    made = Segments.of(lines)
    rows = segment_rows(lines)
    heads = lines.vertices[rows]
    drawn_as, made_as = segment_numbers(begin, end), segment_numbers(heads, made.end)
    order = np.argsort(drawn_as, kind="stable")
    numbers, first = np.unique(drawn_as[order], return_index=True)
    most = np.maximum.reduceat(said[order], first, axis=0)
    at = np.minimum(np.searchsorted(numbers, made_as), len(numbers) - 1)
    kept = numbers[at] == made_as
    off = np.where(kept[:, None], most[at], 0.0)
    gone = ~np.isin(drawn_as, made_as)
    if gone.any() or not kept.all():
        drawn = Segments.between(begin[:, :2], end[:, :2], begin[:, 2])
        np.maximum(off, _changed(drawn, said, made, gone, ~kept), out=off)
    found[rows] = off
    return found


def _drawn(pieces: Sequence[Piece]) -> tuple[Floats, Floats, Floats]:
    """Both vertices (K, 3), (K, 3) of all segments of the pieces, and how far off they are said to
    be (K, 2); without those that have no length."""
    lasting = [piece for piece in pieces if len(piece.vertices)]
    if not lasting:
        return np.empty((0, 3)), np.empty((0, 3)), np.empty((0, 2))
    counts = np.array([len(piece.vertices) for piece in lasting])
    vertices = np.concatenate([piece.vertices for piece in lasting]).astype(np.float64)
    off = np.concatenate(
        [
            np.zeros((len(piece.vertices), 2)) if piece.off_mm is None else piece.off_mm
            for piece in lasting
        ]
    )
    last = np.cumsum(counts) - 1
    following = np.arange(1, len(vertices) + 1)
    following[last] = last - counts + 1
    there = np.hypot(*(vertices[following] - vertices)[:, :2].T) > POSITION_EPS_MM
    there[last[[not piece.closed for piece in lasting]]] = False
    rows = np.flatnonzero(there)
    return vertices[rows], vertices[following[rows]], off[rows]


def _changed(drawn: Segments, said: Floats, made: Segments, gone: Bools, new: Bools) -> Floats:
    """(K, 2) of the segments `made`: what `gone` of the drawn ones, and which of them are `new`,
    tells of them, measured both ways."""
    off = np.zeros((len(made), 2))
    # What was drawn, to what is there now: the nearest of it, and what is about as near.
    points, of = _samples(drawn, np.flatnonzero(gone))
    apart, point, row = _near(points, made, 2.0)
    np.maximum.at(off, row, apart[point, None] + said[of[point]])
    # What is there now, to what was drawn.
    points, of = _samples(made, np.flatnonzero(new))
    apart, point, row = _near(points, drawn, 1.0)
    np.maximum.at(off, of[point], apart[point, None] + said[row])
    return off


def _samples(segments: Segments, rows: Ints) -> tuple[Floats, Ints]:
    """Points (P, 2) along the segments of these rows, and the row of each (P,)."""
    row = np.repeat(rows, len(PLACES))
    return point_at(segments, row, np.tile(PLACES, len(rows))), row


def _near(points: Floats, segments: Segments, times: float) -> tuple[Floats, Ints, Ints]:
    """(P,) how far the nearest segment is from each point; and pairs (J,), (J,) of a point and a
    segment that is no farther from it than so many times that."""
    from camtool.geometry.boxes import Curves
    from camtool.kernels.offset_near import curves_within, nearest_distances

    points = np.ascontiguousarray(points)
    curves = Curves.of(segments)
    apart = nearest_distances(points, curves.rows, curves.tree)
    pairs = curves_within(points, times * apart + POSITION_EPS_MM, curves.rows, curves.tree)
    # Two positions nearer than that are one.
    return np.where(apart > POSITION_EPS_MM, apart, 0.0), pairs[:, 0], pairs[:, 1]
