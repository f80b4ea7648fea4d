"""Paths that clear a pocket: rings or a zigzag, slots, and the links between strokes.

    tool centre region ──rings from the inside outwards──▶ strokes ┐
                       ──straight lines at an angle──────▶ strokes ┴──linked──▶ path

The tool centre region is the pocket shrunk by the tool's radius. Nothing of the pocket is
left over: `ring_cells` and `zigzag_paths` say why. Links (`route`) never leave the region."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Floats, Ints, distinct, distinct_rows
from camtool.geometry.boxes import IndexedCurves
from camtool.geometry.distance import nearest, points_to_segments
from camtool.geometry.intersect import crossings
from camtool.geometry.measure import (
    extents,
    length,
    point_at,
    sample,
    segment_lengths,
    signed_areas,
)
from camtool.geometry.nesting import inside
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse,
    rotate,
)
from camtool.kernels.offsets import TA, meetings_of, pairs_of
from camtool.planning.paths import MeasuredPath, MeasuredPaths, join_paths, midpoints, true_ranges

SHORTER = (0.95, 0.9, 0.85, 0.8)
"""Shares of the step that are tried in turn where it leaves tips: rings alone make a smoother
path."""

MAX_MARGIN_SHARE = 0.5
"""The largest distance that is left for the ring along the walls, over the tool's radius."""

SLOT_TOLERANCE = 1e-3
"""A slot narrower than the tool by up to this part of its diameter counts as wide as the tool."""

HAIRS = (1e-5, 1e-4, 3e-4, SLOT_TOLERANCE)
"""Shares of the diameter by which the tool is taken thinner, tried in turn."""

ALL_OF_IT = 0.98
"""The thinnest hair is used with which the slots are at least this share as long as with
SLOT_TOLERANCE."""

BEYOND = 3.0
"""Distance of a slot's beginning from the region of the true tool, in hairs: sharp corners extend
outwards."""

MIN_SLOT_SHARE = 0.5
"""The shortest perimeter of a band that counts as a slot, over the tool's diameter."""

BAND_PLACES = 200
"""Number of places at which a band is measured."""

ON_LINE_MM = 5e-6
"""A place this near to the boundary of a region is still inside it."""

LINKS_AT_ONCE = 1 << 10
"""Number of links that are compared with the boundary of their region at a time."""

POLE_SHARE = 0.01
"""Tolerance for the pole of a region, over the extent of the region."""


class Cell(Struct, eq=False):
    """A connected tool centre region; the regions into which it splits when shrunk by a step
    (`inner`); the tips between it and these; and how many times it can be shrunk (`height`)."""

    region: ConnectedRegion
    inner: list[Cell] = field(default_factory=list)
    tips: list[Polyline] = field(default_factory=list)
    height: int = 0


class Steps(Struct, frozen=True):
    """The distance of the rings and the radius of the tool, mm. `forward`: rings run as they are
    oriented (the region on their left), not reversed. `from_pole`: the first ring begins as near
    as possible to the pole of its region, where a helix goes down."""

    step_mm: float
    radius_mm: float
    forward: bool = True
    from_pole: bool = False


def ring_cells(region: Polylines, steps: Steps) -> Cell:
    """Return the tree of regions of one connected tool centre region.

    The region is shrunk again and again by the step s, and each boundary is a ring. What lies
    between two rings is nearer than s to the outer one; so for s up to the tool's radius r nothing
    is left over, whatever the shape. For a longer step the tool would miss what is farther than r
    both from the outer ring and from all that lies within the inner one. There it also follows the
    boundary of the region shrunk by r, as far as that is farther than r from the inner ring: the
    *tips*. They reach into corners and cores. Regions fall apart as they shrink: they form a tree.
    """
    root = Cell(ConnectedRegion(region))
    waiting, order = [root], []
    while waiting:
        cell = waiting.pop()
        order.append(cell)
        shrunk, cell.tips = _next_ring(cell.region.boundary, steps)
        cell.inner = [Cell(ConnectedRegion(part)) for part in parts_of(shrunk)]
        waiting += cell.inner
    for cell in reversed(order):
        cell.height = 1 + max((each.height for each in cell.inner), default=0)
    return root


