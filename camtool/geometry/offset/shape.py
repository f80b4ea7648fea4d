"""The stages of an offset in their order, and whole shapes: many closed paths with islands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from camtool.errors import GeometryError
from camtool.geometry.offset.curves import meets_itself
from camtool.geometry.offset.near import Near
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
from camtool.geometry.offset.way import Way, is_nothing, limit_of
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
    lines: Polylines,
    distance_mm: float,
    *,
    joins: str = "round",
    mitre_limit: float = 2.0,
    options: OffsetOptions = DEFAULT_OPTIONS,
) -> Polylines:
    """The boundary of a region shrunk by a distance in mm, or grown by one below 0.

    The region lies on the left of its closed paths: outer ones run CCW, holes CW (`oriented`). So
    do those of the result. Islands merge, split and vanish. Loops come in the order of the first
    source segment that each of them runs along. Distances up to POSITION_EPS_MM give the paths
    themselves. For `joins` see `offset`. GeometryError for an open path and for a distance that
    is not finite, OptionError for joins that do not exist.
    """
    limit = limit_of(joins, mitre_limit)
    if not lines.closed.all():
        where = f"path {np.argmin(lines.closed)}"
        mend = "close it, or use offset_open()"
        raise GeometryError("an open path has no inside", where=where, mend=mend)
    if is_nothing(distance_mm) or len(lines) == 0:
        return lines
    way = Way(abs(float(distance_mm)), limit, options=options)
    if distance_mm < 0.0:
        return lines_reversed(_left_of(lines_reversed(lines), way))
    return _left_of(lines, way)


def _left_of(lines: Polylines, way: Way) -> Polylines:
    stages = shape_stages(lines, way)
    closed = np.ones(len(stages.loops), dtype=np.bool_)
    elements = stages.trimmed.elements
    return paths_of(stages.loops, closed, stages.kept, elements, way.options)


def shape_stages(lines: Polylines, way: Way) -> Stages:
    """All stages of the offset of closed paths to the left."""
    source, options = Segments.of(lines), way.options
    raw = raw_offset(lines, way)
    near = Near.of(source, raw.kites)
    trimmed = trim_raw(raw, near, way)
    elements, others = trimmed.elements, None
    # Only where paths meet can what is on their right end what is on their left.
    if not way.both_sides and meets_itself(lines, POSITION_EPS_MM):
        right = raw_offset(lines_reversed(lines), replace(way, limit=math.inf))
        others = trim_raw(right, near, way).elements
    slices = slice_elements(elements, others, options)
    valid = valid_slices(slices, elements, near, way)
    kept = without_dead_ends(without_doubles(slices[valid], elements, options))
    return Stages(raw, trimmed, slices, valid, kept, trace_loops(kept, elements))
