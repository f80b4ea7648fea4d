"""Words of program text: letters and decimal numbers, written and read by columns.

A number is a count of whole units of its last decimal, so nothing is rounded here. Compiled,
because a program has millions of digits.
"""

from __future__ import annotations

from camtool.kernels.types cimport Int

from camtool.arrays import Floats, Ints, Octets

cpdef enum:
    # Columns of a style: least digits before the point, decimals, how many of these stay where
    # they are 0, whether numbers that are not negative have a sign too, and whether a number
    # without decimals has a point all the same.
    DIGITS = 0, DECIMALS, KEPT, PLUS, BARE_POINT
    # How many columns.
    STYLE_COLUMNS = 5
    # No number has more characters: sign, 20 digits, point, and digits that a style adds.
    MAX_NUMBER_CHARS = 48
    _ZERO = 48, _POINT = 46, _PLUS = 43, _MINUS = 45, _BLANK = 32


cdef Int _put_number(Int value, Int[::1] style, unsigned char[::1] out, Int at) noexcept:
    """Write a number to `out` from `at` on; return where it ends."""
    cdef Int size, decimals, digits, rest, end, k, place
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
    if digits == decimals:  # no digit stands before the point
        out[at] = _POINT
    if decimals == 0 and style[BARE_POINT] != 0:
        out[end] = _POINT
        end += 1
    return end


cpdef void put_words(
    Int[:, ::1] values, unsigned char[:, ::1] written, unsigned char[::1] fixed,
    Int[::1] fixed_ends, Int[:, ::1] styles, bint blanks, unsigned char[::1] out, Int[::1] ends
) noexcept:
    """Write M rows of up to K words to `out`, which must have room; fill `ends` (M,).

    values (M, K) whole units; written (M, K): 1 for words that a row has; `fixed`: the text before
    each number, and last the end of a row that has words, cut at fixed_ends (K + 1,); styles (K,
    5); `blanks`: true if words are separated by a blank.
    """
    cdef Int columns, at, row, begin, column, k
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


# Reading. A plain line holds nothing but words of the letters G X Y Z I J F, each once at most,
# and its G is G0 to G3; parts of it may be a block number in front and blanks between the words. A
# number has no more digits than a float64 takes exactly, and the power of ten that divides it is
# exact too: so the quotient is the nearest float64, as Python's own reading gives it.

cpdef enum:
    # Columns of numbers; a word's bit in `MASK` is 1 << its column.
    G_WORD = 0, X_WORD, Y_WORD, Z_WORD, I_WORD, J_WORD, F_WORD
    # Columns of facts: the letters in their order, each as column + 1, as digits of a number in
    # base 8; which there are; whether G has two digits and nothing else; whether words are parted
    # by one blank each; the number of the line.
    FORM = 0, MASK, TWO_DIGITS, ONE_BLANK, LINE
    # How many columns.
    FACT_COLUMNS = 5
    # Digits of a number, and of these without zeros in front; longer ones are not plain.
    MAX_DIGITS = 22, MAX_EXACT_DIGITS = 15
    _CR = 13, _LF = 10, _OPEN = 40, _CLOSE = 41, _COMMA = 44, _SEMICOLON = 59
    _BIG_N = 78, _SMALL_A = 97, _SMALL_Z = 122


cdef inline Int _column_of(Int sign) noexcept:
    """Return the column of a letter, −1 for others."""
    if sign == 71:
        return G_WORD
    if 88 <= sign <= 90:
        return X_WORD + sign - 88
    if 73 <= sign <= 74:
        return I_WORD + sign - 73
    return F_WORD if sign == 70 else -1


cdef Int _number(
    const unsigned char[::1] data, Int at, Int end, double[::1] numbers, Int column
) noexcept:
    """Read the number at `at` into `numbers`; return where it ends, −1 when there is none that is
    plain."""
    cdef bint negative, point
    cdef Int mantissa, digits, exact, sign
    cdef double scale, value
    negative = at < end and data[at] == _MINUS
    if at < end and (data[at] == _MINUS or data[at] == _PLUS):
        at += 1
    mantissa, digits, exact, scale, point = 0, 0, 0, 1.0, False
    while at < end and digits <= MAX_DIGITS:
        sign = data[at]
        if _ZERO <= sign < _ZERO + 10:
            mantissa = mantissa * 10 + (sign - _ZERO)
            digits += 1
            if mantissa > 0:
                exact += 1
            if exact > MAX_EXACT_DIGITS:
                return -1
            if point:
                scale *= 10.0
        elif sign == _POINT and not point:
            point = True
        else:
            break
        at += 1
    if digits == 0 or digits > MAX_DIGITS:
        return -1
    value = mantissa / scale
    numbers[column] = -value if negative else value
    return at


