"""Conformance: compare the moves of a program, as programmed, with those that its job asks for.

    drawing, job, flags ─plan, write, read─▶ written     the moves that camtool would program
    program ─read─▶ decoded                              the moves that the program holds

A move that is in both with the same numbers conforms. Every other decoded move must lie where
`written` or the wanted toolpath cuts, and every other written move where `decoded` cuts, within
the resolution of the dialect. What the dialect makes of the wanted path (chords, ends on its grid,
stairs) is in `written` already, so the tolerance does not allow for it. The order of contours and
their starts are free. Where moves of both lie on each other, their direction, feed, spindle, tool
and coolant must be the same.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding, Severity
from camtool.geometry.boxes import near_points
from camtool.geometry.measure import point_at
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.toolpath.moves import STOCK_TOP_MM, Kind, Toolpath
from camtool.verification.coverage import (
    Limits,
    NearPairs,
    PlaceSentences,
    Side,
    UncoveredContour,
    at_point,
    block_name,
    compare_holes,
    encloses_area,
    first_items,
    near_pairs,
    reversal_findings,
    reversed_samples,
    uncovered_contours,
    uncovered_findings,
)
from camtool.verification.cuts import is_flat
from camtool.verification.findings import (
    CLEARANCE_LOW,
    CLEARANCE_LOW_OWN,
    CONTOUR_MISSING_ELSEWHERE,
    CONTOUR_MISSING_NOTHING_CUT,
    CONTOUR_MISSING_OTHER_DEPTH,
    END_DIFFERS,
    END_DIFFERS_NO_END,
    END_DIFFERS_PLACE,
    EXTRA_CUT_AGAIN,
    EXTRA_CUT_ELSEWHERE,
    EXTRA_CUT_NOTHING_ASKED,
    EXTRA_CUT_OTHER_DEPTH,
    EXTRA_CUT_PLUNGE,
    FEED_DIFFERS,
    FEED_DIFFERS_IN_AIR,
    FEED_DIFFERS_OWN,
    MOVES_CHANGED,
    SETTING_DIFFERS_COOLANT,
    SETTING_DIFFERS_COOLANT_UNASKED,
    SETTING_DIFFERS_CORNERS,
    SETTING_DIFFERS_DWELL,
    SETTING_DIFFERS_NO_CORNERS,
    SETTING_DIFFERS_TOOL,
    SETTING_DIFFERS_TOOL_UNASKED,
    SETTING_DIFFERS_WAIT,
    SPINDLE_DIFFERS,
    SPINDLE_DIFFERS_UNASKED,
)
from camtool.verification.matching import nearest_at_height
from camtool.verification.nearest import MoveIndex


class Conformance(Struct, frozen=True, eq=False):
    """The result: findings on where is cut (`place`) and on feeds, spindle and the like
    (`settings`); the number of cutting `moves`, how many of them are `alike` in `written`, and the
    largest distance `off_mm` of the others from what was asked (0 where there are none)."""

    place: tuple[Finding, ...] = ()
    settings: tuple[Finding, ...] = ()
    moves: int = 0
    alike: int = 0
    off_mm: float = 0.0


def conformance_of(
    decoded: Toolpath, asked: ProgramRequest, *, flat_cuts: bool, sample_mm: float
) -> Conformance:
    """Compare the moves of a program with those that the job asks for."""
    mine = Side.of(decoded.first(decoded.executed_rows), flat_cuts=flat_cuts)
    count = len(mine.cuts.rows)
    if _equal_toolpaths(decoded, asked.written):
        return Conformance(moves=count, alike=count)
    other = Side.of(asked.written.first(asked.written.executed_rows), flat_cuts=flat_cuts)
    wanted = Side.of(asked.wanted.first(asked.wanted.executed_rows), flat_cuts=flat_cuts)
    alike = MatchingMoves.of(mine.toolpath, other.toolpath)
    place = compare_places(mine, other, wanted, alike, asked, sample_mm)
    settings = compare_settings(mine, other, alike, place.pairs, asked)
    return Conformance(
        place=place.findings,
        settings=settings,
        moves=count,
        alike=int((alike.in_written & mine.cuts.is_cut).sum()),
        off_mm=place.off_mm,
    )


def _equal_toolpaths(one: Toolpath, other: Toolpath) -> bool:
    """True if two toolpaths are equal, row for row."""
    names = ("kind", "end", "centre", "feed", "value", "start", "mode")
    return one.modes == other.modes and all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in names
    )


# What a job asks of a program, and the sides that are compared: decoded, written and wanted.

LIMIT_UNITS = 1.5
"""Moves may be this many units of the dialect apart: rounding moves ends by up to 0.71 of a unit,
and the centres of arcs as well."""


class ProgramRequest(Struct, frozen=True, eq=False):
    """The moves, feeds and heights that a job asks of its program.

    `written`: the moves of the program that camtool would write, as its dialect decodes them;
    `wanted`: the moves from which that is written. `unit_mm`, `unit_z_mm`: the resolution of the
    dialect in XY and in Z. `feed_named` (M,): the written rows whose feed the job names; feeds are
    equal within half of `feed_unit_mm_min`. `safe_z_mm`: the height of rapids; `safe_z_named`:
    the job names it.
    """

    written: Toolpath
    wanted: Toolpath
    unit_mm: float
    unit_z_mm: float
    feed_named: Bools
    feed_unit_mm_min: float
    safe_z_mm: float
    safe_z_named: bool

    @property
    def limits_mm(self) -> tuple[float, float]:
        """The tolerance in XY and in height, mm."""
        return LIMIT_UNITS * self.unit_mm, LIMIT_UNITS * self.unit_z_mm


class MatchingMoves(Struct, frozen=True, eq=False):
    """A number (N,) for each move of two sides, equal for moves of the same kind, start, end and
    centre."""

    decoded: Ints
    written: Ints

    @classmethod
    def of(cls, decoded: Toolpath, written: Toolpath) -> MatchingMoves:
        """Number the moves of both sides; points are the same within rounding
        (POSITION_EPS_MM)."""
        both = np.concatenate([_numbers(decoded), _numbers(written)])
        number = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
        return cls(number[: len(decoded)], number[len(decoded) :])

    @property
    def in_written(self) -> Bools:
        """(N,) true for decoded moves that are in `written`."""
        return np.isin(self.decoded, self.written)

    @property
    def in_decoded(self) -> Bools:
        """(M,) true for written moves that are in `decoded`."""
        return np.isin(self.written, self.decoded)


def _numbers(toolpath: Toolpath) -> Ints:
    """Return (N, 9) kind and coordinates of each row as whole numbers, in units of
    POSITION_EPS_MM."""
    centre = np.where(toolpath.is_arc[:, None], toolpath.centre, 0.0)
    places = np.concatenate([toolpath.starts, toolpath.end, centre], axis=1)
    whole = np.rint(places / POSITION_EPS_MM).astype(np.int64)
    return np.concatenate([toolpath.kind[:, None], whole], axis=1)


# Where a program cuts, against where it was asked to cut, at the resolution of its dialect.
#
# Moves that are in both sides are skipped; all others are sampled. A sample of the program must
# lie near a written or a wanted move at its height. For a sample of the written program, a decoded
# move must lie near it or near the wanted move from which it was written. Directions are compared
# wherever moves of both sides lie on each other.


class PlaceComparison(Struct, frozen=True, eq=False):
    """Findings; the largest distance of a cut from what was asked, mm; `pairs` (P, 2): decoded
    rows that are not in `written`, each with a written row on which it lies, in its direction."""

    findings: tuple[Finding, ...]
    off_mm: float
    pairs: Ints


def compare_places(
    mine: Side,
    other: Side,
    wanted: Side,
    alike: MatchingMoves,
    asked: ProgramRequest,
    sample_mm: float,
) -> PlaceComparison:
    """Compare `mine`, the decoded side, with `other`, the written side, and the reverse."""
    limits = asked.limits_mm
    holes = compare_holes(mine, other, limits)
    there = near_pairs(mine.cuts, ~alike.in_written, other.moves, limits, sample_mm)
    back = near_pairs(other.cuts, ~alike.in_decoded, mine.moves, limits, sample_mm)
    _near_wanted(there, wanted.moves, limits)
    _written_from_cut(back, wanted.moves, mine.moves, limits)
    trips = encloses_area(other.cuts, limits[0])
    written = other.moves.contour_of(there.move)
    turns = reversed_samples(there, trips[written], limits)
    written = other.moves.contour_of(back.samples.segment[back.point])
    turns_back = reversed_samples(back, trips[written], limits)
    findings = (
        *_missing_findings(back, holes.undrilled, limits),
        *_extra_findings(there, holes.drilled, limits),
        *holes.findings,
        *_plunge_findings(mine, (other, wanted), alike, limits),
        *_repeated_cuts(mine, other, alike, limits),
        *(reversal_findings(there, turns) if len(turns) else reversal_findings(back, turns_back)),
    )
    findings = findings or tuple(_changed_ends(mine.toolpath, other.toolpath))
    return PlaceComparison(findings, max(there.off_mm, back.off_mm), there.rows_along())


def _changed_ends(decoded: Toolpath, written: Toolpath) -> Iterator[Finding]:
    """Yield MOVES_CHANGED for a program with the same moves as written, some of which end a little
    elsewhere."""
    if not np.array_equal(decoded.kind, written.kind):
        return
    off = np.linalg.norm(decoded.end - written.end, axis=1)
    arcs = np.flatnonzero(decoded.is_arc)
    off[arcs] += np.linalg.norm(decoded.centre[arcs] - written.centre[arcs], axis=1)
    rows = np.flatnonzero(decoded.is_motion & (off > POSITION_EPS_MM))
    if len(rows):
        yield MOVES_CHANGED(
            where=block_name(decoded, int(rows[0])),
            measured=float(off[rows].max()),
            moves=len(rows),
        )


def _near_wanted(there: NearPairs, wanted: MoveIndex, limits: Limits) -> None:
    """Mark samples near a wanted move as near, even where the writer would move otherwise."""
    rest = np.flatnonzero(np.isinf(there.distance))
    point, _, distance = wanted.pairs_within(
        there.samples.points[rest], there.samples.z[rest], limits
    )
    np.minimum.at(there.distance, rest[point], distance)


def _written_from_cut(
    back: NearPairs, wanted: MoveIndex, decoded: MoveIndex, limits: Limits
) -> None:
    """Mark written samples as near where the program cuts the wanted move behind them."""
    rest = np.flatnonzero(np.isinf(back.distance))
    part = back.samples.of(rest)
    found, wrong_depth = nearest_at_height(part, None, wanted, limits)
    known = np.flatnonzero((found.segment >= 0) & ~wrong_depth)
    rest, move = rest[known], found.segment[known]
    share = wanted.shares(part.points[known], move)
    begin, end = wanted.cuts.heights(move).T
    places = point_at(wanted.cuts.segments, move, share)
    point, _, distance = decoded.pairs_within(places, begin + share * (end - begin), limits)
    np.minimum.at(back.distance, rest[point], distance)


_MISSING = CONTOUR_MISSING_ELSEWHERE, CONTOUR_MISSING_OTHER_DEPTH, CONTOUR_MISSING_NOTHING_CUT
_EXTRA = EXTRA_CUT_ELSEWHERE, EXTRA_CUT_OTHER_DEPTH, EXTRA_CUT_NOTHING_ASKED


def _missing_findings(back: NearPairs, undrilled: Bools, limits: Limits) -> Iterator[Finding]:
    """Yield CONTOUR_MISSING for written contours, at the block that cuts nearest."""
    decoded = back.others.cuts

    def block(part: UncoveredContour) -> str:
        known = part.nearest >= 0
        return block_name(decoded.toolpath, int(decoded.row[part.nearest])) if known else ""

    return _uncovered_findings(back, undrilled, limits, _MISSING, block)


def _extra_findings(there: NearPairs, drilled: Bools, limits: Limits) -> Iterator[Finding]:
    """Yield EXTRA_CUT for contours of the program, at their own blocks."""

    def block(part: UncoveredContour) -> str:
        return block_name(there.cuts.toolpath, part.row)

    return _uncovered_findings(there, drilled, limits, _EXTRA, block)


def _uncovered_findings(
    found: NearPairs,
    drilled: Bools,
    limits: Limits,
    sentences: PlaceSentences,
    place: Callable[[UncoveredContour], str],
) -> Iterator[Finding]:
    """Yield a finding for each contour of which a sample is near nothing on the other side."""
    samples = found.samples.of(np.flatnonzero(np.isinf(found.distance)))
    nearest = nearest_at_height(samples, None, found.others, limits)
    parts = list(uncovered_contours(found.cuts, samples, nearest, drilled, limits))
    return uncovered_findings(parts, found.cuts, limits[0], sentences, place)


def _plunge_findings(
    mine: Side, others: tuple[Side, Side], alike: MatchingMoves, limits: Limits
) -> Iterator[Finding]:
    """Yield EXTRA_CUT for feeds straight down to where no cut was asked for, except holes, which
    are compared by `hole_findings`."""
    toolpath = mine.toolpath
    rows = np.flatnonzero(mine.plunges & ~alike.in_written)
    rows = rows[~_is_at_place(toolpath.end[rows, :2], mine.holes.at)]
    fine = np.zeros(len(rows), dtype=np.bool_)
    for other in others:
        ends = toolpath.end[rows]
        fine[other.moves.pairs_within(ends[:, :2], ends[:, 2], limits)[0]] = True
        deep = other.toolpath.end[other.plunges]
        one, plunge = near_points(ends[:, :2], deep[:, :2], limits[0])
        fine[one[deep[plunge, 2] <= ends[one, 2] + limits[1]]] = True
    bad = rows[~fine]
    for row, more in first_items(bad.tolist()):
        yield EXTRA_CUT_PLUNGE(
            where=f"{block_name(toolpath, row)} at {at_point(toolpath.end[row])}",
            measured=toolpath.end[row, 2],
            more=more,
        )


def _is_at_place(points: Floats, places: Floats) -> Bools:
    """Return (J,) true for points (J, 2) that are one of the places (K, 2)."""
    known = {tuple(place) for place in np.rint(places / POSITION_EPS_MM).astype(int).tolist()}
    mine = np.rint(points / POSITION_EPS_MM).astype(int).tolist()
    return np.array([tuple(point) in known for point in mine], dtype=np.bool_)


def _repeated_cuts(
    mine: Side, other: Side, alike: MatchingMoves, limits: Limits
) -> Iterator[Finding]:
    """Yield EXTRA_CUT for moves that are cut more often than the job asks."""
    cutting = np.flatnonzero(mine.cuts.is_cut)
    number, first, counts = np.unique(
        alike.decoded[cutting], return_index=True, return_counts=True
    )
    asked = np.bincount(
        alike.written[other.cuts.is_cut], minlength=int(number.max(initial=-1)) + 1
    )[number]
    more_often = np.flatnonzero((counts > 1) & (counts > asked))
    rows = cutting[first[more_often]]
    segment = mine.cuts.first[rows].astype(np.int64)
    half = np.full(len(rows), 0.5)
    middle = point_at(mine.cuts.segments, segment, half)
    z = mine.cuts.heights(segment).mean(axis=1)
    point, move, _ = other.moves.pairs_within(middle, z, limits)
    moves = np.column_stack([point, other.cuts.row[move]])
    lie = np.bincount(np.unique(moves, axis=0)[:, 0], minlength=len(rows))
    bad = np.flatnonzero(counts[more_often] > np.maximum(lie, 1))
    for place, more in first_items(bad.tolist()):
        row = int(rows[place])
        times, limit = int(counts[more_often][place]), max(int(lie[place]), 1)
        yield EXTRA_CUT_AGAIN(
            where=f"{block_name(mine.toolpath, row)} near {at_point(middle[place])}",
            measured=times,
            limit=limit,
            more=more,
        )


# Feeds, spindle, tool, coolant, dwells, clearance and end of a program, against what the job
# asks for.

FEED_SHARE = 0.5
"""Feeds differ when they are more than this part of the dialect's unit of feed apart."""

