"""Reading the signed-mm listing: `X+10.000 Y-2.500 T0 Z+0.000 T0`, one record a line, END last.

Every word must be there, in this order, every distance with its sign (L5250-5254). A distance is
rounded to whole steps, as the operator's program must do; each on its own.
"""

from __future__ import annotations

import math
import re
from typing import Final

import numpy as np

from camtool.errors import ProgramError
from camtool.machine.model import Machine

from ._i8751_faults import Decoded, shown, text_lines
from ._i8751_options import MOST_DWELL_BYTE_S, Dialect

WHOLE_STEP_TOLERANCE: Final = 0.05
"""A distance within this much (in steps) of a whole step is that step, without a word."""

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

    def __init__(self, machine: Machine, dialect: Dialect) -> None:
        self._step_mm = [axis.coded_step_mm for axis in machine.axes]
        self._most = dialect.sayable_steps
        self._steps: list[list[int]] = []
        self._waits: list[tuple[int, int]] = []
        self._rounded = 0
        self._worst = 0.0
        self._line = 0

    def read(self, data: bytes) -> Decoded:
        """All records of a listing."""
        lines = text_lines(data)
        ended = False
        for self._line, line in enumerate(lines, 1):
            text = line.strip(" \t")
            if not text or text.startswith(";"):
                continue
            indent = len(line) - len(line.lstrip(" \t"))
            if ended:
                raise self._error(indent, f"{shown(text)} after END", "remove it")
            ended = text == LAST_LINE
            if not ended:
                self._record(text, indent)
        if not ended:
            raise self._error(len(lines[-1]), "the listing breaks off", "its last line is END")
        if not self._steps:
            raise ProgramError("the program is empty", mend="a listing has records before END")
        return Decoded(
            np.array(self._steps, dtype=np.int64),
            np.array(self._waits, dtype=np.int64),
            self._rounded,
            self._worst,
        )

    def _record(self, text: str, indent: int) -> None:
        match = _RECORD.fullmatch(text)
        if match is None:
            raise self._no_record(text, indent)
        waits = (
            self._wait(match[3], indent + match.start(3)),
            self._wait(match[5], indent + match.start(5)),
        )
        steps = [
            self._whole(match[group], axis, indent + match.start(group))
            for axis, group in enumerate((1, 2, 4))
        ]
        self._steps.append(steps)
        self._waits.append(waits)

    def _whole(self, text: str, axis: int, column: int) -> int:
        """A distance in steps, half a step away from zero."""
        exact = abs(float(text)) / self._step_mm[axis]
        steps = math.floor(exact + 0.5)
        if steps > self._most:
            raise self._error(
                column, f"{text} mm is more than {self._most} steps", "say it in two records"
            )
        off = abs(exact - steps)
        if off > WHOLE_STEP_TOLERANCE:
            self._rounded += 1
            self._worst = max(self._worst, off)
        return -steps if text[0] == "-" else steps

    def _wait(self, text: str, column: int) -> int:
        seconds = int(text)
        if seconds > MOST_DWELL_BYTE_S:
            raise self._error(
                column,
                f"{seconds} s is more than a byte can say",
                f"use {MOST_DWELL_BYTE_S} s or less, and another record for the rest",
            )
        return seconds

    def _no_record(self, text: str, indent: int) -> ProgramError:
        """The first word of a line that is not what it must be."""
        at, wanted = 0, "nothing more"
        for number, (letter, value, what) in enumerate(_WORDS):
            word = re.compile((_BETWEEN if number else "") + letter + value).match(text, at)
            if word is None:
                wanted = what
                break
            at = word.end()
        blanks = re.compile("[ \t]*").match(text, at)
        column = blanks.end() if blanks else at
        mend = "write a point, no comma" if "," in text[: column + SHOWN_AHEAD] else ""
        return self._error(indent + column, f"{shown(text)}: wanted {wanted}", mend)

    def _error(self, column: int, message: str, mend: str = "") -> ProgramError:
        """ProgramError in the present line at a column from 0."""
        return ProgramError(
            message,
            where=f"record {len(self._steps) + 1}, line {self._line}, column {column + 1}",
            mend=mend,
        )


SHOWN_AHEAD: Final = 12
"""A comma so many characters behind the fault is taken for a decimal one."""
