"""Figures that are sums and maxima over rows: contours, the worst moves, unreached ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.geometry.polylines import Floats, Ints
from camtool.toolpath.moves import Toolpath
from camtool.verify.cuts import CutMoves
from camtool.verify.match import Match
from camtool.verify.rows import RowFigures

END_STEPS = 1.5
"""A move has missed its end when the controller stands more than so many steps beside it: one
step of an interpolator's last rounding is none."""


@dataclass(frozen=True)
class ContourFigures:
    """The total error of one wanted contour, mm: the largest with its place and toolpath row, root
    of the mean square, and mean with sign (+ to the left of the way) without the fit; and the
    largest errors of interpolation, mechanics and fit on it."""

    contour: int
    row: int
    at_mm: tuple[float, float]
    max_mm: float
    rms_mm: float
    mean_mm: float
    interpolation_mm: float
    mechanics_mm: float
    fit_mm: float


def contour_figures(rows: RowFigures, match: Match) -> Iterator[ContourFigures]:
    """One for each wanted contour that some row with a known error belongs to."""
    known = np.flatnonzero((rows.known > 0) & (match.contour >= 0))
    if len(known) == 0:
        return
    of = match.contour[known]
    count = int(of.max()) + 1
    samples = np.bincount(of, rows.known[known], count)
    squares = np.bincount(of, rows.total_squares[known], count)
    sums = np.bincount(of, rows.total_sum[known], count)
    inner, lag, off = np.zeros((3, count))
    np.maximum.at(off, of, match.off_mm[known, 0])
    np.maximum.at(inner, of, rows.interpolation[known])
    np.maximum.at(lag, of, rows.mechanics[known])
    order = known[np.lexsort((known, -rows.total[known], of))]
    first = order[np.flatnonzero(np.diff(match.contour[order], prepend=-1))]
    for row in first.tolist():
        contour = int(match.contour[row])
        yield ContourFigures(
            contour=contour,
            row=row,
            at_mm=_place(rows.total_at[row]),
            max_mm=float(rows.total[row]),
            rms_mm=float(np.sqrt(squares[contour] / samples[contour])),
            mean_mm=float(sums[contour] / samples[contour]),
            interpolation_mm=float(inner[contour]),
            mechanics_mm=float(lag[contour]),
            fit_mm=float(off[contour]),
        )


def mean_error_mm(rows: RowFigures) -> float:
    """The mean of all total errors with their sign; NaN without any."""
    count = int(rows.known.sum())
    return float(rows.total_sum.sum()) / count if count else float("nan")


def worst_rows(rows: RowFigures, count: int) -> Ints:
    """The rows with the largest total errors, worst first, of equals the first."""
    known = np.flatnonzero(rows.known > 0)
    order = np.lexsort((known, -rows.total[known]))
    return np.asarray(known[order][:count])


@dataclass(frozen=True)
class MissedEnds:
    """How many moves the controller left beside their ends, and the farthest: its row (−1 when
    there is none), how far (mm)."""

    count: int
    row: int
    most_mm: float


def missed_ends(
    rows: RowFigures,
    held: Toolpath,
    steps_mm: tuple[float, float],
    without: tuple[int, ...] = (),
) -> MissedEnds:
    """Where the controller stood after each row against the end of it as `held`, but for the rows
    `without`; `steps_mm` are the coded steps of X and Y."""
    stood = np.isfinite(rows.commanded_end[:, 0])
    stood[list(without)] = False
    off = np.abs(np.where(stood[:, None], rows.commanded_end - held.end[:, :2], 0.0))
    missed = (off > END_STEPS * np.array(steps_mm)).any(axis=1)
    if not missed.any():
        return MissedEnds(0, -1, 0.0)
    far = np.where(missed, np.hypot(off[:, 0], off[:, 1]), 0.0)
    row = int(far.argmax())
    return MissedEnds(int(missed.sum()), row, float(far[row]))


def contour_name(cuts: CutMoves, contour: int) -> str:
    """`contour 3 (CUT/CIRCLE 3C)`, as other figures and findings count them."""
    rows = np.flatnonzero(cuts.contour == contour)
    source = cuts.toolpath.text(int(rows[0])) if len(rows) else ""
    return f"contour {contour + 1}" + (f" ({source})" if source else "")


def _place(point: Floats) -> tuple[float, float]:
    return float(point[0]), float(point[1])
