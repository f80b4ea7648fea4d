"""A contour, its start and direction chosen, as runs of the tool: how it goes in, down and out.

    paths ─MeasuredPaths─▶ lengths ─ramps─▶ profile of z ─tabs.raised─▶ lifted ─leads─▶ CutRun

A closed contour is one run: down, round and round, the overlap. With leads it is one run for each
pass, from the lead-in to the lead-out; where it ramps down, it stays one run, and goes out and
back at each level. An open one is one run, to and fro, when it is reversible, and else one run for
each pass. So the leads of a contour are cut step by step, as the contour itself."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.findings import Finding
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines
from camtool.planning.findings import ENTRY_CHANGED
from camtool.planning.items import RAPID, Bridge, Contour, Feeds, Runs
from camtool.planning.leads import NO_LEADS, KeepOut, Leads, leads_of
from camtool.planning.naming import at_place
from camtool.planning.paths import MeasuredPath, MeasuredPaths
from camtool.planning.ramps import (
    MAX_LAPS,
    ZProfile,
    feeds_along,
    laps,
    lift_paths,
    separate_laps,
    spiral,
    spiral_with_stops,
    to_and_fro,
)
from camtool.planning.tabs import Tab, bridges_of, raise_profile, tabs_of

CONTOURS_AT_ONCE = 1 << 12
"""Number of contours that are measured and lifted at a time; each takes about 2 KB meanwhile."""

START_SNAP_MM = 1e-3
"""A start nearer than this to a vertex is moved to that vertex, so that no shorter move arises."""

START_CORNER_RAD = 0.1
"""A path that turns by more than this at a vertex has a corner there."""

Heights = tuple[float | None, list[Tab]]
"""Inputs of the height of the tool: the angle of its ramps (None: it plunges), and the tabs."""


class CutContours(Struct, frozen=True, eq=False):
    """The runs that cut M contours, one contour after the other; the number of runs of each,
    `counts` (M,); findings where entry or leads differ from what was asked; and the bridges that
    the tabs leave."""

    runs: Runs
    counts: tuple[int, ...]
    findings: tuple[Finding, ...]
    bridges: tuple[Bridge, ...]


class _Pass(Struct, frozen=True, eq=False):
    """A run before it is made: the path, the profiles of height for its consecutive parts, and its
    leads."""

    along: MeasuredPath
    parts: list[ZProfile]
    leads: Leads


def runs_of(
    contours: Sequence[Contour], order: Ints, paths: Polylines, keep_out: KeepOut
) -> CutContours:
    """Return the runs that cut the contours of one operation, in the order of the indices `order`
    (M,).

    `paths` (M) are those of the contours, from the chosen starts in the chosen directions. On its
    leads the tool keeps away from the lines of `keep_out`. A ramp slopes by the entry's angle.
    OptionError for impossible tabs."""
    parts: list[Runs] = []
    counts: list[int] = []
    findings: list[Finding] = []
    bridges: list[Bridge] = []
    for begin in range(0, len(order), CONTOURS_AT_ONCE):
        rows = range(begin, min(begin + CONTOURS_AT_ONCE, len(order)))
        lot_contours = [contours[int(order[row])] for row in rows]
        lot_runs = _cut_lot(lot_contours, paths.select(rows), keep_out)
        parts.append(lot_runs.runs)
        counts += lot_runs.counts
        findings += lot_runs.findings
        bridges += lot_runs.bridges
    return CutContours(Runs.joined(parts), tuple(counts), tuple(findings), tuple(bridges))


def _cut_lot(contours: Sequence[Contour], paths: Polylines, keep_out: KeepOut) -> CutContours:
    """Return the runs that cut a part of the contours, in their order."""
    passes: list[_Pass] = []
    counts: list[int] = []
    findings: list[Finding] = []
    bridges: list[Bridge] = []
    for contour, along in zip(contours, MeasuredPaths(paths), strict=True):
        angle, angle_findings = _ramp_angle(contour, along)
        tabs, left_out = tabs_of(contour, along)
        pass_runs, leads = (_closed_passes if along.closed else _open_passes)(
            contour, along, (angle, tabs), keep_out
        )
        passes += pass_runs
        counts.append(len(pass_runs))
        findings += [*angle_findings, *left_out, *leads.findings]
        bridges += bridges_of(along, tabs, contour.setting.operation.tool, contour.name)
    names = [
        contour.name for contour, count in zip(contours, counts, strict=True) for _ in range(count)
    ]
    runs = _lift_passes(passes, contours[0].setting.feeds, names)
    return CutContours(runs, tuple(counts), tuple(findings), tuple(bridges))


def _lift_passes(passes: Sequence[_Pass], feeds: Feeds, names: Sequence[str]) -> Runs:
    """Return the passes with their heights as runs with these names; passes whose paths share
    columns are lifted together."""
    owner = [k for k, each in enumerate(passes) for _ in each.parts]
    parts = [part for each in passes for part in each.parts]
    columns: dict[int, list[int]] = {}
    for row, k in enumerate(owner):
        columns.setdefault(id(passes[k].along.paths), []).append(row)
    followed: list[list[Floats]] = [[] for _ in passes]
    for rows in columns.values():
        paths = passes[owner[rows[0]]].along.paths
        index = [passes[owner[row]].along.index for row in rows]
        lifts = lift_paths(paths, index, [parts[row] for row in rows])
        for row, vertices in zip(rows, lifts, strict=True):
            followed[owner[row]].append(vertices)
    led = [_with_leads(each, one.leads) for each, one in zip(followed, passes, strict=True)]
    table = led[0] if len(led) == 1 else np.concatenate(led)
    first = np.concatenate([[0], np.cumsum([len(each) for each in led])])
    return Runs(
        table,
        np.append(feeds_along(table, feeds), RAPID),
        first,
        np.full(len(led), feeds.plunge_mm_min),
        np.zeros(len(led)),
        tuple(names),
    )


def _closed_passes(
    contour: Contour, along: MeasuredPath, heights: Heights, keep_out: KeepOut
) -> tuple[list[_Pass], Leads]:
    """Return the passes round a closed contour, and its leads; `heights`: the angle of its ramp
    (None: plunge) and its tabs."""
    angle, tabs = heights
    levels, overlap = contour.setting.levels_mm, contour.setting.operation.overlap_mm
    total = along.total_mm
    stops: list[float] = []
    if angle is None:
        profiles = separate_laps(total, levels, overlap)
    else:
        profile, stops = spiral_with_stops(total, levels, overlap, angle)
        profiles = [profile]
    ends = profiles[0][0][0], profiles[-1][-1][0]
    leads = leads_of(contour, along, ends, keep_out)
    if len(leads.way_out) == 0 and angle is not None:
        profiles, stops = [spiral(total, levels, overlap, angle)], []
        leads = leads_of(contour, along, (profiles[0][0][0], ends[1]), keep_out)
    elif len(leads.way_out) == len(leads.way_in) == 0:
        profiles = [laps(total, levels, overlap)]
    parts = [_split_profile(raise_profile(profile, tabs, total), stops) for profile in profiles]
    return [_Pass(along, each, leads) for each in parts], leads


def _split_profile(points: ZProfile, stops: list[float]) -> list[ZProfile]:
    """Return the parts of the profile between these lengths."""
    parts: list[ZProfile] = []
    begin = 0
    for stop in stops:
        end = next(k for k in range(begin, len(points)) if points[k][0] == stop)
        parts.append(points[begin : end + 1])
        begin = end
    return [*parts, points[begin:]]


def _with_leads(parts: list[Floats], leads: Leads) -> Floats:
    """Return the run (n, 4) along parts (n, 4) of a contour, with the lead-in before the first
    part, the lead-out after the last, and the lead-out forth and back between two parts."""
    if len(leads.way_in) == len(leads.way_out) == 0:
        return parts[0]
    rows = [np.insert(leads.way_in[:-1], 2, parts[0][0, 2], axis=1)]
    for part in parts[:-1]:
        way_out = np.insert(leads.way_out[1:], 2, part[-1, 2], axis=1)
        part[-1, 3] = leads.way_out[0, 2]
        way_out[-1, 3] = 0.0 - leads.way_out[0, 2]
        rows += [part, way_out]
    last = parts[-1]
    last[-1, 3] = leads.way_out[0, 2] if len(leads.way_out) else 0.0
    return np.concatenate([*rows, last, np.insert(leads.way_out[1:], 2, last[-1, 2], axis=1)])


def _open_passes(
    contour: Contour, along: MeasuredPath, heights: Heights, keep_out: KeepOut
) -> tuple[list[_Pass], Leads]:
    """Return the passes along an open contour, and its leads, which are parts of its path."""
    angle, tabs = heights
    levels = contour.setting.levels_mm
    leads = leads_of(contour, along, (0.0, along.total_mm), keep_out)
    track = along
    if len(leads.way_in) or len(leads.way_out):
        vertices = along.path.vertices.copy()
        vertices[-1, 2] = leads.way_out[0, 2] if len(leads.way_out) else 0.0
        rows = [leads.way_in[:-1], vertices, leads.way_out[1:]]
        track = MeasuredPath.of(Polyline(np.concatenate(rows)))
        before = float(track.reach[len(leads.way_in[:-1])])
        tabs = [tab.moved(before) for tab in tabs]
    above = (0.0, *levels)
    passes = [levels] if contour.reversible else [(z,) for z in levels]
    profiles = [
        to_and_fro(track.total_mm, each, above[turn], angle) for turn, each in enumerate(passes)
    ]
    parts = [raise_profile(profile, tabs, None) for profile in profiles]
    return [_Pass(track, [each], NO_LEADS) for each in parts], leads


def _ramp_angle(contour: Contour, along: MeasuredPath) -> tuple[float | None, list[Finding]]:
    """Return the angle of the ramp, rad, None for a plunge; and a finding if a plunge replaces the
    ramp that was asked for."""
    operation = contour.setting.operation
    angle = operation.entry.angle_rad
    if operation.entry.kind == "plunge":
        return None, []
    ramp = -contour.setting.levels_mm[-1] / math.tan(angle)
    if ramp <= MAX_LAPS * along.total_mm:
        return angle, []
    finding = ENTRY_CHANGED(
        where=at_place(contour.name, along.path.start.tolist()),
        measured=ramp,
        limit=MAX_LAPS * along.total_mm,
        length=along.total_mm,
    )
    return None, [finding]


def with_starts(
    path: Polyline, rule: str | tuple[float, float], away_mm: float
) -> tuple[Polyline, Ints]:
    """Return the path, with one more vertex if needed, and the indices of the vertices at which it
    may begin.

    `rule` is one of STARTS, or a place (x, y) mm, which selects the nearest point of the path. The
    indices are empty (any start will do) for "nearest", for open paths, and if the path has no
    place of that kind.

    - "longest-line": the middle of the longest line; without lines, of the longest arc.
    - "corner": where the path turns, and where it begins to round a corner of the part, in an arc
      as large as the tool's centre is away from it, `away_mm`."""
    any_vertex = np.empty(0, dtype=np.int64)
    if not path.closed or rule == "nearest":
        return path, any_vertex
    along = MeasuredPath.of(path)
    if rule == "corner":
        # A turn by almost 180 degrees is the tip of a relief, no corner.
        bend = np.abs(along.turns)
        turns = (bend > START_CORNER_RAD) & (bend < math.pi - START_CORNER_RAD)
        is_round = np.abs(along.segments.radius - away_mm) <= POSITION_EPS_MM
        return path, np.flatnonzero(turns | is_round)
    length = _midpoint(along) if isinstance(rule, str) else along.nearest_to(rule)
    begun_path, start = _with_vertex(path, along, length)
    return begun_path, np.array([start], dtype=np.int64)


def _midpoint(along: MeasuredPath) -> float:
    """Return the length along the path to the midpoint of its longest line, or of its longest arc
    if it has no lines."""
    size = np.diff(along.reach)
    lines = np.where(along.segments.is_arc, 0.0, size)
    row = int((lines if lines.any() else size).argmax())
    return float(0.5 * (along.reach[row] + along.reach[row + 1]))


def _with_vertex(path: Polyline, along: MeasuredPath, length: float) -> tuple[Polyline, int]:
    """Return a measured path with a vertex at this length, and the index of the vertex."""
    distances = np.abs(along.reach - length)
    vertex = int(distances.argmin())
    if distances[vertex] <= START_SNAP_MM:
        return path, vertex % len(path)
    row = int(np.searchsorted(along.reach, length)) - 1
    begin, end = along.reach[row : row + 2]
    first = along.piece(begin, length)
    second = along.piece(length, end)
    parts = [path.vertices[:row], first[:1], second[:1], path.vertices[row + 1 :]]
    return Polyline(np.concatenate(parts), True), row + 1
