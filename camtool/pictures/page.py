"""The page of a picture: where its parts lie, and what stands around the plot.

That is the head, axes with their numbers, legend, colour bar and scale bar; `sheet` makes the SVG
of all parts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from msgspec import Struct

from camtool.arrays import Floats
from camtool.pictures import text
from camtool.pictures.colours import (
    BINS,
    FRAME,
    GRID,
    INK,
    PAPER,
    PLOT,
    QUIET,
    bin_colours,
    darkened,
)
from camtool.pictures.content import Content
from camtool.pictures.engaged import TOP_DEG
from camtool.pictures.layers import SWATCH, LegendEntry, legend_of
from camtool.pictures.options import MIN_PX, SVG_WIDTH_PX, PictureOptions
from camtool.pictures.svg import Look, PathData, element, number, one_line, title
from camtool.pictures.text import TextStyle
from camtool.pictures.view import (
    CROP_SHAPES,
    MARGIN,
    PAGE,
    TALLEST,
    WIDEST,
    PageBox,
    View,
    decimals_of,
    fit,
    multiples,
    round_length,
    round_step,
)

HEAD_GAP = 50.0
"""Room between the head and the plot, for the names above it."""

LEGEND_DROP = 70.0
"""Distance from the lower edge of the plot to the middle of the legend's first row."""

FOOT = 32.0
BAR_ROOM = 36.0
GUESSED_LEFT = 52.0
FITS = 3


class PageLayout(Struct, frozen=True, eq=False):
    """The layout of a page.

    `head` is the SVG of title and notes, `rows` the legend; the first row is centred on
    `legend_y`, the scale bar on `bar_y`; `width` and `height` are those of the page."""

    head: str
    view: View
    ticks: Ticks
    rows: list[list[LegendEntry]]
    legend_y: float
    bar_y: float
    height: float
    width: float = PAGE


def page_of(content: Content, width: float = PAGE) -> PageLayout:
    """Return the layout of the page for a picture of one scene."""
    head, head_end = title_and_notes(content.scene.title, content.notes, width)
    top = head_end + HEAD_GAP
    shapes = (WIDEST, TALLEST) if content.crop_mm is None else CROP_SHAPES

    def bar(view: View) -> float:
        scale = scale_of(content)
        return 0.0 if scale is None else colour_bar_width(scale, view.box.height)

    view, ticks = fitted(content.window, top, width, shapes, bar)
    table, bar_y = table_of(legend_of(content, view), view, view.box)
    legend_y = view.box.bottom + LEGEND_DROP
    return PageLayout(head, view, ticks, table, legend_y, bar_y, foot_of(table, legend_y), width)


def table_of(
    entries: Sequence[LegendEntry], view: View, plots: PageBox
) -> tuple[list[list[LegendEntry]], float]:
    """Return the rows of the legend below the plots, and the page height of the middle of the
    scale bar, which stands at the end of one of them."""
    bar = scale_bar_width(view) + BAR_ROOM
    table, row = rows_beside(entries, bar, plots.width)
    return table, plots.bottom + LEGEND_DROP + row * ROW_STEP


def fitted(
    window: Floats,
    top: float,
    width: float,
    shapes: tuple[float, float],
    margin_of: Callable[[View], float] = lambda view: 0.0,
) -> tuple[View, Ticks]:
    """Return the view of a window on a page of this width, and its ticks.

    `margin_of` gives the width that a view needs at its right. The fit is repeated `FITS` times,
    since the room for the numbers follows from the scale."""
    left, right = MARGIN + GUESSED_LEFT, width - MARGIN
    for _ in range(FITS):
        view = fit(window, left, top, right, shapes)
        ticks = ticks_of(view)
        left = MARGIN + ticks.left_width + TICK + LABEL_GAP
        right = width - MARGIN - margin_of(view)
    return view, ticks


