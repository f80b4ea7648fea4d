"""Conformance: compare the moves of a program, as programmed, with those that its job asks for.

    drawing, job, flags ─plan, write, read─▶ written     the moves that camtool would program
    program ─read─▶ decoded                              the moves that the program holds

A move that is in both with the same numbers conforms. Every other decoded move must lie where
`written` or the wanted toolpath cuts, and every other written move where `decoded` cuts, within
the resolution of the dialect. What the dialect makes of the wanted path (chords, ends on its grid,
stairs) is in `written` already, so the tolerance does not allow for it. The order of contours and
their starts are free. Where moves of both lie on each other, their direction, feed, spindle, tool
and coolant must be the same."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct_rows
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
    """The result of the comparison: findings on where the program cuts (`place`), and on feeds,
    spindle and other settings (`settings`); the number of cutting `moves`, the number of them that
    are equal in `written` (`alike`), and the largest distance `off_mm` of the others from what was
    asked (0 if there are none)."""

    place: tuple[Finding, ...] = ()
    settings: tuple[Finding, ...] = ()
    moves: int = 0
    alike: int = 0
    off_mm: float = 0.0


def conformance_of(
    decoded: Toolpath, request: ProgramRequest, *, flat_cuts: bool, sample_mm: float
) -> Conformance:
    """Compare the cutting moves of a program with those that the job asks for, both in place and
    in settings."""
    decoded_side = Side.of(decoded.first(decoded.executed_rows), flat_cuts=flat_cuts)
    count = len(decoded_side.cuts.rows)
    if _equal_toolpaths(decoded, request.written):
        return Conformance(moves=count, alike=count)
    other = Side.of(request.written.first(request.written.executed_rows), flat_cuts=flat_cuts)
    wanted_side = Side.of(request.wanted.first(request.wanted.executed_rows), flat_cuts=flat_cuts)
    matching = MatchingMoves.of(decoded_side.toolpath, other.toolpath)
    place = compare_places(decoded_side, other, wanted_side, matching, request, sample_mm)
    settings = compare_settings(decoded_side, other, matching, place.pairs, request)
    return Conformance(
        place=place.findings,
        settings=settings,
        moves=count,
        alike=int((matching.in_written & decoded_side.cuts.is_cut).sum()),
        off_mm=place.off_mm,
    )


def _equal_toolpaths(one: Toolpath, other: Toolpath) -> bool:
    """Return True if two toolpaths are equal, row for row."""
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
    the job names it."""

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
    """A number (N,) for each move of both sides; moves of the same kind, start, end and centre
    have the same number."""

    decoded: Ints
    written: Ints

    @classmethod
    def of(cls, decoded: Toolpath, written: Toolpath) -> MatchingMoves:
        """Return numbers for the moves of both sides. Points within POSITION_EPS_MM, by rounding,
        are the same."""
        numbers = np.concatenate([_numbers(decoded), _numbers(written)])
        number = np.unique(numbers, axis=0, return_inverse=True)[1].reshape(-1)
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
    rounded = np.rint(places / POSITION_EPS_MM).astype(np.int64)
    return np.concatenate([toolpath.kind[:, None], rounded], axis=1)


# Where a program cuts, against where it was asked to cut, at the resolution of its dialect.
#
# Moves that are in both sides are skipped; all others are sampled. A sample of the program must
# lie near a written or a wanted move at its height. For a sample of the written program, a decoded
# move must lie near it or near the wanted move from which it was written. Directions are compared
# wherever moves of both sides lie on each other.


class PlaceComparison(Struct, frozen=True, eq=False):
    """The result of comparing places: findings; the largest distance of a cut from what was asked,
    mm; `pairs` (P, 2): decoded rows that are not in `written`, each with a written row that it
    lies on, in the same direction."""

    findings: tuple[Finding, ...]
    off_mm: float
    pairs: Ints


