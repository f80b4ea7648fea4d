"""What holds for an element of an SVG by its place in the document."""

from __future__ import annotations

from typing import NamedTuple

from camtool.importers.svg.affine import Affine
from camtool.importers.svg.shapes import Lengths
from camtool.importers.svg.style import Style
from camtool.importers.svg.transform import (
    about,
    parse_css_transform,
    parse_origin,
    parse_transform,
)
from camtool.importers.svg.tree import Node

DEFAULT_LAYER = "0"
"""The layer of what stands in no layer and in no named group."""


class Scope(NamedTuple):
    """What holds for an element: `to_mm` from its user units; the style of its parent; `viewport`
    what % are of; `layer`; `depth` of nesting; `uses` the ids on the way here."""

    to_mm: Affine
    style: Style
    viewport: tuple[float, float] | None
    layer: str = DEFAULT_LAYER
    depth: int = 0
    uses: tuple[str, ...] = ()


def own_transform(node: Node, style: Style, lengths: Lengths) -> Affine:
    """Its transform: of its style, else its attribute, about its origin; DrawingError."""
    attribute = node.get("transform")
    if style.transform:
        own = (
            Affine()
            if style.transform == "none"
            else parse_css_transform(style.transform, lengths.length)
        )
    else:
        own = Affine() if attribute == "none" else parse_transform(attribute)
    origin = style.transform_origin or node.get("transform-origin")
    return about(parse_origin(origin, lengths.length), own) if origin else own


def is_for_us(node: Node) -> bool:
    """Whether the element asks for no other language and for no extension."""
    if node.get("requiredExtensions"):
        return False
    languages = node.attributes.get("systemLanguage")
    return languages is None or any(
        word.strip().lower().partition("-")[0] == "en" for word in languages.split(",")
    )


def layer_in(node: Node, scope: Scope) -> str:
    """The layer inside this element: an Inkscape layer's label, or the name of a group that
    stands right under the root."""
    if node.tag != "g":
        return scope.layer
    if node.get("inkscape:groupmode") == "layer":
        return node.get("inkscape:label") or node.get("id") or scope.layer
    if scope.depth == 1 and not scope.uses:
        return node.get("id") or scope.layer
    return scope.layer
