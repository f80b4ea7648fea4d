"""Obvious oracle of a pocket: discs put down along the moves, and regions of fine chords.

Arcs are chords here; nothing of camtool is used beyond the records.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import shapely

from camtool.arrays import Bools, Floats
from camtool.geometry.polylines import Polyline, Polylines
from camtool.planning.items import CutRun
from tests.oracles.offset import GRID_MM, chords, dense, distance, inside, near_region, pieces

CHORD_RAD = 0.05
"""Sweep of the chords that stand for the edges of discs, at first."""

FINE_CHORD_RAD = 0.015
"""The same where it decides what can be reached."""

FLAT = 1e-4
"""Greatest distance of chords of moves from their arcs, over the tool's radius."""

PLACES, LATTICE_RAD = 30_000, 0.4
"""Places of the lattice within the region, and its turn."""

SAG = 2e-5
"""How far the chords that stand for arcs of a drawing are from them, over its size."""


def at_depth(runs: Sequence[CutRun], z: float) -> list[Polyline]:
    """The stretches of the runs at one height, seen from above."""
    found = []
    for run in runs:
        level = np.abs(run.vertices[:, 2] - z) < 1e-9
        edges = np.flatnonzero(np.diff(np.concatenate([[0], level.astype(int), [0]])))
        for low, high in zip(edges[::2], edges[1::2], strict=True):
            rows = _moving(run.vertices[low:high, [0, 1, 3]])
            if len(rows) > 1:
                found.append(Polyline(rows))
    return found


def _moving(rows: Floats) -> Floats:
    """Vertices (k, 3) without those from where nothing moves in XY."""
    step = np.hypot(*np.diff(rows[:, :2], axis=0).T)
    return rows[np.concatenate([step > 1e-6, [True]])]


def area_of(region: Polylines) -> shapely.Geometry:
    """Return the area inside an odd number of the closed paths."""
    size = float(np.ptp(region.vertices[:, :2], axis=0).max())
    area = shapely.Polygon()
    for path in region:
        ring = shapely.make_valid(shapely.Polygon(_chords(path, SAG * size)))
        area = shapely.symmetric_difference(area, ring, grid_size=GRID_MM)
    return area


def _chords(path: Polyline, sag_mm: float) -> Floats:
    """The points of a path, with chords no farther than that from their arcs."""
    points = []
    for start, _, arc in pieces(path):
        if arc is None:
            points.append(start[None, :])
            continue
        most_rad = min(math.sqrt(8.0 * sag_mm / arc.radius), 0.5)
        count = max(2, math.ceil(abs(arc.sweep) / most_rad))
        points.append(arc.at(np.arange(count) / count))
    if not path.closed:
        points.append(path.vertices[-1:, :2])
    return np.concatenate(points)


def swept(
    paths: Sequence[Polyline], radius_mm: float, most_rad: float, sag: float = SAG
) -> shapely.Geometry:
    """Return the area that a disc covers along the paths, by chords of a sweep that are no farther
    from large arcs than a share (`sag`) of the size of their path."""
    parts = [near_region(_divided(path, most_rad, sag), radius_mm, most_rad) for path in paths]
    return shapely.union_all(parts, grid_size=GRID_MM)


def _divided(path: Polyline, most_rad: float, sag: float) -> Polyline:
    """The path with its large arcs divided, so that chords of a sweep are near to them too."""
    size = float(np.ptp(path.vertices[:, :2], axis=0).max())
    rows: list[Floats] = []
    for start, _, arc in pieces(path):
        count = 1
        if arc is not None and abs(arc.sweep) > 1e-6:
            fine_rad = math.sqrt(8.0 * sag * size / arc.radius)
            count = 1 if fine_rad > most_rad else math.ceil(abs(arc.sweep) / fine_rad)
        part = np.arange(count) / count
        points = start[None, :] if arc is None or count == 1 else arc.at(part)
        bulge = 0.0 if arc is None else math.tan(0.25 * arc.sweep / count)
        rows += [np.array([*point, bulge]) for point in points]
    if not path.closed:
        rows.append(path.vertices[-1])
    return Polyline(np.array(rows), path.closed)