def compare_places(
    decoded: Side,
    other: Side,
    goal: Side,
    matching: MatchingMoves,
    request: ProgramRequest,
    sample_mm: float,
) -> PlaceComparison:
    """Compare where `decoded` (the program) and `other` (what camtool would write) cut, in both
    directions; `goal` is the side of the wanted moves."""
    limits = request.limits_mm
    holes = compare_holes(decoded, other, limits)
    from_decoded = near_pairs(decoded.cuts, ~matching.in_written, other.moves, limits, sample_mm)
    from_written = near_pairs(other.cuts, ~matching.in_decoded, decoded.moves, limits, sample_mm)
    _near_wanted(from_decoded, goal.moves, limits)
    _written_from_cut(from_written, goal.moves, decoded.moves, limits)
    trips = encloses_area(other.cuts, limits[0])
    written = other.moves.contour_of(from_decoded.move)
    turns = reversed_samples(from_decoded, trips[written], limits)
    written = other.moves.contour_of(from_written.samples.segment[from_written.point])
    turns_back = reversed_samples(from_written, trips[written], limits)
    findings = (
        *_missing_findings(from_written, holes.undrilled, limits),
        *_extra_findings(from_decoded, holes.drilled, limits),
        *holes.findings,
        *_plunge_findings(decoded, (other, goal), matching, limits),
        *_repeated_cuts(decoded, other, matching, limits),
        *(
            reversal_findings(from_decoded, turns)
            if len(turns)
            else reversal_findings(from_written, turns_back)
        ),
    )
    findings = findings or tuple(_changed_ends(decoded.toolpath, other.toolpath))
    return PlaceComparison(
        findings, max(from_decoded.off_mm, from_written.off_mm), from_decoded.rows_along()
    )


def _changed_ends(decoded: Toolpath, written: Toolpath) -> Iterator[Finding]:
    """Yield MOVES_CHANGED if the program has the same sequence of moves as written, but some end
    slightly elsewhere."""
    if not np.array_equal(decoded.kind, written.kind):
        return
    distances = np.linalg.norm(decoded.end - written.end, axis=1)
    arcs = np.flatnonzero(decoded.is_arc)
    distances[arcs] += np.linalg.norm(decoded.centre[arcs] - written.centre[arcs], axis=1)
    rows = np.flatnonzero(decoded.is_motion & (distances > POSITION_EPS_MM))
    if len(rows):
        yield MOVES_CHANGED(
            where=block_name(decoded, int(rows[0])),
            measured=float(distances[rows].max()),
            moves=len(rows),
        )


def _near_wanted(pairs: NearPairs, wanted_moves: MoveIndex, limits: Limits) -> None:
    """Mark, in place, samples near a wanted move as covered even where no written move is near
    them."""
    unmatched = np.flatnonzero(np.isinf(pairs.distance))
    point, _, distance = wanted_moves.pairs_within(
        pairs.samples.points[unmatched], pairs.samples.z[unmatched], limits
    )
    np.minimum.at(pairs.distance, unmatched[point], distance)


def _written_from_cut(
    pairs: NearPairs, wanted_moves: MoveIndex, decoded: MoveIndex, limits: Limits
) -> None:
    """Mark, in place, written samples as covered where the program cuts the wanted move from which
    they were written."""
    unmatched = np.flatnonzero(np.isinf(pairs.distance))
    part = pairs.samples.of(unmatched)
    nearest, wrong_depth = nearest_at_height(part, None, wanted_moves, limits)
    is_at_height = np.flatnonzero((nearest.segment >= 0) & ~wrong_depth)
    unmatched, move = unmatched[is_at_height], nearest.segment[is_at_height]
    share = wanted_moves.shares(part.points[is_at_height], move)
    begin, end = wanted_moves.cuts.heights(move).T
    places = point_at(wanted_moves.cuts.segments, move, share)
    point, _, distance = decoded.pairs_within(places, begin + share * (end - begin), limits)
    np.minimum.at(pairs.distance, unmatched[point], distance)


_MISSING = CONTOUR_MISSING_ELSEWHERE, CONTOUR_MISSING_OTHER_DEPTH, CONTOUR_MISSING_NOTHING_CUT
_EXTRA = EXTRA_CUT_ELSEWHERE, EXTRA_CUT_OTHER_DEPTH, EXTRA_CUT_NOTHING_ASKED


