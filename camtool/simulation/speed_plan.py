"""The times of blocks: trapezoids of speed between corners, with look-ahead.

A block is a line or an arc with one acceleration: d mm long, at most v mm/s fast, a mm/s². From
the entry speed v0 the speed rises with a to a peak, stays there, and falls with a to the exit
speed v1:

    peak² = min(v², a d + (v0² + v1²)/2)
    time  = (peak − v0)/a + (peak − v1)/a + (d − (2 peak² − v0² − v1²)/(2a)) / peak
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from camtool.arrays import Floats
from camtool.errors import MachineError
from camtool.machine.model import Machine

BLOCKS_AT_ONCE = 1 << 14
"""The times of so many blocks are computed together."""


@dataclass(frozen=True, eq=False)
class SpeedPlan:
    """N blocks in order: `length_mm`, `speed_mm_s` (the highest in each), `acceleration_mm_s2`,
    and `corner_mm_s`, the highest speed at the start of each, 0 where it starts from rest; each
    (N,), all above 0 except the corners."""

    length_mm: Floats
    speed_mm_s: Floats
    acceleration_mm_s2: Floats
    corner_mm_s: Floats

    def entries(self, window: int) -> Floats:
        """(N + 1,) mm/s at the start of each block, and 0 after the last, for a planner with a
        buffer of `window` blocks, the current one included."""
        from camtool.kernels.motion import entry_speeds

        highest = np.concatenate([[0.0], self.speed_mm_s[:-1]])[: len(self.speed_mm_s)]
        np.minimum(highest, self.speed_mm_s, out=highest)
        np.minimum(highest, self.corner_mm_s, out=highest)
        np.square(highest, out=highest)
        gain = 2.0 * self.acceleration_mm_s2
        gain *= self.length_mm
        square = np.zeros(len(self.length_mm) + 1)
        entry_speeds(gain, highest, window, square[:-1])
        return np.sqrt(square, out=square)

    def seconds(self, window: int) -> Floats:
        """(N,) s: the time of each block, for a buffer of `window` blocks."""
        return self.seconds_between(self.entries(window))

    def seconds_between(self, entry: Floats) -> Floats:
        """(N,) s: the time of each block, with the speeds (N + 1,) that `entries` gives."""
        seconds = np.empty(len(self.length_mm))
        for low in range(0, len(seconds), BLOCKS_AT_ONCE):
            at = slice(low, low + BLOCKS_AT_ONCE)
            a, d, first = self.acceleration_mm_s2[at], self.length_mm[at], entry[:-1][at]
            last = entry[1:][at]
            peak = np.minimum(self.speed_mm_s[at], np.sqrt(a * d + 0.5 * (first**2 + last**2)))
            ramps = (2.0 * peak**2 - first**2 - last**2) / (2.0 * a)
            steady = np.maximum(d - ramps, 0.0) / peak
            seconds[at] = (2.0 * peak - first - last) / a + steady
        return seconds


def allowed_along(limit: Floats, unit: Floats) -> Floats:
    """(B,) the largest value along unit vectors (B, 3) within the limits of three axes (3,)."""
    with np.errstate(divide="ignore"):
        return np.asarray((limit / np.abs(unit)).min(axis=1, initial=np.inf))


def axis_limits(machine: Machine, key: str) -> Floats:
    """(3,) the limit `key` of each axis; MachineError where one is missing."""
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