def opened(area: shapely.Geometry, radius_mm: float, most_rad: float) -> shapely.Geometry:
    """Return the union of all discs that lie wholly in an area."""
    near = swept(_boundary(area), radius_mm, most_rad)
    middle = shapely.difference(area, near, grid_size=GRID_MM)
    around = swept(_boundary(middle), radius_mm, most_rad)
    return shapely.union(middle, around, grid_size=GRID_MM)


def _boundary(area: shapely.Geometry) -> list[Polyline]:
    rings = [
        ring
        for part in shapely.get_parts(area)
        if part.geom_type == "Polygon"
        for ring in (part.exterior, *part.interiors)
    ]
    found = []
    for ring in rings:
        points = shapely.get_coordinates(ring)[:-1]
        step = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
        points = points[step > 1e-6]
        if len(points) > 2:
            found.append(Polyline(np.column_stack([points, np.zeros(len(points))]), True))
    return found


def complaints(
    runs: Sequence[CutRun], region: Polylines, radius_mm: float, z: float, *, share: float = 1e-3
) -> list[str]:
    """Return the faults of runs that must clear a region down to z with a tool of this radius.

    Places of a lattice are counted: a disc covers those that are nearer than its radius to the
    moves, and can reach those that are as near to where its centre has room.
    """
    area = area_of(region)
    near = swept(_boundary(area), radius_mm, FINE_CHORD_RAD)
    room = shapely.difference(area, near, grid_size=GRID_MM)
    lines = [_chords(path, FLAT * radius_mm) for path in at_depth(runs, z)]
    moves = shapely.multilinestrings([shapely.linestrings(line) for line in lines])
    places = _places(area, radius_mm)
    wanted, got = _within(room, places, radius_mm), _within(moves, places, radius_mm)
    missed, beyond = (wanted & ~got).sum(), (got & ~wanted).sum()
    found: list[str] = []
    if missed > share * wanted.sum():
        found.append(f"{missed} of {wanted.sum()} places left over")
    if beyond > share * wanted.sum():
        found.append(f"{beyond} places cut beyond {wanted.sum()}")
    return found + gouges(runs, region, radius_mm)


def _places(area: shapely.Geometry, margin_mm: float) -> Floats:
    """Points (P, 2) of a lattice over an area and about it, turned so that no edge of a drawing
    runs along it."""
    left, low, right, high = area.buffer(margin_mm).bounds
    step, size = math.sqrt(area.area / PLACES), max(right - left, high - low)
    line = np.arange(-size, size, step)
    x, y = (each.ravel() for each in np.meshgrid(line, line))
    cosine, sine = math.cos(LATTICE_RAD), math.sin(LATTICE_RAD)
    x, y = cosine * x - sine * y + 0.5 * (left + right), sine * x + cosine * y + 0.5 * (low + high)
    is_near = (left < x) & (x < right) & (low < y) & (y < high)
    return np.column_stack([x[is_near], y[is_near]])


def _within(shape: shapely.Geometry, places: Floats, radius_mm: float) -> Bools:
    """Mask of the places that are nearer to a shape than that."""
    shapely.prepare(shape)
    return np.asarray(shapely.dwithin(shape, shapely.points(places), radius_mm))


def gouges(runs: Sequence[CutRun], region: Polylines, radius_mm: float) -> list[str]:
    """Largest amount by which the tool is nearer to the region's boundary than its radius."""
    found = []
    for run in runs:
        rows = _moving(run.vertices[:, [0, 1, 3]])
        points = dense(Polyline(rows), 9) if len(rows) > 1 else rows[:, :2]
        apart = np.min([distance(points, path) for path in region], axis=0)
        if apart.min() < radius_mm - 1e-5:
            found.append(f"{radius_mm - apart.min()} mm into the wall")
        rings = [chords(path, 1e-3 * math.pi) for path in region]
        clear = apart > 1e-3
        if not inside(points[clear], rings).all():
            found.append("outside of the region")
    return found
