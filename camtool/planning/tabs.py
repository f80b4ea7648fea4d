"""Tabs: where along a contour the tool keeps above a bridge that holds the part.

The tool sweeps a disc of radius r along its path. Of the material between two places A and B of
the path, where it goes up and comes down again, a bridge of the width w is left when

    |A B| = w + 2 r,

seen straight across: along a line the raised piece is w + 2 r long, along an arc a bit longer. No
other part of the path may come as near to the midpoint of A B as these two: it would cut the
bridge (as in a slot hardly wider than the tool, where there is nothing to hold on to). The sides
of a tab are straight up and down, or slope; the bridge is w wide at its top. Slopes keep to the
angle of the entry when that is a ramp, so that the tool never goes down more steeply.

In a slot that is wider than the tool (`Span`) the bridge reaches from the wall to the other side,
where stock must be left to hold on to: no wall is nearer there than that of the tab. Between two
tabs there is room for the circles that clear such a slot.

Tabs stand at the centre of equal shares of the path, or where they are wanted by hand. None lies
across a corner, its slopes included: not at a vertex where the path turns, and not on the arc on
which the tool goes round a corner of the drawing. One that would moves to the nearest place where
it does not, if there is one: within its share first, on a gentle bend if nothing is straight. The
start of a closed path is where two shares meet, so that no tab stands on the seam."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, distinct
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.boxes import BoxIndex
from camtool.geometry.distance import nearest, points_to_segments
from camtool.geometry.intersect import crossings
from camtool.geometry.measure import path_lengths, point_at, segment_boxes, signed_areas
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, Segments
from camtool.planning.findings import (
    TAB_LEFT_OUT,
    TAB_LEFT_OUT_DRILLED,
    TAB_LEFT_OUT_OF_ALL,
    TAB_LEFT_OUT_OF_SLOT,
    TAB_SHARED,
    TAB_SHARED_WITH_OWN,
)
from camtool.planning.items import Bridge, Contour, CutRun, Feeds, Runs
from camtool.planning.job import Operation, Tool, refuse_endless
from camtool.planning.naming import at_place, key_of, operation_name
from camtool.planning.paths import QUARTER, MeasuredPath
from camtool.planning.ramps import ZProfile, feeds_along, lift_paths
from camtool.records import replace

SIDE_ANGLE_RAD = 0.25 * math.pi
"""Slope of the sides of ramped tabs when the tool may plunge."""

COUNT_SLACK = 1e-9
"""The path may exceed the number of tabs times their spacing by this part, by rounding."""

TAB_CORNER_RAD = 0.1
"""A path that turns by more than this at a vertex has a corner, where no tab is put."""

GENTLE_RAD = 0.35
"""Where the path turns by more than this over a tab, a straighter place is better."""

ROUND_CORNER = 1.001
"""An arc whose radius is no larger than this times the distance of the tool's centre from the wall
goes round a corner of the drawing."""

PLACES_PER_SIDE = 32
"""Number of places on either side of the centre of its share that are tried for a tab on a
corner."""

PLACES_PER_TAB = 16.0
"""Places that are tried per length of a tab."""

MAX_PLACES_ROUND = 2048

PLACE_DECIMALS = 9
"""Two places are equally near when their distances, as shares of the whole path, agree to this
many decimals."""

FAR_FROM_PLACE = 2.0
"""A hand-placed tab belongs to no contour farther away than this many times the tool's diameter,
or (of a narrow tool) than this many times the tab's width."""

TAB_SLACK_MM = 1e-5
"""A bridge may be narrower than requested by this much."""

WIDTH_ROUNDS = 8
"""The length of a tab on a bend is found by this many rounds of PLACES_PER_SIDE trials, each round
finer."""

BRIDGE_SLACK_MM = 1e-4
"""A bridge may be cut into by this much, by rounding, where its own contour goes up and down."""


class Tab(Struct, frozen=True):
    """A tab on a path: from the length `begin` to `end` the tool is at `top_mm` or higher, and on
    both sides the height falls by `fall` mm per mm (infinite: vertically)."""

    begin: float
    end: float
    top_mm: float
    fall: float

    def foot(self, bottom_mm: float) -> float:
        """Return the length of the slope to each side that reaches down to the bottom, mm."""
        return (self.top_mm - bottom_mm) / self.fall

    def moved(self, by_mm: float) -> Tab:
        """Return the tab shifted along the path."""
        return Tab(self.begin + by_mm, self.end + by_mm, self.top_mm, self.fall)

    def holds(self, length: float) -> bool:
        """Return True if a tool at this length stands on the tab; False at its vertical edges."""
        return not math.isinf(self.fall) or self.begin < length < self.end

    def height(self, length: float) -> float:
        """Return the lowest z that the tab allows at this length, mm; −inf beside it."""
        distance = max(self.begin - length, length - self.end, 0.0)
        return self.top_mm - (self.fall * distance if distance else 0.0)


