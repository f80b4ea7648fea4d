"""What a round tool cannot touch: a region without the same region opened by a disc.

A disc of radius r that stays in a region covers the region shrunk by r and grown again. What that
leaves are the feet of corners and places narrower than the tool. Both boundaries are lines and
arcs, and the inner one never crosses the outer one: they run together, part, and meet again.

    region  ─ sections that do not run together with the opened one ──┐
    opened  ─ sections that do not run together with the region, back ┴─▶ closed: the pieces"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from functools import cache

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.findings import Finding
from camtool.geometry.boxes import IndexedCurves
from camtool.geometry.distance import nearest
from camtool.geometry.measure import Frames, extents, point_at, segment_lengths, signed_areas
from camtool.geometry.nesting import Nesting, regions
from camtool.geometry.offset import merge_points, offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse_lines,
)
from camtool.kernels.offsets import curves_within, nearest_distances
from camtool.planning.findings import (
    GOUGE_BEYOND,
    GOUGE_MORE,
    UNREACHED,
    UNREACHED_CORNERS,
    UNREACHED_MORE,
    UNREACHED_SCALLOP,
)
from camtool.planning.items import Setting
from camtool.planning.job import Operation
from camtool.planning.naming import MAX_LISTED, shortened_list, tool_name, width_name
from camtool.planning.paths import MeasuredPath, true_ranges
from camtool.planning.strategies import MAX_SCALLOP_DISCS, SCALLOP_DISC_SHARE

TOGETHER_MM = 5e-6
"""Two boundaries nearer than this coincide; it is above the error of two offsets in a row."""

SAME_PLACE_MM = 2e-5
"""Ends of sections nearer than this are the same point."""

MIN_FOOT_SHARE = 1e-3
"""Pieces smaller than this part of the tool's disc are left out: the foot of a square corner is
0.068 of it, that of a corner of 156 degrees is just so large."""

PROBES = (0.0, 0.3, 0.5, 0.7, 1.0)
"""Shares of a part between two vertices at which its distance from the other path is measured. The
ends do not tell whether it coincides with the other path, only how far it leads away."""

PARTING = 4.0
"""Ends of sections that meet no other are joined when they are no farther apart than this many
times √(2 r · TOGETHER_MM): over that length a disc of radius r leaves a straight wall by
TOGETHER_MM, so the place is known no better."""

CORNER_SHARE = 0.25
"""Pieces up to this part of the tool's disc count as feet of corners, and give one finding
together: that of a corner of 55 degrees is as large."""


class Unreached(Struct, frozen=True, eq=False):
    """A piece that the tool cannot touch: `area_mm2`; `at_mm` (x, y), its vertex farthest from
    what is reached; and its `outline`, the outer path CCW and any holes CW."""

    area_mm2: float
    at_mm: tuple[float, float]
    outline: Polylines


def opened(region: Polylines, tool_radius_mm: float) -> Polylines:
    """Return the region (on the left of its closed paths) opened by a disc of the tool's radius:
    what the disc covers while it stays in the region."""
    return offset_shape(offset_shape(region, tool_radius_mm), -tool_radius_mm)


def unreached(region: Polylines, tool_radius_mm: float) -> list[Unreached]:
    """Return the pieces of a region that a disc within it cannot cover, the largest first.

    The region is on the left of its closed paths, which may also be the holes of an endless one.
    Pieces smaller than MIN_FOOT_SHARE of the disc's area are left out. GeometryError for open
    paths."""
    if tool_radius_mm <= POSITION_EPS_MM or len(region) == 0:
        return []
    reached = opened(region, tool_radius_mm)
    min_area = MIN_FOOT_SHARE * np.pi * tool_radius_mm**2
    parting = PARTING * math.sqrt(2.0 * tool_radius_mm * TOGETHER_MM)
    nesting = Nesting(_difference(region, reached, min_area, parting))
    pieces = [piece for _, piece in regions(nesting)]
    areas = [float(signed_areas(piece).sum()) for piece in pieces]
    large = [(area, piece) for area, piece in zip(areas, pieces, strict=True) if area >= min_area]
    places = _far_places([piece for _, piece in large], reached)
    unreached_pieces = [
        Unreached(area, place, piece) for (area, piece), place in zip(large, places, strict=True)
    ]
    return sorted(unreached_pieces, key=lambda piece: (-piece.area_mm2, piece.at_mm))


def _far_places(pieces: Sequence[Polylines], reached: Polylines) -> list[tuple[float, float]]:
    """Return for each piece the vertex farthest from the `reached` region; the centre of the piece
    if nothing is reached."""
    if len(reached) == 0 or not pieces:
        centres = [extents(piece).mean(axis=1).tolist() for piece in pieces]
        return [(x, y) for x, y in centres]
    points = np.concatenate([piece.vertices[:, :2] for piece in pieces])
    distances = nearest(points, Segments.of(reached)).distance
    places = []
    begin = 0
    for piece in pieces:
        end = begin + len(piece.vertices)
        x, y = points[begin + int(distances[begin:end].argmax())].tolist()
        places.append((x, y))
        begin = end
    return places


def _difference(
    region: Polylines, reached: Polylines, least_mm2: float, parting_mm: float
) -> Polylines:
    """Return the closed paths around the part of the region that is not in `reached`, which must
    lie in the region.

    Pieces that are surely smaller than `least_mm2` may be left out."""
    if len(reached) == 0:
        return region
    inner = reverse_lines(_separate_sections(reached, region, least_mm2))
    sections = [*_separate_sections(region, reached, least_mm2), *inner]
    closed_paths = [path for path in sections if path.closed]
    opens = [path for path in sections if not path.closed]
    return Polylines.of([*closed_paths, *_closed(opens, parting_mm)])


def _separate_sections(lines: Polylines, other: Polylines, least_mm2: float) -> Polylines:
    """Return the sections of closed paths that do not coincide with `other`; a path that nowhere
    coincides is returned closed.

    Sections begin and end at vertices of either side, since where one path parts from the other,
    the other parts from it. A section of length l that leads at most h away encloses no more than
    2 l h: if that is less than `least_mm2` it is left out, as are the many at the blunt corners of
    a fine polygon."""
    segments = Segments.of(lines)
    row, low, high = _split(segments, other.vertices[:, :2])
    parts = np.array(PROBES)
    probes = (low[:, None] + (high - low)[:, None] * parts).ravel()
    points = point_at(segments, np.repeat(row, len(parts)), probes)
    distances = _distances(points, Segments.of(other)).reshape(-1, len(parts))
    is_wanted = np.asarray((distances[:, 1:-1] > TOGETHER_MM).any(axis=1))
    lengths = segment_lengths(segments)[row] * (high - low)
    first = np.searchsorted(segments.path[row], np.arange(len(lines) + 1))
    closed_paths: list[Polyline] = []
    sections: list[Floats] = []
    for index in distinct(segments.path[row[is_wanted]]).tolist():
        path_rows = slice(int(first[index]), int(first[index + 1]))
        if is_wanted[path_rows].all():
            closed_paths.append(lines[index])
            continue
        path_parts = _Parts(
            lengths[path_rows], distances[path_rows].max(axis=1), is_wanted[path_rows]
        )
        sections += path_parts.sections(lines[index], least_mm2)
    # Together: the checks of each by itself would take half of the time of a halftone.
    offsets = np.cumsum([0, *map(len, sections)])
    is_open = np.zeros(len(sections), dtype=np.bool_)
    open_lines = Polylines(np.concatenate([np.empty((0, 3)), *sections]), offsets, is_open)
    return Polylines.joined([Polylines.of(closed_paths), open_lines])


class _Parts(Struct, frozen=True, eq=False):
    """The parts of a closed path in order: the length of each (K,), its distance from the other
    paths (K,), mm, and the mask of those that are wanted, which are not all."""

    length: Floats
    distances: Floats
    is_wanted: Bools

    def sections(self, path: Polyline, least_mm2: float) -> list[Floats]:
        """Return the vertices (n, 3) of each run of wanted parts, without runs that surely enclose
        less than `least_mm2`."""
        turn = int(np.argmin(self.is_wanted))
        length, distances = np.roll(self.length, -turn), np.roll(self.distances, -turn)
        begin = np.concatenate([[0.0], np.cumsum(length)]) + self.length[:turn].sum()
        first, last = true_ranges(np.roll(self.is_wanted, -turn))
        # The path is rotated to begin with an unwanted part, so that wanted and unwanted
        # alternate.
        edges = np.column_stack([first, last]).ravel()
        farthest = np.maximum.reduceat(np.append(distances, 0.0), edges)[::2]
        large = 2.0 * (begin[last] - begin[first]) * farthest >= least_mm2
        along = MeasuredPath.of(path)
        sections = []
        for low, high in zip(begin[first[large]], begin[last[large]], strict=True):
            vertices = along.piece(float(low), float(high))
            if np.hypot(*np.diff(vertices[:, :2], axis=0).T).min() > POSITION_EPS_MM:
                sections.append(vertices)
        return sections


def _split(segments: Segments, points: Floats) -> tuple[Ints, Floats, Floats]:
    """Return (row, begin, end) of the parts into which the points divide the segments that they
    lie on; begin and end are shares of the segment."""
    curves, points = IndexedCurves.of(segments), np.ascontiguousarray(points)
    distances = nearest_distances(points, curves.rows, curves.tree)
    is_on = (distances <= TOGETHER_MM) & ~_at_any(points, segments.start)
    points, distances = points[is_on], distances[is_on]
    pairs = curves_within(points, distances + POSITION_EPS_MM, curves.rows, curves.tree)
    row = pairs[np.unique(pairs[:, 0], return_index=True)[1], 1]
    frames = Frames.of(segments)[row]
    along = frames.along(points)
    is_inner = (along > TOGETHER_MM) & (along < frames.length - TOGETHER_MM)
    row, part = row[is_inner], (along / frames.length)[is_inner]
    rows = np.concatenate([np.arange(len(segments)), row])
    low = np.concatenate([np.zeros(len(segments)), part])
    order = np.lexsort([low, rows])
    rows, low = rows[order], low[order]
    last = np.concatenate([rows[1:] != rows[:-1], [True]])
    high = np.where(last, 1.0, np.concatenate([low[1:], [1.0]]))
    return rows, low, high


def _distances(points: Floats, segments: Segments) -> Floats:
    """Return the distance (P,) of each point (P, 2) from the nearest segment."""
    curves = IndexedCurves.of(segments)
    return nearest_distances(np.ascontiguousarray(points), curves.rows, curves.tree)


def _at_any(points: Floats, other_points: Floats) -> Bools:
    """Return the mask (P,) of points (P, 2) that coincide with one of the others (N, 2)."""
    node, _ = merge_points(np.concatenate([points, other_points]), TOGETHER_MM)
    return np.isin(node[: len(points)], node[len(points) :])


def _closed(sections: list[Polyline], parting_mm: float) -> list[Polyline]:
    """Return the closed paths that open sections form when joined; sections that lead nowhere are
    left out. Ends up to `parting_mm` apart may be joined."""
    if not sections:
        return []
    ends = np.array([[path.start, path.end] for path in sections]).reshape(-1, 2)
    node = merge_points(ends, SAME_PLACE_MM)[0].reshape(-1, 2)
    unmatched = np.flatnonzero(~np.isin(node[:, 0], node[:, 1]))
    for row in np.flatnonzero(~np.isin(node[:, 1], node[:, 0])).tolist():
        gaps = np.hypot(*(ends[2 * unmatched] - ends[2 * row + 1]).T)
        if gaps.min(initial=math.inf) <= parting_mm:
            node[row, 1] = node[unmatched[gaps.argmin()], 0]
    rows_from: dict[int, list[int]] = defaultdict(list)
    for row, place in enumerate(node[:, 0].tolist()):
        rows_from[place].append(row)

    @cache
    def frames_of(row: int) -> Frames:
        return Frames.of(Segments.of(sections[row]))

    is_free = np.ones(len(sections), dtype=np.bool_)
    closed_paths = []
    for first in range(len(sections)):
        path = [first] if is_free[first] else []
        while path and node[path[-1], 1] != node[first, 0]:
            is_free[path[-1]] = False
            onward = [row for row in rows_from[int(node[path[-1], 1])] if is_free[row]]
            if not onward:
                path = []
                break
            if len(onward) > 1:
                turns = [_turn(frames_of(path[-1]), frames_of(row)) for row in onward]
                onward = [onward[int(np.argmax(turns))]]
            path += onward
        if path:
            is_free[path] = False
            closed_paths += _joined([sections[row] for row in path])
    return closed_paths


def _turn(arriving: Frames, leaving_frames: Frames) -> float:
    """Return the angle by which the path turns from the end of one section to the start of
    another, left positive."""
    x, y = arriving.tangent_at(np.ones(len(arriving.length)))[-1]
    u, v = leaving_frames.tangent[0]
    return float(np.arctan2(x * v - y * u, x * u + y * v))


def _joined(sections: list[Polyline]) -> list[Polyline]:
    """Return consecutive sections as one closed path in a list; [] if it is only a speck."""
    vertices = np.concatenate([path.vertices for path in sections])
    step = np.roll(vertices[:, :2], -1, axis=0) - vertices[:, :2]
    vertices = vertices[np.hypot(*step.T) > SAME_PLACE_MM]
    if len(vertices) < 2 or (len(vertices) == 2 and not vertices[:, 2].any()):
        return []
    return [Polyline(vertices, closed=True)]


def unreached_findings(
    region: Polylines, setting: Setting, *, hair_mm: float = 0.0
) -> list[Finding]:
    """Return findings about what the tool, staying within the region (on the left of its closed
    paths), cannot touch.

    Corners are not reported where the operation makes reliefs, nor for chamfers, whose bevels are
    round there. Slots narrower than the tool by `hair_mm` count as reached."""
    radius = setting.operation.wall_radius_mm
    pieces = unreached(region, radius - 0.5 * hair_mm)
    largest_foot = CORNER_SHARE * np.pi * radius**2
    wide = [piece for piece in pieces if piece.area_mm2 > largest_foot]
    feet = [piece for piece in pieces if piece.area_mm2 <= largest_foot]
    if setting.operation.corners != "none" or setting.operation.contract.breaks_edges:
        feet = []
    tool_words = width_name(setting.operation)
    return [*_places(wide, tool_words), *_corners(feet, tool_words)]


def scallop_findings(region: Polylines, setting: Setting) -> Iterator[Finding]:
    """Yield a finding on how much adaptive clearing leaves in the corners of a region (on the left
    of its closed paths)."""
    radius_mm = setting.operation.wall_radius_mm
    disc_mm = SCALLOP_DISC_SHARE * radius_mm
    centres = offset_shape(region, radius_mm)
    cleared = opened(centres, disc_mm)
    pieces = unreached(centres, disc_mm)
    if not (len(cleared) and pieces):
        return
    places = np.array([piece.at_mm for piece in pieces])
    depths = nearest(places, Segments.of(cleared)).distance
    depths[depths > MAX_SCALLOP_DISCS * disc_mm] = 0.0
    worst = int(depths.argmax())
    if depths[worst] > 0.0:
        yield UNREACHED_SCALLOP(
            where=_where(pieces[worst]),
            measured=float(depths[worst]),
            corners=int((depths > 0.0).sum()),
        )


def cut_away_findings(kept_region: Polylines, operation: Operation) -> list[Finding]:
    """Return findings where an operation that cuts beyond its lines removes, from both sides,
    material that must stay (`kept_region`, on the left of its closed paths): the parts that a disc
    of that radius does not cover, except corners."""
    beyond_mm = operation.beyond_mm
    if not beyond_mm:
        return []
    corner = CORNER_SHARE * np.pi * beyond_mm**2
    thin = [piece for piece in unreached(kept_region, beyond_mm) if piece.area_mm2 > corner]
    findings = [
        GOUGE_BEYOND(
            where=_where(piece),
            measured=2.0 * beyond_mm,
            tool=tool_name(operation.tool),
            amount=beyond_mm,
        )
        for piece in thin
    ]
    return shortened_list(findings, GOUGE_MORE)


def _places(pieces: Sequence[Unreached], tool_words: str) -> Iterator[Finding]:
    for piece in pieces[:MAX_LISTED]:
        yield UNREACHED(where=_where(piece), measured=piece.area_mm2, tool=tool_words)
    unlisted = pieces[MAX_LISTED:]
    if unlisted:
        area = sum(piece.area_mm2 for piece in unlisted)
        yield UNREACHED_MORE(
            where=_where(unlisted[0]), measured=area, tool=tool_words, places=len(unlisted)
        )


def _corners(pieces: Sequence[Unreached], tool_words: str) -> Iterator[Finding]:
    if not pieces:
        return
    area = sum(piece.area_mm2 for piece in pieces)
    yield UNREACHED_CORNERS(
        where=_where(pieces[0]), measured=area, tool=tool_words, corners=len(pieces)
    )


def _where(piece: Unreached) -> str:
    return f"at X {piece.at_mm[0]:.4f} Y {piece.at_mm[1]:.4f}"
