"""SVG text: numbers, escaping, elements and path data.

There is one form of everything, so that equal input gives equal bytes: fixed decimals
without trailing zeros, attributes in the order given, one element a line."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from io import StringIO

LENGTH_DECIMALS = 2
"""Decimals of lengths on the page (units of the viewBox, 1000 across)."""

MM_DECIMALS = 9
"""Decimals of coordinates in mm: enough for renderers to find the centre of a half circle from its
ends."""

_NO_XML = "\N{REPLACEMENT CHARACTER}"

_NOT_XML = "[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]"
"""Characters that XML 1.0 (fifth edition, §2.2) does not allow.

Compiled at first use, because the help loads this file too, and compiling takes 4 ms."""

Attributes = Mapping[str, str | float]
Look = dict[str, str | float]


def number(value: float, decimals: int = LENGTH_DECIMALS) -> str:
    """Return the shortest text of `value` at these decimals; ValueError when it is not finite.

    >>> number(2.50), number(-0.001), number(1e-7, 9)
    ('2.5', '0', '0.0000001')
    """
    if not math.isfinite(value):
        raise ValueError(f"{value} cannot be drawn")
    text = f"{value:.{decimals}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def clean(text: str) -> str:
    """Return the text with "�" in place of what XML 1.0 cannot hold: control characters, lone
    surrogates."""
    return re.sub(_NOT_XML, _NO_XML, text)


def one_line(text: str) -> str:
    """Return the text with every run of white space replaced by one space."""
    return " ".join(text.split())


def escape(text: str) -> str:
    """Return the text escaped for use between tags and inside a double-quoted attribute."""
    escaped = clean(text).replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")
    escaped = escaped.replace('"', "&quot;")
    # XML readers turn other white space in attributes into blanks.
    return escaped.replace("\n", "&#10;").replace("\r", "&#13;").replace("\t", "&#9;")


def element(name: str, attributes: Attributes, *children: str) -> str:
    """Write an SVG element. Strings among the attributes are escaped; children are SVG already."""
    head = name + "".join(f' {key}="{_value(value)}"' for key, value in attributes.items())
    inner = [child for child in children if child]
    if not inner:
        return f"<{head}/>"
    return "\n".join([f"<{head}>", *inner, f"</{name}>"])


def title(text: str) -> str:
    """Return a `<title>` element, which tells people and screen readers what its parent shows."""
    return f"<title>{escape(text)}</title>"


def _value(value: str | float) -> str:
    return escape(value) if isinstance(value, str) else number(value, MM_DECIMALS)


class PathData:
    """The `d` of a path, command by command, coordinates at fixed decimals."""

    def __init__(self, decimals: int = LENGTH_DECIMALS) -> None:
        self._decimals = decimals
        self._text = StringIO()

    def __str__(self) -> str:
        return self._text.getvalue()

    def __bool__(self) -> bool:
        return self._text.tell() > 0

    def move(self, x: float, y: float) -> None:
        """Begin a new subpath at this point."""
        self._add("M", x, y)

    def line(self, x: float, y: float) -> None:
        """Add a straight line to this point."""
        self._add("L", x, y)

    def arc(self, x: float, y: float, *, radius: float, sweep_rad: float) -> None:
        """Add a circular arc to this point, |sweep| < 2π; a positive sweep turns from +X towards
        +Y.

        In SVG, large-arc is 1 for |sweep| > π, and sweep-flag is 1 for growing angles."""
        size = number(radius, self._decimals)
        large, growing = int(abs(sweep_rad) > math.pi), int(sweep_rad > 0.0)
        end = f"{number(x, self._decimals)} {number(y, self._decimals)}"
        self._text.write(f"A{size} {size} 0 {large} {growing} {end}")

    def close(self) -> None:
        """Close the subpath by a straight line to its beginning."""
        self._text.write("Z")

    def _add(self, command: str, x: float, y: float) -> None:
        self._text.write(f"{command}{number(x, self._decimals)} {number(y, self._decimals)}")
