"""Distances to true lines and arcs, never to chords.

One formula serves lines and arcs alike and needs no centre. A segment runs from A to B with the
chord vector d, its length c and the bulge b; n is d turned by +90° and M the middle of A and B.

    power(P) = 4b (P−A)·(P−B) − 2(1−b²) d×(P−A)        is 0 on the circle (b = 0: on the line);
    distance to the circle = |power(P)| / (|4b (P−M) − (1−b²) n| + c (1+b²)).

The nearest point lies within the segment, not at an end, where (P−A)·T_A ≥ 0 ≥ (P−B)·T_B with
the tangents T_A and T_B: d turned by ∓ sweep/2. (The edges of these half planes meet in the
centre.)

Between two segments that do not cross, the least distance is met at an end of one of them, at the
foot of an arc's centre on a line, or on the line through two centres: a few candidates, all
measured with the formula above."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import islice

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from camtool.arrays import Bools, Floats, Ints, columns_of
from camtool.geometry.boxes import IndexedCurves, box_pairs
from camtool.geometry.measure import path_extents, segment_boxes
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.kernels.move_tree import hilbert_order
from camtool.kernels.offsets import curves_within, nearest_distances

POINTS_AT_A_TIME = 1 << 14

NEAREST_SPARE_MM = 1e-9
"""Segments that are at most this much farther than the nearest one are measured exactly, ..."""

NEAREST_SPARE = 1e-9
"""... and so are those farther by at most this share of the distance."""

FEW_PAIRS = 256
"""Up to this many distances are computed one by one: building an index would take longer."""

PATHS_AT_A_TIME = 256


class Nearest(Struct, frozen=True, eq=False):
    """The nearest segment to each of P points: the distance (P,) mm, and the row `segment`
    (P,)."""

    distance: Floats
    segment: Ints


class NearestApproach(Struct, frozen=True):
    """Least distance of two paths, mm, and a point (x, y) of one of them that is as far from the
    other one."""

    distance: float
    point: tuple[float, float]


def points_to_segments(points: Floats, segments: Segments) -> Floats:
    """Return the distance (P, K) in mm of each point (P, 2) to each line or arc."""
    return _distance(points[:, None, :], _SegmentRows.of(segments))


def point_to_segment(points: Floats, segments: Segments) -> Floats:
    """Return the distance (K,) in mm of each point (K, 2) to the line or arc of the same row."""
    return _distance(points, _SegmentRows.of(segments))


def nearest(points: Floats, segments: Segments) -> Nearest:
    """Find the nearest segment to each point (P, 2), the first of several; ValueError when there
    are no segments.

    A tree over the segments gives those that are hardly farther than the nearest one, and the
    formula above decides among them."""
    if len(segments) == 0:
        raise ValueError("no segments to be near to")
    order = hilbert_order(segments.start, segments.end)
    curves, rows = IndexedCurves.of(segments[order]), _SegmentRows.of(segments)
    distance = np.empty(len(points))
    segment = np.empty(len(points), dtype=np.int64)
    for begin in range(0, len(points), POINTS_AT_A_TIME):
        # A copy: the compiled loops accept writable arrays only.
        batch = np.array(points[begin : begin + POINTS_AT_A_TIME])
        reach = nearest_distances(batch, curves.rows, curves.tree)
        reach += NEAREST_SPARE_MM + NEAREST_SPARE * reach
        point, candidates = curves_within(batch, reach, curves.rows, curves.tree).T
        candidates = order[candidates]
        distances = _distance(batch[point], rows[candidates])
        best = np.lexsort((candidates, distances, point))[
            np.searchsorted(point, np.arange(len(batch)))
        ]
        distance[begin : begin + POINTS_AT_A_TIME] = distances[best]
        segment[begin : begin + POINTS_AT_A_TIME] = candidates[best]
    return Nearest(distance, segment)


def approach(a: Polyline, b: Polyline) -> NearestApproach:
    """Return the least distance between two paths, 0 where they cross, and a point on one of them
    where it is reached."""
    first, second = Segments.of(a), Segments.of(b)
    boxes, other_boxes = segment_boxes(first), segment_boxes(second)
    if len(a.vertices) * len(second) <= FEW_PAIRS:
        from_vertices = points_to_segments(a.vertices[:, :2], second).min(axis=1)
    else:
        from_vertices = nearest(a.vertices[:, :2], second).distance
    best = _approach(from_vertices, a.vertices[:, :2])
    for i, j in box_pairs(boxes, other_boxes, reach_mm=best.distance):
        order = np.lexsort((j, i))
        candidate = _approach(*paired_distances(first[i[order]], second[j[order]]))
        best = min(best, candidate, key=lambda each: each.distance)
    return best


def approaches(
    lines: Polylines, others: Polylines, pairs: list[tuple[int, int]]
) -> list[NearestApproach]:
    """Return the least distance (`approach`) of each pair of a path of `lines` and one of
    `others`, given by their indices.

    Pairs with few segments are measured together."""
    return list(each_approach(lines, others, pairs))


def each_approach(
    lines: Polylines, others: Polylines, pairs: Iterable[tuple[int, int]]
) -> Iterator[NearestApproach]:
    """Yield the results of `approaches` one by one.

    Pairs are taken in batches, and those with many segments are measured only when the caller asks
    for them."""
    one, other = _PathRows.of(lines), _PathRows.of(others)
    counts, other_counts = np.diff(one.first), np.diff(other.first)
    elements = np.maximum(np.diff(lines.offsets), counts)
    every = iter(pairs)
    while batch := list(islice(every, PATHS_AT_A_TIME)):
        rows, columns = np.array(batch, dtype=np.int64).T
        is_few = counts[rows] * other_counts[columns] > 0
        is_few &= elements[rows] * other_counts[columns] <= FEW_PAIRS
        few = one.approaches(rows[is_few], other, columns[is_few])
        for (row, column), is_one in zip(batch, is_few.tolist(), strict=True):
            yield next(few) if is_one else approach(lines[row], others[column])


class _PathRows(Struct, frozen=True, eq=False):
    """Paths with their segments, and the boxes (K, 4) of these; the segments of path i are
    first[i] to first[i + 1]."""

    paths: Polylines
    segments: Segments
    boxes: Floats
    first: Ints

    @classmethod
    def of(cls, lines: Polylines) -> _PathRows:
        segments = Segments.of(lines)
        first = np.searchsorted(segments.path, np.arange(len(lines) + 1))
        return cls(lines, segments, segment_boxes(segments), first)

    def approaches(
        self, rows: Ints, others: _PathRows, columns: Ints
    ) -> Iterator[NearestApproach]:
        """Yield the least distance of each of these paths, `rows`, from the path of `others` in
        the same place of `columns`."""
        vertices = self.paths.vertices[:, :2]
        pair, i, j = _crossed(self.paths.offsets, rows, others.first, columns)
        distance = point_to_segment(vertices[i], others.segments[j])
        _, minima = _least(pair, distance)
        best, points = distance[minima], vertices[i[minima]]
        pair, i, j = _crossed(self.first, rows, others.first, columns)
        low = np.maximum(self.boxes[i, :2], others.boxes[j, :2])
        high = np.minimum(self.boxes[i, 2:], others.boxes[j, 2:])
        is_near = (low <= high + best[pair, None]).all(axis=1)
        pair, i, j = pair[is_near], i[is_near], j[is_near]
        distance, places = paired_distances(self.segments[i], others.segments[j])
        of, minima = _least(pair, distance)
        is_less = distance[minima] < best[of]
        of, minima = of[is_less], minima[is_less]
        best[of], points[of] = distance[minima], places[minima]
        for (x, y), mm in zip(points.tolist(), best.tolist(), strict=True):
            yield NearestApproach(mm, (x, y))


def _crossed(first: Ints, rows: Ints, other_first: Ints, columns: Ints) -> tuple[Ints, Ints, Ints]:
    """Return all combinations of an element of one path with an element of the other, for each
    pair of paths.

    They are three columns (J,): the pair, the element of one, the element of the other. Elements
    are numbered path after path, those of path i from first[i] on."""
    across = np.diff(other_first)[columns]
    counts = np.diff(first)[rows] * across
    pair = np.repeat(np.arange(len(rows)), counts)
    within = np.arange(len(pair)) - (np.cumsum(counts) - counts)[pair]
    i, j = np.divmod(within, across[pair])
    return pair, first[rows][pair] + i, other_first[columns][pair] + j


def _least(pair: Ints, distance: Floats) -> tuple[Ints, Ints]:
    """Return the pairs that occur, ascending, and for each the row of its least distance, the
    first of equal ones."""
    order = np.lexsort((distance, pair))
    begins = np.flatnonzero(np.diff(pair, prepend=-1))
    return pair[begins], order[begins]


def near_paths(lines: Polylines, targets: Polylines, reach_mm: float) -> Iterator[tuple[int, int]]:
    """Yield pairs of paths that may come within `reach_mm` of each other.

    Their boxes do, and for paths with many segments boxes of single segments too; true distances
    are not measured."""
    one, other = _PathBoxes.of(lines), _PathBoxes.of(targets)
    for rows, columns in box_pairs(one.paths, other.paths, reach_mm=reach_mm):
        counts = np.diff(one.first)[rows] * np.diff(other.first)[columns]
        pairs = zip(rows.tolist(), columns.tolist(), (counts > FEW_PAIRS).tolist(), strict=True)
        for row, column, has_many in pairs:
            if not has_many or one.comes_near(row, other, column, reach_mm):
                yield row, column


class _PathBoxes(Struct, frozen=True, eq=False):
    """Boxes (M, 4) of paths and (K, 4) of their segments; those of path i are first[i] to first[i
    + 1]."""

    paths: Floats
    segments: Floats
    first: Ints

    @classmethod
    def of(cls, lines: Polylines) -> _PathBoxes:
        segments = Segments.of(lines)
        paths = path_extents(lines).transpose(0, 2, 1).reshape(-1, 4)
        first = np.searchsorted(segments.path, np.arange(len(lines) + 1))
        return cls(paths, segment_boxes(segments), first)

    def comes_near(self, row: int, others: _PathBoxes, column: int, reach_mm: float) -> bool:
        """Return True if the box of a segment of this path comes within `reach_mm` of one of the
        other path."""
        one = self.segments[self.first[row] : self.first[row + 1]]
        other = others.segments[others.first[column] : others.first[column + 1]]
        (low, high), (other_low, other_high) = (
            (boxes[:2] - reach_mm, boxes[2:] + reach_mm)
            for boxes in (self.paths[row], others.paths[column])
        )
        is_near_one = (one[:, :2] <= other_high) & (one[:, 2:] >= other_low)
        is_near_other = (other[:, :2] <= high) & (other[:, 2:] >= low)
        one = one[columns_of(is_near_one).all(axis=0)]
        other = other[columns_of(is_near_other).all(axis=0)]
        return any(len(rows) for rows, _ in box_pairs(one, other, reach_mm=reach_mm))


def _approach(distance: Floats, points: Floats) -> NearestApproach:
    row = int(distance.argmin())
    return NearestApproach(float(distance[row]), (float(points[row, 0]), float(points[row, 1])))


class _SegmentRows(Struct, frozen=True, eq=False):
    """Segments in the form of the formula: A, B, d, 4b, 1−b², c(1+b²), T_A and T_B."""

    a: Floats
    b: Floats
    d: Floats
    four_b: Floats
    flat: Floats
    size: Floats
    tangent_a: Floats
    tangent_b: Floats

    @classmethod
    def of(cls, segments: Segments) -> _SegmentRows:
        d, bulge = segments.end - segments.start, segments.bulge
        flat = 1.0 - bulge**2
        # Up to the factor 1 + b², cos(sweep/2) is 1 − b² and sin(sweep/2) is 2b.
        along, across = flat[:, None] * d, (2.0 * bulge)[:, None] * _turn_left(d)
        return cls(
            a=segments.start,
            b=segments.end,
            d=d,
            four_b=4.0 * bulge,
            flat=flat,
            size=np.hypot(d[:, 0], d[:, 1]) * (1.0 + bulge**2),
            tangent_a=along - across,
            tangent_b=along + across,
        )

    def __getitem__(self, rows: Ints) -> _SegmentRows:
        return _SegmentRows(*(column[rows] for column in astuple(self)))

    def power(self, points: Floats) -> Floats:
        from_a = points - self.a
        dots = _dot(from_a, points - self.b)
        return np.asarray(self.four_b * dots - 2.0 * self.flat * _cross(self.d, from_a))

    def expanded(self, origin: Floats) -> tuple[Floats, Floats]:
        """Return `linear` (N, 2) and `constant` (N,) of power(origin + x) = 4b |x|² + linear·x +
        constant."""
        a, b = self.a - origin, self.b - origin
        linear = -self.four_b[:, None] * (a + b) - 2.0 * self.flat[:, None] * _turn_left(self.d)
        return linear, self.four_b * _dot(a, b) + 2.0 * self.flat * _cross(self.d, a)

    def is_beside(self, points: Floats) -> Bools:
        """Return True where the nearest point of the full circle or line lies within the segment,
        not beyond its ends."""
        after_a = _dot(points - self.a, self.tangent_a) >= 0.0
        before_b = _dot(points - self.b, self.tangent_b) <= 0.0
        return np.asarray(after_a & before_b)


def _distance(points: Floats, rows: _SegmentRows) -> Floats:
    """Return the distance of points from segments; both are broadcast against each other."""
    to_a = np.hypot(points[..., 0] - rows.a[..., 0], points[..., 1] - rows.a[..., 1])
    to_b = np.hypot(points[..., 0] - rows.b[..., 0], points[..., 1] - rows.b[..., 1])
    middle = 0.5 * (rows.a + rows.b)
    normal = _turn_left(rows.d)
    arm = rows.four_b[..., None] * (points - middle) - rows.flat[..., None] * normal
    perpendicular = np.abs(rows.power(points)) / (np.hypot(arm[..., 0], arm[..., 1]) + rows.size)
    return np.where(rows.is_beside(points), perpendicular, np.minimum(to_a, to_b))


def paired_distances(a: Segments, b: Segments) -> tuple[Floats, Floats]:
    """Return the distance (N,) of each of N pairs of segments, 0 where they cross, and a point (N,
    2) of one of them where it is reached."""
    rows_a, rows_b = _SegmentRows.of(a), _SegmentRows.of(b)
    candidates: list[tuple[Floats, Floats]] = []
    for points in (a.start, a.end):
        candidates.append((_distance(points, rows_b), points))
    for points in (b.start, b.end):
        candidates.append((_distance(points, rows_a), points))
    candidates.append(_toward(a, rows_a, b, rows_b))
    candidates.append(_toward(b, rows_b, a, rows_a))
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        for points in _common_points(rows_a, rows_b):
            crosses = rows_a.is_beside(points) & rows_b.is_beside(points)
            candidates.append((np.where(crosses, 0.0, np.inf), points))
    distances = np.array([distance for distance, _ in candidates])
    best, pair = distances.argmin(axis=0), np.arange(len(a))
    return distances[best, pair], np.array([points for _, points in candidates])[best, pair]


def _toward(
    a: Segments, rows_a: _SegmentRows, b: Segments, rows_b: _SegmentRows
) -> tuple[Floats, Floats]:
    """Return the distance from `b` of the point of `a` that is nearest to the centre of the arc
    `b`, and that point.

    It is infinite where `b` is a line, where the centres coincide (then ends are as near), and
    where that point is not within `a`. If one circle lies within the other, this finds the nearest
    points with `a` and `b` exchanged."""
    centre = np.where(b.is_arc[:, None], b.centre, rows_a.a)
    part = _dot(centre - rows_a.a, rows_a.d) / _dot(rows_a.d, rows_a.d)
    foot = rows_a.a + part[:, None] * rows_a.d
    arm = np.where(a.is_arc[:, None], centre - a.centre, 1.0)
    length = np.hypot(arm[:, 0], arm[:, 1])
    is_distinct = length > 0.0
    unit = arm / np.where(is_distinct, length, 1.0)[:, None]
    radius = np.where(a.is_arc, a.radius, 0.0)
    points = np.where(a.is_arc[:, None], a.centre + radius[:, None] * unit, foot)
    valid = b.is_arc & is_distinct & rows_a.is_beside(points)
    return np.where(valid, _distance(points, rows_b), np.inf), points


def _common_points(a: _SegmentRows, b: _SegmentRows) -> tuple[Floats, Floats]:
    """Return the two points (N, 2) that the full lines or circles of each pair share; NaN if none.

    power(x) = 4b |x|² + l·x + k, and 4b_b·power_a − 4b_a·power_b is linear: the line through both
    points. (Two lines: power_a itself is it.) On that line, x0 + s e, the power of the rounder one
    of both is a quadratic in s."""
    origin = a.a
    linear_a, constant_a = a.expanded(origin)
    linear_b, constant_b = b.expanded(origin)
    lines = (a.four_b == 0.0) & (b.four_b == 0.0)
    weight_a, weight_b = np.where(lines, 1.0, b.four_b), -a.four_b
    across = weight_a[:, None] * linear_a + weight_b[:, None] * linear_b
    constant = weight_a * constant_a + weight_b * constant_b
    across_length = np.hypot(across[:, 0], across[:, 1])
    unit = across / across_length[:, None]
    foot = -(constant / across_length)[:, None] * unit
    along = _turn_left(unit)
    rounder = np.abs(b.four_b) >= np.abs(a.four_b)
    four_b = np.where(rounder, b.four_b, a.four_b)
    linear = np.where(rounder[:, None], linear_b, linear_a)
    slope = 2.0 * four_b * _dot(foot, along) + _dot(linear, along)
    value = four_b * _dot(foot, foot) + _dot(linear, foot)
    value += np.where(rounder, constant_b, constant_a)
    root = np.sqrt(slope**2 - 4.0 * four_b * value)
    stable = -0.5 * (slope + np.copysign(root, slope))
    one, second_root = stable / four_b, value / stable
    return (origin + foot + one[:, None] * along, origin + foot + second_root[:, None] * along)


def _turn_left(vectors: Floats) -> Floats:
    """Return vectors (..., 2) turned by 90° counter-clockwise."""
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1])


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
