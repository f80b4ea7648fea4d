"""The machined shape against the wanted shape, seen from above.

At the surface of the stock the tool removes what its cross-section there covers along its path: a
disc of its diameter, or for a V bit a disc that is larger the deeper the tip is. Overcut is
removed but should not be, undercut should be removed but is not. Each has an area and a depth: the
largest distance of its points from the other shape. The wanted shape is what the tool covers along
the wanted path, without what must stay (`ProtectedRegion`): where the plan itself cuts into a
drawn wall, that is overcut, however well the path is followed, and a finding (`OVERCUT`).

What a cylinder covers is found with true arcs (`swept_outline`), and so is what it should cover;
of V bits discs are put together, whose edges are chords. To be compared, outlines become chords
too, with the same tolerance for both shapes. Depths are therefore wrong by up to twice the
tolerance, and smaller depths are taken as 0. All depths of a job are seen as one. The predicted
path is the thinned trace, which needs enough points for its arcs (`points_wanted`)."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from itertools import groupby, pairwise
from operator import itemgetter
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.findings import Code, Finding, TargetCode
from camtool.geometry.boxes import BoxIndex, distances_from, moves_of
from camtool.geometry.measure import chords_of, segment_boxes, signed_areas
from camtool.geometry.offset import swept_outline
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments, without_repeats
from camtool.kernels.near import Moves
from camtool.machine.model import Machine
from camtool.planning.job import Tool
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Effects
from camtool.simulation.samples import PathSamples, move_lengths
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import STOCK_TOP_MM, Toolpath
from camtool.toolpath.wanted import ProtectedRegion
from camtool.verification.case import VerifyOptions
from camtool.verification.cuts import CutMoves, row_lengths
from camtool.verification.findings import OVERCUT
from camtool.verification.slides import SlideTrace

POLYGON = 3
"""The type of polygons in shapely; what two regions leave may have lines and points too."""

SHAPE_TOLERANCE_MM = 5e-4
"""The tolerance of chords, at most ..."""

TOLERANCE_SHARE = 2e-3
"""... and at most this share of the tool's radius."""

MIN_QUARTER_CHORDS = 8
"""A quarter of the tool's edge has at least this many chords."""

KEPT_SHARE = 0.25
"""The tolerance of chords for what must stay, as a part of the tolerance for cuts."""

KEPT_SLACK_MM = 1e-3
"""Protected areas shrink by this at their edges: carvings and tight slots are no more exact."""

DEPTH_SPACING_MM = 0.02
"""The depth of a strip is measured at points no farther apart than this ..."""

MAX_DEPTH_POINTS = 20_000
"""... but at no more than about this many points."""

OVERCUT_MM = 0.005
"""A plan that cuts into what must stay by more than this is an error."""

MAX_MOVES = 10_000
"""Programs with more cutting moves get no shape, since sweeping them would take longer than all
else ..."""

MAX_POINTS = 200_000
"""... and so do programs whose path would need more points than this, ..."""

MAX_CROSSINGS, MAX_PAIRS = 50_000, 3_000_000
"""... and those whose moves cross each other more often than the first number; about the second
number of pairs of moves is examined at most."""


SLIDE_SPACING_MM = 0.01
"""Heights along a V bit's path are taken at points no farther apart than this ..."""

MAX_SLIDE_SAMPLES = 200_000
"""... but at no more than about this many points."""


class MachinedShape(Struct, frozen=True):
    """Over- and undercut of the machined shape against the wanted one, mm and mm²; `tolerance_mm`:
    that of the chords."""

    diameter_mm: float
    overcut_mm2: float
    overcut_mm: float
    undercut_mm2: float
    undercut_mm: float
    tolerance_mm: float


