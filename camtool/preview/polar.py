"""The polar plot of a circle: its radial error, magnified, about the programmed circle; both ways
round in one plot where the path goes both, as a ball-bar does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from camtool.errors import OptionError
from camtool.preview import legend
from camtool.preview.dial import PENS, ROOM, Dial, dial_of, plot
from camtool.preview.legend import Entry, line_swatch
from camtool.preview.options import SVG_WIDTH_PX, Options
from camtool.preview.page import foot_of, sheet
from camtool.preview.rounds import Floats, Round
from camtool.preview.scene import Scene
from camtool.preview.svg import number
from camtool.preview.view import MARGIN, page_width
from camtool.units import UM_PER_MM


@dataclass(frozen=True, eq=False)
class Shown:
    """A circle of the plot: its number, and its errors (B, 3) µm."""

    which: int
    one: Round
    errors_um: Floats

    @property
    def way(self) -> str:
        return "counterclockwise" if self.one.ccw else "clockwise"


def shown(scene: Scene, which: int) -> tuple[Shown, ...]:
    """The `which`-th circle of the scene, from 1, and the same one gone round the other way where
    there is that, counterclockwise first; OptionError when there is no such circle."""
    if not 1 <= which <= len(scene.rounds):
        many = len(scene.rounds)
        raise OptionError(
            f"there is no circle {which}" + (f" in {scene.title}" if scene.title else ""),
            where="--polar",
            mend=f"take 1 to {many}" if many else "the path goes round no full circle",
        )
    partner = scene.rounds[which - 1].partner
    numbers = [which] if partner is None else [which, partner]
    rounds = [(number, scene.rounds[number - 1]) for number in numbers]
    rounds.sort(key=lambda found: not found[1].ccw)
    return tuple(Shown(number, one, one.errors() * UM_PER_MM) for number, one in rounds)


def draw_polar(scene: Scene, which: int, options: Options) -> str:
    """SVG text of the `which`-th circle of the scene, from 1; OptionError when there is none."""
    width = page_width(options.size_px or SVG_WIDTH_PX)
    circles = shown(scene, which)
    errors = [circle.errors_um for circle in circles]
    dial = dial_of(errors, width)
    head, down = legend.head(scene.title, notes(circles, dial), width)
    dial = dial.placed(down, width)
    foot = dial.middle[1] + dial.outer + ROOM
    below, foot = legend_below(entries(circles), foot, width)
    return sheet(scene.title, (width, foot), options, head, *plot(errors, dial), below)


def legend_below(entries: Sequence[Entry], top: float, width: float) -> tuple[str, float]:
    """The legend below `top` on a page so wide, and the height of that page."""
    if not entries:
        return "", round(top + MARGIN)
    room = width - 2.0 * MARGIN
    table = legend.rows(entries, room, room)
    legend_y = top + 0.5 * legend.ROW_STEP
    return legend.legend(table, MARGIN, legend_y), foot_of(table, legend_y)


def entries(circles: Sequence[Shown]) -> list[Entry]:
    """Which way is which, where there are two."""
    if len(circles) < 2:
        return []
    return [
        Entry(line_swatch(line, 2.4), f"{circle.way} (circle {circle.which})")
        for circle, (line, _) in zip(circles, PENS, strict=False)
    ]


def notes(circles: Sequence[Shown], dial: Dial) -> tuple[str, ...]:
    """The circle, its figures, and how much its errors are magnified."""
    first = circles[0].one
    x, y = first.centre_mm
    magnified = dial.per_um * UM_PER_MM * first.radius_mm / dial.base
    times = number(float(f"{magnified:.3g}"), 3)
    scale = f"radial error × {times}; from ring to ring {dial.step_um:g} µm"
    place = f"radius {first.radius_mm:.4g} mm about ({x:.4g}, {y:.4g}) mm"
    if len(circles) == 1:
        about = f"circle {circles[0].which}: {place}, {circles[0].way}"
        figures = f"{_iso(first)} (µm)", f"reversal values {_reversal(first)} (µm)"
        return (about, *figures, scale)
    told = [
        f"{circle.way}: {_iso(circle.one)}, {_reversal(circle.one)} (µm)" for circle in circles
    ]
    both = f"both ways together: G(b) {_um(first.both_circular_mm).lstrip('+')} (µm)"
    names = " and ".join(str(circle.which) for circle in circles)
    return (f"circles {names}: {place}, both ways round", *told, both, scale)


def _iso(one: Round) -> str:
    largest, least, mean = one.radial_mm
    circular = _um(one.circular_mm).lstrip("+")
    return f"G {circular}, F max {_um(largest)}, F min {_um(least)}, mean {_um(mean)}"


def _reversal(one: Round) -> str:
    return f"B: X {_um(one.reversal_mm[0])}, Y {_um(one.reversal_mm[1])}"


def _um(length_mm: float) -> str:
    return f"{length_mm * UM_PER_MM:+.2f}" if math.isfinite(length_mm) else "unknown"