DWELL_S = 0.0005
"""A dwell is too short when it is shorter by more than this."""

SPINDLE_OFF = NO_TOOL = 0.0
"""The speed of a spindle that is off, and the number of no tool."""

COOLANTS = ("no coolant", "mist", "flood", "mist and flood")
"""Names of coolant states: the index is the sum of 1 for mist and 2 for flood."""


def compare_settings(
    mine: Side, other: Side, alike: MatchingMoves, pairs: Ints, asked: ProgramRequest
) -> tuple[Finding, ...]:
    """Compare feeds, spindle, tool, coolant, corners, dwells, clearance and end; `pairs` (P, 2)
    are rows of both sides that lie on each other, besides those that are alike."""
    both = _SettingPairs.of(mine, other, alike, pairs, asked.limits_mm)
    return (
        *_feed_findings(both, asked),
        *_air_feed_findings(mine.toolpath, other.toolpath),
        *_spindle_findings(both),
        *_tool_findings(both),
        *_coolant_findings(both),
        *_corner_findings(both),
        *_dwell_findings(mine.toolpath, other.toolpath, asked),
        *_clearance_findings(mine, other, alike, asked),
        *_end_findings(mine.toolpath, other.toolpath, asked),
    )


class _SettingPairs(Struct, frozen=True, eq=False):
    """Decoded rows (R,) that cut or plunge, and pairs (P, 2) of such a row with a written row to
    compare it with."""

    decoded: Toolpath
    written: Toolpath
    rows: Ints
    pairs: Ints

    @classmethod
    def of(
        cls, mine: Side, other: Side, alike: MatchingMoves, pairs: Ints, limits: Limits
    ) -> _SettingPairs:
        """Pair rows: the given pairs, all rows that are alike, each plunge that is not alike with
        every written plunge, and each cut without any of these with the written moves at its
        middle, whatever their direction."""
        at_work, there = mine.cuts.is_cut | mine.plunges, other.cuts.is_cut | other.plunges
        rows, written = np.flatnonzero(at_work), np.flatnonzero(there)
        # One of several written rows that are alike, with the same settings, is enough.
        states = np.column_stack([alike.written, *_settings(other.toolpath)])[written]
        written = written[np.unique(states, axis=0, return_index=True)[1]]
        order = written[np.argsort(alike.written[written], kind="stable")]
        number = alike.written[order]
        low = np.searchsorted(number, alike.decoded[rows], side="left")
        high = np.searchsorted(number, alike.decoded[rows], side="right")
        count = high - low
        begin = np.repeat(low - (np.cumsum(count) - count), count)
        same = np.column_stack([np.repeat(rows, count), order[begin + np.arange(count.sum())]])
        lone = rows[(count == 0) & mine.plunges[rows]]
        plunges = written[other.plunges[written]]
        feeds = plunges[np.unique(other.toolpath.feed[plunges], return_index=True)[1]]
        entered = np.column_stack([np.repeat(lone, len(feeds)), np.tile(feeds, len(lone))])
        paired = np.concatenate([same, pairs, entered])
        alone = np.flatnonzero(mine.cuts.is_cut & ~np.isin(np.arange(len(at_work)), paired[:, 0]))
        segment = mine.cuts.first[alone].astype(np.int64)
        middle = point_at(mine.cuts.segments, segment, np.full(len(alone), 0.5))
        z = mine.cuts.heights(segment).mean(axis=1)
        point, move, _ = other.moves.pairs_within(middle, z, limits)
        beside = np.column_stack([alone[point], other.cuts.row[move]])
        every = np.concatenate([paired, np.unique(beside, axis=0)])
        return cls(mine.toolpath, other.toolpath, rows, every)

    def differing(self, same: Bools) -> tuple[Ints, Ints]:
        """Return (R,) rows without a pair that is equal, `same` (P,), and the written row of one
        pair of each."""
        fine = np.zeros(len(self.decoded), dtype=np.bool_)
        fine[self.pairs[same, 0]] = True
        rows, first = np.unique(self.pairs[:, 0], return_index=True)
        bad = ~fine[rows]
        return rows[bad], self.pairs[first[bad], 1]