class Cutter(Struct, frozen=True):
    """A tool seen from above: its diameter, and its shape if it is narrower at its tip."""

    diameter_mm: float
    nose: Tool | None = None

    @property
    def tolerance_mm(self) -> float:
        """The tolerance of chords, mm."""
        return min(SHAPE_TOLERANCE_MM, TOLERANCE_SHARE * 0.5 * self.diameter_mm)

    def radius_mm(self, z: Floats) -> Floats:
        """Return (J,) mm: the radius of the cut at the surface with the tip at the heights `z`
        (J,). With the tip at the surface itself it is the radius of the tip, with which a cut ends
        there."""
        half_diameter = 0.5 * self.diameter_mm
        if self.nose is None:
            return np.full(len(z), half_diameter)
        heights, which = np.unique(np.minimum(z, 0.0), return_inverse=True)
        wide = np.array([self.nose.radius_at(-height) for height in heights.tolist()])
        return np.where(z <= 0.0, np.minimum(wide[which], half_diameter), 0.0)

    @property
    def quarter(self) -> int:
        """Number of chords of a quarter of its edge."""
        sagitta = max(1.0 - self.tolerance_mm / (0.5 * self.diameter_mm), 0.0)
        return max(MIN_QUARTER_CHORDS, math.ceil(0.25 * math.pi / math.acos(sagitta)))


def cutter_of(options: VerifyOptions, cuts: CutMoves) -> Cutter | None:
    """Return the tool for these moves. A V bit of unknown diameter is as wide as the deepest cut
    needs. None if there is no tool, or it has no width."""
    diameter = options.tool_diameter_mm or 0.0
    if not diameter and options.nose is not None and len(cuts.ends_z):
        diameter = 2.0 * options.nose.radius_at(max(-float(cuts.ends_z.min()), 0.0))
    return Cutter(diameter, options.nose) if diameter else None


def points_wanted(decoded: CutMoves, cutter: Cutter | None) -> int | None:
    """Return the number of points that a trace of these moves needs for the shape; None without a
    tool, and if that would be too many.

    Chords of s mm are s²/(8 r) off an arc of radius r, so s ≤ √(8 r tolerance) for the smallest
    arc is enough. A trace has a point every 2 length / points mm, or up to twice as far apart, and
    one at the end of each move."""
    arcs = decoded.segments.is_arc
    if cutter is None or len(decoded.rows) > MAX_MOVES:
        return None
    points = 2 * len(decoded.toolpath)
    if arcs.any():
        min_radius = float(decoded.segments.radius[arcs].min())
        chord = math.sqrt(8.0 * min_radius * cutter.tolerance_mm)
        length = float(row_lengths(decoded.toolpath).sum())
        points += math.ceil(4.0 * length / chord)
    return points if points <= MAX_POINTS and not _cross_too_often(decoded.segments) else None


def _cross_too_often(segments: Segments) -> bool:
    """Return True if the chords of the segments cross each other more than `MAX_CROSSINGS` times;
    the search ends after `MAX_PAIRS` pairs."""
    boxes = segment_boxes(segments)
    looked_at = crossings = 0
    for rows in BoxIndex(boxes).pairs(boxes):
        (a, b), (c, d) = ((segments.start[row], segments.end[row]) for row in rows)
        is_crossing = _left_of(a, b, c) * _left_of(a, b, d) < 0.0
        is_crossing &= _left_of(c, d, a) * _left_of(c, d, b) < 0.0
        looked_at += len(a)
        crossings += int(np.count_nonzero(is_crossing)) // 2  # each pair comes twice
        if crossings > MAX_CROSSINGS or looked_at > MAX_PAIRS:
            break
    return crossings > MAX_CROSSINGS


def _left_of(start: Floats, end: Floats, point: Floats) -> Floats:
    """Return (J,) mm²: twice the signed area of the triangle of a line (J, 2), (J, 2) and a point
    (J, 2), positive if the point is on the left."""
    (along_x, along_y), (x, y) = (end - start).T, (point - start).T
    return np.asarray(along_x * y - along_y * x)


class WantedShape(Struct, frozen=True, eq=False):
    """The region (a shapely geometry) that a tool should remove; how deep (mm) the wanted path
    itself cuts into what must stay, and where."""

    cutter: Cutter
    region: Any
    beyond_mm: float
    at_mm: tuple[float, float]


