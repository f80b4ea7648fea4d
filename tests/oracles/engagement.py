"""Slow oracle of the tool's engagement: stock of shapely polygons, cut move by move.

    path of the tool's centre, chords ─▶ stock in square cells, minus what the disc sweeps
      ─at places along it▶ the front half of the tool's circle ∩ stock: an angle

The stock is the whole plane at first. A place of the circle counts where it is in the stock, and
deeper in it than `thick_mm`: what was cut counts as wider by that, except by the last of the path
(as long as RECENT × `thick_mm`, since the chip before a tool is as thin as its advance). No code
of camtool is used beyond the records.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import shapely

from camtool.arrays import Floats
from camtool.geometry.polylines import Polyline
from camtool.toolpath.moves import Kind, Move
from tests.oracles.cleared import Point, point_of
from tests.oracles.lowering import sweep_of
from tests.oracles.offset import pieces

RECENT = 100.0
CELL = 2.0
"""Width of a cell over the tool's radius."""

CAP_PARTS = 40
"""Chords of a quarter of the disc's circle; its polygon lies as far within it as without."""

FRONT_PARTS = 1440
"""Chords of the half circle that is held against the stock."""

LEVEL_EPS_MM = 2e-3
"""Cuts so little above a depth have cleared it."""

CHORD_SHARE = 5e-5
"""Sagitta of the chords that stand for arcs of a path, over the tool's radius."""

FOCUS_SHARE = 0.03
"""Distance of places that are looked at more closely, over the tool's radius."""

BEHIND_SHARE = 0.02
"""The swept area ends this part of the radius behind the place that is looked at: the circle there
would lie on the edge of what is swept up to it."""


class Stay(NamedTuple):
    """A path of the tool's centre, chords (n, 2), from where it came down to where it goes up;
    `down` (m, 3): the way down to its start, empty if unknown."""

    points: Floats
    down: Floats


class Place(NamedTuple):
    """A place on a stay: x, y, direction rad, distance mm from the start of the stay, the number
    of the stay, and the engagement rad."""

    x: float
    y: float
    heading: float
    travelled_mm: float
    stay: int
    angle: float


class Stock:
    """The stock, in cells of a plane without end."""

    def __init__(self, radius_mm: float, thick_mm: float) -> None:
        self.radius_mm, self.thick_mm, self.cell_mm = radius_mm, thick_mm, CELL * radius_mm
        # The mean of the radii of the circles about and within the polygon.
        self.disc_mm = radius_mm * 2.0 / (1.0 + math.cos(0.25 * math.pi / CAP_PARTS))
        self.content: dict[tuple[int, int], shapely.Geometry] = {}
        self.thinned: dict[tuple[int, int], shapely.Geometry] = {}

    def sweep(self, points: Floats) -> shapely.Geometry:
        """Return the area that the tool covers along a path."""
        line = shapely.Point(points[0]) if len(points) == 1 else shapely.LineString(points)
        return shapely.buffer(line, self.disc_mm, quad_segs=CAP_PARTS)

    def cells(self, points: Floats, margin_mm: float) -> list[tuple[int, int]]:
        low = np.floor((points.min(axis=0) - margin_mm) / self.cell_mm).astype(int).tolist()
        high = np.floor((points.max(axis=0) + margin_mm) / self.cell_mm).astype(int).tolist()
        return [(i, j) for i in range(low[0], high[0] + 1) for j in range(low[1], high[1] + 1)]

    def box(self, cell: tuple[int, int], margin_mm: float) -> shapely.Geometry:
        x, y = cell[0] * self.cell_mm, cell[1] * self.cell_mm
        wide = self.cell_mm + margin_mm
        return shapely.box(x - margin_mm, y - margin_mm, x + wide, y + wide)

    def of(self, cell: tuple[int, int]) -> shapely.Geometry:
        """Return the stock in a cell and a margin about it."""
        if cell not in self.content:
            self.content[cell] = self.box(cell, 2.0 * self.thick_mm)
        return self.content[cell]

    def cut(self, points: Floats) -> None:
        """Take away what the tool covers along a path."""
        area = self.sweep(points)
        for cell in self.cells(points, self.radius_mm + 2.0 * self.thick_mm):
            before = self.of(cell)
            if not before.is_empty and shapely.intersects(before, area):
                self.content[cell] = _difference(before, area)
                self.thinned.pop(cell, None)

    def remaining(self, area: shapely.Geometry) -> shapely.Geometry:
        """Return what of an area is in the stock."""
        if area.is_empty:
            return area
        corners = np.reshape(area.bounds, (2, 2))
        cells = self.cells(corners, 0.0)
        boxes = [shapely.intersection(self.of(cell), self.box(cell, 0.0)) for cell in cells]
        parts = shapely.intersection(boxes, area)
        return shapely.union_all(parts, grid_size=1e-9)

    def thick_part(self, cell: tuple[int, int]) -> shapely.Geometry:
        """Return the stock of a cell that is farther than `thick_mm` from what was cut."""
        if self.thick_mm == 0.0:
            return self.of(cell)
        if cell not in self.thinned:
            inner = shapely.buffer(self.of(cell), -self.thick_mm, quad_segs=8)
            self.thinned[cell] = shapely.intersection(inner, self.box(cell, 0.0))
        return self.thinned[cell]

    def engagement(self, place: Floats, heading: float, recent: Floats) -> float:
        """Return the angle, rad, of the front half of the tool's circle that is in the stock."""
        angle = heading + np.linspace(-0.5 * math.pi, 0.5 * math.pi, FRONT_PARTS + 1)
        circle = place + self.radius_mm * np.column_stack([np.cos(angle), np.sin(angle)])
        arc = shapely.LineString(circle)
        parts = [
            shapely.intersection(arc, self.thick_part(cell)) for cell in self.cells(circle, 0.0)
        ]
        parts = [part for part in parts if not part.is_empty]
        if not parts:
            return 0.0
        swept = self.sweep(recent)
        return float(sum(_difference(part, swept).length for part in parts)) / self.radius_mm


