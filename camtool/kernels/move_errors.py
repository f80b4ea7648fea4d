"""How far points are from a move, with the side that they lie on: a line or an arc, many at once.

A move is a row of numbers (see the columns below). The error of a point is its distance to the
move, exact to the true line or arc, and positive to the left of the move's direction:

    line a→b:  |p − a − t·d|,  d = b − a,  t = clamp((p − a)·d / d², 0, 1),  sign of d × (p − a)
    arc:       ±(R − |p − c|) inside the wedge that the arc spans at its centre c, otherwise the
               distance to its nearer end with that sign

The wedge is told by the cross products with the spokes of the two ends: both, up to half a turn,
and either, above it. What is exact: no angle is ever taken, and no chord. Compiled, and written
as loops without branches over blocks of points, which the processor runs several at a time.

`best` holds the error of least size so far; each call lowers it where this move is nearer.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from camtool.kernels.compiled import bare
from camtool.kernels.wide import larger, smaller, wide

Floats = npt.NDArray[np.float64]

COLUMNS = 16
"""Numbers of a move: start x, y; end x, y; way x, y; 1 / way²; centre x, y; radius (0: a line);
turn (+1 ccw, −1 cw); normals into the wedge at its start x, y and its end x, y; 1 when it is wider
than half a turn, 2 when it is a whole turn, else 0."""

NEAR = 2.0**-9
"""Up to this part of its radius from a circle the series of a root stands for it."""

FULL = 2.0
"""What a whole turn has in its last column."""

AX, AY, BX, BY, DX, DY, OVER, CX, CY, RADIUS, TURN, UX, UY, VX, VY, WIDE = range(16)


@wide
def _to_line(move: Floats, x: Floats, y: Floats, best: Floats, first: bool) -> None:
    ax, ay, dx, dy, over = move[AX], move[AY], move[DX], move[DY], move[OVER]
    for k in range(len(x)):
        px, py = x[k] - ax, y[k] - ay
        t = (px * dx + py * dy) * over
        t = smaller(larger(t, 0.0), 1.0)
        off_x, off_y = px - t * dx, py - t * dy
        apart = math.sqrt(off_x * off_x + off_y * off_y)
        error = math.copysign(apart, dx * py - dy * px)
        best[k] = error if first or apart < abs(best[k]) else best[k]


@wide
def _all_in_wedge(move: Floats, x: Floats, y: Floats) -> bool:
    cx, cy, ux, uy, vx, vy = move[CX], move[CY], move[UX], move[UY], move[VX], move[VY]
    above_half = move[WIDE] != 0.0
    least = np.inf
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        least = smaller(least, _depth(ux * py - uy * px, px * vy - py * vx, above_half))
    return bool(least >= 0.0)


@wide
def _depth(from_start: float, from_end: float, above_half: bool) -> float:
    """Not below 0 in the wedge, from what a point is to the inside of its two edges."""
    if above_half:
        return larger(from_start, from_end)
    return smaller(from_start, from_end)


@bare
def _off(height: float, over: float) -> float:
    """How far outside of a circle a point is that is `height` = h above it, for small h.

    With h = (|p|² − R²) / 2R and q = h / R, `over` being 1 / R, that is

        √(R² + 2Rh) − R = h (1 − q/2 + q²/2 − 5q³/8 + 7q⁴/8 − 21q⁵/16 + …);

    within |q| ≤ 2⁻⁹ what is left out is below 2⁻⁵³ R. Roots take three times as long.
    """
    q = height * over
    return height * (1.0 + q * (-0.5 + q * (0.5 + q * (-0.625 + q * 0.875))))


@bare
def _outside(px: float, py: float, radius: float, half: float, over: float) -> float:
    """How far a point about the centre is outside of the circle; `half` is 1 / 2R. It hangs on
    the point alone by which way, and so do its last bits."""
    height = (px * px + py * py - radius * radius) * half
    apart = math.sqrt(px * px + py * py) - radius
    return _off(height, over) if abs(height) <= NEAR * radius else apart


@bare
def _to_circle(move: Floats, x: Floats, y: Floats, best: Floats, first: bool) -> None:
    # Not `wide`, since both loops must round alike.
    cx, cy, radius, turn = move[CX], move[CY], move[RADIUS], move[TURN]
    square, half, over = radius * radius, 0.5 / radius, 1.0 / radius
    near, highest = NEAR * radius, 0.0
    if first and abs((x[0] - cx) ** 2 + (y[0] - cy) ** 2 - square) * half <= near:
        for k in range(len(x)):
            px, py = x[k] - cx, y[k] - cy
            height = (px * px + py * py - square) * half
            highest = larger(highest, abs(height))
            best[k] = -turn * _off(height, over)
        if highest <= near:
            return
    for k in range(len(x)):
        error = -turn * _outside(x[k] - cx, y[k] - cy, radius, half, over)
        best[k] = error if first or abs(error) < abs(best[k]) else best[k]


@wide
def _to_arc(move: Floats, x: Floats, y: Floats, best: Floats, first: bool) -> None:
    ax, ay, bx, by = move[AX], move[AY], move[BX], move[BY]
    cx, cy, radius, turn = move[CX], move[CY], move[RADIUS], move[TURN]
    ux, uy, vx, vy = move[UX], move[UY], move[VX], move[VY]
    above_half, half, over = move[WIDE] != 0.0, 0.5 / radius, 1.0 / radius
    for k in range(len(x)):
        px, py = x[k] - cx, y[k] - cy
        inward = -turn * _outside(px, py, radius, half, over)
        to_a = (x[k] - ax) * (x[k] - ax) + (y[k] - ay) * (y[k] - ay)
        to_b = (x[k] - bx) * (x[k] - bx) + (y[k] - by) * (y[k] - by)
        end = math.copysign(math.sqrt(smaller(to_a, to_b)), inward)
        inside = _depth(ux * py - uy * px, px * vy - py * vx, above_half) >= 0.0
        error = inward if inside else end
        best[k] = error if first or abs(error) < abs(best[k]) else best[k]


@wide
def lower_errors(move: Floats, x: Floats, y: Floats, best: Floats, first: bool) -> None:
    """Lower `best` (n ≥ 1,) to the errors of the points x, y (n,) against `move`; set it to them
    when this is the `first` move."""
    if move[RADIUS] == 0.0:
        _to_line(move, x, y, best, first)
    elif move[WIDE] == FULL or _all_in_wedge(move, x, y):
        _to_circle(move, x, y, best, first)
    else:
        _to_arc(move, x, y, best, first)