class Span(Struct, frozen=True, eq=False):
    """The slot wider than the tool that tabs span: its centre gets up to `left_mm` to the left of
    the contour and `right_mm` to the right. `walls`: the paths of the centre along all other walls
    and lines that the slots follow, None without any. `corner_mm`: bridges count as wider by twice
    this, so that a later pass keeps out of the corners beside them."""

    left_mm: float = 0.0
    right_mm: float = 0.0
    walls: Segments | None = None
    corner_mm: float = 0.0


AS_WIDE_AS_TOOL = Span()


def with_tabs(contours: list[Contour]) -> tuple[list[Contour], list[Finding]]:
    """Return the contours of an operation, without tabs on those that should have none, and a
    finding that counts these.

    Tabs hold parts: if an operation cuts parts free, its holes and open paths get no tabs, nor do
    contours that are too short. If it cuts none free, everything has tabs as asked. If nothing is
    long enough, `tabs_of` raises the error."""
    if not contours or not contours[0].setting.operation.tabs:
        return contours, []
    if contours[0].setting.operation.tabs.at_mm is not None:
        return _with_tabs_by_hand(contours), []
    parts = [k for k, each in enumerate(contours) if each.path.closed and not is_hole(each)]
    tabbed = {k for k in parts or range(len(contours)) if _is_long_enough(contours[k])}
    tabless = [each for k, each in enumerate(contours) if tabbed and k not in tabbed]
    if not tabless:
        return contours, []
    opens = sum(not each.path.closed for each in tabless)
    holes = sum(each.path.closed and is_hole(each) for each in tabless)
    kinds = (
        (holes, "holes"),
        (opens, "open"),
        (len(tabless) - holes - opens, "too short for them"),
    )
    setting = contours[0].setting
    finding = TAB_LEFT_OUT_OF_ALL(
        where=operation_name(setting.operation),
        measured=len(tabless),
        kinds=", ".join(f"{count} {kind}" for count, kind in kinds if count),
    )
    without_tabs = replace(setting, operation=replace(setting.operation, tabs=None))
    return [
        each if k in tabbed else replace(each, setting=without_tabs)
        for k, each in enumerate(contours)
    ], [finding]


def _with_tabs_by_hand(contours: list[Contour]) -> list[Contour]:
    """Return the contours, each with those of the hand-placed tabs that are nearest to it;
    OptionError for a place that is not near any contour."""
    setting = contours[0].setting
    operation = setting.operation
    tabs = operation.tabs
    assert tabs is not None
    assert tabs.at_mm is not None
    limit = FAR_FROM_PLACE * max(operation.tool.diameter_mm, tabs.width_mm)
    lines = Segments.of(Polylines.of(contour.path for contour in contours))
    nearest_lines = nearest(np.array(tabs.at_mm), lines)
    places: dict[int, list[tuple[float, float]]] = {}
    for place, distance, row in zip(
        tabs.at_mm, nearest_lines.distance.tolist(), nearest_lines.segment.tolist(), strict=True
    ):
        if distance > limit:
            raise OptionError(
                f"the tab at X {place[0]:g} Y {place[1]:g} is {distance:.4g} mm from the nearest"
                f" contour that is cut, more than {limit:g} mm",
                where=key_of(operation, "tabs"),
                mend="give a place on a contour, in the work frame (after [place])",
            )
        places.setdefault(int(lines.path[row]), []).append(place)
    contours_made = []
    for row, contour in enumerate(contours):
        own_tabs = replace(tabs, at_mm=tuple(places[row])) if row in places else None
        tabbed = replace(setting, operation=replace(operation, tabs=own_tabs))
        contours_made.append(replace(contour, setting=tabbed))
    return contours_made


