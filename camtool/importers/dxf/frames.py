"""Where a DXF entity lies: the map from its world, or from the plane it is drawn in, to mm.

DXF keeps flat entities in a coordinate system of their own (OCS: the arbitrary axis algorithm of
the DXF reference, here ezdxf's), and blocks are placed by any affine map. `Frame` is that map,
from the world of an entity to mm; `Plane` is what it makes of the plane that the entity lies in,
seen from above.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.fit import Curve, Fit, fit_curve
from camtool.geometry.polylines import POSITION_EPS_MM, Floats
from camtool.importers.piece import MAX_COORDINATE_MM

FLAT_TILT = 1e-4
"""An entity that rises by more than this share of its width is not flat: seen from above its shape
would change (by half the square of it, 5 nm on a metre)."""

ROUND_SHARE = 1e-9
"""Half axes that differ by less, or stand less askew, make a circle."""

_UPWARDS = (0.0, 0.0, 1.0)


class Unusable(Exception):
    """The entity gives no path; the text says why."""


@dataclass(frozen=True, eq=False)
class Plane:
    """(x, y) ↦ origin + x·u + y·v, all (2,) in mm; `scale` is 0 unless circles stay circles.

    `rise` (2,): how the origin moves for each unit of elevation.
    """

    u: Floats
    v: Floats
    origin: Floats
    scale: float
    sign: float
    rise: Floats = field(default_factory=lambda: np.zeros(2))

    @classmethod
    def of(cls, u: Floats, v: Floats, origin: Floats, rise: Floats | None = None) -> Plane:
        """From vectors (3,); Unusable when the plane is tilted or has no area."""
        longest = max(math.hypot(*u), math.hypot(*v))
        if not longest <= MAX_COORDINATE_MM:  # nor is NaN
            raise Unusable("is larger than micrometres can tell")
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
        """The direction of u, rad."""
        return math.atan2(float(self.u[1]), float(self.u[0]))

    def at(self, elevation: float) -> Plane:
        """The parallel plane at this elevation over the one here."""
        if not elevation or not self.rise.any():
            return self
        origin = self.origin + elevation * self.rise
        return Plane(self.u, self.v, origin, self.scale, self.sign, self.rise)

    def points(self, local: Floats) -> Floats:
        """Local (n, 2) to (n, 2) mm."""
        return np.asarray(self.origin + local[:, :1] * self.u + local[:, 1:2] * self.v)


@dataclass(frozen=True, eq=False)
class Frame:
    """World to mm: p ↦ p @ linear + offset, with linear (3, 3) and offset (3,)."""

    linear: Floats
    offset: Floats
    _planes: dict[tuple[float, ...], Plane] = field(default_factory=dict, repr=False)

    def placed(self, linear: Floats, offset: Floats) -> Frame:
        """This frame behind another map."""
        return Frame(linear @ self.linear, offset @ self.linear + self.offset)

    def flat(self, points: Floats) -> Floats:
        """Points (n, 3) as (n, 2) mm; Unusable when they rise."""
        flat, is_flat = self.flat_each(points[None])
        if not is_flat[0]:
            raise Unusable("is not flat")
        return np.asarray(flat[0])

    def flat_each(self, points: Floats) -> tuple[Floats, Any]:
        """Many entities' points (m, n, 3) as (m, n, 2) mm, and whether each is flat (m,)."""
        placed = points @ self.linear + self.offset
        width = np.ptp(placed[..., :2], axis=1).max(axis=1)
        rise = np.ptp(placed[..., 2], axis=1)
        return placed[..., :2], rise <= np.maximum(FLAT_TILT * width, POSITION_EPS_MM)

    def plane(self, extrusion: Any, elevation: float) -> Plane:
        """The plane of an OCS at this elevation; Unusable when it is tilted."""
        normal = tuple(extrusion)
        if normal not in self._planes:
            self._planes[normal] = self._plane(normal)
        return self._planes[normal].at(elevation)

    def _plane(self, normal: tuple[float, ...]) -> Plane:
        """The plane of an OCS through the world's origin."""
        from ezdxf.math import OCS

        if not numbers(normal).any():
            raise Unusable("has an extrusion of 0")
        axes = np.eye(3)
        if normal != _UPWARDS:
            ocs = OCS(normal)
            axes = np.array(
                [tuple(ocs.to_wcs(axis)) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
            )
        u, v, up = axes @ self.linear
        return Plane.of(u, v, self.offset, up)


@dataclass(frozen=True, eq=False)
class Shape:
    """`vertices` (n, 3) mm and `off_mm` of a `Piece`; `lacks` names what was not applied."""

    vertices: Floats
    closed: bool
    off_mm: Floats | None = None
    lacks: str = ""

    @classmethod
    def of(cls, fit: Fit) -> Shape:
        """The arcs that stand for a curve."""
        return cls(fit.vertices, False, fit.off_mm)

    def ring(self) -> Shape:
        """The same closed, whose last vertex is its first one."""
        off = None if self.off_mm is None else self.off_mm[:-1]
        return Shape(self.vertices[:-1], True, off, self.lacks)


def require(entity: Any, names: tuple[str, ...]) -> None:
    """Unusable when the file does not say one of these attributes: ezdxf would make one up."""
    for name in names:
        if not entity.dxf.hasattr(name):
            raise Unusable(f"lacks its {name.replace('_', ' ')}")


def numbers(values: Any) -> Floats:
    """Any numbers as an array; DrawingError when one of them is none."""
    found = np.array(values if isinstance(values, list) else tuple(values), dtype=np.float64)
    if not np.isfinite(found).all():
        raise DrawingError(
            "has a coordinate that is not a finite number", mend="delete it or draw it again"
        )
    return found


def straight(points: Floats) -> Floats:
    """Points (n, 2) as vertices (n, 3) of lines."""
    return np.column_stack([points, np.zeros(len(points))])


def fitted(curve: Curve, size: Floats, tolerance_mm: float) -> Fit:
    """Arcs for a curve whose place and size these numbers tell."""
    furthest = float(np.abs(size).max())
    if not furthest <= MAX_COORDINATE_MM:  # nor is NaN
        raise DrawingError(
            f"is {furthest:.6g} mm large or away, where micrometres are lost",
            mend="move the drawing to its origin, or name its unit with --units",
        )
    return fit_curve(curve, tolerance_mm)
