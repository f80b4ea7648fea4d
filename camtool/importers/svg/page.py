"""The page of an SVG: its unit, its size and the map from user units to mm, Y up.

The page's lower left corner is (0, 0). What decides, in this order: the caller's unit; width and
height with the viewBox; 96 px an inch. Y' = page height − Y, so a page of unknown height is
mirrored about its own zero line.

Source: Scalable Vector Graphics 1.1, 7.10 to 7.12; CSS 2.1, 4.3.2 for the units."""

from __future__ import annotations

from msgspec import Struct

from camtool.errors import DrawingError
from camtool.findings import Finding
from camtool.geometry.drawing import Units
from camtool.importers.findings import UNIT_GUESSED_BY_PROGRAM, UNITLESS_PX
from camtool.importers.options import DPI, ReadOptions
from camtool.importers.svg.css import parse_declarations
from camtool.importers.svg.shapes import FONT_UNITS, split_length
from camtool.importers.svg.style import FONT_PX
from camtool.importers.svg.transform import (
    Affine,
    SvgBox,
    parse_view_box,
    scaling,
    translation,
    view_box_map,
)
from camtool.importers.svg.tree import Node
from camtool.records import replace


class SvgPage(Struct, frozen=True):
    """The page of a drawing: `to_mm` maps user units of the root to mm; `viewport` is its width
    and height in user units, if known; and the unit, with findings about it."""

    to_mm: Affine
    viewport: tuple[float, float] | None
    units: Units
    findings: tuple[Finding, ...] = ()


class _Side(Struct, frozen=True):
    """A width or height as written: `text`, its size in mm if it has one, and its unit ("" without
    one)."""

    text: str
    size_mm: float | None
    unit: str


Writer = tuple[str, float]
"""The program that wrote a file, and its number of px per inch."""


def page_of(root: Node, options: ReadOptions, writer: Writer | None = None) -> SvgPage:
    """Return the page of the root element; DrawingError when its size or viewBox makes no sense.

    Without `options.dpi` a px has the size that the program `writer` gives it."""
    if writer is not None and options.units is None and options.dpi is None:
        options = replace(options, dpi=writer[1])
    else:
        writer = None
    width, height = (_side(root, name, options) for name in ("width", "height"))
    box = parse_view_box(root.get("viewBox"))
    if options.units is not None:
        return _page_in_unit(width, height, box, options)
    page = _by_the_file(root, (width, height), box, options)
    if writer is None or not (box is None or page.units.name == "px"):
        return page
    hint = UNIT_GUESSED_BY_PROGRAM(program=writer[0], px_an_inch=writer[1], usual=DPI)
    return replace(page, findings=(*page.findings, hint))


def _by_the_file(
    root: Node, sides: tuple[_Side, _Side], box: SvgBox | None, options: ReadOptions
) -> SvgPage:
    """Return the page according to the width, height and viewBox in the file."""
    width, height = sides
    named = width if width.size_mm is not None else height
    if named.size_mm is None:
        return _sizeless(box, options)
    reason = f'width="{width.text}" height="{height.text}"'
    findings = () if named.unit else (_unitless(f"{reason} name no unit", options),)
    units = Units(named.unit or "px", options.mm_per(named.unit or "px"), reason)
    if box is None:
        px = options.mm_per("px")
        return SvgPage(_flip(height.size_mm or 0.0) @ scaling(px, px), _size(width, height, px),
                    units, findings)  # fmt: skip
    # A missing side follows from the other one.
    if width.size_mm is None:
        width = _Side("", named.size_mm * box.width / box.height, named.unit)
    elif height.size_mm is None:
        height = _Side("", named.size_mm * box.height / box.width, named.unit)
    onto = SvgBox(0.0, 0.0, width.size_mm or 0.0, height.size_mm or 0.0)
    inner = view_box_map(box, onto, root.get("preserveAspectRatio"))
    reason += f", {inner.a:.6g} mm a user unit"
    units = Units(units.name, units.mm_per_unit, reason)
    return SvgPage(_flip(onto.height) @ inner, (box.width, box.height), units, findings)


def _page_in_unit(
    width: _Side, height: _Side, box: SvgBox | None, options: ReadOptions
) -> SvgPage:
    """Return the page in which one user unit is one of the caller's unit; the size in the file is
    ignored."""
    unit = str(options.units).lower()
    scale = options.mm_per(unit)
    viewport = _size(width, height, options.mm_per("px"))
    if box is not None:
        viewport = (box.width, box.height)
    elif viewport is None and height.size_mm is not None:
        viewport = (0.0, height.size_mm / options.mm_per("px"))
    tall = viewport[1] if viewport is not None else 0.0
    shift = translation(-box.x, -box.y) if box is not None else Affine()
    units = Units(unit, scale, f"as asked: one user unit is 1 {unit}")
    return SvgPage(_flip(tall * scale) @ scaling(scale, scale) @ shift, viewport, units)


def _sizeless(box: SvgBox | None, options: ReadOptions) -> SvgPage:
    """Return the page of a file without a size: user units are taken as px."""
    px = options.mm_per("px")
    units = Units("px", px, f"no size in the file, taken as {options.px_an_inch:g} px an inch")
    finding = _unitless("the svg has no width and height", options)
    if box is None:
        return SvgPage(_flip(0.0) @ scaling(px, px), None, units, (finding,))
    to_mm = _flip(box.height * px) @ scaling(px, px) @ translation(-box.x, -box.y)
    return SvgPage(to_mm, (box.width, box.height), units, (finding,))


def _side(root: Node, name: str, options: ReadOptions) -> _Side:
    """Return the width or height that the attribute gives, else the one that the style gives (as
    pages for the web have it)."""
    text = (
        root.get(name)
        or parse_declarations(root.get("style"), frozenset([name])).get(name, ("",))[0]
    )
    if text in ("", "auto"):
        return _Side(text, None, "")
    value, unit = split_length(text, name)
    if unit == "%":
        return _Side(text, None, unit)
    if unit in FONT_UNITS:
        value, unit = value * FONT_UNITS[unit] * FONT_PX, "px"
    if value <= 0.0:
        raise DrawingError(f"{name} is {text}: the page has no size", mend="give it a size")
    return _Side(text, value * options.mm_per(unit or "px"), unit)


def _size(width: _Side, height: _Side, px: float) -> tuple[float, float] | None:
    """Return width and height in px; None unless both are known."""
    if width.size_mm is None or height.size_mm is None:
        return None
    return width.size_mm / px, height.size_mm / px


def _flip(height_mm: float) -> Affine:
    return Affine(d=-1.0, f=height_mm)


def _unitless(reason: str, options: ReadOptions) -> Finding:
    return UNITLESS_PX(why=reason, px_an_inch=options.px_an_inch)
