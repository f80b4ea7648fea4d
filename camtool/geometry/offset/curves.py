"""Segments in the form the kernels of offsets take, with a tree of boxes over them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Bools, Floats, Ints, Polylines, Segments


@dataclass(frozen=True, eq=False)
class Curves:
    """`rows` (K, 11) of camtool.kernels.offset_curves, their `boxes` (K, 4) and the `tree` of
    camtool.kernels.box_tree over these."""

    rows: Floats
    boxes: Floats
    tree: Floats

    @classmethod
    def of(cls, segments: Segments, *, margin_mm: float = 0.0) -> Curves:
        """The segments, with boxes that are wider by a margin all round."""
        from camtool.kernels.box_tree import tree_of
        from camtool.kernels.offset_curves import curve_boxes

        rows = curve_rows_of(segments)
        boxes = curve_boxes(rows, margin_mm)
        return cls(rows, boxes, tree_of(boxes))


def curve_rows_of(segments: Segments) -> Floats:
    """(K, 11) rows of camtool.kernels.offset_curves."""
    from camtool.kernels.offset_curves import curve_rows

    columns = (segments.start, segments.end, segments.bulge)
    return curve_rows(*(np.ascontiguousarray(column) for column in columns))


def meets_itself(lines: Polylines, eps_mm: float) -> bool:
    """Whether closed paths have common points within `eps_mm`, other than between neighbours."""
    from camtool.kernels.offset_meet import TA, TB, meetings_of, pairs_of

    segments = Segments.of(lines)
    curves = Curves.of(segments, margin_mm=eps_mm)
    pairs = pairs_of(curves.boxes, curves.tree, curves.boxes, curves.tree, True)
    met, at = meetings_of(curves.rows, curves.rows, pairs, eps_mm)
    one, other = met.T
    following = next_rows(lines)
    a_first = (following[one] == other) & (at[:, TA] == 1.0) & (at[:, TB] == 0.0)
    b_first = (following[other] == one) & (at[:, TA] == 0.0) & (at[:, TB] == 1.0)
    apart: Bools = ~(a_first | b_first)
    return bool(apart.any())


def next_rows(lines: Polylines) -> Ints:
    """The row of the segment that follows each one, of closed paths."""
    following = np.arange(1, len(lines.vertices) + 1)
    following[lines.offsets[1:] - 1] = lines.offsets[:-1]
    return following
