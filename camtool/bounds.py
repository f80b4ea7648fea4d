"""Upper bounds on the size of programs, and reading of files and streams up to a bound: what is
larger is refused before it fills the memory."""

from __future__ import annotations

import os
import stat
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from camtool.errors import PostError, ProgramError

MAX_PROGRAM_BYTES = 500_000_000

MAX_MOVES = 3_000_000
"""A program of more lines, blocks or records is refused before it is decoded, and one whose blocks
make more moves than this; each move needs some hundreds of bytes of memory."""

SPLIT_PROGRAM = "split the program"

_BYTES_AT_ONCE = 1 << 20
"""Size of the pieces in which streams are read, so that a small file needs little memory."""


def file_bytes(path: Path, max_bytes: int) -> bytes | None:
    """Read a file; return None if it has more than `max_bytes`, without reading all of it. Raises
    OSError, and ValueError for a name with a null character."""
    with path.open("rb") as stream:
        # The size in the status saves reading a large file; pipes and devices have none.
        status = os.fstat(stream.fileno())
        if stat.S_ISREG(status.st_mode) and status.st_size > max_bytes:
            return None
        return stream_bytes(stream, max_bytes)


def stream_bytes(stream: BinaryIO, max_bytes: int) -> bytes | None:
    """Read a stream; return None as soon as it has more than `max_bytes`."""
    content = BytesIO()
    while piece := stream.read(_BYTES_AT_ONCE):
        content.write(piece)
        if content.tell() > max_bytes:
            return None
    return content.getvalue()


def program_bytes(source: Path | BinaryIO, file: str) -> bytes:
    """Read the bytes of a program; ProgramError, with the file, if it cannot be read or is too
    large."""
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
    """A program too long for every reader; the pipeline adds the name of the drawing or program
    that it was to be made from."""


def refuse_too_long(count: int, unit: str) -> None:
    """Raise TooLongError for a program of more than MAX_MOVES lines or blocks (`unit` is their
    name); writers call it before they make the text."""
    if count > MAX_MOVES:
        raise TooLongError(
            f"the program would have more than {MAX_MOVES} {unit}s",
            mend="make several programs of it",
        )


def check_count(count: int, unit: str) -> None:
    """Raise ProgramError for a program of more than MAX_MOVES lines or blocks (`unit` is their
    name)."""
    if count > MAX_MOVES:
        raise ProgramError(
            f"the program has more than {MAX_MOVES} {unit}s",
            where=f"{unit} {MAX_MOVES + 1}",
            mend=SPLIT_PROGRAM,
        )
