"""Where a program cuts, against where it was asked to cut, at the resolution of its dialect.

Moves that both sides hold need no looking at. All others are sampled. A sample of the program must
lie near a written or a wanted move at its height; a sample of the written program near a decoded
move, or what it was written from must. The way round is compared wherever moves of both sides lie
on each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints, Segments
from camtool.toolpath.cleared import STOCK_TOP_MM
from camtool.verify.asked import Alike, Asked, Side
from camtool.verify.compare import Target
from camtool.verify.cuts import Bools, CutMoves, Samples, sample_cuts
from camtool.verify.holes import contours_drilled, hole_findings
from camtool.verify.match import nearest_at_height
from camtool.verify.places import and_more, at_point, block_name

ALONG = 0.7
"""Two moves on each other run the same way when the cosine between them is above this, and the
other way when it is below minus this; between, one crosses the other."""

LONG_ENOUGH = 4.0
"""Moves shorter than so many times what they may be apart have no sure direction."""

Limits = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Place:
    """Findings; the farthest that any cut is from what was asked, mm; `pairs` (P, 2): decoded
    rows that are not alike, each with a written row that it lies on and runs along."""

    findings: tuple[Finding, ...]
    off_mm: float
    pairs: Ints


def hold_place(
    mine: Side, other: Side, wanted: Side, alike: Alike, asked: Asked, sample_mm: float
) -> Place:
    """Compare `mine`, the decoded side, with `other`, the written one, both ways."""
    limits = asked.limits_mm
    drilled, other_stand = contours_drilled(mine.cuts, other.holes, limits)
    undrilled, mine_stand = contours_drilled(other.cuts, mine.holes, limits)
    there = _compared(mine, ~alike.in_written, other.target, limits, sample_mm)
    back = _compared(other, ~alike.in_decoded, mine.target, limits, sample_mm)
    _also_near(there, wanted.target, limits)
    _also_behind(back, wanted.target, mine.target, limits)
    round_trips = other.round_trips(limits[0])
    written = other.target.contour
    turned = _turned(there, round_trips[written[there.move]], limits)
    turned_back = _turned(back, round_trips[written[back.samples.segment[back.point]]], limits)
    findings = (
        *_beside(back, undrilled, limits, Code.CONTOUR_MISSING),
        *_beside(there, drilled, limits, Code.EXTRA_CUT),
        *hole_findings(mine.holes, other.holes, limits, (mine_stand, other_stand)),
        *_plunges(mine, (other, wanted), alike, limits),
        *_again(mine, other, alike, limits),
        *(_other_way(there, turned) if len(turned) else _other_way(back, turned_back)),
    )
    return Place(findings, max(there.off_mm, back.off_mm), there.rows_along())


@dataclass(eq=False)
class _Compared:
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


def _compared(
    side: Side, rows: Bools, target: Target, limits: Limits, sample_mm: float
) -> _Compared:
    """The cuts of these rows (N,) of a side against the cuts of the other one."""
    cuts = side.cuts
    samples = _with_ends(
        cuts, sample_cuts(cuts, sample_mm, np.flatnonzero(rows[cuts.segments.path]))
    )
    point, move, distance = target.within(samples.points, samples.z, limits)
    nearest = np.full(len(samples.points), np.inf)
    np.minimum.at(nearest, point, distance)
    here = _headings(cuts.segments, samples.segment[point], samples.share[point])
    share = target.table.shares(samples.points[point], move)
    there = _headings(target.cuts.segments, move, share)
    cosine = (here * there).sum(axis=1)
    return _Compared(cuts, target.cuts, samples, point, move, cosine, nearest)


def _with_ends(cuts: CutMoves, samples: Samples) -> Samples:
    """The same with the last sample of each row on the end that is programmed: an arc whose end
    is not on its circle passes it by."""
    row = cuts.segments.path[samples.segment]
    last = (samples.segment == cuts.first[row + 1] - 1) & (samples.share == 1.0)
    points = np.where(last[:, None], cuts.toolpath.end[row, :2], samples.points)
    return replace(samples, points=points)


def _headings(segments: Segments, which: Ints, share: Floats) -> Floats:
    """(J, 2) directions of segments `which` at parts `share` of their lengths."""
    chord = (segments.end - segments.start)[which]
    # The tangent turns evenly, by the sweep in all, about the direction of the chord.
    turn = (share - 0.5) * segments.sweep[which]
    angle = np.arctan2(chord[:, 1], chord[:, 0]) + turn
    return np.column_stack([np.cos(angle), np.sin(angle)])


def _also_near(there: _Compared, wanted: Target, limits: Limits) -> None:
    """What is near a wanted move is as asked, though the writer would have said it otherwise."""
    rest = np.flatnonzero(np.isinf(there.distance))
    point, _, distance = wanted.within(there.samples.points[rest], there.samples.z[rest], limits)
    np.minimum.at(there.distance, rest[point], distance)


def _also_behind(back: _Compared, wanted: Target, decoded: Target, limits: Limits) -> None:
    """What was written is there as well where the program cuts what it was written from."""
    rest = np.flatnonzero(np.isinf(back.distance))
    part = back.samples.of(rest)
    found, wrong_depth = nearest_at_height(part, None, wanted, limits)
    known = np.flatnonzero((found.segment >= 0) & ~wrong_depth)
    rest, move = rest[known], found.segment[known]
    share = wanted.table.shares(part.points[known], move)
    begin, end = wanted.cuts.ends_z[move].T
    places = point_at(wanted.cuts.segments, move, share)
    point, _, distance = decoded.within(places, begin + share * (end - begin), limits)
    np.minimum.at(back.distance, rest[point], distance)


def _beside(compared: _Compared, drilled: Bools, limits: Limits, code: Code) -> Iterator[Finding]:
    """One finding for each contour of which a part lies where the other side cuts nothing; but
    for contours that a hole stands for, and slopes that are hardly below the stock top."""
    cuts, samples = compared.cuts, compared.samples
    contour = cuts.contour[compared.rows]
    judged = ~cuts.slopes[samples.segment] | (samples.z < STOCK_TOP_MM - limits[1])
    bad = np.flatnonzero(np.isinf(compared.distance) & judged & ~drilled[contour])
    if len(bad) == 0:
        return
    found, wrong_depth = nearest_at_height(samples.of(bad), None, Target(compared.others), limits)
    order = np.lexsort((bad, -found.distance, contour[bad]))
    listed = order[np.flatnonzero(np.diff(contour[bad][order], prepend=-1))]
    for number, worst in enumerate(listed.tolist()):
        sample, nearest = int(bad[worst]), int(found.segment[worst])
        extra, known = code == Code.EXTRA_CUT, nearest >= 0
        one, which = (cuts, samples.segment[sample]) if extra else (compared.others, nearest)
        at, more = at_point(samples.points[sample]), and_more(number, len(listed), "contours")
        block = block_name(one.toolpath, int(one.segments.path[which])) if extra or known else ""
        yield Finding(
            code,
            Severity.ERROR,
            _words(code, found.distance[worst], wrong_depth=bool(wrong_depth[worst])) + more,
            where=f"{block} near {at}".strip(),
            measured=float(found.distance[worst]) if known else None,
            limit=limits[0],
            unit="mm",
        )
        if more:
            return


def _words(code: Code, distance: float, *, wrong_depth: bool) -> str:
    extra = code == Code.EXTRA_CUT
    if not np.isfinite(distance):
        return "nothing was asked to be cut" if extra else "the program cuts nothing"
    if wrong_depth:
        return (
            "a cut is at another depth than was asked"
            if extra
            else "what was asked is cut at another depth"
        )
    far = f"{distance:.4f} mm"
    return (
        f"a cut lies {far} beside what was asked" if extra else f"cut {far} beside what was asked"
    )


def _turned(compared: _Compared, round_trip: Bools, limits: Limits) -> Ints:
    """Samples on moves that the other side has in the other direction only; the ways of
    contours that come round alone (`round_trip` (P,) of each pair)."""
    cuts, samples, count = compared.cuts, compared.samples, len(compared.distance)
    same = np.zeros(count, dtype=np.bool_)
    same[compared.point[compared.cosine > ALONG]] = True
    against = np.zeros(count, dtype=np.bool_)
    against[compared.point[(compared.cosine < -ALONG) & round_trip]] = True
    length = segment_lengths(cuts.segments)[samples.segment]
    sure = (length > LONG_ENOUGH * limits[0]) & (samples.share > 0.0) & (samples.share < 1.0)
    return np.flatnonzero(against & ~same & sure)


def _other_way(compared: _Compared, turned: Ints) -> Iterator[Finding]:
    """One finding for each contour that is cut the other way round."""
    cuts = compared.cuts
    rows = compared.rows[turned]
    first = np.unique(cuts.contour[rows], return_index=True)[1]
    for number, place in enumerate(first.tolist()):
        row, more = int(rows[place]), and_more(number, len(first), "contours")
        at = at_point(compared.samples.points[turned[place]])
        yield Finding(
            Code.CUT_OTHER_WAY,
            Severity.ERROR,
            f"the cut runs the other way round than was asked{more}",
            where=f"{block_name(cuts.toolpath, row)} near {at}",
        )
        if more:
            return


def _plunges(
    mine: Side, others: tuple[Side, Side], alike: Alike, limits: Limits
) -> Iterator[Finding]:
    """EXTRA_CUT for feeds straight down to where nothing was asked to be cut; holes, which are
    compared as such, are left out."""
    toolpath = mine.toolpath
    rows = np.flatnonzero(mine.plunges & ~alike.in_written)
    rows = rows[~_on(toolpath.end[rows, :2], mine.holes.at)]
    fine = np.zeros(len(rows), dtype=np.bool_)
    for other in others:
        ends = toolpath.end[rows]
        fine[other.target.within(ends[:, :2], ends[:, 2], limits)[0]] = True
        deep = np.flatnonzero(other.plunges)
        for place, end in enumerate(ends):
            apart = np.hypot(*(other.toolpath.end[deep, :2] - end[:2]).T) <= limits[0]
            fine[place] |= bool(
                (apart & (other.toolpath.end[deep, 2] <= end[2] + limits[1])).any()
            )
    bad = rows[~fine]
    for number, row in enumerate(bad.tolist()):
        more = and_more(number, len(bad), "plunges")
        yield Finding(
            Code.EXTRA_CUT,
            Severity.ERROR,
            f"a plunge to {toolpath.end[row, 2]:.3f} mm was not asked for{more}",
            where=f"{block_name(toolpath, row)} at {at_point(toolpath.end[row])}",
            measured=float(toolpath.end[row, 2]),
            unit="mm",
        )
        if more:
            return


def _on(points: Floats, places: Floats) -> Bools:
    """(J,) which points (J, 2) are one of the places (K, 2)."""
    known = {tuple(place) for place in np.rint(places / POSITION_EPS_MM).astype(int).tolist()}
    mine = np.rint(points / POSITION_EPS_MM).astype(int).tolist()
    return np.array([tuple(point) in known for point in mine], dtype=np.bool_)


def _again(mine: Side, other: Side, alike: Alike, limits: Limits) -> Iterator[Finding]:
    """EXTRA_CUT for whole moves that are cut more often than was asked."""
    cutting = np.flatnonzero(mine.cuts.is_cut)
    number, first, counts = np.unique(
        alike.decoded[cutting], return_index=True, return_counts=True
    )
    asked = np.bincount(
        alike.written[other.cuts.is_cut], minlength=int(number.max(initial=-1)) + 1
    )[number]
    more_often = np.flatnonzero((counts > 1) & (counts > asked))
    rows = cutting[first[more_often]]
    segment = mine.cuts.first[rows]
    half = np.full(len(rows), 0.5)
    middle = point_at(mine.cuts.segments, segment, half)
    z = mine.cuts.ends_z[segment].mean(axis=1)
    point, move, _ = other.target.within(middle, z, limits)
    moves = np.column_stack([point, other.cuts.segments.path[move]])
    lie = np.bincount(np.unique(moves, axis=0)[:, 0], minlength=len(rows))
    bad = np.flatnonzero(counts[more_often] > np.maximum(lie, 1))
    for number_, place in enumerate(bad.tolist()):
        row, more = int(rows[place]), and_more(number_, len(bad), "moves")
        times, limit = int(counts[more_often][place]), max(int(lie[place]), 1)
        yield Finding(
            Code.EXTRA_CUT,
            Severity.ERROR,
            f"a move is cut {times} times, asked for {limit} times{more}",
            where=f"{block_name(mine.toolpath, row)} near {at_point(middle[place])}",
            measured=float(times),
            limit=float(limit),
            unit="times",
        )
        if more:
            return
