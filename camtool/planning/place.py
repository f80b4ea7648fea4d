"""The drawing in the work frame: mirrored, turned, scaled, repeated, its zero where the job says.

    mirror ──▶ rotate ──▶ scale or fit ──▶ copies at their pitch ──▶ origin ──▶ turned over

Every point goes through one map, p ↦ M p + d, with M = s · R · F: the scale s, the rotation R and
the mirror F. All three keep angles, so a bulge keeps its size; a mirror changes its sign. A set-up
that turns the part over is a mirror too, behind all others."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints, columns_of
from camtool.errors import GeometryError, OptionError
from camtool.findings import Finding, Severity
from camtool.geometry.drawing import Drawing, Gap, Healing, Unchosen
from camtool.geometry.measure import extents, segment_boxes
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    SEGMENTS_AT_ONCE,
    Polylines,
    Segments,
    encloses,
    segment_rows,
    without_repeats,
)
from camtool.geometry.turn import Turn
from camtool.planning.findings import POINTS_MERGED
from camtool.planning.job import ALLOWED_TIMES, Job, Placement
from camtool.records import replace

MAX_SIZE_MM = 1e5
"""Largest size of the cut geometry: 100 m, as the longest travel of a machine file."""

MAX_DISTANCE_MM = 1e6

MAX_POINTS = 10_000_000
"""Vertices of all copies together: far beyond any program, well within memory."""

SCALE_SHARE = 1e-3
"""A drawing counts as read for a scale from which its own scale of reading differs by no more than
this share."""


class AffineMap(Struct, frozen=True, eq=False):
    """An affine map: p ↦ `matrix` p + `shift`: (2, 2) and (2,), mm; lengths grow `scale` times."""

    matrix: Floats
    shift: Floats
    scale: float

    def points(self, points: Floats) -> Floats:
        """Return the images of points (K, 2) mm."""
        return np.asarray(points @ self.matrix.T + self.shift)

    def point(self, at_mm: tuple[float, float]) -> tuple[float, float]:
        """Return the image of a single point."""
        x, y = self.points(np.array([at_mm]))[0].tolist()
        return x, y

    def vertices(self, vertices: Floats) -> Floats:
        """Return the images of vertices (N, 3) x, y, bulge; a mirroring map changes the sign of
        the bulge."""
        flipped = np.linalg.det(self.matrix) < 0.0
        bulge = 0.0 - vertices[:, 2] if flipped else vertices[:, 2]
        return np.column_stack([self.points(vertices[:, :2]), bulge])

    def moved(self, shift: Floats) -> AffineMap:
        """Return this map followed by a shift (2,), mm."""
        return replace(self, shift=self.shift + shift)

    def turned(self, turn: Turn) -> AffineMap:
        """Return this map followed by turning the part over."""
        matrix = np.diag(turn.signs) @ self.matrix
        return AffineMap(matrix, self.shift * turn.signs + turn.shift_mm, self.scale)


def place(drawing: Drawing, job: Job) -> Drawing:
    """Return the drawing in the work frame, as the job's placement says; the same object if
    nothing changes.

    Copies come one after the other, row by row: all paths and marks of the first, then of the
    second, whose sources name the copy ("CIRCLE 2F copy 2"). Fit, lower left and centre take the
    box around all that the operations take. What was found on reading stays in the drawing's
    frame. Points that the scale brings together are merged (`collapse_findings` counts them).
    OptionError for an impossible fit, for a scale that leaves no shape at all, and for what is
    larger than any machine."""
    placed_drawing = drawing if job.placement == Placement() else _place(drawing, job)
    _refuse_too_large(placed_drawing, job)
    return placed_drawing


def _place(drawing: Drawing, job: Job) -> Drawing:
    """Return the drawing in the work frame, without a check of its size."""
    placement = job.placement
    _refuse_too_many(drawing, placement)
    maps = placements(drawing, job)
    off_mm = datum_off(drawing, job, maps[0])
    if len(maps) == 1 and _is_identity(maps[0]) and not off_mm:
        return drawing
    return replace(_map_drawing(drawing, maps), datum_off_mm=off_mm)


def placements(drawing: Drawing, job: Job) -> list[AffineMap]:
    """Return the map of each copy of the drawing into the work frame, row by row.

    Raises OptionError for an impossible fit."""
    first, shifts = _first_map(drawing, job), _copy_shifts(job.placement)
    first = first.moved(-_origin(drawing, job, first, shifts))
    return [first.moved(shift).turned(job.placement.turn) for shift in shifts]


def part_scale(drawing: Drawing, job: Job) -> float:
    """Return the factor from the drawing's size to the part's, from the job's scale or fit.

    Raises OptionError for an impossible fit."""
    return _first_map(drawing, job).scale


def collapse_findings(drawing: Drawing, placed_drawing: Drawing, job: Job) -> list[Finding]:
    """Return findings about what the scale made too small: points that were merged, and paths that
    shrank to a point and are left out (a warning, since something drawn is not cut)."""
    columns, rows = job.placement.copies
    paths = columns * rows * len(drawing.paths) - len(placed_drawing.paths)
    points = columns * rows * len(drawing.paths.vertices) - len(placed_drawing.paths.vertices)
    if not points:
        return []
    return [
        POINTS_MERGED(
            severity=Severity.WARNING if paths else Severity.INFO,
            where=drawing.file,
            measured=points,
            limit=POSITION_EPS_MM,
            near_nm=POSITION_EPS_MM * 1e6,
            paths=paths,
        )
    ]


def _first_map(drawing: Drawing, job: Job) -> AffineMap:
    """Return the map that mirrors, rotates and scales about the drawing's zero."""
    placement, turn_map = job.placement, _mirror_and_rotation(job.placement)
    scale = placement.scale
    if placement.fit_mm is not None:
        scale = _fitting_scale(placement.fit_mm, _box(drawing, job, turn_map), drawing.file)
    return AffineMap(scale * turn_map.matrix, turn_map.shift, scale)


