"""What becomes of each kind of DXF entity: its reader, the parts it is made of, or why not."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from camtool.importers.dxf.areas import face, hatch, solid
from camtool.importers.dxf.curves import outline, spline
from camtool.importers.dxf.frames import Frame, Shape, Unusable
from camtool.importers.dxf.shapes import Reader, arc, circle, ellipse, line, lwpolyline, polyline

READERS: dict[str, Reader] = {
    "3DFACE": face,
    "ARC": arc,
    "CIRCLE": circle,
    "ELLIPSE": ellipse,
    "HATCH": hatch,
    "HELIX": spline,
    "LINE": line,
    "LWPOLYLINE": lwpolyline,
    "MPOLYGON": hatch,
    "POLYLINE": polyline,
    "SOLID": solid,
    "SPLINE": spline,
    "TRACE": solid,
}
"""Kinds that have a shape of their own."""

TEXTS = frozenset(("TEXT", "MTEXT", "ATTRIB", "ATTDEF"))
"""Kinds that are read as the caller wants text."""

DIMENSIONS = frozenset(
    (
        "DIMENSION",
        "ARC_DIMENSION",
        "LARGE_RADIAL_DIMENSION",
        "LEADER",
        "MLEADER",
        "MULTILEADER",
        "ACAD_TABLE",
    )
)
"""Kinds that annotate; read when the caller wants dimensions."""

COMPOUNDS = frozenset(("MLINE", "ACAD_PROXY_ENTITY"))
"""Kinds that are read by the parts they are drawn with."""

DIMENSION_SKIPPED = "is an annotation: read its lines with --dimensions"

_SOLID = "is a 3D shape: export it as STEP"
_PICTURE = "is a picture"
_TEXT = "is text of a kind that camtool does not read: explode it first"
_ENDLESS = "has no end"

WHY_UNUSED = {
    **dict.fromkeys(("SHAPE", "RTEXT", "ARCTEXT"), _TEXT),
    **dict.fromkeys(("3DSOLID", "BODY", "REGION", "MESH"), _SOLID),
    **dict.fromkeys(("SURFACE", "EXTRUDEDSURFACE", "LOFTEDSURFACE"), _SOLID),
    **dict.fromkeys(("PLANESURFACE", "REVOLVEDSURFACE", "SWEPTSURFACE", "NURBSURFACE"), _SOLID),
    **dict.fromkeys(("IMAGE", "WIPEOUT", "OLE2FRAME", "OLEFRAME"), _PICTURE),
    **dict.fromkeys(("PDFUNDERLAY", "DWFUNDERLAY", "DGNUNDERLAY", "PDFREFERENCE"), _PICTURE),
    **dict.fromkeys(("XLINE", "RAY"), _ENDLESS),
    "TOLERANCE": "is an annotation",
    "VIEWPORT": "is a window of a layout",
    "LIGHT": "is a light",
    "SUN": "is a light",
}
OTHER = "is of a kind that camtool does not read"

MAX_PARTS = 10_000
"""So many parts may one entity be drawn with."""


def parts_of(entity: Any) -> list[Any]:
    """The entities that a dimension, leader, multiple line or proxy is drawn with.

    Unusable when there are none. The points that define a dimension are no part of it, nor is the
    filling between multiple lines.
    """
    left_out = {"POINT", "HATCH"} if entity.dxftype() == "MLINE" else {"POINT"}
    parts: list[Any] = []
    try:
        for part in _virtual(entity):
            if part.dxftype() not in left_out:
                parts.append(part)
            if len(parts) > MAX_PARTS:
                break
    # ezdxf draws these from data that nothing has checked.
    except Exception as error:
        raise Unusable("cannot be drawn: its data is damaged") from error
    if len(parts) > MAX_PARTS:
        raise Unusable(f"is drawn with more than {MAX_PARTS} parts")
    if not parts:
        raise Unusable("brings no lines with it")
    return parts


def _virtual(entity: Any) -> Iterable[Any]:
    if hasattr(entity, "virtual_entities"):
        found: Iterable[Any] = entity.virtual_entities()
        return found
    if hasattr(entity, "__virtual_entities__"):
        return list(entity.__virtual_entities__())
    return ()


def text_shapes(
    entity: Any, frame: Frame, tolerance_mm: float, mode: str
) -> tuple[list[Shape], str]:
    """The lines of a text in mm, and what was wanted and could not be had ("" otherwise)."""
    from camtool.importers.dxf.text import text_strokes

    text = text_strokes(entity, mode)
    shapes = [
        outline(contour.parts, contour.closed, frame, tolerance_mm)
        for contour in text.contours
        if contour.parts
    ]
    return shapes, text.lacks
