"""The walk through model space or a layout of a DXF document: pieces, marks and counts.

Blocks are placed by walking them with the map of each INSERT, so that arcs stay arcs wherever the
map lets them. All LINEs of one space or block are mapped at once: drawings have thousands.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from camtool.errors import DrawingError
from camtool.geometry.drawing import Mark
from camtool.importers.dxf.blocks import MAX_INSERTED, BlockSizes, block_key, matrix, places
from camtool.importers.dxf.frames import Frame, Shape, Unusable, numbers, require
from camtool.importers.dxf.kinds import (
    COMPOUNDS,
    DIMENSION_SKIPPED,
    DIMENSIONS,
    OTHER,
    READERS,
    TEXTS,
    WHY_UNUSED,
    parts_of,
    text_shapes,
)
from camtool.importers.dxf.load import printable
from camtool.importers.dxf.looks import Look, Looks
from camtool.importers.options import TEXT_SKIPPED, ReadOptions
from camtool.importers.piece import Piece

MAX_NESTING = 50
"""Blocks within blocks, at most."""

_NOWHERE = Piece(np.zeros((0, 3)), False, "", "", "")


@dataclass(frozen=True, eq=False)
class Scope:
    """What holds in a space or inside an INSERT: `blocks` on the way here, and the `look` of the
    INSERT; `within` ends sources, `source` (of a dimension and the like) stands for them."""

    frame: Frame
    look: Look | None = None
    blocks: tuple[str, ...] = ()
    within: str = ""
    source: str = ""


@dataclass(eq=False)
class Walk:
    """Visits entities and collects what they give."""

    document: Any
    file: str
    options: ReadOptions
    pieces: list[Piece] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    used: Counter[str] = field(default_factory=Counter)
    skipped: Counter[tuple[str, str]] = field(default_factory=Counter)
    lacking: Counter[tuple[str, str]] = field(default_factory=Counter)
    fonts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        self._inserted = 0
        self._visited = 0
        self._sizes = BlockSizes(self.document.blocks)
        self._looks = Looks.of(self.document)

    def space(self, space: Any, mm_per_unit: float) -> None:
        """All entities of a space; what other layouts hold is counted."""
        self._entities(space, Scope(Frame(mm_per_unit * np.eye(3), np.zeros(3))))
        self.pieces = [piece for piece in self.pieces if piece is not _NOWHERE]
        for layout in self.document.layouts:
            if layout.layout_key != space.layout_key:
                count = sum(entity.dxftype() != "VIEWPORT" for entity in layout)
                if count:
                    where = "model space" if layout.is_modelspace else "paper space"
                    self.skipped["entity", f"is in {where}"] += count

    def _entities(self, entities: Iterable[Any], scope: Scope) -> None:
        lines: list[tuple[int, Any, Look]] = []
        for entity in entities:
            kind, said = entity.dxftype(), vars(entity.dxf)
            look = self._looks.of_entity(said, scope.look)
            try:
                if scope.blocks:
                    self._visit()
                self._check_shown(kind, said, look)
                if kind == "LINE":
                    require(entity, ("start", "end"))
                    lines.append((len(self.pieces), entity, look))
                    self.pieces.append(_NOWHERE)
                else:
                    self._entity(entity, scope, look)
            except Unusable as reason:
                self._skip(kind, reason)
            except DrawingError as error:
                raise self._placed(error, entity, look) from error
        if lines:
            self._lines(lines, scope)

    def _check_shown(self, kind: str, said: dict[str, Any], look: Look) -> None:
        """Unusable when the entity does not show."""
        # An INSERT on a layer that is off still shows what its block has on other layers.
        if look.hidden and (kind != "INSERT" or look.frozen):
            raise Unusable(look.hidden)
        if said.get("invisible"):
            raise Unusable("is invisible")

    def _entity(self, entity: Any, scope: Scope, look: Look) -> None:
        """Any entity but a LINE."""
        kind = entity.dxftype()
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

    def _lines(self, lines: list[tuple[int, Any, Look]], scope: Scope) -> None:
        """All LINEs of a scope, each into the place that was kept for it."""
        ends = [(*entity.dxf.start, *entity.dxf.end) for _, entity, _ in lines]
        points = np.array(ends, dtype=np.float64).reshape(-1, 2, 3)
        finite = np.isfinite(points).all(axis=(1, 2))
        if not finite.all():
            row = int(np.argmin(finite))
            error = DrawingError(
                "has a coordinate that is not a finite number", mend="delete it or draw it again"
            )
            raise self._placed(error, *lines[row][1:])
        flat, is_flat = scope.frame.flat_each(points)
        vertices = np.zeros((len(lines), 2, 3))
        vertices[:, :, :2] = flat
        for rows, usable, (place, entity, look) in zip(
            vertices, is_flat.tolist(), lines, strict=True
        ):
            if usable:
                source = scope.source or f"LINE {entity.dxf.handle}{scope.within}"
                self.pieces[place] = Piece(
                    rows, False, look.layer, look.colour, source, look.line_type
                )
            else:
                self._skip("LINE", Unusable("is not flat"))
        if is_flat.any() and not scope.source:
            self.used["LINE"] += int(is_flat.sum())

    def _take(self, shapes: Iterable[Shape], entity: Any, scope: Scope, look: Look) -> None:
        """The paths of an entity."""
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

    def _point(self, entity: Any, scope: Scope, look: Look) -> None:
        """A POINT, wherever high."""
        require(entity, ("location",))
        place = numbers(entity.dxf.location) @ scope.frame.linear + scope.frame.offset
        at_mm = float(place[0]), float(place[1])
        source = _source(entity, scope)
        self.marks.append(Mark(at_mm, look.layer, look.colour, source, look.line_type))
        self._use(entity, scope)

    def _text(self, entity: Any, scope: Scope, look: Look) -> None:
        """Text, when it is wanted; the template of an attribute shows only outside of blocks."""
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

    def _parts(self, entity: Any, scope: Scope, look: Look) -> None:
        """What a dimension, a multiple line or a proxy is drawn with."""
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

    def _insert(self, insert: Any, scope: Scope, look: Look) -> None:
        """The block of an INSERT at each place of its array, and its attributes."""
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
        for shift in places(insert):
            frame = scope.frame.placed(to_world[:3, :3], to_world[3, :3] + shift)
            self._entities(block, replace(inner, frame=frame))
        self._entities(insert.attribs, scope)

    def _count(self, insert: Any, scope: Scope) -> None:
        """DrawingError before the blocks of a space become too many."""
        if not scope.blocks:
            self._inserted += self._sizes.inserted(insert)
        if self._inserted > MAX_INSERTED:
            raise _too_many()

    def _visit(self) -> None:
        """The same for what the sizes of blocks do not tell: blocks of dimensions."""
        self._visited += 1
        if self._visited > MAX_INSERTED:
            raise _too_many()

    def _use(self, entity: Any, scope: Scope) -> None:
        if not scope.source:
            self.used[entity.dxftype()] += 1

    def _skip(self, kind: str, reason: Unusable) -> None:
        self.skipped[kind, printable(str(reason))] += 1

    def _placed(self, error: DrawingError, entity: Any, look: Look) -> DrawingError:
        """The error with file and place."""
        error.file = error.file or self.file
        error.where = error.where or f"layer {look.layer}, {_source(entity, None)}"
        return error


def _check_nesting(name: str, scope: Scope) -> None:
    """Unusable for a block that holds itself."""
    if name in scope.blocks or len(scope.blocks) >= MAX_NESTING:
        raise Unusable("its block holds itself, or blocks too deep")


def _too_many() -> DrawingError:
    return DrawingError(
        f"blocks repeat more than {MAX_INSERTED} entities",
        mend="explode what is needed, and delete the rest",
    )


def _source(entity: Any, scope: Scope | None) -> str:
    if scope is not None and scope.source:
        return scope.source
    return f"{entity.dxftype()} {entity.dxf.handle}{scope.within if scope is not None else ''}"
