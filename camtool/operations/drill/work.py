"""Drilling: single points and small circles become holes.

    marks, circles ──each place once──▶ holes ──pecks──▶ one Fixed item per hole

The tip goes to the full depth, and no farther: a hole that is to go through with its whole
diameter needs a depth greater by the height of the cone, ½·diameter / tan(½·tip angle)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from camtool.findings import Finding
from camtool.planning.findings import (
    HOLE_SIZE,
    NOT_DRILLED,
    NOT_DRILLED_TOO_LARGE,
    NOTHING_DRAWN_TO_DRILL,
)
from camtool.planning.holes import (
    HOLE_SIZE_MM,
    Hole,
    drilled_holes,
    largest_hole_mm,
    named,
    peck_depths,
    pecks,
    refuse_endless_pecks,
)
from camtool.planning.items import Chosen, CutRun, Fixed, Setting, Work
from camtool.planning.job import Operation
from camtool.planning.naming import operation_name


def drill(chosen: Chosen, setting: Setting) -> Work:
    """Return one Fixed item for each mark and each circle up to the largest diameter that the
    operation drills.

    Places that are drawn twice are drilled once; of concentric circles, the one nearest to the
    drill's diameter counts. Marks and circles that are no hole for this drill are named in
    findings; it is an error if none is left."""
    operation = setting.operation
    holes, large, other_names = drilled_holes(chosen, operation)
    limit = largest_hole_mm(operation)
    findings = [
        *_too_large(large, limit),
        *_no_circles(other_names),
        *_other_sizes(holes, operation),
        *_empty_findings(holes, operation),
    ]
    if operation.peck_mm is not None:
        refuse_endless_pecks(-setting.levels_mm[-1], operation.peck_mm, holes, operation)
    items = (
        Fixed((_run(hole, setting),), setting, hole.name, hole.source, hole.outline)
        for hole in holes
    )
    return Work(tuple(items), tuple(findings))


def _run(hole: Hole, setting: Setting) -> CutRun:
    """Return the run of a hole: down in pecks, dwell, and up."""
    operation = setting.operation
    depths = peck_depths(-setting.levels_mm[-1], operation.peck_mm)
    vertices, feeds = pecks(hole.at_mm, depths, setting)
    plunge_feed = setting.feeds.plunge_mm_min
    return CutRun(vertices, np.array(feeds), plunge_feed, hole.name, operation.dwell_s)


def _too_large(holes: list[Hole], limit: float) -> Iterator[Finding]:
    if holes:
        yield NOT_DRILLED_TOO_LARGE(
            where=named([hole.name for hole in holes]),
            measured=max(hole.diameter_mm or 0.0 for hole in holes),
            limit=limit,
            count=len(holes),
        )


def _no_circles(names: list[str]) -> Iterator[Finding]:
    if names:
        yield NOT_DRILLED(where=named(names), measured=len(names))


def _other_sizes(holes: list[Hole], operation: Operation) -> Iterator[Finding]:
    """Yield one finding for each diameter of holes that differs from the drill's."""
    drill_mm = operation.tool.diameter_mm
    by_size: dict[float, list[str]] = {}
    for hole in holes:
        if drill_mm and hole.diameter_mm and abs(hole.diameter_mm - drill_mm) > HOLE_SIZE_MM:
            by_size.setdefault(round(hole.diameter_mm, 3), []).append(hole.name)
    for size, names in sorted(by_size.items()):
        yield HOLE_SIZE(where=named(names), measured=drill_mm, limit=size, count=len(names))


def _empty_findings(holes: list[Hole], operation: Operation) -> Iterator[Finding]:
    if not holes:
        yield NOTHING_DRAWN_TO_DRILL(where=operation_name(operation))
