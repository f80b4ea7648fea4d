"""Letters put side by side on a plane of their own: x along the line, y up, in drawing units."""

from __future__ import annotations

import math
import re
from collections import Counter
from dataclasses import dataclass, field
from enum import IntFlag

import numpy as np

from camtool.geometry.polylines import Floats
from camtool.importers.dxf.frames import Unusable
from camtool.importers.text.fonts import Font

RULE_SHARE = 0.07
"""Thickness of an underline or a fraction bar in outlines, as a share of the letters' height."""

RULE_DROP = 0.2
"""How far an underline lies below the baseline, an overline above the capitals (same share)."""

NUMBERED = re.compile(r"%%(03[2-9]|0[4-9]\d|1\d\d|2[0-4]\d|25[0-5])", re.ASCII)
"""A character by its number, 32 to 255."""

MAX_CHARACTERS = 20_000
"""Of one text, codes included; CAD programs write 250 into TEXT and about 2000 into MTEXT by
hand."""

MAX_SIGNS_NAMED = 20
"""So many of the characters that a font lacks are named."""

MAX_NUMBER = 1e60
"""Sizes and places beyond it are refused: products of a few of them would not be finite."""

MAX_OBLIQUE_DEG = 85.0
"""Letters lean no further; CAD programs refuse more."""


def finite(*values: float) -> tuple[float, ...]:
    """The values as floats; Unusable when one is none or beyond all bounds."""
    numbers = tuple(float(value) for value in values)
    if not all(abs(number) <= MAX_NUMBER for number in numbers):
        raise Unusable("has numbers that are not finite or beyond all bounds")
    return numbers


def lacking(font: str, substituted: str, missing: str) -> str:
    """What was wanted and could not be had, "" when nothing: `font` draws in place of the font
    `substituted` ("" when it is the wanted one) and has none of the characters `missing`."""
    said = []
    if substituted:
        said.append(f"font {substituted} is not here: drawn with {font}")
    if missing:
        signs = [_visible(sign) for sign in dict.fromkeys(missing)]
        more = len(signs) - MAX_SIGNS_NAMED
        tail = f" and {more} more" if more > 0 else ""
        said.append(f"{font} has no {' '.join(signs[:MAX_SIGNS_NAMED])}{tail}: left blank")
    return "; ".join(said)


def _visible(sign: str) -> str:
    return sign if sign.isprintable() and not sign.isspace() else f"U+{ord(sign):04X}"


def slant(oblique_deg: float) -> float:
    """tan of an oblique angle."""
    return math.tan(math.radians(max(-MAX_OBLIQUE_DEG, min(MAX_OBLIQUE_DEG, oblique_deg))))


def numbered(digits: str) -> str:
    """What %%nnn stands for: a character of Windows' western code page."""
    return bytes([int(digits)]).decode("cp1252", errors="replace")


class Rule(IntFlag):
    """Lines along a text."""

    NONE = 0
    UNDER = 1
    THROUGH = 2
    OVER = 4


@dataclass(frozen=True, eq=False)
class Look:
    """How letters look: `height` of a capital, `slant` = tan(oblique angle)."""

    font: Font
    height: float
    width_factor: float = 1.0
    slant: float = 0.0
    tracking: float = 1.0
    rules: Rule = Rule.NONE

    def advance(self, character: str) -> float:
        """From this letter to the next."""
        letter = self.font.letter(character)
        share = self.font.blank if letter is None else letter.advance
        return share * self.height * self.width_factor * self.tracking

    def width(self, text: str) -> float:
        """Of a whole text on one line."""
        return sum(self.advance(character) for character in text)


@dataclass(eq=False)
class Ink:
    """What has been drawn: `points` (n, 2) of all parts in turn; each contour as the counts of
    points of its parts, and whether it is closed; the characters that fonts lack."""

    points: list[Floats] = field(default_factory=list)
    contours: list[tuple[tuple[int, ...], bool]] = field(default_factory=list)
    missing: Counter[str] = field(default_factory=Counter)

    def write(self, text: str, look: Look, at: tuple[float, float]) -> float:
        """Draw `text` with its baseline's left end at `at`; the x where the next text begins."""
        x, y = at
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

    def rule(self, look: Look, span: tuple[float, float], baseline: float) -> None:
        """The lines that `look` draws along a text from x to x."""
        shares = {Rule.UNDER: -RULE_DROP, Rule.THROUGH: 0.5, Rule.OVER: 1.0 + RULE_DROP}
        for rule, share in shares.items():
            if look.rules & rule and span[1] > span[0]:
                y = baseline + share * look.height
                self.line(look, (span[0], y), (span[1], y))

    def line(self, look: Look, start: tuple[float, float], end: tuple[float, float]) -> None:
        """A straight line: one stroke, or a thin bar among outlines."""
        ends = np.array([start, end], dtype=np.float64)
        if not look.font.outlines:
            self.points.append(ends)
            self.contours.append(((2,), False))
            return
        along = ends[1] - ends[0]
        half = 0.5 * RULE_SHARE * look.height / float(np.hypot(*along))
        aside = half * np.array([-along[1], along[0]])
        corners = np.array([ends[0] - aside, ends[1] - aside, ends[1] + aside, ends[0] + aside])
        self.points.append(corners[[0, 1, 1, 2, 2, 3, 3, 0]])
        self.contours.append(((2, 2, 2, 2), True))
