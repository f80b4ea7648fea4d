"""The tables of a Report as rows of words, for Markdown and HTML alike."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from camtool.verify.wording import named, percent, um

if TYPE_CHECKING:
    from camtool.verify.report import Report


@dataclass(frozen=True)
class Sheet:
    """A table: `noun` names what its rows are, `words` how many of its first columns hold words
    (the rest are numbers). Cells are words of any kind, not yet escaped."""

    noun: str
    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    words: int = 1


def sheets(report: Report) -> Iterator[Sheet]:
    """Errors by source, dimensions, circles, contours and worst moves; none that is empty."""
    every = (
        _errors(report),
        _dimensions(report),
        _circles(report),
        _both_ways(report),
        _contours(report),
        _worst(report),
    )
    return (sheet for sheet in every if sheet.rows)


def _errors(report: Report) -> Sheet:
    error = report.error_um
    named_figures = {
        "fit": (error.fit.max, error.fit.rms, None),
        "rounding": (error.rounding.max, error.rounding.rms, None),
        "interpolation": (
            error.interpolation.max,
            error.interpolation.rms,
            error.interpolation.p95,
        ),
        "mechanics": (error.mechanics.max, error.mechanics.rms, None),
        "total": (error.total.max, error.total.rms, error.total.p95),
    }
    rows = tuple((name, *map(um, figures)) for name, figures in named_figures.items())
    return Sheet("sources", ("error by source", "max µm", "rms µm", "p95 µm"), rows)


def _dimensions(report: Report) -> Sheet:
    heads = ("dimension", "nominal mm", "predicted mm", "error")
    rows = tuple(
        (
            item.name,
            f"{item.nominal_mm:.4f}",
            f"{item.predicted_mm:.4f}",
            percent(item.error_percent),
        )
        for item in report.dimensions
    )
    return Sheet("dimensions", heads, rows)


def _circles(report: Report) -> Sheet:
    heads = ("circle at mm", "way", "radius mm", "G µm", "Fmax µm", "Fmin µm", "D µm", "fit µm")
    rows = tuple(
        (
            _place(item.centre_mm),
            item.direction,
            f"{item.radius_mm:.4f}",
            *map(um, (item.G_um, item.Fmax_um, item.Fmin_um, item.D_um, item.fit_um)),
        )
        for item in report.circles
    )
    return Sheet("circles", heads, rows, words=2)


def _both_ways(report: Report) -> Sheet:
    heads = ("circle both ways round, at mm", "radius mm", "G(b) µm", "D µm")
    rows = tuple(
        (_place(item.centre_mm), f"{item.radius_mm:.4f}", um(item.Gb_um), um(item.D_um))
        for item in report.bidirectional
    )
    return Sheet("circles", heads, rows)


def _contours(report: Report) -> Sheet:
    """The contours, those with the largest errors first."""
    heads = (
        "contour",
        "where",
        "max µm",
        "rms µm",
        "mean µm",
        "fit µm",
        "interpolation µm",
        "mechanics µm",
    )
    rows = tuple(
        (
            item.name,
            _place(item.at_mm),
            um(item.max_um),
            um(item.rms_um),
            um(item.mean_um),
            um(item.fit_um),
            um(item.interpolation_um),
            um(item.mechanics_um),
        )
        for item in sorted(report.contour_errors, key=lambda item: -item.max_um)
    )
    return Sheet("contours", heads, rows, words=2)


def _worst(report: Report) -> Sheet:
    heads = (
        "worst moves",
        "where",
        "drawn as",
        "error µm",
        "fit µm",
        "interpolation µm",
        "mechanics µm",
    )
    rows = tuple(
        (
            named(item.block, item.move),
            _place(item.at_mm),
            item.source,
            um(item.total_um),
            um(item.fit_um),
            um(item.interpolation_um),
            um(item.mechanics_um),
        )
        for item in report.worst
    )
    return Sheet("moves", heads, rows, words=3)


def _place(at_mm: tuple[float, float]) -> str:
    return f"({at_mm[0]:.3f}, {at_mm[1]:.3f})"
