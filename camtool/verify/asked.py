"""What a job asks of a program, and the two sides that are compared: decoded and written."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from camtool.geometry.polylines import POSITION_EPS_MM, Ints
from camtool.toolpath.moves import Toolpath
from camtool.toolpath.rapids import STOCK_TOP_MM
from camtool.verify.compare import Target
from camtool.verify.cuts import Bools, CutMoves, cut_moves
from camtool.verify.holes import Holes, holes_of

LIMIT_UNITS = 1.5
"""Moves may be so many units of the dialect apart: ends are rounded by up to 0.71 of them, and
centres of arcs on top."""


@dataclass(frozen=True, eq=False)
class Asked:
    """What a program is held against.

    `written`: the moves of the program that camtool would write, as its dialect decodes them;
    `wanted`: what that was written from. `unit_mm`, `unit_z_mm`: the finest difference of places
    that the dialect can say. `feed_said` (M,): the written rows whose feed the job names; a feed
    is the same within half of `feed_unit_mm_min`. `safe_z_mm`: the height of rapids,
    `safe_z_said` where the job names it.
    """

    written: Toolpath
    wanted: Toolpath
    unit_mm: float
    unit_z_mm: float
    feed_said: Bools
    feed_unit_mm_min: float
    safe_z_mm: float
    safe_z_said: bool

    @property
    def limits_mm(self) -> tuple[float, float]:
        """How far apart moves may be in XY, and in height."""
        return LIMIT_UNITS * self.unit_mm, LIMIT_UNITS * self.unit_z_mm


@dataclass(frozen=True, eq=False)
class Side:
    """One of the toolpaths that are compared, with what is asked of it again and again."""

    toolpath: Toolpath
    cuts: CutMoves

    @classmethod
    def of(cls, toolpath: Toolpath, *, flat_cuts: bool) -> Side:
        """The toolpath with its cutting moves; `flat_cuts` as `camtool.verify.cuts` says."""
        running = toolpath.first(toolpath.running)
        return cls(running, cut_moves(running, flat_cuts=flat_cuts))

    @cached_property
    def target(self) -> Target:
        """The cutting moves, to be searched."""
        return Target(self.cuts)

    @cached_property
    def holes(self) -> Holes:
        """What it drills."""
        return holes_of(self.toolpath)

    @cached_property
    def plunges(self) -> Bools:
        """(N,) feeds straight down that end below the stock top."""
        start, end = self.toolpath.starts, self.toolpath.end
        still = (start[:, :2] == end[:, :2]).all(axis=1) & ~self.toolpath.is_arc
        deep = (end[:, 2] < start[:, 2]) & (end[:, 2] < STOCK_TOP_MM - POSITION_EPS_MM)
        return np.asarray(self.toolpath.is_feed & still & deep)


@dataclass(frozen=True, eq=False)
class Alike:
    """Numbers (N,) of the moves of two sides: the same where kind, start, end and centre are."""

    decoded: Ints
    written: Ints

    @classmethod
    def of(cls, decoded: Toolpath, written: Toolpath) -> Alike:
        """Places are the same when they are within rounding (POSITION_EPS_MM)."""
        both = np.concatenate([_numbers(decoded), _numbers(written)])
        number = np.unique(both, axis=0, return_inverse=True)[1].reshape(-1)
        return cls(number[: len(decoded)], number[len(decoded) :])

    @property
    def in_written(self) -> Bools:
        """(N,) decoded moves that `written` holds too."""
        return np.isin(self.decoded, self.written)

    @property
    def in_decoded(self) -> Bools:
        """(M,) written moves that `decoded` holds too."""
        return np.isin(self.written, self.decoded)


def _numbers(toolpath: Toolpath) -> Ints:
    """(N, 9) kind and places, in whole numbers."""
    centre = np.where(toolpath.is_arc[:, None], toolpath.centre, 0.0)
    places = np.concatenate([toolpath.starts, toolpath.end, centre], axis=1)
    whole = np.rint(places / POSITION_EPS_MM).astype(np.int64)
    return np.concatenate([toolpath.kind[:, None], whole], axis=1)
