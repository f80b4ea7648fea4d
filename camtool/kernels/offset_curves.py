"""Lines and arcs as rows of numbers that need no centre, for the kernels of offsets.

A row holds A, B, the unit tangents t at A and u at B, the signed curvature k (left positive), the
length and the sweep. With q = p − A and n, t turned by +90°, the distance of p from the whole line
or circle is

    |k q·q − 2 n·q| / (1 + |n − k q|),

because n − k q is k times the way from p to the centre. What makes it exact: for a curvature of 0
it becomes the formula of the line, and no difference of large numbers is formed on the way there.
The vectorised twins are camtool.geometry.measure, distance and measure.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import inner, kernel

Floats = npt.NDArray[np.float64]

AX, AY, BX, BY, TX, TY, UX, UY, BEND, LENGTH, SWEEP = range(11)
"""The columns of a row."""


@kernel
def curve_rows(start: Floats, end: Floats, bulge: Floats) -> Floats:
    """(K, 11) rows of the segments from `start` to `end` (K, 2) with their bulges (K,)."""
    rows = np.empty((len(bulge), 11))
    for i in range(len(bulge)):
        b = bulge[i]
        dx, dy = end[i, 0] - start[i, 0], end[i, 1] - start[i, 1]
        chord = math.hypot(dx, dy)
        # The tangents are the chord turned by ∓ sweep/2, and b = tan(sweep/4).
        grown = 1.0 + b * b
        cosine, sine = (1.0 - b * b) / (grown * chord), 2.0 * b / (grown * chord)
        rows[i, AX], rows[i, AY] = start[i, 0], start[i, 1]
        rows[i, BX], rows[i, BY] = end[i, 0], end[i, 1]
        rows[i, TX], rows[i, TY] = cosine * dx + sine * dy, cosine * dy - sine * dx
        rows[i, UX], rows[i, UY] = cosine * dx - sine * dy, cosine * dy + sine * dx
        rows[i, BEND] = 4.0 * b / (chord * grown)
        turn = math.atan(b)
        rows[i, LENGTH] = chord if b == 0.0 else chord * grown * turn / b
        rows[i, SWEEP] = 4.0 * turn
    return rows


@kernel
def curve_boxes(curves: Floats, margin: float) -> Floats:
    """(K, 4) xmin, ymin, xmax, ymax of boxes that hold each curve, and `margin` more all round.

    An arc lies between its chord and the parallel of it at its height, sin(sweep/4)² · 2/k.
    """
    boxes = np.empty((len(curves), 4))
    for i in range(len(curves)):
        ax, ay, bx, by = curves[i, AX], curves[i, AY], curves[i, BX], curves[i, BY]
        px = py = 0.0
        if curves[i, BEND] != 0.0:
            height = 2.0 * math.sin(0.25 * curves[i, SWEEP]) ** 2 / curves[i, BEND]
            chord = math.hypot(bx - ax, by - ay)
            px, py = height * (by - ay) / chord, -height * (bx - ax) / chord
        boxes[i, 0] = min(ax, bx) + min(px, 0.0) - margin
        boxes[i, 1] = min(ay, by) + min(py, 0.0) - margin
        boxes[i, 2] = max(ax, bx) + max(px, 0.0) + margin
        boxes[i, 3] = max(ay, by) + max(py, 0.0) + margin
    return boxes


@inner
def gap_to(curves: Floats, i: int, x: float, y: float) -> float:
    """Distance of a point from the whole line or circle of row i."""
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    nx, ny, bend = -curves[i, TY], curves[i, TX], curves[i, BEND]
    power = bend * (qx * qx + qy * qy) - 2.0 * (nx * qx + ny * qy)
    wx, wy = nx - bend * qx, ny - bend * qy
    return float(abs(power) / (1.0 + math.sqrt(wx * wx + wy * wy)))


@inner
def distance_to(curves: Floats, i: int, x: float, y: float) -> float:
    """Distance of a point from row i: from its nearer end beside it (|sweep| ≤ π)."""
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    rx, ry = x - curves[i, BX], y - curves[i, BY]
    ahead = qx * curves[i, TX] + qy * curves[i, TY] >= 0.0
    if ahead and rx * curves[i, UX] + ry * curves[i, UY] <= 0.0:
        return gap_to(curves, i, x, y)
    return math.sqrt(min(qx * qx + qy * qy, rx * rx + ry * ry))


@inner
def along(curves: Floats, i: int, x: float, y: float) -> float:
    """Length along row i from its start to a point on its line or circle; negative before it.

    The chord to the point makes half the swept angle with the tangent; points before the start
    show as half angles beyond the middle of what remains of the circle.
    """
    qx, qy = x - curves[i, AX], y - curves[i, AY]
    ahead = curves[i, TX] * qx + curves[i, TY] * qy
    if curves[i, BEND] == 0.0:
        return float(ahead)
    chord = math.sqrt(qx * qx + qy * qy)
    beside = curves[i, TX] * qy - curves[i, TY] * qx
    half = math.atan2(math.copysign(1.0, curves[i, BEND]) * beside, ahead)
    before = half > 0.5 * math.pi + 0.25 * abs(curves[i, SWEEP]) or half < -0.5 * math.pi
    half = math.pi - abs(half) if before else abs(half)
    if half != 0.0:
        chord *= half / math.sin(half)
    return float(-chord if before else chord)


@inner
def point_on(curves: Floats, i: int, t: float) -> tuple[float, float]:
    """The point of row i at the fraction t of its length.

    After the length s the chord from A is turned by half = k s/2 and s · sin(half)/half long.
    """
    if t == 1.0:
        return curves[i, BX], curves[i, BY]
    s = t * curves[i, LENGTH]
    half = 0.5 * t * curves[i, SWEEP]
    if half != 0.0:
        s *= math.sin(half) / half
    cosine, sine = math.cos(half), math.sin(half)
    tx, ty = curves[i, TX], curves[i, TY]
    x = curves[i, AX] + s * (cosine * tx - sine * ty)
    return x, curves[i, AY] + s * (cosine * ty + sine * tx)
