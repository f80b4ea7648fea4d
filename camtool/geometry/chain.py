"""Open paths joined end to end: drawings give contours as loose lines and arcs.

    ends ──tree──▶ pairs of ends within the gap ──nearest first──▶ joints ──walk──▶ chains

Each end takes part in one joint only. A joint moves a line to meet its neighbour (both lines to
the middle); arcs stay exact, and two arcs with a gap get a short line between them.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.drawing import Gap
from camtool.geometry.measure import length, signed_area
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Polyline, Polylines
from camtool.geometry.transform import reverse

NEAR_GAPS = 100.0
"""An end that stays open is reported when another end is nearer than this many times the gap."""


@dataclass(frozen=True, eq=False)
class Chained:
    """Paths after chaining; `members[i]` are the input paths that became path i, in order.

    `closed_gaps`: every gap above `POSITION_EPS_MM` that was bridged. `open_gaps`: for paths that
    stay open, the nearest other open end (or the own other one), when it is near.
    """

    lines: Polylines
    members: tuple[tuple[int, ...], ...]
    closed_gaps: tuple[Gap, ...]
    open_gaps: tuple[Gap, ...]


@dataclass(frozen=True)
class _Chain:
    """Pieces in order; `ring` when the last end is joined to the first one."""

    members: tuple[int, ...]
    turned: tuple[bool, ...]
    ring: bool


def chain(lines: Polylines, gap_mm: float, groups: Sequence[Hashable] | None = None) -> Chained:
    """Open paths joined where their ends lie within `gap_mm`, nearest ends first.

    Paths of different groups (layers) are never joined. A chain whose own ends meet becomes
    closed, unless nothing would lie inside (a line and its double). Closed paths stay as they
    are. Results stand in the order of their first members, travelled as the first one drawn.
    GeometryError when the gap is negative or not finite, or groups do not fit the paths.
    """
    if not (np.isfinite(gap_mm) and gap_mm >= 0.0):
        raise GeometryError(f"a gap of {gap_mm} mm is not 0 or more")
    if groups is not None and len(groups) != len(lines):
        raise GeometryError(f"{len(groups)} groups for {len(lines)} paths")
    paths = list(lines)
    keys: Sequence[Hashable] = [""] * len(paths) if groups is None else groups
    mates = _mates(paths, max(gap_mm, POSITION_EPS_MM), keys)
    results: list[tuple[tuple[int, ...], Polyline]] = []
    closed_gaps: list[Gap] = []
    for each in _walk(paths, mates):
        layer = str(keys[each.members[0]])
        for of, path, gaps in _assembled(each, paths):
            results.append((of, path))
            closed_gaps.extend(Gap(at, size, layer) for at, size in gaps)
    results.sort(key=lambda item: min(item[0]))
    members = tuple(item[0] for item in results)
    joined = [item[1] for item in results]
    open_gaps = _open_gaps(joined, [keys[of[0]] for of in members], gap_mm)
    return Chained(Polylines.of(joined), members, tuple(closed_gaps), tuple(open_gaps))


def _mates(paths: list[Polyline], reach: float, keys: Sequence[Hashable]) -> Ints:
    """(2M,) for end 2i (the start of path i) and 2i + 1 (its end) the end it is joined to, or −1.

    Nearest pairs first; equal distances in the order of the paths.
    """
    mates = np.full(2 * len(paths), -1, dtype=np.int64)
    chains = _Chains(paths)
    pairs = [pair for ends in _ends_by_group(paths, keys) for pair in _near_pairs(*ends, reach)]
    for _, one, other in sorted(pairs):
        if mates[one] < 0 and mates[other] < 0 and chains.join(one // 2, other // 2):
            mates[one], mates[other] = other, one
    return mates


def _ends_by_group(paths: list[Polyline], keys: Sequence[Hashable]) -> list[tuple[Ints, Floats]]:
    """For each group, the numbers of its open ends and their points (E, 2)."""
    groups: dict[Hashable, list[int]] = {}
    for index, path in enumerate(paths):
        if not path.closed:
            groups.setdefault(keys[index], []).append(index)
    return [
        (
            np.array([2 * i + side for i in group for side in (0, 1)], dtype=np.int64),
            np.array([point for i in group for point in (paths[i].start, paths[i].end)]),
        )
        for group in groups.values()
    ]


def _near_pairs(ends: Ints, points: Floats, reach: float) -> Iterator[tuple[float, int, int]]:
    """(distance, end, other end) of all ends within `reach` of each other."""
    import shapely

    shapes = shapely.points(points)
    one, other = shapely.STRtree(shapes).query(shapes, predicate="dwithin", distance=reach)
    one, other = one[one < other], other[one < other]
    distance = np.hypot(*(points[one] - points[other]).T)
    return zip(distance.tolist(), ends[one].tolist(), ends[other].tolist(), strict=True)


class _Chains:
    """Which paths are joined already (union-find), with what is needed to refuse empty rings."""

    def __init__(self, paths: list[Polyline]) -> None:
        self._above = list(range(len(paths)))
        self._segments = [len(path) for path in paths]
        self._arcs = [int(np.count_nonzero(path.vertices[:, 2])) for path in paths]

    def join(self, one: int, other: int) -> bool:
        """Joins the chains of two paths; False when that would close a ring around nothing."""
        a, b = self._top(one), self._top(other)
        if a == b:
            return self._segments[a] > 2 or (self._segments[a] == 2 and self._arcs[a] > 0)
        self._above[b] = a
        self._segments[a] += self._segments[b]
        self._arcs[a] += self._arcs[b]
        return True

    def _top(self, path: int) -> int:
        while self._above[path] != path:
            self._above[path] = self._above[self._above[path]]
            path = self._above[path]
        return path


def _walk(paths: list[Polyline], mates: Ints) -> Iterator[_Chain]:
    """The chains that the joints make, each begun at its first path, which is not turned."""
    seen = np.zeros(len(paths), dtype=np.bool_)
    for index in range(len(paths)):
        if seen[index]:
            continue
        after, ring = _follow(mates, 2 * index + 1)
        before = [] if ring else _follow(mates, 2 * index)[0]
        # Walking back, pieces come last first and are met at their far ends.
        entries = [end ^ 1 for end in reversed(before)] + [2 * index] + after
        members = tuple(end // 2 for end in entries)
        seen[list(members)] = True
        yield _Chain(members, tuple(end % 2 == 1 for end in entries), ring)


def _follow(mates: Ints, end: int) -> tuple[list[int], bool]:
    """The ends by which the following pieces are entered, and whether that leads back."""
    origin = end ^ 1
    entries: list[int] = []
    while mates[end] >= 0:
        entry = int(mates[end])
        if entry == origin:
            return entries, True
        entries.append(entry)
        end = entry ^ 1
    return entries, False


_Bridged = list[tuple[tuple[float, float], float]]


def _assembled(
    each: _Chain, paths: list[Polyline]
) -> Iterator[tuple[tuple[int, ...], Polyline, _Bridged]]:
    """The joined path; if joining leaves no path (all is shorter than the gap), the pieces."""
    pieces = [
        reverse(paths[index]) if turned else paths[index]
        for index, turned in zip(each.members, each.turned, strict=True)
    ]
    if len(pieces) == 1 and not each.ring:
        yield each.members, pieces[0], []
        return
    for ring in (True, False) if each.ring else (False,):
        path, gaps = _joined(pieces, ring)
        if path is not None:
            yield each.members, path, gaps
            return
    for index in each.members:
        yield (index,), paths[index], []


def _joined(pieces: list[Polyline], ring: bool) -> tuple[Polyline | None, _Bridged]:
    """One path through all pieces, or None when nothing is left of it; and the gaps bridged."""
    gaps: _Bridged = []
    vertices = pieces[0].vertices.copy()
    for piece in pieces[1:]:
        head, tail = _bridge(vertices, piece.vertices.copy(), gaps)
        vertices = np.concatenate([head, tail])
    if ring:
        # The last vertex meets the first: bridge the path to itself, and take what has moved.
        head, tail = _bridge(vertices, vertices.copy(), gaps)
        head[0, :2] = tail[0, :2]
        vertices = head
    cleaned = _without_short(vertices, ring)
    if len(cleaned) < 2:
        return None, []
    path = Polyline(cleaned, ring)
    if ring and abs(signed_area(path)) <= POSITION_EPS_MM * length(path):
        return None, []
    return path, gaps


def _bridge(head: Floats, tail: Floats, gaps: _Bridged) -> tuple[Floats, Floats]:
    """`head` without its last vertex and `tail`, so moved or extended that they meet."""
    end, begin = head[-1, :2].copy(), tail[0, :2].copy()
    size = float(np.hypot(*(end - begin)))
    middle = 0.5 * (end + begin)
    arc_before, arc_after = bool(head[-2, 2]), bool(tail[0, 2])
    if size > POSITION_EPS_MM:
        gaps.append(((float(middle[0]), float(middle[1])), size))
        if arc_before and arc_after:
            return head, tail
    if arc_before and not arc_after:
        tail[0, :2] = end
    elif not arc_before and not arc_after:
        tail[0, :2] = middle
    return head[:-1], tail


def _without_short(vertices: Floats, ring: bool) -> Floats:
    """Vertices without those that moved lines have left on top of each other."""
    while len(vertices) > 1:
        step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
        keep = np.hypot(step[:, 0], step[:, 1]) > POSITION_EPS_MM
        if not ring:
            keep[-1] = True
        if keep.all():
            break
        vertices = vertices[keep]
    return vertices


def _open_gaps(paths: list[Polyline], keys: Sequence[Hashable], gap_mm: float) -> list[Gap]:
    """For each path that is open, the nearest other open end, each pair of ends once."""
    reach = NEAR_GAPS * max(gap_mm, POSITION_EPS_MM)
    gaps: dict[tuple[int, int], Gap] = {}
    for ends, points in _ends_by_group(paths, keys):
        nearest: dict[int, tuple[float, int, int]] = {}
        for size, a, b in _nearest_ends(points, reach):
            path = int(ends[a]) // 2
            only_line = path == int(ends[b]) // 2 and len(paths[path]) == 1
            if not only_line:
                nearest[path] = min(nearest.get(path, (np.inf, 0, 0)), (size, a, b))
        for path, (size, a, b) in nearest.items():
            x, y = (0.5 * (points[a] + points[b])).tolist()
            pair = (int(min(ends[a], ends[b])), int(max(ends[a], ends[b])))
            gaps.setdefault(pair, Gap((x, y), size, str(keys[path])))
    return list(gaps.values())


def _nearest_ends(points: Floats, reach: float) -> Iterator[tuple[float, int, int]]:
    """(distance, row, row of the nearest other point) of all points that have one in reach."""
    import shapely

    shapes = shapely.points(points)
    (one, other), distance = shapely.STRtree(shapes).query_nearest(
        shapes, max_distance=reach, exclusive=True, return_distance=True, all_matches=False
    )
    return zip(distance.tolist(), one.tolist(), other.tolist(), strict=True)
