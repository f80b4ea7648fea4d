"""SVG to Drawing: bytes, tree, page, walk.

    bytes ──as_safe_utf8──▶ UTF-8 ──parse_tree──▶ nodes ──page_of──▶ map to mm ──SvgWalk──▶ pieces

Source: Scalable Vector Graphics 1.1 and, where it says more, 2."""

from __future__ import annotations

import cmath
from collections import Counter

import numpy as np
from msgspec import Struct, field

from camtool.arrays import Floats
from camtool.errors import DrawingError, GeometryError
from camtool.findings import Finding
from camtool.geometry.curves import BezierCurve, Curve, EllipseCurve
from camtool.geometry.drawing import Drawing, Skipped
from camtool.geometry.fit import arc_vertices, fit_curve
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.assemble import assemble, font_findings
from camtool.importers.findings import NOT_APPLIED
from camtool.importers.options import TEXT_SKIPPED, ReadOptions
from camtool.importers.pieces import MAX_COORDINATE_MM, Piece, Unusable
from camtool.importers.svg.page import SvgPage, page_of
from camtool.importers.svg.scope import SvgScope, frame_of, is_for_us, layer_in, own_transform
from camtool.importers.svg.shapes import (
    SHAPES,
    Arc,
    Bezier,
    Lengths,
    Segment,
    Subpath,
    SvgLines,
    subpaths,
)
from camtool.importers.svg.style import LIMITS, StyleSheet, SvgStyle
from camtool.importers.svg.transform import Affine, translation
from camtool.importers.svg.tree import MAX_DEPTH, Node, as_safe_utf8, parse_tree, writer_dpi


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """Return the Drawing of an SVG, also a gzipped one; DrawingError naming element and line
    when it cannot be read. What is wrong in one element alone leaves that element out, with a
    finding."""
    try:
        content = as_safe_utf8(data)
        root = parse_tree(content)
        page = page_of(root, options, writer_dpi(content))
        walk = SvgWalk(root, page, options)
        walk.run()
    except DrawingError as error:
        error.file = error.file or file
        raise
    return assemble(
        walk.pieces,
        file=file,
        units=page.units,
        used=dict(walk.notes.used),
        skipped=walk.notes.skipped(),
        findings=[*page.findings, *walk.notes.findings()],
        options=options,
    )


# The walk over an SVG document.
#
# Every element is visited with what its ancestors say (`SvgScope`): the map to mm, the style, the
# layer, the size that percentages are of. Shapes become pieces, and texts when they are wanted;
# what cannot be cut (images, hidden things) is counted. Layers are Inkscape's, else the groups
# right under the root, else "0".
#
# Nothing is clipped: clip paths, masks and the frames of inner svg and symbol elements are counted
# where they would hide something, and everything is drawn whole. Source: Scalable Vector Graphics
# 1.1, chapters 5 (structure, use, symbol), 7 and 11.5 (visibility); SVG 2, 5.5 (use of an svg
# element).

MAX_USED = 50_000
"""At most this many elements, curves and hundreds of corners may be drawn through `use`; a few
nested ones could ask for billions."""

MAX_USE_DEPTH = 20
"""A `use` of a `use` of ...: deeper is a fault in the file."""

MAX_LETTERS = 50_000

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
"""Elements that draw nothing where they stand, but may be drawn elsewhere by reference."""

_COUNTED = (*SHAPES, "text", "flowRoot", "image", "use")


