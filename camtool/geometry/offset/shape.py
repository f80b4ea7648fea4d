"""The stages of an offset in their order, and whole shapes: many closed paths with islands."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from camtool.errors import GeometryError
from camtool.geometry.intersect import self_crossings
from camtool.geometry.offset.options import DEFAULT_OPTIONS, OffsetOptions
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
from camtool.geometry.polylines import (
    POSITION_EPS_MM,
    Bools,
    Floats,
    Ints,
    Polyline,
    Polylines,
    Segments,
)
from camtool.geometry.transform import reverse


@dataclass(frozen=True, eq=False)
class Stages:
    """What each stage of one offset to the left gave: to print, to draw, to test."""

    raw: RawOffset
    trimmed: RawOffset
    slices: Slices
    valid: Bools
    kept: Slices
    loops: list[Ints]


def offset_shape(
    lines: Polylines, distance_mm: float, *, options: OffsetOptions = DEFAULT_OPTIONS
) -> Polylines:
    """The boundary of a region shrunk by a distance in mm, or grown by one below 0.

    The region lies on the left of its closed paths: outer ones run CCW, holes CW (`oriented`). So
    do those of the result. Islands merge, split and vanish. Loops come in the order of the first
    source segment that each of them runs along. Distances up to POSITION_EPS_MM give the paths
    themselves. GeometryError for an open path and for a distance that is not finite.
    """
    if not lines.closed.all():
        raise GeometryError("an open path has no inside", mend="close it, or use offset_open()")
    if is_nothing(distance_mm) or len(lines) == 0:
        return lines
    if distance_mm < 0.0:
        grown = offset_shape(_reversed(lines), -distance_mm, options=options)
        return _reversed(grown)
    stages = shape_stages(lines, distance_mm, options=options)
    elements = stages.trimmed.elements
    found = (path_of(rows, stages.kept, elements, closed=True) for rows in stages.loops)
    return Polylines.of(cleaned(((vertices, True) for vertices in found), options))


def shape_stages(
    lines: Polylines,
    distance_mm: float,
    *,
    options: OffsetOptions = DEFAULT_OPTIONS,
    both_sides: bool = False,
) -> Stages:
    """All stages of the offset of closed paths to the left, by a distance above 0.

    `both_sides` says that the left of the paths is all there is around them (`there_and_back`).
    """
    raw = raw_offset(lines, distance_mm, options)
    trimmed = trim_raw(raw, lines, distance_mm, options)
    elements, others = trimmed.elements, None
    # Only where paths meet can what is on their right end what is on their left.
    if not both_sides and len(self_crossings(Segments.of(lines))):
        back = _reversed(lines)
        right = raw_offset(back, distance_mm, options)
        others = trim_raw(right, back, distance_mm, options).elements
    slices = slice_elements(elements, others, options)
    valid = valid_slices(slices, elements, lines, distance_mm, options)
    kept = without_dead_ends(without_doubles(slices[valid], elements, options))
    loops = sorted(trace_loops(kept, elements), key=lambda rows: int(rows.min()))
    return Stages(raw, trimmed, slices, valid, kept, loops)


def _reversed(lines: Polylines) -> Polylines:
    return Polylines.of([reverse(p) for p in lines])


def cleaned(found: Iterable[tuple[Floats, bool]], options: OffsetOptions) -> list[Polyline]:
    """The clean paths of vertices, each with whether it is closed, that have any substance."""
    paths = (clean_path(vertices, closed, options) for vertices, closed in found)
    return [path for path in paths if path is not None]


def is_nothing(distance_mm: float) -> bool:
    """True for a distance that moves nothing; GeometryError when it is not finite."""
    if not math.isfinite(distance_mm):
        raise GeometryError(f"an offset of {distance_mm} mm is not finite")
    return abs(distance_mm) <= POSITION_EPS_MM