def middle_of_longest_gap(
    path: Polyline, places: Sequence[tuple[float, float]]
) -> tuple[float, float]:
    """Return the point (x, y), mm, of a closed path midway in the longest piece between these
    places."""
    along = MeasuredPath.of(path)
    lengths = np.sort([along.nearest_to(place) for place in places])
    gaps = np.diff(np.append(lengths, lengths[0] + along.total_mm))
    row = int(gaps.argmax())
    x, y = along.at(lengths[row : row + 1] + 0.5 * gaps[row])[0].tolist()
    return x, y


def is_hole(contour: Contour) -> bool:
    """Return True if the material that stays lies around a closed contour, not within it."""
    if contour.material_left is None:
        return False
    ccw = bool(signed_areas(Polylines.of([contour.path]))[0] > 0.0)
    return ccw != contour.material_left


def _is_long_enough(contour: Contour) -> bool:
    """Return True if a contour is at least as long as its tabs together."""
    operation = contour.setting.operation
    total = float(path_lengths(Polylines.of([contour.path]))[0])
    model, foot = _model(operation, contour.setting.levels_mm[-1])
    count = _tab_count(total, operation)
    return count * (model.end + 2.0 * foot) <= total * (1.0 + COUNT_SLACK)


def tabs_of(
    contour: Contour, along: MeasuredPath, span: Span = AS_WIDE_AS_TOOL
) -> tuple[list[Tab], list[Finding]]:
    """Return the tabs of a contour, whose path from its start is `along`, in a slot that has this
    `span`, and findings for those that do not fit.

    OptionError for tabs that are higher than the cut is deep or together longer than the path."""
    operation = contour.setting.operation
    tabs = operation.tabs
    if tabs is None:
        return [], []
    bottom = contour.setting.levels_mm[-1]
    if tabs.height_mm > -bottom + POSITION_EPS_MM:
        raise OptionError(
            f"tabs of {tabs.height_mm:g} mm are higher than the cut of {-bottom:g} mm is deep",
            where=key_of(operation, "tabs"),
            mend="lower the tabs, or cut deeper",
        )
    model, foot = _model(operation, bottom)
    if tabs.at_mm is not None:
        centres = [along.nearest_to(place) for place in tabs.at_mm]
        half = 0.5 * along.total_mm
        ranges = [(length - half, length + half) for length in centres]
    else:
        count = _checked_tab_count(along.total_mm, operation, model.end + 2.0 * foot)
        size = along.total_mm / count
        centres = [(number + 0.5) * size for number in range(count)]
        ranges = [(number * size, (number + 1) * size) for number in range(count)]
    half_width = 0.5 * tabs.width_mm
    fitting = _Fitting(
        along, model, foot, half_width, _corners(along, operation), span, operation.tool.radius_mm
    )
    tabs_placed: list[Tab] = []
    findings = []
    for centre, share in zip(centres, ranges, strict=True):
        tab = fitting.nearest(centre, share, tabs_placed)
        if tab is None:
            place = at_place(contour.name, along.at(np.array([centre]))[0].tolist())
            is_slot = operation.makes_slots
            findings.append((TAB_LEFT_OUT_OF_SLOT if is_slot else TAB_LEFT_OUT)(where=place))
        else:
            tabs_placed.append(tab)
    return sorted(tabs_placed, key=lambda tab: tab.begin), findings


def _model(operation: Operation, bottom_mm: float) -> tuple[Tab, float]:
    """Return a tab of the operation that begins at the length 0, and the length on each side of it
    that its slope needs, or half a circle of a slot wider than the tool."""
    tabs = operation.tabs
    assert tabs is not None
    end, top = tabs.width_mm + operation.tool.diameter_mm, bottom_mm + tabs.height_mm
    if not tabs.ramped:
        model = Tab(0.0, end, top, math.inf)
    else:
        slopes = operation.entry.kind != "plunge"
        angle = min(SIDE_ANGLE_RAD, operation.entry.angle_rad) if slopes else SIDE_ANGLE_RAD
        model = Tab(0.0, end, top, math.tan(angle))
    return model, max(model.foot(bottom_mm), 0.5 * operation.spare_mm)


