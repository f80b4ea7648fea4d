"""The stages of an offset in their order, and whole shapes: many closed paths with islands."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.offset.curves import Curves, meets_itself
from camtool.geometry.offset.options import DEFAULT_OPTIONS, OffsetOptions
from camtool.geometry.offset.raw import RawOffset, raw_offset
from camtool.geometry.offset.slices import Slices, slice_elements, valid_slices
from camtool.geometry.offset.stitch import (
    paths_of,
    trace_loops,
    without_dead_ends,
    without_doubles,
)
from camtool.geometry.offset.trim import trim_raw
from camtool.geometry.polylines import POSITION_EPS_MM, Bools, Ints, Polylines, Segments
from camtool.geometry.transform import lines_reversed


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
        grown = offset_shape(lines_reversed(lines), -distance_mm, options=options)
        return lines_reversed(grown)
    stages = shape_stages(lines, distance_mm, options=options)
    closed = np.ones(len(stages.loops), dtype=np.bool_)
    return paths_of(stages.loops, closed, stages.kept, stages.trimmed.elements, options)


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
    source = Curves.of(Segments.of(lines))
    raw = raw_offset(lines, distance_mm, options)
    trimmed = trim_raw(raw, source, distance_mm, options)
    elements, others = trimmed.elements, None
    # Only where paths meet can what is on their right end what is on their left.
    if not both_sides and meets_itself(lines, POSITION_EPS_MM):
        right = raw_offset(lines_reversed(lines), distance_mm, options)
        others = trim_raw(right, source, distance_mm, options).elements
    slices = slice_elements(elements, others, options)
    valid = valid_slices(slices, elements, source, distance_mm, options)
    kept = without_dead_ends(without_doubles(slices[valid], elements, options))
    return Stages(raw, trimmed, slices, valid, kept, trace_loops(kept, elements))


def is_nothing(distance_mm: float) -> bool:
    """True for a distance that moves nothing; GeometryError when it is not finite."""
    if not math.isfinite(distance_mm):
        raise GeometryError(f"an offset of {distance_mm} mm is not finite")
    return abs(distance_mm) <= POSITION_EPS_MM