def _next_ring(region: Polylines, steps: Steps) -> tuple[Polylines, list[Polyline]]:
    """Return the region shrunk by a step, and the tips. A shorter step is taken if no tips are
    needed then."""
    shrunk = offset_shape(region, steps.step_mm)
    if steps.step_mm <= steps.radius_mm + POSITION_EPS_MM:
        return shrunk, []
    core = offset_shape(region, steps.radius_mm)
    tips = _tips(core, shrunk, steps)
    if all(path.closed for path in tips):
        return shrunk, tips
    for part in SHORTER:
        nearer = offset_shape(region, max(part * steps.step_mm, steps.radius_mm))
        if not _tips(core, nearer, steps):
            return nearer, []
    return shrunk, tips


def _tips(core: Polylines, shrunk: Polylines, steps: Steps) -> list[Polyline]:
    """Return the parts of the boundary of `core` (the region shrunk by the tool's radius) that the
    tool does not cover from within the next ring."""
    if len(core) == 0 or len(shrunk) == 0:
        return list(core)
    return outside_parts(core, offset_shape(shrunk, -steps.radius_mm))


def ring_paths(root: Cell, steps: Steps) -> tuple[list[Floats], Cell]:
    """Return open paths (n, 3) x, y, bulge over all rings, from the inside out, and the cell in
    which the first begins.

    There is more than one path only where rounding hides the link from one ring to the next
    (`LinkedPath`)."""
    linked = LinkedPath()
    first = None
    for cell, outer_cell in _inside_out(root, linked):
        if first is None:
            first = cell
            linked.begin = pole(cell.region.boundary) if steps.from_pole else None
        paths = (*cell.tips, *cell.region.boundary)
        linked.cut_all(paths, cell.region, outer_cell.region, steps.forward)
    return linked.paths(), first or root


def _inside_out(root: Cell, linked: LinkedPath) -> Iterator[tuple[Cell, Cell]]:
    """Yield all cells, each after its inner ones, together with the outer cell through which the
    tool can reach it.

    The first is the one with the greatest height; later the cell nearest to the end of the path so
    far (`linked`, which the caller extends meanwhile)."""
    stack = [(root, list(root.inner))]
    outer_cell: Cell | None = None
    while stack:
        cell, remaining = stack[-1]
        if not remaining:
            stack.pop()
            yield cell, outer_cell or cell
            outer_cell = None
            continue
        outer_cell = outer_cell or cell
        next_cell = remaining.pop(_pick(remaining, linked.end_place))
        stack.append((next_cell, list(next_cell.inner)))


def _pick(cells: list[Cell], tool_place: Floats | None) -> int:
    """Return the index of the cell nearest to the tool; of the cell with the greatest height if
    the tool has no place yet."""
    if tool_place is None:
        return max(range(len(cells)), key=lambda row: (cells[row].height, -row))
    distances = [
        min(closest(along, tool_place)[0] for along in cell.region.paths) for cell in cells
    ]
    return int(np.argmin(distances))


class Scan(Struct, frozen=True):
    """The distance of the strokes and the radius of the tool, mm, and the angle of the strokes.
    `forward`: rings run as they are oriented (the region on their left), not reversed."""

    step_mm: float
    radius_mm: float
    angle_rad: float
    forward: bool = True


class Strokes(Struct, frozen=True, eq=False):
    """J pieces of parallel lines within one connected region: `row` (J,), the number of the line;
    `ends` (J, 2, 2), mm; `span` (J, 2), the begin and end along the line, mm."""

    row: Ints
    ends: Floats
    span: Floats

    def __len__(self) -> int:
        return len(self.row)


