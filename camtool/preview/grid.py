"""Panels in rows and columns of a page: where each lies, and the names of its inner parts."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

from camtool.preview import legend
from camtool.preview.options import SVG_WIDTH_PX, Options
from camtool.preview.svg import element, number
from camtool.preview.view import MARGIN, Box, page_width

GROWN = 1.25
"""A page of panels side by side has so many times the units of another: letters become smaller,
since each panel is."""

TITLE_LINES = 2
"""Panels are narrow: a long title goes on below."""

_NAME = re.compile(r'( id="|url\(#)')

Head = tuple[str, Sequence[str]]
"""Title and notes of a panel."""


@dataclass(frozen=True)
class Grid:
    """Panels of `width`, margins included, in `columns` on a page so wide; `heads` are drawn,
    `downs` where those of each panel's row end; `rows` where each row begins."""

    columns: int
    page: float
    width: float
    heads: tuple[str, ...]
    downs: tuple[float, ...]
    rows: tuple[float, ...] = ()

    def with_bodies(self, height: float) -> Grid:
        """The rows of panels that go on so far below their heads."""
        rows = [0.0]
        for down in self.downs[:: self.columns]:
            rows.append(rows[-1] + down + height)
        return replace(self, rows=tuple(rows))

    def corner(self, index: int) -> tuple[float, float]:
        """Where a panel lies on the page; the margins of neighbours are one."""
        across = (index % self.columns) * (self.width - MARGIN)
        return across, self.rows[index // self.columns]

    def moved(self, index: int, box: Box) -> Box:
        """A box of a panel on the page."""
        x, y = self.corner(index)
        return Box(box.left + x, box.top + y, box.right + x, box.bottom + y)

    def around(self, boxes: Sequence[Box]) -> Box:
        """What holds the boxes of all panels, on the page."""
        moved = [self.moved(index, box) for index, box in enumerate(boxes)]
        return Box(
            min(box.left for box in moved),
            min(box.top for box in moved),
            max(box.right for box in moved),
            max(box.bottom for box in moved),
        )

    def placed(self, panels: Sequence[Sequence[str]]) -> list[str]:
        """The panels in their places; the names of their inner parts begin with their own."""
        groups = []
        for index, parts in enumerate(panels):
            name = f"panel-{index + 1}"
            x, y = self.corner(index)
            where = f"translate({number(x)} {number(y)})"
            inner = [_NAME.sub(rf"\g<1>{name}-", part) for part in parts]
            groups.append(element("g", {"id": name, "transform": where}, *inner))
        return groups


def columns_of(count: int, *, wide: bool) -> int:
    """How many panels stand side by side."""
    return 1 if wide else math.ceil(math.sqrt(count))


def page_units(columns: int, options: Options) -> float:
    """Units of a page with so many columns."""
    page = page_width(options.size_px or SVG_WIDTH_PX)
    return page if columns == 1 else round(GROWN * page)


def panel_width(columns: int, room: float) -> float:
    """Width of a panel, margins included, of so many in this room."""
    return float(math.floor((room + (columns - 1) * MARGIN) / columns))


def grid_of(heads: Sequence[Head], columns: int, page: float, bar: float = 0.0) -> Grid:
    """The grid for panels of these titles and notes, `bar` of the page's width left free."""
    width = panel_width(columns, page - bar)
    drawn = [legend.head(title, notes, width, lines=TITLE_LINES) for title, notes in heads]
    downs = [down for _, down in drawn]
    lowest = [max(downs[k - k % columns :][:columns]) for k in range(len(downs))]
    return Grid(columns, page, width, tuple(head for head, _ in drawn), tuple(lowest))
