"""The arithmetic of the parallel-port machine's timers, for whole columns of moves."""

from __future__ import annotations

import numpy as np

from camtool.arrays import Bools, Floats, Ints

from .dialect import FlashcutController

PERIOD_GUARD = 1e-6
"""ms. Half periods of feeds that are decimals may lie this much below a half of a millisecond."""


def shortest_ms(alone: Bools, controller: FlashcutController) -> Floats:
    """(N,) ms: the shortest half period of moves, which are of one axis `alone` (N,) or of two."""
    both = float(controller.half_period_ms)
    one = controller.single_axis_half_period_ms
    return np.where(alone, both if one is None else min(float(one), both), both)


def feeds_of(half_period_ms: Floats, step_mm: float, controller: FlashcutController) -> Floats:
    """(N,) mm/min of the longer axis at these half periods."""
    return 60_000.0 * step_mm / (controller.half_periods_per_step * (half_period_ms + 1.0))


def half_periods_ms(
    feed_mm_min: Floats, step_mm: float, alone: Bools, controller: FlashcutController
) -> Floats:
    """(N,) whole ms: half periods of the longer axis at these feeds (inf: rapids), of moves of one
    axis `alone` (N,) or of two.

    A step takes some half periods P, each of which is a millisecond late:

        60 step / feed = parts (P + 1) / 1000,      the nearest whole P, but never a shorter one
    """
    with np.errstate(over="ignore"):
        step_ms = 60_000.0 * step_mm / feed_mm_min
    wanted = np.floor(step_ms / controller.half_periods_per_step - 1.0 + 0.5 + PERIOD_GUARD)
    return np.maximum(wanted, shortest_ms(alone, controller))


def steps_too_many(
    longer: Ints, shorter: Ints, half_period: Ints, controller: FlashcutController
) -> Ints:
    """(N,) steps that the shorter axis makes beyond its own, of moves of `longer` ≥ `shorter` ≥ 0
    steps; see `steps`, which makes them one by one."""
    least = np.maximum(shorter, 1)
    if controller.clock == "late-longer":
        made = shorter * (half_period + 1) // half_period
    else:
        made = longer * (half_period + 1) // (half_period * longer // least + 1)
    return np.where(shorter > 0, made - shorter, 0)
