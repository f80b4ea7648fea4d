"""Is a program what its job asks for? Moves as programmed, before any controller or mechanics.

    drawing, job, flags ─plan, write, read─▶ written     the moves that camtool would ask for
    program ─read─▶ decoded                              the moves that it asks for

A move that both hold, number for number, is as asked. Any other one must lie where `written` or
the wanted toolpath cuts, and the other way round, within the resolution of the dialect: what a
dialect makes of the wanted path (chords, ends on its grid, stairs) is in `written`, so no room is
left for it. Order and starts are free. Where moves of both lie on each other, the way round, the
feed, the spindle and the tool must be the same too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.findings import Finding
from camtool.toolpath.moves import Toolpath
from camtool.verify.asked import Alike, Asked, Side
from camtool.verify.asked_place import hold_place
from camtool.verify.asked_settings import hold_settings


@dataclass(frozen=True, eq=False)
class Held:
    """What came of it: findings of `place` and of the other `settings`; of how many `moves`
    (those that cut) so many `alike` are those of `written`; the farthest `off_mm` of the rest
    from what was asked (0 where there is no rest)."""

    place: tuple[Finding, ...] = ()
    settings: tuple[Finding, ...] = ()
    moves: int = 0
    alike: int = 0
    off_mm: float = 0.0


def hold(decoded: Toolpath, asked: Asked, *, flat_cuts: bool, sample_mm: float) -> Held:
    """Hold the moves of a program against those that were asked for."""
    mine = Side.of(decoded, flat_cuts=flat_cuts)
    count = len(mine.cuts.rows)
    if _same(decoded, asked.written):
        return Held(moves=count, alike=count)
    other = Side.of(asked.written, flat_cuts=flat_cuts)
    wanted = Side.of(asked.wanted, flat_cuts=flat_cuts)
    alike = Alike.of(mine.toolpath, other.toolpath)
    place = hold_place(mine, other, wanted, alike, asked, sample_mm)
    settings = hold_settings(mine, other, alike, place.pairs, asked)
    return Held(
        place=place.findings,
        settings=settings,
        moves=count,
        alike=int((alike.in_written & mine.cuts.is_cut).sum()),
        off_mm=place.off_mm,
    )


def _same(one: Toolpath, other: Toolpath) -> bool:
    """Whether two toolpaths are equal, row for row."""
    names = ("kind", "end", "centre", "feed", "value", "start", "mode")
    return one.modes == other.modes and all(
        np.array_equal(getattr(one, name), getattr(other, name), equal_nan=True) for name in names
    )
