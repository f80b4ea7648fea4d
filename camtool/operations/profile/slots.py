"""Trochoidal slots: a band beside the walls, wider than the tool, cleared with a limit of its
engagement.

The walls are those of an ordinary profile (`work.profile`), with what is to stay on their left.
The band are the places of the tool's centre that are not farther from a wall than the slot is
wider than the tool. So bands of neighbours merge, and holes that are narrower are cleared wholly.
Circles run along the middle of the band (`camtool.planning.trochoids`); the cusps that they leave
at the wall are cleared, those on the other side stay. A pass along the wall comes last. On lines
the band lies on both sides, and is cleared to its edges."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from msgspec import Struct

from camtool.arrays import Ints
from camtool.errors import OptionError
from camtool.geometry.distance import nearest
from camtool.geometry.measure import path_lengths
from camtool.geometry.offset import offset_shape
from camtool.geometry.polylines import Polyline, Polylines, Segments, reverse_lines
from camtool.planning.adaptive import (
    CORNER_SHARE,
    entry_mm,
    mirrored,
    refuse_feeds_and_lift,
    refuse_strategy,
    runs_of,
    wide_parts,
)
from camtool.planning.items import Chosen, Fixed, Setting
from camtool.planning.job import Operation, Stock, refuse_endless
from camtool.planning.naming import key_of, tool_name
from camtool.planning.trochoids import band_of, cusp_mm, trochoid_stays, trochoid_step

MIN_SLOT_SHARE = 1.1
MAX_SLOT_SHARE = 3.0
"""Narrowest and widest slot, over the tool's diameter."""

FOOT_SHARE = 1.1 * CORNER_SHARE
"""Radius of the finishing pass in corners of a slot, over the tool's radius."""

MOVES_ROUND = 5.0
"""Number of moves of one circle and its way back, for an estimate."""

NEAR_SHARE = 0.05
"""A wall begins no farther than this part of the tool's radius from the band that it bounds."""


def checked_slot(operation: Operation, _: Stock | None) -> Operation:
    """Return the operation unchanged. OptionError for a strategy that profiles do not have, for a
    slot too narrow or too wide, and for settings that contradict a slot."""
    refuse_strategy(operation, "trochoidal")
    if not operation.makes_slots:
        return operation

    def refuse(key: str, message: str, mend: str) -> OptionError:
        return OptionError(message, where=key_of(operation, key), mend=mend)

    tool = operation.tool
    if not tool.diameter_mm:
        raise refuse("tool", "a trochoidal slot needs a tool that cuts a width", "give a diameter")
    width = operation.spare_mm + tool.diameter_mm
    low, high = MIN_SLOT_SHARE * tool.diameter_mm, MAX_SLOT_SHARE * tool.diameter_mm
    if not low <= width <= high:
        raise refuse(
            "slot_width",
            f"a slot of {width:.4g} mm is not within {low:.4g} mm and {high:.4g} mm,"
            f" {MIN_SLOT_SHARE:g} and {MAX_SLOT_SHARE:g} times the diameter of {tool_name(tool)}",
            "give a width within these; a pocket clears more",
        )
    for key, is_plain in (
        ("tabs", operation.tabs is None),
        ("corners", operation.corners == "none"),
        ("joins", operation.joins == "round"),
    ):
        if not is_plain:
            raise refuse(
                key,
                "does not go with a trochoidal slot",
                'leave it out, or give strategy = "passes"',
            )
    return operation


class SlotWall(Struct, frozen=True, eq=False):
    """A path of the tool's centre along a wall, with the material that stays on its left, and the
    chosen path that it belongs to."""

    path: Polyline
    source: int


def without_feet(path: Polyline, tool_mm: float) -> Polyline:
    """Return the path of a tool along a wall (material on its left) with inner corners rounded to
    the radius up to which the discs of a slot clear. In the sharp corners left between these discs
    the finishing pass would be engaged more."""
    radius = FOOT_SHARE * tool_mm
    free_side = reverse_lines(Polylines.of([path]))
    reached = reverse_lines(offset_shape(offset_shape(free_side, radius), -radius))
    return reached[0] if len(reached) == 1 else path


