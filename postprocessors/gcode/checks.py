"""Checks of moves before writers of G-code make blocks of them: a PostError names the move."""

from __future__ import annotations

from typing import Final

import numpy as np

from camtool.arrays import Ints
from camtool.findings import Finding
from camtool.machine.model import Machine, exceeds
from camtool.toolpath.moves import Kind, Toolpath
from camtool.toolpath.refusals import refuse, refuse_start, refuse_two_radii

from .dialect import MM, Unit, feed_decimals
from .findings import FEED_ROUNDED

MAX_MM: Final = 99_999.0
"""Coordinates beyond this are refused: with three decimals, grbl's 8 digits end there."""

ARC_RADIUS_SPREAD_MM: Final = 0.05
"""The radii at the start and at the end of a wanted arc may differ by this much, no more."""

WHOLE_TOLERANCE: Final = 1e-6
"""An F word within this much of a whole number is whole."""


def check(toolpath: Toolpath, machine: Machine) -> None:
    """Refuse rows that cannot be written or executed, whatever their order."""
    refuse_start(toolpath)
    is_far = np.abs(toolpath.end).max(axis=1, initial=0.0) > MAX_MM
    refuse(toolpath, is_far, f"a coordinate beyond {MAX_MM:g} mm", "check the units")
    refuse_two_radii(toolpath, ARC_RADIUS_SPREAD_MM)
    _check_feeds(toolpath, machine)


def feed_units(
    toolpath: Toolpath, machine: Machine, unit: Unit = MM
) -> tuple[Ints, list[Finding]]:
    """Return the feeds (N,) in whole units of the F word, rounded down, 0 for rows without one;
    and FEED_ROUNDED if a feed had to be rounded."""
    scale = 10.0 ** (feed_decimals(machine) + unit.more_decimals) / unit.mm
    exact_units = np.where(toolpath.is_feed, toolpath.feed, 0.0) * scale
    rounded = np.rint(exact_units)
    exact = np.abs(exact_units - rounded) <= WHOLE_TOLERANCE
    units = np.where(exact, rounded, np.floor(exact_units)).astype(np.int64)
    refuse(
        toolpath,
        toolpath.is_feed & (units <= 0),
        lambda row: f"a feed of {toolpath.feed[row]:g} mm/min becomes 0 in an F word",
        f"use {1.0 / scale:g} mm/min or more",
    )
    if exact.all():
        return units, []
    row = int(np.argmax(~exact))
    finding = FEED_ROUNDED(
        where=toolpath.place(row),
        measured=toolpath.feed[row],
        count=int((~exact).sum()),
        whole=1.0 / scale,
    )
    return units, [finding]


def _check_feeds(toolpath: Toolpath, machine: Machine) -> None:
    """Raise PostError for feeds that are not numbers above 0, or above the machine's highest
    feed."""
    feed, is_feed = toolpath.feed, toolpath.is_feed
    with np.errstate(invalid="ignore"):
        fine = (feed > 0.0) & np.isfinite(feed)
        refuse(
            toolpath,
            is_feed & ~fine,
            lambda row: f"a {Kind(int(toolpath.kind[row])).name} without a feed above 0",
        )
        limit = machine.max_feed_mm_min
        refuse(
            toolpath,
            is_feed & exceeds(feed, limit),
            lambda row: (
                f"a feed of {feed[row]:g} mm/min is above the machine's highest, {limit:g}"
            ),
            "lower the feed, or use --set limits.max_feed_mm_min=…",
        )