def _mirror_and_rotation(placement: Placement) -> AffineMap:
    """Return the map that mirrors and rotates about the drawing's zero."""
    cosine, sine = _cosine_and_sine(placement.rotate_rad)
    flip = np.diag([-1.0 if placement.mirror == axis else 1.0 for axis in ("x", "y")])
    return AffineMap(np.array([[cosine, -sine], [sine, cosine]]) @ flip, np.zeros(2), 1.0)


# The box by which a drawing is placed and fitted is that of the arcs that stand for its curves. A
# side of it lies off that of what was drawn by no more than the segments that reach so far do.


def datum_off(drawing: Drawing, job: Job, placed_map: AffineMap) -> float:
    """Return an upper bound, mm in the work frame, of how far the drawing placed by `placed_map`
    is from where the box of the exact curves would have put it. 0 if the placement uses no box."""
    placement = job.placement
    by_box = placement.origin in ("lower-left", "centre")
    if not (by_box or placement.fit_mm) or not drawing.off_mm.any():
        return 0.0
    turn_map = _mirror_and_rotation(placement)
    box, slack = _box(drawing, job, turn_map), _box_slack(drawing, job, turn_map)
    if box is None:
        return 0.0
    off_mm = distance = 0.0
    size = box[:, 1] - box[:, 0]
    if placement.origin == "lower-left":
        off_mm, distance = math.hypot(*slack[:, 0]), math.hypot(*size)
    elif placement.origin == "centre":
        off_mm, distance = 0.5 * math.hypot(*slack.sum(axis=1)), 0.5 * math.hypot(*size)
    else:
        distance = math.hypot(*np.abs(box).max(axis=1))
    if placement.fit_mm is not None:
        room = np.array(placement.fit_mm)
        is_bounded = (room > 0.0) & (size > 0.0)
        share = slack.sum(axis=1)[is_bounded] / size[is_bounded]
        scales = room[is_bounded] / size[is_bounded]
        min_scale = scales.min() * (1.0 + share[scales.argmin()])
        off_mm += distance * float(share[scales * (1.0 - share) <= min_scale].max())
    return float(placed_map.scale * off_mm)


