"""Parallel offsets of polylines in which arcs stay arcs.

Algorithm, for a distance to the left (the right is the left of the reversed path):

1. *Raw offset.* Each segment is shifted to its left; an arc keeps its centre and its sweep. About
   each outer corner a join is put: an arc, or a mitre. These pieces are the *elements*. An arc
   that would get no radius, or a negative one, has no element. Inner corners get no join.
   (`raw_offset`)
2. *Trimming.* What is surely too near to the source at both ends of an element goes. This only
   saves time. (`trim_raw`)
3. *Slices.* The elements are cut where they meet each other. A *node* is a place where ends
   or meetings coincide; a *slice* is the piece of an element between two nodes. Where the source
   meets itself, the elements of its other side cut too. (`slice_elements`)
4. *Validity.* A slice is kept when no point of it is nearer to the source than the distance, or
   within a mitre. In exact numbers that is the same for all points of a slice. (`valid_slices`)
5. *Loops.* Pairs of slices that run the same way to and fro are taken out, then all that leads
   nowhere; what is left is followed from node to node, at each to the leftmost. (`trace_loops`)
6. *Paths.* Slices of one element are joined again, slivers and loops of no width dropped.
   (`paths_of`)

A shape of many closed paths goes through the stages as one: elements of all paths cut each other,
and validity is the distance from all of them. So islands merge and holes break through with no
case of their own, and loops come out with the region on their left.

An open path is treated as the closed one that runs there and back: that has all of the boundary
of what is nearer than the distance, closed. Then the stretches on the wanted side are given.

*Mitres.* Let N be all points nearer than d to the source, and K the *kites*: for each outer corner
c with the normals n1 and n2, the points between the arc about c and the tangents at both its ends,
and those nearer to c (camtool.kernels.offset_kites). The offset with mitres is what is left of the
region without N and K. Its boundary lies on shifted segments and on outer edges of kites, since
the arc about a corner lies in its kite and the inner edges of a kite lie in N. So the elements are
the shifted segments, with lines prolonged along the edges of kites, and lines beside arcs and
across cut tips; and a slice is kept when it is neither in N nor in K. It is a boundary of both, so
that a slice along its own kite is not in it: its depth there is 0. Without kites this is the rule
of round joins. A mitre may be longer than a wall is thick, and then takes from what lies beyond.

What is past finding out is left so: of paths that cross themselves or each other, what crosses is
no boundary of one region, and only loops that close on their own side are given.

Tolerances (`OffsetOptions`), and what each decides:

- `node_eps_mm`: which ends and meetings are one node, and whether curves that hardly touch meet.
  It does not decide what is kept, and moves nothing by more than itself.
- `validity_eps_mm`: how much too near, or how deep in a kite, a slice may be. It is far above the
  rounding of all steps before, so nothing right is refused; something wrong by no more than this
  may pass, and is then mostly a dead end that stage 5 drops. It does not decide where slices begin
  or end. Where features of the result are as small as this (a ring of chords 5 µm long that bulge
  by 2e-7 mm), a loop may come with others beside it that differ by no more than this.
- `sliver_eps_mm`: the shortest segment and the narrowest loop that is given. Points move by half
  of it at most for each segment that is dropped. It does not decide how the loops run.

The result is exact up to these: each point is at the distance from the source within
`sliver_eps_mm`, and all points that are so on that side are in the result. Loops come in the order
of the first piece of the source that they run along, and begin there.

All inner loops are compiled (camtool/kernels/offset_*.py) and ask trees of boxes, so the time
grows as n log n in the number of segments, and with the number of true meetings.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import GeometryError, OptionError
from camtool.geometry.boxes import Curves, curve_rows_of, meets_itself, next_rows
from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.measure import Frames, dot, path_lengths, point_at, signed_areas, turned
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    lines_reversed,
    reverse,
)

__all__ = [
    "OffsetOptions",
    "RawOffset",
    "Slices",
    "Stages",
    "Way",
    "offset",
    "offset_open",
    "offset_shape",
    "raw_offset",
    "shape_stages",
    "slice_elements",
    "stage_drawings",
    "trace_loops",
    "trim_raw",
    "valid_slices",
]


# The tolerances of an offset.

NODE_EPS_MM = 1e-8
"""Ends and meetings of raw elements nearer than this are one node."""

VALIDITY_EPS_MM = 2e-7
"""How much nearer to the source than the distance a slice may be and is still kept."""

CUSP_EPS_RAD = 1e-3
"""A corner this near to a full turn back is capped on both its sides: rounding, or arcs that cross
again beside the corner, decide which side is the inner one."""

SHARP_LIMIT = 100.0
"""A sharp corner may be so many times the distance away from the source, and is cut off there: it
is one sharper than 1.1°."""


@dataclass(frozen=True)
class OffsetOptions:
    """Tolerances, mm; see the top of the package for what each decides.

    `sliver_eps_mm` must be POSITION_EPS_MM or more, because no polyline has shorter segments.
    """

    node_eps_mm: float = NODE_EPS_MM
    validity_eps_mm: float = VALIDITY_EPS_MM
    sliver_eps_mm: float = POSITION_EPS_MM

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0.0):
                raise OptionError(f"{field.name} of {value} is not above 0")
        if self.sliver_eps_mm < POSITION_EPS_MM:
            raise OptionError(
                f"sliver_eps_mm of {self.sliver_eps_mm} is below {POSITION_EPS_MM}",
                mend="no polyline has shorter segments",
            )


DEFAULT_OPTIONS = OffsetOptions()


# What is asked of an offset: how far, and what is put about outer corners.

JOINS = ("round", "mitre", "sharp")


@dataclass(frozen=True)
class Way:
    """An offset to the left by `distance_mm` > 0. `limit` is inf for round joins; else a corner
    may be so many times the distance away from the source, and is cut off there.

    `both_sides` says that the left of the paths is all there is around them (`there_and_back`).
    """

    distance_mm: float
    limit: float = math.inf
    both_sides: bool = False
    options: OffsetOptions = DEFAULT_OPTIONS

    @property
    def is_round(self) -> bool:
        """Whether arcs go about outer corners."""
        return math.isinf(self.limit)


def limit_of(joins: str, mitre_limit: float) -> float:
    """The limit of a `Way`; OptionError for joins that do not exist and a limit below 1."""
    if joins not in JOINS:
        raise OptionError(f"no joins are called {joins!r}", mend=f"use one of {', '.join(JOINS)}")
    if joins == "mitre" and not 1.0 <= mitre_limit < math.inf:
        mend = "at 1 corners are cut off where an arc would be, at 2 those sharper than 60°"
        raise OptionError(f"a mitre limit of {mitre_limit} is not 1 or more", mend=mend)
    return {"round": math.inf, "sharp": SHARP_LIMIT}.get(joins, mitre_limit)


def is_nothing(distance_mm: float) -> bool:
    """True for a distance that moves nothing; GeometryError when it is not finite."""
    if not math.isfinite(distance_mm):
        raise GeometryError(f"an offset of {distance_mm} mm is not finite")
    return abs(distance_mm) <= POSITION_EPS_MM


# The stages of an offset in their order, and whole shapes: many closed paths with islands.


@dataclass(frozen=True, eq=False)
class Stages:
    """What each stage of one offset to the left gave: to print, to draw, to test."""

    raw: RawOffset
    trimmed: RawOffset
    slices: Slices
    valid: Bools
    kept: Slices
    loops: list[Ints]


def offset_shape(
    lines: Polylines,
    distance_mm: float,
    *,
    joins: str = "round",
    mitre_limit: float = 2.0,
    options: OffsetOptions = DEFAULT_OPTIONS,
) -> Polylines:
    """The boundary of a region shrunk by a distance in mm, or grown by one below 0.

    The region lies on the left of its closed paths: outer ones run CCW, holes CW (`oriented`). So
    do those of the result. Islands merge, split and vanish. Loops come in the order of the first
    source segment that each of them runs along. Distances up to POSITION_EPS_MM give the paths
    themselves. For `joins` see `offset`. GeometryError for an open path and for a distance that
    is not finite, OptionError for joins that do not exist.
    """
    limit = limit_of(joins, mitre_limit)
    if not lines.closed.all():
        where = f"path {np.argmin(lines.closed)}"
        mend = "close it, or use offset_open()"
        raise GeometryError("an open path has no inside", where=where, mend=mend)
    if is_nothing(distance_mm) or len(lines) == 0:
        return lines
    way = Way(abs(float(distance_mm)), limit, options=options)
    if distance_mm < 0.0:
        return lines_reversed(_shape_left_of(lines_reversed(lines), way))
    return _shape_left_of(lines, way)


def _shape_left_of(lines: Polylines, way: Way) -> Polylines:
    stages = shape_stages(lines, way)
    closed = np.ones(len(stages.loops), dtype=np.bool_)
    elements = stages.trimmed.elements
    return paths_of(stages.loops, closed, stages.kept, elements, way.options)


def shape_stages(lines: Polylines, way: Way) -> Stages:
    """All stages of the offset of closed paths to the left."""
    source, options = Segments.of(lines), way.options
    raw = raw_offset(lines, way)
    near = Near.of(source, raw.kites)
    trimmed = trim_raw(raw, near, way)
    elements, others = trimmed.elements, None
    # Only where paths meet can what is on their right end what is on their left.
    if not way.both_sides and meets_itself(lines, POSITION_EPS_MM):
        right = raw_offset(lines_reversed(lines), replace(way, limit=math.inf))
        others = trim_raw(right, near, way).elements
    slices = slice_elements(elements, others, options)
    valid = valid_slices(slices, elements, near, way)
    kept = without_dead_ends(without_doubles(slices[valid], elements, options))
    return Stages(raw, trimmed, slices, valid, kept, trace_loops(kept, elements))


# Offsets of single paths, closed or open.


def offset(
    p: Polyline,
    distance_mm: float,
    *,
    joins: str = "round",
    mitre_limit: float = 2.0,
    options: OffsetOptions = DEFAULT_OPTIONS,
) -> list[Polyline]:
    """The parallel paths at a distance in mm: positive to the left of travel, negative right.

    A closed path gives closed paths, an open one what `offset_open` says; each runs the way of
    its source. The list is empty when the path collapses, and has several when it falls apart.
    Of a path that crosses itself, only parts that close on its own side are given. Distances up
    to POSITION_EPS_MM give the path itself.

    `joins` says what is about outer corners: "round" arcs at the distance; "mitre", tangents that
    go on until they meet, cut off at `mitre_limit` times the distance from the corner; or
    "sharp", a mitre of any length (up to SHARP_LIMIT).

    GeometryError for a distance that is not finite, OptionError for joins that do not exist and a
    mitre limit below 1.
    """
    if not p.closed:
        return offset_open(p, distance_mm, joins=joins, mitre_limit=mitre_limit, options=options)
    lines = Polylines.of([p])
    found = offset_shape(lines, distance_mm, joins=joins, mitre_limit=mitre_limit, options=options)
    return [p] if found is lines else list(found)


def offset_open(
    p: Polyline,
    distance_mm: float,
    *,
    joins: str = "round",
    mitre_limit: float = 2.0,
    options: OffsetOptions = DEFAULT_OPTIONS,
) -> list[Polyline]:
    """What runs parallel on one side of an open path: positive left of travel, negative right.

    Points nearer than the distance to any of the path, its ends too, are left out; nothing is put
    around its ends. A part that closes on itself is a closed path. For `joins` see `offset`.
    GeometryError for a closed source or a distance that is not finite.
    """
    if p.closed:
        raise GeometryError("a closed path has no ends", mend="use offset()")
    limit = limit_of(joins, mitre_limit)
    if is_nothing(distance_mm):
        return [p]
    way = Way(abs(float(distance_mm)), limit, both_sides=True, options=options)
    if distance_mm < 0.0:
        return [reverse(r) for r in _path_left_of(reverse(p), way)]
    return list(_path_left_of(p, way))


def _path_left_of(p: Polyline, way: Way) -> Polylines:
    stages = shape_stages(Polylines.of([there_and_back(p)]), way)
    elements, kept = stages.trimmed.elements, stages.kept
    around_end = stages.trimmed.join & (stages.trimmed.source == len(p) - 1)
    ahead = (stages.trimmed.source < len(p)) & ~around_end
    runs = [run for loop in stages.loops for run in _runs(loop, ahead[kept.element[loop]])]
    closed = np.array([is_all for _, is_all in runs], dtype=np.bool_)
    return paths_of([run for run, _ in runs], closed, kept, elements, way.options)


def there_and_back(p: Polyline) -> Polyline:
    """An open path and its way back as one closed path: its left is both sides of the path."""
    return Polyline(np.concatenate([p.vertices[:-1], reverse(p).vertices[:-1]]), closed=True)


def _runs(loop: Ints, ahead: Bools) -> list[tuple[Ints, bool]]:
    """The stretches of a loop that are `ahead`, in order, each with whether it is all of it."""
    if ahead.all():
        return [(loop, True)]
    begin = int(np.argmin(ahead))
    loop, ahead = np.roll(loop, -begin), np.roll(ahead, -begin)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], ahead.astype(np.int64), [0]])))
    return [(loop[low:high], False) for low, high in zip(edges[::2], edges[1::2], strict=True)]


# The corners between the segments of closed paths, and what is put about the outer ones.


@dataclass(frozen=True, eq=False)
class Corners:
    """Row i is the corner after segment i: its `place`, the tangents `before` and `after` it
    (K, 2), and how far the path turns there, `turn` (K,) rad, left positive. `earlier` (K,) is
    the corner that the same segment begins at.

    Where a path turns straight back, rounding alone says whether it turns left or right. It is
    then taken to turn right: a join too much is invalid, or leads nowhere, and goes later.
    """

    place: Floats
    before: Floats
    after: Floats
    turn: Floats
    earlier: Ints

    @classmethod
    def of(cls, frames: Frames, lines: Polylines) -> Corners:
        """The corners of closed paths, whose segments are told by `frames`."""
        before = frames.tangent_at(np.ones(len(frames.length)))
        following = next_rows(lines)
        after = frames.tangent[following]
        turn = np.arctan2(dot(turned(before), after), dot(before, after))
        turn = np.where(turn >= np.pi - CUSP_EPS_RAD, turn - 2.0 * np.pi, turn)
        return cls(frames.end, before, after, turn, np.argsort(following, kind="stable"))

    def outer(self, way: Way) -> Bools:
        """(K,) true where the path turns right so much that the shifted segments part."""
        gap = 2.0 * way.distance_mm * np.sin(-0.5 * self.turn)
        return np.asarray(gap > way.options.node_eps_mm)


def arcs_about(corners: Corners, rows: Ints, way: Way) -> tuple[Ints, Segments]:
    """Arcs about the outer corners `rows`, and the corner of each; two where one is above π."""
    turn = corners.turn[rows]
    parts = np.where(turn < -np.pi, 2, 1)
    corner = np.repeat(rows, parts)
    second = np.concatenate([[False], corner[1:] == corner[:-1]])
    sweep = np.repeat(turn / parts, parts)
    normal, place = turned(corners.before[corner]), corners.place[corner]
    start = place + way.distance_mm * _rotated(normal, np.where(second, sweep, 0.0))
    middle = place + way.distance_mm * _rotated(normal, sweep)
    after = place + way.distance_mm * turned(corners.after[corner])
    last = np.repeat(parts, parts) == second + 1
    end = np.where(last[:, None], after, middle)
    return corner, Segments.between(start, end, np.tan(0.25 * sweep))


@dataclass(frozen=True, eq=False)
class Mitres:
    """`reach` (K,): how far the tangents go on beyond the shifted segments at each corner, mm, 0
    where there is no mitre; `cut` (K,) true where it is cut off; and the `kites` (J, 10) that
    they cover (camtool.kernels.offset_kites).

    At a corner where the path turns by 2h, the tangents of both shifted segments meet when they
    have gone on by d tan h, at d / cos h from the corner. Where that is more than the limit L
    allows, they end at a line across, L d from the corner: after d (L − cos h) / sin h.
    """

    reach: Floats
    cut: Bools
    kites: Floats

    @classmethod
    def about(cls, corners: Corners, rows: Ints, way: Way) -> Mitres:
        """Mitres at the outer corners `rows`."""
        half, d = -0.5 * corners.turn[rows], way.distance_mm
        is_cut = way.limit * np.cos(half) < 1.0
        reach, cut = np.zeros(len(corners.turn)), np.zeros(len(corners.turn), dtype=np.bool_)
        cut[rows] = is_cut
        cosine, sine = np.cos(half), np.sin(half)
        reach[rows] = d * np.where(is_cut, (way.limit - cosine) / sine, np.tan(half))
        before, after = turned(corners.before[rows]), turned(corners.after[rows])
        middle = _rotated(before, -half)
        far = np.where(is_cut, way.limit * d, np.inf)
        deep = np.full(len(rows), d)
        columns = [corners.place[rows], before, after, middle, deep, far]
        return cls(reach, cut, np.column_stack(columns))

    def lines(self, corners: Corners, is_arc: Bools, way: Way) -> tuple[Ints, Segments]:
        """The lines about the corners that are not parts of shifted lines, and the corner of
        each: on from an arc, across where the mitre is cut off, on to an arc.

        `is_arc` (K, 2) says whether the segments before and after each corner are arcs.
        """
        d, reach = way.distance_mm, self.reach[:, None]
        left = corners.place + d * turned(corners.before)
        right = corners.place + d * turned(corners.after)
        near, far = left + reach * corners.before, right - reach * corners.after
        there = self.reach > 0.0
        wanted = np.column_stack([there & is_arc[:, 0], self.cut, there & is_arc[:, 1]])
        start, end = np.stack([left, near, far], axis=1), np.stack([near, far, right], axis=1)
        wanted &= np.hypot(*np.moveaxis(end - start, 2, 0)) > way.options.node_eps_mm
        corner = np.nonzero(wanted)[0]
        return corner, Segments.between(start[wanted], end[wanted], np.zeros(len(corner)))


def _rotated(vectors: Floats, angle: Floats) -> Floats:
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(cosine * vectors + sine * turned(vectors))


# Stage 1: every segment shifted to the left, and arcs or mitres about the outer corners.


@dataclass(frozen=True, eq=False)
class RawOffset:
    """`elements`: shifted segments and joins, in the order of travel. `source` (K,): the source
    segment of each, or the one before its corner; `join` (K,): true for what is put about a
    corner. `kites` (J, 10): what mitres cover (camtool.kernels.offset_kites)."""

    elements: Segments
    source: Ints
    join: Bools
    kites: Floats


def raw_offset(lines: Polylines, way: Way) -> RawOffset:
    """All of the offset to the left of closed paths, and much that is too near to them.

    An arc that bends left with a radius up to the distance has nothing there: every point beyond
    its centre is nearer to another of its points. Inner corners need no join: the elements
    beside them cross, there or elsewhere.
    """
    segments = Segments.of(lines)
    frames = Frames.of(segments)
    corners = Corners.of(frames, lines)
    mitred = corners.outer(way)
    rounded = mitred & way.is_round
    if way.both_sides:
        # About the ends of an open path only what is nearer than the distance counts.
        rounded[[len(segments) // 2 - 1, -1]] = mitred[[len(segments) // 2 - 1, -1]]
    mitres = Mitres.about(corners, np.flatnonzero(mitred & ~rounded), way)
    rows, shifted = _shifted(segments, frames, corners, mitres, way)
    about, arcs = arcs_about(corners, np.flatnonzero(rounded), way)
    beside = np.column_stack([segments.is_arc, segments.is_arc[next_rows(lines)]])
    along, across = mitres.lines(corners, beside, way)
    return _in_order([rows, about, along], [shifted, arcs, across], mitres.kites)


def _shifted(
    segments: Segments, frames: Frames, corners: Corners, mitres: Mitres, way: Way
) -> tuple[Ints, Segments]:
    """The segments at the distance, and the row of each; lines go on to the tips of mitres."""
    start = segments.start + way.distance_mm * frames.normal
    end = segments.end + way.distance_mm * turned(corners.before)
    left_over = 1.0 - way.distance_mm * frames.curvature
    apart = np.hypot(*(end - start).T)
    rows = np.flatnonzero((left_over > 0.0) & (apart > way.options.node_eps_mm))
    reach = np.where(segments.is_arc, 0.0, mitres.reach)
    reach_back = np.where(segments.is_arc, 0.0, mitres.reach[corners.earlier])
    end += reach[:, None] * corners.before
    start -= reach_back[:, None] * frames.tangent
    return rows, Segments.between(start[rows], end[rows], segments.bulge[rows])


def _in_order(sources: list[Ints], parts: list[Segments], kites: Floats) -> RawOffset:
    """Shifted segments and then joins, by their source."""
    source = np.concatenate(sources)
    order = np.argsort(source, kind="stable")
    elements = Segments.between(
        np.concatenate([part.start for part in parts])[order],
        np.concatenate([part.end for part in parts])[order],
        np.concatenate([part.bulge for part in parts])[order],
    )
    return RawOffset(elements, source[order], order >= len(sources[0]), kites)


# What raw elements may not come near to: the source, and what mitres cover.

Arrays = tuple[Floats, Floats, Floats, Floats]


@dataclass(frozen=True, eq=False)
class Near:
    """The source as `arrays` of the kernels: rows of curves and their tree, kites and theirs."""

    arrays: Arrays

    @classmethod
    def of(cls, source: Segments, kites: Floats) -> Near:
        """The segments of the source, and the kites (J, 10) of a raw offset."""
        from camtool.kernels.box_tree import tree_of
        from camtool.kernels.offset_kites import kite_boxes

        curves = Curves.of(source)
        return cls((curves.rows, curves.tree, kites, tree_of(kite_boxes(kites))))


# Stage 2: elements without the ends that are too near to the source.

TRIM_SPARE = 10.0
"""Ends stay that are too near by so many times `validity_eps_mm`: the tips that are left beyond
the last cut are then judged to be invalid."""


def trim_raw(raw: RawOffset, near: Near, way: Way) -> RawOffset:
    """The raw offset without what is surely too near at both ends of each element.

    What goes could never be kept, and what is kept is not cut by it: this only saves cuts, which
    would grow with the square of the number of elements where the distance is large against them.
    """
    from camtool.kernels.offset_near import trimmed_ends

    spare = TRIM_SPARE * way.options.validity_eps_mm
    ends = trimmed_ends(curve_rows_of(raw.elements), near.arrays, (way.distance_mm, spare))
    low, high = ends.T
    keep = np.flatnonzero(low < high)
    trimmed = _between(raw.elements[keep], low[keep], high[keep])
    return RawOffset(trimmed, raw.source[keep], raw.join[keep], raw.kites)


def _between(elements: Segments, low: Floats, high: Floats) -> Segments:
    """The part of each element between two fractions; elements that are whole stay the same."""
    cut = np.flatnonzero((low != 0.0) | (high != 1.0))
    start, end, bulge = elements.start.copy(), elements.end.copy(), elements.bulge.copy()
    start[cut] = point_at(elements, cut, low[cut])
    end[cut] = point_at(elements, cut, high[cut])
    bulge[cut] = np.tan(0.25 * elements.sweep[cut] * (high - low)[cut])
    return Segments.between(start, end, bulge)


# Stages 3 and 4: the raw offset cut wherever it meets itself, and which slices are kept.

SKEW = (0.850650808352040, 0.525731112119133)
"""Unit direction along which points are sorted: drawings have many of equal x or equal y."""


@dataclass(frozen=True, eq=False)
class Slices:
    """Pieces of elements between two nodes, in columns: `element`, `from_node`, `to_node` (S,)
    and the fractions `t0` < `t1` (S,) of the element's length; `nodes` (N, 2) mm."""

    element: Ints
    t0: Floats
    t1: Floats
    from_node: Ints
    to_node: Ints
    nodes: Floats

    def __len__(self) -> int:
        return len(self.element)

    def __getitem__(self, rows: Bools | Ints) -> Slices:
        """The chosen slices; the nodes stay."""
        return Slices(
            self.element[rows],
            self.t0[rows],
            self.t1[rows],
            self.from_node[rows],
            self.to_node[rows],
            self.nodes,
        )

    @property
    def span(self) -> Floats:
        """(S, 2) t0 and t1."""
        return np.column_stack([self.t0, self.t1])

    @property
    def ends(self) -> tuple[Ints, Ints, int]:
        """from_node and to_node (S,), and how many nodes there are."""
        return self.from_node, self.to_node, len(self.nodes)


