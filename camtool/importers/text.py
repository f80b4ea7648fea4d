"""Letters of drawings as curves: fonts, and letters put side by side.

Letters are outlines of an installed font, or the single strokes of Hershey's Roman. They are
measured in heights of a capital: the baseline is y = 0, a capital reaches y = 1. Fonts are found
by ezdxf, which lists the installed ones once for all its uses; nothing is downloaded."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable
from enum import IntFlag
from functools import lru_cache, partial
from pathlib import Path, PurePath
from typing import Any

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.geometry import hershey
from camtool.importers.pieces import Unusable

SUBSTITUTES = ("Liberation Sans", "Arimo", "Arial", "Helvetica", "DejaVu Sans", "Noto Sans")
"""Families that replace a font that is not installed, the first one that is installed: most
drawings name Arial, whose widths the first four share."""

STROKE_EM = 2048.0 / 1466.0
"""Size of the stroke font in heights of its capitals, which it lacks itself: that of Arial."""

_OUTLINES = (".ttf", ".otf", ".ttc")
_SHAPES = (".shx", ".shp", ".lff")
_SHAPE_FONTS = frozenset(
    [
        "txt",
        "monotxt",
        "simplex",
        "complex",
        "italic",
        "romans",
        "romanc",
        "romand",
        "romant",
        "scripts",
        "scriptc",
        "greeks",
        "greekc",
        "gothice",
        "gothicg",
        "gothici",
        "isocp",
        "isocp2",
        "isocp3",
        "isoct",
        "isoct2",
        "isoct3",
        "iso",
        "symath",
        "symap",
    ]
)
_BOLD, _REGULAR, _NORMAL_WIDTH = 700, 400, 5
_FONTS_KEPT = 8  # fonts whose letters stay in memory
_LETTERS_KEPT = 4096  # of each
_CHOICES_KEPT = 64


class Letter(Struct, frozen=True, eq=False):
    """The shape of a letter: the control points (n, 2) of all its parts; for each contour the
    number of points (2 to 4) of each part; and its advance."""

    points: Floats
    contours: tuple[tuple[int, ...], ...]
    advance: float

    @classmethod
    def of(cls, contours: list[list[Floats]], advance: float) -> Letter:
        """Return the letter with these contours, each a list of parts (k, 2) of k = 2 to 4 control
        points."""
        parts = [part for contour in contours for part in contour]
        points = np.concatenate(parts) if parts else np.empty((0, 2))
        counts = tuple(tuple(len(part) for part in contour) for contour in contours)
        return cls(points, counts, advance)


class Font(Struct, frozen=True, eq=False):
    """A font, in heights of a capital.

    `letter` returns None for a character that it lacks: a blank of the width `blank` takes its
    place. `em` is the size by which the font is asked for. The baseline is the foot of an "x",
    which lies `foot` above the font's own."""

    name: str
    outlines: bool
    letter: Callable[[str], Letter | None]
    descent: float
    blank: float
    em: float
    foot: float = 0.0


class WantedFont(Struct, frozen=True):
    """A font as a drawing names it: a file, or a family in bold or italic letters."""

    file: str = ""
    family: str = ""
    bold: bool = False
    italic: bool = False

    @property
    def is_stroked(self) -> bool:
        """True for CAD's own stroke fonts: txt, romans.shx, symbols.shp, iso.lff."""
        if self.family:
            family = self.family.lower()
            return family.endswith(_SHAPES) or family in _SHAPE_FONTS
        return not self.file.lower().endswith(_OUTLINES)

    def __str__(self) -> str:
        looks = " bold" * self.bold + " italic" * self.italic
        return (self.family or self.file or "txt") + looks


