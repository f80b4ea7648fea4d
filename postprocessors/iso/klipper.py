"""Klipper's toolhead: chords of one length, corners by a circle, speeds planned to the next stop.

From klippy/toolhead.py (`Move`, `LookAheadQueue.flush`), klippy/kinematics/cartesian.py
(`check_move`) and klippy/extras/gcode_arcs.py (`planArc`) at 84104bb (August 2026), in its order
and in 64-bit floats as there:

1. An arc is ⌊length / resolution⌋ equal chords, their ends on the circle about I, J.
2. A move runs at F or `max_velocity`, whichever is less; one that moves Z is limited in speed and
   acceleration so that Z keeps its own limits.
3. A corner is met at v² = a δ s / (1 − s), s the sine of half the angle between the moves and
   δ = v₉₀² (√2 − 1) / a, v₉₀ the `square_corner_velocity`; no faster than on a circle that touches
   both moves at their middles.
4. From the last move backward and then forward, so that the machine can stop at the end of what
   is queued; what is planned then is not planned again. Short moves between slower ones do not run
   faster than with a lower acceleration a (1 − `minimum_cruise_ratio`): `mcr` below.

Each motor steps where its axis passes the middle between two steps. Times of steps are sent within
25 µs; they are exact here."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from camtool.arrays import Floats, Ints
from camtool.machine.model import Machine
from camtool.toolpath.moves import Kind, Toolpath

from .controllers import KlipperController
from .timed import PlannedMoves, TimedModel, directions, sections, with_chords

FIRST_FLUSH_S, FLUSH_S = 1.0, 0.15
"""Time in the queue from which on its first moves are planned: behind a stop (BUFFER_TIME_HIGH),
and later (LOOKAHEAD_FLUSH_TIME)."""
WAITS = -1.0
"""A move whose speed is that of the one before it."""

STANDS_AT = (Kind.DWELL, Kind.TOOL_CHANGE, Kind.END)
"""Rows at which the queue is emptied. Outputs are switched in passing (`SET_PIN`)."""


_Machine = Machine[Any, Any]


class KlipperModel(TimedModel):
    """Klipper's toolhead on a cartesian machine."""

    def planned(self, path: Toolpath, machine: _Machine) -> PlannedMoves:
        """Return the moves with the speeds that its look-ahead plans."""
        controller = machine.controller
        assert isinstance(controller, KlipperController)
        lines, row = with_chords(path, *_chords(path, controller.arc_resolution_mm))
        length, unit = directions(lines)
        speed, acceleration = _limits(lines, length, unit, machine)
        speeds = np.zeros((3, len(lines)))
        for part in sections(np.flatnonzero(length > 0.0), np.isin(lines.kind, STANDS_AT)):
            moves = length[part], unit[part], speed[part], acceleration[part]
            speeds[:, part] = np.sqrt(look_ahead(*moves, controller))
        return PlannedMoves(lines, row, length, acceleration, *speeds)

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, as sentences for the report."""
        controller = machine.controller
        assert isinstance(controller, KlipperController)
        return (
            f"arcs are chords of {controller.arc_resolution_mm:g} mm (gcode_arcs resolution)",
            f"corners of 90° at {controller.square_corner_velocity_mm_s:g} mm/s "
            "(square_corner_velocity), speeds planned to the next stop",
            "macros and outputs take no time",
        )


def _limits(
    path: Toolpath, length: Floats, unit: Floats, machine: _Machine
) -> tuple[Floats, Floats]:
    """Return the highest speed (M,) mm/s and the acceleration (M,) mm/s² of each move."""
    controller = machine.controller
    assert isinstance(controller, KlipperController)
    feed = np.where(path.is_feed, path.feed, machine.rapid_mm_min) / 60.0
    speed = np.minimum(feed, controller.max_velocity_mm_s)
    z_speed = controller.max_z_velocity_mm_s or controller.max_velocity_mm_s
    z_acceleration = controller.max_z_accel_mm_s2 or controller.max_accel_mm_s2
    with np.errstate(divide="ignore", over="ignore"):
        ratio = 1.0 / np.abs(unit[:, 2])
    speed = np.minimum(speed, z_speed * ratio)
    return speed, np.minimum(controller.max_accel_mm_s2, z_acceleration * ratio)


def look_ahead(
    length: Floats,
    unit: Floats,
    speed: Floats,
    acceleration: Floats,
    controller: KlipperController,
) -> Floats:
    """Return (3, K) (mm/s)²: the squares of the speeds at the start, in the middle and at the end
    of each of K moves between two stops.

    Moves enter a queue one by one. As soon as the queue holds enough time, its first moves are
    planned with what is known until then."""
    deviation, ratio = _junction_deviation_mm(controller), 1.0 - controller.minimum_cruise_ratio
    delta = 2.0 * length * acceleration
    mcr_delta = np.minimum(2.0 * length * controller.max_accel_mm_s2 * ratio, delta)
    corner = corners(unit, delta, acceleration, deviation)
    queue = _Queue(delta, mcr_delta, speed**2, corner)
    left_s, least_s = FIRST_FLUSH_S, (length / speed).tolist()
    for k, seconds in enumerate(least_s):
        if k == queue.first:
            continue
        queue.join(k)
        left_s -= seconds
        if left_s <= 0.0:
            queue.flush(k + 1, lazy=True)
            left_s = FLUSH_S
    queue.flush(len(least_s))
    return queue.squares


class _Queue:
    """Queue of moves; those from `first` on are not planned yet. Speeds are kept as squares,
    (mm/s)²."""

    def __init__(self, delta: Floats, mcr_delta: Floats, limit: Floats, corner: Floats) -> None:
        self._delta, self._mcr_delta = delta.tolist(), mcr_delta.tolist()
        self._limit, self._corner = limit.tolist(), corner.tolist()
        self._start, self._mcr_start = [0.0] * len(delta), [0.0] * len(delta)
        self.squares = np.zeros((3, len(delta)))
        self.first = 0

    def join(self, k: int) -> None:
        """Limit the speed at the start of move k by the moves before it."""
        reached = self._start[k - 1] + self._delta[k - 1]
        start = min(self._limit[k], self._limit[k - 1], reached, self._corner[k])
        self._start[k] = start
        self._mcr_start[k] = min(start, self._mcr_start[k - 1] + self._mcr_delta[k - 1])

    def flush(self, high: int, *, lazy: bool = False) -> None:
        """Plan the moves up to `high`, with a stop behind them. If `lazy`, plan only those before
        the last peak of speed, which a later move can hardly change.

        A move cannot accelerate where the speed at its start is limited only by what the moves
        behind it can brake: such moves wait for the peak of an earlier one. `mcr`: the same plan
        with the lower acceleration of the minimum cruise ratio, which bounds the peaks."""
        plan = list[tuple[float, float, float]]()
        next_start = next_mcr = peak = 0.0
        pending, end = 0, high
        for k in range(high - 1, self.first - 1, -1):
            reachable = next_start + self._delta[k]
            start = min(self._start[k], reachable)
            pending += 1
            reach_mcr = next_mcr + self._mcr_delta[k]
            mcr_start = min(self._mcr_start[k], reach_mcr)
            cruise = WAITS
            if mcr_start < reach_mcr:
                if mcr_start + self._mcr_delta[k] > next_mcr or pending > 1:
                    if lazy and peak:
                        end, lazy = k + pending, False
                    peak = (mcr_start + reach_mcr) * 0.5
                cruise = min((start + reachable) * 0.5, self._limit[k], peak)
                pending = 0
            plan.append((start, cruise, next_start))
            next_start, next_mcr = start, mcr_start
        if lazy:
            return
        before, plan = 0.0, plan[::-1]
        for k in range(self.first, end):
            start, cruise, after = plan[k - self.first]
            before = min(before, start) if cruise == WAITS else cruise
            self.squares[:, k] = min(start, before), before, min(after, before)
        self.first = end


def _junction_deviation_mm(controller: KlipperController) -> float:
    """Return the junction deviation δ that belongs to the square corner velocity, mm."""
    square = controller.square_corner_velocity_mm_s**2
    return square * (math.sqrt(2.0) - 1.0) / controller.max_accel_mm_s2


def corners(unit: Floats, delta: Floats, acceleration: Floats, deviation_mm: float) -> Floats:
    """Return (K,) (mm/s)²: the square of the highest speed at the start of each move that the
    corner with the move before allows; 0 for the first move, inf where two moves are collinear."""
    result = np.full(len(unit), np.inf)
    result[:1] = 0.0
    cosine = -(unit[1:] * unit[:-1]).sum(axis=1)
    sine = np.sqrt(np.maximum(0.5 * (1.0 - cosine), 0.0))
    half_cosine = np.sqrt(np.maximum(0.5 * (1.0 + cosine), 0.0))
    bends = (1.0 - sine > 0.0) & (half_cosine > 0.0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        by_deviation = sine / (1.0 - sine) * deviation_mm
        by_middles = 0.25 * sine / half_cosine
    lower = np.minimum(acceleration[1:], acceleration[:-1]) * by_deviation
    middles = np.minimum(delta[1:], delta[:-1]) * by_middles
    result[1:][bends] = np.minimum(lower, middles)[bends]
    return result


def _chords(path: Toolpath, resolution_mm: float) -> tuple[Ints, Floats]:
    """Return the number of moves that each row becomes (N,), and the ends (P, 3) mm of all but the
    last move of each row."""
    counts = np.ones(len(path), dtype=np.int64)
    arcs = np.flatnonzero(path.is_arc)
    begin, end, centre = path.starts_of(arcs), path.end[arcs], path.centre[arcs]
    arm, aim = begin[:, :2] - centre, end[:, :2] - centre
    turn = np.arctan2(
        arm[:, 0] * aim[:, 1] - arm[:, 1] * aim[:, 0],
        arm[:, 0] * aim[:, 0] + arm[:, 1] * aim[:, 1],
    )
    turn = np.where(turn < 0.0, turn + 2.0 * np.pi, turn)
    turn = np.where(path.kind[arcs] == Kind.ARC_CW, turn - 2.0 * np.pi, turn)
    same = (begin[:, :2] == end[:, :2]).all(axis=1)
    turn = np.where((turn == 0.0) & same, 2.0 * np.pi, turn)
    rise = end[:, 2] - begin[:, 2]
    travel = np.hypot(np.hypot(arm[:, 0], arm[:, 1]) * turn, rise)
    counts[arcs] = np.maximum(np.floor(travel / resolution_mm), 1.0).astype(np.int64)
    arc = np.repeat(np.arange(len(arcs)), counts[arcs] - 1)
    first = np.cumsum(counts[arcs] - 1) - (counts[arcs] - 1)
    number = np.arange(len(arc)) - first[arc] + 1
    share = number / counts[arcs][arc]
    cosine, sine = np.cos(share * turn[arc]), np.sin(share * turn[arc])
    inner = np.empty((len(arc), 3))
    inner[:, 0] = centre[arc, 0] + arm[arc, 0] * cosine - arm[arc, 1] * sine
    inner[:, 1] = centre[arc, 1] + arm[arc, 0] * sine + arm[arc, 1] * cosine
    inner[:, 2] = begin[arc, 2] + share * rise[arc]
    return counts, inner
