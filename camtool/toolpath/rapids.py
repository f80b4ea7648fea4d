"""Rapids below the stock top, outside what earlier cuts have cleared.

The model has 2.5 axes: the area cleared at a height z is what the discs of earlier cuts at z or
deeper have swept (of a sloping cut the part that is deep enough). A rapid must sweep its own disc
within that area, at its lowest point; one that slopes is examined in `SLOPE_PARTS` pieces. A rapid
straight up is never wrong, and one straight down may go where a feed at the same XY has been
before (a drill's peck).

    swept by the rapid, disc half the tolerance smaller  ⊆  swept by the cuts, discs half larger

so an area that is cleared exactly is always accepted, and a rapid that protrudes by more than the
tolerance never is. Only rapids below the stock top take time, in proportion to the cuts near them.
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
"""Z of the stock top: part zero lies on it."""

CLEARED_MM = 0.01
"""A rapid's disc may extend beyond the cleared area by this much."""

HEIGHT_EPS_MM = 1e-6
"""Heights that differ by less are equal; a rapid less than this below the top is on it."""

SLOPE_PARTS = 8
"""A rapid in XY and Z at once is examined in this many pieces, each at its lowest height."""

CHORD_SHARE, ROUND_SHARE = 0.25, 0.125
"""Fractions of the tolerance by which chords deviate from arcs, and polygons from discs."""


class Reach(Struct, frozen=True, eq=False):
    """Radii of the tool (N,) mm for each row: `cuts` is cleared at the depth of its tip, `sweeps`
    must be free; `solid` is the box of the stock (xmin, ymin, xmax, ymax) mm, None without
    limits."""

    cuts: Floats
    sweeps: Floats
    solid: tuple[float, float, float, float] | None = None


class RapidThroughStock(Struct, frozen=True):
    """A rapid through the stock: its row, its height there and a point of the contact, mm."""

    row: int
    z_mm: float
    at_mm: tuple[float, float]


def rapids_through_stock(
    toolpath: Toolpath, reach: Reach, tolerance_mm: float = CLEARED_MM
) -> list[RapidThroughStock]:
    """Return the rapids through material that no earlier cut has cleared, in order."""
    wanted = low_rapids(toolpath)
    if not wanted:
        return []
    cleared_area = _ClearedArea(toolpath, reach, tolerance_mm)
    found = []
    for row in wanted:
        for begin, end in _pieces(toolpath, row):
            contact = cleared_area.uncut_point(begin, end, row)
            if contact is not None:
                found.append(RapidThroughStock(row, float(min(begin[2], end[2])), contact))
                break
    return found


def low_rapids(toolpath: Toolpath) -> list[int]:
    """Return the rows of rapids below the stock top that move in XY, or straight down deeper than
    any feed at the same XY before."""
    chosen = toolpath.by_parts(_are_low_rapids)
    if not chosen.any():
        return []
    flat = toolpath.by_parts(_are_across)
    fine = ~flat & (_fed_depths(toolpath, flat) <= toolpath.end[:, 2] + HEIGHT_EPS_MM)
    return np.flatnonzero(chosen & ~fine).tolist()


def _are_low_rapids(toolpath: Toolpath) -> Bools:
    """Mask (N,) of rapids below the stock top that move in XY or down."""
    start, end = toolpath.starts, toolpath.end
    low = np.minimum(start[:, 2], end[:, 2]) < STOCK_TOP_MM - HEIGHT_EPS_MM
    down = end[:, 2] < start[:, 2]
    return np.asarray((toolpath.kind == Kind.RAPID) & low & (_are_across(toolpath) | down))


def _are_across(toolpath: Toolpath) -> Bools:
    """Mask (N,) of rows that move in XY."""
    return np.asarray((toolpath.starts[:, :2] != toolpath.end[:, :2]).any(axis=1))


def _fed_depths(toolpath: Toolpath, flat: Bools) -> Floats:
    """Compute the lowest Z (N,) of feeds before each row since the tool last moved in XY."""
    deep, deepest = np.empty(len(toolpath)), math.inf
    feeds = np.where(toolpath.is_feed, toolpath.end[:, 2], math.inf)
    moves = (flat | toolpath.is_arc).tolist()
    for row, (moved, z) in enumerate(zip(moves, feeds.tolist(), strict=True)):
        deep[row] = deepest
        deepest = z if moved else min(deepest, z)
    return deep


def _pieces(toolpath: Toolpath, row: int) -> Iterator[tuple[Floats, Floats]]:
    """Yield the pieces of a rapid below the stock top, as start and end (3,)."""
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
    """Mask (N,) of moves at a feed that begin or end below the stock top."""
    return toolpath.is_feed & toolpath.by_parts(_is_low)


def _is_low(toolpath: Toolpath) -> Bools:
    lowest = np.minimum(toolpath.starts[:, 2], toolpath.end[:, 2])
    return np.asarray(lowest < STOCK_TOP_MM - HEIGHT_EPS_MM)


class _ClearedArea:
    """The area that the cuts of a toolpath have cleared, queried rapid by rapid."""

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

    def uncut_point(self, begin: Floats, end: Floats, row: int) -> tuple[float, float] | None:
        """Find a point (x, y) mm where the disc of the rapid `row`, from `begin` to `end` (3,),
        meets material at its lowest height; None if it meets none."""
        import shapely

        half = 0.5 * self._tolerance_mm
        needed = self._swept(_line(begin, end), float(self._reach.sweeps[row]) - half)
        if self._solid is not None:
            needed = needed.intersection(self._solid)
        if needed.is_empty:
            return None
        _, near = self._index.touching(np.array([needed.bounds]))
        near = near[self._row[near] < row]
        cleared = [
            self._swept(shapely.MultiLineString(lines), radius + half)
            for radius, lines in self._deep_segments(near, float(min(begin[2], end[2])))
        ]
        left = needed.difference(shapely.union_all(cleared)) if cleared else needed
        if left.is_empty:
            return None
        point = left.representative_point()
        return float(point.x), float(point.y)

    def _deep_segments(self, near: Ints, z: float) -> Iterator[tuple[float, list[Any]]]:
        """Yield the parts of the cuts `near` that are at `z` or deeper, as segments grouped by the
        radius of their tool."""
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

    def _swept(self, shape: Any, radius: float) -> Any:
        """Return the area that a disc sweeps along a shape; the shape itself for a radius ≤ 0."""
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
