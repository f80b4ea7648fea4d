"""Holes and threads as cycles: which rows of a toolpath are one, and the blocks that cut it.

    across · (down to R, as a rapid) · to Z at the feed · (out and back, and on by a peck) ·
    (a dwell) · out to where it began

becomes G81, with a dwell G82, by pecks G83, all with G98: out to where the first cycle began. A
controller counts pecks from R, the plan from the stock: the bites of G83 are no deeper than those
that were planned, and the first of them may be in the air.

A thread whose passes are those of LinuxCNC's G76 becomes that. From the drive line, where the tool
stands, the crest is I away, and the passes are J √1, J √2 … below it, up to the full depth K."""

from __future__ import annotations

import math
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


THREAD: Final = NumberStyle(6, strip=True)
"""Pitches and depths of threads: a rounded depth would change the number of passes."""


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


class CycleThread(Struct, frozen=True):
    """Rows first:last + 1 of a toolpath that one block cuts; `cut` is the first at a feed."""

    first: int
    cut: int
    last: int
    block: str


Cycle = CycleHole | CycleThread


def threads_of(toolpath: Toolpath, unit_mm: float, style: NumberStyle) -> list[CycleThread]:
    """Return the threads of a lathe's plan that G76 cuts with exactly the same moves. Lengths of
    the toolpath are in units of `unit_mm` mm, X along the axis and Y the radius."""
    operations = toolpath.operations
    if operations is None:
        return []
    ends = [*operations.begin[1:].tolist(), len(toolpath)]
    threads = []
    for note, low, high in zip(operations.notes, operations.begin.tolist(), ends, strict=True):
        cuts = low + np.flatnonzero(toolpath.kind[low:high] == Kind.LINE)
        if note.pitch_mm is None or len(cuts) < 3:  # G76 cannot give the depth of a single pass
            continue
        first, last = int(cuts[0]) - 2, int(cuts[-1]) + 2
        if last >= high or last - first != 4 * len(cuts):
            continue
        drive = toolpath.starts_of(np.array([first]))[0]
        bottoms, end = toolpath.end[cuts, 1], toolpath.end[last]
        depth, count = drive[1] - bottoms[-1], len(cuts) - 1
        full = (bottoms[0] - bottoms[-1]) / (1.0 - 1.0 / math.sqrt(count))
        crest = depth - full
        numbers = np.array([*range(1, count + 1), count])
        rows = np.empty((len(cuts), 4, 2))
        rows[:, :2, 0], rows[:, 2:, 0] = drive[0], end[0]
        rows[:, 1:3, 1] = (drive[1] - crest - full * np.sqrt(numbers / count))[:, None]
        rows[:, ::3, 1] = rows[:, 1:2, 1] + depth
        places = np.concatenate([rows.reshape(-1, 2), [[end[0], drive[1]]]])
        if full <= 0.0 or np.abs(places - toolpath.end[first : last + 1, :2]).max() > 1e-9:
            continue
        # Were the first pass rounded down, there would be one more before the full depth.
        start = math.ceil(round(full, THREAD.decimals) / math.sqrt(count) * 10**THREAD.decimals)
        pitch_word, crest_word, first_word, full_word = (
            format_number(value, THREAD)
            for value in (note.pitch_mm / unit_mm, crest, start / 10**THREAD.decimals, full)
        )
        block = f"G76 P{pitch_word} Z{format_number(end[0], style)} I-{crest_word} J{first_word}"
        block += f" R2 K{full_word} H1"
        threads.append(CycleThread(first, int(cuts[0]), last, block))
    return threads


def holes_of(toolpath: Toolpath) -> list[CycleHole]:
    """Return the holes that the drilling operations of a plan make, as far as a canned cycle can
    express them."""
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
    """Yield the holes among the rows low:high that a canned cycle can express."""
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
        """Return the hole that begins with row `first`, which comes from the height `above`,
        without its dwell; None where these rows are no hole of a canned cycle."""
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
    """Return the blocks of each hole, by its first row at a feed; `feed_words` are its F words.
    Consecutive holes of equal depth, height and peck share one cycle with several places,
    cancelled behind the last of them."""

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
    """Return the depth of a peck rounded down to the last decimal of a coordinate, at least one
    such unit."""
    unit = 10.0**-style.decimals
    return max(float(np.floor(bite / unit + 1e-6)), 1.0) * unit


def rows_kept(count: int, cycles: Sequence[Cycle]) -> Ints:
    """Return the rows of `count` that remain when each cycle becomes one block: those outside of
    all cycles, and the first row at a feed of each cycle."""
    is_kept = np.ones(count, dtype=np.bool_)
    for cycle in cycles:
        is_kept[cycle.first : cycle.last + 1] = False
        is_kept[cycle.cut] = True
    return np.flatnonzero(is_kept)