def zigzag_paths(region: Polylines, scan: Scan) -> list[Floats]:
    """Return open paths (n, 3) x, y, bulge over all strokes and rings of one connected region.

    The region is shrunk by a margin m and cut by parallel lines, h apart. Their pieces within it
    are the strokes; then the boundary of the whole region is followed, which takes the margin off
    the walls. Nothing is left over when h/2 + m ≤ r, the tool's radius: the line nearest to a
    place of the shrunk region is no farther than h/2, and if the straight line to it leaves the
    shrunk region, that is within h/2, and so the wall's ring within h/2 + m. Every other place is
    within m of that ring.

    There is more than one path only where rounding hides the link from one stroke to the next
    (`LinkedPath`)."""
    connected, linked = ConnectedRegion(region), LinkedPath()
    margin = min(scan.radius_mm - 0.5 * scan.step_mm, MAX_MARGIN_SHARE * scan.radius_mm)
    for part in parts_of(offset_shape(region, margin)):
        strokes = strokes_of(part, scan)
        order = _order(strokes)
        if not order:
            continue
        ends = np.array([strokes.ends[k, :: -1 if is_backward else 1] for k, is_backward in order])
        cut = [np.column_stack([each, np.zeros(2)]) for each in ends]
        linked.cut(cut[0], connected)
        links = routes(ends[:-1, 1], ends[1:, 0], ConnectedRegion(part))
        for link, stroke in zip(links, cut[1:], strict=True):
            linked.join(link, stroke)
    linked.cut_all(region, connected, connected, scan.forward)
    return linked.paths()


def strokes_of(region: Polylines, scan: Scan) -> Strokes:
    """Return the pieces within a region of equally spaced parallel lines, no farther apart than
    the step."""
    level_region = Polylines.of([rotate(path, -scan.angle_rad) for path in region])
    (left_x, right), (low, high) = extents(level_region).tolist()
    count = max(1, math.ceil((high - low) / scan.step_mm))
    y = low + (np.arange(count) + 0.5) * ((high - low) / count)
    along_lines = np.array([math.cos(scan.angle_rad), math.sin(scan.angle_rad)])
    across = np.array([-along_lines[1], along_lines[0]])
    start = (left_x - scan.step_mm) * along_lines + y[:, None] * across
    end = (right + scan.step_mm) * along_lines + y[:, None] * across
    lines = Segments.between(start, end, np.zeros(count))
    row, begin, stop = scanned(lines, Segments.of(region))
    ends = np.stack([point_at(lines, row, begin), point_at(lines, row, stop)], axis=1)
    return Strokes(row, ends, ends @ along_lines)


def _order(strokes: Strokes) -> list[tuple[int, bool]]:
    """Return the order of all strokes, as (index, True if cut from its end).

    After a stroke comes one beside it, as long as there is one; else the nearest end of any stroke
    with at most one neighbour left, so that no row of strokes is interrupted."""
    neighbours = _neighbours(strokes)
    remaining = set(range(len(strokes)))
    ordered: list[tuple[int, bool]] = []
    onward = 1
    while remaining:
        if not ordered:
            among, tool_place, last = [0], strokes.ends[0, 0], 0
        else:
            last, was_turned = ordered[-1]
            tool_place = strokes.ends[last, 0 if was_turned else 1]
            among = _next(last, onward, strokes, neighbours, remaining)
        distances = np.hypot(*np.moveaxis(strokes.ends[among] - tool_place, 2, 0))
        pick, side = np.unravel_index(int(distances.argmin()), distances.shape)
        next_stroke = among[int(pick)]
        if next_stroke in neighbours[last]:
            onward = int(strokes.row[next_stroke] - strokes.row[last])
        remaining.remove(next_stroke)
        ordered.append((next_stroke, bool(side)))
    return ordered


def _next(
    last: int, onward: int, strokes: Strokes, neighbours: list[list[int]], remaining: set[int]
) -> list[int]:
    """Return the indices of the strokes that may follow the last one; `onward` (1 or −1): the
    direction in which the lines were cut so far, which is kept if possible."""
    candidates = [index for index in neighbours[last] if index in remaining]
    onward_ones = [
        index for index in candidates if strokes.row[index] - strokes.row[last] == onward
    ]
    if candidates:
        return onward_ones or candidates
    ends = [
        index for index in remaining if sum(other in remaining for other in neighbours[index]) <= 1
    ]
    return sorted(ends or remaining)


