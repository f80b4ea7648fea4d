"""The times of blocks: trapezoids of speed between corners, with look-ahead.

A block is a line or an arc with one acceleration: d mm long, at most v mm/s fast, a mm/s². From
the entry speed v0 the speed rises with a to a peak, stays there, and falls with a to the exit
speed v1:

    peak² = min(v², a d + (v0² + v1²)/2)
    time  = (peak − v0)/a + (peak − v1)/a + (d − (2 peak² − v0² − v1²)/(2a)) / peak"""

from __future__ import annotations

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints, columns_of
from camtool.errors import MachineError
from camtool.kernels.motion import entry_speeds
from camtool.machine.model import Machine


class EntryState(Struct, frozen=True):
    """What the blocks before a plan leave to it: the highest speed (mm/s) of the last of them, and
    the square of the speed, (mm/s)², that they allow at the plan's start; 0 and 0 at the
    beginning."""

    speed_mm_s: float = 0.0
    square: float = 0.0


FROM_REST = EntryState()


class SpeedPlan(Struct, frozen=True, eq=False):
    """N blocks in order: `length_mm`, `speed_mm_s` (the highest in each), `acceleration_mm_s2`,
    and `corner_mm_s`, the highest speed at the start of each, 0 where it starts from rest; each
    (N,), all above 0 except the corners. `before`: what came before them."""

    length_mm: Floats
    speed_mm_s: Floats
    acceleration_mm_s2: Floats
    corner_mm_s: Floats
    before: EntryState = FROM_REST

    def squares(self, window: int) -> Floats:
        """Return (N + 1,) (mm/s)²: the square of the speed at the start of each block, and 0 after
        the last. The planner has a buffer of `window` blocks, the current one included."""
        first = np.full(min(len(self.speed_mm_s), 1), self.before.speed_mm_s)
        highest = np.concatenate([first, self.speed_mm_s[:-1]])
        np.minimum(highest, self.speed_mm_s, out=highest)
        np.minimum(highest, self.corner_mm_s, out=highest)
        np.square(highest, out=highest)
        squares = np.zeros(len(self.length_mm) + 1)
        entry_speeds(self._gains(), highest, window, self.before.square, squares[:-1])
        return squares

    def seconds(self, squares: Floats) -> Floats:
        """Return (N,) s: the time of each block, given `squares` (N + 1,) from the method of that
        name."""
        a, d, entry = self.acceleration_mm_s2, self.length_mm, np.sqrt(squares)
        first, last = entry[:-1], entry[1:]
        peak = np.minimum(self.speed_mm_s, np.sqrt(a * d + 0.5 * (first**2 + last**2)))
        ramps = (2.0 * peak**2 - first**2 - last**2) / (2.0 * a)
        steady = np.maximum(d - ramps, 0.0) / peak
        return np.asarray((2.0 * peak - first - last) / a + steady)

    def moments_s(self, squares: Floats, block: Ints, way_mm: Floats) -> Floats:
        """Return (K,) s from the starts of blocks (K,) to the points `way_mm` (K,) along them,
        given `squares` (N + 1,) from the method of that name."""
        a, d = self.acceleration_mm_s2[block], self.length_mm[block]
        first, last = squares[:-1][block], squares[1:][block]
        peak_square = np.minimum(self.speed_mm_s[block] ** 2, a * d + 0.5 * (first + last))
        up_mm, down_mm = 0.5 * (peak_square - first) / a, 0.5 * (peak_square - last) / a
        way_mm = np.minimum(way_mm, d)
        rising_mm, falling_mm = np.minimum(way_mm, up_mm), np.minimum(d - way_mm, down_mm)
        steady_mm = np.clip(way_mm - up_mm, 0.0, np.maximum(d - up_mm - down_mm, 0.0))
        peak = np.sqrt(peak_square)
        rising_s = (np.sqrt(first + 2.0 * a * rising_mm) - np.sqrt(first)) / a
        falling_s = (peak - np.sqrt(last + 2.0 * a * falling_mm)) / a
        return np.asarray(rising_s + steady_mm / peak + falling_s)

    def entry_after(self, count: int, squares: Floats) -> EntryState:
        """Return the entry state for a plan of the blocks after the first `count`."""
        if count == 0:
            return self.before
        reached = squares[count - 1] + self._gains()[count - 1]
        return EntryState(float(self.speed_mm_s[count - 1]), float(reached))

    def _gains(self) -> Floats:
        """Return (N,) (mm/s)²: the largest change of the squared speed within each block, 2 ·
        acceleration · length."""
        return np.asarray(2.0 * self.acceleration_mm_s2 * self.length_mm)


def max_along(limit: Floats, unit: Floats) -> Floats:
    """Return (B,) the largest value (speed or acceleration) along each unit vector (B, 3) with
    which no axis exceeds its limit (3,)."""
    with np.errstate(divide="ignore", over="ignore"):
        each_axis = limit[:, None] / np.abs(columns_of(unit))
        return np.asarray(each_axis.min(axis=0, initial=np.inf))


def axis_limits(machine: Machine, key: str) -> Floats:
    """Return (3,) the limit `key` of X, Y and Z; MachineError if one is missing."""
    values = []
    for name, axis in zip("xyz", machine.axes, strict=True):
        value: float | None = getattr(axis, key)
        if value is None:
            raise MachineError(
                f"the planner of {machine.target.name} needs the {key} of each axis",
                where=f"table [axes.{name}], key {key}",
                mend="give it: it is one of the controller's settings",
            )
        values.append(value)
    return np.array(values)