def raise_profile(points: ZProfile, tabs: list[Tab], total_mm: float | None) -> ZProfile:
    """Return the profile raised over the tabs. `total_mm`: the length of a closed path, on which
    the tabs come again in each lap; None for an open one."""
    if not tabs:
        return points
    result: ZProfile = []
    for (begin, z_begin), (end, z_end) in pairwise(points):
        # Only passes below its top are raised by a tab.
        near_tabs = [
            tab
            for tab in _tabs_between(tabs, total_mm, min(begin, end), max(begin, end))
            if min(z_begin, z_end) < tab.top_mm - POSITION_EPS_MM
        ]
        if begin == end:
            floor = max(
                [tab.height(begin) for tab in near_tabs if tab.holds(begin)], default=-math.inf
            )
            result += [(place, max(z, floor)) for place, z in ((begin, z_begin), (end, z_end))]
            continue
        slope = (z_end - z_begin) / (end - begin)  # infinite where the lengths hardly differ
        ends = {begin: z_begin, end: z_end}
        places = set(ends)
        for tab in near_tabs:
            places.update(_breaks(tab, begin, z_begin, slope))
        inside = sorted(p for p in places if min(begin, end) <= p <= max(begin, end))
        for p, q in pairwise(inside if begin < end else inside[::-1]):
            # The height of a straight tab jumps at its ends: the midpoint shows which side this
            # is.
            tabs_above = [tab for tab in near_tabs if tab.height(0.5 * (p + q)) > -math.inf]
            for place in (p, q):
                line = ends[place] if place in ends else z_begin + slope * (place - begin)
                result.append((place, max([line, *(tab.height(place) for tab in tabs_above)])))
    return [point for k, point in enumerate(result) if k == 0 or point != result[k - 1]]


def _tabs_between(tabs: list[Tab], total_mm: float | None, low: float, high: float) -> list[Tab]:
    """Return the tabs between two lengths along a path, repeated for each lap of a closed one."""
    if total_mm is None:
        return tabs
    laps = range(math.floor(low / total_mm), math.floor(high / total_mm) + 1)
    return [tab.moved(lap * total_mm) for lap in laps for tab in tabs]


def _breaks(tab: Tab, begin: float, z_begin: float, slope: float) -> list[float]:
    """Return the lengths at which the larger of two heights may change: a straight line of z that
    starts at (`begin`, `z_begin`) with this slope, and the tab."""
    places = [tab.begin, tab.end]
    if slope != 0.0:
        places.append(begin + (tab.top_mm - z_begin) / slope)
    if math.isinf(tab.fall):
        return places
    for corner, fall in ((tab.begin, tab.fall), (tab.end, -tab.fall)):
        if fall != slope:
            # top + fall (s − corner) = z + slope (s − begin)
            height_gap = tab.top_mm + fall * (begin - corner) - z_begin
            places.append(begin + height_gap / (slope - fall))
    return places


def _checked_tab_count(total_mm: float, operation: Operation, length_mm: float) -> int:
    """Return the number of tabs on a path; OptionError if, each with this length, they are
    together longer than the path."""
    count = _tab_count(total_mm, operation)
    if count * length_mm > total_mm * (1.0 + COUNT_SLACK):
        added = "width of the slot" if operation.makes_slots else "tool's diameter"
        raise OptionError(
            f"{count} tabs of {length_mm:.4g} mm (with the {added}) are longer than the"
            f" contour of {total_mm:.4g} mm",
            where=key_of(operation, "tabs"),
            mend="give fewer or narrower tabs, or leave small contours to another operation",
        )
    return count


def _tab_count(total_mm: float, operation: Operation) -> int:
    """Return the number of tabs that the operation asks for on a path of this length."""
    tabs = operation.tabs
    assert tabs is not None
    if tabs.spacing_mm is not None:
        refuse_endless(
            total_mm / tabs.spacing_mm,
            key_of(operation, "tabs"),
            f"tabs each {tabs.spacing_mm:g} mm",
            "give a larger spacing",
            is_long=operation.may_be_long,
        )
        return math.ceil(total_mm / tabs.spacing_mm * (1.0 - COUNT_SLACK))
    assert tabs.count is not None
    return tabs.count


class _Corners(Struct, frozen=True, eq=False):
    """The corners of a path as intervals (C, 2) of length, mm: `vertices` where it turns at all,
    those where it turns `sharply`, and `arcs` on which it rounds corners of the drawing, of which
    the `sharp_arcs` turn sharply."""

    vertices: Floats
    sharply: Floats
    arcs: Floats
    sharp_arcs: Floats


