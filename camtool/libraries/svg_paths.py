"""Paths of svgpathtools, fitted as those of an SVG file: Y runs down in them."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np

from camtool.arrays import Floats
from camtool.errors import DrawingError, OptionError
from camtool.importers.assemble import Found, unit_or_mm
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import Piece
from camtool.importers.svg.reader import CurveFitter
from camtool.importers.svg.shapes import Bezier, Segment, Subpath, SvgLines, arc_between
from camtool.importers.svg.transform import MAX_NUMBER, scaling
from camtool.libraries.read import NO_UNIT


def read(value: Any, name: str, options: ReadOptions) -> Found:
    """Return the subpaths of a Path, or a segment alone: lines and circular arcs are exact.
    DrawingError for numbers that draw nothing, OptionError for other objects."""
    from svgpathtools import Arc, CubicBezier, Line, Path, QuadraticBezier

    units = unit_or_mm(options, NO_UNIT)
    if isinstance(value, Line | QuadraticBezier | CubicBezier | Arc):
        subpaths = [[value]]
    elif isinstance(value, Path):
        subpaths = continuous_parts(value)
    else:
        raise OptionError(
            f"{name} is of type {type(value).__name__} of svgpathtools", mend="give its paths"
        )
    fitter = CurveFitter(options.tolerance_mm)
    to_mm = scaling(units.mm_per_unit, -units.mm_per_unit)
    pieces = []
    for number, segments in enumerate(subpaths, start=1):
        source = f"path {number} of {name}"
        try:
            subpath = Subpath(_point(segments[0].start), tuple(map(_segment, segments)), False)
            vertices, off_mm = fitter.vertices(subpath, to_mm)
        except DrawingError as error:
            raise DrawingError(error.message, file=name, where=f"path {number}") from error
        closed = bool(segments[0].start == segments[-1].end)
        pieces.append(Piece(vertices, closed, "0", "", source, off_mm=off_mm))
    return Found(pieces, units, {"path": len(pieces)} if pieces else {})


def continuous_parts(path: Any) -> list[list[Any]]:
    """Return the segments of a path, a list for each part that is drawn in one stroke."""
    parts: list[list[Any]] = []
    for segment in path:
        if parts and parts[-1][-1].end == segment.start:
            parts[-1].append(segment)
        else:
            parts.append([segment])
    return parts


def _segment(segment: Any) -> Segment:
    """Convert a segment of svgpathtools to the record of SVG path data."""
    from svgpathtools import Arc, Line

    numbers = [segment.start, segment.end]
    if isinstance(segment, Arc):
        numbers += [segment.radius, complex(segment.rotation)]
    elif not isinstance(segment, Line):
        numbers += segment.bpoints()
    for z in map(complex, numbers):
        if not max(abs(z.real), abs(z.imag)) <= MAX_NUMBER or cmath.isnan(z):
            raise DrawingError(f"has the number {z:g}, which is no place")
    if isinstance(segment, Line):
        return SvgLines(_point(segment.end)[None, :])
    if not isinstance(segment, Arc):
        return Bezier(np.array([_point(z) for z in segment.bpoints()[1:]]))
    if segment.start == segment.end or not (segment.radius.real and segment.radius.imag):
        return SvgLines(_point(segment.end)[None, :])
    flags = int(bool(segment.sweep)) | 2 * int(bool(segment.large_arc))
    turn = math.radians(segment.rotation)
    return arc_between(segment.start, segment.end, segment.radius, turn, flags)


def _point(z: complex) -> Floats:
    return np.array([complex(z).real, complex(z).imag])
