"""Open paths joined end to end: drawings give contours as loose lines and arcs.

    ends ──joints──▶ pairs ──walk──▶ chains ──joined──▶ paths ──open_gaps──▶ what stays open

Each end takes part in one joint only. Ends that meet exactly are joined first, whatever the gap;
only ends that meet nothing are joined across a gap. Where more than two ends meet, the straightest
pair is joined and the place is reported as a branch. A joint moves a line to meet its neighbour
(both lines to the middle); arcs stay exact, and two arcs with a gap get a short line between them.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import GeometryError
from camtool.geometry.drawing import Branch, Gap
from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines
from camtool.kernels.chaining import clusters, join, near_pairs, nearest_others, split_loops, walk


class Chained(Struct, frozen=True, eq=False):
    """Paths after chaining; `members[i]` are the input paths that became path i, in order.

    `closed_gaps`: every gap above `POSITION_EPS_MM` that was bridged. `open_gaps`: for paths that
    stay open, the nearest other open end (or the own other one), when it looks like a gap.
    `branches`: where more than two ends met."""

    lines: Polylines
    members: tuple[tuple[int, ...], ...]
    closed_gaps: tuple[Gap, ...]
    open_gaps: tuple[Gap, ...]
    branches: tuple[Branch, ...] = ()


class Kinds(Struct, frozen=True):
    """Properties of paths besides their shape, one item each; None where all are alike.

    Paths of different `groups` are never joined. At a branch, paths of one `style` (colour, line
    type) are joined first. `layers` name places; left out, the groups do."""

    groups: Sequence[Hashable] | None = None
    styles: Sequence[Hashable] | None = None
    layers: Sequence[str] | None = None


class _Paths(Struct, frozen=True, eq=False):
    """All that chaining needs of the paths: their ends, and the names of their layers."""

    lines: Polylines
    layers: Sequence[str]
    ends: Ends

    @classmethod
    def of(cls, lines: Polylines, kinds: Kinds) -> _Paths:
        for name in ("groups", "styles", "layers"):
            items = getattr(kinds, name)
            if items is not None and len(items) != len(lines):
                raise GeometryError(f"{len(items)} {name} for {len(lines)} paths")
        group = numbered(kinds.groups, len(lines))
        style = numbered(kinds.styles, len(lines))
        layers = kinds.layers
        if layers is None:
            layers = [""] * len(lines) if kinds.groups is None else list(map(str, kinds.groups))
        return cls(lines, layers, Ends.of(lines, group, style))


def chain(
    lines: Polylines,
    gap_mm: float,
    groups: Sequence[Hashable] | None = None,
    kinds: Kinds | None = None,
) -> Chained:
    """Join open paths where their ends meet exactly, then where free ends lie within `gap_mm`.

    Paths of different groups (layers) are never joined; `kinds` replaces `groups` where styles
    matter too. A chain whose own ends meet becomes closed, unless it would enclose nothing (a line
    and its double). Closed paths stay as they are. Results are in the order of their first
    members, and run in the direction in which that one was drawn. GeometryError when the gap is
    negative or not finite, or the number of groups is not that of the paths."""
    if not (np.isfinite(gap_mm) and gap_mm >= 0.0):
        raise GeometryError(f"a gap of {gap_mm} mm is not 0 or more")
    paths = _Paths.of(lines, kinds or Kinds(groups=groups))
    if lines.closed.all():
        return Chained(lines, _single_members(np.arange(len(lines))), (), ())

    chosen_joints = joints(paths.ends, max(gap_mm, POSITION_EPS_MM))
    is_single = lines.closed | (chosen_joints.mates.reshape(-1, 2) < 0).all(axis=1)
    batches = join_chains(lines, Chains(*walk(chosen_joints.mates, ~is_single)))
    result, members = _sorted_chains(lines, np.flatnonzero(is_single), batches)
    first = np.array([member_paths[0] for member_paths in members], dtype=np.int64)
    result_ends = Ends.of(result, paths.ends.group[first], paths.ends.style[first])
    names = [paths.layers[index] for index in first.tolist()]
    return Chained(
        lines=result,
        members=members,
        closed_gaps=tuple(_closed_gaps(batches, paths.layers)),
        open_gaps=tuple(open_gaps(result_ends, path_lengths(result), names, gap_mm)),
        branches=chosen_joints.named(paths.ends, paths.layers, members, result.closed),
    )


def numbered(items: Sequence[Hashable] | None, count: int) -> Ints:
    """Return a number (count,) for each item, the same for equal ones, from 0 in order of first
    appearance; all 0 for None."""
    if items is None:
        return np.zeros(count, dtype=np.int64)
    numbers: dict[Hashable, int] = {}
    return np.array([numbers.setdefault(item, len(numbers)) for item in items], dtype=np.int64)


def _single_members(paths: Ints) -> tuple[tuple[int, ...], ...]:
    """Return, for each of these paths, the path alone as the members of a chain."""
    return tuple((index,) for index in paths.tolist())


def _sorted_chains(
    lines: Polylines, single: Ints, batches: Sequence[JoinedChains]
) -> tuple[Polylines, tuple[tuple[int, ...], ...]]:
    """Return the single paths and all chains in the order of their first members, and the members
    of each."""
    if not batches:
        return lines, _single_members(single)
    members = list(_single_members(single))
    first_members = [single]
    for joined_batch in batches:
        paths = joined_batch.chains.entries // 2
        begins = joined_batch.chains.begins.tolist()
        flat = paths.tolist()
        members.extend(tuple(flat[a:b]) for a, b in pairwise(begins))
        first_members.append(np.minimum.reduceat(paths, joined_batch.chains.begins[:-1]))
    order = np.argsort(np.concatenate(first_members), kind="stable")
    every_path = Polylines.joined(
        [lines.select(single), *(joined_batch.lines for joined_batch in batches)]
    )
    return every_path.select(order), tuple(members[index] for index in order.tolist())


def _closed_gaps(batches: Sequence[JoinedChains], layers: Sequence[str]) -> list[Gap]:
    """Return the gaps that were bridged, in the order of the first members of their chains."""
    numbered_gaps: list[tuple[int, Gap]] = []
    for batch in batches:
        paths = batch.chains.entries // 2
        first_members = (
            np.minimum.reduceat(paths, batch.chains.begins[:-1]) if len(batch.chains) else paths
        )
        for chain_of, place, size in zip(
            batch.gap_chain.tolist(), batch.gap_at.tolist(), batch.gap_size.tolist(), strict=True
        ):
            path = int(first_members[chain_of])
            numbered_gaps.append((path, Gap((place[0], place[1]), size, layers[path])))
    numbered_gaps.sort(key=lambda item: item[0])
    return [gap for _, gap in numbered_gaps]


# Which open ends are joined: near ends are paired, at branches the straightest of them.
#
#     all ends ──within POSITION_EPS_MM──▶ pairs ──clusters──▶ two ends: joined
#                                                            └──▶ more ends: a branch,
#                                                                 best pairs first
#     ends that met none ──within the gap──▶ the same; but two ends whose rivals are all at least
#                                            CLASS_RATIO times as far apart are joined before
#
# So a gap tolerance never changes what meets exactly, however short the segments beside it.
#
# The best pair at a branch is, in this order: of the nearest class of distance (a class spans a
# factor of `CLASS_RATIO`; up to `POSITION_EPS_MM` is one class), of one style (colour, line type),
# the straightest (turns within `SAME_TURN_RAD` are the same), and then the one that comes first by
# place, so that the order in which paths were drawn decides nothing. Last, a ring that passes a
# branch twice becomes two rings: contours touch at corners, they do not run through each other.
#
# At a branch of ends that meet exactly and all belong to rings, every choice of pairs encloses the
# same points (those with an odd number of lines between them and the outside). So it does where
# the others are strokes of which the other end meets nothing. At any other branch the choice
# matters, and the paths that pass it are named with it.

CLASS_RATIO = 2.0
"""Distances of ends whose ratio is below this may count as equal at a branch."""

SAME_TURN_RAD = 1e-6

MAX_PAIRS = 4_000_000
"""At most this many pairs of ends are examined together; if there are more, the nearer ones are
joined first."""

MAX_NEIGHBOURS = 64
"""At a point where very many ends meet, each is compared with at most this many others."""


class Ends(Struct, frozen=True, eq=False):
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
        """Return the ends of all paths, also those of closed ones."""
        vertices, first, last = lines.vertices, lines.offsets[:-1], lines.offsets[1:] - 1
        rows = np.column_stack([first, last]).ravel()
        inner = np.column_stack([first + 1, last - 1]).ravel()
        points = vertices[rows, :2]
        outward = points - vertices[inner, :2]
        # An arc leaves its chord by half its sweep, 2 atan(bulge), to either side.
        bulge = np.column_stack([-vertices[first, 2], vertices[last - 1, 2]]).ravel()
        directions = np.arctan2(outward[:, 1], outward[:, 0]) + 2.0 * np.arctan(bulge)
        counts = np.diff(lines.offsets)
        arcs = np.add.reduceat(lines.vertices[:, 2] != 0.0, first) if len(first) else counts
        weights = np.column_stack([counts - ~lines.closed, arcs]).astype(np.int64)
        return cls(points, directions, group, style, ~lines.closed, weights)


class Joints(Struct, frozen=True, eq=False):
    """`mates` (2M,): the end that each end is joined to, −1 for none. `node` (2M,): the number of
    the branch at which an end lies, −1 for none; `branches` has for each such number the first end
    by place and how many ends meet there, and `bridged` the numbers of those with gaps. `single`
    (2M,): the ends that meet no other one exactly."""

    mates: Ints
    node: Ints
    branches: dict[int, tuple[int, int]]
    bridged: frozenset[int]
    single: Bools

    def named(
        self, ends: Ends, layers: Sequence[str], members: Sequence[Sequence[int]], closed: Bools
    ) -> tuple[Branch, ...]:
        """Return the branches with their places, sorted by place, layer and size.

        `members` are the input paths of each result, `closed` (results,) is true for closed ones.
        """
        if not self.branches:
            return ()
        result = np.empty(len(ends.group), dtype=np.int64)
        for index, paths in enumerate(members):
            result[list(paths)] = index
        matters = set(self.bridged)
        leads_nowhere = np.zeros(len(closed), dtype=np.bool_)
        leads_nowhere[result[np.flatnonzero(self.single & (self.mates < 0)) // 2]] = True
        meeting = np.flatnonzero(self.node >= 0)
        path = result[meeting // 2]
        is_harmless = np.where(self.mates[meeting] < 0, leads_nowhere[path], closed[path])
        matters.update(self.node[meeting[~is_harmless]].tolist())
        passing: dict[int, set[int]] = {number: set() for number in matters}
        for end in meeting.tolist():
            if (number := int(self.node[end])) in passing:
                passing[number].add(int(result[end // 2]))
        named_branches = [
            Branch(
                (float(ends.points[end, 0]), float(ends.points[end, 1])),
                size,
                layers[end // 2],
                tuple(sorted(passing.get(number, ()))),
            )
            for number, (end, size) in self.branches.items()
        ]
        return tuple(
            sorted(named_branches, key=lambda branch: (branch.at_mm, branch.layer, branch.ends))
        )


def joints(ends: Ends, reach: float) -> Joints:
    """Choose which ends are joined, within `reach` and within their group (by the rules above)."""
    joining = _Joining.of(ends)
    free_ends = every = np.flatnonzero(np.repeat(ends.is_open, 2))
    is_alone = np.ones(len(joining.mates), dtype=np.bool_)
    exact = one, other = _near_pairs(ends, every, POSITION_EPS_MM)
    is_alone[one], is_alone[other] = False, False
    # Where very many ends meet at one point, their pairs are examined in several rounds.
    while joining.join_clusters(one, other) and len(one) >= MAX_NEIGHBOURS:
        free_ends = free_ends[joining.mates[free_ends] < 0]
        one, other = _near_pairs(ends, free_ends, POSITION_EPS_MM)
    exact_branches = frozenset(joining.branches)
    free_ends = every[is_alone[every]]
    while len(free_ends) and reach > POSITION_EPS_MM:
        bounded_reach = _bounded_reach(ends.points[free_ends], reach)
        one, other = _near_pairs(ends, free_ends, bounded_reach)
        joint_count = joining.join_clear(*joining.without_empty_rings(one, other), bounded_reach)
        if bounded_reach == reach or joint_count == 0:
            break
        free_ends = free_ends[joining.mates[free_ends] < 0]
    _split_rings(ends, joining.mates, joining.node, reach)
    joining.note_left(is_alone, exact, reach)
    bridged = frozenset(joining.branches) - exact_branches
    return Joints(joining.mates, joining.node, joining.branches, bridged, is_alone)


class _Joining(Struct, eq=False):
    """The joints made so far: `mates`, `node` and `branches` as in `Joints`.

    Joined paths form a set: `above` leads from each path to the first of its set, which has the
    number of `segments` and `arcs` of all."""

    ends: Ends
    mates: Ints
    node: Ints
    branches: dict[int, tuple[int, int]]
    above: Ints
    segments: Ints
    arcs: Ints

    @classmethod
    def of(cls, ends: Ends) -> _Joining:
        """Return the state before any end is joined."""
        no_mates = np.full(len(ends.points), -1, dtype=np.int64)
        segments, arcs = ends.weights[:, 0].copy(), ends.weights[:, 1].copy()
        return cls(ends, no_mates, no_mates.copy(), {}, np.arange(len(ends.group)), segments, arcs)

    def join(self, one: Ints, other: Ints) -> int:
        """Join these pairs of ends in their order, each if both are still free; return the number
        of joints."""
        return join(one, other, self.mates, self.above, self.segments, self.arcs)

    def without_empty_rings(self, one: Ints, other: Ints) -> tuple[Ints, Ints]:
        """Return the pairs without those whose two ends are of one path that would enclose no area
        when closed."""
        segments, arcs = self.ends.weights[one // 2].T
        encloses = (one // 2 != other // 2) | (segments > 2) | ((segments == 2) & (arcs > 0))
        return one[encloses], other[encloses]

    def join_clusters(self, one: Ints, other: Ints) -> int:
        """Join ends that lie in pairs, and at branches, where more meet, the best pairs first;
        return the number of joints."""
        label, size = _clusters(len(self.mates), one, other)
        is_branch = size[label[one]] > 2
        joint_count = self.join(*_sorted_pairs(one[~is_branch], other[~is_branch]))
        joint_count += self.join(*_rank_pairs(self.ends, one[is_branch], other[is_branch]))
        meeting = np.flatnonzero(size[label] > 2)
        self.node[meeting] = label[meeting]
        self.branches.update(_first_ends(self.ends, meeting, label))
        return joint_count

    def note_left(self, is_alone: Bools, exact: tuple[Ints, Ints], reach: float) -> None:
        """Note a branch where a lone end has stayed free though joined ends lie within `reach`: it
        may have been meant to meet these.

        `is_alone` (2M,) is the mask of the ends that no other one meets exactly, `exact` the pairs
        of the others."""
        is_free = is_alone & (self.mates < 0) & (self.node < 0)
        if reach <= POSITION_EPS_MM or not is_free.any():
            return
        every = np.flatnonzero(np.repeat(self.ends.is_open, 2))
        pairs = _near_pairs(self.ends, every, _bounded_reach(self.ends.points[every], reach))
        one, other = self.without_empty_rings(*pairs)
        differs = is_free[one] != is_free[other]
        one, other = one[differs], other[differs]
        mated = np.where(is_free[one], other, one)
        mated = mated[self.mates[mated] >= 0]
        one = np.concatenate([one, mated, exact[0]])
        other = np.concatenate([other, self.mates[mated], exact[1]])
        label, size = _clusters(len(self.mates), one, other)
        has_free = np.zeros(len(label), dtype=np.bool_)
        has_free[label[is_free]] = True
        meeting = np.flatnonzero((size[label] > 2) & has_free[label])
        for number in distinct(self.node[meeting]).tolist():
            self.branches.pop(number, None)  # this branch is part of a larger one
        label += len(label)
        self.node[meeting] = label[meeting]
        self.branches.update(_first_ends(self.ends, meeting, label))

    def join_clear(self, one: Ints, other: Ints, reach: float) -> int:
        """Join the pairs (J,), (J,), all within `reach`, first those whose rivals are much farther
        (see above), then the others; return the number of joints."""
        distance = np.hypot(*(self.ends.points[one] - self.ends.points[other]).T)
        joint_count, min_distance = 0, float(distance.min(initial=reach))
        for k in range(math.ceil(math.log(reach / min_distance, CLASS_RATIO)), -1, -1):
            scale = reach / CLASS_RATIO**k
            close = distance <= CLASS_RATIO * scale
            label, size = _clusters(len(self.mates), one[close], other[close])
            clear = (distance <= scale) & (size[label[one]] == 2)
            joint_count += self.join(*_sorted_pairs(one[clear], other[clear]))
            is_open = ~clear & (self.mates[one] < 0) & (self.mates[other] < 0)
            one, other, distance = one[is_open], other[is_open], distance[is_open]
            if not len(one):
                return joint_count
        return joint_count + self.join_clusters(one, other)


def _bounded_reach(points: Floats, reach: float) -> float:
    """Return `reach`, or a smaller distance within which there are at most MAX_PAIRS pairs."""
    while reach > POSITION_EPS_MM:
        cells = np.floor(points / reach).astype(np.int64)
        mixed = cells[:, 0] * _MIX + cells[:, 1]
        counts = np.unique(mixed, return_counts=True)[1].astype(np.float64)
        if (counts**2).sum() <= MAX_PAIRS:
            return reach
        reach = max(0.25 * reach, POSITION_EPS_MM)
    return reach


_MIX = np.int64(0x9E3779B1)


def _near_pairs(ends: Ends, free_ends: Ints, reach: float) -> tuple[Ints, Ints]:
    """Return the pairs of free ends of one group within `reach`, the lesser end first."""
    points = ends.points[free_ends]
    # Slightly wider than the reach, so that rounding cannot put near points two cells apart.
    cells = np.column_stack([ends.group[free_ends // 2], np.floor(points / (reach * _WIDER))])
    cells = cells.astype(np.int64)
    order = np.lexsort((cells[:, 2], cells[:, 1], cells[:, 0]))
    max_neighbours = MAX_NEIGHBOURS if reach <= POSITION_EPS_MM else len(free_ends)
    one, other = near_pairs(cells[order], points[order], reach, max_neighbours)
    one, other = free_ends[order[one]], free_ends[order[other]]
    return np.minimum(one, other), np.maximum(one, other)


_WIDER = 1.0 + 1e-9


def _sorted_pairs(one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """Return the pairs sorted by their first ends."""
    order = np.argsort(one, kind="stable")
    return one[order], other[order]


def _clusters(count: int, one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """Return for each end the least end of its cluster, ends linked by pairs, and for each least
    end the number of ends in the cluster."""
    label = clusters(count, one, other)
    return label, np.bincount(label, minlength=count)


def _rank_pairs(ends: Ends, one: Ints, other: Ints) -> tuple[Ints, Ints]:
    """Return the pairs of ends at branches sorted, the best first: by distance, style, turn and
    place (see above)."""
    distance = np.hypot(*(ends.points[one] - ends.points[other]).T)
    with np.errstate(divide="ignore"):
        steps = np.log(distance / POSITION_EPS_MM) / math.log(CLASS_RATIO)
    distance = np.maximum(np.floor(steps), -1.0)
    differs_in_style = ends.style[one // 2] != ends.style[other // 2]
    turn = np.abs(wrapped(ends.leaving[one] - ends.leaving[other] - math.pi))
    bend = np.round(turn / SAME_TURN_RAD)
    place = _place_ranks(ends, distinct(np.concatenate([one, other])))
    first = np.minimum(place[one], place[other])
    second = np.maximum(place[one], place[other])
    order = np.lexsort((second, first, bend, differs_in_style, distance))
    return one[order], other[order]


def wrapped(angle: Floats) -> Floats:
    """Return the same angles, rad, in the range −π ≤ angle < π."""
    return np.asarray((angle + math.pi) % (2.0 * math.pi) - math.pi)


def _place_ranks(ends: Ends, chosen_ends: Ints) -> Ints:
    """Return the rank (2M,) of the chosen ends, sorted by place, direction and the place of their
    path's other end."""
    x, y = (np.round(ends.points[chosen_ends] / POSITION_EPS_MM)).T
    far_x, far_y = (np.round(ends.points[chosen_ends ^ 1] / POSITION_EPS_MM)).T
    directions = np.round(wrapped(ends.leaving[chosen_ends]) / SAME_TURN_RAD)
    rank = np.zeros(len(ends.points), dtype=np.int64)
    rank[chosen_ends[np.lexsort((directions, far_y, far_x, y, x))]] = np.arange(len(chosen_ends))
    return rank


