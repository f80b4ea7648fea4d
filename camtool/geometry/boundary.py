"""The boundary of a region as elements that discs in it can touch: lines, arcs, reflex corners."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import segment_boxes, segment_lengths
from camtool.geometry.polylines import Floats, Ints, Polylines, Segments

ROUND_RAD = 1e-9
"""A reflex corner that turns by less is none: rounding of the tangents."""


@dataclass(frozen=True, eq=False)
class Boundary:
    """E elements in the order of the paths, region on their left, as `kernels.discs` wants them:
    `table` (E, 10), `links` (E, 3), `boxes` (B, 4)."""

    table: Floats
    links: Ints
    boxes: Floats

    @classmethod
    def of(cls, region: Polylines) -> Boundary:
        """The elements of closed paths, outer ones CCW and holes CW."""
        from camtool.kernels.discs import CONVEX, REFLEX, SMOOTH, SMOOTH_RAD

        segments = Segments.of(region)
        leave, arrive = _tangents(segments)
        before, behind = _neighbours(segments.path)
        turn = _turns(arrive[before], leave)
        corner = turn < -ROUND_RAD
        joint = np.where(corner, REFLEX, np.where(turn > SMOOTH_RAD, CONVEX, SMOOTH))
        place = np.arange(len(segments)) + np.cumsum(corner)
        fans = place[corner] - 1
        count = len(segments) + len(fans)
        table, links = np.zeros((count, 10)), np.zeros((count, 3), dtype=np.int64)
        table[place] = np.column_stack(
            [
                segments.start,
                leave,
                segment_lengths(segments),
                segments.sweep,
                segments.end,
                arrive,
            ]
        )
        tangent, end = arrive[before][corner], segments.start[corner]
        nothing = np.zeros(len(fans))
        table[fans] = np.column_stack([end, tangent, nothing, turn[corner], end, leave[corner]])
        links[place] = np.column_stack([place[before], place[behind] - corner[behind], joint])
        links[fans] = np.column_stack(
            [place[before][corner], place[corner], np.full(len(fans), REFLEX)]
        )
        links[place[corner], 0] = fans
        return cls(table, links, _blocks(table, segment_boxes(segments), place))

    def __len__(self) -> int:
        return len(self.table)


def _tangents(segments: Segments) -> tuple[Floats, Floats]:
    """(K, 2) unit tangents at the start and at the end: the chord turned by ∓ sweep/2."""
    chord = segments.end - segments.start
    unit = chord / np.hypot(chord[:, 0], chord[:, 1])[:, None]
    cosine, sine = np.cos(0.5 * segments.sweep)[:, None], np.sin(0.5 * segments.sweep)[:, None]
    turned = np.column_stack([-unit[:, 1], unit[:, 0]])
    return cosine * unit - sine * turned, cosine * unit + sine * turned


def _turns(arrive: Floats, leave: Floats) -> Floats:
    """(K,) turn at each start, left positive, −π … π."""
    across = arrive[:, 0] * leave[:, 1] - arrive[:, 1] * leave[:, 0]
    return np.asarray(np.arctan2(across, (arrive * leave).sum(axis=1)))


def _neighbours(path: Ints) -> tuple[Ints, Ints]:
    """The rows before and behind each row on its closed path."""
    rows = np.arange(len(path))
    first = np.searchsorted(path, path, side="left")
    last = np.searchsorted(path, path, side="right") - 1
    return np.where(rows == first, last, rows - 1), np.where(rows == last, first, rows + 1)


def _blocks(table: Floats, segment_box: Floats, place: Ints) -> Floats:
    """Boxes around BLOCK elements each."""
    from camtool.kernels.discs import AX, AY, BLOCK

    corners = table[:, [AX, AY]]
    boxes = np.concatenate([corners, corners], axis=1)
    boxes[place] = segment_box
    starts = np.arange(0, len(table), BLOCK)
    low = np.minimum.reduceat(boxes[:, :2], starts)
    high = np.maximum.reduceat(boxes[:, 2:], starts)
    return np.ascontiguousarray(np.concatenate([low, high], axis=1))
