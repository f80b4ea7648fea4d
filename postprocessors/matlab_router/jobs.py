"""Reading a matlab-router program, .m or stream, into jobs: what the master would hold after
receiving one, checked as a whole; and the same for people.

A number that would make a slave run away or never end is an error here, with its place, because
no path could be given: the loop of the slaves runs `distance / 2 − 1` times in an unsigned int16
(L5589-5729), so a distance of 1 (or a first point below 2) runs 65535 times, and a speed of 0
never gets there."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from typing import Final, NoReturn

import numpy as np
from msgspec import Struct

from camtool.arrays import Bools, Ints
from camtool.bounds import check_count as check_size
from camtool.errors import ProgramError
from camtool.toolpath.program import Listing

from .dialect import (
    CHUNK_UNITS,
    MAX_NUMBER,
    UNIT_MM,
    MatlabRouterMachine,
    ResolvedDialect,
    dialect_of,
)

TABLES: Final = ("xy", "lxy", "velxy")
NAMES: Final = (*TABLES, "size_of_array", "first_pointx", "first_pointy")

SHOWN_CHARS: Final = 24

MAX_SHORT_CHARS: Final = 200
"""Arrays of so few characters are read word by word, which takes half the time of numpy."""

_BLANK: Final = re.compile(r"(?:[ \t\r\n]+|%[^\n]*)*")
_NAME: Final = re.compile(r"([A-Za-z]\w*)(?:\{(\d{1,6})\})?[ \t]*=[ \t]*", re.ASCII)
_TEXT_NUMBER: Final = re.compile(r"[+-]?\d{1,5}")
_WHOLE: Final = re.compile(r"(?:[ \t\r\n,;]*[+-]?\d{1,5}(?![0-9+-]))*[ \t\r\n,;]*")
_ROWS: Final = re.compile(r"\[([0-9 \t\r\n,;+-]*)\]")
_TOKEN: Final = re.compile(r"[^ \t\r\n,;]+")
_ROW_END: Final = re.compile(r"[;\n]")
_END: Final = re.compile(r"[ \t]*(?:;[ \t]*)?(?=%|\r?\n|\Z)")
_LIST: Final = re.compile(r"\{" + r",[ \t]*".join(NAMES) + r"\}")

HEADER: Final = ("size_of_array", "first_pointx", "first_pointy")
BODY: Final = {"lxy": 0, "velxy": 2}
"""Index of the row with an array's x, among the four rows of n numbers."""

NUMBERS_PER_LINE: Final = 4
"""In a stream: two distances and two speeds."""

MAX_DIGITS: Final = 5
"""The master's buffer takes six characters, a sign and five digits (L4668-4708)."""

_STREAM_NUMBER: Final = re.compile(rb"-?\d{1,%d}" % MAX_DIGITS)
SHOWN_BYTES: Final = 12

Where = Callable[[str, int, int], str]
"""The place of a number in the file, by the name of its array, its row and its column."""


class ReadJob(Struct, frozen=True, eq=False):
    """A job as read: `first` (2,) and `length` (2, n) units, `speed` (2, n) counts in 5 ms with
    the signs of the directions; `number` from 1; `where` gives the places of its numbers."""

    number: int
    first: Ints
    length: Ints
    speed: Ints
    where: Where

    @property
    def steps(self) -> Ints:
        """Signed distances (2, n) in units that the program asks for."""
        return np.asarray(np.where(self.speed < 0, -self.length, self.length))


def fail(where: str, message: str, mend: str = "") -> NoReturn:
    """Raise ProgramError at a place."""
    raise ProgramError(message, where=where, mend=mend)


def check_count(count: int, place_of: Where, dialect: ResolvedDialect) -> None:
    """Raise ProgramError for a job without lines, or with more than the arrays of the master hold:
    it does not check the number by itself (L4625-4635)."""
    if not 1 <= count <= dialect.max_lines:
        fail(
            place_of("size_of_array", 0, 0),
            f"{count} lines: a job has 1 to {dialect.max_lines}",
            "post the drawing again: it is split into jobs then",
        )


