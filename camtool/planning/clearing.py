"""Paths that clear a pocket: rings or a zigzag, slots, and the links between strokes.

    tool centre region ──rings from the inside outwards──▶ strokes ┐
                       ──straight lines at an angle──────▶ strokes ┴──linked──▶ path

The tool centre region is the pocket shrunk by the tool's radius. Nothing of the pocket is
left over: `ring_cells` and `zigzag_paths` say why. Links (`route`) never leave the region.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Floats, Ints
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
from camtool.planning.paths import MeasuredPath, join_paths, midpoints, true_ranges

SHORTER = (0.95, 0.9, 0.85, 0.8)
"""Parts of the step that are tried where it leaves tips: rings alone make a smoother path."""

MAX_MARGIN_SHARE = 0.5
"""The largest distance that is left for the ring along the walls, over the tool's radius."""

SLOT_TOLERANCE = 1e-3
"""A slot narrower than the tool by up to this part of its diameter counts as wide as the tool."""

HAIRS = (1e-5, 1e-4, 3e-4, SLOT_TOLERANCE)
"""Parts of the diameter by which the tool is taken thinner, in turn."""

ALL_OF_IT = 0.98
"""A thinner hair is taken when it shows this part of the length that the tolerance shows."""

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
"""So many links are compared with the boundary of their region together."""

POLE_SHARE = 0.01
"""Tolerance for the pole of a region, over the extent of the region."""


class Cell(Struct, eq=False):
    """A connected tool centre region, the regions that it falls into when shrunk by a step, the
    tips between the two, and how many times it can be shrunk (`height`)."""

    region: ConnectedRegion
    inner: list[Cell] = field(default_factory=list)
    tips: list[Polyline] = field(default_factory=list)
    height: int = 0


class Steps(Struct, frozen=True):
    """Distance of the rings and radius of the tool, mm; whether rings run as they are oriented
    (the region on their left) or reversed; whether the first one begins as near as possible to
    the pole of its region, where a helix goes down."""

    step_mm: float
    radius_mm: float
    forward: bool = True
    from_pole: bool = False