def _missing_findings(pairs: NearPairs, undrilled: Bools, limits: Limits) -> Iterator[Finding]:
    """Yield CONTOUR_MISSING for written contours that the program does not cut, with the block
    that cuts nearest."""
    decoded = pairs.other_moves.cuts

    def block(part: UncoveredContour) -> str:
        has_nearest = part.nearest >= 0
        return block_name(decoded.toolpath, int(decoded.row[part.nearest])) if has_nearest else ""

    return _uncovered_findings(pairs, undrilled, limits, _MISSING, block)


def _extra_findings(pairs: NearPairs, drilled: Bools, limits: Limits) -> Iterator[Finding]:
    """Yield EXTRA_CUT for contours of the program that nobody asked for, with their own blocks."""

    def block(part: UncoveredContour) -> str:
        return block_name(pairs.cuts.toolpath, part.row)

    return _uncovered_findings(pairs, drilled, limits, _EXTRA, block)


def _uncovered_findings(
    pairs: NearPairs,
    drilled: Bools,
    limits: Limits,
    sentences: PlaceSentences,
    place: Callable[[UncoveredContour], str],
) -> Iterator[Finding]:
    """Yield a finding for each contour with a sample that is not near any cut of the other
    side."""
    samples = pairs.samples.of(np.flatnonzero(np.isinf(pairs.distance)))
    nearest_moves = nearest_at_height(samples, None, pairs.other_moves, limits)
    parts = list(uncovered_contours(pairs.cuts, samples, nearest_moves, drilled, limits))
    return uncovered_findings(parts, pairs.cuts, limits[0], sentences, place)


def _plunge_findings(
    side: Side, other_sides: tuple[Side, Side], matching: MatchingMoves, limits: Limits
) -> Iterator[Finding]:
    """Yield EXTRA_CUT for plunges (feeds straight down) where no cut was asked for; holes are left
    to `compare_holes`."""
    toolpath = side.toolpath
    rows = np.flatnonzero(side.plunges & ~matching.in_written)
    rows = rows[~_is_at_place(toolpath.end[rows, :2], side.holes.places)]
    fine = np.zeros(len(rows), dtype=np.bool_)
    for other in other_sides:
        ends = toolpath.end[rows]
        fine[other.moves.pairs_within(ends[:, :2], ends[:, 2], limits)[0]] = True
        plunge_ends = other.toolpath.end[other.plunges]
        one, plunge = near_points(ends[:, :2], plunge_ends[:, :2], limits[0])
        fine[one[plunge_ends[plunge, 2] <= ends[one, 2] + limits[1]]] = True
    unexplained = rows[~fine]
    for row, other_count in first_items(unexplained.tolist()):
        yield EXTRA_CUT_PLUNGE(
            where=f"{block_name(toolpath, row)} at {at_point(toolpath.end[row])}",
            measured=toolpath.end[row, 2],
            more=other_count,
        )


def _is_at_place(points: Floats, places: Floats) -> Bools:
    """Return the mask (J,) of points (J, 2) that coincide with one of the places (K, 2)."""
    place_set = {tuple(place) for place in np.rint(places / POSITION_EPS_MM).astype(int).tolist()}
    rounded = np.rint(points / POSITION_EPS_MM).astype(int).tolist()
    return np.array([tuple(point) in place_set for point in rounded], dtype=np.bool_)


