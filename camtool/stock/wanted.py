"""The wanted solid: how low and how high the stock may be at each point, from drawing and job.

At a point (x, y) nothing may be cut below `low`, and nothing may stand above `high`:

    gouge = low − height of the stock,    leftover = height of the stock − high.

Both are made of what the job takes of the drawing, never of the planned moves, so that faults of
the planning are found as well as those of a program. Each operation brings layers. A layer is
drawn lines, a side of them, and a depth that depends on nothing but the distance s from the lines,
counted inwards; so it is exact at every point and has exact limits over a box.

    depth(s) = min(depth, base + rise · s)    for 0 ≤ s ≤ reach

    operation         may be cut (low)                         must be cut (high)
    pocket, bore      region less the allowance, to its depth  that region opened by the tool; of
                                                               adaptive ones all but the scallop
    rest of another   the same; on a carved floor less the     the same
                      slopes of the carving
    profile beside    the waste beside the wall, as far as     the kerf: one tool width about the
                      the tool and its leads reach; reliefs    path of the tool's centre
    with tabs         the same                                 the same, higher by the tabs
    on the line       one tool width about the line, and its   one tool width about the line
                      leads
    engraving         the groove of the tool about the line    the same
    drill             disc of the drill, with its cone         the same
    vcarve            slope of the bit from the edge inwards,  the same where the bit reaches the
                      to the depth that width or depth allow   floor, less its flat tip
    chamfer           slope of the bit from w beyond the line  groove of the bit about its path
    facing            everywhere, to its depth                 the stock

Where several operations cut, the lowest of their heights counts, of both kinds. Elsewhere `low` is
the stock top, and `high` is not limited. A round nose leaves feet at walls and ridges on floors:
there `high` is asked only where its corner has passed, and higher by the ridge.

Walls are vertical steps: a tool that runs a micrometre beside its path would cut the full depth
too deep there. Errors in the plane are judged by other figures, so `low` begins `wall_mm` beyond
the wall and `high` ends as much before it."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import cached_property

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.geometry.boxes import IndexedCurves
from camtool.geometry.distance import near_paths
from camtool.geometry.measure import point_at, signed_areas
from camtool.geometry.nesting import Nesting, oriented
from camtool.geometry.offset import SHARP_LIMIT, offset_each, offset_shape
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Polyline,
    Polylines,
    Segments,
    reverse_lines,
)
from camtool.kernels.move_tree import hilbert_order
from camtool.kernels.offsets import chord_distances, disc_tangents, insides, nearest_distances
from camtool.planning.checks import peak_mm
from camtool.planning.findings import PlanningCode
from camtool.planning.holes import HOLE_SIZE_MM, circle_of, drilled_holes
from camtool.planning.items import Chosen, Step
from camtool.planning.job import MILLS, Operation
from camtool.planning.reliefs import add_reliefs
from camtool.planning.settings import Cone
from camtool.planning.sides import regions_of, runs_beside
from camtool.planning.strategies import MAX_SCALLOP_DISCS, SCALLOP_DISC_SHARE
from camtool.stock.cutters import CutterProfile, cutter_profile
from camtool.toolpath.moves import STOCK_TOP_MM

INSIDE, OUTSIDE, ABOUT = 1, -1, 0
"""Sides of a layer's lines: within closed ones (even-odd), beyond them, or on both sides of any
lines alike, whose distance from the shift is then counted inwards."""

DEFAULT_WALL_MM = 0.01
"""Width of the band beside a wall in which nothing is judged, if it is not given."""

DIAGONAL = math.sqrt(2.0)
"""Diagonal of a square over its side, and of a quarter arc over its radius."""

NOSE_SHARE = 0.5
"""Share of a round nose's corner, next to the flat, within which its groove must be cut."""

FAR_MM = 1e9
"""Distance from lines if there are none."""

POINT_MM = 2e-6
"""Length of the line that stands for a point, since layers need lines."""


