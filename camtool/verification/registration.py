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
(inches for millimetres, a mirror, a quarter turn) are tried and named, never applied.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints
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
"""A smaller distance along the same contours is the wall, and the larger ones clear the way to it,
when it has this part of their length."""

MIN_ON_LINE_SHARE = 0.9
"""A path that keeps to the lines for this part of what it keeps to at all has no radius."""

MIN_RIVAL_SHARE = 0.25
"""Two radii are ambiguous when the second explains this part as much as the first, elsewhere."""

CUT_SHARE = 0.5
"""A track is followed when this part of it is cut; with less, the best side of a contour ..."""

PARTLY_SHARE = 0.15
"""... with at least this."""

MIN_SHARP_GAIN = 1e-3
"""Sharp corners take the place of round ones when this part more of them is cut."""

SEARCH_POINTS = 3000
"""So many points of the path decide on its place."""

MAX_MARKS = 300
"""So many boxes, centres and holes of the program, and of the drawing, are compared in pairs."""

VOTE_MM = 0.25
"""Shifts that differ by less are one candidate."""

MAX_PLACES = 16

MIN_FOLLOWED_SHARE = 0.5
"""A drawing lies where its program cuts when this part of the cuts follows its lines."""

MIN_OTHER_SHARE = 0.8
"""Another scale, mirror or turn is named when so much would follow them."""

MIN_EQUAL_SHARE = 0.97
"""A second place is as good as the first when it explains this part as much."""

WIDTHS_MM = (1.0, 0.5, 0.25, 0.12, 0.08, 0.05, 0.05, 0.05)
"""Points within this of the track pull it, one step of Gauss and Newton after the other."""

TRACK_MM = 0.1
"""Tracks are looked at about this far apart, to see what is cut ..."""

MAX_TRACK_POINTS = 200_000
"""... but at no more than about this many points."""

MIN_LEFT_MM = 0.5
"""A part of a contour that is not cut is named from this length on: ends of paths differ."""

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
    """The result: `shift_mm` by which the drawing is moved to lie under the program; the `wanted`
    moves; findings; what the report says of it; `diameter_mm` of the tool, where all that follows
    the drawing is cut with one, None otherwise."""

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
        """Return (J,) mm the signed distance of points from the nearest line, left of it positive;
        (J, 2) the unit direction in which it grows; (J,) the nearest segment.

        Measured from the start of a segment of curvature k, with the point at x along the tangent
        and y along the left normal, the foot is  atan2(k x, 1 − k y) / k  along.
        """
        segment = nearest(points, self.segments).segment
        frames = self.frames[segment]
        q, k = points - frames.start, frames.curvature
        x, y = dot(q, frames.tangent), dot(q, frames.normal)
        with np.errstate(divide="ignore", invalid="ignore"):
            foot = np.where(k == 0.0, x, np.arctan2(k * x, 1.0 - k * y) / k)
        tries = np.stack([np.clip(foot, 0.0, frames.length), 0.0 * foot, frames.length])
        places = [point_at(self.segments, segment, each / frames.length) for each in tries]
        apart = points - np.stack(places)
        best = np.hypot(apart[..., 0], apart[..., 1]).argmin(axis=0)
        every = np.arange(len(points))
        off, share = apart[best, every], tries[best, every] / frames.length
        left = turn_left(frames.tangent_at(share))
        distance = np.hypot(off[:, 0], off[:, 1])
        side = np.where(dot(off, left) < 0.0, -1.0, 1.0)
        known = distance > POSITION_EPS_MM
        unit = off * (side / np.where(known, distance, 1.0))[:, None]
        return side * distance, np.where(known[:, None], unit, left), segment


