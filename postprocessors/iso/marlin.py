"""Marlin's planner: chords of arcs, whole steps, corners by junction deviation or classic jerk.

From Marlin 2.0.9 (bugfix-2.0.x of 2021-06-28): src/gcode/motion/G2_G3.cpp (`plan_arc`),
src/module/planner.cpp (`_populate_block`, `reverse_pass`, `forward_pass`,
`calculate_trapezoid_for_block`) and src/module/stepper.cpp, in its order:

1. An arc is ⌊length / `mm_per_arc_segment`⌋ chords, and at least `min_arc_segments` of a circle;
   the radius vector is turned by a short series, and computed anew every `arc_correction` chords.
2. Targets go to the nearest steps. A move of fewer than `min_steps` steps of every axis is
   dropped, and its way is added to the next one.
3. Each axis keeps its highest speed and acceleration; together moves accelerate at
   `travel_acceleration_mm_s2`.
4. Corners: v² = a δ s / (1 − s); short moves that hardly bend count as parts of an arc. Or by
   classic jerk: no axis changes its speed by more than its own.
5. The ring of blocks is planned backward from rest and forward.
6. A trapezoid in whole steps, no slower than `min_step_hz` at its ends.

Computed in 64-bit floats where Marlin has 32: a target within a hundredth of a step of the middle
between two may go to the other one."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.machine.model import Machine
from camtool.records import replace
from camtool.simulation.legs import coded_steps_mm
from camtool.simulation.speed_plan import SpeedPlan, axis_limits
from camtool.toolpath.moves import EVENTS_AT_REST, Kind, Toolpath, read_only

from .controllers import MarlinController
from .timed import PlannedMoves, TimedModel, directions, profile, sections, with_chords

FIRST_MOVE_DELAY_S = 0.1
"""A stop with fewer than `FEW_MOVES` moves behind it waits so long for more of them
(BLOCK_DELAY_FOR_1ST_MOVE ms, `get_current_block`)."""
FEW_MOVES = 3

EXACT = 100
"""Steps of a ramp that are added up one by one, where it is slowest."""

SHORT_MM = 1.0
OCTAGON_COS = -0.7071067812
"""Moves shorter than this whose corner bends by less than 45° count as parts of an arc
(JD_HANDLE_SMALL_SEGMENTS)."""
STRAIGHT_COS = 0.999999
ANGLE_PARTS = 16
ANGLE_FACTOR = 1.00751495
"""Its angle of a corner is linear between cosines of 1 − 2⁻ⁱ, and this much too large at them
(JD_USE_LOOKUP_TABLE)."""

MIN_SPEED_MM_S = 0.05
"""The speed straight back (MINIMUM_PLANNER_SPEED)."""

MIN_ARC_MM = 0.001
SAME_MM = 1e-6
"""Ends of an arc that are nearer than this make a full circle (NEAR)."""


_Machine = Machine[Any, Any]


class MarlinModel(TimedModel):
    """Marlin's planner on a cartesian machine."""

    def planned(self, path: Toolpath, machine: _Machine) -> PlannedMoves:
        """Return the moves with the speeds that its ring buffer of blocks plans."""
        controller = machine.controller
        assert isinstance(controller, MarlinController)
        lines, row = with_chords(path, *_chords(path, controller))
        steps = kept_steps(_nearest_steps(lines, machine), controller.min_steps)
        step_mm = coded_steps_mm(machine)
        lines = replace(lines, start=steps[0] * step_mm, end=read_only(steps[1:] * step_mm))
        length, unit = directions(lines)
        events = np.abs(np.diff(steps, axis=0)).max(axis=1).astype(np.float64)
        feed = np.where(lines.is_feed, lines.feed, machine.rapid_mm_min) / 60.0
        highest, acceleration = _limits(length, unit, events, machine)
        speeds, extra_s = np.zeros((3, len(lines))), np.zeros(len(lines))
        for part in sections(np.flatnonzero(length > 0.0), np.isin(lines.kind, EVENTS_AT_REST)):
            speed = np.minimum(slowed(length[part], feed[part], controller), highest[part])
            moves = length[part], unit[part], speed, acceleration[part]
            corner = _corners(*moves, machine)
            plan = SpeedPlan(moves[0], moves[2], moves[3], corner)
            squares = plan.squares(controller.buffer_blocks - 1)
            speeds[:, part] = profile(plan, squares)
            blocks = _rates(plan, squares, events[part], controller.min_step_hz)
            extra_s[part] = blocks.seconds() - plan.seconds(squares)
            extra_s[part[0]] += FIRST_MOVE_DELAY_S if len(part) < FEW_MOVES else 0.0
        entry, peak, exit = speeds
        return PlannedMoves(lines, row, length, acceleration, entry, peak, exit, extra_s)

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, as sentences for the report."""
        controller = machine.controller
        assert isinstance(controller, MarlinController)
        corner = f"a junction deviation of {controller.junction_deviation_mm:g} mm (M205 J)"
        if controller.classic_jerk_mm_s is not None:
            corner = "classic jerk of {:g}, {:g}, {:g} mm/s (M205 X Y Z)".format(
                *controller.classic_jerk_mm_s
            )
        return (
            f"arcs are chords of {controller.mm_per_arc_segment:g} mm (MM_PER_ARC_SEGMENT)",
            f"corners by {corner}, speeds planned {controller.buffer_blocks - 1} blocks ahead",
            "the sender keeps its buffer full; it has no S-curves and no input shaping",
        )


def _nearest_steps(path: Toolpath, machine: _Machine) -> Ints:
    """Return (M + 1, 3) steps: the start and all ends of moves, halves rounded away from zero."""
    scaled = np.concatenate([path.start[None, :], path.end]) / coded_steps_mm(machine)
    nearest = np.copysign(np.floor(np.abs(scaled) + 0.5), scaled)
    return np.asarray(nearest.astype(np.int64))


def kept_steps(steps: Ints, min_steps: int) -> Ints:
    """Return (M + 1, 3) the position after each move, in steps: a move of fewer than `min_steps`
    steps on every axis is dropped, and the next one begins where it began."""
    travel = np.abs(np.diff(steps, axis=0)).max(axis=1, initial=0)
    if not ((travel > 0) & (travel < min_steps)).any():
        return steps
    x, y, z = steps[0].tolist()
    places = [(x, y, z)]
    for u, v, w in steps[1:].tolist():
        if max(abs(u - x), abs(v - y), abs(w - z)) >= min_steps:
            x, y, z = u, v, w
        places.append((x, y, z))
    return np.array(places, dtype=np.int64)


def slowed(length: Floats, speed: Floats, controller: MarlinController) -> Floats:
    """Return the speeds (K,) mm/s of the moves after a stop. Short moves that come while the
    buffer is less than half full are slowed down (SLOWDOWN). Moves are assumed to come faster than
    they are executed, so that the buffer holds all moves before each."""
    ahead = np.arange(2, min(len(speed), controller.buffer_blocks // 2))
    own_s = length[ahead] / speed[ahead]
    missing_s = np.maximum(controller.min_segment_ms / 1000.0 - own_s, 0.0)
    speed = speed.copy()
    speed[ahead] = length[ahead] / (own_s + 2.0 * missing_s / ahead)
    return speed


def _limits(
    length: Floats, unit: Floats, events: Floats, machine: _Machine
) -> tuple[Floats, Floats]:
    """Return the highest speed (M,) mm/s that the axes allow, and the acceleration (M,) mm/s² of
    each move, which is a whole number of steps/s² of the axis with the most steps."""
    controller = machine.controller
    assert isinstance(controller, MarlinController)
    moves = length > 0.0
    rates = axis_limits(machine, "max_rate_mm_min") / 60.0
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        speed = (rates / np.abs(unit)).min(axis=1)
        per_mm = np.where(moves, events / length, 1.0)
    acceleration = np.ceil(controller.travel_acceleration_mm_s2 * per_mm)
    step_mm = coded_steps_mm(machine)
    of_axes = np.floor(axis_limits(machine, "acceleration_mm_s2") / step_mm)
    for axis in range(3):
        steps = np.rint(length * np.abs(unit[:, axis]) / step_mm[axis])
        slower = (steps > 0.0) & (of_axes[axis] < acceleration)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            possible = np.floor(of_axes[axis] * events / steps)
        acceleration = np.where(slower, np.minimum(acceleration, possible), acceleration)
    return speed, acceleration / per_mm


def _corners(
    length: Floats, unit: Floats, speed: Floats, acceleration: Floats, machine: _Machine
) -> Floats:
    """Return (K,) mm/s: the highest speed at the start of each move, 0 for the first."""
    controller = machine.controller
    assert isinstance(controller, MarlinController)
    if controller.classic_jerk_mm_s is not None:
        return jerk_corners(unit, speed, controller.classic_jerk_mm_s)
    cosine = np.clip(-(unit[1:] * unit[:-1]).sum(axis=1), -STRAIGHT_COS, None)
    turn = unit[1:] - unit[:-1]
    across = np.sqrt((turn**2).sum(axis=1))
    turn /= np.where(across > 0.0, across, 1.0)[:, None]
    of_axes = axis_limits(machine, "acceleration_mm_s2")
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        allowed = np.minimum(acceleration[1:], (of_axes / np.abs(turn)).min(axis=1))
        sine = np.sqrt(0.5 * (1.0 - cosine))
        square = allowed * controller.junction_deviation_mm * sine / (1.0 - sine)
    if controller.small_segments:
        bends = (length[1:] < SHORT_MM) & (cosine < OCTAGON_COS)
        angle = _angles(-cosine)
        square[bends] = np.minimum(square, length[1:] * allowed / angle)[bends]
    square[cosine > STRAIGHT_COS] = MIN_SPEED_MM_S**2
    return np.concatenate([np.zeros(min(len(unit), 1)), np.sqrt(square)])


def _angles(cosine: Floats) -> Floats:
    """Return the angles (K,) rad of cosines from 0 to 1, as Marlin's table approximates them."""
    share = 1.0 - np.append(0.5 ** np.arange(ANGLE_PARTS), 1e-6)
    angle = np.arccos(share) * ANGLE_FACTOR
    angle[0], angle[-1] = 0.5 * math.pi, math.acos(share[-1])
    slope = np.diff(angle) / np.diff(share)
    units = np.floor((1.0 - np.clip(cosine, 0.0, 1.0)) * 2.0 ** (ANGLE_PARTS - 1))
    part = ANGLE_PARTS - 2 - np.floor(np.log2(np.maximum(units, 0.5)))
    index = np.clip(part, 0, ANGLE_PARTS - 1).astype(np.int64)
    return np.asarray(angle[index] + slope[index] * (cosine - share[index]))


