"""The bytes of files and streams, as far as they are within a bound, and the bounds of programs:
what is beyond them is refused at once, before it fills the memory."""

from __future__ import annotations

import os
import stat
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from camtool.errors import PostError, ProgramError

MAX_PROGRAM_BYTES = 500_000_000
"""A larger program file is refused before it is read."""

MAX_MOVES = 3_000_000
"""A program of more lines, blocks or records is refused before it is decoded, and one whose blocks
make more moves than this; each move needs some hundreds of bytes of memory."""

SPLIT_PROGRAM = "split the program"
"""The mend for what is too large."""

_BYTES_AT_ONCE = 1 << 20
"""Streams are read in pieces of this size, so that a small file needs little memory."""


def file_bytes(path: Path, most: int) -> bytes | None:
    """All bytes of a file; None, without reading it all, when they are more than `most`. OSError,
    and ValueError for a name with a null character."""
    with path.open("rb") as stream:
        # The size that the system gives spares reading; pipes and devices have none.
        status = os.fstat(stream.fileno())
        if stat.S_ISREG(status.st_mode) and status.st_size > most:
            return None
        return stream_bytes(stream, most)


def stream_bytes(stream: BinaryIO, most: int) -> bytes | None:
    """All bytes of a stream; None as soon as they are more than `most`."""
    content = BytesIO()
    while piece := stream.read(_BYTES_AT_ONCE):
        content.write(piece)
        if content.tell() > most:
            return None
    return content.getvalue()


def program_bytes(source: Path | BinaryIO, file: str) -> bytes:
    """A program; ProgramError, which names the file, when it cannot be read or is too large."""
    try:
        if isinstance(source, Path):
            data = file_bytes(source, MAX_PROGRAM_BYTES)
        else:
            data = stream_bytes(source, MAX_PROGRAM_BYTES)
    except OSError as error:
        raise ProgramError(
            f"cannot be read ({error.strerror})", file=file, mend="check the path"
        ) from error
    if data is None:
        size = f"{MAX_PROGRAM_BYTES // 1_000_000} MB"
        raise ProgramError(f"is larger than {size}", file=file, mend=SPLIT_PROGRAM)
    return data


class TooLongError(PostError):
    """A program that no reader would take; the pipeline names the drawing, or the program, that it
    was to be made of."""


def refuse_too_long(count: int, unit: str) -> None:
    """TooLongError for a program that would have more than MAX_MOVES lines, blocks or whatever its
    `unit` is called: what writers ask before they make its text."""
    if count > MAX_MOVES:
        raise TooLongError(
            f"the program would have more than {MAX_MOVES} {unit}s",
            mend="make several programs of it",
        )


def check_count(count: int, unit: str) -> None:
    """ProgramError for a program of more than MAX_MOVES lines, blocks or whatever its `unit` is
    called."""
    if count > MAX_MOVES:
        raise ProgramError(
            f"the program has more than {MAX_MOVES} {unit}s",
            where=f"{unit} {MAX_MOVES + 1}",
            mend=SPLIT_PROGRAM,
        )
