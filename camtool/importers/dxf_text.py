"""TEXT, ATTRIB, ATTDEF and MTEXT of DXF drawings as curves in world coordinates.

Alignment follows what CAD programs store: a line is as wide as its letters advance, BOTTOM lies
below the baseline by the depth of "p", MIDDLE halfway between that and the top of the capitals
(the two alignment points of drawings saved by AutoCAD agree with it to 3 digits).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camtool.geometry.polylines import Floats
from camtool.importers.dxf_shapes import Unusable, require
from camtool.importers.text_fonts import Wanted, font_for
from camtool.importers.text_layout import Ink, Look, Rule
from camtool.importers.text_mtext import write_mtext

MAX_CHARACTERS = 20_000
"""Of one text entity, codes included; CAD programs write 250 into TEXT and about 2000 into MTEXT
by hand."""

_CODE = re.compile(r"%%(\d{3}|[cdpkou%])", re.IGNORECASE)
_SIGNS = {"c": "Ø", "d": "°", "p": "±", "%": "%"}
_RULES = {"u": Rule.UNDER, "o": Rule.OVER, "k": Rule.THROUGH}
_ALIGNED, _MIDDLE, _FIT = 3, 4, 5
_BACKWARD, _UPSIDE_DOWN = 2, 4
_STACKED_LETTERS = 4


@dataclass(frozen=True, eq=False)
class Contour:
    """Parts (k, 3) of control points, k = 2 (line), 3 (quadratic) or 4 (cubic), end to end."""

    parts: list[Floats]
    closed: bool


@dataclass(frozen=True, eq=False)
class TextShape:
    """The curves of a text, in world coordinates.

    `font` is what it is drawn with; `substituted` names the wanted font when that is another one
    ("" otherwise); `missing` holds each character that the font lacks, as often as it occurs.
    """

    contours: list[Contour]
    font: str
    substituted: str
    missing: str


def text_strokes(entity: Any, mode: str) -> TextShape:
    """TEXT, ATTRIB, ATTDEF or MTEXT as curves; mode is "outline" or "stroke".

    An ATTDEF shows its tag, or its value when that is constant. Raises Unusable when the text is
    empty or invisible, has no finite size, or needs an outline font where none is installed.
    """
    if entity.dxftype() == "MTEXT":
        return _mtext(entity, entity.doc, mode)
    if entity.dxftype() in ("ATTRIB", "ATTDEF"):
        if entity.is_invisible:
            raise Unusable("is an invisible attribute")
        if entity.has_embedded_mtext_entity:
            return _mtext(entity.virtual_mtext_entity(), entity.doc, mode)
    return _text(entity, mode)


@dataclass(frozen=True, eq=False)
class _Place:
    """(x, y) ↦ origin + x·u + y·v, all (3,)."""

    origin: Floats
    u: Floats
    v: Floats

    def contours(self, ink: Ink) -> list[Contour]:
        axes = np.array([self.u, self.v])
        return [
            Contour([part @ axes + self.origin for part in parts], closed)
            for parts, closed in ink.contours
        ]


def _text(entity: Any, mode: str) -> TextShape:
    """A text on one line."""
    require(entity, ("insert", "height"))
    dxf = entity.dxf
    raw = dxf.tag if entity.dxftype() == "ATTDEF" and not entity.is_const else dxf.text
    runs = _runs(_checked(str(raw)))
    style = _style(entity, entity.doc)
    if style is not None and int(style.dxf.flags) & _STACKED_LETTERS:
        raise Unusable("has its letters one below the other")
    font, substituted = font_for(_wanted(style), mode)
    height, factor, oblique = _numbers(dxf.height, dxf.width, dxf.oblique)
    look = Look(font, height, factor, _slant(oblique))
    width = sum(look.width(run) for run, _ in runs)
    if not (width > 0.0 and height > 0.0):
        raise Unusable("has no size")
    place, stretch = _place(entity, width)
    look = replace(look, height=height * stretch[1], width_factor=factor * stretch[0] / stretch[1])
    ink = Ink()
    x, y = _start(entity, look, width * stretch[0])
    for run, rules in runs:
        x = ink.write(run, replace(look, rules=rules), (x, y))
    return _shape(ink, place, font.name, substituted)


def _runs(raw: str) -> list[tuple[str, Rule]]:
    """The text without its codes: %%c %%d %%p %%% %%nnn are signs; %%u %%o %%k begin and end
    lines along it."""
    from ezdxf.tools.text import caret_decode

    rules, runs, at = Rule.NONE, [], 0
    text = "".join(c if c >= " " else " " for c in caret_decode(raw))
    for code in [*_CODE.finditer(text), None]:
        run = text[at : code.start() if code else None]
        if code:
            at, name = code.end(), code[1].lower()
            sign = _SIGNS.get(name) or (_numbered(name) if name.isdecimal() else "")
            run += sign
        if run:
            runs.append((run, rules))
        if code:
            rules ^= _RULES.get(code[1].lower(), Rule.NONE)
    return runs


def _numbered(digits: str) -> str:
    """%%nnn: a character of Windows' western code page."""
    return bytes([int(digits) & 0xFF]).decode("cp1252", errors="replace")


