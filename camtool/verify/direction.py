"""Which way round a program cuts, wherever its moves lie on those that it is compared with."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.polylines import Floats, Ints, Segments
from camtool.verify.compare import Target
from camtool.verify.cuts import Bools, CutMoves, Samples, sample_cuts
from camtool.verify.loops import NO_LOOP, loops
from camtool.verify.match import nearest_at_height
from camtool.verify.places import and_more, at_point, block_name

ALONG = 0.7
"""Two moves on each other run the same way when the cosine between them is above this, and the
other way when it is below minus this; between, one crosses the other."""

LONG_ENOUGH = 1.5
"""Moves shorter than so many times what they may be apart have no sure direction: their ends are
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
