"""The bytes of a DXF file to ezdxf's document, and what had to be repaired for that.

    tags, each checked → sections → whole? → ezdxf's ordinary reader → the document
                                       └── faulty order ──▶ ezdxf's recovery ──┘

Nothing is audited: an audit deletes what it does not like, and here every entity is either used
or counted with a reason. A file whose entities are not all there is refused, whatever could be
saved; one that ends behind them is whole enough.
"""

from __future__ import annotations

import gc
import logging
import re
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from io import BytesIO
from typing import Any

import numpy as np

from camtool.arrays import Ints
from camtool.errors import DrawingError
from camtool.importers.formats import BINARY_DXF

MAX_BYTES = 100_000_000
"""Larger files are refused."""

MAX_TAGS = 10_000_000
"""Files of more tags (two lines of text each) are refused."""

MAX_ENTITIES = 1_000_000
"""Files of more entities, VERTEX and table entries included, are refused: ezdxf's document takes
some 3 KB for each."""

_COMMENT = 999
_NO_ASCII = re.compile(r"[^\x00-\x7f]")


@dataclass(frozen=True)
class Loaded:
    """An `ezdxf` document, the header as the file itself says it, and all that was mended."""

    document: Any
    header: dict[str, Any] = field(default_factory=dict)
    repairs: tuple[str, ...] = ()


def load(data: bytes, file: str) -> Loaded:
    """The document in `data`; DrawingError when it is no DXF, cut off or beyond repair."""
    _check_bytes(data, file)
    tags = binary_tags(data, file) if data.startswith(BINARY_DXF) else ascii_tags(data, file)
    if len(tags.codes) > MAX_TAGS:
        raise _too_large("tags", MAX_TAGS, file)
    if tags.codes.count(0) > MAX_ENTITIES:
        raise _too_large("entities", MAX_ENTITIES, file)
    frame = frame_of(tags)
    cut = _check_whole(tags, frame, file)
    if cut:
        tags = _ended(tags, frame)
        frame = frame_of(tags)
    notes = [*tags.notes, *cut, *frame.faults, *lost(tags, frame)]
    with quiet() as said, without_collector():
        document = None if frame.faults else _plain(tags, said)
        notes.extend(said)
        if document is None or (said and tags.is_text):
            check_numbers(tags, file)
            document = _recovered(tags, notes, file)
    repairs = tuple(printable(note) for note in dict.fromkeys(notes))
    return Loaded(document, header_of(tags, frame), repairs)


class _Kept(logging.Handler):
    """Keeps the messages of warnings and errors."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.messages: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """One more message."""
        self.messages.append(" ".join(record.getMessage().split()))


@contextmanager
def quiet() -> Iterator[list[str]]:
    """ezdxf logs and warns of nothing in here, its warnings gather in the list; all is as before
    behind."""
    logger = logging.getLogger("ezdxf")
    kept, propagate = _Kept(), logger.propagate
    logger.addHandler(kept)
    logger.propagate = False
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield kept.messages
    finally:
        logger.propagate = propagate
        logger.removeHandler(kept)


def printable(text: str) -> str:
    """The text with "?" for bytes that are no text in the file's encoding."""
    return text.encode("utf-8", errors="replace").decode("utf-8")