def wanted_shape(
    cuts: CutMoves, cutter: Cutter, protected: Sequence[ProtectedRegion] = ()
) -> WantedShape | None:
    """Return the region that the tool covers along the wanted moves; with `protected`, along its
    runs, minus what must stay. None if nothing is cut."""
    import shapely

    if not protected:
        region = _swept_by(cuts.segments, cuts.ends_z, cutter)
        return None if region is None else WantedShape(cutter, region, 0.0, (0.0, 0.0))
    remains, losses = [], []
    for each in protected:
        region = _swept_by(*_cutting_moves(each, cutter), cutter)
        if region is None:
            continue
        solid = _protected_area(each, region, cutter.tolerance_mm)
        into = shapely.intersection(region, solid)
        remains.append(region if into.is_empty else shapely.difference(region, solid))
        losses.append(into)
    if not remains:
        return None
    region_wanted = remains[0] if len(remains) == 1 else shapely.union_all(remains)
    # What must stay for one operation may be removed by another.
    _, depth, at = _area_outside(shapely.union_all(losses), region_wanted, cutter.tolerance_mm)
    return WantedShape(cutter, region_wanted, depth, at)


def overcut_findings(
    shape: WantedShape | None, planned: Collection[Code | TargetCode]
) -> Iterator[Finding]:
    """Yield OVERCUT if the plan itself cuts into what must stay, unless planning has reported
    GOUGE (`planned`: the codes of its findings)."""
    if shape is None or shape.beyond_mm <= OVERCUT_MM or ProgramCode.GOUGE in planned:
        return
    x, y = shape.at_mm
    yield OVERCUT(where=f"near ({x:.3f}, {y:.3f}) mm", measured=shape.beyond_mm, limit=OVERCUT_MM)


def machined_shape(
    trace: SlideTrace, motion: CommandedMotion, goal: WantedShape
) -> MachinedShape | None:
    """Compare what the tool covers along the trace of a motion with what it should cover; None if
    nothing is cut."""
    cutter, tolerance = goal.cutter, goal.cutter.tolerance_mm
    runs = _runs(trace) if cutter.nose is None else _rows_with_heights(trace, motion)
    swept = _swept_by_runs(runs, cutter)
    if swept is None:
        return None
    over_mm2, over_mm, _ = _area_outside(swept, goal.region, tolerance)
    under_mm2, under_mm, _ = _area_outside(goal.region, swept, tolerance)
    return MachinedShape(cutter.diameter_mm, over_mm2, over_mm, under_mm2, under_mm, tolerance)


def _area_outside(
    one: Any, other: Any, tolerance: float
) -> tuple[float, float, tuple[float, float]]:
    """Return the area (mm²) of `one` outside `other`, the depth (mm) of that area and its place; 0
    for depths within the tolerance of chords."""
    import shapely

    rest = shapely.difference(one, other)
    nowhere = (0.0, 0.0)
    if rest.is_empty:
        return 0.0, 0.0, nowhere
    rings = shapely.get_rings(shapely.get_parts(other))
    if not len(rings):
        return float(rest.area), math.inf, nowhere
    points, ring = shapely.get_coordinates(rings, return_index=True)
    starts = np.flatnonzero(ring[1:] == ring[:-1])
    edges = Segments.between(points[starts], points[starts + 1], np.zeros(len(starts)))
    spacing_mm = max(rest.length / MAX_DEPTH_POINTS, DEPTH_SPACING_MM)
    depth, at_mm = _deepest(rest, moves_of(edges), spacing_mm)
    if depth <= 2.0 * tolerance:
        return 0.0, 0.0, nowhere
    return float(rest.area), depth, at_mm


def _deepest(region: Any, edges: Moves, spacing_mm: float) -> tuple[float, tuple[float, float]]:
    """Return the greatest distance (mm) of a region's boundary from the edges, and its place; the
    boundary is sampled at most `spacing_mm` apart.

    A strip may be deeper between its corners than at them. On a line between two corners no point
    is farther than half the sum of both distances and of its length, so most lines need no points.
    """
    import shapely

    parts = shapely.get_parts(region)
    rings = [shapely.get_rings(parts), parts[shapely.get_type_id(parts) != POLYGON]]
    corners, ring = shapely.get_coordinates(np.concatenate(rings), return_index=True)
    distance = distances_from(corners, edges)
    deepest = int(distance.argmax())
    starts = np.flatnonzero(ring[1:] == ring[:-1])
    lines = np.stack([corners[starts], corners[starts + 1]], axis=1)
    length = np.hypot(*(lines[:, 1] - lines[:, 0]).T)
    bound = 0.5 * (distance[starts] + distance[starts + 1] + length)
    is_asked = (length > spacing_mm) & (bound > distance[deepest])
    places, line = shapely.get_coordinates(
        shapely.segmentize(shapely.linestrings(lines[is_asked]), spacing_mm), return_index=True
    )
    places = places[1:-1][(line[1:-1] == line[:-2]) & (line[1:-1] == line[2:])]  # not its corners
    distance = np.append(distance[deepest], distances_from(places, edges))
    places = np.concatenate([corners[deepest][None], places])
    x, y = places[int(distance.argmax())].tolist()
    return float(distance.max()), (x, y)


