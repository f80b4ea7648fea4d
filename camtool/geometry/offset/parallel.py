"""The stages of an offset in their order."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.intersect import self_crossings
from camtool.geometry.offset.options import OffsetOptions
from camtool.geometry.offset.raw import RawOffset, raw_offset
from camtool.geometry.offset.slices import Slices, slice_elements, valid_slices
from camtool.geometry.offset.stitch import (
    clean_path,
    path_of,
    trace_loops,
    without_dead_ends,
    without_doubles,
)
from camtool.geometry.offset.trim import trim_raw
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Floats, Ints, Polyline, Segments
from camtool.geometry.transform import reverse

DEFAULT_OPTIONS = OffsetOptions()


@dataclass(frozen=True, eq=False)
class Stages:
    """What each stage of one offset to the left gave: to print, to draw, to test."""

    raw: RawOffset
    trimmed: RawOffset
    slices: Slices
    valid: Bools
    kept: Slices
    loops: list[Ints]


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
    if _is_nothing(distance_mm):
        return [p]
    if distance_mm < 0.0:
        return [reverse(r) for r in offset(reverse(p), -distance_mm, options=options)]
    stages = offset_stages(p, distance_mm, options=options)
    elements = stages.trimmed.elements
    found = (path_of(rows, stages.kept, elements, closed=True) for rows in stages.loops)
    return _clean(((vertices, True) for vertices in found), options)


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
    if _is_nothing(distance_mm):
        return [p]
    if distance_mm < 0.0:
        return [reverse(r) for r in offset_open(reverse(p), -distance_mm, options=options)]
    around = there_and_back(p)
    stages = offset_stages(around, distance_mm, options=options, both_sides=True)
    elements, kept = stages.trimmed.elements, stages.kept
    around_end = stages.trimmed.join & (stages.trimmed.source == len(p) - 1)
    ahead = (stages.trimmed.source < len(p)) & ~around_end
    found = [
        (path_of(run, kept, elements, closed=closed), closed)
        for loop in stages.loops
        for run, closed in _runs(loop, ahead[kept.element[loop]])
    ]
    return _clean(found, options)


def offset_stages(
    p: Polyline, distance_mm: float, *, options: OffsetOptions, both_sides: bool = False
) -> Stages:
    """All stages of the offset of a closed path to the left, by a distance above 0.

    `both_sides` says that the left of the path is all there is around it (`there_and_back`).
    """
    raw = raw_offset(p, distance_mm, options)
    trimmed = trim_raw(raw, p, distance_mm, options)
    elements, others = trimmed.elements, None
    # Only where a path meets itself can what is on its right end what is on its left.
    if not both_sides and len(self_crossings(Segments.of(p))):
        right = raw_offset(reverse(p), distance_mm, options)
        others = trim_raw(right, p, distance_mm, options).elements
    slices = slice_elements(elements, others, options)
    valid = valid_slices(slices, elements, p, distance_mm, options)
    kept = without_dead_ends(without_doubles(slices[valid], elements, options))
    return Stages(raw, trimmed, slices, valid, kept, trace_loops(kept, elements))


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


def _clean(found: Iterable[tuple[Floats, bool]], options: OffsetOptions) -> list[Polyline]:
    paths = (clean_path(vertices, closed, options) for vertices, closed in found)
    return [path for path in paths if path is not None]


def _is_nothing(distance_mm: float) -> bool:
    """True for a distance that moves nothing; GeometryError when it is not finite."""
    if not math.isfinite(distance_mm):
        raise GeometryError(f"an offset of {distance_mm} mm is not finite")
    return abs(distance_mm) <= POSITION_EPS_MM