@lru_cache(maxsize=_CHOICES_KEPT)
def font_for(request: WantedFont, mode: str) -> tuple[Font, str]:
    """Return the font to draw with, and the name of the requested one if another one stands in for
    it, else "".

    Mode "stroke" draws every text with single strokes, mode "outline" only one for which a stroke
    font is requested. Raises Unusable when outlines are needed and no outline font is installed.
    """
    if mode == "stroke":
        return stroke_font(), ""
    if request.is_stroked:
        return stroke_font(), str(request)
    named = _font_named(request)
    font = _outline_font(named.path) if named else None
    if font is not None:
        return font, ""
    for face in _substitutes(request):
        font = _outline_font(face.path)
        if font is not None:
            return font, str(request)
    raise Unusable(
        f"is in the font {request}, but no outline font is installed; use --text stroke"
    )


@lru_cache(maxsize=1)
def stroke_font() -> Font:
    """Return Hershey's Roman simplex, a font of single strokes, which needs no file."""
    depth = max(y for stroke in _strokes("p") for _, y in stroke) - hershey.BASELINE
    blank = hershey.BOX.advance / hershey.CAP_UNITS
    return Font(hershey.NAME, False, _stroke_letter, depth / hershey.CAP_UNITS, blank, STROKE_EM)


def _strokes(character: str) -> hershey.Strokes:
    glyph = hershey.glyph(character)
    return glyph.strokes if glyph else ()


@lru_cache(maxsize=_LETTERS_KEPT)
def _stroke_letter(character: str) -> Letter | None:
    glyph = hershey.glyph(character)
    if glyph is None:
        return None
    contours = []
    for stroke in glyph.strokes:
        points = np.array(stroke, dtype=np.float64)
        points[:, 1] = hershey.BASELINE - points[:, 1]
        points /= hershey.CAP_UNITS
        contours.append([points[k : k + 2] for k in range(len(points) - 1)])
    return Letter.of(contours, glyph.advance / hershey.CAP_UNITS)


class _Face(Struct, frozen=True, order=True):
    """An installed font file, with the family, style, weight and width that it states."""

    path: str
    family: str
    style: str
    weight: int
    width: int

    @property
    def italic(self) -> bool:
        return any(word in self.style.lower() for word in ("italic", "oblique"))

    def distance(self, request: WantedFont) -> tuple[bool, int, int, str]:
        """Return a sort key by which the fonts most like the requested one come first."""
        weight = _BOLD if request.bold else _REGULAR
        slant = self.italic is not request.italic
        return (slant, abs(self.weight - weight), abs(self.width - _NORMAL_WIDTH), self.path)


@lru_cache(maxsize=1)
def installed_fonts() -> tuple[_Face, ...]:
    """Return all outline fonts, in an order that does not depend on the file system."""
    import json

    from ezdxf.fonts import fonts

    listed = json.loads(fonts.font_manager.dumps())["font-faces"]
    faces = {_Face(*face) for face in listed}
    return tuple(sorted(f for f in faces if PurePath(f.path).suffix.lower() in _OUTLINES))


def _font_named(request: WantedFont) -> _Face | None:
    """Return the installed font with the requested family, else with the requested file name, else
    None."""
    if request.family and (face := _of_family(request.family, request)) is not None:
        return face
    name = PurePath(request.file.replace("\\", "/")).name.lower()
    return next((f for f in installed_fonts() if PurePath(f.path).name.lower() == name), None)


def _of_family(family: str, request: WantedFont) -> _Face | None:
    faces = [f for f in installed_fonts() if f.family.lower() == family.lower()]
    return min(faces, key=lambda face: face.distance(request), default=None)


def _substitutes(request: WantedFont) -> list[_Face]:
    """Return fonts to use in place of the requested one, the best first."""
    best = [face for name in SUBSTITUTES if (face := _of_family(name, request)) is not None]
    candidates = sorted(installed_fonts(), key=lambda face: face.distance(request))
    return best + candidates[:_FONTS_KEPT]


