"""Labels drawn with single strokes, so that a picture needs no font and looks the same everywhere.

The letters are those of `camtool.geometry.hershey`; a letter that the font lacks is an empty box.
The text itself stands in the label's `<title>` and `aria-label`."""

from __future__ import annotations

import re
from itertools import accumulate

from msgspec import Struct

from camtool.geometry.hershey import BASELINE, BOX, CAP_UNITS, Glyph, glyph
from camtool.pictures.colours import INK
from camtool.pictures.svg import Look, PathData, element, one_line, title

_UNIT = re.compile(r" (?!\(?(?:µm|mm|h)\b)")
"""Pattern of blanks at which a line may break: not those between a number and its unit."""


class TextStyle(Struct, frozen=True):
    """`cap` is the height of a capital on the page; `weight` is the width of its strokes as a
    share of `cap`."""

    cap: float = 13.0
    colour: str = INK
    anchor: str = "start"
    weight: float = 0.12


def _glyph_or_box(letter: str) -> Glyph:
    return glyph(letter) or BOX


def width(text: str, cap: float) -> float:
    """Return the width of a text on the page; `cap` is the height of its capitals."""
    return sum(_glyph_or_box(letter).advance for letter in one_line(text)) * cap / CAP_UNITS


def shortened(text: str, cap: float, limit: float) -> str:
    """Return the text on one line, cut and ended with "…" if it is wider than `limit`."""
    text = one_line(text)
    if width(text, cap) <= limit:
        return text
    # A name may have many thousand letters: each is measured once.
    advances = accumulate(
        (_glyph_or_box(letter).advance for letter in text), initial=_glyph_or_box("…").advance
    )
    count = sum(advance * cap / CAP_UNITS <= limit for advance in advances)
    return text[: max(count - 1, 0)].rstrip() + "…"


def wrapped(text: str, cap: float, limit: float) -> list[str]:
    """Return the text broken into lines no wider than `limit`.

    Lines break at blanks but not before a unit; a longer word is shortened."""
    lines: list[str] = []
    for word in filter(None, _UNIT.split(one_line(text))):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and width(longer, cap) <= limit:
            lines[-1] = longer
        else:
            lines.append(shortened(word, cap, limit))
    return lines


def label(
    text: str, place: tuple[float, float], style: TextStyle, *, full_text: str | None = None
) -> str:
    """Return the SVG of a text in strokes with its baseline at `place`; `full_text` is the text
    for screen readers."""
    data = strokes(text, place, style)
    spoken = text if full_text is None else full_text
    return element(
        "g",
        {"role": "img", "aria-label": spoken},
        title(spoken),
        element("path", {"d": data, **stroke_of(style)}) if data else "",
    )


def strokes(text: str, place: tuple[float, float], style: TextStyle) -> str:
    """Return the path data of the strokes of a text; "" when there is nothing to see."""
    shown = one_line(text)
    scale = style.cap / CAP_UNITS
    x = place[0] - {"start": 0.0, "middle": 0.5, "end": 1.0}[style.anchor] * width(
        shown, style.cap
    )
    data = PathData()
    for letter in shown:
        drawn = _glyph_or_box(letter)
        for stroke in drawn.strokes:
            for index, (dx, dy) in enumerate(stroke):
                target = (x + dx * scale, place[1] + (dy - BASELINE) * scale)
                (data.line if index else data.move)(*target)
        x += drawn.advance * scale
    return str(data)


def stroke_of(style: TextStyle) -> Look:
    """Return the look of the pen that draws labels of this style."""
    return {
        "fill": "none",
        "stroke": style.colour,
        "stroke-width": round(style.cap * style.weight, 3),
        "stroke-linecap": "round",
        "stroke-linejoin": "round",
    }