def _place(entity: Any, width: float) -> tuple[_Place, tuple[float, float]]:
    """Where the alignment point and the axes of a text lie, and how it is stretched (x, y)."""
    dxf = entity.dxf
    mirror = int(dxf.text_generation_flag)
    signs = [-1.0 if mirror & _BACKWARD else 1.0, -1.0 if mirror & _UPSIDE_DOWN else 1.0]
    insert = _numbers(*dxf.insert)
    second = _numbers(*dxf.get("align_point", dxf.insert))
    (turn,) = _numbers(math.radians(dxf.rotation))
    stretch, at = (1.0, 1.0), second
    halign = int(dxf.halign)
    if halign in (_ALIGNED, _FIT):
        length = math.dist(insert[:2], second[:2])
        if length == 0.0:
            raise Unusable("is fitted between two equal points")
        # Mirrored texts of this kind still run from the first point to the second.
        turn = math.atan2(second[1] - insert[1], second[0] - insert[0])
        signs = [1.0, signs[0] * signs[1]]
        stretch = (length / width, length / width if halign == _ALIGNED else 1.0)
        at = insert
    elif halign == 0 and int(dxf.valign) == 0:
        at = insert
    cosine, sine = math.cos(turn), math.sin(turn)
    ocs = entity.ocs()
    u, v, origin = (
        np.array(tuple(ocs.to_wcs(vector)), dtype=np.float64)
        for vector in (
            (signs[0] * cosine, signs[0] * sine, 0.0),
            (-signs[1] * sine, signs[1] * cosine, 0.0),
            tuple(at),
        )
    )
    return _Place(origin, u, v), stretch


def _start(entity: Any, look: Look, width: float) -> tuple[float, float]:
    """Where the baseline begins, seen from the alignment point."""
    halign, valign = int(entity.dxf.halign), int(entity.dxf.valign)
    depth = look.font.descent
    share = {1: 0.5, 2: 1.0, _MIDDLE: 0.5}.get(halign, 0.0)
    if halign == _MIDDLE:
        rise = 0.5 * (1.0 - depth)
    elif halign > _MIDDLE or halign == _ALIGNED:
        rise = 0.0
    else:
        rise = {1: -depth, 2: 0.5, 3: 1.0}.get(valign, 0.0)
    return -share * width, -rise * look.height


def _mtext(entity: Any, document: Any, mode: str) -> TextShape:
    """A text of any number of lines."""
    require(entity, ("insert", "char_height"))
    content = _checked(entity.all_columns_raw_content())
    style = _style(entity, document)
    height, factor, oblique, *_ = _numbers(
        entity.dxf.char_height,
        style.dxf.width if style else 1.0,
        style.dxf.oblique if style else 0.0,
        entity.dxf.line_spacing_factor,
        entity.dxf.get("width", 0.0),
    )
    if not height > 0.0:
        raise Unusable("has no size")
    wanted = _wanted(style)
    font, _ = font_for(wanted, mode)
    look = Look(font, height, factor, _slant(oblique))
    ink, fonts = write_mtext(entity, content, look, (wanted, mode))
    ucs = entity.ucs()
    axes = [np.array(tuple(v), dtype=np.float64) for v in (entity.dxf.insert, ucs.ux, ucs.uy)]
    names = dict.fromkeys(name for name, _ in fonts)
    others = dict.fromkeys(other for _, other in fonts if other)
    return _shape(ink, _Place(*axes), ", ".join(names), ", ".join(others))


def _shape(ink: Ink, place: _Place, font: str, substituted: str) -> TextShape:
    contours = place.contours(ink)
    if not contours and not ink.missing:
        raise Unusable("is empty")
    if not all(np.isfinite(part).all() for contour in contours for part in contour.parts):
        raise Unusable("has numbers that are not finite")
    missing = "".join(sorted(ink.missing.elements()))
    return TextShape(contours, font, substituted, missing)


def _checked(raw: str) -> str:
    if not raw.strip():
        raise Unusable("is empty")
    if len(raw) > MAX_CHARACTERS:
        raise Unusable(f"has more than {MAX_CHARACTERS} characters")
    return raw


def _numbers(*values: float) -> tuple[float, ...]:
    numbers = tuple(float(value) for value in values)
    if not all(map(math.isfinite, numbers)):
        raise Unusable("has numbers that are not finite")
    return numbers


def _slant(oblique_deg: float) -> float:
    """tan of the oblique angle, which CAD programs keep within ±85°."""
    return math.tan(math.radians(max(-85.0, min(85.0, oblique_deg))))


def _style(entity: Any, document: Any) -> Any:
    """The text style that the entity names, None when there is no such style."""
    if document is None:
        return None
    name = entity.dxf.get("style", "Standard")
    return document.styles.get(name) if document.styles.has_entry(name) else None


def _wanted(style: Any) -> Wanted:
    """The font that a text style names."""
    if style is None:
        return Wanted()
    family, italic, bold = style.get_extended_font_data()
    return Wanted(str(style.dxf.font), str(family), bool(bold), bool(italic))
