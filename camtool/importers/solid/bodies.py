"""Solid models to bodies with their names and colours: STEP, BREP, and build123d scripts.

`TopoDS_Shape` and all else of OpenCASCADE has no types for Python: it is `Any` here."""

from __future__ import annotations

import re
import sys
import traceback
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

from msgspec import Struct

from camtool.errors import DrawingError

_NO_NAME = re.compile(
    r"(?:COMPOUND|COMPSOLID|SOLID|SHELL|FACE|WIRE|EDGE|VERTEX|Open[_ ]CASCADE.*)?", re.DOTALL
)
"""The name that OpenCASCADE writes for a shape without a name."""


class Body(Struct, frozen=True, eq=False):
    """A part to be outlined, a `TopoDS_Shape`, with its layer and colour: a solid, or a shell,
    face, wire or edge that belongs to none."""

    shape: Any
    layer: str
    colour: str


def shape_bodies(shape: Any) -> list[Body]:
    """Return the bodies of a build123d shape, with the names and colours that its tree gives
    them."""
    return _tree_bodies(shape.wrapped, shape, "0", "")


def _tree_bodies(topods: Any, shape: Any, layer: str, colour: str) -> list[Body]:
    """Return the bodies of a shape of build123d and of its children, with its own label and colour
    or the inherited ones.

    `topods` is the same shape at its place in the whole: children of build123d do not move with
    their parent."""
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
    """Return all solids of a shape, and the shells, faces, wires and edges that belong to none."""
    from OCP.TopAbs import TopAbs_EDGE, TopAbs_FACE, TopAbs_SHELL, TopAbs_SOLID, TopAbs_WIRE

    kinds = (TopAbs_SOLID, TopAbs_SHELL, TopAbs_FACE, TopAbs_WIRE, TopAbs_EDGE)
    parts = subshapes(shape, TopAbs_SOLID)
    for above, kind in pairwise(kinds):
        parts.extend(subshapes(shape, kind, above))
    return [part for part in parts if has_edges(part)]


def subshapes(shape: Any, kind: Any, outside: Any = None) -> list[Any]:
    """Return all parts of a shape that are of this kind (`TopAbs_FACE` …), each once; none that
    lies within a part of the kind `outside`."""
    from OCP.TopAbs import TopAbs_SHAPE
    from OCP.TopExp import TopExp_Explorer

    parts_by_hash: dict[int, list[Any]] = {}
    parts: list[Any] = []
    explorer = TopExp_Explorer(shape, kind, TopAbs_SHAPE if outside is None else outside)
    while explorer.More():
        part = explorer.Current()
        twins = parts_by_hash.setdefault(hash(part), [])
        if not any(part.IsSame(other) for other in twins):
            twins.append(part)
            parts.append(_as_own_class(part))
        explorer.Next()
    return parts


def has_edges(shape: Any) -> bool:
    """Return True if the shape has an edge, so that something can be drawn."""
    from OCP.TopAbs import TopAbs_EDGE
    from OCP.TopExp import TopExp_Explorer

    return bool(TopExp_Explorer(shape, TopAbs_EDGE).More())


def layer_of(label: object) -> str:
    """Return the layer that a label names; "" for an empty one."""
    text = "".join(sign if sign.isprintable() else "_" for sign in str(label or "")).strip()
    return "" if _NO_NAME.fullmatch(text) else text


def colour_of(colour: Any) -> str:
    """Return "#rrggbb" of a `Quantity_Color`.

    Its channels are linear: sRGB is 1.055 c^(1/2.4) − 0.055."""
    parts = [
        12.92 * part if part <= 0.0031308 else 1.055 * part ** (1.0 / 2.4) - 0.055
        for part in (colour.Red(), colour.Green(), colour.Blue())
    ]
    return "#{:02x}{:02x}{:02x}".format(*(min(max(round(255.0 * c), 0), 255) for c in parts))


def _as_own_class(shape: Any) -> Any:
    """Return the shape cast to the class of its kind (Face, Edge …), whose functions have other
    names since version 8 of the binding."""
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


# STEP and BREP files, by OpenCASCADE alone.
#
# It is the kernel under build123d, which itself takes four times as long to load.

