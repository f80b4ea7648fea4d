"""The arrays of the Matlab router as text: numbers are read, nothing is ever run.

    xy    = [ 151 400 ; 86 265 ]      points, tenths of a millimetre: row 1 is x, row 2 is y
    lxy   = [ 249 ; 179 ]             lengths of the lines along x and y, never negative
    velxy = [ 480 ; 345 ]             speeds; their signs are the directions of the lines
    size_of_array = 1;                how many lines
    first_pointx = 151;               where they begin
    first_pointy = 86;

x_points, y_points, lx, ly, velx and vely are single rows of these. An array may stand on its
side, (n, 2). The points come from xy, else from the first point and lxy with the signs of
velxy; what else is there must agree with them. The speeds are the machine's: they are not used.

Source: thesis on the router, its listing and example (L3196-3228, L4444-4515, L4294-4360)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import PurePath
from typing import NoReturn

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.importers.points.tables import PointTable, Stroke

MM_PER_UNIT = 0.1
"""The router counts in tenths of a millimetre (thesis L3202)."""

AGREES_UNITS = 1e-6
"""Numbers of the file that should be equal may differ by this much, in its own unit."""

_PAIRS = ("xy", "lxy", "velxy")
_VECTORS = ("x_points", "y_points", "lx", "ly", "velx", "vely")
_SCALARS = ("size_of_array", "first_pointx", "first_pointy")
_NAMES = (*_PAIRS, *_VECTORS, *_SCALARS)
_PARTS = {"xy": ("x_points", "y_points"), "lxy": ("lx", "ly"), "velxy": ("velx", "vely")}

_START = re.compile(rf"^[ \t]*(?:{'|'.join(_NAMES)})[ \t]*=", re.MULTILINE)


def is_matlab(text: str, file: str) -> bool:
    """Return True if the text assigns an array of the router, or the file is named .m."""
    return _START.search(text) is not None or PurePath(file).suffix.lower() == ".m"


def parse_matlab(text: str, file: str) -> PointTable:
    """Return the router's one stroke, in tenths of a millimetre; DrawingError naming the line."""
    values = parse_assignments(text, file, _NAMES)
    points, line = _Job(file, values).points()
    return PointTable(
        [Stroke(points, f"at line {line}")],
        "0.1 mm",
        MM_PER_UNIT,
        "the router's arrays are tenths of a millimetre",
    )