def _box_slack(drawing: Drawing, job: Job, frame_map: AffineMap) -> Floats:
    """Return upper bounds (2, 2), mm, of the distance of each side of `_box` from the same side of
    the box of the exact curves."""
    paths, marks = rows_taken(drawing, job)
    lines, off_mm = drawing.paths.select(paths), drawing.off_mm[:, 0]
    if len(paths) < len(drawing.paths):
        is_chosen = np.zeros(len(drawing.paths), dtype=np.bool_)
        is_chosen[paths] = True
        off_mm = off_mm[np.repeat(is_chosen, np.diff(drawing.paths.offsets))]
    lines = Polylines(frame_map.vertices(lines.vertices), lines.offsets, lines.closed)
    low = np.full((3, 2), np.inf)  # of the fitted curves, and bounds of the exact ones
    high = -low
    every = segment_rows(lines)
    for first in range(0, len(every), SEGMENTS_AT_ONCE):
        rows = every[first : first + SEGMENTS_AT_ONCE]
        boxes, slack = segment_boxes(Segments.leaving(lines, rows)), off_mm[rows][:, None]
        lows, highs, slack = columns_of(boxes[:, :2]), columns_of(boxes[:, 2:]), slack.T
        low = np.minimum(low, [(lows + k * slack).min(axis=1) for k in (0, -1, 1)])
        high = np.maximum(high, [(highs + k * slack).max(axis=1) for k in (0, -1, 1)])
    if marks:
        points = frame_map.points(np.array([drawing.marks[index].at_mm for index in marks]))
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    return np.asarray(np.abs(np.array([low[1:] - low[0], high[1:] - high[0]])).max(axis=1).T)


def _cosine_and_sine(angle_rad: float) -> tuple[float, float]:
    """Return cosine and sine of an angle; exactly 0 and ±1 for quarter turns, so that squares stay
    square."""
    quarters = angle_rad / (0.5 * math.pi)
    if quarters == round(quarters):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[round(quarters) % 4]
    return math.cos(angle_rad), math.sin(angle_rad)


def _fitting_scale(fit_mm: tuple[float, float], box: Floats | None, file: str) -> float:
    """Return the largest scale at which the box (2, 2) fits into `fit_mm` (width, height), in
    which 0 means any size."""
    if box is None:
        raise OptionError(
            "the operations choose nothing of this drawing, so there is nothing to fit",
            file=file,
            where="key fit",
            mend="choose other layers, or drill its single points (--kind drill)",
        )
    sizes = box[:, 1] - box[:, 0]
    scales = [
        room / size
        for room, size in zip(fit_mm, sizes.tolist(), strict=True)
        if room > 0.0 and size > 0.0
    ]
    if not scales:
        raise OptionError(
            f"what is cut is {sizes[0]:g} by {sizes[1]:g} mm,"
            f" and no scale makes it {fit_mm[0]:g} by {fit_mm[1]:g} mm",
            file=file,
            where="key fit",
            mend="fit the side that has a length, or give a scale",
        )
    return float(min(scales))


def _origin(drawing: Drawing, job: Job, first: AffineMap, shifts: Floats) -> Floats:
    """Return the point (2,), before the drawing is moved, that becomes part zero."""
    origin = job.placement.origin
    if not isinstance(origin, str):
        return np.array(origin)
    box = None if origin == "drawing" else _box(drawing, job, first)
    if box is None:
        return np.zeros(2)
    low = box[:, 0] + shifts.min(axis=0)
    high = box[:, 1] + shifts.max(axis=0)
    return np.asarray(low if origin == "lower-left" else 0.5 * (low + high))


def _box(drawing: Drawing, job: Job, frame_map: AffineMap) -> Floats | None:
    """Return the bounding box (2, 2) of all that the operations take, mapped by `frame_map`; None
    if they take nothing."""
    paths, marks = rows_taken(drawing, job)
    boxes = []
    if paths:
        boxes.append(extents(_map_lines(drawing.paths.select(paths), [frame_map])[0]))
    if marks:
        points = frame_map.points(np.array([drawing.marks[index].at_mm for index in marks]))
        boxes.append(np.column_stack([points.min(axis=0), points.max(axis=0)]))
    if not boxes:
        return None
    stacked = np.array(boxes)
    return np.column_stack([stacked[:, :, 0].min(axis=0), stacked[:, :, 1].max(axis=0)])


def rows_taken(drawing: Drawing, job: Job) -> tuple[list[int], list[int]]:
    """Return the indices of the paths that any operation takes, and of the marks that any
    operation drills."""
    job = job.whole  # all set-ups of a part have one place
    drills = [operation for operation in job.operations if operation.contract.takes == "holes"]
    takes = _cached(job.takes)
    drilled = _cached(lambda *names: any(drill.takes(*names) for drill in drills))
    names = zip(drawing.layers, drawing.colours, strict=True)
    return (
        [index for index, each in enumerate(names) if takes(*each)],
        [index for index, mark in enumerate(drawing.marks) if drilled(mark.layer, mark.colour)],
    )


