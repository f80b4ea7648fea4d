"""Words of program text: letters and decimal numbers, written and read by columns.

A number is a count of whole units of its last decimal, so nothing is rounded here. Compiled,
because a program has millions of digits; C types stand in the .pxd beside this file.
"""

from __future__ import annotations

from camtool.arrays import Floats, Ints, Octets

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


# Reading. A plain line holds nothing but words of the letters G X Y Z I J F, each once at most,
# and its G is G0 to G3; parts of it may be a block number in front and blanks between the words. A
# number has no more digits than a float64 takes exactly, and the power of ten that divides it is
# exact too: so the quotient is the nearest float64, as Python's own reading gives it.

G_WORD, X_WORD, Y_WORD, Z_WORD, I_WORD, J_WORD, F_WORD = range(7)
"""Columns of numbers; a word's bit in `MASK` is 1 << its column."""

FORM, MASK, TWO_DIGITS, ONE_BLANK, LINE = range(5)
"""Columns of facts: the letters in their order, each as column + 1, as digits of a number in base
8; which there are; whether G has two digits and nothing else; whether words are parted by one
blank each; the number of the line."""

FACT_COLUMNS = 5
"""How many columns."""

MOST_DIGITS, MOST_EXACT_DIGITS = 22, 15
"""Digits of a number, and of these without zeros in front; longer ones are not plain."""

_CR, _LF, _OPEN, _CLOSE, _COMMA, _SEMICOLON = 13, 10, 40, 41, 44, 59
_BIG_N, _SMALL_A, _SMALL_Z = 78, 97, 122


def _column_of(sign: int) -> int:
    """The column of a letter, −1 for others."""
    if sign == 71:
        return G_WORD
    if 88 <= sign <= 90:
        return X_WORD + sign - 88
    if 73 <= sign <= 74:
        return I_WORD + sign - 73
    return F_WORD if sign == 70 else -1


def _number(data: Octets, at: int, end: int, numbers: Floats, column: int) -> int:
    """Read the number at `at`; where it ends, or −1 when there is none that is plain."""
    negative = at < end and data[at] == _MINUS
    if at < end and (data[at] == _MINUS or data[at] == _PLUS):
        at += 1
    mantissa, digits, exact, scale, point = 0, 0, 0, 1.0, False
    while at < end and digits <= MOST_DIGITS:
        sign = data[at]
        if _ZERO <= sign < _ZERO + 10:
            mantissa = mantissa * 10 + (sign - _ZERO)
            digits += 1
            if mantissa > 0:
                exact += 1
            if exact > MOST_EXACT_DIGITS:
                return -1
            if point:
                scale *= 10.0
        elif sign == _POINT and not point:
            point = True
        else:
            break
        at += 1
    if digits == 0 or digits > MOST_DIGITS:
        return -1
    value = mantissa / scale
    numbers[column] = -value if negative else value
    return at


def _is_comment(data: Octets, at: int, end: int) -> bool:
    """Whether a line that begins so is a comment alone, and not one in parentheses with a comma:
    that may be obeyed, or shown to the operator."""
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


def _plain_line(data: Octets, at: int, end: int, free: bool, numbers: Floats, facts: Ints) -> int:
    """Read a line; how many words it has, or −1 when it is not plain."""
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


def plain_lines(
    data: Octets,
    at: int,
    line: int,
    most_chars: int,
    free: bool,
    numbers: Floats,
    facts: Ints,
) -> tuple[int, int, int]:
    """Read lines from `at` on, which is the begin of the line of this number, up to the first that
    is not plain: how many have words, and where and in which line it stopped.

    `most_chars`: of a line. `free`: lines are as RS274/NGC has them, where small letters count as
    capitals, blocks may be numbered, and comments that stand alone are passed over; otherwise they
    hold words in capitals and nothing else. numbers (R, 7) and facts (R, 5) are filled, no more
    rows than these.
    """
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
