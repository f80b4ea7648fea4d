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

T is at most the tolerance and a quarter of the shorter move; d at most half a line, the last two
thirds of an arc, and its first third. No blend is wider than its speed needs, v²/(√¾ a), or than
as long a time at that speed as half the acceleration would need to reach it. Where arcs meet other
moves LinuxCNC bends theirs a little, within the same tolerance.
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
from camtool.simulation.motion import Bools, Floats, Ints

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
    how far from the corner a blend begins and ends, 0 without one; `acceleration` (M,) mm/s²
    along blends; `inward` (M, 3) and `onward` (M, 3): unit vectors to the blend's centre and
    along it; `theta` (M,) rad."""

    speed: Floats
    lost: Floats
    reach: Floats
    acceleration: Floats
    inward: Floats
    onward: Floats
    theta: Floats

    @property
    def way(self) -> Floats:
        """(M,) mm along the blends."""
        return np.asarray(self.reach * np.tan(self.theta) * (np.pi - 2.0 * self.theta))


@dataclass(frozen=True)
class CornerRules:
    """`blend` (M,) and `stop` (M,): moves behind which corners are blended, and met with a stop;
    `tolerance_mm` (M,) of each move, inf: none; `kink_ratio`; `period_s` of the servo; limits (3,)
    of the axes, mm/s and mm/s²."""

    blend: Bools
    stop: Bools
    tolerance_mm: Floats
    kink_ratio: float
    period_s: float
    rate: Floats
    acceleration: Floats


def corners_of(moves: Moves, rules: CornerRules) -> Corners:
    """What happens at the start of each move."""
    count = len(moves.length)
    before, after = np.roll(moves.end, 1, axis=0), moves.begin
    turn, both = after - before, after + before
    back = np.linalg.norm(both, axis=1) < STRAIGHT_BACK_RAD
    # The move before a corner says how it is met; both say how far a blend may leave it.
    free = ~moves.waits & moves.like & ~back & ~np.roll(rules.stop, 1)
    # A kink: the change of velocity within one period, as a part of what each axis can do.
    highest = np.minimum(np.roll(moves.speed, 1), moves.speed)
    jolt = highest / rules.period_s + moves.acceleration
    part = (np.abs(turn) * jolt[:, None] / rules.acceleration).max(axis=1, initial=0.0)
    part = np.where(moves.is_arc | np.roll(moves.is_arc, 1), part / TANGENT_RATIO, part)
    smooth = free & (part < rules.kink_ratio)
    corners = Corners(
        speed=np.where(smooth, np.inf, 0.0),
        lost=np.where(smooth, part, 0.0),
        reach=np.zeros(count),
        acceleration=np.zeros(count),
        inward=_unit(turn),
        onward=_unit(both),
        theta=0.5 * np.arccos(np.clip(-(before * after).sum(axis=1), -1.0, 1.0)),
    )
    on = np.flatnonzero(free & ~smooth & np.roll(rules.blend, 1))
    _blend(corners, moves, on, rules)
    # A bend that passes for straight at low speed, where that is faster than the blend.
    kink = highest[on] * rules.kink_ratio / part[on]
    faster = kink > corners.speed[on]
    corners.speed[on] = np.maximum(corners.speed[on], kink)
    corners.lost[on[faster]] = rules.kink_ratio
    corners.reach[on[faster]] = 0.0
    return corners


def _blend(corners: Corners, moves: Moves, on: Ints, rules: CornerRules) -> None:
    """Fill in speed, reach and acceleration of the blends at the corners `on`.

    In the plane of both tangents, with unit normal m, no axis exceeds its limit when the whole is
    held to min(limit / √(1 − m²)).
    """
    theta = corners.theta[on]
    normal = _unit(np.cross(moves.end[on - 1], moves.begin[on]))
    with np.errstate(divide="ignore"):
        share = np.sqrt(np.maximum(1.0 - normal**2, 0.0))
        whole = (rules.acceleration / share).min(axis=1, initial=np.inf)
        rate = (rules.rate / share).min(axis=1, initial=np.inf)
    across = NORMAL_RATIO * whole
    reach = _most_reach(moves, on, theta, rules.tolerance_mm)
    widest = reach * np.tan(theta)
    wanted = np.maximum(moves.speed[on - 1], moves.speed[on])
    planned = np.minimum(np.minimum(wanted, rate), np.sqrt(across * widest))
    half = 0.5 * whole
    by_time = np.minimum(np.sqrt(2.0 * half * reach), planned) / half * planned
    turned = np.pi - 2.0 * theta
    by_time /= np.maximum(turned, LEAST_BEND_RAD)
    radius = np.maximum(planned**2 / across, np.minimum(by_time, widest))
    lasting = radius * turned / (LEAST_PERIODS * rules.period_s)
    corners.speed[on] = np.minimum(planned, lasting)
    corners.reach[on] = radius / np.tan(theta)
    corners.acceleration[on] = TANGENT_RATIO * whole


def _most_reach(moves: Moves, on: Ints, theta: Floats, tolerance_mm: Floats) -> Floats:
    """The largest d at the corners `on`; 0 where the moves hardly bend."""
    shorter = np.minimum(moves.length[on], moves.length[on - 1])
    asked = np.minimum(tolerance_mm[on], tolerance_mm[on - 1])
    leaves = np.minimum(asked, TOLERANCE_PART * shorter)
    flat = np.pi - 2.0 * theta < LEAST_BEND_RAD
    by_tolerance = leaves * np.cos(theta) / np.where(flat, 1.0, 1.0 - np.sin(theta))
    end_part = np.where(moves.is_arc[on - 1], ARC_END_PART, LINE_PART)
    start_part = np.where(moves.is_arc[on], ARC_START_PART, LINE_PART)
    by_length = np.minimum(end_part * moves.length[on - 1], start_part * moves.length[on])
    return np.asarray(np.where(flat, 0.0, np.minimum(by_tolerance, by_length)))


def _unit(vectors: Floats) -> Floats:
    """(M, 3) of length 1; vectors of none stay."""
    length = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0)[:, None])
