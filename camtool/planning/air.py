"""Air: where nothing of the stock is left when an operation begins.

    steps of the plan so far ─what each has cleared, and how deep─┐
    [stock] ─what lies beside it──────────────────────────────────┴▶ regions of air at a level

A region counts as cleared as far as a tool within it surely reaches: its disc, a little wider,
covers it. What a tool with a nose leaves above its tip does not count."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

import numpy as np

from camtool.arrays import Floats
from camtool.geometry.measure import path_extents
from camtool.geometry.nesting import oriented
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import POSITION_EPS_MM, Polyline, Polylines, reverse
from camtool.planning.adaptive import neck_mm
from camtool.planning.clearing import parts_of
from camtool.planning.holes import circle_of
from camtool.planning.items import Air, Fixed, Setting, Step
from camtool.planning.job import MILLS, Operation, Stock

REST_OVERLAP = 0.02
"""The tool that cleared before counts as wider by this share, so that the rest overlaps
its cut."""

BESIDE_TIMES = 20.0
"""The air beside the stock is a band as wide as this many times the tool's radius."""


def left_beside_mm(setting: Setting) -> float:
    """Return the distance that an operation leaves uncut beside the edge, mm: its allowance, and
    on the floor of a carving also the carved slope. The wall of a V bit of half angle α is z tan α
    from the edge at the depth z."""
    operation, carved = setting.operation, setting.operation.rest_of
    if carved is None or carved.contract.rest != "floor" or carved.tool.tip_angle_rad is None:
        return operation.allowance_mm
    slope = math.tan(0.5 * carved.tool.tip_angle_rad)
    return operation.allowance_mm - setting.levels_mm[-1] * slope


def reached(region: Polylines, operation: Operation, left_mm: float) -> Polylines:
    """Return the part of a region that the operation's tool surely reaches, with `left_mm` left at
    its walls. Adaptive clearing leaves necks that are little wider than the tool."""
    wide_mm = (1.0 + REST_OVERLAP) * operation.tool.radius_mm
    if operation.engagement_rad is not None:
        wide_mm = operation.tool.radius_mm + neck_mm(operation.tool.radius_mm)
    return offset_shape(offset_shape(region, left_mm + wide_mm), -wide_mm)


def air_after(step: Step) -> Iterator[Air]:
    """Yield what an operation turns into air: the regions of pockets, bores and holes, and the
    faced top."""
    operation, contract, tool = step.operation, step.operation.contract, step.operation.tool
    deep_mm = step.setting.levels_mm[-1]
    if not step.runs:
        return
    if contract.cuts == "at":
        point_mm = tool.nose_mm
        if tool.kind == "drill" and tool.tip_angle_rad is not None:
            point_mm = tool.radius_mm / math.tan(0.5 * tool.tip_angle_rad)
        if tool.kind in MILLS or point_mm:
            for item in step.items:
                if isinstance(item, Fixed):
                    place = item.runs[0].vertices[0, :2]
                    yield Air(_disc(place, tool.radius_mm), deep_mm + point_mm)
    elif tool.kind not in MILLS:
        return
    elif contract.cuts == "over" and step.setting.stock and step.setting.stock.box_mm:
        yield Air(Polylines.of([_box(step.setting.stock.box_mm)]), deep_mm + tool.nose_mm)
    elif contract.takes == "circles" and contract.clears:
        for item in step.items:
            if isinstance(item, Fixed) and item.outline and (circle := circle_of(item.outline)):
                radius = 0.5 * circle[1] - operation.allowance_mm
                yield Air(_disc(np.array(circle[0]), radius), deep_mm + tool.nose_mm)
    elif contract.clears:
        region = oriented(step.chosen.nesting)
        cleared = reached(region, operation, left_beside_mm(step.setting))
        for part in parts_of(cleared):
            yield Air(part, deep_mm + tool.nose_mm)


def air_at(airs: Iterable[Air], region: Polylines, setting: Setting, level_mm: float) -> Polylines:
    """Return the air at a level in and beside a region of tool centres: what earlier operations
    have cleared that deep, and what lies beside the stock. The regions may overlap."""
    radius = setting.operation.tool.radius_mm
    low, high = _extents(region)
    near = [
        each.region
        for each in airs
        if each.z_mm <= level_mm + POSITION_EPS_MM
        and _meets(each.region, low - radius, high + radius)
    ]
    return Polylines.joined([*near, *_beside(setting.stock, low, high, radius)])


def _beside(stock: Stock | None, low: Floats, high: Floats, radius: float) -> list[Polylines]:
    """Return the air beside a stock of known size, if a region (box `low` to `high`) reaches
    beyond the stock."""
    if stock is None or stock.box_mm is None:
        return []
    box = np.array(stock.box_mm).reshape(2, 2)
    if (low - radius >= box[0]).all() and (high + radius <= box[1]).all():
        return []
    margin = BESIDE_TIMES * radius
    frame = np.concatenate([np.minimum(low, box[0]) - margin, np.maximum(high, box[1]) + margin])
    return [Polylines.of([_box(frame.tolist()), reverse(_box(stock.box_mm))])]


def _extents(region: Polylines) -> tuple[Floats, Floats]:
    boxes = path_extents(region)
    return boxes[:, :, 0].min(axis=0), boxes[:, :, 1].max(axis=0)


def _meets(region: Polylines, low: Floats, high: Floats) -> bool:
    """Return True if the region's bounding box overlaps the box from `low` to `high`."""
    own_low, own_high = _extents(region)
    return bool((own_low < high).all() and (own_high > low).all())


def _box(box_mm: Iterable[float]) -> Polyline:
    x, y, right, high = box_mm
    corners = [[x, y, 0.0], [right, y, 0.0], [right, high, 0.0], [x, high, 0.0]]
    return Polyline(np.array(corners), closed=True)


def _disc(centre: Floats, radius_mm: float) -> Polylines:
    x, y = centre.tolist()
    ends = np.array([[x + radius_mm, y, 1.0], [x - radius_mm, y, 1.0]])
    return Polylines.of([Polyline(ends, closed=True)])