def _repeated_cuts(
    side: Side, other: Side, matching: MatchingMoves, limits: Limits
) -> Iterator[Finding]:
    """Yield EXTRA_CUT for moves that are cut more often than the job asks."""
    cutting = np.flatnonzero(side.cuts.is_cut)
    number, first, counts = np.unique(
        matching.decoded[cutting], return_index=True, return_counts=True
    )
    wanted_counts = np.bincount(
        matching.written[other.cuts.is_cut], minlength=int(number.max(initial=-1)) + 1
    )[number]
    more_often = np.flatnonzero((counts > 1) & (counts > wanted_counts))
    rows = cutting[first[more_often]]
    segment = side.cuts.first[rows].astype(np.int64)
    half = np.full(len(rows), 0.5)
    middle = point_at(side.cuts.segments, segment, half)
    z = side.cuts.heights(segment).mean(axis=1)
    point, move, _ = other.moves.pairs_within(middle, z, limits)
    moves = np.column_stack([point, other.cuts.row[move]])
    lie = np.bincount(distinct_rows(moves)[:, 0], minlength=len(rows))
    repeated = np.flatnonzero(counts[more_often] > np.maximum(lie, 1))
    for place, other_count in first_items(repeated.tolist()):
        row = int(rows[place])
        times, limit = int(counts[more_often][place]), max(int(lie[place]), 1)
        yield EXTRA_CUT_AGAIN(
            where=f"{block_name(side.toolpath, row)} near {at_point(middle[place])}",
            measured=times,
            limit=limit,
            more=other_count,
        )


# Feeds, spindle, tool, coolant, dwells, clearance and end of a program, against what the job
# asks for.

FEED_SHARE = 0.5
"""Feeds differ when they are more than this part of the dialect's unit of feed apart."""

DWELL_S = 0.0005
"""A dwell is too short when it is shorter by more than this."""

SETTING_OFF = 0.0
"""The speed of a spindle that is off, the number of no tool, and no coolant."""

COOLANTS = ("no coolant", "mist", "flood", "mist and flood")


def compare_settings(
    side: Side, other: Side, matching: MatchingMoves, pairs: Ints, request: ProgramRequest
) -> tuple[Finding, ...]:
    """Return findings on feeds, spindle, tool, coolant, corners, dwells, clearance and end.
    `pairs` (P, 2): rows of both sides that lie on each other, in addition to those with equal
    moves."""
    setting_pairs = _SettingPairs.of(side, other, matching, pairs, request.limits_mm)
    return (
        *_feed_findings(setting_pairs, request),
        *_air_feed_findings(side.toolpath, other.toolpath),
        *_spindle_findings(setting_pairs),
        *_tool_findings(setting_pairs),
        *_coolant_findings(setting_pairs),
        *_corner_findings(setting_pairs),
        *_dwell_findings(side.toolpath, other.toolpath, request),
        *_clearance_findings(side, other, matching, request),
        *_end_findings(side.toolpath, other.toolpath, request),
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
        cls, side: Side, other: Side, matching: MatchingMoves, pairs: Ints, limits: Limits
    ) -> _SettingPairs:
        """Pair the rows of both sides whose settings are compared: the given pairs, all equal
        moves, each remaining plunge with every written plunge, and each remaining cut with the
        written moves at its middle, whatever their direction."""
        at_work, other_at_work = side.cuts.is_cut | side.plunges, other.cuts.is_cut | other.plunges
        rows, written = np.flatnonzero(at_work), np.flatnonzero(other_at_work)
        # One of several written rows that are alike, with the same settings, is enough.
        states = np.column_stack([matching.written, *_settings(other.toolpath)])[written]
        written = written[np.unique(states, axis=0, return_index=True)[1]]
        order = written[np.argsort(matching.written[written], kind="stable")]
        number = matching.written[order]
        low = np.searchsorted(number, matching.decoded[rows], side="left")
        high = np.searchsorted(number, matching.decoded[rows], side="right")
        count = high - low
        begin = np.repeat(low - (np.cumsum(count) - count), count)
        alike_pairs = np.column_stack(
            [np.repeat(rows, count), order[begin + np.arange(count.sum())]]
        )
        lone = rows[(count == 0) & side.plunges[rows]]
        plunges = written[other.plunges[written]]
        feeds = plunges[np.unique(other.toolpath.feed[plunges], return_index=True)[1]]
        entered = np.column_stack([np.repeat(lone, len(feeds)), np.tile(feeds, len(lone))])
        paired = np.concatenate([alike_pairs, pairs, entered])
        unpaired = np.flatnonzero(
            side.cuts.is_cut & ~np.isin(np.arange(len(at_work)), paired[:, 0])
        )
        segment = side.cuts.first[unpaired].astype(np.int64)
        middle = point_at(side.cuts.segments, segment, np.full(len(unpaired), 0.5))
        z = side.cuts.heights(segment).mean(axis=1)
        point, move, _ = other.moves.pairs_within(middle, z, limits)
        nearby_pairs = np.column_stack([unpaired[point], other.cuts.row[move]])
        every = np.concatenate([paired, distinct_rows(nearby_pairs)])
        return cls(side.toolpath, other.toolpath, rows, every)

    def differing(self, is_equal: Bools) -> tuple[Ints, Ints]:
        """Return the rows (R,) none of whose pairs is in the mask `is_equal` (P,), and for each
        the written row of one of its pairs."""
        fine = np.zeros(len(self.decoded), dtype=np.bool_)
        fine[self.pairs[is_equal, 0]] = True
        rows, first = np.unique(self.pairs[:, 0], return_index=True)
        is_unequal = ~fine[rows]
        return rows[is_unequal], self.pairs[first[is_unequal], 1]


