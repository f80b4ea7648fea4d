"""Lengths, areas, extents, points and tangents of lines and arcs, not of chords; and chords.

Nothing here uses the centre of an arc. With the chord vector d, the bulge b = tan(sweep/4) and
f the part of the sweep that is done, a point of the arc is

    start + sin(f/2)/sin(sweep/2) · d turned by (f − sweep)/2,

which stays exact when a shallow arc has its centre a kilometre away."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import GeometryError
from camtool.geometry.polylines import Polyline, Polylines, Segments

SHALLOW_BULGE = 1e-3
"""Below this bulge the area beside a chord comes from its series: relative error under 1e-11."""


def path_lengths(lines: Polylines) -> Floats:
    """Return the length (M,) of each path, mm."""
    lengths = np.zeros(len(lines))
    for segments in Segments.batches(lines):
        np.add.at(lengths, segments.path, segment_lengths(segments))
    return lengths


def segment_lengths(segments: Segments) -> Floats:
    """Return the length (K,) of each line and arc, mm."""
    chord = segments.end - segments.start
    lengths = np.hypot(chord[:, 0], chord[:, 1])
    # length = radius · |sweep| = chord · (1 + b²) · atan(b)/b
    arcs = np.flatnonzero(segments.is_arc)
    bulge = segments.bulge[arcs]
    lengths[arcs] *= (1.0 + bulge**2) * np.arctan(bulge) / bulge
    return np.asarray(lengths)


def signed_areas(lines: Polylines) -> Floats:
    """Return the area (M,) inside each closed path, mm², CCW positive; 0 for open paths.

    Exact with arcs: the shoelace formula over the chords and the area between chord and arc."""
    rows = np.flatnonzero(lines.closed)
    areas, lines = np.zeros(len(lines)), lines.select(rows.tolist())
    inside = np.zeros(len(lines))
    for segments in Segments.batches(lines):
        # Areas are taken about the first point of each path, so that far drawings lose no digits.
        anchors = lines.vertices[lines.offsets[segments.path], :2]
        start, end = segments.start - anchors, segments.end - anchors
        below = 0.5 * (start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0])
        chord = segments.end - segments.start
        segment_areas = dot(chord, chord) * _area_beside(segments.bulge)
        np.add.at(inside, segments.path, below + segment_areas)
    areas[rows] = inside
    return areas


def _area_beside(bulge: Floats) -> Floats:
    """Return the signed area between a chord of length 1 and its arc of this bulge.

    radius²/2 · (sweep − sin sweep) with radius = (1 + b²)/(4|b|) and sin sweep = 4b(1 − b²)/(1 +
    b²)²; for small b it is b/3 · (1 + b²/5 + …)."""
    shallow = np.abs(bulge) < SHALLOW_BULGE
    b = np.where(shallow, 1.0, bulge)
    square = b * b
    sine = 4.0 * b * (1.0 - square) / (1.0 + square) ** 2
    exact_area = (1.0 + square) ** 2 / (32.0 * square) * (4.0 * np.arctan(b) - sine)
    return np.where(shallow, bulge / 3.0 * (1.0 + bulge * bulge / 5.0), exact_area)


def length(p: Polyline) -> float:
    """Return the length of a path, mm."""
    return float(path_lengths(Polylines.of([p]))[0])


def signed_area(p: Polyline) -> float:
    """Return the area inside a closed path, mm², CCW positive; 0 for an open one."""
    return float(signed_areas(Polylines.of([p]))[0])


def segment_boxes(segments: Segments) -> Floats:
    """Return the box (K, 4), xmin, ymin, xmax, ymax, of each line and arc, mm, exact with the
    extremes of arcs."""
    low = np.minimum(segments.start, segments.end)
    high = np.maximum(segments.start, segments.end)
    rows, points = _extremes(segments)
    np.minimum.at(low, rows, points)
    np.maximum.at(high, rows, points)
    return np.concatenate([low, high], axis=1)


def _extremes(segments: Segments) -> tuple[Ints, Floats]:
    """Return the extreme points (J, 2) of arcs, where the tangent is parallel to an axis, and the
    row (J,) of the arc of each.

    The tangent turns from chord direction − sweep/2 to chord direction + sweep/2; it is parallel
    to an axis at the multiples of 90° between, of which |sweep| ≤ 180° has three at most."""
    quarter = 0.5 * np.pi
    rows = np.flatnonzero(segments.is_arc)
    chord = segments.end[rows] - segments.start[rows]
    sweep = segments[rows].sweep
    first = np.arctan2(chord[:, 1], chord[:, 0]) - 0.5 * sweep
    lowest = np.ceil(np.minimum(first, first + sweep) / quarter)
    tangents = (lowest[:, None] + np.arange(3.0)) * quarter
    turn_left = (tangents - first[:, None]) * np.sign(sweep)[:, None]
    arc, direction = np.nonzero((turn_left > 0.0) & (turn_left < np.abs(sweep)[:, None]))
    return rows[arc], point_at(segments, rows[arc], turn_left[arc, direction] / np.abs(sweep[arc]))


def path_extents(lines: Polylines) -> Floats:
    """Return the box (M, 2, 2), [[xmin, xmax], [ymin, ymax]], of each path, mm, exact with
    arcs."""
    low = np.full((len(lines), 2), np.inf)
    high = np.full((len(lines), 2), -np.inf)
    for segments in Segments.batches(lines):
        boxes = segment_boxes(segments)
        np.minimum.at(low, segments.path, boxes[:, :2])
        np.maximum.at(high, segments.path, boxes[:, 2:])
    return np.stack([low, high], axis=2)


def extents(lines: Polylines) -> Floats:
    """Return the box (2, 2), [[xmin, xmax], [ymin, ymax]], of all paths, mm; GeometryError when
    there are none."""
    if len(lines) == 0:
        raise GeometryError("no paths, so there are no extents")
    each = path_extents(lines)
    return np.stack([each[:, :, 0].min(axis=0), each[:, :, 1].max(axis=0)], axis=1)


def point_at(segments: Segments, row_indices: Ints, t: Floats) -> Floats:
    """Return the points (J, 2), mm, at the fractions t (J,), 0 to 1, of the lengths of these
    segments."""
    start, end = segments.start.take(row_indices, axis=0), segments.end.take(row_indices, axis=0)
    bulge = segments.bulge.take(row_indices)
    arcs = np.flatnonzero(bulge)
    sweep, share = 4.0 * np.arctan(bulge[arcs]), t[arcs]
    ratio = np.sin(0.5 * share * sweep) / np.sin(0.5 * sweep)
    turn = 0.5 * (share - 1.0) * sweep
    along = np.array(t, dtype=np.float64)
    along[arcs] = ratio * np.cos(turn)
    points = (1.0 - along[:, None]) * start + along[:, None] * end
    chord = end[arcs] - start[arcs]
    turn_left = np.column_stack([-chord[:, 1], chord[:, 0]])
    points[arcs] += (ratio * np.sin(turn))[:, None] * turn_left
    return np.asarray(points + 0.0)  # no −0


class ChordPoints(Struct, frozen=True, eq=False):
    """Lines and arcs as chords: `points` (P, 2) mm, the `segment` (P,) of each, and its `share`
    (P,) of the length of that segment. Every segment has a point of its own at both its ends."""

    points: Floats
    segment: Ints
    share: Floats

    @property
    def once(self) -> Floats:
        """The points without the end of each segment; of a closed path each vertex once."""
        return self.points[self.share < 1.0]


def chords_of(segments: Segments, tolerance_mm: float, min_count: int = 1) -> ChordPoints:
    """Return the segments as chords that lie within `tolerance_mm` of them, at least `min_count`
    for each arc."""
    arcs = segments.is_arc
    radius = np.where(arcs, segments.radius, 1.0)
    within = 1.0 - tolerance_mm / np.maximum(radius, tolerance_mm)
    widest = 2.0 * np.arccos(np.clip(within, -1.0, 1.0))
    parts = np.where(arcs, np.maximum(np.ceil(np.abs(segments.sweep) / widest), min_count), 1.0)
    parts = np.maximum(parts, 1.0).astype(np.int64)
    segment = np.repeat(np.arange(len(parts)), parts + 1)
    first = np.cumsum(parts + 1) - parts - 1
    share = (np.arange(len(segment)) - np.repeat(first, parts + 1)) / parts[segment]
    return ChordPoints(point_at(segments, segment, share), segment, share)


def sample(p: Polyline, step_mm: float) -> Floats:
    """Return points (J, 2) along the path, on its lines and arcs, no farther apart than `step_mm`,
    all its vertices among them.

    The first point of a closed path is not repeated at the end."""
    if not step_mm > 0.0:
        raise GeometryError(f"a step of {step_mm} mm is not above 0")
    segments = Segments.of(p)
    counts = np.ceil(segment_lengths(segments) / step_mm).astype(np.int64).clip(min=1)
    rows = np.repeat(np.arange(len(segments)), counts)
    steps = np.arange(len(rows)) - np.repeat(np.cumsum(counts) - counts, counts)
    points = point_at(segments, rows, steps / counts[rows])
    return points if p.closed else np.concatenate([points, p.end[None, :]])


# Lines and arcs described from their start, so that both share one formula and need no centre.
#
# With the unit tangent and the left normal n at the start, the signed curvature k (left positive,
# 0 for lines) and q = p − start,
#
#     k |q|² − 2 n·q = 0          on the whole line or circle,
#
# which stays exact when a shallow arc has its centre a kilometre away.


class Frames(Struct, frozen=True, eq=False):
    """Segments described from their start: `start`, `end`, `tangent`, `normal` (K, 2), `curvature`
    1/mm (left positive), `length` mm and `sweep` rad (K,)."""

    start: Floats
    end: Floats
    tangent: Floats
    normal: Floats
    curvature: Floats
    length: Floats
    sweep: Floats

    @classmethod
    def of(cls, segments: Segments) -> Frames:
        """Return the frame of each segment: start, end, tangent, normal, curvature, length and
        sweep."""
        chord = segments.end - segments.start
        size = np.hypot(chord[:, 0], chord[:, 1])
        unit = chord / size[:, None]
        # The tangent is the chord turned by −sweep/2, and b = tan(sweep/4).
        square = segments.bulge**2
        cosine = (1.0 - square) / (1.0 + square)
        sine = 2.0 * segments.bulge / (1.0 + square)
        tangent = cosine[:, None] * unit - sine[:, None] * turn_left(unit)
        return cls(
            start=segments.start,
            end=segments.end,
            tangent=tangent,
            normal=turn_left(tangent),
            curvature=4.0 * segments.bulge / (size * (1.0 + square)),
            length=segment_lengths(segments),
            sweep=segments.sweep,
        )

    def __getitem__(self, rows: Bools | Ints) -> Frames:
        """Return the frames that a mask or indices select."""
        return Frames(*(column[rows] for column in astuple(self)))

    def tangent_at(self, t: Floats) -> Floats:
        """Return the unit tangent (K, 2) at the fraction t (K,) of each length."""
        turn = t * self.sweep
        cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
        return np.asarray(cosine * self.tangent + sine * self.normal)

    def gap(self, points: Floats) -> Floats:
        """Return the distance (K,) mm of each point (K, 2) from the whole line or circle.

        With g = k|q|² − 2 n·q the distance from the centre squared is (1 + k g)/k²."""
        q = points - self.start
        g = self.curvature * dot(q, q) - 2.0 * dot(self.normal, q)
        return np.asarray(np.abs(g) / (1.0 + np.sqrt(np.maximum(1.0 + self.curvature * g, 0.0))))

    def along(self, points: Floats) -> Floats:
        """Return the length (K,) mm along the curve from its start to each point (K, 2) on it,
        negative before the start.

        The chord to the point makes half the swept angle with the tangent; points before the start
        show as half angles beyond the middle of what remains."""
        q = points - self.start
        side = np.where(self.curvature < 0.0, -1.0, 1.0)
        half = np.arctan2(side * dot(self.normal, q), dot(self.tangent, q))
        limit = 0.5 * np.pi + 0.25 * np.abs(self.sweep)
        before = (half > limit) | (half < -0.5 * np.pi)
        half = np.where(before, np.pi - np.abs(half), np.abs(half))
        chord = np.hypot(q[:, 0], q[:, 1])
        on_line = (self.curvature == 0.0) | (half == 0.0)
        ratio = np.where(on_line, 1.0, half / np.sin(np.where(on_line, 1.0, half)))
        return np.where(before, -chord, chord) * ratio


def turn_left(vectors: Floats) -> Floats:
    """Return vectors (K, 2) turned by 90° counter-clockwise."""
    return np.column_stack([-vectors[:, 1], vectors[:, 0]])


def dot(a: Floats, b: Floats) -> Floats:
    """Return the inner products (K,) of vectors (K, 2)."""
    return np.asarray(a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1])
