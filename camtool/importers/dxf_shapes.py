"""One DXF entity to vertices in mm: lines and circles exact, all other curves fitted.

DXF keeps flat entities in a coordinate system of their own (OCS: the arbitrary axis algorithm of
the DXF reference, here ezdxf's), and blocks are placed by any affine map. `Frame` is that map,
from the world of an entity to mm; `Plane` is what it makes of the plane that the entity lies in,
seen from above.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from camtool.errors import DrawingError, GeometryError
from camtool.geometry.fit import (
    Curve,
    EllipseCurve,
    Fit,
    SplineCurve,
    arc_vertices,
    fit_curve,
    split_bulges,
)
from camtool.geometry.polylines import POSITION_EPS_MM, Floats, Segments
from camtool.importers.piece import MAX_COORDINATE_MM

FLAT_TILT = 1e-4
"""An entity that rises by more than this share of its width is not flat: seen from above its shape
would change (by half the square of it, 5 nm on a metre)."""

ROUND_SHARE = 1e-9
"""Half axes that differ by less, or stand less askew, make a circle."""

FULL_TURN_RAD = 1e-6
"""An ellipse that lacks less than this of a full turn is closed (files round to 6 digits)."""

_FRAME_VERTEX = 16  # flag of a vertex that only steers a splined POLYLINE


class Unusable(Exception):
    """The entity gives no path; the text says why."""


@dataclass(frozen=True, eq=False)
class Frame:
    """World to mm: p ↦ p @ linear + offset, with linear (3, 3) and offset (3,)."""

    linear: Floats
    offset: Floats

    def placed(self, linear: Floats, offset: Floats) -> Frame:
        """This frame behind another map."""
        return Frame(linear @ self.linear, offset @ self.linear + self.offset)

    def flat(self, points: Floats) -> Floats:
        """Points (n, 3) as (n, 2) mm; Unusable when they rise."""
        placed = points @ self.linear + self.offset
        width = float(np.ptp(placed[:, :2], axis=0).max())
        if np.ptp(placed[:, 2]) > max(FLAT_TILT * width, POSITION_EPS_MM):
            raise Unusable("is not flat")
        return np.asarray(placed[:, :2])

    def plane(self, entity: Any, elevation: float) -> Plane:
        """The plane of an entity's OCS at this elevation; Unusable when it is tilted."""
        normal = _numbers(entity.dxf.extrusion)
        if not normal.any():
            raise Unusable("has an extrusion of 0")
        ocs = entity.ocs()
        unit = np.array([tuple(ocs.to_wcs(axis)) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))])
        axes = unit @ self.linear
        return Plane.of(axes[0], axes[1], elevation * axes[2] + self.offset)


@dataclass(frozen=True, eq=False)
class Plane:
    """(x, y) ↦ origin + x·u + y·v, all (2,) in mm; `scale` is 0 unless circles stay circles."""

    u: Floats
    v: Floats
    origin: Floats
    scale: float
    sign: float

    @classmethod
    def of(cls, u: Floats, v: Floats, origin: Floats) -> Plane:
        """From vectors (3,); Unusable when the plane is tilted or has no area."""
        longest = max(math.hypot(*u), math.hypot(*v))
        if max(abs(u[2]), abs(v[2])) > FLAT_TILT * longest:
            raise Unusable("lies in a tilted plane")
        area = float(u[0] * v[1] - u[1] * v[0])
        if abs(area) <= ROUND_SHARE * longest**2:
            raise Unusable("is scaled to nothing")
        lengths = math.hypot(u[0], u[1]), math.hypot(v[0], v[1])
        askew = abs(u[0] * v[0] + u[1] * v[1]) / longest
        is_round = max(abs(lengths[0] - lengths[1]), askew) <= ROUND_SHARE * longest
        scale = lengths[0] if is_round else 0.0
        return cls(u[:2], v[:2], origin[:2], scale, math.copysign(1.0, area))

    def points(self, local: Floats) -> Floats:
        """Local (n, 2) to (n, 2) mm."""
        return np.asarray(self.origin + local[:, :1] * self.u + local[:, 1:2] * self.v)


@dataclass(frozen=True, eq=False)
class Shape:
    """`vertices` (n, 3) mm, and the fits that it took."""

    vertices: Floats
    closed: bool
    fits: tuple[Fit, ...] = ()


Reader = Callable[[Any, Frame, float], Shape]


def can_read(kind: str) -> bool:
    """Whether entities of this kind have a shape."""
    return kind in _READERS


