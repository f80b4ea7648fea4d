"""Proofs that a program cuts nowhere below the wanted solid, and leaves nothing above it, by more
than a distance.

Distances count in the plane and in depth alike: a place is fine within a distance d if the stock
there keeps to the wanted solid whose walls are moved by d, to within d of height. So a wall that
is 3 µm off its line is a gouge of 3 µm, however deep it is. The greatest gouge is the least d with
which all places are fine, and is found by trials of one d each.

*Nothing is gouged* where the moves stay clear of walls. Beneath a point of a move that is s inside
of a layer (`WantedLayer.inwards`), and x from its axis, the layer allows depth(s − x) at least,
since no distance changes by more than the way. What a tool of height f(x) cuts to z is fine if

    depth(s + d − x) + f(x) ≥ −z − d    for all x up to the width of the tool at the stock top,

of which the ends of the range and the kinks are the worst. All of these are concave functions of s
and z; so a whole move is fine if its ends are, with s bounded from below by a line between them
(`camtool.kernels.offsets.chord_distances`). Moves along walls need no division therefore.

*Nothing is left* of a groove if at each place of its line some move of its own tool passes within
d, deep enough. It is left of a region where no move covers it: squares are divided until one or
two moves cover each of them (`StockTree.greatest_over`), less what lies beyond a wall.

What the one layer or the one tool does not show is searched for by squares."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.polylines import Polyline, Polylines
from camtool.kernels.offsets import APART, MORE, MORE_BEYOND, SLOPE_X, SLOPE_Y
from camtool.kernels.stock import StockTree
from camtool.records import replace
from camtool.stock.before import WHOLE, StockBefore
from camtool.stock.cut import Box, CutStock
from camtool.stock.cutters import CutterProfile
from camtool.stock.heights import Bracket, greatest_value, move_columns, stock_tree
from camtool.stock.moves import StockMoves
from camtool.stock.wanted import ABOUT, DIAGONAL, WantedLayer, WantedSolid
from camtool.toolpath.moves import STOCK_TOP_MM

EPS_MM = 1e-9
"""Rounding of the comparisons."""

SHORT_SHARE = 1.0 / 16.0
"""Chords shorter than this share of the distance are not divided further."""

SAGITTA_SHARE = 1.0 / 8.0
"""Arcs of lines are judged by chords within this share of the distance of them."""

THIN_SHARES = (0.4, 0.05)
"""Largest distance of the thinned moves from the slides, as a share of the limit, tried in turn,
..."""

MIN_THIN_MM = 1e-4
"""... but at least this."""

TRIAL_SHARE = 0.15
"""Distances above the limit are determined to within this share of them, ..."""

FLOOR_SHARE = 0.98
"""... those of floors, which a single place shows, to within one minus this, ..."""

MAX_TRIALS = 8
"""... but with no more trials than this."""

MAX_SQUARES = 400_000
"""Largest number of squares of a layer in one trial; if they do not suffice, nothing is proved."""

RING_POINTS = 16
"""Number of directions in which the edge of a tool is examined at a doubtful place."""

MAX_DOUBTFUL = 2_000
"""Largest number of doubtful places that are examined in a round, or searched in a groove."""


class Trial(Struct, frozen=True):
    """The result of trying a distance. `holds`: all places are proved to be within it; otherwise
    the greatest excess of height that was found, mm, and its place (−inf: none was found)."""

    holds: bool
    excess_mm: float = -math.inf
    at_mm: tuple[float, float] = (0.0, 0.0)


Judgement = tuple[Callable[[Floats], Floats], Callable[[Floats], Floats]]
"""(Function from points (J, 2) to a value, function from squares (K, 3) to upper bounds of it.)"""


class JudgedStock(Struct, frozen=True, eq=False):
    """The stock after a program, with what earlier set-ups have cut (`before`), compared with the
    wanted solid."""

    tree: StockTree
    solid: WantedSolid
    before: StockBefore

    def tops(self, points: Floats, until: Ints | None = None) -> Floats:
        """Return the heights (J,), mm, of the stock over points (J, 2), after all moves, or before
        the moves `until` (J,)."""
        return np.minimum(self.tree.heights(points, until)[0], self.before.tops(points))

    @property
    def gouge(self) -> Judgement:
        """Depth of what is cut though it is to stay, mm."""

        def value(points: Floats) -> Floats:
            low = np.minimum(self.solid.bands(points)[:, 0], self.before.tops(points))
            return low - np.maximum(self.tree.heights(points)[0], self.before.floors(points))

        def upper(squares: Floats) -> Floats:
            low = np.minimum(self.solid.bounds(squares)[:, 1], self.before.greatest_tops(squares))
            return low - np.maximum(
                self.tree.min_heights(squares), self.before.least_floors(squares)
            )

        return value, upper

    @property
    def leftover(self) -> Judgement:
        """Height of what is left though it is to go, mm."""

        def value(points: Floats) -> Floats:
            return self.tops(points) - np.maximum(
                self.solid.bands(points)[:, 1], self.before.floors(points)
            )

        def upper(squares: Floats) -> Floats:
            top = np.minimum(self.tree.max_heights(squares), self.before.greatest_tops(squares))
            lowest = self.solid.bounds(squares)[:, 2]
            return top - np.maximum(lowest, self.before.least_floors(squares))

        return value, upper


CutWithin = Callable[[float], CutStock]
"""The function that returns the stock after a program, cut by moves within this distance (mm) of
the slides."""


def proved_gouge(
    cut: CutWithin, solid: WantedSolid, limit_mm: float, before: StockBefore = WHOLE
) -> Bracket:
    """Bracket the greatest distance, mm, by which the slides cut into the wanted solid. A distance
    within `limit_mm` is only bounded from above (the bracket is 0 to `limit_mm`)."""
    return _least_distance(lambda thin_mm: Gouges(cut(thin_mm), solid, before), limit_mm)


def proved_leftover(
    cut: CutWithin, solid: WantedSolid, limit_mm: float, before: StockBefore = WHOLE
) -> Bracket:
    """Bracket the greatest distance, mm, by which material is left above what must be cut, as
    `proved_gouge` does."""
    return _least_distance(lambda thin_mm: Leftovers(cut(thin_mm), solid, before), limit_mm)


def _least_distance(judge: Callable[[float], Gouges | Leftovers], limit_mm: float) -> Bracket:
    """Bracket the least distance, mm, for which a trial holds. Coarsely thinned moves are tried
    first, since they are cheap."""
    for share in THIN_SHARES:
        judged = judge(max(share * limit_mm, MIN_THIN_MM))
        beside_mm = judged.stock.moves.beside_mm
        trial_mm = limit_mm - beside_mm
        trial = judged.tried(trial_mm) if trial_mm > 0.0 else Trial(False)
        if trial.holds:
            return Bracket(0.0, limit_mm, trial.at_mm)
    low, high, failed_mm, guess_mm, place = 0.0, math.inf, 0.0, 0.0, trial.at_mm
    for _ in range(MAX_TRIALS):
        if trial.holds:
            high = trial_mm
        else:
            failed_mm = trial_mm
            if math.isfinite(trial.excess_mm):
                low, place = trial_mm, trial.at_mm
        if failed_mm <= 0.0:
            break
        # At one place the excess falls as the distance grows, so for a floor the excess itself is
        # a sufficient distance.
        if not guess_mm and 0.0 < trial.excess_mm < min(high, 2.0 * failed_mm):
            trial_mm = guess_mm = trial.excess_mm + EPS_MM
        elif high == guess_mm and failed_mm < FLOOR_SHARE * high:
            trial_mm = FLOOR_SHARE * high
        elif high <= (1.0 + TRIAL_SHARE) * failed_mm:
            break
        else:
            trial_mm = min(2.0 * failed_mm, 0.5 * (failed_mm + high))
        trial = judged.tried(trial_mm)
    return Bracket(max(low - beside_mm, 0.0), high + beside_mm, place)


class _Chords(Struct, frozen=True, eq=False):
    """K chords of moves below the stock top: their `middle` and their `half` vector from there to
    the end (K, 2), the heights of the tip at both ends (K, 2), and the tool of each (K,)."""

    middle: Floats
    half: Floats
    z: Floats
    tool: Ints

    def __len__(self) -> int:
        return len(self.tool)

    def select(self, rows: Bools | Ints | slice) -> _Chords:
        """Return the chosen chords."""
        return _Chords(self.middle[rows], self.half[rows], self.z[rows], self.tool[rows])

    @property
    def length(self) -> Floats:
        """Half the length (K,) of each, or of its fall where that is more."""
        fall = 0.5 * np.abs(self.z[:, 1] - self.z[:, 0])
        return np.maximum(np.hypot(self.half[:, 0], self.half[:, 1]), fall)

    @property
    def points(self) -> _Chords:
        """The middles as chords of no length."""
        middle = self.z.mean(axis=1)
        return _Chords(
            self.middle, np.zeros_like(self.half), np.column_stack([middle, middle]), self.tool
        )

    @property
    def halves(self) -> _Chords:
        """Return both halves of each chord."""
        half, middle = 0.5 * self.half, self.z.mean(axis=1)
        return _Chords(
            np.concatenate([self.middle - half, self.middle + half]),
            np.concatenate([half, half]),
            np.concatenate(
                [np.column_stack([self.z[:, 0], middle]), np.column_stack([middle, self.z[:, 1]])]
            ),
            np.concatenate([self.tool, self.tool]),
        )


class Gouges:
    """The moves of a program, and the layers that they may cut, for proofs that nothing is
    gouged."""

    def __init__(
        self,
        stock: CutStock,
        solid: WantedSolid,
        before: StockBefore,
        max_squares: int = MAX_SQUARES,
    ) -> None:
        self.stock, self.solid, self.before = stock, solid, before
        self.max_squares = max_squares
        moves = stock.moves
        low = np.minimum(moves.start[:, 2], moves.end[:, 2]) < STOCK_TOP_MM - EPS_MM
        low &= moves.table[moves.tool, 0] > 0.0
        self.table: Floats = moves.table
        cuts = moves.select(low).below(STOCK_TOP_MM)
        columns = move_columns(cuts)
        start, end = cuts.start, cuts.end
        # Straight up or down the lower end cuts all.
        plunge = columns[:, 5] == 0.0
        low_z = np.where(plunge, columns[:, 2], start[:, 2])
        high_z = np.where(plunge, columns[:, 2], end[:, 2])
        self.chords = _Chords(
            0.5 * (start + end)[:, :2],
            0.5 * (end - start)[:, :2],
            np.column_stack([low_z, high_z]),
            cuts.tool,
        )

    def tried(self, distance_mm: float) -> Trial:
        """Try to prove that nothing is cut into the solid by more than a distance."""
        chords, waiting = self.chords, list[_Chords]()
        while len(chords):
            chords = chords.select(~self._are_fine(chords, distance_mm))
            if not len(chords):
                break
            doubtful = ~self._are_fine(chords.points, distance_mm)
            if doubtful.any():
                trial = self._worst(chords.select(doubtful), distance_mm)
                if trial.excess_mm > distance_mm:
                    return trial
            short = doubtful | (chords.length <= SHORT_SHARE * distance_mm)
            waiting.append(chords.select(short))
            chords = chords.select(~short).halves
        rest = [each for each in waiting if len(each)]
        return self._searched(rest, distance_mm) if rest else Trial(True)

    def _are_fine(self, chords: _Chords, distance_mm: float) -> Bools:
        """Return the mask (K,) of chords that are proved: a single layer allows all that they cut,
        or they cut nothing."""
        wide = np.abs(chords.half) + self.table[chords.tool, :1]
        low, high = np.array(self.stock.box_mm).reshape(2, 2)
        is_outside = (chords.middle + wide < low) | (chords.middle - wide > high)
        fine: Bools = np.asarray(is_outside.any(axis=1))
        for layer in self.solid.may:
            rows = np.flatnonzero(~fine)
            if not len(rows):
                break
            fine[rows] = _allows(layer, chords.select(rows), self.table, distance_mm)
        return fine

    def _worst(self, chords: _Chords, distance_mm: float) -> Trial:
        """Return the greatest excess found at the tool's axis and edge in the middle of each
        chord."""
        points = chords.points.select(slice(MAX_DOUBTFUL))
        radius, flat, corner, rise = self.table[points.tool].T
        deep = STOCK_TOP_MM - points.z[:, 0]
        wide = _width(deep, radius, flat, corner, rise)
        turn = np.arange(RING_POINTS) * (math.tau / RING_POINTS)
        ways = [np.zeros((len(points), 2))]
        ways += [np.tile([math.cos(each), math.sin(each)], (len(points), 1)) for each in turn]
        for layer in self.solid.may:
            if len(layer.lines):
                direction = layer.tangents(points.middle, np.full(len(points), EPS_MM))[:, 0]
                ways += [direction[:, [SLOPE_X, SLOPE_Y]], -direction[:, [SLOPE_X, SLOPE_Y]]]
        at = np.concatenate(
            [points.middle + (1.0 - EPS_MM) * wide[:, None] * direction for direction in ways]
        )
        return _greatest(at, self._excess(at, distance_mm), self.stock.box_mm)

    def _excess(self, at: Floats, distance_mm: float) -> Floats:
        """Return how far (mm) the stock at points (P, 2) is below what is allowed, with walls
        moved by a distance."""
        return self._judged(self.stock.tree, distance_mm).gouge[0](at)

    def _judged(self, tree: StockTree, distance_mm: float) -> JudgedStock:
        """Return what the moves of a tree leave, compared with the solid whose walls are moved by
        a distance."""
        return JudgedStock(tree, replace(self.solid, wall_mm=distance_mm), self.before)

    def _searched(self, rest: list[_Chords], distance_mm: float) -> Trial:
        """Search by squares around the chords that no single layer proves."""
        start = np.concatenate([np.column_stack([c.middle - c.half, c.z[:, 0]]) for c in rest])
        end = np.concatenate([np.column_stack([c.middle + c.half, c.z[:, 1]]) for c in rest])
        tool = np.concatenate([each.tool for each in rest])
        moves = self.stock.moves
        some = StockMoves(
            start,
            end,
            np.zeros_like(tool),
            np.zeros(len(tool), dtype=np.bool_),
            tool,
            moves.cutters,
        )
        wide = self.table[tool, :1]
        low = (np.minimum(start, end)[:, :2] - wide).min(axis=0)
        high = (np.maximum(start, end)[:, :2] + wide).max(axis=0)
        box = self.stock.box_mm
        low, high = np.maximum(low, box[:2]), np.minimum(high, box[2:])
        if (low >= high).any():
            return Trial(True)
        bracket = greatest_value(
            lambda at: self._excess(at, distance_mm),
            self._judged(stock_tree(some), distance_mm).gouge[1],
            (*low.tolist(), *high.tolist()),
            EPS_MM,
            floor=distance_mm,
            max_squares=self.max_squares,
            enough_value=distance_mm,
        )
        return _outcome(bracket, distance_mm)


def _outcome(bracket: Bracket, distance_mm: float) -> Trial:
    """Return the Trial that follows from a search whose `floor` was the distance."""
    if bracket.low > distance_mm:
        return Trial(False, bracket.low, bracket.at_mm)
    return Trial(bracket.high <= distance_mm + 2.0 * EPS_MM)


def _greatest(at: Floats, excess: Floats, box: Box) -> Trial:
    """Return a failed Trial with the greatest excess (P,) among the points (P, 2) within the
    stock."""
    within = ((at >= box[:2]) & (at <= box[2:])).all(axis=1)
    excess = np.where(within, excess, -np.inf)
    row = int(excess.argmax())
    return Trial(False, float(excess[row]), (float(at[row, 0]), float(at[row, 1])))


def _width(deep: Floats, radius: Floats, flat: Floats, corner: Floats, rise: Floats) -> Floats:
    """Return the radius of tools at the stock top when their tips are `deep` below it."""
    cone = flat + deep.clip(min=0.0) / np.where(rise > 0.0, rise, 1.0)
    round_ = flat + np.sqrt(
        np.maximum(corner**2 - np.minimum(np.maximum(corner - deep, 0.0), corner) ** 2, 0.0)
    )
    wide = np.where(rise > 0.0, cone, np.where(corner > 0.0, round_, radius))
    return np.asarray(np.minimum(wide, radius))


def _allows(layer: WantedLayer, chords: _Chords, table: Floats, distance_mm: float) -> Bools:
    """Return the mask (K,) of chords along which a layer allows all that is cut, to within a
    distance."""
    nearest, farthest = layer.along(chords.middle, chords.half)
    s, deep = nearest + distance_mm, STOCK_TOP_MM - chords.z
    radius, flat, corner, rise = (column[:, None] for column in table[chords.tool].T)
    # A cut less than the distance below the top is fine. The width there is a concave function
    # of the depth: below its tangents.
    cut = deep - distance_mm
    deepest = cut.max(axis=1, keepdims=True)
    wide = np.where(corner > 0.0, _width(deepest, radius, flat, corner, rise), radius)
    cone = flat + cut / np.where(rise > 0.0, rise, 1.0)
    bends = np.minimum(flat + corner * (layer.rise / math.hypot(1.0, layer.rise)), wide)
    fine: Bools = np.asarray(deepest[:, 0] <= 0.0)
    reaches: list[Floats] = [np.broadcast_to(wide, deep.shape)]
    places: list[Floats] = [np.zeros((1, 1))]
    if (rise > 0.0).any():
        reaches.append(np.where(rise > 0.0, cone, wide))
    if (reaches[0] > flat).any():  # a cylinder is flat from its axis to its edge
        places += [flat, bends]
    for reach in reaches:
        good = (s - reach >= -EPS_MM) & (farthest + reach <= layer.reach_mm + distance_mm)
        for x in (*places, reach):
            out = np.maximum(x - flat, 0.0)
            nose = corner - np.sqrt(np.maximum(corner**2 - np.minimum(out, corner) ** 2, 0.0))
            allowed = np.minimum(layer.base_mm + layer.rise * (s - x), layer.depth_mm)
            good &= allowed + nose + out * rise >= cut - EPS_MM
        fine |= good.all(axis=1)
    return fine


class Leftovers:
    """The stock after a program, and the layers that must be cut, for proofs that nothing
    is left."""

    def __init__(
        self,
        stock: CutStock,
        solid: WantedSolid,
        before: StockBefore,
        max_squares: int = MAX_SQUARES,
    ) -> None:
        self.stock, self.solid, self.before = stock, solid, before
        self.max_squares = max_squares
        # The distances that are known to be enough for each layer.
        self.enough: list[float] = [math.inf] * len(solid.must)

    def tried(self, distance_mm: float) -> Trial:
        """Try to prove that nothing is left above the solid by more than a distance."""
        unknown = False
        # Vertical walls are soon judged.
        for number in sorted(range(len(self.enough)), key=lambda k: self.solid.must[k].rise):
            layer = self.solid.must[number]
            if distance_mm >= self.enough[number]:
                continue
            trial = self._groove(layer, distance_mm) if layer.cutter else None
            if trial is None:
                trial = self._region(layer, distance_mm, self._box_of(layer))
            if math.isfinite(trial.excess_mm):
                return trial
            if trial.holds:
                self.enough[number] = distance_mm
            unknown |= not trial.holds
        return Trial(not unknown)

    def _excess(self, at: Floats, distance_mm: float, layer: WantedLayer) -> Floats:
        """Return how far (mm) the stock at points (P, 2) is above what a layer asks for, with
        walls moved by a distance."""
        solid = WantedSolid((), (layer,), distance_mm)
        return JudgedStock(self.stock.tree, solid, self.before).leftover[0](at)

    def _box_of(self, layer: WantedLayer) -> Box | None:
        """Return the box in which a layer must be cut, None if that is outside the stock."""
        if not len(layer.lines):
            return None
        wide = max(layer.shift_mm, 0.0)
        boxes, box = layer.curves.boxes, self.stock.box_mm
        low = np.maximum(boxes[:, :2].min(axis=0) - wide, box[:2])
        high = np.minimum(boxes[:, 2:].max(axis=0) + wide, box[2:])
        return None if (low >= high).any() else (*low.tolist(), *high.tolist())

    def _groove(self, layer: WantedLayer, distance_mm: float) -> Trial | None:
        """Try to prove a groove along its line: at each place some move of the groove's own tool
        passes within the distance, deep enough. Places where that fails are searched by squares.
        None if neither proves it."""
        cutter = layer.cutter
        assert cutter is not None
        sagitta = SAGITTA_SHARE * distance_mm
        near = distance_mm - sagitta
        same = [number for number, each in enumerate(self.stock.moves.cutters) if each == cutter]
        moves = self.stock.moves.select(np.isin(self.stock.moves.tool, same))
        probes = (CutterProfile(near, near),) * len(moves.cutters)
        tree = stock_tree(replace(moves, cutters=probes))
        # The greatest depth that the tip must reach, over all distances across the groove.
        kinks = [0.0, cutter.flat_mm, layer.shift_mm]
        if layer.rise:
            kinks.append(layer.shift_mm - (layer.depth_mm - layer.base_mm) / layer.rise)
        x = np.clip(np.array(kinks), 0.0, layer.shift_mm)
        depth = np.minimum(layer.base_mm + layer.rise * (layer.shift_mm - x), layer.depth_mm)
        level = distance_mm - float((depth + cutter.heights(x - EPS_MM)).max())
        begin, end = layer.chords(sagitta)
        rest = [np.empty((0, 2, 2))]
        while len(begin):
            corners = np.stack([begin, end], axis=1)
            high = tree.max_heights_over(corners, np.zeros(corners.shape[:2]), enough=level)
            rows = high > level + EPS_MM
            begin, end = begin[rows], end[rows]
            middle = 0.5 * (begin + end)
            missed = tree.heights(middle)[0] > level + EPS_MM
            if missed.any():
                worst = self._beside(layer, middle[missed][:MAX_DOUBTFUL], distance_mm)
                if worst.excess_mm > distance_mm:
                    return worst
            short = np.hypot(*(end - begin).T) <= SHORT_SHARE * distance_mm
            rest.append(corners[rows][short])
            begin, middle, end = begin[~short], middle[~short], end[~short]
            begin, end = np.concatenate([begin, middle]), np.concatenate([middle, end])
        if sum(map(len, rest)) > MAX_DOUBTFUL:
            return None
        chords = [Polyline(np.insert(each, 2, 0.0, axis=1)) for each in np.concatenate(rest)]
        some = replace(layer, lines=Polylines.of(chords))
        trial = self._region(some, near, self._box_of(some))
        return trial if trial.holds else None

    def _beside(self, layer: WantedLayer, middle: Floats, distance_mm: float) -> Trial:
        """Return the greatest excess found across a groove at places (P, 2) of its line."""
        turn = np.arange(RING_POINTS) * (math.tau / RING_POINTS)
        wide = max(layer.shift_mm - distance_mm, 0.0) * (1.0 - EPS_MM)
        ring = wide * np.column_stack([np.cos(turn), np.sin(turn)])
        at = np.concatenate(
            [middle, *(middle + share * direction for direction in ring for share in (0.5, 1))]
        )
        return _greatest(at, self._excess(at, distance_mm, layer), self.stock.box_mm)

    def _region(self, layer: WantedLayer, distance_mm: float, box: Box | None) -> Trial:
        """Search a layer by squares within a box."""
        if box is None:
            return Trial(True)
        bracket = greatest_value(
            lambda at: self._excess(at, distance_mm, layer),
            lambda squares: self._upper(layer, squares, distance_mm),
            box,
            EPS_MM,
            floor=distance_mm,
            max_squares=self.max_squares,
            enough_value=distance_mm,
        )
        return _outcome(bracket, distance_mm)

    def _upper(self, layer: WantedLayer, squares: Floats, distance_mm: float) -> Floats:
        """Return upper bounds (K,) of the excess over squares (K, 3), mm."""
        bound = np.full(len(squares), -np.inf)
        for row, corners, values in _pieces(layer, squares, distance_mm):
            high = self.stock.tree.max_heights_over(corners, values, enough=distance_mm)
            # Where the linear depth is more than the layer's, the latter counts.
            doubtful = np.flatnonzero((high > distance_mm) & (values.max(axis=1) > layer.depth_mm))
            if len(doubtful):
                full = np.full_like(values[doubtful], layer.depth_mm)
                high_of_layer = self.stock.tree.max_heights_over(
                    corners[doubtful], full, enough=distance_mm
                )
                high[doubtful] = np.minimum(high[doubtful], high_of_layer)
            np.maximum.at(bound, row, high)
        if self.before is WHOLE:
            return bound
        floor = np.maximum(self.before.least_floors(squares), -layer.depth_mm)
        return np.asarray(np.minimum(bound, self.before.greatest_tops(squares) - floor))


def _pieces(
    layer: WantedLayer, squares: Floats, distance_mm: float
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Yield convex pieces that together cover all of squares (K, 3) that must be cut: (index of
    the square (J,), corners (J, 8, 2), depth to be reached at the corners (J, 8), never less than
    required)."""
    half = squares[:, 2]
    reach = DIAGONAL * half
    near = layer.tangents(squares[:, :2], reach)
    s = layer.inwards(squares[:, :2])
    asks = (s + reach >= distance_mm) & (s - reach <= layer.reach_mm - distance_mm)
    nearest, other = near[:, 0, APART], near[:, 1, APART]
    is_in = s - layer.shift_mm > 0.0
    if layer.side == ABOUT:
        flat, crossed = asks, np.zeros_like(asks)
    else:
        flat = asks & (nearest < reach) & (other <= reach)
        crossed = asks & (nearest < reach) & (other > reach)
        more = np.where(is_in, near[:, 0, MORE], near[:, 0, MORE_BEYOND])
        flat |= crossed & ~np.isfinite(more)
        crossed &= np.isfinite(more)
    inner = asks & ~flat & ~crossed & is_in

    def depths(away: Floats) -> Floats:
        """Return a linear upper bound of the depth to be reached where s is at most `away`."""
        return np.asarray(layer.base_mm + layer.rise * (away - distance_mm))

    square = squares[:, 2, None, None] * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    square = np.repeat(square, 2, axis=1)
    rows = np.flatnonzero(flat | (inner & ~np.isfinite(near[:, 0, MORE])))
    top = np.repeat((s + reach)[rows, None], 8, axis=1)
    yield rows, squares[rows, None, :2] + square[rows], depths(top)
    rows = np.flatnonzero(crossed)
    direction = near[rows, 0][:, [SLOPE_X, SLOPE_Y]] * np.where(is_in[rows], 1.0, -1.0)[:, None]
    bound = s[rows] + more[rows] if len(rows) else s[rows]
    part = _clipped(half[rows], direction, distance_mm - bound)
    values = depths(bound[:, None] + (part * direction[:, None]).sum(axis=2))
    yield rows, squares[rows, None, :2] + part, values
    # Off the walls the nearer of two curves counts, each in its part of the square.
    two = inner & (other < nearest + 2.0 * reach) & (layer.rise > 0.0)
    for own, rival in ((0, 1), (1, 0)):
        rows = np.flatnonzero(two if own else inner)
        one, far = near[rows, own], near[rows, rival]
        direction = one[:, [SLOPE_X, SLOPE_Y]]
        bound = layer.shift_mm + one[:, APART] + one[:, MORE]
        both, single = np.flatnonzero(two[rows]), np.flatnonzero(~two[rows])
        part = square[rows]
        part[both] = _clipped(
            half[rows[both]],
            far[both][:, [SLOPE_X, SLOPE_Y]] - direction[both],
            (one[both, APART] + one[both, MORE]) - (far[both, APART] + far[both, MORE]),
        )
        if math.isfinite(layer.reach_mm) and layer.rise:
            # Less what lies beyond the reach of the layer.
            nearest_s = s[rows[single]] - np.minimum(
                one[single, MORE_BEYOND], 2.0 * reach[rows[single]]
            )
            part[single] = _clipped(
                half[rows[single]], -direction[single], nearest_s - (layer.reach_mm - distance_mm)
            )
        values = depths(bound[:, None] + (part * direction[:, None]).sum(axis=2))
        yield rows, squares[rows, None, :2] + part, values


def _clipped(half: Floats, direction: Floats, limit: Floats) -> Floats:
    """Return the corners (K, 8, 2) of squares about 0, with half sides (K,), clipped to the
    half-plane at least `limit` (K,) along `direction` (K, 2). Corners may repeat; where nothing
    remains, all are the corner nearest to the half-plane."""
    corners = half[:, None, None] * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    off = (corners * direction[:, None]).sum(axis=2) - limit[:, None]
    clipped = np.repeat(corners, 2, axis=1)
    best = off.argmax(axis=1)
    every = np.arange(len(half))
    for k in range(4):
        is_outside = off[:, k] < 0.0
        for slot, side in ((0, (k + 3) % 4), (1, (k + 1) % 4)):
            is_inside = off[:, side] >= 0.0
            span = np.where(is_inside, off[:, side] - off[:, k], 1.0)
            share = np.where(is_inside, -off[:, k] / np.where(span > 0.0, span, 1.0), 0.0)
            cross = corners[:, k] + share[:, None] * (corners[:, side] - corners[:, k])
            cross = np.where(is_inside[:, None], cross, corners[every, best])
            clipped[:, 2 * k + slot] = np.where(is_outside[:, None], cross, corners[:, k])
    return clipped
