"""Rapids through the stock as it stands before them, in the order of the moves.

A rapid is wrong where the tool's own shape goes below the stock that all feeds before it have
left. Rapids clear nothing, so a rapid through material is found each time. One that goes straight
up is never wrong.

    tool of the rapid, drawn in by the room  <  stock of all tools begun the room farther out

so that a way that is cleared exactly is accepted, and a rapid that gets farther than the tolerance
into a wall never is. Squares round each rapid are divided until the stock is proved to lie below
the rapid over all of a square, or a point is found where it does not."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding
from camtool.kernels.stock import heights_of_moves
from camtool.planning.job import Stock
from camtool.records import replace
from camtool.simulation.rows import block_of
from camtool.stock.before import WHOLE, StockBefore
from camtool.stock.cutters import CutterProfile
from camtool.stock.findings import FINDINGS_LISTED, RAPID_IN_STOCK, place_words
from camtool.stock.heights import divided, greatest_value, move_columns, stock_tree
from camtool.stock.moves import StockMoves
from camtool.toolpath.moves import STOCK_TOP_MM, Kind, Toolpath, are_below_top

CLEARED_MM = 0.01
"""Depth to which a rapid's tool may enter walls: the rapid and the cuts beside it are rounded
separately."""

ROOM_SHARE = 0.45
"""Share of that tolerance by which the tool of a rapid is narrowed, and the tools of the cuts are
widened."""

MIN_HALF_SHARE = 0.035
"""Half side of the smallest squares, as a share of that tolerance: twice the room and the size of
the least shape with a square's middle in it, 2 √2 of these, make up the tolerance."""

MIN_RADIUS_SHARE = 2.0
"""Least radius of a tool, over that tolerance: a point clears its line, and so needs a width."""

HEIGHT_EPS_MM = 1e-6

RAPIDS_AT_ONCE = 64

SIZE_SQUARES = 4096
"""Approximate number of squares for the search of a rapid's deepest place in the stock."""


class RapidThroughStock(Struct, frozen=True):
    """A rapid that touches the stock: its row, the place of the contact, and the height of the
    lowest point there that the tool touches, mm."""

    row: int
    z_mm: float
    at_mm: tuple[float, float]


def rapids_through_stock(
    moves: StockMoves,
    box_mm: tuple[float, float, float, float] | None = None,
    tolerance_mm: float = CLEARED_MM,
    before: StockBefore | None = None,
) -> list[RapidThroughStock]:
    """Return the rapids that touch the stock as the feeds before them, and other set-ups
    (`before`), have left it, in order. `box_mm`: the sides of the stock (low x, low y, high x,
    high y), None: unlimited."""
    start, end = moves.start, moves.end
    low = np.minimum(start[:, 2], end[:, 2]) < STOCK_TOP_MM - HEIGHT_EPS_MM
    is_up = (start[:, :2] == end[:, :2]).all(axis=1) & (end[:, 2] >= start[:, 2])
    if not (moves.rapid & low & ~is_up).any():
        return []
    rows = np.flatnonzero(moves.rapid & low & ~is_up)
    search = _Search(moves, rows, box_mm, tolerance_mm, before)
    doubtful = np.flatnonzero(~search.follow_a_feed())
    touching_rapids: list[RapidThroughStock] = []
    for first in range(0, len(doubtful), RAPIDS_AT_ONCE):
        touching_rapids += search.touching(doubtful[first : first + RAPIDS_AT_ONCE])
    return touching_rapids


def rapid_findings(
    decoded: Toolpath,
    moves: StockMoves | None,
    stock: Stock | None,
    tolerance_mm: float,
    before: StockBefore | None = None,
) -> Iterator[Finding]:
    """Yield RAPID_IN_STOCK for rapids that enter uncut stock by more than the tolerance. If the
    shapes of the tools are not known (`moves` None), yield it for each rapid below the stock top
    that may do so."""
    if moves is None:
        rapids = low_rapids(decoded)
    else:
        box_mm = None if stock is None else stock.box_mm
        rapids = rapids_through_stock(moves, box_mm, max(CLEARED_MM, tolerance_mm), before)
    for number, one in enumerate(rapids[:FINDINGS_LISTED], start=1):
        yield RAPID_IN_STOCK(
            where=f"{block_of(decoded, one.row)} {place_words(one.at_mm)}",
            measured=one.z_mm,
            limit=STOCK_TOP_MM,
            depth=STOCK_TOP_MM - one.z_mm,
            more=max(len(rapids) - FINDINGS_LISTED, 0) if number == FINDINGS_LISTED else 0,
        )


