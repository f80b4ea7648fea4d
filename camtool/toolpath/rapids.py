"""Rapids below the stock top, outside what earlier cuts have cleared.

2.5 axes: at a height z that is cleared which the discs of earlier cuts at z or deeper have swept
(a sloping cut: the part of it that is deep enough). A rapid must sweep its own disc there, at its
lowest point; one that slopes is looked at in `SLOPE_PARTS` pieces. A rapid straight up is never
wrong, and one straight down may go where a feed has been right there before (a drill's peck).

    swept by the rapid, disc half the tolerance smaller  ⊆  swept by the cuts, discs half larger

so an area that is cleared exactly always counts, and what sticks out by more than the tolerance
never does. Only rapids below the stock top cost anything, each no more than the cuts near it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.geometry.boxes import BoxIndex
from camtool.toolpath.lower import arcs_to_lines
from camtool.toolpath.moves import Kind, Toolpath

STOCK_TOP_MM = 0.0
"""Part zero lies on the stock."""

CLEARED_MM = 0.01
"""A rapid's disc may extend beyond the cleared area by this much."""

HEIGHT_EPS_MM = 1e-6
"""Heights that differ by less are equal, and a rapid this little below the top is on it."""

SLOPE_PARTS = 8
"""A rapid in XY and Z at once is examined in this many pieces, each at its lowest height."""

CHORD_SHARE, ROUND_SHARE = 0.25, 0.125
"""Parts of the tolerance by which chords stray from arcs, and polygons from discs."""


class Reach(Struct, frozen=True, eq=False):
    """Radii (N,) mm for each row: `cuts` of what a tool clears at the depth of its tip, `sweeps`
    of what it needs free; `solid` (xmin, ymin, xmax, ymax) mm where there is stock, None: all
    over."""

    cuts: Floats
    sweeps: Floats
    solid: tuple[float, float, float, float] | None = None


class Through(Struct, frozen=True):
    """A rapid through the stock: its row, its height there and about where, mm."""

    row: int
    z_mm: float
    at_mm: tuple[float, float]


def rapids_through_stock(
    toolpath: Toolpath, reach: Reach, tolerance_mm: float = CLEARED_MM
) -> list[Through]:
    """The rapids that run through material which no earlier cut has cleared, in order."""
    wanted = low_rapids(toolpath)
    if not wanted:
        return []
    swarf = _Swarf(toolpath, reach, tolerance_mm)
    found = []
    for row in wanted:
        for begin, end in _pieces(toolpath, row):
            stuck = swarf.uncut(begin, end, row)
            if stuck is not None:
                found.append(Through(row, float(min(begin[2], end[2])), stuck))
                break
    return found


def low_rapids(toolpath: Toolpath) -> list[int]:
    """Rapids below the stock top that move in XY, or straight down to where no feed has been."""
    chosen = toolpath.by_parts(_go_low)
    if not chosen.any():
        return []
    flat = toolpath.by_parts(_go_across)
    fine = ~flat & (_been(toolpath, flat) <= toolpath.end[:, 2] + HEIGHT_EPS_MM)
    return np.flatnonzero(chosen & ~fine).tolist()


def _go_low(toolpath: Toolpath) -> Bools:
    """(N,) true for rapids below the stock top that move in XY or down."""
    start, end = toolpath.starts, toolpath.end
    low = np.minimum(start[:, 2], end[:, 2]) < STOCK_TOP_MM - HEIGHT_EPS_MM
    down = end[:, 2] < start[:, 2]
    return np.asarray((toolpath.kind == Kind.RAPID) & low & (_go_across(toolpath) | down))


def _go_across(toolpath: Toolpath) -> Bools:
    """(N,) true for rows that move in XY."""
    return np.asarray((toolpath.starts[:, :2] != toolpath.end[:, :2]).any(axis=1))


def _been(toolpath: Toolpath, flat: Bools) -> Floats:
    """(N,) how deep feeds have been, before each row, since the tool last moved in XY."""
    deep, deepest = np.empty(len(toolpath)), math.inf
    feeds = np.where(toolpath.is_feed, toolpath.end[:, 2], math.inf)
    moves = (flat | toolpath.is_arc).tolist()
    for row, (moved, z) in enumerate(zip(moves, feeds.tolist(), strict=True)):
        deep[row] = deepest
        deepest = z if moved else min(deepest, z)
    return deep


