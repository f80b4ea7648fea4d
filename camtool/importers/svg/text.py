"""`<text>` and its `tspan`s as the contours of their letters, in user units.

    element ──_Flow──▶ letters, each with its style, and places by letter ──chunks──▶ subpaths

Blanks collapse over the whole text, line ends being blanks, unless `xml:space` or `white-space`
keeps them. A letter that x or y gives a place begins a chunk; text-anchor lies at the chunk's
first letter. Letters come from `importers.text`, as those of a DXF do: without kerning. What would
move or shape letters and is not done here refuses the whole text, with the reason.
Source: Scalable Vector Graphics 2, chapter 11 (11.5: the layout)."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.importers.pieces import Unusable
from camtool.importers.svg.scope import is_for_us
from camtool.importers.svg.shapes import Bezier, Lengths, Segment, Subpath, SvgLines
from camtool.importers.svg.style import SvgStyle
from camtool.importers.svg.tree import Node
from camtool.importers.text import (
    MAX_CHARACTERS,
    Font,
    Ink,
    Rule,
    TextLook,
    WantedFont,
    describe_lacking,
    font_for,
)

MAX_FAMILIES = 8

DEFAULT_FAMILY = "sans-serif"
"""The family of a text that names none, as Inkscape takes it; renderers differ."""

_MAX_NAME = 64  # letters of a family's name
_BOLD_FROM = 600
_WEIGHTS = {"normal": 400, "lighter": 400, "bold": 700, "bolder": 700}
_PLACES = (("x", "x"), ("y", "y"), ("dx", "x"), ("dy", "y"))
_LETTERLESS = ("title", "desc", "metadata", "style", "script", "animate", "set",
               "animateTransform", "animateMotion", "animateColor", "")  # fmt: skip
_ANCHORS = ("start", "middle", "end")
_RULES = {"underline": Rule.UNDER, "overline": Rule.OVER, "line-through": Rule.THROUGH}
_BLANKS = " \t\r\n"
_KEPT = ("pre", "pre-wrap", "break-spaces")
_LEFTWARDS = ("R", "AL", "RLE", "RLO", "RLI")
_BLANK = re.compile(r"[ \t\r\n]+")
_BETWEEN = re.compile(r"[\s,]+")


@dataclass(frozen=True, eq=False)
class TextRun:
    """Letters of one style, as subpaths."""

    subpaths: list[Subpath]
    style: SvgStyle


class Text(Struct, frozen=True, eq=False):
    """A text drawn: its runs, and the number of its letters.

    `unseen`: reasons why some of them are not drawn; `lacks`: what fonts lack; `plainer`: font
    weights that were replaced by regular or bold."""

    runs: list[TextRun]
    letters: int
    unseen: list[str]
    lacks: list[str]
    plainer: list[str]


def text_of(
    node: Node,
    style: SvgStyle,
    style_of: Callable[[Node, SvgStyle], SvgStyle],
    lengths_of: Callable[[SvgStyle], Lengths],
    mode: str,
) -> Text:
    """Return the outlines of a `text` element; mode is "outline" or "stroke".

    `style` is its style; `style_of` gives the style of an element within it from that of its
    parent. Raises Unusable, with the reason, when it cannot be drawn as it is shown, DrawingError
    for a position that is no length."""
    flow = _Flow(style_of, lengths_of)
    flow.visit(node, style, _keeps_blanks(node))
    flow.end()
    writer = _Writer(mode)
    runs = [run for chunk in _chunks(flow, writer) for run in _draw_chunk(chunk, writer, flow)]
    lacks = [
        text
        for (font, other), missing in writer.missing.items()
        if (text := describe_lacking(font, other, "".join(sorted(missing))))
    ]
    return Text(runs, len(flow.letters), list(flow.unseen), lacks, list(writer.plainer))


def _keeps_blanks(node: Node | None) -> bool:
    """Return True if xml:space of the element, or of the nearest one around it that has it, is
    "preserve"."""
    while node is not None:
        space = node.get("xml:space")
        if space:
            return space == "preserve"
        node = node.parent
    return False


class _Flow(Struct, eq=False):
    """The letters of a text in order, blanks collapsed, and the style of each; `at` holds the x,
    y, dx and dy that elements give to a letter, by its index."""

    style_of: Callable[[Node, SvgStyle], SvgStyle]
    lengths_of: Callable[[SvgStyle], Lengths]
    letters: list[str] = field(default_factory=list)
    styles: list[SvgStyle] = field(default_factory=list)
    at: dict[int, dict[str, float]] = field(default_factory=dict)
    unseen: dict[str, None] = field(default_factory=dict)
    _after_blank: bool = True
    _by_letter: bool = False
    _recounted: bool = False

    def visit(self, node: Node, style: SvgStyle, keep: bool) -> None:
        """Add the letters of the element and of those within it; then store the positions that it
        gives to them, unless an inner element has given one."""
        for name in ("rotate", "textLength"):
            if node.get(name):
                raise Unusable(f"has {name}, which is not read: convert it to paths")
        first = len(self.letters)
        self._add(node.text, style, keep)
        for child in node.children:
            if child.tag in ("tspan", "a"):
                inner = self.style_of(child, style)
                if inner.display == "none":
                    self.unseen["is hidden (display: none)"] = None
                elif not is_for_us(child):
                    self.unseen["is for another language or program"] = None
                else:
                    space = child.get("xml:space")
                    self.visit(child, inner, space == "preserve" if space else keep)
            elif child.tag not in _LETTERLESS:
                raise Unusable(f"has a {child.tag[:40]} in it, which is not read")
            self._add(child.tail, style, keep)
        self._place(node, style, first)

    def end(self) -> None:
        """Remove a last blank, which collapses too.

        Unusable when there are no letters, or some whose places are not known."""
        if self._after_blank and self.letters:
            self.letters.pop()
            self.at.pop(len(self.letters), None)
        if not self.letters:
            raise Unusable("is empty")
        if len(self.letters) > MAX_CHARACTERS:
            raise Unusable(f"has more than {MAX_CHARACTERS} characters")
        if self._by_letter and self._recounted:
            raise Unusable("has a place for each letter, and letters that are combined")

    def _add(self, raw: str, style: SvgStyle, keep: bool) -> None:
        """Add letters of one style; blanks collapse unless `keep` or the style says otherwise."""
        if not raw:
            return
        if style.blanks:
            keep = style.blanks in _KEPT
            if "\n" in raw and (keep or style.blanks == "pre-line"):
                if not raw.strip(_BLANKS):
                    return
                raise Unusable(f"has lines broken by white-space: {style.blanks[:20]}")
        text = raw if keep else _BLANK.sub(" ", raw)
        if len(self.letters) + len(text) > MAX_CHARACTERS + 2:  # blanks at its ends may go
            raise Unusable(f"has more than {MAX_CHARACTERS} characters")
        composed = unicodedata.normalize("NFC", text)
        self._recounted |= len(composed) != len(text) or any(
            letter > "\uffff" for letter in composed
        )
        for letter in composed:
            blank = letter in _BLANKS
            if not blank:
                _check(letter)
            elif not keep and self._after_blank:
                continue
            self.letters.append(" " if blank else letter)
            self.styles.append(style)
            self._after_blank = blank and not keep

    def _place(self, node: Node, style: SvgStyle, first: int) -> None:
        lengths = self.lengths_of(style)
        for name, axis in _PLACES:
            content = node.get(name)
            if not content:
                continue
            listed = _BETWEEN.split(content)
            self._by_letter |= len(listed) > 1
            for place, word in enumerate(listed[: max(len(self.letters) - first, 1)], first):
                value = lengths.length(word, axis, name)
                if place < len(self.letters):
                    self.at.setdefault(place, {}).setdefault(name, value)


def _check(letter: str) -> None:
    """Raise Unusable for a letter whose position depends on those around it: written leftwards, or
    combining."""
    if unicodedata.bidirectional(letter) in _LEFTWARDS:
        raise Unusable("is written from right to left")
    if unicodedata.category(letter) in ("Mn", "Mc", "Me"):
        raise Unusable(f"has letters that are combined (U+{ord(letter):04X})")


class _Words(Struct, frozen=True, eq=False):
    """Letters of one look in a row, from x to `end`, with the baseline at y (down)."""

    letters: str
    style: SvgStyle
    look: TextLook
    fonts: tuple[str, str]
    x: float
    y: float
    end: float


class _Writer(Struct, eq=False):
    """The choice of fonts for a mode of text; `missing` collects the characters that a font lacks,
    by the font used and the one wanted."""

    mode: str
    missing: dict[tuple[str, str], set[str]] = field(default_factory=dict)
    plainer: dict[str, None] = field(default_factory=dict)

    def look(self, style: SvgStyle) -> tuple[TextLook, tuple[str, str]]:
        """Return the look of letters of this style, and two names: of their font, and of the
        wanted font if that is another one, else ""."""
        if style.odd:
            raise Unusable(f"its {min(style.odd)} cannot be applied: convert it to paths")
        if style.anchor not in _ANCHORS:
            raise Unusable("has an unknown text-anchor")
        if not style.font_px > 0.0:
            raise Unusable("has no size")
        font, other = self._font(style)
        rules = Rule.NONE
        for word in style.decoration:
            rules |= _RULES.get(word, Rule.NONE)
        self.missing.setdefault((font.name, other), set())
        return TextLook(font, style.font_px / font.em, rules=rules), (font.name, other)

    def _font(self, style: SvgStyle) -> tuple[Font, str]:
        """Return the first installed font of the families that the style lists, else a substitute
        for the first one; and the name of the wanted font if it is another one, else ""."""
        weight = _WEIGHTS.get(style.weight, 0)
        if not weight:
            if not (style.weight.isdecimal() and 1 <= int(style.weight[:5]) <= 1000):
                raise Unusable("has an unknown font-weight")
            weight = int(style.weight)
        if weight not in _WEIGHTS.values() and self.mode != "stroke":
            self.plainer[str(weight)] = None
        italic = style.slope.startswith(("italic", "oblique"))
        named = style.family.split(",", MAX_FAMILIES)[:MAX_FAMILIES]
        families = [family for name in named if (family := _family(name))] or [DEFAULT_FAMILY]
        bold = weight >= _BOLD_FROM
        requests = [WantedFont(family=family, bold=bold, italic=italic) for family in families]
        for one in requests:
            font, other = font_for(one, self.mode)
            if not other:
                return font, "" if one is requests[0] or self.mode == "stroke" else str(
                    requests[0]
                )
        return font_for(requests[0], self.mode)


def _family(name: str) -> str:
    """Return a font family without quotes, with "?" for characters that cannot be printed."""
    words = " ".join(name.strip().strip("\"'").split())[:_MAX_NAME]
    return "".join(sign if sign.isprintable() else "?" for sign in words)


def _chunks(flow: _Flow, writer: _Writer) -> Iterator[list[_Words]]:
    """Yield chunks of words: a chunk begins at each letter that has an x or y of its own.

    Unusable where a line continues behind letters that text-anchor has moved: the standard
    continues from where they were before that, renderers from where they are."""
    starts = sorted(
        {0, *flow.at}
        | {k for k in range(1, len(flow.letters)) if flow.styles[k] != flow.styles[k - 1]}
    )
    x = y = 0.0
    chunk: list[_Words] = []
    looks: dict[SvgStyle, tuple[TextLook, tuple[str, str]]] = {}
    for first, last in pairwise([*starts, len(flow.letters)]):
        position = flow.at.get(first, {})
        if chunk and ("x" in position or "y" in position):
            if "x" not in position and chunk[0].style.anchor != "start":
                raise Unusable("has a y without an x behind letters that text-anchor moves")
            yield chunk
            chunk = []
        x = position.get("x", x) + position.get("dx", 0.0)
        y = position.get("y", y) + position.get("dy", 0.0)
        style = flow.styles[first]
        if style not in looks:
            looks[style] = writer.look(style)
        look, fonts = looks[style]
        letters = "".join(flow.letters[first:last])
        end = x + look.width(letters)
        chunk.append(_Words(letters, style, look, fonts, x, y, end))
        x = end
    yield chunk


def _draw_chunk(chunk: list[_Words], writer: _Writer, flow: _Flow) -> Iterator[TextRun]:
    """Draw the words of a chunk and yield each as outlines with its style.

    All are moved so that the start, middle or end of the chunk lies at its first letter's place
    (text-anchor). Unusable where a dx within the chunk changes its span: the standard takes it
    into account, not all renderers do."""
    begin = min(words.x for words in chunk)
    end = max(words.end for words in chunk)
    gaps = any(words.x != before.end for before, words in pairwise(chunk))
    if gaps and (chunk[0].style.anchor != "start" or begin < chunk[0].x):
        raise Unusable("has a dx within letters that text-anchor moves")
    share = {"start": 0.0, "middle": 0.5, "end": 1.0}[chunk[0].style.anchor]
    shift = chunk[0].x - (begin + share * (end - begin))
    for words in chunk:
        style, look = words.style, words.look
        if style.visibility in ("hidden", "collapse"):
            flow.unseen["is hidden (visibility)"] = None
        elif not style.is_painted:
            flow.unseen["has neither stroke nor fill"] = None
        else:
            ink = Ink()
            x, baseline = words.x + shift, look.font.foot * look.height - words.y
            ink.write(words.letters, look, (x, baseline))
            ink.rule(look, (x, words.end + shift), baseline)
            writer.missing[words.fonts].update(ink.missing)
            yield TextRun(_subpaths(ink), style)


def _subpaths(ink: Ink) -> list[Subpath]:
    """Convert the contours of letters to subpaths, Y down."""
    if not ink.points:
        return []
    points = np.concatenate(ink.points) * (1.0, -1.0)
    subpaths, position = [], 0
    for counts, closed in ink.contours:
        ends = list(accumulate(counts, initial=position))
        parts = [points[start:stop] for start, stop in pairwise(ends)]
        position = ends[-1]
        if parts:
            subpaths.append(Subpath(parts[0][0], _segments(parts), closed))
    return subpaths


def _segments(parts: list[Floats]) -> tuple[Segment, ...]:
    """Return the parts of a contour, which lie end to end, as segments; lines in a row become one
    segment."""
    segments: list[Segment] = []
    corners: list[Floats] = []
    for part in parts:
        if len(part) == 2:
            corners.append(part[1])
            continue
        if corners:
            segments.append(SvgLines(np.array(corners)))
            corners = []
        segments.append(Bezier(part[1:]))
    if corners:
        segments.append(SvgLines(np.array(corners)))
    return tuple(segments)
