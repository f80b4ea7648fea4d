"""The palette, and the sequential map for errors.

The map runs from dark blue over magenta to orange, light and dark in even steps (the course of
matplotlib's CC0 "plasma", without its yellow end, which is lost on white paper). Lightness grows
all along it, so that the colour-blind and a grey print show the same order.
On a dark ground the map is cut at its other end: it runs from violet to plasma's yellow.
Layers of a drawing are told apart by the colours of Okabe and Ito (jfly.uni-koeln.de/color)."""

from __future__ import annotations

import re
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
SPREAD = "#90bde9"
BACK = "#c2500a"
BACK_SPREAD = "#f2c49b"
RAPID = "#8b96a3"
PLUNGE = "#f08a1d"
TRAVEL = "#a99bc9"
STOCK = "#9a7b4f"
GAP = "#d5311e"
SWEPT = "#d6e6f6"
REVERSAL = "#8a2be2"
ENTRY = "#009e73"

VERDICTS = {"in": "#009e73", "undecided": "#e69f00", "out": GAP, "predicted": RAPID}

LAYER_COLOURS = ("#2b4c6f", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#5a5a5a")

BINS = 24
"""Steps of the error map: fine enough to look smooth, few enough for small files."""

_ANCHORS = ("#0d0887", "#4903a0", "#7801a8", "#a52398", "#c8437b", "#e4695e", "#f8963c")


_DARK_ANCHORS = ("#9131cc", "#b0309f", "#cc4778", "#e56b5d", "#f89540", "#fdc527", "#f0f921")

_DARK = {
    PAPER: "#11161c",
    PLOT: "#161c24",
    INK: "#e8edf2",
    QUIET: "#a9b5c1",
    FRAME: "#4d5a68",
    GRID: "#242d38",
    DRAWING: "#55636f",
    BODY: "#1d2631",
    FEED: "#4aa3f0",
    FEED_PALE: "#4277a8",
    SPREAD: "#2f557a",
    BACK: "#f0803c",
    BACK_SPREAD: "#6e4426",
    RAPID: "#78848f",
    PLUNGE: "#f5a03c",
    TRAVEL: "#7d6ca6",
    STOCK: "#b8976a",
    GAP: "#ff6b57",
    SWEPT: "#28435f",
    REVERSAL: "#c79bff",
    "#2b4c6f": "#cfdbe8",
    "#d55e00": "#f0803c",
    "#009e73": "#2fc79a",
    "#cc79a7": "#e59cc4",
    "#56b4e9": "#56b4e9",
    "#e69f00": "#f0c040",
    "#5a5a5a": "#8f8f8f",
}
"""The colour of the dark palette for each of the light one."""

_PAINT = re.compile('(fill|stroke)="(#[0-9a-f]{6})"')


def sequential(fraction: float, *, dark: bool = False) -> str:
    """Return the colour "#rrggbb" at `fraction` of the map, 0 … 1; ValueError outside.

    >>> sequential(0.0), sequential(1.0)
    ('#0d0887', '#f8963c')
    """
    if not 0.0 <= fraction <= 1.0:
        raise ValueError(f"fraction {fraction} lies outside 0 … 1")
    steps = list(pairwise(_DARK_ANCHORS if dark else _ANCHORS))
    index = min(int(fraction * len(steps)), len(steps) - 1)
    share = fraction * len(steps) - index
    low, high = (channels(colour) for colour in steps[index])
    mixed = (round(a + (b - a) * share) for a, b in zip(low, high, strict=True))
    return "#" + "".join(f"{channel:02x}" for channel in mixed)


def bin_colours(*, dark: bool = False) -> tuple[str, ...]:
    """Return the colour of each of the `BINS` steps of the map, taken at its middle."""
    return tuple(sequential((index + 0.5) / BINS, dark=dark) for index in range(BINS))


def on_dark(colour: str) -> str:
    """Return the colour of the dark palette that replaces one of the light palette; KeyError for
    any other."""
    return _DARK[colour]


def darkened(svg: str) -> str:
    """Return a picture with the colours of its fills and strokes replaced by those of the dark
    palette."""
    instead = _DARK | dict(zip(bin_colours(), bin_colours(dark=True), strict=True))
    return _PAINT.sub(lambda match: f'{match[1]}="{instead[match[2]]}"', svg)


def channels(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, 0 … 255, of "#rrggbb"."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


UNKNOWN, AIR, CUT_ENTRY = -3, -2, -1
"""Steps of moves whose engagement is unknown, of moves that cut nothing, and of entries."""

ENGAGED_NAMES = {AIR: "cuts nothing", UNKNOWN: "engagement not known", CUT_ENTRY: "entry"}

ENGAGED_STYLES = {
    AIR: (RAPID, 0.4),
    UNKNOWN: (FEED_PALE, 0.6),
    CUT_ENTRY: (ENTRY, 1.0),
    **{step: (colour, 1.0) for step, colour in enumerate(bin_colours())},
}
"""Colour and share of the pen for each step of engagement, the lowest first: the most engaged
moves are drawn on top."""