class _Lines(Struct, frozen=True, eq=False):
    """Chords: points (P, 2) with their heights (P,), and the line (P,) that each belongs to."""

    points: Floats
    z: Floats
    line: Ints


def _swept_by(segments: Segments, ends_z: Floats, cutter: Cutter) -> Any:
    """Return the region that the tool covers at the surface along moves; `ends_z` (K, 2): the
    heights of their ends. None without moves."""
    if cutter.nose is None:
        return _swept_band(_joined(segments), cutter)
    return _swept_hulls(_chord_lines(segments, ends_z, cutter.tolerance_mm), cutter)


def _swept_band(paths: Polylines, cutter: Cutter) -> Any:
    """Return the region within the tool's radius of the paths; None without paths."""
    import shapely

    if len(paths) == 0:
        return None
    outline = swept_outline(paths, 0.5 * cutter.diameter_mm)
    if outline is not None:
        region = _inside_of(outline, cutter.tolerance_mm)
        if shapely.is_valid(region):
            return region
    if len(paths) > 1:
        # Passes that nearly repeat each other: alone each of them has an outline.
        passes = (paths.select(np.array([row])) for row in range(len(paths)))
        return shapely.union_all([_swept_band(path, cutter) for path in passes])
    segments = Segments.of(paths)
    no_depth = np.zeros((len(segments), 2))
    return _swept_hulls(_chord_lines(segments, no_depth, cutter.tolerance_mm), cutter)


def _inside_of(outline: Polylines, tolerance: float) -> Any:
    """Return the region on the left of closed paths that do not cross."""
    import shapely

    segments = Segments.of(outline)
    chords = chords_of(segments, tolerance)
    is_leaving = np.append(chords.segment[1:] == chords.segment[:-1], False)
    # Chords may leave nothing of a ring that is smaller than their tolerance.
    counts = np.bincount(segments.path[chords.segment[is_leaving]], minlength=len(outline))
    if counts.min(initial=3) < 3:
        return _inside_of(outline.select(np.flatnonzero(counts > 2)), tolerance)
    rings = shapely.linearrings(
        chords.points[is_leaving], indices=np.repeat(np.arange(len(counts)), counts)
    )
    is_outer = signed_areas(outline) > 0.0
    outer, holes = shapely.polygons(rings[is_outer]), rings[~is_outer]
    places = shapely.points(outline.vertices[outline.offsets[:-1][~is_outer], :2])
    holder, hole = shapely.STRtree(places).query(outer, predicate="intersects")
    # A hole belongs to the smallest of all that it lies in.
    order = np.lexsort((shapely.area(outer)[holder], hole))
    hole, first = np.unique(hole[order], return_index=True)
    holder = holder[order][first]
    by_holder = np.argsort(holder, kind="stable")
    ends = np.searchsorted(holder[by_holder], np.arange(len(outer) + 1))
    return shapely.multipolygons(
        [
            shapely.polygons(ring, holes[hole[by_holder[low:high]]])
            for ring, (low, high) in zip(rings[is_outer], pairwise(ends.tolist()), strict=True)
        ]
    )


def _swept_hulls(lines: _Lines, cutter: Cutter) -> Any:
    """Return the region that the tool covers at the surface along lines; None without lines.

    Between two neighbouring points the radius of a V bit changes evenly: it covers the convex hull
    of the discs at both; a ball nose on a slope covers a little more than that."""
    import shapely

    starts = np.flatnonzero(lines.line[1:] == lines.line[:-1])
    if len(starts) == 0:
        return None
    radius = np.maximum(cutter.radius_mm(lines.z), POSITION_EPS_MM)
    discs = shapely.buffer(shapely.points(lines.points), radius, quad_segs=cutter.quarter)
    pairs = np.stack([discs[starts], discs[starts + 1]], axis=1)
    return shapely.union_all(shapely.convex_hull(shapely.geometrycollections(pairs)))


