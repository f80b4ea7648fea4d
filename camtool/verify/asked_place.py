"""Where a program cuts, against where it was asked to cut, at the resolution of its dialect.

Moves that both sides hold need no looking at. All others are sampled. A sample of the program must
lie near a written or a wanted move at its height; a sample of the written program near a decoded
move, or what it was written from must. The way round is compared wherever moves of both sides lie
on each other.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.measure import point_at
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Ints
from camtool.toolpath.rapids import STOCK_TOP_MM
from camtool.verify.asked import Alike, Asked, Side
from camtool.verify.compare import Target
from camtool.verify.cuts import Bools
from camtool.verify.direction import (
    Compared,
    Limits,
    compared,
    other_way,
    round_trips,
    turned,
)
from camtool.verify.holes import contours_drilled, hole_findings
from camtool.verify.match import nearest_at_height
from camtool.verify.places import and_more, at_point, block_name


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
    there = compared(mine.cuts, ~alike.in_written, other.target, limits, sample_mm)
    back = compared(other.cuts, ~alike.in_decoded, mine.target, limits, sample_mm)
    _also_near(there, wanted.target, limits)
    _also_behind(back, wanted.target, mine.target, limits)
    trips = round_trips(other.cuts, limits[0])
    written = other.target.contour
    turns = turned(there, trips[written[there.move]], limits)
    turns_back = turned(back, trips[written[back.samples.segment[back.point]]], limits)
    findings = (
        *_beside(back, undrilled, limits, Code.CONTOUR_MISSING),
        *_beside(there, drilled, limits, Code.EXTRA_CUT),
        *hole_findings(mine.holes, other.holes, limits, (mine_stand, other_stand)),
        *_plunges(mine, (other, wanted), alike, limits),
        *_again(mine, other, alike, limits),
        *(other_way(there, turns) if len(turns) else other_way(back, turns_back)),
    )
    return Place(findings, max(there.off_mm, back.off_mm), there.rows_along())


def _also_near(there: Compared, wanted: Target, limits: Limits) -> None:
    """What is near a wanted move is as asked, though the writer would have said it otherwise."""
    rest = np.flatnonzero(np.isinf(there.distance))
    point, _, distance = wanted.within(there.samples.points[rest], there.samples.z[rest], limits)
    np.minimum.at(there.distance, rest[point], distance)


def _also_behind(back: Compared, wanted: Target, decoded: Target, limits: Limits) -> None:
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


def _beside(found: Compared, drilled: Bools, limits: Limits, code: Code) -> Iterator[Finding]:
    """One finding for each contour of which a part lies where the other side cuts nothing; but
    for contours that a hole stands for, and slopes that are hardly below the stock top."""
    cuts, samples = found.cuts, found.samples
    contour = cuts.contour[found.rows]
    judged = ~cuts.slopes[samples.segment] | (samples.z < STOCK_TOP_MM - limits[1])
    bad = np.flatnonzero(np.isinf(found.distance) & judged & ~drilled[contour])
    if len(bad) == 0:
        return
    near, wrong_depth = nearest_at_height(samples.of(bad), None, Target(found.others), limits)
    order = np.lexsort((bad, -near.distance, contour[bad]))
    listed = order[np.flatnonzero(np.diff(contour[bad][order], prepend=-1))]
    for number, worst in enumerate(listed.tolist()):
        sample, nearest = int(bad[worst]), int(near.segment[worst])
        extra, known = code == Code.EXTRA_CUT, nearest >= 0
        one, which = (cuts, samples.segment[sample]) if extra else (found.others, nearest)
        at, more = at_point(samples.points[sample]), and_more(number, len(listed), "contours")
        block = block_name(one.toolpath, int(one.segments.path[which])) if extra or known else ""
        yield Finding(
            code,
            Severity.ERROR,
            _words(code, near.distance[worst], wrong_depth=bool(wrong_depth[worst])) + more,
            where=f"{block} near {at}".strip(),
            measured=float(near.distance[worst]) if known else None,
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


def _plunges(
    mine: Side, others: tuple[Side, Side], alike: Alike, limits: Limits
) -> Iterator[Finding]:
    """EXTRA_CUT for feeds straight down to where nothing was asked to be cut; holes, which are
    compared as such, are left out."""
    import shapely

    toolpath = mine.toolpath
    rows = np.flatnonzero(mine.plunges & ~alike.in_written)
    rows = rows[~_on(toolpath.end[rows, :2], mine.holes.at)]
    fine = np.zeros(len(rows), dtype=np.bool_)
    for other in others:
        ends = toolpath.end[rows]
        fine[other.target.within(ends[:, :2], ends[:, 2], limits)[0]] = True
        deep = other.toolpath.end[other.plunges]
        tree = shapely.STRtree(shapely.points(deep[:, :2]))
        places = shapely.points(ends[:, :2])
        one, plunge = tree.query(places, predicate="dwithin", distance=limits[0])
        fine[one[deep[plunge, 2] <= ends[one, 2] + limits[1]]] = True
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
    for rank, place in enumerate(bad.tolist()):
        row, more = int(rows[place]), and_more(rank, len(bad), "moves")
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
