"""The walk over an SVG document.

Every element is visited with what its ancestors say (`Scope`): the map to mm, the style, the
layer, the size that percentages are of. Shapes become pieces, and texts when they are wanted; what
cannot be cut (images, hidden things) is counted. Layers are Inkscape's, else the groups right
under the root, else "0".

Nothing is clipped: clip paths, masks and the frames of inner svg and symbol elements are counted
where they would hide something, and everything is drawn whole.
Source: Scalable Vector Graphics 1.1, chapters 5 (structure, use, symbol), 7 and 11.5 (visibility);
SVG 2, 5.5 (use of an svg element).
"""

from __future__ import annotations

from camtool.errors import DrawingError
from camtool.importers.dxf.frames import Unusable
from camtool.importers.options import TEXT_SKIPPED, ReadOptions
from camtool.importers.piece import Piece
from camtool.importers.svg.affine import translation
from camtool.importers.svg.frame import frame_of
from camtool.importers.svg.map import CurveFitter, Fitted
from camtool.importers.svg.notes import Notes
from camtool.importers.svg.page import Page
from camtool.importers.svg.scope import Scope, is_for_us, layer_in, own_transform
from camtool.importers.svg.segments import Lines, Subpath
from camtool.importers.svg.shapes import SHAPES, Lengths, subpaths
from camtool.importers.svg.style import LIMITS, Sheet, Style
from camtool.importers.svg.tree import MAX_DEPTH, Node

MAX_USED = 50_000
"""So many elements, curves and hundreds of corners may be drawn through `use`; a few nested ones
could ask for billions."""

MAX_USE_DEPTH = 20
"""A `use` of a `use` of ...: deeper is a fault in the file."""

MAX_LETTERS = 50_000
"""So many letters are drawn, each of some dozens of arcs."""

_CORNERS_A_UNIT = 100
_GROUPS = ("g", "a", "svg", "switch", "use")
_NOT_CUT = {
    "flowRoot": "is flowed text: convert it to text or to paths",
    "image": "is a picture of pixels",
    "foreignObject": "is not SVG",
    "video": "is no geometry",
    "audio": "is no geometry",
    "iframe": "is no geometry",
    "canvas": "is no geometry",
}
_SILENT = (
    "symbol", "clipPath", "mask", "pattern", "hatch", "marker", "linearGradient",
    "radialGradient", "meshgradient", "filter", "style", "script", "title", "desc", "metadata",
)  # fmt: skip
"""Elements that draw nothing where they stand: they count where they are used."""

_COUNTED = (*SHAPES, "text", "flowRoot", "image", "use")


