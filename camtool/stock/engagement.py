"""The engagement of tools along the moves of the slides, held against limits.

An adaptive pocket promises that its tool is never engaged by more than an angle, and a user may
limit that of every operation. Whether a limit holds is judged on the predicted slides, move by
move, in the order of cutting (`camtool.kernels.engagement`): each move against all that earlier
ones have cleared at its depth. Where the tool goes down through the stock it is engaged all round;
that is its entry, up to a length of its circumference beyond it, and does not count.

Only tools that are as wide at their tip as above are judged. Others (V bits, ball and bull noses,
drills) clear nothing here, so that the bounds of the tools behind them hold all the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.findings import Finding
from camtool.kernels.engagement import Cleared
from camtool.planning.strokes import thick_share
from camtool.stock.findings import (
    ENGAGEMENT_KEPT,
    ENGAGEMENT_TOO_HIGH,
    STOCK_NOT_JUDGED_ENGAGEMENT,
    place_words,
)
from camtool.stock.moves import StockMoves
from camtool.toolpath.moves import STOCK_TOP_MM, Toolpath

THICK_BESIDE = 2.0
"""Chips thinner than this many times the distance of the slides from the moves do not count
either (`thick_share`): they cannot be told from the steps of the axes."""

LEVEL_MM = 0.02
"""Cuts up to this much above a move count as having cleared its depth."""

TOUCH_MM = 1e-3
"""Moves that go no deeper than this cut nothing."""

STEEP_SHARE = 1e-3
"""Moves whose way in the plane is no more than this part of their height run straight up or
down."""

ENTRY_TURNS = 1.0
"""An entry ends when the tool has travelled this many times its circumference from where it went
down."""

ENDED_MM = 1e-9
"""An entry with a shorter remaining length than this has ended."""

TOLERATED_SHARE = 1.02
"""Engagements up to this part of the limit keep it."""

MAX_ASKEW_RAD = 0.3
"""Slides that run beside their path in steps deviate from its direction, or that of the chord of
its arc, by no more than this."""

FINE_RAD = np.radians(0.1)
"""Bounds of engagements above the limit are determined to within this angle, ..."""

COARSE_RAD = np.radians(1.0)
"""... and the greatest engagement of an operation that keeps the limit to within this one, as are
those of moves in pictures."""


CHANGING_WIDTH = "it cuts with a tool whose width changes with its height"
NO_WIDTH = "it cuts with a tool of no width"


class Engagement(Struct, frozen=True, eq=False):
    """An upper bound of the engagement (M,), rad, of each of M moves: 0 for moves that cut
    nothing, NaN for moves above the stock. `is_entry` (M,): moves of entries, which do not count;
    `is_known` (M,): False for moves in the stock of a tool whose width changes with its height."""

    bound_rad: Floats
    is_entry: Bools
    is_known: Bools
    moves: StockMoves

    def max_heights(self, chosen: Bools) -> tuple[float, int | None]:
        """Return the greatest bound among the `chosen` moves outside of entries, rad, and the
        index of the move; 0 and None if none of them cuts."""
        bound = np.where(chosen & ~self.is_entry, np.nan_to_num(self.bound_rad), 0.0)
        if not bound.any():
            return 0.0, None
        worst = int(bound.argmax())
        return float(bound[worst]), worst


class OperationEngagement(Struct, frozen=True):
    """The greatest engagement of an operation outside of entries, rad (None: it was not judged,
    for the `reason`), with its place (x, y), mm, and the row of the program; and the limit that
    the operation itself sets (None: no limit). `name` is "" if the operations of a program are not
    known."""

    name: str
    greatest_rad: float | None
    at_mm: tuple[float, float] | None = None
    row: int | None = None
    limit_rad: float | None = None
    reason: str = ""

    @property
    def words(self) -> str:
        """The operation in a sentence."""
        return f"operation {self.name!r}" if self.name else "the program"


def _askew(moves: StockMoves, decoded: Toolpath) -> Floats:
    """Return the angles (M, 2), rad, left positive, from the direction of each move of the slides
    to the direction of its decoded move at its start and end. A move may stand for an arc, and
    slides run beside their path in steps, so the direction of a short move is a poor guide to
    where the tool is heading."""
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
    length = np.hypot(*own.T)
    unsure = np.arcsin(2.0 * moves.beside_mm / np.maximum(length, 2.0 * moves.beside_mm + 1e-9))
    is_chord = np.abs(angles.mean(axis=1)) <= np.maximum(unsure, MAX_ASKEW_RAD)
    is_ahead = (np.abs(angles) < 0.5 * np.pi).all(axis=1)
    return np.where((is_chord & is_ahead)[:, None], angles, 0.0)


def engagement_of(
    moves: StockMoves,
    decoded: Toolpath,
    box_mm: tuple[float, float, float, float] | None,
    limits: tuple[Ints, Floats] | None = None,
    coarse_rad: float = COARSE_RAD,
) -> Engagement:
    """Bound the engagement of all moves that a decoded program makes, each to within `coarse_rad`.
    `box_mm`: the sides of the stock, None: unlimited.

    `limits`: the operation of each move (M,), ascending, and the limit of each operation (K,),
    rad. Then only the greatest bound of each operation is that tight (within FINE_RAD if it is
    above the limit); all others are merely bounds."""
    moves, index = _parted(moves)
    number, limit = (np.zeros(len(moves), np.int64), np.zeros(1))
    if limits is not None:
        number, limit = limits[0][index], limits[1]
    radius = moves.table[moves.tool, 0]
    is_straight = moves.table[moves.tool, 1] == radius
    length = np.hypot(*(moves.end - moves.start)[:, :2].T)
    low = np.minimum(moves.start[:, 2], moves.end[:, 2])
    high = np.maximum(moves.start[:, 2], moves.end[:, 2]) - LEVEL_MM
    rows = np.column_stack(
        [moves.start[:, :2], moves.end[:, :2], radius, low, high, _askew(moves, decoded)]
    )
    is_low = low < STOCK_TOP_MM - TOUCH_MM
    is_upright = length <= STEEP_SHARE * np.abs(moves.end[:, 2] - moves.start[:, 2])
    down = moves.end[:, 2] < moves.start[:, 2] - LEVEL_MM * length
    # A tool that goes straight up cuts nothing new.
    cuts = is_low & is_straight & (radius > 0.0) & (down | ~is_upright)
    is_known = ~is_low | (is_straight & (radius > 0.0)) | is_upright
    result = np.full(len(moves), np.nan)
    if not cuts.any():
        return Engagement(result, np.zeros(len(moves), dtype=np.bool_), is_known, moves)
    ends = np.concatenate([moves.start[cuts, :2], moves.end[cuts, :2]])
    reach = float(radius[cuts].max())
    narrow_mm = float(radius[cuts].min())
    extents = np.stack([ends.min(axis=0), ends.max(axis=0)])
    cleared = Cleared(extents, reach, np.array(box_mm or (-np.inf, -np.inf, np.inf, np.inf)))
    may_enter = _behind(down, length, radius)
    every = np.flatnonzero(cuts)
    greatest = np.zeros(len(limit))
    new = np.flatnonzero(np.diff(2 * number[every] + may_enter[every])) + 1
    for part in np.split(every, new):
        own = number[part[0]]
        counts = limits is not None and not may_enter[part[0]]
        result[part] = cleared.judge(
            rows[part],
            np.ones(len(part), dtype=np.bool_),
            max(thick_share(limit[own]) * narrow_mm, THICK_BESIDE * moves.beside_mm),
            limit[own],
            coarse_rad if limits is None else FINE_RAD,
            coarse_rad=coarse_rad,
            known_rad=greatest[own] if counts else -1.0,
        )
        if counts:
            greatest[own] = max(greatest[own], result[part].max())
    # A way down that keeps the limit is no entry, but a lifted link that may touch the stock.
    excused = np.where(limit < np.pi, limit, 0.0)[number]
    is_entry = _behind(down & (np.nan_to_num(result) > excused), length, radius)
    return Engagement(result, is_entry, is_known, moves)


def _parted(moves: StockMoves) -> tuple[StockMoves, Ints]:
    """Return the moves, with those in which an entry ends divided in two, and for each the index
    of the move it is a part of."""
    travel = moves.end - moves.start
    length = np.hypot(*travel[:, :2].T)
    down = travel[:, 2] < -LEVEL_MM * length
    remaining = _entry_remaining(down, length, moves.table[moves.tool, 0])
    share = np.divide(remaining, length, out=np.zeros_like(length), where=length > 0.0)
    is_parted = ~down & (share > 0.0) & (share < 1.0)
    index = np.repeat(np.arange(len(moves)), 1 + is_parted)
    parts = moves.select(index)
    second = np.flatnonzero(np.diff(index, prepend=-1) == 0)
    parts.start[second] += share[is_parted, None] * travel[is_parted]
    parts.end[second - 1] = parts.start[second]
    return parts, index


def _entry_remaining(down: Bools, length: Floats, radius: Floats) -> Floats:
    """Return (M,) mm: the length of the entry that remains at the begin of each move, counted from
    the last move that goes down; 0 or negative once it has ended."""
    travelled = np.concatenate([[0.0], np.cumsum(length)])
    last = np.maximum.accumulate(np.where(down, travelled[1:], -np.inf))
    return np.asarray(last + ENTRY_TURNS * 2.0 * np.pi * radius - travelled[:-1])


def _behind(down: Bools, length: Floats, radius: Floats) -> Bools:
    """Return the mask (M,) of the moves of entries: those that go down, and those after them up to
    the length of an entry."""
    return np.asarray(_entry_remaining(down, length, radius) > ENDED_MM)


def engagement_by_operation(
    slides: StockMoves,
    decoded: Toolpath,
    parts: Sequence[tuple[int, str, float | None]],
    box_mm: tuple[float, float, float, float] | None,
    gate_rad: float | None = None,
) -> tuple[OperationEngagement, ...]:
    """Return the greatest engagement of each operation. `parts`: (first row, name, own limit in
    rad or None) of each, in order; `gate_rad`: a limit for all of them."""
    begin = [row for row, _, _ in parts]
    number = (np.searchsorted(begin, slides.row, side="right") - 1).clip(min=0)
    gate = np.pi if gate_rad is None else gate_rad
    limits = [gate if own is None else min(gate, TOLERATED_SHARE * own) for _, _, own in parts]
    engagement = engagement_of(slides, decoded, box_mm, (number, np.array(limits)))
    moves = engagement.moves
    number = (np.searchsorted(begin, moves.row, side="right") - 1).clip(min=0)
    rows = []
    for k, (_, name, own) in enumerate(parts):
        chosen = np.asarray(number == k)
        if not engagement.is_known[chosen].all():
            blind = moves.table[moves.tool[chosen & ~engagement.is_known], 0]
            words = CHANGING_WIDTH if blind.all() else NO_WIDTH
            rows.append(OperationEngagement(name, None, limit_rad=own, reason=words))
            continue
        greatest, move = engagement.max_heights(chosen)
        if move is None:
            rows.append(OperationEngagement(name, greatest, limit_rad=own))
            continue
        x, y = moves.start[move, :2].tolist()
        rows.append(OperationEngagement(name, greatest, (x, y), int(moves.row[move]), own))
    return tuple(rows)


def engagement_findings(rows: tuple[OperationEngagement, ...]) -> Iterator[Finding]:
    """Yield ENGAGEMENT_TOO_HIGH for each operation that exceeds its limit, ENGAGEMENT_KEPT for
    each that keeps it, and STOCK_NOT_JUDGED for those that were not judged."""
    for each in rows:
        if each.limit_rad is None:
            continue
        if each.greatest_rad is None:
            yield STOCK_NOT_JUDGED_ENGAGEMENT(operation=each.words, reason=each.reason)
            continue
        is_kept = each.greatest_rad <= TOLERATED_SHARE * each.limit_rad
        sentence = ENGAGEMENT_KEPT if is_kept else ENGAGEMENT_TOO_HIGH
        yield sentence(
            where="" if each.at_mm is None else place_words(each.at_mm),
            measured=float(np.degrees(each.greatest_rad)),
            limit=float(np.degrees(each.limit_rad)),
            operation=each.words,
        )
