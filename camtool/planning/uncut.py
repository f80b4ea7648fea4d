"""What stays uncut because the tool is too wide, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from camtool.findings import Code, Finding, Severity
from camtool.geometry.polylines import Polylines
from camtool.planning.items import Setting
from camtool.planning.places import MOST_PLACES, tool_name
from camtool.planning.reach import Unreached, unreached

CORNER_SHARE = 0.25
"""Pieces up to this part of the tool's disc count as feet of corners, and are told together: that
of a corner of 55 degrees is as large."""


def unreached_findings(
    region: Polylines, setting: Setting, *, hair_mm: float = 0.0
) -> list[Finding]:
    """What a tool within the region (on the left of its closed paths) cannot touch.

    Feet of corners are not told where the operation makes reliefs. Slots narrower than the tool
    by `hair_mm` count as reached.
    """
    tool = setting.operation.tool
    pieces = unreached(region, tool.radius_mm - 0.5 * hair_mm)
    largest_foot = CORNER_SHARE * np.pi * tool.radius_mm**2
    wide = [piece for piece in pieces if piece.area_mm2 > largest_foot]
    feet = [piece for piece in pieces if piece.area_mm2 <= largest_foot]
    if setting.operation.corners != "none":
        feet = []
    return [*_places(wide, tool_name(tool)), *_corners(feet, tool_name(tool))]


def _places(pieces: Sequence[Unreached], called: str) -> Iterator[Finding]:
    for piece in pieces[:MOST_PLACES]:
        yield Finding(
            Code.UNREACHED,
            Severity.WARNING,
            f"{called} is too wide for this place: {piece.area_mm2:.4g} mm² stay uncut",
            where=_where(piece),
            measured=piece.area_mm2,
            unit="mm2",
        )
    rest = pieces[MOST_PLACES:]
    if rest:
        area = sum(piece.area_mm2 for piece in rest)
        yield Finding(
            Code.UNREACHED,
            Severity.WARNING,
            f"{called} is too wide for {len(rest)} more places: {area:.4g} mm² stay uncut",
            where=_where(rest[0]),
            measured=area,
            unit="mm2",
        )


def _corners(pieces: Sequence[Unreached], called: str) -> Iterator[Finding]:
    if not pieces:
        return
    area = sum(piece.area_mm2 for piece in pieces)
    many = "an inner corner keeps" if len(pieces) == 1 else f"{len(pieces)} inner corners keep"
    yield Finding(
        Code.UNREACHED,
        Severity.INFO,
        f"{many} {area:.4g} mm² that {called} does not reach",
        where=_where(pieces[0]),
        measured=area,
        unit="mm2",
    )


def _where(piece: Unreached) -> str:
    return f"at X {piece.at_mm[0]:.4f} Y {piece.at_mm[1]:.4f}"
