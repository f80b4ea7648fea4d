"""A slow twin of Klipper's toolhead: one move at a time, in the words of its sources.

`klippy/toolhead.py` (`Move`, `LookAheadQueue.flush`), `klippy/kinematics/cartesian.py`
(`check_move`), `klippy/extras/gcode_arcs.py` (`planArc`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

Point = tuple[float, float, float]


@dataclass
class Settings:
    max_velocity: float
    max_accel: float
    max_z_velocity: float
    max_z_accel: float
    square_corner_velocity: float
    minimum_cruise_ratio: float

    @property
    def junction_deviation(self) -> float:
        return self.square_corner_velocity**2 * (math.sqrt(2.0) - 1.0) / self.max_accel


@dataclass
class Move:
    """A move from `start` to `end` at `speed` mm/s."""

    start: Point
    end: Point
    speed: float
    settings: Settings
    ways: list[float] = field(init=False)
    length: float = field(init=False)
    max_start_v2: float = 0.0
    max_mcr_start_v2: float = 0.0
    start_v2: float = 0.0
    cruise_v2: float = 0.0
    end_v2: float = 0.0

    def __post_init__(self) -> None:
        said = self.settings
        way = [e - s for s, e in zip(self.start, self.end, strict=True)]
        self.length = math.sqrt(sum(d * d for d in way))
        self.ways = [d / self.length for d in way]
        self.accel = said.max_accel
        self.max_cruise_v2 = min(self.speed, said.max_velocity) ** 2
        self.mcr_delta_v2 = 2.0 * self.length * said.max_accel * (1.0 - said.minimum_cruise_ratio)
        if way[2]:
            ratio = self.length / abs(way[2])
            self.max_cruise_v2 = min(self.max_cruise_v2, (said.max_z_velocity * ratio) ** 2)
            self.accel = min(self.accel, said.max_z_accel * ratio)
        self.delta_v2 = 2.0 * self.length * self.accel
        self.mcr_delta_v2 = min(self.mcr_delta_v2, self.delta_v2)

    def calc_junction(self, before: Move) -> None:
        limits = [self.max_cruise_v2, before.max_cruise_v2, before.max_start_v2 + before.delta_v2]
        cosine = -sum(a * b for a, b in zip(self.ways, before.ways, strict=True))
        sine = math.sqrt(max(0.5 * (1.0 - cosine), 0.0))
        half_cosine = math.sqrt(max(0.5 * (1.0 + cosine), 0.0))
        if 1.0 - sine > 0.0 and half_cosine > 0.0:
            share = sine / (1.0 - sine) * self.settings.junction_deviation
            quarter = 0.25 * sine / half_cosine
            limits += [share * self.accel, share * before.accel]
            limits += [self.delta_v2 * quarter, before.delta_v2 * quarter]
        self.max_start_v2 = min(limits)
        self.max_mcr_start_v2 = min(
            self.max_start_v2, before.max_mcr_start_v2 + before.mcr_delta_v2
        )

    @property
    def seconds(self) -> float:
        half = 0.5 / self.accel
        first = (self.cruise_v2 - self.start_v2) * half
        last = (self.cruise_v2 - self.end_v2) * half
        start, cruise, end = (math.sqrt(v) for v in (self.start_v2, self.cruise_v2, self.end_v2))
        ramps = first / ((start + cruise) * 0.5) + last / ((end + cruise) * 0.5)
        return ramps + (self.length - first - last) / cruise


def flush(queue: list[Move], lazy: bool = False) -> list[Move]:
    """Plan moves of the queue, to a stop behind the last one, and take them out of it."""
    update, flush_count = lazy, len(queue)
    info: list[tuple[float, float | None, float]] = []
    next_start = next_mcr = peak = 0.0
    pending = 0
    for index in range(len(queue) - 1, -1, -1):
        move = queue[index]
        reachable = next_start + move.delta_v2
        start = min(move.max_start_v2, reachable)
        cruise = None
        pending += 1
        reach_mcr = next_mcr + move.mcr_delta_v2
        mcr = min(move.max_mcr_start_v2, reach_mcr)
        if mcr < reach_mcr:
            if mcr + move.mcr_delta_v2 > next_mcr or pending > 1:
                if update and peak:
                    flush_count = index + pending
                    update = False
                peak = (mcr + reach_mcr) * 0.5
            cruise = min((start + reachable) * 0.5, move.max_cruise_v2, peak)
            pending = 0
        info.append((start, cruise, next_start))
        next_start, next_mcr = start, mcr
    if update or not flush_count:
        return []
    before = 0.0
    for move, (start, known, after) in zip(
        queue[:flush_count], list(reversed(info))[:flush_count], strict=True
    ):
        cruise = min(before, start) if known is None else known
        move.start_v2, move.cruise_v2 = min(start, cruise), cruise
        move.end_v2 = min(after, cruise)
        before = cruise
    done = queue[:flush_count]
    del queue[:flush_count]
    return done


def planned(points: Sequence[Point], speeds: Sequence[float], settings: Settings) -> list[Move]:
    """The moves between points, without a stop on the way."""
    queue, done = list[Move](), list[Move]()
    flush_time = 1.0
    for start, end, speed in zip(points, points[1:], speeds, strict=False):
        if start == end:
            continue
        move = Move(start, end, speed, settings)
        queue.append(move)
        if len(queue) == 1:
            continue
        move.calc_junction(queue[-2])
        flush_time -= move.length / math.sqrt(move.max_cruise_v2)
        if flush_time <= 0.0:
            done += flush(queue, lazy=True)
            flush_time = 0.15
    return done + flush(queue)


def arc_ends(
    begin: Point, end: Point, offset: tuple[float, float], clockwise: bool, resolution: float
) -> list[Point]:
    """The ends of the chords of an arc, the end of the arc last."""
    px, py = -offset[0], -offset[1]
    cx, cy = begin[0] - px, begin[1] - py
    tx, ty = end[0] - cx, end[1] - cy
    turn = math.atan2(px * ty - py * tx, px * tx + py * ty)
    if turn < 0.0:
        turn += 2.0 * math.pi
    if clockwise:
        turn -= 2.0 * math.pi
    if turn == 0.0 and begin[:2] == end[:2]:
        turn = 2.0 * math.pi
    rise = end[2] - begin[2]
    flat = math.hypot(px, py) * turn
    travel = math.hypot(flat, rise) if rise else abs(flat)
    count = int(max(1.0, math.floor(travel / resolution)))
    points = []
    for i in range(1, count):
        c, s = math.cos(i * turn / count), math.sin(i * turn / count)
        x = cx - offset[0] * c + offset[1] * s
        y = cy - offset[0] * s - offset[1] * c
        points.append((x, y, begin[2] + i * (rise / count)))
    return [*points, end]
