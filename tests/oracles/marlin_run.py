"""A slow twin of Marlin's planner: one arc, one move and one block at a time.

`plan_arc` of src/gcode/motion/G2_G3.cpp, and of src/module/planner.cpp `_populate_block` and
`calculate_trapezoid_for_block`; bugfix-2.0.x of 2021-06-28.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

Point = tuple[float, float, float]
Steps = tuple[int, int, int]


def arc_ends(
    begin: Point,
    end: Point,
    offset: tuple[float, float],
    clockwise: bool,
    segment_mm: float,
    min_segments: int,
    correction: int,
) -> list[Point]:
    """The ends of the chords of an arc, the end of the arc last."""
    a, b = -offset[0], -offset[1]
    radius = math.hypot(a, b)
    cx, cy = begin[0] - a, begin[1] - b
    tx, ty = end[0] - cx, end[1] - cy
    if abs(begin[0] - end[0]) < 1e-6 and abs(begin[1] - end[1]) < 1e-6:
        turn = -2.0 * math.pi if clockwise else 2.0 * math.pi
    else:
        turn = math.atan2(a * ty - b * tx, a * tx + b * ty)
        if turn > 0.0 and clockwise:
            turn -= 2.0 * math.pi
        elif turn < 0.0 and not clockwise:
            turn += 2.0 * math.pi
        min_segments = max(1, math.ceil(min_segments * abs(turn) / (2.0 * math.pi)))
    rise = end[2] - begin[2]
    travel = math.hypot(radius * turn, rise)
    segments = max(int(travel / segment_mm), min_segments)
    theta = turn / segments
    cos_t, sin_t = 1.0 - 0.5 * theta**2, theta - theta**3 / 6.0
    points, countdown, z = list[Point](), correction, begin[2]
    for i in range(1, segments):
        countdown -= 1
        if countdown:
            a, b = a * cos_t - b * sin_t, a * sin_t + b * cos_t
        else:
            countdown = correction
            c, s = math.cos(i * theta), math.sin(i * theta)
            a, b = -offset[0] * c + offset[1] * s, -offset[0] * s - offset[1] * c
        z += rise / segments
        points.append((cx + a, cy + b, z))
    return [*points, end]


def kept(points: Sequence[Steps], min_steps: int) -> list[Steps]:
    """Where the machine is after each move; short ones are dropped."""
    at, seen = points[0], [points[0]]
    for point in points[1:]:
        if max(abs(p - q) for p, q in zip(point, at, strict=True)) >= min_steps:
            at = point
        seen.append(at)
    return seen


def acceleration_steps(
    way: Steps, length_mm: float, wanted_mm_s2: float, of_axes: Sequence[int]
) -> int:
    """Steps/s² of the axis with the most steps, whole numbers (`LIMIT_ACCEL_LONG`)."""
    events = max(abs(n) for n in way)
    accel = math.ceil(wanted_mm_s2 * (events / length_mm))
    for steps, most in zip(way, of_axes, strict=True):
        if steps and most < accel:
            accel = min(accel, most * events // abs(steps))
    return accel


def junction_square(
    before: Sequence[float],
    unit: Sequence[float],
    length_mm: float,
    acceleration: float,
    of_axes: Sequence[float],
    deviation_mm: float,
    small_segments: bool,
) -> float:
    """The square of the highest speed through a corner."""
    cosine = -sum(p * q for p, q in zip(before, unit, strict=True))
    if cosine > 0.999999:
        return 0.05**2
    cosine = max(cosine, -0.999999)
    turn = [q - p for p, q in zip(before, unit, strict=True)]
    size = math.sqrt(sum(t * t for t in turn))
    turn = [t / size for t in turn] if size else turn
    allowed = acceleration
    for t, most in zip(turn, of_axes, strict=True):
        if t and allowed * abs(t) > most:
            allowed = abs(most / t)
    sine = math.sqrt(0.5 * (1.0 - cosine))
    square = allowed * deviation_mm * sine / (1.0 - sine)
    if small_segments and length_mm < 1.0 and cosine < -0.7071067812:
        square = min(square, length_mm * allowed / corner_angle(-cosine))
    return square


def corner_angle(cosine: float) -> float:
    """The angle of a cosine by its table of 16 lines (JD_USE_LOOKUP_TABLE)."""
    units = int((1.0 - cosine) * 32768)
    part = 15 - units.bit_length() if units else 15
    low = 1.0 - 0.5**part
    high = 0.5 * low + 0.5 if part < 15 else 0.999999
    of_low = math.acos(low) * (1.00751495 if part else 1.0)
    of_high = math.acos(high) * (1.00751495 if part < 15 else 1.0)
    return of_low + (of_high - of_low) * (cosine - low) / (high - low)


def slowed(lengths: Sequence[float], speeds: Sequence[float], places: int) -> list[float]:
    """The speeds of moves that come while the ring of so many places fills (SLOWDOWN)."""
    found = list[float]()
    for queued, (length, speed) in enumerate(zip(lengths, speeds, strict=True)):
        seconds = length / speed
        if 2 <= queued <= places // 2 - 1 and seconds < 0.02:
            seconds += 2.0 * (0.02 - seconds) / queued
        found.append(length / seconds)
    return found


def jerk_speeds(
    units: Sequence[Sequence[float]], speeds: Sequence[float], max_jerk: Sequence[float]
) -> list[float]:
    """The highest speeds at the starts of moves by classic jerk."""
    found = list[float]()
    safe_before, before = 0.0, [0.0, 0.0, 0.0]
    nominal_before = 0.0
    for unit, nominal in zip(units, speeds, strict=True):
        current = [nominal * u for u in unit]
        safe, limited = nominal, 0
        for speed, most in zip(current, max_jerk, strict=True):
            jerk = abs(speed)
            if jerk > most:
                if limited:
                    if jerk * safe > nominal * most:
                        safe = nominal * most / jerk
                else:
                    safe *= most / jerk
                    limited += 1
        corner = safe
        if nominal_before:
            factor, limited, smaller = 1.0, 0, 1.0
            corner = nominal_before
            if nominal < nominal_before:
                corner = nominal
                smaller = corner / nominal_before
            for axis in range(3):
                leaving, entering = before[axis] * smaller, current[axis]
                if limited:
                    leaving, entering = leaving * factor, entering * factor
                if leaving > entering:
                    coasts = entering > 0.0 or leaving < 0.0
                    jerk = leaving - entering if coasts else max(leaving, -entering)
                else:
                    coasts = entering < 0.0 or leaving > 0.0
                    jerk = entering - leaving if coasts else max(-leaving, entering)
                if jerk > max_jerk[axis]:
                    factor *= max_jerk[axis] / jerk
                    limited += 1
            if limited:
                corner *= factor
            if safe_before > 0.99 * corner and safe > 0.99 * corner:
                corner = safe
        found.append(corner)
        safe_before, before, nominal_before = safe, current, nominal
    return found


def block_seconds(
    events: int, nominal: int, entry: float, exit: float, accel: int, min_rate: int
) -> float:
    """How long a block of `events` steps takes; rates in steps/s, all but the entry and exit whole
    (`calculate_trapezoid_for_block`; `block_phase_isr` of src/module/stepper.cpp)."""
    first = min(max(math.ceil(entry), min_rate), nominal)
    last = min(max(math.ceil(exit), min_rate), nominal)
    up = math.ceil((nominal**2 - first**2) / (2.0 * accel))
    down = math.floor((nominal**2 - last**2) / (2.0 * accel))
    plateau = events - up - down
    if plateau < 0:
        up = math.ceil((2.0 * accel * events - first**2 + last**2) / (4.0 * accel))
        up, plateau = min(max(up, 0), events), 0
    seconds, accelerated, braked, reached = 1.0 / first, 0.0, 0.0, float(first)
    for done in range(1, events):
        if done <= up:
            rate = reached = min(first + accel * accelerated, float(nominal))
            accelerated += 1.0 / rate
        elif done > up + plateau:
            rate = max(reached - accel * braked, float(last))
            braked += 1.0 / rate
        else:
            rate = float(nominal)
        seconds += 1.0 / rate
    return seconds
