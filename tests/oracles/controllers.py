"""The interpolators of the PIC18F8720 controller, literally, in plain Python.

Written from the rules alone (thesis L807-1042 and its annex A.3 to A.6): magnitudes and numbered
quadrants, as the firmware keeps them. Nothing here is shared with `camtool.kernels`.
"""

from __future__ import annotations

from collections.abc import Iterator

Point = tuple[int, int]

# Quadrants are numbered clockwise from the top; signs of x and y in each.
SIGNS = {1: (1, 1), 2: (1, -1), 3: (-1, -1), 4: (-1, 1)}


def first_quadrant(x: int, y: int, clockwise: bool) -> int:
    """The quadrant in which the motion from (x, y) begins."""
    if x > 0 and y > 0:
        return 1
    if x > 0 and y < 0:
        return 2
    if x < 0 and y < 0:
        return 3
    if x < 0 and y > 0:
        return 4
    # On an axis: the quadrant that the motion enters.
    if x == 0 and y > 0:
        return 1 if clockwise else 4
    if x > 0 and y == 0:
        return 2 if clockwise else 1
    if x == 0 and y < 0:
        return 3 if clockwise else 2
    if x < 0 and y == 0:
        return 4 if clockwise else 3
    raise ValueError("an arc cannot start at its centre")


def next_quadrant(quadrant: int, clockwise: bool) -> int:
    """The quadrant after this one in the sense of the motion."""
    if clockwise:
        return 1 if quadrant == 4 else quadrant + 1
    return 4 if quadrant == 1 else quadrant - 1


def x_grows(quadrant: int, clockwise: bool) -> bool:
    """Quadrants 1, 3: G02 increments |x|, G03 decrements it; quadrants 2, 4 the reverse."""
    if quadrant in (1, 3):
        return clockwise
    return not clockwise


def direct_search(x: int, y: int, clockwise: bool, error: int = 0) -> Iterator[Point]:
    """Positions after each iteration of the direct search, for ever."""
    quadrant = first_quadrant(x, y, clockwise)
    xo, yo = abs(x), abs(y)
    d = error
    while True:
        if x_grows(quadrant, clockwise):
            dx, dy = 2 * xo + 1, -2 * yo + 1
        else:
            dx, dy = -2 * xo + 1, 2 * yo + 1
        changed = False
        while not changed:
            d1, d2, d3 = abs(d + dx), abs(d + dy), abs(d + dx + dy)
            single, least = ("Y", d2) if d1 > d2 else ("X", d1)
            step = "XY" if least > d3 else single
            grows = x_grows(quadrant, clockwise)
            if "X" in step:
                xo += 1 if grows else -1
                d += dx
                dx += 2
            if "Y" in step:
                yo += -1 if grows else 1
                d += dy
                dy += 2
            sign_x, sign_y = SIGNS[quadrant]
            yield sign_x * xo, sign_y * yo
            changed = (yo if grows else xo) == 0
        quadrant = next_quadrant(quadrant, clockwise)
