"""Reading a hex dump: offset, bytes, and after `;` a comment that may state the replies.

Offsets must be those of the bytes, and replies those that the bytes get; all else in a comment
is passed over.
"""

from __future__ import annotations

import re
from bisect import bisect_right
from itertools import islice
from typing import Final, NamedTuple

from camtool.errors import ProgramError

from ._i8751_faults import ByteFault, Decoded, shown, text_lines
from ._i8751_options import Dialect
from ._i8751_packets import PacketReader, replies

_LINE: Final = re.compile(r"([0-9A-Fa-f]{4,8})[ \t]+([0-9A-Fa-f][0-9A-Fa-f \t]*)(?:;(.*))?")

_REPLIES: Final = re.compile(r"<-([^<]*)$")


class _Run(NamedTuple):
    """A line with bytes: its number from 1, the offset of its first byte, how many, the column
    of its first byte from 1, and its comment."""

    line: int
    offset: int
    size: int
    column: int
    comment: str


def read_dump(data: bytes, dialect: Dialect) -> Decoded:
    """The records of a hex dump; ProgramError with record, byte, line and column."""
    lines = text_lines(data)
    runs, stream = _runs(lines)
    if not runs:
        raise ProgramError("the program is empty", mend="give a hex dump of i8751 packets")
    try:
        decoded = PacketReader(stream, dialect).read()
    except ByteFault as fault:
        raise _placed(fault, runs, lines) from None
    _check_replies(runs, replies(stream, decoded, dialect))
    if lines[-1]:
        raise ProgramError(
            "the last line has no end: is the dump complete?",
            where=f"line {len(lines)}, column {len(lines[-1]) + 1}",
            mend="end it with a line end",
        )
    return decoded


def _runs(lines: list[str]) -> tuple[list[_Run], bytes]:
    """The lines with bytes, and all bytes in order."""
    runs: list[_Run] = []
    stream = bytearray()
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith(";"):
            continue
        match = _LINE.fullmatch(line)
        found = _bytes(match[2]) if match else b""
        if match is None or not found:
            raise _no_line(number, line)
        if int(match[1], 16) != len(stream):
            raise ProgramError(
                f"offset {match[1]}, but {len(stream):04X} bytes came before",
                where=f"line {number}, column 1",
                mend="look for a line that is missing or doubled",
            )
        column = match.start(2) + 1
        runs.append(_Run(number, len(stream), len(found), column, match[3] or ""))
        stream += found
    return runs, bytes(stream)


def _bytes(text: str) -> bytes:
    """Pairs of hex digits with blanks between them; b"" when it is no such text."""
    try:
        return bytes.fromhex(text)
    except ValueError:
        return b""


def _no_line(number: int, line: str) -> ProgramError:
    """Where a line stops being offset and bytes."""
    offset = re.match(r"[0-9A-Fa-f]{4,8}(?=[ \t]|$)", line)
    column = 1
    if offset:
        good = re.match(r"[ \t]*(?:[0-9A-Fa-f]{2}(?:[ \t]+|$))*", line[offset.end() :])
        column = offset.end() + (good.end() if good else 0) + 1
    return ProgramError(
        f"{shown(line)} is no line of a hex dump: wanted an offset of four digits or more, bytes "
        "of two digits, and perhaps a comment behind a semicolon",
        where=f"line {number}, column {column}",
        mend="for a listing, use --set dialect.format=listing",
    )


def _placed(fault: ByteFault, runs: list[_Run], lines: list[str]) -> ProgramError:
    """The fault of a byte with the line and column in which the byte stands."""
    run = runs[bisect_right([run.offset for run in runs], fault.offset) - 1]
    inside = fault.offset - run.offset
    column = run.column
    if inside < run.size:
        digits = re.finditer(r"[0-9A-Fa-f]{2}", lines[run.line - 1][run.column - 1 :])
        column += next(islice(digits, inside, None)).start()
    return ProgramError(
        fault.message,
        where=f"record {fault.record + 1}, offset {fault.offset:04X}, line {run.line}, "
        f"column {column}",
        mend=fault.mend,
    )


def _check_replies(runs: list[_Run], expected: list[str]) -> None:
    """Replies that a comment states, other than ?, must be those of the protocol."""
    for run in runs:
        stated = _REPLIES.search(run.comment)
        if not stated:
            continue
        wanted = expected[run.offset : run.offset + run.size]
        given = stated[1].split()
        unknown = [a if b == "?" else b for a, b in zip(wanted, given, strict=False)]
        if len(given) != len(wanted) or unknown != wanted:
            raise ProgramError(
                f"replies {shown(' '.join(given))}, expected {shown(' '.join(wanted))}",
                where=f"offset {run.offset:04X}, line {run.line}",
                mend="see dialect.motor_reply and dialect.dwell_reply, or leave out the replies",
            )
