"""Read a drawing of lines, arcs and curves without ezdxf, whose import takes 0.2 s.

`plain_document` returns what `DxfWalk` asks of ezdxf's document: the layers, and model space with
its entities and their attributes by ezdxf's names. It returns None where there is more to know:
blocks in use, texts, paper space, damaged numbers. ezdxf reads such files, and mends them."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Iterator
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, ClassVar

import numpy as np

from camtool.importers.dxf.bulk import Bulk
from camtool.importers.dxf.tags import DxfSections, Tags

_VERSIONS = frozenset(("AC1009", "AC1012", "AC1014", "AC1015", "AC1018")) | frozenset(
    ("AC1021", "AC1024", "AC1027", "AC1032")
)
_FORBIDDEN_IN_NAMES = re.compile(r'[<>/\\":;?*=`]')
_HANDLE = re.compile(r"0*[1-9A-Fa-f][0-9A-Fa-f]{0,15}")
_SPACES = re.compile(r"[*$](model|paper)_space", re.IGNORECASE)
_MAX_COLOUR = 257
_NAME, _ELEVATION, _PAPER, _EMBEDDED = 2, 38, 67, 101

_COMMON = {5: "handle", 6: "linetype", 8: "layer", 60: "invisible", 62: "color", 420: "true_color"}
_ROUND = {10: "center", 40: "radius", 210: "extrusion"}
_ELLIPSE = {10: "center", 11: "major_axis", 40: "ratio", 41: "start_param", 42: "end_param"}
_ATTRIBUTES = {
    "LINE": {10: "start", 11: "end"},
    "CIRCLE": _ROUND,
    "ARC": {**_ROUND, 50: "start_angle", 51: "end_angle"},
    "ELLIPSE": {**_ELLIPSE, 210: "extrusion"},
    "POINT": {10: "location"},
    "LWPOLYLINE": {_ELEVATION: "elevation", 43: "const_width", 70: "flags", 210: "extrusion"},
    "SPLINE": {12: "start_tangent", 13: "end_tangent", 70: "flags", 71: "degree"},
    "LAYER": {_NAME: "name", 70: "flags"},
}
"""The kinds that are read here, and the names of their attributes by group code."""

_LISTS = {"LWPOLYLINE": (10, 40, 41, 42), "SPLINE": (10, 11, 40, 41)}
"""The group codes that a kind repeats."""

_POINTS = frozenset((10, 11, 12, 13, 210))
_TEXTS = frozenset((_NAME, 5, 6, 8))
_INTEGERS = frozenset((60, 62, 70, 71, 420))


class _Attributes(SimpleNamespace):
    """Attributes by name, with the defaults of the DXF reference."""

    extrusion: ClassVar[Any] = (0.0, 0.0, 1.0)
    start_param: ClassVar[Any] = 0.0
    end_param: ClassVar[Any] = math.tau
    ratio: ClassVar[Any] = 1.0
    degree: ClassVar[Any] = 3
    flags: ClassVar[Any] = 0

    def hasattr(self, name: str) -> bool:
        """Return True if the file gives this attribute."""
        return name in vars(self)

    def get(self, name: str, default: Any = None) -> Any:
        """Return the value that the file gives for this attribute, else `default`."""
        return vars(self).get(name, default)


class _Entity(SimpleNamespace):
    """An entity or a layer of a `kind`, with its attributes `dxf` and lists of numbers such as
    vertices, under ezdxf's names."""

    def dxftype(self) -> str:
        """Return the kind of the entity, such as "LINE"."""
        return str(self.kind)

    @property
    def closed(self) -> bool:
        """True if the entity is closed (flag 1)."""
        return bool(self.dxf.flags & 1)

    def is_frozen(self) -> bool:
        """Return True if the layer is frozen (flag 1)."""
        return bool(self.dxf.flags & 1)

    def is_off(self) -> bool:
        """Return True if the layer is off: its colour is negative."""
        return int(self.dxf.get("color", 0)) < 0


class PlainDocument:
    """Layers and entities; it is its own model space, and has no other layout."""

    blocks: ClassVar[dict[str, Any]] = {}
    layout_key = ""

    def __init__(self, layers: list[_Entity], entities: list[_Entity]) -> None:
        self.layers, self.layouts = layers, (self,)
        self.entitydb = {entity.dxf.handle: entity for entity in entities}

    def __iter__(self) -> Iterator[_Entity]:
        return iter(self.entitydb.values())

    def modelspace(self) -> PlainDocument:
        """Return the document itself, which is its own model space."""
        return self


def plain_document(tags: Tags, frame: DxfSections, bulk: Bulk) -> PlainDocument | None:
    """Return the document made of the tags that were not read in bulk; None for a file that must
    be left to ezdxf."""
    if not tags.is_text or frame.eof is None or frame.faults:
        return None
    try:
        return _document(tags, frame, bulk)
    except (ValueError, IndexError):
        return None