def _settings(toolpath: Toolpath) -> tuple[Floats, Floats, Floats, Ints]:
    """Return (N,) each: feed, spindle speed in rev/min (CCW negative, SPINDLE_OFF when it is
    off), tool, and an index of COOLANTS."""
    kind = toolpath.kind
    turning = np.where(kind == Kind.SPINDLE_CCW, -toolpath.value, toolpath.value)
    spindle = (kind >= Kind.SPINDLE_CW) & (kind <= Kind.SPINDLE_OFF)
    turns = _last_value(spindle, np.where(kind == Kind.SPINDLE_OFF, SPINDLE_OFF, turning))
    tool = _last_value(kind == Kind.TOOL_CHANGE, toolpath.value)
    off = _last_row(kind == Kind.COOLANT_OFF)
    mist, flood = (_last_row(kind == one) > off for one in (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD))
    return toolpath.feed, turns, tool, mist + 2 * flood


def _last_row(given: Bools) -> Ints:
    """Return (N,) the last row up to each where it is `given`, −1 before the first."""
    return np.asarray(np.maximum.accumulate(np.where(given, np.arange(len(given)), -1)))


def _last_value(given: Bools, values: Floats) -> Floats:
    """Return (N,) the last `given` value up to each row, 0 before the first."""
    last = _last_row(given)
    return np.where(last >= 0, np.nan_to_num(values[np.maximum(last, 0)]), 0.0)


