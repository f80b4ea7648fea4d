"""Registration: place a drawing under a program of unknown origin, and find the lines it cuts.

    moves of the program ─▶ samples of the cuts
    samples, drawing ─▶ shift       where the drawing's zero lies in the program
    samples, drawing ─▶ radius      of each tool: the distance at which its path keeps to the lines
    drawing, radius ─▶ tracks       each contour, and the paths beside it on both sides
    program, tracks ─▶ sides        the tracks that the program follows, and what is left of them
    program, tracks ─▶ wanted       the program, with each move along a track replaced by the track

So nothing but the drawing and the path decides. A tool whose centre stays farther from the nearest
line than its radius would leave stock there, and one that comes nearer would cut into the line:
the distance to the *nearest* line is the radius, however many lines there are.

Registration knows translations only. Where these do not do, the commonest other differences
(inches for millimetres, a mirror, a quarter turn) are tried and named, never applied."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints, distinct, distinct_rows
from camtool.errors import DrawingError
from camtool.findings import Finding, Severity
from camtool.geometry.boxes import near_points
from camtool.geometry.distance import nearest
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import (
    Frames,
    dot,
    path_extents,
    point_at,
    segment_boxes,
    segment_lengths,
    signed_areas,
    turn_left,
)
from camtool.geometry.offset import offset_each
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse,
    reverse_lines,
)
from camtool.kernels.passes import lifted
from camtool.planning.holes import circle_of
from camtool.planning.paths import Cuts, MeasuredPaths
from camtool.planning.paths import cuts as joined_moves
from camtool.records import replace
from camtool.toolpath.moves import Kind, Toolpath, are_arcs
from camtool.toolpath.wanted import UNKNOWN_EDGE, DrawnEdges
from camtool.verification.coverage import Side, at_point, block_name, first_items
from camtool.verification.cuts import CutMoves, loops, moves_across, sample_cuts
from camtool.verification.findings import (
    CUT_INTO_PART,
    CUTS_BESIDE,
    DRAWING_PLACE_AMBIGUOUS,
    DRAWING_PLACE_ELSEWHERE,
    DRAWING_PLACE_MOVED,
    DRAWING_PLACE_NOWHERE,
    DRAWING_PLACE_OTHERWISE,
    NOT_CUT,
    NOT_CUT_PART,
    OFF_DRAWING,
    TOOL_FOUND_OTHER,
    TOOL_FOUND_SEVERAL,
)
from camtool.verification.nearest import MoveIndex
from camtool.verification.report import FoundReport, FoundTool

NEAR_MM = 0.1
"""A move follows a track when it lies within this of it ..."""

NEAR_SHARE = 0.25
"""... and within this part of the radius, so that narrow tools are not taken for none, ..."""

NEAR_SIZE = 0.003
"""... and of the size of all that the program cuts, for small things have small details."""

MAX_RADIUS_MM = 30.0

BIN_MM = 0.01

MIN_PEAK_SHARE = 0.04
"""A distance is a candidate for the radius when this part of the path keeps it."""

MAX_CANDIDATES = 6

MIN_WALL_SHARE = 0.3
"""Of several distances along the same contours, the smallest that has this share of the length of
the longest is the finishing pass along the wall; the larger ones clear the way to it."""

MIN_ON_LINE_SHARE = 0.9
"""If the path runs on the lines for this share of all that keeps to the lines or a distance from
them, the tool has no radius."""

MIN_RIVAL_SHARE = 0.25
"""Two radii are ambiguous when the second explains, elsewhere, this share of what the first
explains."""

CUT_SHARE = 0.5
"""A track is followed when this part of it is cut; with less, the best side of a contour ..."""

PARTLY_SHARE = 0.15
"""... with at least this."""

MIN_SHARP_GAIN = 1e-3
"""A track with sharp corners replaces one with round corners if this share more of it is cut."""

SEARCH_POINTS = 3000
"""Number of points of the path that decide on its place."""

MAX_MARKS = 300
"""Number of boxes, and of centres and holes, of the program and of the drawing that are compared
in pairs."""

VOTE_MM = 0.25
"""Shifts that differ by less are one candidate."""

MAX_PLACES = 16

MIN_FOLLOWED_SHARE = 0.5
"""A drawing is in the right place if at least this share of the cuts follows its lines."""

MIN_OTHER_SHARE = 0.8
"""Another scale, mirror or turn is named if this share of the cuts would follow the lines."""

MIN_EQUAL_SHARE = 0.97
"""A second place is as good as the first if it explains this share of what the first explains."""

WIDTHS_MM = (1.0, 0.5, 0.25, 0.12, 0.08, 0.05, 0.05, 0.05)
"""Points within this distance of the track are used, in successive steps of Gauss and Newton."""

TRACK_MM = 0.1
"""Points along tracks are about this far apart, to see what is cut ..."""

MAX_TRACK_POINTS = 200_000
"""... but at no more than about this many points."""

MIN_LEFT_MM = 0.5
"""A part of a contour that is not cut is reported from this length on: ends of paths differ."""

TURNS = (
    ("--mirror y", np.diag([1.0, -1.0])),
    ("--mirror x", np.diag([-1.0, 1.0])),
    ("--rotate 90", np.array([[0.0, -1.0], [1.0, 0.0]])),
    ("--rotate 180", -np.eye(2)),
    ("--rotate 270", np.array([[0.0, 1.0], [-1.0, 0.0]])),
)
"""Flags, and the matrices that they apply to the drawing: tried where no shift fits."""

SCALES = (
    ("--scale 25.4", 25.4),
    ("--scale 0.03937008", 1.0 / 25.4),
    ("--scale 0.9375", 90.0 / 96.0),  # pixels of 96 in the place of 90 to an inch
    ("--scale 1.06666667", 96.0 / 90.0),
    ("--scale 0.75", 72.0 / 96.0),  # points for pixels
    ("--scale 1.33333333", 96.0 / 72.0),
    ("--scale 10", 10.0),
    ("--scale 0.1", 0.1),
    ("--scale 1000", 1000.0),
    ("--scale 0.001", 0.001),
)
"""Scales that units are mistaken by, tried where the sizes are about in that proportion: a circle
would follow any larger one, with a tool as wide."""

NEAR_SCALE_RATIO = 1.2
"""Proportions near 1 that differ by less are about the same: a tool adds its diameter ..."""

FAR_SCALE_RATIO = 3.0
"""... and so do others by less than this: not all of the drawing need be cut."""


class Registration(Struct, frozen=True, eq=False):
    """The result of a registration. `shift_mm`: how far the drawing is moved to lie under the
    program; the `wanted` moves; findings; the entry of the report; `diameter_mm` of the tool, None
    unless all cuts that follow the drawing are made with one tool."""

    shift_mm: tuple[float, float]
    wanted: Toolpath
    findings: tuple[Finding, ...]
    report: FoundReport
    diameter_mm: float | None


class _Lines(Struct, frozen=True, eq=False):
    """The M paths of a drawing: their segments, frames of these, boxes (M, 2, 2)."""

    paths: Polylines
    segments: Segments
    frames: Frames
    boxes: Floats

    @classmethod
    def of(cls, paths: Polylines) -> _Lines:
        segments = Segments.of(paths)
        return cls(paths, segments, Frames.of(segments), path_extents(paths))

    def signed_distances(self, points: Floats) -> tuple[Floats, Floats, Ints]:
        """Return for points (J, 2): (J,) mm, the signed distance from the nearest line, positive
        to its left; (J, 2), the unit direction in which it grows; (J,), the index of the nearest
        segment.

        Measured from the start of a segment of curvature k, with the point at x along the tangent
        and y along the left normal, the foot is atan2(k x, 1 − k y) / k along."""
        segment = nearest(points, self.segments).segment
        frames = self.frames[segment]
        q, k = points - frames.start, frames.curvature
        x, y = dot(q, frames.tangent), dot(q, frames.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            foot = np.where(k == 0.0, x, np.arctan2(k * x, 1.0 - k * y) / k)
        tries = np.stack([np.clip(foot, 0.0, frames.length), 0.0 * foot, frames.length])
        places = [point_at(self.segments, segment, each / frames.length) for each in tries]
        arms = points - np.stack(places)
        best = np.hypot(arms[..., 0], arms[..., 1]).argmin(axis=0)
        every = np.arange(len(points))
        offsets, share = arms[best, every], tries[best, every] / frames.length
        normal = turn_left(frames.tangent_at(share))
        distance = np.hypot(offsets[:, 0], offsets[:, 1])
        side = np.where(dot(offsets, normal) < 0.0, -1.0, 1.0)
        has_side = distance > POSITION_EPS_MM
        unit = offsets * (side / np.where(has_side, distance, 1.0))[:, None]
        return side * distance, np.where(has_side[:, None], unit, normal), segment


class _Path(Struct, frozen=True, eq=False):
    """The cuts of a program as sample points (S, 2), mm, with the length (S,) that each stands
    for, its row (S,) and tool (S,). For the search of the place: boxes (B, 2, 2) of closed parts,
    centres (A, 2) of arcs, and holes (H, 2)."""

    points: Floats
    length: Floats
    row: Indices
    tool: Ints
    boxes: Floats
    centres: Floats
    holes: Floats

    @classmethod
    def of(cls, program: Side, tool: Ints, limit_mm: float) -> _Path:
        cuts = program.cuts
        sizes = segment_lengths(cuts.segments)
        samples = sample_cuts(cuts, max(float(sizes.sum()) / MAX_TRACK_POINTS, TRACK_MM))
        counts = np.bincount(samples.segment, minlength=len(sizes))
        arcs = np.flatnonzero(cuts.segments.is_arc)
        row = cuts.row[samples.segment]
        return cls(
            samples.points,
            (sizes / np.maximum(counts, 1))[samples.segment],
            row,
            tool[row],
            _boxes_of(cuts, limit_mm),
            distinct_rows(cuts.segments[arcs].centre.round(3)),
            program.holes.places,
        )

    def transform(self, matrix: Floats) -> _Path:
        """Return the path with its points mapped by a matrix (2, 2)."""
        corners = self.boxes.transpose(0, 2, 1) @ matrix.T
        boxes = np.stack([corners.min(axis=1), corners.max(axis=1)], axis=2)
        grown = abs(float(np.linalg.det(matrix))) ** 0.5
        return replace(
            self,
            points=self.points @ matrix.T,
            length=self.length * grown,
            boxes=boxes,
            centres=self.centres @ matrix.T,
            holes=self.holes @ matrix.T,
        )

    def near_mm(self, radius_mm: float) -> float:
        """Return the distance, mm, within which a move counts as following a track of a tool with
        this radius."""
        size = 0.0 if not len(self.boxes) else float(np.hypot(*np.diff(self.boxes[0])[:, 0]))
        nearness = min(NEAR_MM, NEAR_SIZE * size) if size else NEAR_MM
        return min(nearness, NEAR_SHARE * radius_mm) if radius_mm > 0.0 else nearness

    def thin(self) -> _Path:
        """Return the path with at most `SEARCH_POINTS` points, evenly chosen."""
        every = max(1, -(-len(self.points) // SEARCH_POINTS))
        return replace(self, points=self.points[::every], length=self.length[::every])


def _boxes_of(cuts: CutMoves, limit_mm: float) -> Floats:
    """Return (B, 2, 2) mm: the box of everything, then for each contour the box of its loop, or of
    the whole contour if it has none."""
    contour_loops = loops(cuts, limit_mm)
    first, last = cuts.contour_ends()
    has_loop = contour_loops[:, 0] >= 0
    first, last = (
        np.where(has_loop, contour_loops[:, 0], first),
        np.where(has_loop, contour_loops[:, 1], last),
    )
    each = segment_boxes(cuts.segments)
    boxes = []
    for low, high in zip(cuts.first[first].tolist(), cuts.first[last + 1].tolist(), strict=True):
        rows = each[low:high]
        boxes.append((rows[:, :2].min(axis=0), rows[:, 2:].max(axis=0)))
    found_boxes = np.array(boxes).reshape(-1, 2, 2).transpose(0, 2, 1)
    if not len(found_boxes):
        return found_boxes
    total_box = np.column_stack(
        [found_boxes[:, :, 0].min(axis=0), found_boxes[:, :, 1].max(axis=0)]
    )
    return np.concatenate([total_box[None], found_boxes])


def register(
    decoded: Toolpath,
    drawing: Drawing,
    *,
    tool_diameter_mm: float | None,
    align: bool,
    limit_mm: float,
    flat_cuts: bool,
) -> Registration:
    """Find which lines of a drawing (in the work frame) a program cuts.

    `tool_diameter_mm`: the tool, None if it is to be found; `align`: the drawing may lie
    elsewhere, and its place is searched for. `limit_mm`: how far moves may be from a track without
    a finding. DrawingError for a drawing without lines."""
    if not len(drawing.paths.vertices):
        raise DrawingError(
            "holds single points alone, and no line that a program could follow",
            mend="say what the program does with them, with the flags of its job: --kind drill …",
        )
    running = decoded.first(decoded.executed_rows)
    program = Side.of(running, flat_cuts=flat_cuts)
    lines = _Lines.of(drawing.paths)
    path = _Path.of(program, _tools_of(running), limit_mm)
    if len(path.points) == 0 and len(path.holes) == 0:
        return _empty_registration(
            running, [DRAWING_PLACE_NOWHERE(measured=0.0, limit=100.0 * MIN_FOLLOWED_SHARE)]
        )
    shift: tuple[float, float] | None = (0.0, 0.0)
    findings: list[Finding] = []
    if align or tool_diameter_mm is None:
        shift, findings = _find_place(path, lines, align=align)
    if shift is None:
        return _empty_registration(running, findings)
    shifted = (
        Polylines.joined([_shift_lines(drawing.paths, shift)]) if any(shift) else drawing.paths
    )
    return _Follower(program, path, _Lines.of(shifted), drawing, limit_mm).registration(
        shift, findings, tool_diameter_mm, align=align
    )


def _shift_lines(lines: Polylines, shift: tuple[float, float]) -> Polylines:
    vertices = lines.vertices + np.array([*shift, 0.0])
    return Polylines(vertices, lines.offsets, lines.closed)


def _tools_of(toolpath: Toolpath) -> Ints:
    """Return (N,) the number of the tool mounted in each row, −1 before the first is mounted."""
    changes = toolpath.kind == Kind.TOOL_CHANGE
    latest = np.maximum.accumulate(np.where(changes, np.arange(len(changes)), -1))
    number = np.append(np.nan_to_num(toolpath.value, nan=-1.0), -1.0)
    return np.asarray(np.rint(number[latest]).astype(np.int64))


def _empty_registration(running: Toolpath, findings: Sequence[Finding]) -> Registration:
    """Return the registration of a program that follows nothing of the drawing, with findings that
    say so."""
    report = FoundReport(shift_mm=(0.0, 0.0), aligned=False, followed=0.0)
    return Registration((0.0, 0.0), running, tuple(findings), report, None)


# The place: candidates by what offsets keep, refined by all of the path.
#
# Offsets keep centres of arcs, and grow or shrink a box evenly on all sides; so centres of arcs,
# of circles and holes, and of boxes that grow alike in X and Y, each vote for a shift. From the
# best of these on, Gauss and Newton move the path until it keeps to the lines at one distance.


class _Place(Struct, frozen=True):
    """A shift of the drawing, and the share of the path that then follows its lines."""

    shift: tuple[float, float]
    share: float


def _find_place(
    path: _Path, lines: _Lines, *, align: bool
) -> tuple[tuple[float, float] | None, list[Finding]]:
    """Return the shift (x, y), mm, of the drawing under the program, None if none fits, and
    findings about it."""
    few = path.thin()
    as_drawn = _Place((0.0, 0.0), _followed_share(few, lines, np.zeros(2)))
    if not align and as_drawn.share >= MIN_FOLLOWED_SHARE:
        return as_drawn.shift, []
    refined = _refined_places(few, lines)
    best = max([as_drawn, *refined], key=lambda each: each.share)
    if as_drawn.share >= MIN_EQUAL_SHARE * best.share:
        best = as_drawn
    if best.share >= MIN_FOLLOWED_SHARE:
        if not align:
            x, y = best.shift
            return None, [
                DRAWING_PLACE_ELSEWHERE(
                    measured=100.0 * as_drawn.share, limit=100.0 * best.share, x=x, y=y
                )
            ]
        other = None if best.share >= MIN_OTHER_SHARE else _best_other_frame(few, lines)
        if other is not None and best.share < MIN_EQUAL_SHARE * other[1].share:
            return None, [
                DRAWING_PLACE_OTHERWISE(measured=100.0 * best.share, limit=100.0 * other[1].share,
                               flag=other[0])
            ]  # fmt: skip
        rivals = [] if best is as_drawn else _rival_places(best, refined)
        return best.shift, [
            DRAWING_PLACE_AMBIGUOUS(
                x=best.shift[0], y=best.shift[1], other_x=each.shift[0], other_y=each.shift[1],
                measured=100.0 * each.share, limit=100.0 * MIN_EQUAL_SHARE * best.share,
            )
            for each in rivals[:1]
        ]  # fmt: skip
    other = _best_other_frame(few, lines)
    if other is not None:
        return None, [
            DRAWING_PLACE_OTHERWISE(
                measured=100.0 * best.share, limit=100.0 * other[1].share, flag=other[0]
            )
        ]
    return None, [
        DRAWING_PLACE_NOWHERE(measured=100.0 * best.share, limit=100.0 * MIN_FOLLOWED_SHARE)
    ]


def _best_other_frame(path: _Path, lines: _Lines) -> tuple[str, _Place] | None:
    """Return the command-line flag of the scale, mirror or turn with which the path follows the
    drawing best, and its place; None if none fits well."""
    frames = []
    scales = [
        (flag, size * np.eye(2)) for flag, size in SCALES if _is_about_size(path, lines, size)
    ]
    for flag, matrix in (*TURNS, *scales):
        other = path.transform(np.linalg.inv(matrix))
        as_drawn = _Place((0.0, 0.0), _followed_share(other, lines, np.zeros(2)))
        places = (
            [as_drawn]
            if as_drawn.share >= MIN_OTHER_SHARE
            else [as_drawn, *_refined_places(other, lines)]
        )
        frames.append((flag, max(places, key=lambda each: each.share)))
    best = max(frames, key=lambda each: each[1].share)
    return best if best[1].share >= MIN_OTHER_SHARE else None


def _is_about_size(path: _Path, lines: _Lines, size: float) -> bool:
    """Return True if the cuts are roughly `size` times as large as the drawing."""
    if not len(path.boxes) or not len(lines.boxes):
        return False
    ratio = NEAR_SCALE_RATIO if 0.5 < size < 2.0 else FAR_SCALE_RATIO
    drawn = np.hypot(*(lines.boxes[:, :, 1].max(axis=0) - lines.boxes[:, :, 0].min(axis=0)))
    cut = np.hypot(*(path.boxes[0, :, 1] - path.boxes[0, :, 0]))
    return bool(size * drawn / ratio < cut < size * drawn * ratio)


def _rival_places(best: _Place, places: Sequence[_Place]) -> list[_Place]:
    """Return the other places that explain about as much of the path as the best, so that the
    place is ambiguous."""
    return [
        each
        for each in places
        if each.share >= MIN_EQUAL_SHARE * best.share
        and np.hypot(*np.subtract(each.shift, best.shift)) > 2.0 * VOTE_MM
    ]


def _refined_places(path: _Path, lines: _Lines) -> list[_Place]:
    """Return the candidate places of the drawing, refined, the one that explains most of the path
    first; places nearer than VOTE_MM count once."""
    places: list[_Place] = []
    for shift in _candidate_shifts(path, lines):
        refined = _refine_shift(path, lines, shift)
        if all(np.hypot(*(refined - each.shift)) > VOTE_MM for each in places):
            share = _followed_share(path, lines, refined)
            places.append(_Place((float(refined[0]), float(refined[1])), share))
    return sorted(places, key=lambda each: -each.share)


def _candidate_shifts(path: _Path, lines: _Lines) -> Floats:
    """Return (C, 2) mm: the shifts with the most votes from boxes, arc centres and holes."""
    drawn = _largest_boxes(lines.boxes)
    path_boxes = np.concatenate([path.boxes[:1], _largest_boxes(path.boxes[1:])])
    total_box = np.stack(
        [lines.boxes[:, :, 0].min(axis=0), lines.boxes[:, :, 1].max(axis=0)], axis=1
    )
    drawn = np.concatenate([total_box[None], drawn])
    votes, weights = [np.zeros((1, 2))], [np.zeros(1)]
    if len(path_boxes):
        size, their = np.diff(path_boxes)[..., 0], np.diff(drawn)[..., 0]
        grown = size[:, None] - their[None]
        room = VOTE_MM + 0.02 * their.max(axis=1)
        is_alike = np.abs(grown[..., 0] - grown[..., 1]) <= room
        is_alike &= np.abs(grown).max(axis=-1) <= 2.0 * MAX_RADIUS_MM
        is_alike[0, 0] = True
        i, j = np.nonzero(is_alike)
        votes.append(path_boxes[i].mean(axis=2) - drawn[j].mean(axis=2))
        weights.append(size[i].sum(axis=1))
    points = np.concatenate([path.centres, path.holes])[:MAX_MARKS]
    marks = _centres_of(lines)[:MAX_MARKS]
    if len(points) and len(marks):
        votes.append((points[:, None] - marks[None]).reshape(-1, 2))
        share = float(path.length.sum()) / len(points)
        weights.append(np.full(len(points) * len(marks), share))
    every, weight = np.concatenate(votes), np.concatenate(weights)
    # Votes that fall on two sides of a border are counted in the cells about it.
    cell = np.rint(every / VOTE_MM).astype(np.int64)
    names, cells = np.unique(cell, axis=0, return_inverse=True)
    total = np.bincount(cells.reshape(-1), weight)
    one, other = near_points(names.astype(np.float64), names.astype(np.float64), 1.5)
    neighbourhood = np.bincount(one, total[other], minlength=len(names))
    best = np.argsort(-neighbourhood, kind="stable")[: 4 * MAX_PLACES]
    middles: list[Floats] = []
    for cell_of in best.tolist():
        mine_of = one == cell_of
        is_near = np.isin(cells.reshape(-1), other[mine_of])
        heavy = weight[is_near]
        middle = every[is_near].mean(axis=0)
        if heavy.sum() > 0.0:
            middle = (every[is_near] * heavy[:, None]).sum(axis=0) / heavy.sum()
        if all(np.hypot(*(middle - each)) > VOTE_MM for each in middles):
            middles.append(middle)
        if len(middles) == MAX_PLACES:
            break
    return np.array(middles)


def _largest_boxes(boxes: Floats) -> Floats:
    """Return the `MAX_MARKS` largest of the boxes."""
    size = np.diff(boxes)[..., 0].sum(axis=1)
    return boxes[np.argsort(-size, kind="stable")[:MAX_MARKS]]


def _centres_of(lines: _Lines) -> Floats:
    """Return (K, 2) mm: the centres of all arcs."""
    arcs = np.flatnonzero(lines.segments.is_arc)
    return distinct_rows(lines.segments[arcs].centre.round(3))


def _refine_shift(path: _Path, lines: _Lines, shift: Floats) -> Floats:
    """Return a shift, improved step by step until the path keeps to the lines, or to a single
    distance from them."""
    shift = np.array(shift, dtype=np.float64)
    for width in WIDTHS_MM:
        distance, normal, _ = lines.signed_distances(path.points - shift)
        distances = np.abs(distance)
        radius = _peak_distance(distances, path.length, width)
        side = np.where(distance < 0.0, -1.0, 1.0)
        is_beside = np.abs(distances - radius) < width
        along = (distances < width) & ~is_beside
        offsets = np.where(is_beside, distances - radius, distance)
        grows = np.where(is_beside[:, None], side[:, None] * normal, normal)
        used_rows = np.flatnonzero(is_beside | along)
        if len(used_rows) < 3:
            break
        weight = np.sqrt(path.length[used_rows])
        columns = np.column_stack([grows[used_rows], is_beside[used_rows] & (radius > width)])
        solved = np.linalg.lstsq(
            columns * weight[:, None], offsets[used_rows] * weight, rcond=1e-6
        )[0]
        shift += solved[:2]
    return shift


def _peak_distance(distances: Floats, length: Floats, width: float) -> float:
    """Return the distance from the lines that most of the path keeps, to within `width`; 0 if it
    runs on the lines."""
    bins = max(width, BIN_MM)
    bin_of, counts = _distance_histogram(distances, length, bins)
    pairs = counts + np.append(counts[1:], 0.0)
    peak = int(pairs.argmax())
    is_near = (bin_of == peak) | (bin_of == peak + 1)
    middle = (
        float(np.average(distances[is_near], weights=length[is_near])) if is_near.any() else 0.0
    )
    return middle if middle > width else 0.0


def _distance_histogram(distances: Floats, length: Floats, bins: float) -> tuple[Ints, Floats]:
    """Return the bin of each distance, and the length of the path in each bin. The last bin, for
    distances farther than any tool is wide, counts as empty."""
    max_bin = int(MAX_RADIUS_MM / bins) + 2
    bin_of = np.minimum(distances / bins, max_bin).astype(np.int64)
    counts = np.bincount(bin_of, length, minlength=max_bin + 1).astype(np.float64)
    counts[-1] = 0.0
    return bin_of, counts


def _followed_share(path: _Path, lines: _Lines, shift: Floats) -> float:
    """Return the share of the path that keeps to the lines, or to a single distance from them;
    without cuts, the share of the holes that lie on the centres of arcs."""
    if len(path.points) == 0:
        drilled = near_points(path.holes - shift, _centres_of(lines), NEAR_MM)[0]
        return len(distinct(drilled)) / max(len(path.holes), 1)
    distances = np.abs(lines.signed_distances(path.points - shift)[0])
    radius = _peak_distance(distances, path.length, 2.0 * path.near_mm(0.0))
    nearness = path.near_mm(radius)
    fine = (np.abs(distances - radius) <= nearness) | (distances <= nearness)
    return float(path.length[fine].sum() / path.length.sum())


# Tracks, and the radius that goes with the path.


class _Tracks(Struct, frozen=True, eq=False):
    """T tracks: their paths, the contour (T,) of each, and its side (T,): −1 within it (or right
    of an open one), 0 on it, 1 outside (or left), and whether its corners are sharp (T,)."""

    paths: Polylines
    contour: Ints
    side: Ints
    sharp: Bools

    def select(self, indices: Ints) -> _Tracks:
        return _Tracks(
            self.paths.select(indices),
            self.contour[indices],
            self.side[indices],
            self.sharp[indices],
        )

    @classmethod
    def joined(cls, parts: Sequence[_Tracks]) -> _Tracks:
        return cls(
            Polylines.joined([each.paths for each in parts]),
            *(
                np.concatenate([getattr(each, name) for each in parts])
                for name in ("contour", "side", "sharp")
            ),
        )


def _tracks_of(lines: Polylines, radius_mm: float, contours: Ints) -> _Tracks:
    """Return the tracks of a tool of this radius beside the contours of these indices, or on them
    for a radius of 0.

    Closed contours have round and sharp corners outside; an open one has one track that goes round
    it."""
    if radius_mm == 0.0:
        zeros = np.zeros(len(contours), dtype=np.int64)
        return _Tracks(lines.select(contours), contours, zeros, zeros.astype(np.bool_))
    parts = []
    closed, open_ = contours[lines.closed[contours]], contours[~lines.closed[contours]]
    if len(closed):
        ccw = _orient_ccw(lines.select(closed))
        for side, joins in ((-1, "round"), (1, "round"), (1, "sharp")):
            paths, sources = offset_each(ccw, -side * radius_mm, joins=joins)
            if len(paths):
                sides = np.full(len(sources), side)
                sharp = np.full(len(sources), joins == "sharp")
                parts.append(_Tracks(paths, closed[sources], sides, sharp))
    if len(open_):
        doubled = Polylines.of([_doubled_path(path) for path in lines.select(open_)])
        paths, sources = offset_each(doubled, -radius_mm)
        if len(paths):
            one = np.ones(len(sources), dtype=np.int64)
            parts.append(
                _Tracks(paths, open_[sources], one, np.zeros(len(sources), dtype=np.bool_))
            )
    if not parts:
        empty = np.empty(0, dtype=np.int64)
        return _Tracks(lines.select(empty), empty, empty, empty.astype(np.bool_))
    return _Tracks.joined(parts)


def _orient_ccw(lines: Polylines) -> Polylines:
    """Return closed paths with the clockwise ones reversed."""
    return reverse_lines(lines, np.asarray(signed_areas(lines) < 0.0))


def _doubled_path(path: Polyline) -> Polyline:
    """Return an open path as a closed one that runs there and back."""
    vertices_back = reverse(path).vertices
    return Polyline(np.concatenate([path.vertices[:-1], vertices_back[:-1]]), closed=True)


def _is_on_track(points: Floats, tracks: _Tracks, near_mm: float) -> Bools:
    """Return the mask (J,) of points within `near_mm` of a track."""
    if len(tracks.paths) == 0:
        return np.zeros(len(points), dtype=np.bool_)
    return np.asarray(nearest(points, Segments.of(tracks.paths)).distance <= near_mm)


def _candidate_radii(distances: Floats, length: Floats) -> list[float]:
    """Return the distances from the nearest line that large parts of the path keep, the most kept
    first."""
    bin_of, counts = _distance_histogram(distances, length, BIN_MM)
    min_length = MIN_PEAK_SHARE * float(length.sum())
    radii: list[float] = []
    for _ in range(MAX_CANDIDATES):
        neighbourhood = np.convolve(counts, np.ones(5), mode="same")
        peak = int(neighbourhood.argmax())
        if neighbourhood[peak] < min_length:
            break
        is_near = np.abs(bin_of - peak) <= 2
        middle = float(np.average(distances[is_near], weights=length[is_near] + 1e-12))
        radii.append(middle if middle > 2.0 * BIN_MM else 0.0)
        counts[max(peak - 4, 0) : peak + 5] = 0.0
    return list(dict.fromkeys(radii))


class _RadiusTrial(Struct, frozen=True, eq=False):
    """A trial of a tool's radius: the tracks that are followed with it, and the mask (S,) of the
    points that follow them."""

    radius_mm: float
    tracks: _Tracks
    follows: Bools
    length_mm: float

    @property
    def keys(self) -> set[tuple[int, int]]:
        """Contour and side of each track."""
        return set(zip(self.tracks.contour.tolist(), self.tracks.side.tolist(), strict=True))


class _Cells(Struct, frozen=True, eq=False):
    """Points along T tracks: the track (C,), place (C, 2) mm, the length (C,) mm that each stands
    for, and whether it is cut at any depth (C,)."""

    track: Ints
    places: Floats
    length: Floats
    cut: Bools

    def share(self, count: int) -> Floats:
        """Return (T,) the share of each track that is cut; `count`: the number of tracks."""
        total_mm = np.bincount(self.track, self.length, minlength=count)
        return np.asarray(
            np.bincount(self.track, self.length * self.cut, minlength=count)
            / np.where(total_mm > 0.0, total_mm, 1.0)
        )


class _FollowedTracks(Struct, frozen=True, eq=False):
    """The tracks that a program follows, with the radius (T,) mm and the tool (T,) of each, and
    their cells."""

    tracks: _Tracks
    radius_mm: Floats
    tool: Ints
    cells: _Cells


class _Follower(Struct, frozen=True, eq=False):
    """A program and a drawing that lies under it in the right place."""

    program: Side
    path: _Path
    lines: _Lines
    drawing: Drawing
    limit_mm: float

    @property
    def cuts(self) -> CutMoves:
        """The cutting moves of the program."""
        return self.program.cuts

    def registration(
        self,
        shift: tuple[float, float],
        place_findings: Sequence[Finding],
        tool_diameter_mm: float | None,
        *,
        align: bool,
    ) -> Registration:
        """Return the registration; `place_findings` are the findings on the place of the
        drawing."""
        findings = list(place_findings)
        if align and not findings and np.hypot(*shift) > self.limit_mm:
            findings.append(DRAWING_PLACE_MOVED(x=shift[0], y=shift[1]))
        radius = None if tool_diameter_mm is None else 0.5 * tool_diameter_mm
        parts, tools = [], []
        for number in distinct(self.path.tool).tolist():
            own_points = np.flatnonzero(self.path.tool == number)
            trial, remarks = self._radius(own_points, radius)
            findings += remarks
            if trial is None:
                continue
            tools.append(FoundTool(number if number >= 0 else None, 2.0 * trial.radius_mm,
                                   tool_diameter_mm is not None))  # fmt: skip
            parts.append((trial, number))
        followed = self._join_trials(parts)
        drilled = self._drilled_circles(followed)
        cuts_toolpath, offsets = self.cuts.toolpath, np.empty(0)
        rows = np.zeros(len(cuts_toolpath), dtype=np.bool_)
        if followed is not None:
            follow = _RowTracks.of(self.cuts, followed, self.path)
            cuts_toolpath, offsets, rows = (
                _with_tracks(self, followed, follow),
                follow.offsets,
                follow.rows,
            )
        if followed is not None or drilled.any():
            findings += self._not_cut_findings(followed, drilled)
        if followed is not None:
            findings += self._into_part_findings(followed, rows)
        findings += self._beside_findings(rows, offsets)
        beside_mm = float(self._row_lengths()[self.cuts.is_cut & ~rows].sum())
        total_mm = float(self._row_lengths()[self.cuts.is_cut].sum())
        has_error = any(each.severity == Severity.ERROR for each in findings)
        if total_mm and beside_mm > (1.0 - MIN_FOLLOWED_SHARE) * total_mm and not has_error:
            findings.append(DRAWING_PLACE_NOWHERE(measured=100.0 * (1.0 - beside_mm / total_mm),
                                          limit=100.0 * MIN_FOLLOWED_SHARE))  # fmt: skip
        report = FoundReport(
            shift_mm=shift,
            aligned=align,
            followed=1.0 - beside_mm / total_mm if total_mm else 0.0,
            beside_mm=beside_mm,
            tools=tuple(tools),
            **_side_counts(followed, drilled, len(self.lines.paths)),
            off_max_um=1000.0 * float(offsets.max()) if len(offsets) else None,
            off_rms_um=1000.0 * float(np.sqrt(np.mean(offsets**2))) if len(offsets) else None,
        )
        widths = {each.diameter_mm for each in tools}
        width = widths.pop() if len(widths) == 1 else None
        return Registration(shift, cuts_toolpath, tuple(findings), report, width or None)

    def _row_lengths(self) -> Floats:
        """Return (N,) mm: the length of the cuts of each row."""
        sizes = segment_lengths(self.cuts.segments)
        lengths: Floats = np.bincount(
            self.cuts.row, sizes, minlength=len(self.cuts.contour)
        ).astype(np.float64)
        return lengths

    def _radius(
        self, indices: Ints, given_mm: float | None
    ) -> tuple[_RadiusTrial | None, list[Finding]]:
        """Return the radius with which most of the points `indices` follow tracks, with these
        tracks (None if none fits), and findings."""
        points, length = self.path.points[indices], self.path.length[indices]
        distances = np.abs(self.lines.signed_distances(points)[0])
        radii = _candidate_radii(distances, length)
        if given_mm is not None:
            radius_used = min(radii, key=lambda each: abs(each - given_mm), default=given_mm)
            if abs(radius_used - given_mm) > self.limit_mm and radius_used > 0.0:
                remarks = [TOOL_FOUND_OTHER(measured=2.0 * radius_used, limit=2.0 * given_mm)]
            else:
                remarks = []
            return self._try_radius(
                points, length, given_mm, abs(radius_used - given_mm) if radius_used else 0.0
            ), remarks
        tries = [self._try_radius(points, length, each, 0.0) for each in radii]
        tries = [each for each in tries if each.length_mm > 0.0]
        if not tries:
            return None, []
        best = max(tries, key=lambda each: each.length_mm)
        on_lines = [each for each in tries if not each.radius_mm]
        if on_lines and on_lines[0].length_mm >= MIN_ON_LINE_SHARE * best.length_mm:
            return on_lines[0], []
        for smaller in sorted(tries, key=lambda each: each.radius_mm):
            less = smaller.radius_mm < best.radius_mm and smaller.radius_mm > 0.0
            if (
                less
                and smaller.length_mm >= MIN_WALL_SHARE * best.length_mm
                and best.keys & smaller.keys
            ):
                best = smaller
                break
        remarks = []
        for other in tries:
            extra_mm = float(length[other.follows & ~best.follows].sum())
            if other is best or not other.radius_mm or not other.keys - best.keys:
                continue
            other_keys = {key for key in other.keys if key not in best.keys}
            if extra_mm >= MIN_RIVAL_SHARE * best.length_mm and len(other_keys) >= len(
                other.keys & best.keys
            ):
                remarks.append(
                    TOOL_FOUND_SEVERAL(
                        measured=2.0 * best.radius_mm, other=2.0 * other.radius_mm,
                        share=best.length_mm / float(length.sum()),
                        other_share=extra_mm / float(length.sum()),
                    )
                )  # fmt: skip
                break
        return best, remarks

    def _try_radius(
        self, points: Floats, length: Floats, radius: float, slack: float
    ) -> _RadiusTrial:
        """Return the trial of a radius: the tracks that are followed, and the points that follow
        them."""
        nearness = self.path.near_mm(radius) + slack
        count = len(self.lines.paths)
        every = np.arange(count)
        tracks = _tracks_of(self.lines.paths, 0.0, every)
        if radius > 0.0:
            reached = self._contours_at(points, radius, nearness)
            tracks = _Tracks.joined(
                [tracks, _tracks_of(self.lines.paths, radius, np.flatnonzero(reached))]
            )
        cells = self._cells(tracks, nearness)
        indices = _sides_followed(tracks, cells.share(len(tracks.paths)))
        tracks = tracks.select(indices)
        follows = _is_on_track(points, tracks, nearness)
        return _RadiusTrial(radius, tracks, follows, float(length[follows].sum()))

    def _contours_at(self, points: Floats, radius: float, nearness: float) -> Bools:
        """Return the mask (M,) of contours to which any of the points comes as near as the
        radius."""
        is_reached = np.zeros(len(self.lines.paths), dtype=np.bool_)
        distances, _, segment = self.lines.signed_distances(points)
        is_reached[
            distinct(self.lines.segments.path[segment[np.abs(distances) <= radius + nearness]])
        ] = True
        return is_reached

    def _cells(self, tracks: _Tracks, nearness: float) -> _Cells:
        """Return points along the tracks, and the mask of those that the program cuts."""
        segments = Segments.of(tracks.paths)
        sizes = segment_lengths(segments)
        spacing = max(TRACK_MM, float(sizes.sum()) / MAX_TRACK_POINTS)
        parts = np.maximum(np.ceil(sizes / spacing).astype(np.int64), 2)
        owner = np.repeat(np.arange(len(sizes)), parts)
        steps = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
        places = point_at(segments, owner, (steps + 0.5) / parts[owner])
        nearest = self.program.moves.nearest(
            places, np.zeros(len(places)), None, (nearness, np.inf)
        )
        cut = np.isfinite(nearest.distance)
        return _Cells(segments.path[owner], places, (sizes / parts)[owner], cut)

    def _join_trials(self, parts: Sequence[tuple[_RadiusTrial, int]]) -> _FollowedTracks | None:
        """Return the followed tracks of all tools, those that run on a line once; None if there
        are none."""
        parts = [(trial, number) for trial, number in parts if len(trial.tracks.paths)]
        if not parts:
            return None
        tracks = _Tracks.joined([trial.tracks for trial, _ in parts])
        counts = [len(trial.tracks.paths) for trial, _ in parts]
        radius = np.repeat([trial.radius_mm for trial, _ in parts], counts)
        radius = np.where(tracks.side == 0, 0.0, radius)
        tool = np.repeat([number for _, number in parts], counts)
        keys = np.column_stack([tracks.contour, tracks.side, np.rint(radius / POSITION_EPS_MM)])
        order = np.arange(len(keys))
        first = [k for k in order if k == int(np.flatnonzero((keys == keys[k]).all(axis=1))[0])
                 or tracks.side[k] != 0]  # fmt: skip
        unique = np.array(first, dtype=np.int64)
        tracks, radius, tool = tracks.select(unique), radius[unique], tool[unique]
        nearness = max(self.path.near_mm(float(each)) for each in radius)
        return _FollowedTracks(tracks, radius, tool, self._cells(tracks, nearness))

    def _drilled_circles(self, followed: _FollowedTracks | None) -> Bools:
        """Return the mask (M,) of circles that have a drilled hole in their middle and are not
        cut."""
        is_drilled = np.zeros(len(self.lines.paths), dtype=np.bool_)
        holes = self.path.holes
        if not len(holes):
            return is_drilled
        cut = set() if followed is None else set(followed.tracks.contour.tolist())
        for index, path in enumerate(self.lines.paths):
            circle = None if index in cut else circle_of(path)
            if circle is not None:
                distance = np.hypot(*(holes - np.array(circle[0])).T).min()
                is_drilled[index] = distance <= max(NEAR_MM, self.limit_mm)
        return is_drilled

    def _not_cut_findings(
        self, followed: _FollowedTracks | None, drilled: Bools
    ) -> Iterator[Finding]:
        """Yield a finding for each contour that is not cut, and for each that is only
        partly cut."""
        count = len(self.lines.paths)
        cut = np.zeros(count, dtype=np.bool_)
        if followed is not None:
            cut[distinct(followed.tracks.contour)] = True
        for index, other_count in first_items(np.flatnonzero(~cut & ~drilled).tolist()):
            yield NOT_CUT(
                where=at_point(self.lines.boxes[index].mean(axis=1)),
                contour=self.name(index),
                more=other_count,
            )
        if followed is None:
            return
        cells, tracks = followed.cells, followed.tracks
        count = len(tracks.paths)
        total_mm = np.bincount(cells.track, cells.length, minlength=count)
        uncut_mm = total_mm * (1.0 - cells.share(count))
        # What is left of a contour is measured on its variant that is cut most.
        order = np.lexsort((uncut_mm, tracks.contour))
        first = order[np.flatnonzero(np.diff(tracks.contour[order], prepend=-1))]
        uncut_tracks = first[uncut_mm[first] >= MIN_LEFT_MM]
        for track, other_count in first_items(uncut_tracks.tolist()):
            places = cells.places[(cells.track == track) & ~cells.cut]
            yield NOT_CUT_PART(
                where=at_point(places[len(places) // 2]),
                contour=self.name(int(tracks.contour[track])),
                measured=float(uncut_mm[track]),
                share=float(uncut_mm[track] / total_mm[track]),
                more=other_count,
            )

    def _into_part_findings(self, followed: _FollowedTracks, rows: Bools) -> Iterator[Finding]:
        """Yield CUT_INTO_PART for moves that follow no track and cut into a part: contours cut
        along one side define where the tool must stay, and the move comes nearer than the tool's
        radius, or is on the wrong side."""
        lines, loose = self.lines, np.flatnonzero(~rows[self.path.row])
        if not len(loose):
            return
        distances, _, segment = lines.signed_distances(self.path.points[loose])
        contour = lines.segments.path[segment]
        ccw = np.zeros(len(lines.paths), dtype=np.bool_)
        closed = np.flatnonzero(lines.paths.closed)
        ccw[closed] = signed_areas(lines.paths.select(closed)) > 0.0
        outward = np.where(ccw[contour], -distances, distances)
        room = np.full((len(lines.paths), 2), np.nan)  # within it, and outside
        sided = np.flatnonzero(followed.tracks.side != 0)
        contours = followed.tracks.contour[sided]
        room[contours, (followed.tracks.side[sided] + 1) // 2] = followed.radius_mm[sided]
        tool = np.zeros(len(lines.paths), dtype=np.int64)
        tool[contours] = followed.tool[sided]
        one = np.isfinite(room).sum(axis=1) == 1
        side = np.where(np.isfinite(room[:, 1]), 1.0, -1.0)
        radius = np.nanmax(np.where(np.isfinite(room), room, -1.0), axis=1)
        gouge_mm = radius[contour] - side[contour] * outward
        is_judged = one[contour] & lines.paths.closed[contour]
        is_judged &= self.path.tool[loose] == tool[contour]
        depths = np.where(is_judged, gouge_mm, -1.0)
        row = self.path.row[loose]
        order = np.lexsort((-depths, row))
        worst = order[np.flatnonzero(np.diff(row[order], prepend=-1))]
        gouges = worst[depths[worst] > max(self.limit_mm, self.path.near_mm(0.0))]
        for k, other_count in first_items(gouges.tolist()):
            place = at_point(self.path.points[loose[k]])
            yield CUT_INTO_PART(
                where=f"{block_name(self.cuts.toolpath, int(row[k]))} at {place}",
                contour=self.name(int(contour[k])),
                measured=float(depths[k]),
                limit=self.limit_mm,
                more=other_count,
            )

    def _beside_findings(self, rows: Bools, offsets: Floats) -> Iterator[Finding]:
        """Yield CUTS_BESIDE for cuts that follow no track, and OFF_DRAWING if the tracks are
        followed at a distance (`offsets` (J,), mm) beyond the limit."""
        length, toolpath = self._row_lengths(), self.cuts.toolpath
        loose = np.flatnonzero(self.cuts.is_cut & ~rows)
        if len(loose) and rows.any():
            worst = int(loose[length[loose].argmax()])
            yield CUTS_BESIDE(
                where=f"{block_name(toolpath, worst)} at {at_point(toolpath.end[worst])}",
                measured=float(length[loose].sum()),
                moves=len(loose),
            )
        if len(offsets) and offsets.max() > self.limit_mm:
            yield OFF_DRAWING(measured=float(offsets.max()), limit=self.limit_mm)

    def name(self, index: int) -> str:
        """Return the name `layer/entity` of a contour."""
        layer, source = self.drawing.layers[index], self.drawing.sources[index]
        return f"{layer}/{source}"


def _sides_followed(tracks: _Tracks, share: Floats) -> Ints:
    """Return the indices of the tracks that are followed: for each side with enough of its track
    cut, the variant (round or sharp corners) that is cut most; for a contour without such a side,
    the track that is cut most."""
    best: dict[tuple[int, int, int], int] = {}
    for k, (contour, side) in enumerate(
        zip(tracks.contour.tolist(), tracks.side.tolist(), strict=True)
    ):
        # Inside, one contour may have several tracks; all of those that are cut count.
        name = contour, side, k if side < 0 else -1
        if name not in best or share[k] > share[best[name]] + MIN_SHARP_GAIN:
            best[name] = k
    selection: list[int] = []
    partly: dict[int, int] = {}
    for (contour, _, _), k in best.items():
        if share[k] >= CUT_SHARE:
            selection.append(k)
        elif share[k] >= PARTLY_SHARE:
            other = partly.get(contour)
            if other is None or share[k] > share[other]:
                partly[contour] = k
    with_side = set(tracks.contour[selection].tolist())
    selection += [k for contour, k in partly.items() if contour not in with_side]
    return np.array(sorted(selection), dtype=np.int64)


def _side_counts(followed: _FollowedTracks | None, drilled: Bools, count: int) -> dict[str, int]:
    """Return the number of contours that are cut inside, on and outside the line, drilled, and not
    cut."""
    counts = {"outside": 0, "inside": 0, "on_line": 0}
    cut: set[int] = set()
    if followed is not None:
        names = {-1: "inside", 0: "on_line", 1: "outside"}
        keys = set(
            zip(followed.tracks.contour.tolist(), followed.tracks.side.tolist(), strict=True)
        )
        for contour, side in keys:
            counts[names[side]] += 1
            cut.add(contour)
    holes = int(drilled.sum())
    return {**counts, "drilled": holes, "not_cut": count - len(cut) - holes}


# The wanted moves: those of the program, along the tracks where they follow one.


class _RowTracks(Struct, frozen=True, eq=False):
    """The rows (N,) that follow a track: the track of each (N,), and the lengths (N,), (N,) mm
    along it at their starts and ends, the end counted on from the start; `offsets` (J,) mm: the
    distances of their samples from the tracks."""

    rows: Bools
    track: Ints
    begin: Floats
    end: Floats
    offsets: Floats

    @classmethod
    def of(cls, cuts: CutMoves, followed: _FollowedTracks, path: _Path) -> _RowTracks:
        tracks = followed.tracks
        index = MoveIndex(_as_cuts(tracks.paths))
        samples = sample_cuts(cuts, TRACK_MM)
        row = cuts.row[samples.segment]
        max_nearness = max(path.near_mm(radius) for radius in followed.radius_mm.tolist())
        level = np.zeros(len(row))
        nearest = index.nearest(samples.points, level, None, (max_nearness, np.inf))
        contours = np.where(nearest.segment >= 0, index.contour_of(nearest.segment), -1)
        # A row belongs to the track in its middle, and follows it if all of its points do.
        first = np.flatnonzero(np.diff(row, prepend=-1))
        last = np.append(first[1:], len(row))
        middle = contours[(first + last) // 2]
        choice = np.repeat(middle, last - first)
        with_choice = np.flatnonzero(choice >= 0)
        distance = np.full(len(row), np.inf)
        length = np.zeros(len(row))
        if len(with_choice):
            own_nearest = index.nearest(
                samples.points[with_choice],
                level[with_choice],
                choice[with_choice],
                (max_nearness, np.inf),
            )
            distance[with_choice] = own_nearest.distance
            hit = with_choice[own_nearest.segment >= 0]
            segment = own_nearest.segment[own_nearest.segment >= 0]
            share = index.shares(samples.points[hit], segment)
            measured = MeasuredPaths(tracks.paths)
            sizes = segment_lengths(measured.segments)
            reach = measured.reach[segment + measured.segments.path[segment]]
            length[hit] = reach + share * sizes[segment]
            total, closed = measured.total_mm, tracks.paths.closed
        else:
            total, closed = np.zeros(0), np.zeros(0, dtype=np.bool_)
        fine = np.maximum.reduceat(distance, first) <= max_nearness if len(first) else np.empty(0)
        fine = np.asarray(fine, dtype=np.bool_) & (middle >= 0)
        # Steps from point to point, the short way round.
        step = np.diff(length, append=length[-1:])
        lap = np.where(closed[choice], total[choice], np.inf) if len(total) else step * np.inf
        with np.errstate(invalid="ignore"):
            step = np.where(np.isfinite(lap), step - lap * np.rint(step / lap), step)
        step[last - 1] = 0.0
        travel = np.add.reduceat(step, first) if len(first) else np.empty(0)
        size = np.bincount(cuts.row, segment_lengths(cuts.segments))[row[first]]
        fine &= np.abs(np.abs(travel) - size) <= 0.1 * size + 4.0 * max_nearness
        count = len(cuts.contour)
        rows = np.zeros(count, dtype=np.bool_)
        track = np.full(count, -1, dtype=np.int64)
        begin, end = np.zeros(count), np.zeros(count)
        own_rows = row[first]
        rows[own_rows] = fine
        track[own_rows] = np.where(fine, middle, -1)
        begin[own_rows] = length[first]
        end[own_rows] = length[first] + travel
        return cls(rows, track, begin, end, distance[rows[row] & np.isfinite(distance)])


def _as_cuts(paths: Polylines) -> CutMoves:
    """Return paths as cutting moves at height 0: each path is a contour, each segment a row."""
    segments = Segments.of(paths)
    count = len(segments)
    unknown = np.full(count, np.nan)
    toolpath = Toolpath(
        kind=np.full(count, Kind.LINE, dtype=np.int8),
        end=np.column_stack([segments.end, np.zeros(count)]),
        centre=np.full((count, 2), np.nan),
        feed=np.ones(count),
        value=unknown,
        source=np.full(count, -1, dtype=np.int32),
        block=np.full(count, -1, dtype=np.int32),
        start=np.zeros(3),
    )
    first = np.arange(count + 1, dtype=np.int32)
    return CutMoves(toolpath, segments, first[:-1], first, segments.path.astype(np.int32))


def _with_tracks(follower: _Follower, followed: _FollowedTracks, follow: _RowTracks) -> Toolpath:
    """Return the program with the moves that follow tracks replaced by the tracks themselves."""
    toolpath = follower.cuts.toolpath
    rows = np.flatnonzero(follow.rows)
    if not len(rows):
        return toolpath
    measured = MeasuredPaths(followed.tracks.paths)
    new = np.ones(len(rows), dtype=np.bool_)
    lap = np.where(followed.tracks.paths.closed, measured.total_mm, np.inf)[follow.track[rows]]
    gap = follow.begin[rows[1:]] - follow.end[rows[:-1]]
    with np.errstate(invalid="ignore"):
        gap = np.where(np.isfinite(lap[1:]), gap - lap[1:] * np.rint(gap / lap[1:]), gap)
    is_next = (np.diff(rows) == 1) & (np.diff(follow.track[rows]) == 0)
    new[1:] = ~is_next | (np.abs(gap) > POSITION_EPS_MM)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(rows)) - 1
    # A profile for each chain of moves: the lengths, counted on, and heights of its points.
    travel = follow.end[rows] - follow.begin[rows]
    chain = np.cumsum(new) - 1
    ends = np.cumsum(travel)
    ends += (follow.begin[rows[first]] - np.append(0.0, ends)[first])[chain]
    length = np.insert(ends, first, follow.begin[rows[first]])
    height = np.insert(toolpath.end[rows, 2], first, toolpath.starts_of(rows[first])[:, 2])
    offsets = np.append(first + np.arange(len(first)), len(length))
    vertices, runs = lifted(
        measured.tracks,
        follow.track[rows[first]],
        offsets.astype(np.int64),
        np.ascontiguousarray(length),
        np.ascontiguousarray(height),
    )
    feed = np.repeat(toolpath.feed[rows[first]], np.diff(runs))
    moves = joined_moves(vertices, feed, runs)
    track = follow.track[rows[first]]
    return _splice_tracks(
        follower, followed, (rows[first], rows[last] + 1), (vertices, runs, moves), track
    )


def _close_turns(kind: Ints, end: Floats) -> None:
    """Set, in place, the ends of full circles exactly to their starts; otherwise rounding would
    reduce them to nothing."""
    gaps = np.hypot(*np.diff(end[:, :2], axis=0, prepend=end[:1, :2]).T)
    for row in np.flatnonzero(are_arcs(kind) & (gaps <= POSITION_EPS_MM)).tolist():
        end[row, :2] = end[row - 1, :2]


def _link(end: Sequence[float] | Floats, feed: float, chain: int) -> tuple[Any, ...]:
    """Return a line to the start of the next chain as columns for `_splice_tracks`."""
    centre = np.full((1, 2), np.nan)
    return np.array([Kind.LINE]), np.array([end]), centre, np.array([feed]), chain


def _splice_tracks(
    follower: _Follower,
    followed: _FollowedTracks,
    chains: tuple[Ints, Ints],
    built: tuple[Floats, Ints, Cuts],
    track: Ints,
) -> Toolpath:
    """Return the program with the moves along the tracks in place of the rows that follow them.

    Chain k replaces the rows from chains[0][k] to chains[1][k], and runs along the track track[k].
    What leads to a chain ends where it begins, and what follows it begins where it ends."""
    toolpath, (vertices, runs, moves) = follower.cuts.toolpath, built
    begins, finishes = chains
    end = toolpath.end.copy()
    across = np.append(np.flatnonzero(moves_across(toolpath)), len(toolpath))
    parts: list[tuple[Any, ...]] = []
    low = np.searchsorted(moves.run, np.arange(len(begins) + 1))
    names = [follower.name(int(contour)) for contour in followed.tracks.contour]
    texts = len(toolpath.texts)
    bent = np.append(toolpath.is_arc, False)
    row_index, before = 0, toolpath.start[:2]
    for k, (first, last) in enumerate(zip(begins.tolist(), finishes.tolist(), strict=True)):
        start, z = vertices[runs[k], :2], vertices[runs[k], 2]
        next_motion = int(across[np.searchsorted(across, row_index)])
        end[row_index : min(next_motion, first), :2] = before
        leads = int(across[max(np.searchsorted(across, first) - 1, 0)])
        straight = next_motion < first and not bent[leads]
        if straight:
            end[leads:first, :2] = start
        parts.append((slice(row_index, first), None))
        if not straight and np.hypot(*(start - before)) > POSITION_EPS_MM:
            parts.append((None, _link([*start, z], moves.feed[low[k]], k)))
        span = slice(low[k], low[k + 1])
        kind = np.where(
            np.isnan(moves.centre[span, 0]),
            Kind.LINE,
            np.where(moves.ccw[span], Kind.ARC_CCW, Kind.ARC_CW),
        )
        parts.append((None, (kind, moves.end[span], moves.centre[span], moves.feed[span], k)))
        row_index, before = last, vertices[runs[k + 1] - 1, :2]
        if bent[across[np.searchsorted(across, last)]]:
            # An arc must keep its start: a full circle that began elsewhere would not be a full
            # circle.
            parts.append((None, _link(toolpath.end[last - 1], moves.feed[low[k]], k)))
            before = toolpath.end[last - 1, :2]
    next_motion = int(across[np.searchsorted(across, row_index)])
    end[row_index:next_motion, :2] = before
    parts.append((slice(row_index, len(toolpath)), None))
    columns: dict[str, list[Any]] = {
        name: [] for name in ("kind", "end", "centre", "feed", "value", "source", "edge")
    }
    for rows, chain in parts:
        if chain is None:
            row = np.arange(rows.start, rows.stop)
            kept_columns = (toolpath.kind[row], end[row], toolpath.centre[row], toolpath.feed[row])
            tail = toolpath.value[row], toolpath.source[row], np.full(len(row), UNKNOWN_EDGE)
        else:
            *kept_columns, k = chain
            count, track_number = len(kept_columns[0]), int(track[k])
            one = int(followed.tracks.contour[track_number])
            edge_number = one if follower.lines.paths.closed[one] else UNKNOWN_EDGE
            tail = (
                np.full(count, np.nan),
                np.full(count, texts + track_number),
                np.full(count, edge_number),
            )
        for name, column in zip(columns, (*kept_columns, *tail), strict=True):
            columns[name].append(column)
    table = {name: np.concatenate(column) for name, column in columns.items()}
    edge = table.pop("edge").astype(np.int64)
    _close_turns(table["kind"], table["end"])
    count = len(edge)
    worst = np.zeros((len(follower.lines.paths) + 1, 2))
    path_of = np.repeat(
        np.arange(len(follower.lines.paths)), np.diff(follower.lines.paths.offsets)
    )
    np.maximum.at(worst, path_of, follower.drawing.off_mm)
    on_track = table["source"] - texts
    contour = np.where(on_track >= 0, np.append(followed.tracks.contour, -1)[on_track], -1)
    nothing_followed = np.zeros(len(follower.lines.paths), dtype=np.bool_)
    return Toolpath(
        kind=table["kind"].astype(np.int8),
        end=table["end"],
        centre=table["centre"],
        feed=table["feed"],
        value=table["value"],
        source=table["source"].astype(np.int32),
        block=np.full(count, -1, dtype=np.int32),
        start=toolpath.start,
        texts=(*toolpath.texts, *names),
        made_from=follower.drawing.file,
        drawn=DrawnEdges(
            off_mm=worst[contour],
            edge=edge,
            nominal=follower.lines.boxes,
            planned=follower.lines.boxes,
            line=np.arange(len(follower.lines.paths)),
            followed=nothing_followed,
            cleared=nothing_followed,
        ),
    )