def _pieces(toolpath: Toolpath, row: int) -> Iterator[tuple[Floats, Floats]]:
    """The parts of a rapid below the stock top: ends (3,) each."""
    begin, end = toolpath.starts[row], toolpath.end[row]
    if begin[2] == end[2] or (begin[:2] == end[:2]).all():
        yield begin, end
        return
    shares = np.linspace(0.0, 1.0, SLOPE_PARTS + 1)
    crossing = (STOCK_TOP_MM - begin[2]) / (end[2] - begin[2])
    if 0.0 < crossing < 1.0:
        low, high = (0.0, crossing) if begin[2] < end[2] else (crossing, 1.0)
        shares = low + (high - low) * shares
    points = begin + shares[:, None] * (end - begin)
    yield from pairwise(points)


def feeds_below_top(toolpath: Toolpath) -> Bools:
    """(N,) true for moves at a feed that begin or end below the stock top."""
    return toolpath.is_feed & toolpath.by_parts(_is_low)


def _is_low(toolpath: Toolpath) -> Bools:
    lowest = np.minimum(toolpath.starts[:, 2], toolpath.end[:, 2])
    return np.asarray(lowest < STOCK_TOP_MM - HEIGHT_EPS_MM)


class _Swarf:
    """What the cuts of a toolpath have cleared, queried rapid by rapid."""

    def __init__(self, toolpath: Toolpath, reach: Reach, tolerance_mm: float) -> None:
        import shapely

        cuts = feeds_below_top(toolpath)
        chords = arcs_to_lines(toolpath, cuts, CHORD_SHARE * tolerance_mm)
        kept = np.flatnonzero(cuts[chords.row])
        self._row: Ints = chords.row[kept]
        self._begin, self._end = chords.toolpath.starts[kept], chords.toolpath.end[kept]
        self._reach, self._tolerance_mm = reach, tolerance_mm
        self._radius = reach.cuts[self._row]
        ends = np.stack([self._begin[:, :2], self._end[:, :2]])
        corners = np.concatenate([ends.min(axis=0), ends.max(axis=0)], axis=1)
        wide = (self._radius + tolerance_mm)[:, None] * np.array([-1.0, -1.0, 1.0, 1.0])
        self._index = BoxIndex(corners + wide)
        self._solid = None if reach.solid is None else shapely.box(*reach.solid)

    def uncut(self, begin: Floats, end: Floats, row: int) -> tuple[float, float] | None:
        """A place (x, y) mm where the disc of the rapid `row` from `begin` to `end` (3,) meets
        material at its lowest height; None when there is none."""
        import shapely

        half = 0.5 * self._tolerance_mm
        needed = self._disc(_line(begin, end), float(self._reach.sweeps[row]) - half)
        if self._solid is not None:
            needed = needed.intersection(self._solid)
        if needed.is_empty:
            return None
        _, near = self._index.touching(np.array([needed.bounds]))
        near = near[self._row[near] < row]
        cleared = [
            self._disc(shapely.MultiLineString(lines), radius + half)
            for radius, lines in self._deep(near, float(min(begin[2], end[2])))
        ]
        left = needed.difference(shapely.union_all(cleared)) if cleared else needed
        if left.is_empty:
            return None
        point = left.representative_point()
        return float(point.x), float(point.y)

    def _deep(self, near: Ints, z: float) -> Iterator[tuple[float, list[Any]]]:
        """The cuts among `near` where they are as deep as `z`, by the radius of their tool."""
        begin, end = self._begin[near], self._end[near]
        floor = z + HEIGHT_EPS_MM
        rise = end[:, 2] - begin[:, 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = np.clip((floor - begin[:, 2]) / rise, 0.0, 1.0)
        low = np.where(rise < 0.0, crossing, 0.0)
        high = np.where(rise > 0.0, crossing, 1.0)
        deep = np.minimum(begin[:, 2], end[:, 2]) <= floor
        travel = (end - begin)[:, :2]
        first = begin[:, :2] + low[:, None] * travel
        last = begin[:, :2] + high[:, None] * travel
        for radius in np.unique(self._radius[near[deep]]).tolist():
            these = deep & (self._radius[near] == radius)
            yield radius, list(np.stack([first[these], last[these]], axis=1))

    def _disc(self, shape: Any, radius: float) -> Any:
        """What a disc sweeps along a shape; the shape itself when there is no disc left."""
        if radius <= 0.0:
            return shape
        sagitta = min(1.0, ROUND_SHARE * self._tolerance_mm / radius)
        corners = math.ceil(0.25 * math.pi / math.acos(1.0 - sagitta)) if sagitta < 1.0 else 1
        return shape.buffer(radius, quad_segs=max(corners, 1))


def _line(begin: Floats, end: Floats) -> Any:
    import shapely

    if (begin[:2] == end[:2]).all():
        return shapely.Point(begin[:2])
    return shapely.LineString([begin[:2], end[:2]])
