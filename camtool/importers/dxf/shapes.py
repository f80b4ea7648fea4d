"""One DXF entity to paths in mm: lines and circles exact, all other curves fitted."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from camtool.geometry.fit import EllipseCurve, arc_vertices, split_bulges
from camtool.geometry.polylines import Floats, Segments
from camtool.importers.dxf.frames import (
    Frame,
    Plane,
    Shape,
    Unusable,
    fitted,
    numbers,
    require,
    straight,
)

__all__ = [
    "Frame",
    "Plane",
    "Reader",
    "Shape",
    "Unusable",
    "arc",
    "bulged",
    "circle",
    "ellipse",
    "elliptic",
    "line",
    "lwpolyline",
    "polyline",
    "require",
]

FULL_TURN_RAD = 1e-6
"""An ellipse that lacks less than this of a full turn is closed (files round to 6 digits)."""

WIDTH = "the width of a line (its middle is the path)"
"""What a polyline with a width lacks afterwards."""

_FRAME_VERTEX = 16  # flag of a vertex that only steers a splined POLYLINE

Reader = Callable[[Any, Frame, float], Sequence[Shape]]
"""From entity, frame and tolerance (mm). Raises Unusable, and DrawingError (without file and
place) for numbers that are none."""


def line(entity: Any, frame: Frame, _tolerance_mm: float) -> list[Shape]:
    """LINE."""
    require(entity, ("start", "end"))
    ends = numbers([tuple(entity.dxf.start), tuple(entity.dxf.end)])
    return [Shape(straight(frame.flat(ends)), closed=False)]


def circle(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """CIRCLE."""
    require(entity, ("center", "radius"))
    return [_round(entity, frame, tolerance_mm, 0.0, 2.0 * math.pi)]


def arc(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """ARC, counter-clockwise from its start."""
    require(entity, ("center", "radius", "start_angle", "end_angle"))
    start, end = numbers((entity.dxf.start_angle, entity.dxf.end_angle)).tolist()
    sweep = (end - start) % 360.0 or 360.0
    return [_round(entity, frame, tolerance_mm, math.radians(start), math.radians(sweep))]


def _round(entity: Any, frame: Frame, tolerance_mm: float, start: float, sweep: float) -> Shape:
    """A circle or an arc."""
    dxf = entity.dxf
    x, y, z, radius = numbers((*dxf.center, dxf.radius)).tolist()
    if radius <= 0.0:
        raise Unusable(f"has a radius of {radius:g}")
    plane = frame.plane(dxf.extrusion, z)
    return round_in(plane, (x, y, radius), start, sweep, tolerance_mm)


def round_in(
    plane: Plane, of: tuple[float, float, float], start: float, sweep: float, tolerance_mm: float
) -> Shape:
    """Circle or arc of a centre and a radius (x, y, r) in a plane; angles in rad, either way."""
    x, y, radius = of
    centre = plane.origin + x * plane.u + y * plane.v
    if not plane.scale:
        axes = np.array([centre, radius * plane.u, radius * plane.v])
        return elliptic(axes, start, sweep, tolerance_mm)
    closed = abs(sweep) == 2.0 * math.pi
    turn, sweep = plane.turn + plane.sign * start, plane.sign * sweep
    vertices = arc_vertices(centre, plane.scale * radius, turn, sweep)
    return Shape(vertices[:-1] if closed else vertices, closed)


def ellipse(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """ELLIPSE."""
    require(entity, ("center", "major_axis", "ratio"))
    dxf = entity.dxf
    centre, major, normal = (numbers(v) for v in (dxf.center, dxf.major_axis, dxf.extrusion))
    ratio, start, end = numbers((dxf.ratio, dxf.start_param, dxf.end_param)).tolist()
    length = math.hypot(*normal)
    if length == 0.0:
        raise Unusable("has an extrusion of 0")
    minor = ratio * np.cross(normal / length, major)
    plane = Plane.of(
        major @ frame.linear, minor @ frame.linear, centre @ frame.linear + frame.offset
    )
    sweep = whole_turn(end - start)
    return [elliptic(np.array([plane.origin, plane.u, plane.v]), start, sweep, tolerance_mm)]


def whole_turn(sweep: float) -> float:
    """A sweep within one turn, and exactly one turn when it all but is."""
    sweep %= 2.0 * math.pi
    nearly = sweep <= FULL_TURN_RAD or sweep >= 2.0 * math.pi - FULL_TURN_RAD
    return 2.0 * math.pi if nearly else sweep


def elliptic(axes: Floats, start: float, sweep: float, tolerance_mm: float) -> Shape:
    """Centre and half axes (3, 2): circles and arcs of them exactly, ellipses fitted."""
    centre, u, v = axes
    closed = abs(sweep) == 2.0 * math.pi
    plane = Plane.of(np.append(u, 0.0), np.append(v, 0.0), np.append(centre, 0.0))
    if plane.scale:
        turn = plane.turn + plane.sign * start
        shape = Shape(arc_vertices(centre, plane.scale, turn, plane.sign * sweep), False)
    else:
        curve = EllipseCurve(centre, u, v, start, start + sweep)
        shape = Shape.of(fitted(curve, axes, tolerance_mm))
    return shape.ring() if closed else shape


def lwpolyline(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """LWPOLYLINE."""
    dxf = entity.dxf
    rows = numbers(entity.lwpoints.values).reshape(-1, 5)
    plane = frame.plane(dxf.extrusion, float(numbers((dxf.get("elevation", 0.0),))[0]))
    wide = rows[:, 2:4].any() or bool(dxf.get("const_width", 0.0))
    shape = bulged(rows[:, (0, 1, 4)], bool(entity.closed), plane, tolerance_mm)
    return [_with_width(shape) if wide else shape]


def polyline(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """POLYLINE of one line, flat or in space."""
    if entity.get_mode() not in ("AcDb2dPolyline", "AcDb3dPolyline"):
        raise Unusable("is a mesh")
    for vertex in entity.vertices:
        require(vertex, ("location",))
    corners = [v.dxf for v in entity.vertices if not int(v.dxf.flags) & _FRAME_VERTEX]
    points = numbers([tuple(corner.location) for corner in corners]).reshape(-1, 3)
    if len(points) == 0:
        raise Unusable("has no vertices")
    closed = bool(entity.is_closed)
    if entity.get_mode() == "AcDb3dPolyline":
        return [Shape(straight(frame.flat(points)), closed)]
    bulges = numbers([corner.get("bulge", 0.0) for corner in corners])
    elevation = float(points[0, 2])
    if entity.dxf.hasattr("elevation"):
        elevation = float(numbers(entity.dxf.elevation)[2])
    plane = frame.plane(entity.dxf.extrusion, elevation)
    shape = bulged(np.column_stack([points[:, :2], bulges]), closed, plane, tolerance_mm)
    widths = [part.get(f"{end}_width", 0.0) for part in corners for end in ("start", "end")]
    widths += [entity.dxf.get(f"default_{end}_width", 0.0) for end in ("start", "end")]
    return [_with_width(shape) if any(widths) else shape]


def _with_width(shape: Shape) -> Shape:
    return replace(shape, lacks=WIDTH)


def bulged(local: Floats, closed: bool, plane: Plane, tolerance_mm: float) -> Shape:
    """A polyline (n, 3) of x, y, bulge in its own plane: exact, or its arcs fitted where the plane
    squeezes circles."""
    if len(local) == 0:
        raise Unusable("has no vertices")
    rows = np.empty(local.shape)
    rows[:, :2] = plane.points(local)
    rows[:, 2] = plane.sign * local[:, 2]
    if plane.scale or not local[:, 2].any():
        return Shape(split_bulges(rows, closed), closed)
    following = np.roll(local, -1, axis=0)[:, :2]
    arcs = Segments.between(local[:, :2], following, local[:, 2])
    is_arc = arcs.is_arc & (local[:, :2] != following).any(axis=1)
    if not closed:
        is_arc[-1] = False
    parts: list[Floats] = []
    off: list[Floats] = []
    for k, row in enumerate(rows):
        if is_arc[k]:
            centre = plane.points(arcs.centre[k : k + 1])[0]
            u, v = arcs.radius[k] * plane.u, arcs.radius[k] * plane.v
            ends = float(arcs.start_angle[k]), float(arcs.start_angle[k] + arcs.sweep[k])
            curve = EllipseCurve(centre, u, v, *ends)
            fit = fitted(curve, np.array([centre, u, v]), tolerance_mm)
            parts.append(fit.vertices[:-1])
            off.append(fit.off_mm[:-1])
        else:
            parts.append(np.array([[row[0], row[1], 0.0]]))
            off.append(np.zeros((1, 2)))
    return Shape(np.concatenate(parts), closed, np.concatenate(off))