class SvgWalk:
    """The walk through the tree: it collects pieces, and counts of what was left out or not
    applied."""

    def __init__(self, root: Node, page: SvgPage, options: ReadOptions) -> None:
        self.options = options
        self.fitter = CurveFitter(options.tolerance_mm, box_only=options.box_only)
        self.pieces: list[Piece] = []
        self.notes = Notes()
        self._root = root
        self._page = page
        self._sheet = StyleSheet(root)
        self._by_use = 0
        self._letters = 0
        self._shapes: dict[Node, tuple[list[Subpath], str]] = {}
        self._ids: dict[str, Node] = {}
        for node in root.walk():
            name = node.get("id")
            if name:
                self._ids.setdefault(name, node)

    def run(self) -> None:
        """Walk through the whole document; the size and viewBox of the root are applied in the
        page already."""
        root, page = self._root, self._page
        style = self._sheet.style(root, SvgStyle())
        if style.display == "none":
            self._count(root, "is hidden (display: none)")
            return
        if root.get("transform") or style.transform:
            self.notes.changed["transform of the page", "is not applied"] += 1
        if self._sheet.left_out:
            reason = "of <style> not applied: other selectors or media"
            self.notes.changed["rules", reason] += self._sheet.left_out
        self._limits(style, "page")
        self._children(root, SvgScope(page.to_mm, style, page.viewport))

    def _children(self, node: Node, scope: SvgScope) -> None:
        """Walk through all children of an element, one level deeper."""
        inner = scope._replace(depth=scope.depth + 1)
        for child in node.children:
            self._visit(child, inner)

    def _visit(self, node: Node, scope: SvgScope) -> None:
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

    def _drawn(self, node: Node, scope: SvgScope) -> None:
        """Draw a shape or text, or visit what is in a group."""
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

    def _entered(self, node: Node, scope: SvgScope) -> SvgScope | None:
        """Return the scope inside the element; None if it shows nothing, after counting its shapes
        as left out."""
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
                transform = own_transform(node, style, self._lengths(scope, style))
                to_mm = (to_mm @ transform).checked()
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

    def _limits(self, style: SvgStyle, name: str) -> None:
        """Count properties that would hide or add something and are not applied (clip paths,
        masks, filters …)."""
        for limit in style.limits:
            self.notes.changed[f"{limit} of {name}", LIMITS[limit]] += 1

    def _shape(self, node: Node, scope: SvgScope) -> None:
        """Add the subpaths of a shape to the pieces, or count it with the reason why it is left
        out."""
        style = scope.style
        if style.visibility in ("hidden", "collapse"):
            self.notes.left_out[node.tag, "is hidden (visibility)"] += 1
            return
        if not style.is_painted:
            self.notes.left_out[node.tag, "has neither stroke nor fill"] += 1
            return
        try:
            subpaths, fault = self._subpaths(node, scope)
        except DrawingError as error:
            self.notes.fault(node.tag, "cannot be read", node, error)
            return
        if scope.uses:
            self._spend(_cost(subpaths), node)
        try:
            fitted = [self.fitter.vertices(one, scope.to_mm) for one in subpaths]
        except DrawingError as error:
            self.notes.fault(node.tag, "cannot be drawn", node, error)
            return
        if fault:
            complaint = "cut off where its data are wrong" if subpaths else "cannot be read"
            self.notes.fault(
                f"rest of {node.tag}" if subpaths else node.tag, complaint, node, fault
            )
        if not subpaths:
            if not fault:
                self.notes.left_out[node.tag, "draws nothing"] += 1
            return
        self._take(subpaths, fitted, node, scope)
        self.notes.used[node.tag] += 1

    def _take(
        self, subpaths: list[Subpath], fitted: list[Fitted], node: Node, scope: SvgScope
    ) -> None:
        """Add these fitted subpaths of an element to the pieces; `fitted` are in mm."""
        style = scope.style
        source = node.label + (f" by use {scope.uses[-1]}" if scope.uses else "")
        for subpath, (vertices, errors) in zip(subpaths, fitted, strict=True):
            self.pieces.append(
                Piece(
                    vertices,
                    subpath.closed,
                    scope.layer,
                    style.colour,
                    source,
                    style.line_type,
                    errors,
                )
            )

    def _text(self, node: Node, scope: SvgScope) -> None:
        """Add the letters of a text to the pieces, all or none."""
        from camtool.importers.svg.text import text_of  # imports fonts: needed for texts only

        def lengths_of(style: SvgStyle) -> Lengths:
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
        for cause in text.unseen:
            self.notes.left_out["part of a text" if drawn else "text", cause] += 1
        for weight in text.plainer:
            subject = f"font-weight {weight} of text"
            self.notes.changed[subject, "is not applied: 600 and more is bold"] += 1
        for lacks in text.lacks:
            self.notes.fonts[lacks] += 1
        if drawn:
            self.notes.used["text"] += 1
        elif not text.unseen:
            self.notes.left_out["text", "draws nothing"] += 1

    def _subpaths(self, node: Node, scope: SvgScope) -> tuple[list[Subpath], str]:
        """Return the subpaths of a shape in user units, and the fault in its data, or ""; those
        drawn by `use` are parsed once."""
        if not scope.uses or node.tag not in ("path", "polyline", "polygon"):
            return subpaths(node, self._lengths(scope, scope.style))
        if node not in self._shapes:
            self._shapes[node] = subpaths(node, self._lengths(scope, scope.style))
        return self._shapes[node]

    def _use(self, node: Node, scope: SvgScope) -> None:
        """Draw the element that a `use` refers to, at the place of the `use`."""
        reference = node.get("href") or node.get("xlink:href")
        name = reference[1:] if reference.startswith("#") else ""
        target = self._ids.get(name)
        if target is None:
            outside = bool(reference) and not reference.startswith("#")
            reason = "refers to another file" if outside else "refers to nothing in the file"
            self.notes.left_out["use", reason] += 1
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

    def _framed(self, node: Node, size: Node, scope: SvgScope) -> None:
        """Draw the content of an inner svg or a symbol; `size` is the element that gives its size:
        itself, or its `use`.

        Pieces that leave the frame are counted, not clipped."""
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
                subject = f"pieces reach out of the frame of {node.tag}s"
                self.notes.changed[subject, "which would hide them: they are drawn whole"] += count

    def _lengths(self, scope: SvgScope, style: SvgStyle) -> Lengths:
        return Lengths(self.options, scope.viewport, style.font_px)

    def _unreadable(self, node: Node, error: DrawingError) -> None:
        """Count an element with a wrong number as a fault, and the shapes inside it as left
        out."""
        self.notes.fault(node.tag, "cannot be read", node, error)
        for inner in node.walk():
            if inner is not node and inner.tag in _COUNTED:
                self.notes.left_out[inner.tag, f"stands in a {node.tag} that cannot be read"] += 1

    def _count(self, node: Node, reason: str) -> None:
        """Count everything drawable in and below an element as left out."""
        for inner in node.walk():
            if inner.tag in _COUNTED:
                self.notes.left_out[inner.tag, reason] += 1

    def _spend(self, cost: int, node: Node) -> None:
        """Add to the cost of what is drawn through `use`; DrawingError beyond MAX_USED."""
        self._by_use += cost
        if self._by_use > MAX_USED:
            raise DrawingError(
                f"more than {MAX_USED} elements and curves are drawn through use", where=node.label
            )


