"""Stages 3 and 4: the raw offset cut wherever it meets itself, and which slices are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.distance import nearest
from camtool.geometry.intersect import Crossings, crossings, self_crossings
from camtool.geometry.measure import point_at
from camtool.geometry.offset.marks import at_most, marks_of
from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.polylines import Bools, Floats, Ints, Polylines, Segments

MIDDLE = (0.5,)
ALONG = (0.03, 0.2, 0.35, 0.65, 0.8, 0.97)
"""Where on a slice its distance is measured; the middle first, as it settles most of them."""

POINTS_AT_A_TIME = 128
"""How many neighbouring points are measured at a time: fewer are nearer to each other."""

SKEW = (1.0, 0.6180339887498949)
"""Direction along which points are sorted: drawings have many points of equal x or equal y."""


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


def slice_elements(elements: Segments, others: Segments | None, options: OffsetOptions) -> Slices:
    """The elements cut at all meetings with each other and with `others`."""
    eps = options.node_eps_mm
    own = self_crossings(elements, position_eps_mm=eps, neighbours=True)
    cuts = [own]
    if others is not None:
        cuts.append(crossings(elements, others, position_eps_mm=eps))
    element, t, point = _events(elements, own, cuts)
    node, nodes = merge_points(point, 2.0 * eps)
    order = np.lexsort([t, element])
    element, t, node = element[order], t[order], node[order]
    cut = (element[1:] == element[:-1]) & (node[1:] != node[:-1])
    before, after = np.flatnonzero(cut), np.flatnonzero(cut) + 1
    return Slices(element[before], t[before], t[after], node[before], node[after], nodes)


def _events(
    elements: Segments, own: Crossings, cuts: list[Crossings]
) -> tuple[Ints, Floats, Floats]:
    """Element, fraction and point of every end and meeting; ends come first."""
    rows = np.arange(len(elements))
    zeros, ones = np.zeros(len(elements)), np.ones(len(elements))
    return (
        np.concatenate([rows, rows, *(each.row_a for each in cuts), own.row_b]),
        np.concatenate([zeros, ones, *(each.ta for each in cuts), own.tb]),
        np.concatenate([elements.start, elements.end, *(each.point for each in cuts), own.point]),
    )


def merge_points(points: Floats, eps_mm: float) -> tuple[Ints, Floats]:
    """Node (P,) of each point (P, 2), and the nodes (N, 2): the first point of each group.

    Points within `eps_mm` share a node, and so do chains of such points.
    """
    skew = points @ np.array(SKEW)
    order = np.argsort(skew, kind="stable")
    reach = eps_mm * np.hypot(*SKEW)
    last = np.searchsorted(skew[order], skew[order] + reach, side="right")
    counts = last - np.arange(len(points)) - 1
    low = np.repeat(np.arange(len(points)), counts)
    high = low + 1 + np.arange(len(low)) - np.repeat(np.cumsum(counts) - counts, counts)
    one, two = order[low], order[high]
    near = np.hypot(*(points[one] - points[two]).T) <= eps_mm
    group = _groups(len(points), one[near], two[near])
    first, node = np.unique(group, return_inverse=True)
    return node, points[first]


def _groups(count: int, one: Ints, two: Ints) -> Ints:
    """The smallest member of the group of each item, when the items one[j], two[j] are joined."""
    group = np.arange(count)
    while True:
        lower = np.minimum(group[one], group[two])
        merged = group.copy()
        np.minimum.at(merged, group[one], lower)
        np.minimum.at(merged, group[two], lower)
        merged = merged[merged]
        if np.array_equal(merged, group):
            return group
        group = merged


def valid_slices(
    slices: Slices,
    elements: Segments,
    lines: Polylines,
    distance_mm: float,
    options: OffsetOptions,
) -> Bools:
    """(S,) true where no measured point is nearer to the source than the distance − eps.

    The raw offset changes between valid and invalid only where it meets itself, so that one point
    would do; several guard against slices that are hardly too near anywhere.
    """
    least = distance_mm - options.validity_eps_mm
    valid = at_most(_points(slices, elements, MIDDLE), marks_of(lines)) >= least
    source = Segments.of(lines)
    for fractions in (MIDDLE, ALONG):
        rows = np.flatnonzero(valid)
        if len(rows) == 0:
            break
        points = _points(slices[rows], elements, fractions)
        distance = nearest(points, source, chunk=POINTS_AT_A_TIME).distance
        valid[rows] = (distance >= least).reshape(-1, len(fractions)).all(axis=1)
    return valid


def _points(slices: Slices, elements: Segments, fractions: tuple[float, ...]) -> Floats:
    """(S · F, 2) points of the slices at these fractions of each, slice by slice."""
    part = np.array(fractions)
    t0, t1 = slices.t0[:, None], slices.t1[:, None]
    t = (t0 + (t1 - t0) * part).ravel()
    return point_at(elements, np.repeat(slices.element, len(part)), t)