def _neighbours(strokes: Strokes) -> list[list[int]]:
    """Return, for each stroke, the strokes on the adjacent lines that run beside a part of it."""
    neighbours: list[list[int]] = [[] for _ in range(len(strokes))]
    first = np.searchsorted(strokes.row, np.arange(strokes.row.max(initial=-1) + 3))
    for index, row in enumerate(strokes.row.tolist()):
        low, high = strokes.span[index]
        for other in range(int(first[row + 1]), int(first[row + 2])):
            if strokes.span[other, 0] < high and strokes.span[other, 1] > low:
                neighbours[index].append(other)
                neighbours[other].append(index)
    return neighbours


def slot_paths(region: Polylines, tool_radius_mm: float) -> list[Floats]:
    """Return open paths (n, 3) x, y, bulge along the centre lines of slots as wide as the tool,
    where the tool centre region is a line without area.

    For a slightly thinner tool the tool centre region is a band as thin as the difference
    ("hair"). The part of it beyond the region of the true tool is a slot. Of the hairs that show
    all slots the thinnest is taken, so that the band is as near to the centre line as possible."""
    diameter = 2.0 * tool_radius_mm
    widest = _bands(region, tool_radius_mm, SLOT_TOLERANCE * diameter)
    if not widest:
        return []
    total_mm = sum(length(path) for path in widest)
    for hair in HAIRS:
        bands = _bands(region, tool_radius_mm, hair * diameter)
        if sum(length(path) for path in bands) >= ALL_OF_IT * total_mm:
            break
    paths: list[Polyline] = []
    for band in bands:
        if not _covered(band, paths, BEYOND * hair * diameter):
            paths.append(_along_band(band, BEYOND * hair * diameter))
    return [_without_specks(path.vertices, BEYOND * hair * diameter) for path in paths]


def _bands(region: Polylines, radius: float, hair_mm: float) -> list[Polyline]:
    """Return the edges of the bands: the boundary of the tool centre region of a tool thinner by
    `hair_mm`, outside the true tool's region."""
    thinner = offset_shape(region, radius - hair_mm)
    true = offset_shape(region, radius)
    if len(true):
        edges = outside_parts(thinner, offset_shape(true, -BEYOND * hair_mm))
    else:
        edges = list(thinner)
    return [path for path in edges if length(path) >= 2.0 * MIN_SLOT_SHARE * radius]


def _covered(path: Polyline, other_paths: list[Polyline], near_mm: float) -> bool:
    """Return True if the whole path runs beside others, within `near_mm`: it is the other edge of
    a band."""
    if not other_paths:
        return False
    points = sample(path, length(path) / BAND_PLACES)
    return bool(
        (nearest(points, Segments.of(Polylines.of(other_paths))).distance <= near_mm).all()
    )


def _along_band(band: Polyline, near_mm: float) -> Polyline:
    """Return an open path along a band. If its two edges lie beside each other only one is
    followed; otherwise the path goes all round."""
    if not band.closed:
        return band
    along = MeasuredPath.of(band)
    half = 0.5 * along.total_mm
    lengths = np.arange(BAND_PLACES) / BAND_PLACES * half
    begin = float(lengths[np.hypot(*(along.at(lengths) - along.at(lengths + half)).T).argmax()])
    one = Polyline(along.piece(begin, begin + half))
    other = Polyline(along.piece(begin + half, begin + 2.0 * half))
    if _covered(other, [one], near_mm):
        return one
    return Polyline(along.piece(begin, begin + 2.0 * half))


def _without_specks(vertices: Floats, speck_mm: float) -> Floats:
    """Return an open path (n, 3) without segments as short as a band is wide, since these lead
    across it."""
    step = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    return np.asarray(vertices[np.concatenate([step > speck_mm, [True]])])


