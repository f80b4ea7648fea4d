"""Writing arcs of grbl and linuxcnc: every arc re-checked after its numbers were rounded.

A *unit* is the last decimal that is written. Start, end and centre lie on whole units; what is
sent is the end and the offset centre − start. For each arc, by its rounded numbers:

    sagitta below half a unit           one line does as well
    the controller accepts it           unchanged
    otherwise                           1. re-centred: a centre close by that it accepts
                                        2. split into two arcs at its middle (each re-centred)
                                        3. lines within a unit of the arc

"Accepts" also means that the rounded arc turns as the wanted one does: an arc of a few
units may come out as nearly a full turn, and a short one of a large radius as a full circle."""

from __future__ import annotations

import math
from typing import Final

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Bools, Codes, Floats, Ints
from camtool.records import replace
from camtool.toolpath.moves import Kind, Toolpath

from .dialect import GcodeDialect
from .format import units_of

FLAT_UNITS: Final = 0.5
"""An arc with less sagitta (in units) is a line."""

LINE_SAGITTA_UNITS: Final = 1.0
"""Lines that replace an arc deviate from it by no more (in units), their rounding not counted."""

RECENTRE_UNITS: Final = 1.5
"""A centre may move by this many units, or by the controller's tolerance if that is more."""

_AROUND: Final = np.array([(i, j) for i in range(-2, 3) for j in range(-2, 3)])

RULE_MARGIN: Final = 0.9
"""Arcs are kept within this part of the controller's tolerance: it may compute in 32 bits."""


class ReplacementRow(Struct, frozen=True):
    """Row that replaces an arc or a part of it: its kind, end (x, y) and offset of the centre (i,
    j), units. `share`: the part of a helix's rise that is made at its end."""

    kind: Kind
    end: tuple[int, int]
    offset: tuple[int, int] = (0, 0)
    share: float = 1.0


class ArcCounts(Struct):
    """Counts of changed arcs, by kind of change."""

    flat: int = 0
    dropped: int = 0
    recentred: int = 0
    split: int = 0
    lines: int = 0
    first: int = -1
    """Row of the first that was re-centred, split or written as lines."""


class RowArcs(Struct, frozen=True, eq=False):
    """Ends (N, 3) and offsets of centres (N, 2) of all rows, in units; `pieces`: the rows that
    replace a row. Without arcs `offset` is a single row that is seen as N rows."""

    end: Ints
    offset: Ints
    kind: Codes
    pieces: dict[int, list[ReplacementRow]]
    counts: ArcCounts = field(default_factory=ArcCounts)


def arcs_of(toolpath: Toolpath, dialect: GcodeDialect) -> RowArcs:
    """Return the toolpath's rows in units, with arcs changed until this controller accepts
    them."""
    unit = 10.0**-dialect.decimals
    end = units_of(toolpath.end, dialect.decimals)
    kind = np.array(toolpath.kind)
    rows = np.flatnonzero(toolpath.is_arc)
    if not len(rows):
        return RowArcs(end, np.broadcast_to(np.int64(0), (len(toolpath), 2)), kind, {})
    offset = np.zeros((len(toolpath), 2), dtype=np.int64)
    arcs = RowArcs(end, offset, kind, {})
    sweep = toolpath.sweeps()[rows]
    arm = toolpath.starts[rows, :2] - toolpath.centre[rows]
    radius = np.hypot(arm[:, 0], arm[:, 1])
    flat = sagitta_of(radius, sweep) < FLAT_UNITS * unit
    huge = ~flat & (radius > dialect.arc_most_radius_mm)
    kind[rows[flat]] = Kind.LINE
    arcs.counts.flat = int(flat.sum())
    written = ~flat & ~huge
    centre = np.zeros((len(rows), 2), dtype=np.int64)
    centre[written] = units_of(toolpath.centre[rows[written]], dialect.decimals)
    begin, stop = end[rows - 1, :2], end[rows, :2]
    begin[rows == 0] = units_of(toolpath.start[:2], dialect.decimals)
    offset[rows[written]] = (centre - begin)[written]
    holds = arcs_accepted(np.abs(sweep), (begin, stop, centre), kind[rows], dialect)
    halves = dialect.full_circles == "halves"
    is_full = (begin == stop).all(axis=1) & written & holds
    special = huge | (written & ~holds) | (is_full & halves)
    for index in np.flatnonzero(special).tolist():
        _repair(arcs, toolpath, int(rows[index]), float(sweep[index]), dialect)
    return arcs


