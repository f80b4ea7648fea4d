"""DXF drawings, ASCII and binary, of any version that ezdxf knows: what model space shows.

Blocks are placed by walking them with the map of each INSERT, so that arcs stay arcs wherever the
map lets them. Layers that are off or frozen and entities that are no lines are counted, with the
reason. An entity in a block on layer 0 or coloured BYBLOCK takes after the INSERT, as in CAD.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from camtool.errors import DrawingError
from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Drawing, Skipped, Units
from camtool.geometry.fit import Fit, overall
from camtool.importers.assemble import Piece, assemble
from camtool.importers.dxf_blocks import MAX_INSERTED, BlockSizes, block_key, matrix, places
from camtool.importers.dxf_load import load, printable, quiet
from camtool.importers.dxf_shapes import Frame, Unusable, can_read, require, shape_of
from camtool.importers.options import ReadOptions

MAX_NESTING = 50
"""Blocks within blocks, at most."""

REPAIRS_NAMED = 3
"""So many repairs are told in full."""

_MM_PER_INSUNIT = {
    1: ("in", 25.4),
    2: ("ft", 304.8),
    4: ("mm", 1.0),
    5: ("cm", 10.0),
    6: ("m", 1000.0),
    8: ("µin", 25.4e-6),
    9: ("mil", 0.0254),
    10: ("yd", 914.4),
    12: ("nm", 1e-6),
    13: ("µm", 1e-3),
    14: ("dm", 100.0),
    21: ("US ft", 1200.0 / 3.937),
    22: ("US in", 100.0 / 3.937),
    23: ("US yd", 3600.0 / 3.937),
}
"""$INSUNITS that a part may be drawn in (DXF reference, header variables)."""

_TEXT = "is text: turn it into lines first"
_NOTE = "is an annotation"
_SOLID = "is a 3D shape"
_PICTURE = "is a picture"
_AREA = "is a filled area without outline"

_WHY_UNUSED = {
    **dict.fromkeys(("TEXT", "MTEXT", "ATTRIB", "ATTDEF", "SHAPE", "RTEXT", "ARCTEXT"), _TEXT),
    **dict.fromkeys(
        ("DIMENSION", "ARC_DIMENSION", "LARGE_RADIAL_DIMENSION", "LEADER", "MLEADER"), _NOTE
    ),
    **dict.fromkeys(("MULTILEADER", "TOLERANCE", "ACAD_TABLE"), _NOTE),
    **dict.fromkeys(("3DSOLID", "BODY", "REGION", "SURFACE", "MESH", "3DFACE", "HELIX"), _SOLID),
    **dict.fromkeys(("IMAGE", "WIPEOUT", "OLE2FRAME", "OLEFRAME", "PDFUNDERLAY"), _PICTURE),
    **dict.fromkeys(("SOLID", "TRACE", "HATCH", "MPOLYGON"), _AREA),
    **dict.fromkeys(("XLINE", "RAY"), "has no end"),
    "POINT": "is a single point",
    "VIEWPORT": "is a window of a layout",
    "MLINE": "is a multiple line: explode it first",
}
_OTHER = "is of a kind that camtool does not read"

_FOREGROUND = "#000000"
_BYBLOCK, _BYLAYER, _WHITE = 0, 256, 7


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing in model space; DrawingError naming layer and entity when it cannot be read."""
    loaded = load(data, file)
    units, findings = _units(loaded.document, options)
    walk = _Walk(loaded.document, file, options.tolerance_mm)
    with quiet():
        walk.all(units.mm_per_unit)
    return assemble(
        walk.pieces,
        file=file,
        units=units,
        fit=overall(walk.fits),
        used=dict(walk.used),
        skipped=[Skipped(kind, count, why) for (kind, why), count in walk.skipped.items()],
        findings=[*_repaired(loaded.repairs), *findings],
        options=options,
    )


@dataclass(frozen=True)
class _Layer:
    """What a layer gives to its entities; `hidden` says why they are not shown ("" shown)."""

    colour: str
    hidden: str = ""
    frozen: bool = False


@dataclass(frozen=True, eq=False)
class _Scope:
    """What holds inside an INSERT; `blocks` on the way here, `within` for sources."""

    frame: Frame
    layer: str = "0"
    colour: str = _FOREGROUND
    blocks: tuple[str, ...] = ()
    within: str = ""


