"""Reading i8751: packets, a listing or a hex dump as the moves that the controller makes of them.

A record becomes up to four rows: X and Y, the wait T1, Z, the wait T2. Its block is its number,
from 0; the END has the block after the last record. Ends are steps times the coded step.

The machine has one speed, so nothing distinguishes a rapid from a cut. Part zero is the top of the
stock: in a program that goes below it, what stays at or above it and what rises straight up are
rapids, the rest are lines. Their feed is the length of the line over the controller's time for it,
ramps and dog-leg included."""

from __future__ import annotations

import math
import re
from array import array
from bisect import bisect_right
from collections.abc import Iterator
from itertools import islice
from typing import Final, NamedTuple, NoReturn

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Floats, Ints
from camtool.bounds import check_count
from camtool.errors import ProgramError
from camtool.findings import Finding
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from . import packets
from .dialect import MAX_DWELL_BYTE_S, RECORDS_PER_PACKET, I8751Dialect, I8751Machine
from .findings import READ_TWO_WAYS, VALUE_ROUNDED
from .pulses import PulseTimes

SHOWN_CHARS: Final = 40


ACCESS: Final = 0x13
PACKET_END: Final = 0x45
DATA_END: Final = 0x54
STANDS: Final = 5
"""The sense of a motor that stands, as it is read."""

RECORDS_AT_ONCE: Final = 1 << 14

Shorts = npt.NDArray[np.int32]


class Decoded(Struct, frozen=True, eq=False):
    """R records as the controller holds them: steps (R, 3), signed by part axes, and waits (R, 2)
    s; `rounded` distances of a listing that were no whole steps, the worst off by so many."""

    steps: Shorts
    waits: Shorts
    rounded: int = 0
    worst_steps: float = 0.0


class ByteFault(Exception):
    """A byte (offset from 0) that no controller could take at this place of a record (from 0).

    The reader of packets or of a hex dump turns it into a ProgramError with its place."""

    def __init__(self, offset: int, record: int, message: str, mend: str) -> None:
        self.offset = offset
        self.record = record
        self.message = message
        self.mend = mend
        super().__init__(message)


def read_program(data: bytes, machine: I8751Machine) -> Toolpath:
    """Return the moves of a program; ProgramError naming record and byte, or line and column."""
    return _toolpath(decoded_records(data, machine), machine, np.zeros(3, dtype=np.int64))


def read_packet(records: bytes, machine: I8751Machine, start_steps: Ints) -> Toolpath:
    """Return the moves of the records of one packet for a machine that stands at `start_steps`
    (3,), counted from part zero; ProgramError as `read_program`."""
    stream = bytes([ACCESS]) + records + bytes([PACKET_END, DATA_END])
    return _toolpath(_read_packets(stream, machine.dialect), machine, start_steps)


def decoded_records(data: bytes, machine: I8751Machine) -> Decoded:
    """Return the records of a program in any of its three forms; ProgramError as
    `read_program`."""
    dialect = machine.dialect
    if not data:
        raise ProgramError("the program is empty", mend="give a file of i8751 packets")
    if dialect.format == "listing":
        return ListingReader(machine, dialect).read(data)
    if dialect.format == "hex":
        return read_dump(data, dialect)
    return _read_packets(data, dialect)


def _read_packets(data: bytes, dialect: I8751Dialect) -> Decoded:
    try:
        return PacketReader(data, dialect).read()
    except ByteFault as fault:
        mend = fault.mend
        if fault.offset == 0:
            mend = "for text, use --set dialect.format=listing or hex; " + mend
        raise ProgramError(
            fault.message,
            where=f"record {fault.record + 1}, byte {fault.offset + 1} "
            f"(offset {fault.offset:04X})",
            mend=mend,
        ) from None