def _first_ends(ends: Ends, meeting: Ints, label: Ints) -> dict[int, tuple[int, int]]:
    """Return for each branch, by its label, its first end by place, and the number of ends that
    meet there."""
    if not len(meeting):
        return {}
    rank = _place_ranks(ends, meeting)
    order = meeting[np.lexsort((rank[meeting], label[meeting]))]
    number, begin, count = np.unique(label[order], return_index=True, return_counts=True)
    firsts = zip(order[begin].tolist(), count.tolist(), strict=True)
    return dict(zip(number.tolist(), firsts, strict=True))


def _split_rings(ends: Ends, mates: Ints, node: Ints, reach: float) -> None:
    """Split each ring that passes a branch twice into two rings, by changing `mates` in place; it
    is walked from its first end by place."""
    if not (node >= 0).any():
        return

    entries, begins, rings = walk(mates, ends.is_open)
    ring = np.repeat(np.arange(len(rings)), np.diff(begins))
    branch_ends = np.concatenate([entries, entries ^ 1])
    ring_of = np.concatenate([ring, ring])
    at_branch = rings[ring_of] & (node[branch_ends] >= 0)
    branch_ends, ring_of = branch_ends[at_branch], ring_of[at_branch]
    order = np.argsort(branch_ends)
    branch_ends, ring_of = branch_ends[order], ring_of[order]
    if not len(branch_ends):
        return
    rank = _place_ranks(ends, branch_ends)
    order = np.lexsort((rank[branch_ends], ring_of))
    first = np.unique(ring_of[order], return_index=True)[1]
    split_loops(branch_ends[order][first], mates, node, ends.points, reach, ends.weights)