def _feed_findings(both: _SettingPairs, asked: ProgramRequest) -> Iterator[Finding]:
    """Yield FEED_DIFFERS: an error for feeds that the job names, a remark for those it leaves to
    the machine.

    On a machine that applies the feed to its faster axis, the speed along a line is higher by the
    ratio of its length to its run on that axis. A coarse grid changes the direction of short
    lines: the difference that follows from the directions is allowed, and twice the rounding, as
    both feeds are rounded.
    """
    is_, wanted = both.decoded.feed[both.pairs[:, 0]], both.written.feed[both.pairs[:, 1]]
    slant, other = (
        _speed_ratios(both.decoded)[both.pairs[:, 0]],
        _speed_ratios(both.written)[both.pairs[:, 1]],
    )
    turned = np.abs(slant / other - 1.0)
    share = np.where(turned > 0.0, 2.0 * FEED_SHARE, FEED_SHARE)
    off = np.abs(is_ - wanted) > share * asked.feed_unit_mm_min + wanted * turned
    rows, of = both.differing(~off)
    for is_asked, row, other_row, moves in _by_severity(rows, of, asked.feed_named[of]):
        yield (FEED_DIFFERS if is_asked else FEED_DIFFERS_OWN)(
            where=block_name(both.decoded, row),
            measured=both.decoded.feed[row],
            limit=both.written.feed[other_row],
            moves=moves,
        )