class _Path(Struct, frozen=True, eq=False):
    """The cuts of a program as points (S, 2) mm with the length that each stands for (S,), the row
    (S,) and the tool (S,) of each. For its place: boxes (B, 2, 2) of its closed parts, centres
    (A, 2) of its arcs, and its holes (H, 2)."""

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
            np.unique(cuts.segments[arcs].centre.round(3), axis=0),
            program.holes.at,
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
        """Return the distance within which a move follows a track of a tool of this radius, mm."""
        size = 0.0 if not len(self.boxes) else float(np.hypot(*np.diff(self.boxes[0])[:, 0]))
        least = min(NEAR_MM, NEAR_SIZE * size) if size else NEAR_MM
        return min(least, NEAR_SHARE * radius_mm) if radius_mm > 0.0 else least

    def thin(self) -> _Path:
        """Return at most `SEARCH_POINTS` of the points, evenly chosen."""
        every = max(1, -(-len(self.points) // SEARCH_POINTS))
        return replace(self, points=self.points[::every], length=self.length[::every])


def _boxes_of(cuts: CutMoves, limit_mm: float) -> Floats:
    """Return (B, 2, 2) mm: the boxes of the loops of all contours, of the whole where one has
    none; and that of everything first."""
    found = loops(cuts, limit_mm)
    first, last = cuts.contour_ends()
    known = found[:, 0] >= 0
    first, last = np.where(known, found[:, 0], first), np.where(known, found[:, 1], last)
    each = segment_boxes(cuts.segments)
    boxes = []
    for low, high in zip(cuts.first[first].tolist(), cuts.first[last + 1].tolist(), strict=True):
        mine = each[low:high]
        boxes.append((mine[:, :2].min(axis=0), mine[:, 2:].max(axis=0)))
    found_boxes = np.array(boxes).reshape(-1, 2, 2).transpose(0, 2, 1)
    if not len(found_boxes):
        return found_boxes
    whole = np.column_stack([found_boxes[:, :, 0].min(axis=0), found_boxes[:, :, 1].max(axis=0)])
    return np.concatenate([whole[None], found_boxes])


def register(
    decoded: Toolpath,
    drawing: Drawing,
    *,
    tool_diameter_mm: float | None,
    align: bool,
    limit_mm: float,
    flat_cuts: bool,
) -> Registration:
    """Find what of a drawing, in the work frame, a program cuts.

    `tool_diameter_mm`: the tool, None where it is to be found; `align`: the drawing may lie
    elsewhere. `limit_mm`: how far moves may be from a track without a finding. DrawingError for a
    drawing without lines.
    """
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
    said: list[Finding] = []
    if align or tool_diameter_mm is None:
        shift, said = _find_place(path, lines, align=align)
    if shift is None:
        return _empty_registration(running, said)
    moved = Polylines.joined([_shift_lines(drawing.paths, shift)]) if any(shift) else drawing.paths
    return _Follower(program, path, _Lines.of(moved), drawing, limit_mm).registration(
        shift, said, tool_diameter_mm, align=align
    )


def _shift_lines(lines: Polylines, shift: tuple[float, float]) -> Polylines:
    vertices = lines.vertices + np.array([*shift, 0.0])
    return Polylines(vertices, lines.offsets, lines.closed)


def _tools_of(toolpath: Toolpath) -> Ints:
    """Return (N,) the number of the tool of each row, −1 before any is mounted."""
    changes = toolpath.kind == Kind.TOOL_CHANGE
    latest = np.maximum.accumulate(np.where(changes, np.arange(len(changes)), -1))
    number = np.append(np.nan_to_num(toolpath.value, nan=-1.0), -1.0)
    return np.asarray(np.rint(number[latest]).astype(np.int64))


def _empty_registration(running: Toolpath, said: Sequence[Finding]) -> Registration:
    """Return the registration of a program that follows nothing, with findings that say so."""
    report = FoundReport(shift_mm=(0.0, 0.0), aligned=False, followed=0.0)
    return Registration((0.0, 0.0), running, tuple(said), report, None)


# The place: candidates by what offsets keep, refined by all of the path.
#
# Offsets keep centres of arcs, and grow or shrink a box evenly on all sides; so centres of arcs,
# of circles and holes, and of boxes that grow alike in X and Y, each vote for a shift. From the
# best of these on, Gauss and Newton move the path until it keeps to the lines at one distance.


class _Place(Struct, frozen=True):
    """A shift, and the part of the path that follows the lines there."""

    shift: tuple[float, float]
    share: float


def _find_place(
    path: _Path, lines: _Lines, *, align: bool
) -> tuple[tuple[float, float] | None, list[Finding]]:
    """Return the shift of the drawing (x, y) mm, None where none fits, and findings on it."""
    few = path.thin()
    here = _Place((0.0, 0.0), _followed_share(few, lines, np.zeros(2)))
    if not align and here.share >= MIN_FOLLOWED_SHARE:
        return here.shift, []
    found = _refined_places(few, lines)
    best = max([here, *found], key=lambda each: each.share)
    if here.share >= MIN_EQUAL_SHARE * best.share:
        best = here
    if best.share >= MIN_FOLLOWED_SHARE:
        if not align:
            x, y = best.shift
            return None, [
                DRAWING_PLACE_ELSEWHERE(
                    measured=100.0 * here.share, limit=100.0 * best.share, x=x, y=y
                )
            ]
        other = None if best.share >= MIN_OTHER_SHARE else _best_other_frame(few, lines)
        if other is not None and best.share < MIN_EQUAL_SHARE * other[1].share:
            return None, [
                DRAWING_PLACE_OTHERWISE(measured=100.0 * best.share, limit=100.0 * other[1].share,
                               flag=other[0])
            ]  # fmt: skip
        rivals = [] if best is here else _rival_places(best, found)
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
    """Return another scale, mirror or turn of the drawing with which the path follows it well, as
    the flag that makes it; None without any."""
    found = []
    scales = [
        (flag, size * np.eye(2)) for flag, size in SCALES if _is_about_size(path, lines, size)
    ]
    for flag, matrix in (*TURNS, *scales):
        other = path.transform(np.linalg.inv(matrix))
        here = _Place((0.0, 0.0), _followed_share(other, lines, np.zeros(2)))
        places = (
            [here] if here.share >= MIN_OTHER_SHARE else [here, *_refined_places(other, lines)]
        )
        found.append((flag, max(places, key=lambda each: each.share)))
    best = max(found, key=lambda each: each[1].share)
    return best if best[1].share >= MIN_OTHER_SHARE else None


def _is_about_size(path: _Path, lines: _Lines, size: float) -> bool:
    """True if the cuts are about `size` times as large as the drawing."""
    if not len(path.boxes) or not len(lines.boxes):
        return False
    about = NEAR_SCALE_RATIO if 0.5 < size < 2.0 else FAR_SCALE_RATIO
    drawn = np.hypot(*(lines.boxes[:, :, 1].max(axis=0) - lines.boxes[:, :, 0].min(axis=0)))
    cut = np.hypot(*(path.boxes[0, :, 1] - path.boxes[0, :, 0]))
    return bool(size * drawn / about < cut < size * drawn * about)


def _rival_places(best: _Place, found: Sequence[_Place]) -> list[_Place]:
    """Return the other places that explain as much of the path."""
    return [
        each
        for each in found
        if each.share >= MIN_EQUAL_SHARE * best.share
        and np.hypot(*np.subtract(each.shift, best.shift)) > 2.0 * VOTE_MM
    ]


def _refined_places(path: _Path, lines: _Lines) -> list[_Place]:
    """Return the best candidates, refined, each once, the best first."""
    found: list[_Place] = []
    for shift in _candidate_shifts(path, lines):
        refined = _refine_shift(path, lines, shift)
        if all(np.hypot(*(refined - each.shift)) > VOTE_MM for each in found):
            share = _followed_share(path, lines, refined)
            found.append(_Place((float(refined[0]), float(refined[1])), share))
    return sorted(found, key=lambda each: -each.share)


def _candidate_shifts(path: _Path, lines: _Lines) -> Floats:
    """Return (C, 2) shifts with the most votes."""
    drawn = _largest_boxes(lines.boxes)
    mine = np.concatenate([path.boxes[:1], _largest_boxes(path.boxes[1:])])
    whole = np.stack([lines.boxes[:, :, 0].min(axis=0), lines.boxes[:, :, 1].max(axis=0)], axis=1)
    drawn = np.concatenate([whole[None], drawn])
    votes, weights = [np.zeros((1, 2))], [np.zeros(1)]
    if len(mine):
        size, their = np.diff(mine)[..., 0], np.diff(drawn)[..., 0]
        grown = size[:, None] - their[None]
        room = VOTE_MM + 0.02 * their.max(axis=1)
        alike = np.abs(grown[..., 0] - grown[..., 1]) <= room
        alike &= np.abs(grown).max(axis=-1) <= 2.0 * MAX_RADIUS_MM
        alike[0, 0] = True
        i, j = np.nonzero(alike)
        votes.append(mine[i].mean(axis=2) - drawn[j].mean(axis=2))
        weights.append(size[i].sum(axis=1))
    points = np.concatenate([path.centres, path.holes])[:MAX_MARKS]
    theirs = _centres_of(lines)[:MAX_MARKS]
    if len(points) and len(theirs):
        votes.append((points[:, None] - theirs[None]).reshape(-1, 2))
        share = float(path.length.sum()) / len(points)
        weights.append(np.full(len(points) * len(theirs), share))
    every, weight = np.concatenate(votes), np.concatenate(weights)
    # Votes that fall on two sides of a border are counted in the cells about it.
    cell = np.rint(every / VOTE_MM).astype(np.int64)
    names, of = np.unique(cell, axis=0, return_inverse=True)
    total = np.bincount(of.reshape(-1), weight)
    one, other = near_points(names.astype(np.float64), names.astype(np.float64), 1.5)
    around = np.bincount(one, total[other], minlength=len(names))
    best = np.argsort(-around, kind="stable")[: 4 * MAX_PLACES]
    chosen: list[Floats] = []
    for cell_of in best.tolist():
        mine_of = one == cell_of
        near = np.isin(of.reshape(-1), other[mine_of])
        heavy = weight[near]
        middle = every[near].mean(axis=0)
        if heavy.sum() > 0.0:
            middle = (every[near] * heavy[:, None]).sum(axis=0) / heavy.sum()
        if all(np.hypot(*(middle - each)) > VOTE_MM for each in chosen):
            chosen.append(middle)
        if len(chosen) == MAX_PLACES:
            break
    return np.array(chosen)


def _largest_boxes(boxes: Floats) -> Floats:
    """Return the `MAX_MARKS` largest boxes."""
    size = np.diff(boxes)[..., 0].sum(axis=1)
    return boxes[np.argsort(-size, kind="stable")[:MAX_MARKS]]


def _centres_of(lines: _Lines) -> Floats:
    """Return (K, 2) mm: the centres of all arcs."""
    arcs = np.flatnonzero(lines.segments.is_arc)
    return np.unique(lines.segments[arcs].centre.round(3), axis=0)


def _refine_shift(path: _Path, lines: _Lines, shift: Floats) -> Floats:
    """Return a shift, moved until the path keeps to the lines, or to one distance from them."""
    shift = np.array(shift, dtype=np.float64)
    for width in WIDTHS_MM:
        distance, normal, _ = lines.signed_distances(path.points - shift)
        far = np.abs(distance)
        radius = _peak_distance(far, path.length, width)
        side = np.where(distance < 0.0, -1.0, 1.0)
        beside = np.abs(far - radius) < width
        along = (far < width) & ~beside
        off = np.where(beside, far - radius, distance)
        grows = np.where(beside[:, None], side[:, None] * normal, normal)
        used = np.flatnonzero(beside | along)
        if len(used) < 3:
            break
        weight = np.sqrt(path.length[used])
        columns = np.column_stack([grows[used], beside[used] & (radius > width)])
        solved = np.linalg.lstsq(columns * weight[:, None], off[used] * weight, rcond=1e-6)[0]
        shift += solved[:2]
    return shift


def _peak_distance(far: Floats, length: Floats, width: float) -> float:
    """Return the distance that most of the path keeps, within `width`; 0 where that is the
    line."""
    bins = max(width, BIN_MM)
    which, counts = _distance_histogram(far, length, bins)
    pairs = counts + np.append(counts[1:], 0.0)
    at = int(pairs.argmax())
    near = (which == at) | (which == at + 1)
    middle = float(np.average(far[near], weights=length[near])) if near.any() else 0.0
    return middle if middle > width else 0.0


def _distance_histogram(far: Floats, length: Floats, bins: float) -> tuple[Ints, Floats]:
    """Return the bin of each distance, and the length of the path in each bin; none in the last,
    which is farther than any tool is wide."""
    most = int(MAX_RADIUS_MM / bins) + 2
    which = np.minimum(far / bins, most).astype(np.int64)
    counts = np.bincount(which, length, minlength=most + 1).astype(np.float64)
    counts[-1] = 0.0
    return which, counts


def _followed_share(path: _Path, lines: _Lines, shift: Floats) -> float:
    """Return the part of the path that keeps to the lines, or to one distance from them."""
    if len(path.points) == 0:
        drilled = near_points(path.holes - shift, _centres_of(lines), NEAR_MM)[0]
        return len(np.unique(drilled)) / max(len(path.holes), 1)
    far = np.abs(lines.signed_distances(path.points - shift)[0])
    radius = _peak_distance(far, path.length, 2.0 * path.near_mm(0.0))
    near = path.near_mm(radius)
    fine = (np.abs(far - radius) <= near) | (far <= near)
    return float(path.length[fine].sum() / path.length.sum())


# Tracks, and the radius that goes with the path.


class _Tracks(Struct, frozen=True, eq=False):
    """T tracks: their paths, the contour (T,) of each, and its side (T,): −1 within it (or right
    of an open one), 0 on it, 1 outside (or left), and whether its corners are sharp (T,)."""

    paths: Polylines
    contour: Ints
    side: Ints
    sharp: Bools

    def select(self, which: Ints) -> _Tracks:
        return _Tracks(
            self.paths.select(which), self.contour[which], self.side[which], self.sharp[which]
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


def _tracks_of(lines: Polylines, radius_mm: float, which: Ints) -> _Tracks:
    """Return the tracks beside the contours `which` for a tool of a radius; on them for a radius
    of 0.

    Closed contours have round and sharp corners outside; an open one has one track that goes
    round it.
    """
    if radius_mm == 0.0:
        none = np.zeros(len(which), dtype=np.int64)
        return _Tracks(lines.select(which), which, none, none.astype(np.bool_))
    parts = []
    closed, open_ = which[lines.closed[which]], which[~lines.closed[which]]
    if len(closed):
        ccw = _orient_ccw(lines.select(closed))
        for side, joins in ((-1, "round"), (1, "round"), (1, "sharp")):
            paths, of = offset_each(ccw, -side * radius_mm, joins=joins)
            if len(paths):
                sides = np.full(len(of), side)
                sharp = np.full(len(of), joins == "sharp")
                parts.append(_Tracks(paths, closed[of], sides, sharp))
    if len(open_):
        about = Polylines.of([_doubled_path(path) for path in lines.select(open_)])
        paths, of = offset_each(about, -radius_mm)
        if len(paths):
            one = np.ones(len(of), dtype=np.int64)
            parts.append(_Tracks(paths, open_[of], one, np.zeros(len(of), dtype=np.bool_)))
    if not parts:
        empty = np.empty(0, dtype=np.int64)
        return _Tracks(lines.select(empty), empty, empty, empty.astype(np.bool_))
    return _Tracks.joined(parts)


def _orient_ccw(lines: Polylines) -> Polylines:
    """Return closed paths, each reversed where it runs clockwise."""
    return reverse_lines(lines, np.asarray(signed_areas(lines) < 0.0))


def _doubled_path(path: Polyline) -> Polyline:
    """Return an open path as a closed one of no width."""
    back = reverse(path).vertices
    return Polyline(np.concatenate([path.vertices[:-1], back[:-1]]), closed=True)


def _is_on_track(points: Floats, tracks: _Tracks, near_mm: float) -> Bools:
    """Return (J,) true for points that lie on a track."""
    if len(tracks.paths) == 0:
        return np.zeros(len(points), dtype=np.bool_)
    return np.asarray(nearest(points, Segments.of(tracks.paths)).distance <= near_mm)


def _candidate_radii(far: Floats, length: Floats) -> list[float]:
    """Return the distances from the nearest line that much of a path keeps, the most kept
    first."""
    which, counts = _distance_histogram(far, length, BIN_MM)
    least = MIN_PEAK_SHARE * float(length.sum())
    found: list[float] = []
    for _ in range(MAX_CANDIDATES):
        around = np.convolve(counts, np.ones(5), mode="same")
        at = int(around.argmax())
        if around[at] < least:
            break
        near = np.abs(which - at) <= 2
        middle = float(np.average(far[near], weights=length[near] + 1e-12))
        found.append(middle if middle > 2.0 * BIN_MM else 0.0)
        counts[max(at - 4, 0) : at + 5] = 0.0
    return list(dict.fromkeys(found))


class _RadiusTrial(Struct, frozen=True, eq=False):
    """A radius, its tracks that are followed, and which points (S,) follow them."""

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
        """Return (T,) the part of each track that is cut."""
        whole = np.bincount(self.track, self.length, minlength=count)
        return np.asarray(
            np.bincount(self.track, self.length * self.cut, minlength=count)
            / np.where(whole > 0.0, whole, 1.0)
        )


class _FollowedTracks(Struct, frozen=True, eq=False):
    """The tracks that a program follows, with the radius (T,) mm and the tool (T,) of each, and
    their cells."""

    tracks: _Tracks
    radius_mm: Floats
    tool: Ints
    cells: _Cells


class _Follower(Struct, frozen=True, eq=False):
    """A program over a drawing that lies where it belongs."""

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
        said: Sequence[Finding],
        tool_diameter_mm: float | None,
        *,
        align: bool,
    ) -> Registration:
        """Return the registration; `said` are the findings on the place of the drawing."""
        findings = list(said)
        if align and not findings and np.hypot(*shift) > self.limit_mm:
            findings.append(DRAWING_PLACE_MOVED(x=shift[0], y=shift[1]))
        radius = None if tool_diameter_mm is None else 0.5 * tool_diameter_mm
        parts, tools = [], []
        for number in np.unique(self.path.tool).tolist():
            mine = np.flatnonzero(self.path.tool == number)
            tried, more = self._radius(mine, radius)
            findings += more
            if tried is None:
                continue
            tools.append(FoundTool(number if number >= 0 else None, 2.0 * tried.radius_mm,
                                   tool_diameter_mm is not None))  # fmt: skip
            parts.append((tried, number))
        chosen = self._join_trials(parts)
        drilled = self._drilled_circles(chosen)
        wanted, off = self.cuts.toolpath, np.empty(0)
        rows = np.zeros(len(wanted), dtype=np.bool_)
        if chosen is not None:
            follow = _RowTracks.of(self.cuts, chosen, self.path)
            wanted, off, rows = _with_tracks(self, chosen, follow), follow.off, follow.rows
        if chosen is not None or drilled.any():
            findings += self._not_cut_findings(chosen, drilled)
        if chosen is not None:
            findings += self._into_part_findings(chosen, rows)
        findings += self._beside_findings(rows, off)
        beside = float(self._row_lengths()[self.cuts.is_cut & ~rows].sum())
        whole = float(self._row_lengths()[self.cuts.is_cut].sum())
        wrong = any(each.severity == Severity.ERROR for each in findings)
        if whole and beside > (1.0 - MIN_FOLLOWED_SHARE) * whole and not wrong:
            findings.append(DRAWING_PLACE_NOWHERE(measured=100.0 * (1.0 - beside / whole),
                                          limit=100.0 * MIN_FOLLOWED_SHARE))  # fmt: skip
        report = FoundReport(
            shift_mm=shift,
            aligned=align,
            followed=1.0 - beside / whole if whole else 0.0,
            beside_mm=beside,
            tools=tuple(tools),
            **_side_counts(chosen, drilled, len(self.lines.paths)),
            off_max_um=1000.0 * float(off.max()) if len(off) else None,
            off_rms_um=1000.0 * float(np.sqrt(np.mean(off**2))) if len(off) else None,
        )
        widths = {each.diameter_mm for each in tools}
        alone = widths.pop() if len(widths) == 1 else None
        return Registration(shift, wanted, tuple(findings), report, alone or None)

    def _row_lengths(self) -> Floats:
        """Return (N,) mm: the length of the segments of each row."""
        sizes = segment_lengths(self.cuts.segments)
        found: Floats = np.bincount(self.cuts.row, sizes, minlength=len(self.cuts.contour)).astype(
            np.float64
        )
        return found

    def _radius(
        self, mine: Ints, given: float | None
    ) -> tuple[_RadiusTrial | None, list[Finding]]:
        """Return the radius with which most of the points `mine` follow tracks, and its tracks."""
        points, length = self.path.points[mine], self.path.length[mine]
        far = np.abs(self.lines.signed_distances(points)[0])
        found = _candidate_radii(far, length)
        if given is not None:
            kept = min(found, key=lambda each: abs(each - given), default=given)
            if abs(kept - given) > self.limit_mm and kept > 0.0:
                said = [TOOL_FOUND_OTHER(measured=2.0 * kept, limit=2.0 * given)]
            else:
                said = []
            return self._try_radius(
                points, length, given, abs(kept - given) if kept else 0.0
            ), said
        tries = [self._try_radius(points, length, each, 0.0) for each in found]
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
        said = []
        for other in tries:
            more = float(length[other.follows & ~best.follows].sum())
            if other is best or not other.radius_mm or not other.keys - best.keys:
                continue
            apart = {key for key in other.keys if key not in best.keys}
            if more >= MIN_RIVAL_SHARE * best.length_mm and len(apart) >= len(
                other.keys & best.keys
            ):
                said.append(
                    TOOL_FOUND_SEVERAL(
                        measured=2.0 * best.radius_mm, other=2.0 * other.radius_mm,
                        share=best.length_mm / float(length.sum()),
                        other_share=more / float(length.sum()),
                    )
                )  # fmt: skip
                break
        return best, said

    def _try_radius(
        self, points: Floats, length: Floats, radius: float, slack: float
    ) -> _RadiusTrial:
        """Return the tracks of a radius that are followed, and the points that follow them."""
        near = self.path.near_mm(radius) + slack
        count = len(self.lines.paths)
        every = np.arange(count)
        tracks = _tracks_of(self.lines.paths, 0.0, every)
        if radius > 0.0:
            reached = self._contours_at(points, radius, near)
            tracks = _Tracks.joined(
                [tracks, _tracks_of(self.lines.paths, radius, np.flatnonzero(reached))]
            )
        cells = self._cells(tracks, near)
        which = _sides_followed(tracks, cells.share(len(tracks.paths)))
        tracks = tracks.select(which)
        follows = _is_on_track(points, tracks, near)
        return _RadiusTrial(radius, tracks, follows, float(length[follows].sum()))

    def _contours_at(self, points: Floats, radius: float, near: float) -> Bools:
        """Return (M,) true for contours from which any point is as far as the radius."""
        found = np.zeros(len(self.lines.paths), dtype=np.bool_)
        far, _, segment = self.lines.signed_distances(points)
        found[np.unique(self.lines.segments.path[segment[np.abs(far) <= radius + near]])] = True
        return found

    def _cells(self, tracks: _Tracks, near: float) -> _Cells:
        """Return points along tracks, and which of them the program cuts."""
        segments = Segments.of(tracks.paths)
        sizes = segment_lengths(segments)
        spacing = max(TRACK_MM, float(sizes.sum()) / MAX_TRACK_POINTS)
        parts = np.maximum(np.ceil(sizes / spacing).astype(np.int64), 2)
        owner = np.repeat(np.arange(len(sizes)), parts)
        within = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
        places = point_at(segments, owner, (within + 0.5) / parts[owner])
        found = self.program.moves.nearest(places, np.zeros(len(places)), None, (near, np.inf))
        cut = np.isfinite(found.distance)
        return _Cells(segments.path[owner], places, (sizes / parts)[owner], cut)

    def _join_trials(self, parts: Sequence[tuple[_RadiusTrial, int]]) -> _FollowedTracks | None:
        """Return the tracks of all tools, each once."""
        parts = [(tried, number) for tried, number in parts if len(tried.tracks.paths)]
        if not parts:
            return None
        tracks = _Tracks.joined([tried.tracks for tried, _ in parts])
        counts = [len(tried.tracks.paths) for tried, _ in parts]
        radius = np.repeat([tried.radius_mm for tried, _ in parts], counts)
        radius = np.where(tracks.side == 0, 0.0, radius)
        tool = np.repeat([number for _, number in parts], counts)
        keys = np.column_stack([tracks.contour, tracks.side, np.rint(radius / POSITION_EPS_MM)])
        order = np.arange(len(keys))
        first = [k for k in order if k == int(np.flatnonzero((keys == keys[k]).all(axis=1))[0])
                 or tracks.side[k] != 0]  # fmt: skip
        which = np.array(first, dtype=np.int64)
        tracks, radius, tool = tracks.select(which), radius[which], tool[which]
        near = max(self.path.near_mm(float(each)) for each in radius)
        return _FollowedTracks(tracks, radius, tool, self._cells(tracks, near))

    def _drilled_circles(self, chosen: _FollowedTracks | None) -> Bools:
        """Return (M,) the circles in whose middle a hole is drilled, and that are not cut."""
        found = np.zeros(len(self.lines.paths), dtype=np.bool_)
        holes = self.path.holes
        if not len(holes):
            return found
        cut = set() if chosen is None else set(chosen.tracks.contour.tolist())
        for index, path in enumerate(self.lines.paths):
            circle = None if index in cut else circle_of(path)
            if circle is not None:
                near = np.hypot(*(holes - np.array(circle[0])).T).min()
                found[index] = near <= max(NEAR_MM, self.limit_mm)
        return found

    def _not_cut_findings(
        self, chosen: _FollowedTracks | None, drilled: Bools
    ) -> Iterator[Finding]:
        """Yield a finding for each contour that nothing cuts, and for each that is cut in part."""
        count = len(self.lines.paths)
        cut = np.zeros(count, dtype=np.bool_)
        if chosen is not None:
            cut[np.unique(chosen.tracks.contour)] = True
        for index, more in first_items(np.flatnonzero(~cut & ~drilled).tolist()):
            yield NOT_CUT(
                where=at_point(self.lines.boxes[index].mean(axis=1)),
                contour=self.name(index),
                more=more,
            )
        if chosen is None:
            return
        cells, tracks = chosen.cells, chosen.tracks
        count = len(tracks.paths)
        whole = np.bincount(cells.track, cells.length, minlength=count)
        left = whole * (1.0 - cells.share(count))
        # Of the variants of a contour the one of which most is cut says what is left of it.
        order = np.lexsort((left, tracks.contour))
        first = order[np.flatnonzero(np.diff(tracks.contour[order], prepend=-1))]
        some = first[left[first] >= MIN_LEFT_MM]
        for track, more in first_items(some.tolist()):
            at = cells.places[(cells.track == track) & ~cells.cut]
            yield NOT_CUT_PART(
                where=at_point(at[len(at) // 2]),
                contour=self.name(int(tracks.contour[track])),
                measured=float(left[track]),
                share=float(left[track] / whole[track]),
                more=more,
            )

    def _into_part_findings(self, chosen: _FollowedTracks, rows: Bools) -> Iterator[Finding]:
        """Yield a finding for each move that follows nothing and comes nearer to the nearest line
        than the tool may that cuts along one side of it, or lies on its other side."""
        lines, loose = self.lines, np.flatnonzero(~rows[self.path.row])
        if not len(loose):
            return
        far, _, segment = lines.signed_distances(self.path.points[loose])
        contour = lines.segments.path[segment]
        ccw = np.zeros(len(lines.paths), dtype=np.bool_)
        closed = np.flatnonzero(lines.paths.closed)
        ccw[closed] = signed_areas(lines.paths.select(closed)) > 0.0
        outward = np.where(ccw[contour], -far, far)
        room = np.full((len(lines.paths), 2), np.nan)  # within it, and outside
        sided = np.flatnonzero(chosen.tracks.side != 0)
        which = chosen.tracks.contour[sided]
        room[which, (chosen.tracks.side[sided] + 1) // 2] = chosen.radius_mm[sided]
        tool = np.zeros(len(lines.paths), dtype=np.int64)
        tool[which] = chosen.tool[sided]
        one = np.isfinite(room).sum(axis=1) == 1
        side = np.where(np.isfinite(room[:, 1]), 1.0, -1.0)
        radius = np.nanmax(np.where(np.isfinite(room), room, -1.0), axis=1)
        into = radius[contour] - side[contour] * outward
        judged = one[contour] & lines.paths.closed[contour]
        judged &= self.path.tool[loose] == tool[contour]
        deep = np.where(judged, into, -1.0)
        row = self.path.row[loose]
        order = np.lexsort((-deep, row))
        worst = order[np.flatnonzero(np.diff(row[order], prepend=-1))]
        bad = worst[deep[worst] > max(self.limit_mm, self.path.near_mm(0.0))]
        for k, more in first_items(bad.tolist()):
            place = at_point(self.path.points[loose[k]])
            yield CUT_INTO_PART(
                where=f"{block_name(self.cuts.toolpath, int(row[k]))} at {place}",
                contour=self.name(int(contour[k])),
                measured=float(deep[k]),
                limit=self.limit_mm,
                more=more,
            )

    def _beside_findings(self, rows: Bools, off: Floats) -> Iterator[Finding]:
        """Yield findings on cuts that follow nothing, and on those that follow from afar: `off`
        (J,) mm, by points of the rows (N,) that follow."""
        length, toolpath = self._row_lengths(), self.cuts.toolpath
        loose = np.flatnonzero(self.cuts.is_cut & ~rows)
        if len(loose) and rows.any():
            worst = int(loose[length[loose].argmax()])
            yield CUTS_BESIDE(
                where=f"{block_name(toolpath, worst)} at {at_point(toolpath.end[worst])}",
                measured=float(length[loose].sum()),
                moves=len(loose),
            )
        if len(off) and off.max() > self.limit_mm:
            yield OFF_DRAWING(measured=float(off.max()), limit=self.limit_mm)

    def name(self, index: int) -> str:
        """Return `layer/entity` of a contour."""
        layer, source = self.drawing.layers[index], self.drawing.sources[index]
        return f"{layer}/{source}"


def _sides_followed(tracks: _Tracks, share: Floats) -> Ints:
    """Return the tracks that are followed: of each side with enough cut the variant with most of
    it, and where no side has enough, the best."""
    best: dict[tuple[int, int, int], int] = {}
    for k, (contour, side) in enumerate(
        zip(tracks.contour.tolist(), tracks.side.tolist(), strict=True)
    ):
        # Inside, one contour may have several tracks; all of those that are cut count.
        name = contour, side, k if side < 0 else -1
        if name not in best or share[k] > share[best[name]] + MIN_SHARP_GAIN:
            best[name] = k
    found: list[int] = []
    partly: dict[int, int] = {}
    for (contour, _, _), k in best.items():
        if share[k] >= CUT_SHARE:
            found.append(k)
        elif share[k] >= PARTLY_SHARE:
            other = partly.get(contour)
            if other is None or share[k] > share[other]:
                partly[contour] = k
    known = set(tracks.contour[found].tolist())
    found += [k for contour, k in partly.items() if contour not in known]
    return np.array(sorted(found), dtype=np.int64)


def _side_counts(chosen: _FollowedTracks | None, drilled: Bools, count: int) -> dict[str, int]:
    """Return the number of contours that are cut on each side, drilled, and not cut."""
    found = {"outside": 0, "inside": 0, "on_line": 0}
    cut: set[int] = set()
    if chosen is not None:
        names = {-1: "inside", 0: "on_line", 1: "outside"}
        keys = set(zip(chosen.tracks.contour.tolist(), chosen.tracks.side.tolist(), strict=True))
        for contour, side in keys:
            found[names[side]] += 1
            cut.add(contour)
    holes = int(drilled.sum())
    return {**found, "drilled": holes, "not_cut": count - len(cut) - holes}


# The wanted moves: those of the program, along the tracks where they follow one.


class _RowTracks(Struct, frozen=True, eq=False):
    """The rows (N,) that follow a track: the track of each (N,), and the lengths (N,), (N,) mm
    along it at their starts and ends, the end counted on from the start; `off` (J,) mm: the
    distances of their samples from the tracks."""

    rows: Bools
    track: Ints
    begin: Floats
    end: Floats
    off: Floats

    @classmethod
    def of(cls, cuts: CutMoves, chosen: _FollowedTracks, path: _Path) -> _RowTracks:
        tracks = chosen.tracks
        index = MoveIndex(_as_cuts(tracks.paths))
        samples = sample_cuts(cuts, TRACK_MM)
        row = cuts.row[samples.segment]
        most = max(path.near_mm(radius) for radius in chosen.radius_mm.tolist())
        level = np.zeros(len(row))
        found = index.nearest(samples.points, level, None, (most, np.inf))
        of = np.where(found.segment >= 0, index.contour_of(found.segment), -1)
        # A row belongs to the track in its middle, and follows it if all of its points do.
        first = np.flatnonzero(np.diff(row, prepend=-1))
        last = np.append(first[1:], len(row))
        middle = of[(first + last) // 2]
        choice = np.repeat(middle, last - first)
        known = np.flatnonzero(choice >= 0)
        distance = np.full(len(row), np.inf)
        length = np.zeros(len(row))
        if len(known):
            own = index.nearest(samples.points[known], level[known], choice[known], (most, np.inf))
            distance[known] = own.distance
            hit = known[own.segment >= 0]
            segment = own.segment[own.segment >= 0]
            share = index.shares(samples.points[hit], segment)
            measured = MeasuredPaths(tracks.paths)
            sizes = segment_lengths(measured.segments)
            reach = measured.reach[segment + measured.segments.path[segment]]
            length[hit] = reach + share * sizes[segment]
            total, closed = measured.total_mm, tracks.paths.closed
        else:
            total, closed = np.zeros(0), np.zeros(0, dtype=np.bool_)
        fine = np.maximum.reduceat(distance, first) <= most if len(first) else np.empty(0)
        fine = np.asarray(fine, dtype=np.bool_) & (middle >= 0)
        # Steps from point to point, the short way round.
        step = np.diff(length, append=length[-1:])
        lap = np.where(closed[choice], total[choice], np.inf) if len(total) else step * np.inf
        with np.errstate(invalid="ignore"):
            step = np.where(np.isfinite(lap), step - lap * np.rint(step / lap), step)
        step[last - 1] = 0.0
        way = np.add.reduceat(step, first) if len(first) else np.empty(0)
        size = np.bincount(cuts.row, segment_lengths(cuts.segments))[row[first]]
        fine &= np.abs(np.abs(way) - size) <= 0.1 * size + 4.0 * most
        count = len(cuts.contour)
        rows = np.zeros(count, dtype=np.bool_)
        track = np.full(count, -1, dtype=np.int64)
        begin, end = np.zeros(count), np.zeros(count)
        mine = row[first]
        rows[mine] = fine
        track[mine] = np.where(fine, middle, -1)
        begin[mine] = length[first]
        end[mine] = length[first] + way
        return cls(rows, track, begin, end, distance[rows[row] & np.isfinite(distance)])


def _as_cuts(paths: Polylines) -> CutMoves:
    """Return paths as moves at height 0, each a contour of its own, a row for each segment."""
    segments = Segments.of(paths)
    count = len(segments)
    none = np.full(count, np.nan)
    toolpath = Toolpath(
        kind=np.full(count, Kind.LINE, dtype=np.int8),
        end=np.column_stack([segments.end, np.zeros(count)]),
        centre=np.full((count, 2), np.nan),
        feed=np.ones(count),
        value=none,
        source=np.full(count, -1, dtype=np.int32),
        block=np.full(count, -1, dtype=np.int32),
        start=np.zeros(3),
    )
    first = np.arange(count + 1, dtype=np.int32)
    return CutMoves(toolpath, segments, first[:-1], first, segments.path.astype(np.int32))


def _with_tracks(of: _Follower, chosen: _FollowedTracks, follow: _RowTracks) -> Toolpath:
    """Return the program with the tracks in the place of the moves that follow them."""
    toolpath = of.cuts.toolpath
    rows = np.flatnonzero(follow.rows)
    if not len(rows):
        return toolpath
    measured = MeasuredPaths(chosen.tracks.paths)
    new = np.ones(len(rows), dtype=np.bool_)
    lap = np.where(chosen.tracks.paths.closed, measured.total_mm, np.inf)[follow.track[rows]]
    gap = follow.begin[rows[1:]] - follow.end[rows[:-1]]
    with np.errstate(invalid="ignore"):
        gap = np.where(np.isfinite(lap[1:]), gap - lap[1:] * np.rint(gap / lap[1:]), gap)
    same = (np.diff(rows) == 1) & (np.diff(follow.track[rows]) == 0)
    new[1:] = ~same | (np.abs(gap) > POSITION_EPS_MM)
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(rows)) - 1
    # A profile for each chain of moves: the lengths, counted on, and heights of its points.
    way = follow.end[rows] - follow.begin[rows]
    chain = np.cumsum(new) - 1
    ends = np.cumsum(way)
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
        of, chosen, (rows[first], rows[last] + 1), (vertices, runs, moves), track
    )


def _close_turns(kind: Ints, end: Floats) -> None:
    """Let whole turns end exactly where they begin, or rounding would make nothing of them."""
    apart = np.hypot(*np.diff(end[:, :2], axis=0, prepend=end[:1, :2]).T)
    for row in np.flatnonzero(are_arcs(kind) & (apart <= POSITION_EPS_MM)).tolist():
        end[row, :2] = end[row - 1, :2]


def _link(end: Sequence[float] | Floats, feed: float, chain: int) -> tuple[Any, ...]:
    """Return a line to the start of the next chain, as the columns of `_splice_tracks`."""
    centre = np.full((1, 2), np.nan)
    return np.array([Kind.LINE]), np.array([end]), centre, np.array([feed]), chain


def _splice_tracks(
    of: _Follower,
    chosen: _FollowedTracks,
    chains: tuple[Ints, Ints],
    made: tuple[Floats, Ints, Cuts],
    track: Ints,
) -> Toolpath:
    """Return the rows of the program that follow nothing, and between them the moves along the
    tracks.

    Chain k stands for the rows from chains[0][k] to chains[1][k], and is on the track track[k].
    What leads to a chain ends where it begins, and what follows it begins where it ends.
    """
    toolpath, (vertices, runs, moves) = of.cuts.toolpath, made
    begins, finishes = chains
    end = toolpath.end.copy()
    across = np.append(np.flatnonzero(moves_across(toolpath)), len(toolpath))
    parts: list[tuple[Any, ...]] = []
    low = np.searchsorted(moves.run, np.arange(len(begins) + 1))
    names = [of.name(int(contour)) for contour in chosen.tracks.contour]
    texts = len(toolpath.texts)
    bent = np.append(toolpath.is_arc, False)
    here, before = 0, toolpath.start[:2]
    for k, (first, last) in enumerate(zip(begins.tolist(), finishes.tolist(), strict=True)):
        start, z = vertices[runs[k], :2], vertices[runs[k], 2]
        moved = int(across[np.searchsorted(across, here)])
        end[here : min(moved, first), :2] = before
        leads = int(across[max(np.searchsorted(across, first) - 1, 0)])
        straight = moved < first and not bent[leads]
        if straight:
            end[leads:first, :2] = start
        parts.append((slice(here, first), None))
        if not straight and np.hypot(*(start - before)) > POSITION_EPS_MM:
            parts.append((None, _link([*start, z], moves.feed[low[k]], k)))
        mine = slice(low[k], low[k + 1])
        kind = np.where(
            np.isnan(moves.centre[mine, 0]),
            Kind.LINE,
            np.where(moves.ccw[mine], Kind.ARC_CCW, Kind.ARC_CW),
        )
        parts.append((None, (kind, moves.end[mine], moves.centre[mine], moves.feed[mine], k)))
        here, before = last, vertices[runs[k + 1] - 1, :2]
        if bent[across[np.searchsorted(across, last)]]:
            # An arc keeps its start: a full turn that begins elsewhere would be none.
            parts.append((None, _link(toolpath.end[last - 1], moves.feed[low[k]], k)))
            before = toolpath.end[last - 1, :2]
    moved = int(across[np.searchsorted(across, here)])
    end[here:moved, :2] = before
    parts.append((slice(here, len(toolpath)), None))
    columns: dict[str, list[Any]] = {
        name: [] for name in ("kind", "end", "centre", "feed", "value", "source", "edge")
    }
    for rows, given in parts:
        if given is None:
            row = np.arange(rows.start, rows.stop)
            found = (toolpath.kind[row], end[row], toolpath.centre[row], toolpath.feed[row])
            more = toolpath.value[row], toolpath.source[row], np.full(len(row), UNKNOWN_EDGE)
        else:
            *found, k = given
            count, on = len(found[0]), int(track[k])
            one = int(chosen.tracks.contour[on])
            its = one if of.lines.paths.closed[one] else UNKNOWN_EDGE
            more = np.full(count, np.nan), np.full(count, texts + on), np.full(count, its)
        for name, column in zip(columns, (*found, *more), strict=True):
            columns[name].append(column)
    whole = {name: np.concatenate(column) for name, column in columns.items()}
    edge = whole.pop("edge").astype(np.int64)
    _close_turns(whole["kind"], whole["end"])
    count = len(edge)
    worst = np.zeros((len(of.lines.paths) + 1, 2))
    path_of = np.repeat(np.arange(len(of.lines.paths)), np.diff(of.lines.paths.offsets))
    np.maximum.at(worst, path_of, of.drawing.off_mm)
    on_track = whole["source"] - texts
    contour = np.where(on_track >= 0, np.append(chosen.tracks.contour, -1)[on_track], -1)
    none = np.zeros(len(of.lines.paths), dtype=np.bool_)
    return Toolpath(
        kind=whole["kind"].astype(np.int8),
        end=whole["end"],
        centre=whole["centre"],
        feed=whole["feed"],
        value=whole["value"],
        source=whole["source"].astype(np.int32),
        block=np.full(count, -1, dtype=np.int32),
        start=toolpath.start,
        texts=(*toolpath.texts, *names),
        made_from=of.drawing.file,
        drawn=DrawnEdges(
            off_mm=worst[contour],
            edge=edge,
            nominal=of.lines.boxes,
            planned=of.lines.boxes,
            line=np.arange(len(of.lines.paths)),
            followed=none,
            cleared=none,
        ),
    )
