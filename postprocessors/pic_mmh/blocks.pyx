"""Moves of a pic-mmh program read from its bytes: G00 to G03 in their fixed widths, many in a row.

Whole numbers only. Compiled, because a program has millions of digits.
"""

from __future__ import annotations

from camtool.kernels.types cimport Int

from camtool.arrays import Ints, Octets

cpdef enum:
    # Columns of a block: its coordinates in the last decimal's units and its feed word, undefined
    # where it has none; the number of its G; whether it is one of Z; its characters without the
    # blanks around it and its ;.
    X = 0, Y, Z, CENTRE_X, CENTRE_Y, FEED, CODE, DEEP, LENGTH
    COLUMNS = 9
    # Digits of a coordinate, after the point (in the example form alone), and of a feed.
    WHOLE_DIGITS = 5, DECIMALS = 2, FEED_DIGITS = 2
    _BLANK = 32, _TAB = 9, _LF = 10, _CR = 13, _PLUS = 43, _MINUS = 45, _POINT = 46, _ZERO = 48,
    _END = 59
    _F = 70, _G = 71, _I = 73, _J = 74, _X = 88, _Y = 89, _Z = 90


cdef inline bint _is_blank(Int sign) noexcept:
    return sign in (_BLANK, _TAB, _LF, _CR)


cdef inline Int _digits(const unsigned char[::1] data, Int at, Int count, Int number) noexcept:
    """Return a number with `count` more digits from `at` appended, −1 where they are no digits;
    they lie within the data."""
    cdef Int k
    for k in range(at, at + count):
        if not _ZERO <= data[k] < _ZERO + 10:
            return -1
        number = number * 10 + (data[k] - _ZERO)
    return number


cdef Int _coordinate(
    const unsigned char[::1] data, Int at, Int letter, bint annex, Int[::1] block, Int column
) noexcept:
    """Read a word; return where it ends, −1 when it is no word of this letter in this form."""
    cdef Int longest, number
    cdef bint signed, negative
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


cdef Int _move(const unsigned char[::1] data, Int at, bint annex, Int[::1] block) noexcept:
    """Read a move; return where its last word ends, −1 when it is none or its feed is 0."""
    cdef Int size, code
    cdef bint deep
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


cpdef (Int, Int) moves_in_a_row(
    const unsigned char[::1] data, Int at, bint annex, Int[:, ::1] blocks
) noexcept:
    """Read blocks from `at` on into `blocks` (R, 9), at most R, up to the first that is no move of
    this form, with a feed above 0 where it needs one. Return how many were read, and where it
    stopped."""
    cdef Int rows, size, first, last, end
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
