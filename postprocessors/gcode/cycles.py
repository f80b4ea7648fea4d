"""Holes as drilling cycles: which rows of a toolpath are a hole, and the blocks that drill it.

    across · (down to R, as a rapid) · to Z at the feed · (out and back, and on by a peck) ·
    (a dwell) · out to where it began

becomes G81, with a dwell G82, by pecks G83, all with G98: out to where the first cycle began. A
controller counts pecks from R, the plan from the stock: the bites of G83 are no deeper than those
that were planned, and the first of them may be in the air.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.records import replace
from camtool.toolpath.moves import Kind, Toolpath

from .format import NumberStyle, format_number

CYCLE: Final = 100
"""Stands for the kind of a row that is written as a cycle: it is no motion of the program."""


class CycleHole(Struct, frozen=True):
    """Rows first:last + 1 of a toolpath, of which `cut` is the first at a feed, and lengths in its
    units: the place, the height from which it feeds, the bottom, the deepest bite of pecks (None:
    it is drilled in one go), and the seconds at the bottom (None: none)."""

    first: int
    cut: int
    last: int
    at: tuple[float, float]
    height: float
    bottom: float
    bite: float | None
    dwell_s: float | None

    @property
    def words(self) -> tuple[float | None, ...]:
        """Numbers that a canned cycle repeats for all of its holes: height, bottom, peck,
        dwell."""
        return self.height, self.bottom, self.bite, self.dwell_s


def holes_of(toolpath: Toolpath) -> list[CycleHole]:
    """The holes that the drilling operations of a plan make, as far as a cycle can say them."""
    operations = toolpath.operations
    if operations is None:
        return []
    ends = [*operations.begin[1:].tolist(), len(toolpath)]
    return [
        hole
        for note, low, high in zip(operations.notes, operations.begin.tolist(), ends, strict=True)
        if note.drills
        for hole in _holes(toolpath, low, high)
    ]


def _holes(toolpath: Toolpath, low: int, high: int) -> Iterator[CycleHole]:
    """Those of the rows low:high."""
    rows = _Rows(
        toolpath.kind[low:high].tolist(),
        toolpath.end[low:high].tolist(),
        toolpath.feed[low:high].tolist(),
    )
    above, row = float(toolpath.starts_of(np.array([low]))[0, 2]), 0
    while row < len(rows.kind):
        hole = rows.hole(row, above)
        if hole is not None:
            dwell = hole.last - 1
            waits = rows.kind[dwell] == Kind.DWELL
            yield replace(
                hole,
                first=low + hole.first,
                cut=low + hole.cut,
                last=low + hole.last,
                dwell_s=float(toolpath.value[low + dwell]) if waits else None,
            )
            row = hole.last
        above = rows.end[row][2]
        row += 1


class _Rows(Struct, frozen=True):
    """Columns of consecutive rows, as lists."""

    kind: list[int]
    end: list[list[float]]
    feed: list[float]

    def hole(self, first: int, above: float) -> CycleHole | None:
        """The hole that begins with a row, which comes from a height; without its dwell."""
        x, y, z = self.end[first]
        if self.kind[first] != Kind.RAPID or z != above:
            return None
        last = first + 1
        while last < len(self.kind) and self.end[last][:2] == [x, y] and self.end[last][2] != z:
            last += 1
        moves = [k for k in range(first + 1, last) if self.kind[k] != Kind.DWELL]
        dwells = last - first - 1 - len(moves)
        retract = (
            last < len(self.kind) and self.kind[last] == Kind.RAPID and self.end[last] == [x, y, z]
        )
        if not (moves and retract) or dwells > 1 or (dwells and self.kind[last - 1] != Kind.DWELL):
            return None
        cut = first + 1 + (self.kind[first + 1] == Kind.RAPID)
        cuts = range(cut, moves[-1] + 1, 3)
        has_kinds = all(self.kind[k] == (Kind.LINE if k in cuts else Kind.RAPID) for k in moves)
        if not has_kinds or len({self.feed[k] for k in cuts}) != 1:
            return None
        depths = [0.0, *(self.end[k][2] for k in cuts)]
        bites = -np.diff(depths)
        height = self.end[cut - 1][2]
        if moves[-1] not in cuts or (bites <= 0.0).any() or height < 0.0:
            return None
        if dwells and len(cuts) > 1:  # no cycle pecks and waits
            return None
        bite = float(bites.max()) if len(cuts) > 1 else None
        return CycleHole(first, cut, last, (x, y), height, depths[-1], bite, None)


def cycle_blocks(
    holes: Sequence[CycleHole], feed_words: Sequence[str], style: NumberStyle
) -> dict[int, tuple[str, ...]]:
    """The blocks of each hole by its first row at a feed, whose F words are `feed_words`. Holes
    that follow each other and look alike are one cycle with several places; behind the last of
    them it is cancelled."""

    def number(value: float) -> str:
        return format_number(value, style)

    blocks: dict[int, tuple[str, ...]] = {}
    for k, (hole, feed) in enumerate(zip(holes, feed_words, strict=True)):
        x, y = hole.at
        place = f"X{number(x)} Y{number(y)}"
        before = holes[k - 1] if k and holes[k - 1].last + 1 == hole.first else None
        if before is not None and (before.words, feed_words[k - 1]) == (hole.words, feed):
            block = place
        else:
            code, words = "G81", ""
            if hole.bite is not None:
                code, words = "G83", f" Q{number(_rounded_down(hole.bite, style))}"
            elif hole.dwell_s is not None:
                code, words = "G82", f" P{format_number(hole.dwell_s, NumberStyle(3, strip=True))}"
            levels = f"Z{number(hole.bottom)} R{number(hole.height)}"
            block = f"G98 {code} {place} {levels}{words} {feed}"
        goes_on = k + 1 < len(holes) and holes[k + 1].first == hole.last + 1
        blocks[hole.cut] = (block,) if goes_on else (block, "G80")
    return blocks


def _rounded_down(bite: float, style: NumberStyle) -> float:
    """Return the depth of a peck rounded down to the last decimal of a coordinate, or None."""
    unit = 10.0**-style.decimals
    return max(float(np.floor(bite / unit + 1e-6)), 1.0) * unit


def rows_kept(count: int, holes: Sequence[CycleHole]) -> Ints:
    """Of so many rows those that are no part of a hole, and the first row at a feed of each."""
    is_kept = np.ones(count, dtype=np.bool_)
    for hole in holes:
        is_kept[hole.first : hole.last + 1] = False
        is_kept[hole.cut] = True
    return np.flatnonzero(is_kept)
