"""How LinuxCNC meets the corners between its moves.

At each corner with unit tangents u1 before and u2 behind it (`tpSetupTangent`, tp.c):

- within 2° of straight back: a stop;
- a bend that takes less than `kink_ratio` of the highest acceleration of any axis in one servo
  period: no corner at all, but both moves accelerate less by that part;
- else a stop in the modes "exact-path" and "exact-stop" (which stops at the others too), and in
  "blend" an arc that touches both moves (`blendComputeParameters`, blendmath.c).

With θ half the angle between −u1 and u2, an arc of radius R touches lines at d from the corner and
leaves it by T:

    R = d tan θ,   T = R (1/sin θ − 1) = d (1 − sin θ)/cos θ,   v² ≤ √¾ a R

T is the tolerance, or a quarter of the shorter move; d is at most half a line, the last two
thirds of an arc, and its first third. That is the largest arc that the tolerance allows: at low
speed LinuxCNC takes a smaller one, and where arcs meet lines theirs are bent a little. So what is
simulated is a bound of what blending does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.simulation.linuxcnc_moves import (
    LEAST_PERIODS,
    NORMAL_RATIO,
    TANGENT_RATIO,
    Moves,
)
from camtool.simulation.motion import Floats, Ints

STRAIGHT_BACK_RAD = np.deg2rad(2.0)
"""A way back within this angle is a stop (SHARP_CORNER_DEG)."""

TOLERANCE_PART = 0.25
"""Of the shorter move: no blend leaves its corner by more (`tcFindBlendTolerance`)."""

LINE_PART = 0.5
"""Of a line: a blend uses no more at each end (BLEND_DIST_FRACTION)."""

ARC_END_PART = 2.0 / 3.0
"""Of an arc: a blend at its end uses no more (`blendInit3FromArcLine`)."""

ARC_START_PART = 1.0 / 3.0
"""Of an arc: a blend at its start uses no more (`blendInit3FromLineArc`)."""

LEAST_BEND_RAD = 1e-3
"""Moves that bend by less have no arc between them (TP_MIN_ARC_ANGLE)."""


@dataclass(frozen=True, eq=False)
class Corners:
    """What happens at the start of each of M moves: `speed` (M,) mm/s, 0 for a stop; `lost` (M,):
    the part of the acceleration that a bend takes from the moves on both sides; `reach` (M,) mm:
    how far from the corner a blend begins and ends, 0 without one; `inward` (M, 3) and `onward`
    (M, 3): unit vectors to the blend's centre and along it; `theta` (M,) rad."""

    speed: Floats
    lost: Floats
    reach: Floats
    inward: Floats
    onward: Floats
    theta: Floats


@dataclass(frozen=True)
class CornerRules:
    """`mode` "blend", "exact-path" or "exact-stop"; `tolerance_mm` of blends; `kink_ratio`;
    `period_s` of the servo; limits (3,) of the axes, mm/s and mm/s²."""

    mode: str
    tolerance_mm: float
    kink_ratio: float
    period_s: float
    rate: Floats
    acceleration: Floats


def corners_of(moves: Moves, rules: CornerRules) -> Corners:
    """What happens at the start of each move."""
    count = len(moves.length)
    before, after = np.roll(moves.end, 1, axis=0), moves.begin
    turn, sum_ = after - before, after + before
    back = np.linalg.norm(sum_, axis=1) < STRAIGHT_BACK_RAD
    free = moves.joined & ~back & (rules.mode != "exact-stop")
    # A kink: the change of velocity within one period, as a part of what each axis can do.
    highest = np.minimum(np.roll(moves.speed, 1), moves.speed)
    jolt = highest / rules.period_s + moves.acceleration
    part = (np.abs(turn) * jolt[:, None] / rules.acceleration).max(axis=1, initial=0.0)
    part = np.where(moves.is_arc | np.roll(moves.is_arc, 1), part / TANGENT_RATIO, part)
    smooth = free & (part < rules.kink_ratio)
    blended = free & ~smooth & (rules.mode == "blend")
    speed = np.where(smooth, np.inf, 0.0)
    lost = np.where(smooth, part, 0.0)
    across = np.linalg.norm(turn, axis=1)
    inward = turn / np.where(across > 0.0, across, 1.0)[:, None]
    onward = sum_ / np.maximum(np.linalg.norm(sum_, axis=1), STRAIGHT_BACK_RAD)[:, None]
    theta = 0.5 * np.arccos(np.clip(-(before * after).sum(axis=1), -1.0, 1.0))
    reach = np.zeros(count)
    on = np.flatnonzero(blended)
    if len(on):
        reach[on] = _reach(moves, on, theta[on], rules.tolerance_mm)
        bent = _blend_speed(moves, on, reach[on], theta[on], rules)
        kink = highest[on] * rules.kink_ratio / part[on]
        by_kink = kink > bent
        speed[on] = np.maximum(bent, kink)
        lost[on[by_kink]] = rules.kink_ratio
        reach[on[by_kink]] = 0.0
    return Corners(speed, lost, reach, inward, onward, theta)


def _reach(moves: Moves, on: Ints, theta: Floats, tolerance_mm: float) -> Floats:
    """d at the corners `on`."""
    shorter = np.minimum(moves.length[on], moves.length[on - 1])
    leaves = np.minimum(tolerance_mm, TOLERANCE_PART * shorter)
    by_tolerance = leaves * np.cos(theta) / (1.0 - np.sin(theta))
    end_part = np.where(moves.is_arc[on - 1], ARC_END_PART, LINE_PART)
    start_part = np.where(moves.is_arc[on], ARC_START_PART, LINE_PART)
    by_length = np.minimum(end_part * moves.length[on - 1], start_part * moves.length[on])
    flat = np.pi - 2.0 * theta < LEAST_BEND_RAD
    return np.asarray(np.where(flat, 0.0, np.minimum(by_tolerance, by_length)))


def _blend_speed(
    moves: Moves, on: Ints, reach: Floats, theta: Floats, rules: CornerRules
) -> Floats:
    """How fast the blends at the corners `on` are passed: in the plane of both tangents no axis
    exceeds its limits whichever way the blend points."""
    before, after = moves.end[on - 1], moves.begin[on]
    normal = np.cross(before, after)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    share = np.sqrt(np.maximum(1.0 - normal**2, 0.0))
    with np.errstate(divide="ignore"):
        acceleration = (rules.acceleration / share).min(axis=1)
        rate = (rules.rate / share).min(axis=1)
    radius = reach * np.tan(theta)
    turning = np.sqrt(NORMAL_RATIO * acceleration * radius)
    lasting = radius * (np.pi - 2.0 * theta) / (LEAST_PERIODS * rules.period_s)
    wanted = np.maximum(moves.speed[on - 1], moves.speed[on])
    return np.asarray(np.minimum(np.minimum(turning, lasting), np.minimum(wanted, rate)))
