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
    """(members, path) in order, sizes of closed gaps, and of branches (place, ends, and the
    results that pass one at which the choice matters)."""

    paths: list[tuple[tuple[int, ...], Polyline]]
    gaps: list[float]
    branches: list[tuple[tuple[float, float], int, tuple[int, ...]]]


def chained(paths: list[Polyline], gap: float, groups: list[str], styles: list[str]) -> Result:
    """Compute the result that `chain` must give, literally."""
    oracle = _Oracle(paths, max(gap, POSITION_EPS_MM), groups, styles)
    oracle.pair()
    oracle.split()
    oracle.note_left()
    results: list[tuple[tuple[int, ...], Polyline]] = []
    gaps: list[float] = []
    for members, turned, ring in oracle.walk():
        for of, path, sizes in _assembled(paths, members, turned, ring):
            results.append((of, path))
            gaps.extend(sizes)
    results.extend(((i,), path) for i, path in enumerate(paths) if path.closed)
    results.sort(key=lambda item: min(item[0]))
    return Result(results, gaps, oracle.branches(results))


class _Oracle:
    def __init__(
        self, paths: list[Polyline], reach: float, groups: list[str], styles: list[str]
    ) -> None:
        self.paths, self.reach, self.groups, self.styles = paths, reach, groups, styles
        self.ends = [2 * i + side for i, p in enumerate(paths) if not p.closed for side in (0, 1)]
        self.mate: dict[int, int] = {}
        self.set_of = {i: {i} for i in range(len(paths))}
        self.cluster = {end: end for end in self.ends}
        self.sizes = dict.fromkeys(self.ends, 1)
        self.bridged: set[int] = set()

    def pairs(self, ends: list[int], reach: float) -> list[tuple[int, int]]:
        return [
            (a, b)
            for k, a in enumerate(ends)
            for b in ends[k + 1 :]
            if self.groups[a // 2] == self.groups[b // 2] and self.apart(a, b) <= reach
        ]

    @staticmethod
    def met(pairs: list[tuple[int, int]]) -> dict[int, int]:
        """For each end of the pairs the least end that they connect with it."""
        least = {end: end for pair in pairs for end in pair}
        for _ in least:
            for a, b in pairs:
                least[a] = least[b] = min(least[a], least[b])
        return least

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
        return self.sizes[end]

    def place(self, end: int) -> tuple[float, ...]:
        """Return the sort key of an end, independent of the order of drawing."""
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
        """Exact ends first; then free ends without rivals; then the rest."""
        exact = self.pairs(self.ends, POSITION_EPS_MM)
        self.join_clusters(exact)
        met = {end for pair in exact for end in pair}
        free = [end for end in self.ends if end not in met]
        pairs = [
            (a, b)
            for a, b in self.pairs(free, self.reach)
            if a // 2 != b // 2 or self.encloses({a // 2})
        ]
        if self.reach > POSITION_EPS_MM:
            self.join_clear(pairs)

    def join_clear(self, pairs: list[tuple[int, int]]) -> None:
        scales = [self.reach]
        while pairs and scales[-1] > min(self.apart(*pair) for pair in pairs) > 0:
            scales.append(scales[-1] / CLASS_RATIO)
        for scale in reversed(scales):
            least = self.met([p for p in pairs if self.apart(*p) <= CLASS_RATIO * scale])
            members = list(least.values())
            clear = [
                (a, b)
                for a, b in pairs
                if self.apart(a, b) <= scale and members.count(least[a]) == 2
            ]
            self.join(clear)
            pairs = [
                (a, b)
                for a, b in pairs
                if (a, b) not in clear and a not in self.mate and b not in self.mate
            ]
        before = {end for end in self.ends if self.sizes[end] > 2}
        self.join_clusters(pairs)
        self.bridged = {end for end in self.ends if self.sizes[end] > 2} - before

    def note_left(self) -> None:
        """Free ends near ends that are joined exactly: one of them may have been meant."""
        exact = self.pairs(self.ends, POSITION_EPS_MM)
        met = {end for pair in exact for end in pair}
        free = {
            end
            for end in self.ends
            if end not in met and end not in self.mate and self.sizes[end] <= 2
        }
        pairs = list(exact)
        for a, b in self.pairs(self.ends, self.reach):
            if (a in free) == (b in free) or (a // 2 == b // 2 and not self.encloses({a // 2})):
                continue
            pairs.append((a, b))
            there = b if a in free else a
            if there in self.mate:
                pairs.append((there, self.mate[there]))
        least = self.met(pairs)
        members = list(least.values())
        for end, label in least.items():
            if members.count(label) > 2 and any(least.get(e) == label for e in free):
                self.cluster[end] = label + 2 * len(self.paths)
                self.sizes[end] = members.count(label)
                self.bridged.add(end)

    def join_clusters(self, pairs: list[tuple[int, int]]) -> None:
        least = self.met(pairs)
        members = list(least.values())
        for end, label in least.items():
            self.cluster[end], self.sizes[end] = label, members.count(label)
        simple = [pair for pair in pairs if self.sizes[pair[0]] == 2]
        hard = [pair for pair in pairs if self.sizes[pair[0]] > 2]
        self.join([*sorted(simple), *sorted(hard, key=self.rank)])

    def join(self, pairs: list[tuple[int, int]]) -> None:
        for a, b in pairs:
            if a in self.mate or b in self.mate:
                continue
            one, other = self.set_of[a // 2], self.set_of[b // 2]
            if one is other and not self.encloses(one):
                continue
            both = one | other
            for path in both:
                self.set_of[path] = both
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

    def is_plain(self, end: int, results: list[tuple[tuple[int, ...], Polyline]]) -> bool:
        """True for an end at an exact branch that belongs to a ring, or to a stroke to nowhere."""
        if end in self.bridged:
            return False
        of, path = next(each for each in results if end // 2 in each[0])
        if end in self.mate:
            return path.closed
        met = {e for pair in self.pairs(self.ends, POSITION_EPS_MM) for e in pair}
        ends = {2 * i + side for i in of for side in (0, 1)} - set(self.mate)
        return not ends <= met

    def branches(
        self, results: list[tuple[tuple[int, ...], Polyline]]
    ) -> list[tuple[tuple[float, float], int, tuple[int, ...]]]:
        found = {}
        for end in sorted(self.ends, key=self.place):
            if self.size(end) > 2 and self.cluster[end] not in found:
                here = [e for e in self.ends if self.cluster[e] == self.cluster[end]]
                passing = {k for k, (of, _) in enumerate(results) for e in here if e // 2 in of}
                matters = not all(self.is_plain(e, results) for e in here)
                x, y = self.point(end).tolist()
                found[self.cluster[end]] = (
                    (x, y),
                    self.size(end),
                    tuple(sorted(passing)) if matters else (),
                )
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
