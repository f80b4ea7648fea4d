"""Parallel offsets of closed paths in which arcs stay arcs.

Algorithm, for a distance to the left (the right is the left of the reversed paths):

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
5. *Loops.* Pairs of slices that run to and fro along each other are taken out, then all that leads
   nowhere; what is left is followed from node to node, at each to the leftmost.
   (`without_doubles`, `without_dead_ends`, `trace_loops`)
6. *Paths.* Slices of one element are joined again, slivers and degenerate loops dropped.
   (`paths_of`)

All paths of a shape go through the stages as one: elements of all paths cut each other, and
validity is the distance from all of them. So islands merge and holes break through with no case
of their own, and loops come out with the region on their left.

*Mitres.* Let N be all points nearer than d to the source, and K the *kites*: for each outer corner
c with the normals n1 and n2, the points between the arc about c and the tangents at both its ends,
and those nearer to c (camtool.kernels.offsets). The offset with mitres is what is left of the
region without N and K. Its boundary lies on shifted segments and on outer edges of kites, since
the arc about a corner lies in its kite and the inner edges of a kite lie in N. So the elements are
the shifted segments, with lines prolonged along the edges of kites, and lines beside arcs and
across cut tips; and a slice is kept when it is neither in N nor in K. It is a boundary of both, so
that a slice along its own kite is not in it: its depth there is 0. Without kites this is the rule
of round joins. A mitre may be longer than a wall is thick, and then takes from what lies beyond.

Of paths that cross themselves or each other, what crosses is no boundary of one region: only loops
that close on their own side are given, and of these none that lies on the right of more paths
than on the left: three discs leave a gap between them, but none where a fourth one covers it.
Paths that cross themselves do not count for that.

Tolerances, and what each decides:

- NODE_EPS_MM: which ends and meetings are one node, and whether curves that hardly touch meet.
  It does not decide what is kept, and moves nothing by more than itself.
- VALIDITY_EPS_MM: how much too near, or how deep in a kite, a slice may be. It is far above the
  rounding of all steps before, so nothing right is refused; something wrong by no more than this
  may pass, and is then mostly a dead end that stage 5 drops. It does not decide where slices begin
  or end. Where features of the result are as small as this (a ring of chords 5 µm long that bulge
  by 2e-7 mm), a loop may come with others beside it that differ by no more than this.
- POSITION_EPS_MM: the shortest segment and the narrowest loop that is given. Points move by half
  of it at most for each segment that is dropped. It does not decide how the loops run.

The result is exact up to these: each point is at the distance from the source within
POSITION_EPS_MM, and all points that are so on that side are in the result. Loops come in the order
of the first piece of the source that they run along, and begin there.

All inner loops are compiled (camtool/kernels/offsets.pyx) and ask trees of boxes, so the time
grows as n log n in the number of segments, and with the number of true meetings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import GeometryError, OptionError
from camtool.geometry.boxes import BoxIndex, IndexedCurves, curve_rows_of
from camtool.geometry.measure import (
    Frames,
    dot,
    path_extents,
    path_lengths,
    point_at,
    segment_lengths,
    signed_areas,
    turn_left,
)
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse_lines,
)
from camtool.kernels.move_tree import hilbert_order
from camtool.kernels.offsets import (
    TA,
    TB,
    X,
    Y,
    doubles_left,
    far_enough,
    in_order,
    kite_boxes,
    leading_on,
    meetings_of,
    merged,
    pairs_of,
    traced,
    tree_of,
    trimmed_ends,
    written,
)
from camtool.records import replace

NODE_EPS_MM = 1e-8
"""Ends and intersections of raw elements nearer than this become one node."""

VALIDITY_EPS_MM = 2e-7
"""A slice may be nearer to the source than the distance by this much and is still kept."""

CUSP_EPS_RAD = 1e-3
"""A corner that differs from a full reversal by less is capped on both sides: rounding, or arcs
that cross again beside the corner, decide which side is the inner one."""

SHARP_LIMIT = 100.0
"""A sharp corner is cut off at this many times the distance from the source: this concerns corners
sharper than 1.1°."""

MAX_DEAD_END_MM = 1e-3
"""What a tool sweeps is not known where the outline ends in nothing for more than this: rounding
alone leaves a tenth of it."""

JOINS = ("round", "mitre", "sharp")


def offset_shape(
    lines: Polylines, distance_mm: float, *, joins: str = "round", mitre_limit: float = 2.0
) -> Polylines:
    """Return the boundary of a region shrunk by a distance in mm, or grown by one below 0.

    The region lies on the left of its closed paths: outer ones run CCW, holes CW (`oriented`). So
    do those of the result. Islands merge, split and vanish. Loops come in the order of the first
    source segment that each of them runs along. Distances up to POSITION_EPS_MM give the paths
    themselves.

    `joins` says what is about outer corners: "round" arcs at the distance; "mitre", tangents that
    go on until they meet, cut off at `mitre_limit` times the distance from the corner; or "sharp",
    a mitre of any length (up to SHARP_LIMIT).

    GeometryError for an open path and for a distance that is not finite, OptionError for joins
    that do not exist and a mitre limit below 1."""
    offset = _checked_offset(lines, distance_mm, joins, mitre_limit)
    if offset is None or len(lines) == 0:
        return lines
    return _offset_paths(lines, distance_mm, offset)[0]


def offset_each(
    lines: Polylines, distance_mm: float, *, joins: str = "round", mitre_limit: float = 2.0
) -> tuple[Polylines, Ints]:
    """Return the offset of each closed path as a region of its own: the loops, and for each the
    path that it belongs to (J,), ascending.

    Paths that lie so far apart that their offsets cannot meet are computed together."""
    offset = _checked_offset(lines, distance_mm, joins, mitre_limit)
    if offset is None or len(lines) == 0:
        return lines, np.arange(len(lines))
    longest = 1.0 if math.isinf(offset.limit) else max(offset.limit, 1.0)
    boxes = path_extents(lines).transpose(0, 2, 1).reshape(-1, 4)
    loops_so_far: list[Polyline] = []
    owners: list[Ints] = []
    for rows in _far_apart(boxes, longest * offset.distance_mm + POSITION_EPS_MM):
        group_lines = lines.select(rows)
        meets_itself = np.zeros(len(rows), dtype=np.bool_)
        meets_itself[distinct(_touching_paths(group_lines))] = True
        for each in (rows[~meets_itself], *rows[meets_itself][:, None]):
            loops, loop_sources = _offset_paths(lines.select(each), distance_mm, offset)
            loops_so_far += loops
            owners.append(each[loop_sources])
    owner = np.concatenate(owners)
    order = np.argsort(owner, kind="stable")
    return Polylines.of(loops_so_far).select(order), owner[order]


def swept_outline(lines: Polylines, radius_mm: float) -> Polylines | None:
    """Return the boundary of all points within a radius of paths, with the region on its left.

    The paths may be open, cross themselves and each other, and repeat each other: each has both of
    its sides as elements, so that whatever bounds one of them is there. None where rounding hides
    how the boundary goes on (MAX_DEAD_END_MM)."""
    offset = Offset(radius_mm)
    raw = raw_offset(_both_sides(lines), offset)
    source = source_arrays(Segments.of(lines), raw.kites)
    elements = trim_raw(raw, source, offset).elements
    slices = slice_elements(elements, None)
    slices = without_doubles(slices[valid_slices(slices, elements, source, offset)], elements)
    leads_on = leading_on(*slices.ends)
    dead_ends = slices[~leads_on]
    lengths = segment_lengths(elements[dead_ends.element]) * (dead_ends.t1 - dead_ends.t0)
    if lengths.max(initial=0.0) > MAX_DEAD_END_MM or not leads_on.any():
        return None
    slices = slices[leads_on]
    return reverse_lines(paths_of(trace_loops(slices, elements), slices, elements)[0])


def _both_sides(lines: Polylines) -> Polylines:
    """Return closed paths that go along both sides of all paths: open paths there and back, closed
    ones once each way."""
    backwards = reverse_lines(lines)
    there_and_back = (
        Polyline(np.concatenate([path.vertices[:-1], back.vertices[:-1]]), closed=True)
        for path, back in zip(lines, backwards, strict=True)
        if not path.closed
    )
    closed = np.flatnonzero(lines.closed)
    return Polylines.joined(
        [Polylines.of(there_and_back), lines.select(closed), backwards.select(closed)]
    )


def _checked_offset(
    lines: Polylines, distance_mm: float, joins: str, mitre_limit: float
) -> Offset | None:
    """Check the arguments of an offset of closed paths, and return them as a record; None if the
    paths stay as they are."""
    if joins not in JOINS:
        raise OptionError(f"unknown joins {joins!r}", mend=f"use one of {', '.join(JOINS)}")
    if joins == "mitre" and not 1.0 <= mitre_limit < math.inf:
        mend = "at 1 corners are cut off where an arc would be, at 2 those sharper than 60°"
        raise OptionError(f"a mitre limit of {mitre_limit} is not 1 or more", mend=mend)
    if not lines.closed.all():
        place = f"path {np.argmin(lines.closed)}"
        raise GeometryError("an open path has no inside", where=place, mend="close it")
    if not math.isfinite(distance_mm):
        raise GeometryError(f"an offset of {distance_mm} mm is not finite")
    if abs(distance_mm) <= POSITION_EPS_MM:
        return None
    limit = {"round": math.inf, "sharp": SHARP_LIMIT}.get(joins, mitre_limit)
    return Offset(abs(float(distance_mm)), limit)


PATHS_AT_A_TIME = 64


def _far_apart(boxes: Floats, reach_mm: float) -> Iterator[Ints]:
    """Yield groups of rows of boxes (M, 4): within a group none comes within twice the reach of
    another.

    The rows of a group are in the order of Hilbert's curve, so that neighbours in the plane are
    near each other in it."""
    order = hilbert_order(boxes[:, :2], boxes[:, 2:])
    wide = boxes + reach_mm * np.array([-1.0, -1.0, 1.0, 1.0])
    index, group = BoxIndex(wide), np.full(len(boxes), -1)
    for begin in range(0, len(order), PATHS_AT_A_TIME):
        batch = order[begin : begin + PATHS_AT_A_TIME]
        one, other = index.touching(wide[batch])
        ends = np.searchsorted(one, np.arange(len(batch) + 1)).tolist()
        for k, row in enumerate(batch.tolist()):
            neighbour_counts = np.bincount(group[other[ends[k] : ends[k + 1]]] + 1)[1:]
            group[row] = np.append(neighbour_counts, 0).argmin()
    for each in range(int(group.max()) + 1):
        yield order[group[order] == each]


def _offset_paths(lines: Polylines, distance_mm: float, offset: Offset) -> tuple[Polylines, Ints]:
    """Return the boundary of the region shrunk or grown, and for each of its loops (J,) the path
    along which it begins."""
    if distance_mm < 0.0:
        offset_lines, sources = _left_of(reverse_lines(lines), offset)
        return reverse_lines(offset_lines), sources
    return _left_of(lines, offset)


class Offset(Struct, frozen=True):
    """An offset to the left by `distance_mm` > 0. `limit` is inf for round joins; else a corner
    may be so many times the distance away from the source, and is cut off there."""

    distance_mm: float
    limit: float = math.inf


def _left_of(lines: Polylines, offset: Offset) -> tuple[Polylines, Ints]:
    """Return the offset to the left, and for each of its loops (J,) the path along which it
    begins."""
    stages = shape_stages(lines, offset)
    offset_lines, loop_rows = paths_of(stages.loops, stages.final_slices, stages.trimmed.elements)
    begins = np.array([loop[0] for loop in stages.loops], dtype=np.int64)[loop_rows]
    source = stages.trimmed.source[stages.final_slices.element[begins]]
    sources = Segments.of(lines).path[source]
    if len(stages.meeting_paths) == 0:
        return offset_lines, sources
    is_simple = np.ones(len(lines), dtype=np.bool_)
    is_simple[stages.meeting_paths[stages.meeting_paths[:, 0] == stages.meeting_paths[:, 1]]] = (
        False
    )
    turns = _turns_about(
        offset_lines.vertices[offset_lines.offsets[:-1], :2], lines.select(is_simple.nonzero()[0])
    )
    is_free = np.flatnonzero(turns >= 0)
    return offset_lines.select(is_free), sources[is_free]


def _turns_about(points: Floats, lines: Polylines) -> Ints:
    """Return the winding number (P,) of closed paths about points (P, 2): the number of CCW paths
    around a point less that of CW ones."""
    turns = np.zeros(len(points), dtype=np.int64)
    signs = np.where(signed_areas(lines) > 0.0, 1, -1).tolist()
    for path, box, sign in zip(lines, path_extents(lines), signs, strict=True):
        in_box = ((points >= box[:, 0]) & (points <= box[:, 1])).all(axis=1)
        if in_box.any():
            turns[in_box] += sign * inside(points[in_box], Segments.of(path))
    return turns


class Stages(Struct, frozen=True, eq=False):
    """The results of all stages of an offset to the left, for printing, drawing and tests."""

    raw: RawOffset
    trimmed: RawOffset
    slices: Slices
    valid: Bools
    final_slices: Slices
    loops: list[Ints]
    meeting_paths: Ints
    """Pairs of paths (J, 2) at each common point of two segments, other than between
    neighbours."""


def shape_stages(lines: Polylines, offset: Offset) -> Stages:
    """Compute all stages of the offset of closed paths to the left."""
    raw = raw_offset(lines, offset)
    source = source_arrays(Segments.of(lines), raw.kites)
    trimmed = trim_raw(raw, source, offset)
    elements, cutting_elements = trimmed.elements, None
    # Only where paths meet can elements on their right bound those on their left.
    pairs = _touching_paths(lines)
    if len(pairs):
        right = raw_offset(reverse_lines(lines), replace(offset, limit=math.inf))
        cutting_elements = trim_raw(right, source, offset).elements
    slices = slice_elements(elements, cutting_elements)
    valid = valid_slices(slices, elements, source, offset)
    final_slices = without_dead_ends(without_doubles(slices[valid], elements))
    return Stages(
        raw, trimmed, slices, valid, final_slices, trace_loops(final_slices, elements), pairs
    )


Arrays = tuple[Floats, Floats, Floats, Floats]


def source_arrays(source: Segments, kites: Floats) -> Arrays:
    """Return, in the form of the kernels, what elements must not come near: the rows of the source
    and their tree, the kites (J, 10) of mitres and theirs."""
    curves = IndexedCurves.of(source)
    return curves.rows, curves.tree, kites, tree_of(kite_boxes(kites))


def _touching_paths(lines: Polylines) -> Ints:
    """Return the pair of paths (J, 2) at each common point of two segments, except where one
    follows the other."""
    segments = Segments.of(lines)
    curves = IndexedCurves.of(segments, margin_mm=POSITION_EPS_MM)
    pairs = pairs_of(curves.boxes, curves.tree, curves.boxes, curves.tree, True)
    meeting_rows, places = meetings_of(curves.rows, curves.rows, pairs, POSITION_EPS_MM)
    one, other = meeting_rows.T
    following = _next_rows(lines)
    a_first = (following[one] == other) & (places[:, TA] == 1.0) & (places[:, TB] == 0.0)
    b_first = (following[other] == one) & (places[:, TA] == 0.0) & (places[:, TB] == 1.0)
    return np.asarray(segments.path[meeting_rows[~(a_first | b_first)]])


def _next_rows(lines: Polylines) -> Ints:
    """Return, for each segment of closed paths, the row of the one that follows it."""
    following = np.arange(1, len(lines.vertices) + 1)
    following[lines.offsets[1:] - 1] = lines.offsets[:-1]
    return following


# Stage 1: the corners between segments, and what is put about the outer ones; every segment
# shifted to the left.


class Corners(Struct, frozen=True, eq=False):
    """Row i is the corner after segment i: its `place`, the tangents `before` and `after` it
    (K, 2), and how far the path turns there, `turn` (K,) rad, left positive. `earlier` (K,) is
    the corner that the same segment begins at.

    Where a path turns straight back, rounding alone says whether it turns left or right. It is
    then taken to turn right: a join too much is invalid, or leads nowhere, and goes later."""

    place: Floats
    before: Floats
    after: Floats
    turn: Floats
    earlier: Ints

    @classmethod
    def of(cls, frames: Frames, lines: Polylines) -> Corners:
        """Return the corners of closed paths; `frames` are those of their segments."""
        before = frames.tangent_at(np.ones(len(frames.length)))
        following = _next_rows(lines)
        after = frames.tangent[following]
        turn = np.arctan2(dot(turn_left(before), after), dot(before, after))
        turn = np.where(turn >= np.pi - CUSP_EPS_RAD, turn - 2.0 * np.pi, turn)
        return cls(frames.end, before, after, turn, np.argsort(following, kind="stable"))

    def outer(self, offset: Offset) -> Bools:
        """Return the mask (K,) of the outer corners: the path turns right so much that the shifted
        segments part."""
        gap = 2.0 * offset.distance_mm * np.sin(-0.5 * self.turn)
        return np.asarray(gap > NODE_EPS_MM)


def arcs_about(corners: Corners, rows: Ints, offset: Offset) -> tuple[Ints, Segments]:
    """Return the arcs about these outer corners, and the corner of each; a corner of more than π
    gets two."""
    turn = corners.turn[rows]
    parts = np.where(turn < -np.pi, 2, 1)
    corner = np.repeat(rows, parts)
    second = np.concatenate([[False], corner[1:] == corner[:-1]])
    sweep = np.repeat(turn / parts, parts)
    normal, place = turn_left(corners.before[corner]), corners.place[corner]
    start = place + offset.distance_mm * _rotate_vectors(normal, np.where(second, sweep, 0.0))
    middle = place + offset.distance_mm * _rotate_vectors(normal, sweep)
    after = place + offset.distance_mm * turn_left(corners.after[corner])
    last = np.repeat(parts, parts) == second + 1
    end = np.where(last[:, None], after, middle)
    return corner, Segments.between(start, end, np.tan(0.25 * sweep))


class Mitres(Struct, frozen=True, eq=False):
    """`reach` (K,): how far the tangents go on beyond the shifted segments at each corner, mm, 0
    where there is no mitre; `cut` (K,) true where it is cut off; and the `kites` (J, 10) that
    they cover (camtool.kernels.offsets).

    At a corner where the path turns by 2h, the tangents of both shifted segments meet when they
    have gone on by d tan h, at d / cos h from the corner. Where that is more than the limit L
    allows, they end at a line across, L d from the corner: after d (L − cos h) / sin h."""

    reach: Floats
    cut: Bools
    kites: Floats

    @classmethod
    def about(cls, corners: Corners, rows: Ints, offset: Offset) -> Mitres:
        """Return the mitres at the outer corners with these rows; the other corners have none."""
        if len(rows) == 0:
            count = len(corners.turn)
            return cls(np.zeros(count), np.zeros(count, dtype=np.bool_), np.empty((0, 10)))
        half, d = -0.5 * corners.turn[rows], offset.distance_mm
        is_cut = offset.limit * np.cos(half) < 1.0
        reach, cut = np.zeros(len(corners.turn)), np.zeros(len(corners.turn), dtype=np.bool_)
        cut[rows] = is_cut
        cosine, sine = np.cos(half), np.sin(half)
        reach[rows] = d * np.where(is_cut, (offset.limit - cosine) / sine, np.tan(half))
        before, after = turn_left(corners.before[rows]), turn_left(corners.after[rows])
        middle = _rotate_vectors(before, -half)
        cut_distance = np.where(is_cut, offset.limit * d, np.inf)
        depth = np.full(len(rows), d)
        columns = [corners.place[rows], before, after, middle, depth, cut_distance]
        return cls(reach, cut, np.column_stack(columns))

    def lines(self, corners: Corners, is_arc: Bools, offset: Offset) -> tuple[Ints, Segments]:
        """Return the lines of mitres that are no parts of shifted lines, and the corner of each.

        They go on from a shifted arc, across where the mitre is cut off, and on to a shifted arc.
        `is_arc` (K, 2) is true if the segment before, or after, each corner is an arc."""
        if not self.reach.any():
            no_points = np.empty((0, 2))
            return np.empty(0, np.int64), Segments.between(no_points, no_points, np.empty(0))
        d, reach = offset.distance_mm, self.reach[:, None]
        left_foot = corners.place + d * turn_left(corners.before)
        right = corners.place + d * turn_left(corners.after)
        near_tip, far_tip = left_foot + reach * corners.before, right - reach * corners.after
        has_mitre = self.reach > 0.0
        is_drawn = np.column_stack([has_mitre & is_arc[:, 0], self.cut, has_mitre & is_arc[:, 1]])
        start, end = (
            np.stack([left_foot, near_tip, far_tip], axis=1),
            np.stack([near_tip, far_tip, right], axis=1),
        )
        is_drawn &= np.hypot(*np.moveaxis(end - start, 2, 0)) > NODE_EPS_MM
        corner = np.nonzero(is_drawn)[0]
        return corner, Segments.between(start[is_drawn], end[is_drawn], np.zeros(len(corner)))


def _rotate_vectors(vectors: Floats, angle: Floats) -> Floats:
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(cosine * vectors + sine * turn_left(vectors))


class RawOffset(Struct, frozen=True, eq=False):
    """`elements`: shifted segments and joins, in the order of travel. `source` (K,): the source
    segment of each, or the one before its corner; `join` (K,): true for what is put about a
    corner. `kites` (J, 10): what mitres cover (camtool.kernels.offsets)."""

    elements: Segments
    source: Ints
    join: Bools
    kites: Floats


def raw_offset(lines: Polylines, offset: Offset) -> RawOffset:
    """Return the raw offset of closed paths to the left: all of the offset, and much else that is
    too near to them.

    An arc that bends left with a radius up to the distance has nothing there: every point beyond
    its centre is nearer to another of its points. Inner corners need no join: the elements beside
    them cross, there or elsewhere."""
    segments = Segments.of(lines)
    frames = Frames.of(segments)
    corners = Corners.of(frames, lines)
    outer = np.flatnonzero(corners.outer(offset))
    rounded, mitred = (outer, outer[:0]) if math.isinf(offset.limit) else (outer[:0], outer)
    mitres = Mitres.about(corners, mitred, offset)
    rows, shifted = _shift_segments(segments, frames, corners, mitres, offset)
    arc_corners, arcs = arcs_about(corners, rounded, offset)
    arc_flags = np.column_stack([segments.is_arc, segments.is_arc[_next_rows(lines)]])
    along, across = mitres.lines(corners, arc_flags, offset)
    return _merge_by_source([rows, arc_corners, along], [shifted, arcs, across], mitres.kites)


def _shift_segments(
    segments: Segments, frames: Frames, corners: Corners, mitres: Mitres, offset: Offset
) -> tuple[Ints, Segments]:
    """Return the segments shifted by the distance, lines prolonged to the tips of mitres, and the
    source row of each."""
    start = segments.start + offset.distance_mm * frames.normal
    end = segments.end + offset.distance_mm * turn_left(corners.before)
    left_over = 1.0 - offset.distance_mm * frames.curvature
    lengths = np.hypot(*(end - start).T)
    rows = np.flatnonzero((left_over > 0.0) & (lengths > NODE_EPS_MM))
    reach = np.where(segments.is_arc, 0.0, mitres.reach)
    reach_back = np.where(segments.is_arc, 0.0, mitres.reach[corners.earlier])
    end += reach[:, None] * corners.before
    start -= reach_back[:, None] * frames.tangent
    return rows, Segments.between(start[rows], end[rows], segments.bulge[rows])


def _merge_by_source(sources: list[Ints], parts: list[Segments], kites: Floats) -> RawOffset:
    """Return shifted segments and joins merged in the order of their source segments."""
    source = np.concatenate(sources)
    order = np.argsort(source, kind="stable")
    elements = Segments.between(
        np.concatenate([part.start for part in parts])[order],
        np.concatenate([part.end for part in parts])[order],
        np.concatenate([part.bulge for part in parts])[order],
    )
    return RawOffset(elements, source[order], order >= len(sources[0]), kites)


# Stage 2: elements without the ends that are too near to the source.

TRIM_SPARE = 10.0
"""Ends that are too near by up to this many times VALIDITY_EPS_MM stay: the tips beyond the last
cut are judged invalid later."""


def trim_raw(raw: RawOffset, source: Arrays, offset: Offset) -> RawOffset:
    """Return the raw offset without what is surely too near to the source at both ends of each
    element.

    What is removed could never be kept, and what is kept is not cut by it: this only saves cuts,
    whose number would grow with the square of the number of elements where the distance is large
    against them."""
    spare = TRIM_SPARE * VALIDITY_EPS_MM
    ends = trimmed_ends(curve_rows_of(raw.elements), source, (offset.distance_mm, spare))
    low, high = ends.T
    keep = np.flatnonzero(low < high)
    trimmed = _cut_to_fractions(raw.elements[keep], low[keep], high[keep])
    return RawOffset(trimmed, raw.source[keep], raw.join[keep], raw.kites)


def _cut_to_fractions(elements: Segments, low: Floats, high: Floats) -> Segments:
    """Return the part of each element between two fractions, 0 and 1 for an element that stays
    whole."""
    cut = np.flatnonzero((low != 0.0) | (high != 1.0))
    start, end, bulge = elements.start.copy(), elements.end.copy(), elements.bulge.copy()
    start[cut] = point_at(elements, cut, low[cut])
    end[cut] = point_at(elements, cut, high[cut])
    bulge[cut] = np.tan(0.25 * elements.sweep[cut] * (high - low)[cut])
    return Segments.between(start, end, bulge)


# Stages 3 and 4: the raw offset cut wherever it meets itself, and which slices are kept.

SKEW = (0.850650808352040, 0.525731112119133)
"""Unit direction along which points are sorted: drawings have many of equal x or equal y."""


class Slices(Struct, frozen=True, eq=False):
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
        """Return the slices that a mask or indices select, with all nodes."""
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
        """Fractions (S, 2): t0 and t1 of each slice."""
        return np.column_stack([self.t0, self.t1])

    @property
    def ends(self) -> tuple[Ints, Ints, int]:
        """Nodes (S,) at which slices begin, nodes (S,) at which they end, and the number of
        nodes."""
        return self.from_node, self.to_node, len(self.nodes)


def slice_elements(elements: Segments, cutting_elements: Segments | None) -> Slices:
    """Return the elements cut wherever they meet each other or the `cutting_elements`."""
    eps = NODE_EPS_MM
    curves = IndexedCurves.of(elements, margin_mm=eps)
    pairs = pairs_of(curves.boxes, curves.tree, curves.boxes, curves.tree, True)
    meeting_rows, places = meetings_of(curves.rows, curves.rows, pairs, eps)
    rows = [meeting_rows[:, 0], meeting_rows[:, 1]]
    cuts = [places[:, [TA, X, Y]], places[:, [TB, X, Y]]]
    if cutting_elements is not None:
        cutting = IndexedCurves.of(cutting_elements, margin_mm=eps)
        pairs = pairs_of(curves.boxes, curves.tree, cutting.boxes, cutting.tree, False)
        meeting_rows, places = meetings_of(curves.rows, cutting.rows, pairs, eps)
        rows.append(meeting_rows[:, 0])
        cuts.append(places[:, [TA, X, Y]])
    return _cut_elements(elements, np.concatenate(rows), np.concatenate(cuts))


def _cut_elements(elements: Segments, rows: Ints, cuts: Floats) -> Slices:
    """Return the elements cut at `cuts` (J, 3): fraction, x and y on the element rows[j]."""
    count = len(elements)
    every = np.arange(count)
    # Ends come first, so that a node is at an end of an element rather than at a meeting.
    element = np.concatenate([every, every, rows])
    t = np.concatenate([np.zeros(count), np.ones(count), cuts[:, 0]])
    points = np.concatenate([elements.start, elements.end, cuts[:, 1:]])
    node, nodes = merge_points(points, 2.0 * NODE_EPS_MM)
    order = in_order(element, t, count)
    element, t, node = element[order], t[order], node[order]
    cut = (element[1:] == element[:-1]) & (node[1:] != node[:-1])
    before, after = np.flatnonzero(cut), np.flatnonzero(cut) + 1
    return Slices(element[before], t[before], t[after], node[before], node[after], nodes)


def merge_points(points: Floats, eps_mm: float) -> tuple[Ints, Floats]:
    """Return the node (P,) of each point (P, 2), and the nodes (N, 2), each the first point of its
    group.

    Points within `eps_mm` share a node, and so do chains of such points."""
    skew = points @ np.array(SKEW)
    node, first = merged(points, skew, np.argsort(skew), eps_mm)
    return node, points[first]


def valid_slices(slices: Slices, elements: Segments, source: Arrays, offset: Offset) -> Bools:
    """Return the mask (S,) of the slices of which no tested point is too near to the source, or
    within a mitre.

    A point is too near if it falls short of the distance, or lies in a kite, by more than
    VALIDITY_EPS_MM. The raw offset changes between valid and invalid only where it meets itself,
    so that one point would do; several guard against slices that are too near by hardly anything
    anywhere."""
    limits = (offset.distance_mm, VALIDITY_EPS_MM)
    curves = curve_rows_of(elements)
    return far_enough(curves, slices.element, slices.span, source, limits)


# Stages 5 and 6: kept slices joined to loops, and loops made clean paths.


def without_doubles(slices: Slices, elements: Segments) -> Slices:
    """Return the slices without repeated ones, and without pairs that run to and fro along each
    other.

    Such a pair encloses nothing: there the offset splits into two, or collapses to a line."""
    middle = 0.5 * (slices.t0 + slices.t1)
    eps = 2.0 * NODE_EPS_MM
    return slices[doubles_left(curve_rows_of(elements), slices.element, middle, slices.ends, eps)]


def without_dead_ends(slices: Slices) -> Slices:
    """Return the slices to whose begin another slice leads, and from whose end another one leads
    on."""
    return slices[leading_on(*slices.ends)]


def trace_loops(slices: Slices, elements: Segments) -> list[Ints]:
    """Return the rows of the slices of each loop, in order; no loop passes a node twice.

    At a node where several slices leave, the leftmost one is taken: the region that is far enough
    from the source is on the left, and parts of it that only touch become loops of their own. Each
    loop begins with its first slice, and they come in the order of these."""
    rows, begins = traced(curve_rows_of(elements), slices.element, slices.span, slices.ends)
    if len(rows) == 0:
        return []
    first, counts = begins[:-1], np.diff(begins)
    lowest = np.minimum.reduceat(rows, first)
    turn = np.flatnonzero(rows == np.repeat(lowest, counts)) - first
    place = np.arange(len(rows)) - np.repeat(first - turn, counts)
    rows = rows[np.repeat(first, counts) + place % np.repeat(counts, counts)]
    loops = [rows[low:high] for low, high in pairwise(begins.tolist())]
    return [loops[loop] for loop in np.argsort(lowest).tolist()]


def paths_of(loops: list[Ints], slices: Slices, elements: Segments) -> tuple[Polylines, Ints]:
    """Return clean closed paths of loops of slices, and the loop of each; successive slices of one
    element become one segment.

    Segments up to POSITION_EPS_MM are dropped, and so are paths of which nothing remains or whose
    mean width, area over half the length, is no more than that."""
    eps = POSITION_EPS_MM
    begins = np.concatenate([[0], np.cumsum([len(loop) for loop in loops])]).astype(np.int64)
    rows = np.concatenate([np.empty(0, dtype=np.int64), *loops])
    closed = np.ones(len(loops), dtype=np.bool_)
    columns = (slices.element, slices.span, slices.from_node, slices.to_node)
    vertices, offsets = written(columns, slices.nodes, elements.sweep, (rows, begins, closed), eps)
    has_vertices = np.diff(offsets) > 0
    lines = Polylines(
        vertices, np.concatenate([[0], offsets[1:][has_vertices]]), closed[has_vertices]
    )
    wide = np.abs(signed_areas(lines)) > 0.5 * eps * path_lengths(lines)
    loop = np.flatnonzero(has_vertices)
    return (lines, loop) if wide.all() else (lines.select(np.flatnonzero(wide)), loop[wide])
