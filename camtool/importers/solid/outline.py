"""Which faces of a model are drawn, and their outer and inner wires.

A face is level when it is plane and its normal is vertical. Of a solid the highest level face
that looks up is taken (and those beside it at the same height), or the faces that the plane of
a section shares with it.
"""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

from camtool.errors import DrawingError
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.solid.curves import LEVEL_RAD, Path, edge_path, follow, joined
from camtool.importers.solid.shapes import Body, subshapes

SECTION_MARGIN = 0.1
"""By this share of the body's size the plane of a section reaches over it."""


@dataclass(frozen=True, eq=False)
class Outline:
    """The wires of one face; `kind` is "face", "section", "wire" or "edge"."""

    kind: str
    layer: str
    colour: str
    paths: list[Path]


@dataclass(frozen=True, eq=False)
class Outlines:
    """All that is drawn; `levels` are the heights at which solids were taken, `span` is the
    height of the whole model from its lowest to its highest point; of the `missed` bodies nothing
    is drawn, for these reasons."""

    outlines: list[Outline] = field(default_factory=list)
    levels: list[float] = field(default_factory=list)
    span: tuple[float, float] = (0.0, 0.0)
    missed: dict[str, int] = field(default_factory=dict)


def outlines(bodies: list[Body], height: float | None, tolerance: float) -> Outlines:
    """The outlines of the bodies; DrawingError when a section misses them all."""
    boxes = [_box(body.shape) for body in bodies]
    low, high = min(box[2] for box in boxes), max(box[5] for box in boxes)
    if height is not None and not low - POSITION_EPS_MM <= height <= high + POSITION_EPS_MM:
        raise DrawingError(
            f"a section at z = {height:.6g} misses the model, which spans z = {low:.6g} to "
            f"{high:.6g}",
            mend="give a --section-z between them",
        )
    found: list[Outline] = []
    levels: list[float] = []
    missed: Counter[str] = Counter()
    for body, box in zip(bodies, boxes, strict=True):
        kind, faces, edges, level = _taken(body, box, height)
        wires = [_wires(face, tolerance) for face in faces]
        if edges:
            wires.append([edge_path(edge, tolerance) for edge in edges])
        found.extend(Outline(kind, body.layer, body.colour, paths) for paths in wires)
        if not wires:
            missed[_reason(kind, height)] += 1
        if wires and level is not None:
            levels.append(level)
    return Outlines(found, levels, (low, high), dict(missed))


def _reason(kind: str, height: float | None) -> str:
    """Why nothing of a body is drawn."""
    if height is not None:
        return "is not cut by the section"
    return "has no level face that looks up" if kind == "face" else "is not level"


def _taken(
    body: Body, box: tuple[float, ...], height: float | None
) -> tuple[str, list[Any], list[Any], float | None]:
    """Kind, faces, loose edges and height of what is drawn of one body."""
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
    """The height of a level face that looks up, else None."""
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
    """Whether the surface is a plane, also when a file writes it as a spline."""
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
    """The faces that a solid shares with the level plane; of what has no inside, the edges."""
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


def _wires(face: Any, tolerance: float) -> list[Path]:
    """Outer and inner wires as closed paths; the edges one by one of a wire that is no ring."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepTools import BRepTools_WireExplorer
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_WIRE

    paths: list[Path] = []
    for wire in subshapes(face, TopAbs_WIRE):
        walk = BRepTools_WireExplorer(wire, face)
        ring: list[Any] = []
        while walk.More():
            ring.append(walk.Current())
            walk.Next()
        edges = subshapes(wire, TopAbs_EDGE)
        whole = len(ring) == len(edges)
        parts = [
            edge_path(edge, tolerance)
            for edge in (ring if whole else edges)
            if not BRep_Tool.Degenerated_s(edge)
        ]
        parts = [part for part in parts if len(part.vertices) > 1]
        if parts and whole and follow(parts):
            paths.append(joined(parts))
        else:
            paths.extend(parts)
    return paths


def _box(shape: Any) -> tuple[float, ...]:
    """x, y and z of the lowest corner, then of the highest, to the exact geometry."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    corners = box.CornerMin(), box.CornerMax()
    return tuple(value for corner in corners for value in (corner.X(), corner.Y(), corner.Z()))