def foot_of(rows: list[list[LegendEntry]], legend_y: float) -> float:
    """Return the height of a page whose legend has these rows, the first centred on `legend_y`."""
    return round(legend_y + max(len(rows) - 1, 0) * ROW_STEP + FOOT)


def mat(box: PageBox, width: float, height: float) -> str:
    """Return the SVG of the paper around the plot, which hides whatever reaches out of it.

    A clip would do the same, but takes the renderer as long as all lines together."""
    path = PathData()
    paper = PageBox(0.0, 0.0, width, height + math.ceil(width / MIN_PX))
    for each in (paper, box):
        path.move(each.left, each.top)
        path.line(each.right, each.top)
        path.line(each.right, each.bottom)
        path.line(each.left, each.bottom)
        path.close()
    look: Look = {"d": str(path), "fill": PAPER, "fill-rule": "evenodd"}
    return element("path", look)


def sheet(name: str, sizes: tuple[float, float], options: PictureOptions, *parts: str) -> str:
    """Return the SVG text of a picture: its parts on paper of `sizes` (width and height in units
    of the page), in the size and the palette that the options ask for."""
    width, height = sizes
    size_px = options.size_px or SVG_WIDTH_PX
    root: Look = {
        "xmlns": "http://www.w3.org/2000/svg",
        "width": str(size_px),
        "height": number(size_px * height / width),
        "viewBox": f"0 0 {number(width)} {number(height)}",
    }
    # The paper covers the last row of pixels also where the height is no whole number of them.
    below = math.ceil(width / size_px)
    paper = element("rect", {"width": width, "height": height + below, "fill": PAPER})
    picture = element("svg", root, title(name or "camtool picture"), paper, *parts)
    return (darkened(picture) if options.dark else picture) + "\n"


# Title and notes, legend, and the colour bar of errors.

TITLE = TextStyle(cap=22.0, colour=INK, weight=0.13)
NOTE = TextStyle(cap=14.5, colour=QUIET)
ENTRY = TextStyle(cap=14.5, colour=QUIET)
TITLE_STEP = 34.0
NOTE_STEP = 28.0
ROW_STEP = 33.0
SWATCH_GAP, ENTRY_GAP = 11.0, 28.0
MAX_ENTRY_WIDTH = 330.0
BAR_WIDTH, BAR_GAP = 18.0, 26.0
MIN_BAR_SPACING = 85.0
CLEAR_OF_TOP = 2.3
"""A round number nearer to the largest error than this many heights of a letter is left out."""


class MapScale(Struct, frozen=True):
    """The scale of a colour map: its upper end `top` (it begins at 0) and its name; `step` is the
    distance of its numbers, None for round numbers and the end."""

    top: float
    title: str = "error (µm)"
    step: float | None = None
    id: str = "error-scale"


ENGAGEMENT_SCALE = MapScale(TOP_DEG, "engaged (°)", 30.0, "engagement-scale")


def scale_of(content: Content) -> MapScale | None:
    """Return the scale of the colours of a picture; None if nothing is coloured by a map."""
    if content.trace is not None:
        return MapScale(content.trace.top_um)
    return None if content.engaged is None else ENGAGEMENT_SCALE


def _name(entry: LegendEntry) -> str:
    """Return the text of a legend entry, shortened to `MAX_ENTRY_WIDTH`."""
    return text.shortened(entry.name, ENTRY.cap, MAX_ENTRY_WIDTH)


def _width(entry: LegendEntry) -> float:
    """Return the width of a legend entry in its row, with the gap to the next."""
    return SWATCH + SWATCH_GAP + text.width(_name(entry), ENTRY.cap) + ENTRY_GAP


