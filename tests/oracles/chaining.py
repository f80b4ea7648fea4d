"""The literal oracle of camtool.geometry.chain: every pair of ends, one path at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.chain import CLASS_RATIO, SAME_TURN_RAD
from camtool.geometry.measure import length, signed_area
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, reverse


@dataclass(frozen=True)
class Result:
    """(members, path) in order, sizes of closed gaps, and (place, ends) of branches."""

    paths: list[tuple[tuple[int, ...], Polyline]]
    gaps: list[float]
    branches: list[tuple[tuple[float, float], int]]


def chained(paths: list[Polyline], gap: float, groups: list[str], styles: list[str]) -> Result:
    """What `chain` must give."""
    oracle = _Oracle(paths, max(gap, POSITION_EPS_MM), groups, styles)
    oracle.pair()
    oracle.split()
    results: list[tuple[tuple[int, ...], Polyline]] = []
    gaps: list[float] = []
    for members, turned, ring in oracle.walk():
        for of, path, sizes in _assembled(paths, members, turned, ring):
            results.append((of, path))
            gaps.extend(sizes)
    results.extend(((i,), path) for i, path in enumerate(paths) if path.closed)
    results.sort(key=lambda item: min(item[0]))
    return Result(results, gaps, oracle.branches())


class _Oracle:
    def __init__(
        self, paths: list[Polyline], reach: float, groups: list[str], styles: list[str]
    ) -> None:
        self.paths, self.reach, self.groups, self.styles = paths, reach, groups, styles
        self.ends = [2 * i + side for i, p in enumerate(paths) if not p.closed for side in (0, 1)]
        self.mate: dict[int, int] = {}
        self.near = [
            (a, b)
            for k, a in enumerate(self.ends)
            for b in self.ends[k + 1 :]
            if groups[a // 2] == groups[b // 2] and self.apart(a, b) <= reach
        ]
        self.cluster = {end: end for end in self.ends}
        for _ in self.ends:
            for a, b in self.near:
                least = min(self.cluster[a], self.cluster[b])
                self.cluster[a] = self.cluster[b] = least

    def point(self, end: int) -> Floats:
        path = self.paths[end // 2]
        return path.vertices[-1 if end % 2 else 0, :2]

    def apart(self, a: int, b: int) -> float:
        return math.hypot(*(self.point(a) - self.point(b)))

    def leaving(self, end: int) -> float:
        """The direction in which the path would go on beyond this end."""
        path = self.paths[end // 2]
        path = path if end % 2 else reverse(path)
        (x0, y0, bulge), (x1, y1, _) = path.vertices[-2], path.vertices[-1]
        return math.atan2(y1 - y0, x1 - x0) + 2.0 * math.atan(bulge)

    def size(self, end: int) -> int:
        return sum(self.cluster[other] == self.cluster[end] for other in self.ends)

    def place(self, end: int) -> tuple[float, ...]:
        """Where an end comes in an order that has nothing to do with the order of drawing."""
        grid = [round(v / POSITION_EPS_MM) for e in (end, end ^ 1) for v in self.point(e)]
        angle = (self.leaving(end) + math.pi) % (2.0 * math.pi) - math.pi
        return (*grid, round(angle / SAME_TURN_RAD), end)

    def rank(self, pair: tuple[int, int]) -> tuple[object, ...]:
        """Pairs at branches: nearest class, same style, straightest, then place."""
        a, b = pair
        apart = self.apart(a, b)
        steps = math.log(apart / POSITION_EPS_MM) / math.log(CLASS_RATIO) if apart else -1.0
        turn = self.leaving(a) - self.leaving(b) - math.pi
        turn = abs((turn + math.pi) % (2.0 * math.pi) - math.pi)
        unlike = self.styles[a // 2] != self.styles[b // 2]
        places = sorted([self.place(a), self.place(b)])
        return (max(math.floor(steps), -1), unlike, round(turn / SAME_TURN_RAD), *places)

    def pair(self) -> None:
        simple = [pair for pair in self.near if self.size(pair[0]) == 2]
        hard = [pair for pair in self.near if self.size(pair[0]) > 2]
        set_of = {i: {i} for i in range(len(self.paths))}
        for a, b in [*sorted(simple), *sorted(hard, key=self.rank)]:
            if a in self.mate or b in self.mate:
                continue
            one, other = set_of[a // 2], set_of[b // 2]
            if one is other and not self.encloses(one):
                continue
            both = one | other
            for path in both:
                set_of[path] = both
            self.mate[a], self.mate[b] = b, a

    def encloses(self, members: set[int]) -> bool:
        segments = sum(len(self.paths[i]) for i in members)
        arcs = sum(int(np.count_nonzero(self.paths[i].vertices[:, 2])) for i in members)
        return segments > 2 or (segments == 2 and arcs > 0)

    def ring(self, start: int) -> list[int] | None:
        """The ends by which the paths of a ring are entered, from this one; None if it is open."""
        entries, end = [start], self.mate.get(start ^ 1)
        while end is not None and end != start:
            entries.append(end)
            end = self.mate.get(end ^ 1)
        return None if end is None else entries

    def split(self) -> None:
        """Rings that pass a branch twice fall apart there."""
        branch_ends = [end for end in self.ends if self.size(end) > 2]
        done: set[int] = set()
        for start in sorted(branch_ends, key=self.place):
            entries = self.ring(start)
            if entries is None or start // 2 in done:
                continue
            done.update(end // 2 for end in entries)
            self.split_ring(entries)

    def split_ring(self, entries: list[int]) -> None:
        rest = {end // 2 for end in entries}
        last = entries[-1] ^ 1
        stack: list[int] = []
        for end in entries:
            k = next(
                (
                    k
                    for k in reversed(range(len(stack)))
                    if self.size(end) > 2 and self.cluster[stack[k]] == self.cluster[end]
                ),
                None,
            )
            if k is not None:
                begin, close = stack[k], stack[-1] ^ 1
                before = last if k == 0 else stack[k - 1] ^ 1
                loop = {e // 2 for e in stack[k:]}
                if (
                    self.encloses(loop)
                    and self.encloses(rest - loop)
                    and self.apart(begin, close) <= self.reach
                    and self.apart(before, end) <= self.reach
                ):
                    self.mate.update({begin: close, close: begin, before: end, end: before})
                    rest -= loop
                    del stack[k:]
            stack.append(end)

    def walk(self) -> list[tuple[list[int], list[bool], bool]]:
        seen: set[int] = set()
        chains = []
        for index, path in enumerate(self.paths):
            if path.closed or index in seen:
                continue
            entries = self.ring(2 * index)
            is_ring = entries is not None
            if entries is None:
                first = 2 * index
                while first in self.mate:
                    first = self.mate[first] ^ 1
                entries = [first]
                while entries[-1] ^ 1 in self.mate:
                    entries.append(self.mate[entries[-1] ^ 1])
            seen.update(end // 2 for end in entries)
            chains.append(
                ([end // 2 for end in entries], [end % 2 == 1 for end in entries], is_ring)
            )
        return chains

    def branches(self) -> list[tuple[tuple[float, float], int]]:
        found = {}
        for end in sorted(self.ends, key=self.place):
            if self.size(end) > 2:
                x, y = self.point(end).tolist()
                found.setdefault(self.cluster[end], ((x, y), self.size(end)))
        return sorted(found.values())


def _assembled(
    paths: list[Polyline], members: list[int], turned: list[bool], ring: bool
) -> list[tuple[tuple[int, ...], Polyline, list[float]]]:
    """The joined path; if joining leaves no path (all is shorter than the gap), the pieces."""
    pieces = [
        reverse(paths[i]) if turn else paths[i] for i, turn in zip(members, turned, strict=True)
    ]
    for closed in (True, False) if ring else (False,):
        path, gaps = _joined(pieces, closed)
        if path is not None:
            return [(tuple(members), path, gaps)]
    return [((i,), paths[i], []) for i in members]


def _joined(pieces: list[Polyline], ring: bool) -> tuple[Polyline | None, list[float]]:
    gaps: list[float] = []
    vertices = pieces[0].vertices.copy()
    for piece in pieces[1:]:
        head, tail = _bridge(vertices, piece.vertices.copy(), gaps)
        vertices = np.concatenate([head, tail])
    if ring:
        head, tail = _bridge(vertices, vertices.copy(), gaps)
        head[0, :2] = tail[0, :2]
        vertices = head
    while len(vertices) > 1:
        step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
        keep = np.hypot(step[:, 0], step[:, 1]) > POSITION_EPS_MM
        keep[-1] |= not ring
        if keep.all():
            break
        vertices = vertices[keep]
    if len(vertices) < 2:
        return None, []
    path = Polyline(vertices, ring)
    if ring and abs(signed_area(path)) <= POSITION_EPS_MM * length(path):
        return None, []
    return path, gaps


def _bridge(head: Floats, tail: Floats, gaps: list[float]) -> tuple[Floats, Floats]:
    """`head` without its last vertex and `tail`, so moved or extended that they meet."""
    end, begin = head[-1, :2].copy(), tail[0, :2].copy()
    size = float(np.hypot(*(end - begin)))
    arc_before, arc_after = bool(head[-2, 2]), bool(tail[0, 2])
    if size > POSITION_EPS_MM:
        gaps.append(size)
        if arc_before and arc_after:
            return head, tail
    if arc_before and not arc_after:
        tail[0, :2] = end
    elif not arc_before and not arc_after:
        tail[0, :2] = 0.5 * (end + begin)
    return head[:-1], tail


def nearest_other(points: Floats, least: float, reach: float) -> list[float]:
    """For each point the distance of the nearest one farther than `least`; inf for none."""
    found = []
    for i, (x, y) in enumerate(points.tolist()):
        apart = [math.hypot(x - u, y - v) for j, (u, v) in enumerate(points.tolist()) if j != i]
        found.append(min((d for d in apart if least < d <= reach), default=math.inf))
    return found
