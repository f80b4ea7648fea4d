"""What stands beside the plot: title and notes, legend, and the colour bar of errors."""

from __future__ import annotations

import math
from collections.abc import Sequence

from camtool.pictures import text
from camtool.pictures.axes import NAME_LIFT, TICK_CAP
from camtool.pictures.colours import BINS, FRAME, INK, QUIET, bin_colours
from camtool.pictures.layers import SWATCH, Entry
from camtool.pictures.svg import Look, PathData, element, number, one_line
from camtool.pictures.text import Style
from camtool.pictures.view import MARGIN, PAGE, Box, decimals_of, multiples, round_step

TITLE = Style(cap=22.0, colour=INK, weight=0.13)
NOTE = Style(cap=14.5, colour=QUIET)
ENTRY = Style(cap=14.5, colour=QUIET)
TITLE_STEP = 34.0
NOTE_STEP = 28.0
ROW_STEP = 33.0
SWATCH_GAP, ENTRY_GAP = 11.0, 28.0
LONGEST_ENTRY = 330.0
BAR_WIDTH, BAR_GAP = 18.0, 26.0
LEAST_BAR_SPACING = 85.0
CLEAR_OF_TOP = 2.3
"""Round numbers stay this many letters' heights below the largest error."""

BAR_TITLE = "error (µm)"


def _name(entry: Entry) -> str:
    """The text of an entry, shortened where it must be."""
    return text.shortened(entry.name, ENTRY.cap, LONGEST_ENTRY)


def _width(entry: Entry) -> float:
    """Room of an entry on its row, with the gap to the next."""
    return SWATCH + SWATCH_GAP + text.width(_name(entry), ENTRY.cap) + ENTRY_GAP


def head(
    name: str, notes: Sequence[str], page: float = PAGE, *, lines: int = 1
) -> tuple[str, float]:
    """Title, on at most so many lines, and notes at the top of a page so wide, and the height at
    which they end."""
    room = page - 2.0 * MARGIN
    down = MARGIN
    parts = []
    for index, line in enumerate(_title_lines(name, room, lines)):
        down += TITLE.cap if index == 0 else TITLE_STEP
        full = name if index == 0 else line
        parts.append(text.label(line, (MARGIN, down), TITLE, full=full))
    if parts:
        down += 6.0
    for note in notes:
        for line in text.wrapped(note, NOTE.cap, room):
            down += NOTE_STEP
            parts.append(text.label(line, (MARGIN, down), NOTE))
    return element("g", {"id": "head"}, *parts), down + 6.0


def _title_lines(name: str, room: float, most: int) -> list[str]:
    """The title broken at blanks, and what follows the last line on it as far as it goes."""
    words = one_line(name).split()
    lines: list[str] = []
    while words and len(lines) < most - 1:
        count = 1
        while count < len(words) and text.width(" ".join(words[: count + 1]), TITLE.cap) <= room:
            count += 1
        lines.append(text.shortened(" ".join(words[:count]), TITLE.cap, room))
        words = words[count:]
    if words:
        lines.append(text.shortened(" ".join(words), TITLE.cap, room))
    return lines


def rows(entries: Sequence[Entry], first: float, room: float) -> list[list[Entry]]:
    """The entries in rows: the first no wider than `first`, the others than `room`; the first
    one stays empty when there is no room in it."""
    found: list[list[Entry]] = []
    if entries and _width(entries[0]) - ENTRY_GAP > first:
        found.append([])
    used = math.inf
    for entry in entries:
        limit = first if len(found) <= 1 else room
        if used + _width(entry) - ENTRY_GAP > limit:
            found.append([])
            used = 0.0
        found[-1].append(entry)
        used += _width(entry)
    return found


def table_of(entries: Sequence[Entry], bar: float, room: float) -> tuple[list[list[Entry]], int]:
    """The rows, and which of them ends with something `bar` wide: the first where an entry fits
    beside it, else the last with room for it, else one of its own."""
    first = room - bar
    if not entries or _width(entries[0]) - ENTRY_GAP <= first:
        return rows(entries, first, room), 0
    found = rows(entries, room, room)
    for row in reversed(range(len(found))):
        if sum(_width(entry) for entry in found[row]) - ENTRY_GAP <= first:
            return found, row
    return [[], *found], 0


def legend(table: Sequence[Sequence[Entry]], left: float, middle: float) -> str:
    """The rows of the legend, the first centred on height `middle`."""
    parts = []
    for index, row in enumerate(table):
        across, height = left, middle + index * ROW_STEP
        for entry in row:
            move = f"translate({number(across)} {number(height)})"
            at = (across + SWATCH + SWATCH_GAP, height + ENTRY.cap / 2.0)
            parts.append(element("g", {"transform": move}, entry.swatch))
            parts.append(text.label(_name(entry), at, ENTRY, full=entry.name))
            across += _width(entry)
    return element("g", {"id": "legend"}, *parts) if parts else ""


def bar_labels(top_um: float, height: float) -> list[tuple[float, str]]:
    """(value µm, text) along the colour bar: round numbers, and the largest error at the top."""
    step = round_step(top_um * LEAST_BAR_SPACING / height)
    room = top_um * CLEAR_OF_TOP * TICK_CAP / height
    labels = [
        (value, number(value, decimals_of(step)))
        for value in multiples(0.0, top_um, step)
        if value <= top_um - room
    ]
    return [*labels, (top_um, number(top_um, max(2, 2 - math.floor(math.log10(top_um)))))]


def bar_width(top_um: float, height: float) -> float:
    """Room right of the plot that the colour bar needs."""
    widest = max(text.width(name, TICK_CAP) for _, name in bar_labels(top_um, height))
    header = text.width(BAR_TITLE, TICK_CAP)
    return BAR_GAP + max(BAR_WIDTH + 12.0 + widest, header)


def colour_bar(top_um: float, box: Box) -> str:
    """The map with its numbers, as high as the plot, right of it."""
    left = box.right + BAR_GAP
    step = box.height / BINS
    parts = []
    for index, colour in reversed(list(enumerate(bin_colours()))):
        # Each step reaches down to the foot, and the lower ones cover it: no seams.
        down = round(box.bottom - (index + 1) * step, 2)
        piece: Look = {"x": left, "y": number(down), "width": BAR_WIDTH}
        parts.append(
            element(
                "rect",
                {
                    **piece,
                    "height": box.bottom - down,
                    "fill": colour,
                    "shape-rendering": "crispEdges",
                },
            )
        )
    edge: Look = {"x": left, "y": box.top, "width": BAR_WIDTH, "height": box.height}
    parts.append(element("rect", {**edge, "fill": "none", "stroke": FRAME, "stroke-width": 1.4}))
    ticks = PathData()
    for value, name in bar_labels(top_um, box.height):
        down = box.bottom - value / top_um * box.height
        ticks.move(left + BAR_WIDTH, down)
        ticks.line(left + BAR_WIDTH + 5.0, down)
        at = (left + BAR_WIDTH + 12.0, down + TICK_CAP / 2.0)
        parts.append(text.label(name, at, Style(TICK_CAP, QUIET)))
    line: Look = {"d": str(ticks), "fill": "none", "stroke": FRAME, "stroke-width": 1.4}
    parts.append(element("path", line))
    parts.append(text.label(BAR_TITLE, (left, box.top - NAME_LIFT), Style(TICK_CAP, QUIET)))
    return element("g", {"id": "error-scale"}, *parts)
