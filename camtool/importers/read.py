"""Reading any drawing: which format it is (`formats`), and its reader."""

from __future__ import annotations

import importlib
import os
import stat
import sys
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Protocol, cast

from camtool.errors import DrawingError
from camtool.importers.formats import find_format
from camtool.importers.options import DEFAULTS, ReadOptions

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing

MAX_FILE_BYTES = 500_000_000
"""A larger file is refused before it is read: its drawing would not fit into memory."""

_BYTES_AT_ONCE = 1 << 20
"""Streams are read in pieces of this size, so that a small file needs little memory."""

STDIN = "<stdin>"
"""The name of what `-` gives."""

_EXPORT_AGAIN = "export the drawing again"


class _Reader(Protocol):
    def read(self, data: bytes, file: str, options: ReadOptions) -> Drawing:
        """The Drawing in `data`."""


def read_drawing(path: Path, *, options: ReadOptions = DEFAULTS) -> Drawing:
    """The Drawing in a file, in mm; `-` is standard input. DrawingError when there is none."""
    return read_bytes(*content(path), options)


def content(path: Path) -> tuple[bytes, str]:
    """What is in a file, and its name in messages; `-` is standard input. DrawingError when there
    is none."""
    if str(path) == "-":
        return _standard_input(), STDIN
    return file_bytes(path), str(path)


def read_bytes(data: bytes, file: str, options: ReadOptions = DEFAULTS) -> Drawing:
    """The Drawing in the content of a file; `file` names it in messages, and its extension hints.

    DrawingError when there is none.
    """
    if not data.strip():
        raise DrawingError("is empty", file=file, mend=_EXPORT_AGAIN)
    name = options.format or find_format(data, Path(file).suffix, file)
    module = importlib.import_module(f"camtool.importers.{name}.reader")
    return cast(_Reader, module).read(data, file, options.as_drawn())


def _standard_input() -> bytes:
    if sys.stdin is None:
        raise DrawingError("there is no standard input", file=STDIN, mend="name a file")
    try:
        return _bounded(sys.stdin.buffer, STDIN)
    except OSError as error:
        raise DrawingError(f"cannot be read ({error.strerror})", file=STDIN) from error


def file_bytes(path: Path) -> bytes:
    """The file's content; DrawingError when there is none."""
    file = str(path)
    try:
        with path.open("rb") as stream:
            # The size that the system gives spares reading; pipes and devices have none.
            status = os.fstat(stream.fileno())
            if stat.S_ISREG(status.st_mode) and status.st_size > MAX_FILE_BYTES:
                raise _too_large(file)
            return _bounded(stream, file)
    except FileNotFoundError as error:
        raise DrawingError("there is no such file", file=file, mend="check the path") from error
    except IsADirectoryError as error:
        raise DrawingError(
            "is a directory", file=file, mend="give a drawing, or use camtool batch"
        ) from error
    except DrawingError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = getattr(error, "strerror", None) or error
        raise DrawingError(f"cannot be read ({reason})", file=file) from error


def _bounded(stream: BinaryIO, file: str) -> bytes:
    """All that the stream gives; DrawingError as soon as it is too much."""
    content = BytesIO()
    while piece := stream.read(_BYTES_AT_ONCE):
        content.write(piece)
        if content.tell() > MAX_FILE_BYTES:
            raise _too_large(file)
    return content.getvalue()


def _too_large(file: str) -> DrawingError:
    return DrawingError(
        f"is larger than {MAX_FILE_BYTES // 1_000_000} MB",
        file=file,
        mend="leave out what is not cut, or split it",
    )
