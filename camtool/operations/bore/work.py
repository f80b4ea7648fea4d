"""Boring: circles wider than the tool are cut by a helix, from the top to the bottom.

    circles ──outermost, each once──▶ bores ──rings──▶ a helix each ──▶ a Fixed item per bore

For a circle of radius R and a tool of radius r the tool centre runs on a circle of radius
ρ = R − r − allowance (below 0 the hole is wider than drawn). One helix clears the ring from ρ − r
to ρ + r; where that leaves a core (ρ > r), which would come loose in a through cut, smaller rings
are bored first, from the inside out, a step-over apart at most. A ring goes down evenly, no
steeper than the angle of the entry and by no more than the step down in a turn, goes once round at
the bottom, and leaves for the centre:

          start ↓
        ╭───────╮      n turns, then one at the full depth,
        ╰─ ─ ─ ─╯      then to the centre and up
        ╭─ ─ ─ ─╮
        ╰───────╯
        ╰──→·

CCW the teeth of a spindle that turns CW go with the feed: inside a hole that is climb.

In a hole hardly wider than the tool (ρ below MIN_HELIX_SHARE · r) a helix has hundreds of turns,
in which the axes hardly move and the tool rubs: there the tool plunges in the middle, in pecks no
deeper than the step down and the tool's diameter, and goes once round at the full depth."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from camtool.arrays import Floats
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.distance import near_paths
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.findings import (
    ENTRY_CHANGED_IN_NARROW_BORE,
    ENTRY_CHANGED_STEEPER,
    GOUGE_BEYOND,
    GOUGE_MORE,
    NOT_BORED,
    NOT_BORED_TOO_SMALL,
    NOT_BORED_WITHIN,
    NOTHING_DRAWN_TO_BORE,
)
from camtool.planning.finish import along_walls
from camtool.planning.holes import (
    HOLE_SIZE_MM,
    SAME_HOLE_MM,
    Hole,
    circles_of,
    named,
    peck_depths,
    pecks,
    refuse_endless_pecks,
)
from camtool.planning.items import Chosen, Contour, CutRun, Fixed, Setting, Work
from camtool.planning.job import Operation
from camtool.planning.naming import at_place, key_of, operation_name, shortened_list, tool_name
from camtool.planning.paths import QUARTER
from camtool.planning.ramps import MIN_HELIX_SHARE, feeds_along

CORE_SHARE = 0.9
"""The innermost ring is no larger than this part of the tool's radius, so that no core stays."""

MAX_TURNS = 200

TURN_SLACK = 1e-9
"""A turn may go deeper than its limit by this part of it, by rounding."""


def bore(chosen: Chosen, setting: Setting) -> Work:
    """Return one Fixed item for each circle that is wider than the tool.

    Circles within another one are bored with it. Paths that are no circle, and circles without
    room for the tool, are named in findings. OptionError for a tool that cuts no width."""
    operation = setting.operation
    if operation.tool.radius_mm == 0.0 and len(chosen.lines):
        raise OptionError(
            "a bore needs a tool that cuts a width",
            where=key_of(operation, "tool"),
            mend="give the tool a diameter",
        )
    circles, other_names = circles_of(chosen)
    min_diameter = 2.0 * operation.away_mm + HOLE_SIZE_MM
    wide = [hole for hole in circles if _diameter(hole) > min_diameter]
    rejects = [hole for hole in circles if _diameter(hole) <= min_diameter]
    holes = _outermost(wide)
    findings = [*_no_circles(other_names), *_too_small(rejects, operation), *_inner(wide, holes)]
    findings += _cut_away_between(holes, operation)
    if not holes:
        findings.append(NOTHING_DRAWN_TO_BORE(where=operation_name(operation)))
    if operation.stage == "finish":
        return Work(_walls(holes, setting), tuple(findings))
    narrow_holes = [hole for hole in holes if _is_narrow(hole, operation)]
    refuse_endless_pecks(-setting.levels_mm[-1], _peck_mm(operation), narrow_holes, operation)
    items = []
    for hole in holes:
        runs, change_findings = (_plunged if hole in narrow_holes else _runs)(hole, setting)
        items.append(Fixed(runs, setting, hole.name, hole.source, hole.outline))
        findings += change_findings
    return Work(tuple(items), tuple(findings))


