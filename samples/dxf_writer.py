"""Writes the sample drawings as DXF, without a library: no version, date or GUID changes them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import count

from shapes import (
    Arc,
    Circle,
    Ellipse,
    Insert,
    Line,
    Point,
    Polyline,
    Shape,
    Sheet,
    Spline,
    number,
)


def dxf(sheet: Sheet) -> str:
    """The sheet as DXF R2000 (AC1015) with handles and the tables that readers require."""
    return _DxfWriter(sheet).text()


class _DxfWriter:
    """Collects group codes and values; handles count up."""

    def __init__(self, sheet: Sheet) -> None:
        self.sheet = sheet
        self.rows: list[str] = []
        self.handles = count(0x20)
        self.spaces = {"*Model_Space": "1A", "*Paper_Space": "1B"}
        self.owners = self.spaces | {name: self.handle() for name in sheet.blocks}

    def text(self) -> str:
        """All sections; the header is made last, since it contains the next handle."""
        self.section("TABLES", self.tables)
        self.section("BLOCKS", self.blocks)
        self.section("ENTITIES", self.entities)
        self.section("OBJECTS", self.objects)
        body, self.rows = self.rows, []
        self.section("HEADER", self.header)
        return "\n".join([*self.rows, *body, "  0", "EOF", ""])

    def put(self, *pairs: tuple[int, object]) -> None:
        for code, value in pairs:
            text = number(value) if isinstance(value, float) else str(value)
            self.rows += [f"{code:3d}", text]

    def handle(self) -> str:
        return f"{next(self.handles):X}"

    def section(self, name: str, fill: Callable[[], None]) -> None:
        self.put((0, "SECTION"), (2, name))
        fill()
        self.put((0, "ENDSEC"))

    def header(self) -> None:
        width, height = self.sheet.size
        self.put((9, "$ACADVER"), (1, "AC1015"), (9, "$DWGCODEPAGE"), (3, "ANSI_1252"))
        self.put((9, "$INSUNITS"), (70, 4), (9, "$MEASUREMENT"), (70, 1))
        self.put((9, "$EXTMIN"), (10, 0.0), (20, 0.0), (30, 0.0))
        self.put((9, "$EXTMAX"), (10, width), (20, height), (30, 0.0))
        self.put((9, "$HANDSEED"), (5, self.handle()))

    def tables(self) -> None:
        self.table("VPORT", "1", [])
        self.table("LTYPE", "2", [self.ltype(n) for n in ("ByBlock", "ByLayer", "Continuous")])
        layers = [("0", 7), *((layer.name, layer.index) for layer in self.sheet.layers)]
        self.table("LAYER", "3", [self.layer(name, index) for name, index in layers])
        self.table("STYLE", "4", [self.style()])
        self.table("VIEW", "5", [])
        self.table("UCS", "6", [])
        self.table("APPID", "7", [self.record("APPID", "RegApp", "ACAD", [(70, 0)])])
        self.table("DIMSTYLE", "8", [], [(100, "AcDbDimStyleTable"), (71, 0)])
        records = [
            self.record("BLOCK_RECORD", "Block", name, [], handle)
            for name, handle in self.owners.items()
        ]
        self.table("BLOCK_RECORD", "9", records)

    def table(
        self,
        name: str,
        handle: str,
        records: list[list[tuple[int, object]]],
        more: Sequence[tuple[int, object]] = (),
    ) -> None:
        self.put((0, "TABLE"), (2, name), (5, handle), (330, "0"), (100, "AcDbSymbolTable"))
        self.put((70, len(records)), *more)
        for record in records:
            at = [code for code, _ in record].index(100)
            self.put(*record[:at], (330, handle), *record[at:])
        self.put((0, "ENDTAB"))

    def record(
        self,
        kind: str,
        subclass: str,
        name: str,
        data: list[tuple[int, object]],
        handle: str = "",
    ) -> list[tuple[int, object]]:
        return [
            (0, kind),
            (5, handle or self.handle()),
            (100, "AcDbSymbolTableRecord"),
            (100, f"AcDb{subclass}TableRecord"),
            (2, name),
            *data,
        ]

    def ltype(self, name: str) -> list[tuple[int, object]]:
        data: list[tuple[int, object]] = [(70, 0), (3, ""), (72, 65), (73, 0), (40, 0.0)]
        return self.record("LTYPE", "Linetype", name, data)

    def layer(self, name: str, index: int) -> list[tuple[int, object]]:
        data: list[tuple[int, object]] = [(70, 0), (62, index), (6, "Continuous")]
        return self.record("LAYER", "Layer", name, data)

    def style(self) -> list[tuple[int, object]]:
        data: list[tuple[int, object]] = [(70, 0), (40, 0.0), (41, 1.0), (50, 0.0), (71, 0)]
        data += [(42, 1.0), (3, "txt"), (4, "")]
        return self.record("STYLE", "TextStyle", "Standard", data)

    def blocks(self) -> None:
        for name, owner in self.owners.items():
            self.put((0, "BLOCK"), (5, self.handle()), (330, owner), (100, "AcDbEntity"))
            self.put((8, "0"), (100, "AcDbBlockBegin"), (2, name), (70, 0))
            self.put((10, 0.0), (20, 0.0), (30, 0.0), (3, name), (1, ""))
            for shape in self.sheet.blocks.get(name, ()):
                self.shape(shape, "0", owner)
            self.put((0, "ENDBLK"), (5, self.handle()), (330, owner), (100, "AcDbEntity"))
            self.put((8, "0"), (100, "AcDbBlockEnd"))

    def entities(self) -> None:
        for layer in self.sheet.layers:
            for shape in layer.shapes:
                self.shape(shape, layer.name, self.owners["*Model_Space"])

    def objects(self) -> None:
        root, group = "C", "D"
        self.put((0, "DICTIONARY"), (5, root), (330, "0"), (100, "AcDbDictionary"), (281, 1))
        self.put((3, "ACAD_GROUP"), (350, group))
        self.put((0, "DICTIONARY"), (5, group), (330, root), (100, "AcDbDictionary"), (281, 1))

    def shape(self, shape: Shape, layer: str, owner: str) -> None:
        kind, rows = _dxf_entity(shape)
        self.put((0, kind), (5, self.handle()), (330, owner), (100, "AcDbEntity"), (8, layer))
        self.put(*rows)


def _dxf_entity(shape: Shape) -> tuple[str, list[tuple[int, object]]]:
    """The kind of an entity, and its group codes after the layer."""
    match shape:
        case Line(start, end):
            return "LINE", [(100, "AcDbLine"), *_xyz(10, start), *_xyz(11, end)]
        case Circle(centre, radius):
            return "CIRCLE", [(100, "AcDbCircle"), *_xyz(10, centre), (40, radius)]
        case Arc(centre, radius, start, end):
            round_part = [(100, "AcDbCircle"), *_xyz(10, centre), (40, radius)]
            return "ARC", [*round_part, (100, "AcDbArc"), (50, start), (51, end)]
        case Ellipse(centre, longer, shorter, turn):
            angle = math.radians(turn)
            axis = (longer * math.cos(angle), longer * math.sin(angle))
            rows = [(100, "AcDbEllipse"), *_xyz(10, centre), *_xyz(11, axis)]
            return "ELLIPSE", [*rows, (40, shorter / longer), (41, 0.0), (42, 2.0 * math.pi)]
        case Polyline(vertices, closed):
            rows = [(100, "AcDbPolyline"), (90, len(vertices)), (70, int(closed))]
            for x, y, bulge in vertices:
                rows += [(10, float(x)), (20, float(y))] + ([(42, bulge)] if bulge else [])
            return "LWPOLYLINE", rows
        case Spline(control):
            pieces = (len(control) - 1) // 3
            knots = [0.0, *(float(k // 3) for k in range(3 * (pieces + 1))), float(pieces)]
            rows = [(100, "AcDbSpline"), (210, 0.0), (220, 0.0), (230, 1.0), (70, 8), (71, 3)]
            rows += [(72, len(knots)), (73, len(control)), (74, 0)]
            rows += [(40, knot) for knot in knots]
            return "SPLINE", rows + [row for point in control for row in _xyz(10, point)]
        case Insert(block, at, turn, (x, y)):
            rows = [(100, "AcDbBlockReference"), (2, block), *_xyz(10, at)]
            return "INSERT", [*rows, (41, x), (42, y), (43, 1.0), (50, turn)]


def _xyz(code: int, point: Point) -> list[tuple[int, object]]:
    return [(code, float(point[0])), (code + 10, float(point[1])), (code + 20, 0.0)]