def shape_of(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    """The entity's path in mm; it must be of a kind that can be read.

    Raises Unusable, and DrawingError (without file and place) for numbers that are none.
    """
    reader, needs = _READERS[entity.dxftype()]
    require(entity, needs)
    return reader(entity, frame, tolerance_mm)


def require(entity: Any, names: tuple[str, ...]) -> None:
    """Unusable when the file does not say one of these attributes: ezdxf would make one up."""
    for name in names:
        if not entity.dxf.hasattr(name):
            raise Unusable(f"lacks its {name.replace('_', ' ')}")


def _line(entity: Any, frame: Frame, _tolerance_mm: float) -> Shape:
    ends = np.array([_numbers(entity.dxf.start), _numbers(entity.dxf.end)])
    return Shape(_straight(frame.flat(ends)), closed=False)


def _circle(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    return _round(entity, frame, tolerance_mm, 0.0, 2.0 * math.pi)


def _arc(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    start, end = _numbers((entity.dxf.start_angle, entity.dxf.end_angle))
    sweep = (end - start) % 360.0 or 360.0
    return _round(entity, frame, tolerance_mm, math.radians(start), math.radians(sweep))


def _round(entity: Any, frame: Frame, tolerance_mm: float, start: float, sweep: float) -> Shape:
    """A circle or an arc."""
    radius = float(_numbers((entity.dxf.radius,))[0])
    if radius <= 0.0:
        raise Unusable(f"has a radius of {radius:g}")
    centre = _numbers(entity.dxf.center)
    plane = frame.plane(entity, float(centre[2]))
    middle = plane.points(centre[None, :2])[0]
    axes = np.array([middle, radius * plane.u, radius * plane.v])
    return _elliptic(axes, start, sweep, tolerance_mm)


def _ellipse(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    dxf = entity.dxf
    centre, major, normal = (_numbers(v) for v in (dxf.center, dxf.major_axis, dxf.extrusion))
    ratio, start, end = _numbers((dxf.ratio, dxf.start_param, dxf.end_param))
    length = math.hypot(*normal)
    if length == 0.0:
        raise Unusable("has an extrusion of 0")
    minor = float(ratio) * np.cross(normal / length, major)
    plane = Plane.of(
        major @ frame.linear, minor @ frame.linear, centre @ frame.linear + frame.offset
    )
    sweep = (end - start) % (2.0 * math.pi)
    if sweep <= FULL_TURN_RAD or sweep >= 2.0 * math.pi - FULL_TURN_RAD:
        sweep = 2.0 * math.pi
    axes = np.array([plane.origin, plane.u, plane.v])
    return _elliptic(axes, float(start), float(sweep), tolerance_mm)


def _elliptic(axes: Floats, start: float, sweep: float, tolerance_mm: float) -> Shape:
    """Centre and half axes (3, 2): circles and arcs of them exactly, ellipses fitted."""
    centre, u, v = axes
    closed = sweep == 2.0 * math.pi
    plane = Plane.of(np.append(u, 0.0), np.append(v, 0.0), np.append(centre, 0.0))
    if plane.scale:
        turn = math.atan2(float(u[1]), float(u[0])) + plane.sign * start
        shape = Shape(arc_vertices(centre, plane.scale, turn, plane.sign * sweep), closed)
    else:
        shape = _fitted(EllipseCurve(centre, u, v, start, start + sweep), axes, tolerance_mm)
    return Shape(shape.vertices[:-1] if closed else shape.vertices, closed, shape.fits)


def _lwpolyline(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    rows = _numbers(entity.get_points("xyb")).reshape(-1, 3)
    elevation = float(_numbers((entity.dxf.get("elevation", 0.0),))[0])
    return _bulged(rows, bool(entity.closed), frame.plane(entity, elevation), tolerance_mm)


def _polyline(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    if entity.get_mode() not in ("AcDb2dPolyline", "AcDb3dPolyline"):
        raise Unusable("is a mesh")
    corners = [v.dxf for v in entity.vertices if not int(v.dxf.flags) & _FRAME_VERTEX]
    for vertex in entity.vertices:
        require(vertex, ("location",))
    points = _numbers([tuple(corner.location) for corner in corners]).reshape(-1, 3)
    if len(points) == 0:
        raise Unusable("has no vertices")
    closed = bool(entity.is_closed)
    if entity.get_mode() == "AcDb3dPolyline":
        return Shape(_straight(frame.flat(points)), closed)
    bulges = _numbers([corner.get("bulge", 0.0) for corner in corners])
    elevation = float(_numbers(entity.dxf.elevation)[2])
    if not entity.dxf.hasattr("elevation"):
        elevation = float(points[0, 2])
    rows = np.column_stack([points[:, :2], bulges])
    return _bulged(rows, closed, frame.plane(entity, elevation), tolerance_mm)


def _bulged(local: Floats, closed: bool, plane: Plane, tolerance_mm: float) -> Shape:
    """A polyline in its own plane: exact, or its arcs fitted where the plane squeezes circles."""
    if len(local) == 0:
        raise Unusable("has no vertices")
    rows = np.column_stack([plane.points(local), plane.sign * local[:, 2]])
    if plane.scale or not local[:, 2].any():
        return Shape(split_bulges(rows, closed), closed)
    following = np.roll(local, -1, axis=0)[:, :2]
    arcs = Segments.between(local[:, :2], following, local[:, 2])
    is_arc = arcs.is_arc & (local[:, :2] != following).any(axis=1)
    if not closed:
        is_arc[-1] = False
    parts: list[Floats] = []
    fits: list[Fit] = []
    for k, row in enumerate(rows):
        if is_arc[k]:
            centre = plane.points(arcs.centre[k : k + 1])[0]
            u, v = arcs.radius[k] * plane.u, arcs.radius[k] * plane.v
            ends = float(arcs.start_angle[k]), float(arcs.start_angle[k] + arcs.sweep[k])
            curve = EllipseCurve(centre, u, v, *ends)
            shape = _fitted(curve, np.array([centre, u, v]), tolerance_mm)
            parts.append(shape.vertices[:-1])
            fits.extend(shape.fits)
        else:
            parts.append(np.array([[row[0], row[1], 0.0]]))
    return Shape(np.concatenate(parts), closed, tuple(fits))


def _spline(entity: Any, frame: Frame, tolerance_mm: float) -> Shape:
    for numbers in (entity.control_points, entity.fit_points):
        _numbers([tuple(point) for point in numbers])
    _numbers([*entity.knots, *entity.weights])
    try:
        tool = entity.construction_tool()
        points = _numbers([tuple(point) for point in tool.control_points]).reshape(-1, 3)
        knots, weights = np.array(tool.knots()), np.array(tool.weights() or np.ones(len(points)))
    except (ValueError, ArithmeticError, IndexError) as error:
        raise Unusable(f"has no curve ({error})") from error
    control = frame.flat(points)
    try:
        curve = SplineCurve(int(tool.degree), knots, control, weights)
    except GeometryError as error:
        raise Unusable(f"has no curve ({error.message})") from error
    shape = _fitted(curve, control, tolerance_mm)
    ends = shape.vertices[[0, -1], :2]
    closed = len(shape.vertices) > 2 and math.dist(*ends) <= POSITION_EPS_MM
    return Shape(shape.vertices[:-1] if closed else shape.vertices, closed, shape.fits)


def _fitted(curve: Curve, size: Floats, tolerance_mm: float) -> Shape:
    """Arcs for a curve whose place and size these numbers tell."""
    furthest = float(np.abs(size).max())
    if furthest > MAX_COORDINATE_MM:
        raise DrawingError(
            f"is {furthest:.6g} mm large or away, where micrometres are lost",
            mend="move the drawing to its origin, or name its unit with --units",
        )
    fit = fit_curve(curve, tolerance_mm)
    return Shape(fit.vertices, False, (fit,))


def _straight(points: Floats) -> Floats:
    return np.column_stack([points, np.zeros(len(points))])


def _numbers(values: Any) -> Floats:
    """Any numbers as an array; DrawingError when one of them is none."""
    numbers = np.array(tuple(values), dtype=np.float64)
    if not np.isfinite(numbers).all():
        raise DrawingError(
            "has a coordinate that is not a finite number", mend="delete it or draw it again"
        )
    return numbers


_READERS: dict[str, tuple[Reader, tuple[str, ...]]] = {
    "ARC": (_arc, ("center", "radius", "start_angle", "end_angle")),
    "CIRCLE": (_circle, ("center", "radius")),
    "ELLIPSE": (_ellipse, ("center", "major_axis", "ratio")),
    "LINE": (_line, ("start", "end")),
    "LWPOLYLINE": (_lwpolyline, ()),
    "POLYLINE": (_polyline, ()),
    "SPLINE": (_spline, ()),
}