_AGAIN = "export it again as STEP (AP214 or AP242)"

MAX_DEPTH = 100
"""Largest depth of nested assemblies; a deeper one contains itself."""


def load_step(path: str) -> list[Body]:
    """Return the bodies of a STEP file in mm, at their places in its assemblies."""
    from OCP.IFSelect import IFSelect_ReturnStatus
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document

    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    reader = STEPCAFControl_Reader()
    reader.SetNameMode(True)
    reader.SetColorMode(True)
    if reader.ReadFile(path) != IFSelect_ReturnStatus.IFSelect_RetDone or not reader.Transfer(
        document
    ):
        raise DrawingError("cannot be read: its structure is damaged", mend=_AGAIN)
    return _Tree(document).bodies()


def load_brep(path: str) -> list[Body]:
    """Return the bodies of a BREP file, text or binary."""
    from OCP.BinTools import BinTools
    from OCP.BRep import BRep_Builder
    from OCP.BRepTools import BRepTools
    from OCP.TopoDS import TopoDS_Shape

    shape = TopoDS_Shape()
    with open(path, "rb") as stream:  # noqa: PTH123 - a name as OpenCASCADE takes it
        binary = b"Open CASCADE Topology" in stream.read(64)
    read = (
        BinTools.Read_s(shape, path) if binary else BRepTools.Read_s(shape, path, BRep_Builder())
    )
    if not read or shape.IsNull():
        raise DrawingError("cannot be read: its structure is damaged", mend=_AGAIN)
    return [Body(part, "0", "") for part in parts_in(shape)]


class _Tree:
    """The tree of parts in a document of OpenCASCADE's extended data framework."""

    def __init__(self, document: Any) -> None:
        from OCP.XCAFDoc import XCAFDoc_DocumentTool

        self.shapes = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        self.colours = XCAFDoc_DocumentTool.ColorTool_s(document.Main())

    def bodies(self) -> list[Body]:
        from OCP.TopLoc import TopLoc_Location

        labels = _labels()
        self.shapes.GetFreeShapes(labels)
        return self._all(labels, TopLoc_Location(), "0", "", 0)

    def _all(self, labels: Any, place: Any, layer: str, colour: str, depth: int) -> list[Body]:
        if depth > MAX_DEPTH:
            raise DrawingError(f"has assemblies nested deeper than {MAX_DEPTH}", mend=_AGAIN)
        return [
            body
            for index in range(1, labels.Length() + 1)
            for body in self._one(labels.Value(index), place, layer, colour, depth)
        ]

    def _one(self, label: Any, place: Any, layer: str, colour: str, depth: int) -> list[Body]:
        """Return the bodies of one part or assembly, with its own name and colour or the inherited
        ones."""
        from OCP.TDF import TDF_Label

        original = label
        if self.shapes.IsReference_s(label):
            original = TDF_Label()
            self.shapes.GetReferredShape_s(label, original)
            place = place.Multiplied(self.shapes.GetLocation_s(label))
        layer = layer_of(_name(original)) or layer
        colour = self._colour(label) or self._colour(original) or colour
        if self.shapes.IsAssembly_s(original):
            parts = _labels()
            self.shapes.GetComponents_s(original, parts)
            return self._all(parts, place, layer, colour, depth + 1)
        shape = self.shapes.GetShape_s(original)
        if shape.IsNull():
            return []
        return [
            Body(part.Moved(place), layer, self._shape_colour(part) or colour)
            for part in parts_in(shape)
        ]

    def _colour(self, label: Any) -> str:
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorTool, XCAFDoc_ColorType

        colour = Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorGen, XCAFDoc_ColorType.XCAFDoc_ColorSurf):
            if XCAFDoc_ColorTool.GetColor_s(label, kind, colour):
                return colour_of(colour)
        return ""

    def _shape_colour(self, shape: Any) -> str:
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorType

        colour = Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorGen, XCAFDoc_ColorType.XCAFDoc_ColorSurf):
            if self.colours.GetColor(shape, kind, colour):
                return colour_of(colour)
        return ""


def _labels() -> Any:
    """Return an empty list of labels, under the name that the binding gives it since version 8."""
    try:
        from OCP.collections import Sequence_TDF_Label as Labels
    except ImportError:
        from OCP.TDF import TDF_LabelSequence as Labels
    return Labels()


