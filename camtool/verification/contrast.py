"""The table of a program's variants (interpolators, backlash, other values), and their paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from camtool.arrays import Bools, Floats
from camtool.simulation.motion import Chunk
from camtool.units import clock
from camtool.verification.report import Report
from camtool.verification.verify import Verification


class ContrastRow(msgspec.Struct, frozen=True):
    """A row of the table; µm, s. `circular_um`: the largest G of the circles. `endless`: the
    number of arcs whose stop test is never met."""

    name: str
    interpolation_max_um: float | None
    mechanics_max_um: float | None
    total_max_um: float | None
    total_rms_um: float | None
    circular_um: float | None
    iterations: int
    iterations_cutting: int
    reversals_cutting: int
    endless: int
    time_s: float


def contrast_row(name: str, report: Report) -> ContrastRow:
    """Return the table row of one report."""
    error = report.error_um
    circular = [circle.G_um for circle in report.circles if circle.G_um is not None]
    return ContrastRow(
        name=name,
        interpolation_max_um=error.interpolation.max,
        mechanics_max_um=error.mechanics.max,
        total_max_um=error.total.max,
        total_rms_um=error.total.rms,
        circular_um=max(circular, default=None),
        iterations=report.steps.iterations,
        iterations_cutting=report.steps.iterations_cutting,
        reversals_cutting=report.cutting_reversals,
        endless=sum(finding.code == "ARC_MISSES_END" for finding in report.findings),
        time_s=report.time_s,
    )


_HEADS = ("interp.", "mechanics", "total", "rms", "G", "iterations", "reversals", "endless")


def contrast_table(rows: Sequence[ContrastRow]) -> str:
    """Return the rows as aligned text, errors in µm."""
    cells: list[tuple[str, ...]] = [("µm", *_HEADS, "time")]
    cells += [
        (
            row.name,
            *map(_um_words, (row.interpolation_max_um, row.mechanics_max_um, row.total_max_um)),
            *map(_um_words, (row.total_rms_um, row.circular_um)),
            *map(str, (row.iterations_cutting, row.reversals_cutting, row.endless)),
            clock(row.time_s),
        )
        for row in rows
    ]
    widths = [max(len(line[column]) for line in cells) for column in range(len(cells[0]))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in cells
    )


def worst_place(verdicts: Iterable[Verification]) -> tuple[float, float]:
    """Return the place (x, y), mm, of the largest error among all variants; part zero if nothing
    cuts."""
    best, place = -1.0, (0.0, 0.0)
    for verdict in verdicts:
        trace = verdict.trace
        error = np.where(trace.cutting, trace.error_mm, -1.0)
        index = int(error.argmax())
        if float(error[index]) > best:
            best = float(error[index])
            place = (float(trace.points[index, 0]), float(trace.points[index, 1]))
    return place


MAX_SHOWN_SAMPLES = 40_000


def paths_within(
    chunks: Iterable[Chunk], cutting: Bools, window: Floats, *, commanded: bool
) -> list[Floats]:
    """Return the cutting samples in the window [[xmin, xmax], [ymin, ymax]] mm, as consecutive
    polylines (n, 2): positions of the slides, or `commanded` positions."""
    paths: list[Floats] = []
    shown, before = 0, np.empty((0, 2))
    open_end = False
    for chunk in chunks:
        points = (chunk.commanded if commanded else chunk.slide)[:, :2]
        inside = ((points >= window[:, 0]) & (points <= window[:, 1])).all(axis=1)
        inside &= cutting[chunk.row]
        indices = np.flatnonzero(inside)[: MAX_SHOWN_SAMPLES - shown]
        line = np.concatenate([before, points])  # each polyline begins with the sample before it
        for run in (
            np.split(indices, np.flatnonzero(np.diff(indices) > 1) + 1) if len(indices) else []
        ):
            first, end = int(run[0]) + len(before), int(run[-1]) + len(before) + 1
            if open_end and run[0] == 0:
                paths[-1] = np.concatenate([paths[-1], line[first:end]])
            else:
                paths.append(line[max(first - 1, 0) : end])
        shown += len(indices)
        if len(points):
            open_end, before = bool(inside[-1]), points[-1:]
        if shown >= MAX_SHOWN_SAMPLES:
            break
    return paths


def _um_words(value: float | None) -> str:
    return "–" if value is None else f"{value:.3f}"
