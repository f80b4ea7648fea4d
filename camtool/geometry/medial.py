"""The medial axis of a region with the radii of its discs, exact with lines and arcs.

Each point of the boundary has one largest disc that touches it from within. Its middle lies on
the medial axis, and runs along it without a jump when the point runs along the boundary: round a
region the whole axis is passed, each of its branches from both sides. So nothing needs to be
approximated or pruned: the axis is traced by the boundary itself.

    boundary ──samples──▶ discs ──where the partner changes: bisection──▶ intervals
             ──halved until chords are within the tolerance──▶ MedialTrace

An *interval* is the part of an element whose discs touch one and the same partner. Each disc is
seen from both of the elements that it touches; so an interval of one that falls between its
samples is found from the samples of the other."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import GeometryError
from camtool.geometry.measure import segment_boxes, segment_lengths
from camtool.geometry.polylines import Polylines, Segments
from camtool.kernels.discs import AX, AY, BLOCK, CONVEX, REFLEX, SMOOTH, SMOOTH_RAD, largest_discs

FIRST_SAMPLES = 9
"""Number of places on each element at which discs are computed first."""

HALVINGS = 32
"""Halvings of the gap in which the partner changes: to 1e-10 of an element or less."""

STILL_MM = 1e-6
"""Where the discs at both ends and in the middle of a gap are nearer than this, the gap is not
searched: at the common centre of several arcs any of them may seem to be the partner."""

MAX_ROUNDS = 200
"""Samples are halved, and completed from the other side, in at most this many rounds."""


class MedialTrace(Struct, frozen=True, eq=False):
    """Discs (N rows) along the boundary, by element and place on it: `element` (N,), `t` (N,) in
    0 … 1, the middles `x`, `y` and radii `rho` mm, the `partner` element that each touches
    besides and the place `u` there. The curve between three neighbouring rows of one element and
    one partner leaves their chords by a part of the tolerance only (x, y and rho together)."""

    element: Ints
    t: Floats
    x: Floats
    y: Floats
    rho: Floats
    partner: Ints
    u: Floats

    def __len__(self) -> int:
        return len(self.t)

    def rows(self, selection: Ints | Bools) -> MedialTrace:
        """Return the rows that a mask or indices select."""
        return MedialTrace(*(column[selection] for column in astuple(self)))

    @property
    def discs(self) -> Floats:
        """Discs (N, 3): x, y and radius, mm."""
        return np.column_stack([self.x, self.y, self.rho])


def concatenated(traces: list[MedialTrace]) -> MedialTrace:
    """Return one trace with the rows of all traces in turn."""
    return MedialTrace(*map(np.concatenate, zip(*map(astuple, traces), strict=True)))


def discs_at(
    boundary: Boundary, element: Ints, t: Floats, guess: Ints | None = None
) -> MedialTrace:
    """Return the largest disc within the region that touches each of these places on the boundary.

    `guess` (N, 2) are elements that the disc probably touches as well; a good guess saves time.
    GeometryError where nothing ends a disc: paths that lie on each other enclose no region there.
    """
    result, partner = np.empty((len(t), 4)), np.empty(len(t), dtype=np.int64)
    if guess is None:
        guess = np.column_stack([element, element])
    columns = (boundary.table, boundary.links, boundary.boxes)
    largest_discs(columns, element, t, guess, result, partner)
    endless = ~np.isfinite(result).all(axis=1)
    if endless.any():
        x, y = boundary.table[element[np.argmax(endless)], :2].tolist()
        raise GeometryError(
            "paths lie on each other, so that nothing lies between them",
            where=f"X {x:.4f} Y {y:.4f}",
            mend="take one of them out",
        )
    return MedialTrace(element, t, result[:, 0], result[:, 1], result[:, 2], partner, result[:, 3])


def medial_trace(region: Polylines, tolerance_mm: float) -> tuple[Boundary, MedialTrace]:
    """Compute the boundary elements and the medial trace of a region: closed paths, outer ones
    CCW, holes CW, that do not cross."""
    boundary = Boundary.of(region)
    element = np.repeat(np.arange(len(boundary)), FIRST_SAMPLES)
    t = np.tile(np.linspace(0.0, 1.0, FIRST_SAMPLES), len(boundary))
    trace = discs_at(boundary, element, t)
    open_gaps = _gaps(trace)
    for _ in range(MAX_ROUNDS):
        trace, open_gaps = _refine_gaps(boundary, trace, open_gaps, tolerance_mm)
        if not open_gaps.any():
            partner_discs = _seen_from_partners(boundary, trace)
            if len(partner_discs) == 0:
                break
            trace, open_gaps = _insert_rows(
                trace, partner_discs, np.ones(len(partner_discs), dtype=np.bool_)
            )
    return boundary, trace


def _gaps(trace: MedialTrace) -> Bools:
    """Return the mask (N,) of the rows whose next row belongs to the same element."""
    return np.append(trace.element[1:] == trace.element[:-1], False)


def _insert_rows(
    trace: MedialTrace, new_rows: MedialTrace, is_open: Bools
) -> tuple[MedialTrace, Bools]:
    """Return the trace with more rows inserted, and the mask of its gaps still to be halved.

    These are the gaps beside those new rows for which `is_open` is true, unless too narrow for
    another number between."""
    merged = concatenated([trace, new_rows])
    order = np.lexsort((merged.t, merged.element))
    merged = merged.rows(order)
    opens = np.append(np.zeros(len(trace), dtype=np.bool_), is_open)[order]
    is_beside = opens | np.append(opens[1:], False)
    width = np.append(np.diff(merged.t), 0.0)
    return merged, is_beside & _gaps(merged) & (width > np.finfo(np.float64).eps)


def _refine_gaps(
    boundary: Boundary, trace: MedialTrace, open_gaps: Bools, tolerance_mm: float
) -> tuple[MedialTrace, Bools]:
    """Halve all open gaps once, or cut them where the partner changes; return the trace and the
    mask of the gaps that stay open.

    A halved gap stays open while the curve deviates from its chord by more than the tolerance."""
    rows = np.flatnonzero(open_gaps)
    middle = 0.5 * (trace.t[rows] + trace.t[rows + 1])
    halves = discs_at(boundary, trace.element[rows], middle, _partners(trace, rows))
    begin, end = trace.discs[rows], trace.discs[rows + 1]
    is_still = (
        np.maximum(_disc_distance(begin, end), _disc_distance(begin, halves.discs)) <= STILL_MM
    )
    changes = ~is_still & (trace.partner[rows] != trace.partner[rows + 1])
    bent = off_chord(halves.discs, begin, end) > tolerance_mm
    bent |= halves.partner != trace.partner[rows]
    inner = ~changes & (middle > trace.t[rows]) & (middle < trace.t[rows + 1])
    low, high = _events(boundary, trace, rows[changes])
    new_rows = concatenated([halves.rows(inner), low, high])
    is_open = np.append((bent & ~is_still)[inner], np.ones(2 * len(low), dtype=np.bool_))
    return _insert_rows(trace, new_rows, is_open)


def _disc_distance(discs: Floats, other_discs: Floats) -> Floats:
    """Return the distance (N,) between discs (N, 3): that of their middles plus the difference of
    their radii."""
    differences = discs - other_discs
    return np.asarray(np.hypot(differences[:, 0], differences[:, 1]) + np.abs(differences[:, 2]))


def _events(boundary: Boundary, trace: MedialTrace, rows: Ints) -> tuple[MedialTrace, MedialTrace]:
    """Return, by bisection, the last disc with the partner of row `rows`, and the first disc with
    another one, in the gap after each row."""
    element, partner, guess = trace.element[rows], trace.partner[rows], _partners(trace, rows)
    low, high = trace.t[rows].copy(), trace.t[rows + 1].copy()
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        same_partner = discs_at(boundary, element, middle, guess).partner == partner
        low, high = np.where(same_partner, middle, low), np.where(same_partner, high, middle)
    return discs_at(boundary, element, low, guess), discs_at(boundary, element, high, guess)


def _partners(trace: MedialTrace, rows: Ints) -> Ints:
    """Return the partners (N, 2) at both ends of the gap after each of these rows."""
    return np.column_stack([trace.partner[rows], trace.partner[rows + 1]])


def off_chord(points: Floats, begin: Floats, end: Floats) -> Floats:
    """Return the distance (N,) of points (N, 3) from the chords between `begin` and `end` (N, 3):
    in the plane plus in radius."""
    chord, arm = end - begin, points - begin
    square = (chord**2).sum(axis=1)
    part = np.clip((arm * chord).sum(axis=1) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    return _disc_distance(arm, part[:, None] * chord)


def _seen_from_partners(boundary: Boundary, trace: MedialTrace) -> MedialTrace:
    """Return the discs of the trace as seen from their partners, where the partner's own rows near
    that place do not show the element.

    They mark intervals that fell between the samples."""
    is_pair = trace.partner != trace.element
    element, t, partner = (trace.partner[is_pair], trace.u[is_pair], trace.element[is_pair])
    # Numbers that sort as element and place do; places lie in 0 … 1.
    key, wanted_keys = 2.0 * trace.element + trace.t, 2.0 * element + t
    after = np.clip(np.searchsorted(key, wanted_keys), 1, len(trace) - 1)
    hidden = (trace.partner[after] != partner) & (trace.partner[after - 1] != partner)
    is_new = (key[after] != wanted_keys) & (key[after - 1] != wanted_keys)
    element, t, partner = (column[hidden & is_new] for column in (element, t, partner))
    discs = discs_at(boundary, element, t, np.column_stack([partner, partner]))
    return discs.rows(discs.partner == partner)


# The boundary of a region as elements that discs in it can touch: lines, arcs, reflex corners.

ROUND_RAD = 1e-9
"""A reflex corner that turns by less is smooth: the tangents are rounded."""


class Boundary(Struct, frozen=True, eq=False):
    """E elements in the order of the paths, region on their left, as `kernels.discs` wants them:
    `table` (E, 10), `links` (E, 3), `boxes` (B, 4)."""

    table: Floats
    links: Ints
    boxes: Floats

    @classmethod
    def of(cls, region: Polylines) -> Boundary:
        """Return the elements of closed paths, outer ones CCW and holes CW: segments, and reflex
        corners of their own."""
        segments = Segments.of(region)
        leave, arrive = _tangents(segments)
        before, following = _neighbours(segments.path)
        turn = _turns(arrive[before], leave)
        corner = turn < -ROUND_RAD
        joint = np.where(corner, REFLEX, np.where(turn > SMOOTH_RAD, CONVEX, SMOOTH))
        place = np.arange(len(segments)) + np.cumsum(corner)
        fans = place[corner] - 1
        count = len(segments) + len(fans)
        table, links = np.zeros((count, 10)), np.zeros((count, 3), dtype=np.int64)
        table[place] = np.column_stack(
            [
                segments.start,
                leave,
                segment_lengths(segments),
                segments.sweep,
                segments.end,
                arrive,
            ]
        )
        tangent, end = arrive[before][corner], segments.start[corner]
        zeros = np.zeros(len(fans))
        table[fans] = np.column_stack([end, tangent, zeros, turn[corner], end, leave[corner]])
        links[place] = np.column_stack(
            [place[before], place[following] - corner[following], joint]
        )
        links[fans] = np.column_stack(
            [place[before][corner], place[corner], np.full(len(fans), REFLEX)]
        )
        links[place[corner], 0] = fans
        return cls(table, links, _blocks(table, segment_boxes(segments), place))

    def __len__(self) -> int:
        return len(self.table)


def _tangents(segments: Segments) -> tuple[Floats, Floats]:
    """Return the unit tangents (K, 2) at the start and at the end: the chord turned by ∓
    sweep/2."""
    chord = segments.end - segments.start
    unit = chord / np.hypot(chord[:, 0], chord[:, 1])[:, None]
    cosine, sine = np.cos(0.5 * segments.sweep)[:, None], np.sin(0.5 * segments.sweep)[:, None]
    normal = np.column_stack([-unit[:, 1], unit[:, 0]])
    return cosine * unit - sine * normal, cosine * unit + sine * normal


def _turns(arrive: Floats, leave: Floats) -> Floats:
    """Return the angle (K,) by which the path turns at each start, left positive, −π … π rad."""
    across = arrive[:, 0] * leave[:, 1] - arrive[:, 1] * leave[:, 0]
    return np.asarray(np.arctan2(across, (arrive * leave).sum(axis=1)))


def _neighbours(path: Ints) -> tuple[Ints, Ints]:
    """Return the rows before and after each row on its closed path."""
    rows = np.arange(len(path))
    first = np.searchsorted(path, path, side="left")
    last = np.searchsorted(path, path, side="right") - 1
    return np.where(rows == first, last, rows - 1), np.where(rows == last, first, rows + 1)


def _blocks(table: Floats, segment_box: Floats, place: Ints) -> Floats:
    """Return a box (B, 4) around each block of BLOCK successive elements."""
    corners = table[:, [AX, AY]]
    boxes = np.concatenate([corners, corners], axis=1)
    boxes[place] = segment_box
    starts = np.arange(0, len(table), BLOCK)
    low = np.minimum.reduceat(boxes[:, :2], starts)
    high = np.maximum.reduceat(boxes[:, 2:], starts)
    return np.ascontiguousarray(np.concatenate([low, high], axis=1))
