"""TEXT, ATTRIB, ATTDEF and MTEXT of DXF drawings as curves in world coordinates.

Alignment follows what CAD programs store: a line is as wide as its letters advance, BOTTOM lies
below the baseline by the depth of "p", MIDDLE halfway between that and the top of the capitals
(the two alignment points of drawings saved by AutoCAD agree with it to 3 digits)."""

from __future__ import annotations

import math
import re
import unicodedata
from itertools import accumulate, pairwise
from typing import Any

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.importers.dxf.load import printable
from camtool.importers.dxf.mtext import write_mtext
from camtool.importers.dxf.shapes import require
from camtool.importers.pieces import Unusable
from camtool.importers.text import (
    MAX_CHARACTERS,
    NUMBERED,
    Ink,
    Rule,
    TextLook,
    WantedFont,
    character_of_number,
    describe_lacking,
    finite,
    font_for,
    slant,
)
from camtool.records import replace

_CARET = re.compile(r"\^([ @-_])")
_CODE = re.compile(NUMBERED.pattern + "|%%([cdpkou%])", re.ASCII | re.IGNORECASE)
_SIGNS = {"c": "Ø", "d": "°", "p": "±", "%": "%"}
_RULES = {"u": Rule.UNDER, "o": Rule.OVER, "k": Rule.THROUGH}
_ALIGNED, _MIDDLE, _FIT = 3, 4, 5
_BACKWARD, _UPSIDE_DOWN = 2, 4
_STACKED_LETTERS = 4


class TextContour(Struct, frozen=True, eq=False):
    """A contour of a letter: parts (k, 3) of control points, k = 2 (line), 3 (quadratic) or 4
    (cubic), end to end."""

    parts: list[Floats]
    closed: bool


class TextShape(Struct, frozen=True, eq=False):
    """The curves of a text, in world coordinates, and the font that they are drawn with.

    `substituted` names the wanted font if it is another one, else ""; `missing` holds each
    character that the font lacks, as often as it occurs."""

    contours: list[TextContour]
    font: str
    substituted: str
    missing: str

    @property
    def lacks(self) -> str:
        """The font or characters that are not available, in words; "" if all are."""
        return describe_lacking(self.font, self.substituted, self.missing)


def text_strokes(entity: Any, mode: str) -> TextShape:
    """Return a TEXT, ATTRIB, ATTDEF or MTEXT as curves; mode is "outline" or "stroke".

    An ATTDEF shows its tag, or its value when that is constant. Raises Unusable when the text is
    empty or invisible, has no finite size, or needs an outline font where none is installed."""
    if entity.dxftype() == "MTEXT":
        return _mtext(entity, entity.doc, mode)
    if entity.dxftype() in ("ATTRIB", "ATTDEF"):
        if entity.is_invisible:
            raise Unusable("is an invisible attribute")
        if entity.has_embedded_mtext_entity:
            return _mtext(entity.virtual_mtext_entity(), entity.doc, mode)
    return _text(entity, mode)


class _Place(Struct, frozen=True, eq=False):
    """The plane of a text in the world: (x, y) ↦ origin + x·u + y·v, all (3,)."""

    origin: Floats
    u: Floats
    v: Floats

    def contours(self, ink: Ink) -> list[TextContour]:
        if not ink.points:
            return []
        points = np.concatenate(ink.points) @ np.array([self.u, self.v]) + self.origin
        contours, pen = [], 0
        for counts, closed in ink.contours:
            ends = list(accumulate(counts, initial=pen))
            parts = [points[start:end] for start, end in pairwise(ends)]
            contours.append(TextContour(parts, closed))
            pen = ends[-1]
        return contours


def _text(entity: Any, mode: str) -> TextShape:
    """Return the curves of a text on one line: TEXT, ATTRIB or ATTDEF."""
    require(entity, ("insert", "height"))
    dxf = entity.dxf
    raw = dxf.tag if entity.dxftype() == "ATTDEF" and not entity.is_const else dxf.text
    runs = _runs(_checked(str(raw)))
    style = _style(entity, entity.doc)
    if style is not None and int(style.dxf.flags) & _STACKED_LETTERS:
        raise Unusable("has its letters one below the other")
    font, substituted = font_for(_wanted_font(style), mode)
    height, factor, oblique = finite(dxf.height, dxf.width, dxf.oblique)
    look = TextLook(font, height, factor, slant(oblique))
    width = sum(look.width(run) for run, _ in runs)
    if not (width > 0.0 and height > 0.0):
        raise Unusable("has no size")
    place, stretch = _place(entity, width)
    size, share = finite(height * stretch[1], factor * stretch[0] / stretch[1])
    look = replace(look, height=size, width_factor=share)
    ink = Ink()
    x, y = _start(entity, look, width * stretch[0])
    for run, rules in runs:
        end = ink.write(run, look, (x, y))
        ink.rule(replace(look, rules=rules), (x, end), y)
        x = end
    return _shape(ink, place, font.name, substituted)