class LinkedPath:
    """Collects strokes (k, 3) x, y, bulge, and links each to the one before it at depth."""

    def __init__(self) -> None:
        self.begin: Floats | None = None
        """Best place (2,) for the tool to go down, if there is one."""
        self._parts: list[Floats] = []
        self._done: list[Floats] = []

    @property
    def end_place(self) -> Floats | None:
        """Place of the tool (2,); None before the first stroke."""
        return self._parts[-1][-1, :2] if self._parts else None

    def cut(self, stroke: Floats, region: ConnectedRegion) -> None:
        """Add a stroke, after a link within `region`, which must hold both its ends.

        If rounding hides the link (`route`), the tool comes up and another path begins."""
        tool_place = self.end_place
        self.join(None if tool_place is None else route(tool_place, stroke[0, :2], region), stroke)

    def join(self, link: Floats | None, stroke: Floats) -> None:
        """Add a stroke after its link. Without a link (None) the path so far is finished and
        another begins."""
        if link is not None:
            self._parts.append(link)
        elif self._parts:
            self._done.append(_chained(self._parts))
            self._parts = []
        self._parts.append(stroke)

    def cut_all(
        self,
        paths: Iterable[Polyline],
        region: ConnectedRegion,
        outer_region: ConnectedRegion,
        is_forward: bool,
    ) -> None:
        """Add all paths of a region, each time the nearest one. Closed paths are cut once round
        from their nearest place, as they are oriented or (not `is_forward`) reversed; open ones
        from either end.

        The first is reached through `outer_region`, which contains the region."""
        remaining = [MeasuredPath.of(path) for path in paths]
        while remaining:
            tool_place = self._near(remaining[0].path)
            begins = [_from_nearest(along, tool_place) for along in remaining]
            pick = min(range(len(remaining)), key=lambda row: begins[row][0])
            along, begin = remaining.pop(pick), begins[pick][1]
            if along.path.closed:
                end = begin + (along.total_mm if is_forward else -along.total_mm)
                self.cut(along.piece(begin, end), outer_region)
            else:
                path = along.path if begin == 0.0 else reverse(along.path)
                self.cut(path.vertices, outer_region)
            outer_region = region

    def _near(self, path: Polyline) -> Floats:
        """Return the place from which the next path is reached: the tool's place, or where it
        would go down, or else the start of `path`."""
        if self.end_place is not None:
            return self.end_place
        return path.start if self.begin is None else self.begin

    def paths(self) -> list[Floats]:
        """Return the finished open paths (n, 3); several only where the tool has to come up."""
        return [*self._done, _chained(self._parts)] if self._parts else self._done


def _from_nearest(along: MeasuredPath, place: Floats) -> tuple[float, float]:
    """Return the distance from a place to the nearest point at which a path may begin (any point
    of a closed one, an end of an open one), and the length along the path to that point."""
    if along.path.closed:
        return closest(along, place)
    to_start, to_end = np.hypot(*(along.path.vertices[[0, -1], :2] - place).T).tolist()
    return (to_start, 0.0) if to_start <= to_end else (to_end, along.total_mm)


def _chained(parts: list[Floats]) -> Floats:
    """Return consecutive open paths, each beginning where the one before ends, joined into one."""
    return tidy(join_paths(parts))


