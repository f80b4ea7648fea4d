"""Blocks of words formatted as text by columns, for all writers of G-code and its relatives.

    x = WordColumn("X", units[:, 0], written[:, 0], decimals=3)
    texts = texts_of([code, x, y], blanks=True)      b"G1 X1.500 Y2.000\\nG0 X..."

Blocks without words (events, comments) are inserted afterwards (`TextLines.with_lines`)."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from io import BytesIO

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Codes, Ints, Octets
from camtool.kernels.words import MAX_NUMBER_CHARS, put_words

ROWS_AT_ONCE = 1 << 14


class WordColumn(Struct, frozen=True, eq=False):
    """One word of M blocks: the text before its number, the number as `units` (M,) of its last
    decimal, and the mask `written` (M,) of blocks that have it.

    `kept`: decimals that are written even if they are 0 (None: all); `digits`: least number of
    digits before the point; `plus`: write a sign before numbers that are not negative;
    `bare_point`: write a point behind a number without decimals."""

    letter: str
    units: Ints | Codes
    written: Bools
    decimals: int = 0
    kept: int | None = None
    digits: int = 1
    plus: bool = False
    bare_point: bool = False

    @property
    def style(self) -> tuple[int, int, int, int, int]:
        """The five numbers of a style, in the form of `camtool.kernels.words`."""
        decimals_kept = self.decimals if self.kept is None else self.kept
        return self.digits, self.decimals, decimals_kept, int(self.plus), int(self.bare_point)


class TextLines(Struct, frozen=True, eq=False):
    """M lines of text with their line ends, some of them of no characters at all: line k is
    data[ends[k − 1]:ends[k]]."""

    data: bytes
    ends: Ints

    @property
    def lengths(self) -> Ints:
        """Characters (M,) of each line, its end included."""
        return np.diff(self.ends, prepend=0)

    def with_lines(self, extra_lines: Iterable[tuple[int, str]]) -> bytes:
        """Return the text with further lines inserted, each (k, line) before line k; k ascends."""
        text, output, offset = memoryview(self.data), BytesIO(), 0
        for k, line in extra_lines:
            line_end = int(self.ends[k - 1]) if k > 0 else 0
            output.write(text[offset:line_end])
            output.write(f"{line}\n".encode("ascii"))
            offset = line_end
        output.write(text[offset:])
        return output.getvalue()


def line_lengths(data: bytes) -> Ints:
    """Compute the characters (L,) of each line of a program, without line ends."""
    ends = np.flatnonzero(np.frombuffer(data, dtype=np.uint8) == ord("\n"))
    return np.asarray(np.diff(ends, prepend=-1) - 1)


def texts_of(columns: Sequence[WordColumn], *, blanks: bool = False, end: str = "\n") -> TextLines:
    """Format M blocks of text, each with its words in the order of the columns, separated by
    spaces if `blanks`."""
    pieces = [*(each.letter for each in columns), end]
    fixed = np.frombuffer("".join(pieces).encode("ascii"), dtype=np.uint8).copy()
    fixed_ends = np.cumsum([len(piece) for piece in pieces])
    styles = np.array([each.style for each in columns], dtype=np.int64)
    room = len(fixed) + len(columns) * (MAX_NUMBER_CHARS + 1)
    buffer: Octets = np.empty(ROWS_AT_ONCE * room, dtype=np.uint8)
    count, parts, ends = len(columns[0].units), [], np.zeros(len(columns[0].units), dtype=np.int64)
    begin = 0
    for low in range(0, count, ROWS_AT_ONCE):
        rows = slice(low, min(low + ROWS_AT_ONCE, count))
        values = np.column_stack([each.units[rows] for each in columns]).astype(np.int64)
        written = np.column_stack([each.written[rows] for each in columns]).view(np.uint8)
        put_words(values, written, fixed, fixed_ends, styles, blanks, buffer, ends[rows])
        size = int(ends[rows][-1])
        parts.append(buffer[:size].tobytes())
        ends[rows] += begin
        begin += size
    return TextLines(b"".join(parts), ends)