def check_job(job: ReadJob, dialect: ResolvedDialect) -> None:
    """Raise ProgramError for the first number with which the machine would run away or stop."""
    for name, table in (("lxy", job.length), ("velxy", job.speed)):
        _refuse(job, name, np.abs(table) > MAX_NUMBER, "is beyond an int16")
    _refuse(job, "lxy", job.length < 0, "is negative: the sign belongs in velxy")
    runaway = "makes the slave run away"
    if dialect.odd == "truncated":
        _refuse(job, "lxy", job.length == 1, runaway)
    dead = (job.length > 0) & (job.speed == 0)
    _refuse(job, "velxy", dead, "never ends, because its distance is not 0")
    for axis, name in enumerate(("first_pointx", "first_pointy")):
        first = int(job.first[axis])
        if axis == 1 and dialect.master_y == "fixed":
            continue
        if not CHUNK_UNITS <= first <= MAX_NUMBER:
            reason = runaway if 0 <= first < CHUNK_UNITS else "is out of reach"
            fail(
                job.where(name, 0, 0),
                f"a first point at {first} {reason}",
                f"begin {CHUNK_UNITS * UNIT_MM:g} mm from home at the least",
            )


def _refuse(job: ReadJob, name: str, is_bad: Bools, complaint: str) -> None:
    if is_bad.any():
        column, row = (int(index) for index in np.argwhere(is_bad.T)[0])
        table = job.length if name == "lxy" else job.speed
        fail(job.where(name, row, column), f"{int(table[row, column])} in {name} {complaint}")


# The .m file: `name = numbers;` and nothing else. Numbers are read, nothing is ever run.
#
#     xy = [                          two rows of whole numbers; a line's end or ; ends a row
#       151 400
#        86 265
#     ];
#     size_of_array = 1;              one whole number
#     jobs{1} = {xy, lxy, ...};       after a complete job of several: exactly these words
#     % anything                      a comment
#
# A job is complete when each of its six names has been assigned once; the next assignment then
# begins another job.


class _Value(Struct, frozen=True, eq=False):
    """Value of a name: numbers (rows, columns), and the offset of their text."""

    table: Ints
    offset: int


def read_text(data: bytes, dialect: ResolvedDialect) -> Iterator[ReadJob]:
    """Yield the jobs of a .m file, checked; ProgramError naming line and column."""
    text = _Text(data)
    values: dict[str, _Value] = {}
    number = 0
    while not text.ended:
        name, index, offset = text.name()
        if name == "jobs" and index is not None:
            if values or int(index) != number:
                text.fail(offset, f"jobs{{{index}}} does not stand behind job {index}")
            text.listed()
            continue
        if index is not None or name not in NAMES:
            mend = f"a program sets {', '.join(NAMES)} to plain numbers; nothing is run"
            text.fail(offset, f"{name[:SHOWN_CHARS]!r} is none of the arrays", mend)
        if name in values:
            missing = next(expected for expected in NAMES if expected not in values)
            text.fail(offset, f"{name} is assigned twice", f"{missing} of this job is missing")
        values[name] = text.table() if name in TABLES else text.scalar()
        if len(values) == len(NAMES):
            number += 1
            yield _job_of_arrays(text, number, values, dialect)
            values = {}
    if values:
        missing = next(expected for expected in NAMES if expected not in values)
        text.fail(text.at, f"the program ends before {missing} of job {number + 1}")
    if number == 0:
        raise ProgramError("the program is empty", mend="a program sets xy, lxy, velxy, ...")


def _job_of_arrays(
    text: _Text, number: int, values: dict[str, _Value], dialect: ResolvedDialect
) -> ReadJob:
    """Return the six named values of the text as one job; ProgramError where they contradict each
    other."""
    scalar = {name: int(values[name].table[0, 0]) for name in NAMES if name not in TABLES}

    def place_of(name: str, row: int, column: int) -> str:
        return text.where_in(values[name], row, column)

    count = scalar["size_of_array"]
    check_count(count, place_of, dialect)
    for name in TABLES:
        shape = (2, count + 1 if name == "xy" else count)
        if values[name].table.shape != shape:
            rows, columns = values[name].table.shape
            text.fail(
                values[name].offset,
                f"{name} has {rows} rows of {columns} numbers, not {shape[0]} of {shape[1]}",
                f"size_of_array is {count}",
            )
    job = ReadJob(
        number,
        np.array([scalar["first_pointx"], scalar["first_pointy"]]),
        values["lxy"].table,
        values["velxy"].table,
        place_of,
    )
    _check_repeats(job, values["xy"].table)
    check_job(job, dialect)
    return job