class ConnectedRegion(Struct, frozen=True, eq=False, dict=True):
    """A connected region on the left of its closed paths, prepared for links within it."""

    boundary: Polylines

    @cached_property
    def segments(self) -> Segments:
        """All lines and arcs of the boundary."""
        return Segments.of(self.boundary)

    @cached_property
    def paths(self) -> list[MeasuredPath]:
        """The paths of the boundary, measured."""
        return [MeasuredPath.of(path) for path in self.boundary]

    def holds(self, points: Floats) -> Bools:
        """Return the mask (P,) of points (P, 2) within the region or on its boundary."""
        is_inside = inside(points, self.segments)
        not_inside = np.flatnonzero(~is_inside)
        if len(not_inside):
            is_inside[not_inside] = (
                nearest(points[not_inside], self.segments).distance <= ON_LINE_MM
            )
        return is_inside

    def place(self, point: Floats) -> tuple[int, float]:
        """Return the index of the boundary path nearest to a point (2,), and the length along it
        to the nearest place."""
        row = int(points_to_segments(point[None, :], self.segments)[0].argmin())
        path = int(self.segments.path[row])
        first = int(np.searchsorted(self.segments.path, path))
        return path, self.paths[path].reach[row - first] + _length_to(point, self.segments, row)


def closest(along: MeasuredPath, point: Floats) -> tuple[float, float]:
    """Return the distance of a point (2,) from a path, and the length along the path to its
    nearest place."""
    distances = points_to_segments(point[None, :], along.segments)[0]
    row = int(distances.argmin())
    return float(distances[row]), float(along.reach[row]) + _length_to(point, along.segments, row)


def _length_to(point: Floats, segments: Segments, row: int) -> float:
    """Return the length from the start of a segment to its place nearest to a point (2,), mm."""
    one = segments[np.array([row])]
    if one.is_arc[0]:
        # Measured from the midpoint of the arc, no angle is near to half a turn.
        arm = point - one.centre[0]
        midpoint = one.start_angle[0] + 0.5 * one.sweep[0]
        turn = np.arctan2(arm[1], arm[0]) - midpoint
        turn = (turn + np.pi) % (2.0 * np.pi) - np.pi
        part = 0.5 + turn / one.sweep[0]
        length = one.radius[0] * abs(one.sweep[0])
    else:
        chord = one.end[0] - one.start[0]
        part = float((point - one.start[0]) @ chord / (chord @ chord))
        length = float(np.hypot(*chord))
    return float(np.clip(part, 0.0, 1.0) * length)


def route(start: Floats, end: Floats, region: ConnectedRegion) -> Floats | None:
    """Return a link (k, 3) x, y, bulge between two places (2,) of a connected region that stays in
    it, as `routes` does."""
    return routes(start[None, :], end[None, :], region)[0]


def routes(starts: Floats, ends: Floats, region: ConnectedRegion) -> list[Floats | None]:
    """Return links (k, 3) x, y, bulge from places (J, 2) of a connected region to others (J, 2),
    which stay in it.

    A straight line leaves a region through one of its paths and comes back through the same one:
    each path has the region on its left and one connected piece of what is not the region on its
    right. So the link goes straight, and where the line is outside it follows that path, in the
    shorter direction.

    None for a link whose line leaves or enters at a place that rounding hides, or whose two places
    are not in one connected region."""
    links: list[Floats | None] = []
    for low in range(0, len(starts), LINKS_AT_ONCE):
        batch = slice(low, low + LINKS_AT_ONCE)
        outside = _outside(starts[batch], ends[batch], region)
        for start, end, parts in zip(starts[batch], ends[batch], outside, strict=True):
            links.append(_linked(start, end, parts, region))
    return links


def _linked(
    start: Floats, end: Floats, outside: list[tuple[float, float]], region: ConnectedRegion
) -> Floats | None:
    """Return one link. `outside`: the parts (from, to) of the straight line that are outside the
    region, in which the boundary is followed. None if a part begins and ends on different boundary
    paths."""
    if np.hypot(*(end - start)) <= POSITION_EPS_MM:
        return np.array([[*start, 0.0]])
    rows = [np.array([[*start, 0.0]])]
    for leave_share, return_share in outside:
        path, begin = region.place(start + leave_share * (end - start))
        other, stop = region.place(start + return_share * (end - start))
        if path != other:
            return None
        rows.append(_along(region.paths[path], begin, stop))
    rows.append(np.array([[*end, 0.0]]))
    return tidy(np.concatenate(rows))


