"""The walk through model space or a layout of a DXF document: pieces, marks and counts.

Blocks are placed by walking them with the map of each INSERT, so that arcs stay arcs wherever the
map lets them. All LINEs of one space or block are mapped at once: drawings have thousands."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any

import msgspec
import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.errors import DrawingError
from camtool.geometry.drawing import Callout, Mark
from camtool.importers.dxf.bulk import BulkLines
from camtool.importers.dxf.load import Loaded, printable
from camtool.importers.dxf.shapes import (
    DxfShape,
    Reader,
    WorldMap,
    arc,
    circle,
    ellipse,
    face,
    hatch,
    line,
    lwpolyline,
    numbers,
    outline,
    polyline,
    require,
    solid,
    spline,
)
from camtool.importers.options import TEXT_SKIPPED, ReadOptions
from camtool.importers.pieces import Piece, Unusable
from camtool.records import replace

MAX_NESTING = 50

_NOWHERE = Piece(np.zeros((0, 3)), False, "", "", "")
_NO_LINES = BulkLines([], np.zeros((0, 2, 3)))

CALLOUTS = frozenset(("DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION"))
"""Kinds of entities that are read as dimensions (callouts)."""


class DxfScope(Struct, frozen=True, eq=False):
    """The context of entities in a space or inside an INSERT.

    `frame` maps to mm, `look` is that of the INSERT, `blocks` are the names of those around.
    `within` is added to the source of each path; `source`, that of a dimension and the like,
    replaces the sources of its parts."""

    frame: WorldMap
    look: DxfLook | None = None
    blocks: tuple[str, ...] = ()
    within: str = ""
    source: str = ""


class DxfWalk:
    """The walk through a space: reads its entities, and collects pieces, marks, callouts, and
    counts of what was left out."""

    def __init__(self, loaded: Loaded, file: str, options: ReadOptions) -> None:
        self.loaded, self.file, self.options = loaded, file, options
        self.pieces: list[Piece] = []
        self.marks: list[Mark] = []
        self.callouts: list[Callout] = []
        self.unread: Counter[tuple[str, str]] = Counter()
        self.used: Counter[str] = Counter()
        self.skipped: Counter[tuple[str, str]] = Counter()
        self.lacking: Counter[tuple[str, str]] = Counter()
        self.fonts: Counter[str] = Counter()
        self._inserted = 0
        self._visited = 0
        self._mm_per_unit = 1.0
        self._sizes = BlockSizes(self.loaded.document.blocks)
        self._looks = DxfLooks.of(self.loaded.document)

    def space(self, space: Any, mm_per_unit: float) -> None:
        """Read all entities of model space or a layout; count the entities of the others as
        skipped."""
        self._mm_per_unit = mm_per_unit
        self._entities(space, DxfScope(WorldMap(mm_per_unit * np.eye(3), np.zeros(3))))
        self.pieces = [piece for piece in self.pieces if piece is not _NOWHERE]
        for layout in self.loaded.document.layouts:
            if layout.layout_key != space.layout_key:
                shown = (entity for entity in layout if entity.dxftype() != "VIEWPORT")
                count = sum(map(self._count_with, shown))
                if count:
                    where = "model space" if layout.is_modelspace else "paper space"
                    self.skipped["entity", f"is in {where}"] += count

    def _entities(self, entities: Iterable[Any], scope: DxfScope) -> None:
        lines: list[tuple[int, Any, DxfLook]] = []
        for entity in entities:
            kind, attributes = entity.dxftype(), vars(entity.dxf)
            look = self._looks.of_entity(attributes, scope.look)
            try:
                if scope.blocks:
                    self._visit()
                self._check_shown(kind, attributes, look)
                if kind == "LINE":
                    require(entity, ("start", "end"))
                    lines.append((len(self.pieces), entity, look))
                    self.pieces.extend([_NOWHERE] * self._count_with(entity))
                else:
                    self._entity(entity, scope, look)
            except Unusable as reason:
                self._skip(kind, reason, self._count_with(entity))
            except DrawingError as error:
                raise self._placed(error, entity, look) from error
        if lines:
            self._lines(lines, scope)

    def _check_shown(self, kind: str, attributes: dict[str, Any], look: DxfLook) -> None:
        """Raise Unusable if the entity is invisible or on a layer that is off or frozen."""
        # An INSERT on a layer that is off still shows what its block has on other layers.
        if look.hidden and (kind != "INSERT" or look.frozen):
            raise Unusable(look.hidden)
        if attributes.get("invisible"):
            raise Unusable("is invisible")

    def _entity(self, entity: Any, scope: DxfScope, look: DxfLook) -> None:
        """Read an entity of any kind but LINE; Unusable, with the reason, if it cannot be cut."""
        kind = entity.dxftype()
        if kind in CALLOUTS and not scope.source:
            self._callout(entity, scope, look)
        if kind == "INSERT":
            self._insert(entity, scope, look)
        elif kind in READERS:
            shapes = READERS[kind](entity, scope.frame, self.options.tolerance_mm)
            self._take(shapes, entity, scope, look)
        elif kind == "POINT":
            self._point(entity, scope, look)
        elif kind in TEXTS:
            self._text(entity, scope, look)
        elif kind in COMPOUNDS or (kind in DIMENSIONS and self.options.dimensions):
            self._parts(entity, scope, look)
        elif kind in DIMENSIONS:
            raise Unusable(DIMENSION_SKIPPED)
        else:
            raise Unusable(WHY_UNUSED.get(kind, OTHER))

    def _following(self, entity: Any) -> BulkLines:
        """Return the LINEs after this one in the file, which were read in bulk, without ezdxf."""
        return self.loaded.lines.get(entity.dxf.handle, _NO_LINES)

    def _count_with(self, entity: Any) -> int:
        """Return the number of LINEs that the entity stands for: itself and those read in bulk
        after it."""
        return 1 + len(self._following(entity).handles)

    def _lines(self, lines: list[tuple[int, Any, DxfLook]], scope: DxfScope) -> None:
        """Make the pieces of all LINEs of a scope, in the places reserved for them, to keep the
        order of the file.

        `lines` are the index of the first reserved piece, the entity and its look."""
        following = [self._following(entity) for _, entity, _ in lines]
        counts = np.array([1 + len(bulk.handles) for bulk in following])
        first = np.cumsum(counts) - counts
        is_first = np.zeros(counts.sum(), dtype=np.bool_)
        is_first[first] = True
        points = np.empty((len(is_first), 2, 3))
        ends = [(*entity.dxf.start, *entity.dxf.end) for _, entity, _ in lines]
        points[is_first] = np.array(ends, dtype=np.float64).reshape(-1, 2, 3)
        points[~is_first] = np.concatenate(
            [_NO_LINES.ends, *(bulk.ends for bulk in following if bulk.handles)]
        )
        finite = np.isfinite(points).all(axis=(1, 2))
        if not finite.all():
            bad_row = int(np.argmin(finite))
            line = int(np.searchsorted(first, bad_row, side="right")) - 1
            _, entity, look = lines[line]
            handle = (entity.dxf.handle, *following[line].handles)[bad_row - int(first[line])]
            raise DrawingError(
                "has a coordinate that is not a finite number",
                file=self.file,
                where=f"layer {look.layer}, LINE {handle}",
                mend="delete it or draw it again",
            )
        flat, is_flat = scope.frame.flat_each(points)
        vertices = np.zeros((len(points), 2, 3))
        vertices[:, :, :2] = flat
        rows = iter(zip(vertices, is_flat.tolist(), strict=True))
        for (place, entity, look), bulk in zip(lines, following, strict=True):
            for k, handle in enumerate((entity.dxf.handle, *bulk.handles)):
                row, usable = next(rows)
                if usable:
                    source = scope.source or f"LINE {handle}{scope.within}"
                    self.pieces[place + k] = Piece(
                        row, False, look.layer, look.colour, source, look.line_type
                    )
                else:
                    self._skip("LINE", Unusable("is not flat"))
        if is_flat.any() and not scope.source:
            self.used["LINE"] += int(is_flat.sum())

    def _take(
        self, shapes: Iterable[DxfShape], entity: Any, scope: DxfScope, look: DxfLook
    ) -> None:
        """Add these shapes of an entity to the pieces, and count the entity as used."""
        source = _source(entity, scope)
        for shape in shapes:
            self.pieces.append(
                Piece(
                    shape.vertices,
                    shape.closed,
                    look.layer,
                    look.colour,
                    source,
                    look.line_type,
                    shape.off_mm,
                )
            )
            if shape.lacks:
                self.lacking[entity.dxftype(), shape.lacks] += 1
        self._use(entity, scope)

    def _point(self, entity: Any, scope: DxfScope, look: DxfLook) -> None:
        """Add a POINT to the marks, at any height."""
        require(entity, ("location",))
        place = numbers(entity.dxf.location) @ scope.frame.linear + scope.frame.offset
        at_mm = float(place[0]), float(place[1])
        source = _source(entity, scope)
        self.marks.append(Mark(at_mm, look.layer, look.colour, source, look.line_type))
        self._use(entity, scope)

    def _text(self, entity: Any, scope: DxfScope, look: DxfLook) -> None:
        """Add a text to the pieces if text is wanted; the template of an attribute (ATTDEF) shows
        only outside of blocks."""
        kind = entity.dxftype()
        if kind == "ATTDEF" and scope.blocks and not entity.is_const:
            raise Unusable("is the template of an attribute")
        if self.options.text == "skip":
            raise Unusable(TEXT_SKIPPED)
        options = self.options
        shapes, lacks = text_shapes(entity, scope.frame, options.tolerance_mm, options.text)
        self._take(shapes, entity, scope, look)
        if lacks:
            self.fonts[lacks] += 1

    def _callout(self, entity: Any, scope: DxfScope, look: DxfLook) -> None:
        """Add a dimension with its limits to the callouts, also if its lines are not read as
        pieces."""
        from camtool.importers.dxf.dimensions import callout

        source, paper = _source(entity, scope), self.options.layout is not None
        unit_mm = self._mm_per_unit
        try:
            measured = callout(
                entity, scope.frame, unit_mm, layer=look.layer, source=source, paper=paper
            )
        except Unusable as reason:
            self.unread[entity.dxftype(), printable(str(reason))] += 1
        else:
            self.callouts.append(measured)

    def _parts(self, entity: Any, scope: DxfScope, look: DxfLook) -> None:
        """Read the entities that draw a dimension, a multiple line or a proxy."""
        # A dimension is drawn by a block of its own, which may hold it again.
        drawn = vars(entity.dxf).get("geometry")
        name = block_key(drawn or f"{entity.dxftype()} {entity.dxf.handle}")
        _check_nesting(name, scope)
        parts = parts_of(entity)
        self._use(entity, scope)
        inner = replace(
            scope, look=look, blocks=(*scope.blocks, name), source=_source(entity, scope)
        )
        self._entities(parts, inner)

    def _insert(self, insert: Any, scope: DxfScope, look: DxfLook) -> None:
        """Read the block of an INSERT at each place of its array, and the attributes of the
        INSERT."""
        require(insert, ("name", "insert"))
        block = insert.block()
        name = block_key(insert.dxf.name)
        if block is None:
            raise Unusable(f"its block {insert.dxf.name} is missing")
        if block.block.is_xref or block.block.is_xref_overlay:
            raise Unusable("is a reference to another file")
        _check_nesting(name, scope)
        to_world = matrix(insert)
        self._count(insert, scope)
        self._use(insert, scope)
        inner = replace(
            scope,
            look=look,
            blocks=(*scope.blocks, name),
            within=scope.within or f" in {_source(insert, scope)}",
        )
        for shift in member_shifts(insert):
            frame = scope.frame.placed(to_world[:3, :3], to_world[3, :3] + shift)
            self._entities(block, replace(inner, frame=frame))
        self._entities(insert.attribs, scope)

    def _count(self, insert: Any, scope: DxfScope) -> None:
        """Raise DrawingError if the INSERTs of a space stand for more than MAX_INSERTED
        entities."""
        if not scope.blocks:
            self._inserted += self._sizes.inserted(insert)
        if self._inserted > MAX_INSERTED:
            raise _too_many()

    def _visit(self) -> None:
        """Raise DrawingError if more than MAX_INSERTED entities within blocks are visited.

        Blocks of dimensions have no INSERT, so that `_count` does not bound them."""
        self._visited += 1
        if self._visited > MAX_INSERTED:
            raise _too_many()

    def _use(self, entity: Any, scope: DxfScope) -> None:
        if not scope.source:
            self.used[entity.dxftype()] += 1

    def _skip(self, kind: str, reason: Unusable, count: int = 1) -> None:
        self.skipped[kind, printable(str(reason))] += count

    def _placed(self, error: DrawingError, entity: Any, look: DxfLook) -> DrawingError:
        """Return the same error with the file, layer and entity set."""
        error.file = error.file or self.file
        error.where = error.where or f"layer {look.layer}, {_source(entity, None)}"
        return error


def _check_nesting(name: str, scope: DxfScope) -> None:
    """Raise Unusable for a block that contains itself, or is nested too deep."""
    if name in scope.blocks or len(scope.blocks) >= MAX_NESTING:
        raise Unusable("its block holds itself, or blocks too deep")


def _too_many() -> DrawingError:
    return DrawingError(
        f"blocks repeat more than {MAX_INSERTED} entities",
        mend="explode what is needed, and delete the rest",
    )


def _source(entity: Any, scope: DxfScope | None) -> str:
    if scope is not None and scope.source:
        return scope.source
    return f"{entity.dxftype()} {entity.dxf.handle}{scope.within if scope is not None else ''}"


# The treatment of each kind of entity: its reader, the parts that it is drawn with, or the reason
# why it is not used.

READERS: dict[str, Reader] = {
    "3DFACE": face,
    "ARC": arc,
    "CIRCLE": circle,
    "ELLIPSE": ellipse,
    "HATCH": hatch,
    "HELIX": spline,
    "LINE": line,
    "LWPOLYLINE": lwpolyline,
    "MPOLYGON": hatch,
    "POLYLINE": polyline,
    "SOLID": solid,
    "SPLINE": spline,
    "TRACE": solid,
}
"""Kinds that have a shape of their own."""

TEXTS = frozenset(("TEXT", "MTEXT", "ATTRIB", "ATTDEF"))
"""Kinds of text; the option `text` says how they are read."""

DIMENSIONS = frozenset(
    (
        "DIMENSION",
        "ARC_DIMENSION",
        "LARGE_RADIAL_DIMENSION",
        "LEADER",
        "MLEADER",
        "MULTILEADER",
        "ACAD_TABLE",
    )
)
"""Kinds of annotations; read if the option `dimensions` is set."""

COMPOUNDS = frozenset(("MLINE", "ACAD_PROXY_ENTITY"))
"""Kinds that are read as the parts with which they are drawn."""

DIMENSION_SKIPPED = "is an annotation: read its lines with --dimensions"

_SOLID = "is a 3D shape: export it as STEP"
_PICTURE = "is a picture"
_TEXT = "is text of a kind that camtool does not read: explode it first"
_ENDLESS = "has no end"

WHY_UNUSED = {
    **dict.fromkeys(("SHAPE", "RTEXT", "ARCTEXT"), _TEXT),
    **dict.fromkeys(("3DSOLID", "BODY", "REGION", "MESH"), _SOLID),
    **dict.fromkeys(("SURFACE", "EXTRUDEDSURFACE", "LOFTEDSURFACE"), _SOLID),
    **dict.fromkeys(("PLANESURFACE", "REVOLVEDSURFACE", "SWEPTSURFACE", "NURBSURFACE"), _SOLID),
    **dict.fromkeys(("IMAGE", "WIPEOUT", "OLE2FRAME", "OLEFRAME"), _PICTURE),
    **dict.fromkeys(("PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "PDFREFERENCE"), _PICTURE),
    **dict.fromkeys(("XLINE", "RAY"), _ENDLESS),
    "TOLERANCE": "is an annotation",
    "VIEWPORT": "is a window of a layout",
    "LIGHT": "is a light",
    "SUN": "is a light",
}
OTHER = "is of a kind that camtool does not read"

MAX_PARTS = 10_000


def parts_of(entity: Any) -> list[Any]:
    """Return the entities with which a dimension, leader, multiple line or proxy is drawn.

    Unusable when there are none. The points that define a dimension are left out, and so is the
    filling between multiple lines."""
    left_out = {"POINT", "HATCH"} if entity.dxftype() == "MLINE" else {"POINT"}
    parts: list[Any] = []
    try:
        for part in _virtual(entity):
            if part.dxftype() not in left_out:
                parts.append(part)
            if len(parts) > MAX_PARTS:
                break
    # ezdxf draws these from unchecked data, and may raise anything.
    except Exception as error:
        raise Unusable("cannot be drawn: its data is damaged") from error
    if len(parts) > MAX_PARTS:
        raise Unusable(f"is drawn with more than {MAX_PARTS} parts")
    if not parts:
        raise Unusable("brings no lines with it")
    return parts


def _virtual(entity: Any) -> Iterable[Any]:
    if hasattr(entity, "virtual_entities"):
        entities: Iterable[Any] = entity.virtual_entities()
        return entities
    if hasattr(entity, "__virtual_entities__"):
        return list(entity.__virtual_entities__())
    return ()


def text_shapes(
    entity: Any, frame: WorldMap, tolerance_mm: float, mode: str
) -> tuple[list[DxfShape], str]:
    """Return the outlines of a text in mm, and a description of fonts or characters that are
    missing, else ""."""
    from camtool.importers.dxf.text import text_strokes

    text = text_strokes(entity, mode)
    shapes = [
        outline(contour.parts, contour.closed, frame, tolerance_mm)
        for contour in text.contours
        if contour.parts
    ]
    return shapes, text.lacks


# The places of blocks, and the number of entities that they amount to.
#
# They are counted first, from the sizes of the blocks alone: nested arrays can describe more
# entities in a kilobyte than fit into memory.

MAX_INSERTED = 100_000


class BlockSizes:
    """The number of entities in each block; nested blocks are counted in full."""

    def __init__(self, blocks: Any) -> None:
        self._blocks = blocks
        self._sizes: dict[str, int] = {}

    def inserted(self, insert: Any) -> int:
        """Return the number of entities that an INSERT stands for, itself included; 1 if its block
        is missing."""
        if not insert.dxf.hasattr("name"):
            return 1
        name = block_key(insert.dxf.name)
        if name not in self._sizes:
            self._sizes[name] = 0  # for a block that contains itself
            block = self._blocks.get(insert.dxf.name)
            self._sizes[name] = sum(
                self.inserted(entity) if entity.dxftype() == "INSERT" else 1
                for entity in block or ()
            )
        columns, rows = _array(insert)
        return columns * rows * (1 + self._sizes[name])


def matrix(insert: Any) -> Floats:
    """Return the matrix (4, 4), for row vectors, that places the entities of a block where its
    INSERT stands.

    DrawingError for numbers that are not finite, Unusable for an extrusion of 0."""
    dxf = insert.dxf
    numbers = (*dxf.insert, *dxf.extrusion, dxf.rotation)
    spacing, scales = (dxf.column_spacing, dxf.row_spacing), (dxf.xscale, dxf.yscale, dxf.zscale)
    if not np.isfinite([*numbers, *spacing, *scales]).all():
        raise DrawingError(
            "has a number that is not finite", mend="delete it or insert the block again"
        )
    if not any(dxf.extrusion):
        raise Unusable("has an extrusion of 0")
    return np.array(tuple(insert.matrix44())).reshape(4, 4)


def member_shifts(insert: Any) -> Iterator[Floats]:
    """Yield for each member of an INSERT's array its shift (3,) from the first one, in world
    units.

    The array turns with the INSERT, but its spacing is not scaled."""
    columns, rows = _array(insert)
    dxf, ocs = insert.dxf, insert.ocs()
    turn = np.radians(dxf.rotation)
    along = np.array([np.cos(turn), np.sin(turn), 0.0]) * dxf.column_spacing
    across = np.array([-np.sin(turn), np.cos(turn), 0.0]) * dxf.row_spacing
    for row, column in product(range(rows), range(columns)):
        yield np.array(tuple(ocs.to_wcs(tuple(column * along + row * across))))


def block_key(name: Any) -> str:
    """Return the name of a block or layer in lower case: DXF compares names without regard to
    case."""
    return str(name).casefold()


def _array(insert: Any) -> tuple[int, int]:
    """Return the numbers of columns and rows of an INSERT's array; without spacing it has one
    column or row."""
    columns = max(int(insert.dxf.column_count), 1) if insert.dxf.column_spacing else 1
    rows = max(int(insert.dxf.row_count), 1) if insert.dxf.row_spacing else 1
    return columns, rows


# Layer, colour and line type of DXF entities, with BYLAYER and BYBLOCK resolved.
#
# An entity in a block that lies on layer 0, or is coloured or dashed BYBLOCK, takes after the
# INSERT, as in CAD.

FOREGROUND = "#000000"
"""Colour 7 is white on a black screen and black on paper: black here."""

CONTINUOUS = "Continuous"

_BYBLOCK, _BYLAYER = 0, 256
_BASIC_COLOURS = ("", "#ff0000", "#ffff00", "#00ff00", "#00ffff", "#0000ff", "#ff00ff", FOREGROUND)
"""Colours of the indices from 1 to 7."""


class DxfLook(Struct, frozen=True):
    """Layer, colour and line type of an entity; `hidden` says why it is not shown ("" if it is).

    `frozen`: an INSERT on its layer shows nothing at all; on one that is merely off it still
    shows what its block has on other layers."""

    layer: str = "0"
    colour: str = FOREGROUND
    line_type: str = CONTINUOUS
    hidden: str = ""
    frozen: bool = False


class DxfLooks(Struct):
    """The looks of the entities of a document, resolved from their attributes and the table of
    layers."""

    layers: dict[str, DxfLook]
    _known: dict[tuple[Any, ...], DxfLook] = msgspec.field(default_factory=dict)

    @classmethod
    def of(cls, document: Any) -> DxfLooks:
        """Return the looks of a document, with the layers of its table."""
        return cls({block_key(layer.dxf.name): _layer(layer) for layer in document.layers})

    def of_entity(self, attributes: dict[str, Any], block: DxfLook | None) -> DxfLook:
        """Return the look of an entity with these attributes; `block` is the look of the INSERT
        around it, if any."""
        attribute_key = tuple(
            attributes.get(name) for name in ("layer", "color", "true_color", "linetype")
        )
        key = (*attribute_key, block)
        look = self._known.get(key)
        if look is None:
            look = self._known[key] = self._resolved(
                attributes, block or DxfLook(), block is not None
            )
        return look

    def _resolved(self, fields: dict[str, Any], block: DxfLook, inside: bool) -> DxfLook:
        name = printable(str(fields.get("layer") or "0"))
        if inside and name == "0":
            name = block.layer
        layer_look = self.layers.get(block_key(name), DxfLook(name))
        line_type = printable(str(fields.get("linetype") or "BYLAYER"))
        inherited = {"BYLAYER": layer_look.line_type, "BYBLOCK": block.line_type}
        return DxfLook(
            layer_look.layer,
            _colour(
                fields.get("color"), fields.get("true_color"), layer_look.colour, block.colour
            ),
            inherited.get(line_type.upper(), line_type),
            layer_look.hidden,
            layer_look.frozen,
        )


def _layer(layer: Any) -> DxfLook:
    """Return the look that a layer gives to its entities: its colour and line type, and the reason
    if it is off or frozen."""
    attributes = vars(layer.dxf)
    name, frozen = printable(str(layer.dxf.name)), bool(layer.is_frozen())
    state = "frozen" if frozen else "off" if layer.is_off() else ""
    return DxfLook(
        name,
        _colour(attributes.get("color"), attributes.get("true_color"), FOREGROUND, FOREGROUND),
        printable(str(attributes.get("linetype", CONTINUOUS))),
        f"layer {name} is {state}" if state else "",
        frozen,
    )


def _colour(index: Any, true: Any, by_layer: str, by_block: str) -> str:
    """Return "#rrggbb" of a colour index or a true colour; BYLAYER and BYBLOCK give the colours
    passed for them."""
    if true is not None:
        return f"#{int(true) & 0xFFFFFF:06x}"
    number = _BYLAYER if index is None else abs(int(index))
    if number == _BYBLOCK:
        return by_block
    if number >= _BYLAYER:
        return by_layer
    if number < len(_BASIC_COLOURS):
        return _BASIC_COLOURS[number]
    from ezdxf.colors import aci2rgb

    return "#{:02x}{:02x}{:02x}".format(*aci2rgb(number))