def arcs_accepted(
    sweep_rad: Floats, points: tuple[Ints, Ints, Ints], kind: Codes, dialect: GcodeDialect
) -> Bools:
    """Return a mask (K,), true for arcs that the controller accepts and executes in the wanted
    direction and number of turns.

    `sweep_rad` (K,) > 0 as wanted; `points`: start, end, centre (K, 2) in units."""
    unit = 10.0**-dialect.decimals
    start, end, centre = points
    start_arm, end_arm = (start - centre).astype(np.float64), (end - centre).astype(np.float64)
    r1, r2 = np.hypot(*start_arm.T) * unit, np.hypot(*end_arm.T) * unit
    gap = np.abs(r1 - r2) / RULE_MARGIN
    wide = (gap > dialect.arc_difference_mm) & (
        gap > dialect.arc_difference_part * np.minimum(r1, r2)
    )
    is_small = np.minimum(r1, r2) <= dialect.arc_least_radius_mm / RULE_MARGIN
    turn = turns_of(start_arm, end_arm, kind == Kind.ARC_CW)
    limit = dialect.arc_full_turn_rad / RULE_MARGIN
    same_ends = (start == end).all(axis=1)
    vague = ~same_ends & ((turn <= limit) | (turn >= 2.0 * math.pi - limit))
    agrees = np.abs(turn - sweep_rad) < math.pi
    return np.asarray(
        ~wide & (gap <= dialect.arc_most_difference_mm) & ~is_small & ~vague & agrees & (r1 > 0.0)
    )


def sagitta_of(radius: Floats, sweep_rad: Floats) -> Floats:
    """Return the heights (K,) of arcs above their chords; the radius where an arc turns by π or
    more."""
    half = np.minimum(np.abs(sweep_rad), math.pi) / 2.0
    # 1 − cos a = 2 sin²(a/2), which keeps its digits where a is small.
    return np.asarray(radius * 2.0 * np.sin(half / 2.0) ** 2)


def turns_of(start_arm: Floats, end_arm: Floats, clockwise: Bools) -> Floats:
    """Return the angles (K,) in (0, 2π] that arcs turn from the vectors `start_arm` to the vectors
    `end_arm`, both (K, 2) and from the centre."""
    cross = start_arm[:, 0] * end_arm[:, 1] - start_arm[:, 1] * end_arm[:, 0]
    sign = np.where(clockwise, -1.0, 1.0)
    angle = np.mod(sign * np.arctan2(cross, (start_arm * end_arm).sum(axis=1)), 2.0 * math.pi)
    return np.where(angle == 0.0, 2.0 * math.pi, angle)


def _repair(
    arcs: RowArcs, toolpath: Toolpath, row: int, sweep: float, dialect: GcodeDialect
) -> None:
    """Replace one arc by pieces: re-centred, split, or lines."""
    begin = arcs.end[row - 1, :2] if row else units_of(toolpath.start[:2], dialect.decimals)
    stop, kind = arcs.end[row, :2], Kind(int(toolpath.kind[row]))
    counts = arcs.counts
    arc = _Wanted(toolpath.starts[row, :2], toolpath.centre[row], toolpath.end[row, :2], sweep)
    if (begin == stop).all() and abs(sweep) < math.pi:
        rises = toolpath.end[row, 2] != toolpath.starts[row, 2]
        counts.dropped += not rises
        arcs.pieces[row] = [ReplacementRow(Kind.LINE, _pair(stop))] if rises else []
        return
    is_circle = bool((arc.start == arc.end).all())
    huge = math.dist(arc.start, arc.centre) > dialect.arc_most_radius_mm
    one = None if huge or is_circle else _recentre(arc, (begin, stop), kind, dialect)
    halves = None if huge or one else _halves(arc, (begin, stop), kind, dialect)
    if is_circle and halves:
        arcs.pieces[row] = halves
        return
    if counts.first < 0:
        counts.first = row
    if one:
        counts.recentred += 1
        arcs.pieces[row] = [one]
    elif halves:
        counts.split += 1
        arcs.pieces[row] = halves
    else:
        counts.lines += 1
        arcs.pieces[row] = _chords(arc, begin, stop, dialect)


class _Wanted(Struct, frozen=True, eq=False):
    """An arc in mm ((2,) each) with its signed sweep; radius and angle run evenly from start to
    end, so that ends which are not quite equally far from the centre are both met."""

    start: Floats
    centre: Floats
    end: Floats
    sweep: float

    def at(self, parts: Floats) -> Floats:
        """Return (k, 2) points of the arc, mm, at these fractions (0 to 1) of its sweep."""
        start_arm = self.start - self.centre
        r1, r2 = math.hypot(*start_arm), math.dist(self.end, self.centre)
        radius = r1 + (r2 - r1) * parts
        angle = math.atan2(start_arm[1], start_arm[0]) + self.sweep * parts
        return np.asarray(
            self.centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
        )


