"""Choose the faces of a model that are drawn; convert their wires to lines and arcs.

A face is level when it is plane and its normal is vertical. Of a solid the highest level face
that looks up is taken (and those beside it at the same height), or the faces that the plane of
a section shares with it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.geometry.curves import Curve, EllipseCurve, FunctionCurve, SplineCurve
from camtool.geometry.fit import arc_vertices, fit_curve
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.solid.bodies import Body, subshapes

SECTION_MARGIN = 0.1
"""The plane of a section extends beyond the body by this share of the body's size."""


class SolidOutline(Struct, frozen=True, eq=False):
    """The outline of a face: its wires as paths; or loose edges.

    `kind` is "face", "section", "wire" or "edge"."""

    kind: str
    layer: str
    colour: str
    paths: list[EdgePath]


class Outlines(Struct, frozen=True, eq=False):
    """The outlines of a model.

    `levels` are the heights of the faces or sections of its solids, `span` the lowest and highest
    z of the whole model, and `missed` counts the bodies of which nothing is drawn, by the reason.
    """

    outlines: list[SolidOutline] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)
    span: tuple[float, float] = (0.0, 0.0)
    missed: dict[str, int] = field(default_factory=dict)


def outlines(bodies: list[Body], height: float | None, tolerance: float) -> Outlines:
    """Return the outlines of the bodies: of their highest level faces, or of their section at this
    height.

    DrawingError when the plane of the section misses them all."""
    boxes = [_box(body.shape) for body in bodies]
    low, high = min(box[2] for box in boxes), max(box[5] for box in boxes)
    if height is not None and not low - POSITION_EPS_MM <= height <= high + POSITION_EPS_MM:
        raise DrawingError(
            f"a section at z = {height:.6g} misses the model, which spans z = {low:.6g} to "
            f"{high:.6g}",
            mend="give a --section-z between them",
        )
    outlines_found: list[SolidOutline] = []
    levels: list[float] = []
    missed_kinds: Counter[str] = Counter()
    for body, box in zip(bodies, boxes, strict=True):
        kind, faces, edges, level = _choose_faces(body, box, height)
        wires = [_wires(face, tolerance) for face in faces]
        if edges:
            wires.append([edge_path(edge, tolerance) for edge in edges])
        outlines_found.extend(
            SolidOutline(kind, body.layer, body.colour, paths) for paths in wires
        )
        if not wires:
            missed_kinds[_why_nothing_drawn(kind, height)] += 1
        if wires and level is not None:
            levels.append(level)
    return Outlines(outlines_found, levels, (low, high), dict(missed_kinds))


def _why_nothing_drawn(kind: str, height: float | None) -> str:
    """Return the reason, for the user, why nothing of a body is drawn."""
    if height is not None:
        return "is not cut by the section"
    return "has no level face that looks up" if kind == "face" else "is not level"


