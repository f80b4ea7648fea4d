"""`name = numbers` in a text of Matlab or Octave: numbers are read, nothing is ever run.

Known are `name = 1`, `name = [1 2; 3 4]` (a line's end within brackets ends a row too), comments
with % or #, blocks of comments, continuation with `...`, and commands that change no number.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NoReturn

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.polylines import Floats

_HARMLESS = ("clc", "clear", "close", "format", "global", "more")
"""Commands that change no number: they are passed over to the end of their line."""

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


@dataclass(frozen=True, eq=False)
class Value:
    """An array (rows, columns) and the line on which it is assigned."""

    array: Floats
    line: int


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    line: int
    after_blank: bool


def _tokens(text: str) -> Iterator[_Token]:
    """All tokens; comments and continued lines are blanks."""
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


def assigned(text: str, file: str, names: tuple[str, ...]) -> dict[str, Value]:
    """Every assigned array by its name; DrawingError with its line for all that is no number."""
    return _Parser(file, text, names).values()


class _Parser:
    """`name = number` and `name = [ rows ]`, one after the other."""

    def __init__(self, file: str, text: str, names: tuple[str, ...]) -> None:
        self.file = file
        self.names = names
        self._rest = _tokens(text)
        self._now = next(self._rest)

    def values(self) -> dict[str, Value]:
        """Every assigned array by its name."""
        found: dict[str, Value] = {}
        while self._now.kind != "end":
            token = self._take()
            if token.text in ("\n", ";", ","):
                continue
            if token.kind == "name" and token.text in _HARMLESS:
                while self._take().text not in ("\n", ";"):
                    pass
                continue
            if token.text not in self.names:
                self._fail(f"{token.text!r} is none of the known arrays", token, self._known())
            if token.text in found:
                self._fail(f"{token.text} is assigned twice", token, "give one job a file")
            found[token.text] = Value(self._value(token.text), token.line)
        return found

    def _value(self, name: str) -> Floats:
        """What stands behind the name, up to the end of its statement."""
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
        """The rows up to the closing bracket; a line's end ends a row as a semicolon does."""
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
        """The next token; at the end it stays."""
        token = self._now
        self._now = next(self._rest, token)
        return token

    def _known(self) -> str:
        return f"known: {', '.join(self.names)}; {_ONLY_NUMBERS}"

    def _fail(self, message: str, token: _Token, mend: str = "") -> NoReturn:
        raise DrawingError(message, file=self.file, where=f"line {token.line}", mend=mend)


def _shown(token: _Token) -> str:
    if token.kind == "end" or token.text == "\n":
        return "nothing"
    return repr(token.text)
