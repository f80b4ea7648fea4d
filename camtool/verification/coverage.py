"""The comparison of what is cut with what was wanted: contours, holes and their direction.

It serves verification (`cover`, with the tolerance of the machine) and conformance (`near_pairs`,
with the resolution of the dialect); docs/decisions/0075-one-comparison-of-cuts.md says what each
compares.

Decoded moves are sampled and compared with the wanted moves, which gives the rounding error, the
extra cuts, and the wanted contour to which each decoded row belongs. Wanted moves are sampled and
compared with the decoded moves, which gives what is missing. A sample is compared only with moves
at its own height (with a slope: at the point nearest to it), so that a lost pass or a wrong depth
is found. The tolerance of heights allows for slopes that a machine makes in small steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from typing import TypeVar

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Indices, Ints, distinct, distinct_rows
from camtool.findings import Finding, Sentence
from camtool.geometry.boxes import near_points
from camtool.geometry.measure import dot, point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.records import replace
from camtool.simulation.rows import block_of
from camtool.toolpath.moves import ROWS_AT_ONCE, STOCK_TOP_MM, Kind, Toolpath, are_arcs
from camtool.verification.cuts import (
    NO_LOOP,
    CutMoves,
    CutSamples,
    cut_moves,
    cutting_rows,
    loops,
    moves_across,
    sample_cuts,
    samples_by_parts,
)
from camtool.verification.figures import Figure
from camtool.verification.findings import (
    CONTOUR_MISSING,
    CONTOUR_MISSING_AT_DEPTH,
    CONTOUR_MISSING_HOLE,
    CONTOUR_MISSING_HOLE_DEPTH,
    CONTOUR_MISSING_NO_CUTS,
    CUT_OTHER_WAY,
    EXTRA_CUT,
    EXTRA_CUT_AT_DEPTH,
    EXTRA_CUT_HOLE,
    EXTRA_CUT_HOLE_DEPTH,
    EXTRA_CUT_NONE_WANTED,
)
from camtool.verification.matching import (
    MIN_LIMIT_MM,
    Goal,
    Match,
    empty_match,
    match_contours,
    match_rows,
    nearest_at_height,
    with_neighbours,
)
from camtool.verification.nearest import ANY_CONTOUR, MoveIndex, NearestMoves

SAMPLES_AT_ONCE = 1 << 16

Limits = tuple[float, float]
"""Tolerances in XY and in height, mm."""


class Coverage(Struct, frozen=True, eq=False):
    """The result of a comparison of cuts: the match of the rows, the rounding error, and
    CONTOUR_MISSING and EXTRA_CUT findings."""

    match: Match
    rounding: Figure
    findings: tuple[Finding, ...]


class Side(Struct, frozen=True, eq=False, dict=True):
    """One of two toolpaths that are compared: its cutting moves, and what is derived from them."""

    toolpath: Toolpath
    cuts: CutMoves

    @classmethod
    def of(cls, toolpath: Toolpath, *, flat_cuts: bool) -> Side:
        """Return the side for a toolpath, with its cutting moves; `flat_cuts` as in
        `camtool.verification.cuts`."""
        return cls(toolpath, cut_moves(toolpath, flat_cuts=flat_cuts))

    @cached_property
    def moves(self) -> MoveIndex:
        """The cutting moves, indexed by place."""
        return MoveIndex(self.cuts)

    @cached_property
    def holes(self) -> Holes:
        """The drilled holes."""
        return holes_of(self.toolpath)

    @cached_property
    def plunges(self) -> Bools:
        """(N,) true for feeds straight down that end below the stock top."""
        start, end = self.toolpath.starts, self.toolpath.end
        stays = (start[:, :2] == end[:, :2]).all(axis=1) & ~self.toolpath.is_arc
        goes_down = (end[:, 2] < start[:, 2]) & (end[:, 2] < STOCK_TOP_MM - POSITION_EPS_MM)
        return np.asarray(self.toolpath.is_feed & stays & goes_down)


def cover(
    decoded: Side,
    wanted_side: Side,
    goal: Goal,
    spacing_mm: float,
    row_from: Indices | None,
    *,
    is_judged: bool = True,
) -> Coverage:
    """Compare the cuts of a program (`decoded`) with the wanted ones, and the wanted with the
    decoded ones, on samples about `spacing_mm` apart; `goal` holds the moves of the wanted side.
    `row_from` (N,): the wanted row from which each decoded row was written, −1 for none, None if
    not known. Unless `is_judged`, only the match and the rounding error are computed, and there
    are no findings.

    A contour is compared with the one that it was written from, or that was written from it,
    first, and only where that does not fit with everything
    (docs/decisions/0037-own-rows-first.md)."""
    cuts, limits = decoded.cuts, (goal.limit_mm, goal.depth_mm)
    source, became = _contours_from(cuts, wanted_side.cuts, row_from)
    holes = compare_holes(decoded, wanted_side, limits)
    match, rounding, extra = empty_match(len(cuts.contour)), Figure(), list[UncoveredContour]()
    alike_rows = _rows_alike(cuts, wanted_side.cuts, limits, row_from)
    for samples in samples_by_parts(
        cuts, spacing_mm, cuts.is_cut, SAMPLES_AT_ONCE, _judged_together(cuts, source, alike_rows)
    ):
        nearest_wanted, belongs = _nearest_in_own_contour(cuts, samples, source, goal)
        other = np.flatnonzero(belongs == ANY_CONTOUR)
        nearest_other, is_wrong = nearest_at_height(
            samples.of(other), None, wanted_side.moves, limits
        )
        wrong_depth = np.zeros(len(nearest_wanted.distance), dtype=np.bool_)
        wrong_depth[other] = is_wrong
        nearest_wanted.distance[other], nearest_wanted.segment[other] = (
            nearest_other.distance,
            nearest_other.segment,
        )
        extra += uncovered_contours(
            cuts, samples, (nearest_wanted, wrong_depth), holes.drilled, limits
        )
        belongs[other] = match_contours(cuts, samples.of(other), nearest_other, goal)
        nearest_wanted.distance[other], nearest_wanted.segment[other] = (
            nearest_other.distance,
            nearest_other.segment,
        )
        real = np.isfinite(nearest_wanted.distance)
        rows = cuts.row[samples.segment]
        rounding.add(nearest_wanted.distance[real], samples.points[real], rows[real])
        match_rows(match, cuts, samples, belongs, nearest_wanted, goal)
    match = with_neighbours(match)
    if not is_judged:
        return Coverage(match, rounding, ())
    has_copy = _rows_copied(wanted_side.cuts, alike_rows, row_from)
    cut = np.append(
        _fits_contour(wanted_side.cuts, became, has_copy, decoded.moves, limits, spacing_mm), True
    )
    missing = list[UncoveredContour]()
    for remaining in samples_by_parts(
        wanted_side.cuts,
        spacing_mm,
        ~cut[wanted_side.cuts.contour],
        SAMPLES_AT_ONCE,
        wanted_side.cuts.contour,
    ):
        nearest_decoded = nearest_at_height(remaining, None, decoded.moves, limits)
        missing += uncovered_contours(
            wanted_side.cuts, remaining, nearest_decoded, holes.undrilled, limits
        )

    def block(part: UncoveredContour) -> str:
        return block_name(cuts.toolpath, part.row)

    def contour(part: UncoveredContour) -> str:
        return _contour_name(wanted_side.cuts, part)

    findings = (
        *uncovered_findings(missing, wanted_side.cuts, goal.limit_mm, _MISSING, contour),
        *uncovered_findings(extra, cuts, goal.limit_mm, _EXTRA, block),
        *holes.findings,
    )
    return Coverage(match, rounding, findings)


def _contours_from(cuts: CutMoves, goal: CutMoves, row_from: Indices | None) -> tuple[Ints, Ints]:
    """Return (C,) the wanted contour from which all rows of each decoded contour were written, and
    (W,) the decoded contour that alone has rows of each wanted contour; ANY_CONTOUR if there is no
    such contour."""
    of_decoded = np.full(cuts.contour_count, ANY_CONTOUR, dtype=np.int64)
    of_wanted = np.full(goal.contour_count, ANY_CONTOUR, dtype=np.int64)
    if row_from is not None and len(of_wanted):
        rows = cuts.rows
        wanted_contour = np.where(row_from[rows] >= 0, goal.contour[row_from[rows]], ANY_CONTOUR)
        pair_base = (
            len(of_wanted) + 1
        )  # contours come in order, so these numbers are mostly sorted
        pair = cuts.contour[rows].astype(np.int64) * pair_base + (wanted_contour - ANY_CONTOUR)
        changes = np.flatnonzero(np.diff(pair, prepend=-1))
        decoded_contours, wanted_contours = np.divmod(distinct(pair[changes]), pair_base)
        wanted_contours += ANY_CONTOUR
        for one, other, partners in (
            (decoded_contours, wanted_contours, of_decoded),
            (wanted_contours, decoded_contours, of_wanted),
        ):
            contours, first, count = np.unique(one, return_index=True, return_counts=True)
            is_single = (count == 1) & (contours != ANY_CONTOUR)
            partners[contours[is_single]] = other[first[is_single]]
    return of_decoded, of_wanted


def _nearest_in_own_contour(
    cuts: CutMoves, samples: CutSamples, own_contour: Ints, goal: Goal
) -> tuple[NearestMoves, Ints]:
    """Return for each sample (S,) the nearest move of the wanted contour `own_contour` (C,) of its
    contour, and the number of that wanted contour; ANY_CONTOUR for samples of contours that have
    none or do not keep within the limits of it."""
    count, fit = len(samples.points), np.asarray(own_contour != ANY_CONTOUR)
    nearest = NearestMoves(np.full(count, np.inf), np.full(count, -1, dtype=np.int64))
    contours = cuts.contour[cuts.row[samples.segment]]
    with_contour = np.flatnonzero(fit[contours])
    limits = max(goal.limit_mm, MIN_LIMIT_MM), goal.depth_mm
    for low in range(0, len(with_contour), SAMPLES_AT_ONCE):
        part = with_contour[low : low + SAMPLES_AT_ONCE]
        batch_nearest = goal.moves.nearest(
            samples.points.take(part, axis=0), samples.z[part], own_contour[contours[part]], limits
        )
        nearest.distance[part], nearest.segment[part] = (
            batch_nearest.distance,
            batch_nearest.segment,
        )
        fit[contours[part[batch_nearest.distance > goal.limit_mm]]] = False
    return nearest, np.where(fit[contours], own_contour[contours], ANY_CONTOUR)


def _judged_together(cuts: CutMoves, own_contour: Ints, alike_rows: Ints) -> Indices:
    """Return (N,) the group number of each row. Rows of one contour are judged together; if all
    rows of a contour are `alike_rows` (see `_rows_alike`) and it has an `own_contour`, they are
    judged one by one."""
    alike_counts, every = (
        np.bincount(cuts.contour[rows], minlength=len(own_contour))
        for rows in (alike_rows, cuts.rows)
    )
    is_separate = (own_contour != ANY_CONTOUR) & (alike_counts == every)
    rows = np.arange(len(cuts.contour), dtype=np.int32)
    return np.where(np.append(is_separate, False)[cuts.contour], rows, cuts.contour)


def _rows_copied(goal: CutMoves, alike_rows: Ints, row_from: Indices | None) -> Bools:
    """Return the mask (N,) of wanted rows from which a row in `alike_rows` was written, which
    therefore need no further comparison."""
    has_copy = np.zeros(len(goal.contour), dtype=np.bool_)
    if row_from is not None:
        has_copy[row_from[alike_rows]] = True
    return has_copy


def _rows_alike(cuts: CutMoves, goal: CutMoves, limits: Limits, row_from: Indices | None) -> Ints:
    """Return the rows that cut along a line or arc, that alone were written from a move of the
    same kind, and each point of which lies within the limits of that move.

    Two points that run along two lines at once are nowhere farther apart than at one of the ends.
    On two arcs they are no farther apart than both centres and, at one of the ends, both spokes,
    whose angle changes evenly: than twice the centres, an end, and what each end lies beside the
    circle of its start."""
    if row_from is None:
        return np.empty(0, dtype=np.int64)
    limit_mm, depth_mm = limits
    rows, decoded, sources = cuts.rows[row_from[cuts.rows] >= 0], cuts.toolpath, goal.toolpath
    is_unique = np.bincount(row_from[rows], minlength=len(sources)) == 1
    is_near = np.empty(len(rows), dtype=np.bool_)
    for low in range(0, len(rows), ROWS_AT_ONCE):
        batch = rows[low : low + ROWS_AT_ONCE]
        source_rows = row_from[batch]
        fit = (decoded.kind[batch] == sources.kind[source_rows]) & is_unique[source_rows]
        room_mm = np.full(len(batch), limit_mm)
        arcs = np.flatnonzero(fit & are_arcs(decoded.kind[batch]))
        if len(arcs):
            decoded_arcs, source_arcs = batch[arcs], source_rows[arcs]
            room_mm[arcs] -= 2.0 * np.hypot(
                *(decoded.centre[decoded_arcs] - sources.centre[source_arcs]).T
            )
            room_mm[arcs] -= _radius_differences(decoded, decoded_arcs) + _radius_differences(
                sources, source_arcs
            )
            fit[arcs] &= (
                np.abs(decoded.sweeps_of(decoded_arcs) - sources.sweeps_of(source_arcs)) < np.pi
            )
        starts = decoded.starts_of(batch) - sources.starts_of(source_rows)
        ends = decoded.end.take(batch, axis=0) - sources.end.take(source_rows, axis=0)
        for differences in (starts, ends):
            fit &= (np.hypot(differences[:, 0], differences[:, 1]) <= room_mm) & (
                np.abs(differences[:, 2]) <= depth_mm
            )
        is_near[low : low + len(batch)] = fit
    return np.asarray(rows[is_near])


def _radius_differences(toolpath: Toolpath, arcs: Ints | Indices) -> Floats:
    """Return (J,) mm: the distance of the end of each arc from the circle about its centre through
    its start."""
    centre = toolpath.centre[arcs]
    start_radius, end_radius = (
        np.hypot(*(points[:, :2] - centre).T)
        for points in (toolpath.starts_of(arcs), toolpath.end[arcs])
    )
    return np.asarray(np.abs(start_radius - end_radius))


def _fits_contour(
    cuts: CutMoves,
    own_contour: Ints,
    has_copy: Bools,
    other_moves: MoveIndex,
    limits: Limits,
    spacing_mm: float,
) -> Bools:
    """Return the mask (C,) of contours of one side that the other side cuts within the limits:
    those all of whose rows are in `has_copy` (N,), and those that keep within the limits of their
    `own_contour` (C,) on the other side."""
    is_whole = np.ones(len(own_contour), dtype=np.bool_)
    is_whole[cuts.contour[cuts.rows[~has_copy[cuts.rows]]]] = False
    fit = np.asarray(is_whole | (own_contour != ANY_CONTOUR))
    limit_mm, depth_mm = limits
    is_asked = np.append(fit & ~is_whole, False)[cuts.contour] & ~has_copy
    for samples in samples_by_parts(cuts, spacing_mm, is_asked):
        contours = cuts.contour[cuts.row[samples.segment]]
        near_mm = max(limit_mm, MIN_LIMIT_MM)
        nearest = other_moves.nearest(
            samples.points, samples.z, own_contour[contours], (near_mm, depth_mm)
        )
        fit[contours[nearest.distance > limit_mm]] = False
    return fit


# The comparison that all judgements share: what of one side's cuts the other side does not cut.
# Verification calls it with the tolerance of the machine, conformance with the resolution of the
# dialect (docs/decisions/0075-one-comparison-of-cuts.md).

PlaceSentences = tuple[Sentence, Sentence, Sentence]
"""Sentences for a sample far from all cuts, far from those at its depth, and without any cuts."""

_MISSING = CONTOUR_MISSING, CONTOUR_MISSING_AT_DEPTH, CONTOUR_MISSING_NO_CUTS
_EXTRA = EXTRA_CUT, EXTRA_CUT_AT_DEPTH, EXTRA_CUT_NONE_WANTED


class UncoveredContour(Struct, frozen=True):
    """A contour that the other side does not cut completely: its sample with the largest
    `distance` from the other side (mm, inf if that cuts nothing), the `share` of its samples that
    are not cut, and the `nearest` segment at that sample (−1: none). `wrong_depth`: the other side
    cuts there, but at another depth."""

    contour: int
    row: int
    at_mm: Floats
    distance: float
    nearest: int
    wrong_depth: bool
    share: float


def uncovered_contours(
    cuts: CutMoves,
    samples: CutSamples,
    nearest_found: tuple[NearestMoves, Bools],
    drilled: Bools,
    limits: Limits,
) -> Iterator[UncoveredContour]:
    """Yield the contours of which a part is not cut by the other side; `samples` must be all
    samples of each.

    `nearest_found` is the result of `nearest_at_height` for the samples, `drilled` (C,) the
    contours that are holes on the other side. Slopes within the tolerance of the stock top are not
    counted: they may be flat moves on it, which cut nothing."""
    nearest_moves, wrong_depth = nearest_found
    failing = np.flatnonzero(wrong_depth | (nearest_moves.distance > limits[0]))
    is_judged = ~cuts.slopes(samples.segment[failing])
    is_judged |= samples.z[failing] < STOCK_TOP_MM - limits[1]
    rows = cuts.row[samples.segment]
    contour = cuts.contour[rows]
    failing = failing[is_judged & ~drilled[contour[failing]]]
    if len(failing) == 0:
        return
    sample_counts = np.bincount(contour)
    order = failing[np.lexsort((failing, -nearest_moves.distance[failing], contour[failing]))]
    first = np.flatnonzero(np.diff(contour[order], prepend=-1))
    counts = np.diff(np.append(first, len(order)))
    for worst, count in zip(order[first].tolist(), counts.tolist(), strict=True):
        contour_number = int(contour[worst])
        yield UncoveredContour(
            contour_number,
            int(rows[worst]),
            samples.points[worst],
            float(nearest_moves.distance[worst]),
            int(nearest_moves.segment[worst]),
            bool(wrong_depth[worst]),
            float(count / sample_counts[contour_number]),
        )


def uncovered_findings(
    parts: Sequence[UncoveredContour],
    cuts: CutMoves,
    limit_mm: float,
    sentences: PlaceSentences,
    place: Callable[[UncoveredContour], str],
) -> Iterator[Finding]:
    """Yield a finding for each of these contours of `cuts`; `place` returns the text that names
    its block or contour."""
    elsewhere, other_depth, nothing_near = sentences
    for part, other_count in first_items(parts):
        is_finite = np.isfinite(part.distance)
        sentence = (other_depth if part.wrong_depth else elsewhere) if is_finite else nothing_near
        yield sentence(
            where=f"{place(part)} near {at_point(part.at_mm)}".strip(),
            measured=part.distance if is_finite else None,
            limit=limit_mm,
            share=part.share,
            contour=_contour_name(cuts, part),
            more=other_count,
        )


def _contour_name(cuts: CutMoves, part: UncoveredContour) -> str:
    """Return the name of a contour, such as `contour 3 (layer and entity)`."""
    source = cuts.toolpath.text(part.row)
    return f"contour {part.contour + 1}" + (f" ({source})" if source else "")


# Drilled holes: all that are wanted, as deep as wanted, and no others.
#
# At a hole the tool is fed straight down below the stock top and returns, in any number of pecks,
# and does not cut in XY before it moves on: a plunge with which a contour begins is no hole.


class Holes(Struct, frozen=True, eq=False):
    """H holes of `toolpath`: their positions `places` (H, 2) mm, the heights of their bottoms (H,)
    mm, and the rows (H,) that first reach them."""

    toolpath: Toolpath
    places: Floats
    bottom_mm: Floats
    row: Ints

    def __len__(self) -> int:
        return len(self.row)


def holes_of(toolpath: Toolpath) -> Holes:
    """Return the holes that a toolpath drills, in order: positions where it goes down at a feed
    and neither of the moves before and after cuts."""
    across = moves_across(toolpath)
    flat = across | (toolpath.kind == Kind.HOME_XY)
    cutting = cutting_rows(toolpath, flat_cuts=False, across=across)
    # Rows at one position lie between two moves in XY, neither of which may cut.
    stay = np.cumsum(flat)
    movers = np.flatnonzero(flat)
    cut = np.zeros(len(movers) + 2, dtype=np.bool_)
    cut[1:-1] = cutting[movers]
    running = np.cumsum(toolpath.kind == Kind.END) == 0
    drills = toolpath.is_feed & ~flat & (toolpath.end[:, 2] < STOCK_TOP_MM - POSITION_EPS_MM)
    rows = np.flatnonzero(drills & running & ~cut[stay] & ~cut[stay + 1])
    order = rows[np.lexsort((rows, toolpath.end[rows, 2], stay[rows]))]
    deepest = order[np.flatnonzero(np.diff(stay[order], prepend=-1))]
    return Holes(toolpath, toolpath.end[deepest, :2], toolpath.end[deepest, 2], deepest)


def contours_drilled(cuts: CutMoves, holes: Holes, limits_mm: Limits) -> tuple[Bools, Bools]:
    """Return the mask (C,) of contours that are holes on the other side, and the mask (H,) of
    these holes. The whole contour must lie within the first limit of the hole, and their depths
    must agree within the second.

    A contour smaller than the resolution of a dialect becomes a plunge, which cuts the same."""
    drilled = np.zeros(cuts.contour_count, dtype=np.bool_)
    is_contour = np.zeros(len(holes), dtype=np.bool_)
    if not len(holes) or not len(drilled):
        return drilled, is_contour
    contour = cuts.contour[cuts.row]
    begin = np.flatnonzero(np.diff(contour, prepend=-1))
    boxes = segment_boxes(cuts.segments)
    low = np.minimum.reduceat(boxes[:, :2], begin)
    high = np.maximum.reduceat(boxes[:, 2:], begin)
    bottom = np.minimum.reduceat(cuts.z[:, 0], begin)
    room = limits_mm[0] - 0.5 * np.hypot(*(high - low).T)
    tiny = np.flatnonzero(room >= 0.0)
    one, hole = near_points(0.5 * (low + high)[tiny], holes.places, room[tiny])
    same_depth = np.abs(bottom[tiny[one]] - holes.bottom_mm[hole]) <= limits_mm[1]
    drilled[contour[begin[tiny[one[same_depth]]]]] = True
    is_contour[hole[same_depth]] = True
    return drilled, is_contour


_MISSING_HOLES = CONTOUR_MISSING_HOLE, CONTOUR_MISSING_HOLE_DEPTH
_EXTRA_HOLES = EXTRA_CUT_HOLE, EXTRA_CUT_HOLE_DEPTH


class HoleComparison(Struct, frozen=True, eq=False):
    """The mask `drilled` (C,) of contours of the program that are holes of the wanted side, the
    mask `undrilled` (W,) of wanted contours that are holes of the program, and findings on all
    other holes."""

    drilled: Bools
    undrilled: Bools
    findings: tuple[Finding, ...]


def compare_holes(decoded: Side, goal: Side, limits: Limits) -> HoleComparison:
    """Compare the holes of a program with the wanted holes and with small contours.
    CONTOUR_MISSING for wanted holes that the program does not drill, EXTRA_CUT for holes that are
    not wanted."""
    drilled, wanted_stand = contours_drilled(decoded.cuts, goal.holes, limits)
    undrilled, decoded_stand = contours_drilled(goal.cuts, decoded.holes, limits)
    findings = (
        *_unpaired_findings(goal.holes, decoded.holes, limits, wanted_stand, _MISSING_HOLES),
        *_unpaired_findings(decoded.holes, goal.holes, limits, decoded_stand, _EXTRA_HOLES),
    )
    return HoleComparison(drilled, undrilled, findings)


def _unpaired_findings(
    holes: Holes,
    other_holes: Holes,
    limits_mm: Limits,
    stand: Bools,
    sentences: tuple[Sentence, Sentence],
) -> Iterator[Finding]:
    """Yield a finding for each hole that the other side lacks. `sentences`: for a hole without one
    at its position, and for one of another depth; `stand`: the mask of holes to leave out."""
    no_hole, other_depth = sentences
    has_position, paired = _has_hole(holes, other_holes, limits_mm)
    unpaired = np.flatnonzero(~paired & ~stand).tolist()
    for hole, other_count in first_items(unpaired):
        row = int(holes.row[hole])
        yield (other_depth if has_position[hole] else no_hole)(
            where=f"{block_name(holes.toolpath, row)} at {at_point(holes.places[hole])}",
            measured=STOCK_TOP_MM - holes.bottom_mm[hole],
            more=other_count,
        )


def _has_hole(holes: Holes, other_holes: Holes, limits_mm: Limits) -> tuple[Bools, Bools]:
    """Return the mask (H,) of holes for which the other side has a hole at the same position, and
    the mask (H,) of those for which one is also equally deep."""
    has_position, is_paired = (
        np.zeros(len(holes), dtype=np.bool_),
        np.zeros(len(holes), dtype=np.bool_),
    )
    hole_rows, other_rows = near_points(holes.places, other_holes.places, limits_mm[0])
    has_position[hole_rows] = True
    is_same_depth = (
        np.abs(holes.bottom_mm[hole_rows] - other_holes.bottom_mm[other_rows]) <= limits_mm[1]
    )
    is_paired[hole_rows[is_same_depth]] = True
    return has_position, is_paired


# The direction in which a program cuts, wherever its moves lie on those it is compared with.

MIN_SAME_COSINE = 0.7
"""Two moves on each other have the same direction when the cosine between them is above this, and
opposite directions when it is below minus this; between, one crosses the other."""

MIN_DIRECTION_LIMITS = 1.5
"""The direction of moves shorter than this many times the tolerance is not certain: their ends are
rounded by up to 1.41 units in all, which turns a longer move by no more than 32 degrees."""


def encloses_area(cuts: CutMoves, gap_mm: float) -> Bools:
    """Return the mask (C,) of contours that enclose an area. Others (open paths, paths there and
    back) may be cut from either end."""
    return np.asarray(loops(cuts, gap_mm)[:, 0] != NO_LOOP)


def direction_findings(
    decoded: MoveIndex,
    source: MoveIndex,
    limits: Limits,
    sample_mm: float,
    row_from: Indices | None,
) -> Iterator[Finding]:
    """Yield CUT_OTHER_WAY for contours of a program that are cut in the direction opposite to that
    of the moves from which it was written, `source`; `row_from` as in `cover`.

    Rows that run beside the move from which they were written, in its direction, are fine without
    a search, and so are rows whose middle lies on the contour they came from, in its direction.
    All others are compared with every move."""
    cuts = decoded.cuts
    is_open = cuts.is_cut
    if row_from is not None:
        alike_rows = _rows_alike(cuts, source.cuts, limits, row_from)
        is_open[alike_rows] = ~_same_direction(cuts, source.cuts, alike_rows, row_from)
    rows = np.flatnonzero(is_open)
    if len(rows) == 0:
        return
    segments, half = cuts.first[rows].astype(np.int64), np.full(len(rows), 0.5)
    z = cuts.heights(segments).mean(axis=1)
    middles = CutSamples(point_at(cuts.segments, segments, half), segments, z, half)
    own_contour = _contours_from(cuts, source.cuts, row_from)[0][cuts.contour[rows]]
    with_contour = np.flatnonzero(own_contour != ANY_CONTOUR)
    own_nearest = source.nearest(
        middles.points[with_contour], z[with_contour], own_contour[with_contour], limits
    )
    is_open = np.ones(len(rows), dtype=np.bool_)
    is_open[
        with_contour[
            _cosines(cuts, middles.of(with_contour), source, own_nearest) > MIN_SAME_COSINE
        ]
    ] = False
    rows, middles = rows[is_open], middles.of(np.flatnonzero(is_open))
    all_nearest = nearest_at_height(middles, None, source, limits)[0]
    suspect = np.zeros(len(cuts.contour), dtype=np.bool_)
    suspect[rows[_cosines(cuts, middles, source, all_nearest) < -MIN_SAME_COSINE]] = True
    if suspect.any():
        pairs = near_pairs(cuts, suspect, source, limits, sample_mm)
        trips = encloses_area(source.cuts, limits[0])[source.contour_of(pairs.move)]
        yield from reversal_findings(pairs, reversed_samples(pairs, trips, limits))


def _same_direction(cuts: CutMoves, source: CutMoves, rows: Ints, row_from: Indices) -> Bools:
    """Return the mask (J,) of rows whose chord has the direction of the chord of the row they came
    from; False for full circles."""
    is_same = np.empty(len(rows), dtype=np.bool_)
    for low in range(0, len(rows), ROWS_AT_ONCE):
        batch = rows[low : low + ROWS_AT_ONCE]
        chords, other = (
            (path.end.take(side_rows, axis=0) - path.starts_of(side_rows))[:, :2]
            for path, side_rows in ((cuts.toolpath, batch), (source.toolpath, row_from[batch]))
        )
        lengths = np.hypot(*chords.T) * np.hypot(*other.T)
        is_same[low : low + len(batch)] = dot(chords, other) > MIN_SAME_COSINE * lengths
    return is_same


def _cosines(
    cuts: CutMoves, samples: CutSamples, other_moves: MoveIndex, nearest: NearestMoves
) -> Floats:
    """Return (S,) the cosine of the angle between the move of each sample and the move of the
    other side nearest to it; 0 if none was found."""
    cosine = np.zeros(len(samples.points))
    with_move = np.flatnonzero(nearest.segment >= 0)
    part, segments = samples.of(with_move), nearest.segment[with_move]
    heading = headings(cuts.segments, part.segment, part.share)
    share = other_moves.shares(part.points, segments)
    cosine[with_move] = (heading * headings(other_moves.cuts.segments, segments, share)).sum(
        axis=1
    )
    return cosine


class NearPairs(Struct, eq=False):
    """S samples on cuts of one side, and all P pairs of a sample (`point`) with a `move` of the
    other side near it; `cosine` (P,) of the angle between both. `distance` (S,) mm from each
    sample to the nearest move, inf where none is near."""

    cuts: CutMoves
    other_moves: MoveIndex
    samples: CutSamples
    point: Ints
    move: Ints
    cosine: Floats
    distance: Floats

    @property
    def off_mm(self) -> float:
        """The largest distance of a sample from the other side, of those that are near it, mm."""
        return float(self.distance[np.isfinite(self.distance)].max(initial=0.0))

    @property
    def rows(self) -> Indices:
        """(S,) the row of each sample."""
        return self.cuts.row[self.samples.segment]

    def rows_along(self) -> Ints:
        """Return (P, 2) pairs of rows of both sides that lie on each other and have the same
        direction."""
        along = self.cosine > MIN_SAME_COSINE
        other_rows = self.other_moves.cuts.row[self.move[along]]
        return distinct_rows(np.column_stack([self.rows[self.point[along]], other_rows]))


def near_pairs(
    cuts: CutMoves, rows: Bools, other_moves: MoveIndex, limits: Limits, sample_mm: float
) -> NearPairs:
    """Pair samples on the rows in the mask `rows` (N,) of one side, about `sample_mm` apart, with
    all moves of the other side within the limits."""
    samples = _with_ends(cuts, sample_cuts(cuts, sample_mm, np.flatnonzero(rows[cuts.row])))
    point, move, distance = other_moves.pairs_within(samples.points, samples.z, limits)
    nearest_mm = np.full(len(samples.points), np.inf)
    np.minimum.at(nearest_mm, point, distance)
    heading = headings(cuts.segments, samples.segment[point], samples.share[point])
    share = other_moves.shares(samples.points[point], move)
    other_heading = headings(other_moves.cuts.segments, move, share)
    cosine = (heading * other_heading).sum(axis=1)
    return NearPairs(cuts, other_moves, samples, point, move, cosine, nearest_mm)


def _with_ends(cuts: CutMoves, samples: CutSamples) -> CutSamples:
    """Return the samples with the last one of each row moved to the programmed end, since the end
    of an arc need not lie on the circle of its start."""
    row = cuts.row[samples.segment]
    last = (samples.segment == cuts.first[row + 1] - 1) & (samples.share == 1.0)
    points = np.where(last[:, None], cuts.toolpath.end[row, :2], samples.points)
    return replace(samples, points=points)


def headings(segments: Segments, indices: Ints, share: Floats) -> Floats:
    """Return the unit directions (J, 2) of the segments `indices` at the shares `share` of their
    lengths."""
    chord = (segments.end - segments.start)[indices]
    # The tangent turns evenly from half the sweep before the chord to half the sweep behind it.
    turn = (share - 0.5) * segments.sweep[indices]
    angle = np.arctan2(chord[:, 1], chord[:, 0]) + turn
    return np.column_stack([np.cos(angle), np.sin(angle)])


def reversed_samples(compared: NearPairs, round_trip: Bools, limits: Limits) -> Ints:
    """Return the indices of samples on moves that the other side cuts only in the opposite
    direction. Only contours that enclose an area count (`round_trip` (P,): the mask of pairs on
    such contours)."""
    cuts, samples, count = compared.cuts, compared.samples, len(compared.distance)
    is_along = np.zeros(count, dtype=np.bool_)
    is_along[compared.point[compared.cosine > MIN_SAME_COSINE]] = True
    long = MIN_DIRECTION_LIMITS * limits[0]
    is_other_long = segment_lengths(compared.other_moves.cuts.segments)[compared.move] > long
    is_against = np.zeros(count, dtype=np.bool_)
    is_against[
        compared.point[(compared.cosine < -MIN_SAME_COSINE) & round_trip & is_other_long]
    ] = True
    is_long = segment_lengths(cuts.segments)[samples.segment] > long
    is_inner = is_long & (samples.share > 0.0) & (samples.share < 1.0)
    return np.flatnonzero(is_against & ~is_along & is_inner)


def reversal_findings(compared: NearPairs, reversed_rows: Ints) -> Iterator[Finding]:
    """Yield a CUT_OTHER_WAY finding for each contour that is cut in the opposite direction."""
    cuts = compared.cuts
    rows = compared.rows[reversed_rows]
    first = np.unique(cuts.contour[rows], return_index=True)[1]
    for place, other_count in first_items(first.tolist()):
        row = int(rows[place])
        place_words = at_point(compared.samples.points[reversed_rows[place]])
        yield CUT_OTHER_WAY(
            where=f"{block_name(cuts.toolpath, row)} near {place_words}", more=other_count
        )


# Points and blocks as findings name them, and how many findings are listed.

FINDINGS_PER_CODE = 20
"""At most this many findings of one kind are listed; the last of them says how many more there
are."""


def at_point(point: Floats | tuple[float, float]) -> str:
    """Return a point as text: `(1.234, 5.678) mm`."""
    return f"({float(point[0]):.3f}, {float(point[1]):.3f}) mm"


def block_name(toolpath: Toolpath, row: int) -> str:
    """Return `block 12` (counted from 1), or `move 12` if no program was read."""
    return block_of(toolpath, row) if toolpath.block[row] >= 0 else f"move {row + 1}"


Item = TypeVar("Item")


def first_items(items: Sequence[Item]) -> Iterator[tuple[Item, int]]:
    """Yield the first `FINDINGS_PER_CODE` items, with the number of items left out: 0 for all but
    the last one."""
    shown = items[:FINDINGS_PER_CODE]
    for number, item in enumerate(shown, start=1):
        yield item, len(items) - len(shown) if number == len(shown) else 0
