"""Which open ends are joined: near ends paired, and the straightest way taken at branches.

    ends ──grid──▶ pairs within the gap ──clusters──▶ two ends: joined
                                                └───▶ more ends: a branch, best pairs first

The best pair at a branch is, in this order: of the nearest class of distance (a class spans a
factor of `CLASS_RATIO`; up to `POSITION_EPS_MM` is one class), of one style (colour, line type),
the straightest (turns within `SAME_TURN_RAD` are the same), and then the one that comes first by
place, so that the order in which paths were drawn decides nothing. Last, a ring that passes a
branch twice becomes two rings: contours touch at corners, they do not run through each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from camtool.geometry.drawing import Branch
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints, Polylines

CLASS_RATIO = 2.0
"""Distances of ends whose ratio is below this may count as equal at a branch."""

SAME_TURN_RAD = 1e-6
"""Turns that differ by less are equal at a branch."""

MOST_PAIRS = 4_000_000
"""More pairs of ends than this are not looked at together: nearer ones are joined before."""

MOST_NEIGHBOURS = 64
"""So many others are looked at for each end where very many ends meet at one point."""


@dataclass(frozen=True, eq=False)
class Ends:
    """The ends of M paths, 2i the start and 2i + 1 the end of path i.

    `points` (2M, 2) mm; `leaving` (2M,) rad, the direction in which the path would go on beyond
    its end; `group` and `style` (M,) numbers; `is_open` (M,); `weights` (M, 2) segments and arcs.
    """

    points: Floats
    leaving: Floats
    group: Ints
    style: Ints
    is_open: Bools
    weights: Ints

    @classmethod
    def of(cls, lines: Polylines, group: Ints, style: Ints) -> Ends:
        """The ends of all paths, those of closed ones too."""
        vertices, first, last = lines.vertices, lines.offsets[:-1], lines.offsets[1:] - 1
        rows = np.column_stack([first, last]).ravel()
        inner = np.column_stack([first + 1, last - 1]).ravel()
        points = vertices[rows, :2]
        outward = points - vertices[inner, :2]
        # An arc leaves its chord by half its sweep, 2 atan(bulge), to either side.
        bulge = np.column_stack([-vertices[first, 2], vertices[last - 1, 2]]).ravel()
        leaving = np.arctan2(outward[:, 1], outward[:, 0]) + 2.0 * np.arctan(bulge)
        counts = np.diff(lines.offsets)
        arcs = np.add.reduceat(lines.vertices[:, 2] != 0.0, first) if len(first) else counts
        weights = np.column_stack([counts - ~lines.closed, arcs]).astype(np.int64)
        return cls(points, leaving, group, style, ~lines.closed, weights)


@dataclass(frozen=True, eq=False)
class Joints:
    """`mates` (2M,): the end that each end is joined to, −1 for none; and where ends branch."""

    mates: Ints
    branches: tuple[tuple[int, int], ...]

    def named(self, ends: Ends, layers: Sequence[str]) -> tuple[Branch, ...]:
        """The branches with their places, in the order of place, layer and size."""
        found = [
            Branch(
                (float(ends.points[end, 0]), float(ends.points[end, 1])), size, layers[end // 2]
            )
            for end, size in self.branches
        ]
        return tuple(sorted(found, key=lambda branch: (branch.at_mm, branch.layer, branch.ends)))


def joints(ends: Ends, reach: float) -> Joints:
    """Which ends are joined, within `reach` and within their group (see the top)."""
    from camtool.kernels.chaining import join

    mates = np.full(len(ends.points), -1, dtype=np.int64)
    above = np.arange(len(ends.group))
    segments, arcs = ends.weights[:, 0].copy(), ends.weights[:, 1].copy()
    node = np.full(len(mates), -1, dtype=np.int64)
    branches: dict[int, int] = {}
    free = np.flatnonzero(np.repeat(ends.is_open, 2))
    while len(free):
        near = _bearable(ends.points[free], reach)
        one, other = _near(ends, free, near)
        label, size = _clusters(len(mates), one, other)
        is_branch = size[label[one]] > 2
        order = np.argsort(one[~is_branch], kind="stable")
        simple = one[~is_branch][order], other[~is_branch][order]
        hard = _ranked(ends, one[is_branch], other[is_branch])
        made = sum(join(*pair, mates, above, segments, arcs) for pair in (simple, hard))
        meeting = np.flatnonzero(size[label] > 2)
        node[meeting] = label[meeting]
        branches.update(_first_ends(ends, meeting, label))
        if near == reach or made == 0:
            break
        free = free[mates[free] < 0]
    _split(ends, mates, node, reach)
    return Joints(mates, tuple(branches.items()))


def _bearable(points: Floats, reach: float) -> float:
    """`reach`, or so much less that there are no more than MOST_PAIRS pairs."""
    while reach > POSITION_EPS_MM:
        cells = np.floor(points / reach).astype(np.int64)
        mixed = cells[:, 0] * _MIX + cells[:, 1]
        counts = np.unique(mixed, return_counts=True)[1].astype(np.float64)
        if (counts**2).sum() <= MOST_PAIRS:
            return reach
        reach = max(0.25 * reach, POSITION_EPS_MM)
    return reach


_MIX = np.int64(0x9E3779B1)


def _near(ends: Ends, free: Ints, reach: float) -> tuple[Ints, Ints]:
    """The pairs of free ends within `reach` in one group, the lesser end first."""
    from camtool.kernels.chaining import near_pairs

    points = ends.points[free]
    # Wider than the reach by a hair, so that rounding cannot put near points two cells apart.
    cells = np.column_stack([ends.group[free // 2], np.floor(points / (reach * _WIDER))])
    cells = cells.astype(np.int64)
    order = np.lexsort((cells[:, 2], cells[:, 1], cells[:, 0]))
    most = MOST_NEIGHBOURS if reach <= POSITION_EPS_MM else len(free)
    one, other = near_pairs(cells[order], points[order], reach, most)
    one, other = free[order[one]], free[order[other]]
    return np.minimum(one, other), np.maximum(one, other)


_WIDER = 1.0 + 1e-9


def _clusters(count: int, one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """For each end the least end of its cluster, and for each such end how many are in it."""
    from camtool.kernels.chaining import clusters

    label = clusters(count, one, other)
    return label, np.bincount(label, minlength=count)


def _ranked(ends: Ends, one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """Pairs at branches, the best first."""
    apart = np.hypot(*(ends.points[one] - ends.points[other]).T)
    with np.errstate(divide="ignore"):
        steps = np.log(apart / POSITION_EPS_MM) / math.log(CLASS_RATIO)
    distance = np.maximum(np.floor(steps), -1.0)
    unlike = ends.style[one // 2] != ends.style[other // 2]
    turn = np.abs(wrapped(ends.leaving[one] - ends.leaving[other] - math.pi))
    bend = np.round(turn / SAME_TURN_RAD)
    place = _places(ends, np.unique(np.concatenate([one, other])))
    first = np.minimum(place[one], place[other])
    second = np.maximum(place[one], place[other])
    order = np.lexsort((second, first, bend, unlike, distance))
    return one[order], other[order]


def wrapped(angle: Floats) -> Floats:
    """Angles (…,) brought into −π ≤ angle < π."""
    return np.asarray((angle + math.pi) % (2.0 * math.pi) - math.pi)


def _places(ends: Ends, chosen: Ints) -> Ints:
    """(2M,) the rank of the chosen ends by place, direction and the place of the other end."""
    x, y = (np.round(ends.points[chosen] / POSITION_EPS_MM)).T
    far_x, far_y = (np.round(ends.points[chosen ^ 1] / POSITION_EPS_MM)).T
    leaving = np.round(wrapped(ends.leaving[chosen]) / SAME_TURN_RAD)
    rank = np.zeros(len(ends.points), dtype=np.int64)
    rank[chosen[np.lexsort((leaving, far_y, far_x, y, x))]] = np.arange(len(chosen))
    return rank


def _first_ends(ends: Ends, meeting: Ints, label: Ints) -> dict[int, int]:
    """For each branch its first end by place, and how many ends meet there."""
    if not len(meeting):
        return {}
    rank = _places(ends, meeting)
    order = meeting[np.lexsort((rank[meeting], label[meeting]))]
    _, begin, count = np.unique(label[order], return_index=True, return_counts=True)
    return dict(zip(order[begin].tolist(), count.tolist(), strict=True))


def _split(ends: Ends, mates: Ints, node: Ints, reach: float) -> None:
    """Rings that pass a branch twice are parted there, each walked from its first end by place."""
    if not (node >= 0).any():
        return
    from camtool.kernels.chaining import split_loops, walk

    entries, begins, rings = walk(mates, ends.is_open)
    ring = np.repeat(np.arange(len(rings)), np.diff(begins))
    both = np.concatenate([entries, entries ^ 1])
    ring_of = np.concatenate([ring, ring])
    at_branch = rings[ring_of] & (node[both] >= 0)
    both, ring_of = both[at_branch], ring_of[at_branch]
    order = np.argsort(both)
    both, ring_of = both[order], ring_of[order]
    if not len(both):
        return
    rank = _places(ends, both)
    order = np.lexsort((rank[both], ring_of))
    first = np.unique(ring_of[order], return_index=True)[1]
    split_loops(both[order][first], mates, node, ends.points, reach, ends.weights)