def _outside(
    starts: Floats, ends: Floats, region: ConnectedRegion
) -> list[list[tuple[float, float]]]:
    """Return, for each straight line between places (J, 2) and (J, 2), the parts (from, to) of it
    that are outside the region, in order."""
    outside: list[list[tuple[float, float]]] = [[] for _ in range(len(starts))]
    room = nearest(starts, region.segments).distance
    long_rows = np.flatnonzero(np.hypot(*(ends - starts).T) > room + ON_LINE_MM)
    if not len(long_rows):
        return outside
    lines = Segments.between(starts[long_rows], ends[long_rows], np.zeros(len(long_rows)))
    crossings_found = crossings(lines, region.segments, position_eps_mm=ON_LINE_MM)
    every = np.arange(len(long_rows))
    rows = np.concatenate([every, every, crossings_found.row_a])
    marks = np.concatenate([np.zeros(len(long_rows)), np.ones(len(long_rows)), crossings_found.ta])
    rows, marks = distinct_rows(np.column_stack([rows, marks])).T
    parts = np.flatnonzero(rows[1:] == rows[:-1])  # a part lies between two marks on one line
    line, begin, stop = rows[parts].astype(np.int64), marks[parts], marks[parts + 1]
    is_outside = ~region.holds(point_at(lines, line, 0.5 * (stop + begin)))
    # Adjacent parts are joined.
    goes_on = np.concatenate([[False], is_outside[1:] & is_outside[:-1] & (line[1:] == line[:-1])])
    first = np.flatnonzero(is_outside & ~goes_on)
    last = np.flatnonzero(is_outside & ~np.append(goes_on[1:], False))
    for row, low, high in zip(
        long_rows[line[first]].tolist(), begin[first].tolist(), stop[last].tolist(), strict=True
    ):
        outside[row].append((low, high))
    return outside


def _along(along: MeasuredPath, begin: float, end: float) -> Floats:
    """Return the piece of a closed path between two lengths in the shorter direction."""
    forth = (end - begin) % along.total_mm
    length_back = along.total_mm - forth
    return (
        along.piece(begin, begin + forth)
        if forth <= length_back
        else along.piece(begin, begin - length_back)
    )


def tidy(vertices: Floats) -> Floats:
    """Return the vertices (k, 3) of an open path without steps of up to POSITION_EPS_MM; both ends
    stay in place."""
    step = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    keep: Ints = np.flatnonzero(np.concatenate([step > POSITION_EPS_MM, [True]]))
    vertices_kept = vertices[keep].copy()
    vertices_kept[0, :2] = vertices[0, :2]
    return vertices_kept


def parts_of(lines: Polylines) -> list[Polylines]:
    """Return the connected parts of a region whose paths are oriented already: each outer path
    (CCW) with the holes (CW) directly inside it."""
    if len(lines) == 0:
        return []
    areas = signed_areas(lines)
    outer, holes = np.flatnonzero(areas > 0.0), np.flatnonzero(areas <= 0.0)
    if len(outer) == 1:
        return [lines]
    order = outer[np.argsort(areas[outer], kind="stable")]
    owner = np.full(len(lines), -1, dtype=np.int64)
    for hole in holes.tolist():
        ring = Segments.of(lines[hole])
        points = midpoints(ring)
        for row in order.tolist():
            # Most midpoints, not all: a hole may touch its outer path.
            if 2 * np.count_nonzero(inside(points, Segments.of(lines[row]))) > len(points):
                owner[hole] = row
                break
    return [lines.select([row, *np.flatnonzero(owner == row).tolist()]) for row in outer.tolist()]


def pole(region: Polylines) -> Floats:
    """Return the point (2,) of a connected region that is about farthest from its boundary."""
    import shapely

    outer = int(signed_areas(region).argmax())
    low, high = (
        region[outer].vertices[:, :2].min(axis=0),
        region[outer].vertices[:, :2].max(axis=0),
    )
    fine = max(POLE_SHARE * float(np.hypot(*(high - low))), POSITION_EPS_MM)
    rings = [sample(path, fine) for path in region]
    holes = [ring for row, ring in enumerate(rings) if row != outer and len(ring) > 2]
    circle = shapely.maximum_inscribed_circle(shapely.Polygon(rings[outer], holes), fine)
    return np.asarray(shapely.get_coordinates(circle)[0], dtype=np.float64)


