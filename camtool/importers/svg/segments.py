"""Subpaths of SVG shapes.

A subpath is a start and segments in user units, Y down as in the file:

    Lines        corners after the start, (n, 2)
    Bezier       control points after the start: (2, 2) or (3, 2)
    Arc          centre + u·cos t + v·sin t, t from `begin` over the signed `sweep`, to `end`

Source: Scalable Vector Graphics 1.1, appendix F.6 (elliptical arcs).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats
from camtool.importers.svg.affine import MAX_NUMBER


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight segments through `points` (n, 2)."""

    points: Floats


@dataclass(frozen=True, eq=False)
class Bezier:
    """A quadratic (2, 2) or cubic (3, 2) Bézier: `control` without its first point."""

    control: Floats


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc of an ellipse, its half axes `u`, `v` (2,), angles in rad, `end` (2,) exact."""

    centre: Floats
    u: Floats
    v: Floats
    begin: float
    sweep: float
    end: Floats


Segment = Lines | Bezier | Arc


@dataclass(frozen=True, eq=False)
class Subpath:
    """A start (2,) and what follows it; `closed` paths have a straight line back, if any."""

    start: Floats
    segments: tuple[Segment, ...]
    closed: bool


def arc_between(start: complex, end: complex, radii: complex, turn: float, flags: int) -> Arc:
    """The arc of path data: `radii` = rx + i·ry, `turn` rad of the x axis; flags: 1 the sweep
    flag, 2 the large-arc flag. Radii that are too short are grown. Start and end differ.
    DrawingError when its radii are so unlike its chord that numbers fail.

    In the frame where the ellipse is the unit circle, with the chord's half h = (p1 − p0)/2,
    |h| = sin(half the small sweep), the centre lies at the chord's middle ± i·h/|h|·√(1 − |h|²).
    """
    rx, ry = abs(radii.real), abs(radii.imag)
    axis = complex(math.cos(turn), math.sin(turn))

    def to_unit(z: complex) -> complex:
        w = z * axis.conjugate()
        return complex(w.real / rx, w.imag / ry)

    middle, half = to_unit((start + end) / 2.0), to_unit((end - start) / 2.0)
    size = math.hypot(half.real, half.imag)
    if not 1.0 / MAX_NUMBER**2 < size < MAX_NUMBER:
        raise DrawingError(f"an arc of radii {rx:g} and {ry:g} has no shape there")
    grow = max(size, 1.0)
    rise = math.sqrt((1.0 - size) * (1.0 + size)) if size < 1.0 else 0.0
    positive, large = bool(flags & 1), bool(flags & 2)
    side = 1.0 if positive != large else -1.0
    offset = side * rise * half * 1j / size
    small = 2.0 * math.atan2(min(size, 1.0), rise)
    sweep = (2.0 * math.pi - small) if large else small
    from_centre = -half / grow - offset
    centre = (middle + offset) if size < 1.0 else middle
    at = complex(centre.real * rx, centre.imag * ry) * axis
    u, v = rx * grow * axis, 1j * ry * grow * axis
    return Arc(
        centre=_pair(at),
        u=_pair(u),
        v=_pair(v),
        begin=math.atan2(from_centre.imag, from_centre.real),
        sweep=sweep if positive else -sweep,
        end=_pair(end),
    )


def _pair(z: complex) -> Floats:
    return np.array([z.real, z.imag])