def _recentre(
    arc: _Wanted, ends: tuple[Ints, Ints], kind: Kind, dialect: GcodeDialect
) -> ReplacementRow | None:
    """Return the arc about the nearest centre that the controller accepts; None when there is none
    within reach.

    The centre from which both rounded ends are equally far and which is nearest to c is c + ((m −
    c)·t) t, with m the middle of the chord and t its direction. It is hardly ever a whole number
    of units, so those around it are tried, the nearest to c first."""
    begin, stop = ends
    chord = (stop - begin).astype(np.float64)
    length = math.hypot(*chord)
    if length == 0.0:
        return None
    unit = 10.0**-dialect.decimals
    centre, along = arc.centre / unit, chord / length
    shift = float(((begin + stop) / 2.0 - centre) @ along)
    candidates = np.rint(centre + shift * along).astype(np.int64) + _AROUND
    distances = np.hypot(*(candidates - centre).T)
    candidates = candidates[np.argsort(distances, kind="stable")]
    max_distance = max(dialect.arc_difference_mm / unit, RECENTRE_UNITS)
    candidates = candidates[np.sort(distances, kind="stable") <= max_distance]
    ones = np.ones((len(candidates), 1), dtype=np.int64)
    points = (begin * ones, stop * ones, candidates)
    sweeps = np.full(len(candidates), abs(arc.sweep))
    holds = arcs_accepted(sweeps, points, np.full(len(candidates), int(kind)), dialect)
    if not holds.any():
        return None
    return ReplacementRow(kind, _pair(stop), _pair(candidates[int(np.argmax(holds))] - begin))


def _halves(
    arc: _Wanted, ends: tuple[Ints, Ints], kind: Kind, dialect: GcodeDialect
) -> list[ReplacementRow] | None:
    """Return the arc as two arcs that meet at its middle; None when the controller would refuse
    one of them."""
    begin, stop = ends
    mid_mm = arc.at(np.array([0.5]))[0]
    mid = units_of(mid_mm, dialect.decimals)
    half = arc.sweep / 2.0
    first = _Wanted(arc.start, arc.centre, mid_mm, half)
    second = _Wanted(mid_mm, arc.centre, arc.end, half)
    pieces = [
        _keep_centre(first, (begin, mid), kind, dialect)
        or _recentre(first, (begin, mid), kind, dialect),
        _keep_centre(second, (mid, stop), kind, dialect)
        or _recentre(second, (mid, stop), kind, dialect),
    ]
    if pieces[0] is None or pieces[1] is None:
        return None
    return [replace(pieces[0], share=0.5), pieces[1]]


def _keep_centre(
    arc: _Wanted, ends: tuple[Ints, Ints], kind: Kind, dialect: GcodeDialect
) -> ReplacementRow | None:
    """Return the arc about its own rounded centre; None when the controller would refuse it."""
    begin, stop = ends
    centre = units_of(arc.centre, dialect.decimals)
    points = (begin[None, :], stop[None, :], centre[None, :])
    sweep = np.array([abs(arc.sweep)])
    if not arcs_accepted(sweep, points, np.array([kind]), dialect)[0]:
        return None
    return ReplacementRow(kind, _pair(stop), _pair(centre - begin))


def _chords(arc: _Wanted, begin: Ints, stop: Ints, dialect: GcodeDialect) -> list[ReplacementRow]:
    """Return the fewest equal chords within a unit of the arc: a chord over the angle a deviates
    by R (1 − cos(a/2)) = 2 R sin²(a/4)."""
    radius = math.dist(arc.start, arc.centre)
    unit = 10.0**-dialect.decimals
    ratio = min(0.5, LINE_SAGITTA_UNITS * unit / (2.0 * radius)) if radius > 0.0 else 0.5
    count = max(1, math.ceil(abs(arc.sweep) / (4.0 * math.asin(math.sqrt(ratio)))))
    shares = np.arange(1, count) / count
    inner = units_of(arc.at(shares), dialect.decimals)
    pieces, position = [], begin
    for point, share in zip(inner, shares.tolist(), strict=True):
        if (point != position).any():
            pieces.append(ReplacementRow(Kind.LINE, _pair(point), share=share))
            position = point
    # This line has no length if the last chord was too small, except the rest of a helix's rise.
    return [*pieces, ReplacementRow(Kind.LINE, _pair(stop))]


def _pair(point: Ints) -> tuple[int, int]:
    return int(point[0]), int(point[1])