def ring_cells(region: Polylines, steps: Steps) -> Cell:
    """The tree of regions of one connected tool centre region.

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
    """The region shrunk by a step, and the tips; by a shorter step where that saves the tips."""
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
    """Return the parts of the boundary of `core`, the region shrunk by the tool's radius, that the
    tool does not cover from within the next ring."""
    if len(core) == 0 or len(shrunk) == 0:
        return list(core)
    return outside_parts(core, offset_shape(shrunk, -steps.radius_mm))


def ring_paths(root: Cell, steps: Steps) -> tuple[list[Floats], Cell]:
    """(n, 3) x, y, bulge: an open path over all rings, and the cell that it begins in. A region is
    cut after all that came of it.

    Several paths only where rounding hides the link from one ring to the next (`LinkedPath`).
    """
    linked = LinkedPath()
    first = None
    for cell, around in _inside_out(root, linked):
        if first is None:
            first = cell
            linked.begin = pole(cell.region.boundary) if steps.from_pole else None
        paths = (*cell.tips, *cell.region.boundary)
        linked.cut_all(paths, cell.region, around.region, steps.forward)
    return linked.paths(), first or root


def _inside_out(root: Cell, linked: LinkedPath) -> Iterator[tuple[Cell, Cell]]:
    """All cells, each after its inner ones, with the cell in which the tool can come to it.

    The highest first; later the one nearest to the end of the path so far, which grows meanwhile.
    """
    stack = [(root, list(root.inner))]
    around: Cell | None = None
    while stack:
        cell, left = stack[-1]
        if not left:
            stack.pop()
            yield cell, around or cell
            around = None
            continue
        around = around or cell
        chosen = left.pop(_pick(left, linked.here))
        stack.append((chosen, list(chosen.inner)))


def _pick(cells: list[Cell], here: Floats | None) -> int:
    """The cell nearest to a place; the highest when the tool is nowhere yet."""
    if here is None:
        return max(range(len(cells)), key=lambda row: (cells[row].height, -row))
    apart = [min(closest(along, here)[0] for along in cell.region.paths) for cell in cells]
    return int(np.argmin(apart))


class Scan(Struct, frozen=True):
    """Distance of the strokes and radius of the tool, mm, and the angle of the strokes; whether
    the rings run as they are oriented (the region on their left) or reversed."""

    step_mm: float
    radius_mm: float
    angle_rad: float
    forward: bool = True


class Strokes(Struct, frozen=True, eq=False):
    """J pieces of the lines: `row` (J,) of its line, `ends` (J, 2, 2) mm, `span` (J, 2) from and
    to where along its line, mm; all in one connected region."""

    row: Ints
    ends: Floats
    span: Floats

    def __len__(self) -> int:
        return len(self.row)


def zigzag_paths(region: Polylines, scan: Scan) -> list[Floats]:
    """(n, 3) x, y, bulge: an open path over all strokes and rings of one connected region.

    The region is shrunk by a margin m and cut by parallel lines, h apart. Their pieces within it
    are the strokes; then the boundary of the whole region is followed, which takes the margin off
    the walls. Nothing is left over when  h/2 + m ≤ r,  the tool's radius: the line nearest to a
    place of the shrunk region is no farther than h/2, and if the straight line to it leaves the
    shrunk region, that is within h/2, and so the wall's ring within h/2 + m. Every other place is
    within m of that ring.

    Several paths only where rounding hides the link from one stroke to the next (`LinkedPath`).
    """
    whole, linked = ConnectedRegion(region), LinkedPath()
    margin = min(scan.radius_mm - 0.5 * scan.step_mm, MAX_MARGIN_SHARE * scan.radius_mm)
    for part in parts_of(offset_shape(region, margin)):
        strokes = strokes_of(part, scan)
        order = _order(strokes)
        if not order:
            continue
        ends = np.array([strokes.ends[k, :: -1 if turned else 1] for k, turned in order])
        cut = [np.column_stack([each, np.zeros(2)]) for each in ends]
        linked.cut(cut[0], whole)
        links = routes(ends[:-1, 1], ends[1:, 0], ConnectedRegion(part))
        for link, stroke in zip(links, cut[1:], strict=True):
            linked.join(link, stroke)
    linked.cut_all(region, whole, whole, scan.forward)
    return linked.paths()


def strokes_of(region: Polylines, scan: Scan) -> Strokes:
    """The pieces of equally spaced lines, no farther apart than the step, in a region."""
    turned = Polylines.of([rotate(path, -scan.angle_rad) for path in region])
    (left, right), (low, high) = extents(turned).tolist()
    count = max(1, math.ceil((high - low) / scan.step_mm))
    y = low + (np.arange(count) + 0.5) * ((high - low) / count)
    ahead = np.array([math.cos(scan.angle_rad), math.sin(scan.angle_rad)])
    across = np.array([-ahead[1], ahead[0]])
    start = (left - scan.step_mm) * ahead + y[:, None] * across
    end = (right + scan.step_mm) * ahead + y[:, None] * across
    lines = Segments.between(start, end, np.zeros(count))
    row, begin, stop = scanned(lines, Segments.of(region))
    ends = np.stack([point_at(lines, row, begin), point_at(lines, row, stop)], axis=1)
    return Strokes(row, ends, ends @ ahead)


def _order(strokes: Strokes) -> list[tuple[int, bool]]:
    """Every stroke once, each with whether it is cut from its end.

    From a stroke on to one beside it, as long as there is one; else to the nearest end of any
    that has at most one neighbour left, so that no row of strokes is interrupted.
    """
    beside = _neighbours(strokes)
    left = set(range(len(strokes)))
    found: list[tuple[int, bool]] = []
    onward = 1
    while left:
        if not found:
            among, here, last = [0], strokes.ends[0, 0], 0
        else:
            last, was_turned = found[-1]
            here = strokes.ends[last, 0 if was_turned else 1]
            among = _next(last, onward, strokes, beside, left)
        apart = np.hypot(*np.moveaxis(strokes.ends[among] - here, 2, 0))
        pick, side = np.unravel_index(int(apart.argmin()), apart.shape)
        chosen = among[int(pick)]
        if chosen in beside[last]:
            onward = int(strokes.row[chosen] - strokes.row[last])
        left.remove(chosen)
        found.append((chosen, bool(side)))
    return found


def _next(
    last: int, onward: int, strokes: Strokes, beside: list[list[int]], left: set[int]
) -> list[int]:
    """The strokes that may follow the last one, which went on to the next line or the one before
    (`onward` 1 or −1)."""
    near = [index for index in beside[last] if index in left]
    ahead = [index for index in near if strokes.row[index] - strokes.row[last] == onward]
    if near:
        return ahead or near
    ends = [index for index in left if sum(other in left for other in beside[index]) <= 1]
    return sorted(ends or left)


def _neighbours(strokes: Strokes) -> list[list[int]]:
    """For each stroke those of the lines before and behind it that run beside a part of it."""
    beside: list[list[int]] = [[] for _ in range(len(strokes))]
    first = np.searchsorted(strokes.row, np.arange(strokes.row.max(initial=-1) + 3))
    for index, row in enumerate(strokes.row.tolist()):
        low, high = strokes.span[index]
        for other in range(int(first[row + 1]), int(first[row + 2])):
            if strokes.span[other, 0] < high and strokes.span[other, 1] > low:
                beside[index].append(other)
                beside[other].append(index)
    return beside


def slot_paths(region: Polylines, tool_radius_mm: float) -> list[Floats]:
    """(n, 3) x, y, bulge: open paths along the centre lines of slots as wide as the tool, where
    the tool centre region is a line and has no area.

    With a tool thinner by a hair the tool centre region is a band as thin as that hair. What of it
    lies beyond the region of the true tool is a slot. Of the hairs that show all of the slots the
    thinnest is taken, so that the band is as near to the centre line of the slot as possible.
    """
    diameter = 2.0 * tool_radius_mm
    widest = _bands(region, tool_radius_mm, SLOT_TOLERANCE * diameter)
    if not widest:
        return []
    whole = sum(length(path) for path in widest)
    for hair in HAIRS:
        bands = _bands(region, tool_radius_mm, hair * diameter)
        if sum(length(path) for path in bands) >= ALL_OF_IT * whole:
            break
    paths: list[Polyline] = []
    for band in bands:
        if not _covered(band, paths, BEYOND * hair * diameter):
            paths.append(_once(band, BEYOND * hair * diameter))
    return [_without_specks(path.vertices, BEYOND * hair * diameter) for path in paths]


def _bands(region: Polylines, radius: float, hair_mm: float) -> list[Polyline]:
    """The edges of the bands that a tool thinner by a hair shows beyond the true tool's region."""
    thinner = offset_shape(region, radius - hair_mm)
    true = offset_shape(region, radius)
    if len(true):
        edges = outside_parts(thinner, offset_shape(true, -BEYOND * hair_mm))
    else:
        edges = list(thinner)
    return [path for path in edges if length(path) >= 2.0 * MIN_SLOT_SHARE * radius]