class WantedLayer(Struct, frozen=True, eq=False, dict=True):
    """A region that one operation may, or must, cut: a depth that depends on the distance s from
    `lines`, mm, which is counted inwards on their `side` and increased by `shift_mm`. `name`: that
    of the operation."""

    name: str
    lines: Polylines
    side: int
    shift_mm: float
    base_mm: float
    rise: float
    depth_mm: float
    reach_mm: float = math.inf
    cutter: CutterProfile | None = None
    """The tool, if the layer is the groove of a tool along its lines."""

    @cached_property
    def segments(self) -> Segments:
        """The K lines and arcs, near ones one after the other."""
        segments = Segments.of(self.lines)
        return segments[hilbert_order(segments.start, segments.end)]

    @cached_property
    def curves(self) -> IndexedCurves:
        """The same in a tree; with `segments.bulge` what `camtool.kernels.offsets` searches."""
        return IndexedCurves.of(self.segments)

    def inwards(self, points: Floats) -> Floats:
        """Return the distances s (N,) of points (N, 2), mm: the shift included."""
        if not len(self.lines):
            return np.full(len(points), FAR_MM if self.side == OUTSIDE else -FAR_MM)
        points = np.ascontiguousarray(points, dtype=np.float64)
        distances = nearest_distances(points, self.curves.rows, self.curves.tree)
        is_inwards = self._are_inwards(points)
        return np.asarray(self.shift_mm + np.where(is_inwards, distances, -distances))

    def _are_inwards(self, points: Floats) -> Bools:
        """Return the mask (N,) of points on the side of the lines on which distances count as
        inwards."""
        if self.side == ABOUT:
            return np.zeros(len(points), dtype=np.bool_)
        bulge = np.ascontiguousarray(self.segments.bulge)
        is_inside = insides(points, self.curves.rows, bulge, self.curves.tree)
        return np.asarray(is_inside == (self.side == INSIDE))

    def along(self, middle: Floats, half: Floats) -> tuple[Floats, Floats]:
        """Return the values at both ends (K, 2) of two linear functions, a lower and an upper
        bound of s along chords with these middles and half vectors (K, 2)."""
        if not len(self.lines):
            far = np.full(middle.shape, FAR_MM if self.side == OUTSIDE else -FAR_MM)
            return far, far
        middle, half = np.ascontiguousarray(middle), np.ascontiguousarray(half)
        bounds = chord_distances(middle, half, self.curves.rows, self.curves.tree)
        low, high = bounds[:, :2], bounds[:, 2:]
        is_inwards = self._are_inwards(middle)[:, None]
        return (
            self.shift_mm + np.where(is_inwards, low, -high),
            self.shift_mm + np.where(is_inwards, high, -low),
        )

    def tangents(self, points: Floats, reach: Floats) -> Floats:
        """Return upper bounds (see `camtool.kernels.offsets.disc_tangents`) of the distances from
        the two nearest lines, valid within `reach` (N,) of the points (N, 2)."""
        curves = self.curves
        return disc_tangents(np.ascontiguousarray(points), reach, curves.rows, curves.tree)

    def chords(self, sagitta_mm: float) -> tuple[Floats, Floats]:
        """Return starts and ends (J, 2) of chords of the lines and arcs, no farther from these
        than a sagitta."""
        segments = self.segments
        cosine = 1.0 - np.minimum(sagitta_mm / segments.radius.clip(min=sagitta_mm), 1.0)
        parts = np.abs(segments.sweep) / np.where(segments.is_arc, 2.0 * np.arccos(cosine), 1.0)
        count = np.ceil(parts).clip(min=1.0).astype(np.int64)
        row = np.repeat(np.arange(len(segments)), count)
        step = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        return (
            point_at(segments, row, step / count[row]),
            point_at(segments, row, (step + 1.0) / count[row]),
        )

    def depths(self, min_s: Floats, max_s: Floats, wall_mm: float) -> tuple[Floats, Floats]:
        """Return the least and the greatest depth (N,), mm, for s between `min_s` and `max_s`
        (N,), with the ends of the layer moved outwards by `wall_mm`. −inf stands for no depth: in
        the least if some s lies outside the layer, in the greatest if all do."""
        low, high = min_s + wall_mm, max_s + wall_mm
        shallow = np.minimum(self.base_mm + self.rise * np.maximum(low, 0.0), self.depth_mm)
        deepest = np.maximum(np.minimum(high, self.reach_mm), 0.0)
        depths = np.minimum(self.base_mm + self.rise * deepest, self.depth_mm)
        end = self.reach_mm + 2.0 * wall_mm
        return (
            np.where((low >= 0.0) & (high <= end), np.maximum(shallow, 0.0), -np.inf),
            np.where((high >= 0.0) & (low <= end), np.maximum(depths, 0.0), -np.inf),
        )