class _Band(Struct, frozen=True, eq=False):
    """A region of tool centres to be cleared; the lines along its middle; the paths that bound it
    (Polylines), and the chosen path that each of these belongs to."""

    region: Polylines
    lines: Polylines
    bounds: Polylines
    sources: Ints


def slot_items(
    walls: list[SlotWall], open_rows: list[int], chosen: Chosen, setting: Setting
) -> list[Fixed]:
    """Return one item for each connected slot, beside walls and along open paths."""
    refuse_feeds_and_lift(setting)
    bands = list(_beside(walls, chosen, setting.operation))
    spare = setting.operation.spare_mm
    if open_rows:
        lines = chosen.lines.select(open_rows)
        bands.append(_Band(band_of(lines, 0.5 * spare), lines, lines, np.array(open_rows)))
    _refuse_endless(bands, setting)
    return [item for band in bands for item in _items(band, chosen, setting)]


def _beside(walls: list[SlotWall], chosen: Chosen, operation: Operation) -> Iterator[_Band]:
    """Yield the bands beside walls, one for the walls of each region, without the cusps that
    trochoids leave on the far side."""
    half = 0.5 * operation.spare_mm
    assert operation.engagement_rad is not None
    cusp = cusp_mm(half, operation.tool.radius_mm, operation.engagement_rad)
    depth = chosen.nesting.levels.depth
    regions: dict[int, list[SlotWall]] = {}
    for wall in walls:
        number = int(depth[wall.source])
        if operation.side == "auto":
            number = (number + chosen.rim[wall.source]) % 2
        regions.setdefault(number, []).append(wall)
    for group in regions.values():
        bounds = Polylines.of(wall.path for wall in group)
        far = offset_shape(bounds, cusp - 2.0 * half)
        yield _Band(
            Polylines.joined([far, reverse_lines(bounds)]),
            offset_shape(bounds, -half),
            bounds,
            np.array([wall.source for wall in group]),
        )


def _refuse_endless(bands: list[_Band], setting: Setting) -> None:
    """Raise OptionError if the bands would take more circles than is reasonable for any
    machine."""
    operation = setting.operation
    assert operation.engagement_rad is not None
    half = 0.5 * operation.spare_mm
    step = trochoid_step(half, operation.tool.radius_mm, operation.engagement_rad)
    total = sum(float(path_lengths(band.lines).sum()) for band in bands)
    refuse_endless(
        MOVES_ROUND * len(setting.levels_mm) * total / step,
        key_of(operation, "engagement"),
        f"circles every {step:.3g} mm along {total:.4g} mm",
        "give a larger engagement, or a wider slot",
        is_long=operation.may_be_long,
    )


def _items(band: _Band, chosen: Chosen, setting: Setting) -> Iterator[Fixed]:
    """Yield one item for each connected part of a band."""
    operation, tool_mm = setting.operation, setting.operation.tool.radius_mm
    half = 0.5 * operation.spare_mm
    assert operation.engagement_rad is not None
    starts = band.bounds.vertices[band.bounds.offsets[:-1], :2]
    for part in wide_parts(band.region, tool_mm):
        distances = nearest(starts, Segments.of(part)).distance
        row = int(band.sources[distances.argmin()])
        region, lines = part, band.lines
        if operation.direction == "conventional":
            region, lines = mirrored(region), mirrored(lines)
        stays = trochoid_stays(
            region, lines, half, entry_mm(operation), tool_mm, operation.engagement_rad
        )
        runs = runs_of(stays, setting, chosen.names[row])
        yield Fixed(
            tuple(runs),
            setting,
            chosen.names[row],
            int(chosen.source[row]),
            outline=part[0],
            centre_lines=Polylines.joined([part, band.lines]),
        )
