"""The arithmetic of the parallel-port machine's timers, for whole columns of moves."""

from __future__ import annotations

import numpy as np

from camtool.arrays import Bools, Floats, Ints

from .dialect import FlashcutController

PERIOD_GUARD = 1e-6
"""ms. Half periods of feeds that are decimals may lie this much below a half of a millisecond."""


def shortest_ms(has_one_axis: Bools, controller: FlashcutController) -> Floats:
    """Return (N,) the shortest half period, ms, of moves of one axis (`has_one_axis` (N,)) or of
    two."""
    both_ms = float(controller.half_period_ms)
    one = controller.single_axis_half_period_ms
    return np.where(has_one_axis, both_ms if one is None else min(float(one), both_ms), both_ms)


def feeds_of(half_period_ms: Floats, step_mm: float, controller: FlashcutController) -> Floats:
    """Return (N,) the feeds of the longer axis at these half periods, mm/min."""
    return 60_000.0 * step_mm / (controller.half_periods_per_step * (half_period_ms + 1.0))


def half_periods_ms(
    feed_mm_min: Floats, step_mm: float, has_one_axis: Bools, controller: FlashcutController
) -> Floats:
    """Return (N,) the half periods of the longer axis, whole ms, at these feeds (inf: rapids), for
    moves of one axis (`has_one_axis` (N,)) or of two.

    A step takes some half periods P, each of which is a millisecond late:

        60 step / feed = parts (P + 1) / 1000,      the nearest whole P, but never a shorter one"""
    with np.errstate(over="ignore"):
        step_ms = 60_000.0 * step_mm / feed_mm_min
    periods = np.floor(step_ms / controller.half_periods_per_step - 1.0 + 0.5 + PERIOD_GUARD)
    return np.maximum(periods, shortest_ms(has_one_axis, controller))


def steps_too_many(
    longer: Ints, shorter: Ints, half_period: Ints, controller: FlashcutController
) -> Ints:
    """Return (N,) the surplus steps of the shorter axis in moves of `longer` ≥ `shorter` ≥ 0
    steps; `steps` makes them one by one."""
    divisor = np.maximum(shorter, 1)
    if controller.clock == "late-longer":
        made_steps = shorter * (half_period + 1) // half_period
    else:
        made_steps = longer * (half_period + 1) // (half_period * longer // divisor + 1)
    return np.where(shorter > 0, made_steps - shorter, 0)