class _Fitting(Struct, frozen=True, eq=False):
    """The conditions under which tabs like the `model`, with slopes of `foot_mm`, fit on a path of
    a tool of `radius_mm`; `half_width_mm`: half the width of the bridge under them, which has this
    `span`."""

    along: MeasuredPath
    model: Tab
    foot_mm: float
    half_width_mm: float
    corners: _Corners
    span: Span
    radius_mm: float

    def nearest(
        self, centre: float, share: tuple[float, float], other_tabs: Sequence[Tab]
    ) -> Tab | None:
        """Return the possible tab nearest to a length. Places are tried in this order: straight
        ones, then those without a corner, at last those where only the bridge is off the corners;
        each first within the tab's own share of the path, then anywhere. None if it fits nowhere.
        """
        own_places = self._places(centre, share)
        anywhere = self._places(centre, (0.0, self.along.total_mm))
        for clear in (self._is_straight, self._is_off_corners, self._is_bridge_off_corners):
            for places in (own_places, anywhere):
                for place in places[clear(places)].tolist():
                    tab = self._tab_at(place, other_tabs)
                    if tab is not None:
                        return tab
        return None

    def _places(self, centre: float, span: tuple[float, float]) -> Floats:
        """Return lengths to try within an interval, the nearest to `centre` first; on a closed
        path distances count across the seam."""
        low, high = span
        count = math.ceil(PLACES_PER_TAB * (high - low) / self.model.end)
        count = min(max(count, 2 * PLACES_PER_SIDE), MAX_PLACES_ROUND)
        places = np.concatenate([[centre], np.linspace(low, high, count + 1)])
        total = self.along.total_mm
        if self.along.path.closed:
            places = np.where(places == total, total, places % total)
        offsets = places - centre
        if self.along.path.closed:
            offsets = (offsets + 0.5 * total) % total - 0.5 * total
        # Of two equally near places the one ahead comes first, regardless of rounding.
        distances = np.round(np.abs(offsets) / total, PLACE_DECIMALS)
        return np.asarray(places[np.lexsort([offsets < 0.0, distances])])

    def _is_straight(self, places: Floats) -> Bools:
        """Return the mask (P,) of lengths at which a tab with its slopes lies across no corner and
        no bend."""
        low, high = places - self._reach, places + self._reach
        bend = np.abs(self._heading(high) - self._heading(low))
        return np.asarray(self._is_off_corners(places) & (bend <= GENTLE_RAD))

    def _is_off_corners(self, places: Floats) -> Bools:
        """Return the mask (P,) of lengths at which a tab with its slopes lies across no corner."""
        corners = np.concatenate([self.corners.vertices, self.corners.arcs])
        return self._is_clear(places, self._reach, corners)

    def _is_bridge_off_corners(self, places: Floats) -> Bools:
        """Return the mask (P,) of lengths at which a tab lies across no sharp corner, and its
        bridge across no corner. Circles that are drawn as polygons have no sharp ones."""
        clear = self._is_clear(places, self._reach, self.corners.sharply)
        arcs = self.corners.sharp_arcs
        return np.asarray(clear & self._is_clear(places, self.half_width_mm, arcs))

    @property
    def _reach(self) -> float:
        return 0.5 * self.model.end + self.foot_mm

    def _is_clear(self, places: Floats, reach: float, corners: Floats) -> Bools:
        low, high = places - reach, places + reach
        begin, end = corners[:, 0] + TAB_SLACK_MM, corners[:, 1] - TAB_SLACK_MM
        touches = (low[:, None] < end) & (high[:, None] > begin)
        return np.asarray(~touches.any(axis=1))

    def _heading(self, lengths: Floats) -> Floats:
        """Return the direction (P,) of the path at these lengths, rad, without jumps of full
        turns."""
        reach, segments = self.along.reach, self.along.segments
        heading = np.cumsum(segments.sweep + self.along.turns) - segments.sweep
        row = np.clip(np.searchsorted(reach, lengths, side="right") - 1, 0, len(segments) - 1)
        part = (lengths - reach[row]) / np.diff(reach)[row]
        return np.asarray(heading[row] + segments.sweep[row] * np.clip(part, 0.0, 1.0))

    def _tab_at(self, centre: float, other_tabs: Sequence[Tab]) -> Tab | None:
        """Return the tab at a length, None if it has no room there beside others."""
        foot, total = self.foot_mm, self.along.total_mm
        half = _half_length(self.along, centre, self.model.end, min(centre, total - centre) - foot)
        if half is None:
            return None
        tab = Tab(centre - half, centre + half, self.model.top_mm, self.model.fall)
        room = 2.0 * foot - TAB_SLACK_MM
        if any(tab.begin < each.end + room and each.begin < tab.end + room for each in other_tabs):
            return None
        return tab if self._is_bridge_clear(tab) else None

    def _is_bridge_clear(self, tab: Tab) -> bool:
        """Return True if no other part of the path, and no other wall of a slot, comes nearer to
        the centre of the bridge than the ends of the tab do, nor to the stock that it ends at
        across a slot wider than the tool."""
        along, span = self.along, self.span
        ends = along.at(np.array([tab.begin, tab.end]))
        middle, normal = ends.mean(axis=0), _normal_of(ends[1] - ends[0])
        sides = [side for side in (span.left_mm, -span.right_mm) if side]
        away = [side + math.copysign(self.radius_mm, side) for side in sides]
        places = np.array([middle, *(middle + distance * normal for distance in away)])
        reach = np.hypot(*(places - ends[0]).T) - TAB_SLACK_MM
        other_spans = [(0.0, tab.begin), (tab.end, along.total_mm)]
        if along.path.closed:
            other_spans = [(tab.end, tab.begin + along.total_mm)]
        for begin, end in other_spans:
            piece = along.piece(begin, end)
            segments = Segments.between(piece[:-1, :2], piece[1:, :2], piece[:-1, 2])
            if (points_to_segments(places, segments).min(axis=1) < reach).any():
                return False
        return span.walls is None or bool((nearest(places, span.walls).distance >= reach).all())