def _choose_faces(
    body: Body, box: tuple[float, ...], height: float | None
) -> tuple[str, list[Any], list[Any], float | None]:
    """Choose the faces of a body whose outlines become the drawing.

    Return the kind of outline, the faces, the edges that belong to no face, and the height of the
    faces, None if they were not chosen by height."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID

    flat = box[5] - box[2] <= POSITION_EPS_MM
    reached = height is None or box[2] - POSITION_EPS_MM <= height <= box[5] + POSITION_EPS_MM
    faces = subshapes(body.shape, TopAbs_FACE)
    if not faces:
        kind = "edge" if body.shape.ShapeType() == TopAbs_EDGE else "wire"
        edges = subshapes(body.shape, TopAbs_EDGE)
        return kind, [], edges if flat and reached else [], None
    if body.shape.ShapeType() != TopAbs_SOLID and flat:
        return "face", faces if reached else [], [], None
    if height is not None:
        if not reached:
            return "section", [], [], height
        return "section", *_section(body.shape, box, height), height
    levels = [(level, face) for face in faces if (level := _level(face)) is not None]
    top = max((level for level, _ in levels), default=None)
    if top is None:
        return "face", [], [], None
    return "face", [face for level, face in levels if top - level <= POSITION_EPS_MM], [], top


def _level(face: Any) -> float | None:
    """Return the height of a face that is level and looks up, None for any other face."""
    from OCP.BRepGProp import BRepGProp_Face
    from OCP.BRepTools import BRepTools
    from OCP.gp import gp_Pnt, gp_Vec

    if not _is_plane(face):
        return None
    surface, point, normal = BRepGProp_Face(face), gp_Pnt(), gp_Vec()
    u_low, u_high, v_low, v_high = BRepTools.UVBounds_s(face)
    surface.Normal(0.5 * (u_low + u_high), 0.5 * (v_low + v_high), point, normal)
    size = normal.Magnitude()
    if size == 0.0 or normal.Z() <= 0.0:
        return None
    return point.Z() if math.hypot(normal.X(), normal.Y()) <= LEVEL_RAD * size else None


def _is_plane(face: Any) -> bool:
    """Return True if the surface is a plane, even if the file writes it as a spline."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Surface
    from OCP.GeomAbs import GeomAbs_BezierSurface, GeomAbs_BSplineSurface, GeomAbs_Plane
    from OCP.GeomLib import GeomLib_IsPlanarSurface

    kind = BRepAdaptor_Surface(face).GetType()
    if kind in (GeomAbs_BezierSurface, GeomAbs_BSplineSurface):
        surface = BRep_Tool.Surface_s(face)
        return bool(GeomLib_IsPlanarSurface(surface, POSITION_EPS_MM).IsPlanar())
    return bool(kind == GeomAbs_Plane)


def _section(shape: Any, box: tuple[float, ...], height: float) -> tuple[list[Any], list[Any]]:
    """Return the faces that a solid shares with the level plane at this height; for a shell or
    face without a volume, the edges instead."""
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Section
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
    from OCP.gp import gp_Ax3, gp_Dir, gp_Pln, gp_Pnt
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SOLID

    middle = gp_Pnt(0.5 * (box[0] + box[3]), 0.5 * (box[1] + box[4]), height)
    plane = gp_Pln(gp_Ax3(middle, gp_Dir(0.0, 0.0, 1.0), gp_Dir(1.0, 0.0, 0.0)))
    reach = (0.5 + SECTION_MARGIN) * max(box[3] - box[0], box[4] - box[1], box[5] - box[2])
    if shape.ShapeType() == TopAbs_SOLID:
        sheet = BRepBuilderAPI_MakeFace(plane, -reach, reach, -reach, reach).Face()
        common = BRepAlgoAPI_Common(shape, sheet)
        if common.IsDone():
            faces = subshapes(common.Shape(), TopAbs_FACE)
            if faces:
                return faces, []
    section = BRepAlgoAPI_Section(shape, plane, True)
    return [], subshapes(section.Shape(), TopAbs_EDGE) if section.IsDone() else []


def _wires(face: Any, tolerance: float) -> list[EdgePath]:
    """Return the outer and inner wires of a face as closed paths; the edges of a wire that does
    not close come as single paths."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_WIRE

    paths: list[EdgePath] = []
    for wire in subshapes(face, TopAbs_WIRE):
        walk = BRepTools_WireExplorer(wire, face)
        ring: list[Any] = []
        while walk.More():
            ring.append(walk.Current())
            walk.Next()
        edges = subshapes(wire, TopAbs_EDGE)
        is_complete = len(ring) == len(edges)
        parts = [
            edge_path(edge, tolerance)
            for edge in (ring if is_complete else edges)
            if not BRep_Tool.Degenerated_s(edge)
        ]
        parts = [part for part in parts if len(part.vertices) > 1]
        if parts and is_complete and is_ring(parts):
            paths.append(join_edges(parts))
        else:
            paths.extend(parts)
    return paths


def _box(shape: Any) -> tuple[float, ...]:
    """Return the bounding box of the exact geometry: x, y, z of its lowest corner, then of its
    highest."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    corners = box.CornerMin(), box.CornerMax()
    return tuple(value for corner in corners for value in (corner.X(), corner.Y(), corner.Z()))


