"""The texts of a program: its own file, and those of the subs that it calls, by lines.

LinuxCNC looks for `o<name> call` in the folder of the program: `name.ngc`. Nothing outside of that
folder is opened."""

from __future__ import annotations

import re
from pathlib import Path, PurePosixPath
from typing import Final

import numpy as np

from camtool import bounds
from camtool.arrays import Ints
from camtool.errors import ProgramError

from ..gcode.blocks import ProgramLines, has_words
from ..gcode.faults import LineFault
from .lines import ParsedLine

MAX_FILES: Final = 100

MAX_FILE_BYTES: Final = 10_000_000

SUFFIX: Final = ".ngc"

_CONTROL: Final = re.compile(rb"[\x00-\x08\x0e-\x1f\x7f]")


class ProgramText(ProgramLines):
    """The lines of one file; `name` "" is the program itself."""

    def __init__(self, data: bytes, name: str, line_chars: int) -> None:
        _check_bytes(data, name)
        super().__init__(data)
        self.name = name
        self._line_chars = line_chars
        self._lines: dict[int, ParsedLine] = {}
        self._before: Ints | None = None

    def raw(self, number: int) -> str:
        """Return the text of a line, without blanks at its end."""
        text = self.text(number)
        if len(text) > self._line_chars:
            message = f"the line has more than {self._line_chars} characters"
            raise LineFault(message, self._line_chars, "shorten it")
        return text.rstrip(" \t\v\f")

    def line(self, number: int, *, keep: bool) -> ParsedLine:
        """Return a line, parsed only once if it may be executed again (`keep`)."""
        line = self._lines.get(number)
        if line is None:
            line = ParsedLine(self.raw(number))
            if keep:
                self._lines[number] = line
        return line

    def blocks_before(self, number: int) -> int:
        """Return the number of blocks before this line, counted as in the program's listing."""
        if self._before is None:
            lines = self.data.decode("latin-1").split("\n")
            flags = np.array([has_words(line) for line in lines], dtype=np.int64)
            self._before = np.concatenate([[0], np.cumsum(flags)])
        return int(self._before[number])


class Folder:
    """Folder in which the files of subs are searched; None for a program that is not in a file."""

    def __init__(self, folder: Path | None, line_chars: int) -> None:
        self._folder = folder
        self._line_chars = line_chars
        self._found: dict[str, ProgramText | None] = {}

    def find(self, label: str) -> ProgramText | None:
        """Return the file of a sub, None where there is none; LineFault for a place outside of the
        folder, and for too many files."""
        if label in self._found:
            return self._found[label]
        if len(self._found) >= MAX_FILES:
            raise LineFault(f"the program calls more than {MAX_FILES} files")
        self._found[label] = program = self._open(label)
        return program

    @property
    def mend(self) -> str:
        """Remedy for a missing file, for the message of the error."""
        if self._folder is None:
            return "give the program as a file: its folder is where subs are looked for"
        return f"put the sub into the program or its file into {self._folder}"

    def _open(self, label: str) -> ProgramText | None:
        name = f"{label}{SUFFIX}"
        parts = PurePosixPath(name)
        if parts.is_absolute() or ".." in parts.parts:
            raise LineFault(f"{name} lies outside of the program's folder", mend=self.mend)
        if self._folder is None:
            return None
        try:
            root = self._folder.resolve()
            file = (root / parts).resolve()
            if not file.is_relative_to(root):
                raise LineFault(f"{name} lies outside of the program's folder", mend=self.mend)
            data = bounds.file_bytes(file, MAX_FILE_BYTES)
        except (OSError, ValueError):
            return None
        if data is None:
            raise LineFault(f"{name} is larger than {MAX_FILE_BYTES // 1_000_000} MB")
        return ProgramText(data, name, self._line_chars)


def _check_bytes(data: bytes, name: str) -> None:
    """Raise ProgramError at the first byte that no program contains."""
    odd = _CONTROL.search(data)
    if odd is not None:
        before = data[: odd.start()].split(b"\n")
        place = f"line {len(before)}, column {len(before[-1]) + 1}"
        raise ProgramError(
            f"the byte 0x{data[odd.start()]:02x} belongs to no program",
            where=f"file {name}, {place}" if name else place,
            mend="give a program of plain text",
        )