def _corners(along: MeasuredPath, operation: Operation) -> _Corners:
    """Return the corners and tight arcs of a path, which tabs must avoid."""
    reach, total = along.reach, along.total_mm
    bend = np.abs(along.turns)

    def places_turning(min_turn: float) -> Floats:
        """Return (K, 2) the lengths (each twice, as an interval) at which the path turns by more
        than this angle, rad."""
        lengths = reach[: len(bend)][bend > min_turn]
        if along.path.closed and len(lengths) and lengths[0] == 0.0:
            lengths = np.append(lengths, total)
        return np.column_stack([lengths, lengths])

    clearance = operation.away_mm
    segments = along.segments
    tight = segments.is_arc & (segments.radius <= ROUND_CORNER * clearance)
    if tight.all():  # a round path is no corner
        tight = np.zeros(len(segments), dtype=np.bool_)
    arcs = np.column_stack([reach[:-1], reach[1:]])[tight]
    sharply = np.abs(segments.sweep[tight]) > GENTLE_RAD
    return _Corners(
        places_turning(TAB_CORNER_RAD), places_turning(GENTLE_RAD), arcs, arcs[sharply]
    )


def _half_length(along: MeasuredPath, centre: float, chord: float, room: float) -> float | None:
    """Return half the length of the piece about a place whose ends are `chord` apart in a straight
    line; None if that exceeds `room`."""

    def lacks(halves: Floats) -> Floats:
        ends = along.at(centre + halves) - along.at(centre - halves)
        return np.asarray(chord - np.hypot(ends[:, 0], ends[:, 1]))

    half = 0.5 * chord
    if half > room + TAB_SLACK_MM:
        return None
    if lacks(np.array([half]))[0] <= TAB_SLACK_MM:  # along a line
        return half
    low, high = half, room
    for _ in range(WIDTH_ROUNDS):
        tries = np.linspace(low, high, PLACES_PER_SIDE)
        wide_enough = np.flatnonzero(lacks(tries) <= 0.0)
        if len(wide_enough) == 0:
            return None
        low, high = float(tries[max(wide_enough[0] - 1, 0)]), float(tries[wide_enough[0]])
    return high


def _normal_of(ahead: Floats) -> Floats:
    """Return the unit vector (2,) on the left of a direction (2,)."""
    return np.array([-ahead[1], ahead[0]]) / math.hypot(*ahead)


def bridges_of(
    along: MeasuredPath,
    tabs: Sequence[Tab],
    tool: Tool,
    name: str,
    span: Span = AS_WIDE_AS_TOOL,
) -> list[Bridge]:
    """Return the bridges that the tabs of a contour leave across a slot that has this span; none
    for a tool without width."""
    bridges = []
    for tab in tabs if tool.radius_mm > 0.0 else ():
        a, b, centre = along.at(np.array([tab.begin, tab.end, 0.5 * (tab.begin + tab.end)]))
        size = math.hypot(*(b - a))
        direction = (b - a) / size
        centre = centre + float((0.5 * (a + b) - centre) @ direction) * direction
        centre = centre + 0.5 * (span.left_mm - span.right_mm) * _normal_of(direction)
        half = 0.5 * size - tool.radius_mm + span.corner_mm
        half_span = tool.radius_mm + 0.5 * (span.left_mm + span.right_mm)
        bridges.append(Bridge(centre, direction, half, half_span, tab.top_mm, tab.fall, name))
    return bridges


