"""Moves of a pic-mmh program read from its bytes: G00 to G03 in their fixed widths, many in a row.

Whole numbers only. Compiled, because a program has millions of digits; C types stand in the .pxd
beside this file.
"""

from __future__ import annotations

from camtool.arrays import Ints, Octets

X, Y, Z, CENTRE_X, CENTRE_Y, FEED, CODE, DEEP, LENGTH = range(9)
"""Columns of a block: its coordinates in the last decimal's units and its feed word, undefined
where it has none; the number of its G; whether it is one of Z; its characters without the blanks
around it and its ;."""

COLUMNS = 9

WHOLE_DIGITS, DECIMALS, FEED_DIGITS = 5, 2, 2
"""Digits of a coordinate, after the point (in the example form alone), and of a feed."""

_BLANK, _TAB, _LF, _CR, _PLUS, _MINUS, _POINT, _ZERO, _END = 32, 9, 10, 13, 43, 45, 46, 48, 59
_F, _G, _I, _J, _X, _Y, _Z = 70, 71, 73, 74, 88, 89, 90


def _is_blank(sign: int) -> bool:
    return sign in (_BLANK, _TAB, _LF, _CR)


def _digits(data: Octets, at: int, count: int, number: int) -> int:
    """The number with so many digits more, −1 where they are none; they lie within the data."""
    for k in range(at, at + count):
        if not _ZERO <= data[k] < _ZERO + 10:
            return -1
        number = number * 10 + (data[k] - _ZERO)
    return number


def _coordinate(data: Octets, at: int, letter: int, annex: bool, block: Ints, column: int) -> int:
    """Read a word; where it ends, or −1 when it is none of this letter in this form."""
    longest = 2 + WHOLE_DIGITS + 1 + DECIMALS
    if at < 0 or at + longest > len(data) or data[at] != letter:
        return -1
    at += 1
    signed = data[at] == _MINUS or data[at] == _PLUS
    if annex and not signed:
        return -1
    negative = data[at] == _MINUS
    at += 1 if signed else 0
    number = _digits(data, at, WHOLE_DIGITS, 0)
    at += WHOLE_DIGITS
    if not annex:
        if number < 0 or data[at] != _POINT:
            return -1
        number = _digits(data, at + 1, DECIMALS, number)
        at += 1 + DECIMALS
    if number < 0:
        return -1
    block[column] = -number if negative else number
    return at


def _move(data: Octets, at: int, annex: bool, block: Ints) -> int:
    """Read a move; where its last word ends, or −1 when it is none or its feed is 0."""
    size = len(data)
    if at + 4 > size or data[at] != _G or data[at + 1] != _ZERO:
        return -1
    code = data[at + 2] - _ZERO
    if code < 0 or code > 3:
        return -1
    at += 3
    deep = data[at] == _Z and code < 2
    block[CODE], block[DEEP] = code, 1 if deep else 0
    if deep:
        at = _coordinate(data, at, _Z, annex, block, Z)
    else:
        at = _coordinate(data, at, _X, annex, block, X)
        at = _coordinate(data, at, _Y, annex, block, Y)
        if code > 1:
            at = _coordinate(data, at, _I, annex, block, CENTRE_X)
            at = _coordinate(data, at, _J, annex, block, CENTRE_Y)
    if at < 0 or code == 0:
        return at
    if at + 1 + FEED_DIGITS > size or data[at] != _F:
        return -1
    block[FEED] = _digits(data, at + 1, FEED_DIGITS, 0)
    return at + 1 + FEED_DIGITS if block[FEED] > 0 else -1


def moves_in_a_row(data: Octets, at: int, annex: bool, blocks: Ints) -> tuple[int, int]:
    """Read blocks from `at` on into blocks (R, 9), no more than these, up to the first that is no
    move of this form with a feed above 0, where it needs one: how many, and where it stopped."""
    rows, size = 0, len(data)
    while rows < len(blocks):
        first = at
        while first < size and _is_blank(data[first]):
            first += 1
        last = _move(data, first, annex, blocks[rows])
        end = last
        while 0 <= end < size and _is_blank(data[end]):
            end += 1
        if end < 0 or end >= size or data[end] != _END:
            break
        blocks[rows, LENGTH] = last - first
        at = end + 1
        rows += 1
    return rows, at