# The vertices of chains: pieces laid end to end, and the gaps between them bridged.
#
# A joint moves a line to meet its neighbour (two lines to the middle); arcs stay exact, and two
# arcs with a gap get a short line between them. A chain of which joining leaves nothing (all of it
# is shorter than the gap, or a ring around nothing) falls back: a ring to an open chain, an open
# chain to its pieces.


class Chains(Struct, frozen=True, eq=False):
    """C chains of `entries` (E,): the ends by which their paths are entered (2i forwards).

    Chain c has entries[begins[c]:begins[c + 1]]; `rings` (C,) says which are closed by joints."""

    entries: Ints
    begins: Ints
    rings: Bools

    def __len__(self) -> int:
        return len(self.rings)

    def select(self, selection: Bools, rings: Bools) -> Chains:
        """Return the chains of the mask `selection` (C,), as rings where `rings` (C,) is true,
        else as open chains."""
        counts = np.diff(self.begins)
        rows = np.repeat(selection, counts)
        begins = np.concatenate([[0], np.cumsum(counts[selection])])
        return Chains(self.entries[rows], begins, rings[selection])

    def as_single_paths(self) -> Chains:
        """Return each path as a chain of its own, in the direction in which it was drawn."""
        count = len(self.entries)
        return Chains(self.entries & ~1, np.arange(count + 1), np.zeros(count, dtype=np.bool_))