class RaisedRuns(Struct, frozen=True, eq=False):
    """The runs of an operation, raised where they would have cut bridges, with findings about
    that."""

    runs: Runs
    findings: tuple[Finding, ...]


def raised_over_bridges(
    runs: Runs, operation: Operation, feeds: Feeds, bridges: Sequence[Bridge]
) -> RaisedRuns:
    """Return the runs of an operation, raised so that no cut goes through any bridge.

    A tab is made by the contour that it belongs to. The tool comes by again: round a neighbour
    that is nearer than two slots are wide, on the other side of a narrow contour, on a lead, or in
    another operation. What must stay is a rectangle, as wide as the bridge and as long as the slot
    is wide:

        ────────────────────────────  wall      A, B: where the tool goes up and comes down again
             ╭───╮ ┌─w─┐ ╭───╮                  the rectangle lies on the line through the centre
             │ A │ │   │ │ B │                  of the tab, square to the chord A B
             ╰───╯ └───┘ ╰───╯

    A tool of radius r cuts into it where its centre is nearer than r to the rectangle. There its
    run is raised to the top of the bridge, as by a tab of its own; so the neighbour has a bridge
    there too, which is a finding."""
    if not bridges or not len(runs):
        return RaisedRuns(runs, ())
    reach = operation.tool.radius_mm
    index = BoxIndex(np.array([_box(bridge, reach) for bridge in bridges]))
    runs_made, raised = [], _RaisedBridges()
    for run in runs:
        _, rows = index.touching(np.concatenate(_extent(run))[None])
        near_bridges = [bridges[row] for row in rows.tolist()]
        runs_made.append(
            _raise_run(run, near_bridges, operation.tool, feeds, raised) if near_bridges else run
        )
    return RaisedRuns(Runs.of(runs_made), tuple(raised.findings(operation)))


class _RaisedBridges:
    """The bridges over which runs were raised, and those that a drill goes through, collected for
    findings."""

    def __init__(self) -> None:
        self.shared: dict[int, tuple[Bridge, str]] = {}
        self.drilled: dict[int, tuple[Bridge, str]] = {}

    def findings(self, operation: Operation) -> Iterator[Finding]:
        if self.shared:
            bridge, name = next(iter(self.shared.values()))
            yield (TAB_SHARED_WITH_OWN if operation.tabs else TAB_SHARED)(
                where=at_place(name, bridge.centre.tolist()),
                measured=len(self.shared),
                contour=bridge.name,
            )
        for bridge, name in self.drilled.values():
            yield TAB_LEFT_OUT_DRILLED(
                where=at_place(name, bridge.centre.tolist()), contour=bridge.name
            )


def _raise_run(
    run: CutRun, near_bridges: Sequence[Bridge], tool: Tool, feeds: Feeds, raised: _RaisedBridges
) -> CutRun:
    """Return the run raised over the bridges near it; the same object if nothing changes. `raised`
    is added to in place."""
    vertices = run.vertices
    moves = np.hypot(*np.diff(vertices[:, :2], axis=0).T) > POSITION_EPS_MM
    is_drilled = not moves.any()
    # Each place once, with the bulge with which it is left.
    group = np.concatenate([[0], np.cumsum(moves)])
    last = np.append(np.flatnonzero(moves), len(vertices) - 1)
    path = vertices[last][:, [0, 1, 3]]
    if is_drilled or np.isnan(run.feed_mm_min).any():
        for bridge in near_bridges:
            _note_drilled(run, bridge, tool, raised)
        return run
    along = MeasuredPath.of(Polyline(path))
    points: ZProfile = list(zip(along.reach[group].tolist(), vertices[:, 2].tolist(), strict=True))
    low = np.full(len(along.segments), math.inf)
    for end in (0, 1):  # the height at both ends of each move
        z = vertices[np.flatnonzero(moves) + end, 2]
        low = np.minimum(low, z)
    tabs: list[Tab] = []
    for bridge in near_bridges:
        own_tabs = list(_tabs_over(along, low, bridge, tool))
        if own_tabs:
            raised.shared[id(bridge)] = (bridge, run.name)
        tabs += own_tabs
    if not tabs:
        return run
    (raised_vertices,) = lift_paths(
        along.paths, [along.index], [raise_profile(points, tabs, None)]
    )
    return replace(run, vertices=raised_vertices, feed_mm_min=feeds_along(raised_vertices, feeds))