# Edges of OpenCASCADE in a level plane to lines and arcs in x and y.
#
#     line, circle                     exact
#     ellipse, B-spline, Bézier        fitted; their numbers are taken over
#     all others                       fitted by asking OpenCASCADE for points and tangents

LEVEL_RAD = 1e-6
"""A face or a circle is level if its axis deviates from the vertical by no more: 1 nm over 1
mm."""

FULL_TURN_RAD = 1e-9
"""An arc within this of a full turn is a full circle."""


JOINT_MM = 1e-4
"""Edges of one wire whose ends lie nearer than this meet; OpenCASCADE keeps them within 1e-7 mm,
files of other programs within 1e-5 and more."""


class EdgePath(Struct, frozen=True, eq=False):
    """An edge or a wire as a path: vertices (n, 3) x, y, bulge and errors `off` (n, 2) as those of
    a `Piece`, in the model's unit."""

    vertices: Floats
    closed: bool
    off: Floats


def edge_path(edge: Any, tolerance: float) -> EdgePath:
    """Return the edge in its own direction; `vertices` begin at its first point and end at its
    last one."""
    from OCP.BRepAdaptor import BRepAdaptor_Curve
    from OCP.TopAbs import TopAbs_REVERSED

    curve = BRepAdaptor_Curve(edge)
    start, end = curve.FirstParameter(), curve.LastParameter()
    exact = _exact(curve, start, end)
    if exact is None:
        fit = fit_curve(_fitted_curve(curve, start, end), tolerance)
        exact, error_mm = fit.vertices, fit.off_mm
    else:
        error_mm = np.zeros((len(exact), 2))
    if edge.Orientation() == TopAbs_REVERSED:
        exact = reversed_vertices(exact)  # the whole edge has the same error
    return EdgePath(exact, False, error_mm)


def reversed_vertices(vertices: Floats) -> Floats:
    """Return the open path in the opposite direction: each bulge changes its sign and moves to the
    other end of its segment."""
    vertices_back = vertices[::-1].copy()
    vertices_back[:-1, 2] = -vertices[-2::-1, 2]
    vertices_back[-1, 2] = 0.0
    return vertices_back


def join_edges(edges: list[EdgePath]) -> EdgePath:
    """Return edges, each of which ends where the next begins, joined to one closed path.

    A gap above POSITION_EPS_MM is added to the error of the segment before it."""
    vertices = np.concatenate([path.vertices[:-1] for path in edges])
    errors = [path.off[:-1].copy() for path in edges]
    for row, step in zip(errors, _steps(edges).tolist(), strict=True):
        row[-1] += step if step > POSITION_EPS_MM else 0.0
    return EdgePath(vertices, True, np.concatenate(errors))


def is_ring(edges: list[EdgePath]) -> bool:
    """Return True if each edge begins where the one before ends, and the first where the last
    ends."""
    return bool((_steps(edges) <= JOINT_MM).all())


def _steps(edges: list[EdgePath]) -> Floats:
    """Return the distance (E,) from the end of each edge to the begin of the next one, and of the
    last to the first."""
    ends = np.array([path.vertices[-1, :2] for path in edges])
    starts = np.array([path.vertices[0, :2] for path in edges])
    return np.asarray(np.hypot(*(np.roll(starts, -1, axis=0) - ends).T))


def _exact(curve: Any, start: float, end: float) -> Floats | None:
    """Return the vertices of a line, or of a circle or arc in a level plane; None for any other
    curve."""
    from OCP.GeomAbs import GeomAbs_Circle, GeomAbs_Line

    kind = curve.GetType()
    if kind == GeomAbs_Line:
        return np.array([[*_xy(curve.Value(t)), 0.0] for t in (start, end)])
    if kind != GeomAbs_Circle:
        return None
    circle = curve.Circle()
    axis_z = circle.Axis().Direction().Z()
    if math.hypot(circle.Axis().Direction().X(), circle.Axis().Direction().Y()) > LEVEL_RAD:
        return None
    centre, first = np.array(_xy(circle.Location())), np.array(_xy(curve.Value(start)))
    sweep = math.copysign(end - start, axis_z)
    if abs(abs(sweep) - 2.0 * math.pi) <= FULL_TURN_RAD:
        sweep = math.copysign(2.0 * math.pi, axis_z)
    angle = math.atan2(first[1] - centre[1], first[0] - centre[0])
    return arc_vertices(centre, circle.Radius(), angle, sweep)


