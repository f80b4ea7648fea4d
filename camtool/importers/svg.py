"""SVG to Drawing: the walk over the document.

Every element is visited with what its ancestors say (`_Scope`): the map to mm, the style, the
layer, the size that percentages are of. Shapes become pieces; what cannot be cut (texts, images,
hidden things) is counted. Layers are Inkscape's, else the groups right under the root, else "0".

Clipping is not applied: a clip path is counted where it is used, and everything is drawn whole.
Source: Scalable Vector Graphics 1.1, chapters 5 (structure, use, symbol), 7 and 11.5 (visibility).
"""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, replace

from camtool.errors import DrawingError
from camtool.geometry.drawing import Drawing, Skipped
from camtool.importers.assemble import Piece, assemble
from camtool.importers.options import ReadOptions
from camtool.importers.svg_affine import (
    Affine,
    Box,
    parse_transform,
    parse_view_box,
    translation,
    view_box_map,
)
from camtool.importers.svg_map import CurveFitter
from camtool.importers.svg_page import page_of
from camtool.importers.svg_shapes import SHAPES, Lengths, subpaths
from camtool.importers.svg_style import Sheet, Style
from camtool.importers.svg_tree import MAX_DEPTH, Node, parse_tree

MAX_USED = 100_000
"""So many elements may be drawn through `use`; a few nested ones could ask for billions."""

MAX_USE_DEPTH = 20
"""A `use` of a `use` of ...: deeper is a fault in the file."""

DEFAULT_LAYER = "0"

_GROUPS = ("g", "a", "svg", "switch", "use")
_NOT_CUT = {
    "text": "text has no outline here: convert it to paths",
    "image": "is a picture of pixels",
    "foreignObject": "is not SVG",
    "clipPath": "only limits other things: clipping is not applied",
    "mask": "only limits other things: masks are not applied",
    "pattern": "is a filling",
    "hatch": "is a filling",
    "linearGradient": "is a filling",
    "radialGradient": "is a filling",
    "meshgradient": "is a filling",
    "filter": "is an effect on pixels",
    "marker": "markers are not drawn",
    "video": "is no geometry",
    "audio": "is no geometry",
    "iframe": "is no geometry",
    "canvas": "is no geometry",
}
_LIMITED = {"clip-path": "is not applied: drawn whole", "mask": "is not applied: drawn whole"}
_CSS_TRANSFORM = re.compile(r"(?:^|;)\s*(transform|translate|rotate|scale)\s*:")


@dataclass(frozen=True)
class _Scope:
    """What holds for an element: `to_mm` from its user units; `above_root` until a layer or a
    group under the root has named the layer; `uses` the ids on the way here."""

    to_mm: Affine
    style: Style
    viewport: tuple[float, float] | None
    layer: str = DEFAULT_LAYER
    depth: int = 0
    uses: tuple[str, ...] = ()


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """The Drawing of an SVG; DrawingError naming element and line when it cannot be read."""
    try:
        root = parse_tree(data)
        walk = _Walk(root, options)
        page = page_of(root, options)
        scope = _Scope(page.to_mm, walk.sheet.style(root, Style()), page.viewport)
        walk.root(root, scope)
    except DrawingError as error:
        error.file = error.file or file
        raise
    return assemble(
        walk.pieces,
        file=file,
        units=page.units,
        fit=walk.fitter.error(),
        used=dict(walk.used),
        skipped=[Skipped(kind, n, why) for (kind, why), n in walk.skipped.items()],
        findings=list(page.findings),
        options=options,
    )


