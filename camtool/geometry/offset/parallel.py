"""Offsets of single paths, closed or open."""

from __future__ import annotations

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.offset.options import DEFAULT_OPTIONS, OffsetOptions
from camtool.geometry.offset.shape import Stages, is_nothing, offset_shape, shape_stages
from camtool.geometry.offset.stitch import paths_of
from camtool.geometry.polylines import Bools, Ints, Polyline, Polylines
from camtool.geometry.transform import reverse


def offset(
    p: Polyline, distance_mm: float, *, options: OffsetOptions = DEFAULT_OPTIONS
) -> list[Polyline]:
    """The parallel paths at a distance in mm: positive to the left of travel, negative right.

    A closed path gives closed paths, an open one what `offset_open` says; each runs the way of
    its source. The list is empty when the path collapses, and has several when it falls apart.
    Of a path that crosses itself, only parts that close on its own side are given. Distances up
    to POSITION_EPS_MM give the path itself. GeometryError for a distance that is not finite.
    """
    if not p.closed:
        return offset_open(p, distance_mm, options=options)
    if is_nothing(distance_mm):
        return [p]
    if distance_mm < 0.0:
        return [reverse(r) for r in offset(reverse(p), -distance_mm, options=options)]
    return list(offset_shape(Polylines.of([p]), distance_mm, options=options))


def offset_open(
    p: Polyline, distance_mm: float, *, options: OffsetOptions = DEFAULT_OPTIONS
) -> list[Polyline]:
    """What runs parallel on one side of an open path: positive left of travel, negative right.

    Points nearer than the distance to any of the path, its ends too, are left out; nothing is put
    around its ends. A part that closes on itself is a closed path. GeometryError for a closed
    source or a distance that is not finite.
    """
    if p.closed:
        raise GeometryError("a closed path has no ends", mend="use offset()")
    if is_nothing(distance_mm):
        return [p]
    if distance_mm < 0.0:
        return [reverse(r) for r in offset_open(reverse(p), -distance_mm, options=options)]
    around = there_and_back(p)
    stages = offset_stages(around, distance_mm, options=options, both_sides=True)
    elements, kept = stages.trimmed.elements, stages.kept
    around_end = stages.trimmed.join & (stages.trimmed.source == len(p) - 1)
    ahead = (stages.trimmed.source < len(p)) & ~around_end
    runs = [run for loop in stages.loops for run in _runs(loop, ahead[kept.element[loop]])]
    closed = np.array([is_all for _, is_all in runs], dtype=np.bool_)
    return list(paths_of([run for run, _ in runs], closed, kept, elements, options))


def offset_stages(
    p: Polyline, distance_mm: float, *, options: OffsetOptions, both_sides: bool = False
) -> Stages:
    """All stages of the offset of a closed path to the left, by a distance above 0."""
    return shape_stages(Polylines.of([p]), distance_mm, options=options, both_sides=both_sides)


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