def _check_repeats(job: ReadJob, xy: Ints) -> None:
    """Refuse a job whose tables disagree: xy must begin at first_pointx and first_pointy, its
    steps must have the lengths in lxy and the signs of the speeds in velxy."""
    for axis, name in enumerate(("first_pointx", "first_pointy")):
        if int(job.first[axis]) != int(xy[axis, 0]):
            fail(
                job.where(name, 0, 0),
                f"{name} is {int(job.first[axis])}, xy begins at {int(xy[axis, 0])}",
            )
    step = np.diff(xy, axis=1)
    for name, table, is_bad in (
        ("lxy", job.length, np.abs(step) != job.length),
        ("velxy", job.speed, step * job.speed < 0),
    ):
        if is_bad.any():
            column, row = (int(index) for index in np.argwhere(is_bad.T)[0])
            fail(
                job.where(name, row, column),
                f"{int(table[row, column])} in {name} does not fit xy, which goes by"
                f" {int(step[row, column])}",
            )


class _Text:
    """The text of a program, and the offset up to which it has been read."""

    def __init__(self, data: bytes) -> None:
        odd = re.search(rb"[^\x20-\x7e\t\r\n]", data)
        self.text = data[: odd.start() if odd else len(data)].decode("ascii")
        if odd:
            byte = data[odd.start()]
            self.fail(len(self.text), f"the byte 0x{byte:02x} belongs to no program")
        self.at = self._blank(0)

    @property
    def ended(self) -> bool:
        """True if only blanks are left."""
        return self.at == len(self.text)

    def fail(self, offset: int, message: str, mend: str = "") -> NoReturn:
        """Raise ProgramError at an offset."""
        fail(self._where(offset), message, mend)

    def where_in(self, value: _Value, row: int, column: int) -> str:
        """Return the line and column of a number of a table."""
        number = row * value.table.shape[1] + column
        for index, match in enumerate(_TOKEN.finditer(self.text, value.offset)):
            if index == number:
                return self._where(match.start())
        return self._where(value.offset)

    def name(self) -> tuple[str, str | None, int]:
        """Read `name =` or `name{1} =`: return the name, the number in braces, and the offset of
        the name."""
        offset = self.at
        match = _NAME.match(self.text, offset)
        if match is None:
            self.fail(offset, f"{self._quoted(offset)} is no `name = numbers;`", "remove it")
        self.at = match.end()
        return match[1], match[2], offset

    def scalar(self) -> _Value:
        """Read one whole number and the end of its statement."""
        match = _TEXT_NUMBER.match(self.text, self.at)
        if match is None:
            self.fail(self.at, f"{self._quoted(self.at)} is no whole number")
        self._finish(match.end())
        return _Value(np.array([[self._int(match[0], match.start())]]), match.start())

    def listed(self) -> None:
        """Read the list of a job's six names."""
        match = _LIST.match(self.text, self.at)
        if match is None:
            self.fail(self.at, "jobs takes the six names of a job, in their order")
        self._finish(match.end())

    def table(self) -> _Value:
        """Read numbers in brackets, in rows of equal length, and the end of the statement."""
        match = _ROWS.match(self.text, self.at)
        if match is None:
            self._fail_rows()
        begin = match.start(1)
        if _WHOLE.fullmatch(match[1]) is None:
            self._refuse_words(begin, match.end(1))
        rows: list[Ints | list[int]] = []
        offset = begin
        is_short = len(match[1]) <= MAX_SHORT_CHARS
        for part in _ROW_END.split(match[1]):
            if numbers := part.replace(",", " ").strip():
                row: Ints | list[int]
                if is_short:
                    row = [int(word) for word in numbers.split()]
                else:
                    row = np.fromstring(numbers, dtype=np.int64, sep=" ")
                rows.append(row)
                if len(row) != len(rows[0]):
                    self.fail(
                        offset + len(part) - len(part.lstrip()),
                        f"a row has {len(row)} numbers, the first one {len(rows[0])}",
                        "numbers are whole tenths of a millimetre, without decimals",
                    )
            offset += len(part) + 1
        if not rows:
            self.fail(begin, "an array is empty")
        table = np.array(rows, dtype=np.int64)
        if np.abs(table).max() > MAX_NUMBER:
            self._refuse_words(begin, match.end(1))
        self._finish(match.end())
        return _Value(table, begin)

    def _refuse_words(self, begin: int, end: int) -> None:
        """Raise ProgramError at the first word between two places that is no number of an
        int16."""
        for match in _TOKEN.finditer(self.text, begin, end):
            self._int(match[0], match.start())

    def _int(self, word: str, offset: int) -> int:
        """Return the word at an offset as an integer; ProgramError where it is none."""
        if _TEXT_NUMBER.fullmatch(word) is None or abs(int(word)) > MAX_NUMBER:
            self.fail(offset, f"{word[:SHOWN_CHARS]!r} is no whole number of an int16")
        return int(word)

    def _fail_rows(self) -> NoReturn:
        """Refuse an array at its first fault: its opening, a character in it, or its missing
        end."""
        if self.text[self.at : self.at + 1] != "[":
            self.fail(self.at, f"{self._quoted(self.at)} is no array", "write [ and ]")
        odd = re.compile(r"[^0-9 \t\r\n,;+-]").search(self.text, self.at + 1)
        if odd is None:
            self.fail(len(self.text), "the program breaks off inside an array")
        elif odd[0] == ".":
            mend = "numbers are whole tenths of a millimetre, without decimals"
            self.fail(odd.start(), "a decimal point in an array", mend)
        else:
            self.fail(odd.start(), f"{self._quoted(odd.start())} stands in an array")

    def _finish(self, offset: int) -> None:
        """Move behind the end of a statement; ProgramError where more than `;` and a comment
        follows its value on the line."""
        match = _END.match(self.text, offset)
        if match is None:
            self.fail(offset, f"{self._quoted(offset)} stands behind a value")
        self.at = self._blank(match.end())

    def _blank(self, offset: int) -> int:
        match = _BLANK.match(self.text, offset)
        return match.end() if match else offset

    def _quoted(self, offset: int) -> str:
        line = self.text[offset : offset + SHOWN_CHARS].splitlines()
        return repr(line[0]) if line else "nothing"

    def _where(self, offset: int) -> str:
        line = self.text.count("\n", 0, offset) + 1
        return f"line {line}, column {offset - self.text.rfind(chr(10), 0, offset)}"