class Walk:
    """Visits the tree and collects pieces and counts."""

    def __init__(self, root: Node, page: Page, options: ReadOptions) -> None:
        self.options = options
        self.fitter = CurveFitter(options.tolerance_mm)
        self.pieces: list[Piece] = []
        self.notes = Notes()
        self._root = root
        self._page = page
        self._sheet = Sheet(root)
        self._by_use = 0
        self._letters = 0
        self._shapes: dict[Node, tuple[list[Subpath], str]] = {}
        self._ids: dict[str, Node] = {}
        for node in root.walk():
            name = node.get("id")
            if name:
                self._ids.setdefault(name, node)

    def run(self) -> None:
        """The whole document; the root's size and viewBox are in the page already."""
        root, page = self._root, self._page
        style = self._sheet.style(root, Style())
        if style.display == "none":
            self._count(root, "is hidden (display: none)")
            return
        if root.get("transform") or style.transform:
            self.notes.changed["transform of the page", "is not applied"] += 1
        if self._sheet.left_out:
            why = "of <style> not applied: other selectors or media"
            self.notes.changed["rules", why] += self._sheet.left_out
        self._limits(style, "page")
        self._children(root, Scope(page.to_mm, style, page.viewport))

    def _children(self, node: Node, scope: Scope) -> None:
        """All children, one level deeper."""
        inner = scope._replace(depth=scope.depth + 1)
        for child in node.children:
            self._visit(child, inner)

    def _visit(self, node: Node, scope: Scope) -> None:
        if scope.depth > MAX_DEPTH:
            raise DrawingError(
                f"is nested deeper than {MAX_DEPTH} elements, through use", where=node.label
            )
        if scope.uses:
            self._spend(1, node)
        tag = node.tag
        if tag in _NOT_CUT:
            self.notes.left_out[tag, _NOT_CUT[tag]] += 1
        elif tag == "text" and self.options.text == "skip":
            self.notes.left_out[tag, TEXT_SKIPPED] += 1
        elif tag in SHAPES or tag in _GROUPS or tag == "text":
            inner = self._entered(node, scope)
            if inner is not None:
                self._drawn(node, inner)
        elif tag != "defs" and tag not in _SILENT:
            self._count(node, "stands in an element that is not drawn")

    def _drawn(self, node: Node, scope: Scope) -> None:
        """A shape, or what is in a group."""
        if node.tag in SHAPES:
            self._shape(node, scope)
        elif node.tag == "text":
            self._text(node, scope)
        elif node.tag == "use":
            self._use(node, scope)
        elif node.tag == "svg":
            self._framed(node, node, scope)
        elif node.tag == "switch":
            for child in node.children:
                if child.tag not in ("", "foreignObject") and is_for_us(child):
                    self._visit(child, scope._replace(depth=scope.depth + 1))
                    return
        else:
            self._children(node, scope)

    def _entered(self, node: Node, scope: Scope) -> Scope | None:
        """The scope inside the element; None, and its shapes counted, when it shows nothing."""
        style = self._sheet.style(node, scope.style)
        if style.display == "none":
            self._count(node, "is hidden (display: none)")
            return None
        if not is_for_us(node):
            self._count(node, "is for another language or program")
            return None
        to_mm = scope.to_mm
        if style.transform or "transform" in node.attributes:
            try:
                own = own_transform(node, style, self._lengths(scope, style))
                to_mm = (to_mm @ own).checked()
            except DrawingError as error:
                self._unreadable(node, error)
                return None
            if to_mm.determinant == 0.0:
                self._count(node, "its transform leaves no area")
                return None
            if style.transform_box not in ("", "view-box"):
                self.notes.changed["transform-box", "is not applied: about the origin"] += 1
        self._limits(style, node.tag)
        return scope._replace(to_mm=to_mm, style=style, layer=layer_in(node, scope))

    def _limits(self, style: Style, name: str) -> None:
        """Counts what would hide or add something."""
        for limit in style.limits:
            self.notes.changed[f"{limit} of {name}", LIMITS[limit]] += 1

    def _shape(self, node: Node, scope: Scope) -> None:
        """A shape's subpaths as pieces."""
        style = scope.style
        if style.visibility in ("hidden", "collapse"):
            self.notes.left_out[node.tag, "is hidden (visibility)"] += 1
            return
        if not style.is_painted:
            self.notes.left_out[node.tag, "has neither stroke nor fill"] += 1
            return
        try:
            found, fault = self._subpaths(node, scope)
        except DrawingError as error:
            self.notes.fault(node.tag, "cannot be read", node, error)
            return
        if scope.uses:
            self._spend(_cost(found), node)
        try:
            fitted = [self.fitter.vertices(one, scope.to_mm) for one in found]
        except DrawingError as error:
            self.notes.fault(node.tag, "cannot be drawn", node, error)
            return
        if fault:
            what = "cut off where its data are wrong" if found else "cannot be read"
            self.notes.fault(f"rest of {node.tag}" if found else node.tag, what, node, fault)
        if not found:
            if not fault:
                self.notes.left_out[node.tag, "draws nothing"] += 1
            return
        self._take(found, fitted, node, scope)
        self.notes.used[node.tag] += 1

    def _take(self, found: list[Subpath], fitted: list[Fitted], node: Node, scope: Scope) -> None:
        """Subpaths of an element, in mm, as pieces."""
        style = scope.style
        source = node.label + (f" by use {scope.uses[-1]}" if scope.uses else "")
        for subpath, (vertices, off) in zip(found, fitted, strict=True):
            self.pieces.append(
                Piece(
                    vertices,
                    subpath.closed,
                    scope.layer,
                    style.colour,
                    source,
                    style.line_type,
                    off,
                )
            )

    def _text(self, node: Node, scope: Scope) -> None:
        """The letters of a text as pieces, all or none."""
        from camtool.importers.svg.text import text_of  # fonts: only where there is text

        def lengths_of(style: Style) -> Lengths:
            return self._lengths(scope, style)

        try:
            text = text_of(node, scope.style, self._sheet.style, lengths_of, self.options.text)
        except Unusable as reason:
            self.notes.left_out["text", str(reason)] += 1
            return
        except DrawingError as error:
            self.notes.fault("text", "cannot be read", node, error)
            return
        self._letters += text.letters
        if self._letters > MAX_LETTERS:
            raise DrawingError(
                f"texts have more than {MAX_LETTERS} letters",
                where=node.label,
                mend="leave text out (--text skip), or delete what is not cut",
            )
        if scope.uses:
            self._spend(sum(_cost(run.subpaths) for run in text.runs), node)
        try:
            fitted = [
                [self.fitter.vertices(one, scope.to_mm) for one in run.subpaths]
                for run in text.runs
            ]
        except DrawingError as error:
            self.notes.fault("text", "cannot be drawn", node, error)
            return
        drawn = False
        for run, rows in zip(text.runs, fitted, strict=True):
            self._take(run.subpaths, rows, node, scope._replace(style=run.style))
            drawn |= bool(rows)
        for why in text.unseen:
            self.notes.left_out["part of a text" if drawn else "text", why] += 1
        for weight in text.plainer:
            what = f"font-weight {weight} of text"
            self.notes.changed[what, "is not applied: 600 and more is bold"] += 1
        for lacks in text.lacks:
            self.notes.fonts[lacks] += 1
        if drawn:
            self.notes.used["text"] += 1
        elif not text.unseen:
            self.notes.left_out["text", "draws nothing"] += 1

    def _subpaths(self, node: Node, scope: Scope) -> tuple[list[Subpath], str]:
        """The shape in user units; paths that are used again are not parsed again."""
        if not scope.uses or node.tag not in ("path", "polyline", "polygon"):
            return subpaths(node, self._lengths(scope, scope.style))
        if node not in self._shapes:
            self._shapes[node] = subpaths(node, self._lengths(scope, scope.style))
        return self._shapes[node]

    def _use(self, node: Node, scope: Scope) -> None:
        """The element that `use` names, drawn here."""
        reference = node.get("href") or node.get("xlink:href")
        name = reference[1:] if reference.startswith("#") else ""
        target = self._ids.get(name)
        if target is None:
            outside = bool(reference) and not reference.startswith("#")
            why = "refers to another file" if outside else "refers to nothing in the file"
            self.notes.left_out["use", why] += 1
            return
        if name in scope.uses or len(scope.uses) >= MAX_USE_DEPTH:
            raise DrawingError(f"use of {name!r} leads back to itself", where=node.label)
        lengths = self._lengths(scope, scope.style)
        try:
            shift = translation(lengths.along(node, "x", "x"), lengths.along(node, "y", "y"))
            to_mm = (scope.to_mm @ shift).checked()
        except DrawingError as error:
            self._unreadable(node, error)
            return
        uses = (*scope.uses, name)
        inner = scope._replace(to_mm=to_mm, uses=uses, depth=scope.depth + 1)
        if target.tag in ("symbol", "svg"):
            self._spend(1, node)
            entered = self._entered(target, inner)
            if entered is not None:
                self._framed(target, node, entered)
        else:
            self._visit(target, inner)

    def _framed(self, node: Node, size: Node, scope: Scope) -> None:
        """An inner svg or a symbol: `size` says how large (the element itself, or its use)."""
        try:
            frame = frame_of(node, size, scope, self._lengths(scope, scope.style))
        except DrawingError as error:
            self._unreadable(node, error)
            return
        if frame is None:
            self._count(node, "its frame has no size")
            return
        first = len(self.pieces)
        self._children(node, scope._replace(to_mm=frame.to_mm, viewport=frame.viewport))
        if scope.style.overflow not in ("visible", "auto"):
            count = sum(frame.is_left_by(piece.vertices[:, :2]) for piece in self.pieces[first:])
            if count:
                what = f"pieces reach out of the frame of {node.tag}s"
                self.notes.changed[what, "which would hide them: they are drawn whole"] += count

    def _lengths(self, scope: Scope, style: Style) -> Lengths:
        return Lengths(self.options, scope.viewport, style.font_px)

    def _unreadable(self, node: Node, error: DrawingError) -> None:
        """Leaves out an element for a wrong number, and says how many shapes went with it."""
        self.notes.fault(node.tag, "cannot be read", node, error)
        for inner in node.walk():
            if inner is not node and inner.tag in _COUNTED:
                self.notes.left_out[inner.tag, f"stands in a {node.tag} that cannot be read"] += 1

    def _count(self, node: Node, why: str) -> None:
        """Counts what would have been drawn in and below an element that is left out."""
        for inner in node.walk():
            if inner.tag in _COUNTED:
                self.notes.left_out[inner.tag, why] += 1

    def _spend(self, cost: int, node: Node) -> None:
        """Bounds what is drawn through use."""
        self._by_use += cost
        if self._by_use > MAX_USED:
            raise DrawingError(
                f"more than {MAX_USED} elements and curves are drawn through use",
                where=node.label,
            )


def _cost(found: list[Subpath]) -> int:
    """Curves, and hundreds of corners."""
    segments = [segment for one in found for segment in one.segments]
    corners = sum(len(segment.points) for segment in segments if isinstance(segment, Lines))
    curves = sum(not isinstance(segment, Lines) for segment in segments)
    return curves + corners // _CORNERS_A_UNIT
