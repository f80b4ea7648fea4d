"""DXF entities to paths in mm: lines and circles exact, all other curves fitted.

DXF keeps flat entities in a coordinate system of their own (OCS: the arbitrary axis algorithm of
the DXF reference), and blocks are placed by any affine map. `WorldMap` is that map, from the world
of an entity to mm; `Plane` is the image of the plane that the entity lies in, seen from above."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.errors import DrawingError, GeometryError
from camtool.geometry.curves import BezierCurve, Curve, EllipseCurve, SplineCurve
from camtool.geometry.fit import Fit, arc_vertices, fit_curve, split_bulges
from camtool.geometry.polylines import POSITION_EPS_MM, Segments
from camtool.importers.pieces import MAX_COORDINATE_MM, Unusable
from camtool.records import replace

FLAT_TILT = 1e-4
"""An entity that rises by more than this share of its width is not flat: seen from above its shape
would change (by half the square of it, 5 nm on a metre)."""

ROUND_SHARE = 1e-9
"""Half axes whose lengths differ by less than this share, and whose angle differs as little from
90°, make a circle."""

_UPWARDS = (0.0, 0.0, 1.0)
_MAX_SHARE_OF_Y = 1.0 / 64.0
"""Arbitrary axis algorithm: if the unit normal of a plane has less than this along X and along Y,
its X axis is at a right angle to the world's Y axis, otherwise to the world's Z axis."""


class Plane(Struct, frozen=True, eq=False, dict=True):
    """A plane of the drawing as it is seen from above: (x, y) ↦ origin + x·u + y·v, all (2,) in
    mm.

    `scale` is that of circles, 0 if they become ellipses; `sign` is −1 if the map mirrors. `rise`
    (2,): how the origin moves for each unit of elevation."""

    u: Floats
    v: Floats
    origin: Floats
    scale: float
    sign: float
    rise: Floats = field(default_factory=lambda: np.zeros(2))

    @classmethod
    def of(cls, u: Floats, v: Floats, origin: Floats, rise: Floats | None = None) -> Plane:
        """Return the plane spanned by the axes `u` and `v` (3,) at `origin` (3,); Unusable if it
        is tilted or has no area.

        `rise` (3,) is the shift of the origin for each unit of elevation."""
        longest = max(math.hypot(*u), math.hypot(*v))
        if not longest <= MAX_COORDINATE_MM:  # nor is NaN
            raise Unusable("is too large to be exact to a micrometre")
        if max(abs(u[2]), abs(v[2])) > FLAT_TILT * longest:
            raise Unusable("lies in a tilted plane")
        area = float(u[0] * v[1] - u[1] * v[0])
        if abs(area) <= ROUND_SHARE * longest**2:
            raise Unusable("is scaled to nothing")
        lengths = math.hypot(u[0], u[1]), math.hypot(v[0], v[1])
        askew = abs(u[0] * v[0] + u[1] * v[1]) / longest
        is_round = max(abs(lengths[0] - lengths[1]), askew) <= ROUND_SHARE * longest
        return cls(
            u=u[:2],
            v=v[:2],
            origin=origin[:2],
            scale=lengths[0] if is_round else 0.0,
            sign=math.copysign(1.0, area),
            rise=np.zeros(2) if rise is None else rise[:2],
        )

    @cached_property
    def turn(self) -> float:
        """Direction of u, rad."""
        return math.atan2(float(self.u[1]), float(self.u[0]))

    def at(self, elevation: float) -> Plane:
        """Return the parallel plane at this elevation above this one."""
        if not elevation or not self.rise.any():
            return self
        origin = self.origin + elevation * self.rise
        return Plane(self.u, self.v, origin, self.scale, self.sign, self.rise)

    def points(self, local: Floats) -> Floats:
        """Return points (n, 2), in mm, of local points (n, 2) of the plane."""
        return np.asarray(self.origin + local[:, :1] * self.u + local[:, 1:2] * self.v)


class WorldMap(Struct, frozen=True, eq=False):
    """The map from the world of an entity to mm: p ↦ p @ linear + offset, with linear (3, 3) and
    offset (3,)."""

    linear: Floats
    offset: Floats
    _planes: dict[tuple[float, ...], Plane] = field(default_factory=dict)

    def placed(self, linear: Floats, offset: Floats) -> WorldMap:
        """Return this map composed with another one that is applied before it: `linear` (3, 3) and
        `offset` (3,) place a block."""
        return WorldMap(linear @ self.linear, offset @ self.linear + self.offset)

    def flat(self, points: Floats) -> Floats:
        """Return points (n, 2), in mm, of world points (n, 3); Unusable if they differ in
        height."""
        flat, is_flat = self.flat_each(points[None])
        if not is_flat[0]:
            raise Unusable("is not flat")
        return np.asarray(flat[0])

    def flat_each(self, points: Floats) -> tuple[Floats, Any]:
        """Return the points (m, n, 2), in mm, of m entities with world points (m, n, 3), and the
        mask (m,) of those that are flat."""
        world_points = points @ self.linear + self.offset
        width = np.ptp(world_points[..., :2], axis=1).max(axis=1)
        rise = np.ptp(world_points[..., 2], axis=1)
        return world_points[..., :2], rise <= np.maximum(FLAT_TILT * width, POSITION_EPS_MM)

    def plane(self, extrusion: Any, elevation: float) -> Plane:
        """Return the plane of the object coordinate system (OCS) with this extrusion and
        elevation; Unusable if it is tilted."""
        normal = tuple(extrusion)
        if normal not in self._planes:
            self._planes[normal] = self._plane(normal)
        return self._planes[normal].at(elevation)

    def _plane(self, normal: tuple[float, ...]) -> Plane:
        """Return the plane through the world's origin of the OCS with this normal."""
        z = numbers(normal)
        if not z.any():
            raise Unusable("has an extrusion of 0")
        z = z / math.hypot(*z)
        x = np.cross(_UPWARDS if np.abs(z[:2]).max() >= _MAX_SHARE_OF_Y else (0.0, 1.0, 0.0), z)
        x = x / math.hypot(*x)
        u, v, rise = np.array([x, np.cross(z, x), z]) @ self.linear
        return Plane.of(u, v, self.offset, rise)