def _settings(toolpath: Toolpath) -> tuple[Floats, Floats, Floats, Ints]:
    """Return (N,) each: feed, spindle speed in rev/min (negative for CCW, SETTING_OFF if off),
    tool number, and index in COOLANTS."""
    kind = toolpath.kind
    turning = np.where(kind == Kind.SPINDLE_CCW, -toolpath.value, toolpath.value)
    spindle = (kind >= Kind.SPINDLE_CW) & (kind <= Kind.SPINDLE_OFF)
    turns = _last_value(spindle, np.where(kind == Kind.SPINDLE_OFF, SETTING_OFF, turning))
    tool = _last_value(kind == Kind.TOOL_CHANGE, toolpath.value)
    off_row = _last_row(kind == Kind.COOLANT_OFF)
    mist, flood = (
        _last_row(kind == one) > off_row for one in (Kind.COOLANT_MIST, Kind.COOLANT_FLOOD)
    )
    return toolpath.feed, turns, tool, mist + 2 * flood


def _last_row(is_given: Bools) -> Ints:
    """Return (N,) the last row up to and including each that is in the mask, −1 before the
    first."""
    return np.asarray(np.maximum.accumulate(np.where(is_given, np.arange(len(is_given)), -1)))


def _last_value(is_given: Bools, values: Floats) -> Floats:
    """Return (N,) the value of the last row up to and including each that is in the mask, 0 before
    the first."""
    last = _last_row(is_given)
    return np.where(last >= 0, np.nan_to_num(values[np.maximum(last, 0)]), 0.0)


def _feed_findings(setting_pairs: _SettingPairs, request: ProgramRequest) -> Iterator[Finding]:
    """Yield FEED_DIFFERS: an error for feeds that the job names, a remark for feeds that it leaves
    to the machine.

    On a machine that applies the feed to its faster axis, the speed along a line is higher by the
    ratio of its length to its run on that axis. A coarse grid changes the direction of short
    lines: the difference that follows from the directions is allowed, and twice the rounding, as
    both feeds are rounded."""
    decoded_feed, written_feed = (
        setting_pairs.decoded.feed[setting_pairs.pairs[:, 0]],
        setting_pairs.written.feed[setting_pairs.pairs[:, 1]],
    )
    slant, other = (
        _speed_ratios(setting_pairs.decoded)[setting_pairs.pairs[:, 0]],
        _speed_ratios(setting_pairs.written)[setting_pairs.pairs[:, 1]],
    )
    slant_change = np.abs(slant / other - 1.0)
    share = np.where(slant_change > 0.0, 2.0 * FEED_SHARE, FEED_SHARE)
    differs = (
        np.abs(decoded_feed - written_feed)
        > share * request.feed_unit_mm_min + written_feed * slant_change
    )
    rows, written_rows = setting_pairs.differing(~differs)
    for is_asked, row, other_row, moves in _by_severity(
        rows, written_rows, request.feed_named[written_rows]
    ):
        yield (FEED_DIFFERS if is_asked else FEED_DIFFERS_OWN)(
            where=block_name(setting_pairs.decoded, row),
            measured=setting_pairs.decoded.feed[row],
            limit=setting_pairs.written.feed[other_row],
            moves=moves,
        )