def _covered(path: Polyline, others: list[Polyline], near_mm: float) -> bool:
    """True if all of a path runs beside others: it is the other edge of a band."""
    if not others:
        return False
    points = sample(path, length(path) / BAND_PLACES)
    return bool((nearest(points, Segments.of(Polylines.of(others))).distance <= near_mm).all())


def _once(band: Polyline, near_mm: float) -> Polyline:
    """An open path along a band: one side of it where the other one is beside it; else round."""
    if not band.closed:
        return band
    along = MeasuredPath.of(band)
    half = 0.5 * along.total_mm
    at = np.arange(BAND_PLACES) / BAND_PLACES * half
    begin = float(at[np.hypot(*(along.at(at) - along.at(at + half)).T).argmax()])
    one = Polyline(along.piece(begin, begin + half))
    other = Polyline(along.piece(begin + half, begin + 2.0 * half))
    if _covered(other, [one], near_mm):
        return one
    return Polyline(along.piece(begin, begin + 2.0 * half))


def _without_specks(vertices: Floats, speck_mm: float) -> Floats:
    """An open path (n, 3) without segments as short as a band is wide: they lead across it."""
    step = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    return np.asarray(vertices[np.concatenate([step > speck_mm, [True]])])


class LinkedPath:
    """Collects strokes (k, 3) of x, y, bulge; each is linked to the one before it, at depth."""

    def __init__(self) -> None:
        self.begin: Floats | None = None
        """Best place (2,) for the tool to go down, if there is one."""
        self._parts: list[Floats] = []
        self._done: list[Floats] = []

    @property
    def here(self) -> Floats | None:
        """Place of the tool (2,); None before the first stroke."""
        return self._parts[-1][-1, :2] if self._parts else None

    def cut(self, stroke: Floats, region: ConnectedRegion) -> None:
        """A stroke, after a link that stays in a region which holds both places.

        Where rounding hides the link (`route`) the tool comes up: another path begins.
        """
        here = self.here
        self.join(None if here is None else route(here, stroke[0, :2], region), stroke)

    def join(self, link: Floats | None, stroke: Floats) -> None:
        """A stroke after its link; None where there is none."""
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
        around: ConnectedRegion,
        ahead: bool,
    ) -> None:
        """All these paths of a region, each time the nearest: closed ones once round from their
        nearest place, as they are oriented or (not `ahead`) reversed; open ones from either end.

        The first is reached through `around`, which contains the region.
        """
        left = [MeasuredPath.of(path) for path in paths]
        while left:
            here = self._near(left[0].path)
            begins = [_from_nearest(along, here) for along in left]
            pick = min(range(len(left)), key=lambda row: begins[row][0])
            along, begin = left.pop(pick), begins[pick][1]
            if along.path.closed:
                end = begin + (along.total_mm if ahead else -along.total_mm)
                self.cut(along.piece(begin, end), around)
            else:
                path = along.path if begin == 0.0 else reverse(along.path)
                self.cut(path.vertices, around)
            around = region

    def _near(self, path: Polyline) -> Floats:
        """Place of the tool, or where it would go down, or else the start of a path."""
        if self.here is not None:
            return self.here
        return path.start if self.begin is None else self.begin

    def paths(self) -> list[Floats]:
        """(n, 3) open paths; several only where the tool has to come up."""
        return [*self._done, _chained(self._parts)] if self._parts else self._done


