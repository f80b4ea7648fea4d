"""What the readers of solids share: bodies with their names and colours.

`TopoDS_Shape` and all else of OpenCASCADE has no types for Python: it is `Any` here.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

_NO_NAME = re.compile(
    r"(?:COMPOUND|COMPSOLID|SOLID|SHELL|FACE|WIRE|EDGE|VERTEX|Open[_ ]CASCADE.*)?", re.DOTALL
)
"""What OpenCASCADE writes as the name of a shape that has none."""


@dataclass(frozen=True, eq=False)
class Body:
    """One solid, or a shell, face, wire or edge that belongs to none: a `TopoDS_Shape`."""

    shape: Any
    layer: str
    colour: str


def shape_bodies(shape: Any) -> list[Body]:
    """The parts of a build123d shape with the names and colours of its tree."""
    return _tree_bodies(shape.wrapped, shape, "0", "")


def _tree_bodies(topods: Any, shape: Any, layer: str, colour: str) -> list[Body]:
    """`topods` is where the shape really is: children do not move with what they belong to."""
    from OCP.TopoDS import TopoDS_Iterator

    layer = layer_of(shape.label) or layer
    colour = (colour_of(shape.color.wrapped.GetRGB()) if shape.color else "") or colour
    children = tuple(shape.children)
    if children:
        parts = list(_listed(TopoDS_Iterator(topods)))
        if len(parts) == len(children):
            return [
                body
                for part, child in zip(parts, children, strict=True)
                for body in _tree_bodies(part, child, layer, colour)
            ]
    return [Body(part, layer, colour) for part in parts_in(topods)]


def parts_in(shape: Any) -> list[Any]:
    """All solids of a shape, and the shells, faces, wires and edges that belong to none."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID, TopAbs_WIRE

    kinds = (TopAbs_SOLID, TopAbs_SHELL, TopAbs_FACE, TopAbs_WIRE, TopAbs_EDGE)
    parts = subshapes(shape, TopAbs_SOLID)
    for above, kind in pairwise(kinds):
        parts.extend(subshapes(shape, kind, above))
    return [part for part in parts if has_edges(part)]


def subshapes(shape: Any, kind: Any, outside: Any = None) -> list[Any]:
    """All parts of this kind (`TopAbs_FACE` …), each once; with `outside` none that is in such."""
    from OCP.TopAbs import TopAbs_SHAPE
    from OCP.TopExp import TopExp_Explorer

    found: dict[int, list[Any]] = {}
    parts: list[Any] = []
    explorer = TopExp_Explorer(shape, kind, TopAbs_SHAPE if outside is None else outside)
    while explorer.More():
        part = explorer.Current()
        same = found.setdefault(hash(part), [])
        if not any(part.IsSame(other) for other in same):
            same.append(part)
            parts.append(_typed(part))
        explorer.Next()
    return parts


def has_edges(shape: Any) -> bool:
    """Whether there is anything in the shape that could be drawn."""
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer

    return bool(TopExp_Explorer(shape, TopAbs_EDGE).More())


def layer_of(label: object) -> str:
    """The name as a layer; "" when there is none."""
    text = "".join(sign if sign.isprintable() else "_" for sign in str(label or "")).strip()
    return "" if _NO_NAME.fullmatch(text) else text


def colour_of(colour: Any) -> str:
    """ "#rrggbb" of a `Quantity_Color`, which is linear: sRGB is 1.055 c^(1/2.4) − 0.055."""
    parts = [
        12.92 * part if part <= 0.0031308 else 1.055 * part ** (1.0 / 2.4) - 0.055
        for part in (colour.Red(), colour.Green(), colour.Blue())
    ]
    return "#{:02x}{:02x}{:02x}".format(*(min(max(round(255.0 * c), 0), 255) for c in parts))


def _typed(shape: Any) -> Any:
    """The shape as the class of its kind; the binding has other names since version 8."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID, TopAbs_WIRE
    from OCP.TopoDS import TopoDS

    names = {
        TopAbs_EDGE: "Edge",
        TopAbs_WIRE: "Wire",
        TopAbs_FACE: "Face",
        TopAbs_SHELL: "Shell",
        TopAbs_SOLID: "Solid",
    }
    name = names[shape.ShapeType()]
    return (getattr(TopoDS, f"{name}_s", None) or getattr(TopoDS, name))(shape)


def _listed(explorer: Any) -> Iterator[Any]:
    while explorer.More():
        yield explorer.Value()
        explorer.Next()
