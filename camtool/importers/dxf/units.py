"""The unit of a DXF drawing: as the caller says, else as the header itself says.

$INSUNITS names it. Where that is missing or 0, $MEASUREMENT (0 inches, 1 metric: what new drawings
of the program are in) is the best hint there is, and a finding says so. ezdxf's defaults for what
a header leaves out count for nothing.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from camtool.findings import Code, Finding, Severity
from camtool.geometry.drawing import Units
from camtool.importers.options import ReadOptions

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
"""$INSUNITS in which nobody draws a part."""

_GUESSES = {
    0: ("in", 25.4, "inches", Severity.WARNING),
    1: ("mm", 1.0, "metric", Severity.INFO),
}
"""$MEASUREMENT, and how much is at stake when the guess is wrong."""


def units_of(header: Mapping[str, Any], options: ReadOptions) -> tuple[Units, list[Finding]]:
    """The unit, and a finding when the file does not say it."""
    code, measurement = (_whole(header.get(name)) for name in ("$INSUNITS", "$MEASUREMENT"))
    said = "no $INSUNITS" if code is None else f"$INSUNITS {code}"
    if options.units is not None:
        unit = options.units.lower()
        return Units(unit, options.mm_per(unit), f"as asked; the file says {said}"), []
    if code in _MM_PER_INSUNIT:
        return Units(*_MM_PER_INSUNIT[code], said), []
    if not code and measurement in _GUESSES:
        name, mm, meaning, severity = _GUESSES[measurement]
        why = f"{said}, but $MEASUREMENT {measurement} ({meaning})"
        message = (
            f"the file names no unit ({why}): read as {name}; if that is wrong, name the unit "
            "with --units"
        )
        return Units(name, mm, why), [Finding(Code.UNIT_GUESSED, severity, message)]
    if code in _NO_PART:
        said = f"{said} ({_NO_PART[code]}, in which no part is drawn)"
    elif code:
        said = f"{said}, which is no unit"
    message = f"the file names no unit ({said}): read as mm; if that is wrong, say it with --units"
    return Units("mm", 1.0, f"taken as mm: {said}"), [
        Finding(Code.UNITLESS, Severity.WARNING, message)
    ]


def _whole(value: Any) -> int | None:
    """A header's number; None when the file does not say it."""
    try:
        return int(float(value))
    except (TypeError, ValueError, OverflowError):
        return None
