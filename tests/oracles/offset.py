"""Slow, obvious oracles for offsets: distances by angles about centres, insides by fine chords.

Nothing here uses camtool.geometry beyond the record of a polyline.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from camtool.arrays import Bools, Floats
from camtool.geometry.polylines import Polyline
from camtool.records import replace

GRID_MM = 1e-9
"""shapely unites on this grid: without one it has lost whole parts of nearly equal arcs."""


@dataclass(frozen=True)
class Arc:
    """Centre, radius, begin angle and signed sweep."""

    x: float
    y: float
    radius: float
    begin: float
    sweep: float

    def at(self, part: Floats) -> Floats:
        """Points at the parts (J,) of the sweep."""
        angle = self.begin + part * self.sweep
        return np.column_stack(
            [self.x + self.radius * np.cos(angle), self.y + self.radius * np.sin(angle)]
        )


def pieces(p: Polyline) -> list[tuple[Floats, Floats, Arc | None]]:
    """Start, end and arc (None for a line) of each segment."""
    rows = [*p.vertices, p.vertices[0]] if p.closed else list(p.vertices)
    return [
        (a[:2], b[:2], _arc(a[:2], b[:2], float(a[2])) if a[2] else None)
        for a, b in pairwise(rows)
    ]


def _arc(a: Floats, b: Floats, bulge: float) -> Arc:
    sweep = 4.0 * math.atan(bulge)
    chord = math.dist(a, b)
    radius = 0.5 * chord / math.sin(0.5 * abs(sweep))
    # From the middle of the chord to the centre: to the left for CCW arcs up to half a circle.
    height = math.copysign(radius * math.cos(0.5 * sweep), bulge)
    ux, uy = (b - a) / chord
    x = 0.5 * (a[0] + b[0]) - uy * height
    y = 0.5 * (a[1] + b[1]) + ux * height
    return Arc(x, y, radius, math.atan2(a[1] - y, a[0] - x), sweep)


def distance(points: Floats, p: Polyline) -> Floats:
    """(P,) distance of points to the path."""
    best = np.full(len(points), np.inf)
    for a, b, arc in pieces(p):
        best = np.minimum(best, np.hypot(*(points - a).T))
        best = np.minimum(best, np.hypot(*(points - b).T))
        if arc is None:
            d = b - a
            t = ((points - a) @ d) / (d @ d)
            foot = np.hypot(*(points - a - t[:, None] * d).T)
            best = np.where((t > 0.0) & (t < 1.0), np.minimum(best, foot), best)
            continue
        x, y = points[:, 0] - arc.x, points[:, 1] - arc.y
        turn = np.arctan2(y, x) - arc.begin
        part = np.mod(math.copysign(1.0, arc.sweep) * turn, 2.0 * math.pi)
        foot = np.abs(np.hypot(x, y) - arc.radius)
        best = np.where(part < abs(arc.sweep), np.minimum(best, foot), best)
    return best


def dense(p: Polyline, per_segment: int) -> Floats:
    """Points along the path, equal counts in each segment, both its ends among them."""
    part = np.linspace(0.0, 1.0, per_segment)
    return np.concatenate(
        [a + part[:, None] * (b - a) if arc is None else arc.at(part) for a, b, arc in pieces(p)]
    )


def chords(p: Polyline, most_rad: float) -> Floats:
    """The vertices of the path with arcs as chords of at most `most_rad` sweep."""
    points = []
    for a, _, arc in pieces(p):
        count = 1 if arc is None else max(2, math.ceil(abs(arc.sweep) / most_rad))
        part = np.arange(count) / count
        points.append(a[None, :] if arc is None else arc.at(part))
    if not p.closed:
        points.append(p.vertices[-1:, :2])
    return np.concatenate(points)


def sagitta(p: Polyline, most_rad: float) -> float:
    """Greatest distance of the chords from their arcs, mm."""
    radii = [arc.radius for _, _, arc in pieces(p) if arc is not None]
    return max(radii, default=0.0) * (1.0 - math.cos(0.5 * most_rad))


def inside(points: Floats, rings: Sequence[Floats]) -> Bools:
    """Mask of the points (P, 2) in an odd number of the rings of chords."""
    odd = np.zeros(len(points), dtype=np.bool_)
    for ring in rings:
        polygon = shapely.Polygon(ring)
        shapely.prepare(polygon)
        odd ^= shapely.contains_xy(polygon, points[:, 0], points[:, 1])
    return odd


def ccw(p: Polyline) -> bool:
    """True when a closed path turns CCW."""
    ring = chords(p, 0.1)
    following = np.roll(ring, -1, axis=0)
    return bool((ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]).sum() > 0.0)


def near_region(p: Polyline, reach_mm: float, most_rad: float) -> shapely.Geometry:
    """All points up to `reach_mm` from the path: a disc at each vertex and a band along each
    segment, united. (shapely's own buffer simplifies its input first, and is out by per cents
    where many short chords come near the distance.)
    """
    angle = np.arange(0.0, 2.0 * math.pi, most_rad)
    disc = reach_mm * np.column_stack([np.cos(angle), np.sin(angle)])
    parts = [shapely.Polygon(vertex + disc) for vertex in p.vertices[:, :2]]
    for a, b, arc in pieces(p):
        if arc is None:
            along = (b - a) / math.dist(a, b)
            across = reach_mm * np.array([-along[1], along[0]])
            parts.append(shapely.Polygon([a + across, b + across, b - across, a - across]))
            continue
        part = np.linspace(0.0, 1.0, max(2, math.ceil(abs(arc.sweep) / most_rad)))
        hollow = arc.radius - reach_mm
        centre = np.array([[arc.x, arc.y]])
        inner = replace(arc, radius=hollow).at(part) if hollow > 0.0 else centre
        outer = replace(arc, radius=arc.radius + reach_mm).at(part)
        parts.append(shapely.Polygon(np.concatenate([inner, outer[::-1]])))
    return shapely.union_all(parts, grid_size=GRID_MM)


def offset_region(p: Polyline, distance_mm: float, most_rad: float) -> shapely.Geometry:
    """Return the area that the offset of a simple closed path encloses, by shapely."""
    polygon = shapely.Polygon(chords(p, most_rad))
    near = near_region(p, abs(distance_mm), most_rad)
    inward = (distance_mm > 0.0) == ccw(p)
    unite = shapely.difference if inward else shapely.union
    return unite(polygon, near, grid_size=GRID_MM)


def rings(region: shapely.Geometry, least_width: float) -> list[shapely.Geometry]:
    """The rings of a region, outer and inner, without those narrower than that in the mean."""
    parts = [part for part in shapely.get_parts(region) if part.geom_type == "Polygon"]
    every = [ring for part in parts for ring in (part.exterior, *part.interiors)]
    return [r for r in every if 2.0 * shapely.Polygon(r).area > least_width * r.length]


def far_enough(points: Floats, p: Polyline, distance_mm: float, most_rad: float) -> Bools:
    """Mask of the points that the offset of a simple closed path must enclose, by distance alone.

    A positive distance of a CCW path: inside it and far enough from it. Else its complement.
    """
    within = inside(points, [chords(p, most_rad)])
    near = distance(points, p) < abs(distance_mm)
    inward = (distance_mm > 0.0) == ccw(p)
    return within & ~near if inward else within | near


EXACT_MM = 1e-6
"""No point of an offset may be farther than this from the true offset curve."""

CHORD_RAD = 0.05
"""Sweep of the chords that stand for arcs where shapely judges."""


def distance_complaints(results: Sequence[Polyline], p: Polyline, distance_mm: float) -> list[str]:
    """Return the faults of the distance of the results from any source."""
    found = []
    for each in results:
        apart = distance(dense(each, 33), p) - abs(distance_mm)
        if apart.min() < -EXACT_MM:
            found.append(f"{-apart.min()} mm too near")
        if apart.max() > EXACT_MM:
            found.append(f"{apart.max()} mm too far")
    return found


def complaints(
    results: Sequence[Polyline], p: Polyline, distance_mm: float, rng: np.random.Generator
) -> list[str]:
    """Everything that is wrong with the offset of a simple closed path."""
    found = distance_complaints(results, p, distance_mm)
    found += [f"result {i} is open" for i, each in enumerate(results) if not each.closed]
    if found:
        return found
    sag = max(sagitta(each, CHORD_RAD) for each in (p, *results))
    sag += abs(distance_mm) * (1.0 - math.cos(0.5 * CHORD_RAD))
    found += _place_complaints(results, p, distance_mm, sag, rng)
    area = abs(sum(area_of(each) for each in results))
    region = offset_region(p, distance_mm, CHORD_RAD)
    length = sum(length_of(each) for each in (p, *results))
    if abs(area - region.area) > 1e-6 * region.area + length * (2.0 * sag + EXACT_MM):
        found.append(f"area of {area} mm² where shapely has {region.area} mm²")
    return found + _count_complaints(results, p, distance_mm, 4.0 * (sag + EXACT_MM))


def _place_complaints(
    results: Sequence[Polyline],
    p: Polyline,
    distance_mm: float,
    sag: float,
    rng: np.random.Generator,
) -> list[str]:
    """Points all over the place, and close beside the results, that are on the wrong side."""
    source = chords(p, CHORD_RAD)
    low = source.min(axis=0) - 1.1 * abs(distance_mm)
    high = source.max(axis=0) + 1.1 * abs(distance_mm)
    beside = [dense(each, 7) for each in results]
    beside = [b + 0.003 * rng.normal(size=b.shape) * (high - low).max() for b in beside]
    points = np.concatenate([rng.uniform(low, high, (500, 2)), *beside])
    apart = distance(points, p)
    unclear = 2.0 * (sag + EXACT_MM)
    points = points[(np.abs(apart - abs(distance_mm)) > unclear) & (apart > unclear)]
    wanted = far_enough(points, p, distance_mm, CHORD_RAD)
    got = inside(points, [chords(each, CHORD_RAD) for each in results])
    wrong = np.flatnonzero(wanted != got)
    return (
        [f"{len(wrong)} points, {points[wrong[0]]} first, on the wrong side"] if len(wrong) else []
    )


def _count_complaints(
    results: Sequence[Polyline], p: Polyline, distance_mm: float, slack: float
) -> list[str]:
    """A wrong number of rings, where a little more or less distance would not change it."""
    if slack > 0.5 * abs(distance_mm):
        return []
    counts = {
        len(rings(offset_region(p, distance_mm + change, CHORD_RAD), 2.0 * slack))
        for change in (-slack, 0.0, slack)
    }
    wide = [each for each in results if abs(area_of(each)) > slack * length_of(each)]
    if len(counts) == 1 and counts != {len(wide)}:
        return [f"{len(wide)} rings where shapely has {counts}"]
    return []


def area_of(p: Polyline) -> float:
    """Signed area, arcs as arcs: the chords' and r²/2 (sweep − sin sweep) for each arc."""
    total = 0.0
    for a, b, arc in pieces(p):
        total += 0.5 * (a[0] * b[1] - a[1] * b[0])
        if arc is not None:
            total += 0.5 * arc.radius**2 * (arc.sweep - math.sin(arc.sweep))
    return float(total)


def length_of(p: Polyline) -> float:
    return sum(
        math.dist(a, b) if arc is None else arc.radius * abs(arc.sweep) for a, b, arc in pieces(p)
    )