cdef bint _is_comment(const unsigned char[::1] data, Int at, Int end) noexcept:
    """Return True if the line is only a comment, and not one in parentheses with a comma, which
    may be obeyed, or shown to the operator."""
    cdef Int first
    first = data[at]
    if first == _SEMICOLON:
        return True
    if first != _OPEN:
        return False
    at += 1
    while at < end and data[at] != _OPEN and data[at] != _CLOSE:
        if data[at] == _COMMA:
            return False
        at += 1
    if at == end or data[at] == _OPEN:
        return False
    at += 1
    while at < end and data[at] == _BLANK:
        at += 1
    return at == end


cdef Int _plain_line(
    const unsigned char[::1] data, Int at, Int end, bint free, double[::1] numbers, Int[::1] facts
) noexcept:
    """Read a line into `numbers` and `facts`; return its number of words, −1 when it is not
    plain."""
    cdef Int words, form, mask, one_blank, blanks, sign, first, column
    cdef bint numbered, plain_digits
    cdef double code
    words, form, mask, one_blank, numbered = 0, 0, 0, 1, free
    facts[TWO_DIGITS] = 0
    while True:
        blanks = at
        while at < end and data[at] == _BLANK:
            at += 1
        if at == end:
            break
        sign = data[at]
        if free and _SMALL_A <= sign <= _SMALL_Z:
            sign -= 32
        if sign == _BIG_N and numbered and words == 0:
            numbered = False
            first = at + 1
            at = first
            while at < end and _ZERO <= data[at] < _ZERO + 10:
                at += 1
            if at == first:
                return -1
            continue
        column = _column_of(sign)
        if column < 0 or (mask >> column) & 1 == 1:
            return -1
        if words > 0 and at - blanks != 1:
            one_blank = 0
        first = at + 1
        at = _number(data, first, end, numbers, column)
        if at < 0:
            return -1
        if column == G_WORD:
            code = numbers[G_WORD]
            if code != 0.0 and code != 1.0 and code != 2.0 and code != 3.0:
                return -1
            plain_digits = at - first == 2 and data[first] == _ZERO and data[first + 1] != _POINT
            facts[TWO_DIGITS] = 1 if plain_digits else 0
        mask |= 1 << column
        form = form * 8 + column + 1
        words += 1
    facts[FORM], facts[MASK], facts[ONE_BLANK] = form, mask, one_blank
    return words


cpdef (Int, Int, Int) plain_lines(
    const unsigned char[::1] data, Int at, Int line, Int most_chars, bint free,
    double[:, ::1] numbers, Int[:, ::1] facts
) noexcept:
    """Read lines from `at` on, which is the beginning of line `line`, up to the first that is not
    plain. Return the number of lines with words, and the offset and the line at which it stopped.

    `most_chars`: the longest line. `free`: lines are as in RS274/NGC, where small letters count as
    capitals, blocks may be numbered, and comments that stand alone are skipped; otherwise they
    hold words in capitals and nothing else. At most as many rows of numbers (R, 7) and facts (R,
    5) are filled as these have.
    """
    cdef Int rows, size, end, first, words
    rows, size = 0, len(data)
    while at < size and rows < len(facts):
        end = at
        while end < size and data[end] != _LF and data[end] != _CR:
            end += 1
        if end - at > most_chars:
            break
        first = at
        while first < end and data[first] == _BLANK:
            first += 1
        if first < end and not (free and _is_comment(data, first, end)):
            words = _plain_line(data, first, end, free, numbers[rows], facts[rows])
            if words < 0:
                break
            if words > 0:
                facts[rows, LINE] = line
                rows += 1
        at = end
        if at < size:
            at += 2 if data[at] == _CR and at + 1 < size and data[at + 1] == _LF else 1
        line += 1
    return rows, at, line