def _difference(one: shapely.Geometry, other: shapely.Geometry) -> shapely.Geometry:
    try:
        return shapely.difference(one, other)
    except shapely.errors.GEOSException:
        one, other = shapely.make_valid(one), shapely.make_valid(other)
        return shapely.difference(one, other, grid_size=1e-8)


def chords_of(rows: Floats, sagitta_mm: float) -> Floats:
    """Return points (n, 3) along rows (m, 4) x, y, z, bulge: arcs as chords."""
    points = [rows[:1, :3]]
    for row, after in pairwise(rows):
        count, share = 1, np.ones(1)
        path = Polyline(np.array([[*row[:2], row[3]], [*after[:2], 0.0]]))
        if row[3] != 0.0 and math.dist(row[:2], after[:2]) > 1e-9:
            ((_, _, arc),) = pieces(path)
            assert arc is not None
            most_rad = 2.0 * math.acos(max(0.0, 1.0 - sagitta_mm / arc.radius))
            count = max(1, math.ceil(abs(arc.sweep) / most_rad))
            share = np.arange(1, count + 1) / count
            flat = arc.at(share)
        else:
            flat = after[None, :2]
        z = row[2] + share * (after[2] - row[2])
        points.append(np.column_stack([flat, z]))
    every = np.concatenate(points)
    every[-1] = rows[-1, :3]
    return every


def stays_of(lines: Sequence[Floats], level_mm: float) -> list[Stay]:
    """Return the stays at a depth of lines of points (n, 3)."""
    stays = []
    for points in lines:
        deep = points[:, 2] <= level_mm + LEVEL_EPS_MM
        edges = np.flatnonzero(np.diff(np.concatenate([[0], deep.astype(int), [0]])))
        for low, high in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            flat = points[low:high, :2]
            moved = np.append(True, np.hypot(*np.diff(flat, axis=0).T) > 1e-9)
            stays.append(Stay(flat[moved], points[:low]))
    return stays


