"""Reading any drawing: which format it is (`formats`), and its reader.

A third party adds a format by an entry point of the group `camtool.importers` that names an
`Importer`, such as a module with its two functions. It is asked about what is none of camtool's
own formats; docs/formats.md has an example."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

from camtool.bounds import file_bytes as bytes_of
from camtool.bounds import stream_bytes
from camtool.errors import CamtoolError, DrawingError, OptionError
from camtool.importers.formats import find_format
from camtool.importers.options import DEFAULTS, ReadOptions, flags_of
from camtool.plugins import entry_points

if TYPE_CHECKING:
    from camtool.geometry.drawing import Drawing

MAX_FILE_BYTES = 500_000_000
"""Larger files are refused before they are read: their drawing would not fit into memory."""

STDIN = "<stdin>"

_EXPORT_AGAIN = "export the drawing again"


GROUP = "camtool.importers"


class Reader(Protocol):
    """A module that reads one of camtool's own formats."""

    def read(self, data: bytes, file: str, options: ReadOptions) -> Drawing:
        """Return the Drawing in the content of a file; DrawingError when there is none."""


class Importer(Reader, Protocol):
    """A reader of a file format, named by an entry point of the group `camtool.importers`."""

    def recognises(self, data: bytes, suffix: str) -> bool:
        """Return True if `data` is the content of a file of this format; `suffix` is the extension
        of its name."""


def read_drawing(path: Path, *, options: ReadOptions = DEFAULTS) -> Drawing:
    """Return the Drawing in a file, in mm; `-` is standard input. DrawingError when there is
    none."""
    return read_bytes(*content(path), options)


def content(path: Path) -> tuple[bytes, str]:
    """Return the content of a file and its name in messages; `-` is standard input. DrawingError
    if it cannot be read."""
    if str(path) == "-":
        return _standard_input(), STDIN
    return file_bytes(path), str(path)


def read_bytes(data: bytes, file: str, options: ReadOptions = DEFAULTS) -> Drawing:
    """Return the Drawing in the content of a file.

    `file` names it in messages, and its extension is a hint at the format. DrawingError when there
    is no drawing in it, OptionError for an option that its format does not have."""
    if not data.strip():
        raise DrawingError("is empty", file=file, mend=_EXPORT_AGAIN)
    suffix = Path(file).suffix.lower()
    try:
        name = options.format or find_format(data, suffix, file)
    except DrawingError:
        drawing = _read_by_others(data, file, suffix, options)
        if drawing is None:
            raise
        return drawing
    if name != "bitmap":
        refuse_flags_of_pictures(options, file)
    module = importlib.import_module(f"camtool.importers.{name}.reader")
    return cast(Reader, module).read(data, file, options.as_drawn())


def _read_by_others(data: bytes, file: str, suffix: str, options: ReadOptions) -> Drawing | None:
    """Return the Drawing made by the first plug-in that recognises the content; None if none does.

    DrawingError, which names the plug-in, for one that fails in an unexpected way."""
    for point in sorted(entry_points(GROUP), key=lambda point: point.name):
        try:
            importer = cast(Importer, point.load())
            if importer.recognises(data, suffix):
                refuse_flags_of_pictures(options, file)
                return importer.read(data, file, options.as_drawn())
        except CamtoolError:
            raise
        except Exception as error:  # a plug-in may raise anything
            raise DrawingError(
                f"the importer {point.name!r} fails ({type(error).__name__}: {error})",
                file=file,
                where=f"plug-in {point.value}",
                mend="tell whoever made it, or remove the package that brings it",
            ) from error
    return None


def refuse_flags_of_pictures(options: ReadOptions, file: str) -> None:
    """Raise OptionError for an option that has no effect on drawings of lines."""
    for name, flag, _ in flags_of(ReadOptions):
        if flag.for_pixels and getattr(options, name) != getattr(DEFAULTS, name):
            raise OptionError(
                f"{flag.name} is for pictures of pixels", file=file, mend=f"leave {flag.name} out"
            )


def _standard_input() -> bytes:
    if sys.stdin is None:
        raise DrawingError("there is no standard input", file=STDIN, mend="name a file")
    try:
        data = stream_bytes(sys.stdin.buffer, MAX_FILE_BYTES)
    except OSError as error:
        raise DrawingError(f"cannot be read ({error.strerror})", file=STDIN) from error
    return _within_bounds(data, STDIN)


def file_bytes(path: Path) -> bytes:
    """Return the content of the file; DrawingError where it cannot be read."""
    file = str(path)
    try:
        data = bytes_of(path, MAX_FILE_BYTES)
    except FileNotFoundError as error:
        raise DrawingError("there is no such file", file=file, mend="check the path") from error
    except IsADirectoryError as error:
        raise DrawingError(
            "is a directory", file=file, mend="give a drawing, or use camtool batch"
        ) from error
    except (OSError, ValueError) as error:  # ValueError: a name with a null character
        reason = getattr(error, "strerror", None) or error
        raise DrawingError(f"cannot be read ({reason})", file=file) from error
    return _within_bounds(data, file)


def _within_bounds(data: bytes | None, file: str) -> bytes:
    if data is None:
        raise DrawingError(
            f"is larger than {MAX_FILE_BYTES // 1_000_000} MB",
            file=file,
            mend="leave out what is not cut, or split it",
        )
    return data