def _runs(raw: str) -> list[tuple[str, Rule]]:
    """Split a text at its codes into parts, each with the lines drawn along it.

    %%c %%d %%p %%% %%nnn are characters; %%u %%o %%k begin and end underline, overline and
    strike-through."""
    rules, runs, position = Rule.NONE, [], 0
    text = "".join(c if c >= " " else " " for c in _CARET.sub(_control, raw))
    for code in [*_CODE.finditer(text), None]:
        run = text[position : code.start() if code else None]
        if code:
            position = code.end()
            run += character_of_number(code[1]) if code[1] else _SIGNS.get(code[2].lower(), "")
        if run:
            runs.append((run, rules))
        if code and code[2]:
            rules ^= _RULES.get(code[2].lower(), Rule.NONE)
    return runs


def _control(match: re.Match[str]) -> str:
    """Return the character of a caret code: ^I is a tab and so on; "^ " is the caret itself."""
    return "^" if match[1] == " " else chr(ord(match[1]) - ord("@"))


def _place(entity: Any, width: float) -> tuple[_Place, tuple[float, float]]:
    """Return the plane of a text, whose origin is its alignment point, and the factors (x, y) by
    which it is stretched to fit between two points."""
    dxf = entity.dxf
    mirror = int(dxf.text_generation_flag)
    signs = [-1.0 if mirror & _BACKWARD else 1.0, -1.0 if mirror & _UPSIDE_DOWN else 1.0]
    insert = finite(*dxf.insert)
    second = finite(*dxf.get("align_point", dxf.insert))
    (turn,) = finite(math.radians(dxf.rotation))
    stretch, anchor = (1.0, 1.0), second
    halign = int(dxf.halign)
    if halign in (_ALIGNED, _FIT):
        length = math.dist(insert[:2], second[:2])
        if length == 0.0:
            raise Unusable("is fitted between two equal points")
        # Mirrored texts of this kind still run from the first point to the second.
        turn = math.atan2(second[1] - insert[1], second[0] - insert[0])
        signs = [1.0, signs[0] * signs[1]]
        stretch = (length / width, length / width if halign == _ALIGNED else 1.0)
        anchor = insert
    elif halign == 0 and int(dxf.valign) == 0:
        anchor = insert
    cosine, sine = math.cos(turn), math.sin(turn)
    if not any(finite(*dxf.extrusion)):
        raise Unusable("has an extrusion of 0")
    ocs = entity.ocs()
    u, v, origin = (
        np.array(tuple(ocs.to_wcs(vector)), dtype=np.float64)
        for vector in (
            (signs[0] * cosine, signs[0] * sine, 0.0),
            (-signs[1] * sine, signs[1] * cosine, 0.0),
            tuple(anchor),
        )
    )
    return _Place(origin, u, v), stretch


def _start(entity: Any, look: TextLook, width: float) -> tuple[float, float]:
    """Return the start of the baseline, relative to the alignment point, of a text of this
    width."""
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
    """Return the curves of an MTEXT."""
    require(entity, ("insert", "char_height"))
    content = _checked(entity.all_columns_raw_content())
    style = _style(entity, document)
    height, factor, oblique, *_ = finite(
        entity.dxf.char_height,
        style.dxf.width if style else 1.0,
        style.dxf.oblique if style else 0.0,
        entity.dxf.line_spacing_factor,
        entity.dxf.get("width", 0.0),
    )
    if not height > 0.0:
        raise Unusable("has no size")
    requested = _wanted_font(style)
    font, _ = font_for(requested, mode)
    look = TextLook(font, height, factor, slant(oblique))
    ink, fonts = write_mtext(entity, content, look, (requested, mode))
    names = dict.fromkeys(name for name, _ in fonts)
    other_names = dict.fromkeys(other for _, other in fonts if other)
    return _shape(ink, _block(entity), ", ".join(names), ", ".join(other_names))


def _block(entity: Any) -> _Place:
    """Return the plane of an MTEXT, whose origin is its insertion point."""
    insert = np.array(finite(*entity.dxf.insert))
    normal, along = (finite(*v) for v in (entity.dxf.extrusion, entity.get_text_direction()))
    rise = np.cross(normal, along)
    sizes = math.hypot(*along), math.hypot(*rise)
    if not min(sizes) > 0.0:
        raise Unusable("has no direction")
    return _Place(insert, np.array(along) / sizes[0], rise / sizes[1])


def _shape(ink: Ink, place: _Place, font: str, substituted: str) -> TextShape:
    contours = place.contours(ink)
    if not contours and not ink.missing:
        raise Unusable("is empty")
    missing = "".join(sorted(ink.missing.elements()))
    return TextShape(contours, font, printable(substituted), missing)


def _checked(raw: str) -> str:
    if not raw.strip():
        raise Unusable("is empty")
    if len(raw) > MAX_CHARACTERS:
        raise Unusable(f"has more than {MAX_CHARACTERS} characters")
    return unicodedata.normalize("NFC", raw)


def _style(entity: Any, document: Any) -> Any:
    """Return the text style that the entity names; None if the document has no such style."""
    if document is None:
        return None
    name = entity.dxf.get("style", "Standard")
    return document.styles.get(name) if document.styles.has_entry(name) else None


def _wanted_font(style: Any) -> WantedFont:
    """Return the font that a text style names."""
    if style is None:
        return WantedFont()
    family, italic, bold = style.get_extended_font_data()
    return WantedFont(str(style.dxf.font), str(family), bool(bold), bool(italic))