def _walls(holes: list[Hole], setting: Setting) -> list[Contour]:
    """Return the contours of the finishing pass along the walls of the bores."""
    clearance = setting.operation.away_mm
    rings = [
        helix(hole.at_mm, 0.5 * _diameter(hole) - clearance, 0.0, 0)[:4, [0, 1, 3]]
        for hole in holes
    ]
    paths = Polylines.of(Polyline(ring, closed=True) for ring in rings)
    names, sources = [hole.name for hole in holes], [hole.source for hole in holes]
    return along_walls(paths, setting, names, sources)


def radii(wide_mm: float, tool_mm: float, step_mm: float) -> list[float]:
    """Return the radii of the rings of the tool's centre, mm, from the inside out; the last is
    `wide_mm`. The first ring leaves no core, and neighbours are at most a step-over apart.

    >>> radii(1.0, 1.5, 1.2)
    [1.0]
    >>> [round(each, 6) for each in radii(4.5, 1.5, 1.2)]
    [1.35, 2.4, 3.45, 4.5]
    """
    first = min(wide_mm, CORE_SHARE * tool_mm)
    count = math.ceil((wide_mm - first) / step_mm * (1.0 - TURN_SLACK))
    steps = (wide_mm - first) / max(count, 1)
    return [*(first + k * steps for k in range(count)), wide_mm]


def _runs(hole: Hole, setting: Setting) -> tuple[tuple[CutRun, ...], list[Finding]]:
    """Return the runs of a bore, one helix for each ring, and findings where a helix is steeper
    than the entry's angle."""
    operation = setting.operation
    wide = 0.5 * _diameter(hole) - operation.away_mm
    step = operation.step_over * operation.tool.diameter_mm
    depth = -setting.levels_mm[-1]
    runs, steep_findings = [], list[Finding]()
    for radius in radii(wide, operation.tool.radius_mm, step):
        turns_wanted = _turns(radius, depth, operation)
        turns = min(turns_wanted, MAX_TURNS)
        if turns_wanted > turns and not steep_findings:
            angle = math.degrees(math.atan2(depth / turns, 2.0 * math.pi * radius))
            steep_findings.append(
                ENTRY_CHANGED_STEEPER(
                    where=at_place(hole.name, hole.at_mm),
                    measured=angle,
                    limit=MAX_TURNS,
                    wanted=math.degrees(operation.entry.angle_rad),
                )
            )
        vertices = _turned_vertices(helix(hole.at_mm, radius, depth, turns), hole, operation)
        feeds = setting.feeds
        along = feeds_along(vertices, feeds)
        runs.append(CutRun(vertices, along, feeds.plunge_mm_min, hole.name))
    return tuple(runs), steep_findings


def _turned_vertices(vertices: Floats, hole: Hole, operation: Operation) -> Floats:
    """Return the vertices of a CCW ring in the operation's direction: unchanged for climb,
    mirrored in place for conventional."""
    if operation.direction == "conventional":  # mirrored
        vertices[:, 1] = 2.0 * hole.at_mm[1] - vertices[:, 1]
        vertices[:, 3] *= -1.0
    return vertices


def _is_narrow(hole: Hole, operation: Operation) -> bool:
    """Return True if a bore is so little wider than the tool that it is plunged instead of cut by
    a helix."""
    wide = 0.5 * _diameter(hole) - operation.away_mm
    return wide < MIN_HELIX_SHARE * operation.tool.radius_mm


def _peck_mm(operation: Operation) -> float:
    """Return the depth of one peck of an end mill, mm."""
    widest = operation.tool.diameter_mm
    return widest if operation.step_down_mm is None else min(widest, operation.step_down_mm)


def _plunged(hole: Hole, setting: Setting) -> tuple[tuple[CutRun, ...], list[Finding]]:
    """Return the run of a narrow bore, and the finding that says so: plunge in the middle in
    pecks, once round at the full depth, back to the middle."""
    operation, feeds = setting.operation, setting.feeds
    wide = 0.5 * _diameter(hole) - operation.away_mm
    depths = peck_depths(-setting.levels_mm[-1], _peck_mm(operation))
    way_down, down_feeds = pecks(hole.at_mm, depths, setting)
    round_ = _turned_vertices(helix(hole.at_mm, wide, 0.0, 0), hole, operation)
    round_[:, 2] = -depths[-1]
    along = [*down_feeds, *[feeds.cut_mm_min] * len(round_)]
    vertices = np.concatenate([way_down, round_])
    finding = ENTRY_CHANGED_IN_NARROW_BORE(
        where=at_place(hole.name, hole.at_mm),
        measured=_diameter(hole),
        tool=tool_name(operation.tool),
        pecks=f" in {len(depths)} pecks of {depths[0]:.4g} mm" if len(depths) > 1 else "",
    )
    return (CutRun(vertices, np.array(along), feeds.plunge_mm_min, hole.name),), [finding]


