"""DIMENSION entities of DXF drawings as callouts: what they measure, their text and its limits.

    group codes 13 14 · 10 15 ──frame──▶ places in mm, what they measure
    1 (text), DIMPOST ──plain_text──▶ the text without its codes
    DIMTOL DIMLIM DIMTP DIMTM of the style, over them those of the entity ──▶ deviations

Numbers of a text and of a style are in the unit in which the dimension shows what it measures:
that of the drawing, times DIMLFAC and the scale of the blocks that it stands in. Where this is
neither the unit of the drawing nor mm nor inches, the dimension belongs to a view of another scale
(`Callout.scale`). DIMLFAC does not apply to DIMTP and DIMTM (AutoCAD's help on DIMLFAC)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.drawing import Callout
from camtool.geometry.polylines import POSITION_EPS_MM
from camtool.importers.dxf.load import printable
from camtool.importers.dxf.shapes import WorldMap, require
from camtool.importers.pieces import Unusable

SCALE_SHARE = 1e-3
"""DIMLFAC is often rounded: units that differ by less than this share are one."""

MAX_TEXT_LENGTH = 2000

_ROTATED, _ALIGNED, _DIAMETER, _RADIUS = 0, 1, 3, 4
_TYPE = 0x0F
_NOT_READ = {2: "is an angle", 5: "is an angle", 6: "is an ordinate", 8: "is the length of an arc"}
_VALUES = {
    3: "dimpost",
    47: "dimtp",
    48: "dimtm",
    71: "dimtol",
    72: "dimlim",
    144: "dimlfac",
    147: "dimgap",
}
"""Group codes of the values of a style that matter here (DXF reference, DIMSTYLE)."""


def callout(
    entity: Any, frame: WorldMap, mm_per_unit: float, *, layer: str, source: str, paper: bool
) -> Callout:
    """Return the callout of a DIMENSION in mm; Unusable, with the reason, for one that cannot be
    inspected.

    `mm_per_unit`: the unit of the drawing. `paper`: it is in a layout, where a negative DIMLFAC
    applies too."""
    kind, places, direction = _measured_places(entity)
    plane = frame.plane(entity.dxf.extrusion, 0.0)
    if not plane.scale:
        raise Unusable("stands in a block of unequal scales")
    first, second = frame.flat(np.array(places, dtype=np.float64))
    span = second - first
    angle = None
    if direction is not None:
        along = np.asarray(math.cos(direction) * plane.u + math.sin(direction) * plane.v)
        along = along / math.hypot(*along)
        angle = math.atan2(along[1], along[0]) % math.pi
        measured_mm = abs(float(span @ along))
    else:
        measured_mm = math.hypot(*span)
    if not POSITION_EPS_MM < measured_mm < math.inf:
        raise Unusable("measures nothing")
    style = _style(entity)
    unit_mm, scale = _unit(_factor(style, paper), plane.scale, mm_per_unit)
    upper_mm, lower_mm = _deviations(style, unit_mm)
    return Callout(
        kind=kind,
        points_mm=(_place(first), _place(second)),
        measured_mm=measured_mm,
        text=_text(entity, style),
        layer=layer,
        source=source,
        direction_rad=angle,
        upper_mm=upper_mm,
        lower_mm=lower_mm,
        mm_per_unit=unit_mm,
        scale=scale,
        exact=_number(style, "dimgap", 0.0) < 0.0,
    )


def _place(point: Floats) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _measured_places(
    entity: Any,
) -> tuple[Literal["linear", "diameter", "radius"], list[Any], float | None]:
    """Return the kind of a dimension, the two points between which it measures (world units), and
    the angle along which it measures.

    The angle, rad in the plane of the dimension, is None if it measures the distance of the
    points."""
    dxf = entity.dxf
    if entity.is_dimensional_constraint:
        raise Unusable("is a constraint")
    if entity.dxftype() == "LARGE_RADIAL_DIMENSION":
        # Group 15 is the place on the arc, though ezdxf calls it jog point: in files of AutoCAD it
        # is as far from the centre as group 42 says.
        require(entity, ("defpoint", "jog_point"))
        return "radius", [dxf.defpoint, dxf.jog_point], None
    kind = int(dxf.dimtype) & _TYPE
    if entity.dxftype() == "ARC_DIMENSION":
        raise Unusable(_NOT_READ[8])
    if kind in (_ROTATED, _ALIGNED):
        require(entity, ("defpoint2", "defpoint3"))
        direction = math.radians(dxf.angle) if kind == _ROTATED else None
        if direction is not None and not math.isfinite(direction):
            raise Unusable("has an angle that is not finite")
        return "linear", [dxf.defpoint2, dxf.defpoint3], direction
    if kind in (_DIAMETER, _RADIUS):
        require(entity, ("defpoint", "defpoint4"))
        return ("diameter" if kind == _DIAMETER else "radius", [dxf.defpoint, dxf.defpoint4], None)
    raise Unusable(_NOT_READ.get(kind, "is of a type that is not known"))


def _style(entity: Any) -> dict[str, Any]:
    """Return the values of a dimension's style by name, overridden by those of the entity itself
    (the list DSTYLE in its extended data of ACAD)."""
    values: dict[str, Any] = {}
    name = entity.dxf.dimstyle
    styles = entity.doc.dimstyles
    if styles.has_entry(name):
        attributes = vars(styles.get(name).dxf)
        values = {key: attributes[key] for key in _VALUES.values() if key in attributes}
    if entity.has_xdata_list("ACAD", "DSTYLE"):
        # {code of the value, value}, between braces that ezdxf takes away or not.
        tags = [tag for tag in entity.get_xdata_list("ACAD", "DSTYLE") if tag.code != 1002]
        if tags and tags[0].value == "DSTYLE":
            tags = tags[1:]
        for key, value in zip(tags[::2], tags[1::2], strict=False):
            if key.value in _VALUES:
                values[_VALUES[key.value]] = value.value
    return values


def _number(style: Mapping[str, Any], name: str, otherwise: float) -> float:
    """Return a value of the style, or `otherwise` where it has none; Unusable if it is no finite
    number."""
    try:
        value = float(style.get(name, otherwise))
    except (TypeError, ValueError, OverflowError):
        value = math.nan
    if not math.isfinite(value):
        raise Unusable(f"has {name.upper()} that is no number")
    return value


def _factor(style: Mapping[str, Any], paper: bool) -> float:
    """Return DIMLFAC, by which shown lengths are larger than measured ones.

    A negative one applies in layouts (`paper`) only; 0 counts as 1."""
    factor = _number(style, "dimlfac", 1.0)
    if factor < 0.0:
        factor = -factor if paper else 1.0
    return factor or 1.0


def _unit(factor: float, own_mm: float, mm_per_unit: float) -> tuple[float, float]:
    """Return the unit, mm, of the dimension's numbers, and how many times larger than drawn they
    say things are.

    `factor` is DIMLFAC, `own_mm` the length of a unit where the dimension stands, scaled by its
    blocks."""
    shown_mm = own_mm / factor
    for unit_mm in (mm_per_unit, 1.0, 25.4):
        if abs(shown_mm / unit_mm - 1.0) <= SCALE_SHARE:
            return unit_mm, 1.0
    return mm_per_unit, mm_per_unit / shown_mm


def _deviations(style: Mapping[str, Any], unit_mm: float) -> tuple[float | None, float | None]:
    """Return the upper and lower deviation, mm; None, None where the style shows none. DIMTM
    counts downwards."""
    if not (_number(style, "dimtol", 0.0) or _number(style, "dimlim", 0.0)):
        return None, None
    upper, lower = _number(style, "dimtp", 0.0), -_number(style, "dimtm", 0.0)
    return round(upper * unit_mm, 9) + 0.0, round(lower * unit_mm, 9) + 0.0


def _text(entity: Any, style: Mapping[str, Any]) -> str:
    """Return the text of a dimension without codes, with "<>" for the measured value; "" where it
    shows only that value."""
    raw = str(entity.dxf.get("text", ""))
    post = str(style.get("dimpost", "") or "")
    if len(raw) + len(post) > MAX_TEXT_LENGTH:
        raise Unusable(f"has a text of more than {MAX_TEXT_LENGTH} characters")
    if raw and not raw.strip():
        raise Unusable("shows no text")
    from camtool.importers.dxf.mtext import plain_text

    # Text after [] is for alternative units.
    shown, _, _ = post.partition("[]")
    replacement = shown if "<>" in shown else f"<>{shown}"
    text = (raw or "<>").replace("<>", replacement).replace("[]", "")
    content = " ".join(printable(plain_text(text)).split())
    return "" if content == "<>" else content
