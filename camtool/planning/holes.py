"""Holes: full circles and single points of a drawing, and pecks down at a place."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats
from camtool.geometry.measure import path_extents, sample
from camtool.geometry.polylines import Polyline, Polylines, Segments
from camtool.planning.items import RAPID, Chosen, Setting
from camtool.planning.job import Operation, refuse_endless
from camtool.planning.naming import key_of

ROUND_SHARE = 1e-3
"""A closed path is a circle when its points are off the mean radius by no more than this share
of it, or `ROUND_MM` if that is more."""

ROUND_MM = 5e-3
"""A closed path is a circle when its points are off the mean radius by no more than this."""

SAMPLES_ROUND = 64.0
"""At least this many points of a path are examined to see whether it is a circle."""

SAME_HOLE_MM = 1e-2

HOLE_SIZE_MM = 1e-2
"""A circle fits a drill when their diameters differ by no more than this."""

PECK_TOP_MM = 0.5
"""Between two pecks the drill comes up to this height above the stock, or to safe z if lower."""

PECK_CLEARANCE_MM = 0.2
"""A drill returns as a rapid to this height above the last depth, or to half a peck if lower."""

PECK_SHARE = 1e-9
"""A last peck shorter than this share of the others is left out."""

MOVES_OF_PECK = 3
"""Number of moves of a peck: down, out, and back to just above."""

NAMES_SHOWN = 3


class Hole(Struct, frozen=True):
    """A place (x, y) mm to drill; `diameter_mm` of its circle, None for a mark; `source`, the
    index of its path in the placed drawing, −1 for a mark."""

    at_mm: tuple[float, float]
    diameter_mm: float | None
    name: str
    source: int = -1
    outline: Polyline | None = None


def refuse_endless_pecks(
    depth_mm: float, peck_mm: float, holes: Sequence[Hole], operation: Operation
) -> None:
    """Raise OptionError for pecks so small that the holes take too many moves; the pecks of a bore
    follow from its step down."""
    key = "peck" if operation.contract.descent == "pecks" else "step_down"
    refuse_endless(
        MOVES_OF_PECK * depth_mm / peck_mm * len(holes),
        key_of(operation, key),
        f"{len(holes)} holes in pecks of {peck_mm:g} mm",
        f"give a larger {key}",
        is_long=operation.may_be_long,
    )


def circle_of(path: Polyline) -> tuple[tuple[float, float], float] | None:
    """Return the centre (x, y) and the diameter, mm, of a closed path that is a full circle; None
    for another path."""
    if not path.closed:
        return None
    (xmin, xmax), (ymin, ymax) = _box(path)
    centre = (0.5 * (xmin + xmax), 0.5 * (ymin + ymax))
    radius = 0.25 * (xmax - xmin + ymax - ymin)
    segments = Segments.of(path)
    points = sample(path, 2.0 * math.pi * radius / SAMPLES_ROUND)
    deviation = np.abs(np.hypot(*(points - centre).T) - radius).max()
    round_enough = deviation <= max(ROUND_MM, ROUND_SHARE * radius) and deviation < 0.5 * radius
    once_round = bool(segments.is_arc.all()) and _turns_once(segments.sweep)
    return (centre, 2.0 * radius) if round_enough and once_round else None


def _turns_once(sweep: Floats) -> bool:
    """Return True if arcs of these sweeps make exactly one full turn, all in one direction."""
    one_way = bool((sweep > 0.0).all() or (sweep < 0.0).all())
    return one_way and round(abs(float(sweep.sum())) / (2.0 * math.pi)) == 1


def _box(path: Polyline) -> list[list[float]]:
    box: list[list[float]] = path_extents(Polylines.of([path]))[0].tolist()
    return box


def each_once(holes: list[Hole], drill_mm: float) -> list[Hole]:
    """Return the holes in their order, with one for each place: circles before marks, and of
    several circles the one whose diameter is nearest to the drill's."""

    def misfit(index: int) -> tuple[float, int]:
        diameter = holes[index].diameter_mm
        return (math.inf if diameter is None else abs(diameter - drill_mm), index)

    places = np.array([hole.at_mm for hole in holes]).reshape(-1, 2)
    is_taken: Bools = np.zeros(len(holes), dtype=np.bool_)
    kept_rows: list[int] = []
    for index in sorted(range(len(holes)), key=misfit):
        if is_taken[index]:
            continue
        kept_rows.append(index)
        is_taken |= np.hypot(*(places - places[index]).T) <= SAME_HOLE_MM
    return [holes[index] for index in sorted(kept_rows)]


def peck_depths(depth_mm: float, peck_mm: float | None) -> list[float]:
    """Return the depths, mm below the stock top, at which the drill turns back: equal steps of at
    most `peck_mm`, the last at the full depth. ValueError for a depth that is not above 0."""
    if not depth_mm > 0.0:
        raise ValueError(f"a hole {depth_mm} mm deep")
    peck_size = depth_mm if peck_mm is None else peck_mm
    count = max(1, math.ceil(depth_mm / peck_size - PECK_SHARE))
    return [depth_mm * ((step + 1) / count) for step in range(count)]


def pecks(
    at_mm: tuple[float, float], depths: Sequence[float], setting: Setting
) -> tuple[Floats, list[float]]:
    """Return the vertices (n, 4) of drilling at a place, and the feeds between them: a peck at the
    plunge feed, out as a rapid, back as a rapid to just above it, and so on."""
    top = min(PECK_TOP_MM, setting.safe_z_mm)
    above = min(PECK_CLEARANCE_MM, 0.5 * depths[0])
    heights, feeds = [-depths[0]], list[float]()
    for last, depth in pairwise(depths):
        heights += [top, above - last, -depth]
        feeds += [RAPID, RAPID, setting.feeds.plunge_mm_min]
    return np.array([(*at_mm, z, 0.0) for z in heights]), feeds


def circles_of(chosen: Chosen) -> tuple[list[Hole], list[str]]:
    """Return the full circles among the paths, and the names of all other paths."""
    holes, other_names = [], []
    for path, source, name in zip(chosen.lines, chosen.source, chosen.names, strict=True):
        circle = circle_of(path)
        if circle is None:
            other_names.append(name)
        else:
            holes.append(Hole(*circle, name, int(source), path))
    return holes, other_names


def largest_hole_mm(operation: Operation) -> float:
    """Return the largest diameter of circles that an operation drills, mm; inf for a drill without
    width, and for a kind that has no key `max_hole`."""
    if "max_hole" not in operation.contract.keys:
        return math.inf
    if operation.max_hole_mm is not None:
        return operation.max_hole_mm
    return operation.tool.diameter_mm or math.inf


def drilled_holes(
    chosen: Chosen, operation: Operation
) -> tuple[list[Hole], list[Hole], list[str]]:
    """Return the holes that an operation drills, one for each place; the circles that are too
    large for it; and the names of paths that are no circles."""
    circles, other_names = circles_of(chosen)
    limit = largest_hole_mm(operation) + HOLE_SIZE_MM
    small_circles = [hole for hole in circles if (hole.diameter_mm or 0.0) <= limit]
    large = [hole for hole in circles if (hole.diameter_mm or 0.0) > limit]
    marks = [
        Hole((float(x), float(y)), None, name)
        for (x, y), name in zip(chosen.points, chosen.point_names, strict=True)
    ]
    return each_once([*marks, *small_circles], operation.tool.diameter_mm), large, other_names


def named(names: list[str]) -> str:
    """Return the first few names as text, and the number of the others."""
    extra = len(names) - NAMES_SHOWN
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {extra} more" if extra > 0 else "")
