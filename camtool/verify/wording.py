"""A Report in words: for the terminal, for Markdown, for the margin of a picture."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from camtool.verify.records import ShapeReport
    from camtool.verify.report import Report

DIMENSIONS_SHOWN = 12
"""So many dimensions and circles go into a Markdown table; JSON holds them all."""


def clock(seconds: float) -> str:
    """Seconds as h:mm:ss, rounded to the second.

    >>> clock(3725.4)
    '1:02:05'
    """
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def text(report: Report, *, findings: bool) -> str:
    """The summary that `camtool post` and `camtool verify` print, without a final newline."""
    lines = [f"{name:<10} {value}" for name, value in _facts(report)]
    if findings:
        lines += [_finding_line(report, index) for index in range(len(report.findings))]
    return "\n".join(lines)


def notes(report: Report) -> tuple[str, ...]:
    """Target and time, reversals, predicted error."""
    total = report.error_um.total
    return (
        f"{report.target}: {clock(report.time_s)} h, {_cutting_reversals(report)} reversals",
        f"predicted error {_um(total.max)} µm at most, rms {_um(total.rms)} µm",
    )


def markdown(report: Report) -> str:
    """The report as a Markdown page."""
    parts = [f"# {_plain(report.source) or report.target}", ""]
    parts += [f"- **{name}:** {value}" for name, value in _facts(report)]
    parts += ["", "| error by source | max µm | rms µm | p95 µm |", "|---|---:|---:|---:|"]
    parts += [f"| {' | '.join(row)} |" for row in _error_rows(report)]
    parts += ["", *_dimension_table(report), *_circle_table(report), *_contour_table(report)]
    parts += [*_worst_table(report), *_finding_list(report), ""]
    parts += [f"- assumed: {_plain(words)}" for words in report.assumptions]
    return "\n".join(parts).rstrip() + "\n"


def _facts(report: Report) -> Iterator[tuple[str, str]]:
    steps, extents = report.steps, report.extents_mm
    how = report.interpolator
    if how in ("dsm", "dda", "stairs"):
        how = f"arcs by {how}"
    elif how == "path":
        how = "followed exactly"
    yield "target", f"{report.target} ({how})"
    if report.dimensions:
        x, y = report.dimensions[:2]
        shown = f"error {_percent(x.error_percent)}, {_percent(y.error_percent)}"
        yield "size", f"{x.nominal_mm:.3f} × {y.nominal_mm:.3f} mm; predicted {shown}"
    spans = zip("XYZ", (extents.x, extents.y, extents.z), strict=True)
    yield "travel", ", ".join(f"{axis} {_mm(low)} to {_mm(high)}" for axis, (low, high) in spans)
    program = f"{report.contours} contours, {report.moves} moves"
    if report.blocks is not None:
        program += f", {report.blocks} blocks"
    if report.bytes is not None:
        program += f", {report.bytes} bytes"
    yield "program", program
    split = report.time_split_s
    parts = [f"cutting {clock(split.cutting)}"]
    if split.link:
        parts.append(f"line {clock(split.link)}")
    yield "time", f"{clock(report.time_s)} ({', '.join(parts)})"
    yield "steps", f"X {steps.x}, Y {steps.y}, Z {steps.z}"
    total, cutting = report.reversals, report.reversals.cutting
    yield (
        "reversals",
        f"X {total.x}, Y {total.y}, Z {total.z} (while cutting X {cutting.x}, Y {cutting.y})",
    )
    if report.planned is not None:
        far, drawn = report.planned.rapid_mm, report.planned.rapid_drawn_mm
        yield "rapids", f"{_mm(far)} mm in XY (as drawn {_mm(drawn)} mm)"
    if report.before is not None:
        yield "before", _before(report)
    error = report.error_um.total
    yield "error", f"{_um(error.max)} µm at most, rms {_um(error.rms)}, p95 {_um(error.p95)}"
    yield "by source", _error_sources(report)
    if report.error_um.depth_max:
        yield "depth", f"{_um(report.error_um.depth_max)} µm off at most"
    if report.closure_um is not None:
        yield "closure", f"{report.closure_um:.2f} µm"
    if report.unreached is not None and report.unreached.moves:
        far = report.unreached.max_um
        yield "ends", f"{report.unreached.moves} moves end elsewhere, up to {far:.2f} µm away"
    if report.shape is not None:
        yield "shape", _shape(report.shape)


def _shape(shape: ShapeReport) -> str:
    """Over- and undercut of a round tool."""
    over = f"overcut {shape.overcut_um:.2f} µm deep, {shape.overcut_mm2:.4f} mm²"
    under = f"undercut {shape.undercut_um:.2f} µm, {shape.undercut_mm2:.4f} mm²"
    return f"{over}; {under} (tool {shape.tool_diameter_mm:g} mm)"


def worst(report: Report) -> str:
    """The moves with the largest errors, one to a line; µm."""
    lines = [
        f"{_named(item.block, item.move):<12} {item.total_um:>9.2f} µm  interpolation"
        f" {_um(item.interpolation_um)}, mechanics {_um(item.mechanics_um)}"
        f"  near ({item.at_mm[0]:.3f}, {item.at_mm[1]:.3f}) mm"
        + (f"  {_one_line(item.source)}" if item.source else "")
        for item in report.worst
    ]
    return "\n".join(lines)


def _named(block: int | None, move: int) -> str:
    return f"block {block}" if block is not None else f"move {move}"


def _before(report: Report) -> str:
    """What the same job would be without what was done against reversals and play."""
    before = report.before
    if before is None or before.time_s is None:
        return "not known: the job cannot be cut the plain way"
    error, time = f"{_um(before.total_max_um)} µm", clock(before.time_s)
    return (
        f"{before.reversals_cutting} reversals while cutting, {before.reversals_air} in the air,"
        f" error {error}, time {time}"
    )


def _error_sources(report: Report) -> str:
    error = report.error_um
    figures = {
        "fit": error.fit.max,
        "rounding": error.rounding.max,
        "interpolation": error.interpolation.max,
        "mechanics": error.mechanics.max,
    }
    return ", ".join(f"{name} {_um(most)}" for name, most in figures.items()) + " µm"


def _error_rows(report: Report) -> Iterator[tuple[str, ...]]:
    error = report.error_um
    yield "fit", _um(error.fit.max), _um(error.fit.rms), ""
    yield "rounding", _um(error.rounding.max), _um(error.rounding.rms), ""
    within = error.interpolation
    yield "interpolation", _um(within.max), _um(within.rms), _um(within.p95)
    yield "mechanics", _um(error.mechanics.max), _um(error.mechanics.rms), ""
    yield "**total**", _um(error.total.max), _um(error.total.rms), _um(error.total.p95)


def _dimension_table(report: Report) -> Iterator[str]:
    if not report.dimensions:
        return
    yield "| dimension | nominal mm | predicted mm | error |"
    yield "|---|---:|---:|---:|"
    for item in report.dimensions[:DIMENSIONS_SHOWN]:
        size = f"{item.nominal_mm:.4f} | {item.predicted_mm:.4f}"
        yield f"| {item.name} | {size} | {_percent(item.error_percent)} |"
    yield from _rest(len(report.dimensions), "dimensions")


def _circle_table(report: Report) -> Iterator[str]:
    if not report.circles:
        return
    yield "| circle at mm | radius mm | way | G µm | Fmax µm | Fmin µm |"
    yield "|---|---:|---|---:|---:|---:|"
    for item in report.circles[:DIMENSIONS_SHOWN]:
        centre = f"({item.centre_mm[0]:.3f}, {item.centre_mm[1]:.3f})"
        figures = " | ".join(_um(value) for value in (item.G_um, item.Fmax_um, item.Fmin_um))
        yield f"| {centre} | {item.radius_mm:.4f} | {item.direction} | {figures} |"
    yield from _rest(len(report.circles), "circles")


def _contour_table(report: Report) -> Iterator[str]:
    """The contours with the largest errors."""
    if not report.contour_errors:
        return
    yield "| contour | max µm | rms µm | mean µm | interpolation µm | mechanics µm | where |"
    yield "|---|---:|---:|---:|---:|---:|---|"
    ordered = sorted(report.contour_errors, key=lambda item: -item.max_um)
    for item in ordered[:DIMENSIONS_SHOWN]:
        errors = (item.max_um, item.rms_um, item.mean_um, item.interpolation_um, item.mechanics_um)
        figures = " | ".join(_um(error) for error in errors)
        place = f"({item.at_mm[0]:.3f}, {item.at_mm[1]:.3f})"
        yield f"| {_plain(item.name)} | {figures} | {place} |"
    yield from _rest(len(ordered), "contours")


def _worst_table(report: Report) -> Iterator[str]:
    if not report.worst:
        return
    yield "| worst moves | error µm | interpolation µm | mechanics µm | where |"
    yield "|---|---:|---:|---:|---|"
    for item in report.worst:
        figures = f"{item.total_um:.2f} | {_um(item.interpolation_um)} | {_um(item.mechanics_um)}"
        place = f"({item.at_mm[0]:.3f}, {item.at_mm[1]:.3f})"
        yield f"| {_named(item.block, item.move)} | {figures} | {place} |"
    yield ""


def _finding_list(report: Report) -> Iterator[str]:
    for item in report.findings:
        place = f" ({_plain(item.where)})" if item.where else ""
        yield f"- {item.severity} `{item.code}`{place}: {_plain(item.message)}"


def _rest(count: int, noun: str) -> Iterator[str]:
    if count > DIMENSIONS_SHOWN:
        yield ""
        yield f"and {count - DIMENSIONS_SHOWN} more {noun} in the JSON report"
    yield ""


def _finding_line(report: Report, index: int) -> str:
    item = report.findings[index]
    place = f" [{item.where}]" if item.where else ""
    return " ".join(f"{item.severity} {item.code}{place}: {item.message}".split())


def _cutting_reversals(report: Report) -> int:
    return report.reversals.cutting.x + report.reversals.cutting.y


def _um(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _mm(value: float) -> str:
    return f"{value:.3f}".replace("-", "−")


def _percent(value: float | None) -> str:
    return "–" if value is None else f"{value:+.2f} %".replace("-", "−")


def _one_line(words: str) -> str:
    return "".join(sign if sign.isprintable() else " " for sign in " ".join(words.split()))


def _plain(words: str) -> str:
    """One line that Markdown takes as words: names come from drawings and mean nothing."""
    line = " ".join(words.split())
    return "".join("\\" + sign if sign in "\\`*_[]<>|#" else sign for sign in line)