class _Walk:
    """Visits entities and collects pieces and counts."""

    def __init__(self, document: Any, file: str, tolerance_mm: float) -> None:
        self.document = document
        self.file = file
        self.tolerance_mm = tolerance_mm
        self.pieces: list[Piece] = []
        self.fits: list[Fit] = []
        self.used: Counter[str] = Counter()
        self.skipped: Counter[tuple[str, str]] = Counter()
        self._inserted = 0
        self._sizes = BlockSizes(document.blocks)
        self._layers = {block_key(layer.dxf.name): _layer(layer) for layer in document.layers}

    def all(self, mm_per_unit: float) -> None:
        """Model space; what other layouts hold is counted."""
        scope = _Scope(Frame(mm_per_unit * np.eye(3), np.zeros(3)))
        self._entities(self.document.modelspace(), scope)
        for layout in self.document.layouts:
            if not layout.is_modelspace:
                count = sum(entity.dxftype() != "VIEWPORT" for entity in layout)
                if count:
                    self.skipped["entity", "is in paper space"] += count

    def _entities(self, entities: Iterable[Any], scope: _Scope) -> None:
        for entity in entities:
            try:
                self._entity(entity, scope)
            except Unusable as reason:
                self.skipped[entity.dxftype(), printable(str(reason))] += 1
            except DrawingError as error:
                error.file = error.file or self.file
                error.where = error.where or f"layer {_name(entity, scope)}, {_source(entity)}"
                raise

    def _entity(self, entity: Any, scope: _Scope) -> None:
        kind, name = entity.dxftype(), _name(entity, scope)
        layer = self._layers.get(block_key(name), _Layer(_FOREGROUND))
        # An INSERT on a layer that is off still shows what its block has on other layers.
        if layer.hidden and (kind != "INSERT" or layer.frozen):
            raise Unusable(layer.hidden)
        if _said(entity.dxf, "invisible", 0):
            raise Unusable("is invisible")
        colour = _colour(entity.dxf, layer.colour, scope.colour)
        if kind == "INSERT":
            self._insert(entity, replace(scope, layer=name, colour=colour))
            return
        if not can_read(kind):
            raise Unusable(_WHY_UNUSED.get(kind, _OTHER))
        shape = shape_of(entity, scope.frame, self.tolerance_mm)
        source = _source(entity) + scope.within
        self.pieces.append(Piece(shape.vertices, shape.closed, name, colour, source))
        self.fits.extend(shape.fits)
        self.used[kind] += 1

    def _insert(self, insert: Any, scope: _Scope) -> None:
        """The block of an INSERT at each place of its array."""
        require(insert, ("name", "insert"))
        block = insert.block()
        name = block_key(insert.dxf.name)
        if block is None:
            raise Unusable(f"its block {insert.dxf.name} is missing")
        if block.block.is_xref or block.block.is_xref_overlay:
            raise Unusable("is a reference to another file")
        if name in scope.blocks or len(scope.blocks) >= MAX_NESTING:
            raise Unusable("its block holds itself, or blocks too deep")
        to_world = matrix(insert)
        self._count(insert, scope)
        self.used["INSERT"] += 1
        if insert.attribs:
            self.skipped["ATTRIB", _TEXT] += len(insert.attribs)
        inner = replace(
            scope,
            blocks=(*scope.blocks, name),
            within=scope.within or f" in {_source(insert)}",
        )
        for shift in places(insert):
            frame = scope.frame.placed(to_world[:3, :3], to_world[3, :3] + shift)
            self._entities(block, replace(inner, frame=frame))

    def _count(self, insert: Any, scope: _Scope) -> None:
        """DrawingError before the blocks of model space become too many."""
        if not scope.blocks:
            self._inserted += self._sizes.inserted(insert)
        if self._inserted > MAX_INSERTED:
            raise DrawingError(
                f"blocks repeat more than {MAX_INSERTED} entities",
                mend="explode what is needed, and delete the rest",
            )


def _units(document: Any, options: ReadOptions) -> tuple[Units, list[Finding]]:
    """The unit of the drawing, and a warning when the file does not say it."""
    code = document.header.get("$INSUNITS", None)
    metric = {0: "inches", 1: "metric"}.get(document.header.get("$MEASUREMENT", None), "nothing")
    said = "no $INSUNITS" if code is None else f"$INSUNITS {code}"
    if options.units is not None:
        unit = options.units.lower()
        return Units(unit, options.mm_per(unit), f"as asked; the file says {said}"), []
    if code in _MM_PER_INSUNIT:
        return Units(*_MM_PER_INSUNIT[code], said), []
    finding = Finding(
        Code.UNITLESS,
        Severity.WARNING,
        f"the file names no unit ({said}, $MEASUREMENT says {metric}): read as mm; if that is "
        "wrong, name the unit with --units",
    )
    return Units("mm", 1.0, f"taken as mm: {said}"), [finding]


def _repaired(repairs: tuple[str, ...]) -> list[Finding]:
    """One finding for all repairs, the first few in full."""
    if not repairs:
        return []
    more = len(repairs) - REPAIRS_NAMED
    text = "; ".join(" ".join(message.split()) for message in repairs[:REPAIRS_NAMED])
    tail = f"; and {more} more" if more > 0 else ""
    return [
        Finding(
            Code.FILE_REPAIRED,
            Severity.WARNING,
            f"the file is faulty and was repaired ({len(repairs)}): {text}{tail}",
            measured=float(len(repairs)),
        )
    ]


def _layer(layer: Any) -> _Layer:
    name, frozen = printable(layer.dxf.name), bool(layer.is_frozen())
    state = "frozen" if frozen else "off" if layer.is_off() else ""
    colour = _colour(layer.dxf, _FOREGROUND, _FOREGROUND)
    return _Layer(colour, f"layer {name} is {state}" if state else "", frozen)


def _colour(dxf: Any, by_layer: str, by_block: str) -> str:
    """ "#rrggbb"; the foreground (white on black screens) is black."""
    from ezdxf.colors import aci2rgb

    if dxf.hasattr("true_color"):
        return f"#{int(dxf.true_color) & 0xFFFFFF:06x}"
    index = abs(int(_said(dxf, "color", _BYLAYER)))
    if index == _BYBLOCK:
        return by_block
    if index >= _BYLAYER:
        return by_layer
    return _FOREGROUND if index == _WHITE else "#{:02x}{:02x}{:02x}".format(*aci2rgb(index))


def _name(entity: Any, scope: _Scope) -> str:
    """The layer that an entity is drawn on."""
    name = printable(str(_said(entity.dxf, "layer", "0")))
    return scope.layer if scope.blocks and name == "0" else name


def _said(dxf: Any, name: str, otherwise: Any) -> Any:
    """An attribute where the file says it; kinds that ezdxf does not know have none."""
    return dxf.get(name) if dxf.hasattr(name) else otherwise


def _source(entity: Any) -> str:
    return f"{entity.dxftype()} {entity.dxf.handle}"