def jerk_corners(unit: Floats, speed: Floats, jerk_mm_s: tuple[float, float, float]) -> Floats:
    """Return (K,) mm/s: the highest speed at the start of each move by classic jerk; for the first
    the speed to which it may jump, which Marlin does not use: it begins at rest.

    The corner is passed at the lower speed of both moves, times the factor by which no axis
    changes its speed by more than its jerk; or at the safe speeds of both, at which the machine
    may stop and start at once, where those are higher."""
    jerk = np.array(jerk_mm_s)
    own = np.abs(unit) * speed[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        safe = speed * np.minimum(1.0, np.where(own > jerk, jerk / own, 1.0).min(axis=1))
    lower = np.minimum(speed[1:], speed[:-1])
    factor = np.ones(len(lower))
    smaller = np.where(speed[1:] < speed[:-1], speed[1:] / speed[:-1], 1.0)
    for axis in range(3):
        leaving = unit[:-1, axis] * speed[:-1] * smaller * factor
        entering = unit[1:, axis] * speed[1:] * factor
        high, low = np.maximum(leaving, entering), np.minimum(leaving, entering)
        change = np.where((low > 0.0) | (high < 0.0), high - low, np.maximum(high, -low))
        with np.errstate(divide="ignore", over="ignore"):
            factor *= np.where(change > jerk[axis], jerk[axis] / change, 1.0)
    corner = lower * factor
    stops = (safe[:-1] > 0.99 * corner) & (safe[1:] > 0.99 * corner)
    return np.concatenate([safe[:1], np.where(stops, safe[1:], corner)])


class _Rates(Struct, frozen=True, eq=False):
    """The blocks of a section, as its stepper has them, K each, in steps and steps/s: the rates at
    the start, of the cruise and at the end, the acceleration, and how many steps it has in all,
    accelerates and brakes."""

    first: Floats
    nominal: Floats
    last: Floats
    acceleration: Floats
    events: Floats
    up: Floats
    down: Floats

    def seconds(self) -> Floats:
        """Return (K,) seconds that each block takes.

        The stepper times each step by the rate reached before it, the first two by the rate of the
        start. So a ramp from a low rate takes longer than its integral, and one to a low rate
        shorter. The `EXACT` slowest steps of each ramp are added up one by one."""
        waits = np.minimum(self.up, self.events - 1.0)
        seconds, spent, peak = 1.0 / self.first, np.zeros(len(self.first)), self.first
        for step in range(EXACT):
            rate = np.minimum(self.first + self.acceleration * spent, self.nominal)
            peak = np.where(step < waits, rate, peak)
            spent += np.where(step < waits, 1.0 / rate, 0.0)
        rest = np.maximum(waits - EXACT, 0.0)
        reached = np.minimum(np.sqrt(peak**2 + 2.0 * self.acceleration * rest), self.nominal)
        ramp = (reached - peak) / self.acceleration
        steady = np.maximum(rest - 0.5 * (reached + peak) * ramp, 0.0) / self.nominal
        seconds, peak = seconds + spent + ramp + steady, reached
        down = np.clip(self.down - 1.0, 0.0, self.events - 1.0 - waits)
        seconds += (self.events - 1.0 - waits - down) / self.nominal
        early = np.maximum(down - EXACT, 0.0)
        slower = np.sqrt(np.maximum(peak**2 - 2.0 * self.acceleration * early, self.last**2))
        spent = (peak - slower) / self.acceleration
        for step in range(EXACT):
            rate = np.maximum(peak - self.acceleration * spent, self.last)
            spent += np.where(step < down - early, 1.0 / rate, 0.0)
        return np.asarray(seconds + spent)


def _rates(plan: SpeedPlan, squares: Floats, events: Floats, min_step_hz: float) -> _Rates:
    """Return the step rates of blocks as `calculate_trapezoid_for_block` computes them: whole
    numbers, not below `min_step_hz` at the ends."""
    per_mm = events / plan.length_mm
    nominal = np.ceil(plan.speed_mm_s * per_mm)
    first, last = (
        np.minimum(np.maximum(np.ceil(np.sqrt(square) * per_mm), min_step_hz), nominal)
        for square in (squares[:-1], squares[1:])
    )
    rate = plan.acceleration_mm_s2 * per_mm
    up = np.ceil((nominal**2 - first**2) / (2.0 * rate))
    down = np.floor((nominal**2 - last**2) / (2.0 * rate))
    short = up + down > events
    meeting = np.ceil((2.0 * rate * events - first**2 + last**2) / (4.0 * rate))
    up = np.where(short, np.clip(meeting, 0.0, events), up)
    return _Rates(first, nominal, last, rate, events, up, np.where(short, events - up, down))


def _chords(path: Toolpath, controller: MarlinController) -> tuple[Ints, Floats]:
    """Return the number of moves that each row becomes (N,), and the ends (P, 3) mm of all but the
    last move of each row."""
    counts = np.ones(len(path), dtype=np.int64)
    arcs = np.flatnonzero(path.is_arc)
    begin, end, centre = path.starts_of(arcs), path.end[arcs], path.centre[arcs]
    arm = begin[:, :2] - centre
    rise = end[:, 2] - begin[:, 2]
    turn = _turns(path.kind[arcs] == Kind.ARC_CW, arm, end[:, :2] - centre, begin, end)
    travel = np.hypot(np.hypot(arm[:, 0], arm[:, 1]) * turn, rise)
    min_counts = np.ceil(controller.min_arc_segments * np.abs(turn) / (2.0 * np.pi))
    counts[arcs] = np.maximum(np.floor(travel / controller.mm_per_arc_segment), min_counts)
    counts[arcs] = np.where(travel < MIN_ARC_MM, 1, np.maximum(counts[arcs], 1))
    inner = counts[arcs] - 1
    arc = np.repeat(np.arange(len(arcs)), inner)
    number = np.arange(len(arc)) - np.repeat(np.cumsum(inner) - inner, inner) + 1
    theta = (turn / counts[arcs])[arc]
    since = number % controller.arc_correction
    angle = (number - since) * theta
    x = arm[arc, 0] * np.cos(angle) - arm[arc, 1] * np.sin(angle)
    y = arm[arc, 0] * np.sin(angle) + arm[arc, 1] * np.cos(angle)
    cosine, sine = 1.0 - 0.5 * theta**2, theta - theta**3 / 6.0
    for step in range(1, controller.arc_correction):
        at = np.flatnonzero(since >= step)
        u, v = x[at].copy(), y[at].copy()
        x[at], y[at] = u * cosine[at] - v * sine[at], u * sine[at] + v * cosine[at]
    z = begin[arc, 2] + number * (rise / counts[arcs])[arc]
    return counts, np.column_stack([centre[arc, 0] + x, centre[arc, 1] + y, z])


def _turns(clockwise: Bools, arm: Floats, aim: Floats, begin: Floats, end: Floats) -> Floats:
    """Return the angles (J,) rad by which arcs turn, CCW positive."""
    cross = arm[:, 0] * aim[:, 1] - arm[:, 1] * aim[:, 0]
    turn = np.arctan2(cross, (arm * aim).sum(axis=1))
    turn = np.where(clockwise & (turn > 0.0), turn - 2.0 * np.pi, turn)
    turn = np.where(~clockwise & (turn < 0.0), turn + 2.0 * np.pi, turn)
    circle = (np.abs(begin[:, :2] - end[:, :2]) < SAME_MM).all(axis=1)
    return np.asarray(np.where(circle, np.where(clockwise, -2.0, 2.0) * np.pi, turn))
