"""The bridges that tabs leave stay whole: whatever else is cut keeps above them.

A tab is made by the contour that it belongs to. The tool comes by again: round a neighbour that is
nearer than two slots are wide, on the other side of a narrow contour, on a lead, or in another
operation. What must stay is a rectangle, as wide as the bridge and as long as the slot is wide:

    ────────────────────────────  wall          A, B: where the tool goes up and comes down again
         ╭───╮ ┌─w─┐ ╭───╮                      the rectangle lies on the line through the middle
         │ A │ │   │ │ B │                      of the tab, square to the chord A B
         ╰───╯ └───┘ ╰───╯

A tool of radius r cuts into it where its middle is nearer than r to the rectangle. There its run
is raised to the top of the bridge, as by a tab of its own; so the neighbour has a bridge there
too, which is said.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.intersect import crossings
from camtool.geometry.measure import point_at, segment_boxes
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Polyline, Segments
from camtool.planning.contours.along import Along
from camtool.planning.contours.ramps import Knots, feeds_along, lifted
from camtool.planning.contours.tabs import Tab, raised
from camtool.planning.items import Bridge, Feeds, Run
from camtool.planning.job import Operation, Tool
from camtool.planning.places import at_place

BRIDGE_SLACK_MM = 1e-4
"""A bridge may be cut into by this much: by rounding, where its own contour goes up and down."""

QUARTER = math.tan(math.pi / 8.0)
"""The bulge of a quarter of a circle."""


def bridges_of(along: Along, tabs: Sequence[Tab], tool: Tool, name: str) -> list[Bridge]:
    """The bridges of the tabs of a contour; none for a tool that cuts no width."""
    found = []
    for tab in tabs if tool.radius_mm > 0.0 else ():
        a, b, middle = along.at(np.array([tab.begin, tab.end, 0.5 * (tab.begin + tab.end)]))
        size = math.hypot(*(b - a))
        ahead = (b - a) / size
        middle = middle + float((0.5 * (a + b) - middle) @ ahead) * ahead
        half = 0.5 * size - tool.radius_mm
        found.append(Bridge(middle, ahead, half, tool.radius_mm, tab.top_mm, tab.fall, name))
    return found


@dataclass(frozen=True, eq=False)
class Spared:
    """The runs of an operation, raised where they would have cut bridges, and what is to be said
    of that."""

    runs: tuple[Run, ...]
    findings: tuple[Finding, ...]


def spared(
    runs: Sequence[Run], operation: Operation, feeds: Feeds, bridges: Sequence[Bridge]
) -> Spared:
    """The runs of an operation, kept above all bridges."""
    import shapely

    if not bridges or not runs:
        return Spared(tuple(runs), ())
    reach = operation.tool.radius_mm
    tree = shapely.STRtree(shapely.box(*np.array([_box(bridge, reach) for bridge in bridges]).T))
    made, found = [], _Found()
    for run in runs:
        low, high = _extent(run)
        near = [bridges[k] for k in sorted(tree.query(shapely.box(*low, *high)).tolist())]
        made.append(_raised(run, near, operation.tool, feeds, found) if near else run)
    return Spared(tuple(made), tuple(found.told(operation)))


class _Found:
    """The bridges over which runs were raised, and those that a drill goes through."""

    def __init__(self) -> None:
        self.shared: dict[int, tuple[Bridge, str]] = {}
        self.drilled: dict[int, tuple[Bridge, str]] = {}

    def told(self, operation: Operation) -> Iterator[Finding]:
        if self.shared:
            bridge, name = next(iter(self.shared.values()))
            whose = "its own and its neighbours' tabs" if operation.tabs else "tabs"
            yield Finding(
                Code.TAB_SHARED,
                Severity.INFO if operation.tabs else Severity.WARNING,
                f"cuts are raised over {len(self.shared)} {whose}, which they would have cut away:"
                f" the first over one of {bridge.name}",
                where=at_place(name, bridge.middle.tolist()),
                measured=float(len(self.shared)),
                unit="tabs",
            )
        for bridge, name in self.drilled.values():
            yield Finding(
                Code.TAB_LEFT_OUT,
                Severity.WARNING,
                f"a hole is drilled through this tab of {bridge.name}: it may not hold",
                where=at_place(name, bridge.middle.tolist()),
            )


def _raised(run: Run, near: Sequence[Bridge], tool: Tool, feeds: Feeds, found: _Found) -> Run:
    """The run kept above the bridges near to it; itself when it is so already."""
    vertices = run.vertices
    moves = np.hypot(*np.diff(vertices[:, :2], axis=0).T) > POSITION_EPS_MM
    is_drilled = not moves.any()
    # Each place once, with the bulge with which it is left.
    group = np.concatenate([[0], np.cumsum(moves)])
    last = np.append(np.flatnonzero(moves), len(vertices) - 1)
    path = vertices[last][:, [0, 1, 3]]
    if is_drilled or np.isnan(run.feed_mm_min).any():
        for bridge in near:
            _drilled(run, bridge, tool, found)
        return run
    along = Along.of(Polyline(path))
    knots: Knots = list(zip(along.reach[group].tolist(), vertices[:, 2].tolist(), strict=True))
    low = np.full(len(along.segments), math.inf)
    for end in (0, 1):  # the height at both ends of each move
        z = vertices[np.flatnonzero(moves) + end, 2]
        low = np.minimum(low, z)
    tabs: list[Tab] = []
    for bridge in near:
        own = list(_over(along, low, bridge, tool))
        if own:
            found.shared[id(bridge)] = (bridge, run.name)
        tabs += own
    if not tabs:
        return run
    made = lifted(along, raised(knots, tabs, None))
    return replace(run, vertices=made, feed_mm_min=feeds_along(made, feeds))


def _drilled(run: Run, bridge: Bridge, tool: Tool, found: _Found) -> None:
    place, deep = run.vertices[:1, :2], float(run.vertices[:, 2].min())
    reach = tool.radius_mm - BRIDGE_SLACK_MM
    through = deep < bridge.top_mm and reach > 0.0
    if through and inside(place, Segments.of(_zone(bridge, reach)))[0]:
        found.drilled[id(bridge)] = (bridge, run.name)


def _over(along: Along, low: Floats, bridge: Bridge, tool: Tool) -> Iterator[Tab]:
    """The stretches of a path, with the lowest z (n,) of each of its segments, where the tool
    would cut into a bridge."""
    is_low = low < bridge.top_mm - POSITION_EPS_MM
    if not is_low.any():
        return
    reach = _radius_at(tool, bridge.top_mm - float(low.min())) - BRIDGE_SLACK_MM
    if reach <= 0.0:
        return
    zone = Segments.of(_zone(bridge, reach))
    boxes, around = segment_boxes(along.segments), segment_boxes(zone)
    lowest, highest = around[:, :2].min(axis=0), around[:, 2:].max(axis=0)
    rows = np.flatnonzero(((boxes[:, :2] <= highest) & (boxes[:, 2:] >= lowest)).all(axis=1))
    if not is_low[rows].any():
        return
    meets = crossings(along.segments[rows], zone)
    spans: list[tuple[float, float, bool]] = []
    for k, row in enumerate(rows.tolist()):
        parts = np.unique(np.concatenate([[0.0, 1.0], meets.ta[meets.row_a == k]]))
        middles = 0.5 * (parts[:-1] + parts[1:])
        within = inside(point_at(along.segments, np.full(len(middles), row), middles), zone)
        begin, size = along.reach[row], along.reach[row + 1] - along.reach[row]
        for i in np.flatnonzero(within).tolist():
            first, last = float(begin + size * parts[i]), float(begin + size * parts[i + 1])
            deep = bool(is_low[row]) and last - first > POSITION_EPS_MM
            if spans and first - spans[-1][1] <= POSITION_EPS_MM:
                first, _, was = spans.pop()
                deep = deep or was
            spans.append((first, last, deep))
    # What is up already, by a tab of its own, belongs to the stretch: it does not go down between.
    for first, last, deep in spans:
        if deep:
            yield Tab(first, last, bridge.top_mm, bridge.fall)


def _zone(bridge: Bridge, reach_mm: float) -> Polyline:
    """Where the middle of a tool of this radius would cut into a bridge."""
    aside = np.array([-bridge.ahead[1], bridge.ahead[0]])
    w, s, r = bridge.half_width_mm, bridge.half_span_mm, reach_mm
    corners = [
        (w + r, -s, 0.0), (w + r, s, QUARTER), (w, s + r, 0.0), (-w, s + r, QUARTER),
        (-w - r, s, 0.0), (-w - r, -s, QUARTER), (-w, -s - r, 0.0), (w, -s - r, QUARTER),
    ]  # fmt: skip
    rows = [[*(bridge.middle + t * bridge.ahead + n * aside), b] for t, n, b in corners]
    return Polyline(np.array(rows), closed=True)


def _radius_at(tool: Tool, above_tip_mm: float) -> float:
    """How wide the tool is so far above its tip."""
    if tool.tip_angle_rad is None or tool.kind == "drill":
        return tool.radius_mm
    wide = 0.5 * tool.tip_diameter_mm + above_tip_mm * math.tan(0.5 * tool.tip_angle_rad)
    return min(wide, tool.radius_mm or math.inf)


def _box(bridge: Bridge, reach: float) -> tuple[float, float, float, float]:
    size = math.hypot(bridge.half_width_mm, bridge.half_span_mm) + reach
    x, y = bridge.middle.tolist()
    return x - size, y - size, x + size, y + size


def _extent(run: Run) -> tuple[Floats, Floats]:
    """A box around a run; an arc of a half circle stays within its chord's length of its ends."""
    chords = np.hypot(*np.diff(run.vertices[:, :2], axis=0).T)
    bent = run.vertices[:-1, 3] != 0.0
    wide = float(chords[bent].max(initial=0.0))
    return run.vertices[:, :2].min(axis=0) - wide, run.vertices[:, :2].max(axis=0) + wide