def _name(label: Any) -> str:
    from OCP.TCollection import TCollection_AsciiString
    from OCP.TDataStd import TDataStd_Name

    name = TDataStd_Name()
    if not label.FindAttribute(TDataStd_Name.GetID_s(), name):
        return ""
    return str(TCollection_AsciiString(name.Get()).ToCString())


# Scripts. A build123d script is run, and what it leaves is the model.
#
# It may leave `part`, `sketch` or `result`: a shape, a list of shapes, or one of the builders.
# `__name__` is not "__main__", so that what a script does only when it is started itself (showing
# the part, writing files) is left out. All this happens in a process of its own.

RESULTS = ("part", "sketch", "result")
"""Names of the variable in which a script may leave its model; the first that is set counts."""

_MEND = "correct the script"


def run_script(data: bytes, file: str) -> list[Body]:
    """Run a build123d script and return the bodies that it leaves; DrawingError, with its line,
    when it fails."""
    names: dict[str, Any] = {"__name__": "camtool_script", "__file__": file}
    if Path(file).is_file():  # a script can import modules beside it
        sys.path.insert(0, str(Path(file).resolve().parent))
    sys.argv[:] = [file]
    try:
        exec(compile(data, file, "exec"), names)
    except SystemExit as error:
        # A script that calls sys.exit() without an error has finished.
        if error.code not in (None, 0):
            raise _script_error(f"ended itself: {error.code}", error, file) from error
    except SyntaxError as error:
        where = f"line {error.lineno}" if error.lineno else None
        raise DrawingError(f"is no Python: {error.msg}", where=where, mend=_MEND) from error
    # Any exception is a fault of the script.
    except Exception as error:
        if is_missing(error):
            raise
        error_text = f"{type(error).__name__}: {error}".rstrip(": ")
        raise _script_error(f"stopped with {error_text}", error, file) from error
    return _bodies_of_result(names)


def is_missing(error: Exception) -> bool:
    """Return True if build123d, or OpenCASCADE below it, is not installed or cannot be loaded."""
    name = error.name if isinstance(error, ImportError) else None
    return (name or "").partition(".")[0] in ("build123d", "OCP")


def _script_error(message: str, error: BaseException, file: str) -> DrawingError:
    """Return the error for a script that failed, with the number of its last line that was being
    run."""
    lines = [
        frame.lineno
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == file
    ]
    return DrawingError(message, where=f"line {lines[-1]}" if lines else None, mend=_MEND)


def _bodies_of_result(names: dict[str, Any]) -> list[Body]:
    """Return the bodies of the first variable among RESULTS that the script has set; DrawingError
    when there is none."""
    name = next((name for name in RESULTS if names.get(name) is not None), None)
    if name is None:
        raise DrawingError(
            "the script leaves no model",
            mend=f"let it assign {', '.join(RESULTS[:-1])} or {RESULTS[-1]} outside of functions "
            "and of `if __name__ == ...`",
        )
    try:
        shapes = shapes_in(names[name])
    except TypeError as error:
        raise DrawingError(
            f"{name} is of type {error}, no shape",
            mend="let it be a shape, a list of shapes or a builder of build123d",
        ) from error
    bodies = [body for shape in shapes for body in shape_bodies(shape)]
    if not bodies:
        raise DrawingError(f"{name} is empty", mend=_MEND)
    return bodies


def shapes_in(value: Any) -> list[Any]:
    """Return the shapes in a builder, a shape or a list of them; TypeError, which names the type,
    for anything else."""
    from build123d import BuildLine, BuildPart, BuildSketch, Shape

    for builder, inside in ((BuildPart, "part"), (BuildSketch, "sketch"), (BuildLine, "line")):
        if isinstance(value, builder):
            inner = getattr(value, inside)
            return [] if inner is None else shapes_in(inner)
    if isinstance(value, Shape):
        return [value] if value else []  # an empty one has no shape of OpenCASCADE
    if isinstance(value, list | tuple):
        return [shape for item in value for shape in shapes_in(item)]
    raise TypeError(type(value).__name__)
