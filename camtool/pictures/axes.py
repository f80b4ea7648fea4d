"""The frame of the plot: grid, ticks with their numbers in mm, scale bar."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.pictures import text
from camtool.pictures.colours import FRAME, GRID, INK, PLOT, QUIET
from camtool.pictures.svg import Look, PathData, element, number, title
from camtool.pictures.text import Style
from camtool.pictures.view import View, decimals_of, multiples, round_length, round_step

TICK_CAP = 14.5
NAME_LIFT = 19.0
"""Names of axes stand this far above the plot."""

TICK, MINOR_TICK = 8.0, 4.5
LABEL_GAP = 7.0
LEAST_SPACING = 78.0
BAR_SHARE = 0.2
"""The scale bar is at most this share of the plot's width."""

BAR_MARK = 5.0
NUMBERS = Style(TICK_CAP, QUIET)


@dataclass(frozen=True)
class Ticks:
    """Round numbers along both axes, the same `step_mm` on each."""

    step_mm: float
    x: tuple[float, ...]
    y: tuple[float, ...]

    def text(self, value: float) -> str:
        """The number at a tick."""
        return number(value, decimals_of(self.step_mm))

    @property
    def left_width(self) -> float:
        """Width of the widest number along Y."""
        return max((text.width(self.text(y), TICK_CAP) for y in self.y), default=0.0)


def ticks_of(view: View) -> Ticks:
    """Ticks so far apart that their numbers cannot touch."""
    spacing = LEAST_SPACING
    while True:
        step = round_step(spacing / view.scale)
        ticks = Ticks(
            step, tuple(multiples(*view.x_range, step)), tuple(multiples(*view.y_range, step))
        )
        widest = max((text.width(ticks.text(x), TICK_CAP) for x in ticks.x), default=0.0)
        if widest + 2.0 * TICK_CAP <= step * view.scale:
            return ticks
        spacing = widest + 2.0 * TICK_CAP


def frame(view: View, ticks: Ticks) -> str:
    """Ground and grid of the plot: goes below everything."""
    box, grid = view.box, PathData()
    for x in ticks.x:
        grid.move(view.page(x, 0.0)[0], box.top)
        grid.line(view.page(x, 0.0)[0], box.bottom)
    for y in ticks.y:
        grid.move(box.left, view.page(0.0, y)[1])
        grid.line(box.right, view.page(0.0, y)[1])
    ground: Look = {"x": box.left, "y": box.top, "width": box.width, "height": box.height}
    lines: Look = {"d": str(grid), "fill": "none", "stroke": GRID, "stroke-width": 1.2}
    return element(
        "g",
        {"id": "grid"},
        element("rect", {**ground, "fill": PLOT}),
        element("path", lines) if grid else "",
    )


def axes(view: View, ticks: Ticks) -> str:
    """Frame, ticks and numbers: goes above the plot."""
    box, marks, labels = view.box, PathData(), []
    unit = text.width("X (mm)", TICK_CAP)
    base = box.bottom + TICK + LABEL_GAP + TICK_CAP
    for x in ticks.x:
        across = view.page(x, 0.0)[0]
        _tick(marks, (across, box.bottom), (0.0, TICK))
        room = text.width(ticks.text(x), TICK_CAP) / 2.0 + TICK_CAP
        if across + room <= box.right - unit:
            centred = Style(TICK_CAP, QUIET, "middle")
            labels.append(text.label(ticks.text(x), (across, base), centred))
    for y in ticks.y:
        down = view.page(0.0, y)[1]
        _tick(marks, (box.left, down), (-TICK, 0.0))
        at = (box.left - TICK - LABEL_GAP, down + TICK_CAP / 2.0)
        labels.append(text.label(ticks.text(y), at, Style(TICK_CAP, QUIET, "end")))
    _minor(marks, view, ticks)
    labels.append(text.label("X (mm)", (box.right, base), Style(TICK_CAP, QUIET, "end")))
    labels.append(text.label("Y (mm)", (box.left, box.top - NAME_LIFT), NUMBERS))
    pen: Look = {"fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    edge: Look = {"x": box.left, "y": box.top, "width": box.width, "height": box.height}
    return element(
        "g",
        {"id": "axes"},
        element("rect", {**edge, **pen}),
        element("path", {"d": str(marks), **pen}) if marks else "",
        *labels,
    )


def _tick(marks: PathData, at: tuple[float, float], by: tuple[float, float]) -> None:
    marks.move(*at)
    marks.line(at[0] + by[0], at[1] + by[1])


def _minor(marks: PathData, view: View, ticks: Ticks) -> None:
    """Short ticks between: four to a step of 2, else five."""
    is_two = f"{ticks.step_mm:.0e}".startswith("2")
    step = ticks.step_mm / (4.0 if is_two else 5.0)
    for x in multiples(*view.x_range, step):
        _tick(marks, (view.page(x, 0.0)[0], view.box.bottom), (0.0, MINOR_TICK))
    for y in multiples(*view.y_range, step):
        _tick(marks, (view.box.left, view.page(0.0, y)[1]), (-MINOR_TICK, 0.0))


def scale_bar_length(view: View) -> tuple[float, str]:
    """A round length in mm, and how it is called."""
    length = round_length(BAR_SHARE * view.box.width / view.scale)
    if length < 1.0:
        return length, f"{number(length * 1000.0, decimals_of(length * 1000.0))} µm"
    return length, f"{number(length, 0)} mm"


def scale_bar_width(view: View) -> float:
    """Room that the bar and its label need."""
    length, name = scale_bar_length(view)
    return length * view.scale + 12.0 + text.width(name, TICK_CAP)


def scale_bar(view: View, right: float, middle: float) -> str:
    """A bar of round length with its label, ending at `right`, centred on height `middle`."""
    length, name = scale_bar_length(view)
    begin = right - length * view.scale
    data = PathData()
    data.move(begin, middle - BAR_MARK)
    data.line(begin, middle + BAR_MARK)
    data.move(begin, middle)
    data.line(right, middle)
    data.move(right, middle - BAR_MARK)
    data.line(right, middle + BAR_MARK)
    return element(
        "g",
        {"id": "scale-bar"},
        title(f"scale bar: {name}"),
        element("path", {"d": str(data), "fill": "none", "stroke": INK, "stroke-width": 2.2}),
        text.label(
            name, (begin - 12.0, middle + TICK_CAP / 2.0), Style(TICK_CAP, QUIET, anchor="end")
        ),
    )
