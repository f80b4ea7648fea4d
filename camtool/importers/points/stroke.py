"""The record that every reader of points makes, before units are known."""

from __future__ import annotations

from dataclasses import dataclass

from camtool.geometry.polylines import Floats

COLUMNS = (2, 3)
"""How many numbers a point may have: x, y, or x, y, bulge."""


@dataclass(frozen=True, eq=False)
class Stroke:
    """One polyline: `points` (n, 2) or (n, 3) of x, y, bulge in the file's unit.

    `source` says where it stands in the file; `closed` is None when the file does not say: then
    a stroke is closed that ends where it began.
    """

    points: Floats
    source: str
    closed: bool | None = None
    layer: str = "0"


@dataclass(frozen=True, eq=False)
class Table:
    """All strokes of a file, its unit (None when the file names none), and why we believe it.

    `mm_per_unit` is needed for a unit that is none of `camtool.units` alone.
    """

    strokes: list[Stroke]
    unit: str | None = None
    mm_per_unit: float | None = None
    why: str = "named in the file"