def slice_elements(elements: Segments, others: Segments | None, options: OffsetOptions) -> Slices:
    """The elements cut at all meetings with each other and with `others`."""
    from camtool.kernels.offset_meet import TA, TB, X, Y, meetings_of, pairs_of

    eps = options.node_eps_mm
    own = Curves.of(elements, margin_mm=eps)
    pairs = pairs_of(own.boxes, own.tree, own.boxes, own.tree, True)
    met, at = meetings_of(own.rows, own.rows, pairs, eps)
    rows = [met[:, 0], met[:, 1]]
    found = [at[:, [TA, X, Y]], at[:, [TB, X, Y]]]
    if others is not None:
        cutting = Curves.of(others, margin_mm=eps)
        pairs = pairs_of(own.boxes, own.tree, cutting.boxes, cutting.tree, False)
        met, at = meetings_of(own.rows, cutting.rows, pairs, eps)
        rows.append(met[:, 0])
        found.append(at[:, [TA, X, Y]])
    return _cut_at(elements, np.concatenate(rows), np.concatenate(found), options)


def _cut_at(elements: Segments, rows: Ints, found: Floats, options: OffsetOptions) -> Slices:
    """The elements cut at `found` (J, 3), the fraction and the place on the element rows[j]."""
    from camtool.kernels.offset_nodes import in_order

    count = len(elements)
    every = np.arange(count)
    # Ends come first, so that a node is at an end of an element rather than at a meeting.
    element = np.concatenate([every, every, rows])
    t = np.concatenate([np.zeros(count), np.ones(count), found[:, 0]])
    points = np.concatenate([elements.start, elements.end, found[:, 1:]])
    node, nodes = merge_points(points, 2.0 * options.node_eps_mm)
    order = in_order(element, t, count)
    element, t, node = element[order], t[order], node[order]
    cut = (element[1:] == element[:-1]) & (node[1:] != node[:-1])
    before, after = np.flatnonzero(cut), np.flatnonzero(cut) + 1
    return Slices(element[before], t[before], t[after], node[before], node[after], nodes)


