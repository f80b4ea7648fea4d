"""Letters as single strokes: Hershey's Roman simplex, and the characters that it lacks.

The font is "rowmans" of the package Hershey-Fonts, on its own grid: capitals are 21 units high,
the baseline lies at y = 9, y grows downwards. It serves engraving and the labels of pictures alike
and needs no font file."""

from __future__ import annotations

import unicodedata
from functools import lru_cache
from types import MappingProxyType

from msgspec import Struct

CAP_UNITS = 21.0

BASELINE = 9.0
"""The y of the baseline (y down)."""

NAME = "Hershey Roman simplex"

_FONT = "rowmans"
_SPACE_WIDTH = 13.0

Strokes = tuple[tuple[tuple[float, float], ...], ...]


class Glyph(Struct, frozen=True):
    """Strokes in font units, x from the left edge of the letter, y down; `advance` to the next."""

    strokes: Strokes
    advance: float


_SAME = MappingProxyType(
    {
        "−": "-",
        "–": "—",
        "‘": "'",
        "’": "'",
        "“": '"',
        "”": '"',
        "\N{NO-BREAK SPACE}": " ",
        "\N{NARROW NO-BREAK SPACE}": " ",
    }
)
_MARKS: MappingProxyType[str, Strokes] = MappingProxyType(
    {  # relative to the middle of the letter and to the top of a small one
        "\u0300": (((-3, -7), (2, -3)),),
        "\u0301": (((3, -7), (-2, -3)),),
        "\u0302": (((-4, -3), (0, -7), (4, -3)),),
        "\u0303": (((-5, -4), (-3, -6), (-1, -6), (1, -4), (3, -4), (5, -6)),),
        "\u0308": (((-4, -5), (-3, -5)), ((3, -5), (4, -5))),
        "\u030a": (((0, -8), (2, -6), (0, -4), (-2, -6), (0, -8)),),
        "\u030c": (((-4, -7), (0, -3), (4, -7)),),
        "\u0327": (((0, 14), (2, 16), (1, 19), (-2, 19)),),
    }
)
_HYPHEN = Glyph((((3, 0), (13, 0)),), 16.0)
_DASH = Glyph((((3, 0), (21, 0)),), 24.0)
_CIRCLE = ((0, -3), (2.1, -2.1), (3, 0), (2.1, 2.1), (0, 3), (-2.1, 2.1), (-3, 0), (-2.1, -2.1))


@lru_cache(maxsize=1)
def _font() -> MappingProxyType[str, Glyph]:
    """Return the glyphs of the font by character, with those that are composed from them."""
    from HersheyFonts import HersheyFonts

    reader = HersheyFonts()
    reader.load_default_font(_FONT)
    glyphs: dict[str, Glyph] = {}
    for letter, raw in reader.all_glyphs.items():
        strokes = tuple(
            tuple((float(x - raw.left_offset), float(y)) for x, y in stroke)
            for stroke in raw.strokes
        )
        glyphs[letter] = Glyph(strokes, float(raw.char_width))
    del glyphs["\x7f"]
    glyphs[" "] = Glyph((), _SPACE_WIDTH)
    glyphs["-"] = _HYPHEN
    glyphs.update(_composed_glyphs(glyphs))
    return MappingProxyType(glyphs)


def _composed_glyphs(glyphs: dict[str, Glyph]) -> dict[str, Glyph]:
    """Return glyphs for characters that the font lacks (µ, ×, °, ø …), composed from its strokes,
    on its grid."""
    u, plus, zero = glyphs["u"], glyphs["+"], glyphs["O"]
    low_x = min(x for stroke in u.strokes for x, _ in stroke)
    mu = Glyph((*u.strokes, ((low_x, -5.0), (low_x, 16.0))), u.advance)
    ring = tuple((8.0 + x, -9.0 + y) for x, y in (*_CIRCLE, _CIRCLE[0]))
    bullet = tuple((8.0 + x, y) for x, y in (*_CIRCLE, _CIRCLE[0]))
    middle = tuple((5.0 + 0.35 * x, 1.0 + 0.35 * y) for x, y in (*_CIRCLE, _CIRCLE[0]))
    slash = ((zero.advance - 1.0, -14.0), (1.0, 11.0))
    dots = tuple((stroke, 9.0 * k) for k in range(3) for stroke in glyphs["."].strokes)
    return {
        "µ": mu,
        "μ": mu,
        "×": Glyph((((4, -5), (16, 7)), ((4, 7), (16, -5))), 20.0),
        "·": Glyph((middle,), 10.0),
        "°": Glyph((ring,), 15.0),
        "•": Glyph((bullet,), 16.0),
        "±": Glyph((*plus.strokes, ((4, 9), (22, 9))), plus.advance),
        "ø": Glyph((*zero.strokes, slash), zero.advance),
        "Ø": Glyph((*zero.strokes, slash), zero.advance),
        "⌀": Glyph((*zero.strokes, slash), zero.advance),
        "…": Glyph(tuple(tuple((x + dx, y) for x, y in s) for s, dx in dots), 28.0),
        "²": _raised_glyph(glyphs["2"]),
        "³": _raised_glyph(glyphs["3"]),
        "→": Glyph((((3, 0), (21, 0)), ((15, -6), (21, 0), (15, 6))), 24.0),
        "—": _DASH,
    }


def _raised_glyph(glyph: Glyph) -> Glyph:
    strokes = tuple(tuple((0.55 * x, 0.55 * y - 6.0) for x, y in s) for s in glyph.strokes)
    return Glyph(strokes, 0.6 * glyph.advance)


BOX = Glyph((((3, -12), (15, -12), (15, 9), (3, 9), (3, -12)),), 18.0)
"""An empty box, for characters that are unknown."""


def glyph(letter: str) -> Glyph | None:
    """Return the strokes of one character, None if the font lacks it."""
    letter = _SAME.get(letter, letter)
    font = _font()
    if letter in font:
        return font[letter]
    base, *marks = list(unicodedata.normalize("NFD", letter))
    if base not in font or any(mark not in _MARKS for mark in marks):
        return None
    body = font[base]
    middle = body.advance / 2.0
    lift = -7.0 if base.isupper() or base in "bdfhklt" else 0.0
    added = tuple(
        tuple((middle + x, y + (0.0 if mark == "\u0327" else lift - 3.0)) for x, y in stroke)
        for mark in marks
        for stroke in _MARKS[mark]
    )
    strokes = body.strokes
    if base in "ij" and "\u0327" not in marks:  # the accent takes the place of the dot
        strokes = tuple(s for s in strokes if max(y for _, y in s) > -8.0)
    return Glyph((*strokes, *added), body.advance)
