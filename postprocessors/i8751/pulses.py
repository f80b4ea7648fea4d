"""Pulses of the Intel 8751: what its firmware makes of steps, and how long it takes.

A delay X between pulses lasts t(X) = (6156·X + 10272)/12 MHz (L3156-3174); counted cycle by cycle
from the listing (L3126-3144) it is (6120·X + 8196)/12 MHz. A run of less than 90 pulses has the
start delay throughout; a longer one takes 45 pulses to speed up, each with a delay of 5 less, and
45 to slow down again (L3197-3245). That leaves 17 (11H) for the cruise, 104 Hz by the equation,
while the authors speak of 70 Hz and of 2.46 ms less at each pulse: "declared".

The motors of X and Y run together for as many pulses as the smaller of their counts, and then the
other one goes on alone (L4683-4705). Both are routines of their own (L4768-4873)."""

from __future__ import annotations

from typing import Annotated, Final, Literal

import msgspec
import numpy as np
from msgspec import Meta

from camtool.arrays import Floats, Ints

CLOCK_HZ: Final = 12e6
"""The controller's crystal (L2993)."""

DELAY_PERIODS: Final = {"thesis": (6156.0, 10272.0), "counted": (6120.0, 8196.0)}
"""Periods of the crystal in a delay X: a·X + b."""

RAMP_PULSES: Final = 45
"""Pulses of the ramp, up and down (L3199-3203)."""

RAMP_RELOAD: Final = 5
"""Each pulse of the ramp reduces the delay by this (L3213-3236)."""

DECLARED_HZ: Final = 70.0
"""The rate of pulses that the thesis declares for the cruise (L3187-3191)."""

BURST_PULSES: Final = 255
"""Pulses of a burst: one unit of PH where `high_byte` is "255" (L5039)."""


class Firmware(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Readings of the thesis where it leaves a question on pulses open: keys of `[dialect]`.

    `high_byte`: steps of one unit of PH (L4121-4127), or bursts with ramps of their own (L5039).
    `first_pulse`: whether the first pulse of a motor's move is the last one again (L4556-4566).
    `cruise`: the delay that is left, or the rate that is declared. `delay`: the equation, or the
    cycles of the listing. `start_reload`: F2H, L3171-3180. `elbow`: whether the motor that goes
    on alone begins a ramp anew."""

    high_byte: Literal["256", "255"] = "256"
    first_pulse: Literal["moves", "repeats"] = "moves"
    cruise: Literal["coded", "declared"] = "coded"
    delay: Literal["thesis", "counted"] = "thesis"
    start_reload: Annotated[int, Meta(ge=1, le=255)] = 242
    elbow: Literal["ramps", "flows"] = "ramps"

    @property
    def lost_pulses(self) -> int:
        """Pulses at the start of each motor's move that do not move it."""
        return 1 if self.first_pulse == "repeats" else 0

    def pulses(self, steps: Ints) -> Ints:
        """Return the number of pulses for these steps, which may have either sign and any
        shape."""
        return np.where(steps != 0, np.abs(steps) + self.lost_pulses, 0)


class PulseTimes:
    """Durations of moves by their number of steps, s."""

    def __init__(self, firmware: Firmware) -> None:
        self._firmware = firmware
        each, always = DELAY_PERIODS[firmware.delay]
        reloads = firmware.start_reload - RAMP_RELOAD * np.arange(RAMP_PULSES + 1)
        periods = (each * np.maximum(reloads, 1) + always) / CLOCK_HZ
        if firmware.cruise == "declared":
            periods = np.linspace(periods[0], 1.0 / DECLARED_HZ, RAMP_PULSES + 1)
        self.periods_s: Floats = periods
        """Seconds (46,) between pulses: the ramp up, then the cruise."""
        self._ramp_s = float(periods[:-1].sum())

    def alone_s(self, steps: Ints) -> Floats:
        """Return (N,) seconds of moves of one motor by `steps` (N,)."""
        return self._run_s(self._firmware.pulses(steps))

    def legs_s(self, steps: Ints) -> Floats:
        """Return (N, 2) seconds of records of `steps` (N, 2): of both motors together, and of one
        alone.

        Where one ramp covers both ("flows"), the time is divided in proportion to the pulses."""
        pulses = self._firmware.pulses(steps)
        shorter, longer = pulses.min(axis=1), pulses.max(axis=1)
        both_s = self._run_s(shorter)
        if self._firmware.elbow == "ramps":
            return np.column_stack([both_s, self._run_s(longer - shorter)])
        longer_s = self._run_s(longer)
        both_s = longer_s * shorter / np.maximum(longer, 1)
        return np.column_stack([both_s, longer_s - both_s])

    def around(self, steps: Ints, number: Ints) -> tuple[Floats, Floats]:
        """Return two arrays (K,) of seconds for the steps `number` (K,), counted from 0, of
        records of `steps` (K, 3) ≥ 0: the pulses without a step right before each, and the delay
        behind it."""
        x, y, z = steps.T
        both, longer = np.minimum(x, y), np.maximum(x, y)
        flows = self._firmware.elbow == "flows"
        is_z, is_alone = number >= longer, (number >= both) & (number < longer)
        starts_anew = is_alone & (not flows)
        pulse = number - np.where(is_z, longer, np.where(starts_anew, both, 0))
        steps_of_run = np.where(flows, longer, both)
        steps_of_run = np.where(is_z, z, np.where(starts_anew, longer - both, steps_of_run))
        lost = np.where(starts_anew & (both > 0), 0, self._firmware.lost_pulses)
        total = steps_of_run + lost
        first_s = self._delays_s(np.zeros_like(total), total)
        before_s = np.where((pulse == 0) & (lost > 0), first_s, 0.0)
        return before_s, self._delays_s(pulse + lost, total)

    def _delays_s(self, pulse: Ints, total: Ints) -> Floats:
        """Return (K,) seconds of delay behind the pulses `pulse` (K,), counted from 0, in runs of
        `total` (K,) pulses."""
        if self._firmware.high_byte == "255":
            in_bursts = total // BURST_PULSES * BURST_PULSES
            total = np.where(pulse < in_bursts, BURST_PULSES, total - in_bursts)
            pulse = np.where(pulse < in_bursts, pulse % BURST_PULSES, pulse - in_bursts)
        ramp = np.minimum(np.minimum(pulse, total - 1 - pulse), RAMP_PULSES)
        return self.periods_s[np.where(total < 2 * RAMP_PULSES, 0, ramp)]

    def _run_s(self, pulses: Ints) -> Floats:
        """Return (N,) seconds of runs of `pulses` (N,), each with its ramps."""
        if self._firmware.high_byte == "256":
            return self._burst_s(pulses)
        bursts = pulses // BURST_PULSES
        burst_s = self._burst_s(np.array([BURST_PULSES]))
        return np.asarray(bursts * burst_s + self._burst_s(pulses - BURST_PULSES * bursts))

    def _burst_s(self, pulses: Ints) -> Floats:
        """Return (N,) seconds of runs of `pulses` (N,) with one ramp up and one down; only runs of
        90 pulses and more have ramps."""
        ramped = 2.0 * self._ramp_s + (pulses - 2 * RAMP_PULSES) * self.periods_s[-1]
        return np.asarray(np.where(pulses < 2 * RAMP_PULSES, pulses * self.periods_s[0], ramped))