def merge_points(points: Floats, eps_mm: float) -> tuple[Ints, Floats]:
    """Node (P,) of each point (P, 2), and the nodes (N, 2): the first point of each group.

    Points within `eps_mm` share a node, and so do chains of such points.
    """
    from camtool.kernels.offset_nodes import merged

    skew = points @ np.array(SKEW)
    node, first = merged(points, skew, np.argsort(skew), eps_mm)
    return node, points[first]


def valid_slices(slices: Slices, elements: Segments, near: Near, way: Way) -> Bools:
    """(S,) true where no measured point is too near to the source, or within a mitre.

    Too near is what falls short of the distance, or is deeper in a kite, by `validity_eps_mm`.
    The raw offset changes between valid and invalid only where it meets itself, so that one point
    would do; several guard against slices that are hardly too near anywhere.
    """
    from camtool.kernels.offset_near import far_enough

    limits = (way.distance_mm, way.options.validity_eps_mm)
    curves = curve_rows_of(elements)
    return far_enough(curves, slices.element, slices.span, near.arrays, limits)


# Stages 5 and 6: kept slices joined to loops, and loops made clean paths.


def without_doubles(slices: Slices, elements: Segments, options: OffsetOptions) -> Slices:
    """The slices without repetitions, and without pairs that run the same way to and fro.

    Such a pair encloses nothing: it is where the offset falls apart, or collapses to a line.
    """
    from camtool.kernels.offset_nodes import doubles_left

    middle = 0.5 * (slices.t0 + slices.t1)
    eps = 2.0 * options.node_eps_mm
    return slices[doubles_left(curve_rows_of(elements), slices.element, middle, slices.ends, eps)]


