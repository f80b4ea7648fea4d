"""The bytes of a DXF file to ezdxf's document, and what had to be repaired for that.

    tags, each checked → sections → whole? ─┬─ plain kinds alone ──▶ plain.py ───┬─▶ document
                                            ├─ others ──▶ ezdxf's ordinary reader ┤
                                            └─ faulty order ──▶ ezdxf's recovery ─┘

Nothing is audited: an audit deletes what it does not like, and here every entity is either used
or counted with a reason. A file whose entities are not all there is refused, whatever could be
saved; one that ends behind them is whole enough."""

from __future__ import annotations

import gc
import logging
import re
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from itertools import starmap
from typing import Any

import numpy as np
from msgspec import Struct, field

from camtool.errors import DrawingError
from camtool.importers.dxf.bulk import Bulk, BulkLines
from camtool.importers.dxf.plain import plain_document
from camtool.importers.dxf.tags import (
    AGAIN,
    DxfSections,
    Tags,
    ascii_tags,
    binary_tags,
    check_numbers,
    frame_of,
    header_of,
    lost_entities,
)
from camtool.importers.formats import BINARY_DXF

MAX_BYTES = 100_000_000

MAX_TAGS = 10_000_000
"""Files of more tags (two lines of text each) are refused."""

MAX_ENTITIES = 1_000_000
"""Files of more entities, VERTEX and table entries included, are refused: ezdxf's document takes
some 3 KB for each."""

_COMMENT = 999
_NO_ASCII = re.compile(r"[^\x00-\x7f]")


class Loaded(Struct, frozen=True):
    """An `ezdxf` document; the header variables that the file itself sets; the repairs; and the
    LINEs that were read in bulk, by the handle of the LINE of the document that they follow."""

    document: Any
    header: dict[str, Any] = field(default_factory=dict)
    repairs: tuple[str, ...] = ()
    lines: Mapping[str, BulkLines] = field(default_factory=dict)


def load(data: bytes, file: str, *, plain: bool = False) -> Loaded:
    """Return the document in `data`; DrawingError when it is no DXF, cut off or beyond repair.

    `plain`: a `PlainDocument` is enough, if the file holds nothing that needs ezdxf."""
    _check_bytes(data, file)
    tags = binary_tags(data, file) if data.startswith(BINARY_DXF) else ascii_tags(data, file)
    if len(tags.codes) > MAX_TAGS:
        raise _too_large("tags", MAX_TAGS, file)
    if len(tags.marks) > MAX_ENTITIES:
        raise _too_large("entities", MAX_ENTITIES, file)
    frame = frame_of(tags)
    cut = _check_whole(tags, frame, file)
    if cut:
        tags = tags.ended(max(part.end for part in frame.sections if part.end is not None) + 1)
        frame = frame_of(tags)
    notes = [*tags.notes, *cut, *frame.faults, *lost_entities(tags, frame)]
    with quiet() as warnings, without_collector():
        bulk = Bulk.of(tags, frame)
        document: Any = plain_document(tags, frame, bulk) if plain and not notes else None
        if document is None and not frame.faults:
            document = _load_with_ezdxf(tags, bulk, warnings)
        if document is not None:
            _add_vertices(document, bulk)
        notes.extend(warnings)
        if document is None or (warnings and tags.is_text):
            bulk = Bulk.none(tags)
            check_numbers(tags, file, np.arange(len(tags.codes)))
            document = _recover(tags, notes, file)
    repairs = tuple(printable(note) for note in dict.fromkeys(notes))
    return Loaded(document, header_of(tags, frame), repairs, bulk.lines)


class _Kept(logging.Handler):
    """A log handler that keeps warnings and errors in a list."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Add the message of a log record, on one line, to `messages`."""
        self.messages.append(" ".join(record.getMessage().split()))


@contextmanager
def quiet() -> Iterator[list[str]]:
    """Keep ezdxf from logging and warning inside the `with` block; its messages are collected in
    the list that it yields."""
    logger = logging.getLogger("ezdxf")
    collector, propagate = _Kept(), logger.propagate
    logger.addHandler(collector)
    logger.propagate = False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield collector.messages
    finally:
        logger.propagate = propagate
        logger.removeHandler(collector)


def printable(text: str) -> str:
    """Return the text with "?" for characters that stand for undecodable bytes."""
    return text.encode("utf-8", errors="replace").decode("utf-8")


