"""Blocks of words as text, by columns: what every writer of words ends with.

    x = Words("X", units[:, 0], written[:, 0], decimals=3)
    texts = texts_of([code, x, y], blanks=True)      b"G1 X1.500 Y2.000\\nG0 X..."

Blocks that are no row of words (events, comments) are put between them afterwards.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from io import BytesIO

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Codes, Ints, Octets
from camtool.kernels.words import MOST_NUMBER, put_words

ROWS_AT_ONCE = 1 << 14
"""So many blocks are written in one go, so that little room is needed."""


class Words(Struct, frozen=True, eq=False):
    """A word of M blocks: what stands before its number, the number in whole units of its last
    decimal (M,), and which blocks have it (M,).

    `kept`: so many decimals stay where they are 0 (None: all); `digits`: at least so many before
    the point; `plus`: a sign before numbers that are not negative.
    """

    letter: str
    units: Ints | Codes
    written: Bools
    decimals: int = 0
    kept: int | None = None
    digits: int = 1
    plus: bool = False

    @property
    def style(self) -> tuple[int, int, int, int]:
        """As `camtool.kernels.words` has it."""
        kept = self.decimals if self.kept is None else self.kept
        return self.digits, self.decimals, kept, int(self.plus)


class Texts(Struct, frozen=True, eq=False):
    """M lines of text, some of them empty and without a line end: line k is data[ends[k − 1]:
    ends[k]]."""

    data: bytes
    ends: Ints

    @property
    def lengths(self) -> Ints:
        """(M,) characters of each line, its end included."""
        return np.diff(self.ends, prepend=0)

    def with_lines(self, between: Iterable[tuple[int, str]]) -> bytes:
        """The text with further lines, each before its line k; k ascends."""
        text, out, done = memoryview(self.data), BytesIO(), 0
        for k, line in between:
            upto = int(self.ends[k - 1]) if k > 0 else 0
            out.write(text[done:upto])
            out.write(f"{line}\n".encode("ascii"))
            done = upto
        out.write(text[done:])
        return out.getvalue()


def line_lengths(data: bytes) -> Ints:
    """(L,) characters of each line of a program, line ends not counted."""
    ends = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n"))
    return np.asarray(np.diff(ends, prepend=-1) - 1)


def texts_of(columns: Sequence[Words], *, blanks: bool = False, end: str = "\n") -> Texts:
    """The lines of M blocks, each with the words that it has in this order; `blanks` part them."""
    pieces = [*(each.letter for each in columns), end]
    fixed = np.frombuffer("".join(pieces).encode("ascii"), dtype=np.uint8).copy()
    fixed_ends = np.cumsum([len(piece) for piece in pieces])
    styles = np.array([each.style for each in columns], dtype=np.int64)
    room = len(fixed) + len(columns) * (MOST_NUMBER + 1)
    out: Octets = np.empty(ROWS_AT_ONCE * room, dtype=np.uint8)
    count, parts, ends = len(columns[0].units), [], np.zeros(len(columns[0].units), dtype=np.int64)
    begin = 0
    for low in range(0, count, ROWS_AT_ONCE):
        rows = slice(low, min(low + ROWS_AT_ONCE, count))
        values = np.column_stack([each.units[rows] for each in columns]).astype(np.int64)
        written = np.column_stack([each.written[rows] for each in columns]).view(np.uint8)
        put_words(values, written, fixed, fixed_ends, styles, blanks, out, ends[rows])
        size = int(ends[rows][-1])
        parts.append(out[:size].tobytes())
        ends[rows] += begin
        begin += size
    return Texts(b"".join(parts), ends)
