"""Slow twins of grbl: one number, one chord, one tick and one block at a time.

32-bit arithmetic is that of numpy's scalars. The planner is the whole ring, planned anew from its
last block to its first and back whenever a block comes in.
"""

from __future__ import annotations

from collections import deque

import numpy as np

F = np.float32


def number_as_read(text: str) -> np.float32:
    """Digits to a float as grbl does it, by factors of 0.01 and 0.1."""
    value, exponent, digits, point = 0, 0, 0, False
    for sign in text.lstrip("+-"):
        if sign == ".":
            point = True
            continue
        digits += 1
        if digits > 8:
            exponent += 0 if point else 1
            continue
        value = value * 10 + int(sign)
        exponent -= 1 if point else 0
    result = F(value)
    while exponent <= -2:
        result = F(result * F(0.01))
        exponent += 2
    if exponent == -1:
        result = F(result * F(0.1))
    while exponent > 0:
        result = F(result * F(10.0))
        exponent -= 1
    return F(-result) if text.startswith("-") else result


def chord_ends(
    begin: tuple[np.float32, ...],
    end: tuple[np.float32, ...],
    offset: tuple[np.float32, np.float32],
    clockwise: bool,
    tolerance_mm: float,
    correction: int = 12,
    real: type[np.floating] = np.float32,
) -> list[tuple[np.float32, ...]]:
    """The targets of one arc, the end of the arc last; begin and end (x, y, z) mm. `real`: the
    type of the centre and the radius vector; grblHAL's is a double, but for what it sums up in a
    float before."""
    i, j = offset
    cx, cy = real(begin[0]) + real(i), real(begin[1]) + real(j)
    rx, ry = real(-i), real(-j)
    tx, ty = real(end[0]) - cx, real(end[1]) - cy
    turn = F(np.arctan2(rx * ty - ry * tx, rx * tx + ry * ty))
    if clockwise and turn >= F(-5e-7):
        turn = F(turn - real(2.0 * np.pi))
    if not clockwise and turn <= F(5e-7):
        turn = F(turn + real(2.0 * np.pi))
    radius = np.sqrt(i * i + j * j)
    inner = F(tolerance_mm) * (F(2.0) * radius - F(tolerance_mm))
    segments = 0
    if inner > 0.0:
        segments = int(np.floor(np.abs(F(0.5) * turn * radius) / np.sqrt(inner))) % 65536
    points: list[tuple[np.float32, ...]] = []
    if segments:
        theta = turn / F(segments)
        rise = (end[2] - begin[2]) / F(segments)
        cos_t = F(2.0) - theta * theta
        sin_t = theta * F(0.16666667) * (cos_t + F(4.0))
        cos_t = cos_t * F(0.5)
        z, count = begin[2], 0
        for number in range(1, segments):
            if count < correction:
                rx, ry = rx * cos_t - ry * sin_t, real(F(rx * sin_t + ry * cos_t))
                count += 1
            else:
                c, s = np.cos(F(number) * theta), np.sin(F(number) * theta)
                rx, ry = real(-i * c + j * s), real(-i * s - j * c)
                count = 0
            z = z + rise
            points.append((F(cx + rx), F(cy + ry), z))
    return [*points, end]


def nearest_step(mm: np.float32, steps_per_mm: np.float32) -> int:
    """The step of a target: halves away from zero."""
    product = float(F(mm * steps_per_mm))
    whole = int(abs(product))
    whole += abs(product) - whole >= 0.5
    return -whole if product < 0.0 else whole


def ticks(way: tuple[int, int, int], levels: list[int] | None = None) -> list[tuple[int, ...]]:
    """Return the positions of the axes after each event of a block; `levels` is the smoothing of
    each (0 to 3), with which an event has 2^level ticks."""
    most = max(abs(n) for n in way)
    count, steps = most << 3, [abs(n) << 3 for n in way]
    counters, position = [count >> 1] * 3, [0, 0, 0]
    seen = []
    for event in range(most):
        level = levels[event] if levels else 0
        for _ in range(1 << level):
            for axis in range(3):
                counters[axis] += steps[axis] >> level
                if counters[axis] > count:
                    counters[axis] -= count
                    position[axis] += 1 if way[axis] > 0 else -1
        seen.append(tuple(position))
    return seen


def ring_entries(gain: list[float], limit: list[float], places: int) -> list[float]:
    """Squares of the entry speeds of blocks that come as fast as the ring of `places` takes
    them; one of the places stays empty. Each block is [gain, limit, entry]."""
    coming = deque([g, m, 0.0] for g, m in zip(gain, limit, strict=True))
    ring: deque[list[float]] = deque()
    entered: list[float] = []
    while coming or ring:
        while coming and len(ring) < places - 1:
            ring.append(coming.popleft())
            _plan(ring)
        entered.append(ring.popleft()[2])
    return entered


def _plan(ring: deque[list[float]]) -> None:
    """All but the block under way, whose entry is a fact: backward from rest, then forward."""
    after = 0.0
    for index in range(len(ring) - 1, 0, -1):
        own = ring[index]
        own[2] = after = min(own[1], after + own[0])
    for index in range(1, len(ring)):
        before, own = ring[index - 1], ring[index]
        own[2] = min(own[2], before[2] + before[0])


def seconds_by_steps(d: float, v: float, a: float, ends: tuple[float, float], n: int) -> float:
    """The time of a block by summing up ds / v(s) over `n` pieces, finest at its ends."""
    first, last = ends
    edge = 0.5 * d * (1.0 - np.cos(np.linspace(0.0, np.pi, n + 1)))
    middle = 0.5 * (edge[1:] + edge[:-1])
    speed = np.sqrt(np.minimum(first**2 + 2.0 * a * middle, last**2 + 2.0 * a * (d - middle)))
    return float(np.sum(np.diff(edge) / np.minimum(speed, v)))