def _by_severity(rows: Ints, of: Ints, asked: Bools) -> Iterator[tuple[bool, int, int, int]]:
    """Divide rows (R,), compared with written rows `of` (R,), into those whose setting the job
    asks for, `asked` (R,), and the others: yield for each part that has any whether it is asked
    for, its first row, the written row of that, and the number of its rows."""
    for is_asked, which in ((True, asked), (False, ~asked)):
        if which.any():
            yield is_asked, int(rows[which][0]), int(of[which][0]), int(which.sum())


def _air_feed_findings(decoded: Toolpath, written: Toolpath) -> Iterator[Finding]:
    """Yield FEED_DIFFERS, a warning, for moves at a feed where a rapid was written."""
    rapids = np.flatnonzero(written.kind == Kind.RAPID)
    feeds = np.flatnonzero(written.is_feed)
    lines = np.flatnonzero(decoded.is_feed & ~decoded.is_arc)
    both = [(written, rapids), (written, feeds), (decoded, lines)]
    places = [np.column_stack([each.starts_of(rows), each.end[rows]]) for each, rows in both]
    whole = np.rint(np.concatenate(places) / POSITION_EPS_MM).astype(np.int64)
    number = np.unique(whole, axis=0, return_inverse=True)[1].reshape(-1)
    rapid, feed, line = np.split(number, np.cumsum([len(rapids), len(feeds)]))
    rows = lines[np.isin(line, np.setdiff1d(rapid, feed))]
    if len(rows):
        yield FEED_DIFFERS_IN_AIR(
            where=block_name(decoded, int(rows[0])),
            measured=decoded.feed[rows[0]],
            moves=len(rows),
        )


