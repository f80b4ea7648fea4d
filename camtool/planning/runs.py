"""A contour, its start and direction chosen, as runs of the tool: how it goes in, down and out."""

from __future__ import annotations

from camtool.findings import Finding
from camtool.geometry.polylines import Floats, Polyline, Polylines
from camtool.planning.along import Along
from camtool.planning.items import Contour, Run
from camtool.planning.ramps import feeds_along, laps, lifted, to_and_fro


def runs_of(
    contour: Contour, path: Polyline, keep_out: Polylines | None = None
) -> tuple[list[Run], list[Finding]]:
    """The runs that cut a contour, and what did not go as the operation asks.

    `path` is the contour's path from the chosen start in the chosen direction. The tool must
    nowhere come nearer to the lines of `keep_out` than its radius while it comes or leaves.
    """
    along = Along.of(path)
    setting = contour.setting
    if path.closed:
        knots = [laps(along, setting.levels_mm, setting.operation.overlap_mm)]
    elif contour.reversible:
        knots = [to_and_fro(along, setting.levels_mm)]
    else:
        knots = [to_and_fro(along, (z,)) for z in setting.levels_mm]
    return [_run(contour, lifted(along, profile)) for profile in knots], []


def _run(contour: Contour, vertices: Floats) -> Run:
    feeds = contour.setting.feeds
    return Run(vertices, feeds_along(vertices, feeds), feeds.plunge_mm_min, contour.name)
