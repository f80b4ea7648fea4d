"""Reading blocks of plain moves by columns: thousands of lines with G0 to G3, X Y Z I J and F.

A column knows no fault: `PlainMoves` says of how many blocks it is sure, and a reader takes the
next one as a block of words."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.findings import Finding
from camtool.kernels import words
from camtool.machine.model import exceeds
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind

from .blocks import SURE_PART, PlainBlocks, fill_forward
from .findings import FEED_ABOVE_LIMIT_IN_WORDS

RAPID, LINE, ARC_CCW = 0, 10, 30
"""G words, tenfold; arcs are above LINE."""


class ArcRule(Struct, frozen=True):
    """Bounds of the arcs that a controller surely accepts: radii at both ends above `radius_mm`
    that differ by at most `gap_mm`; an arc that turns by less than `full_turn_rad` may be executed
    as a full circle. `ends_in_plane`: an arc must have X or Y."""

    gap_mm: float
    radius_mm: float
    full_turn_rad: float
    ends_in_plane: bool = False


KINDS: Final = np.full(ARC_CCW + 1, -1)
"""Kind of a move, by its G word tenfold."""
KINDS[[0, 10, 20, 30]] = [Kind.RAPID, Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW]


class PlainState(Struct, frozen=True):
    """State before a run of plain blocks: the motion (ten times its G word, −1: none), the feed
    (0: none), the length of the unit in mm, and the position of the tool."""

    motion: int
    feed: float
    mm: float
    position: tuple[float, float, float]


class PlainMoves:
    """N plain blocks with absolute coordinates, decoded by columns: the motion in force, the feed
    in force (N,) mm/min, the position of the tool after each (N, 3) mm, the centre of an arc (N,
    2) mm, and whether it moves. Only the first `count` blocks may be used: for them the reader
    would give exactly the same one by one."""

    def __init__(self, blocks: PlainBlocks, state: PlainState, rule: ArcRule) -> None:
        self._plain = blocks
        has_g, has_feed = blocks.has(words.G_WORD), blocks.has(words.F_WORD)
        has_axis = [blocks.has(column) for column in (words.X_WORD, words.Y_WORD, words.Z_WORD)]
        has_i, has_j = blocks.has(words.I_WORD), blocks.has(words.J_WORD)
        numbers = blocks.numbers
        self.motion = fill_forward(
            has_g, np.where(has_g, numbers[:, words.G_WORD] * 10.0, 0.0), state.motion
        ).astype(np.int64)
        self.feed = fill_forward(has_feed, numbers[:, words.F_WORD] * state.mm, state.feed)
        self.end = np.column_stack(
            [
                fill_forward(
                    has_axis[axis],
                    numbers[:, words.X_WORD + axis] * state.mm,
                    state.position[axis],
                )
                for axis in range(3)
            ]
        )
        start = np.concatenate([[state.position], self.end[:-1]])
        self.moving = has_axis[0] | has_axis[1] | has_axis[2]
        centred = has_i | has_j
        offset = np.column_stack(
            [
                np.where(has_i, numbers[:, words.I_WORD] * state.mm, 0.0),
                np.where(has_j, numbers[:, words.J_WORD] * state.mm, 0.0),
            ]
        )
        self.centre = start[:, :2] + offset
        arc = self.motion > LINE
        is_sure = ~(has_feed & ~(self.feed > 0.0))
        is_sure &= self.moving | ~centred
        is_sure &= ~self.moving | (self.motion >= 0)
        is_sure &= ~(has_g | self.moving) | (self.motion == RAPID) | (self.feed > 0.0)
        is_sure &= ~(has_g & arc) | self.moving
        is_sure &= ~self.moving | (arc == centred)
        arcs = np.flatnonzero(arc & self.moving & is_sure)
        if rule.ends_in_plane:
            is_sure[arcs] &= (has_axis[0] | has_axis[1])[arcs]
        is_sure[arcs] &= sure_arcs(start[arcs, :2], self.end[arcs, :2], self.centre[arcs], rule)
        self.count = len(is_sure) if is_sure.all() else int(is_sure.argmin())

    def add_to(self, path: ToolpathBuilder, fast: FastFeeds) -> bool:
        """Add the rows of the first `count` blocks, at least one, to a path, and note feeds above
        the limit in `fast`. Return True if any of them moves."""
        sure_rows = slice(self.count)
        rows, feeds = self.moving[sure_rows], self.feed[sure_rows]
        has_feed_word = self._plain.has(words.F_WORD)[sure_rows]
        fast.note(self._plain.first, np.where(has_feed_word, feeds, np.nan))
        if not rows.any():
            return False
        kind = self.motion[sure_rows][rows]
        path.moves(
            kind=KINDS[kind],
            end=self.end[sure_rows][rows],
            centre=np.where(kind[:, None] > LINE, self.centre[sure_rows][rows], np.nan),
            feed=np.where(kind >= LINE, feeds[rows], np.nan),
            block=self._plain.first + np.flatnonzero(rows),
        )
        return True

    @property
    def last(self) -> tuple[int | None, float]:
        """Motion (ten times its G word, None: none) and feed in force after the first `count`
        blocks."""
        motion = int(self.motion[self.count - 1])
        return (motion if motion >= 0 else None), float(self.feed[self.count - 1])


def sure_arcs(start: Floats, end: Floats, centre: Floats, rule: ArcRule) -> Bools:
    """Return a mask (K,), true for arcs that the controller surely executes as meant: the radii at
    both ends agree well within the rule, and the arc either ends where it starts or turns by
    clearly more than what is taken for a full circle."""
    start_arm, end_arm = start - centre, end - centre
    r1, r2 = np.hypot(start_arm[:, 0], start_arm[:, 1]), np.hypot(end_arm[:, 0], end_arm[:, 1])
    cross = start_arm[:, 0] * end_arm[:, 1] - start_arm[:, 1] * end_arm[:, 0]
    turn = np.abs(np.arctan2(cross, (start_arm * end_arm).sum(axis=1)))
    same_ends = (start == end).all(axis=1)
    is_sure = np.abs(r1 - r2) <= SURE_PART * rule.gap_mm
    is_sure &= SURE_PART * np.minimum(r1, r2) > rule.radius_mm
    return np.asarray(is_sure & (same_ends | (SURE_PART * turn > rule.full_turn_rad)))


class FastFeeds:
    """F words above the machine's highest feed: their number, the block of the first, and the
    highest."""

    def __init__(self, limit_mm_min: float) -> None:
        self._limit = limit_mm_min
        self._count, self._first, self._most = 0, 0, 0.0

    def note(self, first: int, feeds: Floats) -> None:
        """Count the F words among `feeds` (K,) that exceed the limit; they belong to the blocks
        from `first` on, NaN where a block has no F."""
        fast = np.flatnonzero(exceeds(feeds, self._limit))
        if len(fast):
            if not self._count:
                self._first = first + int(fast[0])
            self._count += len(fast)
            self._most = max(self._most, float(feeds[fast].max()))

    def findings(self) -> Iterator[Finding]:
        """Yield one finding for all feeds above the limit, if there are any."""
        if self._count:
            yield FEED_ABOVE_LIMIT_IN_WORDS(
                where=f"block {self._first + 1}",
                measured=self._most,
                limit=self._limit,
                count=self._count,
            )