def _cached(takes: Callable[[str, str], bool]) -> Callable[[str, str], bool]:
    """Return a cached version of `takes`, which matches each pair of layer and colour only
    once."""
    answers: dict[tuple[str, str], bool] = {}

    def answer(layer: str, colour: str) -> bool:
        key = (layer, colour)
        if key not in answers:
            answers[key] = takes(layer, colour)
        return answers[key]

    return answer


def _copy_shifts(placement: Placement) -> Floats:
    """Return the shift (K, 2) mm of each copy from the first, row by row."""
    columns, rows = placement.copies
    row, column = np.divmod(np.arange(columns * rows), columns)
    return np.asarray(np.column_stack([column, row]) * np.array(placement.pitch_mm))


def _refuse_too_many(drawing: Drawing, placement: Placement) -> None:
    columns, rows = placement.copies
    points = len(drawing.paths.vertices) + len(drawing.unchosen.paths.vertices)
    count = columns * rows * (points + len(drawing.marks))
    if count > MAX_POINTS:
        raise OptionError(
            f"{columns} by {rows} copies have {count} points, more than {MAX_POINTS}",
            where="key copies",
            mend="make fewer copies",
        )


def _refuse_too_large(placed_drawing: Drawing, job: Job) -> None:
    """Raise OptionError for a drawing that, in the work frame, is larger than any machine or far
    from part zero."""
    places = placed_drawing.paths.vertices[:, :2]
    if len(places) == 0:
        return
    times = ALLOWED_TIMES if "long" in job.allow else 1.0
    size, max_size = float(np.ptp(columns_of(places), axis=1).max()), MAX_SIZE_MM * times
    if not size <= max_size:
        key = _enlarging_key(job.placement)
        mend = f"give a smaller {key}" if key else "give --units, a scale, or the --layer to cut"
        raise OptionError(
            f"what is cut is {size:.4g} mm long, more than {max_size:g} mm",
            file=placed_drawing.file,
            where=f"key {key}" if key else None,
            mend=mend + _or_allow(size, MAX_SIZE_MM),
        )
    distance, farthest = float(np.abs(places).max()), MAX_DISTANCE_MM * times
    if distance > farthest:
        raise OptionError(
            f"what is cut lies {distance:.4g} mm from part zero, more than {farthest:g} mm",
            file=placed_drawing.file,
            where="key origin",
            mend="use an origin on what is cut: lower-left or centre"
            + _or_allow(distance, MAX_DISTANCE_MM),
        )


def _or_allow(length_mm: float, most_mm: float) -> str:
    """Return the advice to allow such a length in the job; "" if it exceeds even what can be
    allowed."""
    allowed = length_mm <= ALLOWED_TIMES * most_mm
    return "; or --allow long if it is meant" if allowed else ""


def _enlarging_key(placement: Placement) -> str:
    """Return the name of the key that makes the drawing large, "" if none does."""
    if placement.scale > 1.0:
        return "scale"
    if placement.fit_mm is not None:
        return "fit"
    return "pitch" if placement.copies != (1, 1) else ""


def _is_identity(frame_map: AffineMap) -> bool:
    return np.array_equal(frame_map.matrix, np.eye(2)) and not frame_map.shift.any()


def _map_drawing(drawing: Drawing, maps: list[AffineMap]) -> Drawing:
    """Return the drawing with everything that has a place repeated under each map; paths that
    shrink to a point are left out."""
    paths, rows, kept_vertices = _map_lines(drawing.paths, maps)
    off_mm = np.tile(maps[0].scale * drawing.off_mm, (len(maps), 1))
    copy, path = np.divmod(rows, max(1, len(drawing.paths)))
    copies = list(zip(copy.tolist(), path.tolist(), strict=True))
    return replace(
        drawing,
        paths=paths,
        # Segments that began at a removed point now begin at the point before it.
        off_mm=np.maximum.reduceat(off_mm, kept_vertices, axis=0)
        if len(kept_vertices)
        else off_mm,
        layers=tuple(drawing.layers[each] for _, each in copies),
        colours=tuple(drawing.colours[each] for _, each in copies),
        sources=tuple(_copy_name(drawing.sources[each], n) for n, each in copies),
        line_types=tuple(drawing.line_types[each] for _, each in copies),
        marks=tuple(
            replace(mark, at_mm=copy_map.point(mark.at_mm), source=_copy_name(mark.source, n))
            for n, copy_map in enumerate(maps)
            for mark in drawing.marks
        ),
        gaps=_map_gaps(drawing.gaps, maps),
        closed_gaps=_map_gaps(drawing.closed_gaps, maps),
        healing=_map_healing(drawing, maps, rows),
        unchosen=_map_unchosen(drawing.unchosen, maps),
    )


