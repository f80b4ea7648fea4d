"""Pockets: all within closed contours is cleared, except islands, which stay.

    closed paths ─nesting─▶ regions ─shrunk by tool and allowance─▶ tool centre regions
    ─contour or zigzag─▶ paths in the plane ─levels, entry─▶ runs
    ─adaptive (`camtool.planning.adaptive`)─▶ runs

Closed contours count by nesting: what an odd number of them hold is cleared. Rings run so that
the teeth go with the feed (climb): round walls CCW and round islands CW, as a spindle turning CW
wants it. "conventional" is the opposite; "drawn" is climb too, because no ring is drawn.

The tool goes down once for each connected tool centre region, and stays at depth between rings:
links run within that region, so they cut nothing that is to stay. At each level it goes down from
the floor of the level before (at first from the stock's top), follows the path, and comes back
over the new floor to where it goes down again."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import partial
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.distance import points_to_segments
from camtool.geometry.intersect import meetings, self_crossings
from camtool.geometry.measure import extents, signed_areas
from camtool.geometry.nesting import oriented, regions
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse_lines,
)
from camtool.planning.adaptive import adaptive_runs, refuse_strategy, wide_parts
from camtool.planning.air import REST_OVERLAP, air_at, left_beside_mm, reached
from camtool.planning.clearing import (
    SLOT_TOLERANCE,
    ConnectedRegion,
    Scan,
    Steps,
    parts_of,
    pole,
    ring_cells,
    ring_paths,
    route,
    slot_paths,
    zigzag_paths,
)
from camtool.planning.findings import (
    CONTOUR_TOO_SMALL_POCKET,
    ENTRY_CHANGED_IN_POCKET,
    NO_REST,
    SLOT_AS_WIDE_ADAPTIVE,
    SLOT_AS_WIDE_IN_POCKET,
)
from camtool.planning.finish import along_walls
from camtool.planning.items import Air, Chosen, CutRun, Fixed, Setting, Work
from camtool.planning.job import Operation, Stock
from camtool.planning.naming import at_place, key_of, operation_name, tool_name
from camtool.planning.paths import MeasuredPath, join_paths
from camtool.planning.ramps import MIN_HELIX_SHARE, feeds_along, helix
from camtool.planning.reach import (
    cut_away_findings,
    scallop_findings,
    unreached,
    unreached_findings,
)

MAX_STEPS = 10_000

MAX_FRONTS = 1_000

MAX_HELIX_SHARE = 0.5
"""Default radius of a helix at most, over the tool's radius."""

MAX_HELIX_TURNS = 200

MAX_RAMP_LAPS = 20
"""A ramp that would go back and forth on the whole path more often than this becomes a plunge."""

Link = Callable[[Floats, Floats], Floats | None]
"""The function that returns the link (k, 3) over the floor from one place (2,) to another, None if
there is none."""


class Pocket(Struct, frozen=True, eq=False):
    """A region to be cleared, on the left of its closed paths, in the work frame; the name of its
    outer path, and the index of that in the placed drawing."""

    region: Polylines
    name: str
    source: int


class Cleared(Struct, frozen=True, eq=False):
    """The runs that clear a region, in order. `changed`: why an entry is not as asked for, with a
    run that has it; `is_rest`: other operations have cleared parts of the region; `narrow`: tool
    centre regions without room for adaptive clearing."""

    runs: list[CutRun]
    changed: dict[str, CutRun]
    is_rest: bool
    narrow: list[Polylines]


