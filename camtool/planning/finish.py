"""Finishing passes: along the wall, once round at the full depth, in what was roughed.

The tool that roughs leaves f on the wall; the finishing tool takes it. Where the centre of the one
with radius r ran, the other, of radius q, stands beside the wall nearer by f + r − q; its disc
reaches as much into what is left as

    e = distance to the path of the first + q − r,

which is f along a straight wall, and more in corners, and where the first does not get at all. If
e is more than a part of its diameter anywhere, the wall is finished in passes, as it was roughed.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.distance import nearest
from camtool.geometry.measure import sample
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse_lines,
)
from camtool.planning.findings import (
    FINISH_IN_PASSES,
    FINISH_IN_PASSES_WHOLE,
    TAB_LEFT_OUT_ROUGH,
    PlanningCode,
)
from camtool.planning.items import Contour, Setting, Step
from camtool.planning.job import Operation
from camtool.planning.naming import at_place, key_of
from camtool.planning.settings import levels
from camtool.planning.tabs import is_hole
from camtool.records import replace
from camtool.toolpath.findings import ProgramCode

MAX_ENGAGED_SHARE = 0.5
"""A finishing pass at full depth may meet material up to this share of its tool's diameter thick,
also in corners. The most that may be left on the wall becomes twice as thick in a corner of 60
degrees."""

SAMPLES_PER_TOOL = 8.0
"""Number of places along a finishing pass, per tool diameter, at which the material that is left
is measured."""

OF_WALLS = (
    PlanningCode.UNREACHED,
    PlanningCode.SLOT_AS_WIDE,
    PlanningCode.CONTOUR_TOO_SMALL,
    ProgramCode.GOUGE,
    PlanningCode.NOT_RELIEVED,
    PlanningCode.CORNER_FAR,
    PlanningCode.FINISH_IN_PASSES,
)
"""Findings about the wall, reported by the stage that cuts it; all other findings are reported by
the first stage."""

OF_BOTH = (PlanningCode.LEAD_LEFT_OUT, PlanningCode.TAB_LEFT_OUT)
"""Findings that both stages report for themselves: tabs are made in the roughing, and may be
missing on a wall that it does not follow all round."""


def of_stage(operation: Operation, findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that this stage of an operation should report. Roughing runs farther
    from its own wall, and so nearer to its neighbours, so that it reports gouges of these and
    leaves findings about the wall to the finishing stage."""
    if not operation.stage:
        return list(findings)
    if operation.stage == "rough":
        is_beside = operation.contract.runs_beside
        is_limited = operation.engagement_rad is not None
        own_codes = [ProgramCode.GOUGE] * is_beside + [PlanningCode.SLOT_AS_WIDE] * is_limited
        return [each for each in findings if each.code in own_codes or each.code not in OF_WALLS]
    return [each for each in findings if each.code in (*OF_WALLS, *OF_BOTH)]


def along_walls(
    paths: Polylines, setting: Setting, names: Sequence[str], sources: Sequence[int]
) -> list[Contour]:
    """Return contours along the boundaries of tool centre regions, which lie on the left of their
    paths."""
    conventional = setting.operation.direction == "conventional"
    lines = reverse_lines(paths) if conventional else paths
    return [
        Contour(path, setting, name, source, material_left=conventional)
        for path, name, source in zip(lines, names, sources, strict=True)
    ]


def in_passes(
    contours: list[Contour], setting: Setting, rough: Step
) -> tuple[list[Contour], list[Finding]]:
    """Return the contours of a finishing pass. They are cut in passes instead of at once if
    roughing has left more than the tool can take at full depth."""
    operation = setting.operation
    if not contours:
        return contours, []
    max_engaged, place = _engaged(contours, operation, rough)
    if max_engaged <= MAX_ENGAGED_SHARE * operation.tool.diameter_mm + POSITION_EPS_MM:
        return contours, []
    depth = -setting.levels_mm[-1]
    try:
        passes = levels(depth, operation.step_down_mm, operation.last_pass_mm)
    except OptionError as error:
        raise OptionError(
            error.message, where=key_of(operation, "step_down"), mend=error.mend
        ) from error
    stepped = replace(setting, levels_mm=passes)
    contours = [replace(contour, setting=stepped) for contour in contours]
    if math.isinf(max_engaged):
        finding = FINISH_IN_PASSES_WHOLE(where=place, passes=len(passes))
    else:
        finding = FINISH_IN_PASSES(where=place, measured=max_engaged, passes=len(passes))
    return contours, [finding, *_tabs_lost(contours, rough)]


def _tabs_lost(contours: Sequence[Contour], rough: Step) -> Iterator[Finding]:
    """Yield a finding for each part that is held by fewer tabs than asked for, because the
    roughing tool, which makes them, does not get all round it."""
    tabs = rough.operation.tabs
    if tabs is None or tabs.at_mm is not None:
        return
    centres = np.array([bridge.centre for bridge in rough.bridges]).reshape(-1, 2)
    spans = np.array([bridge.half_span_mm for bridge in rough.bridges])
    for contour in contours:
        if contour.path.closed and not is_hole(contour):
            distances = nearest(centres, Segments.of(Polylines.of([contour.path]))).distance
            own = int((distances <= spans + rough.operation.allowance_mm + POSITION_EPS_MM).sum())
            if own < (tabs.count or 1):
                yield TAB_LEFT_OUT_ROUGH(
                    where=at_place(contour.name, contour.path.start.tolist()),
                    measured=own,
                    limit=tabs.count or 1,
                )


def _engaged(contours: list[Contour], operation: Operation, rough: Step) -> tuple[float, str]:
    """Return the greatest thickness that is left beside the wall, mm, and the place; infinite if
    nothing was roughed."""
    if not len(rough.runs):
        return math.inf, at_place(contours[0].name, contours[0].path.start.tolist())
    cleared = _paths(rough)
    max_engaged, place = -math.inf, ""
    wide = operation.tool.diameter_mm
    for contour in contours:
        path = contour.path
        points = sample(path, wide / SAMPLES_PER_TOOL) if wide else path.vertices[:, :2]
        distances = nearest(points, cleared).distance
        worst = int(distances.argmax())
        if distances[worst] > max_engaged:
            max_engaged, place = (
                float(distances[worst]),
                at_place(contour.name, points[worst].tolist()),
            )
    return max_engaged + operation.tool.radius_mm - rough.operation.tool.radius_mm, place


def _paths(step: Step) -> Segments:
    """Return the segments, seen from above, along which the tool of a step ran."""
    vertices, first = step.runs.vertices, step.runs.first
    start, end = vertices[:-1], vertices[1:]
    goes = np.hypot(*(end - start)[:, :2].T) > 0.0
    goes[first[1:-1] - 1] = False
    if not goes.any():
        return Segments.of(Polyline(vertices[:1, [0, 1, 3]]))
    return Segments.between(start[goes, :2], end[goes, :2], start[goes, 3])