# The serial stream, read as the master does: numbers in digits, each ended by a carriage return,
# in this order: lines n, first x, first y, n lx, n ly, n velx, n vely (L4294-4360, L4668-4708).
# Jobs follow one another; a master takes one and must be reset for the next.


def read_stream(data: bytes, dialect: ResolvedDialect) -> Iterator[ReadJob]:
    """Yield the jobs of a stream, checked; ProgramError naming job, number and byte."""
    if not data:
        raise ProgramError("the stream is empty", mend="a stream begins with the count of lines")
    check_size(data.count(b"\r") // NUMBERS_PER_LINE, "line")
    feed = data.find(b"\r\n") if dialect.first_y == "number" else -1
    if feed >= 0:
        fail(f"byte {feed + 2}", "a line feed: the master takes it for part of the next number")
    words = data.split(b"\r")
    if words[-1]:
        offset = len(data) - len(words[-1]) + 1
        fail(f"byte {offset}", "the stream breaks off inside a number", "end it with a CR")
    words.pop()
    first = 0
    number = 0
    while first < len(words):
        number += 1
        job = _job_of_words(words, first, number, dialect)
        check_job(job, dialect)
        yield job
        first += len(HEADER) + 2 * job.length.size


def _job_of_words(
    words: list[bytes], first: int, number: int, dialect: ResolvedDialect
) -> ReadJob:
    """Return the job whose header begins at this word."""

    def place(word: int) -> str:
        byte = sum(map(len, words[: first + word])) + first + word + 1
        return f"job {number}, number {word + 1}, byte {byte}"

    def place_of(name: str, row: int, column: int) -> str:
        if name in HEADER:
            return place(HEADER.index(name))
        return place(len(HEADER) + (BODY[name] + row) * count + column)

    head = words[first : first + len(HEADER)]
    if len(head) < len(HEADER):
        fail(place(len(head)), "the stream ends inside the header of a job")
    for index in (0, 1):
        if _STREAM_NUMBER.fullmatch(head[index]) is None:
            _fail_number(head[index], place(index))
    count, x = int(head[0]), int(head[1])
    check_count(count, place_of, dialect)
    y = _first_y(head[2], place, dialect)
    begin = first + len(HEADER)
    body = words[begin : begin + 4 * count]
    for index, word in enumerate(body):
        if _STREAM_NUMBER.fullmatch(word) is None:
            _fail_number(word, place(len(HEADER) + index))
    if len(body) < 4 * count:
        fail(
            place(len(HEADER) + len(body)),
            f"the stream ends after {len(body)} of {4 * count} numbers",
            f"a job of {count} lines has four for each",
        )
    table = np.array(list(map(int, body)), dtype=np.int64).reshape(4, count)
    return ReadJob(number, np.array([x, y]), table[:2], table[2:], place_of)


def _fail_number(word: bytes, where: str) -> NoReturn:
    fail(
        where,
        f"{word[:SHOWN_BYTES]!r} is no whole number of at most {MAX_DIGITS} digits",
        "each number is digits and a CR, nothing else",
    )


def _first_y(word: bytes, place: Callable[[int], str], dialect: ResolvedDialect) -> int:
    """Return y of the first point. Sent as one character, it is what the master's atol makes of
    it: a digit's value, else 0."""
    if dialect.first_y == "character":
        if len(word) != 1:
            fail(
                place(2),
                f"{word[:SHOWN_BYTES]!r} is not one character",
                "use --set dialect.first_y=number",
            )
        return int(word) if word.isdigit() else 0
    if _STREAM_NUMBER.fullmatch(word) is None:
        if len(word) == 1:
            fail(
                place(2),
                f"y of the first point is the character {word!r}, as the listing sends it",
                "use --set dialect.profile=listing",
            )
        _fail_number(word, place(2))
    return int(word)


# The listing: each block as the columns of the arrays that make it, 1-based as there.
#
# The .m file has no lines that are blocks. A block is a column of three arrays, so it is shown as
# those columns, in the words of the language: `xy(:,13) = [400; 265]; lxy(:,12) = [249; 179];
# velxy(:,12) = [480; 345];`. A job's own block, the move to its first point, is that point. The
# serial stream has no names; its numbers are shown with the names of the arrays that they fill.


def listing(data: bytes, machine: MatlabRouterMachine) -> Listing:
    """Return the blocks of a program that its reader takes."""
    dialect = dialect_of(machine)
    if dialect.format == "stream":
        jobs = [_stream_numbers(words) for words in _words_of(data, read_stream(data, dialect))]
    else:
        jobs = [_arrays(job) for job in read_text(data, dialect)]
    if len(jobs) == 1:
        return Listing(tuple(jobs[0]))
    named = ([f"job {number}: {block}" for block in job] for number, job in enumerate(jobs, 1))
    return Listing(tuple(block for job in named for block in job))


def _arrays(job: ReadJob) -> list[str]:
    """Return the first point of a job, then one column of `xy`, `lxy` and `velxy` for each line,
    as text."""
    x, y = job.first.tolist()
    points = (job.first[:, None] + job.steps.cumsum(axis=1)).T.tolist()
    lengths, speeds = job.length.T.tolist(), job.speed.T.tolist()
    return [
        f"xy(:,1) = [{x}; {y}]; first_pointx = {x}; first_pointy = {y};",
        *(
            f"xy(:,{column + 1}) = [{end[0]}; {end[1]}]; "
            f"lxy(:,{column}) = [{length[0]}; {length[1]}]; "
            f"velxy(:,{column}) = [{speed[0]}; {speed[1]}];"
            for column, (end, length, speed) in enumerate(
                zip(points, lengths, speeds, strict=True), 1
            )
        ),
    ]


def _words_of(data: bytes, jobs: Iterator[ReadJob]) -> Iterator[list[str]]:
    """Yield for each job the numbers of the stream as text; unprintable characters are escaped."""
    escaped = data.decode("latin-1").encode("unicode_escape").decode("ascii")
    words = escaped.split(r"\r")
    begin = 0
    for job in jobs:
        end = begin + len(HEADER) + 2 * job.length.size
        yield words[begin:end]
        begin = end


def _stream_numbers(words: list[str]) -> list[str]:
    """Return the header of a job, then the four numbers of each line, one text each."""
    count = int(words[0])
    body = words[len(HEADER) :]
    head = (f"{name} {word}" for name, word in zip(HEADER, words, strict=False))
    rows = [body[row * count : (row + 1) * count] for row in range(4)]
    return [
        "  ".join(head),
        *(
            f"lxy {column}: {lx} {ly}  velxy {column}: {vx} {vy}"
            for column, (lx, ly, vx, vy) in enumerate(zip(*rows, strict=True), 1)
        ),
    ]