class CommandedMotion(Struct, frozen=True, eq=False):
    """A toolpath as its controller commands it, and a machine with the effects that move its
    slides."""

    toolpath: Toolpath
    machine: Machine
    effects: Effects

    def slides(self) -> tuple[Ints, Floats, Floats]:
        """Return samples along the exact path: rows (K,), positions of the slides in XY (K, 2),
        mm, and commanded heights (K,), mm."""
        length = float(move_lengths(self.toolpath).sum())
        spacing = max(SLIDE_SPACING_MM, length / MAX_SLIDE_SAMPLES)
        samples = PathSamples(self.toolpath, spacing)
        row, commanded = samples.window(0, int(samples.first[-1]))
        mechanics = Mechanics(self.machine, self.toolpath.start, self.effects)
        slide, _ = mechanics.follow(commanded, np.array([0, len(commanded)]))
        return row, slide[:, :2], commanded[:, 2]


def _runs(trace: SlideTrace) -> list[tuple[Floats, Floats]]:
    """Return the cutting runs of a trace, each as points (J, 2), mm, and heights (J,) of 0; a run
    starts at the position before it."""
    which = np.flatnonzero(trace.cutting)
    if not len(which):
        return []
    runs = []
    for run in np.split(which, np.flatnonzero(np.diff(which) > 1) + 1):
        points = trace.points[max(int(run[0]) - 1, 0) : int(run[-1]) + 1]
        runs.append((points, np.zeros(len(points))))
    return runs


def _rows_with_heights(trace: SlideTrace, motion: CommandedMotion) -> list[tuple[Floats, Floats]]:
    """Return the cutting rows of a trace, each as points (J, 2), mm, and commanded heights (J,),
    mm. A row is divided where the slides wait while the height changes.

    The height is commanded along the path, not along the way of the slides: at a reversal a slide
    waits in its backlash while Z moves on. Slides simulated on the exact path tell how far along
    the trace each height is reached."""
    which = np.flatnonzero(trace.cutting)
    if not len(which):
        return []
    of_sample, slides, height = motion.slides()
    first = np.searchsorted(of_sample, np.arange(len(motion.toolpath) + 1))
    runs = []
    for run in np.split(which, np.flatnonzero(np.diff(trace.row[which]) != 0) + 1):
        points = trace.points[max(int(run[0]) - 1, 0) : int(run[-1]) + 1]
        row = int(trace.row[run[0]])
        samples = slice(first[row], first[row + 1])
        heights = np.append(motion.toolpath.starts_of(np.array([row]))[0, 2], height[samples])
        # The slides stand where the row before left them, which the trace has as its first point.
        begin = slides[first[row] - 1] if first[row] else points[0]
        slid, path_length = (
            _lengths(np.concatenate([begin[None], slides[samples]])),
            _lengths(points),
        )
        scale = path_length[-1] / slid[-1] if slid[-1] > 0.0 else 0.0
        places = np.column_stack([np.interp(slid * scale, path_length, axis) for axis in points.T])
        waits = np.diff(slid) <= 0.0
        ends = np.flatnonzero(np.diff(waits)) + 1
        for low, high in pairwise([0, *ends.tolist(), len(waits)]):
            runs.append((places[low : high + 1], heights[low : high + 1]))
    return runs


def _lengths(points: Floats) -> Floats:
    """Return (J,) mm: the distance of each point (J, 2) of a polyline from its start, along it."""
    return np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])


