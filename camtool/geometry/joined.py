"""The vertices of chains: pieces laid end to end, and the gaps between them bridged.

A joint moves a line to meet its neighbour (two lines to the middle); arcs stay exact, and two
arcs with a gap get a short line between them. A chain of which joining leaves nothing (all of it
is shorter than the gap, or a ring around nothing) falls back: a ring to an open chain, an open
chain to its pieces.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.geometry.measure import path_lengths, signed_areas
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints, Polylines


@dataclass(frozen=True, eq=False)
class Chains:
    """C chains of `entries` (E,): the ends by which their paths are entered (2i forwards).

    Chain c has entries[begins[c]:begins[c + 1]]; `rings` (C,) says which are closed by joints.
    """

    entries: Ints
    begins: Ints
    rings: Bools

    def __len__(self) -> int:
        return len(self.rings)

    def select(self, chosen: Bools, rings: Bools) -> Chains:
        """The chosen chains (C,), as rings or not."""
        counts = np.diff(self.begins)
        rows = np.repeat(chosen, counts)
        begins = np.concatenate([[0], np.cumsum(counts[chosen])])
        return Chains(self.entries[rows], begins, rings[chosen])

    def apart(self) -> Chains:
        """Each path as a chain of its own, travelled as it was drawn."""
        count = len(self.entries)
        return Chains(self.entries & ~1, np.arange(count + 1), np.zeros(count, dtype=np.bool_))


@dataclass(frozen=True, eq=False)
class Joined:
    """Chains as paths; and the bridged gaps: chain (G,), place (G, 2) mm, size (G,) mm."""

    chains: Chains
    lines: Polylines
    gap_chain: Ints
    gap_at: Floats
    gap_size: Floats


def joined(lines: Polylines, chains: Chains) -> list[Joined]:
    """The chains of these open paths as paths, in up to three lots (see the top)."""
    done: list[Joined] = []
    left = chains
    for _ in range(2):
        if not len(left):
            return done
        good, part = _attempt(lines, left)
        if len(part.chains):
            done.append(part)
        # A ring may still be an open chain; an open chain only its pieces.
        again = left.select(~good, np.zeros(len(left), dtype=np.bool_))
        open_ones = ~left.rings[~good]
        pieces = again.select(open_ones, again.rings)
        if len(pieces):
            done.append(_laid(lines, pieces.apart()))
        left = again.select(~open_ones, again.rings)
    if len(left):
        done.append(_laid(lines, left.apart()))
    return done


def _attempt(lines: Polylines, chains: Chains) -> tuple[Bools, Joined]:
    """Which chains (C,) make a path, and those."""
    vertices, counts, gaps = _bridged(lines, chains)
    good = np.asarray(counts >= 2)
    path = np.repeat(np.arange(len(chains)), counts)
    keep = good[path]
    made = _columns(vertices[keep], counts[good], chains.rings[good])
    empty = made.closed & (np.abs(signed_areas(made)) <= POSITION_EPS_MM * path_lengths(made))
    if empty.any():
        good[np.flatnonzero(good)[empty]] = False
        keep = good[path]
        made = _columns(vertices[keep], counts[good], chains.rings[good])
    number = np.cumsum(good) - 1
    gap_chain, at, size = gaps
    kept = good[gap_chain]
    part = chains.select(good, chains.rings)
    return good, Joined(part, made, number[gap_chain[kept]], at[kept], size[kept])


def _laid(lines: Polylines, chains: Chains) -> Joined:
    """Paths as they are."""
    none = np.empty(0, dtype=np.int64)
    return Joined(chains, lines.select(chains.entries // 2), none, np.empty((0, 2)), np.empty(0))


def _columns(vertices: Floats, counts: Ints, closed: Bools) -> Polylines:
    return Polylines(vertices, np.concatenate([[0], np.cumsum(counts)]), closed)


_Gaps = tuple[Ints, Floats, Floats]


def _bridged(lines: Polylines, chains: Chains) -> tuple[Floats, Ints, _Gaps]:
    """The vertices (N, 3) of all chains, how many each has (C,), and the gaps bridged."""
    rows, counts = _rows(lines, chains)
    vertices = lines.vertices[rows]
    turned = np.repeat(chains.entries & 1, counts) == 1
    # The segment that left vertex i now leaves vertex i + 1 and bends the other way.
    vertices[turned, 2] = 0.0 - lines.vertices[rows[turned] - 1, 2]
    last = np.cumsum(counts) - 1
    first = last - counts + 1
    vertices[last, 2] = 0.0
    chain = np.repeat(np.arange(len(chains)), np.diff(chains.begins))
    # Each piece is followed by the next one of its chain, in a ring the last one by the first.
    following = np.arange(1, len(chain) + 1)
    following[chains.begins[1:] - 1] = chains.begins[:-1]
    meets = np.ones(len(chain), dtype=np.bool_)
    meets[(chains.begins[1:] - 1)[~chains.rings]] = False
    end, begin = last[meets], first[following[meets]]
    drop, gaps = _bridge(vertices, end, begin)
    keep = np.ones(len(vertices), dtype=np.bool_)
    keep[end[drop]] = False
    owner = np.repeat(chain, counts)
    vertices, owner = _without_short(vertices[keep], owner[keep], chains.rings)
    made = np.bincount(owner, minlength=len(chains)).astype(np.int64)
    wide, at, size = gaps
    return vertices, made, (chain[meets][wide], at, size)


def _rows(lines: Polylines, chains: Chains) -> tuple[Ints, Ints]:
    """The rows of all vertices in the order of travel, and how many each entry has."""
    path, turned = chains.entries // 2, chains.entries % 2
    counts = np.diff(lines.offsets)[path]
    begin = np.where(turned, lines.offsets[1:][path] - 1, lines.offsets[:-1][path])
    within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    return np.repeat(begin, counts) + np.repeat(1 - 2 * turned, counts) * within, counts


def _bridge(
    vertices: Floats, end: Ints, begin: Ints
) -> tuple[Bools, tuple[Bools, Floats, Floats]]:
    """Moves where pieces begin to where the others end; which ends go, and the gaps.

    The piece before ends at the row `end`, the one after begins at the row `begin`.
    """
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
    """Vertices without those that moved lines have left on top of each other."""
    while len(vertices) > 1:
        counts = np.bincount(owner, minlength=len(rings))
        last = np.cumsum(counts) - 1
        there = counts > 0
        following = np.arange(1, len(vertices) + 1)
        following[last[there]] = (last - counts + 1)[there]
        step = vertices[following, :2] - vertices[:, :2]
        keep = np.hypot(step[:, 0], step[:, 1]) > POSITION_EPS_MM
        keep[last[there & ~rings]] = True
        if keep.all():
            break
        vertices, owner = vertices[keep], owner[keep]
    return vertices, owner
