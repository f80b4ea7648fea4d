"""Profiles: on which lines the middle of the tool runs.

    drawing ──layers──▶ chosen paths ──origin──▶ work frame ──side──▶ offset contours

`auto` cuts closed paths that nothing or an even number of others hold on their outside (parts,
islands) and the others on their inside (holes). Open paths have no inside: the tool runs on them.
Every contour keeps the direction in which it was drawn.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from camtool.errors import OptionError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.distance import approach
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import extents, path_extents, signed_areas
from camtool.geometry.nest import nesting
from camtool.geometry.polylines import Floats, Ints, Polyline, Polylines
from camtool.geometry.transform import lines_moved
from camtool.planning.job import Job

GOUGE_TOLERANCE_MM = 1e-4
"""Another contour may be cut into by this much before it is a gouge: a tenth of a micrometre."""


@dataclass(frozen=True, eq=False)
class Contours:
    """What the middle of the tool follows, work frame, mm: `lines` (M paths); `source` (M,), the
    index of the path in the drawing that each came from; and what was noticed."""

    lines: Polylines
    source: Ints
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, eq=False)
class _Chosen:
    """The paths of the job's layers in the work frame, with their names for people."""

    lines: Polylines
    index: Ints
    names: tuple[str, ...]


def contours(drawing: Drawing, job: Job) -> Contours:
    """The lines that the middle of the tool follows; a stage of its own, to compare and draw.

    OptionError when the drawing has paths, but none on the job's layers.
    """
    chosen = _chosen(drawing, job)
    lines: list[Polyline] = []
    source: list[int] = []
    findings: list[Finding] = []
    if len(chosen.lines):
        for index, distance in enumerate(_distances(chosen.lines, job)):
            results, noticed = _tool_lines(chosen, index, float(distance), job)
            lines.extend(results)
            source.extend([index] * len(results))
            findings.extend(noticed)
    paths, rows = Polylines.of(lines), np.array(source, dtype=np.int64)
    findings.extend(_gouges(paths, rows, chosen, job))
    return Contours(paths, chosen.index[rows], tuple(findings))


def origin_shift(drawing: Drawing, job: Job) -> tuple[float, float]:
    """(dx, dy) mm that brings the drawing into the work frame, as the job's origin says.

    Lower left and centre are those of the box around the paths that are cut, as they are drawn.
    """
    index = _on_layers(drawing, job)
    if job.origin == "drawing" or len(index) == 0:
        return 0.0, 0.0
    (xmin, xmax), (ymin, ymax) = extents(drawing.paths.select(index)).tolist()
    if job.origin == "lower-left":
        return -xmin, -ymin
    return -0.5 * (xmin + xmax), -0.5 * (ymin + ymax)


def path_name(drawing: Drawing, index: int) -> str:
    """Layer and source of a path, as provenance and places in messages show it."""
    return f"{drawing.layers[index]}/{drawing.sources[index]}"


def _on_layers(drawing: Drawing, job: Job) -> list[int]:
    return [index for index, layer in enumerate(drawing.layers) if job.takes(layer)]


def _chosen(drawing: Drawing, job: Job) -> _Chosen:
    index = _on_layers(drawing, job)
    if not index and len(drawing.paths):
        known = ", ".join(sorted(set(drawing.layers)))
        raise OptionError(
            f"no path lies on the layers {', '.join(job.layers)}",
            file=drawing.file,
            mend=f"the drawing has: {known}",
        )
    lines = lines_moved(drawing.paths.select(index), *origin_shift(drawing, job))
    names = tuple(path_name(drawing, i) for i in index)
    return _Chosen(lines, np.array(index, dtype=np.int64), names)


def _distances(lines: Polylines, job: Job) -> Floats:
    """(M,) signed offset of each path, positive to the left of travel; 0 on the line.

    The inside of a path drawn CCW is on its left.
    """
    if job.side == "on" or job.radius_mm == 0.0:
        return np.zeros(len(lines))
    if job.side == "auto":
        inward = nesting(lines).depth % 2 == 1
    else:
        inward = np.full(len(lines), job.side == "inside")
    left = inward == (signed_areas(lines) > 0.0)
    return np.where(lines.closed, np.where(left, job.radius_mm, -job.radius_mm), 0.0)


def _tool_lines(
    chosen: _Chosen, index: int, distance: float, job: Job
) -> tuple[list[Polyline], list[Finding]]:
    """What the tool follows for one path, and what is to be said about it."""
    path = chosen.lines[index]
    if distance != 0.0:
        from camtool.geometry.offset import offset

        results = offset(path, distance)
        return results, [] if results else [_too_small(chosen, index, job)]
    sided = job.side in ("outside", "inside") and job.radius_mm > 0.0
    if path.closed or not sided:
        return [path], []
    finding = Finding(
        Code.OPEN_CONTOUR_ON_LINE,
        Severity.WARNING,
        f"an open contour has no {job.side}: the tool runs on the line",
        where=_at(chosen.names[index], path.start),
    )
    return [path], [finding]


def _too_small(chosen: _Chosen, index: int, job: Job) -> Finding:
    one = Polylines.of([chosen.lines[index]])
    area = abs(float(signed_areas(one)[0]))
    return Finding(
        Code.CONTOUR_TOO_SMALL,
        Severity.WARNING,
        f"a tool of {job.tool_diameter_mm:g} mm does not fit into this contour of {area:.6g} mm²:"
        " it is not cut",
        where=_at(chosen.names[index], extents(one).mean(axis=1)),
        measured=area,
        unit="mm2",
    )


def _gouges(lines: Polylines, source: Ints, chosen: _Chosen, job: Job) -> Iterator[Finding]:
    """Where the tool, following an offset contour, would cut into another closed contour."""
    limit = job.radius_mm - GOUGE_TOLERANCE_MM
    if job.side == "on" or limit <= 0.0:
        return
    for one, other in _neighbours(lines, chosen.lines, job.radius_mm):
        mine = int(source[one])
        if mine == other or not (chosen.lines.closed[mine] and chosen.lines.closed[other]):
            continue
        near = approach(lines[one], chosen.lines[other])
        if near.distance < limit:
            yield Finding(
                Code.GOUGE,
                Severity.WARNING,
                f"a tool of {job.tool_diameter_mm:g} mm cuts"
                f" {job.radius_mm - near.distance:.4g} mm into {chosen.names[other]}",
                where=_at(chosen.names[mine], np.array(near.point)),
                measured=near.distance,
                limit=job.radius_mm,
                unit="mm",
            )


def _neighbours(lines: Polylines, others: Polylines, reach: float) -> Iterator[tuple[int, int]]:
    """Pairs of paths whose boxes come within `reach` of each other."""
    import shapely

    def boxes(paths: Polylines, wider: float) -> object:
        box = path_extents(paths)
        low, high = box[:, :, 0] - wider, box[:, :, 1] + wider
        return shapely.box(low[:, 0], low[:, 1], high[:, 0], high[:, 1])

    one, other = shapely.STRtree(boxes(others, 0.0)).query(boxes(lines, reach))
    return zip(one.tolist(), other.tolist(), strict=True)


def _at(name: str, point: Floats) -> str:
    return f"{name} at X {point[0]:.4f} Y {point[1]:.4f}"
