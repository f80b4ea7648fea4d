"""Is everything cut that was wanted, and nothing else? And which row belongs to which contour?

Decoded moves are sampled and compared with the wanted moves: that gives the error of rounding,
extra cuts, and for each decoded row the wanted contour that it belongs to. Wanted moves are
sampled and compared with the decoded ones: that gives what is missing. Only moves at the same
height are compared (within the coverage tolerance), so a lost pass or a wrong depth shows.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import Floats
from camtool.verify.compare import ANY_CONTOUR, Found, Groups, Target
from camtool.verify.cuts import Bools, CutMoves, Samples, sample_cuts
from camtool.verify.figures import Figure
from camtool.verify.match import SAMPLES_PER_GROUP, Goal, Match, match_contours, match_rows
from camtool.verify.places import and_more, at_point, block_name
from camtool.verify.runs import run_offsets


@dataclass(frozen=True, eq=False)
class Coverage:
    """Rows matched, the error of rounding, and CONTOUR_MISSING and EXTRA_CUT findings."""

    match: Match
    rounding: Figure
    findings: tuple[Finding, ...]


def cover(decoded: Target, goal: Goal, spacing_mm: float) -> Coverage:
    """Compare decoded and wanted cutting moves both ways, on samples about `spacing_mm` apart."""
    cuts, wanted, limit_mm = decoded.cuts, goal.target, goal.limit_mm
    samples = sample_cuts(cuts, spacing_mm)
    found, wrong_depth = _nearest(cuts, samples, wanted, limit_mm)
    extra = tuple(_extra_cuts(cuts, samples, found, wrong_depth, limit_mm))
    belongs = match_contours(cuts, samples, found, goal)
    rounding = Figure()
    real = np.isfinite(found.distance)
    rows = cuts.segments.path[samples.segment]
    rounding.add(found.distance[real], samples.points[real], rows[real])
    back = sample_cuts(wanted.cuts, spacing_mm)
    found_back, wrong_back = _nearest(wanted.cuts, back, decoded, limit_mm)
    missing = _missing(wanted.cuts, back, found_back, wrong_back, limit_mm)
    match = match_rows(cuts, samples, belongs, found, goal)
    return Coverage(match, rounding, (*missing, *extra))


def _nearest(
    cuts: CutMoves, samples: Samples, target: Target, limit_mm: float
) -> tuple[Found, Bools]:
    """Nearest target move at the same height; where there is none (second item true), at any."""
    offsets = run_offsets(samples.segment, SAMPLES_PER_GROUP)
    z = cuts.z[samples.segment[offsets[:-1]]] + np.array([-limit_mm, limit_mm])
    count = len(offsets) - 1
    margin, contour = np.full(count, limit_mm), np.full(count, ANY_CONTOUR)
    found = target.nearest(samples.points, Groups(offsets, margin, contour, z))
    wrong_depth = np.isinf(found.distance)
    if wrong_depth.any():
        rest = np.flatnonzero(wrong_depth)
        parts = run_offsets(samples.segment[rest], SAMPLES_PER_GROUP)
        any_z = np.tile([-np.inf, np.inf], (len(parts) - 1, 1))
        groups = Groups(parts, margin[: len(parts) - 1], contour[: len(parts) - 1], any_z)
        flat = target.nearest(samples.points[rest], groups)
        found.distance[rest], found.segment[rest] = flat.distance, flat.segment
    return found, wrong_depth


def _extra_cuts(
    cuts: CutMoves, samples: Samples, found: Found, wrong_depth: Bools, limit_mm: float
) -> Iterator[Finding]:
    bad = wrong_depth | (found.distance > limit_mm)
    listed = list(_by_contour(cuts, samples, found.distance, bad))
    for number, (_, worst, share) in enumerate(listed):
        row = int(cuts.segments.path[samples.segment[worst]])
        at = at_point(samples.points[worst])
        how = _away(found.distance[worst], "wanted", wrong_depth=bool(wrong_depth[worst]))
        yield Finding(
            Code.EXTRA_CUT,
            Severity.ERROR,
            f"{share:.0%} of a cut was not wanted: {how}" + and_more(number, len(listed), "cuts"),
            where=f"{block_name(cuts.toolpath, row)} near {at}",
            measured=_finite(found.distance[worst]),
            limit=limit_mm,
            unit="mm",
        )
        if and_more(number, len(listed), "cuts"):
            return


def _missing(
    cuts: CutMoves, samples: Samples, found: Found, wrong_depth: Bools, limit_mm: float
) -> Iterator[Finding]:
    bad = wrong_depth | (found.distance > limit_mm)
    listed = list(_by_contour(cuts, samples, found.distance, bad))
    for number, (contour, worst, share) in enumerate(listed):
        row = int(cuts.segments.path[samples.segment[worst]])
        source = cuts.toolpath.text(row)
        name = f"contour {contour + 1}" + (f" ({source})" if source else "")
        how = _away(found.distance[worst], "decoded", wrong_depth=bool(wrong_depth[worst]))
        yield Finding(
            Code.CONTOUR_MISSING,
            Severity.ERROR,
            f"{share:.0%} of {name} is not cut by the program: {how}"
            + and_more(number, len(listed), "contours"),
            where=f"{name} near {at_point(samples.points[worst])}",
            measured=_finite(found.distance[worst]),
            limit=limit_mm,
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
