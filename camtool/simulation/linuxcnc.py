"""LinuxCNC: the programmed lines and arcs themselves, corners as the path mode says.

What it does with a program, in the order of the files:

1. Each row has the path mode that the program says there (G61, G61.1, G64 P Q), or that of the
   machine file. In the mode "blend", lines that lie on one line but for a tolerance are merged
   (`linuxcnc_moves`, `camtool.kernels.merge_lines`).
2. Corners: stops, bends that pass for straight, blends (`linuxcnc_corners`), as they come out at
   the programmed feed. No blend leaves its corner by more than the tolerance.
3. Speeds: limits of the axes, turning in arcs, corners, so many moves ahead
   (`camtool.kernels.lookahead`), trapezoids (`speed_plan`).

Positions are the trajectory's, in 64-bit floats. The step generator follows them to the nearest
step, or an encoder to its count: half a step of each axis, which is not in the samples. Steps are
counted, not taken. Rounding never adds up.

BACKLASH of an axis (`compensation_mm`) is added at a change of its direction. LinuxCNC spreads it
over some milliseconds at half of the axis's limits; here it acts at once, and takes no time.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import cast, get_args

import numpy as np

from camtool.errors import MachineError
from camtool.kernels.lattice import to_steps
from camtool.machine.controllers import LinuxcncController
from camtool.machine.model import Machine, controller_of
from camtool.simulation.linuxcnc_corners import CornerRules, Corners, corners_of
from camtool.simulation.linuxcnc_moves import Moves, merged, moves_of
from camtool.simulation.mechanics import Mechanics
from camtool.simulation.motion import Bools, Chunk, Floats, Ints
from camtool.simulation.options import Options
from camtool.simulation.path import check_positions, check_rows, placed
from camtool.simulation.path_samples import PathSamples, move_lengths, sample_spacing_mm
from camtool.simulation.row_chunks import RowTotals, row_chunks
from camtool.simulation.speed_plan import SpeedPlan, axis_limits
from camtool.toolpath.moves import Corners as CornerMode
from camtool.toolpath.moves import Kind, PathMode, Toolpath

LEAST_WAY_MM = 1e-9
"""What blends leave of a move is nothing when it is shorter."""

LAST_PART = 0.5
"""Of its acceleration: what the last move before a wait uses in the mode "blend"."""

REST_PERIODS = 1.0
"""Servo periods that coming to rest takes beyond the trapezoid (measured)."""

PERIOD_EPS = 1e-6
"""Periods: a time longer than a whole number of them by less is that number."""


def run(toolpath: Toolpath, machine: Machine, options: Options) -> Iterator[Chunk]:
    """The motion; see `camtool.simulation.models.ControllerModel`."""
    path = held(toolpath, machine)
    rows = path.running
    check_rows(path, rows)
    path = path.first(rows)
    modes = _modes(path, machine)
    path, chain = merged(path, modes.merging_mm)
    moves = moves_of(
        path, chain, machine, controller_of(machine, LinuxcncController).servo_period_s
    )
    corners = corners_of(moves, _rules(modes, moves, machine))
    samples = LinuxcncSamples(path, machine, moves, corners)
    seconds = _seconds(path, machine, (moves, modes), corners)
    mechanics = Mechanics(machine, path.start, options.effects)
    return row_chunks(samples, RowTotals(seconds), mechanics, options.chunk_steps)


def held(toolpath: Toolpath, machine: Machine) -> Toolpath:
    """The moves as read, homing at machine zero: nothing is rounded."""
    check_positions(toolpath, machine)
    return placed(toolpath, np.array(machine.controller.machine_zero_mm, dtype=np.float64))


def spacing_mm(toolpath: Toolpath, machine: Machine) -> float:
    """A coded step, or what a million samples of the whole program allow."""
    return sample_spacing_mm(toolpath, machine)


def interpolation(toolpath: Toolpath, machine: Machine, options: Options) -> str:
    """Blends, or the path alone."""
    blends = any(mode.corners == "blend" for mode in _asked(toolpath, machine))
    return "blend" if blends else "path"


def assumptions(toolpath: Toolpath, machine: Machine) -> tuple[str, ...]:
    """What the figures and times take for granted."""
    return (
        *dict.fromkeys(_corners_said(mode) for mode in _asked(toolpath, machine)),
        "speeds by trapezoids within the limits of the axes, overrides at 100 %",
        "the step generator may be half a step off on each axis, which is not in the figures",
    )


def _corners_said(mode: PathMode) -> str:
    if mode.corners == "exact-path":
        return "no corner is rounded (G61)"
    if mode.corners == "exact-stop":
        return "the machine stops at each corner (G61.1)"
    if mode.tolerance_mm == 0.0:
        return "corners are blended as far as the moves allow (G64 without P)"
    return f"corners are blended within {mode.tolerance_mm:g} mm (G64 P), as the speed needs"


class LinuxcncSamples:
    """Points along the moves, blends included, numbered from 0; only one window is held."""

    def __init__(self, path: Toolpath, machine: Machine, moves: Moves, corners: Corners) -> None:
        self._samples = PathSamples(path, sample_spacing_mm(path, machine))
        self.first = self._samples.first
        self._step_mm = [axis.coded_step_mm for axis in machine.axes]
        self._moves, self._corners = moves, corners
        self._row_length = move_lengths(path)
        lengths = np.where(moves.row_of >= 0, self._row_length, 0.0)
        so_far = np.cumsum(lengths) - lengths
        begins = np.concatenate([[0.0], np.cumsum(moves.length)])
        self._into = so_far - begins[np.maximum(moves.row_of, 0)]
        self._at = self._in_steps(path.start[None, :])
        self._counts = np.zeros((1, 3), dtype=np.int64)
        self._low = 0

    def window(self, low: int, high: int) -> tuple[Ints, Floats]:
        """Row and position of the samples low:high, which follow those of the last call."""
        row, share = self._samples.places(low, high)
        points = self._samples.points(row, share)
        self._blend(points, row, share)
        steps = np.concatenate([self._at, self._in_steps(points)])
        self._at, self._low = steps[-1:], low
        self._counts = np.zeros((len(steps), 3), dtype=np.int64)
        np.cumsum(np.abs(np.diff(steps, axis=0)), axis=0, out=self._counts[1:])
        return row, points

    def steps(self, bounds: Ints) -> Ints:
        """Steps of each axis between samples of the window: changes of the nearest step."""
        return np.diff(self._counts[bounds - self._low], axis=0)

    def _blend(self, points: Floats, row: Ints, share: Floats) -> None:
        """Move points (K, 3) near blended corners inward.

        On the tangent at s from the corner P stands Q = P ∓ s t_±; the blend's point there is
        B = P + h n + R (−n cos α ∓ t sin α), with α = (π/2 − θ) s / d, n inward, t onward, and
        h = d / cos θ. What lies between them, B − Q, is added to the point of the move itself.
        """
        moves, corners = self._moves, self._corners
        if not corners.reach.any():
            return
        move = moves.row_of[row]
        along = self._into[row] + share * self._row_length[row]
        left = np.maximum(moves.length[move] - along, 0.0)
        following = np.append(corners.reach, 0.0)
        ahead = np.flatnonzero(left < following[move + 1])
        behind = np.flatnonzero(along < corners.reach[move])
        self._inward(points, ahead, move[ahead] + 1, left[ahead], -1.0)
        self._inward(points, behind, move[behind], along[behind], 1.0)

    def _inward(self, points: Floats, on: Ints, corner: Ints, s: Floats, side: float) -> None:
        corners = self._corners
        d, theta = corners.reach[corner], corners.theta[corner]
        alpha = (0.5 * np.pi - theta) * s / d
        radius, height = d * np.tan(theta), d / np.cos(theta)
        # n and t parts of B − P and of Q − P = s (n cos θ ± t sin θ)
        inward = height - radius * np.cos(alpha) - s * np.cos(theta)
        onward = side * (radius * np.sin(alpha) - s * np.sin(theta))
        points[on] += inward[:, None] * corners.inward[corner]
        points[on] += onward[:, None] * corners.onward[corner]

    def _in_steps(self, points: Floats) -> Ints:
        columns = [to_steps(points[:, axis], step) for axis, step in enumerate(self._step_mm)]
        return np.column_stack(columns)


def _seconds(
    path: Toolpath, machine: Machine, planned: tuple[Moves, Modes], corners: Corners
) -> Floats:
    """(N,) s of each row.

    Blends are blocks of their own, half of each belongs to the row on either side; the rows of a
    merged line share its time by their lengths. In the mode "blend" the last move before a wait
    accelerates by half: it was kept ready for a blend that never came (`tcGetOverallMaxAccel`).
    """
    controller, (moves, modes) = controller_of(machine, LinuxcncController), planned
    seconds = np.where(path.kind == Kind.DWELL, path.value, 0.0)
    count = len(moves.length)
    following = np.append(corners.reach[1:], 0.0)
    plan = np.zeros((2 * count, 4))  # at even places the blend before a move, then the move
    plan[0::2] = np.column_stack(
        [corners.way, corners.speed, corners.acceleration, np.full(count, np.inf)]
    )
    own = np.maximum(moves.length - corners.reach - following, 0.0)
    blended = corners.reach > 0.0
    entry = np.where(blended, np.inf, corners.speed)
    lost = np.maximum(corners.lost, np.append(corners.lost[1:], 0.0))
    last = np.append(moves.waits[1:], np.ones(min(count, 1), dtype=np.bool_))
    spared = np.where(last & modes.blend[moves.row], LAST_PART, 1.0)
    acceleration = moves.acceleration * (1.0 - lost) * spared
    plan[1::2] = np.column_stack([own, moves.speed, acceleration, entry])
    lasting = np.flatnonzero(plan[:, 0] > LEAST_WAY_MM)
    taken = np.zeros(2 * count + 1)
    speeds = SpeedPlan(*plan[lasting].T)
    taken[lasting] = _in_periods(speeds, controller.lookahead_moves, controller.servo_period_s)
    whole = taken[1::2] + 0.5 * (taken[0:-1:2] + taken[2::2])
    moving = np.flatnonzero(moves.row_of >= 0)
    move = moves.row_of[moving]
    seconds[moving] = whole[move] * (move_lengths(path)[moving] / moves.length[move])
    return seconds


def _in_periods(plan: SpeedPlan, window: int, period_s: float) -> Floats:
    """(N,) s of each block; from rest to rest it takes whole servo periods, and `REST_PERIODS`."""
    seconds = plan.seconds(window)
    from_rest = np.flatnonzero(plan.entries(window)[:-1] == 0.0)
    if len(from_rest):
        runs = np.add.reduceat(seconds, from_rest)
        periods = np.ceil(runs / period_s - PERIOD_EPS) + REST_PERIODS
        seconds[np.append(from_rest[1:], len(seconds)) - 1] += periods * period_s - runs
    return seconds


@dataclass(frozen=True, eq=False)
class Modes:
    """How N rows meet the corners behind them: `blend` (N,) and `stop` (N,), which are neither
    where the path is kept without a stop; `tolerance_mm` (N,) of blends, inf: none; `merging_mm`
    (N,), 0: none."""

    blend: Bools
    stop: Bools
    tolerance_mm: Floats
    merging_mm: Floats


def _modes(path: Toolpath, machine: Machine) -> Modes:
    """What the program says of each row, and where it says nothing, the machine file."""
    table = np.array(
        [
            (mode.corners == "blend", mode.corners == "exact-stop", mode.tolerance_mm or np.inf,
             mode.merging_mm)
            for mode in _asked(path, machine)
        ]
    )[path.mode]  # fmt: skip
    return Modes(table[:, 0] > 0.0, table[:, 1] > 0.0, table[:, 2], table[:, 3])


def _asked(path: Toolpath, machine: Machine) -> tuple[PathMode, ...]:
    """The modes of the program, and behind them (at −1) that of the machine file where any row
    leaves it to that."""
    silent = len(path) == 0 or bool((path.mode < 0).any())
    return (*path.modes, _machine_mode(machine)) if silent else path.modes


def _rules(modes: Modes, moves: Moves, machine: Machine) -> CornerRules:
    controller = controller_of(machine, LinuxcncController)
    return CornerRules(
        blend=modes.blend[moves.row],
        stop=modes.stop[moves.row],
        tolerance_mm=modes.tolerance_mm[moves.row],
        kink_ratio=controller.kink_ratio,
        period_s=controller.servo_period_s,
        rate=axis_limits(machine, "max_rate_mm_min") / 60.0,
        acceleration=axis_limits(machine, "acceleration_mm_s2"),
    )


def _machine_mode(machine: Machine) -> PathMode:
    """What `[dialect]` says of corners; MachineError when it does not."""
    mode = machine.dialect.get("path")
    tolerance = machine.dialect.get("blend_tolerance_mm")
    if mode not in get_args(CornerMode):
        raise MachineError(
            "LinuxCNC needs to know how it meets corners",
            where="table [dialect], key path",
            mend=f"one of {', '.join(get_args(CornerMode))}",
        )
    if mode != "blend":
        return PathMode(cast(CornerMode, mode))
    if not isinstance(tolerance, (int, float)):
        raise MachineError(
            "blending needs its tolerance",
            where="table [dialect], key blend_tolerance_mm",
            mend="the P of G64, in mm",
        )
    return PathMode("blend", float(tolerance), float(tolerance))