@contextmanager
def without_collector() -> Iterator[None]:
    """Turn the garbage collector off inside the `with` block: reading makes many objects and drops
    few, so that collecting would take half of the time."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


def _check_bytes(data: bytes, file: str) -> None:
    """Raise DrawingError for a file that is empty, too large, or has no section, before it is
    parsed."""
    if not data.strip():
        raise DrawingError("is empty", file=file, mend=AGAIN)
    if len(data) > MAX_BYTES:
        size, limit_mb = len(data) // 1_000_000, MAX_BYTES // 1_000_000
        raise DrawingError(
            f"is {size} MB large, at most {limit_mb} MB are read",
            file=file,
            mend="split the drawing, or delete what is not to be made",
        )
    if data.count(b"\n") > 2 * MAX_TAGS and not data.startswith(BINARY_DXF):
        raise _too_large("lines", 2 * MAX_TAGS, file)
    # UTF-16 puts a zero between any two letters.
    if b"SECTION" not in data and b"SECTION" not in data.replace(b"\x00", b""):
        raise DrawingError("is no DXF: it has no section", file=file, mend=AGAIN)


def _too_large(subject: str, limit: int, file: str) -> DrawingError:
    return DrawingError(
        f"holds more than {limit} {subject}",
        file=file,
        mend="split the drawing, or delete what is not to be made",
    )


def _check_whole(tags: Tags, frame: DxfSections, file: str) -> list[str]:
    """Return a note when the file ends early; DrawingError unless all its entities are there."""
    if not frame.sections:
        raise DrawingError("is no DXF: it has no section", file=file, mend=AGAIN)
    if frame.eof is not None:
        return []
    if not frame.is_complete("ENTITIES"):
        damaged = "" if tags.is_text else " or damaged"
        raise DrawingError(
            f"is cut off{damaged}: the end mark EOF is missing",
            file=file,
            where=f"after {tags.where(len(tags.codes))}",
            mend=AGAIN,
        )
    return ["the end mark EOF is missing: what stood behind the entities is left out"]


def _load_with_ezdxf(tags: Tags, bulk: Bulk, notes: list[str]) -> Any:
    """Return the document that ezdxf's ordinary reader makes of the tags that were not read in
    bulk; None if it fails, with the reason added to `notes`."""
    from ezdxf.document import Drawing
    from ezdxf.lldxf.types import DXFBinaryTag, DXFTag

    def tag_of(code: int, value: Any) -> Any:
        return (DXFBinaryTag if isinstance(value, bytes) else DXFTag)(code, value)

    pairs = tags.pairs(np.flatnonzero(bulk.others & (tags.codes != _COMMENT)))
    try:
        document: Any = Drawing.load(starmap(DXFTag if tags.is_text else tag_of, pairs))
    # A damaged file makes ezdxf fail in every possible way; each one is the file's fault.
    except Exception as error:
        notes.append(_reason(error))
        return None
    return document


def _add_vertices(document: Any, bulk: Bulk) -> None:
    """Give the LWPOLYLINEs of the document, in place, the vertices that were read in bulk."""
    if not all(handle in document.entitydb for handle in bulk.lines):
        raise RuntimeError("LINEs that are read in bulk follow none of the document")
    for handle, vertices in bulk.vertices.items():
        document.entitydb[handle].lwpoints.values = vertices


def _recover(tags: Tags, notes: list[str], file: str) -> Any:
    """Return the document that ezdxf's recovery makes of all tags; its repairs are added to
    `notes`."""
    from ezdxf.document import Drawing
    from ezdxf.recover import Recover

    if not tags.is_text:
        raise DrawingError(f"cannot be read as DXF: {notes[-1]}", file=file, mend=AGAIN)
    pairs = tags.pairs(np.arange(len(tags.codes)))
    lines = "".join(f"{code}\n{value}\n" for code, value in pairs)
    # Recovery reads bytes in whatever code page they name; escapes are the same in all of them.
    escaped = _NO_ASCII.sub(lambda sign: f"\\U+{ord(sign[0]):04X}", lines)
    try:
        recover = Recover.run(BytesIO(escaped.encode("ascii")))
        document = Drawing()
        document._load_section_dict(recover.section_dict)
    except Exception as error:
        raise DrawingError(
            f"cannot be read as DXF: {_reason(error)}", file=file, mend=AGAIN
        ) from error
    notes.extend(message for _, message in (*recover.fixes, *recover.errors))
    return document


def _reason(error: Exception) -> str:
    """Return the message of an error that ezdxf raises on purpose, or a general one for any other
    error."""
    from ezdxf.lldxf.const import DXFStructureError, DXFVersionError

    on_purpose = isinstance(error, (DXFStructureError, DXFVersionError))
    return printable(str(error)) if on_purpose else "its structure is damaged"
