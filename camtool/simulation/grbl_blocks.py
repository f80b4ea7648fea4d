"""The blocks of grbl's planner: targets rounded to steps, and how fast each may go.

From `plan_buffer_line` (planner.c): a target in mm, times the steps of a mm, goes to the nearest
step (halves away from zero), each by itself, so that nothing drifts. A target in the step where
the machine stands makes no block. Length and direction are those of the whole steps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.errors import ProgramError
from camtool.machine.controllers import GrblController
from camtool.machine.model import Machine
from camtool.simulation.grbl_chords import Singles, targets_of
from camtool.simulation.motion import Ints
from camtool.simulation.speed_plan import SpeedPlan, allowed_along, axis_limits
from camtool.toolpath.moves import Kind, Toolpath

MAX_STEPS = 1 << 29
"""Positions beyond this many steps (2 km at 4 µm) are refused: products of two counts must fit
64 bits. grbl's own 32-bit floats count no single steps beyond 2²⁴."""

STRAIGHT_COS = 0.999999
"""Cosine between two blocks beyond which a corner is none, or a way straight back (planner.c)."""

LEAST_SPEED_MM_S = 1.0 / 60.0
"""No block is slower (MINIMUM_FEED_RATE, config.h)."""

WAITS = (
    Kind.DWELL,
    Kind.SPINDLE_CW,
    Kind.SPINDLE_CCW,
    Kind.SPINDLE_OFF,
    Kind.TOOL_CHANGE,
    Kind.END,
)
"""Before these the machine comes to rest (`protocol_buffer_synchronize`)."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """B blocks in order: the row (B,) that each is of, where it starts and its way, both (B, 3)
    steps."""

    row: Ints
    start: Ints
    way: Ints

    @property
    def events(self) -> Ints:
        """(B,) steps of the axis that has the most of them."""
        return np.asarray(np.abs(self.way).max(axis=1, initial=0))


def blocks_of(path: Toolpath, machine: Machine, controller: GrblController) -> Blocks:
    """The blocks of a program; ProgramError for positions beyond all that grbl can count."""
    targets = targets_of(path, machine, controller)
    steps_per_mm = np.array([1.0 / axis.coded_step_mm for axis in machine.axes], dtype=np.float32)
    stop = _rounded(targets.mm, steps_per_mm)
    begin = _rounded(path.start[None, :].astype(np.float32), steps_per_mm)
    far = (np.abs(stop) > MAX_STEPS).any(axis=1)
    if far.any():
        row = int(targets.row[far.argmax()])
        block = int(path.block[row])
        raise ProgramError(
            "a position is beyond all that the controller can count",
            where=f"block {block + 1}" if block >= 0 else f"move {row}",
        )
    start = np.concatenate([begin, stop[:-1]])[: len(stop)]
    way = stop - start
    moves = way.any(axis=1)
    return Blocks(targets.row[moves], start[moves], way[moves])


def _rounded(mm: Singles, steps_per_mm: Singles) -> Ints:
    """(T, 3) steps: the 32-bit product, to the nearest whole, halves away from zero."""
    product = (mm * steps_per_mm).astype(np.float64)
    return np.asarray(np.copysign(np.floor(np.abs(product) + 0.5), product).astype(np.int64))


def speeds_of(blocks: Blocks, path: Toolpath, machine: Machine) -> SpeedPlan:
    """How fast each block may go, and each corner be passed.

    Along a unit vector u no axis exceeds its own limit, so a block is held to min(limit / |u|).
    At a corner between u1 and u2, with θ the angle between −u1 and u2, a circle touches both at
    `junction_deviation_mm` δ from the corner, and is followed (for its speed alone) at the
    acceleration a that u2 − u1 allows:  v² = a δ sin(θ/2) / (1 − sin(θ/2)).

    The timer cannot wait longer than `least_step_hz` says, so slower blocks run at that rate.
    """
    controller = machine.controller
    assert isinstance(controller, GrblController)
    step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
    way = blocks.way * step_mm
    length = np.sqrt((way**2).sum(axis=1))
    unit = way / length[:, None]
    rate = axis_limits(machine, "max_rate_mm_min") / 60.0
    acceleration = axis_limits(machine, "acceleration_mm_s2")
    highest = allowed_along(rate, unit)
    feed = np.where(path.is_feed, path.feed, np.inf)[blocks.row] / 60.0
    speed = np.maximum(np.minimum(feed, highest), LEAST_SPEED_MM_S)
    speed = np.maximum(speed, controller.least_step_hz * length / blocks.events)
    turn = np.zeros_like(unit)
    turn[1:] = unit[1:] - unit[:-1]
    across = np.sqrt((turn**2).sum(axis=1))
    cosine = 0.5 * across**2 - 1.0  # of the angle between the way back and the way on
    half_sine = np.sqrt(np.clip(0.5 * (1.0 - cosine), 0.0, 1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        allowed = allowed_along(acceleration, turn / np.where(across > 0.0, across, 1.0)[:, None])
        square = allowed * controller.junction_deviation_mm * half_sine / (1.0 - half_sine)
    corner = np.sqrt(np.where(cosine < -STRAIGHT_COS, np.inf, square))
    corner[(cosine > STRAIGHT_COS) | _from_rest(blocks, path)] = 0.0
    return SpeedPlan(length, speed, allowed_along(acceleration, unit), corner)


def stops(blocks: Blocks, path: Toolpath) -> Ints:
    """The blocks (S,) behind which the machine comes to rest."""
    begins = np.flatnonzero(_from_rest(blocks, path))
    return np.append(begins[1:], len(blocks.row))[: len(begins)] - 1


def _from_rest(blocks: Blocks, path: Toolpath) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(B,) true for blocks before which the machine stands."""
    waits = np.cumsum(np.isin(path.kind, WAITS))[blocks.row]
    return np.asarray(np.diff(waits, prepend=-1) > 0)