class WantedSolid(Struct, frozen=True, eq=False):
    """The layers that may be cut, the layers that must be cut, and the width of the band beside
    walls in which nothing is judged, mm."""

    may: tuple[WantedLayer, ...]
    must: tuple[WantedLayer, ...]
    wall_mm: float = DEFAULT_WALL_MM

    def bands(self, points: Floats) -> Floats:
        """Return the lowest allowed and the highest wanted height (N, 2), mm in the work frame, at
        points (N, 2); the latter is inf where nothing must be cut."""
        low, high = np.full(len(points), STOCK_TOP_MM), np.full(len(points), np.inf)
        for layers, edge, wall_mm in self._sides(low, high):
            for layer in layers:
                s = layer.inwards(points)
                np.minimum(edge, -layer.depths(s, s, wall_mm)[1], out=edge)
        return np.column_stack([low, high])

    def bounds(self, squares: Floats) -> Floats:
        """Return bounds (N, 4), mm, of the bands over squares (N, 3) of middle and half side: the
        least and the greatest low, the least and the greatest high."""
        half = DIAGONAL * squares[:, 2]
        low, high = np.full((2, len(squares)), STOCK_TOP_MM), np.full((2, len(squares)), np.inf)
        for layers, edges, wall_mm in self._sides(low, high):
            for layer in layers:
                s = layer.inwards(squares[:, :2])
                shallow, deep_edge = layer.depths(s - half, s + half, wall_mm)
                np.minimum(edges, -np.stack([deep_edge, shallow]), out=edges)
        return np.column_stack([*low, *high])

    def cut_by(self, point: tuple[float, float]) -> str:
        """Return the name of the operation that may cut the lowest at a point (x, y) mm, or else
        of the one whose edge is nearest; "" without operations."""
        points = np.array([point])
        candidates = [
            (*(-each[0] for each in layer.depths(s, s, self.wall_mm)[:0:-1]), -s[0], layer.name)
            for layer in self.may
            for s in (layer.inwards(points),)
        ]
        return min(candidates)[-1] if candidates else ""

    def _sides(
        self, low: Floats, high: Floats
    ) -> tuple[tuple[tuple[WantedLayer, ...], Floats, float], ...]:
        return (self.may, low, self.wall_mm), (self.must, high, -self.wall_mm)


class CopperNets(Struct, frozen=True, eq=False):
    """The copper that the operation `name` frees: the closed `contours` of its nets (copper has an
    odd number of them around it), mm, and its thickness."""

    name: str
    contours: Polylines
    thickness_mm: float


def wanted_solid(steps: Sequence[Step], wall_mm: float = DEFAULT_WALL_MM) -> WantedSolid:
    """Return the solid that the operations of a plan are to leave, from the contours that each
    took of the drawing and its settings. Tools without width cut nothing of it."""
    may: list[WantedLayer] = []
    must: list[WantedLayer] = []
    names = {step.operation.name for step in steps}
    highest_mm = max((_tabs_mm(step.operation) for step in steps), default=0.0)
    for step in steps:
        if step.operation.tool.radius_at(-step.setting.levels_mm[-1]) > 0.0:
            # The tabs of other operations may stand in its way too.
            shares = step.operation.stage == "finish" or any(
                finding.code is PlanningCode.TAB_SHARED for finding in step.findings
            )
            maker = _Layers(step, highest_mm if shares else _tabs_mm(step.operation))
            may += maker.may()
            # If another program clears the region, its rest alone is not all that must be cut.
            if not step.operation.rest or step.operation.rest in names:
                must += maker.must()
    return WantedSolid(tuple(may), tuple(must), wall_mm)


def _tabs_mm(operation: Operation) -> float:
    return 0.0 if operation.tabs is None else operation.tabs.height_mm


DRILLED = ("holes", "pins")
"""Values of `takes` of operations that drill."""


