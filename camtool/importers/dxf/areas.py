"""HATCH, MPOLYGON, SOLID, TRACE and 3DFACE of DXF drawings: the outlines of areas, in mm."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np

from camtool.importers.dxf.curves import spline_of, through
from camtool.importers.dxf.frames import (
    Frame,
    Plane,
    Shape,
    Unusable,
    numbers,
    require,
    straight,
)
from camtool.importers.dxf.shapes import bulged, elliptic, round_in, whole_turn

_TEXT_BOX = 8  # flag of a boundary path that keeps a hatch off a text
_CORNERS = ("vtx0", "vtx1", "vtx2", "vtx3")
_DRAWN_ORDER = (0, 1, 3, 2)  # SOLID and TRACE keep their corners in the order of the letter Z


def hatch(entity: Any, frame: Frame, tolerance_mm: float) -> list[Shape]:
    """The boundary paths of HATCH and MPOLYGON; edges of one path come as paths of their own.

    A boundary that follows other entities of the drawing is left to them.
    """
    elevation = float(numbers(entity.dxf.elevation)[2])
    plane = frame.plane(entity.dxf.extrusion, elevation)
    paths = [path for path in entity.paths if not path.path_type_flags & _TEXT_BOX]
    if not paths:
        raise Unusable("has no outline")
    own = [path for path in paths if not _follows(path, entity)]
    if not own:
        raise Unusable("has the outline of other entities, which are read")
    shapes: list[Shape] = []
    for path in own:
        if hasattr(path, "edges"):
            shapes.extend(_edge(edge, plane, tolerance_mm) for edge in path.edges)
        else:
            rows = numbers(path.vertices).reshape(-1, 3)
            # Whether the file says so or not: the outline of an area is closed.
            shapes.append(bulged(rows, True, plane, tolerance_mm))
    return shapes


def _follows(path: Any, entity: Any) -> bool:
    """Whether entities that the drawing holds are the sources of this path."""
    handles = path.source_boundary_objects
    database = entity.doc.entitydb if entity.doc is not None else {}
    if not (handles and entity.dxf.get("associative", 0)):
        return False
    return all(_stands_beside(database.get(handle), entity) for handle in handles)


def _stands_beside(source: Any, entity: Any) -> bool:
    """Whether `source` is a line or a curve of the same layout or block."""
    return source is not None and source.dxf.get("owner") == entity.dxf.get("owner")


def _edge(edge: Any, plane: Plane, tolerance_mm: float) -> Shape:
    """One edge of a boundary: line, arc, ellipse or spline."""
    kind = edge.type.name
    if kind == "LINE":
        ends = numbers([tuple(edge.start)[:2], tuple(edge.end)[:2]])
        return Shape(straight(plane.points(ends)), closed=False)
    if kind == "SPLINE":
        return _spline_edge(edge, plane, tolerance_mm)
    x, y = numbers(edge.center).tolist()[:2]
    if kind == "ARC":
        radius, start, end = numbers((edge.radius, edge.start_angle, edge.end_angle)).tolist()
        if radius <= 0.0:
            raise Unusable(f"has an edge with a radius of {radius:g}")
        sweep = whole_turn(math.radians(end - start))
        return round_in(plane, (x, y, radius), math.radians(start), sweep, tolerance_mm)
    major, ratio = numbers(edge.major_axis)[:2], float(numbers((edge.ratio,))[0])
    start, end = numbers((edge.start_param, edge.end_param)).tolist()
    local = np.array([[x, y], major, ratio * np.array([-major[1], major[0]])])
    axes = np.vstack([plane.points(local[:1]), local[1:] @ np.array([plane.u, plane.v])])
    return elliptic(axes, start, whole_turn(end - start), tolerance_mm)


def _spline_edge(edge: Any, plane: Plane, tolerance_mm: float) -> Shape:
    """A spline edge by its control points, or through its fit points."""
    control = numbers([tuple(point)[:2] for point in edge.control_points]).reshape(-1, 2)
    weights = numbers([*edge.weights])
    if len(control):
        degree, knots = int(edge.degree), numbers([*edge.knot_values])
    else:
        points = numbers([(*tuple(point)[:2], 0.0) for point in edge.fit_points]).reshape(-1, 3)
        tangents = [edge.start_tangent, edge.end_tangent]
        ends = [(*tuple(end)[:2], 0.0) for end in tangents if end is not None]
        degree, knots, control = through(points, ends, closed=False)
        weights = np.empty(0)
    return spline_of(degree, knots, plane.points(control), weights, tolerance_mm)


def solid(entity: Any, frame: Frame, _tolerance_mm: float) -> list[Shape]:
    """SOLID and TRACE: the outline as it is filled, crossed over when its corners are."""
    require(entity, _CORNERS[:3])
    named = [name for name in _CORNERS if entity.dxf.hasattr(name)]
    corners = numbers([tuple(entity.dxf.get(name)) for name in named])
    # A triangle repeats its last corner, or leaves it out.
    is_triangle = len(corners) < len(_CORNERS) or (corners[2] == corners[3]).all()
    local = corners[:3] if is_triangle else corners[list(_DRAWN_ORDER)]
    plane = frame.plane(entity.dxf.extrusion, float(corners[0, 2]))
    return [Shape(straight(plane.points(local)), closed=True)]


def face(entity: Any, frame: Frame, _tolerance_mm: float) -> list[Shape]:
    """3DFACE that is flat: its outline, or those of its edges that are not hidden."""
    require(entity, _CORNERS[:3])
    named = [name for name in _CORNERS if entity.dxf.hasattr(name)]
    corners = frame.flat(numbers([tuple(entity.dxf.get(name)) for name in named]))
    hidden = int(entity.dxf.get("invisible_edges", 0))
    if not hidden:
        return [Shape(straight(corners), closed=True)]
    edges = list(pairwise([*corners, corners[0]]))
    # The last two corners of a triangle are one, and the edge between them is none.
    shown = [edge for k, edge in enumerate(edges) if not hidden >> k & 1 and np.ptp(edge, 0).any()]
    if not shown:
        raise Unusable("has no edge that is shown")
    return [Shape(straight(np.array(edge)), closed=False) for edge in shown]
