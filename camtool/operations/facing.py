"""Facing: the top of the stock is cleared down to a depth, in straight lines or in rings.

The tool's centre runs over the rectangle of the stock, larger by the overhang on all four sides.
Half of the tool is always beyond its centre, so an overhang of 0 clears the whole top too; with
one of the tool's radius (the default) the tool leaves the stock at every edge.

      ╭─────────────────╮   the first round of the centre, overhang beyond the stock
      │ ┌─────────────┐ │
      │ │ ──────────▶ │ │   then lines a step-over apart, or rings from the outside in
      │ │ ◀────────── │ │
      │ └─────────────┘ │
      ╰─────────────────╯

The paths are those of a pocket, travelled backwards: so the tool comes down on the outermost
round, beside the stock where the overhang is as large as its radius, and not in the middle of it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from camtool.errors import OptionError
from camtool.keys import LENGTH, Key
from camtool.planning.job import MILLS, refuse_endless
from camtool.planning.kinds import COMMON_KEYS, OperationKind

if TYPE_CHECKING:
    from camtool.planning.items import Chosen, Setting, Work
    from camtool.planning.job import Operation, Stock

FACING = OperationKind(
    name="facing",
    work="camtool.operations.facing:faced",
    settle="camtool.operations.facing:checked",
    keys=(
        *COMMON_KEYS,
        "direction",
        "depth",
        "step_down",
        "last_pass",
        "entry",
        "pattern",
        "step_over",
        "angle",
    ),
    own={
        "overhang": Key(
            "overhang_mm", LENGTH, "How far a facing tool runs beyond the stock.", '"2mm"'
        )
    },
    rank=8,
    takes="nothing",
    cuts="over",
    cut_name="top",
    reason="it clears the top of the stock",
)

MAX_OVERHANG_MM = 1000.0


def overhang_mm(operation: Operation) -> float:
    """Return how far the outermost round of the tool's centre lies outside the stock, mm: as
    given, or the tool's radius."""
    given_mm: float | None = operation.own_value("overhang")
    return operation.tool.radius_mm if given_mm is None else given_mm


def checked(operation: Operation, stock: Stock | None) -> Operation:
    """Return the operation unchanged. OptionError without a stock of known size, for a depth as
    large as its thickness, for a tool that leaves no flat top, and for an overhang below 0 or
    above MAX_OVERHANG_MM."""
    from camtool.planning.naming import key_of

    if stock is None or stock.box_mm is None:
        raise OptionError(
            "the size of the stock, whose top is cleared, is not known",
            where=key_of(operation, "kind"),
            mend="write [stock] with its corner, size and thickness",
        )
    tool = operation.tool
    if tool.kind not in MILLS or not tool.diameter_mm:
        tool_words = f"one of kind {tool.kind!r}" if tool.diameter_mm else "one of no width"
        raise OptionError(
            f"facing needs an end mill, not {tool_words}",
            where=key_of(operation, "tool"),
            mend="give a flat tool and its diameter",
        )
    depth = operation.depth_mm
    if depth is not None and depth >= stock.thickness_mm:
        raise OptionError(
            f"{depth:g} mm is all of the stock, which is {stock.thickness_mm:g} mm thick",
            where=key_of(operation, "depth"),
            mend="give a smaller depth",
        )
    overhang = overhang_mm(operation)
    if not 0.0 <= overhang <= MAX_OVERHANG_MM:
        raise OptionError(
            f"an overhang of {overhang:g} mm is not between 0 and {MAX_OVERHANG_MM:g} mm",
            where=key_of(operation, "overhang"),
            mend="give 0 or more: how far the tool's centre runs beyond the stock",
        )
    return operation


def faced(_: Chosen, setting: Setting) -> Work:
    """Return one item with the runs that clear the top of the stock at all levels of the setting.

    OptionError for a step-over so small that the passes would be too many."""
    import numpy as np

    from camtool.geometry.polylines import Polyline, Polylines
    from camtool.operations.pocket.work import clearing_paths, down_for, lowered_runs, over_floor
    from camtool.planning.clearing import ConnectedRegion
    from camtool.planning.items import CutRun, Fixed, Work
    from camtool.planning.naming import key_of
    from camtool.planning.paths import reverse_vertices

    operation, stock = setting.operation, setting.stock
    assert stock is not None, "checked"
    assert stock.box_mm is not None, "checked"
    overhang = overhang_mm(operation) * np.array([-1.0, -1.0, 1.0, 1.0])
    left_x, low, right, high = (np.array(stock.box_mm) + overhang).tolist()
    step = operation.step_over * operation.tool.diameter_mm
    lines = max(right - left_x, high - low) / step
    refuse_endless(
        2.0 * lines * len(setting.levels_mm),
        key_of(operation, "step_over"),
        f"{lines:.3g} lines {step:g} mm apart",
        "give a larger step-over, or a larger tool",
        is_long=operation.may_be_long,
    )
    corners = np.array([[left_x, low], [right, low], [right, high], [left_x, high]])
    region = Polylines.of([Polyline(np.insert(corners, 2, 0.0, axis=1), closed=True)])
    floor = over_floor(ConnectedRegion(region))
    runs: list[CutRun] = []
    for path, _region in clearing_paths(region, operation):
        inwards = reverse_vertices(path)
        way_down = down_for(inwards, None, None, setting)
        runs += lowered_runs(inwards, way_down, floor, setting, "stock")
    return Work((Fixed(tuple(runs), setting, "stock"),))
