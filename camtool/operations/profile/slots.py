"""Trochoidal slots: a band beside the walls, wider than the tool, cleared with a limit of its
engagement.

The walls are those of an ordinary profile (`work.profile`), with what is to stay on their left.
The band are the places of the tool's centre that are not farther from a wall than the slot is
wider than the tool. So bands of neighbours merge, and holes that are narrower are cleared wholly.
Circles run along the middle of the band (`camtool.planning.trochoids`); the cusps that they leave
at the wall are cleared, those on the other side stay. A pass along the wall comes last. On lines
the band lies on both sides, and is cleared to its edges.

Tabs reach across the whole slot. Levels above their top are cleared as without them, those below
it in the pieces between the tabs, each with a helix of its own. Then their tops are cleared, from
what is cleared beside them:

    ─────────────────────────────────────  wall
      ( ( ( ( ( (  │ tab │  ( ( ( ( ( ( (  band
    ─────────────────────────────────────  far side"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.distance import nearest
from camtool.geometry.measure import path_lengths
from camtool.geometry.nesting import inside
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    begin_at,
    reverse_lines,
)
from camtool.planning.adaptive import (
    CORNER_SHARE,
    AdaptiveStays,
    adaptive_legs,
    entry_mm,
    mirrored,
    refuse_feeds_and_lift,
    refuse_strategy,
    runs_of,
    union_of,
    wide_parts,
    wide_parts_within,
)
from camtool.planning.clearing import outside_parts, parts_of
from camtool.planning.contours import with_starts
from camtool.planning.items import Bridge, Chosen, Contour, CutRun, Fixed, Setting, Work
from camtool.planning.job import Operation, Stock, refuse_endless
from camtool.planning.naming import key_of, tool_name
from camtool.planning.paths import MeasuredPath
from camtool.planning.tabs import (
    Span,
    bridge_zone,
    bridges_of,
    middle_of_longest_gap,
    tabs_of,
    with_tabs,
)
from camtool.planning.trochoids import band_of, cusp_mm, trochoid_stays, trochoid_step
from camtool.records import replace

MIN_SLOT_SHARE = 1.1
MAX_SLOT_SHARE = 3.0
"""Narrowest and widest slot, over the tool's diameter."""

FOOT_SHARE = 1.1 * CORNER_SHARE
"""Radius of the finishing pass in corners of a slot, over the tool's radius."""

TAB_CORNER_SHARE = 0.25
"""Radius to which the corners between a tab and the sides of its slot stay round, over the tool's
radius: sharper ones would take many small cuts, and each tab four of them."""

MAX_CORNER_SHARE = 0.9
"""The same is no larger than this part of the circles' radius."""

BESIDE_CORNERS = 1.1
"""The pass along the wall begins to rise so many such radii before a tab."""

AIR_HALVES = 4.0
"""The top of a tab is cleared from a stretch of the slot before it as long as so many radii of its
circles."""

MOVES_ROUND = 5.0
"""Number of moves of one circle and its way back, for an estimate."""

NEAR_SHARE = 0.05
"""A wall begins no farther than this part of the tool's radius from the band that it bounds."""