def engagements(
    stock: Stock,
    stays: Sequence[Stay],
    every_mm: float,
    phase: float,
    focus: tuple[float, float, float] | None = None,
) -> Iterator[Place]:
    """Yield the engagement at places of the stays `every_mm` apart, the first at that part of it;
    and as a stay's first place, of no heading, the part of the disc that is in the stock where the
    tool comes down, times a whole turn. `focus`: x, y and radius of a disc in which the ends of
    each chord, and a place each FOCUS_SHARE of the radius, are looked at."""
    radius_mm, thick_mm = stock.radius_mm, stock.thick_mm
    behind_mm = BEHIND_SHARE * radius_mm
    lag_mm = max(RECENT * thick_mm, behind_mm)
    for number, (points, _) in enumerate(stays):
        length = np.hypot(*np.diff(points, axis=0).T)
        reach = np.concatenate([[0.0], np.cumsum(length)])
        disc = shapely.buffer(shapely.Point(points[0]), radius_mm, quad_segs=CAP_PARTS)
        wood = _thick_disc(stock, disc)
        yield Place(*points[0].tolist(), math.nan, 0.0, number, wood / disc.area * math.tau)
        done = 0.0
        places = np.arange(phase * every_mm, reach[-1], every_mm)
        if focus is not None:
            ends = np.concatenate([reach[:-1] + 1e-6, reach[1:] - 1e-6])
            every = np.union1d(np.arange(0.0, reach[-1], FOCUS_SHARE * radius_mm), ends)
            x, y = (np.interp(every, reach, column) for column in points.T)
            near = np.hypot(x - focus[0], y - focus[1]) < focus[2]
            places = np.union1d(places, every[near])
        for travelled in places.tolist():
            row = int(np.searchsorted(reach, travelled, side="right")) - 1
            # In the middle of a chord its direction is that of the arc.
            if focus is None and length[row] < 0.1 * radius_mm:
                travelled = float(0.5 * (reach[row] + reach[row + 1]))
            share = (travelled - reach[row]) / length[row]
            old = max(travelled - lag_mm, 0.0)
            if old > done:
                stock.cut(_between(points, reach, done, old))
                done = old
            start, end = points[row], points[row + 1]
            place = start + share * (end - start)
            if focus is not None:
                # Steps of a machine are shorter than what is swept behind them is cut off by.
                about = travelled + np.array([-behind_mm, behind_mm])
                start, end = np.column_stack([np.interp(about, reach, xy) for xy in points.T])
            heading = math.atan2(end[1] - start[1], end[0] - start[0])
            recent = _between(points, reach, done, max(travelled - behind_mm, 0.0))
            angle = stock.engagement(place, heading, recent)
            yield Place(*place.tolist(), heading, travelled, number, angle)
        stock.cut(_between(points, reach, done, float(reach[-1])))


def _thick_disc(stock: Stock, disc: shapely.Geometry) -> float:
    """Return the area of a disc that lies in thick stock."""
    cells = stock.cells(shapely.get_coordinates(disc), 0.0)
    return float(sum(shapely.intersection(disc, stock.thick_part(cell)).area for cell in cells))


def _between(points: Floats, reach: Floats, low: float, high: float) -> Floats:
    """Return the chords (n, 2) of a path between two distances from its start."""
    first, last = np.searchsorted(reach, low, side="right"), np.searchsorted(reach, high)
    ends = []
    for row, at in ((first, low), (max(last, 1), high)):
        row = min(int(row), len(reach) - 1)
        share = (at - reach[row - 1]) / (reach[row] - reach[row - 1])
        ends.append(points[row - 1] + share * (points[row] - points[row - 1]))
    return np.array([ends[0], *points[first:last], ends[1]]) if high > low else np.array(ends[:1])


def lines_of(moves: Iterable[Move], sagitta_mm: float) -> list[Floats]:
    """Return points (n, 3) along the feeds of a program between its rapids: arcs as chords."""
    lines: list[list[Point]] = [[]]
    for move in moves:
        if move.kind == Kind.RAPID:
            lines.append([])
        if move.kind not in (Kind.LINE, Kind.ARC_CW, Kind.ARC_CCW):
            continue
        count = 1
        if move.centre is not None:
            share = min(sagitta_mm / math.dist(move.start[:2], move.centre), 1.0)
            count = math.ceil(abs(sweep_of(move)) / (2.0 * math.acos(1.0 - share)))
        lines[-1] += [] if lines[-1] else [move.start]
        lines[-1] += [point_of(move, part / count) for part in range(1, count + 1)]
    return [np.array(line) for line in lines if line]