def _turns(radius_mm: float, depth_mm: float, operation: Operation) -> int:
    """Return the number of turns of a helix: the fewest with which no turn is steeper than the
    entry's angle or deeper than the step down."""
    pitch = 2.0 * math.pi * radius_mm * math.tan(operation.entry.angle_rad)
    if operation.step_down_mm is not None:
        pitch = min(pitch, operation.step_down_mm)
    return max(1, math.ceil(depth_mm / pitch * (1.0 - TURN_SLACK)))


def helix(centre: tuple[float, float], radius_mm: float, depth_mm: float, turns: int) -> Floats:
    """Return (4 turns + 6, 4) x, y, z, bulge of a CCW helix about `centre`: from the stock top to
    the depth in this many turns, once round at the depth, and to the centre."""
    count = 4 * turns + 4
    quarter = np.arange(count + 1)
    x = centre[0] + radius_mm * np.array([1.0, 0.0, -1.0, 0.0])[quarter % 4]
    y = centre[1] + radius_mm * np.array([0.0, 1.0, 0.0, -1.0])[quarter % 4]
    z = -depth_mm * np.minimum(quarter / (4.0 * max(turns, 1)), 1.0)
    bulge = np.where(quarter < count, QUARTER, 0.0)
    return np.concatenate([np.column_stack([x, y, z, bulge]), [[*centre, -depth_mm, 0.0]]])


def _diameter(hole: Hole) -> float:
    return hole.diameter_mm or 0.0


def _outermost(circles: list[Hole]) -> list[Hole]:
    """Return the circles that lie in no other one, in their order; of equal circles only one."""
    if not circles:
        return []
    places = np.array([hole.at_mm for hole in circles])
    radius = 0.5 * np.array([_diameter(hole) for hole in circles])
    kept_rows: list[int] = []
    for k in np.argsort(-radius, kind="stable").tolist():
        distances = np.hypot(*(places[kept_rows] - places[k]).T)
        if not (distances + radius[k] <= radius[kept_rows] + SAME_HOLE_MM).any():
            kept_rows.append(k)
    return [circles[k] for k in sorted(kept_rows)]


def _inner(circles: list[Hole], bored: list[Hole]) -> Iterator[Finding]:
    names = [hole.name for hole in circles if hole not in bored]
    if names:
        yield NOT_BORED_WITHIN(where=named(names), measured=len(names))


def _too_small(holes: list[Hole], operation: Operation) -> Iterator[Finding]:
    if holes:
        yield NOT_BORED_TOO_SMALL(
            where=named([hole.name for hole in holes]),
            measured=min(map(_diameter, holes)),
            limit=2.0 * operation.away_mm,
            count=len(holes),
            tool=tool_name(operation.tool),
        )


def _cut_away_between(holes: list[Hole], operation: Operation) -> list[Finding]:
    """Return findings for pairs of bores that, being cut wider than drawn, leave nothing between
    them."""
    if not operation.beyond_mm or not holes:
        return []
    max_distance, findings = 2.0 * operation.beyond_mm, list[Finding]()
    circles = Polylines.of(hole.outline for hole in holes if hole.outline is not None)
    for one, other in near_paths(circles, circles, max_distance):
        first, second = holes[one], holes[other]
        distance = math.dist(first.at_mm, second.at_mm)
        gap = distance - 0.5 * (_diameter(first) + _diameter(second))
        if one < other and 0.0 < gap < max_distance:
            findings.append(
                GOUGE_BEYOND(
                    where=at_place(first.name, first.at_mm),
                    measured=max_distance,
                    tool=tool_name(operation.tool),
                    amount=operation.beyond_mm,
                )
            )
    return shortened_list(findings, GOUGE_MORE)


def _no_circles(names: list[str]) -> Iterator[Finding]:
    if names:
        yield NOT_BORED(where=named(names), measured=len(names))
