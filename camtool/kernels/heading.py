"""Which way an arc goes at a point, and the whole number next to its radius.

Shared by the arc kernels. Exact, because only signs of integers are looked at, and the root of an
integer is never so near to a half that a float64 could round it to the wrong side (the root of
k² + k is 1/(8k) away from k + 1/2). Compiled, because compiled loops call it.
"""

from __future__ import annotations

import math

from camtool.kernels.compiled import inner, kernel


@inner
def heading(x: int, y: int, clockwise: bool) -> tuple[int, int]:
    """Direction (±1, ±1) of the motion at (x, y) ≠ (0, 0) on an arc about (0, 0).

    Clockwise the velocity is along (y, −x). On an axis one of the two vanishes: there the
    coordinate that is not 0 shrinks, so its direction is against its sign, and the quadrant is
    the one that the motion enters.
    """
    turn = 1 if clockwise else -1
    along_x, along_y = turn * y, -turn * x
    sx = -1 if along_x < 0 or (along_x == 0 and x > 0) else 1
    sy = -1 if along_y < 0 or (along_y == 0 and y > 0) else 1
    return sx, sy


@kernel
def rounded_radius(x: int, y: int) -> int:
    """√(x² + y²) to the nearest step."""
    return math.floor(math.sqrt(x * x + y * y) + 0.5)
