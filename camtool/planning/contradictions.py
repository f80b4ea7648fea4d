"""Settings of a job that are fine one by one and cannot be together: OptionError names the key."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from camtool.errors import OptionError
from camtool.planning.ranges import FARTHEST_MM, MOST

if TYPE_CHECKING:
    from camtool.planning.job import Entry, Operation, Placement, Tool


def refuse_tool(tool: Tool) -> None:
    """Refuse a tip that is no cone, or as wide as its tool."""
    angle = tool.tip_angle_rad
    if angle is not None and not 0.0 < angle < math.pi:
        raise OptionError(
            f"tip angle {math.degrees(angle):g}° is not between 0 and 180°",
            mend="give the full angle of the cone, such as 60deg",
        )
    if 0.0 < tool.diameter_mm <= tool.tip_diameter_mm:
        raise OptionError(
            f"the tip of {tool.tip_diameter_mm:g} mm is as wide as the tool",
            where="key tip_diameter",
            mend="give a smaller tip, or a wider tool",
        )


def refuse_entry(entry: Entry) -> None:
    """Refuse a slope that is none."""
    if not entry.angle_rad < 0.5 * math.pi:
        raise OptionError(
            f"ramp angle {math.degrees(entry.angle_rad):g}° is not below 90°",
            mend="give a smaller angle, or plunge",
        )


def refuse_operation(operation: Operation) -> None:
    """Refuse an operation whose settings contradict one another."""
    depth, last = operation.depth_mm, operation.last_pass_mm
    if depth is not None and last is not None and last > depth:
        raise OptionError(
            f"the last pass of {last:g} mm is deeper than the whole cut of {depth:g} mm",
            where=f"{_named(operation)}key last_pass",
            mend="give a smaller last pass, or a larger depth",
        )
    if operation.entry.kind == "helix" and operation.kind != "pocket":
        raise OptionError(
            f"a helix goes into pockets, not into what the kind {operation.kind} cuts",
            where=f"{_named(operation)}key entry",
            mend='use "ramp" or "plunge"',
        )


def refuse_placement(placement: Placement) -> None:
    """Refuse a placement of numbers that are none, and of settings that contradict each other."""
    if placement.fit_mm is not None:
        _refuse_fit(placement.fit_mm)
        if placement.scale != 1.0:
            raise OptionError(
                f"scale {placement.scale:g} and fit contradict each other",
                where="key scale",
                mend="give one of the two",
            )
    _refuse_beyond("pitch", placement.pitch_mm, -MOST["mm"], MOST["mm"])
    if not isinstance(placement.origin, str):
        _refuse_beyond("origin", placement.origin, -FARTHEST_MM, FARTHEST_MM)
    for what, count, pitch in zip(
        ("columns", "rows"), placement.copies, placement.pitch_mm, strict=True
    ):
        if count > 1 and pitch == 0.0:
            raise OptionError(
                f"{count} {what} of copies lie on one another",
                where="key copies",
                mend="give the pitch from one copy to the next",
            )
    if placement.copies == (1, 1) and any(placement.pitch_mm):
        raise OptionError(
            "a pitch, but no copies",
            where="key pitch",
            mend="give copies too, such as 3x2, or leave the pitch out",
        )


def _refuse_fit(fit_mm: tuple[float, float]) -> None:
    _refuse_beyond("fit", fit_mm, 0.0, MOST["mm"])
    if not any(fit_mm):
        raise OptionError(
            f"nothing fits into {fit_mm[0]:g} by {fit_mm[1]:g} mm",
            where="key fit",
            mend="give a width and a height above 0, or one of them and 0 for any",
        )


def _refuse_beyond(key: str, lengths: tuple[float, float], least: float, most: float) -> None:
    """Refuse lengths that are none, or not plausible."""
    for length in lengths:
        if not least <= length <= most:
            raise OptionError(
                f"{length:g} mm is not between {least:g} and {most:g}",
                where=f"key {key}",
                mend="give lengths of a machine",
            )


def _named(operation: Operation) -> str:
    return f"operation {operation.name!r}, " if operation.name else ""
