"""Points as text, as JSON and in NumPy's files, each to strokes whose unit is not known yet."""

from __future__ import annotations

import io
import math
import re
import warnings
from array import array
from collections.abc import Iterator
from typing import Any, NoReturn

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.importers.formats import zip_faults
from camtool.units import MM_PER_UNIT

COLUMNS = (2, 3)


class Stroke(Struct, frozen=True, eq=False):
    """A polyline: `points` (n, 2) or (n, 3) of x, y, bulge in the file's unit.

    `source` says where it stands in the file. `closed` is None when the file does not say: then
    the stroke is closed if it ends where it began."""

    points: Floats
    source: str
    closed: bool | None = None
    layer: str = "0"


class PointTable(Struct, frozen=True, eq=False):
    """All strokes of a file, its unit (None when the file names none), and the reason `why` for
    that unit.

    `mm_per_unit` is given only for a unit that `camtool.units` does not have."""

    strokes: list[Stroke]
    unit: str | None = None
    mm_per_unit: float | None = None
    why: str = "named in the file"


# Points as text: one `x,y` a line.
#
#     # a comment        an empty line begins a new stroke
#     x [mm];y [mm]      names of the columns, with their unit or without: may be left out
#     1,5;2,25           the first point decides what parts the fields, for the whole file
#
# Fields are parted by semicolon, tab, comma or blanks. A third column must be named `bulge`.
#
# The comma is the decimal sign in a file parted by semicolons or tabs, in quoted fields, and in a
# file parted by blanks when something in it proves so: a number without a comma, or one such as
# `1,05`. Without a proof `1,5 2,5` may as well be two points, and is refused. So is a file with
# decimal commas and decimal points: one of the two then parts thousands.

_REAL = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_REAL_COMMA = _REAL.replace(r"\.", "[.,]")
_NUMBER = re.compile(_REAL, re.ASCII)
_NUMBER_COMMA = re.compile(_REAL_COMMA, re.ASCII)
_COMMENT = re.compile(r"[#%]")
_NAME = re.compile(r"\s*[\"']?\s*([A-Za-z_µ][^,;\t]*?)[\"']?\s*")
_UNIT = re.compile(r"[^\[(]*[\[(]\s*(?P<sure>[^\])]*?)\s*[\])]|\w+?[_/]\s*(?P<maybe>[a-zµ]+)")
_QUOTED = re.compile(r"\"[^\"]*\"")
_COMMA_THEN_BLANK = re.compile(r",\s+\S")
_PROOF = re.compile(r",0\d")
_BLANK_LINE = " \t,;"

_ONE_SIGN = "write every number with one decimal sign, and no sign between thousands"
_NAMED_COLUMNS = "give two numbers a line, or name the columns x,y,bulge in the first line"


CHARS_AT_ONCE = 1 << 16
"""Number of characters that are divided into lines at a time: each line is a string."""


def _lines_of(text: str) -> Iterator[str]:
    """Yield the lines of a text, as `str.splitlines` divides it."""
    begin = 0
    while begin < len(text):
        end = text.find("\n", begin + CHARS_AT_ONCE) + 1 or len(text)
        yield from text[begin:end].splitlines()
        begin = end


def parse_lines(text: str, file: str) -> PointTable:
    """Return the strokes of a text of points; DrawingError naming line and column."""
    return _Lines(file).parse(text)


