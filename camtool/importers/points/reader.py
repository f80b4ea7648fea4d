"""Lists of points: CSV and its kin, JSON, NumPy's files and the Matlab router's arrays.

    text     one point a line
    JSON     strokes of [x, y]
    .npy     one array (n, 2), or (n, 3) with bulges; .npz: one array per stroke
    .m       the arrays xy, lxy and velxy in tenths of a millimetre (`matlab`)

The content says which; `tables` has all but the last. A stroke is closed when the file says so
or when its last point is its first. Numbers are mm unless the file or the caller names another
unit. Every fault is an error with its line (or its row in an array). Nothing in a file is ever run
or unpickled."""

from __future__ import annotations

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing, Units
from camtool.geometry.fit import split_bulges
from camtool.importers.assemble import assemble, unit_or_mm
from camtool.importers.formats import NPY_START, ZIP_START
from camtool.importers.options import ReadOptions
from camtool.importers.pieces import MAX_POINTS, Piece, too_many_points
from camtool.importers.points.matlab import is_matlab, parse_matlab
from camtool.importers.points.tables import (
    PointTable,
    Stroke,
    parse_json,
    parse_lines,
    parse_npy,
    parse_npz,
)


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """Return the Drawing of a file of points; DrawingError naming line and column."""
    table = _table(data, file)
    units = _units(table, options)
    pieces = [piece_of(stroke, units.mm_per_unit) for stroke in table.strokes]
    del data, table  # their numbers are in the pieces
    return assemble(pieces, file=file, units=units, used={"stroke": len(pieces)}, options=options)


def _table(data: bytes, file: str) -> PointTable:
    if data.startswith(NPY_START):
        return parse_npy(data, file)
    if data.startswith(ZIP_START):
        return parse_npz(data, file)
    text = _decoded(data, file)
    if text.lstrip()[:1] in ("[", "{"):
        return parse_json(text, file)
    return parse_matlab(text, file) if is_matlab(text, file) else parse_lines(text, file)


def _decoded(data: bytes, file: str) -> str:
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = data.decode(encoding)
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise DrawingError(
            "is no text in UTF-8", file=file, where=f"line {line}", mend="save it as plain text"
        ) from error
    if text.count("\n") > MAX_POINTS:
        raise too_many_points(file)
    if "\x00" in text:
        raise DrawingError("holds null characters: it is no text", file=file)
    return text


def _units(table: PointTable, options: ReadOptions) -> Units:
    """Return the unit that the caller asks for, else the file's, else mm."""
    if options.units is None and table.unit is not None:
        size = table.mm_per_unit
        return Units(table.unit, options.mm_per(table.unit) if size is None else size, table.why)
    return unit_or_mm(options, "points are mm unless another unit is named")


def piece_of(stroke: Stroke, mm_per_unit: float) -> Piece:
    """Return a stroke as a piece in mm; arcs of more than a half circle are cut in two."""
    points = stroke.points
    vertices = np.zeros((len(points), 3))
    closed = stroke.closed
    if len(points):
        with np.errstate(over="ignore"):  # infinity is refused, with its place, in assemble
            vertices[:, :2] = points[:, :2] * mm_per_unit
        vertices[:, 2:][:, : points.shape[1] - 2] = points[:, 2:]
        if closed is None:
            closed = len(points) > 2 and bool((points[0, :2] == points[-1, :2]).all())
        if np.isfinite(vertices).all():
            vertices = split_bulges(vertices, closed)
    return Piece(vertices, bool(closed), stroke.layer, "", f"stroke {stroke.source}")
