"""A Report in words: for the terminal and for the margin of a picture.

Its tables stand in `camtool.verify.sheets`, its pages in `markdown` and `html` beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from camtool.plain import one_line

if TYPE_CHECKING:
    from camtool.verify.records import AskedReport, PlannedOperation, ShapeReport
    from camtool.verify.report import Report


MOST_OPERATIONS = 6
"""So many operations are told one by one."""


def clock(seconds: float) -> str:
    """Seconds as h:mm:ss, rounded to the second.

    >>> clock(3725.4)
    '1:02:05'
    """
    whole = round(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def text(report: Report, *, findings: bool) -> str:
    """The summary that `camtool post` and `camtool verify` print, without a final newline."""
    lines = [one_line(f"{name:<10} {value}") for name, value in facts(report)]
    if findings:
        lines += [_finding_line(report, index) for index in range(len(report.findings))]
    return "\n".join(lines)


def notes(report: Report) -> tuple[str, ...]:
    """Target and time, reversals, predicted error."""
    total = report.error_um.total
    return (
        f"{report.target}: {clock(report.time_s)} h, {_cutting_reversals(report)} reversals",
        f"predicted error {um(total.max)} µm at most, rms {um(total.rms)} µm{to_what(report)}",
    )


def facts(report: Report) -> Iterator[tuple[str, str]]:
    """(name, value) of each line of the summary."""
    steps, extents = report.steps, report.extents_mm
    how = report.interpolator
    if how in ("dsm", "dda", "stairs"):
        how = f"arcs by {how}"
    elif how == "path":
        how = "followed exactly"
    yield "target", f"{report.target} ({how})"
    if report.dimensions:
        x, y = report.dimensions[:2]
        shown = f"error {percent(x.error_percent)}, {percent(y.error_percent)}"
        what = "" if x.of == "edge" else " of the tool's centre"
        yield "size", f"{x.nominal_mm:.3f} × {y.nominal_mm:.3f} mm{what}; predicted {shown}"
    spans = zip("XYZ", (extents.x, extents.y, extents.z), strict=True)
    yield "travel", ", ".join(f"{axis} {mm(low)} to {mm(high)}" for axis, (low, high) in spans)
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
        yield from (("cut", line) for line in _cuts(report.planned.operations))
        far, drawn = report.planned.rapid_mm, report.planned.rapid_drawn_mm
        yield "rapids", f"{mm(far)} mm in XY (as drawn {mm(drawn)} mm)"
    if report.before is not None:
        yield "before", _before(report)
    if report.asked is not None:
        yield "as asked", _asked(report.asked)
    error = report.error_um.total
    yield (
        "error",
        f"{um(error.max)} µm at most, rms {um(error.rms)}, p95 {um(error.p95)}{to_what(report)}",
    )
    yield "by source", _error_sources(report)
    if report.error_um.depth_max:
        yield "depth", f"{um(report.error_um.depth_max)} µm off at most"
    if report.closure_um is not None:
        yield "closure", f"{report.closure_um:.2f} µm"
    if report.unreached is not None and report.unreached.moves:
        far = report.unreached.max_um
        yield "ends", f"{report.unreached.moves} moves end elsewhere, up to {far:.2f} µm away"
    if report.shape is not None:
        yield "shape", _shape(report.shape)


def _asked(asked: AskedReport) -> str:
    """How many moves are the very ones that were asked for."""
    if asked.alike == asked.moves:
        return f"all {asked.moves} cutting moves are those that camtool writes"
    return (
        f"{asked.alike} of {asked.moves} cutting moves are those that camtool writes, the others"
        f" up to {asked.off_um:.2f} µm off ({asked.limit_um:.2f} µm allowed)"
    )


def _cuts(operations: Sequence[PlannedOperation]) -> Iterator[str]:
    """Tool, spindle, feeds, depth and passes of the operations, one to a line."""
    for each in operations[:MOST_OPERATIONS]:
        name = one_line(each.name or each.kind)
        tool = f"tool {each.tool_diameter_mm:g} mm" if each.tool_diameter_mm else "no tool width"
        speed = "no spindle speed" if each.spindle_rpm is None else f"spindle {each.spindle_rpm:g}"
        passes = "" if each.passes is None else f" in {each.passes} pass"
        if each.passes is not None and each.passes > 1:
            passes += f"es of {each.deepest_pass_mm:.4g} at most"
        yield (
            f"{name}: {tool}, {speed}, feed {each.feed_mm_min:g}, plunge {each.plunge_mm_min:g}"
            f" mm/min, {each.depth_mm:.4g} mm deep{passes}"
        )
    if len(operations) > MOST_OPERATIONS:
        yield f"and {len(operations) - MOST_OPERATIONS} operations more"


def to_what(report: Report) -> str:
    """What errors are measured to, where that is not what was drawn."""
    return "" if report.against == "drawing" else "; to the program's moves: no drawing is known"


def _shape(shape: ShapeReport) -> str:
    """Over- and undercut of a round tool."""
    over = f"overcut {shape.overcut_um:.2f} µm deep, {shape.overcut_mm2:.4f} mm²"
    under = f"undercut {shape.undercut_um:.2f} µm, {shape.undercut_mm2:.4f} mm²"
    return f"{over}; {under} (tool {shape.tool_diameter_mm:g} mm)"


def worst(report: Report) -> str:
    """The moves with the largest errors, one to a line; µm."""
    lines = [
        f"{named(item.block, item.move):<12} {item.total_um:>9.2f} µm  interpolation"
        f" {um(item.interpolation_um)}, mechanics {um(item.mechanics_um)}"
        f"  near ({item.at_mm[0]:.3f}, {item.at_mm[1]:.3f}) mm"
        + (f"  {one_line(item.source)}" if item.source else "")
        for item in report.worst
    ]
    return "\n".join(lines)


def named(block: int | None, move: int) -> str:
    """A move by its block, or by its own number where there are no blocks."""
    return f"block {block}" if block is not None else f"move {move}"


def _before(report: Report) -> str:
    """What the same job would be without what was done against reversals and play."""
    before = report.before
    if before is None or before.time_s is None:
        return "not known: the job cannot be cut the plain way"
    error, time = f"{um(before.total_max_um)} µm", clock(before.time_s)
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
    return ", ".join(f"{name} {um(most)}" for name, most in figures.items()) + " µm"


def _finding_line(report: Report, index: int) -> str:
    item = report.findings[index]
    place = f" [{item.where}]" if item.where else ""
    return one_line(f"{item.severity} {item.code}{place}: {item.message}")


def _cutting_reversals(report: Report) -> int:
    return report.reversals.cutting.x + report.reversals.cutting.y


def um(value: float | None) -> str:
    """Micrometres to two decimals, a dash for what is not known."""
    return "–" if value is None else f"{value:.2f}"


def mm(value: float) -> str:
    """Millimetres to three decimals."""
    return f"{value:.3f}".replace("-", "−")


def percent(value: float | None) -> str:
    """Per cent with its sign, a dash for what is not known."""
    return "–" if value is None else f"{value:+.2f} %".replace("-", "−")