@lru_cache(maxsize=_FONTS_KEPT)
def _outline_font(path: str) -> Font | None:
    """Return the font of a file, None when it is broken or holds no letters."""
    from io import BytesIO

    from ezdxf.fonts.font_manager import UnsupportedFont
    from ezdxf.fonts.ttfonts import TTFontRenderer
    from fontTools.ttLib import TTFont, TTLibError

    try:
        glyphs = TTFontRenderer(TTFont(BytesIO(Path(path).read_bytes()), fontNumber=0))
        size = glyphs.font_measurements
        blank = float(glyphs.undefined_generic_glyph.width)
        em = float(glyphs.font["head"].unitsPerEm)
    except (OSError, TTLibError, UnsupportedFont, LookupError, ValueError, AttributeError):
        return None
    capital = float(size.cap_height)
    if not capital > 0.0:
        return None
    letter = lru_cache(maxsize=_LETTERS_KEPT)(partial(_outline, glyphs, capital))
    name = f"{glyphs.font_name} ({PurePath(path).name})"
    descent, foot = float(size.descender_height), float(size.baseline)
    return Font(
        name, True, letter, descent / capital, blank / capital, em / capital, foot / capital
    )


def _outline(glyphs: Any, capital: float, character: str) -> Letter | None:
    """Return the outline of a letter, in heights of a capital; None if the font lacks it.

    `capital` is the height of a capital in the units of the font."""
    if ord(character) not in glyphs.cmap:
        return None
    base = np.array([0.0, float(glyphs.font_measurements.baseline)])
    contours = []
    for path in glyphs.get_glyph_path(character).to_path().sub_paths():
        position, parts = path.start, []
        for command in path.commands():
            controls = [getattr(command, name, None) for name in ("ctrl", "ctrl1", "ctrl2")]
            points = [position, *(point for point in controls if point is not None), command.end]
            part = np.array([(p.x, p.y) for p in points], dtype=np.float64)
            if np.ptp(part, axis=0).any():
                parts.append((part - base) / capital)
            position = command.end
        if parts:
            contours.append(parts)
    return Letter.of(contours, float(glyphs.get_glyph_width(character)) / capital)


# Letters put side by side on a plane of their own: x along the line, y up, in drawing units.

RULE_SHARE = 0.07
"""Thickness of an underline or a fraction bar in outlines, as a share of the letters' height."""

RULE_DROP = 0.2
"""Distance of an underline from the baseline, and of an overline from the capitals (share of the
height of a capital)."""

NUMBERED = re.compile(r"%%(03[2-9]|0[4-9]\d|1\d\d|2[0-4]\d|25[0-5])", re.ASCII)
"""A character by its number, 32 to 255."""

MAX_CHARACTERS = 20_000
"""Longest text, codes included; CAD programs limit input by hand to 250 in TEXT and about 2000 in
MTEXT."""

MAX_CHARACTERS_NAMED = 20

MAX_NUMBER = 1e60
"""Larger sizes and coordinates are refused: products of a few of them would overflow."""

MAX_OBLIQUE_DEG = 85.0


def finite(*values: float) -> tuple[float, ...]:
    """Return the values as floats; Unusable when one is not finite or too large."""
    numbers = tuple(float(value) for value in values)
    if not all(abs(number) <= MAX_NUMBER for number in numbers):
        raise Unusable("has numbers that are not finite or too large")
    return numbers


def describe_lacking(font: str, substituted: str, missing: str) -> str:
    """Return words for what a font lacks, "" if nothing.

    `font` draws in place of the font `substituted` ("" when it is the wanted one) and has none of
    the characters `missing`."""
    notes = []
    if substituted:
        notes.append(f"font {substituted} is not installed: drawn with {font}")
    if missing:
        signs = [_visible(sign) for sign in dict.fromkeys(missing)]
        extra = len(signs) - MAX_CHARACTERS_NAMED
        tail = f" and {extra} more" if extra > 0 else ""
        notes.append(f"{font} has no {' '.join(signs[:MAX_CHARACTERS_NAMED])}{tail}: left blank")
    return "; ".join(notes)


