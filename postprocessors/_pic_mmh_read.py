"""Reading pic-mmh as its controller decodes it, and more strictly: what it would silently ignore
(L1755-1757) is an error here, with the block and the column.

A program is cut at `;`; line ends and blanks between blocks are passed over. The first characters
choose the pattern that the whole block must match (`_pic_mmh_grammar`); only a block that does
not is walked word by word, to say where it goes wrong.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, NoReturn

from camtool.errors import ProgramError
from camtool.findings import Code, Finding, Severity
from camtool.machine.model import Machine
from camtool.toolpath.builder import ToolpathBuilder
from camtool.toolpath.moves import Kind, Toolpath

from ._pic_mmh_grammar import fault_of, patterns
from ._pic_mmh_options import dialect_of

BLANKS: Final = " \t\r\n"

FEED_GUARD: Final = 1e-9
"""Part of a feed: a feed above its limit by less is at the limit."""

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


def read_program(data: bytes, machine: Machine) -> Toolpath:
    """The moves of a program; ProgramError naming block and column when it is none."""
    *blocks, rest = _ascii(data).split(";")
    reader = _Reader(machine)
    for index, block in enumerate(blocks):
        reader.block(index, block.strip(BLANKS))
    tail = rest.strip(BLANKS)
    if tail:
        _fail(len(blocks), len(tail), "the program breaks off inside a block", "end it with ;")
    if not blocks:
        raise ProgramError("the program is empty", mend="a program has blocks such as G54;")
    return reader.path.finish(reader.findings())


def _fail(index: int, column: int, message: str, mend: str = "") -> NoReturn:
    """ProgramError at a block (index from 0) and a column (from 1, from its first character)."""
    raise ProgramError(message, where=f"block {index + 1}, column {column}", mend=mend)


def _ascii(data: bytes) -> str:
    """The text; ProgramError at the first byte that is no printable ASCII and no line end."""
    odd = re.search(rb"[^\x20-\x7e\t\r\n]", data)
    if odd:
        before = data[: odd.start()]
        begun = before[before.rfind(b";") + 1 :].lstrip(BLANKS.encode())
        _fail(
            before.count(b";"),
            len(begun) + 1,
            f"the byte 0x{data[odd.start()]:02x} belongs to no program",
            "give a pic-mmh program",
        )
    return data.decode("ascii")


def _mm(whole: str, decimals: str) -> float:
    """µm as text, in mm by a single division, so the nearest float; `-00000.00` is 0."""
    return int(whole + decimals) / (100_000 if decimals else 1_000)


@dataclass
class _Excess:
    """How many blocks go beyond a limit, by how much at most, and where first."""

    count: int = 0
    most: float = 0.0
    first: int = 0

    def add(self, index: int, value: float) -> None:
        self.first = self.first if self.count else index
        self.count += 1
        self.most = max(self.most, value)


class _Reader:
    """Blocks in, rows out; knows where the tool stands and whether the program has ended."""

    def __init__(self, machine: Machine) -> None:
        dialect = dialect_of(machine)
        self.path = ToolpathBuilder()
        self._form = dialect.form
        self._buffer_chars = dialect.buffer_chars
        self._patterns = patterns(dialect.form)
        self._feeds_per_mm_min = 1.0 / machine.feed.unit_mm_min
        self._max_feed = machine.max_feed_mm_min
        self._zero = machine.controller.machine_zero_mm
        self._ended = False
        self._long = _Excess()
        self._fast = _Excess()

    def block(self, index: int, text: str) -> None:
        """One block, without its `;` and the blanks around it."""
        if self._ended:
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

    def findings(self) -> tuple[Finding, ...]:
        """What goes beyond the controller's limits."""
        found = []
        if self._long.count:
            found.append(
                Finding(
                    Code.BLOCK_TOO_LONG,
                    Severity.WARNING,
                    f"{self._long.count} blocks exceed the controller's buffer of "
                    f"{self._buffer_chars} characters, the longest has {self._long.most:.0f}; "
                    "use --set dialect.form=annex",
                    where=f"block {self._long.first + 1}",
                    measured=self._long.most,
                    limit=float(self._buffer_chars or 0),
                    unit="chars",
                )
            )
        if self._fast.count:
            found.append(
                Finding(
                    Code.FEED_ABOVE_LIMIT,
                    Severity.WARNING,
                    f"{self._fast.count} blocks have a feed above what the link carries, up to "
                    f"{self._fast.most:g} mm/min: it holds them at {self._max_feed:.4g}",
                    where=f"block {self._fast.first + 1}",
                    measured=self._fast.most,
                    limit=self._max_feed,
                    unit="mm_min",
                )
            )
        return tuple(found)

    def _motion(self, code: str, letters: str, match: re.Match[str], index: int) -> None:
        """G00 to G03: coordinates are absolute µm, F counts the feed word's unit."""
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
        """F08 as 0.8 mm/min (equation 3.1: tenths of mm/min); F00 would divide by 0."""
        number = int(match[match.re.groups])
        if number == 0:
            column = match.start(match.re.groups) + 1
            _fail(index, column, "the controller divides by the feed, F00", "write F01 or more")
        feed = number / self._feeds_per_mm_min
        if feed > self._max_feed * (1.0 + FEED_GUARD):
            self._fast.add(index, feed)
        return feed

    def _event(self, code: str, letters: str, match: re.Match[str], index: int) -> None:
        """All other codes. G90 says what always holds here and gives no row."""
        x, y, z = self.path.position
        zero_x, zero_y, zero_z = self._zero
        if code == "G90":
            return
        if code == "G28" and letters == "Z":
            self.path.moved_to(x, y, zero_z).event(Kind.HOME_Z)
        elif code == "G28":
            self.path.moved_to(zero_x, zero_y, z).event(Kind.HOME_XY)
        else:
            if code == "G54" and (x, y, z) != (0.0, 0.0, 0.0):
                message = "G54 away from part zero would shift all that follows"
                _fail(index, 1, message, "set part zero once, before the first move")
            self.path.event(EVENTS[code], int(match[1]) if match.re.groups else None)
            self._ended = code == "M30"
