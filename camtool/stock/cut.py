"""The stock that a program leaves: heights with their margins, sections, and what is cut
differently from another stock.

Two stocks are compared in plane and depth at once. Where one program cuts a wall a micrometre
beside the other, heights differ by the whole depth, in a strip as thin. So the question is
whether the surface of the one lies within a distance of the surface of the other: over a point it
does where, of the other, all tools begun so much farther out cut no higher than that much above
the one. The least distance with which this holds everywhere is the distance of the two stocks; it
is measured in the plane and along Z alike, whichever is more."""

from __future__ import annotations

import math

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.kernels.stock import StockTree
from camtool.planning.job import Job
from camtool.simulation.motion import Options
from camtool.stock.heights import Bracket, greatest_value, integral, stock_tree
from camtool.stock.moves import StockMoves
from camtool.stock.slides import slide_moves, tools_of_rows
from camtool.target.registry import LoadedTarget
from camtool.toolpath.moves import Toolpath

SECTION_POINTS = 512
"""Points of a section before it is refined."""

SECTION_MM = 1e-3
"""Between two points of a section the stock is as near as this to the line between them, ..."""

SECTION_STEP_MM = 1e-3
"""... or the two are no farther apart than this: at a wall."""

TRIAL_SHARE = 0.2
"""Distances of two stocks are determined to within this share of the limit."""

MAX_TRIAL_SQUARES = 4_000_000
"""Largest number of squares in a trial of one distance: walls at just that distance take most. The
bracket is wider if they do not suffice."""

DIFFERENCE_SHARE = 1e-3
"""Volumes of differences are determined to within this share of the volume that is cut."""

Box = tuple[float, float, float, float]
"""Low x, low y, high x and high y, mm."""


class CutStock(Struct, frozen=True, eq=False):
    """The stock after a program: the moves that cut it, their index, the box of the stock in the
    plane, mm, and the height of its bottom, mm (None: not known)."""

    moves: StockMoves
    tree: StockTree
    box_mm: Box
    bottom_mm: float | None = None

    def heights(self, points: Floats) -> Floats:
        """Return the heights (J,), mm, of the stock over points (J, 2)."""
        z, _ = self.tree.heights(points)
        return z

    def bounds(self, points: Floats) -> Floats:
        """Return the lowest and the highest possible height (J, 2), mm, over points (J, 2): the
        slides may be `moves.beside_mm` beside the moves."""
        beside_mm = self.moves.beside_mm
        low, _ = self.tree.heights(points, None, beside_mm)
        high, _ = self.tree.heights(points, None, -beside_mm)
        return np.column_stack([low - beside_mm, np.minimum(high + beside_mm, self.tree.top)])

    def rows_at(self, points: Floats) -> Ints:
        """Return the row (J,) of the decoded toolpath that cuts deepest over points (J, 2); −1
        where nothing is cut."""
        _, move_index = self.tree.heights(points)
        return np.where(move_index >= 0, self.moves.row[move_index.clip(min=0)], -1)

    def section(self, axis: str, at_mm: float) -> Floats:
        """Return the profile (P, 2) of the stock in the section where `axis` ("x" or "y") is
        `at_mm`: position along the other axis and height, mm. Between two rows the stock is within
        `SECTION_MM` of the line from one to the other, as far as its middle shows, or the two rows
        stand at a wall."""
        low, high = (self.box_mm[1::2]) if axis == "x" else (self.box_mm[0::2])
        place = np.linspace(low, high, SECTION_POINTS)
        z = self.heights(_across(axis, at_mm, place))
        while True:
            middle = 0.5 * (place[:-1] + place[1:])
            level = self.heights(_across(axis, at_mm, middle))
            bent = np.abs(level - 0.5 * (z[:-1] + z[1:])) > SECTION_MM
            bent &= np.diff(place) > SECTION_STEP_MM
            if not bent.any():
                return np.column_stack([place, z])
            place = np.insert(place, np.flatnonzero(bent) + 1, middle[bent])
            z = np.insert(z, np.flatnonzero(bent) + 1, level[bent])

    @property
    def lowest(self) -> Bracket:
        """Proved bracket of the greatest depth below the top, mm."""
        top = self.tree.top
        return greatest_value(
            lambda at: top - self.tree.heights(at)[0],
            lambda squares: top - self.tree.min_heights(squares),
            self.box_mm,
        )

    def removed_mm3(self, share: float = 0.01) -> Bracket:
        """Return lower and upper bounds of the volume that is cut out of the stock, within its box
        and above its bottom, mm³."""
        top, bottom = self.tree.top, -math.inf if self.bottom_mm is None else self.bottom_mm

        def quarter_means(squares: Floats) -> tuple[Floats, Floats]:
            low, high = self.tree.quarter_means(squares, bottom)
            return top - high, top - low

        def extremes(squares: Floats) -> tuple[Floats, Floats]:
            low, high = self.tree.min_heights(squares), self.tree.max_heights(squares)
            return top - np.maximum(high, bottom), top - np.maximum(low, bottom)

        return integral(quarter_means, extremes, self.box_mm, share)


def _across(axis: str, at_mm: float, place: Floats) -> Floats:
    """Return the points (J, 2) of a section at these places along the other axis."""
    level = np.full(len(place), at_mm)
    return np.column_stack([level, place] if axis == "x" else [place, level])


