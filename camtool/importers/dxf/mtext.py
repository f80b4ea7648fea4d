"""MTEXT read: the codes within its text make words, glue and paragraphs; then it is laid out.

The codes are read by ezdxf (`MTextParser`), the layout is ours. The block lies between the top of
the first line's capitals and the baseline of the last line. Frames and backgrounds are not drawn.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from enum import Enum
from itertools import groupby, pairwise
from typing import Any

from msgspec import Struct

from camtool.importers.pieces import Unusable
from camtool.importers.text import (
    NUMBERED,
    Ink,
    Rule,
    TextLook,
    WantedFont,
    character_of_number,
    finite,
    font_for,
    slant,
)
from camtool.records import replace

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
    entity: Any, content: str, look: TextLook, font: tuple[WantedFont, str]
) -> tuple[Ink, list[tuple[str, str]]]:
    """Draw the text of an MTEXT; return its lines relative to the insertion point, and its fonts.

    Fonts are pairs: the one used, and the one asked for if it was replaced, else "". `look` comes
    from the text style; `font` is the font that the style asks for, and the mode of text. Raises
    Unusable if the text is empty, or has codes that cannot be read."""
    reader = _Reader(look, font)
    row, column = divmod(int(entity.dxf.attachment_point) - 1, 3)
    if not 0 <= row < len(_SHARES):
        raise Unusable(f"has an attachment point of {entity.dxf.attachment_point}")
    try:
        paragraphs = list(reader.paragraphs(content, _SHARES[column]))
    except _CODE_ERRORS as error:
        raise Unusable("has codes in its text that cannot be read") from error
    columns = _columns(entity)
    lines = [line for paragraph in paragraphs for line in wrap_paragraph(paragraph, columns.width)]
    if not any(line.cells for line in lines):
        raise Unusable("is empty")
    finite(*(size for line in lines for size in (line.right, line.height)))
    width = columns.width or max(line.right for line in lines)
    exact = int(entity.dxf.get("line_spacing_style", 1)) == _EXACT_SPACING
    pitch = Pitch(float(entity.dxf.line_spacing_factor), look.height if exact else 0.0)
    positions = stack_lines(lines, columns, pitch)
    total = width + (width + columns.gutter) * positions[-1].column
    depth = min(place.baseline for place in positions)
    anchor = _SHARES[column] * total, _SHARES[row] * depth
    ink = Ink()
    for place in positions:
        left_edge = place.column * (width + columns.gutter) - anchor[0]
        draw(ink, place.line, width, (left_edge, place.baseline - anchor[1]))
    return ink, reader.fonts


def _without_codes(content: str) -> str:
    """Return the text with codes replaced that MTextParser would misread: carets without a control
    code, and %%nnn."""
    content = _STACK_CARET.sub(r"\1^ ", content)
    content = _BARE_CARET.sub("^ ", content)
    return NUMBERED.sub(
        lambda match: _ESCAPED.sub(r"\\\g<0>", character_of_number(match[1])), content
    )


def plain_text(content: str) -> str:
    """Return the text without its codes; stacked parts stand beside one another, "+0.1/-0.2",
    and those of a fraction with its own sign, "1⁄2". Unusable for codes that cannot be read."""
    from ezdxf.tools.text import MTextParser, TokenType

    text = ""
    try:
        for token in MTextParser(_without_codes(content)):
            if token.type == TokenType.STACK:
                upper, lower, bar = token.data
                fraction = bar != "^" and upper.strip().isdigit() and lower.strip().isdigit()
                text += f" {upper.strip()}{'⁄' if fraction else '/'}{lower.strip()} "
            else:
                text += token.data if token.type == TokenType.WORD else " "
    except _CODE_ERRORS as error:
        raise Unusable("has codes in its text that cannot be read") from error
    return text


def _columns(entity: Any) -> Columns:
    """Return the width, gutter and heights of the columns; one column of any height if the entity
    sets none."""
    width = max(0.0, float(entity.dxf.get("width", 0.0)))
    if not entity.has_columns:
        return Columns(width)
    settings = entity.columns
    heights = [float(height) for height in settings.heights]
    if not heights and settings.defined_height:
        heights = [abs(float(settings.defined_height))] * max(1, int(settings.count))
    width, gutter, *heights = finite(settings.width, settings.gutter_width, *heights)
    return Columns(max(0.0, width), max(0.0, gutter), tuple(heights[:-1]))


class _Reader:
    """The reader that makes paragraphs of the tokens of an MTEXT; `fonts` lists those that were
    used."""

    def __init__(self, look: TextLook, font: tuple[WantedFont, str]) -> None:
        self._look = look
        self._wanted, self._mode = font
        self._known: dict[Any, tuple[TextLook, str]] = {}
        self.fonts: list[tuple[str, str]] = []

    def paragraphs(self, content: str, share: float) -> Iterator[Paragraph]:
        """Yield all paragraphs, aligned at `share` of their width unless they say otherwise."""
        from ezdxf.tools.text import MTextContext, MTextParser, TokenType

        start = MTextContext()
        start.cap_height = self._look.height
        start.width_factor = self._look.width_factor
        start.oblique = math.degrees(math.atan(self._look.slant))
        self._first_face = start.font_face
        cells: list[MTextCell] = []
        is_ended, context = False, start
        breaks = (TokenType.NEW_PARAGRAPH, TokenType.NEW_COLUMN, TokenType.WRAP_AT_DIMLINE)
        for token in MTextParser(_without_codes(content), start):
            context, is_ended = token.ctx, token.type in breaks
            if is_ended:
                last = token.type == TokenType.NEW_COLUMN
                yield self._paragraph(cells, context, share, last)
                cells = []
                continue
            look = self._dressed(context)
            if token.type == TokenType.STACK:
                upper, lower, bar = token.data
                cells.append(MTextCell(look, upper, lower, bar, lift=int(context.align)))
            elif token.type == TokenType.WORD:
                cells.append(MTextCell(look, token.data, lift=int(context.align)))
            elif token.type == TokenType.TABULATOR:
                cells.append(MTextCell(look, " ", glue=Glue.TAB))
            elif token.type == TokenType.NBSP:
                cells.append(MTextCell(look, " ", glue=Glue.HARD))
            else:
                cells.append(MTextCell(look, " ", glue=Glue.SPACE))
        if cells:
            yield self._paragraph(cells, context, share, False)

    def _paragraph(
        self, cells: list[MTextCell], context: Any, share: float, ends_column: bool
    ) -> Paragraph:
        style = context.paragraph
        align = style.align.name
        share = {"LEFT": 0.0, "RIGHT": 1.0, "CENTER": 0.5}.get(align, share)
        justified = align in ("JUSTIFIED", "DISTRIBUTED")
        unit = self._look.height
        stops = [
            (float(stop[1:]) * unit, _TAB_SHARES[stop[0]])
            if isinstance(stop, str)
            else (float(stop) * unit, 0.0)
            for stop in style.tab_stops
        ]
        return Paragraph(
            cells=tuple(cells),
            share=0.0 if justified else share,
            justified=justified,
            indents=((style.left + style.indent) * unit, style.left * unit, style.right * unit),
            stops=tuple(sorted(stops)),
            tab=TAB_HEIGHTS * unit,
            blank=float(context.cap_height),
            ends_column=ends_column,
        )

    def _dressed(self, context: Any) -> TextLook:
        """Return the look of letters at this place, as the codes before it set it."""
        key = context.font_face
        if key not in self._known:
            request = self._wanted
            if key is not self._first_face:
                request = WantedFont("", key.family, key.is_bold, key.is_italic)
            font, other = font_for(request, self._mode)
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


# Words and glue broken into lines, lines stacked into columns.
#
# Lines are 5/3 of their letters' height apart, times the factor that a text sets; a line with
# larger letters takes more room, unless the text asks for exact spacing.

LINE_PITCH = 5.0 / 3.0
"""Distance of baselines in heights of a capital ("3-on-5", DXF reference, MTEXT group 44)."""

STACK_HEIGHT = 2.4
"""Height of a stacked fraction in heights of its letters."""

WRAP_SLACK = 1e-6
"""A line may be longer than its column by this share, so that rounding breaks none."""


class Glue(Enum):
    """The kind of space between two words."""

    NONE = ""
    SPACE = "space"
    HARD = "no break"
    TAB = "tab"


class MTextCell(Struct, frozen=True, eq=False):
    """A word, a stack of two texts, or the space between two words (glue), in one look.

    A stack has a `bar`: "^" no bar, "/" a bar, "#" a slanted one. `lift` is 0 on the baseline of
    the line, 1 in its middle, 2 at its top."""

    look: TextLook
    text: str
    lower: str = ""
    bar: str = ""
    glue: Glue = Glue.NONE
    lift: int = 0

    @property
    def width(self) -> float:
        """Width, from the left to the right end."""
        widths = self.look.width(self.text), self.look.width(self.lower)
        return sum(widths) if self.bar == "#" else max(widths)

    @property
    def height(self) -> float:
        """Height above the baseline."""
        share = {"": 1.0, "#": 2.0}.get(self.bar, STACK_HEIGHT)
        return 0.0 if self.glue is not Glue.NONE else share * self.look.height


class Paragraph(Struct, frozen=True, eq=False):
    """A paragraph of an MTEXT.

    `share`: 0 left, 0.5 centred, 1 right; `indents` of the first line, the others, and the right
    edge; `stops` of tabs as (x, share); `blank` is the height of an empty line."""

    cells: tuple[MTextCell, ...]
    share: float
    justified: bool
    indents: tuple[float, float, float]
    stops: tuple[tuple[float, float], ...]
    tab: float
    blank: float
    ends_column: bool


class MTextLine(Struct, frozen=True, eq=False):
    """A line of text: its cells, each with the x of its left end.

    The last cell ends at `right`, `margin` stays free after it; `stretch` marks a line that is
    widened to its column."""

    cells: tuple[tuple[float, MTextCell], ...]
    height: float
    right: float
    margin: float
    share: float
    stretch: bool = False
    ends_column: bool = False


class Columns(Struct, frozen=True, eq=False):
    """The columns of a text: their `width` (0: lines do not wrap), the `gutter` between them, and
    the `heights` of all but the last, which takes the rest."""

    width: float
    gutter: float = 0.0
    heights: tuple[float, ...] = ()


class Pitch(Struct, frozen=True, eq=False):
    """The spacing of lines: a `factor`, and the height `exact` that every line counts for, or 0 if
    each has its own."""

    factor: float
    exact: float = 0.0

    def drop(self, above: float, below: float) -> float:
        """Return the distance of the baselines of two successive lines with these heights."""
        if self.exact:
            return LINE_PITCH * self.factor * self.exact
        return LINE_PITCH * self.factor * above - above + below


class Placed(Struct, frozen=True, eq=False):
    """A line in its column, and the y of its baseline; the top of the first line lies at y = 0."""

    column: int
    baseline: float
    line: MTextLine


def wrap_paragraph(paragraph: Paragraph, width: float) -> Iterator[MTextLine]:
    """Yield the lines of a paragraph, broken to be no wider than `width` where its words allow
    that; 0: one line."""
    first_indent, following, margin = paragraph.indents
    limit = (width - margin) + WRAP_SLACK * width
    x = first_indent
    cells: list[tuple[float, MTextCell]] = []
    groups = [*_unbreakable(paragraph.cells), ()]
    for group, next_group in pairwise(groups):
        size = sum(cell.width for cell in group)
        glue = group[0].glue
        if glue is Glue.TAB:
            x = _tab_position(x, sum(cell.width for cell in next_group), paragraph)
        elif glue is Glue.SPACE:
            cells.append((x, group[0]))
            x += size
        else:
            if (
                width > 0.0
                and x + size > limit
                and any(cell.glue is Glue.NONE for _, cell in cells)
            ):
                yield _line(paragraph, cells, first_indent, stretch=paragraph.justified)
                first_indent, x, cells = following, following, []
            for cell in group:
                cells.append((x, cell))
                x += cell.width
    last = _line(paragraph, cells, first_indent, stretch=False)
    yield replace(last, ends_column=paragraph.ends_column)


def _unbreakable(cells: Sequence[MTextCell]) -> Iterator[tuple[MTextCell, ...]]:
    """Yield groups of cells between which a line may break: words joined by hard spaces, or a
    single space or tab."""
    run: list[MTextCell] = []
    for cell in cells:
        if cell.glue in (Glue.SPACE, Glue.TAB):
            if run:
                yield tuple(run)
            yield (cell,)
            run = []
        else:
            run.append(cell)
    if run:
        yield tuple(run)


def _tab_position(x: float, text_width: float, paragraph: Paragraph) -> float:
    """Return the x at which the text behind a tab begins; `text_width` is the width of that text,
    up to the next tab."""
    for stop, share in paragraph.stops:
        if stop > x and stop - share * text_width >= x:
            return stop - share * text_width
    return (x // paragraph.tab + 1.0) * paragraph.tab


def _line(
    paragraph: Paragraph, row: list[tuple[float, MTextCell]], left_edge: float, *, stretch: bool
) -> MTextLine:
    """Return a line of these cells, without the spaces at its end."""
    count = len(row)
    while count and row[count - 1][1].glue is Glue.SPACE:
        count -= 1
    cells = tuple(row[:count])
    height = max((cell.height for _, cell in cells), default=0.0) or paragraph.blank
    right = cells[-1][0] + cells[-1][1].width if cells else left_edge
    return MTextLine(cells, height, right, paragraph.indents[2], paragraph.share, stretch)


def stack_lines(lines: Sequence[MTextLine], columns: Columns, pitch: Pitch) -> list[Placed]:
    """Return the lines placed below each other; where a column is full or ends, the next line
    begins the next column."""
    results: list[Placed] = []
    column, start = 0, True
    for line in lines:
        baseline = -line.height
        if not start:
            above = results[-1]
            baseline = above.baseline - pitch.drop(above.line.height, line.height)
            room = columns.heights[column] if column < len(columns.heights) else None
            if room is not None and -baseline > room * (1.0 + WRAP_SLACK):
                column, baseline = column + 1, -line.height
        results.append(Placed(column, baseline, line))
        start = line.ends_column
        column += line.ends_column
    return results


def draw(ink: Ink, line: MTextLine, width: float, place: tuple[float, float]) -> None:
    """Draw a line of text into its column of this width; `place` is the column's left edge on the
    baseline."""
    spare = width - line.margin - line.right
    gaps = sum(cell.glue is Glue.SPACE for _, cell in line.cells)
    widened = spare / gaps if line.stretch and gaps and spare > 0.0 else 0.0
    shift = place[0] + line.share * spare
    ruled: list[tuple[float, float, MTextCell]] = []
    for x, cell in line.cells:
        start = shift + x
        if cell.glue is Glue.NONE:
            lift = 0.5 * cell.lift * (line.height - cell.height)
            _draw_cell(ink, cell, (start, place[1] + lift))
        shift += widened * (cell.glue is Glue.SPACE)
        ruled.append((start, shift + x + cell.width, cell))
    _rule(ink, ruled, place[1])


def _rule(ink: Ink, cells: Sequence[tuple[float, float, MTextCell]], baseline: float) -> None:
    """Draw underlines, strike-throughs and overlines, in one piece along neighbouring cells of the
    same look."""

    def manner(item: tuple[float, float, MTextCell]) -> tuple[int, float]:
        return int(item[2].look.rules), item[2].look.height

    for (rules, _), group in groupby(cells, manner):
        run = list(group)
        if rules:
            ink.rule(run[0][2].look, (run[0][0], run[-1][1]), baseline)


def _draw_cell(ink: Ink, cell: MTextCell, place: tuple[float, float]) -> None:
    """Draw a word, or a stack: two texts one above the other, or side by side, with the bar
    between them."""
    x, y = place
    look = cell.look
    if not cell.bar:
        ink.write(cell.text, look, place)
        return
    upper, lower = look.width(cell.text), look.width(cell.lower)
    rise = cell.height - look.height
    if cell.bar == "#":
        ink.write(cell.text, look, (x, y + rise))
        ink.write(cell.lower, look, (x + upper, y))
        ink.line(look, (x, y), (x + cell.width, y + cell.height))
        return
    ink.write(cell.text, look, (x + 0.5 * (cell.width - upper), y + rise))
    ink.write(cell.lower, look, (x + 0.5 * (cell.width - lower), y))
    if cell.bar == "/":
        middle = y + 0.5 * cell.height
        ink.line(look, (x, middle), (x + cell.width, middle))
