"""Lists of points: CSV and its kin, and JSON.

Text: one point a line, `x,y` parted by comma, semicolon, tab or blanks (the first point decides
which, for the whole file); an optional line of column names; `#` begins a comment; an empty line
begins a new stroke. With semicolons or tabs a number may carry a decimal comma.

JSON, one of

    [[x, y], ...]                   one stroke
    [[[x, y], ...], ...]            strokes
    {"units": "mm", "strokes": [{"points": [[x, y], ...], "closed": true, "layer": "CUT"}]}

A stroke is closed when it says so or when its last point is its first. Numbers are mm unless
the file or the caller names another unit. Every fault is an error with its line and column.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing, FitError, Units
from camtool.importers.assemble import Piece, assemble
from camtool.importers.options import ReadOptions
from camtool.importers.points_json import parse_json

_COMMENT = "#"
_NUMBER = re.compile(r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?", re.ASCII)
_NAME = re.compile(r"\s*[\"']?\s*([A-Za-z_µ][^,;\t]*?)[\"']?\s*")


@dataclass
class Stroke:
    """Points of one stroke in the file's unit, and where it begins ("line 3")."""

    points: list[tuple[float, float]]
    source: str
    closed: bool | None = None
    layer: str = "0"


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing of a file of points; DrawingError naming line and column."""
    text = _decoded(data, file)
    if text.lstrip()[:1] in ("[", "{"):
        unit, table = parse_json(text, file)
        strokes = [Stroke(row.points, row.source, row.closed, row.layer) for row in table]
    else:
        unit, strokes = None, _parse_lines(text, file)
    units = _units(unit, options)
    return assemble(
        [_piece(stroke, units.mm_per_unit) for stroke in strokes],
        file=file,
        units=units,
        fit=FitError(),
        used={"stroke": len(strokes)},
        skipped=[],
        findings=[],
        options=options,
    )


def _decoded(data: bytes, file: str) -> str:
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise DrawingError(
            "is no text in UTF-8", file=file, where=f"line {line}", mend="save it as plain text"
        ) from error
    if "\x00" in text:
        raise DrawingError("holds null characters: it is no text", file=file)
    return text


def _units(unit: str | None, options: ReadOptions) -> Units:
    """The caller's unit, else the file's, else mm."""
    if options.units is not None:
        return Units(options.units.lower(), options.mm_per(options.units), "as asked")
    if unit is not None:
        return Units(unit, options.mm_per(unit), "named in the file")
    return Units("mm", 1.0, "points are mm unless another unit is named")


def _piece(stroke: Stroke, mm_per_unit: float) -> Piece:
    vertices = np.zeros((len(stroke.points), 3))
    if stroke.points:
        with np.errstate(over="ignore"):  # infinity is refused, with its place, in assemble
            vertices[:, :2] = np.array(stroke.points) * mm_per_unit
    closed = stroke.closed
    if closed is None:
        closed = len(stroke.points) > 2 and stroke.points[0] == stroke.points[-1]
    return Piece(vertices, closed, stroke.layer, "", f"stroke {stroke.source}")


def _parse_lines(text: str, file: str) -> list[Stroke]:
    """Strokes of `x,y` lines."""
    strokes: list[Stroke] = []
    parted: str | None = None
    may_name = True
    fresh = True
    for number, line in enumerate(text.splitlines(), start=1):
        content = line.partition(_COMMENT)[0].rstrip()
        if not content.strip():
            # A line that is nothing but a comment does not end a stroke.
            fresh = fresh or not line.strip()
            continue
        if may_name and _names(content, f"line {number}", file):
            may_name = False
            continue
        may_name = False
        parted = _separator(content) if parted is None else parted
        point = _point(content, parted, number, file)
        if fresh:
            strokes.append(Stroke([], f"at line {number}"))
            fresh = False
        strokes[-1].points.append(point)
    return strokes


def _separator(content: str) -> str:
    """What parts the fields of this line; "" for blanks."""
    return next((sign for sign in (";", "\t", ",") if sign in content.strip()), "")


def _names(content: str, where: str, file: str) -> bool:
    """Whether the line names columns; DrawingError when it names them in another order."""
    parted = _separator(content)
    fields = content.split(parted) if parted else content.split()
    if not all(_NAME.fullmatch(field) for field in fields):
        return False
    if any(_not_finite(field) for field in fields):
        return False
    first = [field.strip(" \"'").lower()[:1] for field in fields]
    if len(fields) != 2 or (first != ["x", "y"] and set(first) & {"x", "y"}):
        raise DrawingError(
            f"columns are {content.strip()!r}", file=file, where=where, mend="give x,y"
        )
    return True


def _not_finite(field: str) -> bool:
    return field.strip().lstrip("+-").lower() in ("nan", "inf", "infinity")


def _point(content: str, parted: str, line: int, file: str) -> tuple[float, float]:
    """x and y of one line; DrawingError naming line and column."""
    fields = content.split(parted) if parted else content.split()
    if len(fields) != 2:
        raise DrawingError(
            f"{len(fields)} fields, wanted x and y",
            file=file,
            where=f"line {line}",
            mend="give two numbers a line",
        )
    values: list[float] = []
    column = 1
    for field in fields:
        place = content.index(field, column - 1) + len(field) - len(field.lstrip()) + 1
        values.append(_number(field, parted, f"line {line}, column {place}", file))
        column += len(field) + len(parted)
    return values[0], values[1]


def _number(field: str, parted: str, where: str, file: str) -> float:
    text = field.strip().strip("\"'").strip()
    if parted in (";", "\t"):
        text = text.replace(",", ".", 1)
    if not _NUMBER.fullmatch(text):
        what = "is not finite" if _not_finite(text) else "is no number"
        raise DrawingError(f"{field.strip()!r} {what}", file=file, where=where)
    value = float(text)
    if not math.isfinite(value):
        raise DrawingError(f"{field.strip()!r} is not finite", file=file, where=where)
    return value
