"""The dimensions of a program's part on any variant of its machine: simulate, and measure.

The features of all dimensions are found once, and with them which moves cut each; for every
variant of the machine the program is simulated again and the same stations are measured."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import OptionError
from camtool.findings import Finding
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.geometry.turn import Turn
from camtool.inspection.depths import Z_WEIGHT, Floor, FloorDepths, Floors, depths_of
from camtool.inspection.dimensions import DEPTHS, Dimension
from camtool.inspection.features import BoundDimension, EdgeFeature, Feature, bind, features_of
from camtool.inspection.findings import (
    DIMENSION_NOT_CUT,
    DIMENSION_NOT_CUT_ACROSS,
    DIMENSION_NOT_CUT_NARROW,
    DIMENSION_NOT_CUT_NO_FLOOR,
    DIMENSION_NOT_CUT_NO_STOCK,
    DIMENSION_NOT_CUT_THROUGH,
)
from camtool.inspection.limits import limited
from camtool.inspection.sizes import (
    Cut,
    MachinedSize,
    SweptSegments,
    cut_of,
    distinct_levels,
    edge_at,
    rows_of,
    size_of,
    sizes_of,
    stations_of,
)
from camtool.inspection.uncertainty import (
    MachineVariant,
    edges_of,
    opposite_edges,
    without_scatter,
)
from camtool.machine.model import Axis, Machine
from camtool.pipeline import post_drawing
from camtool.planning.job import Job, JobSetup, Tool
from camtool.planning.naming import flip_error_words
from camtool.planning.place import SCALE_SHARE, placements
from camtool.planning.plan import planned
from camtool.records import replace
from camtool.run import Run
from camtool.stock.slides import slide_moves, tools_of_rows
from camtool.toolpath.moves import Toolpath
from camtool.units import UM_PER_MM
from camtool.verification.case import TRACE_POINTS, tool_mm
from camtool.verification.cuts import CutMoves, row_lengths, sample_cuts
from camtool.verification.slides import SlideTrace

CHORD_MM = 1e-4
"""Arcs of the slides' path are approximated by chords within this, as far as `MAX_POINTS`
allows."""

MAX_POINTS = 400_000
"""Approximate upper bound of the points of a path for inspection: 13 MB."""


MAX_EDGES_AT_ONCE = 1_000_000
"""Number of edges of randomly drawn parts that are measured in one batch: 8 MB in each array."""


class Inspected(Struct, frozen=True, eq=False):
    """A dimension in the work frame, with the cut of each of its features, and the number of its
    copy (None for a single part).

    A depth or thickness has a `floor` instead, and the thickness of the stock, mm (0 for a depth).
    """

    bound: BoundDimension
    cuts: tuple[Cut, ...]
    copy: int | None = None
    floor: Floor | None = None
    stock_mm: float = 0.0

    @property
    def name(self) -> str:
        """Name of the dimension, with the number of the copy from 1."""
        name = self.bound.dimension.name
        return name if self.copy is None else f"{name}, copy {self.copy + 1}"


class _FarCut(Struct, frozen=True, eq=False):
    """A feature that another set-up cuts: the inspector of that set-up, the feature and its cut in
    the frame there, and the map from there into the frame of the dimensions."""

    inspector: Inspector
    feature: Feature
    cut: Cut
    turn: Turn

    def to_here(self, placed: Feature) -> Cut:
        """Return the cut in the frame of the dimensions, where the feature is `placed`."""
        mirrored = isinstance(placed, EdgeFeature) and self.turn.is_over
        side = -self.cut.side if mirrored else self.cut.side
        stations, is_seen = stations_of(placed, side), self.stations_here(self.cut.seen)
        return replace(self.cut, side=side, stations=stations, seen=is_seen)

    def stations_here(self, values: Floats | Bools) -> Any:
        """Return values (L, S) of stations reordered for the frame of the dimensions, in which
        stations of a circle begin at another angle."""
        if isinstance(self.feature, EdgeFeature):
            return values
        spokes = (self.cut.side * self.cut.stations.normals) * np.array(self.turn.signs)
        angle = np.mod(np.arctan2(spokes[:, 1], spokes[:, 0]), 2.0 * math.pi)
        station = np.rint(angle / self.cut.stations.wide - 0.5).astype(np.int64) % len(angle)
        values_here = np.empty_like(values)
        values_here[:, station] = values
        return values_here

    def edges(self, machine: Machine, wider_mm: float) -> Floats:
        """Return the position (L, S) mm of the machined edge in the frame of the dimensions.

        What is left of an edge in one frame is right of it in another that is turned over."""
        slides = self.inspector.slides(machine).wider(0.5 * wider_mm)
        edges = edge_at(self.feature, self.cut, rows_of(slides, self.cut, self.feature))
        mirrored = isinstance(self.feature, EdgeFeature) and self.turn.is_over
        return np.asarray(self.stations_here(-edges if mirrored else edges))


class _OtherSetups:
    """The other set-ups of a part, each posted when a dimension first needs it.

    `cuts` are the cuts found there, by the `id` of the same cut in the frame of the dimensions."""

    def __init__(self, run: Run) -> None:
        self._run = run
        self._inspectors: dict[str, Inspector | None] = {}
        self.cuts: dict[int, _FarCut] = {}
        self.setups: list[JobSetup] = []

    def cut_of(self, drawn: Feature, placed: Feature, copy: int) -> Cut | None:
        """Return the cut of a feature by another set-up, in the frame of the dimensions; None if
        no set-up cuts it.

        The set-up is posted and simulated when it is first needed."""
        run, setup = self._run, _setup_that_cuts(self._run, drawn.path)
        if setup is None:
            return None
        assert run.job is not None
        assert run.job.setup_of is not None
        assert run.drawing is not None
        job = run.job.setup_of[0].setup(setup.name)
        if setup.name not in self._inspectors:
            other = post_drawing(run.drawing, job, run.target)
            judged = other.verification is not None and other.decoded is not None
            self._inspectors[setup.name] = Inspector(other, ()) if judged else None
        inspector = self._inspectors[setup.name]
        if inspector is None:
            return None
        feature = drawn.in_work_frame(placements(run.drawing, job)[copy])
        cut = cut_of(feature, inspector.wanted_moves)
        if cut is None:
            return None
        turn = job.placement.turn.back.then(run.job.placement.turn)
        far_cut = _FarCut(inspector, feature, cut, turn)
        own_cut = far_cut.to_here(placed)
        self.cuts[id(own_cut)] = far_cut
        if setup not in self.setups:
            self.setups.append(setup)
        return own_cut

    @property
    def flip_errors_mm(self) -> list[float | None]:
        """The largest distances, mm, by which set-ups that are turned over may lie beside the
        first face; None for one that is not known.

        They are those of all set-ups that cut a feature, this one included."""
        assert self._run.job is not None
        if not self.setups or self._run.job.setup_of is None:
            return []
        both = [*self.setups, self._run.job.setup_of[1]]
        return [each.flip_error_mm for each in both if each.flip is not None]


class Inspector:
    """The dimensions of the part that the program of a run makes, ready to be measured on variants
    of the machine.

    `dimensions` can be measured; `findings` say why the others cannot. A feature that another
    set-up of the part cuts is measured as that set-up cuts it."""

    def __init__(self, run: Run, dimensions: Iterable[Dimension]) -> None:
        """Take a run with a drawing, a job and a verification. Raises OptionError if its job
        scales the part, since limits hold for the part as drawn."""
        assert run.drawing is not None
        assert run.job is not None
        assert run.decoded is not None
        assert run.verification is not None
        self._decoded, self._target = run.decoded, run.target
        wanted_moves = run.verification.wanted
        self._follows = run.verification.follows.astype(np.int64)
        self._tool = ToolAt(wanted_moves.toolpath, run.job, tool_mm(run.job))
        self.wanted_moves = swept_moves(wanted_moves, self._tool)
        """The wanted moves, in the work frame."""
        self._points = _points(wanted_moves)
        self._last: tuple[Machine, SweptSegments] | None = None
        self._edges_of: tuple[Machine, float, dict[int, Floats]] | None = None
        self._job = run.job
        self._depths_by_z: dict[Axis, dict[int, FloorDepths | None]] = {}
        not_inspected: list[tuple[Dimension, Finding]] = []
        self._others = _OtherSetups(run)
        self.dimensions: tuple[Inspected, ...] = tuple(
            _inspected(run, dimensions, self.wanted_moves, self._others, not_inspected)
        )
        self._leave_out_narrow_floors(not_inspected)
        self.left_out = tuple(not_inspected)

    def sizes(
        self, variant: MachineVariant | None = None, left_mm: Mapping[int, float] | None = None
    ) -> list[MachinedSize]:
        """Return the sizes of the dimensions on a variant of the machine (None: that of the run);
        NaN for features that are not cut.

        `left_mm`: additional allowance, mm, on the walls of these paths of the drawing, by path.
        The path of the tool and the edge that it cuts move outwards by it."""
        edges = self._edges(variant or MachineVariant(self._target.machine))
        allowances = left_mm or {}
        sizes = []
        for each in self.dimensions:
            if each.floor is not None:
                sizes.append(self._depth(each, variant or MachineVariant(self._target.machine)))
                continue
            shifted = [
                edges[id(cut)]
                + (0.0 if cut.on_path else cut.side * allowances.get(feature.path, 0.0))
                for feature, cut in zip(each.bound.features, each.cuts, strict=True)
            ]
            size = size_of(each.bound, each.cuts, shifted)
            sizes.append(size or MachinedSize(math.nan, math.nan, math.nan))
        return sizes

    def _edges(self, variant: MachineVariant) -> dict[int, Floats]:
        """Return the position (L, S) mm of the machined edge of each cut on a variant of the
        machine, as `edge_at` does, by the `id` of the cut."""
        if not any(each.cuts for each in self.dimensions):
            return {}
        cached = self._edges_of
        if cached is None or cached[0] is not variant.machine or cached[1] != variant.wider_mm:
            slides = self.slides(variant.machine).wider(0.5 * variant.wider_mm)
            edges = {
                id(cut): (
                    self._others.cuts[id(cut)].edges(variant.machine, variant.wider_mm)
                    if id(cut) in self._others.cuts
                    else edge_at(feature, cut, rows_of(slides, cut, feature))
                )
                for feature, cut in {
                    id(cut): (feature, cut)
                    for each in self.dimensions
                    for feature, cut in zip(each.bound.features, each.cuts, strict=True)
                }.values()
            }
            cached = self._edges_of = variant.machine, variant.wider_mm, edges
        if not self._others.cuts or not any(variant.beside_mm):
            return cached[2]
        by_mm = np.array(variant.beside_mm)
        cuts = {id(cut): cut for each in self.dimensions for cut in each.cuts}
        return {
            key: edges + cuts[key].side * cuts[key].stations.normals @ by_mm
            if key in self._others.cuts
            else edges
            for key, edges in cached[2].items()
        }

    def values(self, variant: MachineVariant) -> Floats:
        """Return best fit, least and largest local size (3 D,) mm of each of D dimensions."""
        sizes = self.sizes(variant)
        return np.array([(each.fit_mm, each.low_mm, each.high_mm) for each in sizes]).reshape(-1)

    def machined(self, variant: MachineVariant) -> Floats:
        """Return the positions (T,) mm of the edges of all cuts on a variant of the machine, one
        cut after the other, NaN where an edge is not cut.

        Three values of each depth follow."""
        edges = self._edges(variant).values()
        depths = (self._depth(each, variant) for each in self.dimensions if each.floor is not None)
        sizes = ((each.fit_mm, each.low_mm, each.high_mm) for each in depths)
        return np.concatenate([np.zeros(0), *(each.reshape(-1) for each in edges), *sizes])

    def _depth(self, each: Inspected, variant: MachineVariant) -> MachinedSize:
        """Measure a depth or a thickness on a variant of the machine.

        A change of the motion in the plane alone changes no depth, so that one simulation serves
        all variants of the same Z."""
        z = variant.machine.axes.z
        if z not in self._depths_by_z:
            mean_machine = without_scatter(MachineVariant(self._target.machine)).machine
            machine = replace(mean_machine, axes=replace(mean_machine.axes, z=z))
            target = replace(self._target, machine=machine)
            tools = tools_of_rows(self._decoded, self._job)
            moves = slide_moves(self._decoded, target, tools, z_weight=Z_WEIGHT)
            floors = [one.floor for one in self.dimensions if one.floor is not None]
            measured_floors = zip(floors, depths_of(floors, moves), strict=True)
            self._depths_by_z[z] = {id(floor): depth for floor, depth in measured_floors}
        depth = self._depths_by_z[z][id(each.floor)]
        if depth is None:
            return MachinedSize(math.nan, math.nan, math.nan)
        measured = (depth.here_mm, depth.least_mm, depth.greatest_mm)
        depth_here, smallest, greatest = (value + variant.deeper_mm for value in measured)
        if not each.stock_mm:
            return MachinedSize(depth_here, smallest, greatest)
        thick = each.stock_mm + variant.thicker_mm
        return MachinedSize(thick - depth_here, thick - greatest, thick - smallest)

    def _leave_out_narrow_floors(self, not_inspected: list[tuple[Dimension, Finding]]) -> None:
        """Move dimensions of floors that lie wholly within the band beside their walls to
        `not_inspected`, in place."""
        if not any(each.floor is not None for each in self.dimensions):
            return
        variant = MachineVariant(self._target.machine)
        narrow_floors = [
            each
            for each in self.dimensions
            if each.floor is not None and math.isnan(self._depth(each, variant).fit_mm)
        ]
        for each in narrow_floors:
            assert each.floor is not None
            band_mm = each.floor.solid.wall_mm
            place = each.bound.dimension.source
            finding = DIMENSION_NOT_CUT_NARROW(where=place, name=each.name, measured=band_mm)
            not_inspected.append((each.bound.dimension, finding))
        if narrow_floors:
            self.dimensions = tuple(each for each in self.dimensions if each not in narrow_floors)

    def measured(self, nodes: Floats, weights: Floats) -> Floats:
        """Return the values (N, 3 D) mm of N parts.

        The edges of each part are mixed, with the weights (N, M), from the edges `nodes` (M, T) of
        M simulated parts."""
        cuts = {id(cut): cut for each in self.dimensions for cut in each.cuts}
        own_edges: dict[int, tuple[Floats, Floats]] = {}  # levels, and the nodes' edges there
        begin = 0
        for key, cut in cuts.items():
            edges = nodes[:, begin : begin + cut.seen.size].reshape(len(nodes), *cut.seen.shape)
            begin += cut.seen.size
            levels_kept = distinct_levels(edges)
            own_edges[key] = cut.levels_mm[levels_kept], edges[:, levels_kept]
        sizes = np.empty((len(weights), len(self.dimensions), 3))
        for index, each in enumerate(self.dimensions):
            if each.floor is not None:
                sizes[:, index] = weights @ nodes[:, begin : begin + 3]
                begin += 3
                continue
            levels = [own_edges[id(cut)][0] for cut in each.cuts]
            simulated = [own_edges[id(cut)][1] for cut in each.cuts]
            max_parts = max(1, MAX_EDGES_AT_ONCE // max(one[0].size for one in simulated))
            for first in range(0, len(weights), max_parts):
                part = weights[first : first + max_parts]
                mixed_edges = [np.tensordot(part, one, axes=1) for one in simulated]
                sizes[first : first + max_parts, index] = sizes_of(each.bound, levels, mixed_edges)
        return sizes.reshape(len(weights), -1)

    @property
    def edges(self) -> Floats:
        """Derivatives (3 D, E, 2 or 3) of the values with respect to the position of each machined
        edge."""
        return edges_of([(3, _edges_of(each.bound)) for each in self.dimensions])

    @property
    def has_depths(self) -> bool:
        """True if a depth or thickness is inspected."""
        return any(each.floor is not None for each in self.dimensions)

    @property
    def flip_errors_mm(self) -> list[float | None]:
        """The largest distances, mm, by which set-ups may lie beside each other: one for each
        turned-over set-up that cuts a feature; None if not known."""
        return self._others.flip_errors_mm

    @property
    def tool_diameter_mm(self) -> float:
        """Diameter of the widest tool; 0 if none has a width."""
        far = [each.inspector.tool_diameter_mm for each in self._others.cuts.values()]
        return max([2.0 * float(self._tool.radius.max(initial=0.0)), *far])

    def slides(self, machine: Machine) -> SweptSegments:
        """Simulate the path of the slides of this machine for the program."""
        cached = self._last
        if cached is None or cached[0] is not machine:
            from camtool.verification.verify import Case, VerifyOptions, verify

            options = VerifyOptions(trace_points=self._points)
            target = replace(self._target, machine=machine)
            verification = verify(Case(self._decoded, target, options=options))
            cached = self._last = (
                machine,
                swept_trace(verification.trace, self._follows, self._tool),
            )
        return cached[1]


def _edges_of(bound: BoundDimension) -> Floats:
    """Return the weights (E, 2), in X and Y, of the edges that determine a dimension.

    A centre is midway between two edges, a zone is as wide as the error of one. Round features
    have edges on all sides, which count in X and in Y alike."""
    kind = bound.dimension.kind
    if kind in DEPTHS:
        return np.array([[0.0, 0.0, 1.0]])
    if kind == "diameter":
        return opposite_edges(0.25 * math.pi)
    if kind == "distance":
        rows: list[Floats] = []
        for sign, end in zip((-1.0, 1.0), bound.ends, strict=True):
            half = [0.5, 0.5] if end.how == "centre" else [1.0]
            rows += [sign * share * bound.direction for share in half]
        return np.array(rows)
    diagonal = np.full(2, math.sqrt(0.5))
    if kind == "position":
        return np.array([diagonal, diagonal])
    return np.array([2.0 * diagonal if kind == "profile" else diagonal])


def _inspected(
    run: Run,
    dimensions: Iterable[Dimension],
    moves: SweptSegments,
    others: _OtherSetups,
    not_inspected: list[tuple[Dimension, Finding]],
) -> Iterable[Inspected]:
    assert run.drawing is not None
    assert run.job is not None
    features = features_of(run.drawing.paths)
    maps = placements(run.drawing, run.job)
    if abs(maps[0].scale - 1.0) > SCALE_SHARE:
        raise OptionError(
            f"the part is made {maps[0].scale:g} times as large as it is drawn",
            file=run.drawing.file,
            where="tolerances",
            mend="limits hold for the part as drawn: leave out fit and scale",
        )
    cuts_by_feature: dict[tuple[int, int], Cut | None] = {}
    floors: Floors | None = None
    for dimension in dimensions:
        if dimension.kind in DEPTHS:
            floors = floors or _floors(run)
            for copy, placement in enumerate(maps):
                place = placement.point(dimension.places_mm[0])
                each = _inspected_depth(run, dimension, floors.at(place))
                if isinstance(each, Finding):
                    not_inspected.append((dimension, each))
                    continue
                yield replace(each, copy=copy if len(maps) > 1 else None)
            continue
        bound = bind(dimension, features, run.drawing.file)
        if isinstance(bound, Finding):
            not_inspected.append((dimension, bound))
            continue
        for copy, placement in enumerate(maps):
            placed_bound = bound.in_work_frame(placement)
            cuts = []
            for drawn, feature in zip(bound.features, placed_bound.features, strict=True):
                key = id(drawn), copy
                if key not in cuts_by_feature:
                    cuts_by_feature[key] = cut_of(feature, moves)
                cuts.append(cuts_by_feature[key])
            if any(cuts):
                # A dimension whose features are all cut by other set-ups is inspected there.
                cuts = [
                    cut or others.cut_of(drawn, feature, copy)
                    for cut, drawn, feature in zip(
                        cuts, bound.features, placed_bound.features, strict=True
                    )
                ]
            candidate = Inspected(
                placed_bound, tuple(filter(None, cuts)), copy if len(maps) > 1 else None
            )
            if len(candidate.cuts) == len(cuts):
                yield candidate
                continue
            missing = placed_bound.features[cuts.index(None)]
            source = f"{run.drawing.file}, {dimension.source}"
            kind = "edge" if isinstance(missing, EdgeFeature) else "circle"
            other = _setup_that_cuts(run, missing.path)
            finding = DIMENSION_NOT_CUT(where=source, name=candidate.name, what=kind)
            if other is not None and run.job.setup_of is not None:
                finding = DIMENSION_NOT_CUT_ACROSS(
                    where=source,
                    name=candidate.name,
                    what=kind,
                    other=other.name,
                    beside=flip_error_words(other, run.job.setup_of[1]),
                )
            not_inspected.append((dimension, finding))


def _setup_that_cuts(run: Run, path: int) -> JobSetup | None:
    """Return the other set-up of the part that cuts a path of the drawing; None if none does."""
    assert run.drawing is not None
    assert run.job is not None
    if run.job.setup_of is None:
        return None
    part_job, own = run.job.setup_of
    layer, colour = run.drawing.layers[path], run.drawing.colours[path]
    for setup in part_job.setups:
        if setup != own and part_job.setup(setup.name).takes(layer, colour):
            return setup
    return None


def _floors(run: Run) -> Floors:
    """Return the floors that the job of a run is to leave."""
    assert run.drawing is not None
    assert run.job is not None
    assert run.verification is not None
    plan = planned(run.drawing, run.job, run.target.machine, undivided=True)
    off_um = run.verification.report.error_um.total.max or 0.0
    return Floors(plan.steps, off_um / UM_PER_MM)


def _inspected_depth(run: Run, dimension: Dimension, floor: Floor | None) -> Inspected | Finding:
    """Return a depth or thickness with its floor, its nominal size and its limits, or the finding
    that says why there is none."""
    assert run.job is not None
    stock, name = run.job.stock, dimension.name
    x, y = dimension.places_mm[0]
    place = f"{dimension.source}, at ({x:.3f}, {y:.3f}) mm"
    if floor is None:
        return DIMENSION_NOT_CUT_NO_FLOOR(where=place, name=name)
    if dimension.kind == "thickness" and stock is None:
        return DIMENSION_NOT_CUT_NO_STOCK(where=place, name=name)
    thick = 0.0 if stock is None else stock.thickness_mm
    if stock is not None and floor.depth_mm >= thick - POSITION_EPS_MM:
        depth = floor.depth_mm
        return DIMENSION_NOT_CUT_THROUGH(where=place, name=name, measured=depth, limit=thick)
    stock_mm = thick if dimension.kind == "thickness" else 0.0
    nominal = stock_mm - floor.depth_mm if stock_mm else floor.depth_mm
    limited_dimension, _ = limited(dimension, nominal)
    limited_dimension = replace(limited_dimension, places_mm=(floor.place_mm,))
    bound = BoundDimension(limited_dimension, (), (), np.zeros(2), nominal)
    return Inspected(bound, (), None, floor, stock_mm)


class ToolAt:
    """The radius at the surface of the tool of each wanted row, and the height down to which it is
    as wide."""

    def __init__(self, wanted_moves: Toolpath, job: Job, diameter_mm: float | None) -> None:
        """Take the tools of the operations that the wanted moves name; if they name none, one tool
        of this diameter (None: no width)."""
        rows = np.arange(len(wanted_moves))
        starts, ends = wanted_moves.starts_of(rows)[:, 2], wanted_moves.end[:, 2]
        self.z = np.maximum(starts, ends)
        """Height (N,) mm down to which each row cuts as wide as at the surface; infinite if the
        tool tapers over all its depth."""
        lowest = np.minimum(starts, ends)
        self.radius = np.full(len(wanted_moves), 0.5 * (diameter_mm or 0.0))
        """Radius (N,) mm at the surface."""
        operations = wanted_moves.operations
        if operations is None:
            return
        tools: dict[str, Tool] = {each.name: each.tool for each in job.operations}
        last = [*operations.begin[1:].tolist(), len(wanted_moves)]
        for note, begin, end in zip(
            operations.notes, operations.begin.tolist(), last, strict=True
        ):
            tool = tools.get(note.name)
            widest = 0.5 * note.tool.diameter_mm
            part = slice(begin, end)
            self.radius[part] = widest
            if tool is not None and (tool.kind == "v" or tool.nose_mm):
                depth = np.maximum(-lowest[part], 0.0)
                wide = np.array([tool.radius_at(each) for each in depth.tolist()])
                self.radius[part] = np.minimum(wide, widest) if widest else wide
                # Above its nose a mill is as wide as at the surface; a V bit never is.
                straight = self.z[part] + tool.nose_mm
                tapers = (straight >= 0.0) | (tool.kind == "v")
                self.z[part] = np.where(tapers, np.inf, straight)


def swept_moves(wanted_cuts: CutMoves, tool: ToolAt) -> SweptSegments:
    """Return the cutting moves as segments within `CHORD_MM` of their arcs."""
    arcs = wanted_cuts.segments.is_arc
    min_radius = float(wanted_cuts.segments.radius[arcs].min()) if arcs.any() else math.inf
    samples = sample_cuts(wanted_cuts, min(math.sqrt(8.0 * min_radius * CHORD_MM), 1.0))
    inside = np.flatnonzero(samples.segment[1:] == samples.segment[:-1])
    row = wanted_cuts.row[samples.segment[inside]].astype(np.int64)
    a, b = samples.points[inside], samples.points[inside + 1]
    return SweptSegments(a, b, tool.radius[row], tool.z[row], row)


def swept_trace(trace: SlideTrace, follows: Ints, tool: ToolAt) -> SweptSegments:
    """Return the cutting part of the path of the slides as segments; `follows` (N,) is the wanted
    row of each decoded row."""
    last = np.flatnonzero(trace.cutting)
    last = last[last > 0]
    row = follows[trace.row[last]]
    last, row = last[row >= 0], row[row >= 0]
    a, b = trace.points[last - 1], trace.points[last]
    return SweptSegments(a, b, tool.radius[row], tool.z[row], row)


def _points(wanted_cuts: CutMoves) -> int:
    """Return the number of points of the slides' path at which chords stay within `CHORD_MM` of
    the smallest arc."""
    arcs = wanted_cuts.segments.is_arc
    if not arcs.any():
        return TRACE_POINTS
    chord = math.sqrt(8.0 * float(wanted_cuts.segments.radius[arcs].min()) * CHORD_MM)
    length = float(row_lengths(wanted_cuts.toolpath).sum())
    return int(min(max(4.0 * length / chord, TRACE_POINTS), MAX_POINTS))
