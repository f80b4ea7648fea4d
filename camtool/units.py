"""Lengths, angles, feeds and times with their units, converted to plain floats on input.

Inside camtool everything is mm, seconds and radians; feeds are mm/min in toolpaths."""

from __future__ import annotations

import math
import re

from camtool.errors import OptionError

UM_PER_MM = 1000.0

MM_PER_UNIT: dict[str, float] = {
    "mm": 1.0,
    "um": 0.001,
    "µm": 0.001,
    "μm": 0.001,
    "cm": 10.0,
    "m": 1000.0,
    "in": 25.4,
    '"': 25.4,
    "ft": 304.8,
    "pt": 25.4 / 72.0,
    "pc": 25.4 / 6.0,
    "q": 0.25,
    "px": 25.4 / 96.0,
}
"""Units of lengths that a user may write, in mm (pt, pc, q, and px at 96 dpi as in CSS 2.1)."""

RAD_PER_UNIT: dict[str, float] = {"deg": math.pi / 180.0, "°": math.pi / 180.0, "rad": 1.0}

S_PER_UNIT: dict[str, float] = {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0}

_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_COMMA = re.compile(r"\s*([+-]?\d+),(\d+\s*[^\d\s,]*)\s*")
_QUANTITY = re.compile(rf"\s*({_NUMBER})(?:\s*/\s*({_NUMBER}))?\s*([^\d\s].*?)?\s*")


def parse_length(text: str, *, name: str = "length") -> float:
    """Parse `"0.2mm"`, `"1/8in"`, `"200 um"` or a bare number (mm) to mm.

    Raises OptionError for anything else, for infinities and for NaN.

    >>> parse_length("1/8in"), parse_length("200um"), parse_length("3")
    (3.175, 0.2, 3.0)
    """
    value, unit = _split(text, name)
    if not unit and "/" in text:
        # A fraction suggests inches, a bare number is mm: either may be meant.
        number_text = text.strip()
        raise OptionError(
            f"{name} {text!r} has no unit",
            mend=f"write {number_text}in, or {number_text}mm if that is meant",
        )
    factor = MM_PER_UNIT.get(unit.lower() or "mm")
    if factor is None:
        units = ", ".join(u for u in MM_PER_UNIT if u.isascii() and u != '"')
        raise OptionError(f"unknown unit {unit!r} in {name} {text!r}", mend=f"use one of {units}")
    return value * factor


def parse_feed(text: str) -> float:
    """Parse `"0.8"`, `"0.8mm/min"`, `"2 in/min"` or `"0.01mm/s"` to mm/min.

    >>> parse_feed("0.8mm/min"), parse_feed("0.01 mm/s")
    (0.8, 0.6)
    """
    value, unit = _split(text, "feed")
    length, _, per = (unit or "mm/min").partition("/")
    minutes = {"min": 1.0, "s": 60.0}.get(per.strip())
    factor = MM_PER_UNIT.get(length.strip().lower())
    if minutes is None or factor is None:
        raise OptionError(f"unknown unit {unit!r} in feed {text!r}", mend="use mm/min or mm/s")
    return value * factor * minutes


def parse_angle(text: str) -> float:
    """Parse `"30"`, `"30deg"`, `"30°"` or `"0.5rad"` to rad: a bare number is degrees.

    >>> parse_angle("180deg"), parse_angle("0.5 rad")
    (3.141592653589793, 0.5)
    """
    value, unit = _split(text, "angle")
    factor = RAD_PER_UNIT.get(unit.lower() or "deg")
    if factor is None:
        raise OptionError(f"unknown unit {unit!r} in angle {text!r}", mend="use deg or rad")
    return value * factor


def parse_time(text: str) -> float:
    """Parse `"0.5"`, `"0.5s"`, `"200ms"`, `"1min"` or `"1h"` to s: a bare number is seconds.

    >>> parse_time("0.5"), parse_time("200 ms")
    (0.5, 0.2)
    """
    value, unit = _split(text, "time")
    factor = S_PER_UNIT.get(unit.lower() or "s")
    if factor is None:
        raise OptionError(f"unknown unit {unit!r} in time {text!r}", mend="use s, ms, min or h")
    return value * factor


def _split(text: str, name: str) -> tuple[float, str]:
    """Split a text into its number and its unit; OptionError, which names the quantity `name`, if
    it has no number."""
    comma = _COMMA.fullmatch(text)
    if comma is not None:
        raise OptionError(
            f"{name} {text!r} has a comma", mend=f"write {comma[1]}.{comma[2]} with a point"
        )
    match = _QUANTITY.fullmatch(text)
    if match is None:
        raise OptionError(f"{name} {text!r} is no number", mend='write it like "0.2mm"')
    value = float(match[1])
    if match[2] is not None:
        divisor = float(match[2])
        if divisor == 0.0:
            raise OptionError(f"{name} {text!r} divides by zero")
        value /= divisor
    if not math.isfinite(value):
        raise OptionError(f"{name} {text!r} is not finite")
    return value, match[3] or ""


def clock(seconds: float) -> str:
    """Return seconds as h:mm:ss, rounded to the second.

    >>> clock(3725.4)
    '1:02:05'
    """
    total = round(seconds)
    return f"{total // 3600}:{total // 60 % 60:02d}:{total % 60:02d}"
