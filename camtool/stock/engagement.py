"""The engagement of tools along the moves of the slides, held against what an operation promises.

An adaptive pocket promises that its tool is never engaged by more than an angle. Whether that
holds is judged on the predicted slides, move by move, in the order of cutting
(`camtool.kernels.engagement`): each move against all that earlier ones have cleared at its depth.
Where the tool goes down through the stock it is engaged all round; that is its entry, up to a
length of its circumference beyond it, and does not count.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding
from camtool.kernels.engagement import Cleared
from camtool.planning.job import Operation
from camtool.planning.naming import operation_name
from camtool.stock.findings import ENGAGEMENT_KEPT, ENGAGEMENT_TOO_HIGH, place_words
from camtool.stock.moves import StockMoves
from camtool.toolpath.moves import STOCK_TOP_MM, Toolpath

THICK_SHARE = 4e-3
"""Chips thinner than this part of the tool's radius are no engagement, ..."""

THICK_BESIDE = 2.0
"""... nor those thinner than so many times the distance of the slides from these moves."""

LEVEL_MM = 0.02
"""Cuts no more than this above a move have cleared its depth."""

ENTRY_TURNS = 1.0
"""An entry ends when the tool has gone so many times its circumference from where it went down."""

TOLERATED_SHARE = 1.02
"""Engagements up to this part of the limit keep it."""

MAX_ASKEW_RAD = 0.3
"""Slides that run beside their path by steps head no farther than this to either side of it."""

FINE_RAD = np.radians(0.1)
"""Bounds of engagements above the limit are told to this angle."""


class Engagement(Struct, frozen=True, eq=False):
    """A bound of the engagement (M,) rad of each of M moves; NaN for entries and for moves that
    do not cut."""

    bound_rad: Floats
    moves: StockMoves

    def greatest(self, chosen: Bools | Ints) -> tuple[float, Floats]:
        """Return the greatest bound of some moves, rad, and the place (2,) where that one begins;
        0 where none of them cuts."""
        bound = np.nan_to_num(self.bound_rad[chosen])
        if not len(bound):
            return 0.0, np.zeros(2)
        worst = int(bound.argmax())
        return float(bound[worst]), self.moves.start[chosen][worst, :2]


def _askew(moves: StockMoves, decoded: Toolpath) -> Floats:
    """Return the angles (M, 2) rad from each move of the slides to the direction in which its
    decoded move runs at both ends of it, left positive: a move may stand for an arc, and slides go
    beside their path by steps, so that a short move says little of where the tool heads."""
    own = (moves.end - moves.start)[:, :2]
    line = (decoded.end - decoded.starts_of(np.arange(len(decoded))))[moves.row, :2]
    arcs = np.flatnonzero(decoded.is_arc[moves.row])
    turn = np.sign(decoded.sweeps_of(moves.row[arcs]))[:, None]
    angles = np.empty((len(moves), 2))
    for column, place in enumerate((moves.start, moves.end)):
        heading = line.copy()
        spoke = place[arcs, :2] - decoded.centre[moves.row[arcs]]
        heading[arcs] = turn * np.column_stack([-spoke[:, 1], spoke[:, 0]])
        across = own[:, 0] * heading[:, 1] - own[:, 1] * heading[:, 0]
        angles[:, column] = np.arctan2(across, (own * heading).sum(axis=1))
    # At joints of moves, and where the mechanics lag behind, the slides' own direction counts.
    is_near = np.asarray((np.abs(angles) <= MAX_ASKEW_RAD).all(axis=1))
    return np.where(is_near[:, None], angles, 0.0)


def engagement_of(
    moves: StockMoves,
    decoded: Toolpath,
    enough_rad: Floats,
    box_mm: tuple[float, float, float, float] | None,
) -> Engagement:
    """Bound the engagement of all moves that a decoded program makes; `enough_rad` (M,): up to
    there a bound is not refined; `box_mm`: the stock in the plane, None: it goes on for ever."""
    radius = moves.table[moves.tool, 0]
    low = np.minimum(moves.start[:, 2], moves.end[:, 2])
    high = np.maximum(moves.start[:, 2], moves.end[:, 2]) - LEVEL_MM
    rows = np.column_stack(
        [moves.start[:, :2], moves.end[:, :2], radius, low, high, _askew(moves, decoded)]
    )
    cuts = (low < STOCK_TOP_MM - LEVEL_MM) & (radius > 0.0)
    result = np.full(len(moves), np.nan)
    if not cuts.any():
        return Engagement(result, moves)
    ends = np.concatenate([moves.start[cuts, :2], moves.end[cuts, :2]])
    reach = float(radius[cuts].max())
    thick = max(THICK_SHARE * float(radius[cuts].min()), THICK_BESIDE * moves.beside_mm)
    extents = np.stack([ends.min(axis=0), ends.max(axis=0)])
    cleared = Cleared(extents, reach, np.array(box_mm or (-np.inf, -np.inf, np.inf, np.inf)))
    every = np.flatnonzero(cuts)
    new = np.flatnonzero(np.diff(enough_rad[every])) + 1
    for part in np.split(every, new):
        is_cut = np.ones(len(part), dtype=np.bool_)
        result[part] = cleared.judge(rows[part], is_cut, thick, enough_rad[part[0]], FINE_RAD)
    result[_entries(moves, result, radius)] = np.nan
    return Engagement(result, moves)


def _entries(moves: StockMoves, bound: Floats, radius: Floats) -> Bools:
    """Mask (M,) of the moves that go down through the stock, and of those behind them up to the
    length of an entry."""
    length = np.hypot(*(moves.end - moves.start)[:, :2].T)
    down = (moves.end[:, 2] < moves.start[:, 2] - LEVEL_MM * length) & (np.nan_to_num(bound) > 0.0)
    travelled = np.concatenate([[0.0], np.cumsum(length)])
    last = np.maximum.accumulate(np.where(down, travelled[1:], -np.inf))
    return np.asarray(travelled[:-1] - last <= ENTRY_TURNS * 2.0 * np.pi * radius)


def engagement_findings(
    slides: StockMoves,
    decoded: Toolpath,
    begin: Ints,
    operations: tuple[Operation, ...],
    box_mm: tuple[float, float, float, float] | None,
) -> Iterator[Finding]:
    """Yield ENGAGEMENT_TOO_HIGH for each operation that promises a limit and does not keep it, and
    ENGAGEMENT_KEPT for each that does; `begin` (K,): the first row of each operation."""
    number = (np.searchsorted(begin, slides.row, side="right") - 1).clip(min=0)
    limits = np.array([operation.engagement_rad or np.pi for operation in operations])
    engagement = engagement_of(slides, decoded, TOLERATED_SHARE * limits[number], box_mm)
    for index, operation in enumerate(operations):
        if operation.engagement_rad is None:
            continue
        greatest, place = engagement.greatest(np.flatnonzero(number == index))
        sentence = (
            ENGAGEMENT_KEPT if greatest <= TOLERATED_SHARE * limits[index] else ENGAGEMENT_TOO_HIGH
        )
        yield sentence(
            where=place_words(place.tolist()),
            measured=float(np.degrees(greatest)),
            limit=float(np.degrees(limits[index])),
            operation=operation_name(operation),
        )