def low_rapids(toolpath: Toolpath) -> list[RapidThroughStock]:
    """Return the rapids below the stock top that move in XY, or go straight down deeper than any
    feed at the same XY before. If the tools are not known, nothing more can be said."""
    start, end = toolpath.starts, toolpath.end
    is_across = np.asarray((start[:, :2] != end[:, :2]).any(axis=1))
    is_low = (toolpath.kind == Kind.RAPID) & are_below_top(toolpath)
    is_low &= is_across | (end[:, 2] < start[:, 2])
    if is_low.any():
        is_low &= is_across | (_fed_depths(toolpath, is_across) > end[:, 2] + HEIGHT_EPS_MM)
    rapids = []
    for row in np.flatnonzero(is_low).tolist():
        x, y, z = end[row].tolist()
        rapids.append(RapidThroughStock(row, min(float(start[row, 2]), z), (x, y)))
    return rapids


def _fed_depths(toolpath: Toolpath, is_across: Bools) -> Floats:
    """Return (N,) the lowest Z of feeds before each row since the last move in XY."""
    fed_depths, deepest = np.empty(len(toolpath)), math.inf
    feeds = np.where(toolpath.is_feed, toolpath.end[:, 2], math.inf)
    moves = (is_across | toolpath.is_arc).tolist()
    for row, (has_moved, z) in enumerate(zip(moves, feeds.tolist(), strict=True)):
        fed_depths[row] = deepest
        deepest = z if has_moved else min(deepest, z)
    return fed_depths