def _cost(subpaths: list[Subpath]) -> int:
    """Return the cost of drawing subpaths: 1 for each curve, and 1 for every _CORNERS_A_UNIT
    corners."""
    segments = [segment for one in subpaths for segment in one.segments]
    corners = sum(len(segment.points) for segment in segments if isinstance(segment, SvgLines))
    curves = sum(not isinstance(segment, SvgLines) for segment in segments)
    return curves + corners // _CORNERS_A_UNIT


# What the walk over an SVG document counts: used, left out, drawn otherwise than shown.


class Notes(Struct):
    """Counts of elements by kind and reason; of faults the text of the first of each kind is
    kept."""

    used: Counter[str] = field(default_factory=Counter)
    left_out: Counter[tuple[str, str]] = field(default_factory=Counter)
    changed: Counter[tuple[str, str]] = field(default_factory=Counter)
    fonts: Counter[str] = field(default_factory=Counter)
    _faults: Counter[tuple[str, str]] = field(default_factory=Counter)
    _first: dict[tuple[str, str], str] = field(default_factory=dict)

    def fault(self, kind: str, outcome: str, node: Node, fault: DrawingError | str) -> None:
        """Count an element whose numbers are wrong; `outcome` says what became of it ("cannot be
        read")."""
        self._faults[kind, outcome] += 1
        if (kind, outcome) not in self._first:
            text = str(fault)
            self._first[kind, outcome] = f"{node.label}: {text}"

    def skipped(self) -> list[Skipped]:
        """Return the counts of elements that were left out, by kind and reason."""
        faults = [
            Skipped(kind, count, f"{outcome} ({self._first[kind, outcome]})")
            for (kind, outcome), count in self._faults.items()
        ]
        return faults + [Skipped(kind, n, reason) for (kind, reason), n in self.left_out.items()]

    def findings(self) -> list[Finding]:
        """Return NOT_APPLIED for each kind of property that changes the look and was not applied,
        and the findings about missing fonts."""
        applied = [
            NOT_APPLIED(measured=count, what=subject, why=reason)
            for (subject, reason), count in self.changed.items()
        ]  # fmt: skip
        return applied + font_findings(self.fonts)