def _note_drilled(run: CutRun, bridge: Bridge, tool: Tool, raised: _RaisedBridges) -> None:
    place, depth = run.vertices[:1, :2], float(run.vertices[:, 2].min())
    reach = tool.radius_mm - BRIDGE_SLACK_MM
    is_through = depth < bridge.top_mm and reach > 0.0
    if is_through and inside(place, Segments.of(bridge_zone(bridge, reach)))[0]:
        raised.drilled[id(bridge)] = (bridge, run.name)


def _tabs_over(along: MeasuredPath, low: Floats, bridge: Bridge, tool: Tool) -> Iterator[Tab]:
    """Yield the pieces of a path, as tabs, in which the tool would cut into a bridge; `low` (n,):
    the lowest z of each segment."""
    is_low = low < bridge.top_mm - POSITION_EPS_MM
    if not is_low.any():
        return
    reach = tool.radius_at(bridge.top_mm - float(low.min())) - BRIDGE_SLACK_MM
    if reach <= 0.0:
        return
    zone = Segments.of(bridge_zone(bridge, reach))
    boxes, zone_boxes = segment_boxes(along.segments), segment_boxes(zone)
    lowest, highest = zone_boxes[:, :2].min(axis=0), zone_boxes[:, 2:].max(axis=0)
    rows = np.flatnonzero(((boxes[:, :2] <= highest) & (boxes[:, 2:] >= lowest)).all(axis=1))
    if not is_low[rows].any():
        return
    common = crossings(along.segments[rows], zone)
    spans: list[tuple[float, float, bool]] = []
    for k, row in enumerate(rows.tolist()):
        parts = distinct(np.concatenate([[0.0, 1.0], common.ta[common.row_a == k]]))
        centres = 0.5 * (parts[:-1] + parts[1:])
        is_inside = inside(point_at(along.segments, np.full(len(centres), row), centres), zone)
        begin, size = along.reach[row], along.reach[row + 1] - along.reach[row]
        for i in np.flatnonzero(is_inside).tolist():
            first, last = float(begin + size * parts[i]), float(begin + size * parts[i + 1])
            is_deep = bool(is_low[row]) and last - first > POSITION_EPS_MM
            if spans and first - spans[-1][1] <= POSITION_EPS_MM:
                first, _, was_deep = spans.pop()
                is_deep = is_deep or was_deep
            spans.append((first, last, is_deep))
    # Parts already raised by the run's own tab belong to the piece, so that it does not go down
    # between.
    for first, last, is_deep in spans:
        if is_deep:
            yield Tab(first, last, bridge.top_mm, bridge.fall)


def bridge_zone(bridge: Bridge, reach_mm: float) -> Polyline:
    """Return the boundary (CCW) of the zone within `reach_mm` of a bridge, in which the centre of
    a tool of this radius would cut into it."""
    normal = np.array([-bridge.ahead[1], bridge.ahead[0]])
    w, s, r = bridge.half_width_mm, bridge.half_span_mm, reach_mm
    corners = [
        (w + r, -s, 0.0), (w + r, s, QUARTER), (w, s + r, 0.0), (-w, s + r, QUARTER),
        (-w - r, s, 0.0), (-w - r, -s, QUARTER), (-w, -s - r, 0.0), (w, -s - r, QUARTER),
    ]  # fmt: skip
    rows = [[*(bridge.centre + t * bridge.ahead + n * normal), b] for t, n, b in corners]
    return Polyline(np.array(rows), closed=True)


def _box(bridge: Bridge, reach: float) -> tuple[float, float, float, float]:
    size = math.hypot(bridge.half_width_mm, bridge.half_span_mm) + reach
    x, y = bridge.centre.tolist()
    return x - size, y - size, x + size, y + size


def _extent(run: CutRun) -> tuple[Floats, Floats]:
    """Return the bounding box (low, high) of a run, a little large at arcs: an arc of up to a half
    circle stays within its chord's length of its ends."""
    chords = np.hypot(*np.diff(run.vertices[:, :2], axis=0).T)
    bent = run.vertices[:-1, 3] != 0.0
    wide = float(chords[bent].max(initial=0.0))
    return run.vertices[:, :2].min(axis=0) - wide, run.vertices[:, :2].max(axis=0) + wide