def checked_slot(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation unchanged. OptionError for a strategy that profiles do not have, for a
    slot too narrow or too wide, and for settings that contradict a slot."""
    refuse_strategy(operation, "trochoidal")
    if not operation.makes_slots:
        return operation

    def refuse(key: str, message: str, mend: str) -> OptionError:
        return OptionError(message, where=key_of(operation, key), mend=mend)

    tool = operation.tool
    if not tool.diameter_mm:
        raise refuse("tool", "a trochoidal slot needs a tool that cuts a width", "give a diameter")
    width = operation.spare_mm + tool.diameter_mm
    low, high = MIN_SLOT_SHARE * tool.diameter_mm, MAX_SLOT_SHARE * tool.diameter_mm
    if not low <= width <= high:
        raise refuse(
            "slot_width",
            f"a slot of {width:.4g} mm is not within {low:.4g} mm and {high:.4g} mm,"
            f" {MIN_SLOT_SHARE:g} and {MAX_SLOT_SHARE:g} times the diameter of {tool_name(tool)}",
            "give a width within these; a pocket clears more",
        )
    if operation.tabs is not None and operation.tabs.ramped:
        raise refuse(
            "tabs",
            "tabs in a trochoidal slot have straight sides",
            "leave ramped out: the tool goes down in a helix beside them",
        )
    for key, is_plain in (
        ("corners", operation.corners == "none"),
        ("joins", operation.joins == "round"),
    ):
        if not is_plain:
            raise refuse(
                key,
                "does not go with a trochoidal slot",
                'leave it out, or give strategy = "passes"',
            )
    return operation


class SlotWall(Struct, frozen=True, eq=False):
    """A path of the tool's centre along a wall, with the material that stays on its left, and the
    chosen path that it belongs to."""

    path: Polyline
    source: int


def without_feet(path: Polyline, tool_mm: float) -> Polyline:
    """Return the path of a tool along a wall (material on its left) with inner corners rounded to
    the radius up to which the discs of a slot clear. In the sharp corners left between these discs
    the finishing pass would be engaged more."""
    radius = FOOT_SHARE * tool_mm
    free_side = reverse_lines(Polylines.of([path]))
    reached = reverse_lines(offset_shape(offset_shape(free_side, radius), -radius))
    return reached[0] if len(reached) == 1 else path


class _Band(Struct, frozen=True, eq=False):
    """A region of tool centres to be cleared; the lines along its middle; the paths that bound it
    (Polylines), and the chosen path that each of these belongs to."""

    region: Polylines
    lines: Polylines
    bounds: Polylines
    sources: Ints


def slot_work(
    walls: list[SlotWall],
    open_rows: list[int],
    contours: list[Contour],
    chosen: Chosen,
    setting: Setting,
    findings: Iterable[Finding],
) -> Work:
    """Return one item for each connected slot, beside walls and along open paths, with these
    findings and those about tabs. `contours`: the same walls and paths as an ordinary profile
    would cut them."""
    refuse_feeds_and_lift(setting)
    bands = list(_beside(walls, chosen, setting.operation))
    spare = setting.operation.spare_mm
    if open_rows:
        lines = chosen.lines.select(open_rows)
        bands.append(_Band(band_of(lines, 0.5 * spare), lines, lines, np.array(open_rows)))
    _refuse_endless(bands, setting)
    bridges, tab_findings = _bridges(contours)
    items = [item for band in bands for item in _items(band, bridges, chosen, setting)]
    return Work(items, (*findings, *tab_findings), tuple(bridges))


def _bridges(contours: list[Contour]) -> tuple[list[Bridge], list[Finding]]:
    """Return the bridges across slots that the tabs of contours leave, and findings about tabs
    that are left out."""
    tabbed, findings = with_tabs(contours)
    bridges = list[Bridge]()
    for number, contour in enumerate(tabbed):
        operation = contour.setting.operation
        if operation.tabs is None:
            continue
        along = MeasuredPath.of(_begun(contour))
        others = [each.path for other, each in enumerate(contours) if other != number]
        is_left, spare = contour.material_left, operation.spare_mm
        span = Span(
            (0.5 if is_left is None else 0.0 if is_left else 1.0) * spare,
            (0.5 if is_left is None else 1.0 if is_left else 0.0) * spare,
            Segments.of(Polylines.of(others)) if others else None,
            BESIDE_CORNERS * _corner_mm(operation),
        )
        tabs, left_out = tabs_of(contour, along, span)
        findings += left_out
        bridges += bridges_of(along, tabs, operation.tool, contour.name, span)
    return bridges, findings


def _corner_mm(operation: Operation) -> float:
    """Return the radius to which corners beside tabs stay round, mm."""
    return min(
        TAB_CORNER_SHARE * operation.tool.radius_mm, MAX_CORNER_SHARE * 0.5 * operation.spare_mm
    )


def _begun(contour: Contour) -> Polyline:
    """Return the path of a contour from where its pass along the wall begins: where two shares of
    its tabs meet, so that none stands there."""
    operation = contour.setting.operation
    tabs, rule = operation.tabs, operation.start
    if rule == "nearest":
        rule = "longest-line"
        if tabs is not None and tabs.at_mm is not None and contour.path.closed:
            rule = middle_of_longest_gap(contour.path, tabs.at_mm)
    path, starts = with_starts(contour.path, rule, operation.away_mm)
    return begin_at(path, int(starts[0])) if len(starts) else path


def _beside(walls: list[SlotWall], chosen: Chosen, operation: Operation) -> Iterator[_Band]:
    """Yield the bands beside walls, one for the walls of each region, without the cusps that
    trochoids leave on the far side."""
    half = 0.5 * operation.spare_mm
    assert operation.engagement_rad is not None
    cusp = cusp_mm(half, operation.tool.radius_mm, operation.engagement_rad)
    depth = chosen.nesting.levels.depth
    regions: dict[int, list[SlotWall]] = {}
    for wall in walls:
        number = int(depth[wall.source])
        if operation.side == "auto":
            number = (number + chosen.rim[wall.source]) % 2
        regions.setdefault(number, []).append(wall)
    for group in regions.values():
        bounds = Polylines.of(wall.path for wall in group)
        far = offset_shape(bounds, cusp - 2.0 * half)
        yield _Band(
            Polylines.joined([far, reverse_lines(bounds)]),
            offset_shape(bounds, -half),
            bounds,
            np.array([wall.source for wall in group]),
        )


def _refuse_endless(bands: list[_Band], setting: Setting) -> None:
    """Raise OptionError if the bands would take more circles than is reasonable for any
    machine."""
    operation = setting.operation
    assert operation.engagement_rad is not None
    half = 0.5 * operation.spare_mm
    step = trochoid_step(half, operation.tool.radius_mm, operation.engagement_rad)
    total = sum(float(path_lengths(band.lines).sum()) for band in bands)
    refuse_endless(
        MOVES_ROUND * len(setting.levels_mm) * total / step,
        key_of(operation, "engagement"),
        f"circles every {step:.3g} mm along {total:.4g} mm",
        "give a larger engagement, or a wider slot",
        is_long=operation.may_be_long,
    )


def _items(
    band: _Band, bridges: list[Bridge], chosen: Chosen, setting: Setting
) -> Iterator[Fixed]:
    """Yield one item for each connected part of a band."""
    tool_mm = setting.operation.tool.radius_mm
    starts = band.bounds.vertices[band.bounds.offsets[:-1], :2]
    for part in wide_parts(band.region, tool_mm):
        distances = nearest(starts, Segments.of(part)).distance
        row = int(band.sources[distances.argmin()])
        yield Fixed(
            tuple(_runs(part, band.lines, bridges, setting, chosen.names[row])),
            setting,
            chosen.names[row],
            int(chosen.source[row]),
            outline=part[0],
            centre_lines=Polylines.joined([part, band.lines]),
        )


def _runs(
    part: Polylines, lines: Polylines, bridges: list[Bridge], setting: Setting, name: str
) -> Iterator[CutRun]:
    """Yield the runs that clear a connected part of a band: down to the last level above the top
    of bridges the whole of it, then the pieces between these, and at last their tops."""
    operation, top_mm = setting.operation, _top_mm(bridges)
    tops_mm = [0.0, *(z for z in setting.levels_mm if z > top_mm - POSITION_EPS_MM)]
    bottoms_mm = [tops_mm[-1], *setting.levels_mm[len(tops_mm) - 1 :]]
    if len(tops_mm) > 1:
        yield from runs_of(_stays(part, lines, operation), setting, name, tops_mm)
    if len(bottoms_mm) > 1:
        regions = _between(part, bridges, operation)
        stays = list(_stays_between(regions, lines, bridges, operation))
        yield from runs_of(stays, setting, name, bottoms_mm)
        if tops_mm[-1] > top_mm + POSITION_EPS_MM:
            stays = list(_stays_over(part, regions, bridges, operation))
            yield from runs_of(stays, setting, name, (tops_mm[-1], top_mm))


def _top_mm(bridges: list[Bridge]) -> float:
    """Return the height of the top of tabs, which is the same for all of an operation; −inf
    without any."""
    return max((bridge.top_mm for bridge in bridges), default=-math.inf)


def _stays(region: Polylines, lines: Polylines, operation: Operation) -> list[AdaptiveStays]:
    """Return the stays that clear a connected part of a band, some of whose middle lines may lie
    in it."""
    assert operation.engagement_rad is not None
    if operation.direction == "conventional":
        region, lines = mirrored(region), mirrored(lines)
    tool_mm, half = operation.tool.radius_mm, 0.5 * operation.spare_mm
    helix_mm = entry_mm(operation)
    return trochoid_stays(region, lines, half, helix_mm, tool_mm, operation.engagement_rad)


def _zones(bridges: list[Bridge], wider_mm: float, operation: Operation) -> Polylines:
    """Return the zones of the tool's centre in which it would cut into bridges, grown by a
    length."""
    # Bridges count as wider, for the pass along the wall.
    reach_mm = operation.tool.radius_mm - BESIDE_CORNERS * _corner_mm(operation)
    return Polylines.of(bridge_zone(bridge, reach_mm + wider_mm) for bridge in bridges)


def _between(part: Polylines, bridges: list[Bridge], operation: Operation) -> list[Polylines]:
    """Return the connected parts between bridges of a part of a band. Only the corners beside the
    bridges are round."""
    tool_mm, corner_mm = operation.tool.radius_mm, _corner_mm(operation)
    regions = [
        *wide_parts(part, tool_mm, _zones(bridges, 0.0, operation), corner_mm),
        *wide_parts(part, tool_mm, _zones(bridges, 2.0 * corner_mm, operation)),
    ]
    return parts_of(union_of(regions))


def _stays_between(
    regions: list[Polylines], lines: Polylines, bridges: list[Bridge], operation: Operation
) -> Iterator[AdaptiveStays]:
    """Yield the stays that clear the parts of a band between bridges: after each the nearest
    one."""
    pieces = list(lines)
    for zone in _zones(bridges, 0.5 * operation.spare_mm, operation):  # circles stay beside it
        pieces = outside_parts(Polylines.of(pieces), Polylines.of([zone]))
    middle_pieces = Polylines.of(pieces)
    waiting = [_stays(region, middle_pieces, operation) for region in regions]
    place = np.zeros(2)
    while waiting:
        gaps = [math.hypot(*(stays[0].centre - place)) for stays in waiting]
        stays = waiting.pop(int(np.argmin(gaps)))
        place = stays[-1].stays[-1][-1].vertices[-1, :2] if stays[-1].stays else place
        yield from stays


def _stays_over(
    part: Polylines, regions: list[Polylines], bridges: list[Bridge], operation: Operation
) -> Iterator[AdaptiveStays]:
    """Yield the stays that clear a part of a band over bridges, each from what is cleared deeper
    before it (`regions`) to what is cleared behind it."""
    assert operation.engagement_rad is not None
    tool_mm, half = operation.tool.radius_mm, 0.5 * operation.spare_mm
    beside_mm = BESIDE_CORNERS * _corner_mm(operation)
    for bridge in bridges:
        edge_mm = bridge.half_width_mm - beside_mm + tool_mm
        over = _along(bridge, -edge_mm - half, edge_mm + beside_mm)
        before = _along(bridge, -edge_mm - AIR_HALVES * half, -edge_mm)
        air = [
            offset_shape(cleared, -tool_mm)
            for region in regions
            for cleared in wide_parts_within(region, tool_mm, before)
        ]
        for region in wide_parts_within(part, tool_mm, over):
            if inside(bridge.centre[None], Segments.of(region))[0]:
                shapes = region, Polylines.joined(air)
                if operation.direction == "conventional":
                    shapes = mirrored(shapes[0]), mirrored(shapes[1])
                yield adaptive_legs(
                    shapes[0], entry_mm(operation), tool_mm, operation.engagement_rad, shapes[1]
                )


def _along(bridge: Bridge, low_mm: float, high_mm: float) -> Polylines:
    """Return the outline of a stretch of the slot at a bridge, from one length to another along
    its contour, which count from the middle of the bridge."""
    middle, reach_mm = 0.5 * (low_mm + high_mm), 0.1 * (high_mm - low_mm)
    stretch = replace(
        bridge,
        centre=bridge.centre + middle * bridge.ahead,
        half_width_mm=0.5 * (high_mm - low_mm) - reach_mm,
    )
    return Polylines.of([bridge_zone(stretch, reach_mm)])