def _fitted_curve(curve: Any, start: float, end: float) -> Curve:
    """Return the curve, seen from above, in the form that `fit_curve` takes."""
    from OCP.GeomAbs import (
        GeomAbs_BezierCurve,
        GeomAbs_BSplineCurve,
        GeomAbs_Circle,
        GeomAbs_Ellipse,
    )

    kind = curve.GetType()
    if kind in (GeomAbs_Ellipse, GeomAbs_Circle):
        conic = curve.Ellipse() if kind == GeomAbs_Ellipse else curve.Circle()
        radii = (
            (conic.MajorRadius(), conic.MinorRadius())
            if kind == GeomAbs_Ellipse
            else (conic.Radius(), conic.Radius())
        )
        axes = conic.XAxis().Direction(), conic.YAxis().Direction()
        major, minor = (
            radius * np.array(_xy(axis)) for radius, axis in zip(radii, axes, strict=True)
        )
        return EllipseCurve(np.array(_xy(conic.Location())), major, minor, start, end)
    if kind == GeomAbs_BSplineCurve:
        return _spline(curve.BSpline(), start, end)
    if kind == GeomAbs_BezierCurve:
        from OCP.GeomConvert import GeomConvert

        return _spline(GeomConvert.CurveToBSplineCurve_s(curve.Bezier()), start, end)
    return _sample_curve(curve, start, end)


def _spline(spline: Any, start: float, end: float) -> Curve:
    """Return the part of a B-spline between two parameters, with the knots and weights of that
    part."""
    if spline.IsPeriodic():
        spline.SetNotPeriodic()
    if (spline.FirstParameter(), spline.LastParameter()) != (start, end):
        spline.Segment(start, end)
    count = spline.NbPoles()
    numbers = range(1, count + 1)
    knots = [
        spline.Knot(index)
        for index in range(1, spline.NbKnots() + 1)
        for _ in range(spline.Multiplicity(index))
    ]
    control = np.array([_xy(spline.Pole(index)) for index in numbers])
    weights = np.array([spline.Weight(index) for index in numbers])
    return SplineCurve(spline.Degree(), np.array(knots), control, weights)


def _sample_curve(curve: Any, start: float, end: float) -> Curve:
    """Return a curve of any kind by functions that sample it; it may have corners where its
    intervals meet."""
    from OCP.GeomAbs import GeomAbs_C1
    from OCP.gp import gp_Pnt, gp_Vec

    count = curve.NbIntervals(GeomAbs_C1)
    bounds = _reals(count + 1)
    curve.Intervals(bounds, GeomAbs_C1)
    breaks = np.array([bounds.Value(index) for index in range(1, count + 2)])

    def sample_at(order: int) -> Callable[[Floats], Floats]:
        def values(t: Floats) -> Floats:
            point, slope = gp_Pnt(), gp_Vec()
            rows: list[tuple[float, float]] = []
            for parameter in t.tolist():
                curve.D1(parameter, point, slope)
                rows.append(_xy(slope if order else point))
            return np.array(rows, dtype=np.float64).reshape(-1, 2)

        return values

    return FunctionCurve(sample_at(0), sample_at(1), breaks)


def _reals(count: int) -> Any:
    """Return an array of OpenCASCADE, under the name that its binding gives it since version 8."""
    try:
        from OCP.collections import Array1_double as Reals
    except ImportError:
        from OCP.TColStd import TColStd_Array1OfReal as Reals
    return Reals(1, count)


def _xy(place: Any) -> tuple[float, float]:
    return place.X(), place.Y()
