"""Depths of floors: how deep the slides cut the bottom of a pocket, of a groove or of a hole.

A floor is named by a place on it. Its extent follows from the wanted solid
(`camtool.stock.wanted`), so from drawing and job and not from the moves: the contour around the
place with its islands, or the line beside it, without areas that another operation cuts deeper,
and without the tabs. A band beside walls is left out, which is wider than the error of the slides
in the plane: within that error the stock may stand to its full height, and that is a matter of
other dimensions, the widths.

The least and the greatest depth are bounds, proved by branch and bound to `TOLERANCE_MM`, of the
moves of the predicted slides and of all that may lie beside them. Of a groove or hole whose bottom
is a line or a point (V bits, drills, round noses) it is the deepest across, looked at along its
line."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.drawing import Drawing
from camtool.geometry.measure import point_at, segment_lengths
from camtool.geometry.nesting import Nesting
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines
from camtool.inspection.dimensions import Dimension
from camtool.kernels.stock import StockTree
from camtool.machine.model import Machine
from camtool.planning.items import Step
from camtool.planning.job import Job
from camtool.planning.place import placements
from camtool.planning.plan import planned
from camtool.records import replace
from camtool.stock.cut import Box
from camtool.stock.cutters import cutter_profile
from camtool.stock.heights import greatest_value, stock_tree
from camtool.stock.moves import StockMoves
from camtool.stock.wanted import ABOUT, INSIDE, WantedLayer, WantedSolid, wanted_solid
from camtool.toolpath.moves import STOCK_TOP_MM

SAME_DEPTH_MM = 1e-6

MARGIN_MM = 0.05
"""Width of the band beside walls in which no depth is measured, in addition to the error of the
slides in the plane."""

TOLERANCE_MM = 1e-4
"""The least and the greatest depth are bounded to within this, ..."""

MAX_SQUARES = 300_000
"""... or as well as this many squares allow; the bounds are then wider."""

POINTS_APART_MM = 0.1
"""Largest distance of the points along its line at which a pointed groove is measured."""

LATTICE = 40
"""Number of points along each side of the box of a region, among which its place is chosen."""

Z_WEIGHT = 100.0
"""The Z of slide moves is exact to this many times less than their place in the plane."""


class Floor(Struct, frozen=True, eq=False):
    """The floor at a place in the work frame, mm: the part of the `layer` that it belongs to, what
    may be cut (`solid`, with the band that is left out), how far inwards of its lines it begins,
    the discs of tabs (T, 3) as centre and radius, and the depth that the job asks for. `is_line`:
    its bottom is a line or a point, as of V bits, drills and round noses."""

    place_mm: tuple[float, float]
    layer: WantedLayer
    solid: WantedSolid
    begins_mm: float
    tabs: Floats
    depth_mm: float
    is_line: bool

    @property
    def box_mm(self) -> Box:
        """The box around the lines of the floor, and as far beside them as they cut."""
        boxes = self.layer.curves.boxes
        wide = max(self.layer.shift_mm, 0.0)
        low, high = boxes[:, :2].min(axis=0) - wide, boxes[:, 2:].max(axis=0) + wide
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])

    def has(self, points: Floats) -> Bools:
        """Return the mask (P,) of the points (P, 2) that lie on the floor."""
        is_inside = self._holds(self.layer.inwards(points), 0.0)
        is_inside &= self.solid.bands(points)[:, 0] >= -self.depth_mm - SAME_DEPTH_MM
        return np.asarray(is_inside & self.is_beyond_tabs(points))

    def meets(self, squares: Floats) -> Bools:
        """Return the mask (K,) of the squares (K, 3), middle and half a side, that may contain a
        point of the floor."""
        reach = math.sqrt(2.0) * squares[:, 2]
        is_near = self._holds(self.layer.inwards(squares[:, :2]), reach)
        is_near &= self.solid.bounds(squares)[:, 1] >= -self.depth_mm - SAME_DEPTH_MM
        return np.asarray(is_near & (self._beyond_tabs(squares[:, :2]) > -reach))

    def _holds(self, s: Floats, reach: Floats | float) -> Bools:
        band = self.solid.wall_mm
        last = self.layer.reach_mm - band
        return np.asarray((s + reach >= self.begins_mm + band) & (s - reach <= last))

    def is_beyond_tabs(self, points: Floats) -> Bools:
        """Return the mask (P,) of the points (P, 2) that are not near a tab."""
        return np.asarray(self._beyond_tabs(points) > 0.0)

    def _beyond_tabs(self, points: Floats) -> Floats:
        """Return the distance (P,) mm of points from the nearest disc of a tab, negative inside;
        inf without tabs."""
        distances = [np.hypot(*(points - tab[:2]).T) - tab[2] for tab in self.tabs]
        return np.asarray(np.min(distances, axis=0) if distances else np.full(len(points), np.inf))


class FloorDepths(Struct, frozen=True):
    """Depths of a floor, mm: at its place, and bounds of the least and of the greatest."""

    here_mm: float
    least_mm: float
    greatest_mm: float


class Floors:
    """The floors that the operations of a plan are to leave, found by their places."""

    def __init__(self, steps: Sequence[Step], beside_mm: float) -> None:
        """Take the steps of the plan, and the largest distance, mm in the plane, of the slides
        from the planned path."""
        self._exact = wanted_solid(steps, 0.0)
        band_mm = MARGIN_MM + beside_mm
        self._solid = WantedSolid(self._exact.may, (), band_mm)
        tabs = [
            (
                *bridge.centre,
                0.5 * tabs.width_mm
                + step.operation.tool.radius_mm
                + bridge.half_span_mm
                + band_mm,
            )
            for step in steps
            if (tabs := step.operation.tabs) is not None
            for bridge in step.bridges
        ]
        self._steps = {step.operation.name or step.operation.kind: step for step in steps}
        self._tabs = np.array(tabs, dtype=np.float64).reshape(-1, 3)

    def at(self, place_mm: tuple[float, float]) -> Floor | None:
        """Return the floor at a place in the work frame; None where nothing is to be cut, and on a
        slope."""
        places = np.array([place_mm])
        low = float(self._exact.bands(places)[0, 0])
        layers = [(float(each.depths(s, s, 0.0)[1][0]), float(s[0]), each)
                  for each in self._exact.must for s in (each.inwards(places),)]  # fmt: skip
        depth, s, layer = max(layers, key=lambda each: each[0], default=(-math.inf, 0.0, None))
        if layer is None or depth <= 0.0:
            return None
        begins = 0.0
        if layer.rise > 0.0:
            begins = (layer.depth_mm - layer.base_mm) / layer.rise
            if layer.side != ABOUT and s < begins:
                return None
        step, part = self._steps[layer.name], _part_of(layer, place_mm)
        round_ = cutter_profile(step.operation.tool).corner_mm > 0.0
        is_line = layer.side == ABOUT and (layer.rise > 0.0 or round_)
        depth_wanted = -step.setting.levels_mm[-1] if is_line else STOCK_TOP_MM - low
        return Floor(place_mm, part, self._solid, begins, self._tabs, depth_wanted, is_line)

    def places(self) -> Iterator[tuple[float, float]]:
        """Yield at least one place on each floor: in a closed region that point of a lattice which
        is farthest from the walls, on a line its middle."""
        for layer in self._exact.must:
            for line in layer.lines:
                single = replace(layer, lines=Polylines.of([line]))
                if layer.side == ABOUT:
                    points = _points_along(single)
                    px, py = points[len(points) // 2].tolist()
                    yield px, py
                elif layer.side == INSIDE:
                    low, high = np.reshape(single.curves.boxes, (-1, 2, 2)).transpose(1, 0, 2)
                    shares = (np.arange(LATTICE) + 0.5) / LATTICE
                    x, y = (low.min(axis=0) + shares[:, None] * np.ptp(
                        np.concatenate([low, high]), axis=0)).T  # fmt: skip
                    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
                    # Islands are other lines of the layer, around which `at` finds no floor.
                    inner = np.minimum(layer.inwards(points), single.inwards(points))
                    px, py = points[int(inner.argmax())].tolist()
                    yield px, py


def _points_along(layer: WantedLayer) -> Floats:
    """Return points (P, 2), at most POINTS_APART_MM apart, along the lines of a layer."""
    every = layer.segments
    count = np.ceil(segment_lengths(every) / POINTS_APART_MM).astype(np.int64) + 1
    owners = np.repeat(np.arange(len(count)), count)
    place = np.arange(len(owners)) - np.repeat(np.cumsum(count) - count, count)
    part = place / np.maximum(count[owners] - 1, 1)
    return point_at(every, owners, part)


def _part_of(layer: WantedLayer, place_mm: tuple[float, float]) -> WantedLayer:
    """Return the layer with only those of its lines that bound the floor at a place: the contour
    around it with its islands, or the nearest line."""
    lines = layer.lines
    if layer.side == INSIDE:
        levels = Nesting(lines).levels
        rows_around = [row for row in range(len(lines)) if _is_within(lines[row], place_mm)]
        outer = max(rows_around, key=lambda row: int(levels.depth[row]), default=-1)
        rows: Ints = np.flatnonzero(levels.parent == outer)
        if outer >= 0:
            rows = np.append(rows, outer)
    elif layer.side == ABOUT:
        points = np.array([place_mm])
        distances = [-float(replace(layer, lines=lines.select([row])).inwards(points)[0])
                for row in range(len(lines))]  # fmt: skip
        rows = np.array([int(np.argmin(distances))])
    else:
        return layer
    return replace(layer, lines=lines.select(np.sort(rows).tolist()))


def _is_within(line: Polyline, place_mm: tuple[float, float]) -> bool:
    single = WantedLayer("", Polylines.of([line]), INSIDE, 0.0, 0.0, 0.0, 0.0)
    return bool(single.inwards(np.array([place_mm]))[0] >= 0.0)


def depths_of(floors: Sequence[Floor], moves: StockMoves) -> list[FloorDepths | None]:
    """Measure floors in the stock that these moves leave; None for a floor that lies wholly within
    the band beside its walls.

    The Z of the moves must be exact to 1 / Z_WEIGHT of their uncertainty in the plane
    (`beside_mm`), which is added to the bounds."""
    tree, slack = stock_tree(moves), moves.beside_mm / Z_WEIGHT
    measured = (
        (_along_line if floor.is_line else _over_region)(floor, tree, moves.beside_mm)
        for floor in floors
    )
    return [
        each
        and FloorDepths(each.here_mm, max(each.least_mm - slack, 0.0), each.greatest_mm + slack)
        for each in measured
    ]


def _along_line(floor: Floor, tree: StockTree, beside_mm: float) -> FloorDepths | None:
    """Measure the deepest point across a line, all along it, for the slides anywhere within
    `beside_mm` of their path."""
    points, band = _points_along(floor.layer), floor.solid.wall_mm
    points = points[floor.is_beyond_tabs(points)]
    if not len(points):
        return None
    index = int(np.hypot(*(points - floor.place_mm).T).argmin())
    smallest, middle, greatest = (
        STOCK_TOP_MM - tree.heights(points, None, band + shift)[0]
        for shift in (-beside_mm, 0.0, beside_mm)
    )
    return FloorDepths(float(middle[index]), float(smallest.min()), float(greatest.max()))


def _over_region(floor: Floor, tree: StockTree, beside_mm: float) -> FloorDepths | None:
    """Find bounds of the least and the greatest depth of a floor, by branch and bound over its
    region."""

    def greatest(value: Callable[[Floats], Floats], upper: Callable[[Floats], Floats]) -> float:
        maximum = greatest_value(
            lambda at: np.where(floor.has(at), value(at), -np.inf),
            lambda squares: np.where(floor.meets(squares), upper(squares), -np.inf),
            floor.box_mm,
            TOLERANCE_MM,
            max_squares=MAX_SQUARES,
        )
        return maximum.high if maximum.low > -math.inf else -math.inf

    highest = greatest(
        lambda at: tree.heights(at, None, -beside_mm)[0],
        lambda squares: tree.max_heights(squares, None, -beside_mm),
    )
    deepest = greatest(
        lambda at: -tree.heights(at, None, beside_mm)[0],
        lambda squares: -tree.min_heights(squares, beside_mm),
    )
    if not math.isfinite(highest + deepest):
        return None
    smallest, largest = STOCK_TOP_MM - min(highest, STOCK_TOP_MM), STOCK_TOP_MM + deepest
    depth = STOCK_TOP_MM - float(tree.heights(np.array([floor.place_mm]))[0][0])
    return FloorDepths(min(max(depth, smallest), largest), smallest, largest)


def proposed_floors(drawing: Drawing, job: Job, machine: Machine) -> Iterator[Dimension]:
    """Yield a dimension for the depth of each floor that a job cuts, and for the thickness left
    under those of pockets if the job knows its stock.

    Places are in the frame of the drawing. Cuts through the stock have none."""
    placement = replace(job.placement, copies=(1, 1), pitch_mm=(0.0, 0.0))
    single = replace(job, placement=placement)
    floors = Floors(planned(drawing, single, machine, undivided=True).steps, 0.0)
    first_placement = placements(drawing, single)[0]
    inverse = np.linalg.inv(first_placement.matrix)
    thick = math.inf if job.stock is None else job.stock.thickness_mm
    seen_lines: set[bytes] = set()
    counts: Counter[str] = Counter()
    for place in floors.places():
        floor = floors.at(place)
        if floor is None or floor.depth_mm >= thick - POSITION_EPS_MM:
            continue
        lines = floor.layer.lines.vertices.tobytes()
        if lines in seen_lines:
            continue
        seen_lines.add(lines)
        counts[floor.layer.name] += 1
        name = f"{floor.layer.name} {counts[floor.layer.name]}"
        x, y = (inverse @ (np.array(place) - first_placement.shift)).tolist()
        depth = floor.depth_mm
        yield Dimension(f"{name} depth", "depth", ((x, y),), "", nominal_mm=depth)
        if floor.layer.side == INSIDE and math.isfinite(thick):
            thickness_left = thick - depth
            yield Dimension(f"{name} floor", "thickness", ((x, y),), "", nominal_mm=thickness_left)
