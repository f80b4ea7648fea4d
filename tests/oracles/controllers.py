"""The interpolators of the PIC18F8720 controller, literally, in plain Python.

Written from the rules alone (thesis L807-1042 and its annex A.3 to A.6): magnitudes and numbered
quadrants, as the firmware keeps them. Nothing here is shared with `camtool.kernels`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

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


def stairs(x: int, y: int, clockwise: bool, radius_square: int) -> Iterator[Point]:
    """Positions after each iteration of the stairs, D by squares, for ever."""
    quadrant = first_quadrant(x, y, clockwise)
    xo, yo = abs(x), abs(y)
    while True:
        d = xo * xo + yo * yo - radius_square
        grows = x_grows(quadrant, clockwise)
        if d <= 0:
            xo, yo = (xo + 1, yo) if grows else (xo, yo + 1)
        else:
            xo, yo = (xo, yo - 1) if grows else (xo - 1, yo)
        sign_x, sign_y = SIGNS[quadrant]
        yield sign_x * xo, sign_y * yo
        if (yo if grows else xo) == 0:
            quadrant = next_quadrant(quadrant, clockwise)


def dda_line(a: int, b: int) -> Iterator[tuple[Point, bool]]:
    """Position after each pass and whether the pass gave a pulse, until the line ends."""
    limit = math.sqrt(a**2 + b**2)
    qx = qy = 0.0
    cnt_x = cnt_y = 0
    while cnt_x < a or cnt_y < b:
        pulse = False
        qx = qx + a
        if cnt_x < a and qx > limit:
            qx = qx - limit
            cnt_x += 1
            pulse = True
        qy = qy + b
        if cnt_y < b and qy > limit:
            qy = qy - limit
            cnt_y += 1
            pulse = True
        yield (cnt_x, cnt_y), pulse


def dda_arc(x: int, y: int, clockwise: bool) -> Iterator[tuple[Point, bool]]:
    """Position after each pass of the circular DDA and whether it gave a pulse, for ever.

    Counters and crosswise registers of the annex; a quarter whose growing counter can fill no
    more ends with its shrinking one.
    """
    quadrant = first_quadrant(x, y, clockwise)
    radius = round(math.hypot(x, y))
    xo, yo = abs(x), abs(y)
    while True:
        sign_x, sign_y = SIGNS[quadrant]
        px, py = yo, xo
        qx = qy = 0
        if x_grows(quadrant, clockwise):
            cnt_x, cnt_y = xo, radius - yo
            while cnt_y < radius:
                pulse = False
                qx += px
                if qx > radius and cnt_x < radius:
                    qx -= radius
                    cnt_x += 1
                    py += 1
                    pulse = True
                qy += py
                if qy > radius and cnt_y < radius:
                    qy -= radius
                    cnt_y += 1
                    px -= 1
                    pulse = True
                xo, yo = cnt_x, radius - cnt_y
                yield (sign_x * xo, sign_y * yo), pulse
        else:
            cnt_x, cnt_y = radius - xo, yo
            while cnt_x < radius:
                pulse = False
                qy += py
                if qy > radius and cnt_y < radius:
                    qy -= radius
                    cnt_y += 1
                    px += 1
                    pulse = True
                qx += px
                if qx > radius and cnt_x < radius:
                    qx -= radius
                    cnt_x += 1
                    py -= 1
                    pulse = True
                xo, yo = radius - cnt_x, cnt_y
                yield (sign_x * xo, sign_y * yo), pulse
        quadrant = next_quadrant(quadrant, clockwise)


def play(
    steps: Sequence[int], step: float, low: float, high: float, compensation: int, direction: int
) -> tuple[list[float], int]:
    """Slide positions and number of reversals, one motor step at a time from steps[0]."""
    at = motor = steps[0]
    slide = at * step
    reversals = 0
    out = []
    for wanted in steps:
        while at != wanted:
            sense = 1 if wanted > at else -1
            pulses = 1
            if sense != direction:
                direction = sense
                reversals += 1
                pulses += compensation
            at += sense
            for _ in range(pulses):
                motor += sense
                if slide < motor * step + low:
                    slide = motor * step + low
                if slide > motor * step + high:
                    slide = motor * step + high
        out.append(slide)
    return out, reversals