def title_and_notes(
    name: str, notes: Sequence[str], page: float = PAGE, *, lines: int = 1
) -> tuple[str, float]:
    """Return the SVG of the title, on at most `lines` lines, and of the notes, at the top of a
    page of this width; and the height at which they end."""
    room = page - 2.0 * MARGIN
    y = MARGIN
    parts = []
    for index, line in enumerate(_title_lines(name, room, lines)):
        y += TITLE.cap if index == 0 else TITLE_STEP
        full_text = name if index == 0 else line
        parts.append(text.label(line, (MARGIN, y), TITLE, full_text=full_text))
    if parts:
        y += 6.0
    for note in notes:
        for line in text.wrapped(note, NOTE.cap, room):
            y += NOTE_STEP
            parts.append(text.label(line, (MARGIN, y), NOTE))
    return element("g", {"id": "head"}, *parts), y + 6.0


def _title_lines(name: str, room: float, max_lines: int) -> list[str]:
    """Return the title broken at blanks into at most `max_lines` lines, the last one shortened."""
    words = one_line(name).split()
    lines: list[str] = []
    while words and len(lines) < max_lines - 1:
        count = 1
        while count < len(words) and text.width(" ".join(words[: count + 1]), TITLE.cap) <= room:
            count += 1
        lines.append(text.shortened(" ".join(words[:count]), TITLE.cap, room))
        words = words[count:]
    if words:
        lines.append(text.shortened(" ".join(words), TITLE.cap, room))
    return lines


def rows_of(entries: Sequence[LegendEntry], first: float, room: float) -> list[list[LegendEntry]]:
    """Return the entries in rows, the first no wider than `first`, the others no wider than
    `room`.

    The first row stays empty if no entry fits into it."""
    rows: list[list[LegendEntry]] = []
    if entries and _width(entries[0]) - ENTRY_GAP > first:
        rows.append([])
    used_width = math.inf
    for entry in entries:
        limit = first if len(rows) <= 1 else room
        if used_width + _width(entry) - ENTRY_GAP > limit:
            rows.append([])
            used_width = 0.0
        rows[-1].append(entry)
        used_width += _width(entry)
    return rows


def rows_beside(
    entries: Sequence[LegendEntry], bar: float, room: float
) -> tuple[list[list[LegendEntry]], int]:
    """Return the rows of the legend, and the index of the row at whose end a width of `bar` stays
    free.

    This is the first row if an entry fits beside the bar, else the last row with so much room,
    else a row of its own."""
    first = room - bar
    if not entries or _width(entries[0]) - ENTRY_GAP <= first:
        return rows_of(entries, first, room), 0
    rows = rows_of(entries, room, room)
    for row in reversed(range(len(rows))):
        if sum(_width(entry) for entry in rows[row]) - ENTRY_GAP <= first:
            return rows, row
    return [[], *rows], 0


def legend_rows(table: Sequence[Sequence[LegendEntry]], left_x: float, middle: float) -> str:
    """Return the SVG of the rows of the legend, the first centred on the height `middle`."""
    parts = []
    for index, row in enumerate(table):
        across, height = left_x, middle + index * ROW_STEP
        for entry in row:
            move = f"translate({number(across)} {number(height)})"
            place = (across + SWATCH + SWATCH_GAP, height + ENTRY.cap / 2.0)
            parts.append(element("g", {"transform": move}, entry.swatch))
            parts.append(text.label(_name(entry), place, ENTRY, full_text=entry.name))
            across += _width(entry)
    return element("g", {"id": "legend"}, *parts) if parts else ""


def legend_below(entries: Sequence[LegendEntry], top: float, width: float) -> tuple[str, float]:
    """Return the SVG of the legend below `top`, on a page of this width, and the height of that
    page."""
    if not entries:
        return "", round(top + MARGIN)
    room = width - 2.0 * MARGIN
    table = rows_of(entries, room, room)
    legend_y = top + 0.5 * ROW_STEP
    return legend_rows(table, MARGIN, legend_y), foot_of(table, legend_y)