@contextmanager
def without_collector() -> Iterator[None]:
    """Many objects arise in here and few go: looking for garbage would take half of the time."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


def _check_bytes(data: bytes, file: str) -> None:
    """DrawingError for what needs no reading to be refused."""
    if not data.strip():
        raise DrawingError("is empty", file=file, mend=AGAIN)
    if len(data) > MAX_BYTES:
        size, most = len(data) // 1_000_000, MAX_BYTES // 1_000_000
        raise DrawingError(
            f"is {size} MB large, at most {most} MB are read",
            file=file,
            mend="split the drawing, or delete what is not to be made",
        )
    if data.count(b"\n") > 2 * MAX_TAGS and not data.startswith(BINARY_DXF):
        raise _too_large("lines", 2 * MAX_TAGS, file)
    # UTF-16 puts a zero between any two letters.
    if b"SECTION" not in data and b"SECTION" not in data.replace(b"\x00", b""):
        raise DrawingError("is no DXF: it has no section", file=file, mend=AGAIN)


def _too_large(what: str, most: int, file: str) -> DrawingError:
    return DrawingError(
        f"holds more than {most} {what}",
        file=file,
        mend="split the drawing, or delete what is not to be made",
    )


def _check_whole(tags: Tags, frame: Frame, file: str) -> list[str]:
    """A note when the file ends early; DrawingError unless all its entities are there."""
    if not frame.sections:
        raise DrawingError("is no DXF: it has no section", file=file, mend=AGAIN)
    if frame.eof is not None:
        return []
    if not frame.whole("ENTITIES"):
        damaged = "" if tags.is_text else " or damaged"
        raise DrawingError(
            f"is cut off{damaged}: the end mark EOF is missing",
            file=file,
            where=f"after {tags.where(len(tags.codes))}",
            mend=AGAIN,
        )
    return ["the end mark EOF is missing: what stood behind the entities is left out"]


def _ended(tags: Tags, frame: Frame) -> Tags:
    """The tags up to the end of the last whole section, and an end mark."""
    end = max(part.end for part in frame.sections if part.end is not None) + 1
    return Tags([*tags.codes[:end], 0], [*tags.values[:end], "EOF"], tags.is_text)


def _plain(tags: Tags, said: list[str]) -> Any:
    """The document of ezdxf's ordinary reader; None when it fails or finds fault, as `said`."""
    from ezdxf.document import Drawing
    from ezdxf.lldxf.types import DXFBinaryTag, DXFTag

    def tag_of(code: int, value: Any) -> Any:
        return (DXFBinaryTag if isinstance(value, bytes) else DXFTag)(code, value)

    pairs: Iterator[Any] = map(DXFTag if tags.is_text else tag_of, tags.codes, tags.values)
    try:
        if _COMMENT in tags.codes:
            pairs = filter(lambda tag: tag.code != _COMMENT, pairs)
        return Drawing.load(pairs)
    # A damaged file makes ezdxf fail in every possible way; each one is the file's fault.
    except Exception as error:
        said.append(_reason(error))
        return None


def _recovered(tags: Tags, notes: list[str], file: str) -> Any:
    """The document of ezdxf's recovery, its repairs added to the notes."""
    from ezdxf.document import Drawing
    from ezdxf.recover import Recover

    if not tags.is_text:
        raise DrawingError(f"cannot be read as DXF: {notes[-1]}", file=file, mend=AGAIN)
    pairs = zip(tags.codes, tags.values, strict=True)
    lines = "".join(f"{code}\n{value}\n" for code, value in pairs)
    # Recovery reads bytes in whatever code page they name; escapes are the same in all of them.
    plain = _NO_ASCII.sub(lambda sign: f"\\U+{ord(sign[0]):04X}", lines)
    try:
        recover = Recover.run(BytesIO(plain.encode("ascii")))
        document = Drawing()
        document._load_section_dict(recover.section_dict)
    except Exception as error:
        raise DrawingError(
            f"cannot be read as DXF: {_reason(error)}", file=file, mend=AGAIN
        ) from error
    notes.extend(message for _, message in (*recover.fixes, *recover.errors))
    return document


def _reason(error: Exception) -> str:
    """The message of an error that ezdxf raises on purpose; that of any other would not help."""
    from ezdxf.lldxf.const import DXFStructureError, DXFVersionError

    on_purpose = isinstance(error, (DXFStructureError, DXFVersionError))
    return printable(str(error)) if on_purpose else "its structure is damaged"