class _Job:
    """The job of the router that the arrays describe together, checked against each other."""

    def __init__(self, file: str, values: dict[str, MatlabArray]) -> None:
        self.file = file
        self.values = values
        self.sideways = self._is_sideways()

    def points(self) -> tuple[Floats, int]:
        """Return the points (n, 2) in the file's unit, and the line on which their array is
        assigned."""
        places = self._pair("xy")
        lengths, speeds = self._pair("lxy"), self._pair("velxy")
        if places is not None:
            self._agree(places[0], lengths, speeds)
            return places
        first = [self._scalar(name) for name in ("first_pointx", "first_pointy")]
        if lengths is None or speeds is None or None in first:
            raise DrawingError(
                "assigns no points",
                file=self.file,
                mend="give xy, or first_pointx, first_pointy, lxy and velxy",
            )
        steps = self._steps(lengths, speeds)
        self._count(len(steps))
        return np.cumsum([np.array(first, dtype=np.float64), *steps], axis=0), lengths[1]

    def _is_sideways(self) -> bool:
        """Return True if arrays of pairs are (n, 2) instead of (2, n).

        An array (2, 2) may be either: it follows the other arrays, and alone it is read as (2, n),
        as the router does."""
        votes: dict[bool, MatlabArray] = {}
        for name in _PAIRS:
            value = self.values.get(name)
            if value is None or value.array.shape == (2, 2):
                continue
            if 2 not in value.array.shape:
                rows, columns = value.array.shape
                self._fail(f"{name} has {rows} rows and {columns} columns, wanted 2 rows", value)
            votes[value.array.shape[1] == 2] = value
        if len(votes) == 2:
            self._fail("one array has two rows, another one two columns", votes[True])
        return True in votes

    def _pair(self, name: str) -> tuple[Floats, int] | None:
        """Return the array (n, 2) of this name, or the one made of its two single rows, and its
        line; None without either."""
        value = self.values.get(name)
        rows = [self._vector(part) for part in _PARTS[name]]
        x, y = rows
        if (x is None) != (y is None):
            line = self.values[_PARTS[name][x is None]]
            self._fail(f"{_PARTS[name][x is None]} has no {_PARTS[name][x is not None]}", line)
        parts = None
        if x is not None and y is not None:
            line = self.values[_PARTS[name][0]]
            if len(x) != len(y):
                self._fail(f"{_PARTS[name][0]} and {_PARTS[name][1]} differ in length", line)
            parts = np.column_stack([x, y]), line.line
        if value is None:
            return parts
        array = value.array if self.sideways else value.array.T
        if parts is not None and not _are_same(array, parts[0]):
            self._fail(f"{name} is not what {' and '.join(_PARTS[name])} are", value)
        return array, value.line

    def _vector(self, name: str) -> Floats | None:
        value = self.values.get(name)
        if value is None:
            return None
        if 1 not in value.array.shape:
            self._fail(f"{name} has more than one row", value)
        return value.array.ravel()

    def _scalar(self, name: str) -> float | None:
        value = self.values.get(name)
        if value is None:
            return None
        if value.array.shape != (1, 1):
            self._fail(f"{name} is no single number", value)
        return float(value.array[0, 0])

    def _steps(self, lengths: tuple[Floats, int], speeds: tuple[Floats, int]) -> Floats:
        """Return the displacement (n, 2) of each line of the job: its lengths with the signs of
        its speeds."""
        length, speed = lengths[0], speeds[0]
        if len(length) != len(speed):
            self._fail_at("lxy and velxy differ in length", speeds[1])
        if (length < 0.0).any():
            self._fail_at("a length is negative", lengths[1], "directions are signs of velxy")
        stuck = (length > 0.0) & (speed == 0.0)
        if stuck.any():
            row = int(np.argmax(stuck.any(axis=1))) + 1
            self._fail_at(f"line {row} of the job has a length, but no direction", speeds[1])
        return np.asarray(length * np.sign(speed))

    def _agree(
        self, points: Floats, lengths: tuple[Floats, int] | None, speeds: tuple[Floats, int] | None
    ) -> None:
        """Raise DrawingError if the lengths, directions, count or first point contradict xy."""
        steps = np.diff(points, axis=0)
        if lengths is not None and not _are_same(lengths[0], np.abs(steps)):
            self._fail_at("lxy are not the lengths of the lines of xy", lengths[1])
        if speeds is not None and (
            speeds[0].shape != steps.shape or (speeds[0] * steps < 0.0).any()
        ):
            self._fail_at("velxy has not the directions of the lines of xy", speeds[1])
        self._count(len(steps))
        for name, place in zip(("first_pointx", "first_pointy"), points[:1].ravel(), strict=False):
            expected = self._scalar(name)
            if expected is not None and abs(expected - place) > AGREES_UNITS:
                self._fail(f"{name} is {expected:g}, xy begins at {place:g}", self.values[name])

    def _count(self, lines: int) -> None:
        count = self._scalar("size_of_array")
        if count is not None and count != lines:
            self._fail(
                f"size_of_array is {count:g}, there are {lines} lines",
                self.values["size_of_array"],
            )

    def _fail(self, message: str, value: MatlabArray) -> NoReturn:
        self._fail_at(message, value.line)

    def _fail_at(self, message: str, line: int, mend: str = "") -> NoReturn:
        raise DrawingError(message, file=self.file, where=f"line {line}", mend=mend)


def _are_same(one: Floats, other: Floats) -> bool:
    return one.shape == other.shape and bool((np.abs(one - other) <= AGREES_UNITS).all())


# `name = numbers` in a text of Matlab or Octave: numbers are read, nothing is ever run.
#
# Known are `name = 1`, `name = [1 2; 3 4]` (a line's end within brackets ends a row too), comments
# with % or #, blocks of comments, continuation with `...`, and commands that change no number.

_HARMLESS = ("clc", "clear", "close", "format", "global", "more")
"""Commands that change no number: they are skipped to the end of their line."""

_TOKEN = re.compile(
    r"""(?P<skip>\.\.\.[^\n]*\n|[%\#][^\n]*|[ \t\r]+)
    |(?P<number>[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?(?![\w.]))
    |(?P<name>[+-]?[A-Za-z]\w*)
    |(?P<sign>[=\[\];,\n])
    |(?P<other>.)""",
    re.VERBOSE | re.ASCII,
)
_BLOCK = re.compile(r"^[ \t]*[%#]\{[ \t\r]*$.*?(?:^[ \t]*[%#]\}[ \t\r]*$|\Z)", re.M | re.S)
_ONLY_NUMBERS = "camtool reads numbers only and runs nothing: write the arrays as plain numbers"


class MatlabArray(Struct, frozen=True, eq=False):
    """An array (rows, columns) and the line on which it is assigned."""

    array: Floats
    line: int


class _Token(Struct, frozen=True):
    kind: str
    text: str
    line: int
    after_blank: bool


