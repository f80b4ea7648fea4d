"""Is everything cut that was wanted, and nothing else? And which row belongs to which contour?

Decoded moves are sampled and compared with the wanted moves: that gives the error of rounding,
extra cuts, and for each decoded row the wanted contour that it belongs to. Wanted moves are
sampled and compared with the decoded ones: that gives what is missing. Only moves at the height of
the sample are compared (a slope: at the place nearest to it), so a lost pass or a wrong depth
shows. How far heights may differ leaves room for slopes that a machine makes in small steps.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import Floats
from camtool.toolpath.rapids import STOCK_TOP_MM
from camtool.verify.compare import Found, Target
from camtool.verify.cuts import Bools, CutMoves, Samples, sample_cuts
from camtool.verify.figures import Figure
from camtool.verify.match import Goal, Match, match_contours, match_rows, nearest_at_height
from camtool.verify.places import and_more, at_point, block_name


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
class _Compared:
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
    there = _Compared(cuts, samples, found, wrong_depth, drilled.decoded)
    extra = tuple(_extra_cuts(there, goal))
    belongs = match_contours(cuts, samples, found, goal)
    rounding = Figure()
    real = np.isfinite(found.distance)
    rows = cuts.segments.path[samples.segment]
    rounding.add(found.distance[real], samples.points[real], rows[real])
    back = sample_cuts(wanted.cuts, spacing_mm)
    found_back, wrong_back = nearest_at_height(back, None, decoded, limits)
    missing = _missing(_Compared(wanted.cuts, back, found_back, wrong_back, drilled.wanted), goal)
    match = match_rows(cuts, samples, belongs, found, goal)
    return Coverage(match, rounding, (*missing, *extra))


def _extra_cuts(there: _Compared, goal: Goal) -> Iterator[Finding]:
    cuts, samples, distance = there.cuts, there.samples, there.found.distance
    listed = list(_by_contour(cuts, samples, distance, there.bad(goal)))
    for number, (_, worst, share) in enumerate(listed):
        row = int(cuts.segments.path[samples.segment[worst]])
        at = at_point(samples.points[worst])
        how = _away(distance[worst], "wanted", wrong_depth=bool(there.wrong_depth[worst]))
        yield Finding(
            Code.EXTRA_CUT,
            Severity.ERROR,
            f"{share:.0%} of a cut was not wanted: {how}" + and_more(number, len(listed), "cuts"),
            where=f"{block_name(cuts.toolpath, row)} near {at}",
            measured=_finite(distance[worst]),
            limit=goal.limit_mm,
            unit="mm",
        )
        if and_more(number, len(listed), "cuts"):
            return


def _missing(back: _Compared, goal: Goal) -> Iterator[Finding]:
    cuts, samples, distance = back.cuts, back.samples, back.found.distance
    listed = list(_by_contour(cuts, samples, distance, back.bad(goal)))
    for number, (contour, worst, share) in enumerate(listed):
        row = int(cuts.segments.path[samples.segment[worst]])
        source = cuts.toolpath.text(row)
        name = f"contour {contour + 1}" + (f" ({source})" if source else "")
        how = _away(distance[worst], "decoded", wrong_depth=bool(back.wrong_depth[worst]))
        yield Finding(
            Code.CONTOUR_MISSING,
            Severity.ERROR,
            f"{share:.0%} of {name} is not cut by the program: {how}"
            + and_more(number, len(listed), "contours"),
            where=f"{name} near {at_point(samples.points[worst])}",
            measured=_finite(distance[worst]),
            limit=goal.limit_mm,
            unit="mm",
        )
        if and_more(number, len(listed), "contours"):
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


def _away(distance: float, side: str, *, wrong_depth: bool) -> str:
    if not np.isfinite(distance):
        return f"there are no {side} cutting moves at all"
    depth = ", and none is at its depth" if wrong_depth else ""
    return f"up to {distance:.3f} mm from every {side} cutting move{depth}"


def _finite(distance: float) -> float | None:
    return float(distance) if np.isfinite(distance) else None