def without_dead_ends(slices: Slices) -> Slices:
    """The slices that others lead to and lead on from."""
    from camtool.kernels.offset_nodes import leading_on

    return slices[leading_on(*slices.ends)]


def trace_loops(slices: Slices, elements: Segments) -> list[Ints]:
    """Rows of the slices of each loop, in order; no loop passes a node twice.

    At a node where several slices leave, the leftmost one is taken: the region that is far
    enough from the source is on the left, and so it falls into parts that only touch. Each loop
    begins with its first slice, and they come in the order of these.
    """
    from camtool.kernels.offset_loops import traced

    rows, begins = traced(curve_rows_of(elements), slices.element, slices.span, slices.ends)
    loops = [rows[low:high] for low, high in pairwise(begins.tolist())]
    rolled = (np.roll(loop, -int(loop.argmin())) for loop in loops)
    return sorted(rolled, key=lambda loop: int(loop[0]))


def paths_of(
    runs: Sequence[Ints], closed: Bools, slices: Slices, elements: Segments, options: OffsetOptions
) -> Polylines:
    """Clean paths of runs of slices that follow each other; slices of one element become one.

    Segments up to `sliver_eps_mm` go. A path of which nothing is left goes, and so does a closed
    one whose mean width, area over half the length, is no more than that.
    """
    from camtool.kernels.offset_loops import written

    eps = options.sliver_eps_mm
    begins = np.concatenate([[0], np.cumsum([len(run) for run in runs])]).astype(np.int64)
    rows = np.concatenate([np.empty(0, dtype=np.int64), *runs])
    columns = (slices.element, slices.span, slices.from_node, slices.to_node)
    vertices, offsets = written(columns, slices.nodes, elements.sweep, (rows, begins, closed), eps)
    there = np.diff(offsets) > 0
    lines = Polylines(vertices, np.concatenate([[0], offsets[1:][there]]), closed[there])
    wide = np.abs(signed_areas(lines)) > 0.5 * eps * path_lengths(lines)
    keep = wide | ~lines.closed
    return lines if keep.all() else lines.select(np.flatnonzero(keep))