class _Search:
    """The search among the R rapids of a program that may touch the stock; only their parts below
    its top count."""

    def __init__(
        self,
        moves: StockMoves,
        chosen: Ints,
        box_mm: tuple[float, float, float, float] | None,
        tolerance_mm: float,
        before: StockBefore | None,
    ) -> None:
        self.others = before or WHOLE
        self.room_mm = ROOM_SHARE * tolerance_mm
        self.least_mm = MIN_HALF_SHARE * tolerance_mm
        self.low, self.high = np.array(box_mm or (-np.inf, -np.inf, np.inf, np.inf)).reshape(2, 2)
        moves = replace(
            moves, cutters=tuple(_widened(each, tolerance_mm) for each in moves.cutters)
        )
        self.feeds = moves.select(~moves.rapid)
        self.tree = stock_tree(self.feeds)
        self.before = np.cumsum(~moves.rapid, dtype=np.int64)[chosen]
        # Parts above the stock top touch nothing.
        self.rapids = moves.select(chosen).below(STOCK_TOP_MM)
        self.columns = move_columns(self.rapids)
        self.tools: Floats = moves.table[self.rapids.tool]

    def follow_a_feed(self) -> Bools:
        """Return the mask (R,) of rapids that run along the line of a single earlier feed, or
        above it, with a tool of the same shape: these cannot touch the stock."""
        feeds, rapids = self.feeds, self.rapids
        fine = np.zeros(len(rapids), dtype=np.bool_)
        if not len(feeds):
            return fine
        for middle in (0.5 * (rapids.start + rapids.end), rapids.start, rapids.end):
            _, feed = self.tree.heights(middle[:, :2], self.before)
            one, feed_steps = feeds.start[feed], feeds.end[feed] - feeds.start[feed]
            square = (feed_steps[:, :2] ** 2).sum(axis=1)
            is_fine = (feed >= 0) & (feeds.tool[feed] == rapids.tool)
            for point in (rapids.start, rapids.end):
                share = ((point - one)[:, :2] * feed_steps[:, :2]).sum(axis=1)
                share = np.clip(share / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
                share = np.where(square > 0.0, share, feed_steps[:, 2] < 0.0)
                offsets = point - (one + share[:, None] * feed_steps)
                is_fine &= np.hypot(offsets[:, 0], offsets[:, 1]) <= self.room_mm
                is_fine &= offsets[:, 2] >= -HEIGHT_EPS_MM
            fine |= is_fine
        return fine

    def touching(self, chosen: Ints) -> list[RapidThroughStock]:
        """Return those of the `chosen` rapids that touch the stock."""
        rapid_of, squares = self._first_squares(chosen)
        touches = np.zeros(len(self.rapids), dtype=np.bool_)
        while len(rapid_of):
            touches[rapid_of[self._taken(rapid_of, squares) > HEIGHT_EPS_MM]] = True
            open_ = ~touches[rapid_of] & (squares[:, 2] > self.least_mm)
            rapid_of, squares = rapid_of[open_], squares[open_]
            open_ = self._most_taken(rapid_of, squares) > HEIGHT_EPS_MM
            rapid_of, squares = np.repeat(rapid_of[open_], 4), divided(squares[open_])
        return [self._deepest(rapid) for rapid in chosen[touches[chosen]].tolist()]

    def _deepest(self, rapid: int) -> RapidThroughStock:
        """Return the deepest contact of a rapid that touches the stock, as far as `SIZE_SQUARES`
        squares show it."""
        _, squares = self._first_squares(np.array([rapid]))

        def taken_at(points: Floats) -> Floats:
            return self._taken(np.full(len(points), rapid), points)

        def max_taken(squares: Floats) -> Floats:
            return self._most_taken(np.full(len(squares), rapid), squares)

        wide = squares[:, 2:]
        low, high = (squares[:, :2] - wide).min(axis=0), (squares[:, :2] + wide).max(axis=0)
        low, high = np.maximum(low, self.low), np.minimum(high, self.high)
        best = greatest_value(
            taken_at, max_taken, (*low.tolist(), *high.tolist()), max_squares=SIZE_SQUARES
        )
        place = best.at_mm
        z = heights_of_moves(
            self.columns[[rapid]], self.tools[[rapid]], np.array([place]), np.zeros(1)
        )
        return RapidThroughStock(int(self.rapids.row[rapid]), float(z[0]), place)

    def _first_squares(self, chosen: Ints) -> tuple[Ints, Floats]:
        """Return squares (K, 3) that cover what the tools of rapids sweep below the stock top, and
        the rapid (K,) of each square."""
        begin, end = self.rapids.start[chosen], self.rapids.end[chosen]
        radius, flat, _, rise = self.tools[chosen].T
        depths = STOCK_TOP_MM - np.minimum(begin[:, 2], end[:, 2])
        cone = flat + depths / np.where(rise > 0.0, rise, 1.0)
        wide = np.where(rise > 0.0, np.minimum(radius, cone), radius)
        length = np.hypot(*(end - begin)[:, :2].T)
        count = np.ceil(0.5 * length / wide).astype(np.int64).clip(min=1)
        owners = np.repeat(np.arange(len(chosen)), count)
        step = np.arange(len(owners)) - np.repeat(np.cumsum(count) - count, count)
        share = (step + 0.5) / count[owners]
        middle = begin[owners, :2] + share[:, None] * (end - begin)[owners, :2]
        half = (wide + 0.5 * length / count)[owners]
        return chosen[owners], np.column_stack([middle, half])

    def _taken(self, rapids: Ints, points_at: Floats) -> Floats:
        """Return how far (mm) each rapid (K,) goes below the stock over its point, which is in the
        first two columns of (K, …)."""
        points = np.ascontiguousarray(points_at[:, :2])
        stock, _ = self.tree.heights(points, self.before[rapids], self.room_mm)
        own_heights = heights_of_moves(
            self.columns[rapids], self.tools[rapids], points, np.full(len(rapids), -self.room_mm)
        )
        is_inside = ((points >= self.low) & (points <= self.high)).all(axis=1)
        stock = np.minimum(stock, self.others.tops(points, self.room_mm))
        own_heights = np.maximum(own_heights, self.others.floors(points, self.room_mm))
        return np.where(is_inside, stock - own_heights, -np.inf)

    def _most_taken(self, rapids: Ints, squares: Floats) -> Floats:
        """Return upper bounds (K,) of how far each rapid (K,) goes below the stock over its square
        (K, 3), mm."""
        half = squares[:, 2:]
        reach = math.sqrt(2.0) * squares[:, 2]
        own_heights = heights_of_moves(
            self.columns[rapids], self.tools[rapids], squares[:, :2], reach - self.room_mm
        )
        is_inside = (squares[:, :2] + half > self.low) & (squares[:, :2] - half < self.high)
        max_taken = np.full(len(rapids), -np.inf)
        near_squares = np.flatnonzero(is_inside.all(axis=1) & np.isfinite(own_heights))
        stock = self.tree.max_heights(
            squares[near_squares], None, self.room_mm, self.before[rapids[near_squares]]
        )
        stock = np.minimum(stock, self.others.greatest_tops(squares[near_squares], self.room_mm))
        floor = self.others.least_floors(squares[near_squares], self.room_mm)
        max_taken[near_squares] = stock - np.maximum(own_heights[near_squares], floor)
        return max_taken


def _widened(cutter: CutterProfile, tolerance_mm: float) -> CutterProfile:
    """Return the cutter unchanged, or a thin cylinder in place of one without width."""
    radius = MIN_RADIUS_SHARE * tolerance_mm
    return CutterProfile(radius, radius) if cutter.radius_mm < radius else cutter