def cut_stock(
    decoded: Toolpath,
    target: LoadedTarget,
    job: Job | None,
    options: Options | None = None,
    thin_mm: float | None = None,
) -> CutStock:
    """Simulate a program and return the stock after it. `thin_mm`: how far its thinned moves may
    be from the slides (None: a step). OptionError if the tools are not known; raises also what
    `LoadedTarget.simulate` raises."""
    tools = tools_of_rows(decoded, job)
    moves = slide_moves(decoded, target, tools, options, thin_mm=thin_mm)
    stock = None if job is None else job.stock
    box = None if stock is None else stock.box_mm
    bottom = None if stock is None else -stock.thickness_mm
    return CutStock(moves, stock_tree(moves), box or cut_box(moves), bottom)


def cut_box(moves: StockMoves) -> Box:
    """Return the bounding box of all that the tools cut, with cones as wide as at their depth; the
    box of all moves if nothing is cut."""
    cuts = np.minimum(moves.start[:, 2], moves.end[:, 2]) < 0.0
    chosen_moves = moves.select(cuts) if cuts.any() else moves
    if not len(chosen_moves):
        return 0.0, 0.0, 1.0, 1.0
    radius, flat, _, rise = chosen_moves.table[chosen_moves.tool].T
    depths = -np.minimum(chosen_moves.start[:, 2], chosen_moves.end[:, 2]).clip(max=0.0)
    cone = flat + depths / np.where(rise > 0.0, rise, 1.0)
    wide = np.where(rise > 0.0, np.minimum(radius, cone), radius)[:, None]
    low = (np.minimum(chosen_moves.start, chosen_moves.end)[:, :2] - wide).min(axis=0)
    high = (np.maximum(chosen_moves.start, chosen_moves.end)[:, :2] + wide).max(axis=0)
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


class StockDifference(Struct, frozen=True):
    """The difference of two stocks.

    `deeper`: the greatest distance, mm, by which the second cuts where the first does not, with
    its place; `shallower`: the reverse. `more_mm3`, `less_mm3`: the volumes of both."""

    deeper: Bracket
    shallower: Bracket
    more_mm3: Bracket
    less_mm3: Bracket

    @property
    def distance_mm(self) -> float:
        """The distance of the two stocks, mm: its upper bound."""
        return max(self.deeper.high, self.shallower.high)


def difference_of(first: CutStock, second: CutStock, limit_mm: float) -> StockDifference:
    """Compare two stocks. A distance of at most `limit_mm` is reported only as an upper bound; a
    greater one is determined to within `TRIAL_SHARE` of the limit."""
    box = box_around(first.box_mm, second.box_mm)
    slack_mm3 = DIFFERENCE_SHARE * max(first.removed_mm3().high, second.removed_mm3().high)
    # Moves that both have make no difference: only moves that the other lacks are compared.
    added_cuts, less = _own_moves(second.moves, first.moves), _own_moves(first.moves, second.moves)
    return StockDifference(
        _distance(first.tree, added_cuts, box, limit_mm),
        _distance(second.tree, less, box, limit_mm),
        _volume_between(first.tree, added_cuts, box, slack_mm3),
        _volume_between(second.tree, less, box, slack_mm3),
    )


def _own_moves(moves: StockMoves, other: StockMoves) -> StockTree:
    """Return the index of the moves that have no bit-identical counterpart among the `other`
    moves."""

    def rows(each: StockMoves) -> Floats:
        return np.hstack([each.start, each.end, each.table[each.tool]])

    other_rows = set(map(bytes, rows(other)))
    is_own = np.array([bytes(row) not in other_rows for row in rows(moves)], dtype=np.bool_)
    return stock_tree(moves.select(is_own))


def box_around(one: Box, other: Box) -> Box:
    """Return the box that encloses both boxes."""
    low, high = np.minimum(one, other)[:2].tolist(), np.maximum(one, other)[2:].tolist()
    return low[0], low[1], high[0], high[1]


def _distance(one: StockTree, other: StockTree, box: Box, limit_mm: float) -> Bracket:
    """Bracket the greatest distance by which what `other` cuts lies inside the stock that `one`
    leaves."""
    tolerance_mm = TRIAL_SHARE * limit_mm

    def bracket_beyond(distance: float, enough_value: float = math.inf) -> Bracket:
        return greatest_value(
            lambda at: one.heights(at, None, distance)[0] - distance - other.heights(at)[0],
            lambda squares: (
                one.max_heights(squares, None, distance) - distance - other.min_heights(squares)
            ),
            box,
            0.5 * tolerance_mm,
            floor=0.0,
            max_squares=MAX_TRIAL_SQUARES,
            enough_value=enough_value,
        )

    bracket = bracket_beyond(limit_mm - tolerance_mm)
    if bracket.low <= 0.0:
        high = limit_mm - tolerance_mm + bracket.high
        return Bracket(0.0, high, bracket.at_mm, bracket.squares)
    # A distance is at most the difference in depth; where it is less, a wall has moved.
    low, place, squares = limit_mm - tolerance_mm, bracket.at_mm, bracket.squares
    high = low + bracket.high
    while high - low > tolerance_mm:
        middle = 2.0 * low if high > 4.0 * low else 0.5 * (low + high)
        bracket = bracket_beyond(middle, 0.0)
        squares += bracket.squares
        if bracket.low > 0.0:
            low, place = middle, bracket.at_mm
        elif middle + bracket.high < high:
            high = middle + bracket.high
        else:
            break
    return Bracket(low, high, place, squares)


def _volume_between(one: StockTree, other: StockTree, box: Box, slack_mm3: float) -> Bracket:
    """Bracket the volume that `other` cuts below the surface that `one` leaves, mm³, to 1 % or to
    `slack_mm3`."""

    def extremes(squares: Floats) -> tuple[Floats, Floats]:
        lower = np.maximum(one.min_heights(squares) - other.max_heights(squares), 0.0)
        return lower, np.maximum(one.max_heights(squares) - other.min_heights(squares), 0.0)

    return integral(None, extremes, box, slack=slack_mm3)