# The bytes of a DXF file to its tags, and what the tags themselves say is damaged.
#
# A *tag* is a group code and a value: two lines of ASCII, or bytes of binary DXF. ezdxf's readers
# also accept "1_0" as a number, and find one in garbage ("x1y"); here whatever is no number ends
# the reading. `frame_of` finds the sections, and whether the file is whole.

AGAIN = "export it again from the program that made it, best as DXF R2000 or later"

LARGEST_CODE, UNUSED_CODES = 1071, range(482, 999)
"""Group codes in files are 0 to 481 and 999 to 1071 (DXF reference)."""

SECTIONS = frozenset(
    ("HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS", "THUMBNAILIMAGE", "ACDSDATA")
)
"""Sections that the DXF reference names."""

_LAYER, _VARIABLE, _POINT, _COUNT = 8, 9, 10, 90
_UTF16_MARKS, _UTF8_MARK = (b"\xff\xfe", b"\xfe\xff"), b"\xef\xbb\xbf"
_CODE = re.compile(r"[ \t]*[0-9]{1,4}[ \t]*\r?")
_NUMBER = re.compile(
    r"[ \t]*[-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|nan|inf(?:inity)?)\s*", re.I
)
_VERSION = re.compile(rb"\$ACADVER\s+1\s+(AC\d{4})")
_CODEPAGE = re.compile(rb"\$DWGCODEPAGE\s+3\s+(\w+)")
_UTF8_SINCE = b"AC1021"
_HEAD_BYTES = 65536  # the header's first variables name version and code page


@dataclass(frozen=True, eq=False)
class Tags:
    """`codes` and `values` of a file, comments (999) included; of ASCII the values are raw text.

    `notes`: what is damaged without harm to the rest, one phrase each.
    """

    codes: list[int]
    values: list[Any]
    is_text: bool
    notes: tuple[str, ...] = ()

    def where(self, index: int) -> str:
        """The place of a tag for messages."""
        return f"line {2 * index + 1}" if self.is_text else f"tag {index + 1}"


@dataclass(frozen=True)
class Section:
    """Tags `begin` (its 0 SECTION) to `end` (its 0 ENDSEC; None when that is missing)."""

    name: str
    begin: int
    end: int | None


@dataclass(frozen=True)
class Frame:
    """The sections, the index of the end mark (None when it is missing), and what is wrong."""

    sections: tuple[Section, ...]
    eof: int | None
    faults: tuple[str, ...]

    def whole(self, name: str) -> bool:
        """Whether there is a section of this name, each with its end."""
        ends = [part.end for part in self.sections if part.name == name]
        return bool(ends) and None not in ends


def binary_tags(data: bytes, file: str) -> Tags:
    """The tags of binary DXF up to its end mark, or to where they end to be tags; DrawingError
    when a group code is none."""
    from ezdxf.lldxf.tagger import binary_tags_loader

    codes: list[int] = []
    values: list[Any] = []
    # The reader raises different errors for bytes that are no tags. What it has read until then
    # has no end mark, which is how the fault is found.
    with suppress(Exception):
        for tag in binary_tags_loader(data, errors="surrogateescape"):
            codes.append(tag.code)
            values.append(tag.value)
            if tag.code == 0 and tag.value == "EOF":
                break
    _check_codes(Tags(codes, values, is_text=False), file)
    return Tags(codes, values, is_text=False)


def ascii_tags(data: bytes, file: str) -> Tags:
    """The tags of ASCII DXF up to its end mark; DrawingError when a group code is none."""
    text, notes = _decoded(data)
    lines = text.split("\n")
    values = lines[1::2]
    codes_text = lines[0 : 2 * len(values) : 2]
    known = {line: int(line) if _CODE.fullmatch(line) else -1 for line in set(codes_text)}
    codes = [known[line] for line in codes_text]
    if "\r" in text:
        values = [value.rstrip("\r") for value in values]
    end = _end(codes, values)
    if "\\U+" in text or "\\M+" in text:
        values = _without_escapes(values)
    tags = Tags(codes[:end], values[:end], True, notes)
    _check_codes(tags, file, codes_text)
    # What Python takes for a number and nobody else does.
    check_numbers(tags, file, [k for k, value in enumerate(tags.values) if "_" in value])
    if not text.isascii():
        odd = [k for k, value in enumerate(tags.values) if not value.isascii()]
        check_numbers(tags, file, odd)
    return tags


