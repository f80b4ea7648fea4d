"""The context of an element of an SVG by its place in the document: map, style, layer, frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from msgspec import Struct

from camtool.arrays import Floats
from camtool.importers.svg.shapes import Lengths
from camtool.importers.svg.style import SvgStyle
from camtool.importers.svg.transform import (
    Affine,
    SvgBox,
    about_point,
    parse_css_transform,
    parse_origin,
    parse_transform,
    parse_view_box,
    translation,
    view_box_map,
)
from camtool.importers.svg.tree import Node

DEFAULT_LAYER = "0"
"""The layer of elements outside of all layers and named groups."""


class SvgScope(NamedTuple):
    """The context of an element: the map `to_mm` from its user units; the style of its parent; the
    `viewport` to which percentages refer; `layer`; `depth` of nesting; the ids of the `use`
    elements around it."""

    to_mm: Affine
    style: SvgStyle
    viewport: tuple[float, float] | None
    layer: str = DEFAULT_LAYER
    depth: int = 0
    uses: tuple[str, ...] = ()


def own_transform(node: Node, style: SvgStyle, lengths: Lengths) -> Affine:
    """Return the transform of an element, from its style or else its attribute, about its origin;
    DrawingError."""
    attribute = node.get("transform")
    if style.transform:
        transform = (
            Affine()
            if style.transform == "none"
            else parse_css_transform(style.transform, lengths.length)
        )
    else:
        transform = Affine() if attribute == "none" else parse_transform(attribute)
    origin = style.transform_origin or node.get("transform-origin")
    return about_point(parse_origin(origin, lengths.length), transform) if origin else transform


def is_for_us(node: Node) -> bool:
    """Return True if the element is for English readers or any language, and requires no
    extension."""
    if node.get("requiredExtensions"):
        return False
    languages = node.attributes.get("systemLanguage")
    return languages is None or any(
        word.strip().lower().partition("-")[0] == "en" for word in languages.split(",")
    )


def layer_in(node: Node, scope: SvgScope) -> str:
    """Return the layer for what is inside this element: the label of an Inkscape layer, or the id
    of a group directly under the root."""
    if node.tag != "g":
        return scope.layer
    if node.get("inkscape:groupmode") == "layer":
        return node.get("inkscape:label") or node.get("id") or scope.layer
    if scope.depth == 1 and not scope.uses:
        return node.get("id") or scope.layer
    return scope.layer


# The frames of inner svg and symbol elements.
#
# Source: Scalable Vector Graphics 1.1, 5.1 (svg), 5.5 (symbol), 7.9 (new viewports); SVG 2, 5.5.

FRAME_SHARE = 1e-6
"""A piece that leaves a frame by no more than this share of the frame's size counts as inside."""


class ClipFrame(Struct, frozen=True):
    """The frame of an inner svg or a symbol.

    `to_mm` maps from the units inside, `viewport` is the size there to which percentages refer;
    `box` is the frame in the units outside, which `outer` maps to mm."""

    to_mm: Affine
    viewport: tuple[float, float]
    box: SvgBox
    outer: Affine

    def is_left_by(self, points: Floats) -> bool:
        """Return True if any of the points (n, 2) mm lies outside of the frame."""
        if not (self.box.width and self.box.height and self.outer.determinant):
            return False
        places = self.outer.inverse.points(points)
        low = np.array([self.box.x, self.box.y])
        high = low + np.array([self.box.width, self.box.height])
        slack = FRAME_SHARE * (self.box.width + self.box.height)
        return bool((places < low - slack).any() or (places > high + slack).any())


def frame_of(node: Node, size: Node, scope: SvgScope, lengths: Lengths) -> ClipFrame | None:
    """Return the frame of an inner svg or a symbol; None if it has no size and so shows nothing.
    DrawingError for wrong numbers.

    `size` is the element that gives the size: itself, or the `use` that draws it. An svg that a
    `use` draws keeps its place and the sizes that the `use` does not name."""
    frame_node = node if node.tag == "svg" else None
    x = lengths.along(frame_node, "x", "x") if frame_node else 0.0
    y = lengths.along(frame_node, "y", "y") if frame_node else 0.0
    sides: list[float] = []
    viewport = scope.viewport or (0.0, 0.0)
    for name, axis, default in zip(("width", "height"), "xy", viewport, strict=True):
        fallback = lengths.size(frame_node, name, axis, default) if frame_node else default
        sides.append(lengths.size(size, name, axis, fallback))
    place = SvgBox(x, y, *sides)
    box = parse_view_box(node.get("viewBox"))
    if box is None:
        inner = (scope.to_mm @ translation(x, y)).checked()
        return ClipFrame(inner, (sides[0], sides[1]), place, scope.to_mm)
    if not all(sides):
        return None
    inner = scope.to_mm @ view_box_map(box, place, node.get("preserveAspectRatio"))
    return ClipFrame(inner.checked(), (box.width, box.height), place, scope.to_mm)
