"""Reading the serial stream as the master does: numbers in digits, each ended by a carriage
return, in this order: lines n, first x, first y, n lx, n ly, n velx, n vely (L4294-4360,
L4668-4708). Jobs follow one another; a master takes one and must be reset for the next.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Final, NoReturn

import numpy as np

from camtool.errors import ProgramError

from ._matlab_router_job import ReadJob, check_count, check_job, fail
from ._matlab_router_options import Dialect

HEADER: Final = ("size_of_array", "first_pointx", "first_pointy")
BODY: Final = {"lxy": 0, "velxy": 2}
"""Which of the four rows of n numbers an array's x stands in."""

MOST_DIGITS: Final = 5
"""The master's buffer takes six characters, a sign and five digits (L4668-4708)."""

_NUMBER: Final = re.compile(rb"-?\d{1,%d}" % MOST_DIGITS)
SHOWN_BYTES: Final = 12
"""An error message shows no more of a number than this."""


def read_stream(data: bytes, dialect: Dialect) -> Iterator[ReadJob]:
    """The jobs of a stream, checked; ProgramError naming job, number and byte."""
    if not data:
        raise ProgramError("the stream is empty", mend="a stream begins with the count of lines")
    feed = data.find(b"\r\n") if dialect.first_y == "number" else -1
    if feed >= 0:
        fail(f"byte {feed + 2}", "a line feed: the master takes it for part of the next number")
    words = data.split(b"\r")
    if words[-1]:
        at = len(data) - len(words[-1]) + 1
        fail(f"byte {at}", "the stream breaks off inside a number", "end it with a CR")
    words.pop()
    first = 0
    number = 0
    while first < len(words):
        number += 1
        job = _job(words, first, number, dialect)
        check_job(job, dialect)
        yield job
        first += len(HEADER) + 2 * job.length.size


def _job(words: list[bytes], first: int, number: int, dialect: Dialect) -> ReadJob:
    """The job whose header begins at this word."""

    def place(word: int) -> str:
        byte = sum(map(len, words[: first + word])) + first + word + 1
        return f"job {number}, number {word + 1}, byte {byte}"

    def where(name: str, row: int, column: int) -> str:
        if name in HEADER:
            return place(HEADER.index(name))
        return place(len(HEADER) + (BODY[name] + row) * count + column)

    head = words[first : first + len(HEADER)]
    if len(head) < len(HEADER):
        fail(place(len(head)), "the stream ends inside the header of a job")
    for index in (0, 1):
        if _NUMBER.fullmatch(head[index]) is None:
            _fail_number(head[index], place(index))
    count, x = int(head[0]), int(head[1])
    check_count(count, where, dialect)
    y = _first_y(head[2], place, dialect)
    begin = first + len(HEADER)
    body = words[begin : begin + 4 * count]
    for index, word in enumerate(body):
        if _NUMBER.fullmatch(word) is None:
            _fail_number(word, place(len(HEADER) + index))
    if len(body) < 4 * count:
        fail(
            place(len(HEADER) + len(body)),
            f"the stream ends after {len(body)} of {4 * count} numbers",
            f"a job of {count} lines has four for each",
        )
    table = np.array(list(map(int, body)), dtype=np.int64).reshape(4, count)
    return ReadJob(number, np.array([x, y]), table[:2], table[2:], where)


def _fail_number(word: bytes, where: str) -> NoReturn:
    fail(
        where,
        f"{word[:SHOWN_BYTES]!r} is no whole number of at most {MOST_DIGITS} digits",
        "each number is digits and a CR, nothing else",
    )


def _first_y(word: bytes, place: Callable[[int], str], dialect: Dialect) -> int:
    """y of the first point; sent as a character, the master's atol makes its digit or 0 of it."""
    if dialect.first_y == "character":
        if len(word) != 1:
            fail(
                place(2),
                f"{word[:SHOWN_BYTES]!r} is not one character",
                "use --set dialect.first_y=number",
            )
        return int(word) if word.isdigit() else 0
    if _NUMBER.fullmatch(word) is None:
        if len(word) == 1:
            fail(
                place(2),
                f"y of the first point is the character {word!r}, as the listing sends it",
                "use --set dialect.profile=listing",
            )
        _fail_number(word, place(2))
    return int(word)
