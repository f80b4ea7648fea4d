"""The palette, and the sequential map for errors.

The map runs from dark blue over magenta to orange, light and dark in even steps (the course of
matplotlib's CC0 "plasma", without its yellow end, which is lost on white paper). Lightness grows
all along it, so it reads the same to the colour-blind and in grey print; what is wrong glows.
Layers of a drawing are told apart by the colours of Okabe and Ito (jfly.uni-koeln.de/color).
"""

from __future__ import annotations

import math
from itertools import pairwise

PAPER = "#ffffff"
PLOT = "#fcfdfe"
INK = "#1b2530"
QUIET = "#566270"
FRAME = "#aeb8c4"
GRID = "#e9edf2"

DRAWING = "#b4bfcc"
BODY = "#eef2f6"
OUTLINE = "#2b4c6f"
FEED = "#0f6ac4"
FEED_PALE = "#8fbce8"
RAPID = "#8b96a3"
PLUNGE = "#f08a1d"
TRAVEL = "#a99bc9"
GAP = "#d5311e"

LAYERS = ("#2b4c6f", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#7f7f7f")

BINS = 24
"""Steps of the error map: fine enough to look smooth, few enough for small files."""

_ANCHORS = ("#0d0887", "#4903a0", "#7801a8", "#a52398", "#c8437b", "#e4695e", "#f8963c")


def sequential(fraction: float) -> str:
    """The colour "#rrggbb" at `fraction` of the map, 0 … 1; ValueError outside.

    >>> sequential(0.0), sequential(1.0)
    ('#0d0887', '#f8963c')
    """
    if not 0.0 <= fraction <= 1.0:
        raise ValueError(f"fraction {fraction} lies outside 0 … 1")
    steps = list(pairwise(_ANCHORS))
    index = min(int(fraction * len(steps)), len(steps) - 1)
    share = fraction * len(steps) - index
    low, high = (_channels(colour) for colour in steps[index])
    mixed = (round(a + (b - a) * share) for a, b in zip(low, high, strict=True))
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def bin_colours() -> tuple[str, ...]:
    """The colour of each of the `BINS` steps of the map, taken at its middle."""
    return tuple(sequential((index + 0.5) / BINS) for index in range(BINS))


def lightness(colour: str) -> float:
    """Relative luminance 0 … 1 of "#rrggbb" (WCAG 2.1)."""
    linear = [
        c / 12.92 if c <= 0.04045 else math.pow((c + 0.055) / 1.055, 2.4)
        for c in (channel / 255.0 for channel in _channels(colour))
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _channels(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
