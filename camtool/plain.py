"""Untrusted text (names of drawings, layers, files, machines) made safe to print.

A terminal obeys control characters: an escape sequence in a layer's name may move the cursor,
rename the window or write to the clipboard (ECMA-48), and an override of the writing direction
makes a name look like another one (Unicode Standard Annex 9). Characters that cannot be seen are
shown as escapes. JSON text has JSON's own escapes instead, so that its reader gets the exact name.
"""

from __future__ import annotations

import re
from typing import Any
from unicodedata import category

MAX_WORD_CHARS = 200
"""Characters; longer words are shortened to their beginning and end."""

MAX_LINE_CHARS = 2000
"""Characters; longer lines are shortened to their beginning and end."""

_LONG = re.compile(rf"\S{{{MAX_WORD_CHARS + 1},}}")
_BYTES_FROM = 0xDC00
"""The surrogate by which Python represents byte 0 of a file name in another encoding."""

_INVISIBLE = re.compile(
    "[\x7f-\x9f\xad\u061c\u180e\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\ufff9-\ufffb"
    "\ud800-\udfff\U0001d173-\U0001d17a\U000e0000-\U000e0fff]"
)
"""Invisible characters that JSON leaves as they are: control and format characters, halves of
surrogate pairs."""


def one_line(text: str) -> str:
    r"""Return the text as one line without invisible characters, long words and lines shortened.

    >>> print(one_line("a\x1b[2Jb\nc"), one_line("x" * 1000)[118:124])
    a\x1b[2Jb\nc xx…xxx
    """
    shown = text if text.isprintable() else "".join(map(_visible, text))
    if len(shown) > MAX_WORD_CHARS:
        shown = _LONG.sub(lambda match: _shortened(match[0], MAX_WORD_CHARS), shown)
    return shown if len(shown) <= MAX_LINE_CHARS else _shortened(shown, MAX_LINE_CHARS)


def to_json(value: Any, indent: int = 2) -> str:
    """Format records, lists, tables and scalars as JSON text that ends with a line break, on one
    line if `indent` is 0; bytes of names that are not text appear as \\udcXX."""
    import json

    import msgspec

    try:
        text = msgspec.json.format(msgspec.json.encode(value), indent=indent).decode()
    except UnicodeEncodeError:
        text = json.dumps(msgspec.to_builtins(value), indent=indent or None, ensure_ascii=False)
    return _INVISIBLE.sub(lambda match: json.dumps(match[0])[1:-1], text) + "\n"


def _visible(char: str) -> str:
    if char.isprintable() or category(char) == "Zs":
        return char
    number = ord(char)
    if _BYTES_FROM + 0x80 <= number <= _BYTES_FROM + 0xFF:
        return f"\\x{number - _BYTES_FROM:02x}"
    return char.encode("unicode_escape", "surrogatepass").decode()


def _shortened(text: str, length: int) -> str:
    head = 3 * length // 5
    return f"{text[:head]}…{text[head + 1 - length :]}"


def embedded_address(svg: bytes) -> str:
    """Return a data URI of an SVG, for embedding it in a page."""
    import base64

    return f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