def _map_lines(lines: Polylines, maps: list[AffineMap]) -> tuple[Polylines, Ints, Ints]:
    """Return the paths under each map, one map after the other; the indices (copy · paths + path)
    of those that remain; and the mask of the vertices that remain. Points that the scale brings
    together are merged, and a path of one point is dropped.

    OptionError if coordinates overflow, or if no path is left."""
    count = len(maps) * len(lines)
    counts = np.tile(np.diff(lines.offsets), len(maps))
    closed = np.tile(lines.closed, len(maps))
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = np.concatenate([copy_map.vertices(lines.vertices) for copy_map in maps])
        keep, _ = without_repeats(vertices, counts, closed)
    try:
        if keep.all():
            offsets = np.concatenate([[0], np.cumsum(counts)])
            return Polylines(vertices, offsets, closed), np.arange(count), np.arange(len(keep))
        owner = np.repeat(np.arange(count), counts)[keep]
        vertex_counts = np.bincount(owner, minlength=count)
        rows = np.flatnonzero(vertex_counts >= 2)
        if not len(rows):
            offsets = np.concatenate([[0], np.cumsum(counts)])
            Polylines(vertices, offsets, closed)  # raises: it names the first point
        closed &= encloses(vertices[keep], owner, vertex_counts)
        offsets = np.concatenate([[0], np.cumsum(vertex_counts[rows])])
        kept_vertices = np.flatnonzero(keep)[vertex_counts[owner] >= 2]
        return Polylines(vertices[kept_vertices], offsets, closed[rows]), rows, kept_vertices
    except GeometryError as error:
        raise OptionError(
            f"scaled {maps[0].scale:g} times, {error.where or 'a path'} has no shape:"
            f" {error.message}",
            where="key scale",
            mend="give a scale nearer to 1, or check the units of the drawing",
        ) from error


def _map_unchosen(unchosen: Unchosen, maps: list[AffineMap]) -> Unchosen:
    """Return the contours that were not chosen, under each map, without those that shrink to
    points."""
    try:
        paths, rows, _ = _map_lines(unchosen.paths, maps)
    except OptionError:  # none is left; the chosen paths are placed already
        return Unchosen()
    copy, path = np.divmod(rows, max(1, len(unchosen.paths)))
    copies = list(zip(copy.tolist(), path.tolist(), strict=True))
    return Unchosen(
        paths=paths,
        layers=tuple(unchosen.layers[each] for _, each in copies),
        sources=tuple(_copy_name(unchosen.sources[each], n) for n, each in copies),
        line_types=tuple(unchosen.line_types[each] for _, each in copies),
    )


def _copy_name(source: str, copy: int) -> str:
    return source if copy == 0 else f"{source} copy {copy + 1}"


def _map_gaps(gaps: tuple[Gap, ...], maps: list[AffineMap]) -> tuple[Gap, ...]:
    return tuple(
        replace(gap, at_mm=copy_map.point(gap.at_mm), size_mm=gap.size_mm * copy_map.scale)
        for copy_map in maps
        for gap in gaps
    )


def _map_healing(drawing: Drawing, maps: list[AffineMap], rows: Ints) -> Healing:
    """Return the branches and crossings of the remaining paths `rows` under the maps; counts of
    what was corrected on reading are unchanged."""
    healing, paths = drawing.healing, len(drawing.paths)
    new_index = {row: index for index, row in enumerate(rows.tolist())}
    return replace(
        healing,
        branches=tuple(
            replace(
                branch,
                at_mm=copy_map.point(branch.at_mm),
                paths=tuple(
                    new_index[k + n * paths] for k in branch.paths if k + n * paths in new_index
                ),
            )
            for n, copy_map in enumerate(maps)
            for branch in healing.branches
        ),
        crossings=tuple(
            replace(each, at_mm=copy_map.point(each.at_mm), path=new_index[each.path + n * paths])
            for n, copy_map in enumerate(maps)
            for each in healing.crossings
            if each.path + n * paths in new_index
        ),
    )