def _speed_ratios(toolpath: Toolpath) -> Floats:
    """Return (N,) ratio of the length of a line in XY to its run on the faster axis, 1 to √2; 1
    for other rows."""
    run = np.abs(toolpath.end - toolpath.starts)[:, :2]
    faster = run.max(axis=1)
    line = ~toolpath.is_arc & (faster > 0.0)
    return np.asarray(np.where(line, np.hypot(*run.T) / np.where(line, faster, 1.0), 1.0))


def _spindle_findings(both: _SettingPairs) -> Iterator[Finding]:
    """Yield SPINDLE_DIFFERS: an error where the job starts the spindle, otherwise a remark."""
    is_, wanted = _settings(both.decoded)[1], _settings(both.written)[1]
    rows, of = both.differing(is_[both.pairs[:, 0]] == wanted[both.pairs[:, 1]])
    for is_asked, row, other_row, moves in _by_severity(rows, of, wanted[of] != SPINDLE_OFF):
        yield (SPINDLE_DIFFERS if is_asked else SPINDLE_DIFFERS_UNASKED)(
            where=block_name(both.decoded, row),
            measured=is_[row],
            limit=wanted[other_row],
            moves=moves,
            turning=_spindle_words(float(is_[row])),
            wanted=_spindle_words(float(wanted[other_row])),
        )