class _Lines(Struct):
    """The reader of a table, and the format that its lines have shown so far.

    `parted` is the separator ("" for blanks), `comma_line` and `point_line` the first lines with a
    decimal comma and a decimal point, `proven`: a line has proved that its commas are decimal
    ones."""

    file: str
    parted: str | None = None
    columns: int = 2
    unit: str | None = None
    comma_line: int = 0
    point_line: int = 0
    proven: bool = False
    numbers: array[float] = field(default_factory=lambda: array("d"))
    starts: list[tuple[int, int]] = field(default_factory=list)

    def parse(self, text: str) -> PointTable:
        starts_stroke, may_name = True, True
        pattern: re.Pattern[str] | None = None
        for number, line in enumerate(_lines_of(text), start=1):
            content = _COMMENT.split(line, maxsplit=1)[0] if "#" in line or "%" in line else line
            if not content.strip(_BLANK_LINE):
                # A line that is nothing but a comment does not end a stroke.
                starts_stroke = starts_stroke or not line.strip(_BLANK_LINE)
                continue
            content = content.rstrip()
            named = may_name and self._names(content, number)
            may_name = False
            if named:
                continue
            if pattern is None:
                self.parted = _separator(content, self.columns)
                pattern = _row_pattern(self.parted, self.columns)
            if starts_stroke:
                self.starts.append((len(self.numbers) // self.columns, number))
                starts_stroke = False
            self.numbers.extend(self._row(content, number, pattern))
        self._refuse_ambiguous()
        return PointTable(self._strokes(), self.unit)

    def _strokes(self) -> list[Stroke]:
        points = np.frombuffer(self.numbers, dtype=np.float64).reshape(-1, self.columns)
        following = [*self.starts[1:], (len(points), 0)]
        return [
            Stroke(points[first:end], f"at line {line}")
            for (first, line), (end, _) in zip(self.starts, following, strict=False)
        ]

    def _row(self, content: str, line: int, pattern: re.Pattern[str]) -> tuple[float, ...]:
        """Return the numbers of one line.

        The pattern matches plain numbers and is many times faster; any other line is read field by
        field."""
        match = pattern.fullmatch(content)
        if match is None:
            return self._diagnosed(content, line)
        if self.parted != ",":
            if "," in content:
                self._comma(content, content.count(",") < self.columns, line)
                content = content.replace(",", ".")
                match = pattern.fullmatch(content)
                assert match is not None
            elif "." in content:
                self._point(line)
            else:
                self.proven = True
        values = tuple(map(float, match.groups()))
        if not all(map(math.isfinite, values)):
            return self._diagnosed(content, line)
        return values

    def _diagnosed(self, content: str, line: int) -> tuple[float, ...]:
        """Return the numbers of one line, field by field; DrawingError naming the first bad
        field."""
        fields = _fields(content, self.parted or "")
        if len(fields) != self.columns:
            expected = "x and y" if self.columns == 2 else "x, y and bulge"
            raise DrawingError(
                f"{len(fields)} fields, wanted {expected}",
                file=self.file,
                where=f"line {line}",
                mend="if the comma is the decimal sign too, separate x and y by a semicolon"
                if self.parted == "," and len(fields) > self.columns
                else _NAMED_COLUMNS,
            )
        return tuple(self._number(text, column, line) for text, column in fields)

    def _number(self, text: str, column: int, line: int) -> float:
        content = text.strip("\"'").strip()
        if self.parted != "," or _QUOTED.fullmatch(text):
            if "," in content:
                self._comma(content, False, line)
            elif "." in content:
                self._point(line)
            content = content.replace(",", ".", 1)
        value = float(content) if _NUMBER.fullmatch(content) else None
        if value is None or not math.isfinite(value):
            odd = "is not finite" if value is not None or _not_finite(content) else "is no number"
            where = f"line {line}, column {column}"
            raise DrawingError(f"{text!r} {odd}", file=self.file, where=where)
        return value

    def _comma(self, content: str, proven: bool, line: int) -> None:
        """Note that a line has a decimal comma; DrawingError if another line has a decimal point.

        `proven`: the line itself proves that its commas are decimal ones and do not separate x
        from y."""
        self.comma_line = self.comma_line or line
        self.proven = self.proven or proven or _PROOF.search(content) is not None
        if "." in content:
            self._point(line)
        self._refuse_mixed(line)

    def _point(self, line: int) -> None:
        self.point_line = self.point_line or line
        self._refuse_mixed(line)

    def _refuse_mixed(self, line: int) -> None:
        if self.comma_line and self.point_line:
            raise DrawingError(
                f"has a decimal comma (line {self.comma_line}) and a decimal point "
                f"(line {self.point_line})",
                file=self.file,
                where=f"line {line}",
                mend=_ONE_SIGN,
            )

    def _refuse_ambiguous(self) -> None:
        if self.parted == "" and self.comma_line and not self.proven:
            raise DrawingError(
                "may be x and y with decimal commas, or two points x,y",
                file=self.file,
                where=f"line {self.comma_line}",
                mend="separate x and y by a semicolon, or write decimal points",
            )

    def _names(self, content: str, line: int) -> bool:
        """Read a line of column names if it is one, and return True; DrawingError for an order
        other than x, y, bulge."""
        parted = next((sign for sign in (";", "\t", ",") if sign in content), "")
        fields = content.split(parted) if parted else content.split()
        matches = [_NAME.fullmatch(name) for name in fields]
        names = [match[1].strip() for match in matches if match]
        if len(names) < len(fields) or any(_not_finite(name) for name in names):
            return False
        first = [name.lower()[:1] for name in names]
        in_order = first == ["x", "y"] or not set(first) & {"x", "y"}
        bulged = len(names) == 3 and first[:2] == ["x", "y"] and names[2].lower() == "bulge"
        if not bulged and (len(names) != 2 or not in_order):
            raise DrawingError(
                f"columns are {content.strip()!r}",
                file=self.file,
                where=f"line {line}",
                mend="give x,y or x,y,bulge",
            )
        self.columns = len(names)
        self.unit = self._unit(names[:2], line)
        return True

    def _unit(self, names: list[str], line: int) -> str | None:
        """Return the unit that the names of both columns give, as in `x [in]` or `x_mm`; None
        without one."""
        units: set[str | None] = set()
        for name in names:
            match = _UNIT.fullmatch(name)
            unit = (match["sure"] or match["maybe"] or "").lower() if match else ""
            if unit not in MM_PER_UNIT and match and match["sure"]:
                raise DrawingError(
                    f"{match['sure']!r} is no unit of length",
                    file=self.file,
                    where=f"line {line}",
                    mend=f"use one of {', '.join(u for u in MM_PER_UNIT if u.isalpha())}",
                )
            units.add(unit if unit in MM_PER_UNIT else None)
        if len(units) > 1:
            raise DrawingError(
                "x and y have different units", file=self.file, where=f"line {line}"
            )
        return units.pop()


def _separator(content: str, columns: int) -> str:
    """Return the separator of the fields of this line: ";", ",", tab, or "" for blanks."""
    content = content.strip()
    unquoted = _QUOTED.sub("0", content)
    if ";" in unquoted:
        return ";"
    if "," in unquoted:
        pieces = [piece.strip() for piece in unquoted.split(",")]
        is_complete = len(pieces) == columns and all(map(_NUMBER.fullmatch, pieces))
        if is_complete or _COMMA_THEN_BLANK.search(unquoted):
            return ","
        if "\t" in unquoted:
            return "\t"
        blank = content.split()
        return "" if len(blank) == columns and all(map(_NUMBER_COMMA.fullmatch, blank)) else ","
    return "\t" if "\t" in unquoted else ""


def _row_pattern(parted: str, columns: int) -> re.Pattern[str]:
    """Return the pattern that matches a line of plain numbers with this separator."""
    number = f"({_REAL})" if parted == "," else f"({_REAL_COMMA})"
    sign = rf"[^\S\t]*{parted}[^\S\t]*" if parted else r"\s+"
    return re.compile(rf"\s*{sign.join([number] * columns)}\s*", re.ASCII)


def _fields(content: str, parted: str) -> list[tuple[str, int]]:
    """Return each field without blanks around it, and its column in the line; a separator within
    quotes does not count."""
    if not parted:
        return [(match[0], match.start() + 1) for match in re.finditer(r"\S+", content)]
    hidden = _QUOTED.sub(lambda match: "0" * len(match[0]), content)
    fields: list[tuple[str, int]] = []
    start = 0
    for piece in hidden.split(parted):
        text = content[start : start + len(piece)]
        fields.append((text.strip(), start + len(text) - len(text.lstrip()) + 1))
        start += len(piece) + 1
    return fields


def _not_finite(name: str) -> bool:
    return name.strip().lstrip("+-").lower() in ("nan", "inf", "infinity")


# Points as JSON, one of
#
#     [[x, y], ...]                   one stroke
#     [[[x, y], ...], ...]            strokes
#     {"units": "mm", "strokes": [{"points": [[x, y], ...], "closed": true, "layer": "CUT"}]}

_FILE_KEYS = ("units", "strokes")
_STROKE_KEYS = ("points", "closed", "layer")


def parse_json(text: str, file: str) -> PointTable:
    """Return the strokes of a JSON text and its unit; DrawingError naming the field."""
    import json

    try:
        value = json.loads(text, parse_constant=_refuse_constant)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}"
        raise DrawingError(f"is no JSON: {error.msg}", file=file, where=where) from error
    except RecursionError as error:
        raise DrawingError("is nested too deep for points", file=file) from error
    except ValueError as error:
        raise DrawingError(f"is no JSON: {error}", file=file) from error
    return _Walker(file).document(value)


def _stroke(
    points: list[tuple[float, float]], index: int, closed: bool | None = None, layer: str = "0"
) -> Stroke:
    rows = np.array(points, dtype=np.float64).reshape(-1, 2)
    return Stroke(rows, f"{index + 1}", closed, layer)


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name} is not finite")


