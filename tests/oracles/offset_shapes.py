"""Slow, obvious oracles for offsets of whole shapes: regions of shapely, with what mitres cover.

Shapes are lists of closed paths that do not cross; their region lies on the left of all of them.
Nothing here uses camtool.geometry beyond the record of a polyline.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from camtool.arrays import Bools, Floats
from camtool.geometry.polylines import Polyline
from tests.oracles.offset import (
    EXACT_MM,
    GRID_MM,
    Arc,
    area_of,
    chords,
    dense,
    distance,
    inside,
    length_of,
    near_region,
    pieces,
    rings,
    sagitta,
)

CHORD_RAD = 0.05
"""Sweep of the chords that stand for arcs where shapely judges."""

Kite = Floats
"""Corners (n, 2) of what a mitre covers."""


def kites(paths: Sequence[Polyline], d: float, limit: float) -> list[Kite]:
    """Return the area of the mitres at right turns of closed paths: two rays along the shifted
    sides, cut off at limit·d from the corner."""
    found = []
    for p in paths:
        of = pieces(p)
        for (a, b, arc), (after, end, next_arc) in zip(of, [*of[1:], of[0]], strict=True):
            t1, t2 = _direction(a, b, arc, at_end=True), _direction(after, end, next_arc, False)
            turn = math.atan2(t1[0] * t2[1] - t1[1] * t2[0], t1 @ t2)
            if turn >= math.pi - 1e-3:
                turn -= 2.0 * math.pi
            if turn > -1e-9:
                continue
            n1, n2 = np.array([-t1[1], t1[0]]), np.array([-t2[1], t2[0]])
            half = -0.5 * turn
            reach = d * math.tan(half)
            if limit * math.cos(half) < 1.0:
                reach = d * (limit - math.cos(half)) / math.sin(half)
            kite = [b, b + d * n1, b + d * n1 + reach * t1, b + d * n2 - reach * t2, b + d * n2]
            found.append(np.array(kite))
    return found


def _direction(a: Floats, b: Floats, arc: Arc | None, at_end: bool) -> Floats:
    """Unit tangent at one end."""
    if arc is None:
        return (b - a) / math.dist(a, b)
    angle = arc.begin + (arc.sweep if at_end else 0.0) + math.copysign(0.5 * math.pi, arc.sweep)
    return np.array([math.cos(angle), math.sin(angle)])


def region_of(paths: Sequence[Polyline], most_rad: float) -> shapely.Geometry:
    """Return the area inside an odd number of the paths, arcs as chords."""
    region: shapely.Geometry = shapely.Polygon()
    for p in paths:
        ring = shapely.Polygon(chords(p, most_rad))
        region = shapely.symmetric_difference(region, ring, grid_size=GRID_MM)
    return region


def shape_offset(
    paths: Sequence[Polyline], d: float, covered: Sequence[Kite], most_rad: float
) -> shapely.Geometry:
    """The region shrunk by d, or grown by −d: without, or with, all that is near, and kites."""
    near = [near_region(p, abs(d), most_rad) for p in paths]
    near += [shapely.make_valid(shapely.Polygon(kite)) for kite in covered]
    obstacle = shapely.union_all(near, grid_size=GRID_MM)
    unite = shapely.difference if d > 0.0 else shapely.union
    return unite(region_of(paths, most_rad), obstacle, grid_size=GRID_MM)


def shape_complaints(
    results: Sequence[Polyline],
    paths: Sequence[Polyline],
    d: float,
    rng: np.random.Generator,
    limit: float = math.inf,
) -> list[str]:
    """Everything that is wrong with the offset of a shape. `limit`: of mitres, inf for round."""
    left = paths if d > 0.0 else [_back(p) for p in paths]
    covered = [] if math.isinf(limit) else kites(left, abs(d), limit)
    found = _distance_complaints(results, paths, abs(d), covered)
    found += [f"result {i} is open" for i, each in enumerate(results) if not each.closed]
    if found:
        return found
    sag = max(sagitta(each, CHORD_RAD) for each in (*paths, *results))
    sag += abs(d) * (1.0 - math.cos(0.5 * CHORD_RAD))
    region = shape_offset(paths, d, covered, CHORD_RAD)
    total = sum(length_of(each) for each in (*paths, *results))
    # Outer ones CCW and holes CW: the signed areas add up.
    got = sum(area_of(each) for each in results)
    if abs(got - region.area) > 1e-6 * region.area + total * (2.0 * sag + EXACT_MM):
        found.append(f"area of {got} mm² where shapely has {region.area} mm²")
    found += _place_complaints(results, paths, (d, covered), sag, rng)
    slack = 4.0 * (sag + EXACT_MM)
    return found + _count_complaints(results, paths, (d, covered), slack)


def _back(p: Polyline) -> Polyline:
    rows = p.vertices[::-1].copy()
    rows[:, 2] = -np.roll(rows[:, 2], -1)
    return Polyline(rows, True)


def _distance(points: Floats, paths: Sequence[Polyline]) -> Floats:
    return np.min([distance(points, p) for p in paths], axis=0)


def _depth(points: Floats, covered: Sequence[Kite]) -> Floats:
    """(P,) how deep points are in any kite; below 0 outside all, minus the distance from them."""
    deep = np.full(len(points), -np.inf)
    for kite in covered:
        polygon = shapely.make_valid(shapely.Polygon(kite))
        each = shapely.points(points)
        apart = shapely.distance(shapely.LinearRing(kite), each)
        deep = np.maximum(deep, np.where(shapely.contains(polygon, each), apart, -apart))
    return deep


def _distance_complaints(
    results: Sequence[Polyline], paths: Sequence[Polyline], d: float, covered: Sequence[Kite]
) -> list[str]:
    found = []
    for each in results:
        points = dense(each, 17)
        apart, deep = _distance(points, paths) - d, _depth(points, covered)
        if apart.min() < -EXACT_MM:
            found.append(f"{-apart.min()} mm too near")
        if deep.max() > EXACT_MM:
            found.append(f"{deep.max()} mm deep in a mitre")
        away = np.minimum(apart, -deep)
        if away.max() > EXACT_MM:
            found.append(f"{away.max()} mm too far")
    return found


Wanted = tuple[float, Sequence[Kite]]


def _place_complaints(
    results: Sequence[Polyline],
    paths: Sequence[Polyline],
    wanted: Wanted,
    sag: float,
    rng: np.random.Generator,
) -> list[str]:
    """Points all over the place, and close beside the results, that are on the wrong side."""
    d, covered = wanted
    source = np.concatenate([chords(p, CHORD_RAD) for p in paths])
    low, high = source.min(axis=0) - 1.1 * abs(d), source.max(axis=0) + 1.1 * abs(d)
    beside = [dense(each, 5) for each in results]
    beside = [b + 0.003 * rng.normal(size=b.shape) * (high - low).max() for b in beside]
    points = np.concatenate([rng.uniform(low, high, (300, 2)), *beside])
    apart, deep = _distance(points, paths), _depth(points, covered)
    unclear = 2.0 * (sag + EXACT_MM)
    clear = (np.abs(apart - abs(d)) > unclear) & (apart > unclear) & (np.abs(deep) > unclear)
    points, apart, deep = points[clear], apart[clear], deep[clear]
    within = inside(points, [chords(p, CHORD_RAD) for p in paths])
    near: Bools = (apart < abs(d)) | (deep > 0.0)
    right = within & ~near if d > 0.0 else within | near
    wrong = np.flatnonzero(right != inside(points, [chords(p, CHORD_RAD) for p in results]))
    return (
        [f"{len(wrong)} points, {points[wrong[0]]} first, on the wrong side"] if len(wrong) else []
    )


def _count_complaints(
    results: Sequence[Polyline], paths: Sequence[Polyline], wanted: Wanted, slack: float
) -> list[str]:
    """A wrong number of outer rings or holes, where a little more distance would not change it."""
    d, covered = wanted
    if slack > 0.5 * abs(d) or covered:
        return []
    counts = set()
    for change in (-slack, 0.0, slack):
        region = shape_offset(paths, d + change, covered, CHORD_RAD)
        parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon"]
        holes = [shapely.Polygon(hole) for part in parts for hole in part.interiors]
        outer = [shapely.Polygon(part.exterior) for part in parts]
        counts.add((len(rings_of(outer, 2.0 * slack)), len(rings_of(holes, 2.0 * slack))))
    wide = [area_of(each) for each in results if abs(area_of(each)) > slack * length_of(each)]
    got = (sum(each > 0.0 for each in wide), sum(each < 0.0 for each in wide))
    return (
        [f"{got} outer rings and holes where shapely has {counts}"]
        if {got} != counts and len(counts) == 1
        else []
    )


def rings_of(polygons: Sequence[shapely.Geometry], least_width: float) -> list[shapely.Geometry]:
    """The rings of polygons without holes that are wider than that in the mean."""
    return rings(shapely.MultiPolygon(list(polygons)), least_width)