# Subpaths in user units to vertices in mm: lines and circles exact, other curves fitted.
#
# An ellipse under an affine map is an ellipse. With its half axes u, v as complex numbers,
#
#     u·cos t + v·sin t = p·e^{it} + q·e^{−it},   p = (u − iv)/2,   q = (u + iv)/2,
#
# its longest and shortest half axes are |p| + |q| and ||p| − |q||; it is a circle when p or q is
# 0: run through with t when q is, against it when p is.

ROUND_EPS_MM = POSITION_EPS_MM
"""An ellipse whose half axes differ by less is a circle."""


MAX_CURVE_MM = 1e6
"""A curve that extends farther is left out: its fit to micrometres would take millions of arcs."""


Fitted = tuple[Floats, Floats | None]
"""Vertices (n, 3), and the errors `off_mm` (n, 2) of a `Piece` with these vertices."""


class CurveFitter:
    """Converts subpaths from user units to vertices in mm, curves fitted within one tolerance.

    With `box_only`, a Bézier curve whose control points lie within the box of the curves before it
    is replaced by its chord: it lies in the convex hull of its control points, and so does not
    enlarge the box. Of 900 such curves 24 are fitted."""

    def __init__(self, tolerance_mm: float, *, box_only: bool = False) -> None:
        self.tolerance_mm = tolerance_mm
        self._box_only = box_only
        self._low, self._high = np.full(2, np.inf), np.full(2, -np.inf)

    def vertices(self, subpath: Subpath, to_mm: Affine) -> Fitted:
        """Return the vertices (n, 3) of a subpath in mm, the last one its end, and how far the
        curves lie from the arcs.

        DrawingError when it reaches out of bounds."""
        first = subpath.segments[0]
        if len(subpath.segments) == 1 and isinstance(first, SvgLines):
            points = np.concatenate([subpath.start[None, :], first.points])
            return _in_reach(_straight(to_mm, points)), None
        rows, errors = [_straight(to_mm, subpath.start[None, :])], [np.zeros((1, 2))]
        for segment in subpath.segments:
            piece, error = self._segment(rows[-1][-1, :2], segment, to_mm)
            # The segment begins at the last vertex so far, which therefore takes the segment's
            # bulge.
            rows[-1][-1, 2] = piece[0, 2]
            rows.append(piece[1:])
            if error is None:
                errors.append(np.zeros((len(piece) - 1, 2)))
            else:
                errors[-1][-1] = error[0]
                errors.append(error[1:].copy())
        return _in_reach(np.concatenate(rows)), np.concatenate(errors)

    def _segment(self, start: Floats, segment: Segment, to_mm: Affine) -> Fitted:
        """Return the vertices (n, 3) of a segment from `start` (2,) mm to its end, both exact."""
        if isinstance(segment, SvgLines):
            points = _straight(to_mm, segment.points)
            return np.concatenate([[[start[0], start[1], 0.0]], points]), None
        if isinstance(segment, Bezier):
            control = np.concatenate([start[None, :], to_mm.points(segment.control)])
            if self._box_only and self._is_in_box(control):
                return _chord(control), None
            return self._fitted(BezierCurve(control), control)
        ends = np.array([start, to_mm.points(segment.end[None, :])[0]])
        centre = to_mm.points(segment.centre[None, :])[0]
        u, v = to_mm.vectors(np.array([segment.u, segment.v]))
        circle = _circle(centre, u, v, segment)
        if circle is not None:
            return _with_ends(circle, ends), None
        curve = EllipseCurve(centre, u, v, segment.begin, segment.begin + segment.sweep)
        bounds = np.array([centre, np.abs(u) + np.abs(v)])
        vertices, errors = self._fitted(curve, bounds)
        return _with_ends(vertices, ends), errors

    def _is_in_box(self, control: Floats) -> bool:
        """Return True if the control points (n, 2) lie within the box so far; if not, enlarge the
        box by the ends of their curve.

        A curve that is shorter than a position may be left out, and so does not enlarge it."""
        low, high = control.min(axis=0), control.max(axis=0)
        is_within = bool((low >= self._low).all() and (high <= self._high).all())
        if not is_within and (high - low).max() > POSITION_EPS_MM:
            ends = control[[0, -1]]
            self._low = np.minimum(self._low, ends.min(axis=0))
            self._high = np.maximum(self._high, ends.max(axis=0))
        return is_within

    def _fitted(self, curve: Curve, bounds: Floats) -> Fitted:
        """Return arcs that fit a curve; `bounds` (n, 2) are points, mm, that bound its place and
        size."""
        _in_reach(bounds, MAX_CURVE_MM)
        try:
            fit = fit_curve(curve, self.tolerance_mm)
        except GeometryError as error:
            raise DrawingError(f"a curve cannot be fitted: {error.message}") from error
        if len(fit.vertices) > 1:
            return fit.vertices, fit.off_mm
        return np.repeat(fit.vertices, 2, axis=0), None