class _Walker:
    """The reader of a JSON document: it checks every field, and names the bad one; `file` is for
    the messages."""

    def __init__(self, file: str) -> None:
        self.file = file

    def document(self, value: object) -> PointTable:
        if isinstance(value, dict):
            self._known(value, _FILE_KEYS, "")
            rows = self._list(value.get("strokes"), "strokes")
            strokes = [self._stroke(row, f"strokes[{i}]", i) for i, row in enumerate(rows)]
            return PointTable(strokes, self._unit(value.get("units")))
        rows = self._list(value, "the file")
        # [x, y] holds numbers, a stroke holds lists.
        first = rows[0] if rows else None
        if isinstance(first, list) and first and isinstance(first[0], list):
            return PointTable(
                [_stroke(self._points(row, f"[{i}]"), i) for i, row in enumerate(rows)]
            )
        return PointTable([_stroke(self._points(rows, ""), 0)])

    def _stroke(self, value: object, where: str, index: int) -> Stroke:
        if not isinstance(value, dict):
            self._fail("is no object", where)
        self._known(value, _STROKE_KEYS, where)
        closed = value.get("closed")
        if closed is not None and not isinstance(closed, bool):
            self._fail("is neither true nor false", f"{where}.closed")
        layer = value.get("layer", "0")
        if not isinstance(layer, str) or not layer.isprintable():
            self._fail("is no text", f"{where}.layer")
        points = self._points(value.get("points"), f"{where}.points")
        return _stroke(points, index, closed, layer)

    def _points(self, value: object, where: str) -> list[tuple[float, float]]:
        points: list[tuple[float, float]] = []
        for row, pair in enumerate(self._list(value, where)):
            place = f"{where}[{row}]"
            if not isinstance(pair, list) or len(pair) != 2:
                self._fail("is no [x, y]", place)
            points.append(
                (self._number(pair[0], f"{place}[0]"), self._number(pair[1], f"{place}[1]"))
            )
        return points

    def _number(self, value: object, where: str) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float):
            self._fail("is no number", where)
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self._fail("is not finite", where)
        return number

    def _unit(self, value: object) -> str | None:
        if value is None:
            return None
        if not isinstance(value, str) or value.lower() not in MM_PER_UNIT:
            self._fail(f"{value!r} is no unit of length", "units")
        return value.lower()

    def _list(self, value: object, where: str) -> list[Any]:
        if not isinstance(value, list):
            self._fail("is no list", where)
        return value

    def _known(self, table: dict[str, Any], keys: tuple[str, ...], where: str) -> None:
        unknown = sorted(set(table) - set(keys))
        if unknown:
            self._fail(
                f"unknown key {unknown[0]!r}", where or "the file", f"known: {', '.join(keys)}"
            )

    def _fail(self, message: str, where: str, mend: str = "") -> NoReturn:
        raise DrawingError(message, file=self.file, where=where or "the file", mend=mend)


