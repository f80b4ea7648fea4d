"""Stages 3 and 4: the raw offset cut wherever it meets itself, and which slices are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.offset.curves import Curves, curve_rows_of
from camtool.geometry.offset.near import Near
from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.offset.way import Way
from camtool.geometry.polylines import Bools, Floats, Ints, Segments

SKEW = (0.850650808352040, 0.525731112119133)
"""Unit direction along which points are sorted: drawings have many of equal x or equal y."""


@dataclass(frozen=True, eq=False)
class Slices:
    """Pieces of elements between two nodes, in columns: `element`, `from_node`, `to_node` (S,)
    and the fractions `t0` < `t1` (S,) of the element's length; `nodes` (N, 2) mm."""

    element: Ints
    t0: Floats
    t1: Floats
    from_node: Ints
    to_node: Ints
    nodes: Floats

    def __len__(self) -> int:
        return len(self.element)

    def __getitem__(self, rows: Bools | Ints) -> Slices:
        """The chosen slices; the nodes stay."""
        return Slices(
            self.element[rows],
            self.t0[rows],
            self.t1[rows],
            self.from_node[rows],
            self.to_node[rows],
            self.nodes,
        )

    @property
    def span(self) -> Floats:
        """(S, 2) t0 and t1."""
        return np.column_stack([self.t0, self.t1])

    @property
    def ends(self) -> tuple[Ints, Ints, int]:
        """from_node and to_node (S,), and how many nodes there are."""
        return self.from_node, self.to_node, len(self.nodes)


def slice_elements(elements: Segments, others: Segments | None, options: OffsetOptions) -> Slices:
    """The elements cut at all meetings with each other and with `others`."""
    from camtool.kernels.offset_meet import TA, TB, X, Y, meetings_of, pairs_of

    eps = options.node_eps_mm
    own = Curves.of(elements, margin_mm=eps)
    pairs = pairs_of(own.boxes, own.tree, own.boxes, own.tree, True)
    met, at = meetings_of(own.rows, own.rows, pairs, eps)
    rows = [met[:, 0], met[:, 1]]
    found = [at[:, [TA, X, Y]], at[:, [TB, X, Y]]]
    if others is not None:
        cutting = Curves.of(others, margin_mm=eps)
        pairs = pairs_of(own.boxes, own.tree, cutting.boxes, cutting.tree, False)
        met, at = meetings_of(own.rows, cutting.rows, pairs, eps)
        rows.append(met[:, 0])
        found.append(at[:, [TA, X, Y]])
    return _cut(elements, np.concatenate(rows), np.concatenate(found), options)


def _cut(elements: Segments, rows: Ints, found: Floats, options: OffsetOptions) -> Slices:
    """The elements cut at `found` (J, 3), the fraction and the place on the element rows[j]."""
    from camtool.kernels.offset_nodes import in_order

    count = len(elements)
    every = np.arange(count)
    # Ends come first, so that a node is at an end of an element rather than at a meeting.
    element = np.concatenate([every, every, rows])
    t = np.concatenate([np.zeros(count), np.ones(count), found[:, 0]])
    points = np.concatenate([elements.start, elements.end, found[:, 1:]])
    node, nodes = merge_points(points, 2.0 * options.node_eps_mm)
    order = in_order(element, t, count)
    element, t, node = element[order], t[order], node[order]
    cut = (element[1:] == element[:-1]) & (node[1:] != node[:-1])
    before, after = np.flatnonzero(cut), np.flatnonzero(cut) + 1
    return Slices(element[before], t[before], t[after], node[before], node[after], nodes)


def merge_points(points: Floats, eps_mm: float) -> tuple[Ints, Floats]:
    """Node (P,) of each point (P, 2), and the nodes (N, 2): the first point of each group.

    Points within `eps_mm` share a node, and so do chains of such points.
    """
    from camtool.kernels.offset_nodes import merged

    skew = points @ np.array(SKEW)
    node, first = merged(points, skew, np.argsort(skew), eps_mm)
    return node, points[first]


def valid_slices(slices: Slices, elements: Segments, near: Near, way: Way) -> Bools:
    """(S,) true where no measured point is too near to the source, or within a mitre.

    Too near is what falls short of the distance, or is deeper in a kite, by `validity_eps_mm`.
    The raw offset changes between valid and invalid only where it meets itself, so that one point
    would do; several guard against slices that are hardly too near anywhere.
    """
    from camtool.kernels.offset_near import far_enough

    limits = (way.distance_mm, way.options.validity_eps_mm)
    curves = curve_rows_of(elements)
    return far_enough(curves, slices.element, slices.span, near.arrays, limits)
