"""Is everything cut that was wanted, and nothing else: contours, holes, and the way round?

Decoded moves are sampled and compared with the wanted moves: that gives the error of rounding,
extra cuts, and for each decoded row the wanted contour that it belongs to. Wanted moves are
sampled and compared with the decoded ones: that gives what is missing. Only moves at the height of
the sample are compared (a slope: at the place nearest to it), so a lost pass or a wrong depth
shows. How far heights may differ leaves room for slopes that a machine makes in small steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import (
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
    Finding,
    Sentence,
)
from camtool.geometry.boxes import near_points
from camtool.geometry.measure import point_at, segment_boxes, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.rapids import STOCK_TOP_MM
from camtool.verification.cuts import (
    NO_LOOP,
    CutMoves,
    Samples,
    cutting_rows,
    loops,
    moved_lengths,
    sample_cuts,
)
from camtool.verification.figures import Figure
from camtool.verification.matching import (
    Goal,
    Match,
    match_contours,
    match_rows,
    nearest_at_height,
)
from camtool.verification.nearest import Found, Target


@dataclass(frozen=True, eq=False)
class Coverage:
    """Rows matched, the error of rounding, and CONTOUR_MISSING and EXTRA_CUT findings."""

    match: Match
    rounding: Figure
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class Drilled:
    """Contours, of those that are wanted and of the decoded ones, for which a hole of the other
    side stands: true (C,)."""

    wanted: Bools
    decoded: Bools


@dataclass(frozen=True, eq=False)
class _Sampled:
    """Samples of the cuts of one side with the nearest moves of the other; `drilled` as above."""

    cuts: CutMoves
    samples: Samples
    found: Found
    wrong_depth: Bools
    drilled: Bools

    def bad(self, goal: Goal) -> Bools:
        """(S,) true for samples that the other side does not cut. A slope that is hardly below
        the stock top may be a flat move upon it, which cuts nothing."""
        sloping = self.cuts.slopes[self.samples.segment]
        judged = ~sloping | (self.samples.z < STOCK_TOP_MM - goal.depth_mm)
        judged &= ~self.drilled[self.cuts.contour[self.cuts.segments.path[self.samples.segment]]]
        return np.asarray(judged & (self.wrong_depth | (self.found.distance > goal.limit_mm)))


def cover(decoded: Target, goal: Goal, spacing_mm: float, drilled: Drilled) -> Coverage:
    """Compare decoded and wanted cutting moves both ways, on samples about `spacing_mm` apart."""
    cuts, wanted, limits = decoded.cuts, goal.target, (goal.limit_mm, goal.depth_mm)
    samples = sample_cuts(cuts, spacing_mm)
    found, wrong_depth = nearest_at_height(samples, None, wanted, limits)
    there = _Sampled(cuts, samples, found, wrong_depth, drilled.decoded)
    extra = tuple(_extra_cuts(there, goal))
    belongs = match_contours(cuts, samples, found, goal)
    rounding = Figure()
    real = np.isfinite(found.distance)
    rows = cuts.segments.path[samples.segment]
    rounding.add(found.distance[real], samples.points[real], rows[real])
    back = sample_cuts(wanted.cuts, spacing_mm)
    found_back, wrong_back = nearest_at_height(back, None, decoded, limits)
    missing = _missing(_Sampled(wanted.cuts, back, found_back, wrong_back, drilled.wanted), goal)
    match = match_rows(cuts, samples, belongs, found, goal)
    return Coverage(match, rounding, (*missing, *extra))


_MISSING = CONTOUR_MISSING, CONTOUR_MISSING_AT_DEPTH, CONTOUR_MISSING_NO_CUTS
_EXTRA = EXTRA_CUT, EXTRA_CUT_AT_DEPTH, EXTRA_CUT_NONE_WANTED


def _extra_cuts(there: _Sampled, goal: Goal) -> Iterator[Finding]:
    cuts, samples, distance = there.cuts, there.samples, there.found.distance
    listed = list(_by_contour(cuts, samples, distance, there.bad(goal)))
    for number, (_, worst, share) in enumerate(listed):
        row = int(cuts.segments.path[samples.segment[worst]])
        at = at_point(samples.points[worst])
        wrong_depth, more = bool(there.wrong_depth[worst]), and_more(number, len(listed))
        yield _away(distance[worst], wrong_depth, _EXTRA)(
            where=f"{block_name(cuts.toolpath, row)} near {at}",
            measured=_finite(distance[worst]),
            limit=goal.limit_mm,
            share=share,
            more=more,
        )
        if more:
            return


def _missing(back: _Sampled, goal: Goal) -> Iterator[Finding]:
    cuts, samples, distance = back.cuts, back.samples, back.found.distance
    listed = list(_by_contour(cuts, samples, distance, back.bad(goal)))
    for number, (contour, worst, share) in enumerate(listed):
        row = int(cuts.segments.path[samples.segment[worst]])
        source = cuts.toolpath.text(row)
        name = f"contour {contour + 1}" + (f" ({source})" if source else "")
        wrong_depth, more = bool(back.wrong_depth[worst]), and_more(number, len(listed))
        yield _away(distance[worst], wrong_depth, _MISSING)(
            where=f"{name} near {at_point(samples.points[worst])}",
            measured=_finite(distance[worst]),
            limit=goal.limit_mm,
            share=share,
            contour=name,
            more=more,
        )
        if more:
            return


def _by_contour(
    cuts: CutMoves, samples: Samples, distance: Floats, bad: Bools
) -> Iterator[tuple[int, int, float]]:
    """(contour, sample with the largest distance, share of its samples) where any is bad."""
    contour = cuts.contour[cuts.segments.path[samples.segment]]
    all_of = np.bincount(contour, minlength=cuts.contour_count)
    rows = np.flatnonzero(bad)
    order = rows[np.lexsort((rows, -distance[rows], contour[rows]))]
    first = np.flatnonzero(np.diff(contour[order], prepend=-1))
    counts = np.diff(np.append(first, len(order)))
    for worst, count in zip(order[first], counts, strict=True):
        which = int(contour[worst])
        yield which, int(worst), float(count / all_of[which])


def _away(
    distance: float, wrong_depth: bool, sentences: tuple[Sentence, Sentence, Sentence]
) -> Sentence:
    """Which of the sentences is to be said: away, away at this depth, or nothing there."""
    away, at_depth, nothing = sentences
    if not np.isfinite(distance):
        return nothing
    return at_depth if wrong_depth else away


def _finite(distance: float) -> float | None:
    return float(distance) if np.isfinite(distance) else None


# Drilled holes: are all there, as deep as wanted, and no others?
#
# A hole is a place where the tool is fed straight down below the stock top and back, in as many
# pecks as it likes, without any cut in XY before it leaves the place: no contour begins with it.


@dataclass(frozen=True, eq=False)
class Holes:
    """H holes of `toolpath`: where, (H, 2) mm, the height of their bottoms (H,) mm, and the row
    (H,) that reached it first."""

    toolpath: Toolpath
    at: Floats
    bottom_mm: Floats
    row: Ints

    def __len__(self) -> int:
        return len(self.row)


def holes_of(toolpath: Toolpath) -> Holes:
    """The holes that a toolpath drills, in order."""
    flat = toolpath.is_motion & (moved_lengths(toolpath) > POSITION_EPS_MM)
    flat |= toolpath.kind == Kind.HOME_XY
    cutting = cutting_rows(toolpath, flat_cuts=False)
    # A stay at one place lies between two moves in XY; neither may cut.
    stay = np.cumsum(flat)
    movers = np.flatnonzero(flat)
    cut = np.zeros(len(movers) + 2, dtype=np.bool_)
    cut[1:-1] = cutting[movers]
    running = np.cumsum(toolpath.kind == Kind.END) == 0
    down = toolpath.is_feed & ~flat & (toolpath.end[:, 2] < STOCK_TOP_MM - POSITION_EPS_MM)
    rows = np.flatnonzero(down & running & ~cut[stay] & ~cut[stay + 1])
    order = rows[np.lexsort((rows, toolpath.end[rows, 2], stay[rows]))]
    deepest = order[np.flatnonzero(np.diff(stay[order], prepend=-1))]
    return Holes(toolpath, toolpath.end[deepest, :2], toolpath.end[deepest, 2], deepest)


def contours_drilled(
    cuts: CutMoves, holes: Holes, limits_mm: tuple[float, float]
) -> tuple[Bools, Bools]:
    """(C,) which contours a hole stands for, and (H,) which holes do: all of the contour lies
    within the first limit of the hole, and is as deep within the second.

    A contour smaller than what a dialect can say comes out as a plunge, and cuts the same.
    """
    drilled = np.zeros(cuts.contour_count, dtype=np.bool_)
    stands = np.zeros(len(holes), dtype=np.bool_)
    if not len(holes) or not len(drilled):
        return drilled, stands
    contour = cuts.contour[cuts.segments.path]
    begin = np.flatnonzero(np.diff(contour, prepend=-1))
    boxes = segment_boxes(cuts.segments)
    low = np.minimum.reduceat(boxes[:, :2], begin)
    high = np.maximum.reduceat(boxes[:, 2:], begin)
    bottom = np.minimum.reduceat(cuts.z[:, 0], begin)
    room = limits_mm[0] - 0.5 * np.hypot(*(high - low).T)
    tiny = np.flatnonzero(room >= 0.0)
    one, hole = near_points(0.5 * (low + high)[tiny], holes.at, room[tiny])
    same = np.abs(bottom[tiny[one]] - holes.bottom_mm[hole]) <= limits_mm[1]
    drilled[contour[begin[tiny[one[same]]]]] = True
    stands[hole[same]] = True
    return drilled, stands


_MISSING_HOLES = CONTOUR_MISSING_HOLE, CONTOUR_MISSING_HOLE_DEPTH
_EXTRA_HOLES = EXTRA_CUT_HOLE, EXTRA_CUT_HOLE_DEPTH


def hole_findings(
    decoded: Holes,
    wanted: Holes,
    limits_mm: tuple[float, float],
    stand: tuple[Bools, Bools],
) -> tuple[Finding, ...]:
    """CONTOUR_MISSING for holes that the program does not drill, EXTRA_CUT for others: within the
    limits in XY and in height. `stand`: which decoded and which wanted holes stand for contours
    of the other side, as `contours_drilled` tells."""
    return (
        *_unpaired(wanted, decoded, limits_mm, stand[1], _MISSING_HOLES),
        *_unpaired(decoded, wanted, limits_mm, stand[0], _EXTRA_HOLES),
    )


def _unpaired(
    holes: Holes,
    others: Holes,
    limits_mm: tuple[float, float],
    stand: Bools,
    sentences: tuple[Sentence, Sentence],
) -> Iterator[Finding]:
    """A finding for each hole without another one: `sentences` where there is none at its place,
    and where there is one of another depth."""
    none, other_depth = sentences
    here, paired = _paired(holes, others, limits_mm)
    alone = np.flatnonzero(~paired & ~stand).tolist()
    for number, hole in enumerate(alone):
        more = and_more(number, len(alone))
        row = int(holes.row[hole])
        yield (other_depth if here[hole] else none)(
            where=f"{block_name(holes.toolpath, row)} at {at_point(holes.at[hole])}",
            measured=STOCK_TOP_MM - holes.bottom_mm[hole],
            more=more,
        )
        if more:
            return


def _paired(holes: Holes, others: Holes, limits_mm: tuple[float, float]) -> tuple[Bools, Bools]:
    """(H,), (H,) which holes have another one at their place, and which one as deep too."""
    here, same = np.zeros(len(holes), dtype=np.bool_), np.zeros(len(holes), dtype=np.bool_)
    mine, theirs = near_points(holes.at, others.at, limits_mm[0])
    here[mine] = True
    deep = np.abs(holes.bottom_mm[mine] - others.bottom_mm[theirs]) <= limits_mm[1]
    same[mine[deep]] = True
    return here, same


# Which way round a program cuts, wherever its moves lie on those that it is compared with.

ALONG = 0.7
"""Two moves that coincide have the same direction when the cosine between them is above this, and
opposite directions when it is below minus this; between these, they cross."""

LONG_ENOUGH = 1.5
"""Moves shorter than this many times their tolerance have no certain direction: their ends are
rounded by up to 1.41 units in all, which turns a longer one by no more than 32 degrees."""

Limits = tuple[float, float]


def round_trips(cuts: CutMoves, gap_mm: float) -> Bools:
    """(C,) contours that come back to where they were round some area: the others (open paths, to
    and fro) may be cut from either end."""
    return np.asarray(loops(cuts, gap_mm)[:, 0] != NO_LOOP)


def cut_other_way(
    decoded: Target, said: Target, limits: Limits, sample_mm: float
) -> Iterator[Finding]:
    """CUT_OTHER_WAY for contours of a program that run against those that it was written from."""
    cuts = decoded.cuts
    rows = cuts.rows
    here, half = cuts.first[rows], np.full(len(rows), 0.5)
    z = cuts.ends_z[here].mean(axis=1)
    middles = Samples(point_at(cuts.segments, here, half), here, z, half)
    there = nearest_at_height(middles, None, said, limits)[0].segment
    known = np.flatnonzero(there >= 0)
    rows, here, there = rows[known], here[known], there[known]
    way = headings(cuts.segments, here, half[known])
    share = said.table.shares(middles.points[known], there)
    cosine = (way * headings(said.cuts.segments, there, share)).sum(axis=1)
    suspect = np.zeros(len(cuts.contour), dtype=np.bool_)
    suspect[rows[cosine < -ALONG]] = True
    if suspect.any():
        found = compared(cuts, suspect, said, limits, sample_mm)
        trips = round_trips(said.cuts, limits[0])[said.contour[found.move]]
        yield from other_way(found, turned(found, trips, limits))


@dataclass(eq=False)
class Compared:
    """Samples on some cuts of one side, and all pairs (`point`, `move`) of them with moves of the
    other side that are near; `cosine` (P,) between both. `distance` (S,) mm from the nearest
    one, inf where none is near."""

    cuts: CutMoves
    others: CutMoves
    samples: Samples
    point: Ints
    move: Ints
    cosine: Floats
    distance: Floats

    @property
    def off_mm(self) -> float:
        """The farthest sample from the other side, of those that are near."""
        return float(self.distance[np.isfinite(self.distance)].max(initial=0.0))

    @property
    def rows(self) -> Ints:
        """(S,) the row of each sample."""
        return self.cuts.segments.path[self.samples.segment]

    def rows_along(self) -> Ints:
        """(P, 2) rows of both sides that lie on each other and run the same way."""
        along = self.cosine > ALONG
        pairs = np.column_stack(
            [self.rows[self.point[along]], self.others.segments.path[self.move[along]]]
        )
        return np.unique(pairs, axis=0)


def compared(
    cuts: CutMoves, rows: Bools, target: Target, limits: Limits, sample_mm: float
) -> Compared:
    """The cuts of these rows (N,) of one side against the cuts of the other one, at samples about
    `sample_mm` apart; `limits`: how far "near" is in XY, and in height."""
    samples = _with_ends(
        cuts, sample_cuts(cuts, sample_mm, np.flatnonzero(rows[cuts.segments.path]))
    )
    point, move, distance = target.within(samples.points, samples.z, limits)
    nearest = np.full(len(samples.points), np.inf)
    np.minimum.at(nearest, point, distance)
    here = headings(cuts.segments, samples.segment[point], samples.share[point])
    share = target.table.shares(samples.points[point], move)
    there = headings(target.cuts.segments, move, share)
    cosine = (here * there).sum(axis=1)
    return Compared(cuts, target.cuts, samples, point, move, cosine, nearest)


def _with_ends(cuts: CutMoves, samples: Samples) -> Samples:
    """The same with the last sample of each row on the end that is programmed: an arc whose end
    is not on its circle passes it by."""
    row = cuts.segments.path[samples.segment]
    last = (samples.segment == cuts.first[row + 1] - 1) & (samples.share == 1.0)
    points = np.where(last[:, None], cuts.toolpath.end[row, :2], samples.points)
    return replace(samples, points=points)


def headings(segments: Segments, which: Ints, share: Floats) -> Floats:
    """(J, 2) directions of segments `which` at parts `share` of their lengths."""
    chord = (segments.end - segments.start)[which]
    # The tangent turns evenly, by the sweep in all, about the direction of the chord.
    turn = (share - 0.5) * segments.sweep[which]
    angle = np.arctan2(chord[:, 1], chord[:, 0]) + turn
    return np.column_stack([np.cos(angle), np.sin(angle)])


def turned(compared: Compared, round_trip: Bools, limits: Limits) -> Ints:
    """Samples on moves that the other side has in the other direction only; the ways of
    contours that come round alone (`round_trip` (P,) of each pair)."""
    cuts, samples, count = compared.cuts, compared.samples, len(compared.distance)
    same = np.zeros(count, dtype=np.bool_)
    same[compared.point[compared.cosine > ALONG]] = True
    long = LONG_ENOUGH * limits[0]
    there = segment_lengths(compared.others.segments)[compared.move] > long
    against = np.zeros(count, dtype=np.bool_)
    against[compared.point[(compared.cosine < -ALONG) & round_trip & there]] = True
    here = segment_lengths(cuts.segments)[samples.segment] > long
    sure = here & (samples.share > 0.0) & (samples.share < 1.0)
    return np.flatnonzero(against & ~same & sure)


def other_way(compared: Compared, turned: Ints) -> Iterator[Finding]:
    """One finding for each contour that is cut the other way round."""
    cuts = compared.cuts
    rows = compared.rows[turned]
    first = np.unique(cuts.contour[rows], return_index=True)[1]
    for number, place in enumerate(first.tolist()):
        row, more = int(rows[place]), and_more(number, len(first))
        at = at_point(compared.samples.points[turned[place]])
        yield CUT_OTHER_WAY(where=f"{block_name(cuts.toolpath, row)} near {at}", more=more)
        if more:
            return


# Places in words, for findings: points, blocks, and how many more there are.

FINDINGS_PER_CODE = 20
"""At most this many findings of one kind are listed; the last one counts all."""


def at_point(point: Floats | tuple[float, float]) -> str:
    """`(1.234, 5.678) mm`."""
    return f"({float(point[0]):.3f}, {float(point[1]):.3f}) mm"


def block_name(toolpath: Toolpath, row: int) -> str:
    """`block 12` (from 1, as people count), or `move 12` when no program was read."""
    block = int(toolpath.block[row])
    return f"block {block + 1}" if block >= 0 else f"move {row + 1}"


def and_more(number: int, total: int) -> int:
    """How many more there are than are listed, for the last one that is; 0 for all others."""
    return max(total - FINDINGS_PER_CODE, 0) if number == FINDINGS_PER_CODE - 1 else 0