def frame_of(tags: Tags) -> Frame:
    """Sections and end mark, and faults of their order."""
    sections: list[Section] = []
    faults: list[str] = []
    begin: int | None = None
    name, eof = "", None
    for k in [k for k, code in enumerate(tags.codes) if code == 0]:
        mark, where = str(tags.values[k]).strip(), tags.where(k)
        if mark == "SECTION":
            if begin is not None:
                faults.append(f"{where}: section {name} has no end (ENDSEC)")
                sections.append(Section(name, begin, None))
            begin, name = k, _section_name(tags, k)
        elif mark == "ENDSEC":
            if begin is None:
                faults.append(f"{where}: the end of a section that has not begun")
            else:
                sections.append(Section(name, begin, k))
            begin = None
        elif mark == "EOF":
            eof = k
            break
        elif begin is None:
            faults.append(f"{where}: {mark[:20]} stands outside the sections")
    if begin is not None:
        faults.append(f"section {name} has no end (ENDSEC)")
        sections.append(Section(name, begin, None))
    return Frame(tuple(sections), eof, (*faults, *_wrong_names(tags, sections)))


def lost(tags: Tags, frame: Frame) -> list[str]:
    """What a damaged group code hides that is itself a group code, in words.

    An entity that has two layers is two entities, the mark (0) of one being damaged.
    """
    codes = np.array(tags.codes, dtype=np.int64)
    entity = np.cumsum(codes == 0)
    found: list[str] = []
    for section in frame.sections:
        if section.name not in ("ENTITIES", "BLOCKS"):
            continue
        rows = np.flatnonzero(codes[section.begin : section.end] == _LAYER) + section.begin
        twice = rows[1:][np.diff(entity[rows]) == 0]
        found.extend(f"{tags.where(int(k))}: two entities run into one" for k in twice)
    return found + _lost_vertices(tags, codes)


def _lost_vertices(tags: Tags, codes: Ints) -> list[str]:
    """LWPOLYLINEs that do not have the vertices that they count, in words."""
    found: list[str] = []
    marks, vertices, counts = (np.flatnonzero(codes == code) for code in (0, _POINT, _COUNT))
    ends = np.append(marks[1:], len(codes))
    for begin, end in zip(marks.tolist(), ends.tolist(), strict=True):
        if str(tags.values[begin]).strip() == "LWPOLYLINE":
            held = int(np.searchsorted(vertices, end) - np.searchsorted(vertices, begin))
            at = int(np.searchsorted(counts, begin))
            said = str(tags.values[counts[at]]).strip() if at < len(counts) else ""
            if at < len(counts) and counts[at] < end and said != str(held):
                where = tags.where(begin)
                found.append(f"{where}: LWPOLYLINE counts {said[:9]} vertices and holds {held}")
    return found


def header_of(tags: Tags, frame: Frame) -> dict[str, Any]:
    """The variables of the header that the file itself says, each with its first value."""
    found: dict[str, Any] = {}
    for section in frame.sections:
        if section.name == "HEADER":
            for k in range(section.begin, (section.end or len(tags.codes)) - 1):
                if tags.codes[k] == _VARIABLE:
                    found.setdefault(str(tags.values[k]).strip(), tags.values[k + 1])
    return found


