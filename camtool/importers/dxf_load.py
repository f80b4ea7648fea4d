"""The bytes of a DXF file to ezdxf's document, and what had to be repaired on the way.

ezdxf reads ASCII through its recovering reader and audits every document. A file without its
end mark was cut off: its entities are not all there, so it is refused, whatever could be saved.
"""

from __future__ import annotations

import logging
import re
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from typing import Any

from camtool.errors import DrawingError
from camtool.importers.read import BINARY_DXF

_SECTION = re.compile(rb"(?:^|\n)[ \t]*0[ \t]*\r?\n[ \t]*SECTION\b")
_EOF = re.compile(rb"(?:^|\n)[ \t]*0[ \t]*\r?\n[ \t]*EOF\b")
_UTF8_MARK = b"\xef\xbb\xbf"

_AGAIN = "export it again from the program that made it, best as DXF R2000 or later"


@dataclass(frozen=True)
class Loaded:
    """An `ezdxf` document and the messages of all repairs."""

    document: Any
    repairs: tuple[str, ...]


def load(data: bytes, file: str) -> Loaded:
    """The document in `data`; DrawingError when it is no DXF, cut off or beyond repair."""
    binary = data.startswith(BINARY_DXF)
    content = data if binary else _plain(data)
    _check_frame(content, binary, file)
    with quiet():
        try:
            document, auditor = _read(content, binary)
        # A damaged file makes ezdxf fail in every possible way; each one is the file's fault.
        except Exception as error:
            raise DrawingError(
                f"cannot be read as DXF: {_reason(error)}", file=file, mend=_AGAIN
            ) from error
    repairs = tuple(printable(entry.message) for entry in (*auditor.fixes, *auditor.errors))
    return Loaded(document, repairs)


@contextmanager
def quiet() -> Iterator[None]:
    """ezdxf logs nothing and warns of nothing in here; all is as before behind."""
    logger = logging.getLogger("ezdxf")
    silent, propagate = logging.NullHandler(), logger.propagate
    logger.addHandler(silent)
    logger.propagate = False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        logger.propagate = propagate
        logger.removeHandler(silent)


def _reason(error: Exception) -> str:
    """What ezdxf says on purpose; what merely happened to it would help nobody."""
    from ezdxf.lldxf.const import DXFError

    return printable(str(error)) if isinstance(error, DXFError) else "its structure is damaged"


def printable(text: str) -> str:
    """The text with "?" for bytes that are no text in the file's encoding."""
    return text.encode("utf-8", errors="replace").decode("utf-8")


def _plain(data: bytes) -> bytes:
    """ASCII DXF with line feeds, without the mark that some editors put before UTF-8."""
    plain = data.removeprefix(_UTF8_MARK)
    return plain if b"\n" in plain else plain.replace(b"\r", b"\n")


def _check_frame(data: bytes, binary: bool, file: str) -> None:
    """DrawingError unless there is a section and an end mark."""
    if not data.strip():
        raise DrawingError("is empty", file=file, mend=_AGAIN)
    if b"SECTION" not in data if binary else not _SECTION.search(data):
        raise DrawingError("is no DXF: it has no section", file=file, mend=_AGAIN)
    if b"EOF\x00" not in data if binary else not _EOF.search(data):
        lines = data.count(b"\n") + 1
        size = f"{len(data)} bytes" if binary else f"line {lines}"
        raise DrawingError(
            "is cut off: the end mark EOF is missing",
            file=file,
            where=f"after {size}",
            mend=_AGAIN,
        )


def _read(data: bytes, binary: bool) -> tuple[Any, Any]:
    """ezdxf's document and auditor."""
    if not binary:
        from ezdxf import recover

        return recover.read(BytesIO(data))
    from ezdxf.document import Drawing
    from ezdxf.lldxf.tagger import binary_tags_loader

    document = Drawing.load(binary_tags_loader(data, errors="surrogateescape"))
    return document, document.audit()
