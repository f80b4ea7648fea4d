"""The moves of LinuxCNC's planner: rows merged into lines, and what bounds each of them.

From `emccanon.cc`. Along a unit vector u a line is held to min(limit / |u|) of the axes. An arc of
radius r and sweep φ turns in XY, at no more than the slower axis v_xy, a_xy:

    v² ≤ a_xy · √¾ · r_e,   r_e² = (least r)² + (dr/dφ)²       (`arc`, ARC_FEED)

and a helix lets Z keep its own limits. Along an arc half of the acceleration is used, the rest is
kept for turning (`tcGetTangentialMaxAccel`, tc.c); no move takes less than `LEAST_PERIODS` of the
servo.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from camtool.kernels.merge_lines import merge_lines
from camtool.machine.model import Machine
from camtool.simulation.motion import Bools, Floats, Ints
from camtool.simulation.path_samples import move_lengths
from camtool.simulation.speed_plan import allowed_along, axis_limits
from camtool.toolpath.moves import Arms, Kind, Toolpath

NORMAL_RATIO = np.sqrt(0.75)
"""How much of the acceleration a turn may take (BLEND_ACC_RATIO_NORMAL)."""

TANGENT_RATIO = 0.5
"""How much of it is used along the way of an arc (BLEND_ACC_RATIO_TANGENTIAL)."""

LEAST_PERIODS = 1.02
"""Servo periods that the shortest move lasts (TP_MIN_SEGMENT_CYCLES, tp_types.h)."""

WAITS = (
    Kind.DWELL,
    Kind.SPINDLE_CW,
    Kind.SPINDLE_CCW,
    Kind.SPINDLE_OFF,
    Kind.TOOL_CHANGE,
    Kind.END,
)
"""Before these the machine comes to rest (their preconditions in emctaskmain.cc)."""


def merged(path: Toolpath, tolerance_mm: Floats) -> tuple[Toolpath, Ints]:
    """The rows with the ends of merged lines on their common line, and the line of each row (N,);
    `tolerance_mm` (N,) of each row, 0: it is not merged.

    Only feed moves with one feed and one path mode, and nothing but moves of no length between
    them, are merged; any event, an MSG comment too, ends a line.
    """
    count = len(path)
    chain, moved = np.arange(count), path.end.copy()
    if tolerance_mm.any():
        same_feed = np.zeros(count, dtype=np.bool_)
        same_feed[1:] = path.feed[1:] == path.feed[:-1]
        is_line = path.kind == Kind.LINE
        apart = ~(is_line & same_feed) | (tolerance_mm == 0.0)
        apart[1:] |= ~is_line[:-1] | (path.mode[1:] != path.mode[:-1])
        points = np.concatenate([path.start[None, :], path.end])
        merge_lines(points, apart, tolerance_mm, chain, moved)
    return replace(path, end=moved), chain


@dataclass(frozen=True, eq=False)
class Moves:
    """M moves in order. row_of (N,): the move of each row of the program, −1 for rows that do not
    move; row (M,): the first of each. length mm, speed mm/s (as programmed, within the limits),
    acceleration mm/s² (along the way), each (M,); begin, end (M, 3): unit tangents; is_arc (M,);
    waits (M,): the machine comes to rest before this move, whatever the corner; like (M,): this
    move and the one before are both rapids or both at a feed."""

    row_of: Ints
    row: Ints
    length: Floats
    speed: Floats
    acceleration: Floats
    begin: Floats
    end: Floats
    is_arc: Bools
    waits: Bools
    like: Bools


def moves_of(path: Toolpath, chain: Ints, machine: Machine, period_s: float) -> Moves:
    """The moves of merged rows; MachineError for limits that are not said."""
    rate = axis_limits(machine, "max_rate_mm_min") / 60.0
    acceleration = axis_limits(machine, "acceleration_mm_s2")
    row_length = move_lengths(path)
    length: Floats = np.bincount(chain, row_length, minlength=len(path)).astype(np.float64)
    lasting = np.flatnonzero((length > 0.0) & (np.bincount(chain, minlength=len(path)) > 0))
    number = np.full(len(path), -1, dtype=np.int64)
    number[lasting] = np.arange(len(lasting))
    row_of = np.where(row_length > 0.0, number[chain], -1)
    rows, first = np.unique(row_of[row_of >= 0], return_index=True)
    lead = np.flatnonzero(row_of >= 0)[first]  # the first row of each move
    assert len(rows) == len(lead)
    lengths = length[lasting]
    begin, end = _tangents(path, lead)
    highest, along = allowed_along(rate, begin), allowed_along(acceleration, begin)
    arms = Arms(path, path.is_arc)
    arm_of_row = np.full(len(path), -1, dtype=np.int64)
    arm_of_row[arms.row] = np.arange(len(arms.row))
    arm = arm_of_row[lead]
    on = np.flatnonzero(arm >= 0)
    highest[on], along[on] = _arc_limits(arms, arm[on], lengths[on], (rate, acceleration))
    highest = np.minimum(highest, lengths / (LEAST_PERIODS * period_s))
    feed = np.where(path.is_feed, path.feed, np.inf)[lead] / 60.0
    waits = np.diff(np.cumsum(np.isin(path.kind, WAITS))[lead], prepend=-1) > 0
    cuts = path.is_feed[lead]
    like = cuts == np.roll(cuts, 1)
    speed = np.minimum(feed, highest)
    return Moves(row_of, lead, lengths, speed, along, begin, end, arm >= 0, waits, like)


def _tangents(path: Toolpath, lead: Ints) -> tuple[Floats, Floats]:
    """(M, 3) unit tangents at the start and end of the rows `lead`; merged rows are straight."""
    way = (path.end - path.starts)[lead]
    begin, end = way.copy(), way.copy()
    arms = Arms(path, path.is_arc)
    at = np.searchsorted(arms.row, lead)
    on = np.flatnonzero(path.is_arc[lead])
    for tangent, radius, share in ((begin, arms.radius, 0.0), (end, arms.end_radius, 1.0)):
        arm = at[on]
        sweep, grows = arms.sweep[arm], (arms.end_radius - arms.radius)[arm]
        angle, r = arms.angle[arm] + share * sweep, radius[arm]
        cos, sin = np.cos(angle), np.sin(angle)
        tangent[on, 0] = grows * cos - r * sweep * sin
        tangent[on, 1] = grows * sin + r * sweep * cos
    begin /= np.linalg.norm(begin, axis=1)[:, None]
    end /= np.linalg.norm(end, axis=1)[:, None]
    return begin, end


def _arc_limits(
    arms: Arms, arm: Ints, length: Floats, limits: tuple[Floats, Floats]
) -> tuple[Floats, Floats]:
    """Highest speed and acceleration along the way of arcs."""
    rate, acceleration = limits
    v_xy, a_xy = rate[:2].min(), acceleration[:2].min()
    r, r_end, sweep = arms.radius[arm], arms.end_radius[arm], np.abs(arms.sweep[arm])
    rise = np.abs(arms.end[arm, 2] - arms.begin[arm, 2])
    grows = r_end - r
    least = np.minimum(r, r_end)
    radius = np.hypot(least, grows / sweep)
    level = np.hypot(least * sweep, grows)
    planar = np.minimum(v_xy, np.sqrt(a_xy * NORMAL_RATIO * radius))
    highest = length / np.maximum(rise / rate[2], level / planar)
    overall = length / np.maximum(rise / acceleration[2], level / a_xy)
    highest = np.minimum(highest, np.sqrt(NORMAL_RATIO * overall * radius))
    return highest, TANGENT_RATIO * overall
