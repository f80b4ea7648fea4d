"""Reading pic-mmh as its controller decodes it, and more strictly: what it would silently ignore
(L1755-1757) is an error here, with the block and the column.

A program is cut at `;`; line ends and blanks between blocks are passed over. The first characters
choose the pattern that the whole block must match (`patterns`); only a block that does
not is walked word by word, to find where it goes wrong."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final, NoReturn

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.bounds import check_count
from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.machine.model import exceeds
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ..gcode.blocks import fill_forward
from . import blocks
from .dialect import PicMmhMachine
from .findings import BLOCK_TOO_LONG_READ, FEED_ABOVE_LIMIT

MIN_RUN: Final = 24

BLOCKS_AT_ONCE: Final = 1 << 12

UNITS_PER_MM: Final = {"example": 100_000, "annex": 1_000}

SHOWN_CHARS: Final = 48

Shape = tuple[tuple[str, str], ...]
"""The words behind a code: letter and kind of value ("c" is a coordinate)."""

_ARC: Final[Shape] = (("X", "c"), ("Y", "c"), ("I", "c"), ("J", "c"), ("F", "2"))

# Annex A.1, L3265-3471; Z blocks by the same rule (the decoder takes any axis letter, L1817-1849).
SHAPES: Final[dict[str, tuple[Shape, ...]]] = {
    "G00": ((("X", "c"), ("Y", "c")), (("Z", "c"),)),
    "G01": ((("X", "c"), ("Y", "c"), ("F", "2")), (("Z", "c"), ("F", "2"))),
    "G02": (_ARC,),
    "G03": (_ARC,),
    "G04": ((("P", "2"),),),
    "G28": ((("X", "0"), ("Y", "0")), (("Z", "0"),)),
    "G54": ((),),
    "G90": ((),),
    "M03": ((("S", "4"),),),
    "M04": ((("S", "4"),),),
    "M05": ((),),
    "M06": ((("T", "2"),),),
    "M30": ((),),
}

# The routine of the sign asks for "-" and takes anything else for the other sense (L1765-1768);
# "JX+;" shows it a "+" (L1730), so that the example form may have one too.
_COORDINATES: Final = {"example": r"([+-]?\d{5})\.(\d\d)", "annex": r"([+-]\d{5})()"}
_COORDINATE_WORDS: Final = {
    "example": "five digits, a point and two digits (in front of them a sign or none)",
    "annex": "a sign and five digits",
}
_VALUES: Final = {"2": r"(\d\d)", "4": r"(\d{4})", "0": "0"}
_VALUE_WORDS: Final = {"2": "two digits", "4": "four digits", "0": "the digit 0"}

# The interactive commands of the annex (L3474-3505): the operator's, not a program's.
_INTERACTIVE: Final = re.compile(
    r"A|H|Q|W|V|J[XYZ][+-]|&(?:[XYZ][+-]){2,3}|P[XYZ][+-]\d{4}|B[XYZ]\d{3}|F[XYZ][+-]\d{3}"
)

Patterns = dict[str, tuple[tuple[str, re.Pattern[str]], ...]]

BLANKS: Final = " \t\r\n"

MOTIONS: Final = frozenset({"G00", "G01", "G02", "G03"})
EVENTS: Final = {
    "G04": Kind.DWELL,
    "M03": Kind.SPINDLE_CW,
    "M04": Kind.SPINDLE_CCW,
    "M05": Kind.SPINDLE_OFF,
    "M06": Kind.TOOL_CHANGE,
    "M30": Kind.END,
    "G54": Kind.SET_ZERO,
}


def read_program(data: bytes, machine: PicMmhMachine) -> Toolpath:
    """Return the moves of a program; ProgramError with block and column for data that are no
    program."""
    check_count(data.count(b";"), "block")
    _check_bytes(data)
    reader = _Reader(machine)
    octets = np.frombuffer(data, dtype=np.uint8)
    columns = np.zeros((BLOCKS_AT_ONCE, blocks.COLUMNS), dtype=np.int64)
    annex = machine.dialect.form == "annex"
    index, offset = 0, 0
    while (end := data.find(b";", offset)) >= 0:
        # Python objects for each of thousands of moves in a row would be most of the time.
        count, next_offset = blocks.moves_in_a_row(octets, offset, annex, columns)
        if count >= MIN_RUN and not reader.ended:
            reader.moves(index, columns[:count])
            index, offset = index + count, next_offset
            continue
        for _ in range(count + 1):
            if end >= 0:
                reader.block(index, data[offset:end].decode("ascii").strip(BLANKS))
                index, offset = index + 1, end + 1
                end = data.find(b";", offset)
    tail = data[offset:].decode("ascii").strip(BLANKS)
    if tail:
        _fail(index, len(tail), "the program breaks off inside a block", "end it with ;")
    if index == 0:
        raise ProgramError("the program is empty", mend="a program has blocks such as G54;")
    return reader.path.finish(reader.findings())


def _fail(index: int, column: int, message: str, mend: str = "") -> NoReturn:
    """Raise ProgramError at a block (index from 0) and a column (from 1, from its first
    character)."""
    raise ProgramError(message, where=f"block {index + 1}, column {column}", mend=mend)


def _check_bytes(data: bytes) -> None:
    """Raise ProgramError at the first byte that is neither printable ASCII nor a line end."""
    odd = re.search(rb"[^\x20-\x7e\t\r\n]", data)
    if odd:
        before = data[: odd.start()]
        block_begun = before[before.rfind(b";") + 1 :].lstrip(BLANKS.encode())
        _fail(
            before.count(b";"),
            len(block_begun) + 1,
            f"the byte 0x{data[odd.start()]:02x} belongs to no program",
            "give a pic-mmh program",
        )


def _mm(whole_digits: str, decimals: str) -> float:
    """Return a text of µm as mm, by a single division and so the nearest float; `-00000.00` is
    0."""
    return int(whole_digits + decimals) / UNITS_PER_MM["example" if decimals else "annex"]


class _Excess(Struct):
    """Count of blocks beyond a limit, the highest value, and the first of them."""

    count: int = 0
    most: float = 0.0
    first: int = 0

    def add(self, index: int, value: float) -> None:
        self.first = self.first if self.count else index
        self.count += 1
        self.most = max(self.most, value)


class _Reader:
    """Reads blocks and adds rows to the path; keeps the position of the tool and whether the
    program has ended."""

    def __init__(self, machine: PicMmhMachine) -> None:
        dialect = machine.dialect
        self.path = ToolpathBuilder()
        self._form = dialect.form
        self._buffer_chars = dialect.buffer_chars
        self._patterns = patterns(dialect.form)
        self._feeds_per_mm_min = 1.0 / machine.feed.unit_mm_min
        self._max_feed = machine.max_feed_mm_min
        self._zero = machine.controller.machine_zero_mm
        self.ended = False
        self._units_per_mm = UNITS_PER_MM[dialect.form]
        self._long = _Excess()
        self._fast = _Excess()

    def block(self, index: int, text: str) -> None:
        """Decode one block, without its `;` and the blanks around it, and add it to the path."""
        if self.ended:
            _fail(index, 1, "a block after M30, the end of the program", "remove it")
        if self._buffer_chars is not None and len(text) >= self._buffer_chars:
            self._long.add(index, len(text) + 1)
        code = text[:3]
        for letters, pattern in self._patterns.get(code, ()):
            match = pattern.fullmatch(text, 3)
            if match:
                self.path.block = index
                if code in MOTIONS:
                    self._motion(code, letters, match, index)
                else:
                    self._event(code, letters, match, index)
                return
        fault = fault_of(text, self._form)
        _fail(index, fault.column, fault.message, fault.mend)

    def moves(self, first: int, columns: Ints) -> None:
        """Add consecutive blocks of moves to the path, by columns (K, 9) of `blocks`; `first`: the
        index of the first block."""
        if self._buffer_chars is not None:
            for index in np.flatnonzero(columns[:, blocks.LENGTH] >= self._buffer_chars).tolist():
                self._long.add(first + index, int(columns[index, blocks.LENGTH]) + 1)
        kind, is_deep = columns[:, blocks.CODE].copy(), columns[:, blocks.DEEP] != 0
        cut, arc = kind >= Kind.LINE, kind >= Kind.ARC_CW
        feed = np.where(cut, columns[:, blocks.FEED] / self._feeds_per_mm_min, np.nan)
        for index in np.flatnonzero(cut & exceeds(feed, self._max_feed)).tolist():
            self._fast.add(first + index, float(feed[index]))
        mm = columns[:, : blocks.CENTRE_Y + 1] / self._units_per_mm
        self.path.moves(
            kind=kind,
            end=np.column_stack(
                [
                    fill_forward(has_word, mm[:, column], before)
                    for has_word, column, before in zip(
                        (~is_deep, ~is_deep, is_deep),
                        (blocks.X, blocks.Y, blocks.Z),
                        self.path.position,
                        strict=True,
                    )
                ]
            ),
            centre=np.where(arc[:, None], mm[:, blocks.CENTRE_X :], np.nan),
            feed=feed,
            block=np.arange(first, first + len(columns)),
        )

    def findings(self) -> Iterator[Finding]:
        """Yield findings on blocks and feeds beyond the controller's limits."""
        if self._long.count:
            yield BLOCK_TOO_LONG_READ(
                where=f"block {self._long.first + 1}",
                measured=self._long.most,
                limit=self._buffer_chars or 0,
                count=self._long.count,
            )
        if self._fast.count:
            yield FEED_ABOVE_LIMIT(
                where=f"block {self._fast.first + 1}",
                measured=self._fast.most,
                limit=self._max_feed,
                count=self._fast.count,
            )

    def _motion(self, code: str, letters: str, match: re.Match[str], index: int) -> None:
        """Add the row of a block G00 to G03: coordinates are absolute µm, F counts the feed word's
        unit."""
        groups = match.groups()
        feed = self._feed(match, index) if letters[-1] == "F" else 0.0
        if letters[0] == "Z":
            x, y, z = None, None, _mm(*groups[:2])
        else:
            x, y, z = _mm(*groups[:2]), _mm(*groups[2:4]), None
        if code == "G00":
            self.path.rapid(x, y, z)
        elif code == "G01":
            self.path.line(x, y, z, feed=feed)
        elif x is not None and y is not None:
            centre = _mm(*groups[4:6]), _mm(*groups[6:8])
            self.path.arc(x, y, centre=centre, ccw=code == "G03", feed=feed)

    def _feed(self, match: re.Match[str], index: int) -> float:
        """Return a feed in mm/min: F08 is 0.8 mm/min (equation 3.1: tenths of mm/min).
        ProgramError for F00, by which the controller would divide."""
        number = int(match[match.re.groups])
        if number == 0:
            column = match.start(match.re.groups) + 1
            _fail(index, column, "the controller divides by the feed, F00", "write F01 or more")
        feed = number / self._feeds_per_mm_min
        if exceeds(feed, self._max_feed):
            self._fast.add(index, feed)
        return feed

    def _event(self, code: str, letters: str, match: re.Match[str], index: int) -> None:
        """Add the row of a block that is not a move. G90 is always in force here and gives no
        row."""
        x, y, z = self.path.position
        zero_x, zero_y, zero_z = self._zero
        if code == "G90":
            return
        if code == "G28" and letters == "Z":
            self.path.set_position(x, y, zero_z).event(Kind.HOME_Z)
        elif code == "G28":
            self.path.set_position(zero_x, zero_y, z).event(Kind.HOME_XY)
        else:
            if code == "G54" and (x, y, z) != (0.0, 0.0, 0.0):
                message = "G54 away from part zero would shift all that follows"
                _fail(index, 1, message, "set part zero once, before the first move")
            self.path.event(EVENTS[code], int(match[1]) if match.re.groups else None)
            self.ended = code == "M30"


