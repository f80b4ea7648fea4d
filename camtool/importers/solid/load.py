"""STEP and BREP files to bodies with their names and colours, by OpenCASCADE alone.

This is the kernel under build123d, which itself takes four times as long to load.
"""

from __future__ import annotations

from typing import Any

from camtool.errors import DrawingError
from camtool.importers.solid.shapes import Body, colour_of, layer_of, parts_in

_AGAIN = "export it again as STEP (AP214 or AP242)"

MAX_DEPTH = 100
"""Assemblies are nested no deeper than this; a deeper one holds itself."""


def load_step(path: str) -> list[Body]:
    """The bodies of a STEP file in mm, at their places in its assemblies."""
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
    """The bodies of a BREP file, text or binary."""
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
        """The bodies of one part or assembly, with its own name and colour or the inherited."""
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

        found = Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorGen, XCAFDoc_ColorType.XCAFDoc_ColorSurf):
            if XCAFDoc_ColorTool.GetColor_s(label, kind, found):
                return colour_of(found)
        return ""

    def _shape_colour(self, shape: Any) -> str:
        from OCP.Quantity import Quantity_Color
        from OCP.XCAFDoc import XCAFDoc_ColorType

        found = Quantity_Color()
        for kind in (XCAFDoc_ColorType.XCAFDoc_ColorGen, XCAFDoc_ColorType.XCAFDoc_ColorSurf):
            if self.colours.GetColor(shape, kind, found):
                return colour_of(found)
        return ""


def _labels() -> Any:
    """An empty list of labels, under the name that the binding gives it since version 8."""
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
