"""Writing RS274-like text: numbers of fixed decimals by columns, comments that cannot be taken for
words, lines that fit. Shared by the dialects that write words of a letter and a number.

    units = units_of(values_mm, 3)             whole thousandths, half away from zero
    word_of("X", units, written, NumberStyle(3))         a column of words, "X1.500", "X-0.020"
    format_column(values, NumberStyle(3, strip=True))   ["1.5", "-0.02"], never "-0"
    comment("logo (v2).dxf")                   "(logo _v2_.dxf)"
    check_length(data, 80, "line", mend)       PostError for the first longer line

Readers never use this module, writers never `blocks.py`."""

from __future__ import annotations

import re
from typing import Final

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints
from camtool.errors import PostError
from camtool.toolpath.words import WordColumn, line_lengths

MAX_UNITS: Final = 10**15
"""Whole units beyond this are not written: their decimals would no longer be exact in a float."""

VALUES_AT_ONCE: Final = 1 << 16

COMMENT_CHARS: Final = 60

# Letters, digits and signs that mean nothing to any controller. Left out on purpose: ( ) ; % and
# line ends, which end comments or programs; , which makes a comment active in LinuxCNC (MSG, …);
# $ ! ? ~ which grbl obeys wherever they stand; # [ ] < > " which begin parameters and strings.
_UNSAFE: Final = re.compile(r"[^A-Za-z0-9 ._+:/=-]")


class NumberStyle(Struct, frozen=True):
    """Format of a number: digits after the point; `strip` their trailing zeros (and the point if
    nothing follows it)."""

    decimals: int
    strip: bool = False


def units_of(values: Floats, decimals: int) -> Ints:
    """Return values (any shape) as whole units of 10^−decimals, half away from zero.

    ValueError for values that are not finite or too large to be exact."""
    units = np.empty(np.shape(values), dtype=np.int64)
    flat_values, flat_units = np.ravel(values), units.reshape(-1)
    for low in range(0, len(flat_values), VALUES_AT_ONCE):
        batch = slice(low, low + VALUES_AT_ONCE)
        scaled = flat_values[batch] * 10.0**decimals
        if not (np.abs(scaled) <= MAX_UNITS).all():
            raise ValueError("a value is not finite, or too large for its decimals")
        flat_units[batch] = np.sign(scaled) * np.floor(np.abs(scaled) + 0.5)
    return units


def values_of(units: Ints, decimals: int) -> Floats:
    """Return the floats nearest to the decimal numbers of these units, which are what a reader
    must decode."""
    return np.asarray(units / 10.0**decimals)


def word_of(letter: str, units: Ints, written: Bools, style: NumberStyle) -> WordColumn:
    """Return the words of a letter: numbers of whole units (M,), and in which blocks they are
    written (M,)."""
    return WordColumn(letter, units, written, style.decimals, 0 if style.strip else None)


def format_column(values: Floats, style: NumberStyle) -> list[str]:
    """Return values (N,) rounded to the style's decimals, as N texts; ValueError as `units_of`.
    Zero has no minus."""
    return [
        _digits_of(value, style)
        for value in values_of(units_of(values, style.decimals), style.decimals)
    ]


def _digits_of(value: float, style: NumberStyle) -> str:
    text = f"{value:.{style.decimals}f}"
    return text.rstrip("0").rstrip(".") if style.strip and style.decimals > 0 else text


def format_number(value: float, style: NumberStyle) -> str:
    """Return a number as text, rounded to the style's decimals; ValueError as `units_of`."""
    return format_column(np.array([value]), style)[0]


def comment(text: str) -> str:
    """Return `text` as a comment that may stand in any program: ASCII letters, digits, spaces and
    ._+:/=- only.

    Every other character becomes _ (line ends and tabs a space); runs of spaces become one; cut to
    `COMMENT_CHARS`. It cannot end a comment, begin one, or be obeyed by a controller within one.
    """
    flat = " ".join(text.split())
    return f"({_UNSAFE.sub('_', flat)[:COMMENT_CHARS].strip()})"


def check_length(data: bytes, max_chars: int, unit: str, mend: str) -> None:
    """Raise PostError for the first line of more than `max_chars` characters, without its line
    end; `unit` is what messages call a line."""
    lengths = line_lengths(data)
    if (lengths > max_chars).any():
        index = int((lengths > max_chars).argmax())
        raise PostError(
            f"a {unit} of {lengths[index]} characters, the controller takes {max_chars}",
            where=f"{unit} {index + 1}",
            mend=mend,
        )