# Points in NumPy's files: `.npy` (one array) and `.npz` (one array per stroke).
#
# An array is (n, 2) of x, y, or (n, 3) of x, y, bulge; of any real or whole numbers. The name of
# an array in an .npz is its layer. Pickled objects are never loaded: they could run anything.
#
# An .npz is a ZIP: what it says of its own size is not believed, no more than MAX_UNPACKED_BYTES
# are unpacked, and no memory is taken for numbers that are not there.


MAX_UNPACKED_BYTES = 1 << 28

MAX_MEMBERS = 100_000

_SAVE = "give an array of numbers (n, 2) of x, y or (n, 3) of x, y, bulge"


def parse_npy(data: bytes, file: str) -> PointTable:
    """Return the one stroke of an .npy file; DrawingError if its array is no list of points."""
    return PointTable([Stroke(_array(data, file, ""), "of the array")])


def parse_npz(data: bytes, file: str) -> PointTable:
    """Read each array as a stroke on the layer of its name; DrawingError for an array that is no
    list of points."""
    import zipfile

    strokes: list[Stroke] = []
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = archive.infolist()
            if len(members) > MAX_MEMBERS:
                raise DrawingError(f"holds more than {MAX_MEMBERS} arrays", file=file)
            budget = MAX_UNPACKED_BYTES
            for member in members:
                layer = _layer(member.filename, file)
                with archive.open(member) as stream:
                    content = stream.read(budget + 1)
                budget -= len(content)
                if budget < 0:
                    raise DrawingError(
                        f"unpacks to more than {MAX_UNPACKED_BYTES // 1_000_000} MB",
                        file=file,
                        mend="split it into several files",
                    )
                points = _array(content, file, layer)
                strokes.append(Stroke(points, f"of array {layer}", layer=layer))
    except zip_faults() as error:
        if isinstance(error, DrawingError):
            raise
        raise _broken(file, error) from error
    return PointTable(strokes)


