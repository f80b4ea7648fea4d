"""Intersections of lines and arcs, and self-crossings of closed paths.

Curves are described from their start (`measure.Frames`): with the left normal n there and the
signed curvature k, a point p of the whole line or circle has k |p−start|² = 2 n·(p−start).

For two curves, let R be the rounder one and F the flatter one, both written about the start of R:

    R:  kR |p|² − 2 nR·p = 0         F:  kF |p|² − 2 m·p + e = 0,   m = nF + kF w,
                                     e = kF |w|² + 2 nF·w,   w = start of F − start of R.

F − (kF/kR) R is linear: the line through both common points. R cut with that line is a quadratic.

Every candidate (two roots, and the four end points) is then measured: it counts when it is within
`position_eps_mm` of both curves and within that of the range of both. So nearly tangent and
coincident curves need no case of their own: coincident ones meet at the ends of what they share.
The tolerance decides whether two curves meet at all and whether two meetings are one; it never
moves a crossing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.boxes import box_pairs, touching_boxes
from camtool.geometry.drawing import SelfCrossing
from camtool.geometry.measure import Frames, dot, segment_boxes, turn_left
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments


class Crossings(Struct, frozen=True, eq=False):
    """All meetings in columns, J rows: `row_a`, `row_b` (J,), `point` (J, 2) mm, `ta`, `tb` (J,).

    `ta` and `tb` are fractions of the lengths, exactly 0 or 1 at an end. A pair that shares a
    run has two rows, one for each end of the run."""

    row_a: Ints
    row_b: Ints
    point: Floats
    ta: Floats
    tb: Floats

    def __len__(self) -> int:
        return len(self.row_a)

    def __getitem__(self, rows: Bools | Ints) -> Crossings:
        """Return the meetings that a mask or indices select."""
        return Crossings(*(column[rows] for column in astuple(self)))


def crossings(
    segments_a: Segments, segments_b: Segments, *, position_eps_mm: float = POSITION_EPS_MM
) -> Crossings:
    """Return all common points of any segment of `a` with any segment of `b` (see `Crossings`)."""
    boxes_a, boxes_b = segment_boxes(segments_a), segment_boxes(segments_b)
    frames_a, frames_b = Frames.of(segments_a), Frames.of(segments_b)
    parts = [
        _meetings(frames_a, frames_b, row_a, row_b, position_eps_mm)
        for row_a, row_b in box_pairs(boxes_a, boxes_b, reach_mm=position_eps_mm)
    ]
    return _concatenate(parts)


def self_crossings(segments: Segments) -> Crossings:
    """Return all common points of two different segments, each pair once (row_a < row_b).

    The end that a segment shares with the next one of its path is left out."""
    boxes, frames = segment_boxes(segments), Frames.of(segments)
    parts = []
    for row_a, row_b in box_pairs(boxes, boxes, reach_mm=POSITION_EPS_MM):
        is_first = row_a < row_b
        parts.append(_meetings(frames, frames, row_a[is_first], row_b[is_first], POSITION_EPS_MM))
    crossings = _concatenate(parts)
    same_path = segments.path[crossings.row_a] == segments.path[crossings.row_b]
    count = np.bincount(segments.path, minlength=1)[segments.path[crossings.row_a]]
    row_gap = crossings.row_b - crossings.row_a
    a_first = (row_gap == 1) & (crossings.ta == 1.0) & (crossings.tb == 0.0)
    b_first = (row_gap == count - 1) & (crossings.ta == 0.0) & (crossings.tb == 1.0)
    return crossings[~(same_path & (a_first | b_first))]


def meetings(segments: Segments, row_a: Ints, row_b: Ints) -> tuple[Crossings, Bools]:
    """Return the common points of pairs of segments, row_a[j] with row_b[j], and the mask of those
    at which they cross and do not only touch."""
    frames = Frames.of(segments)
    crossings = _meetings(frames, frames, row_a, row_b, POSITION_EPS_MM)
    return crossings, ~_touching(crossings, frames, POSITION_EPS_MM)


def _concatenate(parts: list[Crossings]) -> Crossings:
    no_rows = np.empty(0, dtype=np.int64)
    parts = [*parts, Crossings(no_rows, no_rows, np.empty((0, 2)), np.empty(0), np.empty(0))]
    return Crossings(*map(np.concatenate, zip(*map(astuple, parts), strict=True)))


def _meetings(a: Frames, b: Frames, row_a: Ints, row_b: Ints, eps: float) -> Crossings:
    """Return the common points of segments row_a[j] of `a` and row_b[j] of `b`: first those at
    ends, then those within."""
    frames_a, frames_b = a[row_a], b[row_b]
    ends = [frames_a.start, frames_a.end, frames_b.start, frames_b.end]
    common = [
        _if_apart(each, frames_a, frames_b, eps) for each in _common_points(frames_a, frames_b)
    ]
    candidates = [*ends, *common]
    passed: list[tuple[Floats, Bools, Floats, Floats]] = []
    for points in candidates:
        on_a, along_a = _locate_on_segments(points, frames_a, eps)
        on_b, along_b = _locate_on_segments(points, frames_b, eps)
        is_new = on_a & on_b
        for earlier, valid, _, _ in passed:
            distances = np.hypot(*(points - earlier).T)
            is_new &= ~(valid & (distances <= 2.0 * eps))
        passed.append((points, is_new, along_a, along_b))
    return _concatenate(
        [
            Crossings(
                row_a[is_new],
                row_b[is_new],
                points[is_new],
                _fraction(along_a[is_new], frames_a.length[is_new], eps),
                _fraction(along_b[is_new], frames_b.length[is_new], eps),
            )
            for points, is_new, along_a, along_b in passed
        ]
    )


def _locate_on_segments(points: Floats, frames: Frames, eps: float) -> tuple[Bools, Floats]:
    """Return the mask of the points (K, 2) within `eps` of their segment, and their distances
    along it from its start; a NaN lies on none."""
    along = frames.along(points)
    inside = (along >= -eps) & (along <= frames.length + eps)
    return np.asarray(inside & (frames.gap(points) <= eps)), along


def _fraction(along: Floats, length: Floats, eps: float) -> Floats:
    """Return lengths along segments as fractions of their length, exactly 0 or 1 within `eps` of
    an end."""
    t = np.where(along <= eps, 0.0, along / length)
    return np.where(along >= length - eps, 1.0, t)


def _common_points(a: Frames, b: Frames) -> tuple[Floats, Floats]:
    """Compute the two points (K, 2) that the full curves share (see the top); NaN if none.

    Where they miss each other, both are the point of the common line nearest to R: the caller
    measures how near that is."""
    rounder = np.abs(b.curvature) >= np.abs(a.curvature)
    k_round = np.where(rounder, b.curvature, a.curvature)
    k_flat = np.where(rounder, a.curvature, b.curvature)
    pick = rounder[:, None]
    n_round, n_flat = np.where(pick, b.normal, a.normal), np.where(pick, a.normal, b.normal)
    origin = np.where(pick, b.start, a.start)
    w = np.where(pick, a.start, b.start) - origin
    ratio = k_flat / np.where(k_round == 0.0, 1.0, k_round)
    across = n_flat + k_flat[:, None] * w - ratio[:, None] * n_round
    with np.errstate(all="ignore"):
        height = 0.5 * k_flat * dot(w, w) + dot(n_flat, w)
        size = np.hypot(across[:, 0], across[:, 1])
        unit = across / size[:, None]
        foot = (height / size)[:, None] * unit
        direction = turn_left(unit)
        # On the line foot + τ direction:  kR τ² − 2 β τ + γ = 0.
        beta = dot(n_round, direction)
        gamma = k_round * dot(foot, foot) - 2.0 * dot(n_round, foot)
        root = beta**2 - k_round * gamma
        stable = beta + np.copysign(np.sqrt(np.maximum(root, 0.0)), beta)
        one = stable / k_round
        second_root = np.where((root > 0.0) | (k_round == 0.0), gamma / stable, one)
        one = np.where(k_round == 0.0, second_root, one)
        roots = np.stack([one, second_root])
    # NaN, because arithmetic with infinities would warn.
    roots = np.where(np.isfinite(roots), roots, np.nan)[:, :, None]
    first, second = origin + foot + roots * direction
    return first, second


def _if_apart(points: Floats, a: Frames, b: Frames, eps: float) -> Floats:
    """Return the points (K, 2), with NaN where the curves stay within `eps` of each other over all
    their length.

    There rounding alone would place a crossing; the ends of what they share are found as ends."""
    angle, bend = _angle_and_bend(points, a, b)
    shorter = np.minimum(a.length, b.length)
    is_indistinct = np.abs(angle) * shorter + 0.5 * bend * shorter**2 <= eps
    return np.where(is_indistinct[:, None], np.nan, points)


def _angle_and_bend(points: Floats, a: Frames, b: Frames) -> tuple[Floats, Floats]:
    """Return the sine of the angle between the curves at common points (K, 2), and the difference
    of their curvatures, 1/mm."""
    tangent_a = a.tangent_at(a.along(points) / a.length)
    tangent_b = b.tangent_at(b.along(points) / b.length)
    same_way = np.where(dot(tangent_a, tangent_b) < 0.0, -1.0, 1.0)
    return dot(turn_left(tangent_a), tangent_b), np.abs(a.curvature - same_way * b.curvature)


def _touching(crossings: Crossings, frames: Frames, eps: float) -> Bools:
    """Return the mask of meetings at an end, or where one curve goes beyond the other by `eps` at
    most.

    Two curves that meet at the angle θ, with curvatures that differ by k, part again after 2θ/k,
    and are θ²/(2k) apart at most until then."""
    angle, bend = _angle_and_bend(
        crossings.point, frames[crossings.row_a], frames[crossings.row_b]
    )
    return np.asarray(_at_vertex(crossings) | (angle**2 <= 2.0 * bend * eps))


# Where closed paths cross themselves: inside and outside are not clear there.
#
# Pairs of segments come from their boxes; where they meet, arcs are arcs. Within
# two segments a meeting is a crossing unless they only touch. At a vertex the path passes twice,
# along four directions: it crosses itself when the two of one passage part the two of the other.
# So a contour that touches itself, at a corner or along a run (a keyhole), does not cross itself.

PAIRS_AT_A_TIME = 1 << 16

MAX_CROSSINGS = 1000

MAX_PAIRS = 4_000_000

ALONG_RAD = 1e-6
"""Segments whose directions differ by less run along each other: that is touching, not
crossing."""


def self_crossings_of(lines: Polylines, layers: Sequence[str]) -> tuple[SelfCrossing, ...]:
    """Return the places where closed paths cross themselves, path by path, each place once;
    MAX_CROSSINGS is about the greatest number."""
    if not lines.closed.any():
        return ()
    segments = Segments.of(lines)
    segments = segments[lines.closed[segments.path]]
    frames = Frames.of(segments)
    places: dict[tuple[int, int, int], SelfCrossing] = {}
    for row_a, row_b in _pairs_of_one_path(segments):
        vertex_meetings, crosses = meetings(segments, row_a, row_b)
        crossing = np.where(
            _at_vertex(vertex_meetings), _pass_through(vertex_meetings, segments, frames), crosses
        )
        for row in np.flatnonzero(crossing).tolist():
            path = int(segments.path[vertex_meetings.row_a[row]])
            x, y = vertex_meetings.point[row].tolist()
            key = (path, round(x / _SAME_MM), round(y / _SAME_MM))
            places.setdefault(key, SelfCrossing((x, y), path, layers[path]))
        if len(places) > MAX_CROSSINGS:
            break
    return tuple(places[key] for key in sorted(places))


_SAME_MM = 4.0 * POSITION_EPS_MM


def _pairs_of_one_path(segments: Segments) -> Iterator[tuple[Ints, Ints]]:
    """Yield rows a < b of segments of one path whose boxes touch, in batches; successive lines are
    left out, as they cannot cross."""
    boxes = segment_boxes(segments)
    margin = 0.5 * POSITION_EPS_MM * np.array([-1.0, -1.0, 1.0, 1.0])
    every = np.ones(len(segments), dtype=np.bool_)
    one, other = touching_boxes(
        boxes + margin, segments.path, np.arange(len(segments)), every, max_pairs=MAX_PAIRS
    )
    counts = np.bincount(segments.path)[segments.path]
    in_a_row = (other - one == 1) | (other - one == counts[one] - 1)
    both_lines = ~segments.is_arc[one] & ~segments.is_arc[other]
    keep = ~(in_a_row & both_lines)
    one, other = one[keep], other[keep]
    for begin in range(0, len(one), PAIRS_AT_A_TIME):
        batch = slice(begin, begin + PAIRS_AT_A_TIME)
        yield one[batch], other[batch]


def _at_vertex(crossings: Crossings) -> Bools:
    ta, tb = crossings.ta, crossings.tb
    return np.asarray((ta == 0.0) | (ta == 1.0) | (tb == 0.0) | (tb == 1.0))


def _pass_through(crossings: Crossings, segments: Segments, frames: Frames) -> Bools:
    """Return the mask of meetings at a vertex at which the path crosses itself: the directions of
    passage a separate those of b.

    A passage has two directions: back to where the path comes from, and on to where it goes."""
    back_a, on_a = _passage(crossings.row_a, crossings.ta, segments, frames)
    back_b, on_b = _passage(crossings.row_b, crossings.tb, segments, frames)
    same_passage = _one_passage(crossings, segments)
    turn = 2.0 * np.pi
    wedge = np.mod(on_a - back_a, turn)
    one, other = np.mod(back_b - back_a, turn), np.mod(on_b - back_a, turn)
    clear = np.ones(len(same_passage), dtype=np.bool_)
    for side in (one, other):
        for edge in (0.0, wedge, turn):
            clear &= np.abs(side - edge) > ALONG_RAD
    return np.asarray(clear & ~same_passage & ((one < wedge) != (other < wedge)))


def _passage(row: Ints, t: Floats, segments: Segments, frames: Frames) -> tuple[Floats, Floats]:
    """Return the directions (J,), rad, back and onward of the path at the fraction `t` of these
    segments."""
    before, after = _neighbours(segments)
    arriving_row = np.where(t == 0.0, before[row], row)
    goes = np.where(t == 1.0, after[row], row)
    at_came = frames[arriving_row].tangent_at(np.where(t == 0.0, 1.0, t))
    at_goes = frames[goes].tangent_at(np.where(t == 1.0, 0.0, t))
    backward = np.arctan2(-at_came[:, 1], -at_came[:, 0])
    return backward, np.arctan2(at_goes[:, 1], at_goes[:, 0])


def _neighbours(segments: Segments) -> tuple[Ints, Ints]:
    """Return the rows of the segments before and after each one in its closed path."""
    rows = np.arange(len(segments))
    first = np.searchsorted(segments.path, segments.path)
    last = np.searchsorted(segments.path, segments.path, side="right") - 1
    before = np.where(rows == first, last, rows - 1)
    after = np.where(rows == last, first, rows + 1)
    return before, after


def _one_passage(pairs: Crossings, segments: Segments) -> Bools:
    """Return the mask of pairs that are the vertex between a segment and the next one of its
    path."""
    _, after = _neighbours(segments)
    a_first = (after[pairs.row_a] == pairs.row_b) & (pairs.ta == 1.0) & (pairs.tb == 0.0)
    b_first = (after[pairs.row_b] == pairs.row_a) & (pairs.tb == 1.0) & (pairs.ta == 0.0)
    return np.asarray(a_first | b_first)