def _visible(sign: str) -> str:
    return sign if sign.isprintable() and not sign.isspace() else f"U+{ord(sign):04X}"


def slant(oblique_deg: float) -> float:
    """Return the tangent of an oblique angle, which is limited to ±MAX_OBLIQUE_DEG."""
    return math.tan(math.radians(max(-MAX_OBLIQUE_DEG, min(MAX_OBLIQUE_DEG, oblique_deg))))


def character_of_number(digits: str) -> str:
    """Return the character with this number, the nnn of %%nnn, in Windows' western code page."""
    return bytes([int(digits)]).decode("cp1252", errors="replace")


class Rule(IntFlag):
    """The lines along a text: underline, strike-through, overline."""

    NONE = 0
    UNDER = 1
    THROUGH = 2
    OVER = 4


class TextLook(Struct, frozen=True, eq=False):
    """The look of letters: `height` of a capital, `slant` = tan(oblique angle)."""

    font: Font
    height: float
    width_factor: float = 1.0
    slant: float = 0.0
    tracking: float = 1.0
    rules: Rule = Rule.NONE

    def advance(self, character: str) -> float:
        """Return the distance from the start of this letter to the start of the next one."""
        letter = self.font.letter(character)
        share = self.font.blank if letter is None else letter.advance
        return share * self.height * self.width_factor * self.tracking

    def width(self, text: str) -> float:
        """Return the width of a text on one line: the sum of its advances."""
        return sum(self.advance(character) for character in text)


class Ink(Struct, eq=False):
    """The contours of drawn text: `points` (n, 2) of all parts in turn; for each contour the
    counts of points of its parts, and True if it is closed; the characters that fonts lack."""

    points: list[Floats] = field(default_factory=list)
    contours: list[tuple[tuple[int, ...], bool]] = field(default_factory=list)
    missing: Counter[str] = field(default_factory=Counter)

    def write(self, text: str, look: TextLook, place: tuple[float, float]) -> float:
        """Draw a text from `place`, the left end of its baseline; return the x at which the next
        text begins."""
        x, y = place
        across = look.height * look.width_factor
        # (x, y) of a letter ↦ (across·x + height·slant·y, height·y)
        form = np.array([[across, 0.0], [look.height * look.slant, look.height]])
        for character in text:
            letter = look.font.letter(character)
            if letter is None:
                self.missing[character] += 1
            else:
                self.points.append(letter.points @ form + (x, y))
                closed = look.font.outlines
                self.contours.extend((counts, closed) for counts in letter.contours)
            x += look.advance(character)
        return x

    def rule(self, look: TextLook, span: tuple[float, float], baseline: float) -> None:
        """Draw the underline, strike-through and overline that `look` has, over the span from x to
        x."""
        shares = {Rule.UNDER: -RULE_DROP, Rule.THROUGH: 0.5, Rule.OVER: 1.0 + RULE_DROP}
        for rule, share in shares.items():
            if look.rules & rule and span[1] > span[0]:
                y = baseline + share * look.height
                self.line(look, (span[0], y), (span[1], y))

    def line(self, look: TextLook, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw a straight line: one stroke in a stroke font, a thin rectangle among outlines."""
        ends = np.array([start, end], dtype=np.float64)
        if not look.font.outlines:
            self.points.append(ends)
            self.contours.append(((2,), False))
            return
        along = ends[1] - ends[0]
        half = 0.5 * RULE_SHARE * look.height / float(np.hypot(*along))
        offset = half * np.array([-along[1], along[0]])
        corners = np.array(
            [ends[0] - offset, ends[1] - offset, ends[1] + offset, ends[0] + offset]
        )
        self.points.append(corners[[0, 1, 1, 2, 2, 3, 3, 0]])
        self.contours.append(((2, 2, 2, 2), True))