# The grammar of a block: the patterns that match one, and the words that say where it goes wrong.


class BlockFault(Struct, frozen=True):
    """Fault of a block: its column (from 1), what is wrong, and the remedy."""

    column: int
    message: str
    mend: str = ""


def patterns(form: str) -> Patterns:
    """Return for each code its possible shapes: their letters ("XYF") and the pattern of the text
    behind the code.

    A coordinate has two groups, digits before and after the point; other values have one."""
    return {
        code: tuple(
            (
                "".join(letter for letter, _ in shape),
                re.compile("".join(letter + _value(kind, form) for letter, kind in shape)),
            )
            for shape in shapes
        )
        for code, shapes in SHAPES.items()
    }


def fault_of(text: str, form: str) -> BlockFault:
    """Return why a text (without its `;`) is no block of this form."""
    if not text:
        return BlockFault(1, "an empty block", "remove the ; that has nothing before it")
    if _INTERACTIVE.fullmatch(text):
        return BlockFault(
            1, f"{text!r} is an interactive command, not part of a program", "remove it"
        )
    if letter_match := re.search("[a-z]", text[: SHOWN_CHARS * 2]):
        return BlockFault(
            letter_match.start() + 1,
            "this controller takes no small letters",
            "write capital letters",
        )
    if text[0] not in "GM":
        return BlockFault(1, f"{_quoted(text)} is no block: it begins with neither G nor M")
    if not re.match(r"\d\d", text[1:3]):
        return BlockFault(2, f"{_quoted(text)}: wanted two digits after {text[0]}")
    shapes = SHAPES.get(text[:3])
    if shapes is None:
        codes = " ".join(SHAPES)
        return BlockFault(1, f"this controller does not know {text[:3]}", f"it knows {codes}")
    for other in _COORDINATES:
        if any(pattern.fullmatch(text, 3) for _, pattern in patterns(other)[text[:3]]):
            return BlockFault(
                5, f"the block is in the {other} form", f"use --set dialect.form={other}"
            )
    return max((_walk(text, shape, form) for shape in shapes), key=lambda fault: fault.column)


def _value(kind: str, form: str) -> str:
    return _COORDINATES[form] if kind == "c" else _VALUES[kind]


def _walk(text: str, shape: Shape, form: str) -> BlockFault:
    """Return the fault of a text at the first word of the shape that it does not have."""
    offset = 3
    for letter, kind in shape:
        match = re.compile(letter + _value(kind, form)).match(text, offset)
        if match is None:
            offset += text.startswith(letter, offset)
            words = _COORDINATE_WORDS[form] if kind == "c" else _VALUE_WORDS[kind]
            return BlockFault(offset + 1, f"{_quoted(text)}: wanted {letter} with {words}")
        offset = match.end()
    return BlockFault(offset + 1, f"{_quoted(text)}: wanted ; after the last word of {text[:3]}")


def _quoted(text: str) -> str:
    return repr(text if len(text) <= SHOWN_CHARS else f"{text[:SHOWN_CHARS]}…")