class JoinedChains(Struct, frozen=True, eq=False):
    """Chains as paths; and the bridged gaps: chain (G,), place (G, 2) mm, size (G,) mm."""

    chains: Chains
    lines: Polylines
    gap_chain: Ints
    gap_at: Floats
    gap_size: Floats


def join_chains(lines: Polylines, chains: Chains) -> list[JoinedChains]:
    """Return the paths made of chains of these open paths, in up to three batches.

    A ring that makes no path is tried as an open chain; an open chain that makes none gives its
    single paths."""
    results: list[JoinedChains] = []
    remaining = chains
    for _ in range(2):
        if not len(remaining):
            return results
        is_path, part = _try_chains(lines, remaining)
        if len(part.chains):
            results.append(part)
        # A ring is tried again as an open chain; an open chain gives its single paths.
        retried = remaining.select(~is_path, np.zeros(len(remaining), dtype=np.bool_))
        open_ones = ~remaining.rings[~is_path]
        pieces = retried.select(open_ones, retried.rings)
        if len(pieces):
            results.append(_single_paths(lines, pieces.as_single_paths()))
        remaining = retried.select(~open_ones, retried.rings)
    if len(remaining):
        results.append(_single_paths(lines, remaining.as_single_paths()))
    return results


def _try_chains(lines: Polylines, chains: Chains) -> tuple[Bools, JoinedChains]:
    """Return the mask (C,) of the chains that make a path, and these paths.

    A chain makes none if fewer than two vertices remain, or if it is a ring without an area."""
    vertices, counts, gaps = _chain_vertices(lines, chains)
    is_path = np.asarray(counts >= 2)
    path = np.repeat(np.arange(len(chains)), counts)
    keep = is_path[path]
    candidates = _polylines_of(vertices[keep], counts[is_path], chains.rings[is_path])
    empty = candidates.closed & (
        np.abs(signed_areas(candidates)) <= POSITION_EPS_MM * path_lengths(candidates)
    )
    if empty.any():
        is_path[np.flatnonzero(is_path)[empty]] = False
        keep = is_path[path]
        candidates = _polylines_of(vertices[keep], counts[is_path], chains.rings[is_path])
    number = np.cumsum(is_path) - 1
    gap_chain, places, size = gaps
    has_path = is_path[gap_chain]
    part = chains.select(is_path, chains.rings)
    return is_path, JoinedChains(
        part, candidates, number[gap_chain[has_path]], places[has_path], size[has_path]
    )


