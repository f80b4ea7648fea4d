"""Words and glue broken into lines, lines stacked into columns.

Lines are 5/3 of their letters' height apart, times the factor that a text sets; a line with larger
letters takes more room, unless the text asks for exact spacing.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import groupby, pairwise

from camtool.importers.text.layout import Ink, Look

LINE_PITCH = 5.0 / 3.0
"""Distance of baselines in heights of a capital ("3-on-5", DXF reference, MTEXT group 44)."""

STACK_HEIGHT = 2.4
"""Height of a stacked fraction in heights of its letters."""

WRAP_SLACK = 1e-6
"""A line may be longer than its column by this share, so that rounding breaks none."""


class Glue(Enum):
    """What stands between words."""

    NONE = ""
    SPACE = "space"
    HARD = "no break"
    TAB = "tab"


@dataclass(frozen=True, eq=False)
class Cell:
    """A word; a stack of two (`bar` "^" no bar, "/" a bar, "#" a slanted one); or glue.

    `lift` is 0 on the baseline of the line, 1 in its middle, 2 at its top.
    """

    look: Look
    text: str
    lower: str = ""
    bar: str = ""
    glue: Glue = Glue.NONE
    lift: int = 0

    @property
    def width(self) -> float:
        """From its left end to its right end."""
        widths = self.look.width(self.text), self.look.width(self.lower)
        return sum(widths) if self.bar == "#" else max(widths)

    @property
    def height(self) -> float:
        """Above its own baseline."""
        share = {"": 1.0, "#": 2.0}.get(self.bar, STACK_HEIGHT)
        return 0.0 if self.glue is not Glue.NONE else share * self.look.height


@dataclass(frozen=True, eq=False)
class Paragraph:
    """`share` 0 left, 0.5 centred, 1 right; indents of the first line, the others, the right edge;
    `stops` of tabs (x, share); `blank` is the height of an empty line."""

    cells: tuple[Cell, ...]
    share: float
    justified: bool
    indents: tuple[float, float, float]
    stops: tuple[tuple[float, float], ...]
    tab: float
    blank: float
    ends_column: bool


@dataclass(frozen=True, eq=False)
class Line:
    """Cells with the x of their left ends; the last one ends at `right`, `margin` stays free after
    it; `stretch` marks a line that is widened to its column."""

    cells: tuple[tuple[float, Cell], ...]
    height: float
    right: float
    margin: float
    share: float
    stretch: bool = False
    ends_column: bool = False


@dataclass(frozen=True, eq=False)
class Columns:
    """`width` 0 does not wrap; `heights` of all columns but the last, which takes the rest."""

    width: float
    gutter: float = 0.0
    heights: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Pitch:
    """`exact` is the height that all lines count for, 0 for each its own."""

    factor: float
    exact: float = 0.0

    def drop(self, above: float, below: float) -> float:
        """Distance of the baselines of two lines of these heights."""
        if self.exact:
            return LINE_PITCH * self.factor * self.exact
        return LINE_PITCH * self.factor * above - above + below


@dataclass(frozen=True, eq=False)
class Placed:
    """A line in its column; the first line's top lies at y = 0."""

    column: int
    baseline: float
    line: Line


def wrapped(paragraph: Paragraph, width: float) -> Iterator[Line]:
    """The lines of a paragraph, no wider than `width` where words allow that (0: one line)."""
    left, following, margin = paragraph.indents
    limit = (width - margin) + WRAP_SLACK * width
    x = left
    placed: list[tuple[float, Cell]] = []
    groups = [*_unbreakable(paragraph.cells), ()]
    for group, ahead in pairwise(groups):
        size = sum(cell.width for cell in group)
        glue = group[0].glue
        if glue is Glue.TAB:
            x = _tabbed(x, sum(cell.width for cell in ahead), paragraph)
        elif glue is Glue.SPACE:
            placed.append((x, group[0]))
            x += size
        else:
            if width > 0.0 and x + size > limit and any(_is_word(cell) for _, cell in placed):
                yield _line(paragraph, placed, left, stretch=paragraph.justified)
                left, x, placed = following, following, []
            for cell in group:
                placed.append((x, cell))
                x += cell.width
    last = _line(paragraph, placed, left, stretch=False)
    yield replace(last, ends_column=paragraph.ends_column)