class DxfShape(Struct, frozen=True, eq=False):
    """A path: `vertices` (n, 3) mm and `off_mm` as in `Piece`; `lacks` names a property that was
    not applied, such as a width."""

    vertices: Floats
    closed: bool
    off_mm: Floats | None = None
    lacks: str = ""

    @classmethod
    def of(cls, fit: Fit) -> DxfShape:
        """Return the shape of a fitted curve: open, with its arcs and its errors."""
        return cls(fit.vertices, False, fit.off_mm)

    def ring(self) -> DxfShape:
        """Return the shape closed, without its last vertex, which repeats the first."""
        errors = None if self.off_mm is None else self.off_mm[:-1]
        return DxfShape(self.vertices[:-1], True, errors, self.lacks)


def require(entity: Any, names: tuple[str, ...]) -> None:
    """Raise Unusable if the file does not give one of these attributes: ezdxf would assume a
    value."""
    for name in names:
        if not entity.dxf.hasattr(name):
            raise Unusable(f"lacks its {name.replace('_', ' ')}")


def numbers(values: Any) -> Floats:
    """Return the values as an array of floats; DrawingError if one is not finite."""
    is_array = isinstance(values, (list, np.ndarray))
    result = np.array(values if is_array else tuple(values), dtype=np.float64)
    if not np.isfinite(result).all():
        raise DrawingError(
            "has a coordinate that is not a finite number", mend="delete it or draw it again"
        )
    return result


def straight(points: Floats) -> Floats:
    """Return points (n, 2) as vertices (n, 3) of a polyline of lines: x, y and bulge 0."""
    return np.column_stack([points, np.zeros(len(points))])


def fit_arcs(curve: Curve, size: Floats, tolerance_mm: float) -> Fit:
    """Return arcs that fit a curve within the tolerance; DrawingError if it reaches too far.

    `size` holds numbers, mm, that bound the place and size of the curve, such as its control
    points."""
    furthest = float(np.abs(size).max())
    if not furthest <= MAX_COORDINATE_MM:  # nor is NaN
        raise DrawingError(
            f"is {furthest:.6g} mm large or away, too far to be exact to a micrometre",
            mend="move the drawing to its origin, or name its unit with --units",
        )
    return fit_curve(curve, tolerance_mm)


# Lines, circles, arcs, ellipses and polylines.

__all__ = [
    "DxfShape",
    "Plane",
    "Reader",
    "Unusable",
    "WorldMap",
    "arc",
    "circle",
    "ellipse",
    "elliptic",
    "line",
    "lwpolyline",
    "polyline",
    "polyline_with_bulges",
    "require",
]

FULL_TURN_RAD = 1e-6
"""An ellipse that lacks less than this of a full turn is closed (files round to 6 digits)."""

