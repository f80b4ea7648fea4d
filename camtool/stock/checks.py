"""Checks of a program in its stock: depths, what is left, passes, tabs, shank, holder and clamps.

All of them need the moves of the program, and know from the job alone what should be. First it is
tried to prove that nothing is too deep, or left (`camtool.stock.proofs`). Where that is not so,
depths are exact at each point that is looked at: along the axis and the edges of every cut, since
nothing is cut but by moves; on a lattice over the stock for what is left. The worst of them is
then searched for around it by branch and bound."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.findings import Finding, Severity
from camtool.geometry.measure import path_extents, signed_areas
from camtool.geometry.nesting import inside
from camtool.geometry.polylines import POSITION_EPS_MM, Polylines, Segments
from camtool.kernels.stock import StockTree
from camtool.planning.items import Bridge, Step
from camtool.planning.job import Job, KeepOutBox, Operation, Stock, Tool
from camtool.planning.naming import operation_name, tool_name
from camtool.planning.sides import runs_beside
from camtool.simulation.rows import block_of
from camtool.stock.before import WHOLE, StockBefore, least_remaining
from camtool.stock.cut import CutStock, cut_box
from camtool.stock.cutters import cutter_profile
from camtool.stock.findings import (
    CUT_TOO_DEEP,
    FACES_MEET,
    FINDINGS_LISTED,
    FLOOR_LEFT,
    KEEP_OUT_ENTERED,
    LOOSE_PIECE,
    LOOSE_PIECE_BEFORE,
    LOOSE_PIECE_CUT,
    MATERIAL_LEFT,
    NET_CUT,
    NETS_APART,
    NETS_JOINED,
    PASS_TOO_DEEP,
    STOCK_NOT_JUDGED_BEFORE,
    STOCK_NOT_JUDGED_NARROW,
    TAB_MISSING,
    TAB_MISSING_ALL,
    TAB_THIN,
    TOOL_IN_STOCK,
    TOOL_NOT_KNOWN,
    place_words,
)
from camtool.stock.heights import greatest_value, stock_tree
from camtool.stock.moves import StockMoves
from camtool.stock.proofs import Gouges, JudgedStock, Leftovers, Trial
from camtool.stock.wanted import CopperNets, WantedSolid, wanted_solid
from camtool.toolpath.findings import ProgramCode
from camtool.toolpath.moves import STOCK_TOP_MM, Toolpath

if TYPE_CHECKING:
    from camtool.stock.pieces import LoosePiece

ALONG_MM = 1.0
"""The stock is examined along each cut at points no farther apart than this, and at both
ends ..."""

MAX_PLACES = 50_000
"""... or farther apart for longer cuts, so that there are about this many points."""

MAX_CUTS = 500_000
"""In programs with more cuts than this only every second one is examined, or every third, ...: of
millions of cuts thousands lie beside each other."""

EDGE_SHARE = 0.98
"""The stock is also examined on both sides of the axis, at this share of the radius less the band
beside walls, since passes need not lie exactly on each other."""

LATTICE_POINTS = 20_000
"""Number of lattice points at which leftover material is searched for, if it is not proved that
there is none."""

TRIED_SQUARES = 40_000
"""Largest number of squares of a layer for a proof that must succeed quickly."""

SAME_PLACE_MM = 5.0
"""Places of one kind that are nearer to each other than this are one finding."""

REFINED_SQUARES = 20_000
"""Largest number of squares for the search of the worst place."""

BODY_SHARE = 0.25
"""Shank and holder are examined at steps of this share of their radius ..."""

RIM_POINTS = 16
"""... at this many points of their rim, and as many halfway to it."""

TAB_SLACK_MM = 0.05
"""A tab may be narrower by this much, and by the band beside the walls."""

PIECE_POINTS = 50
"""Number of points at which a loose piece is compared with the outlines of parts."""

MEETING_MM = 1e-3
"""Faces that overlap by no more than this are not reported."""

MIN_CHORDS = 48
"""Number of steps along its contour, to either side, at which a tab is examined."""


class StockRequest(Struct, frozen=True, eq=False):
    """What a job asks of the stock: the solid; its closed contours, and the mask (C,) of those
    that are outlines of parts without tabs; its operations that cut, in order, with the depth of
    each, mm, and the bridges of its tabs; the keep-out boxes; the stock; what earlier set-ups have
    cut of it (`before`); and the nets of `copper` that must be freed. `is_whole`: the program is
    the only one of its set-up, so that passes, and what is left, can be judged."""

    solid: WantedSolid
    contours: Polylines
    is_part: Bools
    operations: tuple[Operation, ...]
    depths_mm: tuple[float, ...]
    bridges: tuple[tuple[Bridge, ...], ...]
    tabs_left_out: bool
    keep_out: tuple[KeepOutBox, ...]
    stock: Stock | None
    before: StockBefore = WHOLE
    is_whole: bool = True
    copper: tuple[CopperNets, ...] = ()


def stock_request(
    steps: Sequence[Step],
    job: Job,
    wall_mm: float,
    *,
    before: StockBefore | None = None,
    is_whole: bool = True,
) -> StockRequest:
    """Return what a job asks of the stock, from the steps of its plan; see `StockRequest` for the
    arguments."""
    cutting = [step for step in steps if step.runs]
    codes = {finding.code.name for step in steps for finding in step.findings}
    closed = [step.chosen.lines.closed for step in cutting]
    parts = [
        step.chosen.rim & (runs_beside(step.operation) and step.operation.tabs is None)
        for step in cutting
    ]
    lines = Polylines.joined([step.chosen.lines for step in cutting])
    every = np.concatenate([*closed, np.zeros(0, dtype=np.bool_)])
    return StockRequest(
        wanted_solid(steps, wall_mm),
        lines.select(np.flatnonzero(every).tolist()),
        np.concatenate([*parts, np.zeros(0, dtype=np.bool_)])[every],
        tuple(step.operation for step in cutting),
        tuple(-step.setting.levels_mm[-1] for step in cutting),
        tuple(step.bridges for step in cutting),
        "TAB_LEFT_OUT" in codes,
        job.keep_out,
        job.stock,
        before or WHOLE,
        is_whole,
        tuple(_copper_of(step) for step in cutting if step.operation.contract.frees_nets),
    )


def _copper_of(step: Step) -> CopperNets:
    lines = step.chosen.lines
    closed = lines.select(np.flatnonzero(lines.closed).tolist())
    return CopperNets(operation_name(step.operation), closed, step.operation.own_value("copper"))


def stock_findings(
    decoded: Toolpath,
    moves: StockMoves,
    request: StockRequest,
    deep_mm: float,
    findings: Sequence[Finding] = (),
) -> tuple[Finding, ...]:
    """Return the findings about the stock after a program whose tools make these moves. Depths may
    be off by `deep_mm`; `findings` are those of planning."""
    checks = _Checks(decoded, request, moves, deep_mm)
    gouged = any(each.code is ProgramCode.GOUGE for each in findings)
    stock_faults = [
        *checks.too_deep(Severity.WARNING if gouged else Severity.ERROR),
        *checks.tabs(),
        *checks.loose(),
        *checks.remaining(),
        *checks.keep_out(),
        *checks.not_known(),
    ]
    if request.is_whole:
        stock_faults += [*checks.left(), *checks.passes(), *checks.bodies()]
    else:
        stock_faults.append(STOCK_NOT_JUDGED_BEFORE())
    return tuple(stock_faults)


def net_findings(slides: StockMoves, request: StockRequest) -> Iterator[Finding]:
    """Yield NETS_JOINED for nets of copper that are still connected after the moves of the slides,
    NET_CUT for nets that are no longer in one piece, and NETS_APART if there is neither."""
    from camtool.stock.nets import judge_nets

    stock = request.stock
    for copper in request.copper:
        report = judge_nets(slides, copper, None if stock is None else stock.box_mm)
        for sentence, faults in ((NETS_JOINED, report.shorts), (NET_CUT, report.opens)):
            for number, fault in enumerate(faults[:FINDINGS_LISTED], start=1):
                others = len(faults) - FINDINGS_LISTED if number == FINDINGS_LISTED else 0
                yield sentence(
                    where=place_words(fault.at_mm),
                    measured=fault.pieces,
                    operation=copper.name,
                    more=others,
                )
        if not (report.shorts or report.opens):
            yield NETS_APART(
                where=place_words(report.gap.at_mm) if report.gap else "",
                measured=report.nets,
                operation=copper.name,
                groove=f"{report.gap.width_mm:.3f} mm" if report.gap else "not closed",
                copper=f"{report.copper.width_mm:.3f} mm, {place_words(report.copper.at_mm)}"
                if report.copper
                else "not known",
            )


class _Points(Struct, frozen=True, eq=False):
    """Points (P, 2) beside the axes of moves, the move of each (P,), and the height of the tool's
    surface there (P,), mm."""

    points: Floats
    move: Ints
    z: Floats


class _Checks:
    """The stock of a program, and what the job asks of it."""

    def __init__(
        self, decoded: Toolpath, request: StockRequest, moves: StockMoves, deep_mm: float
    ) -> None:
        self.decoded, self.request, self.moves = decoded, request, moves
        tools = dict.fromkeys(operation.tool for operation in request.operations)
        self.tools: list[tuple[int, Tool]] = [
            (number, tool)
            for number, cutter in enumerate(moves.cutters)
            for tool in tools
            if cutter_profile(tool) == cutter
        ]
        self.solid, self.deep_mm = request.solid, deep_mm
        self.tree: StockTree = stock_tree(moves)
        self.before: StockBefore = request.before
        self.stock = JudgedStock(self.tree, self.solid, self.before)
        lowest = np.minimum(moves.start[:, 2], moves.end[:, 2])
        self.low: Ints = np.flatnonzero(lowest < STOCK_TOP_MM - POSITION_EPS_MM)
        every = max(1, math.ceil(len(self.low) / MAX_CUTS))
        self.cuts: _Points = self._beside(
            self.low[::every], self.moves.table[self.moves.tool, 0], EDGE_SHARE
        )

    def _beside(self, rows: Ints, radii: Floats, share: float) -> _Points:
        """Return points on the axis of moves and at `radii` to both sides of it."""
        start, travel = self.moves.start[rows], self.moves.end[rows] - self.moves.start[rows]
        length = np.hypot(travel[:, 0], travel[:, 1])
        along_mm = max(ALONG_MM, float(length.sum()) / MAX_PLACES)
        count = np.ceil(length / along_mm).astype(np.int64) + 1
        owners = np.repeat(np.arange(len(rows)), count)
        step = np.arange(len(owners)) - np.repeat(np.cumsum(count) - count, count)
        part = step / np.maximum(count[owners] - 1, 1)
        # Straight down the lower end is what cuts.
        straight = (length == 0.0) & (travel[:, 2] < 0.0)
        part = np.where(straight[owners], 1.0, part)
        axis = start[owners] + part[:, None] * travel[owners]
        headings = np.divide(
            travel[:, :2],
            length[:, None],
            out=np.tile([1.0, 0.0], (len(rows), 1)),
            where=length[:, None] > 0.0,
        )
        normals = np.column_stack([-headings[:, 1], headings[:, 0]])[owners]
        offsets = np.maximum(share * radii[rows] - self.solid.wall_mm, 0.0)[owners]
        shifted = [axis[:, :2] + side * offsets[:, None] * normals for side in (0.0, -1.0, 1.0)]
        return _Points(np.concatenate(shifted), np.tile(rows[owners], 3), np.tile(axis[:, 2], 3))

    def _in_stock(self, points: Floats) -> Bools:
        """Return the mask (P,) of points within the sides of the stock; all True if these are not
        known."""
        box = None if self.request.stock is None else self.request.stock.box_mm
        if box is None:
            return np.ones(len(points), dtype=np.bool_)
        return np.asarray(((points >= box[:2]) & (points <= box[2:])).all(axis=1))

    def too_deep(self, severity: Severity) -> Iterator[Finding]:
        """Yield CUT_TOO_DEEP for places where the stock is lower than allowed."""
        trial = self._tried(Gouges)
        if trial.holds:
            return
        gouge_of, upper = self.stock.gouge
        points = np.concatenate([self.cuts.points, [trial.at_mm]])
        points = points[self._in_stock(points)]
        for place, other_count in self._worst(points, gouge_of(points), gouge_of, upper):
            z, move_index = self.tree.heights(place[None])
            row = int(self.moves.row[move_index[0]])
            low = float(self.solid.bands(place[None])[0, 0])
            name = self.solid.cut_by((float(place[0]), float(place[1])))
            yield CUT_TOO_DEEP(
                where=self._where(row, place),
                measured=float(gouge_of(place[None])[0]),
                limit=self.deep_mm,
                severity=severity,
                by=f"operation {name!r}: " if name else "",
                z=float(z[0]),
                low=low,
                more=other_count,
            )

    def left(self) -> Iterator[Finding]:
        """Yield MATERIAL_LEFT for places where the stock is higher than the job asks."""
        leftover_of, upper = self.stock.leftover
        boxes = [layer.curves.boxes for layer in self.solid.must if len(layer.lines)]
        if not boxes:
            return
        trial = self._tried(Leftovers)
        if trial.holds:
            return
        every = np.concatenate(boxes)
        wide = max(layer.shift_mm for layer in self.solid.must)
        low, high = every[:, :2].min(axis=0) - wide, every[:, 2:].max(axis=0) + wide
        step = math.sqrt(float(np.prod(high - low)) / LATTICE_POINTS)
        x, y = (np.arange(low[k] + 0.5 * step, high[k], step) for k in (0, 1))
        points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
        points = np.concatenate([points, [trial.at_mm]])
        points = points[self._in_stock(points)]
        for place, other_count in self._worst(points, leftover_of(points), leftover_of, upper):
            z, high_z = self.stock.tops(place[None]), self.solid.bands(place[None])[0, 1]
            yield MATERIAL_LEFT(
                where=place_words(place),
                measured=float(leftover_of(place[None])[0]),
                limit=self.deep_mm,
                z=float(z[0]),
                high=float(high_z),
                more=other_count,
            )

    def _tried(self, judge: type[Gouges] | type[Leftovers]) -> Trial:
        """Try to prove that no place exceeds the tolerances; if that succeeds, no points need to
        be examined."""
        distance_mm = min(self.solid.wall_mm, self.deep_mm)
        if len(self.low) > MAX_CUTS or distance_mm <= 0.0:
            return Trial(False)
        box = None if self.request.stock is None else self.request.stock.box_mm
        stock = CutStock(self.moves, self.tree, box or cut_box(self.moves))
        judged = judge(stock, self.solid, self.before, TRIED_SQUARES)
        return judged.tried(distance_mm)

    def _worst(
        self,
        points: Floats,
        values: Floats,
        value: Callable[[Floats], Floats],
        upper: Callable[[Floats], Floats],
    ) -> Iterator[tuple[Floats, int]]:
        """Yield (place (2,), number of places not listed) for the points (P, 2) with the greatest
        values (P,) above the tolerance. Each place is refined to the greatest value near it."""
        exceeding = np.flatnonzero(values > self.deep_mm)
        exceeding = exceeding[np.argsort(-values[exceeding], kind="stable")]
        places: list[Floats] = []
        while len(exceeding):
            places.append(points[exceeding[0]])
            distances = np.hypot(*(points[exceeding] - places[-1]).T)
            exceeding = exceeding[distances > SAME_PLACE_MM]
        for number, place in enumerate(places[:FINDINGS_LISTED], start=1):
            (x, y), half = place.tolist(), 0.5 * ALONG_MM
            best = greatest_value(
                value,
                upper,
                (x - half, y - half, x + half, y + half),
                0.1 * self.deep_mm,
                max_squares=REFINED_SQUARES,
            )
            two_places = np.array([place, best.at_mm])
            other_count = len(places) - FINDINGS_LISTED if number == FINDINGS_LISTED else 0
            yield two_places[int(value(two_places).argmax())], other_count

    def passes(self) -> Iterator[Finding]:
        """Yield PASS_TOO_DEEP for feeds that remove a thicker layer at once than their operation
        allows."""
        limit = self._chips_mm()
        feeds = ~self.moves.rapid[self.cuts.move] & self._in_stock(self.cuts.points)
        # No move cuts below its lower end, nor above the top of the stock.
        lowest = np.minimum(self.moves.start[:, 2], self.moves.end[:, 2])
        feeds &= (STOCK_TOP_MM - lowest > limit + self.deep_mm)[self.cuts.move]
        points, move = np.ascontiguousarray(self.cuts.points[feeds]), self.cuts.move[feeds]
        before = self.stock.tops(points, move)
        doubtful = before - lowest[move] > limit[move] + self.deep_mm
        points, move, before = points[doubtful], move[doubtful], before[doubtful]
        after = np.maximum(self.stock.tops(points, move + 1), self.before.floors(points))
        chip = before - after
        excess = chip - limit[move]
        blocks: dict[int, int] = {}
        for k in np.argsort(-excess, kind="stable").tolist():
            if excess[k] <= self.deep_mm:
                break
            blocks.setdefault(int(self.moves.row[move[k]]), k)
        for number, (row, k) in enumerate(list(blocks.items())[:FINDINGS_LISTED], start=1):
            operations = self._operations_of(row)
            yield PASS_TOO_DEEP(
                where=self._where(row, points[k]),
                measured=float(chip[k]),
                limit=float(limit[move[k]]),
                operation=operation_name(self.request.operations[operations[0]]),
                more=len(blocks) - FINDINGS_LISTED if number == FINDINGS_LISTED else 0,
            )

    def _operations_of(self, row: int) -> list[int]:
        """Return the indices of the operations that a row of the program may belong to: its own if
        known, else all that use its tool."""
        plan = self.decoded.operations
        if plan is not None and len(plan.notes) == len(self.request.operations):
            turn = int(np.searchsorted(plan.begin, row, side="right")) - 1
            return [max(turn, 0)]
        move = int(np.searchsorted(self.moves.row, row))
        return self._with_cutter(int(self.moves.tool[min(move, len(self.moves) - 1)]))

    def _chips_mm(self) -> Floats:
        """Return (M,) the thickest layer, mm, that each move may remove at once."""
        operations, plan = self.request.operations, self.decoded.operations
        max_chips = np.array(list(map(_chip_mm, operations, self.request.depths_mm)))
        if plan is not None and len(plan.notes) == len(operations):
            turn = np.searchsorted(plan.begin, self.moves.row, side="right") - 1
            return np.asarray(max_chips[turn.clip(min=0)])
        of_cutter = [
            max([max_chips[k] for k in self._with_cutter(number)], default=math.inf)
            for number in range(len(self.moves.cutters))
        ]
        return np.asarray(np.array(of_cutter)[self.moves.tool])

    def _with_cutter(self, number: int) -> list[int]:
        """Return the indices of the operations whose tool has the shape of this cutter."""
        cutter, operations = self.moves.cutters[number], self.request.operations
        return [k for k, each in enumerate(operations) if cutter_profile(each.tool) == cutter]

    def tabs(self) -> Iterator[Finding]:
        """Yield TAB_MISSING and TAB_THIN for tabs that do not stand as the job asks."""
        requested = (self.request.operations, self.request.depths_mm, self.request.bridges)
        for operation, depth_mm, bridges in zip(*requested, strict=True):
            tabs, name = operation.tabs, operation_name(operation)
            if tabs is None:
                continue
            if not bridges and not self.request.tabs_left_out:
                yield TAB_MISSING_ALL(operation=name)
            for bridge in bridges:
                slack_mm = TAB_SLACK_MM + 2.0 * self.solid.wall_mm
                wide, high = self._tab(bridge, tabs.width_mm, tabs.height_mm, depth_mm)
                if high < tabs.height_mm - self.deep_mm:
                    yield TAB_MISSING(
                        where=place_words(bridge.centre),
                        measured=max(high, 0.0),
                        limit=tabs.height_mm,
                        operation=name,
                    )
                elif wide < tabs.width_mm - slack_mm:
                    yield TAB_THIN(
                        where=place_words(bridge.centre),
                        measured=wide,
                        limit=tabs.width_mm,
                        operation=name,
                    )

    def _tab(
        self, bridge: Bridge, width_mm: float, height_mm: float, depth_mm: float
    ) -> tuple[float, float]:
        """Measure a tab in the simulated stock: return the width, along the path, over which it
        has its full height, and the height of its middle above the floor of the cut, mm."""
        half = 0.5 * width_mm
        step = half * np.arange(-MIN_CHORDS, MIN_CHORDS + 1) / MIN_CHORDS
        points = bridge.centre + step[:, None] * bridge.ahead
        standing = self.stock.tops(points) - np.maximum(self.before.floors(points), -depth_mm)
        is_gone = standing < height_mm - self.deep_mm
        low, high = step[is_gone & (step <= 0.0)], step[is_gone & (step >= 0.0)]
        wide = high.min(initial=half) - low.max(initial=-half)
        return float(wide), float(standing[MIN_CHORDS])

    def loose(self) -> Iterator[Finding]:
        """Yield findings for pieces that come loose and are no finished part, for parts that are
        cut into after they came loose, and for cuts into pieces that an earlier set-up has freed.
        """
        stock = self.request.stock
        if stock is None:
            return
        from camtool.stock.pieces import BEFORE, loose_pieces

        result = loose_pieces(self.moves, stock.thickness_mm, stock.box_mm, self.before)
        every = result.pieces
        if result.narrowest_mm < result.seen_mm - POSITION_EPS_MM:
            yield STOCK_NOT_JUDGED_NARROW(measured=result.narrowest_mm, limit=result.seen_mm)
        pieces = [
            (piece, is_part)
            for piece in every
            for is_part in (self._is_part(piece),)
            if piece.move != BEFORE and (not is_part or piece.again >= 0)
        ]
        for number, (piece, is_part) in enumerate(pieces[:FINDINGS_LISTED], start=1):
            left_x, low, right, high = piece.box_mm
            yield (LOOSE_PIECE_CUT if is_part else LOOSE_PIECE)(
                where=self._where(
                    int(self.moves.row[piece.move]),
                    np.array([0.5 * (left_x + right), 0.5 * (low + high)]),
                ),
                measured=piece.area_mm2,
                width=right - left_x,
                height=high - low,
                again=block_of(self.decoded, int(self.moves.row[piece.again])),
                more=max(len(pieces) - FINDINGS_LISTED, 0) if number == FINDINGS_LISTED else 0,
            )
        for piece in every:
            z, move = self.tree.heights(piece.points)
            cut = z < self.before.tops(piece.points) - self.deep_mm
            if piece.move == BEFORE and cut.any():
                left_x, low, right, high = piece.box_mm
                yield LOOSE_PIECE_BEFORE(
                    where=self._where(int(self.moves.row[move[cut].min()]), piece.points[cut][0]),
                    measured=piece.area_mm2,
                    width=right - left_x,
                    height=high - low,
                )

    def remaining(self) -> Iterator[Finding]:
        """Yield FACES_MEET where cuts from both faces meet, or else FLOOR_LEFT with the least
        thickness that they leave."""
        stock = self.request.stock
        if stock is None or not self.before.below:
            return
        box = stock.box_mm or cut_box(self.moves)
        thickness = least_remaining(self.tree, self.before, box)
        if not math.isfinite(thickness.low):
            return
        place, other = (
            place_words(thickness.at_mm),
            self.before.deepest_below(np.array(thickness.at_mm)),
        )
        if thickness.low > MEETING_MM:
            yield FACES_MEET(where=place, measured=thickness.low, other=other)
        else:
            yield FLOOR_LEFT(where=place, measured=max(-thickness.low, 0.0), other=other)

    def _is_part(self, piece: LoosePiece) -> bool:
        """Return True if a loose piece is a part: for more than half of it, the innermost contour
        around it is the outline of a part."""
        contours = self.request.contours
        if not len(contours):
            return False
        points = piece.points[:: max(1, len(piece.points) // PIECE_POINTS)]
        boxes, areas = path_extents(contours), np.abs(signed_areas(contours))
        is_near = (boxes[:, :, 0] < points.max(axis=0)) & (boxes[:, :, 1] > points.min(axis=0))
        innermost = np.full(len(points), -1, dtype=np.int64)
        rows = np.flatnonzero(is_near.all(axis=1))
        for row in rows[np.argsort(-areas[rows])].tolist():
            innermost[inside(points, Segments.of(contours.select([row])))] = row
        parts = self.request.is_part[innermost] & (innermost >= 0)
        return bool(2 * int(parts.sum()) > len(points))

    def bodies(self) -> Iterator[Finding]:
        """Yield TOOL_IN_STOCK for shanks and holders that touch the stock as it stands after the
        move that carries them."""
        for number, tool in self.tools:
            for body, radius, begin, _ in tool.bodies:
                wider = radius > tool.radius_mm + POSITION_EPS_MM
                rows = self.low[self.moves.tool[self.low] == number]
                lowest = np.minimum(self.moves.start[rows, 2], self.moves.end[rows, 2]) + begin
                rows = rows[lowest < STOCK_TOP_MM - self.deep_mm]
                if wider and len(rows):
                    yield from self._body(rows, tool, body, radius, begin)

    def _body(
        self, rows: Ints, tool: Tool, body: str, radius: float, begin: float
    ) -> Iterator[Finding]:
        start, travel = self.moves.start[rows], self.moves.end[rows] - self.moves.start[rows]
        step = BODY_SHARE * radius
        count = np.ceil(np.hypot(travel[:, 0], travel[:, 1]) / step).astype(np.int64) + 1
        owners = np.repeat(np.arange(len(rows)), count)
        part = np.arange(len(owners)) - np.repeat(np.cumsum(count) - count, count)
        part = np.where(count[owners] > 1, part / np.maximum(count[owners] - 1, 1), 1.0)
        axis = start[owners] + part[:, None] * travel[owners]
        turn = np.arange(RIM_POINTS) * (math.tau / RIM_POINTS)
        rim = (radius - self.solid.wall_mm) * np.column_stack([np.cos(turn), np.sin(turn)])
        worst: dict[int, tuple[float, Floats]] = {}
        for offset in (*rim, *(0.5 * (rim + tool.radius_mm * rim / radius))):
            points = np.ascontiguousarray(axis[:, :2] + offset)
            floor = np.maximum(axis[:, 2] + begin, self.before.floors(points))
            z = self.stock.tops(points, rows[owners] + 1)
            depths = np.where(self._in_stock(points), z - floor, -np.inf)
            for k in np.flatnonzero(depths > self.deep_mm).tolist():
                row = int(self.moves.row[rows[owners[k]]])
                if depths[k] > worst.get(row, (0.0,))[0]:
                    worst[row] = (float(depths[k]), points[k])
        ordered = sorted(worst.items(), key=lambda each: -each[1][0])
        for row, (deep_mm, place) in ordered[:1]:
            yield TOOL_IN_STOCK(
                where=self._where(row, place),
                measured=deep_mm,
                limit=0.0,
                body=body,
                tool=tool_name(tool),
                more=len(ordered) - 1,
            )

    def keep_out(self) -> Iterator[Finding]:
        """Yield KEEP_OUT_ENTERED for moves, rapids included, in which a part of a tool enters a
        keep-out box."""
        for box in self.request.keep_out:
            for number, tool in self.tools:
                rows = np.flatnonzero(self.moves.tool == number)
                top = min([begin for _, _, begin, _ in tool.bodies], default=math.inf)
                for body, radius, begin, end in (
                    ("cutter", tool.radius_mm, 0.0, top),
                    *tool.bodies,
                ):
                    depths, place = self._entered(rows, box, (radius, begin, end))
                    blocks = distinct(self.moves.row[rows[depths > POSITION_EPS_MM]])
                    if len(blocks):
                        k = int(depths.argmax())
                        yield KEEP_OUT_ENTERED(
                            where=self._where(int(self.moves.row[rows[k]]), place[k]),
                            measured=float(depths[k]),
                            limit=0.0,
                            body=body,
                            tool=tool_name(tool),
                            box=box.name,
                            more=len(blocks) - 1,
                        )

    def _entered(
        self, rows: Ints, box: KeepOutBox, body: tuple[float, float, float]
    ) -> tuple[Floats, Floats]:
        """Return how far the side of a cylinder enters a box in the moves (R,), mm (its radius
        where its axis enters; negative where it stays out), and the nearest places (R, 2) of its
        axis."""
        radius, begin, end = body
        start, travel = self.moves.start[rows], self.moves.end[rows] - self.moves.start[rows]
        # The part of each move in which the heights of both meet.
        parts = np.tile([0.0, 1.0], (len(rows), 1))
        is_met = np.ones(len(rows), dtype=np.bool_)
        for sign, limit in ((1.0, box.z_mm[1] - begin), (-1.0, end - box.z_mm[0])):
            # sign · z < limit
            room = limit - sign * start[:, 2]
            fall = sign * travel[:, 2]
            with np.errstate(divide="ignore", invalid="ignore"):
                crossing = np.clip(room / fall, 0.0, 1.0)
            parts[:, 1] = np.where(fall > 0.0, np.minimum(parts[:, 1], crossing), parts[:, 1])
            parts[:, 0] = np.where(fall < 0.0, np.maximum(parts[:, 0], crossing), parts[:, 0])
            is_met &= np.maximum(room, room - fall) > 0.0
        is_met &= parts[:, 0] <= parts[:, 1]
        a = start[:, :2] + parts[:, :1] * travel[:, :2]
        b = start[:, :2] + parts[:, 1:] * travel[:, :2]
        distances, place = _from_box(a, b, box)
        return np.where(is_met, radius - distances, -np.inf), place

    def not_known(self) -> Iterator[Finding]:
        """Yield TOOL_NOT_KNOWN for tools whose shank or holder is not known, if the job describes
        shanks, holders or keep-out boxes."""
        bodies_told = [{body for body, *_ in tool.bodies} for _, tool in self.tools]
        if not self.request.keep_out and not any(bodies_told):
            return
        lacking = [
            f"{body} of {tool_name(tool)}"
            for (_, tool), known_bodies in zip(self.tools, bodies_told, strict=True)
            for body in ("shank", "holder")
            if body not in known_bodies
        ]
        if lacking:
            yield TOOL_NOT_KNOWN(bodies=", ".join(lacking))

    def _where(self, row: int, place: Floats) -> str:
        return f"{block_of(self.decoded, row)} {place_words(place)}"


def _chip_mm(operation: Operation, depth_mm: float) -> float:
    """Return the thickest layer that an operation may remove at once, mm: its step down or peck,
    at most the length of the tool's edges. Operations that slope or finish may remove their full
    depth."""
    descent = operation.contract.descent
    step = operation.peck_mm if descent == "pecks" else operation.step_down_mm
    if descent == "slopes" or operation.stage == "finish" or step is None:
        step = depth_mm
    return min(max(step, operation.last_pass_mm or 0.0), operation.tool.cutting_length_mm or step)


def _from_box(a: Floats, b: Floats, box: KeepOutBox) -> tuple[Floats, Floats]:
    """Return the distances (R,) in the plane of the lines from a to b (R, 2) to a box, 0 where
    they enter it, and their nearest places (R, 2)."""
    low = np.array([box.x_mm[0], box.y_mm[0]])
    high = np.array([box.x_mm[1], box.y_mm[1]])
    travel = b - a
    length2 = (travel**2).sum(axis=1)
    shares = [np.zeros(len(a)), np.ones(len(a))]
    safe = np.where(length2 > 0.0, length2, 1.0)
    for x in (low[0], high[0]):
        for y in (low[1], high[1]):
            if math.isfinite(x) and math.isfinite(y):
                foot = ((np.array([x, y]) - a) * travel).sum(axis=1) / safe
                shares.append(np.clip(foot, 0.0, 1.0))
    for axis in (0, 1):
        for side in (low[axis], high[axis]):
            if math.isfinite(side):
                safe = np.where(travel[:, axis] != 0.0, travel[:, axis], 1.0)
                shares.append(np.clip((side - a[:, axis]) / safe, 0.0, 1.0))
    places = a + np.stack(shares)[:, :, None] * travel
    overhangs = np.maximum(np.maximum(low - places, places - high), 0.0)
    distances = np.hypot(overhangs[..., 0], overhangs[..., 1])
    best = distances.argmin(axis=0)
    every = np.arange(len(a))
    return distances[best, every], places[best, every]