def _spindle_words(turns: float) -> str:
    if turns == SPINDLE_OFF:
        return "the spindle off"
    return f"the spindle at {abs(turns):g} rev/min {'CW' if turns > SPINDLE_OFF else 'CCW'}"


def _tool_findings(both: _SettingPairs) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for cuts with another tool than in the written program."""
    is_, wanted = _settings(both.decoded)[2], _settings(both.written)[2]
    rows, of = both.differing(is_[both.pairs[:, 0]] == wanted[both.pairs[:, 1]])
    for is_asked, row, other_row, moves in _by_severity(rows, of, wanted[of] != NO_TOOL):
        yield (SETTING_DIFFERS_TOOL if is_asked else SETTING_DIFFERS_TOOL_UNASKED)(
            where=block_name(both.decoded, row),
            measured=is_[row],
            limit=wanted[other_row],
            moves=moves,
        )


def _coolant_findings(both: _SettingPairs) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for cuts with other coolant than in the written program."""
    is_, wanted = _settings(both.decoded)[3], _settings(both.written)[3]
    rows, of = both.differing(is_[both.pairs[:, 0]] == wanted[both.pairs[:, 1]])
    for is_asked, row, other_row, moves in _by_severity(rows, of, wanted[of] != 0):
        yield (SETTING_DIFFERS_COOLANT if is_asked else SETTING_DIFFERS_COOLANT_UNASKED)(
            where=block_name(both.decoded, row),
            moves=moves,
            coolant=COOLANTS[int(is_[row])],
            wanted=COOLANTS[int(wanted[other_row])],
        )


def _corner_findings(both: _SettingPairs) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for moves whose corners the controller may round farther than in the
    written program. A program without a mode leaves corners to the machine and is not compared."""
    is_, wanted = _corner_tolerances(both.decoded), _corner_tolerances(both.written)
    looser = is_[both.pairs[:, 0]] > wanted[both.pairs[:, 1]]
    rows, of = both.differing(~looser)
    if len(rows):
        row, limit = int(rows[0]), float(wanted[of][0])
        yield (SETTING_DIFFERS_CORNERS if limit else SETTING_DIFFERS_NO_CORNERS)(
            where=block_name(both.decoded, row),
            measured=is_[row] if np.isfinite(is_[row]) else None,
            limit=limit,
            moves=len(rows),
            room="as far as the moves allow" if np.isinf(is_[row]) else f"within {is_[row]:g} mm",
        )


def _corner_tolerances(toolpath: Toolpath) -> Floats:
    """Return (N,) mm by which the corner at the end of each row may be rounded, or lines merged;
    NaN where the program leaves that to the machine."""
    tolerances = [
        max(mode.tolerance_mm or np.inf, mode.merging_mm) if mode.corners == "blend" else 0.0
        for mode in toolpath.modes
    ]
    return np.array([*tolerances, np.nan])[toolpath.mode]


def _dwell_findings(
    decoded: Toolpath, written: Toolpath, asked: ProgramRequest
) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS where the tool dwells for less than was asked, and where it dwells for
    longer: a warning in the stock, where it rubs, else a remark."""
    wanted, found = (np.flatnonzero(each.kind == Kind.DWELL) for each in (written, decoded))
    limits = np.array([asked.limits_mm[0], asked.limits_mm[0], asked.limits_mm[1]])
    short = []
    for row in wanted.tolist():
        here = (np.abs(decoded.end[found] - written.end[row]) <= limits).all(axis=1)
        waited = float(decoded.value[found[here]].sum())
        if waited < float(written.value[row]) - DWELL_S:
            short.append((row, waited))
    if short:
        row, waited = short[0]
        yield SETTING_DIFFERS_DWELL(
            where=f"at {at_point(written.end[row])}",
            measured=waited,
            limit=written.value[row],
            places=len(short),
        )
    yield from _long_dwell_findings(decoded, written, found, wanted, limits)