def _tokens(text: str) -> Iterator[_Token]:
    """Yield all tokens; comments and line continuations count as blanks."""
    text = _BLOCK.sub(lambda match: "\n" * match[0].count("\n"), text)
    line, blank = 1, True
    for match in _TOKEN.finditer(text):
        kind = match.lastgroup or "other"
        if kind == "skip":
            line, blank = line + match[0].count("\n"), True
            continue
        yield _Token(kind, match[0], line, blank)
        blank = kind == "sign"
        line += match[0] == "\n"
    yield _Token("sign", "\n", line, True)
    yield _Token("end", "", line, True)


def parse_assignments(text: str, file: str, names: tuple[str, ...]) -> dict[str, MatlabArray]:
    """Return every assigned array by its name; DrawingError, with the line, for a value that is no
    number."""
    return _Parser(file, text, names).values()


class _Parser:
    """The parser of statements `name = number` and `name = [ rows ]`."""

    def __init__(self, file: str, text: str, names: tuple[str, ...]) -> None:
        self.file = file
        self.names = names
        self._rest = _tokens(text)
        self._now = next(self._rest)

    def values(self) -> dict[str, MatlabArray]:
        """Return every assigned array by its name."""
        arrays: dict[str, MatlabArray] = {}
        while self._now.kind != "end":
            token = self._take()
            if token.text in ("\n", ";", ","):
                continue
            if token.kind == "name" and token.text in _HARMLESS:
                while self._take().text not in ("\n", ";"):
                    pass
                continue
            if token.text not in self.names:
                self._fail(
                    f"{token.text!r} is none of the known arrays",
                    token,
                    f"known: {', '.join(self.names)}; {_ONLY_NUMBERS}",
                )
            if token.text in arrays:
                self._fail(f"{token.text} is assigned twice", token, "give one job a file")
            arrays[token.text] = MatlabArray(self._value(token.text), token.line)
        return arrays

    def _value(self, name: str) -> Floats:
        """Parse the value that is assigned to a name, up to the end of the statement."""
        token = self._take()
        if token.text != "=":
            self._fail(f"{name} is followed by {_shown(token)}", token, _ONLY_NUMBERS)
        while self._now.text == "\n":
            self._take()
        token = self._take()
        if token.text == "[":
            array = self._matrix()
        elif token.kind == "number":
            array = np.array([[self._number(token)]])
        else:
            self._fail(f"{name} is set to {_shown(token)}", token, _ONLY_NUMBERS)
        if self._now.text not in ("\n", ";", ","):
            self._fail(f"{name} goes on with {_shown(self._now)}", self._now, _ONLY_NUMBERS)
        return array

    def _matrix(self) -> Floats:
        """Return the rows up to the closing bracket; the end of a line ends a row as a semicolon
        does."""
        rows: list[list[float]] = [[]]
        while True:
            token = self._take()
            if token.kind == "number":
                if not token.after_blank:
                    self._fail(f"a calculation with {token.text}", token, _ONLY_NUMBERS)
                rows[-1].append(self._number(token))
            elif token.text in (";", "\n", "]"):
                self._check_row(rows, token)
                if token.text == "]" and not rows[0]:
                    self._fail("an array is empty", token)
                if token.text == "]":
                    break
                if rows[-1]:
                    rows.append([])
            elif token.kind == "end":
                self._fail("an array is not closed", token)
            elif token.text.lstrip("+-").lower() in ("nan", "inf"):
                self._fail(f"{token.text} is not finite", token)
            elif token.text != ",":
                self._fail(f"{_shown(token)} stands in an array", token, _ONLY_NUMBERS)
        return np.array([row for row in rows if row], dtype=np.float64).reshape(-1, len(rows[0]))

    def _check_row(self, rows: list[list[float]], token: _Token) -> None:
        if rows[-1] and len(rows[-1]) != len(rows[0]):
            self._fail(f"a row has {len(rows[-1])} numbers, the first one {len(rows[0])}", token)

    def _number(self, token: _Token) -> float:
        value = float(token.text)
        if not np.isfinite(value):
            self._fail(f"{token.text} is not finite", token)
        return value

    def _take(self) -> _Token:
        """Return the current token and go on to the next; the end token is returned again and
        again."""
        token = self._now
        self._now = next(self._rest, token)
        return token

    def _fail(self, message: str, token: _Token, mend: str = "") -> NoReturn:
        raise DrawingError(message, file=self.file, where=f"line {token.line}", mend=mend)


def _shown(token: _Token) -> str:
    if token.kind == "end" or token.text == "\n":
        return "nothing"
    return repr(token.text)