def _chord(control: Floats) -> Floats:
    """Return the vertices (2, 3) of the line from the first to the last of control points (n,
    2)."""
    vertices = np.zeros((2, 3))
    vertices[:, :2] = control[[0, -1]]
    return vertices


def _straight(to_mm: Affine, points: Floats) -> Floats:
    """Return points (n, 2) in user units as vertices (n, 3) of lines in mm."""
    vertices = np.zeros((len(points), 3))
    vertices[:, :2] = to_mm.points(points)
    return vertices


def _in_reach(vertices: Floats, limit_mm: float = MAX_COORDINATE_MM) -> Floats:
    """Return the vertices unchanged; DrawingError if one is farther away than the limit."""
    furthest = float(np.abs(vertices).max())
    if not furthest <= limit_mm:
        raise DrawingError(
            f"it reaches {furthest:.6g} mm away, too far to be exact to a micrometre",
            mend="name the unit with --units",
        )
    return vertices


def _circle(centre: Floats, u: Floats, v: Floats, arc: Arc) -> Floats | None:
    """Return the vertices of the arc of an ellipse if its map to mm makes it circular, else
    None."""
    u_axis, v_axis = complex(*u), complex(*v)
    p, q = (u_axis - 1j * v_axis) / 2.0, (u_axis + 1j * v_axis) / 2.0
    if 2.0 * min(abs(p), abs(q)) > ROUND_EPS_MM:
        return None
    if abs(q) <= abs(p):
        return arc_vertices(centre, abs(p), cmath.phase(p) + arc.begin, arc.sweep)
    return arc_vertices(centre, abs(q), cmath.phase(q) - arc.begin, -arc.sweep)


def _with_ends(vertices: Floats, ends: Floats) -> Floats:
    """Return a copy of the vertices with the first and last point set to `ends` (2, 2): rounding
    had moved them."""
    exact = vertices.copy()
    exact[[0, -1], :2] = ends
    return exact