def _from_nearest(along: MeasuredPath, here: Floats) -> tuple[float, float]:
    """Distance of a place from where a path may begin, and the length along it to there."""
    if along.path.closed:
        return closest(along, here)
    to_start, to_end = np.hypot(*(along.path.vertices[[0, -1], :2] - here).T).tolist()
    return (to_start, 0.0) if to_start <= to_end else (to_end, along.total_mm)


def _chained(parts: list[Floats]) -> Floats:
    """Open paths, each of which begins where the one before it ends, as one."""
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
        """(P,) true for points (P, 2) in the region or on its boundary."""
        within = inside(points, self.segments)
        beside = np.flatnonzero(~within)
        if len(beside):
            within[beside] = nearest(points[beside], self.segments).distance <= ON_LINE_MM
        return within

    def place(self, point: Floats) -> tuple[int, float]:
        """The path nearest to a point (2,), and the length along it to its nearest place."""
        row = int(points_to_segments(point[None, :], self.segments)[0].argmin())
        path = int(self.segments.path[row])
        first = int(np.searchsorted(self.segments.path, path))
        return path, self.paths[path].reach[row - first] + _length_to(point, self.segments, row)


def closest(along: MeasuredPath, point: Floats) -> tuple[float, float]:
    """Distance of a point (2,) from a path, and the length along it to the nearest place."""
    apart = points_to_segments(point[None, :], along.segments)[0]
    row = int(apart.argmin())
    return float(apart[row]), float(along.reach[row]) + _length_to(point, along.segments, row)


