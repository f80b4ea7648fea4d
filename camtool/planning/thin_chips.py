"""The feed where a tool is engaged less than its limit: chips there are thinner, so it may rise.

A tooth that advances by f before the next one follows takes a chip whose thickness is f sin φ at
the angle φ from the beginning of its cut, which is the greatest one while φ is below 90° (H.
El-Hofy, Fundamentals of Machining Processes, 2nd ed., 2014, page 174: the greatest thickness
of a chip in plain milling). Where the engagement is φ instead of the limit Φ, the feed that keeps
that thickness is  sin Φ / sin φ  times that at the limit. The angle counts from the right end of
the front half of the tool's circle, where the chip is thinnest, to the farthest place in stock: a
thin wall ahead of the tool has thick chips.

The engagement is a bound for short chords, and the feed is one of few levels between that at the
limit and the greatest, so that it changes seldom and never exceeds what keeps the thickness."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.kernels.engagement import Cleared

LEVEL_RATIO = 1.25
"""Neighbouring levels of the feed differ by no more than this factor."""

MIN_STRETCH_SHARE = 2.0
"""The feed does not rise over stretches shorter than this many times the tool's radius."""

THICK_SHARE = 0.02
"""Material that sticks out by less than this part of the tool's radius does not count."""

FINE_RAD = math.radians(3.0)
"""Bounds of the engagement are as close as this."""


def feed_levels(feed_mm_min: float, max_feed_mm_min: float) -> Floats:
    """Return the levels of the feed, mm/min, ascending from the feed at the limit of engagement to
    the greatest."""
    ratio = max(max_feed_mm_min / feed_mm_min, 1.0)
    count = math.ceil(math.log(ratio) / math.log(LEVEL_RATIO))
    return np.asarray(feed_mm_min * ratio ** (np.arange(count + 1) / max(count, 1)))


def level_of(engaged_rad: Floats, limit_rad: float, levels: Floats) -> Ints:
    """Return the highest levels (K,) of the feed with which chips at these engagements (K,) are no
    thicker than at the limit with the lowest level."""
    sine = np.sin(np.clip(engaged_rad, 1e-9, 0.5 * math.pi))
    allowed = levels[0] * math.sin(limit_rad) / sine
    return np.asarray((np.searchsorted(levels, allowed, side="right") - 1).clip(min=0))


def without_peaks(level: Ints, lengths_mm: Floats, least_mm: float) -> Ints:
    """Return consecutive levels (K,), lowered where a level is kept or exceeded over less than
    `least_mm` of the path."""
    level = level.copy()
    for k in range(int(level.max(initial=0)), 0, -1):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], (level >= k).astype(int), [0]])))
        for low, high in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            if lengths_mm[low:high].sum() < least_mm:
                level[low:high] = k - 1
    return level


class FeedStretches(Struct, frozen=True, eq=False):
    """Stretches of a path with one feed on one line or arc: the first chord (P,) and the feed (P,)
    of each."""

    first: Ints
    feed_mm_min: Floats


def thin_chip_feeds(
    paths: Sequence[tuple[Floats, Ints]], tool_mm: float, limit_rad: float, levels: Floats
) -> list[FeedStretches]:
    """Return the feeds along paths that are cut in this order. A path is given as chords: moves
    (K, 9) as `camtool.kernels.engagement` reads them, and the line or arc (K,) of the path that
    each is a part of.

    What was air before is taken for stock, so that the feed is lower there than it might be."""
    every = np.concatenate([moves for moves, _ in paths])
    ends = np.concatenate([every[:, :2], every[:, 2:4]])
    extents = np.stack([ends.min(axis=0), ends.max(axis=0)])
    everywhere = np.array([-np.inf, -np.inf, np.inf, np.inf])
    cleared = Cleared(extents, tool_mm, everywhere, from_right=True)
    slightest = math.asin(math.sin(limit_rad) * float(levels[0] / levels[-1]))
    stretches = []
    for moves, row in paths:
        cuts = np.ones(len(moves), dtype=np.bool_)
        bound = cleared.judge(moves, cuts, THICK_SHARE * tool_mm, slightest, FINE_RAD)
        lengths = np.hypot(*(moves[:, 2:4] - moves[:, :2]).T)
        level = level_of(bound, limit_rad, levels)
        level = without_peaks(level, lengths, MIN_STRETCH_SHARE * tool_mm)
        changes = (np.diff(level) != 0) | (np.diff(row) != 0)
        first = np.concatenate([[0], np.flatnonzero(changes) + 1])
        stretches.append(FeedStretches(first, levels[level[first]]))
    return stretches
