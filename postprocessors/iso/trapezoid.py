"""Any controller, as one that accelerates evenly and rounds no corner: `model = "trapezoid"`.

For controllers whose sources nobody can read. Its numbers are measured on the machine: the
acceleration of each axis, and the speed at which it takes a corner of 90°. Lines and arcs are
followed exactly, each a block with one acceleration.

A corner between two directions with the angle 180° − θ is met at v² = v₉₀² (√2 − 1) s / (1 − s),
s = cos(θ/2): at v₉₀ for θ = 90°, at any speed straight on, at rest straight back. That is a circle
that touches both, at one distance from every corner and one acceleration. With v₉₀ = 0 it stops at
every corner. An arc is no faster than √(a r)."""

from __future__ import annotations

from typing import Any

import numpy as np

from camtool.arrays import Floats
from camtool.machine.model import Machine
from camtool.simulation.samples import move_lengths
from camtool.simulation.speed_plan import SpeedPlan, axis_limits, max_along
from camtool.toolpath.moves import EVENTS_AT_REST, Kind, Toolpath

from .controllers import TrapezoidController
from .timed import MIN_MOVE_MM, PlannedMoves, TimedModel, directions, profile, sections

STRAIGHT_COS = 0.999999
"""Beyond this cosine of the turn two moves are straight on."""


_Machine = Machine[Any, Any]


class TrapezoidModel(TimedModel):
    """Trapezoids of speed along the programmed moves."""

    def interpolation(self, *_: object) -> str:
        """Return "path": lines and arcs are followed exactly."""
        return "path"

    def planned(self, path: Toolpath, machine: _Machine) -> PlannedMoves:
        """Return the moves with their speeds."""
        controller = machine.controller
        assert isinstance(controller, TrapezoidController)
        length = move_lengths(path)
        length = np.where(length >= MIN_MOVE_MM, length, 0.0)
        begins, ends = _tangents(path, length)
        speed, acceleration = _limits(path, begins, machine)
        speeds = np.zeros((3, len(path)))
        for part in sections(np.flatnonzero(length > 0.0), np.isin(path.kind, EVENTS_AT_REST)):
            corner = _corners(begins[part], ends[part], controller.corner_mm_s)
            plan = SpeedPlan(length[part], speed[part], acceleration[part], corner)
            speeds[:, part] = profile(plan, plan.squares(controller.buffer_blocks))
        return PlannedMoves(path, np.arange(len(path)), length, acceleration, *speeds)

    def assumptions(self, toolpath: Toolpath, machine: _Machine) -> tuple[str, ...]:
        """Return the assumptions behind the times, as sentences for the report."""
        corner = machine.controller.corner_mm_s
        return (
            "the controller follows every line and arc exactly, at even accelerations",
            f"corners of 90° at {corner:g} mm/s" if corner else "it stops at every corner",
        )


def _tangents(path: Toolpath, length: Floats) -> tuple[Floats, Floats]:
    """Return the unit tangents (N, 3) at the start and at the end of each move."""
    _, chord = directions(path)
    begins, ends = chord.copy(), chord.copy()
    arcs = np.flatnonzero(path.is_arc & (length > 0.0))
    sign = np.where(path.kind[arcs] == Kind.ARC_CW, -1.0, 1.0)[:, None]
    rise = path.end[arcs, 2] - path.starts_of(arcs)[:, 2]
    slope = rise / length[arcs]
    flat = np.sqrt(np.maximum(1.0 - slope**2, 0.0))[:, None]
    for tangents, points in ((begins, path.starts_of(arcs)), (ends, path.end[arcs])):
        arm = points[:, :2] - path.centre[arcs]
        across = np.column_stack([-arm[:, 1], arm[:, 0]]) * sign
        tangents[arcs, :2] = flat * across / np.hypot(arm[:, 0], arm[:, 1])[:, None]
        tangents[arcs, 2] = slope
    return begins, ends


def _limits(path: Toolpath, unit: Floats, machine: _Machine) -> tuple[Floats, Floats]:
    """Return the highest speed (N,) mm/s and the acceleration (N,) mm/s² of each move. An arc
    keeps the limits of the slower of X and Y throughout."""
    rate = axis_limits(machine, "max_rate_mm_min") / 60.0
    acceleration = axis_limits(machine, "acceleration_mm_s2")
    rapid = machine.limits.rapid_mm_min or np.inf
    feed = np.where(path.is_feed, path.feed, rapid) / 60.0
    arcs = np.flatnonzero(path.is_arc)
    widest = unit.copy()
    widest[arcs, :2] = np.hypot(unit[arcs, 0], unit[arcs, 1])[:, None]
    speed = np.minimum(feed, max_along(rate, widest))
    along = max_along(acceleration, widest)
    arm = path.starts_of(arcs)[:, :2] - path.centre[arcs]
    radius = np.hypot(arm[:, 0], arm[:, 1])
    speed[arcs] = np.minimum(speed[arcs], np.sqrt(acceleration[:2].min() * radius))
    return speed, along


def _corners(begins: Floats, ends: Floats, corner_mm_s: float) -> Floats:
    """Return (K,) mm/s: the highest speed at the start of each move; 0 for the first."""
    cosine = np.clip((begins[1:] * ends[:-1]).sum(axis=1), -1.0, 1.0)
    sine = np.sqrt(0.5 * (1.0 + cosine))  # of half the angle between the way back and the way on
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        square = corner_mm_s**2 * (np.sqrt(2.0) - 1.0) * sine / (1.0 - sine)
    speed = np.where(cosine > STRAIGHT_COS, np.inf, np.sqrt(square))
    return np.concatenate([np.zeros(min(len(begins), 1)), speed])