def outside_parts(lines: Polylines, region: Polylines) -> list[Polyline]:
    """Return the parts of paths that lie outside a region (even-odd): open pieces, or
    whole paths."""
    if len(lines) == 0:
        return []
    along, border = MeasuredPaths(lines), Segments.of(region)
    curves, border_curves = (
        IndexedCurves.of(each, margin_mm=POSITION_EPS_MM) for each in (along.segments, border)
    )
    boxes = (curves.boxes, curves.tree, border_curves.boxes, border_curves.tree)
    rows, places = meetings_of(
        curves.rows, border_curves.rows, pairs_of(*boxes, False), POSITION_EPS_MM
    )
    row = rows[:, 0]
    number = along.segments.path[row]
    reach = along.reach[row + number] + places[:, TA] * segment_lengths(along.segments[row])
    marks = [_marks(path, reach[number == index]) for index, path in enumerate(along)]
    middles = [path.at(0.5 * (own[1:] + own[:-1])) for path, own in zip(along, marks, strict=True)]
    outside = ~inside(np.concatenate([np.empty((0, 2)), *middles]), border)
    begins = np.cumsum([len(own) - 1 for own in marks])[:-1]
    return [
        piece
        for path, own, is_outside in zip(along, marks, np.split(outside, begins), strict=True)
        for piece in _runs(path, own, is_outside)
    ]


def _marks(along: MeasuredPath, lengths: Floats) -> Floats:
    """Return these lengths along a path, ascending and each once, and both its ends."""
    every = distinct(np.concatenate([[0.0, along.total_mm], lengths]))
    is_distinct = np.concatenate([[True], np.diff(every) > POSITION_EPS_MM])
    marks: Floats = every[is_distinct]
    marks[-1] = along.total_mm
    return marks


def _runs(along: MeasuredPath, marks: Floats, is_wanted: Bools) -> list[Polyline]:
    """Return the wanted pieces between consecutive marks along a path, adjacent pieces joined."""
    if is_wanted.all():
        return [along.path]
    begin, end = marks[:-1], marks[1:]
    if along.path.closed:
        turn = int(np.argmin(is_wanted))
        is_wanted = np.roll(is_wanted, -turn)
        begin = np.roll(
            np.where(np.arange(len(begin)) < turn, begin + along.total_mm, begin), -turn
        )
        end = np.roll(np.where(np.arange(len(end)) < turn, end + along.total_mm, end), -turn)
    first, last = true_ranges(is_wanted)
    return [
        Polyline(along.piece(low, high))
        for low, high in zip(begin[first].tolist(), end[last - 1].tolist(), strict=True)
    ]


def scanned(line: Segments, region: Segments) -> tuple[Ints, Floats, Floats]:
    """Return the parts of K straight lines that are within a region: rows (J,), and the begin and
    end (J,), (J,) of each part as shares of its line.

    Ascending by row and begin; pieces up to POSITION_EPS_MM are left out."""
    common = crossings(line, region)
    rows = np.concatenate([np.arange(len(line)), np.arange(len(line)), common.row_a])
    part = np.concatenate([np.zeros(len(line)), np.ones(len(line)), common.ta])
    order = np.lexsort([part, rows])
    rows, part = rows[order], part[order]
    same_line = rows[1:] == rows[:-1]
    row, low, high = rows[:-1][same_line], part[:-1][same_line], part[1:][same_line]
    keep = (high - low) * segment_lengths(line)[row] > POSITION_EPS_MM
    row, low, high = row[keep], low[keep], high[keep]
    is_inside = inside(point_at(line, row, 0.5 * (low + high)), region)
    return row[is_inside], low[is_inside], high[is_inside]
