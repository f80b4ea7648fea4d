"""Carving with a V bit: the wider a place, the deeper the tip, so that both walls are cut at once.

    closed paths ──nesting──▶ regions ──medial trace──▶ discs ──bands of radii──▶ grooves, walls
                 ──graph──▶ walks ──depth by radius──▶ runs, one Fixed item per region

With the half angle α of the bit and the radius r of its flat tip, a disc of radius ρ is cut at the
surface when the tip is as deep as

    depth = (ρ − r) / tan α.

At convex corners ρ falls to 0 and the tip comes up to the surface, in the corner itself (a flat
tip stops where it no longer fits). Where the depth of the operation or the width of the bit does
not allow more, walls are cut at that depth, and the floor between them is left and reported: a
pocket with a flat tool clears it.

What is cut is right to `CARVE_TOLERANCE_MM`: all vertices lie on the medial axis or on the
parallel curve, exact to rounding; lines and arcs between them leave the axis, sideways and in
radius together, by no more than the tolerance; twigs that would reach no farther are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice, pairwise

import numpy as np

from camtool.errors import GeometryError, OptionError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.boxes import touching_boxes
from camtool.geometry.distance import points_to_segments
from camtool.geometry.intersect import MOST_PAIRS, meetings
from camtool.geometry.measure import segment_boxes
from camtool.geometry.medial import Trace, medial_trace
from camtool.geometry.nesting import nesting, regions
from camtool.geometry.polylines import Floats, Polylines, Segments
from camtool.planning.carving.graph import graph_of, lengths_of, walks, without_twigs
from camtool.planning.carving.pieces import Band, floor_area, grooves, walls, with_level
from camtool.planning.items import Chosen, Fixed, Run, Setting, Work
from camtool.planning.job import Operation
from camtool.planning.places import key_of

CROSSINGS_SHOWN = 3
"""So many places where paths cross are named."""

CARVE_TOLERANCE_MM = 5e-4
"""A carved wall may be off its line by this much: half a micrometre."""


@dataclass(frozen=True)
class Cone:
    """A V bit: the tangent of its half angle, the radius of its flat tip, mm, and the largest
    radius that it cuts at the surface, mm (inf: not known)."""

    slope: float
    tip_mm: float
    widest_mm: float

    @classmethod
    def of(cls, operation: Operation) -> Cone:
        """The V bit of an operation; OptionError when its tool is none."""
        tool = operation.tool
        if tool.kind != "v" or tool.tip_angle_rad is None:
            raise OptionError(
                "carving needs a V bit",
                where=key_of(operation, "tool"),
                mend='use a tool with kind = "v" and a tip_angle',
            )
        widest = tool.radius_mm or math.inf
        return cls(math.tan(0.5 * tool.tip_angle_rad), 0.5 * tool.tip_diameter_mm, widest)

    def radius_at(self, depth_mm: float) -> float:
        """Radius of what is cut at the surface with the tip so deep."""
        return min(self.tip_mm + depth_mm * self.slope, self.widest_mm)

    def depth_of(self, rho: Floats) -> Floats:
        """How deep the tip goes to cut these radii at the surface."""
        return np.maximum(rho - self.tip_mm, 0.0) / self.slope


@dataclass(frozen=True, eq=False)
class _Region:
    """A region to carve: its paths, its name, and the index of its outer path in the drawing."""

    lines: Polylines
    name: str
    source: int


def vcarve(chosen: Chosen, setting: Setting) -> Work:
    """One Fixed item for each region: what an even-odd reading of the closed paths fills.

    Where paths cross nobody knows what is filled: a finding of severity error, and no items.
    OptionError for an open path and for a tool that is no V bit.
    """
    cone = Cone.of(setting.operation)
    _refuse_open(chosen, setting.operation)
    crossing = list(islice(_crossings(chosen), CROSSINGS_SHOWN))
    if crossing:
        return Work((), tuple(crossing))
    items: list[Fixed] = []
    findings: list[Finding] = []
    for region in _regions(chosen):
        try:
            item, noticed = _carved(region, setting, cone)
        except GeometryError as error:
            return Work((), (_no_region(region, error),))
        items.extend(item)
        findings.extend(noticed)
    return Work(tuple(items), tuple(findings))


def _refuse_open(chosen: Chosen, operation: Operation) -> None:
    if not chosen.lines.closed.all():
        name = chosen.names[int(np.argmin(chosen.lines.closed))]
        raise OptionError(
            f"{name} is open and has no inside to carve",
            where=key_of(operation, "kind"),
            mend='close it, or take it with an operation of kind = "engrave"',
        )


def _crossings(chosen: Chosen) -> Iterator[Finding]:
    """The places where paths cross themselves or each other."""
    segments = Segments.of(chosen.lines)
    rows, nothing = np.arange(len(segments)), np.zeros(len(segments), dtype=np.int64)
    every = np.ones(len(segments), dtype=np.bool_)
    boxes = segment_boxes(segments)
    one, other = touching_boxes(boxes, nothing, rows, every, most=MOST_PAIRS)
    if len(one) == 0:
        return
    meets, crosses = meetings(segments, one, other)
    for row in np.flatnonzero(crosses).tolist():
        a, b = (chosen.names[segments.path[i[row]]] for i in (meets.row_a, meets.row_b))
        x, y = meets.point[row].tolist()
        yield Finding(
            Code.SELF_CROSSING,
            Severity.ERROR,
            f"{a} crosses {'itself' if a == b else b}: what is inside cannot be told; mend the"
            " drawing, or carve without it",
            where=_at(a, x, y),
        )


def _no_region(region: _Region, error: GeometryError) -> Finding:
    return Finding(
        Code.SELF_CROSSING,
        Severity.ERROR,
        f"{error.message}: what is inside cannot be carved; {error.mend}",
        where=f"{region.name} at {error.where}",
    )


def _regions(chosen: Chosen) -> Iterator[_Region]:
    outer = np.flatnonzero(nesting(chosen.lines).depth % 2 == 0)
    for row, lines in zip(outer.tolist(), regions(chosen.lines), strict=True):
        yield _Region(lines, chosen.names[row], int(chosen.source[row]))


def _carved(region: _Region, setting: Setting, cone: Cone) -> tuple[list[Fixed], list[Finding]]:
    """The item of one region, none if the tip fits nowhere, and what was noticed."""
    boundary, trace = medial_trace(region.lines, CARVE_TOLERANCE_MM)
    limits = [cone.tip_mm, *(cone.radius_at(-level) for level in setting.levels_mm)]
    for limit in sorted(set(limits)):
        trace = with_level(boundary, trace, limit)
    # Walking a piece twice takes no longer than coming down from safe z does.
    again = setting.safe_z_mm * setting.feeds.cut_mm_min / setting.feeds.plunge_mm_min
    paths: list[Floats] = []
    floor: list[Floats] = []
    for low, high in pairwise(limits):
        if high > low:
            band = Band(low, high, CARVE_TOLERANCE_MM)
            floor = walls(boundary, trace, high)
            paths += _walks(trace, floor, band, again)
    findings = [*_too_narrow(region, trace, cone), *_limited(region, trace, floor, limits[-1])]
    runs = tuple(_run(path, setting, cone, region.name) for path in paths)
    outline = region.lines[0]
    item = Fixed(runs, setting, region.name, region.source, outline)
    return [item] if runs else [], findings


def _walks(trace: Trace, floor: list[Floats], band: Band, again_mm: float) -> list[Floats]:
    """What is walked in one band: the grooves, the walls, and the middle of a round region."""
    graph = without_twigs(graph_of([*grooves(trace, band), *floor]), band.tolerance_mm)
    middle = trace.discs[int(np.argmax(trace.rho))]
    is_cut = band.low_mm < middle[2] <= band.high_mm
    lonely = is_cut and _passed_by(graph.pieces, middle[:2]) > band.tolerance_mm
    return [*walks(graph, again_mm), *([np.append(middle, 0.0)[None, :]] if lonely else [])]


def _passed_by(pieces: list[Floats], point: Floats) -> float:
    """How far in the plane pieces pass by a point, mm; inf if there are none."""
    rows = [np.column_stack([piece[:-1], piece[1:, :2]]) for piece in pieces]
    if not rows:
        return math.inf
    ends = np.concatenate(rows)
    segments = Segments.between(ends[:, :2], ends[:, 4:], ends[:, 3])
    return float(points_to_segments(point[None, :], segments).min())


def _run(path: Floats, setting: Setting, cone: Cone, name: str) -> Run:
    """The run along a path (n, 4) of x, y, rho, bulge.

    On a slope the tip goes down and up no faster than in a plunge.
    """
    z = 0.0 - cone.depth_of(path[:, 2])
    vertices = np.column_stack([path[:, :2], z, path[:, 3]])
    heights = np.abs(np.diff(z))
    slope = np.hypot(lengths_of(path), heights)
    feeds = setting.feeds
    steep = feeds.plunge_mm_min * slope / np.where(heights > 0.0, heights, np.inf)
    limit = np.where(heights > 0.0, steep, np.inf)
    return Run(vertices, np.minimum(feeds.cut_mm_min, limit), feeds.plunge_mm_min, name)


def _too_narrow(region: _Region, trace: Trace, cone: Cone) -> Iterator[Finding]:
    """What a flat tip cannot enter: all of the region, or its corners and narrow places."""
    from camtool.planning.reach import unreached

    tip, widest = 2.0 * cone.tip_mm, 2.0 * float(trace.rho.max())
    if widest <= tip:
        yield Finding(
            Code.CONTOUR_TOO_SMALL,
            Severity.WARNING,
            f"a flat tip of {tip:g} mm does not fit into this contour, which is {widest:.4g} mm"
            " wide: it is not carved",
            where=_at(region.name, *region.lines[0].start.tolist()),
            measured=widest,
            limit=tip,
            unit="mm",
        )
        return
    pieces = unreached(region.lines, cone.tip_mm)
    if pieces:
        area = sum(piece.area_mm2 for piece in pieces)
        yield Finding(
            Code.UNREACHED,
            Severity.WARNING,
            f"a flat tip of {tip:g} mm leaves {len(pieces)} corners or narrow places uncut,"
            f" {area:.4g} mm² in all: use a bit with a smaller tip",
            where=_at(region.name, *pieces[0].at_mm),
            measured=area,
            unit="mm2",
        )


def _limited(
    region: _Region, trace: Trace, floor: list[Floats], limit_mm: float
) -> Iterator[Finding]:
    if floor:
        row = int(np.argmax(trace.rho))
        area = floor_area(floor)
        yield Finding(
            Code.DEPTH_LIMITED,
            Severity.WARNING,
            f"a floor of {area:.6g} mm² is left: up to {2.0 * trace.rho[row]:.4g} mm wide, bit and"
            f" depth allow {2.0 * limit_mm:.4g} mm; clear it with a pocket and a flat tool",
            where=_at(region.name, float(trace.x[row]), float(trace.y[row])),
            measured=area,
            unit="mm2",
        )


def _at(name: str, x: float, y: float) -> str:
    return f"{name} at X {x:.4f} Y {y:.4f}"