# The stages of an offset as drawings, one by one: for pictures, and to see what went wrong.


def stage_drawings(lines: Polylines, way: Way) -> dict[str, Drawing]:
    """Each stage of an offset of closed paths to the left with its source, by the stage's name.

    The layers say what is what; pieces too short for a polyline are left out.
    """
    stages = shape_stages(lines, way)
    elements = stages.trimmed.elements
    closed = np.ones(len(stages.loops), dtype=np.bool_)
    loops = paths_of(stages.loops, closed, stages.kept, elements, way.options)
    valid, every = stages.valid, np.ones(len(stages.kept), dtype=np.bool_)
    parts: dict[str, dict[str, list[Polyline]]] = {
        "raw": {
            "shifted": list(_pieces(stages.raw.elements[~stages.raw.join])),
            "joins": list(_pieces(stages.raw.elements[stages.raw.join])),
        },
        "trimmed": {"trimmed": list(_pieces(elements))},
        "slices": {
            "too near": list(_pieces(_cut_out(stages.slices, elements, ~valid))),
            "far enough": list(_pieces(_cut_out(stages.slices, elements, valid))),
        },
        "kept": {"kept": list(_pieces(_cut_out(stages.kept, elements, every)))},
        "loops": {"loops": list(loops)},
    }
    return {name: _drawing(name, {"source": list(lines), **part}) for name, part in parts.items()}


def _cut_out(slices: Slices, elements: Segments, rows: Bools) -> Segments:
    """The chosen slices as segments of their own."""
    some = slices[np.flatnonzero(rows)]
    start = point_at(elements, some.element, some.t0)
    end = point_at(elements, some.element, some.t1)
    sweep = elements.sweep[some.element] * (some.t1 - some.t0)
    return Segments.between(start, end, np.tan(0.25 * sweep))


def _pieces(segments: Segments) -> Iterator[Polyline]:
    """Each segment as a path, if it is long enough for one."""
    for start, end, bulge in zip(segments.start, segments.end, segments.bulge, strict=True):
        if np.hypot(*(end - start)) > POSITION_EPS_MM:
            yield Polyline(np.array([[*start, bulge], [*end, 0.0]]))


def _drawing(name: str, layers: dict[str, list[Polyline]]) -> Drawing:
    paths = [path for layer in layers.values() for path in layer]
    names = tuple(layer for layer, some in layers.items() for _ in some)
    blank = ("",) * len(paths)
    return Drawing(Polylines.of(paths), names, blank, blank, name, Units("mm", 1.0, "given"))