def _decoded(data: bytes) -> tuple[str, tuple[str, ...]]:
    """The text, by its mark or by what its header says, with line feeds; and its faults."""
    if data.startswith(_UTF16_MARKS):
        encoding, otherwise = "utf-16", "replace"
    else:
        encoding, otherwise = _encoding(data[:_HEAD_BYTES]), "surrogateescape"
    notes: tuple[str, ...] = ()
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        notes = (f"line {line}: a byte is no text in {encoding}",)
        text = data.decode(encoding, errors=otherwise)
    return (text if "\n" in text else text.replace("\r", "\n")), notes


def _encoding(head: bytes) -> str:
    """Files since R2007 are UTF-8, older ones in the code page that they name."""
    from ezdxf.tools.codepage import toencoding

    version, codepage = _VERSION.search(head), _CODEPAGE.search(head)
    if head.startswith(_UTF8_MARK):
        return "utf-8-sig"
    if version and version.group(1) >= _UTF8_SINCE:
        return "utf-8"
    return str(toencoding(codepage.group(1).decode("ascii") if codepage else "ANSI_1252"))


def _end(codes: list[int], values: list[str]) -> int:
    """How many tags there are up to the end mark, itself included."""
    at = -1
    while True:
        try:
            at = values.index("EOF", at + 1)
        except ValueError:
            return len(values)
        if codes[at] == 0:
            return at + 1


def _check_codes(tags: Tags, file: str, said: list[str] | None = None) -> None:
    """DrawingError for the first group code that is none."""
    known = set(tags.codes)
    odd = {c for c in known if not 0 <= c <= LARGEST_CODE or c in UNUSED_CODES}
    for k, code in enumerate(tags.codes if odd else ()):
        if code in odd:
            what = repr(said[k].strip()[:20]) if said else str(code)
            raise DrawingError(
                f"{what} is no group code", file=file, where=tags.where(k), mend=AGAIN
            )


def check_numbers(tags: Tags, file: str, rows: Iterable[int] | None = None) -> None:
    """DrawingError for a value that must be a number and is none; of all tags, or of
    these `rows`."""
    for k in range(len(tags.codes)) if rows is None else rows:
        if _is_number(tags.codes[k]) and not _NUMBER.fullmatch(str(tags.values[k])):
            raise DrawingError(
                f"{str(tags.values[k]).strip()[:20]!r} is no number",
                file=file,
                where=tags.where(k),
                mend=AGAIN,
            )


def _is_number(code: int) -> bool:
    """Whether values of this group code are numbers (DXF reference, group code value types)."""
    from ezdxf.lldxf.types import POINT_CODES, TYPE_TABLE

    return code in POINT_CODES or TYPE_TABLE.get(code, str) in (int, float)


def _without_escapes(values: list[str]) -> list[str]:
    """The signs that ASCII cannot say, written as \\U+00D6 or \\M+1…, as themselves."""
    from ezdxf.lldxf.encoding import (
        decode_dxf_unicode,
        decode_mif_to_unicode,
        has_dxf_unicode,
        has_mif_encoding,
    )

    plain = [decode_dxf_unicode(value) if has_dxf_unicode(value) else value for value in values]
    return [decode_mif_to_unicode(value) if has_mif_encoding(value) else value for value in plain]


def _section_name(tags: Tags, begin: int) -> str:
    """The name in the tag behind 0 SECTION; "" when that is no name."""
    named = tags.codes[begin + 1 : begin + 2] == [2]
    return str(tags.values[begin + 1]).strip() if named else ""


def _wrong_names(tags: Tags, sections: list[Section]) -> list[str]:
    """Sections that are unknown or stand twice, in words."""
    faults: list[str] = []
    seen: set[str] = set()
    for section in sections:
        name, where = section.name, tags.where(section.begin)
        if name not in SECTIONS:
            faults.append(f"{where}: section {name[:20]!r} is unknown and left out")
        elif name in seen:
            faults.append(f"{where}: section {name} stands twice")
        seen.add(name)
    return faults