def colour_bar_labels(scale: MapScale, height: float) -> list[tuple[float, str]]:
    """Return the values along the colour bar and their texts: round numbers, and the largest error
    at the top."""
    top_um = scale.top
    if scale.step is not None:
        return [(value, number(value)) for value in multiples(0.0, top_um, scale.step)]
    step = round_step(top_um * MIN_BAR_SPACING / height)
    room = top_um * CLEAR_OF_TOP * TICK_CAP / height
    labels = [
        (value, number(value, decimals_of(step)))
        for value in multiples(0.0, top_um, step)
        if value <= top_um - room
    ]
    return [*labels, (top_um, number(top_um, max(2, 2 - math.floor(math.log10(top_um)))))]


def colour_bar_width(scale: MapScale, height: float) -> float:
    """Return the width that the colour bar needs right of the plot."""
    widest = max(text.width(name, TICK_CAP) for _, name in colour_bar_labels(scale, height))
    header = text.width(scale.title, TICK_CAP)
    return BAR_GAP + max(BAR_WIDTH + 12.0 + widest, header)


def colour_bar(scale: MapScale, box: PageBox) -> str:
    """Return the SVG of the colour bar with its numbers, right of the plot and as high."""
    bar_x = box.right + BAR_GAP
    step = box.height / BINS
    parts = []
    for index, colour in reversed(list(enumerate(bin_colours()))):
        # Each step reaches down to the foot and is covered by the lower ones: no seams.
        y = round(box.bottom - (index + 1) * step, 2)
        piece: Look = {"x": bar_x, "y": number(y), "width": BAR_WIDTH}
        parts.append(
            element(
                "rect",
                {
                    **piece,
                    "height": box.bottom - y,
                    "fill": colour,
                    "shape-rendering": "crispEdges",
                },
            )
        )
    edge: Look = {"x": bar_x, "y": box.top, "width": BAR_WIDTH, "height": box.height}
    parts.append(element("rect", {**edge, "fill": "none", "stroke": FRAME, "stroke-width": 1.4}))
    ticks = PathData()
    for value, name in colour_bar_labels(scale, box.height):
        y = box.bottom - value / scale.top * box.height
        ticks.move(bar_x + BAR_WIDTH, y)
        ticks.line(bar_x + BAR_WIDTH + 5.0, y)
        place = (bar_x + BAR_WIDTH + 12.0, y + TICK_CAP / 2.0)
        parts.append(text.label(name, place, TextStyle(TICK_CAP, QUIET)))
    line: Look = {"d": str(ticks), "fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    parts.append(element("path", line))
    parts.append(text.label(scale.title, (bar_x, box.top - NAME_LIFT), TextStyle(TICK_CAP, QUIET)))
    return element("g", {"id": scale.id}, *parts)


# Grid, ticks with their numbers in mm, scale bar.

TICK_CAP = 14.5
NAME_LIFT = 19.0
"""Distance of the names of axes from the plot."""

TICK, MINOR_TICK = 8.0, 4.5
LABEL_GAP = 7.0
MIN_SPACING = 78.0
BAR_SHARE = 0.2
"""The scale bar is at most this share of the plot's width."""

BAR_MARK = 5.0
NUMBERS = TextStyle(TICK_CAP, QUIET)


class Ticks(Struct, frozen=True):
    """Round numbers along both axes, the same `step_mm` on each."""

    step_mm: float
    x: tuple[float, ...]
    y: tuple[float, ...]

    def text(self, value: float) -> str:
        """Return the number at a tick as text, with the decimals that the step needs."""
        return number(value, decimals_of(self.step_mm))

    @property
    def left_width(self) -> float:
        """Width, in units of the page, of the widest number along Y."""
        return max((text.width(self.text(y), TICK_CAP) for y in self.y), default=0.0)


def ticks_of(view: View) -> Ticks:
    """Return ticks at the smallest round step whose numbers do not touch."""
    spacing = MIN_SPACING
    while True:
        step = round_step(spacing / view.scale)
        ticks = Ticks(
            step, tuple(multiples(*view.x_range, step)), tuple(multiples(*view.y_range, step))
        )
        widest = max((text.width(ticks.text(x), TICK_CAP) for x in ticks.x), default=0.0)
        if widest + 2.0 * TICK_CAP <= step * view.scale:
            return ticks
        spacing = widest + 2.0 * TICK_CAP


def ground(view: View, ticks: Ticks) -> str:
    """Return the SVG of the ground and the grid of the plot, below everything else."""
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


PLANE_AXES = "X (mm)", "Y (mm)"
LATHE_AXES = "X, axis (mm)", "Y, radius (mm)"


def axes_around(view: View, ticks: Ticks, names: tuple[str, str] = PLANE_AXES) -> str:
    """Return the SVG of the frame, the ticks, their numbers, and the names of both axes, above the
    plot."""
    box, marks, labels = view.box, PathData(), []
    unit = text.width(names[0], TICK_CAP)
    base = box.bottom + TICK + LABEL_GAP + TICK_CAP
    for x in ticks.x:
        across = view.page(x, 0.0)[0]
        _tick(marks, (across, box.bottom), (0.0, TICK))
        room = text.width(ticks.text(x), TICK_CAP) / 2.0 + TICK_CAP
        if across + room <= box.right - unit:
            centred = TextStyle(TICK_CAP, QUIET, "middle")
            labels.append(text.label(ticks.text(x), (across, base), centred))
    for y in ticks.y:
        tick_y = view.page(0.0, y)[1]
        _tick(marks, (box.left, tick_y), (-TICK, 0.0))
        place = (box.left - TICK - LABEL_GAP, tick_y + TICK_CAP / 2.0)
        labels.append(text.label(ticks.text(y), place, TextStyle(TICK_CAP, QUIET, "end")))
    _minor(marks, view, ticks)
    labels.append(text.label(names[0], (box.right, base), TextStyle(TICK_CAP, QUIET, "end")))
    labels.append(text.label(names[1], (box.left, box.top - NAME_LIFT), NUMBERS))
    pen: Look = {"fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    edge: Look = {"x": box.left, "y": box.top, "width": box.width, "height": box.height}
    return element(
        "g",
        {"id": "axes"},
        element("rect", {**edge, **pen}),
        element("path", {"d": str(marks), **pen}) if marks else "",
        *labels,
    )


def _tick(marks: PathData, place: tuple[float, float], step: tuple[float, float]) -> None:
    marks.move(*place)
    marks.line(place[0] + step[0], place[1] + step[1])


def _minor(marks: PathData, view: View, ticks: Ticks) -> None:
    """Add short ticks to `marks`: they divide each step into five, a step of 2, 20 … into four."""
    is_two = f"{ticks.step_mm:.0e}".startswith("2")
    step = ticks.step_mm / (4.0 if is_two else 5.0)
    for x in multiples(*view.x_range, step):
        _tick(marks, (view.page(x, 0.0)[0], view.box.bottom), (0.0, MINOR_TICK))
    for y in multiples(*view.y_range, step):
        _tick(marks, (view.box.left, view.page(0.0, y)[1]), (-MINOR_TICK, 0.0))


def scale_bar_length(view: View) -> tuple[float, str]:
    """Return a round length for the scale bar, mm, and its text."""
    length = round_length(BAR_SHARE * view.box.width / view.scale)
    if length < 1.0:
        return length, f"{number(length * 1000.0, decimals_of(length * 1000.0))} µm"
    return length, f"{number(length, 0)} mm"


def scale_bar_width(view: View) -> float:
    """Return the width, in units of the page, that the scale bar and its label need."""
    length, name = scale_bar_length(view)
    return length * view.scale + 12.0 + text.width(name, TICK_CAP)


def scale_bar(view: View, right: float, middle: float) -> str:
    """Return the SVG of the scale bar with its label, ending at `right`, centred on the height
    `middle`."""
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
            name, (begin - 12.0, middle + TICK_CAP / 2.0), TextStyle(TICK_CAP, QUIET, anchor="end")
        ),
    )
