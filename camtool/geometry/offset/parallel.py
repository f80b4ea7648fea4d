"""Offsets of single paths, closed or open."""

from __future__ import annotations

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.offset.options import DEFAULT_OPTIONS, OffsetOptions
from camtool.geometry.offset.shape import offset_shape, shape_stages
from camtool.geometry.offset.stitch import paths_of
from camtool.geometry.offset.way import Way, is_nothing, limit_of
from camtool.geometry.polylines import Bools, Ints, Polyline, Polylines
from camtool.geometry.transform import reverse


def offset(
    p: Polyline,
    distance_mm: float,
    *,
    joins: str = "round",
    mitre_limit: float = 2.0,
    options: OffsetOptions = DEFAULT_OPTIONS,
) -> list[Polyline]:
    """The parallel paths at a distance in mm: positive to the left of travel, negative right.

    A closed path gives closed paths, an open one what `offset_open` says; each runs the way of
    its source. The list is empty when the path collapses, and has several when it falls apart.
    Of a path that crosses itself, only parts that close on its own side are given. Distances up
    to POSITION_EPS_MM give the path itself.

    `joins` says what is about outer corners: "round" arcs at the distance; "mitre", tangents that
    go on until they meet, cut off at `mitre_limit` times the distance from the corner; or
    "sharp", a mitre of any length (up to SHARP_LIMIT).

    GeometryError for a distance that is not finite, OptionError for joins that do not exist and a
    mitre limit below 1.
    """
    if not p.closed:
        return offset_open(p, distance_mm, joins=joins, mitre_limit=mitre_limit, options=options)
    lines = Polylines.of([p])
    found = offset_shape(lines, distance_mm, joins=joins, mitre_limit=mitre_limit, options=options)
    return [p] if found is lines else list(found)


def offset_open(
    p: Polyline,
    distance_mm: float,
    *,
    joins: str = "round",
    mitre_limit: float = 2.0,
    options: OffsetOptions = DEFAULT_OPTIONS,
) -> list[Polyline]:
    """What runs parallel on one side of an open path: positive left of travel, negative right.

    Points nearer than the distance to any of the path, its ends too, are left out; nothing is put
    around its ends. A part that closes on itself is a closed path. For `joins` see `offset`.
    GeometryError for a closed source or a distance that is not finite.
    """
    if p.closed:
        raise GeometryError("a closed path has no ends", mend="use offset()")
    limit = limit_of(joins, mitre_limit)
    if is_nothing(distance_mm):
        return [p]
    way = Way(abs(float(distance_mm)), limit, both_sides=True, options=options)
    if distance_mm < 0.0:
        return [reverse(r) for r in _left_of(reverse(p), way)]
    return list(_left_of(p, way))


def _left_of(p: Polyline, way: Way) -> Polylines:
    stages = shape_stages(Polylines.of([there_and_back(p)]), way)
    elements, kept = stages.trimmed.elements, stages.kept
    around_end = stages.trimmed.join & (stages.trimmed.source == len(p) - 1)
    ahead = (stages.trimmed.source < len(p)) & ~around_end
    runs = [run for loop in stages.loops for run in _runs(loop, ahead[kept.element[loop]])]
    closed = np.array([is_all for _, is_all in runs], dtype=np.bool_)
    return paths_of([run for run, _ in runs], closed, kept, elements, way.options)


def there_and_back(p: Polyline) -> Polyline:
    """An open path and its way back as one closed path: its left is both sides of the path."""
    return Polyline(np.concatenate([p.vertices[:-1], reverse(p).vertices[:-1]]), closed=True)


def _runs(loop: Ints, ahead: Bools) -> list[tuple[Ints, bool]]:
    """The stretches of a loop that are `ahead`, in order, each with whether it is all of it."""
    if ahead.all():
        return [(loop, True)]
    begin = int(np.argmin(ahead))
    loop, ahead = np.roll(loop, -begin), np.roll(ahead, -begin)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], ahead.astype(np.int64), [0]])))
    return [(loop[low:high], False) for low, high in zip(edges[::2], edges[1::2], strict=True)]
