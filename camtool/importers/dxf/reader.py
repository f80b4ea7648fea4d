"""DXF drawings, ASCII and binary, of any version that ezdxf knows: what a space of them shows.

    bytes ──load──▶ document ──DxfWalk of model space or a layout──▶ pieces ──assemble──▶ Drawing

What cannot be used is counted with a reason: layers that are off or frozen, kinds without lines,
entities that lack what they need."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from msgspec.structs import asdict

from camtool.errors import DrawingError
from camtool.findings import Finding, Severity
from camtool.geometry.drawing import Drawing, Skipped, Units
from camtool.importers.assemble import Found, assemble, font_findings
from camtool.importers.dxf.load import Loaded, load, quiet, without_collector
from camtool.importers.dxf.walk import DxfWalk
from camtool.importers.findings import (
    CALLOUT_NOT_READ,
    FILE_REPAIRED,
    NOT_APPLIED_TO_ENTITY,
    UNIT_GUESSED,
    UNITLESS,
)
from camtool.importers.options import ReadOptions

REPAIRS_NAMED = 3


def read(data: bytes, file: str, options: ReadOptions) -> Drawing:
    """Return the Drawing in model space or in `options.layout`; DrawingError naming layer and
    entity when it cannot be read."""
    with without_collector():
        loaded = load(data, file, plain=options.layout is None)
        content = walk_space(
            loaded, layout_of(loaded.document, options.layout, file), file, options
        )
    del loaded  # what the file holds is in the pieces now
    return assemble(file=file, options=options, **asdict(content))


def walk_space(loaded: Loaded, space: Any, file: str, options: ReadOptions) -> Found:
    """Return the pieces, marks and callouts of model space or a layout of a document; DrawingError
    as `read`."""
    units, findings = units_of(loaded.header, options)
    walk = DxfWalk(loaded, file, options)
    with quiet():
        walk.space(space, units.mm_per_unit)
    return Found(
        walk.pieces,
        units,
        marks=walk.marks,
        callouts=walk.callouts,
        used=dict(walk.used),
        skipped=[Skipped(kind, count, reason) for (kind, reason), count in walk.skipped.items()],
        findings=[
            *_repair_findings(loaded.repairs),
            *findings,
            *_not_applied_findings(walk.lacking),
            *_not_callouts(walk.unread),
            *font_findings(walk.fonts),
        ],
    )


def layout_of(document: Any, layout: str | None, file: str) -> Any:
    """Return model space, or the layout with this name, upper or lower case; DrawingError if there
    is none."""
    if layout is None:
        return document.modelspace()
    named = {str(space.name).casefold(): space for space in document.layouts}
    if layout.casefold() not in named:
        names = ", ".join(str(space.name) for space in document.layouts)
        raise DrawingError(f"has no layout {layout!r}", file=file, mend=f"use one of {names}")
    return named[layout.casefold()]


def _repair_findings(repairs: tuple[str, ...]) -> list[Finding]:
    """Return one finding for all repairs, which quotes the first REPAIRS_NAMED of them."""
    if not repairs:
        return []
    extra = len(repairs) - REPAIRS_NAMED
    text = "; ".join(" ".join(message.split()) for message in repairs[:REPAIRS_NAMED])
    return [FILE_REPAIRED(measured=len(repairs), repairs=text, more=max(extra, 0))]


def _not_applied_findings(lacking: Counter[tuple[str, str]]) -> list[Finding]:
    """Return a finding for each kind of property that was not applied to entities."""
    return [
        NOT_APPLIED_TO_ENTITY(measured=count, kind=kind, what=subject)
        for (kind, subject), count in lacking.items()
    ]


def _not_callouts(unread: Counter[tuple[str, str]]) -> list[Finding]:
    """Return a finding for each kind of dimension that cannot be inspected, with the reason and
    the number."""
    return [
        CALLOUT_NOT_READ(measured=count, kind=kind, reason=reason)
        for (kind, reason), count in unread.items()
    ]


# The unit of a DXF drawing: as the caller says, else as the header itself says.
#
# $INSUNITS names it. Where that is missing or 0, $MEASUREMENT (0 inches, 1 metric: what new
# drawings of the program are in) is the best hint there is, and a finding says so. ezdxf's
# defaults for what a header leaves out count for nothing.

_MM_PER_INSUNIT = {
    1: ("in", 25.4),
    2: ("ft", 304.8),
    4: ("mm", 1.0),
    5: ("cm", 10.0),
    6: ("m", 1000.0),
    8: ("µin", 25.4e-6),
    9: ("mil", 0.0254),
    10: ("yd", 914.4),
    12: ("nm", 1e-6),
    13: ("µm", 1e-3),
    14: ("dm", 100.0),
    21: ("US ft", 1200.0 / 3.937),
    22: ("US in", 100.0 / 3.937),
    23: ("US yd", 3600.0 / 3.937),
}
"""$INSUNITS that a part may be drawn in (DXF reference, header variables)."""

_NO_PART = {
    3: "miles",
    7: "km",
    11: "ångström",
    15: "decametres",
    16: "hectometres",
    17: "gigametres",
    18: "astronomical units",
    19: "light years",
    20: "parsecs",
    24: "US miles",
}
"""$INSUNITS in which no part is drawn."""

_GUESSES = {0: ("in", 25.4, "inches", Severity.WARNING), 1: ("mm", 1.0, "metric", Severity.INFO)}
"""$MEASUREMENT, and how much is at stake when the guess is wrong."""


def units_of(header: Mapping[str, Any], options: ReadOptions) -> tuple[Units, list[Finding]]:
    """Return the unit of the drawing, and a finding if the file does not state it."""
    code, measurement = (
        _header_number(header.get(name)) for name in ("$INSUNITS", "$MEASUREMENT")
    )
    file_says = "no $INSUNITS" if code is None else f"$INSUNITS {code}"
    if options.units is not None:
        unit = options.units.lower()
        return Units(unit, options.mm_per(unit), f"as asked; the file says {file_says}"), []
    if code in _MM_PER_INSUNIT:
        return Units(*_MM_PER_INSUNIT[code], file_says), []
    if not code and measurement in _GUESSES:
        name, mm, meaning, severity = _GUESSES[measurement]
        reason = f"{file_says}, but $MEASUREMENT {measurement} ({meaning})"
        return Units(name, mm, reason), [UNIT_GUESSED(severity=severity, why=reason, taken=name)]
    if code in _NO_PART:
        file_says = f"{file_says} ({_NO_PART[code]}, in which no part is drawn)"
    elif code:
        file_says = f"{file_says}, which is no unit"
    return Units("mm", 1.0, f"taken as mm: {file_says}"), [UNITLESS(said=file_says)]


def _header_number(value: Any) -> int | None:
    """Return the value of a header variable as an integer; None when the file does not give
    one."""
    try:
        return int(float(value))
    except (TypeError, ValueError, OverflowError):
        return None
