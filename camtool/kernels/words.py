"""Words of program text: letters and decimal numbers, written and read by columns.

A number is a count of whole units of its last decimal, so nothing is rounded here. Compiled,
because a program has millions of digits; C types stand in the .pxd beside this file.
"""

from __future__ import annotations

from camtool.arrays import Ints, Octets

DIGITS, DECIMALS, KEPT, PLUS = range(4)
"""Columns of a style: least digits before the point, decimals, how many of these stay where they
are 0, and whether numbers that are not negative have a sign too."""

STYLE_COLUMNS = 4
"""How many columns."""

MOST_NUMBER = 48
"""No number has more characters: sign, 20 digits, point, and digits that a style adds."""

_ZERO, _POINT, _PLUS, _MINUS, _BLANK = 48, 46, 43, 45, 32


def _put_number(value: int, style: Ints, out: Octets, at: int) -> int:
    """Write a number to `out` from `at` on; where it ends."""
    size, decimals = abs(value), int(style[DECIMALS])
    if value < 0 or style[PLUS] != 0:
        out[at] = _MINUS if value < 0 else _PLUS
        at += 1
    while decimals > style[KEPT] and size % 10 == 0:
        size //= 10
        decimals -= 1
    digits, rest = 1, size // 10
    while rest > 0:
        digits, rest = digits + 1, rest // 10
    digits = max(digits, decimals + int(style[DIGITS]))
    end = at + digits + (1 if decimals > 0 else 0)
    k = end - 1
    for place in range(digits):
        if place == decimals and decimals > 0:
            out[k] = _POINT
            k -= 1
        out[k] = _ZERO + size % 10
        size //= 10
        k -= 1
    return end


def put_words(
    values: Ints,
    written: Octets,
    fixed: Octets,
    fixed_ends: Ints,
    styles: Ints,
    blanks: bool,
    out: Octets,
    ends: Ints,
) -> None:
    """Write M rows of up to K words to `out`, which has room; `ends` (M,) is filled.

    values (M, K) whole units; written (M, K): 1 for words that a row has; `fixed`: what stands
    before the numbers, and last what ends a row that has words, cut at fixed_ends (K + 1,); styles
    (K, 4); `blanks`: whether words are parted by one.
    """
    columns, at = len(styles), 0
    for row in range(len(values)):
        begin = at
        for column in range(columns):
            if not written[row, column]:
                continue
            if blanks and at > begin:
                out[at] = _BLANK
                at += 1
            for k in range(fixed_ends[column - 1] if column > 0 else 0, fixed_ends[column]):
                out[at] = fixed[k]
                at += 1
            at = _put_number(values[row, column], styles[column], out, at)
        if at > begin:
            for k in range(fixed_ends[columns - 1], fixed_ends[columns]):
                out[at] = fixed[k]
                at += 1
        ends[row] = at
