"""MTEXT read: the codes within its text make words, glue and paragraphs; then it is laid out.

The codes are read by ezdxf (`MTextParser`), the layout is ours. The block lies between the top of
the first line's capitals and the baseline of the last line. Frames and backgrounds are not drawn.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from camtool.importers.dxf.frames import Unusable
from camtool.importers.text.fonts import Wanted, font_for
from camtool.importers.text.layout import NUMBERED, Ink, Look, Rule, finite, numbered, slant
from camtool.importers.text.lines import (
    Cell,
    Columns,
    Glue,
    Paragraph,
    Pitch,
    draw,
    stacked,
    wrapped,
)

TAB_HEIGHTS = 4.0
"""Distance of tab stops where a text sets none, in heights of a capital."""

_STACK_CARET = re.compile(r"(\\S[^;\\^]*)\^(?! )")
_BARE_CARET = re.compile(r"\^(?![ @-_])")
_ESCAPED = re.compile(r"[\\{}]")
_EXACT_SPACING = 2
_SHARES = (0.0, 0.5, 1.0)
_TAB_SHARES = {"r": 1.0, "c": 0.5}
_CODE_ERRORS = (ValueError, TypeError, LookupError, ArithmeticError)
# What MTextParser raises for codes that are cut off or hold numbers out of range.


def write_mtext(
    entity: Any, content: str, look: Look, font: tuple[Wanted, str]
) -> tuple[Ink, list[tuple[str, str]]]:
    """The ink of an MTEXT seen from its insertion point, and its fonts (used, wanted or "").

    `look` is that of its text style, `font` the font wanted by that and the mode. Raises Unusable.
    """
    reader = _Reader(look, font)
    row, column = divmod(int(entity.dxf.attachment_point) - 1, 3)
    if not 0 <= row < len(_SHARES):
        raise Unusable(f"has an attachment point of {entity.dxf.attachment_point}")
    try:
        paragraphs = list(reader.paragraphs(content, _SHARES[column]))
    except _CODE_ERRORS as error:
        raise Unusable("has codes in its text that cannot be read") from error
    columns = _columns(entity)
    lines = [line for paragraph in paragraphs for line in wrapped(paragraph, columns.width)]
    if not any(line.cells for line in lines):
        raise Unusable("is empty")
    finite(*(size for line in lines for size in (line.right, line.height)))
    width = columns.width or max(line.right for line in lines)
    exact = int(entity.dxf.get("line_spacing_style", 1)) == _EXACT_SPACING
    pitch = Pitch(float(entity.dxf.line_spacing_factor), look.height if exact else 0.0)
    placed = stacked(lines, columns, pitch)
    total = width + (width + columns.gutter) * placed[-1].column
    depth = min(place.baseline for place in placed)
    anchor = _SHARES[column] * total, _SHARES[row] * depth
    ink = Ink()
    for place in placed:
        left = place.column * (width + columns.gutter) - anchor[0]
        draw(ink, place.line, width, (left, place.baseline - anchor[1]))
    return ink, reader.fonts


def _plain(content: str) -> str:
    """Codes that MTextParser takes for others: carets that are no control code, and %%nnn."""
    content = _STACK_CARET.sub(r"\1^ ", content)
    content = _BARE_CARET.sub("^ ", content)
    return NUMBERED.sub(lambda match: _ESCAPED.sub(r"\\\g<0>", numbered(match[1])), content)


def _columns(entity: Any) -> Columns:
    """Width, gutter and heights; one column as high as need be where the entity sets none."""
    width = max(0.0, float(entity.dxf.get("width", 0.0)))
    if not entity.has_columns:
        return Columns(width)
    said = entity.columns
    heights = [float(height) for height in said.heights]
    if not heights and said.defined_height:
        heights = [abs(float(said.defined_height))] * max(1, int(said.count))
    width, gutter, *heights = finite(said.width, said.gutter_width, *heights)
    return Columns(max(0.0, width), max(0.0, gutter), tuple(heights[:-1]))


class _Reader:
    """Tokens to paragraphs; `fonts` collects what was used."""

    def __init__(self, look: Look, font: tuple[Wanted, str]) -> None:
        self._look = look
        self._wanted, self._mode = font
        self._known: dict[Any, tuple[Look, str]] = {}
        self.fonts: list[tuple[str, str]] = []

    def paragraphs(self, content: str, share: float) -> Iterator[Paragraph]:
        """All paragraphs, aligned at `share` of their width unless they say otherwise."""
        from ezdxf.tools.text import MTextContext, MTextParser, TokenType

        start = MTextContext()
        start.cap_height = self._look.height
        start.width_factor = self._look.width_factor
        start.oblique = math.degrees(math.atan(self._look.slant))
        self._first_face = start.font_face
        cells: list[Cell] = []
        ended, context = False, start
        breaks = (TokenType.NEW_PARAGRAPH, TokenType.NEW_COLUMN, TokenType.WRAP_AT_DIMLINE)
        for token in MTextParser(_plain(content), start):
            context, ended = token.ctx, token.type in breaks
            if ended:
                last = token.type == TokenType.NEW_COLUMN
                yield self._paragraph(cells, context, share, last)
                cells = []
                continue
            look = self._dressed(context)
            if token.type == TokenType.STACK:
                upper, lower, bar = token.data
                cells.append(Cell(look, upper, lower, bar, lift=int(context.align)))
            elif token.type == TokenType.WORD:
                cells.append(Cell(look, token.data, lift=int(context.align)))
            elif token.type == TokenType.TABULATOR:
                cells.append(Cell(look, " ", glue=Glue.TAB))
            elif token.type == TokenType.NBSP:
                cells.append(Cell(look, " ", glue=Glue.HARD))
            else:
                cells.append(Cell(look, " ", glue=Glue.SPACE))
        if cells:
            yield self._paragraph(cells, context, share, False)

    def _paragraph(
        self, cells: list[Cell], context: Any, share: float, ends_column: bool
    ) -> Paragraph:
        said = context.paragraph
        align = said.align.name
        share = {"LEFT": 0.0, "RIGHT": 1.0, "CENTER": 0.5}.get(align, share)
        justified = align in ("JUSTIFIED", "DISTRIBUTED")
        unit = self._look.height
        stops = [
            (float(stop[1:]) * unit, _TAB_SHARES[stop[0]])
            if isinstance(stop, str)
            else (float(stop) * unit, 0.0)
            for stop in said.tab_stops
        ]
        return Paragraph(
            cells=tuple(cells),
            share=0.0 if justified else share,
            justified=justified,
            indents=((said.left + said.indent) * unit, said.left * unit, said.right * unit),
            stops=tuple(sorted(stops)),
            tab=TAB_HEIGHTS * unit,
            blank=float(context.cap_height),
            ends_column=ends_column,
        )

    def _dressed(self, context: Any) -> Look:
        """The look that the codes make."""
        key = context.font_face
        if key not in self._known:
            wanted = self._wanted
            if key is not self._first_face:
                wanted = Wanted("", key.family, key.is_bold, key.is_italic)
            font, other = font_for(wanted, self._mode)
            self._known[key] = replace(self._look, font=font), other
            self.fonts.append((font.name, other))
        look, _ = self._known[key]
        sizes = context.cap_height, context.width_factor, context.char_tracking_factor
        height, factor, tracking = finite(*sizes)
        if not min(sizes) > 0.0:
            raise Unusable("has letters of no size")
        rules = Rule.UNDER * context.underline | Rule.THROUGH * context.strike_through
        return replace(
            look,
            height=height,
            width_factor=factor,
            slant=slant(*finite(context.oblique)),
            tracking=tracking,
            rules=Rule(rules | Rule.OVER * context.overline),
        )