def _by_severity(
    rows: Ints, twins: Ints, is_requested: Bools
) -> Iterator[tuple[bool, int, int, int]]:
    """Group rows (R,), compared with written rows `twins` (R,), by whether the job asks for their
    setting (`is_requested` (R,)). Yield for each group that is not empty: is it asked for, its
    first row, the written row of that, and the number of rows."""
    for is_asked, is_part in ((True, is_requested), (False, ~is_requested)):
        if is_part.any():
            yield (is_asked, int(rows[is_part][0]), int(twins[is_part][0]), int(is_part.sum()))


def _air_feed_findings(decoded: Toolpath, written: Toolpath) -> Iterator[Finding]:
    """Yield FEED_DIFFERS, a warning, for moves at a feed where camtool would write a rapid."""
    rapids = np.flatnonzero(written.kind == Kind.RAPID)
    feeds = np.flatnonzero(written.is_feed)
    lines = np.flatnonzero(decoded.is_feed & ~decoded.is_arc)
    sides_and_rows = [(written, rapids), (written, feeds), (decoded, lines)]
    places = [
        np.column_stack([each.starts_of(rows), each.end[rows]]) for each, rows in sides_and_rows
    ]
    rounded = np.rint(np.concatenate(places) / POSITION_EPS_MM).astype(np.int64)
    number = np.unique(rounded, axis=0, return_inverse=True)[1].reshape(-1)
    rapid, feed, line = np.split(number, np.cumsum([len(rapids), len(feeds)]))
    rows = lines[np.isin(line, np.setdiff1d(rapid, feed))]
    if len(rows):
        yield FEED_DIFFERS_IN_AIR(
            where=block_name(decoded, int(rows[0])),
            measured=decoded.feed[rows[0]],
            moves=len(rows),
        )


def _speed_ratios(toolpath: Toolpath) -> Floats:
    """Return (N,) the ratio of a line's length in XY to its run on the faster axis, 1 to √2; 1 for
    other rows."""
    run = np.abs(toolpath.end - toolpath.starts)[:, :2]
    faster = run.max(axis=1)
    line = ~toolpath.is_arc & (faster > 0.0)
    return np.asarray(np.where(line, np.hypot(*run.T) / np.where(line, faster, 1.0), 1.0))


def _spindle_findings(setting_pairs: _SettingPairs) -> Iterator[Finding]:
    """Yield SPINDLE_DIFFERS: an error where the job starts the spindle, otherwise a remark."""
    for is_asked, where, speed, written, moves in _unequal_settings(setting_pairs, 1):
        yield (SPINDLE_DIFFERS if is_asked else SPINDLE_DIFFERS_UNASKED)(
            where=where,
            measured=speed,
            limit=written,
            moves=moves,
            turning=_spindle_words(speed),
            wanted=_spindle_words(written),
        )


def _unequal_settings(
    setting_pairs: _SettingPairs, column: int
) -> Iterator[tuple[bool, str, float, float, int]]:
    """Compare a column of `_settings`. Yield, for the moves whose setting the job asks for and
    then for the others: is it asked for, the first block, its value and the written one, and the
    number of moves."""
    decoded, written = (
        _settings(each)[column] for each in (setting_pairs.decoded, setting_pairs.written)
    )
    rows, written_rows = setting_pairs.differing(
        decoded[setting_pairs.pairs[:, 0]] == written[setting_pairs.pairs[:, 1]]
    )
    for is_asked, row, other_row, moves in _by_severity(
        rows, written_rows, written[written_rows] != SETTING_OFF
    ):
        where = block_name(setting_pairs.decoded, row)
        yield is_asked, where, float(decoded[row]), float(written[other_row]), moves


