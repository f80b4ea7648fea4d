"""Pieces of a carved region as a graph: twigs that cut nothing go, and the rest is walked.

    pieces ──ends that meet──▶ graph ──twigs off──▶ graph ──as few walks as there can be──▶ walks

A connected graph in which 2k places have an odd number of ends is walked in k walks (in one when
k is 0): it is joined by k jumps between near places to one closed walk, that is found piece by
piece (Hierholzer), and cut where the tool would jump. Short pieces between two such places are
walked twice instead, into a corner and back, which saves a jump each.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.geometry.offset import merge_points
from camtool.geometry.polylines import Bools, Floats, Ints

MEET_MM = 1e-4
"""Ends of pieces that are nearer than this meet."""


@dataclass(frozen=True, eq=False)
class Graph:
    """P pieces between V places: `ends` (P, 2) rows of `places` (V, 3) of x, y, rho."""

    pieces: list[Floats]
    ends: Ints
    places: Floats


def graph_of(pieces: list[Floats]) -> Graph:
    """The graph of pieces (n, 4) of x, y, rho, bulge; those that go nowhere are left out."""
    pieces = [piece for piece in pieces if _extent(piece) > MEET_MM]
    if not pieces:
        return Graph([], np.empty((0, 2), dtype=np.int64), np.empty((0, 3)))
    discs = np.concatenate([piece[[0, -1], :3] for piece in pieces])
    place, _ = merge_points(discs[:, :2], MEET_MM)
    first = np.unique(place, return_index=True)[1]
    return Graph(pieces, place.reshape(-1, 2), discs[first])


def _extent(piece: Floats) -> float:
    """How far the piece leaves its start, by its points; above 0 for a full turn."""
    return float(np.hypot(*(piece[1:, :2] - piece[0, :2]).T).max())


def without_twigs(graph: Graph, tolerance_mm: float) -> Graph:
    """The graph without its twigs whose discs reach no farther than the tolerance out of the disc
    at the other end of the twig.

    A disc (m, ρ) reaches |m − m'| + ρ − ρ' out of another one (m', ρ'); along a twig of several
    pieces these add up at most.
    """
    degree = np.bincount(graph.ends.ravel(), minlength=len(graph.places))
    beyond = np.zeros(len(graph.places))
    kept: Bools = np.ones(len(graph.pieces), dtype=np.bool_)
    at_place = _pieces_at(graph)
    waiting = sorted(np.flatnonzero(degree == 1).tolist(), key=lambda v: graph.places[v, 2])
    while waiting:
        leaf = waiting.pop(0)
        row = next((row for row in at_place[leaf] if kept[row]), None)
        if row is None:
            continue
        inner = int(graph.ends[row].sum()) - leaf
        step = graph.places[leaf] - graph.places[inner]
        out = beyond[leaf] + np.hypot(step[0], step[1]) + step[2]
        if out > tolerance_mm:
            continue
        kept[row] = False
        beyond[inner] = max(beyond[inner], out)
        degree[inner] -= 1
        if degree[inner] == 1:
            waiting.append(inner)
    rows = np.flatnonzero(kept)
    return Graph([graph.pieces[row] for row in rows], graph.ends[rows], graph.places)


def _pieces_at(graph: Graph) -> list[list[int]]:
    """The pieces that end at each place; twice where both ends do."""
    at_place: list[list[int]] = [[] for _ in range(len(graph.places))]
    for row, (a, b) in enumerate(graph.ends.tolist()):
        at_place[a].append(row)
        at_place[b].append(row)
    return at_place


def walks(graph: Graph, again_mm: float) -> list[Floats]:
    """All pieces, joined to as few walks (n, 4) of x, y, rho, bulge as possible.

    Pieces up to `again_mm` long may be walked twice. A walk begins at that of its ends where the
    disc is smaller.
    """
    graph = _doubled(graph, again_mm)
    ends = np.concatenate([graph.ends, _jumps(graph)])
    result = []
    for circuit in _circuits(ends, len(graph.places)):
        for rows in _cut(circuit, len(graph.pieces)):
            walk = _joined([_turned(graph.pieces[row], back) for row, back in rows])
            result.append(_turned(walk, walk[-1, 2] < walk[0, 2]))
    return result


def _doubled(graph: Graph, again_mm: float) -> Graph:
    """The graph with a second one of each short piece between two places with an odd number of
    ends; the shortest first, each place once."""
    odd = np.bincount(graph.ends.ravel(), minlength=len(graph.places)) % 2 == 1
    lengths = [float(lengths_of(piece).sum()) for piece in graph.pieces]
    again = []
    for row in sorted(range(len(lengths)), key=lambda row: (lengths[row], row)):
        a, b = graph.ends[row].tolist()
        if lengths[row] <= again_mm and a != b and odd[a] and odd[b]:
            odd[[a, b]] = False
            again.append(row)
    pieces = [*graph.pieces, *(graph.pieces[row] for row in again)]
    return Graph(pieces, np.concatenate([graph.ends, graph.ends[again]]), graph.places)


def lengths_of(path: Floats) -> Floats:
    """(n−1,) lengths in the plane of the lines and arcs of a path (n, 4)."""
    chord = np.hypot(*np.diff(path[:, :2], axis=0).T)
    bulge = path[:-1, 3]
    safe = np.where(bulge != 0.0, bulge, 1.0)
    stretch = np.where(bulge != 0.0, (1.0 + safe**2) * np.arctan(safe) / safe, 1.0)
    return np.asarray(chord * stretch)


def _jumps(graph: Graph) -> Ints:
    """(k, 2) pairs of the places of one component that have an odd number of ends."""
    degree = np.bincount(graph.ends.ravel(), minlength=len(graph.places))
    component = _components(graph)
    odd = np.flatnonzero(degree % 2).tolist()
    pairs = []
    while odd:
        one = odd.pop(0)
        mates = [v for v in odd if component[v] == component[one]]
        apart = graph.places[mates, :2] - graph.places[one, :2]
        mate = mates[int(np.argmin((apart**2).sum(axis=1)))]
        odd.remove(mate)
        pairs.append((one, mate))
    return np.array(pairs, dtype=np.int64).reshape(-1, 2)


def _components(graph: Graph) -> list[int]:
    """The component of each place."""
    root = list(range(len(graph.places)))

    def top(row: int) -> int:
        while root[row] != row:
            root[row] = root[root[row]]
            row = root[row]
        return row

    for a, b in graph.ends.tolist():
        one, other = top(a), top(b)
        root[max(one, other)] = min(one, other)
    return [top(row) for row in range(len(root))]


def _circuits(ends: Ints, count: int) -> Iterator[list[tuple[int, bool]]]:
    """Closed walks (row, backwards) over all edges, one for each component; all degrees even."""
    edges: list[list[int]] = [[] for _ in range(count)]
    for row, (a, b) in enumerate(ends.tolist()):
        edges[a].append(row)
        edges[b].append(row)
    used = [False] * len(ends)
    for start in range(count):
        done: list[tuple[int, bool]] = []
        stack: list[tuple[int, tuple[int, bool] | None]] = [(start, None)]
        while stack:
            place, came = stack[-1]
            while edges[place] and used[edges[place][-1]]:
                edges[place].pop()
            if edges[place]:
                row = edges[place].pop()
                used[row] = True
                a, b = ends[row].tolist()
                stack.append((b, (row, False)) if a == place else (a, (row, True)))
            else:
                stack.pop()
                if came is not None:
                    done.append(came)
        if done:
            yield done[::-1]


def _cut(circuit: list[tuple[int, bool]], count: int) -> list[list[tuple[int, bool]]]:
    """The walks between the jumps (rows from `count` on) of a closed walk."""
    first = next((i for i, (row, _) in enumerate(circuit) if row >= count), None)
    if first is None:
        return [circuit]
    parts: list[list[tuple[int, bool]]] = [[]]
    for row, back in circuit[first + 1 :] + circuit[:first]:
        if row >= count:
            parts.append([])
        else:
            parts[-1].append((row, back))
    return [part for part in parts if part]


def _turned(piece: Floats, back: bool) -> Floats:
    """The piece run backwards: the bulges move to the other ends and change their sign."""
    if not back:
        return piece
    turned = piece[::-1].copy()
    turned[:-1, 3] = 0.0 - piece[-2::-1, 3]
    turned[-1, 3] = 0.0
    return turned


def _joined(pieces: list[Floats]) -> Floats:
    """Pieces that meet, one after the other, as one."""
    rows = [piece[:-1] for piece in pieces]
    return np.concatenate([*rows, pieces[-1][-1:]])
