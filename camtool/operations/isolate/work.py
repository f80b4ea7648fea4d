"""Isolation of the nets of a board: the tool runs beside the copper, as wide as it is at the top.

       ├ r ┤                  copper  ▒▒▒▒▒╲   ╱▒▒▒▒▒▒
            the drawn edge ┊           ▒▒▒▒▒╲ ╱▒▒▒▒▒▒▒
                                       board  V

The axis runs r(D) beside the copper: the radius of the tool D above its tip, where the top of the
copper passes it. That is a chamfer whose bevel has no width, so that a V bit and a mill are the
same here. `isolation` adds rings farther out, which overlap at the bottom of the copper. Whether
the nets are apart then, and whole, is proved on the predicted cut (`camtool.stock.nets`)."""

from __future__ import annotations

import numpy as np

from camtool.errors import OptionError
from camtool.operations.chamfer.work import chamfer
from camtool.planning.items import Chosen, Setting, Work
from camtool.planning.job import Operation, Stock
from camtool.planning.naming import key_of
from camtool.records import replace

OVERLAP = 0.2
"""Rings overlap by this share of the width of the tool at the bottom of the copper."""

MAX_RINGS = 50


def isolated(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation with its tip offset set to the depth: the axis then runs beside the
    drawn edge by the tool's radius at the top of the copper.

    OptionError without a depth, for a depth that leaves copper, for a tool without width there,
    and for an isolation narrower than one cut or with too many rings."""
    copper_mm = operation.own_value("copper")
    if operation.depth_mm is None:
        raise OptionError(
            "an isolation has no depth",
            where=key_of(operation, "depth"),
            mend='say how deep the tip goes, more than the copper: depth = "0.1mm"',
        )
    if not 0.0 < copper_mm < operation.depth_mm:
        raise OptionError(
            f"{operation.depth_mm:g} mm of depth do not cut through {copper_mm:g} mm of copper",
            where=key_of(operation, "depth"),
            mend="give more depth, or the thickness of your copper (copper)",
        )
    depth_mm = operation.depth_mm
    if _one_cut_mm(operation) <= 0.0:
        raise OptionError(
            "the tool has no width at the bottom of the copper",
            where=key_of(operation, "tool"),
            mend="give a tool with a diameter or an angle",
        )
    settled = replace(operation, tip_offset_mm=depth_mm)
    width_mm = operation.own_value("isolation")
    one_mm = _one_cut_mm(operation)
    if width_mm is not None and width_mm < one_mm:
        raise OptionError(
            f"an isolation of {width_mm:g} mm is less than one cut of this tool, {one_mm:.4g} mm",
            where=key_of(operation, "isolation"),
            mend="leave it out, or take a finer tool",
        )
    if _ring_count(settled) > MAX_RINGS:
        raise OptionError(
            f"an isolation of {width_mm:g} mm needs more than {MAX_RINGS} rings",
            where=key_of(operation, "isolation"),
            mend="give less, or clear the rest with a wider tool",
        )
    return settled


def isolate(chosen: Chosen, setting: Setting) -> Work:
    """Return the contours round the copper, the ring beside it first. Only that ring must be
    complete, so only its findings are kept."""
    first, *rings = (
        chamfer(chosen, replace(setting, operation=replace(setting.operation, allowance_mm=each)))
        for each in _rings_mm(setting.operation)
    )
    items = [*first.items]
    for ring in rings:
        items += ring.items
    return Work(tuple(items), first.findings)


def _one_cut_mm(operation: Operation) -> float:
    """Return the width of a single cut at the bottom of the copper, mm."""
    copper_mm = operation.own_value("copper")
    return 2.0 * operation.tool.radius_at((operation.depth_mm or 0.0) - copper_mm)


def _ring_count(operation: Operation) -> float:
    """Return the number of rings as a whole float, since widths that are absurdly large are
    checked with it."""
    width_mm, one_mm = operation.own_value("isolation"), _one_cut_mm(operation)
    if width_mm is None or width_mm <= one_mm:
        return 1.0
    return float(np.ceil((width_mm - one_mm) / ((1.0 - OVERLAP) * one_mm))) + 1.0


def _rings_mm(operation: Operation) -> list[float]:
    """Return the distances of the rings from the first one, mm, evenly spaced with at least
    OVERLAP."""
    count = round(_ring_count(operation))
    if count == 1:
        return [0.0]
    wider_mm = operation.own_value("isolation") - _one_cut_mm(operation)
    return [wider_mm * k / (count - 1) for k in range(count)]