def _swept_by_runs(runs: Sequence[tuple[Floats, Floats]], cutter: Cutter) -> Any:
    """Return the region that the tool covers along runs, simplified within the tolerance; None
    without runs."""
    import shapely

    count = np.array([len(places) for places, _ in runs if len(places) > 1])
    if not len(count):
        return None
    solid = [np.column_stack(run) for run in runs if len(run[0]) > 1]
    lines = shapely.linestrings(
        np.concatenate(solid), indices=np.repeat(np.arange(len(count)), count)
    )
    flat, line = shapely.get_coordinates(
        # Simplified lines may cross themselves, which the outline allows.
        shapely.simplify(lines, 0.5 * cutter.tolerance_mm, preserve_topology=False),
        include_z=True,
        return_index=True,
    )
    if cutter.nose is not None:
        return _swept_hulls(_Lines(flat[:, :2], flat[:, 2], line), cutter)
    flat[:, 2] = 0.0  # not the height: the bulge
    is_open = np.zeros(len(count), dtype=np.bool_)
    is_distinct, _ = without_repeats(flat, np.bincount(line, minlength=len(count)), is_open)
    is_distinct &= np.bincount(line[is_distinct], minlength=len(count))[line] > 1
    offsets = np.append(0, np.cumsum(np.unique(line[is_distinct], return_counts=True)[1]))
    return _swept_band(Polylines(flat[is_distinct], offsets, is_open[: len(offsets) - 1]), cutter)


def _joined(segments: Segments) -> Polylines:
    """Return the paths of connected moves; a path is closed if it comes back to its start."""
    begins = np.ones(len(segments), dtype=np.bool_)
    begins[1:] = (segments.start[1:] != segments.end[:-1]).any(axis=1)
    first = np.flatnonzero(begins)
    last = np.append(first[1:], len(segments))[: len(first)] - 1
    is_closed = (segments.end[last] == segments.start[first]).all(axis=1)
    ends = last[~is_closed]
    vertices = np.column_stack([segments.start, segments.bulge])
    open_ends = np.column_stack([segments.end[ends], np.zeros(len(ends))])
    counts = np.diff(first, append=len(segments)) + ~is_closed
    return Polylines(
        np.insert(vertices, ends + 1, open_ends, axis=0),
        np.append(0, np.cumsum(counts)),
        is_closed,
    )


def _cutting_moves(protected: ProtectedRegion, cutter: Cutter) -> tuple[Segments, Floats]:
    """Return the cutting moves of the runs, and the heights (K, 2) of their ends. Of equal moves
    at several heights only one is kept, unless the tool is narrower at its tip."""
    rows = [np.hstack([run[:-1], run[1:]]) for run in protected.runs]
    moves = np.concatenate([np.empty((0, 8)), *rows])
    lowest = np.minimum(moves[:, 2], moves[:, 6])
    far = np.hypot(moves[:, 4] - moves[:, 0], moves[:, 5] - moves[:, 1]) > POSITION_EPS_MM
    moves = moves[far & (lowest < STOCK_TOP_MM)]
    if cutter.nose is None:
        _, first = np.unique(moves[:, [0, 1, 3, 4, 5]], axis=0, return_index=True)
        moves = moves[np.sort(first)]
    return Segments.between(moves[:, :2], moves[:, 4:6], moves[:, 3]), moves[:, [2, 6]]


def _protected_area(protected: ProtectedRegion, swept: Any, tolerance: float) -> Any:
    """Return the region that must stay near a swept one, shrunk by the depth that may be cut into
    it and by `KEPT_SLACK_MM`."""
    import shapely

    low_x, low_y, high_x, high_y = shapely.bounds(swept).tolist()
    wide = (high_x - low_x) + (high_y - low_y)
    box = shapely.box(low_x - wide, low_y - wide, high_x + wide, high_y + wide)
    region = box if protected.beyond else shapely.Polygon()
    for stays, lines in groupby(
        zip(protected.stays.tolist(), protected.lines, strict=True), itemgetter(0)
    ):
        areas = []
        for _, path in lines:
            segments = Segments.of(path)
            ring = _chord_lines(segments, np.zeros((len(segments), 2)), KEPT_SHARE * tolerance)
            areas.append(shapely.make_valid(shapely.Polygon(ring.points)))
        area = shapely.union_all(areas)
        region = shapely.union(region, area) if stays else shapely.difference(region, area)
    return shapely.buffer(region, -protected.into_mm - KEPT_SLACK_MM)


def _chord_lines(segments: Segments, ends_z: Floats, tolerance: float) -> _Lines:
    """Return lines and arcs as chords, with the heights (K, 2) of their ends."""
    chords = chords_of(segments, tolerance)
    low, high = ends_z[chords.segment].T
    return _Lines(chords.points, low + chords.share * (high - low), chords.segment)