def _broken(file: str, error: Exception) -> DrawingError:
    reason = " ".join(str(error).split()) or type(error).__name__
    return DrawingError(f"cannot be unpacked: {reason}", file=file, mend="save it again")


def _layer(name: str, file: str) -> str:
    layer = name.removesuffix(".npy")
    if layer == name or not layer.isprintable() or not layer.strip():
        raise DrawingError(
            f"holds {name!r}, which is no array", file=file, mend="save it with numpy.savez"
        )
    return layer


def _array(data: bytes, file: str, name: str) -> Floats:
    """Return the points (n, 2) or (n, 3) of the content of one .npy file."""
    where = f"array {name}" if name else None
    shape, fortran, dtype, begin = _header(data, file, where)
    check_type(shape, dtype, file, where)
    expected_bytes = math.prod(shape) * dtype.itemsize
    if len(data) - begin != expected_bytes:
        raise DrawingError(
            f"holds {len(data) - begin} bytes of numbers, wanted {expected_bytes}",
            file=file,
            where=where,
        )
    raw = np.frombuffer(data, dtype, offset=begin)
    with np.errstate(over="ignore", invalid="ignore"):
        points = raw.reshape(shape, order="F" if fortran else "C").astype(np.float64)
    check_numbers(points, file, name)
    return points


def check_type(
    shape: tuple[int, ...], dtype: np.dtype[np.generic], file: str, where: str | None
) -> None:
    """Raise DrawingError if an array of this type or shape is no list of points."""
    if dtype.hasobject or dtype.kind not in "fiu":
        content = "objects" if dtype.hasobject else f"numbers of type {dtype}"[:60]
        raise DrawingError(f"holds {content}, no coordinates", file=file, where=where, mend=_SAVE)
    if len(shape) != 2 or shape[1] not in COLUMNS:
        is_transposed = len(shape) == 2 and shape[0] in COLUMNS
        raise DrawingError(
            f"is an array {shape}",
            file=file,
            where=where,
            mend="transpose it (array.T): a row is a point" if is_transposed else _SAVE,
        )


def _header(
    data: bytes, file: str, where: str | None
) -> tuple[tuple[int, ...], bool, np.dtype[np.generic], int]:
    """Return shape, Fortran order, type, and the offset of the numbers of an .npy file; its header
    is read as a literal, never run."""
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about numbers in a damaged header
            if version == (1, 0):
                shape, fortran, dtype = np.lib.format.read_array_header_1_0(stream)
            else:
                shape, fortran, dtype = np.lib.format.read_array_header_2_0(stream)
    # NumPy does not document what its reader raises for a damaged header.
    except Exception as error:
        raise DrawingError(
            "has a damaged header", file=file, where=where, mend="save it again"
        ) from error
    if any(size < 0 for size in shape):
        raise DrawingError(f"is an array {shape}", file=file, where=where, mend=_SAVE)
    return shape, bool(fortran), dtype, stream.tell()


def check_numbers(points: Floats, file: str, name: str) -> None:
    """Raise DrawingError for the first row that is no point, with its number."""
    head = f"array {name}, " if name else ""
    odd = ~np.isfinite(points).all(axis=1)
    if odd.any():
        raise DrawingError(
            "a number is not finite", file=file, where=f"{head}row {int(np.argmax(odd))}"
        )
    steep = np.abs(points[:, 2:]).max(axis=1, initial=0.0) > 1.0
    if steep.any():
        raise DrawingError(
            "the third column is above 1, which is more than the bulge of a half circle",
            file=file,
            where=f"{head}row {int(np.argmax(steep))}",
            mend="give two columns when the third one is a height; cut larger arcs in two",
        )