def _length_to(point: Floats, segments: Segments, row: int) -> float:
    """Length along a segment to its place nearest to a point (2,), mm."""
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
    """(k, 3) x, y, bulge from one place (2,) of a connected region to another, staying in it, as
    `routes` has it."""
    return routes(start[None, :], end[None, :], region)[0]


def routes(starts: Floats, ends: Floats, region: ConnectedRegion) -> list[Floats | None]:
    """(k, 3) x, y, bulge each: from places (J, 2) of a connected region to others (J, 2), staying
    in it.

    A straight line leaves a region through one of its paths and comes back through the same one:
    each path has the region on its left and one connected piece of what is not the region on its
    right. So the link goes straight, and where the line is outside it follows that path, in the
    shorter direction.

    None where rounding hides where the straight line goes out or in, or the two places are not in
    one connected region.
    """
    found: list[Floats | None] = []
    for low in range(0, len(starts), LINKS_AT_ONCE):
        some = slice(low, low + LINKS_AT_ONCE)
        outside = _outside(starts[some], ends[some], region)
        for start, end, parts in zip(starts[some], ends[some], outside, strict=True):
            found.append(_linked(start, end, parts, region))
    return found


def _linked(
    start: Floats, end: Floats, outside: list[tuple[float, float]], region: ConnectedRegion
) -> Floats | None:
    """Return one link, of whose straight line these parts are outside of the region."""
    if np.hypot(*(end - start)) <= POSITION_EPS_MM:
        return np.array([[*start, 0.0]])
    rows = [np.array([[*start, 0.0]])]
    for out, back in outside:
        path, begin = region.place(start + out * (end - start))
        other, stop = region.place(start + back * (end - start))
        if path != other:
            return None
        rows.append(_along(region.paths[path], begin, stop))
    rows.append(np.array([[*end, 0.0]]))
    return tidy(np.concatenate(rows))


def _outside(
    starts: Floats, ends: Floats, region: ConnectedRegion
) -> list[list[tuple[float, float]]]:
    """Of each straight line between places (J, 2) and (J, 2) the parts (from, to) that are outside
    of the region, in order."""
    outside: list[list[tuple[float, float]]] = [[] for _ in range(len(starts))]
    room = nearest(starts, region.segments).distance
    far = np.flatnonzero(np.hypot(*(ends - starts).T) > room + ON_LINE_MM)
    if not len(far):
        return outside
    lines = Segments.between(starts[far], ends[far], np.zeros(len(far)))
    found = crossings(lines, region.segments, position_eps_mm=ON_LINE_MM)
    every = np.arange(len(far))
    rows = np.concatenate([every, every, found.row_a])
    marks = np.concatenate([np.zeros(len(far)), np.ones(len(far)), found.ta])
    rows, marks = np.unique(np.column_stack([rows, marks]), axis=0).T
    of = np.flatnonzero(rows[1:] == rows[:-1])  # a part is between two marks of one line
    line, begin, stop = rows[of].astype(np.int64), marks[of], marks[of + 1]
    out = ~region.holds(point_at(lines, line, 0.5 * (stop + begin)))
    # Parts in a row are one.
    goes_on = np.concatenate([[False], out[1:] & out[:-1] & (line[1:] == line[:-1])])
    first = np.flatnonzero(out & ~goes_on)
    last = np.flatnonzero(out & ~np.append(goes_on[1:], False))
    for row, low, high in zip(
        far[line[first]].tolist(), begin[first].tolist(), stop[last].tolist(), strict=True
    ):
        outside[row].append((low, high))
    return outside