class _Layers:
    """The layers of one operation; `tabs_mm`: the height of the tabs along its path."""

    def __init__(self, step: Step, tabs_mm: float) -> None:
        self.tabs_mm = tabs_mm
        self.operation: Operation = step.operation
        self.chosen: Chosen = step.chosen
        self.stock = step.setting.stock
        self.depth_mm = -step.setting.levels_mm[-1]
        self.name = step.operation.name or step.operation.kind
        self.closed: Ints = np.flatnonzero(step.chosen.lines.closed)

    def may(self) -> Iterator[WantedLayer]:
        """Yield the layers that the operation may cut."""
        operation, contract, depth = self.operation, self.operation.contract, self.depth_mm
        if contract.cuts == "over":
            yield self._straight(Polylines.of([]), OUTSIDE, depth)
        elif contract.cuts == "at" and contract.takes in DRILLED:
            yield from self._holes()
        elif contract.cuts == "within" and contract.leaves_walls:
            yield self._straight(self._region(), INSIDE, depth, shift_mm=-self._left_mm)
        elif contract.cuts == "within":
            yield self._carved(0.0, to_walls=False)
        elif runs_beside(operation):
            yield from self._waste()
            yield from self._reliefs()
            yield from self._grooves(self._lines(closed=False), self._aside_mm, is_full=True)
        else:
            yield from self._grooves(self._lines(), self._aside_mm, is_full=True)

    def must(self) -> Iterator[WantedLayer]:
        """Yield the layers that the operation must cut."""
        operation, contract, tool = self.operation, self.operation.contract, self.operation.tool
        if contract.cuts == "over":
            if self.stock is not None and self.stock.box_mm is not None and tool.kind in MILLS:
                left_x, low, right, high = self.stock.box_mm
                corners = [[left_x, low, 0], [right, low, 0], [right, high, 0], [left_x, high, 0]]
                box = Polyline(np.array(corners, dtype=np.float64), closed=True)
                yield self._straight(Polylines.of([box]), INSIDE, self._floor_mm)
        elif contract.cuts == "at":
            if contract.takes in DRILLED:  # other kinds may cut anywhere along their lines
                yield from self._holes()
        elif contract.cuts == "within" and contract.leaves_walls:
            if tool.kind in MILLS:
                yield from self._floors()
        elif contract.cuts == "within":
            yield self._carved(0.5 * tool.tip_diameter_mm, to_walls=True)
        elif runs_beside(operation):
            yield from self._grooves(self._centre_paths(), 0.0, is_full=False)
            yield from self._grooves(self._lines(closed=False), 0.0, is_full=False)
        else:
            yield from self._grooves(self._lines(), 0.0, is_full=False)

    def _floors(self) -> Iterator[WantedLayer]:
        """Yield the floor that the tool reaches. Adaptive pockets may leave scallops at their
        corners unless a finishing pass follows: their floor is what a wider tool reaches, and what
        is farther from the walls than a scallop is thick."""
        radius_mm, nose_mm = self.operation.tool.radius_mm, self.operation.tool.nose_mm
        is_finish = self.operation.stage == "finish"
        is_limited = self.operation.engagement_rad is not None and not is_finish
        disc_mm = SCALLOP_DISC_SHARE * radius_mm
        scallop_mm = MAX_SCALLOP_DISCS * disc_mm
        sizes = ((disc_mm, 0.0), (0.0, scallop_mm)) if is_limited else ((0.0, 0.0),)
        for wider_mm, away_mm in sizes:
            reach_mm = radius_mm + wider_mm
            region = offset_shape(self._region(), self._left_mm + reach_mm)
            region = offset_shape(region, -reach_mm)
            yield self._straight(region, INSIDE, self._floor_mm, shift_mm=-nose_mm - away_mm)

    def _straight(
        self,
        lines: Polylines,
        side: int,
        depth_mm: float,
        *,
        shift_mm: float = 0.0,
        reach_mm: float = math.inf,
    ) -> WantedLayer:
        """Return a layer with vertical walls and one depth."""
        return WantedLayer(
            self.name, lines, side, shift_mm, depth_mm, 0.0, depth_mm, reach_mm=reach_mm
        )

    def _lines(self, *, closed: bool | None = None) -> Polylines:
        """Return the chosen lines; with `closed`, only the closed or only the open ones."""
        lines = self.chosen.lines
        if closed is None:
            return lines
        return lines.select(np.flatnonzero(lines.closed == closed).tolist())

    def _region(self) -> Polylines:
        """Return the region that is cleared, on the left of its closed paths; for bores, the
        outermost circles that are wide enough."""
        nesting = self.chosen.nesting.among(self.closed)
        if self.operation.contract.takes != "circles":
            return oriented(nesting)
        min_diameter = 2.0 * self.operation.away_mm + HOLE_SIZE_MM
        circles = [(row, circle_of(path)) for row, path in enumerate(nesting.lines)]
        wide = np.array(
            [row for row, each in circles if each and each[1] > min_diameter], dtype=np.int64
        )
        bored = nesting.among(wide)
        outer = bored.lines.select(np.flatnonzero(bored.levels.depth == 0).tolist())
        return reverse_lines(outer, signed_areas(outer) < 0.0)

    @property
    def _left_mm(self) -> float:
        """Material left beside the walls of a region, mm: the allowance, and on a carved floor
        the slopes of the carving."""
        carved = self.operation.rest_of
        if carved is None or carved.contract.rest != "floor" or carved.tool.tip_angle_rad is None:
            return self.operation.allowance_mm
        slope = math.tan(0.5 * carved.tool.tip_angle_rad)
        return self.operation.allowance_mm + self.depth_mm * slope

    @property
    def _floor_mm(self) -> float:
        """The depth at least of a floor, with the ridges of a round nose at a square corner."""
        return self.depth_mm - peak_mm(self.operation.tool, self.operation.step_over)

    @property
    def _leads_mm(self) -> float:
        """The farthest that leads take the tool from its path, mm: the ends of a quarter arc are
        as far apart as the diagonal of its radius."""
        reach = {"none": 0.0, "line": 1.0, "arc": DIAGONAL}
        leads = (self.operation.lead_in, self.operation.lead_out)
        return max(reach[each.kind] * each.length_mm for each in leads)

    @property
    def _aside_mm(self) -> float:
        """The farthest that leads, or a slot, take the tool from its line, mm."""
        return max(self._leads_mm, 0.5 * self.operation.spare_mm)

    def _holes(self) -> Iterator[WantedLayer]:
        """Yield the discs of drilled holes."""
        holes = drilled_holes(self.chosen, self.operation)[0]
        points = [
            Polyline(np.array([[x, y, 0.0], [x + POINT_MM, y, 0.0]])) for x, y in
            (hole.at_mm for hole in holes)
        ]  # fmt: skip
        return self._grooves(Polylines.of(points), 0.0, is_full=True)

    def _carved(self, tip_mm: float, *, to_walls: bool) -> WantedLayer:
        """Return the layer with the slopes of a carving, lowered by the flat tip of its bit.
        `to_walls`: the layer ends where the bit's width from the edge does, since the floor beyond
        is left."""
        cone = Cone.of(self.operation)
        radius = cone.radius_at(self.depth_mm)
        return WantedLayer(
            self.name,
            self._lines(closed=True),
            INSIDE,
            0.0,
            -tip_mm / cone.slope,
            1.0 / cone.slope,
            (radius - cone.tip_mm) / cone.slope,
            radius if to_walls else math.inf,
        )

    def _waste(self) -> Iterator[WantedLayer]:
        """Yield the waste beside the walls, as far as the tool and its leads reach, or the tool's
        centre on mitred corners."""
        operation, tool = self.operation, self.operation.tool
        reach = 2.0 * tool.radius_mm + operation.spare_mm
        if operation.joins != "round":
            limit = operation.mitre_limit if operation.joins == "mitre" else SHARP_LIMIT
            reach = max(reach, operation.away_mm * limit + tool.radius_mm)
        for lines, side in self._walls():
            if operation.contract.breaks_edges:
                width, rise = operation.chamfer_mm or 0.0, cutter_profile(tool).rise
                reach = 2.0 * (operation.wall_radius_mm + width) + self._leads_mm
                if operation.contract.frees_nets:  # rings farther out
                    reach += operation.own_value("isolation") or 0.0
                yield WantedLayer(self.name, lines, side, width, 0.0, rise, self.depth_mm, reach)
                continue
            shift, reach_mm = -operation.allowance_mm, reach + self._leads_mm
            yield self._straight(lines, side, self.depth_mm, shift_mm=shift, reach_mm=reach_mm)

    def _walls(self) -> Iterator[tuple[Polylines, int]]:
        """Yield (closed lines that bound one region, the side of them where the waste is). If the
        job names the side, each nesting depth is a region of its own, so that a contour within
        another one is cut on that side too."""
        chosen, closed = self.chosen, self.closed
        nesting, rim = chosen.nesting.among(closed), chosen.rim[closed]
        if self.operation.side == "auto":
            groups = list(regions_of(nesting, rim))
        else:
            depth = nesting.levels.depth
            groups = [
                (depth == level) & (rim == is_rim)
                for level in distinct(depth).tolist()
                for is_rim in (True, False)
            ]
        for group in groups:
            if group.any():
                outermost = nesting.among(np.flatnonzero(group)).levels.depth == 0
                side = OUTSIDE if rim[group][outermost].any() else INSIDE
                yield chosen.lines.select(closed[group].tolist()), side

    def _centre_paths(self) -> Polylines:
        """Return the paths of the tool's centre beside the walls."""
        operation, paths_made = self.operation, list[Polylines]()
        joins, limit = operation.joins, operation.mitre_limit
        for lines, side in self._walls():
            nested = Nesting(lines)
            kept_side = oriented(nested) if side == OUTSIDE else reverse_lines(oriented(nested))
            if operation.side == "auto":
                paths = offset_shape(kept_side, -operation.away_mm, joins=joins, mitre_limit=limit)
            else:
                paths, _ = offset_each(
                    kept_side, -operation.away_mm, joins=joins, mitre_limit=limit
                )
            paths_made.append(paths)
        return Polylines.joined(paths_made)

    def _reliefs(self) -> Iterator[WantedLayer]:
        """Yield the grooves of reliefs, which enter the part at its inner corners."""
        operation, moves = self.operation, list[Polyline]()
        if operation.corners == "none":
            return
        paths, walls = self._centre_paths(), self._lines(closed=True)
        near_mm = operation.tool.radius_mm - operation.beyond_mm
        no_paths = Polylines.of([])
        for one, other in near_paths(paths, walls, operation.away_mm + POSITION_EPS_MM):
            path, kind = paths[one], operation.corners
            relieved = add_reliefs(path, walls[other], near_mm, kind, no_paths).path.vertices
            own_places = {tuple(place) for place in path.vertices[:, :2].tolist()}
            ends = np.roll(relieved, -1, axis=0)
            moves += [
                Polyline(np.array([corner, tip]))
                for corner, tip in zip(relieved, ends, strict=True)
                if tuple(tip[:2].tolist()) not in own_places
            ]
        yield from self._grooves(Polylines.of(moves), 0.0, is_full=True)

    def _grooves(
        self, lines: Polylines, more_mm: float, *, is_full: bool
    ) -> Iterator[WantedLayer]:
        """Yield the groove of the tool along lines: as wide as it may be (`is_full`, and `more_mm`
        wider on both sides), or the part that must be cut: less deep by the tabs, and without the
        foot of a round nose."""
        if not len(lines):
            return
        tool, depth = self.operation.tool, self.depth_mm
        profile = cutter_profile(tool)
        radius, base, rise = tool.radius_at(depth), depth, 0.0
        if profile.rise and not more_mm:
            radius = min(profile.radius_mm, profile.flat_mm + depth / profile.rise)
            base, rise = depth - (radius - profile.flat_mm) * profile.rise, profile.rise
        elif profile.corner_mm and not is_full:
            half_width = NOSE_SHARE * (radius - profile.flat_mm)
            radius = profile.flat_mm + half_width
            corner = profile.corner_mm
            depth -= corner - math.sqrt(corner * corner - half_width * half_width)
            base = depth
        if not is_full:
            base, depth = base - self.tabs_mm, max(depth - self.tabs_mm, 0.0)
        own = None if more_mm else profile
        shift = radius + more_mm
        yield WantedLayer(self.name, lines, ABOUT, shift, base, rise, depth, cutter=own)
