"""The polar plots of full circles below the report: SVG within the page, in the page's colours."""

from __future__ import annotations

import html
import math
import re

import numpy as np

from camtool.preview.colours import (
    BACK,
    BACK_SPREAD,
    FEED,
    FRAME,
    GRID,
    INK,
    PLOT,
    QUIET,
    SPREAD,
)
from camtool.preview.dial import ROOM, dial_of, plot
from camtool.preview.polar import notes, shown
from camtool.preview.scene import Scene
from camtool.preview.svg import Look, element, number
from camtool.preview.viewer.run import Floats

MOST_PLOTS = 16
"""A page has no more plots than this: those of the largest circular errors."""

BINS_SHOWN = 120
"""Errors are joined until a plot has no more of them than this, every 3°."""

WIDTH = 520.0
"""Of a plot, in its own units; letters are some 14 high."""

NAMES = {
    FEED: "feed",
    SPREAD: "spread",
    BACK: "back",
    BACK_SPREAD: "back-spread",
    FRAME: "frame",
    GRID: "grid",
    INK: "ink",
    PLOT: "paper",
    QUIET: "quiet",
}
"""The page's own name of each colour of a plot, which is light or dark as the page is."""

_PAINT = re.compile('(fill|stroke)="(#[0-9a-f]{6})"')
_SHAPE = re.compile(' d="[^"]*"')
_DECIMAL = re.compile(r"(\.\d)\d")
_ID = re.compile(' id="[^"]*"')


def circles_of(scene: Scene) -> str:
    """HTML of the plots in the order of the report; empty without a full circle."""
    # The same circle gone round the other way is in the plot of the first.
    first = [
        which
        for which, one in enumerate(scene.rounds, 1)
        if one.partner is None or one.partner > which
    ]
    chosen = sorted(sorted(first, key=lambda which: -_size(scene, which))[:MOST_PLOTS])
    if not chosen:
        return ""
    said = "Full circles"
    if len(chosen) < len(first):
        said += f": the {len(chosen)} of {len(first)} with the largest circular error"
    figures = "\n".join(_figure(scene, which) for which in chosen)
    return f'<h2>{said}</h2>\n<div class="plots">\n{figures}\n</div>\n'


def _size(scene: Scene, which: int) -> float:
    error = scene.rounds[which - 1].circular_mm
    return error if math.isfinite(error) else 0.0


def _figure(scene: Scene, which: int) -> str:
    circles = shown(scene, which)
    errors = [_joined(circle.errors_um) for circle in circles]
    dial = dial_of(errors, WIDTH)
    dial = dial.placed(0.0, WIDTH)
    side = 2.0 * (dial.outer + ROOM)
    box = " ".join(map(number, (0.5 * (WIDTH - side), 0.0, side, side)))
    about = f"radial error of circle {which}"
    look: Look = {"viewBox": box, "role": "img", "aria-label": about}
    svg = element("svg", look, *plot(errors, dial))
    svg = _PAINT.sub(lambda found: f'{found[1]}="var(--{NAMES[found[2]]})"', _ID.sub("", svg))
    svg = _SHAPE.sub(lambda found: _DECIMAL.sub(r"\1", found[0]), svg)
    caption = "<br>".join(map(html.escape, notes(circles, dial)))
    return f"<figure>\n{svg}\n<figcaption>{caption}</figcaption>\n</figure>"


def _joined(errors_um: Floats) -> Floats:
    """(B, 3) least, mean and largest of neighbours; those of nothing but NaN stay so."""
    together = max(1, math.ceil(len(errors_um) / BINS_SHOWN))
    if len(errors_um) % together:
        return errors_um
    groups = errors_um.reshape(-1, together, 3)
    seen = np.isfinite(groups)
    count = seen.sum(axis=1)
    least = np.where(seen, groups, np.inf)[:, :, 0].min(axis=1)
    largest = np.where(seen, groups, -np.inf)[:, :, 2].max(axis=1)
    mean = np.where(seen, groups, 0.0)[:, :, 1].sum(axis=1) / np.maximum(count[:, 1], 1)
    joined = np.column_stack([least, mean, largest])
    return np.asarray(np.where(count > 0, joined, np.nan))
