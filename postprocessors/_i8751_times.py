"""How long the controller takes for its steps: one start rate, one ramp, one cruise rate.

A delay X between steps lasts t(X) = (6156·X + 10272)/12 MHz (L3156-3174); counted cycle by cycle
from the listing (L3126-3144) it is (6120·X + 8196)/12 MHz. A move of less than 90 steps runs at
the start delay throughout; a longer one takes 45 steps to speed up, each with a delay of 5 less,
and 45 to slow down again (L3197-3245). That leaves 17 (11H) for the cruise, 104 Hz by the
equation, while the authors speak of 70 Hz and of 2.46 ms less at each step: "declared".
"""

from __future__ import annotations

from typing import Final

import numpy as np
import numpy.typing as npt

from ._i8751_options import Dialect

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

CLOCK_HZ: Final = 12e6
"""The controller's crystal."""
DELAY_CYCLES: Final = {"thesis": (6156.0, 10272.0), "counted": (6120.0, 8196.0)}
RAMP_STEPS: Final = 45
"""Steps of the ramp, up and down."""
RAMP_RELOAD: Final = 5
"""What each step of the ramp takes off the timer's reload."""
DECLARED_HZ: Final = 70.0
"""The rate of steps that the thesis declares for the cruise."""


class StepTimes:
    """Seconds for counts of steps, as one set of `[dialect]` options has it."""

    def __init__(self, dialect: Dialect) -> None:
        self._bursts = dialect.high_byte == "255"
        self._flows = dialect.elbow == "flows"
        each, always = DELAY_CYCLES[dialect.delay]
        reloads = dialect.start_reload - RAMP_RELOAD * np.arange(RAMP_STEPS + 1)
        periods = (each * np.maximum(reloads, 1) + always) / CLOCK_HZ
        if dialect.cruise == "declared":
            periods = np.linspace(periods[0], 1.0 / DECLARED_HZ, RAMP_STEPS + 1)
        self._start_s = float(periods[0])
        self._ramp_s = float(periods[:-1].sum())
        self._cruise_s = float(periods[-1])

    def seconds(self, steps: Ints) -> Floats:
        """(N,) s for moves of so many steps of one motor, or of two together."""
        if not self._bursts:
            return self._one(steps)
        # Each unit of PH is a burst of 255 steps with ramps of its own (L5039).
        high = np.maximum(steps - 1, 0) // 255
        return high * self._one(np.array([255])) + self._one(steps - 255 * high)

    def dog_leg_seconds(self, steps: Ints) -> Floats:
        """(N,) s for records of (N, 2) steps: the diagonal, then the single leg."""
        size = np.abs(steps)
        together, most = size.min(axis=1, initial=1 << 40), size.max(axis=1, initial=0)
        if self._flows:
            return self.seconds(most)
        return np.asarray(self.seconds(together) + self.seconds(most - together))

    def _one(self, steps: Ints) -> Floats:
        ramped = 2.0 * self._ramp_s + (steps - 2 * RAMP_STEPS) * self._cruise_s
        return np.asarray(np.where(steps < 2 * RAMP_STEPS, steps * self._start_s, ramped))