def _document(tags: Tags, frame: DxfSections, bulk: Bulk) -> PlainDocument:
    """Return the document; ValueError for a file that must be left to ezdxf."""
    bounds = {part.name: (part.begin + 1, part.end or 0) for part in frame.sections}
    kinds, marks = [str(kind).strip() for kind in tags.kinds], [*tags.marks.tolist()]
    rows_of: dict[str, list[tuple[str, int, int]]] = defaultdict(list)
    for name, (begin, end) in bounds.items():
        first, last = np.searchsorted(tags.marks, [begin, end]).tolist()
        rows_of[name] = list(
            zip(kinds[first:last], marks[first:last], marks[first + 1 : last + 1], strict=True)
        )
    _check_version(tags, bounds.get("HEADER", (0, 0)))
    _check_blocks(tags, rows_of["BLOCKS"])
    layers = [
        _entity(kind, _pairs(tags, np.arange(begin + 1, end)))
        for kind, begin, end in rows_of["TABLES"]
        if kind == "LAYER"
    ]
    names = {str(layer.dxf.get("name")).casefold() for layer in layers}
    if len(names) < len(layers):
        raise ValueError("two layers have the same name")
    if "defpoints" not in names:
        layers.append(_Entity(kind="LAYER", dxf=_Attributes(name="Defpoints")))
    entities = []
    for kind, begin, end in rows_of["ENTITIES"]:
        rows = begin + np.flatnonzero(bulk.others[begin:end])
        if len(rows):
            entities.append(_entity(kind, _pairs(tags, rows[1:])))
            if not _HANDLE.fullmatch(entities[-1].dxf.get("handle", "")):
                raise ValueError("an entity has no handle")
    handles = [entity.dxf.handle for entity in entities]
    every = [value for _, value in _pairs(tags, np.flatnonzero(np.isin(tags.codes, (5, 105))))]
    if sum(handle in set(handles) for handle in every) > len(handles):
        raise ValueError("two entities have the same handle")
    return PlainDocument(layers, entities)


def _pairs(tags: Tags, rows: Any) -> list[tuple[int, str]]:
    """Return the group codes and values of these tags, values as text."""
    return [(code, str(value)) for code, value in tags.pairs(rows)]


def _check_version(tags: Tags, bounds: tuple[int, int]) -> None:
    """Raise ValueError for a file of a DXF version that ezdxf converts on reading."""
    rows = np.arange(*bounds)
    values = [*map(str, tags.values(rows))]
    if values.count("$ACADVER") != 1 or values[-1] == "$ACADVER":
        raise ValueError("no version")
    if values[values.index("$ACADVER") + 1].strip() not in _VERSIONS:
        raise ValueError("another version")


def _check_blocks(tags: Tags, entities: list[tuple[str, int, int]]) -> None:
    """Raise ValueError for entities in a block that is the content of a layout."""
    for (kind, begin, end), (following, _, _) in pairwise(entities):
        if kind == "BLOCK" and following != "ENDBLK":
            names = [value for code, value in _pairs(tags, np.arange(begin, end)) if code == _NAME]
            if not names or _SPACES.match(names[0].strip()):
                raise ValueError("entities of a layout among the blocks")


def _entity(kind: str, pairs: list[tuple[int, str]]) -> _Entity:
    """Return the entity of these tags; ValueError for one that must be left to ezdxf."""
    if kind not in _ATTRIBUTES:
        raise ValueError("another kind")
    names, repeated = _COMMON | _ATTRIBUTES[kind], _LISTS.get(kind, ())
    attributes: dict[str, Any] = {}
    lists: dict[int, list[Any]] = {code: [] for code in repeated}
    vertices: list[list[float]] = []
    for k, (code, text) in enumerate(pairs):
        if code in repeated and kind == "LWPOLYLINE":
            if code == 10:
                vertices.append([*_point(pairs, k)[:2], 0.0, 0.0, 0.0])
            else:
                vertices[-1][code - 38] = float(text)
        elif code in repeated:
            lists[code].append(_point(pairs, k) if code in _POINTS else float(text))
        elif code in names:
            if names[code] in attributes:
                raise ValueError("an attribute stands twice")
            attributes[names[code]] = _value(code, text, pairs, k)
        elif code in (_EMBEDDED, _ELEVATION) or (code == _PAPER and int(text)):
            raise ValueError("more than is read here")
    _check_attributes(kind, attributes)
    entity = _Entity(kind=kind, dxf=_Attributes(**attributes))
    if kind == "LWPOLYLINE":
        entity.lwpoints = SimpleNamespace(values=np.array(vertices, dtype=np.float64))
    elif kind == "SPLINE":
        entity.control_points, entity.fit_points, entity.knots, entity.weights = lists.values()
    return entity


def _value(code: int, text: str, pairs: list[tuple[int, str]], k: int) -> Any:
    """Return the value of tag `k` as text, point, integer or float, according to its group
    code."""
    if code in _TEXTS:
        return text
    if code in _POINTS:
        return _point(pairs, k)
    return int(text) if code in _INTEGERS else float(text)


def _point(pairs: list[tuple[int, str]], k: int) -> tuple[float, float, float]:
    """Return the point that begins at tag `k`; its height may be left out."""
    codes = [code - pairs[k][0] for code, _ in pairs[k : k + 3]]
    if codes[1:2] != [10]:
        raise ValueError("a point has no y")
    x, y, *height = (float(text) for _, text in pairs[k : k + (3 if codes[2:] == [20] else 2)])
    return x, y, height[0] if height else 0.0


def _check_attributes(kind: str, attributes: dict[str, Any]) -> None:
    """Raise ValueError for attributes with values that ezdxf would repair."""
    colour = attributes.get("color", 1)
    if kind == "LAYER":
        is_valid = 0 < abs(colour) < _MAX_COLOUR - 1 and "name" in attributes
    else:
        is_valid = 0 <= colour <= _MAX_COLOUR
    for name in ("name", "layer", "linetype"):
        is_valid &= not _FORBIDDEN_IN_NAMES.search(attributes.get(name, ""))
    for name in ("extrusion", "major_axis", "start_tangent", "end_tangent"):
        is_valid &= any(attributes.get(name, (1.0,)))
    is_valid &= 1e-6 <= attributes.get("ratio", 1.0) <= 1.0 and attributes.get("degree", 1) > 0
    if not is_valid:
        raise ValueError("an attribute is damaged")