def _is_word(cell: Cell) -> bool:
    return cell.glue is Glue.NONE


def _unbreakable(cells: Sequence[Cell]) -> Iterator[tuple[Cell, ...]]:
    """Runs of words and hard spaces; each space and tab alone."""
    run: list[Cell] = []
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


def _tabbed(x: float, ahead: float, paragraph: Paragraph) -> float:
    """Where the text after a tab begins, which is `ahead` wide."""
    for stop, share in paragraph.stops:
        if stop > x and stop - share * ahead >= x:
            return stop - share * ahead
    return (x // paragraph.tab + 1.0) * paragraph.tab


def _line(
    paragraph: Paragraph, placed: list[tuple[float, Cell]], left: float, *, stretch: bool
) -> Line:
    """A line without the spaces at its end."""
    count = len(placed)
    while count and placed[count - 1][1].glue is Glue.SPACE:
        count -= 1
    cells = tuple(placed[:count])
    height = max((cell.height for _, cell in cells), default=0.0) or paragraph.blank
    right = cells[-1][0] + cells[-1][1].width if cells else left
    return Line(cells, height, right, paragraph.indents[2], paragraph.share, stretch)


def stacked(lines: Sequence[Line], columns: Columns, pitch: Pitch) -> list[Placed]:
    """Lines below each other, in the next column where one is full or ended."""
    placed: list[Placed] = []
    column, start = 0, True
    for line in lines:
        baseline = -line.height
        if not start:
            above = placed[-1]
            baseline = above.baseline - pitch.drop(above.line.height, line.height)
            room = columns.heights[column] if column < len(columns.heights) else None
            if room is not None and -baseline > room * (1.0 + WRAP_SLACK):
                column, baseline = column + 1, -line.height
        placed.append(Placed(column, baseline, line))
        start = line.ends_column
        column += line.ends_column
    return placed


def draw(ink: Ink, line: Line, width: float, at: tuple[float, float]) -> None:
    """A line into its column, whose left edge at the line's baseline is `at`."""
    spare = width - line.margin - line.right
    gaps = sum(cell.glue is Glue.SPACE for _, cell in line.cells)
    widened = spare / gaps if line.stretch and gaps and spare > 0.0 else 0.0
    shift = at[0] + line.share * spare
    ruled: list[tuple[float, float, Cell]] = []
    for x, cell in line.cells:
        start = shift + x
        if cell.glue is Glue.NONE:
            lift = 0.5 * cell.lift * (line.height - cell.height)
            _draw_cell(ink, cell, (start, at[1] + lift))
        shift += widened * (cell.glue is Glue.SPACE)
        ruled.append((start, shift + x + cell.width, cell))
    _rule(ink, ruled, at[1])


def _rule(ink: Ink, cells: Sequence[tuple[float, float, Cell]], baseline: float) -> None:
    """Underlines and the like, each in one piece along cells that look alike."""

    def manner(placed: tuple[float, float, Cell]) -> tuple[int, float]:
        return int(placed[2].look.rules), placed[2].look.height

    for (rules, _), group in groupby(cells, manner):
        run = list(group)
        if rules:
            ink.rule(run[0][2].look, (run[0][0], run[-1][1]), baseline)


def _draw_cell(ink: Ink, cell: Cell, at: tuple[float, float]) -> None:
    """A word, or the two of a stack and what divides them."""
    x, y = at
    look = cell.look
    if not cell.bar:
        ink.write(cell.text, look, at)
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