def _spindle_words(turns: float) -> str:
    if turns == SETTING_OFF:
        return "the spindle off"
    return f"the spindle at {abs(turns):g} rev/min {'CW' if turns > SETTING_OFF else 'CCW'}"


def _tool_findings(setting_pairs: _SettingPairs) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for cuts with another tool than in the written program."""
    for is_asked, where, tool, written, moves in _unequal_settings(setting_pairs, 2):
        yield (SETTING_DIFFERS_TOOL if is_asked else SETTING_DIFFERS_TOOL_UNASKED)(
            where=where, measured=tool, limit=written, moves=moves
        )


def _coolant_findings(setting_pairs: _SettingPairs) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for cuts with other coolant than in the written program."""
    for is_asked, where, coolant, written, moves in _unequal_settings(setting_pairs, 3):
        yield (SETTING_DIFFERS_COOLANT if is_asked else SETTING_DIFFERS_COOLANT_UNASKED)(
            where=where, moves=moves, coolant=COOLANTS[int(coolant)], wanted=COOLANTS[int(written)]
        )


def _corner_findings(setting_pairs: _SettingPairs) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for moves whose corners the controller may round farther than in the
    written program. A program without a mode leaves corners to the machine and is not compared."""
    decoded_limit, written_limit = (
        _corner_tolerances(setting_pairs.decoded),
        _corner_tolerances(setting_pairs.written),
    )
    looser = decoded_limit[setting_pairs.pairs[:, 0]] > written_limit[setting_pairs.pairs[:, 1]]
    rows, written_rows = setting_pairs.differing(~looser)
    if len(rows):
        row, limit = int(rows[0]), float(written_limit[written_rows][0])
        yield (SETTING_DIFFERS_CORNERS if limit else SETTING_DIFFERS_NO_CORNERS)(
            where=block_name(setting_pairs.decoded, row),
            measured=decoded_limit[row] if np.isfinite(decoded_limit[row]) else None,
            limit=limit,
            moves=len(rows),
            room="as far as the moves allow"
            if np.isinf(decoded_limit[row])
            else f"within {decoded_limit[row]:g} mm",
        )


def _corner_tolerances(toolpath: Toolpath) -> Floats:
    """Return (N,) mm: how far the corner at the end of each row may be rounded, or lines merged;
    NaN if the program leaves that to the machine."""
    tolerances = [
        max(mode.tolerance_mm or np.inf, mode.merging_mm) if mode.corners == "blend" else 0.0
        for mode in toolpath.modes
    ]
    return np.array([*tolerances, np.nan])[toolpath.mode]


def _dwell_findings(
    decoded: Toolpath, written: Toolpath, request: ProgramRequest
) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for dwells shorter than asked, and for longer ones: a warning in the
    stock, where the tool rubs, else a remark."""
    written_dwells, decoded_dwells = (
        np.flatnonzero(each.kind == Kind.DWELL) for each in (written, decoded)
    )
    limits = np.array([request.limits_mm[0], request.limits_mm[0], request.limits_mm[1]])
    short_dwells = []
    for row in written_dwells.tolist():
        is_here = (np.abs(decoded.end[decoded_dwells] - written.end[row]) <= limits).all(axis=1)
        waited = float(decoded.value[decoded_dwells[is_here]].sum())
        if waited < float(written.value[row]) - DWELL_S:
            short_dwells.append((row, waited))
    if short_dwells:
        row, waited = short_dwells[0]
        yield SETTING_DIFFERS_DWELL(
            where=f"at {at_point(written.end[row])}",
            measured=waited,
            limit=written.value[row],
            places=len(short_dwells),
        )
    yield from _long_dwell_findings(decoded, written, decoded_dwells, written_dwells, limits)


