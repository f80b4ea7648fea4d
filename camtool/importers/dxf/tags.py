"""The bytes of a DXF file to its tags, and what the tags themselves say is damaged.

A *tag* is a group code and a value: two lines of ASCII, or bytes of binary DXF. ezdxf's readers
also accept "1_0" as a number, and find one in garbage ("x1y"); here whatever is no number ends
the reading. `frame_of` finds the sections, and whether the file is whole.

The values of ASCII stay in the bytes of the file until they are asked for: as strings they would
take eight times as much memory."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
from msgspec import Struct

from camtool.arrays import Bools, Floats, Ints, distinct
from camtool.errors import DrawingError
from camtool.records import replace

AGAIN = "export it again from the program that made it, best as DXF R2000 or later"

MAX_CODE, UNUSED_CODES = 1071, range(482, 999)
"""Group codes in files are 0 to 481 and 999 to 1071 (DXF reference)."""

SECTIONS = frozenset(
    ("HEADER", "CLASSES", "TABLES", "BLOCKS", "ENTITIES", "OBJECTS", "THUMBNAILIMAGE", "ACDSDATA")
)
"""Sections that the DXF reference names."""

AT_ONCE = 65536
"""Number of values that are converted to Python objects in one batch."""

_LAYER, _VARIABLE, _POINT, _COUNT = 8, 9, 10, 90
_UTF16_MARKS, _UTF8_MARK = (b"\xff\xfe", b"\xfe\xff"), b"\xef\xbb\xbf"
_CODE = re.compile(rb"[ \t]*[0-9]{1,4}[ \t]*\r?")
_NUMBER = re.compile(
    r"[ \t]*[-+]?(?:(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?|nan|inf(?:inity)?)\s*", re.I
)
_VERSION = re.compile(rb"\$ACADVER\s+1\s+(AC\d{4})")
_CODEPAGE = re.compile(rb"\$DWGCODEPAGE\s+3\s+(\w+)")
_UTF8_SINCE = b"AC1021"
_NUMERIC_CODES = (
    *((10, 80), (90, 100), (110, 150), (160, 180), (210, 240), (270, 300)),
    *((370, 390), (400, 410), (420, 430), (440, 470), (1010, MAX_CODE + 1)),
)
"""Group codes from each first to before each second have numbers as values (DXF reference)."""
_NOT_ASCII = 0x80
_HEAD_BYTES = 65536  # the header's first variables name version and code page

Codes = npt.NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Tags(ABC):
    """The tags of a file, comments (999) included: group codes `codes` (N,), and a value for each.

    `notes`: phrases about damage that does not affect the rest."""

    codes: Codes
    notes: tuple[str, ...] = ()

    is_text: ClassVar[bool]

    @abstractmethod
    def raw(self, rows: Ints) -> Iterator[Any]:
        """Return the values of these tags as they stand in the file: for ASCII the bytes of their
        lines."""

    @abstractmethod
    def values(self, rows: Ints) -> Iterator[Any]:
        """Return the values of these tags: for ASCII text, for binary DXF strings, numbers or
        bytes."""

    @abstractmethod
    def code_as_said(self, row: int) -> str:
        """Return the group code of a tag as it stands in the file, for messages."""

    @abstractmethod
    def ended(self, count: int) -> Tags:
        """Return the first `count` tags, followed by the end mark 0 EOF."""

    def value(self, row: int) -> Any:
        """Return the value of one tag."""
        return next(self.values(np.array([row])))

    def numbers(self, rows: Ints) -> Floats:
        """Return the values of these tags as numbers (K,); ValueError if one is no number."""
        return np.fromiter(map(float, self.raw(rows)), dtype=np.float64, count=len(rows))

    def pairs(self, rows: Ints) -> Iterator[tuple[int, Any]]:
        """Yield the group code and the value of each of these tags."""
        for part in batches(rows):
            yield from zip(self.codes[part].tolist(), self.values(part), strict=True)

    def where(self, row: int) -> str:
        """Return the place of a tag in the file for messages: its line, or in binary DXF its
        number."""
        return f"line {2 * row + 1}" if self.is_text else f"tag {row + 1}"

    @cached_property
    def marks(self) -> Ints:
        """Rows (M,) of the tags at which an entity or section begins: their code is 0."""
        return np.flatnonzero(self.codes == 0)

    @cached_property
    def kinds(self) -> list[Any]:
        """Names of the entities and sections that begin at the `marks`."""
        return list(self.values(self.marks))


def batches(rows: Ints) -> Iterator[Ints]:
    """Return an iterator over the rows in batches of AT_ONCE."""
    return (rows[first : first + AT_ONCE] for first in range(0, len(rows), AT_ONCE))


@dataclass(frozen=True, eq=False)
class BinaryTags(Tags):
    """The tags of binary DXF; `held` are their values, already converted."""

    held: Sequence[Any] = ()

    is_text = False

    def raw(self, rows: Ints) -> Iterator[Any]:
        """Return the values of these tags: strings, numbers or bytes."""
        return map(self.held.__getitem__, rows.tolist())

    values = raw

    def code_as_said(self, row: int) -> str:
        """Return the group code of a tag, for messages."""
        return str(self.codes[row])

    def ended(self, count: int) -> Tags:
        """Return the first `count` tags, followed by the end mark 0 EOF."""
        return BinaryTags(np.append(self.codes[:count], _MARK), (), [*self.held[:count], "EOF"])


@dataclass(frozen=True, eq=False)
class TextTags(Tags):
    r"""The tags of ASCII DXF: line 2k of `data` is the code of tag k, line 2k + 1 its value; line
    j begins at the byte `at[j]`.

    `escaped`: characters may be written as \U+00D6 or \M+1…"""

    data: bytes = b""
    at: npt.NDArray[np.int32] = field(default_factory=lambda: np.zeros(1, dtype=np.int32))
    encoding: str = "utf-8"
    escaped: bool = False

    is_text = True

    def raw(self, rows: Ints) -> Iterator[bytes]:
        """Yield the bytes of the lines that hold the values of these tags."""
        data = self.data
        for part in batches(rows):
            ends = zip(self.at[2 * part + 1].tolist(), self.at[2 * part + 2].tolist(), strict=True)
            yield from [data[begin : end - 1] for begin, end in ends]

    def values(self, rows: Ints) -> Iterator[str]:
        """Yield the values of these tags as text."""
        for part in batches(rows):
            texts = [
                line.decode(self.encoding, "surrogateescape").rstrip("\r")
                for line in self.raw(part)
            ]
            yield from _without_escapes(texts) if self.escaped else texts

    def code_as_said(self, row: int) -> str:
        """Return the group code of a tag as it stands in the file, in quotes, for messages."""
        line = self.data[self.at[2 * row] : self.at[2 * row + 1] - 1]
        return repr(line.decode(self.encoding, "surrogateescape").strip()[:20])

    def ended(self, count: int) -> Tags:
        """Return the first `count` tags, followed by the end mark 0 EOF."""
        lines = self.at[: 2 * count + 1]
        return replace(
            self,
            codes=np.append(self.codes[:count], _MARK),
            data=self.data[: lines[-1] - 1] + b"\n0\nEOF\n",
            at=np.append(lines, lines[-1] + np.array([2, 6], dtype=np.int32)),
        )

    def values_with(self, letters: Bools) -> Ints:
        """Return the rows of the tags whose values contain a marked byte; `letters` is a mask over
        `data`."""
        lines = np.searchsorted(self.at, np.flatnonzero(letters), side="right") - 1
        rows = distinct(lines[lines % 2 == 1] // 2)
        return rows[rows < len(self.codes)]


_MARK = np.zeros(1, dtype=np.int32)


class Section(Struct, frozen=True):
    """A section of the file: its tags from `begin`, its 0 SECTION, to `end`, its 0 ENDSEC (None
    when that is missing)."""

    name: str
    begin: int
    end: int | None


class DxfSections(Struct, frozen=True):
    """The sections of a file, the row of the end mark `eof` (None when it is missing), and the
    faults in their order."""

    sections: tuple[Section, ...]
    eof: int | None
    faults: tuple[str, ...]

    def is_complete(self, name: str) -> bool:
        """Return True if there is a section of this name, and every section of this name has its
        ENDSEC."""
        ends = [part.end for part in self.sections if part.name == name]
        return bool(ends) and None not in ends


def binary_tags(data: bytes, file: str) -> Tags:
    """Return the tags of binary DXF up to its end mark, or up to the first bytes that cannot be
    read as a tag; DrawingError for an impossible group code."""
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
    tags = BinaryTags(np.array(codes, dtype=np.int32), held=values)
    _check_codes(tags, file)
    return tags


def ascii_tags(data: bytes, file: str) -> Tags:
    """Return the tags of ASCII DXF up to its end mark; DrawingError for a line that should be a
    group code and is none."""
    data, encoding, notes = _plain_lines(data)
    letters = np.frombuffer(data, dtype=np.uint8)
    feeds = np.flatnonzero(letters == ord("\n")).astype(np.int32)
    starts = np.concatenate([[0], feeds + 1, [len(data) + 1]], dtype=np.int32)
    count = (len(starts) - 1) // 2
    codes = np.empty(count, dtype=np.int32)
    codes_by_line: dict[bytes, int] = {}
    for first in range(0, count, AT_ONCE):
        last = min(first + AT_ONCE, count)
        lines = data[starts[2 * first] : starts[2 * last] - 1].split(b"\n")[::2]
        for line in {*lines} - codes_by_line.keys():
            codes_by_line[line] = int(line) if _CODE.fullmatch(line) else -1
        codes[first:last] = [codes_by_line[line] for line in lines]
    escaped = b"\\U+" in data or b"\\M+" in data
    tags = TextTags(codes, notes, data, starts, encoding, escaped)
    marks = zip(tags.marks.tolist(), tags.values(tags.marks), strict=True)
    end = next((row for row, value in marks if value == "EOF"), None)
    if end is not None:
        tags = replace(tags, codes=codes[: end + 1])
    _check_codes(tags, file)
    # Python's float() accepts "1_0" and digits of other scripts, which are no numbers in DXF.
    check_numbers(tags, file, tags.values_with(letters == ord("_")))
    if not data.isascii():
        check_numbers(tags, file, tags.values_with(letters >= _NOT_ASCII))
    return tags


def frame_of(tags: Tags) -> DxfSections:
    """Return the sections, the end mark, and the faults in their order."""
    sections: list[Section] = []
    faults: list[str] = []
    begin: int | None = None
    name, eof = "", None
    for k, kind in zip(tags.marks.tolist(), tags.kinds, strict=True):
        mark = str(kind).strip()
        if mark == "SECTION":
            if begin is not None:
                faults.append(f"{tags.where(k)}: section {name} has no end (ENDSEC)")
                sections.append(Section(name, begin, None))
            begin, name = k, _section_name(tags, k)
        elif mark == "ENDSEC":
            if begin is None:
                faults.append(f"{tags.where(k)}: the end of a section that has not begun")
            else:
                sections.append(Section(name, begin, k))
            begin = None
        elif mark == "EOF":
            eof = k
            break
        elif begin is None:
            faults.append(f"{tags.where(k)}: {mark[:20]} stands outside the sections")
    if begin is not None:
        faults.append(f"section {name} has no end (ENDSEC)")
        sections.append(Section(name, begin, None))
    return DxfSections(tuple(sections), eof, (*faults, *_wrong_names(tags, sections)))


def lost_entities(tags: Tags, frame: DxfSections) -> list[str]:
    """Return sentences about entities and vertices that are lost because a group code is damaged.

    An entity with two layers is in truth two entities: the mark (0) of the second one is damaged.
    """
    losses: list[str] = []
    for section in frame.sections:
        if section.name not in ("ENTITIES", "BLOCKS"):
            continue
        rows = np.flatnonzero(tags.codes[section.begin : section.end] == _LAYER) + section.begin
        entity = np.searchsorted(tags.marks, rows, side="right")
        repeated_rows = rows[1:][np.diff(entity) == 0]
        losses.extend(f"{tags.where(int(k))}: two entities run into one" for k in repeated_rows)
    return losses + _lost_vertices(tags)


def _lost_vertices(tags: Tags) -> list[str]:
    """Return a sentence for each LWPOLYLINE that holds another number of vertices than it
    states."""
    losses: list[str] = []
    vertices, counts = (np.flatnonzero(tags.codes == code) for code in (_POINT, _COUNT))
    ends = [*tags.marks[1:].tolist(), len(tags.codes)]
    for begin, end, kind in zip(tags.marks.tolist(), ends, tags.kinds, strict=True):
        if str(kind).strip() == "LWPOLYLINE":
            holds = int(np.searchsorted(vertices, end) - np.searchsorted(vertices, begin))
            count_row = int(np.searchsorted(counts, begin))
            stated_count = (
                str(tags.value(int(counts[count_row]))).strip() if count_row < len(counts) else ""
            )
            if count_row < len(counts) and counts[count_row] < end and stated_count != str(holds):
                where = tags.where(begin)
                losses.append(
                    f"{where}: LWPOLYLINE counts {stated_count[:9]} vertices and holds {holds}"
                )
    return losses


def header_of(tags: Tags, frame: DxfSections) -> dict[str, Any]:
    """Return the header variables that the file sets, each with its first value."""
    variables: dict[str, Any] = {}
    for section in frame.sections:
        if section.name == "HEADER":
            end = len(tags.codes) if section.end is None else section.end
            rows = np.flatnonzero(tags.codes[section.begin : end - 1] == _VARIABLE) + section.begin
            for name, value in zip(tags.values(rows), tags.values(rows + 1), strict=True):
                variables.setdefault(str(name).strip(), value)
    return variables


def _plain_lines(data: bytes) -> tuple[bytes, str, tuple[str, ...]]:
    """Return the text with line feeds at line ends, its encoding, and its faults.

    In the encoding a line feed is a single byte; it is that of the byte-order mark, else that of
    the header."""
    notes: tuple[str, ...] = ()
    if data.startswith(_UTF16_MARKS):
        encoding, otherwise = "utf-16", "replace"
    else:
        encoding, otherwise = _encoding(data[:_HEAD_BYTES]), "surrogateescape"
    try:
        if not data.isascii():
            data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        notes = (f"line {line}: a byte is no text in {encoding}",)
    if encoding == "utf-16":
        data, encoding = data.decode("utf-16", otherwise).encode(), "utf-8"
    elif encoding == "utf-8-sig":
        data, encoding = data[len(_UTF8_MARK) :], "utf-8"
    return data if b"\n" in data else data.replace(b"\r", b"\n"), encoding, notes


def _encoding(head: bytes) -> str:
    """Return the encoding of a file from its head: UTF-8 since R2007, before that the code page
    that it names."""
    version, codepage = _VERSION.search(head), _CODEPAGE.search(head)
    if head.startswith(_UTF8_MARK):
        return "utf-8-sig"
    if version and version.group(1) >= _UTF8_SINCE:
        return "utf-8"
    if codepage is None or codepage.group(1) == b"ANSI_1252":
        return "cp1252"
    from ezdxf.tools.codepage import toencoding

    return str(toencoding(codepage.group(1).decode("ascii")))


def _check_codes(tags: Tags, file: str) -> None:
    """Raise DrawingError for the first number that is no possible group code."""
    codes = tags.codes
    unused = (UNUSED_CODES.start <= codes) & (codes < UNUSED_CODES.stop)
    odd = np.flatnonzero((codes < 0) | (codes > MAX_CODE) | unused)
    if len(odd):
        row = int(odd[0])
        raise DrawingError(
            f"{tags.code_as_said(row)} is no group code",
            file=file,
            where=tags.where(row),
            mend=AGAIN,
        )


def check_numbers(tags: Tags, file: str, rows: Ints) -> None:
    """Raise DrawingError if one of these tags has a code that requires a number and another
    value."""
    is_number = {code: _is_number(code) for code in distinct(tags.codes[rows]).tolist()}
    for row, (code, value) in zip(rows.tolist(), tags.pairs(rows), strict=True):
        if is_number[code] and not _NUMBER.fullmatch(str(value)):
            raise DrawingError(
                f"{str(value).strip()[:20]!r} is no number",
                file=file,
                where=tags.where(row),
                mend=AGAIN,
            )


def _is_number(code: int) -> bool:
    """Return True if values of this group code are numbers."""
    return any(first <= code < end for first, end in _NUMERIC_CODES)


def _without_escapes(values: list[str]) -> list[str]:
    r"""Return the values with escaped characters (\U+00D6 or \M+1…) decoded."""
    from ezdxf.lldxf.encoding import (
        decode_dxf_unicode,
        decode_mif_to_unicode,
        has_dxf_unicode,
        has_mif_encoding,
    )

    decoded = [decode_dxf_unicode(value) if has_dxf_unicode(value) else value for value in values]
    return [
        decode_mif_to_unicode(value) if has_mif_encoding(value) else value for value in decoded
    ]


def _section_name(tags: Tags, begin: int) -> str:
    """Return the name of the section that begins at tag `begin`; "" if it has none."""
    named = tags.codes[begin + 1 : begin + 2].tolist() == [2]
    return str(tags.value(begin + 1)).strip() if named else ""


def _wrong_names(tags: Tags, sections: list[Section]) -> list[str]:
    """Return a sentence for each section that is unknown or occurs twice."""
    faults: list[str] = []
    names_so_far: set[str] = set()
    for section in sections:
        name, where = section.name, tags.where(section.begin)
        if name not in SECTIONS:
            faults.append(f"{where}: section {name[:20]!r} is unknown and left out")
        elif name in names_so_far:
            faults.append(f"{where}: section {name} stands twice")
        names_so_far.add(name)
    return faults