class _Walk:
    """Visits the tree and collects pieces and counts."""

    def __init__(self, root: Node, options: ReadOptions) -> None:
        self.options = options
        self.sheet = Sheet(root)
        self.fitter = CurveFitter(options.tolerance_mm)
        self.pieces: list[Piece] = []
        self.used: Counter[str] = Counter()
        self.skipped: Counter[tuple[str, str]] = Counter()
        self._ids: dict[str, Node] = {}
        for node in root.walk():
            name = node.get("id")
            if name:
                self._ids.setdefault(name, node)
        self._drawn_by_use = 0

    def root(self, root: Node, scope: _Scope) -> None:
        """The whole document; the root's own attributes are in the page already."""
        if scope.style.display == "none":
            self._count_shapes(root, "is hidden (display: none)")
            return
        if root.get("transform"):
            self.skipped["transform of the page", "is not applied"] += 1
        self.children(root, scope)

    def children(self, node: Node, scope: _Scope) -> None:
        """All children, one level deeper."""
        inner = replace(scope, depth=scope.depth + 1)
        for child in node.children:
            self.visit(child, inner)

    def visit(self, node: Node, scope: _Scope) -> None:
        """One element; a fault in it is named by it."""
        try:
            self._visit(node, scope)
        except DrawingError as error:
            error.where = error.where or node.label
            raise

    def _visit(self, node: Node, scope: _Scope) -> None:
        if scope.depth > MAX_DEPTH:
            raise DrawingError(f"is nested deeper than {MAX_DEPTH} elements, through use")
        if scope.uses:
            self._drawn_by_use += 1
            if self._drawn_by_use > MAX_USED:
                raise DrawingError(f"more than {MAX_USED} elements are drawn through use")
        tag = node.tag
        if tag in _NOT_CUT:
            self.skipped[tag, _NOT_CUT[tag]] += 1
        elif tag == "defs":
            self._count_not_cut(node)
        elif tag in SHAPES or tag in _GROUPS:
            inner = self._entered(node, scope)
            if inner is None:
                return
            if tag in SHAPES:
                self._shape(node, inner)
            elif tag == "use":
                self._use(node, inner)
            elif tag == "svg":
                self._framed(node, node, inner)
            elif tag == "switch":
                self._switch(node, inner)
            else:
                self.children(node, inner)

    def _entered(self, node: Node, scope: _Scope) -> _Scope | None:
        """The scope inside the element; None, and its shapes counted, when it shows nothing."""
        style = self.sheet.style(node, scope.style)
        if style.display == "none":
            self._count_shapes(node, "is hidden (display: none)")
            return None
        transform = node.get("transform")
        to_mm = scope.to_mm
        if transform and transform != "none":
            to_mm = (to_mm @ parse_transform(transform)).checked()
            if to_mm.determinant == 0.0:
                self._count_shapes(node, "its transform leaves no area")
                return None
        for name, why in _LIMITED.items():
            if node.get(name, "none") not in ("none", ""):
                self.skipped[f"{name} of {node.tag}", why] += 1
        if _CSS_TRANSFORM.search(node.get("style")):
            self.skipped[f"style of {node.tag}", "its CSS transform is not applied"] += 1
        return replace(scope, to_mm=to_mm, style=style, layer=_layer(node, scope))

    def _shape(self, node: Node, scope: _Scope) -> None:
        """A shape's subpaths as pieces."""
        if scope.style.visibility in ("hidden", "collapse"):
            self.skipped[node.tag, "is hidden (visibility)"] += 1
            return
        if not scope.style.is_painted:
            self.skipped[node.tag, "has neither stroke nor fill"] += 1
            return
        found = subpaths(node, Lengths(self.options, scope.viewport))
        if not found:
            self.skipped[node.tag, "draws nothing"] += 1
            return
        source = node.label + (f" by use {scope.uses[-1]}" if scope.uses else "")
        for subpath in found:
            vertices = self.fitter.vertices(subpath, scope.to_mm)
            colour = scope.style.colour
            self.pieces.append(Piece(vertices, subpath.closed, scope.layer, colour, source))
        self.used[node.tag] += 1

    def _use(self, node: Node, scope: _Scope) -> None:
        """The element that `use` names, drawn here."""
        reference = node.get("href") or node.get("xlink:href")
        target = self._ids.get(reference[1:]) if reference.startswith("#") else None
        if target is None:
            outside = bool(reference) and not reference.startswith("#")
            why = "refers to another file" if outside else "refers to nothing in the file"
            self.skipped["use", why] += 1
            return
        name = reference[1:]
        if name in scope.uses or len(scope.uses) >= MAX_USE_DEPTH:
            raise DrawingError(f"use of {name!r} leads back to itself")
        lengths = Lengths(self.options, scope.viewport)
        shift = translation(lengths.along(node, "x", "x"), lengths.along(node, "y", "y"))
        inner = replace(
            scope,
            to_mm=(scope.to_mm @ shift).checked(),
            uses=(*scope.uses, name),
            depth=scope.depth + 1,
        )
        if target.tag == "symbol":
            entered = self._entered(target, inner)
            if entered is not None:
                self._framed(target, node, entered)
        else:
            self.visit(target, inner)

    def _framed(self, node: Node, size: Node, scope: _Scope) -> None:
        """An inner svg or a symbol: `size` says how large (the element itself, or its use)."""
        lengths = Lengths(self.options, scope.viewport)
        x = lengths.along(node, "x", "x") if node is size else 0.0
        y = lengths.along(node, "y", "y") if node is size else 0.0
        whole = scope.viewport or (0.0, 0.0)
        width = lengths.size(size, "width", "x", whole[0])
        height = lengths.size(size, "height", "y", whole[1])
        box = parse_view_box(node.get("viewBox"))
        place, viewport = translation(x, y), (width, height)
        if box is not None:
            if width == 0.0 or height == 0.0:
                self._count_shapes(node, "its frame has no size")
                return
            align = node.get("preserveAspectRatio")
            place = view_box_map(box, Box(x, y, width, height), align)
            viewport = (box.width, box.height)
        inner = replace(scope, to_mm=(scope.to_mm @ place).checked(), viewport=viewport)
        self.children(node, inner)

    def _switch(self, node: Node, scope: _Scope) -> None:
        """The first child that asks for nothing special."""
        for child in node.children:
            language = child.get("systemLanguage", "en").lower()
            plain = not child.get("requiredExtensions") and language.startswith("en")
            if child.tag and child.tag != "foreignObject" and plain:
                self.visit(child, replace(scope, depth=scope.depth + 1))
                return

    def _count_shapes(self, node: Node, why: str) -> None:
        """Counts what would have been drawn in and below an element that is left out."""
        for inner in node.walk():
            if inner.tag in SHAPES or inner.tag in ("text", "image", "use"):
                self.skipped[inner.tag, why] += 1

    def _count_not_cut(self, definitions: Node) -> None:
        """Counts fillings and the like among definitions; shapes there wait for their use."""
        for node in definitions.walk():
            if node.tag in _NOT_CUT and node.tag not in ("text", "image"):
                self.skipped[node.tag, _NOT_CUT[node.tag]] += 1


def _layer(node: Node, scope: _Scope) -> str:
    """The layer inside this element: an Inkscape layer's label, or the name of a group that
    stands right under the root."""
    if node.tag != "g":
        return scope.layer
    if node.get("inkscape:groupmode") == "layer":
        return node.get("inkscape:label") or node.get("id") or scope.layer
    if scope.depth == 1 and not scope.uses:
        return node.get("id") or scope.layer
    return scope.layer