def _long_dwell_findings(
    decoded: Toolpath, written: Toolpath, decoded_dwells: Ints, goals: Ints, limits: Floats
) -> Iterator[Finding]:
    """Yield SETTING_DIFFERS for dwells longer than asked; `decoded_dwells` and `goals` are the
    rows of dwells on both sides."""
    one, other = decoded_dwells, goals
    longer: dict[bool, list[tuple[int, float, float]]] = {True: [], False: []}
    visited: set[int] = set()
    for row in one.tolist():
        if row in visited:
            continue
        rows_here = one[(np.abs(decoded.end[one] - decoded.end[row]) <= limits).all(axis=1)]
        visited.update(rows_here.tolist())
        waited = float(decoded.value[rows_here].sum())
        is_near = (np.abs(written.end[other] - decoded.end[row]) <= limits).all(axis=1)
        wanted_s = float(written.value[other[is_near]].sum())
        if waited > wanted_s + DWELL_S:
            is_deep = bool(decoded.end[row, 2] < STOCK_TOP_MM - limits[2])
            longer[is_deep].append((row, waited, wanted_s))
    for is_deep, places in longer.items():
        if places:
            row, waited, wanted_s = places[0]
            yield SETTING_DIFFERS_WAIT(
                severity=Severity.WARNING if is_deep else Severity.INFO,
                where=f"{block_name(decoded, row)} at {at_point(decoded.end[row])}",
                measured=waited,
                limit=wanted_s,
                places=len(places),
                where_it="in the stock" if is_deep else "in the air",
            )


def _clearance_findings(
    side: Side, other: Side, matching: MatchingMoves, request: ProgramRequest
) -> Iterator[Finding]:
    """Yield CLEARANCE_LOW for rapids in XY below the height asked for, except rapids in
    `written`."""
    toolpath = side.toolpath
    if is_flat(other.toolpath):
        return
    start, end = toolpath.starts, toolpath.end
    goes = (toolpath.kind == Kind.RAPID) & (start[:, :2] != end[:, :2]).any(axis=1)
    low = np.minimum(start[:, 2], end[:, 2])
    # The program does not choose the height at which it begins: only that of its first end counts.
    rising = (start[:, 2] == toolpath.start[2]) & (np.cumsum(toolpath.is_motion) == 1)
    low = np.where(rising, end[:, 2], low)
    min_z = request.safe_z_mm - request.limits_mm[1]
    low_rows = np.flatnonzero(goes & ~matching.in_written & (low < min_z))
    if len(low_rows) == 0:
        return
    row = int(low_rows[np.argmin(low[low_rows])])
    yield (CLEARANCE_LOW if request.safe_z_named else CLEARANCE_LOW_OWN)(
        severity=_severity(float(low[row]), request),
        where=f"{block_name(toolpath, row)} near {at_point(end[row])}",
        measured=low[row],
        limit=request.safe_z_mm,
        rapids=len(low_rows),
    )


def _severity(low_mm: float, request: ProgramRequest) -> Severity:
    """Return ERROR if the tool touches the stock or the job names the height, else WARNING."""
    touching = low_mm <= STOCK_TOP_MM + request.limits_mm[1]
    return Severity.ERROR if touching or request.safe_z_named else Severity.WARNING


def _end_findings(
    decoded: Toolpath, written: Toolpath, request: ProgramRequest
) -> Iterator[Finding]:
    """Yield END_DIFFERS for a program without END, and for one whose tool ends lower or elsewhere
    than asked."""
    if (written.kind == Kind.END).any() and not (decoded.kind == Kind.END).any():
        yield END_DIFFERS_NO_END(
            where=block_name(decoded, len(decoded) - 1) if len(decoded) else ""
        )
    last, goal = _last_position(decoded), _last_position(written)
    if last[2] < min(goal[2], request.safe_z_mm) - request.limits_mm[1]:
        yield END_DIFFERS(
            severity=_severity(float(last[2]), request),
            where=f"at {at_point(last)}",
            measured=last[2],
            limit=goal[2],
        )
    elif np.hypot(*(last - goal)[:2]) > request.limits_mm[0]:
        yield END_DIFFERS_PLACE(end=at_point(last), wanted=at_point(goal))


def _last_position(toolpath: Toolpath) -> Floats:
    return toolpath.end[-1] if len(toolpath) else toolpath.start
