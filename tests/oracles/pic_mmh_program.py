"""A pic-mmh program run literally, from its bytes: fixed columns, whole numbers, no rounding of
floats. Nothing here is shared with the post-processor or with `camtool.kernels`.
"""

from __future__ import annotations

from dataclasses import dataclass

from tests.oracles.controllers import Point, dda_line, direct_search

WIDTH = {"example": 8, "annex": 6}


@dataclass(frozen=True)
class Ran:
    """One motion block: steps (x, y) before and after it, and whether it came to its end."""

    block: str
    start: Point
    end: Point
    met: bool
    iterations: int


def run(data: bytes, form: str) -> list[Ran]:
    """All XY motions of a program, one after the other, from (0, 0), at 0.14 µm a step."""
    at = (0, 0)
    ran = []
    for line in data.decode("ascii").splitlines():
        if line[:3] not in ("G00", "G01", "G02", "G03") or line[3] == "Z":
            continue
        letters, numbers = fields(line[3:], form)
        if letters.startswith("XYIJ"):
            result = arc(line, at, numbers)
        else:
            result = straight(line, at, numbers)
        ran.append(result)
        at = result.end
    return ran


def arcs(data: bytes, form: str) -> list[tuple[str, Point, Point]]:
    """Each arc block with its start and end about its centre, in steps, if all before it ended."""
    at, found = (0, 0), []
    for line in data.decode("ascii").splitlines():
        if line[:3] not in ("G00", "G01", "G02", "G03") or line[3] == "Z":
            continue
        letters, numbers = fields(line[3:], form)
        x, y = numbers[:2]
        if letters.startswith("XYIJ"):
            i, j = numbers[2:]
            found.append((line, (at[0] - i, at[1] - j), (x - i, y - j)))
        at = (x, y)
    return found


def fields(text: str, form: str) -> tuple[str, list[int]]:
    """Letters of the words and their values in steps, read column by column."""
    letters, steps, at = "", [], 0
    while text[at] not in "F;":
        letters += text[at]
        width = WIDTH[form] + (form == "example" and text[at + 1] == "-")
        word = text[at + 1 : at + 1 + width]
        at += 1 + width
        sign = -1 if word[0] == "-" else 1
        digits = word.lstrip("+-")
        # hundredths of µm; one step is 14 of them; halves go away from zero
        hundredths = int(digits.replace(".", "")) if form == "example" else 100 * int(digits)
        steps.append(sign * ((2 * hundredths + 14) // 28))
    return letters, steps


def straight(line: str, at: Point, to: list[int]) -> Ran:
    """A DDA line, pass by pass."""
    a, b = abs(to[0] - at[0]), abs(to[1] - at[1])
    passes = list(dda_line(a, b))
    (x, y), _ = passes[-1] if passes else ((0, 0), False)
    end = (at[0] + x * (1 if to[0] > at[0] else -1), at[1] + y * (1 if to[1] > at[1] else -1))
    return Ran(line, at, end, end == (to[0], to[1]), len(passes))


def arc(line: str, at: Point, numbers: list[int]) -> Ran:
    """Direct search until the end is met, for one turn and a bit at most."""
    end_x, end_y, cx, cy = numbers
    x, y = at[0] - cx, at[1] - cy
    limit = 9 * max(abs(x), abs(y)) + 10  # a turn of radius r takes 4√2·r, and r ≤ √2·max
    place = (x, y)
    count = 0
    for count, place in enumerate(direct_search(x, y, line.startswith("G02")), start=1):
        if place == (end_x - cx, end_y - cy):
            return Ran(line, at, (end_x, end_y), True, count)
        if count > limit:
            break
    return Ran(line, at, (place[0] + cx, place[1] + cy), False, count)
