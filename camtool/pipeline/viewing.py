"""What the viewer shows besides a picture: seconds, errors, the program's lines, the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from camtool.machine.model import Machine
    from camtool.machine.registry import LoadedTarget
    from camtool.pipeline.judge import Posted
    from camtool.preview.viewer.run import Line, Run, Table, Worst
    from camtool.toolpath.moves import Toolpath
    from camtool.toolpath.program import Listing
    from camtool.verification.report import Report
    from camtool.verification.verify import Verification

LINES_SHOWN = 200
"""A table of the viewer has no more lines than this; the JSON report has them all."""

POINTS_OF_A_PAGE = 400_000
"""The viewer is given so many points of the slides' path: enough for the ends of 200,000 moves and
the largest error within each."""

NAME_WIDTH = 11
"""Characters of the report's text before the figures of a line."""


def points_for(picture: str | None) -> int | None:
    """How many points of the slides' path a picture of this name wants; None: as usual."""
    return POINTS_OF_A_PAGE if (picture or "").lower().endswith(".html") else None


def listing_of(
    data: bytes, target: LoadedTarget, toolpath: Toolpath
) -> Callable[[], Listing | None]:
    """What gives the program block by block, when asked: None where its dialect cannot say which
    bytes are which."""

    def listing() -> Listing | None:
        make = getattr(target.post, "listing", None)
        if make is None:
            return None
        made: Listing = make(data, target.machine)
        last = int(toolpath.block.max()) if len(toolpath) else -1
        return made if last < len(made.blocks) else None

    return listing


def posted_listing(posted: Posted, target: LoadedTarget) -> Callable[[], Listing | None] | None:
    """The same of what was posted; None where nothing was."""
    if posted.program is None or posted.decoded is None:
        return None
    return listing_of(posted.program.data, target, posted.decoded)


def run_of(
    toolpath: Toolpath,
    verification: Verification | None,
    machine: Machine,
    listing: Listing | None,
) -> Run:
    """How the toolpath runs: as simulated where there is a verification, else by its feeds."""
    from dataclasses import replace

    from camtool.preview.viewer.run import Run, by_feed

    blocks = () if listing is None else listing.blocks
    if verification is None:
        run = by_feed(toolpath, machine.rapid_mm_min)
    else:
        report, rows = verification.report, verification.rows
        run = Run(
            seconds=rows.ledger.duration_s,
            error_mm=rows.total,
            trace_row=verification.trace.row,
            tables=tuple(_tables(report)),
            worst=_worst_places(report),
        )
    if listing is None:
        return run
    return replace(run, blocks=blocks, binary=listing.binary)


def _worst_places(report: Report) -> tuple[Worst, ...]:
    from camtool.preview.viewer.run import Worst

    return tuple(Worst(item.at_mm) for item in report.worst)


def _tables(report: Report) -> Iterator[Table]:
    """The report's figures; tables without a line are left out."""
    from camtool.preview.viewer.run import Line, Table

    lines = report.to_text(findings=False).splitlines()
    facts = [(line[:NAME_WIDTH].strip(), line[NAME_WIDTH:].strip()) for line in lines]
    yield Table("Report", (), tuple(map(Line, facts)))
    for title, columns, found in (_findings(report), _worst(report), _contours(report)):
        if found:
            yield Table(title, columns, tuple(found[:LINES_SHOWN]))


def _findings(report: Report) -> tuple[str, tuple[str, ...], list[Line]]:
    from camtool.preview.viewer.run import Line

    lines = [
        Line((item.severity, item.code, item.where, item.message)) for item in report.findings
    ]
    return "Findings", ("severity", "code", "where", "message"), lines


def _worst(report: Report) -> tuple[str, tuple[str, ...], list[Line]]:
    """The worst moves; the report counts them from 1."""
    from camtool.preview.viewer.run import Line

    lines = [
        Line(
            (
                str(index),
                str(item.move if item.block is None else item.block),
                _um(item.total_um),
                _um(item.interpolation_um),
                _um(item.mechanics_um),
                _place(item.at_mm),
                item.source,
            ),
            item.move - 1,
        )
        for index, item in enumerate(report.worst, 1)
    ]
    names = ("", "block", "error µm", "interpolation µm", "mechanics µm", "near mm", "from")
    return "Worst moves", names, lines


def _contours(report: Report) -> tuple[str, tuple[str, ...], list[Line]]:
    from camtool.preview.viewer.run import Line

    lines = [
        Line(
            (item.name, _um(item.max_um), _um(item.rms_um), _um(item.mean_um), _place(item.at_mm))
        )
        for item in sorted(report.contour_errors, key=lambda item: -item.max_um)
    ]
    return "Contours", ("contour", "max µm", "rms µm", "mean µm", "worst near mm"), lines


def _um(value: float | None) -> str:
    return "–" if value is None else f"{value:.2f}"


def _place(at_mm: tuple[float, float]) -> str:
    return f"({at_mm[0]:.3f}, {at_mm[1]:.3f})"