def _along(along: MeasuredPath, begin: float, end: float) -> Floats:
    """The piece of a closed path between two lengths, in the shorter direction."""
    forth = (end - begin) % along.total_mm
    back = along.total_mm - forth
    return along.piece(begin, begin + forth) if forth <= back else along.piece(begin, begin - back)


def tidy(vertices: Floats) -> Floats:
    """Vertices (k, 3) of an open path without steps up to POSITION_EPS_MM; both ends stay."""
    step = np.hypot(*np.diff(vertices[:, :2], axis=0).T)
    keep: Ints = np.flatnonzero(np.concatenate([step > POSITION_EPS_MM, [True]]))
    kept = vertices[keep].copy()
    kept[0, :2] = vertices[0, :2]
    return kept


def parts_of(lines: Polylines) -> list[Polylines]:
    """The connected parts of a region whose paths are oriented already: each outer path (CCW) with
    the holes (CW) in it, the smallest outer one around each."""
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
            # Most of them, as a hole may touch its outer path.
            if 2 * np.count_nonzero(inside(points, Segments.of(lines[row]))) > len(points):
                owner[hole] = row
                break
    return [lines.select([row, *np.flatnonzero(owner == row).tolist()]) for row in outer.tolist()]


def pole(region: Polylines) -> Floats:
    """(2,) a place of a connected region about as far from its boundary as any."""
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
    """Return what of the paths lies outside of a region (even-odd): open pieces, or whole
    paths."""
    border = Segments.of(region)
    found: list[Polyline] = []
    for path in lines:
        along = MeasuredPath.of(path)
        marks = _marks(along, border)
        outside = ~inside(along.at(0.5 * (marks[1:] + marks[:-1])), border)
        found += _runs(along, marks, outside)
    return found


def _marks(along: MeasuredPath, border: Segments) -> Floats:
    """The lengths along a path, ascending, where it meets the border, and both its ends."""
    met = crossings(along.segments, border)
    lengths = segment_lengths(along.segments)
    at = along.reach[met.row_a] + met.ta * lengths[met.row_a]
    every = np.unique(np.concatenate([[0.0, along.total_mm], at]))
    apart = np.concatenate([[True], np.diff(every) > POSITION_EPS_MM])
    marks: Floats = every[apart]
    marks[-1] = along.total_mm
    return marks


def _runs(along: MeasuredPath, marks: Floats, wanted: Bools) -> list[Polyline]:
    """The pieces between marks that are wanted, neighbours as one."""
    if wanted.all():
        return [along.path]
    begin, end = marks[:-1], marks[1:]
    if along.path.closed:
        turn = int(np.argmin(wanted))
        wanted = np.roll(wanted, -turn)
        begin = np.roll(
            np.where(np.arange(len(begin)) < turn, begin + along.total_mm, begin), -turn
        )
        end = np.roll(np.where(np.arange(len(end)) < turn, end + along.total_mm, end), -turn)
    first, last = true_ranges(wanted)
    return [
        Polyline(along.piece(low, high))
        for low, high in zip(begin[first].tolist(), end[last - 1].tolist(), strict=True)
    ]


def scanned(line: Segments, region: Segments) -> tuple[Ints, Floats, Floats]:
    """Find what of K straight lines is in a region: rows (J,), and from and to which part of each.

    Ascending by row and by part; pieces up to POSITION_EPS_MM are left out.
    """
    met = crossings(line, region)
    rows = np.concatenate([np.arange(len(line)), np.arange(len(line)), met.row_a])
    part = np.concatenate([np.zeros(len(line)), np.ones(len(line)), met.ta])
    order = np.lexsort([part, rows])
    rows, part = rows[order], part[order]
    same = rows[1:] == rows[:-1]
    row, low, high = rows[:-1][same], part[:-1][same], part[1:][same]
    keep = (high - low) * segment_lengths(line)[row] > POSITION_EPS_MM
    row, low, high = row[keep], low[keep], high[keep]
    within = inside(point_at(line, row, 0.5 * (low + high)), region)
    return row[within], low[within], high[within]