WIDTH = "the width of a line (its middle is the path)"
"""The name of the property that is not applied to a polyline with a width."""

_FRAME_VERTEX = 16  # flag of a vertex that only steers a splined POLYLINE

Reader = Callable[[Any, WorldMap, float], Sequence[DxfShape]]
"""Function that makes shapes of an entity, given the map and the tolerance (mm).

Raises Unusable, and DrawingError (without file and place) for numbers that are not finite."""


def line(entity: Any, frame: WorldMap, _tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of a LINE."""
    require(entity, ("start", "end"))
    ends = numbers([tuple(entity.dxf.start), tuple(entity.dxf.end)])
    return [DxfShape(straight(frame.flat(ends)), closed=False)]


def circle(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of a CIRCLE: exact, or fitted where a block squeezes it to an ellipse."""
    require(entity, ("center", "radius"))
    return [_round(entity, frame, tolerance_mm, 0.0, 2.0 * math.pi)]


def arc(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of an ARC, counter-clockwise from its start."""
    require(entity, ("center", "radius", "start_angle", "end_angle"))
    start, end = numbers((entity.dxf.start_angle, entity.dxf.end_angle)).tolist()
    sweep = (end - start) % 360.0 or 360.0
    return [_round(entity, frame, tolerance_mm, math.radians(start), math.radians(sweep))]


def _round(
    entity: Any, frame: WorldMap, tolerance_mm: float, start: float, sweep: float
) -> DxfShape:
    """Return the shape of a CIRCLE or ARC with this start angle and sweep, rad."""
    dxf = entity.dxf
    x, y, z, radius = numbers((*dxf.center, dxf.radius)).tolist()
    if radius <= 0.0:
        raise Unusable(f"has a radius of {radius:g}")
    plane = frame.plane(dxf.extrusion, z)
    return circle_or_arc(plane, (x, y, radius), start, sweep, tolerance_mm)


def circle_or_arc(
    plane: Plane, disc: tuple[float, float, float], start: float, sweep: float, tolerance_mm: float
) -> DxfShape:
    """Return the circle or arc with this centre and radius, `disc` (x, y, r), in a plane.

    Angles are in rad, the sweep is positive counter-clockwise in the plane, and ±2π for a circle.
    """
    x, y, radius = disc
    centre = plane.origin + x * plane.u + y * plane.v
    if not plane.scale:
        axes = np.array([centre, radius * plane.u, radius * plane.v])
        return elliptic(axes, start, sweep, tolerance_mm)
    closed = abs(sweep) == 2.0 * math.pi
    turn, sweep = plane.turn + plane.sign * start, plane.sign * sweep
    vertices = arc_vertices(centre, plane.scale * radius, turn, sweep)
    return DxfShape(vertices[:-1] if closed else vertices, closed)


def ellipse(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of an ELLIPSE or an arc of one."""
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
    """Return the sweep reduced to one turn, and exactly 2π if it is within FULL_TURN_RAD of a full
    turn or of 0."""
    sweep %= 2.0 * math.pi
    nearly = sweep <= FULL_TURN_RAD or sweep >= 2.0 * math.pi - FULL_TURN_RAD
    return 2.0 * math.pi if nearly else sweep


def elliptic(axes: Floats, start: float, sweep: float, tolerance_mm: float) -> DxfShape:
    """Return an arc of an ellipse, `axes` (3, 2): centre and half axes.

    It is exact if the ellipse is a circle, else fitted; with a sweep of ±2π it is closed."""
    centre, u, v = axes
    closed = abs(sweep) == 2.0 * math.pi
    plane = Plane.of(np.append(u, 0.0), np.append(v, 0.0), np.append(centre, 0.0))
    if plane.scale:
        turn = plane.turn + plane.sign * start
        shape = DxfShape(arc_vertices(centre, plane.scale, turn, plane.sign * sweep), False)
    else:
        curve = EllipseCurve(centre, u, v, start, start + sweep)
        shape = DxfShape.of(fit_arcs(curve, axes, tolerance_mm))
    return shape.ring() if closed else shape


def lwpolyline(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of an LWPOLYLINE."""
    dxf = entity.dxf
    rows = numbers(entity.lwpoints.values).reshape(-1, 5)
    plane = frame.plane(dxf.extrusion, float(numbers((dxf.get("elevation", 0.0),))[0]))
    wide = rows[:, 2:4].any() or bool(dxf.get("const_width", 0.0))
    shape = polyline_with_bulges(rows[:, (0, 1, 4)], bool(entity.closed), plane, tolerance_mm)
    return [_with_width(shape) if wide else shape]


def polyline(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of a POLYLINE, 2D or 3D; Unusable for a mesh."""
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
        return [DxfShape(straight(frame.flat(points)), closed)]
    bulges = numbers([corner.get("bulge", 0.0) for corner in corners])
    elevation = float(points[0, 2])
    if entity.dxf.hasattr("elevation"):
        elevation = float(numbers(entity.dxf.elevation)[2])
    plane = frame.plane(entity.dxf.extrusion, elevation)
    shape = polyline_with_bulges(
        np.column_stack([points[:, :2], bulges]), closed, plane, tolerance_mm
    )
    widths = [part.get(f"{end}_width", 0.0) for part in corners for end in ("start", "end")]
    widths += [entity.dxf.get(f"default_{end}_width", 0.0) for end in ("start", "end")]
    return [_with_width(shape) if any(widths) else shape]


def _with_width(shape: DxfShape) -> DxfShape:
    return replace(shape, lacks=WIDTH)


def polyline_with_bulges(
    local: Floats, closed: bool, plane: Plane, tolerance_mm: float
) -> DxfShape:
    """Return the shape of a polyline (n, 3) of x, y, bulge in its own plane.

    It is exact, or its arcs are fitted where the plane squeezes circles to ellipses."""
    if len(local) == 0:
        raise Unusable("has no vertices")
    rows = np.empty(local.shape)
    rows[:, :2] = plane.points(local)
    rows[:, 2] = plane.sign * local[:, 2]
    if plane.scale or not local[:, 2].any():
        return DxfShape(split_bulges(rows, closed), closed)
    following = np.roll(local, -1, axis=0)[:, :2]
    arcs = Segments.between(local[:, :2], following, local[:, 2])
    is_arc = arcs.is_arc & (local[:, :2] != following).any(axis=1)
    if not closed:
        is_arc[-1] = False
    parts: list[Floats] = []
    errors: list[Floats] = []
    for k, row in enumerate(rows):
        if is_arc[k]:
            centre = plane.points(arcs.centre[k : k + 1])[0]
            u, v = arcs.radius[k] * plane.u, arcs.radius[k] * plane.v
            ends = float(arcs.start_angle[k]), float(arcs.start_angle[k] + arcs.sweep[k])
            curve = EllipseCurve(centre, u, v, *ends)
            fit = fit_arcs(curve, np.array([centre, u, v]), tolerance_mm)
            parts.append(fit.vertices[:-1])
            errors.append(fit.off_mm[:-1])
        else:
            parts.append(np.array([[row[0], row[1], 0.0]]))
            errors.append(np.zeros((1, 2)))
    return DxfShape(np.concatenate(parts), closed, np.concatenate(errors))


# Splines, helices and the outlines of text.
#
# A spline is read as the file writes it: knots and weights that do not belong to its control
# points make it unusable, as a guess would be another curve.

MAX_DEGREE = 25
"""Splines of a higher degree are refused (CAD programs go to 10); the effort grows with it."""

_LINE_POINTS = 2  # a Bézier of two control points is a line


def spline(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the shape of a SPLINE, or of a HELIX that does not rise."""
    control = numbers([tuple(point) for point in entity.control_points]).reshape(-1, 3)
    if len(control):
        knots, weights = numbers([*entity.knots]), numbers([*entity.weights])
        degree = int(entity.dxf.degree)
    else:
        ends = [
            tuple(numbers(entity.dxf.get(name)))
            for name in ("start_tangent", "end_tangent")
            if entity.dxf.hasattr(name)
        ]
        fit = numbers([tuple(point) for point in entity.fit_points]).reshape(-1, 3)
        degree, knots, control = spline_through(fit, ends, bool(entity.closed))
        weights = np.empty(0)
    return [spline_of(degree, knots, frame.flat(control), weights, tolerance_mm)]


def spline_through(
    fit_points: Floats, tangents: list[tuple[float, ...]], closed: bool
) -> tuple[int, Floats, Floats]:
    """Return degree, knots and control points (n, 3) of the spline that CAD programs draw through
    these points.

    `tangents` are those of both ends, or none. Unusable when there are too few points."""
    from ezdxf.math import fit_points_to_cad_cv

    steps = np.hypot(*np.diff(fit_points[:, :2], axis=0).T)
    points = fit_points[np.concatenate([[True], steps > 0.0])] if len(fit_points) else fit_points
    if closed and len(points) > _LINE_POINTS and (points[0] != points[-1]).any():
        points = np.vstack([points, points[:1]])
    if len(points) < _LINE_POINTS:
        raise Unusable("has no curve: too few points")
    ends = tangents if len(tangents) == 2 and all(any(end) for end in tangents) else None
    try:
        tool = fit_points_to_cad_cv([tuple(row) for row in points.tolist()], ends)
    except (ValueError, ArithmeticError, IndexError) as error:
        raise Unusable("has no curve through its points") from error
    control = numbers([tuple(point) for point in tool.control_points]).reshape(-1, 3)
    return int(tool.degree), numbers([*tool.knots()]), control


def spline_of(
    degree: int, knots: Floats, control: Floats, weights: Floats, tolerance_mm: float
) -> DxfShape:
    """Return the fitted shape of the spline with control points (n, 2) mm; empty `weights` are all
    equal.

    Unusable when knots, weights and control points do not belong together."""
    if degree > MAX_DEGREE:
        raise Unusable(f"has degree {degree}, at most {MAX_DEGREE} is read")
    if not len(control):
        raise Unusable("has no curve: no control points")
    try:
        curve = SplineCurve(degree, knots, control, weights if len(weights) else None)
    except GeometryError as error:
        raise Unusable(f"has no curve: {error.message}") from error
    shape = DxfShape.of(fit_arcs(curve, control, tolerance_mm))
    ends = shape.vertices[[0, -1], :2]
    closed = len(shape.vertices) > 2 and math.dist(*ends) <= POSITION_EPS_MM
    return shape.ring() if closed else shape


def outline(parts: list[Floats], closed: bool, frame: WorldMap, tolerance_mm: float) -> DxfShape:
    """Return a path of Béziers end to end, lines exact and curves fitted: each part has 2 (a
    line), 3 or 4 control points (k, 3), in world coordinates."""
    vertices: list[Floats] = []
    errors: list[Floats] = []
    flat = frame.flat(np.concatenate([numbers(list(part)) for part in parts]))
    counts = np.cumsum([len(part) for part in parts])
    for control in np.split(flat, counts[:-1]):
        if len(control) == _LINE_POINTS:
            vertices.append(straight(control[:1]))
            errors.append(np.zeros((1, 2)))
            continue
        fit = fit_arcs(BezierCurve(control), control, tolerance_mm)
        count = max(len(fit.vertices) - 1, 1)
        vertices.append(fit.vertices[:count])
        errors.append(fit.off_mm[:count])
    vertices.append(straight(flat[-1:]))
    errors.append(np.zeros((1, 2)))
    return DxfShape(np.concatenate(vertices), closed, np.concatenate(errors))


# The outlines of areas: HATCH, MPOLYGON, SOLID, TRACE and 3DFACE.

_TEXT_BOX = 8  # flag of a boundary path that keeps a hatch off a text
_CORNERS = ("vtx0", "vtx1", "vtx2", "vtx3")
_DRAWN_ORDER = (0, 1, 3, 2)  # SOLID and TRACE keep their corners in the order of the letter Z


def hatch(entity: Any, frame: WorldMap, tolerance_mm: float) -> list[DxfShape]:
    """Return the boundary paths of a HATCH or MPOLYGON; a path made of edges gives a shape for
    each edge.

    A boundary that is taken from other entities of the drawing is left out, because these are read
    themselves."""
    elevation = float(numbers(entity.dxf.elevation)[2])
    plane = frame.plane(entity.dxf.extrusion, elevation)
    paths = [path for path in entity.paths if not path.path_type_flags & _TEXT_BOX]
    if not paths:
        raise Unusable("has no outline")
    own_paths = [path for path in paths if not _is_boundary_of_entities(path, entity)]
    if not own_paths:
        raise Unusable("has the outline of other entities, which are read")
    shapes: list[DxfShape] = []
    for path in own_paths:
        if hasattr(path, "edges"):
            shapes.extend(_edge(edge, plane, tolerance_mm) for edge in path.edges)
        else:
            rows = numbers(path.vertices).reshape(-1, 3)
            # The outline of an area is closed, also if the file does not say so.
            shapes.append(polyline_with_bulges(rows, True, plane, tolerance_mm))
    return shapes


def _is_boundary_of_entities(path: Any, entity: Any) -> bool:
    """Return True if the boundary path is taken from entities of the drawing that the hatch is
    associated with."""
    handles = path.source_boundary_objects
    database = entity.doc.entitydb if entity.doc is not None else {}
    if not (handles and entity.dxf.get("associative", 0)):
        return False
    return all(_stands_beside(database.get(handle), entity) for handle in handles)


def _stands_beside(source: Any, entity: Any) -> bool:
    """Return True if `source` stands in the same layout or block as the entity."""
    return source is not None and source.dxf.get("owner") == entity.dxf.get("owner")


def _edge(edge: Any, plane: Plane, tolerance_mm: float) -> DxfShape:
    """Return the shape of an edge of a hatch boundary: line, arc, ellipse or spline."""
    kind = edge.type.name
    if kind == "LINE":
        ends = numbers([tuple(edge.start)[:2], tuple(edge.end)[:2]])
        return DxfShape(straight(plane.points(ends)), closed=False)
    if kind == "SPLINE":
        return _spline_edge(edge, plane, tolerance_mm)
    x, y = numbers(edge.center).tolist()[:2]
    if kind == "ARC":
        radius, start, end = numbers((edge.radius, edge.start_angle, edge.end_angle)).tolist()
        if radius <= 0.0:
            raise Unusable(f"has an edge with a radius of {radius:g}")
        sweep = whole_turn(math.radians(end - start))
        return circle_or_arc(plane, (x, y, radius), math.radians(start), sweep, tolerance_mm)
    major, ratio = numbers(edge.major_axis)[:2], float(numbers((edge.ratio,))[0])
    start, end = numbers((edge.start_param, edge.end_param)).tolist()
    local = np.array([[x, y], major, ratio * np.array([-major[1], major[0]])])
    axes = np.vstack([plane.points(local[:1]), local[1:] @ np.array([plane.u, plane.v])])
    return elliptic(axes, start, whole_turn(end - start), tolerance_mm)


def _spline_edge(edge: Any, plane: Plane, tolerance_mm: float) -> DxfShape:
    """Return the shape of a spline edge, from its control points or else through its fit
    points."""
    control = numbers([tuple(point)[:2] for point in edge.control_points]).reshape(-1, 2)
    weights = numbers([*edge.weights])
    if len(control):
        degree, knots = int(edge.degree), numbers([*edge.knot_values])
    else:
        points = numbers([(*tuple(point)[:2], 0.0) for point in edge.fit_points]).reshape(-1, 3)
        tangents = [edge.start_tangent, edge.end_tangent]
        ends = [(*tuple(end)[:2], 0.0) for end in tangents if end is not None]
        degree, knots, control = spline_through(points, ends, closed=False)
        weights = np.empty(0)
    return spline_of(degree, knots, plane.points(control), weights, tolerance_mm)


def solid(entity: Any, frame: WorldMap, _tolerance_mm: float) -> list[DxfShape]:
    """Return the outline of a SOLID or TRACE, in the order in which it is filled: it crosses
    itself if the corners do."""
    require(entity, _CORNERS[:3])
    named = [name for name in _CORNERS if entity.dxf.hasattr(name)]
    corners = numbers([tuple(entity.dxf.get(name)) for name in named])
    # A triangle repeats its last corner, or leaves it out.
    is_triangle = len(corners) < len(_CORNERS) or (corners[2] == corners[3]).all()
    local = corners[:3] if is_triangle else corners[list(_DRAWN_ORDER)]
    plane = frame.plane(entity.dxf.extrusion, float(corners[0, 2]))
    return [DxfShape(straight(plane.points(local)), closed=True)]


def face(entity: Any, frame: WorldMap, _tolerance_mm: float) -> list[DxfShape]:
    """Return the closed outline of a flat 3DFACE, or only its visible edges if some are hidden.

    Raises Unusable if the face is not flat, or has no visible edge."""
    require(entity, _CORNERS[:3])
    named = [name for name in _CORNERS if entity.dxf.hasattr(name)]
    corners = frame.flat(numbers([tuple(entity.dxf.get(name)) for name in named]))
    hidden = int(entity.dxf.get("invisible_edges", 0))
    if not hidden:
        return [DxfShape(straight(corners), closed=True)]
    edges = list(pairwise([*corners, corners[0]]))
    # The last two corners of a triangle are one, and the edge between them is none.
    shown = [edge for k, edge in enumerate(edges) if not hidden >> k & 1 and np.ptp(edge, 0).any()]
    if not shown:
        raise Unusable("has no edge that is shown")
    return [DxfShape(straight(np.array(edge)), closed=False) for edge in shown]