def _toolpath(decoded: Decoded, machine: I8751Machine, start_steps: Ints) -> Toolpath:
    """Return the rows of all records, then END; the first begins at `start_steps` (3,), counted
    from part zero."""
    dialect = machine.dialect
    step_mm = np.array([axis.coded_step_mm for axis in machine.axes])
    x, y, z = (start_steps * step_mm).tolist()
    path, times = ToolpathBuilder(start=(x, y, z)), PulseTimes(dialect)
    goes_below = bool((start_steps[2] + np.cumsum(decoded.steps[:, 2]) < 0).any())
    for low in range(0, len(decoded.steps), RECORDS_AT_ONCE):
        records = slice(low, low + RECORDS_AT_ONCE)
        steps, waits = decoded.steps[records].astype(np.int64), decoded.waits[records]
        moves_xy, moves_z = steps[:, :2].any(axis=1), steps[:, 2] != 0
        present = np.column_stack([moves_xy, waits[:, 0] > 0, moves_z, waits[:, 1] > 0])
        # Slots 0 to 3 of a record: X and Y, T1, Z, T2.
        record, slot = np.nonzero(present)
        places = start_steps + np.cumsum(steps, axis=0)
        start_steps = places[-1]
        ends = places[record]
        # X and Y have moved before Z does.
        before_z = slot < 2
        ends[before_z, 2] -= steps[record[before_z], 2]
        is_wait = slot % 2 == 1
        lines = _kinds(ends, steps[record], slot, goes_below=goes_below)
        kind = np.where(is_wait, np.int64(Kind.DWELL), lines)
        feeds = np.column_stack(_feeds(steps, step_mm, times))[record, slot // 2]
        if len(record):
            path.moves(
                kind=kind,
                end=ends * step_mm,
                centre=np.full((len(record), 2), np.nan),
                feed=np.where(kind == Kind.LINE, feeds, np.nan),
                value=np.where(is_wait, waits[record, slot // 2].astype(np.float64), np.nan),
                block=low + record,
            )
    path.block = len(decoded.steps)
    return path.event(Kind.END).finish((*_findings(decoded), *_two_ways(decoded, dialect)))


def _kinds(ends: Ints, steps: Ints, slot: Ints, *, goes_below: bool) -> Ints:
    """Return RAPID or LINE for each row by where it runs; the value for waits has no meaning.
    `goes_below`: true if the program goes below part zero; otherwise all rows are LINE."""
    if not goes_below:
        return np.full(len(ends), np.int64(Kind.LINE))
    is_z = slot >= 2
    start_z = ends[:, 2] - np.where(is_z, steps[:, 2], 0)
    above = np.minimum(start_z, ends[:, 2]) >= 0
    rises = is_z & (steps[:, 2] > 0)
    return np.where(above | rises, np.int64(Kind.RAPID), np.int64(Kind.LINE))


def _feeds(steps: Ints, step_mm: Floats, times: PulseTimes) -> list[Floats]:
    """Return the feeds (R,) in X and Y and those (R,) in Z, mm/min; NaN where nothing moves."""
    travel_xy = np.hypot(*(steps[:, :2] * step_mm[:2]).T)
    travel_z = np.abs(steps[:, 2]) * step_mm[2]
    with np.errstate(invalid="ignore", divide="ignore"):
        return [
            60.0 * travel_xy / times.legs_s(steps[:, :2]).sum(axis=1),
            60.0 * travel_z / times.alone_s(steps[:, 2]),
        ]


def _two_ways(decoded: Decoded, dialect: I8751Dialect) -> Iterator[Finding]:
    """Yield READ_TWO_WAYS if runs have a high byte, whose unit may be 256 steps or 255."""
    if dialect.long_runs:
        return
    count, record, totals = 0, -1, np.zeros(3, dtype=np.int64)
    for low in range(0, len(decoded.steps), RECORDS_AT_ONCE):
        steps = decoded.steps[low : low + RECORDS_AT_ONCE].astype(np.int64)
        pulses = dialect.pulses(steps)
        high = pulses // dialect.high_byte_steps
        has_high = (high > 0).any(axis=1)
        if has_high.any() and record < 0:
            record = low + int(has_high.argmax())
        count += int((high > 0).sum())
        totals += high.sum(axis=0)
    if count:
        yield READ_TWO_WAYS(
            where=f"record {record + 1}",
            measured=count,
            high_byte=dialect.high_byte,
            steps=int(totals.max()),
        )


def _findings(decoded: Decoded) -> tuple[Finding, ...]:
    if not decoded.rounded:
        return ()
    return (VALUE_ROUNDED(measured=decoded.worst_steps, count=decoded.rounded),)


# Packets: bytes as the controller stores them, and refused where it could not.
#
# Records are read by columns; only one that is none is walked byte by byte, to find where it goes
# wrong.


class PacketReader:
    """Bytes in, records out; ByteFault at the first byte that does not fit."""

    def __init__(self, data: bytes, dialect: I8751Dialect) -> None:
        self._data = data
        self._dialect = dialect
        self._parts: list[Shorts] = []
        self._records = 0
        self._at = 0
        self._inside = 0
        """Count of the records of the packet read so far."""

    def read(self) -> Decoded:
        """Read the stream to its end and return all records."""
        self._take_key()
        while True:
            self._records_in_a_row()
            byte = self._peek("motor 01H of a record" + (", or 45H" if self._inside else ""))
            if not (self._inside and byte == PACKET_END):
                self._refuse_record(byte)
            self._at, self._inside = self._at + 1, 0
            if self._peek("45H before it ended a packet: now 54H or another packet") == DATA_END:
                break
            if self._dialect.key == "each-packet":
                self._take_key()
        if self._at + 1 != len(self._data):
            raise self._fault(self._at + 1, "a byte after 54H, the end of data", "remove it")
        table = np.concatenate(self._parts)
        return Decoded(table[:, : packets.BEFORE], table[:, packets.BEFORE :])

    def _records_in_a_row(self) -> None:
        """Read records, by the compiled loop, up to the first bytes that are none or to where the
        packets end."""
        dialect = self._dialect
        octets = np.frombuffer(self._data, dtype=np.uint8)
        table = np.empty((RECORDS_AT_ONCE, packets.COLUMNS), dtype=np.int64)
        rules = (
            RECORDS_PER_PACKET,
            dialect.high_byte_steps,
            dialect.lost_pulses,
            dialect.dwell_mark_byte,
            dialect.key == "each-packet",
        )
        count = RECORDS_AT_ONCE
        while count == RECORDS_AT_ONCE:
            count, self._at, self._inside = packets.records_in_a_row(
                octets, (self._at, self._inside), rules, table
            )
            read = table[:count].astype(np.int32)
            read[:, : packets.BEFORE] *= np.array(dialect.signs, dtype=np.int32)
            self._parts.append(read)
            self._records += count
            check_count(self._records, "record")

    def _peek(self, expected: str) -> int:
        """Return the next byte without moving on; a fault that names what was `expected` when
        there is none."""
        if self._at >= len(self._data):
            raise self._fault(self._at, f"the program breaks off: wanted {expected}")
        return self._data[self._at]

    def _take_key(self) -> None:
        if self._peek("the access key 13H") != ACCESS:
            mend = "see dialect.key" if self._at else "give a file of i8751 packets"
            byte = self._data[self._at]
            raise self._fault(self._at, f"{byte:02X}H is not the access key 13H", mend)
        self._at += 1

    def _refuse_record(self, byte: int) -> NoReturn:
        """Raise ByteFault at the first byte that does not fit into a record."""
        if self._inside == RECORDS_PER_PACKET:
            raise self._fault(
                self._at,
                f"{byte:02X}H where the packet must end: it has {RECORDS_PER_PACKET} records",
                "end it with 45H",
            )
        for motor in self._walk():
            if self._data[motor + 1] != STANDS and not any(self._data[motor + 2 : motor + 4]):
                raise self._fault(
                    motor + 2,
                    "a motor turns, but for 0 steps",
                    "write 05H for a motor that stands",
                )
        raise self._fault(self._at, "bytes that are not a record")

    def _walk(self) -> tuple[int, int, int]:
        """Return the offsets at which the three motors of the record begin; ByteFault for bytes
        that do not have the form of a record."""
        second = self._motor(self._at, 1)
        third = self._wait(self._motor(second, 2), "T1")
        self._wait(self._motor(third, 3), "T2")
        return self._at, second, third

    def _motor(self, place: int, number: int) -> int:
        self._want(place, (number,), f"motor {number:02d}H")
        self._want(place + 1, (3, 4, 5), f"the sense of motor {number}: 03H, 04H or 05H")
        if self._data[place + 1] == STANDS:
            return place + 2
        self._want(place + 2, None, f"PH of motor {number}")
        self._want(place + 3, None, f"PL of motor {number}")
        return place + 4

    def _wait(self, place: int, name: str) -> int:
        mark = self._dialect.dwell_mark_byte
        self._want(place, (mark,), f"{mark:02X}H before {name}")
        self._want(place + 1, None, f"the seconds of {name}")
        return place + 2

    def _want(self, place: int, allowed: tuple[int, ...] | None, expected: str) -> None:
        if place >= len(self._data):
            raise self._fault(place, f"the program breaks off: wanted {expected}")
        byte = self._data[place]
        if allowed is not None and byte not in allowed:
            mend = ""
            if {byte, *allowed} == {0x00, 0x30}:
                mend = f"use --set dialect.dwell_mark={byte:02X}H"
            raise self._fault(place, f"{byte:02X}H: wanted {expected}", mend)

    def _fault(self, place: int, message: str, mend: str = "") -> ByteFault:
        return ByteFault(place, self._records, message, mend)


def replies(data: bytes, decoded: Decoded, dialect: I8751Dialect) -> list[str]:
    """Return the reply that the controller gives to each byte of a decoded stream."""
    to_wait = dialect.dwell_replies
    standing = [dialect.motor_reply, "M"]
    moving = [dialect.motor_reply, "M", "M", "M"]
    answers: list[str] = []
    for _ in range(len(decoded.steps)):
        if data[len(answers)] == ACCESS:
            answers.append("LISTO")
        for motor in range(3):
            answers += standing if data[len(answers) + 1] == 5 else moving
            if motor:
                answers += to_wait
        # A record begins with 01H, so that this cannot be the first byte of the next one.
        if data[len(answers)] == PACKET_END:
            answers.append("F")
    return [*answers, "A"]


# The signed-mm listing: `X+10.000 Y-2.500 T0 Z+0.000 T0`, one record a line, END last.
#
# Every word must be there, in this order, every distance with its sign (L5250-5254). A distance is
# rounded to whole steps, as the operator's program must do; each on its own.

WHOLE_STEP_TOLERANCE: Final = 0.05
"""A distance within this much (in steps) of a whole step counts as that step, without a
finding."""

SHOWN_AHEAD: Final = 12
"""A comma up to this many characters after the fault is taken for a decimal one."""

LAST_LINE: Final = "END"

_DISTANCE: Final = r"([+-]\d{1,6}\.\d{1,9})"
_WORDS: Final = (
    ("X", _DISTANCE, "X with a sign, digits, a point and decimals"),
    ("Y", _DISTANCE, "Y with a sign, digits, a point and decimals"),
    ("T", r"(\d{1,3})", "T with whole seconds"),
    ("Z", _DISTANCE, "Z with a sign, digits, a point and decimals"),
    ("T", r"(\d{1,3})", "T with whole seconds"),
)
_BETWEEN: Final = "[ \t]+"
_RECORD: Final = re.compile(_BETWEEN.join(letter + value for letter, value, _ in _WORDS))


class ListingReader:
    """Lines in, records out; ProgramError with record, line and column."""

    def __init__(self, machine: I8751Machine, dialect: I8751Dialect) -> None:
        self._step_mm = [axis.coded_step_mm for axis in machine.axes]
        self._most = dialect.encodable_steps
        self._numbers = array("i")
        """Those of all records, five each."""
        self._rounded = 0
        self._worst = 0.0
        self._line = 0

    def read(self, data: bytes) -> Decoded:
        """Read a listing and return all records."""
        check_count(_line_ends(data), "line")
        lines = text_lines(data)
        is_ended = False
        for self._line, line in enumerate(lines, 1):
            text = line.strip(" \t")
            if not text or text.startswith(";"):
                continue
            indent = len(line) - len(line.lstrip(" \t"))
            if is_ended:
                raise self._error(indent, f"{quote_line(text)} after END", "remove it")
            is_ended = text == LAST_LINE
            if not is_ended:
                self._record(text, indent)
        if not is_ended:
            raise self._error(len(lines[-1]), "the listing breaks off", "its last line is END")
        if not self._numbers:
            raise ProgramError("the program is empty", mend="a listing has records before END")
        table = np.array(self._numbers, dtype=np.int32).reshape(-1, len(_WORDS))
        return Decoded(table[:, :3], table[:, 3:], self._rounded, self._worst)

    def _record(self, text: str, indent: int) -> None:
        match = _RECORD.fullmatch(text)
        if match is None:
            raise self._record_error(text, indent)
        waits = (
            self._wait(match[3], indent + match.start(3)),
            self._wait(match[5], indent + match.start(5)),
        )
        steps = [
            self._whole_steps(match[group], axis, indent + match.start(group))
            for axis, group in enumerate((1, 2, 4))
        ]
        self._numbers.extend((*steps, *waits))

    def _whole_steps(self, text: str, axis: int, column: int) -> int:
        """Return a distance as whole steps, half a step rounded away from zero."""
        exact = abs(float(text)) / self._step_mm[axis]
        steps = math.floor(exact + 0.5)
        if steps > self._most:
            raise self._error(
                column, f"{text} mm is more than {self._most} steps", "write it as two records"
            )
        deviation = abs(exact - steps)
        if deviation > WHOLE_STEP_TOLERANCE:
            self._rounded += 1
            self._worst = max(self._worst, deviation)
        return -steps if text[0] == "-" else steps

    def _wait(self, text: str, column: int) -> int:
        seconds = int(text)
        if seconds > MAX_DWELL_BYTE_S:
            raise self._error(
                column,
                f"{seconds} s is more than a byte holds",
                f"use {MAX_DWELL_BYTE_S} s or less, and another record for the rest",
            )
        return seconds

    def _record_error(self, text: str, indent: int) -> ProgramError:
        """Return the error for the first word of a line that does not fit into a record."""
        place, expected = 0, "nothing more"
        for number, (letter, value, meaning) in enumerate(_WORDS):
            word = re.compile((_BETWEEN if number else "") + letter + value).match(text, place)
            if word is None:
                expected = meaning
                break
            place = word.end()
        blanks = re.compile("[ \t]*").match(text, place)
        column = blanks.end() if blanks else place
        mend = "write a point, no comma" if "," in text[: column + SHOWN_AHEAD] else ""
        return self._error(indent + column, f"{quote_line(text)}: wanted {expected}", mend)

    def _error(self, column: int, message: str, mend: str) -> ProgramError:
        """Return ProgramError for a column (from 0) of the current line."""
        record = len(self._numbers) // len(_WORDS) + 1
        where = f"record {record}, line {self._line}, column {column + 1}"
        return ProgramError(message, where=where, mend=mend)


# The hex dump: offset, bytes, and after `;` a comment that may state the replies.
#
# Offsets must be those of the bytes, and replies those that the bytes get; other comments are
# ignored.

_LINE: Final = re.compile(r"([0-9A-Fa-f]{4,8})[ \t]+([0-9A-Fa-f][0-9A-Fa-f \t]*)(?:;(.*))?")

LINES_OF_RECORD: Final = 5
"""A dump has one for each motor and for each wait of a record."""

_REPLIES: Final = re.compile(r"<-([^<]*)$")


class _Run(NamedTuple):
    """A line with bytes: its number from 1, the offset of its first byte, how many, the column
    of its first byte from 1, and its comment."""

    line: int
    offset: int
    size: int
    column: int
    comment: str


def read_dump(data: bytes, dialect: I8751Dialect) -> Decoded:
    """Return the records of a hex dump; ProgramError with record, byte, line and column."""
    check_count(_line_ends(data) // LINES_OF_RECORD, "record")
    lines = text_lines(data)
    runs, stream = _runs(lines)
    if not runs:
        raise ProgramError("the program is empty", mend="give a hex dump of i8751 packets")
    try:
        decoded = PacketReader(stream, dialect).read()
    except ByteFault as fault:
        raise _place_by_offset(fault, runs, lines) from None
    _check_replies(runs, replies(stream, decoded, dialect))
    if lines[-1]:
        raise ProgramError(
            "the last line has no end: is the dump complete?",
            where=f"line {len(lines)}, column {len(lines[-1]) + 1}",
            mend="end it with a line end",
        )
    return decoded


def _runs(lines: list[str]) -> tuple[list[_Run], bytes]:
    """Return the runs of bytes by line, and all bytes in order."""
    runs: list[_Run] = []
    stream = bytearray()
    for number, line in enumerate(lines, 1):
        if not line.strip() or line.lstrip().startswith(";"):
            continue
        match = _LINE.fullmatch(line)
        octets = _bytes(match[2]) if match else b""
        if match is None or not octets:
            raise _line_error(number, line)
        if int(match[1], 16) != len(stream):
            raise ProgramError(
                f"offset {match[1]}, but {len(stream):04X} bytes came before",
                where=f"line {number}, column 1",
                mend="look for a line that is missing or doubled",
            )
        column = match.start(2) + 1
        runs.append(_Run(number, len(stream), len(octets), column, match[3] or ""))
        stream += octets
    return runs, bytes(stream)


def _bytes(text: str) -> bytes:
    """Return the bytes of a text of hex digit pairs with blanks between them; b"" for any other
    text."""
    try:
        return bytes.fromhex(text)
    except ValueError:
        return b""


def _line_error(number: int, line: str) -> ProgramError:
    """Return the error for a line that is not a line of a hex dump, with the column of its first
    wrong character."""
    offset = re.match(r"[0-9A-Fa-f]{4,8}(?=[ \t]|$)", line)
    column = 1
    if offset:
        valid_part = re.match(r"[ \t]*(?:[0-9A-Fa-f]{2}(?:[ \t]+|$))*", line[offset.end() :])
        column = offset.end() + (valid_part.end() if valid_part else 0) + 1
    return ProgramError(
        f"{quote_line(line)} is no line of a hex dump: wanted an offset of four digits or more, "
        "bytes of two digits, and perhaps a comment behind a semicolon",
        where=f"line {number}, column {column}",
        mend="for a listing, use --set dialect.format=listing",
    )


def _place_by_offset(fault: ByteFault, runs: list[_Run], lines: list[str]) -> ProgramError:
    """Return a fault at a byte offset as ProgramError with the line and column of that byte in the
    dump."""
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
    """Raise ProgramError where a comment states a reply, other than ?, that the protocol does not
    give."""
    for run in runs:
        stated = _REPLIES.search(run.comment)
        if not stated:
            continue
        due = expected[run.offset : run.offset + run.size]
        replies = stated[1].split()
        unknown = [a if b == "?" else b for a, b in zip(due, replies, strict=False)]
        if len(replies) != len(due) or unknown != due:
            raise ProgramError(
                f"replies {quote_line(' '.join(replies))}, expected {quote_line(' '.join(due))}",
                where=f"offset {run.offset:04X}, line {run.line}",
                mend="see dialect.motor_reply and dialect.dwell_reply, or leave out the replies",
            )


# Both texts.


def text_lines(data: bytes) -> list[str]:
    """Return the lines of a text without their ends (CR LF, LF or CR); ProgramError at the
    first byte that is no printable ASCII."""
    odd = re.search(rb"[^\x20-\x7e\t\r\n]", data)
    if odd:
        lines = re.split(rb"\r\n|\n|\r", data[: odd.start()])
        raise ProgramError(
            f"the byte {data[odd.start()]:02X}H belongs to no text",
            where=f"line {len(lines)}, column {len(lines[-1]) + 1}",
            mend="for packets, use --set dialect.format=packets",
        )
    return re.split("\r\n|\n|\r", data.decode("ascii"))


def _line_ends(data: bytes) -> int:
    """Return the number of line ends, be they CR, LF or CR LF."""
    return max(data.count(b"\n"), data.count(b"\r"))


def quote_line(text: str) -> str:
    """Quote a line for a message, cut when long."""
    return repr(text if len(text) <= SHOWN_CHARS else text[:SHOWN_CHARS] + "…")
