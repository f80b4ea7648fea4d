"""Ways in which files come to harm, as pure functions of bytes and chosen numbers."""

from __future__ import annotations

import re
from collections.abc import Callable

GARBAGE = (
    b"",
    b"garbage",
    b"\x00",
    b"\xff\xfe\x00\x80",
    b"0",
    b"-1",
    b"70",
    b"1e308",
    b"-1e308",
    b"1e-320",
    b"nan",
    b"inf",
    b"99999999999999999999",
    b"0.1.2",
    b"<g>",
    b"</g>",
    b"&x;",
    b"SECTION",
    b"ENDSEC",
    b"INSERT",
    b"9" * 400,
    b"\xc3\x28",
)
"""What stands in place of a line or a number."""

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")

Damage = Callable[[bytes, int, int], bytes]


def cut(data: bytes, at: int, _choice: int) -> bytes:
    """Only what stands before byte `at`."""
    return data[: at % (len(data) + 1)]


def headless(data: bytes, at: int, _choice: int) -> bytes:
    """Only what stands behind byte `at`."""
    return data[at % (len(data) + 1) :]


def flip(data: bytes, at: int, choice: int) -> bytes:
    """Replace one byte by another."""
    if not data:
        return data
    place = at % len(data)
    return data[:place] + bytes([choice % 256]) + data[place + 1 :]


def insert(data: bytes, at: int, choice: int) -> bytes:
    """Garbage between two bytes."""
    place = at % (len(data) + 1)
    return data[:place] + GARBAGE[choice % len(GARBAGE)] + data[place:]


def line(data: bytes, at: int, choice: int) -> bytes:
    """Replace one line by garbage."""
    lines = data.split(b"\n")
    lines[at % len(lines)] = GARBAGE[choice % len(GARBAGE)]
    return b"\n".join(lines)


def number(data: bytes, at: int, choice: int) -> bytes:
    """Replace one number by something else."""
    places = list(NUMBER.finditer(data))
    if not places:
        return data
    place = places[at % len(places)]
    return data[: place.start()] + GARBAGE[choice % len(GARBAGE)] + data[place.end() :]


def without(data: bytes, at: int, choice: int) -> bytes:
    """A few lines are missing."""
    lines = data.split(b"\n")
    place = at % len(lines)
    return b"\n".join(lines[:place] + lines[place + 1 + choice % 7 :])


def twice(data: bytes, at: int, choice: int) -> bytes:
    """A few lines stand there twice."""
    lines = data.split(b"\n")
    place = at % len(lines)
    return b"\n".join(lines[: place + choice % 40] + lines[place:])


def swapped(data: bytes, at: int, choice: int) -> bytes:
    """Two lines have changed places."""
    lines = data.split(b"\n")
    one, other = at % len(lines), choice % len(lines)
    lines[one], lines[other] = lines[other], lines[one]
    return b"\n".join(lines)


EVERY: tuple[Damage, ...] = (cut, headless, flip, insert, line, number, without, twice, swapped)
