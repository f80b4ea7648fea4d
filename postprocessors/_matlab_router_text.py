"""Reading the .m file: `name = numbers;` and nothing else. Numbers are read, nothing is ever run.

    xy = [                          two rows of whole numbers; a line's end or ; ends a row
      151 400
       86 265
    ];
    size_of_array = 1;              one whole number
    jobs{1} = {xy, lxy, ...};       after a complete job of several: exactly these words
    % anything                      a comment

A job is complete when each of its six names has been assigned once; the next assignment then
begins another job.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from camtool.errors import ProgramError
from camtool.toolpath.moves import Ints

from ._matlab_router_job import ReadJob, check_count, check_job, fail
from ._matlab_router_options import MOST_NUMBER, Dialect

TABLES: Final = ("xy", "lxy", "velxy")
NAMES: Final = (*TABLES, "size_of_array", "first_pointx", "first_pointy")

SHOWN_CHARS: Final = 24
"""An error message shows no more of a program than this."""

_BLANK: Final = re.compile(r"(?:[ \t\r\n]+|%[^\n]*)*")
_NAME: Final = re.compile(r"([A-Za-z]\w*)(?:\{(\d{1,6})\})?[ \t]*=[ \t]*", re.ASCII)
_NUMBER: Final = re.compile(r"[+-]?\d{1,5}")
_WHOLE: Final = re.compile(r"(?:[ \t\r\n,;]*[+-]?\d{1,5}(?![0-9+-]))*[ \t\r\n,;]*")
_ROWS: Final = re.compile(r"\[([0-9 \t\r\n,;+-]*)\]")
_TOKEN: Final = re.compile(r"[^ \t\r\n,;]+")
_ROW_END: Final = re.compile(r"[;\n]")
_END: Final = re.compile(r"[ \t]*(?:;[ \t]*)?(?=%|\r?\n|\Z)")
_LIST: Final = re.compile(r"\{" + r",[ \t]*".join(NAMES) + r"\}")


@dataclass(frozen=True, eq=False)
class _Value:
    """What a name was set to: numbers (rows, columns), and where they begin in the text."""

    table: Ints
    offset: int


def read_text(data: bytes, dialect: Dialect) -> Iterator[ReadJob]:
    """The jobs of a .m file, checked; ProgramError naming line and column."""
    text = _Text(data)
    values: dict[str, _Value] = {}
    number = 0
    while not text.ended:
        name, index, at = text.name()
        if name == "jobs" and index is not None:
            if values or int(index) != number:
                text.fail(at, f"jobs{{{index}}} does not stand behind job {index}")
            text.listed()
            continue
        if index is not None or name not in NAMES:
            mend = f"a program sets {', '.join(NAMES)} to plain numbers; nothing is run"
            text.fail(at, f"{name[:SHOWN_CHARS]!r} is none of the arrays", mend)
        if name in values:
            missing = next(known for known in NAMES if known not in values)
            text.fail(at, f"{name} is assigned twice", f"{missing} of this job is missing")
        values[name] = text.table() if name in TABLES else text.scalar()
        if len(values) == len(NAMES):
            number += 1
            yield _job(text, number, values, dialect)
            values = {}
    if values:
        missing = next(known for known in NAMES if known not in values)
        text.fail(text.at, f"the program ends before {missing} of job {number + 1}")
    if number == 0:
        raise ProgramError("the program is empty", mend="a program sets xy, lxy, velxy, ...")


def _job(text: _Text, number: int, values: dict[str, _Value], dialect: Dialect) -> ReadJob:
    """The six values as one job, once they agree."""
    scalar = {name: int(values[name].table[0, 0]) for name in NAMES if name not in TABLES}

    def where(name: str, row: int, column: int) -> str:
        return text.where_in(values[name], row, column)

    count = scalar["size_of_array"]
    check_count(count, where, dialect)
    for name in TABLES:
        wanted = (2, count + 1 if name == "xy" else count)
        if values[name].table.shape != wanted:
            rows, columns = values[name].table.shape
            text.fail(
                values[name].offset,
                f"{name} has {rows} rows of {columns} numbers, not {wanted[0]} of {wanted[1]}",
                f"size_of_array is {count}",
            )
    job = ReadJob(
        number,
        np.array([scalar["first_pointx"], scalar["first_pointy"]]),
        values["lxy"].table,
        values["velxy"].table,
        where,
    )
    _agree(job, values["xy"].table)
    check_job(job, dialect)
    return job


def _agree(job: ReadJob, xy: Ints) -> None:
    """xy says again what first point, lxy and the signs of velxy say."""
    for axis, name in enumerate(("first_pointx", "first_pointy")):
        if int(job.first[axis]) != int(xy[axis, 0]):
            fail(
                job.where(name, 0, 0),
                f"{name} is {int(job.first[axis])}, xy begins at {int(xy[axis, 0])}",
            )
    step = np.diff(xy, axis=1)
    for name, table, bad in (
        ("lxy", job.length, np.abs(step) != job.length),
        ("velxy", job.speed, step * job.speed < 0),
    ):
        if bad.any():
            column, row = (int(index) for index in np.argwhere(bad.T)[0])
            fail(
                job.where(name, row, column),
                f"{int(table[row, column])} in {name} does not fit xy, which goes by"
                f" {int(step[row, column])}",
            )


class _Text:
    """The text and how far it has been read."""

    def __init__(self, data: bytes) -> None:
        odd = re.search(rb"[^\x20-\x7e\t\r\n]", data)
        self.text = data[: odd.start() if odd else len(data)].decode("ascii")
        if odd:
            byte = data[odd.start()]
            self.fail(len(self.text), f"the byte 0x{byte:02x} belongs to no program")
        self.at = self._blank(0)

    @property
    def ended(self) -> bool:
        """Whether nothing but blanks is left."""
        return self.at == len(self.text)

    def fail(self, offset: int, message: str, mend: str = "") -> None:
        """ProgramError at an offset; never returns."""
        fail(self._where(offset), message, mend)

    def where_in(self, value: _Value, row: int, column: int) -> str:
        """Line and column of a number of a table."""
        rest = row * value.table.shape[1] + column
        for index, match in enumerate(_TOKEN.finditer(self.text, value.offset)):
            if index == rest:
                return self._where(match.start())
        return self._where(value.offset)

    def name(self) -> tuple[str, str | None, int]:
        """`name =` or `name{1} =`: the name, the number in braces, and where it stood."""
        at = self.at
        match = _NAME.match(self.text, at)
        if match is None:
            self.fail(at, f"{self._shown(at)} is no `name = numbers;`", "remove it")
            raise AssertionError
        self.at = match.end()
        return match[1], match[2], at

    def scalar(self) -> _Value:
        """One whole number and the end of its statement."""
        match = _NUMBER.match(self.text, self.at)
        if match is None:
            self.fail(self.at, f"{self._shown(self.at)} is no whole number")
            raise AssertionError
        self._finish(match.end())
        return _Value(np.array([[self._int(match[0], match.start())]]), match.start())

    def listed(self) -> None:
        """The list of a job's six names."""
        match = _LIST.match(self.text, self.at)
        if match is None:
            self.fail(self.at, "jobs takes the six names of a job, in their order")
            raise AssertionError
        self._finish(match.end())

    def table(self) -> _Value:
        """Numbers in brackets, in rows of one length, and the end of the statement."""
        match = _ROWS.match(self.text, self.at)
        if match is None:
            self._fail_rows()
            raise AssertionError
        begin = match.start(1)
        if _WHOLE.fullmatch(match[1]) is None:
            self._refuse_words(begin, match.end(1))
        rows: list[list[int]] = []
        offset = begin
        for part in _ROW_END.split(match[1]):
            if words := part.replace(",", " ").split():
                rows.append(list(map(int, words)))
                if len(words) != len(rows[0]):
                    self.fail(
                        offset + len(part) - len(part.lstrip()),
                        f"a row has {len(words)} numbers, the first one {len(rows[0])}",
                        "numbers are whole tenths of a millimetre, without decimals",
                    )
            offset += len(part) + 1
        if not rows:
            self.fail(begin, "an array is empty")
        table = np.array(rows, dtype=np.int64)
        if np.abs(table).max() > MOST_NUMBER:
            self._refuse_words(begin, match.end(1))
        self._finish(match.end())
        return _Value(table, begin)

    def _refuse_words(self, begin: int, end: int) -> None:
        """ProgramError at the first word between two places that is no number of an int16."""
        for match in _TOKEN.finditer(self.text, begin, end):
            self._int(match[0], match.start())

    def _int(self, word: str, offset: int) -> int:
        """A word at an offset as a whole number."""
        if _NUMBER.fullmatch(word) is None or abs(int(word)) > MOST_NUMBER:
            self.fail(offset, f"{word[:SHOWN_CHARS]!r} is no whole number of an int16")
        return int(word)

    def _fail_rows(self) -> None:
        """Where an array goes wrong: its opening, a sign in it, or its end."""
        if self.text[self.at : self.at + 1] != "[":
            self.fail(self.at, f"{self._shown(self.at)} is no array", "write [ and ]")
        odd = re.compile(r"[^0-9 \t\r\n,;+-]").search(self.text, self.at + 1)
        if odd is None:
            self.fail(len(self.text), "the program breaks off inside an array")
        elif odd[0] == ".":
            mend = "numbers are whole tenths of a millimetre, without decimals"
            self.fail(odd.start(), "a decimal point in an array", mend)
        else:
            self.fail(odd.start(), f"{self._shown(odd.start())} stands in an array")

    def _finish(self, offset: int) -> None:
        """Nothing but ; and a comment stands behind a value on its line."""
        match = _END.match(self.text, offset)
        if match is None:
            self.fail(offset, f"{self._shown(offset)} stands behind a value")
            raise AssertionError
        self.at = self._blank(match.end())

    def _blank(self, offset: int) -> int:
        match = _BLANK.match(self.text, offset)
        return match.end() if match else offset

    def _shown(self, offset: int) -> str:
        line = self.text[offset : offset + SHOWN_CHARS].splitlines()
        return repr(line[0]) if line else "nothing"

    def _where(self, offset: int) -> str:
        line = self.text.count("\n", 0, offset) + 1
        return f"line {line}, column {offset - self.text.rfind(chr(10), 0, offset)}"