def _single_paths(lines: Polylines, chains: Chains) -> JoinedChains:
    """Return these chains, each of one path, with that path unchanged and without gaps."""
    no_gaps = np.empty(0, dtype=np.int64)
    return JoinedChains(
        chains, lines.select(chains.entries // 2), no_gaps, np.empty((0, 2)), np.empty(0)
    )


def _polylines_of(vertices: Floats, counts: Ints, closed: Bools) -> Polylines:
    return Polylines(vertices, np.concatenate([[0], np.cumsum(counts)]), closed)


_Gaps = tuple[Ints, Floats, Floats]


def _chain_vertices(lines: Polylines, chains: Chains) -> tuple[Floats, Ints, _Gaps]:
    """Return the vertices (N, 3) of all chains, the number of vertices of each (C,), and the gaps
    that were bridged: chain, place and size."""
    rows, counts = _vertex_rows(lines, chains)
    vertices = lines.vertices[rows]
    is_reversed = np.repeat(chains.entries & 1, counts) == 1
    # The segment that left vertex i now leaves vertex i + 1 and bends to the other side.
    vertices[is_reversed, 2] = 0.0 - lines.vertices[rows[is_reversed] - 1, 2]
    last = np.cumsum(counts) - 1
    first = last - counts + 1
    vertices[last, 2] = 0.0
    chain = np.repeat(np.arange(len(chains)), np.diff(chains.begins))
    # Each piece is followed by the next one of its chain, in a ring the last one by the first.
    following = np.arange(1, len(chain) + 1)
    following[chains.begins[1:] - 1] = chains.begins[:-1]
    has_joint = np.ones(len(chain), dtype=np.bool_)
    has_joint[(chains.begins[1:] - 1)[~chains.rings]] = False
    end, begin = last[has_joint], first[following[has_joint]]
    drop, gaps = _bridge_gaps(vertices, end, begin)
    keep = np.ones(len(vertices), dtype=np.bool_)
    keep[end[drop]] = False
    owner = np.repeat(chain, counts)
    vertices, owner = _without_short(vertices[keep], owner[keep], chains.rings)
    vertex_counts = np.bincount(owner, minlength=len(chains)).astype(np.int64)
    wide, places, size = gaps
    return vertices, vertex_counts, (chain[has_joint][wide], places, size)


def _vertex_rows(lines: Polylines, chains: Chains) -> tuple[Ints, Ints]:
    """Return the rows of all vertices in the order of travel, and the number of rows of each entry
    of the chains."""
    path, is_reversed = chains.entries // 2, chains.entries % 2
    counts = np.diff(lines.offsets)[path]
    begin = np.where(is_reversed, lines.offsets[1:][path] - 1, lines.offsets[:-1][path])
    steps = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(begin, counts) + np.repeat(1 - 2 * is_reversed, counts) * steps, counts


def _bridge_gaps(
    vertices: Floats, end: Ints, begin: Ints
) -> tuple[Bools, tuple[Bools, Floats, Floats]]:
    """Move the vertices on both sides of each joint together, in place; return a mask of joints of
    which one vertex is dropped, and the gaps.

    The path before a joint ends at the row `end`, the one after it begins at the row `begin`. Gaps
    are a mask of joints, their places (G, 2) and sizes (G,), mm."""
    before, after = vertices[end, :2], vertices[begin, :2]
    size = np.hypot(*(before - after).T)
    middle = 0.5 * (before + after)
    arc_before = vertices[end - 1, 2] != 0.0
    arc_after = vertices[begin, 2] != 0.0
    wide = np.asarray(size > POSITION_EPS_MM)
    to_arc = arc_before & ~arc_after
    vertices[begin[to_arc], :2] = before[to_arc]
    both_lines = ~arc_before & ~arc_after
    vertices[begin[both_lines], :2] = middle[both_lines]
    return ~(wide & arc_before & arc_after), (wide, middle[wide], size[wide])


def _without_short(vertices: Floats, owner: Ints, rings: Bools) -> tuple[Floats, Ints]:
    """Return the vertices, and the owner of each, without those that coincide with the next one
    after lines were moved."""
    while len(vertices) > 1:
        counts = np.bincount(owner, minlength=len(rings))
        last = np.cumsum(counts) - 1
        has_vertices = counts > 0
        following = np.arange(1, len(vertices) + 1)
        following[last[has_vertices]] = (last - counts + 1)[has_vertices]
        step = vertices[following, :2] - vertices[:, :2]
        keep = np.hypot(step[:, 0], step[:, 1]) > POSITION_EPS_MM
        keep[last[has_vertices & ~rings]] = True
        if keep.all():
            break
        vertices, owner = vertices[keep], owner[keep]
    return vertices, owner


# Open ends that may have been meant to meet: near each other, against the size of their paths.
#
# A drawing may well have open strokes near each other, so nearness alone says little: a gap counts
# when it is small against the paths that it parts.

NEAR_GAPS = 100.0
"""An end that stays open is reported when another end is nearer than this many times the gap."""

OWN_GAP_SHARE = 0.1
"""The two ends of one path are a gap when they are nearer than this share of its length."""

GAP_SHARE = 0.05
"""Ends of two paths are a gap when they are nearer than this share of the shorter one."""

SHARPEST_TURN_RAD = 2.6
"""Two paths that would turn by more than this where they nearly meet lie side by side, as the
lines of a hatch do: their ends are no gap."""

SPACING_SHARE = 0.1
"""Ends of two paths are a gap when they are nearer than this share of the mean distance of
randomly scattered ends: among very many strokes some ends are near by chance."""

FINEST_CELLS = 16.0
"""The grid for the search of near ends has no cell below this share of the reach."""


def open_gaps(ends: Ends, lengths: Floats, layers: Sequence[str], gap_mm: float) -> list[Gap]:
    """Return, for each open path, the gap to the nearest other open end of its group if it looks
    like one that was meant to meet.

    `ends` are those of M paths with `lengths` (M,) mm and `layers`. Each pair of ends comes once;
    ends that coincide are no gap."""
    gaps: dict[tuple[int, int], Gap] = {}
    is_open = np.flatnonzero(np.repeat(ends.is_open, 2))
    for group in distinct(ends.group[is_open // 2]):
        rows = is_open[ends.group[is_open // 2] == group]
        one, other, size = _nearest_ends(
            ends.points[rows], NEAR_GAPS * max(gap_mm, POSITION_EPS_MM)
        )
        one, other = rows[one], rows[other]
        at_random = SPACING_SHARE * _spacing(ends.points[rows])
        is_gap = _is_gap(ends, lengths, one, other, size) & (
            (one // 2 == other // 2) | (size <= at_random)
        )
        for a, b, distance in zip(
            one[is_gap].tolist(), other[is_gap].tolist(), size[is_gap].tolist(), strict=True
        ):
            x, y = (0.5 * (ends.points[a] + ends.points[b])).tolist()
            gaps.setdefault((min(a, b), max(a, b)), Gap((x, y), distance, layers[a // 2]))
    return [gaps[key] for key in sorted(gaps)]


def _is_gap(ends: Ends, lengths: Floats, one: Ints, other: Ints, size: Floats) -> Bools:
    """Return a mask of the pairs of near ends that look as if they were meant to meet: near
    against the size of their paths, and not side by side."""
    same_path = one // 2 == other // 2
    shorter = np.minimum(lengths[one // 2], lengths[other // 2])
    is_small = size <= np.where(same_path, OWN_GAP_SHARE, GAP_SHARE) * shorter
    turn = np.abs(wrapped(ends.leaving[one] - ends.leaving[other] - np.pi))
    return np.asarray(is_small & (same_path | (turn <= SHARPEST_TURN_RAD)))


def _spacing(points: Floats) -> float:
    """Estimate the mean distance, mm, of nearest neighbours among as many points scattered at
    random over the box of these.

    It is half the square root of the area for each point, or half the length for each on a line.
    """
    width, height = (float(side) for side in np.ptp(points, axis=0))
    count = len(points)
    return max(0.5 * math.sqrt(width * height / count), 0.5 * max(width, height) / count)


def _nearest_ends(points: Floats, reach: float) -> tuple[Ints, Ints, Floats]:
    """Return the rows (J,) of points that have another one within `reach`, the row of the nearest
    one (J,) and its distance (J,); coinciding points do not count."""
    spread = points.max(axis=0) - points.min(axis=0)
    spacing = float(np.sqrt(spread[0] * spread[1] / len(points)))
    size = min(max(spacing, reach / FINEST_CELLS), reach)
    cells = np.floor((points - points.min(axis=0)) / size).astype(np.int64)
    order = np.lexsort((cells[:, 1], cells[:, 0]))
    nearest_rows, distance = nearest_others(
        cells[order], points[order], size, POSITION_EPS_MM, reach
    )
    has_neighbour = nearest_rows >= 0
    return order[has_neighbour], order[nearest_rows[has_neighbour]], distance[has_neighbour]
