"""The size of what a program makes, seen from above: the area that its tool removes, with shapely.

Shares nothing with camtool: moves by the reader of `tests.oracles.stock`, the area as discs and
the bands between them. A part that is cut out is what is left of the stock about what is drawn; a
pocket is what is gone. Boxes are exact within `SLACK_MM`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from camtool.arrays import Floats
from tests.oracles.stock import Cutter, Move, Path, Walls

SAG_MM = 5e-4
"""Chords of arcs lie so near to them."""

SIDES = 16
"""A quarter of a disc has so many sides; its box is exact."""

SLACK_MM = 2e-3
"""How far a box may be off: sagittas, and three decimals of a program."""

TOP_MM = 1e-9
"""What is nearer to the top of the stock is at it."""

Box = tuple[float, float, float, float]
"""x low, y low, x high, y high."""


class Ball(Cutter):
    """A ball nose."""

    def radius_at(self, depth: Any) -> Any:
        """Radius of the cut at the surface with the tip at this depth."""
        above = np.clip(self.radius - np.asarray(depth), 0.0, self.radius)
        return np.where(np.asarray(depth) > 0.0, np.sqrt(self.radius**2 - above**2), 0.0)


def removed(moves: Iterable[Move], cutter: Cutter) -> Any:
    """The area (a shapely geometry) that the tool removes at the surface."""
    return swept(
        [(places, reach(places, cutter)) for places in map(_places, moves) if len(places)]
    )


def reach(places: Floats, cutter: Cutter) -> Floats:
    """(J,) how wide the tool cuts at the surface from places (J, 3): at the very top as just below
    it, where a cut ends."""
    depth = -places[:, 2]
    return np.asarray(cutter.radius_at(np.where(np.abs(depth) <= TOP_MM, TOP_MM, depth)))


def _places(move: Move) -> Floats:
    """(J, 3) the ends of the chords of a move, none of one that does not cut."""
    if move.rapid or min(move.a[2], move.b[2]) >= 0.0:
        return np.empty((0, 3))
    count = 1
    if move.centre is not None:
        radius = math.dist(move.a[:2], move.centre)
        count = math.ceil(abs(move.sweep) / (2.0 * math.acos(max(1.0 - SAG_MM / radius, 0.0))))
    if move.a[2] != move.b[2]:
        count = max(count, 64)
    return move.at(np.linspace(0.0, 1.0, max(count, 1) + 1))


def swept(tracks: Iterable[tuple[Floats, Floats]]) -> Any:
    """The area of discs of a radius (J,) along places (J, 3), for each of the tracks: where the
    radius is even, that beside the lines, else the hulls of neighbours, which are exact while it
    changes evenly."""
    lines: dict[float, list[Any]] = {}
    areas, seen = [], set[bytes]()
    for places, wide_mm in tracks:
        # The turns of a helix lie above each other.
        key = np.round(np.column_stack([places[:, :2], wide_mm]), 4).tobytes()
        if key in seen:
            continue
        seen.add(key)
        if len(places) == 1:
            areas.append(
                shapely.buffer(shapely.points(places[0, :2]), wide_mm[0], quad_segs=SIDES)
            )
        elif (wide_mm == wide_mm[0]).all():
            if wide_mm[0]:
                line = shapely.simplify(shapely.linestrings(places[:, :2]), 0.2 * SAG_MM)
                lines.setdefault(float(wide_mm[0]), []).append(line)
            continue
        wide = np.maximum(wide_mm, 1e-6)  # a point has no area, and a tip ends in one
        discs = shapely.buffer(shapely.points(places[:, :2]), wide, quad_segs=SIDES)
        areas += [shapely.convex_hull(shapely.union(*two)) for two in pairwise(discs)]
    for radius, each in lines.items():
        # Not merged: GEOS widens a line that goes there and back without its far end.
        areas += [
            shapely.buffer(piece, radius, quad_segs=SIDES)
            for line in each
            for piece in _short(line)
        ]
    return shapely.union_all(areas)


def _short(line: Any) -> list[Any]:
    """Pieces of a line: a long one crosses itself too often to be widened at once."""
    points = shapely.get_coordinates(line)
    ends = [*range(0, len(points) - 1, 400), len(points) - 1]
    return [shapely.linestrings(points[low : high + 1]) for low, high in pairwise(ends)]


def polygon(path: Path, sag: float = SAG_MM) -> Any:
    """A closed path as a polygon, its arcs as chords."""
    walls, points = Walls.of([path]), []
    for k in range(len(walls.a)):
        sweep = float(walls.sweep[k])
        begin = (*walls.a[k].tolist(), 0.0)
        end = (*walls.b[k].tolist(), 0.0)
        centre = (float(walls.centre[k, 0]), float(walls.centre[k, 1])) if sweep else None
        count = 1
        if centre is not None:
            radius = math.dist(begin[:2], centre)
            count = math.ceil(abs(sweep) / (2.0 * math.acos(max(1.0 - sag / radius, 0.0))))
        side = Move(False, begin, end, 0, centre, sweep)
        points.append(side.at(np.arange(count) / count)[:, :2])
    return shapely.Polygon(np.concatenate(points))


def left_of(area: Any, paths: Sequence[Path]) -> Any:
    """The pieces of stock, cut by the removed `area`, that hold something within the paths."""
    x0, y0, x1, y1 = area.bounds
    rest = shapely.difference(shapely.box(x0 - 1.0, y0 - 1.0, x1 + 1.0, y1 + 1.0), area)
    cores = [shapely.difference(polygon(path), area) for path in paths]
    pieces = shapely.get_parts(rest)
    return shapely.union_all(
        [piece for piece in pieces if any(piece.intersection(core).area > 0.0 for core in cores)]
    )


def size_of(box: Box) -> tuple[float, float]:
    """Its width and height."""
    return box[2] - box[0], box[3] - box[1]