def _long_dwell_findings(
    decoded: Toolpath, written: Toolpath, found: Ints, wanted: Ints, limits: Floats
) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS where the tool dwells for longer than was asked; `found` and `wanted`
    are the rows of dwells."""
    one, other = found, wanted
    longer: dict[bool, list[tuple[int, float, float]]] = {True: [], False: []}
    seen: set[int] = set()
    for row in one.tolist():
        if row in seen:
            continue
        here = one[(np.abs(decoded.end[one] - decoded.end[row]) <= limits).all(axis=1)]
        seen.update(here.tolist())
        waited = float(decoded.value[here].sum())
        near = (np.abs(written.end[other] - decoded.end[row]) <= limits).all(axis=1)
        asked = float(written.value[other[near]].sum())
        if waited > asked + DWELL_S:
            deep = bool(decoded.end[row, 2] < STOCK_TOP_MM - limits[2])
            longer[deep].append((row, waited, asked))
    for deep, places in longer.items():
        if places:
            row, waited, asked = places[0]
            yield SETTING_DIFFERS_WAIT(
                severity=Severity.WARNING if deep else Severity.INFO,
                where=f"{block_name(decoded, row)} at {at_point(decoded.end[row])}",
                measured=waited,
                limit=asked,
                places=len(places),
                where_it="in the stock" if deep else "in the air",
            )


def _clearance_findings(
    mine: Side, other: Side, alike: MatchingMoves, asked: ProgramRequest
) -> Iterator[Finding]:
    """Yield CLEARANCE_LOW for rapids in XY below the height asked for, except rapids in
    `written`."""
    toolpath = mine.toolpath
    if is_flat(other.toolpath):
        return
    start, end = toolpath.starts, toolpath.end
    goes = (toolpath.kind == Kind.RAPID) & (start[:, :2] != end[:, :2]).any(axis=1)
    low = np.minimum(start[:, 2], end[:, 2])
    # The program does not choose the height at which it begins: only that of its first end counts.
    rising = (start[:, 2] == toolpath.start[2]) & (np.cumsum(toolpath.is_motion) == 1)
    low = np.where(rising, end[:, 2], low)
    least = asked.safe_z_mm - asked.limits_mm[1]
    bad = np.flatnonzero(goes & ~alike.in_written & (low < least))
    if len(bad) == 0:
        return
    row = int(bad[np.argmin(low[bad])])
    yield (CLEARANCE_LOW if asked.safe_z_named else CLEARANCE_LOW_OWN)(
        severity=_severity(float(low[row]), asked),
        where=f"{block_name(toolpath, row)} near {at_point(end[row])}",
        measured=low[row],
        limit=asked.safe_z_mm,
        rapids=len(bad),
    )


def _severity(low_mm: float, asked: ProgramRequest) -> Severity:
    """Return ERROR where the tool touches the stock or the job names the height, else WARNING."""
    touching = low_mm <= STOCK_TOP_MM + asked.limits_mm[1]
    return Severity.ERROR if touching or asked.safe_z_named else Severity.WARNING


def _end_findings(
    decoded: Toolpath, written: Toolpath, asked: ProgramRequest
) -> Iterator[Finding]:
    """Yield END_DIFFERS for a program without END, and for one whose tool ends lower or elsewhere
    than asked."""
    if (written.kind == Kind.END).any() and not (decoded.kind == Kind.END).any():
        yield END_DIFFERS_NO_END(
            where=block_name(decoded, len(decoded) - 1) if len(decoded) else ""
        )
    last, goal = _last_position(decoded), _last_position(written)
    if last[2] < min(goal[2], asked.safe_z_mm) - asked.limits_mm[1]:
        yield END_DIFFERS(
            severity=_severity(float(last[2]), asked),
            where=f"at {at_point(last)}",
            measured=last[2],
            limit=goal[2],
        )
    elif np.hypot(*(last - goal)[:2]) > asked.limits_mm[0]:
        yield END_DIFFERS_PLACE(end=at_point(last), wanted=at_point(goal))


def _last_position(toolpath: Toolpath) -> Floats:
    return toolpath.end[-1] if len(toolpath) else toolpath.start