def checked(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation unchanged; OptionError for a strategy that pockets do not have."""
    refuse_strategy(operation, "adaptive")
    return operation


def pocket(chosen: Chosen, setting: Setting) -> Work:
    """Return one item for each region that the closed paths enclose (even-odd), and findings about
    what stays uncut.

    OptionError for an open path, for paths that cross, and for a tool that cuts no width."""
    _check(chosen, setting.operation)
    if setting.operation.stage == "finish":
        return _walls(chosen, setting)
    _check_step(chosen, setting.operation)
    items: list[Fixed] = []
    findings: list[Finding] = []
    for each in pockets(chosen):
        radius = setting.operation.tool.radius_mm
        centre_region = offset_shape(each.region, left_beside_mm(setting))
        slots = slot_paths(centre_region, radius)
        cleared = _cleared(slots, each, setting, chosen.air)
        if not cleared.runs:
            finding_for = _no_rest if cleared.is_rest else _too_small
            findings.append(finding_for(each, setting.operation))
            continue
        outline = each.region[0]
        items.append(Fixed(tuple(cleared.runs), setting, each.name, each.source, outline))
        findings += [_entry_finding(each, *change) for change in cleared.changed.items()]
        findings += [_slot(each, slot, setting.operation) for slot in slots]
        findings += [_narrow(each, part, setting.operation) for part in cleared.narrow]
        hair_mm = 2.0 * SLOT_TOLERANCE * setting.operation.tool.diameter_mm if slots else 0.0
        findings += unreached_findings(centre_region, setting, hair_mm=hair_mm)
        if setting.operation.engagement_rad is not None:
            findings += scallop_findings(centre_region, setting)
    findings += cut_away_findings(kept_by(chosen), setting.operation)
    return Work(tuple(items), tuple(findings))


def _walls(chosen: Chosen, setting: Setting) -> Work:
    """Return the contours of the finishing pass along the walls of all regions, and findings about
    what they do not reach."""
    operation = setting.operation
    paths, names, sources = list[Polyline](), list[str](), list[int]()
    findings: list[Finding] = []
    for each in pockets(chosen):
        centre_region = offset_shape(each.region, operation.allowance_mm)
        region = _without_lost_islands(each.region, operation.beyond_mm)
        walls = offset_shape(region, operation.away_mm)
        paths += walls
        names += [each.name] * len(walls)
        sources += [each.source] * len(walls)
        findings += unreached_findings(centre_region, setting)
    findings += cut_away_findings(kept_by(chosen), operation)
    return Work(along_walls(Polylines.of(paths), setting, names, sources), tuple(findings))


def kept_by(chosen: Chosen) -> Polylines:
    """Return the boundary of the material that the pockets leave, which lies on the left of its
    paths."""
    return reverse_lines(oriented(chosen.nesting))


def pockets(chosen: Chosen) -> list[Pocket]:
    """Return the regions that the closed paths enclose: each outer path with its islands."""
    return [
        Pocket(region, chosen.names[row], int(chosen.source[row]))
        for row, region in regions(chosen.nesting)
    ]


def _cleared(
    slots: list[Floats], each: Pocket, setting: Setting, airs: tuple[Air, ...]
) -> Cleared:
    """Return the runs that clear one region: its tool centre regions, each from the nearest end
    on, and its slots. `airs`: where earlier operations have cleared."""
    groups: list[list[CutRun]] = []
    changed_runs: dict[str, CutRun] = {}
    narrow: list[Polylines] = []
    wider = setting.operation.rest_of
    is_rest = wider is not None
    if wider is not None and wider.contract.rest == "corners":
        cleared = reached(each.region, wider, setting.operation.allowance_mm)
        airs = (*airs, Air(cleared, setting.levels_mm[-1]))
    for part in _tool_regions(each.region, setting):
        parts = []
        if setting.operation.engagement_rad is not None:
            parts = wide_parts(part, setting.operation.tool.radius_mm)
        for wide in parts:
            air = partial(air_at, airs, wide, setting)
            groups.append(adaptive_runs(wide, setting, each.name, air))
            is_rest = is_rest or not groups[-1]
        if parts:
            continue
        if setting.operation.engagement_rad is not None:
            narrow.append(part)
        connected, runs = ConnectedRegion(part), list[CutRun]()
        for path, region in clearing_paths(part, setting.operation):
            way_down = down_for(path, region, connected, setting)
            lowered = lowered_runs(path, way_down, over_floor(connected), setting, each.name)
            changed_runs.setdefault(way_down.changed, lowered[0])
            runs += lowered
        groups.append(runs)
    for path in slots:
        way_down = down_for(path, None, None, setting)
        groups.append(lowered_runs(path, way_down, back_along(path), setting, each.name))
        changed_runs.setdefault(way_down.changed, groups[-1][0])
    changed_runs.pop("", None)
    return Cleared(
        _nearest_next([group for group in groups if group]), changed_runs, is_rest, narrow
    )


def _tool_regions(region: Polylines, setting: Setting) -> list[Polylines]:
    """Return the connected tool centre regions that clear a region; after a wider tool, only those
    that clear what it left.

    The region is shrunk once by the tool's radius and the allowance together: where the allowance
    is negative, growing the region first would close gaps that the tool must not go through.

    A disc of radius r reaches into what one of radius R does not cover where its centre is in the
    region shrunk by r, and not in what a disc of radius R − r covers of that: for what R covers,
    shrunk by r, is what R − r covers of the region shrunk by r."""
    operation = setting.operation
    region = _without_lost_islands(region, operation.beyond_mm)
    tool_region = offset_shape(region, operation.tool.radius_mm + left_beside_mm(setting))
    wider = operation.rest_of
    is_adaptive = operation.engagement_rad is not None
    if wider is None or wider.contract.rest == "floor" or is_adaptive:
        return parts_of(tool_region)
    reached_mm = (1.0 + REST_OVERLAP) * wider.tool.radius_mm
    pieces = unreached(tool_region, reached_mm - operation.tool.radius_mm)
    return [piece.outline for piece in pieces]


def _without_lost_islands(region: Polylines, beyond_mm: float) -> Polylines:
    """Return the region without the islands that a cut beyond the lines takes away wholly.

    The tool need not go round them: between such an island and the wall it would leave material.
    The larger ones are an error of the job (`cut_away_findings`)."""
    if not beyond_mm:
        return region
    islands = region.select(range(1, len(region)))
    kept_islands = [
        row
        for row, island in enumerate(reverse_lines(islands), start=1)
        if len(offset_shape(Polylines.of([island]), beyond_mm))
    ]
    return region.select([0, *kept_islands])


def _nearest_next(groups: list[list[CutRun]]) -> list[CutRun]:
    """Return all runs in one list: after each group of runs, the group whose first run begins
    nearest."""
    runs: list[CutRun] = []
    remaining = list(groups)
    while remaining:
        tool_place = runs[-1].vertices[-1, :2] if runs else remaining[0][0].vertices[0, :2]
        begins = np.array([group[0].vertices[0, :2] for group in remaining])
        runs += remaining.pop(int(np.hypot(*(begins - tool_place).T).argmin()))
    return runs


def clearing_paths(
    part: Polylines, operation: Operation
) -> Iterator[tuple[Floats, ConnectedRegion]]:
    """Yield the paths through one connected tool centre region, each with the region in whose
    widest place (pole) the tool has most room to go down."""
    radius = operation.tool.radius_mm
    step = operation.step_over * operation.tool.diameter_mm
    forward = operation.direction != "conventional"
    if operation.pattern == "zigzag":
        for path in zigzag_paths(part, Scan(step, radius, operation.angle_rad, forward)):
            yield path, ConnectedRegion(part)
        return
    steps = Steps(step, radius, forward, operation.entry.kind == "helix")
    paths, first = ring_paths(ring_cells(part, steps), steps)
    for path in paths:
        yield path, first.region


def _check(chosen: Chosen, operation: Operation) -> None:
    """Raise OptionError for paths and tools that make no pocket."""
    operation_place = operation_name(operation)
    if operation.tool.radius_mm == 0.0 and len(chosen.lines):
        raise OptionError(
            "a pocket needs a tool that cuts a width",
            where=key_of(operation, "tool"),
            mend="give the tool a diameter",
        )
    if not chosen.lines.closed.all():
        row = int(np.argmin(chosen.lines.closed))
        place = at_place(chosen.names[row], chosen.lines[row].start.tolist())
        raise OptionError(
            f"the path {place} is open, so it cannot be a pocket",
            where=operation_place,
            mend="close it (perhaps with --gap), or leave it out by layer or colour",
        )
    segments = Segments.of(chosen.lines)
    crossings = self_crossings(segments)
    common, crosses = meetings(segments, crossings.row_a, crossings.row_b)
    if crosses.any():
        first = int(np.argmax(crosses))
        one, other = (int(segments.path[rows[first]]) for rows in (common.row_a, common.row_b))
        raise OptionError(
            f"paths of a pocket cross, so that its inside is not clear: {chosen.names[one]} and"
            f" {at_place(chosen.names[other], common.point[first].tolist())}",
            where=operation_place,
            mend="join or separate them in the drawing",
        )


def _check_step(chosen: Chosen, operation: Operation) -> None:
    """Raise OptionError for a step-over, or a limit of engagement, so small that the passes would
    be too many."""
    step = operation.step_over * operation.tool.diameter_mm
    size = float(np.ptp(extents(chosen.lines), axis=1).max()) if len(chosen.lines) else 0.0
    if operation.engagement_rad is not None:
        step = operation.tool.radius_mm * (1.0 - math.cos(operation.engagement_rad))
        if size > MAX_FRONTS * step:
            raise OptionError(
                f"steps of {step:.4g} mm make more than {MAX_FRONTS} fronts in {size:g} mm",
                file=chosen.file,
                where=key_of(operation, "engagement"),
                mend="give a larger engagement, or a larger tool",
            )
        return
    if size > MAX_STEPS * step:
        raise OptionError(
            f"a step-over of {step:g} mm makes more than {MAX_STEPS} rings in {size:g} mm",
            file=chosen.file,
            where=key_of(operation, "step_over"),
            mend="give a larger step-over, or a larger tool",
        )


def _too_small(each: Pocket, operation: Operation) -> Finding:
    return CONTOUR_TOO_SMALL_POCKET(
        where=at_place(each.name, extents(each.region).mean(axis=1).tolist()),
        measured=float(signed_areas(each.region).sum()),
        tool=tool_name(operation.tool),
    )


def _no_rest(each: Pocket, operation: Operation) -> Finding:
    return NO_REST(
        where=at_place(each.name, extents(each.region).mean(axis=1).tolist()),
        tool=tool_name(operation.tool),
        other=operation.rest or "what was cut before",
    )


def _entry_finding(each: Pocket, change: str, run: CutRun) -> Finding:
    return ENTRY_CHANGED_IN_POCKET(
        where=at_place(each.name, run.vertices[0, :2].tolist()), change=change
    )


def _slot(each: Pocket, slot: Floats, operation: Operation) -> Finding:
    is_limited = operation.engagement_rad is not None
    return (SLOT_AS_WIDE_ADAPTIVE if is_limited else SLOT_AS_WIDE_IN_POCKET)(
        where=at_place(each.name, slot[0, :2].tolist()),
        measured=operation.tool.diameter_mm,
        tool=tool_name(operation.tool),
    )


def _narrow(each: Pocket, part: Polylines, operation: Operation) -> Finding:
    centre = pole(part)
    room_mm = float(points_to_segments(centre[None, :], Segments.of(part)).min())
    return SLOT_AS_WIDE_ADAPTIVE(
        where=at_place(each.name, centre.tolist()),
        measured=operation.tool.diameter_mm + 2.0 * room_mm,
        tool=tool_name(operation.tool),
    )


class Down(Struct, frozen=True, eq=False):
    """The entry of the tool: a helix with `centre` (2,) and radius; or a ramp; or neither, which
    is a plunge. `changed` says how it differs from the entry that was asked for, "" if it does
    not."""

    centre: Floats | None = None
    radius_mm: float = 0.0
    ramp: bool = False
    changed: str = ""


def down_for(
    path: Floats,
    region: ConnectedRegion | None,
    full_region: ConnectedRegion | None,
    setting: Setting,
) -> Down:
    """Choose the entry: a helix about the pole of `region`, within `full_region`, if one was asked
    for and fits; else a ramp along the path; else a plunge."""
    entry = setting.operation.entry
    if entry.kind == "plunge":
        return Down()
    if entry.kind == "helix" and region is not None and full_region is not None:
        radius = setting.operation.tool.radius_mm
        wanted_mm = MAX_HELIX_SHARE * radius if entry.radius_mm is None else entry.radius_mm
        centre = pole(region.boundary)
        room = float(points_to_segments(centre[None, :], full_region.segments).min())
        fits = min(wanted_mm, room)
        turns = _descent(setting) / (2.0 * math.pi * max(fits, POSITION_EPS_MM))
        if fits >= min(MIN_HELIX_SHARE * radius, wanted_mm) and turns <= MAX_HELIX_TURNS:
            smaller = entry.radius_mm is not None and fits < wanted_mm
            change_words = (
                f"a helix of {fits:.4g} mm instead of {wanted_mm:g} mm" if smaller else ""
            )
            return Down(centre, fits, changed=change_words)
    change_words = "a ramp instead of a helix" if entry.kind == "helix" else ""
    if 0.5 * _descent(setting) <= MAX_RAMP_LAPS * MeasuredPath.of(Polyline(path)).total_mm:
        return Down(ramp=True, changed=change_words)
    return Down(changed=f"a plunge instead of a {entry.kind}")


def lowered_runs(
    path: Floats, way_down: Down, link: Link, setting: Setting, name: str
) -> list[CutRun]:
    """Return the runs that follow a path (n, 3) at all levels: a single run, or several where
    `link` finds no way back from the end to the entry."""
    runs: list[CutRun] = []
    parts: list[Floats] = []
    for above, level in pairwise((0.0, *setting.levels_mm)):
        entry = _entry(path, way_down, link, (above, level), setting)
        link_back = link(path[-1, :2], entry[0, :2]) if parts else None
        if parts and link_back is None:
            runs.append(_run(parts, setting, name))
            parts = []
        if link_back is not None:
            parts.append(_at_height(link_back, above))
        parts += [entry, _at_height(path, level)]
    return [*runs, _run(parts, setting, name)]


def _entry(
    path: Floats, way_down: Down, link: Link, heights: tuple[float, float], setting: Setting
) -> Floats:
    """Return the entry (k, 4) x, y, z, bulge from the floor above to the beginning of the path at
    its level."""
    above, level = heights
    begin = path[0, :2]
    drop = above - level
    slope = math.tan(setting.operation.entry.angle_rad)
    if way_down.ramp:
        return _ramp(path, drop / slope, heights)
    if way_down.centre is not None:
        down = helix(way_down.centre, way_down.radius_mm, begin, drop / slope)
        across = link(down[-1, :2], begin)
        if across is not None:
            flat = _at_height(across, level)
            return join_paths([np.insert(down, 2, _sloping(down, heights), axis=1), flat])
    if above == 0.0:
        return np.array([[*begin, level, 0.0]])
    return np.array([[*begin, above, 0.0], [*begin, level, 0.0]])


def _ramp(path: Floats, length: float, heights: tuple[float, float]) -> Floats:
    """Return a ramp (k, 4) that runs to and fro along the beginning of the path, and ends at its
    first point at full depth."""
    along = MeasuredPath.of(Polyline(path))
    laps = max(1, math.ceil(0.5 * length / along.total_mm))
    reach = 0.5 * length / laps
    forth = along.piece(0.0, reach)
    flat = join_paths([forth, along.piece(reach, 0.0)] * laps)
    return np.insert(flat, 2, _sloping(flat, heights), axis=1)


def _descent(setting: Setting) -> float:
    """Return the length in the plane, mm, of an entry at the given angle for the largest step
    down."""
    drop = max(above - level for above, level in pairwise((0.0, *setting.levels_mm)))
    return drop / math.tan(setting.operation.entry.angle_rad)


def _sloping(flat: Floats, heights: tuple[float, float]) -> Floats:
    """Return heights z (k,) along an open path (k, 3) that falls evenly from the first height to
    the second."""
    lengths = MeasuredPath.of(Polyline(flat)).reach
    above, level = heights
    return np.asarray(above + (level - above) * lengths / lengths[-1])


def _at_height(flat: Floats, z: float) -> Floats:
    """Return an open path (k, 3) as (k, 4) x, y, z, bulge at one height."""
    return np.insert(flat, 2, z, axis=1)


def _run(parts: list[Floats], setting: Setting, name: str) -> CutRun:
    vertices = join_paths(parts)
    feeds = setting.feeds
    return CutRun(vertices, feeds_along(vertices, feeds), feeds.plunge_mm_min, name)


def over_floor(region: ConnectedRegion) -> Link:
    """Return the function that links two points of a tool centre region within that region."""
    return lambda start, end: route(start, end, region)


def back_along(path: Floats) -> Link:
    """Return the function that links the end of the path to its beginning, back along the path
    itself."""
    along = MeasuredPath.of(Polyline(path))

    def link(start: Floats, end: Floats) -> Floats | None:
        if np.hypot(*(end - start)) <= POSITION_EPS_MM:
            return np.array([[*start, 0.0]])
        return along.piece(along.total_mm, 0.0)

    return link
